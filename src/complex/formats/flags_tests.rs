//! Flags behind the values of `.ma` records, tool by tool.

use super::*;

fn load(text: &str) -> LoadedMa {
    parse_ma(text, "x.ma").unwrap()
}

/// As MATFP writes: a type and a mark behind spheres, a type behind edges.
const MATFP: &str = "5 5 1\nv 0 0 0 1 2 0\nv 1 0 0 1 2 0\nv 0 1 0 1 2 0\nv 50 50 50 3 2 1\n\
                     v 1 1 0 1 4 0\ne 0 1 0\ne 0 2 2\ne 1 2 1\ne 1 4 0\ne 2 4 0\nf 0 1 2\n";

const LIVE: &str = "4 5 1\nv 0 0 0 1\nv 1 0 0 1\nv 0 1 0 1\nv 1 1 0 1\n\
                    e 0 1\ne 0 2\ne 1 2\ne 1 3\ne 2 3\nf 0 1 2\n";

#[test]
fn a_deleted_sphere_is_dropped_and_the_type_of_an_edge_is_no_mark() {
    let loaded = load(MATFP);
    assert_eq!(loaded.mesh, load(LIVE).mesh);
    assert_eq!(loaded.kept, Some(vec![0, 1, 2, 4]));
    assert!(loaded.notes.contains(&"1 sphere was dropped: marked as deleted".to_owned()));
    assert_eq!(loaded.warnings, Vec::<String>::new());
    assert_eq!(load(LIVE).kept, None);
}

#[test]
fn edges_and_faces_have_marks_of_their_own() {
    let loaded = load(
        "3 3 1\nv 0 0 0 1\nv 1 0 0 1\nv 0 1 0 1\ne 0 1 0 0\ne 0 2 0 0\ne 1 2 0 1\nf 0 1 2 1\n",
    );
    assert_eq!(loaded.mesh.edges, [[0, 1], [0, 2]]);
    assert!(loaded.mesh.faces.is_empty());
    let notes = loaded.notes.join("\n");
    assert!(notes.contains("1 edge was dropped: marked as deleted"), "{notes}");
    assert!(notes.contains("1 face was dropped: marked as deleted"), "{notes}");
}

#[test]
fn what_uses_a_deleted_sphere_goes_with_it() {
    let loaded = load(
        "4 4 2\nv 0 0 0 1 2 0\nv 1 0 0 1 2 0\nv 9 9 9 1 2 1\nv 0 1 0 1 2 0\n\
         e 0 1 0\ne 0 2 0\ne 0 3 0\ne 1 3 0\nf 0 1 3\nf 0 1 2\n",
    );
    assert_eq!(loaded.mesh.edges, [[0, 1], [0, 2], [1, 2]]);
    assert_eq!(loaded.mesh.faces, [[0, 1, 2]]);
    let notes = loaded.notes.join("\n");
    assert!(notes.contains("1 edge was dropped: on a deleted sphere"), "{notes}");
    assert!(notes.contains("1 face was dropped: on a deleted sphere"), "{notes}");
}

#[test]
fn a_fourth_count_brings_tetrahedra_and_numbers_of_copies() {
    let loaded = load(
        "5 5 2 1\nv 0 0 0 1 2 0 1\nv 1 0 0 1 2 0 1\nv 0 1 0 1 2 0 1\nv 50 50 50 3 2 1 1\n\
         v 1 1 0 1 4 0 1\ne 0 1 0 0 1\ne 0 2 2 0 1\ne 1 2 1 0 1\ne 1 4 0 0 1\ne 3 4 0 1 1\n\
         f 0 1 2 0.5 0 1\nf 1 2 3 0.1 1 1\nt 0 1 2 4 0 1\n",
    );
    assert_eq!(
        (loaded.mesh.spheres.len(), loaded.mesh.edges.len(), loaded.mesh.faces.len()),
        (4, 4, 1)
    );
    assert!(loaded.notes.contains(&"1 tetrahedron was kept as data".to_owned()));
    assert_eq!(loaded.warnings, Vec::<String>::new());
}

