//! One-sided errors of a union of balls, or of a medial mesh, against a solid, each in a certified interval.
//!
//! With the solid K, bounded by a closed surface, the union U of balls, cones and slabs, and the least
//! signed distance `sigma(p)` to one of them:
//!
//! - `uncovered` is the largest `sigma(p)` over K, boundary and interior, and 0 if it is negative: the
//!   distance from U to the farthest point of the solid outside it;
//! - `overshoot` is the largest distance to K over the points of U.
//!
//! Unlike the two sides of [`certify`](super::certify), which measure boundaries, neither counts a
//! point that is in both, and `uncovered` sees holes of U inside the solid.
//!
//! Both are found by branch and bound over cubes. Each cube has the list of the balls that can matter
//! in it, which its eighths inherit. With the centre `q` and half diagonal `h` of a cube:
//!
//! 1. Over a cube, the signed distance to one ball is largest at the corner farthest from its centre.
//!    So the least of these bounds `sigma` from above, and a cube in one ball is covered.
//! 2. A cube is outside K, or within it, if `q` is and the surface is farther away than `h`.
//! 3. A ball with its centre at the signed distance `s` from K (negative inside) is nowhere farther
//!    from K than `r + s`, since the distance to K is 1-Lipschitz and a ball of radius `-s` fits into K.
//!    So balls with `r <= -s` need no search, and the others bound the overshoot in the cubes they meet.
//! 4. Everything else is bounded by distances being 1-Lipschitz. For cones and slabs this is the only
//!    bound, and `sigma` comes from the tree of [`MedialUnion`] in place of lists.
//! 5. On tubes the distance is near its maximum along whole curves, and 4 alone would need cubes as small
//!    as the tolerance there. So a convex function `g >= sigma` bounds it to second order: the signed
//!    distance to one ball, or the mean of two with weights that leave no slope along the surface. In the
//!    part of a cube in K, `g` is largest at a corner of the cube in K, or at a corner of a triangle of the
//!    surface that is cut to the cube.
//!
//! All cubes of one size are evaluated in one round, so the result is the same for any number of
//! threads.
//!
//! # Proof of zero
//!
//! An upper end of exactly 0 is a proof: every cube is in one ball or outside K, or every ball in K,
//! by more than [`ROUNDING`]. Cubes are divided beyond the tolerance for it, to a half diagonal of
//! [`SMALLEST`]: where the margin is smaller than about that, the interval ends at a positive number.

use rayon::prelude::*;

use super::bounds::{Bound, Largest, Pieces, ROUNDING, check_tolerance};
use super::error::MetricError;
use super::evaluation::OneSided;
use crate::Vec3;
use crate::complex::{MedialUnion, UnionError};
use crate::geometry::Sphere;
use crate::geometry::trees::Bounds;
use crate::surface::{Closest, InsideTest, Side, TriMesh, TriangleBvh};

/// Half diagonal of the smallest cubes that a proof of zero divides, in diagonals of the surface.
pub const SMALLEST: f64 = 1e-6;

/// Number of cubes of a round above which a proof of zero is given up.
const MOST_FOR_ZERO: usize = 1 << 19;

/// The same for a medial mesh, which seldom contains a solid or fits into it.
const MOST_FOR_ZERO_OF_MESH: usize = 1 << 16;

/// Limit of cubes of a round: about 1 GB.
const MOST: usize = 1 << 22;

/// Number of triangles near a cube above which they are not cut to it.
const MOST_CUT: usize = 12;

/// Half the diagonal of a cube of half side 1.
const HALF_DIAGONAL: f64 = 1.732_050_807_568_877_3;

/// A solid that unions of balls are measured against: the tree and the inside test of one closed,
/// outward-oriented surface with a diagonal of about 1.
#[derive(Clone, Copy, Debug)]
pub struct CoverTest<'a> {
    surface: &'a TriMesh,
    tree: &'a TriangleBvh,
    inside: &'a InsideTest,
    bounds: Bounds,
}

impl<'a> CoverTest<'a> {
    /// The solid in a surface, whose tree and inside test are given.
    pub fn new(surface: &'a TriMesh, tree: &'a TriangleBvh, inside: &'a InsideTest) -> Self {
        let bounds = Bounds::of_points(surface.vertices.iter().copied());
        Self { surface, tree, inside, bounds }
    }

