//! Kernels on points, balls and complexes that are made of bytes.

use medial::Vec3;
use medial::complex::collapse::{CollapseComplex, replay};
use medial::complex::{MedialMesh, Sphere, betti};
use medial_geometry::{Delaunay, DualComplex, Regular};

/// More points than these find nothing new and take long to check.
const MOST: usize = 48;

/// Numbers out of bytes: the first byte selects the kind. Small whole ones meet in every degeneracy there is; any bits
/// at all, for the range.
struct Numbers<'b> {
    bytes: &'b [u8],
    any_bits: bool,
}

impl<'b> Numbers<'b> {
    fn of(bytes: &'b [u8]) -> Option<Self> {
        let (kind, bytes) = bytes.split_first()?;
        Some(Self { bytes, any_bits: kind % 4 == 3 })
    }

    fn byte(&mut self) -> Option<u8> {
        let (first, rest) = self.bytes.split_first()?;
        self.bytes = rest;
        Some(*first)
    }

    fn number(&mut self) -> Option<f64> {
        if !self.any_bits {
            return self.byte().map(|byte| f64::from(byte as i8) / 8.0);
        }
        let (first, rest) = self.bytes.split_first_chunk::<8>()?;
        self.bytes = rest;
        Some(f64::from_le_bytes(*first))
    }

    fn point(&mut self) -> Option<Vec3> {
        Some(Vec3::new(self.number()?, self.number()?, self.number()?))
    }
}

pub(crate) fn triangulation(bytes: &[u8]) {
    let Some(mut numbers) = Numbers::of(bytes) else { return };
    let (mut points, mut weights) = (Vec::new(), Vec::new());
    while let (Some(point), Some(weight)) = (numbers.point(), numbers.number()) {
        points.push(point);
        weights.push(weight);
        if points.len() == MOST {
            break;
        }
    }
    // Points that are not finite or out of range are rejected.
    if let Ok(delaunay) = Delaunay::new(&points) {
        delaunay.check().expect("a triangulation");
    }
    if let Ok(regular) = Regular::new(&points, &weights) {
        regular.check().expect("a triangulation");
    }
}

pub(crate) fn dual_complex(bytes: &[u8]) {
    let Some(mut numbers) = Numbers::of(bytes) else { return };
    let mut balls = Vec::new();
    while let (Some(centre), Some(radius)) = (numbers.point(), numbers.number()) {
        balls.push(Sphere::new(centre, radius));
        if balls.len() == MOST {
            break;
        }
    }
    let Ok(regular) = Regular::new(
        &balls.iter().map(|ball| ball.centre).collect::<Vec<_>>(),
        &balls.iter().map(|ball| ball.radius * ball.radius).collect::<Vec<_>>(),
    ) else {
        return;
    };
    let dual = DualComplex::new(&regular);
    dual.check().expect("a complex");
    let [b0, b1, b2] = dual.betti().map(|number| number as i64);
    assert_eq!(b0 - b1 + b2, dual.euler());
}

/// Spheres of a complex; more make more of the same.
const SPHERES: u8 = 12;

pub(crate) fn collapse(bytes: &[u8]) {
    let Some((&simplices, bytes)) = bytes.split_first() else { return };
    let mut numbers = Numbers { bytes, any_bits: false };
    let mut spheres = Vec::new();
    for _ in 0..SPHERES {
        let Some(centre) = numbers.point() else { return };
        spheres.push(Sphere::new(centre, f64::from(spheres.len() as u8)));
    }
    let (mut edges, mut faces) = (Vec::new(), Vec::new());
    for _ in 0..simplices {
        let mut corner = || numbers.byte().map(|byte| u32::from(byte % SPHERES));
        let (Some(a), Some(b), Some(c)) = (corner(), corner(), corner()) else { return };
        // Two equal corners make an edge of a face.
        if a == b || b == c || a == c {
            edges.push([a, if a == b { c } else { b }]);
        } else {
            faces.push([a, b, c]);
        }
    }
    edges.retain(|[a, b]| a != b);
    let Ok(mesh) = MedialMesh::from_simplices(spheres, edges, faces) else { return };
    let mut complex = CollapseComplex::from_mesh(&mesh).recording();
    let homotopy = betti(&mesh);
    while let (Some(which), Some(place)) = (numbers.byte(), numbers.point()) {
        let edges: Vec<[u32; 2]> = complex.edges().collect();
        if edges.is_empty() {
            break;
        }
        let [a, b] = edges[usize::from(which) % edges.len()];
        if complex.keeps_homotopy(a, b) {
            complex.collapse(a, b, Sphere::new(place, 1.0));
            complex.check().expect("a complex");
            assert_eq!(betti(&complex.to_mesh()), homotopy);
        }
    }
    assert_eq!(replay(&mesh, complex.record()), complex.to_mesh());
}
