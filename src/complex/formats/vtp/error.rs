//! Why a VTK PolyData file could not be read.

/// A defect of a VTK PolyData file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum VtpError {
    /// The text is not XML.
    #[error("byte {at}: not XML: {why}")]
    Xml {
        /// Place in the file.
        at: u64,
        /// What is wrong with it.
        why: String,
    },
    /// Another file of VTK's, or of somebody else's.
    #[error(
        "the file is not VTK PolyData but {0:?}; ParaView saves what it shows as PolyData (.vtp)"
    )]
    Kind(String),
    /// An element is not there.
    #[error("there is no element {0}")]
    Missing(&'static str),
    /// An attribute is missing or not understood.
    #[error("{element}: the attribute {attribute} is {found}, expected {expected}")]
    Attribute {
        /// The element.
        element: String,
        /// Its attribute.
        attribute: &'static str,
        /// What stands there.
        found: String,
        /// What should.
        expected: &'static str,
    },
    /// An array cannot be decoded.
    #[error("the array {array}: {why}")]
    Array {
        /// Its element and name, such as `Polys/connectivity`.
        array: String,
        /// What is wrong with it.
        why: String,
    },
    /// An array of another length than the numbers of points and cells say.
    #[error("the array {array} should have {expected} bytes, it has {found}")]
    Length {
        /// Its element and name.
        array: String,
        /// By the numbers of points and cells.
        expected: u64,
        /// By its own.
        found: u64,
    },
    /// A compression other than that of zlib.
    #[error("arrays compressed by {0} are not read; save with zlib compression or none")]
    Compressor(String),
    /// The points have no radii.
    #[error("its points have no array `radius` (nor `r`): not a medial mesh")]
    NoRadius,
    /// A polygon with another number of corners.
    #[error(
        "polygon {cell} has {corners} corners; a medial mesh has triangles (ParaView's filter Triangulate makes some)"
    )]
    Corners {
        /// Index of the polygon.
        cell: usize,
        /// Number of its corners.
        corners: u64,
    },
    /// Ends of cells that do not ascend.
    #[error("{element}/offsets: cell {cell} ends at {end}, before it begins")]
    Offsets {
        /// The list of cells.
        element: &'static str,
        /// Index of the cell.
        cell: usize,
        /// Its end.
        end: u64,
    },
    /// A cell names a point that does not exist.
    #[error("{element}/connectivity names the point {point} of {points}")]
    Point {
        /// The list of cells.
        element: &'static str,
        /// The number it names.
        point: u64,
        /// Number of points.
        points: u64,
    },
    /// More points than 32-bit indices can name.
    #[error("{0} points are more than 32-bit indices can name")]
    TooLarge(u64),
    /// Compressed data that need far more memory than the file.
    #[error(
        "the arrays would need {bytes} bytes, more than the {most} that a compressed file of this size may have"
    )]
    Inflated {
        /// As many as the file announces, up to where it was refused.
        bytes: u64,
        /// As many as are read.
        most: u64,
    },
}
