//! Panels side by side: medial meshes of one shape from one camera and with one scale, and the bar that explains it.

use medial::ColourMap;
use medial::complex::{MedialMesh, SheetGraph, SheetOptions};
use medial::surface::TriMesh;
use medial_run::text::round_up;
use serde::{Deserialize, Serialize};

use super::RenderError;
use super::camera::{Camera, Frame};
use super::picture::{Background, Bar, LINE, Picture, fitted, letter_size, text_width};
use super::scale::Scale;
use super::scene::{Layer, Scene};

/// The colouring of medial meshes, before the scale is known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ColourBy {
    /// The radii of the spheres.
    #[default]
    Radius,
    /// One colour for sheets, one for curves.
    Plain,
    /// Sheets in separate colours, seams black: of the meshes of `painted`, whose radii are colours.
    #[serde(skip)]
    Sheets,
}

/// The sheets, seams and junctions of a medial mesh in diagonals of its surface, for [`ColourBy::Sheets`].
pub(crate) fn painted(mesh: &MedialMesh) -> MedialMesh {
    let (mut painted, colours) = SheetGraph::new(mesh, SheetOptions::default()).painted(mesh);
    for (sphere, colour) in painted.spheres.iter_mut().zip(colours) {
        sphere.radius = colour;
    }
    painted
}

impl ColourBy {
    /// The colours for some medial meshes of a shape with this bounding-box diagonal, and the bar that explains them.
    pub(crate) fn of(self, meshes: &[&MedialMesh], diagonal: f64) -> (Option<Scale>, Option<Bar>) {
        if self == Self::Sheets {
            return (Some(Scale { lo: 0.0, hi: 1.0, map: ColourMap::Parts }), None);
        }
        let scale = (self == Self::Radius).then(|| Scale::radii(meshes.iter().copied()));
        let title = &["radius", "% of diagonal"];
        let bar = |scale| Bar { scale, times: 100.0 / diagonal, title, note: &[] };
        (scale, scale.map(bar))
    }
}

/// A surface with its signed distances from another.
#[derive(Clone, Debug)]
pub(crate) struct Errors<'a> {
    pub(crate) mesh: &'a TriMesh,
    /// For each vertex its distance, positive outside, in the unit of the mesh.
    pub(crate) values: &'a [f64],
    pub(crate) caption: String,
}

/// Share of the values of a surface that a scale chosen from them spans; the rest has the colours of its ends.
const SPANNED: f64 = 0.9;

impl Errors<'_> {
    /// The distance that 90 % of the vertices are within.
    fn usual(&self) -> f64 {
        let mut sizes: Vec<f64> = self.values.iter().map(|value| value.abs()).collect();
        sizes.sort_by(f64::total_cmp); // a total order: the same scale each time
        let place = (sizes.len().saturating_sub(1) as f64 * SPANNED) as usize;
        sizes.get(place).copied().unwrap_or(0.0)
    }

    /// The end of a scale for several surfaces, in their unit. It is chosen for the better half of them, whose errors it
    /// must show: the geometric mean of the distances that 90 % of the vertices of each are within. Round as a percentage
    /// of a diagonal.
    pub(crate) fn common_scale(all: &[&Self], diagonal: f64) -> f64 {
        let mut ends: Vec<f64> = all.iter().map(|errors| errors.usual() / diagonal).collect();
        ends.sort_by(f64::total_cmp);
        ends.truncate(ends.len().div_ceil(2));
        ends.retain(|end| *end > 0.0 && end.is_finite()); // others have no logarithm
        let mean = ends.iter().map(|end| end.ln()).sum::<f64>() / ends.len() as f64;
        let percent = if ends.is_empty() { 1.0 } else { 100.0 * mean.exp() };
        round_up(percent) * diagonal / 100.0
    }

    /// The bar of errors up to `end`, with a remark where values are beyond.
    pub(crate) fn bar(all: &[&Self], end: f64, diagonal: f64) -> Bar {
        let is_clipped = all.iter().any(|errors| errors.values.iter().any(|v| v.abs() > end));
        let title = &["error", "% of diagonal", "red: reaches beyond"];
        let note: &[&str] = match is_clipped {
            true => &["blue: falls short", "larger values:", "last colour"],
            false => &["blue: falls short"],
        };
        Bar { scale: Scale::errors(end), times: 100.0 / diagonal, title, note }
    }
}

/// A medial mesh in a strip.
#[derive(Clone, Debug)]
pub(crate) struct Panel<'a> {
    pub(crate) axis: &'a MedialMesh,
    pub(crate) caption: String,
    /// Its reconstruction, for the second row.
    pub(crate) errors: Option<Errors<'a>>,
}

/// Shared settings of the panels of a strip.
#[derive(Clone, Debug)]
pub(crate) struct Strip<'a> {
    /// The surface that the medial meshes are of: drawn as glass around them; it sets up the camera.
    pub(crate) surface: &'a TriMesh,
    /// Bounding-box diagonal of the surface, of which bars show percentages.
    pub(crate) diagonal: f64,
    pub(crate) camera: Camera,
    /// Width and height of a panel, without its caption.
    pub(crate) size: [usize; 2],
    /// Panels in a line.
    pub(crate) across: usize,
    pub(crate) background: Background,
    pub(crate) colour: ColourBy,
    /// The end of the scale of errors, in the unit of the surface; chosen from the errors without one.
    pub(crate) max_error: Option<f64>,
}

/// More pixels than this in one picture are rejected as implausible.
const MOST_PIXELS_OF_ALL: usize = 1 << 27;

