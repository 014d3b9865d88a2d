//! Where the picture is taken from, and how points are projected onto it.
//!
//! A [`Camera`] is a direction and an upward direction. A [`Frame`] is a camera that was set up before a shape:
//! the part of its plane that fills the picture. Projection is orthographic: lengths compare across the picture.

use medial::Vec3;
use medial::geometry::glam::DMat3;
use medial::surface::TriMesh;

use super::RenderError;

/// Where a picture is taken from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Camera {
    /// From the shape to the eye, of any length.
    pub(crate) direction: Vec3,
    /// Upward direction on the picture, not parallel to the viewing direction.
    pub(crate) up: Vec3,
}

/// Below this ratio of the principal box's volume to the coordinate box's the shape is rotated. Above it the
/// coordinates of the file give the better upright position.
const ASKEW: f64 = 0.6;

/// How far the default camera goes around the shape, and how far up, in degrees: all three sides are seen, the widest
/// most.
const TURN: (f64, f64) = (28.0, 20.0);

/// Margin around the shape, as a share of the shorter side of the picture.
const MARGIN: f64 = 0.04;

impl Camera {
    /// A camera in a direction of the shape.
    pub(crate) fn new(direction: Vec3, up: Vec3) -> Self {
        Self { direction, up }
    }

    /// The camera that shows most of a shape: it looks along its shortest extent, from the side and from above. Extents
    /// are those along the coordinates, or along the principal axes of its area if these enclose it much more tightly.
    pub(crate) fn fitting(mesh: &TriMesh) -> Self {
        let [across, up, towards] = standing_axes(mesh);
        Self::new(around(across, up, towards, TURN), up)
    }

    /// A camera at an azimuth and an elevation in degrees around an upward direction. Azimuth 0 is the front: `+z`, and
    /// `-y` where `z` is up.
    pub(crate) fn around(up: Vec3, azimuth: f64, elevation: f64) -> Self {
        let up = up.normalize_or(Vec3::Y);
        let front = if up.z.abs() > 0.9 { -Vec3::Y } else { Vec3::Z };
        let front = front.reject_from_normalized(up).normalize_or(up.any_orthonormal_vector());
        Self::new(around(up.cross(front), up, front, (azimuth, elevation)), up)
    }

    /// The upward direction that [`Camera::fitting`] takes.
    pub(crate) fn fitting_up(mesh: &TriMesh) -> Vec3 {
        standing_axes(mesh)[1]
    }
}

/// The direction at an azimuth and an elevation, in degrees, between three axes at right angles.
fn around(across: Vec3, up: Vec3, towards: Vec3, (azimuth, elevation): (f64, f64)) -> Vec3 {
    let (turn, lift) = (azimuth.to_radians(), elevation.to_radians());
    lift.cos() * (turn.sin() * across + turn.cos() * towards) + lift.sin() * up
}

/// Across, up, and towards the eye, for a shape in its upright position.
fn standing_axes(mesh: &TriMesh) -> [Vec3; 3] {
    let [x, y, z] = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| extent(mesh, axis));
    let principal = principal_axes(mesh);
    let volume: f64 = principal.map(|axis| extent(mesh, axis)).iter().product();
    if volume < ASKEW * (x * y * z) {
        // The longest extent lies across, the shortest is looked along. Signs were chosen one by one, so the third
        // axis as found may make a left-handed system.
        let [across, up, _] = principal;
        return [across, up, across.cross(up)]; // right-handed
    }
    // y is up in most files of shapes. Where a shape is flat along y, z must be.
    if y < x.min(z) {
        [Vec3::X, Vec3::Z, -Vec3::Y]
    } else if x < z {
        [-Vec3::Z, Vec3::Y, Vec3::X]
    } else {
        [Vec3::X, Vec3::Y, Vec3::Z]
    }
}

/// Length of a surface along an axis.
fn extent(mesh: &TriMesh, axis: Vec3) -> f64 {
    let along = || mesh.vertices.iter().map(|p| p.dot(axis));
    along().fold(f64::NEG_INFINITY, f64::max) - along().fold(f64::INFINITY, f64::min)
}

/// The principal axes of a surface's area, from the longest to the shortest, by power iteration. Each points along the
/// coordinate that it is nearest to, so that signs do not depend on rounding.
fn principal_axes(mesh: &TriMesh) -> [Vec3; 3] {
    // Each face by its area and centre.
    let faces: Vec<(f64, Vec3)> = (0..mesh.faces.len())
        .map(|face| {
            let [a, b, c] = mesh.triangle(face);
            (0.5 * (b - a).cross(c - a).length(), (a + b + c) / 3.0)
        })
        .collect();
    let area: f64 = faces.iter().map(|(area, _)| area).sum();
    let middle = faces.iter().map(|(area, centre)| area * centre).sum::<Vec3>() / area;
    let covariance = faces.iter().fold(DMat3::ZERO, |sum, (area, centre)| {
        let v = centre - middle;
        sum + DMat3::from_cols(v.x * v, v.y * v, v.z * v) * *area
    });
    let first = dominant_axis(covariance);
    // The projection across the first axis takes its share out of the matrix.
    let across =
        DMat3::IDENTITY - DMat3::from_cols(first.x * first, first.y * first, first.z * first);
    let second = dominant_axis(across * covariance * across).reject_from_normalized(first);
    let second = second.normalize_or(first.any_orthonormal_vector());
    [first, second, first.cross(second)].map(|axis| {
        let largest = axis.abs().max_element();
        let nearest = axis.to_array().into_iter().find(|c| c.abs() == largest).unwrap_or(1.0);
        if nearest < 0.0 { -axis } else { axis }
    })
}

