//! Signed integers of a fixed number of 64-bit limbs, two's complement, least significant first.
//!
//! The caller chooses widths at which no result overflows; nothing here checks it.

use crate::predicates::Sign;

/// A signed integer of `64 N` bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Wide<const N: usize>([u64; N]);

impl<const N: usize> Wide<N> {
    pub(super) const ZERO: Self = Self([0; N]);

    /// Sign-extends `value`; needs `N >= 2` or a value that fits 64 bits.
    #[inline]
    pub(super) fn from_i128(value: i128) -> Self {
        let mut limbs = [(value >> 127) as u64; N];
        limbs[0] = value as u64;
        if N > 1 {
            limbs[1] = (value >> 64) as u64;
        }
        Self(limbs)
    }

    /// `mantissa * 2^shift`, negated if `negative`.
    pub(super) fn from_shifted(mantissa: u64, shift: u32, negative: bool) -> Self {
        let mut limbs = [0; N];
        let (limb, bit) = ((shift / 64) as usize, shift % 64);
        // A shift of less than 64 bits spreads the mantissa over two limbs at most.
        let wide = u128::from(mantissa) << bit;
        limbs[limb] = wide as u64;
        if limb + 1 < N {
            limbs[limb + 1] = (wide >> 64) as u64;
        }
        if negative { Self(limbs).neg() } else { Self(limbs) }
    }

    /// The same value in more limbs.
    pub(super) fn extended<const M: usize>(self) -> Wide<M> {
        let mut limbs = [if self.is_negative() { u64::MAX } else { 0 }; M];
        limbs[..N].copy_from_slice(&self.0);
        Wide(limbs)
    }

    #[inline]
    pub(super) fn add(self, other: Self) -> Self {
        let mut sum = self.0;
        let mut carry = false;
        for i in 0..N {
            let (partial, c1) = sum[i].overflowing_add(other.0[i]);
            let (total, c2) = partial.overflowing_add(u64::from(carry));
            sum[i] = total;
            carry = c1 | c2;
        }
        Self(sum)
    }

    #[inline]
    pub(super) fn sub(self, other: Self) -> Self {
        let mut difference = self.0;
        let mut borrow = false;
        for i in 0..N {
            let (partial, b1) = difference[i].overflowing_sub(other.0[i]);
            let (total, b2) = partial.overflowing_sub(u64::from(borrow));
            difference[i] = total;
            borrow = b1 | b2;
        }
        Self(difference)
    }

    #[inline]
    pub(super) fn neg(self) -> Self {
        Self::ZERO.sub(self)
    }

    #[inline]
    fn is_negative(&self) -> bool {
        (self.0[N - 1] as i64) < 0
    }

    /// The product, where `R = N + M`.
    #[inline]
    pub(super) fn mul<const M: usize, const R: usize>(self, other: Wide<M>) -> Wide<R> {
        debug_assert!(R == N + M);
        let mut product = [0u64; R];
        for i in 0..N {
            let mut carry = 0u64;
            for j in 0..M {
                let t = u128::from(self.0[i]) * u128::from(other.0[j])
                    + u128::from(product[i + j])
                    + u128::from(carry);
                product[i + j] = t as u64;
                carry = (t >> 64) as u64;
            }
            product[i + M] = carry;
        }
        // Two's complement: read as unsigned, a negative factor is too large by 2^(its width).
        if self.is_negative() {
            subtract_from(&mut product[N..], &other.0);
        }
        if other.is_negative() {
            subtract_from(&mut product[M..], &self.0);
        }
        Wide(product)
    }

    #[inline]
    pub(super) fn sign(&self) -> Sign {
        if self.is_negative() {
            Sign::Negative
        } else if self.0.iter().any(|&limb| limb != 0) {
            Sign::Positive
        } else {
            Sign::Zero
        }
    }

    /// The value as `m * 2^e` with `m` in double precision: `|m|` is at most `2^128`, and at least
    /// `2^64` unless the value fits one limb. Two limbs are read, so `m` is off by a little more than
    /// half a unit in the last place at most.
    pub(super) fn to_scaled_f64(self) -> (f64, i32) {
        let negative = self.is_negative();
        let magnitude = if negative { self.neg() } else { self };
        let top = (0..N).rev().find(|&i| magnitude.0[i] != 0).unwrap_or(0);
        let low = if top > 0 { magnitude.0[top - 1] } else { 0 };
        let wide = u128::from(magnitude.0[top]) << 64 | u128::from(low);
        let m = wide as f64;
        (if negative { -m } else { m }, 64 * (top as i32 - 1))
    }
}

#[inline]
fn subtract_from(high: &mut [u64], other: &[u64]) {
    let mut borrow = false;
    for (h, &o) in high.iter_mut().zip(other) {
        let (partial, b1) = h.overflowing_sub(o);
        let (total, b2) = partial.overflowing_sub(u64::from(borrow));
        *h = total;
        borrow = b1 | b2;
    }
}

// The determinants of the exact stage for differences below 2^61, in native 128-bit integers.
//
// Tier 1 decides almost every call of the exact stage, and samples of spheres and grids make many
// calls per point. So the formula is written out here, which is faster than the general integers of
// [`Wide`].

/// Differences stay below two to this power.
pub(super) const BITS: i32 = 61;

/// `low + 2^64 high`, below `2^187`.
#[derive(Clone, Copy)]
struct Triple {
    low: u64,
    high: i128,
}

#[inline(always)]
fn product(a: i64, b: i64) -> i128 {
    i128::from(a) * i128::from(b)
}

/// `a.x b.y - b.x a.y`, below `2^123`.
#[inline(always)]
fn minor_narrow(a: &[i64; 3], b: &[i64; 3]) -> i128 {
    product(a[0], b[1]) - product(b[0], a[1])
}

