//! Symbolic perturbation of the in-sphere and power tests.
//!
//! O. Devillers, M. Teillaud: *Perturbations for Delaunay and weighted Delaunay 3D
//! triangulations*, Computational Geometry 44 (2011), <https://doi.org/10.1016/j.comgeo.2010.09.010>.
//!
//! The lift of the site that is the `k`-th in lexicographic order grows by `eps^(n - k)`: the
//! larger the site, the larger its growth. Where the test is zero, its sign is that of the first
//! non-zero cofactor, from the largest of the five sites downwards, and the cofactor of a vertex is
//! the orientation of the cell with that vertex replaced by the query. The query's own cofactor is
//! the orientation of the cell, never zero, so there always is an answer.
//!
//! Orientation is never perturbed, hence no cell is flat. The result is the one weighted Delaunay
//! triangulation of infinitesimally different weights: unique, whatever the order of insertion.

use super::Sign;
use super::filter::{Metric, PowerFilter, Site, orient3d};

/// Whether `e` is in conflict with the positively oriented cell: inside its perturbed orthosphere.
///
/// The five positions must be distinct.
#[inline(always)]
pub(crate) fn in_conflict<M: Metric>(filter: PowerFilter, cell: [&Site; 4], e: &Site) -> bool {
    match filter.sign::<M>(cell, e) {
        Sign::Positive => true,
        Sign::Negative => false,
        Sign::Zero => perturbed(cell, e),
    }
}

#[cold]
#[inline(never)]
fn perturbed([a, b, c, d]: [&Site; 4], e: &Site) -> bool {
    let sites = [a, b, c, d, e].map(|s| &s.p);
    let mut order = [0, 1, 2, 3, 4];
    order.sort_unstable_by(|&i, &j| lexicographic(sites[j], sites[i]));
    for largest in order {
        let cofactor = match largest {
            0 => orient3d(sites[4], sites[1], sites[2], sites[3]),
            1 => orient3d(sites[0], sites[4], sites[2], sites[3]),
            2 => orient3d(sites[0], sites[1], sites[4], sites[3]),
            3 => orient3d(sites[0], sites[1], sites[2], sites[4]),
            _ => Sign::Negative,
        };
        if cofactor != Sign::Zero {
            return cofactor == Sign::Positive;
        }
    }
    false
}

#[inline]
pub(crate) fn lexicographic(a: &[f64; 3], b: &[f64; 3]) -> std::cmp::Ordering {
    a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])).then(a[2].total_cmp(&b[2]))
}
