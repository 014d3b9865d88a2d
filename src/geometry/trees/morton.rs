//! Points along a Morton curve, and batches of queries along it, in which each query may start from
//! the answer of the one before.

use rayon::prelude::*;

use super::Bounds;
use crate::Vec3;

/// Consecutive queries on one thread: enough that the first, which starts from nothing, does not
/// matter, and few enough to balance the load.
const CHUNK: usize = 1024;

/// Answers a query for each point. `answer` may keep in its state anything that speeds up the next,
/// nearby query, but no answer may depend on the state.
pub fn in_morton_order<S, R>(points: &[Vec3], answer: impl Fn(&mut S, Vec3) -> R + Sync) -> Vec<R>
where
    S: Default,
    R: Copy + Send + Sync,
{
    let order = morton_order(points);
    let sorted: Vec<R> = order
        .par_chunks(CHUNK)
        .flat_map_iter(|chunk| {
            let mut state = S::default();
            let answer = &answer;
            chunk.iter().map(move |&(_, point)| answer(&mut state, points[point as usize]))
        })
        .collect();
    // The inverse order first, so that the results can be gathered in parallel.
    let mut places = vec![0_u32; points.len()];
    for (place, &(_, point)) in (0..).zip(&order) {
        places[point as usize] = place;
    }
    places.par_iter().map(|&place| sorted[place as usize]).collect()
}

/// Morton codes and indices of points, sorted. Points that are not numbers have a code too.
pub fn morton_order(points: &[Vec3]) -> Vec<(u64, u32)> {
    let Bounds { lo, hi } = Bounds::of_points(points.iter().copied());
    let scale = (hi - lo).map(|extent| if extent > 0.0 { (1 << 21) as f64 / extent } else { 0.0 });
    let code = |p: Vec3| morton_code((p - lo) * scale);
    // The index breaks ties, so that an unstable parallel sort has one result.
    let mut order: Vec<(u64, u32)> =
        (0..points.len()).into_par_iter().map(|i| (code(points[i]), i as u32)).collect();
    order.par_sort_unstable();
    order
}

/// An order of points of which every prefix is spread evenly over all of them: it steps through
/// their Morton curve by the golden ratio. Input indices matter for coincident points only.
/// Cost `O(n log n)`.
///
/// ```
/// use medial_geometry::{Vec3, trees::spread_order};
///
/// let points: Vec<Vec3> = (0..100).map(|k| Vec3::new(f64::from(k), 0.0, 0.0)).collect();
/// let mut first: Vec<u32> = spread_order(&points)[..5].to_vec();
/// first.sort_unstable();
/// assert!(first[0] < 20 && first[4] >= 80);
/// ```
pub fn spread_order(points: &[Vec3]) -> Vec<u32> {
    // The golden ratio as a fraction of 2^32: its multiples modulo one leave nearly equal gaps.
    const GOLDEN: u32 = 0x9e37_79b9;
    let along = morton_order(points);
    let keyed = (0_u32..).zip(along).map(|(place, (_, point))| (place.wrapping_mul(GOLDEN), point));
    let mut spread: Vec<(u32, u32)> = keyed.collect();
    spread.sort_unstable();
    spread.into_iter().map(|(_, point)| point).collect()
}

/// The Morton code of a point with coordinates from 0 to `2^21`.
pub fn morton_code(p: Vec3) -> u64 {
    // The casts saturate: points that are not numbers have a code too.
    let cell = p.to_array().map(|c| spread((c as u64).min((1 << 21) - 1)));
    cell[0] | cell[1] << 1 | cell[2] << 2
}

/// The 21 bits of a number, each followed by two zeros.
fn spread(mut bits: u64) -> u64 {
    for (shift, mask) in [
        (32, 0x001f_0000_0000_ffff),
        (16, 0x001f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ] {
        bits = (bits | bits << shift) & mask;
    }
    bits
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spread_puts_two_zeros_between_bits() {
        for bits in [0, 1, 0b1011, (1 << 21) - 1, 0x15_5555] {
            let naive = (0..21).map(|i| (bits >> i & 1) << (3 * i)).sum::<u64>();
            assert_eq!(spread(bits), naive);
        }
    }

    #[test]
    fn answers_come_back_in_the_order_of_the_points() {
        let points: Vec<Vec3> = (0..5000)
            .map(|i| Vec3::new((f64::from(i) * 0.37).sin(), f64::from(i % 71), 0.5))
            .collect();
        let echoed = in_morton_order(&points, |last: &mut Option<Vec3>, p| {
            *last = Some(p);
            p
        });
        assert_eq!(echoed, points);
        assert!(in_morton_order(&[], |(): &mut (), p| p).is_empty());
        let odd = [Vec3::NAN, Vec3::ZERO, Vec3::splat(f64::INFINITY)];
        assert_eq!(in_morton_order(&odd, |(): &mut (), p| p.x.to_bits())[1], 0);
    }
}
