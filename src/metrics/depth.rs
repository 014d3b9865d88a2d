//! Distances from points in a union to its boundary.
//!
//! For a point `p` in the union, `-sigma(p)`, the depth in the deepest single primitive, is only a lower
//! bound of this distance: primitives that overlap can fill a cavity, and then the surface in the cavity
//! is deep in their union. With points `w` outside the union, each of which proves an upper bound
//! `|p - w|`, since the segment crosses the boundary:
//!
//! 1. [`Boundary::of`]: `p` leaves the deepest primitive, again and again, and ends at a `w`. Mostly the
//!    first exit leads outside, and both bounds are the same.
//! 2. [`Boundary::nearer`]: the nearest of some samples of the boundary, with rounding instead of a proof.
//! 3. [`Boundary::within`]: best first, over the pieces of all primitives' surfaces ([`super::pieces`]).
//!    A piece inside one primitive is not on the boundary; the centre of another one is a `w` if it is
//!    in none. The least distance of the pieces that are left bounds the depth from below.
//! 4. [`Boundary::deepest_of`]: of many points with upper bounds the largest depth. The largest bounds are
//!    searched by 3, until none that is left exceeds the largest depth.

use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;
use std::sync::OnceLock;

use rayon::prelude::*;

use super::ascent::Peak;
use super::pieces::{EXPOSED, Enclosure, Patches, Piece};
use crate::Vec3;
use crate::complex::{MedialUnion, NearestPrimitive};
use crate::geometry::trees::{PointTree, in_morton_order};

/// Limit of primitives left one after the other.
const MAX_EXITS: usize = 64;

/// Limit of pieces in all searches for the largest depth. Then it is a lower bound only.
const MAX_PIECES: usize = 1 << 21;

/// Width of the interval around a depth, as a share of the extent of a piece of the surface, above which a search halves
/// it.
pub(super) const DOUBT: f64 = 0.25;

/// Widths of the intervals around depths searched for the largest, as shares of it: first of all, then of those that may be.
const SHARES: [f64; 2] = [0.03, 1e-4];

/// Bounds on the distance from a point to the boundary of a union.
#[derive(Clone, Copy, Debug)]
pub(super) struct Depth {
    pub lower: f64,
    /// Infinite while no point outside the union is known.
    pub upper: f64,
    /// A point outside the union, at the distance `upper` or nearer.
    pub outside: Option<Vec3>,
}

impl Depth {
    /// With a further point outside.
    pub fn with(mut self, p: Vec3, outside: Vec3) -> Self {
        let distance = p.distance(outside);
        if distance < self.upper {
            (self.upper, self.outside) = (distance.max(self.lower), Some(outside));
        }
        self
    }
}

/// The boundary of a union, to be searched from inside.
pub(super) struct Boundary<'a> {
    pub union: &'a MedialUnion,
    pub patches: Patches<'a>,
    /// How far outside points are that are found outside: narrower gaps count as none.
    margin: f64,
    samples: Option<(PointTree, &'a [Vec3])>,
    /// Each with its centre and extent.
    initial: OnceLock<Vec<(Piece, Vec3, f64)>>,
}

impl<'a> Boundary<'a> {
    /// The boundary of the union of the primitives in `patches`.
    pub fn new(union: &'a MedialUnion, patches: Patches<'a>) -> Self {
        Self { margin: patches.gap(), union, patches, samples: None, initial: OnceLock::new() }
    }

    /// Whether the bounds agree up to the width of gaps that count as none.
    pub fn is_exact(&self, depth: &Depth) -> bool {
        // One exit ends a margin outside.
        depth.upper <= depth.lower + 3.0 * self.margin
    }

    /// The distance if both bounds agree, else the upper bound, if there is one.
    pub fn value(&self, depth: &Depth) -> f64 {
        let is_lower = self.is_exact(depth) || !depth.upper.is_finite();
        if is_lower { depth.lower } else { depth.upper }
    }

    /// Bounds for many points in their order, and the least distance to a primitive's surface, buried or not.
    pub fn readings(&self, points: &[Vec3]) -> Vec<(Depth, f64)> {
        in_morton_order(points, |near: &mut [usize; 3], p| {
            let (NearestPrimitive { signed, .. }, centre) =
                self.union.deepest_from(p, &mut near[0]);
            if signed >= 0.0 {
                // Outside of all primitives the least distance is the least unsigned one.
                return (self.from(p, signed, centre, &mut near[1]), signed);
            }
            let mu = self.union.unsigned_from(p, &mut near[2]);
            (self.from(p, signed, centre, &mut near[1]), mu)
        })
    }

