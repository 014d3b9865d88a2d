//! Rasterisation: which facet is in front at each sample, and how much light comes from each pixel.
//!
//! 1. Corners are projected and snapped to 1/256 of a sample, so that the signs of edge functions are exact:
//!    two facets at a side never share a sample and never leave one out (file `placed.rs`).
//! 2. The picture is cut into bands of rows, each facet listed in those that it reaches; bands run in
//!    parallel. Every sample sees the facets in the same order, so the picture is the same with any number of
//!    threads.
//! 3. In a band: the nearest facet of each sample (z-buffer), then glass, then the light of each pixel as
//!    the mean over its samples ([`PixelLight`]).

use rayon::prelude::*;

use super::camera::Frame;
use super::colour::{Light, mix};
use super::facets::{Batch, Kind};
use super::placed::{Placed, SIDE, Within, middle};
use super::shade::{LINE, Lamp, glass_opacity};

/// Rows of pixels in a band: enough bands for all threads, few enough that most facets lie in one.
const BAND: usize = 16;

/// No facet.
const NONE: u32 = u32::MAX;

/// What a pixel shows, as sums over its samples of light and of shares.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PixelLight {
    /// Light of what is not glass, after the glass in front of it.
    pub(super) solid: Light,
    /// Share of the pixel that this light comes from.
    pub(super) solid_share: f32,
    /// Share of the pixel that is glass.
    pub(super) glass_share: f32,
    /// Share that is covered by what is not glass.
    pub(super) covered: f32,
    /// Depth of what is not glass, in pixels; without meaning where nothing is covered.
    pub(super) depth: f32,
    /// Depth of the farthest of it.
    pub(super) farthest: f32,
}

/// Draws batches on a picture of this size: the light of every pixel, row by row.
pub(super) fn rasterise(batches: &[Batch], frame: &Frame, size: [usize; 2]) -> Vec<PixelLight> {
    let placed = place(batches, frame, size);
    let bands = size[1].div_ceil(BAND);
    let lists = list_by_band(&placed, bands, size[1]);
    let rows: Vec<Vec<PixelLight>> = (0..bands)
        .into_par_iter()
        .map(|band| {
            let top = band * BAND;
            let bottom = (top + BAND).min(size[1]);
            let list = &lists.facets[lists.start[band]..lists.start[band + 1]];
            let samples = Band::new(top, bottom, size[0]);
            samples.draw(batches, &placed, list, frame, frame.scale(size[0], size[1]))
        })
        .collect();
    rows.concat()
}

fn place(batches: &[Batch], frame: &Frame, size: [usize; 2]) -> Vec<Placed> {
    let mut all = Vec::new();
    let lens = frame.lens(size);
    for (id, batch) in batches.iter().enumerate() {
        let facets = batch.facets.par_iter().enumerate();
        all.par_extend(
            facets
                .filter_map(|(facet, shown)| Placed::new(&lens, [id as u32, facet as u32], shown)),
        );
    }
    all
}

/// For each band the facets that reach it, ascending.
struct Lists {
    start: Vec<usize>,
    facets: Vec<u32>,
}

fn list_by_band(placed: &[Placed], bands: usize, height: usize) -> Lists {
    let reach = |placed: &Placed| {
        let rows = placed.samples(1, 0, height * SIDE);
        let of = |row: usize| row / (BAND * SIDE);
        if rows.is_empty() { 0..0 } else { of(rows.start)..of(rows.end - 1) + 1 }
    };
    let mut start = vec![0; bands + 1];
    for band in placed.iter().flat_map(reach) {
        start[band + 1] += 1;
    }
    for band in 0..bands {
        start[band + 1] += start[band];
    }
    let mut next = start.clone();
    let mut facets = vec![0; start[bands]];
    for (id, facet) in placed.iter().enumerate() {
        for band in reach(facet) {
            facets[next[band]] = id as u32;
            next[band] += 1;
        }
    }
    Lists { start, facets }
}

