//! Plug-ins: a program, a Python script. Each appears in tables, plots, page and `medial methods` like the built-in
//! methods. (The third kind, a Rust crate, has its test in `examples/plugin-crate`.)

use std::fs;

use crate::command::Folder;

/// Compares methods on a box. Each must have results, a line in the CSV, a curve in a plot, and its title on the page.
fn compares(plugins: &str, methods: &[(&str, &str)]) {
    let at = Folder::new();
    let ids = methods.iter().map(|(id, _)| *id).collect::<Vec<_>>().join(",");
    let options = "--spheres 30,20 --samples 200 --counts-only --quiet --out out";
    at.done(&format!("compare builtin:box:8 --methods {ids},qmat {options} --plugins {plugins}"));
    let records = at.records("out");
    let [page, csv, table] = ["index.html", "results.csv", "tables/summary.md"]
        .map(|name| at.text(format!("out/{name}")));
    let plots = fs::read_dir(at.at("out/plots")).expect("plots").flatten();
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
    let listed = at.done(&format!("methods --plugins {plugins}"));
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
    compares(file, &methods);
}

#[test]
fn an_id_that_is_taken_is_refused() {
    let at = Folder::new();
    let text = "[[method]]\nid = \"ID\"\ntitle = \"Mine\"\nlevels = [\"spheres\"]\n\
                command = [\"sh\", \"{output}\", \"{spheres}\"]\n";
    for id in ["qmat", "initial", "given"] {
        at.write("mine.toml", text.replace("ID", id));
        let why = format!("mine.toml, line 2: the id `{id}` is taken; choose another");
        at.refused("methods --plugins mine.toml", 2, &why);
    }
}
