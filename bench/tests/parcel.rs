//! Results as an archive: there and back, and what is refused.

mod common;

use std::fs;
use std::io::{Read, Write};
use std::path::Path;

use common::{code, records, run, stderr};
use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;
use tar::{Archive, Builder, EntryType, Header};

const MEDIAL: &str = env!("CARGO_BIN_EXE_medial");

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn medial(arguments: &[&str]) -> (i32, String) {
    let output = run(MEDIAL, arguments);
    (code(&output), String::from_utf8_lossy(&output.stdout).into_owned() + &stderr(&output))
}

/// The files of an archive, by name.
type Files = Vec<(String, Vec<u8>)>;

/// A folder of results of two methods, and its archive.
fn packed(folder: &Path) -> std::path::PathBuf {
    let (results, archive) = (folder.join("results"), folder.join("results.tar.gz"));
    let compare = [
        "compare",
        "builtin:torus:24",
        "--methods",
        "pmat,qmat",
        "--spheres",
        "40,5",
        "-q",
        "--out",
    ];
    run(MEDIAL, &[&compare[..], &[text(&results), "--counts-only"]].concat());
    let (code, said) = medial(&["submit-results", text(&results), "-o", text(&archive)]);
    assert_eq!(code, 0, "{said}");
    archive
}

/// The files of an archive.
fn files(archive: &Path) -> Files {
    let mut archive = Archive::new(GzDecoder::new(fs::File::open(archive).unwrap()));
    let read = |entry: std::io::Result<tar::Entry<'_, _>>| {
        let mut entry = entry.unwrap();
        let name = entry.path().unwrap().to_str().unwrap().to_owned();
        let mut bytes = vec![];
        entry.read_to_end(&mut bytes).unwrap();
        (name, bytes)
    };
    archive.entries().unwrap().map(read).collect()
}

fn header(size: u64, name: &str) -> Header {
    let mut header = Header::new_ustar();
    header.set_size(size);
    header.set_mode(0o644);
    header.set_entry_type(EntryType::Regular);
    // As it is: `set_path` refuses what leads outside.
    header.as_mut_bytes()[..name.len()].copy_from_slice(name.as_bytes());
    header.set_cksum();
    header
}

/// Writes an archive, with a manifest that fits the other files.
fn write(archive: &Path, mut files: Files) {
    let mut manifest: serde_json::Value = serde_json::from_slice(&files[0].1).unwrap();
    for (name, bytes) in &files[1..] {
        use sha2::Digest;
        let hash = sha2::Sha256::digest(bytes);
        let hash: String = hash.iter().map(|byte| format!("{byte:02x}")).collect();
        manifest["files"][name] = hash.into();
    }
    files[0].1 = manifest.to_string().into_bytes();
    let mut tar = Builder::new(GzEncoder::new(vec![], Compression::fast()));
    for (name, bytes) in &files {
        tar.append(&header(bytes.len() as u64, name), bytes.as_slice()).unwrap();
    }
    fs::write(archive, tar.into_inner().unwrap().finish().unwrap()).unwrap();
}

#[test]
fn results_travel_and_are_measured_again() {
    let folder = tempfile::tempdir().unwrap();
    let archive = packed(folder.path());
    let again = folder.path().join("again.tar.gz");
    medial(&["submit-results", text(&folder.path().join("results")), "-o", text(&again)]);
    assert_eq!(fs::read(&archive).unwrap(), fs::read(&again).unwrap());

    let taken = folder.path().join("taken");
    let collect = ["collect", text(&archive), "--out", text(&taken)];
    let (code, said) = medial(&collect);
    assert_eq!(code, 0, "{said}");
    assert!(
        said.contains("4 records added") && said.contains("4 re-judged, 0 as submitted"),
        "{said}"
    );
    for record in records(&taken) {
        assert_eq!(record["origin"]["trust"], "re_judged");
        assert!(taken.join(record["artifact"].as_str().unwrap()).is_file());
    }
    let page = fs::read_to_string(taken.join("index.html")).unwrap();
    assert!(page.contains("qmat (submitted)") && page.contains("re-judged"));
    let (code, said) = medial(&collect);
    assert!(code == 0 && said.contains("0 records added"), "{said}");
    assert_eq!(records(&taken).len(), 4);

    let believed = folder.path().join("believed");
    let (_, said) =
        medial(&["collect", text(&archive), "--out", text(&believed), "--rejudge", "0"]);
    assert!(said.contains("0 re-judged, 4 as submitted"), "{said}");
}

