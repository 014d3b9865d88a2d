//! Betti numbers and Euler number of a medial mesh over `Z_2`.
//!
//! By definition `b0 = V - rank d1`, `b1 = E - rank d1 - rank d2`, `b2 = F - rank d2 = dim ker d2`,
//! with `d1`, `d2` the boundary maps of edges and faces. Column reduction after H. Edelsbrunner,
//! D. Letscher, A. Zomorodian, "Topological persistence and simplification", Discrete & Computational
//! Geometry 28 (2002), <https://doi.org/10.1007/s00454-002-2885-2>. "Clearing", which skips what
//! another dimension already decides, after C. Chen, M. Kerber, "Persistent homology computation with
//! a twist", EuroCG 2011.
//!
//! 1. `rank d1` is the number of edges of a spanning forest: disjoint sets.
//! 2. *Elementary collapses*: a face with an edge of its own is in no 2-cycle. Removing both
//!    leaves `ker d2` as it is; repeat until no edge has exactly one face.
//! 3. *Sheets*: of an edge with exactly two faces, a 2-cycle contains both or neither. So it contains
//!    all faces joined by such edges (a sheet) or none of them. The other edges, with three faces or
//!    more, are the *seams*. There is one unknown per sheet and one equation per seam edge.
//! 4. *Clearing*: the boundary of a chain of sheets is a cycle on the seams. A cycle that vanishes off
//!    a spanning forest of the seams vanishes on the forest, too. So the equations of the forest are
//!    dropped.
//! 5. Reduce the columns that remain, one for each sheet.
//!
//! Steps 1 to 4 are nearly linear and solve a disc-like axis and any surface completely. Step 5 is
//! cubic in the number of independent seam cycles in the worst case.

use super::MedialMesh;
use super::incidence::Incidence;
use super::reduction::rank;
use crate::geometry::DisjointSets;

/// Betti numbers `[b0, b1, b2]` over `Z_2` of a medial mesh in canonical form: components,
/// independent loops, voids.
///
/// They depend on the combinatorics alone. Nearly linear for surfaces and foams; cubic in the number
/// of independent seam cycles at worst.
///
/// ```
/// use medial::complex::{MedialMesh, Sphere, betti, euler};
/// let spheres = vec![Sphere::new(medial::Vec3::ZERO, 1.0); 4];
/// let hollow = vec![[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]];
/// let tetrahedron = MedialMesh::from_simplices(spheres, vec![], hollow)?;
/// assert_eq!((betti(&tetrahedron), euler(&tetrahedron)), ([1, 0, 1], 2));
/// # Ok::<(), medial::complex::ComplexError>(())
/// ```
///
/// # Panics
/// If the mesh is not in canonical form; see [`MedialMesh::check`].
pub fn betti(mesh: &MedialMesh) -> [u64; 3] {
    let [v, e, f] = [mesh.spheres.len(), mesh.edges.len(), mesh.faces.len()];
    let mut components = DisjointSets::singletons(v);
    for &[a, b] in &mesh.edges {
        components.join(a, b);
    }
    let b0 = components.len();
    let b2 = cycles(mesh);
    let rank1 = v - b0;
    let rank2 = f - b2;
    [b0 as u64, (e - rank1 - rank2) as u64, b2 as u64]
}

/// Euler number of a medial mesh: spheres - edges + faces, and so `b0 - b1 + b2`.
pub fn euler(mesh: &MedialMesh) -> i64 {
    mesh.spheres.len() as i64 - mesh.edges.len() as i64 + mesh.faces.len() as i64
}

/// Dimension of `ker d2`.
fn cycles(mesh: &MedialMesh) -> usize {
    let incidence = Incidence::of(mesh);
    let core = Core::after_collapses(&incidence);
    let mut sheets = core.sheets();
    let columns = core.seam_columns(mesh, &mut sheets);
    columns.len() - rank(&columns)
}

/// The faces that no elementary collapse reaches.
struct Core<'a> {
    face_edges: &'a [[u32; 3]],
    alive: Vec<bool>,
    /// For each edge the number of its live faces.
    faces_at: Vec<u32>,
    /// For each edge the exclusive or of the ids of its live faces: with one face left it is that
    /// face, with two it gives either from the other, without any list of faces.
    faces_xor: Vec<u32>,
}

