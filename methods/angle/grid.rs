//! Angle filter on a grid: the algorithm of Foskey, Lin and Manocha.
//!
//! 1. A lattice of voxels over the bounding box; those whose centres are inside.
//! 2. For each the unit vector to the closest boundary point.
//! 3. The face between two neighbouring voxels whose vectors diverge belongs to the axis where the
//!    angle between them exceeds `theta`: between the two centres the closest point changes sides.
//! 4. The faces, as squares of two triangles on the corners of the voxels. The radius at a corner is
//!    its distance from the surface.
//!
//! A number of spheres is met by the resolution (below) or, with `size=ranking`, by the
//! faces of largest angle that together have at most this many corners.
//!
//! # Deviations from the paper
//! - The paper rasterises distance fields in graphics hardware, slice by slice; here the closest points
//!   are exact, from a tree.
//! - No medial sphere is centred outside the solid. A face with one corner outside becomes the triangle
//!   of the others, a face with only one side inside becomes that edge, any other is left out and
//!   counted. Such faces occur only in parts about as thin as a voxel.

use medial::Vec3;
use medial::complex::{MedialMesh, Sphere};
use medial::shape::Shape;
use medial::simplifier::{
    Diagnostics, Level, RunContext, Simplification, Simplified, SimplifyError,
};
use medial::surface::{InsideTest, Side, TriangleBvh};
use rayon::prelude::*;

use super::AngleParams;
use crate::Result;
use crate::levels::{ByKnob, Knob};
use crate::ranked::{Scale, Wanted, break_ties, mean};

/// Largest number of voxels along the longest side: a cube of this size takes about a gigabyte.
pub(super) const MAX_RESOLUTION: f64 = 320.0;

/// Fewest voxels along the longest side.
pub(super) const MIN_RESOLUTION: f64 = 2.0;

/// A face of the lattice.
#[derive(Clone, Copy, Debug)]
struct Face {
    /// Degrees.
    angle: f64,
    /// Its corners in order around it, by place in the lattice of corners.
    corners: [u32; 4],
}

/// The faces that may belong to the axis, the largest angle first.
pub(super) struct Faces {
    grid: Grid,
    faces: Vec<Face>,
    /// Radius at a corner; negative outside, and where no face has that corner.
    radius: Vec<f64>,
    scale: Scale,
    diagnostics: Diagnostics,
}

#[derive(Clone, Copy, Debug)]
struct Grid {
    origin: Vec3,
    side: f64,
    size: [usize; 3],
}

impl Grid {
    fn new(shape: &Shape, resolution: f64) -> Self {
        let (lo, hi) = shape.mesh().bounding_box().expect("a shape has vertices");
        let side = (hi - lo).max_element() / resolution;
        // Rounding must not add a voxel to a side that is a whole number of voxels.
        let size = (hi - lo)
            .to_array()
            .map(|length| (length / side * (1.0 - 1e-9)).ceil().max(1.0) as usize);
        Self { origin: lo, side, size }
    }

    fn len(&self) -> usize {
        self.size.iter().product()
    }

    /// The voxel of an index; `x` runs fastest.
    fn voxel(&self, index: usize) -> [usize; 3] {
        let [x, y, _] = self.size;
        [index % x, index / x % y, index / (x * y)]
    }

    fn centre(&self, index: usize) -> Vec3 {
        self.origin + self.side * Vec3::from(self.voxel(index).map(|n| n as f64 + 0.5))
    }

    fn corner(&self, id: u32) -> Vec3 {
        let (id, [x, y]) = (id as usize, [self.size[0] + 1, self.size[1] + 1]);
        let place = [id % x, id / x % y, id / (x * y)].map(|n| n as f64);
        self.origin + self.side * Vec3::from(place)
    }
}

/// Steps 1 to 3 for all angles. `O(R^3 log F)` for `F` triangles.
pub(super) fn prepare(
    shape: &Shape,
    &AngleParams { resolution, theta, .. }: &AngleParams,
    run: &RunContext,
) -> Result<Faces> {
    let tree = shape.surface_tree()?;
    let inside = shape.inside_test();
    let grid = Grid::new(shape, resolution);
    let toward = directions(&grid, &tree, &inside, run)?;
    let mut faces = diverging(&grid, &toward);
    drop(toward);
    run.step(1, 2)?;
    let radius = radii(&grid, &faces, &tree, &inside);
    let before = faces.len();
    faces.retain(|face| {
        let mut sides = (0..4).map(|k| [k, (k + 1) % 4].map(|k| face.corners[k] as usize));
        sides.any(|side| side.iter().all(|&corner| radius[corner] >= 0.0))
    });
    if faces.is_empty() {
        return Err(SimplifyError::unsupported(format!(
            "the solid is too thin for voxels at resolution = {resolution}: no face between two of \
             them lies inside; raise it"
        )));
    }
    faces.par_sort_by(|a, b| b.angle.total_cmp(&a.angle));
    let mut diagnostics = Diagnostics::default();
    diagnostics.count("faces_left_out_at_the_surface", before - faces.len());
    let mut found =
        Faces { grid, faces: Vec::new(), radius, scale: super::scale(theta), diagnostics };
    break_ties(
        &mut faces,
        |face| face.angle,
        |face| mean(inner(&found.radius, face).iter().map(|&id| found.sphere(id))),
    );
    found.faces = faces;
    Ok(found)
}

