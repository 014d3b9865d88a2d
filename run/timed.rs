//! First step of a run: the timed simplification.
//!
//! This is the only place where methods are timed. [`answer`] prepares once and computes every level,
//! each guarded against panics. It returns a [`LevelRun`] for each: the mesh, the times, the memory.
//! Evaluation and writing come later and are not timed.

use std::any::Any;
use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Instant;

use medial::heap::Usage;
use medial::shape::{Cost, Shape, Substrate};
use medial::simplifier::{Level, MethodInfo, Simplification, Simplified, SimplifyError};
use serde::{Deserialize, Serialize};

use crate::level::Target;
use crate::record::{Stages, Status};
use crate::search::{Found, Measure, Probe, Search, Trying};

/// The outcome of one level.
pub struct LevelRun {
    /// The target of the run.
    pub level: Target,
    /// The result, or the fault.
    pub outcome: Result<Simplified, Fault>,
    /// The cost of the level, and of the substrates that it used.
    pub times: Times,
}

/// Seconds and memory of one level, as if only this level had been requested.
#[derive(Clone, Debug, Default)]
pub struct Times {
    /// The substrates that the method used, each with the cost of its construction.
    pub substrates: Vec<(Substrate, Cost)>,
    /// The work of the method that all levels share.
    pub prepare: Cost,
    /// The further work for this level.
    pub simplify: Cost,
    /// Peak of live bytes, with the substrates that the method used.
    pub peak_bytes: u64,
}

impl Times {
    /// Wall-clock seconds by stage.
    pub fn seconds(&self) -> Stages {
        self.stages(|cost| cost.seconds)
    }

    /// Processor seconds by stage.
    pub fn cpu_seconds(&self) -> Stages {
        self.stages(|cost| cost.cpu_seconds)
    }

    fn stages(&self, part: fn(&Cost) -> f64) -> Stages {
        // A fold from +0, because an empty sum is -0 and prints as such.
        let substrates = self.substrates.iter().fold(0.0, |sum, (_, cost)| sum + part(cost));
        Stages::new(substrates, part(&self.prepare), part(&self.simplify))
    }
}

/// The reason for which a level has no result.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fault {
    /// The kind of failure.
    pub status: Status,
    /// The reason, one line without a full stop.
    pub reason: String,
}

impl From<SimplifyError> for Fault {
    fn from(error: SimplifyError) -> Self {
        let status = match &error {
            SimplifyError::Unsupported { .. } => Status::Unsupported,
            SimplifyError::Parameter(_) | SimplifyError::Level(_) => Status::Refused,
            SimplifyError::InvalidOutput(_) => Status::InvalidOutput,
            SimplifyError::OutOfMemory(_) => Status::OutOfMemory,
            SimplifyError::Crashed(_) => Status::Panicked,
            SimplifyError::Shape(_) | SimplifyError::Failed(_) | SimplifyError::Cancelled => {
                Status::Failed
            }
        };
        Self { status, reason: error.to_string() }
    }
}

/// Most resident bytes of an external program and its descendants together, at the times of sampling.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProgramPeak(pub u64);

/// The time that the levels of a method may use together. After it, no further level starts.
pub struct Budget {
    begun: Instant,
    /// Seconds; `None` without a limit.
    seconds: Option<f64>,
    /// Whether a level was computed: the first one always is.
    has_level: Cell<bool>,
}

impl Budget {
    /// A budget of some seconds from now on.
    pub fn from_now(seconds: Option<f64>) -> Self {
        Self { begun: Instant::now(), seconds, has_level: Cell::new(false) }
    }

    /// The fault of levels that do not start because the budget is used up.
    fn used_up(&self) -> Option<Fault> {
        let (used, seconds) = (self.begun.elapsed().as_secs_f64(), self.seconds?);
        (self.has_level.get() && used > seconds).then(|| {
            let reason = format!(
                "not run: the budget of {seconds} s is used up; rerun with a larger --budget"
            );
            Fault { status: Status::Skipped, reason }
        })
    }
}

