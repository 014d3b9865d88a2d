//! Divided rounds of insertion give what undivided ones give.

use std::sync::LazyLock;

use proptest::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use super::*;
use crate::Vec3;
use crate::predicates::{Unweighted, Weighted};

/// Cells as sorted quadruples of input points.
fn cell_set(t: &Triangulation) -> Vec<[VertexId; 4]> {
    let sorted = |cell| {
        let mut v = t.vertices(cell);
        v.sort_unstable();
        v
    };
    let mut cells: Vec<_> = t.cells().map(sorted).collect();
    cells.sort_unstable();
    cells
}

/// Rounds of so many sites are divided, however many of them have to be deferred.
fn always_from(smallest: u32) -> Division {
    Division { smallest, most_deferred: (1, 1) }
}

/// Divided on one thread, which grows one part behind the other, and on two, side by side.
fn divided<M: Metric>(
    sites: &[Site],
    smallest: u32,
) -> [Result<Triangulated, TriangulationError>; 2] {
    static POOLS: LazyLock<[ThreadPool; 2]> =
        LazyLock::new(|| [1, 2].map(|n| ThreadPoolBuilder::new().num_threads(n).build().unwrap()));
    POOLS
        .each_ref()
        .map(|pool| pool.install(|| triangulate_dividing::<M>(sites, always_from(smallest))))
}

fn agrees<M: Metric>(sites: &[Site]) -> Result<(), TestCaseError> {
    let undivided = triangulate_dividing::<M>(sites, always_from(u32::MAX));
    for smallest in [1, 16, 64] {
        let [one, two] = divided::<M>(sites, smallest);
        prop_assert_eq!(one.is_ok(), two.is_ok());
        if let (Ok(one), Ok(two)) = (&one, &two) {
            let bytes = |t: &Triangulation| -> Vec<_> {
                t.records().iter().map(|cell| (cell.v, cell.n)).collect()
            };
            prop_assert_eq!(bytes(&one.triangulation), bytes(&two.triangulation));
            prop_assert_eq!(&one.triangulation.incident, &two.triangulation.incident);
        }
        match (&undivided, one) {
            (Ok(whole), Ok(divided)) => {
                let t = divided.triangulation;
                prop_assert_eq!(t.check_combinatorics(), Ok(()));
                prop_assert_eq!(t.check_regularity::<M>(sites, divided.filter), Ok(()));
                prop_assert_eq!(cell_set(&t), cell_set(&whole.triangulation));
                prop_assert_eq!(&divided.repeated, &whole.repeated);
            }
            (Err(whole), Err(divided)) => prop_assert_eq!(whole, &divided),
            (whole, divided) => {
                let (whole, divided) = (whole.is_ok(), divided.is_ok());
                prop_assert!(false, "undivided: {}, divided: {}", whole, divided);
            }
        }
    }
    Ok(())
}

/// Random points, and the same on a coarse grid, on a sphere, in two planes, in distant clusters.
fn points() -> impl Strategy<Value = Vec<Vec3>> {
    let point = prop::array::uniform3(-1.0..1.0f64).prop_map(Vec3::from_array);
    (prop::collection::vec(point, 8..900), 0..5).prop_map(|(points, kind)| {
        let place = |(i, p): (usize, &Vec3)| match kind {
            0 => *p,
            1 => (4.0 * *p).round(),
            2 => p.normalize_or(Vec3::X),
            3 => Vec3::new((9.0 * p.x).round(), (9.0 * p.y).round(), f64::from(i as u32 % 2)),
            _ => *p * 1e-3 + Vec3::splat(f64::from(i as u32 % 3)),
        };
        points.iter().enumerate().map(place).collect()
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn divided_rounds_give_the_same_cells(points in points()) {
        let sites: Vec<Site> = points.iter().map(|p| Site { p: p.to_array(), w: 0.0 }).collect();
        agrees::<Unweighted>(&sites)?;
    }

    #[test]
    fn divided_rounds_give_the_same_weighted_cells(
        points in points(),
        weights in prop::collection::vec(0.0..0.3f64, 900),
    ) {
        let sites = points.iter().zip(weights).map(|(p, w)| Site { p: p.to_array(), w });
        agrees::<Weighted>(&sites.collect::<Vec<_>>())?;
    }
}
