//! Declared noise.

use medial::Vec3;
use medial::surface::{Normalisation, TriMesh};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

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
        let point = Vec3::from([(); 3].map(|()| random.random_range(-1.0..1.0)));
        if point.length_squared() <= 1.0 {
            return point;
        }
    }
}
