//! The picture: pixels, lettering, the colour bar, and the file.

use std::str::FromStr;
use std::sync::LazyLock;

use fontdue::{Font, FontSettings};
use medial_run::text::round_steps;
use png::{BitDepth, ColorType, Compression, Encoder};

use super::RenderError;
use super::scale::Scale;

/// The background of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Background {
    /// Nothing: alpha 0.
    Transparent,
    /// An sRGB colour.
    Colour([u8; 3]),
}

impl FromStr for Background {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, &'static str> {
        let found = match text {
            "white" => Some(Self::WHITE),
            "black" => Some(Self::Colour([0; 3])),
            "transparent" => Some(Self::Transparent),
            _ => text.strip_prefix('#').and_then(|hex| {
                // The parser also accepts a sign.
                let is_hex = hex.len() == 6 && hex.bytes().all(|b| b.is_ascii_hexdigit());
                let code = is_hex.then(|| u32::from_str_radix(hex, 16).ok()).flatten()?;
                let [_, colour @ ..] = code.to_be_bytes();
                Some(Self::Colour(colour))
            }),
        };
        found.ok_or("expected white, black, transparent or #rrggbb")
    }
}

impl Background {
    pub(crate) const WHITE: Self = Self::Colour([255; 3]);

    /// The pixel of it.
    pub(super) fn pixel(self) -> [u8; 4] {
        match self {
            Self::Transparent => [255, 255, 255, 0],
            Self::Colour([r, g, b]) => [r, g, b, 255],
        }
    }

    /// The colour of text on it: dark, but light on a dark one.
    pub(super) fn ink(self) -> [u8; 3] {
        match self {
            Self::Colour([r, g, b]) if 2 * u32::from(r) + 5 * u32::from(g) + u32::from(b) < 900 => {
                [0xE8; 3]
            }
            _ => [0x20, 0x21, 0x24],
        }
    }
}

/// A picture of 8-bit sRGB pixels with straight alpha.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Picture {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Row by row from the top.
    pub(super) pixels: Vec<[u8; 4]>,
}

impl Picture {
    /// A picture of the background alone.
    pub(super) fn blank([width, height]: [usize; 2], background: Background) -> Self {
        Self { width, height, pixels: vec![background.pixel(); width * height] }
    }

    /// A pixel, from the top left corner.
    #[cfg(test)]
    pub(super) fn pixel(&self, x: usize, y: usize) -> Option<[u8; 4]> {
        (x < self.width).then(|| self.pixels.get(y * self.width + x).copied()).flatten()
    }

    /// Puts a picture here, its top left corner at a pixel.
    pub(super) fn paste(&mut self, other: &Self, [x, y]: [usize; 2]) {
        for (row, from) in other.pixels.chunks_exact(other.width).enumerate() {
            self.pixels[(y + row) * self.width + x..][..other.width].copy_from_slice(from);
        }
    }

    /// Lays a colour over a pixel, if there is one.
    fn blend(&mut self, x: i64, y: i64, rgb: [u8; 3], opacity: f64) {
        let inside = x >= 0 && y >= 0 && (x as usize) < self.width && (y as usize) < self.height;
        if !inside || opacity <= 0.0 {
            return;
        }
        let pixel = &mut self.pixels[y as usize * self.width + x as usize];
        let under = f64::from(pixel[3]) / 255.0 * (1.0 - opacity);
        let alpha = opacity + under;
        for (code, ink) in pixel.iter_mut().zip(rgb) {
            *code = ((opacity * f64::from(ink) + under * f64::from(*code)) / alpha).round() as u8;
        }
        pixel[3] = (255.0 * alpha).round() as u8;
    }

    /// Writes text that begins at a point on its baseline. `size` is the height of a capital, in pixels.
    pub(super) fn write(&mut self, [x, y]: [f64; 2], text: &str, size: f64, ink: [u8; 3]) {
        let mut pen = x; // in fractions of a pixel
        for character in text.chars() {
            let (metrics, texels) = FONT.rasterize(character, FINE as f32 * em(size) as f32);
            // The glyph is drawn FINE times too large and averaged, so that letters keep their distances.
            let left = (FINE as f64 * pen).round() as i64 + i64::from(metrics.xmin);
            let top =
                (FINE as f64 * y).round() as i64 - i64::from(metrics.ymin) - metrics.height as i64;
            let columns = left.div_euclid(FINE)..=(left + metrics.width as i64).div_euclid(FINE);
            let rows = top.div_euclid(FINE)..=(top + metrics.height as i64).div_euclid(FINE);
            for (row, column) in rows.flat_map(|row| columns.clone().map(move |c| (row, c))) {
                let ink_sum: u32 = (0..FINE * FINE)
                    .filter_map(|k| {
                        // A glyph rarely fills whole pixels: outside of it there is no ink.
                        let u = usize::try_from(FINE * column + k % FINE - left).ok()?;
                        let v = usize::try_from(FINE * row + k / FINE - top).ok()?;
                        (u < metrics.width).then(|| texels.get(v * metrics.width + u)).flatten()
                    })
                    .map(|&cover| u32::from(cover))
                    .sum();
                let cover = f64::from(ink_sum) / (255 * FINE * FINE) as f64;
                self.blend(column, row, ink, cover);
            }
            pen += advance(character, size);
        }
    }

