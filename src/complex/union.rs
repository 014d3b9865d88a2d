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
//! Each edge is evaluated once and not once for every face: the sides of a face are edges of the
//! mesh, so a face adds only the part between its two tangent triangles. A sphere with an edge
//! lies in that edge's cone.

use std::ops::Range;

use super::{ComplexError, MedialMesh};
use crate::Vec3;
use crate::geometry::{Bounds, Cone, Node, Plan, Search, SlabFace, Sphere, Tree, in_morton_order};

/// The union of the medial primitives of a mesh, prepared for distance queries.
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
    tree: Tree,
    /// In leaf order.
    shapes: Vec<Shape>,
    /// In leaf order.
    primitives: Vec<Primitive>,
    /// Box around all balls.
    balls: Bounds,
    /// More than rounding can contribute to a distance, beside its share of that distance.
    slack: f64,
}

/// A simplex of the mesh, which stands for its medial primitive. Ordered as evaluated: of equally
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

/// The answer to a query: a signed distance and the primitive it belongs to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NearestPrimitive {
    /// Signed distance to that primitive, negative inside.
    pub signed: f64,
    /// The primitive. A point nearest to the side of a face reports the edge.
    pub primitive: Primitive,
}

/// The two distances of a point to a union.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Readings {
    /// The least signed distance to a primitive.
    pub sigma: f64,
    /// The least distance to the surface of a primitive, buried or not.
    pub mu: f64,
}

/// More than the rounding errors of a bound and of a signed distance together, relative to the
/// distances and lengths that they are computed from: the distance itself, the radius, and how far
/// the primitive extends. These are differences of coordinates, so where the union lies does not
/// matter. Counted operation by operation, a slab has about 30 units of 2^-53 and a box 5.
const ROUNDING: f64 = 32.0 * f64::EPSILON;

/// Coordinates and radii beyond this would overflow when squared.
const LARGEST: f64 = 1e150;

/// Why a medial mesh has no union.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
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
    TooLarge {
        /// Index of the sphere.
        sphere: usize,
    },
}

#[derive(Clone, Debug)]
enum Shape {
    Sphere(Sphere),
    Cone(Cone),
    Slab(SlabFace),
}

impl Shape {
    /// Signed distance, infinite where a slab leaves the answer to the cones of its sides.
    #[inline]
    fn signed(&self, p: Vec3) -> f64 {
        match self {
            Self::Sphere(sphere) => sphere.signed_distance(p),
            Self::Cone(cone) => cone.signed_distance(p),
            Self::Slab(face) => face.signed_distance(p).unwrap_or(f64::INFINITY),
        }
    }

    /// As [`Shape::signed`], with the centre of the interpolated sphere that attains it; `None`
    /// where a slab leaves the answer to the cones of its sides.
    #[inline]
    fn nearest_centre(&self, p: Vec3) -> Option<(f64, Vec3)> {
        match self {
            Self::Sphere(sphere) => Some((sphere.signed_distance(p), sphere.centre)),
            Self::Cone(cone) => Some(cone.nearest_centre(p)),
            Self::Slab(face) => face.nearest_centre(p),
        }
    }

    /// Radius of the interpolated sphere that attains the signed distance.
    fn radius_towards(&self, p: Vec3) -> f64 {
        let radius = |(signed, centre): (f64, Vec3)| (p.distance(centre) - signed).max(0.0);
        self.nearest_centre(p).map_or(f64::INFINITY, radius)
    }
}

