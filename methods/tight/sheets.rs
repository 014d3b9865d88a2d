//! Which faces of a medial mesh cross, and which a collapse would make cross.
//!
//! A pair that crosses already may go on doing so: its image under the collapse is known. Any other pair is a
//! reason against the collapse.

use medial::Vec3;
use medial::complex::collapse::CollapseComplex;
use medial::complex::{Crossings, MedialMesh, Sphere};
use medial::geometry::trees::Bounds;
use medial::geometry::triangles_meet;

type Face = [u32; 3];

/// The faces of a complex that shrinks during a pass.
pub(super) struct Sheets<'a> {
    mesh: &'a MedialMesh,
    /// The faces as they were when the pass began.
    first: Crossings,
    /// Pairs that cross, by the vertices that they have now.
    known: Vec<[Face; 2]>,
    /// Faces that collapses moved.
    moved: Vec<Face>,
    /// Spheres that collapses moved or took away.
    is_moved: Vec<bool>,
}

impl<'a> Sheets<'a> {
    pub fn new(mesh: &'a MedialMesh) -> Self {
        let first = Crossings::new(mesh.faces.clone(), |f| corners(mesh, mesh.faces[f as usize]));
        let pairs = first.pairs().into_iter();
        let known = pairs.map(|pair| pair.map(|f| mesh.faces[f as usize])).collect();
        Self { mesh, first, known, moved: vec![], is_moved: vec![false; mesh.spheres.len()] }
    }

    /// Whether the faces around an edge would cross others, or each other, if its ends were merged at a place.
    pub fn would_cross(&self, complex: &CollapseComplex, [a, b]: [u32; 2], at: Sphere) -> bool {
        let place = |v: u32| if v == a { at.centre } else { complex.sphere(v).centre };
        let star = star(complex, [a, b]);
        let is_star = |face: &Face| face.contains(&a) || face.contains(&b);
        star.iter().enumerate().any(|(i, &face)| {
            let own = face.map(place);
            let crosses = |other: Face, corners: [Vec3; 3]| {
                triangles_meet(face, own, other, corners) && !self.is_known([a, b], face, other)
            };
            let still = self.first.of(face, own).into_iter().map(|f| self.mesh.faces[f as usize]);
            let still = still.filter(|other| !other.iter().any(|&v| self.is_moved[v as usize]));
            if still.filter(|other| !is_star(other)).any(|f| !self.is_known([a, b], face, f)) {
                return true;
            }
            let bounds = Bounds::of_points(own);
            let near = |corners: [Vec3; 3]| bounds.overlaps(&Bounds::of_points(corners));
            let moved = self.moved.iter().filter(|other| !is_star(other));
            let mut moved = moved.map(|&other| (other, other.map(place)));
            let mut star = star[i + 1..].iter().map(|&other| (other, other.map(place)));
            moved.any(|(other, corners)| {
                let [p, q, r] = other;
                near(corners) && complex.has_face(p, q, r) && crosses(other, corners)
            }) || star.any(|(other, corners)| crosses(other, corners))
        })
    }

    /// Takes note of a collapse before it is made.
    pub fn collapse(&mut self, complex: &CollapseComplex, [a, b]: [u32; 2]) {
        self.moved.extend(star(complex, [a, b]));
        (self.is_moved[a as usize], self.is_moved[b as usize]) = (true, true);
        for face in self.known.iter_mut().flatten() {
            face.iter_mut().filter(|v| **v == b).for_each(|v| *v = a);
            face.sort_unstable();
        }
    }

    /// Whether a pair of faces, or two that the collapse of an edge maps to them, cross already.
    fn is_known(&self, [a, b]: [u32; 2], face: Face, other: Face) -> bool {
        let mapped = |mut face: Face| {
            face.iter_mut().filter(|v| **v == b).for_each(|v| *v = a);
            face.sort_unstable();
            face
        };
        let pair = [face, other];
        self.known.iter().any(|known| {
            let [f, g] = known.map(mapped);
            pair == [f, g] || pair == [g, f]
        })
    }
}

/// The faces around an edge once it is collapsed to its first end.
fn star(complex: &CollapseComplex, [a, b]: [u32; 2]) -> Vec<Face> {
    let sides = complex.opposite_sides(a).iter().chain(complex.opposite_sides(b));
    let sides = sides.filter(|side| !side.contains(&a) && !side.contains(&b));
    let mut faces: Vec<Face> = sides
        .map(|&[p, q]| {
            let mut face = [a, p, q];
            face.sort_unstable();
            face
        })
        .collect();
    faces.sort_unstable();
    faces.dedup();
    faces
}

/// The centres of a face.
pub(super) fn corners(mesh: &MedialMesh, face: Face) -> [Vec3; 3] {
    face.map(|v| mesh.spheres[v as usize].centre)
}
