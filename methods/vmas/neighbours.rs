//! The nearest samples of each sample.

use std::f64::consts::PI;

use medial::Vec3;
use medial::geometry::trees::PointTree;
use rayon::prelude::*;

/// Samples in the first disc that is searched, as a multiple of those wanted: seldom is it too small.
const AMPLE: f64 = 1.8;

/// The `count` nearest points of each point, itself among them, by distance and then id; listed one point
/// after another. There are at least `count` points, spread over so much area.
pub(super) fn nearest(points: &[Vec3], area: f64, count: usize) -> Vec<u32> {
    let tree = PointTree::new(points);
    let guess = AMPLE * count as f64 * area / (PI * points.len() as f64);
    let of_point = |&p: &Vec3| {
        let mut squared = guess.max(f64::MIN_POSITIVE);
        let mut near = tree.within(p, squared);
        while near.len() < count {
            squared *= 2.0;
            near = tree.within(p, squared);
        }
        let mut near: Vec<(f64, u32)> =
            near.into_iter().map(|id| (points[id as usize].distance_squared(p), id)).collect();
        near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        near.truncate(count);
        near
    };
    points.par_iter().flat_map_iter(|p| of_point(p).into_iter().map(|(_, id)| id)).collect()
}

/// The pairs of points of which one is among the nearest of the other, ascending, in ascending order.
pub(super) fn links_of(nearest: &[u32], count: usize) -> Vec<[u32; 2]> {
    let lists = nearest.chunks(count.max(1)).enumerate();
    let of_point = |(v, list): (usize, &[u32])| {
        let v = v as u32;
        list.iter()
            .filter(move |&&w| w != v)
            .map(move |&w| [v.min(w), v.max(w)])
            .collect::<Vec<_>>()
    };
    let mut links: Vec<[u32; 2]> = lists.flat_map(of_point).collect();
    links.par_sort_unstable();
    links.dedup();
    links
}