/// Starts a simplification on a view of a shape and computes every level as long as the budget lasts, the first
/// one always. `on_level` gets each level before it is computed.
///
/// The seconds of a level are those of its call. Where `info` declares the method incremental, they are
/// those of all calls since the preparation. Levels of another kind, and a finer level after a coarser
/// one, then get a new preparation, because they cannot continue.
///
/// The view must be fresh: everything that was used through it is listed as used.
pub fn answer<'s>(
    view: &Shape,
    info: &MethodInfo,
    start: impl Fn() -> Result<Box<dyn Simplification + 's>, SimplifyError>,
    levels: &[Level],
    budget: &Budget,
    on_level: impl Fn(Level),
) -> Vec<LevelRun> {
    let mut runs = Vec::new();
    let mut rest = levels;
    while let Some(&first) = rest.first() {
        let mut previous = first;
        let count = 1 + rest[1..]
            .iter()
            .take_while(|&&next| {
                let is_next = !info.incremental || continues(info, previous, next);
                previous = next;
                is_next
            })
            .count();
        // All levels of one preparation, timed as one run of growing length.
        let (together, others) = rest.split_at(count);
        runs.extend(of_one_preparation(
            view,
            info.incremental,
            &start,
            together,
            budget,
            &on_level,
        ));
        rest = others;
    }
    runs
}

/// Whether a level can continue from another of the same kind: it must not be finer.
fn continues(info: &MethodInfo, previous: Level, next: Level) -> bool {
    match (previous, next) {
        (Level::Spheres(before), Level::Spheres(count)) => count <= before,
        (Level::Native(before), Level::Native(value)) => match &info.native {
            Some(native) if native.larger_is_coarser => value >= before,
            _ => value <= before,
        },
        _ => false,
    }
}

/// Prepares once and computes all levels.
fn of_one_preparation<'s>(
    view: &Shape,
    is_incremental: bool,
    start: impl FnOnce() -> Result<Box<dyn Simplification + 's>, SimplifyError>,
    levels: &[Level],
    budget: &Budget,
    on_level: impl Fn(Level),
) -> Vec<LevelRun> {
    let before = view.spent();
    // Without budget for a level, the preparation is skipped, too.
    let (started, mut prepare) = Cost::of(|| budget.used_up().map_or_else(|| guarded(start), Err));
    // Substrates are shared between methods, so building them here is not the method's own work.
    let built = view.spent();
    prepare.seconds = (prepare.seconds - (built.seconds - before.seconds)).max(0.0);
    prepare.cpu_seconds = (prepare.cpu_seconds - (built.cpu_seconds - before.cpu_seconds)).max(0.0);
    // Substrates built here are still live; they are counted with those that were found.
    prepare.usage = without(prepare.usage, without(built.usage, before.usage));
    let held = prepare.usage.held_bytes;
    let mut clock = Clock { view, is_incremental, prepare, so_far: Cost::default(), held };
    // The fault of all further levels: a simplification that panicked is in an unknown state and must not be called again.
    let mut usable = started;
    let run = |&level: &Level| {
        let outcome = match (&mut usable, budget.used_up()) {
            (Err(fault), _) => Err(fault.clone()),
            (Ok(_), Some(fault)) => Err(fault),
            (Ok(simplification), None) => {
                on_level(level);
                let (outcome, lap) = Cost::of(|| guarded(|| simplification.at(level)));
                budget.has_level.set(true);
                clock.add(lap);
                // After the clock has stopped: checking is the harness's work.
                outcome.and_then(|simplified| checked(level, simplified))
            }
        };
        if usable.is_ok() && outcome.as_ref().is_err_and(|fault| fault.status == Status::Panicked) {
            let reason = format!("not run: the method panicked at {level}");
            usable = Err(Fault { status: Status::Panicked, reason });
        }
        LevelRun { level: level.into(), outcome, times: clock.times() }
    };
    levels.iter().map(run).collect()
}

/// The costs of levels, each as if it had been computed alone.
struct Clock<'s> {
    view: &'s Shape,
    is_incremental: bool,
    prepare: Cost,
    so_far: Cost,
    /// Live bytes of the method itself when the next level begins.
    held: u64,
}

