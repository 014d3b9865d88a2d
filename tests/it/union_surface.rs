//! Boundary surfaces of unions of spheres, cones and slabs against closed forms.

use std::collections::BTreeSet;
use std::f64::consts::PI;

use medial::Vec3;
use medial::complex::{
    ComplexError, ContourError, MedialMesh, MedialUnion, Sphere, union_surface,
    union_surface_within,
};
use medial::metrics::{EnvelopeOptions, sample_envelope, union_betti};
use medial::surface::{self, SurfaceReport, TriangleBvh};
use proptest::prelude::*;

fn mesh(spheres: &[([f64; 3], f64)], edges: &[[u32; 2]], faces: &[[u32; 3]]) -> MedialMesh {
    let spheres = spheres.iter().map(|&(c, r)| Sphere::new(Vec3::from(c), r)).collect();
    MedialMesh::from_simplices(spheres, edges.to_vec(), faces.to_vec()).unwrap()
}

/// Checks the surface of a union against the union, both ways, and reports on it.
fn checked(axis: &MedialMesh, tolerance: f64) -> SurfaceReport {
    let made = union_surface(axis, tolerance).unwrap();
    let report = surface::validate(&made.mesh).unwrap();
    assert!(!report.self_intersecting, "{} pairs", report.intersecting_pairs);
    let union = MedialUnion::new(axis).unwrap();
    for &v in &made.mesh.vertices {
        assert!(union.signed(v).abs() < 1e-9 * tolerance, "{v}: {}", union.signed(v));
    }
    for f in 0..made.mesh.faces.len() {
        let centre = made.mesh.triangle(f).iter().sum::<Vec3>() / 3.0;
        assert!(union.signed(centre).abs() <= tolerance);
    }
    let options = EnvelopeOptions { samples: 2000, burial: 1e-7, seed: 0 };
    let envelope = sample_envelope(axis, &union, &options).unwrap();
    let back = TriangleBvh::new(&made.mesh).unwrap().distance_batch(&envelope);
    assert!(back.iter().all(|&d| d <= tolerance), "{:?}", back.iter().cloned().reduce(f64::max));
    report
}

fn near(value: Option<f64>, exact: f64, share: f64) {
    let value = value.unwrap();
    assert!((value / exact - 1.0).abs() < share, "{value}, exactly {exact}");
}

#[test]
fn a_sphere_has_its_area_and_volume() {
    let ball = mesh(&[([0.3, -0.2, 7.0], 2.0)], &[], &[]);
    let mut last = f64::INFINITY;
    for tolerance in [0.8, 0.4, 0.2] {
        let report = checked(&ball, tolerance);
        assert_eq!((report.components, report.genus), (1, Some(0)));
        let short = 1.0 - report.volume.unwrap() / (32.0 / 3.0 * PI);
        // Inscribed, and quadratic in the tolerance.
        assert!(short > 0.0 && short < 0.4 * last, "{tolerance}: {short} after {last}");
        last = short;
    }
    near(checked(&ball, 0.1).area, 16.0 * PI, 0.002);
}

#[test]
fn two_spheres_apart_are_two_components() {
    let pair = mesh(&[([0.0; 3], 1.0), ([3.0, 0.0, 0.0], 0.5)], &[], &[]);
    let report = checked(&pair, 0.1);
    assert_eq!((report.components, report.genus), (2, Some(0)));
    near(report.volume, 4.0 / 3.0 * PI * (1.0 + 0.125), 0.01);
}

#[test]
fn a_tapered_cone_and_a_sphere() {
    // Spheres of radii 1 and 0.5, 3 apart: caps and the frustum between their circles of contact.
    let axis =
        mesh(&[([0.0; 3], 1.0), ([3.0, 0.0, 0.0], 0.5), ([0.0, 9.0, 0.0], 0.8)], &[[0, 1]], &[]);
    let report = checked(&axis, 0.1);
    assert_eq!((report.components, report.genus), (2, Some(0)));
    let sine: f64 = 0.5 / 3.0;
    let cosine = (1.0 - sine * sine).sqrt();
    let (a, b) = (cosine, 0.5 * cosine);
    let height = 3.0 + 0.5 * sine - sine;
    let frustum = PI * height * (a * a + a * b + b * b) / 3.0;
    let cap = |r: f64, h: f64| PI * h * h * (3.0 * r - h) / 3.0;
    let cone = frustum + cap(1.0, 1.0 + sine) + cap(0.5, 0.5 - 0.5 * sine);
    near(report.volume, cone + 4.0 / 3.0 * PI * 0.512, 0.005);
}

