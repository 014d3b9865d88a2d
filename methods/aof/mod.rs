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
//!   the substitute.
//! - Either spiral has a mean direction that is not zero, so that a constant field has a flux of up
//!   to that length. Coarse voxels are dismissed if `AOF'` is not below minus this length
//!   (`dismiss=bias`); with the paper's 0 (`dismiss=zero`) half the directions of a plane are never
//!   dismissed. Neither reproduces its Table 2: of the box 45.9 % go at the first level there, of
//!   the built-in box 31 % with zero and 64 % with bias.
//! - If the start set on a lattice has other Betti numbers than the solid, or leaves part of the
//!   surface far from every voxel, the lattice is refined up to three times, and the best one is used
//!   (`solid.rs`). Warnings list the remaining losses.
//! - Line 3 of Algorithm 1, read literally, begins with the smallest spheres. The intended meaning is
//!   `sigma` at the coarsest level and `sigma / d^j` after `j` divisions.
//! - The equal-area spiral is the default: its largest error on a plane through the centre is about
//!   0.6 of that of the classic one (held by a test in `flux.rs`). `spiral=classic` is the paper's.
//! - A coarse voxel whose sphere does not fit inside is split instead of dropped, so that the start
//!   set is that of the finest level (`start=fine`). The paper's rule (`start=coarse`) loses every part
//!   thinner than twice the coarsest voxel.
//! - `homotopy` deletes at the finest level alone, where dismissed voxels count as flux 0; the
//!   paper deletes simple voxels at each level. Both keep the homotopy type of the start set; this
//!   way it is the start set of the finest level.
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
    Simplified, SimplifyError,
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
/// The published level has the paper's parameters where none are set. Cost `O(V N)` closest points for
/// `V` voxels, memory `O(V)`.
pub fn method() -> Method<AofSettings> {
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
        .params(AofSettings::describe())
        .extra(Capability::new(VOXELS, "the voxels that the spheres stand for, with their flux"));
    Method::new(info, prepare)
}

fn prepare<'s>(shape: &'s Shape, settings: AofSettings, run: &RunContext) -> Prepared<'s> {
    if shape.has_given_initial() {
        let why = "it starts from no medial mesh: leave out --initial";
        return Err(SimplifyError::unsupported(why));
    }
    settings.at(Level::Published).validate()?;
    let params = settings.at(Level::Spheres(1)).validate()?;
    // In the parameters of a level 0 stands for the value of the variant.
    if let Auto::Value(mu) = settings.mu {
        within("mu", mu, (Excluded(0.0), Included(0.75)))?;
    }
    let solid = Solid::new(shape, params, run.clone())?;
    let base = match solid.base() {
        // The published level may have a lattice that fits. Other levels repeat the error.
        Err(SimplifyError::Parameter(_)) => None,
        base => Some(base?),
    };
    let run = run.clone();
    Ok(Box::new(move |level: Level| {
        // The published level has a separate lattice, unless all parameters are set.
        if level == Level::Published && settings.at(level) != solid.params {
            let (solid, base) = solid::published(shape, &settings, &run)?;
            return at(&solid, &base, level);
        }
        match &base {
            Some(base) => at(&solid, base, level),
            None => at(&solid, &solid.base()?, level),
        }
    }))
}

