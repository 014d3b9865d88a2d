//! Incremental construction of Delaunay and regular triangulations.
//!
//! * A. Bowyer: *Computing Dirichlet tessellations*, The Computer Journal 24 (1981),
//!   <https://doi.org/10.1093/comjnl/24.2.162>; D. F. Watson, the same issue,
//!   <https://doi.org/10.1093/comjnl/24.2.167>.
//! * O. Devillers, S. Pion, M. Teillaud: *Walking in a triangulation*, IJFCS 13 (2002),
//!   <https://doi.org/10.1142/S0129054102001047>.
//! * S. Funke, K. Mehlhorn, S. Naeher: *Structural filtering: a paradigm for efficient and exact
//!   geometric programs*, Computational Geometry 31 (2005),
//!   <https://doi.org/10.1016/j.comgeo.2004.12.007>.
//!
//! 1. Four affinely independent sites make the first cell; four infinite cells, with the vertex at
//!    infinity, close it.
//! 2. Each further site, in the order of [`super::order`], is located by a walk in rounded
//!    arithmetic from the last new cell.
//! 3. The *conflict zone*, the connected set of cells whose perturbed orthosphere contains the site,
//!    grows from the cell found. If that cell is not in conflict, an exact walk finds the one that
//!    contains the site; if that is not in conflict either, the site is hidden (weighted only).
//! 4. The zone is *stellated*: its cells are replaced by the cone of its boundary from the site.
//!    Neighbours are linked through a table of the boundary's edges.
//!
//! An infinite cell is in conflict with every site strictly beyond its facet. A site in the plane of
//! the facet is in conflict with it exactly if it is with the finite neighbour: the neighbour's
//! sphere meets that plane in the circle of the facet, and both are perturbed alike.

use super::Division;
use super::cells::{Cell, FRONTIER, Face, INFINITE, OPPOSITE};
use super::error::TriangulationError;
use super::stellate::{ABSENT, TABLE};
use super::zone::{Candidate, FOREIGN, UNKNOWN, Wall};
use crate::predicates::{Filter, Metric, Sign, Site, approximate_orientation, sites_collinear};

/// Rounding can make an approximate walk cycle; after this many steps the exact walk takes over.
const MAX_ROUNDED_STEPS: usize = 256;

/// The outcome of inserting a site.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Outcome {
    /// It is a vertex, or hidden.
    Done,
    /// The walk to it met the frontier: nothing was changed.
    Unreached,
    /// Its conflict zone met the frontier: nothing was changed.
    Straddling,
}

/// A growing triangulation, or one part of it that grows independently of the rest.
///
/// Record 0 is the *frontier*, which stands for all cells of other parts. It looks infinite, so
/// walks end there; it is marked [`FOREIGN`], so a conflict zone that reaches it is abandoned.
pub(super) struct Builder<'s, M> {
    /// Sites by vertex, in the order of insertion; the first is a dummy for the vertex at infinity.
    pub(super) sites: &'s [Site],
    pub(super) cells: Vec<Cell>,
    pub(super) filter: Filter,
    pub(super) state: Vec<u8>,
    pub(super) free: Vec<u32>,
    pub(super) last: u32,
    pub(super) zone: Vec<u32>,
    pub(super) walls: Vec<Wall>,
    pub(super) front: Vec<Candidate>,
    pub(super) local: Vec<u8>,
    pub(super) rim: [u32; TABLE + 1],
    pub(super) table: Box<[Face; TABLE * TABLE]>,
    pub(super) edges: Vec<(u64, Face)>,
    metric: std::marker::PhantomData<fn() -> M>,
}

impl<'s, M: Metric> Builder<'s, M> {
    /// Triangulates distinct sites; `sites[0]` is a dummy, and 1 to 4 are affinely independent.
    ///
    /// `rounds` holds the end of each round of insertion; `division` says which of them
    /// are divided.
    pub(super) fn build(
        sites: &'s [Site],
        rounds: &[u32],
        division: Division,
        filter: Filter,
    ) -> Result<Self, TriangulationError> {
        // A divided round reserves its own memory, so reserve for the rounds before it only.
        let alone = rounds.iter().take_while(|&&end| end < division.smallest).last();
        let mut builder = Self::new(sites, filter, alone.map_or(sites.len(), |&n| n as usize));
        builder.start();
        // Sites 1 to 4 are the first cell, whichever rounds they belong to.
        let mut start = 5;
        for &end in rounds {
            if end.saturating_sub(start) < division.smallest {
                builder.insert_all(start..end)?;
            } else {
                builder.insert_divided(start..end, division.most_deferred)?;
            }
            start = end.max(start);
        }
        Ok(builder)
    }

