//! Step 2: the sectors around the edges of the dual complex.

use rayon::prelude::*;

use super::NONE;
use super::corners::Corners;
use crate::geometry::dual_complex::{CellEdge, Class};
use crate::geometry::triangulation::Facet;
use crate::geometry::{CellId, DualComplex};

/// A sector at the edge from ball `from` to ball `to` between two corners on their circle. The boundary
/// of the corners' facet in the sector runs counter-clockwise about the direction from the smaller corner
/// to the larger, and passes the edge in the direction from `from` to `to`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Sector {
    /// Two different corners, ascending.
    pub(super) corners: [u32; 2],
    pub(super) from: u32,
    pub(super) to: u32,
    /// Whether it is filled by tetrahedra, or is a single triangle.
    pub(super) solid: bool,
}

/// The sectors by corners.
pub(super) struct Sectors {
    sectors: Vec<Sector>,
    /// Where those with smaller corner `i` start.
    start: Vec<u32>,
}

impl Sectors {
    pub(super) fn all(&self) -> &[Sector] {
        &self.sectors
    }

    /// The sectors between two corners, in any order of the two.
    pub(super) fn between(&self, a: u32, b: u32) -> impl Iterator<Item = &Sector> {
        let (low, high) = (a.min(b) as usize, a.max(b));
        let range = match self.start.get(low..low.saturating_add(2)) {
            Some(&[from, to]) => from as usize..to as usize,
            _ => 0..0,
        };
        self.sectors[range].iter().filter(move |s| s.corners[1] == high)
    }
}

/// The sectors with two different corners at all edges with triangles.
pub(super) fn of(complex: &DualComplex<'_>, corners: &Corners) -> Sectors {
    let edges: Vec<CellEdge> =
        complex.edges().filter(|e| e.1 == Class::Regular).map(|e| e.0).collect();
    let at_edge = |walls: &mut Vec<[Facet; 2]>, &edge: &CellEdge| {
        find_walls(complex, edge, walls);
        sectors_at(complex, corners, edge, walls)
    };
    let found = edges.par_iter().with_min_len(1 << 10).map_init(Vec::new, at_edge);
    let mut sectors: Vec<Sector> = found.flatten_iter().collect();
    sectors.par_sort_unstable();
    let mut start = vec![0; corners.points().len() + 1];
    for sector in &sectors {
        start[sector.corners[0] as usize + 1] += 1;
    }
    for i in 0..corners.points().len() {
        start[i + 1] += start[i];
    }
    Sectors { sectors, start }
}

/// The triangles of the complex at an edge, in rotational order, as seen from the cells before and
/// after them.
fn find_walls(complex: &DualComplex<'_>, (cell, i, j): CellEdge, walls: &mut Vec<[Facet; 2]>) {
    walls.clear();
    let regular = complex.regular();
    let ends = complex.edge_vertices((cell, i, j));
    let ring: Vec<CellId> = regular.edge_ring(cell, i, j).collect();
    for (k, &cell) in ring.iter().enumerate() {
        let next = ring[(k + 1) % ring.len()];
        let v = regular.vertices(cell);
        let neighbours = regular.neighbours(cell);
        let leads_on =
            |&opposite: &usize| !ends.contains(&v[opposite]) && neighbours[opposite] == next;
        let Some(opposite) = (0..4).find(leads_on) else { continue };
        let before = Facet { cell, opposite };
        if complex.facet_class(before).is_some() {
            walls.push([before, regular.mirror(before)]);
        }
    }
}

/// Each gap, and each solid sector from the end of a gap to the start of the next.
fn sectors_at(
    complex: &DualComplex<'_>,
    corners: &Corners,
    edge: CellEdge,
    walls: &[[Facet; 2]],
) -> Vec<Sector> {
    let [from, to] = complex.edge_vertices(edge).map(|v| v.0);
    let is_gap = |k: &usize| !complex.contains(walls[*k][1].cell);
    let gaps: Vec<[u32; 2]> = (0..walls.len())
        .filter(is_gap)
        .map(|k| [walls[k][1], walls[(k + 1) % walls.len()][0]].map(|side| corners.at(side)))
        .collect();
    let mut sectors = Vec::with_capacity(2 * gaps.len());
    for (k, &[start, end]) in gaps.iter().enumerate() {
        let after = gaps[(k + 1) % gaps.len()][0];
        for (a, b, solid) in [(start, end, false), (end, after, true)] {
            debug_assert!(a != NONE && b != NONE, "a corner on each side of a gap");
            if a < b {
                sectors.push(Sector { corners: [a, b], from, to, solid });
            } else if a > b {
                sectors.push(Sector { corners: [b, a], from: to, to: from, solid });
            }
        }
    }
    sectors
}
