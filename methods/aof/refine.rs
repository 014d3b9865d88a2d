//! From the centre of a voxel onto the axis, between opposite closest points.
//!
//! S. Stolpner, S. Whitesides, K. Siddiqi, *Sampled medial loci for 3D shape representation*,
//! Computer Vision and Image Understanding 115(5), 2011, doi:10.1016/j.cviu.2010.10.014: a point
//! between a sample and its opposite whose closest points differ is localised by bisection.
//!
//! 1. A sample `p` with `a = grad D . N < 0` and closest point `B` looks into the sphere along the
//!    ray from `B` through `p`. Up to the axis, `B` stays the closest point of the points of the ray.
//! 2. If `B` is not the closest point of the opposite `p'` of `p` any more, the axis lies between:
//!    bisection for the last point `x` with `D(x) = |x - B|`.
//! 3. There the ball of radius `D(x)` is inside the solid, and touches the surface at `B` and
//!    within the tolerance at a second point `B'`. Of the samples that look nearest past the centre
//!    the one whose `B`, `B'` subtend the largest angle is taken.

use medial::Vec3;
use medial::complex::Sphere as Ball;
use medial::geometry::TriangleBvh;

use super::flux::Sphere;

/// Samples that are followed onto the axis.
const FOLLOWED: usize = 4;
/// Width of the last interval, in radii of the voxel's sphere.
const TOLERANCE: f64 = 1e-9;
/// Relative to the distance, how much nearer the surface must be for it to be another point.
const SAME: f64 = 1e-12;

/// A ball on the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refined {
    /// The ball: its radius is the distance of its centre to the surface.
    pub ball: Ball,
    /// Two closest points, the second within the tolerance; the same twice where the centre was
    /// not moved.
    pub contacts: [Vec3; 2],
}

/// The ball on the axis near `centre`, or the ball around `centre` itself where no sample and its
/// opposite have different closest points.
pub fn refine(tree: &TriangleBvh, sphere: &Sphere, centre: Vec3) -> Refined {
    let mut rays = Vec::with_capacity(sphere.directions.len());
    let mut last = None;
    for &normal in &sphere.directions {
        let p = centre + normal * sphere.radius;
        let near = tree.closest_from(p, last);
        last = Some(near.face);
        let Some(gradient) = (p - near.point).try_normalize() else {
            continue;
        };
        let along = gradient.dot(normal);
        if along < 0.0 {
            rays.push((along, p, gradient, near.point));
        }
    }
    rays.sort_by(|a, b| a.0.total_cmp(&b.0));
    let length = |along: f64| -2.0 * sphere.radius * along;
    let found = rays
        .iter()
        .filter_map(|&(along, p, gradient, foot)| {
            let ray = Ray { tree, start: p, gradient, foot };
            ray.localise(length(along), TOLERANCE * sphere.radius)
        })
        .take(FOLLOWED);
    let subtended = |r: &Refined| r.contacts[0].distance(r.contacts[1]) / r.ball.radius;
    let best =
        found.reduce(|best, next| if subtended(&next) > subtended(&best) { next } else { best });
    best.unwrap_or_else(|| {
        let near = tree.closest(centre);
        Refined { ball: Ball::new(centre, near.distance), contacts: [near.point; 2] }
    })
}

/// The ray from a closest point through its sample.
struct Ray<'a> {
    tree: &'a TriangleBvh,
    start: Vec3,
    gradient: Vec3,
    foot: Vec3,
}

impl Ray<'_> {
    /// A point nearer than the foot to the point of the ray `t` behind the sample, if there is one.
    fn other(&self, t: f64) -> Option<Vec3> {
        let q = self.start + self.gradient * t;
        let bound = q.distance(self.foot) * (1.0 - SAME);
        self.tree.closest_within(q, bound).map(|near| near.point)
    }

    /// Step 2.
    fn localise(&self, length: f64, tolerance: f64) -> Option<Refined> {
        let mut second = self.other(length)?;
        let (mut low, mut high) = (0.0, length);
        while high - low > tolerance {
            let middle = 0.5 * (low + high);
            match self.other(middle) {
                Some(point) => (high, second) = (middle, point),
                None => low = middle,
            }
            if !(low < 0.5 * (low + high) && 0.5 * (low + high) < high) {
                break;
            }
        }
        let centre = self.start + self.gradient * low;
        let radius = self.tree.closest(centre).distance;
        Some(Refined { ball: Ball::new(centre, radius), contacts: [self.foot, second] })
    }
}