/// The samples of a band of rows.
struct Band {
    rows: std::ops::Range<usize>,
    columns: usize,
    nearness: Vec<f64>,
    /// Which facet is in front.
    front: Vec<u32>,
    /// Share of light that glass in front lets through.
    through: Vec<f32>,
}

impl Band {
    fn new(top: usize, bottom: usize, width: usize) -> Self {
        let (rows, columns) = (top * SIDE..bottom * SIDE, width * SIDE);
        let count = rows.len() * columns;
        Self {
            rows,
            columns,
            nearness: vec![f64::NEG_INFINITY; count],
            front: vec![NONE; count],
            through: vec![1.0; count],
        }
    }

    fn draw(
        mut self,
        batches: &[Batch],
        placed: &[Placed],
        list: &[u32],
        frame: &Frame,
        scale: f64,
    ) -> Vec<PixelLight> {
        let is_glass = |id: u32| batches[placed[id as usize].batch as usize].kind != Kind::Solid;
        for &id in list.iter().filter(|&&id| !is_glass(id)) {
            self.bring_forward(&placed[id as usize], id);
        }
        // After all else is in place: glass behind it does not show.
        for &id in list.iter().filter(|&&id| is_glass(id)) {
            let facet = &placed[id as usize];
            self.lay_over(facet, batches);
        }
        let lit = Lit { batches, placed, frame, scale, lamp: Lamp::new(frame) };
        let pixels = self.columns / SIDE;
        let of_rows = (0..self.rows.len() / SIDE)
            .flat_map(|row| (0..pixels).map(move |column| (row, column)));
        of_rows.map(|(row, column)| self.pixel(row, column, &lit)).collect()
    }

    fn bring_forward(&mut self, facet: &Placed, id: u32) {
        let (top, columns) = (self.rows.start, self.columns);
        facet.scan(self.rows.clone(), columns, |row, column, nearness| {
            let sample = (row - top) * columns + column;
            if nearness > self.nearness[sample] {
                self.nearness[sample] = nearness;
                self.front[sample] = id;
            }
        });
    }

    fn lay_over(&mut self, placed: &Placed, batches: &[Batch]) {
        let (top, columns) = (self.rows.start, self.columns);
        let within = Within::new(placed, batches);
        let batch = &batches[placed.batch as usize];
        let only_alone = batch.kind == Kind::Ghost;
        let lines = batch.lines.filter(|_| within.facet.lines != [0; 3]);
        let lines = lines.map(|lines| (lines.opacity, within.line_ends(lines)));
        placed.scan(self.rows.clone(), columns, |row, column, nearness| {
            let sample = (row - top) * columns + column;
            let is_seen = match only_alone {
                true => self.front[sample] == NONE,
                false => nearness > self.nearness[sample],
            };
            if is_seen {
                let at = middle(row, column);
                let facing = weighted(&within.weights(at), within.facet.places);
                let line = match &lines {
                    Some((opacity, ends)) if within.is_on_line(ends, at) => *opacity,
                    _ => 0.0,
                };
                self.through[sample] *= 1.0 - glass_opacity(facing).max(line);
            }
        });
    }

