//! Volume of the symmetric difference between a solid and the union of its medial primitives.
//!
//! 1. A box around both, along the axes of the pose, is divided into cells. A cell that neither the surface
//!    nor the boundary of the union reaches is wholly inside the difference or wholly outside. One query at
//!    its centre decides this, because distances are 1-Lipschitz. Other cells are divided into eight.
//! 2. At the finest level each cell is decided by one random point.
//!
//! Only a shell around the two boundaries is ever refined, so the finest cells are those of a
//! stratified, jittered grid of `2^depth` cells along each side at a fraction of its cost.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use rayon::prelude::*;

use super::error::MetricError;
use super::samples::Pose;
use crate::Vec3;
use crate::complex::MedialUnion;
use crate::geometry::Sphere;
use crate::geometry::hash::splitmix;
use crate::sum::Sum;
use crate::surface::{InsideTest, Side, TriMesh, TriangleBvh};

/// Levels that are divided first, on one thread, into `8^COARSE` independent tasks.
const COARSE: u32 = 2;

/// Signed volume that a closed surface encloses, exact up to rounding by the divergence theorem;
/// positive when its faces are counter-clockwise seen from outside. The same for any order of the
/// faces.
pub fn enclosed_volume(surface: &TriMesh) -> f64 {
    let origin = surface.bounding_box().map_or(Vec3::ZERO, |(lo, hi)| lo.midpoint(hi));
    let mut terms: Vec<f64> = (0..surface.faces.len())
        .map(|face| {
            let [a, b, c] = surface.triangle(face).map(|v| v - origin);
            a.dot(b.cross(c))
        })
        .collect();
    // Sorted, so that rounding does not depend on the order of the faces.
    terms.sort_unstable_by(f64::total_cmp);
    let mut six_times = Sum::default();
    terms.into_iter().for_each(|term| six_times.add(term));
    six_times.value() / 6.0
}

/// Volumes relative to that of the solid.
#[derive(Clone, Copy, Debug)]
pub(super) struct Volumes {
    /// Of the symmetric difference of solid and union.
    pub error: f64,
    /// Of the union.
    pub ratio: f64,
}

/// The box around a surface and balls in the coordinates of a pose.
fn box_in(pose: &Pose, surface: &TriMesh, balls: &[Sphere]) -> (Vec3, Vec3) {
    let points = surface.vertices.iter().map(|&v| (pose.local(v), 0.0));
    let balls = balls.iter().map(|ball| (pose.local(ball.centre), ball.radius));
    points.chain(balls).fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(lo, hi), (p, r)| {
        (lo.min(p - Vec3::splat(r)), hi.max(p + Vec3::splat(r)))
    })
}

/// A solid and a union that are compared.
pub(super) struct Sides<'a> {
    pub surface: &'a TriMesh,
    pub bvh: &'a TriangleBvh,
    pub inside: &'a InsideTest,
    /// The spheres of the union.
    pub balls: &'a [Sphere],
    pub union: &'a MedialUnion,
}

/// The volumes, by cells along the axes of `pose`. The finest cells are `2^-depth` of the side of a box around both. The
/// same for any number of threads.
///
/// # Errors
/// When the surface does not enclose a positive volume.
pub(super) fn volumes(
    pose: &Pose,
    sides: &Sides<'_>,
    depth: u32,
    seed: u64,
) -> Result<Volumes, MetricError> {
    let volume = enclosed_volume(sides.surface);
    if !(volume > 0.0 && volume.is_finite()) {
        return Err(MetricError::NoVolume(volume));
    }
    let (lo, hi) = box_in(pose, sides.surface, sides.balls);
    let division = Division { pose, sides, depth, seed };
    let root = Cell { lo, size: hi - lo, level: 0, path: 1 };
    let coarse = (0..depth.min(COARSE))
        .fold(vec![root], |cells, _| cells.iter().flat_map(Cell::children).collect());
    let parts: Vec<Parts> = coarse.par_iter().map(|cell| division.difference(cell)).collect();
    let Parts { all, excess } = parts.into_iter().fold(Parts::default(), Parts::plus);
    Ok(Volumes { error: all / volume, ratio: (1.0 + (2.0 * excess - all) / volume).max(0.0) })
}

#[derive(Clone, Copy)]
struct Cell {
    lo: Vec3,
    size: Vec3,
    level: u32,
    /// The octants from the root to this cell, three bits each, after a leading 1.
    path: u64,
}

impl Cell {
    fn children(&self) -> [Self; 8] {
        let size = self.size * 0.5;
        std::array::from_fn(|k| {
            let offset = Vec3::new((k & 1) as f64, (k >> 1 & 1) as f64, (k >> 2) as f64);
            let (level, path) = (self.level + 1, self.path << 3 | k as u64);
            Self { lo: self.lo + offset * size, size, level, path }
        })
    }

    /// The cell as a part of the difference, if it is in one of both alone.
    fn part(&self, in_solid: bool, in_union: bool) -> Parts {
        let volume = self.size.x * self.size.y * self.size.z;
        match (in_solid, in_union) {
            (true, false) => Parts { all: volume, excess: 0.0 },
            (false, true) => Parts { all: volume, excess: volume },
            _ => Parts::default(),
        }
    }
}

/// Volumes in the difference of solid and union.
#[derive(Clone, Copy, Debug, Default)]
struct Parts {
    all: f64,
    /// The part in the union.
    excess: f64,
}

impl Parts {
    fn plus(self, other: Self) -> Self {
        Self { all: self.all + other.all, excess: self.excess + other.excess }
    }
}

struct Division<'a> {
    pose: &'a Pose,
    sides: &'a Sides<'a>,
    depth: u32,
    seed: u64,
}

impl Division<'_> {
    /// The part of the difference in a cell.
    fn difference(&self, cell: &Cell) -> Parts {
        let Sides { bvh, union, inside, .. } = self.sides;
        let is_inside = |p| inside.side(p) == Side::Inside;
        if cell.level >= self.depth {
            // A generator per cell: whether a boundary just touches another cell is up to rounding,
            // and must not change the random numbers of this one.
            let mut rng = Pcg64::seed_from_u64(splitmix(self.seed) ^ cell.path);
            let jitter = Vec3::new(rng.random(), rng.random(), rng.random());
            let point = self.pose.world(cell.lo + jitter * cell.size);
            return cell.part(is_inside(point), union.buries(point, 0.0));
        }
        let (centre, reach) = (cell.lo + cell.size * 0.5, cell.size.length() * 0.5);
        let centre = self.pose.world(centre);
        // The surface first: most cells are near it, and that test is the cheapest. None of these
        // tests computes the distance itself.
        if !bvh.any_within(centre, reach) {
            let covered = union.buries(centre, reach);
            if covered || !union.buries(centre, -reach) {
                return cell.part(is_inside(centre), covered);
            }
        }
        let parts = cell.children().map(|child| self.difference(&child));
        parts.into_iter().fold(Parts::default(), Parts::plus)
    }
}
