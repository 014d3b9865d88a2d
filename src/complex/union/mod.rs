//! The union of the spheres, cones and slabs of a medial mesh, and distances to it.
//!
//! With `s_i(p)` the signed distance to the `i`-th primitive (negative inside), two readings of
//! "distance to the reconstruction" are in use, and they differ inside:
//!
//! - `sigma(p) = min_i s_i(p)`: outside the union its exact distance. Inside, `-sigma` is the
//!   depth in the deepest single primitive, a lower bound of the depth in the union.
//! - `mu(p) = min_i |s_i(p)|`: distance to the nearest primitive surface, including those buried
//!   inside other primitives. The reading of the Q-MAT paper (Li et al. 2015,
//!   doi:10.1145/2753755). Never more than `|sigma|`.
//!
//! Each edge is evaluated once, not once for every face: the sides of a face are edges of the mesh, so
//! a face adds only the part between its two tangent triangles. A sphere with an edge lies in the
//! edge's cone. If several primitives have the same spheres up to rounding, only one is evaluated
//! ([`Distinct`]).

use std::collections::HashSet;

use rayon::prelude::*;
use search::{Nearer, Part, Parts, Shape};

use super::{ComplexError, MedialMesh};
use crate::Vec3;
use crate::geometry::trees::{Bounds, in_morton_order};
use crate::geometry::{Cone, SlabFace, Sphere};

mod search;

/// The union of the medial primitives of a mesh, prepared for distance queries.
///
/// Distances are the least over all primitives, in double precision. Spheres that agree to 1e-13 of
/// their radius count as one, which changes distances by at most six times that.
///
/// ```
/// use medial::Vec3;
/// use medial::complex::{MedialMesh, MedialUnion, Sphere};
///
/// let spheres = vec![Sphere::new(Vec3::ZERO, 1.0), Sphere::new(4.0 * Vec3::X, 1.0)];
/// let capsule = MedialMesh::from_simplices(spheres, vec![[0, 1]], vec![])?;
/// let union = MedialUnion::new(&capsule)?;
/// assert_eq!(union.signed(Vec3::new(2.0, 3.0, 0.0)), 2.0);
/// assert_eq!(union.signed(Vec3::new(2.0, 0.0, 0.0)), -1.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct MedialUnion {
    parts: Parts,
    /// Box around all balls.
    balls: Bounds,
}

/// A simplex of the mesh, the id of its medial primitive. Ordered as evaluated: of equally
/// near primitives the smallest is reported.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Primitive {
    /// Index into [`MedialMesh::spheres`].
    Sphere(u32),
    /// Index into [`MedialMesh::edges`].
    Edge(u32),
    /// Index into [`MedialMesh::faces`].
    Face(u32),
}

/// The result of a query: a signed distance and the primitive it belongs to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NearestPrimitive {
    /// Signed distance to that primitive, negative inside.
    pub signed: f64,
    /// The primitive. A point nearest to the side of a face reports the edge.
    pub primitive: Primitive,
}

/// Larger coordinates and radii would overflow when squared.
const MAX_COORDINATE: f64 = 1e150;

/// Why a medial mesh has no union.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the messages name the fields")]
pub enum UnionError {
    /// There is nothing to be near to.
    #[error("the medial mesh has no spheres")]
    Empty,
    /// The mesh breaks its own rules.
    #[error(transparent)]
    Invalid(#[from] ComplexError),
    /// A sphere is too large or too far away for distances to it to be computed.
    #[error(
        "sphere {sphere} has a coordinate or radius above 1e150 units: is the medial mesh in the \
         unit of the surface?"
    )]
    TooLarge { sphere: usize },
}

