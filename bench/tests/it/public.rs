//! Published meshes: fetched by scripts in place of the clients, from archives that the tests write.
#![cfg(unix)]

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::PathBuf;
use std::process::Command;

use flate2::Compression;
use flate2::write::GzEncoder;
use medial::surface;
use medial_bench::provenance::hex_digest;
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::command::{MEDIAL, ended, records, text_path};

/// A user's machine: clients with a log of their arguments, a cache, a catalogue with two packages.
struct Machine {
    dir: TempDir,
}

/// The meshes of the catalogue: name, set, package, path in it, shape and resolution.
const MESHES: [(&str, &str, &str, &str, &str, u32); 4] = [
    ("ball", "public", "deb:balls", "share/data.tar.gz!data/ball.off", "sphere", 10),
    ("rod-thin", "public", "deb:balls", "share/data.tar.gz!data/rod.off", "rod", 12),
    ("ring", "public", "npm:ring", "package/ring.off", "torus", 16),
    ("cap", "papers", "file:paper", "cap.off", "capsule", 12),
];

fn off(shape: &str, resolution: u32) -> Vec<u8> {
    let dir = tempfile::tempdir().expect("a folder");
    let path = dir.path().join("mesh.off");
    let mesh = medial_datasets::find(shape).expect("a shape").mesh(resolution);
    surface::write(&path, &mesh).expect("written");
    fs::read(path).expect("read")
}

fn content(name: &str) -> Vec<u8> {
    let (.., shape, resolution) = MESHES.iter().find(|mesh| mesh.0 == name).expect("a mesh");
    off(shape, *resolution)
}

fn tar_gz(files: &[(&str, &[u8])]) -> Vec<u8> {
    let encoder = GzEncoder::new(Vec::new(), Compression::fast());
    let mut builder = tar::Builder::new(encoder);
    for (path, bytes) in files {
        let mut header = tar::Header::new_gnu();
        // By hand: the builder would refuse paths that lead outside.
        header.as_old_mut().name[..path.len()].copy_from_slice(path.as_bytes());
        header.set_size(bytes.len() as u64);
        header.set_mode(0o644);
        header.set_cksum();
        builder.append(&header, *bytes).expect("appended");
    }
    builder.into_inner().expect("a tar").finish().expect("compressed")
}

impl Machine {
    /// With the catalogue, and without any client.
    fn new() -> Self {
        let machine = Self { dir: tempfile::tempdir().expect("a folder") };
        for folder in ["bin", "archives", "cache"] {
            fs::create_dir(machine.at(folder)).expect("made");
        }
        let mut text = String::from("package = [\n");
        for (client, name) in [("deb", "balls"), ("npm", "ring"), ("file", "paper")] {
            let version = if client == "file" { "" } else { ", version = '1.0'" };
            text += &format!("  {{ id = '{client}:{name}', licence = 'none'{version} }},\n");
        }
        text += "]\nmesh = [\n";
        for (name, set, package, path, ..) in MESHES {
            text += &format!(
                "  {{ name = '{name}', set = '{set}', package = '{package}', path = '{path}', sha256 = '{}' }},\n",
                hex_digest(&content(name)),
            );
        }
        text += "]\n";
        fs::write(machine.at("catalogue.toml"), text).expect("written");
        // The only programs of this machine are its clients and Python.
        let python = Command::new("python3")
            .args(["-c", "import sys; print(sys.executable)"])
            .output()
            .expect("fetching meshes needs python3");
        let python = String::from_utf8(python.stdout).expect("a UTF-8 path");
        std::os::unix::fs::symlink(python.trim(), machine.at("bin/python3")).expect("linked");
        machine
    }

    /// With both clients and right archives.
    fn whole() -> Self {
        let machine = Self::new();
        machine.archive("balls.tgz", &balls());
        machine.archive("ring.tgz", &tar_gz(&[("package/ring.off", &content("ring"))]));
        machine.delivers("apt-get", "balls.tgz");
        machine.delivers("npm", "ring.tgz");
        machine
    }

    fn at(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    fn archive(&self, name: &str, bytes: &[u8]) {
        fs::write(self.at("archives").join(name), bytes).expect("written");
    }

    /// A client that leaves an archive.
    fn delivers(&self, client: &str, archive: &str) {
        let path = self.at("archives").join(archive);
        self.client(client, &format!("exec /bin/cp {} .", text_path(&path)));
    }

    /// A client that logs its arguments and then runs a command.
    fn client(&self, name: &str, then: &str) {
        let path = self.at("bin").join(name);
        let log = self.at("log");
        let text = format!("#!/bin/sh\necho \"{name} $*\" >> {}\n{then}\n", text_path(&log));
        fs::write(&path, text).expect("written");
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).expect("may run");
    }

    /// The command lines of the clients since the last call.
    fn log(&self) -> Vec<String> {
        let text = fs::read_to_string(self.at("log")).unwrap_or_default();
        let _ = fs::remove_file(self.at("log"));
        text.lines().map(str::to_owned).collect()
    }

