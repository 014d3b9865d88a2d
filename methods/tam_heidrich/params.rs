//! The parameters of part pruning.

use medial::simplifier::SimplifyError;
use serde::{Deserialize, Serialize};

use crate::within::within;

medial::parameters! {
    /// Parameters of part pruning; the default is the paper's usual schedule.
    #[derive(Clone, Debug, PartialEq)]
    pub struct TamHeidrichParams {
        /// The first rounds remove parts of at most this many triangles, without a test of the
        /// topology.
        t_t: usize = 5, "triangles";
        /// Largest number of rounds by triangle count; 0 for none.
        t_t_rounds: usize = 3, "rounds";
        /// These rounds end after one that removed less than this share of the previous one; 0 for the
        /// full number.
        drop: f64 = 0.25, "share";
        /// The later rounds remove parts of at most this volume, as far as the topology allows.
        t_v: List<f64> = List(vec![1.0, 1.0]), "per cent of the solid's volume, one for each round";
        /// The rounds that keep loops and components: those by volume, as published, all, or none.
        topology: Checked = Checked::Volume, "volume, all or none";
        /// The axis: that of the union of polar balls, or the initial medial mesh. `auto` takes the
        /// latter where it was given.
        axis: AxisChoice = AxisChoice::Auto, "auto, union or initial";
        /// Parts to remove in the end, unchecked; ids are those of the list of parts of the same run
        /// without this.
        remove: List<u32> = List::default(), "ids of parts, separated by commas";
        /// Factor of the radii of polar balls, so that balls that touch in a sample overlap.
        radius_factor: f64 = 1.002, "pure number";
        /// Largest seeded displacement of a polar ball along each axis.
        jitter: f64 = 1e-7, "fraction of the radius";
        /// Vertices of the axis nearer than this are merged, as far as the topology allows.
        merge: f64 = 1e-3, "fraction of the radius";
    }
}

/// The rounds that keep loops and components.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Checked {
    /// Those by volume, as published.
    Volume,
    /// All.
    All,
    /// None.
    None,
}

/// The axis to work on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum AxisChoice {
    /// The given medial mesh where the shape has one, else that of the polar balls.
    Auto,
    /// The medial axis of the union of the polar balls, or of the spheres of the given mesh.
    Union,
    /// The initial medial mesh, given or Voronoi.
    Initial,
}

/// Numbers, written as one number, as `1,5`, or as a JSON array.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Written<T>", into = "Vec<T>")]
#[serde(bound(
    serialize = "T: Clone + Serialize",
    deserialize = "T: Deserialize<'de> + std::str::FromStr, T::Err: std::fmt::Display"
))]
pub struct List<T>(pub Vec<T>);

#[derive(Deserialize)]
#[serde(untagged, expecting = "expected a number, numbers separated by commas, or an array")]
enum Written<T> {
    One(T),
    Many(Vec<T>),
    Text(String),
}

impl<T> TryFrom<Written<T>> for List<T>
where
    T: std::str::FromStr,
    T::Err: std::fmt::Display,
{
    type Error = String;

    fn try_from(written: Written<T>) -> Result<Self, String> {
        let parse = |word: &str| word.trim().parse().map_err(|error| format!("`{word}`: {error}"));
        Ok(Self(match written {
            Written::One(number) => vec![number],
            Written::Many(numbers) => numbers,
            Written::Text(text) if text.trim().is_empty() => vec![],
            Written::Text(text) => text.split(',').map(parse).collect::<Result<_, String>>()?,
        }))
    }
}

impl<T> From<List<T>> for Vec<T> {
    fn from(list: List<T>) -> Self {
        list.0
    }
}

impl TamHeidrichParams {
    pub(super) fn validate(self) -> Result<Self, SimplifyError> {
        let ranges = [
            ("drop", self.drop, 0.0..=1.0),
            ("radius_factor", self.radius_factor, 0.5..=2.0),
            ("jitter", self.jitter, 0.0..=0.1),
            ("merge", self.merge, 0.0..=0.1),
        ];
        let t_v = self.t_v.0.iter().map(|&t| ("t_v", t, 0.0..=100.0));
        for (name, value, range) in ranges.into_iter().chain(t_v) {
            within(name, value, range)?;
        }
        Ok(self)
    }
}
