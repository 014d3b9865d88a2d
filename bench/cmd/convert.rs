//! `medial convert A B`: between surface formats, or between medial mesh formats.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use clap::Args;
use medial::{complex, surface};
use serde_json::json;

use crate::args::{Global, ReadArguments};
use crate::exit::{Exit, Failure};
use crate::files::extension;
use crate::output::{print_json, print_line};

/// What a file holds is told by its first bytes; no header of a PLY file is longer than so many.
const HEADER_LIMIT: u64 = 1 << 20;

/// Arguments of `convert`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Surface (OFF, OBJ, PLY, STL) or medial mesh (.ma and its dialects, .ply or .obj with radii).
    from: PathBuf,
    /// Surface (OFF, OBJ, PLY) or medial mesh (.ma, .ply, .obj).
    to: PathBuf,
    #[command(flatten)]
    read: ReadArguments,
}

/// Runs the verb. Surfaces are repaired on the way, and every repair is told.
///
/// # Errors
/// When the input is refused, the pair of formats makes no sense, or the output cannot be written.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Exit, Failure> {
    let (notes, vertices, faces) = if is_medial(&arguments.from)? {
        let loaded = complex::read_with(&arguments.from, arguments.read.options())
            .map_err(Failure::input)?;
        complex::write(&arguments.to, &loaded.mesh).map_err(Failure::input)?;
        let (mesh, notes) = loaded.with_remarks();
        (notes, mesh.spheres.len(), mesh.faces.len())
    } else if extension(&arguments.to) == "ma" {
        return Err(Failure::usage(format!(
            "a surface is not a medial mesh: `medial axis {} -o {}` computes one",
            arguments.from.display(),
            arguments.to.display()
        )));
    } else {
        let loaded = surface::read(&arguments.from).map_err(Failure::input)?;
        surface::write(&arguments.to, &loaded.mesh).map_err(Failure::input)?;
        let mut notes: Vec<String> =
            loaded.report.repairs.iter().map(ToString::to_string).collect();
        notes.extend(loaded.report.warnings);
        (notes, loaded.mesh.vertices.len(), loaded.mesh.faces.len())
    };
    if global.json {
        let object = json!({ "output": arguments.to, "vertices": vertices, "faces": faces });
        print_json(&object, &notes);
    } else {
        print_line(&format!("{}: {vertices} vertices, {faces} faces", arguments.to.display()));
        for note in notes {
            print_line(&format!("  note: {note}"));
        }
    }
    Ok(Exit::Done)
}

/// Whether a file holds a medial mesh: `.ma` and lists of spheres, `.ply` whose vertices have a radius, `.obj` whose vertices
/// have a fourth number.
fn is_medial(path: &Path) -> Result<bool, Failure> {
    match extension(path).as_str() {
        "ma" | "ma_dup" | "sph" | "txt" | "xyzr" => Ok(true),
        "ply" => any_line(path, |words| match words {
            [b"end_header"] => Some(false),
            [b"property", _, b"radius" | b"r"] => Some(true),
            _ => None,
        }),
        "obj" => any_line(path, |words| match words {
            [b"v", coordinates @ ..] => Some(coordinates.len() == 4),
            _ => None,
        }),
        _ => Ok(false),
    }
}

/// What the first line says that says anything.
fn any_line(path: &Path, says: impl Fn(&[&[u8]]) -> Option<bool>) -> Result<bool, Failure> {
    let fail = |error| Failure::input(format!("{}: {error}", path.display()));
    let mut reader = BufReader::new(File::open(path).map_err(fail)?).take(HEADER_LIMIT);
    let mut line = Vec::new();
    while reader.read_until(b'\n', &mut line).map_err(fail)? > 0 {
        let words: Vec<&[u8]> =
            line.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty()).collect();
        if let Some(said) = says(&words) {
            return Ok(said);
        }
        line.clear();
    }
    Ok(false)
}
