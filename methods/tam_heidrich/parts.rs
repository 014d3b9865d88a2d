//! Step 3: parts, and how removing one changes the others.
//!
//! 1. Triangles grow together over edges that exactly two triangles share. The parts of level 1 are
//!    those with a *free* edge, one of a single triangle.
//! 2. The *own* simplices of a part `P` are its triangles and those of their edges and vertices that
//!    nothing else has: no other part, and no curve. They go with the part. What stays of its closure
//!    is its contact set `C`.
//! 3. Let `P` have level 1. *Its removal is a deformation retraction if and only if `C` is not empty
//!    and the own simplices have the Euler number `V - E + F = 0`; otherwise it loses a loop or
//!    splits a component.*
//!
//!    Proof. By excision all is decided by the relative homology of the closure of `P` and `C`. Its
//!    Euler number is that of the own simplices. `H_0 = 0` as the closure is connected and `C` not
//!    empty. `H_2 = 0`: a relative cycle has all triangles of `P` or none, since they are joined over
//!    edges of two, and not that of the free edge. So `H_1` has the rank `-(V - E + F)`. If it is
//!    zero, collapse `P` from the free edge: every triangle goes, as they are joined, and leaves
//!    a graph whose relative homology vanishes, a forest each tree of which hangs on `C` in one
//!    point, which collapses too. If it is not zero, the exact sequence of the whole and what stays
//!    states that `b1` falls or `b0` grows by that rank in all, and `b2` does not change.
//! 4. After a removal some simplices of the contact set belong to only one other part: they become its
//!    own. With counters of parts at each edge and vertex, the test of step 3 is a comparison, and a
//!    removal is linear in the size of the part.

use std::collections::VecDeque;

use medial::complex::MedialMesh;
use medial::geometry::DisjointSets;

use super::axis::Axis;
use super::kept_part;

/// The remaining part of an axis.
#[derive(Clone)]
pub(super) struct Remaining<'a> {
    pub(super) axis: &'a Axis,
    pub(super) face_kept: Vec<bool>,
    pub(super) edge_kept: Vec<bool>,
    pub(super) sphere_kept: Vec<bool>,
    /// Number of spheres kept.
    pub(super) spheres: usize,
    /// For each edge the number of its faces.
    pub(super) faces_at: Vec<u32>,
    /// For each edge the exclusive or of its faces: with two it gives either from the other.
    faces_xor: Vec<u32>,
}

impl<'a> Remaining<'a> {
    /// All of it.
    pub(super) fn all(axis: &'a Axis) -> Self {
        let faces_at = axis.incidence.faces_at().to_vec();
        let mut faces_xor = vec![0; faces_at.len()];
        for (face, edges) in axis.incidence.face_edges().iter().enumerate() {
            for &edge in edges {
                faces_xor[edge as usize] ^= face as u32;
            }
        }
        Self {
            axis,
            face_kept: vec![true; axis.mesh.faces.len()],
            edge_kept: vec![true; axis.mesh.edges.len()],
            sphere_kept: vec![true; axis.mesh.spheres.len()],
            spheres: axis.mesh.spheres.len(),
            faces_at,
            faces_xor,
        }
    }

    /// The faces that are kept, ascending.
    pub(super) fn faces(&self) -> impl Iterator<Item = u32> + '_ {
        (0..self.face_kept.len() as u32).filter(|&face| self.face_kept[face as usize])
    }

    /// Betti numbers over `Z_2`, nearly linear. Parts of level 1 leave `b2` of the whole, whatever
    /// else goes with them (step 3); `b0` is counted, and `b1` follows from the Euler number.
    pub(super) fn betti(&self) -> [u64; 3] {
        let (whole, b2) = (&self.axis.mesh, self.axis.b2);
        let mut components = DisjointSets::singletons(whole.spheres.len());
        let kept = whole.edges.iter().zip(&self.edge_kept).filter(|e| *e.1);
        let edges = kept
            .inspect(|&(&[a, b], _)| {
                components.join(a, b);
            })
            .count();
        let b0 = components.len() - (whole.spheres.len() - self.spheres);
        let euler = (self.spheres + self.faces().count()) as i64 - edges as i64;
        let b1 = (b0 as u64 + b2).checked_add_signed(-euler).expect("a complex");
        [b0 as u64, b1, b2]
    }

    /// As a separate mesh, in the order of the whole.
    pub(super) fn mesh(&self) -> MedialMesh {
        kept_part(&self.axis.mesh, &self.sphere_kept, &self.edge_kept, &self.face_kept)
    }
}

