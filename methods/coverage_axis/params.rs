//! The parameters of Coverage Axis and Coverage Axis++.

use std::ops::RangeInclusive;

use medial::simplifier::{ParamInfo, SimplifyError};
use serde::{Deserialize, Serialize};

use crate::within::within;

/// Parameters of Coverage Axis and Coverage Axis++; the defaults are those of the scripts of
/// Coverage Axis++ for meshes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CoverageAxisParams {
    /// How spheres are chosen.
    pub select: Select,
    /// The spheres among which they are chosen.
    pub candidates: Candidates,
    /// How much a ball is inflated before it covers, `delta`; a fraction of the longest side.
    pub dilation: f64,
    /// Area-uniform samples of the surface, which are to be covered.
    pub samples: usize,
    /// Points drawn in the bounding box for `candidates=random`; those inside are candidates.
    pub points: usize,
    /// Weight of the distance to the nearest sphere chosen, `omega_u`.
    pub uniformity: f64,
    /// Weight of the penalty of small radii, `omega_c`.
    pub centrality: f64,
    /// The penalty of small radii.
    pub penalty: Penalty,
    /// Spheres that are chosen at most where no number is asked for.
    pub max_iter: usize,
    /// How a number of spheres is met.
    pub size: Size,
    /// How the spheres chosen are connected.
    pub connection: Connection,
    /// Nodes of branch and bound, for `select=exact`.
    pub nodes: usize,
    /// Seconds of branch and bound, for `select=exact`; 0 for no limit.
    pub time_limit: f64,
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

impl Default for CoverageAxisParams {
    fn default() -> Self {
        Self {
            select: Select::Greedy,
            candidates: Candidates::Voronoi,
            dilation: 0.02,
            samples: 1500,
            points: 500_000,
            uniformity: 1.0,
            centrality: 1.0,
            penalty: Penalty::Ratio,
            max_iter: 1000,
            size: Size::Picks,
            connection: Connection::Geodesic,
            nodes: 10_000,
            time_limit: 240.0,
        }
    }
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

    pub(super) fn describe() -> Vec<ParamInfo> {
        let defaults = Self::default();
        let side = "fraction of the longest side";
        vec![
            ParamInfo::new(
                "select",
                "greedy",
                "greedy or exact",
                "by score, as Coverage Axis++, or a smallest cover by branch and bound, as Coverage Axis",
            ),
            ParamInfo::new(
                "candidates",
                "voronoi",
                "voronoi, poles or random",
                "what is chosen from: all inner Voronoi vertices, the inner poles, or random inner points",
            ),
            ParamInfo::new(
                "dilation",
                defaults.dilation,
                side,
                "how much balls are inflated before they cover, where no native level is asked",
            ),
            ParamInfo::new(
                "samples",
                defaults.samples,
                "samples",
                "area-uniform samples that are to be covered; the script of Coverage Axis has 2000",
            ),
            ParamInfo::new(
                "points",
                defaults.points,
                "points",
                "drawn in the bounding box for candidates=random, of which those inside are kept",
            ),
            ParamInfo::new(
                "uniformity",
                format!("{:?}", defaults.uniformity),
                "pure number",
                "weight of the distance to the nearest sphere chosen",
            ),
            ParamInfo::new(
                "centrality",
                format!("{:?}", defaults.centrality),
                "pure number",
                "weight of the penalty of small radii",
            ),
            ParamInfo::new(
                "penalty",
                "ratio",
                "ratio or stand",
                "of small radii: 0.1 max r / r, as the scripts call it, or 1 / r standardised",
            ),
            ParamInfo::new(
                "max_iter",
                defaults.max_iter,
                "spheres",
                "chosen at most where no number is asked; the scripts have 100, as the published level",
            ),
            ParamInfo::new(
                "size",
                "picks",
                "picks or dilation",
                "meet a number of spheres by the first ones chosen, or by a search on the dilation",
            ),
            ParamInfo::new(
                "connection",
                "geodesic",
                "geodesic or qmat",
                "by geodesic regions on the initial medial mesh, or by collapses that spare the chosen",
            ),
            ParamInfo::new(
                "nodes",
                defaults.nodes,
                "nodes",
                "limit of branch and bound for select=exact; results that it ends repeat",
            ),
            ParamInfo::new(
                "time_limit",
                format!("{:?}", defaults.time_limit),
                "seconds, 0 for none",
                "limit of branch and bound for select=exact; results that it ends need not repeat",
            ),
        ]
    }
}
