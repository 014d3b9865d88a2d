//! Angle filter on a grid: the algorithm of Foskey, Lin and Manocha.
//!
//! 1. A lattice of voxels over the bounding box; those whose centres are inside.
//! 2. For each the unit vector to the closest boundary point.
//! 3. The face between two neighbouring voxels whose vectors diverge belongs to the axis where the
//!    angle between them exceeds `theta`: between the two centres the closest point changes sides.
//! 4. The faces, as squares of two triangles on the corners of the voxels. The radius at a corner is
//!    its distance from the surface.
//!
//! # Deviations from the paper
//! - The paper rasterises distance fields in graphics hardware, slice by slice; here the closest points
//!   are exact, from a tree.
//! - A face with a corner outside the solid is left out and counted: no medial sphere is centred
//!   there. Only parts about as thin as a voxel have any.

use medial::Vec3;
use medial::complex::{MedialMesh, Sphere};
use medial::geometry::TriangleBvh;
use medial::shape::Shape;
use medial::simplifier::{
    Diagnostics, Extras, Level, RunContext, Simplification, Simplified, SimplifyError, Work,
};
use medial::surface::{InsideTest, Side};
use rayon::prelude::*;

use crate::ranked::Scale;

/// Most voxels along the longest side: a cube of so many takes about a gigabyte.
pub(super) const MAX_RESOLUTION: u32 = 320;

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
    fn new(shape: &Shape, resolution: u32) -> Self {
        let (lo, hi) = shape.mesh().bounding_box().expect("a shape has vertices");
        let side = (hi - lo).max_element() / f64::from(resolution);
        // A side that is a whole number of voxels but for rounding does not get one more.
        let voxels = |length: f64| (length / side * (1.0 - 1e-9)).ceil().max(1.0) as usize;
        Self { origin: lo, side, size: (hi - lo).to_array().map(voxels) }
    }

    fn len(&self) -> usize {
        self.size.iter().product()
    }

    /// The voxel of an index; `x` runs fastest.
    fn voxel(&self, index: usize) -> [usize; 3] {
        let [x, y, _] = self.size;
        [index % x, index / x % y, index / (x * y)]
    }

    fn corner_id(&self, [x, y, z]: [usize; 3]) -> u32 {
        ((z * (self.size[1] + 1) + y) * (self.size[0] + 1) + x) as u32
    }

    fn corner_count(&self) -> usize {
        self.size.iter().map(|n| n + 1).product()
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
    resolution: u32,
    run: &RunContext,
) -> Result<Faces, SimplifyError> {
    let tree = shape.surface_tree()?;
    let inside = shape.inside_test();
    let grid = Grid::new(shape, resolution);
    let toward = directions(&grid, &tree, &inside, run)?;
    let mut faces = diverging(&grid, &toward);
    drop(toward);
    run.step(1, 2)?;
    let radius = radii(&grid, &faces, &tree, &inside);
    let before = faces.len();
    faces.retain(|face| face.corners.iter().all(|&c| radius[c as usize] >= 0.0));
    if faces.is_empty() {
        return Err(SimplifyError::unsupported(format!(
            "the solid is too thin for voxels at resolution = {resolution}: no face between two of \
             them lies inside; raise it"
        )));
    }
    faces.par_sort_by(|a, b| b.angle.total_cmp(&a.angle));
    let mut diagnostics = Diagnostics::default();
    diagnostics.count("faces_left_out_at_the_surface", before - faces.len());
    Ok(Faces { grid, faces, radius, scale: super::scale(), diagnostics })
}

/// Step 2: zero for voxels outside.
fn directions(
    grid: &Grid,
    tree: &TriangleBvh,
    inside: &InsideTest,
    run: &RunContext,
) -> Result<Vec<[f32; 3]>, SimplifyError> {
    let [x, y, z] = grid.size;
    let mut toward = Vec::with_capacity(grid.len());
    for slice in 0..z {
        run.step(slice, z)?;
        let first = slice * x * y;
        let centre = |index: usize| {
            let place = grid.voxel(index).map(|n| n as f64 + 0.5);
            grid.origin + grid.side * Vec3::from(place)
        };
        let centres: Vec<Vec3> = (first..first + x * y).map(centre).collect();
        let sides = inside.sides(&centres);
        let kept: Vec<Vec3> = centres
            .iter()
            .zip(&sides)
            .filter(|&(_, &side)| side == Side::Inside)
            .map(|(&c, _)| c)
            .collect();
        let mut found = kept.iter().zip(tree.closest_batch(&kept));
        let direction = |&side: &Side| match side {
            Side::Inside => found.next().map_or([0.0; 3], |(&c, near)| {
                (near.point - c).normalize_or_zero().as_vec3().to_array()
            }),
            Side::On | Side::Outside => [0.0; 3],
        };
        toward.extend(sides.iter().map(direction));
    }
    Ok(toward)
}