/// Medial meshes next to each other: one panel each, its caption below. If any panel has errors, a second row shows the
/// reconstructions coloured by error, with missing parts as glass. Colours are on one scale along a row, which a bar at
/// its end shows.
pub(crate) fn strip<'a>(
    panels: &'a [Panel<'a>],
    strip: &'a Strip<'a>,
) -> Result<Picture, RenderError> {
    if panels.is_empty() {
        return Err(RenderError::Empty);
    }
    let frame = Frame::fit(&strip.camera, &strip.surface.vertices)?;
    let meshes: Vec<&MedialMesh> = panels.iter().map(|panel| panel.axis).collect();
    let (colour, bar) = strip.colour.of(&meshes, strip.diagonal);
    let lines = || panels.chunks(strip.across.max(1));
    let axis = |panel: &'a Panel<'a>| {
        let axis = Layer::Axis { mesh: panel.axis, colour };
        Some((vec![axis, Layer::Glass(strip.surface)], &*panel.caption))
    };
    let mut rows: Vec<PanelRow<'_>> = lines()
        .map(|some| PanelRow { cells: some.iter().map(axis).collect(), bar: None })
        .collect();
    // One bar explains all lines.
    rows[0].bar = bar;
    let errors: Vec<&Errors<'_>> = panels.iter().filter_map(|p| p.errors.as_ref()).collect();
    if !errors.is_empty() {
        let first = rows.len();
        let end = strip.max_error.unwrap_or_else(|| Errors::common_scale(&errors, strip.diagonal));
        // A panel without errors keeps its place empty: columns stay one medial mesh each.
        let error = |panel: &'a Panel<'a>| {
            let Errors { mesh, values, caption } = panel.errors.as_ref()?;
            let layer = Layer::Values { mesh, values, scale: Scale::errors(end) };
            Some((vec![layer, Layer::Ghost(strip.surface)], &**caption))
        };
        rows.extend(
            lines().map(|some| PanelRow { cells: some.iter().map(error).collect(), bar: None }),
        );
        rows[first].bar = Some(Errors::bar(&errors, end, strip.diagonal));
    }
    draw(rows, strip.size, strip.background, &frame)
}

/// Pixels of a line of captions below panels of a size: one line of text with some room below.
fn caption_height(size: [usize; 2]) -> usize {
    (LINE * letter_size(size) * 1.3).ceil() as usize
}

/// Where the parts of a [`strip`] with captions and errors are, in pixels from the top left corner.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct Layout {
    /// Width and height of the picture.
    pub(crate) whole: [usize; 2],
    /// Width and height of a panel, without its caption.
    pub(crate) panel: [usize; 2],
    /// Corners of the medial meshes and of their reconstructions.
    pub(crate) axes: Vec<[usize; 2]>,
    pub(crate) errors: Vec<[usize; 2]>,
    /// Left, top, width and height of the bars of radii and of errors.
    bars: [[usize; 4]; 2],
}

impl Layout {
    /// The layout of `count` panels, `across` in a line, each of `panel` pixels.
    pub(crate) fn of(count: usize, across: usize, panel: [usize; 2]) -> Self {
        let (lines, height) = (count.div_ceil(across), panel[1] + caption_height(panel));
        let (columns, bar) = (count.min(across), Bar::column(panel));
        let corner = |k: usize, first| [k % across * panel[0], (first + k / across) * height];
        Self {
            whole: [columns * panel[0] + bar, 2 * lines * height],
            panel,
            axes: (0..count).map(|k| corner(k, 0)).collect(),
            errors: (0..count).map(|k| corner(k, lines)).collect(),
            bars: [0, lines].map(|line| [columns * panel[0], line * height, bar, panel[1]]),
        }
    }
}

/// A row of panels: the layers and the caption of each, and the bar at the end.
pub(crate) struct PanelRow<'a> {
    pub(crate) cells: Vec<Option<(Vec<Layer<'a>>, &'a str)>>,
    pub(crate) bar: Option<Bar>,
}

/// Rows of panels of a size. Bars have a column at the right, and captions, if there are any, a line below each row.
pub(crate) fn draw(
    rows: Vec<PanelRow<'_>>,
    size: [usize; 2],
    background: Background,
    frame: &Frame,
) -> Result<Picture, RenderError> {
    let ([width, height], ink) = (size, background.ink());
    let letter = letter_size(size);
    let mut cells = rows.iter().flat_map(|row| row.cells.iter().flatten());
    let has_captions = cells.any(|(_, caption)| !caption.is_empty());
    let caption = if has_captions { caption_height(size) } else { 0 };
    let column = if rows.iter().any(|row| row.bar.is_some()) { Bar::column(size) } else { 0 };
    let columns = rows.iter().map(|row| row.cells.len()).max().unwrap_or(0);
    let whole = [columns * width + column, rows.len() * (height + caption)];
    if whole[0] * whole[1] > MOST_PIXELS_OF_ALL {
        return Err(RenderError::Size { width: whole[0], height: whole[1] });
    }
    let mut picture = Picture::blank(whole, background);
    for (index, row) in rows.into_iter().enumerate() {
        let top = index * (height + caption);
        for (k, cell) in row.cells.into_iter().enumerate() {
            let Some((layers, words)) = cell else { continue };
            let scene = Scene { layers, size, background };
            picture.paste(&scene.picture(frame)?, [k * width, top]);
            let words = fitted(words, letter, width as f64 - letter);
            let middle = (k as f64 + 0.5) * width as f64;
            let left = middle - 0.5 * text_width(&words, letter);
            picture.write([left, (top + height) as f64 + 1.3 * letter], &words, letter, ink);
        }
        if let Some(bar) = &row.bar {
            bar.draw(&mut picture, [columns * width, top], height, letter, ink);
        }
    }
    Ok(picture)
}
