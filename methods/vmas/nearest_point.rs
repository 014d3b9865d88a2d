//! The nearest of the surface points, for shrinking balls.
//!
//! A ball that fits the surface has very many points at nearly the same distance from its centre, the worst
//! case of every tree: the boxes of all its leaves are looked into. Here two levels are searched in lanes of
//! four: bounding balls of groups of [`GROUP`] consecutive points, then the points of the groups that
//! may hold the nearest one.

use medial::Vec3;
use medial::complex::Sphere;
use wide::f64x4;

use super::points::ball_around;

/// Points of a group: fewer mean more groups to look at, more mean larger balls around them.
const GROUP: usize = 64;

/// Lanes of a group.
const LANES: usize = GROUP / 4;

/// Coordinate of a point that is none: farther than every other, and its square is finite.
const FAR: f64 = 1e150;

/// Share by which a bound is lowered: more than its rounding error.
const SLACK: f64 = 1e-12;

/// Points in groups; those that follow each other should be near each other.
#[derive(Clone, Debug)]
pub(super) struct PointGroups {
    positions: Vec<Vec3>,
    /// [`LANES`] for each group.
    points: Vec<[f64x4; 3]>,
    /// Centre and radius of four bounding balls.
    balls: Vec<[f64x4; 4]>,
}

impl PointGroups {
    /// Points along a curve, by the order of which ties are decided.
    pub fn new(positions: &[Vec3]) -> Self {
        let balls: Vec<Sphere> = positions.chunks(GROUP).map(ball_around).collect();
        let lane = |four: &[Vec3], axis: usize| {
            f64x4::new([0, 1, 2, 3].map(|k| four.get(k).map_or(FAR, |p| p[axis])))
        };
        let mut points = Vec::with_capacity(balls.len() * LANES);
        for group in positions.chunks(GROUP) {
            points.extend(group.chunks(4).map(|four| [0, 1, 2].map(|axis| lane(four, axis))));
            points.resize(points.len().next_multiple_of(LANES), [f64x4::splat(FAR); 3]);
        }
        let of_four = |four: &[Sphere]| {
            let value = |value: &dyn Fn(&Sphere) -> f64, none: f64| {
                f64x4::new([0, 1, 2, 3].map(|k| four.get(k).map_or(none, value)))
            };
            [
                value(&|ball| ball.centre.x, FAR),
                value(&|ball| ball.centre.y, FAR),
                value(&|ball| ball.centre.z, FAR),
                value(&|ball| ball.radius, 0.0),
            ]
        };
        let balls = balls.chunks(4).map(of_four).collect();
        Self { positions: positions.to_vec(), points, balls }
    }

    /// The nearest point, that of the smallest id among equally near ones, and its squared distance; `None`
    /// if the query is not finite.
    pub fn nearest(&self, query: Vec3) -> Option<(Vec3, f64)> {
        if !query.is_finite() {
            return None;
        }
        let at = query.to_array().map(f64x4::splat);
        let mut best = (f64::INFINITY, u32::MAX);
        // A group that is likely to hold it first, so that most others need no look.
        self.scan(self.nearest_group(&at), &at, &mut best);
        for (four, ball) in self.balls.iter().enumerate() {
            let bounds = lower_bounds(ball, &at);
            // The limit falls from group to group.
            for (k, bound) in bounds.to_array().into_iter().enumerate() {
                if bound <= best.0 {
                    self.scan(4 * four + k, &at, &mut best);
                }
            }
        }
        let position = self.positions.get(best.1 as usize)?;
        Some((*position, best.0))
    }

    fn nearest_group(&self, at: &[f64x4; 3]) -> usize {
        let bound = |(four, ball)| {
            let in_lanes = lower_bounds(ball, at).to_array().into_iter().enumerate();
            in_lanes.map(move |(k, bound)| (bound, 4 * four + k))
        };
        let bounds = self.balls.iter().enumerate().flat_map(bound);
        bounds.fold((f64::INFINITY, 0), |a, b| if b.0 < a.0 { b } else { a }).1
    }

    /// Looks at the points of a group. One of those beyond the last is looked at in vain.
    fn scan(&self, group: usize, at: &[f64x4; 3], best: &mut (f64, u32)) {
        let Some(points) = self.points.get(group * LANES..(group + 1) * LANES) else { return };
        let (mut least, mut who) = (f64x4::splat(f64::INFINITY), f64x4::splat(0.0));
        let mut ids = f64x4::new([0.0, 1.0, 2.0, 3.0]) + f64x4::splat((group * GROUP) as f64);
        for point in points {
            let u = [at[0] - point[0], at[1] - point[1], at[2] - point[2]];
            let squared = u[0] * u[0] + u[1] * u[1] + u[2] * u[2];
            // Ids ascend in each lane: the first of equal distances stays.
            let less = squared.simd_lt(least);
            least = less.bitselect(squared, least);
            who = less.bitselect(ids, who);
            ids += f64x4::splat(4.0);
        }
        for (squared, id) in least.to_array().into_iter().zip(who.to_array()) {
            let found = (squared, id as u32);
            if found < *best {
                *best = found;
            }
        }
    }
}

/// Lower bounds of the squared distances to the points in four balls.
fn lower_bounds([x, y, z, radius]: &[f64x4; 4], at: &[f64x4; 3]) -> f64x4 {
    let u = [at[0] - *x, at[1] - *y, at[2] - *z];
    let distance = (u[0] * u[0] + u[1] * u[1] + u[2] * u[2]).sqrt();
    let lowered = distance * f64x4::splat(1.0 - SLACK) - *radius * f64x4::splat(1.0 + SLACK);
    let bound = lowered.max(f64x4::splat(0.0));
    bound * bound
}

#[cfg(test)]
mod tests {
    use medial::geometry::trees::PointTree;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    use super::*;

    #[test]
    fn it_is_that_of_a_tree() {
        let mut random = Pcg64::seed_from_u64(21);
        for count in [1, 3, 63, 64, 65, 257, 2_000] {
            for lattice in [false, true] {
                let mut x = || {
                    let x: f64 = random.random_range(-1.0..1.0);
                    // On a lattice many points are equally near, and some are the same.
                    if lattice { (8.0 * x).round() / 8.0 } else { x }
                };
                let mut points: Vec<Vec3> = (0..count).map(|_| Vec3::new(x(), x(), x())).collect();
                points.sort_by(|a, b| a.x.total_cmp(&b.x));
                let groups = PointGroups::new(&points);
                let tree = PointTree::new(&points);
                for _ in 0..200 {
                    let query = 2.0 * Vec3::new(x(), x(), x());
                    let (id, squared) = tree.nearest(query).expect("there are points");
                    assert_eq!(groups.nearest(query), Some((points[id as usize], squared)));
                }
                assert_eq!(groups.nearest(Vec3::NAN), None);
            }
        }
    }
}
