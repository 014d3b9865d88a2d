//! Methods from elsewhere: a program, a Python script. Each stands in tables, plots, page and `medial methods`
//! beside the built-in ones. (The third way in, a crate of one's own, has its test in `examples/plugin-crate`.)

use std::fs;

use crate::common::{code, records, run, stderr};

const MEDIAL: &str = env!("CARGO_BIN_EXE_medial");

/// Compares methods on a box, and asks that each has results, a line in the CSV, a curve in a plot,
/// and its title on the page.
fn compares(plugins: &[&str], methods: &[(&str, &str)]) {
    let dir = tempfile::tempdir().expect("a folder");
    let out = dir.path().join("out");
    let ids = methods.iter().map(|(id, _)| *id).collect::<Vec<_>>().join(",") + ",qmat";
    let arguments = [
        &["compare", "builtin:box:8", "--methods", &ids, "--spheres", "30,20"][..],
        &["--samples", "200", "--counts-only", "--quiet", "--out", out.to_str().expect("UTF-8")],
        plugins,
    ];
    let output = run(MEDIAL, &arguments.concat());
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let records = records(&out);
    let page = fs::read_to_string(out.join("index.html")).expect("a page");
    let csv = fs::read_to_string(out.join("results.csv")).expect("a table");
    let table = fs::read_to_string(out.join("tables/summary.md")).expect("a table");
    let plots = fs::read_dir(out.join("plots")).expect("plots").flatten();
    let plots: Vec<String> =
        plots.map(|entry| fs::read_to_string(entry.path()).expect("a plot")).collect();
    for (id, title) in methods {
        let ok = |r: &&serde_json::Value| r["simplify"]["method"] == *id && r["status"] == "ok";
        assert_eq!(records.iter().filter(ok).count(), 2, "{id}");
        assert!(page.contains(title) && page.contains(id), "{id} is not on the page");
        assert!(csv.contains(&format!(",{id},")) || csv.contains(id), "{id} is not in the CSV");
        assert!(table.contains(id), "{id} is not in the table");
        assert!(plots.iter().any(|plot| plot.contains(id)), "{id} is in no plot");
    }
    let listed = run(MEDIAL, &[&["methods"][..], plugins].concat());
    let listed = String::from_utf8_lossy(&listed.stdout).into_owned();
    assert!(methods.iter().all(|(id, title)| listed.contains(id) && listed.contains(title)));
}

#[test]
#[cfg(unix)]
fn programs() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/plugins/largest.toml");
    let mut methods = vec![("largest-awk", "Largest balls first (POSIX shell and awk)")];
    if medial_test_support::has_numpy() {
        methods.push(("largest", "Largest balls first (Python)"));
    }
    compares(&["--plugins", file], &methods);
}

#[test]
fn an_id_that_is_taken_is_refused() {
    let dir = tempfile::tempdir().expect("a folder");
    let file = dir.path().join("mine.toml");
    let text = "[[method]]\nid = \"qmat\"\ntitle = \"Mine\"\nlevels = [\"spheres\"]\n\
                command = [\"sh\", \"{output}\", \"{spheres}\"]\n";
    fs::write(&file, text).expect("written");
    let output = run(MEDIAL, &["methods", "--plugins", file.to_str().expect("UTF-8")]);
    let message = stderr(&output);
    assert!(
        code(&output) == 2 && message.contains("mine.toml, line 2") && message.contains("`qmat`"),
        "{message}"
    );
}
