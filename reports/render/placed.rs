//! A facet on the picture: which samples it covers, and where on it they lie.
//!
//! Corners are whole steps, so edge functions are integers and their signs exact. A sample on a side belongs to the facet
//! on one side of it alone.

use super::camera::Lens;
use super::facets::{Batch, Facet, Lines};

/// Samples along a side of a pixel.
pub(super) const SIDE: usize = 3;

/// Steps of a coordinate from one sample to the next.
const STEPS: i64 = 256;

/// Facets that reach farther from the picture than this, in steps, are left out: edge functions must not
/// overflow.
const FARTHEST: f64 = (1 << 29) as f64;

/// A facet on the picture, its corners in clockwise order as seen there.
pub(super) struct Placed {
    pub(super) batch: u32,
    pub(super) facet: u32,
    /// Whether corners 1 and 2 were exchanged.
    flipped: bool,
    at: [[i64; 2]; 3],
    nearness: [f64; 3],
    weights: [f64; 3],
}

impl Placed {
    pub(super) fn new(lens: &Lens<'_>, ids: [u32; 2], facet: &Facet) -> Option<Self> {
        let mut at = [[0; 2]; 3];
        let mut nearness = [0.0; 3];
        let mut weights = [0.0; 3];
        for k in 0..3 {
            let projected = lens.project(facet.corners[k])?;
            for axis in 0..2 {
                let steps = projected.at[axis] * (SIDE as i64 * STEPS) as f64;
                if steps.is_nan() || steps.abs() >= FARTHEST {
                    return None;
                }
                // Rounded without a call: what is cut off is positive.
                at[k][axis] = (steps + FARTHEST + 0.5) as i64 - FARTHEST as i64;
            }
            (nearness[k], weights[k]) = (projected.nearness, projected.weight);
        }
        let mut placed =
            Self { batch: ids[0], facet: ids[1], flipped: false, at, nearness, weights };
        let area = placed.area();
        if area < 0 {
            placed.flipped = true;
            placed.at.swap(1, 2);
            placed.nearness.swap(1, 2);
            placed.weights.swap(1, 2);
        }
        (area != 0).then_some(placed)
    }

    /// Twice the area, in square steps.
    fn area(&self) -> i64 {
        let [a, b, c] = self.at;
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    }

    /// The first and the last sample row or column whose middle the corners may enclose, cut to a range.
    pub(super) fn samples(&self, axis: usize, lo: usize, hi: usize) -> std::ops::Range<usize> {
        let along = self.at.map(|at| at[axis]);
        let least = along.iter().min().map_or(0, |&x| (x - STEPS / 2).div_euclid(STEPS));
        let most = along.iter().max().map_or(0, |&x| (x + STEPS / 2).div_euclid(STEPS));
        let cut = |x: i64| x.clamp(lo as i64, hi as i64) as usize;
        cut(least)..cut(most + 1)
    }

    /// Calls `hit` for each sample in a range of rows that is inside, with its column and nearness.
    pub(super) fn scan(
        &self,
        rows: std::ops::Range<usize>,
        columns: usize,
        mut hit: impl FnMut(usize, usize, f64),
    ) {
        let sides = Sides::new(self);
        let (z0, zx, zy) = self.nearness_plane();
        let columns = self.samples(0, 0, columns);
        let [first, _] = middle(0, columns.start);
        for row in self.samples(1, rows.start, rows.end) {
            let [_, y] = middle(row, 0);
            let mut w = sides.inclusive(first, y);
            let z_row = z0 + zy * (y - self.at[0][1]) as f64;
            let mut entered = false;
            for column in columns.clone() {
                if (w[0] | w[1] | w[2]) >= 0 {
                    entered = true;
                    let [x, _] = middle(0, column);
                    hit(row, column, z_row + zx * (x - self.at[0][0]) as f64);
                } else if entered {
                    break;
                }
                for k in 0..3 {
                    w[k] += STEPS * sides.along_x[k];
                }
            }
        }
    }

