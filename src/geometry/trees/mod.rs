//! Points and boxes in trees.
//!
//! [`PointTree`] finds points by distance: the nearest one, and those within a
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
//! Results depend neither on the order in which the tree is searched nor on the bound that a search
//! starts from: a box is skipped only if it is farther than the best result by more than rounding
//! can explain, and equal distances are decided by the smaller index. So a batch may start each query
//! from its neighbour's result, in any chunks, on any number of threads.

mod search;
mod wide;

use std::ops::Range;

use rayon::prelude::*;

use crate::Vec3;

pub use crate::trees::search::{PointTree, Search};
pub use crate::trees::wide::{
    ConeBlock, FaceBlock, Frame, Lanes, Measure, Query, ReachTree, WideTree,
};

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

// Building the tree: binned surface-area heuristic.
//
// 1. The centres of the items' boxes are sorted into bins along each axis.
// 2. The plane between bins with the least expected cost splits the range.
// 3. A small range becomes a leaf if that is cheaper, or if all centres share one bin. A large range
//    whose centres share one bin is halved by count.

const BINS: usize = 16;
/// Cost of descending into a node, in units of one item.
const DESCENT: f64 = 1.0;
/// From this depth on ranges are halved by count, so that no tree is deeper than [`MAX_DEPTH`]:
/// geometrically growing coordinates would split off one item at a time.
const HALVING_DEPTH: usize = 40;
/// Bound on the depth of any tree: `HALVING_DEPTH` plus the halvings of `2^32` items.
const MAX_DEPTH: usize = HALVING_DEPTH + 33;

#[derive(Clone, Copy)]
struct Item {
    bounds: Bounds,
    /// Twice the centre.
    centre: Vec3,
    reach: f64,
    id: u32,
}

#[derive(Clone, Copy)]
struct Bin {
    bounds: Bounds,
    count: usize,
}

/// The use that a tree is built for.
#[derive(Clone, Copy, Debug)]
pub struct Plan {
    /// Leaves never hold more items.
    pub max_leaf: usize,
    /// Number of items that are measured together at the cost of one; part of a group costs as much
    /// as a whole one.
    pub group: usize,
    /// Added to the sides of boxes when costs are compared: the distance beyond its box at which an
    /// item still matters. It also gives flat boxes an area.
    pub padding: f64,
}

impl Plan {
    /// Cost of looking at some items.
    fn cost(self, count: usize) -> f64 {
        count.div_ceil(self.group) as f64
    }
}

impl Tree {
    /// A tree over items, each a box and a non-negative value. Each node stores the largest and the
    /// smallest value below it.
    ///
    /// Cost `O(n log n)`.
    pub fn build(items: &[(Bounds, f64)], plan: Plan) -> Self {
        let mut items: Vec<Item> = (0..)
            .zip(items)
            .map(|(id, &(bounds, reach))| Item { bounds, centre: bounds.lo + bounds.hi, reach, id })
            .collect();
        let mut nodes = Vec::with_capacity(items.len().max(1));
        if !items.is_empty() {
            nodes.push(node(&items, 0));
            split(&mut nodes, 0, &mut items, Place { first: 0, depth: 0 }, plan);
        }
        Self { nodes, order: items.iter().map(|item| item.id).collect() }
    }
}

/// A leaf over `items`, which start at `first`.
fn node(items: &[Item], first: usize) -> Node {
    let bounds = items.iter().fold(Bounds::EMPTY, |b, item| b.union(&item.bounds));
    let reach = items.iter().fold(0.0, |reach, item| f64::max(reach, item.reach));
    let least_reach = items.iter().fold(reach, |least, item| f64::min(least, item.reach));
    Node { bounds, reach, least_reach, first: first as u32, count: items.len() as u32 }
}

/// Where a range of items is: its first item, and the depth of its node.
#[derive(Clone, Copy)]
struct Place {
    first: usize,
    depth: usize,
}

