//! The rounds of cluster, refit, correct and split.

use std::sync::Arc;

use medial::Vec3;
use medial::complex::{MedialMesh, Sphere};
use medial::shape::{Shape, ShapeError};
use medial::simplifier::RunContext;
use medial::surface::{InsideTest, Side, TriangleBvh, shrinking_ball};
use rayon::prelude::*;

use super::energy::{Energy, Lanes};
use super::points::{GROUP, SurfacePoints, area_vector};
use super::refit::{Residuals, refit};
use super::{Points, VmasParams, edges, triangles};
use crate::Result;

/// Change of the total error below which a round is at rest, in squared longest sides.
const AT_REST: f64 = 1e-5;

/// Rounds after which spheres are split, at rest or not.
const SPLIT_EVERY: usize = 10;

/// Step below which a refit ends, in longest sides.
const SHORTEST_STEP: f64 = 1e-8;

/// Rounds with splits that may pass without more spheres than ever before. Clusters of new spheres that are
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
    /// Number of rounds so far.
    pub iterations: usize,
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
        let residuals = Residuals::new(points, energy);
        let labels = vec![NONE; points.len()];
        let first = match params.points {
            Points::Samples => solid.ball_at(points, points.first as usize),
            _ => largest_ball(points, solid),
        };
        // Any sphere will do: the first refit leaves nothing of it but its basin of attraction.
        let somewhere = Sphere::new(points.positions[points.first as usize], 0.0);
        let spheres = vec![first.unwrap_or(somewhere)];
        Self { points, solid, energy, residuals, params, spheres, labels, iterations: 0 }
    }

    /// Rounds until there are `target` spheres, at rest.
    ///
    /// # Errors
    /// When the run is cancelled.
    pub fn run(&mut self, target: usize, run: &RunContext) -> Result<Ended> {
        let at_rest = AT_REST * self.solid.side * self.solid.side;
        let (mut most, mut without_gain, mut before) = (0, 0, 0.0);
        let last = self.params.iterations - 1;
        for round in 0..=last {
            run.step(self.spheres.len().min(target), target)?;
            let clusters = self.cluster();
            self.refit_and_correct(&clusters);
            let misfits = misfits(self.points, self.energy, &self.spheres, &clusters);
            let total: f64 = misfits.iter().map(|misfit| misfit.mean).sum();
            let change = (total - std::mem::replace(&mut before, total)).abs();
            self.iterations = round + 1;
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
        // The authors drop fewer than 4 points, CGAL fewer than 5.
        let least = if self.params.points == Points::Samples { 5 } else { 4 };
        drop_small(&mut self.spheres, &mut self.labels, least)
    }

    /// Steps 2 and 3. A fitted sphere without a medial ball stays as it was.
    fn refit_and_correct(&mut self, clusters: &Clusters) {
        let Self { points, solid, residuals, .. } = self;
        let shortest = SHORTEST_STEP * solid.side;
        self.spheres.par_iter_mut().enumerate().for_each(|(s, sphere)| {
            let fitted = refit(points, residuals, clusters.of(s), *sphere, shortest);
            *sphere = solid.corrected(points, fitted.centre).unwrap_or(*sphere);
        });
    }

    /// Step 5: the sphere stays; the medial ball of the worst point of its cluster joins it.
    fn split(&mut self, worst: u32) {
        self.spheres.extend(self.solid.ball_at(self.points, worst as usize));
    }

    /// The complex of the last round's clusters.
    ///
    /// # Errors
    /// When a sphere is not valid.
    pub fn mesh(&self) -> Result<MedialMesh> {
        let edges = edges(self.points, &self.labels);
        let faces = triangles(&edges);
        Ok(MedialMesh::from_simplices(self.spheres.clone(), edges, faces)?)
    }
}

/// The largest medial ball of a point, that of the smallest id of equal ones.
fn largest_ball(points: &SurfacePoints, solid: &Solid<'_>) -> Option<Sphere> {
    let balls: Vec<Option<Sphere>> =
        (0..points.len()).into_par_iter().map(|v| solid.ball_at(points, v)).collect();
    // `max_by` takes the last of equals: backwards that is the smallest id.
    let balls = balls.into_iter().flatten().rev();
    balls.max_by(|a, b| a.radius.total_cmp(&b.radius))
}

// ----------------------------------------------------------------------------
// Step 1: every surface point goes to the sphere with the least error.
//
// The search is exhaustive by definition. Most spheres are still left out, because
// `e_v(s) >= lambda d^2` where the point is `d` outside the sphere, and `e_v(s) >= (1 + lambda) d^2` where it is
// `d` inside: there every plane distance `n . (v - c)` is at most `|v - c| < r`. The error of any one
// sphere bounds the least error, and the sphere of the round before is rarely a bad one.

