//! The medial primitives, sphere, cone and slab, with their signed distances.

use crate::Vec3;
use crate::planar_frame::PlanarFrame;

/// A medial sphere `m = (c, r)`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Sphere {
    /// Centre `c`.
    pub centre: Vec3,
    /// Radius `r`. It should not be negative, which is not enforced: distances follow their formula
    /// with any number, while [`DualComplex::of_balls`](crate::DualComplex::of_balls) and
    /// [`PowerCrust::new`](crate::PowerCrust::new) refuse a negative radius.
    pub radius: f64,
}

impl Sphere {
    /// A sphere from its centre and radius.
    pub const fn new(centre: Vec3, radius: f64) -> Self {
        Self { centre, radius }
    }

    /// The point `(1 - t) self + t other` of the edge between two spheres, in `R^4`.
    pub fn lerp(self, other: Self, t: f64) -> Self {
        Self::new(self.centre.lerp(other.centre, t), self.radius + t * (other.radius - self.radius))
    }

    /// Signed distance of `p` to the sphere, negative inside. A sphere of radius 0 is a point.
    pub fn signed_distance(&self, p: Vec3) -> f64 {
        p.distance(self.centre) - self.radius
    }
}

// Signed distance to the convex hull of two balls: the medial cone of an edge.
//
// The hull is the union of the balls `B(c(t), r(t))`, `t` in `[0, 1]`, so the signed distance is
// the minimum over `t` of `|p - c(t)| - r(t)`: convex in `t`, which makes clamping exact.
//
// # Notation
// | | |
// |---|---|
// | `u`, `l` | unit axis from the first to the second centre, and their distance |
// | `s` | slope `(r_2 - r_1) / l` of the radius, `abs(s) < 1` unless one ball holds the other |
// | `xi`, `y` | coordinate of the query along the axis, and its distance from the axis |
// | `tau` | coordinate of the best centre, `xi + y s / sqrt(1 - s^2)` clamped to `[0, l]` |
//
// The distance is evaluated at `tau` and not by the closed form of the tangent line: near
// internal tangency `tau` carries few digits, but the objective is flat there.

/// The convex hull of two balls, prepared for distance queries.
///
/// When one ball holds the other (tangency and equality included) the hull is the larger ball.
///
/// ```
/// use medial_geometry::{Cone, Sphere, Vec3};
///
/// // A rod of radius 1 with round ends, and a query above its middle.
/// let rod = Cone::new(Sphere::new(Vec3::ZERO, 1.0), Sphere::new(4.0 * Vec3::X, 1.0));
/// let above = Vec3::new(2.0, 3.0, 0.0);
/// assert_eq!(rod.signed_distance(above), 2.0);
/// assert_eq!(rod.signed_distance(2.0 * Vec3::X), -1.0);
/// assert_eq!(rod.nearest_sphere(above), (Sphere::new(2.0 * Vec3::X, 1.0), [0.5, 0.5]));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    /// Centre of the first ball.
    pub(crate) start: Vec3,
    /// `u`; zero when one ball holds the other.
    pub(crate) axis: Vec3,
    /// `l`; zero when one ball holds the other.
    pub(crate) length: f64,
    /// Radius at `start`.
    pub(crate) radius: f64,
    /// `s`.
    pub(crate) slope: f64,
    /// `s / sqrt(1 - s^2)`: the shift of the best centre along the axis, per unit of `y`.
    pub(crate) lead: f64,
    /// The ball (0 or 1) that holds the other, if one does.
    larger: Option<usize>,
}

impl Cone {
    /// The hull of two balls.
    pub fn new(first: Sphere, second: Sphere) -> Self {
        let across = second.centre - first.centre;
        let growth = second.radius - first.radius;
        let length = across.length();
        if length <= growth.abs() {
            let larger = usize::from(growth > 0.0);
            return Self::ball([first, second][larger], larger);
        }
        // Product form: 1 - s^2 would cancel near tangency.
        let rise = (length - growth).sqrt() * (length + growth).sqrt();
        Self {
            start: first.centre,
            axis: across / length,
            length,
            radius: first.radius,
            slope: growth / length,
            lead: growth / rise,
            larger: None,
        }
    }

    fn ball(sphere: Sphere, larger: usize) -> Self {
        Self {
            start: sphere.centre,
            axis: Vec3::ZERO,
            length: 0.0,
            radius: sphere.radius,
            slope: 0.0,
            lead: 0.0,
            larger: Some(larger),
        }
    }

