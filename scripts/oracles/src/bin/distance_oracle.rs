//! One side of the comparison with CGAL: makes a mesh with queries, answers them, and compares the
//! answers with those of `scripts/oracles/distance_cgal.cpp`.
//!
//! ```text
//! distance_oracle make NAME COUNT FILE   `torus` (100,352 triangles) or a mesh file, with COUNT
//!                                        random points inside, COUNT random points of the box, and
//!                                        COUNT degenerate ones: vertices, middles of edges and
//!                                        faces, points over vertices and edges
//! distance_oracle run FILE MODE ANSWERS  answers with doubles; prints CPU seconds for the queries
//!                                        and for everything before them
//! distance_oracle compare FILE MODE OURS THEIRS
//!                                        prints the differences; fails where there are any that
//!                                        rounding does not explain
//! ```
//!
//! Modes: `closest` (points inside), `inside` (points of the box), `inside-hard` (degenerate
//! ones), and without a counterpart `signed` (points of the box). `FILE` holds little-endian numbers: the counts of vertices, faces and queries of one kind
//! (u64), vertices (3 f64), faces (3 u32), the three kinds of queries (3 f64). Answers are x, y, z
//! and distance of the closest point, or one of 1, 0, -1 for inside, on, outside.
#![allow(clippy::print_stdout)]

#[path = "../../../../bench/benches/bumpy_torus/mod.rs"]
mod bumpy_torus;

use std::error::Error;
use std::io::Write as _;

use medial::Vec3;
use medial::surface::{self, InsideTest, Side, SignedDistance, TriMesh, TriangleBvh};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    match args.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["make", name, count, file] => make(name, count.parse()?, file),
        ["run", file, mode, answers] => run(&Task::read(file)?, mode, answers),
        ["compare", file, mode, ours, theirs] => compare(&Task::read(file)?, mode, ours, theirs),
        _ => Err("usage: distance_oracle make | run | compare; see the head of its source".into()),
    }
}

/// A mesh and the points to ask about.
struct Task {
    mesh: TriMesh,
    inside: Vec<Vec3>,
    around: Vec<Vec3>,
    hard: Vec<Vec3>,
}

