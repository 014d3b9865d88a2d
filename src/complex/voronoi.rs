//! The Voronoi medial mesh: the part of the Voronoi diagram of boundary samples inside the surface.
//!
//! Amenta, Bern: *Surface reconstruction by Voronoi filtering*, SoCG 1998,
//! doi:10.1145/276884.276889, without the filtering by poles; the initial mesh of Q-MAT.
//!
//! 1. Each finite Delaunay cell whose circumcentre lies inside the surface is a medial sphere that
//!    touches the four samples of the cell ([`CellSpheres`]).
//! 2. Each facet between two such cells is a medial edge.
//! 3. Each Delaunay edge all of whose cells are finite and inside has a convex planar Voronoi
//!    polygon, which is triangulated ([`DualTriangulation`]).
//!
//! In a triangulation that contains the surface ([`Conforming`](super::Conforming)) *inside* is the place of
//! the cell. One with its centre outside is left out where the complex without it has the same homotopy type, and
//! the solid is not too thin for the samples. Otherwise the centre is moved into the cell.
//!
//! Coincident circumcentres are not merged: merging by position can close loops, and the published
//! counts are those without merging.

use std::collections::{BTreeMap, VecDeque};
use std::fmt;
use std::iter::zip;
use std::sync::Arc;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use spade::{DelaunayTriangulation, Point2, Triangulation as _};

use super::mesh::ascending_edge;
use super::{Contacts, MedialMesh, Sphere};
use crate::Vec3;
use crate::geometry::trees::morton_order;
use crate::geometry::triangulation::Triangulation;
use crate::geometry::{CellId, Delaunay, DisjointSets, VertexId};
use crate::surface::{InsideTest, PointGrid, Side, TriangleBvh};

/// Circumcentres closer to the surface than this count as outside, in units of the diagonal.
const GUARD_BAND: f64 = 1e-9;

/// Distance from the corners of cells with a centre inside, a fraction of the diagonal, up to which cells are left out.
const APART: f64 = 0.01;

/// How a dual Voronoi polygon is cut into triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DualTriangulation {
    /// A fan from one vertex, as published: from that of the smallest number. Spheres are numbered
    /// along a curve through their centres, so the numbering of the samples matters only to centres
    /// that coincide.
    #[default]
    Fan,
    /// The planar Delaunay triangulation: larger smallest angles.
    Delaunay,
}

impl fmt::Display for DualTriangulation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Fan => "fan",
            Self::Delaunay => "delaunay",
        })
    }
}

/// The circumspheres of the finite Delaunay cells, and which are centred inside the surface.
pub struct CellSpheres {
    /// Circumsphere of each finite cell; `None` where it is not representable.
    circumspheres: Vec<Option<Sphere>>,
    /// Spheres of the medial mesh that are no circumspheres, by cell, ascending.
    moved: Vec<(CellId, Sphere)>,
    /// Whether the triangulation contains the surface, as far as no triangle is missing.
    is_conforming: bool,
    /// For each finite cell.
    is_inside: Vec<bool>,
    /// The cells centred inside, along a Morton curve of their centres: neighbours are then close in
    /// memory, which speeds up contractions.
    kept: Vec<CellId>,
    /// Circumcentres inside the surface but within the guard band of it, counted as outside.
    pub in_guard_band: usize,
}

impl CellSpheres {
    /// Computes and classifies the circumcentre of every finite cell, in parallel.
    pub fn classify(delaunay: &Delaunay, inside: &InsideTest, surface: &TriangleBvh) -> Self {
        let circumspheres = delaunay.circumspheres();
        let centres: Vec<Vec3> = circumspheres.iter().flatten().map(|s| s.centre).collect();
        let sides = inside.sides(&centres);
        let near: Vec<bool> = centres
            .par_iter()
            .zip(&sides)
            .map(|(&c, &side)| side == Side::Inside && surface.any_within(c, GUARD_BAND))
            .collect();
        // Only cells with a circumsphere have a side: the two lists advance at different rates.
        let mut verdicts = sides.iter().zip(&near);
        let is_inside: Vec<bool> = circumspheres
            .iter()
            .map(|sphere| {
                sphere.is_some()
                    && verdicts.next().is_some_and(|(&side, &near)| side == Side::Inside && !near)
            })
            .collect();
        let in_guard_band = near.iter().filter(|&&near| near).count();
        Self { in_guard_band, ..Self::of_inside(delaunay, circumspheres, is_inside, vec![]) }
    }

