//! Symbolic perturbation of the in-sphere and power tests.
//!
//! O. Devillers, M. Teillaud: *Perturbations for Delaunay and weighted Delaunay 3D
//! triangulations*, Computational Geometry 44 (2011), <https://doi.org/10.1016/j.comgeo.2010.09.010>.
//!
//! The lift of the `k`-th of `n` sites in lexicographic order grows by `eps^(n - k)`: the larger the
//! site, the larger its growth. If the test is zero, its perturbed sign is that of the first non-zero
//! cofactor, from the largest of the five sites downwards. The cofactor of a vertex is the
//! orientation of the cell with that vertex replaced by the query. The query's own cofactor is the
//! orientation of the cell, which is never zero, so there always is an answer.
//!
//! Orientation is never perturbed, hence no cell is flat. The result is the regular triangulation of
//! infinitesimally different weights: unique, whatever the order of insertion.

use std::cmp::Ordering;

use super::Sign;
use super::filter::{Filter, Metric, Site};

/// Whether `e` is in conflict with the positively oriented cell: inside its perturbed orthosphere.
///
/// The five positions must be distinct.
#[inline]
pub(crate) fn in_conflict<M: Metric>(filter: Filter, cell: [&Site; 4], e: &Site) -> bool {
    let (det, bound) = Filter::lifted_determinant::<M>(cell, e);
    in_conflict_given::<M>(filter, det, bound, cell, e)
}

/// [`in_conflict`] with the determinant and the bound that [`Filter::lifted_determinant`] returned.
#[inline(always)]
pub(crate) fn in_conflict_given<M: Metric>(
    filter: Filter,
    det: f64,
    bound: f64,
    cell: [&Site; 4],
    e: &Site,
) -> bool {
    match filter.resolve::<M>(det, bound, cell, e) {
        Sign::Positive => true,
        Sign::Negative => false,
        Sign::Zero => perturbed(filter, cell, e),
    }
}

#[cold]
#[inline(never)]
fn perturbed(filter: Filter, cell: [&Site; 4], e: &Site) -> bool {
    // Only vertices above the query matter, in descending order; the query ends the search.
    let mut above = [0; 4];
    let mut count = 0;
    for (i, s) in cell.iter().enumerate() {
        above[count] = i;
        count += usize::from(precedes(&e.p, &s.p));
    }
    // One step of a selection sort per cofactor, since the first usually decides.
    for rank in 0..count {
        for i in rank + 1..count {
            if precedes(&cell[above[rank]].p, &cell[above[i]].p) {
                above.swap(rank, i);
            }
        }
        let mut replaced = cell;
        replaced[above[rank]] = e;
        let [a, b, c, d] = replaced;
        match filter.orient3d(&a.p, &b.p, &c.p, &d.p) {
            Sign::Positive => return true,
            Sign::Negative => return false,
            Sign::Zero => {}
        }
    }
    // The query is next: its lift grows, which moves it out of the sphere.
    false
}

/// Whether `a` is lexicographically smaller, without branches.
#[inline(always)]
fn precedes(a: &[f64; 3], b: &[f64; 3]) -> bool {
    let z = (a[1] == b[1]) & (a[2] < b[2]);
    let y = (a[0] == b[0]) & ((a[1] < b[1]) | z);
    (a[0] < b[0]) | y
}

/// Lexicographic order of positions, none of which has a coordinate of -0.0.
#[inline]
pub(crate) fn lexicographic(a: &[f64; 3], b: &[f64; 3]) -> Ordering {
    for k in 0..3 {
        if a[k] != b[k] {
            return if a[k] < b[k] { Ordering::Less } else { Ordering::Greater };
        }
    }
    Ordering::Equal
}