impl Clock<'_> {
    fn add(&mut self, lap: Cost) {
        // A lap counts from the live bytes at its start, to which earlier levels have added.
        let peak = self.held + lap.usage.peak_bytes;
        self.held += lap.usage.held_bytes;
        // An incremental method reaches a coarse level through the finer ones, whose costs add up.
        if self.is_incremental {
            self.so_far.seconds += lap.seconds;
            self.so_far.cpu_seconds += lap.cpu_seconds;
            self.so_far.usage.peak_bytes = self.so_far.usage.peak_bytes.max(peak);
        } else {
            self.so_far = lap;
            self.so_far.usage.peak_bytes = peak;
        }
    }

    fn times(&self) -> Times {
        let substrates = self.view.used();
        // Built one after another: each adds its bytes, and its peak comes on top of the others.
        let mut built = Cost::default();
        substrates.iter().for_each(|(_, cost)| built += *cost);
        let Usage { held_bytes: held, peak_bytes: peak } = built.usage;
        let own = self.prepare.usage.peak_bytes.max(self.so_far.usage.peak_bytes);
        let peak_bytes = peak.max(held + own);
        Times { substrates, prepare: self.prepare, simplify: self.so_far, peak_bytes }
    }
}

fn without(all: Usage, part: Usage) -> Usage {
    Usage {
        held_bytes: all.held_bytes.saturating_sub(part.held_bytes),
        peak_bytes: all.peak_bytes.saturating_sub(part.held_bytes),
    }
}

/// A valid, non-empty result, or the fault.
fn checked(level: Level, simplified: Simplified) -> Result<Simplified, Fault> {
    simplified.mesh.check().map_err(SimplifyError::from)?;
    if simplified.mesh.spheres.is_empty() {
        let why = simplified.diagnostics.warnings.join("; ");
        let why = if why.is_empty() { why } else { format!(" ({why})") };
        let reason = format!("the result has no sphere{why}; request a finer level");
        // A native level may be empty, but every count has some spheres.
        let status = match level {
            Level::Spheres(_) => Status::Failed,
            Level::Native(_) | Level::Published => Status::Unsupported,
        };
        return Err(Fault { status, reason });
    }
    Ok(simplified)
}

/// The result of some work, with a panic turned into a fault.
pub fn guarded<T>(work: impl FnOnce() -> Result<T, SimplifyError>) -> Result<T, Fault> {
    // The state after a panic is not used again: callers drop the simplification.
    match catch_unwind(AssertUnwindSafe(work)) {
        Ok(outcome) => Ok(outcome?),
        Err(payload) => {
            Err(Fault { status: Status::Panicked, reason: panic_message(payload.as_ref()) })
        }
    }
}

impl Fault {
    /// Whether the method panicked, unlike a program that a signal ended.
    pub fn is_bug(&self) -> bool {
        self.status == Status::Panicked && self.reason.starts_with(PANICKED)
    }
}

/// Begin of the message of a panic.
const PANICKED: &str = "panicked: ";

/// The message of a panic.
pub fn panic_message(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().map(|text| (*text).to_owned());
    let text = text.or_else(|| payload.downcast_ref::<String>().cloned());
    format!("{PANICKED}{}", text.unwrap_or_else(|| "no message".into()))
}

/// Begins a simplification on a view.
pub type Prepare<'a> =
    dyn for<'v> Fn(&'v Shape) -> Result<Box<dyn Simplification + 'v>, SimplifyError> + 'a;

/// Returns its argument, a closure that starts a simplification on any view. Passing the closure
/// through this function makes the compiler infer its lifetimes.
pub fn preparing<F>(begin: F) -> F
where
    F: for<'v> Fn(&'v Shape) -> Result<Box<dyn Simplification + 'v>, SimplifyError>,
{
    begin
}

/// The run for a bound without a result.
pub(crate) fn failed(bound: f64, fault: Fault) -> LevelRun {
    LevelRun { level: Target::MaxError(bound), outcome: Err(fault), times: Times::default() }
}

