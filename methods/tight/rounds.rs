//! The last rounds: higher and higher powers, with witnesses of the largest errors joining in between.
//!
//! 1. Steps at the powers 4 and 8.
//! 2. Rounds: the places of the largest errors join the samples as witnesses, then steps at the power 16
//!    or 32 plus `lambda` times the mean. Witnesses are found by local ascent and a sweep on both sides, and
//!    among the points inside.
//! 3. Swaps of a few spheres, and later of one, from the best state so far. Only the spheres around them move at
//!    first; where that lowers the sum of the powers all spheres take a step, and the error is measured. If it is
//!    little larger than before, its places join as witnesses, and a few more steps follow: without this, most swaps
//!    that lower the errors at samples fail by an error between them.
//! 4. Rounds as in 2, with the witnesses that were found meanwhile.
//!
//! The result is the state of the least measured error.

use std::collections::{BTreeSet, HashSet};

use medial::Vec3;
use medial::complex::{MedialMesh, NearestPrimitive};
use medial::metrics::PeakSearch;
use medial::simplifier::{Diagnostics, RunContext};

use super::collapse::{Guard, Part, Still, clamp};
use super::goal::{
    self, ASIDE, DEEP, Edited, Goal, Held, Interior, Points, Residuals, Row, Sample, held_from,
    nearest_after, nearest_balls, places, refused, residuals, uncovered, union_of, vertices,
};
use super::start::swapped;
use super::{TightParams, is_far};
use crate::Result;

/// Powers and steps before the first round.
const WARM: [(i32, usize); 2] = [(4, 9), (8, 14)];

/// Power of the first two rounds, and of all others.
const POWERS: [i32; 2] = [16, 32];

/// Steps of a round.
const STEPS: usize = 8;

/// Errors above this share of the largest are witnesses.
const WITNESS: f64 = 0.6;

/// Most witnesses that a round takes of each kind, the largest errors first.
const WITNESSES: usize = 300;

/// Of witnesses in a cube of this side one is enough, on the surface, on the union's boundary, and inside: the errors
/// of the others are hardly different. On the boundary, each one outside means a ball that is watched from then on.
const APART: [f64; 3] = [0.001, 0.002, 0.001];

/// A round that lowers the error by a smaller share did not help.
const GAIN: f64 = 0.01;

/// A state that is worse than this many times the best is pushed as if it were no worse: its steps would be too
/// timid otherwise.
const WORSE: f64 = 1.15;

/// Rounds without a gain that end the rounds.
const PATIENCE: usize = 2;

/// Most swaps that are tried, and swaps of one sphere without a gain, one after the other, that end the search.
const SWAPS: usize = 24;
const FAILURES: usize = 6;

/// One of this number of spheres is swapped at first, later fewer, and then one at a time.
const SPHERES: usize = 25;

/// A swap that raises the objective more than this many times is given up before all spheres take steps.
const HOPELESS: f64 = 2.0;

/// Steps of all spheres after a swap, and more of them if its error is less than this many times the least.
const AFTER: [usize; 2] = [1, 4];
const CHANCE: f64 = 1.6;

/// A swap that leaves the error within this many times the least, at another place, is kept if the objective is less
/// than this many times what it was.
const EQUAL: f64 = 1.002;
const LOWER: f64 = 0.97;

/// Interior points deeper than this many times the error count alike.
const DEEPER: f64 = 3.0;

/// The last rounds on one goal.
pub(super) struct Polish<'a> {
    pub goal: &'a Goal,
    pub params: &'a TightParams,
    pub run: &'a RunContext,
    /// Whether connectivity may change.
    pub swaps: bool,
    /// The error bound, if there is one: far from it no swaps follow.
    pub bound: Option<f64>,
}

/// A mesh with its measured error.
#[derive(Clone)]
pub(super) struct State {
    pub mesh: MedialMesh,
    pub error: f64,
}

impl<'a> Polish<'a> {
    /// Runs all rounds.
    ///
    /// # Errors
    /// When the run is cancelled, or the mesh cannot be measured.
    pub fn run(
        &self,
        mut descent: Descent<'a>,
        mut witnesses: Witnesses<'a>,
        diagnostics: &mut Diagnostics,
    ) -> Result<State> {
        for (power, steps) in WARM {
            descent.run(Objective::power(power, descent.largest()), steps, self.run)?;
        }
        let error = witnesses.measure(&mut descent, f64::INFINITY)?;
        let (mut best, points) = self.rounds(descent, error, &mut witnesses)?;
        if self.swaps && !self.bound.is_some_and(|bound| is_far(bound, best.error)) {
            let from = self.at(&best, points)?;
            let (from, helped) = self.swapped(from, &mut best, &mut witnesses)?;
            diagnostics.count("swaps_that_helped", helped);
            // With all the witnesses that were found meanwhile.
            let (again, _) = self.rounds(from, best.error, &mut witnesses)?;
            if again.error < best.error {
                best = again;
            }
        }
        Ok(best)
    }

