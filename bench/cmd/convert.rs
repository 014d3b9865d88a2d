//! `medial convert A B`: between surface formats, or between medial mesh formats.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use medial::complex::{LoadedMa, Look, MedialMesh, SheetGraph, SheetOptions, SphereValues};
use medial::geometry::trees::Bounds;
use medial::shape::{Shape, ShapeOptions};
use medial::surface::SignedDistance;
use medial::{complex, surface};
use medial_run::axis::{AxisOptions, extension, is_medial, read_axis};
use serde_json::json;

use crate::args::{Global, MeshArgument};
use crate::exit::{Exit, Failure};
use crate::files::{SURFACES, check_apart, check_extension, left_out, shape_of};
use crate::output::{counted, print_result};

#[derive(Debug, Args)]
pub struct Arguments {
    /// Surface (OFF, OBJ, PLY, STL), medial mesh (.ma and its dialects, .ply or .obj with radii), or list of spheres
    /// (.csv, .json, .yaml, .xrdf, .urdf, .xml, .txt, .xyzr).
    from: PathBuf,
    /// Surface (OFF, OBJ, PLY, STL as text), medial mesh (.ma, .ply, .obj, .vtp for ParaView, .glb for Blender and
    /// browsers), or list of spheres: .csv, .json, .yaml (cuRobo), .xrdf (Isaac), .urdf, .xml (MuJoCo), .txt or .xyzr (clumps).
    /// `.glb` has single precision, and its upward axis y is z of the input.
    to: PathBuf,
    /// Read all lines of a medial mesh whose header states a different number.
    #[arg(long)]
    lenient: bool,
    /// Read the K-th medial mesh, or link of a robot, of a file that holds several, counted from 1.
    #[arg(long, value_name = "K")]
    block: Option<usize>,
    #[command(flatten)]
    look: LookArguments,
}

/// Runs the verb. Repairs surfaces and prints every repair. Fails when the input is refused, the pair of formats does
/// not match, or the output cannot be written.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Exit, Failure> {
    let from = &arguments.from;
    check_apart(
        Some(&arguments.to),
        [from.as_path()].into_iter().chain(arguments.look.mesh.as_deref()),
    )?;
    let (notes, [points, faces], noun) = if is_medial(from)
        .map_err(|error| Failure::at(from, error))?
    {
        arguments.look.check(&arguments.to)?;
        let Arguments { lenient, block, .. } = *arguments;
        let options = AxisOptions { lenient, block, ..AxisOptions::default() };
        let (loaded, look) = arguments.look.read(&arguments.from, options)?;
        complex::write_with(&arguments.to, &loaded.mesh, &look).map_err(Failure::input)?;
        let (mesh, mut notes) = loaded.with_remarks();
        notes.extend(left_out(&arguments.to, &mesh));
        (notes, [mesh.spheres.len(), mesh.faces.len()], "sphere")
    } else if arguments.look.is_set() {
        let from = arguments.from.display();
        return Err(Failure::usage(format!(
            "{from}: a surface has no colours; name a medial mesh"
        )));
    // A medial mesh of a surface is computed, not converted.
    } else if complex::WRITABLE.contains(&&*extension(&arguments.to))
        && !SURFACES.contains(&&*extension(&arguments.to))
    {
        if !["builtin:", "dataset:"].iter().any(|known| from.to_string_lossy().starts_with(known)) {
            surface::read(from).map_err(Failure::input)?;
        }
        let (from, to) = (from.display(), arguments.to.display());
        let (verb, options) = match ["ma", "vtp", "glb"].contains(&&*extension(&arguments.to)) {
            true => ("axis", ""),
            false => ("simplify", " --method cover --spheres 32"),
        };
        return Err(Failure::usage(format!(
            "{from}: a surface, not a medial mesh; compute one by `medial {verb} {from}{options} -o {to}`"
        )));
    } else {
        let loaded = surface::read(&arguments.from).map_err(Failure::input)?;
        surface::write(&arguments.to, &loaded.mesh).map_err(Failure::input)?;
        let mut notes: Vec<String> =
            loaded.report.repairs.iter().map(ToString::to_string).collect();
        notes.extend(loaded.report.warnings);
        (notes, [loaded.mesh.vertices.len(), loaded.mesh.faces.len()], "vertex")
    };
    let object = json!({ "output": arguments.to, "vertices": points, "faces": faces });
    let mut text = format!("{}: {}", arguments.to.display(), counted(points as u64, noun));
    if !complex::holds_spheres_alone(&arguments.to) {
        text += &format!(", {}", counted(faces as u64, "face"));
    }
    Ok(print_result(global, &object, &text, &notes))
}

