//! The coarsest level within an error bound, searched for every method alike.
//!
//! The error does not fall strictly with the number of spheres, and the finest level need not be
//! the best: initial medial meshes have flaws that methods mend. So no bound is refused before several
//! levels were tried.
//!
//! 1. Counts are tried from that of the initial medial mesh downwards, each a fixed fraction of the
//!    one before.
//! 2. If none of them is within the bound, the method's own levels are tried: its sweep, and the
//!    published one.
//! 3. Bisection, on a logarithmic scale, between the fewest spheres within the bound and the next
//!    count that exceeds it. For a method without counts it uses the method's own levels.
//!
//! The level found is within the bound; a coarser one that happens to be within it can be missed.

use medial::complex::MedialMesh;
use medial::simplifier::{Level, Simplification, SimplifyError};

/// Counts tried at first.
const COUNTS: usize = 7;
/// The smallest factor between two of them.
const RATIO: f64 = 4.0;
/// Smallest count tried at first.
const MIN_SPHERES: f64 = 4.0;
/// Bisections per bound.
// With the levels of steps 1 and 2, at most 25 levels for a method with a sweep of ten.
const BISECTIONS: usize = 7;
/// Two counts with at most this ratio are not bisected.
const CLOSE_COUNTS: f64 = 1.02;

/// How a medial mesh is measured: its error as a fraction of the diagonal.
pub type Measure<'a> = dyn Fn(&MedialMesh) -> Result<f64, String> + 'a;

/// A level that was tried.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Probe {
    /// The level.
    pub level: Level,
    /// Spheres of the result.
    pub spheres: usize,
    /// Its error, a fraction of the diagonal.
    pub error: f64,
}

/// The result of a search for one bound.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// The fewest spheres within the bound; `None` where no level that was tried is.
    pub within: Option<Probe>,
    /// The lowest error of all that was tried; `None` where the method gave no result at all.
    pub best: Option<Probe>,
    /// Number of levels that were tried.
    pub tried: usize,
}

/// A search on one simplification; bounds that are asked later know what was tried before.
pub struct Search<'a> {
    simplification: &'a mut dyn Simplification,
    measure: &'a Measure<'a>,
    trying: &'a dyn Fn(Level),
    probes: Vec<Probe>,
    tried: usize,
    refusal: Option<SimplifyError>,
    counts: Vec<usize>,
    own: Vec<Level>,
}

impl<'a> Search<'a> {
    /// A search among counts from `most` on and the native levels of `sweep`. `trying` gets each level
    /// before it is tried.
    pub fn new(
        simplification: &'a mut dyn Simplification,
        sweep: &[f64],
        most: usize,
        measure: &'a Measure<'a>,
        trying: &'a dyn Fn(Level),
    ) -> Self {
        let ratio = (most as f64 / MIN_SPHERES).powf(1.0 / (COUNTS - 1) as f64).max(RATIO);
        // A geometric series: few probes cover all orders of magnitude from `most` down.
        let counts = (0..COUNTS)
            .map(|step| (most as f64 / ratio.powi(step as i32)).round() as usize)
            .filter(|&count| count >= most.min(MIN_SPHERES as usize))
            .collect();
        let sweep = sweep.iter().copied().map(Level::Native);
        let own = sweep.chain([Level::Published]).collect();
        let (probes, tried, refusal) = (Vec::new(), 0, None);
        Self { simplification, measure, trying, probes, tried, refusal, counts, own }
    }

    /// The fewest spheres found with an error of at most `bound`.
    ///
    /// # Errors
    /// The last error of the method or the measure, if no level gave a result.
    pub fn within(&mut self, bound: f64) -> Result<Found, SimplifyError> {
        // Taken: the next bound starts from these probes.
        for count in std::mem::take(&mut self.counts) {
            self.probe(Level::Spheres(count))?;
        }
        // A method may take no counts, or reach lower errors at levels of its own.
        if self.fewest(bound).is_none() {
            for level in std::mem::take(&mut self.own) {
                self.probe(level)?;
            }
        }
        for _ in 0..BISECTIONS {
            let Some(level) = self.fewest(bound).and_then(|best| self.between(best, bound)) else {
                break;
            };
            self.probe(level)?;
        }
        let best = self.probes.iter().min_by(|a, b| a.error.total_cmp(&b.error)).copied();
        match (best, self.refusal.take()) {
            (None, Some(refusal)) => Err(refusal),
            _ => Ok(Found { within: self.fewest(bound), best, tried: self.tried }),
        }
    }

    /// Tries a level. If the method does not have it or has no result there, it is skipped.
    fn probe(&mut self, level: Level) -> Result<(), SimplifyError> {
        (self.trying)(level);
        self.tried += 1;
        let mesh = match self.simplification.at(level) {
            Ok(simplified) if simplified.mesh.spheres.is_empty() => {
                let why = format!("{level} leaves no sphere");
                self.refusal = Some(SimplifyError::Level(why));
                return Ok(());
            }
            Ok(simplified) => simplified.mesh,
            // The only error that ends a search: the user wants no more.
            Err(SimplifyError::Cancelled) => return Err(SimplifyError::Cancelled),
            Err(refusal) => {
                self.refusal = Some(refusal);
                return Ok(());
            }
        };
        match (self.measure)(&mesh) {
            Ok(error) => self.probes.push(Probe { level, spheres: mesh.spheres.len(), error }),
            Err(why) => self.refusal = Some(SimplifyError::Level(why)),
        }
        Ok(())
    }

    fn fewest(&self, bound: f64) -> Option<Probe> {
        let within = self.probes.iter().filter(|probe| probe.error <= bound);
        within.min_by(|a, b| a.spheres.cmp(&b.spheres).then(a.error.total_cmp(&b.error))).copied()
    }

