//! `medial evaluate MESH X.ma [Y.ma ...]`: every metric of medial meshes from anywhere.

use std::path::{Path, PathBuf};

use clap::Args;
use medial::complex::LoadedMa;
use medial::metrics::{Evaluation, MetricError, Witness, WitnessSide};
use medial::shape::{Fit, ShapeOptions};
use medial_reports::{BRIEF, MeasuredRow, measured_rows};
use medial_run::axis::read_axis;
use medial_run::evaluate::Evaluator;
use medial_run::text::{aligned, significant};
use serde::Serialize;
use serde_json::json;

use crate::args::{AxisArguments, Global, MeasureArguments, MeshArgument};
use crate::exit::{Exit, Failure};
use crate::files::shape_of;
use crate::output::{counted, note, print_error, print_json, print_line, print_result};
use crate::progress::StageLine;

#[derive(Debug, Args)]
pub struct Arguments {
    /// Surface file (OFF, OBJ, PLY, STL), `builtin:ID[:RESOLUTION]` or `dataset:NAME`.
    mesh: MeshArgument,
    /// Medial meshes (.ma and its dialects, or .ply or .obj with radii), or lists of spheres (.csv, .json, .yaml, .xrdf,
    /// .urdf, .xml, .txt), in the units of the surface.
    /// Several files give one table.
    #[arg(required = true, value_name = "X.ma")]
    axes: Vec<PathBuf>,
    #[command(flatten)]
    fitting: AxisArguments,
    /// Set the seed of the samples.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Certify the Hausdorff distance and the one-sided errors by intervals of at most this width, as a fraction of the
    /// diagonal. `uncovered` is the largest distance from a point of the solid to the union, and `overshoot` from a
    /// point of the union to the solid. Spheres without edges always have them [default: 0.001]. `surface to union,
    /// max` is neither: it measures to the boundary of the union, from both of its sides.
    #[arg(long, value_name = "TOL")]
    certify: Option<f64>,
    /// Measure the spheres alone, without edges and faces.
    #[arg(long)]
    spheres_alone: bool,
    /// Print all metrics; `--reference` does, too.
    #[arg(long)]
    all: bool,
    /// Compare with this medial mesh, such as a dense axis of the surface or a known skeleton: the distances both ways as sets
    /// of points, the chamfer distance, and the sheets.
    #[arg(long, value_name = "X.ma")]
    reference: Option<PathBuf>,
    #[command(flatten)]
    measure: MeasureArguments,
}

/// Runs the verb. With several files, a file that cannot be read is reported and the others are evaluated. Fails when
/// the surface or the only medial mesh is refused.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Exit, Failure> {
    let options = arguments.measure.judge_options(arguments.seed);
    let line = global.stages();
    line.at("reading");
    let (input, shape) = shape_of(&arguments.mesh, ShapeOptions::default(), false)?;
    line.at("preparing the surface");
    let judge = shape
        .judge(input.axis.as_ref(), options)
        .map_err(|error| Failure::at(&arguments.mesh, error))?;
    let reference = match &arguments.reference {
        Some(path) => Some(read_axis(path, &shape, arguments.fitting.into())?.0.mesh),
        None => None,
    };
    let evaluator = Evaluator {
        shape: &shape,
        judge: &judge,
        certify: arguments.certify,
        spheres_alone: arguments.spheres_alone,
        reference: reference.as_ref(),
    };
    let rows = arguments.axes.iter().map(|path| evaluate(path, arguments, &evaluator, &line));
    let mut rows: Vec<_> = rows.collect();
    drop(line);
    let warnings = &shape.remarks();
    // One file keeps the exit codes and the object of a single evaluation.
    if rows.len() == 1 {
        let row = rows.remove(0)?;
        row.notes.iter().for_each(|line| note(global, line));
        let warnings = [&row.defects[..], warnings].concat();
        let text =
            described(&row.evaluation, shape.normalisation().diagonal, arguments.is_complete());
        let all = [&row.evaluation.warnings[..], &warnings].concat();
        return Ok(print_result(global, &row, &text, &all));
    }
    let refused = rows.iter().filter(|row| row.is_err()).count();
    print_table(arguments, &rows, warnings, global);
    Ok(match refused {
        0 => Exit::Done,
        _ if refused == rows.len() => Exit::Input,
        _ => Exit::SomeFailed,
    })
}

impl Arguments {
    /// Whether all metrics are printed: those of a reference are not among the usual ones.
    fn is_complete(&self) -> bool {
        self.all || self.reference.is_some()
    }
}

/// One medial mesh against the surface.
#[derive(Serialize)]
struct Evaluated {
    #[serde(flatten)]
    evaluation: Evaluation,
    /// The change of units before the evaluation, if `--fit` found one.
    #[serde(skip_serializing_if = "Option::is_none")]
    fit: Option<Fit>,
    /// Notes of the reader.
    // Not in JSON, because no number depends on them.
    #[serde(skip)]
    notes: Vec<String>,
    /// Defects of the file.
    #[serde(skip)]
    defects: Vec<String>,
}

fn evaluate(
    path: &Path,
    arguments: &Arguments,
    evaluator: &Evaluator<'_>,
    line: &StageLine,
) -> Result<Evaluated, Failure> {
    let failed = |error: MetricError| match error {
        MetricError::Tolerance(_) | MetricError::TooFine { .. } => {
            Failure::usage(format!("--certify: {error}"))
        }
        MetricError::NoArea | MetricError::NoVolume(_) => Failure::at(&arguments.mesh, error),
        _ => Failure::at(path, error),
    };
    line.at(format!("measuring {}", path.display()));
    let (loaded, fit) = read_axis(path, evaluator.shape, arguments.fitting.into())?;
    let LoadedMa { mesh, notes, warnings: defects, .. } = loaded;
    let evaluation = evaluator.evaluate(&mesh).map_err(failed)?;
    Ok(Evaluated { evaluation, fit, notes, defects })
}