    /// A descent from a state.
    fn at(&self, state: &State, mut points: Points) -> Result<Descent<'a>> {
        points.deep = DEEP.min(DEEPER * state.error);
        Descent::new(self.goal, points, state.mesh.clone())
    }

    /// Step 2. Returns the best state, and the points with all witnesses.
    fn rounds(
        &self,
        from: Descent<'a>,
        mut error: f64,
        witnesses: &mut Witnesses<'_>,
    ) -> Result<(State, Points)> {
        let mut best = State { mesh: from.mesh, error };
        let mut descent = self.at(&best, from.points)?;
        let mut idle = 0;
        for round in 0..self.params.rounds {
            let power = POWERS[usize::from(round >= 2)];
            let objective = self.objective(power, error.min(WORSE * best.error));
            descent.run(objective, STEPS, self.run)?;
            error = witnesses.measure(&mut descent, f64::INFINITY)?;
            idle = if error < (1.0 - GAIN) * best.error { 0 } else { idle + 1 };
            if error < best.error {
                best = State { mesh: descent.mesh.clone(), error };
            }
            if idle > PATIENCE {
                break;
            }
        }
        Ok((best, descent.points))
    }

    /// Step 3, from the best state. Returns the new one with all witnesses, and how many swaps helped.
    fn swapped(
        &self,
        mut from: Descent<'a>,
        best: &mut State,
        witnesses: &mut Witnesses<'_>,
    ) -> Result<(Descent<'a>, usize)> {
        let mut each = (best.mesh.spheres.len() / SPHERES).max(1);
        let (mut skipped, mut idle, mut helped) = (0, 0, 0);
        for _ in 0..SWAPS {
            let objective = self.objective(POWERS[1], best.error);
            let trial = swapped(&from, each, skipped, self.run)?;
            let mut error = f64::INFINITY;
            let mut is_kept = false;
            if let Some(mut trial) = trial {
                error = self.tried(&mut trial, from.value(&objective), best.error, witnesses)?;
                is_kept = error < best.error;
                if !is_kept {
                    from.join_new_of(&trial.points)?;
                    // The largest error is at another place, which is next.
                    is_kept = error <= EQUAL * best.error
                        && trial.value(&objective) < LOWER * from.value(&objective);
                }
                if is_kept {
                    from = trial;
                }
            }
            if error < (1.0 - GAIN) * best.error {
                idle = 0;
            } else if each == 1 {
                idle += 1;
            }
            if error < best.error {
                *best = State { mesh: from.mesh.clone(), error };
            }
            if is_kept {
                (helped, skipped) = (helped + 1, 0);
            } else if each > 1 {
                // Fewer at once, then one at another place.
                each /= 2;
            } else {
                skipped += 1;
            }
            if idle >= FAILURES {
                break;
            }
        }
        Ok((from, helped))
    }

    /// The measured error after a swap and steps of all spheres; infinite if the value is not below `value`.
    ///
    /// Where it is little larger than the least so far, mostly at places without a sample, the witnesses of these
    /// places join, and a few steps more are taken.
    fn tried(
        &self,
        trial: &mut Descent<'a>,
        value: f64,
        least: f64,
        witnesses: &mut Witnesses<'_>,
    ) -> Result<f64> {
        let objective = self.objective(POWERS[1], least);
        // A value that is not a number is not below.
        let is_below = |trial: &Descent<'_>, times: f64| trial.value(&objective) < times * value;
        if !is_below(trial, HOPELESS) {
            return Ok(f64::INFINITY);
        }
        trial.run(objective, AFTER[0], self.run)?;
        if !is_below(trial, 1.0) {
            return Ok(f64::INFINITY);
        }
        let mut error = witnesses.measure(trial, least)?;
        if error >= least && error < CHANCE * least {
            trial.run(objective, AFTER[1], self.run)?;
            error = witnesses.measure(trial, least)?;
        }
        Ok(error)
    }

    /// A little below the error counts as one, so that larger ones weigh heavily.
    fn objective(&self, power: i32, error: f64) -> Objective {
        Objective { power, mean: self.params.lambda, scale: 0.9 * error }
    }
}

