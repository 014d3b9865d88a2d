//! From a study to its items.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use medial_reports::Target;

use super::{Study, StudyError, StudyMethod, VOLUME_DEPTH};
use crate::run::public::Library;
use crate::run::{
    Entry, INITIAL, Input, InputError, Item, Limits, Measure, MethodSpec, Noise, Provenance,
    Registry, SceneSpec, Source, hex_digest,
};

/// What is the same for all items of this process.
#[derive(Clone, Debug)]
pub struct Here {
    /// SHA-256 of the program.
    pub binary: String,
    /// Threads where a study says nothing.
    pub threads: usize,
    /// Memory of the machine, in bytes; 0 where it is not known.
    pub memory: u64,
}

impl Here {
    /// What this process is.
    pub fn of(provenance: &Provenance) -> Self {
        Self {
            binary: provenance.binary_hash.clone(),
            threads: rayon::current_num_threads(),
            memory: provenance.machine.memory,
        }
    }
}

impl Study {
    /// The methods of the study: those named, or all there are.
    ///
    /// # Errors
    /// [`StudyError::Method`] for an id that no method has; [`StudyError::Value`] for two rows of
    /// one name.
    pub fn entries<'r>(
        &self,
        registry: &'r Registry,
    ) -> Result<Vec<(StudyMethod, &'r Entry)>, StudyError> {
        let mut methods = self.methods.clone();
        if methods.is_empty() {
            methods = registry.usual().map(|e| StudyMethod::of(e.id())).collect();
        }
        for then in &self.after_filters {
            let filters = registry.entries().iter().filter(|e| e.presentation().filter.is_some());
            let chains = filters.map(|filter| format!("{}+{then}", filter.id()));
            methods.extend(chains.map(|id| StudyMethod::of(&id)));
        }
        if !self.counts_only {
            methods.insert(0, StudyMethod::of(INITIAL));
        }
        let mut found: Vec<(StudyMethod, &Entry)> = Vec::new();
        for method in &methods {
            let entry = registry.entry(&method.id).ok_or_else(|| StudyError::Method {
                id: method.id.clone(),
                known: registry.entries().iter().map(|entry| entry.id().to_owned()).collect(),
            })?;
            // The same row twice would be one row with twice the weight.
            if found.iter().any(|(other, _)| other == method) {
                continue;
            }
            if let Some(name) = &method.name
                && found.iter().any(|(other, _)| other.name.as_ref() == Some(name))
            {
                return Err(StudyError::Value(format!("two methods are named `{name}`")));
            }
            found.push((method.clone(), entry));
        }
        Ok(found)
    }

    /// The inputs of the study: those named and those of the set; [`Source::built_ins`] where there
    /// are none.
    ///
    /// # Errors
    /// When one does not exist, or is no input.
    pub fn sources(&self) -> Result<Vec<Source>, StudyError> {
        let mut sources = Vec::new();
        for mesh in &self.meshes {
            sources.push(Source::parse(&self.resolved(mesh))?);
        }
        if sources.is_empty() && self.dataset.is_empty() {
            sources = Source::built_ins();
        }
        for word in &self.dataset {
            match word.as_str() {
                "builtin" => sources.extend(Source::built_ins()),
                word => sources.extend(Library::here().and_then(|library| library.sources(word))?),
            }
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
    pub fn items(&self, registry: &Registry, here: &Here) -> Result<Vec<Item>, StudyError> {
        self.check()?;
        let methods = self.entries(registry)?;
        let sources = self.sources()?;
        let names = unique_names(&sources);
        let files = self.given_files(&names)?;
        let mut items = Vec::new();
        for (source, mesh) in sources.iter().zip(names) {
            let hash = match source.path() {
                Some(path) => hash_of(path)?,
                None => Input::load(source)?.hash,
            };
            let scene = SceneSpec {
                mesh,
                source: source.clone(),
                hash: Some(hash),
                noise: None,
                sampling: self.sampling,
                dual: self.dual,
                measure: self.measure(),
            };
            for (method, entry) in &methods {
                items.push(self.item(scene.clone(), method, entry, here));
            }
            for &eta in &self.noise {
                let mesh = format!("{} noise {eta}", scene.mesh);
                let noise = Some(Noise { eta, seed: self.seed });
                let noisy = SceneSpec { mesh, noise, ..scene.clone() };
                for (method, entry) in &methods {
                    items.push(self.item(noisy.clone(), method, entry, here));
                }
            }
            let of_mesh = files.iter().filter(|file| file.mesh == scene.mesh);
            items.extend(of_mesh.map(|file| self.given_item(scene.clone(), file, here)));
        }
        Ok(items)
    }

    fn measure(&self) -> Measure {
        Measure {
            samples: self.samples,
            volume_depth: VOLUME_DEPTH,
            seed: self.seed,
            certify: self.certify,
        }
    }

    fn item(&self, scene: SceneSpec, method: &StudyMethod, entry: &Entry, here: &Here) -> Item {
        Item {
            scene,
            method: MethodSpec {
                id: method.id.clone(),
                name: method.name.clone(),
                params: method.params.clone(),
                fingerprint: entry.fingerprint().map(str::to_owned),
            },
            levels: self.levels(method, entry),
            seed: self.seed,
            repeat: self.repeat,
            threads: self.threads.unwrap_or(here.threads),
            limits: self.limits(here),
            version: entry.version(&here.binary),
            binary: here.binary.clone(),
        }
    }

    /// The limits of each item.
    pub fn limits(&self, here: &Here) -> Limits {
        let machine = if here.memory == 0 { u64::MAX } else { here.memory / 4 * 3 };
        let bytes = self.memory.map_or(machine, |megabytes| megabytes.saturating_mul(1_000_000));
        Limits { seconds: self.timeout, bytes }
    }

    /// The published level, the counts, the method's own levels and the error bounds, each from
    /// fine to coarse.
    fn levels(&self, method: &StudyMethod, entry: &Entry) -> Vec<Target> {
        let info = entry.method().info();
        if info.fixed {
            return vec![Target::Published];
        }
        let mut levels = Vec::new();
        if method.published.unwrap_or(self.published) {
            levels.push(Target::Published);
        }
        let mut counts = method.spheres.as_ref().unwrap_or(&self.spheres).clone();
        counts.sort_unstable_by(|a, b| b.cmp(a));
        counts.dedup();
        levels.extend(counts.into_iter().map(Target::Spheres));
        let mut native = match method.levels.is_empty() && !self.counts_only {
            true => entry.presentation().sweep.clone(),
            false => method.levels.clone(),
        };
        native.sort_by(f64::total_cmp);
        native.dedup();
        if info.native.as_ref().is_some_and(|native| !native.larger_is_coarser) {
            native.reverse();
        }
        levels.extend(native.into_iter().map(Target::Native));
        // Last and from loose to tight, since a search that does not end must cost nothing else.
        let mut bounds = self.max_error.clone();
        bounds.sort_by(|a, b| b.total_cmp(a));
        bounds.dedup();
        levels.extend(bounds.into_iter().map(Target::MaxError));
        levels
    }
}

/// One of N shares of a study's items.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// From 1 to `of`.
    pub number: usize,
    /// Number of shares.
    pub of: usize,
}

