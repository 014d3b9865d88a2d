//! Wraps of open, one-sided, crossing and degenerate input.

use std::f64::consts::PI;

use rayon::ThreadPoolBuilder;

use super::super::mesh::fixtures::cuboid;
use super::inspect::{farthest, first_escape};
use super::tetrahedron::Tetrahedron;
use super::*;
use crate::geometry::hash::splitmix;
use crate::surface::{InsideTest, Side, SurfaceReport, validate};

/// A number of `[0, 1)`.
fn uniform(seed: u64) -> f64 {
    (splitmix(seed) >> 11) as f64 / (1_u64 << 53) as f64
}

fn random_point(seed: u64) -> Vec3 {
    Vec3::from([0, 1, 2].map(|axis| uniform(3 * seed + axis)))
}

/// A grid of `n` times `m` vertices over `[0, 1]^2`, as two triangles a cell.
fn patch(n: u32, m: u32, at: impl Fn(f64, f64) -> Vec3) -> TriMesh {
    let share = |k: u32, all: u32| f64::from(k) / f64::from(all - 1);
    let vertices = (0..n * m).map(|k| at(share(k / m, n), share(k % m, m))).collect();
    let cells = (0..n - 1).flat_map(|i| (0..m - 1).map(move |j| i * m + j));
    let faces = cells.flat_map(|k| [[k, k + m, k + m + 1], [k, k + m + 1, k + 1]]).collect();
    TriMesh { vertices, faces }
}

fn on_sphere(longitude: f64, latitude: f64) -> Vec3 {
    let (sin, cos) = latitude.sin_cos();
    Vec3::new(cos * longitude.cos(), cos * longitude.sin(), sin)
}

fn hemisphere() -> TriMesh {
    patch(33, 9, |s, t| on_sphere(2.0 * PI * s, 0.5 * PI * t))
}

fn moebius() -> TriMesh {
    patch(65, 3, |s, t| {
        let (turn, width) = (2.0 * PI * s, 0.3 * (t - 0.5));
        let (sin, cos) = (0.5 * turn).sin_cos();
        let radius = 1.0 + width * cos;
        Vec3::new(radius * turn.cos(), radius * turn.sin(), width * sin)
    })
}

fn joined(parts: &[TriMesh]) -> TriMesh {
    let mut all = TriMesh::default();
    for part in parts {
        let first = all.vertices.len() as u32;
        all.vertices.extend(&part.vertices);
        all.faces.extend(part.faces.iter().map(|face| face.map(|v| v + first)));
    }
    all
}

fn cloud(points: impl IntoIterator<Item = Vec3>) -> TriMesh {
    let vertices: Vec<Vec3> = points.into_iter().collect();
    let faces = (0..vertices.len() as u32).map(|v| [v; 3]).collect();
    TriMesh { vertices, faces }
}

fn wrapped(input: &TriMesh, alpha: f64, offset: f64) -> TriMesh {
    wrap(&input.vertices, &input.faces, alpha, offset).expect("a wrap")
}

/// Wraps, and checks every property that holds for any input.
fn checked(input: &TriMesh, alpha: f64, offset: f64) -> (TriMesh, SurfaceReport) {
    let mesh = wrapped(input, alpha, offset);
    let report = validate(&mesh).unwrap_or_else(|error| panic!("{error}"));
    assert!(!report.self_intersecting);
    assert!(report.volume > Some(0.0), "outward: {:?}", report.volume);
    assert_eq!(report.expected_betti.map(|betti| betti[2]), Some(0), "no cavity");
    assert_eq!(first_escape(&input.vertices, &input.faces, &mesh), None);
    let test = InsideTest::new(&mesh);
    for seed in 0..2_000 {
        let [a, b, c] = input.triangle(seed as usize % input.faces.len());
        let [s, t] = [0, 1].map(|k| uniform(2 * seed + k));
        let (s, t) = if s + t > 1.0 { (1.0 - s, 1.0 - t) } else { (s, t) };
        let p = a + s * (b - a) + t * (c - a);
        assert_eq!(test.side(p), Side::Inside, "{p}");
    }
    let corners: Vec<_> = (0..input.faces.len()).map(|face| input.triangle(face)).collect();
    let bvh = TriangleBvh::from_triangles(&corners).expect("triangles");
    for &vertex in &mesh.vertices {
        let error = bvh.closest(vertex).distance / offset - 1.0;
        assert!(error.abs() <= PRECISION, "{vertex} is off by {error} of the offset");
    }
    (mesh, report)
}

