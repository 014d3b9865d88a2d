//! The published level: the paper's lattice, or the finest that fits.
//!
//! Parameters set by the user are not changed. Otherwise the resolution is lowered until the voxels and
//! the medial mesh fit into memory, and a solid without a coarse voxel starts with fine ones.

use medial::shape::Shape;
use medial::simplifier::{Level, RunContext, SimplifyError};

use super::Stage;
use super::base::Base;
use super::coarse_to_fine::{Surface, Wanted};
use super::params::{AofParams, Start};
use super::settings::AofSettings;
use super::solid::Solid;

/// How often the resolution is lowered for the medial mesh.
const MAX_LOWERINGS: usize = 4;
/// The memory that a lower resolution aims at, as a share of the limit.
const AIM: f64 = 0.95;

/// The solid at the published level.
///
/// # Errors
/// As [`Solid::base`].
pub(super) fn stage<'s>(
    shape: &'s Shape,
    settings: &AofSettings,
    run: &RunContext,
) -> Result<Stage<'s>, SimplifyError> {
    let mut params = settings.at(Level::Published).validate()?;
    let published = params.resolution;
    let is_free = settings.resolution.0.is_none();
    let of =
        |params: &AofParams| Solid::new(shape, Surface::of(shape), params.clone(), run.clone());
    if is_free && let Some(fits) = of(&params).finest_up_to(published) {
        params.resolution = fits;
    }
    let mut solid = of(&params);
    let mut is_fine = false;
    if settings.start.0.is_none() && solid.is_without_coarse_voxels()? {
        (params.start, is_fine) = (Start::Fine, true);
        solid = of(&params);
    }
    let mut base = solid.base()?;
    for _ in 0..MAX_LOWERINGS {
        let share = solid.share_of_memory(&base)?;
        if !is_free || share <= 1.0 {
            break;
        }
        // Voxels of sheets grow with the square of the resolution.
        let lower = f64::from(params.resolution) * (AIM / share).sqrt();
        params.resolution = (lower as u32).clamp(1, params.resolution - 1);
        solid = of(&params);
        base = solid.base()?;
    }
    if params.resolution != published {
        base.diagnostics.warn(format!(
            "resolution {} instead of the published {published}: more does not fit into max_memory = {}",
            params.resolution, params.max_memory
        ));
    }
    if is_fine {
        base.diagnostics.warn(
            "start=fine instead of the published coarse: no sphere of a coarse voxel fits into the \
             solid",
        );
    }
    Ok(Stage { solid, base })
}

impl Solid<'_> {
    /// The resolution if its voxels fit into memory, else the finest that does.
    fn finest_up_to(&self, resolution: u32) -> Option<u32> {
        match self.megabytes(resolution).0 <= self.params().max_memory {
            true => Some(resolution),
            false => self.fitting(resolution),
        }
    }

    fn is_without_coarse_voxels(&self) -> Result<bool, SimplifyError> {
        let start = self.descend(self.params().resolution, Wanted::Places)?.tally.start;
        Ok(self.params().start == Start::Coarse && start == 0)
    }

    /// Memory of the base and of its medial mesh, as a share of the limit.
    fn share_of_memory(&self, base: &Base) -> Result<f64, SimplifyError> {
        let axis = self.axis(base.resolution, &base.descent, self.params().angle)?;
        Ok(self.megabytes_with_output(base, &axis) / self.params().max_memory)
    }
}
