//! The order of items of equal value.
//!
//! Many values are equal: sheets through the middle of their two samples all have 180 degrees, facets of
//! a plate all have half its thickness. Ordered by index, the first of them would form one lump at one
//! end of the shape, because indices follow a curve. Ordered by rounding errors, which grow with the
//! coordinates, they would, too. So values that agree up to rounding count as equal ([`tie`]).
//!
//! Larger items are kept first. Items of about the same size are ordered such that every prefix is
//! spread over all of them ([`spread_order`]). Sizes are compared by half octaves: compared exactly, the
//! first items would gather where the shape is thickest, and rounding would decide on a plate.

use medial::Vec3;
use medial::complex::Sphere;
use medial::geometry::trees::spread_order;

/// Size classes in a doubling of the radius.
const CLASSES: f64 = 2.0;

/// Bound on the relative rounding error of equal values.
const ROUNDING: f64 = 1e-12;

/// Whether two values are equal up to rounding.
pub(crate) fn tie(a: f64, b: f64) -> bool {
    (a - b).abs() <= ROUNDING * a.abs().max(b.abs())
}

/// Puts every run of values that tie in order. `items` are by descending value; `sphere` says where an
/// item is and how large. `O(n)` where nothing ties.
pub(crate) fn break_ties<T: Copy>(
    items: &mut [T],
    value: impl Fn(T) -> f64,
    sphere: impl Fn(T) -> Sphere,
) {
    for run in items.chunk_by_mut(|&a, &b| tie(value(a), value(b))) {
        if run.len() > 1 {
            order_of_equals(run, &sphere);
        }
    }
}

fn order_of_equals<T: Copy>(run: &mut [T], sphere: &impl Fn(T) -> Sphere) {
    let class = |&item: &T| (sphere(item).radius.log2() * CLASSES).floor();
    let mut keyed: Vec<(f64, T)> = run.iter().map(|item| (class(item), *item)).collect();
    keyed.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut rest = run.iter_mut();
    for equals in keyed.chunk_by(|a, b| a.0 == b.0) {
        let centres: Vec<Vec3> = equals.iter().map(|&(_, item)| sphere(item).centre).collect();
        let spread = spread_order(&centres);
        for (place, next) in spread.into_iter().zip(rest.by_ref()) {
            *next = equals[place as usize].1;
        }
    }
}

/// The mean centre and radius of some spheres, at least one.
pub(crate) fn mean(spheres: impl ExactSizeIterator<Item = Sphere>) -> Sphere {
    let share = 1.0 / spheres.len() as f64;
    let sum = spheres.fold((Vec3::ZERO, 0.0), |sum, s| (sum.0 + s.centre, sum.1 + s.radius));
    Sphere::new(sum.0 * share, sum.1 * share)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Balls along a line, in order, so that the first ones are one end.
    fn line(radius: impl Fn(u32) -> f64) -> Vec<Sphere> {
        (0..1000).map(|k| Sphere::new(Vec3::new(f64::from(k), 0.0, 0.0), radius(k))).collect()
    }

    fn ordered(balls: &[Sphere], value: impl Fn(u32) -> f64) -> Vec<u32> {
        let mut items: Vec<u32> = (0..balls.len() as u32).collect();
        items.sort_by(|&a, &b| value(b).total_cmp(&value(a)));
        break_ties(&mut items, value, |item| balls[item as usize]);
        items
    }

    #[test]
    fn every_beginning_of_the_tied_is_spread() {
        // Radii that differ by rounding alone.
        let balls = line(|k| 1.1 + 1e-16 * f64::from(k % 7));
        // Values that grow along the line by rounding alone.
        let order = ordered(&balls, |k| 180.0 * (1.0 + 1e-15 * f64::from(k / 100)));
        for kept in [5, 30, 200] {
            let mut first = order[..kept].to_vec();
            first.sort_unstable();
            let ends = [first[0], 999 - first[kept - 1]];
            let gaps = first.windows(2).map(|pair| pair[1] - pair[0]);
            let widest = gaps.chain(ends).max().expect("gaps");
            assert!(widest as usize <= 3 * 1000 / kept, "{kept}: {widest}");
        }
    }

    #[test]
    fn values_come_before_sizes_and_sizes_before_places() {
        let balls = line(|k| if k % 10 == 0 { 4.0 } else { 1.0 });
        let order = ordered(&balls, |k| f64::from(u32::from(k >= 500)));
        let large = |items: &[u32]| items.iter().filter(|&&k| k % 10 == 0).count();
        assert!(order[..500].iter().all(|&k| k >= 500));
        assert_eq!((large(&order[..50]), large(&order[50..500])), (50, 0));
        assert_eq!((large(&order[500..550]), large(&order[550..])), (50, 0));
    }

    #[test]
    fn the_numbering_does_not_matter() {
        let balls = line(|k| 1.0 + f64::from(k % 3));
        let mut reversed = balls.clone();
        reversed.reverse();
        let one: Vec<Vec3> =
            ordered(&balls, |_| 0.0).iter().map(|&k| balls[k as usize].centre).collect();
        let other: Vec<Vec3> =
            ordered(&reversed, |_| 0.0).iter().map(|&k| reversed[k as usize].centre).collect();
        assert_eq!(one, other);
    }
}
