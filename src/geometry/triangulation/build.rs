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

use crate::predicates::{
    Filter, Metric, Sign, Site, Size, UNDERFLOW, approximate_orientation, in_conflict_given,
    sites_collinear,
};
use crate::triangulation::{
    Cell, Division, FRONTIER, Face, INFINITE, MAX_CELLS, OPPOSITE, Triangulation,
    TriangulationError, UNUSED,
};

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
    walls: Vec<Wall>,
    front: Vec<Candidate>,
    /// For each vertex a tag of the last conflict zone that it was on the boundary of, a multiple of
    /// [`TABLE`], plus its number there.
    local: Vec<u32>,
    /// The tag of the last conflict zone.
    tag: u32,
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
            local: vec![0; sites.len()],
            tag: 0,
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

    /// Takes the cells of a triangulation whose input points are the first sites, in their order.
    pub(super) fn resume(&mut self, old: &Triangulation) {
        // Site numbers and records count from one.
        let records = old.records().iter().map(|cell| Cell {
            v: cell.v.map(|v| v.wrapping_add(1)),
            n: cell.n.map(|face| face.moved(1)),
        });
        self.cells.extend(records);
        self.state.resize(self.cells.len(), UNKNOWN);
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
        let walls = self.collect_walls();
        self.stellate(vertex, walls)?;
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

// Step 3: the conflict zone of a site, and its walls.

/// Mark of a cell that the growing conflict zone has not met.
pub(super) const UNKNOWN: u8 = 0;
/// Mark of a cell that was tested, or is about to be: bit 0.
const TESTED: u8 = 1;
/// Mark of a cell in conflict: bit 1, always together with that of [`TESTED`].
const CONFLICT: u8 = 3;

/// Mark of the frontier: bit 2, together with that of [`TESTED`] so that it is never tested.
const FOREIGN: u8 = 5;

/// A facet of the boundary of the conflict zone: its vertices, counter-clockwise from outside, and
/// the facet as a face of the cell outside.
#[derive(Clone, Copy)]
struct Wall {
    v: [u32; 3],
    outside: Face,
}

/// A cell beside the conflict zone, with the determinant that decides whether it joins the zone
/// and the error bound of that determinant.
#[derive(Clone, Copy)]
struct Candidate {
    pub(super) cell: u32,
    pub(super) det: f64,
    pub(super) bound: f64,
}

impl<M: Metric> Builder<'_, M> {
    #[inline(always)]
    pub(super) fn conflicts(&self, cell: u32, vertex: u32) -> bool {
        let site = &self.sites[vertex as usize];
        let (det, bound) = determinant::<M>(&self.cells, self.sites, cell, site);
        let candidate = Candidate { cell, det, bound };
        conflicts_given::<M>(self.filter, &self.cells, self.sites, site, candidate)
    }

    /// Marks and lists the cells in conflict with the site.
    ///
    /// Breadth first: the unknown neighbours of a whole generation are collected, then tested in one
    /// batch, so no test waits for the result of another. Returns false, with no cell marked, if the
    /// zone reaches the frontier.
    pub(super) fn find_conflict_zone(&mut self, vertex: u32, seed: u32) -> bool {
        self.zone.clear();
        self.zone.push(seed);
        self.state[seed as usize] = CONFLICT;
        let near = self.cells[seed as usize].v[0];
        let size = Size::of(&self.sites[vertex as usize], &self.sites[near as usize]);
        let mut generation = 0;
        while generation < self.zone.len() {
            let Some(front) = self.collect_front(generation) else {
                self.forget_zone();
                return false;
            };
            generation = self.zone.len();
            self.test_front(vertex, front, size);
        }
        true
    }

    /// Resets the marks of the zone and of its neighbours.
    pub(super) fn forget_zone(&mut self) {
        let Self { cells, state, zone, .. } = self;
        for &c in zone.iter() {
            state[c as usize] = UNKNOWN;
            for n in cells[c as usize].n {
                state[n.cell() as usize] = UNKNOWN;
            }
        }
        // The loop may have erased it as a neighbour of the zone.
        state[FRONTIER as usize] = FOREIGN;
    }

    /// Collects the unknown neighbours of the zone from `generation` on; returns their number, or
    /// `None` if the frontier is a neighbour.
    ///
    /// Branch-free: every neighbour is written, but the count moves past unknown ones only. The
    /// branch would be unpredictable, and a misprediction costs more than the write.
    fn collect_front(&mut self, generation: usize) -> Option<usize> {
        let Self { cells, state, zone, front, .. } = self;
        // Room for all four neighbours of each cell, since known ones are written as well.
        let room = 4 * (zone.len() - generation);
        if front.len() < room {
            front.resize(room, Candidate { cell: 0, det: 0.0, bound: 0.0 });
        }
        let (cells, state, front) = (&cells[..], &mut state[..], &mut front[..]);
        let (mut count, mut met) = (0, UNKNOWN);
        for &c in &zone[generation..] {
            for n in cells[c as usize].n {
                let known = &mut state[n.cell() as usize];
                met |= *known;
                front[count].cell = n.cell();
                count += usize::from(*known == UNKNOWN);
                *known |= TESTED;
            }
        }
        // Only the frontier has bit 2; the TESTED bit is common.
        (met & FOREIGN & !TESTED == 0).then_some(count)
    }

    /// Tests the first `count` candidates and appends those in conflict to the zone.
    fn test_front(&mut self, vertex: u32, count: usize, size: Size) {
        let Self { cells, sites, state, zone, front, filter, .. } = self;
        let (cells, sites, state) = (&cells[..], *sites, &mut state[..]);
        let site = &sites[vertex as usize];
        let front = &mut front[..count];
        // Two determinants at a time fill the lanes of the vector unit.
        let mut pairs = front.chunks_exact_mut(2);
        for pair in &mut pairs {
            let finite = |i: usize| sites_of(sites, finite_side(cells, pair[i].cell));
            let [first, second] =
                Filter::lifted_determinants::<M>([finite(0), finite(1)], site, size);
            (pair[0].det, pair[0].bound) = first;
            (pair[1].det, pair[1].bound) = second;
        }
        for candidate in pairs.into_remainder() {
            (candidate.det, candidate.bound) = determinant::<M>(cells, sites, candidate.cell, site);
        }
        // Branch-free append, as in `collect_front`.
        let mut length = zone.len();
        for &candidate in front.iter() {
            let Candidate { cell, det, bound } = candidate;
            // The usual case inline; the call is for doubtful signs and infinite cells.
            let decided = det.abs() > bound + UNDERFLOW && !cells[cell as usize].is_infinite();
            let conflict = if decided {
                det > 0.0
            } else {
                conflicts_given::<M>(*filter, cells, sites, site, candidate)
            };
            zone.push(cell);
            length += usize::from(conflict);
            zone.truncate(length);
            state[cell as usize] |= u8::from(conflict) * CONFLICT;
        }
    }

    /// Lists the facets between the conflict zone and the cells around it; returns their number.
    fn collect_walls(&mut self) -> usize {
        let Self { cells, state, zone, walls, .. } = self;
        let room = 4 * zone.len();
        if walls.len() < room {
            walls.resize(room, Wall { v: [0; 3], outside: Face::NONE });
        }
        let (cells, state, walls) = (&cells[..], &state[..], &mut walls[..]);
        let mut count = 0;
        for &c in zone.iter() {
            let Cell { v, n } = cells[c as usize];
            let next: &mut [Wall; 4] = walls[count..].first_chunk_mut().expect("there is room");
            let mut found = 0;
            for i in 0..4 {
                let f = OPPOSITE[i];
                next[found] = Wall { v: [v[f[0]], v[f[1]], v[f[2]]], outside: n[i] };
                // Tested and not in conflict: outside. Branch-free, as in `collect_front`.
                found += usize::from(state[n[i].cell() as usize] == TESTED);
            }
            count += found;
        }
        count
    }
}

