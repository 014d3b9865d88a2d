//! Steps 1 to 4: the classes of all simplices.

use std::borrow::Cow;

use rayon::prelude::*;

use super::{Class, DualComplex, PAIRS};
use crate::Regular;
use crate::predicates::{
    Sign, Site, edge_clearance, edge_size, tetrahedron_size, triangle_clearance, triangle_size,
    vertex_clearance,
};
use crate::triangulation::{CellId, Facet, VertexId};

/// The fewest cells handed to a thread at once.
const GRAIN: usize = 1 << 10;

/// Classifies the simplices of a triangulation of `balls` balls and anchors.
pub(super) fn build(regular: Cow<'_, Regular>, balls: usize) -> DualComplex<'_> {
    let cells = tetrahedra(&regular);
    let facets = triangles(&regular, &cells);
    let edges = edges(&regular, &cells, &facets);
    let vertices = vertices(&regular, &cells, &edges);
    DualComplex { regular, balls, cells, facets, edges, vertices }
}

/// The sites of the finite ones among vertices.
fn sites<const N: usize>(regular: &Regular, v: [VertexId; N]) -> [&Site; N] {
    v.map(|v| regular.site(v))
}

/// Step 1: for each finite cell whether it is in the complex.
fn tetrahedra(regular: &Regular) -> Vec<bool> {
    let cells = (0..regular.finite_cell_count() as u32).into_par_iter().with_min_len(GRAIN);
    let member =
        |c| tetrahedron_size(sites(regular, regular.vertices(CellId(c)))) != Sign::Positive;
    cells.map(member).collect()
}

/// Step 2: two bits for each facet of each cell, the same from both sides.
fn triangles(regular: &Regular, cells: &[bool]) -> Vec<u8> {
    let is_in = |c: CellId| cells.get(c.index()).is_some_and(|&c| c);
    // Computed once, at the cell with the smaller id, then copied to the other.
    let ids = || (0..regular.cell_count() as u32).into_par_iter().with_min_len(GRAIN);
    let first = |c| {
        let cell = CellId(c);
        let facets = (0..4).map(|opposite| Facet { cell, opposite });
        facets.fold(0, |bits, facet| {
            let mirror = regular.mirror(facet);
            if mirror.cell < cell || regular.is_infinite(cell) {
                return bits;
            }
            let class = match (is_in(cell), is_in(mirror.cell)) {
                (true, true) => Class::Interior as u8,
                (false, false) => u8::from(is_singular_triangle(regular, facet, mirror)),
                _ => Class::Regular as u8,
            };
            bits | class << (2 * facet.opposite)
        })
    };
    let own: Vec<u8> = ids().map(first).collect();
    let both = |c: u32| {
        let cell = CellId(c);
        let facets = (0..4).map(|opposite| Facet { cell, opposite });
        facets.fold(own[cell.index()], |bits, facet| {
            let mirror = regular.mirror(facet);
            let seen = own[mirror.cell.index()] >> (2 * mirror.opposite) & 3;
            bits | seen << (2 * facet.opposite)
        })
    };
    ids().map(both).collect()
}

/// Whether a triangle without cofaces in the complex is in it.
fn is_singular_triangle(regular: &Regular, facet: Facet, mirror: Facet) -> bool {
    let triangle = sites(regular, regular.facet_vertices(facet));
    let is_clear = |f: Facet| {
        let v = regular.vertices(f.cell)[f.opposite];
        v == VertexId::INFINITE || triangle_clearance(triangle, regular.site(v)) != Sign::Negative
    };
    triangle_size(triangle) != Sign::Positive && is_clear(facet) && is_clear(mirror)
}

/// Indexed by the set of vertices across whose opposite facets lie later cells: the pairs, as bits,
/// whose edge has later cells on both sides.
const FIRST_AT: [u8; 16] = {
    let mut table = [0; 16];
    let mut later = 0;
    while later < 16 {
        let mut k = 0;
        while k < 6 {
            let others = 15 & !(1 << PAIRS[k].0 | 1 << PAIRS[k].1);
            if later & others == others {
                table[later] |= 1 << k;
            }
            k += 1;
        }
        later += 1;
    }
    table
};

/// Step 3 for edges: two bits for each edge of each finite cell that is its first.
fn edges(regular: &Regular, cells: &[bool], facets: &[u8]) -> Vec<u16> {
    let ids = (0..regular.finite_cell_count() as u32).into_par_iter().with_min_len(GRAIN);
    let of_cell = |ring: &mut Vec<CellId>, c| {
        let cell = CellId(c);
        let v = regular.vertices(cell);
        // Two neighbours of the cell are at the edge. They are in the cell's own record and show, for
        // two thirds of the edges, that the cell is not the first. The table spares a branch per edge.
        let neighbours = regular.neighbours(cell);
        let later = (0..4).fold(0, |bits, n| bits | usize::from(neighbours[n] > cell) << n);
        let mut candidates = FIRST_AT[later];
        let mut bits = 0;
        while candidates != 0 {
            let k = candidates.trailing_zeros() as usize;
            candidates &= candidates - 1;
            let (i, j) = PAIRS[k];
            ring.clear();
            let is_first = regular.edge_ring(cell, i, j).all(|other| {
                ring.push(other);
                other >= cell
            });
            if is_first {
                let class = edge_class(regular, cells, facets, [v[i], v[j]], ring);
                bits |= u16::from(class) << (2 * k);
            }
        }
        bits
    };
    ids.map_init(Vec::new, of_cell).collect()
}

/// The class of the edge with these cells around it, zero if it is not in the complex.
fn edge_class(
    regular: &Regular,
    cells: &[bool],
    facets: &[u8],
    ends: [VertexId; 2],
    ring: &[CellId],
) -> u8 {
    let members = ring.iter().filter(|c| cells.get(c.index()).is_some_and(|&c| c)).count();
    if members == ring.len() {
        return Class::Interior as u8;
    }
    if members > 0 {
        return Class::Regular as u8;
    }
    // The cell's two vertices off the edge: the facets opposite to them contain the edge.
    let others = |cell: CellId| {
        let v = regular.vertices(cell);
        (0..4).filter(move |&k| !ends.contains(&v[k])).map(move |k| (k, v[k]))
    };
    let has_triangle = |&c: &CellId| {
        facets[c.index()] != 0 && others(c).any(|(k, _)| facets[c.index()] >> (2 * k) & 3 != 0)
    };
    if ring.iter().any(has_triangle) {
        return Class::Regular as u8;
    }
    let edge = sites(regular, ends);
    let is_clear = |v: VertexId| {
        v == VertexId::INFINITE || edge_clearance(edge, regular.site(v)) != Sign::Negative
    };
    let is_in = edge_size(edge) != Sign::Positive
        && ring.iter().all(|&c| others(c).all(|(_, v)| is_clear(v)));
    if is_in { Class::Singular as u8 } else { 0 }
}

/// Step 3 for vertices: the class of each point, zero if it is not in the complex.
fn vertices(regular: &Regular, cells: &[bool], edges: &[u16]) -> Vec<u8> {
    let mut class = vec![0; regular.point_count()];
    for (c, &bits) in edges.iter().enumerate().filter(|e| *e.1 != 0) {
        let v = regular.vertices(CellId(c as u32));
        for (k, (i, j)) in PAIRS.into_iter().enumerate() {
            if bits >> (2 * k) & 3 != 0 {
                class[v[i].index()] = Class::Interior as u8;
                class[v[j].index()] = Class::Interior as u8;
            }
        }
    }
    for cell in regular.cells().filter(|c| !cells.get(c.index()).is_some_and(|&c| c)) {
        for v in regular.vertices(cell).into_iter().filter(|&v| v != VertexId::INFINITE) {
            let class = &mut class[v.index()];
            *class = (*class).min(Class::Regular as u8);
        }
    }
    let is_candidate = |v: usize| {
        let id = VertexId(v as u32);
        class[v] == 0 && regular.is_vertex(id) && regular.site(id).w >= 0.0
    };
    let isolated: Vec<bool> = (0..class.len()).map(is_candidate).collect();
    if isolated.contains(&true) {
        let mut clear = isolated;
        for v in attached(regular, &clear) {
            clear[v as usize] = false;
        }
        for (class, _) in class.iter_mut().zip(clear).filter(|(_, clear)| *clear) {
            *class = Class::Singular as u8;
        }
    }
    class
}

/// The given vertices that are attached to a neighbour, in unspecified order, with repetitions.
fn attached(regular: &Regular, isolated: &[bool]) -> Vec<u32> {
    let cells = (0..regular.finite_cell_count() as u32).into_par_iter().with_min_len(GRAIN);
    let of_cell = |c| {
        let v = regular.vertices(CellId(c));
        let pairs = PAIRS.into_iter().flat_map(|(i, j)| [(i, j), (j, i)]);
        pairs.filter_map(move |(i, j)| {
            let negative = isolated[v[i].index()]
                && vertex_clearance(regular.site(v[i]), regular.site(v[j])) == Sign::Negative;
            negative.then_some(v[i].0)
        })
    };
    cells.flat_map_iter(of_cell).collect()
}
