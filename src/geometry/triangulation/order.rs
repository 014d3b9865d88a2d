//! The order of insertion: biased randomized insertion order along a Hilbert curve.
//!
//! * N. Amenta, S. Choi, G. Rote: *Incremental constructions con BRIO*, SoCG 2003,
//!   <https://doi.org/10.1145/777792.777824>.
//! * C. Hamilton: *Compact Hilbert indices*, Dalhousie University CS-2006-07, 2006 (the state of
//!   the curve as an entry corner and a direction).
//!
//! 1. Points are sorted along a Hilbert curve through the cube around them. Points that share a
//!    cell of the curve's grid are sorted along a curve through their own bounding box, or
//!    lexicographically when they are few, so that clusters stay local and equal points end side by
//!    side.
//! 2. Of points at the same position one is kept.
//! 3. Each point falls into a round by a hash of its index: 7/8 of all into the last, 7/8 of the
//!    rest into the one before, and so on. Within a round the order is that of the curve.

use std::cmp::Ordering;

use rayon::prelude::*;

use crate::hash::splitmix;
use crate::predicates::{Site, lexicographic};
use crate::triangulation::{Cell, CellId, Face, Triangulation, UNUSED, VertexId};

/// Bits of a Hilbert index for each axis.
const BITS: u32 = 16;

/// Runs of equal index up to this length are sorted lexicographically.
const SHORT_RUN: usize = 24;

/// The first round has at least about this many sites.
const SMALLEST_ROUND: usize = 64;

/// For each state of the curve and each octant: the next state, and the octant's digit of the index.
const CURVE: [[(u8, u8); 8]; 24] = hilbert_states();

const fn rotate_left(x: usize, by: usize) -> usize {
    ((x << by) | (x >> (3 - by))) & 7
}

const fn trailing_ones(i: usize) -> usize {
    (!i).trailing_zeros() as usize
}

const fn hilbert_states() -> [[(u8, u8); 8]; 24] {
    let mut states = [[(0, 0); 8]; 24];
    let mut state = 0;
    while state < 24 {
        let (entry, direction) = (state / 3, state % 3);
        let mut octant = 0;
        while octant < 8 {
            let turn = (direction + 1) % 3;
            let gray = rotate_left(octant ^ entry, (3 - turn) % 3);
            // The inverse of a Gray code of three bits.
            let digit = gray ^ (gray >> 1) ^ (gray >> 2);
            // Hamilton's entry corner `e(digit)` and direction `d(digit)` of the octant's own curve.
            let corner = if digit == 0 { 0 } else { (digit - 1) / 2 * 2 };
            let corner = corner ^ (corner >> 1);
            let along = if digit == 0 {
                0
            } else if digit & 1 == 0 {
                trailing_ones(digit - 1) % 3
            } else {
                trailing_ones(digit) % 3
            };
            let next_entry = entry ^ rotate_left(corner, turn);
            let next_direction = (direction + along + 1) % 3;
            states[state][octant] = ((next_entry * 3 + next_direction) as u8, digit as u8);
            octant += 1;
        }
        state += 1;
    }
    states
}

/// The position of a grid cell on the curve.
fn hilbert_index(cell: [u32; 3]) -> u64 {
    let mut state = 0u8;
    let mut index = 0u64;
    for bit in (0..BITS).rev() {
        let octant = (cell[0] >> bit & 1) | (cell[1] >> bit & 1) << 1 | (cell[2] >> bit & 1) << 2;
        let (next, digit) = CURVE[state as usize][octant as usize];
        state = next;
        index = index << 3 | u64::from(digit);
    }
    index
}

/// The grid of the curve on the bounding cube of some sites.
struct Grid {
    low: [f64; 3],
    scale: f64,
}

impl Grid {
    fn around<'a>(sites: impl Iterator<Item = &'a Site>) -> Self {
        let mut low = [f64::INFINITY; 3];
        let mut high = [f64::NEG_INFINITY; 3];
        for s in sites {
            for k in 0..3 {
                low[k] = low[k].min(s.p[k]);
                high[k] = high[k].max(s.p[k]);
            }
        }
        // A cube, so that the curve has the same resolution along each axis.
        let side = (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max);
        let scale = f64::from((1u32 << BITS) - 1) / side;
        Self { low, scale: if scale.is_finite() { scale } else { 0.0 } }
    }

    fn index(&self, s: &Site) -> u64 {
        hilbert_index([0, 1, 2].map(|k| ((s.p[k] - self.low[k]) * self.scale) as u32))
    }
}

