//! Findings about a surface as data: faults that name the file and the offending element, repairs, figures.

use std::fmt;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::wrap::WrapError;
use crate::Vec3;

/// A surface that could not be read or may not be used, and why.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{}{fault}", file.as_ref().map_or(String::new(), |file| format!("{}: ", file.display())))]
pub struct SurfaceError {
    /// The file, where there is one.
    pub file: Option<PathBuf>,
    /// The defect.
    pub fault: Fault,
}

impl From<Fault> for SurfaceError {
    fn from(fault: Fault) -> Self {
        Self { file: None, fault }
    }
}

/// A number with its noun, such as `1 vertex` or `3 faces`.
pub(super) fn counted(number: usize, noun: &str) -> String {
    match (number, noun) {
        (1, _) => format!("1 {noun}"),
        (_, "vertex") => format!("{number} vertices"),
        _ => format!("{number} {noun}s"),
    }
}

/// A remark on coordinates in single precision with a spacing.
pub(super) fn lost_digits(spacing: f64, diagonal: f64) -> String {
    let percent = 100.0 * spacing / diagonal;
    format!(
        "the coordinates are numbers in single precision, which lie {spacing} apart so far from the origin \
         ({percent:.1e} % of the diagonal), so that digits are lost; move the surface to the origin before it is written"
    )
}

/// Where in a file something is wrong.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// Line of a text file, counted from 1.
    Line(usize),
    /// Element of a binary file, counted from 0, such as `vertex 17`.
    Element(&'static str, usize),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Element(kind, index) => write!(f, "{kind} {index}"),
        }
    }
}

/// A place in front of a sentence that names the element itself.
fn before(at: &Place) -> String {
    match at {
        // In a binary file the place is the element: it would be in the message twice.
        Place::Element(..) => String::new(),
        place => format!("{place}: "),
    }
}

/// The number of vertices as a clause.
fn existing(vertices: usize) -> String {
    let verb = if vertices == 1 { "is" } else { "are" };
    format!("there {verb} {}", counted(vertices, "vertex"))
}

/// A vertex as the user can find it: by number and by position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VertexName {
    /// Index in the order of the file (or of the mesh that was validated), counted from 0.
    pub index: usize,
    /// Position in the unit of the file.
    pub position: Vec3,
}

impl fmt::Display for VertexName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Vec3 { x, y, z } = self.position;
        write!(f, "vertex {} ({x:?}, {y:?}, {z:?})", self.index)
    }
}

