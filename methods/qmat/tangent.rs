//! Planes tangent to slabs and cones, as outward unit normals.

use medial::Vec3;
use medial::complex::Sphere;
use medial::complex::collapse::COINCIDENT;

/// Stability ratio `Γ = max(0, d - |Δr|) / d` of an edge (equation 3); 0 for coincident centres,
/// where the quotient is rounding noise.
#[inline]
pub(super) fn stability_ratio(a: Sphere, b: Sphere) -> f64 {
    let d = a.centre.distance(b.centre);
    if d < COINCIDENT { 0.0 } else { (d - (a.radius - b.radius).abs()).max(0.0) / d }
}

/// Normals of the two planes tangent to three spheres from outside, `-g ± √(1 - g·g) N`, with `N`
/// the unit normal of the triangle of centres and `g` the gradient of the radius over it.
///
/// `None` when there are none: one ball lies in the hull of the others (`g·g ≥ 1`), or the centres
/// are collinear up to noise.
pub(super) fn slab_normals([m1, m2, m3]: [Sphere; 3]) -> Option<[Vec3; 2]> {
    let (e1, e2) = (m2.centre - m1.centre, m3.centre - m1.centre);
    let normal = e1.cross(e2);
    let squared = normal.length_squared();
    let longest = e1.length_squared().max(e2.length_squared()).max((e1 - e2).length_squared());
    // The smallest height is the doubled area over the longest side.
    if squared <= COINCIDENT * COINCIDENT * longest {
        return None;
    }
    let (b1, b2) = (e2.cross(normal) / squared, normal.cross(e1) / squared);
    let gradient = (m2.radius - m1.radius) * b1 + (m3.radius - m1.radius) * b2;
    let rest = 1.0 - gradient.length_squared();
    if !(rest > 0.0) {
        return None;
    }
    let lift = normal * (rest / squared).sqrt();
    Some([-gradient + lift, -gradient - lift])
}

/// The axis `u` of a cone, from the first to the second sphere, and its slope `s = Δr / d`; `None`
/// when one ball contains the other or the centres coincide.
pub(super) fn cone_axis(a: Sphere, b: Sphere) -> Option<(Vec3, f64)> {
    let axis = b.centre - a.centre;
    let length = axis.length();
    if length < COINCIDENT {
        return None;
    }
    let slope = (b.radius - a.radius) / length;
    (slope.abs() < 1.0).then(|| (axis / length, slope))
}

/// Normals of four planes tangent to a cone, a quarter turn apart. The sum of the squared distances
/// to them does not depend on where the first one is.
pub(super) fn cone_normals(a: Sphere, b: Sphere) -> Option<[Vec3; 4]> {
    let (axis, slope) = cone_axis(a, b)?;
    let (v, w) = axis.any_orthonormal_pair();
    let radial = (1.0 - slope * slope).sqrt();
    Some([v, w, -v, -w].map(|direction| radial * direction - slope * axis))
}

/// Normal of the plane tangent to the cone `ab` and orthogonal to the triangle `abc`, on the side
/// away from `c`; `None` without such a plane.
pub(super) fn rim_normal(a: Sphere, b: Sphere, c: Sphere) -> Option<Vec3> {
    let (axis, slope) = cone_axis(a, b)?;
    let inward = (c.centre - a.centre).reject_from_normalized(axis);
    let outward = -inward.try_normalize()?;
    if inward.length() < COINCIDENT {
        return None;
    }
    Some((1.0 - slope * slope).sqrt() * outward - slope * axis)
}
