//! The columns of the tables: what each number is, its unit, and which way is better.
//!
//! One list drives the tables, the plots and the definitions on the page, so that a number is
//! called by the same name everywhere.

use crate::record::Record;
use crate::text::{grouped, significant};

/// Which way a number is better.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Better {
    Lower,
    Higher,
}

impl Better {
    /// Whether `a` is better than `b`.
    pub(crate) fn prefers(self, a: f64, b: f64) -> bool {
        match self {
            Self::Lower => a < b,
            Self::Higher => a > b,
        }
    }

    /// The arrow in the column's head.
    pub(crate) fn arrow(self) -> &'static str {
        match self {
            Self::Lower => "↓",
            Self::Higher => "↑",
        }
    }
}

/// How a number is averaged over meshes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Mean {
    /// For what spans orders of magnitude; values below the floor count as the floor.
    Geometric { floor: f64 },
    /// For angles, shares and counts, which may be zero.
    Arithmetic,
}

impl Mean {
    /// The mean of some values; `None` of none.
    pub(crate) fn of(self, values: &[f64]) -> Option<f64> {
        if values.is_empty() {
            return None;
        }
        let count = values.len() as f64;
        Some(match self {
            Self::Geometric { floor } => {
                (values.iter().map(|value| value.max(floor).ln()).sum::<f64>() / count).exp()
            }
            Self::Arithmetic => values.iter().sum::<f64>() / count,
        })
    }

    /// The word in front of `mean`.
    pub(crate) fn word(self) -> &'static str {
        match self {
            Self::Geometric { .. } => "geometric",
            Self::Arithmetic => "arithmetic",
        }
    }
}

/// How a number is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Digits {
    /// Three significant digits.
    Significant,
    /// One decimal.
    Tenths,
    /// A whole number; its mean with one decimal.
    Count,
}

/// One number of a record.
pub(crate) struct Metric {
    /// Name in the JSON and in file names.
    pub(crate) key: &'static str,
    /// Name in a column's head.
    pub(crate) title: &'static str,
    /// Unit in a column's head.
    pub(crate) unit: &'static str,
    pub(crate) better: Better,
    pub(crate) mean: Mean,
    pub(crate) digits: Digits,
    /// One or two sentences for the page.
    pub(crate) definition: &'static str,
    /// The number in `unit`.
    pub(crate) value: fn(&Record) -> Option<f64>,
}

impl Metric {
    /// The number of a record, where it was measured.
    pub(crate) fn of(&self, record: &Record) -> Option<f64> {
        (self.value)(record).filter(|value| value.is_finite())
    }

    /// A value of one record as text.
    pub(crate) fn format(&self, value: f64) -> String {
        match self.digits {
            Digits::Significant => significant(value, 3),
            Digits::Tenths => format!("{value:.1}"),
            Digits::Count => grouped(value.round().max(0.0) as u64),
        }
    }

    /// A mean over meshes as text.
    pub(crate) fn format_mean(&self, value: f64) -> String {
        match self.digits {
            Digits::Count => format!("{value:.1}"),
            _ => self.format(value),
        }
    }

    /// Name, unit and arrow: `Hausdorff (%) ↓`.
    pub(crate) fn heading(&self) -> String {
        if self.unit.is_empty() {
            format!("{} {}", self.title, self.better.arrow())
        } else {
            format!("{} ({}) {}", self.title, self.unit, self.better.arrow())
        }
    }

    /// Name and unit for a plot's axis.
    pub(crate) fn axis_title(&self) -> String {
        let unit = if self.unit == "%" { "% of the diagonal" } else { self.unit };
        if unit.is_empty() { self.title.to_owned() } else { format!("{} ({unit})", self.title) }
    }
}

/// Threshold on the stability ratio whose spikes stand in the tables; the others are in the CSV.
pub(crate) const SPIKE_RATIO: f64 = 0.1;

/// Errors below this, in % of the diagonal, count as this in a geometric mean.
const ERROR_FLOOR: Mean = Mean::Geometric { floor: 1e-6 };
/// The same for seconds.
const TIME_FLOOR: Mean = Mean::Geometric { floor: 1e-6 };

fn percent(record: &Record, length: fn(&medial::metrics::Distances) -> f64) -> Option<f64> {
    record.evaluate.as_ref().map(|evaluation| 100.0 * length(&evaluation.distances))
}

