//! A sweep of both surfaces for places farther from the other one than those known so far.
//!
//! Ascent ([`super::ascent`]) begins at samples. Where a union follows a surface closely, its peaks are
//! narrower than the samples' spacing, and as high as each other: no ascent begins at most of them. The
//! sweep divides both surfaces like the certificate ([`super::certificate`]) until no piece seems to
//! exceed the largest distance by more than a share. It is faster, and proves nothing:
//!
//! 1. The change of a distance within a piece is estimated by its gradient at the centre.
//! 2. A piece inherits the closest face and the deepest primitive of the piece that it is a part of.
//!    Mostly one of these shows that the piece is irrelevant.
//! 3. The number of pieces is limited. Those with the largest bounds come first.

use super::ascent::{Hill, Peak, Start, ascend};
use super::bounds::{Bound, Largest, Pieces};
use super::depth::{Boundary, DOUBT};
use super::pieces::{
    EXPOSED, Patches, Piece, farthest, largest_distance, planar_frames, quartered,
};
use crate::Vec3;
use crate::complex::{MedialUnion, Primitive};
use crate::geometry::planar_frame::PlanarFrame;
use crate::surface::{TriMesh, TriangleBvh};

/// Excess over the largest known distance, as a share of it, below which a piece is not divided for a final figure.
pub(super) const FINAL_SHARE: f64 = 0.005;

/// Excess over the largest known distance, as a share of the diameter, below which no piece is divided.
const FLOOR: f64 = 1e-6;

/// Extent of a piece, in largest distances, above which its distance rarely bounds it.
const COARSE: f64 = 4.0;

/// Limit of pieces for each sample.
const PIECES: usize = 16;

/// Limit of pieces for any number of samples.
const MOST_PIECES: usize = 1 << 18;

/// Limit of pieces of the boundary in all searches of one round.
const SEARCHED: usize = 1 << 18;

/// Limit of distances of the sweep from which an ascent starts.
const SEEDS: usize = 6;

/// First step of these ascents, as a share of the largest distance.
const NARROW: f64 = 0.25;

/// The peaks of both surfaces that are farther from the other one than `known` by more than a `share`, from the
/// surface first.
pub(super) fn swept(
    surface: (&TriMesh, &TriangleBvh),
    boundary: &Boundary<'_>,
    (on_mesh, on_union): (&impl Hill, &impl Hill),
    start: &Start<'_>,
    (known, share): (f64, f64),
) -> [Vec<Peak>; 2] {
    let side = SweptSurface { boundary };
    let triangles = (0..surface.0.faces.len()).map(|face| (surface.0.triangle(face), None));
    let forward = peaks_above(&side, triangles.collect(), (on_mesh, start), (known, share));
    let forward = boundary.proven(forward);
    let known = forward.iter().fold(known, |most, peak| most.max(peak.distance));
    let Boundary { union, patches, .. } = boundary;
    let side = SweptUnion { bvh: surface.1, triangles: planar_frames(surface.0), union, patches };
    let pieces = patches.pieces().into_iter().map(|piece| (piece, None)).collect();
    let reverse = peaks_above(&side, pieces, (on_union, start), (known, share));
    [forward, reverse]
}

/// Where the searches for the piece before ended, and how much they left.
struct Near {
    place: usize,
    face: Option<u32>,
    /// Number of pieces of the boundary that may still be searched.
    left: usize,
}

/// Pieces that are swept: the largest ones are divided, and all distances above a known one are collected.
struct Swept<'a, S> {
    side: &'a S,
    /// A piece is divided if it exceeds the largest distance by more than this share, or at least `floor`.
    share: f64,
    floor: f64,
    known: f64,
    /// Number of pieces that may still be bounded.
    left: usize,
    /// Number of pieces of the boundary that a run of this round may search.
    searched: usize,
    points: Vec<Vec3>,
    values: Vec<f64>,
}

