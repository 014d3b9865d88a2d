//! Numbers by the definitions of other papers, under the names that they have there.
//!
//! They are for comparison with published tables and with nothing else: each depends on something that the measures
//! of this crate do not, such as the vertices of a mesh or the densest samples of a skeleton. So they are no part of
//! an [`Evaluation`](super::Evaluation). `docs/other-metrics.md` says how they differ. Lengths are in the unit of
//! what is measured; all but triangle quality scale with it.

mod coverage_axis;
mod matstruct;
mod point2skeleton;

pub use coverage_axis::{VertexDistances, ca_vertex_distances};
pub use matstruct::{
    DEGENERATE, StructureQuality, matstruct_bad_share, matstruct_face_quality, matstruct_quality,
};
pub use point2skeleton::{TwoSided, p2s_mat, p2s_recon, p2s_sample_skeleton};

use serde::Serialize;

use crate::Vec3;
use crate::geometry::trees::PointTree;

/// Largest and mean of a set of distances.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
struct Spread {
    max: f64,
    mean: f64,
}

impl Spread {
    /// In the order of the distances, so that the sum is the same every time; `None` without any.
    fn of(distances: &[f64]) -> Option<Self> {
        let max = distances.iter().copied().fold(0.0, f64::max);
        let mean = distances.iter().sum::<f64>() / distances.len() as f64;
        (!distances.is_empty()).then_some(Self { max, mean })
    }
}

/// Index and distance of the point nearest to each query; `None` where there is none.
fn nearest(points: &[Vec3], queries: impl Iterator<Item = Vec3>) -> Option<Vec<(usize, f64)>> {
    let tree = PointTree::new(points);
    queries.map(|q| tree.nearest(q).map(|(id, square)| (id as usize, square.sqrt()))).collect()
}
