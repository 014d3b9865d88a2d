//! The metrics: one table of every number that is measured on a result.
//!
//! Name, unit, direction and definition of a metric are declared in [`METRICS`] alone. The columns of the CSV and of the
//! tables, the plots, the definitions on the page, the gates of `diff` and the output of `medial evaluate` follow from
//! it. A new metric needs its computation in `medial::metrics` and one entry here.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Mutex, PoisonError};

use medial::metrics::Evaluation;
pub use medial_run::record::Better;
use medial_run::record::{Record, Status};
use medial_run::text::{grouped, significant};
use serde::Serialize;

/// How a number is averaged over meshes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Mean {
    /// For values that span orders of magnitude; values below the floor count as the floor.
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

/// The upper median.
pub(crate) fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp); // not a number comes last
    sorted.get(sorted.len() / 2).copied()
}

/// Lengths and seconds span orders of magnitude. Below the floor (% of the diagonal, seconds) they count as the floor,
/// so that a single zero does not make a geometric mean zero.
pub(crate) const GEOMETRIC: Mean = Mean::Geometric { floor: 1e-6 };

/// The digits of a number as text.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Digits {
    /// Three significant digits.
    Significant,
    /// One decimal.
    Tenths,
    /// A whole number; its mean with one decimal.
    Count,
}

/// The source of a number, in the unit of the JSON.
#[derive(Clone, Copy)]
pub(crate) enum Value {
    Evaluation(fn(&Evaluation) -> Option<f64>),
    Record(fn(&Record) -> Option<f64>),
    /// A metric of the user, by its title.
    Own,
}

/// One number of a record.
#[derive(Clone, Copy)]
pub struct Metric {
    /// Column of the CSV, and name in the JSON and in file names of reports.
    pub key: &'static str,
    /// Place below `evaluate` in a record, keys joined by `.`.
    pub(crate) path: &'static str,
    /// Name in a column's head.
    pub title: &'static str,
    /// Unit in a column's head.
    pub unit: &'static str,
    /// Better direction.
    pub better: Better,
    pub(crate) mean: Mean,
    pub(crate) digits: Digits,
    /// One or two sentences for the page, of compared metrics. METHODOLOGY.md defines all.
    pub definition: &'static str,
    pub(crate) value: Value,
    /// `unit` over the unit of the JSON: 100 for shares, which are shown as percentages.
    times: f64,
    /// Whether `diff` calls an increase beyond its threshold a regression.
    pub(crate) is_gate: bool,
}

impl Metric {
    /// The number of a record in `unit`, where it was measured.
    pub(crate) fn of(&self, record: &Record) -> Option<f64> {
        let value = match self.value {
            Value::Evaluation(value) => value(record.evaluate.as_ref()?)?,
            Value::Record(value) => value(record)?,
            Value::Own => record.own.get(self.title)?.value,
        };
        Some(self.times * value).filter(|value| value.is_finite())
    }

    /// A value of one record, in `unit`, as text.
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
            _ => self.format(value), // angles and lengths read alike
        }
    }

    /// Name, unit and arrow: `Hausdorff (%) ↓`.
    pub(crate) fn heading(&self) -> String {
        let arrow = match self.better {
            Better::Lower => " ↓",
            Better::Higher => " ↑",
            Better::Neither => "",
        };
        format!("{}{}{arrow}", self.title, self.unit_suffix())
    }

    fn unit_suffix(&self) -> String {
        if self.unit.is_empty() { String::new() } else { format!(" ({})", self.unit) }
    }

    const fn new(
        key: &'static str,
        title: &'static str,
        unit: &'static str,
        (better, digits, mean): (Better, Digits, Mean),
        value: Value,
    ) -> Self {
        // The JSON holds fractions, whose unit is 1.
        let times = if unit.is_empty() || unit.as_bytes()[0] != b'%' { 1.0 } else { 100.0 };
        Self {
            key,
            path: key, // most keys are their own path
            title,
            unit,
            better,
            mean,
            digits,
            definition: "",
            value,
            times,
            is_gate: false,
        }
    }

    /// Defines it on the page.
    const fn defined(mut self, definition: &'static str) -> Self {
        self.definition = definition;
        self
    }

    /// Makes `diff` call an increase a regression.
    const fn gate(mut self) -> Self {
        self.is_gate = true;
        self
    }

    /// Takes the direction away: a size.
    const fn neutral(mut self) -> Self {
        self.better = Better::Neither; // no arrow, never bold
        self
    }

    /// More is better.
    const fn higher(mut self) -> Self {
        self.better = Better::Higher;
        self
    }

    const fn at(mut self, path: &'static str) -> Self {
        self.path = path;
        self
    }
}

