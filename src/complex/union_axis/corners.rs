//! Step 1: the corners (vertices of the boundary, each position once) and the balls that meet there.

use rayon::prelude::*;

use super::{AxisTally, NONE};
use crate::Vec3;
use crate::complex::mesh::run_starts;
use crate::geometry::dual_complex::{CellEdge, Class};
use crate::geometry::triangulation::Facet;
use crate::geometry::{
    CellId, Delaunay, DisjointSets, DualComplex, Sphere, TriangulationError, UnionBoundary,
    UnionVertex, VertexId,
};

/// The corners of a union of balls and their Delaunay triangulation.
pub(super) struct Corners {
    points: Vec<Vec3>,
    /// For each corner the first vertex of the boundary there.
    vertices: Vec<UnionVertex>,
    /// The balls of corner `i` are `balls[start[i]..start[i + 1]]`, ascending.
    start: Vec<u32>,
    balls: Vec<u32>,
    /// For each facet of each cell of the regular triangulation, the corner on the side of the cell.
    at: Vec<u32>,
    /// The centres of all balls.
    centres: Vec<Vec3>,
    /// `None` if the dual complex has no tetrahedron.
    delaunay: Option<Delaunay>,
}

impl Corners {
    pub(super) fn of(
        complex: &DualComplex<'_>,
        balls: &[Sphere],
    ) -> Result<Self, TriangulationError> {
        let boundary = UnionBoundary::new(complex);
        let (points, point_of) = boundary.merge();
        let mut vertices: Vec<UnionVertex> = Vec::with_capacity(points.len());
        for (vertex, &point) in boundary.vertices().iter().zip(&point_of) {
            if point as usize == vertices.len() {
                vertices.push(*vertex);
            }
        }
        let same = same_position(&points);
        let of_vertex: Vec<u32> = point_of.into_iter().map(|point| same[point as usize]).collect();
        let (start, meeting) = balls_of_corners(&boundary, &of_vertex, points.len());
        let delaunay = match complex.tetrahedra().next() {
            Some(_) => Some(spanning(&points, balls)?),
            None => None,
        };
        let at = corners_of_sides(complex, &boundary, &of_vertex);
        let centres = balls.iter().map(|b| b.centre).collect();
        Ok(Self { points, vertices, start, balls: meeting, at, centres, delaunay })
    }

    /// The number of different corners.
    pub(super) fn count(&self) -> usize {
        self.start.windows(2).filter(|pair| pair[0] < pair[1]).count()
    }

    /// One more than the largest index of a corner or an anchor.
    pub(super) fn with_anchors(&self) -> usize {
        self.delaunay.as_ref().map_or(0, Delaunay::point_count).max(self.points.len())
    }

    pub(super) fn point(&self, corner: u32) -> Vec3 {
        self.points[corner as usize]
    }

    pub(super) fn vertices(&self) -> &[UnionVertex] {
        &self.vertices
    }

    pub(super) fn centre(&self, ball: u32) -> Vec3 {
        self.centres[ball as usize]
    }

    pub(super) fn points(&self) -> &[Vec3] {
        &self.points
    }

    pub(super) fn delaunay(&self) -> Option<&Delaunay> {
        self.delaunay.as_ref()
    }

    pub(super) fn cell_count(&self) -> usize {
        self.delaunay.as_ref().map_or(0, |d| d.finite_cell_count())
    }

    /// The corner of a triangle of the dual complex, on the side of the facet's cell.
    pub(super) fn at(&self, facet: Facet) -> u32 {
        self.at[4 * facet.cell.index() + facet.opposite]
    }

    /// The balls that meet in a vertex of the Delaunay triangulation: none in anchors.
    pub(super) fn balls(&self, corner: VertexId) -> &[u32] {
        match self.start.get(corner.index()..corner.index().saturating_add(2)) {
            Some(&[from, to]) => &self.balls[from as usize..to as usize],
            _ => &[],
        }
    }

