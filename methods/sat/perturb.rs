//! Step 2: balls in general position.

use medial::Vec3;
use medial::complex::Sphere;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::SatParams;

/// The balls with larger radii and moved centres, each by its own random numbers in order.
pub(super) fn perturbed(balls: &[Sphere], params: &SatParams, seed: u64) -> Vec<Sphere> {
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut offset = || rng.random_range(-1.0..=1.0);
    let moved = |ball: &Sphere| {
        let offset = Vec3::new(offset(), offset(), offset());
        let centre = ball.centre + params.jitter * ball.radius * offset;
        Sphere::new(centre, ball.radius * params.radius_factor)
    };
    balls.iter().map(moved).collect()
}