#[test]
fn counts_of_edges_may_differ_only_where_a_writer_is_known_to_miscount() {
    let counted_otherwise = "4 9 9\nv 0 0 0 1 2 0\nv 1 0 0 1 2 0\nv 0 1 0 1 2 0\nv 9 9 9 1 2 1\n\
                             e 0 1 0 0\ne 0 2 0 0\ne 1 2 0 0\ne 0 3 0 1\nf 0 1 2 0\nf 0 1 3 1\n";
    let loaded = load(counted_otherwise);
    assert_eq!((loaded.mesh.edges.len(), loaded.mesh.faces.len()), (3, 1));
    assert!(loaded.notes[0].starts_with("the header announces 9 edges, the file holds 4"));
    let fewer = counted_otherwise.replace("4 9 9", "4 1 1");
    assert_eq!(load(&fewer).mesh, loaded.mesh);
    let error = parse_ma(MATFP.replace("5 5 1", "5 4 1"), "x.ma").unwrap_err().to_string();
    assert!(error.contains("line 11: the header announces 4 edges"), "{error}");
    assert!(parse_ma(counted_otherwise.replace("4 9 9", "5 9 9"), "x.ma").is_err());
}

#[test]
fn three_words_behind_a_face_are_a_colour_where_nothing_has_flags() {
    let plain = "3 0 1\nv 0 0 0 1\nv 1 0 0 1\nv 0 1 0 1\nf 0 1 2";
    for colour in ["0.2 0.5 0.1", "0 1 0"] {
        let loaded = load(&format!("{plain} {colour}\n"));
        assert_eq!((loaded.mesh.faces.len(), loaded.warnings.len()), (1, 0), "{colour}");
    }
    let flagged = plain.replace("v 0 0 0 1", "v 0 0 0 1 2 0");
    for (words, faces) in [("0.5 1 1", 0), ("0.5 0 1", 1), ("0.2 0.5 0.1", 1)] {
        let loaded = load(&format!("{flagged} {words}\n"));
        assert_eq!((loaded.mesh.faces.len(), loaded.warnings.len()), (faces, 1), "{words}");
    }
}

#[test]
fn words_that_no_tool_writes_are_refused_by_line() {
    for (text, expected) in [
        ("1 0 0\nv 0 0 0 1 2 0 0 0\n", "line 2: \"2 0 0 0\" behind the values"),
        ("1 0 0\nv 0 0 0 1 2 x\n", "line 2: the flag \"x\" is not a finite number"),
        ("1 0 0\nv 0 0 0 1 2 0.5\n", "line 2: the flag 0.5 is not a whole number"),
        ("1 0 1\nv 0 0 0 1\nf 0 0 0 7\n", "line 3: a face has three spheres"),
        ("1 0 0 0 0\nv 0 0 0 1\n", "line 1: expected three counts"),
    ] {
        let error = parse_ma(text, "x.ma").unwrap_err().to_string();
        assert!(error.contains(expected), "{text:?} gives {error:?}");
    }
}

#[test]
fn a_doubt_is_a_warning() {
    assert_eq!(load("1 0 0\nv 0 0 0 1 2\n").warnings.len(), 1);
    let loaded = load("2 0 0\nv 0 0 0 1 2 1 1\nv 1 0 0 1 2 0 1\n");
    assert_eq!((loaded.mesh.spheres.len(), loaded.warnings.len()), (1, 1));
}

/// The spheres of a list, read from a text.
fn listed(text: &str) -> Vec<f64> {
    let loaded = parse_ma(text, "list").unwrap_or_else(|error| panic!("{text:?}: {error}"));
    assert_eq!((loaded.mesh.edges.len(), loaded.mesh.faces.len()), (0, 0));
    assert!(loaded.notes.iter().any(|note| note.contains("list of spheres")), "{:?}", loaded.notes);
    loaded.mesh.spheres.iter().map(|sphere| sphere.radius).collect()
}