    /// A builder with only the frontier, and room for `expected` sites.
    pub(super) fn new(sites: &'s [Site], filter: Filter, expected: usize) -> Self {
        let mut builder = Self {
            sites,
            cells: Vec::new(),
            filter,
            state: Vec::new(),
            free: Vec::new(),
            last: FRONTIER,
            zone: Vec::new(),
            walls: Vec::new(),
            front: Vec::new(),
            local: vec![ABSENT; sites.len()],
            rim: [0; TABLE + 1],
            table: Box::new([Face::NONE; TABLE * TABLE]),
            edges: Vec::new(),
            metric: std::marker::PhantomData,
        };
        builder.reserve(expected);
        builder.cells.push(Cell::FRONTIER);
        builder.state.push(FOREIGN);
        builder
    }

    /// Makes room for the cells of `sites` further sites.
    ///
    /// Samples of surfaces need up to 8 cells per site. Reserved pages cost nothing until they are
    /// touched, while growing a vector holds two copies for a moment. If the reservation fails, the
    /// vectors grow on demand.
    pub(super) fn reserve(&mut self, sites: usize) {
        let expected = 9 * sites + 64;
        let _ = self.cells.try_reserve_exact(expected);
        let _ = self.state.try_reserve_exact(expected);
    }

    /// Inserts sites in this order.
    pub(super) fn insert_all(
        &mut self,
        vertices: impl IntoIterator<Item = u32>,
    ) -> Result<(), TriangulationError> {
        for vertex in vertices {
            let outcome = self.insert(vertex)?;
            debug_assert_eq!(outcome, Outcome::Done, "a whole triangulation has no frontier");
        }
        Ok(())
    }

    /// The first cell and its four infinite neighbours.
    fn start(&mut self) {
        let s = self.sites;
        let positive = self.filter.orient3d(&s[1].p, &s[2].p, &s[3].p, &s[4].p) == Sign::Positive;
        // Every predicate relies on positive cells.
        let v = if positive { [1, 2, 3, 4] } else { [1, 2, 4, 3] };
        self.cells.push(Cell { v, n: [Face::NONE; 4] });
        for i in 0..4 {
            let f = OPPOSITE[i].map(|k| v[k]);
            self.cells.push(Cell { v: [f[0], f[1], f[2], INFINITE], n: [Face::NONE; 4] });
            self.cells[1].n[i] = Face::new(i as u32 + 2, 3);
            self.cells[i + 2].n[3] = Face::new(1, i);
        }
        for i in 2..6u32 {
            for j in (2..6u32).filter(|&j| j != i) {
                // Infinite cell `i` lacks vertex `v[i - 2]`: its neighbour opposite to `v[j - 2]`
                // is cell `j`.
                let a = self.position(i, v[j as usize - 2]);
                let b = self.position(j, v[i as usize - 2]);
                self.cells[i as usize].n[a] = Face::new(j, b);
            }
        }
        self.state.resize(6, UNKNOWN);
        self.last = 1;
    }

    fn position(&self, cell: u32, vertex: u32) -> usize {
        let v = self.cells[cell as usize].v;
        v.iter().position(|&x| x == vertex).expect("the cell has the vertex")
    }

    /// Inserts a site, unless that would reach beyond the frontier.
    pub(super) fn insert(&mut self, vertex: u32) -> Result<Outcome, TriangulationError> {
        let Some(seed) = self.locate(vertex) else {
            debug_assert!(M::WEIGHTED, "the cell that contains a site is in conflict with it");
            return Ok(Outcome::Done);
        };
        if seed == FRONTIER {
            return Ok(Outcome::Unreached);
        }
        if !self.find_conflict_zone(vertex, seed) {
            return Ok(Outcome::Straddling);
        }
        self.collect_walls();
        self.stellate(vertex)?;
        Ok(Outcome::Done)
    }

