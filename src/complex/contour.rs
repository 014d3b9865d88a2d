//! The boundary surface of the union of spheres, cones and slabs of a medial mesh.
//!
//! With `sigma` the least signed distance to a primitive, negative inside and 1-Lipschitz
//! ([`MedialUnion`]):
//!
//! 1. A cube around the union is filled with tetrahedra. Those that may meet the boundary, judged by
//!    `sigma` at their vertices, are bisected until no edge is longer than 4/5 of the tolerance, or
//!    than the radius of the union's balls there if that is less.
//! 2. Marching tetrahedra: a closed manifold with its vertices on the boundary.
//! 3. Edges shorter than a quarter of the tetrahedron's edge are contracted: a closed manifold stays one,
//!    and vertices stay on the boundary ([`contract_short_edges`]).
//!
//! # The tolerance
//!
//! Every point with `sigma > tolerance` is outside the surface, and every point with
//! `sigma < -tolerance` is inside. Proof: let `d` be the longest edge of the tetrahedron that holds the
//! point. If `|sigma| > d` at the point, all four vertices are on its side, so the surface does not
//! enter the tetrahedron. If `d` is larger than 4/5 of the tolerance, the tetrahedron was not refined
//! because `|sigma| > d` at a vertex; then it is on one side as a whole. Contraction moves the surface
//! by at most `d / 4`.
//!
//! So no point of the surface is farther than the tolerance from the union, or deeper in it. On smooth
//! parts the distance is much less, about `d^2 / 8 r` for curvature radius `r`. Features thinner than a
//! tetrahedron can be missed: parts of the union with a radius below 1/20 of the tolerance
//! ([`UnionSurface::lost`]), and crevices and holes narrower than the tolerance. A crevice that is
//! missed only in some places is bridged there, so the surface has loops that the union does not have;
//! [`union_betti`](crate::metrics::union_betti) detects this.

use std::collections::HashMap;
use std::hash::BuildHasherDefault;

use rayon::prelude::*;

use super::{MedialMesh, MedialUnion, UnionError};
use crate::Vec3;
use crate::geometry::hash::KeyHasher;
use crate::surface::{Folds, TriMesh, contract_short_edges};

/// The boundary surface of a union, see [`union_surface`].
#[derive(Clone, Debug, PartialEq)]
pub struct UnionSurface {
    /// Closed and manifold, counter-clockwise as seen from outside.
    pub mesh: TriMesh,
    /// Tetrahedra that were needed.
    pub tetrahedra: usize,
    /// Spheres with a radius below the smallest tetrahedron: these, and parts that taper to them, may be
    /// missing.
    pub lost: usize,
    /// Radius below which a sphere counts as lost, in the unit of the mesh.
    pub smallest: f64,
}

/// Why there is no surface.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the messages name the fields")]
pub enum ContourError {
    /// The medial mesh has no union.
    #[error(transparent)]
    Union(#[from] UnionError),
    /// The tolerance is not a positive number.
    #[error("tolerance {0}: not positive")]
    Tolerance(f64),
    /// The tolerance is too fine for the memory that this may take.
    #[error(
        "tolerance {tolerance:e}: needs more than {most} tetrahedra, or too fine ones; {feasible:e} is feasible"
    )]
    TooFine { tolerance: f64, most: usize, feasible: f64 },
    /// No part of the union is thick enough.
    #[error("no part of the union is as thick as {smallest:e}; use a tolerance below {feasible:e}")]
    TooThin { smallest: f64, feasible: f64 },
    /// The tolerance is too fine for the memory, and coarser ones show no part of the union.
    #[error(
        "too thin for its extent (largest radius {largest:e}): a surface of it needs more than {most} tetrahedra; give \
         larger radii"
    )]
    TooSlender { largest: f64, most: usize },
    /// All radii are zero or subnormal.
    #[error(
        "all spheres have radius zero, or below {:.1e}: their union has no inside",
        f64::MIN_POSITIVE
    )]
    NoInside,
}

