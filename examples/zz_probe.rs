#![allow(clippy::all, clippy::print_stdout, missing_docs)]
use medial::Vec3;
use medial::geometry::*;
use medial::surface::TriMesh;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use std::f64::consts::TAU;
fn torus(n: u32, m: u32) -> TriMesh {
    let angle = |k: u32, count: u32| TAU * f64::from(k) / f64::from(count);
    let point = |u: f64, v: f64| {
        let r = 0.35 + 0.05 * (5.0 * u).sin() * (4.0 * v).cos();
        let ring = 1.0 + r * v.cos();
        Vec3::new(ring * u.cos(), ring * u.sin(), r * v.sin())
    };
    let vertices = (0..n * m).map(|k| point(angle(k / m, n), angle(k % m, m))).collect();
    let id = |i: u32, j: u32| i % n * m + j % m;
    let faces = (0..n)
        .flat_map(|i| (0..m).map(move |j| (i, j)))
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    TriMesh { vertices, faces }
}
fn main() {
    let mesh = torus(224, 224);
    let t = WindingTree::new(&mesh).unwrap();
    let mut rng = Pcg64::seed_from_u64(1);
    let pts: Vec<Vec3> = (0..20000)
        .map(|_| {
            Vec3::new(rng.random(), rng.random(), rng.random()) * Vec3::new(2.8, 2.8, 0.8)
                - Vec3::new(1.4, 1.4, 0.4)
        })
        .collect();
    for beta in [1.5, 2.0, 3.0, 4.0, 6.0] {
        let s = std::time::Instant::now();
        let (mut we, mut wb) = (0.0f64, 0.0f64);
        for &p in &pts {
            let w = t.winding_beyond(p, beta);
            we = we.max((w.number - w.number.round()).abs());
            wb = wb.max(w.error);
        }
        println!(
            "beta {beta}: {:.2} us, worst error {we:.1e} bound {wb:.1e}",
            s.elapsed().as_secs_f64() / 0.02
        );
    }
    for tol in [1e-1, 1e-2, 1e-3] {
        let t = t.clone().with_tolerance(tol);
        let s = std::time::Instant::now();
        let mut we = 0.0f64;
        for &p in &pts {
            let w = t.winding(p);
            we = we.max((w.number - w.number.round()).abs());
        }
        println!("tol {tol}: {:.2} us, worst {we:.1e}", s.elapsed().as_secs_f64() / 0.02);
    }
}
