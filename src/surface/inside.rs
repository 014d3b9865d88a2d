//! The inside test: an exact winding number from the crossings of a vertical ray.
//!
//! For a closed, oriented surface the winding number of `p` is the number of faces above `p` that
//! look up, minus the number of those that look down (the degree of the surface around `p`). It is
//! correct for surfaces that overlap themselves, for several components and for cavities: a point is
//! inside if and only if its winding number is at least 1.
//!
//! 1. The ray starts at `p = (x, y, z)` and goes up. Degenerate hits of edges and vertices are
//!    resolved by moving the ray, not the surface: it runs through `(x + e, y + e^2)` for an
//!    infinitesimal `e` (H. Edelsbrunner, E. P. Muecke, Simulation of simplicity,
//!    10.1145/77635.77639). With `d = orient2d(a, b, p)` a tie `d = 0` is decided by the sign of
//!    `a.y - b.y`, then of `b.x - a.x`: the derivatives of `d` along `e` and `e^2`.
//!    Neighbouring faces see opposite signs for their common edge, so exactly one of them is hit.
//! 2. The sign of `orient3d` decides whether a face is above `p`. If it is zero and `p` is within the
//!    face, `p` lies on the surface, where there is no winding number.
//! 3. A tree of boxes, tested four at a time and rounded outward, finds the faces: those whose box
//!    reaches above `p` and contains `(x, y)`.
//!
//! All signs are exact for coordinates above 2^-150 of the largest; smaller ones are taken as
//! zero, in the surface and in the queries.

use std::ops::ControlFlow;

use super::closest::TriangleBvh;
use super::mesh::{TriMesh, Unit};
use crate::Vec3;
use crate::geometry::predicates::{Point2, Sign, orient2d, orient3d, project, projection_axis};
use crate::geometry::trees::{Bounds, Plan, Tree, WideTree, in_morton_order};

/// Triangles of a leaf.
const LEAF: usize = 4;

/// Where a point lies with respect to a closed surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Side {
    /// The winding number is at least 1.
    Inside,
    /// On the surface, exactly.
    On,
    /// The winding number is 0 or negative.
    Outside,
}

/// Exact classification of points against one closed, outward-oriented surface.
///
/// ```
/// use medial::{Vec3, surface};
///
/// let cube = surface::read_bytes(
///     b"OFF 8 6 12\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n\
///       4 0 3 2 1\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n",
///     surface::Format::Off,
/// )?;
/// let test = surface::InsideTest::new(&cube.mesh);
/// assert_eq!(test.side(Vec3::splat(0.5)), surface::Side::Inside);
/// assert_eq!(test.side(Vec3::new(0.5, 0.5, 1.0)), surface::Side::On);
/// assert_eq!(test.winding_number(Vec3::splat(2.0)), Some(0));
/// # Ok::<(), surface::SurfaceError>(())
/// ```
#[derive(Debug)]
pub struct InsideTest {
    unit: Unit,
    tree: WideTree,
    /// In leaf order, scaled.
    triangles: Vec<[Vec3; 3]>,
    /// For each place in leaf order the face.
    ids: Vec<u32>,
    /// Box of everything, scaled.
    bounds: Bounds,
}

impl InsideTest {
    /// Prepares the test. `O(F log F)`.
    ///
    /// The results are meaningful only for a closed, consistently oriented surface.
    ///
    /// # Panics
    /// If a face names a vertex that does not exist.
    pub fn new(mesh: &TriMesh) -> Self {
        let unit = Unit::of(&mesh.vertices);
        Self::of_scaled(unit, &unit.forward_all(&mesh.vertices), &mesh.faces)
    }

    /// The same for points that are scaled already.
    pub(super) fn of_scaled(unit: Unit, points: &[Vec3], faces: &[[u32; 3]]) -> Self {
        let corners: Vec<_> = faces.iter().map(|face| face.map(|v| points[v as usize])).collect();
        let boxes: Vec<_> = corners.iter().map(|&t| (Bounds::of_points(t), 0.0)).collect();
        let tree = Tree::build(&boxes, Plan { max_leaf: LEAF, group: LEAF, padding: 0.0 });
        let ids = tree.order().to_vec();
        let triangles = ids.iter().map(|&face| corners[face as usize]).collect();
        Self { unit, tree: WideTree::new(&tree), triangles, ids, bounds: tree.bounds() }
    }

