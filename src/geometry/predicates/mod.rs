//! Exact geometric predicates: signs that no rounding can turn.
//!
//! Each predicate is first evaluated in double precision with a bound on its rounding error; where
//! the bound does not decide, integers wide enough to hold the exact value do.
//!
//! # Signs
//! [`orient3d`]`(a, b, c, d)` is the sign of `det(b - a, c - a, d - a)`, positive if `d` sees
//! `a, b, c` counter-clockwise. [`in_sphere`] is positive for a point inside the circumsphere of a
//! positively oriented tetrahedron. Both are CGAL's (`orientation`, `side_of_oriented_sphere`) and
//! opposite to Shewchuk's (`orient3d`, `insphere`), whose positive tetrahedron is our negative one.
//!
//! # Ties
//! The functions here say [`Sign::Zero`] where points are coplanar or cospherical: nothing is
//! perturbed. The triangulations break these ties by a symbolic perturbation of their own.
//!
//! # Range
//! Nothing is checked. A sign means something for finite coordinates of at most
//! [`MAX_COORDINATE`] in absolute value, however small. For others, NaN among them, any sign may
//! come out, or the call panics. The triangulations refuse such points with an error.

mod axes;
mod circumsphere;
mod differences;
mod exact;
mod filter;
mod lanes;
mod narrow;
mod perturb;
mod planar;
mod power_exact;
mod power_size;
mod wide;

pub use circumsphere::{circumsphere, orthosphere};
pub(crate) use differences::{highest_bit, lowest_bit};
pub(crate) use exact::collinear as sites_collinear;
pub(crate) use filter::{
    Filter, Metric, Site, UNDERFLOW, Unweighted, Weighted, approximate_orientation,
};
pub(crate) use perturb::{in_conflict, in_conflict_given, lexicographic};
pub use planar::{Point2, orient2d, project, projection_axis};
pub(crate) use power_size::{
    edge_clearance, edge_size, tetrahedron_size, triangle_clearance, triangle_size,
    vertex_clearance,
};

use crate::Vec3;

/// The largest absolute value of a coordinate for which no product in a predicate overflows; the
/// largest that a triangulation takes.
pub const MAX_COORDINATE: f64 = 1e57;

/// The sign of an exactly evaluated expression.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Sign {
    /// Below zero.
    Negative = -1,
    /// Exactly zero.
    Zero = 0,
    /// Above zero.
    Positive = 1,
}

impl Sign {
    /// The sign of a value; not a number counts as zero.
    #[inline]
    pub fn of(x: f64) -> Self {
        if x > 0.0 {
            Self::Positive
        } else if x < 0.0 {
            Self::Negative
        } else {
            Self::Zero
        }
    }

    /// Whether it is zero.
    pub fn is_zero(self) -> bool {
        self == Self::Zero
    }

    /// -1, 0 or 1.
    pub fn value(self) -> i32 {
        self as i32
    }

    /// Whether the two are strictly on opposite sides.
    pub fn opposes(self, other: Self) -> bool {
        self.value() * other.value() < 0
    }
}

impl std::ops::Neg for Sign {
    type Output = Self;

    fn neg(self) -> Self {
        match self {
            Self::Negative => Self::Positive,
            Self::Zero => Self::Zero,
            Self::Positive => Self::Negative,
        }
    }
}

/// The side of the plane `a, b, c` on which `d` lies: positive if `d` sees them counter-clockwise,
/// zero if the four points are coplanar. The sign is CGAL's, and opposite to Shewchuk's.
///
/// Exact for finite coordinates of at most [`MAX_COORDINATE`]; of others (1e300, infinity, NaN)
/// the sign means nothing, and the call may panic.
///
/// ```
/// use medial_geometry::Vec3;
/// use medial_geometry::predicates::{Sign, orient3d};
///
/// assert_eq!(orient3d(Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z), Sign::Positive);
/// assert_eq!(orient3d(Vec3::ZERO, Vec3::Y, Vec3::X, Vec3::Z), Sign::Negative);
/// assert_eq!(orient3d(Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::X + Vec3::Y), Sign::Zero);
/// ```
#[inline]
pub fn orient3d(a: Vec3, b: Vec3, c: Vec3, d: Vec3) -> Sign {
    Filter::ANY.orient3d(&a.to_array(), &b.to_array(), &c.to_array(), &d.to_array())
}

/// Whether three points lie on one line, exactly: for finite coordinates of at most
/// [`MAX_COORDINATE`]. Of others the answer means nothing, and the call may panic.
pub fn collinear(a: Vec3, b: Vec3, c: Vec3) -> bool {
    exact::collinear(&a.to_array(), &b.to_array(), &c.to_array())
}

/// The side of the circumsphere of `a, b, c, d` on which `e` lies: positive inside, zero on it,
/// if [`orient3d`]`(a, b, c, d)` is positive, and the opposite sign if it is negative. The sign is
/// CGAL's, and opposite to Shewchuk's. Coplanar `a, b, c, d` have no sphere, and then the sign
/// means nothing.
///
/// Exact for finite coordinates of at most [`MAX_COORDINATE`]; of others (1e300, infinity, NaN)
/// the sign means nothing, and the call may panic.
///
/// ```
/// use medial_geometry::Vec3;
/// use medial_geometry::predicates::{Sign, in_sphere};
///
/// let [a, b, c, d] = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z]; // positively oriented
/// assert_eq!(in_sphere(a, b, c, d, Vec3::splat(0.5)), Sign::Positive);
/// assert_eq!(in_sphere(a, b, c, d, Vec3::splat(1.0)), Sign::Zero);
/// assert_eq!(in_sphere(a, b, c, d, Vec3::splat(1.5)), Sign::Negative);
/// ```
#[inline]
pub fn in_sphere(a: Vec3, b: Vec3, c: Vec3, d: Vec3, e: Vec3) -> Sign {
    let [a, b, c, d, e] = [a, b, c, d, e].map(|p| Site { p: p.to_array(), w: 0.0 });
    Filter::ANY.power_test::<Unweighted>([&a, &b, &c, &d], &e)
}

/// The in-sphere test of weighted points `(p, w)` with the power distance `|x - p|^2 - w`:
/// positive if the power of `e` to the orthosphere of the positively oriented `a, b, c, d` is
/// negative, that is if `e` does not allow them to be a cell of the regular triangulation.
///
/// Zero if that power is zero; the opposite sign for negatively oriented points, and none that
/// means anything for coplanar ones.
///
/// Exact, the lift `|p|^2 - w` included, for finite coordinates of at most [`MAX_COORDINATE`] and
/// finite weights of at most its square; of others the sign means nothing, and the call may panic.
pub fn power_test(
    a: (Vec3, f64),
    b: (Vec3, f64),
    c: (Vec3, f64),
    d: (Vec3, f64),
    e: (Vec3, f64),
) -> Sign {
    let [a, b, c, d, e] = [a, b, c, d, e].map(|(p, w)| Site { p: p.to_array(), w });
    Filter::ANY.power_test::<Weighted>([&a, &b, &c, &d], &e)
}

#[cfg(test)]
mod tests;
