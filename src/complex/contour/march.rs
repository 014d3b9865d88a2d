//! The surface between tetrahedra's vertices inside and outside: marching tetrahedra.
//!
//! A. Doi, A. Koide: *An efficient method of triangulating equi-valued surfaces by using tetrahedral
//! cells*, IEICE Transactions E74 (1991).
//!
//! 1. Each edge of the tetrahedra with ends on different sides has one vertex of the surface, where
//!    the signed distance is zero, found by the Illinois variant of regula falsi.
//! 2. In a tetrahedron with one or three vertices inside, the three vertices on its edges are a
//!    triangle; with two inside, the four are cut into two triangles along the shorter diagonal.
//!
//! Tetrahedra are conforming, so that every edge of the result is in the common face of two of them and
//! has two triangles, and the triangles around a vertex go once around its edge: the result is a closed
//! manifold, always.

use rayon::prelude::*;

use super::bisection::{Bisection, Leaf};
use crate::Vec3;
use crate::complex::MedialUnion;
use crate::surface::TriMesh;

/// For each vertex of a tetrahedron the other three, so that the four are an even permutation.
const OTHERS: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// The even permutations that begin with an ascending pair.
const PAIRS: [[usize; 4]; 6] =
    [[0, 1, 2, 3], [0, 2, 3, 1], [0, 3, 1, 2], [1, 2, 0, 3], [1, 3, 2, 0], [2, 3, 0, 1]];

/// Largest distance of a vertex from the boundary, in lengths of its edge.
const VERTEX_TOLERANCE: f64 = 1e-9;

/// Evaluations on one edge: halving alone would reach the resolution of doubles.
const MAX_STEPS: usize = 60;

/// The surface, and for each of its vertices the length of the edge that it is on.
pub(super) fn march(grid: &Bisection, union: &MedialUnion) -> (TriMesh, Vec<f64>) {
    let inside = |v: u32| grid.values[v as usize].signed < 0.0;
    let is_mixed = |leaf: &&Leaf| {
        let count = leaf.vertices.iter().filter(|&&v| inside(v)).count();
        count != 0 && count != 4
    };
    let mixed: Vec<&Leaf> = grid.leaves.iter().filter(is_mixed).collect();
    let crossings = |leaf: &&Leaf| {
        let v = leaf.vertices;
        let pairs = PAIRS.map(|[i, j, ..]| (v[i], v[j]));
        pairs.into_iter().filter(|&(a, b)| inside(a) != inside(b)).map(|(a, b)| edge_key(a, b))
    };
    let mut edges: Vec<u64> = mixed.par_iter().flat_map_iter(crossings).collect();
    edges.par_sort_unstable();
    edges.dedup();
    let meet = |near: &mut usize, &key: &u64| {
        let ends = [(key >> 32) as u32, key as u32];
        let [a, b] = ends.map(|v| grid.position(v));
        let values = ends.map(|v| grid.values[v as usize].signed);
        (crossing(union, near, [a, b], values), a.distance(b))
    };
    let chunks = edges.par_iter().with_min_len(1 << 8);
    let found: Vec<(Vec3, f64)> = chunks.map_init(|| 0, meet).collect();
    let vertices: Vec<Vec3> = found.iter().map(|f| f.0).collect();
    let vertex = |a: u32, b: u32| {
        edges.binary_search(&edge_key(a, b)).expect("listed, its ends are on different sides")
            as u32
    };
    let triangles = |leaf: &&Leaf| {
        let x = leaf.vertices;
        let (polygon, corners) = polygon(x.map(inside));
        let mut ring =
            polygon.map(|(i, j)| if corners == 3 && i == j { 0 } else { vertex(x[i], x[j]) });
        let ring = &mut ring[..corners];
        let [a, b, c, d] = x.map(|v| grid.position(v));
        if (b - a).cross(c - a).dot(d - a) < 0.0 {
            ring.reverse();
        }
        cut(ring, &vertices)
    };
    let faces = mixed.par_iter().with_min_len(1 << 10).flat_map_iter(triangles).collect();
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
    let length = |a: u32, b: u32| vertices[a as usize].distance_squared(vertices[b as usize]);
    if length(a, c) <= length(b, d) {
        vec![[a, b, c], [a, c, d]]
    } else {
        vec![[a, b, d], [b, c, d]]
    }
}

/// Step 1: a point of the edge from `a` to `b` at which the signed distance is zero, up to rounding,
/// for values of different sides at its ends.
fn crossing(
    union: &MedialUnion,
    near: &mut usize,
    [a, b]: [Vec3; 2],
    [at_a, at_b]: [f64; 2],
) -> Vec3 {
    let (mut s, mut t) = (0.0, 1.0);
    let (mut low, mut high) = (at_a, at_b);
    let enough = VERTEX_TOLERANCE * a.distance(b);
    let mut best = if at_a.abs() < at_b.abs() { (at_a.abs(), 0.0) } else { (at_b.abs(), 1.0) };
    for _ in 0..MAX_STEPS {
        if best.0 <= enough || t - s <= f64::EPSILON {
            break;
        }
        // Illinois: the value of the end that stays is halved, so that both ends converge.
        let u = (s + (t - s) * (low / (low - high))).clamp(s, t);
        let value = union.signed_from(a.lerp(b, u), near);
        if value.abs() < best.0 {
            best = (value.abs(), u);
        }
        if (value < 0.0) == (at_a < 0.0) {
            (s, low, high) = (u, value, 0.5 * high);
        } else {
            (t, high, low) = (u, value, 0.5 * low);
        }
    }
    a.lerp(b, best.1)
}