    /// How often the surface winds around a point, or `None` for a point on the surface.
    ///
    /// Typically `O(log F)`.
    pub fn winding_number(&self, p: Vec3) -> Option<i32> {
        self.winding_of_scaled(self.unit.forward(p))
    }

    /// The same for a point that is scaled already.
    #[inline]
    pub(super) fn winding_of_scaled(&self, p: Vec3) -> Option<i32> {
        let mut winding = Some(0);
        self.crossings(p, |_, crossing| match crossing {
            Crossing::Above(sign) => {
                winding = winding.map(|w| w + sign);
                ControlFlow::Continue(())
            }
            Crossing::On => {
                winding = None;
                ControlFlow::Break(())
            }
        });
        winding
    }

    /// Inside, on or outside. Typically `O(log F)`.
    pub fn side(&self, p: Vec3) -> Side {
        match self.winding_number(p) {
            None => Side::On,
            Some(winding) if winding >= 1 => Side::Inside,
            Some(_) => Side::Outside,
        }
    }

    /// [`Self::side`] of many points, in parallel and in an order that suits the cache.
    pub fn sides(&self, points: &[Vec3]) -> Vec<Side> {
        in_morton_order(points, |(): &mut (), p| self.side(p))
    }

    /// Reports every face that is above the scaled point `p`, or holds it.
    #[inline]
    pub(super) fn crossings(
        &self,
        p: Vec3,
        mut report: impl FnMut(u32, Crossing) -> ControlFlow<()>,
    ) {
        // Below everything a closed surface is crossed as often upward as downward.
        let Bounds { lo, hi } = self.bounds;
        if !(p.cmpge(lo).all() && p.cmple(hi).all()) {
            return;
        }
        self.tree.above(p, |places| {
            places.into_iter().try_for_each(|place| {
                let triangle = self.triangles[place as usize];
                let Bounds { lo, hi } = Bounds::of_points(triangle);
                // Without branches: a box of the tree holds four triangles, and most miss.
                let is_beside = (p.x < lo.x) | (hi.x < p.x) | (p.y < lo.y) | (hi.y < p.y);
                if is_beside | (hi.z < p.z) {
                    return ControlFlow::Continue(());
                }
                match crossing(triangle, lo.z, p) {
                    Some(crossing) => report(self.ids[place as usize], crossing),
                    None => ControlFlow::Continue(()),
                }
            })
        });
    }
}

/// How the ray from `p` meets a triangle whose box contains `p` in `x` and `y` and starts at height
/// `low`.
#[inline]
fn crossing(triangle: [Vec3; 3], low: f64, p: Vec3) -> Option<Crossing> {
    let looks_up = crossed_by_column(triangle, p);
    // Below the box the whole triangle is above, which spares the test in space.
    if p.z >= low {
        let [a, b, c] = triangle;
        // Positive on the side that the face looks at.
        let height = orient3d(a, b, c, p);
        if height.is_zero() && contains(triangle, p) {
            return Some(Crossing::On);
        }
        return (looks_up * height.value() < 0).then_some(Crossing::Above(looks_up));
    }
    (looks_up != 0).then_some(Crossing::Above(looks_up))
}

/// How a face meets the vertical ray from a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Crossing {
    /// The face is crossed above the point; 1 if it looks up, -1 if it looks down.
    Above(i32),
    /// The point lies on the face.
    On,
}

/// 1 if the perturbed vertical line through `p` hits the triangle and it looks up, -1 if it looks
/// down, 0 if the line misses.
#[inline]
fn crossed_by_column([a, b, c]: [Vec3; 3], p: Vec3) -> i32 {
    let [a, b, c, p] = [a, b, c, p].map(|v| [v.x, v.y]);
    let first = perturbed_turn(a, b, p);
    if first != perturbed_turn(b, c, p) || first != perturbed_turn(c, a, p) {
        return 0;
    }
    first.value()
}

