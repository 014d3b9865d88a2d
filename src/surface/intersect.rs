//! Pairs of faces that meet elsewhere than in their common vertices and edges. Exact.
//!
//! Two triangles intersect if and only if an edge of one meets the other, both taken with their
//! boundary. By the number of vertices they share:
//!
//! - none: each edge against the other triangle, after rejecting pairs where one lies strictly on
//!   one side of the other's plane;
//! - one: the edge opposite to it, of each, against the other triangle. If they meet in more than
//!   the shared vertex they do so in a segment from there, which ends on one of these two edges
//!   (or runs along an edge to its end, which lies on one of them);
//! - two: they meet in more than the edge if and only if they lie in one plane on the same side.
//!
//! Vertices are shared if they have the same index. Faces of zero area are left out; they are
//! reported by themselves.

use std::ops::ControlFlow;

use rayon::prelude::*;

use super::boxes::{BoxTree, bounds};
use super::predicates::{Point2, Sign, orient2d, orient3d, project, projection_axis};
use crate::Vec3;

/// The intersecting pairs of a mesh.
#[derive(Debug, Default)]
pub(super) struct Intersections {
    /// Number of pairs.
    pub pairs: usize,
    /// The pair with the smallest indices.
    pub first: Option<[u32; 2]>,
    /// Whether all pairs were looked at.
    pub complete: bool,
    /// Faces with exactly collinear corners.
    pub degenerate_faces: usize,
    pub first_degenerate: Option<u32>,
    /// Pairs of components with intersecting faces, ascending.
    pub components: Vec<[u32; 2]>,
}

/// Faces looked at between two looks at the budget.
const BLOCK: usize = 4096;
/// Neighbours in space of one face that are tested at most.
const MOST_OF_ONE: usize = 20_000;

/// Finds all intersections. `O(F log F + pairs)`, but gives up, and says so, after a number of
/// tests that no surface of practical use needs.
///
/// `points` are scaled as [`super::predicates::Unit`] does.
pub(super) fn intersections(
    points: &[Vec3],
    faces: &[[u32; 3]],
    component: &[u32],
) -> Intersections {
    let corners = |face: u32| faces[face as usize].map(|v| points[v as usize]);
    let flat: Vec<bool> = (0..faces.len() as u32)
        .into_par_iter()
        .map(|face| projection_axis(corners(face)).is_none())
        .collect();
    let solid = (0..faces.len() as u32).filter(|&face| !flat[face as usize]);
    let tree = BoxTree::new(solid.map(|face| (face, corners(face))));
    let mut found = Intersections {
        complete: true,
        degenerate_faces: flat.iter().filter(|&&f| f).count(),
        first_degenerate: flat.iter().position(|&f| f).map(|f| f as u32),
        ..Intersections::default()
    };
    let mut budget = 20_000_000 + 200 * faces.len();
    for block in (0..tree.ids.len()).step_by(BLOCK) {
        let end = (block + BLOCK).min(tree.ids.len());
        let partial: Vec<Partial> =
            (block..end).into_par_iter().map(|item| meets(&tree, item, faces, component)).collect();
        for part in partial {
            found.pairs += part.pairs;
            found.complete &= part.complete;
            budget = budget.saturating_sub(part.tests);
            found.first = found.first.into_iter().chain(part.first).min();
            found.components.extend(part.components);
        }
        found.components.sort_unstable();
        found.components.dedup();
        if budget == 0 && end < tree.ids.len() {
            found.complete = false;
            break;
        }
    }
    found
}

/// What one face contributes: pairs with faces of larger index.
struct Partial {
    pairs: usize,
    tests: usize,
    first: Option<[u32; 2]>,
    complete: bool,
    components: Vec<[u32; 2]>,
}

fn meets(tree: &BoxTree, item: usize, faces: &[[u32; 3]], component: &[u32]) -> Partial {
    let (face, triangle) = (tree.ids[item], tree.triangles[item]);
    let (lo, hi) = bounds(triangle);
    let overlaps = |l: Vec3, h: Vec3| l.cmple(hi).all() && h.cmpge(lo).all();
    let mut part = Partial { pairs: 0, tests: 0, first: None, complete: true, components: vec![] };
    tree.visit(overlaps, |other_item| {
        let (other, other_triangle) = (tree.ids[other_item], tree.triangles[other_item]);
        let (l, h) = bounds(other_triangle);
        part.tests += 1;
        if part.tests > MOST_OF_ONE {
            part.complete = false;
            return ControlFlow::Break(());
        }
        if other <= face
            || !overlaps(l, h)
            || !faces_meet(faces[face as usize], triangle, faces[other as usize], other_triangle)
        {
            return ControlFlow::Continue(());
        }
        part.pairs += 1;
        part.first = part.first.into_iter().chain([[face, other]]).min();
        let [a, b] = [component[face as usize], component[other as usize]];
        let pair = [a.min(b), a.max(b)];
        if a != b && part.components.last() != Some(&pair) {
            part.components.push(pair);
        }
        ControlFlow::Continue(())
    });
    part
}

