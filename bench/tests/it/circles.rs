//! Files of a crate that use each other in a circle, directly or not.
//!
//! A path such as `crate::a::Name` leads to the file that defines `Name`, through all re-exports. A module and
//! one of its ancestors may use each other, and so may tests.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// Names of modules from the root of a crate.
pub type Module = Vec<String>;

/// A file: the paths in it, and the names that its `use` declarations bring in.
#[derive(Default)]
struct Source {
    paths: Vec<Vec<String>>,
    names: BTreeMap<String, Vec<String>>,
}

/// The modules of a crate, each with those whose files it uses.
pub fn uses(root: &Path) -> BTreeMap<Module, BTreeSet<Module>> {
    let mut sources = BTreeMap::new();
    read(root, root, &mut sources);
    let used = |(module, source): (&Module, &Source)| {
        let used = source.paths.iter().filter_map(|path| resolve(&sources, module, path, 0));
        (module.clone(), used.cloned().collect())
    };
    sources.iter().map(used).collect()
}

/// The sets of modules whose files use each other, directly or not.
pub fn circles(root: &Path) -> Vec<BTreeSet<String>> {
    let mut uses = uses(root);
    for (module, used) in &mut uses {
        used.retain(|other| !other.starts_with(module) && !module.starts_with(other));
    }
    let reached: BTreeMap<_, _> =
        uses.keys().map(|module| (module, reachable(&uses, module))).collect();
    let circle = |module: &Module| {
        let others = reached[module].iter().filter(|other| reached[**other].contains(module));
        others.map(|other| other.join("::")).collect::<BTreeSet<_>>()
    };
    let found: BTreeSet<_> = uses.keys().map(circle).filter(|circle| !circle.is_empty()).collect();
    found.into_iter().collect()
}

fn reachable<'a>(
    uses: &'a BTreeMap<Module, BTreeSet<Module>>,
    from: &Module,
) -> BTreeSet<&'a Module> {
    let mut found = BTreeSet::new();
    let mut open: Vec<&Module> = uses[from].iter().collect();
    while let Some(module) = open.pop() {
        if found.insert(module) {
            open.extend(&uses[module]);
        }
    }
    found
}

fn read(root: &Path, folder: &Path, sources: &mut BTreeMap<Module, Source>) {
    for entry in fs::read_dir(folder).expect("a folder of sources") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        if path.is_dir() {
            // Separate crates have their own root.
            let is_apart =
                ["tests", "benches", "target"].contains(&&*name) || path.join("lib.rs").exists();
            if !is_apart {
                read(root, &path, sources);
            }
            continue;
        }
        let Some(stem) = name.strip_suffix(".rs") else { continue };
        let file = path.strip_prefix(root).expect("below the root").to_string_lossy();
        let mut module: Module = file.split('/').map(str::to_owned).collect();
        module.pop();
        match stem {
            "mod" | "lib" => {}
            "build" | "main" | "tests" | "source_hash" => continue,
            _ => module.push(stem.to_owned()),
        }
        sources.insert(module, parse(&fs::read_to_string(&path).expect("source text")));
    }
}

fn parse(text: &str) -> Source {
    let text = text.split("\n#[cfg(test)]\nmod ").next().expect("a first part");
    let code: Vec<&str> =
        text.lines().filter(|line| !line.trim_start().starts_with("//")).collect();
    let code = code.join("\n");
    let mut source = Source::default();
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    for start in ["use ", "crate::", "super::", "self::"] {
        for (place, _) in code.match_indices(start) {
            let before = code[..place].chars().next_back().unwrap_or(' ');
            if is_word(before) || [':', '$'].contains(&before) {
                continue;
            }
            let is_use = start == "use ";
            let mut found = Vec::new();
            tree(&code[place + if is_use { 4 } else { 0 }..], &[], &mut found);
            for (path, name) in found {
                if is_use {
                    source.names.insert(name, path.clone());
                }
                source.paths.push(path);
            }
        }
    }
    source
}

/// Adds the paths of a tree such as `a::{b, c::d as e}`, each with its last name, and returns the rest.
fn tree<'a>(text: &'a str, prefix: &[String], found: &mut Vec<(Vec<String>, String)>) -> &'a str {
    let text = text.trim_start();
    if let Some(mut rest) = text.strip_prefix('{') {
        while !rest.trim_start().starts_with('}') && !rest.is_empty() {
            let after = tree(rest, prefix, found).trim_start();
            rest = after.strip_prefix(',').unwrap_or(after);
            if !after.starts_with([',', '}']) {
                break;
            }
        }
        return rest.trim_start().strip_prefix('}').unwrap_or(rest);
    }
    let end = text.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(text.len());
    let (word, mut rest) = text.split_at(end);
    let mut path = prefix.to_vec();
    if word.is_empty() {
        return text.strip_prefix('*').unwrap_or(text);
    }
    // `a::{self}` is `a`.
    if word != "self" || prefix.is_empty() {
        path.push(word.to_owned());
    }
    if let Some(after) = rest.strip_prefix("::") {
        return tree(after, &path, found);
    }
    let mut name = path.last().cloned().unwrap_or_default();
    if let Some(after) = rest.strip_prefix(" as ") {
        let end = after.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(after.len());
        (name, rest) = (after[..end].to_owned(), &after[end..]);
    }
    found.push((path, name));
    rest
}

/// The module whose file defines the end of a path in another module; `None` outside the crate.
fn resolve<'a>(
    sources: &'a BTreeMap<Module, Source>,
    module: &Module,
    path: &[String],
    depth: usize,
) -> Option<&'a Module> {
    let mut at = module.clone();
    let mut rest = path;
    match path[0].as_str() {
        "crate" => (at, rest) = (Vec::new(), &path[1..]),
        "self" => rest = &path[1..],
        _ => {}
    }
    while rest.first().is_some_and(|name| name == "super") {
        at.pop();
        rest = &rest[1..];
    }
    let is_relative = rest.len() == path.len();
    for (k, name) in rest.iter().enumerate() {
        at.push(name.clone());
        if sources.contains_key(&at) {
            continue;
        }
        at.pop();
        let source = sources.get(&at)?;
        if let Some(other) = source.names.get(name)
            && depth < 9
            && other.as_slice() != path
        {
            return resolve(sources, &at, &[other, &rest[k + 1..]].concat(), depth + 1);
        }
        // A relative path that names no child begins with another crate.
        if is_relative && k == 0 {
            return None;
        }
        break;
    }
    sources.get_key_value(&at).map(|(module, _)| module)
}

#[test]
fn paths_lead_through_re_exports_to_the_files_that_define_names() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |file: &str, text: &str| {
        let path = folder.path().join(file);
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        fs::write(path, text).expect("a file");
    };
    write("lib.rs", "mod a;\nmod b;\npub use a::One;");
    write("a.rs", "use crate::b::{c::Two, Other as _};\npub struct One;");
    write("b/mod.rs", "mod c;\npub use c::Two;\npub struct Other;");
    write(
        "b/c.rs",
        "// crate::a::One\npub struct Two;\n\n#[cfg(test)]\nmod tests {\n    use crate::One;\n}",
    );
    assert!(circles(folder.path()).is_empty());
    // Through the root, and through the folder's module.
    write("b/c.rs", "pub struct Two(pub(crate) crate::One);");
    write("a.rs", "use super::b::Two;\npub struct One;");
    let expected = BTreeSet::from(["a".to_owned(), "b::c".to_owned()]);
    assert_eq!(circles(folder.path()), [expected]);
}
