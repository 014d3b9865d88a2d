//! Why points cannot be triangulated.

use crate::Vec3;
use crate::predicates::MAX_COORDINATE;

/// Why points have no triangulation.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TriangulationError {
    /// A coordinate is infinite or not a number.
    #[error("point {index} has a coordinate that is not finite: {point}")]
    NotFinite {
        /// Index of the first such point.
        index: usize,
        /// The point.
        point: Vec3,
    },
    /// A coordinate is so large that products of coordinates overflow.
    #[error(
        "point {index} ({point}) exceeds {MAX_COORDINATE:e} in absolute value, \
         beyond which products of coordinates overflow: scale the points down"
    )]
    OutOfRange {
        /// Index of the first such point.
        index: usize,
        /// The point.
        point: Vec3,
    },
    /// A weight is infinite, not a number, or beyond the square of the largest coordinate.
    #[error("point {index} has the unusable weight {weight:e}")]
    Weight {
        /// Index of the first such point.
        index: usize,
        /// Its weight.
        weight: f64,
    },
    /// A ball's radius is negative, infinite, or not a number.
    #[error("ball {index} has the unusable radius {radius:e}")]
    Radius {
        /// Index of the first such ball.
        index: usize,
        /// Its radius.
        radius: f64,
    },
    /// There is not one weight for each point.
    #[error("{points} points but {weights} weights")]
    WeightCount {
        /// Number of points.
        points: usize,
        /// Number of weights.
        weights: usize,
    },
    /// Fewer than four distinct points.
    #[error("{distinct} distinct points among {points}: a tetrahedron needs four")]
    TooFewPoints {
        /// Number of points given.
        points: usize,
        /// Number of distinct positions among them.
        distinct: usize,
    },
    /// All points lie on one line.
    #[error("all {distinct} distinct points lie on one line: there is no tetrahedron")]
    Collinear {
        /// Number of distinct positions.
        distinct: usize,
    },
    /// All points lie in one plane. Triangulations of the plane are not offered here;
    /// [`DualComplex::of_balls`](crate::DualComplex::of_balls) takes flat input, and fewer points,
    /// too.
    #[error("all {distinct} distinct points lie in one plane: there is no tetrahedron")]
    Coplanar {
        /// Number of distinct positions.
        distinct: usize,
    },
    /// More points or cells than 32-bit ids can name.
    #[error("{points} points need more than {limit} cells, the most that 32-bit ids can name")]
    TooLarge {
        /// Number of points given.
        points: usize,
        /// Largest number of cells.
        limit: usize,
    },
}
