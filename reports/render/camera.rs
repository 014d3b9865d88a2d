//! Where the picture is taken from, and how points come to be on it.
//!
//! A [`Camera`] is a direction, an upward direction, a zoom and a projection. A [`Frame`] is a camera that
//! was set up before a shape: a position, and a scale by which the shape fills the picture.
//!
//! | | |
//! |---|---|
//! | `right`, `up`, `back` | the camera's axes; `back` points from the shape to the eye |
//! | `nearness` | larger is nearer, and affine on the picture: `z` along `back`, in perspective `D / (D - z)` |
//! | `D` | distance of the eye from the middle of the shape, in perspective |

use medial::Vec3;
use medial::surface::TriMesh;

use super::error::RenderError;

/// Where a picture is taken from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// From the shape to the eye, of any length.
    pub direction: Vec3,
    /// What is up on the picture, not along the direction.
    pub up: Vec3,
    /// 1: the shape fills the picture; 2: twice as large.
    pub zoom: f64,
    /// Near parts are larger, as to an eye; else parallel lines stay parallel.
    pub perspective: bool,
}

/// Zooms that are taken: coordinates on the picture must stay in range of exact arithmetic.
const ZOOMS: std::ops::RangeInclusive<f64> = 0.05..=50.0;

/// A principal box as a share of the box along the coordinates below which the shape is taken to lie
/// askew. Above it the coordinates of the file are the better guess of how it stands.
const ASKEW: f64 = 0.6;

/// How far the default camera goes around the shape, and how far up, in degrees: all three sides are
/// seen, the widest most.
const TURN: (f64, f64) = (28.0, 20.0);

/// The eye in perspective, in radii of the shape from its middle: as one looks at a thing in one's hands.
const EYE_DISTANCE: f64 = 4.0;

/// Margin around the shape, as a share of the shorter side of the picture.
const MARGIN: f64 = 0.04;

impl Camera {
    /// A camera in a direction of the shape.
    pub fn new(direction: Vec3, up: Vec3) -> Self {
        Self { direction, up, zoom: 1.0, perspective: false }
    }

    /// The camera that shows most of a shape: it looks along its shortest extent, from the side and from
    /// above. Extents are those along the coordinates; along the principal axes of its area if these
    /// enclose it much more tightly.
    pub fn fitting(mesh: &TriMesh) -> Self {
        let [across, up, towards] = standing_axes(mesh);
        Self::new(around(across, up, towards, TURN.0, TURN.1), up)
    }

    /// A camera at an azimuth and an elevation in degrees around an upward direction. Azimuth 0 is the front:
    /// `+z`, and `-y` where `z` is up.
    pub fn around(up: Vec3, azimuth: f64, elevation: f64) -> Self {
        let up = up.normalize_or(Vec3::Y);
        let front = if up.z.abs() > 0.9 { -Vec3::Y } else { Vec3::Z };
        let front = front.reject_from_normalized(up).normalize_or(up.any_orthonormal_vector());
        Self::new(around(up.cross(front), up, front, azimuth, elevation), up)
    }

    /// The upward direction that [`Camera::fitting`] takes.
    pub fn fitting_up(mesh: &TriMesh) -> Vec3 {
        standing_axes(mesh)[1]
    }

    /// The camera after the shape was turned around its upward direction by degrees.
    pub fn turned(self, degrees: f64) -> Self {
        let up = self.up.normalize_or(Vec3::Y);
        let turn = medial::geometry::glam::DQuat::from_axis_angle(up, degrees.to_radians());
        Self { direction: turn * self.direction, ..self }
    }

    /// Right, up and back.
    fn axes(&self) -> Result<[Vec3; 3], RenderError> {
        let unit = |v: Vec3| v.try_normalize();
        let back =
            unit(self.direction).ok_or_else(|| RenderError::Direction(words(self.direction)))?;
        let up = unit(self.up).ok_or_else(|| RenderError::Up(words(self.up)))?;
        let across = up.cross(back);
        if across.length() < 1e-3 {
            return Err(RenderError::Up(words(self.up)));
        }
        let right = across.normalize();
        Ok([right, back.cross(right), back])
    }
}

/// A vector as it is typed.
fn words(v: Vec3) -> String {
    format!("{},{},{}", v.x, v.y, v.z)
}