    /// The spheres of cells that are known to be inside or outside, in normalised units. A cell inside with its centre outside
    /// is left out if the topology allows it and the solid is not thin there. Otherwise its centre is moved into the cell,
    /// and its sphere shrunk to the surface.
    pub fn of_cells(
        delaunay: &Delaunay,
        mut is_inside: Vec<bool>,
        inside: &InsideTest,
        surface: &TriangleBvh,
    ) -> Self {
        let circumspheres = delaunay.circumspheres();
        let known: Vec<u32> =
            (0..).zip(&is_inside).filter(|(_, inside)| **inside).map(|(c, _)| c).collect();
        // A sphere that is not representable is as wrong as one that is centred outside.
        let centre = |cell: u32| circumspheres[cell as usize].map_or(Vec3::INFINITY, |s| s.centre);
        let centres: Vec<Vec3> = known.iter().map(|&cell| centre(cell)).collect();
        let sides = inside.sides(&centres);
        let outside =
            (known.par_iter().zip(&sides).zip(&centres)).filter(|&((_, &side), &centre)| {
                side != Side::Inside || surface.any_within(centre, GUARD_BAND)
            });
        let outside: Vec<CellId> = outside.map(|((&cell, _), _)| CellId(cell)).collect();
        let is_thin = thin(delaunay, &known, &outside);
        let (thin, mut outside): (Vec<_>, Vec<_>) =
            zip(outside, is_thin).partition(|&(_, thin)| thin);
        leave_out(delaunay, &mut is_inside, &mut outside);
        let corners = |cell| delaunay.vertices(cell).map(|v| delaunay.point(v));
        let thin = thin.into_par_iter().map(|(cell, _)| (cell, centroid(corners(cell))));
        let outside = outside
            .into_par_iter()
            .map(|(cell, _)| (cell, nearest_within(corners(cell), centre(cell.0))));
        let moved = thin
            .chain(outside)
            .map(|(cell, centre)| (cell, Sphere::new(centre, surface.closest(centre).distance)));
        let mut moved: Vec<_> = moved.collect();
        moved.sort_by_key(|&(cell, _)| cell);
        let conforming = Self::of_inside(delaunay, circumspheres, is_inside, moved);
        Self { is_conforming: true, ..conforming }
    }

    fn of_inside(
        delaunay: &Delaunay,
        circumspheres: Vec<Option<Sphere>>,
        is_inside: Vec<bool>,
        moved: Vec<(CellId, Sphere)>,
    ) -> Self {
        let mut found = Self {
            circumspheres,
            moved,
            is_conforming: false,
            is_inside,
            kept: Vec::new(),
            in_guard_band: 0,
        };
        let cells = delaunay.finite_cells().filter(|&cell| found.is_inside(cell));
        let (cells, centres): (Vec<CellId>, Vec<Vec3>) =
            cells.filter_map(|cell| Some((cell, found.sphere(cell)?.centre))).unzip();
        found.kept = morton_order(&centres).into_iter().map(|(_, i)| cells[i as usize]).collect();
        found
    }

    /// The sphere of a cell in the medial mesh.
    fn sphere(&self, cell: CellId) -> Option<Sphere> {
        let moved = self.moved.binary_search_by_key(&cell, |&(cell, _)| cell);
        moved.map_or(self.circumspheres[cell.index()], |place| Some(self.moved[place].1))
    }

    /// For each point of the triangulation whether it is on a circumsphere of the medial mesh.
    pub fn touched(&self, delaunay: &Delaunay) -> Vec<bool> {
        let mut is_touched = vec![false; delaunay.point_count()];
        let is_moved = |cell| self.moved.binary_search_by_key(&cell, |&(cell, _)| cell).is_ok();
        for &cell in self.kept.iter().filter(|&&cell| !is_moved(cell)) {
            delaunay.vertices(cell).iter().for_each(|v| is_touched[v.index()] = true);
        }
        is_touched
    }

    /// The circumspheres of all finite cells, those centred outside included, see
    /// [`Delaunay::circumspheres`].
    pub fn circumspheres(&self) -> &[Option<Sphere>] {
        &self.circumspheres
    }

    /// Whether a cell is part of the solid, or else whether its circumcentre is inside; never for infinite cells.
    pub fn is_inside(&self, cell: CellId) -> bool {
        // Finite cells come first; infinite ones are beyond the list.
        self.is_inside.get(cell.index()).is_some_and(|&inside| inside)
    }

