//! The voxels of a result as a file: `medial simplify --voxels FILE`.
//!
//! - `.ply`: a point for each voxel, `x y z` its centre, then `distance`, `flux` and the indices
//!   `i j k` in the lattice.
//! - `.csv`: the same with a heading.
//!
//! Lengths are in the units of the surface. The result's JSON has the lattice: its lower corner,
//! the side of a voxel, the number of voxels along each axis.

use std::io::{self, Write};
use std::path::Path;

use medial::shape::Shape;
use medial_methods::aof::LatticeVoxels;
use serde_json::json;

use crate::exit::Failure;
use crate::files::{check_extension, check_folder, extension};

const EXTENSIONS: [&str; 2] = ["ply", "csv"];
const COLUMNS: [&str; 8] = ["x", "y", "z", "distance", "flux", "i", "j", "k"];

/// Refuses a file that could not be written, before anything is computed.
///
/// # Errors
/// When its extension is unknown, or its folder not there.
pub fn check(path: &Path) -> Result<(), Failure> {
    check_extension(path, &EXTENSIONS)?;
    check_folder(path)
}

/// Writes voxels.
///
/// # Errors
/// When the file cannot be written.
pub fn write(path: &Path, voxels: &LatticeVoxels, shape: &Shape) -> Result<(), Failure> {
    let rows = rows(voxels, shape);
    let write = |out: &mut dyn Write| match extension(path).as_str() {
        "ply" => ply(out, &rows),
        _ => csv(out, &rows),
    };
    medial::write_atomically(path, |out| write(out))
        .map_err(|error| Failure::input(format!("{}: {error}", path.display())))
}

/// What the result's JSON says of voxels.
pub fn describe(voxels: &LatticeVoxels, shape: &Shape) -> serde_json::Value {
    let back = shape.normalisation();
    json!({
        "count": voxels.voxels.len(),
        "origin": back.backward(voxels.origin).to_array(),
        "side": voxels.side * back.diagonal,
        "size": voxels.size,
        "betti": voxels.betti(),
    })
}

fn rows(voxels: &LatticeVoxels, shape: &Shape) -> Vec<[f64; 8]> {
    let back = shape.normalisation();
    let row = |voxel| {
        let [x, y, z] = back.backward(voxels.centre(voxel)).to_array();
        let [i, j, k] = voxel.place.map(f64::from);
        [x, y, z, voxel.distance * back.diagonal, voxel.flux, i, j, k]
    };
    voxels.voxels.iter().map(row).collect()
}

fn ply(out: &mut dyn Write, rows: &[[f64; 8]]) -> io::Result<()> {
    write!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {}\n", rows.len())?;
    for (column, name) in COLUMNS.iter().enumerate() {
        writeln!(out, "property {} {name}", if column < 5 { "double" } else { "uint" })?;
    }
    out.write_all(b"end_header\n")?;
    for row in rows {
        row[..5].iter().try_for_each(|value| out.write_all(&value.to_le_bytes()))?;
        row[5..].iter().try_for_each(|&index| out.write_all(&(index as u32).to_le_bytes()))?;
    }
    Ok(())
}

fn csv(out: &mut dyn Write, rows: &[[f64; 8]]) -> io::Result<()> {
    writeln!(out, "{}", COLUMNS.join(","))?;
    for [x, y, z, distance, flux, i, j, k] in rows {
        writeln!(out, "{x},{y},{z},{distance},{flux},{i},{j},{k}")?;
    }
    Ok(())
}
