//! Made-up records for the tests of this folder, which look like real ones: errors fall with the number of spheres, methods
//! differ, some runs fail.

use std::collections::BTreeMap;

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use flate2::read::GzDecoder;
use medial::metrics::{Counts, Distances, Evaluation, RatioSpikes, Spikes, TriangleQuality};
use medial_reports::{Header, MethodNote, RunNote};
use medial_run::level::Target;
use medial_run::record::{Initial, Machine, Record, Repetition, Simplify, Stages, Status};
use serde_json::Value;

/// The two documents of a page: the plain one, and the packed one with the records.
pub fn documents(page: &str) -> [Value; 2] {
    let element = |id: &str| {
        let (_, rest) = page.split_once(&format!("id=\"{id}\">")).unwrap();
        rest.split_once("</script>").unwrap().0
    };
    let packed = BASE64_STANDARD.decode(element("bulk")).unwrap();
    let bulk = serde_json::from_reader(GzDecoder::new(packed.as_slice())).unwrap();
    [serde_json::from_str(element("report")).unwrap(), bulk]
}

/// Names of made-up shapes, as many as the published comparison has.
pub const SHAPES: [&str; 13] = [
    "bear", "dolphin", "plane", "ant", "holes", "torso", "driver", "head", "sheet", "bracket",
    "casting", "spider", "box",
];

/// A number in [0, 1) that depends on its arguments alone.
pub fn noise(a: usize, b: usize, c: usize) -> f64 {
    let mut x = (a as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)
        ^ (b as u64 + 1).wrapping_mul(0xBF58_476D_1CE4_E5B9)
        ^ (c as u64 + 7).wrapping_mul(0x94D0_49BB_1331_11EB);
    x ^= x >> 31;
    x = x.wrapping_mul(0xD6E8_FEB8_6659_FD93);
    x ^= x >> 32;
    (x >> 11) as f64 / (1u64 << 53) as f64
}

/// The record of a run that led to a result.
pub fn ok(mesh: &str, method: &str, count: usize, shape: usize, rank: usize) -> Record {
    let wobble = 0.8 + 0.4 * noise(shape, rank, count);
    let difficulty = 0.6 + 1.6 * noise(shape, 0, 0);
    let error = 0.015
        * difficulty
        * wobble
        * (1.0 + 0.25 * rank as f64)
        * (100.0 / count as f64).powf(0.55);
    let stages = Stages::new(
        0.4 + 1.2 * noise(shape, 1, 1),
        0.3 * (rank + 1) as f64 * difficulty,
        0.2 * (rank + 1) as f64 * (2.0 - count as f64 / 1000.0),
    );
    let genus = if shape.is_multiple_of(4) { 3 } else { 0 };
    let right = rank == 0 || noise(shape, rank, 99) > 0.4;
    let mut record = request(mesh, method, count, Status::Ok);
    record.simplify.reached = Some(count);
    record.simplify.spheres = Some(count);
    record.simplify.edges = Some(count * 5 / 2);
    record.simplify.faces = Some(count * 3 / 2);
    record.simplify.substrates =
        BTreeMap::from([("delaunay".to_owned(), 0.3), ("inside".to_owned(), 0.1)]);
    record.simplify.seconds = Some(stages);
    record.simplify.cpu_seconds = Some(stages);
    record.simplify.peak_bytes = Some(90_000_000 + 1_000_000 * shape as u64);
    record.simplify.diagnostics = BTreeMap::from([("rejected_by_link_condition".to_owned(), 17)]);
    record.repetitions = vec![Repetition { seconds: stages, cpu_seconds: stages }];
    record.evaluate_seconds = Some(1.5);
    record.artifact = Some(format!("meshes/{method}/{count}.ma"));
    let betti = [1, genus, 0];
    record.initial = Some(Initial {
        spheres: 12_000 + 1_000 * shape as u64,
        edges: 30_000,
        faces: 20_000,
        betti: Some(if shape == 10 { [1, 19, 0] } else { betti }),
        expected_betti: Some(betti),
    });
    record.evaluate = Some(Evaluation {
        betti: if right { betti } else { [1, genus + 2, 1] },
        euler: 1 - genus as i64,
        expected_betti: Some(betti),
        ..evaluation(error, wobble, count, rank)
    });
    record
}

