//! The balls that methods on unions of balls start from.

use std::sync::Arc;

use rayon::prelude::*;

use crate::Vec3;
use crate::complex::{CellSpheres, Contacts, MedialMesh};
use crate::geometry::trees::PointTree;
use crate::geometry::{Delaunay, Poles, Sphere};
use crate::shape::{Shape, ShapeError};
use crate::surface::Side;

/// Balls whose union approximates a shape.
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

// The contact points of each sphere of a medial mesh.

/// A sample counts as touched if its distance exceeds that of the nearest one by at most this share.
const REACH: f64 = 1.0 + 1e-3;

/// For each sphere of a medial mesh the boundary samples that it touches.
pub struct ContactSets {
    samples: Arc<[Vec3]>,
    /// `ids[start[i]..start[i + 1]]` are the contacts of sphere `i`, ascending where searched.
    start: Vec<usize>,
    ids: Vec<u32>,
}

impl ContactSets {
    /// The contacts that a mesh carries.
    pub(super) fn known(contacts: &Contacts) -> Self {
        Self {
            samples: Arc::clone(&contacts.samples),
            start: (0..=contacts.of_sphere.len()).map(|i| 4 * i).collect(),
            ids: contacts.of_sphere.iter().flatten().copied().collect(),
        }
    }

    /// For each sphere the samples within `(1 + 1e-3) d` of its centre, where `d` is the distance
    /// of the nearest one: the closest boundary points, by which papers define the contacts. None
    /// where even the nearest is beyond `(1 + 1e-3) r`, so that the sphere touches nothing.
    ///
    /// For a sphere without samples inside, these are all samples within `(1 + 1e-3) r`. A sphere that
    /// sticks out of the surface can contain thousands of samples, which it does not touch.
    ///
    /// Cost `O((n + m) log m + output)`.
    pub(super) fn search(mesh: &MedialMesh, samples: &Arc<[Vec3]>) -> Self {
        let tree = PointTree::new(samples);
        let found: Vec<Vec<u32>> = mesh
            .spheres
            .par_iter()
            .map(|s| {
                let nearest = tree.nearest(s.centre).map_or(0.0, |(_, squared)| squared.sqrt());
                let reach = s.radius.min(nearest) * REACH;
                let mut ids = tree.within(s.centre, reach * reach);
                ids.sort_unstable();
                ids
            })
            .collect();
        let mut start = vec![0];
        for ids in &found {
            start.push(start[start.len() - 1] + ids.len());
        }
        Self { samples: Arc::clone(samples), start, ids: found.concat() }
    }

    /// Calls `read` with the contact points of a sphere.
    pub fn with<T>(&self, sphere: usize, read: impl FnOnce(&[Vec3]) -> T) -> T {
        let ids = self.ids(sphere);
        if let &[a, b, c, d] = ids {
            return read(&[a, b, c, d].map(|id| self.samples[id as usize]));
        }
        let points: Vec<Vec3> = ids.iter().map(|&id| self.samples[id as usize]).collect();
        read(&points)
    }

    /// Number of spheres.
    pub fn spheres(&self) -> usize {
        self.start.len() - 1
    }

    /// The boundary samples that the ids of [`ContactSets::ids`] name.
    pub fn samples(&self) -> &Arc<[Vec3]> {
        &self.samples
    }

    /// The sample ids of a sphere's contacts.
    pub fn ids(&self, sphere: usize) -> &[u32] {
        &self.ids[self.start[sphere]..self.start[sphere + 1]]
    }

    /// Number of spheres with fewer than two contacts.
    pub fn empty_sets(&self) -> usize {
        self.start.windows(2).filter(|w| w[1] - w[0] < 2).count()
    }
}

// Labelled polar balls of a shape, for its power crust.

