//! What a report shows from files of their own: the baseline, stability under noise, oracles.

use std::fs;
use std::path::Path;

use super::common::{comparison, header};
use medial::metrics::{AxisSpan, SurfaceDistances};
use medial_reports::{
    AxisShift, BASELINES, Baseline, NoiseRecord, ORACLES, Record, STABILITY, read_lines,
    write_lines, write_report,
};

const METHODS: [&str; 2] = ["qmat", "angle"];

fn records() -> Vec<Record> {
    let mut records = comparison(&["bear", "dolphin"], &METHODS, &[500, 100]);
    records.iter_mut().for_each(|record| record.mesh_hash = Some(format!("hash-{}", record.mesh)));
    records
}

fn baseline(mesh: &str, numbers: usize, error: f64) -> Baseline {
    Baseline {
        mesh: mesh.to_owned(),
        mesh_hash: format!("hash-{mesh}"),
        tool: "decimator 1.0".to_owned(),
        numbers_asked: numbers,
        vertices: numbers / 3,
        faces: 2 * numbers / 3,
        seconds: None,
        distances: SurfaceDistances {
            forward: error,
            reverse: error / 2.0,
            hausdorff: error,
            mean: error / 8.0,
            rms: error / 6.0,
            reverse_mean: error / 9.0,
            samples: 100,
            reverse_samples: 100,
        },
        seed: 0,
        command: "medial baseline".to_owned(),
        version: "0.1.0".to_owned(),
    }
}

fn read(folder: &Path, name: &str) -> String {
    fs::read_to_string(folder.join(name)).unwrap_or_default()
}

#[test]
fn a_baseline_is_beside_the_methods_and_in_no_mean() {
    let folder = tempfile::tempdir().unwrap();
    let records = records();
    write_report(folder.path(), &records, &header(&METHODS)).unwrap();
    let without = read(folder.path(), "tables/summary.md");
    assert!(!folder.path().join("tables/baseline.md").exists());

    let all = [
        baseline("bear", 2000, 0.0123),
        baseline("dolphin", 2000, 0.0123),
        baseline("bear", 400, 0.0345),
        baseline("another", 2000, 0.9),
    ];
    write_lines(&folder.path().join(BASELINES), &all).unwrap();
    assert_eq!(read_lines::<Baseline>(&folder.path().join(BASELINES)).unwrap(), all);
    let written = write_report(folder.path(), &records, &header(&METHODS)).unwrap();
    assert_eq!(read(folder.path(), "tables/summary.md"), without);
    let table = read(folder.path(), "tables/baseline.md");
    assert!(table.contains("| 2,000 | baseline | decimator 1.0 | 2 | 1.23 |"), "{table}");
    // Not every mesh has a baseline of 400 numbers, and another mesh's is of no use.
    assert!(!table.contains("| 400 | baseline") && !table.contains("another"), "{table}");
    assert!(table.contains("| bear | 400 | 399 |"), "{table}");
    let page = read(folder.path(), "index.html");
    assert!(page.contains("id=\"baseline\"") && page.contains("not a medial method"));
    for plot in
        ["overview-numbers-hausdorff", "overview-numbers-mean", "mesh-bear-numbers-hausdorff"]
    {
        let path = folder.path().join(format!("plots/{plot}.svg"));
        assert!(written.contains(&path), "{plot}");
        assert!(fs::read_to_string(path).unwrap().contains("baseline"), "{plot}");
    }
    // Gone with its file.
    fs::remove_file(folder.path().join(BASELINES)).unwrap();
    write_report(folder.path(), &records, &header(&METHODS)).unwrap();
    assert!(!read(folder.path(), "index.html").contains("id=\"baseline\""));
    assert!(!folder.path().join("plots/mesh-bear-numbers-hausdorff.svg").exists());
}

#[test]
fn noisy_results_are_averaged_by_level() {
    let folder = tempfile::tempdir().unwrap();
    let records = records();
    let span = |value: f64| AxisSpan {
        computed_to_true_max: value,
        computed_to_true_mean: value,
        true_to_computed_max: value,
        true_to_computed_mean: value,
    };
    let shift = |value| AxisShift { in_space: span(value), with_radius: span(2.0 * value) };
    let noisy = |noise: f64, seed: u64, by: f64| {
        records.iter().filter(|r| r.status.is_ok()).map(move |record| NoiseRecord {
            noise,
            noise_seed: seed,
            growth: Some(1.0 + noise),
            shift: (noise > 0.0).then(|| shift(by)),
            record: record.clone(),
        })
    };
    let all: Vec<NoiseRecord> =
        noisy(0.0, 0, 0.0).chain(noisy(0.005, 1, 0.02)).chain(noisy(0.005, 2, 0.08)).collect();
    write_lines(&folder.path().join(STABILITY), &all).unwrap();
    write_report(folder.path(), &records, &header(&METHODS)).unwrap();
    let table = read(folder.path(), "tables/stability.md");
    // The geometric mean of 2 % and 8 %, and of twice as much with radii.
    let row = table.lines().find(|line| line.starts_with("| 500 | qmat | 0.5 | 4 of 4"));
    let row = row.unwrap_or_else(|| panic!("{table}"));
    assert!(row.contains("| 4.00 | 4.00 | 8.00 | 8.00 |"), "{row}");
    assert!(table.contains("| 500 | qmat | 0 | 2 of 2 |"), "{table}");
    assert!(folder.path().join("plots/overview-noise-hausdorff-500.svg").exists());
    assert!(read(folder.path(), "index.html").contains("id=\"stability\""));
}

#[test]
fn oracles_are_a_table() {
    let folder = tempfile::tempdir().unwrap();
    let rows = r#"{"made": "today", "rows": [
        {"metric": "betti", "oracle": "GUDHI", "input": "<box>", "result": "[1, 0, 0]", "agrees": "yes"},
        {"metric": "mean", "oracle": "CGAL", "input": "box", "result": "none", "agrees": "skipped"}]}"#;
    fs::write(folder.path().join(ORACLES), rows).unwrap();
    write_report(folder.path(), &records(), &header(&METHODS)).unwrap();
    let page = read(folder.path(), "index.html");
    assert!(page.contains("GUDHI") && page.contains("&lt;box&gt;"));
    assert!(page.contains("2 comparisons, 0 of them in disagreement, 1 skipped"));
    fs::write(folder.path().join(ORACLES), "{").unwrap();
    let broken = write_report(folder.path(), &records(), &header(&METHODS)).unwrap_err();
    assert!(broken.to_string().contains("oracles.json"), "{broken}");
}
