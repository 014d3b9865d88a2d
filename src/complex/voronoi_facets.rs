//! The Voronoi facets inside the surface, for filters that select facets rather than vertices.
//!
//! A facet is the polygon of circumcentres dual to a Delaunay edge all of whose cells are finite and
//! inside. Its vertices are spheres of the Voronoi medial mesh, see
//! [`voronoi_medial_mesh`](super::voronoi_medial_mesh).

use rayon::prelude::*;

use super::voronoi::{CellSpheres, DualTriangulation, triangulate};
use super::{Contacts, MedialMesh};
use crate::geometry::triangulation::Triangulation;
use crate::geometry::{CellId, Delaunay, VertexId};

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
        let triangulation = delaunay.triangulation();
        let sphere_of_cell = cells.sphere_ids(triangulation.cell_count());
        let kept: Vec<CellId> =
            triangulation.finite_cells().filter(|&cell| cells.is_inside(cell)).collect();
        let parts: Vec<Self> = kept
            .par_chunks(1024)
            .map(|part| {
                let mut facets = Self { start: vec![0], ..Self::default() };
                for &cell in part {
                    for (i, j) in EDGES_OF_CELL {
                        facets.push_dual(triangulation, &sphere_of_cell, cell, i, j);
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
        all
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
        spheres: &[super::Sphere],
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

    /// The closure of some facets, and of further edges and vertices, as a complex of its own:
    /// spheres keep their order and their contacts. `mesh` is the Voronoi medial mesh.
    ///
    /// # Panics
    /// If `mesh` is not that of these facets, or an edge or a vertex names no sphere of it.
    pub fn subcomplex(
        &self,
        mesh: &MedialMesh,
        dual: DualTriangulation,
        facets: &[u32],
        edges: &[[u32; 2]],
        vertices: &[u32],
    ) -> MedialMesh {
        let mut kept = vec![false; mesh.spheres.len()];
        let polygons = facets.iter().flat_map(|&facet| self.polygon(facet as usize));
        for &sphere in polygons.chain(edges.as_flattened()).chain(vertices) {
            kept[sphere as usize] = true;
        }
        let ids: Vec<u32> = (0..).zip(&kept).filter(|&(_, &k)| k).map(|(id, _)| id).collect();
        let mut renumbered = vec![u32::MAX; kept.len()];
        for (new, &old) in (0..).zip(&ids) {
            renumbered[old as usize] = new;
        }
        let new = |old: u32| renumbered[old as usize];
        let mut triangles = self.triangles(facets, &mesh.spheres, dual);
        triangles.iter_mut().for_each(|triangle| *triangle = triangle.map(new));
        let spheres = ids.iter().map(|&id| mesh.spheres[id as usize]).collect();
        let edges = edges.iter().map(|edge| edge.map(new)).collect();
        let mut sub = MedialMesh::from_simplices(spheres, edges, triangles)
            .expect("a part of a valid complex");
        sub.contacts = mesh.contacts.as_ref().map(|contacts| Contacts {
            samples: contacts.samples.clone(),
            of_sphere: ids.iter().map(|&id| contacts.of_sphere[id as usize]).collect(),
        });
        sub
    }
}
