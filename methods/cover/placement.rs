//! The places of the centres: candidates, a greedy start, descent, swaps.
//!
//! Notation of `mod.rs`: `f_c(p) = |p - c| - depth(c)`, the distance from `p` to the largest inner ball
//! at `c`; `G`, the largest least `f` of all points; `P`, the power of the descent.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use medial::Vec3;
use medial::complex::Sphere;
use medial::shape::Shape;
use medial::simplifier::RunContext;
use medial::surface::{
    InsideTest, Side, Touched, TriMesh, TriangleBvh, sample_with_faces, shrinking_ball,
};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use rayon::prelude::*;

use crate::Result;

/// Balls of the greedy start for each sphere.
const CANDIDATES_EACH: usize = 30;
/// Smallest and largest number of these balls.
const CANDIDATES: [usize; 2] = [2_000, 6_000];

/// Surface points for each sphere, besides the vertices.
const POINTS_EACH: usize = 400;
/// Smallest and largest number of these points.
const POINTS: [usize; 2] = [20_000, 60_000];

/// Limit of the points that the greedy start covers.
const GREEDY_POINTS: usize = 4_000;

/// Halvings of the interval of the greedy start's threshold.
const HALVINGS: usize = 9;

/// Trial steps of each sphere in a sweep.
const TRIALS: usize = 6;

/// Factors of the step after one that improves, and after one that does not.
const GROWTH: [f64; 2] = [1.6, 0.8];

/// Smallest first step of a sweep, as a share of the largest gap.
const LEAST_STEP: f64 = 0.02;

/// Points that every sweep sees, at least and for each sphere.
const BASE: [usize; 2] = [6_000, 80];
/// Share of the largest gap from which on a sweep sees all points.
const FOCUS: f64 = 0.7;

/// Failed swaps that end the swaps.
const FAILURES: usize = 4;

/// Rounds of steps after a swap, and nearest spheres that take them.
const LOCAL: [usize; 2] = [4, 10];

/// Radius below which an inner ball is left out, in diagonals.
const SMALLEST_BALL: f64 = 1e-6;

/// Number of equal radii that are tried, from that of the largest inner ball downwards.
const RADII: i32 = 14;
/// Ratio of such a radius to the one before.
const RADIUS_STEP: f64 = 0.8;
/// Candidates of each.
const RADIUS_CANDIDATES: usize = 1_000;

/// Limit of the shrinkings of a ball after a step.
const SHRINKS: usize = 5;

/// The solid, with its candidates and points.
pub(super) struct Solid<'a> {
    pub mesh: &'a TriMesh,
    pub tree: &'a TriangleBvh,
    pub inside: &'a InsideTest,
    /// The longest side of its box.
    side: f64,
    seed: u64,
    /// The radius of all inner balls, where they are equal; then no centre is less deep.
    common: Option<f64>,
}

impl<'a> Solid<'a> {
    pub fn new(shape: &'a Shape, tree: &'a TriangleBvh, inside: &'a InsideTest, seed: u64) -> Self {
        let mesh = shape.mesh();
        let (lo, hi) = mesh.bounding_box().unwrap_or_default();
        Self { mesh, tree, inside, side: (hi - lo).max_element(), seed, common: None }
    }