/// The metrics of the user among some records, by name.
pub(crate) fn own_metrics<'r>(records: impl Iterator<Item = &'r Record>) -> Vec<&'static Metric> {
    static KNOWN: Mutex<BTreeMap<(String, String, Better), &'static Metric>> =
        Mutex::new(BTreeMap::new());
    let found: BTreeSet<(String, String, Better)> = records
        .flat_map(|record| &record.own)
        .map(|(name, own)| (name.clone(), own.unit.clone(), own.better))
        .collect();
    // Tables hold references for ever, as to the metrics of the program: each is made once.
    let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    let mut made = |own: (String, String, Better)| {
        *known.entry(own.clone()).or_insert_with(|| {
            let (name, unit, better) = own;
            let [key, name, unit] =
                [format!("metric_{name}"), name, unit].map(|text| &*text.leak());
            let kind = (better, Digits::Significant, Mean::Arithmetic);
            let metric = Metric { times: 1.0, ..Metric::new(key, name, unit, kind, Value::Own) };
            &*Box::leak(Box::new(metric))
        })
    };
    found.into_iter().map(&mut made).collect()
}

type Measured = fn(&Evaluation) -> Option<f64>;

/// A length, as a fraction of the bounding-box diagonal in the JSON, in % of it elsewhere.
const fn length(key: &'static str, title: &'static str, value: Measured) -> Metric {
    let kind = (Better::Lower, Digits::Significant, GEOMETRIC);
    Metric::new(key, title, "%", kind, Value::Evaluation(value))
}

/// A share of `unit`, which begins with `%`.
const fn share(
    key: &'static str,
    title: &'static str,
    unit: &'static str,
    value: Measured,
) -> Metric {
    let kind = (Better::Lower, Digits::Tenths, Mean::Arithmetic);
    Metric::new(key, title, unit, kind, Value::Evaluation(value))
}

/// An angle in degrees; larger is better.
const fn angle(key: &'static str, title: &'static str, value: Measured) -> Metric {
    let kind = (Better::Higher, Digits::Tenths, Mean::Arithmetic);
    Metric::new(key, title, "°", kind, Value::Evaluation(value))
}

/// A number of things.
const fn count(key: &'static str, title: &'static str, value: Measured) -> Metric {
    let kind = (Better::Lower, Digits::Count, Mean::Arithmetic);
    Metric::new(key, title, "", kind, Value::Evaluation(value))
}

/// Threshold on the stability ratio whose spikes the tables show; the CSV has all.
pub(crate) const SPIKE_RATIO: f64 = 0.1;

// The metrics of the comparison tables, which plots and "Which method?" use.
pub(crate) const HAUSDORFF: Metric =
    length("hausdorff", "Hausdorff", |e| Some(e.distances.hausdorff))
        .defined(
            "The larger of two sampled maxima: from the surface to the union of the spheres, \
         cones and slabs, and from the boundary of that union back to the surface.",
        )
        .gate();

pub(crate) const EPSILON: Metric = length("epsilon", "ε", |e| Some(e.distances.epsilon))
    .defined(
        "The error of the Q-MAT paper: the largest distance from a surface sample to the \
         nearest surface of a sphere, cone or slab, whether that surface is buried in another \
         one or not.",
    )
    .gate();

