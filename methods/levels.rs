//! Meets a number of spheres by a knob other than the level: the density of the samples, or a dilation.
//!
//! 1. The first value is guessed by a power law between knob and spheres.
//! 2. The next values follow the same law from the nearest value so far, until two values bracket the
//!    count.
//! 3. Between them: the Illinois variant of regula falsi, on logarithms.
//! 4. Counts jump, because another number of samples means other samples. If the bracket has closed
//!    without the count, values around it are tried at growing distances.
//!
//! The search ends at a count of at most [`TOLERANCE`] below the requested one, after [`MAX_PROBES`]
//! values, or when no value is left to try. The result is the largest count met that does not exceed the
//! request. No value is tried twice.

use std::fmt::Debug;
use std::ops::{Bound, RangeBounds, RangeInclusive};

use medial::Vec3;
use medial::complex::collapse::CollapseComplex;
use medial::complex::{MedialMesh, Sphere};
use medial::shape::{Shape, ShapeError};
use medial::simplifier::{
    Diagnostics, Level, RunContext, Simplification, Simplified, SimplifyError,
};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::{Prepared, Result};

/// Shortfall of a count that ends the search, as a fraction. Comparisons at equal counts accept it.
const TOLERANCE: f64 = 0.02;

/// Limit of the values that are tried.
const MAX_PROBES: usize = 12;

/// Limit of the samples of a search. Bounds memory and time.
const MAX_SAMPLES: f64 = 50_000.0;

/// Longest step of step 2, as a factor.
const MAX_STEP: f64 = 16.0;

/// Relative difference below which two values have met.
const MET: f64 = 2e-3;

/// Distance of the first values of step 4, as a fraction.
const OUTWARD: f64 = 0.01;

/// The knob that a search turns.
pub(crate) struct Knob {
    /// Name under which the value is reported, times [`Knob::steps`].
    pub count: &'static str,
    /// The unit of the value, for messages.
    pub unit: &'static str,
    /// Values that can be tried.
    pub range: RangeInclusive<f64>,
    /// Steps in a unit: values are whole numbers divided by this.
    pub steps: f64,
    /// The first guess: `value` gives `rate * value^exponent` spheres.
    pub rate: f64,
    /// See [`Knob::rate`].
    pub exponent: f64,
}

impl Knob {
    /// The number of boundary samples of a shape.
    pub(crate) fn samples() -> Self {
        let range = 8.0..=MAX_SAMPLES;
        Self { count: "samples", unit: "samples", range, steps: 1.0, rate: 2.0, exponent: 1.0 }
    }

    fn snapped(&self, value: f64) -> f64 {
        let value = value.clamp(*self.range.start(), *self.range.end());
        (value * self.steps).round() / self.steps
    }

    /// The value at which the count should be met, at least one step from the only end so far.
    fn stepped(&self, end: End) -> f64 {
        let longest = MAX_STEP.ln();
        let by = (-end.excess / self.exponent).clamp(-longest, longest);
        let value = self.snapped(end.value * by.exp());
        let least = self.snapped(end.value - end.excess.signum() / self.steps);
        if end.excess > 0.0 { value.min(least) } else { value.max(least) }
    }
}

/// A result at one value of the knob.
pub(crate) struct Probe {
    /// Empty where nothing can be made at this value.
    pub mesh: MedialMesh,
    /// Counts and warnings of the method, of which the search has no part.
    pub diagnostics: Diagnostics,
}

/// A search by a knob.
pub(crate) struct SizeSearch {
    knob: Knob,
    run: RunContext,
}

impl SizeSearch {
    pub(crate) fn new(knob: Knob, run: &RunContext) -> Self {
        Self { knob, run: run.clone() }
    }

    /// The result with the nearest count from below that the search meets. `native` returns the native
    /// level of a value.
    ///
    /// # Errors
    /// Those of `make` that do not depend on the value; [`SimplifyError::Unsupported`] where no value tried
    /// gives a sphere.
    pub(crate) fn at(
        &self,
        count: usize,
        native: impl Fn(f64) -> f64,
        make: impl Fn(f64) -> Result<Probe>,
    ) -> Result<Simplified> {
        let mut path = Path::new(&self.knob, count);
        let mut best: Option<(f64, Probe)> = None;
        while let Some(value) = path.next {
            self.run.step(path.tried.len(), MAX_PROBES)?;
            let probe = or_empty(make(value))?;
            let size = probe.mesh.spheres.len();
            path.record(value, size);
            let is_better = best.as_ref().is_none_or(|(_, best)| {
                // Nothing is worst, then too many, then the distance from the count.
                let [new, old] = [size, best.mesh.spheres.len()]
                    .map(|size| (size == 0, size > count, size.abs_diff(count)));
                new < old
            });
            if is_better {
                best = Some((value, probe));
            }
        }
        let tried = path.tried.len();
        let (value, probe) = best.expect("at least one value is tried");
        let Probe { mesh, mut diagnostics } = probe;
        diagnostics.count(self.knob.count, (value * self.knob.steps).round() as usize);
        diagnostics.count("values_tried", tried);
        self.explain(count, value, mesh.spheres.len(), &mut diagnostics)?;
        let native_level = Some(native(value));
        Ok(Simplified { native_level, diagnostics, ..Simplified::new(mesh, Level::Spheres(count)) })
    }

