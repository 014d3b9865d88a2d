//! A figure with curves: one line and one marker for each method, the legend beside the data.

use plotters::backend::DrawingBackend;
use plotters::chart::{ChartBuilder, ChartContext};
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::plots::PlotError;
use crate::plots::axis::{Axis, Scale};
use crate::plots::palette::{GRID, INK, Marker, PAPER, style};
use crate::plots::points::{
    Drawing, Layout, Origin, describe, front, group_begin, group_end, with_groups,
};
use crate::text::{printable, shortened};

/// The backend draws at whole pixels: everything is drawn at twice its size and shown at half.
pub(crate) const RESOLUTION: i32 = 2;
const WIDTH: i32 = 640 * RESOLUTION;
const HEIGHT: i32 = 400 * RESOLUTION;
const LEGEND_ROW: i32 = 21 * RESOLUTION;

/// One method's points.
pub(crate) struct Curve {
    pub(crate) series: usize,
    /// Text of its row in the legend; none where it is empty.
    pub(crate) label: String,
    /// Name of the method, and what its points are of: a mesh, or a mean.
    pub(crate) name: String,
    pub(crate) of: String,
    /// In the order in which they are joined.
    pub(crate) points: Vec<(f64, f64)>,
    /// One for each point, as far as it is known.
    pub(crate) origins: Vec<Origin>,
    /// What is drawn instead of a line through the points, such as a fit.
    pub(crate) line: Option<Vec<(f64, f64)>>,
    /// Texts beside some points: index and text.
    pub(crate) tags: Vec<(usize, String)>,
    pub(crate) dashed: bool,
}

/// A figure before it is drawn.
pub(crate) struct Figure {
    pub(crate) title: String,
    pub(crate) x: (String, Scale),
    pub(crate) y: (String, Scale),
    pub(crate) curves: Vec<Curve>,
    /// Whether a line joins the points that no other one dominates.
    pub(crate) front: bool,
}

const FRONT: &str = "not dominated";

/// The fonts that the texts of all figures name, the first one that is there.
pub(crate) const FONTS: &str = "Helvetica, Arial, sans-serif";

/// Text of a size, in the font of all figures.
pub(crate) fn font(size: i32, colour: RGBColor) -> TextStyle<'static> {
    // The backend divides sizes by 1.24.
    (FONTS, f64::from(size * RESOLUTION) * 1.24).into_font().color(&colour)
}

impl Figure {
    /// The figure as SVG; `None` where there is no point to draw.
    pub(crate) fn to_svg(&self) -> Result<Option<Drawing>, PlotError> {
        let points = || self.curves.iter().flat_map(|curve| curve.points.iter().copied());
        let x = Axis::fit(self.x.0.as_str(), self.x.1, points().map(|point| point.0));
        let y = Axis::fit(self.y.0.as_str(), self.y.1, points().map(|point| point.1));
        let (Some(x), Some(y)) = (x, y) else { return Ok(None) };
        let rows = self.named().count() + usize::from(self.has_front());
        let legend = rows as i32 * LEGEND_ROW + 60 * RESOLUTION;
        let size = (WIDTH as u32, HEIGHT.max(legend) as u32);
        let mut svg = String::new();
        let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        let layout = self.draw(&x, &y, &area)?;
        drop(area);
        let points = describe(self, &x, &y, &layout);
        Ok(Some(Drawing { svg: with_groups(&at_half_size(&svg, size)), points }))
    }

    fn draw<B: DrawingBackend>(
        &self,
        x: &Axis,
        y: &Axis,
        area: &DrawingArea<B, Shift>,
    ) -> Result<Layout, PlotError> {
        let failed = PlotError::new;
        area.fill(&PAPER).map_err(failed)?;
        let title = font(15, INK).pos(Pos::new(HPos::Left, VPos::Center));
        let title_at = (14 * RESOLUTION, 20 * RESOLUTION);
        area.draw(&Text::new(printable(&shortened(&self.title, 76)), title_at, title))
            .map_err(failed)?;
        let (_, below) = area.split_vertically(34 * RESOLUTION);
        let (plot, legend) = below.split_horizontally(WIDTH - self.legend_width());
        let mut chart = ChartBuilder::on(&plot)
            .margin_top(6 * RESOLUTION)
            .margin_left(8 * RESOLUTION)
            .margin_right(14 * RESOLUTION)
            .margin_bottom(6 * RESOLUTION)
            .x_label_area_size(44 * RESOLUTION)
            .y_label_area_size(58 * RESOLUTION)
            .build_cartesian_2d(x.clone(), y.clone())
            .map_err(failed)?;
        begin(area, "axes", None)?;
        chart
            .configure_mesh()
            .bold_line_style(GRID.stroke_width(RESOLUTION as u32))
            .light_line_style(TRANSPARENT)
            .axis_style(INK.stroke_width(RESOLUTION as u32))
            .set_all_tick_mark_size(4 * RESOLUTION)
            .x_labels(x.ticks.len())
            .y_labels(y.ticks.len())
            .label_style(font(12, INK))
            .axis_desc_style(font(13, INK))
            .x_desc(&x.title)
            .y_desc(&y.title)
            .draw()
            .map_err(failed)?;
        end(area)?;
        let mut layout = Layout::default();
        let mut taken = Taken::default();
        for curve in &self.curves {
            draw_curve(&mut chart, curve, &mut taken)?;
            layout.curves.push(curve.points.iter().map(|p| chart.backend_coord(p)).collect());
        }
        self.draw_front(&mut chart)?;
        let (across, down) = chart.plotting_area().get_pixel_range();
        layout.area = [across.start, down.start, across.end, down.end];
        self.draw_legend(&legend)?;
        area.present().map_err(failed)?;
        Ok(layout)
    }