    /// For each of `cells` cells its sphere of the Voronoi medial mesh, or the largest id.
    pub(super) fn sphere_ids(&self, cells: usize) -> Vec<u32> {
        let mut ids = vec![u32::MAX; cells];
        for (sphere, cell) in (0..).zip(&self.kept) {
            ids[cell.index()] = sphere;
        }
        ids
    }
}

/// Whether each of the cells `outside` among those `known` to be in the solid is in a part that is too thin for the samples,
/// as a plate: a corner of it is far from the corners of all cells with a centre inside.
fn thin(delaunay: &Delaunay, known: &[u32], outside: &[CellId]) -> Vec<bool> {
    let mut others = outside.iter().peekable();
    let mut is_centred = vec![false; delaunay.point_count()];
    for &cell in known {
        if others.next_if(|other| other.0 == cell).is_none() {
            delaunay.vertices(CellId(cell)).iter().for_each(|v| is_centred[v.index()] = true);
        }
    }
    let mut grid = PointGrid::new(APART);
    let centred = (0..).zip(&is_centred).filter(|(_, is_centred)| **is_centred);
    centred.for_each(|(v, _)| grid.insert(delaunay.point(VertexId(v))));
    let is_far = |v: VertexId| !is_centred[v.index()] && !grid.any_within(delaunay.point(v), APART);
    outside.par_iter().map(|&cell| delaunay.vertices(cell).into_iter().any(is_far)).collect()
}

/// Takes cells off the inside without which the dual complex keeps its homotopy type. The list keeps the
/// others.
fn leave_out(
    triangulation: &Triangulation,
    is_inside: &mut [bool],
    cells: &mut Vec<(CellId, bool)>,
) {
    loop {
        let before = cells.len();
        cells.retain(|&(cell, _)| {
            let is_tree = link_is_tree(triangulation, is_inside, cell);
            is_inside[cell.index()] = !is_tree;
            !is_tree
        });
        if cells.len() == before {
            return;
        }
    }
}

/// Whether the neighbours inside of a cell, joined by the edges that are all inside, are a tree. Then the dual
/// complex keeps its homotopy type without the cell.
fn link_is_tree(triangulation: &Triangulation, is_inside: &[bool], cell: CellId) -> bool {
    let inside = |cell: CellId| is_inside.get(cell.index()) == Some(&true);
    let neighbours = triangulation.neighbours(cell).map(inside);
    let mut parts = neighbours.iter().filter(|&&is_inside| is_inside).count();
    let mut sets = DisjointSets::singletons(4);
    for (i, j) in EDGES_OF_CELL {
        if triangulation.edge_ring(cell, i, j).all(inside) {
            // The edge joins the facets opposite to the other two corners, whose numbers add up to this.
            let k = (0..4).find(|&k| k != i && k != j).unwrap_or(0);
            if !sets.join(k as u32, (6 - i - j - k) as u32) {
                return false;
            }
            parts -= 1;
        }
    }
    parts == 1
}

/// How much of its cell a centre may reach that is moved into it, from the centroid.
const SHRUNK: f64 = 0.9;

fn centroid(corners: [Vec3; 4]) -> Vec3 {
    corners.into_iter().sum::<Vec3>() / 4.0
}

/// The point of a tetrahedron, shrunk a little, that is nearest to a point; its centroid for none.
fn nearest_within(corners: [Vec3; 4], p: Vec3) -> Vec3 {
    let centroid = centroid(corners);
    let shrunk = corners.map(|corner| centroid.lerp(corner, SHRUNK));
    let faces = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]].map(|face| face.map(|k| shrunk[k]));
    let nearest = TriangleBvh::from_triangles(&faces).ok().filter(|_| p.is_finite());
    nearest.map_or(centroid, |faces| faces.closest(p).point)
}

