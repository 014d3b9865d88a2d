//! Editions: frozen results that new ones are compared against, without a run of their methods.
//!
//! An edition is known by its name if it is part of the program, or by its folder. Its rows are matched by the hash of the
//! mesh, not by its name, and by the level. Everything that decides a measured number must be the study's: the samples,
//! the seed, the sampling of the start, and the version of the metrics' definitions.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use medial::complex::DualTriangulation;
use medial::metrics::DEFINITIONS;
use medial::read_regular;
use medial::surface::Sampling;
use medial_reports::editions::{DESCRIPTION, EDITIONS, Embedded, RECORDS, unpack};
use medial_run::hash::hex_digest;
use medial_run::item::Item;
use medial_run::level::Target;
use medial_run::record::Record;
use medial_run::settings::VOLUME_DEPTH;
use medial_run::text::did_you_mean;
use medial_run::text::significant;
use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::exit::Failure;
use crate::study::registry::{INITIAL, Registry};
use crate::study::{Study, parse_toml};

/// The description of an edition: `edition.toml`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Description {
    /// Name, that of its folder.
    pub name: String,
    /// Version of the definitions of the metrics.
    pub metrics: u32,
    /// Version of the program.
    pub version: String,
    /// Surface samples of the evaluation.
    pub samples: usize,
    /// Levels of division of space for the volume difference.
    pub volume_depth: u32,
    /// Seed of every random choice.
    pub seed: u64,
    /// Boundary samples of the start of all methods.
    pub sampling: Sampling,
    /// Triangulation of the dual Voronoi polygons.
    pub dual: DualTriangulation,
    /// Width of the certified intervals, a fraction of the diagonal.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub certify: Option<f64>,
    /// Sphere counts.
    pub spheres: Vec<usize>,
    /// Error bounds, fractions of the diagonal.
    pub max_error: Vec<f64>,
    /// Number of records.
    pub records: usize,
    /// SHA-256 of the packed records.
    pub sha256: String,
    /// The machines of the seconds.
    pub machines: Vec<String>,
    /// Native levels of each method.
    pub native: BTreeMap<String, Vec<f64>>,
    /// The meshes.
    pub mesh: Vec<EditionMesh>,
}

/// A mesh of an edition.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EditionMesh {
    /// Name in the tables of the edition.
    pub name: String,
    /// Its argument on the command line; `medial datasets fetch` fetches `dataset:NAME`.
    pub source: String,
    /// SHA-256 of its file; of a built-in shape its surface and known axis.
    pub sha256: String,
}

/// An edition whose records are those of its description.
#[derive(Debug)]
pub struct Edition {
    /// The description.
    pub description: Description,
    /// The records as frozen.
    pub records: Vec<Record>,
}

/// The records of a comparison together with those of an edition.
pub struct Mixed {
    /// The comparison's own, then those of the edition.
    pub records: Vec<Record>,
    /// Sentences on what was left out.
    pub notes: Vec<String>,
}

