use std::path::PathBuf;
use std::{env, fs, io, process};

use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::*;
use crate::Vec3;
use crate::complex::Sphere;

/// A folder of its own under the system's temporary one, removed at the end of the test.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = env::temp_dir().join(format!("medial-{}-{name}", process::id()));
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(&self.0).unwrap();
        entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn awkward_mesh() -> MedialMesh {
    let numbers = [0.1, -1.0 / 3.0, 1e-300, 6.02e23, f64::MIN_POSITIVE, 0.0, 1e200, 2.5];
    let spheres = (0..6)
        .map(|i| {
            let at = |k: usize| numbers[(i + k) % numbers.len()];
            Sphere::new(Vec3::new(at(0), at(1), at(2)), at(3).abs())
        })
        .collect();
    MedialMesh::from_simplices(spheres, vec![[0, 5], [3, 4]], vec![[0, 1, 2], [1, 2, 3]]).unwrap()
}

const VALID: &str = "4 5 2\nv 0 0 0 1\nv 1 0 0 1\nv 0 1 0 1\nv 0 0 1 0.5\n\
                     e 0 1\ne 0 2\ne 0 3\ne 1 2\ne 1 3\nf 0 1 2\nf 0 1 3\n";

fn message(text: &str) -> String {
    parse_ma(text, "x.ma").unwrap_err().to_string()
}

#[test]
fn what_is_written_is_read_back_bit_for_bit() {
    let folder = Folder::new("round-trip");
    for (name, mesh) in [("a.ma", awkward_mesh()), ("b.PLY", awkward_mesh())] {
        let path = folder.0.join(name);
        write(&path, &mesh).unwrap();
        let loaded = read(&path).unwrap();
        assert_eq!(loaded.notes, Vec::<String>::new(), "{name}");
        assert_eq!(loaded.mesh, mesh, "{name}");
    }
    write(folder.0.join("empty.ma"), &MedialMesh::default()).unwrap();
    assert_eq!(read(folder.0.join("empty.ma")).unwrap().mesh, MedialMesh::default());
}

#[test]
fn obj_lists_every_element_from_one() {
    let folder = Folder::new("obj");
    write(folder.0.join("a.obj"), &awkward_mesh()).unwrap();
    let text = fs::read_to_string(folder.0.join("a.obj")).unwrap();
    let starting = |word: &str| text.lines().filter(|l| l.starts_with(word)).count();
    assert_eq!([starting("v "), starting("l "), starting("f ")], [6, 7, 2]);
    assert!(text.contains("\nf 1 2 3\n") && text.contains("\nl 1 6\n"));
}

#[test]
fn a_failed_write_keeps_the_old_file_and_leaves_nothing_behind() {
    let folder = Folder::new("atomic");
    let path = folder.0.join("a.ma");
    write(&path, &awkward_mesh()).unwrap();
    let before = fs::read(&path).unwrap();
    let failed = write_atomically(&path, |out| {
        out.write_all(b"half")?;
        Err(io::Error::other("disk full"))
    });
    assert_eq!(failed.unwrap_err().to_string(), "disk full");
    assert_eq!(fs::read(&path).unwrap(), before);
    let mut invalid = awkward_mesh();
    invalid.edges.clear();
    assert!(matches!(write(&path, &invalid).unwrap_err().kind, MaErrorKind::Mesh(_)));
    assert_eq!(folder.names(), ["a.ma"]);
    let error = write(folder.0.join("a.xyz"), &awkward_mesh()).unwrap_err();
    assert!(error.to_string().contains("\"xyz\" is not one of .ma, .ply, .obj"));
    assert!(write(folder.0.join("nowhere/a.ma"), &awkward_mesh()).is_err());
}

#[test]
fn comments_and_line_ends_are_read_over() {
    let decorated = "\u{feff}# exported\r\n4 5 2\r\n\r\nv 0 0 0 1 2 0\r\nv 1 0 0 1 # last\r\n\
                     v 0 1 0 1\r\nv 0 0 1 .5\r\ne 0 1 0\r\ne 0 2\r\ne 0 3\r\ne 1 2\r\ne 1 3\r\n\
                     f 0 1 2\r\nf 0 1 3\r\n# end\r\n";
    let loaded = parse_ma(decorated, "x.ma").unwrap();
    assert_eq!(loaded.mesh, parse_ma(VALID, "y.ma").unwrap().mesh);
    assert_eq!(loaded.notes, ["2 lines carry flags; marks of deletion were obeyed"]);
    assert_eq!(loaded.warnings, Vec::<String>::new());
}

#[test]
fn disorder_is_repaired_and_reported() {
    let loaded = parse_ma(
        "4 3 3\nv 0 0 0 1\nv 1 0 0 1\nv 0 1 0 1\nv 0 0 1 1\n\
         e 3 2\ne 2 3\ne 1 1\nf 2 1 0\nf 0 1 2\nf 3 1 3\n",
        "x.ma",
    )
    .unwrap();
    assert_eq!(loaded.mesh.check(), Ok(()));
    assert_eq!(loaded.mesh.edges, [[0, 1], [0, 2], [1, 2], [1, 3], [2, 3]]);
    assert_eq!(loaded.mesh.faces, [[0, 1, 2]]);
    let notes = loaded.notes.join("\n");
    for part in [
        "1 edge was written with descending indices",
        "the edges were not in ascending order",
        "1 face was replaced by an edge",
        "1 edge was dropped: both ends are the same sphere",
        "1 edge was listed more than once",
        "1 face was listed more than once",
        "3 edges were added: sides of faces",
    ] {
        assert!(notes.contains(part), "{part:?} not in:\n{notes}");
    }
}