/// The Voronoi medial mesh of a triangulation of boundary samples, with contact points. Spheres
/// lie along a Morton curve. Parallel; the same mesh for any number of threads. `facets` are those of
/// the same cells.
pub fn voronoi_medial_mesh(
    delaunay: &Delaunay,
    cells: &CellSpheres,
    facets: &VoronoiFacets,
    samples: &Arc<[Vec3]>,
    dual: DualTriangulation,
) -> MedialMesh {
    let kept = &cells.kept;
    let sphere_of_cell = &cells.sphere_ids(delaunay.cell_count());
    let spheres: Vec<Sphere> = kept.iter().filter_map(|&cell| cells.sphere(cell)).collect();
    let edges = kept.par_iter().flat_map_iter(|&cell| {
        let neighbours = delaunay.neighbours(cell).into_iter();
        neighbours
            .filter(move |&other| other > cell && cells.is_inside(other))
            .map(move |other| [cell, other].map(|cell| sphere_of_cell[cell.index()]))
    });
    let all: Vec<u32> = (0..facets.len() as u32).collect();
    let faces = facets.triangles(&all, &spheres, dual);
    let mut mesh = MedialMesh::from_simplices(spheres, edges.collect(), faces)
        .expect("circumspheres are finite and ids in range");
    mesh.contacts = Some(Contacts {
        samples: Arc::clone(samples),
        of_sphere: kept.iter().map(|&c| delaunay.vertices(c).map(|v| v.0)).collect(),
    });
    mesh
}

/// Adds the triangles of a dual polygon that is given by its spheres in rotational order.
pub(super) fn triangulate(
    polygon: &[u32],
    spheres: &[Sphere],
    dual: DualTriangulation,
    triangles: &mut Vec<[u32; 3]>,
) {
    if dual == DualTriangulation::Delaunay
        && polygon.len() > 3
        && let Some(planar) = planar_delaunay(polygon, spheres)
    {
        triangles.extend(planar);
        return;
    }
    let start = (0..polygon.len()).min_by_key(|&k| polygon[k]).unwrap_or(0);
    let vertex = |k: usize| polygon[(start + k) % polygon.len()];
    triangles.extend((2..polygon.len()).map(|k| [vertex(0), vertex(k - 1), vertex(k)]));
}

/// The Delaunay triangulation of a convex planar polygon, or `None` where coincident or collinear
/// vertices give something else than `n - 2` triangles bounded by the polygon's sides; the caller
/// then falls back to the fan.
fn planar_delaunay(polygon: &[u32], spheres: &[Sphere]) -> Option<Vec<[u32; 3]>> {
    let centre = |v: u32| spheres[v as usize].centre;
    let origin = centre(polygon[0]);
    // Newell's normal: the sum of the fan's area vectors.
    let normal: Vec3 = polygon[1..]
        .windows(2)
        .map(|pair| (centre(pair[0]) - origin).cross(centre(pair[1]) - origin))
        .sum();
    let normal = normal.try_normalize()?;
    let (u, v) = normal.any_orthonormal_pair();
    let mut plane: DelaunayTriangulation<Point2<f64>> = DelaunayTriangulation::new();
    for (k, &id) in polygon.iter().enumerate() {
        let p = centre(id) - origin;
        let handle = plane.insert(Point2::new(p.dot(u), p.dot(v))).ok()?;
        if handle.index() != k {
            return None;
        }
    }
    let triangles: Vec<[u32; 3]> = plane
        .inner_faces()
        .map(|face| face.vertices().map(|vertex| polygon[vertex.fix().index()]))
        .collect();
    let fills = triangles.len() + 2 == polygon.len() && bounded_by(&triangles, polygon);
    fills.then_some(triangles)
}

/// Whether the sides of a polygon are just the edges that have a single triangle.
fn bounded_by(triangles: &[[u32; 3]], polygon: &[u32]) -> bool {
    let mut edges: Vec<[u32; 2]> = triangles
        .iter()
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [a, c]].map(ascending_edge))
        .collect();
    edges.sort_unstable();
    let single = edges.chunk_by(|a, b| a == b).filter(|run| run.len() == 1).map(|run| run[0]);
    let mut sides: Vec<[u32; 2]> = (0..polygon.len())
        .map(|k| ascending_edge([polygon[k], polygon[(k + 1) % polygon.len()]]))
        .collect();
    sides.sort_unstable();
    single.eq(sides)
}

// The Voronoi facets inside the surface, for filters that select facets rather than vertices.
//
// A facet is the polygon of circumcentres dual to a Delaunay edge all of whose cells are finite and
// inside. Its vertices are spheres of the Voronoi medial mesh, see
// [`voronoi_medial_mesh`](super::voronoi_medial_mesh).

/// The six edges of a tetrahedron, as pairs of vertex positions.
const EDGES_OF_CELL: [(usize, usize); 6] = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];

/// The Voronoi facets all of whose vertices are inside the surface.
#[derive(Clone, Debug, Default)]
pub struct VoronoiFacets {
    ends: Vec<[VertexId; 2]>,
    /// `polygons[start[i]..start[i + 1]]` are the spheres of facet `i` in rotational order, that of
    /// the smallest cell first.
    start: Vec<u32>,
    polygons: Vec<u32>,
}

