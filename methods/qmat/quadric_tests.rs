//! Quadrics against their definition, their null spaces, and the singularity test against
//! eigenvalues.

use medial::Vec3;
use medial::complex::Sphere;
use medial::geometry::{Cone, SlabPlanes};
use proptest::prelude::*;

use super::quadric::Quadric;

fn vector() -> impl Strategy<Value = Vec3> {
    prop::array::uniform3(-1.0..1.0f64).prop_map(Vec3::from)
}

fn sphere() -> impl Strategy<Value = Sphere> {
    (vector(), 0.0..0.5f64).prop_map(|(centre, radius)| Sphere::new(centre, radius))
}

fn slab(spheres: [Sphere; 3]) -> Option<Quadric> {
    let mut quadric = Quadric::default();
    for normal in SlabPlanes::new(spheres)?.normals() {
        quadric.add_plane(normal, spheres[0], 1.0);
    }
    Some(quadric)
}

proptest! {
    /// A sum of squared distances to planes, and the least value where the minimiser is.
    #[test]
    fn value_and_minimiser(
        planes in prop::collection::vec((vector(), sphere(), 0.1..2.0f64), 4..12),
        at in sphere(),
        step in (vector(), -1.0..1.0f64),
    ) {
        let mut quadric = Quadric::default();
        for &(normal, touching, weight) in &planes {
            quadric.add_plane(normal, touching, weight);
        }
        let distance = |m: Sphere, normal: Vec3, touching: Sphere| {
            normal.dot(m.centre - touching.centre) + (m.radius - touching.radius)
        };
        let value = |m| planes.iter().map(|&(n, t, w)| w * distance(m, n, t).powi(2)).sum::<f64>();
        prop_assert!((quadric.value(at) - value(at)).abs() < 1e-12);
        if let Some(best) = quadric.minimiser(1e-6) {
            let moved = Sphere::new(best.centre + 1e-3 * step.0, best.radius + 1e-3 * step.1);
            prop_assert!(value(best) <= value(moved) + 1e-9);
        }
    }

    /// A slab's quadric vanishes on the affine span of its spheres and has no unique minimiser.
    #[test]
    fn slab_quadrics_vanish_on_the_affine_span(
        spheres in prop::array::uniform3(sphere()),
        weights in prop::array::uniform2(-2.0..2.0f64),
    ) {
        let Some(quadric) = slab(spheres) else { return Ok(()) };
        let [a, b, c] = spheres;
        let [s, t] = weights;
        let mix = |x: f64, y: f64, z: f64| (1.0 - s - t) * x + s * y + t * z;
        let centre = (1.0 - s - t) * a.centre + s * b.centre + t * c.centre;
        let affine = Sphere::new(centre, mix(a.radius, b.radius, c.radius));
        prop_assert!(quadric.value(affine) < 1e-24_f64.max(1e-13 * quadric.value(Sphere::new(centre, 9.0))));
        prop_assert!(quadric.value(Sphere::new(centre, affine.radius + 0.1)) > 0.019);
        prop_assert_eq!(quadric.minimiser(1e-10), None);
    }

    /// A cone's quadric does not depend on where the first of its four planes is, whatever the
    /// frame: `A = [4s²uuᵀ + 2(1-s²)(I-uuᵀ), -4su; -4suᵀ, 4]`, null along the cone.
    #[test]
    fn cone_quadrics_do_not_depend_on_the_frame(a in sphere(), b in sphere(), at in sphere()) {
        let Some(frame) = Cone::new(a, b).frame() else { return Ok(()) };
        let mut quadric = Quadric::default();
        for normal in frame.normals() {
            quadric.add_plane(normal, a, 1.0);
        }
        let (w, dr) = (at.centre - a.centre, at.radius - a.radius);
        let (u, s) = (frame.u, frame.s);
        let along = w.dot(u);
        let across = (w - along * u).length_squared();
        let expected = 4.0 * (dr - s * along).powi(2) + 2.0 * (1.0 - s * s) * across;
        prop_assert!((quadric.value(at) - expected).abs() < 1e-12);
        prop_assert_eq!(quadric.minimiser(1e-10), None);
    }

    /// Whether a quadric is singular is decided by the eigenvalues of `A`, known here by making:
    /// four orthogonal planes with the given weights.
    #[test]
    fn singular_is_a_ratio_of_eigenvalues(
        angles in prop::array::uniform3(0.0..6.0f64), exponent in -16.0..-4.0f64,
    ) {
        // (n, 1) for the rows of a rotated tetrahedral frame are orthogonal in R^4 when n has
        // length sqrt(3) and the n make a regular tetrahedron.
        let rotation = |v: Vec3| v.rotate_x(angles[0]).rotate_y(angles[1]).rotate_z(angles[2]);
        let corners = [[1., 1., 1.], [1., -1., -1.], [-1., 1., -1.], [-1., -1., 1.]];
        let weights = [1.0, 0.5, 1e-3, 10_f64.powf(exponent)];
        let mut quadric = Quadric::default();
        let touching = Sphere::new(Vec3::new(0.1, 0.2, 0.3), 0.4);
        for (corner, weight) in corners.into_iter().zip(weights) {
            quadric.add_plane(rotation(Vec3::from(corner)), touching, weight);
        }
        let minimiser = quadric.minimiser(1e-10);
        if exponent < -10.001 {
            prop_assert_eq!(minimiser, None);
        }
        if exponent > -9.999 {
            let found = minimiser.expect("well above the threshold");
            prop_assert!(found.centre.distance(touching.centre) < 1e-4);
        }
    }
}