/// The vertices of the finite cell whose orthosphere decides about conflict: the cell itself, or
/// the finite neighbour of an infinite cell.
#[inline(always)]
fn finite_side(cells: &[Cell], cell: u32) -> [u32; 4] {
    let record = &cells[cell as usize];
    if record.is_infinite() { cells[record.n[3].cell() as usize].v } else { record.v }
}

#[inline(always)]
fn sites_of(sites: &[Site], [a, b, c, d]: [u32; 4]) -> [&Site; 4] {
    [&sites[a as usize], &sites[b as usize], &sites[c as usize], &sites[d as usize]]
}

/// The determinant that decides whether a site is in conflict with a cell, and its error bound.
#[inline(always)]
fn determinant<M: Metric>(cells: &[Cell], sites: &[Site], cell: u32, site: &Site) -> (f64, f64) {
    Filter::lifted_determinant::<M>(sites_of(sites, finite_side(cells, cell)), site)
}

/// Whether a site is in conflict with a cell, see the head of `build.rs`; `det` and `bound` come
/// from [`determinant`].
#[inline(always)]
fn conflicts_given<M: Metric>(
    filter: Filter,
    cells: &[Cell],
    sites: &[Site],
    site: &Site,
    Candidate { cell, det, bound }: Candidate,
) -> bool {
    let v = cells[cell as usize].v;
    if v[3] == INFINITE {
        let [a, b, c] = [&sites[v[0] as usize], &sites[v[1] as usize], &sites[v[2] as usize]];
        match filter.orient3d(&a.p, &b.p, &c.p, &site.p) {
            Sign::Positive => return true,
            Sign::Negative => return false,
            // In the plane of the facet: the finite neighbour decides.
            Sign::Zero => {}
        }
    }
    let finite = sites_of(sites, finite_side(cells, cell));
    in_conflict_given::<M>(filter, det, bound, finite, site)
}

