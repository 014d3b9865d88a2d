//! Why a substrate could not be built.

use crate::complex::{CellSpheres, ComplexError};
use crate::geometry::TriangulationError;
use crate::surface::BvhError;

/// Why a substrate could not be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ShapeError {
    /// The bounding box is empty, flat to a point, or not finite.
    #[error("the surface has no extent: its bounding-box diagonal is zero or not finite")]
    Extent,
    /// The samples cannot be triangulated.
    #[error("triangulating the boundary samples: {0}")]
    Triangulation(#[from] TriangulationError),
    /// The surface has no bounding-volume tree.
    #[error("the surface: {0}")]
    Tree(#[from] BvhError),
    /// The medial mesh to start from has no sphere.
    #[error("the initial medial mesh has no sphere")]
    EmptyInitial,
    /// The medial mesh to start from is not valid in units of the surface's diagonal.
    #[error("the initial medial mesh, divided by the diagonal of the surface: {0}")]
    Initial(ComplexError),
    /// The inside of the shape holds no Voronoi vertex.
    #[error(
        "the initial medial mesh is empty: no circumcentre of the samples lies inside the surface; \
         sample more densely, for example --sampling blue:20000"
    )]
    EmptyMedialMesh,
    /// The inside of the shape holds Voronoi vertices, but all too close to the surface.
    #[error(
        "the initial medial mesh is empty: the circumcentres inside the surface ({centres}) are \
         all within a billionth of its diagonal of it; what is so thin or small beside the whole \
         cannot be resolved: put parts that are far apart into files of their own"
    )]
    BelowResolution {
        /// Number of these circumcentres.
        centres: usize,
    },
}

impl ShapeError {
    pub(super) fn of_nothing_inside(cells: &CellSpheres) -> Self {
        match cells.in_guard_band {
            0 => Self::EmptyMedialMesh,
            centres => Self::BelowResolution { centres },
        }
    }
}
