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

use std::borrow::Cow;

use rayon::prelude::*;

use crate::disjoint::DisjointSets;
use crate::predicates::{
    MAX_COORDINATE, Sign, Site, edge_clearance, edge_size, tetrahedron_size, triangle_clearance,
    triangle_size, vertex_clearance,
};
use crate::triangulation::{CellId, Facet, VertexId};
use crate::{Regular, Sphere, TriangulationError, Vec3};

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
/// [`Triangulation::finite_edges`](crate::triangulation::Triangulation::finite_edges).
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
        build(Cow::Borrowed(regular), regular.point_count())
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
        let regular = triangulated(balls)?;
        Ok(build(Cow::Owned(regular), balls.len()))
    }
}

impl DualComplex<'_> {
    /// The regular triangulation.
    #[inline]
    pub fn regular(&self) -> &Regular {
        &self.regular
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

    /// The triangles, each once, from the cell with the smaller id, by ascending facet of that cell.
    pub fn triangles(&self) -> impl Iterator<Item = (Facet, Class)> + '_ {
        let facets = self.regular.finite_cells().filter(|c| self.facets[c.index()] != 0);
        let facets = facets.flat_map(|cell| (0..4).map(move |opposite| Facet { cell, opposite }));
        facets.filter_map(|f| {
            let class = self.facet_class(f)?;
            (self.regular.mirror(f).cell > f.cell).then_some((f, class))
        })
    }

    /// The edges, each once, from the cell with the smallest id around it, in the order of
    /// [`finite_edges`](crate::triangulation::Triangulation::finite_edges) but without its cost.
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

    /// The triangles of the complex at an edge, in rotational order, each as seen from the cells before
    /// and after it. They replace `walls`, a buffer that many edges share.
    pub fn find_walls(&self, (cell, i, j): CellEdge, walls: &mut Vec<[Facet; 2]>) {
        walls.clear();
        let ends = self.edge_vertices((cell, i, j));
        let ring: Vec<CellId> = self.regular.edge_ring(cell, i, j).collect();
        // A wall is between two consecutive cells of the ring, the last and the first included.
        for (k, &cell) in ring.iter().enumerate() {
            let next = ring[(k + 1) % ring.len()];
            let (v, neighbours) = (self.regular.vertices(cell), self.regular.neighbours(cell));
            let leads_on =
                |&opposite: &usize| !ends.contains(&v[opposite]) && neighbours[opposite] == next;
            let Some(opposite) = (0..4).find(leads_on) else { continue };
            let before = Facet { cell, opposite };
            if self.facet_class(before).is_some() {
                walls.push([before, self.regular.mirror(before)]);
            }
        }
    }

    /// The balls at the ends of an edge.
    pub fn edge_vertices(&self, (cell, i, j): CellEdge) -> [VertexId; 2] {
        let v = self.regular.vertices(cell);
        [v[i], v[j]]
    }
}

// Steps 1 to 4: the classes of all simplices.

/// The fewest cells handed to a thread at once.
const GRAIN: usize = 1 << 10;

