//! Quadratic functions of a sphere: `E(m) = mᵀ A m + bᵀ m + c` on `R⁴`, sums of squared distances
//! to oriented planes.
//!
//! With `n̄ = (n, 1)` the signed distance of a sphere `m = (c, r)` to the plane with outward normal
//! `n` that a sphere `m₀` touches is `n̄ · (m - m₀)`; its square is one term of the sum.

use std::ops::AddAssign;

use medial::Vec3;
use medial::complex::collapse::CollapseComplex;
use medial::complex::{MedialMesh, Sphere, ZERO_LENGTH, stability_ratio};
use medial::geometry::{Cone, ConeFrame, SlabPlanes};

use super::QmatParams;

/// The function `E`, in exactly two cache lines.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(align(64))]
pub(super) struct Quadric {
    /// Upper triangle of `A` by rows: `00 01 02 03 11 12 13 22 23 33`.
    a: [f64; 10],
    b: [f64; 4],
    c: f64,
}

fn coordinates(sphere: Sphere) -> [f64; 4] {
    let Vec3 { x, y, z } = sphere.centre;
    [x, y, z, sphere.radius]
}

fn dot(u: [f64; 4], v: [f64; 4]) -> f64 {
    u[0] * v[0] + u[1] * v[1] + u[2] * v[2] + u[3] * v[3]
}

impl AddAssign<&Quadric> for Quadric {
    #[inline]
    fn add_assign(&mut self, other: &Self) {
        for (x, y) in self.a.iter_mut().zip(&other.a) {
            *x += y;
        }
        for (x, y) in self.b.iter_mut().zip(&other.b) {
            *x += y;
        }
        self.c += other.c;
    }
}

impl Quadric {
    /// Adds `weight * ((normal, 1) · (m - touching))²`. The normal need not have unit length.
    pub(super) fn add_plane(&mut self, normal: Vec3, touching: Sphere, weight: f64) {
        let n = [normal.x, normal.y, normal.z, 1.0];
        let offset = dot(n, coordinates(touching));
        // Expanded: n̄n̄ᵀ goes into A, -2 (n̄·m₀) n̄ into b, (n̄·m₀)² into c.
        let mut entry = 0;
        for row in 0..4 {
            for column in row..4 {
                self.a[entry] += weight * n[row] * n[column];
                entry += 1;
            }
            self.b[row] -= 2.0 * weight * offset * n[row];
        }
        self.c += weight * offset * offset;
    }

    /// `A m` for a point of `R⁴`.
    fn times(&self, m: [f64; 4]) -> [f64; 4] {
        let a = &self.a;
        [
            a[0] * m[0] + a[1] * m[1] + a[2] * m[2] + a[3] * m[3],
            a[1] * m[0] + a[4] * m[1] + a[5] * m[2] + a[6] * m[3],
            a[2] * m[0] + a[5] * m[1] + a[7] * m[2] + a[8] * m[3],
            a[3] * m[0] + a[6] * m[1] + a[8] * m[2] + a[9] * m[3],
        ]
    }

    /// `E(m)`, not below zero: rounding can leave a little less.
    #[inline]
    pub(super) fn value(&self, sphere: Sphere) -> f64 {
        let m = coordinates(sphere);
        (dot(m, self.times(m)) + dot(m, self.b) + self.c).max(0.0)
    }

    /// The minimiser `-A⁻¹ b / 2`, or `None` when the smallest eigenvalue of `A` is at most
    /// `singular_ratio` times the largest. The radius may be negative.
    #[inline]
    pub(super) fn minimiser(&self, singular_ratio: f64) -> Option<Sphere> {
        self.plainly_regular(singular_ratio).or_else(|| self.pivoted(singular_ratio))
    }

