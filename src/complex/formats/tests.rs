//! One table for the dialects, one for the errors, and properties of any file.

use std::fs;

use proptest::prelude::*;

use super::*;
use crate::Vec3;
use crate::complex::Sphere;

/// A triangle of three live spheres, its edges and its face, as plain `.ma`.
const PLAIN: &str = "3 3 1\nv 0 0 0 1\nv 1 0 0 2\nv 0 1 0 3\ne 0 1\ne 0 2\ne 1 2\nf 0 1 2\n";

const LENIENT: ReadOptions = ReadOptions { lenient: true, block: None, radii: Radii::Needed };
const POINTS: ReadOptions = ReadOptions { lenient: false, block: None, radii: Radii::NotNeeded };
const STRICT: ReadOptions = ReadOptions { lenient: false, block: None, radii: Radii::NotNegative };

fn load(text: &str) -> LoadedMa {
    parse_ma(text, "x.ma", ReadOptions::default())
        .unwrap_or_else(|error| panic!("{text:?}: {error}"))
}

fn as_written(mesh: &MedialMesh) -> String {
    let mut bytes = Vec::new();
    ma::write_ma(&mut bytes, mesh).unwrap();
    String::from_utf8(bytes).unwrap()
}

fn counts(mesh: &MedialMesh) -> [usize; 3] {
    [mesh.spheres.len(), mesh.edges.len(), mesh.faces.len()]
}

fn ply(radius: &str) -> String {
    format!(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\n\
         property double {radius}\nelement edge 1\nproperty int vertex1\nproperty int vertex2\nelement face 1\n\
         property list uchar int vertex_indices\nend_header\n0 0 0 1\n1 0 0 2\n0 1 0 3\n1 0\n3 0 1 2\n"
    )
}

/// The triangle in each dialect that has faces, with a deleted sphere where the dialect has marks, and remarks.
const TRIANGLES: [(&str, &str, &[&str]); 10] = [
    ("A", PLAIN, &[]),
    (
        "A, edges repeated as by voxel cores",
        "3 5 1\nv 0 0 0 1\nv 1 0 0 2\nv 0 1 0 3\ne 0 1\ne 0 1\ne 2 0\ne 2 1\ne 0 2\nf 2 1 0\n",
        &["2 edges were listed more than once and merged"],
    ),
    (
        "B, of MATFP: the last word of an edge is its type",
        "4 4 1\nv 0 0 0 1 2 0\nv 1 0 0 2 3 0\nv 9 9 9 1 2 1\nv 0 1 0 3 1 0\n\
         e 0 1 0\ne 0 3 2\ne 1 3 1\ne 0 2 0\nf 0 1 3\n",
        &["1 sphere was dropped: marked as deleted", "1 edge was dropped: on a deleted sphere"],
    ),
    (
        "B'",
        "4 5 3\nv 0 0 0 1 2 0\nv 1 0 0 2 3 0\nv 9 9 9 1 2 1\nv 0 1 0 3 1 0\n\
         e 0 1 0 0\ne 0 3 2 0\ne 1 3 1 0\ne 0 2 0 1\ne 1 2 0 0\nf 0 1 3 0\nf 0 1 2 1\nf 1 2 3 0\n",
        &[
            "1 edge was dropped: marked as deleted",
            "1 face was dropped: marked as deleted",
            "1 face was dropped: on a deleted sphere",
        ],
    ),
    (
        "C, of libmat: miscounted",
        "4 9 9\nv 0 0 0 1 2 0\nv 1 0 0 2 3 0\nv 9 9 9 1 2 1\nv 0 1 0 3 1 0\n\
         e 0 1 0 0\ne 0 3 2 0\ne 1 3 1 0\nf 0 1 3 0\n",
        &["the header announces 9 edges, the file holds 3: taken as they are"],
    ),
    (
        "D, of MATTopo: four counts",
        "4 3 2 2\nv 0 0 0 1 2 0 1\nv 1 0 0 2 3 0 1\nv 9 9 9 1 2 1 1\nv 0 1 0 3 1 0 1\n\
         e 0 1 0 0 1\ne 0 3 2 0 1\ne 1 3 1 0 2\nf 0 1 3 0.5 0 1\nf 0 1 2 0.1 1 1\nt 0 1 2 3 0 1\nt 0 1 2 3 1 1\n",
        &["1 tetrahedron was not used", "9 lines carry flags; marks of deletion were obeyed"],
    ),
    (
        "E, of MATStruct: parts over several lines, one empty",
        "3 3 1\nv 0 0 0 1\nv 1 0 0 2\nv 0 1 0 3\ne 0 1\ne 0 2\ne 1 2\nf 0 1 2\n\
         4\n0 0 1\n0\n1 1 2 0\n1\n2 3 1 2\n7 2 0\n",
        &["4 parts of the structure were not used"],
    ),
    (
        "I, of SEG-MAT: counts ignored",
        "3 7 7\nn 0 0 1\nv 0 0 0 1\nv 1 0 0 2\nf 0 1 2\nv 0 1 0 3\ne 0 1\ne 0 2\nn 0 0 1\ne 1 2\n",
        &["2 normals were not used"],
    ),
    (
        "J, as far as possible: three words behind a face are a colour",
        "3 3 1\nv 0 0 0 1\nv 1 0 0 2\nv 0 1 0 3\ne 0 1\ne 0 2\ne 1 2\nf 0 1 2 0.5 1 1\n",
        &[],
    ),
    (
        "three words behind a face are flags where spheres have flags",
        "3 3 2\nv 0 0 0 1 2 0\nv 1 0 0 2 2 0\nv 0 1 0 3 2 0\ne 0 1\ne 0 2\ne 1 2\nf 0 1 2 0.5 0 1\nf 0 1 2 0.5 1 1\n",
        &["three words behind 2 faces: read as importance, deleted and copies"],
    ),
];

