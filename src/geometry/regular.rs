//! The regular (weighted Delaunay) triangulation of points in space, dual to the power diagram.
//!
//! The lift `|p|^2 - w` is taken exactly, so equal weights give the Delaunay triangulation cell for
//! cell, degenerate inputs included.

use std::ops::Deref;

use super::delaunay::admissible_sites;
use super::predicates::{Filter, MAX_COORDINATE, Site, Weighted, orthosphere};
use super::triangulation::{
    CellId, Triangulated, Triangulation, TriangulationError, VertexId, Violation, triangulate,
};
use crate::Vec3;

/// The regular triangulation of weighted points in space, with the power distance
/// `|x - p|^2 - w` to the point `p` of weight `w`.
///
/// Dereferences to its [`Triangulation`], whose vertex ids are indices of the input points. A point
/// whose power cell is empty is *hidden*: it is no vertex.
///
/// ```
/// use medial_geometry::{Vec3, regular::Regular};
///
/// let mut points = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
/// points.push(Vec3::splat(0.25));
/// let visible = Regular::new(&points, &[0.0; 5])?;
/// assert_eq!(visible.finite_cell_count(), 4);
/// let hidden = Regular::new(&points, &[0.0, 0.0, 0.0, 0.0, -1.0])?;
/// assert_eq!(hidden.finite_cell_count(), 1);
/// assert_eq!(hidden.hidden()[0].index(), 4);
/// # Ok::<(), medial_geometry::triangulation::TriangulationError>(())
/// ```
///
/// # The power diagram
/// Each face of the power diagram is dual to a simplex of the triangulation:
///
/// * The power cell of a vertex has the orthocentres ([`Regular::orthosphere`]) of the cells at the
///   vertex as its corners. It is bounded if and only if none of these cells is infinite, that is
///   if the vertex is not on the convex hull. Hidden points have no power cell.
/// * The power facet between two vertices that an edge joins has the orthocentres of the cells
///   around the edge ([`edge_ring`](Triangulation::edge_ring)) as its corners, in rotational order.
/// * Two orthocentres are joined by an edge of the diagram if their cells are
///   [`neighbours`](Triangulation::neighbours). To an infinite cell leads a ray instead,
///   orthogonal to the facet that the cell has in common with its finite neighbour.
///
/// Where more than four power cells meet in one point, several cells have that orthocentre, and
/// facets can have no area.
///
/// ```
/// use medial_geometry::{Regular, Vec3, VertexId};
///
/// // A point in the middle, and six around it whose power cells start at x, y, z = 1 and -1.
/// let axes = [Vec3::X, Vec3::Y, Vec3::Z];
/// let mut points = vec![Vec3::ZERO];
/// points.extend(axes.into_iter().flat_map(|a| [2.0 * a, -2.0 * a]));
/// let regular = Regular::new(&points, &[1.0; 7])?;
/// let regular = &regular;
/// let at = |v| regular.cells().filter(move |&c| regular.vertices(c).contains(&VertexId(v)));
/// assert!(at(0).all(|cell| !regular.is_infinite(cell)));
/// let corner = |cell| regular.orthosphere(cell).expect("representable").0;
/// let corners: Vec<Vec3> = at(0).map(corner).collect();
/// assert_eq!(corners.len(), 8);
/// assert!(corners.iter().all(|c| c.abs() == Vec3::ONE)); // the corners of a cube
/// assert!(at(1).any(|cell| regular.is_infinite(cell))); // unbounded
/// # Ok::<(), medial_geometry::TriangulationError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Regular {
    triangulation: Triangulation,
    sites: Vec<Site>,
    duplicates: Vec<(VertexId, VertexId)>,
    hidden: Vec<VertexId>,
    filter: Filter,
}

