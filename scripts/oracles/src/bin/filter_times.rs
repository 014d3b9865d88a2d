//! Processor seconds of the triangulation and of the filters on it, in one run on one thread.
//!
//! `cargo run --release -p medial-oracles --bin filter_times -- MESH [SAMPLING] [REPEAT]`

#![allow(clippy::print_stdout)] // It is what the example is for.

use std::error::Error;

use medial::shape::{Cost, Shape, ShapeOptions, Substrate};
use medial::simplifier::{Level, Params, RunContext};
use medial::surface;

fn main() -> Result<(), Box<dyn Error + Send + Sync>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let path = arguments.first().ok_or("name a mesh")?;
    let sampling = arguments.get(1).map_or("vertices", String::as_str).parse()?;
    let repeat: usize = arguments.get(2).map_or(Ok(3), |n| n.parse())?;
    let surface::Loaded { mesh, report } = surface::read(path)?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let samples = Shape::new(
        "shape",
        &mesh,
        report.clone(),
        ShapeOptions { sampling, ..ShapeOptions::default() },
    )?
    .samples();
    println!("{} samples; best of {repeat}, processor seconds", samples.len());
    // Samples as vertices of nothing: the same points for every repetition, sampled once.
    let mut best = [f64::INFINITY; 5];
    pool.install(|| -> Result<(), Box<dyn Error + Send + Sync>> {
        let shape = Shape::new(
            "shape",
            &mesh,
            report,
            ShapeOptions { sampling, ..ShapeOptions::default() },
        )?;
        shape.voronoi()?;
        for _ in 0..repeat {
            let view = shape.view();
            let (delaunay, again) = Cost::of(|| medial::geometry::Delaunay::new(&samples));
            delaunay?;
            keep_least(&mut best[0], again.cpu_seconds);
            let (cells, delaunay) = (shape.cells()?, shape.delaunay()?);
            let (_, facets) = Cost::of(|| medial::complex::VoronoiFacets::new(&delaunay, &cells));
            keep_least(&mut best[1], facets.cpu_seconds);
            for (place, id, level) in [
                (2, "dey-zhao", Level::Published),
                (3, "angle", Level::Spheres(1000)),
                (4, "lambda", Level::Spheres(1000)),
            ] {
                let method = medial_methods::find(id).ok_or("a method")?;
                let (prepared, cost) = Cost::of(|| {
                    let run = RunContext::default();
                    method.prepare(&view, &Params::none(), &run)?.at(level)
                });
                prepared?;
                keep_least(&mut best[place], cost.cpu_seconds);
            }
        }
        let spheres = shape.voronoi()?.spheres.len();
        let [delaunay, facets, dey_zhao, angle, lambda] = best;
        println!("triangulation  {delaunay:.4}");
        println!("facets         {facets:.4}  {:.2}", facets / delaunay);
        println!("dey-zhao       {dey_zhao:.4}  {:.2}", dey_zhao / delaunay);
        println!("angle          {angle:.4}  {spheres} spheres");
        println!("lambda         {lambda:.4}  {spheres} spheres");
        let used = shape.used().into_iter().filter(|(s, _)| *s != Substrate::Samples);
        used.for_each(|(s, cost)| println!("  once: {} {:.4}", s.name(), cost.cpu_seconds));
        Ok(())
    })
}

fn keep_least(best: &mut f64, value: f64) {
    *best = best.min(value);
}
