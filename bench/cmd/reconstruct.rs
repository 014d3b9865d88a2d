//! `medial reconstruct X.ma -o x.ply`: a surface from a medial mesh.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use medial::complex::{
    ContourError, LoadedMa, MedialMesh, MedialUnion, UnionSurface, union_surface,
};
use medial::geometry::{PowerCrust, TriangulationError};
use medial::metrics::union_betti;
use medial::shape::Shape;
use medial::surface::{Normalisation, SurfaceReport, TriMesh};
use medial::{Vec3, complex, surface};
use medial_reports::significant;
use serde::Serialize;
use serde_json::{Map, Value, json};

use crate::args::{Global, MeshArgument, SubstrateArguments, fraction, larger_tolerance};
use crate::exit::{Exit, Failure};
use crate::files::{COINCIDENT, SURFACES, check_apart, check_extension, check_folder, shape_of};
use crate::output::{StageCosts, counted, print_result};
use crate::progress::StageLine;
use crate::provenance::peak_bytes;
use crate::study::external::{AxisOptions, FitBy, RadiiFrom, percent, read_axis};

/// Arguments of `reconstruct`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Medial mesh (.ma, or .ply with radii) [default for the power crust: all inner poles of the surface].
    axis: Option<PathBuf>,
    /// Write the surface (.ply, .off, .obj) in the units of the medial mesh.
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
    fitting: AxisOptions,
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

/// A reconstructed surface in input units, with its diagnostics.
struct Made {
    mesh: TriMesh,
    diagonal: f64,
    /// As a fraction of the diagonal.
    tolerance: f64,
    /// Betti numbers of the union, where they are known.
    union: Option<[u64; 3]>,
    /// JSON keys of this method only.
    more: Value,
    warnings: Vec<String>,
}

