//! What a medial mesh is judged by: Hausdorff distances, triangle quality, spikes, topology.

mod counts;
mod evaluation;
mod quality;
mod spikes;

pub use counts::counts;
pub use evaluation::{
    AxisDistances, Counts, Distances, Evaluation, RatioSpikes, Spikes, TriangleQuality,
};
pub use quality::triangle_quality;
pub use spikes::{FIN_ANGLE, IDLE_PROTRUSION, RATIO_THRESHOLDS, SPIKE_ANGLE, spikes};
