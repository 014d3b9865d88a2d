//! The pictures of a report: for each mesh the results of all methods, from one camera and in three dimensions.

use std::collections::BTreeMap;
use std::path::Path;

use medial::complex::MedialMesh;
use medial::write_atomically;
use medial_reports::render::{Background, Camera, ColourBy, Errors, Panel, Strip, strip};
use medial_reports::{PictureStrip, View3d, picture_strips};
use medial_run::input::{Input, Source};
use medial_run::record::{Record, file_inside};
use rayon::prelude::*;

/// Pixels of a panel, and panels in a row: a page of usual width shows them at about their size.
const PANEL: [usize; 2] = [236, 192];
const ACROSS: usize = 6;

/// Draws the strips of some records, whose medial meshes are in one folder, into another one. Strips whose input is missing or changed are
/// skipped, and the reasons returned. Existing strips are not drawn again: their names identify their content.
pub fn draw(dirs: [&Path; 2], records: &[Record], sources: &[Source]) -> Vec<String> {
    let mut strips = picture_strips(records);
    // Names contain a hash of the content: an existing file is the right one.
    let is_missing = |file: &str| !dirs.iter().any(|dir| dir.join(file).exists());
    strips.retain(|strip| is_missing(&strip.file) || is_missing(&strip.view_file()));
    if strips.is_empty() {
        return vec![];
    }
    let inputs: BTreeMap<String, Input> = (sources.par_iter())
        .filter_map(|source| Input::load(source).ok())
        .map(|input| (input.hash.clone(), input))
        .collect();
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

fn draw_strip(
    [from, to]: [&Path; 2],
    wanted: &PictureStrip,
    input: Option<&Input>,
) -> Result<(), String> {
    let input = input.ok_or("the measured surface is missing or has changed")?;
    let mut axes = Vec::new();
    for (artifact, _) in &wanted.panels {
        let path = file_inside(from, artifact);
        let path = path.ok_or_else(|| format!("{artifact}: not inside the folder"))?;
        let loaded = medial::complex::read(&path);
        axes.push(loaded.map_err(|error| format!("{}: {error}", path.display()))?.mesh);
    }
    let captions = wanted.panels.iter().map(|(_, caption)| caption.clone());
    let view = View3d::new(&input.mesh, captions.zip(&axes).collect())?;
    write(&to.join(&wanted.file), &picture(wanted, input, &axes, &view)?)?;
    write(&to.join(wanted.view_file()), view.script(&wanted.view).as_bytes())
}

/// The strip as PNG: medial meshes, and below them the surface with the errors of each.
fn picture(
    wanted: &PictureStrip,
    input: &Input,
    axes: &[MedialMesh],
    view: &View3d<'_>,
) -> Result<Vec<u8>, String> {
    let panels: Vec<Panel<'_>> = axes
        .iter()
        .zip(&wanted.panels)
        .zip(view.errors())
        .map(|((axis, (_, caption)), errors)| {
            let errors = Some(Errors { caption: caption.clone(), ..errors });
            Panel { axis, caption: caption.clone(), errors }
        })
        .collect();
    let (lo, hi) = input.mesh.bounding_box().unwrap_or_default();
    let common = Strip {
        surface: &input.mesh,
        diagonal: lo.distance(hi),
        camera: Camera::fitting(&input.mesh),
        size: PANEL,
        across: ACROSS,
        background: Background::WHITE,
        colour: ColourBy::Radius,
        max_error: None,
    };
    let picture = strip(&panels, &common).map_err(|error| error.to_string())?;
    picture.to_png().map_err(|error| error.to_string())
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), String> {
    // The report creates this folder, but is written later.
    let folder = path.parent().unwrap_or(path);
    let written = std::fs::create_dir_all(folder)
        .and_then(|()| write_atomically(path, |out| out.write_all(bytes)));
    written.map_err(|error| format!("{}: {error}", path.display()))
}
