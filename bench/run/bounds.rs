//! Error bounds as levels: a search, then a timed run of the level that it found.

use medial::shape::Shape;
use medial::simplifier::{Level, MethodInfo, Simplification, SimplifyError};
use medial_reports::{Status, Target};

use super::answer::guarded;
use super::search::{Measure, Search};
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
    /// A run for each bound, given from small to large. The seconds are those of the level found,
    /// without the search.
    pub fn answer(&self, bounds: &[f64]) -> Vec<LevelRun> {
        if bounds.is_empty() {
            return Vec::new();
        }
        let found =
            guarded(|| self.search(bounds)).unwrap_or_else(|fault| vec![Err(fault); bounds.len()]);
        let levels: Vec<Level> =
            found.iter().filter_map(|level| level.as_ref().ok()).copied().collect();
        let view = self.shape.view();
        let mut runs = match levels.is_empty() {
            true => Vec::new(),
            false => answer(&view, self.info, || (self.prepare)(&view), &levels, |_| {}),
        }
        .into_iter();
        let run = |(&bound, found): (&f64, Result<Level, Fault>)| {
            let level = Target::MaxError(bound);
            match found {
                Ok(_) => LevelRun { level, ..runs.next().expect("one for each level") },
                Err(fault) => LevelRun { level, outcome: Err(fault), times: Times::default() },
            }
        };
        bounds.iter().zip(found).map(run).collect()
    }

    /// The level for each bound.
    fn search(&self, bounds: &[f64]) -> Result<Vec<Result<Level, Fault>>, SimplifyError> {
        let view = self.shape.view();
        let most = view.initial()?.spheres.len();
        let mut simplification = (self.prepare)(&view)?;
        let mut search =
            Search::new(simplification.as_mut(), self.sweep, most, self.measure, &|_| {});
        let mut found = Vec::new();
        // The loosest bound first: the levels tried for it help the others.
        for &bound in bounds.iter().rev() {
            (self.searching)(Target::MaxError(bound));
            let result = search.within(bound)?;
            found.push(result.within.map(|probe| probe.level).ok_or_else(|| Fault {
                status: Status::BoundMissed,
                reason: result.refusal(bound),
            }));
        }
        found.reverse();
        Ok(found)
    }
}
