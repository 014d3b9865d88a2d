//! `medial datasets list`: built-in shapes, and the meshes of the library with their state.

use medial_datasets::BuiltIn;
use medial_datasets::published::{Published, Set};
use serde_json::{Value, json};

use crate::args::Global;
use crate::exit::Failure;
use crate::output::{print_json, print_line};
use crate::run::public::{Added, Library, State, added};

/// Lists everything that has a name.
///
/// # Errors
/// When the library cannot be read.
pub(super) fn list(global: &Global) -> Result<(), Failure> {
    let shapes = medial_datasets::catalogue();
    let library = Library::here()?;
    let states = library.catalogue.meshes.iter().map(|mesh| Ok((mesh, library.state(mesh)?)));
    let states = states.collect::<Result<Vec<_>, Failure>>()?;
    let own = added(&library)?;
    if global.json {
        let published: Vec<_> = states.iter().map(|&(m, s)| published(&library, m, s)).collect();
        let object = json!({
            "datasets": shapes.iter().map(shape).collect::<Vec<_>>(),
            "published": published, "added": own, "cache": library.folder(),
        });
        print_json(&object, &[]);
        return Ok(());
    }
    shapes.iter().for_each(print_shape);
    let in_default = shapes.iter().filter(|shape| shape.in_default).count();
    print_line(&format!(
        "compare and stability take the first {in_default} where no mesh is named"
    ));
    for set in Set::ALL {
        print_set(set, &states);
    }
    if !own.is_empty() {
        print_line("\nadded");
        own.iter().for_each(print_added);
    }
    Ok(())
}

fn shape(shape: &BuiltIn) -> Value {
    json!({
        "id": shape.id,
        "title": shape.title,
        "summary": shape.summary,
        "betti": shape.expected_betti,
        "default_resolution": shape.default_resolution,
        "known_axis": shape.axis().is_some(),
        "in_default": shape.in_default,
    })
}

fn published(library: &Library, mesh: &Published, state: State) -> Value {
    let mut object = json!(mesh);
    let package = library.catalogue.package_of(mesh);
    object["version"] = json!(package.version);
    object["licence"] = json!(package.licence);
    object["state"] = state.key().into();
    object["file"] = json!((state == State::Here).then(|| library.path(mesh)));
    object
}

fn print_shape(shape: &BuiltIn) {
    let axis = if shape.axis().is_some() { "axis known" } else { "" };
    print_line(&format!(
        "{:<14} betti {:?}  {axis:<10}  {}",
        shape.id, shape.expected_betti, shape.summary
    ));
}

fn print_set(set: Set, states: &[(&Published, State)]) {
    let of_set: Vec<_> = states.iter().filter(|(mesh, _)| mesh.set == set).collect();
    let here = of_set.iter().filter(|(_, state)| *state == State::Here).count();
    print_line(&format!("\n{set}: {here} of {} here; {}", of_set.len(), how(set)));
    for (mesh, state) in of_set {
        let vertices = mesh.vertices.map_or_else(|| "?".to_owned(), |count| count.to_string());
        let genus = mesh.genus.map_or_else(String::new, |genus| format!("genus {genus}"));
        let open = if mesh.closed == Some(false) { "open" } else { "" };
        let line = format!(
            "{:<24} {:<12} {vertices:>7} vertices  {genus:<9} {:<22} {open}",
            mesh.name,
            state.key(),
            mesh.package
        );
        print_line(line.trim_end());
    }
}

fn how(set: Set) -> &'static str {
    match set {
        Set::Public => "`medial datasets fetch public`, then `medial compare --dataset public`",
        Set::Defective => "refused or to be repaired: `medial datasets fetch defective`",
        Set::Small => "sound, of few vertices: `medial datasets fetch small`",
        Set::Papers => "models of papers, recognised by `medial datasets add FILE`",
    }
}

fn print_added(added: &Added) {
    let known = match &added.known {
        Some(known) => format!("is {known} ({})", added.set()),
        None => added.refused.clone().unwrap_or_default(),
    };
    let line = format!("{:<24} {:>7} vertices  {known}", added.name, added.vertices);
    print_line(line.trim_end());
}
