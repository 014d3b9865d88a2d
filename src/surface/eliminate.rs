//! Blue noise by weighted sample elimination.
//!
//! C. Yuksel, Sample elimination for generating Poisson disk sample sets, Computer Graphics Forum
//! 34 (2015), 10.1111/cgf.12538.
//!
//! 1. Maximal radius (eq. 3, area): `r = sqrt(A / (2 sqrt(3) N))`, half the spacing of the densest
//!    packing of `N` points on the area `A`.
//! 2. Weight of each sample (eq. 4): the sum over samples `j` within `2 r` of
//!    `(1 - d / 2r)^8`, with `d` not below the `2 r_min` of eq. 5,
//!    `r_min = r (1 - (N / M)^1.5) 0.65`, so that clusters do not decide alone.
//! 3. Remove the heaviest sample and subtract its contribution from the weights of its neighbours.
//!    Repeat until `N` of the `M` samples are left.
//!
//! Deviations from the paper:
//! - Samples whose faces look in opposite directions are not neighbours: on a thin wall the two
//!   sides are sampled independently, which a Voronoi diagram needs to separate them.
//! - Of equally heavy samples the one with the smaller index is removed.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use rayon::prelude::*;

use crate::Vec3;

const ALPHA: i32 = 8;
const BETA: f64 = 0.65;
const GAMMA: f64 = 1.5;

/// Indices, ascending, of the `count` points to keep. Points are in a unit in which neither their
/// extent nor `area` overflows when squared.
pub(super) fn eliminate(points: &[Vec3], normals: &[Vec3], area: f64, count: usize) -> Vec<u32> {
    if points.len() <= count {
        return (0..points.len() as u32).collect();
    }
    if count == 0 {
        return Vec::new();
    }
    let radius = (area / (2.0 * 3.0_f64.sqrt() * count as f64)).sqrt();
    let neighbours = Neighbours::within(points, normals, 2.0 * radius);
    let share = count as f64 / points.len() as f64;
    let least = 2.0 * radius * (1.0 - share.powf(GAMMA)) * BETA;
    let weight = |distance: f64| (1.0 - distance.max(least) / (2.0 * radius)).max(0.0).powi(ALPHA);

    let mut weights: Vec<f64> = (0..points.len())
        .map(|i| neighbours.of(i).iter().map(|&(_, d)| weight(f64::from(d))).sum())
        .collect();
    let mut heap: BinaryHeap<Heaviest> =
        (0..).zip(&weights).map(|(sample, &weight)| Heaviest { weight, sample }).collect();
    let mut kept = vec![true; points.len()];
    let mut left = points.len();
    while left > count {
        let Some(Heaviest { weight: recorded, sample }) = heap.pop() else { break };
        let current = weights[sample as usize];
        // Weights only fall, so an old entry is an upper bound: put it back at its present weight.
        if recorded != current {
            heap.push(Heaviest { weight: current, sample });
            continue;
        }
        kept[sample as usize] = false;
        left -= 1;
        for &(other, distance) in neighbours.of(sample as usize) {
            weights[other as usize] -= weight(f64::from(distance));
        }
    }
    (0..points.len() as u32).filter(|&i| kept[i as usize]).collect()
}

/// An entry of the heap: largest weight first, then smallest index.
struct Heaviest {
    weight: f64,
    sample: u32,
}

impl Ord for Heaviest {
    fn cmp(&self, other: &Self) -> Ordering {
        self.weight.total_cmp(&other.weight).then(other.sample.cmp(&self.sample))
    }
}

impl PartialOrd for Heaviest {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Heaviest {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Heaviest {}

/// For each sample the others near it and their distances.
struct Neighbours {
    start: Vec<usize>,
    near: Vec<(u32, f32)>,
}

/// Cells along one axis; three indices fit 64 bits.
const CELLS: f64 = (1 << 20) as f64;

impl Neighbours {
    /// All pairs closer than `reach` on faces that do not look in opposite directions.
    fn within(points: &[Vec3], normals: &[Vec3], reach: f64) -> Self {
        let lo = points.iter().fold(Vec3::INFINITY, |lo, &p| lo.min(p));
        let hi = points.iter().fold(Vec3::NEG_INFINITY, |hi, &p| hi.max(p));
        let size = reach.max((hi - lo).max_element() / CELLS);
        // One cell of margin, so that the cells beside a cell always have a valid number.
        let cell = |p: Vec3| ((p - lo) / size).to_array().map(|x| x as u64 + 1);
        let key = |[x, y, z]: [u64; 3]| (x << 42) | (y << 21) | z;
        let mut order: Vec<(u64, u32)> =
            (0..).zip(points).map(|(i, &p)| (key(cell(p)), i)).collect();
        order.sort_unstable();
        let near_of = |i: usize| {
            let [x, y, z] = cell(points[i]);
            let mut near = Vec::new();
            for (x, y) in (x - 1..=x + 1).flat_map(|x| (y - 1..=y + 1).map(move |y| (x, y))) {
                // Keys of three cells along z are consecutive: one search instead of three.
                let (first, last) = (key([x, y, z - 1]), key([x, y, z + 1]));
                let from = order.partition_point(|&(k, _)| k < first);
                for &(_, j) in order[from..].iter().take_while(|&&(k, _)| k <= last) {
                    let distance = points[i].distance(points[j as usize]);
                    let faces_away = normals[i].dot(normals[j as usize]) < 0.0;
                    if j as usize != i && distance < reach && !faces_away {
                        near.push((j, distance as f32));
                    }
                }
            }
            near
        };
        let lists: Vec<Vec<(u32, f32)>> = (0..points.len()).into_par_iter().map(near_of).collect();
        let mut start = vec![0];
        for list in &lists {
            start.push(start[start.len() - 1] + list.len());
        }
        Self { start, near: lists.concat() }
    }

    fn of(&self, sample: usize) -> &[(u32, f32)] {
        &self.near[self.start[sample]..self.start[sample + 1]]
    }
}
