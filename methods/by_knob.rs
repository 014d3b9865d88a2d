//! Methods that meet a number of spheres by a knob other than their level: the density of the samples,
//! or the resolution of a lattice (`size_search.rs`).

use medial::shape::Shape;
use medial::simplifier::{Level, RunContext, Simplification, Simplified, SimplifyError};

use crate::size_search::{Knob, Probe, SizeSearch, resampled};

/// A method on one shape, as it is prepared.
type Prepared<'s> = Box<dyn Simplification + 's>;

/// Prepares a method at a value of the knob; without one, as the shape and the parameters have it.
type Prepare<'s> = Box<dyn Fn(Option<f64>) -> Result<Prepared<'s>, SimplifyError> + Send + 's>;

/// A shape whose numbers of spheres are met by a knob. All other levels are those of the value that the
/// shape and the parameters have. Nothing is kept between levels, so that each costs what it would
/// cost alone.
pub(crate) struct ByKnob<'s> {
    prepare: Prepare<'s>,
    search: SizeSearch,
    /// The native level of every number of spheres.
    native: f64,
}

impl<'s> ByKnob<'s> {
    /// By any knob.
    pub(crate) fn new(
        knob: Knob,
        native: f64,
        run: &RunContext,
        prepare: impl Fn(Option<f64>) -> Result<Prepared<'s>, SimplifyError> + Send + 's,
    ) -> Self {
        let search = SizeSearch::new(knob, run);
        Self { prepare: Box::new(prepare), search, native }
    }

    /// By the number of samples of a shape. Builds what all samplings share, the tree and the inside
    /// test of the surface, so that they count as substrates.
    ///
    /// # Errors
    /// When the surface has no face.
    pub(crate) fn of_samples(
        shape: &'s Shape,
        native: f64,
        run: &RunContext,
        prepare: impl Fn(&Shape) -> Result<Prepared<'static>, SimplifyError> + Send + 's,
    ) -> Result<Self, SimplifyError> {
        shape.surface_tree()?;
        shape.inside_test();
        let at = move |samples: Option<f64>| -> Result<Prepared<'s>, SimplifyError> {
            match samples {
                None => Ok(prepare(shape)?),
                Some(samples) => Ok(prepare(&resampled(shape, samples))?),
            }
        };
        Ok(Self::new(Knob::samples(), native, run, at))
    }
}

impl Simplification for ByKnob<'_> {
    fn at(&mut self, level: Level) -> Result<Simplified, SimplifyError> {
        let Level::Spheres(count @ 1..) = level else {
            return (self.prepare)(None)?.at(level);
        };
        let Self { prepare, search, native, .. } = self;
        search.at(
            count,
            |_| *native,
            |value| {
                let Simplified { mesh, diagnostics, .. } =
                    prepare(Some(value))?.at(Level::Native(*native))?;
                Ok(Probe { mesh, diagnostics })
            },
        )
    }
}