/// The parts of the remaining complex when it was decomposed, by their smallest triangle.
pub(super) struct Parts {
    /// The triangles of part `p` are `faces[start[p]..start[p + 1]]`, ascending.
    start: Vec<usize>,
    faces: Vec<u32>,
    /// Relative volume of each part.
    pub(super) volume: Vec<f64>,
    /// Whether it has a free edge: level 1.
    pub(super) free: Vec<bool>,
    /// `V - E + F` of its simplices.
    euler: Vec<i64>,
    /// Number of the vertices in its contact set.
    contacts: Vec<u32>,
    /// For each edge the number of parts that have it, and the exclusive or of their ids.
    at_edge: Vec<Shared>,
    /// The same for each sphere; a curve counts as one more.
    at_sphere: Vec<Shared>,
    edge_seen: Vec<u32>,
    sphere_seen: Vec<u32>,
}

/// How many parts have a simplex.
#[derive(Clone, Copy, Default)]
struct Shared {
    count: u32,
    /// Exclusive or of the parts' ids: with one left, that one.
    xor: u32,
}

impl Shared {
    fn flip(&mut self, part: usize, by: i32) {
        self.count = self.count.wrapping_add_signed(by);
        self.xor ^= part as u32;
    }
}

const NOT_SEEN: u32 = u32::MAX;

impl Parts {
    /// Decomposes the remaining complex. Nearly linear.
    pub(super) fn of(remaining: &Remaining<'_>) -> Self {
        let axis = remaining.axis;
        let (start, faces) = grown(remaining);
        let parts = start.len() - 1;
        let in_parts = Shared::default();
        let on_curve = Shared { count: 1, xor: 0 };
        let at_sphere = axis.on_curve.iter().map(|&c| if c { on_curve } else { in_parts });
        let mut all = Self {
            start,
            faces,
            volume: vec![0.0; parts],
            free: vec![false; parts],
            euler: vec![0; parts],
            contacts: vec![0; parts],
            at_edge: vec![in_parts; remaining.faces_at.len()],
            at_sphere: at_sphere.collect(),
            edge_seen: vec![NOT_SEEN; remaining.faces_at.len()],
            sphere_seen: vec![NOT_SEEN; axis.mesh.spheres.len()],
        };
        for part in 0..parts {
            for k in all.start[part]..all.start[part + 1] {
                all.register(remaining, part, all.faces[k]);
            }
            all.euler[part] = (all.start[part + 1] - all.start[part]) as i64;
        }
        for shared in all.at_edge.iter().filter(|s| s.count == 1) {
            all.euler[shared.xor as usize] -= 1;
        }
        for (shared, _) in
            all.at_sphere.iter().zip(&axis.on_curve).filter(|(s, c)| s.count == 1 && !**c)
        {
            all.euler[shared.xor as usize] += 1;
            all.contacts[shared.xor as usize] -= 1;
        }
        all
    }

    /// Enters a triangle of a part. All vertices count as contacts at first.
    fn register(&mut self, remaining: &Remaining<'_>, part: usize, face: u32) {
        let axis = remaining.axis;
        self.volume[part] += axis.at_face[face as usize];
        for edge in axis.incidence.face_edges()[face as usize] {
            let edge = edge as usize;
            self.free[part] |= remaining.faces_at[edge] == 1;
            if std::mem::replace(&mut self.edge_seen[edge], part as u32) != part as u32 {
                self.at_edge[edge].flip(part, 1);
            }
        }
        for sphere in axis.mesh.faces[face as usize] {
            let sphere = sphere as usize;
            if std::mem::replace(&mut self.sphere_seen[sphere], part as u32) != part as u32 {
                self.at_sphere[sphere].flip(part, 1);
                self.volume[part] += axis.at_sphere[sphere];
                self.contacts[part] += 1;
            }
        }
    }

    pub(super) fn len(&self) -> usize {
        self.start.len() - 1
    }

    /// The triangles of a part, ascending.
    pub(super) fn faces(&self, part: usize) -> &[u32] {
        &self.faces[self.start[part]..self.start[part + 1]]
    }

    /// Whether the part touches anything: it is not a separate component.
    pub(super) fn has_contact(&self, part: usize) -> bool {
        self.contacts[part] > 0
    }

    /// Whether removing this part of level 1 keeps all loops and components (step 3).
    pub(super) fn is_removable(&self, part: usize) -> bool {
        self.has_contact(part) && self.euler[part] == 0
    }

    /// How many spheres go with a part of those that remain.
    pub(super) fn own_spheres(&self, part: usize, remaining: &Remaining<'_>) -> usize {
        let axis = remaining.axis;
        let corners = self.faces(part).iter().flat_map(|&f| axis.mesh.faces[f as usize]);
        // A curve counts as one more part, so that its spheres are never a part's own.
        let mut own: Vec<u32> =
            corners.filter(|&v| self.at_sphere[v as usize].count == 1).collect();
        own.sort_unstable();
        own.dedup();
        own.len()
    }

