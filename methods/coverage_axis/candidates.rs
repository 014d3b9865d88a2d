//! The samples to be covered, and the spheres that may cover them.

use medial::Vec3;
use medial::complex::Sphere;
use medial::shape::Shape;
use medial::simplifier::SimplifyError;
use medial::surface::{Sampling, Side, sample};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::params::{Candidates, CoverageAxisParams};

/// Balls below this radius, in diagonals, are dropped: their penalty would be without bound.
const LEAST_RADIUS: f64 = 1e-9;

/// Keeps the random points apart from the samples, which come of the same seed.
const STREAM: u64 = 0x636f_7665_7261_6765;

/// What a cover is made of, in normalised units.
pub(super) struct Instance {
    /// Samples of the surface.
    pub samples: Vec<Vec3>,
    /// Candidates.
    pub spheres: Vec<Sphere>,
    /// The vertices of the initial medial mesh that they are, where they are such.
    pub vertices: Option<Vec<u32>>,
    /// How many balls were too small to be candidates.
    pub too_small: usize,
    /// The longest side of the bounding box: the unit of the dilation.
    pub side: f64,
}

impl Instance {
    /// Draws the samples and collects the candidates of a shape.
    ///
    /// # Errors
    /// When the initial medial mesh cannot be built, or no random point is inside.
    pub fn new(
        shape: &Shape,
        params: &CoverageAxisParams,
        seed: u64,
    ) -> Result<Self, SimplifyError> {
        let sampling = Sampling::AreaUniform { count: params.samples, seed };
        let samples = sample(shape.mesh(), &sampling);
        let (low, high) = shape.mesh().bounding_box().unwrap_or_default();
        let side = (high - low).max_element();
        let all = match params.candidates {
            Candidates::Voronoi => shape.initial()?.spheres.clone(),
            Candidates::Poles => shape.inner_balls()?.spheres.clone(),
            Candidates::Random => random(shape, (low, high), params.points, seed)?,
        };
        let is_large = |&place: &u32| all[place as usize].radius >= LEAST_RADIUS;
        let places: Vec<u32> = (0..all.len() as u32).filter(is_large).collect();
        let spheres: Vec<Sphere> = places.iter().map(|&place| all[place as usize]).collect();
        let (all, too_small) = (all.len(), all.len() - spheres.len());
        if spheres.is_empty() {
            return Err(SimplifyError::unsupported(format!(
                "none of {all} candidates inside has a radius of {LEAST_RADIUS} diagonals or more"
            )));
        }
        let vertices = (params.candidates == Candidates::Voronoi).then_some(places);
        Ok(Self { samples, spheres, vertices, too_small, side })
    }
}

/// Points inside, of so many in the bounding box, with their distances to the surface.
fn random(
    shape: &Shape,
    (low, high): (Vec3, Vec3),
    points: usize,
    seed: u64,
) -> Result<Vec<Sphere>, SimplifyError> {
    let mut random = Pcg64::seed_from_u64(seed ^ STREAM);
    let mut points: Vec<Vec3> = (0..points)
        .map(|_| low + (high - low) * Vec3::new(random.random(), random.random(), random.random()))
        .collect();
    let sides = shape.inside_test().sides(&points);
    let mut side = sides.iter();
    points.retain(|_| side.next() == Some(&Side::Inside));
    let tree = shape.surface_tree()?;
    let distances = tree.distance_batch(&points);
    Ok(points.iter().zip(distances).map(|(&p, r)| Sphere::new(p, r)).collect())
}
