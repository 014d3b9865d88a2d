//! The medial ball of a surface point, by shrinking.
//!
//! J. Ma, S. W. Bae, S. Choi 2012, *3D medial axis point approximation using nearest neighbors and the
//! normal field*, The Visual Computer 28, <https://doi.org/10.1007/s00371-011-0594-7>; as the
//! implementations that we read agree on it.
//!
//! The ball that touches the surface at `p`, with outward unit normal `n`, and passes through `q` has the
//! centre `p - r n` and `r = |p - q|^2 / (2 n . (p - q))`. Beginning with a ball that is too large, `q`
//! is the surface point nearest to the centre, again and again; `r` decreases, and in the end the ball is
//! empty.

use super::TriangleBvh;
use crate::Vec3;
use crate::geometry::Sphere;
use crate::geometry::trees::PointTree;

/// Steps at most.
const STEPS: usize = 30;

/// A ball is empty if it holds nothing deeper than this, as a fraction of the box's longest side.
const EMPTY: f64 = 1e-5;

/// After the first step a ball that touches at points less than this angle apart, in degrees, seen from its
/// centre, is that of noise: the one before it is kept.
const SEPARATION: f64 = 20.0;

/// A contact is in front of the surface if the cosine of its angle to the normal is at most this.
const IN_FRONT: f64 = 1e-12;

/// The points that a ball may touch.
#[derive(Clone, Copy)]
pub enum Touched<'a> {
    /// The points of a tree.
    Points(&'a PointTree, &'a [Vec3]),
    /// Every point of a surface.
    Mesh(&'a TriangleBvh),
}

impl Touched<'_> {
    /// The nearest point, `None` if the query is not finite.
    fn nearest(&self, query: Vec3) -> Option<(Vec3, f64)> {
        match self {
            Self::Points(tree, positions) => {
                let (point, squared) = tree.nearest(query)?;
                Some((positions[point as usize], squared.sqrt()))
            }
            Self::Mesh(tree) => {
                let closest = tree.closest(query);
                closest.distance.is_finite().then_some((closest.point, closest.distance))
            }
        }
    }
}

/// A ball that has been shrunk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// The ball.
    pub sphere: Sphere,
    /// The other contact, if it shrank.
    pub contact: Option<Vec3>,
    /// Times that it shrank.
    pub steps: usize,
    /// Why it shrinks no further.
    pub end: End,
}

/// Why a ball shrinks no further.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// It is empty.
    Empty,
    /// The next contact is too near to the first, seen from the centre.
    Noise,
    /// The nearest point lies in front of the tangent plane: by rounding, or because of a wrong normal.
    InFront,
    /// All steps were taken.
    StepLimit,
}

