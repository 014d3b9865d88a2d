//! The average outward flux through one sphere, without two-sided fans, and the move of a voxel's
//! centre onto the axis.
//!
//! # Flux
//! With `g` the gradient of the distance at a sample and `a = g . N`:
//!
//! - Closest point on a face, a flat or a convex edge: the sample adds `a`.
//! - Closest point `B` on a concave edge or vertex, a *fan*. Its opposite `p' = p - 2 sigma a g` lies
//!   on the line through `B` and `p`.
//!   - `a >= 0`: `p'` lies between `B` and `p`, and so has the same closest point; two-sided.
//!   - `a < 0`: `p'` lies beyond `p`. The closest point of `p'` is on the same straight edge only if
//!     it is `B` itself, since `B` is the foot of the perpendicular from both. So the fan is
//!     two-sided if and only if no point of the surface is nearer to `p'` than `B`.
//!
//!   A two-sided sample adds nothing; a one-sided one adds `a`.
//!
//! The sum is divided by the number of all samples. They lie along a spiral: E. B. Saff, A. B. J.
//! Kuijlaars, *Distributing many points on a sphere*, The Mathematical Intelligencer 19(1), 1997,
//! doi:10.1007/BF03024331 (the paper prints 1991).
//!
//! # Onto the axis
//! S. Stolpner, S. Whitesides, K. Siddiqi, *Sampled medial loci for 3D shape representation*,
//! Computer Vision and Image Understanding 115(5), 2011, doi:10.1016/j.cviu.2010.10.014: a point
//! between a sample and its opposite whose closest points differ is localised by bisection.
//!
//! 1. A sample `p` with `a < 0` and closest point `B` looks into the sphere along the ray from `B`
//!    through `p`. Up to the axis, `B` stays the closest point of the points of the ray.
//! 2. If `B` is no longer the closest point of the opposite `p'` of `p`, the axis lies between. The
//!    last point `x` with `D(x) = |x - B|` is found by cutting an interval: if a point of the ray is
//!    nearer to some `B'`, so is the whole ray beyond the bisector plane of `B` and `B'`, and the
//!    interval ends there. It is halved only when that is slow.
//! 3. The ball of radius `D(x)` around `x` is inside the solid. It touches the surface at `B` and,
//!    within the tolerance, at a second point `B'`. Of the samples whose rays pass closest to the
//!    centre, the one whose `B`, `B'` subtend the largest angle is taken.

use std::f64::consts::TAU;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use medial::Vec3;
use medial::complex::Sphere as Ball;
use medial::geometry::planar_frame::PlanarFrame;
use medial::shape::Shape;
use medial::simplifier::RunContext;
use medial::surface::{Closest, Feature, InsideTest, TriMesh, TriangleBvh, Vicinity};
use rayon::prelude::*;

use crate::Result;

/// How samples lie on a sphere.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Spiral {
    /// Heights `-1 + (2k - 1) / N`, in the middle of zones of equal area.
    EqualArea,
    /// Heights `-1 + 2 (k - 1) / (N - 1)`, from pole to pole, as published.
    Classic,
}

impl Spiral {
    /// `count` unit vectors from the south pole up: each longitude is the one before plus
    /// `3.6 / sqrt(N (1 - h^2))`, and 0 at a pole.
    pub fn directions(self, count: usize) -> Vec<Vec3> {
        let n = count as f64;
        let mut longitude = 0.0_f64;
        (0..count)
            .map(|k| {
                let k = k as f64;
                let height = match self {
                    Self::EqualArea => -1.0 + (2.0 * k + 1.0) / n,
                    Self::Classic if count == 1 => -1.0,
                    Self::Classic => -1.0 + 2.0 * k / (n - 1.0),
                };
                let across = (1.0 - height * height).max(0.0).sqrt();
                let at_pole = across < 1e-9;
                longitude = if k == 0.0 || at_pole {
                    0.0
                } else {
                    (longitude + 3.6 / (n.sqrt() * across)) % TAU
                };
                Vec3::new(across * longitude.cos(), across * longitude.sin(), height)
            })
            .collect()
    }
}