/// Tetrahedra's edges as a share of the tolerance; contraction takes the rest.
const EDGE_SHARE: f64 = 0.8;

/// Edges shorter than this share of the tetrahedron's edge that the vertex is on are contracted.
const CONTRACTED: f64 = 0.25;

/// Tetrahedra are refined to the radius of the union's balls, but no further than to this share of the
/// edge that the tolerance requires.
const MIN_SHARE_OF_CELL: f64 = 1.0 / 16.0;

/// A feasible tolerance is larger than the least one by this factor, since messages round it.
const ADVISED: f64 = 1.1;

/// Bound on the number of tetrahedra: about 4 GB.
const MAX_TETRAHEDRA: usize = 50_000_000;

/// The boundary of the union of all primitives of a medial mesh as triangles. `tolerance` is in the unit of
/// the mesh; the head of this file defines it.
///
/// The time and memory grow with the area of the boundary over the square of the tolerance. Parallel;
/// the same surface for any number of threads.
///
/// ```
/// use medial::{Vec3, surface};
/// use medial::complex::{MedialMesh, Sphere, union_surface};
///
/// let spheres = vec![Sphere::new(Vec3::ZERO, 1.0), Sphere::new(4.0 * Vec3::X, 1.0)];
/// let capsule = MedialMesh::from_simplices(spheres, vec![[0, 1]], vec![])?;
/// let boundary = union_surface(&capsule, 0.2)?;
/// let report = surface::validate(&boundary.mesh)?;
/// let exact = std::f64::consts::PI * (4.0 / 3.0 + 4.0);
/// assert!((report.volume.unwrap() / exact - 1.0).abs() < 0.01);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// When the mesh has no union, the tolerance is not positive, or so fine that more than 50 million
/// tetrahedra would be needed, and when nothing is thick enough to show.
pub fn union_surface(mesh: &MedialMesh, tolerance: f64) -> Result<UnionSurface, ContourError> {
    union_surface_within(mesh, tolerance, MAX_TETRAHEDRA)
}

/// [`union_surface`] with at most `most` tetrahedra, of some 80 bytes each.
///
/// # Errors
/// As [`union_surface`].
pub fn union_surface_within(
    mesh: &MedialMesh,
    tolerance: f64,
    most: usize,
) -> Result<UnionSurface, ContourError> {
    mesh.check().map_err(UnionError::from)?;
    if !(tolerance > 0.0 && tolerance.is_finite()) {
        return Err(ContourError::Tolerance(tolerance));
    }
    let largest = mesh.spheres.iter().map(|m| m.radius).fold(0.0, f64::max);
    if largest < f64::MIN_POSITIVE && !mesh.spheres.is_empty() {
        return Err(ContourError::NoInside);
    }
    // Products of three tiny lengths would underflow, and turn faces over.
    let unit = mesh.unit();
    let made = contour(&mesh.transformed(1.0 / unit, |p| p / unit), tolerance / unit, most);
    let made = made.map_err(|error| match error {
        ContourError::TooFine { most, feasible, .. } => {
            ContourError::TooFine { tolerance, most, feasible: unit * feasible }
        }
        ContourError::TooThin { smallest, feasible } => {
            ContourError::TooThin { smallest: unit * smallest, feasible: unit * feasible }
        }
        ContourError::TooSlender { most, .. } => ContourError::TooSlender { largest, most },
        other => other,
    });
    let UnionSurface { mut mesh, tetrahedra, lost, smallest } = made?;
    mesh.vertices.iter_mut().for_each(|vertex| *vertex *= unit);
    Ok(UnionSurface { mesh, tetrahedra, lost, smallest: unit * smallest })
}