/// The polar balls of boundary samples, by the side of the surface that they are centred on.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PolarBalls {
    /// Centred inside.
    pub inner: Vec<Sphere>,
    /// Centred outside, or on the surface.
    pub outer: Vec<Sphere>,
    /// How many were rejected, because they reach through the surface.
    pub rejected: usize,
}

/// Half the side of the cube that bounds the cells of the samples, in diagonals of the surface.
const BOX: f64 = 2.5;

/// Poles nearer to the surface than this share of their radius are rejected.
///
/// Their balls pass between the samples of a part that is thinner than the samples are apart, and
/// reach far to the other side; the side of the centre is irrelevant. They are few, but can make a
/// false handle. With too large a share thin parts lose poles that they need. The published program has no surface, and estimates the same from the shape of
/// Voronoi cells.
const MIN_DEPTH: f64 = 0.25;

impl Shape {
    /// The polar balls of the samples, in normalised units: no pole is at infinity, because the
    /// corners of a large box around the surface take part in the diagram. Their own poles do not count.
    ///
    /// Costs one more Delaunay triangulation.
    ///
    /// # Errors
    /// When the samples do not span space.
    pub fn polar_balls(&self) -> Result<PolarBalls, ShapeError> {
        let samples = self.samples();
        let mut points = samples.to_vec();
        let signs = [-BOX, BOX];
        let box_corners = (0..8).map(|k| Vec3::new(signs[k & 1], signs[k >> 1 & 1], signs[k >> 2]));
        points.extend(box_corners);
        let delaunay = Delaunay::new(&points)?;
        let poles = Poles::new(&delaunay);
        let mut is_pole = vec![false; delaunay.finite_cell_count()];
        for cell in poles.samples()[..samples.len()].iter().flat_map(|poles| poles.cells()) {
            is_pole[cell.index()] = true;
        }
        let balls: Vec<Sphere> =
            poles.balls().iter().filter(|b| is_pole[b.cell.index()]).map(|b| b.sphere).collect();
        let centres: Vec<Vec3> = balls.iter().map(|b| b.centre).collect();
        let sides = self.inside_test().sides(&centres);
        let tree = self.surface_tree()?;
        let depths = tree.distance_batch(&centres);
        let mut labelled = PolarBalls::default();
        for ((&ball, side), depth) in balls.iter().zip(sides).zip(depths) {
            if depth < MIN_DEPTH * ball.radius {
                labelled.rejected += 1;
                continue;
            }
            match side {
                Side::Inside => labelled.inner.push(ball),
                Side::On | Side::Outside => labelled.outer.push(ball),
            }
        }
        Ok(labelled)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::complex::Sphere;

    #[test]
    fn searched_contacts_are_the_nearest_samples() {
        // Two walls at distance 2, one sample for each unit of area.
        let wall =
            |z: f64| (0..100).map(move |k| Vec3::new(f64::from(k % 10), f64::from(k / 10), z));
        let samples: Arc<[Vec3]> = wall(-1.0).chain(wall(1.0)).collect();
        let at = |x: f64, radius: f64| Sphere::new(Vec3::new(x, 5.0, 0.0), radius);
        // Inscribed; sticking out by far; too small to touch; nearest to two samples of each wall.
        let spheres = vec![at(5.0, 1.0), at(5.0, 4.0), at(5.0, 0.5), at(4.5, 1.25_f64.sqrt())];
        let mesh = MedialMesh { spheres, ..MedialMesh::default() };
        let sets = ContactSets::search(&mesh, &samples);
        assert_eq!(sets.ids(0), [55, 155]);
        assert_eq!(sets.ids(1), [55, 155]);
        assert!(sets.ids(2).is_empty());
        assert_eq!(sets.ids(3), [54, 55, 154, 155]);
        assert_eq!((sets.spheres(), sets.empty_sets()), (4, 1));
        assert_eq!(sets.samples(), &samples);
        assert_eq!(sets.with(0, <[Vec3]>::to_vec), [samples[55], samples[155]]);
    }
}