    /// The minimiser by `L D Lᵀ` without exchanges, which is stable for a definite matrix, or `None`
    /// when it could be singular.
    ///
    /// With the trace `t`, no eigenvalue exceeds `t`, and the product of any three is at most
    /// `(t/3)³`. So the smallest eigenvalue is at least the determinant divided by `(t/3)³`.
    #[inline]
    fn plainly_regular(&self, singular_ratio: f64) -> Option<Sphere> {
        let [a00, a01, a02, a03, a11, a12, a13, a22, a23, a33] = self.a;
        let third = (a00 + a11 + a22 + a33) / 3.0;
        let (l10, l20, l30) = (a01 / a00, a02 / a00, a03 / a00);
        let (b11, b21, b31) = (a11 - l10 * a01, a12 - l10 * a02, a13 - l10 * a03);
        let (b22, b32, b33) = (a22 - l20 * a02, a23 - l20 * a03, a33 - l30 * a03);
        let (l21, l31) = (b21 / b11, b31 / b11);
        let (c22, c32, c33) = (b22 - l21 * b21, b32 - l21 * b31, b33 - l31 * b31);
        let l32 = c32 / c22;
        let d33 = c33 - l32 * c32;
        let definite = a00 > 0.0 && b11 > 0.0 && c22 > 0.0 && d33 > 0.0;
        let determinant = a00 * b11 * c22 * d33;
        // Needed: det / (t/3)³ > ratio · t = 3 ratio · (t/3). Twice that, for the rounding of pivots;
        // negated, so that a pivot that is not a number fails.
        if !(definite && determinant > 6.0 * singular_ratio * third * third * third * third) {
            return None;
        }
        let x0 = -0.5 * self.b[0];
        let x1 = -0.5 * self.b[1] - l10 * x0;
        let x2 = -0.5 * self.b[2] - l20 * x0 - l21 * x1;
        let x3 = -0.5 * self.b[3] - l30 * x0 - l31 * x1 - l32 * x2;
        let radius = x3 / d33;
        let z = x2 / c22 - l32 * radius;
        let y = x1 / b11 - l21 * z - l31 * radius;
        let x = x0 / a00 - l10 * y - l20 * z - l30 * radius;
        Some(Sphere::new(Vec3::new(x, y, z), radius))
    }

    /// The minimiser where the matrix is close to singular.
    ///
    /// `L D Lᵀ` with diagonal pivoting settles the question without eigenvalues in all but a
    /// narrow band: with the pivots `d₁ ≥ .. ≥ d₄` and `|L| ≤ 1`, `λ_min` lies in `[d₄/31, d₄]`
    /// (the entries of `L⁻¹` are at most 1, 1, 2, 4 by distance from the diagonal) and `λ_max` in
    /// `[d₁, 4 d₁]`.
    fn pivoted(&self, singular_ratio: f64) -> Option<Sphere> {
        let mut m = self.matrix();
        let mut x = self.b.map(|b| -0.5 * b);
        let mut order = [0, 1, 2, 3];
        let mut largest = 0.0;
        for k in 0..4 {
            pivot(&mut m, &mut x, &mut order, k);
            let d = m[k][k];
            if k == 0 {
                largest = d;
            }
            // A pivot that is not a number fails both comparisons.
            let regular = d > 0.0 && d > singular_ratio * largest;
            if !regular {
                return None;
            }
            // Lower triangle only: the matrix stays symmetric under elimination.
            for i in k + 1..4 {
                let factor = m[i][k] / d;
                for j in k + 1..=i {
                    m[i][j] -= factor * m[j][k];
                }
                x[i] -= factor * x[k];
            }
        }
        // λ_min / λ_max is at least d₄ / (31 · 4 d₁): beyond that the eigenvalues are not needed.
        let in_doubt = m[3][3] <= 124.0 * singular_ratio * largest;
        if in_doubt && self.eigenvalue_ratio() <= singular_ratio {
            return None;
        }
        let mut solution = [0.0; 4];
        for k in (0..4).rev() {
            for i in k + 1..4 {
                x[k] -= m[i][k] * x[i];
            }
            x[k] /= m[k][k];
            // Undoes the exchanges of the pivots.
            solution[order[k]] = x[k];
        }
        let [cx, cy, cz, radius] = solution;
        Some(Sphere::new(Vec3::new(cx, cy, cz), radius))
    }

