//! Why a binary glTF file could not be read or written.

/// A defect of a binary glTF file, with the element of its JSON text that has it. Elements are counted from 0.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GlbError {
    /// Another kind of file.
    #[error(
        "not a binary glTF file: its first word is not `glTF`; glTF as text (.gltf) has to be exported as .glb"
    )]
    Magic,
    /// Another version.
    #[error("glTF version {0} is not read; export as version 2")]
    Version(u32),
    /// The file is shorter or longer than it says.
    #[error(
        "the header announces {announced} bytes, but the file holds {holds}: it is cut off or has something behind it"
    )]
    Length {
        /// As many as the header says.
        announced: u32,
        /// As many as there are.
        holds: usize,
    },
    /// A chunk is longer than what is left of the file.
    #[error("chunk {chunk} announces {announced} bytes, but only {left} are left in the file")]
    Chunk {
        /// Which chunk.
        chunk: usize,
        /// As many as its header says.
        announced: u32,
        /// As many as there are.
        left: usize,
    },
    /// The first chunk is no text.
    #[error("the first chunk is not the JSON text of a scene")]
    NoJson,
    /// The text is not JSON, or not that of a scene.
    #[error("the JSON text: {0}")]
    Json(String),
    /// A part of glTF that is not read or not written.
    #[error("{0}")]
    Unsupported(String),
    /// An element names another that does not exist.
    #[error("{at} names {what} {index}, but there are {count}")]
    Index {
        /// The element, such as `mesh 0, primitive 2`.
        at: String,
        /// What it names.
        what: &'static str,
        /// The number it names.
        index: u64,
        /// How many there are.
        count: usize,
    },
    /// An element lacks something or has a value that makes no sense.
    #[error("{at}: {why}")]
    Element {
        /// The element.
        at: String,
        /// What is wrong with it.
        why: String,
    },
    /// An element reaches beyond the bytes that it takes.
    #[error("{at} needs {needed} bytes, but {of} has {has}")]
    Range {
        /// The element.
        at: String,
        /// The end of what it takes.
        needed: u64,
        /// What it takes them of.
        of: String,
        /// The length of that.
        has: u64,
    },
    /// A node that is its own descendant, or has two parents.
    #[error("node {0} is reached twice; the nodes of a scene have to form trees")]
    Twice(usize),
    /// Meshes stand in the scene so often that they need far more memory than the file.
    #[error(
        "the scene repeats its meshes to {elements} vertices and corners, more than the {most} that a file of this size \
         may have; export it with the copies made real"
    )]
    Repeated {
        /// How many there would be at least.
        elements: u64,
        /// How many are read.
        most: u64,
    },
    /// What is to be written does not fit.
    #[error(
        "{bytes} bytes are more than the 4 GB that a binary glTF file can hold; write .ma or .vtp"
    )]
    TooLarge {
        /// As many as it would have.
        bytes: u64,
    },
}

impl GlbError {
    pub(crate) fn element(at: impl Into<String>, why: impl Into<String>) -> Self {
        Self::Element { at: at.into(), why: why.into() }
    }
}
