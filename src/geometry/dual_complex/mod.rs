//! The dual complex of a union of balls.
//!
//! * H. Edelsbrunner: *The union of balls and its dual shape*, Discrete & Computational Geometry 13
//!   (1995), <https://doi.org/10.1007/BF02574053>.
//! * H. Edelsbrunner, E. P. Muecke: *Three-dimensional alpha shapes*, ACM Transactions on Graphics
//!   13 (1994), <https://doi.org/10.1145/174462.156635>.
//!
//! The dual complex `K` of a union `U` of balls consists of the simplices of the regular
//! triangulation whose dual power faces meet `U`: the alpha complex for alpha zero. It is homotopy
//! equivalent to `U`.
//!
//! 1. A tetrahedron is in `K` if and only if its orthoball's power `rho^2` is at most zero.
//! 2. A triangle with a coface in `K` is in `K`. Any other is in `K` if and only if `rho^2 <= 0` at
//!    its own orthocentre `o`, and it is *Gabriel*: `|o - v|^2 - w_v >= rho^2` for both opposite
//!    vertices `v`.
//! 3. Edges and then vertices by the same rule, with all vertices of their links.
//! 4. A simplex of `K` is *interior* if all tetrahedra around it are finite and in `K`, *singular* if
//!    it has no coface in `K`, and *regular* otherwise.
//!
//! All signs are exact ([`super::predicates`]). Rule 2 is that of alpha shapes: if a coface is in
//! `K`, so is the triangle, because the minimum of the power over a power face is at most the minimum
//! over a part of its boundary. For a Gabriel triangle its own `rho^2` decides.
//!
//! The rules hold even where signs are zero, although the triangulation belongs to infinitesimally
//! perturbed weights. Power faces depend continuously on the weights, so the rules decide whether the
//! limit of a face, a closed polytope, meets the closed set `U`. So `K` is closed under faces for
//! every input, and it has the homotopy type of `U`, which is that of slightly larger balls. The
//! perturbation decides which of several cospherical simplices belong to `K`.
//!
//! In short: balls are closed. Two balls that touch in a point are joined by an edge; four balls that
//! close a hole in a point fill it.

mod balls;
mod build;
mod check;
mod topology;

pub use check::DualViolation;
pub use topology::Simplices;

use std::borrow::Cow;

use super::triangulation::{CellId, Facet, VertexId};
use super::{Regular, Sphere, TriangulationError};

/// How a simplex of the dual complex lies in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum Class {
    /// It has no coface in the complex.
    Singular = 1,
    /// It has a coface, but not all tetrahedra around it are in the complex.
    Regular = 2,
    /// All tetrahedra around it are in the complex. A tetrahedron is always interior.
    Interior = 3,
}

impl Class {
    #[inline]
    const fn of_bits(bits: u16) -> Option<Self> {
        match bits & 3 {
            0 => None,
            1 => Some(Self::Singular),
            2 => Some(Self::Regular),
            _ => Some(Self::Interior),
        }
    }
}

/// The pairs of vertices of a cell, in the order in which their edges are stored.
const PAIRS: [(usize, usize); 6] = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];

/// An edge as a cell and the indices of its vertices there, see
/// [`Triangulation::finite_edges`](super::triangulation::Triangulation::finite_edges).
pub type CellEdge = (CellId, usize, usize);

/// The dual complex of a union of balls, as the classes of the simplices of their regular
/// triangulation.
///
/// Deterministic; linear in the size of the triangulation, whose memory it extends by 4 bytes for
/// each cell and one for each ball.
///
/// ```
/// use medial_geometry::{Vec3, DualComplex, Sphere};
///
/// // A ring of six balls, each of which meets the next two.
/// let ring: Vec<Sphere> = (0..6)
///     .map(|k| f64::from(k) * std::f64::consts::TAU / 6.0)
///     .map(|t| Sphere::new(Vec3::new(t.cos(), t.sin(), 0.0), 0.6))
///     .collect();
/// let complex = DualComplex::of_balls(&ring)?;
/// assert_eq!(complex.counts(), [6, 6, 0, 0]);
/// assert_eq!(complex.betti(), [1, 1, 0]);
/// # Ok::<(), medial_geometry::TriangulationError>(())
/// ```
///
/// # Other values of alpha
/// The alpha complex for `alpha`, a squared length, is the dual complex of the balls with the
/// squared radii `r^2 + alpha`: a larger weight of all points changes no cell of the regular
/// triangulation. Pass radii `sqrt(r^2 + alpha)` to [`DualComplex::of_balls`], or these weights,
/// which may be negative, to [`Regular::new`], and the result to [`DualComplex::new`].
///
/// ```
/// use medial_geometry::{DualComplex, Regular, Vec3};
///
/// // The alpha shapes of the corners of a cube.
/// let corners: Vec<Vec3> = (0..8u32)
///     .map(|k| Vec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2)))
///     .collect();
/// let betti = |alpha: f64| -> Result<_, medial_geometry::TriangulationError> {
///     Ok(DualComplex::new(&Regular::new(&corners, &[alpha; 8])?).betti())
/// };
/// assert_eq!(betti(-0.01)?, [0, 0, 0]); // empty
/// assert_eq!(betti(0.0)?, [8, 0, 0]); // points
/// assert_eq!(betti(0.25)?, [1, 5, 0]); // edges
/// assert_eq!(betti(0.5)?, [1, 0, 1]); // squares
/// assert_eq!(betti(0.75)?, [1, 0, 0]); // the cube
/// # Ok::<(), medial_geometry::TriangulationError>(())
/// ```
#[derive(Clone, Debug)]
pub struct DualComplex<'r> {
    regular: Cow<'r, Regular>,
    /// Points from this one on are anchors, not balls.
    balls: usize,
    /// For each finite cell whether it is in the complex.
    cells: Vec<bool>,
    /// For each cell, infinite ones included, two bits for each facet.
    facets: Vec<u8>,
    /// For each finite cell two bits for each edge that it is the first cell of.
    edges: Vec<u16>,
    /// For each point its class, zero if it is not in the complex.
    vertices: Vec<u8>,
}

