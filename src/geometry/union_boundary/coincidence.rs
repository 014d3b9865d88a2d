//! Step 2: the points that coincide, decided exactly.

use rayon::prelude::*;

use crate::dual_complex::{CellEdge, Class, DualComplex};
use crate::predicates::{Sign, orient3d, tetrahedron_size, triangle_clearance};
use crate::triangulation::{CellId, Facet, VertexId};

/// Pairs of vertices at the ends of arcs of length zero.
///
/// `sides` holds for each facet with a vertex on the side of its cell the index of the vertex.
pub(super) fn coincident(complex: &DualComplex<'_>, mut sides: Vec<(Facet, u32)>) -> Vec<[u32; 2]> {
    let cells = (0..complex.regular().finite_cell_count() as u32).into_par_iter();
    let of_cell = |walls: &mut Vec<Wall>, cell| {
        let mut points = Vec::new();
        for (edge, _) in complex.edges_of(CellId(cell)).filter(|e| e.1 == Class::Regular) {
            find_walls(complex, edge, walls);
            points.extend(arcs(complex, walls).filter(|&[a, b]| is_point(complex, a, b)));
        }
        points
    };
    let points: Vec<[Facet; 2]> =
        cells.with_min_len(1 << 10).map_init(Vec::new, of_cell).flatten_iter().collect();
    if points.is_empty() {
        return Vec::new();
    }
    sides.sort_unstable();
    let vertex_at = |facet: Facet| {
        let found = sides.binary_search_by_key(&facet, |s| s.0).ok()?;
        Some(sides[found].1)
    };
    let ends = points.into_iter().filter_map(|[a, b]| Some([vertex_at(a)?, vertex_at(b)?]));
    let mut pairs: Vec<[u32; 2]> =
        ends.filter(|[a, b]| a != b).map(|[a, b]| [a.min(b), a.max(b)]).collect();
    pairs.sort_unstable();
    pairs.dedup();
    pairs
}

/// The gaps between two different triangles at an edge, as these triangles seen from the gap.
fn arcs<'a>(
    complex: &'a DualComplex<'_>,
    walls: &'a [Wall],
) -> impl Iterator<Item = [Facet; 2]> + 'a {
    let pairs = (0..walls.len()).map(|k| [walls[k].after, walls[(k + 1) % walls.len()].before]);
    pairs.filter(|[start, _]| walls.len() > 1 && !complex.contains(start.cell))
}

/// A triangle of the complex at an edge, as seen from the two cells that it separates.
struct Wall {
    before: Facet,
    after: Facet,
}

/// The triangles of the complex at an edge, in rotational order.
fn find_walls(complex: &DualComplex<'_>, (cell, i, j): CellEdge, walls: &mut Vec<Wall>) {
    walls.clear();
    let regular = complex.regular();
    let ends = complex.edge_vertices((cell, i, j));
    let ring: Vec<CellId> = regular.edge_ring(cell, i, j).collect();
    for (k, &cell) in ring.iter().enumerate() {
        let next = ring[(k + 1) % ring.len()];
        let v = regular.vertices(cell);
        let leads_on = |opposite: &usize| {
            !ends.contains(&v[*opposite]) && regular.neighbours(cell)[*opposite] == next
        };
        let Some(opposite) = (0..4).find(leads_on) else { continue };
        let before = Facet { cell, opposite };
        if complex.facet_class(before).is_some() {
            walls.push(Wall { before, after: regular.mirror(before) });
        }
    }
}

/// Whether the arc of the gap between two triangles, both seen from cells in the gap, is a point.
fn is_point(complex: &DualComplex<'_>, start: Facet, end: Facet) -> bool {
    let regular = complex.regular();
    // Counter-clockwise as seen from the gap.
    let [f, g] = [start, end].map(|side| regular.facet_vertices(regular.mirror(side)));
    let apex =
        |of: [VertexId; 3], other: [VertexId; 3]| of.into_iter().find(|v| !other.contains(v));
    let (Some(c), Some(d)) = (apex(f, g), apex(g, f)) else { return false };
    let sites = |t: [VertexId; 3]| t.map(|v| regular.site(v));
    let [s, t, u] = sites(f);
    // For coplanar centres this is zero if and only if the four balls have a point of equal powers,
    // so that the points of both triangles coincide.
    if tetrahedron_size([s, t, u, regular.site(d)]) != Sign::Zero {
        return false;
    }
    // A positive clearance from the fourth ball puts the orthocentre of all four on the fourth's side
    // of the triangle, a clearance of zero in its plane.
    let is_on_gap_side = |triangle: [VertexId; 3], fourth: VertexId| {
        let [p, q, r] = triangle.map(|v| regular.point(v));
        let clearance = triangle_clearance(sites(triangle), regular.site(fourth));
        let side = orient3d(p, q, r, regular.point(fourth));
        clearance == Sign::Zero || side == Sign::Zero || clearance == side
    };
    is_on_gap_side(f, d) && is_on_gap_side(g, c)
}