    /// The largest distance from a point of the solid to the union of the balls, in an interval no
    /// wider than `tolerance`. Both in the unit of the surface.
    ///
    /// The cost grows with the area where the distance is within the tolerance of its maximum.
    ///
    /// # Errors
    /// A tolerance out of range or too fine; no balls, or balls that are not finite.
    pub fn uncovered(&self, balls: &[Sphere], tolerance: f64) -> Result<OneSided, MetricError> {
        check(balls, tolerance)?;
        let all = (0..balls.len() as u32).collect();
        let bound = |cube: &mut Cube, enough| self.uncovered_in(balls, cube, enough);
        Cubes::new(tolerance, MOST_FOR_ZERO, bound).search(Largest::above(0.0), self.bounds, all)
    }

    /// The largest distance from a point of the union of the balls to the solid, as [`Self::uncovered`].
    ///
    /// # Errors
    /// As [`Self::uncovered`].
    pub fn overshoot(&self, balls: &[Sphere], tolerance: f64) -> Result<OneSided, MetricError> {
        check(balls, tolerance)?;
        let of_ball = |ball: &Sphere| {
            let closest = self.tree.closest(ball.centre);
            let signed = self.signed(ball.centre, &closest);
            // Towards the closest surface point, a ball that is larger than its depth leaves the solid.
            let outward = (closest.point - ball.centre) * signed.signum() * -1.0;
            let tip = ball.centre + ball.radius * outward.normalize_or(Vec3::X);
            (ball.radius + signed, self.height(tip), tip)
        };
        let reaches: Vec<_> = balls.par_iter().map(of_ball).collect();
        let most: Vec<f64> = reaches.iter().map(|&(most, ..)| most).collect();
        let all: Vec<u32> =
            (0..balls.len() as u32).filter(|&i| most[i as usize] > -ROUNDING).collect();
        let corners = all.iter().flat_map(|&i| {
            let Sphere { centre, radius } = balls[i as usize];
            [centre - radius, centre + radius]
        });
        let bounds = Bounds::of_points(corners);
        let mut largest = Largest::above(0.0);
        for (_, height, tip) in reaches {
            largest.raise(height - ROUNDING, tip);
        }
        let bound = |cube: &mut Cube, enough| self.overshoot_in(balls, &most, cube, enough);
        Cubes::new(tolerance, MOST_FOR_ZERO, bound).search(largest, bounds, all)
    }

    /// [`Self::uncovered`] and [`Self::overshoot`] of the union of spheres, cones and slabs.
    ///
    /// # Errors
    /// A tolerance out of range or too fine.
    pub fn of_union(
        &self,
        union: &MedialUnion,
        tolerance: f64,
    ) -> Result<[OneSided; 2], MetricError> {
        check_tolerance(tolerance)?;
        let (lo, hi) = union.bounding_box();
        let most = MOST_FOR_ZERO_OF_MESH;
        let none = Largest::above(0.0);
        let uncovered = |cube: &mut Cube, enough| self.uncovered_by(union, cube, enough);
        let overshoot = |cube: &mut Cube, enough| self.overshoot_of(union, cube, enough);
        Ok([
            Cubes::new(tolerance, most, uncovered).search(none, self.bounds, vec![0])?,
            Cubes::new(tolerance, most, overshoot).search(none, Bounds { lo, hi }, vec![0])?,
        ])
    }

    /// Where a cube is, and a point of the solid near its centre with its value, `here` at the centre; `None` outside.
    fn place_of(
        &self,
        cube: &Cube,
        here: f64,
        value: impl Fn(Vec3) -> f64,
    ) -> Option<(Place, f64, Vec3)> {
        let q = cube.centre;
        let Place::Near(face) = cube.place else { return Some((Place::Inside, here, q)) };
        let Closest { distance, face, point, .. } = self.tree.closest_from(q, face);
        if distance <= cube.reach() + ROUNDING {
            // Unlike the centre, the closest point of the surface is in the solid for sure.
            return Some((Place::Near(Some(face)), value(point), point));
        }
        (self.inside.side(q) != Side::Outside).then_some((Place::Inside, here, q))
    }