    /// The ball (0 or 1) that holds the other, if one does.
    pub fn larger(&self) -> Option<usize> {
        self.larger
    }

    /// Signed distance of `p` to the boundary of the hull, negative inside: the true distance up to
    /// rounding, inside as well as outside, not a bound.
    #[inline]
    pub fn signed_distance(&self, p: Vec3) -> f64 {
        let (tau, squared) = self.best_centre(p);
        squared.sqrt() - (self.radius + tau * self.slope)
    }

    /// Signed distance of `p` as [`Cone::signed_distance`] has it, and the centre of the
    /// interpolated sphere that attains it. Cheaper than [`Cone::nearest_sphere`].
    #[inline]
    pub fn nearest_centre(&self, p: Vec3) -> (f64, Vec3) {
        let (tau, squared) = self.best_centre(p);
        (squared.sqrt() - (self.radius + tau * self.slope), self.start + tau * self.axis)
    }

    /// Coordinate of the best centre, and squared distance of `p` from it.
    #[inline]
    fn best_centre(&self, p: Vec3) -> (f64, f64) {
        let w = p - self.start;
        let xi = w.dot(self.axis);
        // As a vector: sqrt(|w|^2 - xi^2) loses half the digits near the axis.
        let y_squared = (w - xi * self.axis).length_squared();
        let tau = (xi + y_squared.sqrt() * self.lead).clamp(0.0, self.length);
        (tau, (xi - tau) * (xi - tau) + y_squared)
    }

    /// The interpolated sphere that attains the distance of `p`, and its weights over the two balls: non-negative, of sum 1.
    pub fn nearest_sphere(&self, p: Vec3) -> (Sphere, [f64; 2]) {
        let (tau, _) = self.best_centre(p);
        let radius = (self.radius + tau * self.slope).max(0.0);
        let sphere = Sphere::new(self.start + tau * self.axis, radius);
        let weights = match self.larger {
            Some(0) => [1.0, 0.0],
            Some(_) => [0.0, 1.0],
            None => {
                let t = tau / self.length;
                [1.0 - t, t]
            }
        };
        (sphere, weights)
    }

    /// The axis frame from which the tangent planes follow, or `None` when one ball holds the
    /// other and there are none.
    pub fn frame(&self) -> Option<ConeFrame> {
        self.larger.is_none().then(|| ConeFrame::new(self.axis, self.slope))
    }
}

// Signed distance to the convex hull of three balls: the medial slab of a triangle.
//
// The hull is the union of the balls `B(c(a), r(a))` over the triangle, so the signed distance is
// the minimum over the triangle of `|p - c(a)| - r(a)`: convex, hence either the unconstrained
// minimum, if that lies in the triangle, or on a side, where it is the distance to a cone.
//
// 1. In the frame of the centres' plane ([`PlanarFrame`]) the query is `(x, y, h)`, and the
//    radius is linear with gradient `g`.
// 2. The best centre is `(x, y) + |h| / k g` with `k = sqrt(1 - g.g)`.
// 3. Inside the triangle, the distance to its sphere is the result; else the least of the cones.
//
// With collinear centres, or `g.g >= 1` (no plane touches all three balls from outside), the hull
// is the union of the three cones, exactly.
//
// The distance is evaluated at the best centre, as in [`Cone`] and for the same reason.

/// Height of the centres' triangle, relative to its length and radius, below which its tangent planes
/// are mostly rounding. Distances stay exact, because the objective is flat there.
const MIN_RELATIVE_HEIGHT: f64 = 1e-10;

/// The convex hull of three balls, prepared for distance queries.
///
/// ```
/// use medial_geometry::{Slab, Sphere, Vec3};
///
/// // A triangular plate, 2 thick, with round edges, and queries above it and next to it.
/// let corners = [Vec3::ZERO, 8.0 * Vec3::X, Vec3::new(4.0, 4.0, 0.0)];
/// let plate = Slab::new(corners.map(|c| Sphere::new(c, 1.0)));
/// let above = Vec3::new(4.0, 2.0, 3.0);
/// assert_eq!(plate.signed_distance(above), 2.0);
/// assert_eq!(plate.signed_distance(Vec3::new(4.0, -3.0, 0.0)), 2.0);
/// assert_eq!(plate.signed_distance(Vec3::new(4.0, 2.0, 0.0)), -1.0);
/// let (sphere, weights) = plate.nearest_sphere(above);
/// assert_eq!((sphere.centre, weights), (Vec3::new(4.0, 2.0, 0.0), [0.25, 0.25, 0.5]));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slab {
    face: Option<SlabFace>,
    /// Cones of the sides 01, 12, 20.
    cones: [Cone; 3],
}

