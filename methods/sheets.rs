//! The sheets of a complex of Voronoi facets, and the complex without some of them.

use medial::complex::{MedialMesh, VoronoiFacets};

/// The facets inside a surface, grouped into sheets, with the edges and spheres that have no facet.
pub(crate) struct Sheets {
    /// For each facet.
    of_facet: Vec<u32>,
    /// The edges of each sheet, each with the number of its facets there.
    edges: Vec<Vec<(u32, u32)>>,
    vertices: Vec<Vec<u32>>,
    /// Euler characteristic of each sheet in itself.
    euler: Vec<i64>,
    /// For each edge and each sphere the sheets that it belongs to, ascending.
    sheets_at_edge: Vec<Vec<u32>>,
    sheets_at_sphere: Vec<Vec<u32>>,
    /// Whether a sphere has an edge without a facet.
    has_bare_edge: Vec<bool>,
    bare_edges: Vec<[u32; 2]>,
    bare_spheres: Vec<u32>,
}

impl Sheets {
    /// Groups the facets of a Voronoi medial mesh. `O(n log n)`.
    ///
    /// # Panics
    /// If a side of a facet is no edge of the mesh.
    pub(crate) fn of(mesh: &MedialMesh, facets: &VoronoiFacets) -> Self {
        let edge_id = |a: u32, b: u32| {
            let found = mesh.edges.binary_search(&[a.min(b), a.max(b)]);
            found.expect("a side of a facet is an edge") as u32
        };
        let sides: Vec<Vec<u32>> = (0..facets.len())
            .map(|facet| {
                let v = facets.polygon(facet);
                (0..v.len()).map(|k| edge_id(v[k], v[(k + 1) % v.len()])).collect()
            })
            .collect();
        let mut facets_at = vec![Vec::new(); mesh.edges.len()];
        for (facet, sides) in sides.iter().enumerate() {
            for &edge in sides {
                facets_at[edge as usize].push(facet as u32);
            }
        }
        let of_facet = grouped(&sides, &facets_at);
        let count = of_facet.iter().max().map_or(0, |&most| most as usize + 1);
        let (mut all_sides, mut vertices) = (vec![Vec::new(); count], vec![Vec::new(); count]);
        let mut euler = vec![0_i64; count];
        for (facet, &sheet) in of_facet.iter().enumerate() {
            all_sides[sheet as usize].extend(&sides[facet]);
            vertices[sheet as usize].extend(facets.polygon(facet));
            euler[sheet as usize] += 1;
        }
        let mut edges = Vec::with_capacity(count);
        for (sheet, mut sides) in all_sides.into_iter().enumerate() {
            sides.sort_unstable();
            vertices[sheet].sort_unstable();
            vertices[sheet].dedup();
            let runs = sides.chunk_by(|a, b| a == b);
            let counted: Vec<(u32, u32)> = runs.map(|run| (run[0], run.len() as u32)).collect();
            euler[sheet] += vertices[sheet].len() as i64 - counted.len() as i64;
            edges.push(counted);
        }
        let mut sheets_at_edge = vec![Vec::new(); mesh.edges.len()];
        let mut sheets_at_sphere = vec![Vec::new(); mesh.spheres.len()];
        for sheet in 0..count {
            edges[sheet].iter().for_each(|&(e, _)| sheets_at_edge[e as usize].push(sheet as u32));
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
            of_facet,
            edges,
            vertices,
            euler,
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

    /// The sheet of a facet.
    pub(crate) fn of_facet(&self, facet: usize) -> usize {
        self.of_facet[facet] as usize
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

/// Numbers the sheets by their first facet: a facet goes on over edges with two.
fn grouped(sides: &[Vec<u32>], facets_at: &[Vec<u32>]) -> Vec<u32> {
    const NONE: u32 = u32::MAX;
    let mut sheet = vec![NONE; sides.len()];
    let mut count = 0;
    for first in 0..sides.len() {
        if sheet[first] != NONE {
            continue;
        }
        sheet[first] = count;
        let mut open = vec![first];
        while let Some(facet) = open.pop() {
            for &edge in &sides[facet] {
                if let [a, b] = facets_at[edge as usize][..] {
                    for next in [a as usize, b as usize] {
                        if sheet[next] == NONE {
                            sheet[next] = count;
                            open.push(next);
                        }
                    }
                }
            }
        }
        count += 1;
    }
    sheet
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

    /// Whether removing a sheet leaves the Betti numbers as they are: it has a rim, and a seam with its
    /// own Euler characteristic.
    pub(crate) fn may_go(&self, sheet: usize) -> bool {
        let Sheets { edges, vertices, euler, .. } = self.sheets;
        // The facets of the sheet together end at an edge where an odd number of them meets.
        let is_rim = |&(edge, facets): &(u32, u32)| {
            self.at_edge[edge as usize] == 1 && !facets.is_multiple_of(2)
        };
        if self.gone[sheet] || !edges[sheet].iter().any(is_rim) {
            return false;
        }
        let seam_edges = edges[sheet].iter().filter(|e| self.at_edge[e.0 as usize] > 1).count();
        let seam_vertices =
            vertices[sheet].iter().filter(|&&v| self.at_sphere[v as usize] > 1).count();
        seam_vertices > 0 && seam_vertices as i64 - seam_edges as i64 == euler[sheet]
    }

    /// Removes a sheet without its seam; the sheets at its seam that are left, ascending.
    pub(crate) fn remove(&mut self, sheet: usize) -> Vec<usize> {
        let Sheets { edges, vertices, sheets_at_sphere, .. } = self.sheets;
        self.gone[sheet] = true;
        for &(edge, _) in &edges[sheet] {
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
