//! Power crusts of sampled surfaces whose topology and distance are known.

use medial::Vec3;
use medial::geometry::{PowerCrust, Sphere};
use medial::shape::{Shape, ShapeOptions};
use medial::surface::{self, Folds, Sampling, TriMesh, contract_short_edges};
use proptest::prelude::*;

use crate::shapes;

const COINCIDENT: f64 = 1e-6;

/// The power crust of all poles, in the unit of the mesh, and its largest distance from `exact`,
/// a signed distance.
fn crust(mesh: &TriMesh, samples: usize, exact: impl Fn(Vec3) -> f64) -> (TriMesh, f64) {
    let report = surface::validate(mesh).unwrap();
    let sampling = Sampling::BlueNoise { count: samples, seed: 1 };
    let options = ShapeOptions { sampling, ..ShapeOptions::default() };
    let shape = Shape::new("sampled", mesh, report, options).unwrap();
    let balls = shape.polar_balls().unwrap();
    let crust = PowerCrust::new(&balls.inner, &balls.outer).unwrap();
    let mut made = surface::crust_surface(&crust, COINCIDENT).mesh;
    for v in &mut made.vertices {
        *v = shape.normalisation().backward(*v);
    }
    let corners = made.vertices.iter().copied();
    let centres = (0..made.faces.len()).map(|f| made.triangle(f).iter().sum::<Vec3>() / 3.0);
    let farthest = corners.chain(centres).map(|p| exact(p).abs()).fold(0.0, f64::max);
    (made, farthest)
}

/// Four times as many samples are half as far apart, and the error goes with the square.
#[test]
fn crusts_come_nearer_as_samples_come_closer() {
    type Case = (TriMesh, usize, &'static [usize], f64, f64, fn(Vec3) -> f64);
    let cases: [Case; 2] = [
        (shapes::sphere(5), 0, &[200, 800, 3200], 0.5, 0.01, |p| p.length() - 1.0),
        (shapes::torus(96, 192), 1, &[1500, 6000], 0.6, 0.02, |p| {
            (p.x.hypot(p.y) - 2.0).hypot(p.z) - 1.0
        }),
    ];
    for (mesh, genus, counts, factor, most, exact) in cases {
        let mut last = f64::INFINITY;
        for &samples in counts {
            let (crust, farthest) = crust(&mesh, samples, exact);
            let report = surface::validate(&crust).unwrap();
            assert_eq!((report.components, report.genus), (1, Some(genus)), "{samples} samples");
            assert!(farthest < factor * last, "{samples} samples: {farthest} after {last}");
            last = farthest;
        }
        assert!(last < most, "{last}");
    }
}

#[test]
fn the_bisector_of_two_balls_is_found() {
    // A ball between six of other sizes: faces at the planes of equal power.
    let inner = [Sphere::new(Vec3::ZERO, 1.0)];
    let axes = [Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z];
    let outer: Vec<Sphere> =
        (0..6).map(|k| Sphere::new(3.0 * axes[k], 0.5 + 0.2 * k as f64)).collect();
    let crust = PowerCrust::new(&inner, &outer).unwrap();
    assert_eq!(crust.facet_count(), 6);
    for facet in 0..6 {
        let [_, outside] = crust.balls(facet);
        let ball = outer[outside as usize - 1];
        for &corner in crust.facet(facet) {
            let p = crust.corners()[corner as usize];
            let powers = [inner[0], ball].map(|b| p.distance_squared(b.centre) - b.radius.powi(2));
            assert!((powers[0] - powers[1]).abs() < 1e-12);
        }
    }
    let volume = surface::validate(&(&crust).into()).unwrap().volume.unwrap();
    let at = |k: usize| (9.0 + 1.0 - outer[k].radius.powi(2)) / 6.0;
    let expected = (at(0) + at(1)) * (at(2) + at(3)) * (at(4) + at(5));
    assert!((volume - expected).abs() < 1e-12, "{volume} {expected}");
}

#[test]
fn balls_that_cannot_be_are_refused_and_none_is_no_surface() {
    let bad = [Sphere::new(Vec3::ZERO, -1.0)];
    assert!(PowerCrust::new(&bad, &[]).is_err());
    assert!(PowerCrust::new(&[Sphere::new(Vec3::splat(f64::NAN), 1.0)], &[]).is_err());
    assert_eq!(PowerCrust::new(&[], &[]).unwrap().facet_count(), 0);
    // A single ball is bounded by the box around it.
    let alone = PowerCrust::new(&[Sphere::new(Vec3::ONE, 0.0)], &[]).unwrap();
    assert_eq!(surface::validate(&(&alone).into()).unwrap().genus, Some(0));
}

#[test]
fn specks_go_and_what_is_larger_stays() {
    let ball = shapes::sphere(2);
    let speck = shapes::moved(shapes::sphere(1), |p| 1e-9 * p + 5.0 * Vec3::X);
    let both = shapes::joined(&[ball.clone(), speck]);
    let limits = vec![1e-6; both.vertices.len()];
    let whole = contract_short_edges(&both, &limits, Folds::Ignored);
    assert_eq!((whole.dropped, whole.mesh), (1, ball));
}

/// Every edge has two faces, in opposite directions, and every vertex one fan of them.
fn assert_closed_manifold(mesh: &TriMesh) -> Result<(), TestCaseError> {
    let mut next = vec![Vec::new(); mesh.vertices.len()];
    for &[a, b, c] in &mesh.faces {
        for (v, from, to) in [(a, b, c), (b, c, a), (c, a, b)] {
            next[v as usize].push((from, to));
        }
    }
    for fan in next.iter().filter(|fan| !fan.is_empty()) {
        let (start, mut at) = fan[0];
        let mut turned = 1;
        while at != start {
            let onward: Vec<_> = fan.iter().filter(|side| side.0 == at).collect();
            prop_assert_eq!(onward.len(), 1);
            at = onward[0].1;
            turned += 1;
        }
        prop_assert_eq!(turned, fan.len());
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Balls on a coarse lattice of few sizes, with any labels: degenerate in every way.
    #[test]
    fn the_crust_of_any_balls_is_a_closed_manifold(
        balls in prop::collection::vec((0..4_i32, 0..4_i32, 0..4_i32, 0..3_i32, any::<bool>()), 1..40),
    ) {
        let ball = |&(x, y, z, r, _): &(i32, i32, i32, i32, bool)| {
            Sphere::new(Vec3::new(x.into(), y.into(), z.into()), f64::from(r) * 0.5)
        };
        let of = |side: bool| balls.iter().filter(|b| b.4 == side).map(ball).collect::<Vec<_>>();
        let crust = PowerCrust::new(&of(true), &of(false)).unwrap();
        assert_closed_manifold(&(&crust).into())?;
        assert_closed_manifold(&surface::crust_surface(&crust, 1e-6).mesh)?;
    }
}
