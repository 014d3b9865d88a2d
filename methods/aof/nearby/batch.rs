//! Step 4: queries measured two at a time.

use medial::Vec3;
use medial::geometry::planar_frame::PlanarFrame;
use wide::f64x2;

/// Queries relative to the centre of a [`NearSet`](super::NearSet), answered together; reused without allocation.
#[derive(Clone, Debug, Default)]
pub struct NearBatch {
    pub(super) points: Vec<[f64x2; 3]>,
    pub(super) answers: Vec<Answer>,
    pub(super) len: usize,
}

/// The best of two queries so far.
#[derive(Clone, Copy, Debug)]
pub(super) struct Answer {
    pub(super) squared: f64x2,
    /// Triangle, as a number.
    pub(super) triangle: f64x2,
    /// Its gradient times the query, where the foot is inside the triangle.
    pub(super) along: f64x2,
    /// All bits set where the foot is inside the triangle.
    pub(super) interior: f64x2,
}

/// No triangle yet, or none that is nearer than the given bound.
pub(super) const NONE: f64 = -1.0;

impl NearBatch {
    /// Forgets all queries.
    pub fn clear(&mut self) {
        self.points.clear();
        self.answers.clear();
        self.len = 0;
    }

    /// Adds a query, relative to the centre of the set that will answer it. Only triangles nearer than
    /// `bound` count; infinity for no bound.
    pub fn push(&mut self, point: Vec3, bound: f64) {
        let lane = self.len % 2;
        if lane == 0 {
            self.points.push(point.to_array().map(f64x2::splat));
            self.answers.push(Answer::bounded(f64x2::splat(bound * bound)));
        } else {
            let last = self.len / 2;
            for (axis, value) in point.to_array().into_iter().enumerate() {
                let [even, _] = self.points[last][axis].to_array();
                self.points[last][axis] = f64x2::new([even, value]);
            }
            let [even, _] = self.answers[last].squared.to_array();
            self.answers[last] = Answer::bounded(f64x2::new([even, bound * bound]));
        }
        self.len += 1;
    }

    /// The same queries once more, without bounds.
    pub fn reset(&mut self) {
        self.answers.fill(Answer::bounded(f64x2::splat(f64::INFINITY)));
    }

    /// Number of queries.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there is no query.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Whether a triangle was found for query `k` that is nearer than its bound.
    #[inline]
    pub fn is_nearer(&self, k: usize) -> bool {
        self.answers[k / 2].triangle.to_array()[k % 2] >= 0.0
    }

    /// Query `k`, relative to the centre.
    pub fn point(&self, k: usize) -> Vec3 {
        let [x, y, z] = self.points[k / 2].map(|axis| axis.to_array()[k % 2]);
        Vec3::new(x, y, z)
    }
}

impl Answer {
    pub(super) fn bounded(squared: f64x2) -> Self {
        let none = f64x2::splat(NONE);
        Self { squared, triangle: none, along: f64x2::ZERO, interior: f64x2::ZERO }
    }

    #[inline]
    pub(super) fn is_interior(&self, lane: usize) -> bool {
        self.interior.to_bitmask() >> lane & 1 == 1
    }
}

pub(super) fn dot(a: &[f64x2; 3], b: &[f64x2; 3]) -> f64x2 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// A frame in both lanes, its origin relative to the centre of a set.
pub(super) struct Spread {
    /// Coordinates of the origin along the frame's own axes.
    origin: [f64x2; 3],
    axes: [[f64x2; 3]; 3],
    length: f64x2,
    apex: [f64x2; 2],
    reciprocal: [f64x2; 2],
    flat: bool,
}

impl Spread {
    #[inline]
    pub(super) fn new(frame: &PlanarFrame, centre: Vec3) -> Self {
        let axes = [frame.x, frame.y, frame.normal];
        let offset = frame.origin - centre;
        let [cx, cy] = frame.apex;
        Self {
            origin: axes.map(|axis| f64x2::splat(offset.dot(axis))),
            axes: axes.map(|axis| axis.to_array().map(f64x2::splat)),
            length: f64x2::splat(frame.length),
            apex: [f64x2::splat(cx), f64x2::splat(cy)],
            reciprocal: frame.reciprocal().map(f64x2::splat),
            flat: frame.is_flat(),
        }
    }

    /// [`PlanarFrame::distance_squared`] in both lanes: the least of the distances to the sides
    /// unless the foot is inside.
    #[inline]
    pub(super) fn measure(&self, point: &[f64x2; 3], triangle: f64, answer: &mut Answer) {
        let [x, y, height] = [0, 1, 2].map(|axis| dot(&self.axes[axis], point) - self.origin[axis]);
        let [cx, cy] = self.apex;
        let zero = f64x2::ZERO;
        let over = height * height;
        let beyond = self.length - x;
        let across = cx - self.length;
        let inside = if self.flat {
            zero
        } else {
            let left = cy * x - cx * y;
            let right = cy * beyond + across * y;
            y.simd_ge(zero) & left.simd_ge(zero) & right.simd_ge(zero)
        };
        // Queries of a pair are neighbours: usually both feet are inside, and the sides do not count.
        let squared = if inside.all() {
            over
        } else {
            let past = x - x.fast_max(zero).fast_min(self.length);
            let base = past * past + y * y;
            let along = |start: f64x2, run: f64x2, reciprocal: f64x2| {
                let t = (start * run + y * cy) * reciprocal;
                let t = t.fast_max(zero).fast_min(f64x2::ONE);
                let (dx, dy) = (start - t * run, y - t * cy);
                dx * dx + dy * dy
            };
            let sides = along(x, cx, self.reciprocal[0])
                .fast_min(along(-beyond, across, self.reciprocal[1]))
                .fast_min(base);
            over + inside.bitselect(zero, sides)
        };
        // Strictly nearer: of equally near triangles the first measured stays, in a fixed order.
        let nearer = squared.simd_lt(answer.squared);
        if nearer.any() {
            answer.squared = nearer.bitselect(squared, answer.squared);
            answer.triangle = nearer.bitselect(f64x2::splat(triangle), answer.triangle);
            // On the surface there is no gradient.
            let along = (height + self.origin[2]).flip_signs(height) & height.simd_ne(zero);
            answer.along = nearer.bitselect(along, answer.along);
            answer.interior = nearer.bitselect(inside, answer.interior);
        }
    }
}
