//! A tree of axis-parallel boxes over triangles, for pairs that overlap.
//!
//! Built top-down by splitting at the median centre along the longest side; a node's first child
//! follows it. The tree of [`crate::geometry`] answers other questions (closest points); this one
//! keeps its triangles in leaf order, so that a query reads memory in one direction.

use std::ops::ControlFlow;

use crate::Vec3;

/// Triangles with the boxes around them.
#[derive(Debug)]
pub(super) struct BoxTree {
    nodes: Vec<Node>,
    /// Triangles in the order of the leaves.
    pub triangles: Vec<[Vec3; 3]>,
    /// Index of each of them in the mesh.
    pub ids: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    lo: Vec3,
    hi: Vec3,
    /// The second child of an inner node, the first triangle of a leaf.
    next: u32,
    /// Number of triangles of a leaf, 0 for an inner node.
    count: u32,
}

const LEAF: usize = 4;

impl BoxTree {
    /// Builds the tree over some triangles. `O(F log F)`.
    pub fn new(triangles: impl Iterator<Item = (u32, [Vec3; 3])>) -> Self {
        let mut items: Vec<_> = triangles.collect();
        let mut nodes = Vec::with_capacity(items.len());
        if !items.is_empty() {
            split(&mut items, 0, &mut nodes);
        }
        let (ids, triangles) = items.into_iter().unzip();
        Self { nodes, triangles, ids }
    }

    /// Calls `visit` with the position in leaf order of every triangle whose leaf passes `enter`,
    /// as do all boxes around it, until it answers [`ControlFlow::Break`].
    #[inline]
    pub fn visit(
        &self,
        enter: impl Fn(Vec3, Vec3) -> bool,
        mut visit: impl FnMut(usize) -> ControlFlow<()>,
    ) {
        if self.nodes.is_empty() {
            return;
        }
        // A median split halves the count, so 64 levels are never reached.
        let mut stack = [0_u32; 64];
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let index = stack[depth];
            let node = &self.nodes[index as usize];
            if !enter(node.lo, node.hi) {
                continue;
            }
            if node.count == 0 {
                stack[depth] = node.next;
                stack[depth + 1] = index + 1;
                depth += 2;
            } else {
                for item in node.next..node.next + node.count {
                    if visit(item as usize).is_break() {
                        return;
                    }
                }
            }
        }
    }
}

/// Box of a triangle.
pub(super) fn bounds([a, b, c]: [Vec3; 3]) -> (Vec3, Vec3) {
    (a.min(b).min(c), a.max(b).max(c))
}

fn split(items: &mut [(u32, [Vec3; 3])], start: u32, nodes: &mut Vec<Node>) {
    let (mut lo, mut hi) = bounds(items[0].1);
    let centre = |t: &[Vec3; 3]| t[0] + t[1] + t[2];
    let (mut first, mut last) = (centre(&items[0].1), centre(&items[0].1));
    for (_, triangle) in items.iter() {
        let (l, h) = bounds(*triangle);
        (lo, hi) = (lo.min(l), hi.max(h));
        let c = centre(triangle);
        (first, last) = (first.min(c), last.max(c));
    }
    let node = nodes.len();
    nodes.push(Node { lo, hi, next: start, count: items.len() as u32 });
    if items.len() <= LEAF {
        return;
    }
    let axis = (last - first).max_position();
    let half = items.len() / 2;
    items.select_nth_unstable_by(half, |(i, s), (j, t)| {
        centre(s)[axis].total_cmp(&centre(t)[axis]).then(i.cmp(j))
    });
    let (left, right) = items.split_at_mut(half);
    split(left, start, nodes);
    nodes[node].next = nodes.len() as u32;
    nodes[node].count = 0;
    split(right, start + half as u32, nodes);
}
