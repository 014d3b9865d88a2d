//! Edge collapse on a non-manifold simplicial complex of dimension at most two.
//!
//! [`CollapseComplex`] is the shrinking complex, [`CollapseQueue`] decides which edge is next. The
//! main loop, the costs and the placement belong to the method:
//!
//! 1. [`CollapseComplex::from_mesh`]; a [`Candidate`] for each edge into the queue.
//! 2. [`CollapseQueue::pop`] the cheapest candidate that is still current.
//! 3. Optional tests: [`CollapseComplex::keeps_homotopy`] and [`CollapseComplex::folded_face`]. A
//!    candidate that fails is set aside with [`CollapseQueue::park`] at the vertices that hold it
//!    back, such as [`CollapseComplex::homotopy_obstacles`].
//! 4. [`CollapseComplex::collapse`]; new candidates for the edges of the merged sphere;
//!    [`CollapseQueue::wake`] for both ends.
//! 5. [`CollapseComplex::to_mesh`].
//!
//! # Representation
//!
//! Each vertex `v` stores its link: the neighbours of `v`, and for each face `{v, p, q}` the side
//! `{p, q}` opposite `v`. An edge is a pair of vertices that name each other as neighbours, a face
//! a triple in which each vertex names the side of the other two; neither has an id. An edge can
//! have any number of faces, and a collapse reads and writes short contiguous lists only.
//!
//! A collapse of `(a, b)` is the simplicial map that sends `b` to `a` (Dey, Edelsbrunner, Guha,
//! Nekhayev 1999, *Topology preserving edge contraction*): simplices that become equal merge, and
//! faces with both ends become edges. [`replay`] computes the same map on the initial mesh from
//! the record alone: levels of a hierarchy are made so, and the engine is tested against it.
//!
//! Every vertex has a stamp, which grows with each collapse at the vertex itself. A queued candidate
//! remembers the stamps of its edge; if they differ when it is popped, it is out of date and dropped.

mod check;
mod contract;
mod heap;
mod hierarchy;
mod inversion;
mod link;
mod pool;
mod queue;
mod record;
#[cfg(test)]
mod tests;

pub use check::CollapseError;
pub use heap::{LazyHeap, Prioritised};
pub use hierarchy::{
    Change, Hierarchy, HierarchyError, HierarchyFileError, HierarchyFileErrorKind, Stage, Step,
};
pub use inversion::folds_over;
pub use queue::{Candidate, CollapseQueue};
pub use record::{Collapse, replay};

use pool::{List, Pool};

use super::{MedialMesh, Sphere};

/// A complex under edge collapse.
///
/// Vertices keep the ids of the mesh that it was made from; a collapse retires one of two ids.
#[derive(Clone, Debug)]
pub struct CollapseComplex {
    spheres: Vec<Sphere>,
    alive: Vec<bool>,
    stamps: Vec<u32>,
    neighbours: Vec<List>,
    neighbour_pool: Pool<u32>,
    sides: Vec<List>,
    side_pool: Pool<[u32; 2]>,
    marks: Marks,
    /// The sides in the links of both ends of a collapsing edge; a field to save allocations.
    shared: Vec<[u32; 2]>,
    record: Option<Vec<Collapse>>,
    sphere_count: usize,
    edge_count: usize,
    face_count: usize,
}

impl CollapseComplex {
    /// The complex of a mesh in canonical form. Cost `O(n)`.
    ///
    /// # Panics
    /// If an edge or a face names a sphere that does not exist, or there are more than `2^32`
    /// incidences.
    pub fn from_mesh(mesh: &MedialMesh) -> Self {
        debug_assert_eq!(mesh.check(), Ok(()));
        let spheres = mesh.spheres.len();
        let (mut degrees, mut valences) = (vec![0; spheres], vec![0; spheres]);
        for &v in mesh.edges.as_flattened() {
            degrees[v as usize] += 1;
        }
        for &v in mesh.faces.as_flattened() {
            valences[v as usize] += 1;
        }
        let (mut neighbour_pool, mut neighbours) = Pool::with_capacities(&degrees);
        let (mut side_pool, mut sides) = Pool::with_capacities(&valences);
        for &[a, b] in &mesh.edges {
            neighbour_pool.push(&mut neighbours[a as usize], b);
            neighbour_pool.push(&mut neighbours[b as usize], a);
        }
        for &[a, b, c] in &mesh.faces {
            side_pool.push(&mut sides[a as usize], [b, c]);
            side_pool.push(&mut sides[b as usize], [a, c]);
            side_pool.push(&mut sides[c as usize], [a, b]);
        }
        Self {
            spheres: mesh.spheres.clone(),
            alive: vec![true; spheres],
            stamps: vec![0; spheres],
            neighbours,
            neighbour_pool,
            sides,
            side_pool,
            marks: Marks::new(spheres),
            shared: Vec::new(),
            record: None,
            sphere_count: spheres,
            edge_count: mesh.edges.len(),
            face_count: mesh.faces.len(),
        }
    }

    /// The same complex, writing down every collapse from now on.
    #[must_use]
    pub fn recording(mut self) -> Self {
        self.record = Some(Vec::new());
        self
    }

    /// The collapses since [`CollapseComplex::recording`], first to last; empty without it.
    pub fn record(&self) -> &[Collapse] {
        self.record.as_deref().unwrap_or_default()
    }

