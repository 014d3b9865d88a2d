//! The parameters of VMAS.

use medial::simplifier::SimplifyError;
use serde::{Deserialize, Serialize};

use crate::within::within;

medial::parameters! {
    /// Parameters of VMAS; the defaults are CGAL's, with the refit that minimises the energy as
    /// written.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct VmasParams {
        /// Surface points: area-uniform samples (CGAL), or the vertices of the mesh (the authors).
        points: Points = Points::Samples, "samples or vertices";
        /// Smallest number of samples; 100 for each sphere if that is more, up to 100000.
        samples: usize = 20_000, "samples";
        /// Nearest samples that a sample is adjacent to, itself included.
        neighbours: usize = 10, "samples";
        /// Weight of the Euclidean part of the energy, above 0 and at most 1; with a small one,
        /// spheres reach into features.
        lambda: f64 = 0.2, "pure number";
        /// The refit minimises the energy as written, or as both published programs do: lambda
        /// squared, plane distances summed before they are squared.
        refit: Refit = Refit::Energy, "energy or published";
        /// A shrinking ball touches surface points, or the mesh: exact, but slower.
        contact: Contact = Contact::Samples, "samples or mesh";
        /// Faces: all triples of spheres adjacent in pairs (published), or only where three clusters
        /// meet.
        connect: Connect = Connect::Cliques, "cliques or faces";
        /// Largest number of rounds.
        iterations: usize = 1_000, "rounds";
    }
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
}