    /// Removes a part that is there with its own simplices (step 4).
    pub(super) fn remove(&mut self, part: usize, remaining: &mut Remaining<'_>) {
        let axis = remaining.axis;
        // No part is registered any more, so that ids beyond theirs are new marks.
        let mark = (self.len() + part) as u32;
        for k in self.start[part]..self.start[part + 1] {
            let face = self.faces[k];
            remaining.face_kept[face as usize] = false;
            for edge in axis.incidence.face_edges()[face as usize].map(|e| e as usize) {
                remaining.faces_at[edge] -= 1;
                remaining.faces_xor[edge] ^= face;
                if std::mem::replace(&mut self.edge_seen[edge], mark) != mark {
                    self.leave_edge(part, edge, remaining);
                }
            }
            for sphere in axis.mesh.faces[face as usize].map(|v| v as usize) {
                if std::mem::replace(&mut self.sphere_seen[sphere], mark) != mark {
                    self.leave_sphere(part, sphere, remaining);
                }
            }
        }
    }

    fn leave_edge(&mut self, part: usize, edge: usize, remaining: &mut Remaining<'_>) {
        self.at_edge[edge].flip(part, -1);
        match self.at_edge[edge] {
            Shared { count: 0, .. } => remaining.edge_kept[edge] = false,
            Shared { count: 1, xor } => self.euler[xor as usize] -= 1,
            _ => {}
        }
    }

    fn leave_sphere(&mut self, part: usize, sphere: usize, remaining: &mut Remaining<'_>) {
        self.at_sphere[sphere].flip(part, -1);
        match self.at_sphere[sphere] {
            Shared { count: 0, .. } => {
                remaining.sphere_kept[sphere] = false;
                remaining.spheres -= 1;
            }
            Shared { count: 1, xor } if !remaining.axis.on_curve[sphere] => {
                self.euler[xor as usize] += 1;
                self.contacts[xor as usize] -= 1;
            }
            _ => {}
        }
    }
}

/// Step 1: the triangles of each part, as starts of runs and the runs.
fn grown(remaining: &Remaining<'_>) -> (Vec<usize>, Vec<u32>) {
    let face_edges = remaining.axis.incidence.face_edges();
    let mut sets = DisjointSets::singletons(face_edges.len());
    for face in remaining.faces() {
        for edge in face_edges[face as usize].map(|e| e as usize) {
            if remaining.faces_at[edge] == 2 {
                sets.join(face, remaining.faces_xor[edge] ^ face);
            }
        }
    }
    // The representative is the smallest triangle of a part, so it comes first.
    let mut part_of = vec![0; face_edges.len()];
    let mut start = vec![0];
    for face in remaining.faces() {
        let first = sets.find(face) as usize;
        if first == face as usize {
            part_of[first] = start.len() - 1;
            start.push(0);
        }
        part_of[face as usize] = part_of[first];
        start[part_of[face as usize] + 1] += 1;
    }
    for part in 1..start.len() {
        start[part] += start[part - 1];
    }
    let mut next = start.clone();
    let mut faces = vec![0; start[start.len() - 1]];
    for face in remaining.faces() {
        let place = &mut next[part_of[face as usize]];
        faces[*place] = face;
        *place += 1;
    }
    (start, faces)
}

// ----------------------------------------------------------------------------
// The levels of section 4.1.

/// For each part its level: 1 at a free edge, one more than that of the lowest part next to it over
/// an edge; 0 where no part of level 1 can be reached.
pub(super) fn levels(parts: &Parts, remaining: &Remaining<'_>) -> Vec<u32> {
    let face_edges = remaining.axis.incidence.face_edges();
    let mut parts_of_edge: Vec<(u32, u32)> = Vec::new();
    for part in 0..parts.len() {
        let edges = parts.faces(part).iter().flat_map(|&f| face_edges[f as usize]);
        let shared = edges.filter(|&e| parts.at_edge[e as usize].count > 1);
        parts_of_edge.extend(shared.map(|e| (e, part as u32)));
    }
    parts_of_edge.sort_unstable();
    parts_of_edge.dedup();
    let mut edges_of_part: Vec<Vec<u32>> = vec![Vec::new(); parts.len()];
    let by_edge: Vec<&[(u32, u32)]> = parts_of_edge.chunk_by(|a, b| a.0 == b.0).collect();
    for (edge, of_edge) in by_edge.iter().enumerate() {
        of_edge.iter().for_each(|&(_, part)| edges_of_part[part as usize].push(edge as u32));
    }
    let mut level: Vec<u32> = parts.free.iter().map(|&free| u32::from(free)).collect();
    let mut queue: VecDeque<usize> = (0..parts.len()).filter(|&p| parts.free[p]).collect();
    let mut crossed = vec![false; by_edge.len()];
    while let Some(part) = queue.pop_front() {
        for &edge in &edges_of_part[part] {
            if std::mem::replace(&mut crossed[edge as usize], true) {
                continue;
            }
            for &(_, other) in by_edge[edge as usize] {
                if level[other as usize] == 0 {
                    level[other as usize] = level[part] + 1;
                    queue.push_back(other as usize);
                }
            }
        }
    }
    level
}
