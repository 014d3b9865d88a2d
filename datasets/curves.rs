//! Tubes about curves.

use medial::Vec3;
use medial::surface::TriMesh;

use crate::geodesic::mapped;
use crate::shapes::capsule_of;

/// A smooth curve, by its place and derivative at a parameter.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Curve {
    pub(crate) start: f64,
    pub(crate) end: f64,
    pub(crate) place: fn(f64) -> Vec3,
    pub(crate) derivative: fn(f64) -> Vec3,
}

/// Steps in which arc length is summed. Vertices lie on the tube whatever its error: it decides only how even
/// the sections are.
const LENGTH_STEPS: u32 = 4000;

impl Curve {
    fn parameter(&self, step: f64) -> f64 {
        let t = step / f64::from(LENGTH_STEPS);
        self.start * (1.0 - t) + self.end * t
    }

    /// Arc length from the start to each step, by the midpoint rule.
    fn lengths(&self) -> Vec<f64> {
        let width = (self.end - self.start) / f64::from(LENGTH_STEPS);
        let mut sum = 0.0;
        let mut lengths = vec![0.0];
        for step in 0..LENGTH_STEPS {
            sum += width * (self.derivative)(self.parameter(f64::from(step) + 0.5)).length();
            lengths.push(sum);
        }
        lengths
    }

    /// The points within `radius` of the curve: a capsule bent along it. Sections stay in the planes normal to
    /// the curve, turned so that one of their axes is normal to z.
    ///
    /// The curve is nowhere parallel to z; else its sections would have no such axis.
    pub(crate) fn tube(&self, radius: f64, edge: f64) -> TriMesh {
        let lengths = self.lengths();
        let half = lengths[lengths.len() - 1] / 2.0;
        mapped(capsule_of(half, radius, edge), |p| {
            let along = p.z.clamp(-half, half);
            let at = self.at_length(&lengths, along + half);
            let tangent = (self.derivative)(at).normalize();
            let level = tangent.cross(Vec3::Z).normalize();
            let rest = tangent.cross(level);
            (self.place)(at) + tangent * (p.z - along) + level * p.x + rest * p.y
        })
    }

    /// The parameter at an arc length.
    fn at_length(&self, lengths: &[f64], length: f64) -> f64 {
        let after = lengths.partition_point(|&l| l <= length).clamp(1, lengths.len() - 1);
        let (low, high) = (lengths[after - 1], lengths[after]);
        let part = ((length - low) / (high - low)).clamp(0.0, 1.0);
        self.parameter(after as f64 - 1.0 + part)
    }
}
