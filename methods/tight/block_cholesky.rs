//! The normal equations: a sparse symmetric matrix of 4 x 4 blocks, and its Cholesky factorisation.
//!
//! One block row for each sphere `(x, y, z, r)`, one block for each sphere and each edge of the medial
//! mesh. Spheres are eliminated in the order of least degree, which keeps the fill of such complexes,
//! sheets and curves, small.
//!
//! By hand because the only kept crate with a sparse Cholesky of a free licence (`faer`) brings some 140
//! others, and because blocks of four make the code short: no entry is looked up on its own.

use std::collections::BTreeSet;

/// A 4 x 4 block, by rows.
pub(super) type Block = [[f64; 4]; 4];

const ZERO: Block = [[0.0; 4]; 4];

/// Where the blocks of the factor are: found once for each connectivity.
#[derive(Clone, Debug)]
pub(super) struct Pattern {
    /// The vertex that is eliminated at each step.
    order: Vec<u32>,
    /// The step at which each vertex is eliminated.
    step: Vec<u32>,
    /// For each step the later steps with a block in its column, ascending.
    columns: Vec<Vec<u32>>,
}

impl Pattern {
    /// The pattern of a graph. Cost: the fill, times its logarithm.
    pub fn new(vertices: usize, edges: &[[u32; 2]]) -> Self {
        let mut around = vec![BTreeSet::new(); vertices];
        for &[a, b] in edges {
            around[a as usize].insert(b);
            around[b as usize].insert(a);
        }
        let mut queue: BTreeSet<(usize, u32)> =
            (0..vertices as u32).map(|v| (around[v as usize].len(), v)).collect();
        let mut order = Vec::with_capacity(vertices);
        let mut fill = Vec::with_capacity(vertices);
        while let Some((_, v)) = queue.pop_first() {
            let link = std::mem::take(&mut around[v as usize]);
            // Neighbours of an eliminated vertex become adjacent to each other.
            for &w in &link {
                let set = &mut around[w as usize];
                queue.remove(&(set.len(), w));
                set.remove(&v);
                set.extend(link.iter().filter(|&&other| other != w));
                queue.insert((set.len(), w));
            }
            order.push(v);
            fill.push(link);
        }
        let mut step = vec![0; vertices];
        for (k, &v) in (0..).zip(&order) {
            step[v as usize] = k;
        }
        let columns = fill.iter().map(|link| {
            let mut column: Vec<u32> = link.iter().map(|&w| step[w as usize]).collect();
            column.sort_unstable();
            column
        });
        let columns = columns.collect();
        Self { order, step, columns }
    }
}

/// A symmetric matrix with a pattern.
pub(super) struct Normal {
    diagonal: Vec<Block>,
    below: Vec<Vec<Block>>,
}

impl Normal {
    /// The zero matrix.
    pub fn zero(pattern: &Pattern) -> Self {
        let below = pattern.columns.iter().map(|column| vec![ZERO; column.len()]).collect();
        Self { diagonal: vec![ZERO; pattern.order.len()], below }
    }

    /// Adds `scale * direction directionᵀ` to the block of two vertices that are equal or adjacent.
    /// Of two different vertices one order is enough.
    #[inline]
    pub fn add(&mut self, pattern: &Pattern, v: u32, w: u32, scale: f64, direction: &[f64; 4]) {
        let [i, j] = [v, w].map(|v| pattern.step[v as usize]);
        let block = if i == j {
            &mut self.diagonal[i as usize]
        } else {
            let (i, j) = (i.min(j) as usize, i.max(j));
            let place = pattern.columns[i].binary_search(&j).expect("the two are adjacent");
            &mut self.below[i][place]
        };
        // Symmetric blocks: the transposed one is the same.
        add_product(block, scale, direction);
    }

    /// The diagonal entries of a vertex.
    pub fn diagonal(&self, pattern: &Pattern, v: u32) -> [f64; 4] {
        let block = &self.diagonal[pattern.step[v as usize] as usize];
        [0, 1, 2, 3].map(|k| block[k][k])
    }