impl VoronoiFacets {
    /// The facets in the order of the smallest cell of their Delaunay edge. Parallel; the same for
    /// any number of threads. Costs a turn around each edge for each of its cells.
    pub fn new(delaunay: &Delaunay, cells: &CellSpheres) -> Self {
        let sphere_of_cell = cells.sphere_ids(delaunay.cell_count());
        let kept: Vec<CellId> =
            delaunay.finite_cells().filter(|&cell| cells.is_inside(cell)).collect();
        let parts: Vec<Self> = kept
            .par_chunks(1024)
            .map(|part| {
                let mut facets = Self { start: vec![0], ..Self::default() };
                for &cell in part {
                    for (i, j) in EDGES_OF_CELL {
                        facets.push_dual(delaunay, &sphere_of_cell, cell, i, j);
                    }
                }
                facets
            })
            .collect();
        let mut all = Self { start: vec![0], ..Self::default() };
        for part in parts {
            let offset = all.polygons.len() as u32;
            all.ends.extend(part.ends);
            all.start.extend(part.start[1..].iter().map(|s| s + offset));
            all.polygons.extend(part.polygons);
        }
        if cells.is_conforming {
            all.open_voids(delaunay, cells);
        }
        all
    }

    /// Leaves out one facet of each sample that has no cell outside. Its Voronoi cell would be a void of the medial mesh. The
    /// facets open these cells one after the other to that of a sample on the surface, so that no loop appears.
    fn open_voids(&mut self, delaunay: &Delaunay, cells: &CellSpheres) {
        let mut is_closed = vec![true; delaunay.point_count()];
        for cell in delaunay.cells().filter(|&cell| !cells.is_inside(cell)) {
            for v in delaunay.vertices(cell).into_iter().filter(|&v| v != VertexId::INFINITE) {
                is_closed[v.index()] = false;
            }
        }
        let mut of_closed: BTreeMap<VertexId, Vec<usize>> = BTreeMap::new();
        for (facet, ends) in self.ends.iter().enumerate() {
            for &end in ends.iter().filter(|end| is_closed[end.index()]) {
                of_closed.entry(end).or_default().push(facet);
            }
        }
        if of_closed.is_empty() {
            return;
        }
        let is_at_surface = |&facet: &usize| self.ends[facet].iter().any(|v| !is_closed[v.index()]);
        let next = of_closed.values().flatten().copied().filter(is_at_surface);
        let mut next: VecDeque<usize> = next.collect();
        let mut left_out = vec![false; self.ends.len()];
        while let Some(facet) = next.pop_front() {
            let closed = self.ends[facet].into_iter().find(|v| is_closed[v.index()]);
            if let Some(closed) = closed {
                is_closed[closed.index()] = false;
                left_out[facet] = true;
                next.extend(of_closed.get(&closed).into_iter().flatten());
            }
        }
        let kept = (0..self.len()).filter(|&facet| !left_out[facet]);
        let mut open = Self { start: vec![0], ..Self::default() };
        for facet in kept {
            open.ends.push(self.ends[facet]);
            open.polygons.extend(self.polygon(facet));
            open.start.push(open.polygons.len() as u32);
        }
        *self = open;
    }

    /// Adds the facet dual to edge `(i, j)` of `cell`, if `cell` is the smallest around it, so that
    /// each edge is dualised once, and all are finite and inside.
    fn push_dual(
        &mut self,
        triangulation: &Triangulation,
        sphere_of_cell: &[u32],
        cell: CellId,
        i: usize,
        j: usize,
    ) {
        let before = self.polygons.len();
        for other in triangulation.edge_ring(cell, i, j) {
            let sphere = sphere_of_cell[other.index()];
            if other < cell || sphere == u32::MAX {
                self.polygons.truncate(before);
                return;
            }
            self.polygons.push(sphere);
        }
        let v = triangulation.vertices(cell);
        self.ends.push([v[i], v[j]]);
        self.start.push(self.polygons.len() as u32);
    }

    /// Number of facets.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    /// The two samples whose Voronoi cells meet in a facet: the ends of its dual Delaunay edge.
    #[inline]
    pub fn ends(&self, facet: usize) -> [VertexId; 2] {
        self.ends[facet]
    }

