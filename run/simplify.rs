//! One method on one shape at one level, or within one error bound.

use std::cell::Cell;
use std::convert::Infallible;

use medial::complex::{self, MedialMesh};
use medial::metrics::{JudgeOptions, topology_warning};
use medial::shape::Shape;
use medial::simplifier::{MedialSimplifier, Params, RunContext, Simplified, SimplifyError};
use medial::surface::Sampling;
use serde::Serialize;

use crate::level::Target;
use crate::outcome::{count_fault, fill_costs, fill_result};
use crate::record::Simplify;
use crate::search::Found;
use crate::timed::{Bounds, Budget, Fault, LevelRun, answer, failed, preparing};

/// A method on a shape, for one target: `simplify` of the command and of Python.
pub struct Request<'a> {
    /// The shape.
    pub shape: &'a Shape,
    /// The method.
    pub method: &'a dyn MedialSimplifier,
    /// Native levels of its default comparison.
    pub sweep: &'a [f64],
    /// Its parameters.
    pub params: &'a Params,
    /// Seed, progress and cancellation.
    pub context: &'a RunContext,
    /// Measures results for an error bound.
    pub judge: JudgeOptions,
    /// Whether a certificate proves the error bound instead of samples.
    pub certify: bool,
    /// Whether the output drops edges and faces: the error of a result that has them is not that of its spheres.
    pub spheres_alone: bool,
    /// Gets the name of each stage when it begins.
    pub on_stage: &'a dyn Fn(&str),
}

/// The result of a search for an error bound.
#[derive(Clone, Debug, Serialize)]
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

/// A result, with the facts of its run.
pub struct Output {
    /// The requested level, or that found for an error bound, with counts, costs and warnings.
    pub simplify: Simplify,
    /// The result, in the units of the shape.
    pub result: Simplified,
    /// The search for an error bound.
    pub search: Option<Searched>,
}

impl Request<'_> {
    /// Runs the method at a level, or at the level that a search for an error bound finds.
    ///
    /// # Errors
    /// The fault of the method, or of the search.
    pub fn run(&self, target: Target) -> Result<Output, Fault> {
        let (run, search) = self.timed(target);
        let result = run.outcome?;
        let status = count_fault(target, &result).status;
        let mut simplify = Simplify {
            params: self.params.clone(),
            seed: self.context.seed,
            threads: Some(rayon::current_num_threads()),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            ..Simplify::asked(&*self.method.info().id, run.level, status)
        };
        fill_costs(&mut simplify, &run.times);
        fill_result(&mut simplify, &result);
        simplify.warnings.extend(self.shape.remarks());
        (self.on_stage)("checking the topology");
        simplify.warnings.extend(topology_warnings(&result.mesh, self.shape));
        Ok(Output { simplify, result, search })
    }

    fn timed(&self, target: Target) -> (LevelRun, Option<Searched>) {
        let Self { shape, method, params, context, .. } = *self;
        let (info, budget) = (method.info(), Budget::from_now(None));
        (self.on_stage)(&format!("preparing {}", info.id));
        let prepare = preparing(|view| method.prepare(view, params, context));
        let bound = match target.level() {
            Ok(level) => {
                let view = shape.view();
                let at = |level| (self.on_stage)(&format!("simplifying to {level} by {}", info.id));
                let runs = answer(&view, info, || prepare(&view), &[level], &budget, at);
                return (runs.into_iter().next().expect("one level, one run"), None);
            }
            Err(bound) => bound,
        };
        // The known axis does not count for the error.
        let judge = match shape.judge(None, self.judge) {
            Ok(judge) => judge,
            Err(error) => return (failed(bound, SimplifyError::from(error).into()), None),
        };
        let is_dropped = Cell::new(false);
        let dropped = "the results have edges, which the output drops, and their error is not that of the spheres; write \
                       .ma, or name --method cover";
        let measure = |mesh: &MedialMesh| -> Result<f64, String> {
            if self.spheres_alone && !mesh.edges.is_empty() {
                is_dropped.set(true);
                return Err(dropped.to_owned());
            }
            let sampled = judge.distances(mesh).map_err(|error| error.to_string())?.hausdorff;
            // Samples are a lower bound: above the error bound, no certificate is needed.
            if !self.certify || sampled > bound {
                return Ok(sampled);
            }
            // An upper end within the bound needs an interval much narrower than the bound.
            let certified = judge.certify(mesh, CERTIFIED_SHARE * bound);
            Ok(certified.map_err(|error| error.to_string())?.upper)
        };
        let search = Bounds {
            shape,
            info,
            sweep: self.sweep,
            prepare: &prepare,
            measure: &measure,
            budget: &budget,
            searching: &|_| {},
            trying: &|level| {
                if context.is_cancelled() {
                    return Err(SimplifyError::Cancelled);
                }
                if is_dropped.get() {
                    return Err(SimplifyError::Level(dropped.to_owned()));
                }
                (self.on_stage)(&format!("searching the bound: {level}"));
                Ok(())
            },
        };
        let mut ended = None;
        let Ok(()) = search.answer(&[bound], &mut |run, found| {
            ended = Some((run, found));
            Ok::<_, Infallible>(())
        });
        let (run, found) = ended.expect("one bound, one run");
        let Some(Found { within: Some(probe), tried, .. }) = found else { return (run, None) };
        let (spheres, hausdorff) = (probe.spheres, probe.error);
        let searched = Searched { bound, hausdorff, tried, spheres, certified: self.certify };
        (LevelRun { level: probe.level.into(), ..run }, Some(searched))
    }
}

/// Warnings for a result, and its initial medial mesh, without the solid's topology.
fn topology_warnings(result: &MedialMesh, shape: &Shape) -> Vec<String> {
    // A list of spheres has no connectivity that could be wrong.
    if result.edges.is_empty() && result.spheres.len() > 1 {
        return Vec::new();
    }
    let expected = shape.expected_betti();
    // The topology of the initial medial mesh takes longer: only for wrong results.
    let Some(own) = topology_warning(complex::betti(result), expected) else { return Vec::new() };
    let initial = shape.initial().ok();
    let start = initial.and_then(|initial| topology_warning(complex::betti(&initial), expected));
    let is_conforming = matches!(shape.options().sampling, Sampling::Conforming { .. });
    let advice = match is_conforming || shape.has_given_initial() {
        true => "",
        false => "; try `--sampling conforming`",
    };
    let start =
        start.map(|start| format!("the initial medial mesh is not right either ({start}){advice}"));
    [Some(format!("the topology differs from the solid's: {own}")), start]
        .into_iter()
        .flatten()
        .collect()
}
