//! `medial repair IN -o OUT`: repairs a surface that nearly bounds a solid.

use std::path::PathBuf;

use clap::Args;
use medial::surface::{self, Components, MendOptions, WrapOptions};
use serde_json::json;

use crate::args::{Global, positive};
use crate::exit::{Exit, Failure};
use crate::files::{check_apart, check_folder};
use crate::output::print_result;

#[derive(Debug, Args)]
pub struct Arguments {
    /// Surface (OFF, OBJ, PLY, STL).
    input: PathBuf,
    /// Write the repaired surface (OFF, OBJ, PLY, STL).
    #[arg(short, long)]
    output: PathBuf,
    /// Close holes of up to 500 edges by triangles between their vertices.
    #[arg(long)]
    fill_holes: bool,
    /// Replace the surface by a closed one around it, also around an open or non-manifold surface or points
    ///
    /// ALPHA is a fraction of the bounding box's diagonal, 0.01 by default. Openings narrower than about twice ALPHA and enclosed
    /// cavities are filled. The vertices of the new surface are ALPHA / 30 away from the input. The number of faces grows with
    /// 1 / ALPHA^2.
    #[arg(long, value_name = "ALPHA", conflicts_with = "fill_holes", value_parser = positive)]
    wrap: Option<Option<f64>>,
    /// Keep all parts, the largest, the N largest, or those with a SHARE of the area (0.01 drops dust). A part has its cavities.
    #[arg(long, default_value = "all", value_name = "all|largest|N|SHARE")]
    components: Components,
}

/// Runs the verb. Nothing is written unless the result bounds a solid. Fails when the surface cannot be read, is still
/// refused after the repairs, or cannot be written.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Exit, Failure> {
    check_folder(&arguments.output)?;
    check_apart(Some(&arguments.output), [arguments.input.as_path()])?;
    let Arguments { fill_holes, components, .. } = *arguments;
    let options = MendOptions { fill_holes, components };
    // An error unless the repaired surface bounds a solid.
    let inspected = match arguments.wrap {
        Some(alpha) => {
            let options = alpha.map_or_else(WrapOptions::default, WrapOptions::with_alpha);
            surface::content(&arguments.input)
                .and_then(|bytes| surface::inspect_wrapped(&arguments.input, &bytes, options))
        }
        None => surface::inspect(&arguments.input),
    };
    let repaired = inspected.and_then(|found| found.mend(options)).map_err(Failure::input)?;
    surface::write(&arguments.output, &repaired.mesh).map_err(Failure::input)?;
    let report = repaired.report;
    let object = json!({
        "output": arguments.output, "vertices": report.vertices, "faces": report.faces,
        "components": report.components, "genus": report.genus, "repairs": report.repairs,
    });
    let (output, vertices, faces) = (arguments.output.display(), report.vertices, report.faces);
    let mut text = format!("{output}: {vertices} vertices, {faces} faces");
    report.repairs.iter().for_each(|repair| text += &format!("\n  repaired: {repair}"));
    Ok(print_result(global, &object, &text, &report.warnings))
}
