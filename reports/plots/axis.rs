//! Axes: the scale, the range that the data needs, and ticks at round numbers.

use std::ops::Range;

use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};

use crate::text::{grouped, round_up, significant};

/// Width of a letter beneath an axis, with its share of the gap to the next label; of the axis' length.
const WIDTH_OF_LETTER: f64 = 0.018;

/// How values are laid out along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scale {
    /// From zero.
    Linear,
    /// Logarithmic; values that are not positive are drawn on the lower border.
    Log,
}

impl Scale {
    /// The name of the scale in the page's plots.
    pub(crate) fn key(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Log => "log",
        }
    }
}

/// An axis fitted to its data.
#[derive(Clone)]
pub(crate) struct Axis {
    scale: Scale,
    /// Both ends, as laid out.
    ends: (f64, f64),
    /// Values at the ticks, ascending.
    pub(crate) ticks: Vec<f64>,
}

impl Axis {
    /// An axis that holds all values with a margin; `None` where there is no finite value.
    pub(crate) fn fit(scale: Scale, values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let (mut low, mut high) = values
            .into_iter()
            .filter(|value| value.is_finite() && (scale != Scale::Log || *value > 0.0))
            .map(|value| (value, value))
            .reduce(|(low, high), (a, b)| (low.min(a), high.max(b)))?;
        match scale {
            Scale::Log => {
                // At least a factor of two, or a single value would have no scale at all.
                let widen = (2.0 * low / high).max(1.0).sqrt();
                (low, high) = (low / widen / 1.12, high * widen * 1.12);
            }
            Scale::Linear => (low, high) = (low.min(0.0), (high * 1.05).max(1e-12)),
        }
        let ends = (lay_out(scale, low), lay_out(scale, high));
        Some(Self { scale, ends, ticks: round_numbers(scale, low, high) })
    }

    /// Where a value lies between the ends of the axis, from 0 to 1.
    pub(crate) fn place(&self, value: f64) -> f64 {
        let (low, high) = self.ends;
        let placed = (lay_out(self.scale, value) - low) / (high - low);
        // What has no logarithm goes to the lower end.
        if placed.is_finite() { placed.clamp(0.0, 1.0) } else { 0.0 }
    }

    /// The text at a tick.
    pub(crate) fn label(value: f64) -> String {
        let rounded: f64 = significant(value, 3).parse().unwrap_or(value);
        if rounded == 0.0 {
            "0".to_owned()
        } else if (1000.0..1e15).contains(&rounded) {
            grouped(rounded as u64)
        } else {
            format!("{rounded}")
        }
    }
}

impl Ranged for Axis {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        limit.0 + (self.place(*value) * f64::from(limit.1 - limit.0)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        self.ticks.clone()
    }

    fn range(&self) -> Range<f64> {
        match self.scale {
            Scale::Linear => self.ends.0..self.ends.1,
            Scale::Log => 10f64.powf(self.ends.0)..10f64.powf(self.ends.1),
        }
    }
}

impl ValueFormatter<f64> for Axis {
    fn format(value: &f64) -> String {
        Self::label(*value)
    }
}

fn lay_out(scale: Scale, value: f64) -> f64 {
    match scale {
        Scale::Linear => value,
        Scale::Log => value.log10(),
    }
}

/// Round numbers within a range: multiples on a linear axis, the densest of three decade patterns
/// that stays readable on a logarithmic one.
fn round_numbers(scale: Scale, low: f64, high: f64) -> Vec<f64> {
    if scale == Scale::Linear {
        let step = round_up((high - low) / 5.0);
        let first = (low / step).ceil() as i64;
        return (first..).map(|k| k as f64 * step).take_while(|&value| value <= high).collect();
    }
    let patterns: [&[f64]; 4] =
        [&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0], &[1.0, 2.0, 5.0], &[1.0, 3.0], &[1.0]];
    let mut sparsest: Vec<f64> = Vec::new();
    for pattern in patterns {
        sparsest = (low.log10().floor() as i32..=high.log10().ceil() as i32)
            .flat_map(|decade| pattern.iter().map(move |digit| digit * 10f64.powi(decade)))
            .filter(|&value| value >= low && value <= high)
            .collect();
        let collide = sparsest.windows(2).any(|pair| {
            let gap = (pair[1] / pair[0]).log10() / (high / low).log10();
            gap < WIDTH_OF_LETTER * Axis::label(pair[1]).len() as f64
        });
        if sparsest.len() <= 8 && !collide {
            return sparsest;
        }
    }
    // More than eight decades: every second or third of them.
    let stride = sparsest.len().div_ceil(8);
    sparsest.into_iter().step_by(stride).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(scale: Scale, values: &[f64]) -> Vec<String> {
        let axis = Axis::fit(scale, values.iter().copied()).unwrap();
        axis.ticks.iter().map(|&tick| Axis::label(tick)).collect()
    }

    #[test]
    fn ticks_are_round_and_few() {
        assert_eq!(labels(Scale::Log, &[50.0, 1000.0]), ["50", "100", "200", "500", "1,000"]);
        assert_eq!(
            labels(Scale::Log, &[0.4, 1.9]),
            ["0.4", "0.5", "0.6", "0.7", "0.8", "0.9", "1", "2"]
        );
        // 50,000 and 60,000 would touch.
        assert_eq!(labels(Scale::Log, &[9000.0, 60000.0]), ["10,000", "20,000", "50,000"]);
        assert_eq!(labels(Scale::Linear, &[3.0, 48.0]), ["0", "20", "40"]);
    }

    #[test]
    fn every_range_has_ticks_and_holds_its_values() {
        for exponent in -12..12 {
            for spread in [1.0, 1.001, 3.0, 1e4, 1e9, 1e15] {
                let low = 1.7 * 10f64.powi(exponent);
                let axis = Axis::fit(Scale::Log, [low, low * spread]).unwrap();
                assert!((1..=12).contains(&axis.ticks.len()), "{low} {spread}: {:?}", axis.ticks);
                let (first, last) = (axis.place(low), axis.place(low * spread));
                assert!(0.0 < first && last < 1.0 && first <= last, "{first} {last}");
            }
        }
        assert!(Axis::fit(Scale::Log, [0.0, f64::NAN]).is_none());
    }
}
