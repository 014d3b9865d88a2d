//! Generalised winding numbers of meshes with holes and of triangle soups.
//!
//! A. Jacobson, L. Kavan, O. Sorkine-Hornung: *Robust inside-outside segmentation using generalized
//! winding numbers*, ACM Transactions on Graphics 32(4), 2013, doi:10.1145/2461912.2461916: the sum
//! of the signed solid angles of all triangles over `4 pi`. Evaluated as in G. Barill and others,
//! *Fast winding numbers for soups and clouds*, ACM Transactions on Graphics 37(4), 2018,
//! doi:10.1145/3197517.3201337:
//!
//! 1. A node that is farther away than `beta` times its radius is replaced by its expansion, which
//!    comes with a bound of its error ([`super::expansion`]).
//! 2. Nearer nodes are opened; the triangles of nearer leaves are summed ([`super::solid_angle`]).
//!
//! # Deviations from the papers
//! - The paper fixes `beta = 2` and reports observed errors. Here the error bounds are summed. If the
//!   sum exceeds the tolerance, the query is repeated with a `beta` that should meet it. Up to
//!   rounding, no answer differs from the sum of the solid angles by more than the tolerance.
//! - The expansion is about the area-weighted centre of the triangles, with exact integrals over them;
//!   the paper's third term omits some of these for triangles.

use std::cell::Cell;
use std::f64::consts::{PI, TAU};
use std::ops::ControlFlow;

use super::closest::{BvhError, check_corners};
use super::expansion::{Estimate, Expansion};
use super::solid_angle::Facet;
use crate::Vec3;
use crate::geometry::planar_frame::power_of_two_below;
use crate::geometry::trees::{Bounds, Node, Plan, Tree, in_morton_order};
use crate::surface::TriMesh;

/// The first `beta` of each query: Barill's constant.
const FIRST_BETA: f64 = 2.0;
/// If this `beta` would not meet the tolerance, all triangles are summed.
const LAST_BETA: f64 = 1e4;

/// Generalised winding numbers of any set of oriented triangles: the sum of their signed solid
/// angles over `4 pi`.
///
/// For a closed, outward-oriented surface this is the integer winding number of
/// [`InsideTest`](crate::surface::InsideTest), 1 inside. Holes, gaps and overlaps change it little;
/// points with a number above 1/2 count as inside.
///
/// *On the surface* the number jumps. There a triangle that contains the point, up to rounding, counts
/// as zero. So within a face the value is the mean of both sides, and at an edge or a vertex it is the
/// solid angle of the inside over `4 pi`. At a distance `e` from an edge of a triangle of size `l` and
/// area `a`, the rounding error is at most about `1e-16 l^3 / (a e)`.
///
/// ```
/// use medial::Vec3;
/// use medial::surface::WindingTree;
///
/// // Two faces of the octahedron, of which each point of the centre sees an eighth.
/// let triangles = [[Vec3::X, Vec3::Y, Vec3::Z], [Vec3::NEG_X, Vec3::Z, Vec3::Y]];
/// let tree = WindingTree::from_triangles(&triangles)?;
/// assert!((tree.winding_number(Vec3::ZERO) - 0.25).abs() < 1e-15);
/// # Ok::<(), medial::surface::BvhError>(())
/// ```
#[derive(Clone, Debug)]
pub struct WindingTree {
    tree: Tree,
    /// In leaf order, scaled.
    facets: Vec<Facet>,
    /// For each node of the tree.
    expansions: Vec<Expansion>,
    /// The power of two that brings the corners near 1, so that no product leaves the range.
    scale: f64,
    tolerance: f64,
}

/// A winding number and a bound of its error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Winding {
    /// The generalised winding number.
    pub number: f64,
    /// Bound, up to rounding, on the difference from the sum of the triangles' solid angles over
    /// `4 pi`.
    pub error: f64,
}

impl WindingTree {
    /// Largest error of answers unless [`with_tolerance`](Self::with_tolerance) asks for another. The
    /// errors seen are about a hundredth of it: the bounds add up, the errors mostly cancel.
    pub const TOLERANCE: f64 = 1e-2;

    /// Prepares the faces of a mesh. Cost `O(n log n)`.
    ///
    /// # Errors
    /// When the mesh has no faces, or a corner of one is not finite.
    ///
    /// # Panics
    /// If a face names a vertex that does not exist.
    pub fn new(mesh: &TriMesh) -> Result<Self, BvhError> {
        Self::from_triangles(&(0..mesh.faces.len()).map(|f| mesh.triangle(f)).collect::<Vec<_>>())
    }

