//! Published meshes: the cache and a catalogue of the user's. `scripts/test_fetch_meshes.py` tests fetching.
#![cfg(unix)]

use std::fs;

use medial::surface;
use medial_run::hash::hex_digest;
use serde_json::{Value, json};

use crate::command::{Folder, ended, json_of};

/// A user's machine: a folder with a cache and a catalogue.
struct Machine(Folder);

/// The meshes of the catalogue: name, set, package, shape and resolution.
const MESHES: [(&str, &str, &str, &str, u32); 3] = [
    ("ball", "public", "deb:balls", "sphere", 10),
    ("rod-thin", "public", "deb:balls", "rod", 12),
    ("cap", "papers", "file:paper", "capsule", 12),
];

fn content(name: &str) -> Vec<u8> {
    let (.., shape, resolution) = MESHES.iter().find(|mesh| mesh.0 == name).expect("a mesh");
    let at = Folder::new();
    let mesh = medial_datasets::find(shape).expect("a shape").mesh(*resolution);
    surface::write(at.at("mesh.off"), &mesh).expect("written");
    fs::read(at.at("mesh.off")).expect("read")
}

impl Machine {
    fn new() -> Self {
        let at = Folder::new();
        fs::create_dir_all(at.at("cache/meshes")).expect("made");
        let mut text = "package = [{ id = 'deb:balls', licence = 'none', version = '1.0' }, \
                        { id = 'file:paper', licence = 'none' }]\nmesh = [\n"
            .to_owned();
        for (name, set, package, ..) in MESHES {
            let hash = hex_digest(&content(name));
            text += &format!(
                "  {{ name = '{name}', set = '{set}', package = '{package}', path = '{name}.off', sha256 = '{hash}' }},\n",
            );
        }
        at.write("catalogue.toml", text + "]\n");
        Self(at)
    }

    fn run(&self, line: &str) -> (i32, String, String) {
        let mut command = self.0.command(line);
        command.env("MEDIAL_CACHE", self.0.at("cache"));
        command.env("MEDIAL_CATALOGUE", self.0.at("catalogue.toml"));
        ended(command.output().expect("the command starts"))
    }

    fn json(&self, line: &str) -> (i32, Value) {
        json_of(self.run(&format!("{line} --json")))
    }

    /// The records of a comparison of sets.
    fn compared(&self, sets: &str) -> Result<Vec<Value>, (i32, String)> {
        let line = "compare --methods qmat --spheres 10 --counts-only --quiet --samples 200";
        match self.run(&format!("{line} {sets}")) {
            (0, ..) => Ok(self.0.records("medial-report")),
            (code, _, stderr) => Err((code, stderr)),
        }
    }
}

#[test]
fn sets_are_compared_under_their_names() {
    let machine = Machine::new();
    let (code, stderr) = machine.compared("--dataset public").expect_err("not fetched");
    assert!(code == 2 && stderr.contains("`medial datasets fetch public`"), "{stderr}");
    for name in ["ball", "rod-thin"] {
        machine.0.write(format!("cache/meshes/{name}.off"), content(name));
    }
    let records = machine.compared("--dataset public --dataset sphere");
    let records = records.expect("three results");
    let found: Vec<_> =
        records.iter().map(|r| [r["mesh"].as_str(), r["dataset"].as_str()]).collect();
    let public = ["ball", "rod-thin"].map(|name| [Some(name), Some("public")]);
    assert_eq!(found, [&public[..], &[[Some("sphere"), Some("builtin")]]].concat());
}

#[test]
fn a_users_copy_is_recognised_by_its_content() {
    let machine = Machine::new();
    let (code, _, stderr) = machine.run("info dataset:cap");
    assert!(code == 2 && stderr.contains("fetch --from FILE"), "{stderr}");
    let (code, object) = machine.json("datasets fetch cap");
    assert_eq!((code, &object["missing"]), (3, &json!(["cap"])), "{object}");
    machine.0.write("Some-Name.off", content("cap"));
    let (code, object) = machine.json("datasets fetch cap --from Some-Name.off");
    assert_eq!((code, &object["fetched"]), (0, &json!(["cap"])), "{object}");
    assert_eq!(machine.run("info dataset:cap").0, 0);
    let records = machine.compared("--dataset papers").expect("a result");
    assert_eq!((&records[0]["mesh"], &records[0]["dataset"]), (&"cap".into(), &"papers".into()));
    let (code, _, stderr) = machine.run("datasets fetch bal");
    assert!(code == 2 && stderr.contains("did you mean `ball`?"), "{stderr}");
}

#[test]
fn the_list_has_the_state_of_each_mesh() {
    let machine = Machine::new();
    machine.0.write("cache/meshes/ball.off", "OFF\n");
    machine.0.write("cache/meshes/rod-thin.off", content("rod-thin"));
    let (_, object) = machine.json("datasets list");
    assert_eq!(object["published"][0]["state"], "another file");
    assert_eq!(object["published"][1]["state"], "here");
    assert!(object["datasets"].as_array().is_some_and(|shapes| shapes.len() > 10));
}
