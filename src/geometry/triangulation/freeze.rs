//! From a grown triangulation to its canonical form.
//!
//! The set of cells is unique; their order is made so, too, for the result not to depend on the
//! history of construction:
//!
//! 1. The vertices of each cell are put in descending order of insertion, the second and third
//!    swapped if that is needed to keep the cell positive.
//! 2. Finite cells come before infinite ones, each sorted by their vertices. Since insertion
//!    follows a curve through space, neighbours mostly stay close together in memory.
//! 3. Vertices are renamed to the indices of the input.

use super::Triangulation;
use super::cells::{Cell, Face, INFINITE, UNUSED};
use super::{CellId, VertexId};

/// Brings `cells` over sites `1..=ids.len()` into canonical form; `ids[s - 1]` is the input index
/// of site `s`, and `points` the number of input points.
pub(super) fn freeze(mut cells: Vec<Cell>, ids: &[u32], points: usize) -> Triangulation {
    canonical_vertices(&mut cells);
    let (finite, mut rank) = canonical_ranks(&cells, ids.len());
    permute(&mut cells, &mut rank);
    let mut incident = vec![CellId::NONE; points];
    for (c, cell) in cells.iter_mut().enumerate() {
        for v in &mut cell.v {
            if *v == INFINITE {
                *v = VertexId::INFINITE.0;
                continue;
            }
            *v = ids[*v as usize - 1];
            let first = &mut incident[*v as usize];
            if *first == CellId::NONE {
                *first = CellId(c as u32);
            }
        }
    }
    let vertices = incident.iter().filter(|&&c| c != CellId::NONE).count();
    Triangulation { cells, finite, vertices, incident }
}

/// Step 1.
fn canonical_vertices(cells: &mut [Cell]) {
    for c in 0..cells.len() {
        let old = cells[c];
        if old.v[0] == UNUSED {
            continue;
        }
        let mut order = [0, 1, 2, 3];
        let mut odd = false;
        // Insertion sort that counts its exchanges.
        for i in 1..4 {
            let mut j = i;
            while j > 0 && old.v[order[j - 1]] < old.v[order[j]] {
                order.swap(j - 1, j);
                odd = !odd;
                j -= 1;
            }
        }
        if odd {
            order.swap(1, 2);
        }
        if order == [0, 1, 2, 3] {
            continue;
        }
        cells[c] = Cell { v: order.map(|k| old.v[k]), n: order.map(|k| old.n[k]) };
        for (slot, k) in order.into_iter().enumerate() {
            let back = old.n[k];
            cells[back.cell() as usize].n[back.index()] = Face::new(c as u32, slot);
        }
    }
}

/// The number of finite cells, and the place of each cell; unused records have the place
/// [`UNUSED`].
fn canonical_ranks(cells: &[Cell], sites: usize) -> (usize, Vec<u32>) {
    // One bucket for each newest vertex of finite cells, then one for each of infinite cells.
    let bucket = |cell: &Cell| cell.v[0] as usize + if cell.is_infinite() { sites + 1 } else { 0 };
    let mut starts = vec![0u32; 2 * (sites + 1) + 1];
    for cell in cells.iter().filter(|c| c.v[0] != UNUSED) {
        starts[bucket(cell) + 1] += 1;
    }
    for b in 1..starts.len() {
        starts[b] += starts[b - 1];
    }
    let finite = starts[sites + 1] as usize;
    let used = *starts.last().unwrap_or(&0) as usize;
    let mut sorted = vec![0u32; used];
    for (c, cell) in cells.iter().enumerate().filter(|(_, cell)| cell.v[0] != UNUSED) {
        let start = &mut starts[bucket(cell)];
        sorted[*start as usize] = c as u32;
        *start += 1;
    }
    // Every start has moved to the end of its bucket.
    let mut begin = 0;
    for &end in &starts[..starts.len() - 1] {
        sorted[begin..end as usize].sort_unstable_by_key(|&c| cells[c as usize].v);
        begin = end as usize;
    }
    let mut rank = vec![UNUSED; cells.len()];
    for (place, &c) in sorted.iter().enumerate() {
        rank[c as usize] = place as u32;
    }
    (finite, rank)
}

/// Moves every cell to its place, in place, and renames neighbours.
fn permute(cells: &mut Vec<Cell>, rank: &mut [u32]) {
    let mut used = 0;
    for c in 0..cells.len() {
        if rank[c] == UNUSED {
            continue;
        }
        used += 1;
        for n in &mut cells[c].n {
            *n = Face::new(rank[n.cell() as usize], n.index());
        }
    }
    for c in 0..cells.len() {
        // Follow the cycle: what is displaced moves on, until an unused record is filled.
        while rank[c] != UNUSED && rank[c] as usize != c {
            let place = rank[c] as usize;
            cells.swap(c, place);
            rank.swap(c, place);
        }
    }
    cells.truncate(used);
    cells.shrink_to_fit();
}
