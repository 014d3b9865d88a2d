//! Figures of the papers as data: what was published, on which model, and how it is repeated.
//!
//! Each file `*.json` beside this one is an [`Exhibit`]: a table or a figure of a paper. Its rows name
//! models and published values; its columns say which number of a [`Record`](crate::Record) belongs beside them.
//! The runner fills in ours ([`Reproduction`]), and [`Reproduction::verdicts`] says which claims
//! hold.

mod reproduction;
#[cfg(test)]
mod tests;
mod text;

use std::collections::BTreeMap;

use crate::Target;
use medial::simplifier::Params;
use serde::{Deserialize, Serialize};
use serde_json::Value;

pub use reproduction::{ReproducedRow, Reproduction, Verdict};

/// A table or a figure of a paper.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Exhibit {
    /// Short name for the command line, such as `qmat-table-3`.
    pub id: String,
    /// Authors, year, and the table or figure.
    pub source: String,
    /// What the table shows, one sentence.
    pub shows: String,
    /// The machine of the paper, where the rows hold seconds.
    #[serde(default)]
    pub machine: Option<String>,
    /// What differs for all rows.
    #[serde(default)]
    pub notes: Vec<String>,
    /// What is run on each row's input, by name.
    pub runs: BTreeMap<String, Run>,
    /// What is shown of the runs.
    pub columns: Vec<Column>,
    /// The rows.
    pub rows: Vec<Row>,
    /// What the paper says in words, as comparisons of our values.
    #[serde(default)]
    pub claims: Vec<Claim>,
}

/// One method at one level.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Run {
    /// Id of the method.
    pub method: String,
    /// Its parameters.
    #[serde(default)]
    pub params: Params,
    /// How far it simplifies.
    pub level: Target,
}

/// A number of the table.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Column {
    /// Key of the published values and of ours.
    pub key: String,
    /// Heading.
    pub title: String,
    /// Unit, empty for a count.
    #[serde(default)]
    pub unit: String,
    /// The run that the number is taken from.
    pub run: String,
    /// Places in the [`Record`](crate::Record), as JSON pointers; their values are added. Beside the
    /// record's own there is `/union/betti`, the Betti numbers of the union of the primitives, and
    /// `/noise/shift`, the distances to the result without noise ([`Against::Clean`]).
    pub of: Vec<String>,
    /// What their sum is divided by, where the column is a share.
    #[serde(default)]
    pub per: Option<String>,
    /// Factor from the record's unit to this column's.
    #[serde(default = "one")]
    pub scale: f64,
}

fn one() -> f64 {
    1.0
}

/// One model.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Row {
    /// Name of the row for claims, and heading where the model stands in several rows.
    pub id: String,
    /// The paper's name of the model.
    pub model: String,
    /// What we run on.
    pub input: RowInput,
    /// How our input differs from the paper's.
    pub differs: String,
    /// Runs of this row in place of the exhibit's.
    #[serde(default)]
    pub runs: BTreeMap<String, Run>,
    /// Published values by column.
    #[serde(default)]
    pub published: BTreeMap<String, f64>,
}

/// The input of a row.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RowInput {
    /// A file in the folder of meshes, or `builtin:ID[:RESOLUTION]`.
    pub mesh: String,
    /// Boundary samples, as on the command line.
    #[serde(default = "vertices")]
    pub sampling: String,
    /// Factor on all coordinates, for another unit of length.
    #[serde(default = "one")]
    pub scale: f64,
    /// Noise on the vertices.
    #[serde(default)]
    pub noise: Option<Noise>,
}

fn vertices() -> String {
    "vertices".to_owned()
}

/// Isotropic noise on the vertices.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Noise {
    /// Largest displacement, as a fraction of the diagonal.
    pub eta: f64,
    /// Seed.
    pub seed: u64,
    /// What results are measured against.
    #[serde(default)]
    pub against: Against,
}

/// What results on a noisy surface are measured against.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Against {
    /// The noisy surface.
    #[default]
    Noisy,
    /// The surface without noise, its known axis, and the same run's result on it.
    Clean,
}

/// A sentence of the paper, and the comparisons that it amounts to.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Claim {
    /// What the paper says.
    pub says: String,
    /// What must hold, all of it.
    pub means: Vec<Comparison>,
    /// What is known of the reason where it does not hold here.
    #[serde(default)]
    pub if_not: Option<String>,
}

/// A comparison of two of our values.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Comparison {
    /// A value, as `row/column`.
    pub left: String,
    /// The relation.
    pub is: Relation,
    /// Another value, as `row/column`, or a number.
    pub right: Operand,
}

/// A relation of two numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
pub enum Relation {
    /// Less than.
    #[serde(rename = "<")]
    Less,
    /// At most.
    #[serde(rename = "<=")]
    AtMost,
    /// More than.
    #[serde(rename = ">")]
    More,
    /// Equal.
    #[serde(rename = "=")]
    Equal,
}

impl Relation {
    fn holds(self, left: f64, right: f64) -> bool {
        match self {
            Self::Less => left < right,
            Self::AtMost => left <= right,
            Self::More => left > right,
            Self::Equal => left == right,
        }
    }

    /// In words, which need no escape in any format.
    fn words(self) -> &'static str {
        match self {
            Self::Less => "below",
            Self::AtMost => "at most",
            Self::More => "above",
            Self::Equal => "equal to",
        }
    }
}

