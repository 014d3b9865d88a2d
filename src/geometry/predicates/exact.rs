//! The exact stage of the predicates: fixed-point integers wide enough that nothing is rounded.
//!
//! Double-precision coordinates are integers times a power of two. In practice the few points of one
//! call share a small range of exponents. Then their differences, in units of their lowest set bit
//! (the *quantum*), fit one 64-bit word, and the in-sphere determinant fits five. Three tiers of the
//! same formula cover every input:
//!
//! | tier | differences below | words of the in-sphere determinant |
//! |---|---|---|
//! | 1 | 2^61 | 5 |
//! | 2 | 2^126 | 10 |
//! | 3 | 2^1279, that is any two coordinates below 2^190 | 100 |
//!
//! Before tier 3, each axis is tried on a quantum of its own (file `axes.rs`).
//!
//! Compared with floating-point expansions: no branch depends on the data beyond the choice of
//! the tier, exact zeros (cospherical points) cost no more than other values, and nothing overflows
//! or underflows.

use super::differences::{
    Differences, Grid, differences, highest_bit, lowest_bit, to_i128, to_wide, widen,
};
use super::wide::Wide;
use super::{Sign, axes, narrow};

/// `a.x b.y - b.x a.y`, of twice the width.
#[inline]
pub(super) fn minor<const D: usize, const D2: usize>(
    a: &[Wide<D>; 3],
    b: &[Wide<D>; 3],
) -> Wide<D2> {
    a[0].mul::<D, D2>(b[1]).sub(b[0].mul(a[1]))
}

#[inline]
pub(super) fn det3<const D: usize, const D2: usize, const D3: usize>(
    [a, b, c]: &[[Wide<D>; 3]; 3],
) -> Wide<D3> {
    let bc: Wide<D2> = minor(b, c);
    let ca: Wide<D2> = minor(c, a);
    let ab: Wide<D2> = minor(a, b);
    bc.mul::<D, D3>(a[2]).add(ca.mul(b[2])).add(ab.mul(c[2]))
}

/// The sign of `det(b - a, c - a, d - a)`; `grid`, if known, is a grid that holds all four points.
pub(super) fn orient3d(
    a: &[f64; 3],
    b: &[f64; 3],
    c: &[f64; 3],
    d: &[f64; 3],
    grid: Option<Grid>,
) -> Sign {
    if let Some(grid) = grid {
        return narrow::det3_sign(&grid.differences([b, c, d], a));
    }
    match differences([b, c, d], a, i32::MAX).0 {
        Differences::One(d) => narrow::det3_sign(&d),
        Differences::Two(d) => det3::<2, 4, 6>(&widen(&d)).sign(),
        Differences::Any(wide) => {
            axes::orient3d([b, c, d], a).unwrap_or_else(|| det3::<20, 40, 60>(&wide).sign())
        }
    }
}

/// Whether three points lie on one line.
pub(crate) fn collinear(a: &[f64; 3], b: &[f64; 3], c: &[f64; 3]) -> bool {
    fn parallel<const D: usize, const D2: usize>([u, v]: [[Wide<D>; 3]; 2]) -> bool {
        [[0, 1, 2], [1, 2, 0], [2, 0, 1]].iter().all(|axes| {
            let m: Wide<D2> = minor(&axes.map(|k| u[k]), &axes.map(|k| v[k]));
            m.sign() == Sign::Zero
        })
    }
    match differences([b, c], a, i32::MAX).0 {
        Differences::One(d) => parallel::<1, 2>(d.map(|p| p.map(|x| Wide::from_i128(x.into())))),
        Differences::Two(d) => parallel::<2, 4>(widen(&d)),
        Differences::Any(d) => parallel::<20, 40>(d),
    }
}

#[inline]
fn in_sphere_det<const D: usize, const D2: usize, const D3: usize, const D5: usize>(
    points: &[[Wide<D>; 3]; 4],
    offset: &[Wide<D2>; 4],
) -> Sign {
    let lift = |i: usize| -> Wide<D2> {
        let p = &points[i];
        p[0].mul::<D, D2>(p[0]).add(p[1].mul(p[1])).add(p[2].mul(p[2])).add(offset[i])
    };
    lifted_det::<D, D2, D3, D2, D5>(points, &[lift(0), lift(1), lift(2), lift(3)])
}

