//! How long the Betti numbers of a large medial mesh take. Run by hand:
//! `cargo test --release --test betti_large -- --ignored --nocapture`.
#![allow(clippy::print_stdout)]

use cpu_time::ThreadTime;
use medial::complex::{betti, euler};
use medial::shape::{Shape, ShapeOptions};
use medial::surface::{self, Sampling};

#[test]
#[ignore = "half a minute; prints seconds"]
fn a_medial_mesh_with_a_million_faces() {
    let Some(file) = medial_test_support::mesh("bear.off") else { return };
    let loaded = surface::read(&file).unwrap();
    let sampling: Sampling = "blue:200000".parse().unwrap();
    let options = ShapeOptions { sampling, ..ShapeOptions::default() };
    let shape = Shape::new("bear", &loaded.mesh, loaded.report, options).unwrap();
    let mesh = shape.initial().unwrap();
    let mut best = f64::INFINITY;
    let mut found = [0; 3];
    for _ in 0..5 {
        // One thread's processor time: what else runs on the machine does not count.
        let start = ThreadTime::now();
        found = betti(&mesh);
        best = best.min(start.elapsed().as_secs_f64());
    }
    println!("{} faces: {found:?} in {best:.3} CPU s, the best of 5", mesh.faces.len());
    let [b0, b1, b2] = found.map(|b| b as i64);
    assert_eq!(b0 - b1 + b2, euler(&mesh));
}
