//! Which results the pictures show side by side.
//!
//! For each mesh one strip: the results of all methods at the count of [`answers`](crate::answers), with external results
//! at their counts, the least error first, and a 3D view of the same.
//! The caller has the surfaces and the medial meshes, which are not in the records.

use std::collections::BTreeMap;

use medial::complex::MedialMesh;
use medial::geometry::hash::splitmix;
use medial::surface::TriMesh;
use medial_run::record::{Record, Status};
use medial_run::text::{file_stems, grouped};

use crate::answers::usual_level;
use crate::comparison::{Comparison, Entry, reached};
use crate::metric::HAUSDORFF;
use crate::render::{Background, Camera, ColourBy, Errors, Layout, Panel, Strip, strip};
use crate::view3d::View3d;

/// Folders of the pictures and of the 3D views, next to the page.
pub(crate) const FOLDER: &str = "pictures";
pub(crate) const VIEWS: &str = "views";

/// Width and height of a panel in pixels, and panels in a row of the file. The page shows a panel smaller, so that it stays
/// sharp.
const PANEL: [usize; 2] = [320, 260];
const ACROSS: usize = 4;

/// A strip of pictures that a report shows if it finds it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PictureStrip {
    /// Name of the mesh.
    pub mesh: String,
    /// Hash of the input file or of the generated surface, as the records have it.
    pub mesh_hash: Option<String>,
    /// Path of the picture, relative to the folder of the report.
    pub file: String,
    /// The name of the 3D view of the same results.
    pub view: String,
    /// The medial meshes, by path relative to the folder of the report, and their captions.
    pub panels: Vec<(String, String)>,
}

/// The strips that belong to some records, in the order of the meshes; those without a medial mesh are left out.
pub fn picture_strips(records: &[Record]) -> Vec<PictureStrip> {
    let comparison = Comparison::new(records);
    strips(&comparison).into_values().collect()
}

impl PictureStrip {
    /// A name that depends on all results and their errors: a page never shows the picture of an earlier run next to
    /// the numbers of a later one.
    fn name(&mut self, stem: &str) {
        let bytes = self.panels.iter().flat_map(|(artifact, caption)| [artifact, caption]);
        let layout = format!("{PANEL:?} {ACROSS}"); // the page cuts panels out of the file
        let bytes = bytes.chain([&layout]).flat_map(|text| text.bytes().chain([0]));
        let hash = bytes.fold(0, |hash, byte| splitmix(hash ^ u64::from(byte)));
        self.view = format!("mesh-{stem}-{:08x}", hash >> 32);
        self.file = format!("{FOLDER}/{}.png", self.view);
    }

    /// The strip as PNG, the medial meshes above the surface with the errors of each, and the script of the 3D view.
    ///
    /// # Errors
    /// When a medial mesh is empty or not valid, or the picture is too large.
    pub fn draw(
        &self,
        surface: &TriMesh,
        axes: &[MedialMesh],
    ) -> Result<(Vec<u8>, String), String> {
        let captions = || self.panels.iter().map(|(_, caption)| caption.clone());
        let view = View3d::new(surface, captions().zip(axes).collect())?;
        let panels = axes.iter().zip(captions()).zip(view.errors());
        let panels: Vec<Panel<'_>> = panels
            .map(|((axis, caption), errors)| {
                let errors = Some(Errors { caption: caption.clone(), ..errors });
                Panel { axis, caption, errors }
            })
            .collect();
        let (low, high) = surface.bounding_box().unwrap_or_default();
        let common = Strip {
            surface,
            diagonal: low.distance(high),
            camera: Camera::fitting(surface),
            size: PANEL,
            across: ACROSS,
            background: Background::WHITE,
            colour: ColourBy::Radius,
            max_error: None,
        };
        let png = strip(&panels, &common).and_then(|picture| picture.to_png());
        Ok((png.map_err(|error| error.to_string())?, view.script(&self.view)))
    }

    /// Where the panels are in the picture.
    pub(crate) fn layout(&self) -> Layout {
        Layout::of(self.panels.len(), ACROSS, PANEL)
    }

    /// Path of the 3D view, relative to the folder of the report.
    pub fn view_file(&self) -> String {
        format!("{VIEWS}/{}.js", self.view)
    }
}

/// The strips by mesh.
pub(crate) fn strips(comparison: &Comparison<'_>) -> BTreeMap<usize, PictureStrip> {
    let mut strips: BTreeMap<usize, PictureStrip> = BTreeMap::new();
    let Some((level, count)) = usual_level(comparison) else { return strips };
    let stems = file_stems(comparison.meshes.iter().map(String::as_str));
    for (mesh, name) in comparison.meshes.iter().enumerate() {
        let mut shown: Vec<(f64, &Entry<'_>)> = (comparison.of_mesh(mesh))
            // A file of another program has one number of spheres, of any size.
            .filter(|entry| entry.level == level || entry.record.status == Status::External)
            .filter(|entry| entry.measured() && entry.record.artifact.is_some())
            .filter_map(|entry| Some((HAUSDORFF.of(entry.record)?, entry))) // a caption names it
            .collect();
        shown.sort_by(|a, b| a.0.total_cmp(&b.0)); // the best first; equal ones stay in order
        let panels: Vec<(String, String)> = (shown.iter())
            .filter_map(|(error, entry)| {
                let mut caption = comparison.series[entry.series].clone();
                if let Some(spheres) = reached(entry.record).filter(|&spheres| spheres != count) {
                    caption.push_str(&format!(" ({})", grouped(spheres as u64)));
                }
                caption.push_str(&format!(": Hausdorff {} %", HAUSDORFF.format(*error)));
                Some((entry.record.artifact.clone()?, caption))
            })
            .collect();
        let Some((_, first)) = shown.first() else { continue };
        let mut strip = PictureStrip {
            mesh: name.clone(),
            mesh_hash: first.record.mesh_hash.clone(), // the caller finds the surface by it
            file: String::new(),
            view: String::new(),
            panels,
        };
        strip.name(&stems[mesh]); // depends on all panels
        strips.insert(mesh, strip);
    }
    strips
}
