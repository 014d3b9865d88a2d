//! Cells as flat records, four vertices and four neighbours, 32 bytes.

/// The vertex at infinity while a triangulation is built; sites count from one.
pub(super) const INFINITE: u32 = 0;

/// The first vertex of a record that no cell uses.
pub(super) const UNUSED: u32 = u32::MAX;

/// The record that stands for all cells of other parts, see [`super::build::Builder`].
pub(super) const FRONTIER: u32 = 0;

/// The most cells that a [`Face`] can name: two of its 32 bits hold the index of the vertex.
pub(super) const MAX_CELLS: usize = 1 << 30;

/// For each vertex of a positive cell the opposite facet, counter-clockwise from outside the cell.
///
/// `(v[i], v[f[0]], v[f[1]], v[f[2]])` with `f = OPPOSITE[i]` is an even permutation of the cell.
pub(super) const OPPOSITE: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// A facet as seen from one of its cells: the cell and the index of the opposite vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Face(pub(super) u32);

impl Face {
    pub(super) const NONE: Self = Self(u32::MAX);

    #[inline(always)]
    pub(super) fn new(cell: u32, index: usize) -> Self {
        Self(cell << 2 | index as u32)
    }

    #[inline(always)]
    pub(super) fn cell(self) -> u32 {
        self.0 >> 2
    }

    /// The same facet after all cells were renumbered by an offset.
    #[inline(always)]
    pub(super) fn moved(self, offset: u32) -> Self {
        Self(self.0.wrapping_add(offset << 2))
    }

    #[inline(always)]
    pub(super) fn index(self) -> usize {
        (self.0 & 3) as usize
    }
}

/// A positively oriented cell. An infinite cell has [`INFINITE`] as its last vertex; with any point
/// beyond its finite facet in that place it is positively oriented too.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub(super) struct Cell {
    pub(super) v: [u32; 4],
    /// Facet `i`, opposite to vertex `i`, as seen from the neighbour.
    pub(super) n: [Face; 4],
}

impl Cell {
    /// The record of the frontier: unused, and infinite.
    pub(super) const FRONTIER: Self =
        Self { v: [UNUSED, INFINITE, INFINITE, INFINITE], n: [Face::NONE; 4] };

    #[inline(always)]
    pub(super) fn is_infinite(&self) -> bool {
        self.v[3] == INFINITE
    }
}