fn make(name: &str, count: usize, file: &str) -> Result<(), Box<dyn Error>> {
    let mesh =
        if name == "torus" { bumpy_torus::mesh(224, 224) } else { surface::read(name)?.mesh };
    let (lo, hi) = mesh.bounding_box().ok_or("the mesh has no vertices")?;
    let mut rng = Pcg64::seed_from_u64(1);
    let mut random = |count: usize| -> Vec<Vec3> {
        let mut point = || lo + (hi - lo) * Vec3::new(rng.random(), rng.random(), rng.random());
        (0..count).map(|_| point()).collect()
    };
    let around = random(count);
    let test = InsideTest::new(&mesh);
    let mut inside = Vec::new();
    while inside.len() < count {
        let drawn = random(count);
        let sides = test.sides(&drawn);
        inside.extend(drawn.iter().zip(sides).filter(|(_, s)| *s == Side::Inside).map(|(&p, _)| p));
    }
    inside.truncate(count);
    let hard = degenerate(&mesh, count);
    Task { mesh, inside, around, hard }.write(file)?;
    Ok(())
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

impl Task {
    fn write(&self, file: &str) -> std::io::Result<()> {
        let mut out = std::io::BufWriter::new(std::fs::File::create(file)?);
        for count in [self.mesh.vertices.len(), self.mesh.faces.len(), self.inside.len()] {
            out.write_all(&(count as u64).to_le_bytes())?;
        }
        let points = |points: &[Vec3], out: &mut dyn std::io::Write| {
            points
                .iter()
                .flat_map(|p| p.to_array())
                .try_for_each(|x| out.write_all(&x.to_le_bytes()))
        };
        points(&self.mesh.vertices, &mut out)?;
        for v in self.mesh.faces.iter().flatten() {
            out.write_all(&v.to_le_bytes())?;
        }
        for queries in [&self.inside, &self.around, &self.hard] {
            points(queries, &mut out)?;
        }
        out.flush()
    }

    fn read(file: &str) -> Result<Self, Box<dyn Error>> {
        let bytes = std::fs::read(file)?;
        let mut rest = bytes.as_slice();
        let mut take = |count: usize| {
            let (head, tail) = rest.split_at_checked(count)?;
            rest = tail;
            Some(head)
        };
        let short = || format!("{file} is too short");
        let mut counts = [0; 3];
        for count in &mut counts {
            let word = take(8).ok_or_else(short)?;
            *count = u64::from_le_bytes(word.try_into()?) as usize;
        }
        let vertices = points(take(24 * counts[0]).ok_or_else(short)?);
        let id = |c: &[u8]| u32::from_le_bytes([c[0], c[1], c[2], c[3]]);
        let faces = take(12 * counts[1]).ok_or_else(short)?;
        let faces = faces.chunks_exact(12).map(|c| [id(c), id(&c[4..]), id(&c[8..])]).collect();
        let mut queries = || Ok::<_, String>(points(take(24 * counts[2]).ok_or_else(short)?));
        let (inside, around, hard) = (queries()?, queries()?, queries()?);
        Ok(Self { mesh: TriMesh { vertices, faces }, inside, around, hard })
    }

    fn queries(&self, mode: &str) -> &[Vec3] {
        match mode {
            "closest" => &self.inside,
            "inside-hard" => &self.hard,
            _ => &self.around,
        }
    }
}

fn numbers(bytes: &[u8]) -> Vec<f64> {
    let number = |c: &[u8]| f64::from_le_bytes(c.try_into().unwrap_or_default());
    bytes.chunks_exact(8).map(number).collect()
}

fn points(bytes: &[u8]) -> Vec<Vec3> {
    numbers(bytes).chunks_exact(3).map(|c| Vec3::new(c[0], c[1], c[2])).collect()
}

fn run(task: &Task, mode: &str, answers: &str) -> Result<(), Box<dyn Error>> {
    let queries = task.queries(mode);
    let start = cpu_seconds();
    let built;
    let found: Vec<f64> = match mode {
        "closest" => {
            let bvh = TriangleBvh::new(&task.mesh)?;
            built = cpu_seconds();
            let closest = bvh.closest_batch(queries);
            let row = |c: &medial::surface::Closest| [c.point.x, c.point.y, c.point.z, c.distance];
            closest.iter().flat_map(row).collect()
        }
        "inside" | "inside-hard" => {
            let test = InsideTest::new(&task.mesh);
            built = cpu_seconds();
            let sides = test.sides(queries);
            let value = |side: &Side| match side {
                Side::Inside => 1.0,
                Side::On => 0.0,
                Side::Outside => -1.0,
            };
            sides.iter().map(value).collect()
        }
        "signed" => {
            let (tree, inside) = (TriangleBvh::new(&task.mesh)?, InsideTest::new(&task.mesh));
            built = cpu_seconds();
            SignedDistance::closed(&tree, &inside).batch(queries)
        }
        _ => return Err(format!("unknown mode {mode}").into()),
    };
    println!("{:.4} {:.4}", cpu_seconds() - built, built - start);
    std::fs::write(answers, found.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>())?;
    Ok(())
}

fn compare(task: &Task, mode: &str, ours: &str, theirs: &str) -> Result<(), Box<dyn Error>> {
    let [ours, theirs] = [numbers(&std::fs::read(ours)?), numbers(&std::fs::read(theirs)?)];
    if ours.len() != theirs.len() || ours.is_empty() {
        return Err("the two sides do not have as many answers".into());
    }
    if mode != "closest" {
        let differing = ours.iter().zip(&theirs).filter(|(a, b)| a != b).count();
        let on = ours.iter().filter(|&&a| a == 0.0).count();
        println!("{differing} differ of {} ({on} on the surface)", ours.len());
        return if differing == 0 { Ok(()) } else { Err("inside tests differ".into()) };
    }
    let (lo, hi) = task.mesh.bounding_box().ok_or("the mesh has no vertices")?;
    let diagonal = lo.distance(hi);
    let (mut relative, mut absolute, mut apart, mut ties) = (0.0, 0.0, 0, 0);
    for (&p, (a, b)) in task.inside.iter().zip(ours.chunks(4).zip(theirs.chunks(4))) {
        let [q, r] = [a, b].map(|c| Vec3::new(c[0], c[1], c[2]));
        // Their point, measured by us: the comparison is not about their square root.
        let off = (a[3] - p.distance(r)).abs();
        absolute = f64::max(absolute, off / diagonal);
        relative = f64::max(relative, off / a[3].max(1e-3 * diagonal));
        if q.distance(r) > 1e-9 * diagonal {
            let tied = off <= 1e-12 * diagonal;
            ties += usize::from(tied);
            apart += usize::from(!tied);
        }
    }
    println!(
        "distances within {relative:.1e} relative, {absolute:.1e} of the diagonal; other points: \
         {apart}, and {ties} ties"
    );
    let agree = relative <= 1e-12 && apart == 0;
    if agree { Ok(()) } else { Err("closest points differ".into()) }
}

/// CPU seconds of all threads.
fn cpu_seconds() -> f64 {
    cpu_time::ProcessTime::try_now().map_or(0.0, |t| t.as_duration().as_secs_f64())
}