impl Regular {
    /// Triangulates `points` with one weight each, the squared radius where points are balls; the
    /// unit of weights is the square of the points'.
    ///
    /// Of points at one position the heaviest counts, the others are hidden or, with the same
    /// weight, duplicates. Costs as [`Delaunay::new`](super::delaunay::Delaunay::new).
    ///
    /// # Errors
    /// As for the Delaunay triangulation; further a number of weights that is not that of the
    /// points, and a weight that is not finite or exceeds the square of [`MAX_COORDINATE`].
    pub fn new(points: &[Vec3], weights: &[f64]) -> Result<Self, TriangulationError> {
        if points.len() != weights.len() {
            let (points, weights) = (points.len(), weights.len());
            return Err(TriangulationError::WeightCount { points, weights });
        }
        let mut sites = admissible_sites(points)?;
        for (index, (site, &weight)) in sites.iter_mut().zip(weights).enumerate() {
            if !weight.is_finite() || weight.abs() > MAX_COORDINATE * MAX_COORDINATE {
                return Err(TriangulationError::Weight { index, weight });
            }
            site.w = weight;
        }
        let Triangulated { triangulation, repeated, filter } = triangulate::<Weighted>(&sites)?;
        let mut duplicates = Vec::new();
        let mut hidden = Vec::new();
        let mut repeated = repeated.into_iter().peekable();
        for i in 0..sites.len() as u32 {
            match repeated.next_if(|r| r.0 == i) {
                Some((_, kept)) if sites[i as usize].w == sites[kept as usize].w => {
                    duplicates.push((VertexId(i), VertexId(kept)));
                }
                _ if !triangulation.is_vertex(VertexId(i)) => hidden.push(VertexId(i)),
                _ => {}
            }
        }
        Ok(Self { triangulation, sites, duplicates, hidden, filter })
    }

    /// The combinatorial triangulation alone.
    pub fn into_triangulation(self) -> Triangulation {
        self.triangulation
    }

    /// The position of a finite vertex.
    ///
    /// # Panics
    /// If the vertex is the one at infinity.
    #[inline]
    pub fn point(&self, vertex: VertexId) -> Vec3 {
        Vec3::from_array(self.sites[vertex.index()].p)
    }

    /// The weight of a finite vertex.
    ///
    /// # Panics
    /// If the vertex is the one at infinity.
    #[inline]
    pub fn weight(&self, vertex: VertexId) -> f64 {
        self.sites[vertex.index()].w
    }

    #[inline]
    pub(super) fn site(&self, vertex: VertexId) -> &Site {
        &self.sites[vertex.index()]
    }

    /// The number of input points, hidden and repeated ones included.
    pub fn point_count(&self) -> usize {
        self.sites.len()
    }

    /// The input points that are not vertices because their power cell is empty, ascending.
    ///
    /// None of them is among the [`duplicates`](Regular::duplicates), and every other point is a
    /// vertex: `vertex_count() + hidden().len() + duplicates().len() == point_count()`.
    pub fn hidden(&self) -> &[VertexId] {
        &self.hidden
    }

    /// The input points that repeat position and weight of another, each with that other, ascending.
    ///
    /// The other may itself be hidden; the duplicate is listed here alone, never in
    /// [`hidden`](Regular::hidden).
    pub fn duplicates(&self) -> &[(VertexId, VertexId)] {
        &self.duplicates
    }

    /// The orthocentre of a finite cell and its common power, see [`orthosphere`]; `None` if the
    /// centre is not representable.
    ///
    /// # Panics
    /// If the cell is infinite.
    #[inline]
    pub fn orthosphere(&self, cell: CellId) -> Option<(Vec3, f64)> {
        let v = self.vertices(cell);
        orthosphere(v.map(|v| self.point(v)), v.map(|v| self.weight(v)))
    }

    /// Checks every invariant exactly: the [combinatorics](Triangulation::check_combinatorics), that every cell is
    /// positive, that no vertex across a facet is inside the orthosphere, that the hull is convex, and that every
    /// hidden point is outside the orthosphere of the cell that contains it.
    ///
    /// # Errors
    /// The first violation found.
    pub fn check(&self) -> Result<(), Violation> {
        // The geometry relies on it.
        self.check_combinatorics()?;
        self.check_regularity::<Weighted>(&self.sites, self.filter)?;
        for &(point, kept) in &self.duplicates {
            if self.sites[point.index()] != self.sites[kept.index()] || self.is_vertex(point) {
                return Err(Violation::Missing { point: point.index() });
            }
        }
        let mut near = CellId(0);
        for &point in &self.hidden {
            let site = &self.sites[point.index()];
            near = self.walk(&self.sites, near, &site.p);
            // A point at the position of a vertex is hidden by the weights alone, without a sphere test.
            let same = self
                .vertices(near)
                .into_iter()
                .find(|&v| v != VertexId::INFINITE && self.sites[v.index()].p == site.p);
            let hidden = match same {
                Some(vertex) => site.w < self.weight(vertex),
                None => !self.conflicts::<Weighted>(&self.sites, self.filter, near, site),
            };
            if self.is_vertex(point) || !hidden {
                return Err(Violation::Missing { point: point.index() });
            }
        }
        let all = self.vertex_count() + self.hidden.len() + self.duplicates.len();
        if all == self.sites.len() { Ok(()) } else { Err(Violation::Missing { point: all }) }
    }
}

impl Deref for Regular {
    type Target = Triangulation;

    fn deref(&self) -> &Triangulation {
        &self.triangulation
    }
}
