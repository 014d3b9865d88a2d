//! The spike measures on exact axes, which is their floor, and their growth with noise.

use medial::complex::MedialMesh;
use medial::metrics::{Spikes, spikes};
use medial::shape::{Shape, ShapeOptions};
use medial::surface::{self, Normalisation, TriMesh};

use crate::{add_noise, catalogue, find};

/// Measures 1 to 5 at a threshold of 0.1: share of weak edges, spikes, dangling edges, fins, idle
/// spheres.
fn measures(found: &Spikes) -> [f64; 5] {
    let at = found.by_ratio[1];
    [
        at.edge_share,
        at.spikes as f64,
        found.dangling_edges as f64,
        found.fins as f64,
        found.idle_spheres as f64,
    ]
}

fn exact(id: &str) -> Option<[f64; 5]> {
    let shape = find(id).unwrap();
    let normal = Normalisation::of(&shape.mesh(shape.default_resolution)).unwrap();
    let axis = shape.axis()?.mesh;
    Some(measures(&spikes(&axis.transformed(1.0 / normal.diagonal, |p| normal.forward(p)))))
}

/// METHODOLOGY.md has these values.
#[test]
fn floors_on_exact_axes() {
    for shape in catalogue() {
        if let Some([weak, spikes, dangling, fins, idle]) = exact(shape.id) {
            println!("{:14} {weak:.4} {spikes} {dangling} {fins} {idle}", shape.id);
        }
    }
    let [weak, spikes, dangling, fins, _] = exact("box").unwrap();
    assert_eq!([weak, spikes, dangling, fins], [0.0; 4], "the exact axis of a box has no spike");
}

fn initial(mesh: &TriMesh) -> MedialMesh {
    let report = surface::validate(mesh).unwrap();
    let shape = Shape::new("noisy", mesh, report, ShapeOptions::default()).unwrap();
    (*shape.initial().unwrap()).clone()
}

/// Means over three random versions of each level.
fn at_noise(id: &str, noise: f64) -> [f64; 6] {
    let shape = find(id).unwrap();
    let clean = shape.mesh(shape.default_resolution);
    let mut sum = [0.0; 6];
    for seed in 1..=3 {
        let mesh = initial(&add_noise(&clean, noise, seed));
        let found = spikes(&mesh);
        let [weak, count, dangling, fins, idle] = measures(&found);
        let angle = found.angle_spikes.unwrap() as f64;
        let spheres = mesh.spheres.len() as f64;
        let of = [weak, count, dangling, fins, idle, angle / spheres];
        sum.iter_mut().zip(of).for_each(|(sum, value)| *sum += value / 3.0);
    }
    sum
}

#[test]
fn spikes_grow_with_noise() {
    for id in ["box", "bracket"] {
        let levels = [0.0, 1e-4, 3e-4, 1e-3].map(|noise| at_noise(id, noise));
        for found in levels {
            println!("{id:8} {found:.4?}");
        }
        // The share of weak edges, the spikes, and the spheres with a small separation angle.
        for measure in [0, 1, 5] {
            let values = levels.map(|found| found[measure]);
            assert!(values.windows(2).all(|pair| pair[0] < pair[1]), "{id}, {measure}: {values:?}");
        }
    }
}