impl MedialUnion {
    /// The union of all primitives of a mesh. Cost `O(n log n)`.
    ///
    /// # Errors
    /// When the mesh has no spheres, breaks a rule of [`MedialMesh::check`], or has a sphere whose
    /// squares would overflow.
    pub fn new(mesh: &MedialMesh) -> Result<Self, UnionError> {
        mesh.check()?;
        let too_large = |m: &Sphere| m.centre.abs().max_element() > LARGEST || m.radius > LARGEST;
        if let Some(sphere) = mesh.spheres.iter().position(too_large) {
            return Err(UnionError::TooLarge { sphere });
        }
        let sphere = |v: u32| mesh.spheres[v as usize];
        // Spheres that need no part of their own: ends of proper cones, and those that lie in a
        // neighbour, whose own parts are then nearer everywhere.
        let mut covered = vec![false; mesh.spheres.len()];
        let mut parts = Vec::with_capacity(mesh.edges.len() + mesh.faces.len());
        for (e, &ends) in (0..).zip(&mesh.edges) {
            let [a, b] = ends.map(sphere);
            let cone = Cone::new(a, b);
            if let Some(larger) = cone.larger() {
                covered[ends[1 - larger] as usize] = true;
                continue;
            }
            for v in ends {
                covered[v as usize] = true;
            }
            parts.push((Primitive::Edge(e), Shape::Cone(cone), bounds(&[a, b])));
        }
        for (f, corners) in (0..).zip(&mesh.faces) {
            let corners = corners.map(sphere);
            // Without tangent planes the slab is the union of its cones.
            if let Some(face) = SlabFace::new(corners) {
                parts.push((Primitive::Face(f), Shape::Slab(face), bounds(&corners)));
            }
        }
        let alone = (0..).zip(&mesh.spheres).filter(|&(v, _): &(u32, _)| !covered[v as usize]);
        parts.extend(alone.map(|(v, &m)| (Primitive::Sphere(v), Shape::Sphere(m), bounds(&[m]))));
        Self::over(&parts, ball_box(&mesh.spheres))
    }

    /// The union of the spheres alone, without cones and slabs.
    ///
    /// # Errors
    /// When there are none, or one is not finite or of negative radius.
    pub fn of_spheres(spheres: &[Sphere]) -> Result<Self, UnionError> {
        let mesh = MedialMesh { spheres: spheres.to_vec(), ..MedialMesh::default() };
        Self::new(&mesh)
    }

