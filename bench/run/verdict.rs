//! Second step of a run: results are measured. None of this counts as a method's time.

use std::time::Instant;

use medial::complex::MedialMesh;
use medial::metrics::{Evaluation, MetricError};
use medial::shape::Shape;
use rayon::prelude::*;
use sha2::{Digest, Sha256};

use super::{LevelRun, Scene, hex};

/// A medial mesh larger than this, in diagonals of the surface, cannot belong to it: next to its
/// spheres the whole surface is less than a rounding error.
const LARGEST_SPHERE: f64 = 1e12;

/// How far a medial mesh in the unit of a shape's input reaches from the middle of the surface, in diagonals.
///
/// # Errors
/// In words, which sphere is too far away to be measured.
pub fn reach(mesh: &MedialMesh, shape: &Shape) -> Result<f64, String> {
    let to_normal = shape.normalisation();
    let mut reach = 0.0_f64;
    for (id, sphere) in mesh.spheres.iter().enumerate() {
        let centre = to_normal.forward(sphere.centre);
        let size = centre.abs().max_element().max(sphere.radius / to_normal.diagonal);
        reach = reach.max(size);
        // An overflow gives a size that is infinite or not a number.
        if size.is_nan() || size > LARGEST_SPHERE {
            return Err(format!(
                "sphere {id} reaches {size:.1e} diagonals of the surface away from it: the medial mesh is in other \
                 units, or of another surface"
            ));
        }
    }
    Ok(reach)
}

/// The measurements of one result.
#[derive(Clone)]
pub struct Verdict {
    /// The evaluation; `None` if none was requested.
    pub evaluation: Option<Result<Evaluation, MetricError>>,
    /// Wall-clock seconds of the evaluation.
    pub seconds: f64,
    /// SHA-256 of the result.
    pub hash: String,
}

/// Measures the results of all levels, in parallel. Equal results are measured once.
pub fn judge(scene: &Scene, runs: &[LevelRun]) -> Vec<Option<Verdict>> {
    let meshes: Vec<Option<&MedialMesh>> =
        runs.iter().map(|run| run.outcome.as_ref().ok().map(|result| &result.mesh)).collect();
    // The index of an earlier equal result, if there is one.
    let first = |index: usize| meshes[..index].iter().position(|&m| m == meshes[index]);
    let firsts: Vec<usize> = (0..meshes.len()).map(|index| first(index).unwrap_or(index)).collect();
    let measure = |index: usize| {
        let mesh = meshes[index].filter(|_| firsts[index] == index)?;
        Some(judge_one(scene, mesh))
    };
    let measured: Vec<Option<Verdict>> = (0..meshes.len()).into_par_iter().map(measure).collect();
    firsts.into_iter().map(|first| measured[first].clone()).collect()
}

fn judge_one(scene: &Scene, mesh: &MedialMesh) -> Verdict {
    let measure = scene.measure();
    let hash = mesh_hash(mesh);
    let mesh = scene.carried(mesh);
    let begun = Instant::now();
    let evaluation = (measure.samples > 0).then(|| {
        let certified =
            measure.certify.map(|width| scene.judge.certify(&mesh, width)).transpose()?;
        Ok(Evaluation { certified, ..scene.judge.evaluate(&mesh)? })
    });
    let seconds = begun.elapsed().as_secs_f64();
    Verdict { evaluation, seconds, hash }
}

/// SHA-256 of spheres, edges and faces: equal for equal meshes only.
pub fn mesh_hash(mesh: &MedialMesh) -> String {
    let mut hasher = Sha256::new();
    let counts = [mesh.spheres.len(), mesh.edges.len(), mesh.faces.len()];
    counts.iter().for_each(|&count| hasher.update((count as u64).to_le_bytes()));
    for sphere in &mesh.spheres {
        let numbers = [sphere.centre.x, sphere.centre.y, sphere.centre.z, sphere.radius];
        numbers.iter().for_each(|number| hasher.update(number.to_le_bytes()));
    }
    let indices = mesh.edges.as_flattened().iter().chain(mesh.faces.as_flattened());
    indices.for_each(|index| hasher.update(index.to_le_bytes()));
    hex(&hasher.finalize())
}
