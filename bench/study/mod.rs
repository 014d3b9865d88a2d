//! Studies: the matrix of a comparison as data, and its items.
//!
//! | file | content |
//! |---|---|
//! | `mod` | [`Study`], the content of a study file; its items and shards |
//! | `edition` | frozen results to compare against |
//! | `external` | results computed elsewhere |
//! | `registry` | the methods by id |

pub mod edition;
pub mod external;
pub mod registry;

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

use medial::complex::DualTriangulation;
use medial::simplifier::Params;
use medial::surface::{self, Sampling};
use medial::{parser_message, quoted, read_regular_text, shortened};
use medial_run::error::InputError;
use medial_run::hash::hex_digest;
use medial_run::input::{Input, Source};
use medial_run::item::{Item, Limits, MethodSpec};
use medial_run::level::Target;
use medial_run::record::Provenance;
use medial_run::scene::{Noise, SceneSpec};
use medial_run::settings::{Settings, VOLUME_DEPTH};
use medial_run::text::did_you_mean;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::exit::Failure;
use crate::plugin::line_of;
use crate::study::external::ExternalResult;
use crate::study::registry::{Entry, INITIAL, Registry};

/// Default time limit of an item, in seconds.
const TIMEOUT: f64 = 300.0;
/// Default of `--budget`, in seconds.
const BUDGET: f64 = 60.0;
/// More jobs than this are rejected as implausible.
const MOST_JOBS: usize = 1024;

/// More repetitions than this are rejected as implausible.
const MOST_REPEATS: usize = 10_000;

/// Fewest surface samples of an evaluation: mean errors of ten samples are off by more than a tenth.
pub const LEAST_SAMPLES: usize = 100;

/// More surface samples than this are rejected as implausible.
pub const MOST_SAMPLES: usize = 10_000_000;

/// More threads than this can exhaust the system and are rejected.
pub const MOST_THREADS: usize = 1024;

/// Default number of surface samples of a comparison.
// Fewer than in `evaluate`, since it measures hundreds of results.
const SAMPLES: usize = 10_000;

/// The matrix of a comparison.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Study {
    /// Folder where relative paths start [default: the folder of the study file].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub folder: Option<PathBuf>,
    /// Surface files, `builtin:ID[:RESOLUTION]` or `dataset:NAME`.
    pub meshes: Vec<PathBuf>,
    /// Further sets of meshes: `builtin`, or sets of the library.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub dataset: Vec<String>,
    /// Numbers of spheres.
    pub spheres: Vec<usize>,
    /// Error bounds, fractions of the diagonal, for each of which the fewest spheres are searched.
    pub max_error: Vec<f64>,
    /// Noise on the surfaces: each magnitude, the largest displacement of a vertex as a fraction of the
    /// diagonal, adds a row of meshes whose results are measured against the clean surface.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub noise: Vec<f64>,
    /// Whether to skip the default sweeps of native levels and the initial medial mesh.
    pub counts_only: bool,
    /// Whether each method also runs at its published level.
    pub published: bool,
    /// Seed of every random choice.
    pub seed: u64,
    /// Seeds of the methods that depend on one [default: `seed`].
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub seeds: Vec<u64>,
    /// Number of timed repetitions of each level.
    pub repeat: usize,
    /// Boundary samples.
    pub sampling: Sampling,
    /// Triangulation of the dual Voronoi polygons.
    pub dual: DualTriangulation,
    /// Surface samples of the evaluation, in addition to the vertices.
    pub samples: usize,
    /// Width of the certified interval of each Hausdorff error, a fraction of the diagonal; `None` for no certificate.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub certify: Option<f64>,
    /// Whether results are measured as spheres alone, without edges and faces.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub spheres_alone: bool,
    /// Number of threads [default: all processors].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub threads: Option<usize>,
    /// Limit of time for each item, in seconds.
    pub timeout: f64,
    /// Seconds after which a method begins no further level on a mesh.
    pub budget: f64,
    /// Number of items that run at the same time.
    pub jobs: usize,
    /// Limit of memory in megabytes [default: three quarters of the machine's].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub memory: Option<u64>,
    /// The edition, by name or folder, whose results the report has next to its own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub against: Option<PathBuf>,
    /// Plug-in files.
    pub plugins: Vec<PathBuf>,
    /// Methods with their parameters [default: all but those on request].
    #[serde(rename = "method")]
    pub methods: Vec<StudyMethod>,
    /// External results.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub given: Vec<ExternalResult>,
}