#[test]
fn a_cube_is_wrapped_tightly() {
    let cube = cuboid(Vec3::ZERO, Vec3::ONE);
    let (mesh, report) = checked(&cube, 0.2, 0.01);
    assert_eq!(report.expected_betti, Some([1, 0, 0]));
    let volume = report.volume.expect("a volume");
    assert!(volume > 1.0 && volume < 1.02_f64.powi(3), "{volume}");
    assert!(farthest(&cube.vertices, &cube.faces, &mesh) < 0.02);
}

#[test]
fn an_open_hemisphere_keeps_its_shape() {
    let (_, report) = checked(&hemisphere(), 0.2, 0.02);
    assert_eq!(report.expected_betti, Some([1, 0, 0]));
    // A shell of twice the offset around a bowl of area 2 pi, not a filled half ball of volume 2.1.
    let volume = report.volume.expect("a volume");
    assert!(volume > 0.1 && volume < 0.5, "{volume}");
}

#[test]
fn a_moebius_band_becomes_a_solid_torus() {
    let (_, report) = checked(&moebius(), 0.1, 0.01);
    assert_eq!(report.expected_betti, Some([1, 1, 0]));
}

#[test]
fn the_points_of_a_sphere_become_a_ball() {
    let golden = PI * (3.0 - 5_f64.sqrt());
    let points = (0..2_000).map(|k| {
        let latitude = (1.0 - (2.0 * f64::from(k) + 1.0) / 2_000.0).asin();
        on_sphere(golden * f64::from(k), latitude)
    });
    let (_, report) = checked(&cloud(points), 0.2, 0.02);
    assert_eq!(report.expected_betti, Some([1, 0, 0]), "the ball does not pass between points");
    let volume = report.volume.expect("a volume") / (4.0 / 3.0 * PI);
    assert!(volume > 0.95 && volume < 1.1, "{volume}");
}

#[test]
fn overlapping_boxes_become_one_part_and_distant_ones_two() {
    let boxes = |by: f64| {
        let shift = Vec3::splat(by);
        joined(&[cuboid(Vec3::ZERO, Vec3::ONE), cuboid(shift, Vec3::ONE + shift)])
    };
    let (_, report) = checked(&boxes(0.5), 0.15, 0.01);
    assert_eq!(report.expected_betti, Some([1, 0, 0]));
    let volume = report.volume.expect("a volume");
    assert!(volume > 1.875 && volume < 2.0, "{volume}");
    let (_, report) = checked(&boxes(1.5), 0.15, 0.01);
    assert_eq!(report.expected_betti, Some([2, 0, 0]));
}

#[test]
fn triangles_segments_and_points_are_wrapped() {
    let corners = vec![Vec3::ZERO, Vec3::X, Vec3::new(0.3, 0.8, 0.1)];
    for faces in [vec![[0, 1, 2]], vec![[0, 1, 1]], vec![[2, 2, 2]], vec![[0, 1, 1], [2, 2, 2]]] {
        let parts = faces.len();
        let input = TriMesh { vertices: corners.clone(), faces };
        let used = cloud(input.faces.as_flattened().iter().map(|&v| corners[v as usize]));
        let (mesh, report) = checked(&input_without_spares(&input), 0.1, 0.02);
        assert_eq!(report.expected_betti, Some([parts, 0, 0]));
        assert_eq!(first_escape(&used.vertices, &used.faces, &mesh), None);
    }
}

/// The vertices that the faces use.
fn input_without_spares(input: &TriMesh) -> TriMesh {
    let corners = input.faces.iter().flatten().map(|&v| input.vertices[v as usize]);
    let faces = (0..input.faces.len() as u32).map(|face| [0, 1, 2].map(|k| 3 * face + k)).collect();
    TriMesh { vertices: corners.collect(), faces }
}

#[test]
fn an_opening_wider_than_alpha_is_entered_and_a_narrower_one_is_not() {
    // An open box with a slit between its two halves of the lid.
    let with_slit = |width: f64| {
        let mut shell = cuboid(Vec3::ZERO, Vec3::ONE);
        shell.faces.drain(2..4);
        let half = |lo: f64, hi: f64| {
            let mut lid = cuboid(Vec3::new(lo, 0.0, 1.0), Vec3::new(hi, 1.0, 1.0));
            lid.faces.truncate(2);
            lid
        };
        let lids = [half(0.0, 0.5 - 0.5 * width), half(0.5 + 0.5 * width, 1.0)];
        joined(&[&[shell], &lids[..]].concat())
    };
    let volume = |width: f64| {
        let (_, report) = checked(&with_slit(width), 0.1, 0.01);
        report.volume.expect("a volume")
    };
    let (narrow, wide) = (volume(0.1), volume(0.35));
    assert!(narrow > 1.0, "filled: {narrow}");
    assert!(wide < 0.3, "entered: {wide}");
}