fn missed(bound: f64, found: &Found, advice: &str) -> LevelRun {
    let reason = format!("{}{advice}", found.refusal(bound));
    failed(bound, Fault { status: Status::BoundMissed, reason })
}

/// Runs of a method that holds bounds by itself, until its result is within the bound by the measure of the search.
const DIRECT_RUNS: usize = 4;

/// The smallest and the largest ratio of the native levels of two such runs.
const DIRECT_STEPS: [f64; 2] = [0.5, 0.97];

/// A search for levels within error bounds.
pub struct Bounds<'a> {
    /// The shape.
    pub shape: &'a Shape,
    /// The description of the method.
    pub info: &'a MethodInfo,
    /// Native levels of its default comparison.
    pub sweep: &'a [f64],
    /// Starts the method.
    pub prepare: &'a Prepare<'a>,
    /// Measures results.
    pub measure: &'a Measure<'a>,
    /// The time for all searches: bounds that do not start have no result.
    pub budget: &'a Budget,
    /// Gets each bound before the search for it.
    pub searching: &'a dyn Fn(Target),
    /// Gets each level before it is tried.
    pub trying: &'a Trying<'a>,
}

impl Bounds<'_> {
    /// A run for each bound, from large to small, with the result of its search: `each` gets it before the next search
    /// begins. The seconds are those of the level found, without the search.
    ///
    /// # Errors
    /// When `each` fails.
    pub fn answer<E>(
        &self,
        bounds: &[f64],
        each: &mut dyn FnMut(LevelRun, Option<Found>) -> Result<(), E>,
    ) -> Result<(), E> {
        if self.info.native.as_ref().is_some_and(|native| native.is_error_bound) {
            return bounds.iter().try_for_each(|&bound| {
                (self.searching)(Target::MaxError(bound));
                let ended = self.budget.used_up().map_or_else(|| self.direct(bound), Err);
                self.budget.has_level.set(true);
                let (run, found) = ended.unwrap_or_else(|fault| (failed(bound, fault), None));
                each(run, found)
            });
        }
        // A separate view: substrates of the search are not those of the timed run.
        let view = self.shape.view();
        let begun = guarded(|| Ok((view.initial()?.spheres.len(), (self.prepare)(&view)?)));
        let (most, mut simplification) = match begun {
            Ok(begun) => begun,
            Err(fault) => {
                return bounds.iter().try_for_each(|&b| each(failed(b, fault.clone()), None));
            }
        };
        let mut search = Search::new(
            simplification.as_mut(),
            self.info.incremental,
            self.sweep,
            most,
            self.measure,
            self.trying,
        );
        let mut broken: Option<Fault> = None;
        // The loosest bound first: the levels tried for it help the others.
        for &bound in bounds {
            (self.searching)(Target::MaxError(bound));
            let ended = match broken.clone().or_else(|| self.budget.used_up()) {
                Some(fault) => Err(fault),
                None => self.searched(&mut search, bound),
            };
            self.budget.has_level.set(true);
            // A method that panicked is in an unknown state and must not be called again.
            broken = ended.as_ref().err().filter(|fault| fault.status == Status::Panicked).cloned();
            let (run, found) = ended.unwrap_or_else(|fault| (failed(bound, fault), None));
            each(run, found)?;
        }
        Ok(())
    }

    /// The run of a method that holds bounds by itself: its native level is the bound, and lower where its own
    /// measure of the error is below that of the result.
    fn direct(&self, bound: f64) -> Result<(LevelRun, Option<Found>), Fault> {
        let mut level = bound;
        let mut best: Option<Probe> = None;
        for tried in 1..=DIRECT_RUNS {
            (self.trying)(Level::Native(level))?;
            let run = self.timed(Level::Native(level), bound);
            let Ok(Simplified { mesh, .. }) = &run.outcome else { return Ok((run, None)) };
            let error = (self.measure)(mesh).map_err(SimplifyError::Level)?;
            let probe = Probe { level: Level::Native(level), spheres: mesh.spheres.len(), error };
            if error <= bound {
                return Ok((run, Some(Found { within: Some(probe), best: Some(probe), tried })));
            }
            best = [best, Some(probe)]
                .into_iter()
                .flatten()
                .min_by(|a, b| a.error.total_cmp(&b.error));
            let [least, most] = DIRECT_STEPS;
            level *= (bound / error).min(most).max(least);
            self.budget.has_level.set(true);
            if let Some(fault) = self.budget.used_up() {
                return Err(fault);
            }
        }
        let found = Found { within: None, best, tried: DIRECT_RUNS };
        Ok((missed(bound, &found, ""), Some(found)))
    }

    /// The run of the fewest spheres within a bound. Each level found runs alone, and another is searched if its
    /// result misses the bound then.
    fn searched(
        &self,
        search: &mut Search<'_>,
        bound: f64,
    ) -> Result<(LevelRun, Option<Found>), Fault> {
        loop {
            let mut found = guarded(|| search.within(bound))?;
            let Some(probe) = found.within else {
                let advice = ", or try another method, such as `tight`";
                return Ok((missed(bound, &found, advice), Some(found)));
            };
            let run = self.timed(probe.level, bound);
            let Ok(Simplified { mesh, .. }) = &run.outcome else { return Ok((run, Some(found))) };
            let alone = search.recheck(probe.level, mesh)?;
            if alone.error <= bound {
                found.within = Some(alone);
                return Ok((run, Some(found)));
            }
        }
    }

    /// The timed run of the level that a search found.
    fn timed(&self, level: Level, bound: f64) -> LevelRun {
        let view = self.shape.view();
        // Prepared again: the seconds must not profit from earlier probes.
        let budget = Budget::from_now(None);
        let runs = answer(&view, self.info, || (self.prepare)(&view), &[level], &budget, |_| {});
        let run = runs.into_iter().next().expect("one level, one run");
        LevelRun { level: Target::MaxError(bound), ..run }
    }
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use medial::Vec3;
    use medial::complex::{MedialMesh, Sphere};
    use medial::shape::ShapeOptions;
    use medial::simplifier::NativeLevel;
    use medial::surface::{Format, read_bytes};

    use super::*;

    /// A method that holds bounds by itself, but measures less than the search.
    #[test]
    fn a_bound_that_a_method_misses_by_a_little_is_tried_again_below() {
        let tetrahedron =
            b"OFF 4 4 6\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n";
        let loaded = read_bytes(tetrahedron, Format::Off).unwrap();
        let shape = Shape::new("tetrahedron", &loaded.mesh, loaded.report, ShapeOptions::default())
            .unwrap();
        let native =
            NativeLevel { is_error_bound: true, ..NativeLevel::larger_is_coarser("bound", "") };
        let info = MethodInfo { native: Some(native), ..MethodInfo::new("own", "Own bounds") };
        let prepare = preparing(|_| {
            let at = |level: Level| {
                let Level::Native(bound) = level else {
                    return Err(SimplifyError::unsupported("no"));
                };
                let sphere = Sphere { centre: Vec3::ZERO, radius: bound };
                let mesh = MedialMesh { spheres: vec![sphere], ..MedialMesh::default() };
                Ok(Simplified::new(mesh, level))
            };
            Ok(Box::new(at) as Box<dyn Simplification>)
        });
        for (ratio, tried) in [(1.0, 1), (1.01, 2), (1.3, 2)] {
            let found = Cell::new(None);
            let Ok(()) = Bounds {
                shape: &shape,
                info: &info,
                sweep: &[],
                prepare: &prepare,
                measure: &|mesh: &MedialMesh| Ok(ratio * mesh.spheres[0].radius),
                budget: &Budget::from_now(None),
                searching: &|_| {},
                trying: &|_| Ok(()),
            }
            .answer(&[0.1], &mut |run, result| {
                run.outcome.expect("a result");
                found.set(result);
                Ok::<_, Infallible>(())
            });
            let found = found.take().expect("searched");
            assert!(found.within.expect("met").error <= 0.1, "{ratio}");
            assert_eq!(found.tried, tried, "{ratio}");
        }
    }
}