/// Turns the leaf `index` over `items`, which start at `place.first`, into a subtree if that pays.
fn split(nodes: &mut Vec<Node>, index: usize, items: &mut [Item], place: Place, plan: Plan) {
    let Place { first, depth } = place;
    let count = items.len();
    // No plane is sought where none can pay: a split costs a descent besides its parts. With groups
    // as large as leaves, that is half of all ranges.
    if count < 2 || (count <= plan.max_leaf && plan.cost(count) <= DESCENT) {
        return;
    }
    let plane = if depth < HALVING_DEPTH { cheapest_plane(items, plan) } else { None };
    let middle = match plane {
        Some(plane) => {
            let cost = DESCENT + plane.cost / nodes[index].bounds.half_area(plan.padding);
            // A box without area makes the cost not a number, and this false.
            let pays = cost < plan.cost(count);
            if count <= plan.max_leaf && !pays {
                return;
            }
            partition(items, &plane)
        }
        None if count <= plan.max_leaf => return,
        None => count / 2,
    };
    let (left, right) = items.split_at_mut(middle);
    let child = nodes.len();
    // Both children before the subtree of either, so that they are adjacent.
    nodes.push(node(left, first));
    nodes.push(node(right, first + middle));
    nodes[index].first = child as u32;
    nodes[index].count = 0;
    let depth = depth + 1;
    split(nodes, child, left, Place { first, depth }, plan);
    split(nodes, child + 1, right, Place { first: first + middle, depth }, plan);
}

struct Plane {
    axis: usize,
    binning: Binning,
    /// First bin of the right side.
    bin: usize,
    /// Sum over both sides of items times half area.
    cost: f64,
}

/// Map from a coordinate to its bin.
#[derive(Clone, Copy)]
struct Binning {
    lo: f64,
    scale: f64,
}

impl Binning {
    fn bin(&self, coordinate: f64) -> usize {
        // The cast saturates, so coordinates that are not numbers have a bin too.
        (((coordinate - self.lo) * self.scale) as usize).min(BINS - 1)
    }
}

/// The cheapest plane with items on both sides, `None` when all centres share one bin.
fn cheapest_plane(items: &[Item], plan: Plan) -> Option<Plane> {
    let centres = Bounds::of_points(items.iter().map(|item| item.centre));
    let mut best: Option<Plane> = None;
    for axis in 0..3 {
        let extent = centres.hi[axis] - centres.lo[axis];
        let scale = BINS as f64 / extent;
        // Subnormal extents overflow the scale.
        if !(extent > 0.0 && scale.is_finite()) {
            continue;
        }
        let binning = Binning { lo: centres.lo[axis], scale };
        let mut bins = [Bin { bounds: Bounds::EMPTY, count: 0 }; BINS];
        for item in items {
            let bin = &mut bins[binning.bin(item.centre[axis])];
            bin.bounds = bin.bounds.union(&item.bounds);
            bin.count += 1;
        }
        let (bin, cost) = sweep(&bins, plan);
        // Strictly cheaper: ties go to the first axis, so that the tree is determined.
        if best.as_ref().is_none_or(|b| cost < b.cost) {
            best = Some(Plane { axis, binning, bin, cost });
        }
    }
    best.filter(|plane| plane.cost.is_finite())
}

/// The best first bin of the right side, and its cost; infinite when one side would be empty.
fn sweep(bins: &[Bin; BINS], plan: Plan) -> (usize, f64) {
    // Planes on either side of an empty bin cost the same; most bins of a small range are empty.
    let mut right_cost = [f64::INFINITY; BINS + 1];
    let (mut bounds, mut count) = (Bounds::EMPTY, 0);
    for k in (1..BINS).rev() {
        right_cost[k] = right_cost[k + 1];
        if bins[k].count > 0 {
            bounds = bounds.union(&bins[k].bounds);
            count += bins[k].count;
            right_cost[k] = plan.cost(count) * bounds.half_area(plan.padding);
        }
    }
    let mut best = (0, f64::INFINITY);
    (bounds, count) = (Bounds::EMPTY, 0);
    for k in 1..BINS {
        if bins[k - 1].count > 0 {
            bounds = bounds.union(&bins[k - 1].bounds);
            count += bins[k - 1].count;
            let cost = plan.cost(count) * bounds.half_area(plan.padding) + right_cost[k];
            if cost < best.1 {
                best = (k, cost);
            }
        }
    }
    best
}

