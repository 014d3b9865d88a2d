//! The record of one item of a comparison: a line of `results.jsonl`.
//!
//! One mesh, one method, one level: the request, the result, its measurements, and the conditions of the run. A
//! failed run leaves a record, too, with its status and reason and without the parts that it did not reach. Keys are
//! part of the product's interface: other programs read them. Unknown keys are ignored on reading, so that older
//! versions read newer files.

use std::collections::BTreeMap;
use std::fmt;

use medial::complex::MedialMesh;
use medial::metrics::Evaluation;
use medial::simplifier::Params;
use serde::{Deserialize, Serialize};

use crate::level::Target;
use crate::text::{counted, megabytes};

/// Whether a result has the requested number of spheres, to within 2 %.
pub fn is_near(spheres: usize, requested: usize) -> bool {
    spheres.abs_diff(requested) as f64 <= 0.02 * requested as f64
}

/// The status of one item.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// A valid medial mesh.
    Ok,
    /// A valid medial mesh, read from a file of another program.
    External,
    /// A valid medial mesh with a number of spheres more than 2 % off the requested one.
    OtherCount,
    /// No level that was tried keeps the error bound: not a failure.
    BoundMissed,
    /// The method does not support this, or leaves nothing at this level: not a failure.
    Unsupported,
    /// Not started, since the method had used up its time budget on this mesh: not a failure.
    Skipped,
    /// The input was rejected before the method ran, or by a check of the method.
    Refused,
    /// The method returned an error.
    // The default: a record that is never completed must not count as a result.
    #[default]
    Failed,
    /// The method panicked, or its process was killed by a signal.
    Panicked,
    /// The time limit was reached.
    TimedOut,
    /// The memory limit was reached.
    OutOfMemory,
    /// The output is not a valid medial mesh.
    InvalidOutput,
}

impl Status {
    /// Every status, in the order of the enumeration.
    pub const ALL: [Self; 12] = [
        Self::Ok,
        Self::External,
        Self::OtherCount,
        Self::BoundMissed,
        Self::Unsupported,
        Self::Skipped,
        Self::Refused,
        Self::Failed,
        Self::Panicked,
        Self::TimedOut,
        Self::OutOfMemory,
        Self::InvalidOutput,
    ];

    /// Whether the result meets the request, or is an external one.
    pub fn is_ok(self) -> bool {
        matches!(self, Self::Ok | Self::External)
    }

    /// Whether there is a result to measure, at the requested count or another.
    pub fn has_result(self) -> bool {
        matches!(self, Self::Ok | Self::External | Self::OtherCount)
    }

    /// Whether something went wrong: neither a result nor a status such as `unsupported`.
    pub fn is_failure(self) -> bool {
        !self.has_result() && !matches!(self, Self::BoundMissed | Self::Unsupported | Self::Skipped)
    }

    /// The word in the JSON.
    pub fn key(self) -> String {
        let word = serde_json::to_value(self).expect("a word");
        word.as_str().expect("a word").to_owned()
    }
}

impl fmt::Display for Status {
    /// The words of tables and pages: `timed out` rather than `timed_out`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&self.key().replace('_', " "))
    }
}

/// One line of `results.jsonl`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Key of the level of the item: records with the same key are of the same work, and the last
    /// one counts. Empty in the records of an edition.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub key: String,
    /// Name of the mesh, as the user or the catalogue calls it.
    pub mesh: String,
    /// The dataset that the mesh comes from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dataset: Option<String>,
    /// Hash of the input file or of the generated surface: equal names may be different meshes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mesh_hash: Option<String>,
    /// Status of the item.
    pub status: Status,
    /// The reason, where the status is not `ok`: one sentence.
    pub reason: Option<String>,
    /// The request to the method, and its output.
    pub simplify: Simplify,
    /// The evaluation of the output. Absent where there is none, or where it was not measured.
    pub evaluate: Option<Evaluation>,
    /// Wall-clock seconds of the evaluation; part of no method's time. The levels of a method are measured in
    /// parallel, and levels with the same result once.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub evaluate_seconds: Option<f64>,
    /// The medial mesh that every simplifier of this shape starts from.
    pub initial: Option<Initial>,
    /// Settings of the run except input, method and level.
    pub conditions: Conditions,
    /// SHA-256 of the resulting medial mesh; the same for equal results.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub result_hash: Option<String>,
    /// Every seed by its purpose, such as `sampling`, `method`, `evaluation`.
    pub seeds: BTreeMap<String, u64>,
    /// Every timed repetition, raw, in the order they ran. [`Simplify::seconds`] is their summary.
    pub repetitions: Vec<Repetition>,
    /// The machine.
    pub machine: Machine,
    /// Version of the method, a hash of its sources; empty for a method without one.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub method_version: String,
    /// Hash of the program that ran the method.
    pub binary_hash: String,
    /// The command line, as the user typed it.
    pub command: String,
    /// Version of the program.
    pub version: String,
    /// Path of the resulting `.ma` file relative to the folder of the results, with `/`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub artifact: Option<String>,
    /// Metrics of the user by name, which a report adds from a file of their own; never read with the record.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty", skip_deserializing)]
    pub own: BTreeMap<String, OwnValue>,
    /// The edition that holds this record, where it is a frozen one next to those of a store.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub edition: Option<String>,
    /// Whether this program has another version of the method than the edition.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub is_other_version: bool,
}

