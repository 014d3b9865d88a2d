//! `medial render MESH [AXIS.ma ...] -o x.png`: pictures of a surface and of its medial meshes.

use std::path::PathBuf;

use clap::Args;
use clap::builder::TypedValueParser;
use medial::complex::MedialMesh;
use medial::shape::ShapeOptions;
use medial_reports::drawing::{
    Background, ColourBy, DrawError, Drawing, Drawn, Show, TOLERANCE, Upward, View, hausdorff_text,
};
use medial_run::axis::read_axis;
use medial_run::error::InputError;
use serde_json::json;

use crate::args::{AxisArguments, Global, MeshArgument, fraction, word};
use crate::exit::{Exit, Failure};
use crate::files::{self, check_extension, check_folder, shape_of};
use crate::output::print_result;

#[derive(Debug, Args)]
pub struct Arguments {
    /// Surface file (OFF, OBJ, PLY, STL), `builtin:ID[:RESOLUTION]` or `dataset:NAME`.
    mesh: MeshArgument,
    /// Medial meshes (.ma or .ply with radii). Several give a strip with one panel for each.
    axes: Vec<PathBuf>,
    /// Write the picture (.png).
    #[arg(short, long)]
    output: PathBuf,
    /// Draw this [default: `axis`, or `surface` without a medial mesh].
    #[arg(long, value_parser = show())]
    show: Option<Show>,
    /// Colour medial meshes by this.
    #[arg(long, alias = "colour", default_value = "radius", value_parser = colour())]
    color: ColourBy,
    /// Look from `front`, `back`, `left`, `right`, `top`, `bottom`, `iso`, AZIMUTH,ELEVATION in degrees, or direction
    /// X,Y,Z [default: the direction that shows most of the shape].
    #[arg(long, value_name = "VIEW", allow_hyphen_values = true)]
    camera: Option<View>,
    /// Set the upward direction: `x`, `y`, `z`, `-x`, `-y`, `-z` or X,Y,Z [default: `y`, or `z` for shapes that are flat
    /// along `y`].
    #[arg(long, value_name = "DIRECTION", allow_hyphen_values = true)]
    up: Option<Upward>,
    /// Set the pixels of each panel.
    #[arg(long, value_name = "WxH", default_value = "800x600", value_parser = size)]
    size: [usize; 2],
    /// Set the background: `white`, `black`, `transparent` or `#rrggbb`.
    #[arg(long, value_name = "COLOUR", default_value = "white")]
    background: Background,
    /// End the colour scale of errors here, as a fraction of the diagonal [default: covers 90 % of the errors, of several
    /// medial meshes those of the better half].
    #[arg(long, value_name = "FRACTION", value_parser = fraction)]
    max_error: Option<f64>,
    /// Limit the distance of a reconstruction to the boundary of the union, as a fraction of the diagonal.
    #[arg(long, value_name = "FRACTION", default_value_t = TOLERANCE, value_parser = fraction)]
    tolerance: f64,
    #[command(flatten)]
    fitting: AxisArguments,
}

fn show() -> impl TypedValueParser<Value = Show> {
    word(&[
        ("surface", "The surface"),
        ("axis", "The medial mesh, with the surface as glass around it"),
        ("reconstruction", "The boundary of the union of the spheres, cones and slabs"),
        (
            "error",
            "The reconstruction coloured by its distance to the surface: red outside, blue inside, glass where parts \
             are missing. Several medial meshes are drawn above their reconstructions",
        ),
        (
            "structure",
            "The sheets of the medial mesh in separate colours, seams and curves black, within the surface as glass",
        ),
    ])
}

fn colour() -> impl TypedValueParser<Value = ColourBy> {
    word(&[
        ("radius", "The radii of the spheres"),
        ("plain", "One colour for sheets, one for curves"),
    ])
}

/// Runs the verb. Fails when an input is refused, an option is invalid, or the picture cannot be written.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Exit, Failure> {
    // All options are checked before the first file is read.
    let Arguments { output, show, color, camera, up, size, background, .. } = arguments;
    check_extension(output, &["png"])?;
    check_folder(output)?;
    let drawing = Drawing {
        show: *show,
        colour: *color,
        camera: *camera,
        up: *up,
        size: *size,
        background: *background,
        max_error: arguments.max_error,
        tolerance: arguments.tolerance,
    };
    let stem = |path: &PathBuf| path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let failed = |error: DrawError| {
        let DrawError { axis, error: InputError { is_option, message } } = error;
        let code = if is_option { Exit::Usage } else { Exit::Input };
        // The file instead of the caption.
        let message = match arguments.axes.iter().find(|path| Some(stem(path)) == axis) {
            Some(path) => Failure::at(path, message).message,
            None if is_option => format!("--{message}"),
            None => message,
        };
        Failure { code, message }
    };
    drawing.content(arguments.axes.len()).map_err(|error| failed(error.into()))?;
    let line = global.stages();
    line.at("reading");
    let (_, shape) = shape_of(&arguments.mesh, ShapeOptions::default(), false)?;
    let mut warnings = shape.remarks();
    let units = shape.normalisation();
    let mut axes: Vec<(String, MedialMesh)> = Vec::new();
    for path in &arguments.axes {
        let (mesh, notes) = read_axis(path, &shape, arguments.fitting.into())?.0.with_remarks();
        warnings.extend(notes);
        axes.push((stem(path), mesh.to_normal(units)));
    }
    let drawn = drawing.draw(&shape, &axes, &|stage| line.at(stage)).map_err(failed)?;
    let Drawn { png, width, height, direction, up, errors, seconds } = drawn;
    files::write(output, &png)?;
    drop(line);
    let object = json!({
        "output": output, "width": width, "height": height, "direction": direction.to_array(),
        "up": up.to_array(), "errors": errors, "seconds": seconds,
    });
    let mut text = format!("{}: {width} x {height} pixels", output.display());
    for error in errors.iter().filter_map(|error| error.hausdorff) {
        text = text + "; " + &hausdorff_text(error);
    }
    Ok(print_result(global, &object, &text, &warnings))
}

/// Width and height from `WxH`.
fn size(text: &str) -> Result<[usize; 2], &'static str> {
    let sides = text.split_once(['x', 'X']).and_then(|(width, height)| {
        Some([width.trim().parse().ok()?, height.trim().parse().ok()?])
    });
    sides.ok_or("expected WIDTHxHEIGHT in pixels, for example 800x600")
}
