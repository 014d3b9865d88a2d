//! One normalised input with its substrates, each built once, on demand, and timed.

use std::sync::Arc;

use crate::complex::MedialMesh;

/// One input shape, normalised to a bounding-box diagonal of 1.
pub struct Shape {
    initial: Arc<MedialMesh>,
}

impl Shape {
    /// A shape known only by its initial medial mesh, in normalised units.
    pub fn from_initial(initial: MedialMesh) -> Self {
        Self { initial: Arc::new(initial) }
    }

    /// The medial mesh that every simplifier of this shape starts from.
    ///
    /// # Errors
    /// When the triangulation of the samples fails.
    pub fn initial(&self) -> Result<Arc<MedialMesh>, ShapeError> {
        Ok(Arc::clone(&self.initial))
    }
}

/// Why a substrate could not be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ShapeError {
    /// The inside of the shape holds no Voronoi vertex.
    #[error(
        "the initial medial mesh is empty: no circumcentre lies inside the surface; sample more densely"
    )]
    EmptyMedialMesh,
}
