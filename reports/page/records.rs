//! All records for the page: one column for each number, so that the browser parses one document without keys.

use std::collections::BTreeMap;

use medial_run::level::Target;
use medial_run::record::Record;
use medial_run::text::{command_line, significant};
use serde_json::{Value, json};

use crate::comparison::{Comparison, Entry, level_label, reached};
use crate::tables::{Best, flatten, remark, topology_word, warnings};

/// A larger table would exhaust a browser's memory.
pub(super) const MOST: usize = 20_000;

/// The columns of all entries by path, null where a record has no value. Below `table` are those of the table of
/// results, below the names of a record's parts its values as recorded.
/// A site has no medial meshes that rows could link.
pub(super) fn all_columns(
    comparison: &Comparison<'_>,
    is_site: bool,
) -> BTreeMap<String, Vec<Value>> {
    let mut best: Option<(usize, Best)> = None;
    let mut columns: BTreeMap<String, Vec<Value>> = BTreeMap::new();
    for (index, entry) in comparison.entries.iter().enumerate() {
        // Entries are sorted by mesh.
        let best = match &mut best {
            Some((mesh, best)) if *mesh == entry.mesh => best,
            slot => &mut slot.insert((entry.mesh, Best::of_mesh(comparison, entry.mesh))).1,
        };
        let mut row = row(comparison, entry, best);
        row.retain(|(path, _)| !is_site || path != "table/link");
        for (path, value) in row {
            let empty = || vec![Value::Null; comparison.entries.len()];
            columns.entry(path).or_insert_with(empty)[index] = value;
        }
    }
    columns
}

fn row(comparison: &Comparison<'_>, entry: &Entry<'_>, best: &Best) -> Vec<(String, Value)> {
    let record = entry.record;
    let mut row = flatten(record);
    // The seconds of a single repetition are those of the record.
    if record.repetitions.len() < 2 {
        row.retain(|(path, _)| path != "item/repetitions");
    }
    let count = match record.simplify.level {
        Target::Spheres(count) => Some(count),
        _ => None,
    };
    let mut bits = 0_u32;
    for (bit, metric) in comparison.columns().into_iter().enumerate() {
        let Some(value) = metric.of(record) else { continue };
        let rounded: f64 = significant(value, 5).parse().unwrap_or(value);
        row.push((format!("table/{}", metric.key), json!(rounded)));
        bits |= u32::from(best.is_best(entry, metric, value)) << bit;
    }
    let warnings = warnings(record);
    let cells = [
        ("mesh", json!(entry.mesh)),
        ("series", json!(entry.series)),
        ("best", json!(bits)),
        ("asked", json!(level_label(record.simplify.level))),
        ("count", json!(count)),
        ("status", json!(record.status.to_string())),
        ("spheres", json!(reached(record))),
        ("topology", json!(topology_word(entry))),
        ("rising", json!(comparison.better_with_fewer(entry).map(|_| 1))),
        ("remark", json!(remark(entry))),
        ("link", json!(record.artifact.as_deref().and_then(local_link))),
        ("warnings", if warnings.is_empty() { Value::Null } else { json!(warnings) }),
        ("repeat", json!(repeat_command(record))),
    ];
    row.extend(cells.map(|(name, value)| (format!("table/{name}"), value)));
    row
}

/// A link to a file in the folder of the page, percent-encoded. `None` for a path that leaves that folder, such as
/// `../`, or is another address, such as `javascript:`.
pub(super) fn local_link(path: &str) -> Option<String> {
    let inside = !path.is_empty()
        && !path.starts_with('/')
        && !path.contains('\\')
        && path.split('/').all(|part| !part.is_empty() && part != ".." && part != ".");
    if !inside {
        return None; // never link outside the folder
    }
    let mut link = String::from("./");
    for byte in path.bytes() {
        if byte.is_ascii_alphanumeric() || b"-_./~".contains(&byte) {
            link.push(char::from(byte));
        } else {
            link.push_str(&format!("%{byte:02X}"));
        }
    }
    Some(link)
}

