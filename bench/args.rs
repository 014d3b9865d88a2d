//! Arguments that several verbs share, and their conversion to options of the library.

use std::path::PathBuf;

use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, RangedU64ValueParser, TypedValueParser};
use medial::complex::DualTriangulation;
use medial::metrics::JudgeOptions;
use medial::shape::ShapeOptions;
use medial::simplifier::Params;
use medial::surface::Sampling;
use medial_run::axis::{AxisOptions, FitBy, RadiiFrom};
use serde::de::DeserializeOwned;

use crate::exit::Failure;
use crate::progress::StageLine;
use crate::study::registry::{Entry, Registry};
use crate::study::{LEAST_SAMPLES, MOST_SAMPLES, MOST_THREADS, Study};

#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Global options")]
pub struct Global {
    /// Print one JSON object on standard output and nothing else.
    #[arg(long, global = true)]
    pub json: bool,
    /// Use N threads [default: all processors].
    #[arg(
        long,
        global = true,
        value_name = "N",
        value_parser = RangedU64ValueParser::<usize>::new().range(1..=MOST_THREADS as u64)
    )]
    pub threads: Option<usize>,
    /// Hide progress.
    #[arg(long, short, global = true)]
    pub quiet: bool,
    /// Add the methods declared in a plug-in file; repeatable.
    #[arg(long, global = true, value_name = "FILE")]
    pub plugins: Vec<PathBuf>,
}

impl Global {
    /// A line with the stage of a single task. JSON output is for programs and hides it.
    pub fn stages(&self) -> StageLine {
        StageLine::new(self.quiet || self.json)
    }
}

/// How the substrates of a shape are built.
#[derive(Clone, Debug, Args)]
pub struct SubstrateArguments {
    /// Boundary samples: `conforming` (the vertices, with points that make the topology right), `vertices`
    /// (as in the papers), `uniform:COUNT`, `blue:COUNT`, or `conforming:COUNT`, which begins with COUNT points at least
    /// [default: conforming].
    #[arg(long, value_name = "SAMPLING")]
    pub sampling: Option<String>,
    /// Triangulation of the dual Voronoi polygons [default: fan].
    #[arg(long, value_parser = dual())]
    pub dual: Option<DualTriangulation>,
    /// Set the seed of every random choice [default: 0].
    #[arg(long)]
    pub seed: Option<u64>,
    /// Refuse a surface that crosses or touches itself, or closes only after vertices within a distance are merged.
    #[arg(long)]
    pub as_is: bool,
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
        // `uniform:COUNT:SEED` and `blue:COUNT:SEED` name their own.
        let seeded = text.split(':').count() > 2;
        Ok(if seeded { sampling } else { sampling.with_seed(self.seed()) })
    }

    pub fn shape_options(&self) -> Result<ShapeOptions, Failure> {
        let dual = self.dual.unwrap_or_default();
        Ok(ShapeOptions { sampling: self.sampling()?, dual })
    }

    /// Sets the given options in a study.
    pub fn apply(&self, study: &mut Study) -> Result<(), Failure> {
        // Only given options: a default of the command line must not override the study file.
        study.seed = self.seed.unwrap_or(study.seed);
        study.dual = self.dual.unwrap_or(study.dual);
        if self.sampling.is_some() {
            study.sampling = self.sampling()?;
        }
        Ok(())
    }
}

/// A value among the words of an enumeration in JSON, each with its help.
pub fn word<T>(words: &[(&'static str, &'static str)]) -> impl TypedValueParser<Value = T> + use<T>
where
    T: DeserializeOwned + Clone + Send + Sync + 'static,
{
    let values = words.iter().map(|&(word, help)| PossibleValue::new(word).help(help));
    PossibleValuesParser::new(values.collect::<Vec<_>>())
        .map(|word| serde_json::from_value(word.into()).expect("a word of the enumeration"))
}

fn dual() -> impl TypedValueParser<Value = DualTriangulation> {
    word(&[("fan", "A fan, as published"), ("delaunay", "Planar Delaunay")])
}

