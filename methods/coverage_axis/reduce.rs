//! Makes a set cover smaller and keeps its optimum.
//!
//! 1. A sample that only one ball covers forces that ball.
//! 2. Of balls of which one covers all that the other does, the larger stays; of equal ones the first.
//! 3. Of samples of which every ball that covers one covers the other too, the latter needs no care.
//!
//! Again, until nothing changes.

use rayon::prelude::*;

use super::coverage::{Bits, Coverage, WORD, is_subset, ones, size};

/// What is left of a set cover, and what is decided.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Reduced {
    /// Balls of every smallest cover that is sought.
    pub forced: Vec<u32>,
    /// Balls that are left to choose from: the largest first, then by id.
    pub balls: Vec<u32>,
    /// For each sample left, the places in `balls` of those that cover it.
    pub rows: Vec<Vec<u32>>,
}

/// A set cover under reduction: what is left is marked in both directions of the matrix.
struct State {
    /// A row for each ball, restricted to the samples left.
    samples_of: Vec<Vec<u64>>,
    /// A row for each sample, restricted to the balls left.
    balls_of: Vec<Vec<u64>>,
    forced: Vec<u32>,
}

/// Reduces the cover of all samples that can be covered.
///
/// # Cost
/// For each ball, the balls that cover its rarest sample are compared with it; for samples likewise.
pub(super) fn reduce(coverage: &Coverage) -> Reduced {
    let transposed = coverage.transposed();
    let rows = |matrix: &Coverage| -> Vec<Vec<u64>> {
        (0..matrix.rows()).map(|row| matrix.row(row).to_vec()).collect()
    };
    let mut state =
        State { samples_of: rows(coverage), balls_of: rows(&transposed), forced: Vec::new() };
    while state.force() | state.drop_balls() | state.drop_samples() {}
    state.finish()
}

impl State {
    /// Step 1; whether anything changed.
    fn force(&mut self) -> bool {
        let mut changed = false;
        for sample in 0..self.balls_of.len() {
            // Its own ball may have been taken for a sample before.
            if size(&self.balls_of[sample]) != 1 {
                continue;
            }
            let ball = ones(&self.balls_of[sample]).next().expect("one is left");
            self.forced.push(ball as u32);
            let covered: Vec<usize> = ones(&self.samples_of[ball]).collect();
            covered.into_iter().for_each(|sample| self.drop_sample(sample));
            changed = true;
        }
        changed
    }

    /// Step 2.
    fn drop_balls(&mut self) -> bool {
        let dropped = dominated(&self.samples_of, &self.balls_of, Order::LargerStays);
        for &ball in &dropped {
            clear_row(&mut self.samples_of, &mut self.balls_of, ball);
        }
        !dropped.is_empty()
    }

    /// Step 3.
    fn drop_samples(&mut self) -> bool {
        let dropped = dominated(&self.balls_of, &self.samples_of, Order::SmallerStays);
        dropped.iter().for_each(|&sample| self.drop_sample(sample));
        !dropped.is_empty()
    }

    fn drop_sample(&mut self, sample: usize) {
        clear_row(&mut self.balls_of, &mut self.samples_of, sample);
    }

    fn finish(mut self) -> Reduced {
        self.forced.sort_unstable();
        let left = |rows: &[Vec<u64>]| -> Vec<u32> {
            (0..rows.len() as u32).filter(|&row| size(&rows[row as usize]) > 0).collect()
        };
        let mut balls = left(&self.samples_of);
        // The solver's answer depends on the order of its columns.
        balls.sort_by_key(|&ball| (usize::MAX - size(&self.samples_of[ball as usize]), ball));
        let mut place = vec![0; self.samples_of.len()];
        balls.iter().enumerate().for_each(|(at, &ball)| place[ball as usize] = at as u32);
        let row = |&sample: &u32| -> Vec<u32> {
            let mut row: Vec<u32> =
                ones(&self.balls_of[sample as usize]).map(|ball| place[ball]).collect();
            row.sort_unstable();
            row
        };
        let rows = left(&self.balls_of).iter().map(row).collect();
        Reduced { forced: self.forced, balls, rows }
    }
}

/// Which of two sets of which one contains the other is kept.
#[derive(Clone, Copy, PartialEq)]
enum Order {
    LargerStays,
    SmallerStays,
}

/// The rows that another row makes needless, ascending. `columns` is the matrix transposed.
fn dominated(rows: &[Vec<u64>], columns: &[Vec<u64>], order: Order) -> Vec<usize> {
    let sizes: Vec<usize> = rows.par_iter().map(|row| size(row)).collect();
    let column_sizes: Vec<usize> = columns.par_iter().map(|column| size(column)).collect();
    // A total order, so that of equal rows one stays, and all rows can be judged at once: what is
    // dropped for a row that is dropped itself is needless beside that which makes both so.
    let goes = |row: usize| -> bool {
        let comes_before = |other: usize| match order {
            Order::LargerStays => (sizes[other], row) > (sizes[row], other),
            Order::SmallerStays => (sizes[other], other) < (sizes[row], row),
        };
        match order {
            // A row that contains this one has all of its columns: the rarest has the fewest rows.
            Order::LargerStays => {
                let rarest = ones(&rows[row]).min_by_key(|&column| column_sizes[column]);
                let rarest = rarest.expect("an empty row is not asked");
                let mut others = ones(&columns[rarest]);
                others.any(|other| comes_before(other) && is_subset(&rows[row], &rows[other]))
            }
            // A row within this one has one of its columns, any.
            Order::SmallerStays => {
                let mut tried = vec![0_u64; columns.first().map_or(0, |column| column.len())];
                ones(&rows[row]).any(|column| {
                    let fresh: Vec<usize> = new_ones(&columns[column], &mut tried);
                    let within =
                        |&other: &usize| comes_before(other) && is_subset(&rows[other], &rows[row]);
                    fresh.iter().any(within)
                })
            }
        }
    };
    (0..rows.len()).into_par_iter().filter(|&row| sizes[row] > 0 && goes(row)).collect()
}

/// The members of a set that were not tried before; they are now.
fn new_ones(set: &Bits, tried: &mut Bits) -> Vec<usize> {
    let fresh: Vec<u64> = set.iter().zip(&*tried).map(|(set, tried)| set & !tried).collect();
    tried.iter_mut().zip(set).for_each(|(tried, set)| *tried |= set);
    ones(&fresh).collect()
}

/// Removes a row, here and where the matrix is transposed.
fn clear_row(rows: &mut [Vec<u64>], columns: &mut [Vec<u64>], row: usize) {
    for column in ones(&rows[row]) {
        columns[column][row / WORD] &= !(1 << (row % WORD));
    }
    rows[row].fill(0);
}
