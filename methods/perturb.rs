//! Balls in general position, for methods on unions of polar balls.
//!
//! Polar balls meet in samples by construction, but only up to rounding, which decides at random which
//! of them overlap there. With slightly larger radii and slightly moved centres, as in the authors' tool
//! of the scale axis transform, they all overlap.

use medial::Vec3;
use medial::complex::Sphere;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// The balls with radii times `radius_factor` and centres moved by at most `jitter` radii along each
/// axis, each by its own random numbers in order.
pub(crate) fn perturbed(
    balls: &[Sphere],
    radius_factor: f64,
    jitter: f64,
    seed: u64,
) -> Vec<Sphere> {
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut offset = || rng.random_range(-1.0..=1.0);
    let moved = |ball: &Sphere| {
        let offset = Vec3::new(offset(), offset(), offset());
        let centre = ball.centre + jitter * ball.radius * offset;
        Sphere::new(centre, ball.radius * radius_factor)
    };
    balls.iter().map(moved).collect()
}