/// The search for the places of the largest errors.
pub(super) struct Witnesses<'a> {
    goal: &'a Goal,
    search: PeakSearch<'a>,
    /// Cubes of the sides [`APART`] that have a witness of a kind.
    seen: HashSet<(u8, [i64; 3])>,
}

impl<'a> Witnesses<'a> {
    /// # Errors
    /// When the surface has no area.
    pub fn new(goal: &'a Goal) -> Result<Self> {
        let search = goal.peaks().map_err(refused)?;
        Ok(Self { goal, search, seen: HashSet::new() })
    }

    /// The error of a mesh, both ways. Where it is large, samples join. Both surfaces are swept unless an ascent finds
    /// an error of `swept_below`.
    ///
    /// # Errors
    /// When the mesh has no union.
    pub fn measure(&mut self, descent: &mut Descent<'_>, swept_below: f64) -> Result<f64> {
        let Self { goal, search, .. } = self;
        let deep = descent.points.deep;
        let peaks = search.of(&descent.mesh, swept_below).map_err(refused)?;
        let pool: Vec<Vec3> = goal.pool.iter().map(|inside| inside.point).collect();
        let enough = |i: usize| Some(held_from(goal.pool[i].depth.min(deep)));
        let nearest = union_of(&descent.mesh)?.deepest_batch_near(&pool, &[], enough);
        let signed: Vec<f64> = nearest.iter().map(|nearest| nearest.signed).collect();
        // The union's boundary at a distance `sigma` from a point that it does not hold is as deep as that
        // point, less `sigma`. This finds pockets that samples of the boundary miss.
        let pockets = goal.pool.iter().zip(&signed).filter(|&(_, &signed)| signed > 0.0);
        let pockets = pockets.map(|(inside, signed)| inside.depth - signed);
        let error = pockets.fold(peaks.hausdorff(), f64::max);
        let [forward, reverse] = [&peaks.forward, &peaks.reverse].map(|peaks| {
            let large = peaks.iter().take_while(|peak| peak.distance > WITNESS * error);
            large.map(|peak| peak.point).collect()
        });
        let mut gaps: Vec<(f64, Vec3)> = (self.goal.pool.iter().zip(&signed))
            .map(|(inside, &signed)| (uncovered(inside.depth.min(deep), signed), inside.point))
            .filter(|&(gap, _)| gap > WITNESS * error)
            .collect();
        gaps.sort_by(|x, y| y.0.total_cmp(&x.0));
        let on_surface = self.new_ones(0, forward);
        let samples = on_surface.into_iter().map(|point| Sample { point, weight: 1.0 }).collect();
        let exposed = self.new_ones(1, reverse);
        let gaps = self.new_ones(2, gaps.into_iter().map(|(_, point)| point).collect());
        // Boundary inside the solid is a pocket. Boundary outside protrudes.
        let weights = exposed.iter().map(|_| 1.0).chain(gaps.iter().map(|_| ASIDE));
        let places = [&exposed[..], &gaps].concat();
        let depths = self.goal.depths(&places).into_iter().map(|depth| depth.value);
        let places = places.into_iter().zip(depths).zip(weights);
        let places = places.map(|((point, depth), weight)| Interior { point, depth, weight });
        let (interior, outside): (Vec<_>, Vec<_>) = places.partition(|place| place.depth > 0.0);
        let outside = outside.into_iter().map(|place| place.point).collect();
        descent.join(Points { samples, interior, outside, deep })?;
        Ok(error)
    }

    /// The first witnesses of a kind, of each cube one.
    fn new_ones(&mut self, kind: u8, points: Vec<Vec3>) -> Vec<Vec3> {
        let new = points.into_iter().filter(|&point| {
            let cube = (point / APART[usize::from(kind)]).floor().to_array().map(|x| x as i64);
            self.seen.insert((kind, cube))
        });
        new.take(WITNESSES).collect()
    }
}

// ----------------------------------------------------------------------------
// Levenberg-Marquardt on all spheres at once, for sums of powers of the residuals.
//
// Minimises `sum_i w_i (x_i^p + mean h(x_i))` with `x = |error| / scale` and `h(x) = (x^2 + d^2)^(1/2) - d`, the error
// itself but for small ones. With squares the mean error was a little larger. The second derivative of a power
// keeps its factor `p - 1`, so a step is Newton's for residuals that are linear in the spheres.

/// Largest step of a sphere.
const LONGEST: f64 = 0.02;

/// Least radius.
pub(super) const LEAST_RADIUS: f64 = 1e-5;

