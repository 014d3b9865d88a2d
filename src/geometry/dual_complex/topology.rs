//! The topology of the dual complex: simplices, Euler number, Betti numbers.
//!
//! C. J. A. Delfinado, H. Edelsbrunner: *An incremental algorithm for Betti numbers of simplicial
//! complexes on the 3-sphere*, Computer Aided Geometric Design 12 (1995),
//! <https://doi.org/10.1016/0167-8396(95)00016-Y>: by Alexander duality a complex in the 3-sphere has
//! one void less than its complement has components.

use super::{DualComplex, VertexId};
use crate::disjoint::DisjointSets;
use crate::triangulation::Facet;

/// The simplices of a dual complex as lists of balls: ascending in each simplex, the lists
/// themselves in lexicographic order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Simplices {
    /// The vertices.
    pub vertices: Vec<u32>,
    /// The edges.
    pub edges: Vec<[u32; 2]>,
    /// The triangles.
    pub triangles: Vec<[u32; 3]>,
    /// The tetrahedra.
    pub tetrahedra: Vec<[u32; 4]>,
}

fn ascending<const N: usize>(vertices: [VertexId; N]) -> [u32; N] {
    let mut ids = vertices.map(|v| v.0);
    ids.sort_unstable();
    ids
}

fn in_order<T: Ord>(simplices: impl Iterator<Item = T>) -> Vec<T> {
    let mut list: Vec<T> = simplices.collect();
    list.sort_unstable();
    list
}

impl DualComplex<'_> {
    /// The simplices as lists of balls.
    pub fn simplices(&self) -> Simplices {
        let regular = self.regular();
        Simplices {
            vertices: self.vertices().map(|(v, _)| v.0).collect(),
            edges: in_order(self.edges().map(|(e, _)| ascending(self.edge_vertices(e)))),
            triangles: in_order(
                self.triangles().map(|(f, _)| ascending(regular.facet_vertices(f))),
            ),
            tetrahedra: in_order(self.tetrahedra().map(|c| ascending(regular.vertices(c)))),
        }
    }

    /// The numbers of vertices, edges, triangles and tetrahedra.
    pub fn counts(&self) -> [usize; 4] {
        [
            self.vertices().count(),
            self.edges().count(),
            self.triangles().count(),
            self.tetrahedra().count(),
        ]
    }

    /// The Euler number of the complex, and so of the union of balls.
    pub fn euler(&self) -> i64 {
        let [v, e, f, t] = self.counts().map(|n| n as i64);
        v - e + f - t
    }

    /// The Betti numbers of the complex, and so of the union of balls: components, tunnels, voids.
    /// Nearly linear.
    pub fn betti(&self) -> [u64; 3] {
        let [vertices, ..] = self.counts();
        if vertices == 0 {
            return [0; 3];
        }
        let mut components = DisjointSets::singletons(self.vertices.len());
        for (edge, _) in self.edges() {
            let [a, b] = self.edge_vertices(edge);
            components.join(a.0, b.0);
        }
        // Points that are not in the complex are singletons among the sets.
        let b0 = components.len() - (self.vertices.len() - vertices);
        let b2 = self.complement_components() - 1;
        // The Euler number is b0 - b1 + b2.
        let b1 = b0 as i64 + b2 as i64 - self.euler();
        [b0 as u64, u64::try_from(b1).expect("a closed complex"), b2 as u64]
    }

    /// The number of components of the complement in the 3-sphere.
    fn complement_components(&self) -> usize {
        let regular = self.regular();
        let mut sets = DisjointSets::singletons(regular.cell_count());
        for cell in regular.cells().filter(|&c| !self.contains(c)) {
            for opposite in 0..4 {
                let facet = Facet { cell, opposite };
                let other = regular.mirror(facet).cell;
                // Facets with the vertex at infinity have no class.
                if other > cell && self.facet_class(facet).is_none() {
                    sets.join(cell.0, other.0);
                }
            }
        }
        sets.len() - self.tetrahedra().count()
    }
}
