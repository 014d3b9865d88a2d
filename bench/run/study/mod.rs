//! A study: which methods run on which meshes at which levels, as a TOML file.
//!
//! ```toml
//! meshes = ["bear.off", "builtin:torus"]   # relative paths start at this file
//! spheres = [1000, 500, 100]
//! repeat = 3
//! plugins = ["largest.toml"]
//!
//! [[method]]
//! id = "qmat"
//!
//! [[method]]
//! id = "qmat"
//! name = "qmat, no scale term"
//! params = { k = 0 }
//! levels = []                              # native levels beside the counts
//!
//! [[given]]                                # a file of another program, judged like the rest
//! name = "Q-MAT, authors"
//! file = "bear-qmat.ma"
//! mesh = "bear"
//! ```
//!
//! The command line gives one too; what it names wins over the file. The study that was asked last
//! lies beside its results.

mod error;
mod given;
mod items;

use std::path::{Path, PathBuf};

use medial::simplifier::Params;
use medial::surface::Sampling;
use serde::{Deserialize, Deserializer, Serialize};

use super::{Dual, Given, Source};

pub use error::{StudyError, no_such_method};
pub use items::{Here, Shard};

/// Items are ended after so many seconds unless told otherwise.
pub const TIMEOUT: f64 = 300.0;

/// More repetitions than this are taken for a slip.
pub const MOST_REPEATS: usize = 10_000;

/// Surface samples of a comparison unless told otherwise: fewer than `evaluate` takes, since it
/// measures hundreds of results.
const SAMPLES: usize = 10_000;
/// Depth of the volume difference in a comparison, likewise.
pub const VOLUME_DEPTH: u32 = 5;

/// The matrix of a comparison.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Study {
    /// Folder where relative paths start; the study file's own unless given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub folder: Option<PathBuf>,
    /// Surface files, `builtin:ID[:RESOLUTION]` or `dataset:NAME`.
    pub meshes: Vec<PathBuf>,
    /// Sets of meshes beside those named: `builtin`, or what the library has. A text or a list of texts.
    #[serde(skip_serializing_if = "Vec::is_empty", deserialize_with = "one_or_more")]
    pub dataset: Vec<String>,
    /// Numbers of spheres.
    pub spheres: Vec<usize>,
    /// Error bounds, fractions of the diagonal, for each of which the fewest spheres are searched.
    pub max_error: Vec<f64>,
    /// Noise on the surfaces: each magnitude, the largest displacement of a vertex as a fraction of the
    /// diagonal, adds a row of meshes whose results are measured against the clean surface.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub noise: Vec<f64>,
    /// Counts alone: no levels of the methods' own but those given to them, and no row of the
    /// initial medial mesh.
    pub counts_only: bool,
    /// Whether each method also runs at its published level.
    pub published: bool,
    /// Seed of every random choice.
    pub seed: u64,
    /// How often each level is timed.
    pub repeat: usize,
    /// Boundary samples.
    pub sampling: Sampling,
    /// Triangulation of the dual Voronoi polygons.
    pub dual: Dual,
    /// Surface samples of the evaluation, beside the vertices.
    pub samples: usize,
    /// Width of the certified interval of each Hausdorff error, a fraction of the diagonal; none
    /// unless given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub certify: Option<f64>,
    /// Number of threads; all processors unless given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub threads: Option<usize>,
    /// Limit of time for each item, in seconds.
    pub timeout: f64,
    /// Limit of memory in megabytes; three quarters of the machine's unless given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub memory: Option<u64>,
    /// Plug-in files.
    pub plugins: Vec<PathBuf>,
    /// Methods that start from what each filter leaves, beside those named.
    pub after_filters: Vec<String>,
    /// Methods with their parameters; all methods unless given.
    #[serde(rename = "method")]
    pub methods: Vec<StudyMethod>,
    /// Files of other programs as results of named methods.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub given: Vec<Given>,
}

/// A method of a study: a row of its own in tables and plots.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StudyMethod {
    /// Id of the method.
    pub id: String,
    /// Name in tables.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Parameters.
    #[serde(default)]
    pub params: Params,
    /// Numbers of spheres, in place of the study's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spheres: Option<Vec<usize>>,
    /// Levels of the method's own, beside the counts.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub levels: Vec<f64>,
    /// Whether it also runs at its published level, in place of the study's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub published: Option<bool>,
}

/// Reads a text, or a list of texts.
fn one_or_more<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<String>, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged, expecting = "a text or a list of texts")]
    enum Words {
        One(String),
        More(Vec<String>),
    }
    Ok(match Words::deserialize(deserializer)? {
        Words::One(word) => vec![word],
        Words::More(words) => words,
    })
}