    /// The values of the depths of points, improved by samples of the boundary, which are kept for
    /// [`nearer`](Self::nearer).
    pub fn values(&mut self, points: &[Vec3], depths: &[Depth], samples: &'a [Vec3]) -> Vec<f64> {
        if !depths.iter().all(|depth| self.is_exact(depth)) {
            self.samples = Some((PointTree::new(samples), samples));
        }
        let pairs = points.par_iter().zip(depths).with_min_len(1 << 9);
        pairs.map(|(&p, &depth)| self.value(&self.nearer(p, depth))).collect()
    }

    /// The distance to the boundary, or an upper bound, searched from the primitive at `near`.
    pub fn estimate(&self, p: Vec3, near: &mut usize) -> f64 {
        self.value(&self.nearer(p, self.of(p, near)))
    }

    /// The distance to the boundary from a point on either side, searched from the primitive at `near`.
    pub fn of(&self, p: Vec3, near: &mut usize) -> Depth {
        let (NearestPrimitive { signed, .. }, centre) = self.union.deepest_from(p, near);
        self.from(p, signed, centre, near)
    }

    /// As [`of`](Self::of), for a point whose signed distance and nearest centre are known.
    pub fn from(&self, p: Vec3, signed: f64, centre: Option<Vec3>, near: &mut usize) -> Depth {
        if signed >= 0.0 || signed.is_nan() {
            return Depth { lower: signed, upper: signed, outside: None };
        }
        let depth = Depth { lower: -signed, upper: f64::INFINITY, outside: None };
        match self.leave(p, signed, centre, near) {
            Some(outside) => depth.with(p, outside),
            None => depth,
        }
    }

    /// A point outside, on the way that leaves the deepest primitive again and again.
    fn leave(&self, p: Vec3, signed: f64, centre: Option<Vec3>, near: &mut usize) -> Option<Vec3> {
        let (mut point, mut signed, mut centre) = (p, signed, centre);
        for _ in 0..MAX_EXITS {
            // From the very centre of a ball every way out is the same.
            let way = (point - centre?).try_normalize().unwrap_or(Vec3::X);
            point += (self.margin - signed) * way;
            let (nearest, next) = self.union.deepest_from(point, near);
            (signed, centre) = (nearest.signed, next);
            if signed >= 1e-3 * self.margin {
                return Some(point);
            }
        }
        None
    }

    /// Lowers the upper bound to the nearest sample of the boundary.
    pub fn nearer(&self, p: Vec3, depth: Depth) -> Depth {
        match &self.samples {
            Some((tree, samples)) if !self.is_exact(&depth) => match tree.nearest(p) {
                Some((id, _)) => depth.with(p, samples[id as usize]),
                None => depth,
            },
            _ => depth,
        }
    }

    /// The depth of `p` in an interval no wider than a tolerance, or that ends below a depth that is `enough`, from an
    /// interval that is known. The interval may be wider once no piece is `left`, from which those of this search are taken.
    pub fn within(
        &self,
        p: Vec3,
        known: Depth,
        [tolerance, enough]: [f64; 2],
        left: &mut usize,
    ) -> Depth {
        if *left == 0 {
            return known;
        }
        // Points outside are a margin off the boundary, and no search lowers the upper bound below that.
        let tolerance = tolerance.max(3.0 * self.margin);
        let mut depth = known;
        let (mut heap, mut near, mut parts, mut count) = (BinaryHeap::new(), 0, Vec::new(), 0);
        for &(piece, centre, reach) in self.initial() {
            if p.distance(centre) - reach < depth.upper {
                parts.push(piece);
            }
        }
        loop {
            for &piece in &parts {
                let enclosure = self.patches.enclose(&piece);
                let least = self.least(p, &piece, &enclosure).max(known.lower);
                if least < depth.upper {
                    heap.push(Reverse(Open { least, id: count, piece }));
                    count += 1;
                    *left = left.saturating_sub(1);
                }
            }
            let Some(Reverse(open)) = heap.pop() else { break };
            depth.lower = open.least.clamp(depth.lower, depth.upper);
            let is_known = depth.upper - depth.lower <= tolerance || depth.upper <= enough;
            if is_known || *left == 0 {
                return depth;
            }
            parts.clear();
            if self.patches.is_overtopped(&open.piece) {
                continue;
            }
            let enclosure = self.patches.enclose(&open.piece);
            let centre = enclosure.centre;
            let deepest = self.patches.unburied(self.union, &open.piece, &enclosure, &mut near);
            let Some(deepest) = deepest else { continue };
            if deepest.signed >= -EXPOSED && p.distance(centre) < depth.upper {
                let (found, from) = self.union.deepest_from(centre, &mut near);
                if let Some(outside) = self.leave(centre, found.signed, from, &mut near) {
                    depth = depth.with(p, outside);
                }
            }
            self.patches.divide(&open.piece, &mut parts);
        }
        // No piece is nearer than the upper bound.
        depth.lower = if depth.upper.is_finite() { depth.upper } else { depth.lower };
        depth
    }

