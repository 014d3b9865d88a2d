//! The interface of every method: [`MedialSimplifier`], its levels and its results.
//!
//! A method is prepared once for a shape ([`MedialSimplifier::prepare`]). Then
//! [`Simplification::at`] returns any number of levels, so that filters rank once and methods that
//! collapse edges continue from finer levels.

mod info;

use std::any::{Any, TypeId, type_name};
use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::complex::{ComplexError, MedialMesh};
use crate::shape::{Shape, ShapeError};

pub use crate::diagnostics::Diagnostics;
pub use info::{
    Capability, MethodInfo, NativeLevel, NoParams, ParamFields, ParamInfo, Params, Presentation,
    Registered,
};

/// A method that simplifies the medial axis of a shape.
///
/// The smallest method is a description and a function from a shape and a number of spheres to a
/// medial mesh ([`simple`]). This one keeps the largest balls:
///
/// ```
/// use medial::simplifier::{MedialSimplifier, MethodInfo, simple};
///
/// fn largest() -> impl MedialSimplifier {
///     simple(MethodInfo::new("largest", "Largest balls first"), |shape, spheres| {
///         let initial = shape.initial()?;
///         let mut order: Vec<usize> = (0..initial.spheres.len()).collect();
///         order.sort_by(|&a, &b| initial.spheres[b].radius.total_cmp(&initial.spheres[a].radius));
///         let mut keep = vec![false; order.len()];
///         order.iter().take(spheres).for_each(|&sphere| keep[sphere] = true);
///         Ok(initial.induced(&keep))
///     })
/// }
///
/// # use medial::shape::Shape;
/// # use medial::simplifier::{Level, Params, RunContext};
/// # let tetrahedron = medial::surface::read_bytes(
/// #     b"OFF 4 4 6\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n",
/// #     medial::surface::Format::Off,
/// # )?;
/// # let options = medial::shape::ShapeOptions {
/// #     sampling: "uniform:300".parse()?,
/// #     ..Default::default()
/// # };
/// # let shape = Shape::new("tetrahedron", &tetrahedron.mesh, tetrahedron.report, options)?;
/// let mut levels = largest().prepare(&shape, &Params::none(), &RunContext::default())?;
/// assert_eq!(levels.at(Level::Spheres(20))?.mesh.spheres.len(), 20);
/// # let mut wrong = Params::none();
/// # wrong.set("most", "1");
/// # assert!(largest().prepare(&shape, &wrong, &RunContext::default()).is_err());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// A method with parameters, or with work that serves all levels, is a [`Method`].
pub trait MedialSimplifier: Send + Sync {
    /// Id, title, citation, native level, parameters with units and defaults, and the extras of its
    /// results.
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
}

/// One shape, prepared once for many levels.
pub trait Simplification: Send {
    /// The simplified medial mesh at a level. It depends on the level alone, never on earlier calls.
    ///
    /// An [incremental](MethodInfo::incremental) method may continue from the state of the previous
    /// call. Every other method computes each level from the prepared state: a cache between calls
    /// would make the seconds of a level depend on the levels before it.
    ///
    /// # Errors
    /// [`SimplifyError::Unsupported`] when the method has no such level,
    /// [`SimplifyError::Cancelled`] when the run was cancelled.
    fn at(&mut self, level: Level) -> Result<Simplified, SimplifyError>;
}

/// A closure is enough where a method needs no helper besides [`Simplification::at`].
impl<F> Simplification for F
where
    F: FnMut(Level) -> Result<Simplified, SimplifyError> + Send,
{
    fn at(&mut self, level: Level) -> Result<Simplified, SimplifyError> {
        self(level)
    }
}

/// How far to simplify.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Level {
    /// The paper's own defaults: a constant, a schedule, no scalar at all.
    Published,
    /// A number of spheres: methods are compared at equal numbers.
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

/// A simplified medial mesh with its diagnostics.
#[derive(Clone, Debug)]
pub struct Simplified {
    /// The medial mesh, in normalised units, in canonical form.
    pub mesh: MedialMesh,
    /// The requested level.
    pub asked: Level,
    /// The native level that was used to meet the request, where the method has one.
    pub native_level: Option<f64>,
    /// Why the count differs from the requested one, rejected collapses, and the like.
    pub diagnostics: Diagnostics,
    /// Results that only some methods have; [`MethodInfo::extras`] announces them.
    pub extras: Extras,
}

