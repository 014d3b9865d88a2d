//! The coarsest level within an error bound, searched for every method alike.
//!
//! The error does not fall strictly with the number of spheres, and the finest level need not be
//! the best: initial medial meshes have flaws that methods repair. So a sweep comes first, and no bound is
//! refused that one of its levels meets.
//!
//! 1. A geometric sweep of counts, from that of the initial medial mesh down to ten, and the numbers
//!    below. A method that continues from finer levels computes all of them in one run, and they are
//!    measured from coarse to fine until one is within the bound. For any other method each level costs
//!    a run: every fourth count is tried, then those between that may be better.
//! 2. If none of them is within the bound, the method's native levels are tried: its default sweep, and
//!    the published one.
//! 3. Refinement between the fewest spheres within the bound and the next smaller count, and in those
//!    intervals of smaller counts whose ends are not far above the bound. For a method without counts it
//!    bisects native levels.
//!
//! A level that is found can have another result when it runs alone: a finer level came before it in the search. The
//! error that counts is that of the recorded result ([`Search::recheck`]), so no error stands for another mesh.
//! A coarser level between two counts that were tried can be missed.

use std::collections::BTreeMap;

use medial::complex::MedialMesh;
use medial::simplifier::{Level, Simplification, SimplifyError};

use crate::hash::mesh_hash;
use crate::text::percent;

/// Counts of the sweep for a method that computes them in one run, and for others.
const COUNTS: [usize; 2] = [40, 24];
/// Where the geometric part of the sweep ends.
const FEW: usize = 10;
/// For other methods, every `STRIDE`-th count is tried first.
const STRIDE: usize = 4;
/// A level with an error above this multiple of the bound has no level within the bound next to it.
const HOPELESS: f64 = 1.5;
/// Two counts with at most this ratio are not refined.
const CLOSE_COUNTS: f64 = 1.05;
/// Intervals of smaller counts that are refined.
const INTERVALS: usize = 3;
/// Bisections of native levels.
const BISECTIONS: usize = 7;

/// Measures a medial mesh: its error as a fraction of the diagonal.
pub type Measure<'a> = dyn Fn(&MedialMesh) -> Result<f64, String> + 'a;

/// Gets each level before it is tried; an error ends the search.
pub type Trying<'a> = dyn Fn(Level) -> Result<(), SimplifyError> + 'a;

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
    /// The fewest spheres within the bound; `None` if no tried level is within it.
    pub within: Option<Probe>,
    /// The tried level with the lowest error; `None` if the method had no result.
    pub best: Option<Probe>,
    /// Number of levels that were tried.
    pub tried: usize,
}

/// A search on one simplification. Later bounds reuse the earlier probes.
pub struct Search<'a> {
    simplification: &'a mut dyn Simplification,
    /// Whether coarser levels continue from finer ones.
    is_incremental: bool,
    measure: &'a Measure<'a>,
    trying: &'a Trying<'a>,
    probes: Vec<Probe>,
    /// Errors by the hash of the mesh. A method that stops above a count gives one mesh for all smaller ones.
    errors: BTreeMap<String, f64>,
    /// Results that were computed on the way to coarser ones and not yet measured.
    waiting: BTreeMap<usize, MedialMesh>,
    tried: usize,
    refusal: Option<SimplifyError>,
    /// The counts of the sweep, ascending.
    counts: Vec<usize>,
    native: Vec<Level>,
}

impl<'a> Search<'a> {
    /// A search among counts from `most` on and the native levels of `sweep`. `trying` gets each level
    /// before it is tried. `is_incremental`: coarser levels continue from finer ones.
    pub fn new(
        simplification: &'a mut dyn Simplification,
        is_incremental: bool,
        sweep: &[f64],
        most: usize,
        measure: &'a Measure<'a>,
        trying: &'a Trying<'a>,
    ) -> Self {
        let steps = COUNTS[usize::from(!is_incremental)] - 1;
        let ratio = (most as f64 / FEW as f64).max(1.0).powf(1.0 / steps as f64);
        let geometric = (0..=steps).map(|k| (most as f64 / ratio.powi(k as i32)).round() as usize);
        let mut counts: Vec<usize> = geometric.chain(1..FEW.min(most)).collect();
        counts.sort_unstable();
        counts.dedup();
        let native = sweep.iter().map(|&value| Level::Native(value)).chain([Level::Published]);
        Self {
            simplification,
            is_incremental,
            measure,
            trying,
            probes: Vec::new(),
            errors: BTreeMap::new(),
            waiting: BTreeMap::new(),
            tried: 0,
            refusal: None,
            counts,
            native: native.collect(),
        }
    }

