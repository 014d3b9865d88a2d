//! Queries that need adjacency alone.

use crate::predicates::{Filter, Metric, Sign, Site, in_conflict};
use crate::triangulation::{Cell, CellId, Face, OPPOSITE, Triangulation, VertexId};

/// A facet (triangle), given as a cell and the index of the vertex opposite to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Facet {
    /// One of the two cells of the facet.
    pub cell: CellId,
    /// The index, 0 to 3, of the cell's vertex that the facet lacks.
    pub opposite: usize,
}

impl Triangulation {
    /// The number of cells, finite and infinite.
    pub fn cell_count(&self) -> usize {
        self.cells.len()
    }

    /// The number of finite cells; their ids are those below it.
    pub fn finite_cell_count(&self) -> usize {
        self.finite
    }

    /// The number of infinite cells, which is the number of facets of the convex hull.
    pub fn infinite_cell_count(&self) -> usize {
        self.cells.len() - self.finite
    }

    /// The number of finite vertices.
    pub fn vertex_count(&self) -> usize {
        self.vertices
    }

    /// Whether a cell has the vertex at infinity, its last.
    #[inline]
    pub fn is_infinite(&self, cell: CellId) -> bool {
        cell.index() >= self.finite
    }

    /// The vertices of a cell. Those of a finite cell are positively oriented: `d` sees `a, b, c`
    /// counter-clockwise ([`orient3d`](crate::predicates::orient3d)). In an infinite cell the last
    /// one is [`VertexId::INFINITE`], and the others are counter-clockwise as seen from outside the
    /// convex hull.
    ///
    /// # Panics
    /// If there is no such cell.
    #[inline]
    pub fn vertices(&self, cell: CellId) -> [VertexId; 4] {
        self.cells[cell.index()].v.map(VertexId)
    }

    /// The neighbours of a cell; the `i`-th shares the facet opposite to the `i`-th vertex.
    #[inline]
    pub fn neighbours(&self, cell: CellId) -> [CellId; 4] {
        self.cells[cell.index()].n.map(|f| CellId(f.cell()))
    }

    /// The same facet as seen from its other cell.
    #[inline]
    pub fn mirror(&self, facet: Facet) -> Facet {
        self.cells[facet.cell.index()].n[facet.opposite].into()
    }

    /// The vertices of a facet, counter-clockwise as seen from outside its cell.
    #[inline]
    pub fn facet_vertices(&self, facet: Facet) -> [VertexId; 3] {
        let v = self.cells[facet.cell.index()].v;
        OPPOSITE[facet.opposite].map(|k| VertexId(v[k]))
    }

    /// All cells.
    pub fn cells(&self) -> impl ExactSizeIterator<Item = CellId> + use<> {
        (0..self.cells.len() as u32).map(CellId)
    }

    /// The finite cells.
    pub fn finite_cells(&self) -> impl ExactSizeIterator<Item = CellId> + use<> {
        (0..self.finite as u32).map(CellId)
    }

    /// The infinite cells, one for each facet of the convex hull.
    pub fn infinite_cells(&self) -> impl ExactSizeIterator<Item = CellId> + use<> {
        (self.finite as u32..self.cells.len() as u32).map(CellId)
    }

    /// The finite edges, each once, as a cell and the indices of its two vertices there; the cell
    /// is the one with the smallest id around the edge.
    ///
    /// Cost: for each edge and each of its cells, one turn around the edge.
    pub fn finite_edges(&self) -> impl Iterator<Item = (CellId, usize, usize)> + '_ {
        const PAIRS: [(usize, usize); 6] = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];
        self.finite_cells().flat_map(move |cell| {
            PAIRS.into_iter().filter_map(move |(i, j)| {
                self.edge_ring(cell, i, j).all(|c| c >= cell).then_some((cell, i, j))
            })
        })
    }

    /// The cells around the edge of vertices `i` and `j` of a cell, from that cell on, infinite
    /// ones included, counter-clockwise about the direction from `i` to `j`.
    ///
    /// Consecutive cells share a facet, as do the last and the first.
    ///
    /// # Panics
    /// If `i` equals `j` or one of them exceeds 3.
    pub fn edge_ring(&self, cell: CellId, i: usize, j: usize) -> EdgeRing<'_> {
        assert!(i != j && i < 4 && j < 4, "an edge has two different ends, not {i} and {j}");
        let v = self.cells[cell.index()].v;
        // (i, j, x, y) even: the ring turns from x to y and leaves through the facet without x.
        let f = OPPOSITE[i];
        let at = f.iter().position(|&k| k == j).unwrap_or(0);
        let (x, y) = (f[(at + 1) % 3], f[(at + 2) % 3]);
        EdgeRing { triangulation: self, start: cell.0, next: Some((cell.0, x)), hinge: v[y] }
    }

    /// The cell of a vertex with the smallest id; `None` for a point that is not a vertex.
    #[inline]
    pub fn incident_cell(&self, vertex: VertexId) -> Option<CellId> {
        self.incident.get(vertex.index()).copied().filter(|&c| c != CellId::NONE)
    }

    /// Whether an input point is a vertex.
    #[inline]
    pub fn is_vertex(&self, vertex: VertexId) -> bool {
        self.incident_cell(vertex).is_some()
    }

    pub(super) fn records(&self) -> &[Cell] {
        &self.cells
    }
}