// Step 4: the conflict zone is replaced by a cone.

/// Boundaries of up to this many vertices are linked through a square table.
const TABLE: usize = 64;

/// The entry of an edge, by the numbers of its ends.
#[inline(always)]
fn at(a: u32, b: u32) -> usize {
    a as usize % TABLE * TABLE + b as usize % TABLE
}

impl<M: Metric> Builder<'_, M> {
    /// Replaces the conflict zone by the cone of its walls, `count` of them, from the site.
    fn stellate(&mut self, vertex: u32, count: usize) -> Result<(), TriangulationError> {
        self.allocate(count)?;
        for wall in &mut self.walls[..count] {
            // The vertex at infinity goes last; a rotation keeps the orientation. It is never first,
            // since it is the last of its cell, see [`OPPOSITE`].
            if wall.v[1] == INFINITE {
                wall.v.rotate_right(1);
            }
        }
        // The walls are a triangulated sphere: by Euler's relation it has two more vertices than
        // half its triangles.
        let small = count / 2 + 2 <= TABLE;
        if small {
            self.tabulate_edges(count);
        }
        let Self { cells, state, zone, walls, local, table, .. } = self;
        let (cells, state, local) = (&mut cells[..], &mut state[..], &local[..]);
        for (&Wall { v: [a, b, c], outside }, &id) in walls[..count].iter().zip(zone.iter()) {
            let mut n = [outside; 4];
            if small {
                let [i, j, k] = [local[a as usize], local[b as usize], local[c as usize]];
                n = [outside, table[at(k, j)], table[at(i, k)], table[at(j, i)]];
            }
            cells[id as usize] = Cell { v: [vertex, a, b, c], n };
            state[id as usize] = UNKNOWN;
            cells[outside.cell() as usize].n[outside.index()] = Face::new(id, 0);
            // Each tested cell outside the zone is behind a wall, so this resets all their marks.
            state[outside.cell() as usize] = UNKNOWN;
        }
        // The next site is close on the curve, so the walk to it starts at a new cell.
        self.last = zone[count - 1];
        for &id in &zone[count..] {
            cells[id as usize].v[0] = UNUSED;
            state[id as usize] = UNKNOWN;
            self.free.push(id);
        }
        if !small {
            self.link_by_hashing(count);
        }
        Ok(())
    }

    /// Extends the zone by records until there is one for each wall.
    fn allocate(&mut self, walls: usize) -> Result<(), TriangulationError> {
        let missing = walls.saturating_sub(self.zone.len());
        let reused = missing.min(self.free.len());
        self.zone.extend(self.free.drain(self.free.len() - reused..).rev());
        let (start, end) = (self.cells.len(), self.cells.len() + missing - reused);
        if end > MAX_CELLS {
            let points = self.sites.len() - 1;
            return Err(TriangulationError::TooLarge { points, limit: MAX_CELLS });
        }
        self.zone.extend(start as u32..end as u32);
        self.cells.resize(end, Cell { v: [UNUSED; 4], n: [Face::NONE; 4] });
        self.state.resize(end, UNKNOWN);
        Ok(())
    }

    /// Numbers the vertices of the walls, and notes for each directed edge, by the numbers of its
    /// ends, the facet of the new cell behind it.
    ///
    /// Two new cells share a facet where their walls share an edge, and each directed edge belongs to
    /// one wall. The table need not be cleared: the walls form a closed surface, so every edge that
    /// is read was written just before.
    fn tabulate_edges(&mut self, count: usize) {
        let Self { walls, local, table, zone, tag, .. } = self;
        *tag = tag.wrapping_add(TABLE as u32);
        if *tag == 0 {
            // All tags have been in use.
            local.fill(0);
            *tag = TABLE as u32;
        }
        let (local, tag) = (&mut local[..], *tag);
        let mut next = tag;
        for (wall, &id) in walls[..count].iter().zip(zone.iter()) {
            let mut numbers = [0; 3];
            for (v, number) in wall.v.into_iter().zip(&mut numbers) {
                let known = &mut local[v as usize];
                let fresh = *known < tag;
                *number = if fresh { next } else { *known };
                *known = *number;
                next += u32::from(fresh);
            }
            let [a, b, c] = numbers;
            table[at(b, c)] = Face::new(id, 1);
            table[at(c, a)] = Face::new(id, 2);
            table[at(a, b)] = Face::new(id, 3);
        }
    }

    /// Links the new cells of a large conflict zone through a hash table of undirected edges.
    fn link_by_hashing(&mut self, count: usize) {
        let Self { walls, edges, cells, zone, .. } = self;
        // At most half full: there are three edges for every two walls.
        let size = (3 * count).next_power_of_two();
        edges.clear();
        edges.resize(size, (0, Face::NONE));
        for (wall, &id) in walls[..count].iter().zip(zone.iter()) {
            let [a, b, c] = wall.v;
            for (i, (x, y)) in [(b, c), (c, a), (a, b)].into_iter().enumerate() {
                let face = Face::new(id, i + 1);
                // Never zero, the mark of a free slot, since the ends differ.
                let key = u64::from(x.min(y)) << 32 | u64::from(x.max(y));
                // Fibonacci hashing with linear probing: the upper half depends on both ends.
                let mut slot = (key.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32) as usize % size;
                while edges[slot].0 != 0 && edges[slot].0 != key {
                    slot = (slot + 1) % size;
                }
                if edges[slot].0 == 0 {
                    edges[slot] = (key, face);
                } else {
                    let twin = edges[slot].1;
                    cells[face.cell() as usize].n[face.index()] = twin;
                    cells[twin.cell() as usize].n[twin.index()] = face;
                }
            }
        }
    }
}
