//! A closed surface around triangles of any kind.
//!
//! C. Portaneri, M. Rouxel-Labbe, M. Hemmer, D. Cohen-Steiner, P. Alliez 2022, *Alpha wrapping with an offset*, ACM
//! Transactions on Graphics 41(4) 127, <https://doi.org/10.1145/3528223.3530152>.
//!
//! The *offset surface* has the distance `offset` from the input. The wrap is a union of cells of a Delaunay triangulation
//! whose vertices lie on the offset surface. A ball of radius `alpha` that comes from infinity carves the other cells away.
//!
//! 1. *Start*: triangulate the corners of a loose box. The infinite cells are outside.
//! 2. *Carve*: a *gate* is a facet between an outside and an inside cell with no empty ball of radius `alpha` or less
//!    through its corners. Its *dual segment* leads from the circumcentre of the outside cell to that of the inside cell.
//!    - The dual segment meets the offset surface: the gate requests a vertex at the first such point.
//!    - Otherwise, the inside cell meets the input: the gate requests a vertex at the projection of the cell's
//!      circumcentre to the offset surface.
//!    - Otherwise, the inside cell becomes outside.
//! 3. *Refine*: insert the requested vertices, the largest gates first. Continue with step 2 until there is no request.
//! 4. *Manifold*: add outside cells at vertices with several fans of faces until every vertex has one.
//! 5. *Surface*: output the facets between inside and outside.
//!
//! Outside cells never meet the input, so the wrap contains it. The carving starts at infinity, so enclosed cavities are
//! filled. Openings narrower than about `2 alpha` are closed.
//!
//! # Termination
//! A new vertex of the first kind is the centre of an empty ball of a radius above `alpha`. One of the second kind is at
//! least `offset` away from all vertices, because the input in the cell is within its empty circumscribed ball. Batches
//! keep both distances. So the number of vertices is bounded.
//!
//! # Deviations from the paper
//! - Vertices are inserted in batches, because an insertion renumbers the cells. Each batch is followed by a new carving. A
//!   request waits for the next batch if an earlier vertex of its batch removes one of the two cells of its gate.
//! - The order of gates decides the order of insertions alone. A request is void if the carving reaches its cell through
//!   another gate.
//! - The search for the offset surface stops within [`PRECISION`] of it.
//! - At a vertex with several fans the outside cell with the shortest longest edge is added first. The smallest volume
//!   would select long needles, which reach far into the outside. Pockets that this closes are filled.

mod inspect;
#[cfg(test)]
mod tests;
mod tetrahedron;

use std::collections::{BTreeSet, HashMap, HashSet};

use rayon::prelude::*;

use super::closest::TriangleBvh;
use super::mesh::{TriMesh, Unit};
use super::point_grid::PointGrid;
use crate::Vec3;
use crate::geometry::planar_frame::accurate_cross;
use crate::geometry::trees::Bounds;
use crate::geometry::triangulation::Facet;
use crate::geometry::{CellId, Delaunay, Sphere, VertexId};

use tetrahedron::Tetrahedron;

pub use inspect::{WrapOptions, inspect_wrapped};

/// Largest error of a vertex's distance from the input, as a fraction of the offset.
pub const PRECISION: f64 = 0.01;

/// Smallest offset, as a fraction of the largest coordinate. Distances from a smaller one would be rounding errors.
const RESOLUTION: f64 = 1e-12;

/// Limit of vertices, at about 700 bytes each.
const MAX_VERTICES: usize = 2_000_000;

/// Limit of batches.
const MAX_BATCHES: usize = 2_000;

/// Number of corners of the box, the first vertices of the triangulation.
const CORNERS: u32 = 8;

/// A reason why there is no wrap.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the messages name the fields")]
pub enum WrapError {
    /// There are no triangles.
    #[error("nothing to wrap (found 0 triangles)")]
    Empty,
    /// A triangle names a vertex that does not exist, or one with a coordinate that is not finite.
    #[error("triangle {triangle} has the corner {corner}, which does not exist or is not finite")]
    Corner { triangle: usize, corner: u32 },
    /// A length is zero, negative or not finite.
    #[error("{name} must be positive and finite (found {value})")]
    Length { name: &'static str, value: f64 },
    /// The offset is lost in the rounding of the coordinates.
    #[error(
        "the offset is too small for the coordinates (found {found:e}, expected at least {least:e}); move the surface to the origin"
    )]
    Resolution { found: f64, least: f64 },
    /// The wrap needs more vertices or batches than the limits.
    #[error(
        "the wrap is too fine (found more than {vertices} vertices after {batches} batches); use a larger alpha or offset"
    )]
    TooFine { vertices: usize, batches: usize },
}