#[test]
fn a_random_soup_is_wrapped_the_same_by_any_number_of_threads() {
    let triangles = (0..60).flat_map(|k| {
        let corner = random_point(1_000 + k);
        [corner, corner + 0.3 * random_point(2_000 + k), corner + 0.3 * random_point(3_000 + k)]
    });
    let vertices: Vec<Vec3> = triangles.collect();
    let faces = (0..60).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
    let soup = TriMesh { vertices, faces };
    let (first, _) = checked(&soup, 0.06, 0.005);
    assert!(first.vertices.len() > 300, "{}", first.vertices.len());
    for threads in [1, 2] {
        let pool = ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        let bits = |mesh: &TriMesh| -> Vec<[u64; 3]> {
            mesh.vertices.iter().map(|v| v.to_array().map(f64::to_bits)).collect()
        };
        let mesh = pool.install(|| wrapped(&soup, 0.06, 0.005));
        assert_eq!((bits(&mesh), &mesh.faces), (bits(&first), &first.faces), "{threads} threads");
    }
}

#[test]
fn lengths_scale_with_the_input() {
    let bowl = hemisphere();
    let plain = wrapped(&bowl, 0.25, 0.02);
    for scale in [2_f64.powi(-400), 2_f64.powi(500)] {
        let vertices = bowl.vertices.iter().map(|&v| v * scale).collect();
        let large = TriMesh { vertices, faces: bowl.faces.clone() };
        let mesh = wrapped(&large, 0.25 * scale, 0.02 * scale);
        assert_eq!(mesh.faces, plain.faces);
        let back: Vec<Vec3> = mesh.vertices.iter().map(|&v| v / scale).collect();
        assert_eq!(back, plain.vertices);
    }
}

#[test]
fn unusable_input_is_refused() {
    let corners = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::NAN];
    let refused =
        |faces: &[[u32; 3]], alpha, offset| wrap(&corners, faces, alpha, offset).unwrap_err();
    assert_eq!(refused(&[], 0.1, 0.1), WrapError::Empty);
    let corner = |corner| WrapError::Corner { triangle: 1, corner };
    assert_eq!(refused(&[[0, 1, 2], [0, 1, 3]], 0.1, 0.1), corner(3));
    assert_eq!(refused(&[[0, 1, 2], [0, 9, 1]], 0.1, 0.1), corner(9));
    for value in [0.0, -1.0, f64::INFINITY] {
        assert_eq!(refused(&[[0, 1, 2]], value, 0.1), WrapError::Length { name: "alpha", value });
        assert_eq!(refused(&[[0, 1, 2]], 0.1, value), WrapError::Length { name: "offset", value });
    }
    assert!(matches!(refused(&[[0, 1, 2]], 0.1, 1e-14), WrapError::Resolution { .. }));
}

#[test]
fn tetrahedra_meet_the_triangles_that_reach_them() {
    let cell = Tetrahedron::new([Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z]);
    let inside = Vec3::splat(0.2);
    let beyond = Vec3::splat(0.34);
    assert!(cell.meets([inside; 3]) && !cell.meets([beyond; 3]));
    // A segment that ends short of the slanted face, and one through it.
    assert!(!cell.meets([beyond, Vec3::ONE, Vec3::ONE]));
    assert!(cell.meets([inside, Vec3::ONE, Vec3::ONE]));
    // A segment past an edge: no normal of a face separates it.
    let past = |by: f64| {
        [Vec3::new(-by, -by, 0.3), Vec3::new(by, -3.0 * by, 0.3)]
            .map(|p| p + Vec3::new(0.0, 0.0, 0.1))
    };
    let [a, b] = past(0.1);
    assert!(!cell.meets([a, b, b]));
    // Random triangles against dense samples of them.
    for seed in 0..400 {
        let triangle = [0, 1, 2].map(|k| 2.0 * random_point(3 * seed + k) - 0.5);
        let [a, b, c] = triangle;
        let samples = (0..2_000).map(|k| {
            let [s, t] = [0, 1].map(|i| uniform(2 * k + i));
            let (s, t) = if s + t > 1.0 { (1.0 - s, 1.0 - t) } else { (s, t) };
            a + s * (b - a) + t * (c - a)
        });
        // Depth below the nearest face: positive inside.
        let depth = |p: Vec3| p.min_element().min((1.0 - p.element_sum()) / 3_f64.sqrt());
        let deepest = samples.map(depth).fold(f64::NEG_INFINITY, f64::max);
        let meets = cell.meets(triangle);
        assert!(meets || deepest < 0.0, "{triangle:?} enters by {deepest}");
        assert!(!meets || deepest > -0.1, "{triangle:?} stays away by {deepest}");
        let bounds = Bounds::of_points(triangle);
        assert!(!meets || cell.may_meet_box(&bounds));
    }
}
