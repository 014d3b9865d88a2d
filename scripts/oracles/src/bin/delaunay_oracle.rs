//! One side of the comparison with CGAL: triangulates a file of `scripts/oracles/points.py`, and
//! prints what `scripts/oracles/delaunay_cgal.cpp` prints for the same file.
//!
//! ```text
//! delaunay_oracle FILE [weighted]    cells, an order-free hash of them, seconds, peak KiB; with
//!                                    RAYON_NUM_THREADS=1 CPU seconds, which other work on the
//!                                    machine disturbs less, else seconds by the clock
//! ```
#![allow(clippy::print_stdout)]

use std::time::Instant;

use medial::Vec3;
use medial::geometry::delaunay::Delaunay;
use medial::geometry::regular::Regular;
use medial_oracles::{cpu_seconds, numbers};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    match args.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        [file] => run(file, false),
        [file, "weighted"] => run(file, true),
        _ => Err("usage: delaunay_oracle FILE [weighted]".into()),
    }
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
