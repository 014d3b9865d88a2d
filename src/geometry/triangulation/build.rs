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
//! An infinite cell is in conflict with the sites strictly beyond its facet; with a site in the
//! facet's plane, if its finite neighbour is, since the sphere through three coplanar points meets
//! the plane in their circle, perturbed alike.

use super::cells::{Cell, Face, INFINITE, MAX_CELLS, OPPOSITE, UNUSED};
use super::error::TriangulationError;
use crate::geometry::predicates::{
    Filter, Metric, Sign, Site, UNDERFLOW, approximate_orientation, in_conflict_given,
    sites_collinear,
};

/// What is known of a cell while a conflict zone grows: nothing, tested or about to be, and in
/// conflict. The last two are bits, the second never without the first.
const UNKNOWN: u8 = 0;
const TESTED: u8 = 1;
const CONFLICT: u8 = 3;

/// Local number of a vertex that is not on the boundary of the conflict zone.
const ABSENT: u8 = u8::MAX;

/// Boundaries of up to this many vertices are linked through a square table.
const TABLE: usize = 64;

/// A facet of the boundary of the conflict zone: its vertices, counter-clockwise from outside, and
/// the facet as a face of the cell outside.
#[derive(Clone, Copy)]
struct Wall {
    v: [u32; 3],
    outside: Face,
    /// Numbers of the vertices among those of all walls.
    local: [u8; 3],
}

/// A cell beside the conflict zone, and what decides whether it belongs to it.
#[derive(Clone, Copy)]
struct Candidate {
    cell: u32,
    det: f64,
    bound: f64,
}

/// A triangulation that grows.
pub(super) struct Builder<M> {
    /// Sites by vertex, in the order of insertion; the first is a dummy for the vertex at infinity.
    pub(super) sites: Vec<Site>,
    pub(super) cells: Vec<Cell>,
    filter: Filter,
    state: Vec<u8>,
    free: Vec<u32>,
    last: u32,
    zone: Vec<u32>,
    walls: Vec<Wall>,
    front: Vec<Candidate>,
    local: Vec<u8>,
    rim: [u32; TABLE + 1],
    table: Box<[Face; TABLE * TABLE]>,
    metric: std::marker::PhantomData<M>,
}

impl<M: Metric> Builder<M> {
    /// Triangulates distinct sites; `sites[0]` is a dummy, and the order of the others may change
    /// to bring four independent ones to the front, in `ids` alike.
    pub(super) fn build(
        mut sites: Vec<Site>,
        ids: &mut [u32],
        filter: Filter,
    ) -> Result<Self, TriangulationError> {
        bring_independent_to_front(&mut sites, ids)?;
        // Surfaces need up to 8 cells for each site. Reserved memory that is not touched costs nothing.
        let expected = 9 * sites.len() + 64;
        let mut builder = Self {
            cells: Vec::with_capacity(expected),
            filter,
            state: Vec::with_capacity(expected),
            free: Vec::new(),
            last: 0,
            zone: Vec::new(),
            walls: Vec::new(),
            front: Vec::new(),
            local: vec![ABSENT; sites.len()],
            rim: [0; TABLE + 1],
            table: Box::new([Face::NONE; TABLE * TABLE]),
            sites,
            metric: std::marker::PhantomData,
        };
        builder.start();
        for vertex in 5..builder.sites.len() as u32 {
            builder.insert(vertex)?;
        }
        Ok(builder)
    }