/// The samples of one level.
#[derive(Clone, Debug)]
pub struct Sphere {
    /// Unit vectors.
    pub directions: Vec<Vec3>,
    /// `sigma`.
    pub radius: f64,
    /// Length of the mean direction: the largest flux of a constant unit field, which should be 0.
    pub bias: f64,
}

impl Sphere {
    /// `count` samples on a sphere of radius `sigma`.
    pub fn new(spiral: Spiral, count: usize, radius: f64) -> Self {
        let directions = spiral.directions(count);
        let bias = (directions.iter().sum::<Vec3>() / count as f64).length();
        Self { directions, radius, bias }
    }
}

/// Sine of the dihedral deviation below which two faces are coplanar.
const COPLANAR: f64 = 1e-7;
/// Relative distance by which the surface has to be nearer to the opposite of a one-sided sample.
const SAME: f64 = 1e-10;
/// Bound on the rounding error of a flux, also as a number in single precision.
const ROUNDING: f64 = 1e-6;
/// Triangles near a sphere up to which a list of them is faster for its samples than the tree.
pub(super) const FEW: usize = 192;
/// As [`FEW`], for a list that also serves the voxels inside, of spheres of at most [`SMALL`].
pub(super) const MANY: usize = 768;
/// Radius above which a sphere mostly has more than [`MANY`] triangles near it, a fraction of the diagonal.
pub(super) const SMALL: f64 = 0.025;
/// Cosine of the angle to the gradient above which samples are measured first.
const STEEP: f64 = 0.6;

/// A closed, outward-oriented surface, seen from inside.
///
/// Features differ in their effect on the distance there. A *fan* feature is a concave edge or a vertex
/// of one: it is the closest point of a whole wedge of space. Edges between coplanar faces, convex
/// edges, and vertices without a concave edge are the closest point of points straight above them only,
/// as any other point of their faces.
pub struct Surface {
    tree: Arc<TriangleBvh>,
    pub(super) inside: Arc<InsideTest>,
    /// For each face: bit `k` if side `k` is concave, bit `3 + k` if corner `k` ends a concave side.
    fans: Vec<u8>,
}

impl Surface {
    /// That of a shape.
    ///
    /// # Errors
    /// When it has no face.
    pub fn of(shape: &Shape) -> Result<Self> {
        let (tree, inside) = (shape.surface_tree()?, shape.inside_test());
        Ok(Self { tree, inside, fans: fans(shape.mesh()) })
    }

    /// The closest point. The search is faster with a face near to the point as `start`.
    pub fn closest(&self, p: Vec3, start: Option<u32>) -> Closest {
        self.tree.closest_from(p, start)
    }

    fn is_fan(&self, closest: &Closest) -> bool {
        let fans = self.fans[closest.face as usize];
        match closest.feature {
            Feature::Face => false,
            Feature::Edge(k) => fans >> k & 1 == 1,
            Feature::Vertex(k) => fans >> (3 + k) & 1 == 1,
        }
    }

    /// `AOF'` through a sphere around a centre, whose closest face is `start`.
    pub fn flux(&self, sphere: &Sphere, centre: Vec3, start: u32) -> f64 {
        let foot = self.closest(centre, Some(start));
        let near = self.near(centre, sphere.radius, &foot, FEW);
        near.flux(sphere, centre, &foot, f64::INFINITY).expect("no flux is larger")
    }

    /// The surface near a ball, as [`TriangleBvh::vicinity`].
    pub(super) fn near(&self, centre: Vec3, radius: f64, foot: &Closest, most: usize) -> Near<'_> {
        Near { surface: self, vicinity: self.tree.vicinity(centre, radius, foot, most) }
    }
}