    /// The level to try between the fewest spheres within a bound and the next level beyond it.
    fn between(&self, best: Probe, bound: f64) -> Option<Level> {
        let takes_counts = self.probes.iter().any(|probe| matches!(probe.level, Level::Spheres(_)));
        match best.level {
            Level::Native(value) if !takes_counts => self.between_levels(value, best, bound),
            _ => self.between_counts(best, bound),
        }
    }

    fn between_counts(&self, best: Probe, bound: f64) -> Option<Level> {
        let asked = self.probes.iter().filter_map(|probe| match probe.level {
            // A method that stops above the count gives the same mesh for every smaller one.
            Level::Spheres(asked) if probe.error > bound && probe.spheres < best.spheres => {
                Some(asked.min(probe.spheres))
            }
            Level::Spheres(asked) if probe.spheres == best.spheres && asked < best.spheres => {
                Some(best.spheres)
            }
            _ => None,
        });
        // Nothing beyond was tried: one sphere is the coarsest there is.
        let beyond = asked.max().unwrap_or(1);
        // The geometric mean: errors fall by powers of the count.
        let middle = ((beyond * best.spheres) as f64).sqrt().round() as usize;
        let is_new = !self.probes.iter().any(|probe| probe.level == Level::Spheres(middle));
        let is_between = beyond < middle && middle < best.spheres;
        let is_apart = best.spheres as f64 > CLOSE_COUNTS * beyond as f64;
        (is_new && is_between && is_apart).then_some(Level::Spheres(middle))
    }

    fn between_levels(&self, value: f64, best: Probe, bound: f64) -> Option<Level> {
        let coarser = self.probes.iter().filter(|p| p.error > bound && p.spheres < best.spheres);
        let next = coarser.max_by_key(|probe| probe.spheres)?;
        let Level::Native(beyond) = next.level else { return None };
        // Levels that can be 0 or negative have no geometric mean.
        let middle = if value > 0.0 && beyond > 0.0 {
            (value * beyond).sqrt()
        } else {
            value.midpoint(beyond)
        };
        let is_apart = best.spheres as f64 > CLOSE_COUNTS * next.spheres as f64;
        (is_apart && middle != value && middle != beyond).then_some(Level::Native(middle))
    }
}

impl Found {
    /// The message for a bound that no level meets.
    pub fn refusal(&self, bound: f64) -> String {
        let percent = |fraction: f64| format!("{:.3} %", 100.0 * fraction);
        let best = self.best.map_or_else(String::new, |Probe { level, spheres, error }| {
            let count = match level {
                Level::Spheres(asked) if asked == spheres => String::new(),
                _ => format!(", which has {spheres} spheres"),
            };
            format!(": the lowest error is {} at {level}{count}", percent(error))
        });
        format!(
            "none of {} levels that were tried has a Hausdorff error of at most {} of the diagonal{best}; \
             allow more, or sample more densely (`--sampling auto`)",
            self.tried,
            percent(bound)
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use medial::Vec3;
    use medial::complex::{MedialMesh, Sphere};
    use medial::simplifier::Simplified;

    /// A method whose error at each number of spheres is given; meshes are told apart by their
    /// number of spheres alone.
    fn found(
        most: usize,
        bound: f64,
        answers: impl Fn(Level) -> Option<usize> + Send,
        error: impl Fn(usize) -> f64,
    ) -> Found {
        let mut method = move |level: Level| {
            let count = answers(level).ok_or_else(|| SimplifyError::unsupported("no"))?;
            let sphere = |i: usize| Sphere { centre: Vec3::X * i as f64, radius: 1.0 };
            let spheres = (0..count).map(sphere).collect();
            let mesh = MedialMesh { spheres, ..MedialMesh::default() };
            Ok(Simplified::new(mesh, level))
        };
        let measure = |mesh: &MedialMesh| Ok(error(mesh.spheres.len()));
        let mut search = Search::new(&mut method, &[1.0, 2.0, 4.0, 8.0], most, &measure, &|_| {});
        search.within(bound).expect("some level has a result")
    }

    fn counts(level: Level) -> Option<usize> {
        match level {
            Level::Spheres(count) => Some(count),
            _ => None,
        }
    }

    #[test]
    fn a_falling_error_is_met_to_within_two_per_cent() {
        let found = found(30_000, 0.01, counts, |count| 1.0 / count as f64);
        let within = found.within.expect("met");
        assert!((100..=102).contains(&within.spheres), "{within:?}");
        assert!(found.tried <= 25, "{}", found.tried);
    }

    #[test]
    fn a_bad_start_is_no_reason_to_refuse() {
        // The finest levels are the worst: flaws of the start that the method mends.
        let error = |count: usize| if count > 1_000 { 0.12 } else { 1.0 / count as f64 };
        let found = found(30_000, 0.01, counts, error);
        assert!((100..=102).contains(&found.within.expect("met").spheres));
    }

    #[test]
    fn own_levels_are_tried_where_no_count_is_within() {
        let by_level = |level: Level| match level {
            Level::Native(value) => Some((5_000.0 / value) as usize),
            _ => None,
        };
        let found = found(30_000, 0.001, by_level, |count| 1.0 / count as f64);
        let within = found.within.expect("met");
        assert!((1_000..=1_030).contains(&within.spheres), "{within:?}");
        assert!(found.tried <= 25);
    }

    #[test]
    fn what_is_beyond_reach_is_said_with_the_best() {
        let found = found(1_000, 0.001, counts, |count| 0.02 + 1.0 / count as f64);
        assert_eq!(found.within, None);
        let why = found.refusal(0.001);
        assert!(why.contains("2.100 % at 1000 spheres;") && why.contains("0.100 %"), "{why}");
    }
}
