//! Nearest-point queries on a growing set of points.

use crate::Vec3;
use crate::geometry::trees::PointTree;

/// A growing set of points: trees over consecutive runs, each run longer than the next, and a tail that
/// is searched linearly.
#[derive(Default)]
pub(super) struct Growing {
    /// In the order in which they came.
    pub points: Vec<Vec3>,
    trees: Vec<PointTree>,
}

/// Up to this many points a linear search is cheaper than a tree.
const TAIL: usize = 64;

impl Growing {
    fn in_trees(&self) -> usize {
        self.trees.iter().map(PointTree::len).sum()
    }

    /// Adds a point. Costs `O(log^2 n)` on average.
    pub fn push(&mut self, point: Vec3) {
        self.points.push(point);
        let mut first = self.in_trees();
        if self.points.len() - first < TAIL {
            return;
        }
        while let Some(last) = self.trees.pop_if(|last| last.len() <= self.points.len() - first) {
            first -= last.len();
        }
        self.trees.push(PointTree::new(&self.points[first..]));
    }

    /// The distance of the nearest point, infinite without any.
    pub fn distance(&self, p: Vec3) -> f64 {
        let near = self.trees.iter().filter_map(|tree| Some(tree.nearest(p)?.1));
        let tail = self.points[self.in_trees()..].iter().map(|q| q.distance_squared(p));
        near.chain(tail).fold(f64::INFINITY, f64::min).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    use super::*;

    #[test]
    fn the_nearest_of_all_so_far() {
        let mut rng = Pcg64::seed_from_u64(5);
        let mut point = || Vec3::new(rng.random(), rng.random(), rng.random());
        let mut growing = Growing::default();
        assert_eq!(growing.distance(Vec3::ZERO), f64::INFINITY);
        for _ in 0..700 {
            growing.push(point());
            let query = point();
            let all = growing.points.iter().map(|p| p.distance_squared(query));
            assert_eq!(growing.distance(query), all.fold(f64::INFINITY, f64::min).sqrt());
        }
        assert!(growing.trees.len() > 1 && growing.trees.len() < 8);
    }
}
