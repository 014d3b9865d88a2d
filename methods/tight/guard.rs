//! Faces that must not fold over or come to cross each other, while spheres move and in collapses.

use std::collections::BTreeSet;

use medial::Vec3;
use medial::complex::collapse::{CollapseComplex, folds_over};
use medial::complex::{Crossings, MedialMesh, Sphere, faces_cross};
use medial::geometry::trees::Bounds;

use super::goal::Goal;

// The limits of a step: where a centre would leave the solid it stays at the surface, and where a face would fold
// over or come to cross another one the step is shortened.

/// Halvings of the step of a sphere before it is taken back.
const HALVINGS: usize = 4;

/// Faces for each pair of crossing faces, below which a mesh is a tangle.
const TANGLED: usize = 2;

/// Faces that stay where they are, next to a mesh that moves. Vertices that are not of the mesh have larger
/// numbers than those that are.
#[derive(Clone, Debug, Default)]
pub(super) struct Still {
    pub faces: Vec<[u32; 3]>,
    pub corners: Vec<[Vec3; 3]>,
    /// Whether the mesh around is a tangle.
    pub is_tangled: bool,
}

/// Violations that a mesh must avoid while its spheres move.
pub(super) struct Guard {
    still: Crossings,
    /// Pairs that cross already.
    known: BTreeSet<Pair>,
    is_tangled: bool,
}

/// A face of a mesh, and one that it crosses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Pair {
    Moving([u32; 2]),
    Still([u32; 2]),
}

impl Guard {
    pub fn new(mesh: &MedialMesh, still: Still) -> Self {
        let Still { faces, corners, is_tangled } = still;
        let tree = Crossings::new(faces.len(), |f| corners[f as usize]);
        let mut this = Self { still: tree, known: BTreeSet::new(), is_tangled };
        this.known = this.crossing(mesh, |_| true).into_iter().collect();
        let is_whole = faces.is_empty();
        this.is_tangled |= is_whole && TANGLED * this.known.len() > mesh.faces.len();
        this
    }

    /// Whether more faces may come to cross, as many do: at the axis of a tube, the start is a tangle of tiny faces.
    pub fn is_tangled(&self) -> bool {
        self.is_tangled
    }

    /// How many pairs of faces crossed at first.
    pub fn crossings(&self) -> usize {
        self.known.len()
    }

    /// Brings a step within its limits: centres outside are clamped, and the corners of faces that would fold
    /// over, or come to cross another one, go half the way, a quarter, or stay where they were. Returns these corners,
    /// in ascending order.
    pub fn hold(&self, before: &MedialMesh, after: &mut MedialMesh, goal: &Goal) -> Vec<u32> {
        clamp(after, goal);
        if self.is_tangled {
            return vec![];
        }
        // Taking one vertex back can fold another face of it. This ends: with all taken back the mesh is as before.
        let mut halvings = vec![0; before.spheres.len()];
        // The faces that are looked at: all, and then those of vertices taken back.
        let mut changed = vec![true; before.spheres.len()];
        loop {
            let mut back = before.faces.clone();
            back.retain(|&face| folds_over(corners(before, face), corners(after, face)));
            let new = self.crossing(after, |face| face.iter().any(|&v| changed[v as usize]));
            let new = new.into_iter().filter(|pair| !self.known.contains(pair));
            for pair in new {
                match pair {
                    Pair::Moving(faces) => back.extend(faces.map(|f| before.faces[f as usize])),
                    Pair::Still([face, _]) => back.push(before.faces[face as usize]),
                }
            }
            let mut back: BTreeSet<u32> = back.into_iter().flatten().collect();
            back.retain(|&v| {
                // Radii play no part in either.
                let [old, new] = [before, &*after].map(|mesh| mesh.spheres.get(v as usize));
                old.map(|sphere| sphere.centre) != new.map(|sphere| sphere.centre)
            });
            if back.is_empty() {
                break;
            }
            changed.fill(false);
            for v in back {
                changed[v as usize] = true;
                let (old, new) = (before.spheres[v as usize], &mut after.spheres[v as usize]);
                let halvings = &mut halvings[v as usize];
                *halvings += 1;
                let half = old.lerp(*new, 0.5);
                let is_inside = *halvings < HALVINGS && goal.clamped(&[half.centre])[0].is_none();
                *new = if is_inside { half } else { old };
            }
        }
        (0..).zip(halvings).filter(|&(_, halvings)| halvings > 0).map(|(v, _)| v).collect()
    }

