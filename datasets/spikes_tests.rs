//! The spike measures on exact axes, which is their floor, and what noise adds.

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
fn at_noise(id: &str, noise: f64) -> [f64; 5] {
    let shape = find(id).unwrap();
    let clean = shape.mesh(shape.default_resolution);
    let mut sum = [0.0; 5];
    for seed in 1..=3 {
        let mesh = initial(&add_noise(&clean, noise, seed));
        let found = spikes(&mesh);
        let of = measures(&found);
        sum.iter_mut().zip(of).for_each(|(sum, value)| *sum += value / 3.0);
    }
    sum
}

/// Any noise, however small, makes the spikes that the samples allow: on a clean symmetric surface
/// there are few or none. More noise makes none more, since ratios do not know amplitudes.
#[test]
fn noise_makes_spikes() {
    for id in ["box", "bracket", "torus", "capsule"] {
        let levels = [0.0, 1e-4, 3e-4, 1e-3].map(|noise| at_noise(id, noise));
        for found in levels {
            println!("{id:8} {found:.4?}");
        }
        // The share of weak edges, and the fins.
        for measure in [0, 3] {
            let [clean, noisy @ ..] = levels.map(|found| found[measure]);
            let grown = noisy.iter().all(|&value| value > clean + 0.1 * clean);
            assert!(grown, "{id}, {measure}: {clean}, {noisy:?}");
        }
    }
}