    fn uncovered_by(&self, union: &MedialUnion, cube: &mut Cube, enough: f64) -> Bound {
        let (q, reach) = (cube.centre, cube.reach());
        let sigma = union.signed(q);
        let upper = sigma + reach;
        if upper <= enough {
            return Bound::above(upper);
        }
        let value = |p| union.signed(p);
        let Some((place, reached, at)) = self.place_of(cube, sigma, value) else {
            return Bound::above(f64::NEG_INFINITY);
        };
        cube.place = place;
        Bound { reached, at, upper }
    }

    fn overshoot_of(&self, union: &MedialUnion, cube: &mut Cube, enough: f64) -> Bound {
        let (q, reach) = (cube.centre, cube.reach());
        let upper = self.signed(q, &self.tree.closest(q)) + reach;
        if upper <= enough {
            return Bound::above(upper);
        }
        if !union.buries(q, -reach - ROUNDING) {
            return Bound::above(f64::NEG_INFINITY);
        }
        // A point of the union near the centre of the cube.
        let at = if union.buries(q, 0.0) { Some(q) } else { union.boundary_near(q, 0.0, &mut 0) };
        let (reached, at) = at.map_or((f64::NEG_INFINITY, q), |at| (self.height(at), at));
        Bound { reached, at, upper }
    }

    /// The signed distance of a point, negative in the solid, by its closest surface point.
    fn signed(&self, p: Vec3, closest: &Closest) -> f64 {
        match self.inside.side(p) {
            Side::Inside => -closest.distance,
            Side::On => 0.0,
            Side::Outside => closest.distance,
        }
    }

    /// The distance of a point to the solid.
    fn height(&self, p: Vec3) -> f64 {
        match self.inside.side(p) {
            Side::Outside => self.tree.closest(p).distance,
            Side::Inside | Side::On => 0.0,
        }
    }

    fn uncovered_in(&self, balls: &[Sphere], cube: &mut Cube, enough: f64) -> Bound {
        let (q, reach) = (cube.centre, cube.reach());
        let over = |i: &u32| balls[*i as usize].signed_distance(q);
        // The nearest ball, and the next.
        let mut near = [(f64::INFINITY, cube.balls[0]); 2];
        for i in &cube.balls {
            let now = (over(i), *i);
            if now.0 < near[0].0 {
                near = [now, near[0]];
            } else if now.0 < near[1].0 {
                near[1] = now;
            }
        }
        let signed = near[0].0;
        let mut upper = signed + reach;
        for &i in &cube.balls {
            let Sphere { centre, radius } = balls[i as usize];
            upper = upper.min(((q - centre).abs() + cube.half).length() - radius);
        }
        if upper <= enough {
            return Bound::above(upper);
        }
        // The list of balls holds around the closest point, too.
        let value = |p| {
            let each = cube.balls.iter().map(|&i| balls[i as usize].signed_distance(p));
            each.fold(f64::INFINITY, f64::min)
        };
        let Some((place, reached, at)) = self.place_of(cube, signed, value) else {
            return Bound::above(f64::NEG_INFINITY);
        };
        let two = near.map(|(_, i)| balls[i as usize]);
        if reached <= enough {
            upper = upper.min(self.second_order(two, cube, place, enough));
            if upper <= enough {
                return Bound { reached, at, upper };
            }
        }
        // No ball that is farther than this from `q` is the nearest one within `reach` of it.
        cube.balls.retain(|i| over(i) <= signed + 2.0 * reach);
        cube.place = place;
        Bound { reached, at, upper }
    }