    fn run(&self, arguments: &[&str]) -> (i32, String, String) {
        let mut command = Command::new(MEDIAL);
        command.args(arguments).env("PATH", self.at("bin")).env("MEDIAL_CACHE", self.at("cache"));
        command.env("MEDIAL_CATALOGUE", self.at("catalogue.toml")).current_dir(self.dir.path());
        ended(command.output().expect("the command starts"))
    }

    fn json(&self, arguments: &[&str]) -> (i32, Value, String) {
        let (code, stdout, stderr) = self.run(&[arguments, &["--json"]].concat());
        let object = serde_json::from_str(&stdout);
        (code, object.unwrap_or_else(|error| panic!("{error}: {stdout}{stderr}")), stderr)
    }

    fn cached(&self, name: &str) -> Option<Vec<u8>> {
        fs::read(self.at("cache/meshes").join(name)).ok()
    }
}

/// An archive with an archive that has these files.
fn nested(files: &[(&str, &[u8])]) -> Vec<u8> {
    tar_gz(&[("./share/data.tar.gz", &tar_gz(files))])
}

fn balls() -> Vec<u8> {
    nested(&[("data/ball.off", &content("ball")), ("data/rod.off", &content("rod-thin"))])
}

#[test]
fn fetched_meshes_are_not_fetched_again() {
    let machine = Machine::whole();
    let (code, object, stderr) = machine.json(&["datasets", "fetch", "public"]);
    assert_eq!(code, 0, "{stderr}");
    assert_eq!((&object["verified"], &object["wanted"]), (&3.into(), &3.into()), "{object}");
    assert_eq!(machine.cached("rod-thin.off"), Some(content("rod-thin")));
    let log = machine.log();
    assert_eq!(log.len(), 2, "{log:?}");
    assert!(log[0].contains("download") && log[0].ends_with("balls=1.0"), "{log:?}");
    assert!(log[1].contains("--ignore-scripts") && log[1].ends_with("ring@1.0"), "{log:?}");
    let (code, object, _) = machine.json(&["datasets", "fetch", "public"]);
    assert_eq!((code, &object["fetched"]), (0, &Value::Array(vec![])));
    assert_eq!(machine.log(), Vec::<String>::new());

    // Only damaged and missing files are fetched again.
    fs::write(machine.at("cache/meshes/ball.off"), "OFF\n").expect("written");
    fs::write(machine.at("cache/meshes/.medial-1-1.tmp"), "half").expect("written");
    let (_, object, _) = machine.json(&["datasets", "list"]);
    assert_eq!(object["published"][0]["state"], "another file");
    assert_eq!(object["published"][1]["state"], "here");
    assert!(object["datasets"].as_array().is_some_and(|shapes| shapes.len() > 10));
    let (_, object, _) = machine.json(&["datasets", "fetch", "ball"]);
    assert_eq!(object["fetched"], json!(["ball"]));
    assert_eq!(machine.log().len(), 1);
}

#[test]
fn an_interrupted_fetch_resumes() {
    let machine = Machine::whole();
    // Only the client that never ends is run under the short limit.
    assert_eq!(machine.run(&["datasets", "fetch", "deb:balls"]).0, 0);
    machine.client("npm", "exec /bin/sleep 1000");
    let (code, object, stderr) = machine.json(&["datasets", "fetch", "--timeout", "1"]);
    assert_eq!(code, 3);
    assert!(stderr.contains("took more than 1 s"), "{stderr}");
    assert_eq!([&object["verified"], &object["missing"]], [&json!(2), &json!(["ring"])]);
    machine.delivers("npm", "ring.tgz");
    machine.log();
    assert_eq!(machine.run(&["datasets", "fetch"]).0, 0);
    let log = machine.log();
    assert!(log.len() == 1 && log[0].starts_with("npm"), "{log:?}");
}

#[test]
fn another_content_is_refused_by_name() {
    let machine = Machine::whole();
    machine.archive("ring.tgz", &tar_gz(&[("package/ring.off", b"OFF\n0 0 0\n")]));
    let (code, object, stderr) = machine.json(&["datasets", "fetch"]);
    assert_eq!(code, 3);
    assert_eq!(object["missing"], json!(["ring"]));
    assert!(stderr.contains("ring: package/ring.off of ring.tgz has another content"), "{stderr}");
    assert_eq!(machine.cached("ring.off"), None);
    assert_eq!(machine.cached("ball.off"), Some(content("ball")));
}

#[test]
fn a_missing_client_is_reported_once_and_the_rest_continues() {
    let machine = Machine::whole();
    fs::remove_file(machine.at("bin/apt-get")).expect("removed");
    let (code, _, stderr) = machine.run(&["datasets", "fetch"]);
    assert_eq!(code, 3);
    assert_eq!(stderr.matches("apt-get is not installed").count(), 1, "{stderr}");
    assert!(machine.cached("ring.off").is_some());
    machine.client("apt-get", "echo no such package >&2; exit 100");
    let (_, _, stderr) = machine.run(&["datasets", "fetch"]);
    assert!(stderr.contains("no such package"), "{stderr}");
}

