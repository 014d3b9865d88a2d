//! Closes holes of a surface by triangles between their vertices; no vertex is moved or added.
//!
//! * G. Barequet, M. Sharir: *Filling gaps in the boundary of a polyhedron*, Computer Aided
//!   Geometric Design 12 (1995), <https://doi.org/10.1016/0167-8396(94)00011-G>: the triangulation
//!   of a loop of least weight, by dynamic programming over its chains.
//! * P. Liepa: *Filling holes in meshes*, SGP 2003, <https://doi.org/10.2312/SGP/SGP03/200-206>:
//!   the weight of a triangulation is its largest dihedral angle, the surface around it included,
//!   then its area; section 3.
//!
//! 1. Edges with one face are chained to loops, against the direction of their faces.
//! 2. `W(i, k)` is the least weight of a triangulation of the chain from corner `i` to corner `k`. It
//!    follows from shorter chains, so these come first:
//!    `W(i, k) = min over m of W(i, m) + W(m, k) + triangle (i, m, k)`.
//! 3. The triangles are read off backwards, from the whole loop to shorter chains.
//!
//! # Deviations from the papers
//!
//! - An existing edge of the surface is not used as a chord: it would get more than two faces.
//! - The filling is neither refined nor smoothed, because that would add and move vertices.
//!
//! # Cost
//! `O(n^3)` time and `O(n^2)` memory for a loop of `n` edges, so that long loops are refused.

use std::collections::{HashMap, HashSet};
use std::f64::consts::PI;

use super::error::{Fault, VertexName};
use super::report::Repair;
use crate::Vec3;

/// Number of edges of the longest loop that is filled.
const MAX_EDGES: usize = 500;

/// Closes all holes of consistently oriented faces; returns one repair for each hole.
///
/// # Errors
/// When a loop is too long, meets itself, or has no triangulation with new edges alone. Then nothing
/// is changed.
pub(super) fn fill(vertices: &[Vec3], faces: &mut Vec<[u32; 3]>) -> Result<Vec<Repair>, Fault> {
    let rim = Rim::new(faces);
    let mut repairs = Vec::new();
    let mut added: Vec<[u32; 3]> = Vec::new();
    let mut edges = rim.edges;
    for corners in loops(vertices, &rim.next)? {
        let first = named(vertices, corners[0]);
        if corners.len() > MAX_EDGES {
            let (edges, most) = (corners.len(), MAX_EDGES);
            return Err(Fault::LongHole { edges, most, first });
        }
        let patch = Patch::new(vertices, faces, &rim.face_at, &corners, &edges).triangles();
        let patch = patch.ok_or(Fault::TangledHole { first })?;
        for &[a, b, c] in &patch {
            edges.extend([[a, b], [b, c], [c, a]].map(ascending));
        }
        repairs.push(Repair::FilledHole { edges: corners.len(), triangles: patch.len() });
        added.extend(patch);
    }
    faces.extend(added);
    Ok(repairs)
}

