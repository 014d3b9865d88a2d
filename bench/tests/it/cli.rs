//! The command: printed text, written files, exit codes.

use std::fs;

use crate::command::{Folder, ended};

/// Seconds and sizes that differ from run to run become `#`.
fn without_timings(text: &str) -> String {
    let words = text.split(' ').map(|word| {
        let number = word.trim_end_matches(['s', ',']);
        if number.contains('.') && number.parse::<f64>().is_ok() { "#" } else { word }
    });
    words.collect::<Vec<_>>().join(" ")
}

#[test]
fn help_names_every_verb() {
    insta::assert_snapshot!(Folder::new().done("--help"));
}

/// The options of a verb as rows of Markdown: name and value, help, default.
fn rows_of_options(verb: &clap::Command) -> String {
    let mut rows = String::new();
    for option in verb.get_arguments() {
        let Some(name) = option.get_long() else { continue };
        let mut call = format!("--{name}");
        let mut help = option.get_help().unwrap().to_string().replace('|', "\\|");
        if option.get_action().takes_values() {
            option
                .get_value_names()
                .iter()
                .flat_map(|names| *names)
                .for_each(|name| call += &format!(" {name}"));
            option
                .get_default_values()
                .iter()
                .for_each(|value| help += &format!(" [default: {}]", value.display()));
        }
        rows += &format!("| `{call}` | {help} |\n");
    }
    rows
}

#[test]
fn the_guide_has_every_option_of_compare() {
    let command = medial_bench::cli::command();
    let rows = rows_of_options(command.find_subcommand("compare").unwrap());
    let guide = include_str!("../../../docs/runner.md");
    assert!(rows.lines().count() > 25, "{rows}");
    assert!(guide.contains(&rows), "docs/runner.md needs these rows:\n{rows}");
}

#[test]
fn every_help_ends_with_examples_that_parse() {
    let command = medial_bench::cli::command();
    let verbs = command.get_subcommands().filter(|verb| !verb.is_hide_set());
    let verbs: Vec<&str> = verbs.map(clap::Command::get_name).collect();
    assert!(verbs.len() > 15, "{verbs:?}");
    for verb in verbs.into_iter().map(Some).chain([None]) {
        let help = Folder::new().done(&format!("{} --help", verb.unwrap_or_default()));
        let (_, examples) = help.split_once("\nExamples:\n").expect("a heading of examples");
        let examples: Vec<&str> = examples.lines().map_while(|l| l.strip_prefix("  ")).collect();
        assert!((2..=3).contains(&examples.len()), "{verb:?}: {examples:?}");
        let shown =
            verb.is_none_or(|verb| examples.iter().any(|e| e.split(' ').nth(1) == Some(verb)));
        assert!(shown, "no example runs {verb:?}: {examples:?}");
        for example in examples {
            let parsed = command.clone().try_get_matches_from(example.split(' '));
            parsed.unwrap_or_else(|error| panic!("{example}: {error}"));
        }
    }
}

#[test]
fn methods_and_their_parameters() {
    let at = Folder::new();
    insta::assert_snapshot!("methods", at.done("methods"));
    for id in ["qmat", "pmat", "hem", "angle"] {
        insta::assert_snapshot!(format!("methods_{id}"), at.done(&format!("methods {id}")));
    }
    let (code, _, stderr) = at.run("methods nothing");
    assert_eq!(code, 2);
    insta::assert_snapshot!("methods_unknown", stderr);
}

#[test]
fn datasets_are_listed() {
    // An empty cache, independent of the meshes that this machine has.
    let at = Folder::new();
    let output = at.command("datasets list").env("MEDIAL_CACHE", at.at("")).output();
    let (_, text, _) = ended(output.expect("the command starts"));
    let (shapes, published) = text.split_once("\n\n").expect("two lists");
    insta::assert_snapshot!(shapes);
    let public = published.lines().next().expect("a line");
    assert!(public.starts_with("public: 0 of ") && public.contains("fetch public"), "{public}");
}

#[test]
fn info_on_a_built_in_shape() {
    let at = Folder::new();
    insta::assert_snapshot!(at.done("info builtin:torus"));
    let (_, object) = at.json("info builtin:torus");
    for key in "vertices faces components genus closed manifold oriented self_intersecting degenerate_faces diagonal repairs"
        .split(' ') {
        assert!(!object[key].is_null(), "{key} is missing in {object}");
    }
}

#[test]
fn info_describes_a_mesh_that_it_refuses() {
    let at = Folder::new();
    let text = "OFF\n4 3 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n";
    at.write("open.off", text);
    let (code, object) = at.json("info open.off");
    assert_eq!(code, 1);
    assert_eq!(object["closed"], false);
    assert_eq!(object["boundary_edges"], 3);
    assert!(object["reason"].to_string().contains("open.off"), "{object}");
}

