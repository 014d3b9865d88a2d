//! Signed distance to the convex hull of three balls: the medial slab of a triangle.
//!
//! The hull is the union of the balls `B(c(a), r(a))` over the triangle, so the signed distance is
//! the minimum over the triangle of `|p - c(a)| - r(a)`: convex, hence either the unconstrained
//! minimum, if that lies in the triangle, or on a side, where it is the distance to a cone.
//!
//! 1. In the frame of the centres' plane ([`PlanarFrame`]) the query is `(x, y, h)`, and the
//!    radius is linear with gradient `g`.
//! 2. The best centre is `(x, y) + |h| / k g` with `k = sqrt(1 - g.g)`.
//! 3. Inside the triangle, the distance to its sphere is the answer; else the least of the cones.
//!
//! With collinear centres, or `g.g >= 1` (no plane touches all three balls from outside), the hull
//! is the union of the three cones, exactly.
//!
//! The distance is evaluated at the best centre, as in [`Cone`] and for the same reason.

use super::planar_frame::PlanarFrame;
use super::{Cone, HullFoot, SlabPlanes, Sphere};
use crate::Vec3;

/// Height of the centres' triangle, relative to its length and radius, below which its tangent planes
/// are mostly rounding. Distances stay exact, because the objective is flat there.
const MIN_RELATIVE_HEIGHT: f64 = 1e-10;

/// The convex hull of three balls, prepared for distance queries.
///
/// ```
/// use medial_geometry::{Slab, Sphere, Vec3};
///
/// // A triangular plate, 2 thick, with round edges, and queries above it and beside it.
/// let corners = [Vec3::ZERO, 8.0 * Vec3::X, Vec3::new(4.0, 4.0, 0.0)];
/// let plate = Slab::new(corners.map(|c| Sphere::new(c, 1.0)));
/// let above = Vec3::new(4.0, 2.0, 3.0);
/// assert_eq!(plate.signed_distance(above), 2.0);
/// assert_eq!(plate.signed_distance(Vec3::new(4.0, -3.0, 0.0)), 2.0);
/// assert_eq!(plate.signed_distance(Vec3::new(4.0, 2.0, 0.0)), -1.0);
/// let foot = plate.foot(above);
/// assert_eq!((foot.point, foot.weights), (Vec3::new(4.0, 2.0, 1.0), [0.25, 0.25, 0.5]));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slab {
    spheres: [Sphere; 3],
    face: Option<SlabFace>,
    /// Cones of the sides 01, 12, 20.
    cones: [Cone; 3],
}

impl Slab {
    /// The hull of three balls.
    pub fn new(spheres: [Sphere; 3]) -> Self {
        let cones = [0, 1, 2].map(|k| Cone::new(spheres[k], spheres[(k + 1) % 3]));
        Self { spheres, face: SlabFace::new(spheres), cones }
    }

    /// Signed distance of `p` to the boundary of the hull, negative inside: the true distance up to
    /// rounding, inside as well as outside, not a bound.
    pub fn signed_distance(&self, p: Vec3) -> f64 {
        if let Some(distance) = self.face.as_ref().and_then(|face| face.signed_distance(p)) {
            return distance;
        }
        self.cones.iter().map(|cone| cone.signed_distance(p)).fold(f64::INFINITY, f64::min)
    }

    /// Where `p` is nearest to the boundary of the hull. Of several nearest points one is returned.
    pub fn foot(&self, p: Vec3) -> HullFoot<3> {
        if let Some((sphere, weights)) = self.face.as_ref().and_then(|face| face.best_sphere(p)) {
            return HullFoot::towards(sphere, weights, p, || self.free_direction(sphere));
        }
        let feet = [0, 1, 2].map(|k| (k, self.cones[k].foot(p)));
        let nearer = |a: (usize, HullFoot<2>), b: (usize, HullFoot<2>)| {
            if b.1.signed_distance < a.1.signed_distance { b } else { a }
        };
        let (side, foot) = nearer(nearer(feet[0], feet[1]), feet[2]);
        let mut weights = [0.0; 3];
        weights[side] = foot.weights[0];
        weights[(side + 1) % 3] = foot.weights[1];
        HullFoot::towards(foot.sphere, weights, p, || self.free_direction(foot.sphere))
    }

