//! A round of insertions in two parts, side by side.
//!
//! 1. A plane *cuts* the cells of the earlier rounds into two parts by their centres. Each part is
//!    copied into a builder of its own, in which the frontier stands for the cells of the other.
//! 2. Each part inserts the sites on its side of the plane. A site whose conflict zone touches the
//!    frontier is *deferred*: cells at the frontier never change, so the parts are independent. A
//!    site is deferred, too, if neither a walk from the last cell nor one from a hint reaches it.
//! 3. The parts are joined along the frontier, and the deferred sites are inserted.
//!
//! The parts do not depend on the number of threads, nor does the result, down to the order of
//! cells: a single thread grows one part after the other and stores the second behind the first.
//! The perturbed triangulation is unique, so any order of insertion gives the same set of cells.
//!
//! The plane halves the sites. Its direction (of 13) and the kind of cell centre (of two) are those
//! for which the fewest conflict zones, of a sample of the sites, straddle the plane. Orthocentres
//! suit samples of surfaces: the conflict zone of a site consists of cells whose orthocentres lie
//! near its Voronoi cell, a thin prism that reaches to the medial axis on both sides of the surface,
//! while the cells themselves span the solid. Centroids suit points on a common sphere.

use std::ops::Range;

use rayon::prelude::*;

use super::build::{Builder, Outcome};
use crate::Vec3;
use crate::predicates::{Metric, Site};
use crate::triangulation::TriangulationError;
use crate::triangulation::build::UNKNOWN;
use crate::triangulation::{Cell, FRONTIER, Face, MAX_CELLS, UNUSED};

/// Every cut is tried on about this many sites.
const TRIED_SITES: usize = 512;

/// The median height of the sites is estimated from about this many.
const SAMPLED_SITES: usize = 4096;

/// Directions of planes, up to sign: axes, and diagonals of the faces and of the body of a cube.
const DIRECTIONS: [Vec3; 13] = [
    Vec3::new(1.0, 0.0, 0.0),
    Vec3::new(0.0, 1.0, 0.0),
    Vec3::new(0.0, 0.0, 1.0),
    Vec3::new(1.0, 1.0, 0.0),
    Vec3::new(1.0, -1.0, 0.0),
    Vec3::new(1.0, 0.0, 1.0),
    Vec3::new(1.0, 0.0, -1.0),
    Vec3::new(0.0, 1.0, 1.0),
    Vec3::new(0.0, 1.0, -1.0),
    Vec3::new(1.0, 1.0, 1.0),
    Vec3::new(1.0, 1.0, -1.0),
    Vec3::new(1.0, -1.0, 1.0),
    Vec3::new(-1.0, 1.0, 1.0),
];

/// Sites between two hints: for each hint a cell near the site is noted before the division.
const HINT_STRIDE: usize = 256;

/// The cuts to choose from, each direction with both kinds of centres.
const CUTS: usize = 2 * DIRECTIONS.len();

/// The point of a cell that decides to which part it belongs.
#[derive(Clone, Copy, Debug)]
enum Centre {
    Orthocentre,
    Centroid,
}

/// A plane; the first part is below it.
#[derive(Clone, Copy, Debug)]
struct Cut {
    direction: Vec3,
    at: f64,
    centre: Centre,
}

/// Where a cell is after the division: its part, and its record there.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Place(u32);

impl Place {
    /// Of records that no cell uses.
    const NOWHERE: Self = Self(u32::MAX);

    fn new(part: usize, record: u32) -> Self {
        Self((part as u32) << 31 | record)
    }

    fn part(self) -> usize {
        (self.0 >> 31) as usize
    }

    fn record(self) -> u32 {
        self.0 & (u32::MAX >> 1)
    }
}

/// One part: its cells, and its facets on the frontier.
struct Part<'s, M> {
    builder: Builder<'s, M>,
    /// The sites on its side of the cut; after `grow`, the deferred ones among them.
    sites: Vec<u32>,
    /// Where to start again after a walk has met the frontier, see [`Builder::hints`].
    hints: Vec<u32>,
    /// Its facets on the frontier, each with its mirror in the other part, named as before the
    /// division.
    frontier: Vec<(Face, Face)>,
    /// By how much its records have been moved, see [`Part::follow`].
    offset: u32,
}