macro_rules! metric {
    ($name:ident, $key:literal, $title:literal, $unit:literal, $better:ident, $mean:expr,
     $digits:ident, $value:expr, $definition:literal) => {
        pub(crate) static $name: Metric = Metric {
            key: $key,
            title: $title,
            unit: $unit,
            better: Better::$better,
            mean: $mean,
            digits: Digits::$digits,
            definition: $definition,
            value: $value,
        };
    };
}

metric!(
    HAUSDORFF,
    "hausdorff",
    "Hausdorff",
    "%",
    Lower,
    ERROR_FLOOR,
    Significant,
    |record| percent(record, |d| d.hausdorff),
    "The larger of two sampled maxima: from the surface to the union of the spheres, cones and \
     slabs, and from the boundary of that union back to the surface."
);
metric!(
    EPSILON,
    "epsilon",
    "ε",
    "%",
    Lower,
    ERROR_FLOOR,
    Significant,
    |record| percent(record, |d| d.epsilon),
    "The error of the Q-MAT paper: the largest distance from a surface sample to the nearest \
     surface of a sphere, cone or slab, whether that surface is buried in another one or not."
);
metric!(
    MEAN_ERROR,
    "mean",
    "mean error",
    "%",
    Lower,
    ERROR_FLOOR,
    Significant,
    |record| percent(record, |d| d.mean),
    "Mean over area-uniform surface samples of the absolute signed distance to the union. Less \
     noisy than a maximum, which a single unlucky collapse decides."
);
metric!(
    SPHERES_ONLY,
    "spheres_only",
    "balls only",
    "%",
    Lower,
    ERROR_FLOOR,
    Significant,
    |record| percent(record, |d| d.spheres_only),
    "The largest distance from a surface sample to the union of the balls alone, without cones \
     and slabs: it separates good spheres from good connectivity."
);
metric!(
    MIN_ANGLE,
    "min_angle_mean",
    "min angle",
    "°",
    Higher,
    Mean::Arithmetic,
    Tenths,
    |record| record.evaluate.as_ref()?.quality.min_angle_mean,
    "Mean over the medial triangles of the smallest angle. Triangles of zero area are left out \
     and counted apart."
);
metric!(
    BELOW_30,
    "below_30",
    "below 30°",
    "% of triangles",
    Lower,
    Mean::Arithmetic,
    Tenths,
    |record| record.evaluate.as_ref()?.quality.below_30.map(|share| 100.0 * share),
    "Share of the medial triangles whose smallest angle is below 30 degrees."
);
metric!(
    SPIKES,
    "spikes",
    "spikes",
    "",
    Lower,
    Mean::Arithmetic,
    Count,
    |record| {
        let by_ratio = &record.evaluate.as_ref()?.spikes.by_ratio;
        by_ratio
            .iter()
            .find(|spikes| (spikes.threshold - SPIKE_RATIO).abs() < 1e-9)
            .map(|spikes| spikes.spikes as f64)
    },
    "Connected components of the medial edges with a stability ratio below 0.1 that reach the \
     boundary of the medial mesh. Smooth shapes have some even on their exact axis; the CSV holds \
     the other thresholds and measures."
);
metric!(
    TOTAL_SECONDS,
    "seconds_total",
    "time",
    "s",
    Lower,
    TIME_FLOOR,
    Significant,
    |record| record.simplify.seconds.map(|seconds| seconds.total),
    "Wall-clock seconds as if this level had been asked alone: the shared substrates that the \
     method uses, its preparation, and the simplification. Evaluation is never included."
);

/// The columns of the comparison tables, in their order.
pub(crate) static COMPARED: [&Metric; 8] = [
    &HAUSDORFF,
    &EPSILON,
    &MEAN_ERROR,
    &SPHERES_ONLY,
    &MIN_ANGLE,
    &BELOW_30,
    &SPIKES,
    &TOTAL_SECONDS,
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn geometric_mean_of_reciprocals_is_one() {
        let mean = Mean::Geometric { floor: 1e-6 }.of(&[0.25, 4.0, 10.0, 0.1]);
        assert!((mean.unwrap() - 1.0).abs() < 1e-12);
        assert_eq!(Mean::Arithmetic.of(&[]), None);
        assert!((Mean::Geometric { floor: 1e-6 }.of(&[0.0, 1e-6]).unwrap() - 1e-6).abs() < 1e-15);
    }
}