impl Default for Study {
    fn default() -> Self {
        Self {
            folder: None,
            meshes: vec![],
            dataset: vec![],
            spheres: vec![1000, 500, 200, 100],
            max_error: vec![],
            noise: vec![],
            counts_only: false,
            published: false,
            seed: 0,
            repeat: 1,
            sampling: Sampling::default(),
            dual: Dual::default(),
            samples: SAMPLES,
            certify: None,
            threads: None,
            timeout: TIMEOUT,
            memory: None,
            plugins: vec![],
            after_filters: vec![],
            methods: vec![],
            given: vec![],
        }
    }
}

impl Study {
    /// Reads a study file. Relative paths in it start at its folder.
    ///
    /// # Errors
    /// [`StudyError::File`], with the line where the text is at fault.
    pub fn read(path: &Path) -> Result<Self, StudyError> {
        let failed = |message: String| StudyError::File { path: path.to_owned(), message };
        let text = std::fs::read_to_string(path).map_err(|error| failed(error.to_string()))?;
        let mut study: Self = toml::from_str(&text).map_err(|error| failed(error.to_string()))?;
        let own = path.parent().filter(|own| !own.as_os_str().is_empty());
        let own = own.unwrap_or(Path::new("."));
        let folder = study.folder.map_or(own.to_owned(), |folder| own.join(folder));
        study.folder = Some(std::path::absolute(&folder).unwrap_or(folder));
        Ok(study)
    }

    /// The study as a file that [`Study::read`] reads.
    ///
    /// # Errors
    /// [`StudyError::Value`] for a number that TOML cannot hold, or a path that is not UTF-8.
    pub fn to_text(&self) -> Result<String, StudyError> {
        toml::to_string(self).map_err(|error| StudyError::Value(format!("study: {error}")))
    }

    /// A path as it is meant.
    pub fn resolved(&self, path: &Path) -> PathBuf {
        match &self.folder {
            // A name is no path.
            Some(folder) if !Source::is_name(path) => folder.join(path),
            _ => path.to_owned(),
        }
    }

    /// Refuses values that make no sense.
    ///
    /// # Errors
    /// [`StudyError::Value`].
    pub fn check(&self) -> Result<(), StudyError> {
        let wrong = |message: String| Err(StudyError::Value(message));
        if !(1..=MOST_REPEATS).contains(&self.repeat) {
            return wrong(format!(
                "--repeat {}: time each item 1 to {MOST_REPEATS} times",
                self.repeat
            ));
        }
        if !(self.timeout > 0.0 && self.timeout.is_finite()) {
            return wrong(format!("--timeout {}: a positive number of seconds", self.timeout));
        }
        if let Some(width) = self.certify.filter(|width| !(1e-6..1.0).contains(width)) {
            return wrong(format!("--certify {width}: a fraction of the diagonal from 1e-6 on"));
        }
        if self.memory == Some(0) {
            return wrong("--memory 0: a positive number of megabytes".into());
        }
        if let Some(eta) = self.noise.iter().find(|&&eta| !(eta > 0.0 && eta <= 0.1)) {
            return wrong(format!("noise {eta}: a fraction of the diagonal of at most 0.1"));
        }
        let counts = self.methods.iter().filter_map(|method| method.spheres.as_ref());
        if counts.chain([&self.spheres]).any(|counts| counts.contains(&0)) {
            return wrong("--spheres 0: ask for at least one sphere".into());
        }
        if let Some(bound) = self.max_error.iter().find(|&&bound| !(bound > 0.0 && bound < 1.0)) {
            return wrong(format!(
                "--max-error {bound}: a fraction of the diagonal between 0 and 1 is meant"
            ));
        }
        Ok(())
    }
}

impl StudyMethod {
    /// A method with the paper's values.
    pub fn of(id: &str) -> Self {
        Self { id: id.to_owned(), ..Self::default() }
    }

    /// Reads `ID` or `ID:KEY=VALUE[:KEY=VALUE...]`.
    ///
    /// # Errors
    /// [`StudyError::Value`] where a part has no `=`.
    pub fn parse(text: &str) -> Result<Self, StudyError> {
        let mut parts = text.split(':');
        let mut method = Self::of(parts.next().unwrap_or_default());
        for part in parts {
            let (key, value) = part.split_once('=').ok_or_else(|| {
                StudyError::Value(format!("--methods {text}: write ID:KEY=VALUE"))
            })?;
            method.params.set(key, value);
        }
        Ok(method)
    }
}
