//! The parameters of HEM.

use medial::simplifier::ParamInfo;
use serde::{Deserialize, Serialize};

/// Parameters of HEM.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct HemParams {
    /// The error of a sample inside the union.
    pub inside: Inside,
    /// The directions that a bound covers.
    pub sides: Sides,
    /// The collapses that are blocked.
    pub blocking: Blocking,
}

/// The error of a sample inside the union. Outside, it is always the distance to the nearest
/// primitive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Inside {
    /// Its depth in the primitive that holds it deepest: `|sigma|`.
    #[default]
    Depth,
    /// Its distance to the nearest surface of a primitive, buried ones included: `mu`.
    Surface,
}

/// The directions in which the error of a whole mesh is measured. The order of the collapses always
/// uses one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Sides {
    /// From the samples to the union, as published.
    #[default]
    One,
    /// Also from the boundary of the union to the surface.
    Both,
}

/// The collapses that are blocked to protect the topology.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Blocking {
    /// Those that change the homotopy type.
    #[default]
    Homotopy,
    /// Those of edges whose ends have a common neighbour that forms no face with them, as in the
    /// authors' code.
    Neighbours,
}

impl HemParams {
    pub(super) fn describe() -> Vec<ParamInfo> {
        vec![
            ParamInfo::new(
                "inside",
                "depth",
                "depth or surface",
                "error of a sample inside the union: its depth in the deepest primitive, or its \
                 distance to the nearest surface of a primitive, be it buried",
            ),
            ParamInfo::new(
                "sides",
                "one",
                "one or both",
                "what a bound bounds: the error at the samples, or also the distance from the \
                 boundary of the union to the surface",
            ),
            ParamInfo::new(
                "blocking",
                "homotopy",
                "homotopy or neighbours",
                "collapses that are blocked: those that change the homotopy type, or as in the \
                 authors' code those of edges whose ends have a common neighbour without a face",
            ),
        ]
    }
}
