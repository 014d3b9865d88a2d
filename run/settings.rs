//! The settings of a run: all that decides a result and its measurements, except input, method and level.

use medial::complex::DualTriangulation;
use medial::metrics::JudgeOptions;
use medial::shape::ShapeOptions;
use medial::surface::Sampling;
use serde::{Deserialize, Serialize};

/// Depth of the octree for the volume difference in a comparison.
pub const VOLUME_DEPTH: u32 = 5;

/// How inputs are prepared and results measured.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Boundary samples.
    pub sampling: Sampling,
    /// Triangulation of the dual Voronoi polygons.
    pub dual: DualTriangulation,
    /// Surface samples of the evaluation in addition to the vertices, and about as many on the union.
    pub samples: usize,
    /// Depth of the octree for the volume difference; 0 leaves it out.
    pub volume_depth: u32,
    /// Seed of every sample of the evaluation.
    pub seed: u64,
    /// Width of the certified interval of the Hausdorff distance, a fraction of the diagonal; `None`
    /// for no certificate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub certify: Option<f64>,
    /// Whether edges and faces are dropped before the evaluation.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub spheres_alone: bool,
    /// Number of threads.
    pub threads: usize,
}

impl Settings {
    /// The options of the substrates.
    pub fn shape_options(&self) -> ShapeOptions {
        ShapeOptions { sampling: self.sampling, dual: self.dual }
    }

    /// The options of the judge.
    pub fn judge_options(&self) -> JudgeOptions {
        let Self { samples, volume_depth, seed, .. } = *self;
        JudgeOptions { samples, volume_depth, seed }
    }
}
