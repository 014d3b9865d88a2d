//! What a medial mesh is judged by: Hausdorff distances, triangle quality, spikes, topology.

mod evaluation;

pub use evaluation::{
    AxisDistances, Counts, Distances, Evaluation, RatioSpikes, Spikes, TriangleQuality,
};