    /// The Voronoi vertex of a cell with its distance from the corners, and whether it had to be
    /// moved into `bounds`.
    pub(super) fn sphere(&self, cell: CellId, bounds: [Vec3; 2]) -> (Sphere, bool) {
        let delaunay = self.delaunay.as_ref().expect("a cell");
        let p = delaunay.vertices(cell).map(|v| delaunay.point(v));
        let found = delaunay.circumsphere(cell).map(|c| c.0).filter(|c| c.is_finite());
        let mean = (p[0] + p[1] + p[2] + p[3]) / 4.0;
        let centre = found.unwrap_or(mean).clamp(bounds[0], bounds[1]);
        let radius = p.iter().map(|q| q.distance(centre)).fold(f64::INFINITY, f64::min);
        (Sphere::new(centre, radius), found != Some(centre))
    }
}

/// The balls of each corner, as starts of runs and the runs.
fn balls_of_corners(
    boundary: &UnionBoundary,
    of_vertex: &[u32],
    corners: usize,
) -> (Vec<u32>, Vec<u32>) {
    let with_corners = boundary.vertices().iter().zip(of_vertex);
    let mut pairs: Vec<u64> = with_corners
        .flat_map(|(v, &corner)| v.balls.map(|b| u64::from(corner) << 32 | u64::from(b)))
        .collect();
    pairs.par_sort_unstable();
    pairs.dedup();
    let start = run_starts(pairs.iter().map(|pair| (pair >> 32) as u32), corners);
    (start, pairs.into_iter().map(|pair| pair as u32).collect())
}

/// For each facet of each cell the corner of its triangle on the side of the cell.
fn corners_of_sides(
    complex: &DualComplex<'_>,
    boundary: &UnionBoundary,
    of_vertex: &[u32],
) -> Vec<u32> {
    let regular = complex.regular();
    let index = |f: Facet| 4 * f.cell.index() + f.opposite;
    let mut at = vec![NONE; 4 * regular.cell_count()];
    for (vertex, &corner) in boundary.vertices().iter().zip(of_vertex) {
        at[index(regular.mirror(vertex.facet))] = corner;
    }
    // Three spheres that meet in a single point, in the plane of a singular triangle: it is the corner
    // on both sides, but reported once.
    for (facet, _) in complex.triangles().filter(|f| f.1 == Class::Singular) {
        let [one, other] = [facet, regular.mirror(facet)].map(index);
        if at[one] == NONE {
            at[one] = at[other];
        } else if at[other] == NONE {
            at[other] = at[one];
        }
    }
    at
}

/// The box of all centres, which contains the dual complex.
pub(super) fn bounds(balls: &[Sphere]) -> [Vec3; 2] {
    let first = balls.first().map_or(Vec3::ZERO, |b| b.centre);
    let low = balls.iter().fold(first, |m, b| m.min(b.centre));
    [low, balls.iter().fold(first, |m, b| m.max(b.centre))]
}

/// For each point the first one at the same position.
fn same_position(points: &[Vec3]) -> Vec<u32> {
    // Adding 0 turns -0 into +0, which is the same position with other bits.
    let key = |&i: &u32| points[i as usize].to_array().map(|x| (x + 0.0).to_bits());
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    order.sort_unstable_by_key(|i| (key(i), *i));
    let mut first: Vec<u32> = (0..points.len() as u32).collect();
    for run in order.chunk_by(|a, b| key(a) == key(b)) {
        for &i in run {
            first[i as usize] = run[0];
        }
    }
    first
}

/// The Delaunay triangulation of the corners. If they do not span space, four *anchors* are added, so
/// far away that no point among the balls is nearest to one.
fn spanning(corners: &[Vec3], balls: &[Sphere]) -> Result<Delaunay, TriangulationError> {
    match Delaunay::new(corners) {
        Err(error) if error.is_flat() => {}
        result => return result,
    }
    let [low, high] = bounds(balls);
    let radius = balls.iter().map(|b| b.radius).fold(0.0, f64::max);
    let reach = (high - low).max_element() + radius;
    let far = f64::powi(2.0, reach.log2().ceil() as i32 + 4);
    let signs = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
    let anchors = signs.map(|s| low + far * Vec3::from(s));
    Delaunay::new(&[corners, &anchors].concat())
}

// Step 3: the Voronoi vertices of the corners that are inside the dual complex.

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
        self.inside().flat_map(move |cell| {
            let delaunay = corners.delaunay().expect("a cell");
            (0..4).map(move |opposite| match self.station(Facet { cell, opposite }) {
                NONE => [balls + cell.0, balls + delaunay.neighbours(cell)[opposite].0],
                ball => [balls + cell.0, ball],
            })
        })
    }
}