    /// The pairs with a face of the mesh for which `is_chosen`.
    fn crossing(
        &self,
        mesh: &MedialMesh,
        is_chosen: impl Fn(&[u32; 3]) -> bool + Sync,
    ) -> Vec<Pair> {
        let moving =
            Crossings::new(mesh.faces.len(), |face| corners(mesh, mesh.faces[face as usize]));
        let moving = moving.pairs_with(|face| is_chosen(&mesh.faces[face as usize]));
        let moving = moving.into_iter().map(Pair::Moving);
        let chosen = (0..mesh.faces.len() as u32).filter(|&f| is_chosen(&mesh.faces[f as usize]));
        let still = chosen.flat_map(|face| {
            let own = mesh.faces[face as usize];
            let others = self.still.of(corners(mesh, own));
            others.into_iter().map(move |other| Pair::Still([face, other]))
        });
        moving.chain(still).collect()
    }
}

/// Moves centres outside of the solid to the closest point of its surface.
pub(super) fn clamp(mesh: &mut MedialMesh, goal: &Goal) {
    let centres: Vec<Vec3> = mesh.spheres.iter().map(|sphere| sphere.centre).collect();
    for (sphere, clamped) in mesh.spheres.iter_mut().zip(goal.clamped(&centres)) {
        sphere.centre = clamped.unwrap_or(sphere.centre);
    }
}

// ----------------------------------------------------------------------------
// Which faces of a medial mesh cross, and which a collapse would make cross.
//
// A pair that crosses already may stay crossed: its image under the collapse is known. Any other pair is a
// reason against the collapse.

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
    /// Whether anything is refused.
    is_strict: bool,
}

impl<'a> Sheets<'a> {
    pub fn new(mesh: &'a MedialMesh, is_strict: bool) -> Self {
        let first = Crossings::new(mesh.faces.len(), |f| corners(mesh, mesh.faces[f as usize]));
        let pairs = first.pairs().into_iter();
        let known = pairs.map(|pair| pair.map(|f| mesh.faces[f as usize])).collect();
        let is_moved = vec![false; mesh.spheres.len()];
        Self { mesh, first, known, moved: vec![], is_moved, is_strict }
    }

    /// Whether a face would fold over if the ends of an edge were merged at a place.
    pub fn would_fold(&self, complex: &CollapseComplex, [a, b]: [u32; 2], at: Sphere) -> bool {
        self.is_strict && complex.folded_face(a, b, at.centre).is_some()
    }

    /// Whether the faces around an edge would cross others, or each other, if its ends were merged at a place.
    pub fn would_cross(&self, complex: &CollapseComplex, [a, b]: [u32; 2], at: Sphere) -> bool {
        if !self.is_strict {
            return false;
        }
        let place = |v: u32| if v == a { at.centre } else { complex.sphere(v).centre };
        let star = star(complex, [a, b]);
        let is_star = |face: &Face| face.contains(&a) || face.contains(&b);
        star.iter().enumerate().any(|(i, &face)| {
            let own = face.map(place);
            let crosses = |other: Face, corners: [Vec3; 3]| {
                faces_cross(own, corners) && !self.is_known([a, b], face, other)
            };
            let still = self.first.of(own).into_iter().map(|f| self.mesh.faces[f as usize]);
            let still = still.filter(|other| !other.iter().any(|&v| self.is_moved[v as usize]));
            if still.filter(|other| !is_star(other)).any(|f| !self.is_known([a, b], face, f)) {
                return true;
            }
            let bounds = Bounds::of_points(own);
            let moved = self.moved.iter().filter(|other| !is_star(other));
            let mut moved = moved.map(|&other| (other, other.map(place)));
            let mut star = star[i + 1..].iter().map(|&other| (other, other.map(place)));
            moved.any(|(other, corners)| {
                let [p, q, r] = other;
                bounds.overlaps(&Bounds::of_points(corners))
                    && complex.has_face(p, q, r)
                    && crosses(other, corners)
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
        let pair = [face, other];
        self.known.iter().any(|known| {
            let [f, g] = known.map(|mut face| {
                face.iter_mut().filter(|v| **v == b).for_each(|v| *v = a);
                face.sort_unstable();
                face
            });
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
