//! `medial reconstruct X.ma -o x.ply`: a surface from a medial mesh.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use medial::complex::{LoadedMa, MedialMesh};
use medial::shape::Shape;
use medial::surface::{SurfaceReport, TriMesh};
use medial::{complex, surface};
use medial_run::axis::{AxisOptions, FitBy, RadiiFrom, read_axis};
use medial_run::reconstruct::{betti_of, deviation, power_crust, union_boundary};
use medial_run::text::percent;
use serde::Serialize;
use serde_json::{Value, json};

use crate::args::{AxisArguments, Global, MeshArgument, SubstrateArguments, fraction};
use crate::exit::{Exit, Failure};
use crate::files::{SURFACES, check_apart, check_extension, check_folder, shape_of};
use crate::output::{StageCosts, counted, print_result};
use crate::provenance::peak_bytes;

#[derive(Debug, Args)]
pub struct Arguments {
    /// Medial mesh (.ma, or .ply with radii) [default for the power crust: all inner poles of the surface].
    axis: Option<PathBuf>,
    /// Write the surface (.ply, .off, .obj, .stl) in the units of the medial mesh.
    #[arg(short, long)]
    output: PathBuf,
    /// Compute this kind of surface.
    #[arg(long, value_enum, default_value_t = Method::Union)]
    method: Method,
    /// Measure the result against the original surface, a file or `builtin:ID[:RESOLUTION]`. The
    /// power crust requires it for its outer poles.
    #[arg(long, value_name = "MESH")]
    mesh: Option<MeshArgument>,
    /// Limit the distance to the boundary of the union, as a fraction of the diagonal of the original
    /// surface, or else of the spheres' box [default: the coarsest of 0.04, 0.02 and 0.01 with the
    /// union's topology, with all faces within 0.005].
    #[arg(long, value_name = "FRACTION", value_parser = fraction)]
    tolerance: Option<f64>,
    #[command(flatten)]
    fitting: AxisArguments,
    #[command(flatten)]
    substrate: SubstrateArguments,
}

/// The kind of reconstruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
enum Method {
    /// The boundary of the union of spheres, cones and slabs.
    Union,
    /// The surface between the power cells of the spheres and of the outer poles of the mesh.
    PowerCrust,
}

/// A result farther from the mesh than this, in its diagonals, is probably of another surface.
const ASTRAY: f64 = 0.5;

/// Runs the verb. Fails when an input is refused, the power crust has no mesh, the tolerance is too fine, or the output
/// cannot be written.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Exit, Failure> {
    let Arguments { axis, output, method, mesh: of, .. } = arguments;
    check_extension(output, &SURFACES)?;
    check_folder(output)?;
    check_apart(Some(output), axis.as_deref().into_iter().chain(of.as_deref()))?;
    match method {
        Method::Union if axis.is_none() => {
            let why = "the union requires a medial mesh; name one, or give --method power-crust";
            return Err(Failure::usage(why));
        }
        Method::PowerCrust if of.is_none() => {
            let why = "the power crust requires a surface for its outer poles; give --mesh MESH, or --method union";
            return Err(Failure::usage(why));
        }
        _ => {}
    }
    let mut stages = StageCosts::default();
    let line = global.stages();
    line.at("reading");
    let (shape, spheres, mut warnings) = stages.timed("read", || read(arguments))?;
    line.at("making the surface");
    let diagonal = shape.as_ref().map(|shape| shape.normalisation().diagonal);
    let made = stages.timed("reconstruct", || match (method, &spheres, &shape) {
        (Method::Union, Some(spheres), _) => union_boundary(spheres, diagonal, arguments.tolerance),
        (Method::PowerCrust, spheres, Some(shape)) => power_crust(shape, spheres.as_ref()),
        _ => unreachable!("both inputs are checked before reading"),
    });
    let named = axis.as_ref().or(of.as_ref()).expect("checked before reading");
    let made = made.map_err(|error| Failure::at(named, error))?;
    warnings.extend(made.warnings);
    stages.timed("write", || surface::write(output, &made.mesh)).map_err(Failure::input)?;
    // Before the check, whose memory is not that of the reconstruction.
    let peak = peak_bytes();

    // Untimed from here.
    line.at("checking the surface");
    let report = examine(output, &made.mesh, &mut warnings)?;
    warnings.extend(made.union_betti.and_then(|union| other_topology(union, &report)));
    let deviation = shape.as_ref().map(|shape| deviation(shape, &made.mesh)).transpose();
    let deviation = deviation.map_err(Failure::input)?;
    if let (Some([max, _]), Some(axis)) = (deviation, axis)
        && max > ASTRAY
    {
        warnings.push(format!(
            "the result is up to {max:.1} diagonals away from the mesh; check surface and units of {}",
            axis.display()
        ));
    }
    drop(line);
    let [seconds, cpu_seconds] = stages.seconds();
    let mut object = json!({
        "method": method, "vertices": report.vertices, "faces": report.faces,
        "closed": report.closed, "manifold": report.manifold, "genus": report.genus,
        "components": report.components, "intersecting_pairs": report.intersecting_pairs,
        "tolerance": made.tolerance, "diagonal": made.diagonal,
        "betti": report.expected_betti, "union_betti": made.union_betti,
        "seed": arguments.substrate.seed(), "deviation": deviation.map(|[max, mean]| json!({ "max": max, "mean": mean })),
        "seconds": seconds, "cpu_seconds": cpu_seconds, "peak_bytes": peak, "output": output,
    });
    if let Ok(Value::Object(figures)) = serde_json::to_value(&made.figures) {
        figures.into_iter().for_each(|(key, value)| object[key] = value);
    }
    let genus = report.genus.map_or_else(|| "undefined".to_owned(), |genus| genus.to_string());
    let yes = |flag: bool| if flag { "" } else { "not " };
    let mut text = format!(
        "{}: {}, {} in {:.2} s\n  {}closed, {}manifold, {}, genus {genus}",
        output.display(),
        counted(report.vertices as u64, "vertex"),
        counted(report.faces as u64, "face"),
        stages.total(),
        yes(report.closed),
        yes(report.manifold),
        counted(report.components as u64, "component")
    );
    if let Some([max, mean]) = deviation.map(|deviation| deviation.map(percent)) {
        text += &format!("\n  from the mesh: at most {max}, mean {mean}");
    }
    Ok(print_result(global, &object, &text, &warnings))
}

