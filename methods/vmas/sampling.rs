//! The rounds of cluster, refit, correct and split.

use medial::complex::{MedialMesh, Sphere};
use medial::simplifier::{RunContext, SimplifyError};
use rayon::prelude::*;

use super::cluster::{Clusters, NONE, assign, drop_small};
use super::connect::{edges, faces};
use super::correct::Solid;
use super::energy::Energy;
use super::params::{Connect, Points, VmasParams};
use super::points::SurfacePoints;
use super::refit::refit;
use super::residuals::Residuals;
use super::shrinking_ball::{Ball, End};
use super::split::{misfits, to_split};

/// A round whose total error changes by less than this is at rest; a fraction of the squared longest side.
const AT_REST: f64 = 1e-5;

/// Spheres are split every so many rounds, at rest or not.
const SPLIT_EVERY: usize = 10;

/// A refit ends with a step shorter than this, a fraction of the longest side.
const SHORTEST_STEP: f64 = 1e-8;

/// Rounds with splits that may pass without more spheres than ever before: clusters of new spheres that are
/// dropped at once would keep the number below the target for ever.
const PATIENCE: usize = 20;

/// The spheres so far.
pub(super) struct VariationalSampling<'a> {
    points: &'a SurfacePoints,
    solid: &'a Solid<'a>,
    energy: Energy,
    residuals: Residuals,
    params: VmasParams,
    pub spheres: Vec<Sphere>,
    /// For each point its sphere.
    pub labels: Vec<u32>,
    pub tally: Tally,
}

/// What happened on the way.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Tally {
    pub iterations: usize,
    pub splits: usize,
    pub dropped: usize,
    /// Shrinking balls, and those of them that reached the step limit or stopped at a point in front of
    /// the surface.
    pub balls: usize,
    pub at_the_step_limit: usize,
    pub in_front: usize,
    /// Fitted spheres that no ball could be found for; they stayed as they were.
    pub uncorrected: usize,
    /// The sum of `E_s` of the last round, in squared diagonals.
    pub total_error: f64,
}

/// Why the rounds ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ended {
    /// The target is reached and the error at rest.
    AtRest,
    /// New spheres are dropped as fast as they are made.
    Stalled,
    /// All rounds were made.
    IterationLimit,
}

impl<'a> VariationalSampling<'a> {
    /// With one sphere: the ball of sample 0 (CGAL), or the largest ball of a vertex (the authors).
    pub fn new(points: &'a SurfacePoints, solid: &'a Solid<'a>, params: VmasParams) -> Self {
        let energy = Energy { lambda: params.lambda };
        let residuals = Residuals::new(points, energy, params.refit);
        let labels = vec![NONE; points.len()];
        let mut tally = Tally::default();
        let ball = match params.points {
            Points::Samples => solid.ball_at(points, points.first as usize),
            Points::Vertices => largest_ball(points, solid),
        };
        ball.iter().for_each(|ball| tally.count(ball));
        // Any sphere will do: the first refit leaves nothing of it but its basin of attraction.
        let somewhere = || Sphere::new(points.positions[points.first as usize], 0.0);
        let spheres = vec![ball.map_or_else(somewhere, |ball| ball.sphere)];
        Self { points, solid, energy, residuals, params, spheres, labels, tally }
    }

    /// Rounds until there are `target` spheres, at rest.
    ///
    /// # Errors
    /// When the run is cancelled.
    pub fn run(&mut self, target: usize, run: &RunContext) -> Result<Ended, SimplifyError> {
        let at_rest = AT_REST * self.solid.side * self.solid.side;
        let (mut most, mut without_gain) = (0, 0);
        let last = self.params.iterations - 1;
        for round in 0..=last {
            run.step(self.spheres.len().min(target), target)?;
            let clusters = self.cluster();
            self.refit_and_correct(&clusters);
            let misfits = misfits(self.points, self.energy, &self.spheres, &clusters);
            let total: f64 = misfits.iter().map(|misfit| misfit.mean).sum();
            let change = (total - self.tally.total_error).abs();
            self.tally.total_error = total;
            self.tally.iterations = round + 1;
            let missing = target.saturating_sub(self.spheres.len());
            if missing == 0 && change < at_rest {
                return Ok(Ended::AtRest);
            }
            if missing == 0 || round == last || (change >= at_rest && round % SPLIT_EVERY != 0) {
                continue;
            }
            without_gain = if self.spheres.len() > most { 0 } else { without_gain + 1 };
            if without_gain == PATIENCE {
                return Ok(Ended::Stalled);
            }
            most = most.max(self.spheres.len());
            let joined = edges(self.points, &self.labels);
            for sphere in to_split(&misfits, &joined, missing) {
                self.split(misfits[sphere as usize].worst);
            }
        }
        Ok(Ended::IterationLimit)
    }

    /// Step 1.
    fn cluster(&mut self) -> Clusters {
        assign(self.points, self.energy, &self.spheres, &mut self.labels);
        let before = self.spheres.len();
        // The authors drop fewer than 4 points, CGAL fewer than 5.
        let least = if self.params.points == Points::Vertices { 4 } else { 5 };
        let clusters = drop_small(&mut self.spheres, &mut self.labels, least);
        self.tally.dropped += before - self.spheres.len();
        clusters
    }

    /// Steps 2 and 3.
    fn refit_and_correct(&mut self, clusters: &Clusters) {
        let Self { points, solid, residuals, .. } = self;
        let shortest = SHORTEST_STEP * solid.side;
        let of_sphere = |(s, &sphere): (usize, &Sphere)| {
            let fitted = refit(points, residuals, clusters.of(s), sphere, shortest);
            solid.corrected(points, fitted.centre)
        };
        let balls: Vec<Option<Ball>> = self.spheres.par_iter().enumerate().map(of_sphere).collect();
        for (sphere, ball) in self.spheres.iter_mut().zip(balls) {
            match ball {
                Some(ball) => {
                    self.tally.count(&ball);
                    *sphere = ball.sphere;
                }
                None => self.tally.uncorrected += 1,
            }
        }
    }

    /// Step 5: the sphere stays; the medial ball of the worst point of its cluster joins it.
    fn split(&mut self, worst: u32) {
        if let Some(ball) = self.solid.ball_at(self.points, worst as usize) {
            self.tally.count(&ball);
            self.tally.splits += 1;
            self.spheres.push(ball.sphere);
        }
    }

    /// The complex of the last round's clusters.
    ///
    /// # Errors
    /// When a sphere is not valid.
    pub fn mesh(&self, connect: Connect) -> Result<MedialMesh, SimplifyError> {
        let edges = edges(self.points, &self.labels);
        let faces = faces(self.points, &self.labels, &edges, connect);
        Ok(MedialMesh::from_simplices(self.spheres.clone(), edges, faces)?)
    }
}

impl Tally {
    fn count(&mut self, ball: &Ball) {
        self.balls += 1;
        self.at_the_step_limit += usize::from(ball.end == End::StepLimit);
        self.in_front += usize::from(ball.end == End::InFront);
    }
}

/// The largest medial ball of a point, that of the smallest id of equal ones.
fn largest_ball(points: &SurfacePoints, solid: &Solid<'_>) -> Option<Ball> {
    let balls: Vec<Option<Ball>> =
        (0..points.len()).into_par_iter().map(|v| solid.ball_at(points, v)).collect();
    let balls = balls.into_iter().flatten().rev();
    balls.max_by(|a, b| a.sphere.radius.total_cmp(&b.sphere.radius))
}