/// Label of a point without a sphere.
pub(super) const NONE: u32 = u32::MAX;

/// Relative and absolute excess of a bound over its rounding error; lengths are at most about 1.
const SLACK: (f64, f64) = (1.0 + 1e-9, 1e-12);

/// The points of each sphere, ascending.
#[derive(Clone, Debug, Default)]
pub(super) struct Clusters {
    start: Vec<u32>,
    members: Vec<u32>,
}

/// Gives every point the label of the sphere with the least error, the smallest of equal ones. Labels from
/// before are where the search starts; the result does not depend on them.
pub(super) fn assign(
    points: &SurfacePoints,
    energy: Energy,
    spheres: &[Sphere],
    labels: &mut [u32],
) {
    labels.par_chunks_mut(GROUP).zip(&points.groups).enumerate().for_each_init(
        || (Vec::new(), Lanes::default()),
        |(near, lanes), (place, (labels, group))| {
            let first = place * GROUP;
            let worst = bound(points, energy, spheres, first, labels);
            candidates(group, worst, energy.lambda, spheres, near);
            lanes.fill(spheres, near);
            for (v, label) in (first..).zip(labels) {
                *label = energy.least(points, v, lanes);
            }
        },
    );
}

/// An upper bound of the least errors of a group.
fn bound(
    points: &SurfacePoints,
    energy: Energy,
    spheres: &[Sphere],
    first: usize,
    labels: &[u32],
) -> f64 {
    // A point without a label is near one that has one.
    let mut guess = 0;
    let mut worst = 0.0_f64;
    for (v, &label) in (first..).zip(labels) {
        guess = if label == NONE { guess } else { label };
        worst = worst.max(energy.at(points, v, &spheres[guess as usize]));
    }
    worst
}

/// The spheres that may have an error of at most `worst` at a point of the group, ascending.
fn candidates(group: &Sphere, worst: f64, lambda: f64, spheres: &[Sphere], near: &mut Vec<u32>) {
    let [outside, inside] = [lambda, 1.0 + lambda]
        .map(|weight| (worst / weight).sqrt() * SLACK.0 + SLACK.1 + group.radius);
    near.clear();
    for (id, sphere) in (0..).zip(spheres) {
        let distance = group.centre.distance(sphere.centre) - sphere.radius;
        if distance <= outside && -distance <= inside {
            near.push(id);
        }
    }
}

impl Clusters {
    /// Sorts the points by label; those without one are in no cluster.
    pub fn of_labels(labels: &[u32], spheres: usize) -> Self {
        let mut start = vec![0; spheres + 1];
        let labelled = (0..).zip(labels).filter(|&(_, &label)| label != NONE);
        labelled.clone().for_each(|(_, &label)| start[label as usize + 1] += 1);
        for sphere in 0..spheres {
            start[sphere + 1] += start[sphere];
        }
        let mut next = start.clone();
        let mut members = vec![0; start[spheres] as usize];
        for (v, &label) in labelled {
            members[next[label as usize] as usize] = v;
            next[label as usize] += 1;
        }
        Self { start, members }
    }

    /// The points of a sphere, ascending.
    pub fn of(&self, sphere: usize) -> &[u32] {
        &self.members[self.start[sphere] as usize..self.start[sphere + 1] as usize]
    }
}

/// Drops the spheres with fewer than `least` points, whose points stay without a label in this round; the
/// largest cluster stays at any size. Returns the clusters that are left.
pub(super) fn drop_small(spheres: &mut Vec<Sphere>, labels: &mut [u32], least: usize) -> Clusters {
    let clusters = Clusters::of_labels(labels, spheres.len());
    // Backwards, so that of equal clusters the first counts as the largest.
    let largest = (0..spheres.len()).rev().max_by_key(|&s| clusters.of(s).len());
    let mut kept: Vec<usize> = (0..spheres.len()).collect();
    kept.retain(|&s| clusters.of(s).len() >= least || Some(s) == largest);
    if kept.len() == spheres.len() {
        return clusters;
    }
    let mut renamed = vec![NONE; spheres.len()];
    (0..).zip(&kept).for_each(|(new, &old)| renamed[old] = new);
    for label in labels.iter_mut().filter(|label| **label != NONE) {
        *label = renamed[*label as usize];
    }
    *spheres = kept.iter().map(|&s| spheres[s]).collect();
    Clusters::of_labels(labels, spheres.len())
}

// ----------------------------------------------------------------------------
// Steps 4 and 5: the errors of the clusters, and which spheres are split.

/// Share of the spheres that are split in a round.
const SHARE: f64 = 0.2;
/// Limit of the spheres that are split in a round.
const MOST: usize = 10;

