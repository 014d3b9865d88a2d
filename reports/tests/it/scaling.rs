//! How time and memory grow with the input: tables and plots of a whole report.

use std::fs;

use super::common::{SHAPES, header, ok};
use medial_reports::{Record, write_report};
use tempfile::TempDir;

fn report_of(records: &[Record]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    write_report(folder.path(), records, &header(&["qmat", "angle", "tight"])).unwrap();
    folder
}

fn text(report: &TempDir, name: &str) -> String {
    fs::read_to_string(report.path().join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// Records at 100 spheres of some sizes, whose seconds and bytes are powers of them.
fn grown(method: &str, sizes: &[u64], exponent: f64) -> Vec<Record> {
    let record = |(index, &size): (usize, &u64)| {
        let mut record = ok(SHAPES[index], method, 100, index, 0);
        record.initial.as_mut().unwrap().spheres = size;
        record.simplify.cpu_seconds.as_mut().unwrap().total =
            0.5 * (size as f64 / 1e4).powf(exponent);
        record.simplify.peak_bytes = Some(3000 * size);
        record
    };
    sizes.iter().enumerate().map(record).collect()
}

#[test]
fn costs_grow_by_each_methods_own_records() {
    let mut records = grown("qmat", &[4000, 10_000, 20_000, 40_000], 1.25);
    let before = text(&report_of(&records), "tables/overview-scaling.md");
    let own = "| qmat | 4 of 4 | 4,000 to 40,000 | 1.25 ± 0.00 | 0.50 | 4 | 1.00 ± 0.00 | 30 | 4 |";
    assert!(before.contains(own), "{before}");
    records.extend(grown("angle", &[4000, 10_000, 20_000], 2.0));
    records.extend(grown("tight", &[4000, 5000, 6000, 7000], 2.0));
    let report = report_of(&records);
    let after = text(&report, "tables/overview-scaling.md");
    assert!(after.contains(own), "{after}");
    assert!(
        after.contains("| angle | 3 of 3 | 4,000 to 20,000 | too few meshes | – | 3 |"),
        "{after}"
    );
    assert!(after.contains("| sizes within a factor of 1.8 | – | 4 |"), "{after}");
    let page = text(&report, "index.html");
    for plot in ["overview-scaling", "overview-scaling-memory"] {
        let svg = text(&report, &format!("plots/{plot}.svg"));
        assert!(svg.contains("qmat x^1.") && svg.contains("<circle"), "{plot}");
        assert!(svg.contains("font-family=\"Helvetica, Arial, sans-serif\""), "{plot}");
    }
    assert!(
        page.contains("\"title\":\"spheres of the initial medial mesh\""),
        "points for the script"
    );
}

#[test]
fn one_mesh_has_no_growth() {
    let report = report_of(&grown("qmat", &[4000], 1.0));
    for name in ["tables/overview-scaling.md", "plots/overview-scaling.svg"] {
        assert!(!report.path().join(name).exists(), "{name}");
    }
}
