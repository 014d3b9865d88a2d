//! Everything that is known of an item, for the row that the script opens below its row.
//!
//! The records stand as compressed JSON in a block of their own: one line for each row of the results, in
//! their order, so that the script reads only the line that is asked for. What many records share
//! stands once, in the first line with the keys it stands for, and the records hold its index.

use std::collections::HashMap;

use crate::Target;
use serde_json::{Map, Value, json};

use crate::comparison::Comparison;
use crate::page::html;
use crate::page::packed::packed;
use crate::record::Record;

/// Keys whose values many records share.
const SHARED: [&str; 9] = [
    "binary_hash",
    "command",
    "conditions",
    "initial",
    "machine",
    "mesh_hash",
    "repeat",
    "seeds",
    "version",
];

/// The block of all records.
pub(crate) fn block(comparison: &Comparison<'_>) -> String {
    let mut shared = Shared::default();
    let lines: Vec<String> =
        comparison.entries.iter().map(|entry| line(entry.record, &mut shared)).collect();
    let mut block = html::json(&json!({ "keys": SHARED, "values": shared.values }));
    for line in lines {
        block.push('\n');
        block.push_str(&line);
    }
    packed(Some("records"), &block)
}

/// The distinct values of [`SHARED`], in the order in which they occur.
#[derive(Default)]
struct Shared {
    values: Vec<Value>,
    index: HashMap<String, usize>,
}

impl Shared {
    fn index_of(&mut self, value: Value) -> usize {
        *self.index.entry(value.to_string()).or_insert_with(|| {
            self.values.push(value);
            self.values.len() - 1
        })
    }
}

fn line(record: &Record, shared: &mut Shared) -> String {
    let Ok(Value::Object(mut all)) = serde_json::to_value(record) else { return "{}".to_owned() };
    all.insert("repeat".to_owned(), repeat_command(record).into());
    // The summary of a single repetition is that repetition.
    if record.repetitions.len() < 2 {
        all.remove("repetitions");
    }
    let mut kept = Map::new();
    for (key, value) in all {
        let Some(value) = known(value) else { continue };
        let value = if SHARED.contains(&key.as_str()) {
            Value::from(shared.index_of(value))
        } else {
            value
        };
        kept.insert(key, value);
    }
    html::json(&Value::Object(kept))
}

/// A value without what says nothing: nulls, empty texts, lists and objects.
fn known(value: Value) -> Option<Value> {
    match value {
        Value::Null => None,
        Value::String(text) if text.is_empty() => None,
        Value::Array(list) if list.is_empty() => None,
        Value::Object(map) => {
            let map: Map<String, Value> = map
                .into_iter()
                .filter_map(|(key, value)| known(value).map(|value| (key, value)))
                .collect();
            (!map.is_empty()).then_some(Value::Object(map))
        }
        value => Some(value),
    }
}

/// The command that asks for the same result again.
fn repeat_command(record: &Record) -> String {
    let simplify = &record.simplify;
    let mut words: Vec<String> = ["medial", "simplify"].map(str::to_owned).into();
    words.push(mesh_argument(record));
    words.extend(["-m".to_owned(), simplify.method.clone()]);
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
    words.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" ")
}

/// The sets whose meshes `dataset:NAME` names.
const LIBRARY: [&str; 5] = ["public", "defective", "small", "papers", "added"];

/// The mesh as it was named on the command line of the run, as far as it stands there; else its name.
fn mesh_argument(record: &Record) -> String {
    let is_named = |word: &str| {
        let name = match (word.strip_prefix("builtin:"), word.strip_prefix("dataset:")) {
            (Some(spec), _) => spec.replacen(':', "-", 1),
            (None, Some(name)) => name.to_owned(),
            (None, None) => {
                let file = word.rsplit('/').next().unwrap_or(word);
                // A bare word may be a method's name: files have an extension.
                match file.rsplit_once('.') {
                    Some((stem, _)) if !stem.is_empty() => stem.to_owned(),
                    _ => return false,
                }
            }
        };
        name == record.mesh
    };
    let said = record.command.split_whitespace().find(|word| is_named(word));
    match said {
        Some(word) => word.to_owned(),
        None => match record.dataset.as_deref() {
            Some("builtin") => format!("builtin:{}", record.mesh),
            Some(set) if LIBRARY.contains(&set) => format!("dataset:{}", record.mesh),
            // A set of others, whose meshes have no name here.
            _ => record.mesh.clone(),
        },
    }
}

/// A word as a shell takes it.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,:@%+".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::{Simplify, Status};

    fn record(level: Target) -> Record {
        let simplify = serde_json::to_value(Simplify::asked("qmat", level, Status::Ok)).unwrap();
        let json = serde_json::json!({"mesh": "bear", "status": "ok", "simplify": simplify});
        serde_json::from_value(json).unwrap()
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
    fn a_record_cannot_leave_its_script() {
        let mut of = record(Target::Published);
        of.reason = Some("</script><!--\u{202e}".to_owned());
        let line = line(&of, &mut Shared::default());
        assert!(
            !line.contains('<') && !line.contains('\u{202e}') && !line.contains('\n'),
            "{line}"
        );
        let back: Value = serde_json::from_str(&line).unwrap();
        assert_eq!(back["reason"], "</script><!--\u{fffd}");
        assert!(back.get("evaluate").is_none());
    }
}
