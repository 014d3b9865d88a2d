//! Why there is no picture.

/// Why there is no picture.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RenderError {
    /// A side of the picture is too short or too long.
    #[error("a picture of {width} by {height} pixels: ask for 16 to {most} pixels a side")]
    Size {
        /// Width in pixels.
        width: usize,
        /// Height in pixels.
        height: usize,
        /// The longest side.
        most: usize,
    },
    /// The camera has no direction.
    #[error("the camera looks from {0}, which is no direction: give three numbers, not all zero")]
    Direction(String),
    /// The camera has no upward direction.
    #[error(
        "{0} does not point upwards for this camera: take a direction across the line of sight"
    )]
    Up(String),
    /// The zoom is out of range.
    #[error("a zoom of {0}: ask for 0.05 to 50")]
    Zoom(f64),
    /// Nothing that the camera could be set up by.
    #[error("nothing to draw: no point, or none that is finite")]
    Empty,
    /// The values of a layer are not one for each vertex.
    #[error("{values} values for {vertices} vertices")]
    Values {
        /// Number of values.
        values: usize,
        /// Number of vertices.
        vertices: usize,
    },
    /// The picture could not be encoded.
    #[error("PNG: {0}")]
    Png(String),
}
