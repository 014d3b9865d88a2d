//! The smallest ball enclosing a small set of points.

use crate::Vec3;

/// Relative slack when a candidate ball is tested against the points that it must contain.
const SLACK: f64 = 1e-12;

/// Up to this many points, all subsets are tried.
const MAX_ENUMERATED: usize = 6;

/// Centre and radius of the smallest ball that encloses `points`; radius 0 for fewer than two.
///
/// The ball is determined by two, three or four of the points. For a few points all diametral
/// balls are tried, then all circumballs of triangles, then those of tetrahedra, and the smallest
/// that contains every point is taken; exact up to rounding. More points are brought in one by
/// one, the farthest first, each time replacing the determining points: the radius grows with each
/// exchange, so that no set of determining points returns.
///
/// Source: Welzl 1991, *Smallest enclosing disks (balls and ellipsoids)*, doi:10.1007/BFb0038202;
/// Gärtner 1999, *Fast and robust smallest enclosing balls*, doi:10.1007/3-540-48481-7_29 (the
/// farthest-point rule).
pub fn enclosing_ball(points: &[Vec3]) -> (Vec3, f64) {
    if points.len() <= MAX_ENUMERATED {
        let ball = by_enumeration(points);
        return (ball.centre, ball.radius);
    }
    let mut ball = by_enumeration(&points[..1]);
    loop {
        let far = points
            .iter()
            .copied()
            .max_by(|p, q| {
                p.distance_squared(ball.centre).total_cmp(&q.distance_squared(ball.centre))
            })
            .expect("more points than MAX_ENUMERATED");
        if ball.contains(&[far]) {
            return (ball.centre, ball.radius);
        }
        // At most four points determine a ball, and the farthest joins them.
        let mut determining = [far; 5];
        determining[..ball.size].copy_from_slice(&ball.support[..ball.size]);
        let grown = by_enumeration(&determining[..=ball.size]);
        if grown.radius <= ball.radius {
            // Rounding: the exchange no longer grows the ball. Cover the rest.
            return (grown.centre, far.distance(grown.centre).max(grown.radius));
        }
        ball = grown;
    }
}

/// A candidate ball and the points that determine it.
struct Ball {
    centre: Vec3,
    radius: f64,
    support: [Vec3; 4],
    /// Number of points in `support`.
    size: usize,
}

impl Ball {
    fn contains(&self, points: &[Vec3]) -> bool {
        contains_all((self.centre, self.radius), points)
    }
}

fn by_enumeration(points: &[Vec3]) -> Ball {
    let n = points.len();
    let mut best: Option<(Vec3, f64)> = None;
    let mut support = [0; 4];
    let mut size = n.min(1);
    let mut offer = |best: &mut Option<(Vec3, f64)>, ball: Option<(Vec3, f64)>, ids: &[usize]| {
        let Some(ball) = ball else { return };
        if best.is_none_or(|(_, radius)| ball.1 < radius) && contains_all(ball, points) {
            *best = Some(ball);
            support[..ids.len()].copy_from_slice(ids);
            size = ids.len();
        }
    };
    if let [p] = points {
        best = Some((*p, 0.0));
    }
    for i in 0..n {
        for j in i + 1..n {
            offer(&mut best, Some(diametral(points[i], points[j])), &[i, j]);
        }
    }
    for i in 0..n {
        for j in i + 1..n {
            for k in j + 1..n {
                let ball = triangle_circumball(points[i], points[j], points[k]);
                offer(&mut best, ball, &[i, j, k]);
            }
        }
    }
    // Of four points, a ball through three that holds the fourth is the smallest.
    let tetrahedra = if n == 4 && best.is_some() { 0 } else { n };
    for l in 0..tetrahedra {
        for k in 0..l {
            for j in 0..k {
                for i in 0..j {
                    let ball = circumball([points[i], points[j], points[k], points[l]]);
                    offer(&mut best, ball, &[i, j, k, l]);
                }
            }
        }
    }
    let support = support.map(|i| points.get(i).copied().unwrap_or_default());
    // Rounding can refuse every candidate of a flat set; a ball around the centroid encloses it.
    let (centre, radius) = best.unwrap_or_else(|| {
        let centre = points.iter().sum::<Vec3>() / n.max(1) as f64;
        (centre, points.iter().map(|p| p.distance(centre)).fold(0.0, f64::max))
    });
    Ball { centre, radius, support, size }
}

fn contains_all((centre, radius): (Vec3, f64), points: &[Vec3]) -> bool {
    // Points that determine the ball are on it up to rounding only.
    let limit = radius * (1.0 + SLACK);
    points.iter().all(|p| p.distance_squared(centre) <= limit * limit)
}

fn diametral(p: Vec3, q: Vec3) -> (Vec3, f64) {
    ((p + q) * 0.5, p.distance(q) * 0.5)
}

fn triangle_circumball(p: Vec3, q: Vec3, r: Vec3) -> Option<(Vec3, f64)> {
    let (a, b) = (q - p, r - p);
    let n = a.cross(b);
    let scale = 2.0 * n.length_squared();
    let offset = (n.cross(a) * b.length_squared() + b.cross(n) * a.length_squared()) / scale;
    offset.is_finite().then(|| (p + offset, offset.length()))
}

