//! Why a medial mesh could not be read or written.

use std::fmt;
use std::io;
use std::path::Path;

use crate::complex::ComplexError;

/// Why a file could not be read or written as a medial mesh: the file, the line, the reason.
#[derive(Debug, thiserror::Error)]
pub struct MaError {
    /// The file's name as it was given.
    pub file: String,
    /// Line number from 1, where the reason belongs to a line.
    pub line: Option<usize>,
    /// The reason.
    pub kind: MaErrorKind,
}

impl fmt::Display for MaError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            Some(line) => write!(f, "{}, line {line}: {}", self.file, self.kind),
            None => write!(f, "{}: {}", self.file, self.kind),
        }
    }
}

impl MaError {
    /// A reason that belongs to no line of the file `name`.
    pub(super) fn of(name: &str, kind: MaErrorKind) -> Self {
        Self { file: name.to_owned(), line: None, kind }
    }

    pub(super) fn of_file(path: &Path, kind: MaErrorKind) -> Self {
        Self::of(&path.display().to_string(), kind)
    }
}

/// The defect, without the place.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MaErrorKind {
    /// The operating system refused.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// No such format.
    #[error("the extension {extension:?} is not one of {known}")]
    Extension {
        /// The file's extension, in lower case.
        extension: String,
        /// The extensions that would do.
        known: &'static str,
    },
    /// The format cannot hold this mesh.
    #[error("{0}")]
    Unwritable(String),
    /// The format holds no such thing.
    #[error("{extension:?} files hold no {what}; write {known}")]
    NoRoom {
        /// The file's extension.
        extension: String,
        /// `"values"` or `"spheres as bodies"`.
        what: &'static str,
        /// The extensions that would do.
        known: &'static str,
    },
    /// The mesh to be written is not in canonical form.
    #[error("the medial mesh is not valid: {0}")]
    Mesh(#[from] ComplexError),
    /// The header or a line is missing or is not what the format asks for.
    #[error("{0}")]
    Malformed(String),
    /// The header announces more elements than the file has bytes for, or than 32-bit ids reach.
    #[error("the header announces {announced} {what}, but the file is only {bytes} bytes long")]
    Announced {
        /// `"spheres"`, `"edges"` or `"faces"`.
        what: &'static str,
        /// The number in the header.
        announced: u64,
        /// Size of the file.
        bytes: usize,
    },
    /// The file holds fewer or more elements than its header announces.
    #[error("the header announces {announced} {what}, the file holds {}{found}",
        if found > announced { "at least " } else { "only " })]
    Count {
        /// `"spheres"`, `"edges"` or `"faces"`.
        what: &'static str,
        /// The number in the header.
        announced: u64,
        /// The number of lines found.
        found: u64,
    },
    /// A line starts with a word that the format does not have.
    #[error("expected a line that starts with v, e or f, found {0:?}")]
    Record(String),
    /// A line of a list of spheres is none.
    #[error("a list of spheres alone has lines `v x y z r`, found {0:?}")]
    NoSphere(String),
    /// Points without radii.
    #[error("points without radii: `--radii surface` takes their distances to a surface")]
    NoRadii,
    /// A second file was appended.
    #[error(
        "all that the header announces stands above: another medial mesh begins here, written behind the first; \
         `--block 1`, `--block 2` ... say which is meant"
    )]
    Appended,
    /// There are not so many medial meshes in the file.
    #[error("there is no block {wanted}: the file holds {blocks}, counted from 1")]
    Block {
        /// The block that was asked for.
        wanted: usize,
        /// Number of medial meshes in the file.
        blocks: usize,
    },
    /// What follows the last record is no list of parts.
    #[error(
        "expected the parts of the structure behind the last record: a number of them, and for each `id type m` with m indices"
    )]
    Trailer,
    /// Every radius is 0.
    #[error("every radius is 0: a surface or a set of points, no medial mesh")]
    Points,
    /// A line ends too early.
    #[error("the {field} is missing")]
    Missing {
        /// What should have stood there.
        field: &'static str,
    },
    /// A word is not a finite number.
    #[error("the {field} {text:?} is not a finite number")]
    Number {
        /// What the number would have been.
        field: &'static str,
        /// What stands there.
        text: String,
    },
    /// A radius is negative, where none may be.
    #[error("the radius {0} is negative")]
    NegativeRadius(f64),
    /// A word is not the index of a sphere.
    #[error("{text:?} is not one of the {spheres} spheres; indices start at 0")]
    Index {
        /// What stands there.
        text: String,
        /// Number of spheres announced.
        spheres: u64,
    },
}

impl MaErrorKind {
    pub(super) fn unreadable(extension: &str) -> Self {
        Self::Extension {
            extension: extension.to_owned(),
            known: ".ma, .ma_dup, .sph, .txt, .xyzr, .ply, .obj",
        }
    }

    pub(super) fn unwritable(extension: &str) -> Self {
        Self::Extension { extension: extension.to_owned(), known: ".ma, .ply, .obj, .vtp, .glb" }
    }
}