/// [`union_surface_within`] for lengths of about 1.
fn contour(mesh: &MedialMesh, tolerance: f64, most: usize) -> Result<UnionSurface, ContourError> {
    let union = MedialUnion::new(mesh)?;
    let largest = mesh.spheres.iter().map(|m| m.radius).fold(0.0, f64::max);
    let longest = EDGE_SHARE * tolerance;
    let smallest = MIN_SHARE_OF_CELL * longest;
    // With edges of half its radius, a ball certainly contains a vertex.
    let too_thin = ContourError::TooThin { smallest, feasible: 0.5 * largest / EDGE_SHARE };
    let (lo, hi) = union.bounding_box();
    let extent = (hi - lo).max_element();
    if 0.5 * largest < Bisection::of_cube(lo, 1.2 * extent).longest_edge(MAX_BISECTIONS) {
        return Err(ContourError::TooSlender { largest, most });
    }
    if largest < smallest {
        return Err(too_thin);
    }
    // A cube with the union in its inside. It is off centre by odd fractions, so that symmetric unions do not have
    // their boundary run through vertices.
    let extent = extent.max(longest);
    let margin = 0.1 * extent * Vec3::new(0.731, 0.617, 0.849);
    let mut grid = Bisection::of_cube(lo - margin, 1.2 * extent);
    let sizes: Vec<f64> = (0..=MAX_BISECTIONS).map(|g| grid.longest_edge(g)).collect();
    let goal = sizes.iter().position(|&s| s <= longest).unwrap_or(sizes.len() - 1) as u8;
    let refined = grid.refine(
        goal,
        most,
        |points: &[Vec3]| {
            let found = union.deepest_ball_batch(points).into_iter();
            found.map(|(signed, radius, place)| Value { signed, radius, place }).collect()
        },
        |leaf: &Leaf, values: [Value; 4]| {
            let size = sizes[usize::from(leaf.generation)];
            let radius = values.iter().map(|v| v.radius).fold(f64::INFINITY, f64::min);
            // A vertex farther from the boundary than the longest edge: the boundary is not in the leaf.
            size > longest.min(radius.max(smallest))
                && values.iter().all(|v| v.signed.abs() <= size)
        },
    );
    refined.map_err(|TooMany { generation, leaves }| {
        let size = sizes[usize::from(generation)];
        // Feasible even if everything thinner is refined as far as possible.
        let least = mesh.spheres.iter().map(|m| m.radius).fold(largest, f64::min);
        let size = if least < size { size / MIN_SHARE_OF_CELL } else { size };
        // Three bisections make four of one. Predictions can be too low.
        let share = leaves as f64 / most as f64;
        let share = share.max((HOPELESS * share).min(1.0));
        let feasible = ADVISED * size / EDGE_SHARE * share.sqrt();
        // Coarser ones are too thin, up to a factor of 2 that leaves room for the rounding of an advice.
        let shown = 0.5 * largest / (MIN_SHARE_OF_CELL * EDGE_SHARE);
        match shown < feasible && shown <= 2.0 * tolerance {
            true => ContourError::TooSlender { largest, most },
            false => ContourError::TooFine { tolerance, most, feasible: feasible.min(shown) },
        }
    })?;
    if sizes[usize::from(goal)] > longest {
        let feasible = ADVISED * sizes[usize::from(goal)] / EDGE_SHARE;
        return Err(ContourError::TooFine { tolerance, most, feasible });
    }
    let (raw, edges) = march(&grid, &union);
    if raw.faces.is_empty() {
        return Err(too_thin);
    }
    let limits: Vec<f64> = edges.iter().map(|length| CONTRACTED * length).collect();
    let surface = contract_short_edges(&raw, &limits, Folds::Refused).mesh;
    let lost = mesh.spheres.iter().filter(|m| m.radius < smallest).count();
    Ok(UnionSurface { mesh: surface, tetrahedra: grid.leaves.len(), lost, smallest })
}

