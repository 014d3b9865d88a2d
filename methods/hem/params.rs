//! The parameters of HEM.

use serde::{Deserialize, Serialize};

medial::parameters! {
    /// Parameters of HEM.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct HemParams {
        /// Error of a sample inside the union: its depth in the deepest primitive, or its distance to
        /// the nearest surface of a primitive, buried ones included.
        inside: Inside = Inside::Depth, "depth or surface";
        /// The error that a bound covers: that at the samples, or also the distance from the boundary
        /// of the union to the surface.
        sides: Sides = Sides::One, "one or both";
        /// Blocked collapses: those that change the homotopy type, or as in the authors' code those of
        /// edges whose ends have a common neighbour without a face.
        blocking: Blocking = Blocking::Homotopy, "homotopy or neighbours";
    }
}

/// The error of a sample inside the union. Outside, it is always the distance to the nearest
/// primitive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Inside {
    /// Its depth in the primitive that holds it deepest: `|sigma|`.
    Depth,
    /// Its distance to the nearest surface of a primitive, buried ones included: `mu`.
    Surface,
}

/// The directions in which the error of a whole mesh is measured. The order of the collapses always
/// uses one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Sides {
    /// From the samples to the union, as published.
    One,
    /// Also from the boundary of the union to the surface.
    Both,
}

/// The collapses that are blocked to protect the topology.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Blocking {
    /// Those that change the homotopy type.
    Homotopy,
    /// Those of edges whose ends have a common neighbour that forms no face with them, as in the
    /// authors' code.
    Neighbours,
}
