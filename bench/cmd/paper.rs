//! `medial paper [ID ...]`: the tables and figures of the papers, repeated.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;
use medial_reports::published::{Exhibit, ReproducedRow, Reproduction, published};
use serde_json::json;

use crate::args::Global;
use crate::exit::{Exit, Failure};
use crate::interrupt;
use crate::output::{print_json, print_line};
use crate::run::{Here, Progress, Provenance, Registry, Reproducer, Study, Supervisor};

/// Arguments of `paper`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Tables and figures to repeat; without any, a list of all.
    ids: Vec<String>,
    /// Repeat all of them.
    #[arg(long, conflicts_with = "ids")]
    all: bool,
    /// Folder of the meshes that rows name [default: $MEDIAL_MESHES, else ./meshes].
    #[arg(long, value_name = "FOLDER")]
    meshes: Option<PathBuf>,
    /// Write the tables as Markdown into this file too.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Surface samples for errors, beside the mesh's vertices.
    #[arg(long, value_name = "N", default_value_t = 50_000)]
    samples: usize,
    /// End a run after so many seconds.
    #[arg(long, value_name = "SECONDS", default_value_t = 3600.0)]
    timeout: f64,
}

/// Runs the verb.
///
/// # Errors
/// When an id is unknown or the output cannot be written. Rows that cannot be run say why.
pub fn run(arguments: &Arguments, global: &Global, registry: &Registry) -> Result<Exit, Failure> {
    let exhibits = published();
    if arguments.ids.is_empty() && !arguments.all {
        list(&exhibits, global);
        return Ok(Exit::Done);
    }
    let chosen = choose(exhibits, arguments)?;
    let folder = arguments
        .meshes
        .clone()
        .or_else(|| std::env::var_os("MEDIAL_MESHES").map(PathBuf::from))
        .unwrap_or_else(|| PathBuf::from("meshes"));
    if let Some(output) = &arguments.output {
        check_folder(output)?;
    }
    let provenance = Provenance::here();
    let rows = chosen.iter().map(|exhibit| exhibit.rows.len()).sum();
    let mut progress = Progress::new(global.progress(), rows);
    let here = Here::of(&provenance);
    let limits = Study { timeout: arguments.timeout, ..Study::default() }.limits(&here);
    let supervisor = Supervisor::new(registry.files(), &provenance, None, interrupt::listen());
    let mut reproducer =
        Reproducer::new(&folder, arguments.samples, (registry, here), supervisor, limits);
    let mut done: Vec<Reproduction> = Vec::with_capacity(chosen.len());
    for exhibit in &chosen {
        let mut rows: Vec<ReproducedRow> = Vec::with_capacity(exhibit.rows.len());
        for row in &exhibit.rows {
            progress.at(&format!("{}: {}", exhibit.id, row.id));
            rows.push(reproducer.row(exhibit, row)?);
            progress.done();
        }
        done.push(Reproduction::new(exhibit, rows));
    }
    drop(progress);
    let text = markdown(&chosen, &done, &provenance);
    if let Some(output) = &arguments.output {
        medial::write_atomically(output, |out| out.write_all(text.as_bytes()))
            .map_err(|error| Failure::input(format!("{}: {error}", output.display())))?;
    }
    if global.json {
        print_json(&json!({ "exhibits": done, "machine": provenance.machine }), &[]);
    } else {
        print_line(text.trim_end());
    }
    let complete = chosen.iter().zip(&done).all(|(exhibit, ours)| ours.is_complete(exhibit));
    Ok(match done.iter().map(Reproduction::measured).sum::<usize>() {
        0 => Exit::NothingMeasured,
        _ if !complete => Exit::SomeFailed,
        _ => Exit::Done,
    })
}

fn list(exhibits: &[Exhibit], global: &Global) {
    if global.json {
        let object = |e: &Exhibit| json!({ "id": e.id, "source": e.source, "shows": e.shows, "rows": e.rows.len() });
        let objects: Vec<_> = exhibits.iter().map(object).collect();
        print_json(&json!({ "exhibits": objects }), &[]);
        return;
    }
    for exhibit in exhibits {
        print_line(&format!("{:<22} {}", exhibit.id, exhibit.source));
        print_line(&format!("{:<22} {}", "", exhibit.shows));
    }
}

fn choose(exhibits: Vec<Exhibit>, arguments: &Arguments) -> Result<Vec<Exhibit>, Failure> {
    if arguments.all {
        return Ok(exhibits);
    }
    let mut by_id: BTreeMap<String, Exhibit> =
        exhibits.into_iter().map(|exhibit| (exhibit.id.clone(), exhibit)).collect();
    let mut chosen: Vec<Exhibit> = Vec::new();
    for id in &arguments.ids {
        if chosen.iter().any(|exhibit| exhibit.id == *id) {
            continue;
        }
        chosen.push(by_id.remove(id).ok_or_else(|| {
            Failure::usage(format!("no table or figure is called `{id}`; `medial paper` lists all"))
        })?);
    }
    Ok(chosen)
}

fn check_folder(output: &Path) -> Result<(), Failure> {
    match output.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        Some(folder) if !fs::metadata(folder).is_ok_and(|m| m.is_dir()) => Err(Failure::input(
            format!("{}: there is no folder {}", output.display(), folder.display()),
        )),
        _ => Ok(()),
    }
}

fn markdown(exhibits: &[Exhibit], done: &[Reproduction], provenance: &Provenance) -> String {
    let mut text = format!(
        "# Published figures beside ours\n\nmedial {} on {}, {} threads. `{}`\n",
        provenance.version,
        provenance.machine,
        rayon::current_num_threads(),
        provenance.command
    );
    for (exhibit, ours) in exhibits.iter().zip(done) {
        text.push('\n');
        text.push_str(&ours.to_markdown(exhibit));
    }
    text
}
