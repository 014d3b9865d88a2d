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
//! 2. *Elementary collapses*: a face with an edge that no other face has is in no 2-cycle. Removing both
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
use super::mesh::Incidence;
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

// Rank of a sparse matrix over `Z_2` by column reduction.
//
// From left to right, each column is reduced: as long as an earlier reduced column has the same
// lowest entry, that column is added. The column being reduced is a set of bits, after U. Bauer,
// M. Kerber, J. Reininghaus, H. Wagner, "PHAT - Persistent Homology Algorithms Toolbox", Journal of
// Symbolic Computation 78 (2017), <https://doi.org/10.1016/j.jsc.2016.03.008>. Adding a column costs
// one step per entry. The pivots of one column only descend, so all of them are found in one scan.

/// Rank over `Z_2` of the matrix whose columns hold one at the listed rows.
///
/// Precondition: each column ascends without repetition.
pub(super) fn rank(columns: &[Vec<u32>]) -> usize {
    let rows = columns.iter().filter_map(|column| column.last()).max().map_or(0, |&row| row + 1);
    let mut with_pivot: Vec<Vec<u32>> = vec![Vec::new(); rows as usize];
    let mut work = Column { words: vec![0; (rows as usize).div_ceil(64)], members: 0 };
    let mut rank = 0;
    for column in columns {
        column.iter().for_each(|&row| work.flip(row));
        // Every reducer has its largest row at the pivot, so no bit above the pivot is set again.
        let mut bound = column.last().copied().unwrap_or_default();
        while let Some(pivot) = work.largest(bound) {
            bound = pivot;
            let reducer = &mut with_pivot[pivot as usize];
            if reducer.is_empty() {
                while let Some(row) = work.largest(bound) {
                    reducer.push(row);
                    work.flip(row);
                    bound = row;
                }
                rank += 1;
            } else {
                reducer.iter().for_each(|&row| work.flip(row));
            }
        }
    }
    rank
}

/// A set of rows: a bit for each.
struct Column {
    words: Vec<u64>,
    /// Ends a scan of the words at the smallest member, far above row 0 in most columns.
    members: usize,
}

impl Column {
    /// Inserts `row` if it is absent, else removes it.
    fn flip(&mut self, row: u32) {
        let word = &mut self.words[row as usize / 64];
        *word ^= 1 << (row % 64);
        if *word >> (row % 64) & 1 == 1 {
            self.members += 1;
        } else {
            self.members -= 1;
        }
    }

    /// The largest member, if no member is above `bound`.
    fn largest(&self, bound: u32) -> Option<u32> {
        if self.members == 0 {
            return None;
        }
        let words = &self.words[..=bound as usize / 64];
        let word = words.iter().rposition(|&word| word != 0)?;
        Some(word as u32 * 64 + 63 - words[word].leading_zeros())
    }
}

// Betti numbers of a set of voxels, as the union of closed cubes (26-connectivity).
//
// - `b0` counts the 26-connected components.
// - `b2` counts the bounded 6-connected components of the other voxels: the complement of the union
//   is open, and by Alexander duality it has one component more than the union has voids.
// - The Euler number `chi` counts, with alternating signs, the voxels and the vertices, edges and
//   squares of the lattice on them. `b1 = b0 + b2 - chi`.
//
// Components are found over runs of voxels along `x` (J. Hoshen, R. Kopelman, "Percolation and
// cluster distribution", Physical Review B 14, 1976, doi:10.1103/PhysRevB.14.3438, on runs).

/// Betti numbers `[b0, b1, b2]` of the union of closed unit cubes at the given places, in any
/// order, repetitions allowed.
///
/// Time is linear in the number of voxels and of rows of their bounding box; memory a few words
/// for each.
///
/// ```
/// use medial::complex::cubical_betti;
/// // Two cubes that share a corner are one component, and eight around a hole make a loop.
/// assert_eq!(cubical_betti(&[[0, 0, 0], [1, 1, 1]]), [1, 0, 0]);
/// let ring: Vec<[u32; 3]> =
///     (0..9).filter(|&k| k != 4).map(|k| [k % 3, k / 3, 0]).collect();
/// assert_eq!(cubical_betti(&ring), [1, 1, 0]);
/// assert_eq!(cubical_betti(&[]), [0, 0, 0]);
/// ```
///
/// # Panics
/// If the rows of the bounding box are more than `u32` can count.
pub fn cubical_betti(voxels: &[[u32; 3]]) -> [u64; 3] {
    let Some(rows) = Rows::of(voxels) else {
        return [0; 3];
    };
    let b0 = rows.components(&[[-1, 0], [-1, -1], [0, -1], [1, -1]], 1);
    // One component of the complement is outside and unbounded.
    let b2 = rows.complement().components(&[[-1, 0], [0, -1]], 0) - 1;
    let chi = rows.euler();
    let b1 = (b0 + b2) as i64 - chi;
    [b0 as u64, u64::try_from(b1).expect("Betti numbers are not negative"), b2 as u64]
}

