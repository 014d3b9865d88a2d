//! Standard output and standard error of the verbs: nothing in a name reaches a terminal as a
//! command, and nothing that could not be written passes for success.

use std::io::{self, IsTerminal, Write};
use std::sync::OnceLock;

use medial::shape::Cost;
use medial_reports::without_markup;
use medial_run::text::printable;
use serde::Serialize;
use serde_json::{Map, Value, json};

use crate::args::Global;
use crate::exit::{Exit, Failure};

/// Why standard output could not be written, the first time.
// Verbs print from many places, all of which would have to hand this up otherwise; `main` looks once, at the end.
static UNWRITTEN: OnceLock<io::Error> = OnceLock::new();

/// The exit code of a verb that ended with `exit`: an output that could not be written is a failure.
pub fn exit_after_output(exit: Exit) -> Exit {
    let Some(error) = UNWRITTEN.get() else { return exit };
    print_error(&format!("medial: standard output: {error}"));
    if exit == Exit::Done { Exit::Input } else { exit }
}

/// Version of the program.
pub fn version() -> &'static str {
    env!("CARGO_PKG_VERSION")
}

/// Prints text on standard output as it is. A closed pipe is not an error: its reader has finished.
pub fn print_raw(text: &str) {
    let mut out = io::stdout().lock();
    // Flushed at once: buffered text would be lost without an error when the process exits.
    if let Err(error) = out.write_all(text.as_bytes()).and_then(|()| out.flush())
        && error.kind() != io::ErrorKind::BrokenPipe
    {
        let _ = UNWRITTEN.set(error);
    }
}

/// Prints a line on standard output, or several.
pub fn print_line(line: &str) {
    print_raw(&(printable_lines(line) + "\n"));
}

/// Prints Markdown on standard output, on a terminal without escapes.
pub fn print_markdown(text: &str) {
    match io::stdout().is_terminal() {
        true => print_raw(&printable_lines(&without_markup(text))),
        false => print_raw(text),
    }
}

/// Prints a line on standard error, and ignores failures.
pub fn print_error(line: &str) {
    let _ = writeln!(io::stderr(), "{}", printable_lines(line));
}

/// Prints a line on standard error unless `--quiet`.
pub fn note(global: &Global, line: &str) {
    if !global.quiet {
        print_error(line);
    }
}

/// Prints a failure on standard error, and with `--json` as an object on standard output.
pub fn print_failure(failure: &Failure, global: &Global) {
    // One line, whatever a name in it contains.
    print_error(&printable(&format!("medial: {}", failure.message)));
    if global.json {
        let object = json!({ "error": failure.message, "warnings": [], "version": version() });
        print_raw(&format!("{object}\n"));
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
    // A verb and its library can have the same remark on a surface.
    for warning in warnings {
        if !all.iter().any(|known| known == warning) {
            all.push(Value::from(warning.as_str()));
        }
    }
    object.insert("warnings".to_owned(), Value::Array(all));
    object.insert("version".to_owned(), version().into());
    print_raw(&format!("{}\n", Value::Object(object)));
}

/// Prints the result of a verb: the object with `--json`, else the text and the warnings.
pub fn print_result(
    global: &Global,
    object: &impl Serialize,
    text: &str,
    warnings: &[String],
) -> Exit {
    if global.json {
        print_json(object, warnings);
    } else {
        print_line(text);
        warnings.iter().for_each(|warning| print_line(&format!("  warning: {warning}")));
    }
    Exit::Done
}

/// Lines without control characters.
fn printable_lines(text: &str) -> String {
    // Line breaks are ours, all other control characters come from names.
    text.split('\n').map(printable).collect::<Vec<_>>().join("\n")
}

/// A number with its noun, such as `1 sphere` or `3 faces`.
pub fn counted(number: u64, noun: &str) -> String {
    match (number, noun) {
        (1, _) => format!("1 {noun}"),
        (_, "vertex") => format!("{number} vertices"),
        (_, "mesh") => format!("{number} meshes"),
        _ => format!("{number} {noun}s"),
    }
}

/// The costs of the stages of a verb, in their order.
#[derive(Default)]
pub struct StageCosts(Vec<(&'static str, Cost)>);

impl StageCosts {
    /// Does the work of a stage and adds its cost.
    pub fn timed<T>(&mut self, stage: &'static str, work: impl FnOnce() -> T) -> T {
        let (done, cost) = Cost::of(work);
        self.add(stage, cost);
        done
    }

    /// Adds a cost to that of a stage.
    pub fn add(&mut self, stage: &'static str, cost: Cost) {
        match self.0.iter_mut().find(|(known, _)| *known == stage) {
            Some((_, sum)) => *sum += cost,
            None => self.0.push((stage, cost)),
        }
    }

    /// Wall-clock seconds and processor seconds by stage, and of all as `total`.
    pub fn seconds(&self) -> [Map<String, Value>; 2] {
        [|cost: &Cost| cost.seconds, |cost: &Cost| cost.cpu_seconds].map(|part| {
            // A fold from +0, because an empty sum is -0 and prints as such.
            let total = self.0.iter().fold(0.0, |sum, (_, cost)| sum + part(cost));
            let stages = self.0.iter().map(|(stage, cost)| (*stage, part(cost)));
            stages.chain([("total", total)]).map(|(k, v)| (k.to_owned(), v.into())).collect()
        })
    }

    /// Wall-clock seconds of all stages.
    pub fn total(&self) -> f64 {
        self.0.iter().map(|(_, cost)| cost.seconds).sum()
    }
}