impl<'s, M: Metric> Builder<'s, M> {
    /// Inserts sites in two parts, or one after the other where every plane would defer more than the
    /// share `most_deferred` of them.
    pub(super) fn insert_divided(
        &mut self,
        range: Range<u32>,
        most_deferred: (u32, u32),
    ) -> Result<(), TriangulationError> {
        let Some(cut) = self.choose_cut(&range, most_deferred) else {
            self.reserve(range.len());
            return self.insert_all(range);
        };
        let ([mut first, mut second], places) = self.divide(cut, &range);
        if rayon::current_num_threads() == 1 {
            // One array from the start: no fresh memory is touched, and the second part never moves.
            first.grow()?;
            second.follow(&mut first)?;
            second.grow()?;
        } else {
            let (one, other) = rayon::join(|| first.grow(), || second.grow());
            one.and(other)?;
            second.follow(&mut first)?;
        }
        let deferred = self.unite(first, second, &places);
        self.insert_all(deferred)
    }

    /// The cut for which the fewest sites would be deferred, if these are not too many.
    fn choose_cut(&mut self, range: &Range<u32>, (part, whole): (u32, u32)) -> Option<Cut> {
        let cuts = self.halving_cuts(range);
        let stride = range.len().div_ceil(TRIED_SITES);
        let (mut deferred, mut tried) = ([0; CUTS], 0);
        for vertex in range.clone().step_by(stride) {
            let unsuitable = self.unsuitable_cuts(vertex, &cuts);
            for (i, count) in deferred.iter_mut().enumerate() {
                *count += unsuitable >> i & 1;
            }
            tried += 1;
        }
        let best = (0..CUTS).min_by_key(|&i| deferred[i])?;
        (whole * deferred[best] <= part * tried).then_some(cuts[best])
    }

    /// The cuts to choose from: each direction halves the sites.
    fn halving_cuts(&self, range: &Range<u32>) -> [Cut; CUTS] {
        let sites = &self.sites[range.start as usize..range.end as usize];
        let stride = sites.len().div_ceil(SAMPLED_SITES);
        let at = DIRECTIONS.map(|direction| {
            let mut heights: Vec<f64> = sites
                .iter()
                .step_by(stride)
                .map(|s: &Site| direction.dot(Vec3::from_array(s.p)))
                .collect();
            let middle = heights.len() / 2;
            *heights.select_nth_unstable_by(middle, f64::total_cmp).1
        });
        std::array::from_fn(|i| {
            let k = i % DIRECTIONS.len();
            let centre = Centre::BOTH[i / DIRECTIONS.len()];
            Cut { direction: DIRECTIONS[k], at: at[k], centre }
        })
    }

    /// The cuts that would defer a site, one bit each: some cell that its insertion reads or
    /// replaces is not in the part of the site's side.
    fn unsuitable_cuts(&mut self, vertex: u32, cuts: &[Cut; CUTS]) -> u32 {
        let Some(seed) = self.locate(vertex) else { return 0 };
        self.last = seed;
        if !self.find_conflict_zone(vertex, seed) {
            return 0;
        }
        let position = Vec3::from_array(self.sites[vertex as usize].p);
        let side = below(cuts, [position; 2]);
        let (mut all, mut any) = (u32::MAX, 0);
        for &c in &self.zone {
            for n in self.cells[c as usize].n {
                // Each cell once.
                if std::mem::take(&mut self.state[n.cell() as usize]) != UNKNOWN {
                    let cell = decisive(&self.cells, n.cell());
                    let parts = below(cuts, Centre::BOTH.map(|centre| centre.of(cell, self.sites)));
                    all &= parts;
                    any |= parts;
                }
            }
        }
        self.forget_zone();
        // A cut suits if all agree: site and cells below it, or none of them.
        (side | any) & !(side & all)
    }