/// Runs the verb.
///
/// # Errors
/// When an input is refused, the power crust has no mesh, the tolerance is too fine, or the output cannot be written.
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
    let line = StageLine::new(global.stages());
    line.at("reading");
    let (shape, spheres, mut warnings) = stages.timed("read", || read(arguments))?;
    line.at("making the surface");
    let (surface, spheres) = (shape.as_ref(), spheres.as_ref());
    let made = match method {
        Method::Union => union_surface_of(arguments, surface, spheres, &mut stages),
        Method::PowerCrust => power_crust_of(arguments, surface, spheres, &mut stages),
    }?;
    warnings.extend(made.warnings);
    stages.timed("write", || surface::write(output, &made.mesh)).map_err(Failure::input)?;
    // Before the check, whose memory is not that of the reconstruction.
    let peak = peak_bytes();

    // Untimed from here.
    line.at("checking the surface");
    let report = examine(output, &made.mesh, &mut warnings)?;
    warnings.extend(made.union.and_then(|union| other_topology(union, &report)));
    let deviation = surface.map(|shape| deviation(shape, &made.mesh)).transpose()?;
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
        "betti": report.expected_betti, "union_betti": made.union,
        "deviation": deviation.map(|[max, mean]| json!({ "max": max, "mean": mean })),
        "seconds": seconds, "cpu_seconds": cpu_seconds, "peak_bytes": peak, "output": output,
    });
    let more: Map<String, Value> = serde_json::from_value(made.more).unwrap_or_default();
    more.into_iter().for_each(|(key, value)| object[key] = value);
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
    let mut warnings = Vec::new();
    let loaded = arguments.mesh.as_ref().map(|mesh| shape_of(mesh, options)).transpose()?;
    let shape = loaded.map(|(input, shape)| {
        warnings.extend(input.report.warnings);
        shape
    });
    let axis = match (&arguments.axis, &shape) {
        (None, _) => None,
        (Some(path), Some(shape)) => Some(read_axis(path, shape, arguments.fitting)?.0),
        (Some(path), None) => Some(without_surface(path, arguments.fitting)?),
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

fn face_centres(mesh: &TriMesh) -> Vec<Vec3> {
    (0..mesh.faces.len()).map(|f| mesh.triangle(f).into_iter().sum::<Vec3>() / 3.0).collect()
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

/// The Betti numbers of the solid that a closed surface bounds.
fn betti_of(report: &SurfaceReport) -> Option<[u64; 3]> {
    Some(report.expected_betti?.map(|b| b as u64))
}

/// A warning for a surface without the Betti numbers of the union.
fn other_topology(union: [u64; 3], report: &SurfaceReport) -> Option<String> {
    // An open surface bounds no solid and has no such numbers.
    let found = betti_of(report)?;
    (found != union).then(|| {
        format!(
            "the surface has other Betti numbers than the union (found {found:?}, expected {union:?}): it \
             lacks narrow crevices, holes or necks; give a smaller --tolerance"
        )
    })
}

/// The largest and the mean distance of a surface's vertices and face centres from the mesh of a
/// shape, as fractions of its diagonal.
fn deviation(shape: &Shape, mesh: &TriMesh) -> Result<[f64; 2], Failure> {
    let to_normal = shape.normalisation();
    let points = mesh.vertices.iter().copied().chain(face_centres(mesh));
    let points: Vec<_> = points.map(|p| to_normal.forward(p)).collect();
    let distances = shape.surface_tree().map_err(Failure::input)?.distance_batch(&points);
    let max = distances.iter().copied().fold(0.0, f64::max);
    Ok([max, distances.iter().sum::<f64>() / distances.len() as f64])
}

/// The power crust of the spheres of the medial mesh, or of all inner poles, and of the outer poles.
fn power_crust_of(
    arguments: &Arguments,
    shape: Option<&Shape>,
    axis: Option<&MedialMesh>,
    stages: &mut StageCosts,
) -> Result<Made, Failure> {
    let (shape, mesh) = shape.zip(arguments.mesh.as_ref()).expect("checked before reading");
    let balls = stages.timed("poles", || shape.polar_balls());
    let balls = balls.map_err(|error| Failure::at(mesh, error))?;
    let to_normal = shape.normalisation();
    let inner = match axis {
        Some(axis) => axis.to_normal(to_normal).spheres,
        None => balls.inner,
    };
    let named = arguments.axis.as_ref().unwrap_or(mesh);
    let crust = stages.timed("reconstruct", || {
        let crust = PowerCrust::new(&inner, &balls.outer)?;
        Ok((crust.facet_count(), surface::crust_surface(&crust, COINCIDENT)))
    });
    let (facets, mut crust) =
        crust.map_err(|error: TriangulationError| Failure::at(named, error))?;
    // A medial mesh in other units lies outside of all cells.
    if crust.mesh.faces.is_empty() {
        return Err(Failure::at(
            named,
            "no inner ball has a power cell; check surface and units of the medial mesh",
        ));
    }
    crust.mesh.vertices.iter_mut().for_each(|vertex| *vertex = to_normal.backward(*vertex));
    let more = json!({
        "inner": inner.len(), "outer": balls.outer.len(), "rejected": balls.rejected,
        "facets": facets, "merged": crust.contracted, "samples": shape.samples().len(),
        "sampling": shape.options().sampling.to_string(), "seed": arguments.substrate.seed,
    });
    let (diagonal, tolerance) = (to_normal.diagonal, COINCIDENT);
    Ok(Made { mesh: crust.mesh, diagonal, tolerance, union: None, more, warnings: vec![] })
}

/// Spacing of the balls that replace the union for its topology, in tolerances.
const BALL_SPACING: f64 = 0.5;

/// The first tolerances without `--tolerance`.
const COARSE: [f64; 2] = [0.04, 0.02];

/// The last tolerance without `--tolerance`.
const FINE: f64 = 0.01;

/// Without `--tolerance`, all faces are within this distance of the union, in diagonals.
const FACES_WITHIN: f64 = 0.005;

/// The boundary of the union of spheres, cones and slabs.
fn union_surface_of(
    arguments: &Arguments,
    shape: Option<&Shape>,
    axis: Option<&MedialMesh>,
    stages: &mut StageCosts,
) -> Result<Made, Failure> {
    let (axis, path) = axis.zip(arguments.axis.as_ref()).expect("checked before reading");
    let union = MedialUnion::new(axis).map_err(|error| Failure::at(path, error))?;
    let (lo, hi) = union.bounding_box();
    let corners = TriMesh { vertices: vec![lo, hi], faces: vec![] };
    let diagonal = shape.map(|s| s.normalisation().diagonal);
    // Without a surface the box of the union gives the unit of the tolerance.
    let diagonal = diagonal
        .or_else(|| Normalisation::of(&corners).map(|n| n.diagonal))
        .ok_or_else(|| Failure::at(path, "the extent of the spheres is zero or not finite"))?;
    let made = stages
        .timed("reconstruct", || fitting_surface(axis, &union, diagonal, arguments.tolerance));
    let Fitting { made, tolerance, off, betti } =
        made.map_err(|error| Failure::at(path, contour_error(error, diagonal)))?;
    let mut warnings = Vec::new();
    if made.lost > 0 {
        warnings.push(format!(
            "{} with a radius below {:.1e} of the diagonal: thin parts of the union may be missing; give a \
             smaller --tolerance",
            counted(made.lost as u64, "sphere"),
            made.smallest / diagonal
        ));
    }
    let more = json!({
        "tetrahedra": made.tetrahedra, "lost": made.lost, "faces_to_union": off,
    });
    Ok(Made { mesh: made.mesh, diagonal, tolerance, union: betti, more, warnings })
}

/// A surface of a union at the tolerance that was taken.
pub struct Fitting {
    /// The surface.
    pub made: UnionSurface,
    /// The tolerance, in diagonals.
    pub tolerance: f64,
    /// Largest distance of a face's centre from the union, in diagonals.
    pub off: f64,
    /// Betti numbers of the union; `None` for too many balls.
    pub betti: Option<[u64; 3]>,
}

/// The surface of a union at a tolerance in diagonals, or at the coarsest with the right topology.
///
/// # Errors
/// When the tolerance is too fine or too coarse for this union, with a feasible one.
pub fn fitting_surface(
    axis: &MedialMesh,
    union: &MedialUnion,
    diagonal: f64,
    tolerance: Option<f64>,
) -> Result<Fitting, ContourError> {
    let finest = tolerance.unwrap_or(FINE);
    // Fails for too many balls.
    let betti = union_betti(axis, BALL_SPACING * finest * diagonal).ok();
    let at = |tolerance: f64| -> Result<Fitting, ContourError> {
        let made = union_surface(axis, tolerance * diagonal)?;
        let off = union.signed_batch(&face_centres(&made.mesh)).into_iter().map(f64::abs);
        let off = off.fold(0.0, f64::max) / diagonal;
        Ok(Fitting { made, tolerance, off, betti })
    };
    let shows_all = |fitting: &Fitting| {
        let found = surface::validate(&fitting.made.mesh).ok().and_then(|report| betti_of(&report));
        fitting.off <= FACES_WITHIN && found.is_some() && found == betti
    };
    let coarse = if tolerance.is_none() { &COARSE[..] } else { &[] };
    // Coarse first: each halving costs eight times the cells.
    for &tolerance in coarse {
        match at(tolerance) {
            Ok(fitting) if shows_all(&fitting) => return Ok(fitting),
            Ok(_) | Err(ContourError::TooThin { .. }) => {}
            Err(other) => return Err(other),
        }
    }
    at(finest)
}

fn contour_error(error: ContourError, diagonal: f64) -> String {
    match error {
        ContourError::TooFine { tolerance, most, feasible } => {
            let (tolerance, feasible) = (tolerance / diagonal, feasible / diagonal);
            format!(
                "--tolerance {} is too fine (more than {most} tetrahedra); give --tolerance {:.1e}",
                significant(tolerance, 4),
                larger_tolerance(tolerance, feasible, FINE)
            )
        }
        ContourError::TooThin { feasible, .. } => format!(
            "every sphere is too thin for this tolerance; give --tolerance {:.1e} for the largest",
            feasible / diagonal
        ),
        other => other.to_string(),
    }
}
