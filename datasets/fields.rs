//! Implicit functions: negative inside, with their gradients.

use medial::Vec3;

/// A function whose zero set is a smooth closed surface.
pub(crate) trait Field {
    /// Value and gradient at a point.
    fn at(&self, p: Vec3) -> (f64, Vec3);
}

/// A part of a blended shape, by its exact signed distance.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Part {
    /// All points within `radius` of the segment `ab`.
    Tube { a: Vec3, b: Vec3, radius: f64 },
    /// A torus in a plane `z = const`.
    Torus { centre: Vec3, major: f64, minor: f64 },
}

impl Part {
    fn distance(&self, p: Vec3) -> (f64, Vec3) {
        match *self {
            Self::Tube { a, b, radius } => {
                let t = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
                let from_axis = p - a.lerp(b, t);
                (from_axis.length() - radius, from_axis.normalize_or_zero())
            }
            Self::Torus { centre, major, minor } => {
                let q = p - centre;
                let radial = Vec3::new(q.x, q.y, 0.0).normalize_or_zero();
                let from_axis = q - radial * major;
                (from_axis.length() - minor, from_axis.normalize_or_zero())
            }
        }
    }
}

/// The union of parts with smooth seams: `f = -log(sum exp(-k d_i)) / k`.
///
/// The gradient is a weighted mean of unit vectors, so `|f(p) - f(q)| <= |p - q|`. The union is
/// the plain one where a single part is near, and thicker by up to `log(n) / k` where `n` meet.
#[derive(Clone, Debug)]
pub(crate) struct Blend {
    pub(crate) parts: Vec<Part>,
    /// The sharpness `k`, an inverse length.
    pub(crate) sharpness: f64,
}

impl Field for Blend {
    fn at(&self, p: Vec3) -> (f64, Vec3) {
        let distances: Vec<(f64, Vec3)> = self.parts.iter().map(|part| part.distance(p)).collect();
        let nearest = distances.iter().map(|d| d.0).fold(f64::INFINITY, f64::min);
        let (mut sum, mut gradient) = (0.0, Vec3::ZERO);
        for (distance, direction) in distances {
            // Relative to the nearest part, so that nothing overflows or vanishes altogether.
            let weight = (-self.sharpness * (distance - nearest)).exp();
            sum += weight;
            gradient += direction * weight;
        }
        (nearest - sum.ln() / self.sharpness, gradient / sum)
    }
}

/// The ellipsoid with these semi-axes: `|p / s|^2 - 1`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ellipsoid(pub(crate) Vec3);

impl Field for Ellipsoid {
    fn at(&self, p: Vec3) -> (f64, Vec3) {
        let scaled = p / self.0;
        (scaled.length_squared() - 1.0, 2.0 * scaled / self.0)
    }
}

/// The point of the surface reached from a point near it, by Newton steps along the gradient.
pub(crate) fn project(field: &impl Field, mut p: Vec3) -> Vec3 {
    const STEPS: usize = 40;
    let (mut value, mut gradient) = field.at(p);
    for _ in 0..STEPS {
        let next = p - gradient * (value / gradient.length_squared());
        let (next_value, next_gradient) = field.at(next);
        // Steps end where rounding does: when the value no longer falls.
        if next_value.is_nan() || next_value.abs() >= value.abs() {
            break;
        }
        (p, value, gradient) = (next, next_value, next_gradient);
    }
    p
}