/// How well a sphere fits its cluster.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Misfit {
    /// `E_s`: the errors of the cluster over its area, in squared diagonals.
    pub mean: f64,
    /// The point with the largest error, the smallest id of equal ones.
    pub worst: u32,
}

/// The misfit of every sphere; no cluster is empty.
pub(super) fn misfits(
    points: &SurfacePoints,
    energy: Energy,
    spheres: &[Sphere],
    clusters: &Clusters,
) -> Vec<Misfit> {
    let found = spheres.par_iter().enumerate().map(|(s, sphere)| {
        let cluster = clusters.of(s);
        let (mut sum, mut area) = (0.0, 0.0);
        let (mut largest, mut worst) = (f64::NEG_INFINITY, cluster[0]);
        for &v in cluster {
            let a = points.areas[v as usize];
            let error = a * energy.at(points, v as usize, sphere);
            sum += error;
            area += a;
            if error > largest {
                (largest, worst) = (error, v);
            }
        }
        Misfit { mean: sum / area, worst }
    });
    found.collect()
}

/// The spheres to split, those with the largest errors first: at most the missing number, and none of
/// which a neighbour is split. `edges` are pairs of adjacent spheres.
pub(super) fn to_split(misfits: &[Misfit], edges: &[[u32; 2]], missing: usize) -> Vec<u32> {
    let spheres = misfits.len();
    let most = ((SHARE * spheres as f64).ceil() as usize).min(MOST).min(missing);
    let mut neighbours = vec![Vec::new(); spheres];
    for &[a, b] in edges {
        neighbours[a as usize].push(b);
        neighbours[b as usize].push(a);
    }
    let mut order: Vec<u32> = (0..spheres as u32).collect();
    // Ties by id: an unstable sort alone would leave their order open.
    order.sort_unstable_by(|&a, &b| {
        misfits[b as usize].mean.total_cmp(&misfits[a as usize].mean).then(a.cmp(&b))
    });
    let mut blocked = vec![false; spheres];
    let mut split = Vec::new();
    for sphere in order {
        if split.len() == most {
            break;
        }
        if !blocked[sphere as usize] {
            neighbours[sphere as usize].iter().for_each(|&other| blocked[other as usize] = true);
            split.push(sphere);
        }
    }
    split
}

// ----------------------------------------------------------------------------
// Step 3: a fitted centre is pushed back to the medial axis.

/// Distance to the surface up to which a centre gives no direction, a fraction of the diagonal.
const ON_THE_SURFACE: f64 = 1e-12;

/// The solid that spheres are corrected in.
pub(super) struct Solid<'s> {
    shape: &'s Shape,
    pub tree: Arc<TriangleBvh>,
    inside: Arc<InsideTest>,
    /// The longest side of the bounding box, in diagonals.
    pub side: f64,
}

impl<'s> Solid<'s> {
    /// # Errors
    /// When the surface has no face.
    pub fn new(shape: &'s Shape) -> Result<Self, ShapeError> {
        let (tree, inside) = (shape.surface_tree()?, shape.inside_test());
        let side = shape.mesh().bounding_box().map_or(1.0, |(lo, hi)| (hi - lo).max_element());
        Ok(Self { shape, tree, inside, side })
    }

    /// The medial ball of a surface point; `None` where the faces around a vertex cancel.
    pub fn ball_at(&self, points: &SurfacePoints, v: usize) -> Option<Sphere> {
        let (p, n) = (points.positions[v], points.normals[v]);
        if n == Vec3::ZERO {
            return None;
        }
        self.medial_ball(points, p, n)
    }

    /// The medial ball of the surface point nearest to a fitted centre; `None` where there is none. The fitted
    /// radius has no part in it.
    pub fn corrected(&self, points: &SurfacePoints, fitted: Vec3) -> Option<Sphere> {
        if !fitted.is_finite() {
            return None;
        }
        let closest = self.tree.closest(fitted);
        let outward = if closest.distance > ON_THE_SURFACE {
            let away = (closest.point - fitted) / closest.distance;
            if self.inside.side(fitted) == Side::Outside { -away } else { away }
        } else {
            area_vector(self.shape.mesh(), closest.face as usize).try_normalize()?
        };
        self.medial_ball(points, closest.point, outward)
    }

    /// The shrinking ball at a surface point, if it has two contacts: one that never shrank is as large as it
    /// began.
    fn medial_ball(&self, points: &SurfacePoints, p: Vec3, outward: Vec3) -> Option<Sphere> {
        let ball = shrinking_ball(p, outward, self.side, points.touched());
        (ball.steps > 0 && ball.sphere.centre.is_finite()).then_some(ball.sphere)
    }
}
