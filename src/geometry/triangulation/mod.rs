//! Three-dimensional triangulations: adjacency alone, without coordinates.
//!
//! A triangulation of points in space is stored as one of a topological 3-sphere: every facet of
//! the convex hull has, on its outer side, an *infinite* cell with the vertex
//! [`VertexId::INFINITE`], so that every cell has four neighbours. [`super::delaunay::Delaunay`] and
//! [`super::regular::Regular`] build it.
//!
//! Vertex ids are indices of the input points. Cell ids count finite cells first, then infinite
//! ones, along a space-filling curve, so that neighbours are close in memory; the order depends on
//! the input alone, not on the number of threads that build it.

mod build;
mod cells;
mod check;
mod divide;
mod error;
mod freeze;
mod order;
mod query;
mod stellate;
#[cfg(test)]
mod tests;
mod zone;

use cells::Cell;
pub use check::Violation;
pub use error::TriangulationError;
pub use query::{EdgeRing, Facet};

use rayon::prelude::*;

use super::predicates::{Filter, Metric, Site, highest_bit, lowest_bit};
use build::Builder;

/// A vertex: the index of an input point, or the vertex at infinity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct VertexId(pub u32);

impl VertexId {
    /// The vertex at infinity.
    pub const INFINITE: Self = Self(u32::MAX);

    /// The index of the input point; meaningless for the vertex at infinity.
    #[inline]
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

/// A cell (tetrahedron), finite or infinite.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct CellId(pub u32);

impl CellId {
    const NONE: Self = Self(u32::MAX);

    /// The index of the cell.
    #[inline]
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

/// The cells of a triangulation and their adjacency.
///
/// Every finite cell `[a, b, c, d]` is positively oriented: `det(b - a, c - a, d - a) > 0`. An
/// infinite cell has the vertex at infinity last, and its other three vertices are
/// counter-clockwise as seen from outside the convex hull.
#[derive(Clone, Debug)]
pub struct Triangulation {
    cells: Vec<Cell>,
    finite: usize,
    vertices: usize,
    /// For each input point its cell with the smallest id.
    incident: Vec<CellId>,
}

/// When a round of insertion is divided between two threads.
#[derive(Clone, Copy, Debug)]
struct Division {
    /// Fewest sites of a round.
    smallest: u32,
    /// Largest share of the sites that may be deferred, as a fraction.
    most_deferred: (u32, u32),
}

/// Rounds of at least this many sites are inserted in two independent parts.
const DIVISION: Division = Division { smallest: 1 << 14, most_deferred: (1, 2) };

/// A triangulation of sites, and the sites that repeat the position of another.
pub(super) struct Triangulated {
    pub(super) triangulation: Triangulation,
    /// Pairs (site, the kept site at the same position), ascending.
    pub(super) repeated: Vec<(u32, u32)>,
    pub(super) filter: Filter,
}

/// Triangulates finite sites of admissible size, in any number and position.
pub(super) fn triangulate<M: Metric>(sites: &[Site]) -> Result<Triangulated, TriangulationError> {
    triangulate_dividing::<M>(sites, DIVISION)
}

/// The same with rounds of insertion divided otherwise.
fn triangulate_dividing<M: Metric>(
    sites: &[Site],
    division: Division,
) -> Result<Triangulated, TriangulationError> {
    if sites.len() >= cells::MAX_CELLS {
        return Err(TriangulationError::TooLarge { points: sites.len(), limit: cells::MAX_CELLS });
    }
    let order::Order { inserted: mut ids, rounds, repeated, along_curve } =
        order::insertion_order(sites);
    if ids.len() < 4 {
        let distinct = ids.len();
        return Err(TriangulationError::TooFewPoints { points: sites.len(), distinct });
    }
    let filter = filter_of::<M>(sites);
    // Vertex 0 is the one at infinity: a read of its position by mistake must not look valid.
    let dummy = Site { p: [f64::NAN; 3], w: f64::NAN };
    let mut ordered =
        std::iter::once(dummy).chain(ids.iter().map(|&i| sites[i as usize])).collect::<Vec<_>>();
    build::bring_independent_to_front(&mut ordered, &mut ids)?;
    let cells = Builder::<M>::build(&ordered, &rounds, division, filter)?.cells;
    let triangulation = freeze::freeze(cells, &ids, &along_curve);
    Ok(Triangulated { triangulation, repeated, filter })
}

/// The filter of the coarsest grid that holds all sites.
fn filter_of<M: Metric>(sites: &[Site]) -> Filter {
    // Only differences of weights matter.
    let weights_differ = sites.iter().any(|s| s.w != sites[0].w);
    let bits = |s: &Site| {
        let mut quantum = s.p.map(lowest_bit).into_iter().min().unwrap_or(i32::MAX);
        let top = s.p.map(highest_bit).into_iter().max().unwrap_or(i32::MIN);
        if M::WEIGHTED && weights_differ && s.w != 0.0 {
            // A weight is a squared length: its exponent counts half.
            quantum = quantum.min(lowest_bit(s.w).div_euclid(2));
        }
        (quantum, top)
    };
    let widest = |a: (i32, i32), b: (i32, i32)| (a.0.min(b.0), a.1.max(b.1));
    let (quantum, top) = sites.par_iter().map(bits).reduce(|| (i32::MAX, i32::MIN), widest);
    Filter::of_grid(quantum, top)
}