impl MedialUnion {
    /// The union of all primitives of a mesh. Cost `O(n log n)`.
    ///
    /// # Errors
    /// When the mesh has no spheres, breaks a rule of [`MedialMesh::check`], or has a sphere whose
    /// squares would overflow.
    pub fn new(mesh: &MedialMesh) -> Result<Self, UnionError> {
        mesh.check()?;
        let too_large =
            |m: &Sphere| m.centre.abs().max_element() > MAX_COORDINATE || m.radius > MAX_COORDINATE;
        if let Some(sphere) = mesh.spheres.iter().position(too_large) {
            return Err(UnionError::TooLarge { sphere });
        }
        let mut distinct = Distinct::new(mesh);
        // Spheres that need no part of their own: ends of proper cones, and spheres inside a neighbour,
        // which is nearer everywhere.
        let mut covered = vec![false; mesh.spheres.len()];
        let mut parts = Vec::with_capacity(mesh.edges.len() + mesh.faces.len());
        for (e, &ends) in (0..).zip(&mesh.edges) {
            if !distinct.is_proper(ends) {
                continue;
            }
            let balls = mesh.spheres_of(ends);
            let [a, b] = balls;
            let cone = Cone::new(a, b);
            if let Some(larger) = cone.larger() {
                if distinct.is_smaller(&balls[1 - larger], &balls[larger]) {
                    covered[distinct.sphere(ends[1 - larger]) as usize] = true;
                }
            } else if distinct.is_first(ends) {
                for v in ends {
                    covered[distinct.sphere(v) as usize] = true;
                }
                parts.push(Part::new(Primitive::Edge(e), Shape::Cone(cone), &balls));
            }
        }
        for (f, &corners) in (0..).zip(&mesh.faces) {
            let is_proper = distinct.is_proper(corners);
            let balls = mesh.spheres_of(corners);
            // Without tangent planes the slab is the union of its cones.
            if is_proper
                && let Some(face) = SlabFace::new(balls)
                && distinct.is_first(corners)
            {
                parts.push(Part::new(Primitive::Face(f), Shape::Slab(face), &balls));
            }
        }
        for (v, &m) in (0..).zip(&mesh.spheres) {
            if distinct.sphere(v) == v && !covered[v as usize] {
                parts.push(Part::new(Primitive::Sphere(v), Shape::Sphere(m), &[m]));
            }
        }
        if parts.is_empty() {
            return Err(UnionError::Empty);
        }
        let corners = |m: &Sphere| [m.centre - m.radius, m.centre + m.radius];
        let balls = Bounds::of_points(mesh.spheres.iter().flat_map(corners));
        Ok(Self { parts: Parts::new(parts, balls), balls })
    }

    /// The union of the spheres alone, without cones and slabs.
    ///
    /// # Errors
    /// When there are none, or one is not finite or of negative radius.
    pub fn of_spheres(spheres: &[Sphere]) -> Result<Self, UnionError> {
        let mesh = MedialMesh { spheres: spheres.to_vec(), ..MedialMesh::default() };
        Self::new(&mesh)
    }

    /// Smallest and largest corner of an axis-parallel box around the union.
    pub fn bounding_box(&self) -> (Vec3, Vec3) {
        let Bounds { lo, hi } = self.balls;
        (lo, hi)
    }

    /// `sigma(p)`: the least signed distance to a primitive. Positive outside the union and then
    /// exact; inside, `-sigma` is a lower bound of the depth. A query that is
    /// not finite gets a distance that is not.
    pub fn signed(&self, p: Vec3) -> f64 {
        self.deepest(p).signed
    }

    /// `sigma(p)`, searched from the primitive that the last call with the same `near` found. Faster
    /// for consecutive nearby points; the result is the same.
    pub(crate) fn signed_from(&self, p: Vec3, near: &mut usize) -> f64 {
        self.deepest_or(p, near, f64::NEG_INFINITY).signed
    }

    /// The signed distance to the primitive at a place alone; infinite where the cones of a slab's sides decide.
    pub(crate) fn signed_at_place(&self, p: Vec3, place: usize) -> f64 {
        self.parts.shape(place).signed(p)
    }

    /// The primitive of least signed distance, searched as in [`signed_from`](Self::signed_from), or any whose
    /// distance is at most `enough`.
    pub(crate) fn deepest_or(&self, p: Vec3, near: &mut usize, enough: f64) -> NearestPrimitive {
        self.parts.nearest::<true>(p, near, enough)
    }

    /// The primitive of least signed distance, searched as in [`signed_from`](Self::signed_from), and the
    /// centre of its interpolated sphere that attains the distance.
    pub(crate) fn deepest_from(
        &self,
        p: Vec3,
        near: &mut usize,
    ) -> (NearestPrimitive, Option<Vec3>) {
        let nearest = self.deepest_or(p, near, f64::NEG_INFINITY);
        (nearest, self.parts.shape(*near).nearest_centre(p).map(|(_, centre)| centre))
    }

    /// A point of the union's boundary near to `p`, searched as in [`signed_from`](Self::signed_from).
    /// If `p` is outside, the closest point. From inside, the point leaves the deepest primitive, again
    /// and again; `None` if it ends more than `burial` inside some primitive.
    pub(crate) fn boundary_near(&self, p: Vec3, burial: f64, near: &mut usize) -> Option<Vec3> {
        let mut point = p;
        for _ in 0..MAX_EXITS {
            let nearest = self.deepest_or(point, near, f64::NEG_INFINITY);
            let (signed, centre) = self.parts.shape(*near).nearest_centre(point)?;
            if (-burial..=burial).contains(&signed) {
                return Some(point);
            }
            debug_assert!((signed - nearest.signed).abs() <= 1e-9 * (1.0 + signed.abs()));
            point -= signed * (point - centre).try_normalize()?;
        }
        (self.signed_from(point, near) >= -burial).then_some(point)
    }

