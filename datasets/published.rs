//! The catalogue of published meshes: in which package each lies, its hash, and what it is.
//!
//! The meshes themselves are not part of this project: most say nothing of a licence. Only what is known of them is
//! here, in `catalogue.toml`, which the command's maintainers write by `medial datasets survey`.

use std::collections::BTreeSet;
use std::fmt;
use std::sync::LazyLock;

use serde::{Deserialize, Serialize};

/// Packages, and the meshes in them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Catalogue {
    /// Where meshes come from, by hand.
    #[serde(rename = "package")]
    pub packages: Vec<Package>,
    /// The meshes, by name; as surveyed.
    #[serde(rename = "mesh", default)]
    pub meshes: Vec<Published>,
}

/// A package that holds meshes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Package {
    /// Which client fetches it.
    pub kind: PackageKind,
    /// Its name there.
    pub name: String,
    /// The version that was surveyed; none where nothing is fetched.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub version: Option<String>,
    /// The licence as its authors state it for the meshes, or `not stated`, with what is stated instead.
    pub licence: String,
    /// Words that tell meshes of one name apart.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tag: Option<String>,
    /// More options of the client, so that every machine fetches the same file.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub options: Vec<String>,
    /// Beginnings of paths of what is not taken, such as point clouds.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub without: Vec<String>,
    /// The files that are known, where the package is none and cannot be listed.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub files: Vec<String>,
}

/// Kinds of packages.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PackageKind {
    /// A Debian package, fetched by `apt-get`.
    Deb,
    /// An npm package, fetched by `npm`.
    Npm,
    /// A wheel, fetched by `pip`.
    Pypi,
    /// No package: files that users have from their authors and add themselves.
    File,
}

/// What a mesh is good for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Set {
    /// Usable for comparison: bounds a solid, crosses itself nowhere, has at least [`LEAST_VERTICES`].
    Public,
    /// To be refused or repaired.
    Defective,
    /// As `Public`, with fewer vertices.
    Small,
    /// Models of papers, which no package holds.
    Papers,
}

/// Vertices of a mesh in [`Set::Public`], at least: with fewer there is little to simplify.
pub const LEAST_VERTICES: usize = 300;

/// A published mesh.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Published {
    /// Its name here, unlike all others.
    pub name: String,
    /// What it is good for.
    pub set: Set,
    /// The package, as `KIND:NAME`.
    pub package: String,
    /// Path in the package; after `!` the path in an archive in it.
    pub path: String,
    /// SHA-256 of the file as it is kept: unpacked, and a mesh in a JavaScript module as OFF.
    pub sha256: String,
    /// SHA-256 of the surface after reading, whatever the format; none where it cannot be read.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub surface: Option<String>,
    /// Number of vertices after reading.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vertices: Option<usize>,
    /// Number of triangles after reading.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub faces: Option<usize>,
    /// Number of pieces that are connected through edges.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub components: Option<usize>,
    /// Total genus, where it is defined.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub genus: Option<usize>,
    /// Betti numbers of the solid, where it bounds one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub betti: Option<[usize; 3]>,
    /// What is wrong with it, or was repaired when it was read.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub defects: Vec<String>,
    /// Why it is refused when it is read, where it is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub refused: Option<String>,
}

/// The catalogue that this crate holds.
///
/// # Panics
/// Never: a test reads it.
pub fn published() -> &'static Catalogue {
    static EMBEDDED: LazyLock<Catalogue> = LazyLock::new(|| {
        Catalogue::parse(include_str!("catalogue.toml")).expect("the embedded catalogue is whole")
    });
    &EMBEDDED
}

impl Catalogue {
    /// Reads a catalogue and checks it.
    ///
    /// # Errors
    /// What is wrong, in a sentence that names the entry.
    pub fn parse(text: &str) -> Result<Self, String> {
        let catalogue: Self = toml::from_str(text).map_err(|error| error.to_string())?;
        catalogue.check()?;
        Ok(catalogue)
    }

    /// The catalogue as text that [`Catalogue::parse`] reads.
    ///
    /// # Errors
    /// When a number does not fit into TOML.
    pub fn to_text(&self) -> Result<String, String> {
        toml::to_string(self).map_err(|error| error.to_string())
    }

    /// The package that a mesh names.
    pub fn package_of(&self, mesh: &Published) -> Option<&Package> {
        self.packages.iter().find(|package| package.id() == mesh.package)
    }

