//! A triangle in its own plane: the frame in which distances to triangles and slabs are evaluated.
//!
//! # Notation
//! | | |
//! |---|---|
//! | `a, b, c` | corners, rotated so that `ab` is the longest side |
//! | `x, y, n` | orthonormal axes: along `ab`, in the plane towards `c`, normal |
//! | `L`, `(cx, cy)` | length of `ab`; `c` in the plane, so `0 <= cx <= L` and `cy >= 0` |
//!
//! Points are measured against unit axes, never against barycentric coordinates: those lose as
//! many digits as the triangle is thin, and scanned meshes are full of needles.

use crate::Vec3;

/// Height over longest side below which a triangle counts as a segment.
const FLAT: f64 = 1e-15;

/// A triangle in its own orthonormal frame. Segments and points are triangles of no height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanarFrame {
    /// The corner `a`.
    pub origin: Vec3,
    /// Unit vector along the base.
    pub x: Vec3,
    /// Unit vector in the plane, towards the third corner.
    pub y: Vec3,
    /// Unit normal.
    pub normal: Vec3,
    /// Length `L` of the base.
    pub length: f64,
    /// The third corner `(cx, cy)`.
    pub apex: [f64; 2],
    /// Reciprocal squared lengths of the sides `ac` and `bc`, 0 for a side of no length.
    reciprocal: [f64; 2],
}

/// The part of a triangle that holds its nearest point, in the corners' rotated order `a, b, c`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// The inside.
    Face,
    /// The side from this corner to the next.
    Side(usize),
    /// This corner.
    Corner(usize),
}

impl PlanarFrame {
    /// The frame of a triangle, and the index of the corner that became `a`.
    pub fn new(corners: [Vec3; 3]) -> (Self, usize) {
        let sides = [0, 1, 2].map(|k| corners[(k + 1) % 3].distance_squared(corners[k]));
        let mut first = 0;
        for k in 1..3 {
            if sides[k] > sides[first] {
                first = k;
            }
        }
        let [a, b, c] = [0, 1, 2].map(|k| corners[(first + k) % 3]);
        (Self::on_longest_side(a, b, c), first)
    }

    fn on_longest_side(a: Vec3, b: Vec3, c: Vec3) -> Self {
        let (base, slant) = (b - a, c - a);
        let length = base.length();
        let x = if length > 0.0 { base / length } else { Vec3::X };
        // Scaled, which loses nothing: the square of an area is a fourth power of lengths.
        let scale = power_of_two_below(1.0 / length);
        let across = accurate_cross(base * scale, slant * scale);
        let (doubled_area, scaled_length) = (across.length(), length * scale);
        // Below this, the cross product is rounding and gives no direction.
        let flat = doubled_area <= FLAT * scaled_length * scaled_length;
        let normal = if flat { x.any_orthonormal_vector() } else { across / doubled_area };
        let height = if flat { 0.0 } else { doubled_area / scaled_length / scale };
        let apex = [slant.dot(x).clamp(0.0, length), height];
        let reciprocal = [apex[0], length - apex[0]].map(|run| {
            let squared = run * run + height * height;
            if squared > 0.0 { 1.0 / squared } else { 0.0 }
        });
        Self { origin: a, x, y: normal.cross(x), normal, length, apex, reciprocal }
    }

    /// Whether the corners are collinear to rounding.
    pub fn is_flat(&self) -> bool {
        self.apex[1] == 0.0
    }

    /// In-plane coordinates of `p`, and its height over the plane.
    #[inline]
    pub fn local(&self, p: Vec3) -> [f64; 3] {
        let w = p - self.origin;
        [w.dot(self.x), w.dot(self.y), w.dot(self.normal)]
    }

    /// The point of the plane with the given in-plane coordinates.
    pub fn point(&self, x: f64, y: f64) -> Vec3 {
        self.origin + x * self.x + y * self.y
    }

    /// Whether in-plane coordinates lie in the triangle. Not meant for flat ones.
    #[inline]
    pub fn contains(&self, x: f64, y: f64) -> bool {
        let [left, right] = self.sides(x, y);
        y >= 0.0 && left >= 0.0 && right >= 0.0
    }

