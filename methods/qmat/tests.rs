//! The contraction on complexes made by hand.

use medial::Vec3;
use medial::complex::{MedialMesh, Sphere, betti};
use medial::simplifier::{Params, RunContext};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::contract::Contraction;
use super::oracle::Oracle;
use super::*;

fn params() -> QmatParams {
    QmatParams::default()
}

fn contract(mesh: &MedialMesh, params: QmatParams, target: usize) -> (MedialMesh, Contraction) {
    let mut contraction = Contraction::new(mesh, params);
    contraction.run_to(mesh, target, &RunContext::default()).unwrap();
    let result = contraction.to_mesh();
    result.check().unwrap();
    (result, contraction)
}

fn spheres_at(points: impl IntoIterator<Item = (Vec3, f64)>) -> Vec<Sphere> {
    points.into_iter().map(|(centre, radius)| Sphere::new(centre, radius)).collect()
}

/// A triangulated `n` by `n` grid on the unit square, lifted by `lift`.
fn grid(n: u32, lift: impl Fn(f64, f64) -> (f64, f64)) -> MedialMesh {
    let side = f64::from(n - 1);
    let spheres = spheres_at((0..n * n).map(|v| {
        let (x, y) = (f64::from(v % n) / side, f64::from(v / n) / side);
        let (z, radius) = lift(x, y);
        (Vec3::new(x, y, z), radius)
    }));
    let faces = (0..(n - 1) * (n - 1))
        .flat_map(|cell| {
            let v = cell / (n - 1) * n + cell % (n - 1);
            [[v, v + 1, v + n + 1], [v, v + n, v + n + 1]]
        })
        .collect();
    MedialMesh::from_simplices(spheres, vec![], faces).unwrap()
}

/// A bumpy sheet without ties: no symmetry, no cospherical samples.
fn bumpy(n: u32) -> MedialMesh {
    grid(n, |x, y| {
        let z = 0.1 * (5.0 * x + 0.3).sin() * (4.0 * y + 0.7 * x).cos() + 0.013 * x * y;
        (z, 0.12 + 0.03 * (7.0 * x + 3.1 * y * y).sin())
    })
}

#[test]
fn slabs_of_one_affine_plane_collapse_without_error() {
    let on_plane = |c: Vec3| (c.z - 0.2 * c.x - 0.1 * c.y).abs();
    let radius = |x: f64, y: f64| 0.1 + 0.3 * x - 0.05 * y;
    let initial = grid(9, |x, y| (0.2 * x + 0.1 * y, radius(x, y)));
    let no_boundary = QmatParams { boundary: Boundary::None, ..params() };
    for target in [60, 20, 5] {
        let (mesh, contraction) = contract(&initial, no_boundary, target);
        assert_eq!(mesh.spheres.len(), target);
        for m in &mesh.spheres {
            assert!(on_plane(m.centre) < 1e-12, "{m:?}");
            assert!((m.radius - radius(m.centre.x, m.centre.y)).abs() < 1e-12, "{m:?}");
        }
        assert!(contraction.largest_error() < 1e-14, "{}", contraction.largest_error());
    }
}

#[test]
fn stable_boundaries_stay_where_they_are() {
    let initial = grid(12, |_, _| (0.0, 0.1));
    let area = |mesh: &MedialMesh| {
        let at = |v: u32| mesh.spheres[v as usize].centre;
        let doubled = |f: &[u32; 3]| (at(f[1]) - at(f[0])).cross(at(f[2]) - at(f[0])).length();
        mesh.faces.iter().map(doubled).sum::<f64>() / 2.0
    };
    let shrunk = |boundary| {
        let (mesh, _) = contract(&initial, QmatParams { boundary, ..params() }, 8);
        1.0 - area(&mesh)
    };
    let [paper, none] = [Boundary::Paper, Boundary::None].map(shrunk);
    assert!(paper.abs() < 0.05, "{paper}");
    assert!(paper < 0.2 * none, "{paper} {none}");
}

#[test]
fn a_chain_of_cones_keeps_its_ends() {
    let spheres = spheres_at((0..20).map(|i| (Vec3::new(f64::from(i) / 19.0, 0.0, 0.0), 0.05)));
    let edges = (0..19).map(|i| [i, i + 1]).collect();
    let initial = MedialMesh::from_simplices(spheres, edges, vec![]).unwrap();
    let (mesh, _) = contract(&initial, params(), 2);
    assert_eq!(mesh.edges, [[0, 1]]);
    let length = mesh.spheres[0].centre.distance(mesh.spheres[1].centre);
    assert!((length - 1.0).abs() < 1e-9, "{length}");
}

