//! Searching a tree of boxes: nearest box first, without the boxes beyond the limit.

use std::ops::{ControlFlow, Range};

use crate::Vec3;
use crate::trees::{Bounds, MAX_DEPTH, Node, Plan, Tree};

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
    /// the last result of `visit`.
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
    /// [`Tree::order`], until `visit` breaks. `enter` gets the index of a node, and
    /// the node.
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

// Points in a tree: the nearest one, and those within a distance.

/// A tree over points.
///
/// ```
/// use medial_geometry::{Vec3, trees::PointTree};
///
/// let points: Vec<Vec3> = (0..100).map(|k| Vec3::new(k as f64, (k * k % 7) as f64, 0.0)).collect();
/// let tree = PointTree::new(&points);
/// let (id, squared) = tree.nearest(Vec3::new(41.2, 1.0, 0.0)).expect("there are points");
/// assert_eq!(points[id as usize], Vec3::new(41.0, 1.0, 0.0));
/// assert!((squared.sqrt() - 0.2).abs() < 1e-12);
/// let mut near = tree.within(Vec3::new(41.2, 1.0, 0.0), 1.5 * 1.5); // the distance squared
/// near.sort_unstable();
/// assert_eq!(near, [41, 42]);
/// ```
#[derive(Clone, Debug)]
pub struct PointTree {
    tree: Tree,
    /// In leaf order.
    points: Vec<Vec3>,
}

impl PointTree {
    /// A tree over points, in any unit. `O(n log n)`.
    pub fn new(points: &[Vec3]) -> Self {
        let items: Vec<_> = points.iter().map(|&p| (Bounds::of_points([p]), 0.0)).collect();
        let tree = Tree::build(&items, Plan { max_leaf: 8, group: 1, padding: 0.0 });
        let points = tree.order().iter().map(|&id| points[id as usize]).collect();
        Self { tree, points }
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there is no point.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// The index of the nearest point, the smallest of equally near ones, and its squared distance;
    /// `None` without points, or where no distance can be squared.
    pub fn nearest(&self, query: Vec3) -> Option<(u32, f64)> {
        let (mut squared, mut id) = (f64::INFINITY, u32::MAX);
        self.tree.search_around(query, squared, |places| {
            for place in places {
                let found = (self.points[place].distance_squared(query), self.tree.order()[place]);
                if found < (squared, id) {
                    (squared, id) = found;
                }
            }
            squared
        });
        // Infinite without points; and among infinite distances no point is the nearest.
        squared.is_finite().then_some((id, squared))
    }

    /// The indices of the points whose squared distance is at most `squared`, in the order of the
    /// tree: for the points within 1.5, `squared` is `1.5 * 1.5`.
    pub fn within(&self, query: Vec3, squared: f64) -> Vec<u32> {
        let mut found = Vec::new();
        self.tree.descend(
            |_: usize, node: &Node| node.bounds.distance_squared(query) <= squared,
            |places| {
                let near = places.filter(|&k| self.points[k].distance_squared(query) <= squared);
                found.extend(near.map(|k| self.tree.order()[k]));
                ControlFlow::Continue(())
            },
        );
        found
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn non_finite_points_have_no_neighbours() {
        let tree = PointTree::new(&[Vec3::ZERO, Vec3::X]);
        for query in [Vec3::INFINITY, Vec3::NAN, Vec3::splat(1e200)] {
            assert_eq!(tree.nearest(query), None);
        }
        assert_eq!(PointTree::new(&[]).nearest(Vec3::ZERO), None);
    }

    proptest! {
        #[test]
        fn results_are_those_of_exhaustive_search(
            points in prop::collection::vec(prop::array::uniform3(-9_i8..9), 1..200),
            query in prop::array::uniform3(-12.0_f64..12.0),
            reach in 0.0_f64..12.0,
        ) {
            // On a small lattice: repeated points, and equal distances.
            let points: Vec<Vec3> =
                points.into_iter().map(|p| Vec3::from_array(p.map(f64::from))).collect();
            let (tree, query) = (PointTree::new(&points), Vec3::from_array(query).round());
            let far = |id: u32| points[id as usize].distance_squared(query);
            let ids = || 0..points.len() as u32;
            let nearest = ids().min_by(|&i, &j| far(i).total_cmp(&far(j)).then(i.cmp(&j)));
            prop_assert_eq!(tree.nearest(query), nearest.map(|id| (id, far(id))));
            let mut within = tree.within(query, reach);
            within.sort_unstable();
            let expected: Vec<u32> = ids().filter(|&id| far(id) <= reach).collect();
            prop_assert_eq!(within, expected);
        }
    }
}
