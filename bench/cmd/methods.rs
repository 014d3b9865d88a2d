//! `medial methods [ID]`: what methods there are.

use clap::Args;
use medial::simplifier::MethodInfo;
use serde_json::json;

use super::{Exit, Failure, print_json, print_line};
use crate::cli::Global;
use crate::run::did_you_mean;

/// Arguments of `methods`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Describe this method alone.
    id: Option<String>,
}

/// Runs the verb.
///
/// # Errors
/// When no method has the id.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Exit, Failure> {
    let all = medial_methods::registry();
    let wanted = |info: &MethodInfo| arguments.id.as_ref().is_none_or(|id| info.id == id);
    let infos: Vec<&MethodInfo> = all.iter().map(|m| m.info()).filter(|i| wanted(i)).collect();
    if let (Some(id), true) = (&arguments.id, infos.is_empty()) {
        return Err(unknown_method(id));
    }
    if global.json {
        print_json(&json!({ "methods": infos }), &[]);
    } else if arguments.id.is_some() {
        infos.into_iter().for_each(describe);
    } else {
        for info in infos {
            print_line(&format!("{:<12} {}", info.id, info.title));
            print_line(&format!("{:<12} {}", "", info.summary));
        }
    }
    Ok(Exit::Done)
}

/// The failure for an id that no method has, naming those that exist.
pub fn unknown_method(id: &str) -> Failure {
    let known: Vec<&str> = medial_methods::registry().iter().map(|m| m.info().id).collect();
    let meant = did_you_mean(id, known.iter().copied());
    Failure::usage(format!("no method is called `{id}`{meant}; there are: {}", known.join(", ")))
}

fn describe(info: &MethodInfo) {
    print_line(&format!("{}: {}", info.id, info.title));
    print_line(&format!("  {}", info.summary));
    print_line(&format!("  source: {}", info.citation));
    match &info.native {
        Some(native) => {
            let effect = if native.larger_is_coarser { "fewer" } else { "more" };
            print_line(&format!(
                "  level: {} in {}; a larger value leaves {effect} spheres",
                native.name, native.unit
            ));
        }
        None => print_line("  level: number of spheres only"),
    }
    print_line(&format!("  published level: {}", info.published));
    for param in &info.params {
        print_line(&format!(
            "  --set {}={}   ({}) {}",
            param.name, param.default, param.unit, param.help
        ));
    }
}
