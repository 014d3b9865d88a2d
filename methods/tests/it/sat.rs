//! SAT on sampled solids: the result of scale 1, the scale at which a gap closes, real meshes.

use std::f64::consts::{PI, TAU};

use medial::Vec3;
use medial::complex::{MedialMesh, MedialUnion, Sphere, betti};
use medial::shape::{Shape, ShapeOptions};
use medial::simplifier::{Level, Simplified};
use medial::surface::{self, TriMesh};

use crate::common::{default_shape, levels, shape_of, with_threads};

fn at(shape: &Shape, level: Level) -> Simplified {
    levels(shape, "sat", &[], &[level]).remove(0).expect("a scale axis")
}

fn of_spheres(spheres: &[Sphere]) -> MedialUnion {
    let mesh = MedialMesh::from_simplices(spheres.to_vec(), vec![], vec![]).expect("spheres");
    MedialUnion::new(&mesh).expect("a union")
}

/// How far the union of `a` sticks out of that of `b`, from points on each sphere of `a`.
fn excess(a: &[Sphere], b: &[Sphere]) -> f64 {
    let b = of_spheres(b);
    let directions: Vec<Vec3> = (0..60)
        .map(|k| {
            let z = 1.0 - (f64::from(k) + 0.5) / 30.0;
            let (sin, cos) = (2.399_963 * f64::from(k)).sin_cos();
            Vec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z)
        })
        .collect();
    let points: Vec<Vec3> =
        a.iter().flat_map(|s| directions.iter().map(|d| s.centre + s.radius * *d)).collect();
    b.signed_batch(&points).into_iter().fold(0.0, f64::max)
}

#[test]
fn scale_one_leaves_the_union_of_polar_balls() {
    for id in ["torus", "bracket", "blob", "capsule"] {
        let shape = default_shape(id);
        let balls = shape.inner_balls().expect("poles").spheres.clone();
        let result = at(&shape, Level::Native(1.0));
        let spheres = &result.mesh.spheres;
        let hausdorff = excess(spheres, &balls).max(excess(&balls, spheres));
        assert!(hausdorff < 1e-3, "{id}: {hausdorff}");
    }
}

/// A tube of radius `r` along the unit circle, open between the angles `-alpha` and `alpha`, with
/// round ends.
fn open_ring(alpha: f64, r: f64, n: u32) -> TriMesh {
    let around = n / 8;
    let caps = n / 32;
    let mut rings: Vec<(f64, f64, f64)> = Vec::new();
    for k in 1..caps {
        let t = PI / 2.0 * f64::from(k) / f64::from(caps);
        rings.push((alpha, -r * t.cos(), r * t.sin()));
    }
    for k in 0..=n {
        rings.push((alpha + (TAU - 2.0 * alpha) * f64::from(k) / f64::from(n), 0.0, r));
    }
    for k in (1..caps).rev() {
        let t = PI / 2.0 * f64::from(k) / f64::from(caps);
        rings.push((TAU - alpha, r * t.cos(), r * t.sin()));
    }
    // Position on the spine's tangent line, and in the plane across it.
    let place = |(angle, along, radius): (f64, f64, f64), turn: f64| {
        let out = Vec3::new(angle.cos(), angle.sin(), 0.0);
        let tangent = Vec3::new(-angle.sin(), angle.cos(), 0.0);
        out + along * tangent + radius * (turn.cos() * out + turn.sin() * Vec3::Z)
    };
    let mut vertices = vec![place((alpha, -r, 0.0), 0.0), place((TAU - alpha, r, 0.0), 0.0)];
    for (i, &ring) in rings.iter().enumerate() {
        for k in 0..around {
            let shift = if i % 2 == 0 { 0.0 } else { 0.5 };
            vertices.push(place(ring, TAU * (f64::from(k) + shift) / f64::from(around)));
        }
    }
    let id = |ring: usize, k: u32| 2 + ring as u32 * around + k % around;
    let mut faces = Vec::new();
    let last = rings.len() - 1;
    for k in 0..around {
        faces.push([0, id(0, k), id(0, k + 1)]);
        faces.push([1, id(last, k + 1), id(last, k)]);
        for ring in 0..last {
            let [a, b] = [id(ring, k), id(ring, k + 1)];
            let [c, d] = [id(ring + 1, k), id(ring + 1, k + 1)];
            faces.extend([[a, c, b], [b, c, d]]);
        }
    }
    let mut mesh = TriMesh { vertices, faces };
    if surface::validate(&mesh).is_err() {
        for face in &mut mesh.faces {
            face.swap(1, 2);
        }
    }
    mesh
}