#[test]
fn errors_name_the_line_and_the_reason() {
    for (text, expected) in [
        ("", "x.ma: the file is empty"),
        ("# only\n", "x.ma: the file is empty"),
        ("7 5\n", "line 1: expected three counts"),
        ("OFF\n", "line 1: expected three counts"),
        ("-1 0 0\n", "line 1: expected three counts"),
        ("4000000000 0 0\nv 0 0 0 1\n", "line 1: the header announces 4000000000 spheres"),
        ("1 99999999999999 0\nv 0 0 0 1\n", "line 1: the header announces 99999999999999 edges"),
        ("2 0 0\nv 0 0 0 1\n", "x.ma: the header announces 2 spheres, the file holds only 1"),
        ("1 0 0\nv 0 0 0 1\nv 0 0 0 1\n", "line 3: the header announces 1 spheres"),
        ("1 0 0\nv 0 0 1\n", "line 2: the radius is missing"),
        ("1 0 0\nv 0 0 zero 1\n", "line 2: the z coordinate \"zero\" is not a finite number"),
        ("1 0 0\nv nan 0 0 1\n", "line 2: the x coordinate \"nan\""),
        ("1 0 0\nv 0 inf 0 1\n", "line 2: the y coordinate \"inf\""),
        ("1 0 0\nv 0 0 0 1e999\n", "line 2: the radius \"1e999\""),
        ("1 1 0\nv 0 0 0 1\ne 0 1\n", "line 3: \"1\" is not one of the 1 spheres"),
        ("1 1 0\nv 0 0 0 1\ne 0 -1\n", "line 3: \"-1\" is not one of the 1 spheres"),
        ("1 1 0\nv 0 0 0 1\ne 0\n", "line 3: the index of a sphere is missing"),
        ("1 0 0\nv 0 0 0 1\nt 0 0 0 0\n", "line 3: expected a line that starts with v, e or f"),
    ] {
        assert!(message(text).contains(expected), "{text:?} gives {:?}", message(text));
    }
    assert!(read_ma("/nonexistent/x.ma").unwrap_err().to_string().starts_with("/nonexistent/x.ma"));
    assert!(read("x.off").unwrap_err().to_string().contains("is not one of .ma, .ma_dup"));
}

#[test]
fn ply_errors_name_the_line_and_the_reason() {
    let head = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n\
                property float z\n";
    for (text, expected) in [
        ("solid".to_owned(), "not a PLY file"),
        ("ply\nformat binary_little_endian 1.0\nend_header\n".into(), "line 2: only ASCII PLY"),
        (format!("{head}end_header\n0 0 0\n"), "vertices have no property radius"),
        (format!("{head}property float radius\nend_header\n"), "1 vertices, the file holds only 0"),
        (head.to_owned(), "the header has no end"),
        ("ply\nelement vertex 4000000000\nend_header\n".into(), "announces 4000000000 vertices"),
    ] {
        let error = parse_ply(&text, "x.ply").unwrap_err().to_string();
        assert!(error.contains(expected), "{text:?} gives {error:?}");
    }
}

#[test]
fn damaged_files_are_refused_or_read_but_never_panic() {
    let folder = Folder::new("fuzz");
    write(folder.0.join("a.ply"), &awkward_mesh()).unwrap();
    let ply = fs::read(folder.0.join("a.ply")).unwrap();
    type Parser = fn(Vec<u8>) -> Result<LoadedMa, MaError>;
    let parsers: [(&[u8], Parser); 2] = [
        (VALID.as_bytes(), |bytes| parse_ma(bytes, "x.ma")),
        (&ply, |bytes| parse_ply(bytes, "x.ply")),
    ];
    let mut random = Pcg64::seed_from_u64(7);
    let mut accepted = 0;
    for (valid, parse) in parsers {
        let mut damaged: Vec<Vec<u8>> = (0..valid.len()).map(|n| valid[..n].to_vec()).collect();
        for _ in 0..4000 {
            let mut bytes = valid.to_vec();
            for _ in 0..random.random_range(1..4) {
                let place = random.random_range(0..bytes.len());
                bytes[place] ^= 1 << random.random_range(0..8);
            }
            damaged.push(bytes);
        }
        for bytes in damaged {
            if let Ok(loaded) = parse(bytes) {
                assert_eq!(loaded.mesh.check(), Ok(()));
                accepted += 1;
            }
        }
    }
    assert!(accepted > 100, "the damage is so heavy that the readers are hardly exercised");
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
        let loaded = parse_ma(&text, "x.ma").unwrap();
        prop_assert_eq!(loaded.mesh.check(), Ok(()));
        for [a, b, c] in faces.into_iter().filter(|[a, b, c]| a != b && b != c && a != c) {
            let mut face = [a, b, c];
            face.sort_unstable();
            prop_assert!(loaded.mesh.faces.contains(&face));
        }
    }
}
