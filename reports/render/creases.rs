//! Normals of a surface that are smooth where the surface is, and its sharp edges.
//!
//! A corner takes the mean of the faces around its vertex that are within [`CREASE`] of its own face,
//! weighted by the sine of their angle there over the lengths of its sides, which is exact on a sphere (Max, "Weights for
//! computing vertex normals from facet normals", J. Graphics Tools 4 (1999)). Round parts look round, and edges of machine
//! parts stay sharp.

use medial::Vec3;
use medial::surface::TriMesh;
use rayon::prelude::*;

/// Faces at a larger angle to each other, in degrees, meet in a sharp edge.
const CREASE: f64 = 35.0;

/// More faces than this at a vertex are the fan of a flat disc or the tip of a cone: the normal of a face is
/// taken as it is. The cost is quadratic in this number.
const MOST_AROUND: usize = 64;

/// Normals and sharp sides of every face.
pub(super) struct Creases {
    /// At the three corners.
    pub(super) normals: Vec<[Vec3; 3]>,
    /// Whether the side from corner `k` to `k + 1` is sharp, or has no or several faces beyond, and is part of a long
    /// crease.
    pub(super) sharp: Vec<[bool; 3]>,
}

/// Sharp edges that are connected are shown if they are longer together than this, as a share of the surface's diagonal:
/// shorter ones are noise of a smooth surface, a drilled hole is longer.
const SHORTEST: f64 = 0.06;

/// Finds the creases of a surface. Cost linear in its size but for a sort of its sides.
pub(super) fn creases(mesh: &TriMesh) -> Creases {
    let flat: Vec<Vec3> = (0..mesh.faces.len()).into_par_iter().map(|f| normal(mesh, f)).collect();
    let around = Around::new(mesh);
    let smooth = CREASE.to_radians().cos();
    let corner = |face: usize, corner: usize| {
        let around = around.of(mesh.faces[face][corner]);
        if around.len() > MOST_AROUND {
            return flat[face];
        }
        let alike =
            around.iter().filter(|&&[other, _]| flat[face].dot(flat[other as usize]) > smooth);
        let sum: Vec3 = alike
            .map(|&[other, at]| weight(mesh, other as usize, at as usize) * flat[other as usize])
            .sum();
        sum.normalize_or(flat[face])
    };
    let normals = (0..mesh.faces.len()).into_par_iter();
    let normals = normals.map(|face| [0, 1, 2].map(|k| corner(face, k))).collect();
    let mut sharp = sharp_sides(mesh, &flat, smooth);
    drop_short(mesh, &mut sharp);
    Creases { normals, sharp }
}

fn normal(mesh: &TriMesh, face: usize) -> Vec3 {
    let [a, b, c] = mesh.triangle(face);
    // Of unit sides: the square of a tiny length would vanish.
    let (u, v) = ((b - a).normalize_or_zero(), (c - a).normalize_or_zero());
    u.cross(v).normalize_or_zero()
}

/// The weight of a face at a corner.
fn weight(mesh: &TriMesh, face: usize, corner: usize) -> f64 {
    let points = mesh.triangle(face);
    let [a, b, c] = [0, 1, 2].map(|k| points[(corner + k) % 3]);
    let (u, v) = (b - a, c - a);
    let lengths = u.length() * v.length();
    let sine = u.cross(v).length() / lengths;
    if sine.is_finite() { sine / lengths } else { 0.0 }
}

/// Faces around every vertex.
struct Around {
    start: Vec<u32>,
    /// A face, and which of its corners the vertex is.
    faces: Vec<[u32; 2]>,
}

impl Around {
    fn new(mesh: &TriMesh) -> Self {
        let mut start = vec![0; mesh.vertices.len() + 1];
        for &vertex in mesh.faces.iter().flatten() {
            start[vertex as usize + 1] += 1;
        }
        for k in 1..start.len() {
            start[k] += start[k - 1];
        }
        let mut next = start.clone();
        let mut faces = vec![[0; 2]; 3 * mesh.faces.len()];
        for (face, corners) in mesh.faces.iter().enumerate() {
            for (corner, &vertex) in corners.iter().enumerate() {
                let place = &mut next[vertex as usize];
                faces[*place as usize] = [face as u32, corner as u32];
                *place += 1;
            }
        }
        Self { start, faces }
    }

    fn of(&self, vertex: u32) -> &[[u32; 2]] {
        let [a, b] = [0, 1].map(|k| self.start[vertex as usize + k] as usize);
        &self.faces[a..b]
    }
}

fn sharp_sides(mesh: &TriMesh, flat: &[Vec3], smooth: f64) -> Vec<[bool; 3]> {
    let mut sides: Vec<(u64, u32)> = (0..3 * mesh.faces.len() as u32)
        .into_par_iter()
        .map(|side| {
            let corners = mesh.faces[side as usize / 3];
            let [a, b] = [corners[side as usize % 3], corners[(side as usize + 1) % 3]];
            (u64::from(a.min(b)) << 32 | u64::from(a.max(b)), side)
        })
        .collect();
    sides.par_sort_unstable();
    let mut sharp = vec![[false; 3]; mesh.faces.len()];
    for run in sides.chunk_by(|a, b| a.0 == b.0) {
        let is_smooth = match run {
            [(_, a), (_, b)] => flat[*a as usize / 3].dot(flat[*b as usize / 3]) > smooth,
            _ => false,
        };
        for (_, side) in run {
            sharp[*side as usize / 3][*side as usize % 3] = !is_smooth;
        }
    }
    sharp
}

/// Drops the sharp sides that are connected to few others.
fn drop_short(mesh: &TriMesh, sharp: &mut [[bool; 3]]) {
    let sides: Vec<[usize; 4]> = sharp
        .iter()
        .enumerate()
        .flat_map(|(face, sharp)| (0..3).filter(|&k| sharp[k]).map(move |k| [face, k]))
        .map(|[face, k]| {
            let corners = mesh.faces[face];
            [face, k, corners[k] as usize, corners[(k + 1) % 3] as usize]
        })
        .collect();
    let mut parent: Vec<usize> = (0..mesh.vertices.len()).collect();
    for &[_, _, a, b] in &sides {
        let (a, b) = (root(&mut parent, a), root(&mut parent, b));
        parent[a.max(b)] = a.min(b);
    }
    let mut lengths = vec![0.0; mesh.vertices.len()];
    for &[_, _, a, b] in &sides {
        // Either face of an edge has it among its sides.
        let half = 0.5 * mesh.vertices[a].distance(mesh.vertices[b]);
        lengths[root(&mut parent, a)] += half;
    }
    let diagonal = mesh.bounding_box().map_or(0.0, |(lo, hi)| lo.distance(hi));
    for [face, k, a, _] in sides {
        sharp[face][k] = lengths[root(&mut parent, a)] >= SHORTEST * diagonal;
    }
}

/// The first vertex of a connected set; paths are halved on the way.
fn root(parent: &mut [usize], mut vertex: usize) -> usize {
    while parent[vertex] != vertex {
        parent[vertex] = parent[parent[vertex]];
        vertex = parent[vertex];
    }
    vertex
}