#[test]
fn lists_of_spheres_alone_are_read() {
    // Coverage Axis, Point2Skeleton, MATTopo's .sph with and without flags, MATFP with what it calls deleted.
    assert_eq!(listed("v 0 0 0 1\nv 1 0 0 2\n"), [1.0, 2.0]);
    assert_eq!(listed("2\n0 0 0 1\n1 0 0 2\n"), [1.0, 2.0]);
    assert_eq!(listed("4 2\n0 0 0 1\n1 0 0 2\n"), [1.0, 2.0]);
    assert_eq!(listed("4 3\n0 0 0 1 2 0 1\n1 0 0 2 2 1 1\n2 0 0 3 2 0 1\n"), [1.0, 3.0]);
    assert_eq!(listed("4\nv 0 0 0 1 2 0 0 \nv 1 0 0 2 2 3 0 \nv 1 0 0 3 2 -1 0 \n"), [1.0, 3.0]);
    for (text, why) in [
        ("v 0 0 0 1\ne 0 0\n", "line 2: a list of spheres alone"),
        ("2\n0 0 0 1\n", "announces 2 spheres"),
        ("1\n0 0 0 1\n1 0 0 1\n", "announces 1 spheres"),
        ("3 2\n0 0 0\n1 0 0\n", "without radii"),
        ("99999999999\n0 0 0 1\n", "bytes long"),
    ] {
        let error = parse_ma(text, "list").unwrap_err().to_string();
        assert!(error.contains(why), "{text:?}: {error}");
    }
}

#[test]
fn normals_and_structures_change_no_simplex() {
    let triangle = "3 3 1\nv 0 0 0 1\nv 1 0 0 1\nv 0 1 0 1\ne 0 1\ne 0 2\ne 1 2\nf 0 1 2\n";
    let plain = parse_ma(triangle, "triangle").unwrap();
    let normals = triangle.replace("e 0 1\n", "n 0 0 1\nn 0 0 1\ne 0 1\n");
    let loaded = parse_ma(&normals, "triangle").unwrap();
    assert_eq!((loaded.mesh, &*loaded.notes[0]), (plain.mesh.clone(), "2 normals were not used"));
    // A sheet of the face, a seam of two edges over two lines, a junction.
    let parts = format!("{triangle}3\n0 0 1\n0\n1 1 2 0\n1\n2 3 1 2\n");
    let loaded = parse_ma(&parts, "triangle").unwrap();
    assert_eq!(loaded.mesh, plain.mesh);
    assert_eq!(loaded.notes, ["3 parts of the structure were kept as data"]);
    for broken in
        ["1\n0 0 1\n1\n", "1\n0 4 1\n0\n", "2\n0 0 1\n0\n", "1\n0 0 1\n0 7\n", "1\n0 0 9999\n"]
    {
        let error = parse_ma(format!("{triangle}{broken}"), "triangle").unwrap_err().to_string();
        assert!(error.contains("line 9: expected the parts"), "{broken:?}: {error}");
    }
    let twice = format!("{triangle}{triangle}");
    let error = parse_ma(twice, "triangle").unwrap_err().to_string();
    assert!(error.contains("line 9: ") && error.contains("another medial mesh begins"), "{error}");
}

#[test]
fn a_surface_in_the_clothes_of_a_medial_mesh_is_named() {
    let text = "4 0 1\nv 0 0 0 0\nv 1 0 0 0\nv 0 1 0 0\nv 0 0 1 0\nf 0 2 1\n";
    let error = parse_ma(text, "surface.ma").unwrap_err().to_string();
    assert_eq!(
        error,
        "surface.ma: every radius is 0: a surface or a set of points, no medial mesh"
    );
}