/// A closed, manifold surface that contains all triangles, oriented outward. Its vertices have the distance `offset` from
/// the triangles, to within [`PRECISION`]. Openings narrower than about `2 alpha` are closed, enclosed cavities filled.
///
/// The triangles may cross, overlap, have any orientation and any number of neighbours. A triangle that repeats a corner
/// is a segment, one with three equal corners a point. Points without a triangle are ignored. Lengths are in the unit of
/// the points. The result does not depend on the number of threads.
///
/// # Errors
/// When there is no triangle, a corner is missing or not finite, a length is not positive, or the wrap needs more than
/// two million vertices.
///
/// # Cost
/// About `(diagonal / alpha)^2` vertices, each with a few searches among the triangles.
///
/// ```
/// use medial::{Vec3, surface};
///
/// // An open surface: one triangle.
/// let wrap = surface::wrap(&[Vec3::ZERO, Vec3::X, Vec3::Y], &[[0, 1, 2]], 0.1, 0.01)?;
/// let report = surface::validate(&wrap).expect("a solid");
/// assert_eq!(report.expected_betti, Some([1, 0, 0]));
/// # Ok::<(), surface::WrapError>(())
/// ```
pub fn wrap(
    points: &[Vec3],
    triangles: &[[u32; 3]],
    alpha: f64,
    offset: f64,
) -> Result<TriMesh, WrapError> {
    let (unit, mut carver) = Carver::new(points, triangles, alpha, offset)?;
    for batch in 0..MAX_BATCHES {
        let (outside, requests) = carver.carve();
        if requests.is_empty() {
            let mut mesh = carver.surface(&carver.manifold(outside));
            mesh.vertices.iter_mut().for_each(|vertex| *vertex = unit.restore(*vertex));
            return Ok(mesh);
        }
        let fresh = batch_of(requests, carver.alpha);
        let vertices = carver.delaunay.point_count() + fresh.len();
        if vertices > MAX_VERTICES {
            return Err(WrapError::TooFine { vertices: MAX_VERTICES, batches: batch });
        }
        carver.delaunay.insert(&fresh).expect("points inside of the box, fewer than ids");
    }
    let vertices = carver.delaunay.point_count();
    Err(WrapError::TooFine { vertices, batches: MAX_BATCHES })
}

/// Corners of the inside cell of a gate, ascending, and of the outside cell the vertex that the facet lacks.
type GateKey = [u32; 5];

/// A facet between an outside and an inside cell that a ball of radius `alpha` can pass.
#[derive(Clone, Copy, Debug)]
struct Gate {
    key: GateKey,
    outer: CellId,
    inner: CellId,
    /// Radius of the smallest empty ball through the corners.
    radius: f64,
    /// Centre of the circle through the corners.
    middle: Vec3,
    /// Unit normal, into the inside cell.
    normal: Vec3,
    /// Ends of the dual segment along the normal, from the middle.
    ends: [f64; 2],
}

/// Outcome of the attempt to pass a gate.
#[derive(Clone, Copy, Debug)]
enum Passage {
    /// The inside cell becomes outside.
    Open,
    /// A vertex is requested.
    Request(Vec3),
    /// The requested vertex would be one that exists, to rounding.
    Shut,
}

/// A vertex requested by a gate.
#[derive(Clone, Copy, Debug)]
struct Request {
    gate: Gate,
    point: Vec3,
    /// Circumscribed balls of the two cells. An earlier vertex of the batch in one of them removes its cell.
    balls: [Option<Sphere>; 2],
}

/// The state of the carving. Lengths are in scaled units.
struct Carver {
    input: TriangleBvh,
    /// Box of the offset surface.
    bounds: Bounds,
    alpha: f64,
    offset: f64,
    delaunay: Delaunay,
    /// Gates of the previous carving. Most of them are unchanged in the next one. Never iterated.
    known: HashMap<GateKey, Passage>,
}

