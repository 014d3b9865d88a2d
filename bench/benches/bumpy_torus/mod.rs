//! The bumpy torus: the mesh of the distance benches, and of the same comparison with CGAL
//! (`scripts/oracles/src/bin/distance_oracle.rs`).

use std::f64::consts::TAU;

use medial::Vec3;
use medial::surface::TriMesh;

/// Radius of the ring.
pub const RING: f64 = 1.0;

fn tube(u: f64, v: f64) -> f64 {
    0.35 + 0.05 * (5.0 * u).sin() * (4.0 * v).cos()
}

/// The point at the angles `u` along the ring and `v` around the tube, and `way` from the ring, 0, to the surface, 1.
pub fn point(u: f64, v: f64, way: f64) -> Vec3 {
    let r = way * tube(u, v);
    let ring = RING + r * v.cos();
    Vec3::new(ring * u.cos(), ring * u.sin(), r * v.sin())
}

/// A closed mesh of `2 n m` triangles.
pub fn mesh(n: u32, m: u32) -> TriMesh {
    let angle = |k: u32, count: u32| TAU * f64::from(k) / f64::from(count);
    let vertices = (0..n * m).map(|k| point(angle(k / m, n), angle(k % m, m), 1.0)).collect();
    let id = |i: u32, j: u32| i % n * m + j % m;
    let quads = (0..n).flat_map(|i| (0..m).map(move |j| (i, j)));
    let faces = quads
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    TriMesh { vertices, faces }
}
