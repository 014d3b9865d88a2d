//! Samples of a surface, the same for every medial mesh that is measured against it.
//!
//! They are made in a frame of the surface ([`Pose`]) and in the order of a curve in it, so that
//! neither the orientation of the surface nor the order of its file matters. There is one exception:
//! if the surface is symmetric and the medial mesh is not, a turned input can get other samples.

use std::cell::LazyCell;
use std::cmp::Ordering;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use rayon::prelude::*;

use super::error::MetricError;
use crate::Vec3;
use crate::complex::{MedialMesh, MedialUnion, UnionError};
use crate::geometry::trees::morton_code;
use crate::sum::Sum;
use crate::surface::TriMesh;

/// Samples of a surface: the area-uniform ones first, then the vertices of its faces.
pub(super) struct SurfaceSamples {
    /// The frame in which they are laid out.
    pub pose: Pose,
    pub points: Vec<Vec3>,
    /// How many of them are area-uniform.
    pub uniform: usize,
    /// Typical distance between these.
    pub spacing: f64,
}

impl SurfaceSamples {
    /// `count` area-uniform samples of a surface, and its vertices. `O(n log n)`.
    pub fn new(surface: &TriMesh, count: usize, seed: u64) -> Result<Self, MetricError> {
        if count == 0 {
            return Err(MetricError::NoSamples("surface_samples"));
        }
        let pose = Pose::new(surface);
        let triangles = pose.triangles(surface);
        let placed = place_on_triangles(&triangles, count, seed).ok_or(MetricError::NoArea)?;
        let mut points: Vec<Vec3> = placed.into_iter().map(|(_, point)| point).collect();
        let mut used = vec![false; surface.vertices.len()];
        for &v in surface.faces.iter().flatten() {
            used[v as usize] = true;
        }
        points.extend(surface.vertices.iter().zip(used).filter(|&(_, u)| u).map(|(&v, _)| v));
        let spacing = (area(surface) / count as f64).sqrt();
        Ok(Self { pose, points, uniform: count, spacing })
    }

    /// A medial mesh with its spheres in the order of the pose, and the union of its primitives.
    pub fn ordered(&self, mesh: &MedialMesh) -> Result<(MedialMesh, MedialUnion), MetricError> {
        mesh.check().map_err(UnionError::from)?;
        let ordered = self.pose.in_order(mesh);
        // A refusal names a sphere by its number in the mesh as it was given.
        let union = MedialUnion::new(&ordered).or_else(|_| MedialUnion::new(mesh))?;
        Ok((ordered, union))
    }
}

/// The area of a surface.
fn area(surface: &TriMesh) -> f64 {
    let mut sum = Sum::default();
    for face in 0..surface.faces.len() {
        sum.add(area_of(&surface.triangle(face)));
    }
    sum.value()
}

fn area_of([a, b, c]: &[Vec3; 3]) -> f64 {
    (b - a).cross(c - a).length() * 0.5
}

/// Makes the random numbers differ from those of [`crate::surface::sample`] with the same seed. A
/// medial mesh has no error at the samples that it was made from, so it must not be measured there.
const STREAM: u64 = 0x6d65_6173_7572_6521;

/// `count` points, uniform by area and stratified along the list of triangles, each with the index of its
/// triangle; `None` when there is no area or it is not finite.
///
/// Stratified, unlike the independent points of [`crate::surface::Sampling::AreaUniform`]: means
/// have less variance, and small parts are not missed by chance.
pub(crate) fn place_on_triangles(
    triangles: &[[Vec3; 3]],
    count: usize,
    seed: u64,
) -> Option<Vec<(usize, Vec3)>> {
    let total: f64 = triangles.iter().map(area_of).sum();
    if !(total > 0.0 && total.is_finite()) {
        return None;
    }
    let mut rng = Pcg64::seed_from_u64(seed ^ STREAM);
    let mut placed = Vec::with_capacity(count);
    let (mut below, mut last) = (0.0, None);
    let mut target = rng.random::<f64>() / count as f64 * total;
    for (index, triangle) in triangles.iter().enumerate() {
        let size = area_of(triangle);
        below += size;
        while placed.len() < count && target < below {
            placed.push((index, uniform_in(triangle, &mut rng)));
            target = (placed.len() as f64 + rng.random::<f64>()) / count as f64 * total;
        }
        if size > 0.0 {
            last = Some(index);
        }
    }
    // The running sum may end a rounding below the total.
    while let (true, Some(index)) = (placed.len() < count, last) {
        placed.push((index, uniform_in(&triangles[index], &mut rng)));
    }
    Some(placed)
}