    /// The picture as a PNG file. The same picture gives the same bytes.
    pub(crate) fn to_png(&self) -> Result<Vec<u8>, RenderError> {
        // Without alpha where all pixels are opaque: a quarter less to store.
        let opaque = self.pixels.iter().all(|pixel| pixel[3] == 255);
        let channels = if opaque { 3 } else { 4 };
        let data: Vec<u8> =
            self.pixels.iter().flat_map(|pixel| pixel[..channels].iter().copied()).collect();
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(&mut bytes, self.width as u32, self.height as u32);
        encoder.set_color(if opaque { ColorType::Rgb } else { ColorType::Rgba });
        encoder.set_depth(BitDepth::Eight);
        encoder.set_compression(Compression::Balanced); // smaller takes longer than drawing
        (encoder.write_header())
            .and_then(|mut writer| writer.write_image_data(&data).and_then(|()| writer.finish()))
            .map_err(|error| RenderError::Png(error.to_string()))?;
        Ok(bytes)
    }
}

/// A subset of DejaVu Sans: Latin, Greek, Cyrillic and the signs of numbers (`sans.txt` has its licence and the command
/// that made it).
static FONT: LazyLock<Font> = LazyLock::new(|| {
    let bytes: &[u8] = include_bytes!("sans.ttf");
    Font::from_bytes(bytes, FontSettings::default()).expect("the font is part of the program")
});

/// Height of a capital of the font, in ems.
const CAPITAL: f64 = 0.729;

/// Texels along a side of a pixel in which glyphs are drawn.
const FINE: i64 = 4;

/// Pixels of an em for capitals of a height.
fn em(size: f64) -> f64 {
    size / CAPITAL
}

fn advance(character: char, size: f64) -> f64 {
    f64::from(FONT.metrics(character, em(size) as f32).advance_width)
}

/// The width of text, in pixels.
pub(super) fn text_width(text: &str, size: f64) -> f64 {
    text.chars().map(|character| advance(character, size)).sum()
}

/// Text cut so that it is not wider than `most`, with dots at the cut.
pub(super) fn fitted(text: &str, size: f64, most: f64) -> String {
    if text_width(text, size) <= most {
        return text.to_owned(); // nearly always
    }
    let ends = text.char_indices().rev().map(|(end, _)| format!("{}…", &text[..end]));
    ends.into_iter().find(|cut| text_width(cut, size) <= most).unwrap_or_default()
}

/// A colour bar: the meaning of the colours, next to a picture.
#[derive(Clone, Debug)]
pub(crate) struct Bar {
    pub(crate) scale: Scale,
    /// Values are shown times this: 100 over the bounding-box diagonal for percentages of it.
    pub(crate) times: f64,
    /// Lines above the bar.
    pub(crate) title: &'static [&'static str],
    /// Lines below it.
    pub(crate) note: &'static [&'static str],
}

/// Height of a capital as a share of a picture's shorter side, and the least in pixels.
const LETTER: f64 = 0.0165;
const LEAST_LETTER: f64 = 8.0;

/// Sizes in heights of a capital: the column, the bar's width, its greatest height, ticks, a line of text.
const COLUMN: f64 = 16.0;
const WIDTH: f64 = 1.9;
const TALLEST: f64 = 30.0;
const TICK: f64 = 0.5;
pub(super) const LINE: f64 = 1.9;

/// About this many ticks are drawn.
const TICKS: f64 = 6.0;

/// Height of a capital on pictures of this size, in pixels.
pub(super) fn letter_size([width, height]: [usize; 2]) -> f64 {
    (LETTER * width.min(height) as f64).max(LEAST_LETTER)
}

