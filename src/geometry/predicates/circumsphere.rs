//! Circumspheres and orthospheres of four points.

use super::exact;
use crate::Vec3;

/// The centre and radius of the sphere through four points; `None` if they are coplanar or the
/// centre is not representable.
///
/// Computed in double precision relative to `p[0]`. If the distances to the four points then differ
/// from the radius by more than `1e-6` of it, or the cell is nearly flat, it is computed again with
/// exact numerators and denominator. The unit is that of the points, whose coordinates must be
/// finite and at most [`MAX_COORDINATE`](super::MAX_COORDINATE): with others the call may panic.
pub fn circumsphere(p: [Vec3; 4]) -> Option<(Vec3, f64)> {
    let (offset, _) = relative_orthocentre(p, [0.0; 4])?;
    Some((p[0] + offset, norm(offset)))
}

/// The orthocentre `o` of four weighted points `(p, w)` and its power `|o - p|^2 - w`, which is the
/// same for all four and may be negative; `None` if the points are coplanar or the centre is not
/// representable.
///
/// As robust as [`circumsphere`], to which it reduces for zero weights.
pub fn orthosphere(p: [Vec3; 4], w: [f64; 4]) -> Option<(Vec3, f64)> {
    let (offset, power) = relative_orthocentre(p, w)?;
    Some((p[0] + offset, power))
}

/// The orthocentre minus `p[0]`, and its power.
fn relative_orthocentre(p: [Vec3; 4], w: [f64; 4]) -> Option<(Vec3, f64)> {
    let d = [p[1] - p[0], p[2] - p[0], p[3] - p[0]];
    let lift = [0, 1, 2].map(|i| d[i].length_squared() + (w[0] - w[i + 1]));
    let normals = [d[1].cross(d[2]), d[2].cross(d[0]), d[0].cross(d[1])];
    let det = d[0].dot(normals[0]);
    let offset = (lift[0] * normals[0] + lift[1] * normals[1] + lift[2] * normals[2]) / (2.0 * det);
    let power = offset.length_squared() - w[0];
    if is_trustworthy(&d, w, det, offset, power) {
        return Some((offset, power));
    }
    let q = p.map(|p| p.to_array());
    let exact = exact::orthocentre([0, 1, 2, 3].map(|i| (&q[i], w[i])))?;
    let offset = Vec3::from_array(exact);
    offset.is_finite().then(|| (offset, offset.length_squared() - w[0]))
}

/// `|v|` without underflow or overflow on the way.
fn norm(v: Vec3) -> f64 {
    let largest = v.abs().max_element();
    // Squares of these are normal numbers.
    if (1e-140..1e140).contains(&largest) || largest == 0.0 {
        v.length()
    } else {
        largest * (v / largest).length()
    }
}

/// Whether the solution passes the residual test and its determinant is well above rounding error.
fn is_trustworthy(d: &[Vec3; 3], w: [f64; 4], det: f64, offset: Vec3, power: f64) -> bool {
    let reach = d[0].length() * d[1].length() * d[2].length();
    if det.abs() <= 1e-9 * reach || !offset.is_finite() {
        return false;
    }
    let scale = offset.length_squared() + w[0].abs();
    d.iter().zip(&w[1..]).all(|(&d, &w)| {
        ((offset - d).length_squared() - w - power).abs() <= 2e-6 * (scale + w.abs())
    })
}