    /// Step 1 of the head; returns also the place of every cell.
    fn divide(&mut self, cut: Cut, range: &Range<u32>) -> ([Part<'s, M>; 2], Vec<Place>) {
        let (places, counts) = self.places(cut);
        let parts = [0, 1].map(|part| {
            let sites = range.clone().filter(|&v| {
                let position = Vec3::from_array(self.sites[v as usize].p);
                cut.is_below(position) == (part == 0)
            });
            let sites: Vec<u32> = sites.collect();
            let mut builder = Self::new(self.sites, self.filter, 0);
            let hints = self.hints(part, &sites, &places);
            builder.last = counts[part].min(1);
            // The first part will take in the second.
            let room = if part == 0 { range.end as usize } else { sites.len() };
            builder.reserve(room + counts[part] as usize / 8);
            Part { builder, sites, hints, frontier: Vec::new(), offset: 0 }
        });
        let cells = std::mem::take(&mut self.cells);
        let [mut first, mut second] = parts;
        rayon::join(|| first.copy(0, &cells, &places), || second.copy(1, &cells, &places));
        ([first, second], places)
    }

    /// The place of every cell, and how many there are in each part.
    fn places(&self, cut: Cut) -> (Vec<Place>, [u32; 2]) {
        let cells = &self.cells;
        let mut places: Vec<Place> = (0..cells.len())
            .into_par_iter()
            .map(|c: usize| {
                if cells[c].v[0] == UNUSED {
                    return Place::NOWHERE;
                }
                let centre = cut.centre.of(decisive(cells, c as u32), self.sites);
                Place::new(usize::from(!cut.is_below(centre)), 0)
            })
            .collect();
        // Numbered in sequence, so the records do not depend on threads; from 1, after the frontier.
        let mut counts = [0; 2];
        for place in places.iter_mut().filter(|p| **p != Place::NOWHERE) {
            let part = place.part();
            counts[part] += 1;
            *place = Place::new(part, counts[part]);
        }
        (places, counts)
    }

    /// For each run of [`HINT_STRIDE`] sites of a part, a record of the part near the first of
    /// them, or the frontier.
    fn hints(&mut self, part: usize, sites: &[u32], places: &[Place]) -> Vec<u32> {
        sites
            .iter()
            .step_by(HINT_STRIDE)
            .map(|&vertex: &u32| {
                self.last = self.walk_approximately(vertex);
                let place = places[self.last as usize];
                if place.part() == part { place.record() } else { FRONTIER }
            })
            .collect()
    }

    /// Step 3 of the head, once the second part follows the first; returns the deferred sites.
    fn unite(&mut self, first: Part<'s, M>, second: Part<'s, M>, places: &[Place]) -> Vec<u32> {
        let offset = second.offset;
        *self = second.builder;
        if first.builder.last != FRONTIER {
            self.last = first.builder.last;
        }
        // Records are reused from the end, with any number of threads in the same order.
        self.free.splice(..0, first.builder.free);
        for &(face, before) in first.frontier.iter().chain(&second.frontier) {
            let place = places[before.cell() as usize];
            let other = Face::new(place.record(), before.index());
            let other = if place.part() == 0 { other } else { other.moved(offset) };
            self.cells[face.cell() as usize].n[face.index()] = other;
        }
        // Back to the order of the curve, so that walks stay short.
        let mut deferred = [first.sites, second.sites].concat();
        deferred.sort_unstable();
        deferred
    }
}

impl<M: Metric> Part<'_, M> {
    /// Copies its cells.
    fn copy(&mut self, part: usize, cells: &[Cell], places: &[Place]) {
        let builder = &mut self.builder;
        for (cell, place) in cells.iter().zip(places) {
            if place.part() != part || *place == Place::NOWHERE {
                continue;
            }
            let mut copy = *cell;
            for (i, n) in copy.n.iter_mut().enumerate() {
                let beyond = places[n.cell() as usize];
                if beyond.part() == part {
                    *n = Face::new(beyond.record(), n.index());
                } else {
                    self.frontier.push((Face::new(place.record(), i), *n));
                    *n = Face::new(FRONTIER, 0);
                }
            }
            builder.cells.push(copy);
        }
        builder.state.resize(builder.cells.len(), UNKNOWN);
    }

