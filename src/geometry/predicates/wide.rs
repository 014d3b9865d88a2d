//! Signed integers of a fixed number of 64-bit limbs, two's complement, least significant first.
//!
//! The caller chooses widths at which no result overflows; nothing here checks it.

use super::Sign;

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

    /// `self * 2^by`.
    pub(super) fn shifted(self, by: u32) -> Self {
        let (limbs, bits) = ((by / 64) as usize, by % 64);
        let mut moved = [0; N];
        for i in limbs..N {
            let low = if bits > 0 && i > limbs { self.0[i - limbs - 1] >> (64 - bits) } else { 0 };
            moved[i] = self.0[i - limbs] << bits | low;
        }
        Self(moved)
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
