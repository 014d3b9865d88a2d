//! Published meshes: the cache and a catalogue of the user's. `scripts/test_fetch_meshes.py` tests fetching.
#![cfg(unix)]

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use medial::surface;
use medial_run::hash::hex_digest;
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::command::{MEDIAL, ended, records};

/// A user's machine: a cache and a catalogue.
struct Machine {
    dir: TempDir,
}

/// The meshes of the catalogue: name, set, package, shape and resolution.
const MESHES: [(&str, &str, &str, &str, u32); 3] = [
    ("ball", "public", "deb:balls", "sphere", 10),
    ("rod-thin", "public", "deb:balls", "rod", 12),
    ("cap", "papers", "file:paper", "capsule", 12),
];

fn content(name: &str) -> Vec<u8> {
    let (.., shape, resolution) = MESHES.iter().find(|mesh| mesh.0 == name).expect("a mesh");
    let dir = tempfile::tempdir().expect("a folder");
    let path = dir.path().join("mesh.off");
    let mesh = medial_datasets::find(shape).expect("a shape").mesh(*resolution);
    surface::write(&path, &mesh).expect("written");
    fs::read(path).expect("read")
}

impl Machine {
    fn new() -> Self {
        let machine = Self { dir: tempfile::tempdir().expect("a folder") };
        fs::create_dir_all(machine.at("cache/meshes")).expect("made");
        let mut text = "package = [{ id = 'deb:balls', licence = 'none', version = '1.0' }, \
                        { id = 'file:paper', licence = 'none' }]\nmesh = [\n"
            .to_owned();
        for (name, set, package, ..) in MESHES {
            let hash = hex_digest(&content(name));
            text += &format!(
                "  {{ name = '{name}', set = '{set}', package = '{package}', path = '{name}.off', sha256 = '{hash}' }},\n",
            );
        }
        fs::write(machine.at("catalogue.toml"), text + "]\n").expect("written");
        machine
    }

    fn at(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    fn run(&self, arguments: &[&str]) -> (i32, String, String) {
        let mut command = Command::new(MEDIAL);
        command.args(arguments).env("MEDIAL_CACHE", self.at("cache"));
        command.env("MEDIAL_CATALOGUE", self.at("catalogue.toml")).current_dir(self.dir.path());
        ended(command.output().expect("the command starts"))
    }

    fn json(&self, arguments: &[&str]) -> (i32, Value) {
        let (code, stdout, stderr) = self.run(&[arguments, &["--json"]].concat());
        let object = serde_json::from_str(&stdout);
        (code, object.unwrap_or_else(|error| panic!("{error}: {stdout}{stderr}")))
    }

    /// The records of a comparison of a set.
    fn compared(&self, more: &[&str]) -> Result<Vec<Value>, (i32, String)> {
        let compare = ["compare", "--methods", "qmat", "--spheres", "10", "--counts-only"];
        let words = [&compare[..], &["--quiet", "--samples", "200"], more].concat();
        match self.run(&words) {
            (0, ..) => Ok(records(self.at("medial-report"))),
            (code, _, stderr) => Err((code, stderr)),
        }
    }
}

#[test]
fn sets_are_compared_under_their_names() {
    let machine = Machine::new();
    let (code, stderr) = machine.compared(&["--dataset", "public"]).expect_err("not fetched");
    assert!(code == 2 && stderr.contains("`medial datasets fetch public`"), "{stderr}");
    for name in ["ball", "rod-thin"] {
        let path = machine.at("cache/meshes").join(name).with_extension("off");
        fs::write(path, content(name)).expect("written");
    }
    let records = machine.compared(&["--dataset", "public", "--dataset", "sphere"]);
    let records = records.expect("three results");
    let found: Vec<_> =
        records.iter().map(|r| [r["mesh"].as_str(), r["dataset"].as_str()]).collect();
    let public = ["ball", "rod-thin"].map(|name| [Some(name), Some("public")]);
    assert_eq!(found, [&public[..], &[[Some("sphere"), Some("builtin")]]].concat());
}

#[test]
fn a_users_copy_is_recognised_by_its_content() {
    let machine = Machine::new();
    let (code, _, stderr) = machine.run(&["info", "dataset:cap"]);
    assert!(code == 2 && stderr.contains("fetch --from FILE"), "{stderr}");
    let (code, object) = machine.json(&["datasets", "fetch", "cap"]);
    assert_eq!((code, &object["missing"]), (3, &json!(["cap"])), "{object}");
    fs::write(machine.at("Some Name.off"), content("cap")).expect("written");
    let (code, object) = machine.json(&["datasets", "fetch", "cap", "--from", "Some Name.off"]);
    assert_eq!((code, &object["fetched"]), (0, &json!(["cap"])), "{object}");
    assert_eq!(machine.run(&["info", "dataset:cap"]).0, 0);
    let records = machine.compared(&["--dataset", "papers"]).expect("a result");
    assert_eq!((&records[0]["mesh"], &records[0]["dataset"]), (&"cap".into(), &"papers".into()));
    let (code, _, stderr) = machine.run(&["datasets", "fetch", "bal"]);
    assert!(code == 2 && stderr.contains("did you mean `ball`?"), "{stderr}");
}

#[test]
fn the_list_has_the_state_of_each_mesh() {
    let machine = Machine::new();
    fs::write(machine.at("cache/meshes/ball.off"), "OFF\n").expect("written");
    fs::write(machine.at("cache/meshes/rod-thin.off"), content("rod-thin")).expect("written");
    let (_, object) = machine.json(&["datasets", "list"]);
    assert_eq!(object["published"][0]["state"], "another file");
    assert_eq!(object["published"][1]["state"], "here");
    assert!(object["datasets"].as_array().is_some_and(|shapes| shapes.len() > 10));
}
