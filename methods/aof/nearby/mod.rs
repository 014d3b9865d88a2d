//! Closest points for many queries close to each other: the few triangles that can matter are
//! collected once, and passed from a region to the regions inside it.
//!
//! 1. For a ball of radius `reach` around `c`, every closest point lies within `D(c) + 2 reach` of
//!    `c`, with `D` the distance to the surface. The triangles that come so near are the
//!    [`NearSet`] of the ball. The set of a ball inside it is a part of its set.
//! 2. A triangle is convex: with `u` the unit vector from `c` to its closest point and `d` the
//!    distance, it lies beyond the plane `(y - c) . u = d`. A query `p` is therefore at least
//!    `d - (p - c) . u` away from it. This bound excludes most triangles of a set.
//! 3. With `u0` and `D` those of the nearest triangle, and `w = p - c`, the closest point to `c` is at
//!    most `D - u0 . w + e` away from `p`, `e = D - sqrt(D^2 - reach^2)`. By step 2 a triangle
//!    matters only if `d <= D + |u - u0| reach + e`. That is far less than `D + 2 reach` on the side
//!    where the nearest triangle is.
//! 4. Queries are measured two at a time in double precision.
//!
//! Queries are inside the surface, so features differ in their effect on the distance there. A *fan*
//! feature is a concave edge or a vertex of one: it is the closest point of a whole wedge of space.
//! Edges between coplanar faces, convex edges, and vertices without a concave edge are the closest
//! point of points straight above them only, as any other point of their faces.

mod batch;

use medial::Vec3;
use medial::geometry::planar_frame::{Part, PlanarFrame};
use medial::surface::TriMesh;
use wide::f64x2;

pub use batch::NearBatch;
use batch::{Spread, dot};

/// Sine of the dihedral deviation below which two faces are coplanar.
const COPLANAR: f64 = 1e-7;

/// Largest distance between the normals of triangles in one plane.
const SAME_NORMAL: f64 = 1e-12;

/// Triangles in their own frames, with the kinds of their sides and corners.
#[derive(Clone, Debug)]
pub struct NearbyTriangles {
    frames: Vec<PlanarFrame>,
    /// Bit `k`: side `k` is concave; bit `3 + k`: corner `k` ends a concave side. In the order of
    /// the frame's corners.
    fans: Vec<u8>,
}

/// The triangles that can hold the closest point of a query in a ball.
#[derive(Clone, Debug, Default)]
pub struct NearSet {
    centre: Vec3,
    /// Ascending triangles.
    entries: Vec<Entry>,
    /// Place of the nearest.
    nearest: usize,
}

#[derive(Clone, Copy, Debug)]
struct Entry {
    triangle: u32,
    distance: f64,
    /// Unit vector from the centre to the closest point, or zero.
    toward: Vec3,
}

/// Where the closest point of a query lies, seen from inside the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NearPoint {
    /// Distance from the query.
    pub distance: f64,
    /// Unit vector from the closest point to the query: the gradient of the distance; zero on the
    /// surface.
    pub gradient: Vec3,
    /// Whether the closest point lies on a concave edge or vertex.
    pub on_fan: bool,
    /// The triangle.
    pub triangle: u32,
}

impl NearbyTriangles {
    /// The triangles of a closed, outward-oriented surface. `O(F log F)`.
    ///
    /// # Panics
    /// If a face names a vertex that does not exist.
    pub fn new(mesh: &TriMesh) -> Self {
        let (frames, firsts): (Vec<_>, Vec<_>) =
            (0..mesh.faces.len()).map(|f| PlanarFrame::new(mesh.triangle(f))).unzip();
        let concave = concave_sides(mesh, &frames);
        let mut concave_vertex = vec![false; mesh.vertices.len()];
        for (face, sides) in mesh.faces.iter().zip(&concave) {
            for k in (0..3).filter(|&k| sides[k]) {
                concave_vertex[face[k] as usize] = true;
                concave_vertex[face[(k + 1) % 3] as usize] = true;
            }
        }
        let fans = (0..mesh.faces.len()).map(|f| {
            (0..3).fold(0_u8, |bits, k| {
                let corner = (firsts[f] + k) % 3;
                let vertex = mesh.faces[f][corner] as usize;
                bits | u8::from(concave[f][corner]) << k
                    | u8::from(concave_vertex[vertex]) << (3 + k)
            })
        });
        Self { fans: fans.collect(), frames }
    }