fn uniform_in(&[a, b, c]: &[Vec3; 3], rng: &mut Pcg64) -> Vec3 {
    // The root makes the density uniform: it compensates for rows that widen away from a corner.
    let root = rng.random::<f64>().sqrt();
    let v = rng.random::<f64>();
    a + (b - a) * (root * (1.0 - v)) + (c - a) * (root * v)
}

// A frame that moves along with a surface.
//
// Samples depend on axes and on the order of a list. With the coordinate axes and the order of the
// file, a rotation or another numbering of the same input would give other samples, and slightly
// other numbers. The axes and orders of the pose depend on the shape alone:
//
// 1. The origin `c` is the mean of the surface's vertices, summed in fixed point, so that it does not
//    depend on their order.
// 2. The first axis leads from `c` to the vertex `p` that is farthest from it, the second to the
//    vertex `q` that is farthest from that axis. Distances are weighted by the area around a
//    vertex (up to a tenth), so that the vertices of a round shape are not all equally far. The
//    third is the cross product, so reflected shapes have different poses.
// 3. A shape with symmetries has several such pairs, equal up to rounding. Then a function that is
//    neither odd nor even is summed over all triangles in each frame, and the frame with the least
//    sum is taken. Frames with equal sums are images of each other under a symmetry of the surface,
//    and the first by coordinates is taken. A medial mesh with the same symmetry gets the same
//    numbers in any of them. A medial mesh without it may be measured by other samples when both are
//    turned.
//
// All lists are ordered along a Morton curve in this frame. Its cells are offset from all round
// numbers, so that the rounding of a rotation hardly ever moves a point into another cell.

/// Relative difference up to which candidates are equally far.
const EQUAL: f64 = 1e-9;

/// Difference of sums over all triangles up to which frames are symmetric to each other.
const SYMMETRIC: f64 = 1e-10;

/// Bound on the number of candidates times the number of triangles. A polyhedral group has 120
/// elements, the rim of a solid of revolution some hundreds of vertices. Beyond the bound only the
/// first candidates by coordinates are compared. So for a million triangles with more than a hundred
/// symmetries the samples may depend on the orientation.
const MAX_COMPARISONS: usize = 1 << 27;

/// Bound on the second axes that are compared for each first axis, to bound the memory.
const MAX_SECOND_AXES: usize = 1024;

/// Axes and origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pose {
    origin: Vec3,
    /// Orthonormal, right-handed.
    axes: [Vec3; 3],
    /// Distance of the farthest vertex.
    size: f64,
}

impl Pose {
    /// The pose of a surface; along the coordinate axes if the surface has no extent. Linear time, for
    /// shapes with symmetries times their number.
    ///
    /// # Panics
    /// If a face names a vertex that does not exist.
    pub fn new(surface: &TriMesh) -> Self {
        let corners = Corners::new(surface);
        let origin = mean(&corners.points);
        let size = corners.points.iter().map(|p| p.distance(origin)).fold(0.0, f64::max);
        let world = Self { origin, axes: Vec3::AXES, size };
        if !(size > 0.0 && size.is_finite()) {
            return Self { size: 1.0, ..world };
        }
        let axes = corners.axes(origin, || centroids(surface, origin, size));
        Self { axes: axes.unwrap_or(Vec3::AXES), ..world }
    }

    /// The frame of the coordinates.
    pub fn coordinates() -> Self {
        Self { origin: Vec3::ZERO, axes: Vec3::AXES, size: 1.0 }
    }

    /// The axes.
    pub fn axes(&self) -> [Vec3; 3] {
        self.axes
    }

    /// Twice the distance of the farthest vertex from the origin: about as large as the diagonal of
    /// the bounding box, but independent of the orientation.
    pub fn diameter(&self) -> f64 {
        2.0 * self.size
    }

    /// The coordinates of a point.
    pub fn local(&self, p: Vec3) -> Vec3 {
        let d = p - self.origin;
        Vec3::from_array(self.axes.map(|axis| axis.dot(d)))
    }

    /// The point with these coordinates.
    pub fn world(&self, local: Vec3) -> Vec3 {
        let [x, y, z] = self.axes;
        self.origin + local.x * x + local.y * y + local.z * z
    }

    /// The corners of the surface's triangles, along the curve, each from its first corner along it.
    pub fn triangles(&self, surface: &TriMesh) -> Vec<[Vec3; 3]> {
        let mut triangles: Vec<(Place, [Vec3; 3])> = (0..surface.faces.len())
            .into_par_iter()
            .map(|face| {
                let mut corners = surface.triangle(face);
                let first = (0..3).min_by_key(|&i| self.place_of(corners[i]));
                corners.rotate_left(first.unwrap_or(0));
                (self.place_of((corners[0] + corners[1] + corners[2]) / 3.0), corners)
            })
            .collect();
        // Bits break ties of the place: an unstable sort needs a total order to be repeatable.
        triangles.par_sort_unstable_by_key(|(place, corners)| {
            (*place, corners.map(|c| c.to_array().map(f64::to_bits)))
        });
        triangles.into_iter().map(|(_, corners)| corners).collect()
    }

