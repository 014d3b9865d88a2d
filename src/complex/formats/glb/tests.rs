//! Files of ours and of trimesh's, read back.

use proptest::prelude::*;

use super::*;
use crate::complex::formats::look::{Look, SphereValues};
use crate::complex::{MedialMesh, Sphere};
use crate::{Vec3, glb};

/// Two faces, an edge without a face, a sphere without an edge; numbers of single precision.
fn mesh() -> MedialMesh {
    let spheres = [
        [0.125, -0.75, 0.0, 0.5],
        [1.0, 0.0, 0.0, 0.25],
        [0.0, 1.0, 0.0, 0.125],
        [1.0, 1.0, 0.5, 0.75],
        [3.0, 0.0, 0.0, 2.5],
        [-7.0, 2.0, 1024.0, 1.0],
        // Twice the same sphere, on purpose.
        [-7.0, 2.0, 1024.0, 1.0],
    ];
    let spheres = spheres.map(|[x, y, z, r]| Sphere::new(Vec3::new(x, y, z), r)).to_vec();
    MedialMesh::from_simplices(spheres, vec![[3, 4]], vec![[0, 1, 2], [1, 2, 3]]).unwrap()
}

#[test]
fn own_files_come_back() {
    let mesh = mesh();
    for balls in [false, true] {
        for values in [None, Some(SphereValues::stability(&mesh, 1.0))] {
            let bytes = file(&mesh, &Look { values, balls }).unwrap();
            let loaded = parse_glb(&bytes, "x.glb").unwrap();
            assert_eq!(loaded.mesh, mesh);
            assert_eq!(loaded.notes, Vec::<String>::new());
            let signs = loaded.mesh.spheres.iter().all(|s| !s.centre.z.is_sign_negative());
            assert!(signs, "no zero has lost its sign");
        }
    }
    let points = MedialMesh::from_simplices(mesh.spheres.clone(), vec![], vec![]).unwrap();
    assert_eq!(parse_glb(file(&points, &Look::default()).unwrap(), "x").unwrap().mesh, points);
}

/// Of the same mesh as `vtp/by_vtk`, in single precision, half as large under a node of scale 2. trimesh has sheets
/// only, and so the lone sphere and the lone edge are missing.
#[test]
fn a_file_of_trimesh_is_read_with_its_node() {
    let loaded = parse_glb(include_bytes!("by_trimesh.glb"), "x.glb").unwrap();
    assert_eq!(loaded.mesh.faces, [[0, 1, 2], [1, 2, 3]]);
    let radii: Vec<f64> = loaded.mesh.spheres.iter().map(|s| s.radius).collect();
    assert_eq!(radii[..4], [0.5, 0.25, 0.125, 0.75]);
    let centre = loaded.mesh.spheres[0].centre;
    assert!(centre.distance(Vec3::new(0.1, -1.0 / 3.0, 0.0)) < 1e-7, "{centre}");
    assert!(loaded.mesh.spheres[3].centre.distance(Vec3::new(1.0, 1.0, 0.5)) < 1e-7);
}

#[test]
fn what_cannot_be_written_is_refused_by_name() {
    let fail = |mesh: &MedialMesh| file(mesh, &Look::default()).unwrap_err().to_string();
    let empty = "a mesh without a sphere cannot be written as glTF, which has no empty arrays";
    assert_eq!(fail(&MedialMesh::default()), empty);
    let mut large = mesh();
    large.spheres[2].radius = 1e39;
    let expected =
        "sphere 2: 1e39 is beyond single precision, the only one of glTF; write .ma or .vtp";
    assert_eq!(fail(&large), expected);
    let bytes = (42 * 32 + 80 * 12) * 2_000_000_u64;
    let many = MedialMesh { spheres: vec![mesh().spheres[0]; 2_000_000], ..MedialMesh::default() };
    let error = file(&many, &Look { values: None, balls: true }).unwrap_err();
    assert_eq!(error, glb::GlbError::TooLarge { bytes });
}

#[test]
fn radii_that_cannot_be_are_refused() {
    let file = file(&mesh(), &Look::default()).unwrap();
    let text = String::from_utf8_lossy(&file).into_owned();
    assert!(text.contains("\"_RADIUS\""));
    let replaced = |from: &str, to: &str| {
        assert_eq!(from.len(), to.len());
        let at = file.windows(from.len()).position(|w| w == from.as_bytes()).unwrap();
        let mut bytes = file.clone();
        bytes[at..at + to.len()].copy_from_slice(to.as_bytes());
        bytes
    };
    // Each primitive names it; the others keep theirs, and the one without is passed over.
    assert!(parse_glb(replaced("\"_RADIUS\"", "\"_RADIUZ\""), "x").is_ok());
    let mut bad = file.clone();
    let minus = (-0.25_f32).to_le_bytes();
    let at = file
        .windows(8)
        .position(|w| w[..4] == 0.5_f32.to_le_bytes() && w[4..] == 0.25_f32.to_le_bytes());
    let at = at.expect("the radii stand together") + 4;
    bad[at..at + 4].copy_from_slice(&minus);
    let error = parse_glb(&bad, "x.glb").unwrap_err().to_string();
    assert_eq!(
        error,
        "x.glb: the medial mesh is not valid: sphere 1 is not valid: centre [1, 0, 0], radius -0.25"
    );
    bad[at..at + 4].copy_from_slice(&f32::INFINITY.to_le_bytes());
    assert!(parse_glb(&bad, "x").is_err());
}

/// A strip of quads, turned arbitrarily, comes out turned alike; a seam keeps every sheet consistent.
#[test]
fn sheets_are_turned_alike_and_normals_have_unit_length() {
    let at = |x: f64, y: f64, z: f64| Sphere::new(Vec3::new(x, y, z), 0.1);
    let spheres: Vec<Sphere> =
        (0..10).map(|k| at(f64::from(k / 2), f64::from(k % 2), 0.01 * f64::from(k))).collect();
    let faces: Vec<[u32; 3]> = (0..8).map(|k| [k, k + 1, k + 2]).collect();
    let mesh = MedialMesh::from_simplices(spheres, vec![], faces).unwrap();
    let faces = normals::turned_alike(&mesh);
    let up = |f: &[u32; 3]| {
        let [a, b, c] = f.map(|v| mesh.spheres[v as usize].centre);
        (b - a).cross(c - a).z > 0.0
    };
    assert!(faces.iter().all(|f| up(f) == up(&faces[0])));
    let normals = normals::normals(&mesh, &faces);
    assert!(normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-12 && n.z.abs() > 0.9));
}

proptest! {
    #[test]
    fn damage_never_panics(
        places in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
    ) {
        let mut bytes = file(&mesh(), &Look::default()).unwrap();
        for (place, byte) in places {
            let place = place.index(bytes.len());
            bytes[place] = byte;
        }
        if let Ok(loaded) = parse_glb(&bytes, "x") {
            prop_assert_eq!(loaded.mesh.check(), Ok(()));
        }
    }
}
