//! The picture: pixels, and the file.

use png::{BitDepth, ColorType, Compression, Encoder};

use super::error::RenderError;

/// What is behind everything.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Background {
    /// Nothing: alpha 0.
    Transparent,
    /// An sRGB colour.
    Colour([u8; 3]),
}

impl Background {
    /// White.
    pub const WHITE: Self = Self::Colour([255; 3]);

    /// The pixel of it.
    pub(super) fn pixel(self) -> [u8; 4] {
        match self {
            Self::Transparent => [255, 255, 255, 0],
            Self::Colour([r, g, b]) => [r, g, b, 255],
        }
    }

    /// The colour of text on it: dark, but light on what is dark.
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
pub struct Picture {
    width: usize,
    height: usize,
    /// Row by row from the top.
    pixels: Vec<[u8; 4]>,
}

impl Picture {
    /// A picture with nothing on it.
    pub(super) fn blank(width: usize, height: usize, background: Background) -> Self {
        Self { width, height, pixels: vec![background.pixel(); width * height] }
    }

    /// A picture of the pixels given, row by row.
    pub(super) fn of(width: usize, height: usize, pixels: Vec<[u8; 4]>) -> Self {
        debug_assert_eq!(pixels.len(), width * height);
        Self { width, height, pixels }
    }

    /// Width in pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Red, green, blue (sRGB) and alpha (straight) of every pixel, row by row from the top.
    pub fn pixels(&self) -> &[[u8; 4]] {
        &self.pixels
    }

    /// A pixel, from the top left corner.
    pub fn pixel(&self, x: usize, y: usize) -> Option<[u8; 4]> {
        (x < self.width).then(|| self.pixels.get(y * self.width + x).copied()).flatten()
    }

    /// Puts a picture here, its top left corner at a pixel. What hangs out is cut off.
    pub(super) fn paste(&mut self, other: &Self, x: usize, y: usize) {
        let columns = other.width.min(self.width.saturating_sub(x));
        for row in 0..other.height.min(self.height.saturating_sub(y)) {
            let from = &other.pixels[row * other.width..][..columns];
            self.pixels[(y + row) * self.width + x..][..columns].copy_from_slice(from);
        }
    }

    /// Lays a colour over a pixel, if there is one.
    pub(super) fn blend(&mut self, x: i64, y: i64, rgb: [u8; 3], opacity: f64) {
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

    /// The picture as a PNG file. The same picture gives the same bytes.
    ///
    /// # Errors
    /// [`RenderError::Png`] when it cannot be encoded.
    pub fn to_png(&self) -> Result<Vec<u8>, RenderError> {
        let failed = |error: png::EncodingError| RenderError::Png(error.to_string());
        let opaque = self.pixels.iter().all(|pixel| pixel[3] == 255);
        let kept = if opaque { 3 } else { 4 };
        let data: Vec<u8> =
            self.pixels.iter().flat_map(|pixel| pixel[..kept].iter().copied()).collect();
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(&mut bytes, self.width as u32, self.height as u32);
        encoder.set_color(if opaque { ColorType::Rgb } else { ColorType::Rgba });
        encoder.set_depth(BitDepth::Eight);
        encoder.set_compression(Compression::Balanced);
        let mut writer = encoder.write_header().map_err(failed)?;
        writer.write_image_data(&data).map_err(failed)?;
        writer.finish().map_err(failed)?;
        Ok(bytes)
    }
}