    /// The solid for equal balls. Of a sequence of radii it takes the one with the smallest gap of the greedy start:
    /// large balls leave thin parts, and small balls everything else.
    pub fn with_equal_balls(self, spheres: usize) -> Self {
        let largest = self.candidates(spheres).first().map(|ball| ball.radius);
        let radii = (0..RADII).filter_map(|k| Some(RADIUS_STEP.powi(k) * largest?));
        let gaps = radii.filter_map(|radius| {
            let solid = Self { common: Some(radius), ..self };
            let candidates = solid.candidates(spheres);
            let points = solid.points(spheres, &candidates);
            let some = candidates
                .iter()
                .copied()
                .step_by(candidates.len().div_ceil(RADIUS_CANDIDATES).max(1));
            let some: Vec<Sphere> = some.collect();
            (!some.is_empty()).then(|| (Gaps::new(&some, &points).start(spheres).1, radius))
        });
        let common = gaps.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, radius)| radius);
        Self { common, ..self }
    }

    /// Inner balls that touch surface points, the largest first: medial balls, or equal ones.
    pub fn candidates(&self, spheres: usize) -> Vec<Sphere> {
        let count = (CANDIDATES_EACH * spheres).clamp(CANDIDATES[0], CANDIDATES[1]);
        let samples = sample_with_faces(self.mesh, count, self.seed);
        let ball = |&(p, face): &(Vec3, u32)| {
            let [a, b, c] = self.mesh.triangle(face as usize);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            let centre =
                shrinking_ball(p, normal, self.side, Touched::Mesh(self.tree)).sphere.centre;
            let depth = self.tree.closest(centre).distance;
            let is_inner = depth > SMALLEST_BALL && self.inside.side(centre) == Side::Inside;
            let balls = match self.common {
                None => [Some(Sphere::new(centre, depth)), None],
                // The medial centre, and the one that is just deep enough.
                Some(radius) => {
                    let equal = (depth >= radius).then(|| Sphere::new(centre, radius));
                    let outer = self.grown(p - (1.0 - 1e-9) * radius * normal, [1.0, 0.0, 0.0]);
                    [equal, equal.and(outer)]
                }
            };
            balls.into_iter().flatten().filter(move |_| is_inner)
        };
        let mut balls: Vec<Sphere> = samples.par_iter().flat_map_iter(ball).collect();
        balls.sort_by(|a, b| b.radius.total_cmp(&a.radius));
        balls
    }

    /// Points of the solid that are to be covered: vertices and samples of its surface, and centres of
    /// candidates.
    pub fn points(&self, spheres: usize, candidates: &[Sphere]) -> Vec<Vec3> {
        let count = (POINTS_EACH * spheres).clamp(POINTS[0], POINTS[1]);
        // Other samples than those of the candidates, which their balls touch.
        let samples = sample_with_faces(self.mesh, count, self.seed ^ 1);
        let mut points: Vec<Vec3> = samples.into_iter().map(|(p, _)| p).collect();
        let thinned = |all: usize| all.div_ceil(count).max(1);
        points.extend(self.mesh.vertices.iter().step_by(thinned(self.mesh.vertices.len())));
        points.extend(candidates.iter().step_by(4).map(|ball| ball.centre));
        points
    }

    /// The medial ball that grows from the inner ball at a centre, away from its contact, by at most
    /// `limit`. `None` if the centre is not in the solid; it is known to be within `moved` of one that has
    /// the depth `depth`.
    fn grown(&self, centre: Vec3, [moved, depth, limit]: [f64; 3]) -> Option<Sphere> {
        let closest = self.tree.closest(centre);
        if moved >= depth && self.inside.side(centre) != Side::Inside {
            return None;
        }
        if let Some(radius) = self.common {
            let outward = (closest.point - centre).normalize_or_zero();
            let inner = centre - (radius - closest.distance).max(0.0) * outward;
            let is_deep =
                inner == centre || self.tree.closest(inner).distance >= radius * (1.0 - 1e-9);
            return is_deep.then(|| Sphere::new(inner, radius));
        }
        let small = Sphere::new(centre, closest.distance);
        let contact = closest.point;
        let towards = (centre - contact).normalize_or_zero();
        let (mut radius, mut near) = (closest.distance + limit, closest.face);
        for _ in 0..SHRINKS {
            let middle = contact + radius * towards;
            let other = self.tree.closest_from(middle, Some(near));
            near = other.face;
            if other.distance >= radius * (1.0 - 1e-4) {
                // It holds the small ball, or rounding is at work.
                let holds = other.distance - middle.distance(centre) >= small.radius * (1.0 - 1e-3);
                return Some(if holds { Sphere::new(middle, other.distance) } else { small });
            }
            let chord = other.point - contact;
            let along = 2.0 * towards.dot(chord);
            let smaller = chord.length_squared() / along;
            if !(along > 0.0 && smaller > small.radius && smaller < radius) {
                return Some(small);
            }
            radius = smaller;
        }
        Some(small)
    }
}

