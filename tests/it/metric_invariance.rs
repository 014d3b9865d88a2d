//! Metrics under rigid motion, scaling and renumbering of the input.
//!
//! Samples are laid out in a frame that moves along with both, in an order that does not depend on that
//! of the file. Certified intervals depend on the coordinate axes; but the enclosed values do not, so the
//! intervals of both have a value in common, at every tolerance.

use Symmetry::{Broken, Shared};
use medial::Vec3;
use medial::complex::{MedialMesh, Sphere};
use medial::metrics::{Certificate, Evaluation, JudgeOptions, Truth, certify};
use medial::surface::{TriMesh, TriangleBvh};
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde_json::{Value, json};

use crate::{judge, shapes};

fn options(samples: usize, volume_depth: u32) -> JudgeOptions {
    JudgeOptions { samples, volume_depth, seed: 4 }
}

/// A solid without symmetries: a box with bumps, of diagonal 1 or so, 768 triangles.
fn solid() -> TriMesh {
    shapes::moved(shapes::lattice_cube(8), |p| {
        let Vec3 { x, y, z } = p - 0.5;
        let bump = 1.0 + 0.2 * (3.0 * x + 1.0).sin() * (4.0 * y - 0.5).cos() + 0.1 * z;
        bump * Vec3::new(0.7 * x, 0.55 * y, 0.4 * z)
    })
}

/// The squares of a grid of `n` by `m` vertices, in two triangles each.
fn sheet(n: u32, m: u32) -> Vec<[u32; 3]> {
    let squares = (0..n - 1).flat_map(|i| (0..m - 1).map(move |j| i * m + j));
    squares.flat_map(|a| [[a, a + m, a + m + 1], [a, a + m + 1, a + 1]]).collect()
}

/// A medial mesh that is roughly right: sheets, a dangling edge, a lone sphere.
fn axis(seed: u64) -> MedialMesh {
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut spheres = Vec::new();
    for (i, j) in (0..5_u32).flat_map(|i| (0..4_u32).map(move |j| (i, j))) {
        let [x, y] = [f64::from(i) / 4.0 - 0.5, f64::from(j) / 3.0 - 0.5];
        let jitter = 0.02 * Vec3::new(rng.random(), rng.random(), rng.random());
        let radius = 0.1 + 0.05 * rng.random::<f64>();
        spheres.push(Sphere::new(Vec3::new(0.5 * x, 0.35 * y, 0.0) + jitter, radius));
    }
    spheres.push(Sphere::new(Vec3::new(0.3, 0.2, 0.1), 0.06));
    spheres.push(Sphere::new(Vec3::new(-0.25, 0.15, 0.08), 0.05));
    MedialMesh::from_simplices(spheres, vec![[19, 20]], sheet(5, 4)).unwrap()
}

/// A rotation, a scale and a translation.
struct Motion {
    rotation: glam::DQuat,
    scale: f64,
    shift: Vec3,
}

impl Motion {
    fn point(&self, p: Vec3) -> Vec3 {
        self.rotation * (p * self.scale) + self.shift
    }

    fn surface(&self, mesh: &TriMesh) -> TriMesh {
        let vertices = mesh.vertices.iter().map(|&v| self.point(v)).collect();
        TriMesh { vertices, faces: mesh.faces.clone() }
    }

    fn medial(&self, mesh: &MedialMesh) -> MedialMesh {
        mesh.transformed(self.scale, |p| self.point(p))
    }
}

fn motions() -> [Motion; 4] {
    let turn = glam::DQuat::from_axis_angle(Vec3::new(1.0, 2.0, -0.5).normalize(), 1.1);
    let shift = Vec3::new(3.0, -1.5, 0.7);
    let none = glam::DQuat::IDENTITY;
    [
        Motion { rotation: none, scale: 1.0, shift },
        Motion { rotation: none, scale: 254.0, shift: 100.0 * shift },
        Motion { rotation: turn, scale: 1.0, shift: Vec3::ZERO },
        Motion { rotation: turn, scale: 0.013, shift },
    ]
}

fn interval(surface: &TriMesh, mesh: &MedialMesh, tolerance: f64) -> Certificate {
    certify(surface, &TriangleBvh::new(surface).unwrap(), mesh, tolerance).unwrap()
}

/// Every number of an evaluation without intervals, with the sheets against a reference and the known axis `truth`.
fn everything(surface: &TriMesh, mesh: &MedialMesh, [truth, reference]: [&MedialMesh; 2]) -> Value {
    let truth = Truth { betti: Some([1, 0, 0]), axis: Some(truth.clone()), diagonal: 1.0 };
    let judge = judge(surface, truth, options(3_000, 4));
    let sheets = judge.sheet_difference(mesh, reference).unwrap();
    json!({ "evaluation": judge.evaluate(mesh).unwrap(), "sheets": sheets })
}

