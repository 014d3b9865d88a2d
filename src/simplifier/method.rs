//! A method made of its description and one function.

use std::fmt;

use serde::de::DeserializeOwned;

use super::{MedialSimplifier, MethodInfo, Params, RunContext, Simplification, SimplifyError};
use crate::shape::Shape;

/// The function of a [`Method`]: prepares one shape with typed parameters.
///
/// It does all work that does not depend on the level; see [`MedialSimplifier::prepare`].
pub type Prepare<P> =
    for<'s> fn(&'s Shape, P, &RunContext) -> Result<Box<dyn Simplification + 's>, SimplifyError>;

/// A method made of its description and one function: all that most methods need.
///
/// `P` is the struct of its parameters (serde, `deny_unknown_fields`, `Default` = the paper's
/// values). What the user sets is turned into it here, and nowhere else, before the function is
/// called; [`NoParams`](super::NoParams) is for methods without any. See [`MedialSimplifier`] for a
/// whole method.
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
