//! The torus on a regular grid.

use std::f64::consts::TAU;

use medial::Vec3;
use medial::surface::TriMesh;

/// A torus about the z axis: `around` sections of `across` vertices each, oriented outward.
pub(crate) fn torus(major: f64, minor: f64, around: u32, across: u32) -> TriMesh {
    let angle = |i: u32, n: u32| (TAU * f64::from(i) / f64::from(n)).sin_cos();
    let mut mesh = TriMesh::default();
    for i in 0..around {
        let (sin_u, cos_u) = angle(i, around);
        for j in 0..across {
            let (sin_v, cos_v) = angle(j, across);
            let radius = major + minor * cos_v;
            mesh.vertices.push(Vec3::new(radius * cos_u, radius * sin_u, minor * sin_v));
        }
    }
    let id = |i: u32, j: u32| (i % around) * across + j % across;
    for i in 0..around {
        for j in 0..across {
            let [a, b, c, d] = [id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)];
            mesh.faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}
