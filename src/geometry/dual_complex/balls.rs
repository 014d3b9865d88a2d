//! Regular triangulations of balls whose centres need not span space.

use crate::Vec3;
use crate::predicates::MAX_COORDINATE;
use crate::{Regular, Sphere, TriangulationError};

/// Triangulates balls with their squared radii as weights, with four anchors after them if that
/// is needed to span space.
pub(super) fn triangulated(balls: &[Sphere]) -> Result<Regular, TriangulationError> {
    for (index, ball) in balls.iter().enumerate() {
        if ball.radius < 0.0 || !ball.radius.is_finite() {
            return Err(TriangulationError::Radius { index, radius: ball.radius });
        }
    }
    let mut points: Vec<Vec3> = balls.iter().map(|b| b.centre).collect();
    let mut weights: Vec<f64> = balls.iter().map(|b| b.radius * b.radius).collect();
    match Regular::new(&points, &weights) {
        Err(
            TriangulationError::TooFewPoints { .. }
            | TriangulationError::Collinear { .. }
            | TriangulationError::Coplanar { .. },
        ) => {}
        result => return result,
    }
    let (anchors, weight) = anchors(&points);
    points.extend(anchors);
    weights.extend([weight; 4]);
    Regular::new(&points, &weights)
}

/// Four points that span space, the first of them at the first centre, and their weight.
///
/// Any positions and any negative weight are right. The step between them is a power of two about
/// as long as the centres' extent, so that numbers stay short, and goes towards the origin, so that
/// none is out of range.
fn anchors(centres: &[Vec3]) -> ([Vec3; 4], f64) {
    let origin = centres.first().copied().unwrap_or(Vec3::ZERO);
    let extent = centres.iter().map(|c| (*c - origin).abs().max_element()).fold(0.0, f64::max);
    // At least a hundred times the spacing of doubles at the origin.
    let least = (origin.abs().max_element() * 1e-13).max(1e-30);
    let length = (extent / 2.0).clamp(least, MAX_COORDINATE);
    let step = f64::powi(2.0, length.log2().floor() as i32);
    let along = |k: usize| {
        let mut anchor = origin.to_array();
        anchor[k] -= if anchor[k] < 0.0 { -step } else { step };
        Vec3::from_array(anchor)
    };
    ([origin, along(0), along(1), along(2)], -step * step)
}