    /// `mu(p)`: the least distance to the surface of a primitive, buried or not. Begun as in
    /// [`signed_from`](Self::signed_from).
    pub(crate) fn unsigned_from(&self, p: Vec3, near: &mut usize) -> f64 {
        self.parts.nearest::<false>(p, near, f64::NEG_INFINITY).signed.abs()
    }

    /// The primitive of least signed distance.
    pub fn deepest(&self, p: Vec3) -> NearestPrimitive {
        self.deepest_or(p, &mut 0, f64::NEG_INFINITY)
    }

    /// [`signed`](Self::signed) for many points, in their order, in parallel.
    pub fn signed_batch(&self, points: &[Vec3]) -> Vec<f64> {
        in_morton_order(points, |last: &mut usize, p| self.signed_from(p, last))
    }

    /// `mu(p)`: the least distance to the surface of a primitive, buried or not, for many points, in their order, in
    /// parallel.
    pub fn unsigned_nearest_batch(&self, points: &[Vec3]) -> Vec<f64> {
        in_morton_order(points, |last: &mut usize, p| self.unsigned_from(p, last))
    }

    /// [`deepest`](Self::deepest) for many points, in their order, in parallel. Each search begins with the
    /// primitive that `near` names for the point, or, where it names none, with the one that was found last:
    /// fast if these are near. Where `enough` has a distance for the point, any primitive that is no farther
    /// away is accepted.
    pub fn deepest_batch_near(
        &self,
        points: &[Vec3],
        near: &[NearestPrimitive],
        enough: impl Fn(usize) -> Option<f64> + Sync,
    ) -> Vec<NearestPrimitive> {
        let places = self.parts.places();
        let runs = points.par_chunks(RUN).enumerate();
        let runs = runs.flat_map_iter(|(run, points)| {
            let mut last = 0;
            let (places, enough) = (&places, &enough);
            points.iter().zip(RUN * run..).map(move |(&p, i)| {
                let named = near.get(i).and_then(|near| places.of(near.primitive));
                last = named.unwrap_or(last);
                self.deepest_or(p, &mut last, enough(i).unwrap_or(f64::NEG_INFINITY))
            })
        });
        runs.collect()
    }

    /// For many points, in their order, in parallel: the [`deepest`](Self::deepest) primitive, if its distance is
    /// below the limit of the point. Fast where most are not.
    pub fn below_batch(&self, points: &[Vec3], limits: &[f64]) -> Vec<Option<NearestPrimitive>> {
        let pairs = points.par_iter().zip(limits).with_min_len(RUN);
        pairs.map(|(&p, &limit)| self.parts.below(p, limit, false)).collect()
    }

    /// For many points, in their order, in parallel: [`signed`](Self::signed), and the radius of the
    /// ball on the primitive that attains it, with the place of that primitive.
    pub(crate) fn deepest_ball_batch(&self, points: &[Vec3]) -> Vec<(f64, f64, u32)> {
        in_morton_order(points, |last: &mut usize, p| {
            let signed = self.signed_from(p, last);
            (signed, self.parts.shape(*last).radius_towards(p), *last as u32)
        })
    }

    /// Whether some primitive holds `p` more than `depth` below its surface; with a negative depth,
    /// whether one is nearer than that. Ends at the first that is found.
    pub fn buries(&self, p: Vec3, depth: f64) -> bool {
        self.parts.below(p, -depth, true).is_some()
    }

    /// The places of the points that no primitive [`buries`](Self::buries) deeper than `depth`, in their order, with
    /// their [`signed`](Self::signed) distances. Fast if few primitives bury most points, as on the
    /// surface of another primitive.
    pub fn unburied(&self, points: &[Vec3], depth: f64) -> Vec<(usize, f64)> {
        // Primitives that buried a point are tried first, the most recent one before the others.
        let mut recent = [None; RECENT];
        let mut near = 0;
        let mut signed = |p: Vec3| {
            let again = recent.iter().position(|place: &Option<usize>| {
                place.is_some_and(|place| self.parts.shape(place).signed(p) < -depth)
            });
            let signed = match again {
                Some(_) => None,
                None => Some(self.deepest_or(p, &mut near, (-depth).next_down()).signed)
                    .filter(|&signed| signed >= -depth),
            };
            if signed.is_none() {
                let burier = again.map_or(Some(near), |turn| recent[turn]);
                recent[..=again.unwrap_or(RECENT - 1)].rotate_right(1);
                recent[0] = burier;
            }
            signed
        };
        points.iter().enumerate().filter_map(|(i, &p)| Some((i, signed(p)?))).collect()
    }

