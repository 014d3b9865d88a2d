//! `medial datasets fetch`, `add` and `survey`: meshes of packages and of the user, kept by name.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use medial::write_atomically;
use medial_datasets::published::{PackageKind, Published};
use serde_json::json;

use crate::args::Global;
use crate::exit::{Exit, Failure};
use crate::interrupt;
use crate::output::{counted, note, print_json, print_line};
use crate::run::public::{
    Clients, FetchedPackage, Kin, Library, PublicError, Refusal, State, fetch_archive,
    fetch_package, survey,
};

#[derive(Debug, Args)]
pub(super) struct Fetch {
    /// What to fetch: `public`, `defective`, `small`, a package as in `deb:libcgal-demo`, or names of meshes.
    #[arg(default_value = "public")]
    wanted: Vec<String>,
    /// Take meshes from an archive that is here already (.deb, .whl, .zip, .tgz, .tar.gz, .tar.xz, .tar.zst) and fetch
    /// nothing; can be given several times.
    #[arg(long, value_name = "ARCHIVE")]
    from: Vec<PathBuf>,
    /// End a client (apt-get, pip, npm) after so many seconds.
    #[arg(long, value_name = "SECONDS", default_value_t = 600.0)]
    timeout: f64,
}

#[derive(Debug, Args)]
pub(super) struct Add {
    /// Surface file (OFF, OBJ, PLY, STL).
    file: PathBuf,
    /// Its name [default: that of the published mesh that it is, else the file's].
    #[arg(long)]
    name: Option<String>,
}

#[derive(Debug, Args)]
pub(super) struct Survey {
    /// The catalogue whose packages are surveyed.
    catalogue: PathBuf,
    /// Folder of the files that no package holds.
    #[arg(long, value_name = "DIR")]
    files: PathBuf,
    /// Where the new catalogue is written.
    #[arg(short, long)]
    output: PathBuf,
}

/// Fetches what is missing of the meshes wanted.
///
/// # Errors
/// When nothing has a name that was given, an archive is refused, or a file cannot be written. A package that cannot be
/// had is told, and the others go on.
pub(super) fn fetch(arguments: &Fetch, global: &Global) -> Result<Exit, Failure> {
    let limit =
        Duration::try_from_secs_f64(arguments.timeout).ok().filter(|limit| !limit.is_zero());
    let Some(limit) = limit else {
        let message = format!("--timeout {}: a positive number of seconds", arguments.timeout);
        return Err(Failure::usage(message));
    };
    let library = Library::here()?;
    let mut wanted: Vec<&Published> = Vec::new();
    for word in &arguments.wanted {
        wanted.extend(library.wanted(word)?);
    }
    let mut seen = BTreeSet::new();
    wanted.retain(|mesh| seen.insert(&mesh.name));
    let mut all = FetchedPackage::default();
    for archive in &arguments.from {
        join(&mut all, fetch_archive(&library, archive)?, global);
    }
    if arguments.from.is_empty() {
        let clients = Clients { limit, interrupted: interrupt::listen() };
        packages(&library, &wanted, clients, &mut all, global)?;
    }
    finish(&library, &wanted, all, global)
}

/// Fetches the packages of which something is missing.
fn packages(
    library: &Library,
    wanted: &[&Published],
    clients: Clients<'_>,
    all: &mut FetchedPackage,
    global: &Global,
) -> Result<(), Failure> {
    for package in &library.catalogue.packages {
        let id = package.id();
        let mut missing = 0;
        for mesh in wanted.iter().filter(|mesh| mesh.package == id) {
            missing += usize::from(library.state(mesh)? != State::Here);
        }
        if missing == 0 {
            continue;
        }
        if package.kind == PackageKind::File {
            let meshes = counted(missing as u64, "mesh");
            let message = "no package holds them; `medial datasets add FILE` takes them in";
            note(global, &format!("{}: {meshes} missing: {message}", package.name));
            continue;
        }
        note(global, &format!("{package}: fetching, {} missing", counted(missing as u64, "mesh")));
        join(all, fetch_package(library, package, clients)?, global);
    }
    Ok(())
}

