//! One side of the comparison with CGAL: makes a mesh with queries and runs them. `scripts/oracles/compare.py` compares
//! the answers with those of `scripts/oracles/distance_cgal.cpp`.
//!
//! ```text
//! distance_oracle make NAME COUNT FILE   `torus` (100,352 triangles) or a mesh file, with COUNT
//!                                        random points inside, COUNT random points of the box, and
//!                                        COUNT degenerate ones: vertices, middles of edges and
//!                                        faces, points over vertices and edges
//! distance_oracle run FILE MODE ANSWERS  answers with doubles; prints CPU seconds for the queries
//!                                        and for everything before them
//! ```
//!
//! Modes: `closest` (points inside), `inside` (points of the box), `inside-hard` (degenerate
//! ones), and without a counterpart `signed` (points of the box). `FILE` is a [`Task`]. Answers are x, y, z
//! and distance of the closest point, or one of 1, 0, -1 for inside, on, outside.
#![allow(clippy::print_stdout)]

use std::error::Error;

use medial::Vec3;
use medial::surface::{self, InsideTest, Side, SignedDistance, TriMesh, TriangleBvh};
use medial_oracles::{Task, bumpy_torus, bytes, cpu_seconds};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    match args.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["make", name, count, file] => make(name, count.parse()?, file),
        ["run", file, mode, answers] => run(&Task::read(file)?, mode, answers),
        _ => Err("usage: distance_oracle make | run; see the head of its source".into()),
    }
}

fn make(name: &str, count: usize, file: &str) -> Result<(), Box<dyn Error>> {
    let mesh = if name == "torus" { bumpy_torus(224) } else { surface::read(name)?.mesh };
    let (lo, hi) = mesh.bounding_box().ok_or("the mesh has no vertices")?;
    let mut rng = Pcg64::seed_from_u64(1);
    let around = random(&mut rng, lo, hi, count);
    let test = InsideTest::new(&mesh);
    let mut inside = Vec::new();
    while inside.len() < count {
        let drawn = random(&mut rng, lo, hi, count);
        let sides = test.sides(&drawn);
        inside.extend(drawn.iter().zip(sides).filter(|(_, s)| *s == Side::Inside).map(|(&p, _)| p));
    }
    inside.truncate(count);
    let hard = degenerate(&mesh, count);
    Ok(Task { mesh, queries: [inside, around, hard] }.write(file)?)
}

/// Uniform in a box.
fn random(rng: &mut Pcg64, lo: Vec3, hi: Vec3, count: usize) -> Vec<Vec3> {
    (0..count)
        .map(|_| lo + (hi - lo) * Vec3::new(rng.random(), rng.random(), rng.random()))
        .collect()
}

/// Points on the surface, and points that share coordinates with it.
fn degenerate(mesh: &TriMesh, count: usize) -> Vec<Vec3> {
    let mut rng = Pcg64::seed_from_u64(2);
    (0..count)
        .map(|k| {
            let [a, b, c] = mesh.triangle(rng.random_range(0..mesh.faces.len()));
            match k % 6 {
                0 => a,
                1 => (a + b) * 0.5,
                2 => (a + b + c) / 3.0,
                3 => Vec3::new(a.x, a.y, b.z),
                4 => Vec3::new(a.x, b.y, b.z),
                _ => ((a + b) * 0.5).with_z(c.z),
            }
        })
        .collect()
}

fn queries<'a>(task: &'a Task, mode: &str) -> &'a [Vec3] {
    let [inside, around, hard] = &task.queries;
    match mode {
        "closest" => inside,
        "inside-hard" => hard,
        _ => around,
    }
}

fn run(task: &Task, mode: &str, answers: &str) -> Result<(), Box<dyn Error>> {
    let queries = queries(task, mode);
    let start = cpu_seconds();
    let built;
    let found: Vec<f64> = match mode {
        "closest" => {
            let bvh = TriangleBvh::new(&task.mesh)?;
            built = cpu_seconds();
            let closest = bvh.closest_batch(queries);
            closest.iter().flat_map(|c| [c.point.x, c.point.y, c.point.z, c.distance]).collect()
        }
        "inside" | "inside-hard" => {
            let test = InsideTest::new(&task.mesh);
            built = cpu_seconds();
            let sides = test.sides(queries).into_iter();
            sides
                .map(|side| match side {
                    Side::Inside => 1.0,
                    Side::On => 0.0,
                    Side::Outside => -1.0,
                })
                .collect()
        }
        "signed" => {
            let (tree, inside) = (TriangleBvh::new(&task.mesh)?, InsideTest::new(&task.mesh));
            built = cpu_seconds();
            SignedDistance::closed(&tree, &inside).batch(queries)
        }
        _ => return Err(format!("unknown mode {mode}").into()),
    };
    println!("{:.4} {:.4}", cpu_seconds() - built, built - start);
    Ok(std::fs::write(answers, bytes(found))?)
}
