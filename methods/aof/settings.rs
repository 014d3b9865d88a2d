//! The parameters as the user sets them, and their values at a level.
//!
//! Most defaults are the paper's at the published level and our own at all others. So a parameter that
//! is not set, or set to `auto`, gets its value from the level.

use std::fmt;
use std::marker::PhantomData;

use medial::simplifier::{Level, ParamInfo};
use serde::de::{Error, IntoDeserializer, Visitor};
use serde::{Deserialize, Deserializer};

use super::params::{AofParams, Dismiss, Start, Variant, number_or_text};
use super::spiral::Spiral;

/// Voxels along the longest side in the paper's figures of the torus and the cow.
const PUBLISHED_RESOLUTION: u32 = 369;
/// Flux at or below which the paper's figures of Venus and the cow keep a voxel.
const PUBLISHED_FLUX: f64 = 0.2;
/// `mu` on a sheet.
const ON_SHEET: f64 = 0.5;

/// A value, or that of the level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Auto<T>(pub Option<T>);

impl<T> Default for Auto<T> {
    fn default() -> Self {
        Self(None)
    }
}

impl<T: Copy> Auto<T> {
    fn or(self, value: T) -> T {
        self.0.unwrap_or(value)
    }
}

/// Parameters as the user sets them.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AofSettings {
    /// [`AofParams::resolution`]; else 54, published 369 or as many as fit into memory.
    pub resolution: Auto<u32>,
    /// [`AofParams::d`].
    pub d: u32,
    /// [`AofParams::levels`].
    pub levels: u32,
    /// [`AofParams::samples`].
    #[serde(deserialize_with = "number_or_text")]
    pub samples: String,
    /// [`AofParams::angle`]; else 30 degrees, published that of a flux of -0.2 on a sheet.
    pub angle: Auto<f64>,
    /// [`AofParams::mu`]; else by the variant, published 1/2.
    pub mu: Auto<f64>,
    /// [`AofParams::variant`]; else thinning, published plain.
    pub variant: Auto<Variant>,
    /// [`AofParams::spiral`]; else equal-area, published classic.
    pub spiral: Auto<Spiral>,
    /// [`AofParams::start`]; else fine, published coarse where that has a voxel.
    pub start: Auto<Start>,
    /// [`AofParams::dismiss`]; else bias, published zero.
    pub dismiss: Auto<Dismiss>,
    /// [`AofParams::refine`]; else true, published false.
    pub refine: Auto<bool>,
    /// [`AofParams::max_memory`].
    pub max_memory: f64,
}

impl Default for AofSettings {
    fn default() -> Self {
        let AofParams { d, levels, samples, max_memory, .. } = AofParams::default();
        Self {
            resolution: Auto(None),
            d,
            levels,
            samples,
            angle: Auto(None),
            mu: Auto(None),
            variant: Auto(None),
            spiral: Auto(None),
            start: Auto(None),
            dismiss: Auto(None),
            refine: Auto(None),
            max_memory,
        }
    }
}

impl AofSettings {
    /// The parameters at a level.
    pub fn at(&self, level: Level) -> AofParams {
        let auto = match level {
            Level::Published => published(),
            _ => AofParams::default(),
        };
        AofParams {
            resolution: self.resolution.or(auto.resolution),
            d: self.d,
            levels: self.levels,
            samples: self.samples.clone(),
            angle: self.angle.or(auto.angle),
            mu: self.mu.or(auto.mu),
            variant: self.variant.or(auto.variant),
            spiral: self.spiral.or(auto.spiral),
            start: self.start.or(auto.start),
            dismiss: self.dismiss.or(auto.dismiss),
            refine: self.refine.or(auto.refine),
            max_memory: self.max_memory,
        }
    }
}

/// The paper's values.
fn published() -> AofParams {
    AofParams {
        resolution: PUBLISHED_RESOLUTION,
        angle: (PUBLISHED_FLUX / ON_SHEET).asin().to_degrees(),
        mu: ON_SHEET,
        variant: Variant::Plain,
        spiral: Spiral::Classic,
        start: Start::Coarse,
        dismiss: Dismiss::Zero,
        refine: false,
        ..AofParams::default()
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Auto<T> {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        from.deserialize_any(AutoVisitor(PhantomData))
    }
}

struct AutoVisitor<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for AutoVisitor<T> {
    type Value = Auto<T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("`auto`, a number or a word")
    }

    fn visit_str<E: Error>(self, word: &str) -> Result<Auto<T>, E> {
        match word {
            "auto" => Ok(Auto(None)),
            word => T::deserialize(word.into_deserializer()).map(|value| Auto(Some(value))),
        }
    }

    fn visit_bool<E: Error>(self, value: bool) -> Result<Auto<T>, E> {
        T::deserialize(value.into_deserializer()).map(|value| Auto(Some(value)))
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<Auto<T>, E> {
        T::deserialize(value.into_deserializer()).map(|value| Auto(Some(value)))
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<Auto<T>, E> {
        T::deserialize(value.into_deserializer()).map(|value| Auto(Some(value)))
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Auto<T>, E> {
        T::deserialize(value.into_deserializer()).map(|value| Auto(Some(value)))
    }
}

/// The parameters that can be set.
pub(super) fn describe() -> Vec<ParamInfo> {
    let fixed = AofSettings::default();
    vec![
        ParamInfo::new(
            "resolution",
            "auto",
            "voxels",
            "voxels along the longest side of the bounding box, at the finest level; auto is 54, and \
             369 at the published level, or as many as fit into memory",
        ),
        ParamInfo::new("d", fixed.d, "number", "each voxel is split into d x d x d"),
        ParamInfo::new(
            "levels",
            fixed.levels,
            "number",
            "levels of resolution, from coarse to fine",
        ),
        ParamInfo::new(
            "samples",
            fixed.samples,
            "numbers",
            "samples on each sphere, from the coarsest level to the finest",
        ),
        ParamInfo::new(
            "angle",
            "auto",
            "degrees",
            "object angle of the sheets that are kept, when no level names one; auto is 30, and 23.6 \
             at the published level, where sheets have a flux of -0.2",
        ),
        ParamInfo::new(
            "mu",
            "auto",
            "pure number",
            "factor of the threshold -mu sin(angle); auto is 0.125 for plain and homotopy, where a \
             sheet anywhere in a voxel keeps it, 0.375 for the end points of thinning, and 0.5 at the \
             published level",
        ),
        ParamInfo::new(
            "variant",
            "auto",
            "plain, homotopy or thinning",
            "keep by threshold; delete simple voxels alone, outermost first; or thin by flux; auto is \
             thinning, and plain at the published level",
        ),
        ParamInfo::new(
            "spiral",
            "auto",
            "equal-area or classic",
            "how the samples lie on the sphere; auto is equal-area, and classic at the published level",
        ),
        ParamInfo::new(
            "start",
            "auto",
            "fine or coarse",
            "begin with the voxels whose spheres fit inside at the finest level, or at the coarsest as \
             in the paper; auto is fine, and coarse at the published level",
        ),
        ParamInfo::new(
            "dismiss",
            "auto",
            "zero or bias",
            "coarse voxels are dismissed from a flux of 0 on, as in the paper, or of minus what the \
             samples make of a constant field; auto is bias, and zero at the published level",
        ),
        ParamInfo::new(
            "refine",
            "auto",
            "true or false",
            "move centres onto the axis, between opposite closest points; auto is true, and false at \
             the published level",
        ),
        ParamInfo::new(
            "max_memory",
            fixed.max_memory,
            "megabytes",
            "limit of the memory for voxels and the medial mesh",
        ),
    ]
}