/// The surface near a ball.
pub(super) struct Near<'a> {
    surface: &'a Surface,
    vicinity: Option<Vicinity<'a>>,
}

impl Near<'_> {
    /// That of a ball inside this one.
    pub fn within(&self, centre: Vec3, radius: f64, foot: &Closest, most: usize) -> Self {
        let Some(vicinity) = &self.vicinity else {
            return self.surface.near(centre, radius, foot, most);
        };
        Self { surface: self.surface, vicinity: vicinity.narrowed(centre, radius, foot, most) }
    }

    /// The closest point to a point of the ball. The search is faster with a face `start` near to it.
    pub fn closest(&self, p: Vec3, start: u32) -> Closest {
        match &self.vicinity {
            Some(vicinity) => vicinity.closest_from(p, start),
            None => self.surface.closest(p, Some(start)),
        }
    }

    /// The closest point to a point of the ball, if it is not farther away than `bound`.
    fn closest_within(&self, p: Vec3, bound: f64) -> Option<Closest> {
        match &self.vicinity {
            Some(vicinity) => vicinity.closest_within(p, bound),
            None => self.surface.tree.closest_within_from(p, bound, None),
        }
    }

    /// `AOF'` through a sphere around the centre of the ball, whose closest point is `foot`. None only if
    /// it is larger than `most`.
    pub fn flux(&self, sphere: &Sphere, centre: Vec3, foot: &Closest, most: f64) -> Option<f64> {
        let count = sphere.directions.len() as f64;
        // Samples that follow each other are neighbours, mostly with the same closest face.
        let mut face = foot.face;
        let known = self.vicinity.as_ref().and_then(Vicinity::gradient);
        let Some((gradient, spread)) = known.filter(|_| most < f64::INFINITY) else {
            let adds = sphere.directions.iter();
            let adds = adds.map(|&n| self.contribution(sphere.radius, centre, n, &mut face));
            return Some(adds.sum::<f64>() / count);
        };
        // The distance to a triangle is convex, so its slope along `N` is at the sample no less than in
        // the centre, where its gradient differs from that of the closest one by at most the spread.
        let slopes: Vec<f64> = sphere.directions.iter().map(|n| gradient.dot(*n)).collect();
        let least = |slope: f64| {
            // Two unit vectors differ by `d` mostly across, and by `d² / 2` along either.
            let across = (1.0 - slope * slope).max(0.0).sqrt();
            let turned = spread * across + 0.5 * spread * spread * slope.max(0.0);
            (slope - turned).clamp(-1.0, 0.0)
        };
        let mut sum: f64 = slopes.iter().map(|&slope| least(slope)).sum();
        let limit = (most + ROUNDING) * count;
        let mut adds = vec![0.0; slopes.len()];
        // Steep ones first, as they raise the sum most: outward ones of faces, inward ones of fans.
        let outward = if self.surface.is_fan(foot) { -1.0 } else { 1.0 };
        for (from, to) in [(STEEP, 2.0), (-2.0, -STEEP), (-STEEP, STEEP)] {
            for (k, &slope) in slopes.iter().enumerate() {
                let outward = outward * slope;
                if outward < from || outward >= to {
                    continue;
                }
                let normal = sphere.directions[k];
                adds[k] = self.contribution(sphere.radius, centre, normal, &mut face);
                sum += adds[k] - least(slope);
                if sum > limit {
                    return None;
                }
            }
        }
        Some(adds.iter().sum::<f64>() / count)
    }

    /// The summand of one sample. `face` is one near to it before, and the closest one after.
    fn contribution(&self, radius: f64, centre: Vec3, normal: Vec3, face: &mut u32) -> f64 {
        let p = centre + normal * radius;
        let closest = self.closest(p, *face);
        *face = closest.face;
        let gradient = gradient(p, &closest);
        let along = gradient.dot(normal);
        let adds = !self.surface.is_fan(&closest) || {
            let step = -2.0 * radius * along;
            let bound = (closest.distance + step) * (1.0 - SAME);
            along < 0.0 && self.closest_within(p + gradient * step, bound).is_some()
        };
        if adds { along } else { 0.0 }
    }
}

