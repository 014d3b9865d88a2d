//! The lattice of the parameters, or a finer one if that loses parts of the solid.
//!
//! Variants that keep the topology of their start set need a start set with the solid's topology and
//! without missing limbs. Lattices finer by half are tried until one has both; else the best is taken:
//! the least difference of Betti numbers, then the least loss (file `losses.rs`), then the finest. A
//! warning names what is lost.

use medial::simplifier::{Diagnostics, SimplifyError};

use super::bricks::Bricks;
use super::coarse_to_fine::{Descent, Wanted};
use super::losses::{LOST, Loss};
use super::params::Variant;
use super::solid::{Solid, betti_of};

/// How often the lattice is made finer, half as fine again each time.
const REFINEMENTS: u32 = 3;

/// The lattice to work at.
pub struct Base {
    /// Voxels along the longest side.
    pub resolution: u32,
    /// Its flux.
    pub descent: Descent,
    /// Betti numbers of its voxels, where the variant keeps them.
    pub topology: Option<[u64; 3]>,
    /// The part of the surface that it loses.
    pub loss: Option<Loss>,
    /// Counts and warnings about it.
    pub diagnostics: Diagnostics,
}

/// A start set that was tried.
struct Tried {
    resolution: u32,
    betti: [u64; 3],
    voxels: u64,
    loss: Option<Loss>,
}

impl Tried {
    fn difference(&self, expected: [u64; 3]) -> u64 {
        self.betti.iter().zip(expected).map(|(&b, e)| b.abs_diff(e)).sum()
    }

    fn lost(&self) -> f64 {
        self.loss.map_or(0.0, |loss| loss.distance)
    }
}

impl Solid<'_> {
    /// The lattice to work at.
    ///
    /// # Errors
    /// When no voxel fits into the solid; as [`Solid::descend`].
    pub fn base(&self) -> Result<Base, SimplifyError> {
        let mut diagnostics = Diagnostics::default();
        let asked = self.params().resolution;
        let mut descent = self.descend(asked, self.wanted())?;
        let first = self.tried(asked, &descent)?;
        let chosen = match self.params().variant {
            Variant::Plain => first,
            _ => self.faithful(first, &mut diagnostics)?,
        };
        if chosen.resolution != asked {
            descent = self.descend(chosen.resolution, self.wanted())?;
        }
        let Tried { resolution, betti, loss, .. } = chosen;
        let tally = &descent.tally;
        if tally.start == 0 {
            return Err(self.nothing_fits(resolution, tally.deepest));
        }
        diagnostics.count("resolution", resolution as usize);
        diagnostics.count("start_voxels", tally.start as usize);
        for (level, &dismissed) in tally.dismissed.iter().enumerate() {
            diagnostics.count(&format!("dismissed_at_level_{}", level + 1), dismissed as usize);
        }
        diagnostics.count("spheres_evaluated", tally.evaluated.iter().sum::<u64>() as usize);
        let topology = (self.params().variant != Variant::Plain).then_some(betti);
        Ok(Base { resolution, descent, topology, loss, diagnostics })
    }

    fn tried(&self, resolution: u32, start: &Descent) -> Result<Tried, SimplifyError> {
        let betti = match self.params().variant {
            Variant::Plain => [0; 3],
            _ => betti_of(&start.voxels),
        };
        let loss = self.loss(resolution, &start.voxels, self.allowed())?;
        Ok(Tried { resolution, betti, voxels: start.tally.start, loss })
    }

    /// The largest loss that is accepted, a fraction of the diagonal.
    fn allowed(&self) -> f64 {
        LOST * self.grid(self.params().resolution).side
    }

    /// The least resolution from the one asked on whose start set has the topology of the solid and
    /// loses nothing, else the best that was tried.
    fn faithful(
        &self,
        first: Tried,
        diagnostics: &mut Diagnostics,
    ) -> Result<Tried, SimplifyError> {
        let expected = self.shape.expected_betti();
        let difference = |tried: &Tried| expected.map_or(0, |e| tried.difference(e));
        let is_faithful = |t: &Tried| t.voxels > 0 && t.loss.is_none() && difference(t) == 0;
        let asked = first.resolution;
        let mut all = vec![first];
        for refinement in 1..=REFINEMENTS {
            if all.last().is_some_and(is_faithful) {
                break;
            }
            let resolution = (f64::from(asked) * 1.5_f64.powi(refinement as i32)).round() as u32;
            match self.descend(resolution, Wanted::Places) {
                Ok(start) => all.push(self.tried(resolution, &start)?),
                // It does not fit into memory.
                Err(SimplifyError::Parameter(_)) => break,
                Err(other) => return Err(other),
            }
        }
        let rank = |a: &Tried, b: &Tried| {
            let empty = (a.voxels == 0).cmp(&(b.voxels == 0));
            let topology = || difference(a).cmp(&difference(b));
            let loss = || a.lost().total_cmp(&b.lost());
            empty.then_with(topology).then_with(loss).then_with(|| b.resolution.cmp(&a.resolution))
        };
        let best = match all.last().is_some_and(is_faithful) {
            true => all.pop(),
            false => all.into_iter().min_by(rank),
        };
        let best = best.expect("the first was tried");
        self.say_what_was_chosen(&best, expected, diagnostics);
        Ok(best)
    }

    fn say_what_was_chosen(
        &self,
        best: &Tried,
        expected: Option<[u64; 3]>,
        diagnostics: &mut Diagnostics,
    ) {
        let (resolution, asked) = (best.resolution, self.params().resolution);
        if resolution != asked {
            diagnostics.warn(format!(
                "resolution {resolution} instead of {asked}: below, the voxels whose spheres fit \
                 inside do not have the topology of the solid, or a part of it has none"
            ));
        }
        if let Some(expected) = expected.filter(|&e| best.voxels > 0 && best.difference(e) > 0) {
            let side = self.grid(resolution).side * self.shape.normalisation().diagonal;
            diagnostics.warn(format!(
                "the voxels whose spheres fit inside have the Betti numbers {:?} instead of the \
                 solid's {expected:?} at resolution {resolution}, the best that was tried: parts \
                 thinner than {:.4} or gaps narrower than {side:.4} in units of the surface are not \
                 resolved; give a higher resolution",
                best.betti,
                2.0 * side
            ));
        }
    }

    /// Warns about the losses of a lattice other than that of the base.
    ///
    /// # Errors
    /// As [`Solid::descend`].
    pub(super) fn say_what_is_lost(
        &self,
        base: &Base,
        resolution: u32,
        diagnostics: &mut Diagnostics,
    ) -> Result<(), SimplifyError> {
        let loss = if resolution == base.resolution {
            base.loss
        } else {
            let start: Bricks = self.descend(resolution, Wanted::Places)?.voxels;
            self.loss(resolution, &start, LOST * self.grid(resolution).side)?
        };
        if let Some(loss) = loss {
            diagnostics.warn(self.in_words(resolution, &loss));
        }
        Ok(())
    }
}
