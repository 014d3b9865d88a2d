//! Points and boxes in trees.
//!
//! [`PointTree`] answers the common questions about points: the nearest one, and those within a
//! distance. The rest of this module is for your own searches, over any items that have boxes.
//!
//! [`Tree`] is a bounding-volume hierarchy: a flat binary tree over boxes, built by the binned
//! surface-area heuristic (Wald 2007, doi:10.1109/RT.2007.4342588), searched nearest box first.
//!
//! The tree stores boxes only. The items of a leaf and their distances belong to the [`Search`], or
//! to the caller of [`Tree::descend`]. Two copies speed up many queries: [`WideTree`] has four
//! children per node and boxes in single precision; [`ReachTree`], for distances to hulls of balls,
//! stores radii too. [`ConeBlock`] and [`FaceBlock`] measure four hulls at a time.
//!
//! ```
//! use std::ops::Range;
//! use medial_geometry::Vec3;
//! use medial_geometry::trees::{Bounds, Node, Plan, Search, Tree};
//!
//! /// The nearest of some points.
//! struct Nearest<'a> {
//!     points: &'a [Vec3],
//!     order: &'a [u32],
//!     query: Vec3,
//!     best: (f64, u32),
//! }
//!
//! impl Search for Nearest<'_> {
//!     fn bound(&self, node: &Node) -> f64 {
//!         node.bounds.distance_squared(self.query)
//!     }
//!     fn limit(&self) -> f64 {
//!         self.best.0
//!     }
//!     fn visit(&mut self, places: Range<usize>) {
//!         for &item in &self.order[places] {
//!             let squared = self.points[item as usize].distance_squared(self.query);
//!             if squared < self.best.0 {
//!                 self.best = (squared, item);
//!             }
//!         }
//!     }
//! }
//!
//! let points: Vec<Vec3> = (0..100).map(|k| Vec3::new(k as f64, (k * k % 7) as f64, 0.0)).collect();
//! let items: Vec<_> = points.iter().map(|&p| (Bounds::of_points([p]), 0.0)).collect();
//! let tree = Tree::build(&items, Plan { max_leaf: 4, group: 1, padding: 0.0 });
//! let (query, best) = (Vec3::new(41.2, 1.0, 0.0), (f64::INFINITY, 0));
//! let mut nearest = Nearest { points: &points, order: tree.order(), query, best };
//! tree.search(&mut nearest);
//! assert_eq!(nearest.best.1, 41);
//! ```
//!
//! # Deviations from the literature
//! Answers depend neither on the order in which the tree is searched nor on the bound that a search
//! starts from: a box is skipped only if it is farther than the best answer by more than rounding
//! can explain, and equal distances are decided by the smaller index. So a batch may start each query
//! from its neighbour's answer, in any chunks, on any number of threads.

mod build;
mod hulls;
mod morton;
mod points;
mod reach;
mod search;
mod wide;

pub use build::Plan;
pub use hulls::{ConeBlock, FaceBlock};
pub use morton::spread_order;
pub use morton::{in_morton_order, morton_code, morton_order};
pub use points::PointTree;
pub use reach::{Measure, ReachTree};
pub use search::Search;
pub use wide::{Frame, Lanes, Query, WideTree};

use std::ops::Range;

use crate::Vec3;

/// An axis-parallel box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Least coordinates.
    pub lo: Vec3,
    /// Largest coordinates.
    pub hi: Vec3,
}

impl Bounds {
    /// The empty box, which lies within every other.
    pub const EMPTY: Self =
        Self { lo: Vec3::splat(f64::INFINITY), hi: Vec3::splat(f64::NEG_INFINITY) };

