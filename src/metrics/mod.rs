//! Measures of a medial mesh: Hausdorff distances, triangle quality, spikes, topology.
//!
//! [`Judge`] runs them all; each can be computed alone.

mod ascent;
mod axis_distance;
mod certificate;
mod counts;
mod envelope;
mod evaluation;
mod hausdorff;
mod judge;
mod lifted_axis;
mod peaks;
mod pose;
mod protrusion;
mod quality;
mod samples;
mod spikes;
mod surface_distance;
mod topology;
mod union_topology;
mod volume;

pub use axis_distance::{AxisOptions, COVERED, axis_distance};
pub use certificate::{Certificate, FINEST, ROUNDING, Witness, WitnessSide, certify};
pub use counts::counts;
pub use envelope::{EnvelopeOptions, sample_envelope};
pub use evaluation::{
    AxisDistances, AxisSpan, Counts, Distances, Evaluation, RatioSpikes, SheetCoverage, Spikes,
    TriangleQuality,
};
pub use hausdorff::{DistanceOptions, MetricError, distances};
pub use judge::{Judge, JudgeOptions, Truth};
pub use peaks::{Peak, PeakSearch, Peaks};
pub use quality::triangle_quality;
pub use spikes::{FIN_ANGLE, IDLE_PROTRUSION, RATIO_THRESHOLDS, SPIKE_ANGLE, spikes};
pub use surface_distance::{SurfaceDistances, surface_distances};
pub use topology::topology_warning;
pub use union_topology::{cover_betti, union_betti};
pub use volume::{VolumeOptions, enclosed_volume, volume_error};
