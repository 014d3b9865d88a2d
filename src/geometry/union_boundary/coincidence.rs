//! Step 2: which points are one, exactly.

use crate::geometry::dual_complex::{CellEdge, Class, DualComplex};
use crate::geometry::predicates::{Sign, orient3d, tetrahedron_size, triangle_clearance};
use crate::geometry::triangulation::{CellId, Facet, VertexId};

/// Pairs of vertices at the ends of arcs of length zero.
///
/// `sides` holds for each facet with a vertex on the side of its cell the index of the vertex.
pub(super) fn coincident(complex: &DualComplex<'_>, mut sides: Vec<(Facet, u32)>) -> Vec<[u32; 2]> {
    sides.sort_unstable();
    let vertex_at = |facet: Facet| {
        let found = sides.binary_search_by_key(&facet, |s| s.0).ok()?;
        Some(sides[found].1)
    };
    let mut pairs = Vec::new();
    let mut walls = Vec::new();
    for (edge, _) in complex.edges().filter(|e| e.1 == Class::Regular) {
        find_walls(complex, edge, &mut walls);
        for k in 0..walls.len() {
            let (start, end) = (walls[k].after, walls[(k + 1) % walls.len()].before);
            if walls.len() < 2 || complex.contains(start.cell) || !is_point(complex, start, end) {
                continue;
            }
            if let (Some(a), Some(b)) = (vertex_at(start), vertex_at(end))
                && a != b
            {
                pairs.push([a.min(b), a.max(b)]);
            }
        }
    }
    pairs.sort_unstable();
    pairs.dedup();
    pairs
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
    let [p, q, r] = f.map(|v| regular.point(v));
    if orient3d(p, q, r, regular.point(d)) == Sign::Zero {
        return triangle_clearance(sites(f), regular.site(d)) == Sign::Zero;
    }
    let [s, t, u] = sites(f);
    // The orthocentre of all four is on a triangle's side of the fourth if the clearance from that
    // is positive, and in its plane if that is zero.
    let is_on_gap_side = |triangle: [VertexId; 3], fourth: VertexId| {
        let [p, q, r] = triangle.map(|v| regular.point(v));
        let clearance = triangle_clearance(sites(triangle), regular.site(fourth));
        clearance == Sign::Zero || clearance == orient3d(p, q, r, regular.point(fourth))
    };
    tetrahedron_size([s, t, u, regular.site(d)]) == Sign::Zero
        && is_on_gap_side(f, d)
        && is_on_gap_side(g, c)
}
