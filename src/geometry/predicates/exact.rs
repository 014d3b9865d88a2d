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
//! Compared with floating-point expansions: no branch depends on the data beyond the choice of
//! the tier, exact zeros (cospherical points) cost no more than other values, and nothing overflows
//! or underflows.

use crate::predicates::integers::Wide;
use crate::predicates::{Sign, integers};

/// `a.x b.y - b.x a.y`, of twice the width.
#[inline]
pub(super) fn minor<const D: usize, const D2: usize>(
    a: &[Wide<D>; 3],
    b: &[Wide<D>; 3],
) -> Wide<D2> {
    a[0].mul::<D, D2>(b[1]).sub(b[0].mul(a[1]))
}

#[inline]
pub(super) fn dot<const D: usize, const D2: usize>(a: &[Wide<D>; 3], b: &[Wide<D>; 3]) -> Wide<D2> {
    a[0].mul::<D, D2>(b[0]).add(a[1].mul(b[1])).add(a[2].mul(b[2]))
}

#[inline]
fn det3<const D: usize, const D2: usize, const D3: usize>(
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
        return integers::det3_sign(&grid.differences([b, c, d], a));
    }
    match differences([b, c, d], a, i32::MAX).0 {
        Differences::One(d) => integers::det3_sign(&d),
        Differences::Two(d) => det3::<2, 4, 6>(&d).sign(),
        Differences::Any(d) => det3::<20, 40, 60>(&d).sign(),
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
        Differences::One(d) => parallel::<1, 2>(widen(&d)),
        Differences::Two(d) => parallel::<2, 4>(d),
        Differences::Any(d) => parallel::<20, 40>(d),
    }
}

/// The sign of the determinant of four differences with their lifts, increased by offsets.
#[inline]
fn in_sphere_det<const D: usize, const D2: usize, const D3: usize, const D5: usize>(
    [a, b, c, d]: &[[Wide<D>; 3]; 4],
    offset: &[Wide<D2>; 4],
) -> Sign {
    let lifts: [Wide<D2>; 4] = [a, b, c, d].map(|p| dot(p, p));
    let lifts = [0, 1, 2, 3].map(|i| lifts[i].add(offset[i]));
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
    let inside: Wide<D5> = bcd
        .mul::<D2, D5>(lifts[0])
        .sub(cda.mul(lifts[1]))
        .add(dab.mul(lifts[2]))
        .sub(abc.mul(lifts[3]));
    inside.sign()
}

/// The power test without weights, see [`power_test`]; `grid` is one that all five points lie on,
/// if known.
pub(super) fn in_sphere(p: [&[f64; 3]; 4], e: &[f64; 3], grid: Option<Grid>) -> Sign {
    if let Some(grid) = grid {
        return integers::lifted_sign(&grid.differences(p, e), &[0; 4]);
    }
    match differences(p, e, i32::MAX).0 {
        Differences::One(d) => integers::lifted_sign(&d, &[0; 4]),
        Differences::Two(d) => in_sphere_det::<2, 4, 6, 10>(&d, &[Wide::ZERO; 4]),
        Differences::Any(d) => in_sphere_det::<20, 40, 60, 100>(&d, &[Wide::ZERO; 4]),
    }
}

/// The sign of the lifted determinant of four weighted points and a fifth, with the lift
/// `|p|^2 - w` taken exactly.
pub(super) fn power_test(p: [(&[f64; 3], f64); 4], e: (&[f64; 3], f64)) -> Sign {
    let weights = p.map(|q| q.1);
    let range = WeightRange::of(&weights).with(e.1);
    let (d, quantum) = differences(p.map(|q| q.0), e.0, range.quantum_cap());
    let unit = 2 * quantum;
    match range.tier(d, unit) {
        Differences::One(d) => {
            integers::lifted_sign(&d, &weights.map(|w: f64| to_i128(e.1, unit) - to_i128(w, unit)))
        }
        Differences::Two(d) => in_sphere_det::<2, 4, 6, 10>(&d, &offsets(e.1, weights, unit)),
        Differences::Any(d) => in_sphere_det::<20, 40, 60, 100>(&d, &offsets(e.1, weights, unit)),
    }
}

/// The differences of a weight to others, in units of `2^unit`.
fn offsets<const N: usize, const K: usize>(w: f64, others: [f64; K], unit: i32) -> [Wide<N>; K] {
    others.map(|other| to_wide::<N>(w, unit).sub(to_wide(other, unit)))
}