/// Classifies the simplices of a triangulation of `balls` balls and anchors.
pub(super) fn build(regular: Cow<'_, Regular>, balls: usize) -> DualComplex<'_> {
    let cells = tetrahedra(&regular);
    let facets = triangles(&regular, &cells);
    let edges = edges(&regular, &cells, &facets);
    let vertices = vertices(&regular, &cells, &edges);
    DualComplex { regular, balls, cells, facets, edges, vertices }
}

/// The sites of the finite ones among vertices.
fn sites<const N: usize>(regular: &Regular, v: [VertexId; N]) -> [&Site; N] {
    v.map(|v| regular.site(v))
}

/// Step 1: for each finite cell whether it is in the complex.
fn tetrahedra(regular: &Regular) -> Vec<bool> {
    let cells = (0..regular.finite_cell_count() as u32).into_par_iter().with_min_len(GRAIN);
    cells
        .map(|c| tetrahedron_size(sites(regular, regular.vertices(CellId(c)))) != Sign::Positive)
        .collect()
}

/// Whether a cell is in the complex; infinite cells are not, and come after the finite ones.
#[inline]
fn is_member(cells: &[bool], cell: CellId) -> bool {
    cells.get(cell.index()).is_some_and(|&is_in| is_in)
}

/// Step 2: two bits for each facet of each cell, the same from both sides.
fn triangles(regular: &Regular, cells: &[bool]) -> Vec<u8> {
    // Computed once, at the cell with the smaller id, then copied to the other.
    let ids = (0..regular.cell_count() as u32).into_par_iter().with_min_len(GRAIN);
    let own: Vec<u8> = ids
        .clone()
        .map(|c: u32| {
            let cell = CellId(c);
            let facets = (0..4).map(|opposite| Facet { cell, opposite });
            facets.fold(0, |bits, facet| {
                let mirror = regular.mirror(facet);
                if mirror.cell < cell || regular.is_infinite(cell) {
                    return bits;
                }
                let class = match (is_member(cells, cell), is_member(cells, mirror.cell)) {
                    (true, true) => Class::Interior as u8,
                    (false, false) => u8::from(is_singular_triangle(regular, facet, mirror)),
                    _ => Class::Regular as u8,
                };
                bits | class << (2 * facet.opposite)
            })
        })
        .collect();
    ids.map(|c: u32| {
        let cell = CellId(c);
        let facets = (0..4).map(|opposite| Facet { cell, opposite });
        facets.fold(own[cell.index()], |bits, facet| {
            let mirror = regular.mirror(facet);
            let seen = own[mirror.cell.index()] >> (2 * mirror.opposite) & 3;
            bits | seen << (2 * facet.opposite)
        })
    })
    .collect()
}

/// Whether a triangle without cofaces in the complex is in it.
fn is_singular_triangle(regular: &Regular, facet: Facet, mirror: Facet) -> bool {
    let triangle = sites(regular, regular.facet_vertices(facet));
    triangle_size(triangle) != Sign::Positive
        && [facet, mirror].into_iter().all(|f| {
            let v = regular.vertices(f.cell)[f.opposite];
            v == VertexId::INFINITE
                || triangle_clearance(triangle, regular.site(v)) != Sign::Negative
        })
}

/// Indexed by the set of vertices across whose opposite facets lie later cells: the pairs, as bits,
/// whose edge has later cells on both sides.
const FIRST_AT: [u8; 16] = {
    let mut table = [0; 16];
    let mut later = 0;
    while later < 16 {
        let mut k = 0;
        while k < 6 {
            let others = 15 & !(1 << PAIRS[k].0 | 1 << PAIRS[k].1);
            if later & others == others {
                table[later] |= 1 << k;
            }
            k += 1;
        }
        later += 1;
    }
    table
};

/// Step 3 for edges: two bits for each edge of each finite cell that is its first.
fn edges(regular: &Regular, cells: &[bool], facets: &[u8]) -> Vec<u16> {
    let ids = (0..regular.finite_cell_count() as u32).into_par_iter().with_min_len(GRAIN);
    ids.map_init(Vec::new, |ring: &mut Vec<CellId>, c: u32| {
        let cell = CellId(c);
        let v = regular.vertices(cell);
        // Two neighbours of the cell are at the edge. They are in the cell's own record and show, for
        // two thirds of the edges, that the cell is not the first. The table spares a branch per edge.
        let neighbours = regular.neighbours(cell);
        let later = (0..4).fold(0, |bits, n| bits | usize::from(neighbours[n] > cell) << n);
        let mut candidates = FIRST_AT[later];
        let mut bits = 0;
        while candidates != 0 {
            let k = candidates.trailing_zeros() as usize;
            candidates &= candidates - 1;
            let (i, j) = PAIRS[k];
            ring.clear();
            let is_first = regular.edge_ring(cell, i, j).all(|other| {
                ring.push(other);
                other >= cell
            });
            if is_first {
                let class = edge_class(regular, cells, facets, [v[i], v[j]], ring);
                bits |= u16::from(class) << (2 * k);
            }
        }
        bits
    })
    .collect()
}

/// The class of the edge with these cells around it, zero if it is not in the complex.
fn edge_class(
    regular: &Regular,
    cells: &[bool],
    facets: &[u8],
    ends: [VertexId; 2],
    ring: &[CellId],
) -> u8 {
    let members = ring.iter().filter(|c| is_member(cells, **c)).count();
    if members == ring.len() {
        return Class::Interior as u8;
    }
    if members > 0 {
        return Class::Regular as u8;
    }
    // The cell's two vertices off the edge: the facets opposite to them contain the edge.
    let others = |cell: CellId| {
        let v = regular.vertices(cell);
        (0..4).filter(move |&k| !ends.contains(&v[k])).map(move |k| (k, v[k]))
    };
    if ring.iter().any(|&c: &CellId| {
        facets[c.index()] != 0 && others(c).any(|(k, _)| facets[c.index()] >> (2 * k) & 3 != 0)
    }) {
        return Class::Regular as u8;
    }
    let edge = sites(regular, ends);
    let is_clear = |v: VertexId| {
        v == VertexId::INFINITE || edge_clearance(edge, regular.site(v)) != Sign::Negative
    };
    let is_in = edge_size(edge) != Sign::Positive
        && ring.iter().all(|&c| others(c).all(|(_, v)| is_clear(v)));
    if is_in { Class::Singular as u8 } else { 0 }
}

/// Step 3 for vertices: the class of each point, zero if it is not in the complex.
fn vertices(regular: &Regular, cells: &[bool], edges: &[u16]) -> Vec<u8> {
    let mut class = vec![0; regular.point_count()];
    for (c, &bits) in edges.iter().enumerate().filter(|e| *e.1 != 0) {
        let v = regular.vertices(CellId(c as u32));
        for (k, (i, j)) in PAIRS.into_iter().enumerate() {
            if bits >> (2 * k) & 3 != 0 {
                class[v[i].index()] = Class::Interior as u8;
                class[v[j].index()] = Class::Interior as u8;
            }
        }
    }
    for cell in regular.cells().filter(|c| !is_member(cells, *c)) {
        for v in regular.vertices(cell).into_iter().filter(|&v| v != VertexId::INFINITE) {
            let class = &mut class[v.index()];
            // The minimum keeps 0, for points outside of the complex.
            *class = (*class).min(Class::Regular as u8);
        }
    }
    let isolated: Vec<bool> = (0..class.len())
        .map(|v: usize| {
            let id = VertexId(v as u32);
            class[v] == 0 && regular.is_vertex(id) && regular.site(id).w >= 0.0
        })
        .collect();
    if isolated.contains(&true) {
        let mut clear = isolated;
        for v in attached(regular, &clear) {
            clear[v as usize] = false;
        }
        for (class, _) in class.iter_mut().zip(clear).filter(|(_, clear)| *clear) {
            *class = Class::Singular as u8;
        }
    }
    class
}

/// The given vertices that are attached to a neighbour, in unspecified order, with repetitions.
fn attached(regular: &Regular, isolated: &[bool]) -> Vec<u32> {
    let cells = (0..regular.finite_cell_count() as u32).into_par_iter().with_min_len(GRAIN);
    cells
        .flat_map_iter(|c| {
            let v = regular.vertices(CellId(c));
            let pairs = PAIRS.into_iter().flat_map(|(i, j)| [(i, j), (j, i)]);
            pairs.filter_map(move |(i, j)| {
                let negative = isolated[v[i].index()]
                    && vertex_clearance(regular.site(v[i]), regular.site(v[j])) == Sign::Negative;
                negative.then_some(v[i].0)
            })
        })
        .collect()
}

// Regular triangulations of balls whose centres need not span space.

/// The centres and squared radii of balls, the points and weights of their regular triangulation.
///
/// # Errors
/// A radius that is negative or not finite.
pub(super) fn weighted<'b>(
    balls: impl IntoIterator<Item = &'b Sphere>,
) -> Result<(Vec<Vec3>, Vec<f64>), TriangulationError> {
    let balls = balls.into_iter().enumerate();
    let pairs = balls.map(|(index, &Sphere { centre, radius })| match radius {
        0.0..f64::INFINITY => Ok((centre, radius * radius)),
        _ => Err(TriangulationError::Radius { index, radius }),
    });
    pairs.collect()
}

