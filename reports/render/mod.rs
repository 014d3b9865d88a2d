//! Pictures of surfaces and medial meshes, without a GPU or a display.
//!
//! ```text
//! layers -> facets (triangles) -> rasterise: nearest facet of each sample, glass, light of each pixel
//!        -> crevices darkened -> over the background -> Picture -> lettering, colour bars -> PNG
//! ```
//!
//! The same scene gives the same bytes with any number of threads.
//!
//! A rasteriser of our own, of some 2,000 lines without a dependency but `png` (eight crates) for the files: `euc` (0.5, 26
//! crates in its tree) would fill the triangles, but lines, tubes, glass, crevices and lettering, which are most of these
//! lines, would be ours still; `tiny-skia` has no depth; the others need a GPU. Letters are strokes (`lettering`), so that no
//! font file is needed. 100,000 triangles on 800 by 600 pixels take about 0.2 s on one core.

mod bar;
mod camera;
mod colour;
mod creases;
mod error;
mod facets;
mod glyphs;
mod layers;
mod lettering;
mod picture;
mod placed;
mod raster;
mod round;
mod shade;
mod strip;
#[cfg(test)]
mod tests;

pub use bar::Bar;
pub use camera::{Camera, Frame};
pub use colour::ColourMap;
pub use error::RenderError;
pub use layers::{AxisColour, Layer, Scale};
pub use picture::{Background, Picture};
pub use strip::{ColourBy, Errors, Panel, Strip, strip};

use medial::Vec3;
use rayon::prelude::*;

use colour::{decode, encode};
use layers::Canvas;
use raster::PixelLight;
use shade::GLASS;

/// The longest side of a picture, in pixels.
pub const MOST_PIXELS: usize = 8192;

/// The shortest side.
const FEWEST_PIXELS: usize = 16;

/// What a picture is of, but for the camera.
#[derive(Clone, Debug)]
pub struct Scene<'a> {
    /// What is drawn. All in one unit.
    pub layers: Vec<Layer<'a>>,
    /// Width and height in pixels.
    pub size: [usize; 2],
    /// What is behind everything.
    pub background: Background,
}

impl Scene<'_> {
    /// The points by which a camera is set up: those of the first layer that has any.
    pub fn points(&self) -> Vec<Vec3> {
        let points = self.layers.iter().map(Layer::points);
        points.into_iter().find(|points| !points.is_empty()).unwrap_or_default()
    }

    /// Sets a camera up so that the scene fills the picture.
    ///
    /// # Errors
    /// As [`Frame::fit`].
    pub fn frame(&self, camera: &Camera) -> Result<Frame, RenderError> {
        Frame::fit(camera, &self.points())
    }

    /// Takes the picture. Parallel; the same pixels for any number of threads. Time linear in the number of
    /// triangles and of pixels.
    ///
    /// ```
    /// use medial::Vec3;
    /// use medial::surface::TriMesh;
    /// use medial_reports::render::{Background, Camera, Layer, Scene};
    ///
    /// let vertices = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
    /// let faces = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    /// let tetrahedron = TriMesh { vertices, faces };
    /// let layers = vec![Layer::Surface(&tetrahedron)];
    /// let scene = Scene { layers, size: [320, 240], background: Background::WHITE };
    /// let camera = Camera::fitting(&tetrahedron);
    /// let picture = scene.picture(&scene.frame(&camera)?)?;
    /// assert_eq!(picture.pixel(0, 0), Some([255; 4]));
    /// let file = picture.to_png()?;
    /// assert!(file.starts_with(b"\x89PNG"));
    /// # Ok::<(), medial_reports::render::RenderError>(())
    /// ```
    ///
    /// # Errors
    /// When a side of the picture is out of range, or a layer's values are not one for each vertex.
    pub fn picture(&self, frame: &Frame) -> Result<Picture, RenderError> {
        let [width, height] = self.size;
        check_size(self.size)?;
        let canvas = Canvas { frame, size: self.size };
        let mut batches = Vec::new();
        for layer in &self.layers {
            batches.extend(layer.batches(&canvas)?);
        }
        let lights = raster::rasterise(&batches, frame, self.size);
        let shares = shade::crevices(&lights, width, height);
        let over = |(light, share): (&PixelLight, &f32)| composed(light, *share, self.background);
        let pixels = lights.par_iter().zip(&shares).map(over).collect();
        Ok(Picture::of(width, height, pixels))
    }
}

/// Refuses a picture that is too small to be one, or too large for the exact arithmetic of edges.
pub(crate) fn check_size([width, height]: [usize; 2]) -> Result<(), RenderError> {
    let sides = FEWEST_PIXELS..=MOST_PIXELS;
    if sides.contains(&width) && sides.contains(&height) {
        return Ok(());
    }
    Err(RenderError::Size { width, height, most: MOST_PIXELS })
}

/// A pixel over the background; `share` of the light of what is solid is left by crevices.
fn composed(light: &PixelLight, share: f32, background: Background) -> [u8; 4] {
    let seen = light.solid_share + light.glass_share;
    let sum: [f32; 3] =
        std::array::from_fn(|k| share * light.solid[k] + light.glass_share * GLASS[k]);
    match background {
        Background::Transparent if seen <= 0.0 => background.pixel(),
        Background::Transparent => {
            let [r, g, b] = encode(sum.map(|s| s / seen));
            [r, g, b, (255.0 * seen.min(1.0)).round() as u8]
        }
        Background::Colour(rgb) => {
            let behind = decode(rgb);
            let rest = (1.0 - seen).max(0.0);
            let [r, g, b] = encode(std::array::from_fn(|k| sum[k] + rest * behind[k]));
            [r, g, b, 255]
        }
    }
}
