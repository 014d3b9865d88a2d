//! Hierarchies in files. The label of a file records the origin of its hierarchy.

use std::path::Path;
use std::sync::Arc;

use medial::complex::DualTriangulation;
use medial::complex::collapse::Hierarchy;
use medial::shape::Shape;
use medial::simplifier::{MedialSimplifier, Params, Simplification, SimplifyError};
use serde::{Deserialize, Serialize};

use crate::exit::Failure;
use crate::output::version;
use crate::run::Input;
use medial::shape::Cost;

/// The input and the method that a hierarchy was made from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Origin {
    method: String,
    params: Params,
    /// SHA-256 of the surface.
    surface: String,
    sampling: String,
    dual: String,
    /// Whether the initial medial mesh came from a file.
    initial: bool,
    /// Version of the program that wrote the file; later ones may read it.
    version: String,
}

impl Origin {
    /// The origin that a hierarchy would have now; `initial` is the file of the initial mesh, if any.
    pub fn new(
        method: &str,
        params: &Params,
        input: &Input,
        shape: &Shape,
        initial: Option<&Path>,
    ) -> Self {
        let options = shape.options();
        let dual = match options.dual {
            DualTriangulation::Fan => "fan",
            DualTriangulation::Delaunay => "delaunay",
        };
        Self {
            method: method.to_owned(),
            params: params.clone(),
            surface: input.surface_hash(),
            sampling: options.sampling.to_string(),
            dual: dual.to_owned(),
            initial: initial.is_some(),
            version: version().to_owned(),
        }
    }

    /// The first difference from the present origin, as a reason to refuse the hierarchy.
    fn mismatch(&self, now: &Self) -> Option<String> {
        if self.method != now.method {
            return Some(format!("it is of the method {}, not {}", self.method, now.method));
        }
        if self.surface != now.surface {
            return Some("it was made from another surface".to_owned());
        }
        let from = |given: bool| if given { "with" } else { "without" };
        if self.initial != now.initial {
            let (then, now) = (from(self.initial), from(now.initial));
            return Some(format!("it was made {then} --initial, and is asked for {now}"));
        }
        // These options do not affect a given medial mesh, which is compared itself later.
        let made =
            [("--sampling", &self.sampling, &now.sampling), ("--dual", &self.dual, &now.dual)];
        if let Some((option, then, now)) =
            made.into_iter().find(|(_, a, b)| a != b && !self.initial)
        {
            return Some(format!("it was made with {option} {then}, not {now}"));
        }
        let other_params = self.params != now.params;
        other_params.then(|| "it was made with other parameters (--set)".to_owned())
    }
}

/// A hierarchy from a file.
pub struct Loaded {
    /// The hierarchy.
    pub hierarchy: Arc<Hierarchy>,
    /// The cost of reading and checking it.
    pub read: Cost,
}

impl Loaded {
    /// The levels of the hierarchy.
    ///
    /// # Errors
    /// When it was made by another method.
    pub fn resume(
        &self,
        method: &dyn MedialSimplifier,
        params: &Params,
    ) -> Result<Box<dyn Simplification>, SimplifyError> {
        // So far one method has hierarchies; each further one needs its own way to resume.
        match &*method.info().id {
            "pmat" => medial_methods::pmat::resume(Arc::clone(&self.hierarchy), params),
            _ => Err(SimplifyError::unsupported(format!(
                "{} has no hierarchy to go on from",
                method.info().title
            ))),
        }
    }
}

/// Reads the hierarchy of an origin for a shape.
///
/// # Errors
/// When the file cannot be read, is damaged, or was made from something else.
pub fn load(path: &Path, origin: &Origin, shape: &Shape) -> Result<Loaded, Failure> {
    let file = path.display().to_string();
    let (read, lap) = Cost::of(|| Hierarchy::read(path));
    let (hierarchy, label) = read.map_err(Failure::input)?;
    let refuse = |why: String| Failure::input(format!("{file}: {why}"));
    let known: Origin = serde_json::from_str(&label)
        .map_err(|error| refuse(format!("its label does not say what it is of: {error}")))?;
    if let Some(why) = known.mismatch(origin) {
        return Err(refuse(why));
    }
    if origin.initial {
        let given = shape.initial().map_err(Failure::input)?;
        let made = hierarchy.initial();
        let same = (&given.spheres, &given.edges, &given.faces)
            == (&made.spheres, &made.edges, &made.faces);
        if !same {
            return Err(refuse(format!(
                "it was made from another initial medial mesh, of {} spheres",
                made.spheres.len()
            )));
        }
    }
    Ok(Loaded { hierarchy: Arc::new(hierarchy), read: lap })
}

/// Writes a hierarchy with its origin.
///
/// # Errors
/// When it cannot be written.
pub fn save(path: &Path, hierarchy: &Hierarchy, origin: &Origin) -> Result<(), Failure> {
    let label = serde_json::to_string(origin).map_err(Failure::input)?;
    let written = hierarchy.write(path, &label);
    written.map_err(|error| Failure::input(format!("{}: {error}", path.display())))
}