impl Slab {
    /// The hull of three balls.
    pub fn new(spheres: [Sphere; 3]) -> Self {
        let cones = [0, 1, 2].map(|k| Cone::new(spheres[k], spheres[(k + 1) % 3]));
        Self { face: SlabFace::new(spheres), cones }
    }

    /// Signed distance of `p` to the boundary of the hull, negative inside: the true distance up to
    /// rounding, inside as well as outside, not a bound.
    pub fn signed_distance(&self, p: Vec3) -> f64 {
        if let Some(distance) = self.face.as_ref().and_then(|face| face.signed_distance(p)) {
            return distance;
        }
        self.cones.iter().map(|cone| cone.signed_distance(p)).fold(f64::INFINITY, f64::min)
    }

    /// The interpolated sphere that attains the distance of `p`, and its weights over the three balls: non-negative, of
    /// sum 1.
    pub fn nearest_sphere(&self, p: Vec3) -> (Sphere, [f64; 3]) {
        if let Some(found) = self.face.as_ref().and_then(|face| face.best_sphere(p)) {
            return found;
        }
        let nearest = self.cones.map(|cone| cone.nearest_sphere(p));
        let distances = nearest.map(|(sphere, _)| sphere.signed_distance(p));
        let mut side = 0;
        for k in 1..3 {
            if distances[k] < distances[side] {
                side = k;
            }
        }
        let (sphere, of_side) = nearest[side];
        let mut weights = [0.0; 3];
        weights[side] = of_side[0];
        weights[(side + 1) % 3] = of_side[1];
        (sphere, weights)
    }

    /// The two planes tangent to all three balls from outside, or `None` when there are none:
    /// collinear centres, or radii that grow as fast as the centres move apart. Nearly collinear
    /// centres count as collinear: their planes would be made of rounding.
    pub fn planes(&self) -> Option<SlabPlanes> {
        self.face.as_ref().filter(|face| !face.is_thin()).map(SlabFace::planes)
    }
}

/// The part of a slab between its two tangent triangles, without the cones of its sides.
///
/// For callers that evaluate the cones anyway: the distance to the slab is the least of the distances
/// to the three cones and to this part, where it has one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlabFace {
    /// The plane of the centres.
    pub(crate) frame: PlanarFrame,
    /// Radius at the origin of the frame.
    pub(crate) radius: f64,
    /// `g` in the frame.
    pub(crate) gradient: [f64; 2],
    /// `1 / k`.
    pub(crate) lead: f64,
    /// The corner that is the origin of the frame.
    first: u8,
}

impl SlabFace {
    /// `None` when no two planes touch all three balls from outside: the slab is the union of its
    /// three cones.
    pub fn new(spheres: [Sphere; 3]) -> Option<Self> {
        let (frame, first) = PlanarFrame::new(spheres.map(|m| m.centre));
        if frame.is_flat() {
            return None;
        }
        let [a, b, c] = [0, 1, 2].map(|k| spheres[(first + k) % 3].radius);
        let [cx, cy] = frame.apex;
        let along = (b - a) / frame.length;
        // Fused, because for a thin triangle this is a small difference divided by a small height.
        let gradient = [along, (-along).mul_add(cx, c - a) / cy];
        let squared = gradient[0] * gradient[0] + gradient[1] * gradient[1];
        (squared < 1.0).then(|| Self {
            frame,
            radius: a,
            gradient,
            lead: 1.0 / (1.0 - squared).sqrt(),
            first: first as u8,
        })
    }

    /// Signed distance to the slab where its nearest sphere is inside the triangle; `None` where
    /// that sphere is on a side.
    #[inline]
    pub fn signed_distance(&self, p: Vec3) -> Option<f64> {
        let [x, y, distance] = self.best_centre(p)?;
        Some(distance - self.radius_at(x, y))
    }

    /// As [`SlabFace::signed_distance`], with the centre of the sphere that attains it.
    #[inline]
    pub fn nearest_centre(&self, p: Vec3) -> Option<(f64, Vec3)> {
        let [x, y, distance] = self.best_centre(p)?;
        Some((distance - self.radius_at(x, y), self.frame.point(x, y)))
    }