impl Simplified {
    /// A medial mesh without native level, diagnostics and extras.
    pub fn new(mesh: MedialMesh, asked: Level) -> Self {
        let (diagnostics, extras) = (Diagnostics::default(), Extras::default());
        Self { mesh, asked, native_level: None, diagnostics, extras }
    }
}

// Methods made of a description and one function.

/// The function of a [`Method`]: prepares one shape with typed parameters.
///
/// It does all work that does not depend on the level; see [`MedialSimplifier::prepare`].
pub type Prepare<P> =
    for<'s> fn(&'s Shape, P, &RunContext) -> Result<Box<dyn Simplification + 's>, SimplifyError>;

/// A method made of its description and one function: all that most methods need.
///
/// `P` is the struct of its parameters, usually declared with [`parameters!`](crate::parameters).
/// The user's settings become a `P` here, and nowhere else, before the function is called;
/// [`NoParams`] is for methods without parameters. [`simple`] is shorter still.
pub struct Method<P> {
    info: MethodInfo,
    prepare: Prepare<P>,
}

impl<P> Method<P> {
    /// A method.
    pub fn new(info: MethodInfo, prepare: Prepare<P>) -> Self {
        Self { info, prepare }
    }
}

impl<P: DeserializeOwned> MedialSimplifier for Method<P> {
    fn info(&self) -> &MethodInfo {
        &self.info
    }

    fn prepare<'s>(
        &self,
        shape: &'s Shape,
        params: &Params,
        run: &RunContext,
    ) -> Result<Box<dyn Simplification + 's>, SimplifyError> {
        (self.prepare)(shape, params.typed()?, run)
    }
}

impl<P> Clone for Method<P> {
    fn clone(&self) -> Self {
        Self { info: self.info.clone(), prepare: self.prepare }
    }
}

impl<P> fmt::Debug for Method<P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Method").field("info", &self.info).finish_non_exhaustive()
    }
}

/// A method whose only level is a number of spheres, computed by one function without parameters.
pub struct Simple<F> {
    info: MethodInfo,
    function: F,
}

/// The smallest method: `function` returns the medial mesh of a shape with at most a number of
/// spheres, at least 1. See [`MedialSimplifier`] for an example.
pub fn simple<F>(info: MethodInfo, function: F) -> Simple<F>
where
    F: Fn(&Shape, usize) -> Result<MedialMesh, SimplifyError> + Clone + Send + Sync + 'static,
{
    Simple { info, function }
}

impl<F> MedialSimplifier for Simple<F>
where
    F: Fn(&Shape, usize) -> Result<MedialMesh, SimplifyError> + Clone + Send + Sync + 'static,
{
    fn info(&self) -> &MethodInfo {
        &self.info
    }

    fn prepare<'s>(
        &self,
        shape: &'s Shape,
        params: &Params,
        _run: &RunContext,
    ) -> Result<Box<dyn Simplification + 's>, SimplifyError> {
        let NoParams {} = params.typed()?;
        let function = self.function.clone();
        Ok(Box::new(move |level: Level| match level {
            Level::Spheres(0) => Err(SimplifyError::Level("0 spheres: expected at least 1".into())),
            Level::Spheres(count) => Ok(Simplified::new(function(shape, count)?, level)),
            _ => Err(SimplifyError::unsupported("request a number of spheres")),
        }))
    }
}

// The context of a run, and its errors.

/// The context of a run: seed, cancellation, progress. The number of threads is that of the
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
    /// A context with a seed, never cancelled, without reports.
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

    /// Whether the run was cancelled: for work that only waits, and has no progress to report.
    pub fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }

    /// Reports progress and checks for cancellation. Called every few thousand steps.
    ///
    /// # Errors
    /// [`SimplifyError::Cancelled`] once the flag is set.
    pub fn step(&self, done: usize, total: usize) -> Result<(), SimplifyError> {
        if let Some(progress) = &self.progress {
            progress(Progress { done, total });
        }
        self.check()
    }

    /// Checks for cancellation. Cheap: called at each step of a loop, of which some report no progress.
    ///
    /// # Errors
    /// [`SimplifyError::Cancelled`] once the flag is set.
    pub fn check(&self) -> Result<(), SimplifyError> {
        if self.is_cancelled() { Err(SimplifyError::Cancelled) } else { Ok(()) }
    }
}