/// The direction that a symmetric matrix lengthens most.
fn dominant_axis(matrix: DMat3) -> Vec3 {
    const ITERATIONS: usize = 256;
    // A start at right angles to the axis would never reach it: no axis of a usual shape is.
    let start = Vec3::new(0.61, 0.53, 0.59).normalize();
    (0..=ITERATIONS).fold(start, |v, _| (matrix * v).normalize_or(v))
}

/// A camera that was set up before a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Frame {
    /// Axes of the picture; `back` points from the shape to the eye.
    pub(super) right: Vec3,
    pub(super) up: Vec3,
    pub(super) back: Vec3,
    /// The middle of the points along `right`, `up` and `back`.
    middle: [f64; 3],
    /// Half their extents along `right` and `up`.
    half: [f64; 2],
}

impl Frame {
    /// Sets a camera up so that points fill the picture. Cost linear in their number.
    pub(crate) fn fit(camera: &Camera, points: &[Vec3]) -> Result<Self, RenderError> {
        let &Camera { direction, up } = camera;
        let back = direction.try_normalize().ok_or(RenderError::Direction(words(direction)))?;
        // Nearly along the line of sight, rounding would decide the upward direction.
        let across = up.try_normalize().map_or(Vec3::ZERO, |up| up.cross(back));
        if across.length() < 1e-3 {
            return Err(RenderError::Up(words(up)));
        }
        let right = across.normalize();
        let up = back.cross(right);
        let ranges = [right, up, back].map(|axis| {
            let along = points.iter().filter(|p| p.is_finite()).map(|p| p.dot(axis));
            along.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), x| (lo.min(x), hi.max(x)))
        });
        if ranges.iter().any(|(lo, hi)| lo > hi) {
            return Err(RenderError::Empty); // no point was finite
        }
        let middle = ranges.map(|(lo, hi)| 0.5 * (lo + hi));
        let half = [0, 1].map(|k: usize| 0.5 * (ranges[k].1 - ranges[k].0));
        Ok(Self { right, up, back, middle, half })
    }

    /// Pixels for a unit of the shape, on a picture of this size.
    pub(super) fn scale(&self, size: [usize; 2]) -> f64 {
        let [w, h] = size.map(|side| side as f64);
        let margin = 2.0 * MARGIN * w.min(h);
        let scale = ((w - margin) / (2.0 * self.half[0])).min((h - margin) / (2.0 * self.half[1]));
        // A point has no extent: any scale shows it.
        if scale.is_finite() { scale } else { 1.0 }
    }

    /// Points on a picture of this size, in pixels: from the left, from the top, and towards the eye.
    pub(super) fn projection(&self, size: [usize; 2]) -> impl Fn(Vec3) -> [f64; 3] + Sync {
        let Self { right, up, back, middle, .. } = *self;
        let (scale, [w, h]) = (self.scale(size), size.map(|side| side as f64));
        move |p| {
            let x = 0.5 * w + scale * (p.dot(right) - middle[0]);
            let y = 0.5 * h - scale * (p.dot(up) - middle[1]);
            [x, y, scale * (p.dot(back) - middle[2])]
        }
    }
}

/// A vector as the command line takes it.
fn words(v: Vec3) -> String {
    format!("{},{},{}", v.x, v.y, v.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cameras_without_a_direction_are_rejected() {
        let points = [Vec3::ZERO, Vec3::ONE];
        let fit = |camera: Camera| Frame::fit(&camera, &points);
        let front = Camera::new(Vec3::Z, Vec3::Y);
        assert!(matches!(fit(Camera::new(Vec3::ZERO, Vec3::Y)), Err(RenderError::Direction(_))));
        assert!(matches!(fit(Camera::new(Vec3::Y, 2.0 * Vec3::Y)), Err(RenderError::Up(_))));
        assert_eq!(Frame::fit(&front, &[]), Err(RenderError::Empty));
    }

    #[test]
    fn azimuth_and_elevation_go_around_the_upward_direction() {
        for (up, azimuth, elevation, direction) in [
            (Vec3::Y, 0.0, 0.0, Vec3::Z),
            (Vec3::Y, 90.0, 0.0, Vec3::X),
            (Vec3::Z, 0.0, 0.0, -Vec3::Y),
            (Vec3::Z, 90.0, 0.0, Vec3::X),
            (Vec3::Z, 10.0, 90.0, Vec3::Z),
        ] {
            let found = Camera::around(up, azimuth, elevation).direction;
            assert!(found.distance(direction) < 1e-12, "{found} {direction}");
        }
    }

    #[test]
    fn a_rotated_box_is_viewed_along_its_shortest_side() {
        let turn = medial::geometry::glam::DQuat::from_rotation_z(0.7);
        let corner = |k: u32| {
            let sign = |bit: u32| if k >> bit & 1 == 0 { -1.0 } else { 1.0 };
            turn * Vec3::new(4.0 * sign(0), 0.2 * sign(1), sign(2))
        };
        let quads =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let faces = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        let mesh = TriMesh { vertices: (0..8).map(corner).collect(), faces };
        let [across, up, towards] = standing_axes(&mesh);
        // Faces count by their centres, so that twelve triangles give the axes roughly.
        assert!(across.dot(turn * Vec3::X).abs() > 0.97, "{across}");
        assert!(up.dot(Vec3::Z).abs() > 0.97 && towards.dot(turn * Vec3::Y).abs() > 0.97);
    }
}