    fn over(
        parts: &[(Primitive, Shape, (Bounds, f64))],
        balls: Bounds,
    ) -> Result<Self, UnionError> {
        if parts.is_empty() {
            return Err(UnionError::Empty);
        }
        let boxes: Vec<_> = parts.iter().map(|&(_, _, bounds)| bounds).collect();
        let sides = boxes.iter().map(|(b, _)| (b.hi - b.lo).max_element());
        let padding = sides.sum::<f64>() / boxes.len() as f64;
        let tree = Tree::build(&boxes, Plan { max_leaf: 2, group: 1, padding });
        let in_order = || tree.order().iter().map(|&part| &parts[part as usize]);
        let shapes = in_order().map(|(_, shape, _)| shape.clone()).collect();
        let primitives = in_order().map(|&(primitive, _, _)| primitive).collect();
        let extent = |(b, radius): &(Bounds, f64)| (b.hi - b.lo).length() + radius;
        let slack = ROUNDING * boxes.iter().map(extent).fold(0.0, f64::max);
        Ok(Self { tree, shapes, primitives, balls, slack })
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

    /// `sigma(p)`, beginning with the primitive that the last call with the same `near` found:
    /// faster for points that follow each other, with the same answer.
    pub(super) fn signed_from(&self, p: Vec3, near: &mut usize) -> f64 {
        let (nearest, place) = self.query::<Signed>(p, *near);
        *near = place;
        nearest.signed
    }

    /// `mu(p)`: the least distance to the surface of a primitive, buried or not.
    pub fn unsigned_nearest(&self, p: Vec3) -> f64 {
        self.nearest_surface(p).signed.abs()
    }

    /// The primitive of least signed distance.
    pub fn deepest(&self, p: Vec3) -> NearestPrimitive {
        self.query::<Signed>(p, 0).0
    }

    /// The primitive whose surface is nearest.
    pub fn nearest_surface(&self, p: Vec3) -> NearestPrimitive {
        self.query::<Unsigned>(p, 0).0
    }

    /// [`signed`](Self::signed) for many points, in their order, in parallel.
    pub fn signed_batch(&self, points: &[Vec3]) -> Vec<f64> {
        in_morton_order(points, |last: &mut usize, p| {
            let (nearest, place) = self.query::<Signed>(p, *last);
            *last = place;
            nearest.signed
        })
    }

    /// [`unsigned_nearest`](Self::unsigned_nearest) for many points, in their order, in parallel.
    pub fn unsigned_nearest_batch(&self, points: &[Vec3]) -> Vec<f64> {
        in_morton_order(points, |last: &mut usize, p| {
            let (nearest, place) = self.query::<Unsigned>(p, *last);
            *last = place;
            nearest.signed.abs()
        })
    }

    /// Both readings for many points, in their order, in parallel: [`signed`](Self::signed) and
    /// [`unsigned_nearest`](Self::unsigned_nearest), in hardly more time than the dearer of the two.
    pub fn readings_batch(&self, points: &[Vec3]) -> Vec<Readings> {
        in_morton_order(points, |last: &mut [usize; 2], p| {
            let (nearest, place) = self.query::<Signed>(p, last[0]);
            last[0] = place;
            let sigma = nearest.signed;
            if sigma >= 0.0 {
                // Outside of all primitives the least distance is the least unsigned one.
                return Readings { sigma, mu: sigma };
            }
            let (nearest, place) = self.query::<Unsigned>(p, last[1]);
            last[1] = place;
            Readings { sigma, mu: nearest.signed.abs() }
        })
    }

    /// [`deepest`](Self::deepest) for many points, in their order, in parallel.
    pub fn deepest_batch(&self, points: &[Vec3]) -> Vec<NearestPrimitive> {
        in_morton_order(points, |last: &mut usize, p| {
            let (nearest, place) = self.query::<Signed>(p, *last);
            *last = place;
            nearest
        })
    }

    /// For many points, in their order, in parallel: [`signed`](Self::signed), and the radius of the
    /// ball on the primitive that attains it.
    pub fn deepest_ball_batch(&self, points: &[Vec3]) -> Vec<(f64, f64)> {
        in_morton_order(points, |last: &mut usize, p| {
            let (nearest, place) = self.query::<Signed>(p, *last);
            *last = place;
            (nearest.signed, self.shapes[place].radius_towards(p))
        })
    }

    /// [`nearest_surface`](Self::nearest_surface) for many points, in their order, in parallel.
    pub fn nearest_surface_batch(&self, points: &[Vec3]) -> Vec<NearestPrimitive> {
        in_morton_order(points, |last: &mut usize, p| {
            let (nearest, place) = self.query::<Unsigned>(p, *last);
            *last = place;
            nearest
        })
    }

    /// Whether some primitive holds `p` more than `depth` below its surface; with a negative depth,
    /// whether one is nearer than that. Ends at the first that is found.
    pub fn buries(&self, p: Vec3, depth: f64) -> bool {
        self.burier(p, depth, None).is_some()
    }

    /// Keeps of some points those that no primitive [`buries`](Self::buries) deeper than `depth`.
    /// Quicker where each point is close to the one before.
    pub fn retain_unburied(&self, points: &mut Vec<Vec3>, depth: f64) {
        let mut last = None;
        points.retain(|&p| {
            let burier = self.burier(p, depth, last);
            last = burier.or(last);
            burier.is_none()
        });
    }

    /// A primitive that holds `p` more than `depth` below its surface, by its place, where one
    /// does; the one at `first` is tried before all others.
    fn burier(&self, p: Vec3, depth: f64, first: Option<usize>) -> Option<usize> {
        if first.is_some_and(|place| self.shapes[place].signed(p) < -depth) {
            return first;
        }
        let mut search = Buried { union: self, p, limit: -depth, place: None };
        self.tree.search(&mut search);
        search.place
    }

    /// Calls `each` for all primitives nearer to `p` than `limit` by signed distance, with that
    /// distance and the centre of the interpolated sphere that attains it. A slab counts where its
    /// nearest sphere is inside the triangle, and is else represented by the cones of its sides.
    pub(crate) fn each_nearer(&self, p: Vec3, limit: f64, each: impl FnMut(f64, Vec3)) {
        self.tree.search(&mut Nearer { union: self, p, limit, each });
    }

    fn query<M: Measure>(&self, p: Vec3, start: usize) -> (NearestPrimitive, usize) {
        let signed = self.shapes[start].signed(p);
        let mut search = Nearest::<M> {
            union: self,
            p,
            place: start,
            signed,
            value: M::value(signed),
            limit: f64::INFINITY,
            measure: std::marker::PhantomData,
        };
        search.tighten();
        self.tree.search(&mut search);
        let primitive = self.primitives[search.place];
        (NearestPrimitive { signed: search.signed, primitive }, search.place)
    }
}

fn ball_box(balls: &[Sphere]) -> Bounds {
    let corners = |m: &Sphere| [-m.radius, m.radius].map(|r| m.centre + Vec3::splat(r));
    Bounds::of_points(balls.iter().flat_map(corners))
}

/// Box around the centres, and the largest radius.
fn bounds(balls: &[Sphere]) -> (Bounds, f64) {
    let largest = balls.iter().fold(0.0, |r, m| f64::max(r, m.radius));
    (Bounds::of_points(balls.iter().map(|m| m.centre)), largest)
}

/// Lower bound of the signed distances to the primitives below a node.
///
/// Every interpolated sphere has its centre in the box of the centres and no larger radius. Boxes
/// around the balls would hardly differ from one sphere of a sheet to the next.
#[inline]
fn signed_bound(node: &Node, p: Vec3) -> f64 {
    node.bounds.distance_squared(p).sqrt() - node.reach
}

/// Lower bound of the depths in the primitives below a node, negative where some may not hold `p`.
///
/// Each primitive holds its largest ball, whose centre is in the box of the centres.
#[inline]
fn depth_bound(node: &Node, p: Vec3) -> f64 {
    node.least_reach - node.bounds.farthest_squared(p).sqrt()
}

/// Which of the two distances is minimised.
trait Measure {
    fn value(signed: f64) -> f64;
    /// A lower bound of the values below a node.
    fn bound(node: &Node, p: Vec3) -> f64;
}

enum Signed {}

impl Measure for Signed {
    fn value(signed: f64) -> f64 {
        signed
    }

