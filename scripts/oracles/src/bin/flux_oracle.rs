//! Our side of the comparison of closest points and fluxes with CGAL and Open3D, driven by
//! `scripts/oracles/flux.sh`.
//!
//! ```text
//! flux_oracle make NAME RESOLUTION COUNT FILE
//!     writes COUNT evenly spaced voxels of the start set of a built-in shape or mesh file, with the
//!     samples of their spheres: FILE is a [`Task`], and
//!     FILE.voxels: number of voxels and samples, sigma, centres (f64)
//! flux_oracle run FILE ANSWERS
//!     writes closest points of the samples (x, y, z, distance) to ANSWERS, fluxes to ANSWERS.flux
//! flux_oracle time NAME RESOLUTION
//!     prints the seconds of all fluxes at one level, the number of voxels, the number of samples
//! ```
#![allow(clippy::print_stdout)]

use std::error::Error;
use std::time::Instant;

use medial::Vec3;
use medial::shape::{Shape, ShapeOptions};
use medial::simplifier::RunContext;
use medial::surface::{self, TriMesh, TriangleBvh};
use medial_methods::aof::{LatticeSetting, Solid, Sphere, Spiral, Surface, Wanted};
use medial_oracles::{Task, bytes, numbers};

/// Samples of the finest level.
const SAMPLES: usize = 50;

type Outcome = Result<(), Box<dyn Error>>;

fn main() -> Outcome {
    let args: Vec<String> = std::env::args().skip(1).collect();
    match args.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["make", name, resolution, count, file] => {
            make(name, resolution.parse()?, count.parse()?, file)
        }
        ["run", file, answers] => run(file, answers),
        ["time", name, resolution] => time(name, resolution.parse()?),
        _ => Err("usage: flux_oracle make | run | time; see the head of its source".into()),
    }
}

fn mesh(name: &str) -> Result<TriMesh, Box<dyn Error>> {
    Ok(match medial_datasets::find(name) {
        Some(shape) => shape.mesh(shape.default_resolution),
        None => surface::read(name)?.mesh,
    })
}

fn shape(mesh: &TriMesh) -> Result<Shape, Box<dyn Error>> {
    let report = surface::validate(mesh)?;
    Ok(Shape::new("oracle", mesh, report, ShapeOptions::default())?)
}

fn solid(shape: &Shape) -> Result<Solid<'_>, Box<dyn Error>> {
    Ok(Solid::new(shape, LatticeSetting::own(1), RunContext::default())?)
}

fn make(name: &str, resolution: u32, count: usize, file: &str) -> Outcome {
    let shape = shape(&mesh(name)?)?;
    let solid = solid(&shape)?;
    let grid = solid.grid(resolution);
    let start = solid.descend(resolution, Wanted::Places)?.voxels;
    let step = (start.iter().count() / count).max(1);
    let centres: Vec<Vec3> = start.iter().step_by(step).map(|v| grid.centre(v.place)).collect();
    let sphere = Sphere::new(Spiral::EqualArea, SAMPLES, grid.side);
    let samples: Vec<Vec3> = centres
        .iter()
        .flat_map(|&c| sphere.directions.iter().map(move |&n| c + n * sphere.radius))
        .collect();
    let mesh = shape.mesh().clone();
    Task { mesh, queries: [samples.clone(), samples.clone(), samples] }.write(file)?;
    let head = [centres.len() as f64, SAMPLES as f64, grid.side];
    let voxels = head.into_iter().chain(centres.iter().flat_map(|c| c.to_array()));
    std::fs::write(format!("{file}.voxels"), bytes(voxels))?;
    Ok(())
}

fn run(file: &str, answers: &str) -> Outcome {
    let Task { mesh, .. } = Task::read(file)?;
    let voxels = numbers(&std::fs::read(format!("{file}.voxels"))?);
    let sphere = Sphere::new(Spiral::EqualArea, voxels[1] as usize, voxels[2]);
    // The mesh has a diagonal of 1 already. The shape rounds it once more, which the compared points must not have.
    let shape = shape(&mesh)?;
    let (tree, surface) = (TriangleBvh::new(&mesh)?, Surface::of(&shape)?);
    let (mut closest, mut fluxes) = (Vec::new(), Vec::new());
    for centre in medial_oracles::points(&voxels[3..]) {
        let start = tree.closest_from(centre, None).face;
        fluxes.push(surface.flux(&sphere, shape.normalisation().forward(centre), start));
        for &n in &sphere.directions {
            let near = tree.closest_from(centre + n * sphere.radius, Some(start));
            closest.extend([near.point.x, near.point.y, near.point.z, near.distance]);
        }
    }
    std::fs::write(answers, bytes(closest))?;
    std::fs::write(format!("{answers}.flux"), bytes(fluxes))?;
    Ok(())
}

fn time(name: &str, resolution: u32) -> Outcome {
    let shape = shape(&mesh(name)?)?;
    let solid = solid(&shape)?;
    let (clock, cpu) = (Instant::now(), cpu_time::ProcessTime::now());
    let tally = solid.descend(resolution, Wanted::All)?.tally;
    let (wall, cpu) = (clock.elapsed().as_secs_f64(), cpu.elapsed().as_secs_f64());
    println!("{wall:.4} {cpu:.4} {} {SAMPLES}", tally.evaluated);
    Ok(())
}
