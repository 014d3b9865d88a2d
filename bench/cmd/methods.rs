//! `medial methods [ID]`: lists the methods, or describes one.

use clap::Args;
use serde_json::json;

use crate::args::Global;
use crate::exit::{Exit, Failure};
use crate::output::{print_json, print_line};
use crate::study::no_such_method;
use crate::study::registry::{Entry, Registry};

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
pub fn run(arguments: &Arguments, global: &Global, registry: &Registry) -> Result<Exit, Failure> {
    let wanted = |entry: &&Entry| arguments.id.as_ref().is_none_or(|id| entry.id() == *id);
    let entries: Vec<&Entry> = registry.entries().iter().filter(wanted).collect();
    if let (Some(id), true) = (&arguments.id, entries.is_empty()) {
        return Err(unknown_method(registry, id));
    }
    if global.json {
        print_json(&json!({ "methods": entries }), &[]);
    } else if arguments.id.is_some() {
        entries.into_iter().for_each(describe);
    } else {
        let width = entries.iter().map(|entry| entry.id().len()).max().unwrap_or_default();
        for entry in entries {
            let note = if entry.presentation().on_request { " (runs only when named)" } else { "" };
            let info = entry.method().info();
            print_line(&format!("{:<width$} {}{note}", info.id, info.title));
            print_line(&format!("{:<width$} {}", "", info.summary));
        }
    }
    Ok(Exit::Done)
}

/// The method with an id.
///
/// # Errors
/// When no method has it; those that exist are named.
pub fn method<'r>(registry: &'r Registry, id: &str) -> Result<&'r Entry, Failure> {
    registry.entry(id).ok_or_else(|| unknown_method(registry, id))
}

/// The failure for an id that no method has, naming those that exist.
fn unknown_method(registry: &Registry, id: &str) -> Failure {
    let known: Vec<String> = registry.entries().iter().map(|e| e.id().to_owned()).collect();
    Failure::usage(no_such_method(id, &known))
}

fn describe(entry: &Entry) {
    let (info, best_for) = (entry.method().info(), &entry.presentation().best_for);
    print_line(&format!("{}: {}", info.id, info.title));
    print_line(&format!("  {}", info.summary));
    if !best_for.is_empty() {
        print_line(&format!("  best for: {best_for}"));
    }
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
