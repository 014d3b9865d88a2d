//! Betti numbers of a set of voxels, as the union of closed cubes (26-connectivity).
//!
//! - `b0` counts the 26-connected components.
//! - `b2` counts the bounded 6-connected components of the other voxels: the complement of the union
//!   is open, and by Alexander duality it has one component more than the union has voids.
//! - The Euler number `chi` counts, with alternating signs, the voxels and the vertices, edges and
//!   squares of the lattice on them. `b1 = b0 + b2 - chi`.
//!
//! Components are found over runs of voxels along `x` (J. Hoshen, R. Kopelman, "Percolation and
//! cluster distribution", Physical Review B 14, 1976, doi:10.1103/PhysRevB.14.3438, on runs).

use crate::geometry::DisjointSets;

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
    use super::*;

    fn betti(voxels: impl IntoIterator<Item = [u32; 3]>) -> [u64; 3] {
        cubical_betti(&voxels.into_iter().collect::<Vec<_>>())
    }

    fn cube(n: u32) -> impl Iterator<Item = [u32; 3]> {
        (0..n * n * n).map(move |k| [k % n, k / n % n, k / n / n])
    }

    #[test]
    fn solids_shells_frames_and_dust() {
        assert_eq!(betti(cube(4)), [1, 0, 0]);
        assert_eq!(betti(cube(3).filter(|&v| v != [1, 1, 1])), [1, 0, 1]);
        // The twelve edges of a cube.
        let on_edges = |v: &[u32; 3]| v.iter().filter(|&&x| x % 4 == 0).count() >= 2;
        assert_eq!(betti(cube(5).filter(on_edges)), [1, 5, 0]);
        assert_eq!(betti(cube(5).filter(|v| v.iter().all(|x| x % 2 == 0))), [27, 0, 0]);
        // Even places: cubes that meet along edges enclose the odd ones, 13 of 27, one inside.
        assert_eq!(betti(cube(3).filter(|v| v.iter().sum::<u32>() % 2 == 0))[2], 1);
    }

    #[test]
    fn agrees_with_counting_cells_and_flooding() {
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

    /// Cells at doubled coordinates in a dense array, components by flooding.
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
        let flood = |kind: bool, corners: bool| {
            let mut seen = vec![false; object.len()];
            let mut components = 0_u64;
            for start in 0..object.len() {
                if object[start] != kind || seen[start] {
                    continue;
                }
                components += 1;
                seen[start] = true;
                let mut stack = vec![start];
                while let Some(p) = stack.pop() {
                    let (x, y, z) = (p % N, p / N % N, p / N / N);
                    for q in 0..object.len() {
                        let (u, v, w) = (q % N, q / N % N, q / N / N);
                        let d = [x.abs_diff(u), y.abs_diff(v), z.abs_diff(w)];
                        let near = if corners {
                            d.iter().all(|&d| d <= 1)
                        } else {
                            d.iter().sum::<usize>() == 1
                        };
                        if near && object[q] == kind && !seen[q] {
                            seen[q] = true;
                            stack.push(q);
                        }
                    }
                }
            }
            components
        };
        let (b0, b2) = (flood(true, true), flood(false, false) - 1);
        [b0, ((b0 + b2) as i64 - chi) as u64, b2]
    }
}
