//! The choice of Coverage Axis: a smallest set of balls that covers, by integer programming.

use medial::simplifier::{RunContext, SimplifyError};
use microlp::{
    ComparisonOp, OptimizationDirection, Problem, ResumeOptions, SolveOptions, SolveOutcome,
    TerminationReason, Variable,
};
use rayon::prelude::*;

use super::coverage::{Bits, Coverage, WORD, is_subset, ones, size};
use crate::Result;

/// Limit of the nodes of branch and bound.
const MAX_NODES: usize = 10_000;

/// Nodes of branch and bound between two checks for cancellation.
const NODES_OF_A_SLICE: u64 = 32;

/// Limit of the non-zeros after the reductions. More would be the work of days.
const MOST_ENTRIES: usize = 4_000_000;

/// A cover, and how good it is known to be.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Cover {
    /// Indices of candidates, ascending.
    pub chosen: Vec<u32>,
    /// No cover has fewer balls.
    pub bound: usize,
    /// Samples that no candidate covers.
    pub uncoverable: usize,
}

/// A smallest cover of all samples that can be covered, or the best that the limits allow.
///
/// # Errors
/// When the reduced problem is too large, or the solver fails.
pub(super) fn cover(coverage: &Coverage, run: &RunContext) -> Result<Cover> {
    let uncoverable = coverage.columns() - size(&coverage.coverable());
    let reduced = reduce(coverage, run)?;
    run.step(0, 1)?;
    let entries: usize = reduced.rows.iter().map(Vec::len).sum();
    if entries > MOST_ENTRIES {
        return Err(SimplifyError::unsupported(format!(
            "{} balls and {} samples remain after all reductions, with {entries} entries: too many for an \
             exact cover; use select=greedy or a smaller dilation",
            reduced.balls.len(),
            reduced.rows.len(),
        )));
    }
    let mut found = solve(&reduced, run)?;
    // Forced balls are in every cover of the samples that they alone cover: they raise the bound too.
    let forced = reduced.forced.len();
    found.chosen.extend(&reduced.forced);
    found.chosen.sort_unstable();
    found.bound += forced;
    Ok(Cover { uncoverable, ..found })
}

/// The choices that the reductions leave.
fn solve(reduced: &Reduced, run: &RunContext) -> Result<Cover> {
    if reduced.rows.is_empty() {
        return Ok(Cover::default());
    }
    let mut problem = Problem::new(OptimizationDirection::Minimize);
    let balls: Vec<Variable> = reduced.balls.iter().map(|_| problem.add_binary_var(1.0)).collect();
    for row in &reduced.rows {
        let terms = row.iter().map(|&ball| (balls[ball as usize], 1.0));
        problem.add_constraint(terms.collect::<Vec<_>>(), ComparisonOp::Ge, 1.0);
    }
    let first = largest_first(reduced);
    let mut options = SolveOptions::default();
    options.node_limit = Some(NODES_OF_A_SLICE);
    // Numbers of balls are whole: a gap below one ball is none.
    options.mip_gap = 0.999 / first.len() as f64;
    let start = balls
        .iter()
        .zip(0_u32..)
        .map(|(&ball, place)| (ball, if first.binary_search(&place).is_ok() { 1.0 } else { 0.0 }));
    options.warm_start = Some(start.collect());
    let outcome = search(&problem, options, run)?;
    let stats = outcome.stats();
    let mut places: Vec<u32> = match outcome.solution() {
        None => first.clone(),
        Some(solution) => (0..balls.len() as u32)
            .filter(|&place| solution.var_value(balls[place as usize]).round() == 1.0)
            .collect(),
    };
    let mut rows = reduced.rows.iter();
    let covers = rows.all(|row| row.iter().any(|ball| places.binary_search(ball).is_ok()));
    if places.len() > first.len() || !covers {
        // Rounding may leave a row of the solver's cover uncovered; the initial cover has all.
        places = first;
    }
    // The least whole number that rounding leaves possible; one ball is always needed.
    let bound = stats.best_bound.map_or(1.0, |bound| (bound - 1e-6).ceil()).max(1.0) as usize;
    Ok(Cover {
        bound: bound.min(places.len()),
        chosen: places.iter().map(|&place| reduced.balls[place as usize]).collect(),
        uncoverable: 0,
    })
}

/// Branch and bound in slices of nodes, so that a run can be cancelled and still repeats.
fn search(problem: &Problem, options: SolveOptions, run: &RunContext) -> Result<SolveOutcome> {
    let gap = options.mip_gap;
    let mut outcome = problem.solve_with(options).map_err(failed)?;
    while outcome.termination_reason() == TerminationReason::NodeLimit {
        let nodes = outcome.stats().nodes_solved as usize;
        run.step(nodes, MAX_NODES)?;
        if nodes >= MAX_NODES {
            break;
        }
        let mut options = ResumeOptions::default();
        options.node_limit = Some(NODES_OF_A_SLICE);
        options.mip_gap = Some(gap);
        outcome = outcome.resume_with(options).map_err(failed)?;
    }
    Ok(outcome)
}

fn failed(error: microlp::Error) -> SimplifyError {
    SimplifyError::unsupported(format!("the solver of the set cover failed: {error}"))
}