    /// The first violation: names that are no names of files or are given twice, hashes that are none, packages that
    /// are not there.
    ///
    /// # Errors
    /// It, in a sentence.
    pub fn check(&self) -> Result<(), String> {
        let mut packages = BTreeSet::new();
        for package in &self.packages {
            let is_fetched = package.kind != PackageKind::File;
            // A name that begins with a hyphen would be an option of the client.
            let harmless = |word: &str| !word.is_empty() && !word.starts_with('-');
            let version = package.version.as_deref();
            if !harmless(&package.name) || version.map_or(is_fetched, |v| !harmless(v)) {
                return Err(format!("package {package}: its name or version cannot be used"));
            }
            if !packages.insert(package.id()) {
                return Err(format!("package {package}: it is there twice"));
            }
        }
        let (mut names, mut hashes) = (BTreeSet::new(), BTreeSet::new());
        for mesh in &self.meshes {
            let name = &mesh.name;
            if !is_name(name) || !names.insert(name) {
                return Err(format!("mesh {name:?}: no name of a file, or given twice"));
            }
            let is_hash = |text: &str| text.len() == 64 && text.bytes().all(is_hex);
            if !is_hash(&mesh.sha256) || !mesh.surface.as_deref().is_none_or(is_hash) {
                return Err(format!("mesh {name}: its hash is no SHA-256 in lower case"));
            }
            if !hashes.insert(&mesh.sha256) {
                return Err(format!("mesh {name}: another one has its hash"));
            }
            if !packages.contains(&mesh.package) {
                return Err(format!("mesh {name}: there is no package {}", mesh.package));
            }
        }
        Ok(())
    }
}

fn is_hex(byte: u8) -> bool {
    matches!(byte, b'0'..=b'9' | b'a'..=b'f')
}

/// Whether a text can name a mesh and its file: lower-case letters, digits, `.`, `_`, `-`, the first one a letter or a
/// digit.
pub fn is_name(text: &str) -> bool {
    let is_plain = |byte: u8| byte.is_ascii_lowercase() || byte.is_ascii_digit();
    (1..=100).contains(&text.len())
        && text.bytes().next().is_some_and(is_plain)
        && text.bytes().all(|byte| is_plain(byte) || b"._-".contains(&byte))
}

impl Package {
    /// How meshes name it: `KIND:NAME`.
    pub fn id(&self) -> String {
        format!("{}:{}", self.kind, self.name)
    }
}

impl Published {
    /// The extension of its format.
    pub fn extension(&self) -> String {
        let path = self.path.strip_suffix(".gz").unwrap_or(&self.path);
        let extension = path.rsplit_once('.').map_or("", |(_, extension)| extension);
        // A module's arrays are written as OFF.
        if extension == "js" { "off".to_owned() } else { extension.to_ascii_lowercase() }
    }

    /// The name of its file here.
    pub fn file_name(&self) -> String {
        format!("{}.{}", self.name, self.extension())
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

impl fmt::Display for PackageKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Deb => "deb",
            Self::Npm => "npm",
            Self::Pypi => "pypi",
            Self::File => "file",
        })
    }
}

impl fmt::Display for Package {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.kind, self.name)?;
        self.version.iter().try_for_each(|version| write!(f, "@{version}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PACKAGE: &str = "[[package]]\nkind = 'npm'\nname = 'm'\nversion = '1'\nlicence = 'MIT'\n";

    fn mesh(name: &str, digit: char, package: &str) -> String {
        let hash = String::from(digit).repeat(64);
        format!(
            "[[mesh]]\nname = '{name}'\nset = 'small'\npackage = '{package}'\npath = 'a.off'\nsha256 = '{hash}'\n"
        )
    }

    #[test]
    fn the_embedded_catalogue_is_whole_and_survives_its_text() {
        let catalogue = published();
        assert_eq!(Catalogue::parse(&catalogue.to_text().unwrap()).as_ref(), Ok(catalogue));
        let of = |set| catalogue.meshes.iter().filter(move |mesh| mesh.set == set);
        assert!(of(Set::Public).count() >= 30 && of(Set::Papers).count() >= 10);
        for mesh in &catalogue.meshes {
            let package = catalogue.package_of(mesh).expect("checked");
            assert_eq!(mesh.set == Set::Papers, package.kind == PackageKind::File, "{}", mesh.name);
            assert!(crate::find(&mesh.name).is_none(), "{} is a built-in shape, too", mesh.name);
        }
        for mesh in of(Set::Public) {
            assert!(mesh.betti.is_some() && mesh.refused.is_none(), "{}", mesh.name);
            assert!(mesh.vertices >= Some(LEAST_VERTICES), "{}", mesh.name);
        }
    }

    #[test]
    fn what_is_wrong_is_named() {
        let parse = |meshes: &[String]| Catalogue::parse(&(PACKAGE.to_owned() + &meshes.concat()));
        assert!(parse(&[mesh("a", '0', "npm:m"), mesh("b", '1', "npm:m")]).is_ok());
        for (meshes, why) in [
            (vec![mesh("a", '0', "npm:m"), mesh("a", '1', "npm:m")], "\"a\": no name"),
            (vec![mesh("../a", '0', "npm:m")], "\"../a\": no name"),
            (vec![mesh(".a", '0', "npm:m")], "\".a\": no name"),
            (vec![mesh("a", 'G', "npm:m")], "a: its hash"),
            (vec![mesh("a", '0', "npm:m"), mesh("b", '0', "npm:m")], "b: another one"),
            (vec![mesh("a", '0', "npm:n")], "no package npm:n"),
        ] {
            let said = parse(&meshes).unwrap_err();
            assert!(said.contains(why), "{said}");
        }
        let option = PACKAGE.replace("'m'", "'--index-url=x'");
        assert!(Catalogue::parse(&option).unwrap_err().contains("cannot be used"));
    }
}
