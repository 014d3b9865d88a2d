//! Step 3 of the construction (`build.rs`): the conflict zone of a site, and its walls.

use super::build::Builder;
use super::cells::{Cell, FRONTIER, Face, INFINITE, OPPOSITE};
use super::stellate::ABSENT;
use crate::predicates::{Filter, Metric, Sign, Site, UNDERFLOW, in_conflict_given};

/// Mark of a cell that the growing conflict zone has not met.
pub(super) const UNKNOWN: u8 = 0;
/// Mark of a cell that was tested, or is about to be: bit 0.
pub(super) const TESTED: u8 = 1;
/// Mark of a cell in conflict: bit 1, always together with that of [`TESTED`].
pub(super) const CONFLICT: u8 = 3;

/// Mark of the frontier: bit 2, together with that of [`TESTED`] so that it is never tested.
pub(super) const FOREIGN: u8 = 5;

/// A facet of the boundary of the conflict zone: its vertices, counter-clockwise from outside, and
/// the facet as a face of the cell outside.
#[derive(Clone, Copy)]
pub(super) struct Wall {
    pub(super) v: [u32; 3],
    pub(super) outside: Face,
    /// The vertices' numbers among the vertices of all walls.
    pub(super) local: [u8; 3],
}

/// A cell beside the conflict zone, with the determinant that decides whether it joins the zone
/// and the error bound of that determinant.
#[derive(Clone, Copy)]
pub(super) struct Candidate {
    pub(super) cell: u32,
    pub(super) det: f64,
    pub(super) bound: f64,
}

impl<M: Metric> Builder<'_, M> {
    #[inline(always)]
    pub(super) fn conflicts(&self, cell: u32, vertex: u32) -> bool {
        let site = &self.sites[vertex as usize];
        let (det, bound) = determinant::<M>(&self.cells, self.sites, cell, site);
        let candidate = Candidate { cell, det, bound };
        conflicts_given::<M>(self.filter, &self.cells, self.sites, site, candidate)
    }

    /// Marks and lists the cells in conflict with the site.
    ///
    /// Breadth first: the unknown neighbours of a whole generation are collected, then tested in one
    /// batch, so no test waits for the result of another. Returns false, with no cell marked, if the
    /// zone reaches the frontier.
    pub(super) fn find_conflict_zone(&mut self, vertex: u32, seed: u32) -> bool {
        self.zone.clear();
        self.zone.push(seed);
        self.state[seed as usize] = CONFLICT;
        let mut generation = 0;
        while generation < self.zone.len() {
            let Some(front) = self.collect_front(generation) else {
                self.forget_zone();
                return false;
            };
            generation = self.zone.len();
            self.test_front(vertex, front);
        }
        true
    }

    /// Resets the marks of the zone and of its neighbours.
    pub(super) fn forget_zone(&mut self) {
        let Self { cells, state, zone, .. } = self;
        for &c in zone.iter() {
            state[c as usize] = UNKNOWN;
            for n in cells[c as usize].n {
                state[n.cell() as usize] = UNKNOWN;
            }
        }
        // The loop may have erased it as a neighbour of the zone.
        state[FRONTIER as usize] = FOREIGN;
    }

    /// Collects the unknown neighbours of the zone from `generation` on; returns their number, or
    /// `None` if the frontier is a neighbour.
    ///
    /// Branch-free: every neighbour is written, but the count moves past unknown ones only. The
    /// branch would be unpredictable, and a misprediction costs more than the write.
    fn collect_front(&mut self, generation: usize) -> Option<usize> {
        let Self { cells, state, zone, front, .. } = self;
        // Room for all four neighbours of each cell, since known ones are written as well.
        let room = 4 * (zone.len() - generation);
        if front.len() < room {
            front.resize(room, Candidate { cell: 0, det: 0.0, bound: 0.0 });
        }
        let (mut count, mut met) = (0, UNKNOWN);
        for &c in &zone[generation..] {
            for n in cells[c as usize].n {
                let known = &mut state[n.cell() as usize];
                met |= *known;
                front[count].cell = n.cell();
                count += usize::from(*known == UNKNOWN);
                *known |= TESTED;
            }
        }
        // Only the frontier has bit 2; the TESTED bit is common.
        (met & FOREIGN & !TESTED == 0).then_some(count)
    }

    /// Tests the first `count` candidates and appends those in conflict to the zone.
    fn test_front(&mut self, vertex: u32, count: usize) {
        let Self { cells, sites, state, zone, front, filter, .. } = self;
        let site = &sites[vertex as usize];
        let front = &mut front[..count];
        // Two determinants at a time fill the lanes of the vector unit.
        let mut pairs = front.chunks_exact_mut(2);
        for pair in &mut pairs {
            let finite = |i: usize| sites_of(sites, finite_side(cells, pair[i].cell));
            let [first, second] = Filter::lifted_determinants::<M>([finite(0), finite(1)], site);
            (pair[0].det, pair[0].bound) = first;
            (pair[1].det, pair[1].bound) = second;
        }
        for candidate in pairs.into_remainder() {
            (candidate.det, candidate.bound) = determinant::<M>(cells, sites, candidate.cell, site);
        }
        // Branch-free append, as in `collect_front`.
        let mut size = zone.len();
        zone.resize(size + count, 0);
        for &candidate in front.iter() {
            let Candidate { cell, det, bound } = candidate;
            // The usual case inline; the call is for doubtful signs and infinite cells.
            let decided = det.abs() > bound + UNDERFLOW && !cells[cell as usize].is_infinite();
            let conflict = if decided {
                det > 0.0
            } else {
                conflicts_given::<M>(*filter, cells, sites, site, candidate)
            };
            zone[size] = cell;
            size += usize::from(conflict);
            state[cell as usize] |= u8::from(conflict) * CONFLICT;
        }
        zone.truncate(size);
    }

    /// Lists the facets between the conflict zone and the cells around it.
    pub(super) fn collect_walls(&mut self) {
        let Self { cells, state, zone, walls, .. } = self;
        let room = 4 * zone.len();
        walls.clear();
        walls.resize(room, Wall { v: [0; 3], outside: Face::NONE, local: [ABSENT; 3] });
        let mut count = 0;
        for &c in zone.iter() {
            let cell = &cells[c as usize];
            for i in 0..4 {
                let outside = cell.n[i];
                let [a, b, c] = OPPOSITE[i];
                walls[count] =
                    Wall { v: [cell.v[a], cell.v[b], cell.v[c]], outside, local: [ABSENT; 3] };
                // Tested and not in conflict: outside. Branch-free, as in `collect_front`.
                count += usize::from(state[outside.cell() as usize] == TESTED);
            }
        }
        walls.truncate(count);
    }
}