/// Damping before the first step, a share of the diagonal.
const FIRST_DAMPING: f64 = 1e-2;

/// Stiffness of a fixed sphere, times the mean of the diagonal.
const STIFF: f64 = 1e12;

/// Steps that are refused one after the other before the descent ends.
const REFUSED: usize = 4;

/// Refused steps of a descent after which the spheres that the guard took back are fixed instead of raising the
/// damping: the other spheres cannot lower the objective where the step relied on these.
const FIXED: usize = 6;

/// A step that lessens the objective by a smaller share is the last.
const SMALL: f64 = 2e-2;

/// From each of these powers on, balls may protrude by a share of the scale. They have next to no weight there, and
/// depths are the dearest residuals.
const TOLERATED: [(i32, f64); 2] = [(16, 0.5), (4, 0.3)];

/// Errors that are small by this share of the scale count with their squares in the mean.
const ROUNDED: f64 = 0.2;

fn rounded(x: f64) -> f64 {
    (x * x + ROUNDED * ROUNDED).sqrt()
}

/// The objective.
#[derive(Clone, Copy, Debug)]
pub(super) struct Objective {
    /// Exponent, at least 2.
    pub power: i32,
    /// Weight of the mean error.
    pub mean: f64,
    /// Error that counts as 1.
    pub scale: f64,
}

impl Objective {
    /// A power alone.
    pub fn power(power: i32, scale: f64) -> Self {
        Self { power, mean: 0.0, scale }
    }

    fn value(&self, rows: &[Row]) -> f64 {
        let Self { power, mean, scale } = *self;
        let counted = rows.iter().filter(|row| self.counts(row)).map(|row| {
            let x = row.error.abs() / scale;
            row.weight * (x.powi(power) + mean * (rounded(x) - ROUNDED))
        });
        counted.sum()
    }

    /// How far a ball may protrude: protrusions without weight at a high power are not searched.
    fn tolerance(&self) -> f64 {
        let found = TOLERATED.iter().find(|&&(power, _)| self.power >= power);
        found.map_or(0.0, |&(_, share)| share * self.scale)
    }

    fn counts(&self, row: &Row) -> bool {
        !row.protrudes || row.error > self.tolerance()
    }

    /// First derivative by the error over the error, and second derivative.
    fn derivatives(&self, row: &Row) -> (f64, f64) {
        let Self { power, mean, scale } = *self;
        let x = row.error.abs() / scale;
        let steep = f64::from(power) * x.powi(power - 2);
        let unit = row.weight / (scale * scale);
        // Of the mean the curvature that keeps its model above it.
        let flat = mean / rounded(x);
        (unit * (steep + flat), unit * (steep * f64::from(power - 1) + flat))
    }
}

/// The surroundings of a part of a mesh; may be empty.
#[derive(Default)]
pub(super) struct Rest {
    /// Spheres of the part that do not move.
    pub fixed: Vec<bool>,
    /// For each sample the distance of everything outside the part.
    pub limits: Vec<f64>,
    /// Faces that are not in the part.
    pub still: Still,
}

/// A medial mesh of fixed connectivity whose spheres move.
pub(super) struct Descent<'a> {
    pub goal: &'a Goal,
    pub points: Points,
    pub mesh: MedialMesh,
    pub residuals: Residuals,
    held: Vec<Held>,
    /// How many of those are spread over the mesh: the others are at places outside.
    spread: usize,
    /// Spheres that do not move.
    fixed: Vec<bool>,
    /// For each sample the distance of everything outside the mesh; may be empty.
    limits: Vec<f64>,
    pub guard: Guard,
    pattern: Pattern,
    damping: f64,
    /// Balls that protrude by less have no residual.
    tolerance: f64,
}

impl<'a> Descent<'a> {
    /// Evaluates the residuals of a mesh, whose centres outside of the solid are first moved to the surface.
    /// Left to the first step, that jump would be in every trial, however small the step.
    ///
    /// # Errors
    /// When the mesh has no union.
    pub fn new(goal: &'a Goal, points: Points, mesh: MedialMesh) -> Result<Self> {
        Self::of_part(goal, points, mesh, Rest::default(), 1.0)
    }

    /// As [`new`](Self::new), for a part of a mesh, which is a `share` of the whole.
    pub fn of_part(
        goal: &'a Goal,
        points: Points,
        mut mesh: MedialMesh,
        rest: Rest,
        share: f64,
    ) -> Result<Self> {
        clamp(&mut mesh, goal);
        let nearest = goal::nearest(&mesh, &points, &[])?;
        let held = places(&mesh, share, |_| true);
        Self::of_parts(goal, points, mesh, nearest, (held, 0.0), rest)
    }