#[test]
fn every_number_of_an_evaluation_moves_with_the_shape() {
    let (surface, mesh, others) = (solid(), axis(1), [axis(2), axis(3)]);
    let before = everything(&surface, &mesh, others.each_ref());
    let measured = |surface: &TriMesh, mesh: &MedialMesh| {
        let found = judge(surface, Truth::default(), options(5_000, 0)).distances(mesh);
        serde_json::to_value(found.unwrap()).unwrap()
    };
    let plain = measured(&surface, &mesh);
    for motion in motions() {
        // Judges measure in units of the diagonal, which is 1 here.
        let Motion { rotation, scale, shift } = motion;
        let unit = Motion { rotation, scale: 1.0, shift: shift / scale };
        let moved = others.each_ref().map(|other| unit.medial(other));
        let after = everything(&unit.surface(&surface), &unit.medial(&mesh), moved.each_ref());
        assert_alike(&before, &after, "evaluation", 1e-9);
        // Distances alone have the unit of their arguments.
        let after = measured(&motion.surface(&surface), &motion.medial(&mesh));
        for (key, value) in plain.as_object().unwrap() {
            let factor = if key.ends_with("samples") { 1.0 } else { scale };
            let after = after[key].as_f64().unwrap() / factor;
            assert!((value.as_f64().unwrap() - after).abs() <= 1e-9, "{key}: {value} {after}");
        }
    }
}

/// Whether a medial mesh looks the same in all frames in which its surface does. Where it does not, the
/// samples of a turned surface are another set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Symmetry {
    Shared,
    Broken,
}

/// Surfaces with symmetries, each with medial meshes that share them all, some, or none.
fn symmetric() -> Vec<(&'static str, Symmetry, TriMesh, MedialMesh)> {
    let half = Vec3::splat(0.5);
    let from_corners = |lift: f64| {
        let corner =
            |k: u32| Vec3::new((k & 1).into(), (k >> 1 & 1).into(), (k >> 2).into()) - half;
        let mut spheres: Vec<_> = (0..8).map(|k| Sphere::new(0.8 * corner(k), 0.07)).collect();
        spheres.push(Sphere::new(lift * Vec3::new(1.0, 0.3, -0.2), 0.45));
        let edges = (0..8).flat_map(|a| [1, 2, 4].map(|bit| [a, a ^ bit])).filter(|[a, b]| a < b);
        let faces = edges.map(|[a, b]| [a, b, 8]).collect();
        MedialMesh::from_simplices(spheres, vec![], faces).unwrap()
    };
    let ring = |count: u32, lift: f64| {
        let turn = |k: u32| f64::from(k) / f64::from(count) * std::f64::consts::TAU;
        let centre = |k: u32| 2.0 * Vec3::new(turn(k).cos(), turn(k).sin(), 0.0);
        let mut spheres: Vec<_> = (0..count).map(|k| Sphere::new(centre(k), 0.9)).collect();
        spheres[0].radius -= lift;
        let edges = (0..count).map(|k| [k, (k + 1) % count]).collect();
        MedialMesh::from_simplices(spheres, edges, vec![]).unwrap()
    };
    let ball = |centre: Vec3, radius: f64| {
        MedialMesh::from_simplices(vec![Sphere::new(centre, radius)], vec![], vec![]).unwrap()
    };
    let cube = || shapes::moved(shapes::cube(), |p| p - half);
    let slab = || shapes::moved(cube(), |p| Vec3::new(2.0, 2.0, 0.5) * p);
    vec![
        ("cube", Shared, cube(), from_corners(0.0)),
        ("cube, off its centre", Broken, cube(), from_corners(0.05)),
        ("plate", Shared, slab(), from_corners(0.0)),
        ("plate, off its centre", Broken, slab(), from_corners(1e-3)),
        ("sphere", Shared, shapes::sphere(3), ball(Vec3::ZERO, 0.9)),
        (
            "sphere, off its centre",
            Broken,
            shapes::sphere(3),
            ball(Vec3::new(0.02, 0.01, 0.05), 0.9),
        ),
        ("sphere, corners", Shared, shapes::sphere(3), from_corners(0.0)),
        ("torus", Shared, shapes::torus(24, 12), ring(12, 0.0)),
        ("torus, five spheres", Broken, shapes::torus(24, 12), ring(5, 0.0)),
        ("torus, one smaller", Broken, shapes::torus(24, 12), ring(12, 0.01)),
    ]
}

