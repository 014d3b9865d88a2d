//! Which results are shown beside each other as pictures.
//!
//! For each mesh one strip: the results of all methods at the number of spheres that the answers of
//! [`answers`](crate::answers) are for, with the given files at theirs, and a 3D view of the same. Drawing needs the surfaces and the medial meshes, which are not in the
//! records: it is for the caller, with [`strip`](crate::render::strip).

use std::collections::BTreeMap;

use medial::geometry::hash::splitmix;

use crate::answers::usual_level;
use crate::comparison::{Comparison, reached};
use crate::metric::HAUSDORFF;
use crate::record::{Record, Status};
use crate::text::{counted, file_stems, significant};

/// Folders of the pictures and of the 3D views, beside the page.
pub(crate) const FOLDER: &str = "pictures";
pub(crate) const VIEWS: &str = "views";

/// A strip of pictures that a report shows if it finds it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PictureStrip {
    /// Name of the mesh.
    pub mesh: String,
    /// Hash of the input file or of the generated surface, as the records have it.
    pub mesh_hash: Option<String>,
    /// Where the picture belongs, relative to the folder of the report.
    pub file: String,
    /// The name of the 3D view of the same results.
    pub view: String,
    /// The medial meshes, by path relative to the folder of the report, and what is said of each.
    pub panels: Vec<(String, String)>,
}

/// The strips that belong to some records, in the order of the meshes; those without a medial mesh are left out.
pub fn picture_strips(records: &[Record]) -> Vec<PictureStrip> {
    let comparison = Comparison::new(records);
    strips(&comparison).into_values().collect()
}

impl PictureStrip {
    /// A name that another choice of results, or other errors beside them, does not have: a picture of an earlier
    /// run is never shown beside the numbers of a later one.
    fn name(&mut self, stem: &str) {
        let bytes = self.panels.iter().flat_map(|(artifact, caption)| [artifact, caption]);
        let bytes = bytes.flat_map(|text| text.bytes().chain([0]));
        let hash = bytes.fold(0, |hash, byte| splitmix(hash ^ u64::from(byte)));
        self.view = format!("mesh-{stem}-{:08x}", hash >> 32);
        self.file = format!("{FOLDER}/{}.png", self.view);
    }

    /// Where the 3D view belongs, relative to the folder of the report.
    pub fn view_file(&self) -> String {
        format!("{VIEWS}/{}.js", self.view)
    }
}

/// The strips by mesh.
pub(crate) fn strips(comparison: &Comparison<'_>) -> BTreeMap<usize, PictureStrip> {
    let mut strips: BTreeMap<usize, PictureStrip> = BTreeMap::new();
    let Some((level, _)) = usual_level(comparison) else { return strips };
    let stems = file_stems(comparison.meshes.iter().map(String::as_str));
    for entry in &comparison.entries {
        let record = entry.record;
        // A file of another program has one number of spheres, whatever that is.
        let at_level = entry.level == level || record.status == Status::External;
        let shown = at_level && entry.measured(); // a caption names the error
        let Some(artifact) = record.artifact.clone().filter(|_| shown) else { continue };
        let mut caption = comparison.series[entry.series].clone();
        if let Some(spheres) = reached(record) {
            caption.push_str(&format!(": {}", counted(spheres, "sphere", "spheres")));
        }
        if let Some(error) = HAUSDORFF.of(record) {
            caption.push_str(&format!(", {} %", significant(error, 2)));
        }
        let strip = strips.entry(entry.mesh).or_insert_with(|| PictureStrip {
            mesh: comparison.meshes[entry.mesh].clone(),
            mesh_hash: record.mesh_hash.clone(), // the caller finds the surface by it
            file: String::new(),
            view: String::new(),
            panels: vec![],
        });
        strip.panels.push((artifact, caption)); // in the order of the table
    }
    // A name depends on all panels of the strip.
    for (&mesh, strip) in &mut strips {
        strip.name(&stems[mesh]);
    }
    strips
}