/// Sorts indices of sites along the curve, equal positions side by side.
fn hilbert_sort(sites: &[Site], indices: &mut [u32]) {
    let grid = Grid::around(indices.iter().map(|&i| &sites[i as usize]));
    if grid.scale == 0.0 {
        // All equal, or too close together for a grid.
        indices.sort_unstable_by(|&i, &j| by_position(sites, i, j));
        return;
    }
    // The index breaks ties, so that the unstable parallel sort has one result.
    let mut keyed: Vec<(u64, u32)> =
        indices.par_iter().map(|&i: &u32| (grid.index(&sites[i as usize]), i)).collect();
    keyed.par_sort_unstable();
    for (slot, &(_, i)) in indices.iter_mut().zip(&keyed) {
        *slot = i;
    }
    let mut start = 0;
    for run in keyed.chunk_by(|a, b| a.0 == b.0) {
        let part = &mut indices[start..start + run.len()];
        start += run.len();
        if part.len() > SHORT_RUN {
            // Ends: the box of a run shrinks by 2^16 each time, and equal points have no grid.
            hilbert_sort(sites, part);
        } else if part.len() > 1 {
            part.sort_unstable_by(|&i, &j| by_position(sites, i, j));
        }
    }
}

fn by_position(sites: &[Site], i: u32, j: u32) -> Ordering {
    lexicographic(&sites[i as usize].p, &sites[j as usize].p).then(i.cmp(&j))
}

/// Sites in the order of their insertion, and those that are not inserted.
pub(crate) struct Order {
    /// Indices of the sites to insert.
    pub(crate) inserted: Vec<u32>,
    /// The end of each round: the number of sites inserted by then plus one, since sites count
    /// from one.
    pub(crate) rounds: Vec<u32>,
    /// Pairs (site, the kept site at the same position), ascending.
    pub(crate) repeated: Vec<(u32, u32)>,
    /// For each inserted site its place along the curve.
    pub(crate) along_curve: Vec<u32>,
}

/// The order of insertion of `sites`. Of sites at the same position the one with the largest weight
/// is kept, or the first of several such.
pub(crate) fn insertion_order(sites: &[Site]) -> Order {
    let mut sorted: Vec<u32> = (0..sites.len() as u32).collect();
    hilbert_sort(sites, &mut sorted);
    let repeated = remove_repeated(sites, &mut sorted);
    let mut along_curve = vec![0; sites.len()];
    for (place, &site) in (0..).zip(&sorted) {
        along_curve[site as usize] = place;
    }
    let (inserted, rounds) = into_rounds(sorted);
    Order { inserted, rounds, repeated, along_curve }
}

fn remove_repeated(sites: &[Site], sorted: &mut Vec<u32>) -> Vec<(u32, u32)> {
    let mut repeated = Vec::new();
    let mut kept = 0;
    let mut start = 0;
    while start < sorted.len() {
        let position = sites[sorted[start] as usize].p;
        let mut end = start + 1;
        while end < sorted.len() && sites[sorted[end] as usize].p == position {
            end += 1;
        }
        let mut best = sorted[start];
        for &i in &sorted[start + 1..end] {
            let (w, best_w) = (sites[i as usize].w, sites[best as usize].w);
            if w > best_w || (w == best_w && i < best) {
                best = i;
            }
        }
        repeated.extend(sorted[start..end].iter().filter(|&&i| i != best).map(|&i| (i, best)));
        sorted[kept] = best;
        kept += 1;
        start = end;
    }
    sorted.truncate(kept);
    repeated.sort_unstable();
    repeated
}

/// Splits a sequence into rounds of growing size, each in the order of the sequence; returns also
/// where each round ends, counted from one.
fn into_rounds(sorted: Vec<u32>) -> (Vec<u32>, Vec<u32>) {
    let mut rounds = 1u32;
    while sorted.len() >> (3 * rounds) > SMALLEST_ROUND {
        rounds += 1;
    }
    if rounds == 1 {
        let end = sorted.len() as u32 + 1;
        return (sorted, vec![end]);
    }
    // Round 0 is the last: a site descends one round for every three zero bits of its hash.
    let round = |i: u32| (splitmix(u64::from(i)).trailing_zeros() / 3).min(rounds - 1);
    let mut starts = vec![0usize; rounds as usize + 1];
    for &i in &sorted {
        starts[(rounds - 1 - round(i)) as usize + 1] += 1;
    }
    for r in 0..rounds as usize {
        starts[r + 1] += starts[r];
    }
    // A stable counting sort by round: within a round the curve's order stays.
    let mut ordered = vec![0; sorted.len()];
    for &i in &sorted {
        let slot = &mut starts[(rounds - 1 - round(i)) as usize];
        ordered[*slot] = i;
        *slot += 1;
    }
    // Each start has moved to the end of its round.
    let ends = starts[..rounds as usize].iter().map(|&end| end as u32 + 1).collect();
    (ordered, ends)
}

// From a grown triangulation to its final form.
//
// 1. Finite cells come first, then infinite ones, each sorted by the vertex that is first along the
//    curve of insertion: neighbours are then close in memory, which makes walks from cell to cell
//    fast. Unused records go last and are cut off.
// 2. Neighbours are renamed to this order, and the cells brought into it.
// 3. Vertices are renamed to the indices of the input.
//
// All in place: touching fresh memory for the cells would take longer than moving them. One
// indirection per pass: chained loads would stall on cache misses.