    /// The box of some points.
    pub fn of_points(points: impl IntoIterator<Item = Vec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |b, p| Self { lo: b.lo.min(p), hi: b.hi.max(p) })
    }

    /// The box of both.
    pub fn union(&self, other: &Self) -> Self {
        Self { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) }
    }

    /// Whether the two share a point.
    #[inline]
    pub fn overlaps(&self, other: &Self) -> bool {
        self.lo.cmple(other.hi).all() && self.hi.cmpge(other.lo).all()
    }

    /// Half the surface area of the box grown by half of `padding` on all sides.
    fn half_area(&self, padding: f64) -> f64 {
        let e = self.hi - self.lo + Vec3::splat(padding);
        e.x * e.y + e.y * e.z + e.z * e.x
    }

    /// Squared distance of `p`, 0 inside.
    #[inline]
    pub fn distance_squared(&self, p: Vec3) -> f64 {
        (self.lo - p).max(p - self.hi).max(Vec3::ZERO).length_squared()
    }

    /// Squared distance from `p` to the farthest corner.
    #[inline]
    pub fn farthest_squared(&self, p: Vec3) -> f64 {
        (p - self.lo).max(self.hi - p).length_squared()
    }
}

/// A node of the flat tree. The children of an inner node are adjacent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// Box of the items below.
    pub bounds: Bounds,
    /// Largest value that the items below carry: the largest radius of medial primitives.
    pub reach: f64,
    /// Smallest of these values.
    pub least_reach: f64,
    /// First child of an inner node, first item of a leaf.
    first: u32,
    /// Number of items of a leaf, 0 for an inner node.
    count: u32,
}

/// A bounding-volume tree. Items are renumbered so that each leaf holds a contiguous range.
#[derive(Clone, Debug)]
pub struct Tree {
    nodes: Vec<Node>,
    /// For each place in leaf order the original index of the item.
    order: Vec<u32>,
}

impl Tree {
    /// For each place in leaf order the original index of the item.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// Number of nodes.
    pub fn node_count(&self) -> usize {
        self.nodes.len()
    }

    /// For each node the places of the items below it.
    pub fn ranges(&self) -> Vec<Range<usize>> {
        let mut ranges = vec![0..0; self.nodes.len()];
        // Children follow their parents, so backwards they are known; the left has smaller places.
        for (index, node) in self.nodes.iter().enumerate().rev() {
            let first = node.first as usize;
            ranges[index] = match node.count {
                0 => ranges[first].start..ranges[first + 1].end,
                count => first..first + count as usize,
            };
        }
        ranges
    }

    /// The places of the items below a node.
    pub fn places(&self, node: usize) -> Range<u32> {
        let (mut first, mut last) = (&self.nodes[node], &self.nodes[node]);
        while first.count == 0 {
            first = &self.nodes[first.first as usize];
        }
        while last.count == 0 {
            last = &self.nodes[last.first as usize + 1];
        }
        first.first..last.first + last.count
    }

    /// Box of everything.
    pub fn bounds(&self) -> Bounds {
        self.nodes.first().map_or(Bounds::EMPTY, |root| root.bounds)
    }

    /// The first violated invariant: every item in one leaf, every box inside its parent's.
    #[cfg(test)]
    pub fn check(&self, items: &[(Bounds, f64)]) -> Result<(), String> {
        let mut seen = vec![false; items.len()];
        let mut stack = vec![0_usize];
        while let Some(index) = stack.pop() {
            let node = &self.nodes[index];
            let covers = |b: &Bounds, reach: f64| {
                let range = node.least_reach..=node.reach;
                b.union(&node.bounds) == node.bounds && range.contains(&reach)
            };
            let first = node.first as usize;
            if node.count == 0 {
                for child in [first, first + 1] {
                    let c = &self.nodes[child];
                    if child <= index
                        || !(covers(&c.bounds, c.reach) && covers(&c.bounds, c.least_reach))
                    {
                        return Err(format!("node {child} is not inside its parent {index}"));
                    }
                    stack.push(child);
                }
            } else {
                for &item in &self.order[first..first + node.count as usize] {
                    let (b, reach) = &items[item as usize];
                    if !covers(b, *reach) || seen[item as usize] {
                        return Err(format!("item {item} in leaf {index}"));
                    }
                    seen[item as usize] = true;
                }
            }
        }
        match seen.iter().position(|&s| !s) {
            Some(item) => Err(format!("item {item} is in no leaf")),
            None => Ok(()),
        }
    }
}
