//! Step 4: the parts of the Voronoi facets inside the dual complex.

use rayon::prelude::*;

use super::corners::Corners;
use super::sectors::Sectors;
use super::sides::Voronoi;
use super::{AxisTally, NONE};
use crate::Vec3;
use crate::geometry::CellId;
use crate::geometry::triangulation::Facet;

/// A directed side of the part of a facet, counter-clockwise about the direction from the smaller
/// corner to the larger. Vertices are balls, then cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Side {
    pub(super) corners: [u32; 2],
    pub(super) from: u32,
    pub(super) to: u32,
}

/// A part of a facet.
#[derive(Clone, Debug, Default)]
pub(super) struct Polygon {
    pub(super) between: [u32; 2],
    /// The positions of the corners.
    pub(super) corners: [Vec3; 2],
    pub(super) vertices: Vec<u32>,
}

impl Polygon {
    /// The sides, in no particular direction.
    pub(super) fn edges(&self) -> impl Iterator<Item = [u32; 2]> + '_ {
        let v = &self.vertices;
        (0..v.len()).map(move |k| [v[k], v[(k + 1) % v.len()]])
    }

    /// Triangles from the smallest vertex.
    pub(super) fn fan(&self) -> impl Iterator<Item = [u32; 3]> + '_ {
        fan(&self.vertices)
    }
}

/// Triangles of a polygon from its smallest vertex.
pub(super) fn fan(v: &[u32]) -> impl Iterator<Item = [u32; 3]> + '_ {
    let first = (0..v.len()).min_by_key(|&k| v[k]).unwrap_or(0);
    let at = move |k: usize| v[(first + k) % v.len()];
    (1..v.len().saturating_sub(1)).map(move |k| [at(0), at(k), at(k + 1)])
}

/// The sides along edges of the dual complex.
pub(super) fn solid_sides(sectors: &Sectors) -> Vec<Side> {
    let solid = sectors.all().iter().filter(|s| s.solid);
    solid.map(|s| Side { corners: s.corners, from: s.from, to: s.to }).collect()
}

/// For each edge of a cell the indices of its other vertices: an even permutation.
const EDGES: [[usize; 4]; 6] =
    [[0, 1, 2, 3], [0, 2, 3, 1], [0, 3, 1, 2], [1, 2, 0, 3], [1, 3, 2, 0], [2, 3, 0, 1]];

/// Adds the sides along Voronoi edges. Each starts or ends in a cell inside.
pub(super) fn voronoi_sides(
    corners: &Corners,
    voronoi: &Voronoi,
    balls: u32,
    sides: &mut Vec<Side>,
) {
    let Some(delaunay) = corners.delaunay() else { return };
    let of_cell = |c: u32| {
        let cell = CellId(c);
        let v = delaunay.vertices(cell).map(|v| v.0);
        let neighbours = delaunay.neighbours(cell);
        let station = move |opposite| match voronoi.station(Facet { cell, opposite }) {
            NONE => (balls + neighbours[opposite].0, false),
            ball => (ball, true),
        };
        EDGES.into_iter().flat_map(move |[i, j, x, y]| {
            // Counter-clockwise about (i, j) the ring leaves through the facet without x.
            let ascending = v[i] < v[j];
            let (leave, enter) = if ascending { (x, y) } else { (y, x) };
            let corners = [v[i].min(v[j]), v[i].max(v[j])];
            let here = balls + c;
            let (to, _) = station(leave);
            // A side that enters from another cell inside is reported by that cell as leaving.
            let (from, is_ball) = station(enter);
            let entering = is_ball.then_some(Side { corners, from, to: here });
            [Some(Side { corners, from: here, to }), entering].into_iter().flatten()
        })
    };
    let cells = (0..voronoi.len() as u32).into_par_iter().with_min_len(1 << 9);
    let found: Vec<Side> =
        cells.filter(|&c| voronoi.contains(CellId(c))).flat_map_iter(of_cell).collect();
    sides.extend(found);
}

