//! Every method at levels of its own: what its scalar does, on the paper's axis.
//!
//! As at equal counts, each method has one set of meshes for all its levels
//! ([`OwnSet`](crate::summary::OwnSet)), so that a curve never changes meshes on its way.

use crate::Target;

use crate::comparison::{Comparison, Entry, level_label, reached};
use crate::metric::{HAUSDORFF, MEAN_ERROR, Mean, TOTAL_SECONDS};
use crate::summary::{OwnSet, topology};
use crate::tables::{Cell, Column, Row, Table};
use crate::text::{grouped, significant};

/// One method at levels of its own.
pub(crate) struct NativeCurve {
    pub(crate) series: usize,
    /// Meshes that all means are over.
    pub(crate) over: usize,
    /// Meshes that it was asked for at such levels.
    pub(crate) asked: usize,
    /// From fine to coarse.
    pub(crate) points: Vec<NativePoint>,
}

/// Means at one level.
pub(crate) struct NativePoint {
    pub(crate) level: Target,
    /// Geometric means: spheres, errors in % of the diagonal, seconds.
    pub(crate) spheres: f64,
    pub(crate) hausdorff: f64,
    pub(crate) mean: f64,
    pub(crate) seconds: f64,
    /// Results with the solid's Betti numbers, of those where both are known.
    pub(crate) topology: (usize, usize),
}

/// The curves of all series that ran at levels of their own, the published one included.
pub(crate) fn native_curves(comparison: &Comparison<'_>) -> Vec<NativeCurve> {
    (0..comparison.series.len()).filter_map(|series| curve(comparison, series)).collect()
}

fn curve(comparison: &Comparison<'_>, series: usize) -> Option<NativeCurve> {
    let is_own =
        |level: usize| matches!(comparison.levels[level], Target::Native(_) | Target::Published);
    let own: Vec<&Entry<'_>> =
        comparison.entries.iter().filter(|e| e.series == series && is_own(e.level)).collect();
    let set = OwnSet::of(own.iter().map(|entry| (entry.level, entry.mesh, entry.measured())));
    let mut points = Vec::new();
    for &level in &set.levels {
        let kept: Vec<&Entry<'_>> = own
            .iter()
            .copied()
            .filter(|entry| entry.level == level && set.meshes.contains(&entry.mesh))
            .collect();
        points.extend(point(comparison.levels[level], &kept));
    }
    points.sort_by(|a, b| b.spheres.total_cmp(&a.spheres));
    let (over, asked) = (set.meshes.len(), set.asked);
    (!points.is_empty()).then_some(NativeCurve { series, over, asked, points })
}

fn point(level: Target, entries: &[&Entry<'_>]) -> Option<NativePoint> {
    let mean = |of: &dyn Fn(&Entry<'_>) -> Option<f64>| {
        let values: Option<Vec<f64>> = entries.iter().map(|entry| of(entry)).collect();
        Mean::Geometric { floor: 1e-6 }.of(&values?)
    };
    Some(NativePoint {
        level,
        spheres: mean(&|entry| reached(entry.record).map(|spheres| spheres as f64))?,
        hausdorff: mean(&|entry| HAUSDORFF.of(entry.record))?,
        mean: mean(&|entry| MEAN_ERROR.of(entry.record))?,
        seconds: mean(&|entry| TOTAL_SECONDS.of(entry.record))?,
        topology: topology(entries),
    })
}

/// The table of all methods at levels of their own.
pub(crate) fn native_table(
    comparison: &Comparison<'_>,
    curves: &[NativeCurve],
    axis: &dyn Fn(&str) -> Option<String>,
    how: &str,
) -> Table {
    let rows = curves.iter().flat_map(|curve| {
        let method = comparison.methods[curve.series];
        let axis = axis(method);
        curve.points.iter().enumerate().map(move |(index, point)| {
            let level = match (point.level, &axis) {
                (Target::Native(value), Some(axis)) => format!("{value} {axis}"),
                (level, _) => level_label(level),
            };
            let (right, known) = point.topology;
            Row {
                cells: vec![
                    Cell::new(comparison.series[curve.series].as_str()),
                    Cell::new(level),
                    Cell::new(format!("{} of {}", curve.over, curve.asked)),
                    Cell::new(grouped(point.spheres.round() as u64)),
                    Cell::new(significant(point.hausdorff, 3)),
                    Cell::new(significant(point.mean, 3)),
                    Cell::new(significant(point.seconds, 3)),
                    Cell::optional((known > 0).then(|| format!("{right} of {known}"))),
                ],
                starts_group: index == 0,
            }
        })
    });
    Table {
        caption: "Every method at levels of its own".to_owned(),
        notes: vec![
            how.to_owned(),
            "Geometric means over one set of meshes for each method: those with a result at all \
             its levels. The level is the method's own scalar, with its name and unit. Spheres are \
             what the level leaves; compare errors at equal numbers of them. Lengths in % of the \
             bounding-box diagonal."
                .to_owned(),
        ],
        rows: rows.collect(),
        columns: vec![
            Column::text("method"),
            Column::text("level"),
            Column::text("means over"),
            Column::number("spheres"),
            Column::number(HAUSDORFF.heading()),
            Column::number(MEAN_ERROR.heading()),
            Column::number("total (s)"),
            Column::text("topology right"),
        ],
    }
}
