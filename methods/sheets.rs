//! The complex of the Voronoi facets inside a surface, and its subcomplexes without some of them.
//!
//! A facet consists of the points whose closest samples are a given pair: it is a sheet of the medial
//! axis, governed by two sites of the boundary.

use medial::complex::{MedialMesh, VoronoiFacets};

/// The facets inside a surface as sheets, with the edges and spheres that have no facet.
pub(crate) struct Sheets {
    /// The edges and the vertices of each sheet, ascending; each once.
    edges: Vec<Vec<u32>>,
    vertices: Vec<Vec<u32>>,
    /// For each edge and each sphere the sheets that it belongs to, ascending.
    sheets_at_edge: Vec<Vec<u32>>,
    sheets_at_sphere: Vec<Vec<u32>>,
    /// Whether a sphere has an edge without a facet.
    has_bare_edge: Vec<bool>,
    bare_edges: Vec<[u32; 2]>,
    bare_spheres: Vec<u32>,
}

impl Sheets {
    /// The facets of a Voronoi medial mesh. `O(n log n)`.
    ///
    /// # Panics
    /// If a side of a facet is no edge of the mesh.
    pub(crate) fn of(mesh: &MedialMesh, facets: &VoronoiFacets) -> Self {
        let edge_id = |a: u32, b: u32| {
            let found = mesh.edges.binary_search(&[a.min(b), a.max(b)]);
            found.expect("a side of a facet is an edge") as u32
        };
        let sorted = |ids: &mut dyn Iterator<Item = u32>| {
            let mut ids: Vec<u32> = ids.collect();
            ids.sort_unstable();
            ids
        };
        let (mut edges, mut vertices) = (Vec::new(), Vec::new());
        for facet in 0..facets.len() {
            let v = facets.polygon(facet);
            let mut sides = (0..v.len()).map(|k| edge_id(v[k], v[(k + 1) % v.len()]));
            edges.push(sorted(&mut sides));
            vertices.push(sorted(&mut v.iter().copied()));
        }
        let count = edges.len();
        let mut sheets_at_edge = vec![Vec::new(); mesh.edges.len()];
        let mut sheets_at_sphere = vec![Vec::new(); mesh.spheres.len()];
        for sheet in 0..count {
            edges[sheet].iter().for_each(|&e| sheets_at_edge[e as usize].push(sheet as u32));
            vertices[sheet].iter().for_each(|&v| sheets_at_sphere[v as usize].push(sheet as u32));
        }
        // Diagonals that cut a facet into triangles lie in a facet though they are no side of one.
        let mut in_face = vec![false; mesh.edges.len()];
        for &[a, b, c] in &mesh.faces {
            for [u, v] in [[a, b], [a, c], [b, c]] {
                in_face[edge_id(u, v) as usize] = true;
            }
        }
        let bare = mesh.edges.iter().zip(&in_face).filter(|&(_, &in_face)| !in_face);
        let bare_edges: Vec<[u32; 2]> = bare.map(|(&edge, _)| edge).collect();
        let mut has_bare_edge = vec![false; mesh.spheres.len()];
        for &end in bare_edges.as_flattened() {
            has_bare_edge[end as usize] = true;
        }
        let bare_spheres = (0..mesh.spheres.len() as u32)
            .filter(|&v| sheets_at_sphere[v as usize].is_empty() && !has_bare_edge[v as usize])
            .collect();
        Self {
            edges,
            vertices,
            sheets_at_edge,
            sheets_at_sphere,
            has_bare_edge,
            bare_edges,
            bare_spheres,
        }
    }

    /// Number of sheets.
    pub(crate) fn len(&self) -> usize {
        self.edges.len()
    }

    /// Edges that lie in no facet: parts that are like curves.
    pub(crate) fn bare_edges(&self) -> &[[u32; 2]] {
        &self.bare_edges
    }

    /// Spheres without an edge or facet.
    pub(crate) fn bare_spheres(&self) -> &[u32] {
        &self.bare_spheres
    }
}

/// A complex while sheets are removed.
pub(crate) struct Without<'a> {
    sheets: &'a Sheets,
    gone: Vec<bool>,
    /// Sheets left at each edge; at each sphere, with one more for edges that lie in no facet.
    at_edge: Vec<u32>,
    at_sphere: Vec<u32>,
    /// Spheres left.
    spheres: usize,
}

impl<'a> Without<'a> {
    /// All sheets are there.
    pub(crate) fn none(sheets: &'a Sheets) -> Self {
        let number = |lists: &[Vec<u32>]| -> Vec<u32> {
            lists.iter().map(|list| list.len() as u32).collect()
        };
        let mut at_sphere = number(&sheets.sheets_at_sphere);
        for (count, &bare) in at_sphere.iter_mut().zip(&sheets.has_bare_edge) {
            *count += u32::from(bare);
        }
        Self {
            gone: vec![false; sheets.len()],
            at_edge: number(&sheets.sheets_at_edge),
            spheres: at_sphere.len(),
            at_sphere,
            sheets,
        }
    }

    /// Whether a sheet has been removed.
    pub(crate) fn is_gone(&self, sheet: usize) -> bool {
        self.gone[sheet]
    }

    /// Number of spheres left.
    pub(crate) fn spheres(&self) -> usize {
        self.spheres
    }

    /// Whether removing a sheet leaves the Betti numbers as they are: a part of its border is free, and
    /// its seam, what it shares with others, has its own Euler characteristic, 1.
    pub(crate) fn may_go(&self, sheet: usize) -> bool {
        if self.gone[sheet] {
            return false;
        }
        let Sheets { edges, vertices, .. } = self.sheets;
        let shared_edges = edges[sheet].iter().filter(|&&e| self.at_edge[e as usize] > 1).count();
        let shared_vertices =
            vertices[sheet].iter().filter(|&&v| self.at_sphere[v as usize] > 1).count();
        shared_edges < edges[sheet].len() && shared_vertices == shared_edges + 1
    }

    /// Removes a sheet without its seam; the sheets at its seam that are left, ascending.
    pub(crate) fn remove(&mut self, sheet: usize) -> Vec<usize> {
        let Sheets { edges, vertices, sheets_at_sphere, .. } = self.sheets;
        self.gone[sheet] = true;
        for &edge in &edges[sheet] {
            self.at_edge[edge as usize] -= 1;
        }
        let mut neighbours = Vec::new();
        for &v in &vertices[sheet] {
            let left = &mut self.at_sphere[v as usize];
            *left -= 1;
            self.spheres -= usize::from(*left == 0);
            let others = sheets_at_sphere[v as usize].iter().map(|&other| other as usize);
            neighbours.extend(others.filter(|&other| !self.gone[other]));
        }
        neighbours.sort_unstable();
        neighbours.dedup();
        neighbours
    }
}
