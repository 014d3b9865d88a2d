//! Four triangles measured together in single precision, to select those worth measuring in double
//! precision.
//!
//! The distance is that of [`PlanarFrame::distance_squared`], computed differently: the least
//! distance to the three sides, unless the query projects into the triangle. So if rounding puts the
//! query on the wrong side of a line, the distance changes by no more than rounding.

use crate::geometry::planar_frame::PlanarFrame;
use crate::geometry::trees::{Frame, Lanes, Query};

/// The frames of up to four triangles, in the [`Frame`] of a wide tree. Lanes without a triangle
/// repeat the first one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block {
    origin: [Lanes; 3],
    x: [Lanes; 3],
    y: [Lanes; 3],
    normal: [Lanes; 3],
    length: Lanes,
    apex: [Lanes; 2],
    /// Reciprocal squared lengths of the sides `ac`, `bc`; 0 for negligible ones.
    reciprocal: [Lanes; 2],
}

/// Squared lengths below this have no reciprocal in single precision. The distance to such a side is
/// measured from its start, which differs by less than rounding.
const NEGLIGIBLE: f64 = 1e-30;

impl Block {
    pub fn new(frames: &[PlanarFrame], frame: &Frame) -> Self {
        let lanes = |value: &dyn Fn(&PlanarFrame) -> f64| {
            let of = |k: usize| value(frames.get(k).unwrap_or(&frames[0])) as f32;
            Lanes::from([of(0), of(1), of(2), of(3)])
        };
        let s = frame.scale;
        let reciprocal = |run: &dyn Fn(&PlanarFrame) -> f64| {
            lanes(&|t| {
                let squared = (run(t) * s).powi(2) + (t.apex[1] * s).powi(2);
                if squared > NEGLIGIBLE { 1.0 / squared } else { 0.0 }
            })
        };
        Self {
            origin: [0, 1, 2].map(|k| lanes(&|t| frame.forward(t.origin)[k])),
            x: [0, 1, 2].map(|k| lanes(&|t| t.x[k])),
            y: [0, 1, 2].map(|k| lanes(&|t| t.y[k])),
            normal: [0, 1, 2].map(|k| lanes(&|t| t.normal[k])),
            length: lanes(&|t| t.length * s),
            apex: [0, 1].map(|k| lanes(&|t| t.apex[k] * s)),
            reciprocal: [reciprocal(&|t| t.apex[0]), reciprocal(&|t| t.length - t.apex[0])],
        }
    }

    /// The triangles that may be within a limit, one bit each.
    #[inline]
    pub fn within(&self, query: &Query, limit: f32) -> u32 {
        let w = [0, 1, 2].map(|k| query.p[k] - self.origin[k]);
        let dot = |axis: &[Lanes; 3]| w[0] * axis[0] + w[1] * axis[1] + w[2] * axis[2];
        let (x, y, height) = (dot(&self.x), dot(&self.y), dot(&self.normal));
        let [cx, cy] = self.apex;
        let (zero, one) = (Lanes::ZERO, Lanes::ONE);
        let beyond = self.length - x;
        let across = cx - self.length;
        let left = cy * x - cx * y;
        let right = cy * beyond + across * y;
        let inside = y.simd_ge(zero) & left.simd_ge(zero) & right.simd_ge(zero);
        let past = x - x.fast_max(zero).fast_min(self.length);
        let base = past * past + y * y;
        let along = |start: Lanes, run: Lanes, reciprocal: Lanes| {
            let t = ((start * run + y * cy) * reciprocal).fast_max(zero).fast_min(one);
            let (dx, dy) = (start - t * run, y - t * cy);
            dx * dx + dy * dy
        };
        let sides = along(x, cx, self.reciprocal[0])
            .fast_min(along(-beyond, across, self.reciprocal[1]))
            .fast_min(base);
        let squared = height * height + inside.bitselect(zero, sides);
        squared.simd_le(Lanes::splat(limit)).to_bitmask()
    }
}
