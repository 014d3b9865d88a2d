//! Stacked bars: seconds by stage, one row for each method.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::plots::PlotError;
use crate::plots::axis::{Axis, Scale};
use crate::plots::figure::{RESOLUTION, at_half_size, font};
use crate::plots::palette::{GRID, INK, PAPER, STAGES};
use crate::text::{printable, shortened, significant};

const WIDTH: i32 = 640 * RESOLUTION;
const ROW: i32 = 26 * RESOLUTION;
const TOP: i32 = 66 * RESOLUTION;
const BOTTOM: i32 = 52 * RESOLUTION;
/// Room at the right for the totals.
const RIGHT: i32 = 70 * RESOLUTION;

/// Stacked bars before they are drawn.
pub(crate) struct Bars {
    pub(crate) title: String,
    /// Label, and seconds of substrate, prepare and simplify.
    pub(crate) rows: Vec<(String, [f64; 3])>,
}

impl Bars {
    /// The bars as SVG; `None` where there is none.
    pub(crate) fn to_svg(&self) -> Result<Option<String>, PlotError> {
        let totals = self.rows.iter().map(|(_, stages)| stages.iter().sum());
        let Some(axis) = Axis::fit("seconds, mean over the meshes", Scale::Linear, totals) else {
            return Ok(None);
        };
        let size = (WIDTH as u32, (TOP + BOTTOM + ROW * self.rows.len() as i32) as u32);
        let mut svg = String::new();
        self.draw(&axis, &SVGBackend::with_string(&mut svg, size).into_drawing_area())?;
        Ok(Some(at_half_size(&svg, size)))
    }

    fn draw<B: DrawingBackend>(
        &self,
        axis: &Axis,
        area: &DrawingArea<B, Shift>,
    ) -> Result<(), PlotError> {
        let failed = PlotError::new;
        area.fill(&PAPER).map_err(failed)?;
        let longest = self.rows.iter().map(|(label, _)| row_label(label).chars().count()).max();
        let left = RESOLUTION * (24 + 7 * longest.unwrap_or(0) as i32).clamp(70, 220);
        let place = |seconds: f64| {
            left + (axis.place(seconds) * f64::from(WIDTH - RIGHT - left)).round() as i32
        };
        let text = |size, h| font(size, INK).pos(Pos::new(h, VPos::Center));
        let write = |string: String, at: (i32, i32), style| {
            area.draw(&Text::new(string, at, style)).map_err(failed)
        };
        let title = printable(&shortened(&self.title, 76));
        write(title, (14 * RESOLUTION, 20 * RESOLUTION), text(15, HPos::Left))?;
        self.draw_legend(area, left)?;

        let end = TOP + ROW * self.rows.len() as i32;
        for &tick in &axis.ticks {
            let grid = vec![(place(tick), TOP), (place(tick), end)];
            area.draw(&PathElement::new(grid, GRID.stroke_width(RESOLUTION as u32)))
                .map_err(failed)?;
            write(Axis::label(tick), (place(tick), end + 12 * RESOLUTION), text(12, HPos::Center))?;
        }
        let middle = i32::midpoint(left, WIDTH - RIGHT);
        write(axis.title.clone(), (middle, end + 34 * RESOLUTION), text(13, HPos::Center))?;

        for (index, (label, stages)) in self.rows.iter().enumerate() {
            let top = TOP + ROW * index as i32;
            let centre = top + ROW / 2;
            write(row_label(label), (left - 8 * RESOLUTION, centre), text(12, HPos::Right))?;
            let mut done = 0.0;
            for (seconds, colour) in stages.iter().zip(STAGES) {
                let corners = [
                    (place(done), top + 4 * RESOLUTION),
                    (place(done + seconds), top + ROW - 4 * RESOLUTION),
                ];
                area.draw(&Rectangle::new(corners, colour.filled())).map_err(failed)?;
                done += seconds;
            }
            let total = format!("{} s", significant(done, 3));
            write(total, (place(done) + 6 * RESOLUTION, centre), text(12, HPos::Left))?;
        }
        let border = vec![(left, TOP), (left, end)];
        area.draw(&PathElement::new(border, INK.stroke_width(RESOLUTION as u32)))
            .map_err(failed)?;
        area.present().map_err(failed)
    }

    fn draw_legend<B: DrawingBackend>(
        &self,
        area: &DrawingArea<B, Shift>,
        left: i32,
    ) -> Result<(), PlotError> {
        let y = 46 * RESOLUTION;
        let mut x = left;
        for (name, colour) in ["substrate", "prepare", "simplify"].into_iter().zip(STAGES) {
            let swatch = [(x, y - 6 * RESOLUTION), (x + 12 * RESOLUTION, y + 6 * RESOLUTION)];
            area.draw(&Rectangle::new(swatch, colour.filled())).map_err(PlotError::new)?;
            let style = font(12, INK).pos(Pos::new(HPos::Left, VPos::Center));
            area.draw(&Text::new(name, (x + 18 * RESOLUTION, y), style)).map_err(PlotError::new)?;
            x += 100 * RESOLUTION;
        }
        Ok(())
    }
}

fn row_label(label: &str) -> String {
    printable(&shortened(label, 26))
}