// The surface between tetrahedra's vertices inside and outside: marching tetrahedra.
//
// A. Doi, A. Koide: *An efficient method of triangulating equi-valued surfaces by using tetrahedral
// cells*, IEICE Transactions E74 (1991).
//
// 1. Each edge of the tetrahedra with ends on different sides has one vertex of the surface, where
//    the signed distance is zero, found by the Illinois variant of regula falsi, for one primitive first.
// 2. In a tetrahedron with one or three vertices inside, the three vertices on its edges are a
//    triangle; with two inside, the four are cut into two triangles along the shorter diagonal.
//
// Tetrahedra are conforming, so that every edge of the result is in the common face of two of them and
// has two triangles, and the triangles around a vertex go once around its edge: the result is a closed
// manifold, always.

/// For each vertex of a tetrahedron the other three, so that the four are an even permutation.
const OTHERS: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// The even permutations that begin with an ascending pair.
const PAIRS: [[usize; 4]; 6] =
    [[0, 1, 2, 3], [0, 2, 3, 1], [0, 3, 1, 2], [1, 2, 0, 3], [1, 3, 2, 0], [2, 3, 0, 1]];

/// Largest distance of a vertex from the boundary, in lengths of its edge.
const VERTEX_TOLERANCE: f64 = 1e-9;

/// Evaluations on one edge: halving alone would reach the resolution of doubles.
const MAX_STEPS: usize = 60;

/// Steps on one edge that may look at one primitive alone.
const STEPS_ALONE: usize = 8;

/// The surface, and for each of its vertices the length of the edge that it is on.
fn march(grid: &Bisection, union: &MedialUnion) -> (TriMesh, Vec<f64>) {
    let mixed: Vec<&Leaf> = grid
        .leaves
        .iter()
        .filter(|leaf| {
            let count = leaf.vertices.iter().filter(|&&v| grid.is_inside(v)).count();
            count != 0 && count != 4
        })
        .collect();
    let mut edges: Vec<u64> = mixed
        .par_iter()
        .flat_map_iter(|leaf| {
            let v = leaf.vertices;
            let pairs = PAIRS.map(|[i, j, ..]| (v[i], v[j])).into_iter();
            pairs
                .filter(|&(a, b)| grid.is_inside(a) != grid.is_inside(b))
                .map(|(a, b)| edge_key(a, b))
        })
        .collect();
    // Sorted keys number the vertices: the same numbers for any number of threads.
    edges.par_sort_unstable();
    edges.dedup();
    let chunks = edges.par_iter().with_min_len(1 << 8);
    let found: Vec<(Vec3, f64)> = chunks
        .map(|&key| {
            let ends = [(key >> 32) as u32, key as u32];
            let [a, b] = ends.map(|v| grid.position(v));
            let [at_a, at_b] = ends.map(|v| grid.values[v as usize]);
            let near = at_a.place as usize;
            (crossing(union, near, [a, b], [at_a.signed, at_b.signed]), a.distance(b))
        })
        .collect();
    let vertices: Vec<Vec3> = found.iter().map(|f| f.0).collect();
    let faces = mixed
        .par_iter()
        .with_min_len(1 << 10)
        .flat_map_iter(|leaf| {
            let x = leaf.vertices;
            let (polygon, corners) = polygon(x.map(|v| grid.is_inside(v)));
            let mut ring = [0; 4];
            for (vertex, (i, j)) in ring.iter_mut().zip(polygon).take(corners) {
                let place = edges.binary_search(&edge_key(x[i], x[j]));
                *vertex = place.expect("listed, its ends are on different sides") as u32;
            }
            let ring = &mut ring[..corners];
            // `polygon` assumes a positive tetrahedron; bisection makes both orientations.
            let [a, b, c, d] = x.map(|v| grid.position(v));
            if (b - a).cross(c - a).dot(d - a) < 0.0 {
                ring.reverse();
            }
            cut(ring, &vertices)
        })
        .collect();
    (TriMesh { vertices, faces }, found.iter().map(|f| f.1).collect())
}

fn edge_key(a: u32, b: u32) -> u64 {
    u64::from(a.min(b)) << 32 | u64::from(a.max(b))
}

