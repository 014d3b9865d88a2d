//! Sizes of a medial mesh, and angles of its triangles as in Table I of Li, Wang, Sun, Guo, Zhang, Wang, "Q-MAT:
//! Computing Medial Axis Transform by Quadratic Error Minimization", ACM TOG 35 (2015),
//! <https://doi.org/10.1145/2753755>, with two shares more.

use super::evaluation::{Counts, TriangleQuality};
use crate::Vec3;
use crate::complex::{Incidence, MedialMesh, ZERO_LENGTH};

/// Numbers of spheres, edges and faces, of edges without a face, of spheres without an edge, and
/// of edges with three faces or more. Cost `O(V + E + F)`.
///
/// # Panics
/// If the mesh is not in canonical form; see [`MedialMesh::check`].
pub fn counts(mesh: &MedialMesh) -> Counts {
    let incidence = Incidence::of(mesh);
    let faces_at = incidence.faces_at();
    Counts {
        spheres: mesh.spheres.len() as u64,
        edges: mesh.edges.len() as u64,
        faces: mesh.faces.len() as u64,
        lone_edges: faces_at.iter().filter(|&&faces| faces == 0).count() as u64,
        isolated: degrees(mesh).into_iter().filter(|&degree| degree == 0).count() as u64,
        nonmanifold_edges: faces_at.iter().filter(|&&faces| faces >= 3).count() as u64,
    }
}

/// For each sphere the number of its edges.
pub(super) fn degrees(mesh: &MedialMesh) -> Vec<u32> {
    let mut degrees = vec![0; mesh.spheres.len()];
    for &sphere in mesh.edges.iter().flatten() {
        degrees[sphere as usize] += 1;
    }
    degrees
}

/// Angles of the triangles of centres. The angles of triangles with a height below [`ZERO_LENGTH`] are
/// rounding; such triangles are counted separately and enter no mean or share.
///
/// Lengths are in units of the bounding-box diagonal. Means and shares are `None` when no
/// triangle is left. Cost `O(F)`.
///
/// # Panics
/// If a face is out of range.
pub fn triangle_quality(mesh: &MedialMesh) -> TriangleQuality {
    let angles: Vec<[f64; 2]> =
        mesh.faces.iter().filter_map(|face| extreme_angles(corners(mesh, face))).collect();
    let share = |n: f64| (!angles.is_empty()).then(|| n / angles.len() as f64);
    let below = |limit: f64| share(angles.iter().filter(|[min, _]| *min < limit).count() as f64);
    TriangleQuality {
        min_angle_mean: share(angles.iter().map(|[min, _]| min).sum()),
        max_angle_mean: share(angles.iter().map(|[_, max]| max).sum()),
        below_30: below(30.0),
        below_10: below(10.0),
        below_1: below(1.0),
        zero_area: (mesh.faces.len() - angles.len()) as u64,
    }
}

/// The centres of a face.
pub(super) fn corners(mesh: &MedialMesh, face: &[u32; 3]) -> [Vec3; 3] {
    face.map(|sphere| mesh.spheres[sphere as usize].centre)
}

