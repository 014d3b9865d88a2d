//! Our values beside the published ones, and what they say of the paper's claims.

use std::collections::BTreeMap;

use serde::Serialize;

use super::{Claim, Comparison, Exhibit, Operand};
use crate::text::{grouped, significant};

/// An exhibit with our values.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Reproduction {
    /// Id of the exhibit.
    pub id: String,
    /// Authors, year, table or figure.
    pub source: String,
    /// Its rows, in order.
    pub rows: Vec<ReproducedRow>,
    /// What became of the paper's claims.
    pub verdicts: Vec<Verdict>,
}

/// One row with our values.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ReproducedRow {
    /// Id of the row.
    pub id: String,
    /// The paper's name of the model.
    pub model: String,
    /// What we ran on.
    pub input: String,
    /// How it differs from the paper's.
    pub differs: String,
    /// Published values by column.
    pub published: BTreeMap<String, f64>,
    /// Our values by column.
    pub ours: BTreeMap<String, f64>,
    /// Why a value is missing, and other remarks.
    pub remarks: Vec<String>,
}

/// What became of a claim.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verdict {
    /// What the paper says.
    pub says: String,
    /// Whether it holds here; `None` where a value is missing.
    pub holds: Option<bool>,
    /// Each comparison with its numbers.
    pub because: Vec<String>,
    /// What is known of the reason, where it does not hold.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
}

impl Reproduction {
    /// The reproduction of an exhibit from its rows.
    pub fn new(exhibit: &Exhibit, rows: Vec<ReproducedRow>) -> Self {
        let verdicts = exhibit.claims.iter().map(|claim| judge(claim, &rows)).collect();
        Self { id: exhibit.id.clone(), source: exhibit.source.clone(), rows, verdicts }
    }

    /// How many values of ours there are.
    pub fn measured(&self) -> usize {
        self.rows.iter().map(|row| row.ours.len()).sum()
    }

    /// Whether every row has all its values.
    pub fn is_complete(&self, exhibit: &Exhibit) -> bool {
        self.rows.iter().all(|row| exhibit.columns.iter().all(|c| row.ours.contains_key(&c.key)))
    }
}

fn judge(claim: &Claim, rows: &[ReproducedRow]) -> Verdict {
    let value = |place: &str| {
        let (row, key) = place.split_once('/')?;
        rows.iter().find(|r| r.id == row)?.ours.get(key).copied()
    };
    let compared = claim.means.iter().map(|Comparison { left, is, right }| {
        let (number, name) = match right {
            Operand::Number(number) => (Some(*number), None),
            Operand::Value(place) => (value(place), Some(place)),
        };
        let (Some(l), Some(r)) = (value(left), number) else {
            return (None, format!("{left}: not measured"));
        };
        let holds = is.holds(l, r);
        let [l, r] = [l, r].map(number_text);
        let right = name.map_or_else(|| r.clone(), |name| format!("{name}, {r}"));
        let word = if holds { "yes" } else { "no" };
        (Some(holds), format!("{left}, {l}, {} {right}: {word}", is.words()))
    });
    let (each, because): (Vec<Option<bool>>, Vec<String>) = compared.unzip();
    let holds = each.into_iter().collect::<Option<Vec<bool>>>().map(|all| all.iter().all(|&h| h));
    let reason = claim.if_not.clone().filter(|_| holds == Some(false));
    Verdict { says: claim.says.clone(), holds, because, reason }
}

/// A count in full, anything else with three significant digits.
pub(super) fn number_text(v: f64) -> String {
    if v.fract() == 0.0 && (0.0..1e9).contains(&v) {
        grouped(v as u64)
    } else if (100.0..1e9).contains(&v) {
        grouped(v.round() as u64)
    } else {
        significant(v, 3)
    }
}
