//! Local ascent from the largest samples of a distance, so that a maximum does not depend on how
//! close to it a sample happens to be.
//!
//! A sampled maximum is too small by the error at the nearest sample: nothing if the maximum is at a
//! vertex, which is sampled, but much if it is at the tip of a ball or in a notch between two cones.
//! That would favour some methods over others. Therefore, from the samples:
//!
//! 1. *Seeds*: the largest samples, the largest first, each at least a step from those before it.
//! 2. *Rounds*: around each seed the points at one step in twelve directions (those of an
//!    icosahedron, turned from round to round) are carried onto the surface, and measured. The seed
//!    moves to the best of them if that is better by more than rounding.
//! 3. After some rounds the step is halved, and the worse half of the seeds is dropped, except the
//!    last few. A seed is dropped at once if all further steps together could not raise it to the
//!    best one: distances are 1-Lipschitz.
//!
//! The result is the distance at an actual point of the surface: still a lower bound of the true
//! maximum. Directions and ties follow the pose, so the result does not change when the shape is
//! turned ([`Pose`]). Each round ends before the next begins, and seeds are independent within
//! it: the result is the same for any number of threads.

use rayon::prelude::*;

use super::pieces::{BURIAL, EXPOSED};
use super::samples::{Pose, SurfaceSamples};
use crate::Vec3;
use crate::complex::MedialUnion;
use crate::surface::TriangleBvh;

/// Number of samples from which an ascent starts.
pub(super) const SEEDS: usize = 72;

/// Number of seeds that are followed to the last step.
const LAST_SEEDS: usize = 6;

/// Number of rounds with one length of step.
const ROUNDS: usize = 3;

/// Number of halvings of the step: to a thousandth of the distance between samples.
const HALVINGS: usize = 10;

/// Samples for each seed among which seeds are chosen: the largest are often all in one place.
const CROWD: usize = 40;

/// Gain below which a step is rounding, as a fraction of the diameter.
const GAIN: f64 = 1e-10;

/// A place and its distance from the other surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Peak {
    /// A point of the surface, or of the union's boundary.
    pub point: Vec3,
    /// Distance from the other surface.
    pub distance: f64,
}

/// The results of the last searches, from which the next ones start.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Near {
    place: usize,
    face: Option<u32>,
}

/// A surface, and a distance at each of its points.
pub(super) trait Hill: Sync {
    /// A point of the surface near to `p` with its distance, where one is found.
    fn near(&self, p: Vec3, near: &mut Near) -> Option<Peak>;
}

/// The points of a triangle mesh.
pub(super) struct OnMesh<'a, F> {
    pub mesh: &'a TriangleBvh,
    /// Distance of a point from the other surface.
    pub value: F,
}

impl<F: Fn(Vec3, &mut usize) -> f64 + Sync> Hill for OnMesh<'_, F> {
    fn near(&self, p: Vec3, near: &mut Near) -> Option<Peak> {
        let closest = self.mesh.closest_from(p, near.face);
        near.face = Some(closest.face);
        Some(Peak { point: closest.point, distance: (self.value)(closest.point, &mut near.place) })
    }
}

/// The boundary of a union, with distances from a mesh.
pub(super) struct OnUnion<'a> {
    union: &'a MedialUnion,
    surface: &'a TriangleBvh,
    /// Points deeper than this in the union are not on its boundary.
    burial: f64,
    /// Width of a gap between two primitives that counts as none.
    touching: f64,
}

impl<'a> OnUnion<'a> {
    /// `diameter` is that of the surface.
    pub fn new(union: &'a MedialUnion, surface: &'a TriangleBvh, diameter: f64) -> Self {
        Self { union, surface, burial: EXPOSED * diameter, touching: BURIAL * diameter }
    }
}

impl Hill for OnUnion<'_> {
    fn near(&self, p: Vec3, near: &mut Near) -> Option<Peak> {
        let point = self.union.boundary_near(p, self.burial, &mut near.place)?;
        // Not on a wall between primitives that touch, which is inside the union.
        let (_, centre) = self.union.deepest_from(point, &mut near.place);
        let outward = (point - centre?).try_normalize()? * (2.0 * self.touching);
        if self.union.signed_from(point + outward, &mut near.place) < -self.touching {
            return None;
        }
        let closest = self.surface.closest_from(point, near.face);
        near.face = Some(closest.face);
        Some(Peak { point, distance: closest.distance })
    }
}