/// A defect of a surface. Elements are counted from 0, lines from 1.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the messages name the fields")]
pub enum Fault {
    /// The file could not be opened, read or written.
    #[error("{0}")]
    Io(String),
    /// The extension names no format that is known here.
    #[error("unknown extension {extension:?}; use .off, .obj, .ply or .stl")]
    UnknownFormat { extension: String },
    /// The format is known, but not this variant or not in this direction.
    #[error("{0}")]
    Unsupported(String),
    /// Something else is in a place where the format demands a certain thing.
    #[error("{at}: expected {expected}, found {found}")]
    Syntax { at: Place, expected: String, found: String },
    /// The file ends too early.
    #[error("the file ends before {expected}")]
    Ends { expected: String },
    /// The header announces more than the file holds, or less.
    #[error("the header announces {announced} {what}, but the file holds {holds}")]
    Count { what: &'static str, announced: u64, holds: String },
    /// A coordinate is not a number or infinite.
    #[error("{}vertex {vertex} has the coordinate {value}, which is not finite", before(.at))]
    Coordinate { at: Place, vertex: usize, value: f64 },
    /// A face names a vertex that does not exist.
    #[error("{}face {face} refers to vertex {index}, but {}", before(.at), existing(*.vertices))]
    Index { at: Place, face: usize, index: i64, vertices: usize },
    /// A face with fewer than three corners.
    #[error("{}face {face} has {}; at least 3 are needed", before(.at), counted(*.corners, "corner"))]
    TooFewCorners { at: Place, face: usize, corners: usize },
    /// A polygon so intricate that cutting it into triangles takes too long.
    #[error(
        "{}face {face} with {corners} corners is too intricate to triangulate; \
         export the surface as triangles",
        before(.at)
    )]
    Polygon { at: Place, face: usize, corners: usize },
    /// More elements than 32-bit indices can name.
    #[error("{count} {what} are more than 32-bit indices can name")]
    TooLarge { what: &'static str, count: u64 },
    /// Points without a surface.
    #[error("{}", match *.vertices {
        0 => "no vertex and no face found; check that the content is what the extension says".to_owned(),
        some => format!(
            "no face among {}; wrap the points (`medial repair FILE --wrap -o OUT`)",
            counted(some, "vertex")
        ),
    })]
    NoFaces { vertices: usize },
    /// Every face has corners at the same position.
    #[error(
        "no face is left of {}: each has corners at the same position; if that is unexpected, the \
         surface is too small for its distance from the origin: move it there before writing it",
        counted(*.faces, "face")
    )]
    Collapsed { faces: usize },
    /// The bounding box has no size, or one that overflows or has lost digits to underflow.
    #[error(
        "the bounding box has the diagonal {diagonal:?}; move and scale the surface to about 1"
    )]
    Extent { diagonal: f64 },
    /// Edges with one face only.
    #[error(
        "the surface is open: {} with one face only, the first from {} to {}; fill its holes \
         (`medial repair FILE --fill-holes -o OUT`) or wrap it (`medial repair FILE --wrap -o OUT`)",
        counted(*.edges, "edge"), .first[0], .first[1]
    )]
    Open { edges: usize, first: [VertexName; 2] },
    /// A hole that is too long to be filled.
    #[error(
        "the hole at {first} has {edges} edges, too many to fill (at most {most}); wrap the surface \
         (`medial repair FILE --wrap -o OUT`)"
    )]
    LongHole { edges: usize, most: usize, first: VertexName },
    /// A hole whose edges are no loop.
    #[error(
        "the edges of a hole branch at {at}; wrap the surface (`medial repair FILE --wrap -o OUT`)"
    )]
    BranchingHole { at: VertexName },
    /// A hole whose triangles would have an edge with two faces.
    #[error(
        "the hole at {first} cannot be filled: an edge would have three faces; wrap the surface \
         (`medial repair FILE --wrap -o OUT`)"
    )]
    BlockedHole { first: VertexName },
    /// Edges with more than two faces.
    #[error(
        "the surface is not manifold: {} with more than two faces, the first ({faces} faces) \
         from {} to {}; wrap it (`medial repair FILE --wrap -o OUT`), or remove inner walls in a mesh editor",
        counted(*.edges, "edge"), .first[0], .first[1]
    )]
    NonManifoldEdge { edges: usize, first: [VertexName; 2], faces: usize },
    /// Vertices whose faces form more than one fan.
    #[error(
        "the surface is not manifold: {} where parts touch in a point, the first is {first}; \
         wrap them (`medial repair FILE --wrap -o OUT`)",
        counted(*.vertices, "vertex")
    )]
    NonManifoldVertex { vertices: usize, first: VertexName },
    /// One-sided, such as a Klein bottle.
    #[error(
        "the component of face {face} is one-sided; wrap it (`medial repair FILE --wrap -o OUT`)"
    )]
    NonOrientable { face: usize },
    /// A component whose two sides coincide.
    #[error(
        "the component of face {face} ({}) encloses no volume; \
         give it thickness, or wrap it (`medial repair FILE --wrap -o OUT`)",
        counted(*.faces, "face")
    )]
    ZeroVolume { face: usize, faces: usize },
    /// Another fault, of a surface far from the origin in single precision.
    #[error("{fault}; {}", lost_digits(*.spacing, *.diagonal))]
    LostDigits { spacing: f64, diagonal: f64, fault: Box<Fault> },
    /// Only from [`crate::surface::Inspection::as_is`]: faces that cross.
    #[error("{}; without `--as-is` the solid that they mean is used", match pairs { 1 => "1 pair of faces crosses".to_owned(), _ => format!("{pairs} pairs of faces cross") })]
    Crossing { pairs: usize },
    /// Too many components around one another to separate solid from cavity in time.
    #[error("{components} components lie too densely around one another to find their nesting")]
    TooManyNested { components: usize },
    /// Only from [`crate::surface::inspect_wrapped`]: there is no wrap.
    #[error(transparent)]
    Wrap(#[from] WrapError),
    /// Only from [`crate::surface::inspect_wrapped`]: rounding makes faces of the wrap cross.
    #[error("faces of the wrap cross; use a larger alpha")]
    WrapCrosses,
    /// Only from [`crate::surface::inspect_wrapped`]: rounding leaves a part of the input outside.
    #[error("triangle {triangle} is not inside of the wrap; use a larger offset")]
    WrapMisses { triangle: usize },
    /// Only from [`crate::surface::validate`]: a face that names a vertex twice.
    #[error("face {face} names a vertex twice")]
    RepeatedCorner { face: usize },
    /// Only from [`crate::surface::validate`]: two faces with the same vertices.
    #[error("faces {first} and {second} have the same three vertices")]
    DuplicateFace { first: usize, second: usize },
    /// Only from [`crate::surface::validate`]: a vertex without a face.
    #[error("vertex {vertex} belongs to no face")]
    Unreferenced { vertex: usize },
    /// Only from [`crate::surface::validate`]: neighbours that disagree about inside and outside.
    #[error("face {face} and a neighbour of it are oriented against each other")]
    Inconsistent { face: usize },
    /// Only from [`crate::surface::validate`]: an outer shell that points inward, or a cavity
    /// that points outward.
    #[error("the component of face {face} is oriented the wrong way")]
    WrongWay { face: usize },
}