/// Moves the left side's items to the front and returns their number.
fn partition(items: &mut [Item], plane: &Plane) -> usize {
    let mut middle = 0;
    for k in 0..items.len() {
        if plane.binning.bin(items[k].centre[plane.axis]) < plane.bin {
            items.swap(k, middle);
            middle += 1;
        }
    }
    middle
}

// Points along a Morton curve, and batches of queries along it, in which each query may start from
// the result of the one before.

/// Consecutive queries on one thread: enough that the first, which starts from nothing, does not
/// matter, and few enough to balance the load.
const CHUNK: usize = 1024;

/// Runs a query for each point. `answer` may keep in its state anything that speeds up the next,
/// nearby query, but no result may depend on the state.
pub fn in_morton_order<S, R>(points: &[Vec3], answer: impl Fn(&mut S, Vec3) -> R + Sync) -> Vec<R>
where
    S: Default,
    R: Copy + Send + Sync,
{
    let order = morton_order(points);
    let sorted: Vec<R> = order
        .par_chunks(CHUNK)
        .flat_map_iter(|chunk| {
            let mut state = S::default();
            let answer = &answer;
            chunk.iter().map(move |&(_, point)| answer(&mut state, points[point as usize]))
        })
        .collect();
    // The inverse order first, so that the results can be gathered in parallel.
    let mut places = vec![0_u32; points.len()];
    for (place, &(_, point)) in (0..).zip(&order) {
        places[point as usize] = place;
    }
    places.par_iter().map(|&place| sorted[place as usize]).collect()
}

/// Morton codes and indices of points, sorted. Points that are not numbers have a code too.
pub fn morton_order(points: &[Vec3]) -> Vec<(u64, u32)> {
    let Bounds { lo, hi } = Bounds::of_points(points.iter().copied());
    let scale = (hi - lo).map(|extent| if extent > 0.0 { (1 << 21) as f64 / extent } else { 0.0 });
    // The index breaks ties, so that an unstable parallel sort has one result.
    let mut order: Vec<(u64, u32)> = (0..points.len())
        .into_par_iter()
        .map(|i| (morton_code((points[i] - lo) * scale), i as u32))
        .collect();
    order.par_sort_unstable();
    order
}

/// An order of points of which every prefix is spread evenly over all of them: it steps through
/// their Morton curve by the golden ratio. Input indices matter for coincident points only.
/// Cost `O(n log n)`.
///
/// ```
/// use medial_geometry::{Vec3, trees::spread_order};
///
/// let points: Vec<Vec3> = (0..100).map(|k| Vec3::new(f64::from(k), 0.0, 0.0)).collect();
/// let mut first: Vec<u32> = spread_order(&points)[..5].to_vec();
/// first.sort_unstable();
/// assert!(first[0] < 20 && first[4] >= 80);
/// ```
pub fn spread_order(points: &[Vec3]) -> Vec<u32> {
    // The golden ratio as a fraction of 2^32: its multiples modulo one leave nearly equal gaps.
    const GOLDEN: u32 = 0x9e37_79b9;
    let along = morton_order(points);
    let keyed = (0_u32..).zip(along).map(|(place, (_, point))| (place.wrapping_mul(GOLDEN), point));
    let mut spread: Vec<(u32, u32)> = keyed.collect();
    spread.sort_unstable();
    spread.into_iter().map(|(_, point)| point).collect()
}

/// The Morton code of a point with coordinates from 0 to `2^21`.
pub fn morton_code(p: Vec3) -> u64 {
    // The casts saturate: points that are not numbers have a code too.
    let cell = p.to_array().map(|c| spread((c as u64).min((1 << 21) - 1)));
    cell[0] | cell[1] << 1 | cell[2] << 2
}