/// The vertices of the finite cell whose orthosphere decides about conflict: the cell itself, or
/// the finite neighbour of an infinite cell.
#[inline(always)]
fn finite_side(cells: &[Cell], cell: u32) -> [u32; 4] {
    let record = &cells[cell as usize];
    if record.is_infinite() { cells[record.n[3].cell() as usize].v } else { record.v }
}

#[inline(always)]
fn sites_of(sites: &[Site], [a, b, c, d]: [u32; 4]) -> [&Site; 4] {
    [&sites[a as usize], &sites[b as usize], &sites[c as usize], &sites[d as usize]]
}

/// The determinant that decides whether a site is in conflict with a cell, and its error bound.
#[inline(always)]
fn determinant<M: Metric>(cells: &[Cell], sites: &[Site], cell: u32, site: &Site) -> (f64, f64) {
    Filter::lifted_determinant::<M>(sites_of(sites, finite_side(cells, cell)), site)
}

/// Whether a site is in conflict with a cell, see the head of `build.rs`; `det` and `bound` come
/// from [`determinant`].
#[inline(always)]
fn conflicts_given<M: Metric>(
    filter: Filter,
    cells: &[Cell],
    sites: &[Site],
    site: &Site,
    Candidate { cell, det, bound }: Candidate,
) -> bool {
    let v = cells[cell as usize].v;
    if v[3] == INFINITE {
        let [a, b, c] = [&sites[v[0] as usize], &sites[v[1] as usize], &sites[v[2] as usize]];
        match filter.orient3d(&a.p, &b.p, &c.p, &site.p) {
            Sign::Positive => return true,
            Sign::Negative => return false,
            // In the plane of the facet: the finite neighbour decides.
            Sign::Zero => {}
        }
    }
    let finite = sites_of(sites, finite_side(cells, cell));
    in_conflict_given::<M>(filter, det, bound, finite, site)
}
