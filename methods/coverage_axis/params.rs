//! The parameters of Coverage Axis and Coverage Axis++.

use std::ops::RangeInclusive;

use medial::simplifier::SimplifyError;
use serde::{Deserialize, Serialize};

use crate::within::within;

medial::parameters! {
    /// Parameters of Coverage Axis and Coverage Axis++; the defaults are those of the scripts of
    /// Coverage Axis++ for meshes.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct CoverageAxisParams {
        /// Choose by score, as Coverage Axis++, or a smallest cover by branch and bound, as Coverage
        /// Axis.
        select: Select = Select::Greedy, "greedy or exact";
        /// The candidates: all inner Voronoi vertices, the inner poles, or random inner points.
        candidates: Candidates = Candidates::Voronoi, "voronoi, poles or random";
        /// `delta`, by which balls are inflated before they cover, where no native level is requested.
        dilation: f64 = 0.02, "fraction of the longest side";
        /// Area-uniform samples to be covered; the script of Coverage Axis has 2000.
        samples: usize = 1500, "samples";
        /// Points drawn in the bounding box for candidates=random, of which those inside are kept.
        points: usize = 500_000, "points";
        /// `omega_u`, weight of the distance to the nearest chosen sphere.
        uniformity: f64 = 1.0, "pure number";
        /// `omega_c`, weight of the penalty of small radii.
        centrality: f64 = 1.0, "pure number";
        /// Penalty of small radii: 0.1 max r / r, as the scripts call it, or 1 / r standardised.
        penalty: Penalty = Penalty::Ratio, "ratio or stand";
        /// Most spheres chosen where no number is requested; the scripts have 100, as the published
        /// level.
        max_iter: usize = 1000, "spheres";
        /// Meet a number of spheres by the first ones chosen, or by a search on the dilation.
        size: Size = Size::Picks, "picks or dilation";
        /// Connect by geodesic regions on the initial medial mesh, or by collapses that spare the
        /// chosen spheres.
        connection: Connection = Connection::Geodesic, "geodesic or qmat";
        /// Limit of branch and bound for select=exact; results that it ends are repeatable.
        nodes: usize = 10_000, "nodes";
        /// Limit of branch and bound for select=exact; results that it ends need not be repeatable.
        time_limit: f64 = 240.0, "seconds, 0 for none";
    }
}

/// How spheres are chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Select {
    /// One after the other by score: Coverage Axis++.
    Greedy,
    /// A smallest set that covers: Coverage Axis.
    Exact,
}

/// The spheres among which some are chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Candidates {
    /// The spheres of the initial medial mesh: all inner Voronoi vertices.
    Voronoi,
    /// The inner polar balls of the samples of the shape.
    Poles,
    /// Random points inside, with their distance to the surface.
    Random,
}

/// The penalty of small radii.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Penalty {
    /// `0.1 max r / r`: `penalty=''` in the authors' function, as all their scripts call it.
    Ratio,
    /// `1 / r`, standardised: `penalty='stand'`, the default of their function.
    Stand,
}

/// How a number of spheres is met.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Size {
    /// The first spheres that the greedy choice takes; the exact choice has no order, and searches on
    /// the dilation.
    Picks,
    /// A search on the dilation, until so many cover everything.
    Dilation,
}

/// How the spheres chosen are connected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Connection {
    /// By geodesic Voronoi regions on the initial medial mesh.
    Geodesic,
    /// By Q-MAT's collapses of the initial medial mesh, which spare the spheres chosen.
    Qmat,
}

/// Dilations that mean something, in longest sides.
pub(super) const DILATIONS: RangeInclusive<f64> = 1e-4..=1.0;

impl CoverageAxisParams {
    pub(super) fn validate(self) -> Result<Self, SimplifyError> {
        within("dilation", self.dilation, DILATIONS)?;
        within("uniformity", self.uniformity, 0.0..=1e6)?;
        within("centrality", self.centrality, 0.0..=1e6)?;
        within("time_limit", self.time_limit, 0.0..=1e6)?;
        // A row of bits for each candidate: as many samples as memory bears for a large shape.
        within("samples", self.samples as f64, 1.0..=100_000.0)?;
        within("points", self.points as f64, 1.0..=10_000_000.0)?;
        within("max_iter", self.max_iter as f64, 1.0..=1e9)?;
        within("nodes", self.nodes as f64, 1.0..=1e9)?;
        Ok(self)
    }
}