/// Sign of `orient2d(a, b, p)` for `p` moved by `(e, e^2)`; zero only if `a = b`.
#[inline]
fn perturbed_turn(a: Point2, b: Point2, p: Point2) -> Sign {
    match orient2d(a, b, p) {
        Sign::Zero if a[1] != b[1] => Sign::of(a[1] - b[1]),
        Sign::Zero => Sign::of(b[0] - a[0]),
        sign => sign,
    }
}

/// Whether a point in the plane of a triangle, and in its box, lies in it or on its boundary.
fn contains(triangle: [Vec3; 3], p: Vec3) -> bool {
    match projection_axis(triangle) {
        Some((axis, turn)) => (0..3).all(|i| {
            let (a, b) = (project(triangle[i], axis), project(triangle[(i + 1) % 3], axis));
            !orient2d(a, b, project(p, axis)).opposes(turn)
        }),
        // A segment or a point: in the box, so it holds `p` if `p` is on its line along every axis.
        None => {
            let Bounds { lo, hi } = Bounds::of_points(triangle);
            let mut ends = triangle;
            // Of collinear corners the lexicographic extremes are the ends of the segment.
            ends.sort_by(|p, q| {
                p.x.total_cmp(&q.x).then(p.y.total_cmp(&q.y)).then(p.z.total_cmp(&q.z))
            });
            let is_on_line = (0..3).all(|axis| {
                let [a, b, p] = [ends[0], ends[2], p].map(|v| project(v, axis));
                orient2d(a, b, p).is_zero()
            });
            is_on_line && p.cmpge(lo).all() && p.cmple(hi).all()
        }
    }
}

/// Signed distances of points to one surface: negative inside, zero on it, positive outside, in the
/// unit of the surface.
///
/// The side is never read off the closest feature's normal, which is wrong for surfaces that cross or overlap themselves
/// and needs care at edges and vertices (J. A. Baerentzen, H. Aanaes, *Signed distance computation using the angle weighted
/// pseudonormal*, 2005, doi:10.1109/TVCG.2005.49), but off the exact winding number of [`InsideTest`]. Overlapping parts are
/// inside, cavities outside.
///
/// ```
/// use medial::Vec3;
/// use medial::surface::{SignedDistance, TriangleBvh};
/// use medial::surface::{InsideTest, TriMesh};
///
/// let tetrahedron = TriMesh {
///     vertices: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
///     faces: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
/// };
/// let (tree, inside) = (TriangleBvh::new(&tetrahedron)?, InsideTest::new(&tetrahedron));
/// let distance = SignedDistance::closed(&tree, &inside);
/// assert_eq!(distance.at(Vec3::splat(0.125)), -0.125);
/// assert_eq!(distance.at(Vec3::new(0.25, 0.25, -2.0)), 2.0);
/// assert_eq!(distance.at(Vec3::new(0.25, 0.25, 0.0)), 0.0);
/// # Ok::<(), medial::surface::BvhError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct SignedDistance<'a> {
    tree: &'a TriangleBvh,
    inside: &'a InsideTest,
}

impl<'a> SignedDistance<'a> {
    /// For a closed, consistently oriented surface with this tree and test.
    pub fn closed(tree: &'a TriangleBvh, inside: &'a InsideTest) -> Self {
        Self { tree, inside }
    }

    /// The signed distance of `p`. A query that is not finite gets a distance that is not.
    pub fn at(&self, p: Vec3) -> f64 {
        self.signed(p, self.tree.closest(p).distance)
    }

    /// [`at`](Self::at) for many points, in their order, in parallel. The same values for any
    /// number of threads.
    pub fn batch(&self, points: &[Vec3]) -> Vec<f64> {
        self.tree.distance_batch_with(points, |p, distance| self.signed(p, distance))
    }

    #[inline]
    fn signed(&self, p: Vec3, distance: f64) -> f64 {
        match self.inside.side(p) {
            // From zero, so that no zero is negative.
            Side::Inside => 0.0 - distance,
            Side::On => 0.0,
            Side::Outside => distance,
        }
    }
}
