//! Step 3 of the construction (`build.rs`): the conflict zone of a site, and its walls.

use super::build::Builder;
use super::cells::{Cell, FRONTIER, Face, INFINITE, OPPOSITE};
use super::stellate::ABSENT;
use crate::predicates::{Filter, Metric, Sign, Site, UNDERFLOW, in_conflict_given};

/// What is known of a cell while a conflict zone grows: nothing, tested or about to be, and in
/// conflict. The last two are bits, the second never without the first.
pub(super) const UNKNOWN: u8 = 0;
pub(super) const TESTED: u8 = 1;
pub(super) const CONFLICT: u8 = 3;

/// The mark of the frontier: never to be tested.
pub(super) const FOREIGN: u8 = 5;

/// A facet of the boundary of the conflict zone: its vertices, counter-clockwise from outside, and
/// the facet as a face of the cell outside.
#[derive(Clone, Copy)]
pub(super) struct Wall {
    pub(super) v: [u32; 3],
    pub(super) outside: Face,
    /// Numbers of the vertices among those of all walls.
    pub(super) local: [u8; 3],
}

/// A cell beside the conflict zone, and what decides whether it belongs to it.
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
    /// Generation by generation: the neighbours of the last one are collected, then tested
    /// together, so that no test waits for the verdict on another. Returns false, with no cell
    /// marked, if the zone reaches the frontier.
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

    /// Takes back all marks.
    pub(super) fn forget_zone(&mut self) {
        let Self { cells, state, zone, .. } = self;
        for &c in zone.iter() {
            state[c as usize] = UNKNOWN;
            for n in cells[c as usize].n {
                state[n.cell() as usize] = UNKNOWN;
            }
        }
        state[FRONTIER as usize] = FOREIGN;
    }

    /// Collects the unknown neighbours of the zone from `generation` on; returns their number,
    /// nothing if the frontier is among them.
    ///
    /// Every neighbour is written, and counted if it was unknown: whether it is cannot be
    /// predicted, and a wrong guess would cost more than the write.
    fn collect_front(&mut self, generation: usize) -> Option<usize> {
        let Self { cells, state, zone, front, .. } = self;
        let most = 4 * (zone.len() - generation);
        if front.len() < most {
            front.resize(most, Candidate { cell: 0, det: 0.0, bound: 0.0 });
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
        (met & FOREIGN & !TESTED == 0).then_some(count)
    }

    /// Tests the first `count` candidates and appends those in conflict to the zone.
    fn test_front(&mut self, vertex: u32, count: usize) {
        let Self { cells, sites, state, zone, front, filter, .. } = self;
        let site = &sites[vertex as usize];
        let front = &mut front[..count];
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
        let mut size = zone.len();
        zone.resize(size + count, 0);
        for &candidate in front.iter() {
            let Candidate { cell, det, bound } = candidate;
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
        let most = 4 * zone.len();
        walls.clear();
        walls.resize(most, Wall { v: [0; 3], outside: Face::NONE, local: [ABSENT; 3] });
        let mut count = 0;
        for &c in zone.iter() {
            let cell = &cells[c as usize];
            for i in 0..4 {
                let outside = cell.n[i];
                let [a, b, c] = OPPOSITE[i];
                walls[count] =
                    Wall { v: [cell.v[a], cell.v[b], cell.v[c]], outside, local: [ABSENT; 3] };
                count += usize::from(state[outside.cell() as usize] == TESTED);
            }
        }
        walls.truncate(count);
    }
}

/// The finite cell whose orthosphere decides about conflict with a cell, itself or the finite
/// neighbour of an infinite one.
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

/// Whether a site is in conflict with a cell, see the head of this file; `det` and `bound` are
/// those of [`determinant`].
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
            Sign::Zero => {}
        }
    }
    let finite = sites_of(sites, finite_side(cells, cell));
    in_conflict_given::<M>(filter, det, bound, finite, site)
}
