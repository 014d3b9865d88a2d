//! The angle filter on random unions, and the parameters.

use medial::Vec3;
use medial::complex::{Incidence, Sphere, UnionAxis, betti};
use medial::simplifier::{Params, SimplifyError};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::{SatParams, perturbed, sheets};

#[test]
fn the_angle_filter_changes_no_topology() {
    let mut rng = Pcg64::seed_from_u64(61);
    let mut removed_in_all = 0;
    for _ in 0..200 {
        let n = rng.random_range(1..60);
        let largest = [0.2, 0.4, 0.7][rng.random_range(0..3usize)];
        let mut x = || rng.random_range(-1.0..1.0);
        let balls: Vec<Sphere> = (0..n)
            .map(|_| Sphere::new(Vec3::new(x(), x(), x()), 0.02 + largest * x().abs()))
            .collect();
        let axis = UnionAxis::of_balls(&balls).expect("balls");
        let full = axis.mesh();
        let mut faces = full.faces.len();
        assert_eq!(sheets::filtered(&axis, 0.0), (full.clone(), 0));
        for limit in [10.0, 30.0, 60.0, 90.0] {
            let (mesh, removed) = sheets::filtered(&axis, limit);
            mesh.check().expect("a valid complex");
            assert_eq!(betti(&mesh), betti(&full), "{balls:?}");
            assert!(mesh.faces.len() <= faces);
            faces = mesh.faces.len();
            removed_in_all += removed;
            if limit == 90.0 {
                // Only what closes up or is a right angle is left.
                let open = Incidence::of(&mesh).faces_at().iter().filter(|&&n| n == 1).count();
                assert_eq!(open, 0);
            }
        }
    }
    assert!(removed_in_all > 2_000, "{removed_in_all}");
}

#[test]
fn edges_without_facets_stay() {
    // A chain of balls that ends in a block of four.
    let mut balls: Vec<Sphere> =
        (0..6).map(|k| Sphere::new(Vec3::new(2.0 + 1.5 * f64::from(k), 0.0, 0.0), 1.0)).collect();
    for c in [[0.0, 1.0, 0.0], [0.0, -0.6, 0.9], [0.0, -0.6, -0.9], [1.0, 0.1, 0.2]] {
        balls.push(Sphere::new(Vec3::from(c), 1.3));
    }
    let axis = UnionAxis::of_balls(&balls).expect("balls");
    let chain = |mesh: &medial::complex::MedialMesh| {
        let faces_at = Incidence::of(mesh).faces_at().to_vec();
        faces_at.iter().filter(|&&n| n == 0).count()
    };
    assert!(chain(&axis.mesh()) >= 4);
    let (mesh, removed) = sheets::filtered(&axis, 90.0);
    assert!(removed > 0 && mesh.faces.is_empty());
    assert!(chain(&mesh) >= chain(&axis.mesh()));
}

#[test]
fn perturbation_is_as_large_as_said_and_seeded() {
    let balls: Vec<Sphere> =
        (1..100).map(|k| Sphere::new(Vec3::splat(f64::from(k)), f64::from(k))).collect();
    let SatParams { radius_factor, jitter, .. } = SatParams::default();
    let moved = perturbed(&balls, radius_factor, jitter, 7);
    assert_eq!(moved, perturbed(&balls, radius_factor, jitter, 7));
    assert_ne!(moved, perturbed(&balls, radius_factor, jitter, 8));
    for (a, b) in balls.iter().zip(&moved) {
        assert!((b.radius / a.radius - 1.002).abs() < 1e-15);
        let offset = (b.centre - a.centre).abs().max_element() / a.radius;
        assert!(offset > 0.0 && offset <= 1e-4 * (1.0 + 1e-9));
    }
    assert_eq!(perturbed(&balls, 1.0, 0.0, 7), balls);
}

#[test]
fn parameters_are_checked() {
    for (key, value) in
        [("radius_factor", "0"), ("jitter", "1"), ("sat_angle", "-1"), ("sat_angle", "many")]
    {
        let mut params = Params::none();
        params.set(key, value);
        let error = params.typed::<SatParams>().and_then(SatParams::validate);
        assert!(matches!(error, Err(SimplifyError::Parameter(m)) if m.contains(key)), "{key}");
    }
}
