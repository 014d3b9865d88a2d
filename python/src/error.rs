//! Errors of the library as exceptions of the package, with the same sentences.

use medial::complex::{ComplexError, ContourError, MaError, UnionError};
use medial::geometry::triangulation::TriangulationError;
use medial::metrics::MetricError;
use medial::shape::ShapeError;
use medial::simplifier::SimplifyError;
use medial::surface::{BvhError, SurfaceError};
use medial_bench::run::{Fault, InputError};
use medial_reports::Status;
use pyo3::prelude::*;
use pyo3::types::PyType;

/// The exceptions of `medial_axis/errors.py`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// What was given is wrong: a file, an array, a surface that bounds no solid.
    Input,
    /// A parameter or a level is wrong.
    Parameter,
    /// The method does not do this.
    Unsupported,
    /// The method could not do it.
    Failed,
    /// It was told to stop.
    Cancelled,
    /// A broken invariant: a fault of this program.
    Internal,
}

/// Why a call gives no result.
#[derive(Debug)]
pub struct Failure {
    kind: Kind,
    message: String,
}

impl Failure {
    /// A failure of a kind.
    pub fn new(kind: Kind, message: impl ToString) -> Self {
        Self { kind, message: message.to_string() }
    }

    /// A failure of [`Kind::Input`].
    pub fn input(message: impl ToString) -> Self {
        Self::new(Kind::Input, message)
    }

    /// A failure of [`Kind::Parameter`].
    pub fn parameter(message: impl ToString) -> Self {
        Self::new(Kind::Parameter, message)
    }

    /// The failure that the runner has told.
    pub fn of_fault(fault: Fault) -> Self {
        let kind = match fault.status {
            Status::Unsupported => Kind::Unsupported,
            Status::Refused => Kind::Parameter,
            Status::Panicked => return Self::of_panic(&fault.reason),
            _ => Kind::Failed,
        };
        Self::new(kind, fault.reason)
    }

    /// The failure that a panic is.
    pub fn of_panic(message: &str) -> Self {
        let advice = "this is a fault of medialaxis: please report it with the input";
        Self::new(Kind::Internal, format!("{message}; {advice}"))
    }
}

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> Self {
        let name = match failure.kind {
            Kind::Input => "InputError",
            Kind::Parameter => "ParameterError",
            Kind::Unsupported => "UnsupportedError",
            Kind::Failed => "FailedError",
            Kind::Cancelled => "CancelledError",
            Kind::Internal => "InternalError",
        };
        Python::attach(|py| {
            let class = py.import("medial_axis.errors").and_then(|module| module.getattr(name));
            match class.and_then(|class| Ok(class.cast_into::<PyType>()?)) {
                Ok(class) => Self::from_type(class, failure.message),
                Err(error) => error,
            }
        })
    }
}

impl From<SimplifyError> for Failure {
    fn from(error: SimplifyError) -> Self {
        let kind = match &error {
            SimplifyError::Unsupported { .. } => Kind::Unsupported,
            SimplifyError::Parameter(_) | SimplifyError::Level(_) => Kind::Parameter,
            SimplifyError::Shape(_) => Kind::Input,
            SimplifyError::Cancelled => Kind::Cancelled,
            _ => Kind::Failed,
        };
        Self::new(kind, error)
    }
}

/// Errors that are always about what was given.
macro_rules! about_input {
    ($($error:ty),+) => {
        $(impl From<$error> for Failure {
            fn from(error: $error) -> Self {
                Self::input(error)
            }
        })+
    };
}

about_input!(
    BvhError,
    ComplexError,
    ContourError,
    InputError,
    MaError,
    MetricError,
    ShapeError,
    SurfaceError,
    TriangulationError,
    UnionError
);
