//! Figures as SVG for papers, by plotters: one line and one marker for each method, the front as grey steps behind
//! them, the legend at the right of the data.
//!
//! The first colours are those of Okabe and Ito (2008, "Color universal design") without black and
//! yellow, which vanish on a dark or a light page, and with three of Paul Tol's that show on both. A
//! method keeps its colour and its marker in every figure of every report.

use std::error::Error;

use medial_run::error::FileError;
use medial_run::text::{grouped, printable, shortened};
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::axis::{Axis, Scale};
use super::{Curve, Figure, Point};

/// The backend draws at whole pixels: a large drawing keeps circles and slopes smooth at any size.
const WIDTH: i32 = 1280;
const HEIGHT: i32 = 800;
const LEGEND_ROW: i32 = 42;

const INK: RGBColor = RGBColor(0x20, 0x21, 0x24);
const GRID: RGBColor = RGBColor(0xE3, 0xE5, 0xE8);
const FRONT: RGBColor = RGBColor(0xD0, 0xD3, 0xD8);

const COLOURS: [u32; 14] = [
    0x0072B2, 0xD55E00, 0x009E73, 0xCC79A7, 0xE69F00, 0x56B4E9, 0xAA3377, 0x999933, 0x777777,
    0x8073AC, 0x44AA99, 0xA65628, 0xDC1C3C, 0x117733,
];

/// Markers by the page's names of symbols, and whether they are hollow.
const MARKERS: [(&str, bool); 11] = [
    ("circle", false),
    ("square", false),
    ("triangle", false),
    ("diamond", false),
    ("star", false),
    ("times", true),
    ("circle", true),
    ("square", true),
    ("plus", true),
    ("triangle", true),
    ("diamond", true),
];

/// Colour, symbol, and whether it is hollow, of a [style](super::styles). Fourteen colours and eleven markers repeat
/// together only after 154 styles.
pub(crate) fn symbol(style: usize) -> (String, &'static str, bool) {
    let (name, hollow) = MARKERS[style % MARKERS.len()];
    (format!("#{:06x}", COLOURS[style % COLOURS.len()]), name, hollow)
}

fn colour(style: usize) -> RGBColor {
    let [_, r, g, b] = COLOURS[style % COLOURS.len()].to_be_bytes();
    RGBColor(r, g, b)
}

/// The fonts that the texts of all figures name, the first one that is there.
const FONTS: &str = "Helvetica, Arial, sans-serif";

/// Any error of plotters: only writing can fail, and a text takes everything.
type Drawn = Result<(), Box<dyn Error>>;

fn font(size: i32, at: HPos) -> TextStyle<'static> {
    // The backend divides sizes by 1.24.
    let text = (FONTS, f64::from(size) * 1.24).into_font().color(&INK);
    text.pos(Pos::new(at, VPos::Center))
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

impl Figure {
    /// The figure as SVG, its series in these styles; `None` where there is no point to draw.
    pub(crate) fn to_svg(&self, styles: &[usize]) -> Result<Option<String>, FileError> {
        let points: Vec<&Point> = self.curves.iter().flat_map(|curve| &curve.points).collect();
        let x = Axis::fit(Scale::Log, points.iter().map(|point| point.x));
        let bars = points.iter().flat_map(|point| point.bar.into_iter().flatten());
        let y = Axis::fit(self.y.1, points.iter().map(|point| point.y).chain(bars));
        let (Some(x), Some(y)) = (x, y) else { return Ok(None) };
        let rows = self.curves.iter().filter(|curve| !curve.label.is_empty()).count() + 2;
        let size = (WIDTH as u32, HEIGHT.max(rows as i32 * LEGEND_ROW + 120) as u32);
        let mut svg = String::new();
        self.draw(x, y, styles, &SVGBackend::with_string(&mut svg, size).into_drawing_area())
            .map_err(|error| FileError(format!("plot: {error}")))?;
        Ok(Some(svg))
    }