    /// A lower bound of the distances from `p` to the points of a piece in an enclosure.
    fn least(&self, p: Vec3, piece: &Piece, enclosure: &Enclosure) -> f64 {
        use crate::complex::Primitive::{Edge, Sphere};
        // Farther along one direction than the nearest corner: of second order across that direction.
        let way = (enclosure.centre - p).normalize_or_zero();
        let heights = enclosure.corners().iter().map(|&corner| way.dot(corner - p));
        let ahead = heights.fold(f64::INFINITY, f64::min);
        // The piece is on the surface of a primitive, which is farther away than this.
        let primitive = match *piece {
            Piece::Flat(..) => return ahead,
            Piece::Round(v, _) => Sphere(v),
            Piece::Lateral(e, ..) => Edge(e),
        };
        ahead.max(self.patches.signed(primitive, p).abs())
    }

    fn initial(&self) -> &[(Piece, Vec3, f64)] {
        self.initial.get_or_init(|| {
            let enclosed = self.patches.pieces().into_iter().map(|piece| {
                let enclosure = self.patches.enclose(&piece);
                (piece, enclosure.centre, enclosure.reach())
            });
            enclosed.collect()
        })
    }

    /// The largest distance to the boundary of some points, each given with an upper bound of its distance; a
    /// lower bound of it after searches over too many pieces. With whether they were not too many.
    pub fn deepest_of(&self, mut peaks: Vec<Peak>) -> (Option<Peak>, bool) {
        peaks.sort_by(|a, b| b.distance.total_cmp(&a.distance));
        let (mut best, mut near, mut left): (Option<Peak>, _, _) = (None, 0, MAX_PIECES);
        let raise = |best: &mut Option<Peak>, point, distance| {
            if best.is_none_or(|best| best.distance < distance) {
                *best = Some(Peak { point, distance });
            }
        };
        let most = |best: Option<Peak>| best.map_or(f64::NEG_INFINITY, |best| best.distance);
        // Lower bounds of all come first: a search ends as soon as its upper bound is below the largest of them.
        let mut depths = Vec::new();
        for peak in &peaks {
            if peak.distance <= most(best) {
                break;
            }
            let mut depth = self.of(peak.point, &mut near);
            if !self.is_exact(&depth) {
                // Samples may lie on the boundary by rounding only: their distance is no proof.
                depth.upper = depth.upper.min(peak.distance * (1.0 + SHARES[1]) + self.margin);
            }
            raise(&mut best, peak.point, depth.lower);
            depths.push(depth);
        }
        for share in SHARES {
            for (peak, depth) in peaks.iter().zip(&mut depths) {
                let enough = most(best);
                if peak.distance <= enough || left == 0 {
                    break;
                }
                if !self.is_exact(depth) && depth.upper > enough {
                    // Without a point outside, the bound is infinite.
                    let tolerance = share * depth.upper.min(self.patches.diameter);
                    *depth = self.within(peak.point, *depth, [tolerance, enough], &mut left);
                    raise(&mut best, peak.point, depth.lower);
                }
            }
        }
        (best, left > 0)
    }

    /// Points with the deepest of them first, and no distance above its distance.
    pub fn proven(&self, mut peaks: Vec<Peak>) -> Vec<Peak> {
        let Some(deepest) = self.deepest_of(peaks.clone()).0 else { return peaks };
        peaks.iter_mut().for_each(|peak| peak.distance = peak.distance.min(deepest.distance));
        peaks.insert(0, deepest);
        peaks
    }
}

/// A piece that may hold the nearest point of the boundary. Ordered by its least distance, then by age.
struct Open {
    least: f64,
    id: usize,
    piece: Piece,
}

impl Ord for Open {
    fn cmp(&self, other: &Self) -> Ordering {
        self.least.total_cmp(&other.least).then(self.id.cmp(&other.id))
    }
}

impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Open {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Open {}
