//! Quality of triangles and of structure, as MATStruct measures it.
//!
//! N. Wang et al., "MATStruct: High-Quality Medial Mesh Computation via Structure-aware Variational Optimization",
//! SIGGRAPH Asia 2025, <https://arxiv.org/abs/2510.10751>; the definitions are those of its `src/eval/mesh_eval.cpp`.
//!
//! - *Triangle quality*: `Q = 6 / sqrt(3) A / (h s)`, with the area `A`, the longest edge `h` and half the perimeter
//!   `s`; 1 for an equilateral triangle. The mean over all faces, not weighted.
//! - *Bad structure*: the share of spheres on seams and junctions that are not of a feature's type.
//!
//! # Deviations from the code
//! The area is that of the cross product. Heron's formula, as in the code, is the root of a negative number for some
//! triangles whose corners are on a line, and the whole mean is then no number. Faces whose longest edge has no
//! length have `Q = 0`; they and the collinear ones are counted.

use serde::Serialize;

use crate::Vec3;
use crate::complex::MedialMesh;

/// Faces of a lower quality have no area but by rounding.
pub const DEGENERATE: f64 = 1e-12;

/// Quality of the faces of a medial mesh.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StructureQuality {
    /// Mean quality of all faces, the degenerate ones as 0; `None` without faces.
    pub quality: Option<f64>,
    /// Faces of a quality below [`DEGENERATE`].
    pub degenerate: usize,
    /// All faces.
    pub faces: usize,
}

/// The quality of a triangle, 0 to 1; the same at any scale.
///
/// ```
/// use medial::{Vec3, metrics::compat::matstruct_face_quality};
///
/// let right = [Vec3::ZERO, Vec3::new(3.0, 0.0, 0.0), Vec3::new(0.0, 4.0, 0.0)];
/// assert!((matstruct_face_quality(right) - 0.692820).abs() < 1e-6);
/// ```
pub fn matstruct_face_quality([a, b, c]: [Vec3; 3]) -> f64 {
    let sides = [b - a, c - b, a - c];
    let size = sides.iter().map(|side| side.abs().max_element()).fold(0.0, f64::max);
    if !(size > 0.0 && size.is_finite()) {
        return 0.0;
    }
    // In units of the size, so that no square overflows or vanishes.
    let sides = sides.map(|side| side / size);
    let lengths = sides.map(Vec3::length);
    let longest = lengths.into_iter().fold(0.0, f64::max);
    let half_perimeter = 0.5 * lengths.iter().sum::<f64>();
    let area = 0.5 * sides[0].cross(sides[1]).length();
    6.0 / 3.0_f64.sqrt() * area / (longest * half_perimeter)
}

/// The mean quality of the faces of a medial mesh, over their centres.
///
/// # Panics
/// If a face names a sphere that does not exist.
pub fn matstruct_quality(mesh: &MedialMesh) -> StructureQuality {
    let quality =
        |face: &[u32; 3]| matstruct_face_quality(face.map(|v| mesh.spheres[v as usize].centre));
    let qualities: Vec<f64> = mesh.faces.iter().map(quality).collect();
    let faces = qualities.len();
    let degenerate = qualities.iter().filter(|&&quality| quality < DEGENERATE).count();
    let mean = qualities.iter().sum::<f64>() / faces as f64;
    StructureQuality { quality: (faces > 0).then_some(mean), degenerate, faces }
}

