//! `medial axis MESH -o x.ma`: the initial Voronoi medial mesh.

use std::path::PathBuf;

use clap::Args;
use medial::surface::Sampling;
use medial::{complex, metrics};
use serde_json::json;

use crate::args::{Global, MeshArgument, SubstrateArguments};
use crate::exit::{Exit, Failure};
use crate::files::{check_apart, check_output, left_out, shape_of};
use crate::output::{StageCosts, counted, print_result};
use crate::provenance::peak_bytes;

#[derive(Debug, Args)]
pub struct Arguments {
    /// Surface file (OFF, OBJ, PLY, STL), `builtin:ID[:RESOLUTION]` or `dataset:NAME`.
    mesh: MeshArgument,
    /// Write the medial mesh (.ma, .ply, .obj, .vtp, .glb) in the units of the surface.
    #[arg(short, long)]
    output: Option<PathBuf>,
    #[command(flatten)]
    substrate: SubstrateArguments,
}

/// Runs the verb. Fails when the surface is refused, cannot be triangulated, or the output cannot be written.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Exit, Failure> {
    let options = arguments.substrate.shape_options()?;
    check_output(arguments.output.as_deref())?;
    check_apart(arguments.output.as_deref(), [&*arguments.mesh])?;
    let line = global.stages();
    line.at("reading");
    let mut stages = StageCosts::default();
    let (input, shape) =
        stages.timed("read", || shape_of(&arguments.mesh, options, arguments.substrate.as_is))?;
    line.at("computing the medial mesh");
    let mesh = shape.initial().map_err(|error| Failure::at(&arguments.mesh, error))?;
    line.at("counting components, loops and voids");
    let betti = complex::betti(&mesh);
    let mut lost = None;
    if let Some(output) = &arguments.output {
        let back = shape.normalisation();
        let mesh = mesh.to_input(back);
        complex::write(output, &mesh).map_err(Failure::input)?;
        lost = left_out(output, &mesh);
    }
    // The line must be gone before the result is printed next to it.
    drop(line);
    let counts = metrics::counts(&mesh);
    for (substrate, cost) in shape.used() {
        // The keys of the JSON are a contract: two substrates make up the extraction.
        let stage = match substrate.name() {
            "facets" | "medial_mesh" => "extract",
            "inside_test" => "inside",
            name => name,
        };
        stages.add(stage, cost);
    }
    let [seconds, cpu_seconds] = stages.seconds();
    let expected = shape.expected_betti();
    let mut warnings = shape.remarks();
    warnings.extend(lost);
    if let Some(expected) = expected.filter(|&expected| expected != betti) {
        let advice = match shape.options().sampling {
            Sampling::Conforming { .. } => "",
            _ => "; try --sampling conforming",
        };
        warnings.push(format!(
            "the medial mesh has Betti numbers {betti:?}, the solid {expected:?}{advice}"
        ));
    }
    let object = json!({
        "spheres": counts.spheres, "edges": counts.edges, "faces": counts.faces,
        "isolated": counts.isolated, "euler": complex::euler(&mesh), "betti": betti,
        "expected_betti": expected, "samples": shape.samples().len(),
        "sampling": shape.options().sampling.to_string(), "seed": arguments.substrate.seed,
        "in_guard_band": shape.cells().map_or(0, |cells| cells.in_guard_band),
        "seconds": seconds, "cpu_seconds": cpu_seconds, "peak_bytes": peak_bytes(),
        "output": arguments.output,
    });
    let demanded =
        expected.map_or_else(String::new, |expected| format!(", the solid's {expected:?}"));
    let written = arguments.output.as_ref();
    let written = written.map_or_else(String::new, |o| format!("\n  written: {}", o.display()));
    let text = format!(
        "{}: {}, {}, {} from {} samples in {:.2} s\n  Betti numbers {betti:?}{demanded}{written}",
        input.name,
        counted(counts.spheres, "sphere"),
        counted(counts.edges, "edge"),
        counted(counts.faces, "face"),
        shape.samples().len(),
        stages.total()
    );
    Ok(print_result(global, &object, &text, &warnings))
}
