//! The determinants of the exact stage for differences below 2^61, in native 128-bit integers.
//!
//! Tier 1 decides almost every call of the exact stage, and samples of spheres and grids make many
//! calls per point. So the formula is written out here, which is faster than the general integers of
//! [`super::wide`].

use super::Sign;

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
fn minor(a: &[i64; 3], b: &[i64; 3]) -> i128 {
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
    let det = combine([minor(b, c), minor(c, a), minor(a, b)], [a[2], b[2], c[2]]);
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

/// The sign of the lifted determinant of four differences. Each lift is increased by its `offset`,
/// which is below `2^123` in absolute value.
#[inline]
pub(super) fn lifted_sign([a, b, c, d]: &[[i64; 3]; 4], offset: &[i128; 4]) -> Sign {
    let lift = |p: &[i64; 3]| product(p[0], p[0]) + product(p[1], p[1]) + product(p[2], p[2]);
    let (ab, bc, cd, da) = (minor(a, b), minor(b, c), minor(c, d), minor(d, a));
    let (ac, bd) = (minor(a, c), minor(b, d));
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