/// A run of voxels: from `start` up to, but without, `end`.
type Run = [u32; 2];

/// The voxels as runs along `x`, row by row, with an empty row and layer around.
struct Rows {
    width: u32,
    size: [usize; 2],
    runs: Vec<Run>,
    /// For each row `(y, z)`, at `y + z * size[0]`, where its runs begin; one more at the end.
    first: Vec<u32>,
}

impl Rows {
    fn of(voxels: &[[u32; 3]]) -> Option<Self> {
        let mut lo = *voxels.first()?;
        let mut hi = lo;
        for voxel in voxels {
            for axis in 0..3 {
                lo[axis] = lo[axis].min(voxel[axis]);
                hi[axis] = hi[axis].max(voxel[axis]);
            }
        }
        let mut sorted: Vec<[u32; 3]> =
            voxels.iter().map(|v| [v[2] - lo[2] + 1, v[1] - lo[1] + 1, v[0] - lo[0] + 1]).collect();
        sorted.sort_unstable();
        sorted.dedup();
        let size = [1, 2].map(|axis| (hi[axis] - lo[axis]) as usize + 3);
        let mut rows = Self { width: hi[0] - lo[0] + 3, size, runs: Vec::new(), first: Vec::new() };
        for [z, y, x] in sorted {
            let row = y as usize + z as usize * size[0];
            let new_row = rows.open(row);
            match rows.runs.last_mut() {
                Some(run) if !new_row && run[1] == x => run[1] = x + 1,
                _ => rows.runs.push([x, x + 1]),
            }
        }
        rows.open(size[0] * size[1]);
        Some(rows)
    }

    /// Closes all rows before `row`; whether there were any to close.
    fn open(&mut self, row: usize) -> bool {
        let new = self.first.len() <= row;
        self.first.resize(self.first.len().max(row + 1), self.runs.len() as u32);
        new
    }

    fn row(&self, row: usize) -> &[Run] {
        &self.runs[self.first[row] as usize..self.first[row + 1] as usize]
    }

    fn complement(&self) -> Self {
        let mut rest = Self { width: self.width, size: self.size, runs: vec![], first: vec![0] };
        for row in 0..self.size[0] * self.size[1] {
            let mut start = 0;
            for &[from, to] in self.row(row) {
                rest.runs.push([start, from]);
                start = to;
            }
            rest.runs.push([start, self.width]);
            rest.first.push(rest.runs.len() as u32);
        }
        rest
    }

    /// Components, where a run is joined to runs of the rows at `offsets` in `(y, z)` that overlap
    /// it when grown by `grown` at both ends.
    fn components(&self, offsets: &[[isize; 2]], grown: u32) -> usize {
        let mut sets = DisjointSets::singletons(self.runs.len());
        for z in 0..self.size[1] {
            for y in 0..self.size[0] {
                for &[dy, dz] in offsets {
                    let at = (y.checked_add_signed(dy), z.checked_add_signed(dz));
                    if let (Some(v), Some(w)) = at
                        && v < self.size[0]
                    {
                        self.join(&mut sets, y + z * self.size[0], v + w * self.size[0], grown);
                    }
                }
            }
        }
        sets.len()
    }

    fn join(&self, sets: &mut DisjointSets, row: usize, other: usize, grown: u32) {
        let (mut a, mut b) = (self.first[row], self.first[other]);
        let (a_end, b_end) = (self.first[row + 1], self.first[other + 1]);
        while a < a_end && b < b_end {
            let ([a0, a1], [b0, b1]) = (self.runs[a as usize], self.runs[b as usize]);
            if a0 < b1 + grown && b0 < a1 + grown {
                sets.join(a, b);
            }
            // Merge step: the run that ends first overlaps nothing further on.
            if a1 < b1 {
                a += 1;
            } else {
                b += 1;
            }
        }
    }