/// A method of a study, one row in tables and one curve in plots.
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
    /// Native levels, in addition to the counts.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub levels: Vec<f64>,
    /// Whether it also runs at its published level, in place of the study's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub published: Option<bool>,
}

impl Default for Study {
    fn default() -> Self {
        Self {
            folder: None,
            meshes: vec![],
            dataset: vec![],
            spheres: vec![200, 100, 50],
            max_error: vec![],
            noise: vec![],
            counts_only: false,
            published: false,
            seed: 0,
            seeds: vec![],
            repeat: 1,
            sampling: Sampling::default(),
            dual: DualTriangulation::default(),
            samples: SAMPLES,
            certify: None,
            spheres_alone: false,
            threads: None,
            timeout: TIMEOUT,
            budget: BUDGET,
            jobs: 1,
            memory: None,
            against: None,
            plugins: vec![],
            methods: vec![],
            given: vec![],
        }
    }
}

/// Reads a TOML text.
///
/// # Errors
/// The problem in one line with its line number, and with little of the text.
pub(crate) fn parse_toml<T: DeserializeOwned>(text: &str) -> Result<T, String> {
    toml::from_str(text).map_err(|error| {
        let line = error.span().map(|span| format!("line {}: ", line_of(text, &span)));
        line.unwrap_or_default() + &parser_message(error.message())
    })
}

/// Longest name of a row, in characters.
const LONGEST_NAME: usize = 100;

impl Study {
    /// Reads a study file. Relative paths in it start at its folder.
    ///
    /// # Errors
    /// When it cannot be read or is no study, with the line where the text is at fault.
    pub fn read(path: &Path) -> Result<Self, Failure> {
        let failed = |message: String| Failure::at(path, message);
        let text = read_regular_text(path).map_err(|error| failed(error.to_string()))?;
        let mut study: Self = parse_toml(&text).map_err(failed)?;
        study.check_names().map_err(failed)?;
        let own = path.parent().filter(|own| !own.as_os_str().is_empty());
        // The parent of `study.toml` is empty and has no absolute path.
        let own = own.unwrap_or(Path::new("."));
        let folder = study.folder.map_or(own.to_owned(), |folder| own.join(folder));
        study.folder = Some(std::path::absolute(&folder).unwrap_or(folder));
        Ok(study)
    }

    /// The study as a file that [`Study::read`] reads.
    ///
    /// # Errors
    /// For a number that TOML cannot hold, or a path that is not UTF-8.
    pub fn to_text(&self) -> Result<String, Failure> {
        toml::to_string(self).map_err(|error| Failure::usage(format!("study: {error}")))
    }

    /// A path relative to the folder of the study; names of meshes stay.
    pub fn resolved(&self, path: &Path) -> PathBuf {
        match &self.folder {
            // A name is not a path.
            Some(folder) if !Source::is_name(path) => folder.join(path),
            _ => path.to_owned(),
        }
    }

    /// Refuses names that tables and messages cannot show.
    fn check_names(&self) -> Result<(), String> {
        let methods = self.methods.iter().filter_map(|method| method.name.as_ref());
        let given = self.given.iter().map(|given| &given.name);
        let is_shown = |name: &&String| {
            !name.trim().is_empty()
                && name.chars().count() <= LONGEST_NAME
                && !name.contains(char::is_control)
        };
        match methods.chain(given).find(|name| !is_shown(name)) {
            None => Ok(()),
            Some(name) => Err(format!(
                "invalid name (found {}, expected 1 to {LONGEST_NAME} characters without control characters)",
                quoted(name)
            )),
        }
    }