fn radii() -> impl TypedValueParser<Value = RadiiFrom> {
    word(&[("file", "From the file"), ("surface", "The distance of each centre to the surface")])
}

fn fit() -> impl TypedValueParser<Value = FitBy> {
    word(&[
        ("none", "The file is in the units of the surface"),
        ("similarity", "Apply the uniform scale and the shift that fit the spheres to the surface"),
        ("auto", "As `similarity`, for files that fit only after scaling"),
    ])
}

/// How medial meshes are read and fitted to their surface.
#[derive(Clone, Copy, Debug, Args)]
pub struct AxisArguments {
    /// Read all lines of a medial mesh whose header states a different number.
    #[arg(long)]
    lenient: bool,
    /// Read the K-th medial mesh, or link of a robot, of a file that holds several, counted from 1.
    #[arg(long, value_name = "K")]
    block: Option<usize>,
    /// Read radii from the file, or compute them where it has none or other numbers instead.
    #[arg(long, default_value = "file", value_parser = radii())]
    radii: RadiiFrom,
    /// Convert the units of the medial mesh to those of the surface, and print the scale and shift.
    #[arg(long, default_value = "none", value_parser = fit())]
    fit: FitBy,
}

impl From<AxisArguments> for AxisOptions {
    fn from(arguments: AxisArguments) -> Self {
        let AxisArguments { lenient, block, radii, fit } = arguments;
        Self { lenient, block, radii, fit }
    }
}

#[derive(Clone, Debug, Args)]
pub struct MeasureArguments {
    /// Measure errors at N surface samples, at least 100, in addition to the vertices, and at N samples of the
    /// reconstruction [default: 50000 for one mesh, 10000 in `compare`].
    #[arg(
        long,
        value_name = "N",
        value_parser = RangedU64ValueParser::<usize>::new().range(LEAST_SAMPLES as u64..=MOST_SAMPLES as u64)
    )]
    pub samples: Option<usize>,
}

impl MeasureArguments {
    pub fn judge_options(&self, seed: u64) -> JudgeOptions {
        let defaults = JudgeOptions::default();
        JudgeOptions { samples: self.samples.unwrap_or(defaults.samples), seed, ..defaults }
    }
}

/// A mesh argument: a file, `builtin:ID[:RESOLUTION]` or `dataset:NAME`.
pub type MeshArgument = PathBuf;

/// Reads a positive and finite number.
pub fn positive(text: &str) -> Result<f64, String> {
    number(text, |x| x > 0.0, "a positive number")
}

/// Reads a positive fraction of at most 1.
pub fn fraction(text: &str) -> Result<f64, String> {
    number(text, |x| x > 0.0 && x <= 1.0, "a number above 0 and at most 1")
}

fn number(text: &str, is_wanted: fn(f64) -> bool, expected: &str) -> Result<f64, String> {
    // `f64` also reads `nan` and `inf`, with which no comparison and no search would end well.
    let number = text.parse().ok().filter(|&x: &f64| x.is_finite() && is_wanted(x));
    number.ok_or_else(|| format!("expected {expected}"))
}

/// Reads a number of spheres; its range is checked by the method.
pub fn whole(text: &str) -> Result<usize, &'static str> {
    text.trim().parse().map_err(|_| "expected a whole number")
}

/// Reads `KEY=VALUE`.
pub fn key_value(text: &str) -> Result<(String, String), String> {
    let (key, value) = text.split_once('=').ok_or("expected KEY=VALUE")?;
    Ok((key.to_owned(), value.to_owned()))
}

pub fn params(words: &[(String, String)]) -> Params {
    let mut params = Params::none();
    words.iter().for_each(|(key, value)| params.set(key, value));
    params
}

/// The method with an id. Fails when no method has it; the message lists the ids.
pub fn method<'r>(registry: &'r Registry, id: &str) -> Result<&'r Entry, Failure> {
    registry.entry(id).ok_or_else(|| Failure::usage(registry.no_such(id)))
}