/// Why a method gave no result.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages name the fields")]
pub enum SimplifyError {
    /// The method does not support this: not a failure.
    #[error("unsupported: {why}")]
    Unsupported { why: String },
    /// A parameter is unknown, of the wrong type or out of range.
    #[error("parameter: {0}")]
    Parameter(String),
    /// A level is out of range.
    #[error("level: {0}")]
    Level(String),
    /// A substrate could not be built for this shape.
    #[error(transparent)]
    Shape(#[from] ShapeError),
    /// The method returned something that is no valid complex.
    #[error("invalid output: {0}")]
    InvalidOutput(String),
    /// The method failed, with its message.
    #[error("failed: {0}")]
    Failed(String),
    /// An allocation of the method failed, and the method survived it.
    #[error("out of memory: {0}")]
    OutOfMemory(String),
    /// The method's program was ended by a signal.
    #[error("crashed: {0}")]
    Crashed(String),
    /// The run was cancelled.
    #[error("cancelled")]
    Cancelled,
}

impl SimplifyError {
    /// [`SimplifyError::Unsupported`] with the missing feature, and the alternative.
    pub fn unsupported(why: impl Into<String>) -> Self {
        Self::Unsupported { why: why.into() }
    }
}

impl From<ComplexError> for SimplifyError {
    fn from(error: ComplexError) -> Self {
        Self::InvalidOutput(error.to_string())
    }
}

// Results of some methods only, stored by type.

/// Results of a method besides the medial mesh: at most one value of each type.
///
/// A method that has voxels, named parts or a hierarchy defines their type, or takes one that
/// exists, and announces it in [`MethodInfo::extras`](MethodInfo::extras). Code that knows the type can request it;
/// all other code passes it on. Clones share the values.
///
/// ```
/// use medial::simplifier::Extras;
///
/// struct Seams(Vec<[u32; 2]>);
/// let extras = Extras::with(Seams(vec![[0, 1]]));
/// assert_eq!(extras.get::<Seams>().map(|seams| seams.0.len()), Some(1));
/// assert!(extras.get::<String>().is_none());
/// ```
#[derive(Clone, Default)]
pub struct Extras {
    /// In the order of insertion. A handful at most: a map would cost more than the search.
    entries: Vec<Entry>,
}

#[derive(Clone)]
struct Entry {
    key: TypeId,
    name: &'static str,
    value: Arc<dyn Any + Send + Sync>,
}

impl Extras {
    /// One value.
    pub fn with<T: Any + Send + Sync>(value: T) -> Self {
        let mut extras = Self::default();
        extras.insert(value);
        extras
    }

    /// Adds a value in place of an earlier one of the same type.
    pub fn insert<T: Any + Send + Sync>(&mut self, value: T) {
        self.insert_shared(Arc::new(value));
    }

    /// As [`Extras::insert`], for a value that others hold too. It is found as a `T`.
    pub fn insert_shared<T: Any + Send + Sync>(&mut self, value: Arc<T>) {
        let key = TypeId::of::<T>();
        self.entries.retain(|entry| entry.key != key);
        self.entries.push(Entry { key, name: type_name::<T>(), value });
    }

    /// The value of a type, if there is one.
    pub fn get<T: Any + Send + Sync>(&self) -> Option<&T> {
        self.find::<T>().and_then(|value| value.downcast_ref())
    }

    /// The value of a type to hold on to, if there is one.
    pub fn get_shared<T: Any + Send + Sync>(&self) -> Option<Arc<T>> {
        self.find::<T>().and_then(|value| Arc::clone(value).downcast().ok())
    }

    fn find<T: Any>(&self) -> Option<&Arc<dyn Any + Send + Sync>> {
        let key = TypeId::of::<T>();
        self.entries.iter().find(|entry| entry.key == key).map(|entry| &entry.value)
    }
}

impl fmt::Debug for Extras {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_set().entries(self.entries.iter().map(|entry| entry.name)).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_found_by_its_type_and_replaced_by_a_later_one() {
        let mut extras = Extras::with(1_u32);
        extras.insert_shared(Arc::new("two".to_owned()));
        assert_eq!(extras.get::<u32>(), Some(&1));
        extras.insert(3_u32);
        let copy = extras.clone();
        assert_eq!((copy.get::<u32>(), copy.get::<u64>()), (Some(&3), None));
        assert_eq!(copy.get_shared::<String>().as_deref().map(String::as_str), Some("two"));
        assert_eq!(format!("{copy:?}"), r#"{"alloc::string::String", "u32"}"#);
    }
}