    fn draw(&self, x: Axis, y: Axis, styles: &[usize], area: &Area<'_>) -> Drawn {
        area.fill(&WHITE)?; // dark viewers would swallow the ink
        let title = printable(&shortened(&self.title, 76));
        area.draw(&Text::new(title, (28, 40), font(30, HPos::Left)))?;
        let (_, below) = area.split_vertically(68);
        let longest = self.curves.iter().map(|curve| legend_text(curve).chars().count()).max();
        let legend_width = (88 + 14 * longest.unwrap_or(0).max(19) as i32).min(460);
        let (plot, legend) = below.split_horizontally(WIDTH - legend_width);
        let (x_ticks, y_ticks) = (x.ticks.len(), y.ticks.len());
        let mut chart = ChartBuilder::on(&plot)
            .margin_top(12)
            .margin_left(16)
            .margin_right(28)
            .margin_bottom(12)
            .x_label_area_size(88)
            .y_label_area_size(116)
            .build_cartesian_2d(x, y)?;
        chart
            .configure_mesh()
            .bold_line_style(GRID.stroke_width(2))
            .light_line_style(TRANSPARENT)
            .axis_style(INK.stroke_width(2))
            .set_all_tick_mark_size(8)
            .x_labels(x_ticks)
            .y_labels(y_ticks)
            .label_style((FONTS, 24.0 * 1.24).into_font().color(&INK))
            .axis_desc_style((FONTS, 26.0 * 1.24).into_font().color(&INK))
            .x_desc(&self.x)
            .y_desc(&self.y.0)
            .draw()?;
        let inner = chart.plotting_area().strip_coord_spec();
        // To the plot without its margins.
        let (left, top) = inner.get_base_pixel();
        let relative = |(x, y): (i32, i32)| (x - left, y - top);
        let front = self.front();
        // A result serves for every larger budget until the next one is better.
        let mut steps: Vec<(f64, f64)> = vec![];
        for point in &front {
            steps.extend(steps.last().map(|&(_, y)| (point.x, y)));
            steps.push((point.x, point.y));
        }
        chart.draw_series(LineSeries::new(steps, FRONT.stroke_width(12)))?;
        for curve in &self.curves {
            let style = styles[curve.series];
            let stroke = colour(style).stroke_width(4);
            let line: Vec<(f64, f64)> =
                curve.points.iter().map(|point| (point.x, point.y)).collect();
            if curve.dashed {
                let dashes = DashedLineSeries::new(line, 14, 10, stroke);
                chart.draw_series(dashes)?;
            } else {
                chart.draw_series(LineSeries::new(line, stroke))?;
            }
            // Enough to distinguish the curves without colour.
            for point in &curve.points {
                if let Some([low, high]) = point.bar {
                    let ends = vec![(point.x, low), (point.x, high)];
                    chart.draw_series([PathElement::new(ends, colour(style).stroke_width(2))])?;
                }
                let at = chart.backend_coord(&(point.x, point.y));
                draw_marker(&inner, style, relative(at))?; // above its own line
            }
        }
        let mut taken = Vec::new();
        for point in front {
            let Some(tag) = point.spheres.map(|spheres| grouped(spheres as u64)) else { continue };
            let at = relative(chart.backend_coord(&(point.x, point.y)));
            if let Some(at) = free_place(at, &tag, &mut taken) {
                inner.draw(&Text::new(tag, at, font(20, HPos::Left)))?;
            }
        }
        self.draw_legend(styles, &legend)?;
        Ok(area.present()?)
    }

    fn draw_legend(&self, styles: &[usize], area: &Area<'_>) -> Drawn {
        let mut y = 36;
        for curve in self.curves.iter().filter(|curve| !curve.label.is_empty()) {
            let style = styles[curve.series];
            let stroke = colour(style).stroke_width(4);
            // A dash on either side of the marker.
            let dashes = if curve.dashed { vec![(0, 10), (38, 48)] } else { vec![(0, 48)] };
            for (from, to) in dashes {
                area.draw(&PathElement::new(vec![(from, y), (to, y)], stroke))?;
            }
            draw_marker(area, style, (24, y))?;
            area.draw(&Text::new(legend_text(curve), (62, y), font(24, HPos::Left)))?;
            y += LEGEND_ROW; // unlabelled curves take no row
        }
        area.draw(&PathElement::new(vec![(0, y), (48, y)], FRONT.stroke_width(12)))?;
        let text = match self
            .curves
            .iter()
            .any(|curve| curve.points.iter().any(|p| p.spheres.is_some()))
        {
            true => "front, with spheres",
            false => "front",
        };
        area.draw(&Text::new(text, (62, y), font(24, HPos::Left)))?;
        Ok(())
    }
}

