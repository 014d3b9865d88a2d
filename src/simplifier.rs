//! The one door for every method: [`MedialSimplifier`], what it is asked, and what it answers.
//!
//! A method is prepared once for a shape ([`MedialSimplifier::prepare`]) and then asked for as
//! many levels as wanted ([`Simplification::at`]), so that filters rank once and edge-collapse
//! methods continue from finer levels.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::Vec3;
use crate::complex::collapse::Hierarchy;
use crate::complex::{ComplexError, MedialMesh, cubical_betti};
use crate::shape::{Cost, Shape, ShapeError};

/// A method that simplifies the medial axis of a shape.
pub trait MedialSimplifier: Send + Sync {
    /// Id, title, citation, native level, parameters with units and defaults.
    fn info(&self) -> &MethodInfo;

    /// All work that does not depend on the level. Timed as `prepare`.
    ///
    /// # Errors
    /// [`SimplifyError::Parameter`] when `params` does not fit the method, [`SimplifyError::Shape`]
    /// when a substrate cannot be built, [`SimplifyError::Unsupported`] when the method does not
    /// apply to this shape.
    fn prepare<'s>(
        &self,
        shape: &'s Shape,
        params: &Params,
        run: &RunContext,
    ) -> Result<Box<dyn Simplification + 's>, SimplifyError>;

    /// Whether the answers carry a hierarchy in [`Extras`] that [`MedialSimplifier::resume`] can go
    /// on from.
    fn has_hierarchy(&self) -> bool {
        false
    }

    /// Whether the answers carry voxels in [`Extras`].
    fn has_voxels(&self) -> bool {
        false
    }

    /// The levels of a hierarchy that an earlier run of this method gave in [`Extras`], in place
    /// of [`MedialSimplifier::prepare`].
    ///
    /// # Errors
    /// [`SimplifyError::Unsupported`] when the method has no hierarchy,
    /// [`SimplifyError::Hierarchy`] when this one is not of this method,
    /// [`SimplifyError::Parameter`] as in [`MedialSimplifier::prepare`].
    fn resume(
        &self,
        hierarchy: Arc<Hierarchy>,
        params: &Params,
    ) -> Result<Box<dyn Simplification>, SimplifyError> {
        let _ = (hierarchy, params);
        let why = format!("{} has no hierarchy to go on from", self.info().title);
        Err(SimplifyError::Unsupported { why })
    }
}

/// One shape, prepared once, asked for many levels.
pub trait Simplification: Send {
    /// The simplified medial mesh at a level. Levels asked from fine to coarse may continue from
    /// earlier work, and say so in [`Simplified::work`].
    ///
    /// # Errors
    /// [`SimplifyError::Unsupported`] when the method has no such level,
    /// [`SimplifyError::Cancelled`] when the run was cancelled.
    fn at(&mut self, level: Level) -> Result<Simplified, SimplifyError>;
}

/// How far to simplify.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Level {
    /// The paper's own defaults: a constant, a schedule, no scalar at all.
    Published,
    /// A number of spheres: what makes methods comparable.
    Spheres(usize),
    /// The method's own scalar, in the unit that [`MethodInfo::native`] names.
    Native(f64),
}

impl fmt::Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Published => write!(f, "published"),
            Self::Spheres(count) => write!(f, "{count} spheres"),
            Self::Native(value) => write!(f, "level {value}"),
        }
    }
}

/// What a method says of itself.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MethodInfo {
    /// Short name for the command line, such as `qmat`.
    pub id: &'static str,
    /// Full name.
    pub title: &'static str,
    /// Authors, year, title, venue, DOI.
    pub citation: &'static str,
    /// One sentence on what the method does.
    pub summary: &'static str,
    /// The method's own level, where it has a scalar one.
    pub native: Option<NativeLevel>,
    /// What [`Level::Published`] means here.
    pub published: &'static str,
    /// Parameters, in the order of the paper.
    pub params: Vec<ParamInfo>,
}

/// The scalar that a method is controlled by in its paper.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NativeLevel {
    /// Name in the paper, such as `theta`.
    pub name: &'static str,
    /// Unit, such as `degrees` or `fraction of the diagonal`.
    pub unit: &'static str,
    /// Whether a larger value leaves fewer spheres.
    pub larger_is_coarser: bool,
}

