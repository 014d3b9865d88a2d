//! Step 3: the Voronoi vertices of the corners that are inside the dual complex.

use rayon::prelude::*;

use super::corners::Corners;
use super::sectors::Sectors;
use super::{AxisTally, NONE};
use crate::geometry::DisjointSets;
use crate::geometry::triangulation::Facet;
use crate::geometry::{CellId, Delaunay, VertexId};

/// The finite cells of the Delaunay triangulation of the corners.
#[derive(Default)]
pub(super) struct Voronoi {
    /// For each facet of each cell the first ball centre on its Voronoi edge, seen from the cell's
    /// Voronoi vertex; `NONE` if there is none.
    stations: Vec<[u32; 4]>,
    /// Whether the Voronoi vertex is inside and not the centre of a ball.
    inside: Vec<bool>,
}

impl Voronoi {
    /// The cells inside, ascending.
    pub(super) fn inside(&self) -> impl Iterator<Item = CellId> + '_ {
        let cells = (0..self.inside.len() as u32).filter(|&c| self.inside[c as usize]);
        cells.map(CellId)
    }

    pub(super) fn contains(&self, cell: CellId) -> bool {
        self.inside[cell.index()]
    }

    pub(super) fn len(&self) -> usize {
        self.inside.len()
    }

    pub(super) fn station(&self, facet: Facet) -> u32 {
        self.stations[facet.cell.index()][facet.opposite]
    }

    /// The Voronoi edges inside, as far as the first ball centre on them.
    pub(super) fn edges<'a>(
        &'a self,
        corners: &'a Corners,
        balls: u32,
    ) -> impl Iterator<Item = [u32; 2]> + 'a {
        let sides = move |cell: CellId| {
            let delaunay = corners.delaunay().expect("a cell");
            (0..4).map(move |opposite| match self.station(Facet { cell, opposite }) {
                NONE => [balls + cell.0, balls + delaunay.neighbours(cell)[opposite].0],
                ball => [balls + cell.0, ball],
            })
        };
        self.inside().flat_map(sides)
    }
}

/// Finds the ball centres on Voronoi edges, and the side of each Voronoi vertex.
pub(super) fn classify(corners: &Corners, sectors: &Sectors, tally: &mut AxisTally) -> Voronoi {
    let Some(delaunay) = corners.delaunay() else { return Voronoi::default() };
    let cells = (0..delaunay.finite_cell_count() as u32).into_par_iter().with_min_len(1 << 9);
    let (stations, free): (Vec<[u32; 4]>, Vec<bool>) =
        cells.clone().map(|c| stations_of(corners, delaunay, CellId(c))).unzip();
    let mut groups = joined(delaunay, &stations, &free);
    let votes: Vec<Votes> = cells
        .map(|c| match free[c as usize] {
            true => votes_of(delaunay, sectors, CellId(c), stations[c as usize]),
            false => Votes::default(),
        })
        .collect();
    let outside = groups.find(free.len() as u32);
    let mut of_group = vec![Votes::default(); free.len() + 1];
    for (c, votes) in votes.into_iter().enumerate() {
        let all = &mut of_group[groups.find(c as u32) as usize];
        all.inside += votes.inside;
        all.outside += votes.outside;
    }
    let mut verdict = |c: usize| {
        let group = groups.find(c as u32);
        let Votes { inside, outside: out } = of_group[group as usize];
        let unanimous = if group == outside { inside == 0 } else { (inside == 0) != (out == 0) };
        tally.doubtful += usize::from(free[c] && group == c as u32 && !unanimous);
        free[c] && group != outside && inside > out
    };
    let inside: Vec<bool> = (0..free.len()).map(&mut verdict).collect();
    tally.inside = inside.iter().filter(|&&i| i).count();
    Voronoi { stations, inside }
}

/// The stations of a cell, and whether no ball is shared by all its corners.
fn stations_of(corners: &Corners, delaunay: &Delaunay, cell: CellId) -> ([u32; 4], bool) {
    let mut free = true;
    let stations = [0, 1, 2, 3].map(|opposite| {
        let facet = delaunay.facet_vertices(Facet { cell, opposite });
        let mut lists = facet.map(|v| corners.balls(v));
        lists.sort_unstable_by_key(|list| list.len());
        let [first, second, third] = lists;
        let apex = corners.balls(delaunay.vertices(cell)[opposite]);
        let mut found = NONE;
        for &ball in first.iter().filter(|&b| has(second, *b) && has(third, *b)) {
            free &= !has(apex, ball);
            found = if found == NONE { ball } else { corners.nearer(delaunay, facet, found, ball) };
        }
        found
    });
    (stations, free)
}

fn has(balls: &[u32], ball: u32) -> bool {
    if balls.len() < 16 { balls.contains(&ball) } else { balls.binary_search(&ball).is_ok() }
}

impl Corners {
    /// The ball, of two, whose centre comes first along the outward normal of a facet.
    fn nearer(&self, delaunay: &Delaunay, facet: [VertexId; 3], a: u32, b: u32) -> u32 {
        let [p, q, r] = facet.map(|v| delaunay.point(v));
        let normal = (q - p).cross(r - p);
        let [c, d] = [a, b].map(|ball| self.centre(ball));
        if normal.dot(d - c) < 0.0 { b } else { a }
    }
}

/// Cells whose Voronoi vertices are on one side; the one after the last stands for infinity.
fn joined(delaunay: &Delaunay, stations: &[[u32; 4]], free: &[bool]) -> DisjointSets {
    let infinity = free.len() as u32;
    let mut groups = DisjointSets::singletons(free.len() + 1);
    for cell in delaunay.finite_cells().filter(|c| free[c.index()]) {
        for (opposite, other) in delaunay.neighbours(cell).into_iter().enumerate() {
            if stations[cell.index()][opposite] != NONE {
                continue;
            }
            if delaunay.is_infinite(other) {
                groups.join(cell.0, infinity);
            } else if other > cell {
                groups.join(cell.0, other.0);
            }
        }
    }
    groups
}

/// The numbers of sectors that put a Voronoi vertex inside and outside.
#[derive(Clone, Copy, Default)]
struct Votes {
    inside: u32,
    outside: u32,
}

/// What the sectors say whose edge follows on a Voronoi edge from this cell.
fn votes_of(delaunay: &Delaunay, sectors: &Sectors, cell: CellId, stations: [u32; 4]) -> Votes {
    let mut votes = Votes::default();
    for (opposite, station) in stations.into_iter().enumerate().filter(|s| s.1 != NONE) {
        // Counter-clockwise about each of these directions the Voronoi edge leaves the cell.
        let [a, b, c] = delaunay.facet_vertices(Facet { cell, opposite }).map(|v| v.0);
        for (v, w) in [(a, b), (b, c), (c, a)] {
            let follows = sectors
                .between(v, w)
                .filter(|s| if v < w { s.from == station } else { s.to == station });
            let (mut solid, mut gap) = (0, 0);
            for sector in follows {
                solid += u32::from(sector.solid);
                gap += u32::from(!sector.solid);
            }
            // Where several follow, which of them is next is not known from this.
            votes.inside += u32::from(solid > 0 && gap == 0);
            votes.outside += u32::from(gap > 0 && solid == 0);
        }
    }
    votes
}