    /// The descent of an edited mesh, with the same points; `of` has for each sphere its number in this one.
    ///
    /// # Errors
    /// When the mesh has no union.
    pub fn edited(&self, mut mesh: MedialMesh, of: &[Option<u32>]) -> Result<Self> {
        let Self { goal, points, residuals, held, spread, .. } = self;
        clamp(&mut mesh, goal);
        let edited = Edited { before: &self.mesh, mesh: &mesh, of };
        let moved = edited.moved();
        let kept = edited.kept(&moved);
        let part = Part::of(&mesh, &moved);
        let nearest = nearest_after(&mesh, &part, &kept, points, &residuals.nearest)?;
        let mut watched = places(&mesh, 1.0, |corners| corners.iter().any(|&v| moved[v as usize]));
        watched.extend(held[..*spread].iter().filter_map(|held| {
            let primitive = kept.of(held.primitive)?;
            Some(Held { primitive, ..*held })
        }));
        let watched = (watched, self.tolerance);
        Self::of_parts(goal, points.clone(), mesh, nearest, watched, Rest::default())
    }

    fn of_parts(
        goal: &'a Goal,
        points: Points,
        mesh: MedialMesh,
        nearest: Vec<NearestPrimitive>,
        (mut held, tolerance): (Vec<Held>, f64),
        rest: Rest,
    ) -> Result<Self> {
        let Rest { mut fixed, limits, still } = rest;
        fixed.resize(mesh.spheres.len(), false);
        let spread = held.len();
        held.extend(nearest_balls(&mesh, &points.outside)?);
        let residuals = residuals(&mesh, goal, &points, &limits, nearest, tolerance, &mut held);
        let pattern = Pattern::new(mesh.spheres.len(), &mesh.edges);
        let guard = Guard::new(&mesh, still);
        let damping = FIRST_DAMPING;
        Ok(Self {
            goal,
            points,
            mesh,
            residuals,
            held,
            spread,
            fixed,
            limits,
            guard,
            pattern,
            damping,
            tolerance,
        })
    }

    /// Adds points, with their residuals, to the descent of a whole mesh.
    ///
    /// # Errors
    /// When the mesh has no union.
    pub fn join(&mut self, more: Points) -> Result<()> {
        let Self { goal, points, mesh, held, residuals: Residuals { rows, nearest }, .. } = self;
        if more.samples.is_empty() && more.interior.is_empty() && more.outside.is_empty() {
            return Ok(());
        }
        let mut watched = nearest_balls(mesh, &more.outside)?;
        let near = goal::nearest(mesh, &more, &[])?;
        let mut found = residuals(mesh, goal, &more, &[], near, self.tolerance, &mut watched);
        held.extend(watched);
        rows.append(&mut found.rows);
        let of_interior = found.nearest.split_off(more.samples.len());
        let at = points.samples.len();
        nearest.splice(at..at, found.nearest);
        nearest.extend(of_interior);
        points.samples.extend(more.samples);
        points.interior.extend(more.interior);
        points.outside.extend(more.outside);
        Ok(())
    }

    /// Adds the points that others have more.
    ///
    /// # Errors
    /// When the mesh has no union.
    pub fn join_new_of(&mut self, others: &Points) -> Result<()> {
        let Points { samples, interior, outside, deep } = &self.points;
        let samples = others.samples[samples.len()..].to_vec();
        let interior = others.interior[interior.len()..].to_vec();
        let outside = others.outside[outside.len()..].to_vec();
        self.join(Points { samples, interior, outside, deep: *deep })
    }

    /// The largest error of a residual.
    pub fn largest(&self) -> f64 {
        let errors = self.residuals.rows.iter().map(|row| row.error.abs());
        errors.fold(f64::MIN_POSITIVE, f64::max)
    }

    /// The value of an objective.
    pub fn value(&self, objective: &Objective) -> f64 {
        objective.value(&self.residuals.rows)
    }

