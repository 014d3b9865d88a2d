//! A study becomes a planned folder.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use medial::write_atomically;
use sha2::{Digest, Sha256};

use super::{BLOCK, Block, FORMAT, ITEMS, MESHES, PLAN, Plan, Planned, PlannedError, io_error};
use crate::run::public::Library;
use crate::run::{Item, Provenance, Source, Study, StudyError, hex, hex_digest};

/// Name of the study beside its items.
const STUDY: &str = "study.toml";

/// The set that needs no file.
const BUILT_INS: &str = "builtin";

/// What an item of a plan is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Division {
    /// A method on a mesh, at all levels: what is done once for all of them is done once.
    ByMethod,
    /// One level: the smallest piece of work that there is.
    ByLevel,
}

/// Refuses a study with parts that cannot be carried to another machine.
///
/// # Errors
/// [`PlannedError::Study`], which names them.
pub fn check_travels(study: &Study) -> Result<(), PlannedError> {
    if let Some(plugin) = study.plugins.first() {
        return Err(PlannedError::Study(format!(
            "{}: a plan takes no plug-ins, since what their programs need cannot be carried along; run those methods \
             with `medial compare`",
            plugin.display()
        )));
    }
    if let Some(given) = study.given.first() {
        return Err(PlannedError::Study(format!(
            "given `{}`: there is nothing to plan where a file is judged; take it in with `medial compare --given` and \
             the same --out once the plan has been collected",
            given.name
        )));
    }
    Ok(())
}

/// Writes a planned folder: inputs, study and items, and `plan.json` last, so that a folder with one is complete. The
/// same study into the same folder again changes nothing.
///
/// # Errors
/// When the study has plug-ins, another plan lies in the folder, or a file cannot be read or written.
pub fn write_plan(
    dir: &Path,
    study: &Study,
    items: &[Item],
    division: Division,
    provenance: &Provenance,
) -> Result<Planned, PlannedError> {
    check_travels(study)?;
    fs::create_dir_all(dir.join(MESHES)).map_err(io_error(dir))?;
    let places = places(items);
    let path = dir.join(ITEMS);
    let earlier = match Planned::open(dir) {
        Err(PlannedError::NotPlanned(_)) => None,
        earlier => Some(earlier?.plan),
    };
    let mut plan = Plan {
        format: FORMAT,
        command: provenance.command.clone(),
        version: provenance.version.clone(),
        binary: provenance.binary_hash.clone(),
        items: 0,
        levels: 0,
        blocks: vec![],
    };
    let mut another = false;
    let written = write_atomically(&path, |out| {
        write_items(out, items, &places, division, &mut plan)?;
        // Found out before the rename: the items of the other plan stay.
        another = earlier.as_ref().is_some_and(|earlier| !same_work(earlier, &plan));
        if another { Err(io::Error::other("another plan")) } else { Ok(()) }
    });
    if another {
        return Err(PlannedError::Another(dir.to_owned()));
    }
    written.map_err(io_error(&path))?;
    copy_meshes(dir, items, &places)?;
    if let Some(plan) = earlier {
        return Ok(Planned { dir: dir.to_owned(), plan });
    }
    write_study(dir, study, &places)?;
    let text = serde_json::to_string(&plan).map_err(|error| io_error(&path)(error.into()))?;
    let path = dir.join(PLAN);
    write_atomically(&path, |out| writeln!(out, "{text}")).map_err(io_error(&path))?;
    Ok(Planned { dir: dir.to_owned(), plan })
}

/// Whether two plans are of the same items for the same program, whatever command made them.
fn same_work(a: &Plan, b: &Plan) -> bool {
    (&a.binary, a.items, &a.blocks) == (&b.binary, b.items, &b.blocks)
}

/// Where the inputs lie in the folder, by their own paths.
type Places = BTreeMap<PathBuf, PathBuf>;

fn places(items: &[Item]) -> Places {
    let place = |item: &Item| {
        let (path, hash) = (item.scene.source.path()?, item.scene.hash.as_ref()?);
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        let name = extension.map_or(hash.clone(), |extension| format!("{hash}.{extension}"));
        Some((path.to_owned(), Path::new(MESHES).join(name)))
    };
    items.iter().filter_map(place).collect()
}

