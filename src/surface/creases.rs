//! Sharp edges of a surface, and normals that are smooth between them.

use std::collections::HashMap;

use super::TriMesh;
use crate::Vec3;

/// An edge at which a surface turns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SharpEdge {
    /// Its two vertices, ascending.
    pub vertices: [u32; 2],
    /// Whether the solid is convex there.
    pub convex: bool,
}

/// The edges at which the surface turns by more than an angle of cosine `smooth`, in the order of their second faces.
/// Cost `O(F)`.
///
/// `flat` holds the unit normal of every face.
///
/// # Panics
/// If a face names a vertex or a normal that does not exist.
pub fn sharp_edges(mesh: &TriMesh, flat: &[Vec3], smooth: f64) -> Vec<SharpEdge> {
    let mut first = HashMap::with_capacity(2 * mesh.faces.len());
    let mut sharp = Vec::new();
    for (f, &[a, b, c]) in mesh.faces.iter().enumerate() {
        for ([a, b], apex) in [([a, b], c), ([b, c], a), ([c, a], b)] {
            let vertices = [a.min(b), a.max(b)];
            let other = *first.entry(vertices).or_insert(f);
            if other != f && flat[other].dot(flat[f]) < smooth {
                let [apex, on] = [apex, a].map(|v| mesh.vertices[v as usize]);
                sharp.push(SharpEdge { vertices, convex: flat[other].dot(apex - on) < 0.0 });
            }
        }
    }
    sharp
}

/// More faces than this at a vertex are the fan of a flat disc or the tip of a cone, where the normal of each face is
/// taken as it is. The cost is quadratic in this number.
const MOST_AROUND: usize = 64;

/// The normals at the corners of a face, for any face: smooth where the surface is, so that round parts look round and
/// edges of machine parts stay sharp. Cost linear in the surface's size.
///
/// A corner takes the mean of the faces around its vertex that are at most the angle of cosine `smooth` from its own
/// face, weighted by the sine of their angle there over the lengths of its sides, which is exact on a sphere (N. Max,
/// "Weights for computing vertex normals from facet normals", J. Graphics Tools 4 (1999)).
///
/// `flat` holds the unit normal of every face.
///
/// # Panics
/// If a face names a vertex or a normal that does not exist.
pub fn smooth_normals<'a>(
    mesh: &'a TriMesh,
    flat: &'a [Vec3],
    smooth: f64,
) -> impl Fn(usize) -> [Vec3; 3] + Sync + 'a {
    // The faces around each vertex with their weighted normals, those of a vertex from its start on.
    let mut starts = vec![0; mesh.vertices.len() + 1];
    mesh.faces.iter().flatten().for_each(|&vertex| starts[vertex as usize + 1] += 1);
    for vertex in 0..mesh.vertices.len() {
        starts[vertex + 1] += starts[vertex];
    }
    let mut next = starts.clone();
    let mut around = vec![(0, Vec3::ZERO); 3 * mesh.faces.len()];
    for (face, &corners) in mesh.faces.iter().enumerate() {
        let points = mesh.triangle(face);
        for (corner, vertex) in corners.into_iter().enumerate() {
            let [a, b, c] = [0, 1, 2].map(|k| points[(corner + k) % 3]);
            let (u, v) = (b - a, c - a);
            let lengths = u.length() * v.length();
            let sine = u.cross(v).length() / lengths;
            // Zero lengths: a face without area has no weight.
            let normal = if sine.is_finite() { sine / lengths * flat[face] } else { Vec3::ZERO };
            let place = &mut next[vertex as usize];
            around[*place] = (face, normal);
            *place += 1;
        }
    }
    let corner = move |face: usize, vertex: u32| {
        let vertex = vertex as usize;
        let around = &around[starts[vertex]..starts[vertex + 1]];
        if around.len() > MOST_AROUND {
            return flat[face];
        }
        let alike = around.iter().filter(|(other, _)| flat[face].dot(flat[*other]) > smooth);
        alike.map(|&(_, normal)| normal).sum::<Vec3>().normalize_or(flat[face])
    };
    move |face| mesh.faces[face].map(|vertex| corner(face, vertex))
}
