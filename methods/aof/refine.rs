//! Moves the centre of a voxel onto the axis, between opposite closest points.
//!
//! S. Stolpner, S. Whitesides, K. Siddiqi, *Sampled medial loci for 3D shape representation*,
//! Computer Vision and Image Understanding 115(5), 2011, doi:10.1016/j.cviu.2010.10.014: a point
//! between a sample and its opposite whose closest points differ is localised by bisection.
//!
//! 1. A sample `p` with `a = grad D . N < 0` and closest point `B` looks into the sphere along the
//!    ray from `B` through `p`. Up to the axis, `B` stays the closest point of the points of the ray.
//! 2. If `B` is no longer the closest point of the opposite `p'` of `p`, the axis lies between. The
//!    last point `x` with `D(x) = |x - B|` is found by cutting an interval: if a point of the ray is
//!    nearer to some `B'`, so is the whole ray beyond the bisector plane of `B` and `B'`, and the
//!    interval ends there. It is halved only when that is slow.
//! 3. The ball of radius `D(x)` around `x` is inside the solid. It touches the surface at `B` and,
//!    within the tolerance, at a second point `B'`. Of the samples whose rays pass closest to the
//!    centre, the one whose `B`, `B'` subtend the largest angle is taken.
//!
//! All of this happens in the sphere of the voxel, so only triangles near it matter. They are
//! collected for all voxels, then for halves of them, and so on.

use super::nearby::{NearBatch, NearSet, NearbyTriangles};
use medial::Vec3;
use medial::complex::Sphere as Ball;
use medial::simplifier::{RunContext, SimplifyError};
use medial::surface::TriangleBvh;
use rayon::prelude::*;

use super::flux::Sphere;

/// Samples that are followed onto the axis.
const FOLLOWED_SAMPLES: usize = 4;
/// Width of the last interval, in radii of the voxel's sphere.
const TOLERANCE: f64 = 1e-9;
/// The surface has another closest point only if it is nearer by this fraction of the distance.
const SAME: f64 = 1e-12;
/// Every fourth cut halves the interval.
const HALVING: u32 = 4;
/// Groups of at most this many voxels share a set of triangles.
const MAX_GROUP: usize = 8;
/// Largest number of voxels of a task.
const MAX_TASK: usize = 512;

/// A ball on the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refined {
    /// The ball: its radius is the distance of its centre to the surface.
    pub ball: Ball,
    /// Two closest points, the second within the tolerance; the same point twice if the centre was
    /// not moved.
    pub contacts: [Vec3; 2],
}

/// The balls on the axis near `centres`; around the centre itself if no sample and its opposite have
/// different closest points.
///
/// # Errors
/// When the run was cancelled.
pub fn refine(
    triangles: &NearbyTriangles,
    tree: &TriangleBvh,
    sphere: &Sphere,
    centres: &[Vec3],
    run: &RunContext,
) -> Result<Vec<Refined>, SimplifyError> {
    let refiner = Refiner { triangles, tree, sphere };
    let mut voxels: Vec<Centre> = (0..).zip(centres.iter().copied()).collect();
    let mut groups = Vec::new();
    let whole = triangles.all(centres.first().copied().unwrap_or_default());
    refiner.divide(&mut voxels, &whole, &mut groups);
    let done = std::sync::atomic::AtomicUsize::new(0);
    let parts: Result<Vec<_>, SimplifyError> = groups
        .into_par_iter()
        .map(|(voxels, set)| {
            let mut refined = Vec::with_capacity(voxels.len());
            refiner.group(voxels, &set, &mut refined);
            let before = done.fetch_add(refined.len(), std::sync::atomic::Ordering::Relaxed);
            run.step(before + refined.len(), centres.len())?;
            Ok(refined)
        })
        .collect();
    let mut refined = parts?.concat();
    // Groups reorder the voxels: back to the order of `centres`.
    refined.sort_unstable_by_key(|&(index, _)| index);
    Ok(refined.into_iter().map(|(_, refined)| refined).collect())
}

/// A voxel's place in the list, and its centre.
type Centre = (u32, Vec3);

struct Refiner<'a> {
    triangles: &'a NearbyTriangles,
    tree: &'a TriangleBvh,
    sphere: &'a Sphere,
}