/// Triangulates balls with their squared radii as weights, with four anchors after them if that
/// is needed to span space.
fn triangulated(balls: &[Sphere]) -> Result<Regular, TriangulationError> {
    let (mut points, mut weights) = weighted(balls)?;
    match Regular::new(&points, &weights) {
        Err(error) if error.is_flat() => {}
        result => return result,
    }
    let (anchors, weight) = anchors(&points);
    points.extend(anchors);
    weights.extend([weight; 4]);
    Regular::new(&points, &weights)
}

/// Four points that span space, the first of them at the first centre, and their weight.
///
/// Any positions and any negative weight are right. The step between them is a power of two about
/// as long as the centres' extent, so that numbers stay short, and goes towards the origin, so that
/// none is out of range.
fn anchors(centres: &[Vec3]) -> ([Vec3; 4], f64) {
    let origin = centres.first().copied().unwrap_or(Vec3::ZERO);
    let extent = centres.iter().map(|c| (*c - origin).abs().max_element()).fold(0.0, f64::max);
    // At least a hundred times the spacing of doubles at the origin.
    let least = (origin.abs().max_element() * 1e-13).max(1e-30);
    let length = (extent / 2.0).clamp(least, MAX_COORDINATE);
    let step = f64::powi(2.0, length.log2().floor() as i32);
    let [x, y, z] = [0, 1, 2].map(|k| {
        let mut anchor = origin;
        anchor[k] -= if anchor[k] < 0.0 { -step } else { step };
        anchor
    });
    ([origin, x, y, z], -step * step)
}

