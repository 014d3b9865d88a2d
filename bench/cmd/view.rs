//! `medial view X.ma [Y.ma ...] -o view.html`: medial meshes side by side in a browser.

use std::path::PathBuf;

use clap::Args;
use medial::Vec3;
use medial::complex::{self, MedialMesh};
use medial::geometry::trees::Bounds;
use medial::surface::TriMesh;
use medial_reports::View3d;
use medial_run::input::{Input, Source};
use serde_json::json;

use crate::args::{Global, MeshArgument};
use crate::exit::{Exit, Failure};
use crate::files::{self, check_extension, check_folder};
use crate::output::{counted, note, print_json, print_line};

#[derive(Debug, Args)]
pub struct Arguments {
    /// Medial meshes in the same units.
    #[arg(required = true, value_name = "X.ma")]
    axes: Vec<PathBuf>,
    /// Draw this surface as glass, coloured by the error of each result.
    #[arg(long, value_name = "MESH")]
    mesh: Option<MeshArgument>,
    /// Write the page, one file that opens offline.
    #[arg(short, long, value_name = "FILE.html")]
    output: PathBuf,
    /// Open the page in the browser.
    #[arg(long)]
    open: bool,
}

/// Runs the verb. Fails when an input is refused or empty, the page cannot be written, or there is no browser.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Exit, Failure> {
    let Arguments { axes: paths, output, .. } = arguments;
    check_extension(output, &["html"])?;
    check_folder(output)?;
    let mut notes = Vec::new();
    let mut axes = Vec::new();
    for path in paths {
        let (axis, remarks) = complex::read(path).map_err(Failure::input)?.with_remarks();
        if axis.spheres.is_empty() {
            return Err(Failure::at(path, "no sphere"));
        }
        notes.extend(remarks);
        axes.push(axis);
    }
    let surface = match &arguments.mesh {
        Some(mesh) => Input::load(&Source::parse(mesh)?)?.mesh,
        None => box_of(&axes),
    };
    let labels = paths.iter().zip(&axes).map(|(path, axis)| {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        (format!("{stem}: {}", counted(axis.spheres.len() as u64, "sphere")), axis)
    });
    let view = View3d::new(&surface, labels.collect()).map_err(Failure::input)?;
    files::write(output, view.page("Medial meshes").as_bytes())?;
    if arguments.open {
        open::that_detached(output).map_err(|error| Failure::at(output, error))?;
    }
    if global.json {
        print_json(&json!({ "output": output, "medial_meshes": axes.len() }), &notes);
    } else {
        notes.iter().for_each(|text| note(global, text));
        print_line(&format!("written: {}", output.display()));
    }
    Ok(Exit::Done)
}

/// The corners of the box of some unions, without faces, for the camera.
fn box_of(axes: &[MedialMesh]) -> TriMesh {
    let spheres = axes.iter().flat_map(|axis| &axis.spheres);
    let Bounds { lo, hi } =
        Bounds::of_points(spheres.flat_map(|s| [s.centre - s.radius, s.centre + s.radius]));
    let corner =
        |k: u32| Vec3::from([0, 1, 2].map(|c| if k >> c & 1 == 0 { lo[c] } else { hi[c] }));
    TriMesh { vertices: (0..8).map(corner).collect(), faces: vec![] }
}
