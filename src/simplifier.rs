//! The interface of every method: [`MedialSimplifier`], its levels and its results.
//!
//! A method is prepared once for a shape ([`MedialSimplifier::prepare`]). Then
//! [`Simplification::at`] returns any number of levels, so that filters rank once and methods that
//! collapse edges continue from finer levels.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::complex::MedialMesh;
use crate::shape::Shape;

mod chain;
mod extras;
mod info;
mod method;
mod params;
mod run;

pub use crate::diagnostics::Diagnostics;
pub use chain::Chain;
pub use extras::Extras;
pub use info::{Capability, MethodInfo, NativeLevel, ParamInfo, Presentation, Registered};
pub use method::{Method, Prepare, Simple, simple};
pub use params::{NoParams, ParamFields, Params};
pub use run::{Progress, RunContext, SimplifyError};

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
