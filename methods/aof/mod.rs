//! AOF: average outward flux voxels.
//!
//! S. Stolpner, K. Siddiqi 2006, *Revealing Significant Medial Structure in Polyhedral Meshes*,
//! 3DPVT 2006, <https://doi.org/10.1109/3DPVT.2006.117>.
//!
//! 1. A cubic lattice over the bounding box; voxels whose sphere of radius `sigma` (their side) lies
//!    inside the solid (section 5).
//! 2. Samples on the sphere along a spiral (section 6.1); for each the closest point of the surface
//!    with its feature, and from it the gradient of the distance.
//! 3. `AOF'`: the mean of `grad D . N`, where samples on two-sided fans of concave edges and vertices
//!    add nothing (section 4, theorem 4.14): negative if and only if the axis meets the sphere.
//! 4. Coarse to fine: voxels with `AOF' >= 0` are dismissed, the others split (Algorithm 1).
//! 5. At the finest level voxels with `AOF' <= -1/8 sin alpha` are kept (proposition 5.1), or the
//!    others deleted where they are simple (section 6.3), or the voxels thinned by flux.
//! 6. A sphere for each voxel, moved onto the axis; edges and triangles between neighbours, with
//!    the Betti numbers of the voxels. The voxels themselves are in [`Extras`], as
//!    [`LatticeVoxels`].
//!
//! # Notation
//!
//! `D` distance to the surface; `N` outward normal of the sphere, and number of samples; `sigma` side
//! of a voxel and radius of its sphere; `d` factor of subdivision; `alpha` object angle, between a sheet
//! and the directions to its closest points, half the separation angle. Lengths are fractions of
//! the bounding-box diagonal.
//!
//! # Where the paper is silent
//!
//! - The lattice starts at the lower corner of the bounding box.
//! - The final threshold of its figures is a flux, chosen for each model: -0.15, -0.2 and -0.25 for
//!   Venus, -0.22 for the torus with three holes, -0.2 for the cow. [`Level::Published`] takes -0.2.
//!
//! # Deviations from the paper
//!
//! - *The defaults of every level but the published one*: a lattice of 54 voxels along the longest side,
//!   thinned by flux (section 3.3 of Siddiqi et al. 2002) with `mu = 3/8` for its end points. The
//!   paper has 369 voxels in its figures, and keeps by threshold (`variant=plain`, `mu = 1/8`) or
//!   deletes by distance (`variant=homotopy`). Kept by threshold a sheet is two voxels thick and torn,
//!   and a lattice of 369 has far more voxels than the other methods have spheres.
//!   [`Level::Published`] has the paper's: `resolution=369`, `variant=plain`, a flux of -0.2,
//!   `spiral=classic`, `start=coarse`, `dismiss=zero`, `refine=false`, unless set otherwise.
//!   If 369 does not fit into `max_memory`, or no coarse voxel fits into the solid, a warning names
//!   what is done instead.
//! - Either spiral has a mean direction that is not zero, so that a constant field has a flux of up
//!   to that length. Coarse voxels are dismissed if `AOF'` is not below minus this length
//!   (`dismiss=bias`); with the paper's 0 (`dismiss=zero`) half the directions of a plane are never
//!   dismissed. Neither reproduces its Table 2: of the box 45.9 % go at the first level there, of
//!   the built-in box 31 % with zero and 64 % with bias.
//! - If the start set on a lattice has other Betti numbers than the solid, or leaves part of the
//!   surface far from every voxel, the lattice is refined up to three times, and the best one is used
//!   (file `base.rs`). Warnings name what is still lost (file `losses.rs`).
//! - Line 3 of Algorithm 1, read literally, begins with the smallest spheres. The intended meaning is
//!   `sigma` at the coarsest level and `sigma / d^j` after `j` divisions.
//! - The equal-area spiral is the default: its largest error on a plane through the centre is about
//!   0.6 of that of the classic one (held by a test in `spiral.rs`). `spiral=classic` is the paper's.
//! - A coarse voxel whose sphere does not fit inside is split instead of dropped, so that the start
//!   set is that of the finest level (`start=fine`). The paper's rule (`start=coarse`) loses every part
//!   thinner than twice the coarsest voxel.
//! - `homotopy` deletes at the finest level alone, where dismissed voxels count as flux 0; the
//!   paper deletes simple voxels at each level. Both keep the homotopy type of the start set; this
//!   way it is the start set of the finest level.
//! - [`Level::Spheres`] is not in the paper. Ranking the voxels of a fine lattice by `AOF'` leaves
//!   scattered pieces of the flattest sheet. Instead the lattice is made as coarse or as fine as the
//!   count requires, while its start set keeps the topology. Then simple voxels are deleted from its
//!   thinned axis, largest `AOF'` first, down to the count (file `count.rs`).

mod advice;
mod base;
mod bricks;
mod coarse_to_fine;
mod count;
mod flux;
mod grid;
mod lattice;
mod losses;
mod nearby;
mod output;
mod output_size;
mod params;
mod published;
mod queue;
mod refine;
mod settings;
mod simple;
mod solid;
mod spiral;
mod thinning;
mod voids;

use std::sync::Arc;