pub(crate) const MEAN_ERROR: Metric = length("mean", "mean error", |e| Some(e.distances.mean))
    .defined(
        "Mean over area-uniform surface samples of the absolute signed distance to the union. \
         Less noisy than a maximum, which a single unlucky collapse decides.",
    )
    .gate();

pub(crate) const SPHERES_ONLY: Metric =
    length("spheres_only", "balls only", |e| Some(e.distances.spheres_only))
        .defined(
            "The largest distance from a surface sample to the union of the balls alone, without \
         cones and slabs: it separates good spheres from good connectivity.",
        )
        .gate();

pub(crate) const MIN_ANGLE: Metric =
    angle("min_angle_mean", "min angle", |e| e.quality.min_angle_mean).defined(
        "Mean over the medial triangles of the smallest angle. Triangles of zero area are \
         left out and counted apart.",
    );

pub(crate) const BELOW_30: Metric =
    share("below_30", "below 30°", "% of triangles", |e| e.quality.below_30)
        .defined("Share of the medial triangles whose smallest angle is below 30 degrees.");

pub(crate) const SPIKES: Metric = count("spikes", "spikes", |e| {
    let by_ratio = &e.spikes.by_ratio;
    let at = by_ratio.iter().find(|at| (at.threshold - SPIKE_RATIO).abs() < 1e-9)?;
    Some(at.spikes as f64)
})
.defined(
    "Connected components of the medial edges with a stability ratio below 0.1 that reach \
         the boundary of the medial mesh. Smooth shapes have some even on their exact axis; \
         the CSV holds the other thresholds and measures.",
);

// The structure of a result: a table and a plot of their own.
pub(crate) const SHEETS_MATCHED: Metric =
    share("sheets_matched", "sheets matched", "% of the true area", |e| {
        Some(1.0 - e.structure.as_ref()?.known.as_ref()?.missing_share?)
    })
    .higher();

pub(crate) const CONTACTS_RIGHT: Metric =
    share("contacts_right", "contacts right", "% of samples", |e| {
        e.structure.as_ref()?.contacts.right()
    })
    .higher();

pub(crate) const SEAMS_RIGHT: Metric = share("seams_right", "seams right", "% of samples", |e| {
    e.structure.as_ref()?.contacts.seams_right()
})
.higher();

pub(crate) const FEATURES_REACHED: Metric =
    share("features_reached", "sharp edges reached", "% of length", |e| {
        e.structure.as_ref()?.features.convex_reached
    })
    .higher();

pub(crate) const COMPLETENESS: Metric = length("completeness_p95", "axis missed, p95", |e| {
    e.structure.as_ref()?.completeness.p95
})
.defined(
    "95th percentile of the distances from the medial balls of surface points to the medial mesh: \
     an error without a known axis.",
);

pub(crate) const CENTRALITY: Metric =
    length("centrality_p95", "off centre, p95", |e| e.structure.as_ref()?.centrality.p95);

pub(crate) const OUTSIDE_AREA: Metric =
    share("outside_area", "outside the solid", "% of the sheets' area", |e| {
        let structure = e.structure.as_ref()?;
        let area = structure.graph.sheet_area + structure.graph.small_area;
        (area > 0.0).then(|| structure.outside.area / area)
    });

/// The columns of the table of structure.
pub(crate) const STRUCTURE: [&Metric; 7] = [
    &SHEETS_MATCHED,
    &CONTACTS_RIGHT,
    &SEAMS_RIGHT,
    &FEATURES_REACHED,
    &COMPLETENESS,
    &CENTRALITY,
    &OUTSIDE_AREA,
];

// One-sided errors, of spheres without edges or with a certificate: a table and a plot of their own. Both are the upper
// ends of intervals, so that 0 is a proof.
pub(crate) const UNCOVERED: Metric =
    length("uncovered", "uncovered, at most", |e| Some(e.cover?.uncovered.upper))
        .at("cover.uncovered.upper");

