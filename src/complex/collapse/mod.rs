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

pub use hierarchy::{Hierarchy, Step};
pub use link::CollapseError;
pub use queue::{Candidate, CollapseQueue};
use queue::{List, Pool};

use super::{MedialMesh, ZERO_LENGTH};
use crate::Vec3;
use crate::geometry::Sphere;

mod hierarchy;
mod link;
mod queue;
#[cfg(test)]
mod tests;

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
        let [of_a, of_b, of_c] = [a, b, c].map(|v| self.sides[v as usize].len());
        let [v, p, q] = if of_a <= of_b && of_a <= of_c {
            [a, b, c]
        } else if of_b <= of_c {
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

// The collapse of an edge, with set semantics for the simplices that become equal.

impl CollapseComplex {
    /// Collapses the edge `{kept, removed}`: one vertex with the id `kept` and the given sphere
    /// takes the place of both.
    ///
    /// Edges and faces that become equal are merged. Faces with both ends vanish; an edge that
    /// loses its last face stays as a lone edge unless it is merged. Nothing is tested here:
    /// [`CollapseComplex::keeps_homotopy`] and [`CollapseComplex::folded_face`] are the caller's.
    /// Cheapest when `removed` has the smaller star. Cost: the stars of both ends and the lists of
    /// the neighbours of `removed`.
    ///
    /// # Panics
    /// If the two are not the ends of an edge.
    pub fn collapse(&mut self, kept: u32, removed: u32, sphere: Sphere) {
        let is_edge = self.is_alive(removed) && self.neighbours(removed).contains(&kept);
        assert!(is_edge, "{kept} and {removed} are not the ends of an edge");
        // The marks and shared sides describe both links before either changes.
        self.find_shared(kept, removed);
        self.rename_in_neighbours(kept, removed);
        self.absorb_neighbours(kept, removed);
        self.absorb_sides(kept, removed);
        self.sphere_count -= 1;
        self.alive[removed as usize] = false;
        self.spheres[kept as usize] = sphere;
        self.touch(kept);
        if let Some(record) = &mut self.record {
            record.push(Collapse { kept, removed, sphere });
        }
    }

    /// Marks the neighbours of `a` and finds the sides `{c, d}` for which both `{a, c, d}` and
    /// `{b, c, d}` are faces.
    fn find_shared(&mut self, a: u32, b: u32) {
        self.marks.clear();
        for &c in self.neighbour_pool.get(self.neighbours[a as usize]) {
            self.marks.insert(c);
        }
        let mut shared = std::mem::take(&mut self.shared);
        shared.clear();
        for &[c, d] in self.opposite_sides(b) {
            // Marks first: they rule out almost every side without a search through links.
            if self.marks.contains(c) && self.marks.contains(d) && self.has_face(a, c, d) {
                shared.push([c, d]);
            }
        }
        // Sorted for the binary searches of the collapse.
        shared.sort_unstable();
        self.shared = shared;
    }

    fn rename_in_neighbours(&mut self, kept: u32, removed: u32) {
        // By index: the lists of other vertices change in the same pool meanwhile.
        let around = self.neighbours[removed as usize];
        for index in 0..around.len() {
            let v = self.neighbour_pool.at(around, index);
            if v != kept {
                self.rename_neighbour_of(v, kept, removed);
                self.rename_sides_of(v, kept, removed);
            }
        }
    }

    fn rename_neighbour_of(&mut self, v: u32, kept: u32, removed: u32) {
        let list = &mut self.neighbours[v as usize];
        let position = self.neighbour_pool.get(*list).iter().position(|&w| w == removed);
        let position = position.expect("neighbours name each other");
        // A common neighbour names `kept` already: its two edges merge.
        if self.marks.contains(v) {
            self.neighbour_pool.swap_remove(list, position);
            self.edge_count -= 1;
        } else {
            self.neighbour_pool.get_mut(*list)[position] = kept;
        }
    }

    fn rename_sides_of(&mut self, v: u32, kept: u32, removed: u32) {
        let list = &mut self.sides[v as usize];
        let mut index = 0;
        while index < list.len() {
            let [p, q] = self.side_pool.at(*list, index);
            let other = match (p == removed, q == removed) {
                (true, _) => q,
                (_, true) => p,
                _ => {
                    index += 1;
                    continue;
                }
            };
            let merges = !self.shared.is_empty()
                && self.shared.binary_search(&[v.min(other), v.max(other)]).is_ok();
            // A face with both ends vanishes; of two that merge, the one of `kept` stays.
            if other == kept || merges {
                // `index` stays, since the last side has moved here.
                self.side_pool.swap_remove(list, index);
            } else {
                self.side_pool.get_mut(*list)[index] = [kept.min(other), kept.max(other)];
                index += 1;
            }
        }
    }

    fn absorb_neighbours(&mut self, kept: u32, removed: u32) {
        let [a, b] = [kept as usize, removed as usize];
        let position = self.neighbours(kept).iter().position(|&w| w == removed);
        let position = position.expect("neighbours name each other");
        self.neighbour_pool.swap_remove(&mut self.neighbours[a], position);
        self.edge_count -= 1;
        for index in 0..self.neighbours[b].len() {
            let v = self.neighbour_pool.at(self.neighbours[b], index);
            // Marked vertices are neighbours of `kept` already.
            if v != kept && !self.marks.contains(v) {
                self.neighbour_pool.push(&mut self.neighbours[a], v);
            }
        }
        self.neighbour_pool.release(&mut self.neighbours[b]);
    }

    fn absorb_sides(&mut self, kept: u32, removed: u32) {
        let [a, b] = [kept as usize, removed as usize];
        let mut index = 0;
        // Faces with both ends are counted here, faces that merge in the next loop.
        while index < self.sides[a].len() {
            if self.side_pool.at(self.sides[a], index).contains(&removed) {
                self.side_pool.swap_remove(&mut self.sides[a], index);
                self.face_count -= 1;
            } else {
                index += 1;
            }
        }
        for index in 0..self.sides[b].len() {
            let side = self.side_pool.at(self.sides[b], index);
            // A face with both ends: it was removed and counted above.
            if side.contains(&kept) {
                continue;
            }
            if !self.shared.is_empty() && self.shared.binary_search(&side).is_ok() {
                self.face_count -= 1;
            } else {
                self.side_pool.push(&mut self.sides[a], side);
            }
        }
        self.side_pool.release(&mut self.sides[b]);
    }
}

// The record of collapses, and the mesh after any number of them.

/// One collapse, in the ids of the initial mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Collapse {
    /// The end whose id the merged vertex keeps.
    pub kept: u32,
    /// The end whose id is retired.
    pub removed: u32,
    /// The merged sphere.
    pub sphere: Sphere,
}

