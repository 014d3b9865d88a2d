//! Exact differences of coordinates as integers: in one word if they fit, else in two or in twenty.

use super::narrow;
use super::wide::Wide;

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
pub(super) fn to_i128(x: f64, quantum: i32) -> i128 {
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
    Two([[i128; 3]; K]),
    Any([[Wide<20>; 3]; K]),
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
        let narrow = top - quantum < narrow::BITS && (-960..=960).contains(&quantum);
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
    let quantum = highest_bit(reach).saturating_sub(narrow::BITS - 1);
    if !exact || !(-960..=960).contains(&quantum) {
        return None;
    }
    let scale = f64::from_bits(((1023 - quantum) as u64) << 52);
    let mut integers = [[0; 3]; K];
    for i in 0..K {
        for k in 0..3 {
            let scaled = d[i][k] * scale;
            integers[i][k] = scaled as i64;
            // Beside a huge difference a tiny one underflows to 0, which is an integer, too.
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
    if reach >> narrow::BITS == 0 {
        (Differences::One(wide.map(|p| p.map(|x| x as i64))), quantum)
    } else {
        (Differences::Two(wide), quantum)
    }
}

#[inline]
pub(super) fn widen<const K: usize, const N: usize>(d: &[[i128; 3]; K]) -> [[Wide<N>; 3]; K] {
    d.map(|p| p.map(Wide::from_i128))
}
