//! The parameters of the scale axis transform.

use medial::simplifier::{ParamInfo, SimplifyError};
use serde::{Deserialize, Serialize};

use crate::within::within;

/// Parameters of the scale axis transform; the default is that of the authors' tool, without its
/// angle filter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SatParams {
    /// Factor of all radii, applied before anything else; a pure number.
    pub radius_factor: f64,
    /// How far a centre is moved at most along each axis, as a fraction of the radius.
    pub jitter: f64,
    /// Facets with a smaller object angle are removed from the outside in; degrees, 0 for none.
    pub sat_angle: f64,
    /// How a number of spheres is met.
    pub size: Size,
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

impl Default for SatParams {
    fn default() -> Self {
        Self { radius_factor: 1.002, jitter: 1e-4, sat_angle: 0.0, size: Size::Scale }
    }
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

    pub(super) fn describe() -> Vec<ParamInfo> {
        let defaults = Self::default();
        // Debug keeps the point of a whole number, and small numbers short.
        let info = |name: &'static str, default: f64, unit: &'static str, help: &'static str| {
            ParamInfo::new(name, format!("{default:?}"), unit, help)
        };
        vec![
            info(
                "radius_factor",
                defaults.radius_factor,
                "pure number",
                "all radii are multiplied by this before the scale, so that balls that touch in a \
                 sample overlap",
            ),
            info(
                "jitter",
                defaults.jitter,
                "fraction of the radius",
                "centres are moved by at most this along each axis, seeded",
            ),
            info(
                "sat_angle",
                defaults.sat_angle,
                "degrees of object angle, 0 for no filter",
                "facets below it are removed from the outside in; the authors' tool has 30",
            ),
            ParamInfo::new(
                "size",
                "scale",
                "scale or density",
                "meet a number of spheres by the scale, or by the number of samples at scale 1.1",
            ),
        ]
    }
}