#[test]
fn coincident_centres_go_first_and_keep_loops() {
    // A triangle of lone edges, each vertex doubled by a coincident one.
    let corners = [Vec3::ZERO, Vec3::X, Vec3::new(0.4, 0.9, 0.0)];
    let noise = Vec3::splat(3e-17);
    let doubled = corners.iter().flat_map(|&c| [(c, 0.1), (c + noise, 0.1 + 1e-17)]);
    let edges = vec![[0, 1], [2, 3], [4, 5], [1, 2], [3, 4], [0, 5]];
    let initial = MedialMesh::from_simplices(spheres_at(doubled), edges, vec![]).unwrap();
    let all = QmatParams { topology_from: TopologyFrom::All, ..params() };
    let (three, _) = contract(&initial, all, 3);
    for (m, corner) in three.spheres.iter().zip(corners) {
        assert!(m.centre.distance(corner) < 1e-15);
    }
    let (stuck, mut contraction) = contract(&initial, all, 1);
    assert_eq!(stuck, three);
    assert!(contraction.why_stopped().contains("holds back 3 of the 3 edges"));
    let never = QmatParams { topology_from: TopologyFrom::Never, ..params() };
    assert_eq!(contract(&initial, never, 1).0.spheres.len(), 1);
}

#[test]
fn degenerate_complexes_are_contracted_to_one_sphere_of_each_component() {
    let point = |_: u32| (Vec3::new(0.1, 0.2, 0.3), 0.25);
    let line = |v: u32| (Vec3::new(f64::from(v), 0.0, 0.0), 0.0);
    let nested =
        |v: u32| (Vec3::new(0.1 * f64::from(v), 0.01 * f64::from(v * v), 0.0), f64::from(v));
    let makers: [&dyn Fn(u32) -> (Vec3, f64); 3] = [&point, &line, &nested];
    for make in makers {
        let spheres = spheres_at((0..10).map(make));
        let faces = vec![[0, 1, 2], [1, 2, 3], [1, 2, 4], [2, 3, 5], [5, 6, 7]];
        let initial = MedialMesh::from_simplices(spheres, vec![[4, 8]], faces).unwrap();
        let (mesh, mut contraction) = contract(&initial, params(), 1);
        assert_eq!(mesh.spheres.len(), 2, "two components, {:?}", initial.spheres);
        assert!(contraction.why_stopped().contains("component"));
    }
}

#[test]
fn a_star_of_thousands_of_edges_is_contracted() {
    let leaves = 6000;
    let mut spheres = vec![Sphere::new(Vec3::ZERO, 1.0)];
    spheres.extend(spheres_at((0..leaves).map(|i| {
        let angle = f64::from(i) * 2.399_963;
        let reach = 1.5 + 0.3 * (f64::from(i) * 0.37).sin();
        (reach * Vec3::new(angle.cos(), angle.sin(), 0.0), 0.3)
    })));
    let edges = (1..=leaves).map(|i| [0, i]).collect();
    let initial = MedialMesh::from_simplices(spheres, edges, vec![]).unwrap();
    let (mesh, _) = contract(&initial, params(), leaves as usize - 200);
    assert_eq!(mesh.edges.len(), mesh.spheres.len() - 1);
}

#[test]
fn the_topology_is_kept_from_the_given_count_on() {
    // A closed strip: an annulus of 3 by 24 spheres.
    let around = 24_u32;
    let spheres = spheres_at((0..3 * around).map(|v| {
        let angle = f64::from(v / 3) / f64::from(around) * std::f64::consts::TAU;
        let reach = 0.4 + 0.02 * f64::from(v % 3) + 0.003 * (3.0 * angle).sin();
        (Vec3::new(reach * angle.cos(), reach * angle.sin(), 0.0), 0.05)
    }));
    let at = |i: u32, j: u32| (i % around) * 3 + j;
    let faces = (0..around)
        .flat_map(|i| (0..2).map(move |j| (i, j)))
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    let initial = MedialMesh::from_simplices(spheres, vec![], faces).unwrap();
    assert_eq!(betti(&initial), [1, 1, 0]);
    for topology_from in [TopologyFrom::All, TopologyFrom::Spheres(200)] {
        let (mesh, _) = contract(&initial, QmatParams { topology_from, ..params() }, 1);
        assert_eq!((mesh.spheres.len(), betti(&mesh)), (3, [1, 1, 0]));
    }
    for topology_from in [TopologyFrom::Never, TopologyFrom::Spheres(0)] {
        let (mesh, _) = contract(&initial, QmatParams { topology_from, ..params() }, 1);
        assert_eq!(mesh.spheres.len(), 1);
    }
}

