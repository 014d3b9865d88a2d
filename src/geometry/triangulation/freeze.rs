//! From a grown triangulation to its final form.
//!
//! 1. Records that no cell uses are left out. Finite cells come first, then infinite ones, both by
//!    the vertex that is first along the curve of insertion: what is close in the triangulation is
//!    close in memory, which all that walks from cell to cell needs.
//! 2. Neighbours are renamed to this order, and vertices to the indices of the input.

use rayon::prelude::*;

use super::Triangulation;
use super::cells::{Cell, Face, INFINITE, UNUSED};
use super::{CellId, VertexId};

/// Brings `cells` over sites `1..=ids.len()` into final form; `ids[s - 1]` is the input index of
/// site `s`, and `along_curve` has for each input point its place on the curve.
pub(super) fn freeze(cells: &[Cell], ids: &[u32], along_curve: &[u32]) -> Triangulation {
    let Order { order, new, finite } = order_along_curve(cells, ids, along_curve);
    let vertex = |v: u32| match v {
        INFINITE => VertexId::INFINITE.0,
        site => ids[site as usize - 1],
    };
    let renamed = |&old: &u32| {
        let Cell { v, n } = cells[old as usize];
        let n = n.map(|face| Face::new(new[face.cell() as usize], face.index()));
        Cell { v: v.map(vertex), n }
    };
    let cells: Vec<Cell> = order.par_iter().with_min_len(1024).map(renamed).collect();
    let mut incident = vec![CellId::NONE; along_curve.len()];
    // Backwards, so that the first cell is what remains; infinite ones have the last vertex at
    // infinity.
    for (c, cell) in cells.iter().enumerate().rev() {
        for &v in &cell.v[..if c < finite { 4 } else { 3 }] {
            incident[v as usize] = CellId(c as u32);
        }
    }
    // Hidden sites have none.
    let vertices = incident.iter().filter(|&&c| c != CellId::NONE).count();
    Triangulation { cells, finite, vertices, incident }
}

/// The final order of the cells.
struct Order {
    /// The records in use.
    order: Vec<u32>,
    /// For each record its place in the order.
    new: Vec<u32>,
    /// The number of finite cells.
    finite: usize,
}

fn order_along_curve(cells: &[Cell], ids: &[u32], along_curve: &[u32]) -> Order {
    let places: Vec<u32> = ids.iter().map(|&id| along_curve[id as usize]).collect();
    let place = |&site: &u32| places[site as usize - 1];
    let points = along_curve.len();
    // Infinite cells are counted behind all finite ones.
    let key = |cell: &Cell| {
        let first = |sites: &[u32]| sites.iter().map(place).min().map_or(0, |k| k as usize);
        match (cell.v[0], cell.is_infinite()) {
            (UNUSED, _) => None,
            (_, true) => Some(points + first(&cell.v[..3])),
            (_, false) => Some(first(&cell.v)),
        }
    };
    let keys: Vec<u32> = cells
        .par_iter()
        .with_min_len(1024)
        .map(|cell| key(cell).map_or(u32::MAX, |key| key as u32))
        .collect();
    let mut next = vec![0_u32; 2 * points + 1];
    for &key in keys.iter().filter(|&&key| key != u32::MAX) {
        next[key as usize + 1] += 1;
    }
    for key in 0..2 * points {
        next[key + 1] += next[key];
    }
    let (finite, used) = (next[points] as usize, next[2 * points] as usize);
    let (mut order, mut new) = (vec![0; used], vec![u32::MAX; cells.len()]);
    for (old, &key) in keys.iter().enumerate().filter(|&(_, &key)| key != u32::MAX) {
        let place = &mut next[key as usize];
        (order[*place as usize], new[old]) = (old as u32, *place);
        *place += 1;
    }
    Order { order, new, finite }
}
