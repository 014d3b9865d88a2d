//! Measures of a medial mesh: Hausdorff distances, triangle quality, spikes, topology.
//!
//! [`Judge`] runs them all; each can be computed alone.

/// Version of the definitions of all metrics. It grows by one with each change that moves a number of an
/// [`Evaluation`] by more than 1e-9: numbers of two versions do not compare. Editions hold theirs.
pub const DEFINITIONS: u32 = 2;

mod ascent;
mod axis_distance;
mod certificate;
mod cover;
mod depth;
mod envelope;
mod hausdorff;
mod judge;
mod pieces;
mod samples;
mod spikes;
mod structure;
mod sweep;
mod union_topology;
mod volume;

pub use ascent::{Peak, PeakSearch, Peaks};
pub use axis_distance::{AxisOptions, COVERED, axis_distance};
pub use certificate::{Certificate, FINEST, ROUNDING, Witness, WitnessSide, certify};
pub use cover::{CoverTest, OneSided, SMALLEST};
pub use envelope::{EnvelopeOptions, sample_envelope};
pub use hausdorff::{DistanceOptions, MetricError, distances};
pub use judge::{
    AxisDistances, AxisSpan, Counts, Cover, Distances, Evaluation, Judge, JudgeOptions, MeanAndP95,
    RatioSpikes, SheetCoverage, Spikes, TriangleQuality, Truth, counts, triangle_quality,
};
pub use spikes::{FIN_ANGLE, IDLE_PROTRUSION, RATIO_THRESHOLDS, SPIKE_ANGLE, spikes};
pub use structure::{
    CONTACT, Centrality, Completeness, ContactTable, ContactType, Features, GraphSizes, Outside,
    REACHED, SHARP_ANGLE, SheetDifference, SheetPair, Structure, StructureSurface,
    sheet_difference,
};
pub use union_topology::{topology_warning, union_betti};
pub use volume::{VolumeOptions, enclosed_volume, volume_error};