    /// The mesh with its spheres numbered along the curve: the same mesh, bit for bit, for any two
    /// numberings of it.
    pub fn in_order(&self, mesh: &MedialMesh) -> MedialMesh {
        let mut order: Vec<(Place, u32)> =
            (0..).zip(&mesh.spheres).map(|(v, s)| (self.place(s.centre, s.radius), v)).collect();
        // Spheres at one place differ in their bits, or are equal and keep their order.
        order.par_sort_by_key(|&(place, v)| {
            let s = &mesh.spheres[v as usize];
            (place, [s.centre.x, s.centre.y, s.centre.z, s.radius].map(f64::to_bits))
        });
        let order: Vec<u32> = order.into_iter().map(|(_, v)| v).collect();
        mesh.renumbered(&order)
    }

    /// Where a point is on the curve.
    pub fn place_of(&self, p: Vec3) -> Place {
        self.place(p, 0.0)
    }

    /// The cell of a sphere: a millionth of the size along the curve, and as much in the radius.
    ///
    /// A motion that rounds otherwise moves a sphere into another cell as rarely as rounding is small
    /// compared to a cell.
    pub fn cell(&self, p: Vec3, radius: f64) -> [u64; 2] {
        let scaled = |v: Vec3| v / (3.0 * self.size) + OFFSET;
        let cells = (1_u64 << 21) as f64;
        let radius = scaled(Vec3::splat(radius)).x * cells;
        [morton_code(scaled(self.local(p)) * cells), radius as u64]
    }

    /// The place of a point on the curve; within a cell finer coordinates decide, then the radius.
    fn place(&self, p: Vec3, radius: f64) -> Place {
        // From 0.17 to 0.83: the surface is inside the curve's cube, with room around it.
        let local = self.local(p) / (3.0 * self.size) + OFFSET;
        let fine = [local.x, local.y, local.z, radius / self.size + OFFSET.x];
        Place {
            code: morton_code(local * (1_u64 << 21) as f64),
            fine: fine.map(|c| (c * FINE) as i64),
        }
    }
}

/// A half plus a little, so that the cells of the curve do not start at simple fractions.
const OFFSET: Vec3 = Vec3::new(0.500_731_923_846_1, 0.500_263_847_195_7, 0.500_519_283_746_3);

/// Resolution of the finer coordinates: far coarser than rounding, far finer than any sample.
const FINE: f64 = (1_u64 << 38) as f64;

/// A place on the curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Place {
    code: u64,
    fine: [i64; 4],
}

/// The vertices that faces use.
struct Corners {
    points: Vec<Vec3>,
    /// From 1 to 1.1, growing with the area around the vertex.
    weights: Vec<f64>,
}

impl Corners {
    fn new(surface: &TriMesh) -> Self {
        let mut around = vec![None; surface.vertices.len()];
        for (face, corners) in surface.faces.iter().enumerate() {
            let [a, b, c] = surface.triangle(face);
            let area = (b - a).cross(c - a).length();
            for &v in corners {
                *around[v as usize].get_or_insert(0.0) += area;
            }
        }
        let (points, areas): (Vec<Vec3>, Vec<f64>) = surface
            .vertices
            .iter()
            .zip(&around)
            .filter_map(|(&p, area)| Some((p, (*area)?)))
            .unzip();
        let mean = areas.iter().sum::<f64>() / areas.len().max(1) as f64;
        let mut weights = areas;
        for weight in &mut weights {
            *weight = if mean > 0.0 { 1.0 + 0.1 * *weight / (*weight + mean) } else { 1.0 };
        }
        Self { points, weights }
    }

    /// The points at the largest weighted distance, by coordinates.
    fn farthest(&self, distance: impl Fn(Vec3) -> f64 + Sync) -> Vec<Vec3> {
        let weighted = self.points.iter().zip(&self.weights);
        let far: Vec<f64> = weighted.map(|(&p, w)| distance(p) * w).collect();
        let most = far.iter().copied().fold(0.0, f64::max);
        let mut farthest = self.points.clone();
        let mut far = far.into_iter();
        farthest
            .retain(|_| most > 0.0 && far.next().is_some_and(|far| far >= most * (1.0 - EQUAL)));
        farthest.sort_unstable_by(by_coordinates);
        farthest.dedup();
        farthest
    }
}

