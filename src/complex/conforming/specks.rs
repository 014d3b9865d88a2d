//! Parts, cavities and loops that missing triangles leave among the cells of a solid.

use std::collections::hash_map::Entry;
use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use super::skin::{Skin, key};
use super::stars::{star, star_while};
use crate::geometry::triangulation::Facet;
use crate::geometry::{CellId, Delaunay, DisjointSets, VertexId};

/// Limit of the cells that are visited in searches around a cell and its vertices.
const VISITS: usize = 100_000_000;

/// Joins the parts and cavities beyond the numbers of the solid with their surroundings, those of least volume: missing
/// triangles and degenerate places leave such.
pub(super) fn join(delaunay: &Delaunay, is_inside: &mut [bool], [parts, _, cavities]: [usize; 3]) {
    let mut sets = regions(delaunay, is_inside);
    let mut volumes: BTreeMap<u32, f64> = BTreeMap::new();
    for cell in delaunay.cells() {
        *volumes.entry(sets.find(cell.0)).or_default() += volume(delaunay, cell);
    }
    let mut specks = HashSet::new();
    // With the outside itself.
    for (is_part, number) in [(true, parts), (false, cavities + 1)] {
        let regions =
            volumes.iter().filter(|&(&cell, _)| inside(is_inside, CellId(cell)) == is_part);
        let mut regions: Vec<(f64, u32)> = regions.map(|(&cell, &volume)| (volume, cell)).collect();
        regions.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        specks.extend(regions.iter().skip(number).map(|&(_, cell)| cell));
    }
    for cell in delaunay.finite_cells() {
        is_inside[cell.index()] ^= specks.contains(&sets.find(cell.0));
    }
}

/// Moves cells at missing triangles to the other side until the Euler characteristic of the cells inside is that of the
/// solid. Parts and cavities stay as many as they are, so that the number of loops becomes the solid's as well.
pub(super) fn mend_loops(
    delaunay: &Delaunay,
    is_inside: &mut [bool],
    skin: &Skin,
    missing: &[u32],
    [parts, loops, cavities]: [usize; 3],
) {
    let wanted = (parts + cavities) as i64 - loops as i64;
    if missing.is_empty() || numbers(delaunay, is_inside) != [parts, cavities + 1] {
        return;
    }
    let excess = euler(delaunay, is_inside) - wanted;
    let at_missing = cells_at(delaunay, skin, missing);
    let beyond = cells_beside(delaunay, is_inside, skin);
    let mut mending = Mending { delaunay, is_inside, excess, visits: VISITS };
    for cells in [at_missing, beyond] {
        mending.mend_all(&by_volume(delaunay, cells));
    }
}

/// Cells with a side of one of some triangles.
fn cells_at(delaunay: &Delaunay, skin: &Skin, triangles: &[u32]) -> Vec<CellId> {
    let corners = triangles.iter().map(|&t| skin.triangles[t as usize]);
    let found = corners.flat_map(|corners| {
        let around = corners.into_iter().flat_map(|v| star(delaunay, v));
        around.filter(move |&cell| {
            let own = delaunay.vertices(cell);
            corners.iter().filter(|&&v| own.contains(&VertexId(v))).count() >= 2
        })
    });
    found.filter(|&cell| !delaunay.is_infinite(cell)).collect()
}

/// Cells on the two sides of facets between inside and outside that are no triangles of the surface.
fn cells_beside(delaunay: &Delaunay, is_inside: &[bool], skin: &Skin) -> Vec<CellId> {
    let is_of_surface = |facet| {
        let [a, b, c] = delaunay.facet_vertices(facet).map(|v| v.0);
        let t = skin.across.get(&key([a, b]));
        t.is_some_and(|&t| skin.triangles[t as usize].contains(&c))
    };
    let facets = delaunay
        .finite_cells()
        .filter(|cell| is_inside[cell.index()])
        .flat_map(|cell| (0..4).map(move |opposite| Facet { cell, opposite }));
    let pairs = facets.map(|facet| (facet, delaunay.mirror(facet).cell));
    let doubtful =
        pairs.filter(|&(facet, other)| !inside(is_inside, other) && !is_of_surface(facet));
    let cells = doubtful.flat_map(|(facet, other)| [facet.cell, other]);
    cells.filter(|&cell| !delaunay.is_infinite(cell)).collect()
}

/// Cells, each once, those of least volume first.
fn by_volume(delaunay: &Delaunay, cells: Vec<CellId>) -> Vec<CellId> {
    let mut cells: Vec<(f64, CellId)> =
        cells.into_iter().map(|cell| (volume(delaunay, cell), cell)).collect();
    cells.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    cells.dedup();
    cells.into_iter().map(|(_, cell)| cell).collect()
}

/// Cells of a solid whose loops are mended.
struct Mending<'m> {
    delaunay: &'m Delaunay,
    is_inside: &'m mut [bool],
    /// The Euler characteristic of the cells inside less that of the solid.
    excess: i64,
    /// Cells that may still be visited.
    visits: usize,
}

