//! Facets: the triangles that everything drawn is made of, and what they look like.

use medial::Vec3;

use super::colour::{ColourMap, Light, table};

/// A triangle with what varies along it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facet {
    pub(super) corners: [Vec3; 3],
    /// Unit normals at the corners.
    pub(super) normals: [Vec3; 3],
    /// Places in the colour map, 0 to 1; of glass, how much a corner faces the eye.
    pub(super) places: [f32; 3],
    /// Width of the line along the sides, side `k` from corner `k` to `k + 1`, in line widths.
    pub(super) lines: [u8; 3],
}

/// The colour of a batch.
#[derive(Clone, Debug)]
pub(super) enum Paint {
    Plain(Light),
    /// A colour map as a table, by place.
    Map(Vec<Light>),
}

impl Paint {
    pub(super) fn map(map: ColourMap) -> Self {
        Self::Map(table(map))
    }

    pub(super) fn at(&self, place: f32) -> Light {
        match self {
            Self::Plain(light) => *light,
            Self::Map(table) => {
                let last = (table.len() - 1) as f32;
                table[(place.clamp(0.0, 1.0) * last + 0.5) as usize]
            }
        }
    }
}

/// Lines along the sides of facets.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lines {
    /// Half the width of a line of width 1, in pixels; the facets on both sides draw a half each.
    pub(super) half_width: f32,
    /// Share of ink, 0 to 1.
    pub(super) opacity: f32,
}

/// Facets that look alike.
#[derive(Clone, Debug)]
pub(super) struct Batch {
    pub(super) facets: Vec<Facet>,
    pub(super) paint: Paint,
    pub(super) lines: Option<Lines>,
    pub(super) kind: Kind,
}

/// How a batch hides what is behind it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Wholly.
    Solid,
    /// Hardly.
    Glass,
    /// As glass, and seen only where nothing solid is, before or behind.
    Ghost,
}