/// The evaluations next to each other: a row for each metric, a column for each file.
fn print_table(
    arguments: &Arguments,
    rows: &[Result<Evaluated, Failure>],
    warnings: &[String],
    global: &Global,
) {
    let (files, all) = (&arguments.axes, arguments.is_complete());
    for failure in rows.iter().filter_map(|row| row.as_ref().err()) {
        print_error(&format!("medial: {}", failure.message));
    }
    if global.json {
        let files: Vec<_> = (files.iter().zip(rows))
            .map(|(file, row)| match row {
                Ok(row) => {
                    let mut object = json!(row);
                    object["file"] = json!(file);
                    if let Some(all) = object["warnings"].as_array_mut() {
                        all.extend(row.defects.iter().map(|defect| json!(defect)));
                    }
                    object
                }
                Err(failure) => json!({ "file": file, "refused": failure.message }),
            })
            .collect();
        print_json(&json!({ "files": files }), warnings);
        return;
    }
    let measured =
        files.iter().zip(rows).filter_map(|(file, row)| Some((file, row.as_ref().ok()?)));
    let measured: Vec<(&PathBuf, &Evaluated)> = measured.collect();
    let name = |file: &Path| file.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let evaluations: Vec<&Evaluation> = measured.iter().map(|(_, row)| &row.evaluation).collect();
    let row = |title: &str, cell: fn(&Evaluation) -> String| -> (String, Vec<String>) {
        (title.to_owned(), evaluations.iter().map(|evaluation| cell(evaluation)).collect())
    };
    let mut table = vec![
        (String::new(), measured.iter().map(|(file, _)| name(file)).collect()),
        row("spheres", |e| e.counts.spheres.to_string()),
        row("edges", |e| e.counts.edges.to_string()),
        row("faces", |e| e.counts.faces.to_string()),
        row("Betti numbers", |e| format!("{:?}", e.betti)),
    ];
    if evaluations.iter().any(|evaluation| evaluation.structure.is_some()) {
        table.push(row("sheets / seams / junctions", |e| {
            let graph = e.structure.as_ref().map(|structure| &structure.graph);
            let words = graph.map(|g| format!("{} / {} / {}", g.sheets, g.seams, g.junctions));
            words.unwrap_or_default()
        }));
    }
    let is_shown = |key| all || BRIEF.iter().any(|(_, keys)| keys.contains(&key));
    let rows = measured_rows(&evaluations).into_iter().filter(|row| is_shown(row.key));
    table.extend(rows.map(|MeasuredRow { title, cells, .. }| (title, cells)));
    let lines = table.into_iter().map(|(title, cells)| [vec![title], cells].concat());
    print_line(aligned(&lines.collect::<Vec<_>>(), |k| k > 0).trim_end());
    for (file, row) in measured {
        for warning in row.evaluation.warnings.iter().chain(&row.defects) {
            print_line(&format!("warning: {}: {warning}", file.display()));
        }
    }
    warnings.iter().for_each(|warning| print_line(&format!("warning: {warning}")));
}

/// Some metrics in groups, or `all`, lengths in percent of the diagonal and in the unit of the mesh.
fn described(evaluation: &Evaluation, diagonal: f64, all: bool) -> String {
    let counts = &evaluation.counts;
    let mut text = format!(
        "{}, {} ({} without a face), {}",
        counted(counts.spheres, "sphere"),
        counted(counts.edges, "edge"),
        counts.lone_edges,
        counted(counts.faces, "face")
    );
    let line = |name: &str, value: &str| format!("\n  {name:<32} {value}");
    let betti = match evaluation.expected_betti {
        Some(expected) => format!("{:?} (the solid's: {expected:?})", evaluation.betti),
        None => format!("{:?}", evaluation.betti),
    };
    let witness = evaluation.certified.map(|certified| {
        let Witness { point, on } = certified.witness;
        let on = match on {
            WitnessSide::Surface => "surface",
            WitnessSide::Union => "union",
        };
        let [x, y, z] = point.to_array().map(|x| significant(x, 4));
        format!("on the {on}: {x} {y} {z}")
    });
    let rows = measured_rows(&[evaluation]);
    let cells = |row: &MeasuredRow| match row.lengths[0] {
        Some(length) => format!("{:<10} {}", row.cells[0], significant(length * diagonal, 4)),
        None => row.cells[0].clone(),
    };
    if !all {
        text += &line("Betti numbers", &betti);
        for (group, keys) in BRIEF {
            text += &format!("\n  {group}");
            let shown = rows.iter().filter(|row| keys.contains(&row.key));
            shown.for_each(|row| text += &line(&format!("  {}", row.title), &cells(row)));
        }
        if let Some(witness) = witness {
            text += &line("farthest point", &witness);
        }
        return text + "\n  all metrics: --all";
    }
    text += &line("lengths", "%          unit of the mesh");
    let mut add = |name: &str, value: &str| text += &line(name, value);
    rows.iter().for_each(|row| add(&row.title, &cells(row)));
    add("Betti numbers", &betti);
    if let Some(structure) = &evaluation.structure {
        add("structure", &structure.graph.to_string());
        if let Some(known) = &structure.known {
            let (matched, missing, spurious) = (known.matched, known.missing, known.spurious);
            let text = format!("{matched} matched, {missing} missing, {spurious} spurious");
            add("sheets compared", &text);
        }
    }
    if let Some(witness) = witness {
        add("farthest point", &witness);
    }
    text
}