fn by_coordinates(a: &Vec3, b: &Vec3) -> Ordering {
    let pairs = a.to_array().into_iter().zip(b.to_array());
    pairs.map(|(a, b)| a.total_cmp(&b)).fold(Ordering::Equal, Ordering::then)
}

/// The mean of some points, the same for any order of them.
fn mean(points: &[Vec3]) -> Vec3 {
    let largest = points.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
    // Integers up to 2^62, of which 2^65 can be summed.
    let unit = largest / (1_u64 << 62) as f64;
    if !(unit > 0.0 && unit.is_finite()) {
        return Vec3::ZERO;
    }
    let mut sum = [0_i128; 3];
    for p in points {
        for (sum, c) in sum.iter_mut().zip(p.to_array()) {
            *sum += (c / unit).round() as i128;
        }
    }
    Vec3::from_array(sum.map(|s| s as f64 / points.len() as f64 * unit))
}

/// The centroids of a surface's triangles from the origin, in units of the size.
fn centroids(surface: &TriMesh, origin: Vec3, size: f64) -> Vec<Vec3> {
    let faces = (0..surface.faces.len()).map(|f| surface.triangle(f));
    faces.map(|[a, b, c]| ((a + b + c) / 3.0 - origin) / size).collect()
}

impl Corners {
    /// Steps 2 and 3; `marks` gives the points that break ties, computed only if there are ties.
    fn axes(&self, origin: Vec3, marks: impl Fn() -> Vec<Vec3>) -> Option<[Vec3; 3]> {
        let marks = LazyCell::new(marks);
        let first = self.farthest(|v| v.distance(origin));
        let first = first.into_iter().filter_map(|p| (p - origin).try_normalize()).collect();
        // A function that is the same all around the axis, since the other two are not yet chosen.
        let first = least(
            first,
            || &*marks,
            |axis: &Vec3, d| {
                let along = axis.dot(d);
                1.732 * along + 2.236 * (d.length_squared() - along * along)
            },
        );
        let most = (MAX_COMPARISONS / self.points.len()).max(1);
        let frames = first[..first.len().min(most)]
            .par_iter()
            .flat_map_iter(|&x| {
                let second = self.farthest(|v| (v - origin).reject_from_normalized(x).length());
                second.into_iter().take(MAX_SECOND_AXES).filter_map(move |v| {
                    let y = (v - origin).reject_from_normalized(x).try_normalize()?;
                    Some([x, y, x.cross(y)])
                })
            })
            .collect();
        let frames = least(
            frames,
            || &*marks,
            |[x, y, z]: &[Vec3; 3], d| {
                (1.732 * *x + 2.236 * *y - 1.26 * *z).dot(d) + d.length_squared()
            },
        );
        frames.first().copied()
    }
}

/// Of several candidates those with the least sum over all marks, up to rounding. The summed function
/// of `argument` is neither odd nor even, so that reflected frames differ.
fn least<'m, T: Copy + Send + Sync>(
    mut candidates: Vec<T>,
    marks: impl Fn() -> &'m Vec<Vec3>,
    argument: impl Fn(&T, Vec3) -> f64 + Send + Sync,
) -> Vec<T> {
    if candidates.len() < 2 {
        return candidates;
    }
    let marks = marks();
    candidates.truncate((MAX_COMPARISONS / marks.len().max(1)).max(1));
    let values: Vec<f64> = candidates
        .par_iter()
        .map(|candidate| {
            // Corrected sums: equal frames must agree to SYMMETRIC over millions of triangles.
            let mut sum = Sum::default();
            for &d in marks {
                let t = argument(candidate, d);
                sum.add(t / (2.0 + t * t));
            }
            sum.value()
        })
        .collect();
    let most = values.iter().copied().fold(f64::INFINITY, f64::min) + SYMMETRIC;
    let pairs = candidates.into_iter().zip(values);
    pairs.filter(|&(_, value)| value <= most).map(|(candidate, _)| candidate).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::{Sampling, sample};

    #[test]
    fn nothing_is_measured_where_it_was_sampled() {
        let surface = TriMesh {
            vertices: vec![Vec3::ZERO, Vec3::X, Vec3::ONE, Vec3::Y],
            faces: vec![[0, 1, 2], [0, 2, 3]],
        };
        let sampled = sample(&surface, &Sampling::AreaUniform { count: 500, seed: 3 });
        let measured = SurfaceSamples::new(&surface, 500, 3).unwrap();
        assert_eq!((measured.uniform, measured.points.len()), (500, 504));
        let apart = |p: &&Vec3| sampled.iter().all(|q| p.distance(*q) > 1e-9);
        assert_eq!(measured.points[..500].iter().filter(apart).count(), 500);
    }
}