/// The properties of a surface: the output of `medial info`.
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
    /// Sides of the bounding box along x, y and z, in the unit of the file.
    pub extents: [f64; 3],
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
    /// The changes, in order.
    pub repairs: Vec<Repair>,
    /// Unchanged defects that may spoil results.
    pub warnings: Vec<String>,
}

/// One kind of change to the surface in a file, with the numbers of elements concerned.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "repair", rename_all = "snake_case")]
#[expect(missing_docs, reason = "the messages name the fields")]
pub enum Repair {
    /// Coordinates below 2^-150 of the largest were set to zero.
    FlushedCoordinates { coordinates: usize },
    /// Vertices at exactly the same position were merged.
    WeldedVertices { vertices: usize },
    /// Faces left with fewer than three distinct corners were dropped.
    DroppedDegenerateFaces { faces: usize },
    /// Faces with the same corners as an earlier one were dropped.
    DroppedDuplicateFaces { faces: usize },
    /// Polygons were cut into triangles.
    TriangulatedPolygons { polygons: usize, triangles: usize },
    /// Vertices that belong to no face were dropped.
    DroppedUnreferencedVertices { vertices: usize },
    /// Faces that disagreed with their neighbours were turned over.
    ReorientedFaces { faces: usize },
    /// Parts were left out: those without volume, or on demand.
    DroppedComponents { components: usize, faces: usize },
    /// Parts that touched in a vertex or along an edge were drawn back from it.
    SeparatedVertices {
        vertices: usize,
        /// The longest way that one was moved, in the unit of the file.
        largest_move: f64,
    },
    /// Vertices within a distance were merged, which closed the surface or parted vertices too near to each other.
    WeldedWithin { vertices: usize, distance: f64 },
    /// Plane walls between touching bodies were left out; their two sides were apart by at most a distance in the unit of the file.
    DroppedWalls { faces: usize, distance: f64 },
    /// Vertices of bodies that stand on each other were moved into the other body, by at most a distance in the unit of the file.
    PushedVertices { vertices: usize, distance: f64 },
    /// Faces that crossed, overlapped or touched were replaced by the boundary of the region with a winding number of at least 1.
    ResolvedFaces { faces: usize, by: usize },
    /// Short edges of the new faces were contracted; no vertex was moved by more than a distance in the unit of the file.
    ContractedEdges { edges: usize, distance: f64 },
    /// A hole was closed by triangles between its vertices, on demand.
    FilledHole { edges: usize, triangles: usize },
    /// The surface was replaced by one around it, on demand.
    Wrapped {
        /// Number of triangles in the wrap. Points count apart.
        triangles: usize,
        /// Number of points of a file without faces.
        points: usize,
        /// Radius of the carving ball, in the unit of the file.
        alpha: f64,
        /// Distance of the wrap's vertices from the input, in the unit of the file.
        offset: f64,
        /// Bound on the distance of the wrap from the input, at most 1 % above the largest one, in the unit of the file.
        farthest: f64,
    },
    /// Outer shells that pointed inward as a whole were turned over.
    TurnedOutward { components: usize },
    /// Shells of cavities that pointed outward were turned over.
    TurnedInward { components: usize },
}