impl Refiner<'_> {
    /// Groups of voxels for the tasks, with the triangles near each.
    fn divide<'v>(
        &self,
        voxels: &'v mut [Centre],
        around: &NearSet,
        groups: &mut Vec<(&'v mut [Centre], NearSet)>,
    ) {
        let set = self.near(voxels, around);
        if voxels.len() <= MAX_TASK {
            groups.push((voxels, set));
            return;
        }
        let [low, high] = halves(voxels);
        self.divide(low, &set, groups);
        self.divide(high, &set, groups);
    }

    /// Halves a group until few voxels share a set.
    fn group(&self, voxels: &mut [Centre], set: &NearSet, refined: &mut Vec<(u32, Refined)>) {
        if voxels.len() > MAX_GROUP {
            let [low, high] = halves(voxels);
            for half in [low, high] {
                let set = self.near(half, set);
                self.group(half, &set, refined);
            }
            return;
        }
        let mut own = NearSet::default();
        for &mut (index, centre) in voxels {
            self.triangles.narrow(set, centre, self.sphere.radius, &mut own);
            refined.push((index, self.one(&own)));
        }
    }

    /// The triangles near the spheres of voxels.
    fn near(&self, voxels: &[Centre], around: &NearSet) -> NearSet {
        let [lo, hi] = corners(voxels);
        let mut set = NearSet::default();
        let reach = 0.5 * (hi - lo).length() * (1.0 + 1e-12) + self.sphere.radius;
        self.triangles.narrow(around, 0.5 * (lo + hi), reach, &mut set);
        set
    }

    /// Steps 1 to 3.
    fn one(&self, set: &NearSet) -> Refined {
        let (triangles, radius) = (self.triangles, self.sphere.radius);
        let mut samples = NearBatch::default();
        for &normal in &self.sphere.directions {
            samples.push(normal * radius, f64::INFINITY);
        }
        triangles.closest(set, &mut samples);
        let mut rays = Vec::with_capacity(samples.len());
        for (k, &normal) in self.sphere.directions.iter().enumerate() {
            let Some(near) = triangles.answer(set, &samples, k) else {
                continue;
            };
            let along = near.gradient.dot(normal);
            if along < 0.0 {
                let start = normal * radius;
                let foot = start - near.gradient * near.distance;
                let (gradient, distance) = (near.gradient, near.distance);
                rays.push((along, Ray { triangles, set, start, gradient, foot, distance }));
            }
        }
        // Most inward first: these rays pass closest to the centre. Stable, so ties are by sample.
        rays.sort_by(|a, b| a.0.total_cmp(&b.0));
        let found = rays
            .iter()
            .filter_map(|(along, ray)| {
                let (centre, contacts) = ray.localise(-2.0 * radius * along, TOLERANCE * radius)?;
                let [centre, p, q] = [centre, contacts[0], contacts[1]].map(|v| v + set.centre());
                let ball = Ball::new(centre, self.tree.closest(centre).distance);
                Some(Refined { ball, contacts: [p, q] })
            })
            .take(FOLLOWED_SAMPLES);
        let subtended = |r: &Refined| r.contacts[0].distance(r.contacts[1]) / r.ball.radius;
        let better = |best, next| if subtended(&next) > subtended(&best) { next } else { best };
        found.reduce(better).unwrap_or_else(|| {
            let near = self.tree.closest(set.centre());
            Refined { ball: Ball::new(set.centre(), near.distance), contacts: [near.point; 2] }
        })
    }
}

fn corners(voxels: &[Centre]) -> [Vec3; 2] {
    voxels.iter().fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[lo, hi], (_, centre)| {
        [lo.min(*centre), hi.max(*centre)]
    })
}

/// Two halves along the longest side.
fn halves(voxels: &mut [Centre]) -> [&mut [Centre]; 2] {
    let [lo, hi] = corners(voxels);
    let axis = (hi - lo).max_position();
    let middle = voxels.len() / 2;
    voxels
        .select_nth_unstable_by(middle, |a, b| a.1[axis].total_cmp(&b.1[axis]).then(a.0.cmp(&b.0)));
    voxels.split_at_mut(middle).into()
}

/// The ray from a closest point through its sample; points are relative to the centre of the set.
struct Ray<'a> {
    triangles: &'a NearbyTriangles,
    set: &'a NearSet,
    start: Vec3,
    gradient: Vec3,
    foot: Vec3,
    /// From the foot to the start.
    distance: f64,
}

impl Ray<'_> {
    /// The closest point of the surface to the point of the ray `t` behind the sample, if it is
    /// nearer than the foot.
    fn other(&self, t: f64) -> Option<Vec3> {
        let q = self.start + self.gradient * t;
        let bound = (self.distance + t) * (1.0 - SAME);
        let (point, _) = self.triangles.closest_within(self.set, q, bound)?;
        Some(point - self.set.centre())
    }

    /// The parameter at which the ray is equally far from the foot and from another point.
    fn even(&self, other: Vec3) -> f64 {
        let apart = other - self.foot;
        0.5 * apart.length_squared() / self.gradient.dot(apart) - self.distance
    }

    /// Step 2: the point, relative to the centre of the set, and its two closest points.
    fn localise(&self, length: f64, tolerance: f64) -> Option<(Vec3, [Vec3; 2])> {
        let mut second = self.other(length)?;
        let (mut low, mut high) = (0.0, length);
        for cut in 1_u32.. {
            high = self.even(second).clamp(low, high);
            if high - low <= tolerance {
                break;
            }
            // Just below the cut succeeds at once if no third point interferes.
            let in_the_middle = cut.is_multiple_of(HALVING);
            let at = if in_the_middle { low.midpoint(high) } else { high - tolerance };
            if !(low < at && at < high) {
                break;
            }
            match self.other(at) {
                Some(point) => (high, second) = (at, point),
                None => low = at,
            }
        }
        Some((self.start + self.gradient * low, [self.foot, second]))
    }
}