    /// A direction in which `sphere`, centred on some side, touches the boundary of the hull. Of the
    /// tangent planes of the slab and some of each cone, the one beyond which the balls reach least.
    fn free_direction(&self, sphere: Sphere) -> Vec3 {
        let mut candidates: Vec<Vec3> = self.planes().map_or(vec![], |p| p.normals().to_vec());
        for (side, cone) in self.cones.iter().enumerate() {
            let away = sphere.centre - self.spheres[(side + 2) % 3].centre;
            match cone.frame() {
                Some(frame) => {
                    let across = frame.across(away).unwrap_or(frame.v);
                    let around = [across, frame.u.cross(across), -across];
                    candidates.extend(around.map(|across| frame.normal(across)));
                }
                None => candidates.push(away.try_normalize().unwrap_or(Vec3::X)),
            }
        }
        let overstep = |n: Vec3| {
            let reach = self.spheres.iter().map(|m| n.dot(m.centre - sphere.centre) + m.radius);
            reach.fold(f64::NEG_INFINITY, f64::max)
        };
        let best = candidates.iter().copied().min_by(|&a, &b| overstep(a).total_cmp(&overstep(b)));
        best.unwrap_or(Vec3::X)
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
    frame: PlanarFrame,
    /// Radius at the origin of the frame.
    radius: f64,
    /// `g` in the frame.
    gradient: [f64; 2],
    /// `1 / k`.
    lead: f64,
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

    /// The plane of the centres.
    pub(crate) fn frame(&self) -> &PlanarFrame {
        &self.frame
    }

    /// Radius at the origin of the frame.
    pub(crate) fn radius(&self) -> f64 {
        self.radius
    }

    /// `g` in the frame.
    pub(crate) fn gradient(&self) -> [f64; 2] {
        self.gradient
    }

    /// `1 / k`.
    pub(crate) fn lead(&self) -> f64 {
        self.lead
    }

    /// Signed distance to the slab where its nearest sphere is inside the triangle; `None` where
    /// that sphere is on a side.
    #[inline]
    pub fn signed_distance(&self, p: Vec3) -> Option<f64> {
        let [x, y, height] = self.frame.local(p);
        let ahead = height.abs() * self.lead;
        let [dx, dy] = [ahead * self.gradient[0], ahead * self.gradient[1]];
        let (x, y) = (x + dx, y + dy);
        if !self.frame.contains(x, y) {
            return None;
        }
        let distance = (dx * dx + dy * dy + height * height).sqrt();
        Some(distance - self.radius_at(x, y))
    }

    /// As [`SlabFace::signed_distance`], with the centre of the sphere that attains it.
    #[inline]
    pub fn nearest_centre(&self, p: Vec3) -> Option<(f64, Vec3)> {
        let [x, y, height] = self.frame.local(p);
        let ahead = height.abs() * self.lead;
        let [dx, dy] = [ahead * self.gradient[0], ahead * self.gradient[1]];
        let (x, y) = (x + dx, y + dy);
        if !self.frame.contains(x, y) {
            return None;
        }
        let distance = (dx * dx + dy * dy + height * height).sqrt();
        Some((distance - self.radius_at(x, y), self.frame.point(x, y)))
    }

    #[inline]
    fn radius_at(&self, x: f64, y: f64) -> f64 {
        self.radius + self.gradient[0] * x + self.gradient[1] * y
    }

    /// The sphere that attains the distance, with its weights, if inside the triangle.
    fn best_sphere(&self, p: Vec3) -> Option<(Sphere, [f64; 3])> {
        let [x, y, height] = self.frame.local(p);
        let ahead = height.abs() * self.lead;
        let (x, y) = (x + ahead * self.gradient[0], y + ahead * self.gradient[1]);
        if !self.frame.contains(x, y) {
            return None;
        }
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