use medial::shape::Shape;
use medial::simplifier::{
    Capability, Extras, Level, Method, MethodInfo, NativeLevel, RunContext, Simplification,
    Simplified, SimplifyError,
};
use medial::surface::TriangleBvh;

pub use base::Base;
pub use bricks::{Bricks, Place, Voxel};
pub use coarse_to_fine::{Descent, Surface, Tally, Wanted, coarse_to_fine};
pub use flux::{Probe, Sphere};
pub use grid::Grid;
pub use lattice::{LatticeVoxel, LatticeVoxels};
pub use losses::Loss;
pub use nearby::{NearBatch, NearPoint, NearSet, NearbyTriangles};
pub use params::{AofParams, Dismiss, Start, Variant};
pub use refine::{Refined, refine};
pub use settings::{AofSettings, Auto};
pub use simple::{SimpleTable, is_simple};
pub use solid::{Axis, Solid};
pub use spiral::Spiral;
pub use thinning::{Order, is_end_point, thin};

/// Name of the extra that holds the [`LatticeVoxels`].
pub const VOXELS: &str = "voxels";

/// The source as BibTeX.
const BIBTEX: &str = "\
@inproceedings{StolpnerSiddiqi2006,
  author    = {Stolpner, Svetlana and Siddiqi, Kaleem},
  title     = {Revealing Significant Medial Structure in Polyhedral Meshes},
  booktitle = {International Symposium on 3D Data Processing, Visualization and Transmission (3DPVT)},
  year      = {2006},
  doi       = {10.1109/3DPVT.2006.117}
}";

/// The average outward flux as a method.
///
/// Answers every level, the published one with the paper's parameters where none are set. Cost `O(V N)` closest points for `V` voxels, memory `O(V)`.
pub fn method() -> Method<AofSettings> {
    let info = MethodInfo::new("aof", "Average outward flux")
        .citation(
            "Svetlana Stolpner, Kaleem Siddiqi 2006. Revealing Significant Medial Structure in \
             Polyhedral Meshes. 3DPVT. https://doi.org/10.1109/3DPVT.2006.117",
        )
        .bibtex(BIBTEX)
        .summary(
            "Keeps the voxels into which the gradient of the distance flows, coarse to fine, \
             straight from the surface.",
        )
        .native(NativeLevel::larger_is_coarser("alpha", "degrees of object angle"))
        .published(
            "the paper's rule and lattice: voxels with a flux of at most -0.2 of 369 along the longest \
             side, or as many as fit into memory; the paper chooses a flux for each model, -0.15 to \
             -0.25",
        )
        .params(settings::describe())
        .extra(Capability::new(VOXELS, "the voxels that the spheres stand for, with their flux"));
    Method::new(info, prepare)
}

fn prepare<'s>(
    shape: &'s Shape,
    settings: AofSettings,
    run: &RunContext,
) -> Result<Box<dyn Simplification + 's>, SimplifyError> {
    settings.at(Level::Published).validate()?;
    let params = settings.at(Level::Spheres(1)).validate()?;
    let tree = shape.surface_tree()?;
    let solid = Solid::new(shape, Surface::of(shape), params, run.clone());
    let base = solid.base()?;
    let usual = Stage { solid, base };
    Ok(Box::new(Prepared { shape, settings, run: run.clone(), tree, usual }))
}

/// One shape at the resolution of the parameters.
struct Prepared<'s> {
    shape: &'s Shape,
    settings: AofSettings,
    run: RunContext,
    tree: Arc<TriangleBvh>,
    usual: Stage<'s>,
}

/// One shape with one set of parameters.
struct Stage<'s> {
    solid: Solid<'s>,
    base: Base,
}

impl Simplification for Prepared<'_> {
    fn at(&mut self, level: Level) -> Result<Simplified, SimplifyError> {
        let is_other = self.settings.at(level) != *self.usual.solid.params();
        if level == Level::Published && is_other {
            let stage = published::stage(self.shape, &self.settings, &self.run)?;
            return stage.at(level, &self.tree);
        }
        self.usual.at(level, &self.tree)
    }
}

impl Stage<'_> {
    fn at(&self, level: Level, tree: &TriangleBvh) -> Result<Simplified, SimplifyError> {
        let Self { solid, base } = self;
        let mut diagnostics = base.diagnostics.clone();
        let angle = match level {
            Level::Native(angle) => angle,
            Level::Spheres(_) | Level::Published => solid.params().angle,
        };
        let axis = match level {
            Level::Spheres(0) => {
                return Err(SimplifyError::Level("ask for at least one sphere".into()));
            }
            Level::Spheres(count) => solid.with_count(base, count, &mut diagnostics)?,
            Level::Native(_) | Level::Published => {
                params::check_angle(angle).map_err(SimplifyError::Level)?;
                solid.say_what_is_lost(base, base.resolution, &mut diagnostics)?;
                solid.axis(base.resolution, &base.descent, angle)?
            }
        };
        solid.check_output(base, &axis)?;
        let mesh = solid.medial_mesh(&axis, tree)?;
        mesh.check()?;
        axis.diagnose(angle, &mut diagnostics);
        let native = (!matches!(level, Level::Spheres(_))).then_some(angle);
        Ok(Simplified {
            mesh,
            asked: level,
            native_level: native,
            diagnostics,
            extras: Extras::with(axis.lattice_voxels()),
        })
    }
}
