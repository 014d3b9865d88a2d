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
//! 3. Points are merged along arcs of length zero.
//!
//! Points on two sheets of the boundary that touch in a single point are not joined by arcs and
//! stay apart.

use rayon::prelude::*;

use crate::Vec3;
use crate::disjoint::DisjointSets;
use crate::dual_complex::{Class, DualComplex};
use crate::predicates::{
    Sign, Site, orient3d, tetrahedron_size, triangle_clearance, triangle_size,
};
use crate::triangulation::{CellId, Facet, VertexId};

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
/// let (points, point_of) = boundary.merge();
/// assert_eq!((points.len(), point_of.len()), (2, 4));
/// assert!(points.iter().all(|p| p.distance(Vec3::new(3.0, 4.0, 12.0 * p.z.signum())) < 1e-14));
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
}

impl UnionBoundary {
    /// The vertices in the order of [`DualComplex::triangles`]. Linear in the triangulation.
    pub fn new(complex: &DualComplex<'_>) -> Self {
        let (facets, sides) = facets_with_vertices(complex);
        let regular = complex.regular();
        let found: Vec<_> = facets
            .par_iter()
            .with_min_len(1 << 10)
            .map(|&facet: &Facet| {
                let triangle = regular.facet_vertices(facet);
                let meeting = Meeting::of(triangle.map(|v| regular.site(v)));
                let (position, balls) = (meeting.position(), triangle.map(|v| v.0));
                (UnionVertex { position, balls, facet }, meeting.sine2)
            })
            .collect();
        let (vertices, quality) = found.into_iter().unzip();
        Self { vertices, quality, coincident: coincident(complex, sides) }
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
        let l = a.length_squared() + (sites[0].w - sites[1].w);
        let m = b.length_squared() + (sites[0].w - sites[2].w);
        let z = (l * b.cross(n) + m * n.cross(a)) / (2.0 * nu);
        Self {
            foot: o + z,
            normal: n / nu.sqrt(),
            height2: sites[0].w - z.length_squared(),
            sine2: nu / (a.length_squared() * b.length_squared()),
        }
    }

    fn position(&self) -> Vec3 {
        // Where the spheres touch, rounding can make the squared height negative.
        self.foot + self.height2.max(0.0).sqrt() * self.normal
    }
}

// Step 2: the points that coincide, decided exactly.

/// Pairs of vertices at the ends of arcs of length zero.
///
/// `sides` holds for each facet with a vertex on the side of its cell the index of the vertex.
pub(super) fn coincident(complex: &DualComplex<'_>, mut sides: Vec<(Facet, u32)>) -> Vec<[u32; 2]> {
    let cells = (0..complex.regular().finite_cell_count() as u32).into_par_iter();
    let points: Vec<[Facet; 2]> = cells
        .with_min_len(1 << 10)
        .map_init(Vec::new, |walls: &mut Vec<[Facet; 2]>, cell| {
            let mut points = Vec::new();
            for (edge, _) in complex.edges_of(CellId(cell)).filter(|e| e.1 == Class::Regular) {
                complex.find_walls(edge, walls);
                points.extend(arcs(complex, walls).filter(|&[a, b]| is_point(complex, a, b)));
            }
            points
        })
        .flatten_iter()
        .collect();
    if points.is_empty() {
        return Vec::new();
    }
    sides.sort_unstable();
    let vertex_at = |facet: Facet| {
        let found = sides.binary_search_by_key(&facet, |s| s.0).ok()?;
        Some(sides[found].1)
    };
    let ends = points.into_iter().filter_map(|[a, b]| Some([vertex_at(a)?, vertex_at(b)?]));
    let mut pairs: Vec<[u32; 2]> =
        ends.filter(|[a, b]| a != b).map(|[a, b]| [a.min(b), a.max(b)]).collect();
    pairs.sort_unstable();
    pairs.dedup();
    pairs
}

/// The gaps between two different triangles at an edge, as these triangles seen from the gap.
fn arcs<'a>(
    complex: &'a DualComplex<'_>,
    walls: &'a [[Facet; 2]],
) -> impl Iterator<Item = [Facet; 2]> + 'a {
    let pairs = (0..walls.len()).map(|k| [walls[k][1], walls[(k + 1) % walls.len()][0]]);
    pairs.filter(|[start, _]| walls.len() > 1 && !complex.contains(start.cell))
}

/// Whether the arc of the gap between two triangles, both seen from cells in the gap, is a point.
fn is_point(complex: &DualComplex<'_>, start: Facet, end: Facet) -> bool {
    let regular = complex.regular();
    // Counter-clockwise as seen from the gap.
    let [f, g] = [start, end].map(|side| regular.facet_vertices(regular.mirror(side)));
    let c = f.into_iter().find(|v| !g.contains(v));
    let d = g.into_iter().find(|v| !f.contains(v));
    let (Some(c), Some(d)) = (c, d) else { return false };
    let sites = |t: [VertexId; 3]| t.map(|v| regular.site(v));
    let [s, t, u] = sites(f);
    // For coplanar centres this is zero if and only if the four balls have a point of equal powers,
    // so that the points of both triangles coincide.
    if tetrahedron_size([s, t, u, regular.site(d)]) != Sign::Zero {
        return false;
    }
    // A positive clearance from the fourth ball puts the orthocentre of all four on the fourth's side
    // of the triangle, a clearance of zero in its plane.
    let is_on_gap_side = |triangle: [VertexId; 3], fourth: VertexId| {
        let [p, q, r] = triangle.map(|v| regular.point(v));
        let clearance = triangle_clearance(sites(triangle), regular.site(fourth));
        let side = orient3d(p, q, r, regular.point(fourth));
        clearance == Sign::Zero || side == Sign::Zero || clearance == side
    };
    is_on_gap_side(f, d) && is_on_gap_side(g, c)
}

// Step 3: one point for each group of equal vertices.

impl UnionBoundary {
    /// Merges vertices that are one point exactly, see [`UnionBoundary::coincident`]: the positions of the points in the order
    /// of their first vertices, and for each vertex its point.
    pub fn merge(&self) -> (Vec<Vec3>, Vec<u32>) {
        let mut groups = DisjointSets::singletons(self.vertices.len());
        for &[a, b] in &self.coincident {
            groups.join(a, b);
        }
        let count = self.vertices.len();
        let mut point_of = vec![0; count];
        // The representative of a group is its smallest member, so it is numbered first.
        let mut best: Vec<usize> = Vec::new();
        for i in 0..count {
            let first = groups.find(i as u32) as usize;
            if first == i {
                point_of[i] = best.len() as u32;
                best.push(i);
            } else {
                point_of[i] = point_of[first];
                let best = &mut best[point_of[i] as usize];
                if self.quality[i] > self.quality[*best] {
                    *best = i;
                }
            }
        }
        (best.into_iter().map(|i| self.vertices[i].position).collect(), point_of)
    }
}
