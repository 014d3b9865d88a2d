//! The limits of a step: where a centre would leave the solid it stays at the surface, and where a face would fold
//! over or come to cross another one the step is shortened.

use std::collections::BTreeSet;

use medial::Vec3;
use medial::complex::collapse::folds_over;
use medial::complex::{Crossings, MedialMesh};

use super::goal::Goal;
use super::sheets::corners;

/// Times that the step of a sphere is halved before it is taken back altogether.
const HALVINGS: usize = 4;

/// Faces that stay where they are, beside a mesh that moves. Vertices that are not of the mesh have larger
/// numbers than those that are.
#[derive(Clone, Debug, Default)]
pub(super) struct Still {
    pub faces: Vec<[u32; 3]>,
    pub corners: Vec<[Vec3; 3]>,
}

/// What a mesh must not come to do while its spheres move.
pub(super) struct Guard {
    still: Crossings,
    /// Pairs that cross already.
    known: BTreeSet<Pair>,
}

/// A face of a mesh, and one that it crosses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Pair {
    Moving([u32; 2]),
    Still([u32; 2]),
}

impl Guard {
    pub fn new(mesh: &MedialMesh, still: Still) -> Self {
        let Still { faces, corners } = still;
        let tree = Crossings::new(faces, |f| corners[f as usize]);
        let mut this = Self { still: tree, known: BTreeSet::new() };
        this.known = this.crossing(mesh, |_| true).into_iter().collect();
        this
    }

    /// Brings a step within its limits: centres outside are clamped, and the corners of faces that would fold
    /// over, or come to cross another one, go half the way, a quarter, or stay where they were.
    pub fn hold(&self, before: &MedialMesh, after: &mut MedialMesh, goal: &Goal) {
        clamp(after, goal);
        // Taking one vertex back can fold another face of it. This ends: what is all taken back is as before.
        let mut halvings = vec![0; before.spheres.len()];
        // The faces that are looked at: all, and then those of what was taken back.
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
            let moved = |v: &u32| {
                // Radii play no part in either.
                let of = |mesh: &MedialMesh| mesh.spheres.get(*v as usize).map(|s| s.centre);
                of(before) != of(after)
            };
            let back: BTreeSet<u32> = back.into_iter().flatten().filter(moved).collect();
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
    }

    /// The pairs with a face of the mesh for which `is_asked`.
    fn crossing(
        &self,
        mesh: &MedialMesh,
        is_asked: impl Fn(&[u32; 3]) -> bool + Sync,
    ) -> Vec<Pair> {
        let of = |face: u32| corners(mesh, mesh.faces[face as usize]);
        let moving = Crossings::new(mesh.faces.clone(), of);
        let moving = moving.pairs_with(|face| is_asked(&mesh.faces[face as usize]));
        let moving = moving.into_iter().map(Pair::Moving);
        let asked = (0..mesh.faces.len() as u32).filter(|&f| is_asked(&mesh.faces[f as usize]));
        let still = asked.flat_map(|face| {
            let others = self.still.of(mesh.faces[face as usize], of(face));
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