/// Finds the ball centres on Voronoi edges, and the side of each Voronoi vertex.
pub(super) fn classify_sides(
    corners: &Corners,
    sectors: &Sectors,
    tally: &mut AxisTally,
) -> Voronoi {
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
    let mut inside = vec![false; free.len()];
    for c in (0..free.len()).filter(|&c| free[c]) {
        let group = groups.find(c as u32);
        let votes = of_group[group as usize];
        let is_doubtful = match group == outside {
            true => votes.inside > 0,
            false => (votes.inside == 0) == (votes.outside == 0),
        };
        // Each group counts once, at its representative.
        tally.doubtful += usize::from(is_doubtful && group == c as u32);
        inside[c] = group != outside && votes.inside > votes.outside;
    }
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

/// Cells whose Voronoi vertices are on one side; the one after the last is infinity.
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

/// The votes of the sectors whose edge follows on a Voronoi edge from this cell.
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

// Step 2: the sectors around the edges of the dual complex.

/// A sector at the edge from ball `from` to ball `to` between two corners on their circle. The boundary
/// of the corners' facet in the sector runs counter-clockwise about the direction from the smaller corner
/// to the larger, and passes the edge in the direction from `from` to `to`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Sector {
    /// Two different corners, ascending.
    pub(super) corners: [u32; 2],
    pub(super) from: u32,
    pub(super) to: u32,
    /// Whether it is filled by tetrahedra, or is a single triangle.
    pub(super) solid: bool,
}

/// The sectors by corners.
pub(super) struct Sectors {
    sectors: Vec<Sector>,
    /// Where those with smaller corner `i` start.
    start: Vec<u32>,
}

impl Sectors {
    pub(super) fn all(&self) -> &[Sector] {
        &self.sectors
    }

    /// The sectors between two corners, in any order of the two.
    pub(super) fn between(&self, a: u32, b: u32) -> impl Iterator<Item = &Sector> {
        let (low, high) = (a.min(b) as usize, a.max(b));
        let range = match self.start.get(low..low.saturating_add(2)) {
            Some(&[from, to]) => from as usize..to as usize,
            _ => 0..0,
        };
        self.sectors[range].iter().filter(move |s| s.corners[1] == high)
    }
}

/// The sectors with two different corners at all edges with triangles.
pub(super) fn sectors_of(complex: &DualComplex<'_>, corners: &Corners) -> Sectors {
    let edges: Vec<CellEdge> =
        complex.edges().filter(|e| e.1 == Class::Regular).map(|e| e.0).collect();
    let chunks = edges.par_iter().with_min_len(1 << 10);
    let found = chunks.map_init(Vec::new, |walls, &edge| {
        complex.find_walls(edge, walls);
        sectors_at(complex, corners, edge, walls)
    });
    let mut sectors: Vec<Sector> = found.flatten_iter().collect();
    sectors.par_sort_unstable();
    let start = run_starts(sectors.iter().map(|s| s.corners[0]), corners.points().len());
    Sectors { sectors, start }
}

/// Each gap, and each solid sector from the end of a gap to the start of the next.
fn sectors_at(
    complex: &DualComplex<'_>,
    corners: &Corners,
    edge: CellEdge,
    walls: &[[Facet; 2]],
) -> Vec<Sector> {
    let [from, to] = complex.edge_vertices(edge).map(|v| v.0);
    let gaps: Vec<[u32; 2]> = (0..walls.len())
        .filter(|&k| !complex.contains(walls[k][1].cell))
        .map(|k| [walls[k][1], walls[(k + 1) % walls.len()][0]].map(|side| corners.at(side)))
        .collect();
    let mut sectors = Vec::with_capacity(2 * gaps.len());
    for (k, &[start, end]) in gaps.iter().enumerate() {
        let after = gaps[(k + 1) % gaps.len()][0];
        for (a, b, solid) in [(start, end, false), (end, after, true)] {
            debug_assert!(a != NONE && b != NONE, "a corner on each side of a gap");
            if a < b {
                sectors.push(Sector { corners: [a, b], from, to, solid });
            } else if a > b {
                sectors.push(Sector { corners: [b, a], from: to, to: from, solid });
            }
        }
    }
    sectors
}