/// The share of the spheres on seams and junctions that are not of a feature's type; `None` where there are none.
///
/// `structure` has the spheres of all seams and junctions, which may repeat; each counts once. `is_feature` says of
/// each sphere whether its type is that of a feature. Both come from the trailer and the types of a file of
/// MATStruct's: no other file says so.
///
/// # Panics
/// If `structure` names a sphere that does not exist.
pub fn matstruct_bad_share(structure: &[u32], is_feature: &[bool]) -> Option<f64> {
    let mut spheres = structure.to_vec();
    spheres.sort_unstable();
    spheres.dedup();
    let bad = spheres.iter().filter(|&&sphere| !is_feature[sphere as usize]).count();
    (!spheres.is_empty()).then(|| bad as f64 / spheres.len() as f64)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::complex::Sphere;

    fn flat(points: [[f64; 2]; 3]) -> [Vec3; 3] {
        points.map(|[x, y]| Vec3::new(x, y, 0.0))
    }

    #[test]
    fn published_values_of_known_triangles() {
        let root = 3.0_f64.sqrt();
        for (triangle, expected) in [
            ([[0.0, 0.0], [1.0, 0.0], [0.5, root / 2.0]], 1.0),
            ([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], 0.717439),
            ([[0.0, 0.0], [3.0, 0.0], [0.0, 4.0]], 0.692820),
            ([[0.0, 0.0], [1.0, 0.0], [0.0, root]], 0.633975),
            ([[0.0, 0.0], [2.0 * root, 0.0], [root, 1.0]], 0.464102),
            ([[0.0, 0.0], [1.0, 1.0], [3.0, 3.0]], 0.0),
            ([[1.0, 1.0], [1.0, 1.0], [3.0, 3.0]], 0.0),
            ([[1.0, 1.0], [1.0, 1.0], [1.0, 1.0]], 0.0),
        ] {
            for scale in [1.0, 1e-200, 1e200] {
                let quality = matstruct_face_quality(flat(triangle).map(|p| p * scale));
                assert!((quality - expected).abs() < 5e-7, "{triangle:?} {scale}: {quality}");
            }
        }
    }

    #[test]
    fn the_mean_is_over_all_faces_and_none_is_no_number() {
        let equilateral = flat([[0.0, 0.0], [1.0, 0.0], [0.5, 0.75_f64.sqrt()]]);
        let collinear = flat([[0.1, 0.1], [0.2, 0.2], [0.7, 0.7]]);
        let repeated = flat([[0.1, 0.1], [0.1, 0.1], [0.1, 0.1]]);
        let corners = [equilateral, collinear, repeated].concat();
        let spheres = corners.iter().map(|&c| Sphere::new(c, 0.1)).collect();
        let faces = vec![[0, 1, 2], [3, 4, 5], [6, 7, 8]];
        let mesh = MedialMesh::from_simplices(spheres, vec![], faces).unwrap();
        let StructureQuality { quality, degenerate, faces } = matstruct_quality(&mesh);
        assert!((quality.unwrap() - 1.0 / 3.0).abs() < 1e-12);
        assert_eq!((degenerate, faces), (2, 3));
        assert_eq!(matstruct_quality(&MedialMesh::default()).quality, None);
    }

    #[test]
    fn the_share_of_bad_structure_counts_a_sphere_once() {
        let is_feature = [true, false, false, true];
        assert_eq!(matstruct_bad_share(&[0, 1, 1, 3], &is_feature), Some(1.0 / 3.0));
        assert_eq!(matstruct_bad_share(&[], &is_feature), None);
    }

    /// Why the area is not Heron's: for corners exactly on a line it is the root of a negative number now and then.
    #[test]
    fn herons_formula_has_no_number_where_this_has_one() {
        let mut state = 1_u64;
        let mut unit = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let (mut lost, all) = (0, 10_000);
        for _ in 0..all {
            // Small multiples of a vector of few digits are exact.
            let [x, y, z] = [(); 3].map(|()| (unit() * 1e6).round());
            let [s, t] = [(); 2].map(|()| (unit() * 1e3).round());
            let corners = [Vec3::ZERO, Vec3::new(x, y, z) * s, Vec3::new(x, y, z) * t];
            let [a, b, c] = [0, 1, 2].map(|k: usize| corners[k].distance(corners[(k + 1) % 3]));
            let half = 0.5 * (a + b + c);
            lost += usize::from((half * (half - a) * (half - b) * (half - c)).sqrt().is_nan());
            assert!(matstruct_face_quality(corners) < DEGENERATE);
        }
        assert!(lost > all / 100, "{lost}");
    }

    proptest! {
        #[test]
        fn quality_is_that_of_the_inscribed_circle(
            points in prop::array::uniform3(prop::array::uniform3(-1.0..1.0_f64)),
        ) {
            let corners = points.map(Vec3::from);
            let quality = matstruct_face_quality(corners);
            let lengths = [0, 1, 2].map(|k: usize| corners[k].distance(corners[(k + 1) % 3]));
            let area = 0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]).length();
            let inradius = 2.0 * area / lengths.iter().sum::<f64>();
            let longest = lengths.into_iter().fold(0.0, f64::max);
            prop_assert!((quality - 2.0 * 3.0_f64.sqrt() * inradius / longest).abs() < 1e-12);
            prop_assert!((0.0..=1.0 + 1e-12).contains(&quality));
        }
    }
}
