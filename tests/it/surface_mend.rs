//! Repairs on demand: holes filled, parts left out.

use std::collections::HashMap;

use medial::Vec3;
use medial::surface::{
    Components, Fault, Format, Loaded, MendOptions, Repair, SurfaceError, TriMesh, mend_bytes,
};

const FILL: MendOptions =
    MendOptions { fill_holes: true, separate: false, components: Components::All };

fn off(mesh: &TriMesh) -> String {
    let mut text = format!("OFF\n{} {} 0\n", mesh.vertices.len(), mesh.faces.len());
    for v in &mesh.vertices {
        text += &format!("{:?} {:?} {:?}\n", v.x, v.y, v.z);
    }
    for [a, b, c] in &mesh.faces {
        text += &format!("3 {a} {b} {c}\n");
    }
    text
}

fn mend(mesh: &TriMesh, options: MendOptions) -> Result<Loaded, SurfaceError> {
    mend_bytes(off(mesh).as_bytes(), Format::Off, options)
}

/// A lattice box of `n` cells along each side, without the faces that `dropped` names by centroid.
fn lattice_box(n: u32, dropped: impl Fn(Vec3) -> bool) -> TriMesh {
    let (mut corners, mut known) = (Vec::new(), HashMap::new());
    let mut faces = Vec::new();
    let mut corner = |p: [u32; 3]| {
        *known.entry(p).or_insert_with(|| {
            corners.push(Vec3::from(p.map(f64::from)) / f64::from(n));
            corners.len() as u32 - 1
        })
    };
    for axis in 0..3 {
        for side in [0, n] {
            for (i, j) in (0..n * n).map(|k| (k % n, k / n)) {
                let at = |u: u32, v: u32| {
                    let mut p = [0; 3];
                    (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (side, i + u, j + v);
                    p
                };
                let mut quad = [at(0, 0), at(1, 0), at(1, 1), at(0, 1)].map(&mut corner);
                if side == 0 {
                    quad.reverse();
                }
                let [a, b, c, d] = quad;
                faces.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
    let mut mesh = TriMesh { vertices: corners, faces };
    let centroid = |face: usize| mesh.triangle(face).into_iter().sum::<Vec3>() / 3.0;
    let keep: Vec<bool> = (0..mesh.faces.len()).map(|face| !dropped(centroid(face))).collect();
    let mut keep = keep.iter();
    mesh.faces.retain(|_| keep.next() == Some(&true));
    mesh
}

#[test]
fn a_flat_hole_is_filled_flat_and_nothing_moves() {
    let window = |p: Vec3| p.z == 1.0 && (p - Vec3::new(0.5, 0.5, 1.0)).abs().max_element() < 0.3;
    let open = lattice_box(6, window);
    let mended = mend(&open, FILL).expect("closed");
    assert!((mended.report.volume.expect("closed") - 1.0).abs() < 1e-12);
    assert!((mended.report.area.expect("closed") - 6.0).abs() < 1e-12);
    assert!(mended.mesh.vertices.iter().all(|v| open.vertices.contains(v)));
    assert_eq!(mended.report.repairs[1..], [Repair::FilledHole { edges: 16, triangles: 14 }]);
}

#[test]
fn a_hole_around_a_corner_is_filled_as_smoothly_as_its_vertices_allow() {
    let open = lattice_box(4, |p| p.min_element() > 0.7);
    let mended = mend(&open, FILL).expect("closed");
    assert_eq!(mended.report.expected_betti, Some([1, 0, 0]));
    let volume = mended.report.volume.expect("closed");
    assert!(volume > 1.0 - 1.0 / 64.0 && volume < 1.0, "{volume}");
}

#[test]
fn every_hole_is_reported_and_long_ones_are_refused() {
    let two = lattice_box(5, |p| (p.z == 1.0 || p.z == 0.0) && (p.truncate() - 0.5).length() < 0.2);
    let repairs = mend(&two, FILL).expect("closed").report.repairs;
    let holes = repairs.iter().filter(|repair| matches!(repair, Repair::FilledHole { .. }));
    assert_eq!(holes.count(), 2);
    let lid = lattice_box(126, |p| p.z == 1.0);
    let fault = mend(&lid, FILL).expect_err("too long").fault;
    assert!(matches!(fault, Fault::LongHole { edges: 504, most: 500, .. }), "{fault}");
    let open = mend(&two, MendOptions::default()).expect_err("open").fault;
    assert!(matches!(open, Fault::Open { .. }), "{open}");
}

#[test]
fn holes_that_meet_are_refused() {
    // Two windows with one common corner.
    let windows = |p: Vec3| {
        let in_window = |low: f64| p.x > low && p.x < low + 0.25 && p.y > low && p.y < low + 0.25;
        p.z == 1.0 && (in_window(0.25) || in_window(0.5))
    };
    let fault = mend(&lattice_box(4, windows), FILL).expect_err("tangled").fault;
    assert!(matches!(fault, Fault::TangledHole { .. }), "{fault}");
    let options = MendOptions { separate: true, ..FILL };
    let apart = mend(&lattice_box(4, windows), options).expect("closed");
    assert!((apart.report.volume.expect("closed") - 1.0).abs() < 1e-3);
}

#[test]
fn parts_that_touch_in_a_vertex_are_drawn_apart_on_demand() {
    let mut both = lattice_box(1, |_| false);
    let shift = both.vertices.len() as u32;
    both.vertices.extend_from_within(..);
    both.vertices[shift as usize..].iter_mut().for_each(|v| *v += Vec3::ONE);
    both.faces.extend_from_within(..);
    both.faces[12..].iter_mut().for_each(|face| *face = face.map(|v| v + shift));
    let fault = mend(&both, FILL).expect_err("they touch").fault;
    assert!(matches!(fault, Fault::NonManifoldVertex { vertices: 1, .. }), "{fault}");
    let options = MendOptions { separate: true, ..MendOptions::default() };
    let mended = mend(&both, options).expect("two solids");
    assert_eq!(mended.report.expected_betti, Some([2, 0, 0]));
    assert!((mended.report.volume.expect("closed") - 2.0).abs() < 2e-3);
    let moved = mended.mesh.vertices.iter().filter(|v| !both.vertices.contains(v)).count();
    assert_eq!((moved, mended.mesh.vertices.len()), (1, 16));
    assert!(
        mended
            .report
            .repairs
            .iter()
            .any(|repair| { matches!(repair, Repair::SeparatedVertices { vertices: 1, .. }) })
    );
}

#[test]
fn the_largest_part_is_kept() {
    let mut both = lattice_box(2, |_| false);
    let small = lattice_box(1, |p| p.z == 1.0);
    let shift = both.vertices.len() as u32;
    both.faces.splice(0..0, small.faces.iter().map(|face| face.map(|v| v + shift)));
    both.vertices.extend(small.vertices.iter().map(|&v| v * 0.5 + Vec3::splat(3.0)));
    let options = MendOptions { components: Components::Largest, ..MendOptions::default() };
    let mended = mend(&both, options).expect("a solid");
    assert_eq!((mended.report.components, mended.mesh.faces.len()), (1, 48));
    assert!(
        mended.report.repairs.contains(&Repair::DroppedComponents { components: 1, faces: 10 })
    );
}

#[test]
fn what_is_flat_after_the_repair_is_still_refused() {
    let triangle = TriMesh { vertices: vec![Vec3::ZERO, Vec3::X, Vec3::Y], faces: vec![[0, 1, 2]] };
    let fault = mend(&triangle, FILL).expect_err("flat").fault;
    assert!(!fault.to_string().is_empty());
}
