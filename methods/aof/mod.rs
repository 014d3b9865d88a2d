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
//! 5. At the finest level the voxels are thinned by flux (section 3.3 of Siddiqi et al. 2002), or those
//!    with a flux at or below a threshold are kept (proposition 5.1), as the level requires.
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
//! - *All levels but the published one* have our own rules ([`Rules::Own`]): a lattice of 54 voxels along
//!   the longest side, thinned by flux with `mu = 3/8` for its end points. The paper has 369 voxels in its
//!   figures, and keeps by threshold. Kept by threshold a sheet is two voxels thick and torn, and a lattice
//!   of 369 has far more voxels than the other methods have spheres. [`Level::Published`] has the paper's
//!   rules ([`Rules::Published`]). If 369 does not fit into [`MAX_MEGABYTES`], or no coarse voxel fits into
//!   the solid, a warning names the substitute.
//! - The paper's deletion by distance (section 6.3) is left out: thinning by flux keeps the topology too.
//! - Either spiral has a mean direction that is not zero, so that a constant field has a flux of up
//!   to that length. Our rules dismiss coarse voxels if `AOF'` is not below minus this length; with the
//!   paper's 0 half the directions of a plane are never dismissed. Neither reproduces its Table 2: of the
//!   box 45.9 % go at the first level there, of the built-in box 31 % with 0 and 64 % with the length.
//! - If the start set on a lattice has other Betti numbers than the solid, or leaves part of the
//!   surface far from every voxel, the lattice is refined up to three times, and the best one is used
//!   (`solid.rs`). Warnings list the remaining losses.
//! - Line 3 of Algorithm 1, read literally, begins with the smallest spheres. The intended meaning is
//!   `sigma` at the coarsest level and `sigma / d^j` after `j` divisions.
//! - Our rules have the equal-area spiral: its largest error on a plane through the centre is about
//!   0.6 of that of the paper's classic one (held by a test in `flux.rs`).
//! - Our rules split a coarse voxel whose sphere does not fit inside, so that the start set is that of
//!   the finest level. The paper drops it, and loses every part thinner than twice the coarsest voxel.
//! - Voxels are thinned at the finest level alone, where dismissed voxels count as flux 0; the paper
//!   deletes simple voxels at each level. Both keep the homotopy type of the start set; this way it is
//!   the start set of the finest level.
//! - [`Level::Spheres`] is not in the paper. Ranking the voxels of a fine lattice by `AOF'` leaves
//!   scattered pieces of the flattest sheet. Instead the lattice is made as coarse or as fine as the
//!   count requires, while its start set keeps the topology. Then simple voxels are deleted from its
//!   thinned axis, largest `AOF'` first, down to the count (`solid.rs`).

mod flux;
mod lattice;
mod output;
mod solid;
mod thinning;

use std::ops::Bound::{self, Excluded, Included};

use medial::shape::Shape;
use medial::simplifier::{
    Capability, Extras, Level, Method, MethodInfo, NativeLevel, ParamFields, RunContext,
    Simplification, Simplified, SimplifyError,
};
use serde::{Deserialize, Serialize};

use crate::levels::{level_within, some_spheres, within};
use crate::{Prepared, Result};

pub use flux::{Refined, Sphere, Spiral, Surface};
pub use lattice::{Bricks, Descent, Grid, LatticeVoxels, Place, Voxel, Wanted};
pub use solid::{Base, Loss, Solid};

/// Name of the extra that holds the [`LatticeVoxels`].
pub const VOXELS: &str = "voxels";

/// The average outward flux as a method.
///
/// The published level has the paper's rules. Cost `O(V N)` closest points for `V` voxels, memory `O(V)`.
pub fn method() -> Method<AofParams> {
    let info = MethodInfo::new("aof", "Average outward flux")
        .citation(
            "Svetlana Stolpner, Kaleem Siddiqi 2006. Revealing Significant Medial Structure in \
             Polyhedral Meshes. 3DPVT. https://doi.org/10.1109/3DPVT.2006.117",
        )
        .bibtex(crate::references(&["StolpnerSiddiqi2006"]))
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
        .params(AofParams::describe())
        .extra(Capability::new(VOXELS, "the voxels that the spheres stand for, with their flux"));
    Method::new(info, prepare)
}