/// A value of a metric of the user. As JSON the number alone.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(into = "f64")]
pub struct OwnValue {
    /// The number.
    pub value: f64,
    /// Its unit; may be empty.
    pub unit: String,
    /// Its better direction.
    pub better: Better,
}

impl From<OwnValue> for f64 {
    fn from(own: OwnValue) -> Self {
        own.value
    }
}

/// The better direction of a number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Better {
    /// Less is better.
    #[default]
    Lower,
    /// More is better.
    Higher,
    /// Neither: a size or a setting.
    Neither,
}

impl Better {
    /// Whether `a` is better than `b`.
    pub fn prefers(self, a: f64, b: f64) -> bool {
        match self {
            Self::Lower => a < b,
            Self::Higher => a > b,
            Self::Neither => false,
        }
    }
}

impl Record {
    /// Warnings of the method and of the evaluation, in that order.
    pub fn warnings(&self) -> Vec<&str> {
        let evaluation = self.evaluate.iter().flat_map(|evaluation| &evaluation.warnings);
        self.simplify.warnings.iter().chain(evaluation).map(String::as_str).collect()
    }

    /// Whether no other item of the run disturbed the seconds: only such seconds are comparable.
    pub fn ran_alone(&self) -> bool {
        self.conditions.jobs <= 1
    }

    /// Wall-clock seconds by stage, of a run that nothing disturbed. Those of an edition are of another run, on another
    /// machine in general: [`Self::frozen_seconds`].
    pub fn seconds(&self) -> Option<Stages> {
        self.simplify.seconds.filter(|_| self.ran_alone() && self.edition.is_none())
    }

    /// Wall-clock seconds by stage, of a record of an edition.
    pub fn frozen_seconds(&self) -> Option<Stages> {
        self.simplify.seconds.filter(|_| self.ran_alone() && self.edition.is_some())
    }
}

/// The `simplify` object: one method at one level.
///
/// Only the request is always present; the rest is absent where the run ended earlier.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Simplify {
    /// Status of the run.
    pub status: Status,
    /// Id of the method.
    pub method: String,
    /// Name of the method with these parameters in tables, if the user named it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub variant: Option<String>,
    /// Parameters that the user set; an empty object means the paper's values.
    pub params: Params,
    /// Seed of the method's random choices.
    pub seed: u64,
    /// The requested level.
    pub level: Target,
    /// Reached number of spheres.
    pub reached: Option<usize>,
    /// Native level that was used, where the method has one.
    pub native_level: Option<f64>,
    /// Spheres of the result.
    pub spheres: Option<usize>,
    /// Edges of the result.
    pub edges: Option<usize>,
    /// Faces of the result.
    pub faces: Option<usize>,
    /// Wall-clock seconds of each shared substrate that the method used, even if another method built it.
    pub substrates: BTreeMap<String, f64>,
    /// Wall-clock seconds by stage.
    pub seconds: Option<Stages>,
    /// Seconds of the process on all processors, by stage.
    pub cpu_seconds: Option<Stages>,
    /// The most memory that the run needed at one time, in bytes: live bytes of the heap with the
    /// substrates that the method used, as if it had been alone.
    pub peak_bytes: Option<u64>,
    /// Seconds by the method's own clock, for programs that report them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub own_seconds: Option<OwnSeconds>,
    /// Threads of the method.
    pub threads: Option<usize>,
    /// Named counts of the method, such as `rejected_by_link_condition`.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub diagnostics: BTreeMap<String, u64>,
    /// Warnings, one sentence each.
    pub warnings: Vec<String>,
    /// Version of the program.
    pub version: String,
}

