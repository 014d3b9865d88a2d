//! Findings and repairs as data.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::error::counted;

/// The properties of a surface: the answer of `medial info`.
///
/// Numbers describe the mesh after the listed repairs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SurfaceReport {
    /// Number of vertices.
    pub vertices: usize,
    /// Number of triangles.
    pub faces: usize,
    /// Number of pieces that are connected through edges.
    pub components: usize,
    /// Sum of the genus over all components; unknown unless closed, manifold and orientable.
    pub genus: Option<usize>,
    /// Whether every edge has at least two faces.
    pub closed: bool,
    /// Whether no edge has more than two faces and every vertex has a single fan of faces.
    pub manifold: bool,
    /// Whether all faces are consistently oriented; outward where the surface is closed.
    pub oriented: bool,
    /// Whether any two faces meet elsewhere than in their common vertices and edges.
    pub self_intersecting: bool,
    /// Number of such pairs of faces. Faces of zero area take no part.
    pub intersecting_pairs: usize,
    /// Whether counting the pairs came to its end, or was given up after millions.
    pub intersecting_pairs_complete: bool,
    /// Number of faces with three distinct but exactly collinear corners.
    pub degenerate_faces: usize,
    /// Diagonal of the bounding box, in the unit of the file.
    pub diagonal: f64,
    /// Number of edges with one face.
    pub boundary_edges: usize,
    /// Number of edges with more than two faces.
    pub nonmanifold_edges: usize,
    /// Number of vertices with more than one fan of faces.
    pub nonmanifold_vertices: usize,
    /// Euler number of the surface, V - E + F.
    pub euler: i64,
    /// Betti numbers of the solid, and so of its medial axis: its components, the total genus of
    /// its boundary, its cavities. Counts each shell as if it met no other. Unknown unless closed,
    /// manifold and orientable.
    pub expected_betti: Option<[usize; 3]>,
    /// Area in the squared unit of the file; unknown where it overflows or underflows.
    pub area: Option<f64>,
    /// Enclosed volume in the cubed unit of the file, overlaps counted as often as they occur;
    /// unknown for an open surface and where it overflows or underflows.
    pub volume: Option<f64>,
    /// What was changed, in the order in which it was done.
    pub repairs: Vec<Repair>,
    /// What was not changed, but may spoil results.
    pub warnings: Vec<String>,
}

/// One kind of change made to what the file holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "repair", rename_all = "snake_case")]
pub enum Repair {
    /// Coordinates below 2^-150 of the largest were set to zero.
    FlushedCoordinates {
        /// How many.
        coordinates: usize,
    },
    /// Vertices at exactly the same position were merged.
    WeldedVertices {
        /// How many vertices disappeared.
        vertices: usize,
    },
    /// Faces left with fewer than three distinct corners were dropped.
    DroppedDegenerateFaces {
        /// How many.
        faces: usize,
    },
    /// Faces with the same corners as an earlier one were dropped.
    DroppedDuplicateFaces {
        /// How many.
        faces: usize,
    },
    /// Polygons were cut into triangles.
    TriangulatedPolygons {
        /// How many polygons with more than three corners.
        polygons: usize,
        /// Into how many triangles.
        triangles: usize,
    },
    /// Vertices that belong to no face were dropped.
    DroppedUnreferencedVertices {
        /// How many.
        vertices: usize,
    },
    /// Faces that disagreed with their neighbours were turned over.
    ReorientedFaces {
        /// How many.
        faces: usize,
    },
    /// Parts beside the largest were left out, on demand.
    DroppedComponents {
        /// How many.
        components: usize,
        /// Their faces.
        faces: usize,
    },
    /// Parts that touched in a vertex were drawn back from it, on demand.
    SeparatedVertices {
        /// How many vertices were touched by several parts.
        vertices: usize,
        /// The longest way that one was moved, in the unit of the file.
        largest_move: f64,
    },
    /// A hole was closed by triangles between its vertices, on demand.
    FilledHole {
        /// Edges around the hole.
        edges: usize,
        /// Triangles that were added.
        triangles: usize,
    },
    /// Outer shells that pointed inward as a whole were turned over.
    TurnedOutward {
        /// How many components.
        components: usize,
    },
    /// Shells of cavities that pointed outward were turned over.
    TurnedInward {
        /// How many components.
        components: usize,
    },
}

impl Repair {
    /// How many elements were changed.
    pub fn count(&self) -> usize {
        match *self {
            Self::FlushedCoordinates { coordinates: n }
            | Self::WeldedVertices { vertices: n }
            | Self::DroppedDegenerateFaces { faces: n }
            | Self::DroppedDuplicateFaces { faces: n }
            | Self::TriangulatedPolygons { polygons: n, .. }
            | Self::DroppedUnreferencedVertices { vertices: n }
            | Self::SeparatedVertices { vertices: n, .. }
            | Self::ReorientedFaces { faces: n }
            | Self::TurnedOutward { components: n }
            | Self::TurnedInward { components: n }
            | Self::DroppedComponents { components: n, .. }
            | Self::FilledHole { triangles: n, .. } => n,
        }
    }
}

impl fmt::Display for Repair {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let noun = match self {
            Self::FlushedCoordinates { .. } => "coordinate",
            Self::WeldedVertices { .. }
            | Self::SeparatedVertices { .. }
            | Self::DroppedUnreferencedVertices { .. } => "vertex",
            Self::TriangulatedPolygons { .. } => "polygon",
            Self::TurnedOutward { .. }
            | Self::TurnedInward { .. }
            | Self::DroppedComponents { .. } => "component",
            Self::FilledHole { .. } => "triangle",
            _ => "face",
        };
        let what = counted(self.count(), noun);
        match *self {
            Self::FlushedCoordinates { .. } => {
                write!(f, "set {what} below 2^-150 of the largest to zero")
            }
            Self::WeldedVertices { .. } => {
                write!(f, "merged {what} with another at exactly the same position")
            }
            Self::DroppedDegenerateFaces { .. } => {
                write!(f, "dropped {what} with fewer than three distinct corners")
            }
            Self::DroppedDuplicateFaces { .. } => {
                write!(f, "dropped {what} with the corners of an earlier one")
            }
            Self::TriangulatedPolygons { triangles, .. } => {
                write!(f, "cut {what} into {}", counted(triangles, "triangle"))
            }
            Self::DroppedUnreferencedVertices { .. } => {
                write!(f, "dropped {what} without a face")
            }
            Self::ReorientedFaces { .. } => {
                write!(f, "turned over {what} against the orientation of the neighbours")
            }
            Self::DroppedComponents { faces, .. } => {
                write!(f, "left out {what} with {}", counted(faces, "face"))
            }
            Self::SeparatedVertices { largest_move, .. } => {
                write!(f, "separated parts at {what}, by {largest_move:.3e} at most")
            }
            Self::FilledHole { edges, .. } => {
                write!(f, "filled a hole of {} with {what}", counted(edges, "edge"))
            }
            Self::TurnedOutward { .. } => write!(f, "turned {what} outward"),
            Self::TurnedInward { .. } => {
                write!(f, "turned {what} inward that lies in a solid, as the wall of a cavity")
            }
        }
    }
}