    /// The complex as it is now, in canonical form; the spheres keep their order.
    /// Cost `O(n log d)` for degrees up to `d`.
    pub fn to_mesh(&self) -> MedialMesh {
        let mut renumbered = vec![u32::MAX; self.spheres.len()];
        let mut spheres = Vec::with_capacity(self.sphere_count);
        for v in self.vertices() {
            renumbered[v as usize] = spheres.len() as u32;
            spheres.push(self.sphere(v));
        }
        let new = |v: u32| renumbered[v as usize];
        let mut edges = Vec::with_capacity(self.edge_count);
        let mut faces = Vec::with_capacity(self.face_count);
        // Renumbering keeps the order, so sorting within each vertex sorts the whole.
        for v in self.vertices() {
            let (first_edge, first_face) = (edges.len(), faces.len());
            edges.extend(self.neighbours(v).iter().filter(|&&w| v < w).map(|&w| [new(v), new(w)]));
            edges[first_edge..].sort_unstable();
            let larger = self.opposite_sides(v).iter().filter(|side| v < side[0]);
            faces.extend(larger.map(|&[p, q]| [new(v), new(p), new(q)]));
            faces[first_face..].sort_unstable();
        }
        MedialMesh { spheres, edges, faces, contacts: None }
    }

    /// Number of spheres left.
    pub fn sphere_count(&self) -> usize {
        self.sphere_count
    }

    /// Number of edges left.
    pub fn edge_count(&self) -> usize {
        self.edge_count
    }

    /// Number of faces left.
    pub fn face_count(&self) -> usize {
        self.face_count
    }

    /// Ids of the vertices left, ascending.
    pub fn vertices(&self) -> impl Iterator<Item = u32> + '_ {
        (0..self.spheres.len() as u32).filter(|&v| self.alive[v as usize])
    }

    /// Edges left, as ascending pairs, in an unspecified but deterministic order.
    pub fn edges(&self) -> impl Iterator<Item = [u32; 2]> + '_ {
        self.vertices()
            .flat_map(|v| self.neighbours(v).iter().filter(move |&&w| v < w).map(move |&w| [v, w]))
    }

    /// Whether a vertex is left.
    #[inline]
    pub fn is_alive(&self, v: u32) -> bool {
        self.alive[v as usize]
    }

    /// The sphere of a vertex.
    #[inline]
    pub fn sphere(&self, v: u32) -> Sphere {
        self.spheres[v as usize]
    }

    /// The vertices that share an edge with `v`, each once, in no particular order.
    #[inline]
    pub fn neighbours(&self, v: u32) -> &[u32] {
        self.neighbour_pool.get(self.neighbours[v as usize])
    }

    /// For each face of `v` its side opposite `v`, as an ascending pair, in no particular order.
    #[inline]
    pub fn opposite_sides(&self, v: u32) -> &[[u32; 2]] {
        self.side_pool.get(self.sides[v as usize])
    }

    /// Whether `{a, b, c}` is a face. Cost: the shortest of the three links.
    pub fn has_face(&self, a: u32, b: u32, c: u32) -> bool {
        let faces_of = |v: u32| self.sides[v as usize].len();
        let [v, p, q] = if faces_of(a) <= faces_of(b) && faces_of(a) <= faces_of(c) {
            [a, b, c]
        } else if faces_of(b) <= faces_of(c) {
            [b, a, c]
        } else {
            [c, a, b]
        };
        self.opposite_sides(v).contains(&[p.min(q), p.max(q)])
    }

    /// The stamp of an edge, which changes with every collapse at either end; `None` when an end is
    /// gone.
    #[inline]
    pub(super) fn stamp(&self, a: u32, b: u32) -> Option<u32> {
        let [i, j] = [a as usize, b as usize];
        // Stamps only grow, so the sum changes whenever one of them does.
        (self.alive[i] && self.alive[j]).then(|| self.stamps[i].wrapping_add(self.stamps[j]))
    }

    /// Declares every candidate with the end `v` out of date. For methods whose costs depend on more
    /// than the two ends of an edge.
    pub fn touch(&mut self, v: u32) {
        let stamp = &mut self.stamps[v as usize];
        *stamp = stamp.wrapping_add(1);
    }
}

/// A set of vertices that is cleared in constant time: `v` is in it if its mark is `current`.
#[derive(Clone, Debug)]
struct Marks {
    of_vertex: Vec<u32>,
    current: u32,
}

impl Marks {
    fn new(vertices: usize) -> Self {
        Self { of_vertex: vec![0; vertices], current: 0 }
    }

    fn clear(&mut self) {
        self.current = self.current.wrapping_add(1);
        // After 2^32 clears old marks would become valid again.
        if self.current == 0 {
            self.of_vertex.fill(0);
            self.current = 1;
        }
    }

    #[inline]
    fn insert(&mut self, v: u32) {
        self.of_vertex[v as usize] = self.current;
    }

    #[inline]
    fn remove(&mut self, v: u32) {
        self.of_vertex[v as usize] = self.current.wrapping_sub(1);
    }

    #[inline]
    fn contains(&self, v: u32) -> bool {
        self.of_vertex[v as usize] == self.current
    }
}