    /// A bound on the distance to the nearer of two balls in the part of a cube in the solid, by item 5;
    /// infinite if it exceeds `enough`.
    fn second_order(&self, [a, b]: [Sphere; 2], cube: &Cube, place: Place, enough: f64) -> f64 {
        let (q, half) = (cube.centre, cube.half);
        let (mut cut, mut normal) = (Vec::new(), Vec3::ZERO);
        if let Place::Near(face) = place {
            let (mut faces, mut count) = ([0; MOST_CUT], 0);
            self.tree.each_within(q, cube.reach() + ROUNDING, |face, _| {
                if count < MOST_CUT {
                    faces[count] = face;
                }
                count += 1;
            });
            if count > MOST_CUT {
                return f64::INFINITY;
            }
            for &face in &faces[..count] {
                cut_to_cube(self.surface.triangle(face as usize), q, half, &mut cut);
            }
            let [u, v, w] = self.surface.triangle(face.unwrap_or(faces[0]) as usize);
            normal = (v - u).cross(w - u).normalize_or_zero();
        }
        let [ga, gb] = [a, b].map(|ball| {
            let slope = (q - ball.centre).normalize_or_zero();
            slope - slope.dot(normal) * normal
        });
        let level = (gb.dot(gb - ga) / (gb - ga).length_squared()).clamp(0.0, 1.0);
        let corners = (0..8_u32).map(|octant| {
            let sign = |bit: u32| if octant >> bit & 1 == 1 { half } else { -half };
            q + Vec3::new(sign(0), sign(1), sign(2))
        });
        let weights = [1.0, level].into_iter().filter(|weight| weight.is_finite());
        let bounds = weights.map(|weight| {
            let g = |p: Vec3| weight * a.signed_distance(p) + (1.0 - weight) * b.signed_distance(p);
            let mut most = cut.iter().map(|&p| g(p)).fold(f64::NEG_INFINITY, f64::max);
            for corner in corners.clone() {
                if most > enough {
                    return f64::INFINITY;
                }
                let is_larger = g(corner) > most;
                let is_inner = matches!(place, Place::Inside);
                if is_larger && (is_inner || self.inside.side(corner) != Side::Outside) {
                    most = g(corner);
                }
            }
            if most > enough { f64::INFINITY } else { most }
        });
        bounds.fold(f64::INFINITY, f64::min)
    }

    fn overshoot_in(&self, balls: &[Sphere], most: &[f64], cube: &mut Cube, enough: f64) -> Bound {
        let (q, reach) = (cube.centre, cube.reach());
        let meets = |&i: &u32| {
            let Sphere { centre, radius } = balls[i as usize];
            let apart = ((q - centre).abs() - cube.half).max(Vec3::ZERO).length();
            most[i as usize] > enough && apart <= radius + ROUNDING
        };
        let list: Vec<u32> = cube.balls.iter().copied().filter(meets).collect();
        if list.is_empty() {
            // Each ball that was dropped here is no farther away from the solid than `enough`.
            let upper = cube.balls.iter().map(|&i| most[i as usize].min(enough));
            return Bound::above(upper.fold(f64::NEG_INFINITY, f64::max));
        }
        let closest = self.tree.closest(q);
        let signed = self.signed(q, &closest);
        let of_balls = list.iter().map(|&i| most[i as usize]).fold(f64::NEG_INFINITY, f64::max);
        // Dropped balls count as `enough`.
        let upper = of_balls.min(signed + reach).max(enough.min(signed + reach));
        if upper <= enough {
            return Bound::above(upper);
        }
        // A point of the union near the centre of the cube.
        let depth = |i: &&u32| balls[**i as usize].signed_distance(q);
        let deepest = list.iter().min_by(|i, j| depth(i).total_cmp(&depth(j)));
        let outside = deepest.map(|&i| balls[i as usize]).filter(|b| b.signed_distance(q) > 0.0);
        let (reached, at) = match outside {
            None => (signed, q),
            Some(Sphere { centre, radius }) => {
                let at = centre + radius * (q - centre).normalize_or(Vec3::X);
                (self.height(at), at)
            }
        };
        cube.balls = list;
        Bound { reached, at, upper }
    }
}

/// Adds the corners of the part of a triangle in a cube.
fn cut_to_cube(triangle: [Vec3; 3], centre: Vec3, half: f64, corners: &mut Vec<Vec3>) {
    let mut polygon = triangle.to_vec();
    for (axis, side) in (0..3).flat_map(|axis| [(axis, 1.0), (axis, -1.0)]) {
        let beyond = |p: Vec3| side * (p[axis] - centre[axis]) - half;
        let mut kept = Vec::with_capacity(polygon.len() + 1);
        for (k, &p) in polygon.iter().enumerate() {
            let next = polygon[(k + 1) % polygon.len()];
            let (here, there) = (beyond(p), beyond(next));
            if here <= 0.0 {
                kept.push(p);
            }
            if (here <= 0.0) != (there <= 0.0) {
                kept.push(p.lerp(next, here / (here - there)));
            }
        }
        polygon = kept;
    }
    corners.extend(polygon);
}