    fn matrix(&self) -> [[f64; 4]; 4] {
        let a = &self.a;
        [
            [a[0], a[1], a[2], a[3]],
            [a[1], a[4], a[5], a[6]],
            [a[2], a[5], a[7], a[8]],
            [a[3], a[6], a[8], a[9]],
        ]
    }

    /// Smallest over largest eigenvalue of `A`, by cyclic Jacobi rotations.
    #[cold]
    fn eigenvalue_ratio(&self) -> f64 {
        let mut m = self.matrix();
        // An off-diagonal entry moves no eigenvalue by more than its own size.
        let negligible = 1e-20 * (m[0][0] + m[1][1] + m[2][2] + m[3][3]);
        for _sweep in 0..12 {
            for p in 0..3 {
                for q in p + 1..4 {
                    if m[p][q].abs() > negligible {
                        rotate(&mut m, p, q);
                    }
                }
            }
        }
        let diagonal = [m[0][0], m[1][1], m[2][2], m[3][3]];
        let largest = diagonal.into_iter().fold(f64::MIN, f64::max);
        diagonal.into_iter().fold(f64::MAX, f64::min) / largest
    }
}

/// Brings the largest remaining diagonal entry to place `k` by a symmetric exchange of the lower
/// triangle.
#[inline]
fn pivot(m: &mut [[f64; 4]; 4], x: &mut [f64; 4], order: &mut [usize; 4], k: usize) {
    let mut p = k;
    for i in k + 1..4 {
        if m[i][i] > m[p][p] {
            p = i;
        }
    }
    if p == k {
        return;
    }
    x.swap(k, p);
    order.swap(k, p);
    // Only the lower triangle is stored. Columns before `k` hold the factors, which move along.
    for j in 0..k {
        let kept = m[k][j];
        m[k][j] = m[p][j];
        m[p][j] = kept;
    }
    for i in k + 1..p {
        let kept = m[i][k];
        m[i][k] = m[p][i];
        m[p][i] = kept;
    }
    for i in p + 1..4 {
        m[i].swap(k, p);
    }
    let kept = m[k][k];
    m[k][k] = m[p][p];
    m[p][p] = kept;
}

/// Zeroes the entry `(p, q)` of a symmetric matrix by a rotation.
fn rotate(m: &mut [[f64; 4]; 4], p: usize, q: usize) {
    let theta = (m[q][q] - m[p][p]) / (2.0 * m[p][q]);
    // The smaller root, of a rotation by at most 45 degrees: Jacobi's sweeps then converge.
    let tangent = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
    let cosine = 1.0 / (tangent * tangent + 1.0).sqrt();
    let sine = tangent * cosine;
    for i in 0..4 {
        let (x, y) = (m[i][p], m[i][q]);
        m[i][p] = cosine * x - sine * y;
        m[i][q] = sine * x + cosine * y;
    }
    for i in 0..4 {
        let (x, y) = (m[p][i], m[q][i]);
        m[p][i] = cosine * x - sine * y;
        m[q][i] = sine * x + cosine * y;
    }
}

// ----------------------------------------------------------------------------
// The initial error function of every sphere: slabs, cones of lone edges, boundary planes.

/// Counts of the primitives without tangent planes, which contribute nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Skipped {
    pub(super) slabs: usize,
    pub(super) cones: usize,
}

/// The quadric of each sphere of the initial mesh (equation 4 and section 4.4).
pub(super) fn initial_quadrics(
    mesh: &MedialMesh,
    complex: &CollapseComplex,
    params: &QmatParams,
) -> (Vec<Quadric>, Skipped) {
    let mut quadrics = vec![Quadric::default(); mesh.spheres.len()];
    let mut skipped = Skipped::default();
    for &face in &mesh.faces {
        let spheres = face.map(|v| mesh.spheres[v as usize]);
        match slab_planes(spheres) {
            Some(planes) => {
                let mut slab = Quadric::default();
                for normal in planes.normals() {
                    // A plane touches all three spheres, so any of them fixes its offset.
                    slab.add_plane(normal, spheres[0], 1.0);
                }
                for v in face {
                    quadrics[v as usize] += &slab;
                }
            }
            None => skipped.slabs += 1,
        }
    }
    for &[a, b] in &mesh.edges {
        let mut faces = complex.opposite_sides(a).iter().filter(|side| side.contains(&b));
        // No face: a cone, with a tip at each free end. One face: a boundary. More: neither.
        match (faces.next(), faces.next()) {
            (None, _) => {
                skipped.cones += usize::from(!add_cone(&mut quadrics, mesh, [a, b]));
                for (end, other) in [(a, b), (b, a)] {
                    if complex.neighbours(end).len() == 1 {
                        add_tip(&mut quadrics, mesh, end, other, params);
                    }
                }
            }
            (Some(&[p, q]), None) => {
                let apex = if p == b { q } else { p };
                add_rim(&mut quadrics, mesh, [a, b], apex, params);
            }
            _ => {}
        }
    }
    (quadrics, skipped)
}

