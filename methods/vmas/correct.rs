//! Step 3: a fitted centre is pushed back to the medial axis.

use std::sync::Arc;

use medial::Vec3;
use medial::shape::{Shape, ShapeError};
use medial::surface::{InsideTest, Side, TriangleBvh};

use super::points::{SurfacePoints, area_vector};
use super::shrinking_ball::{Ball, Touched, shrinking_ball};

/// A centre nearer to the surface than this gives no direction; a fraction of the diagonal.
const ON_THE_SURFACE: f64 = 1e-12;

/// The solid that spheres are corrected in.
pub(super) struct Solid<'s> {
    shape: &'s Shape,
    pub tree: Arc<TriangleBvh>,
    inside: Arc<InsideTest>,
    /// The longest side of the bounding box, in diagonals.
    pub side: f64,
    touches_mesh: bool,
}

impl<'s> Solid<'s> {
    /// # Errors
    /// When the surface has no face.
    pub fn new(shape: &'s Shape, touches_mesh: bool) -> Result<Self, ShapeError> {
        let (tree, inside) = (shape.surface_tree()?, shape.inside_test());
        let side = shape.mesh().bounding_box().map_or(1.0, |(lo, hi)| (hi - lo).max_element());
        Ok(Self { shape, tree, inside, side, touches_mesh })
    }

    fn touched<'a>(&'a self, points: &'a SurfacePoints) -> Touched<'a> {
        if self.touches_mesh { Touched::Mesh(&self.tree) } else { Touched::Points(&points.nearest) }
    }

    /// The medial ball of a surface point; `None` where the faces around a vertex cancel.
    pub fn ball_at(&self, points: &SurfacePoints, v: usize) -> Option<Ball> {
        let (p, n) = (points.positions[v], points.normals[v]);
        let ball = || shrinking_ball(p, n, self.side, self.touched(points));
        (n != Vec3::ZERO).then(ball).filter(is_medial)
    }

    /// The medial ball of the surface point nearest to a fitted centre; `None` where there is none. The fitted
    /// radius has no part in it.
    pub fn corrected(&self, points: &SurfacePoints, fitted: Vec3) -> Option<Ball> {
        if !fitted.is_finite() {
            return None;
        }
        let closest = self.tree.closest(fitted);
        let outward = if closest.distance > ON_THE_SURFACE {
            let away = (closest.point - fitted) / closest.distance;
            if self.inside.side(fitted) == Side::Outside { -away } else { away }
        } else {
            area_vector(self.shape.mesh(), closest.face as usize).try_normalize()?
        };
        let ball = shrinking_ball(closest.point, outward, self.side, self.touched(points));
        is_medial(&ball).then_some(ball)
    }
}

/// Whether a ball has two contacts: one that never shrank is as large as it began.
fn is_medial(ball: &Ball) -> bool {
    ball.steps > 0 && ball.sphere.centre.is_finite()
}
