//! Baselines: surfaces that were decimated directly, beside the medial methods at as many stored
//! numbers.
//!
//! *Stored numbers* are floats: four for each sphere, three for each vertex of a surface. The
//! integers of the connectivity stand in the table beside them.

use std::collections::BTreeMap;
use std::path::Path;

use medial::metrics::SurfaceDistances;
use serde::{Deserialize, Serialize};

use super::{BASELINES, Extra, read_lines};
use crate::comparison::{Comparison, Entry, reached};
use crate::error::ReportError;
use crate::metric::{HAUSDORFF, MEAN_ERROR, Mean, Metric};
use crate::plots::{Plot, against_numbers};
use crate::summary::CountSummary;
use crate::tables::{Cell, Column, Row, Table};
use crate::text::{grouped, significant};

/// A decimated surface, measured against the mesh that it was made of: one line of
/// `baselines.jsonl`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Baseline {
    /// Name of the mesh.
    pub mesh: String,
    /// Its hash, as in the records of the comparison.
    pub mesh_hash: String,
    /// The program that made the surface, with its version.
    pub tool: String,
    /// Floats that were asked for; what came out is three for each of [`Baseline::vertices`].
    pub numbers_asked: usize,
    /// Vertices of the decimated surface.
    pub vertices: usize,
    /// Its triangles.
    pub faces: usize,
    /// Wall-clock seconds of the decimation, where the tool told them.
    #[serde(default)]
    pub seconds: Option<f64>,
    /// Distances as fractions of the diagonal of the input.
    pub distances: SurfaceDistances,
    /// Seed of the samples.
    pub seed: u64,
    /// The command line that measured it.
    #[serde(default)]
    pub command: String,
    /// Version of the program that measured it.
    #[serde(default)]
    pub version: String,
}

impl Baseline {
    /// Floats of the surface.
    pub fn numbers(&self) -> usize {
        3 * self.vertices
    }

    fn percent(&self, metric: &Metric) -> f64 {
        let distances = &self.distances;
        100.0 * if metric.key == HAUSDORFF.key { distances.hausdorff } else { distances.mean }
    }
}

/// Floats of a medial mesh.
pub(crate) fn medial_numbers(spheres: usize) -> usize {
    4 * spheres
}

/// The section; `None` without a baseline of a mesh of the comparison.
pub(super) fn section(
    dir: &Path,
    comparison: &Comparison<'_>,
    summaries: &[CountSummary],
) -> Result<Option<Extra>, ReportError> {
    let all: Vec<Baseline> = read_lines(&dir.join(BASELINES))?;
    let hash_of =
        |mesh: usize| comparison.of_mesh(mesh).find_map(|entry| entry.record.mesh_hash.as_deref());
    // Of several of one kind the last one counts. Those of other meshes are of no use here.
    let mut of_mesh: Vec<BTreeMap<usize, &Baseline>> =
        vec![BTreeMap::new(); comparison.meshes.len()];
    for (mesh, known) in of_mesh.iter_mut().enumerate() {
        let hash = hash_of(mesh);
        for baseline in all.iter().filter(|b| Some(b.mesh_hash.as_str()) == hash) {
            known.insert(baseline.numbers_asked, baseline);
        }
    }
    let Some(first) = of_mesh.iter().flat_map(BTreeMap::values).next() else { return Ok(None) };
    let tool = first.tool.clone();
    let how = &super::made_by(&first.version, &first.command);
    let label = "baseline: decimated mesh".to_owned();
    let mut plots = Vec::new();
    for metric in [&HAUSDORFF, &MEAN_ERROR] {
        let points = mean_points(&of_mesh, metric);
        plots.extend(against_numbers(comparison, None, summaries, metric, &label, points)?);
    }
    let mut mesh_plots = Vec::new();
    for (mesh, known) in of_mesh.iter().enumerate().filter(|(_, known)| !known.is_empty()) {
        let points = known.values().map(|b| (b.numbers() as f64, b.percent(&HAUSDORFF))).collect();
        let plot = against_numbers(comparison, Some(mesh), summaries, &HAUSDORFF, &label, points)?;
        mesh_plots.extend(plot.map(|plot: Plot| (mesh, plot)));
    }
    let text = format!(
        "Why not just decimate the surface? {tool} simplifies the surface itself by quadrics; its \
         result is measured by the same samples and definitions as the medial meshes. It is a \
         baseline, not a medial method: it has no spheres, no thickness and no skeleton. Stored \
         numbers are floats, four for each sphere and three for each vertex of a surface."
    );
    Ok(Some(Extra {
        stem: "baseline",
        title: "Baseline: the surface decimated",
        text,
        tables: vec![
            means_table(comparison, summaries, &of_mesh, &tool, how),
            per_mesh(comparison, &of_mesh, how),
        ],
        plots,
        mesh_plots,
    }))
}

