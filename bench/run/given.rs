//! Files of other programs as results of a named method.
//!
//! A file is a pseudo-method: on its mesh it answers one number of spheres, that which the file has, and is judged
//! like the rest. Nothing is known of the time that it took, so its record has none.

use std::path::PathBuf;

use medial::shape::Shape;
use medial::simplifier::{
    Level, Method, MethodInfo, ParamInfo, Params, RunContext, Simplification, Simplified,
    SimplifyError,
};
use serde::{Deserialize, Serialize};

use super::{AxisOptions, FitBy, RadiiFrom, hex_digest, read_axis};

/// Id of the pseudo-method.
pub const GIVEN: &str = "given";

/// A file that stands in the tables under a name.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Given {
    /// Name in tables.
    pub name: String,
    /// The medial mesh.
    pub file: PathBuf,
    /// Name of the mesh that it is an axis of; needed where there are several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mesh: Option<String>,
    /// How units are found.
    #[serde(default = "auto")]
    pub fit: FitBy,
    /// Where radii come from.
    #[serde(default)]
    pub radii: RadiiFrom,
    /// Whether lines are taken as they are where the header announces another number of them.
    #[serde(default)]
    pub lenient: bool,
    /// Which medial mesh is meant of several in one file, from 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub block: Option<usize>,
}

/// Other programs write in other units, and no option of a command line says so for one file of many.
fn auto() -> FitBy {
    FitBy::Auto
}

impl Given {
    /// Reads `NAME=FILE` or `NAME@MESH=FILE`.
    ///
    /// # Errors
    /// In words, where there is no name or no file.
    pub fn parse(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!("--given {text}: write NAME=FILE.ma, or NAME@MESH=FILE.ma with several meshes")
        };
        let (name, file) = text.split_once('=').ok_or_else(wrong)?;
        let (name, mesh) = match name.split_once('@') {
            Some((name, mesh)) => (name, Some(mesh.trim().to_owned())),
            None => (name, None),
        };
        if name.trim().is_empty() || file.is_empty() || mesh.as_deref() == Some("") {
            return Err(wrong());
        }
        let (name, file) = (name.trim().to_owned(), PathBuf::from(file));
        let (radii, lenient, block) = (RadiiFrom::File, false, None);
        Ok(Self { name, file, mesh, fit: FitBy::Auto, radii, lenient, block })
    }
}

/// Parameters of the pseudo-method.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GivenParams {
    /// The medial mesh.
    pub file: PathBuf,
    /// Names under which the same bytes are given, too.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub same_as: String,
    /// See [`Given::fit`].
    pub fit: FitBy,
    /// See [`Given::radii`].
    pub radii: RadiiFrom,
    /// See [`Given::lenient`].
    pub lenient: bool,
    /// See [`Given::block`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub block: Option<usize>,
}

/// SHA-256 of the file that some parameters name; `None` where it cannot be read.
pub fn fingerprint(params: &Params) -> Option<String> {
    let file = params.0.get("file")?.as_str()?;
    std::fs::read(file).ok().map(|bytes| hex_digest(&bytes))
}

/// The pseudo-method.
pub fn method() -> Method<GivenParams> {
    let info = MethodInfo::new(GIVEN, "A file of another program")
        .summary(
            "Simplifies nothing: a medial mesh from a file, judged like the results of methods.",
        )
        .published("the file as it is")
        .param(ParamInfo::new("file", "", "path", "the medial mesh"))
        .param(ParamInfo::new("same_as", "", "names", "who gave the same bytes"))
        .param(ParamInfo::new("fit", "none", "none, similarity or auto", "how units are found"))
        .param(ParamInfo::new("radii", "file", "file or surface", "where radii come from"))
        .param(ParamInfo::new(
            "lenient",
            false,
            "true or false",
            "counts of the header may be wrong",
        ))
        .param(ParamInfo::new("block", "", "number", "which of several in one file, from 1"));
    Method::new(info, prepare)
}

fn prepare<'s>(
    shape: &'s Shape,
    params: GivenParams,
    _run: &RunContext,
) -> Result<Box<dyn Simplification + 's>, SimplifyError> {
    let GivenParams { file, same_as, fit, radii, lenient, block } = params;
    let options = AxisOptions { lenient, block, radii, fit };
    let read = read_axis(&file, shape, &options);
    let (loaded, _) = read.map_err(|error| SimplifyError::Parameter(error.to_string()))?;
    let (mesh, mut remarks) = loaded.with_remarks();
    if !same_as.is_empty() {
        remarks.push(format!("the same bytes are given as {same_as}, too"));
    }
    let units = *shape.normalisation();
    let mesh = mesh.transformed(1.0 / units.diagonal, |p| units.forward(p));
    Ok(Box::new(move |level: Level| {
        let spheres = mesh.spheres.len();
        match level {
            Level::Published => {}
            Level::Spheres(count) if count == spheres => {}
            _ => {
                let why = format!("the file has {spheres} spheres, and no other level");
                return Err(SimplifyError::unsupported(why));
            }
        }
        let mut simplified = Simplified::new(mesh.clone(), level);
        remarks.iter().for_each(|remark| simplified.diagnostics.warn(remark.clone()));
        Ok(simplified)
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_names_the_method_the_mesh_and_the_file() {
        let given = Given::parse("Q-MAT, authors@bear=out/x=1.ma").expect("a name and a file");
        assert_eq!((given.name.as_str(), given.mesh.as_deref()), ("Q-MAT, authors", Some("bear")));
        assert_eq!(given.file, PathBuf::from("out/x=1.ma"));
        assert_eq!(Given::parse("a=b.ma").expect("both").mesh, None);
        for wrong in ["a", "=b.ma", "a=", "a@=b.ma", " @x=b.ma"] {
            assert!(Given::parse(wrong).is_err(), "{wrong}");
        }
    }
}