#[test]
fn a_slab_is_its_triangle_grown() {
    // Steiner: V = 2 r A + pi r^2 P / 2 + 4/3 pi r^3.
    let axis =
        mesh(&[([0.0; 3], 0.2), ([3.0, 0.0, 0.0], 0.2), ([0.0, 4.0, 0.0], 0.2)], &[], &[[0, 1, 2]]);
    let report = checked(&axis, 0.05);
    assert_eq!(report.genus, Some(0));
    let r: f64 = 0.2;
    near(report.volume, 2.0 * r * 6.0 + PI * r * r * 6.0 + 4.0 / 3.0 * PI * r.powi(3), 0.005);
    near(report.area, 12.0 + PI * r * 12.0 + 4.0 * PI * r * r, 0.005);
}

#[test]
fn thin_parts_are_refined_and_thinner_ones_counted() {
    // A plate of half the tolerance has no hole.
    let plate = |r: f64| {
        let corners = [[0.0; 3], [3.0, 0.0, 0.0], [0.0, 3.0, 0.0]];
        mesh(&corners.map(|c| (c, r)), &[], &[[0, 1, 2]])
    };
    let made = union_surface(&plate(0.05), 0.1).unwrap();
    assert_eq!(made.lost, 0);
    assert_eq!(surface::validate(&made.mesh).unwrap().genus, Some(0));
    let mut with_points = plate(0.3);
    with_points.spheres.push(Sphere::new(Vec3::splat(9.0), 0.0));
    let made = union_surface(&with_points, 0.2).unwrap();
    assert_eq!(made.lost, 1);
    assert_eq!(surface::validate(&made.mesh).unwrap().components, 1);
}

/// Slabs with a small sphere: where a query leaves the part between the tangent planes, the cones decide.
#[test]
fn slabs_of_very_different_spheres_have_a_surface() {
    let radii = [1e-5, 3e-4, 0.00095, 0.001, 0.0012, 0.01, 0.3, 0.9];
    let mut slabs: Vec<[([f64; 3], f64); 3]> = vec![
        [
            (
                [-0.0034932826496610354, -0.007422192861891084, -47.82930482046158],
                2.349650261066975,
            ),
            ([0.0998570726496721, -0.02282878124718741, 48.31675799183425], 1.91940881112742),
            ([-1.9999999499200638, 1.9999999499200638, 84.00269643367311], 0.0010015987220439132),
        ],
        [
            ([13.005083093709928, 13.085389559631025, 12.415824077139162], 8.013541189979163),
            ([14.95731018621688, 10.114217602964895, 21.991809397833524], 3.498571136907e-4),
            ([11.227184339048586, 17.65556964451828, 18.621069587174105], 1.815607298918769),
        ],
    ];
    for radius in radii {
        for height in [0.02, 1.5] {
            let ends = [([0.0; 3], 1.0), ([10.0, 0.0, 0.0], 1.0)];
            slabs.push([ends[0], ends[1], ([5.0, height, 0.0], radius)]);
            slabs.push([ends[0], ([10.0, 0.0, 0.0], radius), ([5.0, height, 0.0], radius)]);
        }
    }
    for slab in slabs {
        let axis = mesh(&slab, &[], &[[0, 1, 2]]);
        let (lo, hi) = MedialUnion::new(&axis).unwrap().bounding_box();
        for share in [0.02, 0.03] {
            let made = union_surface(&axis, share * lo.distance(hi)).unwrap();
            // Parts that taper below the tolerance may be missing, but what is there is a closed surface.
            assert!(surface::validate(&made.mesh).is_ok(), "{slab:?}");
        }
    }
}