fn judged(surface: &TriMesh, mesh: &MedialMesh) -> Evaluation {
    judge(surface, Truth::default(), options(3_000, 5)).evaluate(mesh).unwrap()
}

#[test]
fn symmetries_of_the_shape_do_not_matter() {
    for (name, symmetry, surface, mesh) in symmetric() {
        let before = judged(&surface, &mesh);
        let mut rng = Pcg64::seed_from_u64(7);
        for motion in motions().into_iter().filter(|motion| motion.scale == 1.0) {
            let mut moved = motion.surface(&surface);
            moved.faces.shuffle(&mut rng);
            let after = judged(&moved, &renumbered(&motion.medial(&mesh), &mut rng));
            let values = |e: &Evaluation| {
                let d = &e.distances;
                [
                    ("epsilon", d.epsilon),
                    ("epsilon_union", d.epsilon_union),
                    ("mean", d.mean),
                    ("rms", d.rms),
                    ("p95", d.p95),
                    ("spheres_only", d.spheres_only),
                    ("reverse", d.reverse),
                    ("reverse_mean", d.reverse_mean),
                    ("volume_error", e.volume_error.unwrap()),
                    ("protrusion", e.protrusion.unwrap()),
                    ("centres_outside", e.centres_outside.unwrap()),
                ]
            };
            for ((what, a), (_, b)) in values(&before).into_iter().zip(values(&after)) {
                let within = match (symmetry, what) {
                    (Shared, _) => 1e-9,
                    (Broken, "epsilon" | "epsilon_union" | "spheres_only" | "reverse") => 1e-4 * a,
                    (Broken, _) => 0.02 * a,
                };
                assert!((a - b).abs() <= within, "{name}, {what}: {a} {b}");
            }
            let samples = [&before, &after].map(|e| e.distances.reverse_samples);
            assert!(symmetry == Broken || samples[0] == samples[1], "{name}: {samples:?}");
        }
    }
}

/// The exact distance behind the certificate is invariant: the intervals before and after share a
/// value, however narrow they are.
#[test]
fn certified_intervals_meet_when_both_are_moved() {
    let (surface, mesh) = (solid(), axis(1));
    for tolerance in [1e-2, 1e-3, 1e-4] {
        let before = interval(&surface, &mesh, tolerance);
        for motion in motions() {
            let moved = motion.surface(&surface);
            let after = interval(&moved, &motion.medial(&mesh), tolerance * motion.scale.min(1.0));
            let (lower, upper) = (after.lower / motion.scale, after.upper / motion.scale);
            assert!(
                lower <= before.upper + 1e-9 && before.lower <= upper + 1e-9,
                "{before:?} and {lower} to {upper}, scale {}",
                motion.scale
            );
        }
    }
}

/// The same complex with its spheres in another order.
fn renumbered(mesh: &MedialMesh, rng: &mut Pcg64) -> MedialMesh {
    let mut order: Vec<u32> = (0..mesh.spheres.len() as u32).collect();
    order.shuffle(rng);
    mesh.renumbered(&order)
}

#[test]
fn renumbering_changes_nothing_at_all() {
    let (surface, mesh, truth, reference) = (solid(), axis(1), axis(2), axis(3));
    let list = mesh.spheres_alone();
    let measured = |mesh: &MedialMesh, list: &MedialMesh, reference: &MedialMesh| {
        let judge = judge(&surface, Truth::default(), options(3_000, 4));
        let intervals = [mesh, list].map(|m| judge.evaluate_certified(m, Some(1e-3)).unwrap());
        json!({ "all": everything(&surface, mesh, [&truth, reference]), "intervals": intervals })
    };
    let before = measured(&mesh, &list, &reference);
    let mut rng = Pcg64::seed_from_u64(5);
    for _ in 0..5 {
        let [mesh, list, reference] =
            [&mesh, &list, &reference].map(|mesh| renumbered(mesh, &mut rng));
        assert_eq!(measured(&mesh, &list, &reference), before);
    }
    // The vertices of the surface in another order, its faces as they were.
    let mut order: Vec<u32> = (0..surface.vertices.len() as u32).collect();
    order.shuffle(&mut rng);
    let mut vertices = surface.vertices.clone();
    for (from, &to) in order.iter().enumerate() {
        vertices[to as usize] = surface.vertices[from];
    }
    let faces = surface.faces.iter().map(|f| f.map(|v| order[v as usize])).collect();
    let moved = TriMesh { vertices, faces };
    assert_eq!(everything(&moved, &mesh, [&truth, &reference]), before["all"]);
    // Its faces in another order, each from another corner. A point above an edge has a closest point
    // in either face, and the two differ by rounding.
    let mut shuffled = surface.clone();
    shuffled.faces.shuffle(&mut rng);
    for face in &mut shuffled.faces {
        face.rotate_left(rng.random_range(0..3));
    }
    let after = everything(&shuffled, &mesh, [&truth, &reference]);
    assert_alike(&before["all"], &after, "evaluation", 1e-12);
    // The simplices of the medial mesh in another order, each from another corner.
    let (mut edges, mut faces) = (mesh.edges.clone(), mesh.faces.clone());
    edges.iter_mut().for_each(|edge| edge.reverse());
    edges.shuffle(&mut rng);
    faces.iter_mut().for_each(|face| face.rotate_left(1));
    faces.shuffle(&mut rng);
    assert_eq!(MedialMesh::from_simplices(mesh.spheres.clone(), edges, faces).unwrap(), mesh);
}

