//! `medial evaluate --compat`: numbers by the definitions of other papers, beside the evaluation and never in it.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use medial::complex::{self, MedialMesh, union_surface};
use medial::metrics::compat::{
    TwoSided, ca_vertex_distances, matstruct_quality, p2s_mat, p2s_recon, p2s_sample_skeleton,
};
use medial::surface::{Sampling, TriMesh, sample};
use serde_json::{Map, Value, json};

use crate::exit::Failure;
use crate::output::print_line;
use crate::run::Input;

/// Which numbers of other papers are wanted.
#[derive(Debug, Args)]
pub struct CompatArguments {
    /// Also by the definitions of other papers, for comparison with their tables (docs/other-metrics.md): in a
    /// section of its own, never in the other numbers. Several with commas, or given several times.
    #[arg(long, value_enum, value_delimiter = ',', value_name = "PAPER")]
    compat: Vec<Paper>,
    /// Reference medial mesh for `p2s_cd_mat` and `p2s_hd_mat` [default: the known axis of a built-in shape].
    #[arg(long, value_name = "FILE", requires = "compat")]
    compat_reference: Option<PathBuf>,
}

/// Papers whose measures are computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Paper {
    /// Distances between vertices of the surface and of the reconstruction.
    CoverageAxis,
    /// CD-Recon, HD-Recon, and with a reference CD-MAT, HD-MAT.
    Point2skeleton,
    /// Triangle quality.
    Matstruct,
}

/// How far a reconstruction may be from the boundary of the union, as a fraction of the diagonal.
const TOLERANCE: f64 = 0.01;

/// Points of the surface and spheres of the skeleton, unless `--samples` says otherwise.
const SAMPLES: usize = 10_000;

/// Makes the points differ from those of `--sampling uniform` with the same seed, where a medial mesh has no error.
const STREAM: u64 = 0x636f_6d70_6174_2121;

/// What is measured: everything in input units.
struct Subject<'a> {
    surface: &'a TriMesh,
    /// Longest side and diagonal of the surface's bounding box.
    units: [f64; 2],
    mesh: &'a MedialMesh,
    reference: Option<&'a MedialMesh>,
    samples: usize,
    seed: u64,
}