/// Metrics that follow from an error.
fn evaluation(error: f64, wobble: f64, count: usize, rank: usize) -> Evaluation {
    let spheres = count as u64;
    let steep = 0.2 * (1.0 - count as f64 / 2000.0);
    Evaluation {
        distances: Distances {
            epsilon: error * 0.8,
            epsilon_union: error * 0.9,
            reverse: error,
            hausdorff: error,
            mean: error * 0.12,
            rms: error * 0.2,
            p95: error * 0.4,
            p99: error * 0.6,
            reverse_mean: error * 0.11,
            spheres_only: error * 3.0,
            samples: 50_000,
            reverse_samples: 48_000,
        },
        certified: None,
        cover: None,
        volume_error: Some(error),
        volume_ratio: None,
        protrusion: Some(error * 0.7),
        centres_outside: Some(0.0),
        quality: TriangleQuality {
            min_angle_mean: Some(38.0 - 2.0 * rank as f64 * wobble - 10.0 * steep),
            max_angle_mean: Some(82.0),
            below_30: Some(0.2 + 0.05 * rank as f64 * wobble),
            below_10: Some(0.02),
            below_1: Some(0.001),
            zero_area: 0,
        },
        spikes: Spikes {
            by_ratio: [0.05, 0.1, 0.2]
                .map(|threshold| RatioSpikes {
                    threshold,
                    edge_share: threshold / 10.0,
                    length_share: threshold / 20.0,
                    spikes: (threshold * 10.0 * rank as f64 * spheres as f64 / 50.0 * wobble)
                        as u64,
                    dangling_edges: rank as u64,
                })
                .to_vec(),
            dangling_edges: 2,
            fins: 1,
            idle_spheres: 4,
            angle_spikes: None,
        },
        betti: [1, 0, 0],
        euler: 1,
        expected_betti: None,
        counts: Counts {
            spheres,
            edges: spheres * 5 / 2,
            faces: spheres * 3 / 2,
            lone_edges: 3,
            isolated: 0,
            nonmanifold_edges: 12,
        },
        axis: None,
        structure: None,
        diagonal: 1.238,
        seed: 7,
        warnings: Vec::new(),
    }
}

/// The record of a run that led to nothing.
pub fn request(mesh: &str, method: &str, count: usize, status: Status) -> Record {
    let mut simplify = Simplify::asked(method, Target::Spheres(count), status);
    simplify.seed = 1;
    simplify.threads = Some(1);
    simplify.version = "0.1.0".to_owned();
    Record {
        mesh: mesh.to_owned(),
        dataset: Some("made-up".to_owned()),
        status,
        simplify,
        seeds: BTreeMap::from([("evaluation".to_owned(), 7), ("method".to_owned(), 1)]),
        machine: Machine {
            cpu: "Example 9000".to_owned(),
            cores: 2,
            os: "Linux x86_64".to_owned(),
            memory: 8_000_000_000,
        },
        binary_hash: "3f9c0d".to_owned(),
        command: "medial compare --spheres 1000,500,200,100".to_owned(),
        version: "0.1.0".to_owned(),
        ..Record::default()
    }
}

/// The same with a reason.
pub fn failed(mesh: &str, method: &str, count: usize, status: Status, reason: &str) -> Record {
    Record { reason: Some(reason.to_owned()), ..request(mesh, method, count, status) }
}

/// A header for made-up records.
pub fn header(methods: &[&str]) -> Header {
    let note = |id: &&str| MethodNote {
        id: (*id).to_owned(),
        title: format!("Method {id}"),
        citation: "A. Author, 2015, Title, Journal, doi:10.1145/0000000".to_owned(),
        bibtex: format!("@article{{{id},\n  title = {{Method {id}}}\n}}"),
        summary: "Collapses edges by a quadric error.".to_owned(),
        home: format!("Few spheres; {id} is made up."),
        published: "a count of 1,000 spheres".to_owned(),
        native: Some("theta (degrees)".to_owned()),
        params: vec![],
    };
    let run = RunNote {
        command: "medial compare --spheres 1000,500,200,100".to_owned(),
        version: "0.1.0".to_owned(),
        binary_hash: "3f9c0d".to_owned(),
        date: Some("2026-01-31 12:00 UTC".to_owned()),
        machine: None,
    };
    Header { runs: vec![run], methods: methods.iter().map(note).collect(), ..Header::default() }
}

/// A whole comparison with a few failures of every kind.
pub fn comparison(shapes: &[&str], methods: &[&str], counts: &[usize]) -> Vec<Record> {
    let mut records = Vec::new();
    for (shape, mesh) in shapes.iter().enumerate() {
        for (rank, method) in methods.iter().enumerate() {
            for &count in counts {
                records.push(match (shape % 13, rank, count) {
                    (3, 1, 100) => failed(mesh, method, count, Status::Panicked, "index out of bounds: the len is 0 but the index is 4"),
                    (5, 2, _) => failed(mesh, method, count, Status::TimedOut, "no result within 300 s"),
                    (8, 1, _) => failed(mesh, method, count, Status::Unsupported, "unsupported: the parts of this shape cannot be separated; use the published level"),
                    _ => ok(mesh, method, count, shape, rank),
                });
            }
        }
    }
    if let Some(record) = records.iter_mut().find(|record| record.status.is_ok()) {
        record.simplify.warnings.push("12 collapses were refused by the link condition".to_owned());
        record
            .evaluate
            .as_mut()
            .unwrap()
            .warnings
            .push("radii 3 % too large for this mesh".to_owned());
    }
    // A method that stops short of the count.
    if let Some(record) = records.iter_mut().rev().find(|record| record.status.is_ok()) {
        record.simplify.reached = record.simplify.reached.map(|count| count * 2);
    }
    records
}
