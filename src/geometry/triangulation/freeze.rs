//! From a grown triangulation to its final form.
//!
//! 1. Unused records are filled, and finite cells gathered before infinite ones, by moving cells
//!    from the end to the front; their neighbours are told.
//! 2. Vertices are renamed to the indices of the input.

use rayon::prelude::*;

use super::Triangulation;
use super::cells::{Cell, Face, INFINITE, UNUSED};
use super::{CellId, VertexId};

/// Brings `cells` over sites `1..=ids.len()` into final form; `ids[s - 1]` is the input index of
/// site `s`, and `points` the number of input points.
pub(super) fn freeze(mut cells: Vec<Cell>, ids: &[u32], points: usize) -> Triangulation {
    let used = gather(&mut cells, |cell| cell.v[0] != UNUSED);
    cells.truncate(used);
    let finite = gather(&mut cells, |cell| !cell.is_infinite());
    let rename = |v: u32| match v {
        INFINITE => VertexId::INFINITE.0,
        site => ids[site as usize - 1],
    };
    cells.par_iter_mut().for_each(|cell| cell.v = cell.v.map(rename));
    let mut incident = vec![CellId::NONE; points];
    // Backwards, so that the first cell is what remains; infinite ones have the last vertex at
    // infinity.
    for (c, cell) in cells.iter().enumerate().rev() {
        for &v in &cell.v[..if c < finite { 4 } else { 3 }] {
            incident[v as usize] = CellId(c as u32);
        }
    }
    let vertices = incident.iter().filter(|&&c| c != CellId::NONE).count();
    Triangulation { cells, finite, vertices, incident }
}

/// Exchanges cells until those that `belongs` holds for come first; returns their number.
fn gather(cells: &mut [Cell], belongs: impl Fn(&Cell) -> bool) -> usize {
    let (mut front, mut back) = (0, cells.len());
    loop {
        while front < back && belongs(&cells[front]) {
            front += 1;
        }
        while front < back && !belongs(&cells[back - 1]) {
            back -= 1;
        }
        if front == back {
            return front;
        }
        exchange(cells, front, back - 1);
    }
}

/// Exchanges two records and renames them in their neighbours.
fn exchange(cells: &mut [Cell], a: usize, b: usize) {
    for (cell, new) in [(cells[a], b), (cells[b], a)] {
        if cell.v[0] == UNUSED {
            continue;
        }
        for (i, n) in cell.n.into_iter().enumerate() {
            cells[n.cell() as usize].n[n.index()] = Face::new(new as u32, i);
        }
    }
    cells.swap(a, b);
}
