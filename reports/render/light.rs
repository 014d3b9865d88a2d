//! Light: colours, a lamp at the viewer's left shoulder, glass, and the darkening of crevices.
//!
//! Samples are averaged and shaded as linear light; only pixels are sRGB.

use std::sync::LazyLock;

use medial::{ColourMap, Vec3, decode_srgb};
use rayon::prelude::*;

use super::camera::Frame;

/// A colour in linear light, 0 to 1.
pub(super) type Light = [f32; 3];

/// The content of a pixel, as means over its samples.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PixelLight {
    /// Light of the solid facets, after the glass in front of them.
    pub(super) solid: Light,
    /// Share of the pixel that this light comes from.
    pub(super) solid_share: f32,
    /// Share of the pixel that is glass.
    pub(super) glass_share: f32,
    /// Share that is covered by solid facets.
    pub(super) covered: f32,
    /// Depth of the solid facets, in pixels; without meaning where nothing is covered.
    pub(super) depth: f32,
    /// Depth of the farthest of them.
    pub(super) farthest: f32,
}

/// Steps of the table that turns light into sRGB: fine enough for the darkest of 256 values.
const ENCODING_STEPS: usize = 8192;

static DECODED: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|code| decode_srgb(code as f64 / 255.0) as f32));

static ENCODED: LazyLock<Vec<u8>> = LazyLock::new(|| {
    (0..=ENCODING_STEPS)
        .map(|k| {
            // IEC 61966-2-1: a straight piece near black, where a power would have no slope.
            let light = k as f64 / ENCODING_STEPS as f64;
            let low = light <= 0.003_130_8;
            let unit = if low { 12.92 * light } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 };
            (255.0 * unit).round() as u8
        })
        .collect()
});

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

/// The colours of facets by their places in a colour map; of a plain colour one.
#[derive(Clone, Debug)]
pub(super) struct Paint(Vec<Light>);

impl Paint {
    pub(super) fn plain(light: Light) -> Self {
        Self(vec![light])
    }

    pub(super) fn map(map: ColourMap) -> Self {
        Self((0..256).map(|k| decode(map.at(f64::from(k) / 255.0))).collect())
    }

    /// The light at a place from 0 to 1.
    pub(super) fn at(&self, place: f32) -> Light {
        let last = (self.0.len() - 1) as f32;
        self.0[(place.clamp(0.0, 1.0) * last + 0.5) as usize]
    }
}

/// Direction of the lamp, along right, up and back: near the eye, so that nothing lies in the dark, and off it, so that
/// round things look round.
const LAMP: [f64; 3] = [-0.38, 0.48, 0.79];

/// Share of light that comes from everywhere.
const AMBIENT: f32 = 0.34;

/// Lines along sides, nearly black.
pub(super) const LINE: Light = [0.006, 0.006, 0.008];

/// The colour of glass: a blue grey.
pub(super) const GLASS: Light = [0.17, 0.23, 0.32];

/// How much a layer of glass covers where it faces the eye, and where it is seen from its side.
const GLASS_OPACITY: [f32; 2] = [0.035, 0.75];

/// The lamp before a shape.
pub(super) struct Lamp {
    /// Towards it, of length 1.
    direction: Vec3,
    back: Vec3,
}

impl Lamp {
    pub(super) fn new(frame: &Frame) -> Self {
        let direction = LAMP[0] * frame.right + LAMP[1] * frame.up + LAMP[2] * frame.back;
        Self { direction: direction.normalize_or(frame.back), back: frame.back }
    }

    /// The light from a place with this normal, of either direction and any length.
    pub(super) fn shade(&self, normal: Vec3, colour: Light) -> Light {
        // Sheets have two sides: the one that is seen is lit.
        let side = if normal.dot(self.back) < 0.0 { -1.0 } else { 1.0 };
        // A face without area has no normal, and is lit from everywhere alone.
        let length = normal.length().max(f64::MIN_POSITIVE);
        let toward_lamp = side * normal.dot(self.direction) / length; // not yet of length 1
        let strength = AMBIENT + (1.0 - AMBIENT) * toward_lamp.max(0.0) as f32;
        colour.map(|c| c * strength)
    }
}

/// How much glass covers, by how far it faces the eye: 0 from its side, 1 from its front. Only rims show, so that the
/// inside is seen.
pub(super) fn glass_opacity(facing: f32) -> f32 {
    let [front, rim] = GLASS_OPACITY;
    front + (rim - front) * (1.0 - facing.clamp(0.0, 1.0)).powi(3)
}

/// The farthest places whose depth darkens a pixel, as a share of the picture's shorter side.
const REACH: f32 = 0.022;

/// Rings around a pixel, and pairs of opposite places on each.
const RINGS: usize = 3;
const PAIRS: usize = 8;

/// How dark crevices are, 0 to 1.
const DEPTH_OF_SHADE: f32 = 0.8;

/// The share of light that is left in crevices and behind near edges. By depth alone: a pixel is darkened where it lies
/// behind the middle of opposite neighbours, so that a slanted plane is not.
///
/// After Luft, Colditz, Deussen, "Image enhancement by unsharp masking the depth buffer", ACM TOG 25 (2006),
/// <https://doi.org/10.1145/1141911.1142016>, with pairs in place of the blurred depth.
pub(super) fn crevices(pixels: &[PixelLight], [width, height]: [usize; 2]) -> Vec<f32> {
    let reach = REACH * width.min(height) as f32;
    let mut offsets = Vec::new();
    for (ring, pair) in (0..RINGS).flat_map(|ring| (0..PAIRS).map(move |pair| (ring, pair))) {
        let radius = reach * (ring + 1) as f32 / RINGS as f32;
        // Rings are turned against each other, so that they leave no spokes.
        let turn = (pair as f32 + ring as f32 / RINGS as f32) / PAIRS as f32;
        // Half a turn: the opposite place of each pair is on the other half.
        let (sin, cos) = (std::f32::consts::PI * turn).sin_cos();
        offsets.push((radius, [(radius * cos).round() as i64, (radius * sin).round() as i64]));
    }
    // Not a number where nothing is: compact, since every pixel reads many.
    let depths: Vec<f32> =
        pixels.iter().map(|p| if p.covered > 0.0 { p.depth } else { f32::NAN }).collect();
    let depth_at = |x: i64, y: i64| {
        let inside = x >= 0 && y >= 0 && (x as usize) < width && (y as usize) < height;
        if inside { depths[y as usize * width + x as usize] } else { f32::NAN }
    };
    let share = |(index, here): (usize, &PixelLight)| {
        if here.covered == 0.0 {
            return 1.0; // background has no crevice
        }
        let (x, y) = ((index % width) as i64, (index / width) as i64);
        let mut hidden = 0.0;
        for &(radius, [dx, dy]) in &offsets {
            // Of a pixel that shows two parts the farther one counts: the edge between them would shine. Depth counts
            // to the ring's radius only: a far edge must not be darker than a near one.
            let [a, b] = [depth_at(x + dx, y + dy), depth_at(x - dx, y - dy)]
                .map(|depth| ((here.farthest - depth) / radius).clamp(-1.0, 1.0));
            // Next to the background the other side is unknown: `max` drops a sum that is not a number.
            hidden += (a + b).max(0.0);
        }
        1.0 - DEPTH_OF_SHADE * (hidden / offsets.len() as f32).min(1.0)
    };
    pixels.par_iter().enumerate().map(share).collect()
}