/// Candidates of which each point is within `threshold` of at least one, chosen greedily; at most
/// `most`, and `None` if that does not cover all points.
fn greedy_cover(rows: &[Vec<f32>], threshold: f32, most: usize) -> Option<Vec<usize>> {
    let points = rows.first().map_or(0, Vec::len);
    let bits = |row: &Vec<f32>| -> Vec<u64> {
        let word = |chunk: &[f32]| {
            chunk.iter().rev().fold(0, |word, &gap| word << 1 | u64::from(gap <= threshold))
        };
        row.chunks(64).map(word).collect()
    };
    let covers: Vec<Vec<u64>> = rows.par_iter().map(bits).collect();
    let mut open = vec![u64::MAX; points.div_ceil(64)];
    if let Some(last) = open.last_mut().filter(|_| !points.is_multiple_of(64)) {
        *last = (1 << (points % 64)) - 1;
    }
    let gain = |cover: &[u64], open: &[u64]| -> u32 {
        cover.iter().zip(open).map(|(c, o)| (c & o).count_ones()).sum()
    };
    // Gains only fall, so a candidate whose old gain is the largest is measured again, and no other.
    let mut heap: BinaryHeap<_> =
        covers.iter().enumerate().map(|(k, cover)| (gain(cover, &open), Reverse(k))).collect();
    let mut chosen = Vec::new();
    let mut left = points as u32;
    while left > 0 && chosen.len() < most {
        let (_, Reverse(k)) = heap.pop()?;
        let now = gain(&covers[k], &open);
        if heap.peek().is_some_and(|&next| next > (now, Reverse(k))) {
            heap.push((now, Reverse(k)));
            continue;
        }
        if now == 0 {
            return None;
        }
        open.iter_mut().zip(&covers[k]).for_each(|(open, cover)| *open &= !cover);
        left -= now;
        chosen.push(k);
    }
    (left == 0).then_some(chosen)
}

/// For each candidate the gaps of all points.
pub(super) struct Gaps(Vec<Vec<f32>>);

impl Gaps {
    pub fn new(candidates: &[Sphere], points: &[Vec3]) -> Self {
        let points: Vec<Vec3> =
            points.iter().copied().step_by(points.len().div_ceil(GREEDY_POINTS).max(1)).collect();
        let row = |ball: &Sphere| points.iter().map(|&p| ball.signed_distance(p) as f32).collect();
        Self(candidates.par_iter().map(row).collect())
    }

    /// The number of candidates that the greedy choice needs for a gap.
    pub fn needed(&self, gap: f64) -> Option<usize> {
        greedy_cover(&self.0, gap as f32, self.0.len()).map(|chosen| chosen.len())
    }

    /// At most `count` candidates with a small largest gap, and a bound on it: by halving the threshold's interval.
    pub fn start(&self, count: usize) -> (Vec<usize>, f32) {
        let most = self.0.first().map_or(0.0, |row| row.iter().copied().fold(0.0, f32::max));
        let (mut low, mut high) = (0.0, most);
        let mut best = vec![0];
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            match greedy_cover(&self.0, middle, count) {
                Some(chosen) => (best, high) = (chosen, middle),
                None => low = middle,
            }
        }
        (best, high)
    }
}

/// A gap to the nearest sphere, and that to the next.
#[derive(Clone, Copy, Debug)]
struct Nearest {
    gap: f64,
    sphere: u32,
    next: f64,
}

/// Spheres, with the gaps of the points.
#[derive(Clone)]
pub(super) struct Placement<'a> {
    solid: &'a Solid<'a>,
    /// Inner balls.
    pub balls: Vec<Sphere>,
    steps: Vec<f64>,
    points: Vec<Vec3>,
    nearest: Vec<Nearest>,
    random: Pcg64,
}

/// `(gap / scale)^power` for a power of two, and 0 for points that are covered.
#[inline]
fn cost(gap: f64, scale: f64, squarings: u32) -> f64 {
    let mut value = gap.max(0.0) * scale;
    for _ in 0..squarings {
        value *= value;
    }
    value
}

impl<'a> Placement<'a> {
    pub fn new(solid: &'a Solid<'a>, balls: Vec<Sphere>) -> Self {
        Self {
            solid,
            steps: balls.iter().map(|ball| 0.3 * ball.radius).collect(),
            balls,
            points: Vec::new(),
            nearest: Vec::new(),
            random: Pcg64::seed_from_u64(solid.seed),
        }
    }

