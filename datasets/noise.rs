//! Declared noise.

use std::fmt;
use std::str::FromStr;

use medial::Vec3;
use medial::surface::{Normalisation, TriMesh};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};

use crate::dropped::without_share;

/// What noise does to a mesh, and what its magnitude is a fraction of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum NoiseKind {
    /// Every vertex is displaced uniformly in a ball; its radius as a fraction of the diagonal.
    #[default]
    Isotropic,
    /// Every vertex is displaced along its normal, uniformly to both sides; at most this fraction of the diagonal.
    Normal,
    /// Samples are missing: a share of the vertices is removed, and the surface closed over them.
    Dropped,
}

impl NoiseKind {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Isotropic, Self::Normal, Self::Dropped];

    fn name(self) -> &'static str {
        match self {
            Self::Isotropic => "isotropic",
            Self::Normal => "normal",
            Self::Dropped => "dropped",
        }
    }
}

impl fmt::Display for NoiseKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for NoiseKind {
    type Err = NoiseError;

    fn from_str(text: &str) -> Result<Self, NoiseError> {
        let found = Self::ALL.into_iter().find(|kind| kind.name() == text);
        found.ok_or_else(|| NoiseError::Kind(text.to_owned()))
    }
}

/// Why there is no noisy mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoiseError {
    /// No kind has the name.
    #[error("{0:?} is no kind of noise; use isotropic, normal or dropped")]
    Kind(String),
    /// Not a fraction.
    #[error("{kind} noise of {magnitude}: give a fraction from 0 to 1")]
    Magnitude {
        /// The kind.
        kind: NoiseKind,
        /// What was asked.
        magnitude: f64,
    },
    /// The mesh is not the closed, oriented manifold that vertices can be dropped from.
    #[error("no vertex can be dropped: {0}; medial repair may help")]
    NotManifold(String),
    /// No further vertex can go without a crossing, a fold or a loss of topology.
    #[error(
        "{asked} of {vertices} vertices were to be dropped, but after {dropped} none can go without a crossing or a fold; \
         ask for a smaller share"
    )]
    TooFew {
        /// Vertices to be dropped.
        asked: usize,
        /// Those that could be.
        dropped: usize,
        /// Vertices of the mesh.
        vertices: usize,
    },
}

/// The mesh with noise of a kind; see [`NoiseKind`] for what the magnitude, from 0 to 1, is a fraction of.
///
/// The same seed gives the same mesh on every machine. Displacements are in proportion to the magnitude; they
/// leave the faces as they are, which may intersect each other where the magnitude exceeds the edge length. A
/// mesh without extent is returned as it is.
///
/// *Dropped* samples are those of a random order that can go: the vertex is merged into that neighbour which sweeps
/// the least volume, if the link condition holds, no face turns by more than 60 degrees or gets an angle below
/// 5 degrees, and no new face meets another one (exact). So the mesh stays closed, oriented, manifold, of the same
/// topology, and embedded if it was; all vertices that are left stay where they are. A vertex that cannot go
/// is tried again once others have gone. Cost about `O(V)` for even meshes.
///
/// # Errors
/// [`NoiseError`] when the magnitude is not a fraction, or too few vertices can be dropped.
pub fn noisy(
    mesh: &TriMesh,
    kind: NoiseKind,
    magnitude: f64,
    seed: u64,
) -> Result<TriMesh, NoiseError> {
    if !(0.0..=1.0).contains(&magnitude) {
        return Err(NoiseError::Magnitude { kind, magnitude });
    }
    match kind {
        NoiseKind::Isotropic => Ok(add_noise(mesh, magnitude, seed)),
        NoiseKind::Normal => Ok(along_normals(mesh, magnitude, seed)),
        NoiseKind::Dropped => without_share(mesh, magnitude, seed),
    }
}

/// The mesh with every vertex displaced by a random vector, independent and uniform in the ball of
/// radius `eta` times the bounding-box diagonal.
///
/// Isotropic: papers give a magnitude and leave the direction open. The same seed gives the same
/// displacements on every machine, in proportion to `eta`. The faces stay as they are and may
/// intersect each other when `eta` exceeds the edge length. A mesh without extent is returned as
/// it is.
///
/// # Panics
/// If `eta` is negative or not finite.
pub fn add_noise(mesh: &TriMesh, eta: f64, seed: u64) -> TriMesh {
    assert!(eta.is_finite() && eta >= 0.0, "noise of {eta} times the diagonal");
    let Some(Normalisation { diagonal, .. }) = Normalisation::of(mesh) else {
        return mesh.clone();
    };
    let mut random = Pcg64::seed_from_u64(seed);
    let vertices =
        mesh.vertices.iter().map(|&v| v + in_unit_ball(&mut random) * (eta * diagonal)).collect();
    TriMesh { vertices, faces: mesh.faces.clone() }
}

/// A point uniform in the unit ball: the first of points uniform in the cube around it that hits.
fn in_unit_ball(random: &mut Pcg64) -> Vec3 {
    loop {
        let mut coordinate = || random.random_range(-1.0..1.0);
        let point = Vec3::new(coordinate(), coordinate(), coordinate());
        if point.length_squared() <= 1.0 {
            return point;
        }
    }
}

/// [`NoiseKind::Normal`].
fn along_normals(mesh: &TriMesh, eta: f64, seed: u64) -> TriMesh {
    let Some(Normalisation { diagonal, .. }) = Normalisation::of(mesh) else {
        return mesh.clone();
    };
    let mut random = Pcg64::seed_from_u64(seed);
    let displaced = mesh.vertices.iter().zip(vertex_normals(mesh));
    let vertices = displaced
        .map(|(&v, normal)| v + normal * (random.random_range(-1.0..1.0) * eta * diagonal));
    TriMesh { vertices: vertices.collect(), faces: mesh.faces.clone() }
}

/// The normals of the faces at each vertex, weighted by their angles there, so that a division of the faces does not
/// change them; zero where they cancel.
fn vertex_normals(mesh: &TriMesh) -> Vec<Vec3> {
    let mut sums = vec![Vec3::ZERO; mesh.vertices.len()];
    for (face, corners) in mesh.faces.iter().enumerate() {
        let places = mesh.triangle(face);
        let [a, b, c] = places;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        for (i, &corner) in corners.iter().enumerate() {
            let [to_next, to_last] = [1, 2].map(|step| places[(i + step) % 3] - places[i]);
            let angle = to_next.cross(to_last).length().atan2(to_next.dot(to_last));
            sums[corner as usize] += normal * angle;
        }
    }
    sums.into_iter().map(Vec3::normalize_or_zero).collect()
}