fn prepare<'s>(shape: &'s Shape, params: AofParams, run: &RunContext) -> Prepared<'s> {
    Ok(Box::new(PreparedAof::new(shape, params, run)?))
}

/// A solid and the lattice of its levels.
struct PreparedAof<'s> {
    shape: &'s Shape,
    run: RunContext,
    resolution: Resolution,
    /// The lattice of all levels but the published one, made by the first of them.
    own: Option<(Solid<'s>, Base)>,
}

impl<'s> PreparedAof<'s> {
    fn new(shape: &'s Shape, params: AofParams, run: &RunContext) -> Result<Self> {
        if shape.has_given_initial() {
            let why = "it starts from no medial mesh: leave out --initial";
            return Err(SimplifyError::unsupported(why));
        }
        if let Resolution::Voxels(resolution) = params.resolution {
            within("resolution", resolution, 1..=MAX_RESOLUTION)?;
        }
        // Both kinds of levels need them, so they count as substrates of the preparation.
        shape.surface_tree()?;
        shape.inside_test();
        Ok(Self { shape, run: run.clone(), resolution: params.resolution, own: None })
    }
}

impl Simplification for PreparedAof<'_> {
    fn at(&mut self, level: Level) -> Result<Simplified> {
        let level = some_spheres(level)?;
        if let Level::Native(angle) = level {
            level_within("angle", angle, ANGLES)?;
        }
        if level == Level::Published {
            let (solid, base) = solid::published(self.shape, self.resolution, &self.run)?;
            return at(&solid, &base, level);
        }
        let (solid, base) = match &mut self.own {
            Some(own) => own,
            own => {
                let setting = LatticeSetting::own(self.resolution.or(OWN_RESOLUTION));
                let solid = Solid::new(self.shape, setting, self.run.clone())?;
                let base = solid.base()?;
                own.insert((solid, base))
            }
        };
        at(solid, base, level)
    }
}

fn at(solid: &Solid<'_>, base: &Base, level: Level) -> Result<Simplified> {
    let mut diagnostics = base.diagnostics.clone();
    let angle = if let Level::Native(angle) = level { angle } else { solid.setting.angle };
    let axis = match level {
        Level::Spheres(count) => solid.with_count(base, count, &mut diagnostics)?,
        Level::Native(_) | Level::Published => {
            solid.warn_of(base.loss, base.resolution, &mut diagnostics);
            solid.axis(&base.descent, angle)?
        }
    };
    solid.check_memory(base.resolution, base.megabytes_with_output(&axis))?;
    let mesh = solid.medial_mesh(&axis)?;
    mesh.check()?;
    if axis.voxels.is_empty() {
        diagnostics.warn(format!("no voxel passes an object angle of {angle} degrees"));
    }
    for (name, number) in ["voxel_b0", "voxel_b1", "voxel_b2"].into_iter().zip(axis.betti()) {
        diagnostics.count(name, number as usize);
    }
    let native_level = (!matches!(level, Level::Spheres(_))).then_some(angle);
    let extras = Extras::with(axis);
    Ok(Simplified { native_level, diagnostics, extras, ..Simplified::new(mesh, level) })
}

/// Limit of the resolution: the indices of a [`Place`] have 16 bits.
pub(super) const MAX_RESOLUTION: u32 = 60_000;

/// Range of object angles, in degrees.
const ANGLES: (Bound<f64>, Bound<f64>) = (Excluded(0.0), Included(90.0));

/// `d` of the paper: each voxel is split into 3 x 3 x 3.
const SUBDIVISION: u32 = 3;
/// `N`: samples on the sphere of a voxel, for each level of resolution from coarse to fine.
const SAMPLES: [usize; 3] = [70, 60, 50];
/// Voxels of the finest level along a side of the coarsest.
pub(super) const SPLIT: u32 = SUBDIVISION.pow(SAMPLES.len() as u32 - 1);

