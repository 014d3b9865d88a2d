//! The Voronoi subcomplex: invariance, stability under thinning, the sheets of a box.

use medial::Vec3;
use medial::complex::MedialMesh;
use medial::shape::{Shape, ShapeOptions};
use medial::simplifier::{Level, MedialSimplifier, Params, RunContext, Simplified, SimplifyError};
use medial::surface::{self, TriMesh};
use medial_methods::dey_zhao;

fn shape_of(mesh: &TriMesh, sampling: &str) -> Shape {
    let report = surface::validate(mesh).expect("a solid");
    let sampling = sampling.parse().expect("a sampling");
    let options = ShapeOptions { sampling, ..ShapeOptions::default() };
    Shape::new("shape", mesh, report, options).expect("an extent")
}

fn built_in(id: &str, resolution: u32) -> TriMesh {
    medial_datasets::find(id).expect("in the catalogue").mesh(resolution)
}

fn at(shape: &Shape, params: &[(&str, &str)], level: Level) -> Simplified {
    let mut all = Params::none();
    for (key, value) in params {
        all.set(key, value);
    }
    let mut prepared =
        dey_zhao::method().prepare(shape, &all, &RunContext::default()).expect("ready");
    prepared.at(level).expect("a level")
}

fn area(mesh: &MedialMesh) -> f64 {
    let corner = |v: u32| mesh.spheres[v as usize].centre;
    let areas = mesh.faces.iter().map(|f| {
        let [a, b, c] = f.map(corner);
        (b - a).cross(c - a).length() / 2.0
    });
    areas.sum()
}

#[test]
fn scaling_by_a_thousand_keeps_the_same_facets() {
    let mesh = built_in("blob", 40);
    let plain = at(&shape_of(&mesh, "vertices"), &[], Level::Published).mesh;
    for scale in [1e-3, 1e3] {
        let vertices = mesh.vertices.iter().map(|&v| v * scale).collect();
        let scaled = TriMesh { vertices, faces: mesh.faces.clone() };
        let scaled = at(&shape_of(&scaled, "vertices"), &[], Level::Published).mesh;
        assert_eq!(plain.faces, scaled.faces);
        assert_eq!(plain.edges, scaled.edges);
    }
}

#[test]
fn thinning_a_dense_sample_keeps_the_area() {
    for id in ["ellipsoid", "rounded-box", "hollow-sphere"] {
        let mesh = built_in(id, 120);
        let [dense, thin] = ["blue:24000", "blue:12000"]
            .map(|sampling| area(&at(&shape_of(&mesh, sampling), &[], Level::Published).mesh));
        assert!((thin / dense - 1.0).abs() < 0.1, "{id}: {dense} then {thin}");
    }
}

#[test]
fn a_plate_keeps_its_middle_sheet() {
    // 2 x 1.5 x 0.1: the middle sheet is the rectangle 1.9 x 1.4.
    let mesh = built_in("plate", 200);
    let shape = shape_of(&mesh, "vertices");
    let kept = at(&shape, &[], Level::Published).mesh;
    let unit = shape.normalisation().diagonal;
    let middle = kept.spheres.iter().filter(|s| (s.radius * unit - 0.05).abs() < 1e-3).count();
    assert!(2 * middle > kept.spheres.len());
    assert!(area(&kept) * unit * unit > 0.98 * 1.9 * 1.4, "{}", area(&kept) * unit * unit);
    let back = |p: Vec3| shape.normalisation().backward(p);
    for s in kept.spheres.iter().filter(|s| (s.radius * unit - 0.05).abs() < 1e-3) {
        assert!(back(s.centre).z.abs() < 1e-3, "{:?}", back(s.centre));
    }
}

#[test]
fn each_condition_alone_keeps_a_part_and_both_keep_the_union() {
    let shape = shape_of(&built_in("blob", 40), "vertices");
    let faces = |condition: &str| {
        let mesh = at(&shape, &[("condition", condition)], Level::Published).mesh;
        let key = |v: u32| mesh.spheres[v as usize].centre.to_array().map(f64::to_bits);
        let mut faces: Vec<_> = mesh.faces.iter().map(|f| f.map(key)).collect();
        faces.sort_unstable();
        faces
    };
    let [both, angle, ratio] = ["both", "angle", "ratio"].map(faces);
    let mut union = [angle.clone(), ratio.clone()].concat();
    union.sort_unstable();
    union.dedup();
    assert_eq!(both, union);
    assert!(!ratio.is_empty() && ratio.len() < angle.len());
}

#[test]
fn a_larger_strength_keeps_less_and_a_given_mesh_is_no_voronoi_diagram() {
    let mesh = built_in("capsule", 36);
    let shape = shape_of(&mesh, "vertices");
    let counts = [0.5, 1.0, 2.0, 5.0].map(|t| at(&shape, &[], Level::Native(t)).mesh.faces.len());
    assert!(counts.windows(2).all(|pair| pair[0] >= pair[1]), "{counts:?}");
    let given = MedialMesh::clone(&shape.initial().expect("an initial medial mesh"));
    let shape = shape_of(&mesh, "vertices").with_initial(&given);
    let refused = dey_zhao::method().prepare(&shape, &Params::none(), &RunContext::default());
    assert!(matches!(refused, Err(SimplifyError::Unsupported { .. })));
}

#[test]
fn a_number_of_spheres_is_the_published_result_of_fewer_samples() {
    let mesh = built_in("blob", 60);
    for sampling in ["vertices", "uniform:4000:7"] {
        let shape = shape_of(&mesh, sampling);
        for count in [1000, 250] {
            let found = at(&shape, &[], Level::Spheres(count));
            let reached = found.mesh.spheres.len();
            assert!(reached <= count && reached * 100 >= 98 * count, "{reached} for {count}");
            assert_eq!(found.native_level, Some(1.0));
            let counts = &found.diagnostics.counts;
            let samples = counts.iter().find(|(name, _)| name == "samples").expect("a count").1;
            let again = match sampling {
                "vertices" => format!("blue:{samples}"),
                _ => format!("uniform:{samples}:7"),
            };
            assert_eq!(found.mesh, at(&shape_of(&mesh, &again), &[], Level::Published).mesh);
        }
    }
}

#[test]
fn a_level_does_not_depend_on_earlier_ones() {
    let shape = shape_of(&built_in("capsule", 36), "vertices");
    let run = RunContext::default();
    let mut prepared = dey_zhao::method().prepare(&shape, &Params::none(), &run).expect("ready");
    let levels = [Level::Spheres(400), Level::Published, Level::Spheres(100), Level::Spheres(400)];
    for level in levels {
        let found = prepared.at(level).expect("a level");
        assert_eq!(found.mesh, at(&shape, &[], level).mesh, "{level}");
    }
    let many = prepared.at(Level::Spheres(1_000_000_000)).expect("as many as there are");
    assert!(many.diagnostics.warnings.iter().any(|w| w.contains("are not tried")));
}