/// One parameter of a method.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ParamInfo {
    /// Key for `--set key=value`.
    pub name: &'static str,
    /// Default, as it would be written on the command line.
    pub default: String,
    /// Unit, or the list of allowed words.
    pub unit: &'static str,
    /// One sentence.
    pub help: &'static str,
}

/// Parameters as given by the user, not yet typed: a JSON object.
///
/// Each method turns them into its own struct (`Default` = the paper's values, unknown keys
/// refused) by [`Params::typed`]; this is the one place where the type is erased.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Params(pub serde_json::Map<String, serde_json::Value>);

impl Params {
    /// No parameter set: the paper's values.
    pub fn none() -> Self {
        Self::default()
    }

    /// Sets one parameter from text: a JSON scalar where the text is one, else a string.
    pub fn set(&mut self, key: &str, value: &str) {
        let value = serde_json::from_str(value).unwrap_or_else(|_| value.into());
        self.0.insert(key.to_owned(), value);
    }

    /// The method's own parameter struct.
    ///
    /// # Errors
    /// [`SimplifyError::Parameter`] with serde's message when a key is unknown or a value is of
    /// the wrong type; it names the key.
    pub fn typed<T: DeserializeOwned>(&self) -> Result<T, SimplifyError> {
        let parse = |map: &serde_json::Map<String, serde_json::Value>| {
            serde_json::from_value::<T>(serde_json::Value::Object(map.clone()))
                .map_err(|error| error.to_string())
        };
        parse(&self.0).map_err(|message| {
            // Serde does not say which key a wrong value belongs to: the one that fails alone too.
            let fails_alone = |&(key, value): &(&String, &serde_json::Value)| {
                let alone = serde_json::Map::from_iter([(key.clone(), value.clone())]);
                parse(&alone).is_err_and(|error| error == message)
            };
            let named = match self.0.iter().find(fails_alone) {
                Some((key, value)) => format!("{key} = {value}: {message}"),
                None => message,
            };
            SimplifyError::Parameter(named)
        })
    }
}

/// What surrounds a run: seed, cancellation, progress. The number of threads is that of the
/// rayon pool in which the method is called.
#[derive(Clone, Default)]
pub struct RunContext {
    /// Seed of every random choice.
    pub seed: u64,
    cancelled: Arc<AtomicBool>,
    progress: Option<Arc<dyn Fn(Progress) + Send + Sync>>,
}

/// A step towards the end of the current stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Steps done.
    pub done: usize,
    /// Steps in all.
    pub total: usize,
}

impl RunContext {
    /// A context with a seed, never cancelled, that reports to nobody.
    pub fn with_seed(seed: u64) -> Self {
        Self { seed, ..Self::default() }
    }

    /// The same context, reporting to `progress`.
    pub fn on_progress(mut self, progress: impl Fn(Progress) + Send + Sync + 'static) -> Self {
        self.progress = Some(Arc::new(progress));
        self
    }

    /// The flag that cancels the run once it is set.
    pub fn cancel_flag(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.cancelled)
    }

    /// Reports progress and asks whether to go on. Called every few thousand steps.
    ///
    /// # Errors
    /// [`SimplifyError::Cancelled`] once the flag is set.
    pub fn step(&self, done: usize, total: usize) -> Result<(), SimplifyError> {
        if let Some(progress) = &self.progress {
            progress(Progress { done, total });
        }
        if self.cancelled.load(Ordering::Relaxed) {
            return Err(SimplifyError::Cancelled);
        }
        Ok(())
    }
}

/// A simplified medial mesh and what is to be known of it.
#[derive(Clone, Debug)]
pub struct Simplified {
    /// The medial mesh, in normalised units, in canonical form.
    pub mesh: MedialMesh,
    /// The level that was asked.
    pub asked: Level,
    /// The native level that was used to meet the request, where the method has one.
    pub native_level: Option<f64>,
    /// Whether this level was reached by going on from the previous one.
    pub work: Work,
    /// Why fewer or more spheres than asked were returned, rejected collapses, and the like.
    pub diagnostics: Diagnostics,
    /// What only some methods have.
    pub extras: Extras,
}