/// The asked numbers that every mesh with a baseline has.
fn common_numbers(of_mesh: &[BTreeMap<usize, &Baseline>]) -> Vec<usize> {
    let with: Vec<_> = of_mesh.iter().filter(|known| !known.is_empty()).collect();
    let Some(first) = with.first() else { return Vec::new() };
    let everywhere = |asked: &&usize| with.iter().all(|known| known.contains_key(asked));
    first.keys().filter(everywhere).rev().copied().collect()
}

/// Geometric means over the meshes with a baseline, of an asked number: floats and error.
fn mean_at(of_mesh: &[BTreeMap<usize, &Baseline>], asked: usize, metric: &Metric) -> (f64, f64) {
    let at: Vec<&Baseline> =
        of_mesh.iter().filter_map(|known| known.get(&asked).copied()).collect();
    let mean = |of: &dyn Fn(&Baseline) -> f64| {
        let values: Vec<f64> = at.iter().map(|b| of(b)).collect();
        Mean::Geometric { floor: 1e-6 }.of(&values).unwrap_or(f64::NAN)
    };
    (mean(&|b| b.numbers() as f64), mean(&|b| b.percent(metric)))
}

fn mean_points(of_mesh: &[BTreeMap<usize, &Baseline>], metric: &Metric) -> Vec<(f64, f64)> {
    common_numbers(of_mesh).into_iter().map(|asked| mean_at(of_mesh, asked, metric)).collect()
}

/// Means at equal numbers: the medial methods, and the baseline below them.
fn means_table(
    comparison: &Comparison<'_>,
    summaries: &[CountSummary],
    of_mesh: &[BTreeMap<usize, &Baseline>],
    tool: &str,
    how: &str,
) -> Table {
    let with = of_mesh.iter().filter(|known| !known.is_empty()).count();
    let row = |numbers: usize, kind: &str, name: &str, meshes: usize, errors: [Option<f64>; 2]| {
        let mut cells = vec![
            Cell::new(grouped(numbers as u64)),
            Cell::new(kind),
            Cell::new(name),
            Cell::new(meshes.to_string()),
        ];
        cells.extend(errors.map(|e| Cell::optional(e.map(|e| significant(e, 3)))));
        Row { cells, starts_group: false }
    };
    let mut groups: BTreeMap<usize, Vec<Row>> = BTreeMap::new();
    for summary in summaries {
        let numbers = medial_numbers(summary.count);
        for series in summary.rows.iter().filter(|series| series.over > 0) {
            let errors = [series.mean(&HAUSDORFF), series.mean(&MEAN_ERROR)];
            let name = &comparison.series[series.series];
            let new = row(numbers, "medial method", name, series.over, errors);
            groups.entry(numbers).or_default().push(new);
        }
    }
    for asked in common_numbers(of_mesh) {
        let errors = [&HAUSDORFF, &MEAN_ERROR].map(|m| Some(mean_at(of_mesh, asked, m).1));
        groups.entry(asked).or_default().push(row(asked, "baseline", tool, with, errors));
    }
    let mut rows = Vec::new();
    for mut group in groups.into_values().rev() {
        if let Some(first) = group.first_mut() {
            first.starts_group = true;
        }
        rows.extend(group);
    }
    Table {
        caption: "Baseline: means at equal stored numbers".to_owned(),
        notes: vec![
            how.to_owned(),
            "Geometric means, lengths in % of the bounding-box diagonal. Stored numbers: four for \
             each sphere, three for each vertex of a decimated surface. Each row is averaged over as \
             many meshes as it says: compare rows with the same number of meshes."
                .to_owned(),
        ],
        columns: vec![
            Column::number("stored numbers"),
            Column::text("kind"),
            Column::text("what"),
            Column::number("meshes"),
            Column::number(HAUSDORFF.heading()),
            Column::number(MEAN_ERROR.heading()),
        ],
        rows,
    }
}