    #[inline]
    fn bound(node: &Node, p: Vec3) -> f64 {
        signed_bound(node, p)
    }
}

enum Unsigned {}

impl Measure for Unsigned {
    fn value(signed: f64) -> f64 {
        signed.abs()
    }

    /// Outside all primitives of a node the least signed distance counts, inside all of them the
    /// largest.
    #[inline]
    fn bound(node: &Node, p: Vec3) -> f64 {
        let outside = signed_bound(node, p);
        if outside > 0.0 { outside } else { depth_bound(node, p).max(0.0) }
    }
}

struct Nearest<'a, M> {
    union: &'a MedialUnion,
    p: Vec3,
    place: usize,
    signed: f64,
    value: f64,
    limit: f64,
    measure: std::marker::PhantomData<M>,
}

impl<M: Measure> Nearest<'_, M> {
    /// Sets the limit above the best value by more than both can be rounded.
    #[inline]
    fn tighten(&mut self) {
        self.limit = self.value + self.value.abs() * ROUNDING + self.union.slack;
    }
}

impl<M: Measure> Search for Nearest<'_, M> {
    #[inline]
    fn bound(&self, node: &Node) -> f64 {
        M::bound(node, self.p)
    }

    #[inline]
    fn limit(&self) -> f64 {
        self.limit
    }

    #[inline]
    fn visit(&mut self, places: Range<usize>) {
        let union = self.union;
        for place in places {
            let signed = union.shapes[place].signed(self.p);
            let value = M::value(signed);
            let first =
                value == self.value && union.primitives[place] < union.primitives[self.place];
            if value < self.value || first {
                (self.place, self.signed, self.value) = (place, signed, value);
                self.tighten();
            }
        }
    }
}

/// Search for any primitive that holds the point deeply.
struct Buried<'a> {
    union: &'a MedialUnion,
    p: Vec3,
    /// Minus the depth, and minus infinity once a primitive is found.
    limit: f64,
    place: Option<usize>,
}

impl Search for Buried<'_> {
    #[inline]
    fn bound(&self, node: &Node) -> f64 {
        signed_bound(node, self.p)
    }

    #[inline]
    fn limit(&self) -> f64 {
        self.limit
    }

    #[inline]
    fn visit(&mut self, mut places: Range<usize>) {
        let holds = |&place: &usize| self.union.shapes[place].signed(self.p) < self.limit;
        if let Some(place) = places.find(holds) {
            self.place = Some(place);
            self.limit = f64::NEG_INFINITY;
        }
    }
}

/// Search for all primitives nearer than a limit.
struct Nearer<'a, F> {
    union: &'a MedialUnion,
    p: Vec3,
    limit: f64,
    each: F,
}

impl<F: FnMut(f64, Vec3)> Search for Nearer<'_, F> {
    #[inline]
    fn bound(&self, node: &Node) -> f64 {
        signed_bound(node, self.p)
    }

    #[inline]
    fn limit(&self) -> f64 {
        self.limit + self.union.slack
    }

    #[inline]
    fn visit(&mut self, places: Range<usize>) {
        for place in places {
            if let Some((signed, centre)) = self.union.shapes[place].nearest_centre(self.p)
                && signed < self.limit
            {
                (self.each)(signed, centre);
            }
        }
    }
}