/// A first cover: repeatedly the ball that covers most of the rest. Places in [`Reduced::balls`], ascending.
pub(super) fn largest_first(reduced: &Reduced) -> Vec<u32> {
    let mut rows_of: Vec<Vec<u32>> = vec![Vec::new(); reduced.balls.len()];
    for (row, balls) in reduced.rows.iter().enumerate() {
        balls.iter().for_each(|&ball| rows_of[ball as usize].push(row as u32));
    }
    let mut is_covered = vec![false; reduced.rows.len()];
    let mut chosen = Vec::new();
    while is_covered.contains(&false) {
        // Backwards, as `max_by_key` takes the last of equals: the first of equal gains.
        let best = (0..rows_of.len())
            .rev()
            .max_by_key(|&ball| rows_of[ball].iter().filter(|&&r| !is_covered[r as usize]).count());
        let best = best.expect("every row has a ball");
        rows_of[best].iter().for_each(|&row| is_covered[row as usize] = true);
        chosen.push(best as u32);
    }
    chosen.sort_unstable();
    chosen
}

// ----------------------------------------------------------------------------
// Makes a set cover smaller and keeps its optimum.
//
// 1. A sample that only one ball covers forces that ball.
// 2. Of balls of which one covers all that the other does, the larger stays; of equal ones the first.
// 3. Of samples of which every ball that covers one covers the other too, the latter needs no care.
//
// Again, until nothing changes.

/// A reduced set cover, and the decided balls.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Reduced {
    /// Balls of every smallest cover that is sought.
    pub forced: Vec<u32>,
    /// Balls that are left to choose from: the largest first, then by id.
    pub balls: Vec<u32>,
    /// For each sample left, the places in `balls` of those that cover it.
    pub rows: Vec<Vec<u32>>,
}

/// A set cover under reduction: the rest is marked in both directions of the matrix.
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
pub(super) fn reduce(coverage: &Coverage, run: &RunContext) -> Result<Reduced> {
    let transposed = coverage.transposed();
    let [samples_of, balls_of] = [coverage, &transposed]
        .map(|matrix| (0..matrix.rows()).map(|row| matrix.row(row).to_vec()).collect());
    let mut state = State { samples_of, balls_of, forced: Vec::new() };
    // No short circuit: each round applies all three.
    while state.force() | state.drop_balls() | state.drop_samples() {
        run.check()?;
    }
    Ok(state.finish())
}

impl State {
    /// Step 1; whether anything changed.
    fn force(&mut self) -> bool {
        let mut changed = false;
        for sample in 0..self.balls_of.len() {
            // Its own ball may have been taken for an earlier sample.
            if size(&self.balls_of[sample]) != 1 {
                continue;
            }
            let ball = ones(&self.balls_of[sample]).next().expect("one is left");
            self.forced.push(ball as u32);
            // Collected first, since dropping a sample clears bits of this row.
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
        let [mut balls, samples] = [&self.samples_of, &self.balls_of].map(|rows| {
            let left = (0..rows.len() as u32).filter(|&row| size(&rows[row as usize]) > 0);
            left.collect::<Vec<u32>>()
        });
        // The solver's result depends on the order of its columns.
        balls.sort_by_key(|&ball| (usize::MAX - size(&self.samples_of[ball as usize]), ball));
        let mut place = vec![0; self.samples_of.len()];
        balls.iter().enumerate().for_each(|(at, &ball)| place[ball as usize] = at as u32);
        let rows = samples.into_iter().map(|sample| {
            let balls = ones(&self.balls_of[sample as usize]);
            let mut row: Vec<u32> = balls.map(|ball| place[ball]).collect();
            row.sort_unstable();
            row
        });
        Reduced { rows: rows.collect(), forced: self.forced, balls }
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
    // A total order, so that of equal rows one stays, and all rows can be tested at once: a row that is needless due
    // to a dropped row is needless also due to the row that makes both so.
    let needless = (0..rows.len()).into_par_iter().filter(|&row| match order {
        _ if sizes[row] == 0 => false,
        // A row that contains this one has all of its columns: the rarest has the fewest rows.
        Order::LargerStays => {
            let rarest = ones(&rows[row]).min_by_key(|&column| column_sizes[column]);
            let rarest = rarest.expect("the row is not empty");
            ones(&columns[rarest]).any(|other| {
                (sizes[other], row) > (sizes[row], other) && is_subset(&rows[row], &rows[other])
            })
        }
        // A row within this one has one of its columns, any.
        Order::SmallerStays => {
            let mut tried = vec![0_u64; columns.first().map_or(0, |column| column.len())];
            ones(&rows[row]).any(|column| {
                new_ones(&columns[column], &mut tried).into_iter().any(|other| {
                    (sizes[other], other) < (sizes[row], row) && is_subset(&rows[other], &rows[row])
                })
            })
        }
    });
    needless.collect()
}

/// The members of a set that were not tried before; they are now.
fn new_ones(set: &Bits, tried: &mut Bits) -> Vec<usize> {
    let fresh: Vec<u64> = set.iter().zip(&*tried).map(|(set, tried)| set & !tried).collect();
    tried.iter_mut().zip(set).for_each(|(tried, set)| *tried |= set);
    ones(&fresh).collect()
}

/// Removes a row, here and where the matrix is transposed.
fn clear_row(rows: &mut [Vec<u64>], columns: &mut [Vec<u64>], row: usize) {
    // Both directions of the matrix must agree, since each step reads both.
    for column in ones(&rows[row]) {
        columns[column][row / WORD] &= !(1 << (row % WORD));
    }
    rows[row].fill(0);
}
