//! What a medial mesh is judged by: Hausdorff distances, triangle quality, spikes, topology.

mod axis_distance;
mod envelope;
mod evaluation;
mod hausdorff;
mod volume;

pub use axis_distance::{AxisOptions, axis_distance};
pub use envelope::{EnvelopeOptions, sample_envelope};
pub use evaluation::{
    AxisDistances, Counts, Distances, Evaluation, RatioSpikes, Spikes, TriangleQuality,
};
pub use hausdorff::{DistanceOptions, MetricError, distances};
pub use volume::{VolumeOptions, enclosed_volume, volume_error};