/// A section for each paper: what was compared, and the numbers.
pub struct Compat(Vec<(&'static str, Map<String, Value>)>);

impl CompatArguments {
    /// The numbers that are asked for; `samples` as given on the command line.
    ///
    /// # Errors
    /// When the reference cannot be read, or the union has no boundary to be compared.
    pub fn measure(
        &self,
        input: &Input,
        mesh: &MedialMesh,
        samples: Option<usize>,
        seed: u64,
    ) -> Result<Compat, Failure> {
        if self.compat.is_empty() {
            return Ok(Compat(Vec::new()));
        }
        let read = |path: &PathBuf| complex::read(path).map(|loaded| loaded.mesh);
        let read = self.compat_reference.as_ref().map(read).transpose().map_err(Failure::input)?;
        let (lo, hi) = input.mesh.bounding_box().unwrap_or_default();
        let subject = Subject {
            surface: &input.mesh,
            units: [(hi - lo).max_element(), (hi - lo).length()],
            mesh,
            reference: read.as_ref().or(input.axis.as_ref()),
            samples: samples.unwrap_or(SAMPLES),
            seed,
        };
        let mut sections = Vec::new();
        for (paper, name) in [
            (Paper::CoverageAxis, "coverage_axis"),
            (Paper::Point2skeleton, "point2skeleton"),
            (Paper::Matstruct, "matstruct"),
        ] {
            if self.compat.contains(&paper) {
                let section = match paper {
                    Paper::CoverageAxis => subject.coverage_axis()?,
                    Paper::Point2skeleton => subject.point2skeleton()?,
                    Paper::Matstruct => subject.matstruct(),
                };
                sections.push((name, section));
            }
        }
        Ok(Compat(sections))
    }
}

impl Subject<'_> {
    /// A length in input units, in longest sides and in diagonals.
    fn length(&self, absolute: f64) -> Value {
        let [side, diagonal] = self.units;
        json!({ "absolute": absolute, "side": absolute / side, "diag": absolute / diagonal })
    }

    fn coverage_axis(&self) -> Result<Map<String, Value>, Failure> {
        let tolerance = TOLERANCE * self.units[1];
        let union = union_surface(self.mesh, tolerance).map_err(|error| {
            Failure::input(format!("--compat coverage-axis: the reconstruction: {error}"))
        })?;
        let found = ca_vertex_distances(&self.surface.vertices, &union.mesh.vertices);
        let found = found.ok_or_else(|| nothing("coverage-axis"))?;
        let mut section = Map::new();
        let reconstruction = format!("boundary of the union, within {TOLERANCE} of the diagonal");
        section.insert("reconstruction".into(), reconstruction.into());
        section.insert("surface_vertices".into(), self.surface.vertices.len().into());
        section.insert("reconstruction_vertices".into(), union.mesh.vertices.len().into());
        for (name, value) in [
            ("ca_vertex_hausdorff", found.hausdorff),
            ("ca_vertex_hausdorff_from_surface", found.there_max),
            ("ca_vertex_hausdorff_to_surface", found.back_max),
            ("ca_vertex_chamfer", found.chamfer),
        ] {
            section.insert(name.into(), self.length(value));
        }
        Ok(section)
    }

    fn point2skeleton(&self) -> Result<Map<String, Value>, Failure> {
        let sampling = Sampling::AreaUniform { count: self.samples, seed: self.seed ^ STREAM };
        let points = sample(self.surface, &sampling);
        let skeleton = p2s_sample_skeleton(self.mesh, self.samples, self.seed);
        let recon = p2s_recon(&points, &skeleton).ok_or_else(|| nothing("point2skeleton"))?;
        let mut section = Map::new();
        section.insert("surface_points".into(), points.len().into());
        section.insert("skeleton_spheres".into(), skeleton.len().into());
        section.insert("seed".into(), self.seed.into());
        self.two_sided(&mut section, "recon", &recon);
        if let Some(reference) = self.reference {
            let reference = p2s_sample_skeleton(reference, self.samples, self.seed);
            let points: Vec<_> = reference.iter().map(|sphere| sphere.centre).collect();
            let mat = p2s_mat(&skeleton, &points).ok_or_else(|| nothing("point2skeleton"))?;
            section.insert("reference_points".into(), points.len().into());
            self.two_sided(&mut section, "mat", &mat);
        }
        Ok(section)
    }

    fn two_sided(&self, section: &mut Map<String, Value>, what: &str, found: &TwoSided) {
        for (name, value) in [
            (format!("p2s_cd_{what}"), found.cd),
            (format!("p2s_hd_{what}"), found.hd),
            (format!("p2s_hd_{what}_there"), found.there_max),
            (format!("p2s_hd_{what}_back"), found.back_max),
        ] {
            section.insert(name, self.length(value));
        }
    }

    fn matstruct(&self) -> Map<String, Value> {
        let found = matstruct_quality(self.mesh);
        Map::from_iter([
            ("faces".to_owned(), found.faces.into()),
            ("degenerate_faces".to_owned(), found.degenerate.into()),
            ("matstruct_quality".to_owned(), json!(found.quality)),
        ])
    }
}

fn nothing(paper: &str) -> Failure {
    Failure::input(format!(
        "--compat {paper}: there is no point to measure, or one that is not finite"
    ))
}

impl Compat {
    /// An answer with these numbers as an object of their own.
    pub fn beside(&self, answer: &impl serde::Serialize) -> Value {
        let mut answer = json!(answer);
        if !self.0.is_empty()
            && let Some(object) = answer.as_object_mut()
        {
            let sections =
                self.0.iter().map(|(name, section)| ((*name).to_owned(), json!(section)));
            object.insert("compat".to_owned(), Value::Object(sections.collect()));
        }
        answer
    }

    /// Prints a section for each paper.
    pub fn print(&self) {
        for (name, section) in &self.0 {
            print_line(&format!("by the definitions of {name}:"));
            for (key, value) in section {
                print_line(&format!("  {key:<33} {}", told(value)));
            }
        }
    }
}

fn told(value: &Value) -> String {
    let digits = |key: &str| {
        let number = value[key].as_f64().unwrap_or(f64::NAN);
        format!("{number:.5e}")
    };
    match value {
        Value::Object(_) => {
            format!("{} = {} side = {} diag", digits("absolute"), digits("side"), digits("diag"))
        }
        Value::Null => "-".to_owned(),
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}
