//! `medial convergence [SHAPE ...]`: computed axes against known ones, at finer and finer resolutions.
//!
//! For each shape, kind of noise and resolution three sets of spheres are measured against the known axis, both
//! ways: the inner poles, the initial medial mesh, and what a filter leaves of it at its published level. Resolutions
//! grow by the square root of 2, so vertices double. `medial_reports` fits the orders and writes the table.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use clap::Args;
use medial::complex::MedialMesh;
use medial::metrics::{AxisOptions, axis_distance};
use medial::shape::{Shape, ShapeOptions};
use medial::simplifier::{Level, MedialSimplifier, Params, RunContext};
use medial::surface::{TriMesh, TriangleBvh, validate};
use medial_datasets::{BuiltIn, KnownAxis, MAX_RESOLUTION, NoiseKind};
use medial_reports::{AxisSet, ConvergenceRecord, ConvergenceReport, FAR, convergence_report};
use serde_json::json;

use crate::args::{Global, params};
use crate::exit::{Exit, Failure};
use crate::interrupt;
use crate::output::{print_error, print_json, print_line};
use crate::run::{Progress, Registry};

/// Arguments of `convergence`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Ids of built-in shapes [default: all with a known axis].
    shapes: Vec<String>,
    /// Resolutions of each shape, from half its default one on; each has twice the vertices of the one before.
    #[arg(long, value_name = "N", default_value_t = 5)]
    levels: usize,
    /// Kinds of noise, separated by commas: `none`, `isotropic`, `normal`, `dropped`.
    #[arg(long, value_name = "KINDS", value_delimiter = ',', default_values = ["none", "isotropic", "normal", "dropped"])]
    noise: Vec<String>,
    /// The largest displacement of `isotropic` and `normal`, as a fraction of the diagonal.
    #[arg(long, value_name = "FRACTION", default_value_t = 0.001)]
    magnitude: f64,
    /// The share of vertices that `dropped` removes.
    #[arg(long, value_name = "SHARE", default_value_t = 0.3)]
    dropped: f64,
    /// The filter, at its published level.
    #[arg(long, value_name = "ID", default_value = "angle")]
    filter: String,
    /// Set a parameter of the filter; can be given several times.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Samples on the triangles of each axis, and as many on its lone edges.
    #[arg(long, value_name = "N", default_value_t = 20_000)]
    samples: usize,
    /// Seed of the noise and of the samples.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Folder of `convergence.md`, `.csv`, `.json` and the plots.
    #[arg(long, value_name = "DIR", default_value = "medial-convergence")]
    out: PathBuf,
}

/// Fewer resolutions have no order; more have more vertices than a machine holds.
const LEVELS: std::ops::RangeInclusive<usize> = 3..=10;
/// More samples than this are taken for a slip.
const MOST_SAMPLES: usize = 10_000_000;

/// Runs the verb.
///
/// # Errors
/// When the command line is wrong, a shape has no known axis, a surface cannot be made or measured, or the folder
/// cannot be written.
pub fn run(arguments: &Arguments, global: &Global, registry: &Registry) -> Result<Exit, Failure> {
    let study = Convergence::new(arguments, registry)?;
    let runs = study.runs();
    fs::create_dir_all(&arguments.out).map_err(|error| unwritten(&arguments.out, &error))?;
    let interrupted = interrupt::listen();
    let mut progress = Progress::new(global.progress(), runs.len());
    let mut records = Vec::new();
    for run in &runs {
        if interrupted.load(Ordering::Relaxed) {
            drop(progress);
            print_error("interrupted: nothing was written");
            return Ok(Exit::Interrupted);
        }
        progress.at(&run.name());
        records.extend(study.records(run)?);
        progress.done();
    }
    drop(progress);
    let report = convergence_report(&records, &study.command()).map_err(Failure::input)?;
    write(&arguments.out, &records, &report)?;
    if global.json {
        let object = json!({ "records": records, "fits": report.fits, "out": arguments.out });
        print_json(&object, &[]);
    } else {
        print_line(&report.markdown);
        print_line(&format!("written: {}", arguments.out.display()));
    }
    Ok(Exit::Done)
}

/// One surface of one shape.
struct Run {
    shape: BuiltIn,
    /// `None` without noise.
    noise: Option<NoiseKind>,
    level: usize,
    resolution: u32,
}

impl Run {
    fn noise_name(&self) -> String {
        self.noise.map_or_else(|| "none".to_owned(), |kind| kind.to_string())
    }

    fn name(&self) -> String {
        format!("{}:{} {}", self.shape.id, self.resolution, self.noise_name())
    }

    fn failed(&self, why: impl ToString) -> Failure {
        Failure::input(format!("{}: {}", self.name(), why.to_string()))
    }
}

/// What is asked for, checked.
struct Convergence<'a> {
    arguments: &'a Arguments,
    shapes: Vec<BuiltIn>,
    noises: Vec<Option<NoiseKind>>,
    filter: &'a dyn MedialSimplifier,
    params: Params,
}

