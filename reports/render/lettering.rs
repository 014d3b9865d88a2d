//! Text on a picture, in letters of strokes ([`glyphs`](super::glyphs)).

use super::glyphs::{GLYPHS, Glyph, MISSING};
use super::picture::Picture;

/// Width of the pen, in tenths of a capital's height.
const PEN: f64 = 1.15;

/// The thinnest pen, in pixels: thinner ones turn grey.
const THINNEST: f64 = 1.15;

/// Space between letters, in tenths of a capital's height.
const SPACE: f64 = 2.3;

/// Degrees of an arc to a line.
const ARC_STEP: f64 = 12.0;

/// How text lies beside its point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Align {
    Left,
    Middle,
}

/// How text looks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lettering {
    /// Height of a capital, in pixels.
    pub(super) size: f64,
    pub(super) ink: [u8; 3],
    pub(super) align: Align,
}

fn glyph(character: char) -> Glyph {
    GLYPHS.iter().copied().find(|glyph| glyph.0 == character).unwrap_or(MISSING)
}

/// The width of text, in pixels.
pub(super) fn text_width(text: &str, size: f64) -> f64 {
    let widths = text.chars().map(|character| glyph(character).1 + SPACE);
    (widths.sum::<f64>() - SPACE).max(0.0) * size / 10.0
}

/// Text cut so that it is not wider than this, with dots where something is missing.
pub(super) fn fitted(text: &str, size: f64, most: f64) -> String {
    if text_width(text, size) <= most {
        return text.to_owned();
    }
    let characters: Vec<char> = text.chars().collect();
    let cut = |kept: usize| characters[..kept].iter().collect::<String>() + "...";
    let kept = (0..characters.len()).rev().find(|&kept| text_width(&cut(kept), size) <= most);
    kept.map(cut).unwrap_or_default()
}

impl Lettering {
    /// Writes text, its point on the baseline.
    pub(super) fn write(&self, picture: &mut Picture, [x, y]: [f64; 2], text: &str) {
        let shift = match self.align {
            Align::Left => 0.0,
            Align::Middle => 0.5 * text_width(text, self.size),
        };
        let unit = self.size / 10.0;
        let mut pen = x - shift;
        for character in text.chars() {
            let (_, width, strokes) = glyph(character);
            let lines: Vec<[[f64; 2]; 2]> = lines(strokes)
                .into_iter()
                .map(|line| line.map(|[u, v]| [pen + unit * u, y - unit * v]))
                .collect();
            self.draw(picture, &lines);
            pen += unit * (width + SPACE);
        }
    }

    /// Draws the lines of a glyph as one: where two meet, ink is not laid on twice.
    fn draw(&self, picture: &mut Picture, lines: &[[[f64; 2]; 2]]) {
        let half = 0.5 * (PEN * self.size / 10.0).max(THINNEST);
        let points = || lines.iter().flatten();
        let range = |k: usize| {
            let lo = points().map(|p| p[k]).fold(f64::INFINITY, f64::min) - half - 1.0;
            let hi = points().map(|p| p[k]).fold(f64::NEG_INFINITY, f64::max) + half + 1.0;
            lo.floor() as i64..hi.ceil() as i64
        };
        if lines.is_empty() {
            return;
        }
        for y in range(1) {
            for x in range(0) {
                let middle = [x as f64 + 0.5, y as f64 + 0.5];
                let distance =
                    lines.iter().map(|line| distance(middle, line)).fold(f64::INFINITY, f64::min);
                picture.blend(x, y, self.ink, (half + 0.5 - distance).clamp(0.0, 1.0));
            }
        }
    }
}

/// Distance of a point from a line between two points.
fn distance(p: [f64; 2], [a, b]: &[[f64; 2]; 2]) -> f64 {
    let (u, v) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
    let square = u[0] * u[0] + u[1] * u[1];
    let along =
        if square > 0.0 { ((u[0] * v[0] + u[1] * v[1]) / square).clamp(0.0, 1.0) } else { 0.0 };
    (v[0] - along * u[0]).hypot(v[1] - along * u[1])
}

/// The straight lines of a glyph's strokes, in its units.
fn lines(strokes: &str) -> Vec<[[f64; 2]; 2]> {
    let mut all = Vec::new();
    for stroke in strokes.split(';') {
        let mut words = stroke.split_whitespace();
        let kind = words.next();
        let numbers: Vec<f64> = words.filter_map(|word| word.parse().ok()).collect();
        let points = match (kind, numbers.as_slice()) {
            (Some("A"), &[x, y, a, b, from, to]) => arc([x, y], [a, b], from, to),
            _ => numbers.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect(),
        };
        all.extend(points.windows(2).map(|pair| [pair[0], pair[1]]));
    }
    all
}

fn arc(middle: [f64; 2], half: [f64; 2], from: f64, to: f64) -> Vec<[f64; 2]> {
    let steps = ((to - from).abs() / ARC_STEP).ceil().max(1.0);
    let at = |k: f64| {
        let (sin, cos) = (from + (to - from) * k / steps).to_radians().sin_cos();
        [middle[0] + half[0] * cos, middle[1] + half[1] * sin]
    };
    (0..=steps as u32).map(|k| at(f64::from(k))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_glyph_is_understood() {
        for &(character, width, strokes) in GLYPHS {
            for stroke in strokes.split(';').filter(|stroke| !stroke.is_empty()) {
                let words: Vec<&str> = stroke.split_whitespace().collect();
                assert!(words[1..].iter().all(|word| word.parse::<f64>().is_ok()), "{stroke}");
                match words[0] {
                    "A" => assert_eq!(words.len(), 7, "{character}: {stroke}"),
                    kind => assert!(kind == "L" && words.len() % 2 == 1, "{character}: {stroke}"),
                }
            }
            for [x, y] in lines(strokes).into_iter().flatten() {
                assert!((-0.2..=width + 0.2).contains(&x), "{character}: {x} of {width}");
                assert!((-3.1..=11.1).contains(&y), "{character}: {y}");
            }
        }
        let ascii = (' '..='~').all(|c| GLYPHS.iter().any(|glyph| glyph.0 == c));
        assert!(ascii, "every printable character has a glyph");
    }

    #[test]
    fn long_text_is_cut() {
        assert_eq!(fitted("bear", 10.0, 100.0), "bear");
        let cut = fitted("a-long-name-of-a-file", 10.0, 100.0);
        assert!(cut.ends_with("...") && text_width(&cut, 10.0) <= 100.0, "{cut}");
        assert_eq!(fitted("wide", 10.0, 1.0), "");
    }
}
