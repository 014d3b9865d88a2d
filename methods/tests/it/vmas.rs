//! VMAS on whole shapes: exact answers, what the authors' program gives, and what must change nothing.

use std::f64::consts::TAU;
use std::sync::atomic::Ordering;

use medial::Vec3;
use medial::complex::{MedialMesh, betti, euler};
use medial::metrics::JudgeOptions;
use medial::shape::{Shape, ShapeOptions};
use medial::simplifier::{Level, MedialSimplifier, Params, RunContext, Simplified, SimplifyError};
use medial::surface::{self, TriMesh};
use medial_methods::vmas;

fn shape_of(name: &str, mesh: &TriMesh) -> Shape {
    let report = surface::validate(mesh).expect("a solid");
    Shape::new(name, mesh, report, ShapeOptions::default()).expect("an extent")
}

fn built_in(id: &str) -> TriMesh {
    let built_in = medial_datasets::find(id).unwrap_or_else(|| panic!("{id} is in the catalogue"));
    built_in.mesh(built_in.default_resolution)
}

fn params(text: &str) -> Params {
    let mut params = Params::none();
    for pair in text.split(':').filter(|pair| !pair.is_empty()) {
        let (key, value) = pair.split_once('=').expect("key=value");
        params.set(key, value);
    }
    params
}

fn at(shape: &Shape, text: &str, level: Level) -> Simplified {
    let vmas = vmas::method();
    let prepared = vmas.prepare(shape, &params(text), &RunContext::default());
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
    let shape = shape_of("torus", &torus(1.0, 0.3, 240, 80));
    let diagonal = shape.normalisation().diagonal;
    for text in ["", "refit=published", "contact=mesh", "points=vertices"] {
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
    let shape = shape_of("sphere", &built_in("sphere"));
    for text in ["", "points=vertices", "refit=published", "points=vertices:refit=published"] {
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
        let surface::Loaded { mesh, report } = surface::read(&path).expect("a solid");
        let shape = Shape::new(name, &mesh, report, ShapeOptions::default()).expect("an extent");
        let result = spheres(&shape, "points=vertices:refit=published", 100);
        assert_eq!(result.mesh.spheres.len(), 100);
        let options = JudgeOptions { samples: 20_000, ..JudgeOptions::default() };
        let judge = shape.judge(None, options).expect("a judge");
        let found = 100.0 * judge.distances(&result.mesh).expect("distances").mean;
        assert!((found / mean - 1.0).abs() < 0.15, "{name}: {found} but {mean}");
    }
}

#[test]
fn one_thread_and_two_give_the_same_bytes() {
    let mesh = built_in("bracket");
    for text in ["", "points=vertices:refit=published:connect=faces", "contact=mesh"] {
        let results = [1, 2].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.expect("a pool").install(|| spheres(&shape_of("bracket", &mesh), text, 60))
        });
        assert_eq!(results[0].mesh, results[1].mesh, "{text}");
        assert_eq!(results[0].diagnostics, results[1].diagnostics, "{text}");
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
    let plain = shape_of("blob", &mesh);
    // A quarter turn keeps the bounding box, by whose side lengths are measured.
    let there = |p: Vec3| 3.7 * Vec3::new(-p.y, p.x, p.z) + Vec3::new(5.0, 1.0, -2.0);
    let back = |p: Vec3| {
        let p = (p - Vec3::new(5.0, 1.0, -2.0)) / 3.7;
        Vec3::new(p.y, -p.x, p.z)
    };
    let vertices = mesh.vertices.iter().map(|&v| there(v)).collect();
    let turned = shape_of("blob", &TriMesh { vertices, faces: mesh.faces.clone() });
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
fn an_answer_does_not_depend_on_earlier_requests() {
    let shape = shape_of("capsule", &built_in("capsule"));
    for text in ["", "points=vertices"] {
        let vmas = vmas::method();
        let run = RunContext::default();
        let mut prepared = vmas.prepare(&shape, &params(text), &run).expect("prepared");
        for level in [Level::Spheres(40), Level::Spheres(5), Level::Published, Level::Spheres(40)] {
            let asked = prepared.at(level).expect("spheres");
            let alone = at(&shape, text, level);
            assert_eq!((&asked.mesh, &asked.diagnostics), (&alone.mesh, &alone.diagnostics));
            assert_eq!(asked.asked, level);
        }
    }
}

#[test]
fn fewer_spheres_than_asked_are_said() {
    let corner = |k: u32| Vec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2));
    let sides =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let faces = sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    let cube = TriMesh { vertices: (0..8).map(corner).collect(), faces };
    let tetrahedron = TriMesh {
        vertices: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
        faces: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]],
    };
    for (text, asked, why) in [
        ("points=vertices", 5, "dropped"),
        ("samples=100:iterations=3", 20, "iterations"),
        ("points=vertices:iterations=1", 4, "iterations"),
    ] {
        for (name, mesh) in [("cube", &cube), ("tetrahedron", &tetrahedron)] {
            let Simplified { mesh, diagnostics, .. } = spheres(&shape_of(name, mesh), text, asked);
            mesh.check().expect("a valid complex");
            assert!((1..asked).contains(&mesh.spheres.len()), "{name} {text}");
            let said = diagnostics.warnings.iter().any(|warning| warning.contains(why));
            assert!(said, "{name} {text}: {:?}", diagnostics.warnings);
        }
    }
}

#[test]
fn levels_that_it_has_not_are_refused() {
    let shape = shape_of("capsule", &built_in("capsule"));
    let vmas = vmas::method();
    let mut prepared =
        vmas.prepare(&shape, &Params::none(), &RunContext::default()).expect("prepared");
    assert!(matches!(prepared.at(Level::Spheres(0)), Err(SimplifyError::Level(_))));
    let native = prepared.at(Level::Native(1.0));
    assert!(matches!(native, Err(SimplifyError::Unsupported { .. })));
    assert_eq!(prepared.at(Level::Published).expect("spheres").mesh.spheres.len(), 100);
}

#[test]
fn a_cancelled_run_ends_as_cancelled() {
    let shape = shape_of("capsule", &built_in("capsule"));
    let run = RunContext::default();
    run.cancel_flag().store(true, Ordering::Relaxed);
    let before = vmas::method().prepare(&shape, &Params::none(), &run);
    assert!(matches!(before, Err(SimplifyError::Cancelled)));
    let run = RunContext::default();
    let flag = run.cancel_flag();
    let run = run.on_progress(move |progress| {
        if progress.done > 3 {
            flag.store(true, Ordering::Relaxed);
        }
    });
    let vmas = vmas::method();
    let mut prepared = vmas.prepare(&shape, &Params::none(), &run).expect("prepared");
    assert!(matches!(prepared.at(Level::Spheres(50)), Err(SimplifyError::Cancelled)));
}
