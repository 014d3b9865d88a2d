//! One small file for each dialect, the data beside the simplices, and the options of the reader.

use super::*;

/// A triangle of three live spheres, its edges and its face, as plain `.ma`.
const PLAIN: &str = "3 3 1\nv 0 0 0 1\nv 1 0 0 2\nv 0 1 0 3\ne 0 1\ne 0 2\ne 1 2\nf 0 1 2\n";

fn load(text: &str) -> LoadedMa {
    parse_ma(text, "x.ma").unwrap_or_else(|error| panic!("{text:?}: {error}"))
}

fn refusal(text: &str, options: ReadOptions) -> String {
    parse_ma_with(text, "x.ma", options).expect_err("refused").to_string()
}

const LENIENT: ReadOptions = ReadOptions { lenient: true, block: None, radii: Radii::Needed };

fn block(number: usize) -> ReadOptions {
    ReadOptions { block: Some(number), ..ReadOptions::default() }
}

fn as_written(mesh: &MedialMesh) -> Vec<u8> {
    let mut bytes = Vec::new();
    ma::write_to(&mut bytes, mesh).unwrap();
    bytes
}

/// The triangle with a deleted sphere, and in each dialect that has marks what that dialect needs.
const TRIANGLES: [(&str, &str); 9] = [
    ("A", PLAIN),
    (
        "A, edges repeated as by voxel cores",
        "3 5 1\nv 0 0 0 1\nv 1 0 0 2\nv 0 1 0 3\ne 0 1\ne 0 1\ne 2 0\ne 2 1\ne 0 2\nf 2 1 0\n",
    ),
    (
        "B",
        "4 4 1\nv 0 0 0 1 2 0\nv 1 0 0 2 3 0\nv 9 9 9 1 2 1\nv 0 1 0 3 1 0\n\
         e 0 1 0\ne 0 3 2\ne 1 3 1\ne 0 2 0\nf 0 1 3\n",
    ),
    (
        "B'",
        "4 4 2\nv 0 0 0 1 2 0\nv 1 0 0 2 3 0\nv 9 9 9 1 2 1\nv 0 1 0 3 1 0\n\
         e 0 1 0 0\ne 0 3 2 0\ne 1 3 1 0\ne 0 2 0 1\nf 0 1 3 0\nf 0 1 2 1\n",
    ),
    (
        "C",
        "4 9 9\nv 0 0 0 1 2 0\nv 1 0 0 2 3 0\nv 9 9 9 1 2 1\nv 0 1 0 3 1 0\n\
         e 0 1 0 0\ne 0 3 2 0\ne 1 3 1 0\nf 0 1 3 0\n",
    ),
    (
        "D",
        "4 3 2 2\nv 0 0 0 1 2 0 1\nv 1 0 0 2 3 0 1\nv 9 9 9 1 2 1 1\nv 0 1 0 3 1 0 1\n\
         e 0 1 0 0 1\ne 0 3 2 0 1\ne 1 3 1 0 2\nf 0 1 3 0.5 0 1\nf 0 1 2 0.1 1 1\nt 0 1 2 3 0 1\nt 0 1 2 3 1 1\n",
    ),
    ("E", "3 3 1\nv 0 0 0 1\nv 1 0 0 2\nv 0 1 0 3\ne 0 1\ne 0 2\ne 1 2\nf 0 1 2\n1\n0 0 1\n0\n"),
    (
        "I",
        "3 7 7\nn 0 0 1\nv 0 0 0 1\nv 1 0 0 2\nf 0 1 2\nv 0 1 0 3\ne 0 1\ne 0 2\nn 0 0 1\ne 1 2\n",
    ),
    (
        "J, as far as it can be told",
        "3 3 1\nv 0 0 0 1\nv 1 0 0 2\nv 0 1 0 3\ne 0 1\ne 0 2\ne 1 2\nf 0 1 2 0.5 0.5 1\n",
    ),
];

