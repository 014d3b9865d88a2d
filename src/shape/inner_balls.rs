//! The balls that methods on unions of balls start from.

use std::sync::Arc;

use crate::Vec3;
use crate::complex::{CellSpheres, Contacts, MedialMesh};
use crate::geometry::{Delaunay, Poles, Sphere};

/// Balls whose union stands for a shape.
///
/// N. Amenta, S. Choi, R. K. Kolluri: *The power crust, unions of balls, and the medial axis
/// transform*, Computational Geometry 19 (2001), <https://doi.org/10.1016/S0925-7721(01)00017-7>.
/// Their labelling of poles by propagation is not needed where there is a surface: a pole is inner
/// if it is inside.
#[derive(Clone, Debug, PartialEq)]
pub struct InnerBalls {
    /// The balls.
    pub spheres: Vec<Sphere>,
    /// The samples that each passes through, where these are known.
    pub contacts: Option<Contacts>,
}

impl InnerBalls {
    /// The polar balls of samples that are centred inside, by cell.
    pub(super) fn of_poles(
        delaunay: &Delaunay,
        cells: &CellSpheres,
        samples: &Arc<[Vec3]>,
    ) -> Self {
        let balls = Poles::new(delaunay).inner_balls(|cell| cells.is_inside(cell));
        let contacts = Contacts {
            samples: Arc::clone(samples),
            of_sphere: balls.iter().map(|b| b.samples).collect(),
        };
        Self { spheres: balls.iter().map(|b| b.sphere).collect(), contacts: Some(contacts) }
    }

    /// The spheres of a medial mesh.
    pub(super) fn of_mesh(mesh: &MedialMesh) -> Self {
        Self { spheres: mesh.spheres.clone(), contacts: mesh.contacts.clone() }
    }
}
