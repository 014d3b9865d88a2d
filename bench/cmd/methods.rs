//! `medial methods [ID]`: lists the methods, or describes one.

use clap::Args;
use serde_json::json;

use crate::args::{Global, method};
use crate::exit::{Exit, Failure};
use crate::output::{print_json, print_line};
use crate::study::registry::{Entry, Registry};

#[derive(Debug, Args)]
pub struct Arguments {
    /// Describe this method.
    id: Option<String>,
}

/// Runs the verb. Fails when no method has the id.
pub fn run(arguments: &Arguments, global: &Global, registry: &Registry) -> Result<Exit, Failure> {
    let entries: Vec<&Entry> = match &arguments.id {
        Some(id) => vec![method(registry, id)?],
        None => registry.entries.iter().collect(),
    };
    if global.json {
        print_json(&json!({ "methods": entries }), &[]);
    } else if arguments.id.is_some() {
        entries.into_iter().for_each(describe);
    } else {
        let width = entries.iter().map(|entry| entry.id().len()).max().unwrap_or_default();
        for entry in entries {
            let note = if entry.presentation.on_request { " (runs only when named)" } else { "" };
            let info = entry.method().info();
            print_line(&format!("{:<width$} {}{note}", info.id, info.title));
            print_line(&format!("{:<width$} {}", "", info.summary));
        }
    }
    Ok(Exit::Done)
}

fn describe(entry: &Entry) {
    let (info, best_for) = (entry.method().info(), &entry.presentation.best_for);
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