#[test]
fn every_dialect_with_faces_gives_the_same_bytes_as_the_plain_one() {
    let plain = as_written(&load(PLAIN).mesh);
    assert_eq!(String::from_utf8_lossy(&plain).lines().count(), 8);
    for (dialect, text) in TRIANGLES {
        assert_eq!(as_written(&load(text).mesh), plain, "{dialect}");
        let mut lines: Vec<&str> = text.lines().collect();
        let decorated = lines.join(" # x\r\n\r\n");
        assert_eq!(as_written(&load(&decorated).mesh), plain, "{dialect}, decorated");
        if dialect != "E" {
            // Spheres keep their order, whatever stands between them.
            lines[1..].sort_by_key(|line| !line.starts_with(['e', 'f', 't', 'n']));
            assert_eq!(
                as_written(&load(&lines.join("\n")).mesh),
                plain,
                "{dialect}, in another order"
            );
        }
    }
    // O: as OBJ, told by its lines, and by its extension with other statements and indices from the end.
    let obj = "v 0 0 0 1\nv 1 0 0 2\nv 0 1 0 3\nl 1 2\nl 3 1\nl 2 3\nf 1 2 3\n";
    assert_eq!(as_written(&load(obj).mesh), plain);
    let obj =
        "mtllib x\no a\nv 0 0 0 1\nv 1 0 0 2\nv 0 1 0 3\nvn 0 0 1\nl 1 2 -1\nf 1//1 -2//1 3//1\n";
    let loaded = parse_obj(obj, "x.obj", ReadOptions::default()).unwrap();
    assert_eq!(as_written(&loaded.mesh), plain);
    // N: with `radius` as CGAL has it, and `r`.
    for name in ["radius", "r"] {
        let ply = format!(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\n\
             property double {name}\nelement edge 0\nproperty int vertex1\nproperty int vertex2\nelement face 1\n\
             property list uchar int vertex_indices\nend_header\n0 0 0 1\n1 0 0 2\n0 1 0 3\n3 0 1 2\n"
        );
        assert_eq!(as_written(&parse_ply(ply, "x.ply").unwrap().mesh), plain);
    }
    // H: all faces of a tetrahedron, over and over.
    let loaded = load(
        "4 0 8\nv 0 0 0 1 2 0\nv 1 0 0 1 2 0\nv 0 1 0 1 2 0\nv 0 0 1 1 2 0\nf 0 1 2\nf 0 1 3\nf 0 2 3\n\
                       f 1 2 3\nf 2 1 0\nf 3 1 0\nf 3 2 0\nf 3 2 1\n",
    );
    assert_eq!((loaded.mesh.edges.len(), loaded.mesh.faces.len()), (6, 4));
}

#[test]
fn types_importance_tetrahedra_and_parts_are_kept_for_what_is_left() {
    let [_, _, (_, b), _, _, (_, d), ..] = TRIANGLES;
    let of_b = load(b).annotations;
    assert_eq!(of_b.sphere_types, [Some(2), Some(3), Some(1)]);
    assert_eq!(of_b.edge_types, [Some(0), Some(2), Some(1)]);
    assert_eq!((of_b.importance.len(), of_b.tetrahedra.len(), of_b.parts.len()), (0, 0, 0));
    let of_d = load(d).annotations;
    assert_eq!((of_d.sphere_types, of_d.edge_types), (of_b.sphere_types, of_b.edge_types));
    assert_eq!(of_d.importance, [Some(0.5)]);
    // Its tetrahedron has the deleted sphere.
    assert!(of_d.tetrahedra.is_empty());
    let tetrahedron = load(&d.replace("9 9 9 1 2 1 1", "9 9 9 1 2 0 1").replace("t 0 1", "t 1 0"));
    assert_eq!(tetrahedron.annotations.tetrahedra, [[0, 1, 2, 3]]);
    assert_eq!(load(PLAIN).annotations, Annotations::default());
    let twice = load("2 3 0\nv 0 0 0 1\nv 1 0 0 1\ne 0 1 1\ne 1 0 1\ne 0 1 2\n");
    assert_eq!(twice.annotations.edge_types, [Some(1)]);
    assert_eq!(twice.warnings, ["1 edge was listed again with another type: the first is kept"]);
}

#[test]
fn parts_name_the_simplices_of_the_canonical_mesh() {
    // Edges and faces in descending order, so that every index changes; a part over two lines, an empty one.
    let text = "4 5 2\nv 0 0 0 1\nv 1 0 0 1\nv 0 1 0 1\nv 1 1 0 1\ne 2 3\ne 1 3\ne 1 2\ne 0 2\ne 0 1\nf 1 2 3\nf 0 1 2\n\
                4\n0 0 1\n1\n1 1 2 2 4\n2 2 0\n\n7 3 2\n3 0\n";
    let loaded = load(text);
    let parts = &loaded.annotations.parts;
    let kinds = [PartKind::Sheet, PartKind::Seam, PartKind::Boundary, PartKind::Junction];
    assert_eq!(parts.iter().map(|part| part.kind).collect::<Vec<_>>(), kinds);
    assert_eq!(loaded.mesh.faces[parts[0].members[0] as usize], [0, 1, 2]);
    let seam: Vec<_> = parts[1].members.iter().map(|&e| loaded.mesh.edges[e as usize]).collect();
    assert_eq!(seam, [[0, 1], [1, 2]]);
    assert_eq!((parts[2].members.len(), &*parts[3].members, parts[3].id), (0, &[0, 3][..], 7));
}