#[test]
fn every_dialect_gives_the_same_bytes_as_the_plain_one() {
    let plain = as_written(&load(PLAIN).mesh);
    assert_eq!(plain.lines().count(), 8);
    for (dialect, text, expected) in TRIANGLES {
        let loaded = load(text);
        assert_eq!(as_written(&loaded.mesh), plain, "{dialect}");
        let (_, remarks) = loaded.with_remarks();
        for remark in expected {
            assert!(
                remarks.iter().any(|r| r.starts_with(remark)),
                "{dialect}: {remark}: {remarks:?}"
            );
        }
        assert!(!expected.is_empty() || remarks.len() <= 1, "{dialect}: {remarks:?}");
        let mut lines: Vec<&str> = text.lines().collect();
        let decorated = format!("\u{feff}# exported\r\n{}", lines.join(" # x\r\n\r\n"));
        assert_eq!(as_written(&load(&decorated).mesh), plain, "{dialect}, decorated");
        if !dialect.starts_with('E') {
            // Spheres keep their order, with anything between them.
            lines[1..].sort_by_key(|line| !line.starts_with(['e', 'f', 't', 'n']));
            let shuffled = load(&lines.join("\n")).mesh;
            assert_eq!(as_written(&shuffled), plain, "{dialect}, in another order");
        }
    }
    // O: as OBJ, recognised by its lines, and by its extension with other statements and indices from the end.
    let obj = "v 0 0 0 1\nv 1 0 0 2\nv 0 1 0 3\nl 1 2\nl 3 1\nl 2 3\nf 1 2 3\n";
    assert_eq!(as_written(&load(obj).mesh), plain);
    let obj =
        "mtllib x\no a\nv 0 0 0 1\nv 1 0 0 2\nv 0 1 0 3\nvn 0 0 1\nl 1 2 -1\nf 1//1 -2//1 3//1\n";
    let loaded = parse_obj(obj, "x.obj", ReadOptions::default()).unwrap();
    assert_eq!(as_written(&loaded.mesh), plain);
    // N: with `radius` as CGAL has it, and `r`.
    for name in ["radius", "r"] {
        let loaded = parse_ply(ply(name), "x.ply", ReadOptions::default()).unwrap();
        assert_eq!(as_written(&loaded.mesh), plain);
    }
    // H: all faces of a tetrahedron, over and over.
    let tetrahedra = "4 0 8\nv 0 0 0 1 2 0\nv 1 0 0 1 2 0\nv 0 1 0 1 2 0\nv 0 0 1 1 2 0\nf 0 1 2\nf 0 1 3\n\
                      f 0 2 3\nf 1 2 3\nf 2 1 0\nf 3 1 0\nf 3 2 0\nf 3 2 1\n";
    assert_eq!(counts(&load(tetrahedra).mesh), [4, 6, 4]);
}

