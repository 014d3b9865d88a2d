//! The parameters of HEM.

use medial::simplifier::ParamInfo;
use serde::{Deserialize, Serialize};

/// Parameters of HEM.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct HemParams {
    /// What a sample inside the union is charged with.
    pub inside: Inside,
}

/// What counts as the error of a sample. Outside all primitives both are its distance to the
/// nearest one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Inside {
    /// Its depth in the primitive that holds it deepest: `|sigma|`.
    #[default]
    Depth,
    /// Its distance to the nearest surface of a primitive, buried ones included: `mu`.
    Surface,
}

impl HemParams {
    pub(super) fn describe() -> Vec<ParamInfo> {
        vec![ParamInfo::new(
            "inside",
            "depth",
            "depth or surface",
            "error of a sample inside the union: its depth in the deepest primitive, or its \
             distance to the nearest surface of a primitive, be it buried",
        )]
    }
}