/// Voxels along the longest side at all levels but the published one, unless set.
const OWN_RESOLUTION: u32 = 54;
/// Voxels along the longest side in the paper's figures of the torus and the cow.
const PUBLISHED_RESOLUTION: u32 = 369;
/// Flux at or below which the paper's figures of Venus and the cow keep a voxel, negated.
const PUBLISHED_FLUX: f64 = 0.2;
/// Object angle of the thinnest sheets of a number of spheres, in degrees.
const OWN_ANGLE: f64 = 30.0;
/// Memory for voxels and medial mesh, in megabytes. Finer lattices are refused.
pub const MAX_MEGABYTES: f64 = 2000.0;

/// Voxels along the longest side of the bounding box.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", expecting = "expected `auto` or a number of voxels")]
pub enum Resolution {
    /// That of the level.
    Auto,
    /// The number.
    #[serde(untagged)]
    Voxels(u32),
}

impl Resolution {
    fn or(self, of_level: u32) -> u32 {
        match self {
            Self::Voxels(voxels) => voxels,
            Self::Auto => of_level,
        }
    }
}

medial::parameters! {
    /// Parameters of the average outward flux.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct AofParams {
        /// Voxels along the longest side of the bounding box, at the finest level; auto is 54, and
        /// 369 at the published level, or as many as fit into memory.
        resolution: Resolution = Resolution::Auto, "voxels, or auto";
    }
}

/// The rules of a descent, and of the axis on its lattice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rules {
    /// The paper's: classic spiral, coarse voxels dismissed from a flux of 0 on, voxels kept by threshold,
    /// centres where they are.
    Published,
    /// Equal-area spiral, coarse voxels dismissed from minus its flux in a constant field on, voxels
    /// thinned by flux, centres moved onto the axis.
    Own,
}

impl Rules {
    /// The samples on spheres.
    pub(super) fn spiral(self) -> Spiral {
        match self {
            Self::Published => Spiral::Classic,
            Self::Own => Spiral::EqualArea,
        }
    }

    /// Flux at or below which a voxel is kept, and with our rules an end point, for an object angle in
    /// degrees.
    pub(super) fn threshold(self, angle: f64) -> f32 {
        let mu = match self {
            // On a sheet.
            Self::Published => 0.5,
            Self::Own => 0.375,
        };
        (-mu * angle.to_radians().sin()) as f32
    }
}

/// The setting of a lattice.
#[derive(Clone, Debug, PartialEq)]
pub struct LatticeSetting {
    /// Voxels along the longest side of the bounding box, at the finest level.
    pub resolution: u32,
    /// The rules.
    pub rules: Rules,
    /// Whether a coarse voxel is dropped if its sphere does not fit inside, as in the paper, instead of
    /// split.
    pub starts_coarse: bool,
    /// `alpha`: object angle of the thinnest sheets that are kept, in degrees, where no level has one.
    pub angle: f64,
    /// Limit of the memory, in megabytes.
    pub max_megabytes: f64,
}

impl LatticeSetting {
    /// That of all levels but the published one.
    pub fn own(resolution: u32) -> Self {
        Self {
            resolution,
            rules: Rules::Own,
            starts_coarse: false,
            angle: OWN_ANGLE,
            max_megabytes: MAX_MEGABYTES,
        }
    }

    /// The paper's.
    pub fn published(resolution: u32) -> Self {
        Self {
            rules: Rules::Published,
            starts_coarse: true,
            angle: (PUBLISHED_FLUX / 0.5).asin().to_degrees(),
            ..Self::own(resolution)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_lattice_of_the_requested_level_is_made() {
        let shape = crate::test_shape("box", 8);
        let params = AofParams { resolution: Resolution::Voxels(99) };
        let mut prepared = PreparedAof::new(&shape, params, &RunContext::default()).expect("valid");
        prepared.at(Level::Published).expect("published");
        assert!(prepared.own.is_none());
        prepared.at(Level::Native(30.0)).expect("an angle");
        assert!(prepared.own.is_some());
    }
}