    /// Prepares triangles given by their corners, counter-clockwise seen from outside.
    ///
    /// # Errors
    /// When there are none, or a corner is not finite.
    pub fn from_triangles(triangles: &[[Vec3; 3]]) -> Result<Self, BvhError> {
        check_corners(triangles)?;
        let Bounds { lo, hi } = Bounds::of_points(triangles.iter().flatten().copied());
        let scale = power_of_two_below(1.0 / lo.abs().max(hi.abs()).max_element());
        let scaled: Vec<_> = triangles.iter().map(|t| t.map(|v| v * scale)).collect();
        let boxes: Vec<_> = scaled.iter().map(|&t| (Bounds::of_points(t), 0.0)).collect();
        let tree = Tree::build(&boxes, Plan { max_leaf: 4, group: 1, padding: 0.0 });
        let facets: Vec<_> = tree.order().iter().map(|&f| Facet::new(scaled[f as usize])).collect();
        let expansions = tree.ranges().into_iter().map(|r| Expansion::new(&facets[r])).collect();
        Ok(Self { tree, facets, expansions, scale, tolerance: Self::TOLERANCE })
    }

    /// The same triangles, with answers that are wrong by at most `tolerance`. The time of a query
    /// grows about as `tolerance^(-2/3)`; with 0 or less all triangles are summed.
    #[must_use]
    pub fn with_tolerance(mut self, tolerance: f64) -> Self {
        self.tolerance = tolerance;
        self
    }

    /// Largest error of answers.
    pub fn tolerance(&self) -> f64 {
        self.tolerance
    }

    /// The winding number around `p`, within the tolerance. A query that is not finite gets a
    /// number that is not.
    pub fn winding_number(&self, p: Vec3) -> f64 {
        self.winding(p).number
    }

    /// The winding number around `p` with the bound of its error, which is within the tolerance.
    pub fn winding(&self, p: Vec3) -> Winding {
        let mut beta = FIRST_BETA;
        while self.tolerance > 0.0 && beta < LAST_BETA {
            let winding = self.winding_beyond(p, beta);
            // An error that is not a number leaves nothing to refine.
            if winding.error <= self.tolerance || winding.error.is_nan() {
                return winding;
            }
            // The error falls at least with the third power, and a little more is asked for.
            beta *= 1.1 * (winding.error / self.tolerance).cbrt().max(1.1);
        }
        Winding { number: self.winding_number_by_sum(p), error: 0.0 }
    }

    /// The winding number around `p` with expansions wherever `p` is farther from a node than
    /// `beta` times the node's radius, whatever the error: the method of Barill and others.
    /// `beta` below 1 is taken as 1.
    pub fn winding_beyond(&self, p: Vec3, beta: f64) -> Winding {
        let p = p * self.scale;
        let beta_squared = beta.max(1.0 + 1e-9).powi(2);
        // Both closures add to it, in the order of the tree.
        let sum = Cell::new(Estimate { omega: 0.0, error: 0.0 });
        let add = |of: Estimate| {
            let Estimate { omega, error } = sum.get();
            sum.set(Estimate { omega: omega + of.omega, error: error + of.error });
        };
        let enter = |node: usize, _: &Node| {
            let expansion = &self.expansions[node];
            let squared = expansion.centre.distance_squared(p);
            let is_far = squared > beta_squared * expansion.radius * expansion.radius;
            if is_far {
                add(expansion.solid_angle(p));
            }
            !is_far
        };
        self.tree.descend(enter, |places| {
            let halves = self.facets[places].iter().map(|f| f.half_solid_angle(p));
            add(Estimate { omega: 2.0 * halves.sum::<f64>(), error: 0.0 });
            ControlFlow::Continue(())
        });
        let sum = sum.get();
        Winding { number: sum.omega / (4.0 * PI), error: sum.error / (4.0 * PI) }
    }

    /// The winding number around `p` by summing all triangles, correct to rounding. `O(n)`.
    pub fn winding_number_by_sum(&self, p: Vec3) -> f64 {
        let p = p * self.scale;
        self.facets.iter().map(|f| f.half_solid_angle(p)).sum::<f64>() / TAU
    }

    /// [`winding_number`](Self::winding_number) for many points, in their order, in parallel.
    pub fn winding_number_batch(&self, points: &[Vec3]) -> Vec<f64> {
        in_morton_order(points, |(): &mut (), p| self.winding_number(p))
    }
}
