//! The verb `check`: all methods of the project pass the conformance corpus, and broken methods fail.

use serde_json::Value;

use crate::command::{Folder, faulty};

const PLUGINS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/plugins/largest.toml");

/// The exit code and the object of `check`, which a busy machine must not fail.
fn check(line: &str) -> (i32, Value) {
    Folder::new().json(&format!("check --timeout 1800 {line}"))
}

/// Cases with this outcome, as `method case: reason`.
fn ended(object: &Value, outcome: &str) -> Vec<String> {
    let cases = object["cases"].as_array().expect("a list");
    let cases = cases.iter().filter(|case| case["outcome"] == outcome);
    let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    let line = |case: &Value| {
        format!("{} {}: {}", text(&case["method"]), text(&case["case"]), text(&case["reason"]))
    };
    cases.map(line).collect()
}

#[track_caller]
fn assert_passes((code, object): (i32, Value), methods: usize) {
    assert_eq!(ended(&object, "failed"), Vec::<String>::new());
    assert_eq!(ended(&object, "skipped"), Vec::<String>::new());
    let cases = medial_bench::check::cases().len();
    assert_eq!((code, object["passed"].as_u64()), (0, Some((methods * cases) as u64)));
}

#[test]
#[ignore = "many minutes; run nightly"]
fn all_built_in_methods_pass() {
    let on_request = medial_methods::registry().into_iter().filter(|m| m.presentation.on_request);
    let all = medial_methods::registry().len();
    assert_passes(check(""), all - on_request.count());
}

#[test]
fn fast_methods_pass() {
    assert_passes(check("angle lambda qmat pmat"), 4);
}

/// On each push every method passes the fast cases, and nightly all of them.
#[test]
fn every_method_passes_the_core_cases() {
    let ids: Vec<String> =
        medial_methods::registry().iter().map(|m| m.method.info().id.to_string()).collect();
    let cases = "--case report --case no-spheres --case valid-box";
    let (code, object) = check(&format!("{} {cases}", ids.join(" ")));
    assert_eq!(ended(&object, "failed"), Vec::<String>::new());
    assert_eq!((code, object["passed"].as_u64()), (0, Some(3 * ids.len() as u64)), "{object}");
}

/// `compare --seeds` runs only such methods with each seed.
#[test]
fn a_method_whose_result_depends_on_the_seed_is_declared_seeded() {
    let (code, object) = check("vmas --set iterations=20 --case repeated");
    assert_eq!((code, ended(&object, "failed")), (0, vec![]));
}

#[test]
#[ignore = "minutes; run nightly"]
fn variants_pass() {
    assert_passes(check("angle --set variant=facet"), 1);
    // Without a limit of rounds it takes minutes for a sphere count that it cannot reach.
    assert_passes(check("vmas --set iterations=20"), 1);
}

#[test]
#[cfg(unix)]
fn a_program_in_shell_passes() {
    assert_passes(check(&format!("largest-awk --plugins {PLUGINS}")), 1);
}

#[test]
fn a_program_in_python_passes() {
    if !medial_test_support::has_numpy() {
        return;
    }
    assert_passes(check(&format!("largest --plugins {PLUGINS}")), 1);
}

/// Method, case that finds its fault, part of the reason, case that it passes.
const FAULTY: [(&str, &str, &str, &str); 11] = [
    ("panics", "valid-torus", "this method panics at 20 spheres", "no-spheres"),
    (
        "loops",
        "valid-torus",
        "timed out after 3 s during the case; rerun with a larger",
        "repeated",
    ),
    ("allocates", "valid-torus", "more than 1500 MB", "scale"),
    ("grows", "valid-parts", "more than 1500 MB", "report"),
    ("overflows", "valid-box", "stack overflow during the case", "report"),
    ("aborts", "defaults", "SIGABRT", "report"),
    ("exits", "published", "exit code 0", "report"),
    ("invalid", "valid-sphere", "radius NaN", "published"),
    ("empty", "counts", "no sphere", "published"),
    ("random", "repeated", "another result in a second run", "valid-sphere"),
    ("random", "continuing", "another result after other levels", "valid-sphere"),
];

#[test]
fn faulty_methods_are_found_and_the_rest_continues() {
    for (method, finds, words, passes) in FAULTY {
        // Methods that end by themselves, or by their memory, may take longer on a busy machine.
        let timeout = if method == "loops" { "3" } else { "60" };
        let (code, object) = Folder::of(faulty()).json(&format!(
            "check {method} --case {finds} --case {passes} --timeout {timeout} --memory 1500"
        ));
        assert_eq!(code, 3, "{object}");
        let [found] = &ended(&object, "failed")[..] else { panic!("{object}") };
        assert!(found.starts_with(&format!("{method} {finds}: ")), "{found}");
        assert!(found.contains(words), "{found}");
    }
}

#[test]
fn methods_that_print_unusual_output_pass() {
    assert_passes(Folder::of(faulty()).json("check talks --timeout 1800"), 1);
}

#[test]
fn each_case_prints_a_line() {
    let text = Folder::new().done("check qmat --case report --case no-spheres");
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 3, "{text}");
    assert!(lines[0].starts_with("qmat           report") && lines[0].ends_with("s  ok"), "{text}");
    assert_eq!(lines[2], "2 cases: 2 ok, 0 failed, 0 skipped");
}
