//! Plug-ins: correct and faulty programs.
//!
//! Programs are shell scripts, so these tests need a POSIX `sh`.
#![cfg(unix)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use medial::complex::MedialMesh;
use medial::shape::{Shape, ShapeOptions, Substrate};
use medial::simplifier::{Level, MedialSimplifier, Params, RunContext, Simplified, SimplifyError};
use medial::surface;
use medial_bench::plugin::{self, External, SCRATCH};
use medial_run::record::OwnSeconds;
use medial_run::timed::ProgramPeak;
use medial_test_support::skip;
use tempfile::TempDir;

use crate::command::{pid_in, runs};

/// Writes a file of plug-ins into a new folder.
fn written(toml: &str, files: &[(&str, &str)]) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, text) in files {
        fs::write(folder.path().join(name), text).expect("written");
    }
    let path = folder.path().join("plugins.toml");
    fs::write(&path, toml).expect("written");
    (folder, path)
}

/// A declaration with one entry and further lines.
fn entry(command: &str, levels: &str, more: &str) -> String {
    format!(
        "[[method]]\nid = \"x\"\ntitle = \"X\"\ncommand = {command}\nlevels = {levels}\n{more}\n"
    )
}

/// Two balls and the edge between them, somewhere in the shape.
const VALID: &str = "printf '2 1 0\\nv 0 0 0 0.5\\nv 0.1 0 0 0.5\\ne 0 1\\n' > \"$1\"\n";

fn shape() -> Shape {
    let mesh = medial_datasets::find("capsule").expect("in the catalogue").mesh(12);
    let report = surface::validate(&mesh).expect("a solid");
    Shape::new("capsule", &mesh, report, ShapeOptions::default()).expect("an extent")
}