    /// The fewest spheres found with an error of at most `bound`.
    ///
    /// # Errors
    /// The last error of the method or the measure, if no level gave a result.
    pub fn within(&mut self, bound: f64) -> Result<Found, SimplifyError> {
        let sweep = self.counts.clone();
        if self.is_incremental {
            self.ascend(&sweep, bound)?;
        } else {
            // The last one first: it is the start's, and the finest.
            let strided: Vec<usize> = sweep.iter().rev().copied().step_by(STRIDE).collect();
            self.ascend(&strided.into_iter().rev().collect::<Vec<_>>(), bound)?;
            let all = self.fewest(bound).is_none();
            let between = sweep.into_iter().filter(|&count| all || self.is_hopeful(count, bound));
            let between: Vec<usize> = between.collect();
            self.ascend(&between, bound)?;
        }
        // A method may take no counts, or reach lower errors at native levels.
        if self.fewest(bound).is_none() {
            for level in std::mem::take(&mut self.native) {
                self.probe(level)?;
            }
        }
        let takes_counts = self.probes.iter().any(|probe| matches!(probe.level, Level::Spheres(_)));
        match self.fewest(bound) {
            Some(Probe { level: Level::Native(_), .. }) if !takes_counts => {
                for _ in 0..BISECTIONS {
                    let Some(level) = self.between_levels(bound) else { break };
                    self.probe(level)?;
                }
            }
            Some(best) => {
                let refined = self.refined(best.spheres, bound);
                self.ascend(&refined, bound)?;
            }
            None => {}
        }
        let best = self.probes.iter().min_by(|a, b| a.error.total_cmp(&b.error)).copied();
        match (best, self.refusal.take()) {
            (None, Some(refusal)) => Err(refusal),
            _ => Ok(Found { within: self.fewest(bound), best, tried: self.tried }),
        }
    }

    /// Measures ascending counts until one is within the bound.
    fn ascend(&mut self, counts: &[usize], bound: f64) -> Result<(), SimplifyError> {
        let is_new = |search: &Self, count: usize| {
            let probed = search.probes.iter().any(|probe| probe.level == Level::Spheres(count));
            !probed && !search.waiting.contains_key(&count)
        };
        if self.is_incremental {
            // From fine to coarse: each level continues from the one before.
            for &count in counts.iter().rev() {
                if is_new(self, count)
                    && let Some(mesh) = self.compute(Level::Spheres(count))?
                {
                    self.waiting.insert(count, mesh);
                }
            }
        }
        for &count in counts {
            // Also for counts that were measured for another bound.
            if self.fewest(bound).is_some_and(|best| best.spheres <= count) {
                break;
            }
            match self.waiting.remove(&count) {
                Some(mesh) => self.measure(Level::Spheres(count), &mesh),
                None if !self.is_incremental && is_new(self, count) => {
                    self.probe(Level::Spheres(count))?;
                }
                None => {}
            }
        }
        Ok(())
    }

    /// Tries a level. If the method does not have it or has no result there, it is skipped.
    fn probe(&mut self, level: Level) -> Result<(), SimplifyError> {
        // The error of a level that was rechecked stays.
        if self.probes.iter().any(|probe| probe.level == level) {
            return Ok(());
        }
        if let Some(mesh) = self.compute(level)? {
            self.measure(level, &mesh);
        }
        Ok(())
    }

    fn compute(&mut self, level: Level) -> Result<Option<MedialMesh>, SimplifyError> {
        (self.trying)(level)?;
        self.tried += 1;
        match self.simplification.at(level) {
            Ok(simplified) if simplified.mesh.spheres.is_empty() => {
                self.refusal = Some(SimplifyError::Level(format!("{level} leaves no sphere")));
                Ok(None)
            }
            Ok(simplified) => Ok(Some(simplified.mesh)),
            // The only error that ends a search.
            Err(SimplifyError::Cancelled) => Err(SimplifyError::Cancelled),
            Err(refusal) => {
                self.refusal = Some(refusal);
                Ok(None)
            }
        }
    }

    fn measure(&mut self, level: Level, mesh: &MedialMesh) {
        match self.error(mesh) {
            Ok(error) => self.probes.push(Probe { level, spheres: mesh.spheres.len(), error }),
            Err(why) => self.refusal = Some(why),
        }
    }

