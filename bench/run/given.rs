//! Files of other programs as results of a named method.
//!
//! A folder holds `MESH.ma` or `MESH-COUNT.ma` for the meshes of the study, and may hold `method.toml` with
//! the claims of its authors. A surface in place of a medial mesh is the decimation baseline.
//! A file is a pseudo-method: on its mesh it answers one number of spheres, that which the file has, and is judged
//! like the rest. Nothing is known of the time that it took, so its record has none.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use medial::shape::Shape;
use medial::simplifier::{
    Level, Method, MethodInfo, ParamInfo, Params, RunContext, Simplification, Simplified,
    SimplifyError,
};
use serde::{Deserialize, Serialize};

use crate::plugin::OwnSeconds;

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

/// The claims in a folder's `method.toml`. Nothing else about its results is taken from it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Claims {
    /// Full name of the method.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub title: String,
    /// Its source.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub citation: String,
    /// Claimed seconds by the name of the file without its extension.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub seconds: BTreeMap<String, f64>,
}

/// Name of the file with [`Claims`].
const CLAIMS: &str = "method.toml";
/// Extensions of external results.
const EXTENSIONS: [&str; 5] = ["ma", "ply", "off", "obj", "stl"];

impl Given {
    /// The files of a folder with the meshes that they belong to, by name, and the claims; files of no
    /// mesh of the study are passed over.
    ///
    /// # Errors
    /// In words, when the folder or its claims cannot be read, or no file belongs to a mesh.
    pub fn in_folder(
        &self,
        folder: &Path,
        meshes: &[String],
    ) -> Result<(Vec<Self>, Claims), String> {
        let failed = |error: io::Error| format!("{}: {error}", folder.display());
        let path = folder.join(CLAIMS);
        let claims = match fs::read_to_string(&path) {
            Ok(text) => {
                toml::from_str(&text).map_err(|why| format!("{}: {why}", path.display()))?
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => Claims::default(),
            Err(error) => return Err(failed(error)),
        };
        let mut files = Vec::new();
        for entry in fs::read_dir(folder).map_err(failed)? {
            let file = entry.map_err(failed)?.path();
            let extension = file.extension().unwrap_or_default().to_string_lossy().to_lowercase();
            let stem = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            let of = |mesh: &&String| {
                stem.strip_prefix(mesh.as_str()).is_some_and(|rest| {
                    rest.is_empty() || rest.strip_prefix('-').is_some_and(is_number)
                })
            };
            // `box-8` is a mesh of its own where the study has one: the longest name wins.
            let mesh = meshes.iter().filter(of).max_by_key(|mesh| mesh.len());
            if let Some(mesh) = mesh.filter(|_| EXTENSIONS.contains(&extension.as_str())) {
                files.push(Self { file, mesh: Some(mesh.clone()), ..self.clone() });
            }
        }
        files.sort_by(|a, b| a.file.cmp(&b.file));
        if files.is_empty() {
            let known = meshes.join(", ");
            return Err(format!(
                "{}: no file MESH.ma or MESH-COUNT.ma for a mesh of the study ({known})",
                folder.display()
            ));
        }
        Ok((files, claims))
    }
}

fn is_number(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit())
}

/// Parameters of the pseudo-method.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GivenParams {
    /// The medial mesh.
    pub file: PathBuf,
    /// See [`Claims::title`].
    #[serde(skip_serializing_if = "String::is_empty")]
    pub title: String,
    /// See [`Claims::citation`].
    #[serde(skip_serializing_if = "String::is_empty")]
    pub citation: String,
    /// See [`Claims::seconds`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub claimed_seconds: Option<f64>,
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
        .param(ParamInfo::new("title", "", "text", "full name of the method, as claimed"))
        .param(ParamInfo::new("citation", "", "text", "source of the method, as claimed"))
        .param(ParamInfo::new("claimed_seconds", "", "seconds", "seconds as claimed"))
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
    let GivenParams { file, same_as, fit, radii, lenient, block, claimed_seconds, .. } = params;
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
        if claimed_seconds.is_some() {
            let claimed = OwnSeconds { prepare: None, simplify: claimed_seconds };
            simplified.extras.insert(claimed);
        }
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
