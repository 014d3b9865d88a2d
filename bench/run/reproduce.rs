//! Rows of published tables, run: each run of a row is an item like any other.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use medial::metrics::JudgeOptions;
use medial_reports::published::{Against, Exhibit, ReproducedRow, Row, RowInput, Run};
use serde_json::{Value, json};

use super::{
    Dual, Here, Item, Kept, Limits, Measure, MethodSpec, Noise, Registry, RunError, SceneSpec,
    Source, Supervisor,
};

/// Distance between the balls that stand for the primitives where the topology of a union is asked,
/// as a fraction of the diagonal.
const BALL_SPACING: f64 = 0.004;

/// Repeats rows.
pub struct Reproducer<'a> {
    folder: PathBuf,
    samples: usize,
    registry: &'a Registry,
    here: Here,
    supervisor: Supervisor<'a>,
    limits: Limits,
}

impl<'a> Reproducer<'a> {
    /// Repeats rows on the meshes of a folder, errors measured with `samples` surface samples.
    pub fn new(
        folder: &Path,
        samples: usize,
        (registry, here): (&'a Registry, Here),
        supervisor: Supervisor<'a>,
        limits: Limits,
    ) -> Self {
        Self { folder: folder.to_owned(), samples, registry, here, supervisor, limits }
    }

    /// Runs a row. What cannot be run leaves a remark and no value.
    ///
    /// # Errors
    /// When the user interrupts, or no worker can be started.
    pub fn row(&mut self, exhibit: &Exhibit, row: &Row) -> Result<ReproducedRow, RunError> {
        let RowInput { mesh, sampling, scale, noise } = &row.input;
        let mut input = mesh.clone();
        if *scale != 1.0 {
            input += &format!(", times {scale}");
        }
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
        match self.scene(exhibit, &row.input) {
            Ok(scene) => self.fill(&mut reproduced, exhibit, row, &scene)?,
            Err(why) => reproduced.remarks.push(why),
        }
        Ok(reproduced)
    }

    fn scene(&self, exhibit: &Exhibit, wanted: &RowInput) -> Result<SceneSpec, String> {
        let argument = match Source::is_name(Path::new(&wanted.mesh)) {
            true => PathBuf::from(&wanted.mesh),
            false => self.folder.join(&wanted.mesh),
        };
        let source = Source::parse(&argument).map_err(|error| error.to_string())?;
        if matches!(&source, Source::File(path) if !path.exists()) {
            return Err(format!("{} is not there: see --meshes", argument.display()));
        }
        // Without a column of errors nothing is measured, without one of distances next to nothing.
        let samples = match exhibit.needs_evaluation() {
            true if exhibit.needs_samples() => self.samples,
            true => 1,
            false => 0,
        };
        let union_spacing = exhibit.needs_union().then_some(BALL_SPACING);
        let all = JudgeOptions::default();
        let volume_depth = if exhibit.needs_volume() { all.volume_depth } else { 0 };
        let measure = JudgeOptions { samples, volume_depth, ..all };
        let noise = |against| {
            let wanted = wanted.noise.filter(|noise| noise.against == against);
            wanted.map(|noise| Noise { eta: noise.eta, seed: noise.seed })
        };
        Ok(SceneSpec {
            mesh: source.name(),
            source,
            hash: None,
            scaled: Some(wanted.scale).filter(|&factor| factor != 1.0),
            displaced: noise(Against::Noisy),
            noise: noise(Against::Clean),
            sampling: wanted.sampling.parse().map_err(|error| format!("sampling: {error}"))?,
            dual: Dual::default(),
            measure: Measure { union_spacing, ..measure.into() },
        })
    }

    fn fill(
        &mut self,
        reproduced: &mut ReproducedRow,
        exhibit: &Exhibit,
        row: &Row,
        scene: &SceneSpec,
    ) -> Result<(), RunError> {
        let mut records: BTreeMap<&str, Option<Kept>> = BTreeMap::new();
        for column in &exhibit.columns {
            let name = column.run.as_str();
            if !records.contains_key(name) {
                let record = match exhibit.run(row, name) {
                    Some(run) => self.one_run(run, scene)?,
                    None => None,
                };
                if record.is_none() {
                    reproduced.remarks.push(format!("{name}: medial has no such method"));
                }
                records.insert(name, record);
            }
            let Some(kept) = &records[name] else { continue };
            if let Some(value) = column.read(&places(kept)) {
                reproduced.ours.insert(column.key.clone(), value);
            }
        }
        for (name, record) in records {
            let Some(Kept { record, .. }) = record else { continue };
            let why = record.reason.iter().map(|reason| format!("{name}: {reason}"));
            let warnings = record.simplify.warnings.iter().map(|w| format!("{name}: {w}"));
            reproduced.remarks.extend(why.chain(warnings));
        }
        Ok(())
    }

    fn one_run(&mut self, run: &Run, scene: &SceneSpec) -> Result<Option<Kept>, RunError> {
        let Some(entry) = self.registry.entry(&run.method) else { return Ok(None) };
        let item = Item {
            scene: scene.clone(),
            method: MethodSpec {
                id: run.method.clone(),
                name: None,
                params: run.params.clone(),
                fingerprint: entry.fingerprint().map(str::to_owned),
            },
            levels: vec![run.level],
            seed: 0,
            repeat: 1,
            threads: self.here.threads,
            limits: self.limits,
            binary: self.here.binary.clone(),
        };
        Ok(self.supervisor.run(&item)?.pop())
    }
}

/// The places that columns are read from: the record's own, and what is told of noise beside it.
fn places(kept: &Kept) -> Value {
    let mut places = json!(kept.record);
    places["noise"] = json!(kept.noise);
    places
}
