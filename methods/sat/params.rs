//! The parameters of the scale axis transform.

use medial::simplifier::SimplifyError;
use serde::{Deserialize, Serialize};

use crate::within::within;

medial::parameters! {
    /// Parameters of the scale axis transform; the default is that of the authors' tool, without its
    /// angle filter.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct SatParams {
        /// Factor of all radii before the scale, so that balls that touch in a sample overlap.
        radius_factor: f64 = 1.002, "pure number";
        /// Largest seeded displacement of a centre along each axis.
        jitter: f64 = 1e-4, "fraction of the radius";
        /// Facets below it are removed from the outside in; the authors' tool has 30.
        sat_angle: f64 = 0.0, "degrees of object angle, 0 for no filter";
        /// Meet a number of spheres by the scale, or by the number of samples at scale 1.1.
        size: Size = Size::Scale, "scale or density";
    }
}

/// How a number of spheres is met.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Size {
    /// The scale, the samples as they are.
    Scale,
    /// The number of samples, at the published scale.
    Density,
}

impl SatParams {
    pub(super) fn validate(self) -> Result<Self, SimplifyError> {
        let ranges = [
            ("radius_factor", self.radius_factor, 0.5..=2.0),
            ("jitter", self.jitter, 0.0..=0.1),
            ("sat_angle", self.sat_angle, 0.0..=90.0),
        ];
        for (name, value, range) in ranges {
            within(name, value, range)?;
        }
        Ok(self)
    }
}
