//! `medial verify FILES`: what published medial meshes hold, against their surfaces, in one table.

use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;
use medial::complex::{self, LoadedMa, MaError, MaErrorKind};
use medial::metrics::{self, Counts, Evaluation, JudgeOptions, TriangleQuality};
use medial::shape::{Fit, ShapeOptions};
use serde::Serialize;

use crate::args::{AxisArguments, Global, MeasureArguments, ReadArguments, judge_options};
use crate::exit::{Exit, Failure};
use crate::files::{check_folder, medial_mesh_for};
use crate::output::{print_json, print_raw};
use crate::run::{FitBy, Input, RadiiFrom, Source, StageLine, hex_digest};

mod pairs;
mod table;

/// Arguments of `verify`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Medial meshes, or folders of them. `X.ma=MESH` names the surface of one.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Folders in which the surface of `NAME.ma` or `NAME_ANYTHING.ma` is sought, as `NAME.off`, `.obj`, `.ply` or `.stl` [default:
    /// that of the file].
    #[arg(long, value_name = "DIR")]
    meshes: Vec<PathBuf>,
    /// Where radii come from: `surface` for files that have none.
    #[arg(long, value_enum, default_value_t)]
    radii: RadiiFrom,
    /// Seed of the samples.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Write the table to a file, as Markdown.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    #[command(flatten)]
    read: ReadArguments,
    #[command(flatten)]
    measure: MeasureArguments,
}

/// What was found of one file.
#[derive(Debug, Serialize)]
pub(super) struct Row {
    file: PathBuf,
    sha256: Option<String>,
    mesh: Option<String>,
    /// Why the medial mesh or its surface cannot be read.
    refused: Option<String>,
    spheres_in_file: Option<usize>,
    counts: Option<Counts>,
    euler: Option<i64>,
    betti: Option<[u64; 3]>,
    quality: Option<TriangleQuality>,
    fit: Option<Fit>,
    evaluation: Option<Evaluation>,
    /// What was done to read the file.
    notes: Vec<String>,
    /// What is wrong with it, or may be.
    wrong: Vec<String>,
}

/// Runs the verb. A file that cannot be read is a row of the table, with the reason.
///
/// # Errors
/// When there is no file, or the table cannot be written.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Exit, Failure> {
    let options = judge_options(&arguments.measure, JudgeOptions::default(), arguments.seed)?;
    if let Some(path) = &arguments.output {
        check_folder(path)?;
    }
    let pairs = pairs::find(&arguments.files, &arguments.meshes)?;
    let line = StageLine::new(global.stages());
    let mut rows = Vec::new();
    for (file, surface) in pairs {
        line.at(file.display().to_string());
        rows.push(row(&file, surface, arguments, options));
    }
    drop(line);
    name_copies(&mut rows);
    let markdown = table::markdown(&rows);
    if let Some(path) = &arguments.output {
        let written = medial::write_atomically(path, |out| out.write_all(markdown.as_bytes()));
        written.map_err(|error| Failure::input(format!("{}: {error}", path.display())))?;
    }
    if global.json {
        print_json(&serde_json::json!({ "files": rows }), &[]);
    } else if arguments.output.is_none() {
        print_raw(&markdown);
    }
    let refused = rows.iter().filter(|row| row.refused.is_some()).count();
    Ok(match refused {
        0 => Exit::Done,
        _ if refused == rows.len() => Exit::Input,
        _ => Exit::SomeFailed,
    })
}

fn row(file: &Path, surface: Option<PathBuf>, arguments: &Arguments, options: JudgeOptions) -> Row {
    let mut row = Row {
        file: file.to_owned(),
        sha256: fs::read(file).ok().map(|bytes| hex_digest(&bytes)),
        mesh: surface.as_ref().map(|path| path.display().to_string()),
        refused: None,
        spheres_in_file: None,
        counts: None,
        euler: None,
        betti: None,
        quality: None,
        fit: None,
        evaluation: None,
        notes: Vec::new(),
        wrong: Vec::new(),
    };
    let filled = match surface {
        Some(surface) => against(&mut row, &surface, arguments, options),
        None => alone(&mut row, arguments),
    };
    row.refused = filled.err().map(|failure| failure.message);
    row
}

/// Measures a file against its surface.
fn against(
    row: &mut Row,
    surface: &Path,
    arguments: &Arguments,
    options: JudgeOptions,
) -> Result<(), Failure> {
    // A file that cannot be read is worse than a surface that cannot.
    let source = Source::parse(surface).map_err(Failure::usage)?;
    let shape = Input::load(&source).map_err(Failure::from).and_then(|input| {
        let shape = input.shape(ShapeOptions::default());
        Ok((shape.map_err(|error| Failure::of(&source, error))?, input))
    });
    let (shape, input) = match shape {
        Ok(read) => read,
        Err(failure) => {
            alone(row, arguments)?;
            return Err(failure);
        }
    };
    let fitting =
        AxisArguments { read: arguments.read.clone(), radii: arguments.radii, fit: FitBy::Auto };
    let (loaded, fit) = medial_mesh_for(&row.file, &shape, &fitting)?;
    row.fit = fit;
    if let Some(fit) = &fit {
        row.wrong.push(format!("other units: {} ({})", fit.similarity, fit.source));
    }
    let judge =
        shape.judge(input.axis.as_ref(), options).map_err(|error| Failure::of(&source, error))?;
    let to_normal = shape.normalisation();
    let mesh = loaded.mesh.transformed(1.0 / to_normal.diagonal, |p| to_normal.forward(p));
    let evaluation = judge.evaluate(&mesh);
    describe(row, loaded);
    let evaluation =
        evaluation.map_err(|error| Failure::input(format!("{}: {error}", row.file.display())))?;
    row.wrong.extend(evaluation.warnings.iter().cloned());
    row.evaluation = Some(evaluation);
    Ok(())
}

/// Says what a file holds without a surface.
fn alone(row: &mut Row, arguments: &Arguments) -> Result<(), Failure> {
    let loaded = complex::read_with(&row.file, arguments.read.options());
    let loaded = loaded.map_err(|error: MaError| match error.kind {
        MaErrorKind::NoRadii => Failure::input(format!("{error}; none was found for it")),
        _ => Failure::input(error),
    })?;
    describe(row, loaded);
    Ok(())
}

/// What is told of a medial mesh by itself.
fn describe(row: &mut Row, loaded: LoadedMa) {
    let LoadedMa { mesh, notes, warnings } = loaded;
    row.spheres_in_file = Some(mesh.spheres.len());
    row.counts = Some(metrics::counts(&mesh));
    row.euler = Some(complex::euler(&mesh));
    row.betti = Some(complex::betti(&mesh));
    row.quality = Some(metrics::triangle_quality(&mesh));
    row.notes = notes;
    row.wrong.extend(warnings);
}

/// Points out files of the same bytes: results of one program that are published as those of another, too.
fn name_copies(rows: &mut [Row]) {
    for i in 1..rows.len() {
        let first = (0..i).find(|&j| rows[j].sha256.is_some() && rows[j].sha256 == rows[i].sha256);
        if let Some(first) = first {
            let name = rows[first].file.display().to_string();
            rows[i].wrong.push(format!("the same bytes as {name}"));
        }
    }
}
