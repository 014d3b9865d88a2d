//! Editions: frozen results that new ones are compared against, without a run of their methods.
//!
//! An edition is known by its name if it is part of the program; any other store serves as one by its folder. Its rows are matched by the hash of the
//! mesh, not by its name, and by the level. Everything that decides a measured number must be the study's: the samples,
//! the seed, the sampling of the start, and the version of the metrics' definitions.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use medial::metrics::DEFINITIONS;
use medial_reports::editions::{EDITIONS, Embedded, unpack};
use medial_run::item::Item;
use medial_run::journal::{RESULTS, read_records};
use medial_run::level::Target;
use medial_run::record::{Conditions, Record};
use medial_run::settings::VOLUME_DEPTH;
use medial_run::text::{did_you_mean, significant};
use serde::Deserialize;
use serde_json::json;

use crate::exit::Failure;
use crate::study::registry::{INITIAL, Registry};
use crate::study::{Study, parse_toml};

/// What a comparison has to share with an edition: of `edition.toml`, or of the records of a store.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Description {
    /// Name, that of its folder.
    pub name: String,
    /// Version of the definitions of the metrics.
    pub metrics: u32,
    /// Surface samples of the evaluation.
    pub samples: usize,
    /// Levels of division of space for the volume difference.
    pub volume_depth: u32,
    /// Seed of every random choice.
    pub seed: u64,
    /// Boundary samples of the start of all methods.
    pub sampling: String,
    /// Triangulation of the dual Voronoi polygons.
    pub dual: String,
    /// Sphere counts.
    pub spheres: Vec<usize>,
    /// The meshes.
    pub mesh: Vec<EditionMesh>,
}

/// A mesh of an edition.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct EditionMesh {
    /// Name in the tables of the edition.
    pub name: String,
    /// Its argument on the command line; `medial datasets fetch` fetches `dataset:NAME`.
    pub source: String,
    /// SHA-256 of its file; of a built-in shape its surface and known axis.
    pub sha256: String,
}

/// An edition: its description and its records.
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

    /// Opens an edition by its name, or a store by its folder.
    ///
    /// # Errors
    /// When there is no such edition, or the store has no readable record.
    pub fn open(name: &Path) -> Result<Self, Failure> {
        let embedded = EDITIONS.iter().find(|edition| Path::new(edition.name) == name);
        match embedded {
            Some(Embedded { name, description, records, .. }) => {
                let failed = |why: String| Failure::input(format!("edition {name}: {why}"));
                let records = unpack(records).map_err(|error| failed(error.to_string()))?.records;
                Ok(Self { description: parse_toml(description).map_err(failed)?, records })
            }
            None if name.is_dir() => Self::of_store(name),
            None => {
                let known: Vec<&str> = EDITIONS.iter().map(|edition| edition.name).collect();
                let name = name.display().to_string();
                let meant = did_you_mean(&name, known.iter().copied());
                let known = known.join(", ");
                Err(Failure::usage(format!(
                    "--against {name}: unknown edition{meant} (expected a store or one of: {known})"
                )))
            }
        }
    }

    /// The records of a store that were measured like its last one: of each result the last.
    fn of_store(folder: &Path) -> Result<Self, Failure> {
        let mut records = read_records(&folder.join(RESULTS))?.records;
        let Some(last) = records.last() else { return Err(Failure::at(folder, "no record")) };
        let settings = |record: &Record| {
            let Conditions { sampling, dual, samples, .. } = record.conditions.clone();
            (sampling, dual, samples, record.seeds.get("evaluation").copied().unwrap_or_default())
        };
        let of_all = settings(last);
        let mut seen = BTreeSet::new();
        records.reverse();
        records.retain(|record| {
            let Record { mesh_hash, simplify, .. } = record;
            let (method, variant) = (&simplify.method, &simplify.variant);
            let row = json!([mesh_hash, method, variant, simplify.params, simplify.level]);
            settings(record) == of_all && seen.insert((row.to_string(), simplify.seed))
        });
        records.reverse();
        let counts = records.iter().filter_map(|record| match record.simplify.level {
            Target::Spheres(count) => Some(count),
            _ => None,
        });
        let spheres: BTreeSet<usize> = counts.collect();
        let meshes = records.iter().filter_map(|r| Some((r.mesh_hash.as_ref()?, &r.mesh)));
        let meshes: BTreeMap<&String, &String> = meshes.collect();
        let mesh = meshes.into_iter().map(|(hash, name)| EditionMesh {
            name: name.clone(),
            source: name.clone(),
            sha256: hash.clone(),
        });
        let (sampling, dual, samples, seed) = of_all;
        let description = Description {
            name: folder.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            metrics: DEFINITIONS,
            samples,
            volume_depth: VOLUME_DEPTH,
            seed,
            sampling,
            dual,
            spheres: spheres.into_iter().rev().collect(),
            mesh: mesh.collect(),
        };
        Ok(Self { description, records })
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
