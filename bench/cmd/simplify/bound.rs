//! `--max-error`: the fewest spheres within an error bound.

use medial::complex::MedialMesh;
use medial::metrics::{JudgeOptions, MetricError};
use medial::simplifier::{Level, RunContext, SimplifyError};
use serde::Serialize;

use super::{Arguments, Start, failure_of};
use crate::args::judge_options;
use crate::exit::Failure;
use crate::run::{Input, Probe, Search, StageLine};

/// What a search over sphere counts found, for the answer to `--max-error`.
#[derive(Debug, Serialize)]
pub struct Searched {
    /// The bound, a fraction of the diagonal.
    pub bound: f64,
    /// The error of the result.
    pub hausdorff: f64,
    /// Number of levels that were tried.
    pub tried: usize,
    /// Spheres of the result.
    pub spheres: usize,
    /// Whether the error is the upper end of a certified interval, or else a maximum of samples.
    pub certified: bool,
}

/// Width of the interval that certifies a bound, as a share of it.
const CERTIFIED_SHARE: f64 = 0.05;

/// Refuses a bound that is none, before anything is read.
pub fn check(arguments: &Arguments) -> Result<(), Failure> {
    match arguments.max_error {
        Some(bound) if !(bound.is_finite() && bound > 0.0) => {
            let message = format!("--max-error {bound}: a positive fraction of the diagonal");
            Err(Failure::usage(message))
        }
        // The whole solid is within one diagonal of anything inside it.
        Some(bound) if bound >= 1.0 => Err(Failure::usage(format!(
            "--max-error {bound}: a fraction of the diagonal is meant, and this is {} % of it; \
             write {} for {bound} %",
            100.0 * bound,
            bound / 100.0
        ))),
        Some(_) => judge_options(&arguments.measure, JudgeOptions::default(), 0).map(|_| ()),
        None => Ok(()),
    }
}

/// Searches the fewest spheres within an error bound.
pub fn search(
    arguments: &Arguments,
    start: &Start<'_>,
    input: &Input,
    (bound, line): (f64, &StageLine),
) -> Result<(Level, Searched), Failure> {
    let seed = arguments.substrate.seed();
    let options = judge_options(&arguments.measure, JudgeOptions::default(), seed)?;
    let refused = |error: SimplifyError| failure_of(input, error.into());
    let judge = start.shape.judge(input.axis.as_ref(), options);
    let judge = judge.map_err(|error| refused(error.into()))?;
    let view = start.shape.view();
    line.at(format!("preparing {}", arguments.method));
    let run = RunContext::with_seed(seed).on_progress(line.steps());
    let mut simplification = start.begin(&view, &run).map_err(refused)?;
    let initial = start.spheres().map_err(refused)?;
    let measure = |mesh: &MedialMesh| -> Result<f64, String> {
        let told = |error: MetricError| error.to_string();
        let sampled = judge.distances(mesh).map_err(told)?.hausdorff;
        match arguments.certify && sampled <= bound {
            // An upper end within the bound needs an interval that is narrow beside it.
            true => Ok(judge.certify(mesh, CERTIFIED_SHARE * bound).map_err(told)?.upper),
            false => Ok(sampled),
        }
    };
    let trying = |level: Level| line.at(format!("searching the bound: {level}"));
    let sweep = &start.entry.presentation().sweep;
    let mut search = Search::new(simplification.as_mut(), sweep, initial, &measure, &trying);
    let found = search.within(bound).map_err(refused)?;
    let Some(Probe { level, spheres, error }) = found.within else {
        return Err(Failure::usage(found.refusal(bound)));
    };
    let (tried, certified) = (found.tried, arguments.certify);
    Ok((level, Searched { bound, hausdorff: error, tried, spheres, certified }))
}