    fn has_front(&self) -> bool {
        self.front && front(&self.curves).len() > 1
    }

    /// A thin line through the points that no other one dominates, over the curves.
    fn draw_front<B: DrawingBackend>(
        &self,
        chart: &mut ChartContext<'_, B, Cartesian2d<Axis, Axis>>,
    ) -> Result<(), PlotError> {
        if !self.has_front() {
            return Ok(());
        }
        let points = front(&self.curves).into_iter();
        let points = points.map(|(curve, point)| self.curves[curve].points[point]);
        let area = chart.plotting_area().strip_coord_spec();
        begin(&area, "front", None)?;
        let line = INK.stroke_width(RESOLUTION as u32);
        chart.draw_series(LineSeries::new(points, line)).map_err(PlotError::new)?;
        end(&area)
    }

    /// The curves that the legend names.
    fn named(&self) -> impl Iterator<Item = &Curve> {
        self.curves.iter().filter(|curve| !curve.label.is_empty())
    }

    /// Wide enough for the longest label, as far as its width can be told without a font.
    fn legend_width(&self) -> i32 {
        let front = if self.has_front() { FRONT.len() } else { 0 };
        let longest = self.curves.iter().map(|curve| legend_text(curve).chars().count()).max();
        RESOLUTION * (44 + 7 * longest.unwrap_or(0).max(front) as i32).clamp(90, 230)
    }

    fn draw_legend<B: DrawingBackend>(
        &self,
        area: &DrawingArea<B, Shift>,
    ) -> Result<(), PlotError> {
        for (row, curve) in self.named().enumerate() {
            let y = 18 * RESOLUTION + row as i32 * LEGEND_ROW;
            let (colour, marker) = style(curve.series);
            begin(area, "legend", Some(curve.series))?;
            let dashes: &[(i32, i32)] = if curve.dashed { &[(0, 5), (19, 24)] } else { &[(0, 24)] };
            for (from, to) in dashes {
                let line = vec![(from * RESOLUTION, y), (to * RESOLUTION, y)];
                area.draw(&PathElement::new(line, colour.stroke_width(2 * RESOLUTION as u32)))
                    .map_err(PlotError::new)?;
            }
            for shape in shapes::<B>(marker, (12 * RESOLUTION, y), colour) {
                area.draw(&shape).map_err(PlotError::new)?;
            }
            let text = font(12, INK).pos(Pos::new(HPos::Left, VPos::Center));
            area.draw(&Text::new(legend_text(curve), (31 * RESOLUTION, y), text))
                .map_err(PlotError::new)?;
            end(area)?;
        }
        if self.has_front() {
            let y = 18 * RESOLUTION + self.named().count() as i32 * LEGEND_ROW;
            let line = vec![(0, y), (24 * RESOLUTION, y)];
            area.draw(&PathElement::new(line, INK.stroke_width(RESOLUTION as u32)))
                .map_err(PlotError::new)?;
            let text = font(12, INK).pos(Pos::new(HPos::Left, VPos::Center));
            area.draw(&Text::new(FRONT, (31 * RESOLUTION, y), text)).map_err(PlotError::new)?;
        }
        Ok(())
    }
}

fn legend_text(curve: &Curve) -> String {
    printable(&shortened(&curve.label, 26))
}

fn draw_curve<B: DrawingBackend>(
    chart: &mut ChartContext<'_, B, Cartesian2d<Axis, Axis>>,
    curve: &Curve,
    taken: &mut Taken,
) -> Result<(), PlotError> {
    let (colour, marker) = style(curve.series);
    let line = colour.stroke_width(2 * RESOLUTION as u32);
    let area = chart.plotting_area().strip_coord_spec();
    begin(&area, "line", Some(curve.series))?;
    let points = curve.line.as_ref().unwrap_or(&curve.points).iter().copied();
    if curve.dashed {
        let dashes = DashedLineSeries::new(points, 7 * RESOLUTION, 5 * RESOLUTION, line);
        chart.draw_series(dashes).map_err(PlotError::new)?;
    } else {
        chart.draw_series(LineSeries::new(points, line)).map_err(PlotError::new)?;
    }
    end(&area)?;
    let origin = area.get_base_pixel();
    let pixel = |point: &(f64, f64)| {
        let (x, y) = chart.backend_coord(point);
        (x - origin.0, y - origin.1)
    };
    begin(&area, "marks", Some(curve.series))?;
    for point in &curve.points {
        begin(&area, "mark", None)?;
        for shape in shapes::<B>(marker, pixel(point), colour) {
            area.draw(&shape).map_err(PlotError::new)?;
        }
        end(&area)?;
    }
    end(&area)?;
    if curve.tags.is_empty() {
        return Ok(());
    }
    begin(&area, "tags", Some(curve.series))?;
    for (index, tag) in &curve.tags {
        let Some(point) = curve.points.get(*index) else { continue };
        let Some(at) = taken.place(pixel(point), tag) else { continue };
        let text = font(10, INK).pos(Pos::new(HPos::Left, VPos::Bottom));
        area.draw(&Text::new(tag.clone(), at, text)).map_err(PlotError::new)?;
    }
    end(&area)
}

