//! The medial mesh that everything starts from.

use std::sync::Arc;

use medial::complex::{MedialMesh, betti};
use medial::metrics::topology_warning;
use medial::shape::Shape;
use medial::simplifier::{Diagnostics, Level, MedialSimplifier, Params, RunContext, SimplifyError};
use medial::surface::Sampling;

use super::MANY;
use super::params::TightParams;

/// Times that the samples are doubled at most.
const DOUBLINGS: usize = 2;

/// A start: the given medial mesh of a shape, or one of denser samples with a method that simplifies it.
pub(super) struct Start {
    shape: Shape,
    starter: Arc<dyn MedialSimplifier>,
    least: usize,
    is_given: bool,
    samples: usize,
    betti: [u64; 3],
}

impl Start {
    /// Samples the surface until the Betti numbers of the medial mesh are right.
    ///
    /// # Errors
    /// When the samples do not span space, or the given mesh has no sphere.
    pub fn new(
        shape: &Shape,
        starter: Arc<dyn MedialSimplifier>,
        params: &TightParams,
        run: &RunContext,
    ) -> Result<Self, SimplifyError> {
        // Built here, so that they count as substrates of the shape.
        shape.surface_tree()?;
        shape.inside_test();
        let least = params.start;
        if shape.has_given_initial() {
            let initial = shape.initial()?;
            let betti = betti(&initial);
            let shape = shape.starting_from(initial)?;
            return Ok(Self { shape, starter, least, is_given: true, samples: 0, betti });
        }
        let expected = shape.expected_betti();
        let mut best: Option<(u64, Self)> = None;
        for doubling in 0..=DOUBLINGS {
            run.step(doubling, DOUBLINGS + 1)?;
            let samples = params.samples << doubling;
            let fine = shape.resampled(Sampling::BlueNoise { count: samples, seed: run.seed });
            let betti = betti(fine.initial()?.as_ref());
            let wrong = expected.map_or(0, |expected| {
                expected.iter().zip(betti).map(|(&expected, found)| expected.abs_diff(found)).sum()
            });
            // More samples can make it worse: the least wrong is kept, of equal ones the first.
            if best.as_ref().is_none_or(|(least, _)| wrong < *least) {
                let starter = Arc::clone(&starter);
                let start = Self { shape: fine, starter, least, is_given: false, samples, betti };
                best = Some((wrong, start));
            }
            if wrong == 0 {
                break;
            }
        }
        let (_, start) = best.expect("there is a first one");
        Ok(start)
    }

    /// What is to be said of it.
    pub fn describe(&self, diagnostics: &mut Diagnostics) {
        diagnostics.count("samples_of_the_start", self.samples);
        if let Some(warning) = topology_warning(self.betti, self.shape.expected_betti()) {
            diagnostics.warn(format!("the start is wrong, and the result with it: {warning}"));
        }
    }

    /// The start for a number of spheres.
    ///
    /// # Errors
    /// Those of the other method.
    pub fn mesh(
        &self,
        count: usize,
        run: &RunContext,
        diagnostics: &mut Diagnostics,
    ) -> Result<MedialMesh, SimplifyError> {
        let initial = self.shape.initial()?;
        let wanted = self.least.max(MANY.saturating_mul(count));
        let mesh = if initial.spheres.len() <= if self.is_given { count } else { wanted } {
            MedialMesh::clone(&initial)
        } else {
            let mut levels = self.starter.prepare(&self.shape, &Params::none(), run)?;
            let found = levels.at(Level::Spheres(wanted))?;
            // More spheres are left than wanted where nothing more can be collapsed.
            if found.mesh.spheres.len() > wanted {
                found
                    .diagnostics
                    .warnings
                    .into_iter()
                    .for_each(|warning| diagnostics.warn(warning));
            }
            found.mesh
        };
        Ok(MedialMesh { contacts: None, ..mesh })
    }
}
