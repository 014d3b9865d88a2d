//! One method after another: a filter first, then a collapse of its result.

use std::sync::Arc;

use crate::shape::Shape;

use super::{
    Level, MedialSimplifier, MethodInfo, ParamInfo, Params, RunContext, Simplification, Simplified,
    SimplifyError,
};

/// Parameter that sets the first method's own level.
const LEVEL: &str = "level";
/// Its word for the published level.
const PUBLISHED: &str = "published";
/// What stands before the parameters of the first method.
const FIRST: &str = "first.";

/// Two methods as one: the second starts from the result of the first at one level, and returns all
/// levels, each after a preparation of its own.
pub struct Chain {
    first: Arc<dyn MedialSimplifier>,
    filter: Level,
    then: Arc<dyn MedialSimplifier>,
    info: MethodInfo,
}

impl Chain {
    /// `first` at the level that the parameter `level` sets, by default `filter`; then `then`.
    ///
    /// The id is `FIRST+THEN`. The parameters are those of `then`, and those of `first` with `first.`
    /// before their names.
    pub fn new(
        first: Arc<dyn MedialSimplifier>,
        filter: Level,
        then: Arc<dyn MedialSimplifier>,
    ) -> Self {
        let (a, b) = (first.info(), then.info());
        let unit = a.native.as_ref().map_or("none".into(), |native| native.unit.clone());
        let default = match filter {
            Level::Native(value) => value.to_string(),
            _ => PUBLISHED.to_owned(),
        };
        let level = ParamInfo::new(LEVEL, default, unit, format!("level of {} first", a.id));
        let of_first = |param: &ParamInfo| ParamInfo {
            name: format!("{FIRST}{}", param.name).into(),
            ..param.clone()
        };
        let info = MethodInfo::new(
            format!("{}+{}", a.id, b.id),
            format!("Chain: {}, then {}", a.title, b.title),
        )
        .citation(format!("{}; {}", a.citation, b.citation))
        .summary(format!("The result of {} is the initial medial mesh of {}.", a.id, b.id))
        .published(b.published.clone())
        .param(level)
        .params(a.params.iter().map(of_first))
        .params(b.params.iter().cloned());
        let (native, extras) = (b.native.clone(), b.extras.clone());
        let info = MethodInfo { native, extras, ..info };
        Self { first, filter, then, info }
    }

    /// The level of the first method, its parameters, and those of the second.
    fn split(&self, params: &Params) -> Result<(Level, Params, Params), SimplifyError> {
        let first = self.first.info();
        let mut level = self.filter;
        let (mut of_first, mut of_then) = (Params::none(), Params::none());
        for (key, value) in &params.0 {
            if let Some(key) = key.strip_prefix(FIRST) {
                of_first.0.insert(key.to_owned(), value.clone());
            } else if key == LEVEL {
                level = match (value.as_f64(), value.as_str()) {
                    (Some(number), _) => Level::Native(number),
                    (_, Some(PUBLISHED)) => Level::Published,
                    _ => {
                        let id = &first.id;
                        let why = format!("{LEVEL} = {value}: a level of {id}, or `{PUBLISHED}`");
                        return Err(SimplifyError::Parameter(why));
                    }
                };
            } else {
                of_then.0.insert(key.clone(), value.clone());
            }
        }
        Ok((level, of_first, of_then))
    }
}

impl MedialSimplifier for Chain {
    fn info(&self) -> &MethodInfo {
        &self.info
    }

    fn prepare<'s>(
        &self,
        shape: &'s Shape,
        params: &Params,
        run: &RunContext,
    ) -> Result<Box<dyn Simplification + 's>, SimplifyError> {
        let (level, of_first, params) = self.split(params)?;
        let filtered = self.first.prepare(shape, &of_first, run)?.at(level)?;
        let Simplified { mesh, diagnostics, .. } = filtered;
        let remark = format!(
            "{} at {level} left {} spheres to start from",
            self.first.info().id,
            mesh.spheres.len()
        );
        let mut remarks = diagnostics.warnings;
        remarks.push(remark);
        Ok(Box::new(Started {
            shape: shape.starting_from(Arc::new(mesh))?,
            then: Arc::clone(&self.then),
            params,
            run: run.clone(),
            remarks,
        }))
    }
}

/// The second method on what the first one left.
struct Started {
    shape: Shape,
    then: Arc<dyn MedialSimplifier>,
    params: Params,
    run: RunContext,
    remarks: Vec<String>,
}

impl Simplification for Started {
    fn at(&mut self, level: Level) -> Result<Simplified, SimplifyError> {
        let prepared = self.then.prepare(&self.shape, &self.params, &self.run);
        let mut simplified = prepared?.at(level)?;
        simplified.diagnostics.warnings.splice(0..0, self.remarks.iter().cloned());
        Ok(simplified)
    }
}
