//! Pairwise scale filter: removes every ball that another one contains once both are scaled.
//!
//! How P. Li, B. Wang, F. Sun, X. Guo, C. Zhang, W. Wang 2015 (Q-MAT, ACM Transactions on Graphics
//! 35(1), <https://doi.org/10.1145/2753755>) describe the scale axis transform in their section on
//! related work. It is not that transform, which removes balls that the *union* of all scaled balls
//! covers and recomputes the medial axis of that union: for this see the method `sat`.
//!
//! 1. The initial medial mesh.
//! 2. The scaled ball `(c_j, s r_j)` contains `(c_i, s r_i)` if and only if
//!    `|c_i - c_j| <= s (r_j - r_i)`. The critical scale of a ball is the smallest such `s` over all
//!    larger balls; the largest balls have none.
//! 3. Keep the balls whose critical scale is above `s`, or the given number of balls with the largest
//!    ones.
//! 4. The induced subcomplex of the initial mesh: edges and faces all of whose spheres are kept.
//!
//! # Choices
//! - Containment is transitive, so removing all at once or one by one is the same.
//! - The spheres are those of the initial medial mesh, not the polar balls, so that there is a complex
//!   to restrict.
//! - A ball without a critical scale counts as having the largest number of double precision.

use std::ops::Range;

use medial::complex::Sphere;
use medial::geometry::trees::{Bounds, Node, Plan, Search, Tree};
use medial::shape::Shape;
use medial::simplifier::{Diagnostics, Method, MethodInfo, NativeLevel, NoParams, RunContext};
use rayon::prelude::*;

use crate::Prepared;
use crate::ranked::{Published, Ranked, Scale};

/// The pairwise scale filter as a method.
pub fn method() -> Method<NoParams> {
    let info = MethodInfo::new("sat-pairwise", "Pairwise scale filter (not SAT)")
        .citation(
            "After the description in Li et al. 2015, Q-MAT, ACM Transactions on Graphics 35(1), \
             https://doi.org/10.1145/2753755, of Miklos, Giesen, Pauly 2010, \
             https://doi.org/10.1145/1778765.1778838",
        )
        .bibtex(crate::references(&["MiklosGiesenPauly2010"]))
        .summary("Removes the spheres that another sphere contains once both are scaled.")
        .native(NativeLevel::larger_is_coarser("s", "scale factor"))
        .published("unsupported: it is described, not published, as a method");
    Method::new(info, prepare)
}

fn prepare<'s>(shape: &'s Shape, _: NoParams, run: &RunContext) -> Prepared<'s> {
    let mesh = shape.initial()?;
    run.check()?;
    let value = critical_scales(&mesh.spheres);
    run.check()?;
    let scale = Scale {
        name: "s",
        range: 0.0..=f64::MAX,
        inclusive: false,
        published: Published::None(
            "this filter is described, not published, as a method; request a number of spheres or \
             a scale (1.1 to 2 is usual for the transform)",
        ),
    };
    Ok(Box::new(Ranked::new(mesh, value, scale, Diagnostics::default())))
}

// Step 2: for each ball the smallest scale at which another one contains it.
//
// Branch and bound over a tree of boxes: no ball in a box at distance `d` whose largest radius is
// `R` contains the ball of radius `r` below scale `d / (R - r)`.

/// Balls in a leaf. Many, since balls are quickly measured: with smaller leaves queries are no
/// faster, while building the tree, which is not parallel, takes longer.
const LEAF: usize = 32;

/// The critical scale of each ball. Parallel; the order of `O(n log n)` for medial spheres.
fn critical_scales(balls: &[Sphere]) -> Vec<f64> {
    let boxes = balls.iter().map(|ball| (Bounds::of_points([ball.centre]), ball.radius));
    let plan = Plan { max_leaf: LEAF, group: LEAF, padding: 0.0 };
    let tree = Tree::build(&boxes.collect::<Vec<_>>(), plan);
    let sorted: Vec<Sphere> = tree.order().iter().map(|&item| balls[item as usize]).collect();
    balls
        .par_iter()
        .map(|&ball| {
            let mut search = CriticalScale { ball, balls: &sorted, best: f64::MAX };
            tree.search(&mut search);
            search.best
        })
        .collect()
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

#[cfg(test)]
mod tests {
    use medial::Vec3;
    use medial::complex::{Sphere, UnionAxis};
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    use super::critical_scales;

    #[test]
    fn critical_scales_are_those_of_all_pairs() {
        let mut rng = Pcg64::seed_from_u64(51);
        for n in [1, 2, 9, 100, 700] {
            let mut x = || rng.random_range(0.0..1.0);
            let mut balls: Vec<Sphere> =
                (0..n).map(|_| Sphere::new(Vec3::new(x(), x(), x()), x() * x())).collect();
            balls.push(balls[0]);
            balls.push(Sphere::new(balls[0].centre, 2.0));
            let of_all_pairs = |a: &Sphere| {
                let larger = balls.iter().filter(|b| b.radius > a.radius);
                let scales = larger.map(|b| a.centre.distance(b.centre) / (b.radius - a.radius));
                scales.fold(f64::MAX, f64::min)
            };
            let expected: Vec<f64> = balls.iter().map(of_all_pairs).collect();
            assert_eq!(critical_scales(&balls), expected);
            assert_eq!((expected[0], expected[n + 1]), (0.0, f64::MAX));
        }
    }

    #[test]
    fn the_transform_removes_all_that_it_removes_and_more() {
        let mut rng = Pcg64::seed_from_u64(52);
        let (mut here, mut there) = (0, 0);
        for _ in 0..100 {
            let mut x = || rng.random_range(0.0..1.0);
            let balls: Vec<Sphere> =
                (0..40).map(|_| Sphere::new(Vec3::new(x(), x(), x()), 0.3 * x())).collect();
            let critical = critical_scales(&balls);
            for scale in [1.0, 1.3, 2.0] {
                let grown: Vec<Sphere> =
                    balls.iter().map(|b| Sphere::new(b.centre, scale * b.radius)).collect();
                let axis = UnionAxis::of_balls(&grown).expect("balls");
                let is_centre = |i: usize| axis.balls().binary_search(&(i as u32)).is_ok();
                for (i, &at) in critical.iter().enumerate() {
                    // Off the scale itself, which rounding decides.
                    assert!(at >= scale * (1.0 - 1e-9) || !is_centre(i));
                    here += u32::from(at < scale);
                    there += u32::from(!is_centre(i));
                }
            }
        }
        assert!(here > 1_000 && there > here + 300, "{here} {there}");
    }

    #[test]
    fn equal_balls_never_contain_each_other() {
        let balls = [0.0, 1.0, 2.0].map(|x| Sphere::new(Vec3::new(x, 0.0, 0.0), 1.0));
        assert_eq!(critical_scales(&balls), [f64::MAX; 3]);
        assert!(critical_scales(&[]).is_empty());
    }
}