/// Samples of a surface, from which an ascent starts.
#[derive(Clone, Copy)]
pub(super) struct Start<'a> {
    pub pose: &'a Pose,
    pub points: &'a [Vec3],
    /// The distance at each point.
    pub values: &'a [f64],
    /// Typical distance between samples.
    pub spacing: f64,
    /// Largest number of seeds.
    pub seeds: usize,
}

/// The points that the ascent reaches from the largest of some samples, one for each seed.
pub(super) fn ascend(hill: &impl Hill, start: &Start<'_>) -> Vec<Peak> {
    let mut climbers: Vec<(Peak, Near)> =
        start.pick().into_iter().map(|seed| (seed, Near::default())).collect();
    let gain = GAIN * start.pose.diameter();
    let mut given_up = Vec::new();
    let mut step = start.spacing;
    for halving in 0..=HALVINGS {
        for round in 0..ROUNDS {
            let arms = directions(start.pose, halving * ROUNDS + round).map(|d| d * step);
            climbers.par_iter_mut().for_each(|climber| climb(hill, &arms, gain, climber));
        }
        climbers.sort_by(|(a, _), (b, _)| b.distance.total_cmp(&a.distance));
        step *= 0.5;
        let keep = climbers.len().div_ceil(2).max(LAST_SEEDS);
        let best = climbers.first().map_or(0.0, |(peak, _)| peak.distance);
        // Steps halve, so all that are still to come add up to twice the next ones.
        let hopeless = best - 2.0 * ROUNDS as f64 * step;
        let kept = climbers.partition_point(|(peak, _)| peak.distance >= hopeless).min(keep);
        given_up.extend(climbers.drain(kept..).map(|(peak, _)| peak));
    }
    climbers.into_iter().map(|(peak, _)| peak).chain(given_up).collect()
}

/// Moves a climber to the best of the points around it, if that is better.
fn climb(hill: &impl Hill, arms: &[Vec3], gain: f64, (peak, near): &mut (Peak, Near)) {
    let here = peak.point;
    for &arm in arms {
        if let Some(found) = hill.near(here + arm, near)
            && found.distance > peak.distance + gain
        {
            *peak = found;
        }
    }
}

impl<'a> Start<'a> {
    /// From the largest of the values at the samples.
    pub fn new(samples: &'a SurfaceSamples, values: &'a [f64]) -> Self {
        let SurfaceSamples { pose, points, spacing, .. } = samples;
        Self { pose, points, values, spacing: *spacing, seeds: SEEDS }
    }

    /// All samples with their values.
    pub fn peaks(&self) -> impl Iterator<Item = Peak> {
        self.points.iter().zip(self.values).map(|(&point, &distance)| Peak { point, distance })
    }

    /// The largest samples that are at least a step apart. Samples equal up to rounding are taken in
    /// the order of the pose's curve, which depends neither on numbering nor on orientation.
    fn pick(&self) -> Vec<Peak> {
        let grain = GAIN * self.pose.diameter();
        let mut ranked: Vec<_> = self
            .largest()
            .into_iter()
            .map(|k| Peak { point: self.points[k], distance: self.values[k] })
            .map(|peak| (((-peak.distance / grain).round(), self.pose.place_of(peak.point)), peak))
            .collect();
        ranked.sort_by(|((a, at), _), ((b, other), _)| a.total_cmp(b).then_with(|| at.cmp(other)));
        let mut seeds: Vec<Peak> = Vec::with_capacity(self.seeds);
        for (_, peak) in ranked {
            let apart = self.spacing * self.spacing;
            if seeds.iter().all(|seed| seed.point.distance_squared(peak.point) >= apart) {
                seeds.push(peak);
            }
            if seeds.len() == self.seeds {
                break;
            }
        }
        seeds
    }

    /// The samples among which seeds are chosen: whole classes of equal values, so that their order
    /// in the list does not matter. A value that is not a number is the maximum anyway.
    fn largest(&self) -> Vec<usize> {
        let values = self.values;
        let mut order: Vec<usize> = (0..values.len()).filter(|&k| values[k].is_finite()).collect();
        let crowd = CROWD * self.seeds;
        if crowd < order.len() {
            order.select_nth_unstable_by(crowd, |&a, &b| values[b].total_cmp(&values[a]));
            let least = values[order[crowd]];
            order.retain(|&k| values[k] >= least);
        }
        order
    }
}