impl<'a> Core<'a> {
    /// Step 2.
    fn after_collapses(incidence: &'a Incidence) -> Self {
        let face_edges = incidence.face_edges();
        let faces_at = incidence.faces_at().to_vec();
        let mut faces_xor = vec![0; faces_at.len()];
        for (face, edges) in face_edges.iter().enumerate() {
            for &edge in edges {
                faces_xor[edge as usize] ^= face as u32;
            }
        }
        let mut core =
            Self { face_edges, alive: vec![true; face_edges.len()], faces_at, faces_xor };
        let mut free: Vec<u32> =
            (0..core.faces_at.len() as u32).filter(|&e| core.faces_at[e as usize] == 1).collect();
        while let Some(edge) = free.pop() {
            // Its only face may have been removed through another of its edges meanwhile.
            if core.faces_at[edge as usize] == 1 {
                core.remove(core.faces_xor[edge as usize], &mut free);
            }
        }
        core
    }

    fn remove(&mut self, face: u32, free: &mut Vec<u32>) {
        self.alive[face as usize] = false;
        for edge in self.face_edges[face as usize] {
            let count = &mut self.faces_at[edge as usize];
            *count -= 1;
            if *count == 1 {
                free.push(edge);
            }
            self.faces_xor[edge as usize] ^= face;
        }
    }

    fn live_faces(&self) -> impl Iterator<Item = u32> + '_ {
        (0..self.alive.len() as u32).filter(|&face| self.alive[face as usize])
    }

    /// Step 3: the live faces, joined across edges with exactly two of them.
    fn sheets(&self) -> DisjointSets {
        let mut sheets = DisjointSets::singletons(self.alive.len());
        for face in self.live_faces() {
            for edge in self.face_edges[face as usize] {
                if self.faces_at[edge as usize] == 2 {
                    sheets.join(face, self.faces_xor[edge as usize] ^ face);
                }
            }
        }
        sheets
    }

    /// Steps 3 and 4: for each sheet the seam edges, numbered consecutively, where an odd number
    /// of its faces meet, without those of a spanning forest of the seams.
    fn seam_columns(&self, mesh: &MedialMesh, sheets: &mut DisjointSets) -> Vec<Vec<u32>> {
        let row_of = self.rows_off_the_forest(mesh);
        let mut column_of = vec![u32::MAX; self.alive.len()];
        let mut columns: Vec<Vec<u32>> = Vec::new();
        for face in self.live_faces() {
            // The representative is the smallest face of the sheet, so it comes first.
            let sheet = sheets.find(face);
            if sheet == face {
                column_of[face as usize] = columns.len() as u32;
                columns.push(Vec::new());
            }
            let column = &mut columns[column_of[sheet as usize] as usize];
            let rows = self.face_edges[face as usize].map(|edge| row_of[edge as usize]);
            column.extend(rows.into_iter().filter(|&row| row != u32::MAX));
        }
        for column in &mut columns {
            keep_odd(column);
        }
        columns
    }

    /// A number for each seam edge that closes a cycle with earlier ones, `u32::MAX` elsewhere.
    fn rows_off_the_forest(&self, mesh: &MedialMesh) -> Vec<u32> {
        let mut forest = DisjointSets::singletons(mesh.spheres.len());
        let mut rows = 0;
        let numbered = mesh.edges.iter().zip(&self.faces_at).map(|(&[a, b], &faces)| {
            if faces < 3 || forest.join(a, b) {
                return u32::MAX;
            }
            rows += 1;
            rows - 1
        });
        numbered.collect()
    }
}

/// Sorts, and keeps one of each value that occurs an odd number of times.
fn keep_odd(values: &mut Vec<u32>) {
    values.sort_unstable();
    let mut kept = 0;
    for i in 0..values.len() {
        if kept > 0 && values[kept - 1] == values[i] {
            kept -= 1;
        } else {
            values[kept] = values[i];
            kept += 1;
        }
    }
    values.truncate(kept);
}

#[cfg(test)]
#[path = "topology_tests.rs"]
mod tests;
