//! The Delaunay triangulation of points in space.
//!
//! Exact and unique for every input: cospherical points are resolved by the symbolic perturbation
//! of [`super::predicates`], which never makes a flat cell, so grids, spheres, cylinders and
//! coplanar subsets give one valid triangulation, whatever the order of the points.

use std::ops::Deref;

use rayon::prelude::*;

use super::Sphere;
use super::triangulation::{
    CellId, Triangulated, Triangulation, TriangulationError, VertexId, Violation, extend,
    triangulate,
};
use crate::Vec3;
use crate::predicates::{Filter, MAX_COORDINATE, Site, Unweighted, circumsphere, lexicographic};

/// The Delaunay triangulation of points in space.
///
/// Dereferences to its [`Triangulation`], whose vertex ids are indices of the input points.
///
/// ```
/// use medial_geometry::{Vec3, delaunay::Delaunay};
///
/// let corners: Vec<Vec3> = (0..8u32)
///     .map(|i| Vec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)))
///     .collect();
/// let cube = Delaunay::new(&corners)?;
/// assert_eq!(cube.infinite_cell_count(), 12);
/// for cell in cube.finite_cells() {
///     let (centre, radius) = cube.circumsphere(cell).unwrap();
///     assert_eq!(centre, Vec3::splat(0.5));
///     assert!((radius - 0.75f64.sqrt()).abs() < 1e-15);
/// }
/// # Ok::<(), medial_geometry::triangulation::TriangulationError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Delaunay {
    triangulation: Triangulation,
    sites: Vec<Site>,
    duplicates: Vec<(VertexId, VertexId)>,
    filter: Filter,
}

impl Delaunay {
    /// Triangulates `points`, in any unit.
    ///
    /// Repeated points are recorded, see [`Delaunay::representative`]. Incremental insertion with
    /// exact predicates: expected `O(n log n)` for points in random position and near that for
    /// samples of surfaces, `O(n^2)` at worst.
    ///
    /// # Errors
    /// A coordinate that is not finite or exceeds [`MAX_COORDINATE`]; fewer than four distinct
    /// points; all points on one line or in one plane; more points than ids.
    pub fn new(points: &[Vec3]) -> Result<Self, TriangulationError> {
        let sites = admissible_sites(points)?;
        let Triangulated { triangulation, repeated, filter } = triangulate::<Unweighted>(&sites)?;
        let duplicates = repeated.into_iter().map(|(i, j)| (VertexId(i), VertexId(j))).collect();
        Ok(Self { triangulation, sites, duplicates, filter })
    }

    /// Adds points; their ids follow those of the points before. The cells are those of a triangulation of
    /// all points. Cost: near `O(n)` for the bookkeeping, and `O(log n)` expected for each point that is
    /// added.
    ///
    /// ```
    /// use medial_geometry::{Vec3, delaunay::Delaunay};
    ///
    /// let mut tetrahedron = Delaunay::new(&[Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z])?;
    /// tetrahedron.insert(&[Vec3::splat(0.25)])?;
    /// assert_eq!(tetrahedron.finite_cell_count(), 4);
    /// # Ok::<(), medial_geometry::triangulation::TriangulationError>(())
    /// ```
    ///
    /// # Errors
    /// As [`Delaunay::new`]; the triangulation is then as it was.
    pub fn insert(&mut self, points: &[Vec3]) -> Result<(), TriangulationError> {
        let mut sites = self.sites.clone();
        sites.extend(admissible_sites(points)?);
        let extended = extend::<Unweighted>(&self.triangulation, &sites, self.sites.len())?;
        let Triangulated { triangulation, repeated, filter } = extended;
        let duplicates = repeated.into_iter().map(|(i, j)| (VertexId(i), VertexId(j))).collect();
        *self = Self { triangulation, sites, duplicates, filter };
        Ok(())
    }

    /// The combinatorial triangulation alone.
    pub fn into_triangulation(self) -> Triangulation {
        self.triangulation
    }

