//! The separation angle: how far apart points are, seen from a centre.

use crate::Vec3;

/// Pairs whose squared chord is at least this share of the longest may have the wider angle: near 180
/// degrees chords hardly change with the angle.
const NEARLY_LONGEST: f64 = 1.0 - 1e-12;

/// Largest angle between two of `points` seen from `centre`, in radians, from 0 to pi; 0 for fewer
/// than two. Points at the centre are in no direction and are left out. Cost `O(n^2)`.
///
/// For the points where a medial sphere touches the boundary this is the separation angle of
/// Foskey, Lin and Manocha 2003, doi:10.1115/1.1631582, `S = 2 arcsin(|p - q| / 2r)`; the object
/// angle of Stolpner and Siddiqi is half of it. Exact to rounding over the whole range, where the
/// arc sine loses half the digits near 180 degrees.
pub fn separation_angle(centre: Vec3, points: &[Vec3]) -> f64 {
    let directions: Vec<Vec3> =
        points.iter().filter_map(|&p| (p - centre).try_normalize()).collect();
    let (mut widest, mut longest) = (0.0_f64, 0.0_f64);
    for (i, &u) in directions.iter().enumerate() {
        for &v in &directions[i + 1..] {
            let squared = u.distance_squared(v);
            if squared < NEARLY_LONGEST * longest {
                continue;
            }
            longest = longest.max(squared);
            // Kahan: of two unit vectors, half the angle has the tangent |u - v| / |u + v|.
            widest = widest.max(2.0 * squared.sqrt().atan2((u + v).length()));
        }
    }
    widest
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn known_angles() {
        let centre = Vec3::new(0.3, -0.2, 0.7);
        let at = |degrees: f64, radius: f64| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            centre + radius * Vec3::new(cos, sin, 0.0)
        };
        for degrees in [0.0, 1e-6, 20.0, 90.0, 179.999_999, 180.0] {
            let angle = separation_angle(centre, &[at(0.0, 1.0), at(degrees, 2.0)]).to_degrees();
            assert!((angle - degrees).abs() < 1e-12, "{angle} for {degrees}");
        }
        // The widest of three pairs; a point at the centre takes no part.
        let fan = [at(0.0, 1.0), at(30.0, 1.0), centre, at(100.0, 1.0)];
        assert!((separation_angle(centre, &fan).to_degrees() - 100.0).abs() < 1e-12);
        assert_eq!(separation_angle(centre, &[]), 0.0);
        assert_eq!(separation_angle(centre, &[at(0.0, 1.0), centre]), 0.0);
    }

    proptest! {
        /// `S = 2 arcsin(|p - q| / 2r)` for points of one sphere, and no order or scale.
        #[test]
        fn agrees_with_the_chords_of_a_sphere(
            points in prop::collection::vec(prop::array::uniform3(-1.0..1.0f64), 2..9),
            radius in 0.01..10.0f64,
        ) {
            let centre = Vec3::new(0.1, 0.2, 0.3);
            let on_sphere: Vec<Vec3> = points
                .into_iter()
                .map(|p| centre + radius * Vec3::from(p).normalize_or(Vec3::X))
                .collect();
            let chords = on_sphere.iter().flat_map(|p| on_sphere.iter().map(|q| p.distance(*q)));
            let chord = chords.fold(0.0, f64::max);
            let expected = 2.0 * (chord / (2.0 * radius)).min(1.0).asin();
            let angle = separation_angle(centre, &on_sphere);
            prop_assert!((angle - expected).abs() < 1e-7, "{angle} for {expected}");
            let backwards: Vec<Vec3> = on_sphere.iter().rev().copied().collect();
            prop_assert!((separation_angle(centre, &backwards) - angle).abs() < 1e-14);
        }
    }
}
