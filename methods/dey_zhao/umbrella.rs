//! Step 2: the umbrellas.

use medial::Vec3;
use medial::geometry::{CellId, Delaunay, Pole, Sphere, VertexId, first_poles};
use rayon::prelude::*;

/// A triangle of the umbrella of a sample.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    /// Its corners beside the sample.
    pub others: [VertexId; 2],
    /// Unit normal, of either sign.
    pub normal: Vec3,
    /// Radius of its circumcircle.
    pub circumradius: f64,
}

/// The umbrellas of all samples: about `p` the Delaunay triangles whose dual Voronoi edge has its
/// ends on both sides of the plane through `p` normal to the pole vector.
pub(super) struct Umbrellas {
    /// `triangles[start[p]..start[p + 1]]` belong to sample `p`.
    start: Vec<u32>,
    triangles: Vec<Triangle>,
    missing: usize,
    flat: usize,
}

impl Umbrellas {
    /// From the circumspheres of all finite cells. Cost `O(n)` in the number of cells; parallel, the same for any number of threads.
    pub fn new(delaunay: &Delaunay, spheres: &[Option<Sphere>]) -> Self {
        let pole_vectors = pole_vectors(delaunay, spheres);
        let ahead = corners_ahead(delaunay, spheres, &pole_vectors);
        let parts: Vec<(Vec<(u32, Triangle)>, usize)> = (0..delaunay.finite_cell_count() as u32)
            .into_par_iter()
            .chunks(4096)
            .map(|cells| {
                let (mut found, mut flat) = (Vec::new(), 0);
                for cell in cells {
                    let cell = CellId(cell);
                    crossing(delaunay, &ahead, &pole_vectors, cell, &mut found, &mut flat);
                }
                (found, flat)
            })
            .collect();
        // A counting sort keeps the order of the cells within each sample.
        let mut start = vec![0_u32; delaunay.point_count() + 2];
        for (p, _) in parts.iter().flat_map(|part| &part.0) {
            start[*p as usize + 2] += 1;
        }
        for p in 2..start.len() {
            start[p] += start[p - 1];
        }
        let total = start[start.len() - 1] as usize;
        let nothing = Triangle { others: [VertexId(0); 2], normal: Vec3::ZERO, circumradius: 0.0 };
        let mut triangles = vec![nothing; total];
        for &(p, triangle) in parts.iter().flat_map(|part| &part.0) {
            let place = &mut start[p as usize + 1];
            triangles[*place as usize] = triangle;
            *place += 1;
        }
        start.pop();
        let mut umbrellas = Self { start, triangles, missing: 0, flat: 0 };
        umbrellas.flat = parts.iter().map(|part| part.1).sum();
        let samples = (0..delaunay.point_count() as u32).map(VertexId);
        umbrellas.missing =
            samples.filter(|&p| delaunay.is_vertex(p) && umbrellas.of(p).is_empty()).count();
        umbrellas
    }

    /// The umbrella of a sample.
    pub fn of(&self, p: VertexId) -> &[Triangle] {
        &self.triangles[self.start[p.index()] as usize..self.start[p.index() + 1] as usize]
    }

    /// Samples without a triangle.
    pub fn missing(&self) -> usize {
        self.missing
    }

    /// Triangles that were left out because they have no normal, once for each sample.
    pub fn flat(&self) -> usize {
        self.flat
    }
}

/// For each sample the vector to its pole; of any length where the pole is at infinity. Zero for
/// one without a pole.
fn pole_vectors(delaunay: &Delaunay, spheres: &[Option<Sphere>]) -> Vec<Vec3> {
    let vector = |(sample, pole): (usize, Option<Pole>)| match pole {
        Some(Pole::Vertex(cell)) => {
            let p = delaunay.point(VertexId(sample as u32));
            spheres[cell.index()].map_or(Vec3::ZERO, |sphere| sphere.centre - p)
        }
        Some(Pole::Infinite(direction)) => direction,
        None => Vec3::ZERO,
    };
    first_poles(delaunay, spheres).into_iter().enumerate().map(vector).collect()
}

/// For each finite cell the corners, as bits, to which its Voronoi vertex is on the pole's side; `None`
/// for a vertex that is not representable.
fn corners_ahead(
    delaunay: &Delaunay,
    spheres: &[Option<Sphere>],
    pole_vectors: &[Vec3],
) -> Vec<Option<u8>> {
    let of_cell = |(cell, sphere): (usize, &Option<Sphere>)| {
        let centre = (*sphere)?.centre;
        let corners = delaunay.vertices(CellId(cell as u32)).into_iter().enumerate();
        Some(corners.fold(0, |bits, (k, v)| {
            let ahead = (centre - delaunay.point(v)).dot(pole_vectors[v.index()]) >= 0.0;
            bits | u8::from(ahead) << k
        }))
    };
    spheres.par_iter().enumerate().with_min_len(1024).map(of_cell).collect()
}

/// Adds the facets of a cell, each from its smaller cell, to the umbrellas that they belong to.
fn crossing(
    delaunay: &Delaunay,
    ahead: &[Option<u8>],
    pole_vectors: &[Vec3],
    cell: CellId,
    found: &mut Vec<(u32, Triangle)>,
    flat: &mut usize,
) {
    let Some(here) = ahead[cell.index()] else { return };
    let (vertices, neighbours) = (delaunay.vertices(cell), delaunay.neighbours(cell));
    for opposite in 0..4 {
        let other = neighbours[opposite];
        if other < cell {
            continue;
        }
        let places = [1, 2, 3].map(|k| (opposite + k) % 4);
        let facet = places.map(|k| vertices[k]);
        let there = match ahead.get(other.index()) {
            Some(&Some(bits)) => {
                let corners = delaunay.vertices(other);
                facet.map(|v| {
                    let k = corners.iter().position(|&w| w == v).expect("a shared corner");
                    bits >> k & 1 == 1
                })
            }
            Some(None) => continue,
            None => {
                let corners = facet.map(|v| delaunay.point(v));
                let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
                let inwards = delaunay.point(vertices[opposite]) - corners[0];
                let outwards = if normal.dot(inwards) > 0.0 { -normal } else { normal };
                facet.map(|v| outwards.dot(pole_vectors[v.index()]) >= 0.0)
            }
        };
        let mut shape = None;
        for k in 0..3 {
            if (here >> places[k] & 1 == 1) == there[k] {
                continue;
            }
            let corners = || facet.map(|v| delaunay.point(v));
            let Some((normal, circumradius)) = *shape.get_or_insert_with(|| measure(corners()))
            else {
                *flat += 1;
                continue;
            };
            let others = [facet[(k + 1) % 3], facet[(k + 2) % 3]];
            found.push((facet[k].0, Triangle { others, normal, circumradius }));
        }
    }
}

/// Unit normal and circumradius; `None` without area.
fn measure([a, b, c]: [Vec3; 3]) -> Option<(Vec3, f64)> {
    let (u, v) = (b - a, c - a);
    let normal = u.cross(v);
    let area = normal.length();
    let circumradius = u.length() * v.length() * (c - b).length() / (2.0 * area);
    (area > 0.0 && circumradius.is_finite()).then(|| (normal / area, circumradius))
}