// The topology of the dual complex: simplices, Euler number, Betti numbers.
//
// C. J. A. Delfinado, H. Edelsbrunner: *An incremental algorithm for Betti numbers of simplicial
// complexes on the 3-sphere*, Computer Aided Geometric Design 12 (1995),
// <https://doi.org/10.1016/0167-8396(95)00016-Y>: by Alexander duality a complex in the 3-sphere has
// one void less than its complement has components.

impl DualComplex<'_> {
    /// The numbers of vertices, edges, triangles and tetrahedra.
    pub fn counts(&self) -> [usize; 4] {
        [
            self.vertices().count(),
            self.edges().count(),
            self.triangles().count(),
            self.tetrahedra().count(),
        ]
    }

    /// The Euler number of the complex, and so of the union of balls.
    pub fn euler(&self) -> i64 {
        let [v, e, f, t] = self.counts().map(|n| n as i64);
        v - e + f - t
    }

    /// The Betti numbers of the complex, and so of the union of balls: components, tunnels, voids.
    /// Nearly linear.
    pub fn betti(&self) -> [u64; 3] {
        let [vertices, ..] = self.counts();
        if vertices == 0 {
            return [0; 3];
        }
        // Edges suffice: triangles and tetrahedra join no more than their edges do.
        let mut components = DisjointSets::singletons(self.vertices.len());
        for (edge, _) in self.edges() {
            let [a, b] = self.edge_vertices(edge);
            components.join(a.0, b.0);
        }
        // Points that are not in the complex are singletons among the sets.
        let b0 = components.len() - (self.vertices.len() - vertices);
        let b2 = self.complement_components() - 1;
        // The Euler number is b0 - b1 + b2.
        let b1 = b0 as i64 + b2 as i64 - self.euler();
        [b0 as u64, u64::try_from(b1).expect("a closed complex"), b2 as u64]
    }

    /// The number of components of the complement in the 3-sphere.
    fn complement_components(&self) -> usize {
        let regular = self.regular();
        let mut sets = DisjointSets::singletons(regular.cell_count());
        for cell in regular.cells().filter(|&c| !self.contains(c)) {
            for opposite in 0..4 {
                let facet = Facet { cell, opposite };
                let other = regular.mirror(facet).cell;
                // Facets with the vertex at infinity have no class.
                if other > cell && self.facet_class(facet).is_none() {
                    sets.join(cell.0, other.0);
                }
            }
        }
        sets.len() - self.tetrahedra().count()
    }
}

// Verification: closure under faces, and classes against cofaces.

/// The first violation that [`DualComplex::check`] met.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[expect(missing_docs, reason = "the messages name the fields")]
pub enum DualViolation {
    /// A simplex is in the complex and one of its faces is not.
    #[error("{simplex:?} is in the complex but its face {face:?} is not")]
    Open { simplex: Vec<VertexId>, face: Vec<VertexId> },
    /// The class of a simplex contradicts its cofaces.
    #[error("{simplex:?} is recorded as {found:?}, its cofaces make it {expected:?}")]
    Class { simplex: Vec<VertexId>, found: Option<Class>, expected: Option<Class> },
    /// An anchor, or a point that is no vertex, is in the complex.
    #[error("{vertex:?} is in the complex but no visible ball")]
    Vertex { vertex: VertexId },
}

