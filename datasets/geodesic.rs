//! Geodesic spheres: the faces of an icosahedron, divided and pushed out to the sphere.

use std::collections::HashMap;

use medial::Vec3;
use medial::surface::TriMesh;

/// Average edge of a geodesic unit sphere times its frequency.
const EDGE_TIMES_FREQUENCY: f64 = 1.15;

/// The frequency at which a sphere of this radius has edges of about `edge`.
pub(crate) fn frequency(radius: f64, edge: f64) -> u32 {
    (EDGE_TIMES_FREQUENCY * radius / edge).round().max(1.0) as u32
}

/// The unit sphere with every edge of the icosahedron divided into `frequency` parts:
/// `10 frequency^2 + 2` vertices. Oriented outward.
pub(crate) fn unit_sphere(frequency: u32) -> TriMesh {
    let (corners, base) = icosahedron();
    let mut mesh = TriMesh::default();
    // By the icosahedron's corners and their weights, so that neighbouring faces agree exactly.
    let mut ids: HashMap<[(u32, u32); 3], u32> = HashMap::new();
    for face in base {
        let mut vertex = |i: u32, j: u32| {
            let weights = [frequency - i - j, i, j];
            let mut key = [0, 1, 2].map(|k| (if weights[k] > 0 { face[k] } else { 0 }, weights[k]));
            key.sort_unstable();
            *ids.entry(key).or_insert_with(|| {
                let sum: Vec3 = key.iter().map(|&(k, w)| corners[k as usize] * f64::from(w)).sum();
                mesh.vertices.push(sum.normalize());
                mesh.vertices.len() as u32 - 1
            })
        };
        for i in 0..frequency {
            for j in 0..frequency - i {
                let up = [vertex(i, j), vertex(i + 1, j), vertex(i, j + 1)];
                mesh.faces.push(up);
                if i + j + 2 <= frequency {
                    mesh.faces.push([up[1], vertex(i + 1, j + 1), up[2]]);
                }
            }
        }
    }
    mesh
}

/// Twelve unit corners and twenty faces, counter-clockwise from outside.
fn icosahedron() -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let golden = (1.0 + 5f64.sqrt()) / 2.0;
    let mut corners = Vec::new();
    for turn in 0..3 {
        for (a, b) in [(1.0, golden), (1.0, -golden), (-1.0, golden), (-1.0, -golden)] {
            let mut p = [0.0; 3];
            (p[(turn + 1) % 3], p[(turn + 2) % 3]) = (a, b);
            corners.push(Vec3::from(p).normalize());
        }
    }
    // Neighbouring corners are 2 apart before scaling, all others at least 2 golden.
    let edge = 2.0 / (1.0 + golden * golden).sqrt();
    let near = |a: usize, b: usize| corners[a].distance(corners[b]) < 1.2 * edge;
    let mut faces = Vec::new();
    for a in 0..12 {
        for b in (a + 1..12).filter(|&b| near(a, b)) {
            for c in (b + 1..12).filter(|&c| near(a, c) && near(b, c)) {
                let outward = corners[a].dot(corners[b].cross(corners[c])) > 0.0;
                let [a, b, c] = [a, b, c].map(|corner| corner as u32);
                faces.push(if outward { [a, b, c] } else { [a, c, b] });
            }
        }
    }
    (corners, faces)
}

/// The mesh with every vertex moved by `map`.
pub(crate) fn mapped(mut mesh: TriMesh, map: impl Fn(Vec3) -> Vec3) -> TriMesh {
    mesh.vertices.iter_mut().for_each(|v| *v = map(*v));
    mesh
}

/// The mesh with every face turned over.
pub(crate) fn reversed(mut mesh: TriMesh) -> TriMesh {
    mesh.faces.iter_mut().for_each(|face| face.swap(1, 2));
    mesh
}

/// Two meshes as one.
pub(crate) fn joined(mut first: TriMesh, second: TriMesh) -> TriMesh {
    let offset = first.vertices.len() as u32;
    first.vertices.extend(second.vertices);
    first.faces.extend(second.faces.into_iter().map(|face| face.map(|v| v + offset)));
    first
}