/// The mesh after the first collapses of a record, without doing them one by one: the image of the
/// initial mesh under the composition of their simplicial maps.
///
/// `replay(initial, &record[..t])` is, bit for bit, the mesh that the engine had after `t`
/// collapses, for every `t` and in any order of queries. Cost `O(n log n)`.
///
/// # Panics
/// If the collapses name spheres that `initial` does not have.
pub fn replay(initial: &MedialMesh, collapses: &[Collapse]) -> MedialMesh {
    let mut image: Vec<u32> = (0..initial.spheres.len() as u32).collect();
    let mut spheres = initial.spheres.clone();
    for collapse in collapses {
        spheres[collapse.kept as usize] = collapse.sphere;
        image[collapse.removed as usize] = collapse.kept;
    }
    // Later collapses decide where a kept vertex ends up: resolve from the last to the first.
    for collapse in collapses.iter().rev() {
        image[collapse.removed as usize] = image[collapse.kept as usize];
    }
    let left: Vec<bool> = image.iter().enumerate().map(|(v, &to)| v == to as usize).collect();
    let mut renumbered = vec![u32::MAX; left.len()];
    for (new, old) in (0..left.len()).filter(|&v| left[v]).enumerate() {
        renumbered[old] = new as u32;
    }
    let edges = mapped(&initial.edges, |v| renumbered[image[v as usize] as usize]);
    let faces = mapped(&initial.faces, |v| renumbered[image[v as usize] as usize]);
    let spheres = spheres.iter().zip(&left).filter(|&(_, &l)| l).map(|(&s, _)| s).collect();
    MedialMesh { spheres, edges, faces, contacts: None }
}

