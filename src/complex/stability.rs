//! The stability ratio of a medial edge.

use super::Sphere;

/// Edges shorter than this count as having no length, in units of the bounding-box diagonal:
/// the radii of circumcentres that coincide differ by rounding noise alone.
pub const ZERO_LENGTH: f64 = 1e-12;

/// Stability ratio `max(0, d - |r_a - r_b|) / d` of the edge between two spheres, in `[0, 1]`,
/// with `d` the distance of the centres; 0 when `d` is below [`ZERO_LENGTH`].
///
/// Lengths are in units of the bounding-box diagonal. 0: one ball holds the other, a pure spike;
/// 1: equal radii. Li, Wang, Sun, Guo, Zhang, Wang, "Q-MAT: Computing Medial Axis Transform by
/// Quadratic Error Minimization", ACM TOG 35 (2015), <https://doi.org/10.1145/2753755>.
pub fn stability_ratio(a: Sphere, b: Sphere) -> f64 {
    let d = a.centre.distance(b.centre);
    if d < ZERO_LENGTH {
        return 0.0;
    }
    (d - (a.radius - b.radius).abs()).max(0.0) / d
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::Vec3;

    #[test]
    fn contained_equal_and_coincident_balls() {
        let at = |x: f64, r: f64| Sphere::new(Vec3::new(x, 0.0, 0.0), r);
        assert_eq!(stability_ratio(at(0.0, 1.0), at(0.5, 0.25)), 0.0);
        assert_eq!(stability_ratio(at(0.0, 1.0), at(0.5, 1.0)), 1.0);
        assert_eq!(stability_ratio(at(0.0, 1.0), at(1.0, 0.25)), 0.25);
        assert_eq!(stability_ratio(at(0.0, 1.0), at(0.0, 1.0)), 0.0);
        assert_eq!(stability_ratio(at(0.0, 1.0), at(1e-13, 1.0)), 0.0);
    }

    proptest! {
        /// The cost `c = d / |dr|` of the progressive medial axis transform orders edges
        /// the same way, `ratio = max(0, 1 - 1/c)`.
        #[test]
        fn agrees_with_the_cost_of_the_progressive_transform(
            c in prop::array::uniform3(-1.0..1.0f64), r in 0.0..1.0f64, s in 0.0..1.0f64,
        ) {
            let (a, b) = (Sphere::new(Vec3::ZERO, r), Sphere::new(Vec3::from(c), s));
            let cost = b.centre.length() / (r - s).abs();
            let ratio = stability_ratio(a, b);
            prop_assert!((0.0..=1.0).contains(&ratio));
            prop_assert!((ratio - (1.0 - 1.0 / cost).max(0.0)).abs() < 1e-14);
            prop_assert_eq!(ratio, stability_ratio(b, a));
        }
    }
}
