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
mod divide;
mod order;
mod query;

use rayon::prelude::*;

use crate::Vec3;
use crate::predicates::{Filter, MAX_COORDINATE, Metric, Site, highest_bit, lowest_bit};
use crate::triangulation::build::Builder;

pub use crate::triangulation::query::{EdgeRing, Facet, Violation};

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
    if sites.len() >= MAX_CELLS {
        return Err(TriangulationError::TooLarge { points: sites.len(), limit: MAX_CELLS });
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
    let mut ordered = Vec::with_capacity(ids.len() + 1);
    ordered.push(dummy);
    ordered.par_extend(ids.par_iter().with_min_len(1024).map(|&i: &u32| sites[i as usize]));
    build::bring_independent_to_front(&mut ordered, &mut ids)?;
    let cells = Builder::<M>::build(&ordered, &rounds, division, filter)?.cells;
    // Memory is at its peak while cells are brought into order.
    drop(ordered);
    let triangulation = order::freeze(cells, &ids, &along_curve);
    Ok(Triangulated { triangulation, repeated, filter })
}

/// Adds the sites from `first` on to a triangulation of those before them.
pub(super) fn extend<M: Metric>(
    old: &Triangulation,
    sites: &[Site],
    first: usize,
) -> Result<Triangulated, TriangulationError> {
    if sites.len() >= MAX_CELLS {
        return Err(TriangulationError::TooLarge { points: sites.len(), limit: MAX_CELLS });
    }
    let order::Order { inserted, repeated, along_curve, .. } = order::insertion_order(sites);
    let filter = filter_of::<M>(sites);
    let dummy = Site { p: [f64::NAN; 3], w: 0.0 };
    let numbered: Vec<Site> = std::iter::once(dummy).chain(sites.iter().copied()).collect();
    let mut builder = Builder::<M>::new(&numbered, filter, sites.len());
    builder.resume(old);
    let mut added: Vec<u32> = inserted.into_iter().filter(|&id| id as usize >= first).collect();
    // Along the curve the walk from one to the next is short.
    added.sort_unstable_by_key(|&id| along_curve[id as usize]);
    builder.insert_all(added.into_iter().map(|id| id + 1))?;
    let ids: Vec<u32> = (0..sites.len() as u32).collect();
    let triangulation = order::freeze(builder.cells, &ids, &along_curve);
    Ok(Triangulated { triangulation, repeated, filter })
}

/// The filter of the coarsest grid that holds all sites.
fn filter_of<M: Metric>(sites: &[Site]) -> Filter {
    // Only differences of weights matter.
    let weights_differ = sites.iter().any(|s| s.w != sites[0].w);
    let (quantum, top) = sites
        .par_iter()
        .map(|s: &Site| {
            let mut quantum = s.p.map(lowest_bit).into_iter().min().unwrap_or(i32::MAX);
            let top = s.p.map(highest_bit).into_iter().max().unwrap_or(i32::MIN);
            if M::WEIGHTED && weights_differ && s.w != 0.0 {
                // A weight is a squared length: its exponent counts half.
                quantum = quantum.min(lowest_bit(s.w).div_euclid(2));
            }
            (quantum, top)
        })
        .reduce(
            || (i32::MAX, i32::MIN),
            |a: (i32, i32), b: (i32, i32)| (a.0.min(b.0), a.1.max(b.1)),
        );
    Filter::of_grid(quantum, top)
}

/// Why points have no triangulation.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the messages name the fields")]
pub enum TriangulationError {
    /// A coordinate is infinite or not a number.
    #[error("point {index} has a coordinate that is not finite: {point}")]
    NotFinite { index: usize, point: Vec3 },
    /// A coordinate is so large that products of coordinates overflow.
    #[error(
        "point {index} ({point}) exceeds {MAX_COORDINATE:e} in absolute value, \
         beyond which products of coordinates overflow: scale the points down"
    )]
    OutOfRange { index: usize, point: Vec3 },
    /// A weight is infinite, not a number, or beyond the square of the largest coordinate.
    #[error("point {index} has the unusable weight {weight:e}")]
    Weight { index: usize, weight: f64 },
    /// A ball's radius is negative, infinite, or not a number.
    #[error("ball {index} has the unusable radius {radius:e}")]
    Radius { index: usize, radius: f64 },
    /// There is not one weight for each point.
    #[error("{points} points but {weights} weights")]
    WeightCount { points: usize, weights: usize },
    /// Fewer than four distinct points.
    #[error("{distinct} distinct points among {points}: a tetrahedron needs four")]
    TooFewPoints { points: usize, distinct: usize },
    /// All points lie on one line.
    #[error("all {distinct} distinct points lie on one line: there is no tetrahedron")]
    Collinear { distinct: usize },
    /// All points lie in one plane. Triangulations of the plane are not offered here;
    /// [`DualComplex::of_balls`](crate::DualComplex::of_balls) takes flat input, and fewer points,
    /// too.
    #[error("all {distinct} distinct points lie in one plane: there is no tetrahedron")]
    Coplanar { distinct: usize },
    /// More points or cells than 32-bit ids can name.
    #[error("{points} points need more than {limit} cells, the most that 32-bit ids can name")]
    TooLarge { points: usize, limit: usize },
}

impl TriangulationError {
    /// Whether the points are admissible, but do not span space.
    pub fn is_flat(&self) -> bool {
        matches!(self, Self::TooFewPoints { .. } | Self::Collinear { .. } | Self::Coplanar { .. })
    }
}

// Cells as flat records, four vertices and four neighbours, 32 bytes.