/// The peaks of one surface that are farther from the other one than `known`, at most [`SEEDS`]. Samples
/// gave `start`, which also limits the number of pieces.
fn peaks_above<S: Surface>(
    side: &S,
    pieces: Vec<S::Piece>,
    (hill, start): (&impl Hill, &Start<'_>),
    (known, share): (f64, f64),
) -> Vec<Peak> {
    let left = (PIECES * start.points.len()).min(MOST_PIECES);
    let floor = FLOOR * start.pose.diameter();
    let (points, values) = (Vec::new(), Vec::new());
    let mut swept = Swept { side, share, floor, known, left, searched: 0, points, values };
    let mut largest = Largest::above(known);
    largest.search(&mut swept, pieces, usize::MAX).expect("the number of pieces is limited");
    let (points, values) = (&swept.points[..], &swept.values[..]);
    let spacing = NARROW * largest.lower;
    ascend(hill, &Start { points, values, spacing, seeds: SEEDS, ..*start })
}

impl<S: Surface> Pieces for Swept<'_, S> {
    type Piece = S::Piece;
    type Near = Near;
    const RUN: usize = 256;

    fn near(&self) -> Near {
        Near { place: 0, face: None, left: self.searched }
    }

    fn begin(&mut self, pieces: &[Self::Piece], _: f64) {
        self.left = self.left.saturating_sub(pieces.len());
        self.searched = SEARCHED / pieces.len().div_ceil(Self::RUN);
    }

    fn enough(&self, lower: f64) -> f64 {
        lower + f64::max(self.share * lower, self.floor)
    }

    fn bound(&self, piece: &mut Self::Piece, _: f64, enough: f64, near: &mut Near) -> Bound {
        self.side.bound(piece, enough, near).unwrap_or(Bound::above(0.0))
    }

    fn collect(&mut self, bound: &Bound) {
        if bound.reached > self.known {
            self.points.push(bound.at);
            self.values.push(bound.reached);
        }
    }

    fn limit(&self, open: &mut Vec<(f64, &Self::Piece)>) {
        if open.len() > self.left / 4 {
            open.sort_by(|(a, _), (b, _)| b.total_cmp(a));
            open.truncate(self.left / 4);
        }
    }

    fn divide(&self, piece: &Self::Piece, parts: &mut Vec<Self::Piece>) {
        self.side.divide(piece, parts);
    }
}

/// A surface to be swept.
trait Surface: Sync {
    /// A part of the surface.
    type Piece: Send + Sync;

    /// Bounds a piece: `None` if it does not exceed `enough`.
    fn bound(&self, piece: &mut Self::Piece, enough: f64, near: &mut Near) -> Option<Bound>;

    /// Appends pieces that together cover a piece.
    fn divide(&self, piece: &Self::Piece, parts: &mut Vec<Self::Piece>);
}

/// The largest rise of a linear function from a point to some others.
fn rise(gradient: Vec3, from: Vec3, corners: &[Vec3]) -> f64 {
    corners.iter().fold(0.0, |rise, &corner| f64::max(rise, gradient.dot(corner - from)))
}

/// The triangles of a surface, with distances to the boundary of a union.
struct SweptSurface<'a> {
    boundary: &'a Boundary<'a>,
}