/// The direction at an azimuth and an elevation between three axes at right angles.
fn around(across: Vec3, up: Vec3, towards: Vec3, azimuth: f64, elevation: f64) -> Vec3 {
    let (turn, lift) = (azimuth.to_radians(), elevation.to_radians());
    lift.cos() * (turn.sin() * across + turn.cos() * towards) + lift.sin() * up
}

/// Across, up, and towards the eye, for a shape as it seems to stand.
fn standing_axes(mesh: &TriMesh) -> [Vec3; 3] {
    let box_of = |axes: &[Vec3; 3]| axes.map(|axis| extent(&mesh.vertices, axis));
    let coordinates = [Vec3::X, Vec3::Y, Vec3::Z];
    let [x, y, z] = box_of(&coordinates);
    let principal = principal_axes(mesh);
    let tight = box_of(&principal);
    if tight.iter().product::<f64>() < ASKEW * (x * y * z) {
        // The longest extent lies across, the shortest is looked along.
        let [across, up, _] = principal;
        return [across, up, across.cross(up)];
    }
    // y is up in most files of shapes; where a shape is flat along y, z must be.
    if y < x.min(z) {
        [Vec3::X, Vec3::Z, -Vec3::Y]
    } else if x < z {
        [-Vec3::Z, Vec3::Y, Vec3::X]
    } else {
        [Vec3::X, Vec3::Y, Vec3::Z]
    }
}

fn extent(points: &[Vec3], axis: Vec3) -> f64 {
    let along = || points.iter().map(|p| p.dot(axis));
    along().fold(f64::NEG_INFINITY, f64::max) - along().fold(f64::INFINITY, f64::min)
}

/// The principal axes of a surface's area, from the longest to the shortest. Each points along the
/// coordinate that it is nearest to, so that they do not depend on rounding.
fn principal_axes(mesh: &TriMesh) -> [Vec3; 3] {
    let mut axes = eigenvectors(area_covariance(mesh));
    axes.sort_by(|a, b| b.0.total_cmp(&a.0));
    axes.map(|(_, axis)| {
        let largest = axis.abs().max_element();
        let nearest = axis.to_array().into_iter().find(|c| c.abs() == largest).unwrap_or(1.0);
        if nearest < 0.0 { -axis } else { axis }
    })
}

/// Covariance of face centres, weighted by area.
fn area_covariance(mesh: &TriMesh) -> [[f64; 3]; 3] {
    let faces = || {
        (0..mesh.faces.len()).map(|face| {
            let [a, b, c] = mesh.triangle(face);
            ((a + b + c) / 3.0, 0.5 * (b - a).cross(c - a).length())
        })
    };
    let area: f64 = faces().map(|(_, area)| area).sum();
    let middle = faces().map(|(centre, area)| area * centre).sum::<Vec3>() / area;
    let mut sums = [[0.0; 3]; 3];
    for (centre, area) in faces() {
        let d = (centre - middle).to_array();
        for (row, &r) in sums.iter_mut().zip(&d) {
            for (sum, &c) in row.iter_mut().zip(&d) {
                *sum += area * r * c;
            }
        }
    }
    sums
}

/// Sweeps of the Jacobi method; three by three matrices converge in about five.
const SWEEPS: usize = 12;

/// Eigenvalues and unit eigenvectors of a symmetric matrix by Jacobi rotations.
fn eigenvectors(mut m: [[f64; 3]; 3]) -> [(f64, Vec3); 3] {
    let mut vectors = [Vec3::X, Vec3::Y, Vec3::Z];
    for (p, q) in std::iter::repeat_n([(0, 1), (0, 2), (1, 2)], SWEEPS).flatten() {
        // The angle that makes entry (p, q) vanish.
        let angle = 0.5 * (2.0 * m[p][q]).atan2(m[q][q] - m[p][p]);
        let (s, c) = angle.sin_cos();
        for row in &mut m {
            (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
        }
        let (a, b) = (m[p], m[q]);
        m[p] = std::array::from_fn(|k| c * a[k] - s * b[k]);
        m[q] = std::array::from_fn(|k| s * a[k] + c * b[k]);
        let (a, b) = (vectors[p], vectors[q]);
        (vectors[p], vectors[q]) = (c * a - s * b, s * a + c * b);
    }
    std::array::from_fn(|k| (m[k][k], vectors[k]))
}

/// A camera that was set up before a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    pub(super) right: Vec3,
    pub(super) up: Vec3,
    pub(super) back: Vec3,
    /// Middle of the shape, in its units.
    origin: Vec3,
    /// `D`, in perspective.
    distance: Option<f64>,
    /// What comes to the middle of the picture, along `right` and `up`.
    middle: [f64; 2],
    /// Half the extents that must be on the picture, along `right` and `up`.
    half: [f64; 2],
    zoom: f64,
}

