//! The level of a run: one of the method's own, or an error bound that a search meets.

use std::fmt;

use medial::simplifier::Level;
use serde::{Deserialize, Serialize};

/// The target of a run: a level of the method, or an error bound that the runner meets by a search
/// among such levels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Target {
    /// [`Level::Published`].
    #[default]
    Published,
    /// [`Level::Spheres`].
    Spheres(usize),
    /// [`Level::Native`].
    Native(f64),
    /// The fewest spheres that the search finds with a symmetric Hausdorff error of at most this
    /// fraction of the diagonal.
    MaxError(f64),
}

impl From<Level> for Target {
    fn from(level: Level) -> Self {
        match level {
            Level::Published => Self::Published,
            Level::Spheres(count) => Self::Spheres(count),
            Level::Native(value) => Self::Native(value),
        }
    }
}

impl Target {
    /// Whether it is a native level, the published one included.
    pub fn is_native(self) -> bool {
        matches!(self, Self::Published | Self::Native(_))
    }

    /// The level of the method, or the error bound.
    pub fn level(self) -> Result<Level, f64> {
        match self {
            Self::Published => Ok(Level::Published),
            Self::Spheres(count) => Ok(Level::Spheres(count)),
            Self::Native(value) => Ok(Level::Native(value)),
            Self::MaxError(bound) => Err(bound),
        }
    }
}

impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.level() {
            Ok(level) => level.fmt(f),
            // Rounded, without the digits that the multiplication adds.
            Err(bound) => write!(f, "at most {} % error", (bound * 1e12).round() / 1e10),
        }
    }
}
