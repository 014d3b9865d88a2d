//! Levenberg-Marquardt on all spheres at once, for sums of powers of the residuals.
//!
//! Minimises `sum_i w_i (x_i^p + mean h(x_i))` with `x = |error| / scale` and `h(x) = (x^2 + d^2)^(1/2) - d`, the error
//! itself but for small ones. With squares the mean error was a little larger. The second derivative of a power
//! keeps its factor `p - 1`, so a step is Newton's for residuals that are linear in the spheres.

use std::collections::HashSet;

use medial::Vec3;
use medial::complex::{MedialMesh, NearestPrimitive};
use medial::simplifier::RunContext;

use super::block_cholesky::{Normal, Pattern};
use super::goal::{
    self, CLOSEST, Edited, Goal, Held, Points, Residuals, Row, interpolated, nearest_after,
    nearest_balls, places, residuals, vertices,
};
use super::guard::{Guard, Still, clamp};
use super::part::Part;
use crate::Result;

/// Longest step of a sphere, a fraction of the diagonal.
const LONGEST: f64 = 0.02;

/// Smallest radius, a fraction of the diagonal.
pub(super) const LEAST_RADIUS: f64 = 1e-5;

/// Damping before the first step, as a share of the diagonal of the normal equations.
const FIRST_DAMPING: f64 = 1e-2;

/// Stiffness of a fixed sphere, in means of that diagonal.
const STIFF: f64 = 1e12;

/// Consecutive rejected steps that end the descent.
const REFUSED: usize = 4;

/// Rejected steps before the guarded spheres are no longer frozen. Until then they are, because the
/// other spheres cannot lower the objective where the step relied on them; later each rejection raises
/// the damping.
const FIXED: usize = 6;

/// Relative gain of the objective below which a step is the last.
const SMALL: f64 = 2e-2;

/// Powers, and the protrusion that is ignored from each on, as a share of the scale. It has next to no
/// weight there, and depths are the dearest residuals.
const TOLERATED: [(i32, f64); 2] = [(16, 0.5), (4, 0.3)];

/// Share of the scale below which errors count with their squares in the mean.
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

    /// Of places outside those whose nearest ball is not next to one that is watched: many can be of balls around one centre.
    ///
    /// # Errors
    /// When the mesh has no union.
    pub fn unwatched(&self, places: Vec<Vec3>) -> Result<Vec<Vec3>> {
        let Self { mesh, held, .. } = self;
        let cube = |held: &Held| {
            (interpolated(mesh, held).centre / CLOSEST).floor().to_array().map(|x| x as i64)
        };
        let mut centres: HashSet<[i64; 3]> = held.iter().map(cube).collect();
        let balls = nearest_balls(mesh, &places)?;
        let new = places.into_iter().zip(&balls).filter(|(_, ball)| centres.insert(cube(ball)));
        Ok(new.map(|(place, _)| place).collect())
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
        let Points { samples, interior, outside } = &self.points;
        let samples = others.samples[samples.len()..].to_vec();
        let interior = others.interior[interior.len()..].to_vec();
        let outside = others.outside[outside.len()..].to_vec();
        self.join(Points { samples, interior, outside })
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
