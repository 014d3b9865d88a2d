//! The parts of a scene's JSON text that geometry needs, as glTF 2.0 names them. All else is passed over.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde::de::IgnoredAny;

use super::GlbError;

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Document {
    pub asset: Asset,
    pub scene: Option<usize>,
    #[serde(default)]
    pub scenes: Vec<Scene>,
    #[serde(default)]
    pub nodes: Vec<Node>,
    #[serde(default)]
    pub meshes: Vec<Mesh>,
    #[serde(default)]
    pub accessors: Vec<Accessor>,
    #[serde(default)]
    pub buffer_views: Vec<BufferView>,
    #[serde(default)]
    pub buffers: Vec<Buffer>,
    #[serde(default)]
    pub extensions_required: Vec<String>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Asset {
    pub generator: Option<String>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Scene {
    #[serde(default)]
    pub nodes: Vec<usize>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Node {
    pub mesh: Option<usize>,
    pub skin: Option<IgnoredAny>,
    #[serde(default)]
    pub children: Vec<usize>,
    pub matrix: Option<[f64; 16]>,
    pub translation: Option<[f64; 3]>,
    pub rotation: Option<[f64; 4]>,
    pub scale: Option<[f64; 3]>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Mesh {
    #[serde(default)]
    pub primitives: Vec<Primitive>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Primitive {
    #[serde(default)]
    pub attributes: BTreeMap<String, usize>,
    pub indices: Option<usize>,
    pub mode: Option<u32>,
    #[serde(default)]
    pub targets: Vec<IgnoredAny>,
    #[serde(default)]
    pub extensions: BTreeMap<String, IgnoredAny>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    pub buffer_view: Option<usize>,
    #[serde(default)]
    pub byte_offset: u64,
    pub component_type: u32,
    #[serde(default)]
    pub normalized: bool,
    pub count: u64,
    #[serde(rename = "type")]
    pub kind: String,
    pub sparse: Option<IgnoredAny>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct BufferView {
    pub buffer: usize,
    #[serde(default)]
    pub byte_offset: u64,
    pub byte_length: u64,
    pub byte_stride: Option<u64>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Buffer {
    pub uri: Option<String>,
    pub byte_length: u64,
}

/// Extensions that a file may demand, since they do not change where anything is; quantised positions are read.
const HARMLESS: [&str; 3] = ["KHR_mesh_quantization", "KHR_lights_punctual", "KHR_xmp_json_ld"];
const HARMLESS_FAMILIES: [&str; 3] = ["KHR_materials_", "KHR_texture_", "EXT_texture_"];

/// Longest part of a name of the file's that is repeated in a message.
const NAME: usize = 60;

impl Document {
    pub fn parse(json: &[u8]) -> Result<Self, GlbError> {
        let document: Self =
            serde_json::from_slice(json).map_err(|error| GlbError::Json(error.to_string()))?;
        let harmless = |name: &&String| {
            HARMLESS.contains(&name.as_str())
                || HARMLESS_FAMILIES.iter().any(|family| name.starts_with(family))
        };
        match document.extensions_required.iter().find(|name| !harmless(name)) {
            Some(name) => Err(GlbError::Unsupported(unread(name))),
            None => Ok(document),
        }
    }
}

/// What to do about an extension that is not read.
pub(super) fn unread(extension: &str) -> String {
    let name: String = extension.chars().take(NAME).collect();
    let is_packed = ["draco", "meshopt"].iter().any(|word| name.contains(word));
    let what = if is_packed { "without compression" } else { "without it" };
    format!("the file needs the extension {name:?}, which is not read; export it {what}")
}