#[test]
fn loops_and_voids_of_the_union_are_those_of_the_surface() {
    let ring = |n: u32, r: f64| {
        let angle = |k: u32| f64::from(k) * std::f64::consts::TAU / f64::from(n);
        let spheres: Vec<_> =
            (0..n).map(|k| ([angle(k).cos(), angle(k).sin(), 0.1 * angle(k).cos()], r)).collect();
        let edges: Vec<_> = (0..n).map(|k| [k, (k + 1) % n]).collect();
        mesh(&spheres, &edges, &[])
    };
    let corners = [[0.0; 3], [3.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 3.0]];
    let hollow =
        mesh(&corners.map(|c| (c, 0.15)), &[], &[[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]);
    for (axis, tolerance) in [(ring(9, 0.2), 0.1), (ring(5, 0.95), 0.1), (hollow, 0.1)] {
        let [b0, b1, b2] = union_betti(&axis, 0.05).unwrap().map(|b| b as usize);
        let report = checked(&axis, tolerance);
        assert_eq!(report.expected_betti, Some([b0, b1, b2]));
    }
}

#[test]
fn unusable_tolerances_and_meshes_are_errors() {
    let ball = mesh(&[([0.0; 3], 1.0)], &[], &[]);
    assert!(matches!(union_surface(&ball, 0.0), Err(ContourError::Tolerance(_))));
    assert!(matches!(union_surface(&ball, f64::NAN), Err(ContourError::Tolerance(_))));
    let coarse = |tolerance| union_surface_within(&ball, tolerance, 50_000);
    let Err(ContourError::TooFine { feasible, .. }) = coarse(1e-3) else {
        panic!("a million tetrahedra are needed")
    };
    assert!(coarse(feasible).is_ok(), "{feasible}");
    assert!(matches!(union_surface(&ball, 1e-9), Err(ContourError::TooFine { .. })));
    let points = mesh(&[([0.0; 3], 0.0), ([1.0, 0.0, 0.0], 0.0)], &[[0, 1]], &[]);
    assert!(matches!(union_surface(&points, 0.1), Err(ContourError::NoInside)));
    let speck = mesh(&[([0.0; 3], 1e-3), ([1.0, 0.0, 0.0], 1e-3)], &[], &[]);
    let Err(ContourError::TooThin { feasible, .. }) = union_surface(&speck, 1.0) else {
        panic!("specks")
    };
    assert!(union_surface(&speck, feasible).is_ok(), "{feasible}");
    assert!(matches!(union_surface(&MedialMesh::default(), 1.0), Err(ContourError::Union(_))));
}

/// Faces of tiny coordinates were inside out, since the products of three of them underflow.
#[test]
fn a_power_of_two_scales_the_surface_and_the_errors() {
    let axis = mesh(&[([0.3; 3], 1.0), ([4.0, 0.0, 0.0], 0.5)], &[[0, 1]], &[]);
    let specks = mesh(&[([0.0; 3], 1e-3), ([1.0, 0.0, 0.0], 1e-3)], &[], &[]);
    let made = union_surface(&axis, 0.2).unwrap();
    for exponent in [-1010, -600, -343, 400, 1000] {
        let unit = 2f64.powi(exponent);
        let scaled = |mesh: &MedialMesh| mesh.transformed(unit, |p| unit * p);
        let found = union_surface(&scaled(&axis), 0.2 * unit).unwrap();
        assert_eq!(found.mesh.faces, made.mesh.faces, "2^{exponent}");
        assert!(found.mesh.vertices.iter().zip(&made.mesh.vertices).all(|(a, b)| *a == unit * *b));
        assert_eq!((found.lost, found.smallest), (made.lost, unit * made.smallest));
        let Err(ContourError::TooThin { smallest, feasible }) =
            union_surface(&scaled(&specks), unit)
        else {
            panic!("specks")
        };
        assert!(union_surface(&scaled(&specks), feasible).is_ok(), "2^{exponent}");
        assert!(smallest > 1e-3 * unit && feasible < 1e-3 * unit, "{smallest:e} {feasible:e}");
        let fine = union_surface_within(&scaled(&axis), 1e-3 * unit, 50_000);
        let Err(ContourError::TooFine { tolerance, feasible, .. }) = fine else {
            panic!("too fine")
        };
        assert!(tolerance == 1e-3 * unit && feasible < 10.0 * unit, "{tolerance:e} {feasible:e}");
    }
    let below = mesh(&[([0.0; 3], 1e-320)], &[], &[]);
    assert!(matches!(union_surface(&below, 1e-322), Err(ContourError::NoInside)));
}

#[test]
fn unions_that_no_tolerance_shows_are_refused_as_such() {
    // No tolerance shows balls that are smaller than the finest tetrahedra.
    let slender = mesh(&[([0.0; 3], 1e-9), ([1.0, 0.0, 0.0], 1e-9)], &[], &[]);
    for tolerance in [1.0, 0.02, 1e-9] {
        let error = union_surface(&slender, tolerance);
        assert!(matches!(error, Err(ContourError::TooSlender { .. })), "{error:?}");
    }
}

/// A sphere on a coarse lattice.
fn lattice_sphere() -> impl Strategy<Value = ([f64; 3], f64)> {
    (prop::array::uniform3(0..4_i32), 1..4_i32)
        .prop_map(|(c, r)| (c.map(f64::from), 0.25 * f64::from(r)))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn small_unions_are_closed_manifolds_on_any_number_of_threads(
        spheres in prop::collection::vec(lattice_sphere(), 1..6),
        faces in prop::collection::vec(prop::array::uniform3(0..6_usize), 0..3),
        edges in prop::collection::vec(prop::array::uniform2(0..6_usize), 0..3),
        tolerance in 0.2..0.6,
    ) {
        let n = spheres.len();
        let name = |i: usize| (i % n) as u32;
        let faces: Vec<_> = faces.into_iter().map(|f| f.map(name)).collect();
        let edges: Vec<_> = edges.into_iter().map(|e| e.map(name)).collect();
        let different = |s: &[u32]| (1..s.len()).all(|i| !s[..i].contains(&s[i]));
        let faces: Vec<_> = faces.into_iter().filter(|f| different(f)).collect();
        let edges: Vec<_> = edges.into_iter().filter(|e| different(e)).collect();
        let axis = mesh(&spheres, &edges, &faces);
        let made = union_surface(&axis, tolerance).unwrap();
        prop_assert!(surface::validate(&made.mesh).is_ok());
        prop_assert_eq!(crate::on_threads(1, || union_surface(&axis, tolerance).unwrap()), made);
        // The sandwich, at the corners of a lattice.
        let union = MedialUnion::new(&axis).unwrap();
        let inside = medial::surface::InsideTest::new(
            &union_surface(&axis, tolerance).unwrap().mesh,
        );
        for k in 0..1000_i32 {
            let p = Vec3::new((k % 10).into(), (k / 10 % 10).into(), (k / 100).into());
            let p = 0.5 * p - Vec3::splat(0.75);
            let sigma = union.signed(p);
            let is_inside = inside.side(p) == medial::surface::Side::Inside;
            prop_assert!(is_inside || sigma >= -tolerance, "{} {}", p, sigma);
            prop_assert!(!is_inside || sigma <= tolerance, "{} {}", p, sigma);
        }
    }
}

// The canonical form of a complex, against ordered sets.

fn spheres(count: u32) -> Vec<Sphere> {
    (0..count).map(|k| Sphere::new(Vec3::X * f64::from(k), 1.0)).collect()
}

fn distinct<const N: usize>(simplex: &[u32; N]) -> bool {
    BTreeSet::from(*simplex).len() == N
}

proptest! {
    #[test]
    fn simplices_come_out_as_from_ordered_sets(
        count in 3_u32..120,
        edges in prop::collection::vec(prop::array::uniform2(0_u32..120), 0..200),
        faces in prop::collection::vec(prop::array::uniform3(0_u32..120), 0..200),
    ) {
        let edges: Vec<[u32; 2]> =
            edges.into_iter().map(|e| e.map(|v| v % count)).filter(distinct).collect();
        let faces: Vec<[u32; 3]> =
            faces.into_iter().map(|f| f.map(|v| v % count)).filter(distinct).collect();
        let sorted = |mut face: [u32; 3]| { face.sort_unstable(); face };
        let expected_faces: BTreeSet<[u32; 3]> = faces.iter().copied().map(sorted).collect();
        let mut expected_edges: BTreeSet<[u32; 2]> =
            edges.iter().map(|&[a, b]| [a.min(b), a.max(b)]).collect();
        for &[a, b, c] in &expected_faces {
            expected_edges.extend([[a, b], [a, c], [b, c]]);
        }
        let mesh = MedialMesh::from_simplices(spheres(count), edges, faces).expect("valid");
        prop_assert!(mesh.edges.iter().eq(&expected_edges));
        prop_assert!(mesh.faces.iter().eq(&expected_faces));
        prop_assert!(mesh.check().is_ok());
        // Without any one of its edges a complex with faces is not closed.
        for k in (0..mesh.edges.len()).step_by(7) {
            let mut open = mesh.clone();
            let side = open.edges.remove(k);
            let needed = mesh.faces.iter().any(|f| side.iter().all(|v| f.contains(v)));
            let missing = matches!(open.check(), Err(ComplexError::MissingEdge { side: s, .. }) if s == side);
            prop_assert_eq!(missing, needed);
        }
    }
}

#[test]
fn ids_out_of_range_are_refused() {
    for (edges, faces) in
        [(vec![[0, 5]], vec![]), (vec![[7, 9]], vec![]), (vec![], vec![[9, 8, 7]])]
    {
        assert!(MedialMesh::from_simplices(spheres(3), edges, faces).is_err());
    }
}