#[test]
fn lists_of_spheres_alone_are_read() {
    // Coverage Axis, Point2Skeleton, MATTopo's .sph with and without flags, MATFP with those it calls deleted.
    for (text, radii) in [
        ("v 0 0 0 1\nv 1 0 0 2\n", &[1.0, 2.0][..]),
        ("2\n0 0 0 1\n1 0 0 2\n", &[1.0, 2.0]),
        ("4 2\n0 0 0 1\n1 0 0 2\n", &[1.0, 2.0]),
        ("4 3\n0 0 0 1 2 0 1\n1 0 0 2 2 1 1\n2 0 0 3 2 0 1\n", &[1.0, 3.0]),
        ("4\nv 0 0 0 1 2 0 0 \nv 1 0 0 2 2 3 0 \nv 1 0 0 3 2 -1 0 \n", &[1.0, 3.0]),
    ] {
        let loaded = load(text);
        let found: Vec<f64> = loaded.mesh.spheres.iter().map(|sphere| sphere.radius).collect();
        assert_eq!((&*found, counts(&loaded.mesh)), (radii, [radii.len(), 0, 0]), "{text:?}");
        assert!(loaded.notes[0].contains("list of spheres"), "{:?}", loaded.notes);
    }
}

#[test]
fn trees_of_spheres_give_their_deepest_level() {
    let read = |name: &str, text: &str| read_content(name, text.as_bytes(), ReadOptions::default());
    let tree = "1 2\n0 0 0 2 1\n0 0 0 1 1\n2 0 0 1 1\n";
    let loaded = read("tree.sph", tree).expect("two levels");
    assert_eq!((loaded.mesh.spheres.len(), loaded.mesh.spheres[1].centre.x), (2, 2.0));
    assert_eq!(loaded.notes, ["took the deepest of 2 levels"]);
    // A child that is missing has no radius.
    let missing = read("tree.sph", &tree.replace("2 0 0 1 1", "0 0 0 0 0")).expect("a child");
    assert_eq!(missing.mesh.spheres.len(), 1);
    // Nor have all children of the second: it stands for them. The header is short of a level.
    let deeper =
        "1 2\n0 0 0 2 1\n0 0 0 1 1\n2 0 0 1 1\n0 0 0 1 1\n0 0 1 1 1\n0 0 0 0 0\n0 0 0 -1 0\n";
    let deeper = read("tree.sph", deeper).expect("three levels");
    let centres: Vec<f64> = deeper.mesh.spheres.iter().map(|sphere| sphere.centre.x).collect();
    assert_eq!(centres, [2.0, 0.0, 0.0]);
    let notes = [
        "took the deepest of 3 levels",
        "spheres of higher levels without any below them: 1",
        "the header announces 1 levels",
    ];
    assert_eq!(deeper.notes.len(), notes.len());
    assert!(
        notes.iter().zip(&deeper.notes).all(|(start, note)| note.starts_with(start)),
        "{:?}",
        deeper.notes
    );
    let short = read("tree.sph", &(tree.to_owned() + "3 0 0 1 1\n")).unwrap_err();
    assert!(short.to_string().contains("4 rows are no whole levels"), "{short}");
    for children in ["0", "18446744073709551615"] {
        let text = tree.replace("1 2\n", &format!("7 {children}\n"));
        let error = read("tree.sph", &text).unwrap_err().to_string();
        assert!(error.contains("no whole levels"), "{error}");
    }
    let fields = read("tree.sph", &tree.replace("0 0 0 1 1", "0 0 0 1")).unwrap_err();
    assert_eq!(fields.line, Some(3));
    // MATTopo's lists, whose header has the number of rows.
    let list = read("list.sph", "4 2\n0 0 0 1 3\n1 0 0 1 3\n").expect("a list");
    let is_tree = list.notes.iter().any(|note| note.contains("deepest"));
    assert_eq!((list.mesh.spheres.len(), is_tree), (2, false));
    let rows = read("rows.sph", "0 0 0 1\n1 0 0 1\n").expect("rows");
    assert_eq!(rows.mesh.spheres.len(), 2);
}