    /// The solution `x` of `(A + diag(extra)) x = b`, each by vertex; `None` if the matrix is not
    /// positive definite.
    pub fn solve(
        &self,
        pattern: &Pattern,
        extra: &[[f64; 4]],
        b: &[[f64; 4]],
    ) -> Option<Vec<[f64; 4]>> {
        let steps = pattern.order.len();
        let (mut diagonal, mut below) = (self.diagonal.clone(), self.below.clone());
        for (k, &v) in pattern.order.iter().enumerate() {
            for (c, extra) in extra[v as usize].iter().enumerate() {
                diagonal[k][c][c] += extra;
            }
        }
        for k in 0..steps {
            let lower = cholesky(&diagonal[k])?;
            diagonal[k] = lower;
            let mut panel = std::mem::take(&mut below[k]);
            panel.iter_mut().for_each(|block| *block = divided(block, &lower));
            let rows = &pattern.columns[k];
            for (p, &i) in rows.iter().enumerate() {
                subtract_product(&mut diagonal[i as usize], &panel[p], &panel[p]);
                let column = &pattern.columns[i as usize];
                // Both lists ascend, and the column of `i` has every later row of this one.
                let mut place = 0;
                for (q, &j) in rows.iter().enumerate().skip(p + 1) {
                    while column[place] != j {
                        place += 1;
                    }
                    subtract_product(&mut below[i as usize][place], &panel[q], &panel[p]);
                }
            }
            below[k] = panel;
        }
        let mut x: Vec<[f64; 4]> = pattern.order.iter().map(|&v| b[v as usize]).collect();
        for k in 0..steps {
            x[k] = forward(&diagonal[k], x[k]);
            let known = x[k];
            for (&i, block) in pattern.columns[k].iter().zip(&below[k]) {
                for (value, row) in x[i as usize].iter_mut().zip(block) {
                    *value -= dot(row, &known);
                }
            }
        }
        for k in (0..steps).rev() {
            let mut value = x[k];
            for (&i, block) in pattern.columns[k].iter().zip(&below[k]) {
                for (row, known) in block.iter().zip(x[i as usize]) {
                    for (value, entry) in value.iter_mut().zip(row) {
                        *value -= entry * known;
                    }
                }
            }
            x[k] = backward(&diagonal[k], value);
        }
        let mut solution = vec![[0.0; 4]; steps];
        for (k, &v) in pattern.order.iter().enumerate() {
            solution[v as usize] = x[k];
        }
        Some(solution)
    }
}

/// `block += scale * direction directionᵀ`.
#[inline]
pub(super) fn add_product(block: &mut Block, scale: f64, direction: &[f64; 4]) {
    for (line, x) in block.iter_mut().zip(direction) {
        for (entry, y) in line.iter_mut().zip(direction) {
            *entry += scale * x * y;
        }
    }
}

/// The lower triangular factor of a block, or `None` if it is not positive definite.
pub(super) fn cholesky(block: &Block) -> Option<Block> {
    let mut lower = ZERO;
    for i in 0..4 {
        for j in 0..=i {
            let rest = block[i][j] - (0..j).map(|k| lower[i][k] * lower[j][k]).sum::<f64>();
            if i != j {
                lower[i][j] = rest / lower[j][j];
            } else if rest > 0.0 {
                lower[i][i] = rest.sqrt();
            } else {
                return None;
            }
        }
    }
    Some(lower)
}

/// `B L⁻ᵀ`.
fn divided(block: &Block, lower: &Block) -> Block {
    block.map(|row| forward(lower, row))
}

/// `target -= A Bᵀ`.
#[inline]
fn subtract_product(target: &mut Block, a: &Block, b: &Block) {
    for (row, a) in target.iter_mut().zip(a) {
        for (entry, b) in row.iter_mut().zip(b) {
            *entry -= dot(a, b);
        }
    }
}

#[inline]
fn dot(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
}

/// The solution of `L x = b`.
#[inline]
pub(super) fn forward(lower: &Block, mut b: [f64; 4]) -> [f64; 4] {
    for i in 0..4 {
        let known: f64 = (0..i).map(|k| lower[i][k] * b[k]).sum();
        b[i] = (b[i] - known) / lower[i][i];
    }
    b
}

/// The solution of `Lᵀ x = b`.
#[inline]
pub(super) fn backward(lower: &Block, mut b: [f64; 4]) -> [f64; 4] {
    for i in (0..4).rev() {
        let known: f64 = (i + 1..4).map(|k| lower[k][i] * b[k]).sum();
        b[i] = (b[i] - known) / lower[i][i];
    }
    b
}