    /// Takes at most `steps` steps, each of which lessens the objective.
    ///
    /// # Errors
    /// When the run is cancelled.
    pub fn run(&mut self, objective: Objective, steps: usize, run: &RunContext) -> Result<()> {
        let tolerance = objective.tolerance();
        if tolerance < self.tolerance {
            let Self { goal, points, mesh, limits, held, residuals: found, .. } = self;
            let nearest = std::mem::take(&mut found.nearest);
            *found = residuals(mesh, goal, points, limits, nearest, tolerance, held);
        }
        self.tolerance = tolerance;
        self.residuals.rows.retain(|row| objective.counts(row));
        let mut value = self.value(&objective);
        let (mut done, mut refused, mut growth) = (0, 0, 2.0);
        let (fixed, mut times_fixed) = (self.fixed.clone(), 0);
        let (mut normal, mut downhill) = self.assemble(&objective);
        while done < steps && refused < REFUSED {
            run.step(done, steps)?;
            let Some((trial, expected, taken_back)) = self.trial(&normal, &downhill) else {
                self.damping *= 10.0;
                refused += 1;
                continue;
            };
            let Self { goal, points, limits, held, residuals: Residuals { nearest, .. }, .. } =
                self;
            let nearest = goal::nearest(&trial, points, nearest)?;
            let found = residuals(&trial, goal, points, limits, nearest, tolerance, held);
            let lower = objective.value(&found.rows);
            // A value that is not a number is not lower, so such a step is refused.
            if lower < value {
                let is_small = value - lower < SMALL * value;
                // Nielsen 1999: the better the model predicted it, the longer the next step.
                let gain = ((value - lower) / expected).clamp(0.0, 1.0);
                self.damping *= (1.0 - (2.0 * gain - 1.0).powi(3)).max(0.2);
                growth = 2.0;
                (self.mesh, self.residuals, value) = (trial, found, lower);
                self.damping = self.damping.max(1e-9);
                (done, refused) = (done + 1, 0);
                if is_small {
                    break;
                }
                if done < steps {
                    (normal, downhill) = self.assemble(&objective);
                }
            } else if !taken_back.is_empty() && times_fixed < FIXED {
                taken_back.into_iter().for_each(|v| self.fixed[v as usize] = true);
                times_fixed += 1;
            } else {
                self.damping *= growth;
                growth *= 2.0;
                refused += 1;
            }
        }
        self.fixed = fixed;
        self.damping = self.damping.clamp(1e-6, 1.0);
        Ok(())
    }

    /// The normal equations of the residuals, and minus their gradient.
    fn assemble(&self, objective: &Objective) -> (Normal, Vec<[f64; 4]>) {
        let mut normal = Normal::zero(&self.pattern);
        let mut downhill = vec![[0.0; 4]; self.mesh.spheres.len()];
        for row in &self.residuals.rows {
            let (first, second) = objective.derivatives(row);
            let (corners, count) = vertices(&self.mesh, row.primitive);
            for i in 0..count {
                let (v, a) = (corners[i] as usize, row.weights[i]);
                // A foot on a side of a slab has a weight of zero.
                if a == 0.0 {
                    continue;
                }
                let slope = first * row.error * a;
                for (entry, d) in downhill[v].iter_mut().zip(row.direction) {
                    *entry -= slope * d;
                }
                for j in i..count {
                    let scale = second * a * row.weights[j];
                    if scale != 0.0 {
                        let pattern = &self.pattern;
                        normal.add(pattern, corners[i], corners[j], scale, &row.direction);
                    }
                }
            }
        }
        (normal, downhill)
    }

    /// The mesh after a damped step, kept within its limits, by how much the model lessens the objective, and the
    /// spheres that the guard took back; `None` if there is no step.
    fn trial(&self, normal: &Normal, downhill: &[[f64; 4]]) -> Option<(MedialMesh, f64, Vec<u32>)> {
        let spheres = self.mesh.spheres.len();
        let mut trace = 0.0;
        let mut extra: Vec<[f64; 4]> = (0..spheres as u32)
            .map(|v| {
                let diagonal = normal.diagonal(&self.pattern, v);
                trace += diagonal.iter().sum::<f64>();
                diagonal.map(|entry| self.damping * entry)
            })
            .collect();
        // Spheres that serve no sample have no equation of their own.
        let mean = trace / (4 * spheres) as f64;
        let least = 1e-6 * mean + f64::MIN_POSITIVE;
        extra.iter_mut().flatten().for_each(|entry| *entry += least);
        for (_, extra) in extra.iter_mut().enumerate().filter(|&(v, _)| self.fixed[v]) {
            *extra = [STIFF * mean; 4];
        }
        let step = normal.solve(&self.pattern, &extra, downhill)?;
        let expected = (step.iter().flatten())
            .zip(downhill.iter().flatten().zip(extra.iter().flatten()))
            .map(|(h, (down, extra))| 0.5 * h * (down + extra * h))
            .sum();
        let mut trial = self.mesh.clone();
        let moving = trial.spheres.iter_mut().zip(step).enumerate();
        let moving = moving.filter(|&(v, _)| !self.fixed[v]);
        for (_, (sphere, [x, y, z, r])) in moving {
            let length = (x * x + y * y + z * z + r * r).sqrt();
            let share = if length > LONGEST { LONGEST / length } else { 1.0 };
            sphere.centre += share * Vec3::new(x, y, z);
            sphere.radius = (sphere.radius + share * r).max(LEAST_RADIUS);
        }
        let taken_back = self.guard.hold(&self.mesh, &mut trial, self.goal);
        trial.check().is_ok().then_some((trial, expected, taken_back))
    }
}

