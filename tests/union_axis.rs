//! The medial axis of unions of balls: topology against the dual complex, geometry against
//! definitions, and small unions with known axes.

use medial::Vec3;
use medial::complex::{MedialMesh, Sphere, UnionAxis, betti};
use medial::geometry::dual_complex::Class;
use medial::geometry::{DualComplex, UnionBoundary};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

fn ball(x: f64, y: f64, z: f64, r: f64) -> Sphere {
    Sphere::new(Vec3::new(x, y, z), r)
}

fn unit(rng: &mut Pcg64) -> Vec3 {
    let mut x = || rng.random_range(-1.0..1.0);
    Vec3::new(x(), x(), x())
}

/// The axis, checked as far as any axis can be: a valid complex, nothing open, and the homotopy type
/// of the union.
fn checked(balls: &[Sphere]) -> (UnionAxis, MedialMesh) {
    let axis = UnionAxis::of_balls(balls).expect("admissible balls");
    let mesh = axis.mesh();
    mesh.check().expect("a valid complex");
    let tally = axis.tally();
    assert_eq!((tally.open, tally.doubtful, tally.clamped), (0, 0, 0), "{tally:?} of {balls:?}");
    let expected = DualComplex::of_balls(balls).expect("admissible balls").betti();
    assert_eq!(betti(&mesh), expected, "{balls:?}");
    (axis, mesh)
}

fn random_balls(rng: &mut Pcg64, n: usize) -> Vec<Sphere> {
    let largest = [0.2, 0.4, 0.7, 1.0][rng.random_range(0..4usize)];
    (0..n).map(|_| Sphere::new(unit(rng), rng.random_range(0.02..largest))).collect()
}

#[test]
fn random_unions_have_the_homotopy_type_of_the_dual_complex() {
    let mut rng = Pcg64::seed_from_u64(41);
    let (mut inside, mut seen) = (0, [0; 3]);
    for round in 0..1_500 {
        let n = if round % 50 == 0 { 400 } else { rng.random_range(1..40) };
        let balls = random_balls(&mut rng, n);
        let (axis, mesh) = checked(&balls);
        inside += axis.tally().inside;
        for (count, b) in seen.iter_mut().zip(betti(&mesh)) {
            *count += u64::from(b > u64::from(b == betti(&mesh)[0])).min(1);
        }
    }
    assert!(inside > 20_000 && seen.iter().all(|&n| n > 40), "{inside} {seen:?}");
}
