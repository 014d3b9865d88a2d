//! The parameters of part pruning.

use medial::simplifier::{ParamInfo, SimplifyError};
use serde::{Deserialize, Serialize};

use crate::within::within;

/// Parameters of part pruning; the default is the paper's usual schedule.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TamHeidrichParams {
    /// `t_t`: the first rounds remove parts of at most this many triangles.
    pub t_t: usize,
    /// Largest number of rounds by triangle count, which do not check topology.
    pub t_t_rounds: usize,
    /// These rounds end after one that removed less than this share of what the one before it did.
    pub drop: f64,
    /// `t_v`: for each of the later rounds, parts of at most this relative volume go; per cent.
    pub t_v: List<f64>,
    /// The rounds that keep loops and components.
    pub topology: Checked,
    /// The axis to work on.
    pub axis: AxisChoice,
    /// Ids of parts to remove in the end.
    pub remove: List<u32>,
    /// Factor of the radii of the polar balls; a pure number.
    pub radius_factor: f64,
    /// How far a polar ball is moved at most along each axis, as a fraction of its radius.
    pub jitter: f64,
    /// Vertices of the axis nearer than this are one, as a fraction of the radius.
    pub merge: f64,
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

impl Default for TamHeidrichParams {
    fn default() -> Self {
        Self {
            t_t: 5,
            t_t_rounds: 3,
            drop: 0.25,
            t_v: List(vec![1.0, 1.0]),
            topology: Checked::Volume,
            axis: AxisChoice::Auto,
            remove: List::default(),
            radius_factor: 1.002,
            jitter: 1e-7,
            merge: 1e-3,
        }
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

    pub(super) fn describe() -> Vec<ParamInfo> {
        let default = Self::default();
        let t_v: Vec<String> = default.t_v.0.iter().map(f64::to_string).collect();
        vec![
            ParamInfo::new(
                "t_t",
                default.t_t,
                "triangles",
                "parts of at most so many triangles go in the first rounds, topology unchecked",
            ),
            ParamInfo::new(
                "t_t_rounds",
                default.t_t_rounds,
                "rounds",
                "most rounds by triangle count; 0 for none",
            ),
            ParamInfo::new(
                "drop",
                default.drop,
                "share",
                "these rounds end after one that removed less than this share of what the one before \
                 it did; 0 for the full number",
            ),
            ParamInfo::new(
                "t_v",
                t_v.join(","),
                "per cent of the solid's volume, one for each round",
                "then parts of at most this volume go, as far as topology allows",
            ),
            ParamInfo::new(
                "topology",
                "volume",
                "volume | all | none",
                "rounds that keep loops and components: those by volume, as published, all, or none",
            ),
            ParamInfo::new(
                "axis",
                "auto",
                "auto | union | initial",
                "the axis of the union of polar balls, or the initial medial mesh; auto takes the \
                 latter where it was given",
            ),
            ParamInfo::new(
                "remove",
                "",
                "ids of parts, separated by commas",
                "parts to remove by hand in the end, unchecked; ids are those of the list of parts \
                 of the same run without this",
            ),
            ParamInfo::new(
                "radius_factor",
                default.radius_factor,
                "pure number",
                "radii of polar balls are multiplied by this, so that balls that touch in a sample \
                 overlap",
            ),
            ParamInfo::new(
                "jitter",
                format!("{:?}", default.jitter),
                "fraction of the radius",
                "polar balls are moved by at most this along each axis, seeded",
            ),
            ParamInfo::new(
                "merge",
                default.merge,
                "fraction of the radius",
                "vertices of their axis that are nearer than this are one, as far as topology allows",
            ),
        ]
    }
}
