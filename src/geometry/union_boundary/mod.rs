//! The vertices of the boundary of a union of balls: where three spheres meet on it.
//!
//! D. Attali, A. Montanvert: *Computing and simplifying 2D and 3D continuous skeletons*, Computer
//! Vision and Image Understanding 67 (1997), <https://doi.org/10.1006/cviu.1997.0536>; N. Amenta,
//! R. K. Kolluri: *The medial axis of a union of balls*, Computational Geometry 20 (2001),
//! <https://doi.org/10.1016/S0925-7721(01)00033-5>.
//!
//! With the dual complex `K` of the balls:
//!
//! 1. The spheres of a triangle of `K` meet in two points, mirror images across its plane. A regular
//!    triangle gives the point on the side without a tetrahedron of `K`. A singular triangle gives
//!    both, or one if the spheres touch in a point of the plane, which is decided exactly.
//! 2. Around an edge of `K`, the triangles of `K` leave *gaps*, runs of tetrahedra that are not in
//!    `K`. Each gap is dual to one arc of the boundary, on the circle where the edge's spheres
//!    meet; the arc joins the points of the two triangles that bound the gap. The arc has length
//!    zero if and only if both points are one, on four spheres: the orthocentre of the four balls, if
//!    its power is zero and it is on the gap's side of both planes. Exact.
//! 3. Points are merged along arcs of length zero, and by a key of the caller's choice.
//!
//! Points on two sheets of the boundary that touch in a single point are not joined by arcs and
//! stay apart, unless the key joins them.

mod coincidence;
mod merge;

pub use merge::MergedVertices;

use rayon::prelude::*;

use super::dual_complex::{Class, DualComplex};
use super::predicates::{Sign, Site, triangle_size};
use super::triangulation::Facet;
use crate::Vec3;

/// A point where three spheres meet on the boundary of the union.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnionVertex {
    /// Its position, rounded.
    pub position: Vec3,
    /// The three balls, counter-clockwise as seen from its side of their centres' plane.
    pub balls: [u32; 3],
    /// Their triangle, from the cell on the other side.
    pub facet: Facet,
}

/// The vertices of the boundary of a union of balls, each once for every triangle of the dual complex
/// that gives it.
///
/// ```
/// use medial_geometry::{Vec3, DualComplex, Sphere, UnionBoundary};
///
/// let corners = [Vec3::ZERO, Vec3::new(6.0, 0.0, 0.0), Vec3::new(6.0, 8.0, 0.0), Vec3::new(0.0, 8.0, 0.0)];
/// let balls = corners.map(|c| Sphere::new(c, 13.0));
/// let complex = DualComplex::of_balls(&balls)?;
/// let boundary = UnionBoundary::new(&complex);
/// // Two triangles fill the rectangle, each has a point above and one below: four spheres meet there.
/// assert_eq!(boundary.vertices().len(), 4);
/// let merged = boundary.merge(|_| None);
/// assert_eq!(merged.points().len(), 2);
/// assert_eq!(merged.balls(0), [0, 1, 2, 3]);
/// assert!(merged.points().iter().all(|p| p.distance(Vec3::new(3.0, 4.0, 12.0 * p.z.signum())) < 1e-14));
/// # Ok::<(), medial_geometry::TriangulationError>(())
/// ```
#[derive(Clone, Debug)]
pub struct UnionBoundary {
    vertices: Vec<UnionVertex>,
    /// The squared sine of each triangle's angle at its first vertex: the larger, the better the point
    /// is determined.
    quality: Vec<f64>,
    /// Pairs of vertices that are one point.
    coincident: Vec<[u32; 2]>,
    clamped: usize,
}

