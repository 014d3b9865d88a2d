//! A mesh in, a medial mesh out: `cargo run --release -p medial-methods --example simplify -- bear.off 200 bear.ma`.
#![allow(clippy::print_stdout, clippy::print_stderr)]

use std::error::Error;

use medial::complex;
use medial::metrics::JudgeOptions;
use medial::shape::{Shape, ShapeOptions};
use medial::simplifier::{Level, Params, RunContext};
use medial::surface;

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [mesh, spheres, output] = words.as_slice() else {
        return Err("usage: simplify MESH SPHERES OUTPUT.ma".into());
    };
    // Closed, manifold, oriented; the report lists the repairs.
    let loaded = surface::read(mesh)?;
    // From here on lengths are fractions of the bounding box's diagonal.
    let shape = Shape::new(mesh, &loaded.mesh, loaded.report, ShapeOptions::default())?;

    let qmat = medial_methods::find("qmat").ok_or("no such method")?;
    let mut levels = qmat.prepare(&shape, &Params::none(), &RunContext::default())?;
    let simplified = levels.at(Level::Spheres(spheres.parse()?))?;
    for warning in &simplified.diagnostics.warnings {
        eprintln!("{warning}");
    }

    let judge = shape.judge(None, JudgeOptions::default())?;
    let distances = judge.distances(&simplified.mesh)?;
    println!(
        "{} spheres, Hausdorff error {:.3} % of the diagonal",
        simplified.mesh.spheres.len(),
        100.0 * distances.hausdorff
    );
    // Back to the units of the file.
    let back = shape.normalisation();
    let mesh = simplified.mesh.to_input(back);
    Ok(complex::write(output, &mesh)?)
}
