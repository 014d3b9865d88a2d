//! What a drawn figure tells the page: where its points lie, what they are, and which of them no
//! other one dominates. The parts of the drawing stand in groups, so that a script can find them
//! and an editor can take them apart.

use serde_json::{Value, json};

use crate::plots::axis::Axis;
use crate::plots::figure::{Curve, Figure};
use crate::text::significant;

/// What is known of a point beside where it lies.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Origin {
    /// Meshes that it is taken over, where that is known.
    pub(crate) n: Option<usize>,
    /// Spheres of the result, or their mean.
    pub(crate) spheres: Option<f64>,
    /// Whether it is taken over the same meshes as the others, and so may dominate them.
    pub(crate) compared: bool,
}

impl Origin {
    /// Of one result on one mesh.
    pub(crate) fn of_result(spheres: usize) -> Self {
        Self { n: Some(1), spheres: Some(spheres as f64), compared: true }
    }

    /// Of a mean over `n` meshes; `whole` where these are all.
    pub(crate) fn of_mean(n: usize, spheres: f64, whole: bool) -> Self {
        Self { n: Some(n), spheres: Some(spheres), compared: whole }
    }
}

/// A drawing and what it tells.
pub(crate) struct Drawing {
    pub(crate) svg: String,
    pub(crate) points: Value,
}

/// Pixels of what was drawn.
#[derive(Default)]
pub(crate) struct Layout {
    /// Left, top, right and bottom of the area of the curves.
    pub(crate) area: [i32; 4],
    /// Of each curve's points.
    pub(crate) curves: Vec<Vec<(i32, i32)>>,
}

/// The non-dominated points, by curve and index, from the left to the right: no other one is at
/// most as large in both coordinates. None where fewer than two series compare.
pub(crate) fn front(curves: &[Curve]) -> Vec<(usize, usize)> {
    let candidate = |curve: usize, point: usize| {
        let of = &curves[curve];
        let (x, y) = of.points[point];
        let compared = of.origins.get(point).is_some_and(|origin| origin.compared);
        (compared && x > 0.0 && x.is_finite() && y.is_finite()).then_some((x, y, curve, point))
    };
    let mut all: Vec<(f64, f64, usize, usize)> = (0..curves.len())
        .flat_map(|curve| (0..curves[curve].points.len()).map(move |point| (curve, point)))
        .filter_map(|(curve, point)| candidate(curve, point))
        .collect();
    let first = all.first().map(|point| curves[point.2].series);
    if all.iter().all(|point| Some(curves[point.2].series) == first) {
        return Vec::new();
    }
    all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut lowest = f64::INFINITY;
    all.retain(|&(_, y, _, _)| {
        let is_lower = y < lowest;
        lowest = lowest.min(y);
        is_lower
    });
    all.into_iter().map(|(_, _, curve, point)| (curve, point)).collect()
}

/// The points of a figure for the script of the page.
pub(crate) fn describe(figure: &Figure, x: &Axis, y: &Axis, layout: &Layout) -> Value {
    let front = if figure.front { front(&figure.curves) } else { Vec::new() };
    let curve = |(index, curve): (usize, &Curve)| {
        let points = curve.points.iter().zip(&layout.curves[index]).enumerate();
        let points: Vec<Value> = points
            .map(|(k, (point, pixel))| {
                let origin = curve.origins.get(k).copied().unwrap_or_default();
                // Said already where an axis tells it.
                let told = [&figure.x.0, &figure.y.0].iter().any(|title| *title == "spheres");
                let spheres = origin.spheres.filter(|_| !told).map(rounded);
                let is_front = usize::from(front.contains(&(index, k)));
                json!([
                    pixel.0,
                    pixel.1,
                    rounded(point.0),
                    rounded(point.1),
                    origin.n,
                    spheres,
                    is_front
                ])
            })
            .collect();
        json!({
            "series": series_key(curve.series), "name": curve.name, "of": curve.of,
            "dashed": curve.dashed, "points": points,
        })
    };
    json!({
        "area": layout.area, "x": x.describe(), "y": y.describe(),
        "curves": figure.curves.iter().enumerate().map(curve).collect::<Vec<_>>(),
    })
}

/// As many digits as are read.
fn rounded(value: f64) -> f64 {
    significant(value, 5).parse().unwrap_or(value)
}

/// The name of a series in the drawing.
pub(crate) fn series_key(series: usize) -> String {
    series.to_string()
}

/// No text of a figure holds this character: control characters are not printable.
const MARK: char = '\u{1}';

/// The text that begins a group. The backend draws shapes and texts alone: groups begin and end at
/// texts that [`with_groups`] replaces.
pub(crate) fn group_begin(class: &str, series: Option<usize>) -> String {
    match series {
        Some(series) => format!("{MARK}{class} {}", series_key(series)),
        None => format!("{MARK}{class}"),
    }
}

/// The text that ends a group.
pub(crate) fn group_end() -> String {
    MARK.to_string()
}

/// The drawing with groups in the place of the texts that mark them.
pub(crate) fn with_groups(svg: &str) -> String {
    let mut out = String::with_capacity(svg.len());
    let mut lines = svg.lines().peekable();
    while let Some(line) = lines.next() {
        let marked = lines.peek().and_then(|text| text.strip_prefix(MARK));
        let Some(group) = marked.filter(|_| line.starts_with("<text")) else {
            out.push_str(line);
            out.push('\n');
            continue;
        };
        match group.split_once(' ') {
            _ if group.is_empty() => out.push_str("</g>\n"),
            Some((class, series)) => {
                out.push_str(&format!("<g class=\"{class}\" data-series=\"{series}\">\n"));
            }
            None => out.push_str(&format!("<g class=\"{group}\">\n")),
        }
        // The text and its closing tag.
        lines.nth(1);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(series: usize, points: &[(f64, f64)], compared: bool) -> Curve {
        let origin = Origin { n: Some(3), spheres: None, compared };
        Curve {
            series,
            label: String::new(),
            name: series.to_string(),
            of: "mean".to_owned(),
            points: points.to_vec(),
            origins: vec![origin; points.len()],
            line: None,
            tags: vec![],
            dashed: false,
        }
    }

    #[test]
    fn the_front_holds_what_nothing_dominates() {
        let curves = [
            curve(0, &[(1.0, 5.0), (2.0, 3.0), (4.0, 3.0)], true),
            curve(1, &[(1.5, 6.0), (3.0, 1.0), (3.0, 0.5)], true),
            curve(2, &[(0.5, 0.1)], false),
        ];
        assert_eq!(front(&curves), [(0, 0), (0, 1), (1, 2)]);
        assert!(front(&curves[..1]).is_empty(), "one series has nothing to dominate");
    }

    #[test]
    fn marks_become_groups() {
        let text = |text: String| format!("<text x=\"0\">\n{text}\n</text>\n");
        let svg = format!(
            "<svg>\n{}<line/>\n{}{}</svg>\n",
            text(group_begin("line", Some(3))),
            text(group_end()),
            text("words".to_owned())
        );
        let expected = "<svg>\n<g class=\"line\" data-series=\"3\">\n<line/>\n</g>\n\
                        <text x=\"0\">\nwords\n</text>\n</svg>\n";
        assert_eq!(with_groups(&svg), expected);
    }
}
