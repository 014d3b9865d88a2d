//! Verification: closure under faces, and classes against cofaces.

use super::{CellEdge, Class, DualComplex, PAIRS};
use crate::triangulation::{CellId, Facet, VertexId};

/// The first violation that [`DualComplex::check`] met.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DualViolation {
    /// A simplex is in the complex and one of its faces is not.
    #[error("{simplex:?} is in the complex but its face {face:?} is not")]
    Open {
        /// The simplex.
        simplex: Vec<VertexId>,
        /// Its face.
        face: Vec<VertexId>,
    },
    /// The class of a simplex is not what its cofaces say.
    #[error("{simplex:?} is recorded as {found:?}, its cofaces make it {expected:?}")]
    Class {
        /// The simplex.
        simplex: Vec<VertexId>,
        /// The class recorded.
        found: Option<Class>,
        /// The class that follows.
        expected: Option<Class>,
    },
    /// An anchor, or a point that is no vertex, is in the complex.
    #[error("{vertex:?} is in the complex but no visible ball")]
    Vertex {
        /// The point.
        vertex: VertexId,
    },
}

/// The class that follows from the cofaces; `singular` is that of a simplex without any.
fn follows(all_cells: bool, any_coface: bool, singular: Option<Class>) -> Option<Class> {
    match (all_cells, any_coface) {
        (true, _) => Some(Class::Interior),
        (_, true) => Some(Class::Regular),
        _ => singular,
    }
}

impl DualComplex<'_> {
    /// Checks that the complex is closed under faces, and that each class is what the cofaces say.
    ///
    /// # Errors
    /// The first violation found.
    pub fn check(&self) -> Result<(), DualViolation> {
        for cell in self.regular.finite_cells() {
            for opposite in 0..4 {
                self.check_triangle(Facet { cell, opposite })?;
            }
        }
        for edge in self.regular.finite_edges() {
            self.check_edge(edge)?;
        }
        self.check_vertices()
    }

    fn check_class(
        simplex: &[VertexId],
        found: Option<Class>,
        all_cells: bool,
        any_coface: bool,
    ) -> Result<(), DualViolation> {
        let singular = found.filter(|&c| c == Class::Singular);
        let expected = follows(all_cells, any_coface, singular);
        if found == expected {
            return Ok(());
        }
        Err(DualViolation::Class { simplex: simplex.to_vec(), found, expected })
    }

    /// The triangle's class from both sides, and its edges.
    fn check_triangle(&self, facet: Facet) -> Result<(), DualViolation> {
        let mirror = self.regular.mirror(facet);
        let simplex = self.regular.facet_vertices(facet);
        let found = self.facet_class(facet);
        if found != self.facet_class(mirror) {
            let (simplex, expected) = (simplex.to_vec(), self.facet_class(mirror));
            return Err(DualViolation::Class { simplex, found, expected });
        }
        let (a, b) = (self.contains(facet.cell), self.contains(mirror.cell));
        Self::check_class(&simplex, found, a && b, a || b)?;
        for (i, j) in PAIRS.into_iter().filter(|&(i, j)| i != facet.opposite && j != facet.opposite)
        {
            let edge = (facet.cell, i, j);
            if found.is_some() && self.edge_class(edge).is_none() {
                let face = self.edge_vertices(edge).to_vec();
                return Err(DualViolation::Open { simplex: simplex.to_vec(), face });
            }
        }
        Ok(())
    }

    fn check_edge(&self, edge: CellEdge) -> Result<(), DualViolation> {
        let simplex = self.edge_vertices(edge);
        let ring: Vec<CellId> = self.regular.edge_ring(edge.0, edge.1, edge.2).collect();
        let all_cells = ring.iter().all(|&c| self.contains(c));
        let any_triangle = ring.iter().any(|&cell| {
            let v = self.regular.vertices(cell);
            (0..4).any(|opposite| {
                !simplex.contains(&v[opposite])
                    && self.facet_class(Facet { cell, opposite }).is_some()
            })
        });
        let found = self.edge_class(edge);
        Self::check_class(&simplex, found, all_cells, any_triangle)?;
        for v in simplex {
            if found.is_some() && self.vertex_class(v).is_none() {
                let (simplex, face) = (simplex.to_vec(), vec![v]);
                return Err(DualViolation::Open { simplex, face });
            }
        }
        Ok(())
    }

    fn check_vertices(&self) -> Result<(), DualViolation> {
        let points = self.regular.point_count();
        let (mut all_cells, mut any_edge) = (vec![true; points], vec![false; points]);
        for cell in self.regular.cells().filter(|&c| !self.contains(c)) {
            for v in self.regular.vertices(cell) {
                if v != VertexId::INFINITE {
                    all_cells[v.index()] = false;
                }
            }
        }
        for (edge, _) in self.edges() {
            for v in self.edge_vertices(edge) {
                any_edge[v.index()] = true;
            }
        }
        for v in 0..points {
            let vertex = VertexId(v as u32);
            let found = self.vertex_class(vertex);
            if self.regular.is_vertex(vertex) {
                Self::check_class(&[vertex], found, all_cells[v], any_edge[v])?;
            }
            if found.is_some() && (!self.regular.is_vertex(vertex) || v >= self.balls) {
                return Err(DualViolation::Vertex { vertex });
            }
        }
        Ok(())
    }
}