/// A point on the picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Projected {
    /// From the left and from the top, in pixels.
    pub(super) at: [f64; 2],
    pub(super) nearness: f64,
    /// By which shares along a side are weighed: 1 without perspective.
    pub(super) weight: f64,
}

impl Frame {
    /// Sets a camera up so that points fill the picture. Cost linear in their number.
    ///
    /// # Errors
    /// When the camera has no direction or its zoom is out of range, or there is no point.
    pub fn fit(camera: &Camera, points: &[Vec3]) -> Result<Self, RenderError> {
        let [right, up, back] = camera.axes()?;
        if !ZOOMS.contains(&camera.zoom) {
            return Err(RenderError::Zoom(camera.zoom));
        }
        let first = points.iter().copied().find(|p| p.is_finite()).ok_or(RenderError::Empty)?;
        let grown = |(lo, hi): (Vec3, Vec3), &p: &Vec3| {
            if p.is_finite() { (lo.min(p), hi.max(p)) } else { (lo, hi) }
        };
        let (lo, hi) = points.iter().fold((first, first), grown);
        let origin = 0.5 * (lo + hi);
        let radius = 0.5 * (hi - lo).length();
        let distance = camera.perspective.then(|| EYE_DISTANCE * radius.max(f64::MIN_POSITIVE));
        let (middle, half, zoom) = ([0.0; 2], [radius; 2], camera.zoom);
        let mut frame = Self { right, up, back, origin, distance, middle, half, zoom };
        frame.enclose(points);
        Ok(frame)
    }

    /// Sets several cameras up alike: none moves or grows beside another, so that a shape that turns only
    /// turns.
    ///
    /// # Errors
    /// As [`Frame::fit`].
    pub fn fit_alike(cameras: &[Camera], points: &[Vec3]) -> Result<Vec<Self>, RenderError> {
        let frames: Result<Vec<_>, _> = cameras.iter().map(|c| Self::fit(c, points)).collect();
        let mut frames = frames?;
        // Turning around `up` keeps heights; widths are taken about the axis of the turn.
        let needed = |frame: &Self, k: usize| frame.half[k] + frame.middle[k].abs();
        let width = frames.iter().map(|frame| needed(frame, 0)).fold(0.0, f64::max);
        let tops = frames.iter().map(|frame| frame.middle[1] + frame.half[1]);
        let bottoms = frames.iter().map(|frame| frame.middle[1] - frame.half[1]);
        let (top, bottom) =
            (tops.fold(f64::NEG_INFINITY, f64::max), bottoms.fold(f64::INFINITY, f64::min));
        for frame in &mut frames {
            frame.middle = [0.0, 0.5 * (top + bottom)];
            frame.half = [width, 0.5 * (top - bottom)];
        }
        Ok(frames)
    }

    /// Takes the extents of points on the picture.
    fn enclose(&mut self, points: &[Vec3]) {
        let mut lo = [f64::INFINITY; 2];
        let mut hi = [f64::NEG_INFINITY; 2];
        for &point in points.iter().filter(|point| point.is_finite()) {
            let ([x, y], _) = self.on_plane(point);
            lo = [lo[0].min(x), lo[1].min(y)];
            hi = [hi[0].max(x), hi[1].max(y)];
        }
        self.middle = [0.5 * (lo[0] + hi[0]), 0.5 * (lo[1] + hi[1])];
        self.half = [0.5 * (hi[0] - lo[0]), 0.5 * (hi[1] - lo[1])];
    }

    /// Coordinates along `right` and `up`, in units of the shape, and the height along `back`.
    fn on_plane(&self, point: Vec3) -> ([f64; 2], f64) {
        let p = point - self.origin;
        let z = p.dot(self.back);
        let k = self.distance.map_or(1.0, |distance| distance / (distance - z));
        ([k * p.dot(self.right), k * p.dot(self.up)], z)
    }