    fn explain(
        &self,
        requested: usize,
        value: f64,
        reached: usize,
        diagnostics: &mut Diagnostics,
    ) -> Result<()> {
        let Knob { unit, range, .. } = &self.knob;
        let (least, most) = (range.start(), range.end());
        if reached == 0 {
            return Err(SimplifyError::unsupported(format!(
                "{requested} spheres: no result with {least} to {most} {unit}"
            )));
        }
        if reached == requested {
            return Ok(());
        }
        let why = if reached > requested {
            "fewer were not met".to_owned()
        } else if value == *most {
            format!("more than {most} are not tried")
        } else {
            "the nearest count from below that the search met".to_owned()
        };
        diagnostics
            .warn(format!("{reached} spheres instead of {requested}, at {value} {unit}: {why}"));
        Ok(())
    }
}

/// The values that a search tries for a count, one after the other.
struct Path<'a> {
    knob: &'a Knob,
    count: usize,
    tried: Vec<f64>,
    /// How often it has gone outward since both values met.
    outward: i32,
    /// The bracket: the largest value with at most the requested count, the smallest with more.
    below: Option<End>,
    above: Option<End>,
    last_was_above: Option<bool>,
    /// The value to try next.
    next: Option<f64>,
}

/// A value that was tried: logarithms of it, and of its count over the one aimed at.
#[derive(Clone, Copy)]
struct End {
    value: f64,
    excess: f64,
}

impl End {
    fn pulled(self, pull: f64) -> Self {
        Self { excess: pull * self.excess, ..self }
    }
}

impl<'a> Path<'a> {
    fn new(knob: &'a Knob, count: usize) -> Self {
        let first = (count as f64 / knob.rate).powf(1.0 / knob.exponent);
        let next = Some(knob.snapped(first));
        Self {
            knob,
            count,
            tried: Vec::new(),
            outward: 0,
            below: None,
            above: None,
            last_was_above: None,
            next,
        }
    }

    /// Takes the number of spheres at the value that was to try.
    fn record(&mut self, value: f64, size: usize) {
        self.tried.push(value);
        let is_above = size > self.count;
        if !is_above && size as f64 >= (1.0 - TOLERANCE) * self.count as f64 {
            self.next = None;
            return;
        }
        // Aims a little below the count, since a larger count is useless.
        let aim = (1.0 - TOLERANCE / 2.0) * self.count as f64;
        let end = End { value, excess: ((size as f64).max(0.5) / aim).ln() };
        // Illinois: an end that stays twice counts half.
        let pull = if self.last_was_above == Some(is_above) { 0.5 } else { 1.0 };
        if self.outward > 0 {
            // The values that have met stay where they are.
        } else if is_above {
            (self.above, self.below) = (Some(end), self.below.map(|end| end.pulled(pull)));
        } else {
            (self.below, self.above) = (Some(end), self.above.map(|end| end.pulled(pull)));
        }
        self.last_was_above = Some(is_above);
        self.next = if self.tried.len() < MAX_PROBES { self.proposed() } else { None };
    }

    fn proposed(&mut self) -> Option<f64> {
        match (self.below, self.above) {
            (Some(below), Some(above)) => self.between(below, above),
            (Some(end), None) | (None, Some(end)) => {
                Some(self.knob.stepped(end)).filter(|&value| value != end.value)
            }
            (None, None) => None,
        }
    }
}