/// The bits that weights span: the exponent of the lowest one, and one more than that of the highest.
#[derive(Clone, Copy)]
pub(super) struct WeightRange {
    lowest: i32,
    top: i32,
}

impl WeightRange {
    pub(super) fn of(weights: &[f64]) -> Self {
        weights.iter().fold(Self { lowest: i32::MAX, top: i32::MIN }, |range, &w| range.with(w))
    }

    pub(super) fn with(self, w: f64) -> Self {
        Self { lowest: self.lowest.min(lowest_bit(w)), top: self.top.max(highest_bit(w)) }
    }

    /// Weights must be integers in units of the squared quantum, so they bound the quantum by half
    /// their lowest exponent.
    pub(super) fn quantum_cap(self) -> i32 {
        if self.lowest == i32::MAX { i32::MAX } else { self.lowest.div_euclid(2) }
    }

    /// Whether weights in units of `2^unit` have at most this many bits.
    fn fits(self, bits: i32, unit: i32) -> bool {
        // All weights are zero where there is no highest bit.
        self.top == i32::MIN || self.top - unit <= bits
    }

    /// The narrowest tier that holds differences, and these weights in units of `2^unit`.
    pub(super) fn tier<const K: usize>(self, found: Differences<K>, unit: i32) -> Differences<K> {
        // The limits leave room in a lift for three squares, a difference of weights and the sign.
        match found {
            Differences::One(_) if self.fits(122, unit) => found,
            Differences::One(d) if self.fits(250, unit) => Differences::Two(widen(&d)),
            Differences::Two(_) if self.fits(250, unit) => found,
            _ => Differences::Any(found.into_wide()),
        }
    }
}

/// The orthocentre of four weighted points minus `p[0]`, each coordinate correct to a few units
/// in the last place; `None` if the points are coplanar.
pub(super) fn orthocentre(p: [(&[f64; 3], f64); 4]) -> Option<[f64; 3]> {
    let weights = p.map(|q| q.1);
    let range = WeightRange::of(&weights);
    let (d, quantum) = differences([p[1].0, p[2].0, p[3].0], p[0].0, range.quantum_cap());
    let ([first, others @ ..], unit) = (weights, 2 * quantum);
    // Samples of plane faces have many nearly flat cells, so that narrow tiers matter.
    match range.tier(d, unit) {
        Differences::One(d) => {
            cramer::<1, 2, 3, 4>(&widen(&d), &offsets(first, others, unit), quantum)
        }
        Differences::Two(d) => cramer::<2, 4, 6, 8>(&d, &offsets(first, others, unit), quantum),
        Differences::Any(d) => cramer::<20, 40, 60, 80>(&d, &offsets(first, others, unit), quantum),
    }
}