/// The right side of a comparison.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(untagged)]
pub enum Operand {
    /// A number.
    Number(f64),
    /// One of our values, as `row/column`.
    Value(String),
}

impl Exhibit {
    /// The run of a row under a name.
    pub fn run<'a>(&'a self, row: &'a Row, name: &str) -> Option<&'a Run> {
        row.runs.get(name).or_else(|| self.runs.get(name))
    }

    /// Whether any column asks for the topology of the union.
    pub fn needs_union(&self) -> bool {
        self.reads_below("/union")
    }

    /// Whether any column needs more than counts and seconds.
    pub fn needs_evaluation(&self) -> bool {
        self.reads_below("/evaluate") || self.reads_below("/noise")
    }

    /// Whether any column asks for what surface samples decide: not topology, counts and angles.
    pub fn needs_samples(&self) -> bool {
        let exact = ["betti", "expected_betti", "counts", "quality", "spikes"];
        let sampled = |place: &String| match place.strip_prefix("/evaluate/") {
            Some(rest) => !exact.contains(&rest.split('/').next().unwrap_or(rest)),
            None => place.starts_with("/noise"),
        };
        self.columns.iter().flat_map(|c| &c.of).any(sampled)
    }

    /// Whether any column asks for the volume difference, which costs as much as all else.
    pub fn needs_volume(&self) -> bool {
        self.reads_below("/evaluate/volume_error")
    }

    fn reads_below(&self, prefix: &str) -> bool {
        self.columns.iter().flat_map(|c| &c.of).any(|place| place.starts_with(prefix))
    }

    /// The first name that leads nowhere: a column of an unknown run, a value of an unknown column,
    /// a claim about an unknown row.
    ///
    /// # Errors
    /// One sentence that names it.
    pub fn check(&self) -> Result<(), String> {
        let id = &self.id;
        let known = |key: &str| self.columns.iter().any(|c| c.key == key);
        for column in &self.columns {
            if self.rows.iter().any(|row| self.run(row, &column.run).is_none()) {
                return Err(format!("{id}: column {} has no run {}", column.key, column.run));
            }
        }
        for row in &self.rows {
            if !(row.input.scale > 0.0 && row.input.scale.is_finite()) {
                return Err(format!("{id}: row {} is scaled by {}", row.id, row.input.scale));
            }
            if let Some(key) = row.published.keys().find(|key| !known(key)) {
                return Err(format!("{id}: row {} has a value for no column {key}", row.id));
            }
            if self.rows.iter().filter(|other| other.id == row.id).count() > 1 {
                return Err(format!("{id}: two rows are called {}", row.id));
            }
        }
        let found = |place: &str| {
            let parts = place.split_once('/');
            parts.is_some_and(|(row, key)| known(key) && self.rows.iter().any(|r| r.id == row))
        };
        for comparison in self.claims.iter().flat_map(|claim| &claim.means) {
            let right = match &comparison.right {
                Operand::Value(place) => Some(place),
                Operand::Number(_) => None,
            };
            if let Some(place) =
                [Some(&comparison.left), right].into_iter().flatten().find(|p| !found(p))
            {
                return Err(format!("{id}: a claim names {place}, which is no value"));
            }
        }
        Ok(())
    }
}

impl Column {
    /// The number in a record as JSON, if all its parts are there.
    pub fn read(&self, record: &Value) -> Option<f64> {
        let number = |place: &String| record.pointer(place)?.as_f64();
        let sum = self.of.iter().map(number).sum::<Option<f64>>()?;
        let whole = self.per.as_ref().map_or(Some(1.0), number)?;
        (whole != 0.0).then(|| sum / whole * self.scale)
    }
}

/// All exhibits, in the order of the papers.
///
/// # Panics
/// Never: the files are part of the program, and a test reads them.
pub fn published() -> Vec<Exhibit> {
    let files = [
        include_str!("qmat-table-1.json"),
        include_str!("qmat-table-2.json"),
        include_str!("qmat-table-3.json"),
        include_str!("qmat-figure-8.json"),
        include_str!("qmat-figure-10.json"),
        include_str!("qmat-figure-12.json"),
        include_str!("qmat-figure-13.json"),
        include_str!("qmat-figure-14.json"),
        include_str!("qmat-figure-15.json"),
        include_str!("qmat-figure-16.json"),
        include_str!("qmat-figure-20.json"),
        include_str!("pmat-table-1.json"),
        include_str!("giesen-scale.json"),
        include_str!("foskey-theta.json"),
        include_str!("foskey-box.json"),
        include_str!("chazal-homotopy.json"),
        include_str!("chazal-noise.json"),
        include_str!("chazal-features.json"),
        include_str!("tam-heidrich-table-1.json"),
        include_str!("tam-heidrich-figure-10.json"),
        include_str!("dey-zhao-table-1.json"),
        include_str!("dey-zhao-figure-5.json"),
        include_str!("dey-zhao-figure-7.json"),
        include_str!("dey-zhao-scale.json"),
        include_str!("dey-zhao-convergence.json"),
        include_str!("stolpner-table-2.json"),
    ];
    let read = |text: &&str| serde_json::from_str(text).expect("a published table is well formed");
    files.iter().map(read).collect()
}
