//! Branch and bound for the largest of some distances over pieces of a surface or of space.
//!
//! 1. All pieces of one round are bounded in parallel: a distance that is reached in the piece, and an upper
//!    bound of all its distances.
//! 2. The reached distances raise the lower bound, in the order of the pieces.
//! 3. Pieces whose upper bound exceeds the lower one by more than the search allows are divided; the parts
//!    are the next round.
//!
//! The result is the same for any number of threads, because the lower bound changes only between rounds.

use rayon::prelude::*;

use super::error::MetricError;
use crate::Vec3;

/// Bound on the rounding error of a distance, in units of the surface's diagonal.
pub const ROUNDING: f64 = 1e-9;

/// Smallest tolerance of an interval, in diagonals: of a smaller one rounding would be a part.
pub const FINEST: f64 = 1e-6;

/// Bounds of the distances in a piece.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bound {
    /// The distance at `at`; 0 or less if that point is not known to be in the piece.
    pub reached: f64,
    /// A point of the piece.
    pub at: Vec3,
    /// No distance in the piece exceeds it.
    pub upper: f64,
}

impl Bound {
    /// Of a piece in which no point is known.
    pub fn above(upper: f64) -> Self {
        Self { reached: f64::NEG_INFINITY, at: Vec3::ZERO, upper }
    }
}

/// Pieces with distances.
pub(super) trait Pieces: Sync {
    /// One of them.
    type Piece: Send + Sync;
    /// What the pieces of a run hand on to the next one, which is mostly near.
    type Near;

    /// Number of pieces that one thread bounds one after the other.
    const RUN: usize = 64;

    /// What the first piece of a run gets.
    fn near(&self) -> Self::Near;

    /// Prepares a round, when `lower` is reached.
    fn begin(&mut self, _pieces: &[Self::Piece], _lower: f64) {}

    /// The upper bound up to which a piece is not divided, when `lower` is reached.
    fn enough(&self, lower: f64) -> f64;

    /// Bounds a piece. An upper bound below `enough` need not be improved; `lower` is reached somewhere.
    fn bound(
        &self,
        piece: &mut Self::Piece,
        lower: f64,
        enough: f64,
        near: &mut Self::Near,
    ) -> Bound;

    /// Receives each bound of a round, in the order of the pieces.
    fn collect(&mut self, _bound: &Bound) {}

    /// Drops some of the pieces to be divided, each with its upper bound.
    fn limit(&self, _open: &mut Vec<(f64, &Self::Piece)>) {}

    /// Appends pieces that together cover a piece.
    fn divide(&self, piece: &Self::Piece, parts: &mut Vec<Self::Piece>);
}

/// The bounds of the largest distance, as far as they are known.
#[derive(Clone, Copy, Debug)]
pub(super) struct Largest {
    /// A distance that is reached.
    pub lower: f64,
    /// The point at which it is, once a piece raised it.
    pub witness: Option<Vec3>,
    /// The largest upper bound of a piece that was not divided.
    pub upper: f64,
    /// Number of pieces that were bounded.
    pub pieces: u64,
}

impl Largest {
    /// Nothing above `lower` is known.
    pub fn above(lower: f64) -> Self {
        Self { lower, witness: None, upper: f64::NEG_INFINITY, pieces: 0 }
    }

    /// Takes a distance that is reached at a point.
    pub fn raise(&mut self, reached: f64, at: Vec3) {
        if reached > self.lower {
            (self.lower, self.witness) = (reached, Some(at));
        }
    }

    /// Divides pieces until none of them matters.
    ///
    /// # Errors
    /// When a round has more than `most` pieces.
    pub fn search<P: Pieces>(
        &mut self,
        side: &mut P,
        mut pieces: Vec<P::Piece>,
        most: usize,
    ) -> Result<(), MetricError> {
        while !pieces.is_empty() {
            self.pieces += pieces.len() as u64;
            side.begin(&pieces, self.lower);
            let (lower, enough, shared) = (self.lower, side.enough(self.lower), &*side);
            let bounds = pieces.par_chunks_mut(P::RUN).flat_map_iter(|run| {
                let mut near = shared.near();
                let bounds = run.iter_mut().map(|p| shared.bound(p, lower, enough, &mut near));
                bounds.collect::<Vec<_>>()
            });
            let bounds: Vec<Bound> = bounds.collect();
            for bound in &bounds {
                self.raise(bound.reached, bound.at);
                side.collect(bound);
            }
            let enough = side.enough(self.lower);
            let mut open = Vec::new();
            for (piece, bound) in pieces.iter().zip(bounds) {
                if bound.upper <= enough {
                    self.upper = self.upper.max(bound.upper);
                } else {
                    open.push((bound.upper, piece));
                }
            }
            side.limit(&mut open);
            let mut parts = Vec::new();
            for (_, piece) in open {
                side.divide(piece, &mut parts);
                if parts.len() > most {
                    let tolerance = enough - self.lower;
                    return Err(MetricError::TooFine { tolerance, pieces: most });
                }
            }
            pieces = parts;
        }
        Ok(())
    }
}

/// # Errors
/// When the tolerance of an interval is out of range.
pub(super) fn check_tolerance(tolerance: f64) -> Result<(), MetricError> {
    let is_in_range = (FINEST..=1.0).contains(&tolerance);
    if is_in_range { Ok(()) } else { Err(MetricError::Tolerance(tolerance)) }
}