pub(crate) const OVERSHOOT: Metric =
    length("overshoot", "overshoot, at most", |e| Some(e.cover?.overshoot.upper))
        .at("cover.overshoot.upper");

pub(crate) const LARGER_SIDE: Metric = length("uncovered_or_overshoot", "larger of both", |e| {
    Some(e.cover?.uncovered.upper.max(e.cover?.overshoot.upper))
})
.at("")
.defined(
    "The larger of the distance from the farthest point of the solid to the union and the distance from the farthest \
     point of the union to the solid.",
);

pub(crate) const UNCOVERED_MEAN: Metric =
    length("uncovered_mean", "uncovered, mean", |e| Some(e.cover?.uncovered_over_surface.mean))
        .at("cover.uncovered_over_surface.mean");

pub(crate) const OVERSHOOT_MEAN: Metric =
    length("overshoot_mean", "overshoot, mean", |e| Some(e.cover?.overshoot_over_boundary.mean))
        .at("cover.overshoot_over_boundary.mean");

pub(crate) const VOLUME_RATIO: Metric =
    share("volume_ratio", "union's volume", "% of the solid's", |e| e.volume_ratio).neutral();

// The union and the symmetric difference give both parts: `ratio = covered + outside`, `error = (1 - covered) + outside`.
const VOLUME_COVERED: Metric = share("volume_covered", "covered volume", "% of the solid's", |e| {
    Some(0.5 * (1.0 + e.volume_ratio? - e.volume_error?))
})
.higher();

const VOLUME_OUTSIDE: Metric = share("volume_outside", "volume outside", "% of the solid's", |e| {
    Some(0.5 * (e.volume_ratio? + e.volume_error? - 1.0))
});

/// The columns of the table of cover.
pub(crate) const COVER: [&Metric; 6] =
    [&UNCOVERED, &OVERSHOOT, &LARGER_SIDE, &UNCOVERED_MEAN, &OVERSHOOT_MEAN, &VOLUME_RATIO];

pub(crate) const TOTAL_SECONDS: Metric = Metric::new(
    "seconds_total",
    "time",
    "s",
    (Better::Lower, Digits::Significant, GEOMETRIC),
    Value::Record(|record| Some(record.seconds()?.total)),
)
.defined(
    "Wall-clock seconds as if only this level had been requested: the shared substrates that \
         the method uses, its preparation, and the simplification. Evaluation is never \
         included.",
);

/// The seconds of an edition, in a column of their own next to [`TOTAL_SECONDS`]; in no other table or plot.
pub(crate) const FROZEN_SECONDS: Metric = Metric::new(
    "frozen_seconds_total",
    "frozen time",
    "s",
    (Better::Lower, Digits::Significant, GEOMETRIC),
    Value::Record(|record| Some(record.frozen_seconds()?.total)),
)
.neutral();

/// The seconds that external results claim, in a column of their own next to [`TOTAL_SECONDS`]; in no other table or plot.
pub(crate) const CLAIMED_SECONDS: Metric = Metric::new(
    "claimed_seconds",
    "claimed time",
    "s",
    (Better::Lower, Digits::Significant, GEOMETRIC),
    Value::Record(|record| {
        record.simplify.own_seconds?.simplify.filter(|_| record.status == Status::External)
    }),
)
.neutral();

/// In the tables of results that were timed several times, next to [`TOTAL_SECONDS`].
pub(crate) const TIME_SPREAD: Metric = Metric::new(
    "seconds_spread",
    "spread of times",
    "%",
    (Better::Lower, Digits::Tenths, Mean::Arithmetic),
    Value::Record(|record| {
        let median = record.seconds().filter(|_| record.repetitions.len() > 1)?.total;
        let totals = || record.repetitions.iter().map(|repetition| repetition.seconds.total);
        let ends = [totals().reduce(f64::min)?, totals().reduce(f64::max)?];
        (median > 0.0).then(|| (ends[1] - ends[0]) / median)
    }),
)
.defined("The longest minus the shortest time over the repetitions, in % of their median.")
.neutral();