/// The 21 bits of a number, each followed by two zeros.
fn spread(mut bits: u64) -> u64 {
    for (shift, mask) in [
        (32, 0x001f_0000_0000_ffff),
        (16, 0x001f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ] {
        bits = (bits | bits << shift) & mask;
    }
    bits
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAN: Plan = Plan { max_leaf: 4, group: 1, padding: 0.0 };

    fn boxes(centres: impl IntoIterator<Item = Vec3>, half: f64) -> Vec<(Bounds, f64)> {
        let half = Vec3::splat(half);
        let bounds = |c: Vec3| Bounds { lo: c - half, hi: c + half };
        centres.into_iter().map(|c| (bounds(c), c.x.abs())).collect()
    }

    fn depth(tree: &Tree, index: usize) -> usize {
        let node = &tree.nodes[index];
        let first = node.first as usize;
        match node.count {
            0 => 1 + depth(tree, first).max(depth(tree, first + 1)),
            _ => 1,
        }
    }

    #[test]
    fn invariants_hold_for_ordinary_and_hostile_items() {
        let grid =
            (0..1000).map(|i| Vec3::new((i % 10) as f64, (i / 10 % 10) as f64, (i / 100) as f64));
        let cases = [
            boxes(grid, 0.3),
            boxes(std::iter::repeat_n(Vec3::ONE, 500), 0.0),
            boxes((0..500).map(|i| Vec3::splat(2.0_f64.powi(i - 250))), 0.0),
            boxes((0..500).map(|i| Vec3::X * 1e-310 * f64::from(i)), 0.0),
            boxes([Vec3::ZERO], 1.0),
        ];
        for items in cases {
            let tree = Tree::build(&items, PLAN);
            assert_eq!(tree.check(&items), Ok(()));
            assert!(depth(&tree, 0) <= MAX_DEPTH);
        }
    }

    #[test]
    fn an_infinite_limit_reaches_every_leaf_once() {
        for count in 1..60 {
            let items = boxes((0..count).map(|i| Vec3::X * f64::from(i * i)), 0.1);
            let wide = wide::WideTree::new(&Tree::build(&items, PLAN));
            let query = wide.query(Vec3::X).expect("near");
            let mut seen = vec![0; wide.leaves().len()];
            wide.nearest(&query, f32::INFINITY, |leaf, _| {
                seen[leaf] += 1;
                f32::INFINITY
            });
            assert!(seen.iter().all(|&times| times == 1), "{count}: {seen:?}");
        }
    }

    #[test]
    fn geometric_progressions_are_halved() {
        let items = boxes((0..2000).map(|i| Vec3::X * 0.5_f64.powi(i / 2)), 0.0);
        let tree = Tree::build(&items, PLAN);
        assert_eq!(tree.check(&items), Ok(()));
        assert!(depth(&tree, 0) <= HALVING_DEPTH + 12);
    }

    #[test]
    fn spread_puts_two_zeros_between_bits() {
        for bits in [0, 1, 0b1011, (1 << 21) - 1, 0x15_5555] {
            let naive = (0..21).map(|i| (bits >> i & 1) << (3 * i)).sum::<u64>();
            assert_eq!(spread(bits), naive);
        }
    }

    #[test]
    fn results_are_in_the_order_of_the_points() {
        let points: Vec<Vec3> = (0..5000)
            .map(|i| Vec3::new((f64::from(i) * 0.37).sin(), f64::from(i % 71), 0.5))
            .collect();
        let echoed = in_morton_order(&points, |last: &mut Option<Vec3>, p| {
            *last = Some(p);
            p
        });
        assert_eq!(echoed, points);
        assert!(in_morton_order(&[], |(): &mut (), p| p).is_empty());
        let odd = [Vec3::NAN, Vec3::ZERO, Vec3::splat(f64::INFINITY)];
        assert_eq!(in_morton_order(&odd, |(): &mut (), p| p.x.to_bits())[1], 0);
    }
}
