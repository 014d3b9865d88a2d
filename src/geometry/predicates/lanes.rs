//! Arithmetic on one number or two side by side, so that one formula serves both.

use std::ops::{Add, Mul, Sub};

/// A double, or several in lanes.
pub(super) trait Real:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self>
{
    fn splat(x: f64) -> Self;
    fn max(self, other: Self) -> Self;
    fn abs(self) -> Self;
    fn sqrt(self) -> Self;
}

impl Real for f64 {
    #[inline(always)]
    fn splat(x: f64) -> Self {
        x
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        // One instruction, unlike `f64::max`, which treats not-a-number; coordinates are finite.
        if self > other { self } else { other }
    }

    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
}

/// Two doubles.
pub(super) type Pair = ::wide::f64x2;

impl Real for Pair {
    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self::splat(x)
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.fast_max(other)
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self::abs(self)
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self::sqrt(self)
    }
}
