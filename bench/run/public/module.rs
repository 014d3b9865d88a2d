//! A mesh in a JavaScript module, as some packages of npm have it: `exports.positions = [[x, y, z], ...]` and
//! `exports.cells = [[a, b, c], ...]`, written as OFF.

use std::fmt::Write as _;

use serde::de::DeserializeOwned;

/// The mesh of a module as OFF; `None` where the text is no such module. Numbers come out as the shortest text of the
/// same value, so that the same module gives the same bytes.
pub(super) fn to_off(bytes: &[u8]) -> Option<Vec<u8>> {
    let text = std::str::from_utf8(bytes).ok()?;
    let positions: Vec<[f64; 3]> = exported(text, "positions")?;
    let cells: Vec<[u32; 3]> = exported(text, "cells")?;
    let mut off = format!("OFF\n{} {} 0\n", positions.len(), cells.len());
    for [x, y, z] in positions {
        writeln!(off, "{x} {y} {z}").ok()?;
    }
    for [a, b, c] in cells {
        writeln!(off, "3 {a} {b} {c}").ok()?;
    }
    Some(off.into_bytes())
}

/// The array that a module exports under a name.
fn exported<T: DeserializeOwned>(text: &str, name: &str) -> Option<T> {
    let (_, after) = text.split_once(&format!("exports.{name}"))?;
    let array = after.trim_start().strip_prefix('=')?;
    // A stream: after the array the module goes on.
    serde_json::Deserializer::from_str(array).into_iter().next()?.ok()
}

#[cfg(test)]
mod tests {
    use super::to_off;

    #[test]
    fn a_module_becomes_off_and_any_other_text_nothing() {
        let module =
            "exports.positions = [[0,1.50,-2e-3],[1,0,0],[0,0,1]]\nexports.cells=[[0,1,2]];\n";
        let off = "OFF\n3 1 0\n0 1.5 -0.002\n1 0 0\n0 0 1\n3 0 1 2\n";
        assert_eq!(to_off(module.as_bytes()).as_deref(), Some(off.as_bytes()));
        for other in ["", "exports.positions = load(1)", "exports.cells=[[0,1,2]]", "\u{0}"] {
            assert_eq!(to_off(other.as_bytes()), None, "{other:?}");
        }
    }
}