    /// The hull's vertices, ascending, with the average direction of their cells' unbounded edges, of
    /// unit length: where their first poles are.
    pub fn unbounded_directions(&self) -> Vec<(VertexId, Vec3)> {
        let mut normals: Vec<(VertexId, Vec3)> = Vec::with_capacity(3 * self.infinite_cell_count());
        for cell in self.infinite_cells() {
            let [a, b, c, _] = self.vertices(cell);
            let [p, q, r] = [a, b, c].map(|v| self.point(v));
            // Scaled first, so that the product of short edges does not underflow.
            let (u, v) = (q - p, r - p);
            let reach = u.abs().max_element().max(v.abs().max_element());
            let normal = (u / reach).cross(v / reach).normalize_or_zero();
            normals.extend([a, b, c].map(|v| (v, normal)));
        }
        // Stable, so that the sums are taken in the order of the cells.
        normals.sort_by_key(|n| n.0);
        normals
            .chunk_by(|a, b| a.0 == b.0)
            .map(|of_vertex| {
                let sum: Vec3 = of_vertex.iter().map(|n| n.1).sum();
                (of_vertex[0].0, sum.normalize_or(of_vertex[0].1))
            })
            .collect()
    }

    /// The position of a finite vertex.
    ///
    /// # Panics
    /// If the vertex is the one at infinity.
    #[inline]
    pub fn point(&self, vertex: VertexId) -> Vec3 {
        Vec3::from_array(self.sites[vertex.index()].p)
    }

    /// The number of input points, repeated ones included.
    pub fn point_count(&self) -> usize {
        self.sites.len()
    }

    /// The input points that repeat the position of another, each with the one that is a vertex:
    /// the first at that position. Ascending. All other points are vertices, so
    /// `vertex_count() + duplicates().len() == point_count()`.
    pub fn duplicates(&self) -> &[(VertexId, VertexId)] {
        &self.duplicates
    }

    /// The vertex at the position of an input point: the point itself unless it is a duplicate.
    pub fn representative(&self, point: VertexId) -> VertexId {
        match self.duplicates.binary_search_by_key(&point, |d| d.0) {
            Ok(found) => self.duplicates[found].1,
            Err(_) => point,
        }
    }

    /// The centre and radius of the circumsphere of a finite cell, see
    /// [`circumsphere`]; `None` if the centre is not
    /// representable.
    ///
    /// # Panics
    /// If the cell is infinite.
    #[inline]
    pub fn circumsphere(&self, cell: CellId) -> Option<(Vec3, f64)> {
        circumsphere(self.vertices(cell).map(|v| self.point(v)))
    }

    /// The circumspheres of all finite cells, in parallel; `None` where centre or radius is not
    /// representable.
    pub fn circumspheres(&self) -> Vec<Option<Sphere>> {
        (0..self.finite_cell_count() as u32)
            .into_par_iter()
            .with_min_len(1024)
            .map(|cell| {
                let (centre, radius) = self.circumsphere(CellId(cell))?;
                (centre.is_finite() && radius.is_finite()).then_some(Sphere::new(centre, radius))
            })
            .collect()
    }

    /// Checks every invariant exactly: the [combinatorics](Triangulation::check_combinatorics), that every cell is
    /// positive, that every circumsphere is empty (facet by facet, which implies it globally), that the hull is
    /// convex, and that every input point is a vertex or recorded as the duplicate of one.
    ///
    /// # Errors
    /// The first violation found.
    pub fn check(&self) -> Result<(), Violation> {
        // The geometry relies on it.
        self.check_combinatorics()?;
        self.check_regularity::<Unweighted>(&self.sites, self.filter)?;
        for point in 0..self.sites.len() {
            let id = VertexId(point as u32);
            // A duplicate must repeat the position of a vertex; any other point is its own representative.
            let kept = self.representative(id);
            let same = lexicographic(&self.sites[point].p, &self.sites[kept.index()].p).is_eq();
            if !same || !self.is_vertex(kept) || (kept != id && self.is_vertex(id)) {
                return Err(Violation::Missing { point });
            }
        }
        Ok(())
    }
}

impl Deref for Delaunay {
    type Target = Triangulation;

    fn deref(&self) -> &Triangulation {
        &self.triangulation
    }
}

/// Sites of weight zero, or the reason why a point cannot be one.
pub(super) fn admissible_sites(points: &[Vec3]) -> Result<Vec<Site>, TriangulationError> {
    let refused = |p: &Vec3| !p.is_finite() || p.abs().max_element() > MAX_COORDINATE;
    if let Some(index) = points.par_iter().with_min_len(1024).position_first(refused) {
        let point = points[index];
        return Err(if point.is_finite() {
            TriangulationError::OutOfRange { index, point }
        } else {
            TriangulationError::NotFinite { index, point }
        });
    }
    // Adding zero makes -0.0 the same position as 0.0.
    let site = |&point: &Vec3| Site { p: (point + Vec3::ZERO).to_array(), w: 0.0 };
    Ok(points.par_iter().with_min_len(1024).map(site).collect())
}
