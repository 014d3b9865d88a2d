//! Labelled polar balls of a shape, for its power crust.

use crate::Vec3;
use crate::geometry::{Delaunay, Pole, Poles, Sphere};
use crate::surface::Side;

use super::{Shape, ShapeError};

/// The polar balls of boundary samples, by the side of the surface that they are centred on.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PolarBalls {
    /// Centred inside.
    pub inner: Vec<Sphere>,
    /// Centred outside, or on the surface.
    pub outer: Vec<Sphere>,
    /// How many were rejected, because they reach through the surface.
    pub rejected: usize,
}

/// Half the side of the cube that bounds the cells of the samples, in diagonals of the surface.
const BOX: f64 = 2.5;

/// Poles nearer to the surface than this share of their radius are rejected.
///
/// Their balls pass between the samples of a part that is thinner than the samples are apart, and
/// reach far to the other side; the side of the centre says nothing of them. They are few, but can make a
/// false handle. With too large a share thin parts lose poles that they need. The published program has no surface to ask, and estimates the same from the shape of
/// Voronoi cells.
const MIN_DEPTH: f64 = 0.25;

impl Shape {
    /// The polar balls of the samples, in normalised units: no pole is at infinity, because the
    /// corners of a large box around the surface take part in the diagram. Their own poles do not count.
    ///
    /// Costs a Delaunay triangulation of its own.
    ///
    /// # Errors
    /// When the samples do not span space.
    pub fn polar_balls(&self) -> Result<PolarBalls, ShapeError> {
        let samples = self.samples();
        let mut points = samples.to_vec();
        let signs = [-BOX, BOX];
        let box_corners = (0..8).map(|k| Vec3::new(signs[k & 1], signs[k >> 1 & 1], signs[k >> 2]));
        points.extend(box_corners);
        let delaunay = Delaunay::new(&points)?;
        let poles = Poles::new(&delaunay);
        let mut is_pole = vec![false; delaunay.finite_cell_count()];
        for poles in &poles.samples()[..samples.len()] {
            if let Some(Pole::Vertex(cell)) = poles.first {
                is_pole[cell.index()] = true;
            }
            if let Some(cell) = poles.second {
                is_pole[cell.index()] = true;
            }
        }
        let balls: Vec<Sphere> =
            poles.balls().iter().filter(|b| is_pole[b.cell.index()]).map(|b| b.sphere).collect();
        let centres: Vec<Vec3> = balls.iter().map(|b| b.centre).collect();
        let sides = self.inside_test().sides(&centres);
        let tree = self.surface_tree()?;
        let depths = tree.distance_batch(&centres);
        let mut labelled = PolarBalls::default();
        for ((&ball, side), depth) in balls.iter().zip(sides).zip(depths) {
            if depth < MIN_DEPTH * ball.radius {
                labelled.rejected += 1;
                continue;
            }
            match side {
                Side::Inside => labelled.inner.push(ball),
                Side::On | Side::Outside => labelled.outer.push(ball),
            }
        }
        Ok(labelled)
    }
}