impl Mending<'_> {
    /// Moves some of the cells until the Euler characteristic is right, or no cell brings it closer.
    fn mend_all(&mut self, cells: &[CellId]) {
        loop {
            let before = self.excess;
            for &cell in cells {
                self.mend(cell);
            }
            if self.excess == before && !self.mend_beyond(cells) {
                return;
            }
        }
    }

    /// Moves a cell that brings the Euler characteristic closer to the solid's and leaves as many regions. Whether it does.
    fn mend(&mut self, cell: CellId) -> bool {
        if self.excess == 0 || self.visits == 0 {
            return false;
        }
        let effect = self.effect(cell);
        let is_closer = (self.excess + effect).abs() < self.excess.abs()
            && [true, false].into_iter().all(|side| self.is_connected(cell, side, |_| true));
        if is_closer {
            self.is_inside[cell.index()] ^= true;
            self.excess += effect;
        }
        is_closer
    }

    /// Moves cells that change no homotopy type, and mends cells next to them; then those back that were not needed. Whether any
    /// was mended.
    fn mend_beyond(&mut self, cells: &[CellId]) -> bool {
        let rank: HashMap<CellId, usize> = cells.iter().copied().zip(0..).collect();
        let before = self.excess;
        for side in [true, false] {
            let mut moved = Vec::new();
            let mut earlier = usize::MAX;
            while earlier != moved.len() && self.excess != 0 && self.visits > 0 {
                earlier = moved.len();
                for &cell in cells {
                    if self.is_inside[cell.index()] == side && self.is_simple(cell) {
                        self.is_inside[cell.index()] ^= true;
                        moved.push(cell);
                        for near in self.near(cell, &rank) {
                            self.mend(cells[near]);
                        }
                    }
                }
            }
            for &cell in moved.iter().rev() {
                let is_mended = self.excess != before;
                if !is_mended || self.is_inside[cell.index()] != side && self.is_simple(cell) {
                    self.is_inside[cell.index()] = side;
                }
            }
            if self.excess != before {
                return true;
            }
        }
        false
    }

    /// Ranks of the ranked cells at the corners of a cell.
    fn near(&mut self, cell: CellId, rank: &HashMap<CellId, usize>) -> BTreeSet<usize> {
        let mut ranks = BTreeSet::new();
        for v in self.delaunay.vertices(cell) {
            let around = star(self.delaunay, v.0);
            self.visits = self.visits.saturating_sub(around.len());
            ranks.extend(around.iter().filter_map(|c| rank.get(c).copied()));
        }
        ranks
    }

    /// What moving a cell to the other side adds to the Euler characteristic.
    fn effect(&mut self, cell: CellId) -> i64 {
        let sign = if self.is_inside[cell.index()] { -1 } else { 1 };
        let (effect, visits) = effect(self.delaunay, self.is_inside, cell);
        self.visits = self.visits.saturating_sub(visits);
        sign * effect
    }

    /// Whether moving a cell to the other side changes no homotopy type: the neighbours of each side are connected around it.
    fn is_simple(&mut self, cell: CellId) -> bool {
        let delaunay = self.delaunay;
        let corners = delaunay.vertices(cell);
        let is_near = |other: CellId| delaunay.vertices(other).iter().any(|v| corners.contains(v));
        self.effect(cell) == 0
            && [true, false].into_iter().all(|side| self.is_connected(cell, side, is_near))
    }

    /// Whether a cell has neighbours on a side, which are connected through others of that side.
    fn is_connected(
        &mut self,
        cell: CellId,
        side: bool,
        is_allowed: impl Fn(CellId) -> bool,
    ) -> bool {
        let Self { delaunay, is_inside, .. } = self;
        let is_of_side = |&other: &CellId| {
            other != cell && inside(is_inside, other) == side && is_allowed(other)
        };
        // Searches from all neighbours in turn: the smallest region ends first.
        let mut fronts: Vec<Vec<CellId>> = Vec::new();
        let mut front_of: HashMap<CellId, u32> = HashMap::new();
        for other in delaunay.neighbours(cell).into_iter().filter(is_of_side) {
            front_of.entry(other).or_insert_with(|| {
                fronts.push(vec![other]);
                fronts.len() as u32 - 1
            });
        }
        let mut sets = DisjointSets::singletons(fronts.len());
        let mut parts = fronts.len();
        for step in 0.. {
            let mut goes_on = [false; 4];
            for front in 0..fronts.len() {
                let Some(&at) = fronts[front].get(step) else { continue };
                if parts == 1 || self.visits == 0 {
                    break;
                }
                self.visits -= 1;
                goes_on[front] = true;
                for other in delaunay.neighbours(at).into_iter().filter(is_of_side) {
                    match front_of.entry(other) {
                        Entry::Vacant(entry) => {
                            entry.insert(front as u32);
                            fronts[front].push(other);
                        }
                        Entry::Occupied(entry) => {
                            parts -= usize::from(sets.join(front as u32, *entry.get()));
                        }
                    }
                }
            }
            let mut ends = [true; 4];
            for front in (0..fronts.len()).filter(|&front| goes_on[front]) {
                ends[sets.find(front as u32) as usize] = false;
            }
            if parts <= 1 || (0..fronts.len() as u32).any(|front| ends[sets.find(front) as usize]) {
                break;
            }
        }
        parts == 1
    }
}