impl Carver {
    /// Step 1, with the scale of its lengths.
    fn new(
        points: &[Vec3],
        triangles: &[[u32; 3]],
        alpha: f64,
        offset: f64,
    ) -> Result<(Unit, Self), WrapError> {
        for (name, value) in [("alpha", alpha), ("offset", offset)] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(WrapError::Length { name, value });
            }
        }
        let corners = corners_of(points, triangles)?;
        let unit = Unit::of(&[corners.as_flattened(), &[Vec3::new(alpha, offset, 0.0)]].concat());
        let corners: Vec<_> = corners.iter().map(|t| t.map(|p| unit.forward(p))).collect();
        let Vec3 { x: scaled_alpha, y: scaled_offset, .. } =
            unit.forward(Vec3::new(alpha, offset, 0.0));
        // The largest scaled coordinate is between 1/2 and 1.
        if scaled_offset < RESOLUTION || scaled_alpha < RESOLUTION {
            let least = unit.restore(Vec3::splat(RESOLUTION)).x;
            return Err(WrapError::Resolution { found: offset, least });
        }
        let (alpha, offset) = (scaled_alpha, scaled_offset);
        let input =
            TriangleBvh::from_triangles(&corners).expect("finite corners of some triangles");
        let tight = Bounds::of_points(corners.into_iter().flatten());
        let grown = |by: f64| Bounds { lo: tight.lo - by, hi: tight.hi + by };
        // Facets with a corner of the box then have a circumradius above alpha: the carving removes them all.
        let Bounds { lo, hi } = grown(2.0 * alpha + 2.0 * offset);
        let corner =
            |k: u32| Vec3::from([0, 1, 2].map(|axis| [lo, hi][(k >> axis & 1) as usize][axis]));
        let delaunay = Delaunay::new(&(0..CORNERS).map(corner).collect::<Vec<_>>());
        let delaunay = delaunay.expect("the corners of a box");
        let bounds = grown(offset * (1.0 + PRECISION));
        Ok((unit, Self { input, bounds, alpha, offset, delaunay, known: HashMap::new() }))
    }

    /// Step 2: the outside cells and the requested vertices.
    ///
    /// In waves: the gates of all cells of a wave are tried in parallel, and the cells behind open ones are the next wave.
    fn carve(&mut self) -> (Vec<bool>, Vec<Request>) {
        let centres = self.delaunay.circumspheres();
        let mut outside = vec![false; self.delaunay.cell_count()];
        let mut wave: Vec<CellId> = self.delaunay.infinite_cells().collect();
        wave.iter().for_each(|cell| outside[cell.index()] = true);
        let (mut requests, mut tried) = (Vec::new(), HashMap::with_capacity(self.known.len()));
        while !wave.is_empty() {
            let passages: Vec<(Gate, Passage)> = (wave.par_iter())
                .flat_map_iter(|&cell| self.gates(cell, &outside, &centres))
                .map(|gate| {
                    let known = self.known.get(&gate.key).copied();
                    (gate, known.unwrap_or_else(|| self.pass(&gate, centres[gate.inner.index()])))
                })
                .collect();
            wave.clear();
            for (gate, passage) in passages {
                tried.insert(gate.key, passage);
                match passage {
                    Passage::Open if !outside[gate.inner.index()] => {
                        outside[gate.inner.index()] = true;
                        wave.push(gate.inner);
                    }
                    Passage::Request(point) => {
                        // An infinite cell is never removed.
                        let ball = |cell: CellId| centres.get(cell.index()).copied().flatten();
                        let balls = [ball(gate.outer), ball(gate.inner)];
                        requests.push(Request { gate, point, balls });
                    }
                    Passage::Open | Passage::Shut => {}
                }
            }
        }
        self.known = tried;
        requests.retain(|request| !outside[request.gate.inner.index()]);
        (outside, requests)
    }

    /// The gates of an outside cell.
    fn gates(&self, cell: CellId, outside: &[bool], centres: &[Option<Sphere>]) -> Vec<Gate> {
        let neighbours = self.delaunay.neighbours(cell).into_iter().enumerate();
        let inner = neighbours.filter(|(_, inner)| !outside[inner.index()]);
        let gates = inner.map(|(opposite, inner)| self.gate(cell, opposite, inner, centres));
        gates.filter(|gate| gate.radius > self.alpha).collect()
    }

    fn gate(
        &self,
        cell: CellId,
        opposite: usize,
        inner: CellId,
        centres: &[Option<Sphere>],
    ) -> Gate {
        let facet = self.delaunay.facet_vertices(Facet { cell, opposite });
        let [a, b, c] = facet.map(|v| self.delaunay.point(v));
        let (u, v) = (b - a, c - a);
        let across = accurate_cross(u, v);
        let arm = (u.length_squared() * v - v.length_squared() * u).cross(across)
            / (2.0 * across.length_squared());
        let (middle, normal) = (a + arm, across.normalize());
        let along =
            |cell: CellId| centres[cell.index()].map(|ball| (ball.centre - middle).dot(normal));
        // From infinity the segment starts on the box: it is away from the offset surface before.
        let is_infinite = self.delaunay.is_infinite(cell);
        let start = if is_infinite { 0.0 } else { along(cell).unwrap_or(f64::NEG_INFINITY) };
        let ends = [start, along(inner).unwrap_or(f64::INFINITY).max(start)];
        let radius = arm.length().hypot(0_f64.max(ends[0]).min(ends[1]));
        let mut key = [0; 5];
        key[..4].copy_from_slice(&self.delaunay.vertices(inner).map(|v| v.0));
        key[..4].sort_unstable();
        key[4] = self.delaunay.vertices(cell)[opposite].0;
        Gate { key, outer: cell, inner, radius, middle, normal, ends }
    }

    /// Tries to pass a gate. `ball` is the circumscribed ball of the inside cell.
    fn pass(&self, gate: &Gate, ball: Option<Sphere>) -> Passage {
        let segment = self.clipped(gate);
        let point = if let Some(hit) = segment.and_then(|ends| self.first_hit(gate, ends)) {
            hit
        } else if self.meets_input(gate.inner) {
            let end = gate.middle + segment.map_or(0.0, |[_, end]| end) * gate.normal;
            let centre = ball.map_or(end, |ball| ball.centre);
            let foot = self.input.closest(centre).point;
            foot + self.offset * (centre - foot).normalize_or(gate.normal)
        } else {
            return Passage::Open;
        };
        // Rounding alone can bring it so near to a vertex.
        let nearest = self.corners(gate.inner).map(|corner| corner.distance(point));
        let is_new = nearest.into_iter().fold(f64::INFINITY, f64::min) > PRECISION * self.offset;
        if is_new { Passage::Request(point) } else { Passage::Shut }
    }

    /// The ends of the dual segment within the box of the offset surface.
    fn clipped(&self, gate: &Gate) -> Option<[f64; 2]> {
        let [mut from, mut to] = gate.ends;
        for axis in 0..3 {
            let (p, v) = (gate.middle[axis], gate.normal[axis]);
            let [lo, hi] = [self.bounds.lo, self.bounds.hi].map(|bound| bound[axis]);
            if v == 0.0 {
                if p < lo || p > hi {
                    return None;
                }
                continue;
            }
            let [s, t] = [(lo - p) / v, (hi - p) / v];
            (from, to) = (from.max(s.min(t)), to.min(s.max(t)));
        }
        (from <= to).then_some([from, to])
    }

    /// The first point of a dual segment on the offset surface, by steps of the distance to it.
    fn first_hit(&self, gate: &Gate, [from, to]: [f64; 2]) -> Option<Vec3> {
        // Steps are longer by this length, so that a segment along the offset surface ends in few of them.
        let slack = 0.5 * PRECISION * self.offset;
        let (mut at, mut face) = (from, None);
        loop {
            let p = gate.middle + at * gate.normal;
            let closest = self.input.closest_from(p, face);
            let height = closest.distance - self.offset;
            if height <= slack {
                return Some(p);
            }
            if at >= to {
                return None;
            }
            face = Some(closest.face);
            at = (at + height + slack).min(to);
        }
    }

    fn meets_input(&self, cell: CellId) -> bool {
        let cell = Tetrahedron::new(self.corners(cell));
        self.input.any(|bounds| cell.may_meet_box(bounds), |triangle| cell.meets(triangle))
    }

    fn corners(&self, cell: CellId) -> [Vec3; 4] {
        self.delaunay.vertices(cell).map(|v| self.delaunay.point(v))
    }

    /// Step 4: the outside cells that remain.
    fn manifold(&self, mut outside: Vec<bool>) -> Vec<bool> {
        let all = 0..self.delaunay.point_count() as u32;
        let pinched = all.into_par_iter().filter(|&v| self.is_pinched(v, &outside));
        let mut pinched: BTreeSet<u32> = pinched.collect::<Vec<_>>().into_iter().collect();
        while let Some(vertex) = pinched.pop_first() {
            if !self.is_pinched(vertex, &outside) {
                continue;
            }
            // Cells with a corner of the box last: they would bring it into the wrap.
            let rank = |cell: &CellId| {
                let at_box = self.delaunay.vertices(*cell).iter().any(|v| v.0 < CORNERS);
                let corners = self.corners(*cell);
                let longest = corners.iter().flat_map(|p| corners.map(|q| p.distance_squared(q)));
                (at_box, longest.fold(0.0, f64::max))
            };
            let star = self.star(vertex).into_iter();
            let open =
                star.filter(|&cell| outside[cell.index()] && !self.delaunay.is_infinite(cell));
            let ranked = open.map(|cell| (rank(&cell), cell));
            let least = ranked
                .min_by(|(r, c), (s, d)| r.0.cmp(&s.0).then(r.1.total_cmp(&s.1)).then(c.cmp(d)));
            let Some((_, cell)) = least else { continue };
            outside[cell.index()] = false;
            pinched.extend(self.delaunay.vertices(cell).map(|v| v.0));
        }
        self.reachable(&outside)
    }

    /// The outside cells with a way to infinity through outside cells.
    fn reachable(&self, outside: &[bool]) -> Vec<bool> {
        let mut reached = vec![false; outside.len()];
        let mut stack: Vec<CellId> = self.delaunay.infinite_cells().collect();
        while let Some(cell) = stack.pop() {
            if outside[cell.index()] && !reached[cell.index()] {
                reached[cell.index()] = true;
                stack.extend(self.delaunay.neighbours(cell));
            }
        }
        reached
    }

    /// Whether the inside or the outside cells at a vertex are connected through common facets in more than one part.
    /// Otherwise their boundary at the vertex is one fan, and every edge of it has two faces.
    fn is_pinched(&self, vertex: u32, outside: &[bool]) -> bool {
        let star = self.star(vertex);
        let parts = |side: bool| {
            let mut left: BTreeSet<CellId> =
                star.iter().copied().filter(|cell| outside[cell.index()] == side).collect();
            let mut parts = 0;
            while let Some(first) = left.pop_first() {
                parts += 1;
                let mut stack = vec![first];
                while let Some(cell) = stack.pop() {
                    // The facet opposite to the vertex leads out of its star.
                    stack.extend(
                        self.delaunay.neighbours(cell).into_iter().filter(|next| left.remove(next)),
                    );
                }
            }
            parts
        };
        parts(false) > 1 || (parts(false) == 1 && parts(true) > 1)
    }

    /// The cells of a vertex, in an order of their own.
    fn star(&self, vertex: u32) -> Vec<CellId> {
        let Some(first) = self.delaunay.incident_cell(VertexId(vertex)) else { return Vec::new() };
        let (mut star, mut seen) = (vec![first], HashSet::from([first]));
        let mut next = 0;
        while let Some(&cell) = star.get(next) {
            next += 1;
            for neighbour in self.delaunay.neighbours(cell) {
                let is_at = self.delaunay.vertices(neighbour).contains(&VertexId(vertex));
                if is_at && seen.insert(neighbour) {
                    star.push(neighbour);
                }
            }
        }
        star
    }

    /// Step 5, with the vertices in the order of their insertion.
    fn surface(&self, outside: &[bool]) -> TriMesh {
        let inside = self.delaunay.finite_cells().filter(|cell| !outside[cell.index()]);
        let mut faces: Vec<[u32; 3]> = Vec::new();
        for cell in inside {
            for (opposite, neighbour) in self.delaunay.neighbours(cell).into_iter().enumerate() {
                if outside[neighbour.index()] {
                    let facet = Facet { cell, opposite };
                    faces.push(self.delaunay.facet_vertices(facet).map(|v| v.0));
                }
            }
        }
        let mut used: Vec<u32> = faces.as_flattened().to_vec();
        used.sort_unstable();
        used.dedup();
        for vertex in faces.as_flattened_mut() {
            *vertex = used.partition_point(|&v| v < *vertex) as u32;
        }
        let vertices = used.iter().map(|&v| self.delaunay.point(VertexId(v))).collect();
        TriMesh { vertices, faces }
    }
}

