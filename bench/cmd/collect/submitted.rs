//! Taking in an archive that somebody else packed.

use std::fs;
use std::path::Path;

use medial_reports::{Origin, Record, Trust};
use serde_json::json;

use super::Arguments;
use crate::args::Global;
use crate::cmd::report;
use crate::exit::{Exit, Failure};
use crate::output::{counted, note, print_json, print_line};
use crate::run::{
    AXES, Opened, Provenance, RESULTS, Registry, Rejudged, Store, Surfaces, open, rejudge,
};

/// Names of what was found wrong in a message.
const MOST_NAMED: usize = 5;

/// Unpacks, measures again, and adds the records with a mark that tells what was checked. Nothing is added of an archive
/// in which anything is wrong.
///
/// # Errors
/// When the archive is refused, or the results cannot be written.
pub fn run(arguments: &Arguments, global: &Global, registry: &Registry) -> Result<Exit, Failure> {
    let share = arguments.rejudge;
    if !(0.0..=1.0).contains(&share) {
        return Err(Failure::usage(format!("--rejudge {share}: a share from 0 to 1")));
    }
    let Some(out) = &arguments.out else {
        return Err(Failure::usage("--out DIR: the folder that the records of an archive go to"));
    };
    let scratch = tempfile::tempdir().map_err(Failure::input)?;
    let opened = open(&arguments.dir, scratch.path())?;
    let surfaces = Surfaces::new(&opened, &arguments.meshes)?;
    let rejudged = rejudge(&opened, &surfaces, share);
    if !rejudged.wrong.is_empty() {
        return Err(refusal(&arguments.dir, &rejudged));
    }
    let provenance = Provenance::here();
    let mut store = Store::open(out, RESULTS, &provenance.command)?;
    store.remarks.iter().for_each(|remark| note(global, remark));
    let new = |record: &&Record| !store.has(&record.key);
    let records: Vec<Record> = opened.records.iter().filter(new).cloned().collect();
    let kept = records.into_iter().map(|record| placed(record, &opened, &rejudged, out));
    let kept = kept.collect::<Result<Vec<_>, _>>()?;
    store.keep(&kept)?;
    let found = opened.records.len() - kept.len();
    if !arguments.no_report {
        let rebuilt = report::refresh(out, registry, &provenance, kept.len())?;
        rebuilt.undrawn.iter().for_each(|why| note(global, why));
    }
    tell(&kept, found, &rejudged, out, global);
    Ok(Exit::Done)
}

fn refusal(archive: &Path, rejudged: &Rejudged) -> Failure {
    let wrong = &rejudged.wrong;
    let named = wrong.iter().take(MOST_NAMED).cloned().collect::<Vec<_>>().join("; ");
    let more = if wrong.len() > MOST_NAMED { "; ..." } else { "" };
    Failure::input(format!(
        "{}: refused: {} not as measured here, nothing was taken: {named}{more}",
        archive.display(),
        match wrong.len() {
            1 => "1 result is".to_owned(),
            many => format!("{many} results are"),
        }
    ))
}

/// The record with its origin, its medial mesh in the folder of results.
fn placed(
    mut record: Record,
    opened: &Opened,
    rejudged: &Rejudged,
    out: &Path,
) -> Result<Record, Failure> {
    let is_right = rejudged.right.contains(&record.key);
    let trust = if is_right { Trust::ReJudged } else { Trust::AsSubmitted };
    record.origin = Some(Origin { trust, archive: opened.hash.clone() });
    if let Some(from) = opened.axis(&record) {
        let place = format!("{AXES}/submitted-{:.12}/{:.12}.ma", opened.hash, record.key);
        let to = out.join(&place);
        let copied = to.parent().map_or(Ok(()), fs::create_dir_all).and_then(|()| {
            let bytes = fs::read(&from)?;
            medial::write_atomically(&to, |out| out.write_all(&bytes))
        });
        copied.map_err(|error| Failure::input(format!("{}: {error}", to.display())))?;
        record.artifact = Some(place);
    }
    Ok(record)
}

fn tell(kept: &[Record], found: usize, rejudged: &Rejudged, out: &Path, global: &Global) {
    let with = |trust| {
        let is = |record: &&Record| record.origin.as_ref().is_some_and(|o| o.trust == trust);
        kept.iter().filter(is).count()
    };
    let (checked, believed) = (with(Trust::ReJudged), with(Trust::AsSubmitted));
    let unknown: Vec<String> = (rejudged.unknown.iter())
        .map(|(mesh, records)| {
            let records = counted(*records as u64, "record");
            format!("{records} of {mesh}: its surface is not here, give it with --meshes")
        })
        .collect();
    if global.json {
        let object = json!({
            "out": out, "added": kept.len(), "found": found, "re_judged": checked,
            "as_submitted": believed,
        });
        print_json(&object, &unknown);
        return;
    }
    unknown.iter().for_each(|line| print_line(&format!("not measured again: {line}")));
    print_line(&format!(
        "{} added to {}: {checked} re-judged, {believed} as submitted; {found} were there already",
        counted(kept.len() as u64, "record"),
        out.join(RESULTS).display()
    ));
}
