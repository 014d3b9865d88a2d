//! Cells around vertices.

use std::collections::{HashMap, HashSet};
use std::hash::BuildHasherDefault;

use crate::geometry::hash::KeyHasher;
use crate::geometry::triangulation::Triangulation;
use crate::geometry::{CellId, Delaunay, VertexId};

/// Number of cells around a vertex, or of comparisons with them, from which a list is sorted.
const LARGE: usize = 64;

/// The cells around a vertex, infinite ones included, in the order of a search from its first.
pub(super) fn star(triangulation: &Triangulation, vertex: u32) -> Vec<CellId> {
    star_while(triangulation, vertex, |_| true)
}

/// The same up to the first cell that fails a test, with that cell.
pub(super) fn star_while(
    triangulation: &Triangulation,
    vertex: u32,
    test: impl Fn(CellId) -> bool,
) -> Vec<CellId> {
    let vertex = VertexId(vertex);
    let mut star: Vec<CellId> = triangulation.incident_cell(vertex).into_iter().collect();
    // Most stars are small, and a list is the fastest set.
    let mut seen: HashSet<u64, BuildHasherDefault<KeyHasher>> = HashSet::default();
    let mut next = 0;
    while next < star.len() {
        let cell = star[next];
        next += 1;
        if !test(cell) {
            star.truncate(next);
            break;
        }
        let (v, n) = (triangulation.vertices(cell), triangulation.neighbours(cell));
        for k in 0..4 {
            // Beyond every facet that has the vertex.
            if v[k] == vertex {
                continue;
            }
            let is_new = match star.len() {
                0..LARGE => !star.contains(&n[k]),
                _ => {
                    if seen.is_empty() {
                        seen.extend(star.iter().map(|cell| u64::from(cell.0)));
                    }
                    seen.insert(n[k].0.into())
                }
            };
            if is_new {
                star.push(n[k]);
            }
        }
    }
    star
}

/// Whether one of some cells has all of these corners.
fn any_has<const N: usize>(delaunay: &Delaunay, cells: &[CellId], corners: [u32; N]) -> bool {
    cells.iter().any(|&cell| {
        let own = delaunay.vertices(cell);
        corners.iter().all(|&corner| own.contains(&VertexId(corner)))
    })
}

/// The edges opposite a vertex in the facets around it, sorted, from the cells around it.
fn links(delaunay: &Delaunay, vertex: u32, star: &[CellId]) -> Vec<[u32; 2]> {
    let of_cell = |&cell: &CellId| {
        let v = delaunay.vertices(cell).map(|v| v.0);
        let [a, b, c] = std::array::from_fn(|k| v[k + usize::from(v[..=k].contains(&vertex))]);
        [[a, b], [a, c], [b, c]].map(|[a, b]| [a.min(b), a.max(b)])
    };
    let mut links: Vec<[u32; 2]> = star.iter().flat_map(of_cell).collect();
    links.sort_unstable();
    links.dedup();
    links
}

/// Those among some triangles with a corner in common that are no facets.
pub(super) fn missing_around(
    delaunay: &Delaunay,
    vertex: u32,
    triangles: impl ExactSizeIterator<Item = (u32, [u32; 3])>,
) -> Vec<u32> {
    let star = star(delaunay, vertex);
    let links = match triangles.len() * star.len() {
        0..LARGE => None,
        _ => Some(links(delaunay, vertex, &star)),
    };
    let is_missing = |corners: [u32; 3]| match &links {
        None => !any_has(delaunay, &star, corners),
        Some(links) => {
            let k = corners.iter().position(|&v| v == vertex).expect("a common corner");
            let [a, b] = [corners[(k + 1) % 3], corners[(k + 2) % 3]];
            links.binary_search(&[a.min(b), a.max(b)]).is_err()
        }
    };
    triangles.filter(|&(_, corners)| is_missing(corners)).map(|(t, _)| t).collect()
}

/// The cells around vertices of a triangulation, each searched once.
pub(super) struct Stars<'d> {
    pub delaunay: &'d Delaunay,
    /// Looked up, never iterated.
    known: HashMap<u32, Star>,
}

struct Star {
    cells: Vec<CellId>,
    /// Of many cells the vertices, sorted.
    neighbours: Vec<VertexId>,
}

impl<'d> Stars<'d> {
    pub fn of(delaunay: &'d Delaunay) -> Self {
        Self { delaunay, known: HashMap::new() }
    }

    pub fn around(&mut self, vertex: u32) -> &[CellId] {
        &self.star(vertex).cells
    }

    fn star(&mut self, vertex: u32) -> &Star {
        let delaunay = self.delaunay;
        self.known.entry(vertex).or_insert_with(|| {
            let cells = star(delaunay, vertex);
            let mut neighbours = Vec::new();
            if cells.len() >= LARGE {
                neighbours.extend(cells.iter().flat_map(|&cell| delaunay.vertices(cell)));
                neighbours.sort_unstable();
                neighbours.dedup();
            }
            Star { cells, neighbours }
        })
    }

    pub fn has_facet(&mut self, corners: [u32; 3]) -> bool {
        let delaunay = self.delaunay;
        any_has(delaunay, self.around(corners[0]), corners)
    }

    pub fn has_edge(&mut self, [a, b]: [u32; 2]) -> bool {
        let delaunay = self.delaunay;
        let Star { cells, neighbours } = self.star(a);
        match neighbours.is_empty() {
            true => any_has(delaunay, cells, [b]),
            false => neighbours.binary_search(&VertexId(b)).is_ok(),
        }
    }
}
