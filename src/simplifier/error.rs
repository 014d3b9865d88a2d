//! Why a method gave no result.

use crate::complex::ComplexError;
use crate::shape::ShapeError;

/// Why a method gave no result.
#[derive(Debug, thiserror::Error)]
pub enum SimplifyError {
    /// The method does not do this: an answer, not a failure.
    #[error("unsupported: {why}")]
    Unsupported {
        /// What it does not do, and what it does instead.
        why: String,
    },
    /// A parameter is unknown, of the wrong type or out of range.
    #[error("parameter: {0}")]
    Parameter(String),
    /// A level is out of range.
    #[error("level: {0}")]
    Level(String),
    /// A substrate could not be built for this shape.
    #[error(transparent)]
    Shape(#[from] ShapeError),
    /// The method returned something that is no valid complex.
    #[error("invalid output: {0}")]
    InvalidOutput(String),
    /// A hierarchy cannot be built, or is not one of the method that was asked to go on from it.
    #[error("hierarchy: {0}")]
    Hierarchy(String),
    /// The method could not do it, and says why in its own words.
    #[error("failed: {0}")]
    Failed(String),
    /// The method's program was ended by a signal.
    #[error("crashed: {0}")]
    Crashed(String),
    /// The run was cancelled.
    #[error("cancelled")]
    Cancelled,
}

impl SimplifyError {
    /// For a level by error bound, of methods without such levels: a harness searches for it.
    pub fn searched() -> Self {
        Self::unsupported(
            "an error bound is searched for among other levels; ask for spheres or a level",
        )
    }

    /// [`SimplifyError::Unsupported`] with what the method does not do, and what it does instead.
    pub fn unsupported(why: impl Into<String>) -> Self {
        Self::Unsupported { why: why.into() }
    }
}

impl From<ComplexError> for SimplifyError {
    fn from(error: ComplexError) -> Self {
        Self::InvalidOutput(error.to_string())
    }
}
