//! Colours: linear light inside, sRGB outside. The colour maps of radii and errors are the library's.

use std::sync::LazyLock;

pub use medial::ColourMap;
use medial::decode_srgb;

/// A colour in linear light, 0 to 1. Samples are averaged and shaded as light; only pixels are sRGB.
pub(super) type Light = [f32; 3];

/// Steps of the table that turns light into sRGB: fine enough for the darkest of 256 values.
const ENCODING_STEPS: usize = 8192;

static DECODED: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|code| decode_srgb(code as f64 / 255.0) as f32));

static ENCODED: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let step = |k: usize| encode_unit(k as f64 / ENCODING_STEPS as f64);
    (0..=ENCODING_STEPS).map(|k| (255.0 * step(k)).round() as u8).collect()
});

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

/// A map in light, at 256 places.
pub(super) fn table(map: ColourMap) -> Vec<Light> {
    (0..256).map(|k| decode(map.at(f64::from(k) / 255.0))).collect()
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
}