impl Simplify {
    /// A request without a result: the record of a run that failed at once.
    pub fn asked(method: impl Into<String>, level: Target, status: Status) -> Self {
        Self { status, method: method.into(), level, ..Self::default() }
    }
}

/// Seconds by the clock of an external program, next to the runner's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, expecting = "an object with the numbers `prepare` and `simplify`")]
pub struct OwnSeconds {
    /// The method's work that does not depend on the level.
    pub prepare: Option<f64>,
    /// From there to this level.
    pub simplify: Option<f64>,
}

/// Settings of a run except input, method and level.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Conditions {
    /// Boundary samples.
    pub sampling: String,
    /// Triangulation of the dual Voronoi polygons.
    pub dual: String,
    /// Surface samples of the evaluation.
    pub samples: usize,
    /// Limit of time, in seconds.
    pub seconds_limit: f64,
    /// Limit of memory, in bytes.
    pub bytes_limit: u64,
    /// Budget of time of the method on this mesh, in seconds, where it had one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub budget: Option<f64>,
    /// Number of items that ran at the same time.
    pub jobs: usize,
    /// Hash of the declaration and the files of a plug-in.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fingerprint: Option<String>,
}

/// Seconds by stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Stages {
    /// The shared substrates that the method used.
    pub substrate: f64,
    /// The method's work that does not depend on the level.
    pub prepare: f64,
    /// From there to this level, as if no other level had been requested.
    pub simplify: f64,
    /// The sum of the stages.
    pub total: f64,
}

impl Stages {
    /// The three stages and their sum, in seconds.
    pub fn new(substrate: f64, prepare: f64, simplify: f64) -> Self {
        Self { substrate, prepare, simplify, total: substrate + prepare + simplify }
    }
}

/// One timed repetition.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Repetition {
    /// Wall-clock seconds by stage.
    #[serde(flatten)]
    pub seconds: Stages,
    /// Seconds of the process on all processors, by stage.
    pub cpu_seconds: Stages,
}

/// The initial medial mesh of a shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Initial {
    /// Spheres.
    pub spheres: u64,
    /// Edges.
    pub edges: u64,
    /// Faces.
    pub faces: u64,
    /// Betti numbers over Z2, where they were computed.
    pub betti: Option<[u64; 3]>,
    /// The solid's topology: components, total genus, cavities.
    pub expected_betti: Option<[u64; 3]>,
}

impl Initial {
    /// Counts and topology of an initial medial mesh.
    pub fn of(mesh: &MedialMesh, expected_betti: Option<[u64; 3]>) -> Self {
        Self {
            spheres: mesh.spheres.len() as u64,
            edges: mesh.edges.len() as u64,
            faces: mesh.faces.len() as u64,
            betti: Some(medial::complex::betti(mesh)),
            expected_betti,
        }
    }
}

/// The machine of a run.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Machine {
    /// Model of the processor.
    pub cpu: String,
    /// Logical processors.
    pub cores: usize,
    /// Operating system and architecture.
    pub os: String,
    /// Main memory, in bytes.
    pub memory: u64,
}

impl fmt::Display for Machine {
    /// Processor, cores, memory and system, as far as known.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let cores = (self.cores > 0).then(|| counted(self.cores, "core", "cores"));
        let memory = (self.memory > 0).then(|| format!("{} MB", megabytes(self.memory)));
        let parts = [Some(self.cpu.clone()), cores, memory, Some(self.os.clone())];
        let known: Vec<String> = parts.into_iter().flatten().filter(|p| !p.is_empty()).collect();
        f.write_str(&known.join(", "))
    }
}

/// The facts that are the same for every record of a run.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Provenance {
    /// The machine.
    pub machine: Machine,
    /// SHA-256 of the running program.
    pub binary_hash: String,
    /// The command line.
    pub command: String,
    /// Version of the program.
    pub version: String,
}