/// Step 2: the edges that the surface crosses in a positive tetrahedron, counter-clockwise as seen from
/// outside, and their number.
fn polygon(inside: [bool; 4]) -> ([(usize, usize); 4], usize) {
    let count = inside.iter().filter(|&&i| i).count();
    if count == 2 {
        let both = PAIRS.iter().find(|[i, j, ..]| inside[*i] && inside[*j]);
        let &[i, j, k, l] = both.expect("two are inside");
        return ([(i, k), (i, l), (j, l), (j, k)], 4);
    }
    // The one that is alone on its side.
    let i = (0..4).find(|&i| inside[i] == (count == 1)).expect("the sides are mixed");
    let [j, k, l] = OTHERS[i];
    let ring = if count == 1 { [(i, j), (i, k), (i, l)] } else { [(i, l), (i, k), (i, j)] };
    ([ring[0], ring[1], ring[2], (i, i)], 3)
}

/// A triangle, or a quadrilateral cut along its shorter diagonal.
fn cut(ring: &[u32], vertices: &[Vec3]) -> Vec<[u32; 3]> {
    if let &[a, b, c] = ring {
        return vec![[a, b, c]];
    }
    let [a, b, c, d] = [ring[0], ring[1], ring[2], ring[3]];
    let [p, q, r, s] = [a, b, c, d].map(|v| vertices[v as usize]);
    if p.distance_squared(r) <= q.distance_squared(s) {
        vec![[a, b, c], [a, c, d]]
    } else {
        vec![[a, b, d], [b, c, d]]
    }
}

/// Step 1: a point of the edge from `a` to `b` at which the signed distance is zero, up to rounding,
/// for values of different sides at its ends.
fn crossing(
    union: &MedialUnion,
    mut near: usize,
    [a, b]: [Vec3; 2],
    [at_a, at_b]: [f64; 2],
) -> Vec3 {
    let (mut s, mut t) = (0.0, 1.0);
    let (mut low, mut high) = (at_a, at_b);
    let enough = VERTEX_TOLERANCE * a.distance(b);
    let mut best = if at_a.abs() < at_b.abs() { (at_a.abs(), 0.0) } else { (at_b.abs(), 1.0) };
    for step in 0..MAX_STEPS {
        if best.0 <= enough || t - s <= f64::EPSILON {
            break;
        }
        // Where the primitive that was nearest last is crossed, mostly the union is: one search then.
        let alone = |u| union.signed_at_place(a.lerp(b, u), near);
        let u = (step < STEPS_ALONE).then(|| root(alone, [s, t], enough)).flatten();
        let u = u.unwrap_or_else(|| secant([s, t], [low, high]));
        let value = union.signed_from(a.lerp(b, u), &mut near);
        if value.abs() < best.0 {
            best = (value.abs(), u);
        }
        // Illinois: the value of the end that stays is halved, so that both ends converge.
        if (value < 0.0) == (at_a < 0.0) {
            (s, low, high) = (u, value, 0.5 * high);
        } else {
            (t, high, low) = (u, value, 0.5 * low);
        }
    }
    a.lerp(b, best.1)
}

/// A place between two at which a function of different signs there is zero, up to `enough`. `None` if the
/// function is infinite on the way, as that of a slab is where the cones of its sides decide.
fn root(f: impl Fn(f64) -> f64, [mut s, mut t]: [f64; 2], enough: f64) -> Option<f64> {
    let (mut low, mut high) = (f(s), f(t));
    let is_low = low < 0.0;
    if is_low == (high < 0.0) || !(low.is_finite() && high.is_finite()) {
        return None;
    }
    for _ in 0..MAX_STEPS {
        let u = secant([s, t], [low, high]);
        let value = f(u);
        if value.abs() <= enough {
            return Some(u);
        }
        if !value.is_finite() {
            return None;
        }
        if (value < 0.0) == is_low {
            (s, low, high) = (u, value, 0.5 * high);
        } else {
            (t, high, low) = (u, value, 0.5 * low);
        }
    }
    None
}