    /// Twice the signed areas over the sides `ac` and `bc`, positive inside.
    #[inline]
    fn sides(&self, x: f64, y: f64) -> [f64; 2] {
        let [cx, cy] = self.apex;
        [cy * x - cx * y, cy * (self.length - x) - (self.length - cx) * y]
    }

    /// Squared distance of `p` to the triangle.
    #[inline]
    pub fn distance_squared(&self, p: Vec3) -> f64 {
        let [x, y, height] = self.local(p);
        height * height + self.planar_distance_squared(x, y)
    }

    /// The nearest point lies on a side whose line separates it from the query, so only those
    /// sides (one or two) are measured.
    #[inline]
    fn planar_distance_squared(&self, x: f64, y: f64) -> f64 {
        let [left, right] = self.sides(x, y);
        let flat = self.is_flat();
        if y >= 0.0 && left >= 0.0 && right >= 0.0 && !flat {
            return 0.0;
        }
        let mut best = f64::INFINITY;
        if y < 0.0 || flat {
            let beyond = x - x.clamp(0.0, self.length);
            best = beyond * beyond + y * y;
        }
        if left < 0.0 && !flat {
            best = best.min(self.along(0, x, y).1);
        }
        if right < 0.0 && !flat {
            best = best.min(self.along(1, x, y).1);
        }
        best
    }

    /// Parameter from `a` (or `b`) to `c` of the nearest point on the side, and squared distance.
    #[inline]
    fn along(&self, side: usize, x: f64, y: f64) -> (f64, f64) {
        let [cx, cy] = self.apex;
        // Where the side starts along the base, and how far it runs along it.
        let (start, run) = if side == 0 { (0.0, cx) } else { (self.length, cx - self.length) };
        let t = (((x - start) * run + y * cy) * self.reciprocal[side]).clamp(0.0, 1.0);
        let (dx, dy) = (x - start - t * run, y - t * cy);
        (t, dx * dx + dy * dy)
    }

    /// The part of the triangle that is nearest to `p`, with the parameter along it if a side.
    pub fn nearest_part(&self, p: Vec3) -> (Part, f64) {
        let [x, y, _] = self.local(p);
        let [left, right] = self.sides(x, y);
        let flat = self.is_flat();
        if y >= 0.0 && left >= 0.0 && right >= 0.0 && !flat {
            return (Part::Face, 0.0);
        }
        let mut best = (f64::INFINITY, 0, 0.0);
        if y < 0.0 || flat {
            let t = x.clamp(0.0, self.length);
            let share = if self.length > 0.0 { t / self.length } else { 0.0 };
            best = ((x - t) * (x - t) + y * y, 0, share);
        }
        for (side, value) in [(0, left), (1, right)] {
            let (t, squared) = self.along(side, x, y);
            if value < 0.0 && !flat && squared < best.0 {
                // Sides run a -> b -> c -> a, but `along` measures from `a` to `c`.
                best = if side == 0 { (squared, 2, 1.0 - t) } else { (squared, 1, t) };
            }
        }
        let (_, side, t) = best;
        match t {
            t if t <= 0.0 => (Part::Corner(side), 0.0),
            t if t >= 1.0 => (Part::Corner((side + 1) % 3), 0.0),
            t => (Part::Side(side), t),
        }
    }
}

/// The largest power of two that is not above a positive number; 1 for zero or infinity.
pub fn power_of_two_below(value: f64) -> f64 {
    if value.is_normal() { f64::from_bits(value.to_bits() & (0x7ff << 52)) } else { 1.0 }
}

/// Cross product with every component within two units in the last place of its exact value.
///
/// The normal of a needle is a small difference of large products; a plain cross product would
/// turn it by as much as the triangle is thin.
pub fn accurate_cross(u: Vec3, v: Vec3) -> Vec3 {
    Vec3::new(
        difference_of_products(u.y, v.z, u.z, v.y),
        difference_of_products(u.z, v.x, u.x, v.z),
        difference_of_products(u.x, v.y, u.y, v.x),
    )
}

/// `a b - c d` by Kahan's algorithm (Jeannerod, Louvet, Muller 2013, doi:10.1090/S0025-5718-2013-02679-8).
fn difference_of_products(a: f64, b: f64, c: f64, d: f64) -> f64 {
    let product = c * d;
    let lost = (-c).mul_add(d, product);
    a.mul_add(b, -product) + lost
}