/// Whether two faces of positive area share more than vertices and edges.
fn faces_meet(f: [u32; 3], s: [Vec3; 3], g: [u32; 3], t: [Vec3; 3]) -> bool {
    let shared = |i: usize| g.iter().position(|&v| v == f[i]);
    let mut common = (0..3).filter_map(|i| shared(i).map(|j| (i, j)));
    match (common.next(), common.next(), common.next()) {
        (None, ..) => triangles_meet(s, t),
        (Some((i, j)), None, _) => {
            segment_meets(opposite(s, i), t) || segment_meets(opposite(t, j), s)
        }
        (Some((i, j)), Some((k, l)), None) => folded(s[i], s[k], s[3 - i - k], t[3 - j - l]),
        _ => true,
    }
}

fn opposite(t: [Vec3; 3], corner: usize) -> [Vec3; 2] {
    [t[(corner + 1) % 3], t[(corner + 2) % 3]]
}

/// Whether the triangles `a, b, p` and `a, b, q` lie in one plane on the same side of `a, b`.
fn folded(a: Vec3, b: Vec3, p: Vec3, q: Vec3) -> bool {
    if !orient3d(a, b, p, q).is_zero() {
        return false;
    }
    projection_axis([a, b, p]).is_some_and(|(axis, turn)| {
        orient2d(project(a, axis), project(b, axis), project(q, axis)) == turn
    })
}

fn triangles_meet(s: [Vec3; 3], t: [Vec3; 3]) -> bool {
    let apart = |plane: [Vec3; 3], other: [Vec3; 3]| {
        let [x, y, z] = other.map(|p| orient3d(plane[0], plane[1], plane[2], p));
        !x.is_zero() && x == y && y == z
    };
    if apart(t, s) || apart(s, t) {
        return false;
    }
    (0..3).any(|i| segment_meets(opposite(s, i), t) || segment_meets(opposite(t, i), s))
}

/// Whether a segment and a triangle of positive area meet, both with their ends.
fn segment_meets([p, q]: [Vec3; 2], triangle: [Vec3; 3]) -> bool {
    let [a, b, c] = triangle;
    let (above, below) = (orient3d(a, b, c, p), orient3d(a, b, c, q));
    if above.is_zero() && below.is_zero() {
        return meets_in_plane([p, q], triangle);
    }
    if above == below {
        return false;
    }
    let turns = [orient3d(p, q, a, b), orient3d(p, q, b, c), orient3d(p, q, c, a)];
    !(turns.contains(&Sign::Positive) && turns.contains(&Sign::Negative))
}

/// The same within the plane of the triangle.
fn meets_in_plane([p, q]: [Vec3; 2], triangle: [Vec3; 3]) -> bool {
    let Some((axis, turn)) = projection_axis(triangle) else { return false };
    let flat = triangle.map(|v| project(v, axis));
    let [p, q] = [p, q].map(|v| project(v, axis));
    let contains =
        |x: Point2| (0..3).all(|i| !orient2d(flat[i], flat[(i + 1) % 3], x).opposes(turn));
    contains(p) || contains(q) || (0..3).any(|i| segments_meet(p, q, flat[i], flat[(i + 1) % 3]))
}

fn segments_meet(p: Point2, q: Point2, a: Point2, b: Point2) -> bool {
    let (pa, pb) = (orient2d(p, q, a), orient2d(p, q, b));
    let (ap, aq) = (orient2d(a, b, p), orient2d(a, b, q));
    if [pa, pb, ap, aq].iter().all(|s| s.is_zero()) {
        // On one line: their extents overlap in both coordinates.
        return (0..2)
            .all(|i| p[i].min(q[i]) <= a[i].max(b[i]) && a[i].min(b[i]) <= p[i].max(q[i]));
    }
    pa.value() * pb.value() <= 0 && ap.value() * aq.value() <= 0
}