/// The corners of an icosahedron, turned differently in each round.
fn directions(pose: &Pose, round: usize) -> [Vec3; 12] {
    // Not a simple fraction of a turn, nor an axis of symmetry: no direction repeats.
    let axis = Vec3::new(0.267_261, 0.534_522, 0.801_784).normalize();
    let turn = glam::DQuat::from_axis_angle(axis, 2.399_963_2 * (round as f64 + 0.3));
    let [x, y, z] = pose.axes();
    icosahedron().map(|corner| {
        let d = turn * corner;
        d.x * x + d.y * y + d.z * z
    })
}

/// Twelve unit vectors, towards the corners of an icosahedron.
fn icosahedron() -> [Vec3; 12] {
    const GOLDEN: f64 = 1.618_033_988_749_895;
    std::array::from_fn(|k| {
        let sign = |bit: usize| if k >> bit & 1 == 0 { 1.0 } else { -1.0 };
        let (short, long) = (sign(0), sign(1) * GOLDEN);
        let corner = match k / 4 {
            0 => Vec3::new(0.0, short, long),
            1 => Vec3::new(short, long, 0.0),
            _ => Vec3::new(long, 0.0, short),
        };
        corner.normalize()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::complex::Sphere;
    use crate::surface::TriMesh;

    fn square() -> TriMesh {
        let corner = |x, y| Vec3::new(x, y, 0.0);
        let vertices = vec![corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)];
        TriMesh { vertices, faces: vec![[0, 1, 2], [0, 2, 3]] }
    }

    /// A start from points that all miss the maximum.
    fn best(hill: &impl Hill, surface: &TriMesh, points: &[Vec3], spacing: f64) -> Peak {
        let pose = Pose::new(surface);
        let mut near = Near::default();
        let values: Vec<f64> =
            points.iter().map(|&p| hill.near(p, &mut near).unwrap().distance).collect();
        let start = Start { pose: &pose, points, values: &values, spacing, seeds: 8 };
        let peaks = ascend(hill, &start);
        assert!(
            peaks
                .iter()
                .all(|p| p.distance <= hill.near(p.point, &mut near).unwrap().distance + 1e-12)
        );
        peaks.into_iter().max_by(|a, b| a.distance.total_cmp(&b.distance)).unwrap()
    }

    #[test]
    fn the_ridge_between_three_balls_is_climbed() {
        let surface = square();
        let mesh = TriangleBvh::new(&surface).unwrap();
        // The circumcentre of three points of the square is where the nearest is farthest.
        let centres = [[0.2, 0.2], [0.8, 0.3], [0.3, 0.9]].map(|[x, y]| Vec3::new(x, y, 0.0));
        let balls = centres.map(|c| Sphere::new(c, 0.05));
        let union = MedialUnion::of_spheres(&balls).unwrap();
        let value = |p: Vec3, near: &mut usize| union.signed_from(p, near).abs();
        let hill = OnMesh { mesh: &mesh, value };
        let [a, b, c] = centres;
        let area = (b - a).cross(c - a).length() / 2.0;
        let radius = a.distance(b) * b.distance(c) * c.distance(a) / (4.0 * area);
        let found = best(&hill, &surface, &[Vec3::new(0.35, 0.45, 0.0)], 0.1);
        assert!((found.distance - (radius - 0.05)).abs() < 1e-3 * radius, "{found:?}, {radius}");
    }

    #[test]
    fn the_notch_between_two_balls_is_found() {
        let surface = square();
        let tree = TriangleBvh::new(&surface).unwrap();
        // Their spheres meet in a circle, the lowest point of which is nearest to the square.
        let ball = |x: f64| Sphere::new(Vec3::new(0.5 + x, 0.5, -1.0), 0.5);
        let union = MedialUnion::of_spheres(&[ball(-0.3), ball(0.3)]).unwrap();
        let hill = OnUnion::new(&union, &tree, 1.0);
        // Next to the pole that is farthest from the square.
        let found = best(&hill, &surface, &[Vec3::new(0.15, 0.55, -1.49)], 0.1);
        assert!((found.distance - 1.5).abs() < 1e-6, "{found:?}");
        assert!(union.signed(found.point).abs() < 1e-12);
    }

    #[test]
    fn samples_that_are_no_numbers_are_no_seeds() {
        let surface = square();
        let pose = Pose::new(&surface);
        let points = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let values = [f64::NAN, 1.0, f64::INFINITY];
        let start = Start { pose: &pose, points: &points, values: &values, spacing: 0.1, seeds: 3 };
        let seeds = start.pick();
        assert_eq!((seeds.len(), seeds[0].point), (1, Vec3::X));
    }
}
