//! The places of the largest errors of a mesh, which join the samples as witnesses.
//!
//! Witnesses are found by local ascent and a sweep of both sides, and among the points inside.

use std::collections::HashSet;

use medial::Vec3;
use medial::metrics::PeakSearch;

use super::descent::Descent;
use super::goal::{
    ASIDE, DEEP, Goal, Interior, Points, Sample, held_from, refused, uncovered, union_of,
};
use crate::Result;

/// Share of the largest error above which errors are witnesses.
const WITNESS: f64 = 0.6;

/// Limit of the witnesses of each kind and search, the largest errors first.
const WITNESSES: usize = 300;

/// Side of cubes that hold at most one witness of a kind, as a share of the largest error. The depth of a pocket falls by the
/// distance from its bottom: cubes as large as the error would hide a tenth of it.
const APART: f64 = 0.1;
/// Largest side of these cubes, a fraction of the diagonal.
const FARTHEST: f64 = 1e-3;

/// The search for the places of the largest errors.
pub(super) struct Witnesses<'a> {
    goal: &'a Goal,
    search: PeakSearch<'a>,
    /// Cubes that have a witness of a kind, with the binary logarithm of their side.
    seen: HashSet<(u8, i32, [i64; 3])>,
}

impl<'a> Witnesses<'a> {
    /// # Errors
    /// When the surface has no area.
    pub fn new(goal: &'a Goal) -> Result<Self> {
        let search = goal.peaks().map_err(refused)?;
        Ok(Self { goal, search, seen: HashSet::new() })
    }

    /// Adds the places of the largest errors to the samples of a descent. Returns the error of its mesh, both ways. Both
    /// surfaces are swept unless an ascent finds an error of `swept_below`.
    ///
    /// # Errors
    /// When the mesh has no union.
    pub fn join(&mut self, descent: &mut Descent<'_>, swept_below: f64) -> Result<f64> {
        let Self { goal, search, .. } = self;
        let peaks = search.of(&descent.mesh, swept_below).map_err(refused)?;
        let pool: Vec<Vec3> = goal.pool.iter().map(|inside| inside.point).collect();
        let enough = |i: usize| Some(held_from(goal.pool[i].depth.min(DEEP)));
        let nearest = union_of(&descent.mesh)?.deepest_batch_near(&pool, &[], enough);
        let signed: Vec<f64> = nearest.iter().map(|nearest| nearest.signed).collect();
        // The union's boundary at a distance `sigma` from a point that it does not hold is as deep as that
        // point, less `sigma`. This finds pockets that samples of the boundary miss.
        let pockets = goal.pool.iter().zip(&signed).filter(|&(_, &signed)| signed > 0.0);
        let pockets = pockets.map(|(inside, signed)| inside.depth - signed);
        let error = pockets.fold(peaks.hausdorff(), f64::max);
        let [forward, reverse] = [&peaks.forward, &peaks.reverse].map(|peaks| {
            let large = peaks.iter().take_while(|peak| peak.distance > WITNESS * error);
            large.map(|peak| peak.point).collect()
        });
        let mut gaps: Vec<(f64, Vec3)> = (self.goal.pool.iter().zip(&signed))
            .map(|(inside, &signed)| (uncovered(inside.depth.min(DEEP), signed), inside.point))
            .filter(|&(gap, _)| gap > WITNESS * error)
            .collect();
        gaps.sort_by(|x, y| y.0.total_cmp(&x.0));
        let side = (APART * error).min(FARTHEST).log2().floor() as i32;
        let on_surface = self.new_ones((0, side), forward);
        let samples = on_surface.into_iter().map(|point| Sample { point, weight: 1.0 }).collect();
        let exposed = self.new_ones((1, side), reverse);
        let gaps = self.new_ones((2, side), gaps.into_iter().map(|(_, point)| point).collect());
        // Boundary inside the solid is a pocket. Boundary outside protrudes.
        let weights = exposed.iter().map(|_| 1.0).chain(gaps.iter().map(|_| ASIDE));
        let places = [&exposed[..], &gaps].concat();
        let depths = self.goal.depths(&places).into_iter().map(|depth| depth.value);
        let places = places.into_iter().zip(depths).zip(weights);
        let places = places.map(|((point, depth), weight)| Interior { point, depth, weight });
        let (interior, outside): (Vec<_>, Vec<_>) = places.partition(|place| place.depth > 0.0);
        let outside = descent.unwatched(outside.into_iter().map(|place| place.point).collect())?;
        descent.join(Points { samples, interior, outside })?;
        Ok(error)
    }

    /// The first witnesses of a kind, of each cube one.
    fn new_ones(&mut self, (kind, side): (u8, i32), points: Vec<Vec3>) -> Vec<Vec3> {
        let new = points.into_iter().filter(|&point| {
            let cube = (point / f64::from(side).exp2()).floor().to_array().map(|x| x as i64);
            self.seen.insert((kind, side, cube))
        });
        new.take(WITNESSES).collect()
    }
}