/// Step 2: zero for voxels outside.
fn directions(
    grid: &Grid,
    tree: &TriangleBvh,
    inside: &InsideTest,
    run: &RunContext,
) -> Result<Vec<[f32; 3]>> {
    let [x, y, z] = grid.size;
    let mut toward = Vec::with_capacity(grid.len());
    for slice in 0..z {
        run.step(slice, z)?;
        let first = slice * x * y;
        let centres: Vec<Vec3> = (first..first + x * y).map(|index| grid.centre(index)).collect();
        let sides = inside.sides(&centres);
        let kept: Vec<Vec3> = centres
            .iter()
            .zip(&sides)
            .filter(|&(_, &side)| side == Side::Inside)
            .map(|(&c, _)| c)
            .collect();
        let mut found = kept.iter().zip(tree.closest_batch(&kept));
        toward.extend(sides.iter().map(|side| match side {
            Side::Inside => found.next().map_or([0.0; 3], |(&c, near)| {
                (near.point - c).normalize_or_zero().as_vec3().to_array()
            }),
            Side::On | Side::Outside => [0.0; 3],
        }));
    }
    Ok(toward)
}

/// Step 3, in the order of the voxels.
fn diverging(grid: &Grid, toward: &[[f32; 3]]) -> Vec<Face> {
    (0..grid.len())
        .into_par_iter()
        .flat_map_iter(|voxel| {
            let place = grid.voxel(voxel);
            (0..3).filter_map(move |axis| grid.face(toward, voxel, place, axis))
        })
        .collect()
}

impl Grid {
    /// The face between a voxel and the next along an axis, if their directions diverge.
    #[inline]
    fn face(
        &self,
        toward: &[[f32; 3]],
        voxel: usize,
        place: [usize; 3],
        axis: usize,
    ) -> Option<Face> {
        if place[axis] + 1 == self.size[axis] {
            return None;
        }
        let stride = self.size[..axis].iter().product::<usize>();
        let [a, b] = [voxel, voxel + stride]
            .map(|v| Vec3::from(toward[v].map(f64::from)).normalize_or_zero());
        if a == Vec3::ZERO || b == Vec3::ZERO || b[axis] <= a[axis] {
            return None;
        }
        let sum = (a + b).length();
        let sum = if sum > OPPOSITE { sum } else { 0.0 };
        let angle = 2.0 * (a - b).length().atan2(sum);
        // Directions are kept in single precision: angles that agree to this are equal.
        let angle = (angle.to_degrees() / ANGLE_STEP).round() * ANGLE_STEP;
        let corners = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[u, v]| {
            let mut at = place;
            at[axis] += 1;
            at[(axis + 1) % 3] += u;
            at[(axis + 2) % 3] += v;
            let [x, y, z] = at;
            ((z * (self.size[1] + 1) + y) * (self.size[0] + 1) + x) as u32
        });
        Some(Face { angle, corners })
    }
}

/// Degrees; a power of two, so that angles are exact multiples.
const ANGLE_STEP: f64 = 1.0 / (1 << 20) as f64;

/// Unit vectors whose sum is no longer are opposite: directions are kept in single precision.
const OPPOSITE: f64 = 1e-6;

/// Distances of the corners of some faces from the surface; negative for those outside and for
/// all others.
fn radii(grid: &Grid, faces: &[Face], tree: &TriangleBvh, inside: &InsideTest) -> Vec<f64> {
    let mut used = vec![false; grid.size.iter().map(|n| n + 1).product()];
    for corner in faces.iter().flat_map(|face| face.corners) {
        used[corner as usize] = true;
    }
    let ids: Vec<u32> = (0..).zip(&used).filter(|&(_, &used)| used).map(|(id, _)| id).collect();
    let points: Vec<Vec3> = ids.iter().map(|&id| grid.corner(id)).collect();
    let (sides, distances) = (inside.sides(&points), tree.distance_batch(&points));
    let mut radius = vec![-1.0; used.len()];
    for ((id, side), distance) in ids.into_iter().zip(sides).zip(distances) {
        if side == Side::Inside {
            radius[id as usize] = distance;
        }
    }
    radius
}

