//! From a grown triangulation to its final form.
//!
//! 1. Finite cells come first, then infinite ones, each sorted by the vertex that is first along the
//!    curve of insertion: neighbours are then close in memory, which makes walks from cell to cell
//!    fast. Unused records go last and are cut off.
//! 2. Neighbours are renamed to this order, and the cells brought into it.
//! 3. Vertices are renamed to the indices of the input.
//!
//! All in place: touching fresh memory for the cells would take longer than moving them. One
//! indirection per pass: chained loads would stall on cache misses.

use rayon::prelude::*;

use super::Triangulation;
use super::cells::{Cell, Face, INFINITE, UNUSED};
use super::{CellId, VertexId};

/// The fewest cells handed to a thread at once.
const MIN_LEN: usize = 1024;

/// Cells are exchanged between about this many segments, so few that the heads of all stay in cache.
const SEGMENTS: usize = 16;

/// The fewest cells of a segment.
const SMALLEST_SEGMENT: usize = 4096;

/// Brings `cells` over sites `1..=ids.len()` into final form; `ids[s - 1]` is the input index of
/// site `s`, `along_curve[i]` the place of input point `i` on the curve.
pub(super) fn freeze(mut cells: Vec<Cell>, ids: &[u32], along_curve: &[u32]) -> Triangulation {
    let Order { places, finite, used } = order_along_curve(&cells, ids, along_curve);
    cells.par_iter_mut().with_min_len(MIN_LEN).for_each(|cell| {
        if cell.v[0] != UNUSED {
            for n in &mut cell.n {
                *n = Face::new(places[n.cell() as usize], n.index());
            }
        }
    });
    permute(&mut cells, places);
    cells.truncate(used);
    let incident = first_cells(&cells, ids, along_curve.len());
    cells.par_iter_mut().with_min_len(MIN_LEN).for_each(|cell| {
        for v in &mut cell.v {
            *v = if *v == INFINITE { VertexId::INFINITE.0 } else { ids[*v as usize - 1] };
        }
    });
    // Repeated and hidden sites have no cell.
    let vertices = incident.iter().filter(|&&c| c != CellId::NONE).count();
    Triangulation { cells, finite, vertices, incident }
}

/// The final order of the records.
struct Order {
    /// For each record its place.
    places: Vec<u32>,
    /// The number of finite cells.
    finite: usize,
    /// The number of cells; records that none uses have the places after them.
    used: usize,
}

fn order_along_curve(cells: &[Cell], ids: &[u32], along_curve: &[u32]) -> Order {
    let curve: Vec<u32> = ids.iter().map(|&id| along_curve[id as usize]).collect();
    let on_curve = |&site: &u32| curve[site as usize - 1];
    let points = along_curve.len();
    let first = |sites: &[u32]| sites.iter().map(on_curve).min().unwrap_or(0);
    // Three ranges of keys in one counting sort: finite cells, infinite cells, unused records.
    let key = |cell: &Cell| match (cell.v[0], cell.is_infinite()) {
        (UNUSED, _) => 2 * points as u32,
        (_, true) => points as u32 + first(&cell.v[..3]),
        (_, false) => first(&cell.v),
    };
    let mut places: Vec<u32> = cells.par_iter().with_min_len(MIN_LEN).map(key).collect();
    // Counting sort: linear, and stable, so equal keys keep the order of the records.
    let mut next = vec![0_u32; 2 * points + 2];
    for &key in &places {
        next[key as usize + 1] += 1;
    }
    for key in 0..=2 * points {
        next[key + 1] += next[key];
    }
    let (finite, used) = (next[points] as usize, next[2 * points] as usize);
    for place in &mut places {
        let next = &mut next[*place as usize];
        *place = *next;
        *next += 1;
    }
    Order { places, finite, used }
}

/// Brings each cell to its place: first by exchanges into the right segment, then, inside the
/// segment, through a copy of it.
///
/// P. M. McIlroy, K. Bostic, M. D. McIlroy: *Engineering radix sort*, Computing Systems 6 (1993)
/// (*American flag sort*).
fn permute(cells: &mut [Cell], mut places: Vec<u32>) {
    let size = (cells.len() / SEGMENTS).next_power_of_two().max(SMALLEST_SEGMENT);
    exchange(cells, &mut places, size);
    // One run of segments per thread, so that each thread allocates one copy.
    let each = cells.len().div_ceil(size) / rayon::current_num_threads();
    let segments = cells.par_chunks_mut(size).zip(places.par_chunks(size));
    segments.with_min_len(each.max(1)).for_each_init(Vec::new, |copy, (cells, places)| {
        copy.clear();
        copy.extend_from_slice(cells);
        for (cell, &place) in copy.iter().zip(places) {
            cells[place as usize & (size - 1)] = *cell;
        }
    });
}

/// Exchanges cells until each is in its segment. A segment has `size` places, a power of two.
fn exchange(cells: &mut [Cell], places: &mut [u32], size: usize) {
    let segment = |place: u32| place as usize >> size.trailing_zeros();
    // Invariant: every cell of a segment before its head belongs there.
    let mut heads: Vec<usize> = (0..cells.len()).step_by(size).collect();
    for s in 0..heads.len() {
        let end = cells.len().min((s + 1) * size);
        while heads[s] < end {
            let (mut cell, mut place) = (cells[heads[s]], places[heads[s]]);
            // Follow the cycle: each swap settles one cell, so all swaps together are linear.
            while segment(place) != s {
                let head = &mut heads[segment(place)];
                std::mem::swap(&mut cell, &mut cells[*head]);
                std::mem::swap(&mut place, &mut places[*head]);
                *head += 1;
            }
            (cells[heads[s]], places[heads[s]]) = (cell, place);
            heads[s] += 1;
        }
    }
}

/// For each input point its first cell.
fn first_cells(cells: &[Cell], ids: &[u32], points: usize) -> Vec<CellId> {
    // By site; entry 0 is the vertex at infinity. Backwards, so that the smallest id is written last.
    let mut first = vec![CellId::NONE; ids.len() + 1];
    for (c, cell) in cells.iter().enumerate().rev() {
        for v in cell.v {
            first[v as usize] = CellId(c as u32);
        }
    }
    let mut incident = vec![CellId::NONE; points];
    for (&id, &cell) in ids.iter().zip(&first[1..]) {
        incident[id as usize] = cell;
    }
    incident
}
