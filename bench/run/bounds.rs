//! Error bounds as levels: a search, then a timed run of the level that it found.

use std::io;

use medial::shape::Shape;
use medial::simplifier::{Level, MethodInfo, Simplification, SimplifyError};
use medial_reports::{Status, Target};

use super::answer::guarded;
use super::search::{Found, Measure, Search};
use super::{Fault, LevelRun, Times, answer};

/// Begins a simplification on a view.
pub type Prepare<'a> =
    dyn for<'v> Fn(&'v Shape) -> Result<Box<dyn Simplification + 'v>, SimplifyError> + 'a;

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
    /// Gets each bound before the search for it.
    pub searching: &'a dyn Fn(Target),
}

impl Bounds<'_> {
    /// A run for each bound, given from large to small: `each` gets it before the next search begins.
    /// The seconds are those of the level found, without the search.
    ///
    /// # Errors
    /// When `each` fails.
    pub fn answer(
        &self,
        bounds: &[f64],
        each: &mut dyn FnMut(LevelRun) -> io::Result<()>,
    ) -> io::Result<()> {
        let failed = |&bound: &f64, fault: &Fault| LevelRun {
            level: Target::MaxError(bound),
            outcome: Err(fault.clone()),
            times: Times::default(),
        };
        let view = self.shape.view();
        let begun = guarded(|| Ok((view.initial()?.spheres.len(), (self.prepare)(&view)?)));
        let (most, mut simplification) = match begun {
            Ok(begun) => begun,
            Err(fault) => return bounds.iter().try_for_each(|bound| each(failed(bound, &fault))),
        };
        let mut search =
            Search::new(simplification.as_mut(), self.sweep, most, self.measure, &|_| {});
        let mut broken: Option<Fault> = None;
        // The loosest bound first: the levels tried for it help the others.
        for bound in bounds {
            (self.searching)(Target::MaxError(*bound));
            let found = match &broken {
                Some(fault) => Err(fault.clone()),
                None => guarded(|| search.within(*bound)),
            };
            let run = match found {
                Ok(Found { within: Some(probe), .. }) => self.timed(probe.level, *bound),
                Ok(found) => {
                    let reason = found.refusal(*bound);
                    failed(bound, &Fault { status: Status::BoundMissed, reason })
                }
                Err(fault) => {
                    // A method that panicked is in no state to be asked again.
                    broken = (fault.status == Status::Panicked).then(|| fault.clone());
                    failed(bound, &fault)
                }
            };
            each(run)?;
        }
        Ok(())
    }

    /// The timed run of the level that a search found.
    fn timed(&self, level: Level, bound: f64) -> LevelRun {
        let view = self.shape.view();
        let runs = answer(&view, self.info, || (self.prepare)(&view), &[level], |_| {});
        let run = runs.into_iter().next().expect("one level, one run");
        LevelRun { level: Target::MaxError(bound), ..run }
    }
}
