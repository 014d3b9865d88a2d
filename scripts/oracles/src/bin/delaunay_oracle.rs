//! One side of the comparison with CGAL: makes point sets, triangulates a file of points, and
//! prints what `scripts/oracles/delaunay_cgal.cpp` prints for the same file.
//!
//! ```text
//! delaunay_oracle make NAME FILE     one of the point sets below, 4 f64 for each point: x, y, z,
//!                                    weight; `w:NAME` has weights
//! delaunay_oracle run FILE [weighted]
//!                                    cells, an order-free hash of them, seconds, peak KiB; with
//!                                    RAYON_NUM_THREADS=1 CPU seconds, which other work on the
//!                                    machine disturbs less, else seconds by the clock
//! ```
#![allow(clippy::print_stdout)]

use std::collections::HashMap;
use std::time::Instant;

use medial::Vec3;
use medial::geometry::delaunay::Delaunay;
use medial::geometry::regular::Regular;
use medial_oracles::{bytes, cpu_seconds, numbers};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    match args.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["make", name, file] => {
            let points = make(name).ok_or_else(|| format!("unknown point set {name}"))?;
            std::fs::write(file, bytes(points.into_iter().flatten()))?;
        }
        ["run", file] => run(file, false)?,
        ["run", file, "weighted"] => run(file, true)?,
        _ => return Err("usage: delaunay_oracle make NAME FILE | run FILE [weighted]".into()),
    }
    Ok(())
}

fn run(file: &str, weighted: bool) -> Result<(), Box<dyn std::error::Error>> {
    let rows = numbers(&std::fs::read(file)?);
    let (points, weights): (Vec<Vec3>, Vec<f64>) =
        rows.chunks_exact(4).map(|c| (Vec3::new(c[0], c[1], c[2]), c[3])).unzip();
    let before = peak_kib();
    let (start, clock) = (cpu_seconds(), Instant::now());
    let triangulation = match weighted {
        true => Regular::new(&points, &weights)?.into_triangulation(),
        false => Delaunay::new(&points)?.into_triangulation(),
    };
    let one = rayon::current_num_threads() == 1;
    let seconds = if one { cpu_seconds() - start } else { clock.elapsed().as_secs_f64() };
    let peak = peak_kib() - before;
    // A sum, since the two sides list cells in different orders.
    let set = triangulation.finite_cells().fold(0u64, |sum, c| {
        let mut v = triangulation.vertices(c).map(|v| hash_point(points[v.index()]));
        v.sort_unstable();
        sum.wrapping_add(v.into_iter().fold(0, |h, x| mix(h ^ x)))
    });
    println!("{} {set:016x} {seconds:.4} {peak}", triangulation.finite_cell_count());
    Ok(())
}

fn peak_kib() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|l| l.starts_with("VmHWM"));
    line.and_then(|l| l.split_whitespace().nth(1)?.parse().ok()).unwrap_or(0)
}

fn mix(x: u64) -> u64 {
    let x = (x ^ (x >> 33)).wrapping_mul(0xff51_afd7_ed55_8ccd);
    let x = (x ^ (x >> 33)).wrapping_mul(0xc4ce_b9fe_1a85_ec53);
    x ^ (x >> 33)
}

fn hash_point(p: Vec3) -> u64 {
    p.to_array().iter().fold(1, |h, x| mix(h ^ (x + 0.0).to_bits()))
}

fn make(name: &str) -> Option<Vec<[f64; 4]>> {
    let (weighted, name) = name.strip_prefix("w:").map_or((false, name), |rest| (true, rest));
    let (kind, size) = name.split_once('-')?;
    let n = size.parse().ok()?;
    let points = match kind {
        "cube" => cube(n),
        "surface" => surface(n),
        "sphere" => sphere(n),
        "lattice" => lattice(n, f64::from),
        "box" => box_grid(n),
        "icosphere" => icosphere(n),
        "cylinder" => cylinder(n),
        "plane" => plane(n),
        "line" => line(n),
        "moment" => moment(n),
        "cluster" => cluster(n),
        _ => return None,
    };
    // Random balls of about the points' distance; on degenerate sets all of one weight.
    let mut rng = Pcg64::seed_from_u64(4);
    let reach = match kind {
        "cube" => f64::from(n).powf(-1.0 / 3.0),
        "surface" | "sphere" => 2.0 * f64::from(n).powf(-0.5),
        _ => 0.0,
    };
    let mut weight = || match (weighted, reach) {
        (false, _) => 0.0,
        (true, 0.0) => 0.1,
        (true, _) => {
            let radius = reach * rng.random::<f64>();
            radius * radius
        }
    };
    Some(points.into_iter().map(|p| [p.x, p.y, p.z, weight()]).collect())
}

fn unit(rng: &mut Pcg64) -> Vec3 {
    Vec3::new(rng.random(), rng.random(), rng.random())
}