/// The columns of the comparison tables.
pub(crate) const COMPARED: [&Metric; 8] = [
    &HAUSDORFF,
    &EPSILON,
    &MEAN_ERROR,
    &SPHERES_ONLY,
    &MIN_ANGLE,
    &BELOW_30,
    &SPIKES,
    &TOTAL_SECONDS,
];

/// Every metric, in the order of the CSV and of `medial evaluate`.
pub const METRICS: &[Metric] = &[
    HAUSDORFF,
    EPSILON,
    MEAN_ERROR,
    SPHERES_ONLY,
    length("epsilon_union", "surface to union, max", |e| Some(e.distances.epsilon_union)).gate(),
    length("reverse", "union to surface, max", |e| Some(e.distances.reverse)).gate(),
    length("rms", "rms error", |e| Some(e.distances.rms)).gate(),
    length("p95", "95 % of errors", |e| Some(e.distances.p95)).gate(),
    length("p99", "99 % of errors", |e| Some(e.distances.p99)).gate(),
    length("reverse_mean", "union to surface, mean", |e| Some(e.distances.reverse_mean)).gate(),
    length("certified_lower", "Hausdorff, certified from", |e| Some(e.certified?.lower))
        .at("certified.lower")
        .gate(),
    length("certified_upper", "Hausdorff, certified to", |e| Some(e.certified?.upper))
        .at("certified.upper")
        .gate(),
    length("protrusion", "outside the solid, max", |e| e.protrusion).gate(),
    share("centres_outside", "centres outside", "% of spheres", |e| e.centres_outside).gate(),
    share("volume_error", "volume error", "% of the volume", |e| e.volume_error).gate(),
    VOLUME_RATIO,
    VOLUME_COVERED,
    VOLUME_OUTSIDE,
    length("uncovered_lower", "uncovered, at least", |e| Some(e.cover?.uncovered.lower))
        .at("cover.uncovered.lower"),
    UNCOVERED,
    UNCOVERED_MEAN,
    length("uncovered_p95", "uncovered, 95 %", |e| Some(e.cover?.uncovered_over_surface.p95))
        .at("cover.uncovered_over_surface.p95"),
    length("overshoot_lower", "overshoot, at least", |e| Some(e.cover?.overshoot.lower))
        .at("cover.overshoot.lower"),
    OVERSHOOT,
    OVERSHOOT_MEAN,
    length("overshoot_p95", "overshoot, 95 %", |e| Some(e.cover?.overshoot_over_boundary.p95))
        .at("cover.overshoot_over_boundary.p95"),
    MIN_ANGLE,
    angle("max_angle_mean", "max angle", |e| e.quality.max_angle_mean).neutral(),
    BELOW_30,
    share("below_10", "below 10°", "% of triangles", |e| e.quality.below_10),
    share("below_1", "below 1°", "% of triangles", |e| e.quality.below_1),
    count("zero_area", "zero-area triangles", |e| Some(e.quality.zero_area as f64)),
    SPIKES,
    count("dangling_edges", "dangling edges", |e| Some(e.spikes.dangling_edges as f64)),
    count("fins", "fins", |e| Some(e.spikes.fins as f64)),
    count("idle_spheres", "idle spheres", |e| Some(e.spikes.idle_spheres as f64)),
    count("angle_spikes", "small separation angles", |e| {
        e.spikes.angle_spikes.map(|spikes| spikes as f64)
    }),
    count("lone_edges", "edges without a face", |e| Some(e.counts.lone_edges as f64)).neutral(),
    count("isolated", "isolated spheres", |e| Some(e.counts.isolated as f64)).neutral(),
    count("nonmanifold_edges", "non-manifold edges", |e| Some(e.counts.nonmanifold_edges as f64))
        .neutral(),
    count("stored_bytes", "stored bytes", |e| Some(e.counts.bytes() as f64)),
    length("axis_computed_to_true_max", "to the true axis, max", |e| {
        Some(e.axis?.computed_to_true_max)
    }),
    length("axis_computed_to_true_mean", "to the true axis, mean", |e| {
        Some(e.axis?.computed_to_true_mean)
    }),
    length("axis_true_to_computed_max", "from the true axis, max", |e| {
        Some(e.axis?.true_to_computed_max)
    }),
    length("axis_true_to_computed_mean", "from the true axis, mean", |e| {
        Some(e.axis?.true_to_computed_mean)
    }),
    Metric::new(
        "axis_chamfer",
        "chamfer distance",
        "squared diagonals",
        (Better::Lower, Digits::Significant, GEOMETRIC),
        Value::Evaluation(|e| e.axis?.chamfer),
    ),
    SHEETS_MATCHED,
    CONTACTS_RIGHT,
    SEAMS_RIGHT,
    FEATURES_REACHED,
    COMPLETENESS,
    CENTRALITY,
    OUTSIDE_AREA,
    count("samples", "samples of the surface", |e| Some(e.distances.samples as f64)).neutral(),
    count("reverse_samples", "samples of the union", |e| Some(e.distances.reverse_samples as f64))
        .neutral(),
    TOTAL_SECONDS,
];