    /// Step 2: the best centre in the plane, and its distance from `p`, if inside the triangle.
    #[inline]
    fn best_centre(&self, p: Vec3) -> Option<[f64; 3]> {
        let [x, y, height] = self.frame.local(p);
        let ahead = height.abs() * self.lead;
        let [dx, dy] = [ahead * self.gradient[0], ahead * self.gradient[1]];
        let (x, y) = (x + dx, y + dy);
        let inside = self.frame.contains(x, y);
        inside.then(|| [x, y, (dx * dx + dy * dy + height * height).sqrt()])
    }

    #[inline]
    fn radius_at(&self, x: f64, y: f64) -> f64 {
        self.radius + self.gradient[0] * x + self.gradient[1] * y
    }

    /// The sphere that attains the distance, with its weights, if inside the triangle.
    fn best_sphere(&self, p: Vec3) -> Option<(Sphere, [f64; 3])> {
        let [x, y, _] = self.best_centre(p)?;
        let [cx, cy] = self.frame.apex;
        let third = (y / cy).min(1.0);
        let second = ((x - cx * third) / self.frame.length).clamp(0.0, 1.0 - third);
        let mut weights = [0.0; 3];
        for (k, weight) in [1.0 - second - third, second, third].into_iter().enumerate() {
            weights[(usize::from(self.first) + k) % 3] = weight;
        }
        let sphere = Sphere::new(self.frame.point(x, y), self.radius_at(x, y).max(0.0));
        Some((sphere, weights))
    }

    /// Whether the radius gradient across the triangle has fewer than about five correct digits.
    fn is_thin(&self) -> bool {
        self.frame.apex[1] <= MIN_RELATIVE_HEIGHT * (self.frame.length + self.radius)
    }

    pub(super) fn planes(&self) -> SlabPlanes {
        let [gx, gy] = self.gradient;
        SlabPlanes {
            centre_normal: self.frame.normal,
            gradient: gx * self.frame.x + gy * self.frame.y,
            rise: 1.0 / self.lead,
        }
    }
}

// Planes tangent to two or three balls from outside, as Q-MAT's slab quadrics need them.
//
// A plane with unit normal `n` touches the balls `(c_i, r_i)` from outside when `n . c_i + r_i`
// is the same for all of them.

/// The two planes tangent to the three balls of a slab, `n = -g +- k N`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlabPlanes {
    /// Unit normal `N` of the centres' plane, counter-clockwise around the centres in their order.
    pub centre_normal: Vec3,
    /// Gradient `g` of the radius in the centres' plane, shorter than 1.
    pub gradient: Vec3,
    /// `k = sqrt(1 - g.g)`, positive.
    pub rise: f64,
}

impl SlabPlanes {
    /// The planes of three spheres alone, without preparing the slab for distance queries.
    ///
    /// `None` when there are none: collinear centres, or radii that grow as fast as the centres
    /// move apart.
    pub fn new(spheres: [Sphere; 3]) -> Option<Self> {
        SlabFace::new(spheres).map(|face| face.planes())
    }

    /// Outward unit normals `-g + k N` and `-g - k N`. Ball `i` is touched at `c_i + r_i n`.
    pub fn normals(&self) -> [Vec3; 2] {
        let lift = self.rise * self.centre_normal;
        [lift - self.gradient, -lift - self.gradient]
    }
}

/// The frame of a cone: its tangent planes have the normals `-s u + sqrt(1 - s^2) w` for all unit
/// vectors `w` orthogonal to `u`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConeFrame {
    /// Unit axis, from the first centre to the second.
    pub u: Vec3,
    /// Slope of the radius along the axis, between -1 and 1.
    pub s: f64,
    /// Unit vector orthogonal to the axis.
    pub v: Vec3,
    /// Unit vector orthogonal to both.
    pub w: Vec3,
}

impl ConeFrame {
    pub(super) fn new(u: Vec3, s: f64) -> Self {
        let v = u.any_orthonormal_vector();
        Self { u, s, v, w: u.cross(v) }
    }

    /// The unit vector orthogonal to the axis in the direction of `towards`, or `None` when that is
    /// along the axis up to rounding.
    pub fn across(&self, towards: Vec3) -> Option<Vec3> {
        let rejected = towards.reject_from_normalized(self.u).try_normalize()?;
        // The remainder of a vector along the axis is rounding, and not orthogonal to the axis.
        let again = rejected.reject_from_normalized(self.u);
        let length = again.length();
        (length > 0.5).then(|| again / length)
    }