    /// Vertices minus edges plus squares minus cubes, each cell counted in its row of the lattice. A
    /// row of the lattice borders one, two or four rows of voxels. If these merge to `m` runs of total
    /// length `n`, the lattice row has `n` intervals and `n + m` points: their difference is `m`.
    fn euler(&self) -> i64 {
        let [ny, nz] = self.size;
        let mut merged = Vec::new();
        let mut chi = 0;
        for z in 1..nz {
            for y in 1..ny {
                let row = |dy: usize, dz: usize| self.row(y - dy + (z - dz) * ny);
                // Points and intervals: their difference is the number of closed runs.
                chi += union(&mut merged, &[row(0, 0), row(1, 0), row(0, 1), row(1, 1)]);
                chi -= union(&mut merged, &[row(0, 0), row(0, 1)]);
                chi -= union(&mut merged, &[row(0, 0), row(1, 0)]);
                chi += self.row(y + z * ny).len() as i64;
            }
        }
        chi
    }
}

/// Number of runs in the union of closed runs, where runs that touch are one.
fn union(merged: &mut Vec<Run>, rows: &[&[Run]]) -> i64 {
    merged.clear();
    rows.iter().for_each(|row| merged.extend_from_slice(row));
    merged.sort_unstable();
    let (mut count, mut end) = (0, 0);
    for &[from, to] in merged.iter() {
        if count == 0 || from > end {
            count += 1;
        }
        end = end.max(to);
    }
    count
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::Vec3;
    use crate::complex::Sphere;

    fn complex(spheres: usize, edges: Vec<[u32; 2]>, faces: Vec<[u32; 3]>) -> MedialMesh {
        let spheres = vec![Sphere::new(Vec3::ZERO, 1.0); spheres];
        MedialMesh::from_simplices(spheres, edges, faces).unwrap()
    }

    /// Two triangles for each cell of an `m` by `n` grid that closes in both directions.
    fn torus_grid(m: u32, n: u32) -> Vec<[u32; 3]> {
        let id = |i: u32, j: u32| (i % m) * n + j % n;
        let cells = (0..m).flat_map(|i| (0..n).map(move |j| (i, j)));
        cells
            .flat_map(|(i, j)| {
                let [a, b, c, d] = [id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)];
                [[a, b, c], [a, c, d]]
            })
            .collect()
    }

    /// All squares of an `n` by `n` by `n` grid of cubes, as two triangles each: a foam of bubbles.
    fn foam(n: u32) -> MedialMesh {
        let m = n + 1;
        let id = |p: [u32; 3]| (p[0] * m + p[1]) * m + p[2];
        let mut faces = Vec::new();
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for (i, j, k) in
                (0..m).flat_map(|i| (0..n).flat_map(move |j| (0..n).map(move |k| (i, j, k))))
            {
                let corner = |du: u32, dv: u32| {
                    let mut p = [0; 3];
                    (p[axis], p[u], p[v]) = (i, j + du, k + dv);
                    id(p)
                };
                let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                faces.extend([[a, b, c], [a, c, d]]);
            }
        }
        complex((m * m * m) as usize, vec![], faces)
    }

    #[test]
    fn small_complexes_have_the_betti_numbers_of_the_textbook() {
        let tetrahedron = vec![[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]];
        assert_eq!(betti(&complex(4, vec![], tetrahedron)), [1, 0, 1]);
        assert_eq!(betti(&complex(3, vec![], vec![[0, 1, 2]])), [1, 0, 0]);
        assert_eq!(betti(&complex(3, vec![[0, 1], [1, 2], [0, 2]], vec![])), [1, 1, 0]);
        assert_eq!(betti(&MedialMesh::default()), [0, 0, 0]);
        assert_eq!(betti(&complex(3, vec![], vec![])), [3, 0, 0]);
        let torus = complex(16, vec![], torus_grid(4, 4));
        assert_eq!((torus.edges.len(), torus.faces.len()), (48, 32));
        assert_eq!((betti(&torus), euler(&torus)), ([1, 2, 1], 0));
        // The projective plane on six points is a cycle over Z_2, though not over the integers.
        let plane = vec![
            [0, 1, 4],
            [0, 1, 5],
            [0, 2, 3],
            [0, 2, 5],
            [0, 3, 4],
            [1, 2, 3],
            [1, 2, 4],
            [1, 3, 5],
            [2, 4, 5],
            [3, 4, 5],
        ];
        assert_eq!(betti(&complex(6, vec![], plane)), [1, 1, 1]);
    }

    #[test]
    fn bubbles_that_share_walls_are_counted_one_by_one() {
        // Two tetrahedra on a common face: two voids; three sheets meet at each of its edges.
        let twin =
            vec![[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3], [0, 1, 4], [0, 2, 4], [1, 2, 4]];
        assert_eq!(betti(&complex(5, vec![], twin)), [1, 0, 2]);
        for n in [1, 2, 5] {
            assert_eq!(betti(&foam(n)), [1, 0, u64::from(n).pow(3)], "{n}");
        }
    }

    #[test]
    fn the_full_skeleton_on_n_points_has_a_void_for_each_independent_tetrahedron() {
        let n = 24u32;
        let faces: Vec<[u32; 3]> = (0..n)
            .flat_map(|a| (a + 1..n).flat_map(move |b| (b + 1..n).map(move |c| [a, b, c])))
            .collect();
        // C(n - 1, 3) tetrahedra at one point bound all the others.
        assert_eq!(betti(&complex(n as usize, vec![], faces)), [1, 0, 23 * 22 * 21 / 6]);
    }

    #[test]
    fn a_million_faces_are_no_burden() {
        let sides = 710;
        let torus = complex((sides * sides) as usize, vec![], torus_grid(sides, sides));
        assert_eq!(betti(&torus), [1, 2, 1]);
    }

    /// Rank over `Z_2` by elimination on dense rows: nothing shared with the code under test.
    fn dense_rank(mut rows: Vec<u128>) -> usize {
        let mut rank = 0;
        for bit in 0..128 {
            let Some(found) = (rank..rows.len()).find(|&r| rows[r] >> bit & 1 == 1) else {
                continue;
            };
            rows.swap(rank, found);
            for r in 0..rows.len() {
                if r != rank && rows[r] >> bit & 1 == 1 {
                    rows[r] ^= rows[rank];
                }
            }
            rank += 1;
        }
        rank
    }

    fn dense_betti(mesh: &MedialMesh) -> [u64; 3] {
        let d1 = mesh.edges.iter().map(|[a, b]| 1 << a | 1 << b).collect();
        let place = |side: [u32; 2]| mesh.edges.iter().position(|&e| e == side).unwrap();
        let sides = |&[a, b, c]: &[u32; 3]| [[a, b], [a, c], [b, c]];
        let d2 =
            mesh.faces.iter().map(|f| sides(f).iter().map(|&s| 1u128 << place(s)).sum()).collect();
        let (rank1, rank2) = (dense_rank(d1), dense_rank(d2));
        let [v, e, f] = [mesh.spheres.len(), mesh.edges.len(), mesh.faces.len()];
        [(v - rank1) as u64, (e - rank1 - rank2) as u64, (f - rank2) as u64]
    }

    /// Up to 60 faces on at most 14 points: at most 91 edges, within the 128 bits of the oracle.
    fn random_complex() -> impl Strategy<Value = MedialMesh> {
        let sphere = |n: u32| (0..n, 1..n);
        (4..14u32).prop_flat_map(move |n| {
            let edge = sphere(n).prop_map(move |(a, step)| [a, (a + step) % n]);
            let face = (0..n, 0..n, 0..n);
            let edges = prop::collection::vec(edge, 0..20);
            let faces = prop::collection::vec(face, 0..60);
            (edges, faces).prop_map(move |(edges, faces)| {
                let proper = faces.into_iter().filter(|(a, b, c)| a != b && b != c && a != c);
                complex(n as usize, edges, proper.map(|(a, b, c)| [a, b, c]).collect())
            })
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(1000))]

        #[test]
        fn agrees_with_dense_elimination(mesh in random_complex()) {
            let computed = betti(&mesh);
            prop_assert_eq!(computed, dense_betti(&mesh));
            let [b0, b1, b2] = computed.map(|b| b as i64);
            prop_assert_eq!(euler(&mesh), b0 - b1 + b2);
        }

        #[test]
        fn is_invariant_under_renumbering(
            (mesh, order) in random_complex().prop_flat_map(|mesh| {
                let order: Vec<u32> = (0..mesh.spheres.len() as u32).collect();
                (Just(mesh), Just(order).prop_shuffle())
            }),
        ) {
            let carry = |i: u32| order[i as usize];
            let edges = mesh.edges.iter().map(|e| e.map(carry)).collect();
            let faces = mesh.faces.iter().map(|f| f.map(carry)).collect();
            prop_assert_eq!(betti(&complex(order.len(), edges, faces)), betti(&mesh));
        }
    }

    fn betti_of_voxels(voxels: impl IntoIterator<Item = [u32; 3]>) -> [u64; 3] {
        cubical_betti(&voxels.into_iter().collect::<Vec<_>>())
    }

    fn cube(n: u32) -> impl Iterator<Item = [u32; 3]> {
        (0..n * n * n).map(move |k| [k % n, k / n % n, k / n / n])
    }

    #[test]
    fn solids_shells_frames_and_dust() {
        assert_eq!(betti_of_voxels(cube(4)), [1, 0, 0]);
        assert_eq!(betti_of_voxels(cube(3).filter(|&v| v != [1, 1, 1])), [1, 0, 1]);
        // The twelve edges of a cube.
        let on_edges = |v: &[u32; 3]| v.iter().filter(|&&x| x % 4 == 0).count() >= 2;
        assert_eq!(betti_of_voxels(cube(5).filter(on_edges)), [1, 5, 0]);
        assert_eq!(betti_of_voxels(cube(5).filter(|v| v.iter().all(|x| x % 2 == 0))), [27, 0, 0]);
        // Even places: cubes that meet along edges enclose the odd ones, 13 of 27, one inside.
        assert_eq!(betti_of_voxels(cube(3).filter(|v| v.iter().sum::<u32>() % 2 == 0))[2], 1);
    }

    #[test]
    fn agrees_with_counting_cells_and_pairs() {
        let mut state = 1_u64;
        for density in [10, 30, 50, 70, 90] {
            for _ in 0..20 {
                let kept: Vec<[u32; 3]> = cube(6)
                    .filter(|_| {
                        state = state
                            .wrapping_mul(6364136223846793005)
                            .wrapping_add(1442695040888963407);
                        (state >> 33) % 100 < density
                    })
                    .collect();
                assert_eq!(cubical_betti(&kept), by_cells(&kept), "{kept:?}");
            }
        }
    }

    /// Cells at doubled coordinates in a dense array, components by all pairs.
    fn by_cells(voxels: &[[u32; 3]]) -> [u64; 3] {
        const N: usize = 8;
        let mut cells = vec![false; (2 * N + 1).pow(3)];
        let cell = |[x, y, z]: [usize; 3]| x + (2 * N + 1) * (y + (2 * N + 1) * z);
        let mut object = vec![false; N * N * N];
        let place = |[x, y, z]: [usize; 3]| x + N * (y + N * z);
        for voxel in voxels {
            let v = voxel.map(|x| x as usize + 1);
            object[place(v)] = true;
            for k in 0..27 {
                cells[cell([2 * v[0] + k % 3, 2 * v[1] + k / 3 % 3, 2 * v[2] + k / 9])] = true;
            }
        }
        let mut chi = 0_i64;
        for k in (0..cells.len()).filter(|&k| cells[k]) {
            let n = 2 * N + 1;
            let dimension = (k % n) % 2 + (k / n % n) % 2 + (k / n / n) % 2;
            chi += if dimension.is_multiple_of(2) { 1 } else { -1 };
        }
        let components = |kind: bool, corners: bool| {
            let members: Vec<usize> = (0..object.len()).filter(|&p| object[p] == kind).collect();
            let mut sets = DisjointSets::singletons(members.len());
            for (i, &p) in members.iter().enumerate() {
                for (j, &q) in members[..i].iter().enumerate() {
                    let apart = [1, N, N * N].map(|n| (p / n % N).abs_diff(q / n % N));
                    let most = if corners { 3 } else { 1 };
                    if apart.iter().all(|&d| d <= 1) && apart.iter().sum::<usize>() <= most {
                        sets.join(i as u32, j as u32);
                    }
                }
            }
            sets.len() as u64
        };
        let (b0, b2) = (components(true, true), components(false, false) - 1);
        [b0, ((b0 + b2) as i64 - chi) as u64, b2]
    }
}