/// Spheres that agree up to rounding, in any order.
fn same_spheres(a: &MedialMesh, b: &MedialMesh) -> bool {
    let near = |m: &Sphere, n: &Sphere| {
        m.centre.distance(n.centre) < 1e-7 && (m.radius - n.radius).abs() < 1e-7
    };
    let sizes = |m: &MedialMesh| (m.spheres.len(), m.edges.len(), m.faces.len());
    sizes(a) == sizes(b) && a.spheres.iter().all(|m| b.spheres.iter().any(|n| near(m, n)))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Where costs are distinct the ids do not matter.
    #[test]
    fn renumbering_changes_nothing(order in Just((0..144_u32).collect::<Vec<_>>()).prop_shuffle()) {
        let initial = bumpy(12);
        let mut spheres = initial.spheres.clone();
        for (old, &new) in order.iter().enumerate() {
            spheres[new as usize] = initial.spheres[old];
        }
        let new = |v: u32| order[v as usize];
        let faces = initial.faces.iter().map(|f| f.map(new)).collect();
        let renumbered = MedialMesh::from_simplices(spheres, vec![], faces).unwrap();
        for target in [100, 40] {
            let (a, _) = contract(&initial, params(), target);
            let (b, _) = contract(&renumbered, params(), target);
            prop_assert!(same_spheres(&a, &b));
        }
    }

    /// Rigid motions carry the result along.
    #[test]
    fn motions_are_carried_along(
        angle in 0.0..6.0f64, shift in prop::array::uniform3(-0.5..0.5f64),
    ) {
        let initial = bumpy(12);
        let motion = |p: Vec3| p.rotate_x(angle).rotate_z(0.7 * angle) + Vec3::from(shift);
        let (here, _) = contract(&initial, params(), 50);
        let (there, _) = contract(&initial.transformed(1.0, motion), params(), 50);
        prop_assert!(same_spheres(&here.transformed(1.0, motion), &there));
    }

    /// With the link condition from the start no Betti number changes, whatever the complex.
    #[test]
    fn random_complexes_keep_their_betti_numbers(
        points in prop::collection::vec((prop::array::uniform3(0.0..1.0f64), 0.0..0.3f64), 12),
        faces in prop::collection::vec(prop::sample::subsequence((0..12_u32).collect::<Vec<_>>(), 3), 0..30),
        edges in prop::collection::vec(prop::sample::subsequence((0..12_u32).collect::<Vec<_>>(), 2), 0..8),
        coincident in any::<bool>(),
    ) {
        let place = |c: [f64; 3]| if coincident { Vec3::from(c.map(f64::round)) } else { c.into() };
        let spheres = spheres_at(points.into_iter().map(|(c, r)| (place(c), r)));
        let faces = faces.into_iter().map(|f| [f[0], f[1], f[2]]).collect();
        let edges = edges.into_iter().map(|e| [e[0], e[1]]).collect();
        let initial = MedialMesh::from_simplices(spheres, edges, faces).unwrap();
        let all = QmatParams { topology_from: TopologyFrom::All, ..params() };
        for target in [9, 5, 1] {
            let (mesh, _) = contract(&initial, all, target);
            prop_assert_eq!(betti(&mesh), betti(&initial));
        }
    }
}

