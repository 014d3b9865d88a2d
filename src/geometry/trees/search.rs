//! Searching the tree: nearest box first, without the boxes beyond the limit.

use std::ops::{ControlFlow, Range};

use super::build::MAX_DEPTH;
use super::{Node, Tree};
use crate::Vec3;

/// A search in a tree for the least of some measure.
pub trait Search {
    /// A lower bound of the measure over all items below a node.
    fn bound(&self, node: &Node) -> f64;

    /// The best value so far: nodes with a larger bound are skipped.
    fn limit(&self) -> f64;

    /// Looks at the items of a leaf, given as places in [`Tree::order`].
    fn visit(&mut self, places: Range<usize>);
}

/// The search whose measure is the squared distance from a point.
struct Around<F> {
    p: Vec3,
    limit: f64,
    visit: F,
}

impl<F: FnMut(Range<usize>) -> f64> Search for Around<F> {
    #[inline]
    fn bound(&self, node: &Node) -> f64 {
        node.bounds.distance_squared(self.p)
    }

    #[inline]
    fn limit(&self) -> f64 {
        self.limit
    }

    #[inline]
    fn visit(&mut self, places: Range<usize>) {
        self.limit = (self.visit)(places);
    }
}

impl Tree {
    /// Shows the leaves to `visit`, roughly from near `p` to far, as places in [`Tree::order`].
    /// Boxes whose squared distance from `p` exceeds the limit are skipped: `limit` at first, then
    /// what `visit` returned last.
    #[inline]
    pub fn search_around(&self, p: Vec3, limit: f64, visit: impl FnMut(Range<usize>) -> f64) {
        self.search(&mut Around { p, limit, visit });
    }

    /// Shows the leaves to a search, roughly from near to far.
    #[inline]
    pub fn search(&self, search: &mut impl Search) {
        self.search_below(0, search);
    }

    /// As [`Tree::search`], the leaves below a node only.
    #[inline]
    pub fn search_below(&self, root: usize, search: &mut impl Search) {
        let Some(root) = self.nodes.get(root) else {
            return;
        };
        // A node is popped before its two children are pushed, so the stack grows by one a level.
        let mut stack = [(0.0, 0_u32); MAX_DEPTH + 1];
        let mut height = 0;
        let mut node = root;
        if search.bound(root) > search.limit() {
            return;
        }
        loop {
            let first = node.first as usize;
            if node.count > 0 {
                search.visit(first..first + node.count as usize);
            } else {
                // Not by `map`, which is not inlined here.
                let bounds =
                    [search.bound(&self.nodes[first]), search.bound(&self.nodes[first + 1])];
                // Straight into the nearer child: it is the most likely to lower the limit.
                let near = usize::from(bounds[1] < bounds[0]);
                let limit = search.limit();
                if bounds[near] <= limit {
                    if bounds[1 - near] <= limit {
                        stack[height] = (bounds[1 - near], (first + 1 - near) as u32);
                        height += 1;
                    }
                    node = &self.nodes[first + near];
                    continue;
                }
            }
            loop {
                if height == 0 {
                    return;
                }
                height -= 1;
                let (bound, index) = stack[height];
                // Again, since the limit may have fallen while the node waited.
                if bound <= search.limit() {
                    node = &self.nodes[index as usize];
                    break;
                }
            }
        }
    }

    /// Shows the leaves below all nodes that pass `enter`, from left to right, as places in
    /// [`Tree::order`], until `visit` breaks. `enter` gets the number of a node, below
    /// [`Tree::node_count`], and the node.
    #[inline]
    pub fn descend(
        &self,
        mut enter: impl FnMut(usize, &Node) -> bool,
        mut visit: impl FnMut(Range<usize>) -> ControlFlow<()>,
    ) {
        let mut stack = [0_u32; MAX_DEPTH + 1];
        let mut height = usize::from(!self.nodes.is_empty());
        while height > 0 {
            height -= 1;
            let index = stack[height] as usize;
            let node = &self.nodes[index];
            if !enter(index, node) {
                continue;
            }
            let first = node.first as usize;
            if node.count == 0 {
                // The left child on top, so that leaves come in order.
                stack[height] = node.first + 1;
                stack[height + 1] = node.first;
                height += 2;
            } else if visit(first..first + node.count as usize).is_break() {
                return;
            }
        }
    }
}