/// The class that follows from the cofaces; `singular` is that of a simplex without any.
fn follows(all_cells: bool, any_coface: bool, singular: Option<Class>) -> Option<Class> {
    match (all_cells, any_coface) {
        (true, _) => Some(Class::Interior),
        (_, true) => Some(Class::Regular),
        _ => singular,
    }
}

impl DualComplex<'_> {
    /// Checks that the complex is closed under faces, and that each class agrees with the cofaces.
    ///
    /// # Errors
    /// The first violation found.
    pub fn check(&self) -> Result<(), DualViolation> {
        for cell in self.regular.finite_cells() {
            for opposite in 0..4 {
                self.check_triangle(Facet { cell, opposite })?;
            }
        }
        for edge in self.regular.finite_edges() {
            self.check_edge(edge)?;
        }
        self.check_vertices()
    }

    fn check_class(
        simplex: &[VertexId],
        found: Option<Class>,
        all_cells: bool,
        any_coface: bool,
    ) -> Result<(), DualViolation> {
        let singular = found.filter(|&c| c == Class::Singular);
        let expected = follows(all_cells, any_coface, singular);
        if found == expected {
            return Ok(());
        }
        Err(DualViolation::Class { simplex: simplex.to_vec(), found, expected })
    }

    /// The triangle's class from both sides, and its edges.
    fn check_triangle(&self, facet: Facet) -> Result<(), DualViolation> {
        let mirror = self.regular.mirror(facet);
        let simplex = self.regular.facet_vertices(facet);
        let found = self.facet_class(facet);
        if found != self.facet_class(mirror) {
            let (simplex, expected) = (simplex.to_vec(), self.facet_class(mirror));
            return Err(DualViolation::Class { simplex, found, expected });
        }
        let (a, b) = (self.contains(facet.cell), self.contains(mirror.cell));
        Self::check_class(&simplex, found, a && b, a || b)?;
        for (i, j) in PAIRS.into_iter().filter(|&(i, j)| i != facet.opposite && j != facet.opposite)
        {
            let edge = (facet.cell, i, j);
            if found.is_some() && self.edge_class(edge).is_none() {
                let face = self.edge_vertices(edge).to_vec();
                return Err(DualViolation::Open { simplex: simplex.to_vec(), face });
            }
        }
        Ok(())
    }

    fn check_edge(&self, edge: CellEdge) -> Result<(), DualViolation> {
        let simplex = self.edge_vertices(edge);
        let ring: Vec<CellId> = self.regular.edge_ring(edge.0, edge.1, edge.2).collect();
        let all_cells = ring.iter().all(|&c| self.contains(c));
        let any_triangle = ring.iter().any(|&cell| {
            let v = self.regular.vertices(cell);
            (0..4).any(|opposite| {
                !simplex.contains(&v[opposite])
                    && self.facet_class(Facet { cell, opposite }).is_some()
            })
        });
        let found = self.edge_class(edge);
        Self::check_class(&simplex, found, all_cells, any_triangle)?;
        for v in simplex {
            if found.is_some() && self.vertex_class(v).is_none() {
                let (simplex, face) = (simplex.to_vec(), vec![v]);
                return Err(DualViolation::Open { simplex, face });
            }
        }
        Ok(())
    }

    fn check_vertices(&self) -> Result<(), DualViolation> {
        let points = self.regular.point_count();
        let (mut all_cells, mut any_edge) = (vec![true; points], vec![false; points]);
        for cell in self.regular.cells().filter(|&c| !self.contains(c)) {
            for v in self.regular.vertices(cell) {
                if v != VertexId::INFINITE {
                    all_cells[v.index()] = false;
                }
            }
        }
        for (edge, _) in self.edges() {
            for v in self.edge_vertices(edge) {
                any_edge[v.index()] = true;
            }
        }
        for v in 0..points {
            let vertex = VertexId(v as u32);
            let found = self.vertex_class(vertex);
            if self.regular.is_vertex(vertex) {
                Self::check_class(&[vertex], found, all_cells[v], any_edge[v])?;
            }
            if found.is_some() && (!self.regular.is_vertex(vertex) || v >= self.balls) {
                return Err(DualViolation::Vertex { vertex });
            }
        }
        Ok(())
    }
}