// ----------------------------------------------------------------------------
// The normal equations: a sparse symmetric matrix of 4 x 4 blocks, and its Cholesky factorisation.
//
// One block row for each sphere `(x, y, z, r)`, one block for each sphere and each edge of the medial
// mesh. Spheres are eliminated in the order of least degree, which keeps the fill of such complexes,
// sheets and curves, small.
//
// By hand because the only kept crate with a sparse Cholesky of a free licence (`faer`) brings some 140
// others, and because blocks of four make the code short: no entry is looked up on its own.

/// A 4 x 4 block, by rows.
pub(super) type Block = [[f64; 4]; 4];

const ZERO: Block = [[0.0; 4]; 4];

/// Where the blocks of the factor are: found once for each connectivity.
#[derive(Clone, Debug)]
pub(super) struct Pattern {
    /// The vertex that is eliminated at each step.
    order: Vec<u32>,
    /// The step at which each vertex is eliminated.
    step: Vec<u32>,
    /// For each step the later steps with a block in its column, ascending.
    columns: Vec<Vec<u32>>,
}

impl Pattern {
    /// The pattern of a graph. Cost: the fill, times its logarithm.
    pub fn new(vertices: usize, edges: &[[u32; 2]]) -> Self {
        let mut around = vec![BTreeSet::new(); vertices];
        for &[a, b] in edges {
            around[a as usize].insert(b);
            around[b as usize].insert(a);
        }
        let mut queue: BTreeSet<(usize, u32)> =
            (0..vertices as u32).map(|v| (around[v as usize].len(), v)).collect();
        let mut order = Vec::with_capacity(vertices);
        let mut fill = Vec::with_capacity(vertices);
        while let Some((_, v)) = queue.pop_first() {
            let link = std::mem::take(&mut around[v as usize]);
            // Neighbours of an eliminated vertex become adjacent to each other.
            for &w in &link {
                let set = &mut around[w as usize];
                queue.remove(&(set.len(), w));
                set.remove(&v);
                set.extend(link.iter().filter(|&&other| other != w));
                queue.insert((set.len(), w));
            }
            order.push(v);
            fill.push(link);
        }
        let mut step = vec![0; vertices];
        for (k, &v) in (0..).zip(&order) {
            step[v as usize] = k;
        }
        let columns = fill.iter().map(|link| {
            let mut column: Vec<u32> = link.iter().map(|&w| step[w as usize]).collect();
            column.sort_unstable();
            column
        });
        let columns = columns.collect();
        Self { order, step, columns }
    }
}

/// A symmetric matrix with a pattern.
pub(super) struct Normal {
    diagonal: Vec<Block>,
    below: Vec<Vec<Block>>,
}

impl Normal {
    /// The zero matrix.
    pub fn zero(pattern: &Pattern) -> Self {
        let below = pattern.columns.iter().map(|column| vec![ZERO; column.len()]).collect();
        Self { diagonal: vec![ZERO; pattern.order.len()], below }
    }

    /// Adds `scale * direction directionᵀ` to the block of two vertices that are equal or adjacent.
    /// Of two different vertices one order is enough.
    #[inline]
    pub fn add(&mut self, pattern: &Pattern, v: u32, w: u32, scale: f64, direction: &[f64; 4]) {
        let [i, j] = [v, w].map(|v| pattern.step[v as usize]);
        let block = if i == j {
            &mut self.diagonal[i as usize]
        } else {
            let (i, j) = (i.min(j) as usize, i.max(j));
            let place = pattern.columns[i].binary_search(&j).expect("the two are adjacent");
            &mut self.below[i][place]
        };
        // Symmetric blocks: the transposed one is the same.
        add_product(block, scale, direction);
    }

    /// The diagonal entries of a vertex.
    pub fn diagonal(&self, pattern: &Pattern, v: u32) -> [f64; 4] {
        let block = &self.diagonal[pattern.step[v as usize] as usize];
        [0, 1, 2, 3].map(|k| block[k][k])
    }