    /// Refuses implausible values.
    ///
    /// # Errors
    /// For the first of them.
    pub fn check(&self) -> Result<(), Failure> {
        let counts = self.methods.iter().filter_map(|method| method.spheres.as_ref());
        let mut levels = (self.methods.iter())
            .flat_map(|method| method.levels.iter().map(move |level| (&method.id, level)));
        let mut paths = (self.meshes.iter().chain(&self.plugins).chain(&self.folder))
            .chain(self.given.iter().map(|given| &given.file))
            .chain(&self.against);
        let fault = if !(1..=MOST_REPEATS).contains(&self.repeat) {
            format!("--repeat {}: expected a number from 1 to {MOST_REPEATS}", self.repeat)
        } else if !(LEAST_SAMPLES..=MOST_SAMPLES).contains(&self.samples) {
            let samples = self.samples;
            format!("--samples {samples}: expected a number from {LEAST_SAMPLES} to {MOST_SAMPLES}")
        } else if !(self.timeout > 0.0 && self.timeout.is_finite()) {
            format!("--timeout {}: expected a positive number of seconds", self.timeout)
        } else if let Some(threads) = self.threads.filter(|n| !(1..=MOST_THREADS).contains(n)) {
            format!("--threads {threads}: expected a number from 1 to {MOST_THREADS}")
        } else if let Some(path) = paths.find(|path| path.to_str().is_none()) {
            format!("{}: the name is not UTF-8; rename it", path.display())
        } else if !(self.budget > 0.0 && self.budget.is_finite()) {
            format!("--budget {}: expected a positive number of seconds", self.budget)
        } else if !(1..=MOST_JOBS).contains(&self.jobs) {
            format!("--jobs {}: expected a number from 1 to {MOST_JOBS}", self.jobs)
        } else if let Some(width) = self.certify.filter(|width| !(1e-6..1.0).contains(width)) {
            format!("--certify {width}: expected a fraction of the diagonal from 1e-6 to 1")
        } else if let Some((id, level)) = levels.find(|(_, level)| !level.is_finite()) {
            format!("--levels {}={level}: expected a finite number", shortened(id))
        } else if self.memory == Some(0) {
            "--memory 0: expected a positive number of megabytes".to_owned()
        } else if let Some(eta) = self.noise.iter().find(|&&eta| !(eta > 0.0 && eta <= 0.1)) {
            format!("noise {eta}: expected a fraction of the diagonal of at most 0.1")
        } else if counts.chain([&self.spheres]).any(|counts| counts.contains(&0)) {
            "--spheres 0: expected at least 1 sphere".to_owned()
        } else if let Some(bound) = self.max_error.iter().find(|&&e| !(e > 0.0 && e < 1.0)) {
            format!("--max-error {bound}: expected a fraction of the diagonal between 0 and 1")
        } else {
            return Ok(());
        };
        Err(Failure::usage(fault))
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
    /// Where a part has no `=`.
    pub fn parse(text: &str) -> Result<Self, Failure> {
        let mut parts = text.split(':');
        let mut method = Self::of(parts.next().unwrap_or_default());
        for part in parts {
            let (key, value) = part.split_once('=').ok_or_else(|| {
                Failure::usage(format!("--methods {text}: expected ID:KEY=VALUE"))
            })?;
            method.params.set(key, value);
        }
        Ok(method)
    }
}

/// The message for an unknown method, with the known ids.
pub fn no_such_method(id: &str, known: &[String]) -> String {
    let meant = did_you_mean(id, known.iter().map(String::as_str));
    format!("unknown method `{}`{meant} (expected one of: {})", shortened(id), known.join(", "))
}

impl Study {
    /// The methods of the study, or by default all but those on request.
    ///
    /// # Errors
    /// For an id that no method has, and for two rows of one name.
    pub fn entries<'r>(
        &self,
        registry: &'r Registry,
    ) -> Result<Vec<(StudyMethod, &'r Entry)>, Failure> {
        let mut methods = self.methods.clone();
        if methods.is_empty() {
            methods = registry.usual().map(|e| StudyMethod::of(e.id())).collect();
        }
        // The start of all methods, in the first row to compare with.
        if !self.counts_only {
            methods.insert(0, StudyMethod::of(INITIAL));
        }
        let mut found: Vec<(StudyMethod, &Entry)> = Vec::new();
        for method in &methods {
            let entry = registry.entry(&method.id);
            let entry = entry.ok_or_else(|| Failure::usage(registry.no_such(&method.id)))?;
            // The same row twice would be one row with twice the weight.
            if found.iter().any(|(other, _)| other == method) {
                continue;
            }
            // Results of a variant under the name of a method would pass for those of that method.
            if let Some(name) = &method.name
                && registry.entry(name).is_some()
            {
                let id = &method.id;
                return Err(Failure::usage(format!(
                    "methods: the name `{name}` is the id of a method (found as the name of a variant of `{id}`); \
                     choose another name"
                )));
            }
            if let Some(name) = &method.name
                && found.iter().any(|(other, _)| other.name.as_ref() == Some(name))
            {
                return Err(Failure::usage(format!(
                    "two methods have the name `{name}`; rename one"
                )));
            }
            found.push((method.clone(), entry));
        }
        Ok(found)
    }

