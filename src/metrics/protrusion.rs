//! How far the union of the medial primitives extends beyond the solid.
//!
//! The points are those of the reverse distance: samples of the union's boundary, and points that the
//! ascent reached from them. They are tested from the farthest from the surface on; the first one
//! outside the solid gives the protrusion.

use super::hausdorff::Envelope;
use crate::complex::MedialMesh;
use crate::surface::{InsideTest, Side};

/// Points that are tested together. Usually the first batch has the answer.
const BATCH: usize = 1024;

/// Largest distance from the surface of a boundary point of the union that is outside the solid, 0
/// where none is. A sampled maximum: a lower bound.
pub(super) fn protrusion(envelope: &Envelope, inside: &InsideTest) -> f64 {
    let Envelope { points, distances } = envelope;
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|&a, &b| distances[b].total_cmp(&distances[a]).then(a.cmp(&b)));
    for batch in order.chunks(BATCH) {
        let tested: Vec<_> = batch.iter().map(|&k| points[k]).collect();
        let sides = inside.sides(&tested);
        if let Some(first) = sides.iter().position(|side| *side == Side::Outside) {
            return distances[batch[first]];
        }
    }
    0.0
}

/// Share of the centres that are outside the solid.
pub(super) fn centres_outside(mesh: &MedialMesh, inside: &InsideTest) -> f64 {
    let centres: Vec<_> = mesh.spheres.iter().map(|s| s.centre).collect();
    let outside = inside.sides(&centres).into_iter().filter(|side| *side == Side::Outside).count();
    outside as f64 / centres.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::super::{EnvelopeOptions, sample_envelope};
    use super::*;
    use crate::Vec3;
    use crate::complex::{MedialUnion, Sphere};
    use crate::surface::TriMesh;
    use crate::surface::TriangleBvh;

    #[test]
    fn balls_that_leave_a_box() {
        let corner = |k: u32| Vec3::from_array([0, 1, 2].map(|b| f64::from(k >> b & 1) - 0.5));
        let quads =
            [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        let faces = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        let surface = TriMesh { vertices: (0..8).map(corner).collect(), faces };
        let (tree, inside) = (TriangleBvh::new(&surface).unwrap(), InsideTest::new(&surface));
        let options = EnvelopeOptions { samples: 20_000, burial: 1e-9, seed: 0 };
        let of = |spheres: &[(f64, f64)]| {
            let spheres = spheres.iter().map(|&(x, r)| Sphere::new(Vec3::X * x, r)).collect();
            let mesh = MedialMesh::from_simplices(spheres, vec![], vec![]).unwrap();
            let union = MedialUnion::new(&mesh).unwrap();
            let points = sample_envelope(&mesh, &union, &options).unwrap();
            let distances = tree.distance_batch(&points);
            let far = protrusion(&Envelope { points, distances }, &inside);
            (far, centres_outside(&mesh, &inside))
        };
        assert_eq!(of(&[(0.0, 0.4)]), (0.0, 0.0));
        // The far pole of a ball at 0.3, and of one whose centre is outside.
        let (far, outside) = of(&[(0.0, 0.4), (0.3, 0.3)]);
        assert!((far - 0.1).abs() < 1e-3 && outside == 0.0, "{far}");
        let (far, outside) = of(&[(0.0, 0.4), (0.7, 0.1)]);
        assert!((far - 0.3).abs() < 1e-3 && outside == 0.5, "{far} {outside}");
    }
}