fn secant([s, t]: [f64; 2], [low, high]: [f64; 2]) -> f64 {
    (s + (t - s) * (low / (low - high))).clamp(s, t)
}

// Tetrahedra that fill a cube and are refined by bisection, conforming, with a value at each vertex.
//
// J. M. Maubach: *Local bisection refinement for n-simplicial grids generated by reflection*, SIAM
// Journal on Scientific Computing 16 (1995), <https://doi.org/10.1137/0916014>.
//
// 1. The cube is cut into Kuhn's six tetrahedra `(x0, x1, x2, x3)` around its diagonal `x0 x3`, of tag 3.
// 2. A tetrahedron of tag `k` is bisected at the middle `z` of `x0 xk` into `(x0 .. x(k-1), z, x(k+1) ..)`
//    and `(x1 .. xk, z, x(k+1) ..)`, both of tag `k - 1`, or 3 after 1. Three bisections halve all
//    lengths; there are three shapes of tetrahedra, however often they are bisected.
// 3. A tetrahedron is bisected if it is too coarse, or if the middle of one of its edges is a vertex.
//    When no tetrahedron is left to bisect, they are conforming: any two share a face, an edge, a
//    vertex or nothing.

/// Steps of the integer grid of the vertices along a side of the cube.
const STEPS: u32 = 1 << 20;

/// The most bisections of one tetrahedron: after three for each bit of the steps, sides are one step.
const MAX_BISECTIONS: u8 = 60;

/// The values at a vertex.
#[derive(Clone, Copy, Debug)]
struct Value {
    /// Signed distance to the union.
    pub signed: f64,
    /// Radius of the ball of the union that attains it.
    pub radius: f64,
    /// Place of the primitive that attains it.
    pub place: u32,
}

/// A tetrahedron of the current subdivision.
#[derive(Clone, Copy, Debug)]
struct Leaf {
    pub vertices: [u32; 4],
    tag: u8,
    /// How often its ancestors were bisected.
    pub generation: u8,
    /// Whether it was found not to be wanted.
    settled: bool,
    /// Whether it is of the last round, and was not yet tested for vertices on its edges.
    fresh: bool,
}

/// A cube in tetrahedra.
struct Bisection {
    corner: Vec3,
    step: f64,
    pub leaves: Vec<Leaf>,
    /// Grid coordinates, 21 bits each, of every vertex.
    keys: Vec<u64>,
    pub values: Vec<Value>,
    /// The last round in which an edge at each vertex was bisected.
    bisected_in: Vec<u32>,
    round: u32,
    /// Looked up only, never iterated.
    vertex_at: HashMap<u64, u32, BuildHasherDefault<KeyHasher>>,
}

/// The subdivision has more tetrahedra than allowed, or would have many times as many.
struct TooMany {
    /// Bisections of the finest one when that was found.
    generation: u8,
    /// Tetrahedra then.
    leaves: usize,
}

/// Refinement gives up early if the predicted number of tetrahedra exceeds the limit by this factor.
const HOPELESS: f64 = 8.0;

/// Predictions start at this generation: earlier, the tetrahedra near the boundary are too coarse.
const FORESIGHT: u8 = 15;

