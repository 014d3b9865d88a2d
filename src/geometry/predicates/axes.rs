//! The exact stage for axes of very different extents, such as a solid flattened to `1e-100`.
//!
//! With one common quantum such coordinates span hundreds of bits, although those of each axis do
//! not. A determinant keeps its sign when an axis is scaled by a power of two. So does the lifted
//! determinant, provided that the lifts are still summed in a common unit: only they become long.
//!
//! 1. Each axis is scaled so that its largest coordinate is in `[1/2, 1)`.
//! 2. Differences, minors and `3 x 3` determinants are those of the first two tiers.
//! 3. The lift of a point is the sum of its squared differences, each shifted by twice the exponent
//!    of its axis.

use super::differences::{Differences, differences, highest_bit, lowest_bit, widen};
use super::exact::{det3, lifted_det};
use super::wide::Wide;
use super::{Sign, narrow};

/// The largest shifts for the two widths of a lift, with room for the bits of three squares and a
/// sign.
const SHORT_SHIFT: i32 = 14 * 64 - 256;
const LONG_SHIFT: i32 = 44 * 64 - 256;

/// Below this exponent a scaled bit could underflow.
const LOWEST: i32 = -1000;

/// Differences on scaled axes, and the exponent of each axis.
struct Scaled<const K: usize> {
    differences: Differences<K>,
    exponents: [i32; 3],
}

/// Step 1; `None` where the coordinates of one axis span too many bits by themselves.
fn scaled<const K: usize>(points: [&[f64; 3]; K], origin: &[f64; 3]) -> Option<Scaled<K>> {
    let (mut factors, mut exponents) = ([1.0; 3], [0; 3]);
    for k in 0..3 {
        let on_axis = || points.iter().chain([&origin]).map(|p| p[k]);
        let top = on_axis().map(highest_bit).max().unwrap_or(i32::MIN);
        let low = on_axis().map(lowest_bit).min().unwrap_or(i32::MAX);
        if top == i32::MIN {
            continue;
        }
        exponents[k] = top.max(LOWEST);
        // The scaled coordinates must be exact, so their lowest bit must not underflow.
        if low - exponents[k] < LOWEST {
            return None;
        }
        factors[k] = f64::from_bits(((1023 - exponents[k]) as u64) << 52);
    }
    let scale = |p: &[f64; 3]| [0, 1, 2].map(|k| p[k] * factors[k]);
    let (points, origin) = (points.map(scale), scale(origin));
    let differences = differences(points.each_ref(), &origin, i32::MAX).0;
    Some(Scaled { differences, exponents })
}

/// The sign of `det(b - a, c - a, d - a)`, where the differences are narrow on scaled axes.
pub(super) fn orient3d(p: [&[f64; 3]; 3], origin: &[f64; 3]) -> Option<Sign> {
    match scaled(p, origin)?.differences {
        Differences::One(d) => Some(narrow::det3_sign(&d)),
        Differences::Two(d) => Some(det3::<2, 4, 6>(&widen(&d)).sign()),
        Differences::Any(_) => None,
    }
}

/// The in-sphere test, where the differences are narrow on scaled axes.
pub(super) fn in_sphere(p: [&[f64; 3]; 4], e: &[f64; 3]) -> Option<Sign> {
    let Scaled { differences, exponents } = scaled(p, e)?;
    let least = exponents.into_iter().min().unwrap_or(0);
    let shifts = exponents.map(|exponent| 2 * (exponent - least));
    let longest = shifts.into_iter().max().unwrap_or(0);
    let one = |d: &[[i64; 3]; 4]| d.map(|p| p.map(|x| Wide::<1>::from_i128(x.into())));
    match differences {
        Differences::One(d) if longest <= SHORT_SHIFT => {
            Some(det::<1, 2, 3, 14, 17>(&one(&d), shifts))
        }
        Differences::One(d) if longest <= LONG_SHIFT => {
            Some(det::<1, 2, 3, 44, 47>(&one(&d), shifts))
        }
        Differences::Two(d) if longest <= SHORT_SHIFT => {
            Some(det::<2, 4, 6, 14, 20>(&widen(&d), shifts))
        }
        Differences::Two(d) if longest <= LONG_SHIFT => {
            Some(det::<2, 4, 6, 44, 50>(&widen(&d), shifts))
        }
        _ => None,
    }
}

/// Steps 2 and 3 with differences of `D` words and lifts of `L`; `R = D3 + L`.
fn det<const D: usize, const D2: usize, const D3: usize, const L: usize, const R: usize>(
    d: &[[Wide<D>; 3]; 4],
    shifts: [i32; 3],
) -> Sign {
    let lift = |p: &[Wide<D>; 3]| {
        (0..3).fold(Wide::<L>::ZERO, |sum, k| {
            let square: Wide<D2> = p[k].mul(p[k]);
            sum.add(square.extended::<L>().shifted(shifts[k] as u32))
        })
    };
    lifted_det::<D, D2, D3, L, R>(d, &d.each_ref().map(lift))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::exact;
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
        fn scaled_axes_agree_with_the_widest_tier(
            p in points(), e in prop::array::uniform3(-900..180i32),
        ) {
            let scale = e.map(|e| f64::powi(2.0, e));
            let flat = p.map(|p| [0, 1, 2].map(|k| p[k] * scale[k]));
            let [a, b, c, d, e] = flat.each_ref();
            // Scaling keeps the sign of an orientation; equal weights lead past this file.
            let [p0, p1, p2, p3, _] = p.each_ref();
            let known = exact::orient3d(p0, p1, p2, p3, None);
            prop_assert_eq!(orient3d([b, c, d], a), Some(known));
            let widest = exact::power_test([a, b, c, d].map(|p| (p, 0.0)), (e, 0.0));
            prop_assert_eq!(in_sphere([a, b, c, d], e), Some(widest));
        }
    }
}