fn inside(is_inside: &[bool], cell: CellId) -> bool {
    is_inside.get(cell.index()).is_some_and(|&inside| inside)
}

/// Cells of one side that are connected through facets.
fn regions(delaunay: &Delaunay, is_inside: &[bool]) -> DisjointSets {
    let mut sets = DisjointSets::singletons(delaunay.cell_count());
    for cell in delaunay.cells() {
        for other in delaunay.neighbours(cell) {
            if inside(is_inside, cell) == inside(is_inside, other) {
                sets.join(cell.0, other.0);
            }
        }
    }
    sets
}

/// Numbers of regions inside and outside.
fn numbers(delaunay: &Delaunay, is_inside: &[bool]) -> [usize; 2] {
    let mut sets = regions(delaunay, is_inside);
    let mut numbers = [0; 2];
    for cell in delaunay.cells() {
        if sets.find(cell.0) == cell.0 {
            numbers[usize::from(!inside(is_inside, cell))] += 1;
        }
    }
    numbers
}

/// The Euler characteristic of the dual complex of the cells inside.
fn euler(delaunay: &Delaunay, is_inside: &[bool]) -> i64 {
    let mut added = vec![false; is_inside.len()];
    let mut sum = 0;
    for cell in delaunay.finite_cells().filter(|cell| is_inside[cell.index()]) {
        sum += effect(delaunay, &added, cell).0;
        added[cell.index()] = true;
    }
    sum
}

/// The change of the Euler characteristic when a cell is added to those inside: its dual vertex, with the dual edge of each
/// facet, the dual polygon of each edge, and the dual polyhedron of each vertex that are complete then. With the number of
/// cells that were visited around its vertices.
fn effect(delaunay: &Delaunay, is_inside: &[bool], cell: CellId) -> (i64, usize) {
    let is_in = |other: &CellId| *other == cell || inside(is_inside, *other);
    let facets = delaunay.neighbours(cell).iter().filter(|other| is_in(other)).count();
    let pairs = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];
    let edges =
        pairs.iter().filter(|&&(i, j)| delaunay.edge_ring(cell, i, j).all(|c| is_in(&c))).count();
    let (mut vertices, mut visits) = (0, 0);
    for v in delaunay.vertices(cell) {
        let around = star_while(delaunay, v.0, |other| is_in(&other));
        visits += around.len();
        vertices += i64::from(around.last().is_some_and(is_in));
    }
    (1 - facets as i64 + edges as i64 - vertices, visits)
}

fn volume(delaunay: &Delaunay, cell: CellId) -> f64 {
    if delaunay.is_infinite(cell) {
        return f64::INFINITY;
    }
    let [a, b, c, d] = delaunay.vertices(cell).map(|v| delaunay.point(v));
    (b - a).cross(c - a).dot(d - a).abs()
}

#[cfg(test)]
mod tests {
    use rand::prelude::*;
    use rand_pcg::Pcg64;

    use super::*;
    use crate::Vec3;

    #[test]
    fn tunnels_are_closed() {
        let (mut loops, mut mended) = (0, 0);
        for seed in 0..200 {
            let mut rng = Pcg64::seed_from_u64(seed);
            let mut coordinate = || rng.random_range(-1.0..1.0);
            let points: Vec<Vec3> =
                (0..120).map(|_| Vec3::from_array([(); 3].map(|()| coordinate()))).collect();
            let delaunay = Delaunay::new(&points).unwrap();
            let centroid = |cell: CellId| {
                let corners = delaunay.vertices(cell).map(|v| delaunay.point(v));
                corners.into_iter().sum::<Vec3>() / 4.0
            };
            // All but a tunnel.
            let is_far = |cell: &CellId, radius: f64| {
                let at = centroid(*cell);
                at.x.hypot(at.y) > radius
            };
            let mut is_inside: Vec<bool> =
                delaunay.finite_cells().map(|cell| is_far(&cell, 0.25)).collect();
            join(&delaunay, &mut is_inside, [1, 0, 0]);
            if euler(&delaunay, &is_inside) == 1 {
                continue;
            }
            let before = is_inside.clone();
            let cells = delaunay.finite_cells().filter(|cell| !is_far(cell, 0.5)).collect();
            let cells = by_volume(&delaunay, cells);
            let excess = euler(&delaunay, &is_inside) - 1;
            let mut mending =
                Mending { delaunay: &delaunay, is_inside: &mut is_inside, excess, visits: VISITS };
            mending.mend_all(&cells);
            let left = mending.excess;
            assert_eq!(euler(&delaunay, &is_inside) - 1, left);
            assert_eq!(numbers(&delaunay, &is_inside), [1, 1]);
            let mut moved =
                delaunay.finite_cells().filter(|c| is_inside[c.index()] != before[c.index()]);
            assert!(moved.all(|cell| !is_far(&cell, 0.5)), "seed {seed}");
            loops += 1;
            mended += usize::from(left == 0);
        }
        assert!(loops >= 40 && 5 * mended >= 4 * loops, "{mended} of {loops} loops");
    }
}