/// Where tags stand, so that no two lie upon each other.
#[derive(Default)]
struct Taken(Vec<[i32; 4]>);

impl Taken {
    /// A place beside a pixel, lower left: to the right above or below, or to the left; `None` if all are taken. What
    /// is not written the pointer still tells.
    fn place(&mut self, (x, y): (i32, i32), tag: &str) -> Option<(i32, i32)> {
        let (width, height) = (RESOLUTION * 6 * tag.chars().count() as i32, RESOLUTION * 12);
        let aside = 7 * RESOLUTION;
        let [above, below] = [y - 4 * RESOLUTION, y + 4 * RESOLUTION + height];
        let places = [
            (x + aside, above),
            (x + aside, below),
            (x - aside - width, above),
            (x - aside - width, below),
        ];
        places.into_iter().find(|&(left, bottom)| {
            let own = [left, bottom - height, left + width, bottom];
            let is_free = self.0.iter().all(|other| {
                own[2] <= other[0] || other[2] <= own[0] || own[3] <= other[1] || other[3] <= own[1]
            });
            if is_free {
                self.0.push(own);
            }
            is_free
        })
    }
}

/// Begins a group of what is drawn next.
fn begin<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    class: &str,
    series: Option<usize>,
) -> Result<(), PlotError> {
    area.draw(&Text::new(group_begin(class, series), (0, 0), font(1, INK))).map_err(PlotError::new)
}

/// Ends the group that began last.
fn end<B: DrawingBackend>(area: &DrawingArea<B, Shift>) -> Result<(), PlotError> {
    area.draw(&Text::new(group_end(), (0, 0), font(1, INK))).map_err(PlotError::new)
}

/// A marker as lines and polygons around a pixel.
fn shapes<B: DrawingBackend>(
    marker: Marker,
    (x, y): (i32, i32),
    colour: RGBColor,
) -> Vec<DynElement<'static, B, (i32, i32)>> {
    let r = 4 * RESOLUTION;
    let thick = colour.stroke_width(2 * RESOLUTION as u32);
    let path = |points: &[(i32, i32)]| -> Vec<(i32, i32)> {
        points.iter().map(|&(a, b)| (x + a * r / 4, y + b * r / 4)).collect()
    };
    let square = [(-4, -4), (4, -4), (4, 4), (-4, 4), (-4, -4)];
    let triangle = [(0, -5), (5, 4), (-5, 4), (0, -5)];
    let diamond = [(0, -6), (6, 0), (0, 6), (-6, 0), (0, -6)];
    let down = [(0, 5), (5, -4), (-5, -4), (0, 5)];
    let filled = |points: &[(i32, i32)]| Polygon::new(path(points), colour.filled()).into_dyn();
    // Hollow markers hide the line beneath, so that they do not look like filled ones.
    let hollow = |points: &[(i32, i32)]| {
        vec![
            Polygon::new(path(points), PAPER.filled()).into_dyn(),
            PathElement::new(path(points), thick).into_dyn(),
        ]
    };
    let stroke = |points: &[(i32, i32)]| PathElement::new(path(points), thick).into_dyn();
    match marker {
        Marker::Disc => vec![Circle::new((x, y), r, colour.filled()).into_dyn()],
        Marker::Ring => vec![
            Circle::new((x, y), r, PAPER.filled()).into_dyn(),
            Circle::new((x, y), r, thick).into_dyn(),
        ],
        Marker::Square => vec![filled(&square)],
        Marker::Triangle => vec![filled(&triangle)],
        Marker::Diamond => vec![filled(&diamond)],
        Marker::Down => vec![filled(&down)],
        Marker::Box => hollow(&square),
        Marker::Delta => hollow(&triangle),
        Marker::Lozenge => hollow(&diamond),
        Marker::Cross => vec![stroke(&[(-5, -5), (5, 5)]), stroke(&[(-5, 5), (5, -5)])],
        Marker::Plus => vec![stroke(&[(-6, 0), (6, 0)]), stroke(&[(0, -6), (0, 6)])],
    }
}

/// The same drawing, shown at half of the size that it was drawn at.
pub(crate) fn at_half_size(svg: &str, (width, height): (u32, u32)) -> String {
    let scale = RESOLUTION as u32;
    let drawn = format!("width=\"{width}\" height=\"{height}\"");
    let shown = format!("width=\"{}\" height=\"{}\"", width / scale, height / scale);
    svg.replacen(&drawn, &shown, 1)
}