fn circumball([p, q, r, s]: [Vec3; 4]) -> Option<(Vec3, f64)> {
    let (a, b, c) = (q - p, r - p, s - p);
    let scale = 2.0 * a.dot(b.cross(c));
    let offset = (b.cross(c) * a.length_squared()
        + c.cross(a) * b.length_squared()
        + a.cross(b) * c.length_squared())
        / scale;
    offset.is_finite().then(|| (p + offset, offset.length()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn points(n: std::ops::Range<usize>) -> impl Strategy<Value = Vec<Vec3>> {
        let coordinate = prop_oneof![(-3i32..4).prop_map(f64::from), -3.0..3.0];
        let point = (coordinate.clone(), coordinate.clone(), coordinate);
        prop::collection::vec(point.prop_map(|(x, y, z)| Vec3::new(x, y, z)), n)
    }

    /// Badoiu-Clarkson iteration: converges to the smallest enclosing ball from outside.
    fn by_iteration(points: &[Vec3]) -> f64 {
        let mut centre = points[0];
        for step in 1..20_000 {
            let far = points
                .iter()
                .copied()
                .max_by(|a, b| a.distance_squared(centre).total_cmp(&b.distance_squared(centre)));
            centre += (far.expect("a point") - centre) / (step + 1) as f64;
        }
        points.iter().map(|p| p.distance(centre)).fold(0.0, f64::max)
    }

    #[test]
    fn known_balls() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
        // The face opposite the right angle decides: an equilateral triangle of side sqrt 2.
        assert!((enclosing_ball(&corners).1 - (2.0_f64 / 3.0).sqrt()).abs() < 1e-15);
        let square = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::X + Vec3::Y];
        assert!((enclosing_ball(&square).1 - 0.5_f64.sqrt()).abs() < 1e-15);
        assert_eq!(enclosing_ball(&[Vec3::ONE; 4]).1, 0.0);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]
        #[test]
        fn encloses_and_is_smallest(points in points(1..14)) {
            let (centre, radius) = enclosing_ball(&points);
            let reach = points.iter().map(|p| p.distance(centre)).fold(0.0, f64::max);
            prop_assert!(reach <= radius * (1.0 + 1e-9) + 1e-12);
            let iterated = by_iteration(&points);
            prop_assert!(radius <= iterated * (1.0 + 1e-9) + 1e-12, "{radius} over {iterated}");
            prop_assert!(radius >= iterated * 0.999 - 1e-12, "{radius} under {iterated}");
        }

        /// The basis of the filter by enclosing balls: on the Voronoi facet, edge and vertex dual
        /// to an edge, a triangle and a tetrahedron the radius grows, up to that of the circumball,
        /// which it reaches just where the circumcentre lies within.
        #[test]
        fn grows_along_incidence_up_to_the_circumball(points in points(4..5)) {
            let [p, q, r, s] = [0, 1, 2, 3].map(|i| points[i]);
            let [of_edge, of_triangle, of_tetrahedron] =
                [&points[..2], &points[..3], &points[..]].map(|dual| enclosing_ball(dual).1);
            prop_assert!((of_edge - p.distance(q) / 2.0).abs() < 1e-15);
            prop_assert!(of_edge <= of_triangle * (1.0 + 1e-12));
            prop_assert!(of_triangle <= of_tetrahedron * (1.0 + 1e-12));

            // The circumradius where no angle is obtuse, else half of the longest side.
            let squared = [p.distance_squared(q), q.distance_squared(r), r.distance_squared(p)];
            let longest = squared.into_iter().fold(0.0, f64::max);
            let obtuse = squared.iter().sum::<f64>() <= 2.0 * longest;
            let doubled_area = (q - p).cross(r - p).length();
            let product: f64 = squared.iter().map(|x| x.sqrt()).product();
            let expected =
                if obtuse { longest.sqrt() / 2.0 } else { product / (2.0 * doubled_area) };
            prop_assert!((of_triangle - expected).abs() <= 1e-9 * (1.0 + expected));

            // How deep the circumcentre lies below each side, from its barycentric coordinates.
            let [a, b, c] = [q - p, r - p, s - p];
            let normals = [b.cross(c), c.cross(a), a.cross(b), (b - a).cross(c - a)];
            let det = a.dot(normals[0]);
            prop_assume!(det.abs() > 1e-3);
            let sides = [a, b, c].into_iter().zip(normals);
            let offset: Vec3 = sides.map(|(v, n)| v.length_squared() / (2.0 * det) * n).sum();
            let [u, v, w] = [0, 1, 2].map(|k| offset.dot(normals[k]) / det);
            let weights = [u, v, w, 1.0 - u - v - w];
            let depths = [0, 1, 2, 3].map(|k| weights[k] * det.abs() / normals[k].length());
            let depth = depths.into_iter().fold(f64::INFINITY, f64::min);
            let circumradius = offset.length();
            prop_assert!(of_tetrahedron <= circumradius * (1.0 + 1e-9));
            if depth >= 0.0 {
                prop_assert!(of_tetrahedron >= circumradius * (1.0 - 1e-9));
            } else if depth < -1e-4 * circumradius {
                prop_assert!(of_tetrahedron < circumradius * (1.0 - 1e-9));
            }
        }
    }
}
