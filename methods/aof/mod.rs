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
//! - Samples: the classic spiral has a mean direction that is not zero, nor has the equal-area one,
//!   so that a constant field has a flux of up to that length. Voxels are dismissed if `AOF'` is not
//!   below minus this length; otherwise half the directions of a plane would never be dismissed.
//! - [`Level::Published`]: the angle that the parameters name.
//!
//! # Deviations from the paper
//!
//! - Line 3 of Algorithm 1, read literally, begins with the smallest spheres; what is meant is
//!   `sigma` at the coarsest level and `sigma / d^j` after `j` divisions.
//! - The equal-area spiral is the default: its error on a plane through the centre is about half
//!   that of the classic one. `spiral=classic` is the paper's.
//! - A coarse voxel whose sphere does not fit inside is split, not lost, so that the start set is
//!   that of the finest level (`start=fine`). The paper's own (`start=coarse`) loses whatever is thinner
//!   than twice the coarsest voxel.
//! - `homotopy` deletes at the finest level alone, where dismissed voxels count as flux 0; the
//!   paper deletes simple voxels at each level. Both keep the homotopy type of the start set; this
//!   way it is the start set of the finest level.
//! - [`Level::Spheres`] is not in the paper. Ranking the voxels of a fine lattice by `AOF'` leaves
//!   scattered pieces of the flattest sheet. Instead the lattice is made as coarse as the count
//!   allows while its start set keeps the topology, and its thinned axis is taken down to the count
//!   by deleting simple voxels, largest `AOF'` first (file `count.rs`).

mod advice;
mod bricks;
mod coarse_to_fine;
mod count;
mod flux;
mod grid;
mod lattice;
mod output;
mod params;
mod queue;
mod refine;
mod simple;
mod solid;
mod spiral;
mod thinning;
mod voids;

use std::sync::Arc;

use medial::geometry::{NearbyTriangles, TriangleBvh};
use medial::shape::Shape;
use medial::simplifier::{
    Capability, Extras, Level, Method, MethodInfo, NativeLevel, RunContext, Simplification,
    Simplified, SimplifyError,
};

use count::Lattices;

pub use bricks::{Bricks, Place, Voxel};
pub use coarse_to_fine::{Descent, Surface, Tally, Wanted, coarse_to_fine};
pub use flux::{Probe, Sphere};
pub use grid::Grid;
pub use lattice::{LatticeVoxel, LatticeVoxels};
pub use params::{AofParams, Start, Variant};
pub use refine::{Refined, refine};
pub use simple::{SimpleTable, is_simple};
pub use solid::{Axis, Base, Solid};
pub use spiral::Spiral;
pub use thinning::{Order, is_end_point, thin};

/// Name of the extra that holds the [`LatticeVoxels`].
pub const VOXELS: &str = "voxels";

/// The average outward flux as a method.
///
/// Answers every level. Cost `O(V N)` closest points for `V` voxels, memory `O(V)`.
pub fn method() -> Method<AofParams> {
    let info = MethodInfo::new("aof", "Average outward flux")
        .citation(
            "Svetlana Stolpner, Kaleem Siddiqi 2006. Revealing Significant Medial Structure in \
             Polyhedral Meshes. 3DPVT. https://doi.org/10.1109/3DPVT.2006.117",
        )
        .summary(
            "Keeps the voxels into which the gradient of the distance flows, coarse to fine, \
             straight from the surface.",
        )
        .native(NativeLevel::larger_is_coarser("alpha", "degrees of object angle"))
        .filter()
        .sweep(&[15.0, 25.0, 35.0, 45.0, 60.0])
        .published(
            "the object angle of the parameter `angle`: the paper chooses one for each model",
        )
        .params(AofParams::describe())
        .extra(Capability::new(VOXELS, "the voxels that the spheres stand for, with their flux"));
    Method::new(info, prepare)
}

fn prepare<'s>(
    shape: &'s Shape,
    params: AofParams,
    run: &RunContext,
) -> Result<Box<dyn Simplification + 's>, SimplifyError> {
    let params = params.validate()?;
    let tree = shape.surface_tree()?;
    let surface =
        Surface { triangles: NearbyTriangles::new(shape.mesh()), inside: shape.inside_test() };
    let solid = Solid::new(shape, surface, params, run.clone());
    let base = solid.base()?;
    Ok(Box::new(Prepared { solid, tree, base, lattices: Lattices::new() }))
}

/// One shape at the resolution of the parameters.
struct Prepared<'s> {
    solid: Solid<'s>,
    tree: Arc<TriangleBvh>,
    base: Base,
    lattices: Lattices,
}

impl Simplification for Prepared<'_> {
    fn at(&mut self, level: Level) -> Result<Simplified, SimplifyError> {
        let Self { solid, tree, base, lattices } = self;
        let mut diagnostics = base.diagnostics.clone();
        lattices.begin();
        let angle = match level {
            Level::MaxError(_) => return Err(SimplifyError::searched()),
            Level::Native(angle) => angle,
            Level::Spheres(_) | Level::Published => solid.params().angle,
        };
        let axis = match level {
            Level::Spheres(0) => {
                return Err(SimplifyError::Level("ask for at least one sphere".into()));
            }
            Level::Spheres(count) => solid.with_count(base, count, lattices, &mut diagnostics)?,
            Level::Native(_) | Level::Published | Level::MaxError(_) => {
                params::check_angle(angle).map_err(SimplifyError::Level)?;
                solid.axis(base.resolution, &base.descent, angle)?
            }
        };
        let mesh = solid.medial_mesh(&axis, tree)?;
        mesh.check()?;
        axis.diagnose(angle, &mut diagnostics);
        let native = (!matches!(level, Level::Spheres(_))).then_some(angle);
        Ok(Simplified {
            mesh,
            asked: level,
            native_level: native,
            work: lattices.work(),
            diagnostics,
            extras: Extras::with(axis.lattice_voxels()),
        })
    }
}