/// Takes what came of a package to the rest, and tells what is to be told.
fn join(all: &mut FetchedPackage, one: FetchedPackage, global: &Global) {
    one.remarks.iter().for_each(|remark| note(global, remark));
    let mut told: Vec<&str> = Vec::new();
    for Refusal { name, why } in &one.refused {
        // A client that is not there is one message, not one for each mesh.
        let others = one.refused.iter().filter(|refusal| refusal.why == *why).count();
        match others {
            1 => note(global, &format!("{name}: {why}")),
            _ if told.contains(&why.as_str()) => {}
            others => note(global, &format!("{}: {why}", counted(others as u64, "mesh"))),
        }
        told.push(why);
    }
    all.kept.extend(one.kept);
    all.refused.extend(one.refused);
    all.remarks.extend(one.remarks);
}

fn finish(
    library: &Library,
    wanted: &[&Published],
    all: FetchedPackage,
    global: &Global,
) -> Result<Exit, Failure> {
    let mut missing = Vec::new();
    for mesh in wanted {
        if library.state(mesh)? != State::Here {
            missing.push(&mesh.name);
        }
    }
    let mut here = 0;
    for mesh in &library.catalogue.meshes {
        here += usize::from(library.state(mesh)? == State::Here);
    }
    let verified = wanted.len() - missing.len();
    if global.json {
        let refused: Vec<_> = all
            .refused
            .iter()
            .map(|refusal| json!({"name": refusal.name, "why": refusal.why}))
            .collect();
        let object = json!({
            "cache": library.folder(), "wanted": wanted.len(), "verified": verified, "here": here,
            "fetched": all.kept, "missing": missing, "refused": refused,
        });
        print_json(&object, &all.remarks);
    } else {
        print_line(&format!(
            "{verified} of {} meshes here and verified, {} fetched now; {here} of the catalogue in {}",
            wanted.len(),
            all.kept.len(),
            library.folder().display()
        ));
    }
    Ok(if missing.is_empty() { Exit::Done } else { Exit::SomeFailed })
}

/// Copies a user's file into the library, and tells what it is.
///
/// # Errors
/// When it cannot be read, is no surface, or its name cannot be used.
pub(super) fn add(arguments: &Add, global: &Global) -> Result<Exit, Failure> {
    let library = Library::here()?;
    let (added, known) = library.add(&arguments.file, arguments.name.as_deref())?;
    let package = known.and_then(|(mesh, _)| library.catalogue.package_of(mesh));
    if global.json {
        let by = known.map(|(_, kin)| match kin {
            Kin::File => "file",
            Kin::Surface => "surface",
        });
        let mut object = json!(added);
        object["recognised_by"] = json!(by);
        object["package"] = json!(known.map(|(mesh, _)| &mesh.package));
        object["licence"] = json!(package.map(|package| &package.licence));
        object["argument"] = json!(format!("dataset:{}", added.name));
        print_json(&object, &[]);
        return Ok(Exit::Done);
    }
    let what = match known {
        None => "not a mesh of the catalogue".to_owned(),
        Some((mesh, kin)) => {
            let how = match kin {
                Kin::File => "by its bytes",
                Kin::Surface => "by its surface; the file is another",
            };
            let licence = package.map_or("not stated", |package| &package.licence);
            format!(
                "{} of the set {} ({how}); {}; licence: {licence}",
                mesh.name, mesh.set, mesh.package
            )
        }
    };
    print_line(&format!(
        "{}: {what}\n{} vertices, {} faces; kept as `dataset:{}`",
        arguments.file.display(),
        added.vertices,
        added.faces,
        added.name
    ));
    if let Some(why) = &added.refused {
        note(global, &format!("it is refused as an input: {why}"));
    }
    Ok(Exit::Done)
}

/// Makes the catalogue anew.
///
/// # Errors
/// When a package or a file cannot be had, or the catalogue cannot be written.
pub(super) fn make_catalogue(arguments: &Survey, global: &Global) -> Result<Exit, Failure> {
    let clients = Clients { limit: Duration::from_secs(600), interrupted: interrupt::listen() };
    let survey = survey(&arguments.catalogue, &arguments.files, clients)?;
    survey.left_out.iter().for_each(|line| note(global, &format!("left out: {line}")));
    let failed = |message| PublicError::Catalogue { path: arguments.output.clone(), message };
    survey.catalogue.check().map_err(failed)?;
    let text = survey.catalogue.to_text().map_err(failed)?;
    write_atomically(&arguments.output, |out| out.write_all(text.as_bytes()))
        .map_err(|error| Failure::input(format!("{}: {error}", arguments.output.display())))?;
    print_line(&format!(
        "{} meshes in {}",
        survey.catalogue.meshes.len(),
        arguments.output.display()
    ));
    Ok(Exit::Done)
}
