//! A wide tree over balls: each node has a box of centres, and the largest and the smallest radius
//! below it.

use super::wide::{Lanes, Query};
use super::{Bounds, Node, Tree, WideTree};

/// The distance to the boundaries of hulls of balls that a search minimises.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// Negative inside.
    Signed,
    /// Its absolute value.
    Unsigned,
}

impl Measure {
    /// This measure of some signed distances.
    #[inline]
    pub fn of(self, signed: Lanes) -> Lanes {
        match self {
            Self::Signed => signed,
            Self::Unsigned => signed.abs(),
        }
    }
}

/// A tree over boxes of centres, with radii.
#[derive(Clone, Debug)]
pub struct ReachTree {
    wide: WideTree,
    /// For each node the largest and the smallest radius below its children.
    radii: Vec<[Lanes; 2]>,
}

/// Single precision does not separate centres closer together than this, in half sides of the frame:
/// they form one leaf, in which the binary tree is searched.
const CLUSTER: f64 = 1e-5;

impl ReachTree {
    /// Collapses a tree over boxes of centres whose reaches are radii. All balls are within `frame`.
    pub fn new(tree: &Tree, frame: Bounds) -> Self {
        let mut radii = Vec::new();
        let mut each = |children: &[&Node]| {
            radii.push([0, 1].map(|k| {
                let mut of = [0.0; 4];
                for (radius, child) in of.iter_mut().zip(children) {
                    *radius = if k == 0 { child.reach } else { child.least_reach };
                }
                of
            }));
        };
        let wide = WideTree::within(tree, frame, CLUSTER, &mut each);
        let scale = wide.frame().scale;
        let scaled = |of: [f64; 4]| Lanes::from(of.map(|radius| (radius * scale) as f32));
        Self { wide, radii: radii.into_iter().map(|pair| pair.map(scaled)).collect() }
    }

    /// The tree over the boxes alone.
    pub fn wide(&self) -> &WideTree {
        &self.wide
    }

    /// The node of the binary tree in which to search a leaf that is too narrow for single precision
    /// and has more than `max_items` primitives; `None` for every other leaf.
    pub fn cluster(&self, leaf: usize, tree: &Tree, max_items: usize) -> Option<u32> {
        let node = self.wide.source(leaf);
        let Bounds { lo, hi } = tree.nodes[node].bounds;
        let close = (hi - lo).max_element() * self.wide.frame().scale < CLUSTER;
        (close && self.wide.leaves()[leaf].len() > max_items).then_some(node as u32)
    }

    /// Shows the leaves within a limit, roughly from near to far. `visit` gets the leaf and the
    /// limit, and returns the new one. Limits are those of [`Query::signed_limit`].
    #[inline]
    pub fn search(
        &self,
        query: &Query,
        measure: Measure,
        limit: f32,
        visit: impl FnMut(usize, f32) -> f32,
    ) {
        let bounds = |place: usize| {
            let (node, [largest, smallest]) = (self.wide.node(place), &self.radii[place]);
            let outside = node.distance_squared(query).sqrt() - *largest;
            match measure {
                Measure::Signed => outside,
                // Each hull holds its largest ball, whose centre is in the box.
                Measure::Unsigned => {
                    outside.fast_max(*smallest - node.farthest_squared(query).sqrt())
                }
            }
        };
        self.wide.search(limit, bounds, visit);
    }
}
