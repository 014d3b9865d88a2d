//! Step 1: every surface point goes to the sphere with the least error.
//!
//! The search is exhaustive by definition. Most spheres are left out all the same, because
//! `e_v(s) >= lambda d^2` where the point is `d` outside the sphere, and `e_v(s) >= (1 + lambda) d^2` where it is
//! `d` inside: there every plane distance `n . (v - c)` is at most `|v - c| < r`. The error of any one
//! sphere bounds the least error, and the sphere of the round before is seldom a bad one.

use medial::complex::Sphere;
use rayon::prelude::*;

use super::energy::{Energy, Lanes};
use super::points::{GROUP, SurfacePoints};

/// The label of a point without a sphere.
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
/// before are where the search starts; the answer does not depend on them.
pub(super) fn assign(
    points: &SurfacePoints,
    energy: Energy,
    spheres: &[Sphere],
    labels: &mut [u32],
) {
    let search = || (Vec::new(), Lanes::default());
    labels.par_chunks_mut(GROUP).zip(&points.groups).enumerate().for_each_init(
        search,
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
    let reach = |weight: f64| (worst / weight).sqrt() * SLACK.0 + SLACK.1 + group.radius;
    let (outside, inside) = (reach(lambda), reach(1.0 + lambda));
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
        let labelled = || (0..).zip(labels).filter(|&(_, &label)| label != NONE);
        labelled().for_each(|(_, &label)| start[label as usize + 1] += 1);
        for sphere in 0..spheres {
            start[sphere + 1] += start[sphere];
        }
        let mut next = start.clone();
        let mut members = vec![0; start[spheres] as usize];
        for (v, &label) in labelled() {
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
/// largest cluster stays whatever its size. Returns the clusters that are left.
pub(super) fn drop_small(spheres: &mut Vec<Sphere>, labels: &mut [u32], least: usize) -> Clusters {
    let clusters = Clusters::of_labels(labels, spheres.len());
    let size = |s: usize| clusters.of(s).len();
    let largest = (0..spheres.len()).rev().max_by_key(|&s| size(s));
    let keeps = |s: usize| size(s) >= least || Some(s) == largest;
    if (0..spheres.len()).all(keeps) {
        return clusters;
    }
    let mut renamed = vec![NONE; spheres.len()];
    let kept: Vec<usize> = (0..spheres.len()).filter(|&s| keeps(s)).collect();
    (0..).zip(&kept).for_each(|(new, &old)| renamed[old] = new);
    for label in labels.iter_mut().filter(|label| **label != NONE) {
        *label = renamed[*label as usize];
    }
    *spheres = kept.iter().map(|&s| spheres[s]).collect();
    Clusters::of_labels(labels, spheres.len())
}