    /// The solution `x` of `(A + diag(extra)) x = b`, each by vertex; `None` if the matrix is not
    /// positive definite.
    pub fn solve(
        &self,
        pattern: &Pattern,
        extra: &[[f64; 4]],
        b: &[[f64; 4]],
    ) -> Option<Vec<[f64; 4]>> {
        let steps = pattern.order.len();
        let (mut diagonal, mut below) = (self.diagonal.clone(), self.below.clone());
        for (k, &v) in pattern.order.iter().enumerate() {
            for (c, extra) in extra[v as usize].iter().enumerate() {
                diagonal[k][c][c] += extra;
            }
        }
        for k in 0..steps {
            let lower = cholesky(&diagonal[k])?;
            diagonal[k] = lower;
            let mut panel = std::mem::take(&mut below[k]);
            panel.iter_mut().for_each(|block| *block = divided(block, &lower));
            let rows = &pattern.columns[k];
            for (p, &i) in rows.iter().enumerate() {
                subtract_product(&mut diagonal[i as usize], &panel[p], &panel[p]);
                let column = &pattern.columns[i as usize];
                // Both lists ascend, and the column of `i` has every later row of this one.
                let mut place = 0;
                for (q, &j) in rows.iter().enumerate().skip(p + 1) {
                    while column[place] != j {
                        place += 1;
                    }
                    subtract_product(&mut below[i as usize][place], &panel[q], &panel[p]);
                }
            }
            below[k] = panel;
        }
        let mut x: Vec<[f64; 4]> = pattern.order.iter().map(|&v| b[v as usize]).collect();
        for k in 0..steps {
            x[k] = forward(&diagonal[k], x[k]);
            let known = x[k];
            for (&i, block) in pattern.columns[k].iter().zip(&below[k]) {
                for (value, row) in x[i as usize].iter_mut().zip(block) {
                    *value -= dot(row, &known);
                }
            }
        }
        for k in (0..steps).rev() {
            let mut value = x[k];
            for (&i, block) in pattern.columns[k].iter().zip(&below[k]) {
                for (row, known) in block.iter().zip(x[i as usize]) {
                    for (value, entry) in value.iter_mut().zip(row) {
                        *value -= entry * known;
                    }
                }
            }
            x[k] = backward(&diagonal[k], value);
        }
        let mut solution = vec![[0.0; 4]; steps];
        for (k, &v) in pattern.order.iter().enumerate() {
            solution[v as usize] = x[k];
        }
        Some(solution)
    }
}

/// `block += scale * direction directionᵀ`.
#[inline]
pub(super) fn add_product(block: &mut Block, scale: f64, direction: &[f64; 4]) {
    for (line, x) in block.iter_mut().zip(direction) {
        for (entry, y) in line.iter_mut().zip(direction) {
            *entry += scale * x * y;
        }
    }
}

/// The lower triangular factor of a block, or `None` if it is not positive definite.
pub(super) fn cholesky(block: &Block) -> Option<Block> {
    let mut lower = ZERO;
    for i in 0..4 {
        for j in 0..=i {
            let rest = block[i][j] - (0..j).map(|k| lower[i][k] * lower[j][k]).sum::<f64>();
            if i != j {
                lower[i][j] = rest / lower[j][j];
            } else if rest > 0.0 {
                lower[i][i] = rest.sqrt();
            } else {
                return None;
            }
        }
    }
    Some(lower)
}

/// `B L⁻ᵀ`.
fn divided(block: &Block, lower: &Block) -> Block {
    block.map(|row| forward(lower, row))
}

/// `target -= A Bᵀ`.
#[inline]
fn subtract_product(target: &mut Block, a: &Block, b: &Block) {
    for (row, a) in target.iter_mut().zip(a) {
        for (entry, b) in row.iter_mut().zip(b) {
            *entry -= dot(a, b);
        }
    }
}

#[inline]
fn dot(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
}

/// The solution of `L x = b`.
#[inline]
pub(super) fn forward(lower: &Block, mut b: [f64; 4]) -> [f64; 4] {
    for i in 0..4 {
        let known: f64 = (0..i).map(|k| lower[i][k] * b[k]).sum();
        b[i] = (b[i] - known) / lower[i][i];
    }
    b
}

/// The solution of `Lᵀ x = b`.
#[inline]
pub(super) fn backward(lower: &Block, mut b: [f64; 4]) -> [f64; 4] {
    for i in (0..4).rev() {
        let known: f64 = (i + 1..4).map(|k| lower[k][i] * b[k]).sum();
        b[i] = (b[i] - known) / lower[i][i];
    }
    b
}