    /// The inputs of the study: its meshes and sets, or else [`Source::examples`].
    ///
    /// # Errors
    /// When one does not exist or cannot be an input.
    pub fn sources(&self) -> Result<Vec<Source>, Failure> {
        let mut sources = Vec::new();
        for mesh in &self.meshes {
            sources.push(Source::parse(&self.resolved(mesh))?);
        }
        if sources.is_empty() && self.dataset.is_empty() {
            sources = Source::examples();
        }
        for word in &self.dataset {
            sources.extend(Source::set(word)?);
        }
        sources.iter().try_for_each(Source::check)?;
        // The same mesh twice would be one row with twice the weight.
        let mut seen = HashSet::new();
        sources.retain(|source| seen.insert(source.clone()));
        Ok(sources)
    }

    /// All items, mesh by mesh.
    ///
    /// # Errors
    /// As [`Study::check`], [`Study::entries`] and [`Study::sources`].
    pub fn items(&self, registry: &Registry, here: &Provenance) -> Result<Vec<Item>, Failure> {
        self.check()?;
        let methods = self.entries(registry)?;
        let sources = self.sources()?;
        let names = unique_names(&sources);
        let (files, _) = self.external_files(&names)?;
        let mut items = Vec::new();
        for (source, mesh) in sources.iter().zip(names) {
            // Without loading it: a refused file is a row of the results, not an error of the study.
            let hash = match source.path() {
                Some(path) => hex_digest(&surface::content(path).map_err(InputError::from)?),
                None => Input::load(source)?.hash,
            };
            let scene = SceneSpec {
                mesh,
                source: source.clone(),
                hash: Some(hash),
                noise: None,
                settings: self.settings(),
            };
            let noisy = self.noise.iter().map(|&eta| {
                let mesh = format!("{} noise {eta}", scene.mesh);
                let noise = Some(Noise { eta, seed: self.seed });
                SceneSpec { mesh, noise, ..scene.clone() }
            });
            for scene in std::iter::once(scene.clone()).chain(noisy) {
                for (method, entry) in &methods {
                    let StudyMethod { id, name, params, .. } = method.clone();
                    let fingerprint = entry.fingerprint.clone();
                    let spec = MethodSpec { id, name, params, fingerprint };
                    let (levels, version) =
                        (self.levels(method, entry), entry.version(&here.binary_hash));
                    let item = self.item(scene.clone(), spec, levels, version, here);
                    let is_seeded = entry.method().info().seeded && !self.seeds.is_empty();
                    let seeds = if is_seeded { &self.seeds[..] } else { &[self.seed] };
                    items.extend(seeds.iter().map(|&seed| Item { seed, ..item.clone() }));
                }
            }
            let of_mesh = files.iter().filter(|file| file.mesh == scene.mesh);
            items.extend(of_mesh.map(|file| self.external_item(scene.clone(), file, here)));
        }
        Ok(items)
    }

    fn settings(&self) -> Settings {
        Settings {
            sampling: self.sampling,
            dual: self.dual,
            samples: self.samples,
            volume_depth: VOLUME_DEPTH,
            seed: self.seed,
            certify: self.certify,
            spheres_alone: self.spheres_alone,
            threads: self.threads.unwrap_or_else(rayon::current_num_threads),
        }
    }

    fn item(
        &self,
        scene: SceneSpec,
        method: MethodSpec,
        levels: Vec<Target>,
        version: String,
        here: &Provenance,
    ) -> Item {
        Item {
            scene,
            method,
            levels,
            seed: self.seed,
            repeat: self.repeat,
            limits: self.limits(here),
            version,
            binary: here.binary_hash.clone(),
        }
    }