    /// The light of a pixel, by its row and column in the band.
    fn pixel(&self, row: usize, column: usize, lit: &Lit<'_>) -> PixelLight {
        let mut sum = PixelLight { farthest: f32::NEG_INFINITY, ..PixelLight::default() };
        let mut parts = [Part::NONE; SIDE * SIDE];
        for k in 0..SIDE * SIDE {
            let (y, x) = (row * SIDE + k / SIDE, column * SIDE + k % SIDE);
            let sample = y * self.columns + x;
            let (id, through) = (self.front[sample], self.through[sample]);
            sum.glass_share += 1.0 - through;
            if id == NONE {
                continue;
            }
            if let Some(part) = parts.iter_mut().find(|part| part.id == id || part.id == NONE) {
                part.add(id, through, k);
            }
            let depth = (lit.scale * lit.frame.depth(self.nearness[sample])) as f32;
            sum.covered += 1.0;
            sum.depth += depth;
            sum.farthest = sum.farthest.max(depth);
        }
        let corner = [column * SIDE, self.rows.start + row * SIDE];
        for part in parts.iter().take_while(|part| part.id != NONE) {
            let light = lit.light(part, corner);
            sum.solid = std::array::from_fn(|c| sum.solid[c] + part.through * light[c]);
            sum.solid_share += part.through;
        }
        sum.mean()
    }
}

/// A facet's samples in a pixel. It is lit once, in their middle: only its outline and its lines need every sample.
#[derive(Clone, Copy)]
struct Part {
    id: u32,
    /// Light that glass lets through, as a sum.
    through: f32,
    /// Which samples, a bit for each.
    samples: u32,
}

impl Part {
    const NONE: Self = Self { id: NONE, through: 0.0, samples: 0 };

    fn add(&mut self, id: u32, through: f32, sample: usize) {
        self.id = id;
        self.through += through;
        self.samples |= 1 << sample;
    }

    fn count(&self) -> u32 {
        self.samples.count_ones()
    }

    /// The middles of the samples, in steps, from the column and row of the pixel's first one.
    fn places(&self, [column, row]: [usize; 2]) -> impl Iterator<Item = [i64; 2]> {
        let samples = self.samples;
        let taken = (0..SIDE * SIDE).filter(move |sample| samples >> sample & 1 == 1);
        taken.map(move |sample| middle(row + sample / SIDE, column + sample % SIDE))
    }

    /// Inside the facet, which is convex.
    fn middle(&self, corner: [usize; 2]) -> [i64; 2] {
        let sum = self.places(corner).fold([0; 2], |sum, at| [sum[0] + at[0], sum[1] + at[1]]);
        sum.map(|sum| sum / i64::from(self.count()))
    }
}

impl PixelLight {
    /// The mean from the sum over the samples of a pixel.
    fn mean(self) -> Self {
        let count = (SIDE * SIDE) as f32;
        Self {
            solid: self.solid.map(|light| light / count),
            solid_share: self.solid_share / count,
            glass_share: self.glass_share / count,
            covered: self.covered / count,
            depth: if self.covered > 0.0 { self.depth / self.covered } else { 0.0 },
            farthest: self.farthest,
        }
    }
}

/// What the light of a sample follows from.
struct Lit<'a> {
    batches: &'a [Batch],
    placed: &'a [Placed],
    frame: &'a Frame,
    /// Pixels for a unit.
    scale: f64,
    lamp: Lamp,
}

impl Lit<'_> {
    /// The light of a part of a pixel, which has its first sample at this column and row.
    fn light(&self, part: &Part, corner: [usize; 2]) -> Light {
        let placed = &self.placed[part.id as usize];
        let within = Within::new(placed, self.batches);
        let (batch, facet) = (&self.batches[placed.batch as usize], within.facet);
        let w = within.weights(part.middle(corner));
        let normal = w[0] * facet.normals[0] + w[1] * facet.normals[1] + w[2] * facet.normals[2];
        let light = self.lamp.shade(normal, batch.paint.at(weighted(&w, facet.places)));
        let Some(lines) = batch.lines.filter(|_| facet.lines != [0; 3]) else { return light };
        let ends = within.line_ends(lines);
        let on_line = part.places(corner).filter(|at| within.is_on_line(&ends, *at)).count();
        mix(light, LINE, lines.opacity * on_line as f32 / part.count() as f32)
    }
}

fn weighted(weights: &[f64; 3], values: [f32; 3]) -> f32 {
    weights.iter().zip(values).map(|(w, value)| *w as f32 * value).sum()
}