impl Edition {
    /// The edition of a study, if it has one.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn of(study: &Study) -> Result<Option<Self>, Failure> {
        let is_known = |name: &Path| EDITIONS.iter().any(|known| Path::new(known.name) == name);
        let name = study.against.as_ref();
        let name =
            name.map(|name| if is_known(name) { name.clone() } else { study.resolved(name) });
        name.as_deref().map(Self::open).transpose()
    }

    /// Opens an edition by its name or folder.
    ///
    /// # Errors
    /// Unless it is known, unaltered, and measured by no later definitions than those of this program.
    pub fn open(name: &Path) -> Result<Self, Failure> {
        let embedded = EDITIONS.iter().find(|edition| Path::new(edition.name) == name);
        let file = |of: &str| embedded.map_or_else(|| name.join(of), |_| PathBuf::from(of));
        let failed = |of: &str, message: String| Failure::at(&file(of), message);
        let (text, packed) = match embedded {
            Some(Embedded { description, records, .. }) => {
                ((*description).to_owned(), records.to_vec())
            }
            None if !name.is_dir() => {
                let known: Vec<&str> = EDITIONS.iter().map(|edition| edition.name).collect();
                let name = name.display().to_string();
                let meant = did_you_mean(&name, known.iter().copied());
                let known = known.join(", ");
                return Err(Failure::usage(format!(
                    "--against {name}: unknown edition{meant} (expected a folder or one of: {known})"
                )));
            }
            None => {
                let read = |of: &str| {
                    let path = name.join(of);
                    read_regular(path).map_err(|error| failed(of, error.to_string()))
                };
                let text = String::from_utf8(read(DESCRIPTION)?);
                let text = text.map_err(|error| failed(DESCRIPTION, error.to_string()))?;
                (text, read(RECORDS)?)
            }
        };
        let description: Description =
            parse_toml(&text).map_err(|message| failed(DESCRIPTION, message))?;
        let (name, found) = (description.name.clone(), hex_digest(&packed));
        if found != description.sha256 {
            let expected = description.sha256;
            return Err(Failure::input(format!(
                "edition {name}: the records have changed (SHA-256 {found}, expected {expected}); restore {RECORDS}"
            )));
        }
        if description.metrics > DEFINITIONS {
            return Err(Failure::input(format!(
                "edition {name}: the numbers have other definitions (found version {}, expected at most {DEFINITIONS}); use \
                 a later build of medial or omit --against",
                description.metrics
            )));
        }
        let unpacked = unpack(&packed).map_err(|error| failed(RECORDS, error.to_string()))?;
        if let Some(line) = unpacked.bad_lines.first() {
            return Err(failed(RECORDS, line.to_string()));
        }
        Ok(Self { description, records: unpacked.records })
    }

    /// A note where the numbers have earlier definitions than those of this program.
    fn earlier_definitions(&self) -> Option<String> {
        let Description { name, metrics, .. } = &self.description;
        (*metrics < DEFINITIONS).then(|| {
            format!(
                "Edition {name} was measured by version {metrics} of the metrics' definitions, here is version \
                 {DEFINITIONS}: errors of unions that fill cavities are too small there, other maxima are equal, and \
                 means differ by less than 0.1 % of themselves."
            )
        })
    }

    /// Refuses a study whose results do not compare with those of the edition, before any run.
    ///
    /// # Errors
    /// For the first option that differs, and without a common mesh.
    pub fn check(&self, study: &Study, items: &[Item]) -> Result<(), Failure> {
        let Description { samples, volume_depth, seed, sampling, dual, .. } = &self.description;
        let settings = [
            ("spheres-alone", study.spheres_alone.to_string(), false.to_string()),
            ("samples", study.samples.to_string(), samples.to_string()),
            ("volume-depth", VOLUME_DEPTH.to_string(), volume_depth.to_string()),
            ("seed", study.seed.to_string(), seed.to_string()),
            ("sampling", study.sampling.to_string(), sampling.to_string()),
            ("dual", study.dual.to_string(), dual.to_string()),
        ];
        let name = &self.description.name;
        for (option, found, expected) in settings {
            if found != expected {
                return Err(Failure::usage(format!(
                    "--{option} {found}: edition {name} was measured with {expected}, so the results do not compare; omit \
                     --{option} or --against"
                )));
            }
        }
        let meshes = &self.description.mesh;
        let hashes = items.iter().filter_map(|item| item.scene.hash.as_ref());
        if hashes.into_iter().any(|hash| meshes.iter().any(|mesh| mesh.sha256 == *hash)) {
            return Ok(());
        }
        let known: Vec<&str> = meshes.iter().map(|mesh| mesh.source.as_str()).collect();
        Err(Failure::usage(format!(
            "--against {name}: no mesh of this comparison is in the edition (expected one of: {})",
            known.join(", ")
        )))
    }

    /// The methods whose version in this program is another one.
    fn changed_methods(&self, registry: &Registry) -> BTreeSet<String> {
        let changed = self.records.iter().filter(|record| {
            let entry = registry.entry(&record.simplify.method);
            entry.is_some_and(|entry| entry.version("") != record.method_version)
        });
        changed.map(|record| record.simplify.method.clone()).collect()
    }

    /// The records of a comparison on meshes of the edition, and the edition's on these meshes at the levels of the study.
    /// A method that gives the same results in both has its own rows alone. Rows of other versions are marked.
    pub fn beside(&self, study: &Study, own: &[Record], registry: &Registry) -> Mixed {
        let edition = &self.description;
        // The shortest name of a mesh: noise adds to it, and is not part of the hash.
        let mut names: BTreeMap<&str, &str> = BTreeMap::new();
        for record in own {
            let hash = record.mesh_hash.as_deref().unwrap_or_default();
            if edition.mesh.iter().any(|mesh| mesh.sha256 == hash) {
                let name = names.entry(hash).or_insert(&record.mesh);
                *name = if record.mesh.len() < name.len() { &record.mesh } else { *name };
            }
        }
        let is_in = |record: &Record| {
            let hash = record.mesh_hash.as_deref().unwrap_or_default();
            names.get(hash) == Some(&record.mesh.as_str())
        };
        let (mut records, others): (Vec<Record>, Vec<Record>) =
            own.iter().cloned().partition(|record| is_in(record));
        let counts = study.methods.iter().filter_map(|method| method.spheres.as_ref());
        let counts: BTreeSet<usize> = counts.chain([&study.spheres]).flatten().copied().collect();
        let mut frozen: Vec<Record> = self.records.clone();
        frozen.retain(|record| match record.simplify.level {
            Target::Spheres(count) => counts.contains(&count),
            Target::MaxError(bound) => study.max_error.contains(&bound),
            Target::Native(_) => !study.counts_only,
            Target::Published if record.simplify.method == INITIAL => !study.counts_only,
            Target::Published => study.published,
        });
        let changed = self.changed_methods(registry);
        frozen.retain_mut(|record| {
            record.is_other_version = changed.contains(&record.simplify.method);
            let name = record.mesh_hash.as_deref().and_then(|hash| names.get(hash));
            record.mesh = name.map_or_else(String::new, |&name| name.to_owned());
            record.edition = Some(edition.name.clone());
            // It is not in the folder of the comparison.
            record.artifact = None;
            name.is_some()
        });
        // By method and parameters: whether each frozen result was also found here.
        let row = |record: &Record| {
            let simplify = &record.simplify;
            json!([simplify.method, simplify.params]).to_string()
        };
        let place = |record: &Record| {
            (row(record), json!([record.mesh, record.simplify.level]).to_string())
        };
        let found: BTreeMap<_, &Record> = (records.iter())
            .filter(|record| record.simplify.variant.is_none())
            .map(|record| (place(record), record))
            .collect();
        let mut repeated: BTreeMap<String, bool> = BTreeMap::new();
        let mut ratios: Vec<f64> = vec![];
        // By method: number of results here, and the ratios of errors where results differ.
        let mut errors: BTreeMap<String, (usize, Vec<f64>)> = BTreeMap::new();
        for record in &frozen {
            let own = found.get(&place(record));
            let error = |record: &Record| Some(record.evaluate.as_ref()?.distances.hausdorff);
            if let Some((here, there)) = own.and_then(|own| Some((error(own)?, error(record)?))) {
                let (compared, differing) =
                    errors.entry(record.simplify.method.clone()).or_default();
                *compared += 1;
                let differs = own.is_some_and(|own| own.result_hash != record.result_hash);
                differing.extend(differs.then(|| here.max(NEGLIGIBLE) / there.max(NEGLIGIBLE)));
            }
            let own = own.filter(|own| own.result_hash == record.result_hash);
            *repeated.entry(row(record)).or_insert(true) &= own.is_some();
            let total = |record: &Record| Some(record.simplify.seconds?.total).filter(|&s| s > 0.0);
            let own = own.filter(|own| own.ran_alone() && own.simplify.method != INITIAL);
            ratios.extend(own.and_then(|own| Some(total(own)? / total(record)?)));
        }
        frozen.retain(|record| !repeated[&row(record)]);
        records.extend(frozen);
        let mut notes: Vec<String> = self.earlier_definitions().into_iter().collect();
        let mean = |ratios: &[f64]| {
            let sum: f64 = ratios.iter().map(|ratio| ratio.ln()).sum();
            significant((sum / ratios.len() as f64).exp(), 3)
        };
        for (name, (compared, differing)) in &errors {
            if !differing.is_empty() {
                notes.push(format!(
                    "{name}: {} of {compared} results differ from those of edition {}. Hausdorff error here ÷ there: {}, \
                     geometric mean.",
                    differing.len(),
                    edition.name,
                    mean(differing)
                ));
            }
        }
        if !ratios.is_empty() {
            notes.push(format!(
                "This machine takes {} times the seconds of edition {}: geometric mean over {} equal results.",
                mean(&ratios),
                edition.name,
                ratios.len()
            ));
        }
        let left_out: BTreeSet<&str> = others.iter().map(|record| record.mesh.as_str()).collect();
        let list = |names: Vec<String>| names.join(", ");
        if !left_out.is_empty() {
            let names = list(left_out.iter().map(|&name| name.to_owned()).collect());
            let count = left_out.len();
            let (are, they) = if count == 1 { ("mesh is", "its") } else { ("meshes are", "their") };
            notes.push(format!(
                "{count} {are} not in edition {} and left out of the tables and plots: {names}; a report without \
                 --against has {they} results.",
                edition.name
            ));
        }
        let [here, all] = [names.len(), edition.mesh.len()];
        if here < all {
            let name = &edition.name;
            notes
                .push(format!("This comparison has {here} of the {all} meshes of edition {name}."));
        }
        let other = counts.iter().filter(|count| !edition.spheres.contains(count));
        let other: Vec<String> = other.map(usize::to_string).collect();
        if !other.is_empty() {
            let known = list(edition.spheres.iter().map(usize::to_string).collect());
            notes.push(format!(
                "Edition {} has no results at these sphere counts: {} (it has {known}).",
                edition.name,
                list(other)
            ));
        }
        Mixed { records, notes }
    }
}

/// Errors below this share of the diagonal are rounding.
const NEGLIGIBLE: f64 = 1e-9;
