//! The parameters of the average outward flux.

use medial::simplifier::SimplifyError;
use serde::{Deserialize, Serialize};

use super::spiral::Spiral;

/// Most voxels along a side of the bounding box: places have 16 bits.
pub(super) const MAX_RESOLUTION: u32 = 60_000;
/// Most voxels along the longest side of a coarse voxel.
const MAX_SPLIT: u32 = 1024;

/// Parameters at one level; see [`AofSettings`](super::AofSettings) for what is set.
/// The default is that of every level but the published one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AofParams {
    /// Voxels along the longest side of the bounding box, at the finest level.
    pub resolution: u32,
    /// `d`: each voxel is split into `d^3`.
    pub d: u32,
    /// Number of levels, the finest included.
    pub levels: u32,
    /// `N`: samples on each sphere, from the coarsest level to the finest, separated by `/`, or one
    /// number for all levels.
    #[serde(deserialize_with = "number_or_text")]
    pub samples: String,
    /// `alpha`: object angle in degrees of the thinnest sheets that are kept.
    pub angle: f64,
    /// `mu` of the final threshold `-mu sin alpha`; 0 for 1/8 where voxels are kept by the
    /// threshold, and 3/8 where only end points are.
    pub mu: f64,
    /// The use of the flux.
    pub variant: Variant,
    /// How the samples lie on the sphere.
    pub spiral: Spiral,
    /// The start set of voxels.
    pub start: Start,
    /// From which flux on a coarse voxel is dismissed.
    pub dismiss: Dismiss,
    /// Whether centres are moved from the voxel's onto the axis.
    pub refine: bool,
    /// Limit of the memory for voxels and the medial mesh, in megabytes.
    pub max_memory: f64,
}

/// The use of the flux.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Variant {
    /// All voxels with a flux at or below the threshold.
    Plain,
    /// Voxels above the threshold are deleted where they are simple, outermost first.
    Homotopy,
    /// Simple voxels are deleted by flux, the least medial first, except for end points below the
    /// threshold (Siddiqi, Bouix, Tannenbaum, Zucker 2002).
    Thinning,
}

/// The start set of voxels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Start {
    /// Voxels of the finest level whose spheres lie inside. Coarser ones that do not are split.
    Fine,
    /// Voxels of the coarsest level whose spheres lie inside, as in the paper.
    Coarse,
}

/// From which flux on a coarse voxel is dismissed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Dismiss {
    /// `AOF' >= 0`, as in the paper.
    Zero,
    /// Where `AOF'` is not below minus the flux that the samples have in a constant field.
    Bias,
}

impl Default for AofParams {
    fn default() -> Self {
        Self {
            resolution: 54,
            d: 3,
            levels: 3,
            samples: "70/60/50".to_owned(),
            angle: 30.0,
            mu: 0.0,
            variant: Variant::Thinning,
            spiral: Spiral::EqualArea,
            start: Start::Fine,
            dismiss: Dismiss::Bias,
            refine: true,
            max_memory: 2000.0,
        }
    }
}

impl AofParams {
    /// The parameters if they are in their ranges.
    pub(super) fn validate(self) -> Result<Self, SimplifyError> {
        let refuse = |message: String| Err(SimplifyError::Parameter(message));
        if !(1..=MAX_RESOLUTION).contains(&self.resolution) {
            return refuse(format!(
                "resolution = {}: give 1 to {MAX_RESOLUTION} voxels along the longest side",
                self.resolution
            ));
        }
        if self.levels == 0 || (self.levels > 1 && self.d < 2) {
            return refuse(format!(
                "levels = {}, d = {}: give at least one level, and 2 or more for d",
                self.levels, self.d
            ));
        }
        let split = self.d.checked_pow(self.levels - 1).filter(|&split| split <= MAX_SPLIT);
        if split.is_none() {
            return refuse(format!(
                "levels = {}, d = {}: d^(levels - 1) is above {MAX_SPLIT}; give fewer levels",
                self.levels, self.d
            ));
        }
        check_angle(self.angle).map_err(SimplifyError::Parameter)?;
        if !(self.mu >= 0.0 && self.mu <= 0.75) {
            return refuse(format!(
                "mu = {:?}: give a number in [0, 0.75], such as 0.125",
                self.mu
            ));
        }
        if !(self.max_memory > 0.0 && self.max_memory.is_finite()) {
            return refuse(format!("max_memory = {:?}: give megabytes, above 0", self.max_memory));
        }
        self.sample_counts()?;
        Ok(self)
    }

    /// Samples of each level, from coarse to fine.
    pub(super) fn sample_counts(&self) -> Result<Vec<usize>, SimplifyError> {
        let refuse = || {
            SimplifyError::Parameter(format!(
                "samples = {}: give 8 to 10000 for each level, such as 70/60/50",
                self.samples
            ))
        };
        let counts: Option<Vec<usize>> =
            self.samples.split('/').map(|word| word.trim().parse().ok()).collect();
        let mut counts = counts.ok_or_else(refuse)?;
        let levels = self.levels as usize;
        // The default is made for its own number of levels; of fewer, the coarse ones are left out.
        if self.samples == Self::default().samples {
            counts.drain(..counts.len().saturating_sub(levels));
        } else if counts.len() != 1 && counts.len() != levels {
            return Err(SimplifyError::Parameter(format!(
                "samples = {}: {} numbers for {levels} levels; give one for each, from coarse to \
                 fine, or one for all",
                self.samples,
                counts.len()
            )));
        }
        let last = *counts.last().ok_or_else(refuse)?;
        counts.resize(levels, last);
        if counts.iter().any(|count| !(8..=10_000).contains(count)) {
            return Err(refuse());
        }
        Ok(counts)
    }

    /// Flux at or below which a voxel is kept for an object angle in degrees.
    pub(super) fn threshold(&self, angle: f64) -> f32 {
        let mu = match self.variant {
            _ if self.mu > 0.0 => self.mu,
            Variant::Plain | Variant::Homotopy => 0.125,
            Variant::Thinning => 0.375,
        };
        (-mu * angle.to_radians().sin()) as f32
    }
}

/// One number of samples for all levels may be given as a number.
pub(super) fn number_or_text<'de, D: serde::Deserializer<'de>>(
    from: D,
) -> Result<String, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged, expecting = "expected 8 to 10000 for each level, such as 70/60/50")]
    enum Given {
        Number(u64),
        Text(String),
    }
    Ok(match Given::deserialize(from)? {
        Given::Number(number) => number.to_string(),
        Given::Text(text) => text,
    })
}

/// An object angle is above 0 and at most a right angle.
pub(super) fn check_angle(angle: f64) -> Result<(), String> {
    if angle > 0.0 && angle <= 90.0 {
        return Ok(());
    }
    Err(format!("angle = {angle:?}: an object angle is above 0 and at most 90 degrees"))
}