/// Options of formats for viewers.
#[derive(Debug, Args)]
struct LookArguments {
    /// Colour `.glb` by this, and add it to `.vtp` as an array [default: radius].
    #[arg(long, alias = "colour", value_enum)]
    color: Option<Colour>,
    /// Measure errors to this surface (a file, or `builtin:ID[:RESOLUTION]`) in the units of the medial mesh.
    #[arg(long, value_name = "SURFACE")]
    mesh: Option<MeshArgument>,
    /// Add the spheres to `.glb` as round bodies, each of 80 triangles and 2.3 kB.
    #[arg(long)]
    spheres: bool,
}

/// The quantity behind the colours of a medial mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Colour {
    /// The radii of the spheres.
    Radius,
    /// The least stability ratio of the edges of each sphere.
    Stability,
    /// The distance by which each sphere exceeds the surface (red) or falls short of it (blue).
    Error,
    /// One colour for each sheet. Sheets get separate spheres. Seams and curves are black lines, junctions isolated spheres.
    Sheet,
}

impl LookArguments {
    /// Whether any of the options was given.
    fn is_set(&self) -> bool {
        self.color.is_some() || self.mesh.is_some() || self.spheres
    }

    /// Refuses options that the output format lacks, and incomplete ones, before any file is read. The error names the
    /// option.
    fn check(&self, to: &Path) -> Result<(), Failure> {
        for (is_set, option, extensions) in [
            (self.color.is_some(), "--color", &["vtp", "glb"][..]),
            (self.spheres, "--spheres", &["glb"]),
        ] {
            if is_set && let Err(Failure { message, .. }) = check_extension(to, extensions) {
                return Err(Failure::usage(format!("{option}: {message}")));
            }
        }
        match (self.color, &self.mesh) {
            (Some(Colour::Error), None) => {
                Err(Failure::usage("--color error: no surface; give --mesh MESH"))
            }
            (Some(Colour::Error), Some(_)) | (_, None) => Ok(()),
            (_, Some(_)) => Err(Failure::usage("--mesh requires --color error")),
        }
    }

    /// Reads a medial mesh and its display options. Fails when it or the surface is refused, or they cannot belong
    /// together.
    fn read(&self, from: &Path, options: AxisOptions) -> Result<(LoadedMa, Look), Failure> {
        if let Some(surface) = &self.mesh {
            let (_, shape) = shape_of(surface, ShapeOptions::default(), false)?;
            let loaded = read_axis(from, &shape, options)?.0;
            let values = Some(SphereValues::error(errors(&loaded.mesh, &shape)?));
            return Ok((loaded, Look { values, balls: self.spheres }));
        }
        let mut loaded =
            complex::read_with(from, options.read_options()).map_err(Failure::input)?;
        let values = match self.color {
            Some(Colour::Sheet) => {
                let sizes = SheetOptions::of_diagonal(diagonal(&loaded.mesh));
                let graph = SheetGraph::new(&loaded.mesh, sizes);
                let (painted, values) = graph.painted(&loaded.mesh);
                loaded.mesh = painted;
                Some(SphereValues::sheet(values))
            }
            Some(Colour::Stability) => {
                Some(SphereValues::stability(&loaded.mesh, diagonal(&loaded.mesh)))
            }
            Some(Colour::Radius | Colour::Error) | None => None,
        };
        Ok((loaded, Look { values, balls: self.spheres }))
    }
}

/// Of each sphere its radius less the depth of its centre below the surface, in input units.
fn errors(mesh: &MedialMesh, shape: &Shape) -> Result<Vec<f64>, Failure> {
    let to_normal = shape.normalisation();
    let centres: Vec<_> = mesh.spheres.iter().map(|s| to_normal.forward(s.centre)).collect();
    let tree = shape.surface_tree().map_err(Failure::input)?;
    let inside = shape.inside_test();
    let heights = SignedDistance::closed(&tree, &inside).batch(&centres);
    // Heights are negative inside, and fractions of the diagonal.
    Ok((mesh.spheres.iter().zip(heights))
        .map(|(sphere, height)| sphere.radius + height * to_normal.diagonal)
        .collect())
}

/// Diagonal of the box of all balls; 1 where there is none.
fn diagonal(mesh: &MedialMesh) -> f64 {
    let corners = mesh.spheres.iter().flat_map(|s| [s.centre - s.radius, s.centre + s.radius]);
    let bounds = Bounds::of_points(corners);
    // Without the surface the balls give the unit.
    let diagonal = (bounds.hi - bounds.lo).length();
    if diagonal > 0.0 && diagonal.is_finite() { diagonal } else { 1.0 }
}