    fn nearest_to(&self, p: Vec3) -> Nearest {
        let mut found = Nearest { gap: f64::INFINITY, sphere: 0, next: f64::INFINITY };
        for (sphere, ball) in (0..).zip(&self.balls) {
            let gap = ball.signed_distance(p);
            if gap < found.gap {
                found = Nearest { gap, sphere, next: found.gap };
            } else {
                found.next = found.next.min(gap);
            }
        }
        found
    }

    /// The largest gap, and the point that has it.
    pub fn worst(&self) -> (f64, usize) {
        let gaps = self.nearest.iter().enumerate().map(|(k, near)| (near.gap, k));
        gaps.fold((f64::NEG_INFINITY, 0), |worst, next| if next.0 > worst.0 { next } else { worst })
    }

    /// Takes the points of a pool whose gaps matter: those above a share of the largest.
    pub fn focus(&mut self, pool: &[Vec3]) {
        let nearest: Vec<Nearest> = pool.par_iter().map(|&p| self.nearest_to(p)).collect();
        let largest = nearest.iter().map(|near| near.gap).fold(0.0, f64::max);
        let matters = |near: &Nearest| near.gap > FOCUS * largest;
        let every = pool.len().div_ceil(BASE[0].max(BASE[1] * self.balls.len())).max(1);
        let kept = pool.iter().zip(nearest).enumerate();
        let kept =
            kept.filter(|(k, (_, near))| k % every == 0 || matters(near)).map(|(_, both)| both);
        (self.points, self.nearest) = kept.map(|(&p, near)| (p, near)).unzip();
    }

    fn total(&self, scale: f64, squarings: u32) -> f64 {
        self.nearest.iter().map(|near| cost(near.gap, scale, squarings)).sum()
    }

    /// Puts a ball in the place of another.
    fn replace(&mut self, sphere: usize, ball: Sphere) {
        let id = sphere as u32;
        let old = std::mem::replace(&mut self.balls[sphere], ball);
        for k in 0..self.points.len() {
            let p = self.points[k];
            let near = self.nearest[k];
            let gap = ball.signed_distance(p);
            if near.sphere == id && gap <= near.next {
                self.nearest[k].gap = gap;
            } else if near.sphere == id || old.signed_distance(p) <= near.next {
                // It was one of the two nearest: the third is not known.
                self.nearest[k] = self.nearest_to(p);
            } else if gap < near.gap {
                self.nearest[k] = Nearest { gap, sphere: id, next: near.gap };
            } else if gap < near.next {
                self.nearest[k].next = gap;
            }
        }
    }

    /// Trial steps of one sphere that lower the sum of the powers.
    fn improve(&mut self, sphere: usize, scale: f64, squarings: u32) {
        let id = sphere as u32;
        let mut ball = self.balls[sphere];
        let mut step = self.steps[sphere].max(LEAST_STEP / scale);
        // A gap changes by at most twice the way of the centre, so other points are out of reach.
        let reach = 4.0 * step;
        let mut near = Vec::new();
        for (&p, nearest) in self.points.iter().zip(&self.nearest) {
            let other = if nearest.sphere == id { nearest.next } else { nearest.gap };
            if other > 0.0 && ball.signed_distance(p) < other + 2.0 * reach {
                near.push((p, other));
            }
        }
        let value = |ball: &Sphere, enough: f64| {
            let mut sum = 0.0;
            for &(p, other) in &near {
                sum += cost(ball.signed_distance(p).min(other), scale, squarings);
                if sum >= enough {
                    break;
                }
            }
            sum
        };
        let start = ball.centre;
        let mut best = value(&ball, f64::INFINITY);
        for trial in 0..TRIALS {
            let mut pull = Vec3::ZERO;
            if trial % 2 == 0 {
                // Towards the points that weigh most.
                for &(p, other) in &near {
                    let gap = ball.signed_distance(p);
                    if gap < other && gap > 0.0 {
                        let weight = cost(gap, scale, squarings) / gap;
                        pull += weight * (p - ball.centre).normalize_or_zero();
                    }
                }
            }
            let mut random = || self.random.random_range(-1.0..1.0);
            let direction = Vec3::new(random(), random(), random());
            let direction =
                pull.normalize_or_zero() + if trial % 2 == 0 { 0.5 } else { 1.0 } * direction;
            let centre = ball.centre + step * direction.normalize_or(Vec3::X);
            let moved = [centre.distance(ball.centre), ball.radius, 2.0 * step];
            let grown = self.solid.grown(centre, moved);
            let next = grown.filter(|next| next.centre.distance(start) < reach);
            let is_better = next.is_some_and(|next| {
                let sum = value(&next, best);
                let is_better = sum < best;
                if is_better {
                    (best, ball) = (sum, next);
                }
                is_better
            });
            step *= GROWTH[usize::from(!is_better)];
        }
        self.steps[sphere] = step;
        if ball != self.balls[sphere] {
            self.replace(sphere, ball);
        }
    }