impl Bar {
    /// The width of the column that bars take next to a picture of this size, in pixels.
    pub(crate) fn column(size: [usize; 2]) -> usize {
        (COLUMN * letter_size(size)).ceil() as usize
    }

    /// Draws the bar into a column: its left top corner, its height, the height of a capital.
    pub(super) fn draw(
        &self,
        picture: &mut Picture,
        [left, top]: [usize; 2],
        height: usize,
        size: f64,
        ink: [u8; 3],
    ) {
        let text = LINE * size * (self.title.len() + self.note.len() + 2) as f64;
        let tall = (height as f64 - text - 2.0 * size).min(TALLEST * size).max(size);
        let left = left as f64 + 0.5 * size;
        let mut y = top as f64 + 0.5 * (height as f64 - text - tall) + LINE * size;
        for line in self.title {
            picture.write([left, y], line, size, ink);
            y += LINE * size;
        }
        let bar_top = y - 0.4 * size;
        y = bar_top + tall + LINE * size + 0.6 * size;
        for line in self.note {
            picture.write([left, y], line, size, ink);
            y += LINE * size;
        }
        let (x, wide) = (left.round() as i64, (WIDTH * size).round() as i64);
        let (first, rows) = (bar_top.round() as i64, tall.round() as i64);
        for row in 0..rows {
            let rgb = self.scale.map.at(1.0 - (row as f64 + 0.5) / rows as f64);
            let is_end = row == 0 || row + 1 == rows;
            for column in 0..wide {
                let is_border = is_end || column == 0 || column + 1 == wide;
                picture.blend(x + column, first + row, if is_border { ink } else { rgb }, 1.0);
            }
        }
        let (lo, hi) = (self.times * self.scale.lo, self.times * self.scale.hi);
        let tick = (TICK * size).round() as i64;
        // Signs hang out to the left, so that digits stand below each other.
        let sign = if lo < 0.0 { text_width("−", size) } else { 0.0 };
        for (value, text) in ticks(lo, hi) {
            let share = if hi > lo { (value - lo) / (hi - lo) } else { 0.5 };
            let y = first + ((1.0 - share) * (rows - 1) as f64).round() as i64;
            (0..tick).for_each(|k| picture.blend(x + wide + k, y, ink, 1.0));
            let hung = if text.starts_with('−') { 0.0 } else { sign };
            let at = (x + wide + tick) as f64 + 0.5 * size + hung;
            picture.write([at, y as f64 + 0.5 + 0.5 * size], &text, size, ink);
        }
    }
}

/// Round values in a range, and the text next to them; the value itself where the range has no extent.
fn ticks(lo: f64, hi: f64) -> Vec<(f64, String)> {
    if hi <= lo {
        return vec![(lo, medial_run::text::significant(lo, 3).replace('-', "−"))];
    }
    let (step, values) = round_steps(lo, hi, TICKS + 1.0);
    // Decimals that show all digits of a step of 1, 2 or 5 times a power of ten.
    let decimals = (-step.log10() - 1e-9).ceil().clamp(0.0, 12.0) as usize;
    // A minus sign: a hyphen is shorter and hard to see.
    let text = |value| format!("{value:.decimals$}").replace('-', "−");
    values.into_iter().map(|value| (value, text(value))).collect()
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
        assert_eq!([0.3, 1.0, 1.2, 7.0].map(medial_run::text::round_up), [0.5, 1.0, 2.0, 10.0]);
    }

    #[test]
    fn letters_have_ink_and_long_text_is_cut() {
        for character in ('!'..='~').chain("°±×–−≥≤…éλЖ".chars()) {
            assert_ne!(FONT.lookup_glyph_index(character), 0, "{character}");
        }
        let mut picture = Picture::blank([40, 30], Background::WHITE);
        picture.write([5.0, 25.0], "H", 20.0, [0; 3]);
        let dark = |x: usize, y: usize| picture.pixel(x, y).is_some_and(|p| p[0] < 128);
        let rows: Vec<usize> = (0..30).filter(|&y| (0..40).any(|x| dark(x, y))).collect();
        assert_eq!((rows.first(), rows.last()), (Some(&5), Some(&24)), "a capital has its height");
        assert_eq!(fitted("bear", 10.0, 100.0), "bear");
        let cut = fitted("a-long-name-of-a-file", 10.0, 100.0);
        assert!(cut.ends_with('…') && text_width(&cut, 10.0) <= 100.0, "{cut}");
        assert_eq!(fitted("wide", 10.0, 1.0), "");
    }
}