/// The command that repeats the run of a record.
fn repeat_command(record: &Record) -> String {
    let simplify = &record.simplify;
    let mut words: Vec<String> = ["medial", "simplify"].map(str::to_owned).into();
    words.push(mesh_argument(record));
    words.extend(["-m".to_owned(), simplify.method.clone()]); // params belong to it
    for (key, value) in &simplify.params.0 {
        let value = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        words.extend(["--set".to_owned(), format!("{key}={value}")]);
    }
    match simplify.level {
        Target::Published => {}
        Target::Spheres(count) => words.extend(["--spheres".to_owned(), count.to_string()]),
        Target::Native(value) => words.extend(["--level".to_owned(), value.to_string()]),
        Target::MaxError(value) => words.extend(["--max-error".to_owned(), value.to_string()]),
    }
    if let Some(conditions) = &record.conditions {
        let defaults =
            [("--sampling", &conditions.sampling, "vertices"), ("--dual", &conditions.dual, "fan")];
        for (option, value, default) in defaults {
            if !value.is_empty() && value != default {
                words.extend([option.to_owned(), value.clone()]);
            }
        }
    }
    if simplify.seed != 0 {
        words.extend(["--seed".to_owned(), simplify.seed.to_string()]);
    }
    command_line(&words)
}

/// The sets whose meshes `dataset:NAME` names.
const LIBRARY: [&str; 5] = ["public", "defective", "small", "papers", "added"];

/// The mesh as the command line of the run names it, or else its name.
fn mesh_argument(record: &Record) -> String {
    let mut words = record.command.split_whitespace();
    let named = words.find(|word| mesh_name(word).is_some_and(|name| name == record.mesh));
    match (named, record.dataset.as_deref()) {
        (Some(word), _) => word.to_owned(),
        (None, Some("builtin")) => format!("builtin:{}", record.mesh),
        (None, Some(set)) if LIBRARY.contains(&set) => format!("dataset:{}", record.mesh),
        // A foreign set: its meshes have no name here.
        _ => record.mesh.clone(),
    }
}

/// The name of the mesh of a command-line word.
fn mesh_name(word: &str) -> Option<String> {
    if let Some(spec) = word.strip_prefix("builtin:") {
        return Some(spec.replacen(':', "-", 1));
    }
    if let Some(name) = word.strip_prefix("dataset:") {
        return Some(name.to_owned());
    }
    // A bare word may be a method's name: files have an extension.
    let (stem, _) = word.rsplit('/').next()?.rsplit_once('.')?;
    (!stem.is_empty()).then(|| stem.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use medial_run::record::{Simplify, Status};

    fn record(level: Target) -> Record {
        let simplify = Simplify::asked("qmat", level, Status::Ok);
        Record { mesh: "bear".to_owned(), status: Status::Ok, simplify, ..Record::default() }
    }

    #[test]
    fn the_command_repeats_the_item() {
        let mut of = record(Target::Spheres(100));
        assert_eq!(repeat_command(&of), "medial simplify bear -m qmat --spheres 100");
        of.command = "medial compare in/bear.off --methods qmat".to_owned();
        of.simplify.params.set("k", "0.5");
        of.simplify.params.set("mode", "a b");
        of.simplify.seed = 7;
        assert_eq!(
            repeat_command(&of),
            "medial simplify in/bear.off -m qmat --set k=0.5 --set 'mode=a b' --spheres 100 --seed 7"
        );
        of = record(Target::Native(0.25));
        of.dataset = Some("builtin".to_owned());
        assert_eq!(repeat_command(&of), "medial simplify builtin:bear -m qmat --level 0.25");
        of.dataset = Some("public".to_owned());
        assert_eq!(repeat_command(&of), "medial simplify dataset:bear -m qmat --level 0.25");
        of.dataset = Some("of-others".to_owned());
        assert_eq!(repeat_command(&of), "medial simplify bear -m qmat --level 0.25");
    }

    #[test]
    fn links_stay_inside() {
        assert_eq!(local_link("meshes/a b#1.ma").unwrap(), "./meshes/a%20b%231.ma");
        assert_eq!(local_link("javascript:alert(1)").unwrap(), "./javascript%3Aalert%281%29");
        for outside in ["", "/etc/passwd", "../x", "a/../../x", "a//b", "..\\x"] {
            assert_eq!(local_link(outside), None, "{outside}");
        }
    }
}
