//! A metric of one's own on a medial mesh: how thick the solid is where its surface is farthest from the
//! union of the primitives. `cargo run --release --example own_metric -- bear.off bear.ma`.
#![allow(clippy::print_stdout)]

use std::error::Error;

use medial::complex::{self, MedialUnion};
use medial::surface::{self, Normalisation, Sampling, sample};

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [mesh, axis] = words.as_slice() else {
        return Err("usage: own_metric MESH MEDIAL_MESH".into());
    };
    let surface = surface::read(mesh)?.mesh;
    let medial = complex::read(axis)?.mesh;
    let diagonal = Normalisation::of(&surface).ok_or("the mesh has no extent")?.diagonal;

    let points = sample(&surface, &Sampling::AreaUniform { count: 10_000, seed: 0 });
    let union = MedialUnion::new(&medial)?;
    // Positive outside the union: the loss of the medial mesh there.
    let outside = union.signed_batch(&points);
    let (worst, lost) =
        (0..).zip(&outside).max_by(|a: &(usize, _), b| a.1.total_cmp(b.1)).ok_or("no sample")?;

    // The largest ball of the medial mesh that comes near the place.
    let near = |sphere: &&complex::Sphere| sphere.signed_distance(points[worst]) < 2.0 * lost.abs();
    let thick = medial.spheres.iter().filter(near).map(|sphere| sphere.radius).fold(0.0, f64::max);
    println!(
        "farthest at {}: {:.3} % of the diagonal outside, the solid is {:.3} % thick there",
        points[worst],
        100.0 * lost / diagonal,
        200.0 * thick / diagonal
    );
    Ok(())
}