impl From<Face> for Facet {
    #[inline]
    fn from(face: Face) -> Self {
        Self { cell: CellId(face.cell()), opposite: face.index() }
    }
}

/// The cells around an edge, see [`Triangulation::edge_ring`].
#[derive(Clone, Debug)]
pub struct EdgeRing<'t> {
    triangulation: &'t Triangulation,
    start: u32,
    /// The current cell and the index of the vertex whose opposite facet leads on.
    next: Option<(u32, usize)>,
    /// The vertex of the current cell that the next cell keeps, beside the edge.
    hinge: u32,
}

impl Iterator for EdgeRing<'_> {
    type Item = CellId;

    #[inline]
    fn next(&mut self) -> Option<CellId> {
        let (cell, leave) = self.next?;
        let cells = &self.triangulation.cells;
        let face = cells[cell as usize].n[leave];
        let (after, arrived) = (face.cell(), face.index());
        self.next = (after != self.start).then(|| {
            // The facet opposite to the old hinge leads on; the newly met vertex is the new one.
            let v = &cells[after as usize].v;
            let leave = v.iter().position(|&x| x == self.hinge).unwrap_or(0);
            self.hinge = v[arrived];
            (after, leave)
        });
        Some(CellId(cell))
    }
}

// Verification of a triangulation, combinatorial and geometric.

/// The first violation that a check found.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[expect(missing_docs, reason = "the messages name the fields")]
pub enum Violation {
    /// The vertex at infinity is where it must not be, or a vertex does not exist.
    #[error("cell {cell:?} has the vertices {vertices:?}")]
    Vertices { cell: CellId, vertices: [VertexId; 4] },
    /// A neighbour does not lead back, or does not have the same facet.
    #[error("facet {facet:?} does not match its mirror {mirror:?}")]
    Adjacency { facet: Facet, mirror: Facet },
    /// Euler's relation fails, or the cells around a vertex are not connected.
    #[error("Euler characteristic {found} of the closed triangulation, 0 expected")]
    Euler { found: i64 },
    /// A vertex's incident cell lacks the vertex.
    #[error("vertex {vertex:?} is recorded with a cell that lacks it")]
    Incident { vertex: VertexId },
    /// A finite cell is flat or inside out.
    #[error("cell {cell:?} has orientation {sign:?}")]
    Orientation { cell: CellId, sign: Sign },
    /// The vertex opposite to a facet is inside the perturbed orthosphere of the cell; for an
    /// infinite cell, the hull is not convex there.
    #[error("facet {facet:?} is not locally regular")]
    Regularity { facet: Facet },
    /// A point that is not a vertex should be one, or is recorded wrongly.
    #[error("point {point} is wrongly recorded as repeated or hidden")]
    Missing { point: usize },
}

impl Triangulation {
    /// Checks that adjacency is mutual, that neighbours share their facet with opposite
    /// orientation, and Euler's relation of a triangulated 3-sphere.
    ///
    /// # Errors
    /// The first violation found.
    pub fn check_combinatorics(&self) -> Result<(), Violation> {
        for cell in self.cells() {
            self.check_vertices(cell)?;
            for opposite in 0..4 {
                self.check_facet(Facet { cell, opposite })?;
            }
        }
        for v in 0..self.incident.len() as u32 {
            let vertex = VertexId(v);
            if let Some(cell) = self.incident_cell(vertex)
                && !self.records().get(cell.index()).is_some_and(|c| c.v.contains(&v))
            {
                return Err(Violation::Incident { vertex });
            }
        }
        self.check_euler()
    }