/// Equal but for numbers, which may differ by rounding.
fn assert_alike(a: &Value, b: &Value, what: &str, within: f64) {
    match (a, b) {
        (Value::Number(x), Value::Number(y)) => {
            let (x, y) = (x.as_f64().unwrap(), y.as_f64().unwrap());
            assert!((x - y).abs() <= within, "{what}: {x} {y}");
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            a.iter().zip(b).for_each(|(a, b)| assert_alike(a, b, what, within));
        }
        (Value::Object(a), Value::Object(b)) if a.len() == b.len() => {
            a.iter().for_each(|(key, a)| assert_alike(a, &b[key], key, within));
        }
        _ => assert_eq!(a, b, "{what}"),
    }
}

// Files whose scale, place or radii do not fit the mesh are named as such.

/// A box of diagonal 1 around the origin, and its exact axis.
fn cuboid() -> (TriMesh, MedialMesh) {
    let half = Vec3::new(1.5, 1.0, 0.5) / 14f64.sqrt();
    let flat = |i: u32, j: u32, n: u32| {
        let at = |k: u32, side: f64| (2.0 * f64::from(k) / f64::from(n) - 1.0) * (side - half.z);
        Sphere::new(Vec3::new(at(i, half.x), at(j, half.y), 0.0), half.z)
    };
    let n = 6;
    let grid: Vec<Sphere> = (0..=n).flat_map(|i| (0..=n).map(move |j| flat(i, j, n))).collect();
    let axis = MedialMesh::from_simplices(grid, vec![], sheet(n + 1, n + 1)).unwrap();
    (shapes::cuboid(-half, half), axis)
}

fn warnings(mesh: &MedialMesh) -> Vec<String> {
    judge(&cuboid().0, Truth::default(), options(2_000, 3)).evaluate(mesh).unwrap().warnings
}

fn with_radii(of: impl Fn(f64) -> f64) -> MedialMesh {
    let (_, mut axis) = cuboid();
    axis.spheres.iter_mut().for_each(|s| s.radius = of(s.radius));
    axis
}

#[test]
fn radii_that_do_not_fit_are_named() {
    assert!(warnings(&cuboid().1).is_empty(), "{:?}", warnings(&cuboid().1));
    for (factor, ratio) in [
        (1e-3, " 1.0e-3 times"),
        (0.0, " 0.0e0 times"),
        (0.02, " 0.020 times"),
        (0.5, " 0.500 times"),
        (0.8, " 0.800 times"),
        (1.3, " 1.300 times"),
        (2.0, " 2.000 times"),
    ] {
        let found = warnings(&with_radii(|r| factor * r));
        assert!(found.iter().any(|w| w.contains("radii") && w.contains(ratio)), "{found:?}");
    }
    let squared = warnings(&with_radii(|r| r * r));
    assert!(squared.iter().any(|w| w.contains("squared")), "{squared:?}");
}

#[test]
fn other_units_and_other_places_are_named() {
    let (_, axis) = cuboid();
    for scale in [25.4, 1e-3, 1000.0] {
        let found = warnings(&axis.transformed(scale, |p| p * scale));
        assert!(found.iter().any(|w| w.contains("other units")), "{scale}: {found:?}");
    }
    let moved = warnings(&axis.transformed(1.0, |p| p + 2.0 * Vec3::X));
    assert!(moved.iter().any(|w| w.contains("moved, or of another mesh")), "{moved:?}");
}

/// The change of radii by a poor simplification is no misfit of the file.
#[test]
fn poor_results_are_not_taken_for_misfits() {
    let (_, axis) = cuboid();
    let keep: Vec<bool> = (0..axis.spheres.len()).map(|k| k < 20).collect();
    assert!(warnings(&axis.induced(&keep)).is_empty());
    let uneven = |r: f64| r * if r > 0.0 { 0.95 } else { 1.0 };
    assert!(warnings(&with_radii(uneven)).is_empty());
}
