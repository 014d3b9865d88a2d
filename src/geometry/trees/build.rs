//! Building the tree: binned surface-area heuristic.
//!
//! 1. The centres of the items' boxes are sorted into bins along each axis.
//! 2. The plane between bins with the least expected cost splits the range.
//! 3. A small range becomes a leaf if that is cheaper, or if all centres share one bin. A large range
//!    whose centres share one bin is halved by count.

use super::{Bounds, Node, Tree};
use crate::Vec3;

const BINS: usize = 16;
/// Cost of descending into a node, in units of one item.
const DESCENT: f64 = 1.0;
/// From this depth on ranges are halved by count, so that no tree is deeper than [`MAX_DEPTH`]:
/// geometrically growing coordinates would split off one item at a time.
const HALVING_DEPTH: usize = 40;
/// Bound on the depth of any tree: `HALVING_DEPTH` plus the halvings of `2^32` items.
pub(super) const MAX_DEPTH: usize = HALVING_DEPTH + 33;

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
    // No plane is sought where none can pay: a split costs a descent beside its parts. With groups
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
    fn geometric_progressions_are_halved() {
        let items = boxes((0..2000).map(|i| Vec3::X * 0.5_f64.powi(i / 2)), 0.0);
        let tree = Tree::build(&items, PLAN);
        assert_eq!(tree.check(&items), Ok(()));
        assert!(depth(&tree, 0) <= HALVING_DEPTH + 12);
    }
}
