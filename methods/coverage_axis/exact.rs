//! The choice of Coverage Axis: a smallest set of balls that covers, by integer programming.

use std::time::{Duration, Instant};

use medial::simplifier::{RunContext, SimplifyError};
use microlp::{
    ComparisonOp, OptimizationDirection, Problem, ResumeOptions, SolveOptions, SolveOutcome,
    TerminationReason, Variable,
};

use super::coverage::{Coverage, size};
use super::params::CoverageAxisParams;
use super::reduce::{Reduced, reduce};

/// Nodes of branch and bound between two looks at the run.
const NODES_OF_A_SLICE: u64 = 32;

/// Non-zeros that are left at most: more would be the work of days.
const MOST_ENTRIES: usize = 4_000_000;

/// A cover, and how good it is known to be.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Cover {
    /// Indices of candidates, ascending.
    pub chosen: Vec<u32>,
    /// No cover has fewer balls.
    pub bound: usize,
    /// Balls and samples that the reductions left.
    pub reduced: [usize; 2],
    /// Nodes of branch and bound.
    pub nodes: usize,
    /// Samples that no candidate covers.
    pub uncoverable: usize,
    /// What ended the search.
    pub end: End,
}

/// What ends a search for a smallest cover.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum End {
    /// The solver: nothing better is left, but for its rounding.
    #[default]
    Solver,
    /// The number of nodes.
    Nodes,
    /// Time, so that another run may find another cover.
    Time,
}

/// A smallest cover of all samples that can be covered, or the best that the limits allow.
///
/// # Errors
/// When what the reductions leave is too large, or the solver fails.
pub(super) fn cover(
    coverage: &Coverage,
    params: &CoverageAxisParams,
    run: &RunContext,
) -> Result<Cover, SimplifyError> {
    let uncoverable = coverage.columns() - size(&coverage.coverable());
    let reduced = reduce(coverage);
    run.step(0, 1)?;
    let entries: usize = reduced.rows.iter().map(Vec::len).sum();
    if entries > MOST_ENTRIES {
        return Err(SimplifyError::unsupported(format!(
            "{} balls and {} samples are left after all reductions, {entries} entries: too many for an \
             exact cover; take select=greedy, fewer samples or a smaller dilation",
            reduced.balls.len(),
            reduced.rows.len(),
        )));
    }
    let mut found = solve(&reduced, params, run)?;
    let forced = reduced.forced.len();
    found.chosen.extend(&reduced.forced);
    found.chosen.sort_unstable();
    found.bound += forced;
    Ok(Cover { reduced: [reduced.balls.len(), reduced.rows.len()], uncoverable, ..found })
}

/// What the reductions left to choose.
fn solve(
    reduced: &Reduced,
    params: &CoverageAxisParams,
    run: &RunContext,
) -> Result<Cover, SimplifyError> {
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
    let start = |place: usize| if first.binary_search(&(place as u32)).is_ok() { 1.0 } else { 0.0 };
    options.warm_start =
        Some(balls.iter().enumerate().map(|(place, &ball)| (ball, start(place))).collect());
    let outcome = search(&problem, options, params, run)?;
    let stats = outcome.stats();
    let is_chosen = |solution: &microlp::Solution, ball| solution.var_value(ball).round() == 1.0;
    let mut places: Vec<u32> = match outcome.solution() {
        None => first.clone(),
        Some(solution) => {
            (0..balls.len() as u32).filter(|&p| is_chosen(solution, balls[p as usize])).collect()
        }
    };
    let covers = |row: &Vec<u32>| row.iter().any(|ball| places.binary_search(ball).is_ok());
    if places.len() > first.len() || !reduced.rows.iter().all(covers) {
        // Rounding may cost the solver's answer a row; the cover that it began with has all.
        places = first;
    }
    // The least whole number that rounding leaves possible; one ball is always needed.
    let bound = stats.best_bound.map_or(1.0, |bound| (bound - 1e-6).ceil()).max(1.0) as usize;
    Ok(Cover {
        bound: bound.min(places.len()),
        chosen: places.iter().map(|&place| reduced.balls[place as usize]).collect(),
        nodes: stats.nodes_solved as usize,
        end: match outcome.termination_reason() {
            TerminationReason::NodeLimit => End::Nodes,
            TerminationReason::TimeLimit => End::Time,
            _ => End::Solver,
        },
        ..Cover::default()
    })
}

/// Branch and bound in slices of nodes, so that a run can be cancelled and still repeats.
fn search(
    problem: &Problem,
    mut options: SolveOptions,
    params: &CoverageAxisParams,
    run: &RunContext,
) -> Result<SolveOutcome, SimplifyError> {
    let failed = |error: microlp::Error| {
        SimplifyError::unsupported(format!("the solver of the set cover gave up: {error}"))
    };
    let began = Instant::now();
    let left = || match params.time_limit {
        0.0 => None,
        limit => Some(Duration::from_secs_f64(limit).saturating_sub(began.elapsed())),
    };
    options.time_limit = left();
    let gap = options.mip_gap;
    let mut outcome = problem.solve_with(options).map_err(failed)?;
    while outcome.termination_reason() == TerminationReason::NodeLimit {
        let nodes = outcome.stats().nodes_solved as usize;
        run.step(nodes, params.nodes)?;
        if nodes >= params.nodes {
            break;
        }
        let mut options = ResumeOptions::default();
        options.node_limit = Some(NODES_OF_A_SLICE);
        options.mip_gap = Some(gap);
        options.time_limit = left();
        outcome = outcome.resume_with(options).map_err(failed)?;
    }
    Ok(outcome)
}

/// A cover to begin with: the ball that covers most of what is left, again and again. Places in
/// [`Reduced::balls`], ascending.
pub(super) fn largest_first(reduced: &Reduced) -> Vec<u32> {
    let mut rows_of: Vec<Vec<u32>> = vec![Vec::new(); reduced.balls.len()];
    for (row, balls) in reduced.rows.iter().enumerate() {
        balls.iter().for_each(|&ball| rows_of[ball as usize].push(row as u32));
    }
    let mut is_covered = vec![false; reduced.rows.len()];
    let mut chosen = Vec::new();
    while is_covered.contains(&false) {
        let gain = |ball: &Vec<u32>| ball.iter().filter(|&&row| !is_covered[row as usize]).count();
        // Of equal gains the first.
        let best = (0..rows_of.len()).rev().max_by_key(|&ball| gain(&rows_of[ball]));
        let best = best.expect("every row has a ball");
        rows_of[best].iter().for_each(|&row| is_covered[row as usize] = true);
        chosen.push(best as u32);
    }
    chosen.sort_unstable();
    chosen
}
