//! `medial axis MESH -o x.ma`: the initial Voronoi medial mesh.

use std::collections::BTreeMap;
use std::path::PathBuf;

use clap::Args;
use medial::complex;
use medial::metrics;
use medial::shape::Cost;
use serde_json::json;

use crate::args::{Global, MeshArgument, SubstrateArguments, shape_options};
use crate::exit::{Exit, Failure};
use crate::files::check_output;
use crate::output::{counted, print_json, print_line};
use crate::progress::StageLine;
use crate::provenance::peak_bytes;
use crate::study::source::{Input, Source};

/// Arguments of `axis`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Surface file (OFF, OBJ, PLY, STL), `builtin:ID[:RESOLUTION]` or `dataset:NAME`.
    mesh: MeshArgument,
    /// The medial mesh (.ma, .ply, .obj, .vtp, .glb), in the units of the surface.
    #[arg(short, long)]
    output: Option<PathBuf>,
    #[command(flatten)]
    substrate: SubstrateArguments,
}

/// Runs the verb.
///
/// # Errors
/// When the surface is refused, cannot be triangulated, or the output cannot be written.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Exit, Failure> {
    let source = Source::parse(&arguments.mesh).map_err(Failure::usage)?;
    let options = shape_options(&arguments.substrate)?;
    check_output(arguments.output.as_deref())?;
    let line = StageLine::new(global.stages());
    line.at("reading");
    let (input, read) = Cost::of(|| Input::load(&source));
    let input = input?;
    let shape = input.shape(options).map_err(|error| Failure::of(&source, error))?;
    line.at("computing the medial mesh");
    let mesh = shape.voronoi().map_err(|error| Failure::of(&source, error))?;
    line.at("counting components, loops and voids");
    let (betti, _) = Cost::of(|| complex::betti(&mesh));
    if let Some(output) = &arguments.output {
        let back = shape.normalisation();
        let mesh = mesh.transformed(back.diagonal, |p| back.backward(p));
        complex::write(output, &mesh).map_err(Failure::input)?;
    }
    drop(line);
    let counts = metrics::counts(&mesh);
    let mut stages = BTreeMap::from([("read", read)]);
    let mut total = read;
    for (substrate, cost) in shape.used() {
        let stage = match substrate.name() {
            "facets" | "medial_mesh" => "extract",
            "inside_test" => "inside",
            name => name,
        };
        *stages.entry(stage).or_default() += cost;
        total += cost;
    }
    stages.insert("total", total);
    let by_stage = |part: fn(&Cost) -> f64| -> serde_json::Map<String, serde_json::Value> {
        stages.iter().map(|(&stage, cost)| (stage.to_owned(), part(cost).into())).collect()
    };
    let [seconds, cpu_seconds] = [by_stage(|c| c.seconds), by_stage(|c| c.cpu_seconds)];
    let expected = shape.expected_betti();
    let mut warnings = shape.report().warnings.clone();
    warnings.extend(shape.sampling_warning().map(str::to_owned));
    if let Some(expected) = expected.filter(|&expected| expected != betti) {
        warnings.push(format!(
            "the medial mesh has Betti numbers {betti:?}, the solid {expected:?}: the samples are too \
             coarse somewhere, or parts touch; try --sampling auto, or blue:{}",
            (4 * shape.samples().len()).min(1_000_000)
        ));
    }
    if global.json {
        let object = json!({
            "spheres": counts.spheres, "edges": counts.edges, "faces": counts.faces,
            "isolated": counts.isolated, "euler": complex::euler(&mesh), "betti": betti,
            "expected_betti": expected, "samples": shape.samples().len(),
            "sampling": shape.options().sampling.to_string(), "seed": arguments.substrate.seed,
            "in_guard_band": shape.cells().map_or(0, |cells| cells.in_guard_band),
            "seconds": seconds, "cpu_seconds": cpu_seconds, "peak_bytes": peak_bytes(),
            "output": arguments.output,
        });
        print_json(&object, &warnings);
        return Ok(Exit::Done);
    }
    print_line(&format!(
        "{}: {}, {}, {} from {} samples in {:.2} s",
        input.name,
        counted(counts.spheres, "sphere"),
        counted(counts.edges, "edge"),
        counted(counts.faces, "face"),
        shape.samples().len(),
        total.seconds
    ));
    let demanded =
        expected.map_or_else(String::new, |expected| format!(", the solid's {expected:?}"));
    print_line(&format!("  Betti numbers {betti:?}{demanded}"));
    for warning in warnings {
        print_line(&format!("  warning: {warning}"));
    }
    if let Some(output) = &arguments.output {
        print_line(&format!("  written: {}", output.display()));
    }
    Ok(Exit::Done)
}