/// The corners of all triangles.
fn corners_of(points: &[Vec3], triangles: &[[u32; 3]]) -> Result<Vec<[Vec3; 3]>, WrapError> {
    if triangles.is_empty() {
        return Err(WrapError::Empty);
    }
    let valid = |corner: &u32| points.get(*corner as usize).is_some_and(|p| p.is_finite());
    for (triangle, corners) in triangles.iter().enumerate() {
        if let Some(&corner) = corners.iter().find(|corner| !valid(corner)) {
            return Err(WrapError::Corner { triangle, corner });
        }
    }
    Ok(triangles.iter().map(|corners| corners.map(|v| points[v as usize])).collect())
}

/// Step 3: the vertices of a batch, those of the largest gates first, without those of gates that an earlier vertex may
/// remove.
fn batch_of(mut requests: Vec<Request>, alpha: f64) -> Vec<Vec3> {
    requests
        .sort_by(|a, b| b.gate.radius.total_cmp(&a.gate.radius).then(a.gate.key.cmp(&b.gate.key)));
    let mut grid = PointGrid::new(alpha);
    let mut fresh = Vec::new();
    for Request { point, balls, .. } in requests {
        let is_removed = |ball: &Sphere| grid.any_within(ball.centre, ball.radius);
        if !balls.iter().flatten().any(is_removed) {
            grid.insert(point);
            fresh.push(point);
        }
    }
    fresh
}
