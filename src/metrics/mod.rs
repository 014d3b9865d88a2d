//! Measures of a medial mesh: Hausdorff distances, triangle quality, spikes, topology.
//!
//! [`Judge`] runs them all; each can be computed alone.

/// Version of the definitions of all metrics. It grows by one with each change that moves a number of an
/// [`Evaluation`] by more than 1e-9: numbers of two versions do not compare. Editions hold theirs.
pub const DEFINITIONS: u32 = 2;

mod ascent;
mod axis_distance;
mod bounds;
mod certificate;
mod cover;
mod depth;
mod envelope;
mod error;
mod evaluation;
mod hausdorff;
mod judge;
mod peaks;
mod pieces;
mod quality;
mod samples;
mod spikes;
mod structure;
mod sweep;
mod union_topology;
mod volume;

pub use ascent::Peak;
pub use bounds::{FINEST, ROUNDING};
pub use certificate::certify;
pub use cover::{CoverTest, SMALLEST};
pub use envelope::{EnvelopeOptions, sample_envelope};
pub use error::MetricError;
pub use evaluation::{
    AxisDistances, Centrality, Certificate, Completeness, ContactTable, ContactType, Counts, Cover,
    Distances, Evaluation, Features, GraphSizes, MeanAndP95, OneSided, Outside, RatioSpikes,
    SheetDifference, Spikes, Structure, TriangleQuality, Witness, WitnessSide,
};
pub use judge::{Judge, JudgeOptions, Truth};
pub use peaks::{DistanceOptions, PeakSearch, Peaks};
pub use quality::{counts, triangle_quality};
pub(crate) use samples::place_on_triangles;
pub use spikes::{FIN_ANGLE, IDLE_PROTRUSION, RATIO_THRESHOLDS, SPIKE_ANGLE, spikes};
pub use structure::{CONTACT, REACHED, SHARP_ANGLE, StructureSurface};
pub use union_topology::{topology_warning, union_betti};
pub use volume::enclosed_volume;