impl Bisection {
    /// Kuhn's six tetrahedra of the cube with this lowest corner and side; no values yet.
    fn of_cube(corner: Vec3, side: f64) -> Self {
        let mut all = Self {
            corner,
            step: side / f64::from(STEPS),
            leaves: Vec::new(),
            keys: Vec::new(),
            values: Vec::new(),
            bisected_in: Vec::new(),
            round: 1,
            vertex_at: HashMap::default(),
        };
        let far = u64::from(STEPS);
        let axis = [far, far << 21, far << 42];
        for [i, j, k] in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
            let path = [0, axis[i], axis[i] + axis[j], axis[i] + axis[j] + axis[k]];
            let vertices = path.map(|key| all.vertex(key));
            all.leaves.push(Leaf { vertices, tag: 3, generation: 0, settled: false, fresh: true });
        }
        all
    }

    /// The position of a vertex.
    fn position(&self, vertex: u32) -> Vec3 {
        let key = self.keys[vertex as usize];
        let mask = (1 << 21) - 1;
        let at = [key & mask, key >> 21 & mask, key >> 42].map(|c| c as f64);
        self.corner + self.step * Vec3::from_array(at)
    }

    /// The longest edge of tetrahedra after `generation` bisections: a space diagonal, a diagonal of a
    /// face, or a side.
    fn longest_edge(&self, generation: u8) -> f64 {
        let side = self.step * f64::from(STEPS) * f64::powi(0.5, i32::from(generation / 3));
        side * [3f64.sqrt(), 2f64.sqrt(), 1.0][usize::from(generation % 3)]
    }

    /// Bisects until no tetrahedron is wanted and all are conforming. `values` gives the values at
    /// new vertices, `goal` is the generation that is wanted everywhere at the boundary.
    ///
    /// # Errors
    /// When there are more than `most` tetrahedra, or will be by far: near a surface, three bisections
    /// make four of one.
    fn refine(
        &mut self,
        goal: u8,
        most: usize,
        values: impl Fn(&[Vec3]) -> Vec<Value>,
        wanted: impl Fn(&Leaf, [Value; 4]) -> bool + Sync,
    ) -> Result<(), TooMany> {
        let mut finest = 0;
        loop {
            let new: Vec<Vec3> =
                (self.values.len()..self.keys.len()).map(|v| self.position(v as u32)).collect();
            self.values.extend(values(&new));
            let chunks = self.leaves.par_iter().with_min_len(1 << 12);
            let split: Vec<(bool, bool)> = chunks
                .map(|leaf| {
                    let wanted = !leaf.settled
                        && leaf.generation < MAX_BISECTIONS
                        && wanted(leaf, leaf.vertices.map(|v| self.values[v as usize]));
                    (wanted || self.has_hanging_vertex(leaf), wanted)
                })
                .collect();
            let more = split.iter().filter(|s| s.0).count();
            if more == 0 {
                return Ok(());
            }
            let to_come = f64::from(goal.saturating_sub(finest)) * 2.0 / 3.0;
            let foreseen = if finest < FORESIGHT { 0.0 } else { more as f64 * to_come.exp2() };
            let leaves = self.leaves.len() + more;
            if leaves > most || foreseen > HOPELESS * most as f64 {
                return Err(TooMany { generation: finest, leaves });
            }
            self.round += 1;
            let old = std::mem::take(&mut self.leaves);
            self.leaves.reserve(old.len() + more);
            for (mut leaf, (is_split, wanted)) in old.into_iter().zip(split) {
                leaf.settled |= !wanted;
                leaf.fresh = false;
                if is_split {
                    self.bisect(leaf);
                    finest = finest.max(leaf.generation + 1);
                } else {
                    self.leaves.push(leaf);
                }
            }
        }
    }

    /// Step 2.
    fn bisect(&mut self, leaf: Leaf) {
        let k = usize::from(leaf.tag);
        let x = leaf.vertices;
        let middle = self.vertex(self.middle(x[0], x[k]));
        for end in [x[0], x[k]] {
            self.bisected_in[end as usize] = self.round;
        }
        let (mut low, mut high) = (x, x);
        low[k] = middle;
        high.copy_within(1..=k, 0);
        high[k] = middle;
        let tag = if k > 1 { leaf.tag - 1 } else { 3 };
        // If a tetrahedron needs no refinement, neither do its parts.
        let settled = leaf.settled;
        for vertices in [low, high] {
            let generation = leaf.generation + 1;
            self.leaves.push(Leaf { vertices, tag, generation, settled, fresh: true });
        }
    }

    fn has_hanging_vertex(&self, leaf: &Leaf) -> bool {
        let pairs = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];
        pairs.iter().any(|&(i, j)| {
            let (a, b) = (leaf.vertices[i], leaf.vertices[j]);
            // An edge tested before can have got a middle vertex only in the last round.
            if !leaf.fresh && [a, b].iter().any(|&v| self.bisected_in[v as usize] != self.round) {
                return false;
            }
            // Ends one step apart have no grid point between them.
            let odd = (self.keys[a as usize] ^ self.keys[b as usize]) & ODD;
            odd == 0 && self.vertex_at.contains_key(&self.middle(a, b))
        })
    }

    /// The key of the middle of an edge whose ends differ by even steps.
    fn middle(&self, a: u32, b: u32) -> u64 {
        // Fields cannot overflow: the sum of two of at most 2^20 has 21 bits, and is even.
        (self.keys[a as usize] + self.keys[b as usize]) >> 1
    }

    fn vertex(&mut self, key: u64) -> u32 {
        let next = self.keys.len() as u32;
        let vertex = *self.vertex_at.entry(key).or_insert(next);
        if vertex == next {
            self.keys.push(key);
            self.bisected_in.push(0);
        }
        vertex
    }

    fn is_inside(&self, vertex: u32) -> bool {
        self.values[vertex as usize].signed < 0.0
    }
}