/// Gradient of the distance: the unit vector from the closest point; zero on the surface.
fn gradient(p: Vec3, closest: &Closest) -> Vec3 {
    (p - closest.point).try_normalize().unwrap_or(Vec3::ZERO)
}

/// See [`Surface::fans`].
fn fans(mesh: &TriMesh) -> Vec<u8> {
    let mut sides: Vec<([u32; 2], u32, usize)> = Vec::with_capacity(3 * mesh.faces.len());
    for (face, corners) in (0..).zip(&mesh.faces) {
        for k in 0..3 {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            sides.push(([a.min(b), a.max(b)], face, k));
        }
    }
    sides.sort_unstable();
    let mut fans = vec![0_u8; mesh.faces.len()];
    let mut ends_concave = vec![false; mesh.vertices.len()];
    for edge in sides.chunk_by(|a, b| a.0 == b.0) {
        let is_concave = match *edge {
            [(_, f, k), (_, g, _)] => {
                let corners = mesh.faces[f as usize];
                let [a, b] = [k, (k + 1) % 3].map(|k| mesh.vertices[corners[k] as usize]);
                let [n, m] = [f, g].map(|f| PlanarFrame::new(mesh.triangle(f as usize)).0.normal);
                let sine = n.cross(m).dot((b - a).normalize_or_zero());
                sine < -COPLANAR || (sine <= COPLANAR && n.dot(m) < 0.0)
            }
            _ => true,
        };
        if is_concave {
            edge.iter().for_each(|&(_, face, k)| fans[face as usize] |= 1 << k);
            edge[0].0.iter().for_each(|&vertex| ends_concave[vertex as usize] = true);
        }
    }
    for (fans, corners) in fans.iter_mut().zip(&mesh.faces) {
        for (k, &vertex) in corners.iter().enumerate() {
            *fans |= u8::from(ends_concave[vertex as usize]) << (3 + k);
        }
    }
    fans
}

/// Limit of the samples that are followed onto the axis.
const FOLLOWED_SAMPLES: usize = 4;
/// Width of the last interval, in radii of the voxel's sphere.
const TOLERANCE: f64 = 1e-9;
/// Relative distance by which another closest point of a ray has to be nearer.
const SAME_ON_RAY: f64 = 1e-12;
/// Cuts of an interval for each one that halves it.
const HALVING: u32 = 4;
/// Voxels between two reports of progress.
const TASK: usize = 256;

/// A ball on the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refined {
    /// The ball: its radius is the distance of its centre to the surface.
    pub ball: Ball,
    /// Two closest points, the second within the tolerance; the same point twice if the centre was
    /// not moved.
    pub contacts: [Vec3; 2],
}

impl Refined {
    /// Distance of the contacts in radii: it grows with the angle that they subtend.
    fn subtended(&self) -> f64 {
        self.contacts[0].distance(self.contacts[1]) / self.ball.radius
    }
}

impl Surface {
    /// The balls on the axis near `centres`; around the centre itself if no sample and its opposite
    /// have different closest points.
    ///
    /// # Errors
    /// When the run was cancelled.
    pub fn refine(
        &self,
        sphere: &Sphere,
        centres: &[Vec3],
        run: &RunContext,
    ) -> Result<Vec<Refined>> {
        let done = AtomicUsize::new(0);
        let parts: Result<Vec<Vec<Refined>>> = centres
            .par_chunks(TASK)
            .map(|centres_of_task| {
                let refined = centres_of_task.iter().map(|&c| self.refined(sphere, c)).collect();
                let before = done.fetch_add(centres_of_task.len(), Ordering::Relaxed);
                run.step(before + centres_of_task.len(), centres.len())?;
                Ok(refined)
            })
            .collect();
        Ok(parts?.concat())
    }