/// # Errors
/// When there are no balls, one is not finite, or the tolerance is out of range.
fn check(balls: &[Sphere], tolerance: f64) -> Result<(), MetricError> {
    check_tolerance(tolerance)?;
    // The checks of a union: there are balls, and all are finite.
    MedialUnion::of_spheres(balls).map(drop).map_err(|error: UnionError| error.into())
}

/// A cube, and the balls that can matter in it.
struct Cube {
    centre: Vec3,
    /// Half of its side.
    half: f64,
    place: Place,
    balls: Vec<u32>,
}

/// What a cube inherits about the surface.
#[derive(Clone, Copy)]
enum Place {
    /// It can meet the surface near this face.
    Near(Option<u32>),
    /// It is within the solid.
    Inside,
}

impl Cube {
    /// Half of its diagonal.
    fn reach(&self) -> f64 {
        HALF_DIAGONAL * self.half
    }
}

/// Cubes with a function that bounds the distances in one.
struct Cubes<F> {
    bound: F,
    /// Width of the interval, without the rounding of its ends.
    goal: f64,
    /// Whether the search still looks for a proof of zero.
    proves: bool,
    /// Number of cubes of a round above which it gives up.
    most_for_zero: usize,
}

impl<F: Fn(&mut Cube, f64) -> Bound + Sync> Cubes<F> {
    fn new(tolerance: f64, most_for_zero: usize, bound: F) -> Self {
        // Both ends are widened by ROUNDING, and half of one more covers the rounding of these sums.
        Self { bound, goal: tolerance - 2.5 * ROUNDING, proves: true, most_for_zero }
    }

    /// The interval over the cube around a box, with `balls` that can matter.
    fn search(
        mut self,
        mut largest: Largest,
        bounds: Bounds,
        balls: Vec<u32>,
    ) -> Result<OneSided, MetricError> {
        let mut cubes = Vec::new();
        if !balls.is_empty() {
            let half = 0.5 * (bounds.hi - bounds.lo).max_element();
            let centre = 0.5 * (bounds.lo + bounds.hi);
            cubes.push(Cube { centre, half: half * (1.0 + 1e-9), place: Place::Near(None), balls });
        }
        largest.search(&mut self, cubes, MOST)?;
        let Largest { lower, witness, upper, .. } = largest;
        let upper = if upper <= -ROUNDING { 0.0 } else { upper.max(lower) + ROUNDING };
        Ok(OneSided { lower, upper, witness })
    }
}

impl<F: Fn(&mut Cube, f64) -> Bound + Sync> Pieces for Cubes<F> {
    type Piece = Cube;
    type Near = ();
    const RUN: usize = 16;

    fn near(&self) {}

    fn begin(&mut self, cubes: &[Cube], lower: f64) {
        // Once given up, a proof of zero is not resumed: the upper bound is positive by then.
        self.proves &=
            lower == 0.0 && cubes.len() <= self.most_for_zero && cubes[0].reach() > SMALLEST;
    }

    fn enough(&self, lower: f64) -> f64 {
        if self.proves && lower == 0.0 { -ROUNDING } else { lower + self.goal }
    }

    fn bound(&self, cube: &mut Cube, _: f64, enough: f64, (): &mut ()) -> Bound {
        let bound = (self.bound)(cube, enough);
        Bound { reached: bound.reached - ROUNDING, ..bound }
    }