/// Smallest and largest angle of a triangle, in degrees, or `None` where it has no area.
pub(super) fn extreme_angles([a, b, c]: [Vec3; 3]) -> Option<[f64; 2]> {
    let doubled_area = (b - a).cross(c - a).length();
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    let height = doubled_area / longest;
    // Three coincident centres have no height either: 0 / 0.
    if height.is_nan() || height < ZERO_LENGTH {
        return None;
    }
    // The arc tangent is exact to rounding for needles and caps, where the arc cosine is not.
    let angles = [(b - a, c - a), (c - b, a - b), (a - c, b - c)]
        .map(|(u, v)| u.cross(v).length().atan2(u.dot(v)).to_degrees());
    let smallest = angles.into_iter().fold(f64::INFINITY, f64::min);
    let largest = angles.into_iter().fold(0.0, f64::max);
    Some([smallest, largest])
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::complex::Sphere;

    #[test]
    fn every_kind_is_counted_once() {
        // Three triangles on the edge 01, a lone edge 45, two isolated spheres.
        let spheres = vec![Sphere::new(Vec3::ZERO, 1.0); 9];
        let faces = vec![[0, 1, 2], [0, 1, 3], [0, 1, 4]];
        let mesh = MedialMesh::from_simplices(spheres, vec![[4, 5], [5, 8]], faces).unwrap();
        let expected = Counts {
            spheres: 9,
            edges: 9,
            faces: 3,
            lone_edges: 2,
            isolated: 2,
            nonmanifold_edges: 1,
        };
        assert_eq!(counts(&mesh), expected);
        assert_eq!(counts(&MedialMesh::default()).spheres, 0);
    }

    fn mesh_of(triangles: &[[Vec3; 3]]) -> MedialMesh {
        let spheres = triangles.iter().flatten().map(|&p| Sphere::new(p, 1.0)).collect();
        let faces = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        MedialMesh::from_simplices(spheres, vec![], faces).unwrap()
    }

    fn planar(points: [[f64; 2]; 3]) -> [Vec3; 3] {
        points.map(|[x, y]| Vec3::new(x, y, 0.0))
    }

    #[test]
    fn known_triangles_give_known_angles() {
        let equilateral = planar([[0.0, 0.0], [1.0, 0.0], [0.5, 0.75f64.sqrt()]]);
        let right = planar([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
        let tangent = 5f64.to_radians().tan();
        let needle = planar([[0.0, 0.0], [1.0, 0.0], [1.0, tangent]]);
        let cap = planar([[0.0, 0.0], [1.0, 0.0], [0.5, 1e-3]]);
        let quality = triangle_quality(&mesh_of(&[equilateral, right, needle, cap]));
        let flat = 1e-3f64.atan2(0.5).to_degrees();
        let close = |x: Option<f64>, y: f64| assert!((x.unwrap() - y).abs() < 1e-12, "{x:?} {y}");
        close(quality.min_angle_mean, (60.0 + 45.0 + 5.0 + flat) / 4.0);
        close(quality.max_angle_mean, (60.0 + 90.0 + 90.0 + 180.0 - 2.0 * flat) / 4.0);
        assert_eq!(quality.below_30, Some(0.5));
        assert_eq!(quality.below_10, Some(0.5));
        assert_eq!(quality.below_1, Some(0.25));
        assert_eq!(quality.zero_area, 0);
    }

    #[test]
    fn triangles_without_area_are_counted_apart() {
        let collinear = planar([[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]]);
        let coincident = planar([[0.0, 0.0], [0.0, 0.0], [1.0, 0.0]]);
        let noise = planar([[0.0, 0.0], [1e-13, 1e-13], [0.1, 0.0]]);
        let right = planar([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
        let quality = triangle_quality(&mesh_of(&[collinear, coincident, noise, right]));
        assert_eq!(quality.zero_area, 3);
        assert_eq!(quality.max_angle_mean, Some(90.0));
        let none = triangle_quality(&mesh_of(&[collinear]));
        assert_eq!((none.min_angle_mean, none.below_1, none.zero_area), (None, None, 1));
    }

    proptest! {
        #[test]
        fn angles_do_not_change_under_similarities(
            points in prop::array::uniform3(prop::array::uniform3(-1.0..1.0f64)),
            axis in prop::array::uniform3(0.1..1.0f64), turn in 0.0..6.0f64, scale in 0.01..100.0f64,
        ) {
            let points = points.map(Vec3::from);
            let rotation = glam::DQuat::from_axis_angle(Vec3::from(axis).normalize(), turn);
            let moved = points.map(|p| rotation * p * scale + Vec3::new(3.0, -2.0, 1.0));
            if let (Some(a), Some(b)) = (extreme_angles(points), extreme_angles(moved)) {
                prop_assert!((a[0] - b[0]).abs() < 1e-6 && (a[1] - b[1]).abs() < 1e-6);
                prop_assert!(a[0] <= 60.0 + 1e-12 && a[1] >= 60.0 - 1e-12);
            }
        }
    }
}
