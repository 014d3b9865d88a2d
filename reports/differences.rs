//! Tables of the differences between methods at equal numbers of spheres.

use medial_run::text::{counted, significant};

use crate::answers::{errors_at, ranked, samples};
use crate::comparison::Comparison;
use crate::statistics::{FEWEST, LEVEL, Paired, Pairs};
use crate::tables::Table;

/// The methods at each number of spheres, the best median error first, with all pairs.
fn rankings(comparison: &Comparison<'_>) -> Vec<(usize, Pairs)> {
    let of_count = |(level, spheres)| {
        let values = errors_at(comparison, level);
        let series: Vec<usize> = ranked(&values).iter().map(|rank| rank.series).collect();
        let values = samples(&values);
        (series.len() > 1).then(|| (spheres, Pairs::of(series, &values)))
    };
    comparison.counts().filter_map(of_count).collect()
}

/// A table for each number of spheres: every method against the first, and those that it is not established to differ from.
pub(crate) fn difference_tables(comparison: &Comparison<'_>, how: &str) -> Vec<Table> {
    let name = |series: usize| comparison.series[series].as_str();
    let mut tables = vec![];
    for (spheres, pairs) in rankings(comparison) {
        let first = pairs.series[0];
        let cell = |series: usize, text: fn(&Paired) -> Option<String>| {
            pairs.between(series, first).and_then(|pair| text(&pair))
        };
        let rows = Table::of(&pairs.series)
            .text("method", |&series| name(series))
            .text(format!("Hausdorff ÷ {}", name(first)), |&s| {
                cell(s, |pair| Some(pair.ratio?.text(2)))
            })
            .number("n", |&s| cell(s, |pair| Some(pair.meshes().to_string())))
            .text("better, equal, worse", |&s| {
                cell(s, |pair| Some(pair.outcomes.map(|count| count.to_string()).join(", ")))
            })
            .number("effect", |&s| cell(s, |pair| Some(format!("{:.2}", pair.effect))))
            .number("p", |&s| {
                cell(s, |pair| match pair.corrected {
                    ..1e-4 => Some("< 0.0001".to_owned()),
                    p => Some(significant(p, 2)),
                })
            })
            .text("not established to differ from", |&series| match &pairs.alike(series)[..] {
                [] => "–".to_owned(),
                alike if alike.len() > 1 && alike.len() + 1 == pairs.series.len() => {
                    "any other".to_owned()
                }
                alike => alike.iter().map(|&other| name(other)).collect::<Vec<_>>().join(", "),
            });
        let mut notes = vec![how.to_owned(), NOTE.to_owned()];
        let most = pairs.pairs.iter().map(Paired::meshes).max().unwrap_or(0);
        let least = pairs.pairs.len() as f64 * 2.0 * 0.5f64.powi(most as i32);
        if most < FEWEST || least >= LEVEL {
            let meshes = counted(most, "mesh", "meshes");
            let pairs = counted(pairs.pairs.len(), "pair", "pairs");
            notes.push(format!(
                "With {meshes} and {pairs} of methods, no difference can be established."
            ));
        }
        let caption = format!("Differences at {}", counted(spheres, "sphere", "spheres"));
        tables.push(Table { caption, notes, ..rows.table });
    }
    tables
}

const NOTE: &str = "By median Hausdorff error. Ratios are geometric means over the meshes where both have a result, with \
    95 % intervals from 2,000 resampled sets of meshes, if they are at least six. n: meshes where either has a result; a \
    missing one, or an error above 5 %, counts as infinite. Effect: from -1, worse on all meshes, to 1. p: two-sided \
    Wilcoxon signed-rank test, corrected for all pairs of methods by Holm; established: below 0.05 on at least six meshes.";

/// Every pair of methods at every number of spheres with all digits, as CSV.
pub(crate) fn differences_csv(comparison: &Comparison<'_>) -> Result<Vec<u8>, csv::Error> {
    let mut writer = csv::Writer::from_writer(vec![]);
    let heads =
        "spheres method other better equal worse ratio ratio_low ratio_high effect p p_corrected";
    writer.write_record(heads.split(' '))?;
    for (spheres, pairs) in rankings(comparison) {
        let names = pairs.series.iter().enumerate();
        let names = names.flat_map(|(k, &a)| pairs.series[k + 1..].iter().map(move |&b| [a, b]));
        for (pair, names) in pairs.pairs.iter().zip(names) {
            let known =
                |value: Option<f64>| value.map(|value| value.to_string()).unwrap_or_default();
            let mut row = vec![spheres.to_string()];
            row.extend(names.map(|series| comparison.series[series].clone()));
            row.extend(pair.outcomes.map(|count| count.to_string()));
            row.push(known(pair.ratio.map(|ratio| ratio.value)));
            let interval = pair.ratio.and_then(|ratio| ratio.interval);
            row.extend([0, 1].map(|end| known(interval.map(|ends| ends[end]))));
            row.extend([pair.effect, pair.p, pair.corrected].map(|value| value.to_string()));
            writer.write_record(row)?;
        }
    }
    writer.into_inner().map_err(|error| error.into_error().into())
}
