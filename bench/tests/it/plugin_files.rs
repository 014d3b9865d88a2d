//! Plug-in files: wrong declarations are refused with their line, and changes alter the fingerprint.
#![cfg(unix)]

use std::fs;
use std::path::Path;

use medial_bench::plugin::{self, PluginFault};

use crate::plugins::{VALID, entry, written};

#[test]
fn a_changed_script_or_declaration_has_another_fingerprint() {
    let toml = entry(r#"["sh", "run.sh", "{output}", "{spheres}"]"#, r#"["spheres"]"#, "");
    let (folder, path) = written(&toml, &[("run.sh", VALID)]);
    let fingerprint = || plugin::load(&path, &[]).expect("a plug-in")[0].fingerprint().to_owned();
    let first = fingerprint();
    assert!(first.len() == 64 && first == fingerprint());
    fs::write(folder.path().join("run.sh"), format!("{VALID}#")).expect("written");
    let second = fingerprint();
    fs::write(&path, toml.replace("title = \"X\"", "title = \"Y\"")).expect("written");
    let third = fingerprint();
    assert!(first != second && second != third && first != third);
    // The same files in another folder are the same plug-in.
    let (_elsewhere, path) = written(&toml, &[("run.sh", VALID)]);
    assert_eq!(plugin::load(&path, &[]).expect("a plug-in")[0].fingerprint(), first);
}

/// The fault of a declaration and its line.
fn refused(toml: &str) -> (Option<usize>, PluginFault, String) {
    let (_folder, path) = written(toml, &[("run.sh", VALID)]);
    let error = plugin::load(&path, &[]).expect_err(toml);
    let text = error.to_string();
    assert!(text.contains("plugins.toml"), "{text}");
    (error.line, error.fault, text)
}

#[test]
fn wrong_declarations_are_refused_with_their_line() {
    use PluginFault as Fault;
    let good = r#"["sh", "run.sh", "{output}", "{spheres}"]"#;
    let spheres = r#"["spheres"]"#;
    let command = |words: &str| entry(words, spheres, "");
    let more = |lines: &str| entry(good, spheres, lines);
    type Is = fn(&Fault) -> bool;
    let cases: [(String, usize, Is); 21] = [
        (more("colour = 1"), 6, |f| matches!(f, Fault::UnknownKey(_))),
        (more("params = [{ name = \"k\", defualt = 1 }]"), 6, |f| {
            matches!(f, Fault::UnknownKey(_))
        }),
        (more("title = "), 6, |f| matches!(f, Fault::Toml(_))),
        (command("[]"), 4, |f| matches!(f, Fault::EmptyCommand)),
        (command(r#"["no-such-program", "{output}", "{spheres}"]"#), 4, |f| {
            matches!(f, Fault::NoProgram { .. })
        }),
        (command(r#"["./run.sh", "{output}", "{spheres}"]"#), 4, |f| {
            matches!(f, Fault::NoProgram { .. })
        }),
        (command(r#"["{k}", "{output}", "{spheres}"]"#), 4, |f| {
            matches!(f, Fault::ProgramPlaceholder(_))
        }),
        (command(r#"["sh", "run.sh", "{spheres}"]"#), 4, |f| matches!(f, Fault::NoOutput)),
        (command(r#"["sh", "{output}"]"#), 5, |f| matches!(f, Fault::LevelNotPassed("spheres"))),
        (command(r#"["sh", "{output", "{spheres}"]"#), 4, |f| matches!(f, Fault::Brace(_))),
        (command(r#"["sh", "{output}", "{spheres}", "{native}"]"#), 4, |f| {
            matches!(f, Fault::LevelNotDeclared("native"))
        }),
        (command(r#"["sh", "{output}", "{spheres}", "{depth}"]"#), 4, |f| {
            matches!(f, Fault::UnknownPlaceholder { .. })
        }),
        (more("params = [{ name = \"k\", default = 1 }]"), 6, |f| {
            matches!(f, Fault::UnusedParam(_))
        }),
        (more("params = [{ name = \"seed\", default = 1 }]"), 6, |f| {
            matches!(f, Fault::ReservedParam(_))
        }),
        (more("params = [{ name = \"k\", default = [1] }]"), 6, |f| matches!(f, Fault::Default(_))),
        (
            more("params = [{ name = \"k\", default = 1 },\n{ name = \"k\", default = 2 }]"),
            7,
            |f| matches!(f, Fault::DuplicateParam(_)),
        ),
        (entry(good, "[]", ""), 5, |f| matches!(f, Fault::NoLevels)),
        (entry(good, r#"["spheres", "native"]"#, ""), 5, |f| matches!(f, Fault::NoNative)),
        (entry(good, r#"["balls"]"#, ""), 5, |f| matches!(f, Fault::UnknownKey(_))),
        (command(good).replace("\"x\"", "\"My X\""), 2, |f| matches!(f, Fault::Id(_))),
        (command(good) + &command(good), 8, |f| matches!(f, Fault::DuplicateId(_))),
    ];
    for (toml, at, is) in cases {
        let (line, fault, text) = refused(&toml);
        assert!(is(&fault), "{toml}: {text}");
        assert_eq!(line, Some(at), "{toml}: {text}");
    }
    assert!(matches!(refused("").1, Fault::NoMethod));
    let missing = refused("[[method]]\nid = \"x\"\n").2;
    assert!(missing.contains("missing field"), "{missing}");
    assert!(plugin::load(Path::new("no/such/file.toml"), &[]).is_err());
    let all = r#"["sh", "run.sh", "{output}"]"#;
    let (_folder, path) = written(&entry(all, r#"["published"]"#, ""), &[("run.sh", VALID)]);
    assert!(plugin::load(&path, &[]).is_ok());
}
