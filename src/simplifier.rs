//! The one door for every method: [`MedialSimplifier`], what it is asked, and what it answers.
//!
//! A method is prepared once for a shape ([`MedialSimplifier::prepare`]) and then asked for as
//! many levels as wanted ([`Simplification::at`]), so that filters rank once and edge-collapse
//! methods continue from finer levels.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::complex::MedialMesh;
use crate::shape::{Cost, Shape};

mod chain;
mod error;
mod extras;
mod info;
mod method;
mod params;
mod run;

pub use crate::diagnostics::Diagnostics;
pub use chain::Chain;
pub use error::SimplifyError;
pub use extras::Extras;
pub use info::{Capability, MethodInfo, NativeLevel, ParamInfo};
pub use method::{Method, Prepare};
pub use params::{NoParams, Params};
pub use run::{Progress, RunContext};

/// A method that simplifies the medial axis of a shape.
///
/// Most methods are a [`Method`]: a description and a function. This is a whole one, which keeps the
/// largest balls with the edges and faces between them:
///
/// ```
/// use medial::shape::Shape;
/// use medial::simplifier::{
///     Level, Method, MethodInfo, ParamInfo, RunContext, Simplification, Simplified, SimplifyError,
/// };
/// use serde::Deserialize;
///
/// #[derive(Deserialize)]
/// #[serde(default, deny_unknown_fields)]
/// struct LargestParams {
///     /// Balls below this radius, a fraction of the diagonal, are never kept.
///     least: f64,
/// }
///
/// impl Default for LargestParams {
///     fn default() -> Self {
///         Self { least: 0.0 }
///     }
/// }
///
/// fn largest() -> Method<LargestParams> {
///     let info = MethodInfo::new("largest", "Largest balls first")
///         .summary("Keeps the largest balls, with the edges and faces between them.")
///         .param(ParamInfo::new("least", 0.0, "fraction of the diagonal", "least radius"));
///     Method::new(info, prepare)
/// }
///
/// fn prepare<'s>(
///     shape: &'s Shape,
///     params: LargestParams,
///     _run: &RunContext,
/// ) -> Result<Box<dyn Simplification + 's>, SimplifyError> {
///     let initial = shape.initial()?;
///     let radius = |i: usize| initial.spheres[i].radius;
///     let mut order: Vec<usize> = (0..initial.spheres.len()).collect();
///     order.retain(|&i| radius(i) >= params.least);
///     order.sort_by(|&a, &b| radius(b).total_cmp(&radius(a)).then(a.cmp(&b)));
///     Ok(Box::new(move |level: Level| {
///         let Level::Spheres(count @ 1..) = level else {
///             return Err(SimplifyError::unsupported("ask for a number of spheres, at least 1"));
///         };
///         let mut keep = vec![false; initial.spheres.len()];
///         order.iter().take(count).for_each(|&i| keep[i] = true);
///         Ok(Simplified::new(initial.induced(&keep), level))
///     }))
/// }
///
/// use medial::simplifier::{MedialSimplifier, Params};
///
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
pub trait MedialSimplifier: Send + Sync {
    /// Id, title, citation, native level, parameters with units and defaults, and what its answers
    /// carry beside the medial mesh.
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

/// A closure is enough where a method needs no helper beside [`Simplification::at`].
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
    /// A number of spheres: what makes methods comparable.
    Spheres(usize),
    /// The method's own scalar, in the unit that [`MethodInfo::native`] names.
    Native(f64),
    /// As few spheres as keep the symmetric Hausdorff error within this fraction of the diagonal.
    /// For methods that do not do this of themselves, a harness searches among their other levels.
    MaxError(f64),
}

impl fmt::Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Published => write!(f, "published"),
            Self::Spheres(count) => write!(f, "{count} spheres"),
            Self::Native(value) => write!(f, "level {value}"),
            Self::MaxError(bound) => write!(f, "at most {} % error", percent(*bound)),
        }
    }
}

/// A fraction as a percentage, without the digits that the multiplication adds.
fn percent(fraction: f64) -> f64 {
    (fraction * 1e12).round() / 1e10
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
    /// What only some methods have; [`MethodInfo::extras`] announces it.
    pub extras: Extras,
}

impl Simplified {
    /// A medial mesh made anew for a level, with nothing else to say of it.
    pub fn new(mesh: MedialMesh, asked: Level) -> Self {
        let (diagnostics, extras) = (Diagnostics::default(), Extras::default());
        Self { mesh, asked, native_level: None, work: Work::Anew, diagnostics, extras }
    }
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