/// Step 3, in the order of the voxels.
fn diverging(grid: &Grid, toward: &[[f32; 3]]) -> Vec<Face> {
    let strides = [1, grid.size[0], grid.size[0] * grid.size[1]];
    let of_voxel = |here: usize| {
        let place = grid.voxel(here);
        (0..3).filter_map(move |axis| {
            if place[axis] + 1 == grid.size[axis] {
                return None;
            }
            let [a, b] = [here, here + strides[axis]].map(|v| vector(toward[v]));
            if a == Vec3::ZERO || b == Vec3::ZERO || b[axis] <= a[axis] {
                return None;
            }
            let angle = 2.0 * (a - b).length().atan2((a + b).length());
            let corner = |u: usize, v: usize| {
                let mut at = place;
                at[axis] += 1;
                at[(axis + 1) % 3] += u;
                at[(axis + 2) % 3] += v;
                grid.corner_id(at)
            };
            let corners = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
            Some(Face { angle: angle.to_degrees(), corners })
        })
    };
    (0..grid.len()).into_par_iter().flat_map_iter(of_voxel).collect()
}

fn vector(v: [f32; 3]) -> Vec3 {
    Vec3::from(v.map(f64::from)).normalize_or_zero()
}

/// Distances of the corners of some faces from the surface; negative for those outside and for
/// all others.
fn radii(grid: &Grid, faces: &[Face], tree: &TriangleBvh, inside: &InsideTest) -> Vec<f64> {
    let mut used = vec![false; grid.corner_count()];
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

impl Faces {
    /// How many of the best faces have at most so many corners together, at least one.
    fn faces_for(&self, spheres: usize) -> usize {
        let mut seen = std::collections::HashSet::new();
        for (rank, face) in self.faces.iter().enumerate() {
            seen.extend(face.corners);
            if seen.len() > spheres {
                return rank.max(1);
            }
        }
        self.faces.len()
    }

    /// Step 4.
    fn mesh(&self, count: usize) -> MedialMesh {
        let kept = &self.faces[..count];
        let mut ids: Vec<u32> = kept.iter().flat_map(|face| face.corners).collect();
        ids.sort_unstable();
        ids.dedup();
        let number = |id: u32| ids.binary_search(&id).expect("a corner of a kept face") as u32;
        let sphere = |&id: &u32| Sphere::new(self.grid.corner(id), self.radius[id as usize]);
        let triangles = kept.iter().flat_map(|face| {
            let [a, b, c, d] = face.corners.map(number);
            [[a, b, c], [a, c, d]]
        });
        let spheres = ids.iter().map(sphere).collect();
        MedialMesh::from_simplices(spheres, vec![], triangles.collect())
            .expect("finite spheres and ids in range")
    }
}

impl Simplification for Faces {
    fn at(&mut self, level: Level) -> Result<Simplified, SimplifyError> {
        let mut diagnostics = self.diagnostics.clone();
        let (count, native) = match level {
            Level::MaxError(_) => return Err(SimplifyError::searched()),
            Level::Spheres(0) => {
                return Err(SimplifyError::Level("ask for at least one sphere".into()));
            }
            Level::Spheres(spheres) => {
                let count = self.faces_for(spheres);
                (count, self.faces.get(count).map_or(0.0, |face| face.angle))
            }
            Level::Native(theta) => {
                self.scale.check(theta)?;
                (self.faces.partition_point(|face| face.angle > theta), theta)
            }
            Level::Published => {
                return Err(SimplifyError::Unsupported { why: self.scale.no_published.into() });
            }
        };
        let mesh = self.mesh(count);
        let reached = mesh.spheres.len();
        match level {
            Level::Spheres(asked) if reached != asked => diagnostics.warn(format!(
                "{reached} spheres instead of {asked}: whole faces between voxels are kept, {} of {}",
                count,
                self.faces.len()
            )),
            _ if reached == 0 => diagnostics.warn(format!(
                "no face between voxels passes theta = {native}: the largest is {}",
                self.faces.first().map_or(0.0, |face| face.angle)
            )),
            _ => {}
        }
        Ok(Simplified {
            mesh,
            asked: level,
            native_level: Some(native),
            work: Work::Anew,
            diagnostics,
            extras: Extras::default(),
        })
    }
}