#[test]
fn lists_of_centers_and_radii_are_read() {
    let read = |text: &str| read_content("m.json", text.as_bytes(), ReadOptions::default());
    let loaded = read(r#"{"centers": [[0, 0, 0], [1, 0, 0]], "radii": [1, 0.5]}"#).expect("two");
    let radii: Vec<f64> = loaded.mesh.spheres.iter().map(|sphere| sphere.radius).collect();
    assert_eq!(radii, [1.0, 0.5]);
    let error = read(r#"{"centers": [[0, 0, 0], [1, 0, 0]], "radii": [1]}"#).unwrap_err();
    assert!(error.to_string().contains("2 centers and 1 radii"), "{error}");
    // Lists next to them are not lost.
    let both =
        r#"{"centers": [[0, 0, 0]], "radii": [1], "arm": [{"center": [1, 0, 0], "radius": 1}]}"#;
    let error = read(both).unwrap_err().to_string();
    assert!(error.contains("2 links"), "{error}");
}

#[test]
fn doubts_are_warnings() {
    for (text, expected) in [
        ("1 0 0\nv 0 0 0 1 2\n", "1 word behind 1 spheres: read as a type"),
        ("1 0 0\nv 0 0 0 1 2 0 1\n", "3 words behind 1 spheres: read as type, deleted and copies"),
        ("1 0 0\nv 0 0 0 1 2 -1\n", "1 marks of deletion are negative, for unknown: kept"),
        ("1 0 0\nv 0 0 0 -1\n", "1 radius is negative: its absolute value was taken"),
        (
            "2 0 1\nv 0 0 0 1\nv 1 0 0 1\nf 0 1 1 0.5 0\n",
            "2 words behind 1 faces: read as importance",
        ),
        (
            "1 0 1\nv 0 0 0 1 2 0\nf 0 0 0 0.2 0.5 0.1\n",
            "three words behind 1 faces: read as a colour",
        ),
    ] {
        let loaded = load(text);
        assert!(loaded.warnings[0].starts_with(expected), "{text:?}: {:?}", loaded.warnings);
        assert_eq!((loaded.warnings.len(), loaded.mesh.spheres[0].radius), (1, 1.0), "{text:?}");
    }
}

#[test]
fn wrong_counts_are_taken_with_a_warning_if_lenient() {
    for (text, expected) in [
        (PLAIN.replace("3 3 1", "9 3 1"), [3, 3, 1]),
        (PLAIN.replace("3 3 1", "2 3 1"), [3, 3, 1]),
        (PLAIN.replace("3 3 1", "3 1 4000000"), [3, 3, 1]),
        ("5\n0 0 0 1\n1 0 0 1\n".to_owned(), [2, 0, 0]),
        ("1\n0 0 0 1\n1 0 0 1\n".to_owned(), [2, 0, 0]),
        (PLAIN.replace("3 3 1", "3 3 1 1"), [3, 3, 1]),
    ] {
        assert!(parse_ma(&text, "x.ma", ReadOptions::default()).is_err(), "{text:?}");
        let loaded = parse_ma(&text, "x.ma", LENIENT).unwrap();
        assert_eq!(counts(&loaded.mesh), expected, "{text:?}");
        assert!(loaded.warnings[0].contains("taken as they are"), "{text:?}");
    }
}

#[test]
fn one_of_several_blocks_is_chosen() {
    let second = "1 0 0\nv 5 5 5 5\n";
    let text = format!("{PLAIN}{second}{PLAIN}1\n0 0 1\n0\n");
    let read = |block| parse_ma(&text, "x.ma", ReadOptions { block, ..ReadOptions::default() });
    assert!(read(None).unwrap_err().to_string().starts_with("x.ma, line 9: all records"));
    for (number, alone) in [(1, PLAIN), (2, second), (3, PLAIN)] {
        assert_eq!(read(Some(number)).unwrap().mesh, load(alone).mesh, "{number}");
    }
    for number in [0, 4] {
        let expected =
            format!("x.ma: there is no block {number}: the file holds 3, counted from 1");
        assert_eq!(read(Some(number)).unwrap_err().to_string(), expected);
    }
}

#[test]
fn disorder_is_repaired_and_reported() {
    let loaded = load(
        "4 3 3\nv 0 0 0 1\nv 1 0 0 1\nv 0 1 0 1\nv 0 0 1 1\n\
         e 3 2\ne 2 3\ne 1 1\nf 2 1 0\nf 0 1 2\nf 3 1 3\n",
    );
    assert_eq!(loaded.mesh.check(), Ok(()));
    assert_eq!(loaded.mesh.edges, [[0, 1], [0, 2], [1, 2], [1, 3], [2, 3]]);
    assert_eq!(loaded.mesh.faces, [[0, 1, 2]]);
    let expected = [
        "1 edge was written with descending indices",
        "the edges were not in ascending order and were sorted",
        "2 faces were written with descending indices",
        "the faces were not in ascending order and were sorted",
        "1 face was replaced by an edge: two corners are the same sphere",
        "1 edge was dropped: both ends are the same sphere",
        "1 edge was listed more than once and merged",
        "1 face was listed more than once and merged",
        "3 edges were added: sides of faces that were not listed",
    ];
    assert_eq!(loaded.notes, expected);
}

type Parser = fn(Vec<u8>, &str, ReadOptions) -> Result<LoadedMa, MaError>;

/// Each text is rejected with an error that begins with this text.
fn refuses<S: AsRef<str>>(parse: Parser, options: ReadOptions, cases: &[(S, &str)]) {
    for (text, expected) in cases {
        let text = text.as_ref();
        let error = parse(text.as_bytes().to_vec(), "x", options).expect_err(text).to_string();
        assert!(error.starts_with(&format!("x{expected}")), "{text:?} gives {error:?}");
    }
}

/// Texts, in which `\n` ends a line, with the beginnings of their errors.
const MA_ERRORS: &str = r#" => : the file is empty
# only\n => : the file is empty
7 5\n => , line 1: expected three counts
OFF\n => , line 1: expected three counts
-1 0 0\n => , line 1: expected three counts
1 0 0 0 0\nv 0 0 0 1\n => , line 1: expected three counts
4000000000 0 0\nv 0 0 0 1\n => , line 1: the header announces 4000000000 spheres
1 99999999999999 0\nv 0 0 0 1\n => , line 1: the header announces 99999999999999 edges
99999999999\n0 0 0 1\n => , line 1: the header announces 99999999999 spheres
2 0 0\nv 0 0 0 1\n => : the header announces 2 spheres, the file holds only 1
1 0 0\nv 0 0 0 1\nv 0 0 0 1\n => , line 3: the header announces 1 spheres
2 1 0\nv 0 0 0 1\nv 0 0 0 1\ne 0 1\ne 0 1\n => , line 5: the header announces 1 edges, the file holds at least 2
4 1 1\nv 0 0 0 1 2 0\nv 1 0 0 1 2 0\ne 0 1 0\n => : the header announces 4 spheres, the file holds only 2
2\n0 0 0 1\n => : the header announces 2 spheres
1\n0 0 0 1\n1 0 0 1\n => , line 3: the header announces 1 spheres
v 0 0 0 1\ne 0 0\n => , line 2: a list of spheres alone
3 2\n0 0 0\n1 0 0\n => , line 1: points without radii: `--radii surface` takes
1 0 0\nv 0 0 1\n => , line 2: the radius is missing
0 0 0 1\n => : the header announces 1 tetrahedra, the file holds 0
1 0 0 2\nv 0 0 0 1\nt 0 0 0 0\n => : the header announces 2 tetrahedra, the file holds 1
1 0 0\nv 0 0 zero 1\n => , line 2: the z coordinate "zero" is not a finite number
1 0 0\nv nan 0 0 1\n => , line 2: the x coordinate "nan"
1 0 0\nv 0 inf 0 1\n => , line 2: the y coordinate "inf"
1 0 0\nv 0 0 0 1e999\n => , line 2: the radius "1e999"
1 1 0\nv 0 0 0 1\ne 0 1\n => , line 3: "1" is not one of the 1 spheres; indices start at 0
1 1 0\nv 0 0 0 1\ne 0 -1\n => , line 3: "-1" is not one of the 1 spheres
1 1 0\nv 0 0 0 1\ne 0\n => , line 3: the index of a sphere is missing
1 0 0\nv 0 0 0 1\nt 0 0 0 0\n => , line 3: expected a line that starts with v, e or f
1 0 0\nv 0 0 0 1 2 0 0 0\n => , line 2: "2 0 0 0" behind the values
1 0 0\nv 0 0 0 1 2 x\n => , line 2: the flag "x" is not a finite number
1 0 0\nv 0 0 0 1 2 0.5\n => , line 2: the flag "0.5" is not a whole number
1 0 1\nv 0 0 0 1\nf 0 0 0 7\n => , line 3: a face has three spheres
4 0 1\nv 0 0 0 0\nv 1 0 0 0\nv 0 1 0 0\nv 0 0 1 0\nf 0 2 1\n => : every radius is 0
1 0 0\nv 0 0 0 1\n1\n0 0 1\n0\n => , line 3: expected the parts
1 0 0\nv 0 0 0 1\n1\n0 4 0\n => , line 3: expected the parts
1 0 0\nv 0 0 0 1\n2\n0 3 1\n0\n => , line 3: expected the parts
1 0 0\nv 0 0 0 1\n1\n0 3 1\n0 7\n => , line 3: expected the parts
1 0 0\nv 0 0 0 1\n1\n0 3 18446744073709551615\n => , line 3: expected the parts"#;
const OBJ_ERRORS: &str = r#"v 0 0 0 1\nl 1\n => , line 2: the index of a sphere is missing
v 0 0 0 1\nl 0 1\n => , line 2: "0" is not one of the 1 vertices above
v 0 0 0 1\nl 1 -2\n => , line 2: "-2" is not one
v 0 0 0 1\nf 1 1 1 1\n => , line 2: faces must be triangles, found 4 corners
v 0 0 0 1 2 3\n => , line 1: a vertex has 4 numbers
v 0 0 0\n => , line 1: points without radii
v 0 0 0 1\ncurv 1\n => , line 2: expected a line that starts with v, l or f
v 0 0 x 1\n => , line 1: the z coordinate"#;

fn cases(table: &'static str) -> Vec<(String, &'static str)> {
    let cases = table.lines().map(|case| case.split_once(" => ").expect(case));
    cases.map(|(text, error)| (text.replace("\\n", "\n"), error)).collect()
}

#[test]
fn errors_name_the_line_and_the_reason() {
    let default = ReadOptions::default();
    refuses(parse_ma, default, &cases(MA_ERRORS));
    refuses(parse_ma, STRICT, &[("1 0 0\nv 0 0 0 -3\n", ", line 2: the radius -3 is negative")]);
    let wrong = PLAIN.replace("3 3 1", "2 3 1").replace("e 1 2", "e 1 7");
    refuses(parse_ma, LENIENT, &[(&wrong, ", line 7: \"7\" is not one of the 3 spheres")]);
    refuses(parse_obj, default, &cases(OBJ_ERRORS));
    let valid = ply("radius");
    for (from, to, expected) in [
        ("ply", "solid", ": line 1: expected a PLY header, found"),
        (
            "radius",
            "weight",
            ": element vertex has no property radius: not a medial mesh; `--radii",
        ),
        ("vertex2", "other", ": element edge has no property vertex2: not a medial mesh"),
        ("vertex 3", "vertex 4", ": line 17: expected vertex 3, found"),
        ("vertex 3", "vertex 4000000000", ": the header announces 4000000000 vertices"),
        ("end_header", "comment", ": line 14: expected a PLY header, found"),
        (
            "property double radius",
            "property list uchar double radius",
            ": line 7: expected a number as the property radius, found \"list\"",
        ),
        (
            "property int vertex2",
            "property list uchar int vertex2",
            ": line 10: expected a number as the property vertex2, found \"list\"",
        ),
        (
            "property list uchar int vertex_indices",
            "property int vertex_index",
            ": line 12: expected a list as the property vertex_index, found \"int\"",
        ),
        ("element face", "element tristrips", ": PLY triangle strips are not read;"),
        ("3 0 1 2", "4 0 1 2 2", ": line 18: faces must be triangles, found 4 corners"),
        ("3 0 1 2", "3 0 1 3", ": line 18: 3 is not one of the 3 spheres"),
        ("1 0\n3", "1 0.5\n3", ": line 17: 0.5 is not one of the 3 spheres"),
        ("3 0 1 2", "", ": the file ends before face 0"),
    ] {
        refuses(parse_ply, default, &[(&valid.replacen(from, to, 1), expected)]);
    }
    assert!(read("/nonexistent/x.ma").unwrap_err().to_string().starts_with("/nonexistent/x.ma: "));
    for extension in ["off", "vtp", "glb"] {
        let error = read(format!("x.{extension}")).unwrap_err().to_string();
        assert!(error.contains("is not one of .ma, .ma_dup"), "{error}");
    }
}

#[test]
fn files_without_radii_are_read_where_none_are_needed() {
    let point = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
                 end_header\n1 2 3\n";
    // A surface written as .ma is a list of points, too.
    let surface = "4 0 1\nv 1 2 3 0\nv 1 0 0 0\nv 0 1 0 0\nv 0 0 1 0\nf 0 2 1\n";
    for loaded in [
        parse_ma("3 1\n1 2 3\n", "x.sph", POINTS),
        parse_ma(surface, "x.ma", POINTS),
        parse_obj("v 1 2 3\n", "x.obj", POINTS),
        parse_ply(point, "x.ply", POINTS),
    ] {
        assert_eq!(loaded.unwrap().mesh.spheres[0].centre.to_array(), [1.0, 2.0, 3.0]);
    }
}

fn awkward_mesh() -> MedialMesh {
    let numbers = [0.1, -1.0 / 3.0, 1e-300, 6.02e23, f64::MIN_POSITIVE, 0.0, 1e200, 2.5];
    let spheres = (0..6)
        .map(|i| {
            let [x, y, z, radius] = [0, 1, 2, 3].map(|k| numbers[(i + k) % numbers.len()]);
            Sphere::new(Vec3::new(x, y, z), radius.abs())
        })
        .collect();
    MedialMesh::from_simplices(spheres, vec![[0, 5], [3, 4]], vec![[0, 1, 2], [1, 2, 3]]).unwrap()
}

#[test]
fn written_files_come_back_bit_for_bit_or_hold_every_element() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let mesh = awkward_mesh();
    for (name, mesh) in [("a.ma", &mesh), ("b.PLY", &mesh), ("c.ma", &MedialMesh::default())] {
        write(at(name), mesh).unwrap();
        let loaded = read(at(name)).unwrap();
        assert_eq!((&loaded.mesh, loaded.notes), (mesh, vec![]), "{name}");
    }
    let loaded = read_with(at("b.PLY"), POINTS).unwrap();
    assert_eq!(loaded.mesh, mesh);
    for name in ["a.obj", "a.vtp"] {
        write(at(name), &mesh).unwrap();
    }
    let text = fs::read_to_string(at("a.obj")).unwrap();
    let starting = |word: &str| text.lines().filter(|line| line.starts_with(word)).count();
    assert_eq!([starting("v "), starting("l "), starting("f ")], [6, 7, 2]);
    assert!(text.contains("\nf 1 2 3\n") && text.contains("\nl 1 6\n"));
    let text = fs::read_to_string(at("a.vtp")).unwrap();
    let counts = "NumberOfPoints=\"6\" NumberOfVerts=\"0\" NumberOfLines=\"2\" NumberOfStrips=\"0\" NumberOfPolys=\"2\"";
    assert!(text.contains(counts), "{text}");

    let values = Some(SphereValues::radius(&mesh));
    let look = |values, balls| Look { values, balls };
    for (name, look, why) in [
        ("a.ma", look(values.clone(), false), "hold no values"),
        ("a.vtp", look(values, true), "hold no spheres as bodies"),
        ("a.xyz", Look::default(), "\"xyz\" is not one of .ma, .ply, .obj, .vtp, .glb"),
        ("no/a.ma", Look::default(), "no/a.ma: "),
    ] {
        let error = write_with(at(name), &mesh, &look).unwrap_err().to_string();
        assert!(error.contains(why), "{error}");
    }
    let mut invalid = mesh;
    invalid.edges.clear();
    assert!(matches!(write(at("a.ma"), &invalid).unwrap_err().kind, MaErrorKind::Mesh(_)));
}

proptest! {
    #[test]
    fn any_simplices_become_canonical(
        edges in prop::collection::vec([0..6u32, 0..6], 0..12),
        faces in prop::collection::vec([0..6u32, 0..6, 0..6], 0..12),
    ) {
        let mut text = format!("6 {} {}\n", edges.len(), faces.len());
        for i in 0..6 {
            text += &format!("v {i} 0 0 1\n");
        }
        for [a, b] in &edges {
            text += &format!("e {a} {b}\n");
        }
        for [a, b, c] in &faces {
            text += &format!("f {a} {b} {c}\n");
        }
        let loaded = load(&text);
        prop_assert_eq!(loaded.mesh.check(), Ok(()));
        for [a, b, c] in faces.into_iter().filter(|[a, b, c]| a != b && b != c && a != c) {
            let mut face = [a, b, c];
            face.sort_unstable();
            prop_assert!(loaded.mesh.faces.contains(&face));
        }
    }
}