    /// The error of a mesh. Equal meshes are measured once.
    fn error(&mut self, mesh: &MedialMesh) -> Result<f64, SimplifyError> {
        let hash = mesh_hash(mesh);
        if let Some(&error) = self.errors.get(&hash) {
            return Ok(error);
        }
        let error = (self.measure)(mesh).map_err(SimplifyError::Level)?;
        self.errors.insert(hash, error);
        Ok(error)
    }

    /// Replaces the result of a level by that of its own run, and returns it.
    ///
    /// # Errors
    /// When the mesh cannot be measured.
    pub fn recheck(&mut self, level: Level, mesh: &MedialMesh) -> Result<Probe, SimplifyError> {
        let probe = Probe { level, spheres: mesh.spheres.len(), error: self.error(mesh)? };
        self.probes.iter_mut().filter(|p| p.level == level).for_each(|p| *p = probe);
        Ok(probe)
    }

    fn fewest(&self, bound: f64) -> Option<Probe> {
        let within = self.probes.iter().filter(|probe| probe.error <= bound);
        within.min_by(|a, b| a.spheres.cmp(&b.spheres).then(a.error.total_cmp(&b.error))).copied()
    }

    /// Whether a count below the fewest within the bound may be within it, by the errors of the nearest
    /// measured counts.
    fn is_hopeful(&self, count: usize, bound: f64) -> bool {
        let below = self.probes.iter().filter(|probe| probe.spheres <= count);
        let above = self.probes.iter().filter(|probe| probe.spheres >= count);
        let next = [below.max_by_key(|p| p.spheres), above.min_by_key(|p| p.spheres)];
        next.into_iter().flatten().any(|probe| probe.error <= HOPELESS * bound)
    }

    /// Counts between those measured, ascending: below the fewest within a bound, and in smaller intervals
    /// that may hold one.
    fn refined(&self, fewest: usize, bound: f64) -> Vec<usize> {
        let mut measured: Vec<usize> = self.probes.iter().map(|probe| probe.spheres).collect();
        measured.retain(|&count| count <= fewest);
        measured.sort_unstable();
        measured.dedup();
        let mut refined = Vec::new();
        let intervals = measured.windows(2).rev().enumerate();
        for (k, pair) in intervals.take(1 + INTERVALS) {
            let (low, high) = (pair[0] as f64, pair[1] as f64);
            // The interval next to the fewest is worth it in any case, unless each level costs a run.
            let parts = (high / low).ln() / CLOSE_COUNTS.ln();
            let parts = if self.is_incremental { parts } else { parts.min(4.0) }.ceil() as usize;
            if k == 0 || self.is_incremental && self.is_hopeful(pair[0], bound) {
                let inner = (1..parts).map(|i| low * (high / low).powf(i as f64 / parts as f64));
                refined.extend(inner.map(|count| count.round() as usize));
            }
        }
        refined.sort_unstable();
        refined.dedup();
        refined.retain(|count| !measured.contains(count));
        refined
    }

