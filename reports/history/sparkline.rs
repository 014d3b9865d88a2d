//! A series over the nights as a small line: inline SVG without a script.

use super::steps::median;
use crate::text::escape_html;

/// Width and height in pixels. One unit of the drawing is a pixel, so that whole numbers are fine enough.
const SIZE: (usize, usize) = (190, 36);

/// The range drawn is at least this, as a logarithm: noise of a thousandth is no mountain range.
const LEAST_RANGE: f64 = 0.1;

/// Kept free above and below.
const MARGIN: f64 = 3.0;

/// A place at which the line is marked.
pub(super) struct Mark {
    /// Index of the value.
    pub(super) at: usize,
    /// Whether the value went up there.
    pub(super) up: bool,
    /// Whether most series did the same.
    pub(super) shared: bool,
}

/// Positive values from left to right on a logarithmic scale, cut off where single values stand far out.
pub(super) fn sparkline(values: &[f64], marks: &[Mark], title: &str) -> String {
    let (width, height) = SIZE;
    let mut svg = format!(
        "<svg class=\"spark\" role=\"img\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {width} {height}\"><title>{}</title>",
        escape_html(title)
    );
    let x = |index: usize| match values.len() {
        0 | 1 => width / 2,
        n => 1 + index * (width - 2) / (n - 1),
    };
    for Mark { at, up, shared } in marks {
        let class = match (shared, up) {
            (true, _) => "shared",
            (false, true) => "up",
            (false, false) => "down",
        };
        svg.push_str(&format!("<path class=\"{class}\" d=\"M{} 0v{height}\"/>", x(*at)));
    }
    svg.push_str(&format!("<path class=\"line\" d=\"{}\"/></svg>", path(values, &x)));
    svg
}

/// The line as a path: the median of the nights of each pixel, in whole pixels, flat parts as one stroke.
fn path(values: &[f64], x: &dyn Fn(usize) -> usize) -> String {
    let logarithms: Vec<f64> = values.iter().map(|value| value.max(1e-12).ln()).collect();
    let (low, high) = range(&logarithms);
    let free = SIZE.1 as f64 - 2.0 * MARGIN;
    let y = |value: f64| {
        (MARGIN + free * (1.0 - ((value - low) / (high - low)).clamp(0.0, 1.0))).round() as i64
    };
    let mut points: Vec<(i64, i64)> = Vec::new();
    let indices: Vec<usize> = (0..values.len()).collect();
    for same in indices.chunk_by(|a, b| x(*a) == x(*b)) {
        let there: Vec<f64> = same.iter().map(|&index| logarithms[index]).collect();
        points.push((x(same[0]) as i64, y(median(&there))));
    }
    // Of a flat part the ends are enough.
    let flat = |k: usize| {
        k > 0
            && k + 1 < points.len()
            && points[k - 1].1 == points[k].1
            && points[k].1 == points[k + 1].1
    };
    let kept: Vec<(i64, i64)> =
        (0..points.len()).filter(|&k| !flat(k)).map(|k| points[k]).collect();
    let Some(&(first_x, first_y)) = kept.first() else { return String::new() };
    let mut path = format!("M{first_x} {first_y}");
    if kept.len() == 1 {
        path.push_str("h1");
    }
    for pair in kept.windows(2) {
        let (right, down) = (pair[1].0 - pair[0].0, pair[1].1 - pair[0].1);
        match down {
            0 => path.push_str(&format!("h{right}")),
            down if down < 0 => path.push_str(&format!("l{right}{down}")),
            down => path.push_str(&format!("l{right} {down}")),
        }
    }
    path
}

/// What is drawn of the values: all but the highest and the lowest fiftieth, and a tenth of that beside it.
fn range(logarithms: &[f64]) -> (f64, f64) {
    let mut sorted = logarithms.to_vec();
    sorted.sort_by(f64::total_cmp);
    let out = sorted.len() / 50;
    let (Some(&low), Some(&high)) = (sorted.get(out), sorted.iter().rev().nth(out)) else {
        return (0.0, 1.0);
    };
    let (middle, half) = ((low + high) / 2.0, (0.55 * (high - low)).max(LEAST_RANGE / 2.0));
    (middle - half, middle + half)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flat_lines_are_short_and_long_ones_fit() {
        let flat = sparkline(&[2.0; 400], &[], "seconds");
        assert!(flat.contains("d=\"M1 18h188\""), "{flat}");
        let wild: Vec<f64> = (0..2000).map(|k| 1.0 + 0.3 * f64::from(k % 7)).collect();
        assert!(sparkline(&wild, &[], "").len() < 2500);
        assert!(sparkline(&[], &[], "").contains("d=\"\""));
        assert!(sparkline(&[0.0], &[], "").contains("h1"));
    }

    #[test]
    fn a_rise_goes_up() {
        let svg = sparkline(
            &[1.0, 1.0, 4.0, 4.0],
            &[Mark { at: 2, up: true, shared: false }],
            "<seconds>",
        );
        // Up is less in SVG.
        assert!(svg.contains("class=\"up\"") && svg.contains("l63-28"), "{svg}");
        assert!(svg.contains("&lt;seconds&gt;"), "{svg}");
    }
}