#[test]
fn counts_that_lie_are_taken_as_they_are_if_asked() {
    for (text, counts) in [
        (PLAIN.replace("3 3 1", "9 3 1"), (3, 3, 1)),
        (PLAIN.replace("3 3 1", "2 3 1"), (3, 3, 1)),
        (PLAIN.replace("3 3 1", "3 1 4000000"), (3, 3, 1)),
        ("5\n0 0 0 1\n1 0 0 1\n".to_owned(), (2, 0, 0)),
        ("1\n0 0 0 1\n1 0 0 1\n".to_owned(), (2, 0, 0)),
    ] {
        assert!(parse_ma(&text, "x.ma").is_err(), "{text:?}");
        let loaded = parse_ma_with(&text, "x.ma", LENIENT).unwrap();
        let mesh = &loaded.mesh;
        assert_eq!((mesh.spheres.len(), mesh.edges.len(), mesh.faces.len()), counts, "{text:?}");
        assert!(loaded.warnings.iter().all(|warning| warning.contains("taken as they are")));
        assert!(!loaded.warnings.is_empty(), "{text:?}");
    }
    let wrong = PLAIN.replace("3 3 1", "2 3 1").replace("e 1 2", "e 1 7");
    assert_eq!(
        refusal(&wrong, LENIENT),
        "x.ma, line 7: \"7\" is not one of the 3 spheres; indices start at 0"
    );
}

#[test]
fn a_block_of_an_appended_file_is_chosen() {
    let second = "1 0 0\nv 5 5 5 5\n";
    let text = format!("{PLAIN}{second}{PLAIN}1\n0 0 1\n0\n");
    assert_eq!(refusal(&text, ReadOptions::default()).split(':').next(), Some("x.ma, line 9"));
    for (number, text_of_block) in [(1, PLAIN), (2, second), (3, PLAIN)] {
        let loaded = parse_ma_with(&text, "x.ma", block(number)).unwrap();
        assert_eq!(loaded.mesh, load(text_of_block).mesh, "{number}");
        assert_eq!(loaded.annotations.parts.len(), usize::from(number == 3));
    }
    for number in [0, 4] {
        let expected =
            format!("x.ma: there is no block {number}: the file holds 3, counted from 1");
        assert_eq!(refusal(&text, block(number)), expected);
    }
    assert_eq!(parse_ma_with(PLAIN, "x.ma", block(1)).unwrap().mesh, load(PLAIN).mesh);
}

#[test]
fn files_without_radii_are_read_where_none_are_needed() {
    let not_needed = ReadOptions { radii: Radii::NotNeeded, ..ReadOptions::default() };
    let ply = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
               end_header\n1 2 3\n";
    type Reader = fn(&str, ReadOptions) -> Result<LoadedMa, MaError>;
    let readers: [(&str, Reader); 3] = [
        ("3 1\n1 2 3\n", |text, options| parse_ma_with(text, "x.sph", options)),
        ("v 1 2 3\n", |text, options| parse_obj(text, "x.obj", options)),
        (ply, |text, options| parse_ply_with(text, "x.ply", options)),
    ];
    for (text, read) in readers {
        let why = read(text, ReadOptions::default()).expect_err("no radii").to_string();
        assert!(why.contains("`--radii surface` takes"), "{why}");
        let loaded = read(text, not_needed).unwrap();
        assert_eq!(loaded.mesh.spheres[0].centre.to_array(), [1.0, 2.0, 3.0]);
    }
    // A surface written as .ma is a list of points, too.
    let surface = "4 0 1\nv 0 0 0 0\nv 1 0 0 0\nv 0 1 0 0\nv 0 0 1 0\nf 0 2 1\n";
    assert_eq!(parse_ma_with(surface, "x.ma", not_needed).unwrap().mesh.spheres.len(), 4);
}

#[test]
fn negative_radii_lose_their_sign_or_are_refused() {
    let text = PLAIN.replace("0 1 0 3", "0 1 0 -3");
    let loaded = load(&text);
    assert_eq!(loaded.mesh, load(PLAIN).mesh);
    assert_eq!(loaded.warnings, ["1 radius is negative: its absolute value was taken"]);
    let strict = ReadOptions { radii: Radii::NotNegative, ..ReadOptions::default() };
    assert_eq!(refusal(&text, strict), "x.ma, line 4: the radius -3 is negative");
}

#[test]
fn obj_errors_name_the_line_and_the_reason() {
    for (text, expected) in [
        ("v 0 0 0 1\nl 1\n", "line 2: the index of a sphere is missing"),
        ("v 0 0 0 1\nl 0 1\n", "line 2: \"0\" is not one of the 1 vertices above"),
        ("v 0 0 0 1\nl 1 -2\n", "line 2: \"-2\" is not one"),
        ("v 0 0 0 1\nf 1 1 1 1\n", "line 2: faces must be triangles, found 4 corners"),
        ("v 0 0 0 1 2 3\n", "line 1: a vertex has 4 numbers"),
        ("v 0 0 0 1\ncurv 1\n", "line 2: expected a line that starts with v, l or f"),
        ("v 0 0 x 1\n", "line 1: the z coordinate"),
    ] {
        let error = parse_obj(text, "x.obj", ReadOptions::default()).unwrap_err().to_string();
        assert!(error.contains(expected), "{text:?} gives {error:?}");
    }
}