    /// Number of triangles.
    pub fn len(&self) -> usize {
        self.frames.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.frames.is_empty()
    }

    /// All triangles, as the set of a ball that is as large as need be. `O(F)`.
    pub fn all(&self, centre: Vec3) -> NearSet {
        let entries = (0..self.len()).map(|t| self.measure(t as u32, centre)).collect();
        let mut set = NearSet { centre, entries, nearest: 0 };
        set.find_nearest();
        set
    }

    /// Makes `set` the set of the ball around `centre`, which must lie in the ball of `within`.
    pub fn narrow(&self, within: &NearSet, centre: Vec3, reach: f64, set: &mut NearSet) {
        set.centre = centre;
        set.entries.clear();
        set.nearest = 0;
        let Some(first) = within.entries.get(within.nearest) else {
            return;
        };
        let moved = centre - within.centre;
        let bound = |entry: &Entry| entry.distance - entry.toward.dot(moved);
        let mut best = self.measure(first.triangle, centre);
        // Starting from the old nearest, which is usually still it, few others are measured.
        for entry in &within.entries {
            if bound(entry) < best.distance {
                let measured = self.measure(entry.triangle, centre);
                if measured.distance < best.distance {
                    best = measured;
                }
            }
        }
        // The bound from the old set first: it excludes most triangles without measuring them.
        let relevant = Relevant::new(&best, reach);
        let mut nearest = f64::INFINITY;
        for entry in &within.entries {
            if !relevant.may_be_nearest(bound(entry), entry.toward) {
                continue;
            }
            let entry = self.measure(entry.triangle, centre);
            if relevant.may_be_nearest(entry.distance, entry.toward) {
                if entry.distance < nearest {
                    (nearest, set.nearest) = (entry.distance, set.entries.len());
                }
                set.entries.push(entry);
            }
        }
    }

    #[inline]
    fn measure(&self, triangle: u32, p: Vec3) -> Entry {
        let (distance, away) = self.frames[triangle as usize].distance_and_direction(p);
        Entry { triangle, distance, toward: -away }
    }

    /// Closest point of a triangle, and whether it lies on a fan feature.
    fn foot(&self, triangle: u32, p: Vec3) -> (Vec3, bool) {
        let frame = &self.frames[triangle as usize];
        let fans = self.fans[triangle as usize];
        let (part, t) = frame.nearest_part(p);
        let corner = |k: usize| match k % 3 {
            0 => frame.origin,
            1 => frame.point(frame.length, 0.0),
            _ => frame.point(frame.apex[0], frame.apex[1]),
        };
        match part {
            Part::Face => {
                let [x, y, _] = frame.local(p);
                (frame.point(x, y), false)
            }
            Part::Side(k) => (corner(k).lerp(corner(k + 1), t), fans >> k & 1 == 1),
            Part::Corner(k) => (corner(k), fans >> (3 + k) & 1 == 1),
        }
    }

    /// The gradient of the distance in the whole ball, if all triangles of the set lie in one plane.
    /// No closest point lies at their border: the triangle beyond the border would be in the set.
    pub fn constant_gradient(&self, set: &NearSet) -> Option<Vec3> {
        let frame = |entry: &Entry| &self.frames[entry.triangle as usize];
        let own = frame(set.entries.get(set.nearest)?);
        let height = own.local(set.centre)[2];
        let in_plane = |other: &PlanarFrame| {
            let apart = (other.origin - own.origin).dot(own.normal);
            !other.is_flat()
                && other.normal.distance_squared(own.normal) < SAME_NORMAL * SAME_NORMAL
                && apart.abs() < SAME_NORMAL * height.abs()
        };
        let all = set.entries.iter().all(|entry| in_plane(frame(entry)));
        all.then(|| own.normal * height.signum())
    }

