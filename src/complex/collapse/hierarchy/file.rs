//! Hierarchies in files: JSON with the initial mesh, the steps and a label for the program that wrote it.
//!
//! Everything else follows from the mesh and the steps and is derived when a file is read, so that it cannot contradict
//! them. Reading checks the mesh, and that every step collapses an edge of its stage. Numbers come back bit for bit.

use std::fs;
use std::io::{self, Write};
use std::path::Path;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::{Hierarchy, HierarchyError, Step};
use crate::atomic::write_atomically;
use crate::complex::{ComplexError, MedialMesh, Sphere};

/// The content of a file. `format` comes first: another JSON file is refused at its first key.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Content {
    format: Format,
    label: String,
    /// `x y z r`.
    spheres: Vec<[f64; 4]>,
    edges: Vec<[u32; 2]>,
    faces: Vec<[u32; 3]>,
    /// Removed sphere, kept sphere, cost. JSON has no infinity: `null` stands for it.
    steps: Vec<(u32, u32, Option<f64>)>,
}

#[derive(Serialize, Deserialize)]
enum Format {
    #[serde(rename = "medial hierarchy 1")]
    Hierarchy1,
}

/// Why a file does not hold a hierarchy: the file and the reason.
#[derive(Debug, thiserror::Error)]
#[error("{file}: {kind}")]
pub struct HierarchyFileError {
    /// The file's name as it was given.
    pub file: String,
    /// The reason.
    pub kind: HierarchyFileErrorKind,
}

/// The defect, without the file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum HierarchyFileErrorKind {
    /// The operating system refused.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The content is not what [`Hierarchy::write`] writes; the message names line and column.
    #[error("not a file of a hierarchy: {0}")]
    Content(#[from] serde_json::Error),
    /// The initial mesh is not in canonical form.
    #[error("the initial mesh is not valid: {0}")]
    Mesh(#[from] ComplexError),
    /// The steps are not collapses of edges.
    #[error(transparent)]
    Steps(#[from] HierarchyError),
}

impl Hierarchy {
    /// Writes the hierarchy and a label into a file, which appears under its name only when it is complete.
    ///
    /// # Errors
    /// When writing fails.
    pub fn write(&self, path: impl AsRef<Path>, label: &str) -> io::Result<()> {
        write_atomically(path, |out| self.write_to(out, label))
    }

    /// Writes the content of a file.
    ///
    /// # Errors
    /// When writing fails.
    pub fn write_to(&self, out: &mut dyn Write, label: &str) -> io::Result<()> {
        let finite = |cost: f64| cost.is_finite().then_some(cost);
        let spheres = self.initial.spheres.iter();
        let content = Content {
            format: Format::Hierarchy1,
            label: label.to_owned(),
            spheres: spheres.map(|s| [s.centre.x, s.centre.y, s.centre.z, s.radius]).collect(),
            edges: self.initial.edges.clone(),
            faces: self.initial.faces.clone(),
            steps: self.steps.iter().map(|s| (s.removed, s.kept, finite(s.cost))).collect(),
        };
        Ok(serde_json::to_writer(out, &content)?)
    }

    /// Reads a file that [`Hierarchy::write`] wrote: the hierarchy and the label.
    ///
    /// # Errors
    /// When the file cannot be read, or does not hold a hierarchy.
    pub fn read(path: impl AsRef<Path>) -> Result<(Self, String), HierarchyFileError> {
        let (path, file) = (path.as_ref(), path.as_ref().display().to_string());
        // Anything but a regular file may never end.
        let is_endless = fs::metadata(path).is_ok_and(|target| !target.is_file());
        let bytes = match is_endless {
            true => Err(io::Error::new(io::ErrorKind::InvalidInput, "not a regular file")),
            false => fs::read(path),
        };
        match bytes {
            Ok(bytes) => Self::parse(&bytes, &file),
            Err(error) => Err(HierarchyFileError { file, kind: error.into() }),
        }
    }

    /// The hierarchy and the label in the bytes of a file; `name` is for messages.
    ///
    /// # Errors
    /// When the content is no hierarchy.
    pub fn parse(bytes: &[u8], name: &str) -> Result<(Self, String), HierarchyFileError> {
        parse(bytes).map_err(|kind| HierarchyFileError { file: name.to_owned(), kind })
    }
}

fn parse(bytes: &[u8]) -> Result<(Hierarchy, String), HierarchyFileErrorKind> {
    let content: Content = serde_json::from_slice(bytes)?;
    let spheres = content.spheres.into_iter();
    let mesh = MedialMesh {
        spheres: spheres.map(|[x, y, z, r]| Sphere::new([x, y, z].into(), r)).collect(),
        edges: content.edges,
        faces: content.faces,
        contacts: None,
    };
    mesh.check()?;
    let steps = content.steps.into_iter().map(|(removed, kept, cost)| {
        let cost = cost.unwrap_or(f64::INFINITY);
        Step { removed, kept, cost }
    });
    Ok((Hierarchy::new(Arc::new(mesh), steps.collect())?, content.label))
}
