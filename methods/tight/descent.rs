//! Levenberg-Marquardt on all spheres at once, for sums of powers of the residuals.
//!
//! Minimises `sum_i w_i (x_i^p + mean x_i^2)` with `x = |error| / scale`. The second derivative of a power
//! keeps its factor `p - 1`, so a step is Newton's for residuals that are linear in the spheres.

use medial::Vec3;
use medial::complex::MedialMesh;
use medial::simplifier::{RunContext, SimplifyError};

use super::goal::{Goal, Points};
use super::guard::{Guard, Still, clamp};
use super::normal::{Normal, Pattern};
use super::rows::{Held, Residuals, Row, places, residuals, vertices};

/// Largest step of a sphere.
const LONGEST: f64 = 0.02;

/// Least radius.
pub(super) const LEAST_RADIUS: f64 = 1e-5;

/// Damping before the first step, a share of the diagonal.
const FIRST_DAMPING: f64 = 1e-2;

/// What holds a fixed sphere, times the mean of the diagonal.
const STIFF: f64 = 1e12;

/// Steps that are refused one after the other before the descent ends.
const REFUSED: usize = 4;

/// A step that lessens the objective by a smaller share is the last.
const SMALL: f64 = 1e-3;

/// From this power on, balls may protrude by this share of the scale.
const HIGH: f64 = 4.0;
const TOLERATED: f64 = 0.1;

/// What is minimised.
#[derive(Clone, Copy, Debug)]
pub(super) struct Objective {
    /// Exponent, at least 2.
    pub power: f64,
    /// Weight of the squares beside it.
    pub mean: f64,
    /// Error that counts as 1.
    pub scale: f64,
}

impl Objective {
    /// A power alone.
    pub fn power(power: f64, scale: f64) -> Self {
        Self { power, mean: 0.0, scale }
    }

    fn value(&self, rows: &[Row]) -> f64 {
        let Self { power, mean, scale } = *self;
        let one = |row: &Row| {
            let x = row.error.abs() / scale;
            row.weight * (x.powf(power) + mean * x * x)
        };
        rows.iter().filter(|row| self.counts(row)).map(one).sum()
    }

    /// How far a ball may protrude: what hardly counts at a high power need not be looked for.
    fn tolerance(&self) -> f64 {
        if self.power >= HIGH { TOLERATED * self.scale } else { 0.0 }
    }

    fn counts(&self, row: &Row) -> bool {
        !row.protrudes || row.error > self.tolerance()
    }

    /// First derivative by the error over the error, and second derivative.
    fn derivatives(&self, row: &Row) -> (f64, f64) {
        let Self { power, mean, scale } = *self;
        let x = row.error.abs() / scale;
        let steep = power * x.powf(power - 2.0);
        let unit = row.weight / (scale * scale);
        (unit * (steep + 2.0 * mean), unit * (steep * (power - 1.0) + 2.0 * mean))
    }
}

/// What is around a part of a mesh; empty if there is nothing else.
#[derive(Default)]
pub(super) struct Rest {
    /// Spheres of the part that do not move.
    pub fixed: Vec<bool>,
    /// For each sample the distance of what is not in the part.
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
    /// Spheres that do not move; empty if all do.
    fixed: Vec<bool>,
    /// For each sample the distance of what is not in the mesh; empty if there is nothing else.
    limits: Vec<f64>,
    guard: Guard,
    pattern: Pattern,
    damping: f64,
}

impl<'a> Descent<'a> {
    /// Evaluates the residuals of a mesh, whose centres outside of the solid are first moved to the surface.
    /// Left to the first step, that jump would be in every trial, however small the step.
    ///
    /// # Errors
    /// When the mesh has no union.
    pub fn new(goal: &'a Goal, points: Points, mesh: MedialMesh) -> Result<Self, SimplifyError> {
        Self::of_part(goal, points, mesh, Rest::default(), 1.0)
    }

    /// As [`new`](Self::new), for a part of a mesh, which is a `share` of the whole.
    pub fn of_part(
        goal: &'a Goal,
        points: Points,
        mut mesh: MedialMesh,
        rest: Rest,
        share: f64,
    ) -> Result<Self, SimplifyError> {
        let Rest { fixed, limits, still } = rest;
        clamp(&mut mesh, goal);
        let mut held = places(&mesh, share);
        let residuals = residuals(&mesh, goal, &points, &limits, &[], 0.0, &mut held)?;
        let pattern = Pattern::new(mesh.spheres.len(), &mesh.edges);
        let guard = Guard::new(&mesh, still);
        let damping = FIRST_DAMPING;
        Ok(Self { goal, points, mesh, residuals, held, fixed, limits, guard, pattern, damping })
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

    /// Takes at most so many steps, each of which lessens the objective.
    ///
    /// # Errors
    /// When the run is cancelled.
    pub fn run(
        &mut self,
        objective: Objective,
        steps: usize,
        run: &RunContext,
    ) -> Result<(), SimplifyError> {
        let tolerance = objective.tolerance();
        self.residuals.rows.retain(|row| objective.counts(row));
        let mut value = self.value(&objective);
        let (mut done, mut refused, mut growth) = (0, 0, 2.0);
        let (mut normal, mut downhill) = self.assemble(&objective);
        while done < steps && refused < REFUSED {
            run.step(done, steps)?;
            let Some((trial, expected)) = self.trial(&normal, &downhill) else {
                self.damping *= 10.0;
                refused += 1;
                continue;
            };
            let Self { goal, points, limits, held, residuals: Residuals { nearest, .. }, .. } =
                self;
            let found = residuals(&trial, goal, points, limits, nearest, tolerance, held)?;
            let lower = objective.value(&found.rows);
            // A value that is not a number is not lower, so such a step is refused.
            if lower < value {
                let is_small = value - lower < SMALL * value;
                // Nielsen 1999: the better the model foretold it, the longer the next step.
                let told = ((value - lower) / expected).clamp(0.0, 1.0);
                self.damping *= (1.0 - (2.0 * told - 1.0).powi(3)).max(0.2);
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
            } else {
                self.damping *= growth;
                growth *= 2.0;
                refused += 1;
            }
        }
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

    /// The mesh after a damped step, kept within its limits, and by how much the model lessens the objective;
    /// `None` if there is no step.
    fn trial(&self, normal: &Normal, downhill: &[[f64; 4]]) -> Option<(MedialMesh, f64)> {
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
        let fixed = |v: usize| self.fixed.get(v).copied().unwrap_or(false);
        for (_, extra) in extra.iter_mut().enumerate().filter(|&(v, _)| fixed(v)) {
            *extra = [STIFF * mean; 4];
        }
        let step = normal.solve(&self.pattern, &extra, downhill)?;
        let expected = (step.iter().flatten())
            .zip(downhill.iter().flatten().zip(extra.iter().flatten()))
            .map(|(h, (down, extra))| 0.5 * h * (down + extra * h))
            .sum();
        let mut trial = self.mesh.clone();
        let moving = trial.spheres.iter_mut().zip(step).enumerate().filter(|&(v, _)| !fixed(v));
        for (_, (sphere, [x, y, z, r])) in moving {
            let length = (x * x + y * y + z * z + r * r).sqrt();
            let share = if length > LONGEST { LONGEST / length } else { 1.0 };
            sphere.centre += share * Vec3::new(x, y, z);
            sphere.radius = (sphere.radius + share * r).max(LEAST_RADIUS);
        }
        self.guard.hold(&self.mesh, &mut trial, self.goal);
        trial.check().is_ok().then_some((trial, expected))
    }
}