/// The shape, the medial mesh in the units of its file, if they are named, and notes on repairs.
type Read = (Option<Shape>, Option<MedialMesh>, Vec<String>);

fn read(arguments: &Arguments) -> Result<Read, Failure> {
    let options = arguments.substrate.shape_options()?;
    let loaded = arguments
        .mesh
        .as_ref()
        .map(|mesh| shape_of(mesh, options, arguments.substrate.as_is))
        .transpose()?;
    let shape = loaded.map(|(_, shape)| shape);
    let mut warnings = shape.as_ref().map_or_else(Vec::new, Shape::remarks);
    let axis = match (&arguments.axis, &shape) {
        (None, _) => None,
        (Some(path), Some(shape)) => Some(read_axis(path, shape, arguments.fitting.into())?.0),
        (Some(path), None) => Some(without_surface(path, arguments.fitting.into())?),
    };
    let axis = axis.map(|loaded| {
        let (mesh, notes) = loaded.with_remarks();
        warnings.extend(notes);
        mesh
    });
    Ok((shape, axis, warnings))
}

/// A medial mesh without a surface for units and radii.
fn without_surface(path: &Path, fitting: AxisOptions) -> Result<LoadedMa, Failure> {
    for (is_set, option) in
        [(fitting.fit != FitBy::None, "--fit"), (fitting.radii != RadiiFrom::File, "--radii")]
    {
        if is_set {
            return Err(Failure::usage(format!("{option} requires the surface; give --mesh MESH")));
        }
    }
    complex::read_with(path, fitting.read_options()).map_err(Failure::input)
}

/// The report of `medial info` on the written file, or on the mesh if the output is a device or pipe.
fn examine(
    path: &Path,
    mesh: &TriMesh,
    warnings: &mut Vec<String>,
) -> Result<SurfaceReport, Failure> {
    if !path.is_file() {
        return surface::validate(mesh).map_err(Failure::input);
    }
    let inspection = surface::inspect(path).map_err(Failure::input)?;
    warnings.extend(inspection.refused.map(|fault| fault.to_string()));
    warnings.extend(inspection.report.repairs.iter().map(ToString::to_string));
    warnings.extend(inspection.report.warnings.iter().cloned());
    Ok(inspection.report)
}

/// A warning for a surface without the Betti numbers of the union.
fn other_topology(union: [u64; 3], report: &SurfaceReport) -> Option<String> {
    // An open surface bounds no solid and has no such numbers.
    let found = betti_of(report)?;
    (found != union).then(|| {
        format!(
            "the surface has other Betti numbers than balls in the union (found {found:?}, expected {union:?}): it \
             lacks narrow crevices, holes or necks, or they have false ones; give a smaller tolerance"
        )
    })
}
