//! `medial triangulate` as its users meet it: arrays in, cells out, and every bad array named.

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use serde_json::Value;
use tempfile::TempDir;

struct Folder(TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a folder"))
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Writes an array of f8 with any shape that is claimed.
    fn array(&self, name: &str, shape: &str, values: &[f64]) -> PathBuf {
        let bytes: Vec<u8> = values.iter().flat_map(|x| x.to_le_bytes()).collect();
        self.file(
            name,
            &format!("'descr': '<f8', 'fortran_order': False, 'shape': {shape}"),
            &bytes,
        )
    }

    fn file(&self, name: &str, header: &str, data: &[u8]) -> PathBuf {
        let header = format!("{{{header}, }}\n");
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((header.len() as u16).to_le_bytes());
        bytes.extend(header.as_bytes());
        bytes.extend(data);
        let path = self.path(name);
        fs::write(&path, bytes).expect("written");
        path
    }
}

/// Runs the verb with `--json`; its exit code and the one object it prints.
fn triangulate(points: &Path, more: &[&str]) -> (i32, Value) {
    let mut command = Command::cargo_bin("medial").expect("the binary is built");
    let output = command
        .arg("triangulate")
        .arg(points)
        .args(more)
        .arg("--json")
        .output()
        .expect("the command starts");
    let stdout = String::from_utf8(output.stdout).expect("UTF-8");
    assert_eq!(stdout.lines().count(), 1, "{stdout}");
    let object: Value = serde_json::from_str(&stdout).expect("JSON");
    assert!(object["warnings"].is_array() && object["version"].is_string(), "{object}");
    (output.status.code().expect("no signal"), object)
}

/// The cells in a file of the verb's, and its header.
fn cells(path: &Path) -> (String, Vec<[usize; 4]>) {
    let bytes = fs::read(path).expect("cells");
    assert_eq!(&bytes[..8], b"\x93NUMPY\x01\x00");
    let start = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    assert_eq!(start % 64, 0);
    let header = String::from_utf8(bytes[10..start].to_vec()).expect("ASCII");
    let ids: Vec<usize> = bytes[start..]
        .chunks_exact(4)
        .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize)
        .collect();
    (header, ids.chunks_exact(4).map(|c| [c[0], c[1], c[2], c[3]]).collect())
}

/// `n^3` corners of a lattice.
fn lattice(n: usize) -> Vec<f64> {
    (0..n * n * n).flat_map(|i| [i % n, i / n % n, i / n / n]).map(|x| x as f64).collect()
}

#[test]
fn cells_fill_a_lattice() {
    let folder = Folder::new();
    let values = lattice(5);
    let (points, out) =
        (folder.array("lattice.npy", "(125, 3)", &values), folder.path("cells.npy"));
    let (code, object) = triangulate(&points, &["-o", out.to_str().expect("UTF-8")]);
    assert_eq!(code, 0, "{object}");
    assert_eq!((&object["points"], &object["hidden"]), (&125.into(), &0.into()));
    assert_eq!(object["duplicates"], 0);
    let (header, cells) = cells(&out);
    assert_eq!(object["finite_cells"], cells.len());
    // Every square of the hull is cut in two.
    assert_eq!(object["cells"], cells.len() + 6 * 16 * 2);
    let expected =
        format!("{{'descr': '<u4', 'fortran_order': False, 'shape': ({}, 4), }}", cells.len());
    assert_eq!(header.trim_end_matches(' ').trim_end_matches('\n').trim_end(), expected);
    let volume = |c: &[usize; 4]| {
        let [a, b, c, d] = c.map(|v| [0, 1, 2].map(|k| values[3 * v + k]));
        let edge = |p: [f64; 3]| [0, 1, 2].map(|k| p[k] - a[k]);
        let (u, v, w) = (edge(b), edge(c), edge(d));
        (u[0] * (v[1] * w[2] - v[2] * w[1])
            + u[1] * (v[2] * w[0] - v[0] * w[2])
            + u[2] * (v[0] * w[1] - v[1] * w[0]))
            / 6.0
    };
    assert!(cells.iter().all(|c| volume(c) > 0.0));
    assert!((cells.iter().map(volume).sum::<f64>() - 64.0).abs() < 1e-9);
    for key in ["seconds", "cpu_seconds"] {
        for stage in ["read", "triangulate"] {
            assert!(object[key][stage].is_f64(), "{key}.{stage} is missing in {object}");
        }
    }
    assert!(object["threads"].is_u64() && object.get("peak_bytes").is_some(), "{object}");
}