/// The groups of metrics that `medial evaluate` prints by default, each with its keys.
pub const BRIEF: [(&str, &[&str]); 3] = [
    (
        "error, in % of the diagonal and in the unit of the mesh",
        &[
            "hausdorff",
            "certified_lower",
            "certified_upper",
            "mean",
            "epsilon_union",
            "reverse",
            "uncovered",
            "overshoot",
        ],
    ),
    ("solid", &["volume_error", "centres_outside"]),
    ("triangles and spikes", &["spikes", "min_angle_mean", "below_10"]),
];

/// A metric of some medial meshes.
pub struct MeasuredRow {
    /// Its column in the CSV.
    pub key: &'static str,
    /// Its name and unit.
    pub title: String,
    /// A text for each mesh, `-` where it was not measured.
    pub cells: Vec<String>,
    /// The length for each mesh as a fraction of the diagonal, where the metric is one.
    pub lengths: Vec<Option<f64>>,
}

/// Every metric that was measured on at least one of some medial meshes.
pub fn measured_rows(evaluations: &[&Evaluation]) -> Vec<MeasuredRow> {
    let mut rows = vec![];
    for metric in METRICS {
        let Value::Evaluation(value) = metric.value else { continue };
        let found: Vec<Option<f64>> = evaluations.iter().map(|e| value(e)).collect();
        if found.iter().any(Option::is_some) {
            // `%` alone is of the diagonal: units of shares are longer.
            let is_length = metric.unit == "%";
            let lengths = found.iter().map(|value| value.filter(|_| is_length)).collect();
            let cells = (found.into_iter())
                .map(|value| value.map(|value| metric.format(metric.times * value)))
                .map(|text| text.unwrap_or_else(|| "-".to_owned()))
                .collect();
            let title = format!("{}{}", metric.title, metric.unit_suffix());
            rows.push(MeasuredRow { key: metric.key, title, cells, lengths });
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn geometric_mean_of_reciprocals_is_one() {
        let mean = Mean::Geometric { floor: 1e-6 }.of(&[0.25, 4.0, 10.0, 0.1]);
        assert!((mean.unwrap() - 1.0).abs() < 1e-12);
        assert_eq!(Mean::Arithmetic.of(&[]), None);
        assert!((Mean::Geometric { floor: 1e-6 }.of(&[0.0, 1e-6]).unwrap() - 1e-6).abs() < 1e-15);
    }

    #[test]
    fn keys_are_unique_and_hold_those_of_the_tables() {
        let keys: BTreeSet<&str> = METRICS.iter().map(|metric| metric.key).collect();
        assert_eq!(keys.len(), METRICS.len());
        assert!(COMPARED.iter().all(|metric| keys.contains(metric.key)));
        assert!(BRIEF.iter().flat_map(|(_, of)| *of).all(|key| keys.contains(key)));
    }
}