/// The scale from which on the result has a loop.
fn closing_scale(shape: &Shape) -> f64 {
    let loops = |scale: f64| {
        let [b0, b1, b2] = betti(&at(shape, Level::Native(scale)).mesh);
        assert_eq!((b0, b2), (1, 0), "at {scale}");
        b1
    };
    let (mut open, mut closed) = (1.05, 1.9);
    assert_eq!((loops(open), loops(closed)), (0, 1));
    while closed - open > 1e-3 {
        let middle = (open + closed) / 2.0;
        if loops(middle) == 0 { open = middle } else { closed = middle }
    }
    closed
}

#[test]
fn the_gap_of_an_open_ring_closes_at_the_scale_of_elementary_geometry() {
    // The ends are 2 sin(alpha) apart and touch when their balls have half of that as radius.
    for (alpha, r) in [(0.3, 0.2), (0.25, 0.15)] {
        let expected = f64::sin(alpha) / r;
        let ring = shape_of(&open_ring(alpha, r, 160));
        let found = closing_scale(&ring);
        assert!((found / expected - 1.0).abs() < 0.02, "samples: {found} but {expected}");
        // The same with exact balls along the circle.
        let balls = (0..=400).map(|k| {
            let angle = alpha + (TAU - 2.0 * alpha) * f64::from(k) / 400.0;
            Sphere::new(Vec3::new(angle.cos(), angle.sin(), 0.0), r)
        });
        let chain = MedialMesh::from_simplices(balls.collect(), vec![], vec![]).expect("balls");
        let ring = shape_of(&open_ring(alpha, r, 160)).with_initial(&chain);
        let found = closing_scale(&ring);
        assert!((found / expected - 1.0).abs() < 0.005, "balls: {found} but {expected}");
    }
}

#[test]
fn all_built_in_shapes_have_valid_axes() {
    for built_in in medial_datasets::catalogue() {
        let shape = shape_of(&built_in.mesh(built_in.default_resolution));
        for scale in [1.0, 1.1, 2.0] {
            let result = at(&shape, Level::Native(scale));
            result.mesh.check().expect("a valid complex");
            assert!(!result.mesh.spheres.is_empty());
            let (id, warnings) = (built_in.id, &result.diagnostics.warnings);
            assert!(warnings.is_empty(), "{id} {warnings:?}");
            let dense = ["sphere", "box", "capsule", "torus", "hollow-sphere", "blob", "bracket"];
            if scale == 1.0 && dense.contains(&id) {
                assert_eq!(Some(betti(&result.mesh)), shape.expected_betti(), "{id}");
            }
        }
    }
}

#[test]
fn shared_meshes_have_valid_axes_for_any_number_of_threads() {
    for path in medial_test_support::surfaces() {
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        let surface::Loaded { mesh, report } = surface::read(&path).expect("a solid");
        let results = [1, 2].map(|threads| {
            with_threads(threads, || {
                let shape = Shape::new(&name, &mesh, report.clone(), ShapeOptions::default());
                at(&shape.expect("an extent"), Level::Native(1.1))
            })
        });
        assert_eq!(results[0].mesh, results[1].mesh, "{name}");
        results[0].mesh.check().expect("a valid complex");
        assert!(results[0].diagnostics.warnings.is_empty(), "{name} {:?}", results[0].diagnostics);
    }
}

#[test]
fn larger_scales_leave_fewer_spheres_and_counts_are_met() {
    let shape = default_shape("blob");
    let sizes = [1.0, 1.1, 1.3, 1.6, 2.0].map(|s| at(&shape, Level::Native(s)).mesh.spheres.len());
    assert!(sizes.windows(2).all(|w| w[1] < w[0]), "{sizes:?}");
    for count in [sizes[0] / 2, 400, 50] {
        let result = at(&shape, Level::Spheres(count));
        let reached = result.mesh.spheres.len();
        assert!(reached <= count && reached * 10 >= count * 8, "{reached} for {count}");
        let again = at(&shape, Level::Native(result.native_level.expect("a scale")));
        assert_eq!(again.mesh, result.mesh);
    }
}
