//! Verification of a triangulation, combinatorial and geometric.

use super::cells::OPPOSITE;
use super::{CellId, Facet, Triangulation, VertexId};
use crate::predicates::{Filter, Metric, Sign, Site, in_conflict};

/// The first violation that a check found.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Violation {
    /// The vertex at infinity is where it must not be, or a vertex does not exist.
    #[error("cell {cell:?} has the vertices {vertices:?}")]
    Vertices {
        /// The cell.
        cell: CellId,
        /// Its vertices.
        vertices: [VertexId; 4],
    },
    /// A neighbour does not lead back, or does not have the same facet.
    #[error("facet {facet:?} does not match its mirror {mirror:?}")]
    Adjacency {
        /// The facet.
        facet: Facet,
        /// The mirror facet that the cell records.
        mirror: Facet,
    },
    /// Euler's relation fails, or the cells around a vertex are not connected.
    #[error("Euler characteristic {found} of the closed triangulation, 0 expected")]
    Euler {
        /// Vertices minus edges plus facets minus cells.
        found: i64,
    },
    /// A vertex's incident cell lacks the vertex.
    #[error("vertex {vertex:?} is recorded with a cell that lacks it")]
    Incident {
        /// The vertex.
        vertex: VertexId,
    },
    /// A finite cell is flat or inside out.
    #[error("cell {cell:?} has orientation {sign:?}")]
    Orientation {
        /// The cell.
        cell: CellId,
        /// Its orientation.
        sign: Sign,
    },
    /// The vertex opposite to a facet is inside the perturbed orthosphere of the cell; for an
    /// infinite cell, the hull is not convex there.
    #[error("facet {facet:?} is not locally regular")]
    Regularity {
        /// The facet, from the cell that is in conflict.
        facet: Facet,
    },
    /// A point that is not a vertex should be one, or is recorded wrongly.
    #[error("point {point} is wrongly recorded as repeated or hidden")]
    Missing {
        /// Index of the point.
        point: usize,
    },
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
        let known = |v: VertexId| self.is_vertex(v);
        if distinct
            && last == self.is_infinite(cell)
            && vertices[..3].iter().all(|&v| known(v))
            && (last || known(vertices[3]))
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
        let site = |v: VertexId| &sites[v.index()];
        for cell in self.finite_cells() {
            let [a, b, c, d] = self.vertices(cell).map(|v| &site(v).p);
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
                    && self.conflicts::<M>(sites, filter, cell, site(across))
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
