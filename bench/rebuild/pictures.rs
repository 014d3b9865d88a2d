//! The pictures of a report: for each mesh the results of all methods, from one camera and in three dimensions.

use std::collections::BTreeMap;
use std::path::Path;

use medial_reports::{PictureStrip, picture_strips};
use medial_run::input::{Input, Source};
use medial_run::journal::replace_file;
use medial_run::record::Record;
use rayon::prelude::*;

use crate::store::artifact_path;

/// Draws the strips of some records, whose medial meshes are in one folder, into another one. Strips whose input is
/// missing or changed are skipped, and the reasons returned. Existing strips are not drawn again: their names identify
/// their content.
pub fn draw(dirs: [&Path; 2], records: &[Record], sources: &[Source]) -> Vec<String> {
    let mut strips = picture_strips(records);
    // Names contain a hash of the content: an existing file is the right one.
    let is_missing = |file: &str| !dirs.iter().any(|dir| dir.join(file).exists());
    strips.retain(|strip| is_missing(&strip.file) || is_missing(&strip.view_file()));
    if strips.is_empty() {
        return vec![];
    }
    let inputs = inputs(sources);
    // Side by side: packing a picture takes one thread.
    (strips.par_iter())
        .filter_map(|wanted| {
            // By the hash of the surface that was measured.
            let input = wanted.mesh_hash.as_ref().and_then(|hash| inputs.get(hash));
            let why = draw_strip(dirs, wanted, input).err()?;
            Some(format!("no pictures of {}: {why}", wanted.mesh))
        })
        .collect()
}

/// The inputs that can be read, by the hash of their contents.
pub(crate) fn inputs(sources: &[Source]) -> BTreeMap<String, Input> {
    let inputs = sources.par_iter().filter_map(|source| Input::load(source).ok());
    inputs.map(|input| (input.hash.clone(), input)).collect()
}

fn draw_strip(
    [from, to]: [&Path; 2],
    wanted: &PictureStrip,
    input: Option<&Input>,
) -> Result<(), String> {
    let input = input.ok_or("the measured surface is missing or has changed")?;
    let mut axes = Vec::new();
    for (artifact, _) in &wanted.panels {
        let path = artifact_path(from, artifact);
        let path = path.ok_or_else(|| format!("{artifact}: not inside the folder"))?;
        let loaded = medial::complex::read(&path);
        axes.push(loaded.map_err(|error| format!("{}: {error}", path.display()))?.mesh);
    }
    let (png, script) = wanted.draw(&input.mesh, &axes)?;
    for (file, bytes) in [(&wanted.file, &*png), (&wanted.view_file(), script.as_bytes())] {
        replace_file(&to.join(file), bytes).map_err(|error| format!("{file}: {error}"))?;
    }
    Ok(())
}