    /// The vertices of a facet in rotational order, as spheres of the Voronoi medial mesh.
    #[inline]
    pub fn polygon(&self, facet: usize) -> &[u32] {
        &self.polygons[self.start[facet] as usize..self.start[facet + 1] as usize]
    }

    /// Some facets in triangles, in the order of the facets.
    pub(super) fn triangles(
        &self,
        facets: &[u32],
        spheres: &[crate::complex::Sphere],
        dual: DualTriangulation,
    ) -> Vec<[u32; 3]> {
        let parts = facets.par_chunks(1024).map(|part| {
            let mut triangles = Vec::with_capacity(4 * part.len());
            for &facet in part {
                triangulate(self.polygon(facet as usize), spheres, dual, &mut triangles);
            }
            triangles
        });
        parts.collect::<Vec<_>>().concat()
    }

    /// The closure of some facets as a complex of its own: spheres keep their order and their
    /// contacts. `mesh` is the Voronoi medial mesh.
    ///
    /// # Panics
    /// If `mesh` is not that of these facets.
    pub fn subcomplex(
        &self,
        mesh: &MedialMesh,
        dual: DualTriangulation,
        facets: &[u32],
    ) -> MedialMesh {
        let mut kept = vec![false; mesh.spheres.len()];
        for &sphere in facets.iter().flat_map(|&facet| self.polygon(facet as usize)) {
            kept[sphere as usize] = true;
        }
        let triangles = self.triangles(facets, &mesh.spheres, dual);
        let whole = MedialMesh::from_simplices(mesh.spheres.clone(), Vec::new(), triangles)
            .expect("a part of a valid complex");
        MedialMesh { contacts: mesh.contacts.clone(), ..whole }.induced(&kept)
    }
}

// The stability ratio of a medial edge.

/// Edges shorter than this count as having no length, in units of the bounding-box diagonal:
/// the radii of circumcentres that coincide differ by rounding noise alone.
pub const ZERO_LENGTH: f64 = 1e-12;

/// Stability ratio `max(0, d - |r_a - r_b|) / d` of the edge between two spheres, in `[0, 1]`,
/// with `d` the distance of the centres; 0 when `d` is below [`ZERO_LENGTH`].
///
/// Lengths are in units of the bounding-box diagonal. 0: one ball holds the other, a pure spike;
/// 1: equal radii. Li, Wang, Sun, Guo, Zhang, Wang, "Q-MAT: Computing Medial Axis Transform by
/// Quadratic Error Minimization", ACM TOG 35 (2015), <https://doi.org/10.1145/2753755>.
pub fn stability_ratio(a: Sphere, b: Sphere) -> f64 {
    let d = a.centre.distance(b.centre);
    if d < ZERO_LENGTH {
        return 0.0;
    }
    (d - (a.radius - b.radius).abs()).max(0.0) / d
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::Vec3;

    #[test]
    fn contained_equal_and_coincident_balls() {
        let at = |x: f64, r: f64| Sphere::new(Vec3::new(x, 0.0, 0.0), r);
        assert_eq!(stability_ratio(at(0.0, 1.0), at(0.5, 0.25)), 0.0);
        assert_eq!(stability_ratio(at(0.0, 1.0), at(0.5, 1.0)), 1.0);
        assert_eq!(stability_ratio(at(0.0, 1.0), at(1.0, 0.25)), 0.25);
        assert_eq!(stability_ratio(at(0.0, 1.0), at(0.0, 1.0)), 0.0);
        assert_eq!(stability_ratio(at(0.0, 1.0), at(1e-13, 1.0)), 0.0);
    }

    proptest! {
        /// The cost `c = d / |dr|` of the progressive medial axis transform orders edges
        /// the same way, `ratio = max(0, 1 - 1/c)`.
        #[test]
        fn agrees_with_the_cost_of_the_progressive_transform(
            c in prop::array::uniform3(-1.0..1.0f64), r in 0.0..1.0f64, s in 0.0..1.0f64,
        ) {
            let (a, b) = (Sphere::new(Vec3::ZERO, r), Sphere::new(Vec3::from(c), s));
            let cost = b.centre.length() / (r - s).abs();
            let ratio = stability_ratio(a, b);
            prop_assert!((0.0..=1.0).contains(&ratio));
            prop_assert!((ratio - (1.0 - 1.0 / cost).max(0.0)).abs() < 1e-14);
            prop_assert_eq!(ratio, stability_ratio(b, a));
        }
    }
}