    /// One round over all spheres, at a power of `2^squarings`.
    pub fn sweep(&mut self, squarings: u32, run: &RunContext) -> Result<()> {
        run.step(0, self.balls.len())?;
        let scale = self.worst().0.max(SMALLEST_BALL).recip();
        for sphere in 0..self.balls.len() {
            self.improve(sphere, scale, squarings);
        }
        Ok(())
    }

    /// Moves the spheres that matter least to the points with the largest gaps, one by one, while it helps.
    pub fn swap(
        &mut self,
        candidates: &[Sphere],
        (squarings, tries): (u32, usize),
        run: &RunContext,
    ) -> Result<usize> {
        let (mut swaps, mut failures) = (0, 0);
        if self.balls.len() < 2 {
            return Ok(0);
        }
        for _ in 0..tries {
            let (largest, worst) = self.worst();
            let scale = largest.max(SMALLEST_BALL).recip();
            let mut losses = vec![0.0; self.balls.len()];
            for near in &self.nearest {
                losses[near.sphere as usize] +=
                    cost(near.next, scale, squarings) - cost(near.gap, scale, squarings);
            }
            let mut by_loss: Vec<usize> = (0..losses.len()).collect();
            by_loss.sort_by(|&i, &j| losses[i].total_cmp(&losses[j]));
            let least = by_loss[failures.min(by_loss.len() - 1)];
            // The candidate that lowers the sum most around the worst point.
            let p = self.points[worst];
            let near: Vec<(Vec3, f64)> = (self.points.iter().zip(&self.nearest))
                .filter(|(q, near)| near.gap > 0.5 * largest && q.distance(p) < 0.5)
                .map(|(&q, near)| (q, near.gap))
                .collect();
            let value = |ball: &Sphere| -> f64 {
                near.iter()
                    .map(|&(q, gap)| cost(ball.signed_distance(q).min(gap), scale, squarings))
                    .sum()
            };
            let useful: Vec<&Sphere> =
                candidates.iter().filter(|ball| ball.signed_distance(p) < 0.5 * largest).collect();
            let values: Vec<f64> = useful.par_iter().map(|ball| value(ball)).collect();
            let best = (0..useful.len()).min_by(|&i, &j| values[i].total_cmp(&values[j]));
            let Some(best) = best else { break };
            let before = self.total(scale, squarings);
            let mut trial = self.clone();
            trial.replace(least, *useful[best]);
            trial.steps[least] = 0.3 * useful[best].radius;
            // Around both places.
            let [old, new] = [self.balls[least].centre, useful[best].centre];
            let mut order: Vec<(f64, usize)> = (0..trial.balls.len())
                .map(|k| {
                    let ball = &trial.balls[k];
                    (ball.signed_distance(old).min(ball.signed_distance(new)), k)
                })
                .collect();
            order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            for _ in 0..LOCAL[0] {
                run.step(0, tries)?;
                order.iter().take(LOCAL[1]).for_each(|&(_, k)| trial.improve(k, scale, squarings));
            }
            if trial.total(scale, squarings) >= before {
                failures += 1;
                if failures >= FAILURES {
                    break;
                }
                continue;
            }
            failures = 0;
            *self = trial;
            swaps += 1;
        }
        Ok(swaps)
    }
}
