//! The verbs of the command, one file each, and what they share: failures, exit codes, output.

use std::path::Path;
use std::process::ExitCode;

use medial::complex::{self, LoadedMa};
use medial::metrics::JudgeOptions;
use medial::shape::{Shape, ShapeOptions};
use medial::simplifier::Params;
use medial::surface::Sampling;

use crate::cli::{Dual, MeasureArguments, SubstrateArguments};
use crate::run::{InputError, Source};

pub mod axis;
pub mod baseline;
pub mod compare;
pub mod completions;
pub mod convert;
pub mod datasets;
pub mod doctor;
pub mod evaluate;
pub mod hierarchy;
pub mod info;
pub mod methods;
pub mod output;
pub mod paper;
pub mod reconstruct;
pub mod repair;
pub mod report;
pub mod simplify;
pub mod stability;
pub mod triangulate;
pub mod voxels;

pub use output::{note, print_failure, print_json, print_line};

/// Exit codes of the command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exit {
    /// All was done.
    Done = 0,
    /// The user's input is wrong.
    Input = 1,
    /// The command line is wrong.
    Usage = 2,
    /// Some runs failed or are unsupported, the rest are reported.
    SomeFailed = 3,
    /// Nothing was measured.
    NothingMeasured = 5,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}

/// A verb that could not do its work.
#[derive(Debug)]
pub struct Failure {
    /// The exit code.
    pub code: Exit,
    /// What is wrong and what to do, one sentence.
    pub message: String,
}

impl Failure {
    /// The user's input is wrong.
    pub fn input(message: impl ToString) -> Self {
        Self { code: Exit::Input, message: message.to_string() }
    }

    /// The command line is wrong.
    pub fn usage(message: impl ToString) -> Self {
        Self { code: Exit::Usage, message: message.to_string() }
    }

    /// The user's input is wrong, and the message does not name it by itself.
    pub fn of(source: &Source, message: impl ToString) -> Self {
        Self::input(format!("{source}: {}", message.to_string()))
    }
}

impl From<InputError> for Failure {
    fn from(error: InputError) -> Self {
        match error {
            InputError::Read { .. } | InputError::Surface(_) => Self::input(error),
            InputError::NoSuchShape(_)
            | InputError::Resolution(_)
            | InputError::OutOfRange { .. }
            | InputError::TooManyVertices { .. } => Self::usage(error),
        }
    }
}

/// Version of the program.
pub fn version() -> &'static str {
    env!("CARGO_PKG_VERSION")
}

/// The options of a shape from the command line.
///
/// # Errors
/// When the sampling is not understood.
pub fn shape_options(arguments: &SubstrateArguments) -> Result<ShapeOptions, Failure> {
    let text = &arguments.sampling;
    let sampling: Sampling =
        text.parse().map_err(|error| Failure::usage(format!("--sampling: {error}")))?;
    // A seed within the sampling wins over the run's.
    let seeded = text.split(':').count() > 2;
    let sampling = if seeded { sampling } else { sampling.with_seed(arguments.seed) };
    let dual = match arguments.dual {
        Dual::Fan => medial::complex::DualTriangulation::Fan,
        Dual::Delaunay => medial::complex::DualTriangulation::Delaunay,
    };
    Ok(ShapeOptions { sampling, dual })
}

/// The options of the judge from the command line.
///
/// # Errors
/// When no sample is asked for, or more than fit into memory.
pub fn judge_options(
    arguments: &MeasureArguments,
    defaults: JudgeOptions,
    seed: u64,
) -> Result<JudgeOptions, Failure> {
    let samples = arguments.samples.unwrap_or(defaults.samples);
    if !(1..=MOST_SAMPLES).contains(&samples) {
        let message = format!("--samples {samples}: ask for 1 to {MOST_SAMPLES} samples");
        return Err(Failure::usage(message));
    }
    Ok(JudgeOptions { samples, seed, ..defaults })
}

/// More samples than this are taken for a slip.
const MOST_SAMPLES: usize = 10_000_000;

/// A medial mesh larger than this, in diagonals of the surface, cannot belong to it: next to its
/// spheres the whole surface is less than a rounding error.
const LARGEST_SPHERE: f64 = 1e12;

/// Reads a medial mesh that was made for a shape, in input units.
///
/// # Errors
/// When it cannot be read, has no sphere, or cannot belong to the shape.
pub fn medial_mesh_for(path: &Path, shape: &Shape) -> Result<LoadedMa, Failure> {
    let loaded = complex::read(path).map_err(Failure::input)?;
    if loaded.mesh.spheres.is_empty() {
        return Err(Failure::input(format!("{}: no sphere", path.display())));
    }
    let to_normal = shape.normalisation();
    for (id, sphere) in loaded.mesh.spheres.iter().enumerate() {
        let centre = to_normal.forward(sphere.centre);
        let size = centre.abs().max_element().max(sphere.radius / to_normal.diagonal);
        // An overflow gives a size that is infinite or not a number.
        if size.is_nan() || size > LARGEST_SPHERE {
            return Err(Failure::input(format!(
                "{}: sphere {id} reaches {size:.1e} diagonals of the surface away from it: the \
                 medial mesh is in other units, or of another surface",
                path.display()
            )));
        }
    }
    Ok(loaded)
}

/// Refuses an output that could not be written anyway, before the work for it is done.
///
/// # Errors
/// When the extension is none of a medial mesh, or the folder does not exist.
pub fn check_output(output: Option<&Path>) -> Result<(), Failure> {
    let Some(path) = output else { return Ok(()) };
    let known = ["ma", "ply", "obj"];
    let extension = extension(path);
    if !known.contains(&extension.as_str()) {
        return Err(Failure::input(format!(
            "{}: the extension {extension:?} is not one of .ma, .ply, .obj",
            path.display()
        )));
    }
    check_folder(path)
}

/// Refuses a file in a folder that does not exist.
///
/// # Errors
/// When the folder does not exist.
pub fn check_folder(path: &Path) -> Result<(), Failure> {
    match path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        Some(folder) if !folder.is_dir() => Err(Failure::input(format!(
            "{}: there is no folder {}; make it first",
            path.display(),
            folder.display()
        ))),
        _ => Ok(()),
    }
}

/// A number with its noun, such as `1 sphere` or `3 faces`.
pub fn counted(number: u64, noun: &str) -> String {
    format!("{number} {noun}{}", if number == 1 { "" } else { "s" })
}

/// Parameters from `key=value` words.
///
/// # Errors
/// When a word has no `=`.
pub fn params(words: &[String]) -> Result<Params, Failure> {
    let mut params = Params::none();
    for word in words {
        let (key, value) = word
            .split_once('=')
            .ok_or_else(|| Failure::usage(format!("--set {word}: write key=value")))?;
        params.set(key, value);
    }
    Ok(params)
}

/// Lower-case extension of a path, or nothing.
pub fn extension(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default()
}

/// A fraction of the diagonal as a percentage with three decimals.
pub fn percent(fraction: f64) -> String {
    format!("{:.3} %", 100.0 * fraction)
}