    /// Nearness at corner 0, and its change for a step along x and y.
    fn nearness_plane(&self) -> (f64, f64, f64) {
        let [a, b, c] = self.at;
        let [u, v] = [b, c].map(|p| [(p[0] - a[0]) as f64, (p[1] - a[1]) as f64]);
        let [du, dv] = [1, 2].map(|k| self.nearness[k] - self.nearness[0]);
        let area = self.area() as f64;
        let zx = (du * v[1] - dv * u[1]) / area;
        let zy = (dv * u[0] - du * v[0]) / area;
        (self.nearness[0], zx, zy)
    }
}

/// Edge functions: positive on the inner side of a side, twice the area of it and the point.
struct Sides {
    along_x: [i64; 3],
    along_y: [i64; 3],
    at_origin: [i64; 3],
    /// 1 for sides whose own points belong to the facet beyond.
    excluded: [i64; 3],
}

impl Sides {
    fn new(placed: &Placed) -> Self {
        let mut sides =
            Self { along_x: [0; 3], along_y: [0; 3], at_origin: [0; 3], excluded: [0; 3] };
        for k in 0..3 {
            let (a, b) = (placed.at[k], placed.at[(k + 1) % 3]);
            let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
            sides.along_x[k] = -dy;
            sides.along_y[k] = dx;
            sides.at_origin[k] = dy * a[0] - dx * a[1];
            // Exactly one of a side and its reverse is included.
            sides.excluded[k] = i64::from(!(dy > 0 || (dy == 0 && dx > 0)));
        }
        sides
    }

    fn at(&self, x: i64, y: i64) -> [i64; 3] {
        std::array::from_fn(|k| self.at_origin[k] + self.along_x[k] * x + self.along_y[k] * y)
    }

    /// Not negative where the point belongs to the facet.
    fn inclusive(&self, x: i64, y: i64) -> [i64; 3] {
        let w = self.at(x, y);
        std::array::from_fn(|k| w[k] - self.excluded[k])
    }
}

/// What is asked of a facet again and again, at places on it in steps.
pub(super) struct Within<'a> {
    placed: &'a Placed,
    pub(super) facet: &'a Facet,
    sides: Sides,
}

impl<'a> Within<'a> {
    pub(super) fn new(placed: &'a Placed, batches: &'a [Batch]) -> Self {
        let facet = &batches[placed.batch as usize].facets[placed.facet as usize];
        Self { placed, facet, sides: Sides::new(placed) }
    }

    /// Weights of the corners as they are stored in the facet; their sum is 1.
    pub(super) fn weights(&self, [x, y]: [i64; 2]) -> [f64; 3] {
        let w = self.sides.at(x, y);
        // The corner across side k is corner k + 2.
        let mut weights: [f64; 3] =
            std::array::from_fn(|k| w[(k + 1) % 3] as f64 * self.placed.weights[k]);
        let sum: f64 = weights.iter().sum();
        weights = weights.map(|weight| weight / sum);
        if self.placed.flipped {
            weights.swap(1, 2);
        }
        weights
    }

    /// How large the edge functions are where lines end, for sides as they are placed; negative without a line.
    pub(super) fn line_ends(&self, lines: Lines) -> [f64; 3] {
        let half = f64::from(lines.half_width) * (STEPS * SIDE as i64) as f64;
        std::array::from_fn(|k| {
            let stored = if self.placed.flipped { 2 - k } else { k };
            let (dx, dy) = (self.sides.along_y[k] as f64, self.sides.along_x[k] as f64);
            match self.facet.lines[stored] {
                0 => -1.0,
                width => half * f64::from(width) * (dx * dx + dy * dy).sqrt(),
            }
        })
    }

    pub(super) fn is_on_line(&self, ends: &[f64; 3], [x, y]: [i64; 2]) -> bool {
        let w = self.sides.at(x, y);
        (0..3).any(|k| (w[k] as f64) < ends[k])
    }
}

/// The middle of a sample, in steps.
pub(super) fn middle(row: usize, column: usize) -> [i64; 2] {
    [column, row].map(|k| STEPS * k as i64 + STEPS / 2)
}