fn legend_text(curve: &Curve) -> String {
    printable(&shortened(&curve.label, 26))
}

/// A place for a tag next to a pixel that no other tag covers: at the right above or below, or at
/// the left. `None` where all are taken.
fn free_place((x, y): (i32, i32), tag: &str, taken: &mut Vec<[i32; 4]>) -> Option<(i32, i32)> {
    let (width, height) = (12 * tag.chars().count() as i32, 24);
    let aside = [x + 14, x - 14 - width];
    let places = aside.map(|left| [(left, y - 20), (left, y + 20)]);
    places.into_iter().flatten().find(|&(left, middle)| {
        let own = [left, middle - height / 2, left + width, middle + height / 2];
        let is_free = taken.iter().all(|other| {
            own[2] <= other[0] || other[2] <= own[0] || own[3] <= other[1] || other[3] <= own[1]
        });
        if is_free {
            taken.push(own);
        }
        is_free
    })
}

/// Draws the marker of a style around a pixel. Hollow ones hide the line beneath, so that they differ
/// from filled ones.
fn draw_marker(area: &Area<'_>, style: usize, (x, y): (i32, i32)) -> Drawn {
    let (colour, (name, hollow)) = (colour(style), MARKERS[style % MARKERS.len()]);
    let (stroke, fill) = (colour.stroke_width(4), if hollow { WHITE } else { colour });
    // Corners, the turn of the first one from the top as a share of a circle, radii of every other corner.
    let (corners, turn, radii) = match name {
        "triangle" => (3, 0.0, [10.0; 2]),
        "star" => (10, 0.0, [11.0, 5.0]),
        "square" => (4, 0.125, [10.0; 2]),
        "times" => (4, 0.125, [11.5; 2]),
        "circle" => (0, 0.0, [8.0; 2]),
        _ => (4, 0.0, [10.5; 2]), // diamond and plus
    };
    let corner = |k: usize| {
        let angle = std::f64::consts::TAU * (k as f64 / f64::from(corners) + turn);
        let [across, up] = [angle.sin(), angle.cos()].map(|part| (radii[k % 2] * part).round());
        (x + across as i32, y - up as i32)
    };
    match name {
        "circle" => [fill.filled(), stroke]
            .into_iter()
            .try_for_each(|style| area.draw(&Circle::new((x, y), 8, style))),
        // Opposite corners are the ends of a stroke.
        "times" | "plus" => [0, 1]
            .into_iter()
            .try_for_each(|k| area.draw(&PathElement::new(vec![corner(k), corner(k + 2)], stroke))),
        _ => {
            let outline: Vec<(i32, i32)> = (0..corners as usize).map(corner).collect();
            let closed = outline.iter().chain(&outline[..1]).copied().collect::<Vec<_>>();
            area.draw(&Polygon::new(outline, fill.filled()))
                .and_then(|()| area.draw(&PathElement::new(closed, stroke)))
        }
    }
    .map_err(Into::into)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn styles_differ() {
        let styles: std::collections::BTreeSet<_> = (0..154).map(symbol).collect();
        assert_eq!(styles.len(), 154);
    }

    #[test]
    fn tags_never_cover_each_other() {
        let mut taken = vec![];
        let places: Vec<_> = (0..5).map(|_| free_place((100, 100), "1,000", &mut taken)).collect();
        assert_eq!(places.iter().flatten().count(), 4, "{places:?}");
        assert_eq!(places[4], None);
    }
}