impl<'r> DualComplex<'r> {
    /// The dual complex of the balls whose centres and squared radii `regular` triangulates.
    ///
    /// Points of negative weight are empty balls, and those of weight zero are points.
    pub fn new(regular: &'r Regular) -> Self {
        build::build(Cow::Borrowed(regular), regular.point_count())
    }
}

impl DualComplex<'static> {
    /// The dual complex of balls, in any number and position: none at all, one, two, balls on a line
    /// or in a plane.
    ///
    /// Weights are the squared radii in double precision, rounded once; everything after that is
    /// exact. If the centres do not span space, the regular triangulation gets four *anchors*, points
    /// of negative weight, as its last points. They change nothing: inside a ball its power is at most
    /// zero, while that of an anchor is positive, so no anchor's cell meets the union.
    ///
    /// # Errors
    /// A centre that is not finite or too large, a radius that is negative or not finite, as in
    /// [`Regular::new`].
    pub fn of_balls(balls: &[Sphere]) -> Result<Self, TriangulationError> {
        let regular = balls::triangulated(balls)?;
        Ok(build::build(Cow::Owned(regular), balls.len()))
    }
}

impl DualComplex<'_> {
    /// The regular triangulation.
    #[inline]
    pub fn regular(&self) -> &Regular {
        &self.regular
    }

    /// The number of balls, hidden ones included; points of the triangulation from this index on are
    /// anchors.
    #[inline]
    pub fn ball_count(&self) -> usize {
        self.balls
    }

    /// Whether a cell is in the complex; never an infinite one.
    #[inline]
    pub fn contains(&self, cell: CellId) -> bool {
        self.cells.get(cell.index()).is_some_and(|&c| c)
    }

    /// The class of a triangle, from either side; `None` if it is not in the complex.
    #[inline]
    pub fn facet_class(&self, facet: Facet) -> Option<Class> {
        Class::of_bits(u16::from(self.facets[facet.cell.index()]) >> (2 * facet.opposite))
    }

    /// The class of the edge between two vertices of a cell; `None` if it is not in the complex.
    ///
    /// Costs a turn around the edge.
    ///
    /// # Panics
    /// If `i` equals `j` or one of them exceeds 3.
    pub fn edge_class(&self, (cell, i, j): CellEdge) -> Option<Class> {
        let ends = [i, j].map(|k| self.regular.vertices(cell)[k]);
        if ends.contains(&VertexId::INFINITE) {
            return None;
        }
        let first = self.regular.edge_ring(cell, i, j).min().unwrap_or(cell);
        let vertices = self.regular.vertices(first);
        let pair = PAIRS.iter().position(|&(i, j)| {
            [vertices[i], vertices[j]] == ends || [vertices[j], vertices[i]] == ends
        })?;
        Class::of_bits(self.edges[first.index()] >> (2 * pair))
    }

    /// The class of a ball as a vertex; `None` if it is hidden, or visible but not in the complex.
    ///
    /// # Panics
    /// If there is no such point.
    #[inline]
    pub fn vertex_class(&self, vertex: VertexId) -> Option<Class> {
        Class::of_bits(u16::from(self.vertices[vertex.index()]))
    }

    /// The tetrahedra, by ascending cell.
    pub fn tetrahedra(&self) -> impl Iterator<Item = CellId> + '_ {
        self.regular.finite_cells().filter(|&c| self.contains(c))
    }

    /// The triangles, each once, from the cell with the smaller id, in the order of
    /// [`finite_facets`](super::triangulation::Triangulation::finite_facets).
    pub fn triangles(&self) -> impl Iterator<Item = (Facet, Class)> + '_ {
        let facets = self.regular.finite_cells().filter(|c| self.facets[c.index()] != 0);
        let facets = facets.flat_map(|cell| (0..4).map(move |opposite| Facet { cell, opposite }));
        facets.filter_map(|f| {
            let class = self.facet_class(f)?;
            (self.regular.mirror(f).cell > f.cell).then_some((f, class))
        })
    }

    /// The edges, each once, from the cell with the smallest id around it, in the order of
    /// [`finite_edges`](super::triangulation::Triangulation::finite_edges) but without its cost.
    pub fn edges(&self) -> impl Iterator<Item = (CellEdge, Class)> + '_ {
        self.regular.finite_cells().flat_map(|cell| self.edges_of(cell))
    }

    /// The edges whose first cell is this finite cell.
    pub(super) fn edges_of(&self, cell: CellId) -> impl Iterator<Item = (CellEdge, Class)> + '_ {
        let bits = self.edges[cell.index()];
        // Most cells are the first of no edge.
        let pairs = PAIRS.into_iter().enumerate().take(if bits == 0 { 0 } else { PAIRS.len() });
        pairs.filter_map(move |(k, (i, j))| Some(((cell, i, j), Class::of_bits(bits >> (2 * k))?)))
    }

    /// The vertices, ascending.
    pub fn vertices(&self) -> impl Iterator<Item = (VertexId, Class)> + '_ {
        let ids = (0..self.vertices.len() as u32).map(VertexId);
        ids.filter_map(|v| Some((v, self.vertex_class(v)?)))
    }

    /// The balls at the ends of an edge.
    pub fn edge_vertices(&self, (cell, i, j): CellEdge) -> [VertexId; 2] {
        let v = self.regular.vertices(cell);
        [v[i], v[j]]
    }
}
