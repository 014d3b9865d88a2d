//! The table of verified files, as Markdown that is aligned for the terminal, too.

use medial::metrics::Evaluation;

use super::Row;
use crate::run::percent;

const TITLES: [&str; 11] = [
    "file",
    "surface",
    "spheres",
    "edges",
    "faces",
    "Betti",
    "solid's",
    "Hausdorff",
    "mean",
    "angle",
    "wrong",
];

/// Columns from here on to the last but one hold numbers.
const FIRST_NUMBER: usize = 2;

pub(super) fn markdown(rows: &[Row]) -> String {
    let cells: Vec<[String; 11]> = rows.iter().enumerate().map(|(i, row)| cells(i, row)).collect();
    let widths: Vec<usize> = (0..TITLES.len())
        .map(|k| cells.iter().map(|row| row[k].chars().count()).chain([TITLES[k].len()]).max())
        .map(Option::unwrap_or_default)
        .collect();
    let line = |row: &[String]| {
        let padded = row.iter().zip(&widths).enumerate().map(|(k, (text, &width))| match k {
            FIRST_NUMBER..10 => format!("{text:>width$}"),
            _ => format!("{text:<width$}"),
        });
        format!("| {} |\n", padded.collect::<Vec<_>>().join(" | "))
    };
    let rule = widths.iter().enumerate().map(|(k, &width)| match k {
        FIRST_NUMBER..10 => format!("{}:", "-".repeat(width - 1)),
        _ => "-".repeat(width),
    });
    let mut text = line(&TITLES.map(str::to_owned));
    text += &line(&rule.collect::<Vec<_>>());
    text.extend(cells.iter().map(|row| line(row)));
    text += "\nHausdorff (symmetric) and mean (surface to union) in percent of the surface's diagonal; angle: mean smallest \
             angle of the triangles, in degrees.\n";
    for (i, row) in rows.iter().enumerate() {
        let all: Vec<&String> = row.refused.iter().chain(&row.wrong).chain(&row.notes).collect();
        if all.is_empty() {
            continue;
        }
        text += &format!("\n{}. {}\n", i + 1, row.file.display());
        for remark in all {
            text += &format!("   - {remark}\n");
        }
    }
    text
}

fn cells(i: usize, row: &Row) -> [String; 11] {
    let or_dash = |value: Option<String>| value.unwrap_or_else(|| "-".to_owned());
    let of =
        |read: fn(&Evaluation) -> f64| or_dash(row.evaluation.as_ref().map(|e| percent(read(e))));
    let name = |path: &str| path.rsplit('/').next().unwrap_or(path).replace('|', "\\|");
    let count = |number: Option<u64>| or_dash(number.map(|number| number.to_string()));
    let betti = |betti: Option<[u64; 3]>| or_dash(betti.map(|[a, b, c]| format!("{a} {b} {c}")));
    let live = row.counts.map(|counts| counts.spheres);
    let spheres = match (live, row.spheres_in_file) {
        (Some(live), Some(all)) if live < all as u64 => format!("{live} of {all}"),
        _ => count(live),
    };
    let wrong = match (&row.refused, row.wrong.len()) {
        (Some(_), _) => format!("refused ({})", i + 1),
        (None, 0) => "-".to_owned(),
        (None, 1) => format!("1 remark ({})", i + 1),
        (None, many) => format!("{many} remarks ({})", i + 1),
    };
    [
        name(&row.file.display().to_string()),
        or_dash(row.mesh.as_deref().map(name)),
        spheres,
        count(row.counts.map(|counts| counts.edges)),
        count(row.counts.map(|counts| counts.faces)),
        betti(row.betti),
        betti(row.evaluation.as_ref().and_then(|e| e.expected_betti)),
        of(|e| e.distances.hausdorff),
        of(|e| e.distances.mean),
        or_dash(
            row.quality
                .and_then(|quality| quality.min_angle_mean)
                .map(|angle| format!("{angle:.1}")),
        ),
        wrong,
    ]
}
