//! The parameters of VMAS.

use medial::simplifier::{ParamInfo, SimplifyError};
use serde::{Deserialize, Serialize};

use crate::within::within;

/// Parameters of VMAS; the defaults are CGAL's, with the refit that minimises the energy as written.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct VmasParams {
    /// What the surface is to the method.
    pub points: Points,
    /// Area-uniform samples at least, with `points=samples`.
    pub samples: usize,
    /// Nearest samples that a sample is adjacent to, itself among them, with `points=samples`.
    pub neighbours: usize,
    /// Weight of the Euclidean part of the energy; a pure number above 0, at most 1.
    pub lambda: f64,
    /// What the refit minimises.
    pub refit: Refit,
    /// What a shrinking ball may touch.
    pub contact: Contact,
    /// Which triangles of adjacent spheres are faces.
    pub connect: Connect,
    /// Rounds at most.
    pub iterations: usize,
}

/// What the surface is to the method.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Points {
    /// Area-uniform samples, each adjacent to its nearest ones (CGAL).
    Samples,
    /// The vertices of the mesh, adjacent along its edges (the authors).
    Vertices,
}

/// What the refit minimises.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Refit {
    /// The energy that clustering and errors use.
    Energy,
    /// That of both published programs: `lambda` squared, plane distances summed before they are squared.
    Published,
}

/// What a shrinking ball may touch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Contact {
    /// The surface points.
    Samples,
    /// The triangles of the surface.
    Mesh,
}

/// Which triangles of adjacent spheres are faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Connect {
    /// All three spheres that are adjacent in pairs.
    Cliques,
    /// Those whose clusters meet: three mutually adjacent surface points, one of each.
    Faces,
}

impl Default for VmasParams {
    fn default() -> Self {
        Self {
            points: Points::Samples,
            samples: 20_000,
            neighbours: 10,
            lambda: 0.2,
            refit: Refit::Energy,
            contact: Contact::Samples,
            connect: Connect::Cliques,
            iterations: 1_000,
        }
    }
}

/// Memory and time stay bounded.
const MOST_SAMPLES: usize = 1_000_000;

impl VmasParams {
    pub(super) fn validate(self) -> Result<Self, SimplifyError> {
        within("samples", self.samples, 100..=MOST_SAMPLES)?;
        within("neighbours", self.neighbours, 2..=100)?;
        // Without the Euclidean part, two parallel planes leave a sphere undetermined.
        within("lambda", self.lambda, 1e-6..=1.0)?;
        within("iterations", self.iterations, 1..=100_000)?;
        Ok(self)
    }

    pub(super) fn describe() -> Vec<ParamInfo> {
        let default = Self::default();
        vec![
            ParamInfo::new(
                "points",
                "samples",
                "samples or vertices",
                "surface points: area-uniform samples (CGAL), or the vertices of the mesh (the authors)",
            ),
            ParamInfo::new(
                "samples",
                default.samples,
                "samples",
                "area-uniform samples at least; 100 for each sphere if that is more, up to 100000",
            ),
            ParamInfo::new(
                "neighbours",
                default.neighbours,
                "samples",
                "nearest samples that a sample is adjacent to, itself among them",
            ),
            ParamInfo::new(
                "lambda",
                default.lambda,
                "pure number",
                "weight of the Euclidean part of the energy, above 0 and at most 1; small: spheres \
                 reach into features",
            ),
            ParamInfo::new(
                "refit",
                "energy",
                "energy or published",
                "the refit minimises the energy as written, or what both programs minimise: lambda \
                 squared, plane distances summed before they are squared",
            ),
            ParamInfo::new(
                "contact",
                "samples",
                "samples or mesh",
                "a shrinking ball touches surface points, or the mesh: exact, but slower",
            ),
            ParamInfo::new(
                "connect",
                "cliques",
                "cliques or faces",
                "faces: all spheres adjacent in pairs (published), or only where three clusters meet",
            ),
            ParamInfo::new("iterations", default.iterations, "rounds", "rounds at most"),
        ]
    }
}