impl Path<'_> {
    /// Steps 3 and 4.
    fn between(&mut self, below: End, above: End) -> Option<f64> {
        let steps = self.knob.steps;
        let have_met = above.value - below.value < (1.5 / steps).max(MET * below.value);
        if self.outward == 0 && !have_met {
            let share = (below.excess / (below.excess - above.excess)).clamp(0.1, 0.9);
            let [low, high] = [below, above].map(|end| end.value.ln());
            let value = self.knob.snapped((low + share * (high - low)).exp());
            let [first, last] = [below.value + 1.0 / steps, above.value - 1.0 / steps];
            return Some(self.knob.snapped(value.max(first).min(last)));
        }
        let around = (self.outward + 1..=self.outward + 2 * MAX_PROBES as i32).find_map(|turn| {
            let far = f64::from((turn + 1) / 2);
            let by = (far * OUTWARD * below.value).max(far / steps);
            let value = if turn % 2 == 1 { below.value - by } else { above.value + by };
            let value = self.knob.snapped(value);
            (!self.tried.contains(&value)).then_some((turn, value))
        });
        let (turn, value) = around?;
        self.outward = turn;
        Some(value)
    }
}

/// A result, or an empty one where there is nothing inside at this value: the search continues.
fn or_empty(result: Result<Probe>) -> Result<Probe> {
    match result {
        Err(
            SimplifyError::Unsupported { .. }
            | SimplifyError::Shape(
                ShapeError::EmptyMedialMesh
                | ShapeError::BelowResolution { .. }
                | ShapeError::Triangulation(_),
            ),
        ) => Ok(Probe { mesh: MedialMesh::default(), diagnostics: Diagnostics::default() }),
        result => result,
    }
}

// Methods that meet a number of spheres by the density of the samples.

/// Prepares a method on a shape.
type Prepare<'s> = Box<dyn Fn(&Shape) -> Prepared<'static> + Send + 's>;

/// A shape whose numbers of spheres are met by the number of its samples. All other levels are those of
/// its own samples. Nothing is kept between levels, so that each costs what it would cost alone.
pub(crate) struct BySamples<'s> {
    shape: &'s Shape,
    prepare: Prepare<'s>,
    search: SizeSearch,
    /// The native level of every number of spheres.
    native: f64,
}

impl<'s> BySamples<'s> {
    /// Builds the parts that all samplings share, the tree and the inside test of the surface, so that they
    /// count as substrates.
    ///
    /// # Errors
    /// When the surface has no face.
    pub(crate) fn new(
        shape: &'s Shape,
        native: f64,
        run: &RunContext,
        prepare: impl Fn(&Shape) -> Prepared<'static> + Send + 's,
    ) -> Result<Self> {
        shape.surface_tree()?;
        shape.inside_test();
        let search = SizeSearch::new(Knob::samples(), run);
        Ok(Self { shape, prepare: Box::new(prepare), search, native })
    }
}

impl Simplification for BySamples<'_> {
    fn at(&mut self, level: Level) -> Result<Simplified> {
        let Self { shape, prepare, search, native } = self;
        let Level::Spheres(count @ 1..) = level else {
            return prepare(shape)?.at(level);
        };
        search.at(
            count,
            |_| *native,
            |samples| {
                let sampling = shape.options().sampling.with_count(samples as usize);
                let mut prepared = prepare(&shape.resampled(sampling))?;
                let Simplified { mesh, diagnostics, .. } = prepared.at(Level::Native(*native))?;
                Ok(Probe { mesh, diagnostics })
            },
        )
    }
}

// Parameters and levels that have a range.

/// Refuses a parameter outside its range; a NaN is outside every one.
pub(crate) fn within<T: PartialOrd + Debug>(
    name: &str,
    value: T,
    range: impl RangeBounds<T>,
) -> Result<()> {
    outside(name, value, range).map_or(Ok(()), |why| Err(SimplifyError::Parameter(why)))
}

/// Refuses a native level outside its range, as [`within`].
pub(crate) fn level_within(name: &str, level: f64, range: impl RangeBounds<f64>) -> Result<f64> {
    outside(name, level, range).map_or(Ok(level), |why| Err(SimplifyError::Level(why)))
}

fn outside<T: PartialOrd + Debug>(
    name: &str,
    value: T,
    range: impl RangeBounds<T>,
) -> Option<String> {
    if range.contains(&value) {
        return None;
    }
    // An interval, because some ends are excluded, and the message has to name them.
    let least = match range.start_bound() {
        Bound::Included(least) => format!("[{least:?}"),
        Bound::Excluded(least) => format!("({least:?}"),
        Bound::Unbounded => "(-inf".to_owned(),
    };
    let most = match range.end_bound() {
        Bound::Included(most) => format!("{most:?}]"),
        Bound::Excluded(most) => format!("{most:?})"),
        Bound::Unbounded => "inf)".to_owned(),
    };
    Some(format!("{name} = {value:?} is outside {least}, {most}"))
}

/// Refuses a level of no sphere.
pub(crate) fn some_spheres(level: Level) -> Result<Level> {
    match level {
        Level::Spheres(0) => Err(SimplifyError::Level("0 spheres: expected at least 1".to_owned())),
        level => Ok(level),
    }
}