/// Cramer's rule for `2 d_i . c = |d_i|^2 + offset_i` with exact numerators and denominator.
fn cramer<const D: usize, const D2: usize, const D3: usize, const D4: usize>(
    d: &[[Wide<D>; 3]; 3],
    offset: &[Wide<D2>; 3],
    quantum: i32,
) -> Option<[f64; 3]> {
    // Exact, so that coplanar points are recognised as such.
    let denominator: Wide<D3> = det3::<D, D2, D3>(d);
    if denominator.sign() == Sign::Zero {
        return None;
    }
    let (den, den_exp) = denominator.to_scaled_f64();
    let lifts: [Wide<D2>; 3] = [0, 1, 2].map(|i| dot(&d[i], &d[i]).add(offset[i]));
    Some([0, 1, 2].map(|k| {
        let (x, y) = ((k + 1) % 3, (k + 2) % 3);
        let mut numerator: Wide<D4> = Wide::ZERO;
        for i in 0..3 {
            let (u, v) = (&d[(i + 1) % 3], &d[(i + 2) % 3]);
            let m: Wide<D2> = minor(&[u[x], u[y], u[x]], &[v[x], v[y], v[x]]);
            numerator = numerator.add(m.mul(lifts[i]));
        }
        // Rounded here for the first time: three roundings in all, for any condition.
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

// Exact differences of coordinates as integers: in one word if they fit, else in two or in twenty.

/// A double as `mantissa * 2^exponent`.
#[derive(Clone, Copy)]
struct Parts {
    mantissa: u64,
    exponent: i32,
    negative: bool,
}

#[inline]
fn parts(x: f64) -> Parts {
    let bits = x.to_bits();
    let biased = (bits >> 52) as i32 & 0x7ff;
    let fraction = bits & ((1 << 52) - 1);
    // Subnormal numbers have no implicit bit, and the exponent of the smallest normal ones.
    let implicit = u64::from(biased != 0) << 52;
    Parts {
        mantissa: fraction | implicit,
        exponent: biased.max(1) - 1075,
        negative: (bits >> 63) != 0,
    }
}

/// The exponent of the lowest set bit of `x`; `i32::MAX` for zero.
#[inline]
pub(crate) fn lowest_bit(x: f64) -> i32 {
    let p = parts(x);
    if p.mantissa == 0 { i32::MAX } else { p.exponent + p.mantissa.trailing_zeros() as i32 }
}

/// One more than the exponent of the highest set bit of `x`; `i32::MIN` for zero.
#[inline]
pub(crate) fn highest_bit(x: f64) -> i32 {
    let p = parts(x);
    if p.mantissa == 0 { i32::MIN } else { p.exponent + 64 - p.mantissa.leading_zeros() as i32 }
}

/// `x / 2^quantum` as an integer; needs `|x| < 2^(quantum + 127)` and `quantum <= lowest_bit(x)`.
#[inline]
fn to_i128(x: f64, quantum: i32) -> i128 {
    let p = parts(x);
    let shift = p.exponent - quantum;
    let magnitude = if p.mantissa == 0 {
        0
    } else if shift >= 0 {
        i128::from(p.mantissa) << shift
    } else {
        i128::from(p.mantissa >> -shift)
    };
    if p.negative { -magnitude } else { magnitude }
}

/// `x / 2^quantum` for any exponents.
pub(super) fn to_wide<const N: usize>(x: f64, quantum: i32) -> Wide<N> {
    let p = parts(x);
    let shift = p.exponent - quantum;
    if p.mantissa == 0 {
        Wide::ZERO
    } else if shift >= 0 {
        Wide::from_shifted(p.mantissa, shift as u32, p.negative)
    } else {
        Wide::from_shifted(p.mantissa >> -shift, 0, p.negative)
    }
}

/// Differences of `K` points to an origin as integers, in the narrowest tier that holds them.
pub(super) enum Differences<const K: usize> {
    One([[i64; 3]; K]),
    Two([[Wide<2>; 3]; K]),
    Any([[Wide<20>; 3]; K]),
}

impl<const K: usize> Differences<K> {
    /// The same in the widest tier.
    fn into_wide(self) -> [[Wide<20>; 3]; K] {
        match self {
            Self::One(d) => widen(&d),
            Self::Two(d) => d.map(|p| p.map(Wide::extended)),
            Self::Any(d) => d,
        }
    }
}

/// A grid on which differences fit one word: coordinates are multiples of `1 / scale`, a power of
/// two.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grid {
    scale: f64,
}

impl Grid {
    /// The grid of coordinates that are multiples of `2^quantum` and below `2^top`, if differences
    /// on it are narrow.
    pub(super) fn new(quantum: i32, top: i32) -> Option<Self> {
        let narrow = top - quantum < integers::BITS && (-960..=960).contains(&quantum);
        narrow.then(|| Self { scale: f64::from_bits(((1023 - quantum) as u64) << 52) })
    }

    #[inline(always)]
    pub(super) fn differences<const K: usize>(
        self,
        points: [&[f64; 3]; K],
        origin: &[f64; 3],
    ) -> [[i64; 3]; K] {
        let mut d = [[0; 3]; K];
        // Both conversions are exact: a power of two times a multiple of its reciprocal.
        for k in 0..3 {
            let o = (origin[k] * self.scale) as i64;
            for i in 0..K {
                d[i][k] = (points[i][k] * self.scale) as i64 - o;
            }
        }
        d
    }
}

/// Differences as integers, and their quantum, computed through doubles; `None` if a difference is
/// rounded or they span too many bits.
///
/// The usual case: the differences of neighbouring points are exact as doubles.
#[inline]
fn close_differences<const K: usize>(
    points: [&[f64; 3]; K],
    origin: &[f64; 3],
) -> Option<([[i64; 3]; K], i32)> {
    let mut d = [[0.0; 3]; K];
    let mut reach = 0.0f64;
    let mut exact = true;
    for i in 0..K {
        for k in 0..3 {
            let (a, b) = (points[i][k], origin[k]);
            let difference = a - b;
            // Knuth's error term of a sum, which is zero exactly if nothing was rounded.
            let virtual_b = a - difference;
            let virtual_a = difference + virtual_b;
            exact &= (a - virtual_a) + (virtual_b - b) == 0.0;
            reach = reach.max(difference.abs());
            d[i][k] = difference;
        }
    }
    let quantum = highest_bit(reach).saturating_sub(integers::BITS - 1);
    if !exact || !(-960..=960).contains(&quantum) {
        return None;
    }
    let scale = f64::from_bits(((1023 - quantum) as u64) << 52);
    let mut integers = [[0; 3]; K];
    for i in 0..K {
        for k in 0..3 {
            let scaled = d[i][k] * scale;
            integers[i][k] = scaled as i64;
            // Next to a huge difference a tiny one underflows to 0, which is an integer, too.
            exact &= integers[i][k] as f64 == scaled && (scaled == 0.0) == (d[i][k] == 0.0);
        }
    }
    exact.then_some((integers, quantum))
}

/// The common quantum of the points and their differences to `origin` in units of it.
///
/// `quantum_cap` is an upper bound on the quantum, from weights; `i32::MAX` without.
pub(super) fn differences<const K: usize>(
    points: [&[f64; 3]; K],
    origin: &[f64; 3],
    quantum_cap: i32,
) -> (Differences<K>, i32) {
    if let Some((d, quantum)) = close_differences(points, origin)
        && quantum <= quantum_cap
    {
        return (Differences::One(d), quantum);
    }
    let mut quantum = quantum_cap;
    let mut top = i32::MIN;
    for p in points.iter().chain([&origin]) {
        for &x in p.iter() {
            quantum = quantum.min(lowest_bit(x));
            top = top.max(highest_bit(x));
        }
    }
    if top == i32::MIN {
        return (Differences::One([[0; 3]; K]), quantum.min(0));
    }
    if let Some(grid) = Grid::new(quantum, top) {
        return (Differences::One(grid.differences(points, origin)), quantum);
    }
    let bits = top - quantum;
    // A difference has one bit more, and its sign another: i128 holds up to here.
    if bits > 125 {
        let o = origin.map(|x| to_wide::<20>(x, quantum));
        let d = points.map(|p| [0, 1, 2].map(|k| to_wide::<20>(p[k], quantum).sub(o[k])));
        return (Differences::Any(d), quantum);
    }
    let o = origin.map(|x| to_i128(x, quantum));
    let mut wide = [[0i128; 3]; K];
    let mut reach = 0u128;
    for i in 0..K {
        for k in 0..3 {
            wide[i][k] = to_i128(points[i][k], quantum) - o[k];
            reach |= wide[i][k].unsigned_abs();
        }
    }
    // Coordinates may be long and their differences short.
    if reach >> integers::BITS == 0 {
        (Differences::One(wide.map(|p| p.map(|x| x as i64))), quantum)
    } else {
        (Differences::Two(widen(&wide)), quantum)
    }
}

#[inline]
pub(super) fn widen<T: Copy + Into<i128>, const K: usize, const N: usize>(
    d: &[[T; 3]; K],
) -> [[Wide<N>; 3]; K] {
    d.map(|p| p.map(|x| Wide::from_i128(x.into())))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Small integers, so that many determinants are zero, and any numbers.
    fn points() -> impl Strategy<Value = [[f64; 3]; 5]> {
        let whole = prop::array::uniform5(prop::array::uniform3(-3..4i32))
            .prop_map(|points| points.map(|p| p.map(f64::from)));
        prop_oneof![whole, prop::array::uniform5(prop::array::uniform3(-1.0..1.0f64))]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2_000))]

        #[test]
        fn orthocentres_of_all_tiers_agree(
            mut p in points(), shift in prop_oneof![Just(0.0), -1e-9..1e-9, -1e9..1e9],
            w in prop::array::uniform4(prop_oneof![Just(0.0), -1.0..1.0, -1e-30..1e-30]),
        ) {
            // With more bits, and nearly coplanar.
            p.iter_mut().for_each(|p| p[0] += shift);
            p[3][2] = p[0][2] + shift * p[3][1];
            let [sites @ .., _] = p.each_ref();
            let cap = WeightRange::of(&w).quantum_cap();
            let (d, quantum) = differences([sites[1], sites[2], sites[3]], sites[0], cap);
            let offset = offsets(w[0], [w[1], w[2], w[3]], 2 * quantum);
            let widest = cramer::<20, 40, 60, 80>(&d.into_wide(), &offset, quantum);
            prop_assert_eq!(orthocentre([0, 1, 2, 3].map(|i| (sites[i], w[i]))), widest);
        }
    }
}