    /// Answers a batch. A query with a bound stays unanswered if no triangle of the set is nearer.
    pub fn closest(&self, set: &NearSet, batch: &mut NearBatch) {
        // The nearest triangle of the centre first: its distances exclude most of the others.
        let Some(first) = set.entries.get(set.nearest) else {
            return;
        };
        let frame = Spread::new(&self.frames[first.triangle as usize], set.centre);
        for (point, answer) in batch.points.iter().zip(&mut batch.answers) {
            frame.measure(point, f64::from(first.triangle), answer);
        }
        for (place, entry) in set.entries.iter().enumerate() {
            if place != set.nearest {
                self.closest_on(entry, set.centre, batch);
            }
        }
    }

    fn closest_on(&self, entry: &Entry, centre: Vec3, batch: &mut NearBatch) {
        let frame = Spread::new(&self.frames[entry.triangle as usize], centre);
        let toward = entry.toward.to_array().map(f64x2::splat);
        let distance = f64x2::splat(entry.distance * (1.0 - 1e-12));
        for (point, answer) in batch.points.iter().zip(&mut batch.answers) {
            let bound = distance - dot(&toward, point);
            let near = (bound.simd_le(f64x2::ZERO)) | (bound * bound).simd_le(answer.squared);
            if near.any() {
                frame.measure(point, f64::from(entry.triangle), answer);
            }
        }
    }

    /// The result for query `k` of a batch; `None` if nothing is nearer than its bound.
    #[inline]
    pub fn answer(&self, set: &NearSet, batch: &NearBatch, k: usize) -> Option<NearPoint> {
        let (answer, lane) = (&batch.answers[k / 2], k % 2);
        let triangle = answer.triangle.to_array()[lane];
        if triangle < 0.0 {
            return None;
        }
        let triangle = triangle as u32;
        let distance = answer.squared.to_array()[lane].sqrt();
        let p = set.centre + batch.point(k);
        if answer.is_interior(lane) {
            let frame = &self.frames[triangle as usize];
            let height = frame.local(p)[2];
            let gradient =
                if distance == 0.0 { Vec3::ZERO } else { frame.normal * height.signum() };
            return Some(NearPoint { distance, gradient, on_fan: false, triangle });
        }
        let (foot, on_fan) = self.foot(triangle, p);
        let gradient = (p - foot).try_normalize().unwrap_or(Vec3::ZERO);
        Some(NearPoint { distance, gradient, on_fan, triangle })
    }

    /// The sum of `gradient . query` over the queries, relative to the centre, whose closest points
    /// are inside triangles. The other queries that have an answer go to `beside`.
    #[inline]
    pub fn sum_along(
        &self,
        set: &NearSet,
        batch: &NearBatch,
        mut beside: impl FnMut(usize, NearPoint),
    ) -> f64 {
        let (mut sum, mut single) = (f64x2::ZERO, 0.0);
        for (pair, answer) in batch.answers.iter().enumerate() {
            // The usual case without unpacking lanes; an odd last query has a copy in its second lane.
            if answer.interior.all() && 2 * pair + 1 < batch.len {
                sum += answer.along;
                continue;
            }
            for k in 2 * pair..(2 * pair + 2).min(batch.len) {
                if answer.is_interior(k % 2) {
                    single += answer.along.to_array()[k % 2];
                } else if let Some(near) = self.answer(set, batch, k) {
                    beside(k, near);
                }
            }
        }
        let [even, odd] = sum.to_array();
        even + odd + single
    }