/// The sign of the determinant of four differences with their lifts; `R = D3 + L`.
#[inline]
pub(super) fn lifted_det<
    const D: usize,
    const D2: usize,
    const D3: usize,
    const L: usize,
    const R: usize,
>(
    [a, b, c, d]: &[[Wide<D>; 3]; 4],
    lifts: &[Wide<L>; 4],
) -> Sign {
    let ab: Wide<D2> = minor(a, b);
    let bc: Wide<D2> = minor(b, c);
    let cd: Wide<D2> = minor(c, d);
    let da: Wide<D2> = minor(d, a);
    let ac: Wide<D2> = minor(a, c);
    let bd: Wide<D2> = minor(b, d);
    let abc: Wide<D3> = bc.mul::<D, D3>(a[2]).sub(ac.mul(b[2])).add(ab.mul(c[2]));
    let bcd: Wide<D3> = cd.mul::<D, D3>(b[2]).sub(bd.mul(c[2])).add(bc.mul(d[2]));
    let cda: Wide<D3> = da.mul::<D, D3>(c[2]).add(ac.mul(d[2])).add(cd.mul(a[2]));
    let dab: Wide<D3> = ab.mul::<D, D3>(d[2]).add(bd.mul(a[2])).add(da.mul(b[2]));
    let inside: Wide<R> = bcd
        .mul::<L, R>(lifts[0])
        .sub(cda.mul(lifts[1]))
        .add(dab.mul(lifts[2]))
        .sub(abc.mul(lifts[3]));
    inside.sign()
}

/// The power test without weights, see [`power_test`]; `grid` is one that all five points lie on,
/// if known.
pub(super) fn in_sphere(p: [&[f64; 3]; 4], e: &[f64; 3], grid: Option<Grid>) -> Sign {
    if let Some(grid) = grid {
        return narrow::lifted_sign(&grid.differences(p, e), &[0; 4]);
    }
    match differences(p, e, i32::MAX).0 {
        Differences::One(d) => narrow::lifted_sign(&d, &[0; 4]),
        Differences::Two(d) => in_sphere_det::<2, 4, 6, 10>(&widen(&d), &[Wide::ZERO; 4]),
        Differences::Any(d) => axes::in_sphere(p, e)
            .unwrap_or_else(|| in_sphere_det::<20, 40, 60, 100>(&d, &[Wide::ZERO; 4])),
    }
}

/// The sign of the lifted determinant of four weighted points and a fifth, with the lift
/// `|p|^2 - w` taken exactly.
pub(super) fn power_test(p: [(&[f64; 3], f64); 4], e: (&[f64; 3], f64)) -> Sign {
    let weights = p.map(|q| q.1);
    // Weights must be integers in units of the squared quantum, so they bound the quantum by half
    // their lowest exponent.
    let mut cap = i32::MAX;
    let mut top = i32::MIN;
    for w in weights.iter().chain([&e.1]) {
        cap = cap.min(lowest_bit(*w));
        top = top.max(highest_bit(*w));
    }
    let cap = if cap == i32::MAX { cap } else { cap.div_euclid(2) };
    let (d, quantum) = differences(p.map(|q| q.0), e.0, cap);
    let unit = 2 * quantum;
    let below = |limit: i32| top == i32::MIN || top - unit <= limit;
    let offset = |w: f64| to_i128(e.1, unit) - to_i128(w, unit);
    let offset4 = |w: f64| to_wide::<4>(e.1, unit).sub(to_wide(w, unit));
    let offset40 = |w: f64| to_wide::<40>(e.1, unit).sub(to_wide(w, unit));
    // The limits leave room in a lift for three squares, a difference of weights and the sign.
    match d {
        Differences::One(d) if below(122) => narrow::lifted_sign(&d, &weights.map(offset)),
        Differences::One(d) if below(250) => {
            let d = d.map(|p| p.map(|x| Wide::from_i128(x.into())));
            in_sphere_det::<2, 4, 6, 10>(&d, &weights.map(offset4))
        }
        Differences::Two(d) if below(250) => {
            in_sphere_det::<2, 4, 6, 10>(&widen(&d), &weights.map(offset4))
        }
        Differences::One(d) => {
            let d = d.map(|p| p.map(|x| Wide::from_i128(x.into())));
            in_sphere_det::<20, 40, 60, 100>(&d, &weights.map(offset40))
        }
        Differences::Two(d) => in_sphere_det::<20, 40, 60, 100>(&widen(&d), &weights.map(offset40)),
        Differences::Any(d) => in_sphere_det::<20, 40, 60, 100>(&d, &weights.map(offset40)),
    }
}