/// The vertex at infinity while a triangulation is built; sites count from one.
pub(super) const INFINITE: u32 = 0;

/// The first vertex of a record that no cell uses.
const UNUSED: u32 = u32::MAX;

/// The record that stands for all cells of other parts, see [`crate::triangulation::build::Builder`].
const FRONTIER: u32 = 0;

/// The most cells that a [`Face`] can name: two of its 32 bits hold the index of the vertex.
const MAX_CELLS: usize = 1 << 30;

/// For each vertex of a positive cell the opposite facet, counter-clockwise from outside the cell.
///
/// `(v[i], v[f[0]], v[f[1]], v[f[2]])` with `f = OPPOSITE[i]` is an even permutation of the cell.
const OPPOSITE: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// A facet as seen from one of its cells: the cell and the index of the opposite vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Face(pub(super) u32);

impl Face {
    const NONE: Self = Self(u32::MAX);

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
    const FRONTIER: Self = Self { v: [UNUSED, INFINITE, INFINITE, INFINITE], n: [Face::NONE; 4] };

    #[inline(always)]
    pub(super) fn is_infinite(&self) -> bool {
        self.v[3] == INFINITE
    }
}

#[cfg(test)]
mod tests {
    use std::sync::LazyLock;

    use proptest::prelude::*;
    use rayon::{ThreadPool, ThreadPoolBuilder};

    use super::*;
    use crate::Vec3;
    use crate::predicates::{Unweighted, Weighted};

    /// Cells as sorted quadruples of input points.
    fn cell_set(t: &Triangulation) -> Vec<[VertexId; 4]> {
        let mut cells: Vec<_> = t
            .cells()
            .map(|cell| {
                let mut v = t.vertices(cell);
                v.sort_unstable();
                v
            })
            .collect();
        cells.sort_unstable();
        cells
    }

    /// Divides rounds of at least `smallest` sites, for any number of deferred ones.
    fn always_from(smallest: u32) -> Division {
        Division { smallest, most_deferred: (1, 1) }
    }

    /// Divided on one thread, which grows one part behind the other, and on two, side by side.
    fn divided<M: Metric>(
        sites: &[Site],
        smallest: u32,
    ) -> [Result<Triangulated, TriangulationError>; 2] {
        static POOLS: LazyLock<[ThreadPool; 2]> = LazyLock::new(|| {
            [1, 2].map(|n| ThreadPoolBuilder::new().num_threads(n).build().unwrap())
        });
        POOLS
            .each_ref()
            .map(|pool| pool.install(|| triangulate_dividing::<M>(sites, always_from(smallest))))
    }

    fn agrees<M: Metric>(sites: &[Site]) -> Result<(), TestCaseError> {
        let undivided = triangulate_dividing::<M>(sites, always_from(u32::MAX));
        for smallest in [1, 16, 64] {
            let [one, two] = divided::<M>(sites, smallest);
            prop_assert_eq!(one.is_ok(), two.is_ok());
            if let (Ok(one), Ok(two)) = (&one, &two) {
                let bytes = |t: &Triangulation| -> Vec<_> {
                    t.records().iter().map(|cell| (cell.v, cell.n)).collect()
                };
                prop_assert_eq!(bytes(&one.triangulation), bytes(&two.triangulation));
                prop_assert_eq!(&one.triangulation.incident, &two.triangulation.incident);
            }
            match (&undivided, one) {
                (Ok(whole), Ok(divided)) => {
                    let t = divided.triangulation;
                    prop_assert_eq!(t.check_combinatorics(), Ok(()));
                    prop_assert_eq!(t.check_regularity::<M>(sites, divided.filter), Ok(()));
                    prop_assert_eq!(cell_set(&t), cell_set(&whole.triangulation));
                    prop_assert_eq!(&divided.repeated, &whole.repeated);
                }
                (Err(whole), Err(divided)) => prop_assert_eq!(whole, &divided),
                (whole, divided) => {
                    let (whole, divided) = (whole.is_ok(), divided.is_ok());
                    prop_assert!(false, "undivided: {}, divided: {}", whole, divided);
                }
            }
        }
        Ok(())
    }

    /// Random points, and the same on a coarse grid, on a sphere, in two planes, in distant clusters.
    fn points() -> impl Strategy<Value = Vec<Vec3>> {
        let point = prop::array::uniform3(-1.0..1.0f64).prop_map(Vec3::from_array);
        (prop::collection::vec(point, 8..900), 0..5).prop_map(|(points, kind)| {
            points
                .iter()
                .enumerate()
                .map(|(i, p): (usize, &Vec3)| match kind {
                    0 => *p,
                    1 => (4.0 * *p).round(),
                    2 => p.normalize_or(Vec3::X),
                    3 => {
                        Vec3::new((9.0 * p.x).round(), (9.0 * p.y).round(), f64::from(i as u32 % 2))
                    }
                    _ => *p * 1e-3 + Vec3::splat(f64::from(i as u32 % 3)),
                })
                .collect()
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(96))]

        #[test]
        fn divided_rounds_give_the_same_cells(points in points()) {
            let sites: Vec<Site> = points.iter().map(|p| Site { p: p.to_array(), w: 0.0 }).collect();
            agrees::<Unweighted>(&sites)?;
        }

        #[test]
        fn divided_rounds_give_the_same_weighted_cells(
            points in points(),
            weights in prop::collection::vec(0.0..0.3f64, 900),
        ) {
            let sites = points.iter().zip(weights).map(|(p, w)| Site { p: p.to_array(), w });
            agrees::<Weighted>(&sites.collect::<Vec<_>>())?;
        }
    }
}