#[test]
fn changed_numbers_and_medial_meshes_are_found() {
    let folder = tempfile::tempdir().unwrap();
    let whole = files(&packed(folder.path()));
    let changed = folder.path().join("changed.tar.gz");
    let refused = |change: &dyn Fn(&mut Files), why: &str| {
        let mut files = whole.clone();
        change(&mut files);
        write(&changed, files);
        let out = folder.path().join("out");
        let (code, said) = medial(&["collect", text(&changed), "--out", text(&out)]);
        assert!(
            code == 1 && said.contains("refused") && said.contains(why),
            "{why}: {code} {said}"
        );
        assert!(!out.join("results.jsonl").exists(), "{why}");
    };
    let in_first_record = |key: &'static str, value: serde_json::Value| {
        move |files: &mut Files| {
            let all = String::from_utf8(files[1].1.clone()).unwrap();
            let mut lines: Vec<String> = all.lines().map(str::to_owned).collect();
            let mut record: serde_json::Value = serde_json::from_str(&lines[0]).unwrap();
            *record.pointer_mut(key).unwrap() = value.clone();
            lines[0] = record.to_string();
            files[1].1 = (lines.join("\n") + "\n").into_bytes();
        }
    };
    refused(&in_first_record("/evaluate/hausdorff", 0.001.into()), "hausdorff");
    refused(&in_first_record("/evaluate/p95", 0.001.into()), "p95");
    refused(&in_first_record("/evaluate/betti", serde_json::json!([1, 9, 0])), "betti");
    refused(&in_first_record("/simplify/faces", 7.into()), "its record tells");
    refused(
        &|files| {
            // A sphere a little to the side.
            let axis = String::from_utf8(files.last().unwrap().1.clone()).unwrap();
            let mut lines: Vec<String> = axis.lines().map(str::to_owned).collect();
            let sphere = lines.iter().position(|line| line.starts_with("v ")).unwrap();
            let words: Vec<&str> = lines[sphere].split(' ').collect();
            let x: f64 = words[1].parse().unwrap();
            lines[sphere] = format!("v {} {}", x + 0.05, words[2..].join(" "));
            files.last_mut().unwrap().1 = (lines.join("\n") + "\n").into_bytes();
        },
        "measured here",
    );
    // Without a manifest that fits, no measuring is needed.
    let mut files = whole.clone();
    files.last_mut().unwrap().1.push(b'\n');
    let mut tar = Builder::new(GzEncoder::new(vec![], Compression::fast()));
    for (name, bytes) in &files {
        tar.append(&header(bytes.len() as u64, name), bytes.as_slice()).unwrap();
    }
    fs::write(&changed, tar.into_inner().unwrap().finish().unwrap()).unwrap();
    let (code, said) = medial(&["collect", text(&changed), "--out", text(folder.path())]);
    assert!(code == 1 && said.contains("not as its manifest tells"), "{said}");
}

#[test]
fn hostile_archives_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let archive = folder.path().join("hostile.tar.gz");
    let out = folder.path().join("out");
    let refused = |bytes: &[u8], why: &str| {
        fs::write(&archive, bytes).unwrap();
        let (code, said) = medial(&["collect", text(&archive), "--out", text(&out)]);
        assert!(code == 1 && said.contains("refused") && said.contains(why), "{why}: {said}");
        assert!(!out.exists());
    };
    let one = |header: &Header, bytes: &[u8]| {
        let mut tar = Builder::new(GzEncoder::new(vec![], Compression::fast()));
        tar.append(header, bytes).unwrap();
        tar.into_inner().unwrap().finish().unwrap()
    };
    for name in ["../outside", "/etc/passwd", "axes/../../x.ma", "axes/x.ma", "study.toml"] {
        refused(&one(&header(1, name), b"x"), name);
    }
    for (kind, name) in [
        (EntryType::Symlink, "results.jsonl"),
        (EntryType::Link, "results.jsonl"),
        (EntryType::Directory, "axes"),
        (EntryType::Fifo, "manifest.json"),
        (EntryType::GNULongName, "x"),
        (EntryType::XHeader, "x"),
    ] {
        let mut header = header(0, name);
        header.set_entry_type(kind);
        header.set_cksum();
        refused(&one(&header, b""), "no plain file");
    }
    // Ten gigabytes of zeros, told or packed.
    let mut large = GzEncoder::new(vec![], Compression::best());
    large.write_all(header(10 << 30, "manifest.json").as_bytes()).unwrap();
    refused(&large.finish().unwrap(), "more than");
    let mut zeros = GzEncoder::new(vec![], Compression::best());
    let block = vec![0; 1 << 20];
    for _ in 0..64 {
        zeros.write_all(&block).unwrap();
    }
    refused(&zeros.finish().unwrap(), "manifest");
    refused(b"no archive at all", "cannot be unpacked");
    refused(b"", "");
}
