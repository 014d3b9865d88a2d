//! `medial convert A B`: between surface formats, or between medial mesh formats.

mod look;

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use clap::Args;
use medial::{complex, surface};
use serde_json::json;

use self::look::LookArguments;
use crate::args::Global;
use crate::exit::{Exit, Failure};
use crate::files::extension;
use crate::output::{print_json, print_line};

/// No header of a PLY file is longer, in bytes.
const HEADER_LIMIT: u64 = 1 << 20;

/// Arguments of `convert`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Surface (OFF, OBJ, PLY, STL, GLB) or medial mesh (.ma, .vtp, .ply with a radius, .glb with `_RADIUS`).
    from: PathBuf,
    /// Surface (OFF, OBJ, PLY) or medial mesh (.ma, .ply, .obj, .vtp for ParaView, .glb for Blender and browsers).
    /// `.glb` has single precision, and its y is up: z here, as Blender shows it.
    to: PathBuf,
    #[command(flatten)]
    look: LookArguments,
}

/// Runs the verb. Surfaces are repaired on the way, and every repair is told.
///
/// # Errors
/// When the input is refused, the pair of formats makes no sense, or the output cannot be written.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Exit, Failure> {
    let (notes, vertices, faces) = if is_medial(&arguments.from)? {
        arguments.look.check(&arguments.to)?;
        let (loaded, look) = arguments.look.read(&arguments.from)?;
        complex::write_with(&arguments.to, &loaded.mesh, &look).map_err(Failure::input)?;
        let (mesh, mut notes) = loaded.with_remarks();
        notes.extend(look::loss(&arguments.to, &mesh));
        (notes, mesh.spheres.len(), mesh.faces.len())
    } else if arguments.look.is_asked() {
        let from = arguments.from.display();
        return Err(Failure::usage(format!(
            "{from} is a surface: only medial meshes have colours"
        )));
    } else if ["ma", "vtp", "glb"].contains(&extension(&arguments.to).as_str()) {
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

/// Whether a file holds a medial mesh: `.ma`, lists of spheres and `.vtp`, or `.ply` and `.glb` whose vertices have a
/// radius.
fn is_medial(path: &Path) -> Result<bool, Failure> {
    match extension(path).as_str() {
        "ma" | "ma_dup" | "sph" | "txt" | "xyzr" | "vtp" => Ok(true),
        "glb" => complex::glb_has_radii(path).map_err(Failure::input),
        "ply" => ply_has_radius(path),
        _ => Ok(false),
    }
}

fn ply_has_radius(path: &Path) -> Result<bool, Failure> {
    let fail = |error| Failure::input(format!("{}: {error}", path.display()));
    let mut reader = BufReader::new(File::open(path).map_err(fail)?).take(HEADER_LIMIT);
    let mut line = Vec::new();
    while reader.read_until(b'\n', &mut line).map_err(fail)? > 0 {
        let words: Vec<&[u8]> =
            line.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty()).collect();
        match words.as_slice() {
            [b"end_header"] => break,
            [b"property", _, b"radius"] => return Ok(true),
            _ => line.clear(),
        }
    }
    Ok(false)
}