#[test]
fn threads_change_no_byte() {
    let at = Folder::new();
    let simplify = |method| format!("simplify builtin:blob --spheres 100 -m {method}");
    // Later commands read the file of the first one.
    let reconstruct = |method| {
        format!("reconstruct qmat-1.ma --mesh builtin:blob --tolerance 0.05 --method {method}")
    };
    let render = "render builtin:blob qmat-1.ma --size 203x151 --background transparent";
    for (name, line) in [
        ("qmat-%.ma", simplify("qmat")),
        ("pmat-%.ma", simplify("pmat")),
        ("hem-%.ma", simplify("hem")),
        ("sat-%.ma", simplify("sat-pairwise")),
        ("angle-%.ma", simplify("angle")),
        ("lambda-%.ma", simplify("lambda")),
        ("union-%.obj", reconstruct("union")),
        ("crust-%.obj", reconstruct("power-crust")),
        ("axis-%.png", render.to_owned()),
        ("error-%.png", format!("{render} --show error --tolerance 0.03")),
    ] {
        let written = ["1", "2"].map(|threads| {
            let file = name.replace('%', threads);
            at.done(&format!("{line} --threads {threads} -o {file}"));
            fs::read(at.at(file)).expect("written")
        });
        assert!(written[0] == written[1], "{line}");
    }
}

#[test]
fn printed_results() {
    let at = Folder::new();
    let simplified = at.done("simplify builtin:capsule --method qmat --spheres 20 -o qmat.ma");
    let default = "simplify builtin:box:8 --spheres 20 --set rounds=1 --set start=100 --set samples=500 -o x.ma";
    let default = at.done(default);
    assert!(default.starts_with("tight (default): 20 spheres"), "{default}");
    insta::assert_snapshot!("simplify", without_timings(&simplified));
    insta::assert_snapshot!("axis", without_timings(&at.done("axis builtin:capsule")));
}

#[test]
fn wrong_and_absurd_requests_are_refused_at_once() {
    let at = Folder::new();
    at.write("ball.ma", "1 0 0\nv 0 0 0 1\n");
    at.write("huge.ma", "1 0 0\nv 0 0 0 1e200\n");
    for (line, code, part) in [
        ("compare builtin:nothing --methods nothing", 2, ""),
        ("compare --spheres 0", 2, ""),
        ("compare --levels qmat", 2, ""),
        ("simplify builtin:box --method qmat --spheres 5 --set no=1 -o x.ma", 2, ""),
        ("simplify builtin:box --method angle --level 999 -o x.ma", 2, ""),
        ("axis builtin:box --sampling red:5", 2, ""),
        ("axis builtin:box:x", 2, ""),
        ("info builtin:box --threads 0", 2, ""),
        ("simplify no-such-file.off --method qmat", 1, "no-such-file.off"),
        ("info builtin:sphere:8 --threads 100000", 2, "1024"),
        ("evaluate builtin:sphere:8 ball.ma --samples 99999999999", 2, "10000000"),
        ("evaluate builtin:sphere:8 ball.ma --certify 1e-9", 2, "1e-6"),
        ("evaluate builtin:sphere:8 huge.ma", 1, "huge.ma: sphere 0"),
        ("simplify builtin:sphere:8 -m qmat -o no/such/x.ma", 1, "the folder does not exist"),
        ("simplify builtin:sphere:8 -m qmat -o x.xyz", 1, "(found \"xyz\", expected one of"),
        ("simplify builtin:sphere:8 -m qmat --max-error inf", 2, "inf"),
        ("simplify builtin:sphere:8 -m qmat --set k=x -o x.ma", 2, "k = \"x\""),
        ("simplify builtin:nothing -m qmat", 2, "`nothing`"),
        // With a suggestion.
        ("simplify builtin:sphere:8 -m qmat --max-error 5", 2, "write 0.05 for 5 %"),
        ("simplify builtin:sphere:8 -m qmat --max-error 1", 2, "write 0.01 for 1 %"),
        (
            "simplify builtin:sphere:8 -m hem --level inf -o x.ma",
            2,
            "inf: expected a number from 0",
        ),
        ("simplify builtin:sphere:8 -m qmta", 2, "did you mean `qmat`?"),
        ("simplify builtin:sphere:8 --level 60", 2, "no method: name one with --method ID"),
        ("simplify builtin:sphere:8", 2, "request --spheres N or --max-error E"),
        ("methods dey-zhoa", 2, "did you mean `dey-zhao`?"),
        ("info builtin:shpere", 2, "did you mean `sphere`?"),
        ("datasets make shpere -o x.off", 2, "did you mean `sphere`?"),
        ("info builtin:sphere:2000", 2, "about 4.2e6 vertices"),
        ("simplfy builtin:sphere:8", 2, "'simplify'"),
        ("check nothing", 2, "unknown method `nothing` (expected one of: angle"),
        ("check qmat --case nothing", 2, "(expected one of: report"),
        ("check qmat --set nothing=1", 2, "list them by `medial methods qmat`"),
        ("check qmat --timeout 0", 2, "positive"),
    ] {
        at.refused(line, code, part);
    }
}