/// `a x + b y + c z`.
#[inline(always)]
fn combine(minors: [i128; 3], z: [i64; 3]) -> Triple {
    // Halves of 64 bits: each of the three partial products stays below 2^125, so no sum overflows.
    let (mut low, mut high) = (0i128, 0i128);
    for (m, z) in minors.into_iter().zip(z) {
        low += i128::from(m as u64) * i128::from(z);
        high += product((m >> 64) as i64, z);
    }
    Triple { low: low as u64, high: high + (low >> 64) }
}

/// The sign of the determinant of three differences.
#[inline]
pub(super) fn det3_sign([a, b, c]: &[[i64; 3]; 3]) -> Sign {
    let det =
        combine([minor_narrow(b, c), minor_narrow(c, a), minor_narrow(a, b)], [a[2], b[2], c[2]]);
    match (det.high, det.low) {
        (0, 0) => Sign::Zero,
        (0.., _) => Sign::Positive,
        _ => Sign::Negative,
    }
}

/// A sum of products in columns of 64 bits. A column has 64 bits to spare, so carries wait until the
/// end.
struct Columns([i128; 5]);

impl Columns {
    #[inline(always)]
    fn add_unsigned(&mut self, column: usize, a: u64, b: u64) {
        let p = u128::from(a) * u128::from(b);
        self.0[column] += i128::from(p as u64);
        self.0[column + 1] += i128::from((p >> 64) as u64);
    }

    /// Adds the product of two limbs of which at least one is signed.
    #[inline(always)]
    fn add_signed(&mut self, column: usize, p: i128) {
        self.0[column] += i128::from(p as u64);
        self.0[column + 1] += p >> 64;
    }

    /// Adds `t l`, `|l| < 2^125`.
    #[inline(always)]
    fn add_product(&mut self, t: Triple, l: i128) {
        let (l0, l1) = (l as u64, (l >> 64) as i64);
        let (t0, t1, t2) = (t.low, t.high as u64, (t.high >> 64) as i64);
        self.add_unsigned(0, t0, l0);
        self.add_signed(1, i128::from(t0) * i128::from(l1));
        self.add_unsigned(1, t1, l0);
        self.add_signed(2, i128::from(t1) * i128::from(l1));
        self.add_signed(2, i128::from(t2) * i128::from(l0));
        self.add_signed(3, product(t2, l1));
    }

    #[inline(always)]
    fn sign(self) -> Sign {
        // The last carry has the sign of the whole; if it is 0, any bit left makes it positive.
        let mut rest = 0u64;
        let mut carry = 0i128;
        for column in self.0 {
            let sum = column + carry;
            rest |= sum as u64;
            carry = sum >> 64;
        }
        match (carry, rest) {
            (0, 0) => Sign::Zero,
            (0.., _) => Sign::Positive,
            _ => Sign::Negative,
        }
    }
}

#[inline(always)]
fn lift(p: &[i64; 3]) -> i128 {
    product(p[0], p[0]) + product(p[1], p[1]) + product(p[2], p[2])
}

/// The sign of the lifted determinant of four differences. Each lift is increased by its `offset`,
/// which is below `2^123` in absolute value.
#[inline]
pub(super) fn lifted_sign([a, b, c, d]: &[[i64; 3]; 4], offset: &[i128; 4]) -> Sign {
    let (ab, bc, cd, da) =
        (minor_narrow(a, b), minor_narrow(b, c), minor_narrow(c, d), minor_narrow(d, a));
    let (ac, bd) = (minor_narrow(a, c), minor_narrow(b, d));
    let bcd = combine([cd, -bd, bc], [b[2], c[2], d[2]]);
    let cda = combine([da, ac, cd], [c[2], d[2], a[2]]);
    let dab = combine([ab, bd, da], [d[2], a[2], b[2]]);
    let abc = combine([bc, -ac, ab], [a[2], b[2], c[2]]);
    let mut det = Columns([0; 5]);
    det.add_product(bcd, lift(a) + offset[0]);
    det.add_product(cda, -(lift(b) + offset[1]));
    det.add_product(dab, lift(c) + offset[2]);
    det.add_product(abc, -(lift(d) + offset[3]));
    det.sign()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_agree_with_native_integers() {
        let mut x = 0x1234_5678_9abc_def1u64;
        for _ in 0..10_000 {
            x = x.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            let (a, b) = (x as i64 >> (x % 7), (x.rotate_left(29) as i64) >> (x % 11));
            let product: Wide<2> =
                Wide::<1>::from_i128(a.into()).mul(Wide::<1>::from_i128(b.into()));
            assert_eq!(product, Wide::from_i128(i128::from(a) * i128::from(b)));
            let sum = Wide::<3>::from_i128(a.into()).add(Wide::from_i128(b.into()));
            assert_eq!(sum, Wide::from_i128(i128::from(a) + i128::from(b)));
        }
    }

    #[test]
    fn long_products_distribute() {
        let a = Wide::<4>::from_shifted(0xdead_beef_1234_5677, 130, true);
        let b = Wide::<4>::from_shifted(0x0fed_cba9_8765_4321, 61, false);
        let c = Wide::<4>::from_shifted(0x7fff_0000_1111_2223, 101, true);
        let left: Wide<8> = a.add(b).mul(c);
        let right: Wide<8> = a.mul::<4, 8>(c).add(b.mul(c));
        assert_eq!(left, right);
        assert_eq!(left.sign(), Sign::Positive);
        assert_eq!(b.mul::<4, 8>(c).sign(), Sign::Negative);
    }
}
