//! Parts of a solid that a lattice loses: found, and named.
//!
//! A part thinner than two voxels has no voxel whose sphere fits inside. If it is a limb, its loss does
//! not change the Betti numbers. So points of the surface, its vertices and the middles of its faces,
//! are measured against the spheres of the voxels:
//!
//! 1. The spheres of voxels at the border of the start set; those inside reach no farther.
//! 2. The point that is farthest from all of them is lost where it is farther than [`LOST`] voxels.
//!    Along sharp edges spheres stay one to three voxels away without anything being lost.
//! 3. What it would take: around that point the largest ball inside that touches the surface, found by
//!    shrinking (Ma, Bae, Choi 2012), and the lattice whose voxels fit into it.

use medial::Vec3;
use medial::complex::{MedialUnion, Sphere as Ball};
use medial::simplifier::SimplifyError;
use medial::surface::TriangleBvh;

use super::advice::SURELY;
use super::bricks::{Bricks, Voxel};
use super::params::MAX_RESOLUTION;
use super::solid::Solid;
use super::thinning::FACES;

/// Distance from all spheres, in voxels, from which on a point of the surface is lost.
pub(super) const LOST: f64 = 3.0;
/// Points of the surface that are measured, at most.
const MAX_POINTS: usize = 60_000;
/// Points around the lost one at which balls are shrunk, at most.
const MAX_BALLS: usize = 400;
/// Steps of a shrinking ball, at most.
const STEPS: usize = 40;

/// A part of the surface that is far from every voxel's sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Loss {
    /// The farthest point, normalised.
    pub place: Vec3,
    /// Its distance from the nearest sphere, a fraction of the diagonal.
    pub distance: f64,
    /// Voxels along the longest side at which the part around it has some.
    pub needed: u32,
}

/// A point of the surface with an outward unit normal.
type Point = (Vec3, Vec3);

impl Solid<'_> {
    /// The part of the surface that is farthest from the voxels of a lattice, if that is more than
    /// `allowed`, a fraction of the diagonal.
    ///
    /// # Errors
    /// When the surface has no face.
    pub(super) fn loss(
        &self,
        resolution: u32,
        voxels: &Bricks,
        allowed: f64,
    ) -> Result<Option<Loss>, SimplifyError> {
        let is_border = |place| voxels.neighbourhood(place) & FACES != FACES;
        let border = voxels.iter().filter(|voxel| is_border(voxel.place)).collect::<Vec<_>>();
        self.loss_of(resolution, &border, allowed)
    }

    /// As [`Solid::loss`], of the spheres of some voxels.
    pub(super) fn loss_of(
        &self,
        resolution: u32,
        voxels: &[Voxel],
        allowed: f64,
    ) -> Result<Option<Loss>, SimplifyError> {
        let grid = self.grid(resolution);
        let ball = |v: &Voxel| Ball::new(grid.centre(v.place), f64::from(v.distance));
        let balls: Vec<Ball> = voxels.iter().map(ball).collect();
        let Ok(union) = MedialUnion::of_spheres(&balls) else {
            // Without voxels everything is lost, which has a message of its own.
            return Ok(None);
        };
        let points = self.surface_points();
        let places: Vec<Vec3> = points.iter().map(|point| point.0).collect();
        let distances = union.signed_batch(&places);
        // Reversed, because `max_by` returns the last of equal elements.
        let farthest =
            (0..places.len()).rev().max_by(|&a, &b| distances[a].total_cmp(&distances[b]));
        let Some(farthest) = farthest.filter(|&f| distances[f] > allowed) else {
            return Ok(None);
        };
        let tree = self.shape.surface_tree()?;
        let (place, distance) = (places[farthest], distances[farthest]);
        let around = points.iter().filter(|p| p.0.distance(place) <= allowed.max(0.2 * distance));
        let around: Vec<&Point> = around.collect();
        // The thickest ball nearby decides: a lattice that fits it has voxels in the part.
        let some = around.iter().step_by(around.len().div_ceil(MAX_BALLS).max(1));
        let thickest = some.map(|&&point| shrunk(&tree, point)).fold(f64::MIN_POSITIVE, f64::max);
        let longest = grid.side * f64::from(resolution);
        let needed = (SURELY * longest / thickest).ceil().min(f64::from(u32::MAX)) as u32;
        Ok(Some(Loss { place, distance, needed: needed.max(resolution + 1) }))
    }

    /// The middles of faces, and vertices with the normal of one of their faces.
    fn surface_points(&self) -> Vec<Point> {
        let mesh = self.shape.mesh();
        let mut seen = vec![false; mesh.vertices.len()];
        let mut points = Vec::with_capacity(mesh.faces.len() + seen.len());
        for (index, face) in mesh.faces.iter().enumerate() {
            let [a, b, c] = mesh.triangle(index);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            if normal == Vec3::ZERO {
                continue;
            }
            points.push(((a + b + c) / 3.0, normal));
            for (&v, place) in face.iter().zip([a, b, c]) {
                if !std::mem::replace(&mut seen[v as usize], true) {
                    points.push((place, normal));
                }
            }
        }
        let step = points.len().div_ceil(MAX_POINTS).max(1);
        points.into_iter().step_by(step).collect()
    }

    /// A loss in words, with the place in the units of the surface.
    pub(super) fn in_words(&self, resolution: u32, loss: &Loss) -> String {
        let normal = self.shape.normalisation();
        let place = normal.backward(loss.place);
        let advice = if loss.needed > MAX_RESOLUTION {
            "no lattice is fine enough".to_owned()
        } else {
            let (fine, limit) = (self.megabytes(loss.needed).0, self.params().max_memory);
            let memory = if fine > limit {
                format!(", and max_memory = {}", fine.ceil())
            } else {
                String::new()
            };
            format!("it takes about resolution = {}{memory}", loss.needed)
        };
        format!(
            "the surface at ({:.6}, {:.6}, {:.6}) is {:.1} % of the diagonal away from every voxel's \
             sphere: parts thinner than {:.4} in units of the surface are not resolved at resolution \
             {resolution}; {advice}",
            place.x,
            place.y,
            place.z,
            100.0 * loss.distance,
            2.0 * self.grid(resolution).side * normal.diagonal
        )
    }
}

/// Radius of the largest ball inside the solid that touches the surface at a point.
fn shrunk(tree: &TriangleBvh, (place, normal): Point) -> f64 {
    let mut radius = 1.0;
    for _ in 0..STEPS {
        let nearest = tree.closest(place - radius * normal);
        if nearest.distance >= radius * (1.0 - 1e-6) {
            break;
        }
        let chord = place - nearest.point;
        // The ball through both points that touches the surface at `place`.
        let smaller = chord.length_squared() / (2.0 * normal.dot(chord));
        // Fails only by rounding, when the ball has shrunk to its point.
        if !(smaller > 0.0 && smaller < radius) {
            break;
        }
        radius = smaller;
    }
    radius
}
