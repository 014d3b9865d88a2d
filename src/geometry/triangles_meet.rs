//! Whether two triangles meet outside of the corners and sides that they share. Exact, but for [`triangles_cross`].
//!
//! Two triangles intersect if and only if an edge of one meets the other, both taken with their
//! boundary. By the number of corners they share:
//!
//! - none: each edge of one is tested against the other, unless one triangle lies strictly on one
//!   side of the other's plane;
//! - one: in each, the edge opposite to the shared corner is tested against the other triangle. If
//!   they meet in more than the corner, they meet in a segment from there, which ends on one of these
//!   two edges (or runs along an edge to its end, which lies on one of them);
//! - two: they meet in more than the edge if and only if they lie in one plane on the same side.
//!
//! Corners are shared if they have the same index, not if they are at the same place. Tested against
//! separating axes in integers, with the surface's search for intersections.

use std::ops::{ControlFlow, Range};

use crate::Vec3;
use crate::predicates::{Point2, Sign, orient2d, orient3d, project, projection_axis};
use crate::trees::{Bounds, Node, Plan, Tree};

/// Triangles in a tree of boxes, for the search of those that others meet.
///
/// In leaf order, so that a query reads memory in one direction.
#[derive(Clone, Debug)]
pub struct TriangleTree {
    tree: Tree,
    ids: Vec<u32>,
    triangles: Vec<[Vec3; 3]>,
}

impl TriangleTree {
    /// A tree of the triangles `ids`, whose corners are `corners(id)`. Triangles without area are left out:
    /// their intersections are not defined by planes. Cost `O(n log n)`.
    pub fn new(ids: impl IntoIterator<Item = u32>, corners: impl Fn(u32) -> [Vec3; 3]) -> Self {
        let ids = ids.into_iter().filter(|&id| projection_axis(corners(id)).is_some());
        let given: Vec<u32> = ids.collect();
        let boxes = given.iter().map(|&id| (Bounds::of_points(corners(id)), 0.0));
        let plan = Plan { max_leaf: 4, group: 4, padding: 0.0 };
        let tree = Tree::build(&boxes.collect::<Vec<_>>(), plan);
        let ids: Vec<u32> = tree.order().iter().map(|&item| given[item as usize]).collect();
        let triangles = ids.iter().map(|&id| corners(id)).collect();
        Self { tree, ids, triangles }
    }

    /// Number of triangles with an area.
    pub fn len(&self) -> usize {
        self.ids.len()
    }

    /// Whether no triangle has an area.
    pub fn is_empty(&self) -> bool {
        self.ids.is_empty()
    }

    /// The id and the corners of the triangle at a place in the tree's order.
    pub fn at(&self, place: usize) -> (u32, [Vec3; 3]) {
        (self.ids[place], self.triangles[place])
    }

    /// Visits the ids and the corners of triangles whose boxes overlap that of `triangle`, until `visit` breaks.
    pub fn overlapping(
        &self,
        triangle: [Vec3; 3],
        mut visit: impl FnMut(u32, [Vec3; 3]) -> ControlFlow<()>,
    ) {
        let own = Bounds::of_points(triangle);
        self.tree.descend(
            |_: usize, node: &Node| node.bounds.overlaps(&own),
            |places: Range<usize>| {
                places.into_iter().try_for_each(|place| {
                    let (id, other) = self.at(place);
                    if own.overlaps(&Bounds::of_points(other)) {
                        visit(id, other)
                    } else {
                        ControlFlow::Continue(())
                    }
                })
            },
        );
    }
}

/// Whether two triangles of positive area share more than corners and edges: `f` and `g` are the indices of
/// their corners, `s` and `t` the places.
pub fn triangles_meet(f: [u32; 3], s: [Vec3; 3], g: [u32; 3], t: [Vec3; 3]) -> bool {
    let mut common = (0..3).filter_map(|i| Some((i, g.iter().position(|&v| v == f[i])?)));
    match (common.next(), common.next(), common.next()) {
        (None, ..) => apart_triangles_meet(s, t),
        (Some((i, j)), None, _) => {
            segment_meets(opposite(s, i), t) || segment_meets(opposite(t, j), s)
        }
        (Some((i, j)), Some((k, l)), None) => folded(s[i], s[k], s[3 - i - k], t[3 - j - l]),
        _ => true,
    }
}

/// Whether an edge of one of two triangles passes through the inside of the other, with both ends farther than `depth`
/// from its plane. Triangles that share corners or lie in one plane do not, nor do those of a smaller height.
/// In floating point.
pub fn triangles_cross(s: [Vec3; 3], t: [Vec3; 3], depth: f64) -> bool {
    passes_through(s, t, depth) || passes_through(t, s, depth)
}

fn passes_through(edges: [Vec3; 3], [a, b, c]: [Vec3; 3], depth: f64) -> bool {
    let normal = (b - a).cross(c - a);
    let area = normal.length();
    let longest =
        (b - a).length_squared().max((c - a).length_squared()).max((c - b).length_squared());
    if area <= depth * longest.sqrt() {
        return false;
    }
    let heights = edges.map(|p| (p - a).dot(normal) / area);
    (0..3).any(|i| {
        let (p, q) = (edges[i], edges[(i + 1) % 3]);
        let (above, below) = (heights[i], heights[(i + 1) % 3]);
        if above * below >= 0.0 || above.abs() <= depth || below.abs() <= depth {
            return false;
        }
        let x = p.lerp(q, above / (above - below));
        [(a, b), (b, c), (c, a)].iter().all(|&(u, v)| (v - u).cross(x - u).dot(normal) > 0.0)
    })
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

fn apart_triangles_meet(s: [Vec3; 3], t: [Vec3; 3]) -> bool {
    // Six orientations decide most pairs; the test of edges takes up to thirty more.
    if is_beside(t, s) || is_beside(s, t) {
        return false;
    }
    (0..3).any(|i| segment_meets(opposite(s, i), t) || segment_meets(opposite(t, i), s))
}

/// Whether a triangle lies strictly on one side of the plane of another.
#[inline]
fn is_beside([a, b, c]: [Vec3; 3], triangle: [Vec3; 3]) -> bool {
    let [x, y, z] = triangle.map(|p| orient3d(a, b, c, p));
    !x.is_zero() && x == y && y == z
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
    // The line pq passes the triangle if it turns the same way around all three sides.
    let turns = [orient3d(p, q, a, b), orient3d(p, q, b, c), orient3d(p, q, c, a)];
    !(turns.contains(&Sign::Positive) && turns.contains(&Sign::Negative))
}

/// Whether a segment in the plane of a triangle meets it.
fn meets_in_plane([p, q]: [Vec3; 2], triangle: [Vec3; 3]) -> bool {
    let Some((axis, turn)) = projection_axis(triangle) else { return false };
    let flat = triangle.map(|v| project(v, axis));
    let [p, q] = [p, q].map(|v| project(v, axis));
    let sides = [0, 1, 2].map(|i| [flat[i], flat[(i + 1) % 3]]);
    // An end within the triangle, or else a side that the segment crosses.
    [p, q].iter().any(|&x| sides.iter().all(|&[a, b]| !orient2d(a, b, x).opposes(turn)))
        || sides.iter().any(|&[a, b]| segments_meet(p, q, a, b))
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