fn at(solid: &Solid<'_>, base: &Base, level: Level) -> Result<Simplified> {
    let mut diagnostics = base.diagnostics.clone();
    let angle = match level {
        Level::Native(angle) => level_within("angle", angle, ANGLES)?,
        Level::Spheres(_) | Level::Published => solid.params.angle,
    };
    let axis = match some_spheres(level)? {
        Level::Spheres(count) => solid.with_count(base, count, &mut diagnostics)?,
        Level::Native(_) | Level::Published => {
            solid.warn_of(base.loss, base.resolution, &mut diagnostics);
            solid.axis(&base.descent, angle)?
        }
    };
    solid.check_memory(base.resolution, solid.megabytes_with_output(base, &axis))?;
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

/// Most voxels along a side of the bounding box: places have 16 bits.
pub(super) const MAX_RESOLUTION: u32 = 60_000;
/// Most voxels along the longest side of a coarse voxel.
const MAX_SPLIT: u32 = 1024;

/// Object angles, in degrees.
const ANGLES: (Bound<f64>, Bound<f64>) = (Excluded(0.0), Included(90.0));

/// Samples of the three default levels.
const SAMPLES: &str = "70/60/50";
/// Voxels along the longest side in the paper's figures of the torus and the cow.
const PUBLISHED_RESOLUTION: u32 = 369;
/// Flux at or below which the paper's figures of Venus and the cow keep a voxel.
const PUBLISHED_FLUX: f64 = 0.2;
/// `mu` on a sheet.
const ON_SHEET: f64 = 0.5;

/// A value, or that of the level: most defaults are the paper's at the published level and our own at
/// all others.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", expecting = "expected `auto`, a number or a word of the list")]
pub enum Auto<T> {
    /// That of the level.
    Auto,
    /// The value.
    #[serde(untagged)]
    Value(T),
}

impl<T: Copy> Auto<T> {
    fn or(self, value: T) -> T {
        match self {
            Self::Value(value) => value,
            Self::Auto => value,
        }
    }
}

medial::parameters! {
    /// Parameters as the user sets them; [`AofSettings::at`] has their values at a level.
    #[derive(Clone, Debug, PartialEq)]
    pub struct AofSettings {
        /// Voxels along the longest side of the bounding box, at the finest level; auto is 54, and
        /// 369 at the published level, or as many as fit into memory.
        resolution: Auto<u32> = Auto::Auto, "voxels, or auto";
        /// `d`: each voxel is split into d x d x d.
        d: u32 = 3, "number";
        /// Levels of resolution, from coarse to fine.
        levels: u32 = 3, "number";
        /// `N`: samples on each sphere, from the coarsest level to the finest, or one number for all.
        #[serde(deserialize_with = "number_or_text")]
        samples: String = SAMPLES.to_owned(), "numbers, separated by /";
        /// `alpha`: object angle of the thinnest sheets that are kept, when no level names one; auto
        /// is 30, and 23.6 at the published level, where sheets have a flux of -0.2.
        angle: Auto<f64> = Auto::Auto, "degrees, or auto";
        /// Factor of the threshold -mu sin(angle); auto is 0.125 for plain and homotopy, where a sheet
        /// anywhere in a voxel keeps it, 0.375 for the end points of thinning, and 0.5 at the
        /// published level.
        mu: Auto<f64> = Auto::Auto, "pure number, or auto";
        /// Keep by threshold; delete simple voxels alone, outermost first; or thin by flux; auto is
        /// thinning, and plain at the published level.
        variant: Auto<Variant> = Auto::Auto, "plain, homotopy, thinning or auto";
        /// How samples lie on the sphere; auto is equal-area, and classic at the published level.
        spiral: Auto<Spiral> = Auto::Auto, "equal-area, classic or auto";
        /// Begin with the voxels whose spheres fit inside at the finest level, or at the coarsest as
        /// in the paper; auto is fine, and coarse at the published level where that has a voxel.
        start: Auto<Start> = Auto::Auto, "fine, coarse or auto";
        /// Dismiss coarse voxels from a flux of 0 on, as in the paper, or of minus that of the samples
        /// in a constant field; auto is bias, and zero at the published level.
        dismiss: Auto<Dismiss> = Auto::Auto, "zero, bias or auto";
        /// Move centres onto the axis, between opposite closest points; auto is true, and false at the
        /// published level.
        refine: Auto<bool> = Auto::Auto, "true, false or auto";
        /// Limit of the memory for voxels and the medial mesh.
        max_memory: f64 = 2000.0, "megabytes";
    }
}

impl AofSettings {
    /// The parameters at a level.
    pub fn at(&self, level: Level) -> AofParams {
        // Of two values the first is the paper's, for the published level, the second ours.
        let ours = usize::from(level != Level::Published);
        AofParams {
            resolution: self.resolution.or([PUBLISHED_RESOLUTION, 54][ours]),
            d: self.d,
            levels: self.levels,
            samples: self.samples.clone(),
            angle: self.angle.or([(PUBLISHED_FLUX / ON_SHEET).asin().to_degrees(), 30.0][ours]),
            mu: self.mu.or([ON_SHEET, 0.0][ours]),
            variant: self.variant.or([Variant::Plain, Variant::Thinning][ours]),
            spiral: self.spiral.or([Spiral::Classic, Spiral::EqualArea][ours]),
            start: self.start.or([Start::Coarse, Start::Fine][ours]),
            dismiss: self.dismiss.or([Dismiss::Zero, Dismiss::Bias][ours]),
            refine: self.refine.or([false, true][ours]),
            max_memory: self.max_memory,
        }
    }
}

/// Parameters at one level; [`AofSettings`] has their meaning. The default is that of every level but
/// the published one.
#[derive(Clone, Debug, PartialEq)]
#[allow(missing_docs, reason = "documented by the fields of the settings")]
pub struct AofParams {
    pub resolution: u32,
    pub d: u32,
    pub levels: u32,
    pub samples: String,
    pub angle: f64,
    /// 0 for 1/8 where voxels are kept by the threshold, and 3/8 where only end points are.
    pub mu: f64,
    pub variant: Variant,
    pub spiral: Spiral,
    pub start: Start,
    pub dismiss: Dismiss,
    pub refine: bool,
    pub max_memory: f64,
}

impl Default for AofParams {
    fn default() -> Self {
        AofSettings::default().at(Level::Spheres(1))
    }
}

/// The use of the flux.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Variant {
    /// All voxels with a flux at or below the threshold.
    Plain,
    /// Voxels above the threshold are deleted where they are simple, outermost first.
    Homotopy,
    /// Simple voxels are deleted by flux, the least medial first, except for end points below the
    /// threshold (Siddiqi, Bouix, Tannenbaum, Zucker 2002).
    Thinning,
}