impl Surface for SweptSurface<'_> {
    /// A triangle, and a point outside the union that was near to the triangle that it is a part of.
    type Piece = ([Vec3; 3], Option<Vec3>);

    fn bound(
        &self,
        (corners, outside): &mut Self::Piece,
        enough: f64,
        near: &mut Near,
    ) -> Option<Bound> {
        let Boundary { union, patches, .. } = self.boundary;
        let centre = (corners[0] + corners[1] + corners[2]) / 3.0;
        let (deepest, attained_at) = union.deepest_from(centre, &mut near.place);
        let mut depth = self.boundary.from(centre, deepest.signed, attained_at, &mut near.place);
        if let Some(outside) = *outside
            && deepest.signed < 0.0
        {
            depth = depth.with(centre, outside);
        }
        let reach = farthest(centre, corners);
        if !self.boundary.is_exact(&depth) {
            depth = self.boundary.nearer(centre, depth);
            if depth.upper + reach > enough && depth.upper - depth.lower > DOUBT * reach {
                let doubt = DOUBT * reach;
                depth = self.boundary.within(centre, depth, [0.5 * doubt, 0.0], &mut near.left);
                // Parts of a piece do not resolve what a search that had to end left open.
                depth.upper = depth.upper.min(depth.lower + doubt);
            }
            *outside = depth.outside;
        }
        if depth.upper + reach <= enough {
            return None;
        }
        let above = patches.largest_over(deepest.primitive, corners);
        // Inside, the distance grows away from the nearest point outside.
        let (gradient, here) = match deepest.signed < 0.0 {
            true => (depth.outside.map_or(Vec3::ZERO, |outside| centre - outside), depth.upper),
            false => (attained_at.map_or(Vec3::ZERO, |c| c - centre), -deepest.signed),
        };
        let upper = above.max(here + rise(gradient.normalize_or_zero(), centre, corners));
        (upper > enough).then_some(Bound { at: centre, reached: depth.lower, upper })
    }

    fn divide(&self, (triangle, outside): &Self::Piece, parts: &mut Vec<Self::Piece>) {
        parts.extend(quartered(*triangle, Vec3::midpoint).map(|part| (part, *outside)));
    }
}

/// The surfaces of all primitives, with distances from a surface.
struct SweptUnion<'a> {
    bvh: &'a TriangleBvh,
    triangles: Vec<PlanarFrame>,
    union: &'a MedialUnion,
    patches: &'a Patches<'a>,
}

/// A piece, the face that is closest to it and the primitive that is deepest there.
type Hinted = (Piece, Option<(u32, Primitive)>);

impl Surface for SweptUnion<'_> {
    type Piece = Hinted;

    fn bound(&self, (piece, hint): &mut Hinted, enough: f64, near: &mut Near) -> Option<Bound> {
        if self.patches.is_overtopped(piece) {
            return None;
        }
        let enclosure = self.patches.enclose(piece);
        let (centre, corners) = (enclosure.centre, enclosure.corners());
        let reach = enclosure.reach();
        if let Piece::Round(_, [a, b, c]) = *piece
            && reach > COARSE * enough
            && self.patches.is_overtopped_along(piece, &[(a + b + c).normalize()])
        {
            // Too large for a bound by its distance, and buried.
            return Some(Bound::above(f64::INFINITY));
        }
        let from_face = |face: u32| largest_distance(&self.triangles[face as usize], corners);
        if let Some((face, primitive)) = *hint
            && (self.patches.largest_over(primitive, corners) < -EXPOSED
                || from_face(face) <= enough)
        {
            return None;
        }
        let closest = self.bvh.closest_from(centre, hint.map_or(near.face, |(face, _)| Some(face)));
        near.face = Some(closest.face);
        let distance = closest.distance;
        let away = (centre - closest.point).try_normalize().unwrap_or_default();
        let upper = (distance + reach).min(from_face(closest.face));
        let upper = upper.min(distance + rise(away, centre, corners));
        if upper <= enough {
            return None;
        }
        let deepest = self.patches.unburied(self.union, piece, &enclosure, &mut near.place)?;
        *hint = Some((closest.face, deepest.primitive));
        let reached = if deepest.signed >= -EXPOSED { distance } else { 0.0 };
        Some(Bound { at: centre, reached, upper })
    }

    fn divide(&self, (piece, hint): &Hinted, parts: &mut Vec<Hinted>) {
        let mut divided = Vec::with_capacity(4);
        self.patches.divide(piece, &mut divided);
        parts.extend(divided.into_iter().map(|part| (part, *hint)));
    }
}