impl<'a> Convergence<'a> {
    fn new(arguments: &'a Arguments, registry: &'a Registry) -> Result<Self, Failure> {
        let Arguments { levels, magnitude, dropped, samples, .. } = *arguments;
        if !LEVELS.contains(&levels) {
            let (least, most) = (LEVELS.start(), LEVELS.end());
            return Err(Failure::usage(format!("--levels {levels}: ask for {least} to {most}")));
        }
        if !(1..=MOST_SAMPLES).contains(&samples) {
            let message = format!("--samples {samples}: ask for 1 to {MOST_SAMPLES} samples");
            return Err(Failure::usage(message));
        }
        for (name, value) in [("magnitude", magnitude), ("dropped", dropped)] {
            if !(0.0..=1.0).contains(&value) {
                return Err(Failure::usage(format!("--{name} {value}: a fraction from 0 to 1")));
            }
        }
        let noise = |text: &String| match text.as_str() {
            "none" => Ok(None),
            kind => kind.parse().map(Some).map_err(|error| {
                Failure::usage(format!("--noise: {error}, or none for the surface as it is"))
            }),
        };
        let entry = registry.entry(&arguments.filter).ok_or_else(|| {
            let filter = &arguments.filter;
            Failure::usage(format!("--filter {filter}: no such method; `medial methods` lists all"))
        })?;
        Ok(Self {
            arguments,
            shapes: chosen(&arguments.shapes)?,
            noises: arguments.noise.iter().map(noise).collect::<Result<_, _>>()?,
            filter: entry.method(),
            params: params(&arguments.set)?,
        })
    }

    /// The command that would do the same, without where it writes.
    fn command(&self) -> String {
        let Arguments { levels, magnitude, dropped, filter, samples, seed, .. } = self.arguments;
        let words = [
            vec!["medial convergence".to_owned()],
            self.arguments.shapes.clone(),
            vec![
                format!("--levels {levels} --noise {}", self.arguments.noise.join(",")),
                format!("--magnitude {magnitude} --dropped {dropped} --filter {filter}"),
            ],
            self.arguments.set.iter().map(|set| format!("--set {set}")).collect(),
            vec![format!("--samples {samples} --seed {seed}")],
        ];
        words.concat().join(" ")
    }

    fn runs(&self) -> Vec<Run> {
        let mut runs = Vec::new();
        for shape in &self.shapes {
            for &noise in &self.noises {
                runs.extend((0..self.arguments.levels).map(|level| Run {
                    shape: shape.clone(),
                    noise,
                    level,
                    resolution: resolution(shape, level),
                }));
            }
        }
        runs
    }

    fn magnitude(&self, noise: Option<NoiseKind>) -> f64 {
        match noise {
            None => 0.0,
            Some(NoiseKind::Dropped) => self.arguments.dropped,
            Some(NoiseKind::Isotropic | NoiseKind::Normal) => self.arguments.magnitude,
        }
    }

    /// The records of all three sets on one surface.
    fn records(&self, run: &Run) -> Result<Vec<ConvergenceRecord>, Failure> {
        let failed = |error: &dyn std::fmt::Display| run.failed(error);
        let (magnitude, seed) = (self.magnitude(run.noise), self.arguments.seed);
        let mut mesh = run.shape.mesh(run.resolution);
        if let Some(kind) = run.noise {
            mesh = medial_datasets::noisy(&mesh, kind, magnitude, seed).map_err(|e| failed(&e))?;
        }
        let report = validate(&mesh).map_err(|e| failed(&e))?;
        let shape = Shape::new(run.name(), &mesh, report, ShapeOptions::default());
        let shape = shape.map_err(|e| failed(&e))?;
        let axis = run.shape.axis().ok_or_else(|| run.failed("no known axis"))?;
        let truth = Truth::new(&axis, &shape).map_err(|e| failed(&e))?;
        let options = AxisOptions { samples: self.arguments.samples, seed };
        let mut records = Vec::new();
        for set in AxisSet::ALL {
            let computed = self.computed(set, &shape).map_err(|e| failed(&e))?;
            let distances =
                axis_distance(&computed, &truth.mesh, &options).map_err(|e| failed(&e))?;
            records.push(ConvergenceRecord {
                shape: run.shape.id.to_owned(),
                noise: run.noise_name(),
                magnitude,
                seed,
                level: run.level,
                resolution: run.resolution,
                vertices: mesh.vertices.len(),
                edge: mean_edge(shape.mesh()),
                set,
                spheres: computed.spheres.len(),
                tolerance: truth.tolerance,
                in_space: distances.in_space,
                with_radius: distances.with_radius,
                far_share: truth.far_share(&computed),
            });
        }
        Ok(records)
    }