/// The lowest bit of each coordinate of a key.
const ODD: u64 = 1 | 1 << 21 | 1 << 42;

#[cfg(test)]
mod tests {
    use super::*;

    /// Refined around a point of the unit cube.
    fn refined(target: Vec3, smallest: f64) -> Bisection {
        let mut all = Bisection::of_cube(Vec3::ZERO, 1.0);
        let values = |points: &[Vec3]| {
            points
                .iter()
                .map(|p| Value { signed: p.distance(target), radius: 1.0, place: 0 })
                .collect()
        };
        let sizes: Vec<f64> = (0..=MAX_BISECTIONS).map(|g| all.longest_edge(g)).collect();
        let wanted = |leaf: &Leaf, values: [Value; 4]| {
            let size = sizes[usize::from(leaf.generation)];
            size > smallest && values.iter().all(|v| v.signed <= size)
        };
        assert!(all.refine(0, 1 << 20, values, wanted).is_ok());
        all
    }

    #[test]
    fn the_tetrahedra_are_conforming_and_fill_the_cube() {
        let all = refined(Vec3::new(0.3, 0.2, 0.9), 0.01);
        let mut volume = 0.0;
        let mut sides: Vec<([u32; 3], Vec3)> = Vec::new();
        for leaf in &all.leaves {
            let [a, b, c, d] = leaf.vertices.map(|v| all.position(v));
            volume += (b - a).cross(c - a).dot(d - a).abs() / 6.0;
            let longest = [a.distance(b), a.distance(c), a.distance(d), b.distance(c)];
            let longest = longest.into_iter().fold(b.distance(d).max(c.distance(d)), f64::max);
            let expected = all.longest_edge(leaf.generation);
            assert!((longest - expected).abs() < 1e-12 * expected, "{longest} {expected}");
            for i in 0..4 {
                let mut side: Vec<u32> = leaf.vertices.to_vec();
                side.remove(i);
                side.sort_unstable();
                let middle = side.iter().map(|&v| all.position(v)).sum::<Vec3>() / 3.0;
                sides.push((side.try_into().unwrap(), middle));
            }
        }
        assert!((volume - 1.0).abs() < 1e-12, "{volume}");
        sides.sort_by_key(|s| s.0);
        for group in sides.chunk_by(|s, t| s.0 == t.0) {
            // Within the cube every triangle has two tetrahedra, on its boundary one.
            let on_boundary = group[0].1.to_array().iter().any(|x| x.min(1.0 - x).abs() < 1e-12);
            assert_eq!(group.len(), if on_boundary { 1 } else { 2 });
        }
        assert!(all.leaves.len() > 1000);
    }
}