#[test]
fn storage_order_precision_and_threads_do_not_change_the_bytes() {
    let folder = Folder::new();
    let values = lattice(4);
    let written = |points: &Path, threads: &str| {
        let out = folder.path("cells.npy");
        let more = ["-o", out.to_str().expect("UTF-8"), "--threads", threads];
        let (code, object) = triangulate(points, &more);
        assert_eq!(code, 0, "{object}");
        fs::read(&out).expect("cells")
    };
    let c = folder.array("c.npy", "(64, 3)", &values);
    let transposed: Vec<u8> =
        (0..192).flat_map(|i| (values[3 * (i % 64) + i / 64] as f32).to_le_bytes()).collect();
    let header = "'descr': '<f4', 'fortran_order': True, 'shape': (64, 3)";
    let fortran = folder.file("f.npy", header, &transposed);
    let expected = written(&c, "1");
    assert_eq!(written(&fortran, "1"), expected);
    assert_eq!(written(&c, "2"), expected);
    assert_eq!(written(&c, "3"), expected);
}

#[test]
fn weights_hide_points_and_repeated_ones_are_counted() {
    let folder = Folder::new();
    let simplex = [0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let values = [&simplex[..], &[0.25, 0.25, 0.25, -1.0], &[0.0, 0.0, 1.0, 0.0]].concat();
    let points = folder.array("balls.npy", "(6, 4)", &values);
    let (code, object) = triangulate(&points, &["--weighted"]);
    assert_eq!(code, 0, "{object}");
    assert_eq!(object["finite_cells"], 1);
    assert_eq!(object["cells"], 5);
    assert_eq!(object["hidden"], 1);
    assert_eq!(object["duplicates"], 1);
    assert!(object["warnings"][0].as_str().is_some_and(|w| w.contains("repeat")), "{object}");
}

#[test]
fn bad_arrays_are_named_with_what_to_do() {
    let folder = Folder::new();
    let refused = |points: &Path, more: &[&str], part: &str| {
        let (code, object) = triangulate(points, more);
        assert_eq!(code, 1, "{object}");
        let error = object["error"].as_str().unwrap_or_default();
        assert!(error.contains(part), "{part} is missing in: {error}");
        let name = points.file_name().and_then(|n| n.to_str()).expect("UTF-8");
        assert!(error.contains(name), "{name} is missing in: {error}");
    };
    let array = |shape: &str, values: &[f64]| folder.array("points.npy", shape, values);
    let cube = lattice(2);
    let with = |place: usize, value: f64| {
        let mut values = cube.clone();
        values[place] = value;
        values
    };
    refused(&array("(8, 3)", &with(16, f64::NAN)), &[], "row 5: ");
    refused(&array("(8, 3)", &with(0, f64::INFINITY)), &[], "row 0: ");
    refused(&array("(8, 3)", &with(23, 1e300)), &[], "row 7: ");
    refused(&array("(6, 4)", &with(7, f64::NAN)), &["--weighted"], "row 1: ");
    refused(&array("(6, 4)", &cube), &[], "add --weighted");
    refused(&array("(8, 3)", &cube), &["--weighted"], "needs 4 columns");
    refused(&array("(12, 2)", &cube), &[], "(12, 2)");
    refused(&array("(24,)", &cube), &[], "[24]");
    refused(&array("(2, 4, 3)", &cube), &[], "[2, 4, 3]");
    refused(&array("(3, 3)", &cube[..9]), &[], "needs four");
    refused(&array("(0, 3)", &[]), &[], "needs four");
    refused(&array("(4, 3)", &cube[..12]), &[], "in one plane");
    let line: Vec<f64> = (0..30).map(|i| f64::from(i / 3)).collect();
    refused(&array("(10, 3)", &line), &[], "on one line");
    refused(&array("(10, 3)", &[1.0; 30]), &[], "1 distinct");
    refused(&array("(900000000000, 3)", &cube), &[], "ends after 192 of the 21600000000000");
    refused(&array("(7, 3)", &cube), &[], "goes on after");
    let big_endian = "'descr': '>f8', 'fortran_order': False, 'shape': (8, 3)";
    refused(&folder.file("points.npy", big_endian, &[0; 192]), &[], "'>f8'");
    let text = folder.path("text.npy");
    fs::write(&text, "0 0 0\n1 0 0\n").expect("written");
    refused(&text, &[], "numpy.save");
    refused(&folder.path("nowhere.npy"), &[], "No such file");
}

#[test]
fn a_failed_write_is_an_error() {
    let folder = Folder::new();
    let points = folder.array("points.npy", "(8, 3)", &lattice(2));
    let (code, object) = triangulate(&points, &["-o", "/nowhere/cells.npy"]);
    assert_eq!(code, 1);
    assert!(object["error"].as_str().is_some_and(|e| e.contains("/nowhere/cells.npy")), "{object}");
}