    /// The limits of each item.
    pub fn limits(&self, here: &Provenance) -> Limits {
        // A quarter is left for the supervisor and the system.
        let machine = match here.machine.memory {
            0 => u64::MAX,
            memory => memory / 4 * 3 / self.jobs.max(1) as u64,
        };
        let bytes = self.memory.map_or(machine, |megabytes| megabytes.saturating_mul(1_000_000));
        // A budget beyond the time limit has no effect.
        let budget = Some(self.budget).filter(|&budget| budget < self.timeout);
        Limits { seconds: self.timeout, bytes, budget }
    }

    /// The published level, the counts and the method's own levels, each from fine to coarse, or all in reverse where
    /// the method does not continue from finer levels; then the error bounds.
    fn levels(&self, method: &StudyMethod, entry: &Entry) -> Vec<Target> {
        let info = entry.method().info();
        // One result at every level: more rows would repeat it.
        if info.fixed {
            return vec![Target::Published];
        }
        let mut levels = Vec::new();
        if method.published.unwrap_or(self.published) {
            levels.push(Target::Published);
        }
        let mut counts = method.spheres.as_ref().unwrap_or(&self.spheres).clone();
        // Incremental methods continue from fine to coarse.
        counts.sort_unstable_by(|a, b| b.cmp(a));
        counts.dedup();
        levels.extend(counts.into_iter().map(Target::Spheres));
        let mut native = match method.levels.is_empty() && !self.counts_only {
            true => entry.presentation.sweep.clone(),
            false => method.levels.clone(),
        };
        native.sort_by(f64::total_cmp);
        native.dedup();
        if info.native.as_ref().is_some_and(|native| !native.larger_is_coarser) {
            native.reverse();
        }
        levels.extend(native.into_iter().map(Target::Native));
        // Fine levels take longest: last, they cannot cost coarser ones their results.
        if !info.incremental {
            levels.reverse();
        }
        // Last and from loose to tight, since an endless search must not cost other results.
        let mut bounds = self.max_error.clone();
        bounds.sort_by(|a, b| b.total_cmp(a));
        bounds.dedup();
        levels.extend(bounds.into_iter().map(Target::MaxError));
        levels
    }
}

/// The share `I/N` of a study's items: every Nth one, beginning with the Ith.
///
/// The position in the whole study decides, independent of the store: a shard that runs again
/// continues with the same items. The start moves by one from mesh to mesh, so that no shard gets
/// one method on all meshes where N divides the number of methods.
///
/// # Errors
/// Where the text is not two numbers, the first from 1 to the second.
pub fn shard(text: &str, items: &[Item]) -> Result<Vec<Item>, Failure> {
    let parsed = text.split_once('/').and_then(|(number, of)| {
        let (number, of): (usize, usize) = (number.parse().ok()?, of.parse().ok()?);
        (1..=of).contains(&number).then_some((number, of))
    });
    let (number, of) = parsed.ok_or_else(|| {
        Failure::usage(format!("--shard {text}: expected I/N with I from 1 to N"))
    })?;
    let (mut own, mut mesh) = (Vec::new(), 0);
    for (place, item) in items.iter().enumerate() {
        // Items of one mesh follow each other.
        if place > 0 && items[place - 1].scene != item.scene {
            mesh += usize::from(place % of == 0);
        }
        if (place + mesh) % of == number - 1 {
            own.push(item.clone());
        }
    }
    Ok(own)
}

/// Names that differ in case alone are one file on some systems.
fn name_key(name: &str) -> String {
    medial_run::text::file_stem(name).to_ascii_lowercase()
}

/// A unique name for each source, also unique as the stem of a file: the file's stem, else its name
/// with the extension, else with its folder, else with a number.
pub(crate) fn unique_names(sources: &[Source]) -> Vec<String> {
    let mut names: Vec<String> = sources.iter().map(Source::name).collect();
    // Only names that collide grow: the others stay short in tables.
    for depth in 1..=2 {
        let mut count: HashMap<String, usize> = HashMap::new();
        names.iter().for_each(|name| *count.entry(name_key(name)).or_default() += 1);
        for (name, source) in names.iter_mut().zip(sources) {
            if count[&name_key(name)] > 1 {
                *name = source.long_name(depth);
            }
        }
    }
    let mut taken = HashSet::new();
    for name in &mut names {
        let base = name.clone();
        let mut number = 2;
        // The longer name of one file can be the name of another.
        while !taken.insert(name_key(name)) {
            *name = format!("{base}-{number}");
            number += 1;
        }
    }
    names
}