    /// Calls `each` for all primitives nearer to `p` than `limit` by signed distance, with that
    /// distance and the centre of the interpolated sphere that attains it. A slab is passed only if its
    /// nearest sphere is inside the triangle; else the cones of its sides replace it.
    pub(crate) fn each_nearer(&self, p: Vec3, limit: f64, each: impl FnMut(f64, Vec3)) {
        self.parts.search(&mut Nearer { parts: &self.parts, p, limit, each });
    }
}

/// Bound on the primitives that are left, one after the other, on the way out of a union.
const MAX_EXITS: usize = 12;

/// Queries that run one after the other on one thread.
const RUN: usize = 512;

/// Number of remembered primitives that buried a point.
const RECENT: usize = 4;

// Spheres that differ by no more than rounding.
//
// A round solid has one medial sphere. A method that computes it from samples gets hundreds of
// spheres, equal up to the last few digits, with cones and slabs between them. Their distances differ
// in these digits only, so no bound separates them, and each query would measure them all. So of all
// simplices on the same groups of equal spheres only the first is measured.

/// Spheres whose coordinates and radii agree to this share of the radius count as one. Distances change
/// by at most six times that share: a sphere can differ by it, in centre and radius, from the one that
/// represents its group, and this one again from the sphere that is measured.
const EQUAL: f64 = 1e-13;

/// A generic direction in space and radius: spheres at the same place along it are most likely equal.
const GENERIC: [f64; 4] = [0.612_372_4, 0.573_576_4, 0.543_988_1, 0.518_304_7];

/// The simplices of a mesh that are to be measured.
struct Distinct {
    /// For each sphere the one that represents its group.
    group: Vec<u32>,
    /// Whether some spheres are equal.
    any: bool,
    seen: HashSet<[u32; 3]>,
}

impl Distinct {
    /// Groups the spheres of a mesh. `O(n log n)`, as long as few spheres of different groups have
    /// the same place along one direction.
    pub fn new(mesh: &MedialMesh) -> Self {
        let spheres = &mesh.spheres;
        let [x, y, z, r] = GENERIC;
        let along =
            spheres.iter().map(|m| x * m.centre.x + y * m.centre.y + z * m.centre.z + r * m.radius);
        let mut order: Vec<(f64, u32)> = along.zip(0..).collect();
        order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut group: Vec<u32> = (0..spheres.len() as u32).collect();
        let mut any = false;
        // Of each group the first sphere along the direction.
        let mut firsts: Vec<(f64, u32)> = Vec::new();
        for (place, v) in order {
            let m = &spheres[v as usize];
            // Rounding of the place itself is a share of the coordinates.
            let largest = m.centre.abs().max_element().max(m.radius);
            let reach = 3.0 * EQUAL * m.radius + 16.0 * f64::EPSILON * largest;
            let near = firsts.iter().rev().take_while(|first| first.0 >= place - reach);
            match near.map(|&(_, w)| w).find(|&w| is_equal(&spheres[w as usize], m)) {
                Some(w) => (group[v as usize], any) = (w, true),
                None => firsts.push((place, v)),
            }
        }
        Self { group, any, seen: HashSet::new() }
    }

    /// The representative of this sphere.
    #[inline]
    pub fn sphere(&self, v: u32) -> u32 {
        self.group[v as usize]
    }

    /// Whether a ball within another one is smaller by more than equal balls can differ. (Otherwise two
    /// groups could each have a ball within one of the other, and neither would be measured.)
    pub fn is_smaller(&self, inner: &Sphere, outer: &Sphere) -> bool {
        !self.any || outer.radius - inner.radius > 4.0 * EQUAL * outer.radius
    }

    /// Whether the ends of an edge or the corners of a face belong to different groups.
    pub fn is_proper<const N: usize>(&self, simplex: [u32; N]) -> bool {
        (0..N).all(|k| (0..k).all(|j| self.sphere(simplex[j]) != self.sphere(simplex[k])))
    }

    /// Whether no simplex on the same groups was passed before.
    pub fn is_first<const N: usize>(&mut self, simplex: [u32; N]) -> bool {
        if !self.any {
            return true;
        }
        let mut key = [u32::MAX; 3];
        for (slot, v) in key.iter_mut().zip(simplex) {
            *slot = self.sphere(v);
        }
        key.sort_unstable();
        self.seen.insert(key)
    }
}

fn is_equal(m: &Sphere, other: &Sphere) -> bool {
    let most = EQUAL * m.radius.min(other.radius);
    let apart = (m.centre - other.centre).abs().max_element();
    apart <= most && (m.radius - other.radius).abs() <= most
}

#[cfg(test)]
mod tests;
