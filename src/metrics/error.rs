//! Reasons why a medial mesh is not measured.

use crate::complex::UnionError;
use crate::geometry::TriangulationError;
use crate::surface::BvhError;

/// Reason why a medial mesh is not measured.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the messages name the fields")]
pub enum MetricError {
    /// The medial mesh has no union.
    #[error(transparent)]
    Union(#[from] UnionError),
    /// The axis or surface to measure against has no tree.
    #[error(transparent)]
    Tree(BvhError),
    /// The surface has no area that could be sampled.
    #[error("the surface has no finite area to sample")]
    NoArea,
    /// The surface has no volume that could be compared with.
    #[error("the surface encloses no volume (signed volume {0}); it must be closed and oriented")]
    NoVolume(f64),
    /// No samples were requested.
    #[error("{0}: too few samples (found 0, expected at least 1)")]
    NoSamples(&'static str),
    /// Balls on the primitives need a distance between them.
    #[error("spacing {0}: not positive")]
    Spacing(f64),
    /// The balls on the primitives would not fit into memory.
    #[error("{count:.0} balls: too many (expected at most {most}); choose a wider spacing")]
    TooManyBalls { count: f64, most: usize },
    /// An interval that cannot be certified.
    #[error(
        "tolerance {0}: cannot be certified (expected a fraction of the diagonal between 1e-6 and 1)"
    )]
    Tolerance(f64),
    /// Spheres whose rounding no certificate covers.
    #[error(
        "spheres reach {reach:.1e} diagonals: too far for a certificate (expected at most {most:.0e}); remove them, or \
         measure without one"
    )]
    TooLarge { reach: f64, most: f64 },
    /// The certificate would not fit into memory.
    #[error("tolerance {tolerance:.1e}: needs {pieces} pieces and more; choose a larger one")]
    TooFine { tolerance: f64, pieces: usize },
    /// The balls on the primitives cannot be triangulated.
    #[error(transparent)]
    Triangulation(#[from] TriangulationError),
}
