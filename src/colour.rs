//! Colour maps of values: for pictures, and for files that carry colours.

/// A colour map, of even steps in lightness.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColourMap {
    /// From dark blue over green to yellow: viridis of matplotlib, without its darkest part, on
    /// which neither shading nor lines would show.
    Viridis,
    /// Blue below zero, light grey at it, red above: RdBu of ColorBrewer without its darkest ends.
    Diverging,
    /// For parts rather than values: Spectral of ColorBrewer, and black at the high end, for lines.
    Parts,
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

const PARTS: [[u8; 3]; 9] = [
    [0xD5, 0x3E, 0x4F],
    [0xF4, 0x6D, 0x43],
    [0xFD, 0xAE, 0x61],
    [0xFE, 0xE0, 0x8B],
    [0xE6, 0xF5, 0x98],
    [0xAB, 0xDD, 0xA4],
    [0x66, 0xC2, 0xA5],
    [0x32, 0x88, 0xBD],
    [0x10, 0x10, 0x10],
];

impl ColourMap {
    /// The sRGB colour at a place from 0 to 1, between control points that are evenly spaced.
    pub fn at(self, place: f64) -> [u8; 3] {
        self.between(place).map(|code| code.round() as u8)
    }

    /// The same colour in linear light, 0 to 1, not rounded to 256 steps.
    pub fn linear(self, place: f64) -> [f64; 3] {
        self.between(place).map(|code| decode_srgb(code / 255.0))
    }

    /// The name by which plotting libraries know the map.
    pub fn name(self) -> &'static str {
        match self {
            Self::Viridis => "viridis",
            Self::Diverging => "RdBu, reversed",
            Self::Parts => "Spectral",
        }
    }

    fn between(self, place: f64) -> [f64; 3] {
        let points = match self {
            Self::Viridis => &VIRIDIS,
            Self::Diverging => &DIVERGING,
            Self::Parts => &PARTS,
        };
        let last = points.len() - 1;
        // A place that is not a number takes the low end.
        let place = if place.is_nan() { 0.0 } else { place.clamp(0.0, 1.0) };
        let along = place * last as f64;
        let below = (along as usize).min(last - 1);
        let share = along - below as f64;
        let (a, b) = (points[below], points[below + 1]);
        std::array::from_fn(|k| f64::from(a[k]) + share * (f64::from(b[k]) - f64::from(a[k])))
    }
}

/// The linear light of a code of sRGB, both 0 to 1 (IEC 61966-2-1).
pub fn decode_srgb(code: f64) -> f64 {
    if code <= 0.04045 { code / 12.92 } else { ((code + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A map whose lightness goes up and down would show edges that are not in the data.
    #[test]
    fn lightness_rises_to_the_end_or_to_the_middle() {
        let lightness = |map: ColourMap, k: i32| {
            let [r, g, b] = map.linear(f64::from(k) / 64.0);
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