/// Follows the contraction to its end beside the oracle; the number of fallbacks, and of collapses.
fn follow(mesh: &MedialMesh, params: QmatParams) -> [usize; 3] {
    let mut oracle = Oracle::new(mesh, params);
    let mut contraction = Contraction::new(mesh, params);
    let (mut fallbacks, mut collapses) = (0, 0);
    while let Some(expected) = oracle.next() {
        let done = contraction.complex().record().len();
        let target = contraction.sphere_count() - 1;
        contraction.run_to(mesh, target, &RunContext::default()).unwrap();
        let record = contraction.complex().record();
        assert_eq!(record.len(), done + 1, "{expected:?}");
        let taken = record[done];
        let ends = [taken.kept.min(taken.removed), taken.kept.max(taken.removed)];
        assert_eq!(ends, expected.ends, "step {done}: {taken:?} instead of {expected:?}");
        let off = taken.sphere.centre.distance(expected.sphere.centre)
            + (taken.sphere.radius - expected.sphere.radius).abs();
        assert!(off < 1e-6, "step {done}: {taken:?} instead of {expected:?}");
        fallbacks += usize::from(expected.is_fallback);
        collapses += 1;
        oracle.collapse(taken.kept, taken.removed, taken.sphere);
        let complex = contraction.complex();
        assert_eq!([complex.edge_count(), complex.face_count()], oracle.sizes());
    }
    // Nothing is left but what only Betti numbers allow.
    let (left, unlocked) = (contraction.sphere_count(), contraction.unlocked());
    contraction.run_to(mesh, 1, &RunContext::default()).unwrap();
    assert!(contraction.sphere_count() == left || contraction.unlocked() > unlocked);
    [fallbacks, collapses, oracle.postponed]
}

#[test]
fn order_placement_and_fallback_are_those_of_the_paper_by_brute_force() {
    let mut rng = Pcg64::seed_from_u64(81);
    let mut totals = [0; 3];
    for round in 0..800 {
        let n = rng.random_range(6..14_u32);
        let mut x = || rng.random_range(0.0..1.0);
        let spheres =
            spheres_at((0..n).map(|_| (Vec3::new(x(), x(), x()), 0.02 + 0.3 * x() * x())));
        let mut distinct = || {
            let a = rng.random_range(0..n);
            let b = (a + rng.random_range(1..n)) % n;
            let c = (0..n).filter(|v| ![a, b].contains(v)).nth(rng.random_range(0..n as usize - 2));
            [a, b, c.expect("three of six")]
        };
        let faces: Vec<[u32; 3]> = (0..2 * n).map(|_| distinct()).collect();
        let edges = (0..n / 3).map(|_| distinct()).map(|[a, b, _]| [a, b]).collect();
        let initial = MedialMesh::from_simplices(spheres, edges, faces).unwrap();
        let topology_from = [TopologyFrom::Never, TopologyFrom::All][round / 2 % 2];
        let boundary = [Boundary::Paper, Boundary::None][round % 2];
        let params = QmatParams { topology_from, boundary, ..params() };
        totals.iter_mut().zip(follow(&initial, params)).for_each(|(all, n)| *all += n);
    }
    for (bumps, topology_from) in [6, 8, 11]
        .into_iter()
        .flat_map(|n| [TopologyFrom::All, TopologyFrom::Spheres(20)].map(|from| (n, from)))
    {
        let found = follow(&bumpy(bumps), QmatParams { topology_from, ..params() });
        totals.iter_mut().zip(found).for_each(|(all, n)| *all += n);
    }
    let [fallbacks, collapses, postponed] = totals;
    assert!(fallbacks > 10 && collapses > 3_000 && postponed > 50, "{totals:?}");
}

#[test]
fn parameters_are_typed_and_checked() {
    let typed = |key: &str, value: &str| {
        let mut params = Params::none();
        params.set(key, value);
        params.typed::<QmatParams>().and_then(QmatParams::validate)
    };
    assert_eq!(Params::none().typed::<QmatParams>().unwrap(), QmatParams::default());
    assert_eq!(typed("topology_from", "auto").unwrap(), QmatParams::default());
    assert_eq!(typed("topology_from", "all").unwrap().topology_from, TopologyFrom::All);
    assert_eq!(typed("topology_from", "never").unwrap().topology_from, TopologyFrom::Never);
    assert_eq!(typed("topology_from", "50").unwrap().topology_from, TopologyFrom::Spheres(50));
    assert_eq!(typed("boundary", "legacy").unwrap().boundary, Boundary::Legacy);
    let refusals =
        [("k", "-1"), ("topology_from", "some"), ("boundary", "soft"), ("singular_ratio", "1")];
    for (key, value) in refusals {
        let error = typed(key, value).unwrap_err().to_string();
        assert!(error.starts_with("parameter: "), "{error}");
    }
    for described in QmatParams::describe() {
        assert_eq!(typed(&described.name, &described.default).unwrap(), QmatParams::default());
    }
}