/// The start set of voxels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Start {
    /// Voxels of the finest level whose spheres lie inside. Coarser ones that do not are split.
    Fine,
    /// Voxels of the coarsest level whose spheres lie inside, as in the paper.
    Coarse,
}

/// From which flux on a coarse voxel is dismissed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Dismiss {
    /// `AOF' >= 0`, as in the paper.
    Zero,
    /// Where `AOF'` is not below minus the flux that the samples have in a constant field.
    Bias,
}

impl AofParams {
    /// The parameters if they are in their ranges.
    fn validate(self) -> Result<Self> {
        within("resolution", self.resolution, 1..=MAX_RESOLUTION)?;
        within("levels", self.levels, 1..)?;
        within("d", self.d, if self.levels > 1 { 2.. } else { 0.. })?;
        let split = self.d.checked_pow(self.levels - 1).unwrap_or(u32::MAX);
        within("d^(levels - 1)", split, 0..=MAX_SPLIT)?;
        within("max_memory", self.max_memory, (Excluded(0.0), Excluded(f64::INFINITY)))?;
        within("angle", self.angle, ANGLES)?;
        self.sample_counts()?;
        Ok(self)
    }

    /// Samples of each level, from coarse to fine.
    pub(super) fn sample_counts(&self) -> Result<Vec<usize>> {
        let levels = self.levels as usize;
        let words = self.samples.split('/').map(|word| word.trim().parse());
        let mut counts = words.collect::<Result<Vec<usize>, _>>().unwrap_or_default();
        let is_default = self.samples == SAMPLES;
        // The default is made for its own number of levels; of fewer, the coarse ones are left out.
        if is_default {
            counts.drain(..counts.len().saturating_sub(levels));
        }
        let has_one_each = is_default || counts.len() == 1 || counts.len() == levels;
        if !has_one_each || !counts.iter().all(|count| (8..=10_000).contains(count)) {
            return Err(SimplifyError::Parameter(format!(
                "samples = {}: give 8 to 10000 for each of {levels} levels, from coarse to fine, such \
                 as {SAMPLES} for three, or one number for all",
                self.samples
            )));
        }
        counts.resize(levels, counts[counts.len() - 1]);
        Ok(counts)
    }

    /// Flux at or below which a voxel is kept for an object angle in degrees.
    pub(super) fn threshold(&self, angle: f64) -> f32 {
        let mu = match self.variant {
            _ if self.mu > 0.0 => self.mu,
            Variant::Plain | Variant::Homotopy => 0.125,
            Variant::Thinning => 0.375,
        };
        (-mu * angle.to_radians().sin()) as f32
    }
}

/// One number of samples for all levels may be given as a number.
fn number_or_text<'de, D: serde::Deserializer<'de>>(from: D) -> Result<String, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged, expecting = "expected 8 to 10000 for each level, such as 70/60/50")]
    enum Given {
        Number(u64),
        Text(String),
    }
    Ok(match Given::deserialize(from)? {
        Given::Number(number) => number.to_string(),
        Given::Text(text) => text,
    })
}
