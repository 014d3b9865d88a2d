//! Share of voxels dismissed at each level, with times, as in Table 2 of Stolpner and Siddiqi.
//!
//! ```text
//! aof_levels RESOLUTION KEY=VALUE,... NAME ...     built-in shapes or mesh files
//! ```
#![allow(clippy::print_stdout)]

use std::error::Error;
use std::time::Instant;

use medial::shape::{Shape, ShapeOptions};
use medial::simplifier::{Params, RunContext};
use medial::surface;
use medial_methods::aof::NearbyTriangles;
use medial_methods::aof::{AofParams, Solid, Surface, Wanted};

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [resolution, settings, names @ ..] = args.as_slice() else {
        return Err("usage: aof_levels RESOLUTION KEY=VALUE,... NAME ...".into());
    };
    let resolution: u32 = resolution.parse()?;
    let mut given = Params::none();
    for (key, value) in settings.split(',').filter_map(|word| word.split_once('=')) {
        given.set(key, value);
    }
    println!(
        "{:<14} {:>9} {:>9} {:>9} {:>9} {:>7} {:>7} {:>7} {:>7} {:>7}",
        "shape", "start", "level 1", "level 2", "kept", "s", "cpu s", "thin s", "mesh s", "betti"
    );
    for name in names {
        let params: AofParams = given.typed()?;
        let shape = shape(name)?;
        let surface =
            Surface { triangles: NearbyTriangles::new(shape.mesh()), inside: shape.inside_test() };
        let solid = Solid::new(&shape, surface, params.clone(), RunContext::default());
        let (clock, cpu) = (Instant::now(), cpu_time::ProcessTime::now());
        let wanted = if params.variant == medial_methods::aof::Variant::Plain {
            Wanted::Kept
        } else {
            Wanted::All
        };
        let descent = solid.descend(resolution, wanted)?;
        let (seconds, cpu) = (clock.elapsed().as_secs_f64(), cpu.elapsed().as_secs_f64());
        let clock = Instant::now();
        let axis = solid.axis(resolution, &descent, params.angle)?;
        let thinning = clock.elapsed().as_secs_f64();
        let tree = shape.surface_tree()?;
        let clock = Instant::now();
        solid.medial_mesh(&axis, &tree)?;
        let meshing = clock.elapsed().as_secs_f64();
        let tally = &descent.tally;
        let share = |n: u64| 100.0 * n as f64 / tally.start as f64;
        let level = |k: usize| tally.dismissed.get(k).map_or(f64::NAN, |&n| share(n));
        println!(
            "{name:<14} {:>9} {:>8.1}% {:>8.1}% {:>9} {seconds:>7.2} {cpu:>7.2} {thinning:>7.2} {meshing:>7.2} {:?} evaluated {:?} {} MB",
            tally.start,
            level(0),
            level(1),
            axis.voxels.len(),
            axis.betti(),
            tally.evaluated,
            descent.voxels.bytes() / 1_000_000
        );
    }
    Ok(())
}

fn shape(name: &str) -> Result<Shape, Box<dyn Error>> {
    let mesh = match medial_datasets::find(name) {
        Some(shape) => shape.mesh(shape.default_resolution),
        None => surface::read(name)?.mesh,
    };
    let report = surface::validate(&mesh)?;
    Ok(Shape::new(name, &mesh, report, ShapeOptions::default())?)
}
