//! Measures of a medial mesh: Hausdorff distances, triangle quality, spikes, topology.
//!
//! [`Judge`] runs them all; each can be computed alone.

mod ascent;
mod axis_distance;
mod certificate;
mod envelope;
mod hausdorff;
mod judge;
mod samples;
mod spikes;
mod sweep;
mod union_topology;
mod volume;

pub use ascent::{Peak, PeakSearch, Peaks};
pub use axis_distance::{AxisOptions, COVERED, axis_distance};
pub use certificate::{Certificate, FINEST, ROUNDING, Witness, WitnessSide, certify};
pub use envelope::{EnvelopeOptions, sample_envelope};
pub use hausdorff::{DistanceOptions, MetricError, distances};
pub use judge::{
    AxisDistances, AxisSpan, Counts, Distances, Evaluation, Judge, JudgeOptions, RatioSpikes,
    SheetCoverage, Spikes, TriangleQuality, Truth, counts, triangle_quality,
};
pub use spikes::{FIN_ANGLE, IDLE_PROTRUSION, RATIO_THRESHOLDS, SPIKE_ANGLE, spikes};
pub use union_topology::{topology_warning, union_betti};
pub use volume::{VolumeOptions, enclosed_volume, volume_error};