/// What some methods give beside the medial mesh, each `None` where a method has no such thing.
#[derive(Clone, Debug, Default)]
pub struct Extras {
    /// All levels of the method at once. [`MedialSimplifier::resume`] of the same method goes on
    /// from it without the shape.
    pub hierarchy: Option<Arc<Hierarchy>>,
    /// The parts that the medial mesh was decomposed into, by id.
    pub parts: Option<Vec<PartInfo>>,
    /// The voxels of a cubic lattice that the spheres stand for, one for each sphere in the same
    /// order.
    pub voxels: Option<Arc<LatticeVoxels>>,
}

/// Voxels of a cubic lattice.
#[derive(Clone, Debug, PartialEq)]
pub struct LatticeVoxels {
    /// Lower corner of the lattice, in normalised units.
    pub origin: Vec3,
    /// Side of a voxel, in normalised units.
    pub side: f64,
    /// Voxels of the lattice along each axis.
    pub size: [u32; 3],
    /// The voxels, by `z`, then `y`, then `x`.
    pub voxels: Vec<LatticeVoxel>,
}

/// A voxel with what was measured there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LatticeVoxel {
    /// Indices along the axes, from the lower corner.
    pub place: [u32; 3],
    /// Distance of its centre to the surface, in normalised units, to single precision.
    pub distance: f64,
    /// Average outward flux of the gradient of the distance, `AOF'`; 0 where it was not measured.
    pub flux: f64,
}

impl LatticeVoxels {
    /// Centre of a voxel, in normalised units.
    pub fn centre(&self, voxel: &LatticeVoxel) -> Vec3 {
        self.origin + (Vec3::from(voxel.place.map(f64::from)) + 0.5) * self.side
    }

    /// Betti numbers of the union of the closed voxels.
    pub fn betti(&self) -> [u64; 3] {
        cubical_betti(&self.voxels.iter().map(|voxel| voxel.place).collect::<Vec<_>>())
    }
}

/// A part of a medial mesh, for methods that decompose it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PartInfo {
    /// Consecutive from 0, the largest part first.
    pub id: u32,
    /// 1 at a free edge, 2 beside a part of level 1, and so on; 0 where no free edge can be reached.
    pub level: u32,
    /// Number of faces.
    pub triangles: usize,
    /// Volume of the feature that the part stands for, as a fraction of the solid's.
    pub volume: f64,
    /// Centroid, in normalised units.
    pub centre: [f64; 3],
    /// Whether removing it leaves components and loops of the whole as they are.
    pub removable: bool,
    /// Whether it was removed on demand, and is not in the medial mesh any more.
    pub removed: bool,
}

/// How the work of one level relates to earlier levels; decides what counts into its seconds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Work {
    /// All of it was done for this level: its seconds are those of this call.
    Anew,
    /// It went on from the previous call: its seconds add to those.
    Continued,
    /// Parts of it had been done for earlier calls: what these cost then adds to the seconds of
    /// this call.
    Reused(Cost),
}

/// Counts and remarks beside a result.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Diagnostics {
    /// Named counts, such as `rejected_by_link_condition`, in the order of the algorithm.
    pub counts: Vec<(String, u64)>,
    /// Sentences for the user, such as why the asked count was not reached.
    pub warnings: Vec<String>,
}

impl Diagnostics {
    /// Adds a named count.
    pub fn count(&mut self, name: &str, value: usize) {
        self.counts.push((name.to_owned(), value as u64));
    }

    /// Adds a warning.
    pub fn warn(&mut self, warning: impl Into<String>) {
        self.warnings.push(warning.into());
    }
}

/// Why a method gave no result.
#[derive(Debug, thiserror::Error)]
pub enum SimplifyError {
    /// The method does not do this: an answer, not a failure.
    #[error("unsupported: {why}")]
    Unsupported {
        /// What it does not do, and what it does instead.
        why: String,
    },
    /// A parameter is unknown, of the wrong type or out of range.
    #[error("parameter: {0}")]
    Parameter(String),
    /// A level is out of range.
    #[error("level: {0}")]
    Level(String),
    /// A substrate could not be built for this shape.
    #[error(transparent)]
    Shape(#[from] ShapeError),
    /// The method returned a complex that is not valid.
    #[error("invalid output: {0}")]
    InvalidOutput(#[from] ComplexError),
    /// A hierarchy cannot be built, or is not one of the method that was asked to go on from it.
    #[error("hierarchy: {0}")]
    Hierarchy(String),
    /// The run was cancelled.
    #[error("cancelled")]
    Cancelled,
}
