//! Parts that touch in a vertex, taken apart; the only repair that moves a vertex.
//!
//! At such a vertex the faces form several fans. The flattest fan keeps the vertex. Each other one
//! gets a vertex of its own, at [`STEP`] of the way to the mean of its rim: towards its own part, so
//! that two tips no longer touch. The flattest fan stays because it cannot move like this: the mean of
//! a flat fan's rim may be the vertex itself.
//!
//! # Cost
//! `O(F log F)` for `F` faces.

use std::collections::BTreeMap;

use super::report::Repair;
use crate::Vec3;
use crate::geometry::DisjointSets;

/// Share of the way to the mean of its rim by which a tip is drawn back.
const STEP: f64 = 1e-3;

/// Corners (`3 face + k`) of the faces that hang together around one vertex.
type Fan = Vec<usize>;

/// Gives each fan of faces a vertex of its own.
pub(super) fn separate(vertices: &mut Vec<Vec3>, faces: &mut [[u32; 3]]) -> Option<Repair> {
    let (mut touching, mut largest_move) = (0, 0.0_f64);
    for (vertex, mut fans) in fans(vertices.len(), faces).into_iter().enumerate() {
        if fans.len() < 2 {
            continue;
        }
        touching += 1;
        let tip = vertices[vertex];
        let drawn_back = |fan: &Fan| tip * (1.0 - STEP) + rim_mean(vertices, faces, fan) * STEP;
        let targets: Vec<Vec3> = fans.values().map(drawn_back).collect();
        let height = |k: &usize| tip.distance_squared(targets[*k]);
        let flattest = (0..fans.len()).min_by(|a, b| height(a).total_cmp(&height(b)));
        for (k, fan) in fans.values_mut().enumerate().filter(|&(k, _)| Some(k) != flattest) {
            let own = vertices.len() as u32;
            largest_move = largest_move.max(tip.distance(targets[k]));
            vertices.push(targets[k]);
            fan.iter().for_each(|&corner| faces.as_flattened_mut()[corner] = own);
        }
    }
    (touching > 0).then_some(Repair::SeparatedVertices { vertices: touching, largest_move })
}

/// For each vertex its fans, by their first corner.
fn fans(vertices: usize, faces: &[[u32; 3]]) -> Vec<BTreeMap<u32, Fan>> {
    let mut joined = DisjointSets::singletons(3 * faces.len());
    // Both ends of each side with the corners there, so that equal sides stand together.
    let mut sides: Vec<([u32; 2], [u32; 2])> = Vec::with_capacity(3 * faces.len());
    for (face, corners) in (0..).zip(faces) {
        for k in 0..3 {
            let next = (k + 1) % 3;
            let ends = [(corners[k], 3 * face + k as u32), (corners[next], 3 * face + next as u32)];
            let [low, high] = if ends[0] < ends[1] { ends } else { [ends[1], ends[0]] };
            sides.push(([low.0, high.0], [low.1, high.1]));
        }
    }
    sides.sort_unstable();
    for pair in sides.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
        for end in 0..2 {
            joined.join(pair[0].1[end], pair[1].1[end]);
        }
    }
    let mut fans = vec![BTreeMap::<u32, Fan>::new(); vertices];
    for (corner, &vertex) in faces.as_flattened().iter().enumerate() {
        let fan = fans[vertex as usize].entry(joined.find(corner as u32)).or_default();
        fan.push(corner);
    }
    fans
}

/// Mean of the vertices across from the fan's own.
fn rim_mean(vertices: &[Vec3], faces: &[[u32; 3]], fan: &Fan) -> Vec3 {
    // Each is divided first: the sum of coordinates near the end of the range would overflow.
    let share = 0.5 / fan.len() as f64;
    let others = |&corner: &usize| {
        let [first, face] = [corner % 3, corner / 3];
        let at = |k: usize| vertices[faces[face][(first + k) % 3] as usize] * share;
        at(1) + at(2)
    };
    fan.iter().map(others).sum()
}