fn ascending([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

fn named(vertices: &[Vec3], vertex: u32) -> VertexName {
    VertexName { index: vertex as usize, position: vertices[vertex as usize] }
}

/// The edges with one face.
struct Rim {
    /// For each start of such an edge, against its face's direction, the ends.
    next: HashMap<u32, Vec<u32>>,
    /// The face at each of them.
    face_at: HashMap<[u32; 2], u32>,
    /// All edges of the surface, as ascending pairs.
    edges: HashSet<[u32; 2]>,
}

impl Rim {
    fn new(faces: &[[u32; 3]]) -> Self {
        let sides = |&[a, b, c]: &[u32; 3]| [[a, b], [b, c], [c, a]];
        let mut uses: HashMap<[u32; 2], u32> = HashMap::new();
        for side in faces.iter().flat_map(sides) {
            *uses.entry(ascending(side)).or_default() += 1;
        }
        let (mut next, mut face_at) = (HashMap::<u32, Vec<u32>>::new(), HashMap::new());
        for (index, face) in (0..).zip(faces) {
            for [a, b] in sides(face).into_iter().filter(|&side| uses[&ascending(side)] == 1) {
                next.entry(b).or_default().push(a);
                face_at.insert([b, a], index);
            }
        }
        Self { next, face_at, edges: uses.into_keys().collect() }
    }
}

/// Step 1: the loops, each from its lowest vertex, in the order of these.
fn loops(vertices: &[Vec3], next: &HashMap<u32, Vec<u32>>) -> Result<Vec<Vec<u32>>, Fault> {
    let mut starts: Vec<u32> = next.keys().copied().collect();
    starts.sort_unstable();
    let mut seen = HashSet::new();
    let mut loops = Vec::new();
    for start in starts {
        if !seen.insert(start) {
            continue;
        }
        let mut corners = vec![start];
        loop {
            let last = corners[corners.len() - 1];
            let tangled = || Fault::TangledHole { first: named(vertices, last) };
            let &[after] = next.get(&last).map_or(&[][..], Vec::as_slice) else {
                return Err(tangled());
            };
            if after == start {
                break;
            }
            if !seen.insert(after) {
                return Err(tangled());
            }
            corners.push(after);
        }
        loops.push(corners);
    }
    Ok(loops)
}

/// Largest dihedral angle, then area: less is better.
#[derive(Clone, Copy, PartialEq, PartialOrd)]
struct Weight {
    angle: f64,
    area: f64,
}

/// The best triangulation of a chain: its weight, and the third corner of the triangle at its chord.
#[derive(Clone, Copy)]
struct Best {
    weight: Weight,
    middle: usize,
}

/// A loop with what surrounds it.
struct Patch<'a> {
    corners: &'a [u32],
    /// Positions of the corners, in a unit in which nothing overflows.
    points: Vec<Vec3>,
    /// Unit normal of the surface beside the edge from each corner to the next.
    beside: Vec<Vec3>,
    edges: &'a HashSet<[u32; 2]>,
    /// `W(i, k)` at `i n + k`; `None` where there is no triangulation.
    best: Vec<Option<Best>>,
}

impl<'a> Patch<'a> {
    fn new(
        vertices: &[Vec3],
        faces: &[[u32; 3]],
        face_at: &HashMap<[u32; 2], u32>,
        corners: &'a [u32],
        edges: &'a HashSet<[u32; 2]>,
    ) -> Self {
        let n = corners.len();
        let origin = vertices[corners[0] as usize];
        let reach = corners.iter().map(|&v| (vertices[v as usize] - origin).abs().max_element());
        let reach = reach.fold(0.0, f64::max);
        let scaled = |v: u32| (vertices[v as usize] - origin) / reach;
        let beside = |i: usize| {
            let face = face_at[&[corners[i], corners[(i + 1) % n]]];
            normal(faces[face as usize].map(scaled))
        };
        let points = corners.iter().map(|&v| scaled(v)).collect();
        let beside = (0..n).map(beside).collect();
        Self { corners, points, beside, edges, best: vec![None; n * n] }
    }

    /// Steps 2 and 3.
    fn triangles(mut self) -> Option<Vec<[u32; 3]>> {
        let n = self.corners.len();
        for length in 2..n {
            for i in 0..n - length {
                self.best[i * n + i + length] = self.best_of(i, i + length);
            }
        }
        let mut triangles = Vec::with_capacity(n.saturating_sub(2));
        let mut open = vec![(0, n - 1)];
        while let Some((i, k)) = open.pop() {
            if k - i < 2 {
                continue;
            }
            let middle = self.best[i * n + k]?.middle;
            triangles.push([i, middle, k].map(|corner| self.corners[corner]));
            open.extend([(i, middle), (middle, k)]);
        }
        Some(triangles)
    }

    /// Step 2 for one chain.
    fn best_of(&self, i: usize, k: usize) -> Option<Best> {
        let n = self.corners.len();
        let whole = i == 0 && k == n - 1;
        if !whole && self.edges.contains(&ascending([self.corners[i], self.corners[k]])) {
            return None;
        }
        let mut best: Option<Best> = None;
        for middle in i + 1..k {
            let triangle = [i, middle, k].map(|corner| self.points[corner]);
            let own = normal(triangle);
            let (Some(low), Some(high)) = (self.chain(i, middle), self.chain(middle, k)) else {
                continue;
            };
            let mut angle = low.0.angle.max(high.0.angle);
            angle = angle.max(between(own, low.1)).max(between(own, high.1));
            if whole {
                angle = angle.max(between(own, self.beside[n - 1]));
            }
            let [a, b, c] = triangle;
            let area = low.0.area + high.0.area + (b - a).cross(c - a).length() * 0.5;
            let weight = Weight { angle, area };
            if best.is_none_or(|best| weight < best.weight) {
                best = Some(Best { weight, middle });
            }
        }
        best
    }

    /// The weight of a chain and the normal beside its chord: of the surface, or of the triangle.
    fn chain(&self, i: usize, k: usize) -> Option<(Weight, Vec3)> {
        if k == i + 1 {
            return Some((Weight { angle: 0.0, area: 0.0 }, self.beside[i]));
        }
        let Best { weight, middle } = self.best[i * self.corners.len() + k]?;
        Some((weight, normal([i, middle, k].map(|corner| self.points[corner]))))
    }
}

fn normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    (b - a).cross(c - a).normalize_or_zero()
}

/// The angle between two faces, 0 where they are one plane; a face without area fits nowhere.
fn between(a: Vec3, b: Vec3) -> f64 {
    if a == Vec3::ZERO || b == Vec3::ZERO { PI } else { a.dot(b).clamp(-1.0, 1.0).acos() }
}