#[test]
fn identical_meshes_of_another_version_are_accepted() {
    let machine = Machine::whole();
    let later = nested(&[("data/ball.off", &content("ball")), ("data/rod.off", b"OFF\n0 0 0\n")]);
    machine.archive("balls.tgz", &later);
    let path = machine.at("archives/balls.tgz");
    let then = format!("case \"$*\" in *=1.0) exit 100;; esac; /bin/cp {} .", text_path(&path));
    machine.client("apt-get", &then);
    let (code, object, stderr) = machine.json(&["datasets", "fetch"]);
    assert_eq!(code, 3);
    assert_eq!(object["missing"], json!(["rod-thin"]), "{stderr}");
    assert!(stderr.contains("identical meshes from another version"), "{stderr}");
    assert!(stderr.contains("rod-thin: share/data.tar.gz!data/rod.off of"), "{stderr}");
    assert_eq!(machine.cached("ball.off"), Some(content("ball")));
}

#[test]
fn nothing_leaves_the_cache_and_broken_archives_are_refused() {
    let machine = Machine::whole();
    let outside = tar_gz(&[("../../ring.off", b"x"), ("package/ring.off", &content("ring"))]);
    machine.archive("ring.tgz", &outside);
    assert_eq!(machine.run(&["datasets", "fetch"]).0, 0);
    let entries = fs::read_dir(machine.at("cache")).expect("a folder");
    let names: Vec<_> = entries.map(|entry| entry.expect("an entry").file_name()).collect();
    assert_eq!(names, ["meshes"]);
    assert!(!machine.at("ring.off").exists());
    for (name, bytes) in [("cut.tgz", &outside[..40]), ("text.tar", b"no"), ("text.whl", b"no")] {
        fs::write(machine.at(name), bytes).expect("written");
        let (code, _, stderr) = machine.run(&["datasets", "fetch", "--from", name]);
        assert!(code == 1 && stderr.contains(&format!("{name}: ")), "{stderr}");
    }
}

#[test]
fn an_archive_of_the_users_needs_no_client() {
    let machine = Machine::new();
    fs::write(machine.at("mine.tgz"), balls()).expect("written");
    let (code, object, _) = machine.json(&["datasets", "fetch", "deb:balls", "--from", "mine.tgz"]);
    assert_eq!((code, &object["verified"]), (0, &2.into()), "{object}");
    fs::write(machine.at("other.tgz"), tar_gz(&[("a.off", b"OFF")])).expect("written");
    let (code, _, stderr) = machine.run(&["datasets", "fetch", "--from", "other.tgz"]);
    assert!(code == 1 && stderr.contains("no mesh of the catalogue"), "{stderr}");
    let (code, _, stderr) = machine.run(&["datasets", "fetch", "bal"]);
    assert!(code == 2 && stderr.contains("did you mean `ball`?"), "{stderr}");
}

#[test]
fn sets_are_compared_under_their_names() {
    let machine = Machine::whole();
    let compare = ["compare", "--methods", "qmat", "--spheres", "10", "--counts-only", "--quiet"];
    let words = [&compare[..], &["--samples", "200", "--dataset", "public"]].concat();
    let (code, _, stderr) = machine.run(&words);
    assert_eq!(code, 2, "{stderr}");
    assert!(stderr.contains("`medial datasets fetch public`"), "{stderr}");
    assert_eq!(machine.run(&["datasets", "fetch"]).0, 0);
    let (code, stdout, stderr) = machine.run(&[&words[..], &["--dataset", "sphere"]].concat());
    assert_eq!(code, 0, "{stdout}{stderr}");
    let records = records(machine.at("medial-report"));
    let found: Vec<_> =
        records.iter().map(|r| [r["mesh"].as_str(), r["dataset"].as_str()]).collect();
    let public = ["ball", "rod-thin", "ring"].map(|name| [Some(name), Some("public")]);
    assert_eq!(found, [&public[..], &[[Some("sphere"), Some("builtin")]]].concat());
}

#[test]
fn a_users_copy_is_recognised_by_its_content() {
    let machine = Machine::new();
    let (code, _, stderr) = machine.run(&["info", "dataset:cap"]);
    assert!(code == 2 && stderr.contains("fetch --from FILE"), "{stderr}");
    fs::write(machine.at("Some Name.off"), content("cap")).expect("written");
    let (code, object, _) = machine.json(&["datasets", "fetch", "cap", "--from", "Some Name.off"]);
    assert_eq!((code, &object["fetched"]), (0, &json!(["cap"])), "{object}");
    assert_eq!(machine.run(&["info", "dataset:cap"]).0, 0);
    let compare = ["compare", "--methods", "qmat", "--spheres", "10", "--counts-only", "--quiet"];
    let words = [&compare[..], &["--samples", "200", "--dataset", "papers"]].concat();
    assert_eq!(machine.run(&words).0, 0);
    let records = records(machine.at("medial-report"));
    assert_eq!((&records[0]["mesh"], &records[0]["dataset"]), (&"cap".into(), &"papers".into()));
}