    /// The first cell and its four infinite neighbours.
    fn start(&mut self) {
        let s = &self.sites;
        let positive = self.filter.orient3d(&s[1].p, &s[2].p, &s[3].p, &s[4].p) == Sign::Positive;
        let v = if positive { [1, 2, 3, 4] } else { [1, 2, 4, 3] };
        self.cells.push(Cell { v, n: [Face::NONE; 4] });
        for i in 0..4 {
            let f = OPPOSITE[i].map(|k| v[k]);
            self.cells.push(Cell { v: [f[0], f[1], f[2], INFINITE], n: [Face::NONE; 4] });
            self.cells[0].n[i] = Face::new(i as u32 + 1, 3);
            self.cells[i + 1].n[3] = Face::new(0, i);
        }
        for i in 1..5u32 {
            for j in (1..5u32).filter(|&j| j != i) {
                // Infinite cell `i` lacks vertex `v[i - 1]`: its neighbour opposite to `v[j - 1]`
                // is cell `j`.
                let a = self.position(i, v[j as usize - 1]);
                let b = self.position(j, v[i as usize - 1]);
                self.cells[i as usize].n[a] = Face::new(j, b);
            }
        }
        self.state.resize(5, UNKNOWN);
    }

    fn position(&self, cell: u32, vertex: u32) -> usize {
        let v = self.cells[cell as usize].v;
        v.iter().position(|&x| x == vertex).expect("the cell has the vertex")
    }

    fn insert(&mut self, vertex: u32) -> Result<(), TriangulationError> {
        let mut seed = self.walk_approximately(vertex);
        if !self.conflicts(seed, vertex) {
            seed = self.walk_exactly(vertex, seed);
            if !self.conflicts(seed, vertex) {
                debug_assert!(M::WEIGHTED, "the cell that contains a site is in conflict with it");
                return Ok(());
            }
        }
        self.find_conflict_zone(vertex, seed);
        self.collect_walls();
        self.stellate(vertex)
    }

