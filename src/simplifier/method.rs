//! Methods made of a description and one function.

use std::fmt;

use serde::de::DeserializeOwned;

use super::{
    Level, MedialSimplifier, MethodInfo, NoParams, Params, RunContext, Simplification, Simplified,
    SimplifyError,
};
use crate::complex::MedialMesh;
use crate::shape::Shape;

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
            Level::Spheres(0) => Err(SimplifyError::Level("ask for at least one sphere".into())),
            Level::Spheres(count) => Ok(Simplified::new(function(shape, count)?, level)),
            _ => Err(SimplifyError::unsupported("ask for a number of spheres")),
        }))
    }
}
