//! Arguments that several verbs share, and what they mean to the library.

use std::path::PathBuf;

use clap::Args;
use medial::metrics::JudgeOptions;
use medial::shape::ShapeOptions;
use medial::simplifier::Params;
use medial::surface::Sampling;

use crate::exit::Failure;

/// Options of every verb.
#[derive(Clone, Debug, Args)]
pub struct Global {
    /// Print one JSON object on standard output, and nothing else there.
    #[arg(long, global = true)]
    pub json: bool,
    /// Number of threads [default: all processors].
    #[arg(long, global = true, value_name = "N")]
    pub threads: Option<usize>,
    /// No progress on standard error.
    #[arg(long, short, global = true)]
    pub quiet: bool,
}

/// How the substrates of a shape are built.
#[derive(Clone, Debug, Args)]
pub struct SubstrateArguments {
    /// Boundary samples: `vertices`, `uniform:COUNT` or `blue:COUNT`.
    #[arg(long, value_name = "SAMPLING", default_value = "vertices")]
    pub sampling: String,
    /// Triangulation of the dual Voronoi polygons.
    #[arg(long, value_enum, default_value_t = Dual::Fan)]
    pub dual: Dual,
    /// Seed of every random choice.
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
}

/// Triangulation of the dual Voronoi polygons.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Dual {
    /// A fan, as published.
    Fan,
    /// Planar Delaunay.
    Delaunay,
}

/// How results are measured.
#[derive(Clone, Debug, Args)]
pub struct MeasureArguments {
    /// Surface samples for the error, beside the mesh's vertices; as many on the reconstruction
    /// [default: 50000, `compare` 10000].
    #[arg(long, value_name = "N")]
    pub samples: Option<usize>,
}

/// A mesh argument: a file, or `builtin:ID[:RESOLUTION]`.
pub type MeshArgument = PathBuf;

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