impl UnionBoundary {
    /// The vertices in the order of [`DualComplex::triangles`]. Linear in the triangulation.
    pub fn new(complex: &DualComplex<'_>) -> Self {
        let (facets, sides) = facets_with_vertices(complex);
        let regular = complex.regular();
        let meet = |&facet: &Facet| {
            let triangle = regular.facet_vertices(facet);
            let meeting = Meeting::of(triangle.map(|v| regular.site(v)));
            let (position, balls) = (meeting.position(), triangle.map(|v| v.0));
            (UnionVertex { position, balls, facet }, meeting.sine2, meeting.height2 < 0.0)
        };
        let found: Vec<_> = facets.par_iter().with_min_len(1 << 10).map(meet).collect();
        Self {
            vertices: found.iter().map(|f| f.0).collect(),
            quality: found.iter().map(|f| f.1).collect(),
            coincident: coincidence::coincident(complex, sides),
            clamped: found.iter().filter(|f| f.2).count(),
        }
    }

    /// The vertices; those of one triangle follow each other.
    #[inline]
    pub fn vertices(&self) -> &[UnionVertex] {
        &self.vertices
    }

    /// Pairs of vertices that are one point, exactly; enough of them to connect all vertices that
    /// arcs of length zero join.
    #[inline]
    pub fn coincident(&self) -> &[[u32; 2]] {
        &self.coincident
    }

    /// How many vertices have a squared height above their triangle's plane that rounding made
    /// negative; it is zero then.
    #[inline]
    pub fn clamped(&self) -> usize {
        self.clamped
    }
}

/// Step 1: the triangles' sides with a vertex, as the facets of the cells on the other side; and
/// for each facet that has a vertex on the side of its own cell the index of that vertex.
fn facets_with_vertices(complex: &DualComplex<'_>) -> (Vec<Facet>, Vec<(Facet, u32)>) {
    let regular = complex.regular();
    let (mut facets, mut sides) = (Vec::new(), Vec::new());
    for (facet, class) in complex.triangles() {
        let mirror = regular.mirror(facet);
        let mut push = |inner: Facet, outer: Facet| {
            sides.push((outer, facets.len() as u32));
            facets.push(inner);
        };
        match class {
            Class::Interior => {}
            Class::Regular if complex.contains(facet.cell) => push(facet, mirror),
            Class::Regular => push(mirror, facet),
            Class::Singular => {
                push(mirror, facet);
                let sites = regular.facet_vertices(facet).map(|v| regular.site(v));
                if triangle_size(sites) == Sign::Zero {
                    // The spheres touch in a point of the plane: one vertex for both sides.
                    sides.push((mirror, facets.len() as u32 - 1));
                } else {
                    push(facet, mirror);
                }
            }
        }
    }
    (facets, sides)
}

/// Three spheres and where they meet.
struct Meeting {
    foot: Vec3,
    normal: Vec3,
    height2: f64,
    sine2: f64,
}

impl Meeting {
    /// Relative to the smallest of the balls, which is nearest to the points: with the dual basis
    /// `n x b / nu`, `a x n / nu` of the edges `a, b` and `n = a x b`, the foot of the points is at
    /// `l_1 (b x n) / 2 nu + l_2 (n x a) / 2 nu`, and their squared height `w_0` minus its square.
    fn of(mut sites: [&Site; 3]) -> Self {
        let smallest = (0..3).min_by(|&i, &j| sites[i].w.total_cmp(&sites[j].w)).unwrap_or(0);
        sites.rotate_left(smallest);
        let [o, p, q] = sites.map(|s| Vec3::from_array(s.p));
        let (a, b) = (p - o, q - o);
        let n = a.cross(b);
        let nu = n.length_squared();
        let lift = |d: Vec3, s: &Site| d.length_squared() + (sites[0].w - s.w);
        let (l, m) = (lift(a, sites[1]), lift(b, sites[2]));
        let z = (l * b.cross(n) + m * n.cross(a)) / (2.0 * nu);
        Self {
            foot: o + z,
            normal: n / nu.sqrt(),
            height2: sites[0].w - z.length_squared(),
            sine2: nu / (a.length_squared() * b.length_squared()),
        }
    }

    fn position(&self) -> Vec3 {
        self.foot + self.height2.max(0.0).sqrt() * self.normal
    }
}
