//! Step 2: for each ball the smallest scale at which another one contains it.
//!
//! Branch and bound over a tree of boxes: no ball in a box at distance `d` whose largest radius is
//! `R` contains the ball of radius `r` below scale `d / (R - r)`.

use medial::Vec3;
use medial::complex::Sphere;
use rayon::prelude::*;

/// Balls in a leaf.
const LEAF: usize = 8;

/// The critical scale of each ball. Parallel; the order of `O(n log n)` for medial spheres.
pub(super) fn critical_scales(balls: &[Sphere]) -> Vec<f64> {
    let mut sorted = balls.to_vec();
    let mut nodes = Vec::new();
    if !sorted.is_empty() {
        build(&mut sorted, 0, &mut nodes);
    }
    let tree = Tree { balls: sorted, nodes };
    balls.par_iter().map(|ball| tree.critical_scale(ball)).collect()
}

struct Node {
    low: Vec3,
    high: Vec3,
    largest: f64,
    /// Of the sorted balls.
    start: u32,
    end: u32,
    /// The second child, the first follows its parent; zero in a leaf.
    second: u32,
}

struct Tree {
    balls: Vec<Sphere>,
    nodes: Vec<Node>,
}

/// Halves the balls at the median along the longest side of their box.
fn build(balls: &mut [Sphere], start: usize, nodes: &mut Vec<Node>) {
    let first = balls[0].centre;
    let low = balls.iter().fold(first, |m, b| m.min(b.centre));
    let high = balls.iter().fold(first, |m, b| m.max(b.centre));
    let largest = balls.iter().map(|b| b.radius).fold(0.0, f64::max);
    let here = nodes.len();
    let end = (start + balls.len()) as u32;
    nodes.push(Node { low, high, largest, start: start as u32, end, second: 0 });
    if balls.len() <= LEAF {
        return;
    }
    let axis = (high - low).max_position();
    let middle = balls.len() / 2;
    balls.select_nth_unstable_by(middle, |a, b| a.centre[axis].total_cmp(&b.centre[axis]));
    let (left, right) = balls.split_at_mut(middle);
    build(left, start, nodes);
    nodes[here].second = nodes.len() as u32;
    build(right, start + middle, nodes);
}

impl Tree {
    fn critical_scale(&self, ball: &Sphere) -> f64 {
        let mut best = f64::MAX;
        let mut stack = vec![(0.0, 0)];
        if self.nodes.is_empty() {
            return best;
        }
        while let Some((bound, at)) = stack.pop() {
            if bound >= best {
                continue;
            }
            let node: &Node = &self.nodes[at];
            if node.second == 0 {
                let larger = self.balls[node.start as usize..node.end as usize]
                    .iter()
                    .filter(|b| b.radius > ball.radius);
                let scales =
                    larger.map(|b| ball.centre.distance(b.centre) / (b.radius - ball.radius));
                best = scales.fold(best, f64::min);
                continue;
            }
            let children = [at + 1, node.second as usize].map(|c| (self.bound(c, ball), c));
            // The nearer one on top.
            let [near, far] =
                if children[1].0 < children[0].0 { [children[1], children[0]] } else { children };
            stack.extend([far, near]);
        }
        best
    }

    /// A lower bound of the critical scale by the balls of a node.
    fn bound(&self, node: usize, ball: &Sphere) -> f64 {
        let Node { low, high, largest, .. } = self.nodes[node];
        if largest <= ball.radius {
            return f64::INFINITY;
        }
        let nearest = ball.centre.clamp(low, high);
        // Rounding must not hide the ball itself that the bound is attained by.
        ball.centre.distance(nearest) / (largest - ball.radius) * (1.0 - 1e-12)
    }
}