    /// A cell in conflict with a site, [`FRONTIER`] if the walk ended there, `None` if the site is
    /// hidden.
    #[inline(always)]
    pub(super) fn locate(&self, vertex: u32) -> Option<u32> {
        let near = self.walk_approximately(vertex);
        // Any cell in conflict will do as a seed, so a walk that rounding led astray often suffices.
        if near == FRONTIER || self.conflicts(near, vertex) {
            return Some(near);
        }
        let seed = self.walk_exactly(vertex, near);
        (seed == FRONTIER || self.conflicts(seed, vertex)).then_some(seed)
    }

    /// Walks towards the site in rounded arithmetic, for a bounded number of steps.
    pub(super) fn walk_approximately(&self, vertex: u32) -> u32 {
        let p = &self.sites[vertex as usize].p;
        let mut c = self.last;
        // Orientation tests need four finite vertices.
        if self.cells[c as usize].is_infinite() {
            c = self.cells[c as usize].n[3].cell();
        }
        let mut from = c;
        for _ in 0..MAX_ROUNDED_STEPS {
            let cell = &self.cells[c as usize];
            if cell.is_infinite() {
                break;
            }
            let site = |i: usize| &self.sites[cell.v[i] as usize].p;
            let s = [site(0), site(1), site(2), site(3)];
            let exit = (0..4).find(|&i| {
                let f = OPPOSITE[i];
                // Not back through the facet just crossed: that test is known, up to rounding.
                cell.n[i].cell() != from
                    && approximate_orientation(p, s[f[0]], s[f[1]], s[f[2]]) < 0.0
            });
            match exit {
                Some(i) => {
                    from = c;
                    c = cell.n[i].cell();
                }
                None => break,
            }
        }
        c
    }

    /// Walks to the cell that contains the site, to an infinite cell whose facet the site is strictly
    /// beyond, or to the frontier.
    ///
    /// A visibility walk ends in every Delaunay and regular triangulation: with each step the power
    /// of the site with respect to the cell's orthosphere falls.
    fn walk_exactly(&self, vertex: u32, start: u32) -> u32 {
        let p = &self.sites[vertex as usize].p;
        let mut c = start;
        if self.cells[c as usize].is_infinite() {
            c = self.cells[c as usize].n[3].cell();
        }
        loop {
            let cell = &self.cells[c as usize];
            if cell.is_infinite() {
                return c;
            }
            let s = cell.v.map(|v| &self.sites[v as usize].p);
            let exit = (0..4).find(|&i| {
                let f = OPPOSITE[i];
                self.filter.orient3d(p, s[f[0]], s[f[1]], s[f[2]]) == Sign::Negative
            });
            match exit {
                Some(i) => c = cell.n[i].cell(),
                None => return c,
            }
        }
    }
}

/// Swaps the first four affinely independent sites into places 1 to 4.
pub(super) fn bring_independent_to_front(
    sites: &mut [Site],
    ids: &mut [u32],
) -> Result<(), TriangulationError> {
    let distinct = sites.len() - 1;
    if distinct < 4 {
        return Err(TriangulationError::TooFewPoints { points: distinct, distinct });
    }
    let (a, b) = (sites[1].p, sites[2].p);
    let third = (3..sites.len()).find(|&i| !sites_collinear(&a, &b, &sites[i].p));
    let third = third.ok_or(TriangulationError::Collinear { distinct })?;
    sites.swap(3, third);
    // `ids` has no dummy in front: site `i` is `ids[i - 1]`.
    ids.swap(2, third - 1);
    let c = sites[3].p;
    let fourth =
        (4..sites.len()).find(|&i| Filter::ANY.orient3d(&a, &b, &c, &sites[i].p) != Sign::Zero);
    let fourth = fourth.ok_or(TriangulationError::Coplanar { distinct })?;
    sites.swap(4, fourth);
    ids.swap(3, fourth - 1);
    Ok(())
}