fn direction(rng: &mut Pcg64) -> Vec3 {
    loop {
        let v = 2.0 * unit(rng) - Vec3::ONE;
        if (1e-3..=1.0).contains(&v.length_squared()) {
            return v.normalize();
        }
    }
}

/// Uniformly random in the unit cube.
fn cube(n: u32) -> Vec<Vec3> {
    let mut rng = Pcg64::seed_from_u64(1);
    (0..n).map(|_| unit(&mut rng)).collect()
}

/// Random on a smooth surface with bumps and hollows.
fn surface(n: u32) -> Vec<Vec3> {
    let mut rng = Pcg64::seed_from_u64(2);
    (0..n)
        .map(|_| {
            let u = direction(&mut rng);
            u * (1.0 + 0.25 * (3.0 * u.x).sin() * (4.0 * u.y).cos() + 0.15 * (5.0 * u.z).sin())
        })
        .collect()
}

/// Random on the unit sphere, rounded.
fn sphere(n: u32) -> Vec<Vec3> {
    let mut rng = Pcg64::seed_from_u64(3);
    (0..n).map(|_| direction(&mut rng)).collect()
}

/// `n^3` integer points.
fn lattice(n: u32, coordinate: impl Fn(u32) -> f64) -> Vec<Vec3> {
    (0..n * n * n)
        .map(|i| Vec3::new(coordinate(i % n), coordinate(i / n % n), coordinate(i / n / n)))
        .collect()
}

/// The surface of the unit cube in steps of `1 / n`.
fn box_grid(n: u32) -> Vec<Vec3> {
    let all = lattice(n + 1, |x| f64::from(x) / f64::from(n));
    all.into_iter().filter(|p| p.to_array().into_iter().any(|x| x == 0.0 || x == 1.0)).collect()
}

/// An icosahedron, subdivided `n` times, on the unit sphere.
fn icosphere(n: u32) -> Vec<Vec3> {
    let g = (1.0 + 5f64.sqrt()) / 2.0;
    let mut points = Vec::new();
    for k in 0..3 {
        for (a, b) in [(1.0, g), (1.0, -g), (-1.0, g), (-1.0, -g)] {
            let mut p = [0.0; 3];
            p[(k + 1) % 3] = a;
            p[(k + 2) % 3] = b;
            points.push(Vec3::from(p).normalize());
        }
    }
    let mut faces = Vec::new();
    for a in 0..12 {
        for b in 0..a {
            for c in 0..b {
                // Corners that share an edge are 1.05 apart, others 1.7 or more.
                if [(a, b), (b, c), (a, c)]
                    .iter()
                    .all(|&(i, j)| points[i].distance(points[j]) < 1.2)
                {
                    faces.push([a, b, c]);
                }
            }
        }
    }
    for _ in 0..n {
        let mut middle = HashMap::new();
        let mut finer = Vec::with_capacity(4 * faces.len());
        for [a, b, c] in faces {
            let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(a, b)| {
                *middle.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    points.push((points[a] + points[b]).normalize());
                    points.len() - 1
                })
            });
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        faces = finer;
    }
    points
}

/// `n` rings of `n` points on a cylinder without caps, square in its unrolled steps.
fn cylinder(n: u32) -> Vec<Vec3> {
    let step = std::f64::consts::TAU / f64::from(n);
    (0..n * n)
        .map(|i| {
            let (sin, cos) = (f64::from(i % n) * step).sin_cos();
            Vec3::new(cos, sin, f64::from(i / n) * step)
        })
        .collect()
}

/// A planar grid of `n^2` points and an apex on either side.
fn plane(n: u32) -> Vec<Vec3> {
    let grid = (0..n * n).map(|i| Vec3::new(f64::from(i % n), f64::from(i / n), 0.0) / 100.0);
    grid.chain([Vec3::Z, -Vec3::Z]).collect()
}

/// `n` points of a line and two next to it.
fn line(n: u32) -> Vec<Vec3> {
    let on_line = (0..n).map(|i| Vec3::new(1.0, 2.0, 3.0) * f64::from(i) / 100.0);
    on_line.chain([Vec3::Y, Vec3::Z]).collect()
}

/// `n` points of the moment curve, all pairs of which are edges.
fn moment(n: u32) -> Vec<Vec3> {
    (0..n).map(|i| f64::from(i) / f64::from(n)).map(|t| Vec3::new(t, t * t, t * t * t)).collect()
}

/// `n` points in clusters of very different size.
fn cluster(n: u32) -> Vec<Vec3> {
    let mut rng = Pcg64::seed_from_u64(5);
    (0..n)
        .map(|i| unit(&mut rng) * 10f64.powi(-((i % 8) as i32) * 2) + Vec3::splat(f64::from(i % 3)))
        .collect()
}
