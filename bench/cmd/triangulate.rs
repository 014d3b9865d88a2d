//! `medial triangulate POINTS.npy`: the Delaunay or regular triangulation of an array of points.

use std::path::PathBuf;

use clap::Args;
use medial::Vec3;
use medial::geometry::delaunay::Delaunay;
use medial::geometry::regular::Regular;
use medial::geometry::triangulation::{Triangulation, TriangulationError};
use serde_json::{Map, json};

use crate::args::Global;
use crate::exit::{Exit, Failure};
use crate::output::{print_json, print_line};
use crate::run::{Matrix, peak_bytes, read_matrix, write_cells};
use medial::shape::Cost;

/// Arguments of `triangulate`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Array of points (.npy, float64 or float32): a row x, y, z for each point.
    points: PathBuf,
    /// Regular triangulation; rows are x, y, z, weight (the squared radius of a ball).
    #[arg(long)]
    weighted: bool,
    /// The finite cells (.npy, uint32): a row of four vertices for each, numbers of rows of the
    /// points from 0, positively oriented.
    #[arg(short, long)]
    output: Option<PathBuf>,
}

/// What became of the points.
struct Outcome {
    triangulation: Triangulation,
    hidden: usize,
    duplicates: usize,
}

/// Runs the verb.
///
/// # Errors
/// When the file is not an array of such rows, the points have no triangulation, or the output
/// cannot be written.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Exit, Failure> {
    let (read, reading) = Cost::of(|| read_points(arguments));
    let (points, weights) = read?;
    let count = points.len();
    let (outcome, triangulating) = Cost::of(|| triangulate(&points, weights.as_deref()));
    let outcome = outcome.map_err(|error| failure(arguments, &error))?;
    let triangulation = &outcome.triangulation;
    let mut laps = vec![("read", reading), ("triangulate", triangulating)];
    if let Some(output) = &arguments.output {
        let rows = triangulation.finite_cells().map(|c| triangulation.vertices(c).map(|v| v.0));
        let (written, writing) = Cost::of(|| write_cells(output, rows));
        written.map_err(Failure::input)?;
        laps.push(("write", writing));
    }
    let mut warnings = Vec::new();
    if outcome.duplicates > 0 {
        let n = outcome.duplicates;
        warnings.push(format!("{n} of {count} points repeat another one and are in no cell"));
    }
    if global.json {
        let by_stage = |value: fn(&Cost) -> f64| -> Map<_, _> {
            laps.iter().map(|(stage, lap)| ((*stage).to_owned(), value(lap).into())).collect()
        };
        let object = json!({
            "points": count,
            "cells": triangulation.cell_count(),
            "finite_cells": triangulation.finite_cell_count(),
            "hidden": outcome.hidden,
            "duplicates": outcome.duplicates,
            "weighted": arguments.weighted,
            "seconds": by_stage(|lap| lap.seconds),
            "cpu_seconds": by_stage(|lap| lap.cpu_seconds),
            "threads": rayon::current_num_threads(),
            "peak_bytes": peak_bytes(),
            "output": arguments.output,
        });
        print_json(&object, &warnings);
    } else {
        print_outcome(arguments, count, &outcome, triangulating.seconds, &warnings);
    }
    Ok(Exit::Done)
}

/// The points, and their weights where asked for.
fn read_points(arguments: &Arguments) -> Result<(Vec<Vec3>, Option<Vec<f64>>), Failure> {
    let matrix = read_matrix(&arguments.points).map_err(Failure::input)?;
    let needed = if arguments.weighted { 4 } else { 3 };
    if matrix.columns() != needed {
        return Err(wrong_columns(arguments, &matrix));
    }
    let point = |row| Vec3::new(matrix.at(row, 0), matrix.at(row, 1), matrix.at(row, 2));
    let points = (0..matrix.rows()).map(point).collect();
    let weights =
        arguments.weighted.then(|| (0..matrix.rows()).map(|row| matrix.at(row, 3)).collect());
    Ok((points, weights))
}

fn wrong_columns(arguments: &Arguments, matrix: &Matrix) -> Failure {
    let (rows, columns) = (matrix.rows(), matrix.columns());
    let advice = match (arguments.weighted, columns) {
        (false, 4) => "needed are 3 columns: x, y, z; with a weight in the fourth, add --weighted",
        (false, _) => "needed are 3 columns: x, y, z",
        (true, 3) => "--weighted needs 4 columns: x, y, z, weight; without weights, drop it",
        (true, _) => "--weighted needs 4 columns: x, y, z, weight",
    };
    let path = arguments.points.display();
    Failure::input(format!("{path}: the array has the shape ({rows}, {columns}); {advice}"))
}

fn triangulate(points: &[Vec3], weights: Option<&[f64]>) -> Result<Outcome, TriangulationError> {
    Ok(match weights {
        None => {
            let delaunay = Delaunay::new(points)?;
            let duplicates = delaunay.duplicates().len();
            Outcome { triangulation: delaunay.into_triangulation(), hidden: 0, duplicates }
        }
        Some(weights) => {
            let regular = Regular::new(points, weights)?;
            let (hidden, duplicates) = (regular.hidden().len(), regular.duplicates().len());
            Outcome { triangulation: regular.into_triangulation(), hidden, duplicates }
        }
    })
}

/// Names the file, and the row where there is one.
fn failure(arguments: &Arguments, error: &TriangulationError) -> Failure {
    use TriangulationError::{NotFinite, OutOfRange, Weight};
    let path = arguments.points.display();
    match error {
        NotFinite { index, .. } | OutOfRange { index, .. } | Weight { index, .. } => {
            Failure::input(format!("{path}, row {index}: {error}"))
        }
        _ => Failure::input(format!("{path}: {error}")),
    }
}

fn print_outcome(
    arguments: &Arguments,
    points: usize,
    outcome: &Outcome,
    seconds: f64,
    warnings: &[String],
) {
    let Outcome { triangulation, hidden, .. } = outcome;
    let finite = triangulation.finite_cell_count();
    let infinite = triangulation.infinite_cell_count();
    let path = arguments.points.display();
    print_line(&format!("{path}: {finite} cells of {points} points in {seconds:.2} s"));
    print_line(&format!("  {infinite} facets of the convex hull"));
    if arguments.weighted {
        print_line(&format!("  {hidden} hidden points, whose power cells are empty"));
    }
    for warning in warnings {
        print_line(&format!("  warning: {warning}"));
    }
    if let Some(output) = &arguments.output {
        print_line(&format!("  written: {}", output.display()));
    }
}