/// The orthocentre of four weighted points minus `p[0]`, each coordinate correct to a few units
/// in the last place; `None` if the points are coplanar.
pub(super) fn orthocentre(p: [(&[f64; 3], f64); 4]) -> Option<[f64; 3]> {
    let weights = p.map(|q| q.1);
    let cap = weights.iter().map(|&w| lowest_bit(w)).min().unwrap_or(i32::MAX);
    let cap = if cap == i32::MAX { cap } else { cap.div_euclid(2) };
    let (d, quantum) = differences([p[1].0, p[2].0, p[3].0], p[0].0, cap);
    let unit = 2 * quantum;
    let d: [[Wide<20>; 3]; 3] = match d {
        Differences::One(d) => d.map(|p| p.map(|x| Wide::from_i128(x.into()))),
        Differences::Two(d) => widen(&d),
        Differences::Any(d) => d,
    };
    let offset = [1, 2, 3].map(|i| to_wide::<40>(weights[0], unit).sub(to_wide(weights[i], unit)));
    // Always the widest tier: this runs only where double precision is not trusted.
    orthocentre_wide::<20, 40, 60, 80>(&d, &offset, quantum)
}

/// Cramer's rule for `2 d_i . c = |d_i|^2 + offset_i` with exact numerators and denominator.
fn orthocentre_wide<const D: usize, const D2: usize, const D3: usize, const D4: usize>(
    d: &[[Wide<D>; 3]; 3],
    offset: &[Wide<D2>; 3],
    quantum: i32,
) -> Option<[f64; 3]> {
    let denominator: Wide<D3> = det3::<D, D2, D3>(d);
    if denominator.sign() == Sign::Zero {
        return None;
    }
    let (den, den_exp) = denominator.to_scaled_f64();
    let lifts = [0, 1, 2].map(|i| {
        let p = &d[i];
        p[0].mul::<D, D2>(p[0]).add(p[1].mul(p[1])).add(p[2].mul(p[2])).add(offset[i])
    });
    Some([0, 1, 2].map(|k| {
        let (x, y) = ((k + 1) % 3, (k + 2) % 3);
        let mut numerator: Wide<D4> = Wide::ZERO;
        for i in 0..3 {
            let (u, v) = (&d[(i + 1) % 3], &d[(i + 2) % 3]);
            let m: Wide<D2> = minor(&[u[x], u[y], u[x]], &[v[x], v[y], v[x]]);
            numerator = numerator.add(m.mul(lifts[i]));
        }
        // Rounded here for the first time: three roundings in all, whatever the condition.
        let (num, num_exp) = numerator.to_scaled_f64();
        scale_by_power(num / den, num_exp - den_exp + quantum - 1)
    }))
}

/// `x * 2^e`, in steps that neither overflow nor underflow before the result does.
fn scale_by_power(mut x: f64, mut e: i32) -> f64 {
    while e != 0 && x != 0.0 && x.is_finite() {
        // 2^±900 is a normal number; 2^e itself need not be one.
        let step = e.clamp(-900, 900);
        x *= f64::from_bits(((1023 + step) as u64) << 52);
        e -= step;
    }
    x
}