    /// The closest point of the surface to a point of the ball, relative to its centre, if it is
    /// nearer than `bound`, and its distance.
    pub fn closest_within(&self, set: &NearSet, point: Vec3, bound: f64) -> Option<(Vec3, f64)> {
        let p = set.centre + point;
        let (mut best, mut found) = (bound, None);
        for entry in &set.entries {
            if entry.distance * (1.0 - 1e-12) - entry.toward.dot(point) < best {
                let (distance, away) =
                    self.frames[entry.triangle as usize].distance_and_direction(p);
                if distance < best {
                    best = distance;
                    found = Some((p - away * distance, distance));
                }
            }
        }
        found
    }

    /// The closest point of query `k` of a batch.
    pub fn closest_point(&self, set: &NearSet, batch: &NearBatch, k: usize) -> Option<Vec3> {
        let near = self.answer(set, batch, k)?;
        Some(self.foot(near.triangle, set.centre + batch.point(k)).0)
    }
}

/// The test of step 3.
struct Relevant {
    /// `u0`.
    toward: Vec3,
    /// `D + e` and `D + 2 reach`, increased by a bound on rounding.
    limits: [f64; 2],
    reach: f64,
}

impl Relevant {
    fn new(nearest: &Entry, reach: f64) -> Self {
        let d = nearest.distance;
        let bent = if d > reach { d - (d * d - reach * reach).sqrt() } else { 2.0 * reach };
        let slack = 1e-12 * (d + reach);
        let limits = [d + bent + slack, d + 2.0 * reach + slack];
        Self { toward: nearest.toward, limits, reach }
    }

    /// Whether a triangle beyond a plane with the normal `toward`, at `distance` from the centre,
    /// may be nearest to a point of the ball.
    #[inline]
    fn may_be_nearest(&self, distance: f64, toward: Vec3) -> bool {
        // Squared, so that most triangles are decided without a root.
        let beyond = distance - self.limits[0];
        let turned = self.reach * self.reach * toward.distance_squared(self.toward);
        beyond <= 0.0 || (distance <= self.limits[1] && beyond * beyond <= turned)
    }
}

impl NearSet {
    /// Distance of the centre to the surface.
    pub fn distance(&self) -> f64 {
        self.entries.get(self.nearest).map_or(f64::INFINITY, |entry| entry.distance)
    }

    /// The centre of the ball.
    pub fn centre(&self) -> Vec3 {
        self.centre
    }

    /// Number of triangles.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    fn find_nearest(&mut self) {
        self.nearest = 0;
        for (place, entry) in self.entries.iter().enumerate() {
            if entry.distance < self.entries[self.nearest].distance {
                self.nearest = place;
            }
        }
    }
}

/// For each face and side `k`, from corner `k` on, whether the surface is concave there.
fn concave_sides(mesh: &TriMesh, frames: &[PlanarFrame]) -> Vec<[bool; 3]> {
    let mut sides: Vec<([u32; 2], u32, u8)> = Vec::with_capacity(3 * mesh.faces.len());
    for (face, corners) in (0..).zip(&mesh.faces) {
        for k in 0..3_u8 {
            let (a, b) = (corners[usize::from(k)], corners[(usize::from(k) + 1) % 3]);
            sides.push(([a.min(b), a.max(b)], face, k));
        }
    }
    sides.sort_unstable();
    let mut concave = vec![[false; 3]; mesh.faces.len()];
    for edge in sides.chunk_by(|a, b| a.0 == b.0) {
        let is_concave = match *edge {
            [(_, f, k), (_, g, _)] => {
                let corners = mesh.faces[f as usize];
                let at = |k: u8| mesh.vertices[corners[usize::from(k) % 3] as usize];
                let along = (at(k + 1) - at(k)).normalize_or_zero();
                let [n, m] = [f, g].map(|face| frames[face as usize].normal);
                let sine = n.cross(m).dot(along);
                sine < -COPLANAR || (sine <= COPLANAR && n.dot(m) < 0.0)
            }
            _ => true,
        };
        for &(_, face, k) in edge {
            concave[face as usize][usize::from(k)] = is_concave;
        }
    }
    concave
}

#[cfg(test)]
mod tests;