/// A result, once its mesh is known to be a valid complex.
pub(crate) fn checked(
    requested: Level,
    mesh: MedialMesh,
    native_level: Option<f64>,
    diagnostics: Diagnostics,
) -> Result<Simplified> {
    mesh.check()?;
    Ok(Simplified { native_level, diagnostics, ..Simplified::new(mesh, requested) })
}

/// Why no edge of a complex may be collapsed, for the user: the homotopy type, where it has to be kept, or folded
/// faces.
pub(crate) fn why_stopped(complex: &mut CollapseComplex, keeps_topology: bool) -> String {
    let edges: Vec<_> = complex.edges().collect();
    if edges.is_empty() {
        return "no edge is left, each sphere is a separate component".to_owned();
    }
    let mut is_held = |&&[a, b]: &&[u32; 2]| keeps_topology && !complex.keeps_homotopy(a, b);
    let by_topology = edges.iter().filter(|edge| is_held(edge)).count();
    format!(
        "the link condition holds back {by_topology} of the {} edges left, to keep the topology, and {} would \
         fold a face over",
        edges.len(),
        edges.len() - by_topology
    )
}

// Balls in general position, for methods on unions of polar balls.
//
// Polar balls meet in samples by construction, but only up to rounding, which decides at random which
// of them overlap there. With slightly larger radii and slightly moved centres, as in the authors' tool
// of the scale axis transform, they all overlap.

/// The balls with radii times `radius_factor` and centres moved by at most `jitter` radii along each
/// axis, each by its own random numbers in order.
pub(crate) fn perturbed(
    balls: &[Sphere],
    radius_factor: f64,
    jitter: f64,
    seed: u64,
) -> Vec<Sphere> {
    let mut rng = Pcg64::seed_from_u64(seed);
    balls
        .iter()
        .map(|ball| {
            let offset = Vec3::from([0; 3].map(|_| rng.random_range(-1.0..=1.0)));
            let centre = ball.centre + jitter * ball.radius * offset;
            Sphere::new(centre, ball.radius * radius_factor)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All values tried for a count, and the last size.
    fn search(knob: &Knob, count: usize, size: impl Fn(f64) -> usize) -> (Vec<f64>, usize) {
        let mut path = Path::new(knob, count);
        let (mut values, mut last) = (Vec::new(), 0);
        while let Some(value) = path.next {
            assert!(knob.range.contains(&value) && !values.contains(&value), "{value} {values:?}");
            values.push(value);
            last = size(value);
            path.record(value, last);
        }
        (values, last)
    }

    #[test]
    fn power_laws_with_noise_are_met_from_below_in_a_few_steps() {
        // A hash of the value, from -1 to 1.
        let noise = |v: f64| ((v * 12.9898).sin() * 43_758.547).fract();
        for (rate, exponent, steps) in [(0.2, 1.0, 1.0), (3.0, 0.8, 1.0), (0.4, 2.2, 1e3)] {
            let knob = Knob { steps, exponent: f64::round(exponent), ..Knob::samples() };
            for count in [300, 1000, 6_789] {
                let size =
                    |v: f64| (rate * v.powf(exponent) * (1.0 + 0.004 * noise(v))).round() as usize;
                let (values, last) = search(&knob, count, size);
                let near = last <= count && last as f64 >= 0.98 * count as f64;
                assert!(near && values.len() <= 8, "{rate} {exponent}: {values:?}, {last}");
            }
        }
    }

    #[test]
    fn a_search_ends_where_nothing_is_left_to_try() {
        let knob = Knob::samples();
        // As many as there can be, at once; none at all; always too many; a jump.
        assert_eq!(search(&knob, 1_000_000_000, |_| 5000).0, [MAX_SAMPLES]);
        assert_eq!(search(&knob, 100, |_| 0).0.last(), Some(&MAX_SAMPLES));
        assert_eq!(search(&knob, 100, |_| 5000).0.last(), Some(&8.0));
        let (values, _) = search(&knob, 100, |v| if v < 103.0 { 50 } else { 200 });
        assert!(values.contains(&102.0) && values.contains(&103.0), "{values:?}");
    }

    #[test]
    fn where_two_values_met_the_search_goes_on_around_them() {
        let knob = Knob::samples();
        // Falls where it should rise, and has the count only beyond.
        let size = |v: f64| match v as u32 {
            0..=260 => 480,
            264 => 495,
            _ => 2000,
        };
        let (values, last) = search(&knob, 500, size);
        assert_eq!(last, 495, "{values:?}");
    }
}