    /// Pixels for a unit of the shape, on a picture of this size.
    pub(super) fn scale(&self, width: usize, height: usize) -> f64 {
        let (w, h) = (width as f64, height as f64);
        let margin = 2.0 * MARGIN * w.min(h);
        let along = |pixels: f64, half: f64| (pixels - margin) / (2.0 * half);
        let scale = along(w, self.half[0]).min(along(h, self.half[1]));
        // A point has no extent: any scale shows it.
        self.zoom * if scale.is_finite() { scale } else { 1.0 }
    }

    /// The way to a picture of this size.
    pub(super) fn lens(&self, [width, height]: [usize; 2]) -> Lens<'_> {
        let centre = [0.5 * width as f64, 0.5 * height as f64];
        Lens { frame: self, scale: self.scale(width, height), centre }
    }

    /// Depth behind the middle of the shape, of a nearness, in units of the shape.
    pub(super) fn depth(&self, nearness: f64) -> f64 {
        self.distance.map_or(-nearness, |distance| distance / nearness - distance)
    }

    /// From a point to the eye, a unit vector.
    pub(super) fn towards_eye(&self, point: Vec3) -> Vec3 {
        self.distance.map_or(self.back, |distance| {
            (self.origin + distance * self.back - point).normalize_or(self.back)
        })
    }
}

/// A frame before a picture of a size.
#[derive(Clone, Copy)]
pub(super) struct Lens<'a> {
    frame: &'a Frame,
    /// Pixels for a unit.
    scale: f64,
    /// Middle of the picture, in pixels.
    centre: [f64; 2],
}

impl Lens<'_> {
    /// A point on the picture; `None` behind the eye, or too near to it.
    pub(super) fn project(&self, point: Vec3) -> Option<Projected> {
        let frame = self.frame;
        let ([x, y], z) = frame.on_plane(point);
        let weight = match frame.distance {
            Some(distance) if z > 0.9 * distance => return None,
            Some(distance) => distance / (distance - z),
            None => 1.0,
        };
        let nearness = if frame.distance.is_some() { weight } else { z };
        let at = [
            self.centre[0] + self.scale * (x - frame.middle[0]),
            self.centre[1] - self.scale * (y - frame.middle[1]),
        ];
        Some(Projected { at, nearness, weight })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eigenvectors_of_a_known_matrix() {
        let m = [[2.0, 1.0, 0.0], [1.0, 2.0, 0.0], [0.0, 0.0, 5.0]];
        let mut found = eigenvectors(m);
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        for ((value, vector), expected) in found.iter().zip([1.0, 3.0, 5.0]) {
            assert!((value - expected).abs() < 1e-12, "{value}");
            let v = vector.to_array();
            for (row, x) in m.iter().zip(v) {
                let image: f64 = row.iter().zip(v).map(|(a, b)| a * b).sum();
                assert!((image - value * x).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn cameras_without_a_direction_are_refused() {
        let points = [Vec3::ZERO, Vec3::ONE];
        let camera = Camera::new(Vec3::ZERO, Vec3::Y);
        assert!(matches!(Frame::fit(&camera, &points), Err(RenderError::Direction(_))));
        let camera = Camera::new(Vec3::Y, 2.0 * Vec3::Y);
        assert!(matches!(Frame::fit(&camera, &points), Err(RenderError::Up(_))));
        let camera = Camera { zoom: 0.0, ..Camera::new(Vec3::Z, Vec3::Y) };
        assert_eq!(Frame::fit(&camera, &points), Err(RenderError::Zoom(0.0)));
        let camera = Camera::new(Vec3::Z, Vec3::Y);
        assert_eq!(Frame::fit(&camera, &[]), Err(RenderError::Empty));
    }

    #[test]
    fn azimuth_and_elevation_go_around_what_is_up() {
        let close = |a: Vec3, b: Vec3| assert!(a.distance(b) < 1e-12, "{a} {b}");
        close(Camera::around(Vec3::Y, 0.0, 0.0).direction, Vec3::Z);
        close(Camera::around(Vec3::Y, 90.0, 0.0).direction, Vec3::X);
        close(Camera::around(Vec3::Z, 0.0, 0.0).direction, -Vec3::Y);
        close(Camera::around(Vec3::Z, 90.0, 0.0).direction, Vec3::X);
        close(Camera::around(Vec3::Z, 10.0, 90.0).direction, Vec3::Z);
    }
}
