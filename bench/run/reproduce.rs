//! Rows of published tables, run.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use medial::metrics::{Judge, JudgeOptions, union_betti};
use medial::shape::{Shape, ShapeOptions};
use medial::simplifier::RunContext;
use medial::surface::{self, Sampling};
use medial_reports::published::{Exhibit, ReproducedRow, Row, RowInput, Run};
use medial_reports::{Initial, Record};
use serde_json::{Value, json};

use super::{Input, Item, Measure, Provenance, RunOptions, Source, run_item};

/// Distance between the balls that stand for the primitives where the topology of a union is asked,
/// as a fraction of the diagonal.
const BALL_SPACING: f64 = 0.004;

/// Repeats rows, and keeps the input of the last one: rows often share it.
pub struct Reproducer {
    folder: PathBuf,
    samples: usize,
    provenance: Provenance,
    last: Option<(RowInput, usize, Ready)>,
}

/// An input with everything that runs on it need.
struct Ready {
    input: Input,
    shape: Shape,
    judge: Judge,
    initial: Initial,
}

impl Reproducer {
    /// Repeats rows on the meshes of a folder, errors measured with `samples` surface samples.
    pub fn new(folder: &Path, samples: usize, provenance: &Provenance) -> Self {
        let provenance = provenance.clone();
        Self { folder: folder.to_owned(), samples, provenance, last: None }
    }

    /// Runs a row. What cannot be run leaves a remark and no value.
    pub fn row(&mut self, exhibit: &Exhibit, row: &Row) -> ReproducedRow {
        let RowInput { mesh, sampling, noise } = &row.input;
        let mut input = mesh.clone();
        if sampling != "vertices" {
            input += &format!(", {sampling}");
        }
        if let Some(noise) = noise {
            input += &format!(", noise {} %", 100.0 * noise.eta);
        }
        let mut reproduced = ReproducedRow {
            id: row.id.clone(),
            model: row.model.clone(),
            input,
            differs: row.differs.clone(),
            published: row.published.clone(),
            ours: BTreeMap::new(),
            remarks: vec![],
        };
        // Without a column of errors the judge only has to be there.
        let samples = if exhibit.needs_evaluation() { self.samples } else { 1 };
        if !matches!(&self.last, Some((last, s, _)) if *last == row.input && *s == samples) {
            // What is kept goes first, so that two large shapes are never there together.
            self.last = None;
            match self.load(&row.input, samples) {
                Ok(ready) => self.last = Some((row.input.clone(), samples, ready)),
                Err(why) => reproduced.remarks.push(why),
            }
        }
        if let Some((_, _, ready)) = &self.last {
            fill(&mut reproduced, exhibit, row, ready, &self.provenance);
        }
        reproduced
    }

    fn load(&self, wanted: &RowInput, samples: usize) -> Result<Ready, String> {
        let argument = match wanted.mesh.starts_with("builtin:") {
            true => PathBuf::from(&wanted.mesh),
            false => self.folder.join(&wanted.mesh),
        };
        let source = Source::parse(&argument).map_err(|error| error.to_string())?;
        if matches!(&source, Source::File(path) if !path.exists()) {
            return Err(format!("{} is not there: see --meshes", argument.display()));
        }
        let mut input = Input::load(&source).map_err(|error| error.to_string())?;
        if let Some(noise) = wanted.noise {
            input.mesh = medial_datasets::add_noise(&input.mesh, noise.eta, noise.seed);
            input.report = surface::validate(&input.mesh).map_err(|error| error.to_string())?;
            input.axis = None;
        }
        let sampling: Sampling = wanted.sampling.parse().map_err(|e| format!("sampling: {e}"))?;
        let options = ShapeOptions { sampling, ..ShapeOptions::default() };
        let shape = input.shape(options).map_err(|error| error.to_string())?;
        let default = JudgeOptions::default();
        let volume_depth = if samples > 1 { default.volume_depth } else { 0 };
        let judge = shape
            .judge(input.axis.as_ref(), JudgeOptions { samples, volume_depth, ..default })
            .map_err(|error| error.to_string())?;
        let mesh = shape.view().initial().map_err(|error| error.to_string())?;
        let initial = Initial::of(&mesh, judge.truth().betti);
        Ok(Ready { input, shape, judge, initial })
    }
}

fn fill(
    reproduced: &mut ReproducedRow,
    exhibit: &Exhibit,
    row: &Row,
    ready: &Ready,
    provenance: &Provenance,
) {
    let mut records: BTreeMap<&str, Option<(Record, Value)>> = BTreeMap::new();
    for column in &exhibit.columns {
        let name = column.run.as_str();
        if !records.contains_key(name) {
            let run = exhibit.run(row, name);
            let record = run.and_then(|run| {
                let record = one_run(run, ready, provenance)?;
                let mut value = json!(record);
                if exhibit.needs_union() {
                    value["union"] = json!({ "betti": union_betti_of(run, ready) });
                }
                Some((record, value))
            });
            if record.is_none() {
                reproduced.remarks.push(format!("{name}: medial has no such method"));
            }
            records.insert(name, record);
        }
        let Some((_, record)) = &records[name] else { continue };
        if let Some(value) = column.read(record) {
            reproduced.ours.insert(column.key.clone(), value);
        }
    }
    for (name, record) in records {
        let Some((record, _)) = record else { continue };
        let why = record.reason.iter().map(|reason| format!("{name}: {reason}"));
        let warnings = record.simplify.warnings.iter().map(|w| format!("{name}: {w}"));
        reproduced.remarks.extend(why.chain(warnings));
    }
}

fn one_run(run: &Run, ready: &Ready, provenance: &Provenance) -> Option<Record> {
    let method = medial_methods::find(&run.method)?;
    let item =
        Item { method: run.method.clone(), params: run.params.clone(), levels: vec![run.level] };
    let Ready { input, shape, judge, initial } = ready;
    let measure = Measure { input, shape, judge, initial: Some(*initial) };
    let options = RunOptions { seed: 0, repeat: 1, out: None };
    run_item(method.as_ref(), &item, &measure, &options, provenance).pop()
}

/// The Betti numbers of the union after a run. The run is repeated, since records keep no mesh.
fn union_betti_of(run: &Run, ready: &Ready) -> Option<[u64; 3]> {
    let method = medial_methods::find(&run.method)?;
    let view = ready.shape.view();
    let mut prepared = method.prepare(&view, &run.params, &RunContext::default()).ok()?;
    let simplified = prepared.at(run.level).ok()?;
    union_betti(&simplified.mesh, BALL_SPACING).ok()
}
