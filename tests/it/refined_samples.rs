//! Samples that are added until the Voronoi medial mesh is right.

use crate::shapes;
use medial::Vec3;
use medial::complex::{DualTriangulation, betti};
use medial::metrics::JudgeOptions;
use medial::shape::{BOUND, Refined, Refinement, Shape, ShapeOptions, Substrate};
use medial::surface::TriangleBvh;
use medial::surface::{InsideTest, Sampling, TriMesh, validate};

/// Two plates with a gap between them that is narrower than they are thick, joined at one side, in as few
/// triangles as possible.
fn bent_plate() -> TriMesh {
    let profile = [
        [0.0, 0.0],
        [1.0, 0.0],
        [1.0, 0.1],
        [0.1, 0.1],
        [0.1, 0.14],
        [1.0, 0.14],
        [1.0, 0.24],
        [0.0, 0.24],
    ];
    let at = |z: f64| profile.map(|[x, y]| Vec3::new(x, y, z));
    let vertices = [at(0.0), at(0.8)].concat();
    let mut faces = Vec::new();
    for [a, b, c, d] in [[0, 1, 2, 3], [0, 3, 4, 7], [4, 5, 6, 7]] {
        faces.extend([[a, c, b], [a, d, c]]);
        faces.extend([[a, b, c], [a, c, d]].map(|face: [u32; 3]| face.map(|v| v + 8)));
    }
    for a in 0..8 {
        let b = (a + 1) % 8;
        faces.extend([[a, b, b + 8], [a, b + 8, a + 8]]);
    }
    TriMesh { vertices, faces }
}

fn shape(mesh: &TriMesh, sampling: Sampling) -> Shape {
    let report = validate(mesh).unwrap();
    let options = ShapeOptions { sampling, ..ShapeOptions::default() };
    Shape::new("test", mesh, report, options).unwrap()
}

fn error(shape: &Shape) -> f64 {
    let options = JudgeOptions { samples: 2_000, volume_depth: 0, seed: 0 };
    let judge = shape.judge(None, options).unwrap();
    judge.distances(&shape.initial().unwrap()).unwrap().hausdorff
}

fn refined(mesh: &TriMesh, expected: Option<[u64; 3]>) -> Refined {
    let (tree, inside) = (TriangleBvh::new(mesh).unwrap(), InsideTest::new(mesh));
    let dual = DualTriangulation::default();
    Refinement { mesh, tree: &tree, inside: &inside, expected, dual }.run().unwrap()
}

#[test]
fn a_coarse_surface_with_a_narrow_gap_gets_the_samples_that_it_needs() {
    let mesh = bent_plate();
    let coarse = shape(&mesh, Sampling::MeshVertices);
    let auto = shape(&mesh, Sampling::Auto);
    let medial = auto.initial().unwrap();
    assert_eq!(betti(&medial), [1, 0, 0]);
    assert_eq!(auto.sampling_warning(), None);
    assert!(error(&coarse) > 5.0 * BOUND, "{}", error(&coarse));
    assert!(error(&auto) < 1.5 * BOUND, "{}", error(&auto));
    // The vertices are kept, and every sample is on the surface.
    let samples = auto.samples();
    assert_eq!(samples[..16], auto.mesh().vertices);
    let tree = auto.surface_tree().unwrap();
    assert!(tree.distance_batch(&samples).iter().all(|&d| d < 1e-15));
    // What it cost is the cost of the samples.
    let used = auto.used();
    let seconds = |of: Substrate| used.iter().find(|(s, _)| *s == of).unwrap().1.seconds;
    assert!(seconds(Substrate::Samples) > seconds(Substrate::Delaunay));
}

#[test]
fn what_is_right_gets_no_samples() {
    let plate = shape(&bent_plate(), Sampling::Auto);
    let found = refined(plate.mesh(), Some([1, 0, 0]));
    assert!(found.is_right && found.rounds > 0 && found.error <= BOUND, "{}", found.error);
    assert_eq!(*plate.samples(), found.samples);
    let ball = shape(&shapes::sphere(5), Sampling::Auto);
    assert_eq!(*ball.samples(), ball.mesh().vertices);
}

#[test]
fn what_cannot_be_mended_is_said() {
    let mut left = refined(shape(&shapes::sphere(4), Sampling::Auto).mesh(), Some([1, 0, 0]));
    assert_eq!((left.betti, left.warning()), ([1, 0, 0], None));
    left.expected = Some([1, 2, 0]);
    let warning = left.warning().unwrap();
    assert!(warning.contains("[1, 0, 0]") && warning.contains("[1, 2, 0]"), "{warning}");
    left.expected = None;
    left.error = 0.025;
    assert!(left.warning().unwrap().contains("2.50 %"));
}

#[test]
fn the_same_samples_for_any_number_of_threads() {
    let mesh = shape(&bent_plate(), Sampling::MeshVertices).mesh().clone();
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| refined(&mesh, Some([1, 0, 0])).samples)
    };
    assert_eq!(run(1), run(3));
}
