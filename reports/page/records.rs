//! All records for the page: one column for each number, so that the browser parses one document without keys.

use std::collections::BTreeMap;

use medial_run::level::Target;
use medial_run::text::significant;
use serde_json::{Value, json};

use crate::comparison::{Comparison, Entry, level_label, reached};
use crate::tables::{Best, flatten, remark, topology_word};

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
    let warnings = record.warnings();
    let cells = [
        ("mesh", json!(entry.mesh)),
        ("series", json!(entry.series)),
        ("best", json!(bits)),
        ("asked", json!(level_label(record.simplify.level))),
        ("count", json!(count)),
        ("status", json!(record.status.to_string())),
        ("spheres", json!(reached(record))),
        ("topology", json!(topology_word(entry))),
        ("remark", json!(remark(entry))),
        ("link", json!(record.artifact.as_deref().and_then(local_link))),
        ("warnings", if warnings.is_empty() { Value::Null } else { json!(warnings) }),
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

#[cfg(test)]
mod tests {
    use super::*;
    #[test]
    fn links_stay_inside() {
        assert_eq!(local_link("meshes/a b#1.ma").unwrap(), "./meshes/a%20b%231.ma");
        assert_eq!(local_link("javascript:alert(1)").unwrap(), "./javascript%3Aalert%281%29");
        for outside in ["", "/etc/passwd", "../x", "a/../../x", "a//b", "..\\x"] {
            assert_eq!(local_link(outside), None, "{outside}");
        }
    }
}