    fn check_vertices(&self, cell: CellId) -> Result<(), Violation> {
        let vertices = self.vertices(cell);
        let distinct = (0..4).all(|i| (0..i).all(|j| vertices[i] != vertices[j]));
        let last = vertices[3] == VertexId::INFINITE;
        if distinct
            && last == self.is_infinite(cell)
            && vertices[..3].iter().all(|&v| self.is_vertex(v))
            && (last || self.is_vertex(vertices[3]))
        {
            Ok(())
        } else {
            Err(Violation::Vertices { cell, vertices })
        }
    }

    fn check_facet(&self, facet: Facet) -> Result<(), Violation> {
        let mirror = self.mirror(facet);
        let violation = Violation::Adjacency { facet, mirror };
        if mirror.cell.index() >= self.cell_count() || self.mirror(mirror) != facet {
            return Err(violation);
        }
        let ours = self.facet_vertices(facet);
        let mut theirs = self.facet_vertices(mirror);
        // Each side lists the facet counter-clockwise from its own outside.
        theirs.reverse();
        let turned = (0..3).any(|_| {
            theirs.rotate_left(1);
            ours == theirs
        });
        if turned { Ok(()) } else { Err(violation) }
    }

    /// `V - E + F - C = 0`, with each edge counted at the smallest cell around it.
    fn check_euler(&self) -> Result<(), Violation> {
        let mut edges = 0i64;
        for cell in self.cells() {
            for i in 0..4 {
                for j in 0..i {
                    edges += i64::from(self.edge_ring(cell, i, j).all(|c| c >= cell));
                }
            }
        }
        // The vertex at infinity counts, and two cells share each facet: F = 2 C.
        let cells = self.cell_count() as i64;
        let found = self.vertex_count() as i64 + 1 - edges + 2 * cells - cells;
        if found == 0 { Ok(()) } else { Err(Violation::Euler { found }) }
    }

    /// Checks every cell's orientation, and every facet's regularity against the vertex across it,
    /// exactly and with the perturbation.
    pub(crate) fn check_regularity<M: Metric>(
        &self,
        sites: &[Site],
        filter: Filter,
    ) -> Result<(), Violation> {
        for cell in self.finite_cells() {
            let [a, b, c, d] = self.vertices(cell).map(|v| &sites[v.index()].p);
            let sign = filter.orient3d(a, b, c, d);
            if sign != Sign::Positive {
                return Err(Violation::Orientation { cell, sign });
            }
        }
        for cell in self.cells() {
            for opposite in 0..4 {
                let facet = Facet { cell, opposite };
                let mirror = self.mirror(facet);
                let across = self.vertices(mirror.cell)[mirror.opposite];
                if across != VertexId::INFINITE
                    && self.conflicts::<M>(sites, filter, cell, &sites[across.index()])
                {
                    return Err(Violation::Regularity { facet });
                }
            }
        }
        Ok(())
    }

    /// Whether a site that is not a vertex of it is in conflict with a cell.
    pub(crate) fn conflicts<M: Metric>(
        &self,
        sites: &[Site],
        filter: Filter,
        cell: CellId,
        site: &Site,
    ) -> bool {
        let mut cell = cell;
        if self.is_infinite(cell) {
            let [a, b, c, _] = self.vertices(cell);
            let [a, b, c] = [a, b, c].map(|v| &sites[v.index()].p);
            match filter.orient3d(a, b, c, &site.p) {
                Sign::Positive => return true,
                Sign::Negative => return false,
                // In the plane of the facet the finite neighbour decides.
                Sign::Zero => cell = self.neighbours(cell)[3],
            }
        }
        in_conflict::<M>(filter, self.vertices(cell).map(|v| &sites[v.index()]), site)
    }

    /// The cell that contains a position, by an exact walk from `start`; an infinite cell if the
    /// position is strictly outside the convex hull.
    ///
    /// Ends for any position, a site or not: its power with respect to the orthosphere of the cell
    /// falls with each step.
    pub(crate) fn walk(&self, sites: &[Site], start: CellId, p: &[f64; 3]) -> CellId {
        let mut cell = if self.is_infinite(start) { self.neighbours(start)[3] } else { start };
        loop {
            if self.is_infinite(cell) {
                return cell;
            }
            let s = self.vertices(cell).map(|v| &sites[v.index()].p);
            let exit = (0..4).find(|&i| {
                let f = OPPOSITE[i];
                Filter::ANY.orient3d(p, s[f[0]], s[f[1]], s[f[2]]) == Sign::Negative
            });
            match exit {
                Some(i) => cell = self.neighbours(cell)[i],
                None => return cell,
            }
        }
    }
}