impl Shard {
    /// Reads `I/N`.
    ///
    /// # Errors
    /// [`StudyError::Value`] where it is not two numbers, the first from 1 to the second.
    pub fn parse(text: &str) -> Result<Self, StudyError> {
        let wrong = || StudyError::Value(format!("--shard {text}: write I/N with I from 1 to N"));
        let (number, of) = text.split_once('/').ok_or_else(wrong)?;
        let (number, of) = (number.parse().ok(), of.parse().ok());
        let (number, of) = number.zip(of).ok_or_else(wrong)?;
        if number == 0 || number > of { Err(wrong()) } else { Ok(Self { number, of }) }
    }

    /// Every Nth item. The place in the whole study decides, not what a store lacks: a shard that is
    /// run again continues with its own items. The start moves from mesh to mesh, so that no shard
    /// gets one method on all meshes.
    pub fn share(self, items: Vec<Item>) -> Vec<Item> {
        let mut shares = Vec::new();
        for (mesh, of_mesh) in items.chunk_by(|a, b| a.scene == b.scene).enumerate() {
            let own = |place: &usize| (place + mesh) % self.of == self.number - 1;
            shares.extend((0..of_mesh.len()).filter(own).map(|place| of_mesh[place].clone()));
        }
        shares
    }
}

pub(super) fn hash_of(path: &Path) -> Result<String, StudyError> {
    let read = std::fs::read(path);
    let bytes = read.map_err(|error| InputError::Read { path: path.to_owned(), error })?;
    Ok(hex_digest(&bytes))
}

/// A name for each source, unlike every other even as the stem of a file: the file's stem, where
/// that is not enough its name with the extension, then with its folder, then a number.
pub(super) fn unique_names(sources: &[Source]) -> Vec<String> {
    let key = |name: &str| medial_reports::file_stem(name).to_ascii_lowercase();
    let mut names: Vec<String> = sources.iter().map(Source::name).collect();
    for depth in 1..=2 {
        let mut count: HashMap<String, usize> = HashMap::new();
        names.iter().for_each(|name| *count.entry(key(name)).or_default() += 1);
        for (name, source) in names.iter_mut().zip(sources) {
            if count[&key(name)] > 1 {
                *name = source.long_name(depth);
            }
        }
    }
    let mut taken = HashSet::new();
    for name in &mut names {
        let base = name.clone();
        let mut number = 2;
        while !taken.insert(key(name)) {
            *name = format!("{base}-{number}");
            number += 1;
        }
    }
    names
}