    fn refined(&self, sphere: &Sphere, centre: Vec3) -> Refined {
        let own = self.closest(centre, None);
        let near = self.near(centre, sphere.radius, &own, FEW);
        let mut face = own.face;
        let mut rays = Vec::with_capacity(sphere.directions.len());
        for &normal in &sphere.directions {
            let start = centre + normal * sphere.radius;
            let closest = near.closest(start, face);
            face = closest.face;
            let gradient = gradient(start, &closest);
            let along = gradient.dot(normal);
            if along < 0.0 {
                rays.push((along, Ray { near: &near, start, gradient, closest }));
            }
        }
        // Most inward first: these rays pass closest to the centre. Stable, so ties are by sample.
        rays.sort_by(|a, b| a.0.total_cmp(&b.0));
        let found = rays
            .iter()
            .filter_map(|(along, ray)| {
                let length = -2.0 * sphere.radius * along;
                let (centre, contacts) = ray.localise(length, TOLERANCE * sphere.radius)?;
                let distance = near.closest(centre, ray.closest.face).distance;
                Some(Refined { ball: Ball::new(centre, distance), contacts })
            })
            .take(FOLLOWED_SAMPLES);
        // The first of equal ones.
        found
            .reduce(|best, next| if next.subtended() > best.subtended() { next } else { best })
            .unwrap_or(Refined { ball: Ball::new(centre, own.distance), contacts: [own.point; 2] })
    }
}

/// The ray from a closest point through its sample.
struct Ray<'a> {
    near: &'a Near<'a>,
    start: Vec3,
    gradient: Vec3,
    /// The closest point of the start.
    closest: Closest,
}

impl Ray<'_> {
    /// The closest point of the surface to the point of the ray `t` behind the sample, if it is
    /// nearer than the foot.
    fn other(&self, t: f64) -> Option<Vec3> {
        let bound = (self.closest.distance + t) * (1.0 - SAME_ON_RAY);
        let q = self.start + self.gradient * t;
        self.near.closest_within(q, bound).map(|other| other.point)
    }

    /// Step 2: the point and its two closest points.
    fn localise(&self, length: f64, tolerance: f64) -> Option<(Vec3, [Vec3; 2])> {
        let mut second = self.other(length)?;
        let (mut low, mut high) = (0.0, length);
        for cut in 1_u32.. {
            // Where the ray is equally far from the foot and from the other point.
            let apart = second - self.closest.point;
            let even =
                0.5 * apart.length_squared() / self.gradient.dot(apart) - self.closest.distance;
            high = even.clamp(low, high);
            if high - low <= tolerance {
                break;
            }
            // Just below the cut succeeds at once if no third point interferes.
            let in_the_middle = cut.is_multiple_of(HALVING);
            let at = if in_the_middle { low.midpoint(high) } else { high - tolerance };
            if !(low < at && at < high) {
                break;
            }
            match self.other(at) {
                Some(point) => (high, second) = (at, point),
                None => low = at,
            }
        }
        Some((self.start + self.gradient * low, [self.closest.point, second]))
    }
}

#[cfg(test)]
mod tests {
    use medial::surface::Side;

    use super::*;

