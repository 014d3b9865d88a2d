//! The colour bar: what the colours mean, beside a picture.

use super::layers::Scale;
use super::lettering::{Align, Lettering, text_width};
use super::picture::{Background, Picture};

/// A colour bar.
#[derive(Clone, Debug)]
pub struct Bar {
    /// The colours and their range.
    pub scale: Scale,
    /// Values are shown times this: 100 over the bounding-box diagonal for percentages of it.
    pub times: f64,
    /// Lines above the bar.
    pub title: Vec<String>,
    /// Lines below it.
    pub note: Vec<String>,
}

/// Height of a capital as a share of a picture's shorter side, and the least in pixels.
const LETTER: f64 = 0.0165;
const LEAST_LETTER: f64 = 8.0;

/// Sizes in heights of a capital: the column, the bar's width, its part of the height, ticks, a line of text.
const COLUMN: f64 = 11.5;
const WIDTH: f64 = 1.9;
const TALLEST: f64 = 30.0;
const TICK: f64 = 0.5;
pub(super) const LINE: f64 = 1.9;

/// Height of a capital on pictures of this size, in pixels.
pub(super) fn letter_size([width, height]: [usize; 2]) -> f64 {
    (LETTER * width.min(height) as f64).max(LEAST_LETTER)
}

impl Bar {
    /// The width of the column that bars take beside a picture of this size, in pixels.
    pub fn column(size: [usize; 2]) -> usize {
        (COLUMN * letter_size(size)).ceil() as usize
    }

    /// A picture with the bar to its right. It is wider by [`Bar::column`] of `size`, the size by which letters
    /// are chosen.
    pub fn beside(&self, picture: &Picture, size: [usize; 2], background: Background) -> Picture {
        let (width, height) = (picture.width() + Self::column(size), picture.height());
        let mut wide = Picture::blank(width, height, background);
        wide.paste(picture, 0, 0);
        self.draw(&mut wide, [picture.width(), 0], height, letter_size(size), background);
        wide
    }

    /// Draws the bar into a column: its left top corner, its height, the height of a capital.
    pub(super) fn draw(
        &self,
        picture: &mut Picture,
        [left, top]: [usize; 2],
        height: usize,
        size: f64,
        background: Background,
    ) {
        let ink = background.ink();
        let letters = Lettering { size, ink, align: Align::Left };
        let text = LINE * size * (self.title.len() + self.note.len() + 2) as f64;
        let tall = (height as f64 - text - 2.0 * size).min(TALLEST * size).max(size);
        let left = left as f64 + 0.5 * size;
        let mut y = top as f64 + 0.5 * (height as f64 - text - tall) + LINE * size;
        for line in &self.title {
            letters.write(picture, [left, y], line);
            y += LINE * size;
        }
        let bar_top = y - 0.4 * size;
        self.colours(picture, [left, bar_top], tall, size, ink);
        y = bar_top + tall + LINE * size + 0.6 * size;
        for line in &self.note {
            letters.write(picture, [left, y], line);
            y += LINE * size;
        }
    }

    fn colours(
        &self,
        picture: &mut Picture,
        [left, top]: [f64; 2],
        tall: f64,
        size: f64,
        ink: [u8; 3],
    ) {
        let (x, wide) = (left.round() as i64, (WIDTH * size).round() as i64);
        let (first, rows) = (top.round() as i64, tall.round() as i64);
        for row in 0..rows {
            let rgb = self.scale.map.at(1.0 - (row as f64 + 0.5) / rows as f64);
            let is_end = row == 0 || row + 1 == rows;
            for column in 0..wide {
                let is_border = is_end || column == 0 || column + 1 == wide;
                picture.blend(x + column, first + row, if is_border { ink } else { rgb }, 1.0);
            }
        }
        let (lo, hi) = (self.times * self.scale.lo, self.times * self.scale.hi);
        let letters = Lettering { size, ink, align: Align::Left };
        for (value, text) in ticks(lo, hi) {
            let share = if hi > lo { (value - lo) / (hi - lo) } else { 0.5 };
            let y = first + ((1.0 - share) * (rows - 1) as f64).round() as i64;
            let length = (TICK * size).round() as i64;
            (0..length).for_each(|k| picture.blend(x + wide + k, y, ink, 1.0));
            // Signs hang out to the left, so that digits stand below each other.
            let digits = text.trim_start_matches('−');
            let sign = text_width(&text, size) - text_width(digits, size);
            let room =
                if lo < 0.0 { text_width("−0", size) - text_width("0", size) } else { 0.0 };
            let at = (x + wide + length) as f64 + 0.5 * size + room - sign;
            letters.write(picture, [at, y as f64 + 0.5 + 0.5 * size], &text);
        }
    }
}

/// About this many ticks are drawn.
const TICKS: f64 = 6.0;

/// Round values in a range, and what stands beside them; the value itself where the range has no extent.
fn ticks(lo: f64, hi: f64) -> Vec<(f64, String)> {
    if hi <= lo {
        return vec![(lo, with_minus(crate::text::significant(lo, 3)))];
    }
    let step = round_up((hi - lo) / (TICKS + 1.0));
    let decimals = decimals(step);
    let first = (lo / step - 1e-9).ceil();
    let last = (hi / step + 1e-9).floor();
    (0..=(last - first) as usize)
        .map(|k| {
            let value = (first + k as f64) * step;
            // No sign before zero.
            let shown = if first + k as f64 == 0.0 { 0.0 } else { value };
            (value, with_minus(format!("{shown:.decimals$}")))
        })
        .collect()
}

fn with_minus(number: String) -> String {
    number.replace('-', "−")
}

/// Decimals that show all digits of a step of 1, 2 or 5 times a power of ten.
fn decimals(step: f64) -> usize {
    (-step.log10() - 1e-9).ceil().clamp(0.0, 12.0) as usize
}

/// The least of 1, 2 and 5 times a power of ten that is not below a positive number.
pub(super) fn round_up(value: f64) -> f64 {
    let power = 10.0_f64.powf(value.log10().floor());
    let found = [1.0, 2.0, 5.0].into_iter().find(|m| m * power >= value * (1.0 - 1e-9));
    found.unwrap_or(10.0) * power
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_few() {
        let words =
            |lo, hi| ticks(lo, hi).into_iter().map(|tick| tick.1).collect::<Vec<_>>().join(" ");
        assert_eq!(words(0.13, 5.2), "1 2 3 4 5");
        assert_eq!(words(-2.0, 2.0), "−2 −1 0 1 2");
        assert_eq!(words(0.0, 0.05), "0.00 0.01 0.02 0.03 0.04 0.05");
        assert_eq!(words(3.0, 3.0), "3.00");
        assert_eq!([0.3, 1.0, 1.2, 7.0].map(round_up), [0.5, 1.0, 2.0, 10.0]);
    }
}
