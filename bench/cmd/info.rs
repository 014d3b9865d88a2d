//! `medial info MESH`: counts, defects and topology of a mesh, even of a refused one.

use clap::Args;
use medial::surface::{self, Loaded, SurfaceReport};
use medial_run::input::{Input, Source};
use medial_run::text::{counted, significant};

use crate::args::{Global, MeshArgument};
use crate::exit::{Exit, Failure};
use crate::output::{note, print_json, print_line};

#[derive(Debug, Args)]
pub struct Arguments {
    /// Surface file (OFF, OBJ, PLY, STL), `builtin:ID[:RESOLUTION]` or `dataset:NAME`.
    mesh: MeshArgument,
}

/// Runs the verb. A refused mesh is described as far as possible, with exit code 1. Fails when the file cannot be read.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Exit, Failure> {
    let source = Source::parse(&arguments.mesh)?;
    let (report, refusal, solid) = match source.path() {
        Some(path) => {
            // Unlike a reader it continues at a defect: a defective mesh is the usual reason for this verb.
            let inspection = surface::inspect(path).map_err(Failure::input)?;
            match inspection.resolved.map(|solid| *solid) {
                Some(Loaded { report: solid, .. }) => (inspection.report, None, Some(solid)),
                None => (inspection.report, inspection.refused, None),
            }
        }
        None => (Input::load(&source)?.report, None, None),
    };
    if global.json {
        let mut object = serde_json::to_value(&report).map_err(Failure::input)?;
        let reason = refusal.as_ref().map(ToString::to_string);
        object["usable"] = reason.is_none().into();
        object["reason"] = reason.into();
        object["solid"] = serde_json::to_value(&solid).map_err(Failure::input)?;
        print_json(&object, &report.warnings);
    } else {
        print_line(&source.to_string());
        print_report(&report);
        if let Some(solid) = &solid {
            print_line("the solid that all other verbs use");
            print_report(solid);
        }
    }
    match refusal {
        None => Ok(Exit::Done),
        Some(error) if global.json => {
            note(global, &format!("medial: {error}"));
            Ok(Exit::Input)
        }
        Some(error) => Err(Failure::input(error)),
    }
}

fn print_report(report: &SurfaceReport) {
    let yes = |flag: bool| if flag { "yes" } else { "no" };
    let intersecting = match report.intersecting_pairs {
        0 => "none".to_owned(),
        pairs if report.intersecting_pairs_complete => {
            counted(pairs, "pair of faces", "pairs of faces")
        }
        pairs => format!("more than {pairs} pairs of faces"),
    };
    let genus = report.genus.map_or_else(|| "undefined".to_owned(), |genus| genus.to_string());
    let extents = report.extents.map(|side| significant(side, 4)).join(" x ");
    let measured = |value: Option<f64>| {
        value.map_or_else(|| "undefined".to_owned(), |value| significant(value, 4))
    };
    let lines = [
        ("vertices", report.vertices.to_string()),
        ("faces", report.faces.to_string()),
        ("components", report.components.to_string()),
        ("genus", genus),
        ("closed", yes(report.closed).to_owned()),
        ("manifold", yes(report.manifold).to_owned()),
        ("oriented", yes(report.oriented).to_owned()),
        ("self-intersections", intersecting),
        ("zero-area faces", report.degenerate_faces.to_string()),
        ("extents", extents),
        ("diagonal", significant(report.diagonal, 4)),
        ("area", measured(report.area)),
        ("volume", measured(report.volume)),
    ];
    for (label, value) in lines {
        print_line(&format!("  {label:<20} {value}"));
    }
    for repair in &report.repairs {
        print_line(&format!("  repaired: {repair}"));
    }
    for warning in &report.warnings {
        print_line(&format!("  warning: {warning}"));
    }
}
