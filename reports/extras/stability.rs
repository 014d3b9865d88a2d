//! Stability under noise: results on noisy surfaces, measured against the clean one.

use std::collections::BTreeMap;
use std::path::Path;

use crate::Target;
use medial::metrics::AxisSpan;
use serde::{Deserialize, Serialize};

use super::{Extra, STABILITY, read_lines};
use crate::comparison::Comparison;
use crate::error::ReportError;
use crate::metric::{HAUSDORFF, MEAN_ERROR, Mean, Metric, SPIKE_RATIO, SPIKES};
use crate::plots::{NoiseCurve, against_noise};
use crate::record::Record;
use crate::tables::{Cell, Column, Row, Table};
use crate::text::{counted, grouped, significant};

/// One method at one level on one noisy surface: one line of `stability.jsonl`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NoiseRecord {
    /// Largest displacement of a vertex, as a fraction of the clean surface's diagonal; 0 for the
    /// clean surface itself.
    pub noise: f64,
    /// Seed of the displacements.
    pub noise_seed: u64,
    /// Spheres of the noisy initial medial mesh over those of the clean one.
    pub growth: Option<f64>,
    /// Distances to the same method's result on the clean surface at the same level.
    pub shift: Option<AxisShift>,
    /// The run; its `mesh` is the clean one and `evaluate` is against the clean surface (and its
    /// known axis, where there is one).
    pub record: Record,
}

/// Distances between the axis of a noisy surface ("computed") and that of the clean one ("true"),
/// as fractions of the clean surface's diagonal.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AxisShift {
    /// As sets of points in space.
    pub in_space: AxisSpan,
    /// As sets of points with radii.
    pub with_radius: AxisSpan,
}

impl NoiseRecord {
    /// The number of spheres that was asked, where the result has it to within 2 %.
    fn at_count(&self) -> Option<usize> {
        let Target::Spheres(asked) = self.record.simplify.level else { return None };
        let reached = self.record.simplify.reached?;
        let measured = self.record.status.has_result() && self.record.evaluate.is_some();
        let near = reached.abs_diff(asked) as f64 <= 0.02 * asked as f64;
        (measured && near).then_some(asked)
    }
}

/// The section; `None` without a record.
pub(super) fn section(dir: &Path) -> Result<Option<Extra>, ReportError> {
    let all: Vec<NoiseRecord> = read_lines(&dir.join(STABILITY))?;
    let Some(first) = all.first() else { return Ok(None) };
    let how = &super::made_by(&first.record.version, &first.record.command);
    let records: Vec<Record> = all.iter().map(|noisy| noisy.record.clone()).collect();
    // For the labels and colours of the methods: the clean runs, or what else there is.
    let comparison = Comparison::new(&records);
    let study = Study::new(&all, &comparison);
    let (meshes, seeds) = (comparison.meshes.len(), study.seeds());
    let text = format!(
        "Every vertex is displaced by a random vector, uniform in a ball whose radius is the noise, \
         in % of the diagonal. The results on {} of each noisy surface are measured against the \
         clean one. Shift: mean distance between the axis found on the noisy surface and the one \
         that the same method finds on the clean surface at the same number of spheres; a spike \
         makes only the way from noisy to clean large. Means over {}, geometric for distances.",
        counted(seeds, "random version", "random versions"),
        counted(meshes, "mesh", "meshes"),
    );
    let mut plots = Vec::new();
    for &count in &study.counts {
        let spheres = grouped(count as u64);
        for (name, title, y) in [
            (
                "hausdorff",
                "Hausdorff error to the clean surface",
                "Hausdorff error (% of diagonal)",
            ),
            ("shift", "shift of the axis, noisy to clean, mean", "mean distance (% of diagonal)"),
            ("spikes", "spikes", "spikes"),
        ] {
            let curves = study.curves(count, name);
            plots.extend(against_noise(
                format!("overview-noise-{name}-{count}"),
                format!("Noise, {spheres} spheres: {title}"),
                y,
                name == "spikes",
                curves,
            )?);
        }
    }
    Ok(Some(Extra {
        stem: "stability",
        title: "Stability under noise",
        text,
        tables: vec![study.table(how)],
        plots,
        mesh_plots: vec![],
    }))
}

/// Series, asked count, and noise in parts of a million of the diagonal: exact as a key.
type Key = (usize, usize, u64);

fn key_of(noise: f64) -> u64 {
    (noise * 1e6).round() as u64
}

struct Study<'a> {
    labels: Vec<String>,
    counts: Vec<usize>,
    cells: BTreeMap<Key, Vec<&'a NoiseRecord>>,
    /// How many runs were asked at each key.
    asked: BTreeMap<Key, usize>,
    all: &'a [NoiseRecord],
}

impl<'a> Study<'a> {
    fn new(all: &'a [NoiseRecord], comparison: &Comparison<'_>) -> Self {
        let mut study = Self {
            labels: comparison.series.clone(),
            counts: comparison.counts().map(|(_, count)| count).collect(),
            cells: BTreeMap::new(),
            asked: BTreeMap::new(),
            all,
        };
        for noisy in all {
            let simplify = &noisy.record.simplify;
            let series = comparison.series_of(&noisy.record);
            if let (Target::Spheres(count), Some(series)) = (simplify.level, series) {
                let key = (series, count, key_of(noisy.noise));
                *study.asked.entry(key).or_default() += 1;
                if noisy.at_count().is_some() {
                    study.cells.entry(key).or_default().push(noisy);
                }
            }
        }
        study
    }