/// Adds the four planes of a lone edge's cone to the quadrics of both ends; false without a cone.
fn add_cone(quadrics: &mut [Quadric], mesh: &MedialMesh, ends: [u32; 2]) -> bool {
    let [a, b] = ends.map(|v| mesh.spheres[v as usize]);
    let Some(frame) = cone_frame(a, b) else {
        return false;
    };
    let mut cone = Quadric::default();
    for normal in frame.normals() {
        cone.add_plane(normal, a, 1.0);
    }
    for v in ends {
        quadrics[v as usize] += &cone;
    }
    true
}

/// Adds the plane across the free end of a lone edge to the quadric of that end.
fn add_tip(quadrics: &mut [Quadric], mesh: &MedialMesh, end: u32, other: u32, params: &QmatParams) {
    let [tip, base] = [end, other].map(|v| mesh.spheres[v as usize]);
    // Without an axis the stability ratio is 0, and so is the weight.
    if let Some(frame) = cone_frame(base, tip) {
        let weight = boundary_weight(tip, base, params);
        quadrics[end as usize].add_plane(frame.u, tip, weight);
    }
}

/// Adds the plane along a boundary edge to the quadrics of both ends.
fn add_rim(
    quadrics: &mut [Quadric],
    mesh: &MedialMesh,
    ends: [u32; 2],
    apex: u32,
    params: &QmatParams,
) {
    let [a, b] = ends.map(|v| mesh.spheres[v as usize]);
    if cone_frame(a, b).is_none() {
        return;
    }
    if let Some(normal) = boundary_edge_normal([a, b], mesh.spheres[apex as usize]) {
        let weight = boundary_weight(a, b, params);
        for v in ends {
            quadrics[v as usize].add_plane(normal, a, weight);
        }
    }
}

/// Outward unit normal of the plane that closes a slab at its boundary edge `ends`: tangent to
/// both balls, orthogonal to the slab's plane, facing away from `opposite`.
///
/// `None` when one ball holds the other or the three centres are collinear.
fn boundary_edge_normal(ends: [Sphere; 2], opposite: Sphere) -> Option<Vec3> {
    let frame = Cone::new(ends[0], ends[1]).frame()?;
    let away = frame.across(ends[0].centre - opposite.centre)?;
    Some(frame.normal(away))
}

/// The tangent planes of a slab; `None` if the face is so thin that its plane is rounding noise.
fn slab_planes(spheres: [Sphere; 3]) -> Option<SlabPlanes> {
    let [a, b, c] = spheres.map(|m| m.centre);
    let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
    // The smallest height is the doubled area over the longest side.
    let doubled_area = (b - a).cross(c - a).length_squared();
    if doubled_area <= ZERO_LENGTH * ZERO_LENGTH * longest {
        return None;
    }
    SlabPlanes::new(spheres)
}

/// The frame of a cone; `None` if one ball holds the other or the axis is rounding noise.
fn cone_frame(a: Sphere, b: Sphere) -> Option<ConeFrame> {
    if a.centre.distance(b.centre) < ZERO_LENGTH {
        return None;
    }
    Cone::new(a, b).frame()
}

/// Weight of a boundary plane.
fn boundary_weight(a: Sphere, b: Sphere, params: &QmatParams) -> f64 {
    let stability = stability_ratio(a, b);
    params.k_boundary * stability * stability
}