    /// Takes over the records of the first part and appends its own, except its frontier.
    fn follow(&mut self, first: &mut Self) -> Result<(), TriangulationError> {
        let Self { builder, hints, frontier, .. } = self;
        let mut cells = std::mem::take(&mut first.builder.cells);
        if cells.len() + builder.cells.len() > MAX_CELLS {
            let points = builder.sites.len() - 1;
            return Err(TriangulationError::TooLarge { points, limit: MAX_CELLS });
        }
        // Record 1 comes after the last of the first part, since record 0 is dropped.
        let offset = cells.len() as u32 - 1;
        let id = |id: u32| if id == FRONTIER { id } else { id + offset };
        let face = |face: Face| if face.cell() == FRONTIER { face } else { face.moved(offset) };
        cells.par_extend(builder.cells[1..].par_iter().map(
            |&Cell { v, n: [a, b, c, d] }: &Cell| {
                let n = [face(a), face(b), face(c), face(d)];
                Cell { v, n }
            },
        ));
        builder.cells = cells;
        builder.state = std::mem::take(&mut first.builder.state);
        builder.state.resize(builder.cells.len(), UNKNOWN);
        builder.last = id(builder.last);
        builder.free.iter_mut().for_each(|free| *free = id(*free));
        hints.iter_mut().for_each(|hint| *hint = id(*hint));
        frontier.iter_mut().for_each(|(here, _)| *here = face(*here));
        self.offset = offset;
        Ok(())
    }

    /// Step 2 of the head.
    fn grow(&mut self) -> Result<(), TriangulationError> {
        let Self { builder, sites, hints, .. } = self;
        if builder.last == FRONTIER {
            // The part has no cell.
            return Ok(());
        }
        let mut deferred = 0;
        for i in 0..sites.len() {
            let mut outcome = builder.insert(sites[i])?;
            let hint = hints[i / HINT_STRIDE];
            // Records are reused near where they were, so the hint is still close if it was reused.
            if outcome == Outcome::Unreached && builder.cells[hint as usize].v[0] != UNUSED {
                builder.last = hint;
                outcome = builder.insert(sites[i])?;
            }
            if outcome != Outcome::Done {
                // In place: `deferred` never overtakes `i`.
                sites[deferred] = sites[i];
                deferred += 1;
            }
        }
        sites.truncate(deferred);
        Ok(())
    }
}

/// The cuts that a point is below, one bit each; it is one point for each kind of centre.
fn below(cuts: &[Cut; CUTS], points: [Vec3; 2]) -> u32 {
    let (first, second) = cuts.split_at(DIRECTIONS.len());
    (0..DIRECTIONS.len()).fold(0, |bits, i| {
        let [first, second] = [first[i].is_below(points[0]), second[i].is_below(points[1])];
        bits | u32::from(first) << i | u32::from(second) << (i + DIRECTIONS.len())
    })
}

impl Cut {
    /// Whether a point is below the plane. A centre that overflowed counts as below.
    fn is_below(self, point: Vec3) -> bool {
        let height = self.direction.dot(point);
        height < self.at || height.is_nan()
    }
}

impl Centre {
    const BOTH: [Self; 2] = [Self::Orthocentre, Self::Centroid];

    fn of(self, cell: &Cell, sites: &[Site]) -> Vec3 {
        let s = cell.v.map(|v| &sites[v as usize]);
        match self {
            Self::Centroid => s.iter().map(|s| 0.25 * Vec3::from_array(s.p)).sum(),
            Self::Orthocentre => approximate_orthocentre(s),
        }
    }
}

/// The finite cell that decides about conflicts with a cell: itself, or the finite neighbour of an
/// infinite cell. An infinite cell is therefore always in the part of this neighbour.
fn decisive(cells: &[Cell], cell: u32) -> &Cell {
    let record = &cells[cell as usize];
    if record.is_infinite() { &cells[record.n[3].cell() as usize] } else { record }
}

/// The orthocentre of four sites in plain double precision.
fn approximate_orthocentre(s: [&Site; 4]) -> Vec3 {
    let [a, b, c, d] = s.map(|s| Vec3::from_array(s.p));
    let [u, v, w] = [b - a, c - a, d - a];
    let [l, m, n] = [(u, s[1]), (v, s[2]), (w, s[3])]
        .map(|(edge, site)| edge.length_squared() + (s[0].w - site.w));
    let (vw, wu, uv) = (v.cross(w), w.cross(u), u.cross(v));
    let scaled = l * vw + m * wu + n * uv;
    a + scaled / (2.0 * u.dot(vw))
}