    /// Outward unit normal of the tangent plane in the direction `across`, a unit vector
    /// orthogonal to `u`.
    pub fn normal(&self, across: Vec3) -> Vec3 {
        ((1.0 - self.s) * (1.0 + self.s)).max(0.0).sqrt() * across - self.s * self.u
    }

    /// Four tangent planes a quarter turn apart. The sum of their quadrics does not depend on
    /// which four.
    pub fn normals(&self) -> [Vec3; 4] {
        [self.v, self.w, -self.v, -self.w].map(|across| self.normal(across))
    }
}

// The separation angle: how far apart points are, seen from a centre.

/// Pairs whose squared chord is at least this share of the longest may have the wider angle: near 180
/// degrees chords hardly change with the angle.
const NEARLY_LONGEST: f64 = 1.0 - 1e-12;

/// Largest angle between two of `points` seen from `centre`, in radians, from 0 to pi; 0 for fewer
/// than two. Points at the centre are in no direction and are left out. Cost `O(n^2)`.
///
/// For the points where a medial sphere touches the boundary this is the separation angle of
/// Foskey, Lin and Manocha 2003, doi:10.1115/1.1631582, `S = 2 arcsin(|p - q| / 2r)`; the object
/// angle of Stolpner and Siddiqi is half of it. Exact to rounding over the whole range, where the
/// arc sine loses half the digits near 180 degrees.
pub fn separation_angle(centre: Vec3, points: &[Vec3]) -> f64 {
    let directions: Vec<Vec3> =
        points.iter().filter_map(|&p| (p - centre).try_normalize()).collect();
    let (mut widest, mut longest) = (0.0_f64, 0.0_f64);
    for (i, &u) in directions.iter().enumerate() {
        for &v in &directions[i + 1..] {
            let squared = u.distance_squared(v);
            if squared < NEARLY_LONGEST * longest {
                continue;
            }
            longest = longest.max(squared);
            // Kahan: of two unit vectors, half the angle has the tangent |u - v| / |u + v|.
            widest = widest.max(2.0 * squared.sqrt().atan2((u + v).length()));
        }
    }
    widest
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn known_angles() {
        let centre = Vec3::new(0.3, -0.2, 0.7);
        let at = |degrees: f64, radius: f64| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            centre + radius * Vec3::new(cos, sin, 0.0)
        };
        for degrees in [0.0, 1e-6, 20.0, 90.0, 179.999_999, 180.0] {
            let angle = separation_angle(centre, &[at(0.0, 1.0), at(degrees, 2.0)]).to_degrees();
            assert!((angle - degrees).abs() < 1e-12, "{angle} for {degrees}");
        }
        // The widest of three pairs; a point at the centre takes no part.
        let fan = [at(0.0, 1.0), at(30.0, 1.0), centre, at(100.0, 1.0)];
        assert!((separation_angle(centre, &fan).to_degrees() - 100.0).abs() < 1e-12);
        assert_eq!(separation_angle(centre, &[]), 0.0);
        assert_eq!(separation_angle(centre, &[at(0.0, 1.0), centre]), 0.0);
    }

    proptest! {
        /// `S = 2 arcsin(|p - q| / 2r)` for points of one sphere, and no order or scale.
        #[test]
        fn agrees_with_the_chords_of_a_sphere(
            points in prop::collection::vec(prop::array::uniform3(-1.0..1.0f64), 2..9),
            radius in 0.01..10.0f64,
        ) {
            let centre = Vec3::new(0.1, 0.2, 0.3);
            let on_sphere: Vec<Vec3> = points
                .into_iter()
                .map(|p| centre + radius * Vec3::from(p).normalize_or(Vec3::X))
                .collect();
            let chords = on_sphere.iter().flat_map(|p| on_sphere.iter().map(|q| p.distance(*q)));
            let chord = chords.fold(0.0, f64::max);
            let expected = 2.0 * (chord / (2.0 * radius)).min(1.0).asin();
            let angle = separation_angle(centre, &on_sphere);
            prop_assert!((angle - expected).abs() < 1e-7, "{angle} for {expected}");
            let backwards: Vec<Vec3> = on_sphere.iter().rev().copied().collect();
            prop_assert!((separation_angle(centre, &backwards) - angle).abs() < 1e-14);
        }
    }
}