/// The ball that touches at `p`, with outward unit normal `n`. `side` is the longest side of the bounding
/// box: no ball inside is as large.
pub fn shrinking_ball(p: Vec3, n: Vec3, side: f64, touched: Touched<'_>) -> Ball {
    let half_separation = (0.5 * SEPARATION.to_radians()).sin();
    let (mut radius, mut steps, mut contact) = (side, 0, None);
    let end = loop {
        if steps == STEPS {
            break End::StepLimit;
        }
        let nearest = touched.nearest(p - radius * n);
        let Some((q, distance)) = nearest.filter(|&(q, _)| q != p) else { break End::Empty };
        if distance >= radius - EMPTY * side {
            break End::Empty;
        }
        let chord = p - q;
        let depth = n.dot(chord);
        // The quotient below would be negative, or mostly the rounding error of `depth`.
        if depth <= IN_FRONT * chord.length() {
            break End::InFront;
        }
        let smaller = chord.length_squared() / (2.0 * depth);
        if smaller >= radius {
            break End::Empty;
        }
        if steps > 0 && chord.length() < 2.0 * smaller * half_separation {
            break End::Noise;
        }
        (radius, steps, contact) = (smaller, steps + 1, Some(q));
    };
    Ball { sphere: Sphere::new(p - radius * n, radius), contact, steps, end }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use crate::surface::TriMesh;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    use super::*;

    /// The box with half sizes 2, 1 and 0.5.
    fn slab() -> TriangleBvh {
        let corner = |k: u32| {
            let sign = |bit: u32| if k >> bit & 1 == 1 { 1.0 } else { -1.0 };
            Vec3::new(2.0 * sign(0), sign(1), 0.5 * sign(2))
        };
        let sides =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let faces = sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        let mesh = TriMesh { vertices: (0..8).map(corner).collect(), faces };
        TriangleBvh::new(&mesh).expect("twelve triangles")
    }

    #[test]
    fn in_a_box_the_radius_is_the_distance_to_the_nearest_other_side() {
        let tree = slab();
        let mut random = Pcg64::seed_from_u64(11);
        let mut points = vec![Vec3::new(1.9, 0.2, 0.5)];
        for _ in 0..300 {
            let (x, y) = (random.random_range(-1.95..1.95), random.random_range(-0.95..0.95));
            points.push(Vec3::new(x, y, 0.5));
        }
        for p in points {
            let ball = shrinking_ball(p, Vec3::Z, 4.0, Touched::Mesh(&tree));
            let expected = (2.0 - p.x.abs()).min(1.0 - p.y.abs()).min(0.5);
            let radius = ball.sphere.radius;
            assert!(
                radius >= expected - 1e-12 && radius <= expected + 4e-5,
                "{p}: {radius} {expected}"
            );
            assert_eq!(ball.end, End::Empty);
            assert!((1..=11).contains(&ball.steps), "{} steps", ball.steps);
            // It touches: nothing is deeper in it than the bound, and something is as near.
            let distance = tree.closest(ball.sphere.centre).distance;
            assert!((distance - radius).abs() <= EMPTY * 4.0 + 1e-12);
        }
        let first = shrinking_ball(Vec3::new(1.9, 0.2, 0.5), Vec3::Z, 4.0, Touched::Mesh(&tree));
        assert!((first.sphere.radius - 0.1).abs() < 4e-5);
    }

    #[test]
    fn a_ball_of_a_ball_is_there_after_one_step() {
        let direction = |k: u32| {
            let z = 1.0 - (f64::from(k) + 0.5) / 1_000.0;
            let (sin, cos) = (2.399_963_229_728_653 * f64::from(k)).sin_cos();
            Vec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z)
        };
        let positions: Vec<Vec3> = (0..2_000).map(direction).collect();
        let tree = PointTree::new(&positions);
        let touched = Touched::Points(&tree, &positions);
        for &p in positions.iter().step_by(17) {
            let Ball { sphere, steps, end, .. } = shrinking_ball(p, p, 2.0, touched);
            assert_eq!((steps, end), (1, End::Empty));
            assert!((sphere.radius - 1.0).abs() < 1e-12 && sphere.centre.length() < 1e-12);
        }
    }

    #[test]
    fn in_a_torus_the_centres_are_on_its_circle() {
        let (large, small) = (1.0, 0.3);
        let mut random = Pcg64::seed_from_u64(12);
        let mut points: Vec<(Vec3, Vec3)> = Vec::new();
        while points.len() < 20_000 {
            let (u, v) = (random.random_range(0.0..TAU), random.random_range(0.0..TAU));
            // By area: the outside is longer.
            if random.random_range(0.0..large + small) < large + small * v.cos() {
                let normal = Vec3::new(v.cos() * u.cos(), v.cos() * u.sin(), v.sin());
                points.push((large * Vec3::new(u.cos(), u.sin(), 0.0) + small * normal, normal));
            }
        }
        let positions: Vec<Vec3> = points.iter().map(|&(p, _)| p).collect();
        let tree = PointTree::new(&positions);
        let touched = Touched::Points(&tree, &positions);
        let mut steps = 0;
        for &(p, normal) in points.iter().step_by(20) {
            let ball = shrinking_ball(p, normal, 2.6, touched);
            let Sphere { centre, radius } = ball.sphere;
            assert!((0.3 - 1e-9..0.30003).contains(&radius), "{radius}");
            let away = (centre.truncate().length() - large).hypot(centre.z);
            assert!(away < 3e-5, "{away}");
            steps += ball.steps;
        }
        assert!(steps < 3_000, "{steps} steps for 1,000 balls");
    }

    #[test]
    fn a_contact_in_front_of_the_surface_ends_the_search() {
        // A normal that is no unit vector: no ball that touches its plane holds a point in front of it.
        let positions = [Vec3::new(0.3, 0.0, 0.05)];
        let tree = PointTree::new(&positions);
        let touched = Touched::Points(&tree, &positions);
        let ball = shrinking_ball(Vec3::ZERO, 0.5 * Vec3::Z, 1.0, touched);
        assert_eq!((ball.steps, ball.end), (0, End::InFront));
    }
}
