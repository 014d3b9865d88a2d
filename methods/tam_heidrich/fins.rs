//! Step 1 of Tam and Heidrich, section 3: facets between duplicate corners.
//!
//! The axis of the perturbed balls has a *fin* between any two corners that are one sample: a facet that
//! crosses a sheet or, where three sheets meet, reaches from the seam to the outside. If the two corners
//! were one point, there would be no fin. Fins are removed by elementary collapses, as far as that keeps
//! the homotopy type:
//!
//! 1. A triangle of a fin goes with an edge that nothing else has.
//! 2. An edge that lost its last triangle goes with an end that no other edge has. The remainder of the
//!    sphere there, the volume of its tetrahedra, goes to the other end.

use medial::complex::{Incidence, MedialMesh};

use super::kept_part;

/// The mesh without the triangles that `is_fin` names, as far as they can go; for each sphere of
/// `mesh` the one that it went into; and how many of these triangles are left.
pub(super) fn without_fins(mesh: &MedialMesh, is_fin: &[bool]) -> (MedialMesh, Vec<u32>, usize) {
    let incidence = Incidence::of(mesh);
    let mut shrinking = Shrinking::new(mesh, &incidence);
    let free = (0..mesh.edges.len()).filter(|&e| incidence.faces_at()[e] == 1);
    let mut open: Vec<usize> = free.rev().collect();
    let mut bare = Vec::new();
    while let Some(edge) = open.pop() {
        let face = shrinking.face_xor[edge] as usize;
        if shrinking.faces_at[edge] == 1 && is_fin[face] {
            shrinking.remove_face(face, edge, &mut open, &mut bare);
        }
    }
    let mut into: Vec<u32> = (0..mesh.spheres.len() as u32).collect();
    bare.sort_unstable();
    for edge in bare {
        shrinking.remove_curve(edge, &mut into);
    }
    let left = (0..mesh.faces.len()).filter(|&f| is_fin[f] && shrinking.face_kept[f]).count();
    let mut number = vec![u32::MAX; into.len()];
    let kept = (0..into.len()).filter(|&v| into[v] == v as u32);
    kept.zip(0..).for_each(|(old, new)| number[old] = new);
    let into_new = (0..into.len() as u32).map(|mut v| {
        while into[v as usize] != v {
            v = into[v as usize];
        }
        number[v as usize]
    });
    let into_new = into_new.collect();
    let sphere_kept: Vec<bool> = number.iter().map(|&n| n != u32::MAX).collect();
    let Shrinking { edge_kept, face_kept, .. } = &shrinking;
    (kept_part(mesh, &sphere_kept, edge_kept, face_kept), into_new, left)
}

/// A mesh during collapses.
struct Shrinking<'a> {
    mesh: &'a MedialMesh,
    incidence: &'a Incidence,
    face_kept: Vec<bool>,
    edge_kept: Vec<bool>,
    /// For each edge the number of its triangles, and their exclusive or.
    faces_at: Vec<u32>,
    face_xor: Vec<u32>,
    /// The same for each sphere and its edges.
    edges_at: Vec<u32>,
    edge_xor: Vec<u32>,
    /// Edges that had triangles, and have none any more.
    is_bare: Vec<bool>,
}

impl<'a> Shrinking<'a> {
    fn new(mesh: &'a MedialMesh, incidence: &'a Incidence) -> Self {
        let mut face_xor = vec![0; mesh.edges.len()];
        for (face, edges) in (0..).zip(incidence.face_edges()) {
            edges.iter().for_each(|&edge| face_xor[edge as usize] ^= face);
        }
        let (mut edges_at, mut edge_xor) =
            (vec![0; mesh.spheres.len()], vec![0; mesh.spheres.len()]);
        for (edge, ends) in (0..).zip(&mesh.edges) {
            for &v in ends {
                edges_at[v as usize] += 1;
                edge_xor[v as usize] ^= edge;
            }
        }
        Self {
            mesh,
            incidence,
            face_kept: vec![true; mesh.faces.len()],
            edge_kept: vec![true; mesh.edges.len()],
            faces_at: incidence.faces_at().to_vec(),
            face_xor,
            edges_at,
            edge_xor,
            is_bare: vec![false; mesh.edges.len()],
        }
    }

    /// Collapse 1. Edges with one triangle left are noted in `open`, those with none in `bare`.
    fn remove_face(
        &mut self,
        face: usize,
        free: usize,
        open: &mut Vec<usize>,
        bare: &mut Vec<usize>,
    ) {
        self.face_kept[face] = false;
        for edge in self.incidence.face_edges()[face].map(|e| e as usize) {
            self.faces_at[edge] -= 1;
            self.face_xor[edge] ^= face as u32;
            match self.faces_at[edge] {
                _ if edge == free => self.remove_edge(edge),
                0 => {
                    self.is_bare[edge] = true;
                    bare.push(edge);
                }
                1 => open.push(edge),
                _ => {}
            }
        }
    }

    fn remove_edge(&mut self, edge: usize) {
        self.edge_kept[edge] = false;
        for v in self.mesh.edges[edge].map(|v| v as usize) {
            self.edges_at[v] -= 1;
            self.edge_xor[v] ^= edge as u32;
        }
    }

    /// Collapse 2, from an edge on as far as it goes.
    fn remove_curve(&mut self, edge: usize, into: &mut [u32]) {
        let mut next = Some(edge);
        while let Some(edge) = next.take().filter(|&e| self.edge_kept[e] && self.is_bare[e]) {
            let [a, b] = self.mesh.edges[edge];
            // The larger end first: balls have the smaller ids.
            let ends = [(b, a), (a, b)];
            let free = ends.into_iter().find(|&(v, _)| self.edges_at[v as usize] == 1);
            let Some((gone, stays)) = free else { return };
            self.remove_edge(edge);
            into[gone as usize] = stays;
            if self.edges_at[stays as usize] == 1 {
                next = Some(self.edge_xor[stays as usize] as usize);
            }
        }
    }
}