fn copy_meshes(dir: &Path, items: &[Item], places: &Places) -> Result<(), PlannedError> {
    let mut copied = BTreeSet::new();
    for item in items {
        if let (Some(path), Some(hash)) = (item.scene.source.path(), &item.scene.hash)
            && copied.insert(path)
        {
            copy_mesh(path, hash, &dir.join(&places[path]))?;
        }
    }
    Ok(())
}

fn copy_mesh(from: &Path, hash: &str, to: &Path) -> Result<(), PlannedError> {
    if fs::read(to).is_ok_and(|bytes| hex_digest(&bytes) == hash) {
        return Ok(());
    }
    let bytes = fs::read(from).map_err(io_error(from))?;
    if hex_digest(&bytes) != hash {
        return Err(PlannedError::Study(format!(
            "{}: the file changed while it was planned; plan it again",
            from.display()
        )));
    }
    write_atomically(to, |out| out.write_all(&bytes)).map_err(io_error(to))
}

/// Writes the lines and completes the plan, item by item: those of a plan by level are never in memory together.
fn write_items(
    out: &mut dyn Write,
    items: &[Item],
    places: &Places,
    division: Division,
    plan: &mut Plan,
) -> io::Result<()> {
    let (mut block, mut offset) = (Vec::new(), 0);
    for item in items {
        let mut item = item.clone();
        if let Some(path) = item.scene.source.path() {
            let place = places.get(path).ok_or(io::ErrorKind::NotFound)?;
            item.scene.source = item.scene.source.moved(place.clone());
        }
        for part in parts(item, division) {
            serde_json::to_writer(&mut block, &part)?;
            block.push(b'\n');
            plan.items += 1;
            plan.levels += part.levels.len();
            if plan.items.is_multiple_of(BLOCK) {
                write_block(out, &mut block, &mut offset, plan)?;
            }
        }
    }
    if block.is_empty() { Ok(()) } else { write_block(out, &mut block, &mut offset, plan) }
}

fn parts(item: Item, division: Division) -> Vec<Item> {
    match division {
        Division::ByMethod => vec![item],
        Division::ByLevel => {
            let levels = item.levels.iter();
            levels.map(|&level| Item { levels: vec![level], ..item.clone() }).collect()
        }
    }
}

fn write_block(
    out: &mut dyn Write,
    block: &mut Vec<u8>,
    offset: &mut u64,
    plan: &mut Plan,
) -> io::Result<()> {
    out.write_all(block)?;
    let bytes = block.len() as u64;
    plan.blocks.push(Block { offset: *offset, bytes, sha256: hex(&Sha256::digest(&*block)) });
    *offset += bytes;
    block.clear();
    Ok(())
}

/// Writes the study with the meshes as they lie in the folder; comments say which one was which.
fn write_study(dir: &Path, study: &Study, places: &Places) -> Result<(), PlannedError> {
    let meshes =
        travelling_meshes(study, places).map_err(|error| PlannedError::Study(error.to_string()))?;
    let mut travelling = Study { folder: None, meshes, ..study.clone() };
    travelling.dataset.retain(|word| word == BUILT_INS);
    let text = travelling.to_text(None).map_err(|error| PlannedError::Study(error.to_string()))?;
    let path = dir.join(STUDY);
    let written = write_atomically(&path, |out| {
        for (from, to) in places {
            let name = from.file_name().unwrap_or_default().to_string_lossy();
            writeln!(out, "# {} was {}", to.display(), name.escape_debug())?;
        }
        out.write_all(text.as_bytes())
    });
    written.map_err(io_error(&path))
}

/// The meshes of a study as they lie in the folder, those of the library too, which another host may not have.
fn travelling_meshes(study: &Study, places: &Places) -> Result<Vec<PathBuf>, StudyError> {
    let place = |path: &Path| places.get(path).cloned();
    let of_source = |source: &Source| {
        source.path().and_then(place).unwrap_or_else(|| PathBuf::from(source.to_string()))
    };
    let mut meshes = Vec::new();
    for mesh in &study.meshes {
        meshes.push(match Source::is_name(mesh) {
            true => of_source(&Source::parse(mesh)?),
            false => place(&study.resolved(mesh)).unwrap_or_else(|| mesh.clone()),
        });
    }
    for word in study.dataset.iter().filter(|&word| word != BUILT_INS) {
        meshes.extend(Library::here()?.sources(word)?.iter().map(of_source));
    }
    Ok(meshes)
}