    /// The native level between the fewest spheres within a bound and the next level beyond it.
    fn between_levels(&self, bound: f64) -> Option<Level> {
        let best = self.fewest(bound)?;
        let coarser = self.probes.iter().filter(|p| p.error > bound && p.spheres < best.spheres);
        let next = coarser.max_by_key(|probe| probe.spheres)?;
        let (Level::Native(value), Level::Native(beyond)) = (best.level, next.level) else {
            return None;
        };
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
        let best = self.best.map_or_else(String::new, |Probe { level, spheres, error }| {
            let at = match level {
                Level::Spheres(requested) if requested == spheres => format!("at {level}"),
                _ => format!("with {spheres} spheres (level {level})"),
            };
            format!(": the lowest error is {} {at}", percent(error))
        });
        format!(
            "none of {} levels that were tried has a Hausdorff error of at most {} of the diagonal{best}; \
             allow more, or sample more densely (`--sampling blue:N`)",
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

    /// The search on a method with a known error at each number of spheres; meshes differ only in
    /// their number of spheres.
    fn found(
        is_incremental: bool,
        most: usize,
        bound: f64,
        spheres_at: impl Fn(Level) -> Option<usize> + Send,
        error: impl Fn(usize) -> f64,
    ) -> Found {
        let mut method = move |level: Level| {
            let count = spheres_at(level).ok_or_else(|| SimplifyError::unsupported("no"))?;
            let sphere = |i: usize| Sphere { centre: Vec3::X * i as f64, radius: 1.0 };
            let spheres = (0..count).map(sphere).collect();
            let mesh = MedialMesh { spheres, ..MedialMesh::default() };
            Ok(Simplified::new(mesh, level))
        };
        let measure = |mesh: &MedialMesh| Ok(error(mesh.spheres.len()));
        let sweep = [1.0, 2.0, 4.0, 8.0];
        let mut search =
            Search::new(&mut method, is_incremental, &sweep, most, &measure, &|_| Ok(()));
        search.within(bound).expect("some level has a result")
    }

    #[test]
    fn meshes_with_the_same_number_of_spheres_are_measured_each() {
        // Every level has three spheres, at places of its own.
        let mut method = |level: Level| {
            let Level::Spheres(count) = level else { return Err(SimplifyError::unsupported("no")) };
            let sphere = |i: usize| Sphere { centre: Vec3::X * (count + i) as f64, radius: 1.0 };
            let spheres = (0..3).map(sphere).collect();
            Ok(Simplified::new(MedialMesh { spheres, ..MedialMesh::default() }, level))
        };
        let measure = |mesh: &MedialMesh| Ok(mesh.spheres[0].centre.x / 100.0);
        let mut search = Search::new(&mut method, false, &[], 100, &measure, &|_| Ok(()));
        let found = search.within(0.3).expect("some level has a result");
        let Probe { level: Level::Spheres(count), error, .. } = found.within.expect("met") else {
            panic!("{found:?}");
        };
        assert_eq!(error, count as f64 / 100.0);
        // The result of a run alone takes the place of the level's, so another level is searched.
        let spheres = vec![Sphere { centre: Vec3::X * 90.0, radius: 1.0 }];
        let other = MedialMesh { spheres, ..MedialMesh::default() };
        let alone = search.recheck(Level::Spheres(count), &other).expect("measured");
        assert_eq!((alone.spheres, alone.error), (1, 0.9));
        let next = search.within(0.3).expect("some level has a result").within;
        assert_ne!(next.expect("met").level, Level::Spheres(count));
    }

    fn counts(level: Level) -> Option<usize> {
        match level {
            Level::Spheres(count) => Some(count),
            _ => None,
        }
    }

    #[test]
    fn a_falling_error_is_met_to_within_five_per_cent() {
        for is_incremental in [false, true] {
            let found = found(is_incremental, 30_000, 0.01, counts, |count| 1.0 / count as f64);
            let within = found.within.expect("met");
            assert!((100..=110).contains(&within.spheres), "{within:?}");
            assert!(is_incremental || found.tried <= 20, "{}", found.tried);
        }
    }

    #[test]
    fn a_bad_start_is_no_reason_to_refuse() {
        // The finest levels are the worst: flaws of the start that the method mends.
        let error = |count: usize| if count > 1_000 { 0.12 } else { 1.0 / count as f64 };
        for is_incremental in [false, true] {
            let found = found(is_incremental, 30_000, 0.01, counts, error);
            assert!((100..=110).contains(&found.within.expect("met").spheres));
        }
    }

    /// A bound that one count of a dense sweep meets is met, with hardly more spheres.
    #[test]
    fn a_single_good_count_between_bad_ones_is_not_missed() {
        let most = 17_501_usize;
        let dense = |k: i32| {
            let ratio = (most as f64 / 10.0).powf(1.0 / 39.0);
            (most as f64 / ratio.powi(k)).round() as usize
        };
        for k in 0..40 {
            // The error rises and falls; only around one count is it within the bound.
            let error = |count: usize| {
                let apart = (count as f64 / dense(k) as f64).ln().abs();
                0.009 + 0.02 * (apart / 0.08).min(1.0)
            };
            let within = found(true, most, 0.01, counts, error).within.expect("met");
            assert!(within.spheres as f64 <= 1.1 * dense(k) as f64, "{k}: {within:?}");
        }
    }

    #[test]
    fn native_levels_are_tried_where_no_count_is_within() {
        let by_level = |level: Level| match level {
            Level::Native(value) => Some((5_000.0 / value) as usize),
            _ => None,
        };
        let found = found(false, 30_000, 0.001, by_level, |count| 1.0 / count as f64);
        let within = found.within.expect("met");
        assert!((1_000..=1_050).contains(&within.spheres), "{within:?}");
    }

    #[test]
    fn an_unmet_bound_names_the_lowest_error() {
        for is_incremental in [false, true] {
            let error = |count: usize| 0.02 + 1.0 / count as f64;
            let found = found(is_incremental, 1_000, 0.001, counts, error);
            assert_eq!(found.within, None);
            let why = found.refusal(0.001);
            assert!(why.contains("2.10 % at 1000 spheres;") && why.contains("0.100 %"), "{why}");
        }
    }
}