/// Joins the sides of each facet to polygons. `corners` is their number, anchors included.
pub(super) fn close_up(sides: &[Side], corners: usize, tally: &mut AxisTally) -> Vec<Polygon> {
    let mut sides = by_first_corner(sides, corners);
    sides.par_chunk_by_mut(|a, b| a.corners[0] == b.corners[0]).for_each(<[Side]>::sort_unstable);
    let facets: Vec<&[Side]> = sides.chunk_by(|a, b| a.corners == b.corners).collect();
    let chunks = facets.par_iter().with_min_len(1 << 9);
    let traced: Vec<Traced> = chunks
        .map(|sides| match single(sides) {
            Some(polygon) => Traced { single: Some(polygon), ..Traced::default() },
            None => trace(sides),
        })
        .collect();
    tally.open += traced.iter().filter(|t| t.open).count();
    traced.into_iter().flat_map(|t| t.single.into_iter().chain(t.several)).collect()
}

/// The sides in the order of their smaller corners, by a counting sort: a comparison sort of all sides
/// would take longer than the rest of the axis.
fn by_first_corner(sides: &[Side], corners: usize) -> Vec<Side> {
    let mut next = vec![0_u32; corners + 1];
    for side in sides {
        next[side.corners[0] as usize + 1] += 1;
    }
    for corner in 0..corners {
        next[corner + 1] += next[corner];
    }
    let mut sorted = vec![Side { corners: [NONE; 2], from: NONE, to: NONE }; sides.len()];
    for side in sides {
        let place = &mut next[side.corners[0] as usize];
        sorted[*place as usize] = *side;
        *place += 1;
    }
    sorted
}

/// The polygons of one facet.
#[derive(Default)]
struct Traced {
    single: Option<Polygon>,
    several: Vec<Polygon>,
    /// Whether some sides do not close up.
    open: bool,
}

/// If the sides form one simple polygon (the usual case), that polygon.
fn single(sides: &[Side]) -> Option<Polygon> {
    // Sorted by start: two sides from one vertex are neighbours, and make the polygon not simple.
    if sides.len() < 3 || sides.windows(2).any(|pair| pair[0].from == pair[1].from) {
        return None;
    }
    let mut vertices = Vec::with_capacity(sides.len());
    let mut at = 0;
    while vertices.len() < sides.len() {
        vertices.push(sides[at].from);
        at = sides.binary_search_by_key(&sides[at].to, |side| side.from).ok()?;
        if at == 0 {
            break;
        }
    }
    let is_whole = at == 0 && vertices.len() == sides.len();
    is_whole.then(|| Polygon { between: sides[0].corners, vertices, ..Polygon::default() })
}

/// The simple polygons of a facet in the general case.
fn trace(sides: &[Side]) -> Traced {
    let sides = without_opposites(sides);
    let between = sides.first().map_or([NONE; 2], |s| s.corners);
    // Sides from one vertex are consecutive; the index of the first stands for the vertex.
    let vertex = |v: u32| sides.partition_point(|s| s.from < v);
    let mut taken = vec![false; sides.len()];
    let mut on_path = vec![NONE; sides.len()];
    let (mut polygons, mut open) = (Vec::new(), false);
    for start in 0..sides.len() {
        let mut path: Vec<u32> = Vec::new();
        let mut here = sides[start].from;
        loop {
            let at = vertex(here);
            if on_path.get(at).is_some_and(|&p| p != NONE) {
                // The path meets itself: the part since the first visit is a simple polygon.
                let cycle = path.split_off(on_path[at] as usize);
                for &v in &cycle {
                    on_path[vertex(v)] = NONE;
                }
                if cycle.len() > 2 {
                    polygons.push(Polygon { between, vertices: cycle, ..Polygon::default() });
                }
            }
            let free =
                (at..sides.len()).take_while(|&k| sides[k].from == here).find(|&k| !taken[k]);
            let Some(next) = free else { break };
            taken[next] = true;
            on_path[at] = path.len() as u32;
            path.push(here);
            here = sides[next].to;
        }
        open |= !path.is_empty();
        for v in path {
            on_path[vertex(v)] = NONE;
        }
    }
    Traced { single: None, several: polygons, open }
}

/// The sides that are left, in order, after each pair of opposite sides has cancelled.
fn without_opposites(sides: &[Side]) -> Vec<Side> {
    let mut left: Vec<Side> = Vec::with_capacity(sides.len());
    for run in sides.chunk_by(|a, b| a == b) {
        let side = run[0];
        let opposite = Side { from: side.to, to: side.from, ..side };
        let others =
            sides.partition_point(|s| *s <= opposite) - sides.partition_point(|s| *s < opposite);
        left.extend(std::iter::repeat_n(side, run.len().saturating_sub(others)));
    }
    left
}
