//! Step 2: for each ball the smallest scale at which another one contains it.
//!
//! Branch and bound over a tree of boxes: no ball in a box at distance `d` whose largest radius is
//! `R` contains the ball of radius `r` below scale `d / (R - r)`.

use std::ops::Range;

use medial::complex::Sphere;
use medial::geometry::trees::{Bounds, Node, Plan, Search, Tree};
use rayon::prelude::*;

/// Balls in a leaf. Many, since balls are quickly measured: with smaller leaves queries are no
/// faster, while building the tree, which is not parallel, takes longer.
const LEAF: usize = 32;

/// The critical scale of each ball. Parallel; the order of `O(n log n)` for medial spheres.
pub(super) fn critical_scales(balls: &[Sphere]) -> Vec<f64> {
    let boxes = balls.iter().map(|ball| (Bounds::of_points([ball.centre]), ball.radius));
    let plan = Plan { max_leaf: LEAF, group: LEAF, padding: 0.0 };
    let tree = Tree::build(&boxes.collect::<Vec<_>>(), plan);
    let sorted: Vec<Sphere> = tree.order().iter().map(|&item| balls[item as usize]).collect();
    let scale = |&ball: &Sphere| {
        let mut search = CriticalScale { ball, balls: &sorted, best: f64::MAX };
        tree.search(&mut search);
        search.best
    };
    balls.par_iter().map(scale).collect()
}

/// Search for the smallest scale at which another ball contains this one.
struct CriticalScale<'a> {
    ball: Sphere,
    /// In the order of the tree.
    balls: &'a [Sphere],
    best: f64,
}

impl Search for CriticalScale<'_> {
    fn bound(&self, node: &Node) -> f64 {
        let larger_by = node.reach - self.ball.radius;
        if larger_by <= 0.0 {
            return f64::INFINITY;
        }
        // Rounding must not hide the ball itself that the bound is attained by.
        node.bounds.distance_squared(self.ball.centre).sqrt() / larger_by * (1.0 - 1e-12)
    }

    fn limit(&self) -> f64 {
        self.best
    }

    fn visit(&mut self, places: Range<usize>) {
        let larger = self.balls[places].iter().filter(|b| b.radius > self.ball.radius);
        let scales =
            larger.map(|b| self.ball.centre.distance(b.centre) / (b.radius - self.ball.radius));
        self.best = scales.fold(self.best, f64::min);
    }
}