    fn seeds(&self) -> usize {
        let mut seeds: Vec<u64> =
            self.all.iter().filter(|n| n.noise > 0.0).map(|n| n.noise_seed).collect();
        seeds.sort_unstable();
        seeds.dedup();
        seeds.len()
    }

    /// A mean at one key, where at least half of the runs have the number of spheres.
    fn mean(&self, key: Key, name: &str) -> Option<f64> {
        let runs = self.cells.get(&key)?;
        if 2 * runs.len() < *self.asked.get(&key)? {
            return None;
        }
        let metric = |metric: &'static Metric| move |n: &NoiseRecord| metric.of(&n.record);
        let shift = |of: fn(&AxisShift) -> f64| {
            move |n: &NoiseRecord| n.shift.as_ref().map(|shift| 100.0 * of(shift))
        };
        let geometric = Mean::Geometric { floor: 1e-6 };
        let mean = |mean: Mean, of: &dyn Fn(&NoiseRecord) -> Option<f64>| {
            let values: Vec<f64> = runs.iter().filter_map(|n| of(n)).collect();
            if values.len() == runs.len() { mean.of(&values) } else { None }
        };
        match name {
            "hausdorff" => mean(geometric, &metric(&HAUSDORFF)),
            "mean" => mean(geometric, &metric(&MEAN_ERROR)),
            "shift" => mean(geometric, &shift(|s| s.in_space.computed_to_true_mean)),
            "shift_back" => mean(geometric, &shift(|s| s.in_space.true_to_computed_mean)),
            "shift_4d" => mean(geometric, &shift(|s| s.with_radius.computed_to_true_mean)),
            "shift_back_4d" => mean(geometric, &shift(|s| s.with_radius.true_to_computed_mean)),
            "spikes" => mean(Mean::Arithmetic, &metric(&SPIKES)),
            "weak" => mean(Mean::Arithmetic, &|n| {
                let spikes = &n.record.evaluate.as_ref()?.spikes;
                let at =
                    spikes.by_ratio.iter().find(|s| (s.threshold - SPIKE_RATIO).abs() < 1e-9)?;
                Some(100.0 * at.edge_share)
            }),
            "idle" => mean(Mean::Arithmetic, &|n| {
                Some(n.record.evaluate.as_ref()?.spikes.idle_spheres as f64)
            }),
            _ => mean(geometric, &|n| n.growth),
        }
    }

    fn curves(&self, count: usize, name: &str) -> Vec<NoiseCurve> {
        let of_series = |series: usize| {
            let keys = self.asked.keys().filter(|key| (key.0, key.1) == (series, count));
            // The clean axis is no distance from itself.
            let keys = keys.filter(|key| key.2 > 0 || !name.starts_with("shift"));
            let point = |&key: &Key| Some((key.2 as f64 / 1e4, self.mean(key, name)?));
            (series, self.labels[series].clone(), keys.filter_map(point).collect::<Vec<_>>())
        };
        (0..self.labels.len()).map(of_series).filter(|curve| !curve.2.is_empty()).collect()
    }

    fn table(&self, how: &str) -> Table {
        const SHOWN: [(&str, &str); 10] = [
            ("growth", "initial spheres ×"),
            ("hausdorff", "Hausdorff (%) ↓"),
            ("mean", "mean error (%) ↓"),
            ("shift", "shift to clean (%) ↓"),
            ("shift_back", "clean to noisy (%) ↓"),
            ("shift_4d", "shift with radii (%) ↓"),
            ("shift_back_4d", "back with radii (%) ↓"),
            ("spikes", "spikes ↓"),
            ("weak", "weak edges (%) ↓"),
            ("idle", "idle spheres ↓"),
        ];
        let mut columns = vec![
            Column::number("spheres"),
            Column::text("method"),
            Column::number("noise (%)"),
            Column::text("runs"),
        ];
        columns.extend(SHOWN.map(|(_, title)| Column::number(title)));
        let mut keys: Vec<Key> = self.asked.keys().copied().collect();
        keys.sort_by_key(|&(series, count, noise)| (usize::MAX - count, series, noise));
        let mut last = None;
        let rows = keys.into_iter().map(|key| {
            let (series, count, noise) = key;
            let starts_group = last.replace((series, count)) != Some((series, count));
            let runs = self.cells.get(&key).map_or(0, Vec::len);
            let mut cells = vec![
                Cell::new(grouped(count as u64)),
                Cell::new(self.labels[series].as_str()),
                Cell::new(format!("{}", noise as f64 / 1e4)),
                Cell::new(format!("{runs} of {}", self.asked[&key])),
            ];
            let clean = noise == 0;
            cells.extend(SHOWN.map(|(name, _)| {
                let value = self.mean(key, name).filter(|_| !(clean && name.starts_with("shift")));
                Cell::optional(value.map(|value| significant(value, 3)))
            }));
            Row { cells, starts_group }
        });
        Table {
            caption: "Results on noisy surfaces against the clean one".to_owned(),
            notes: vec![
                how.to_owned(),
                "Noise 0 is the clean surface: its spikes are the floor above which noise adds. \
                 Runs: those that reached the number of spheres to within 2 %; no mean where less \
                 than half did. Lengths in % of the clean surface's diagonal. Weak edges: share of \
                 edges with a stability ratio below 0.1."
                    .to_owned(),
            ],
            rows: rows.collect(),
            columns,
        }
    }
}