impl Repair {
    /// How many elements were changed.
    pub fn count(&self) -> usize {
        self.changed().0
    }

    /// Whether the surface is another set of points afterwards, if only slightly, or bounds another solid.
    pub fn changes_solid(&self) -> bool {
        matches!(
            self,
            Self::WeldedWithin { .. }
                | Self::DroppedWalls { .. }
                | Self::ResolvedFaces { .. }
                | Self::ContractedEdges { .. }
                | Self::SeparatedVertices { .. }
                | Self::PushedVertices { .. }
                | Self::FilledHole { .. }
                | Self::Wrapped { .. }
                | Self::DroppedComponents { .. }
                | Self::TurnedInward { .. }
        )
    }

    /// The number of changed elements, and the noun for one of them.
    fn changed(&self) -> (usize, &'static str) {
        match *self {
            Self::FlushedCoordinates { coordinates } => (coordinates, "coordinate"),
            Self::WeldedVertices { vertices }
            | Self::WeldedWithin { vertices, .. }
            | Self::SeparatedVertices { vertices, .. }
            | Self::PushedVertices { vertices, .. }
            | Self::DroppedUnreferencedVertices { vertices } => (vertices, "vertex"),
            Self::DroppedDegenerateFaces { faces }
            | Self::DroppedWalls { faces, .. }
            | Self::ResolvedFaces { faces, .. }
            | Self::DroppedDuplicateFaces { faces }
            | Self::ReorientedFaces { faces } => (faces, "face"),
            Self::TriangulatedPolygons { polygons, .. } => (polygons, "polygon"),
            Self::ContractedEdges { edges, .. } => (edges, "edge"),
            Self::TurnedOutward { components }
            | Self::TurnedInward { components }
            | Self::DroppedComponents { components, .. } => (components, "component"),
            Self::Wrapped { triangles: 0, points, .. } => (points, "point"),
            Self::FilledHole { triangles, .. } | Self::Wrapped { triangles, .. } => {
                (triangles, "triangle")
            }
        }
    }
}

impl fmt::Display for Repair {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // One table of counts and nouns for both, so that a message cannot disagree with `count`.
        let (count, noun) = self.changed();
        let what = counted(count, noun);
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
            Self::WeldedWithin { distance, .. } => {
                write!(f, "merged {what} within {distance:.1e} of another")
            }
            Self::PushedVertices { distance, .. } => {
                write!(
                    f,
                    "pushed touching bodies into each other at {what}, by {distance:.1e} at most"
                )
            }
            Self::DroppedWalls { distance, .. } => {
                write!(f, "left out {what} of walls between touching bodies")?;
                if distance > 0.0 {
                    write!(f, ", {distance:.1e} apart at most")?;
                }
                Ok(())
            }
            Self::ResolvedFaces { by, .. } => {
                let new = counted(by, "face");
                write!(f, "replaced {what} that cross, overlap or touch by {new} around the solid")
            }
            Self::ContractedEdges { distance, .. } => {
                write!(f, "contracted {what} of the new faces, by {distance:.1e} at most")
            }
            Self::FilledHole { edges, .. } => {
                write!(f, "filled a hole of {} with {what}", counted(edges, "edge"))
            }
            Self::Wrapped { alpha, offset, farthest, .. } => write!(
                f,
                "wrapped {what} with alpha {alpha:.3e} and offset {offset:.3e}; the wrap contains the input and is at \
                 most {farthest:.3e} away from it"
            ),
            Self::TurnedOutward { .. } => write!(f, "turned {what} outward"),
            Self::TurnedInward { .. } => {
                write!(f, "turned {what} inward, as a wall of a cavity in a solid")
            }
        }
    }
}