/// For each mesh and number the baseline beside the medial method with the lowest error.
fn per_mesh(
    comparison: &Comparison<'_>,
    of_mesh: &[BTreeMap<usize, &Baseline>],
    how: &str,
) -> Table {
    let mut rows = Vec::new();
    for (mesh, known) in of_mesh.iter().enumerate() {
        for (index, (&asked, baseline)) in known.iter().rev().enumerate() {
            let best = best_medial(comparison, mesh, asked);
            let optional =
                |of: &dyn Fn(&Entry<'_>) -> Option<String>| Cell::optional(best.and_then(of));
            let indices = |entry: &Entry<'_>| {
                let counts = entry.record.evaluate.as_ref()?.counts;
                Some(grouped((counts.bytes() - 8 * counts.numbers()) / 4))
            };
            let error = |metric: &'static Metric| {
                move |entry: &Entry<'_>| metric.of(entry.record).map(|e| significant(e, 3))
            };
            rows.push(Row {
                cells: vec![
                    Cell::new(comparison.meshes[mesh].as_str()),
                    Cell::new(grouped(asked as u64)),
                    Cell::new(grouped(baseline.numbers() as u64)),
                    Cell::new(grouped(3 * baseline.faces as u64)),
                    Cell::new(significant(baseline.percent(&HAUSDORFF), 3)),
                    Cell::new(significant(baseline.percent(&MEAN_ERROR), 3)),
                    optional(&|entry| Some(comparison.series[entry.series].clone())),
                    optional(&|e| reached(e.record).map(|n| grouped(medial_numbers(n) as u64))),
                    optional(&indices),
                    optional(&error(&HAUSDORFF)),
                    optional(&error(&MEAN_ERROR)),
                ],
                starts_group: index == 0,
            });
        }
    }
    let titles = [
        "mesh",
        "numbers asked",
        "baseline: numbers",
        "indices",
        "Hausdorff (%) ↓",
        "mean (%) ↓",
        "best medial method",
        "numbers",
        "indices",
        "Hausdorff (%) ↓",
        "mean (%) ↓",
    ];
    let column = |(index, title): (usize, &str)| match index {
        0 | 6 => Column::text(title),
        _ => Column::number(title),
    };
    Table {
        caption: "Baseline beside the best medial method, mesh by mesh".to_owned(),
        notes: vec![
            how.to_owned(),
            "Best: the lowest Hausdorff error at as many stored numbers (to within 2 %). Indices: \
             integers of the connectivity, three for each triangle, two for each edge without one."
                .to_owned(),
        ],
        columns: titles.into_iter().enumerate().map(column).collect(),
        rows,
    }
}

fn best_medial<'e, 'a>(
    comparison: &'e Comparison<'a>,
    mesh: usize,
    numbers: usize,
) -> Option<&'e Entry<'a>> {
    let at = |entry: &&Entry<'_>| {
        let level = entry.record.simplify.level;
        let asked = matches!(level, crate::Target::Spheres(n) if medial_numbers(n) == numbers);
        asked && entry.comparable()
    };
    let error = |entry: &Entry<'_>| HAUSDORFF.of(entry.record).unwrap_or(f64::INFINITY);
    comparison.of_mesh(mesh).filter(at).min_by(|a, b| error(a).total_cmp(&error(b)))
}