    /// A set of spheres, in the unit of the shape.
    fn computed(&self, set: AxisSet, shape: &Shape) -> Result<MedialMesh, String> {
        let told = |error: &dyn std::fmt::Display| error.to_string();
        match set {
            AxisSet::Poles => {
                let balls = shape.inner_balls().map_err(|e| told(&e))?;
                MedialMesh::from_simplices(balls.spheres.clone(), vec![], vec![])
                    .map_err(|e| told(&e))
            }
            AxisSet::Voronoi => Ok((*shape.voronoi().map_err(|e| told(&e))?).clone()),
            AxisSet::Filtered => {
                let run = RunContext::default();
                let levels = self.filter.prepare(shape, &self.params, &run);
                let result = levels.and_then(|mut levels| levels.at(Level::Published));
                let mesh = result.map_err(|e| told(&e))?.mesh;
                match mesh.spheres.is_empty() {
                    true => Err("the filter leaves nothing".to_owned()),
                    false => Ok(mesh),
                }
            }
        }
    }
}

/// The shapes that are asked for.
fn chosen(ids: &[String]) -> Result<Vec<BuiltIn>, Failure> {
    if ids.is_empty() {
        let all = medial_datasets::catalogue().into_iter();
        return Ok(all.filter(|shape| shape.axis().is_some()).collect());
    }
    let shape = |id: &String| {
        let shape = medial_datasets::find(id).ok_or_else(|| {
            Failure::usage(format!("`{id}` is no built-in shape; `medial datasets list` lists all"))
        })?;
        match shape.axis() {
            Some(_) => Ok(shape),
            None => Err(Failure::usage(format!(
                "the axis of `{id}` is not known; see `medial datasets list`"
            ))),
        }
    };
    ids.iter().map(shape).collect()
}

/// From half the default resolution on, each the square root of 2 finer.
fn resolution(shape: &BuiltIn, level: usize) -> u32 {
    let coarsest = shape.min_resolution.max(shape.default_resolution / 2);
    let finer = f64::from(coarsest) * 2f64.powf(level as f64 / 2.0);
    (finer.round() as u32).min(MAX_RESOLUTION)
}

/// The known axis in the unit of a shape, prepared to be measured against.
struct Truth {
    mesh: MedialMesh,
    tolerance: f64,
    tree: TriangleBvh,
}

impl Truth {
    fn new(axis: &KnownAxis, shape: &Shape) -> Result<Self, String> {
        let to_normal = shape.normalisation();
        let mesh = axis.mesh.transformed(1.0 / to_normal.diagonal, |p| to_normal.forward(p));
        let at = |v: u32| mesh.spheres[v as usize].centre;
        // Segments and points as triangles without area.
        let faces = mesh.faces.iter().map(|face| face.map(at));
        let edges = mesh.edges.iter().map(|&[a, b]| [a, b, b].map(at));
        let points = mesh.spheres.iter().map(|sphere| [sphere.centre; 3]);
        let triangles: Vec<_> = faces.chain(edges).chain(points).collect();
        let tree = TriangleBvh::from_triangles(&triangles).map_err(|error| error.to_string())?;
        Ok(Self { tolerance: axis.tolerance / to_normal.diagonal, mesh, tree })
    }

    fn far_share(&self, computed: &MedialMesh) -> f64 {
        let centres: Vec<_> = computed.spheres.iter().map(|sphere| sphere.centre).collect();
        let far = self.tree.distance_batch(&centres).into_iter().filter(|&away| away > FAR).count();
        far as f64 / centres.len() as f64
    }
}

/// Mean over the sides of all faces.
fn mean_edge(mesh: &TriMesh) -> f64 {
    let perimeter = |face: usize| {
        let [a, b, c] = mesh.triangle(face);
        a.distance(b) + b.distance(c) + c.distance(a)
    };
    (0..mesh.faces.len()).map(perimeter).sum::<f64>() / (3 * mesh.faces.len()) as f64
}

fn write(
    folder: &Path,
    records: &[ConvergenceRecord],
    report: &ConvergenceReport,
) -> Result<(), Failure> {
    let object = json!({ "records": records, "fits": report.fits });
    let json = serde_json::to_vec_pretty(&object).expect("plain data");
    let markdown = report.markdown.clone().into_bytes();
    let mut files = vec![
        ("convergence.json".to_owned(), json),
        ("convergence.csv".to_owned(), report.csv.clone()),
        ("convergence.md".to_owned(), markdown),
    ];
    let plots = report.plots.iter();
    files.extend(plots.map(|(stem, svg)| (format!("{stem}.svg"), svg.clone().into_bytes())));
    for (name, content) in files {
        let path = folder.join(name);
        medial::write_atomically(&path, |out| out.write_all(&content))
            .map_err(|error| unwritten(&path, &error))?;
    }
    Ok(())
}

fn unwritten(path: &Path, error: &std::io::Error) -> Failure {
    Failure::input(format!("{}: {error}", path.display()))
}
