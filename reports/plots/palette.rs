//! Colours and markers that tell methods apart, also without colour.
//!
//! The first eight colours are those of Okabe and Ito (2008, "Color universal design") without
//! black and yellow, which vanish on a dark or a light page, and with three of Paul Tol's muted
//! scheme. A method keeps its colour and its marker in every figure of a report.

use plotters::style::RGBColor;

/// Ink, grid and background of every figure; the page's style sheet maps them to its own.
pub(crate) const INK: RGBColor = RGBColor(0x20, 0x21, 0x24);
pub(crate) const GRID: RGBColor = RGBColor(0xE3, 0xE5, 0xE8);
pub(crate) const PAPER: RGBColor = RGBColor(0xFF, 0xFF, 0xFF);

/// Colours of substrate, prepare and simplify, of increasing darkness.
pub(crate) const STAGES: [RGBColor; 3] =
    [RGBColor(0xC2, 0xC6, 0xCC), RGBColor(0x6B, 0xAE, 0xD6), RGBColor(0x1F, 0x5F, 0xA0)];

const COLOURS: [RGBColor; 12] = [
    RGBColor(0x00, 0x72, 0xB2),
    RGBColor(0xD5, 0x5E, 0x00),
    RGBColor(0x00, 0x9E, 0x73),
    RGBColor(0xCC, 0x79, 0xA7),
    RGBColor(0xE6, 0x9F, 0x00),
    RGBColor(0x56, 0xB4, 0xE9),
    RGBColor(0x88, 0x22, 0x55),
    RGBColor(0x99, 0x99, 0x33),
    RGBColor(0x77, 0x77, 0x77),
    RGBColor(0x6A, 0x51, 0xA3),
    RGBColor(0x44, 0xAA, 0x99),
    RGBColor(0xA6, 0x56, 0x28),
];

/// The shape of a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Marker {
    Disc,
    Square,
    Triangle,
    Diamond,
    Down,
    Cross,
    Ring,
    Box,
    Plus,
    Delta,
    Lozenge,
}

const MARKERS: [Marker; 11] = [
    Marker::Disc,
    Marker::Square,
    Marker::Triangle,
    Marker::Diamond,
    Marker::Down,
    Marker::Cross,
    Marker::Ring,
    Marker::Box,
    Marker::Plus,
    Marker::Delta,
    Marker::Lozenge,
];

/// Colour and marker of a series. Twelve colours and eleven markers repeat together only after
/// 132 series.
pub(crate) fn style(series: usize) -> (RGBColor, Marker) {
    (COLOURS[series % COLOURS.len()], MARKERS[series % MARKERS.len()])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn styles_differ() {
        let styles: Vec<_> = (0..132).map(style).collect();
        for (index, (colour, marker)) in styles.iter().enumerate() {
            let same = |(c, m): &(RGBColor, Marker)| {
                (c.0, c.1, c.2, *m) == (colour.0, colour.1, colour.2, *marker)
            };
            assert!(!styles[..index].iter().any(same), "series {index}");
        }
    }
}
