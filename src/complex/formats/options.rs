//! What a reader is asked to accept beyond a well-formed medial mesh.

/// How files are read that are not what their header says, or hold more or less than one medial mesh.
///
/// ```
/// use medial::complex::{ReadOptions, parse_ma_with};
///
/// let short = "3 0 0\nv 0 0 0 1\nv 1 0 0 1\n";
/// assert!(parse_ma_with(short, "short.ma", ReadOptions::default()).is_err());
/// let lenient = ReadOptions { lenient: true, ..ReadOptions::default() };
/// let loaded = parse_ma_with(short, "short.ma", lenient)?;
/// assert_eq!((loaded.mesh.spheres.len(), loaded.warnings.len()), (2, 1));
/// # Ok::<(), medial::complex::MaError>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ReadOptions {
    /// Takes the lines as they are where they are not as many as the header announces, with a warning.
    pub lenient: bool,
    /// Which medial mesh is meant, from 1, of a file to which several were appended. Without it such a file is
    /// refused.
    pub block: Option<usize>,
    /// Whether the radii of the file are wanted.
    pub radii: Radii,
}

/// Whether the radii of a file are wanted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Radii {
    /// A file without radii is refused. Of negative ones, which some tools write, the absolute values are taken, with a
    /// warning.
    #[default]
    Needed,
    /// A negative radius is refused, too: for programs that are to be told of their mistakes.
    NotNegative,
    /// The caller brings radii of his own: files of points are accepted, and what stands in the place of radii (0,
    /// where nothing does) means nothing.
    NotNeeded,
}
