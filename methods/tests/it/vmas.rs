//! VMAS on whole shapes: exact results, results of the authors' program, and invariances.

use std::f64::consts::TAU;

use medial::Vec3;
use medial::complex::{MedialMesh, betti, euler};
use medial::metrics::JudgeOptions;
use medial::shape::Shape;
use medial::simplifier::{Level, MedialSimplifier, RunContext, Simplified};
use medial::surface::{self, TriMesh};
use medial_methods::vmas;

use crate::common::{built_in, cuboid, default_shape, params, shape_of};

fn at(shape: &Shape, text: &str, level: Level) -> Simplified {
    let vmas = vmas::method();
    let set: Vec<(&str, &str)> = text.split(':').filter_map(|pair| pair.split_once('=')).collect();
    let prepared = vmas.prepare(shape, &params(&set), &RunContext::default());
    prepared.expect("prepared").at(level).expect("spheres")
}

fn spheres(shape: &Shape, text: &str, count: usize) -> Simplified {
    at(shape, text, Level::Spheres(count))
}

/// A torus around the z axis, of `around` times `across` quadrilaterals.
fn torus(large: f64, small: f64, around: u32, across: u32) -> TriMesh {
    let vertex = |k: u32| {
        let (u, v) = (k / across, k % across);
        let (u, v) =
            (TAU * f64::from(u) / f64::from(around), TAU * f64::from(v) / f64::from(across));
        let ring = large + small * v.cos();
        Vec3::new(ring * u.cos(), ring * u.sin(), small * v.sin())
    };
    let id = |u: u32, v: u32| u % around * across + v % across;
    let faces = (0..around * across).flat_map(|k| {
        let (u, v) = (k / across, k % across);
        let [a, b, c, d] = [id(u, v), id(u + 1, v), id(u + 1, v + 1), id(u, v + 1)];
        [[a, b, c], [a, c, d]]
    });
    TriMesh { vertices: (0..around * across).map(vertex).collect(), faces: faces.collect() }
}

#[test]
fn sixteen_spheres_of_a_torus_are_a_ring() {
    let shape = shape_of(&torus(1.0, 0.3, 240, 80));
    let diagonal = shape.normalisation().diagonal;
    for text in ["", "points=vertices"] {
        let Simplified { mesh, diagnostics, .. } = spheres(&shape, text, 16);
        assert_eq!((mesh.spheres.len(), euler(&mesh), betti(&mesh)), (16, 0, [1, 1, 0]), "{text}");
        assert!(mesh.faces.is_empty() && mesh.edges.len() == 16, "{text}");
        assert!(diagnostics.warnings.is_empty(), "{text}: {:?}", diagnostics.warnings);
        for sphere in &mesh.spheres {
            let centre = shape.normalisation().backward(sphere.centre);
            let (radius, ring) = (sphere.radius * diagonal, centre.truncate().length());
            // Of the surface of quadrilaterals: its normals are up to 2 degrees off.
            assert!((0.298..0.301).contains(&radius), "{text}: {radius}");
            assert!((ring - 1.0).hypot(centre.z) < 3e-3, "{text}: {centre}");
        }
    }
}

#[test]
fn one_sphere_of_a_ball_is_the_ball() {
    let shape = default_shape("sphere");
    for text in ["", "points=vertices"] {
        let mesh = spheres(&shape, text, 1).mesh;
        let [ball] = mesh.spheres[..] else { panic!("one sphere") };
        let radii: Vec<f64> =
            shape.mesh().vertices.iter().map(|v| v.distance(ball.centre) - ball.radius).collect();
        let worst = radii.iter().fold(0.0_f64, |worst, r| worst.max(r.abs()));
        assert!(worst < 2e-3, "{text}: {worst}");
        assert_eq!((mesh.edges.len(), mesh.faces.len()), (0, 0));
    }
}

/// Mean errors in % of the diagonal of the authors' program, from the same judge: at the vertices, with
/// their refit, 100 spheres.
#[test]
fn mean_errors_are_those_of_the_authors_program() {
    for (name, mean) in [("fertility.off", 0.234), ("threeholes.off", 0.257)] {
        let Some(path) = medial_test_support::mesh(name) else { continue };
        let shape = shape_of(&surface::read(&path).expect("a solid").mesh);
        let result = spheres(&shape, "points=vertices", 100);
        assert_eq!(result.mesh.spheres.len(), 100);
        let options = JudgeOptions { samples: 20_000, ..JudgeOptions::default() };
        let judge = shape.judge(None, options).expect("a judge");
        let found = 100.0 * judge.distances(&result.mesh).expect("distances").mean;
        assert!((found / mean - 1.0).abs() < 0.15, "{name}: {found} but {mean}");
    }
}

/// Spheres in input units, in an order that does not depend on their ids.
fn sorted(shape: &Shape, mesh: &MedialMesh, back: impl Fn(Vec3) -> Vec3) -> Vec<[f64; 4]> {
    let normal = shape.normalisation();
    let mut spheres: Vec<[f64; 4]> = mesh
        .spheres
        .iter()
        .map(|s| {
            let centre = back(normal.backward(s.centre));
            [centre.x, centre.y, centre.z, s.radius * normal.diagonal]
        })
        .collect();
    spheres.sort_by(|a, b| a[0].total_cmp(&b[0]));
    spheres
}

#[test]
fn scale_and_rotation_change_nothing_but_scale_and_rotation() {
    let mesh = built_in("blob");
    let plain = shape_of(&mesh);
    // A quarter turn keeps the bounding box, by whose side lengths are measured.
    let there = |p: Vec3| 3.7 * Vec3::new(-p.y, p.x, p.z) + Vec3::new(5.0, 1.0, -2.0);
    let back = |p: Vec3| {
        let p = (p - Vec3::new(5.0, 1.0, -2.0)) / 3.7;
        Vec3::new(p.y, -p.x, p.z)
    };
    let vertices = mesh.vertices.iter().map(|&v| there(v)).collect();
    let turned = shape_of(&TriMesh { vertices, faces: mesh.faces.clone() });
    for text in ["", "points=vertices"] {
        let [a, b] = [&plain, &turned].map(|shape| spheres(shape, text, 12).mesh);
        assert_eq!((a.edges.len(), a.faces.len()), (b.edges.len(), b.faces.len()), "{text}");
        let (mut a, b) = (sorted(&plain, &a, |p| p), sorted(&turned, &b, back));
        a.iter_mut().for_each(|s| s[3] *= 3.7);
        for (a, b) in a.iter().zip(&b) {
            assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-7), "{text}: {a:?} {b:?}");
        }
    }
}

#[test]
fn fewer_spheres_than_requested_have_a_warning() {
    let cube = cuboid(Vec3::ONE);
    let tetrahedron = TriMesh {
        vertices: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
        faces: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]],
    };
    for (text, requested, why) in [
        ("points=vertices", 5, "dropped"),
        ("points=samples:iterations=3", 20, "iterations"),
        ("points=vertices:iterations=1", 4, "iterations"),
    ] {
        for (name, mesh) in [("cube", &cube), ("tetrahedron", &tetrahedron)] {
            let Simplified { mesh, diagnostics, .. } = spheres(&shape_of(mesh), text, requested);
            mesh.check().expect("a valid complex");
            assert!((1..requested).contains(&mesh.spheres.len()), "{name} {text}");
            let is_warned = diagnostics.warnings.iter().any(|warning| warning.contains(why));
            assert!(is_warned, "{name} {text}: {:?}", diagnostics.warnings);
        }
    }
}
