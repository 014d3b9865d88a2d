//! Arguments that several verbs share, and what they mean to the library.

use std::path::PathBuf;

use clap::Args;
use medial::complex::{Radii, ReadOptions};
use medial::metrics::JudgeOptions;
use medial::shape::ShapeOptions;
use medial::simplifier::Params;
use medial::surface::Sampling;

use crate::exit::Failure;
use crate::progress::Verbosity;
use crate::study::external::{AxisOptions, FitBy, RadiiFrom};
use crate::study::item::Dual;
use crate::study::registry::{Entry, Registry};
use crate::study::{Study, no_such_method};

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
    /// Methods that are programs of their own, declared in a TOML file; can be given several times.
    #[arg(long, global = true, value_name = "FILE")]
    pub plugins: Vec<PathBuf>,
}

impl Global {
    /// Whether the progress of a list of items is shown.
    pub fn progress(&self) -> Verbosity {
        if self.quiet { Verbosity::Quiet } else { Verbosity::Progress }
    }

    /// Whether the stages of a single piece of work are shown: not beside JSON, which is for programs.
    pub fn stages(&self) -> Verbosity {
        if self.json { Verbosity::Quiet } else { self.progress() }
    }
}

/// How the substrates of a shape are built.
#[derive(Clone, Debug, Args)]
pub struct SubstrateArguments {
    /// Boundary samples: `vertices`, `auto`, `uniform:COUNT` or `blue:COUNT` [default: vertices].
    #[arg(long, value_name = "SAMPLING")]
    pub sampling: Option<String>,
    /// Triangulation of the dual Voronoi polygons [default: fan].
    #[arg(long, value_enum)]
    pub dual: Option<Dual>,
    /// Seed of every random choice [default: 0].
    #[arg(long)]
    pub seed: Option<u64>,
}

impl SubstrateArguments {
    /// The seed of every random choice.
    pub fn seed(&self) -> u64 {
        self.seed.unwrap_or(0)
    }

    /// Boundary samples, with the run's seed where the sampling itself names none.
    fn sampling(&self) -> Result<Sampling, Failure> {
        let Some(text) = &self.sampling else { return Ok(Sampling::default()) };
        let sampling: Sampling =
            text.parse().map_err(|error| Failure::usage(format!("--sampling: {error}")))?;
        let seeded = text.split(':').count() > 2;
        Ok(if seeded { sampling } else { sampling.with_seed(self.seed()) })
    }

    /// Puts what is given into a study.
    ///
    /// # Errors
    /// When the sampling is not understood.
    pub fn apply(&self, study: &mut Study) -> Result<(), Failure> {
        study.seed = self.seed.unwrap_or(study.seed);
        study.dual = self.dual.unwrap_or(study.dual);
        if self.sampling.is_some() {
            study.sampling = self.sampling()?;
        }
        Ok(())
    }
}

/// How results are measured.
#[derive(Clone, Debug, Args)]
pub struct MeasureArguments {
    /// Surface samples for the error, beside the mesh's vertices; as many on the reconstruction
    /// [default: 50000, `compare` 10000].
    #[arg(long, value_name = "N")]
    pub samples: Option<usize>,
}

impl MeasureArguments {
    /// Puts what is given into a study.
    ///
    /// # Errors
    /// When no sample is asked for, or more than fit into memory.
    pub fn apply(&self, study: &mut Study) -> Result<(), Failure> {
        let defaults = JudgeOptions { samples: study.samples, ..JudgeOptions::default() };
        study.samples = judge_options(self, defaults, 0)?.samples;
        Ok(())
    }
}

/// How a file of a medial mesh is read that is not what its header says.
#[derive(Clone, Debug, Default, Args)]
pub struct ReadArguments {
    /// Take the lines of a medial mesh as they are where its header announces another number of them.
    #[arg(long)]
    pub lenient: bool,
    /// Which medial mesh is meant of a file to which several were appended, from 1.
    #[arg(long, value_name = "K")]
    pub block: Option<usize>,
}

impl ReadArguments {
    /// The options of the reader.
    pub fn options(&self) -> ReadOptions {
        ReadOptions { lenient: self.lenient, block: self.block, radii: Radii::Needed }
    }
}

/// How a medial mesh from a file is brought to its surface.
#[derive(Clone, Debug, Default, Args)]
pub struct AxisArguments {
    /// How the file is read.
    #[command(flatten)]
    pub read: ReadArguments,
    /// Where radii come from: `surface` takes the distance of each centre to the surface, for files without radii
    /// or with other numbers in their place.
    #[arg(long, value_enum, default_value_t)]
    pub radii: RadiiFrom,
    /// The units of the medial mesh: those of the surface, or whatever scale and shift fit it best, which are said.
    #[arg(long, value_enum, default_value_t)]
    pub fit: FitBy,
}

impl AxisArguments {
    /// What they ask of the reader.
    pub fn options(&self) -> AxisOptions {
        let ReadArguments { lenient, block } = self.read;
        AxisOptions { lenient, block, radii: self.radii, fit: self.fit }
    }
}

/// A mesh argument: a file, `builtin:ID[:RESOLUTION]` or `dataset:NAME`.
pub type MeshArgument = PathBuf;

/// The options of a shape from the command line.
///
/// # Errors
/// When the sampling is not understood.
pub fn shape_options(arguments: &SubstrateArguments) -> Result<ShapeOptions, Failure> {
    let dual = arguments.dual.unwrap_or_default().into();
    Ok(ShapeOptions { sampling: arguments.sampling()?, dual })
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

/// The method with an id.
///
/// # Errors
/// When no method has it; the message lists the ids.
pub fn method<'r>(registry: &'r Registry, id: &str) -> Result<&'r Entry, Failure> {
    registry.entry(id).ok_or_else(|| {
        let known: Vec<String> = registry.entries().iter().map(|e| e.id().to_owned()).collect();
        Failure::usage(no_such_method(id, &known))
    })
}
