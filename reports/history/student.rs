//! Student's t distribution, as far as tests of steps need it: tails of whole degrees of freedom.
//!
//! M. Abramowitz, I. A. Stegun, Handbook of Mathematical Functions, 1964, 26.7.3 and 26.7.4: with
//! theta = atan(t / sqrt(freedom)), the share between -t and t is a finite sum of powers of
//! cos(theta).

use std::f64::consts::PI;

/// The probability of a value beyond -t or t. Exact to about 1e-15, not relative to itself: below that it is 0.
pub(super) fn both_tails(t: f64, freedom: usize) -> f64 {
    let theta = (t / (freedom.max(1) as f64).sqrt()).atan();
    let (sine, cosine) = theta.sin_cos();
    // Odd degrees have cos, 2/3 cos^3, 2 4/(3 5) cos^5, ...; even ones 1, 1/2 cos^2, 1 3/(2 4) cos^4, ...
    let odd = freedom % 2 == 1;
    let mut term = if odd { cosine } else { 1.0 };
    let mut sum = 0.0;
    let mut power = if odd { 1 } else { 0 };
    while power + 2 <= freedom {
        sum += term;
        term *= cosine * cosine * (power + 1) as f64 / (power + 2) as f64;
        power += 2;
    }
    let between = if odd { 2.0 / PI * (theta + sine * sum) } else { sine * sum };
    (1.0 - between).max(0.0)
}

/// The value beyond which, on both sides, lies the probability `tails`.
pub(crate) fn beyond(tails: f64, freedom: usize) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    while both_tails(high, freedom) > tails && high < 1e9 {
        high *= 2.0;
    }
    // Sixty halvings leave nothing between the ends.
    for _ in 0..60 {
        let middle = (low + high) / 2.0;
        match both_tails(middle, freedom) > tails {
            true => low = middle,
            false => high = middle,
        }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tails_are_those_of_the_tables() {
        // Quantiles of both tails, as printed in every table of the distribution.
        let table = [
            (1, 0.05, 12.7062),
            (2, 0.05, 4.30265),
            (3, 0.01, 5.84091),
            (4, 0.001, 8.61030),
            (9, 0.05, 2.26216),
            (10, 0.01, 3.16927),
            (30, 0.05, 2.04227),
            (120, 0.01, 2.61742),
        ];
        for (freedom, tails, quantile) in table {
            let error = (beyond(tails, freedom) / quantile - 1.0).abs();
            assert!(error < 1e-5, "{freedom} degrees, {tails}: {}", beyond(tails, freedom));
        }
    }

    #[test]
    fn many_degrees_are_the_normal_distribution() {
        assert!((beyond(0.05, 100_000) - 1.95996).abs() < 1e-4);
        // Far out as well: 1e-9 on both sides are 6.1094 standard deviations.
        assert!((beyond(1e-9, 1_000_000) - 6.1094).abs() < 1e-3);
    }
}
