//! Colours: linear light inside, sRGB outside, and the colour maps of radii and errors.

use std::sync::LazyLock;

/// A colour in linear light, 0 to 1. Samples are averaged and shaded as light; only pixels are sRGB.
pub(super) type Light = [f32; 3];

/// Steps of the table that turns light into sRGB: fine enough for the darkest of 256 values.
const ENCODING_STEPS: usize = 8192;

static DECODED: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|code| decode_unit(code as f64 / 255.0) as f32));

static ENCODED: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let step = |k: usize| encode_unit(k as f64 / ENCODING_STEPS as f64);
    (0..=ENCODING_STEPS).map(|k| (255.0 * step(k)).round() as u8).collect()
});

fn decode_unit(code: f64) -> f64 {
    if code <= 0.04045 { code / 12.92 } else { ((code + 0.055) / 1.055).powf(2.4) }
}

fn encode_unit(light: f64) -> f64 {
    if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 }
}

/// The light of an sRGB colour.
pub(super) fn decode(rgb: [u8; 3]) -> Light {
    rgb.map(|code| DECODED[usize::from(code)])
}

/// The sRGB colour of a light; brighter than white is white.
pub(super) fn encode(light: Light) -> [u8; 3] {
    let steps = ENCODING_STEPS as f32;
    light.map(|l| ENCODED[(l.clamp(0.0, 1.0) * steps + 0.5) as usize])
}

/// `a` and `b` mixed, `share` of `b`.
pub(super) fn mix(a: Light, b: Light, share: f32) -> Light {
    std::array::from_fn(|k| a[k] + share * (b[k] - a[k]))
}

/// A colour map, of even steps in lightness.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColourMap {
    /// From dark blue over green to yellow: viridis of matplotlib, without its darkest part, on
    /// which neither shading nor lines would show.
    Viridis,
    /// Blue below zero, light grey at it, red above: RdBu of ColorBrewer without its darkest ends.
    Diverging,
}

const VIRIDIS: [[u8; 3]; 9] = [
    [0x45, 0x37, 0x81],
    [0x3D, 0x4E, 0x8A],
    [0x32, 0x66, 0x8E],
    [0x28, 0x7D, 0x8E],
    [0x1F, 0x95, 0x8B],
    [0x29, 0xAF, 0x7F],
    [0x5C, 0xC8, 0x63],
    [0xA8, 0xDB, 0x34],
    [0xFD, 0xE7, 0x25],
];

const DIVERGING: [[u8; 3]; 9] = [
    [0x21, 0x66, 0xAC],
    [0x43, 0x93, 0xC3],
    [0x92, 0xC5, 0xDE],
    [0xCF, 0xE3, 0xEE],
    [0xF1, 0xF1, 0xF1],
    [0xFB, 0xD9, 0xC6],
    [0xF4, 0xA5, 0x82],
    [0xD6, 0x60, 0x4D],
    [0xB2, 0x18, 0x2B],
];

impl ColourMap {
    /// The sRGB colour at a place from 0 to 1, between control points that are evenly spaced.
    pub fn at(self, place: f64) -> [u8; 3] {
        let points = match self {
            Self::Viridis => &VIRIDIS,
            Self::Diverging => &DIVERGING,
        };
        let last = points.len() - 1;
        // A place that is not a number takes the low end.
        let place = if place.is_nan() { 0.0 } else { place.clamp(0.0, 1.0) };
        let along = place * last as f64;
        let below = (along as usize).min(last - 1);
        let share = along - below as f64;
        let (a, b) = (points[below], points[below + 1]);
        let between = |k: usize| f64::from(a[k]) + share * (f64::from(b[k]) - f64::from(a[k]));
        std::array::from_fn(|k| between(k).round() as u8)
    }

    /// The map in light, at 256 places.
    pub(super) fn table(self) -> Vec<Light> {
        (0..256).map(|k| decode(self.at(f64::from(k) / 255.0))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_comes_back() {
        for code in 0..=255 {
            assert_eq!(encode(decode([code; 3])), [code; 3]);
        }
    }

    /// A map whose lightness goes up and down would show edges that are not in the data.
    #[test]
    fn lightness_rises_to_the_end_or_to_the_middle() {
        let lightness = |map: ColourMap, k: i32| {
            let [r, g, b] = decode(map.at(f64::from(k) / 64.0));
            0.2126 * r + 0.7152 * g + 0.0722 * b
        };
        for k in 0..64 {
            assert!(lightness(ColourMap::Viridis, k) < lightness(ColourMap::Viridis, k + 1), "{k}");
            let rises = lightness(ColourMap::Diverging, k) < lightness(ColourMap::Diverging, k + 1);
            assert_eq!(rises, k < 32, "{k}");
        }
        assert_eq!(ColourMap::Diverging.at(0.5), [0xF1; 3]);
        assert_eq!(ColourMap::Viridis.at(f64::NAN), VIRIDIS[0]);
    }
}
