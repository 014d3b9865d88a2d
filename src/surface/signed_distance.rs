//! Signed distance to a surface: how far from the closest point, and on which side.
//!
//! The distance is that of [`TriangleBvh`]. The side is never read off the closest feature's
//! normal, which is wrong for surfaces that cross or overlap themselves and needs care at edges
//! and vertices (J. A. Baerentzen, H. Aanaes, *Signed distance computation using the angle weighted
//! pseudonormal*, 2005, doi:10.1109/TVCG.2005.49), but
//!
//! - for closed surfaces off the exact integer winding number of [`InsideTest`], or
//! - for surfaces with holes off the generalised winding number of [`GeneralisedWinding`], and for
//!   soups off that of [`WindingTree`]: above 1/2 inside.

use super::{GeneralisedWinding, InsideTest, Side, TriangleBvh, WindingTree};
use crate::Vec3;

/// Signed distances of points to one surface: negative inside, zero on it, positive outside, in the
/// unit of the surface.
///
/// Borrows what it is made of, which must be made of the same surface.
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
    side: SideTest<'a>,
}

#[derive(Clone, Copy, Debug)]
enum SideTest<'a> {
    Crossings(&'a InsideTest),
    Boundary(&'a GeneralisedWinding),
    Expansion(&'a WindingTree),
}

impl<'a> SignedDistance<'a> {
    /// For a closed, consistently oriented surface. The sign is exact: overlapping parts are
    /// inside, cavities outside.
    pub fn closed(tree: &'a TriangleBvh, inside: &'a InsideTest) -> Self {
        Self { tree, side: SideTest::Crossings(inside) }
    }

    /// For a surface with holes. The sign jumps where the winding number passes through 1/2, which
    /// in a hole is away from the surface.
    pub fn open(tree: &'a TriangleBvh, winding: &'a GeneralisedWinding) -> Self {
        Self { tree, side: SideTest::Boundary(winding) }
    }

    /// For a soup of triangles. As [`open`](Self::open), but where the winding number is within the
    /// tree's tolerance of 1/2 the sign is not told reliably.
    pub fn soup(tree: &'a TriangleBvh, winding: &'a WindingTree) -> Self {
        Self { tree, side: SideTest::Expansion(winding) }
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
        let above_half = |number: f64| if number > 0.5 { Side::Inside } else { Side::Outside };
        let side = match self.side {
            SideTest::Crossings(test) => test.side(p),
            SideTest::Boundary(winding) => winding.number(p).map_or(Side::On, above_half),
            SideTest::Expansion(tree) => above_half(tree.winding_number(p)),
        };
        match side {
            // From zero, so that no zero is negative.
            Side::Inside => 0.0 - distance,
            Side::On => 0.0,
            Side::Outside => distance,
        }
    }
}