/// The corners of a face that are inside, in order around it.
fn inner(radius: &[f64], face: Face) -> Vec<u32> {
    face.corners.into_iter().filter(|&corner| radius[corner as usize] >= 0.0).collect()
}

impl Faces {
    /// The sphere at a corner inside.
    fn sphere(&self, corner: u32) -> Sphere {
        Sphere::new(self.grid.corner(corner), self.radius[corner as usize])
    }

    /// The number of best faces that together have at most `spheres` corners; at least one.
    fn faces_for(&self, spheres: usize) -> usize {
        let mut seen = std::collections::HashSet::new();
        for (rank, face) in self.faces.iter().enumerate() {
            seen.extend(inner(&self.radius, *face));
            if seen.len() > spheres {
                return rank.max(1);
            }
        }
        self.faces.len()
    }

    /// Step 4.
    fn mesh(&self, count: usize) -> MedialMesh {
        let kept: Vec<Vec<u32>> =
            self.faces[..count].iter().map(|&face| inner(&self.radius, face)).collect();
        let mut ids = kept.concat();
        ids.sort_unstable();
        ids.dedup();
        let (mut edges, mut triangles) = (Vec::new(), Vec::new());
        for corners in &kept {
            let corners: Vec<u32> = corners
                .iter()
                .map(|id| ids.binary_search(id).expect("a corner of a kept face") as u32)
                .collect();
            match corners[..] {
                [a, b] => edges.push([a, b]),
                _ => triangles
                    .extend((2..corners.len()).map(|k| [corners[0], corners[k - 1], corners[k]])),
            }
        }
        let spheres = ids.iter().map(|&id| self.sphere(id)).collect();
        MedialMesh::from_simplices(spheres, edges, triangles)
            .expect("finite spheres and ids in range")
    }
}

impl Simplification for Faces {
    fn at(&mut self, level: Level) -> Result<Simplified> {
        let mut diagnostics = self.diagnostics.clone();
        let (count, native) = match self.scale.wanted(level, &mut diagnostics)? {
            Wanted::Spheres(spheres) => {
                let count = self.faces_for(spheres);
                (count, self.faces.get(count).map_or(0.0, |face| face.angle))
            }
            Wanted::Native(theta) => (self.faces.partition_point(|face| face.angle > theta), theta),
        };
        let mesh = self.mesh(count);
        let reached = mesh.spheres.len();
        match level {
            Level::Spheres(requested) if reached != requested => diagnostics.warn(format!(
                "{reached} spheres instead of {requested}: whole faces between voxels are kept, {} of {}",
                count,
                self.faces.len()
            )),
            _ if reached == 0 => diagnostics.warn(format!(
                "no face between voxels passes theta = {native}: the largest is {}",
                self.faces.first().map_or(0.0, |face| face.angle)
            )),
            _ => {}
        }
        let native_level = Some(native);
        Ok(Simplified { native_level, diagnostics, ..Simplified::new(mesh, level) })
    }
}

// Angle filter on a grid, where the resolution decides the number of spheres.
//
// Foskey, Lin and Manocha control the size of the result by the grid: `theta` decides which sheets there
// are, the resolution how finely they are cut. A number of spheres is met by a search over the
// resolution (`methods/levels.rs`) at the `theta` of the parameters. It can have a fraction,
// reported in thousandths: then the last voxels stick out of the bounding box.

/// Finest lattice of a search: eight million voxels for a cube.
const FINEST: f64 = 200.0;

/// The shape on lattices of any resolution. Builds their shared parts, the tree and the inside
/// test of the surface.
pub(super) fn prepare_by_resolution<'s>(
    shape: &'s Shape,
    params: AngleParams,
    run: &RunContext,
) -> Result<ByKnob<'s>> {
    shape.surface_tree()?;
    shape.inside_test();
    // A sheet of area A has A R^2 faces, and about as many corners.
    let knob = Knob {
        count: "resolution_in_thousandths",
        unit: "voxels along the longest side",
        range: MIN_RESOLUTION..=FINEST,
        steps: 1e3,
        rate: 0.4,
        exponent: 2.0,
    };
    let run_again = run.clone();
    Ok(ByKnob::new(knob, params.theta, run, move |value| {
        let resolution = value.unwrap_or(params.resolution);
        Ok(Box::new(prepare(shape, &AngleParams { resolution, ..params }, &run_again)?))
    }))
}
