//! What a verb prints: one JSON object, or lines for people.

use std::io::{self, Write};

use serde::Serialize;
use serde_json::{Map, Value, json};

use crate::args::Global;
use crate::exit::Failure;

/// Prints a failure on standard error, and with `--json` as an object on standard output.
pub fn print_failure(failure: &Failure, global: &Global) {
    let _ = writeln!(io::stderr(), "medial: {}", failure.message);
    if global.json {
        let object = json!({ "error": failure.message, "warnings": [], "version": version() });
        print_line(&object.to_string());
    }
}

/// Version of the program.
pub fn version() -> &'static str {
    env!("CARGO_PKG_VERSION")
}

/// Prints a line on standard output. A closed pipe is nobody's error.
pub fn print_line(line: &str) {
    let _ = writeln!(io::stdout(), "{line}");
}

/// Prints a line on standard error, also with `--quiet`.
pub fn say(line: &str) {
    let _ = writeln!(io::stderr(), "{line}");
}

/// Prints a line on standard error unless `--quiet`.
pub fn note(global: &Global, line: &str) {
    if !global.quiet {
        let _ = writeln!(io::stderr(), "{line}");
    }
}

/// Prints an object on standard output as JSON, with `version` and `warnings`.
pub fn print_json(object: &impl Serialize, warnings: &[String]) {
    let mut object = match serde_json::to_value(object) {
        Ok(Value::Object(map)) => map,
        Ok(other) => Map::from_iter([("result".to_owned(), other)]),
        Err(error) => Map::from_iter([("error".to_owned(), error.to_string().into())]),
    };
    let known = object.remove("warnings");
    let mut all = match known {
        Some(Value::Array(list)) => list,
        _ => Vec::new(),
    };
    for warning in warnings {
        if !all.iter().any(|known| known == warning) {
            all.push(Value::from(warning.as_str()));
        }
    }
    object.insert("warnings".to_owned(), Value::Array(all));
    object.insert("version".to_owned(), version().into());
    print_line(&Value::Object(object).to_string());
}

/// A number with its noun, such as `1 sphere` or `3 faces`.
pub fn counted(number: u64, noun: &str) -> String {
    format!("{number} {noun}{}", if number == 1 { "" } else { "s" })
}

/// A fraction of the diagonal as a percentage with three decimals.
pub fn percent(fraction: f64) -> String {
    format!("{:.3} %", 100.0 * fraction)
}
