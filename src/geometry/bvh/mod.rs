//! Bounding-volume hierarchy: a flat binary tree over boxes, built by the binned surface-area
//! heuristic (Wald 2007, doi:10.1109/RT.2007.4342588), searched nearest box first.
//!
//! The tree knows boxes only. What is in a leaf, and how far it is, is the business of the
//! [`Search`]: triangles in [`TriangleBvh`], spheres, cones and slabs in
//! [`MedialUnion`](crate::complex::MedialUnion). Closest triangles and columns of triangles are
//! looked for in a copy with four children a node and boxes in single precision ([`WideTree`]), hulls of
//! balls in one that knows radii too ([`ReachTree`]); [`WindingTree`] sums solid angles.
//!
//! # Deviations from the literature
//! Answers are independent of the order in which the tree is searched and of the bound that a
//! search starts from: boxes are given up only when they are farther than the best answer by more
//! than rounding can explain, and equal distances are decided by the smaller index. Batches may
//! therefore start each query from its neighbour's answer, in any chunks, on any number of threads.

mod block;
mod build;
mod expansion;
mod hulls;
mod morton;
mod reach;
mod search;
mod solid_angle;
mod triangles;
mod wide;
mod winding;

pub(crate) use build::Plan;
pub(crate) use hulls::{ConeBlock, FaceBlock};
pub use morton::spread_order;
pub(crate) use morton::{in_morton_order, morton_code, morton_order};
pub(crate) use reach::{Measure, ReachTree};
pub(crate) use search::Search;
pub use triangles::{BvhError, Closest, Feature, TriangleBvh};
pub(crate) use wide::{Lanes, Query, WideTree};
pub use winding::{Winding, WindingTree};

use triangles::check_corners;

use std::ops::Range;

use crate::Vec3;

/// An axis-parallel box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounds {
    pub lo: Vec3,
    pub hi: Vec3,
}

impl Bounds {
    pub const EMPTY: Self =
        Self { lo: Vec3::splat(f64::INFINITY), hi: Vec3::splat(f64::NEG_INFINITY) };

    pub fn of_points(points: impl IntoIterator<Item = Vec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |b, p| Self { lo: b.lo.min(p), hi: b.hi.max(p) })
    }

    pub fn union(&self, other: &Self) -> Self {
        Self { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) }
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
pub(crate) struct Node {
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
pub(crate) struct Tree {
    nodes: Vec<Node>,
    /// For each place the item that was put there.
    order: Vec<u32>,
}

impl Tree {
    /// For each place in leaf order the original index of the item.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// For each node the places of the items below it.
    pub fn ranges(&self) -> Vec<Range<usize>> {
        let mut ranges = vec![0..0; self.nodes.len()];
        // Children follow their parents, and the left one has the smaller places.
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