    #[test]
    fn only_the_reflex_edge_and_its_vertices_are_fans() {
        let shape = crate::test_shape("bracket", 16);
        let mesh = medial_datasets::find("bracket").expect("in the catalogue").mesh(16);
        let surface = Surface::of(&shape).expect("faces");
        let is_fan = |p| surface.is_fan(&surface.closest(shape.normalisation().forward(p), None));
        // Away from the ends of the bracket, which are nearer than anything else there.
        let middle = || mesh.vertices.iter().filter(|v| v.y > 0.1 && v.y < 0.9);
        // Over the reflex edge at (0.4, 0.4), between its vertices and at each of them.
        let at_vertex = middle().filter(|v| v.x == 0.4 && v.z == 0.4).map(|v| v.y);
        assert!(at_vertex.clone().count() > 1);
        for y in at_vertex.chain([0.33, 0.51]) {
            assert!(is_fan(Vec3::new(0.35, y, 0.35)), "{y}");
        }
        // Under the top of the wall; next to the inner wall, over its flat edges too.
        let flat = middle().filter(|v| v.x == 0.4 && v.z > 0.41 && v.z < 1.4);
        assert!(flat.clone().count() > 1);
        for p in flat.map(|v| v - Vec3::X * 0.05).chain([Vec3::new(0.2, 0.5, 1.45)]) {
            assert!(!is_fan(p), "{p:?}");
        }
    }

    #[test]
    fn a_flux_is_left_out_only_if_it_is_larger() {
        let sphere = Sphere::new(Spiral::EqualArea, 50, 0.01);
        let (mut small, mut left_out) = (0, 0);
        for name in ["bracket", "torus"] {
            let shape = crate::test_shape(name, 16);
            let surface = Surface::of(&shape).expect("faces");
            let (lo, hi) = shape.mesh().bounding_box().expect("vertices");
            for k in 0..24_u32.pow(3) {
                let at = [k % 24, k / 24 % 24, k / 576].map(|i| (f64::from(i) + 0.5) / 24.0);
                let centre = lo + Vec3::from(at) * (hi - lo);
                let foot = surface.closest(centre, None);
                let is_inside = surface.inside.side(centre) == Side::Inside;
                if !is_inside || foot.distance < sphere.radius {
                    continue;
                }
                let near = surface.near(centre, sphere.radius, &foot, FEW);
                let flux = surface.flux(&sphere, centre, foot.face);
                for most in [-0.4, -0.2, 0.0] {
                    let found = near.flux(&sphere, centre, &foot, most);
                    assert!(found.map_or(flux > most, |found| found == flux), "{centre} {flux}");
                    small += usize::from(flux <= most);
                    left_out += usize::from(found.is_none());
                }
            }
        }
        assert!(small > 300 && left_out > 3000, "{small} {left_out}");
    }

    /// Largest deviation of the flux through a sphere whose centre is on a sheet, over many
    /// orientations of the sheet.
    fn error_on_planes(spiral: Spiral, count: usize) -> f64 {
        let points = spiral.directions(count);
        let normals = Spiral::EqualArea.directions(4001);
        let inward = normals.iter().map(|n| points.iter().map(|p| p.dot(*n).abs()).sum::<f64>());
        inward.map(|sum| (0.5 - sum / count as f64).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn quadrature_errors_on_planes_are_those_of_the_literature() {
        for (count, classic, equal) in [(50, 0.018, 0.011), (60, 0.013, 0.008), (70, 0.011, 0.007)]
        {
            let [c, e] = [Spiral::Classic, Spiral::EqualArea].map(|s| error_on_planes(s, count));
            // The published maxima are over random planes, to three digits after the point.
            assert!((c - classic).abs() < 1.5e-3, "classic {count}: {c}");
            assert!((e - equal).abs() < 1.5e-3, "equal area {count}: {e}");
        }
        assert!(error_on_planes(Spiral::EqualArea, 500) < 0.002);
    }

    #[test]
    fn points_are_on_the_sphere_and_the_classic_ones_reach_the_poles() {
        for spiral in [Spiral::Classic, Spiral::EqualArea] {
            for count in [1, 2, 3, 50, 1000] {
                let points = spiral.directions(count);
                assert_eq!(points.len(), count);
                assert!(points.iter().all(|p| (p.length() - 1.0).abs() < 1e-12));
            }
        }
        let classic = Spiral::Classic.directions(60);
        assert_eq!([classic[0].z, classic[59].z], [-1.0, 1.0]);
    }
}