/// The images of simplices with all their vertices, each once, in order. Of a simplex whose vertices
/// merged, the image of lower dimension is among those of its edges.
fn mapped<const K: usize>(simplices: &[[u32; K]], image: impl Fn(u32) -> u32) -> Vec<[u32; K]> {
    let images = simplices.iter().map(|simplex| {
        let mut simplex = simplex.map(&image);
        simplex.sort_unstable();
        simplex
    });
    let mut mapped: Vec<[u32; K]> = images.filter(|s| s.is_sorted_by(|a, b| a < b)).collect();
    mapped.sort_unstable();
    mapped.dedup();
    mapped
}

// The inversion test: whether a collapse folds a face over.

impl CollapseComplex {
    /// A face `[v, p, q]` that folds over when both ends of the edge `{a, b}` move to `centre`; `v`
    /// is the one end that belongs to the face. See [`CollapseComplex::folds`].
    ///
    /// The result stays valid until one of `a`, `b`, `p`, `q` is part of a collapse.
    /// Cost: the faces of both ends.
    pub fn folded_face(&self, a: u32, b: u32, centre: Vec3) -> Option<[u32; 3]> {
        [[a, b], [b, a]].into_iter().find_map(|[moved, other]| {
            let sides = self.opposite_sides(moved).iter();
            // Faces with both ends vanish, so they cannot fold.
            let mut faces = sides.filter(|&&[p, q]| p != other && q != other);
            let folded = faces.find(|&&[p, q]| self.folds([moved, p, q], centre));
            folded.map(|&[p, q]| [moved, p, q])
        })
    }

    /// Whether a face `[v, p, q]` folds over when `v` moves to `centre`: the dot product of its
    /// normals before and after is negative.
    ///
    /// A face thinner than [`ZERO_LENGTH`] before the move never counts as folded: its normal is
    /// rounding noise, which must not hold a collapse back. Lengths in units of the diagonal.
    ///
    /// Source: Garland, Heckbert 1997, *Surface simplification using quadric error metrics*,
    /// <https://doi.org/10.1145/258734.258849>, section 3.7.
    #[inline]
    pub fn folds(&self, face: [u32; 3], centre: Vec3) -> bool {
        let [from, p, q] = face.map(|v| self.sphere(v).centre);
        folds_over([from, p, q], [centre, p, q])
    }
}

/// Whether a triangle folds over when its corners move, as [`CollapseComplex::folds`] has it for one of
/// them.
#[inline]
pub fn folds_over(before: [Vec3; 3], after: [Vec3; 3]) -> bool {
    let [u, v] = [before[1] - before[0], before[2] - before[0]];
    let normal = u.cross(v);
    let moved = (after[1] - after[0]).cross(after[2] - after[0]);
    // Sign first: it is cheap, and few faces get past it.
    normal.dot(moved) < 0.0 && !is_thin(normal, u, v)
}

/// Whether the smallest height of the triangle with sides `u`, `v` and `u × v = normal` is noise.
fn is_thin(normal: Vec3, u: Vec3, v: Vec3) -> bool {
    let longest = u.length_squared().max(v.length_squared()).max((u - v).length_squared());
    // The smallest height is the doubled area over the longest side; squared, without division.
    normal.length_squared() <= ZERO_LENGTH * ZERO_LENGTH * longest
}
