//! Cells around vertices.

use std::collections::{HashMap, HashSet};

use crate::geometry::triangulation::Triangulation;
use crate::geometry::{CellId, Delaunay, VertexId};

/// The cells around a vertex, infinite ones included, in the order of a search from its first.
pub(super) fn star(triangulation: &Triangulation, vertex: u32) -> Vec<CellId> {
    let vertex = VertexId(vertex);
    let mut star: Vec<CellId> = triangulation.incident_cell(vertex).into_iter().collect();
    // Most stars are small, and a list is the fastest set.
    let mut seen: HashSet<CellId> = HashSet::new();
    let mut next = 0;
    while next < star.len() {
        let cell = star[next];
        next += 1;
        let (v, n) = (triangulation.vertices(cell), triangulation.neighbours(cell));
        for k in 0..4 {
            // Beyond every facet that has the vertex.
            if v[k] == vertex {
                continue;
            }
            let is_new = match star.len() {
                0..64 => !star.contains(&n[k]),
                _ => {
                    if seen.is_empty() {
                        seen.extend(&star);
                    }
                    seen.insert(n[k])
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
pub(super) fn any_has<const N: usize>(
    delaunay: &Delaunay,
    cells: &[CellId],
    corners: [u32; N],
) -> bool {
    cells.iter().any(|&cell| {
        let own = delaunay.vertices(cell);
        corners.iter().all(|&corner| own.contains(&VertexId(corner)))
    })
}

/// The cells around vertices of a triangulation, each searched once.
pub(super) struct Stars<'d> {
    pub delaunay: &'d Delaunay,
    /// Looked up, never iterated.
    known: HashMap<u32, Vec<CellId>>,
}

impl<'d> Stars<'d> {
    pub fn of(delaunay: &'d Delaunay) -> Self {
        Self { delaunay, known: HashMap::new() }
    }

    pub fn around(&mut self, vertex: u32) -> &[CellId] {
        self.known.entry(vertex).or_insert_with(|| star(self.delaunay, vertex))
    }

    pub fn has_facet(&mut self, corners: [u32; 3]) -> bool {
        let delaunay = self.delaunay;
        any_has(delaunay, self.around(corners[0]), corners)
    }

    pub fn has_edge(&mut self, [a, b]: [u32; 2]) -> bool {
        let delaunay = self.delaunay;
        any_has(delaunay, self.around(a), [b])
    }
}
