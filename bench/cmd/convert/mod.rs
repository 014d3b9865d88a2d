//! `medial convert A B`: between surface formats, or between medial mesh formats.

mod look;

use std::path::PathBuf;

use clap::Args;
use medial::{complex, surface};
use serde_json::json;

use self::look::LookArguments;
use crate::args::{Global, ReadArguments};
use crate::exit::{Exit, Failure};
use crate::files::{extension, is_medial};
use crate::output::{print_json, print_line};

/// Arguments of `convert`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Surface (OFF, OBJ, PLY, STL) or medial mesh (.ma and its dialects, .ply or .obj with radii).
    from: PathBuf,
    /// Surface (OFF, OBJ, PLY) or medial mesh (.ma, .ply, .obj, .vtp for ParaView, .glb for Blender and browsers).
    /// `.glb` has single precision, and its y is up: z here, as Blender shows it.
    to: PathBuf,
    #[command(flatten)]
    read: ReadArguments,
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
        let (loaded, look) = arguments.look.read(&arguments.from, &arguments.read)?;
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
