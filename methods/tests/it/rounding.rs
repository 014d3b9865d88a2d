//! Measures of results whose coordinates were rounded otherwise: by a file, by other units, by another order.

use medial::complex::MedialMesh;
use medial::metrics::{Evaluation, JudgeOptions};
use medial::shape::Shape;
use medial::simplifier::Level;
use medial::surface::TriMesh;

use crate::common::{at, built_in, shape_of};

fn judged(surface: &TriMesh, mesh: &MedialMesh) -> Evaluation {
    let options = JudgeOptions { samples: 10_000, volume_depth: 5, seed: 0 };
    shape_of(surface).judge(None, options).expect("a judge").evaluate(mesh).expect("measured")
}

/// A medial mesh in the units of the normalised shape, after it was written in other units and read.
fn rounded(mesh: &MedialMesh, unit: f64) -> MedialMesh {
    let there = mesh.transformed(unit, |p| p * unit);
    there.transformed(1.0 / unit, |p| p / unit)
}

#[test]
fn rounding_moves_no_measure_by_more_than_rounding() {
    for (id, method, level) in [
        ("bracket", "hem", Level::Spheres(500)),
        ("bracket", "qmat", Level::Spheres(200)),
        ("box", "qmat", Level::Spheres(100)),
        ("torus", "angle", Level::Spheres(300)),
        ("blob", "angle", Level::Spheres(300)),
    ] {
        let surface = built_in(id);
        let shape: Shape = shape_of(&surface);
        let mesh = at(&shape, method, &[], level);
        let before = judged(&surface, &mesh);
        for unit in [1.0 / 3.0, 0.1, 7.3] {
            let after = judged(&surface, &rounded(&mesh, unit));
            let values = |e: &Evaluation| {
                let d = &e.distances;
                [
                    ("epsilon", d.epsilon),
                    ("epsilon_union", d.epsilon_union),
                    ("mean", d.mean),
                    ("rms", d.rms),
                    ("p95", d.p95),
                    ("p99", d.p99),
                    ("spheres_only", d.spheres_only),
                    ("reverse", d.reverse),
                    ("reverse_mean", d.reverse_mean),
                    ("protrusion", e.protrusion.unwrap_or(0.0)),
                    ("volume_error", e.volume_error.unwrap_or(0.0)),
                    ("reverse samples", d.reverse_samples as f64),
                ]
            };
            for ((what, a), (_, b)) in values(&before).into_iter().zip(values(&after)) {
                assert!((a - b).abs() <= 1e-9, "{id} {method} {level}, {unit}, {what}: {a} {b}");
            }
        }
    }
}