/// The fewest cells handed to a thread at once.
const MIN_LEN: usize = 1024;

/// Cells are exchanged between about this many segments, so few that the heads of all stay in cache.
const SEGMENTS: usize = 16;

/// The fewest cells of a segment.
const SMALLEST_SEGMENT: usize = 4096;

/// Brings `cells` over sites `1..=ids.len()` into final form; `ids[s - 1]` is the input index of
/// site `s`, `along_curve[i]` the place of input point `i` on the curve.
pub(super) fn freeze(mut cells: Vec<Cell>, ids: &[u32], along_curve: &[u32]) -> Triangulation {
    let FinalOrder { places, finite, used } = order_along_curve(&cells, ids, along_curve);
    cells.par_iter_mut().with_min_len(MIN_LEN).for_each(|cell| {
        if cell.v[0] != UNUSED {
            for n in &mut cell.n {
                *n = Face::new(places[n.cell() as usize], n.index());
            }
        }
    });
    permute(&mut cells, places);
    cells.truncate(used);
    let incident = name_vertices(&mut cells, ids, along_curve.len());
    // Repeated and hidden sites have no cell.
    let vertices = incident.iter().filter(|&&c| c != CellId::NONE).count();
    Triangulation { cells, finite, vertices, incident }
}

/// The final order of the records.
struct FinalOrder {
    /// For each record its place.
    places: Vec<u32>,
    /// The number of finite cells.
    finite: usize,
    /// The number of cells; records that none uses have the places after them.
    used: usize,
}

fn order_along_curve(cells: &[Cell], ids: &[u32], along_curve: &[u32]) -> FinalOrder {
    // By vertex; the one at infinity is first of no cell.
    let places = ids.iter().map(|&id| along_curve[id as usize]);
    let curve: Vec<u32> = std::iter::once(u32::MAX).chain(places).collect();
    let points = along_curve.len();
    // Three ranges of keys in one counting sort: finite cells, infinite cells, unused records.
    let key = |cell: &Cell| {
        if cell.v[0] == UNUSED {
            return 2 * points as u32;
        }
        let [a, b, c, d] = cell.v.map(|v| curve[v as usize]);
        a.min(b).min(c.min(d)) + u32::from(cell.is_infinite()) * points as u32
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
    FinalOrder { places, finite, used }
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

/// Renames vertices from sites to input points; returns for each input point its first cell.
fn name_vertices(cells: &mut [Cell], ids: &[u32], points: usize) -> Vec<CellId> {
    // By vertex.
    let names: Vec<u32> =
        std::iter::once(VertexId::INFINITE.0).chain(ids.iter().copied()).collect();
    let mut first = vec![CellId::NONE; names.len()];
    // Backwards, so that the smallest id is written last.
    for (c, cell) in cells.iter_mut().enumerate().rev() {
        for v in &mut cell.v {
            first[*v as usize] = CellId(c as u32);
            *v = names[*v as usize];
        }
    }
    let mut incident = vec![CellId::NONE; points];
    for (&id, &cell) in ids.iter().zip(&first[1..]) {
        incident[id as usize] = cell;
    }
    incident
}

#[cfg(test)]
mod tests {
    use super::*;

    fn site(x: f64, y: f64, z: f64) -> Site {
        Site { p: [x, y, z], w: 0.0 }
    }

    #[test]
    fn the_curve_visits_neighbouring_cells() {
        let shift = BITS - 3;
        let mut cells: Vec<_> = (0..512u32)
            .map(|i| [i & 7, i >> 3 & 7, i >> 6])
            .map(|c| (hilbert_index(c.map(|x| x << shift)), c))
            .collect();
        cells.sort_unstable();
        for pair in cells.windows(2) {
            let distance: u32 = (0..3).map(|k| pair[0].1[k].abs_diff(pair[1].1[k])).sum();
            assert_eq!(distance, 1, "{pair:?}");
        }
    }

    #[test]
    fn repeated_positions_are_found_in_clusters() {
        // A far point squeezes all others into one cell of the grid.
        let mut sites = vec![site(1e9, 0.0, 0.0)];
        for i in 0..1000u32 {
            let k = f64::from(i % 250);
            sites.push(site(k * 1e-6, (k * 7.0 % 11.0) * 1e-6, 0.0));
        }
        let order = insertion_order(&sites);
        assert_eq!(order.inserted.len(), 251);
        assert_eq!(order.repeated.len(), 750);
        assert!(order.repeated.iter().all(|&(i, kept)| (i - kept) % 250 == 0 && kept <= 250));
        let mut seen = order.inserted;
        seen.extend(order.repeated.iter().map(|r| r.0));
        seen.sort_unstable();
        assert!(seen.iter().enumerate().all(|(i, &s)| i == s as usize));
    }
}