    /// Walks towards the site in rounded arithmetic, for a bounded number of steps.
    fn walk_approximately(&self, vertex: u32) -> u32 {
        let p = &self.sites[vertex as usize].p;
        let mut c = self.last;
        if self.cells[c as usize].is_infinite() {
            c = self.cells[c as usize].n[3].cell();
        }
        let mut from = c;
        for _ in 0..self.cells.len() {
            let cell = &self.cells[c as usize];
            if cell.is_infinite() {
                break;
            }
            let site = |i: usize| &self.sites[cell.v[i] as usize].p;
            let s = [site(0), site(1), site(2), site(3)];
            let exit = (0..4).find(|&i| {
                let f = OPPOSITE[i];
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

    /// Walks to the cell that contains the site, or to an infinite cell that it is strictly beyond
    /// the facet of.
    ///
    /// Visibility walks end in Delaunay and regular triangulations, because they climb the power
    /// of the site.
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

    fn conflicts(&self, cell: u32, vertex: u32) -> bool {
        let site = &self.sites[vertex as usize];
        let (det, bound) = determinant::<M>(&self.cells, &self.sites, cell, site);
        conflicts_given::<M>(self.filter, &self.cells, &self.sites, cell, site, det, bound)
    }

    /// Marks and lists the cells in conflict with the site.
    ///
    /// Generation by generation: the neighbours of the last one are collected, then tested
    /// together, so that no test waits for the verdict on another.
    fn find_conflict_zone(&mut self, vertex: u32, seed: u32) {
        self.zone.clear();
        self.zone.push(seed);
        self.state[seed as usize] = CONFLICT;
        let mut generation = 0;
        while generation < self.zone.len() {
            let front = self.collect_front(generation);
            generation = self.zone.len();
            self.test_front(vertex, front);
        }
    }

    /// Collects the unknown neighbours of the zone from `generation` on; returns their number.
    ///
    /// Every neighbour is written, and counted if it was unknown: whether it is cannot be
    /// predicted, and a wrong guess would cost more than the write.
    fn collect_front(&mut self, generation: usize) -> usize {
        let Self { cells, state, zone, front, .. } = self;
        let most = 4 * (zone.len() - generation);
        if front.len() < most {
            front.resize(most, Candidate { cell: 0, det: 0.0, bound: 0.0 });
        }
        let mut count = 0;
        for &c in &zone[generation..] {
            for n in cells[c as usize].n {
                let known = &mut state[n.cell() as usize];
                front[count].cell = n.cell();
                count += usize::from(*known == UNKNOWN);
                *known |= TESTED;
            }
        }
        count
    }

    /// Tests the first `count` candidates and appends those in conflict to the zone.
    fn test_front(&mut self, vertex: u32, count: usize) {
        let Self { cells, sites, state, zone, front, filter, .. } = self;
        let site = &sites[vertex as usize];
        let front = &mut front[..count];
        let mut pairs = front.chunks_exact_mut(2);
        for pair in &mut pairs {
            let finite = |i: usize| sites_of(sites, finite_side(cells, pair[i].cell));
            let [first, second] = Filter::lifted_determinants::<M>([finite(0), finite(1)], site);
            (pair[0].det, pair[0].bound) = first;
            (pair[1].det, pair[1].bound) = second;
        }
        for candidate in pairs.into_remainder() {
            (candidate.det, candidate.bound) = determinant::<M>(cells, sites, candidate.cell, site);
        }
        let mut size = zone.len();
        zone.resize(size + count, 0);
        for &Candidate { cell, det, bound } in front.iter() {
            let decided = det.abs() > bound + UNDERFLOW && !cells[cell as usize].is_infinite();
            let conflict = if decided {
                det > 0.0
            } else {
                conflicts_given::<M>(*filter, cells, sites, cell, site, det, bound)
            };
            zone[size] = cell;
            size += usize::from(conflict);
            state[cell as usize] |= u8::from(conflict) * CONFLICT;
        }
        zone.truncate(size);
    }

    /// Lists the facets between the conflict zone and the cells around it.
    fn collect_walls(&mut self) {
        let Self { cells, state, zone, walls, .. } = self;
        let most = 4 * zone.len();
        walls.clear();
        walls.resize(most, Wall { v: [0; 3], outside: Face::NONE, local: [ABSENT; 3] });
        let mut count = 0;
        for &c in zone.iter() {
            let cell = &cells[c as usize];
            for i in 0..4 {
                let outside = cell.n[i];
                let [a, b, c] = OPPOSITE[i];
                walls[count] =
                    Wall { v: [cell.v[a], cell.v[b], cell.v[c]], outside, local: [ABSENT; 3] };
                count += usize::from(state[outside.cell() as usize] == TESTED);
            }
        }
        walls.truncate(count);
    }

    /// Replaces the conflict zone by the cone of its walls from the site.
    fn stellate(&mut self, vertex: u32) -> Result<(), TriangulationError> {
        self.allocate()?;
        let Self { cells, state, zone, walls, .. } = self;
        for (wall, &id) in walls.iter_mut().zip(zone.iter()) {
            // The vertex at infinity goes last.
            if wall.v[0] == INFINITE {
                wall.v.rotate_left(1);
            } else if wall.v[1] == INFINITE {
                wall.v.rotate_right(1);
            }
            let [a, b, c] = wall.v;
            let outside = wall.outside;
            cells[id as usize] = Cell { v: [vertex, a, b, c], n: [outside; 4] };
            state[id as usize] = UNKNOWN;
            cells[outside.cell() as usize].n[outside.index()] = Face::new(id, 0);
            state[outside.cell() as usize] = UNKNOWN;
        }
        self.last = self.zone[self.walls.len() - 1];
        for &id in &self.zone[self.walls.len()..] {
            self.cells[id as usize].v[0] = UNUSED;
            self.state[id as usize] = UNKNOWN;
            self.free.push(id);
        }
        // The walls are a triangulated sphere: by Euler's relation it has two more vertices than
        // half its triangles.
        if self.walls.len() / 2 + 2 <= TABLE {
            self.link_by_table();
        } else {
            self.link_by_sorting();
        }
        Ok(())
    }

    /// Extends the zone by records until there is one for each wall.
    fn allocate(&mut self) -> Result<(), TriangulationError> {
        while self.zone.len() < self.walls.len() {
            let id = if let Some(id) = self.free.pop() {
                id
            } else if self.cells.len() < MAX_CELLS {
                self.state.push(UNKNOWN);
                self.cells.push(Cell { v: [UNUSED; 4], n: [Face::NONE; 4] });
                self.cells.len() as u32 - 1
            } else {
                let points = self.sites.len() - 1;
                return Err(TriangulationError::TooLarge { points, limit: MAX_CELLS });
            };
            self.zone.push(id);
        }
        Ok(())
    }

    /// Links new cells with each other: two share a facet where their walls share an edge, and
    /// each directed edge belongs to one wall.
    ///
    /// Vertices of the walls are numbered, and a table of their pairs filled and read; it need not
    /// be cleared, since exactly the edges that are read have been written.
    fn link_by_table(&mut self) {
        let Self { walls, local, rim, table, cells, zone, .. } = self;
        let at = |a: u8, b: u8| (usize::from(a) * TABLE + usize::from(b)) % (TABLE * TABLE);
        let mut count = 0;
        for (wall, &id) in walls.iter_mut().zip(zone.iter()) {
            for (v, number) in wall.v.into_iter().zip(&mut wall.local) {
                let known = &mut local[v as usize];
                let fresh = *known == ABSENT;
                *known = if fresh { count as u8 } else { *known };
                *number = *known;
                rim[count] = v;
                count += usize::from(fresh);
            }
            let [a, b, c] = wall.local;
            table[at(b, c)] = Face::new(id, 1);
            table[at(c, a)] = Face::new(id, 2);
            table[at(a, b)] = Face::new(id, 3);
        }
        for (wall, &id) in walls.iter().zip(zone.iter()) {
            let [a, b, c] = wall.local;
            let n = &mut cells[id as usize].n;
            n[1] = table[at(c, b)];
            n[2] = table[at(a, c)];
            n[3] = table[at(b, a)];
        }
        for &v in &rim[..count] {
            local[v as usize] = ABSENT;
        }
    }

    /// The same for large conflict zones.
    fn link_by_sorting(&mut self) {
        let mut edges = Vec::with_capacity(3 * self.walls.len());
        for (wall, &id) in self.walls.iter().zip(&self.zone) {
            let [a, b, c] = wall.v;
            for (i, (x, y)) in [(b, c), (c, a), (a, b)].into_iter().enumerate() {
                edges.push((x.min(y), x.max(y), Face::new(id, i + 1).0));
            }
        }
        edges.sort_unstable();
        for pair in edges.chunks_exact(2) {
            let (f, g) = (Face(pair[0].2), Face(pair[1].2));
            debug_assert!(pair[0].0 == pair[1].0 && pair[0].1 == pair[1].1);
            self.cells[f.cell() as usize].n[f.index()] = g;
            self.cells[g.cell() as usize].n[g.index()] = f;
        }
    }
}

/// The finite cell whose orthosphere decides about conflict with a cell, itself or the finite
/// neighbour of an infinite one.
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

/// Whether a site is in conflict with a cell, see the head of this file; `det` and `bound` are
/// those of [`determinant`].
#[inline(always)]
fn conflicts_given<M: Metric>(
    filter: Filter,
    cells: &[Cell],
    sites: &[Site],
    cell: u32,
    site: &Site,
    det: f64,
    bound: f64,
) -> bool {
    let v = cells[cell as usize].v;
    if v[3] == INFINITE {
        let [a, b, c] = [&sites[v[0] as usize], &sites[v[1] as usize], &sites[v[2] as usize]];
        match filter.orient3d(&a.p, &b.p, &c.p, &site.p) {
            Sign::Positive => return true,
            Sign::Negative => return false,
            Sign::Zero => {}
        }
    }
    let finite = sites_of(sites, finite_side(cells, cell));
    in_conflict_given::<M>(filter, det, bound, finite, site)
}

/// Swaps the first four affinely independent sites into places 1 to 4.
fn bring_independent_to_front(
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
    ids.swap(2, third - 1);
    let c = sites[3].p;
    let fourth =
        (4..sites.len()).find(|&i| Filter::ANY.orient3d(&a, &b, &c, &sites[i].p) != Sign::Zero);
    let fourth = fourth.ok_or(TriangulationError::Coplanar { distinct })?;
    sites.swap(4, fourth);
    ids.swap(3, fourth - 1);
    Ok(())
}
