//! The chain from a surface to a filtered medial mesh: topology, and invariances.

use std::sync::Arc;

use medial::complex::{DualTriangulation, MedialMesh, betti};
use medial::metrics::JudgeOptions;
use medial::shape::{Shape, ShapeOptions, Substrate};
use medial::simplifier::{Level, Params, Registered, RunContext};
use medial::surface::{Sampling, TriMesh};
use medial::{Vec3, surface};
use medial_datasets::{add_noise, catalogue, find};
use medial_methods::registry;
use proptest::prelude::*;

fn shape_of(mesh: &TriMesh, options: ShapeOptions) -> Shape {
    let report = surface::validate(mesh).expect("built-in shapes are solids");
    Shape::new("shape", mesh, report, options).expect("an extent")
}

#[test]
fn initial_meshes_of_built_in_shapes_have_the_topology_of_the_solid() {
    for built_in in catalogue() {
        let mesh = built_in.mesh(built_in.default_resolution);
        for dual in [DualTriangulation::Fan, DualTriangulation::Delaunay] {
            let options = ShapeOptions { dual, ..ShapeOptions::default() };
            let initial = shape_of(&mesh, options).initial().expect("an initial medial mesh");
            initial.check().unwrap_or_else(|error| panic!("{}: {error}", built_in.id));
            assert_eq!(betti(&initial), built_in.expected_betti, "{} {dual:?}", built_in.id);
        }
    }
}

/// A torus with enough noise that no two values tie and no five samples are cospherical.
fn rough_torus() -> TriMesh {
    add_noise(&find("torus").expect("in the catalogue").mesh(16), 2e-3, 1)
}

/// The initial mesh, and its subset with an angle of 70 degrees and an enclosing radius of
/// `lambda`; all in input units.
fn results(mesh: &TriMesh, lambda: f64) -> Vec<MedialMesh> {
    // The planar Delaunay triangulation does not depend on how the cells are numbered. Where points are added, rounding
    // decides ties.
    let (dual, sampling) = (DualTriangulation::Delaunay, Sampling::MeshVertices);
    let shape = shape_of(mesh, ShapeOptions { dual, sampling });
    let normal = *shape.normalisation();
    let mut all = vec![Arc::unwrap_or_clone(shape.initial().expect("an initial medial mesh"))];
    for (id, level) in [("angle", 70.0), ("lambda", lambda / normal.diagonal)] {
        let method = medial_methods::find(id).expect("registered");
        let mut filter =
            method.prepare(&shape, &Params::none(), &RunContext::default()).expect("prepared");
        all.push(filter.at(Level::Native(level)).expect("a level in range").mesh);
    }
    all.iter().map(|m| m.to_input(&normal)).collect()
}

/// The same complex with its spheres in the order of their radii.
fn by_radius(mesh: &MedialMesh) -> MedialMesh {
    let mut order: Vec<usize> = (0..mesh.spheres.len()).collect();
    order.sort_by(|&a, &b| mesh.spheres[a].radius.total_cmp(&mesh.spheres[b].radius));
    let mut rank = vec![0; order.len()];
    for (place, &sphere) in (0..).zip(&order) {
        rank[sphere] = place;
    }
    let renamed = |v: u32| rank[v as usize];
    let spheres = order.iter().map(|&sphere| mesh.spheres[sphere]).collect();
    let edges = mesh.edges.iter().map(|edge| edge.map(renamed)).collect();
    let faces = mesh.faces.iter().map(|face| face.map(renamed)).collect();
    MedialMesh::from_simplices(spheres, edges, faces).expect("the same complex")
}

/// Whether the results on `moved` are those on `mesh`, carried through the similarity.
fn assert_carried(mesh: &TriMesh, moved: &TriMesh, scale: f64, map: impl Fn(Vec3) -> Vec3) {
    // Between half the spacing of the samples and the radius of the tube.
    let (plain, carried) = (results(mesh, 0.25), results(moved, 0.25 * scale));
    for (stage, (plain, carried)) in plain.iter().zip(&carried).enumerate() {
        let expected = by_radius(&plain.transformed(scale, &map));
        let carried = by_radius(carried);
        assert!(expected.spheres.len() > 30, "stage {stage} is too small to test");
        assert_eq!(expected.spheres.len(), carried.spheres.len(), "stage {stage}");
        for (a, b) in expected.spheres.iter().zip(&carried.spheres) {
            let off = a.centre.distance(b.centre).max((a.radius - b.radius).abs());
            assert!(off < 1e-7 * scale, "stage {stage}: {a:?} became {b:?}");
        }
        assert_eq!(expected.edges, carried.edges, "stage {stage}");
        assert_eq!(expected.faces, carried.faces, "stage {stage}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(6))]

    #[test]
    fn similarities_are_carried_through(
        axis in prop::array::uniform3(0.1..1.0f64), turn in 0.0..6.0f64,
        scale in 0.01..100.0f64, shift in prop::array::uniform3(-1.0..1.0f64),
    ) {
        let mesh = rough_torus();
        let (k, (sin, cos)) = (Vec3::from(axis).normalize(), turn.sin_cos());
        let rotated = |p: Vec3| p * cos + k.cross(p) * sin + k * (k.dot(p) * (1.0 - cos));
        let map = |p: Vec3| scale * (rotated(p) + Vec3::from(shift));
        let vertices = mesh.vertices.iter().map(|&v| map(v)).collect();
        assert_carried(&mesh, &TriMesh { vertices, faces: mesh.faces.clone() }, scale, map);
    }

    #[test]
    fn the_numbering_of_vertices_and_faces_changes_nothing(seed in any::<u64>()) {
        let mesh = rough_torus();
        // A permutation without a crate: ids sorted by a hash.
        let hash = |i: u32| (u64::from(i) ^ seed).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29)
            .wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mut order: Vec<u32> = (0..mesh.vertices.len() as u32).collect();
        order.sort_by_key(|&i| hash(i));
        let mut renamed = vec![0; order.len()];
        for (new, &old) in (0..).zip(&order) {
            renamed[old as usize] = new;
        }
        let vertices = order.iter().map(|&old| mesh.vertices[old as usize]).collect();
        let mut faces: Vec<[u32; 3]> =
            mesh.faces.iter().map(|face| face.map(|v| renamed[v as usize])).collect();
        faces.sort_unstable();
        assert_carried(&mesh, &TriMesh { vertices, faces }, 1.0, |p| p);
    }
}

// ----------------------------------------------------------------------------
// The substrates that methods use of a shape. The requirements on every method are in the corpus of
// `medial check` (`bench/check`).

#[test]
fn every_method_pays_for_the_inside_test_and_the_judge_for_nothing() {
    let solid = medial_datasets::find("capsule").expect("in the catalogue");
    let mesh = solid.mesh(solid.default_resolution);
    let report = surface::validate(&mesh).expect("built-in shapes are solids");
    let shape = Shape::new("capsule", &mesh, report, ShapeOptions::default()).expect("an extent");
    shape.judge(None, JudgeOptions::default()).expect("a judge");
    assert!(shape.used().is_empty());
    let usual = registry().into_iter().filter(|entry| !entry.presentation.on_request);
    for Registered { method, .. } in usual {
        let view = shape.view();
        method.prepare(&view, &Params::none(), &RunContext::default()).expect("prepared");
        let paid = view.used().iter().any(|(substrate, _)| *substrate == Substrate::InsideTest);
        assert!(paid, "{}", method.info().id);
    }
}
