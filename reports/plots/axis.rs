//! Axes: the scale, the range that the data needs, and ticks at round numbers.

use std::ops::Range;

use medial_run::text::{grouped, round_steps, significant};
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};

/// Width of a letter beneath an axis, with its share of the gap to the next label; of the axis' length.
const WIDTH_OF_LETTER: f64 = 0.018;

/// How values are laid out along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Scale {
    /// From zero.
    Linear,
    /// Logarithmic; values that are not positive are drawn on the lower border.
    Log,
}

/// An axis fitted to its data. Plotters' own logarithmic axis has ticks at decades alone, and labels that collide.
pub(crate) struct Axis {
    scale: Scale,
    /// The values at both ends.
    ends: [f64; 2],
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
        let ticks = match scale {
            Scale::Log => {
                // At least a factor of two, or a single value would have no scale at all.
                let widen = (2.0 * low / high).max(1.0).sqrt();
                (low, high) = (low / widen / 1.12, high * widen * 1.12);
                log_ticks(low, high)
            }
            Scale::Linear => {
                (low, high) = (low.min(0.0), (high * 1.05).max(1e-12));
                round_steps(low, high, 5.0).1
            }
        };
        Some(Self { scale, ends: [low, high], ticks })
    }

    /// Where a value lies between the ends of the axis, from 0 to 1.
    fn place(&self, value: f64) -> f64 {
        let [at, low, high] = [value, self.ends[0], self.ends[1]].map(|value| match self.scale {
            Scale::Log => value.log10(),
            Scale::Linear => value,
        });
        let place = (at - low) / (high - low);
        // Values without a logarithm go to the lower end.
        if place.is_finite() { place.clamp(0.0, 1.0) } else { 0.0 }
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
        self.ends[0]..self.ends[1]
    }
}

impl ValueFormatter<f64> for Axis {
    fn format(value: &f64) -> String {
        label(*value)
    }
}

fn label(value: f64) -> String {
    let rounded: f64 = significant(value, 3).parse().unwrap_or(value);
    match rounded {
        0.0 => "0".to_owned(),
        1000.0..1e15 => grouped(rounded as u64),
        _ => rounded.to_string(),
    }
}

/// The densest of four decade patterns that stays readable on a logarithmic axis.
fn log_ticks(low: f64, high: f64) -> Vec<f64> {
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
            gap < WIDTH_OF_LETTER * label(pair[1]).len() as f64
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

    #[test]
    fn ticks_are_round_and_few() {
        for (scale, values, expected) in [
            (Scale::Log, [50.0, 1000.0], "50 100 200 500 1,000"),
            (Scale::Log, [0.4, 1.9], "0.4 0.5 0.6 0.7 0.8 0.9 1 2"),
            // 50,000 and 60,000 would touch.
            (Scale::Log, [9000.0, 60000.0], "10,000 20,000 50,000"),
            (Scale::Linear, [3.0, 48.0], "0 20 40"),
        ] {
            let axis = Axis::fit(scale, values).unwrap();
            let labels: Vec<String> = axis.ticks.iter().copied().map(label).collect();
            assert_eq!(labels.join(" "), expected);
        }
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