/// A plug-in that is a shell script, called with the output and the number of spheres.
fn script(text: &str) -> (TempDir, External) {
    let command = r#"["sh", "run.sh", "{output}", "{spheres}"]"#;
    let (folder, path) = written(&entry(command, r#"["spheres"]"#, ""), &[("run.sh", text)]);
    let mut loaded = plugin::load(&path, &[]).expect("a plug-in");
    (folder, loaded.remove(0))
}

fn simplify(
    method: &External,
    shape: &Shape,
    set: &[(&str, &str)],
    level: Level,
) -> Result<Simplified, SimplifyError> {
    let mut params = Params::none();
    set.iter().for_each(|(key, value)| params.set(key, value));
    method.prepare(shape, &params, &RunContext::with_seed(7))?.at(level)
}

/// The outcome of a script at ten spheres.
fn outcome(text: &str) -> Result<Simplified, SimplifyError> {
    let (_folder, method) = script(text);
    simplify(&method, &shape(), &[], Level::Spheres(10))
}

fn valid_and(more: &str) -> Result<Simplified, SimplifyError> {
    outcome(&format!("{VALID}{more}"))
}

fn example(id: &str) -> External {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/plugins/largest.toml");
    let all = plugin::load(Path::new(path), &[]).expect("the example");
    all.into_iter().find(|method| method.info().id == id).expect("in the example")
}

/// The largest balls of the initial mesh, as the examples keep them.
fn largest(shape: &Shape, count: usize) -> MedialMesh {
    let initial = shape.initial().expect("an initial mesh");
    let mut order: Vec<usize> = (0..initial.spheres.len()).collect();
    // Radii as they are written, in input units.
    let diagonal = shape.normalisation().diagonal;
    let radius = |i: usize| initial.spheres[i].radius * diagonal;
    order.sort_by(|&a, &b| radius(b).total_cmp(&radius(a)).then(a.cmp(&b)));
    let mut keep = vec![false; order.len()];
    order[..count].iter().for_each(|&i| keep[i] = true);
    initial.induced(&keep)
}

fn assert_keeps_the_largest(method: &External) -> Simplified {
    let shape = shape();
    let view = shape.view();
    let result = simplify(method, &view, &[], Level::Spheres(40)).expect("forty spheres");
    let expected = largest(&shape, 40);
    assert_eq!(result.mesh.edges, expected.edges);
    assert_eq!(result.mesh.faces, expected.faces);
    for (here, there) in result.mesh.spheres.iter().zip(&expected.spheres) {
        assert!(here.centre.distance(there.centre) < 1e-15);
        assert!((here.radius - there.radius).abs() < 1e-15);
    }
    assert!(view.used().iter().any(|(substrate, _)| *substrate == Substrate::MedialMesh));
    assert_eq!(result.native_level, None);
    assert!(result.diagnostics.warnings.is_empty(), "{:?}", result.diagnostics.warnings);
    assert!(result.extras.get::<ProgramPeak>().is_some());
    result
}

#[test]
fn the_example_in_shell_keeps_the_largest_balls() {
    assert_keeps_the_largest(&example("largest-awk"));
}

#[test]
fn the_example_in_python_keeps_the_largest_balls_and_reports_its_seconds() {
    if !medial_test_support::has_numpy() {
        return;
    }
    let method = example("largest");
    let result = assert_keeps_the_largest(&method);
    let seconds = result.extras.get::<OwnSeconds>().expect("own seconds");
    assert!(seconds.prepare.is_some() && seconds.simplify.is_some());
    let none = simplify(&method, &shape(), &[("least", "1e9")], Level::Spheres(5));
    assert!(matches!(none, Err(SimplifyError::Failed(why)) if why.contains("no ball has")));
}

#[test]
fn a_program_gets_the_placeholders_of_its_command() {
    let command = r#"["sh", "run.sh", "{surface}", "{output}", "s={spheres},n={native}", "{seed}", "{threads}", "{k}", "{{k}}"]"#;
    let more = "native = { name = \"t\", unit = \"mm\", larger_is_coarser = true }\n\
                params = [{ name = \"k\", default = \"1e-5\" }]";
    let text =
        "head -n 1 \"$1\" > got; shift\nout=$1; shift\necho \"$@\" >> got\nset -- \"$out\"\n";
    let script = format!("{text}{VALID}echo '{{\"native_level\": 4}}'\n");
    let toml = entry(command, r#"["spheres", "native"]"#, more);
    let (folder, path) = written(&toml, &[("run.sh", &script)]);
    let method = plugin::load(&path, &[]).expect("a plug-in").remove(0);
    let got = || fs::read_to_string(folder.path().join("got")).expect("a file");
    let view = shape();
    let threads = rayon::current_num_threads();
    let result = simplify(&method, &view, &[], Level::Spheres(3)).expect("two spheres");
    assert_eq!(got(), format!("OFF\ns=3,n= 7 {threads} 1e-5 {{k}}\n"));
    assert_eq!((result.mesh.spheres.len(), result.native_level), (2, Some(4.0)));
    // No placeholder requires the initial mesh: it is not computed.
    assert!(view.used().is_empty());
    let native = simplify(&method, &view, &[("k", "0.25")], Level::Native(0.5)).expect("a level");
    assert_eq!(got(), format!("OFF\ns=,n=0.5 7 {threads} 0.25 {{k}}\n"));
    assert_eq!(native.asked, Level::Native(0.5));
    let published = simplify(&method, &view, &[], Level::Published);
    let expected = "x has no published level; give --spheres N or --level X";
    assert!(matches!(published, Err(SimplifyError::Unsupported { why }) if why == expected));
    for set in [("k", "many"), ("k", "[1]"), ("other", "1")] {
        let refused = simplify(&method, &view, &[set], Level::Spheres(3));
        assert!(matches!(refused, Err(SimplifyError::Parameter(why)) if why.contains(set.0)));
    }
    for level in [Level::Spheres(0), Level::Native(f64::NAN)] {
        assert!(matches!(simplify(&method, &view, &[], level), Err(SimplifyError::Level(_))));
    }
}

#[test]
fn results_are_carried_into_normalised_units() {
    let shape = shape();
    let result = valid_and("echo '{\"warnings\": [\"thin\"], \"what\": 1}'").expect("two spheres");
    let normal = shape.normalisation();
    let ball = result.mesh.spheres[1];
    assert_eq!(ball.centre, normal.forward(medial::Vec3::new(0.1, 0.0, 0.0)));
    assert!((ball.radius - 0.5 / normal.diagonal).abs() < 1e-15);
    let warnings = &result.diagnostics.warnings;
    assert!(warnings[0] == "thin" && warnings[1].contains("`what`"), "{warnings:?}");
}

#[test]
fn exit_codes_and_signals_have_different_errors() {
    let unsupported = outcome("echo 'only genus 0' >&2; exit 65");
    assert!(
        matches!(unsupported, Err(SimplifyError::Unsupported { why }) if why == "only genus 0")
    );
    let failed = outcome("echo log >&2; echo 'no such sphere' >&2; exit 3").expect_err("code 3");
    assert!(matches!(failed, SimplifyError::Failed(_)));
    assert_eq!(failed.to_string(), "failed: x: exit code 3: no such sphere");
    for (script, words) in [("kill -9 $$", "out of memory"), ("kill -SEGV $$", "SIGSEGV")] {
        let crashed = outcome(script).expect_err(script);
        assert!(
            matches!(&crashed, SimplifyError::Crashed(why) if why.contains(words)),
            "{crashed}"
        );
    }
}

#[test]
fn outputs_without_a_medial_mesh_are_invalid() {
    let cases = [
        ("exit 0", "{output}: no file"),
        ("mkdir \"$1\"", "{output}: not a regular file"),
        ("echo garbage > \"$1\"", "line 1"),
        ("printf '1 0 0\\nv 0 0 NaN 1\\n' > \"$1\"", "NaN"),
        ("printf '1 0 0\\nv 0 0 0 -1\\n' > \"$1\"", "negative"),
        ("printf '2 0 0\\nv 0 0 0 1\\n' > \"$1\"", "announces 2 spheres"),
        ("printf '1 0 0\\nv 0 0 0 1e30\\n' > \"$1\"", "units"),
        ("printf '1 0 0\\nv 1e308 0 0 1\\n' > \"$1\"", ""),
        ("truncate -s 1000000001 \"$1\" || exit 9", "expected at most 1000000000"),
        ("ln -s /dev/zero \"$1\"", "{output}: not a regular file"),
        ("head -c 100000 /dev/urandom > \"$1\"", ""),
    ];
    for (script, words) in cases {
        let refused = outcome(script).expect_err(script);
        let text = refused.to_string();
        assert!(matches!(refused, SimplifyError::InvalidOutput(_)), "{script}: {text}");
        assert!(text.contains(words) && !text.contains("output.ma"), "{script}: {text}");
    }
}

#[test]
fn an_earlier_output_does_not_pass_for_the_next() {
    let (_folder, method) = script(&format!("test \"$2\" = 9 && exit 0\n{VALID}"));
    let shape = shape();
    let mut prepared =
        method.prepare(&shape, &Params::none(), &RunContext::default()).expect("prepared");
    assert!(prepared.at(Level::Spheres(10)).is_ok());
    assert!(matches!(prepared.at(Level::Spheres(9)), Err(SimplifyError::InvalidOutput(_))));
}

#[test]
fn a_gigabyte_of_messages_is_read_in_little_memory() {
    let before = medial_bench::provenance::peak_bytes().unwrap_or(0);
    let text = "head -c 1000000000 /dev/zero >&2; echo; echo '{\"native_level\": 1}'";
    assert_eq!(valid_and(text).expect("two spheres").native_level, Some(1.0));
    let after = medial_bench::provenance::peak_bytes().unwrap_or(0);
    assert!(after < before + 300_000_000, "{before} {after}");
}

#[test]
fn orphans_of_a_program_are_killed_and_reported() {
    if !Path::new("/proc/self/stat").exists() {
        skip("no /proc");
        return;
    }
    let has_setsid = Command::new("setsid").arg("true").output().is_ok();
    // The parent of the second has ended, and the third has also left the process group.
    let mut ways = vec!["sleep 1000 & echo $! > pid", "(sleep 1000 & echo $! > pid)"];
    if has_setsid {
        // Outside a worker, which adopts orphans, only an earlier listing below the program has it.
        ways.push("(setsid sh -c 'echo $$ > pid; exec sleep 1000' & sleep 0.3)");
        // It has no environment either, but was listed.
        ways.push(
            "env -i PATH=\"$PATH\" setsid sh -c 'echo $$ > pid; exec sleep 1000' & sleep 0.3",
        );
    } else {
        skip("in part: no setsid");
    }
    for way in ways {
        let (folder, method) = script(&format!("{VALID}{way}\n"));
        let start = Instant::now();
        let result = simplify(&method, &shape(), &[], Level::Spheres(10)).expect("two spheres");
        assert!(start.elapsed() < Duration::from_secs(20), "{way}");
        let warnings = result.diagnostics.warnings.join("; ");
        assert!(warnings.contains("the program left running: 1"), "{way}: {warnings}");
        assert!(!runs(pid_in(&folder.path().join("pid"))), "{way}");
    }
}

#[test]
fn a_cancelled_program_ends_with_all_that_it_started() {
    let (folder, method) = script("sleep 1000 & echo $! > pid\nwhile :; do :; done\n");
    let shape = shape();
    let run = RunContext::default();
    let flag = run.cancel_flag();
    let mut prepared = method.prepare(&shape, &Params::none(), &run).expect("prepared");
    let pid = folder.path().join("pid");
    let canceller = std::thread::spawn({
        let pid = pid.clone();
        move || {
            pid_in(&pid);
            flag.store(true, Ordering::Relaxed);
        }
    });
    assert!(matches!(prepared.at(Level::Spheres(10)), Err(SimplifyError::Cancelled)));
    canceller.join().expect("cancelled");
    assert!(!runs(pid_in(&pid)));
}

#[test]
fn the_memory_of_a_program_and_its_children_is_measured() {
    if !Path::new("/proc/self/stat").exists() {
        skip("no /proc");
        return;
    }
    // A child of the shell that holds about 50 MB for a while.
    let text =
        "head -c 50000000 /dev/zero | tr '\\0' a | { sort -S 200M -z; sleep 0.3; } > /dev/null";
    let peak = valid_and(text).expect("two spheres").extras.get::<ProgramPeak>().copied();
    assert!(peak.is_some_and(|peak| peak.0 > 40_000_000 && peak.0 < 2_000_000_000), "{peak:?}");
}

/// Run by the test below in a new process, since all tests share the environment.
#[test]
#[ignore = "requires an environment variable"]
fn scratch_probe() {
    let scratch = PathBuf::from(std::env::var_os(SCRATCH).expect("a folder"));
    let (folder, method) = script(&format!("{VALID}echo \"$1\" > got\n"));
    simplify(&method, &shape(), &[], Level::Spheres(10)).expect("two spheres");
    let got = fs::read_to_string(folder.path().join("got")).expect("a file");
    assert!(Path::new(got.trim()).starts_with(&scratch), "{got}");
    assert_eq!(fs::read_dir(scratch).expect("a folder").count(), 0, "files remain");
}

#[test]
fn temporary_files_are_in_the_scratch_folder_and_removed() {
    let scratch = tempfile::tempdir().expect("a folder");
    let probe = Command::new(std::env::current_exe().expect("this program"))
        .args(["--ignored", "--exact", "plugin::scratch_probe"])
        .env(SCRATCH, scratch.path())
        .output()
        .expect("runs");
    let printed = String::from_utf8_lossy(&probe.stdout);
    assert!(probe.status.success() && printed.contains("1 passed"), "{printed}");
}

#[test]
fn a_changed_script_or_declaration_has_another_fingerprint() {
    let toml = entry(r#"["sh", "run.sh", "{output}", "{spheres}"]"#, r#"["spheres"]"#, "");
    let (folder, path) = written(&toml, &[("run.sh", VALID)]);
    let fingerprint = || plugin::load(&path, &[]).expect("a plug-in")[0].fingerprint.clone();
    let first = fingerprint();
    assert!(first.len() == 64 && first == fingerprint());
    fs::write(folder.path().join("run.sh"), format!("{VALID}#")).expect("written");
    let second = fingerprint();
    fs::write(&path, toml.replace("title = \"X\"", "title = \"Y\"")).expect("written");
    let third = fingerprint();
    assert!(first != second && second != third && first != third);
    // Files inside of words count if the declaration lists them, and give a warning otherwise.
    let inside = toml.replace("\"run.sh\"", "\"-c\", \"./run.sh; x=run.sh\"");
    let listed = format!("{inside}files = [\"run.sh\"]\n");
    let of = |toml: &str| {
        fs::write(&path, toml).expect("written");
        let method = plugin::load(&path, &[]).expect("a plug-in").remove(0);
        (method.fingerprint.clone(), method.remark())
    };
    let before = [of(&inside), of(&listed)];
    fs::write(folder.path().join("run.sh"), VALID).expect("written");
    assert!(of(&inside) == before[0] && of(&listed).0 != before[1].0 && before[1].1.is_none());
    assert!(before[0].1.as_ref().is_some_and(|remark| remark.contains("./run.sh, run.sh")));
    // The same files in another folder are the same plug-in.
    let (_elsewhere, path) = written(&toml, &[("run.sh", VALID)]);
    assert_eq!(plugin::load(&path, &[]).expect("a plug-in")[0].fingerprint, first);
}

/// A wrong declaration is refused with its line and the reason.
#[test]
fn wrong_declarations_are_refused_with_their_line() {
    let good = r#"["sh", "run.sh", "{output}", "{spheres}"]"#;
    let spheres = r#"["spheres"]"#;
    let command = |words: &str| entry(words, spheres, "");
    let more = |lines: &str| entry(good, spheres, lines);
    let params = |list: &str| more(&format!("params = [{list}]"));
    let cases = [
        (more("colour = 1"), 6, "unknown field `colour`"),
        (params("{ name = \"k\", defualt = 1 }"), 6, "unknown field `defualt`"),
        (more("title = "), 6, ""),
        (command("[]"), 4, "the command is empty"),
        (command(r#"["no-such-program", "{output}", "{spheres}"]"#), 4, "in PATH"),
        (command(r#"["./run.sh", "{output}", "{spheres}"]"#), 4, "that can be executed"),
        (
            command(r#"["{k}", "{output}", "{spheres}"]"#),
            4,
            "the program \"{k}\" has a placeholder",
        ),
        (command(r#"["sh", "run.sh", "{spheres}"]"#), 4, "no argument has {output}"),
        (command(r#"["sh", "{output}"]"#), 5, "no argument has {spheres}"),
        (command(r#"["sh", "{output", "{spheres}"]"#), 4, "a brace"),
        (command(r#"["sh", "{output}", "{spheres}", "{native}"]"#), 4, "levels has no \"native\""),
        (command(r#"["sh", "{output}", "{spheres}", "{depth}"]"#), 4, "{depth} is neither"),
        (params("{ name = \"k\", default = 1 }"), 6, "no argument has {k}"),
        (params("{ name = \"seed\", default = 1 }"), 6, "`seed` is the name of a placeholder"),
        (params("{ name = \"k\", default = [1] }"), 6, "`k` has a wrong default"),
        (params("{ name = \"k\", default = 1 },\n{ name = \"k\", default = 2 }"), 7, "above"),
        (entry(good, "[]", ""), 5, "no level is declared"),
        (entry(good, r#"["spheres", "native"]"#, ""), 5, "describe it"),
        (entry(good, r#"["balls"]"#, ""), 5, "unknown variant `balls`"),
        (command(good).replace("\"x\"", "\"My X\""), 2, "invalid id (found \"My X\""),
        (command(good).replace("\"x\"", "\"-\""), 2, "invalid id (found \"-\""),
        (more("files = [\"none\"]"), 6, "not a regular file"),
        (command(good) + &command(good), 8, "a method above has the id `x`"),
        ("[[method]]\nid = \"x\"\n".to_owned(), 1, "missing field"),
    ];
    for (toml, line, words) in cases {
        let (_folder, path) = written(&toml, &[("run.sh", VALID)]);
        let error = plugin::load(&path, &[]).expect_err(&toml);
        let text = error.to_string();
        assert!(text.contains("plugins.toml") && text.contains(words), "{toml}: {text}");
        assert_eq!(error.line, Some(line), "{toml}: {text}");
    }
    let (_folder, path) = written("", &[]);
    let error = plugin::load(&path, &[]).expect_err("nothing is declared");
    assert!(error.line.is_none() && error.message.contains("[[method]]"), "{error}");
    assert!(plugin::load(Path::new("no/such/file.toml"), &[]).is_err());
    let all = r#"["sh", "run.sh", "{output}"]"#;
    let (_folder, path) = written(&entry(all, r#"["published"]"#, ""), &[("run.sh", VALID)]);
    assert!(plugin::load(&path, &[]).is_ok());
}
