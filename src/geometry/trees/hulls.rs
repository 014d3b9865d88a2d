//! Four hulls of balls measured together in single precision, to select those worth measuring in
//! double precision.
//!
//! However steep a hull is, the error is that of the coordinates and radii: the distance is a
//! minimum over interpolated spheres, so an error of the minimiser counts in second order only.

use super::wide::{Frame, Lanes, Query};
use crate::{Cone, SlabFace};

/// Up to four cones, in the [`Frame`] of a wide tree. Lanes without a cone are infinitely far.
#[derive(Clone, Copy, Debug)]
pub struct ConeBlock {
    start: [Lanes; 3],
    axis: [Lanes; 3],
    length: Lanes,
    radius: Lanes,
    slope: Lanes,
    lead: Lanes,
}

/// The values of up to four items in single precision, and `absent` for the others.
fn lanes<T>(items: &[T], absent: f32, value: impl Fn(&T) -> f64) -> Lanes {
    let of = |k: usize| items.get(k).map_or(absent, |item| value(item) as f32);
    Lanes::from([of(0), of(1), of(2), of(3)])
}

#[inline]
fn dot(u: &[Lanes; 3], v: &[Lanes; 3]) -> Lanes {
    u[0] * v[0] + u[1] * v[1] + u[2] * v[2]
}

impl ConeBlock {
    /// Up to four cones; any others are ignored.
    pub fn new(cones: &[Cone], frame: &Frame) -> Self {
        let s = frame.scale;
        Self {
            start: [0, 1, 2].map(|k| lanes(cones, 0.0, |c| frame.forward(c.start())[k])),
            axis: [0, 1, 2].map(|k| lanes(cones, 0.0, |c| c.axis()[k])),
            length: lanes(cones, 0.0, |c| c.length() * s),
            radius: lanes(cones, f32::NEG_INFINITY, |c| c.radius() * s),
            slope: lanes(cones, 0.0, Cone::slope),
            lead: lanes(cones, 0.0, Cone::lead),
        }
    }

    /// The signed distances.
    #[inline]
    pub fn signed(&self, query: &Query) -> Lanes {
        let w = [0, 1, 2].map(|k| query.p[k] - self.start[k]);
        let xi = dot(&w, &self.axis);
        // Not |w|² - xi², which cancels near the axis.
        let across = [0, 1, 2].map(|k| w[k] - xi * self.axis[k]);
        let y_squared = dot(&across, &across);
        let tau = (xi + y_squared.sqrt() * self.lead).fast_max(Lanes::ZERO).fast_min(self.length);
        let off = xi - tau;
        (off * off + y_squared).sqrt() - (self.radius + tau * self.slope)
    }
}

/// Up to four faces of slabs, in the [`Frame`] of a wide tree. Lanes without a face are infinitely
/// far.
#[derive(Clone, Copy, Debug)]
pub struct FaceBlock {
    origin: [Lanes; 3],
    x: [Lanes; 3],
    y: [Lanes; 3],
    normal: [Lanes; 3],
    radius: Lanes,
    gradient: [Lanes; 2],
    lead: Lanes,
    rise: Lanes,
    /// Unit normals, inward, of the sides from the first and to the second corner of the base.
    sides: [[Lanes; 2]; 2],
    /// Distance of the origin inward from the second of them.
    offset: Lanes,
}

impl FaceBlock {
    /// Up to four faces; any others are ignored.
    pub fn new(faces: &[SlabFace], frame: &Frame) -> Self {
        let s = frame.scale;
        let inward = |run: fn(&SlabFace) -> f64, turn: f64| {
            let unit = move |f: &SlabFace| {
                let (run, height) = (run(f), f.frame().apex[1]);
                let length = run.hypot(height);
                [turn * height / length, -turn * run / length]
            };
            [0, 1].map(|k| lanes(faces, 0.0, |f| unit(f)[k]))
        };
        let left = inward(|f| f.frame().apex[0], 1.0);
        let right = inward(|f| f.frame().apex[0] - f.frame().length, -1.0);
        Self {
            origin: [0, 1, 2].map(|k| lanes(faces, 0.0, |f| frame.forward(f.frame().origin)[k])),
            x: [0, 1, 2].map(|k| lanes(faces, 0.0, |f| f.frame().x[k])),
            y: [0, 1, 2].map(|k| lanes(faces, 0.0, |f| f.frame().y[k])),
            normal: [0, 1, 2].map(|k| lanes(faces, 0.0, |f| f.frame().normal[k])),
            radius: lanes(faces, f32::NEG_INFINITY, |f| f.radius() * s),
            gradient: [0, 1].map(|k| lanes(faces, 0.0, |f| f.gradient()[k])),
            lead: lanes(faces, 0.0, SlabFace::lead),
            rise: lanes(faces, 0.0, |f| 1.0 / f.lead()),
            sides: [left, right],
            offset: lanes(faces, 0.0, |f| {
                let [cx, cy] = f.frame().apex;
                f.frame().length * s * (cy / (cx - f.frame().length).hypot(cy))
            }),
        }
    }

    /// The signed distances; infinite where the face certainly has none and the cones of its sides
    /// decide.
    #[inline]
    pub fn signed(&self, query: &Query) -> Lanes {
        let w = [0, 1, 2].map(|k| query.p[k] - self.origin[k]);
        let (x, y) = (dot(&w, &self.x), dot(&w, &self.y));
        let height = dot(&w, &self.normal).abs();
        let [gx, gy] = self.gradient;
        let ahead = height * self.lead;
        let (cx, cy) = (x + ahead * gx, y + ahead * gy);
        // On a steep face the best centre is far from the foot of the query, and its error grows with
        // that distance.
        let blur = Lanes::splat(query.blur()) * (Lanes::ONE + self.lead + ahead);
        let [left, right] = &self.sides;
        let least = cy
            .fast_min(left[0] * cx + left[1] * cy)
            .fast_min(right[0] * cx + right[1] * cy + self.offset);
        let outside = least.simd_lt(-blur);
        // In closed form: the distance to the best centre minus the radius there.
        let signed = height * self.rise - (self.radius + gx * x + gy * y);
        outside.bitselect(Lanes::splat(f32::INFINITY), signed)
    }
}