    fn divide(&self, cube: &Cube, parts: &mut Vec<Cube>) {
        let half = 0.5 * cube.half;
        for octant in 0..8_u32 {
            let sign = |bit: u32| if octant >> bit & 1 == 1 { half } else { -half };
            let centre = cube.centre + Vec3::new(sign(0), sign(1), sign(2));
            parts.push(Cube { centre, half, place: cube.place, balls: cube.balls.clone() });
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    use super::*;
    use crate::complex::MedialMesh;
    use crate::surface::fixtures::cuboid;

    const TOLERANCE: f64 = 1e-3;

    struct Solid {
        mesh: TriMesh,
        tree: TriangleBvh,
        inside: InsideTest,
    }

    impl Solid {
        fn of(mesh: TriMesh) -> Self {
            let (tree, inside) = (TriangleBvh::new(&mesh).unwrap(), InsideTest::new(&mesh));
            Self { mesh, tree, inside }
        }

        fn test(&self) -> CoverTest<'_> {
            CoverTest::new(&self.mesh, &self.tree, &self.inside)
        }
    }

    /// A box around the origin.
    fn block(half: Vec3) -> TriMesh {
        cuboid(-half, half)
    }

    fn joined(mut mesh: TriMesh, other: TriMesh) -> TriMesh {
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend(other.vertices);
        mesh.faces.extend(other.faces.into_iter().map(|face| face.map(|v| first + v)));
        mesh
    }

    fn cube(half: f64) -> Solid {
        Solid::of(block(Vec3::splat(half)))
    }

    /// Both errors, of which each interval is no wider than the tolerance.
    fn errors(solid: &Solid, balls: &[Sphere], tolerance: f64) -> [OneSided; 2] {
        let test = solid.test();
        let both = [test.uncovered(balls, tolerance), test.overshoot(balls, tolerance)];
        both.map(|interval| {
            let interval = interval.unwrap();
            assert!(interval.lower <= interval.upper, "{interval:?}");
            assert!(interval.upper - interval.lower <= tolerance, "{interval:?}");
            assert_eq!(interval.witness.is_some(), interval.lower > 0.0);
            interval
        })
    }

    #[track_caller]
    fn holds(interval: OneSided, value: f64) {
        let OneSided { lower, upper, .. } = interval;
        assert!(lower <= value + 1e-12 && value <= upper + 1e-12, "{value} in {interval:?}");
    }

    #[test]
    fn one_ball_around_or_in_a_cube() {
        let (half, corner) = (0.25, 0.25 * 3_f64.sqrt());
        for radius in [0.1, 0.25, 0.3, corner - 1e-4, corner + 1e-4, 0.6] {
            let balls = [Sphere::new(Vec3::ZERO, radius)];
            let [uncovered, overshoot] = errors(&cube(half), &balls, TOLERANCE);
            holds(uncovered, (corner - radius).max(0.0));
            holds(overshoot, (radius - half).max(0.0));
            assert_eq!(uncovered.upper == 0.0, radius > corner, "{radius} {uncovered:?}");
            assert_eq!(overshoot.upper == 0.0, radius < half, "{radius} {overshoot:?}");
        }
    }

    #[test]
    fn a_hole_inside_the_solid_is_uncovered() {
        let solid = cube(0.25);
        // They cover all sides, whose centres are at the distance 0.25 * sqrt 2, not the centre.
        let balls: Vec<_> = solid.mesh.vertices.iter().map(|&v| Sphere::new(v, 0.375)).collect();
        let [uncovered, overshoot] = errors(&solid, &balls, TOLERANCE);
        holds(uncovered, 0.25 * 3_f64.sqrt() - 0.375);
        holds(overshoot, 0.375);
        let witness = uncovered.witness.unwrap();
        assert!(witness.length() < 0.01, "{witness}");
    }

    #[test]
    fn a_ball_in_a_cavity_is_farthest_from_the_solid_at_its_centre() {
        let mut cavity = block(Vec3::splat(0.125));
        cavity.faces.iter_mut().for_each(|face| face.swap(1, 2));
        let solid = Solid::of(joined(block(Vec3::splat(0.25)), cavity));
        for radius in [0.05, 0.2] {
            let balls = [Sphere::new(Vec3::ZERO, radius)];
            holds(errors(&solid, &balls, TOLERANCE)[1], 0.125);
        }
        // Outside the solid alone: the union covers nothing.
        let balls = [Sphere::new(Vec3::new(0.75, 0.0, 0.0), 0.25)];
        let [uncovered, overshoot] = errors(&solid, &balls, TOLERANCE);
        holds(overshoot, 0.75);
        holds(uncovered, Vec3::new(1.0, 0.25, 0.25).length() - 0.25);
    }

    /// Compares intervals with the largest of sampled distances, which fall short by less than `slack`, and checks the
    /// witnesses.
    fn hold_for_samples(
        test: &CoverTest<'_>,
        intervals: [OneSided; 2],
        slack: f64,
        sigma: impl Fn(Vec3) -> f64,
        mut point: impl FnMut() -> Vec3,
    ) {
        let mut largest = [0.0_f64; 2];
        for _ in 0..20_000 {
            let p = point();
            let (height, sigma) = (test.height(p), sigma(p));
            if height == 0.0 {
                largest[0] = largest[0].max(sigma);
            }
            if sigma <= 0.0 {
                largest[1] = largest[1].max(height);
            }
        }
        for (sampled, interval) in largest.into_iter().zip(intervals) {
            let OneSided { upper, lower, .. } = interval;
            assert!(sampled <= upper && sampled > lower - slack, "{sampled} {interval:?}");
            assert!(upper - lower <= TOLERANCE, "{interval:?}");
        }
        let [uncovered, overshoot] = intervals;
        let at = uncovered.witness.unwrap();
        assert!(test.height(at) < 1e-9 && (sigma(at) - uncovered.lower).abs() < 1e-8);
        if let Some(at) = overshoot.witness {
            assert!(sigma(at) < 1e-9 && (test.height(at) - overshoot.lower).abs() < 1e-8);
        }
    }

    #[test]
    fn samples_never_contradict_the_intervals() {
        let other = cuboid(Vec3::new(0.1, 0.2, -0.05), Vec3::new(0.3, 0.6, 0.05));
        let solid = Solid::of(joined(block(Vec3::new(0.4, 0.1, 0.05)), other));
        let mut random = Pcg64::seed_from_u64(5);
        let mut point =
            |scale: f64| scale * Vec3::from([0; 3].map(|_| random.random_range(-1.0..1.0)));
        for round in 0..6 {
            let ball = |_| Sphere::new(point(0.5), 0.02 + 0.1 * point(1.0).x.abs());
            let balls: Vec<_> = (0..10 + 8 * round).map(ball).collect();
            let sigma =
                |p: Vec3| balls.iter().map(|b| b.signed_distance(p)).fold(f64::INFINITY, f64::min);
            let intervals = errors(&solid, &balls, TOLERANCE);
            hold_for_samples(&solid.test(), intervals, 0.06, sigma, || point(0.7));
        }
    }

    #[test]
    fn cones_and_slabs_cover_as_their_union_does() {
        let solid = Solid::of(block(Vec3::new(0.4, 0.2, 0.05)));
        let test = solid.test();
        let mut random = Pcg64::seed_from_u64(7);
        let mut point =
            |scale: Vec3| scale * Vec3::from([0; 3].map(|_| random.random_range(-1.0..1.0)));
        let mut positive = [0; 2];
        for round in 0..8 {
            let ball =
                |_| Sphere::new(point(Vec3::new(0.4, 0.2, 0.03)), 0.02 + 0.004 * round as f64);
            let spheres = (0..9).map(ball).collect();
            let (edges, faces) = (vec![[0, 1], [5, 6]], vec![[1, 2, 3], [2, 3, 4], [6, 7, 5]]);
            let medial = MedialMesh::from_simplices(spheres, edges, faces).unwrap();
            let union = MedialUnion::new(&medial).unwrap();
            let intervals = test.of_union(&union, TOLERANCE).unwrap();
            let around = || point(Vec3::new(0.5, 0.3, 0.15));
            hold_for_samples(&test, intervals, 0.03, |p| union.signed(p), around);
            intervals.iter().zip(&mut positive).for_each(|(i, n)| *n += u32::from(i.lower > 0.0));
        }
        assert!(positive.iter().all(|&count| count > 4), "{positive:?}");
    }

    #[test]
    fn a_capsule_is_covered_by_its_cone() {
        let solid = cube(0.05);
        let test = solid.test();
        let ends = [-0.05, 0.05].map(|x| Sphere::new(Vec3::new(x, 0.0, 0.0), 0.08));
        let rod = MedialMesh::from_simplices(ends.to_vec(), vec![[0, 1]], vec![]).unwrap();
        let [uncovered, overshoot] =
            test.of_union(&MedialUnion::new(&rod).unwrap(), TOLERANCE).unwrap();
        assert_eq!(uncovered.upper, 0.0);
        holds(overshoot, 0.08);
        assert!(test.uncovered(&ends, TOLERANCE).unwrap().lower > 0.0);
    }

    #[test]
    fn unmeasurable_balls_are_errors() {
        let solid = cube(0.25);
        let test = solid.test();
        assert!(matches!(test.uncovered(&[], 1e-3), Err(MetricError::Union(_))));
        let balls = [Sphere::new(Vec3::ZERO, 0.1)];
        assert_eq!(test.overshoot(&balls, 0.0), Err(MetricError::Tolerance(0.0)));
        assert!(test.overshoot(&[Sphere::new(Vec3::ZERO, f64::NAN)], 1e-3).is_err());
    }
}
