//! Rasterisation: which facet is in front at each sample, and how much light comes from each pixel.
//!
//! 1. Corners are projected and snapped to 1/256 of a sample, so that the signs of edge functions are exact:
//!    two facets at a side never share a sample and never leave one out.
//! 2. The picture is cut into bands of rows, each facet listed in those that it reaches; bands run in
//!    parallel. Every sample sees the facets in the same order, so the picture is the same with any number of
//!    threads.
//! 3. In a band: the nearest facet of each sample (z-buffer), then glass, then the light of each pixel as
//!    the mean over its samples ([`PixelLight`]).

use rayon::prelude::*;

use super::camera::{Frame, Lens};
use super::colour::{Light, mix};
use super::facets::{Batch, Facet, Kind, Lines};
use super::shade::{LINE, Lamp, glass_opacity};

/// Samples along a side of a pixel.
pub(super) const SIDE: usize = 3;

/// Steps of a coordinate from one sample to the next.
const STEPS: i64 = 256;

/// Rows of pixels in a band: enough bands for all threads, few enough that most facets lie in one.
const BAND: usize = 16;

/// Facets that reach farther from the picture than this, in steps, are left out: edge functions must not
/// overflow.
const FARTHEST: f64 = (1 << 29) as f64;

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

/// A facet on the picture, its corners in clockwise order as seen there.
struct Placed {
    batch: u32,
    facet: u32,
    /// Whether corners 1 and 2 were exchanged.
    flipped: bool,
    at: [[i64; 2]; 3],
    nearness: [f64; 3],
    weights: [f64; 3],
}

impl Placed {
    fn new(lens: &Lens<'_>, ids: [u32; 2], facet: &Facet) -> Option<Self> {
        let mut at = [[0; 2]; 3];
        let mut nearness = [0.0; 3];
        let mut weights = [0.0; 3];
        for k in 0..3 {
            let projected = lens.project(facet.corners[k])?;
            for axis in 0..2 {
                let steps = projected.at[axis] * (SIDE as i64 * STEPS) as f64;
                if steps.is_nan() || steps.abs() >= FARTHEST {
                    return None;
                }
                // Rounded without a call: what is cut off is positive.
                at[k][axis] = (steps + FARTHEST + 0.5) as i64 - FARTHEST as i64;
            }
            (nearness[k], weights[k]) = (projected.nearness, projected.weight);
        }
        let mut placed =
            Self { batch: ids[0], facet: ids[1], flipped: false, at, nearness, weights };
        let area = placed.area();
        if area < 0 {
            placed.flipped = true;
            placed.at.swap(1, 2);
            placed.nearness.swap(1, 2);
            placed.weights.swap(1, 2);
        }
        (area != 0).then_some(placed)
    }

    /// Twice the area, in square steps.
    fn area(&self) -> i64 {
        let [a, b, c] = self.at;
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    }

    /// The first and the last sample row or column whose middle the corners may enclose, cut to a range.
    fn samples(&self, axis: usize, lo: usize, hi: usize) -> std::ops::Range<usize> {
        let along = self.at.map(|at| at[axis]);
        let least = along.iter().min().map_or(0, |&x| (x - STEPS / 2).div_euclid(STEPS));
        let most = along.iter().max().map_or(0, |&x| (x + STEPS / 2).div_euclid(STEPS));
        let cut = |x: i64| x.clamp(lo as i64, hi as i64) as usize;
        cut(least)..cut(most + 1)
    }

    /// Calls `hit` for each sample in a range of rows that is inside, with its column and nearness.
    fn scan(
        &self,
        rows: std::ops::Range<usize>,
        columns: usize,
        mut hit: impl FnMut(usize, usize, f64),
    ) {
        let sides = Sides::new(self);
        let (z0, zx, zy) = self.nearness_plane();
        let columns = self.samples(0, 0, columns);
        let [first, _] = middle(0, columns.start);
        for row in self.samples(1, rows.start, rows.end) {
            let [_, y] = middle(row, 0);
            let mut w = sides.inclusive(first, y);
            let z_row = z0 + zy * (y - self.at[0][1]) as f64;
            let mut entered = false;
            for column in columns.clone() {
                if (w[0] | w[1] | w[2]) >= 0 {
                    entered = true;
                    let [x, _] = middle(0, column);
                    hit(row, column, z_row + zx * (x - self.at[0][0]) as f64);
                } else if entered {
                    break;
                }
                for k in 0..3 {
                    w[k] += STEPS * sides.along_x[k];
                }
            }
        }
    }

    /// Nearness at corner 0, and its change for a step along x and y.
    fn nearness_plane(&self) -> (f64, f64, f64) {
        let [a, b, c] = self.at;
        let [u, v] = [b, c].map(|p| [(p[0] - a[0]) as f64, (p[1] - a[1]) as f64]);
        let [du, dv] = [1, 2].map(|k| self.nearness[k] - self.nearness[0]);
        let area = self.area() as f64;
        let zx = (du * v[1] - dv * u[1]) / area;
        let zy = (dv * u[0] - du * v[0]) / area;
        (self.nearness[0], zx, zy)
    }
}

/// Edge functions: positive on the inner side of a side, twice the area of it and the point.
struct Sides {
    along_x: [i64; 3],
    along_y: [i64; 3],
    at_origin: [i64; 3],
    /// 1 for sides whose own points belong to the facet beyond.
    excluded: [i64; 3],
}

impl Sides {
    fn new(placed: &Placed) -> Self {
        let mut sides =
            Self { along_x: [0; 3], along_y: [0; 3], at_origin: [0; 3], excluded: [0; 3] };
        for k in 0..3 {
            let (a, b) = (placed.at[k], placed.at[(k + 1) % 3]);
            let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
            sides.along_x[k] = -dy;
            sides.along_y[k] = dx;
            sides.at_origin[k] = dy * a[0] - dx * a[1];
            // Exactly one of a side and its reverse is included.
            sides.excluded[k] = i64::from(!(dy > 0 || (dy == 0 && dx > 0)));
        }
        sides
    }

    fn at(&self, x: i64, y: i64) -> [i64; 3] {
        std::array::from_fn(|k| self.at_origin[k] + self.along_x[k] * x + self.along_y[k] * y)
    }

    /// Not negative where the point belongs to the facet.
    fn inclusive(&self, x: i64, y: i64) -> [i64; 3] {
        let w = self.at(x, y);
        std::array::from_fn(|k| w[k] - self.excluded[k])
    }
}

/// What is asked of a facet again and again, at places on it in steps.
struct Within<'a> {
    placed: &'a Placed,
    facet: &'a Facet,
    sides: Sides,
}

impl<'a> Within<'a> {
    fn new(placed: &'a Placed, batches: &'a [Batch]) -> Self {
        let facet = &batches[placed.batch as usize].facets[placed.facet as usize];
        Self { placed, facet, sides: Sides::new(placed) }
    }

    /// Weights of the corners as they are stored in the facet; their sum is 1.
    fn weights(&self, [x, y]: [i64; 2]) -> [f64; 3] {
        let w = self.sides.at(x, y);
        // The corner across side k is corner k + 2.
        let mut weights: [f64; 3] =
            std::array::from_fn(|k| w[(k + 1) % 3] as f64 * self.placed.weights[k]);
        let sum: f64 = weights.iter().sum();
        weights = weights.map(|weight| weight / sum);
        if self.placed.flipped {
            weights.swap(1, 2);
        }
        weights
    }

    /// How large the edge functions are where lines end, for sides as they are placed; negative without a line.
    fn line_ends(&self, lines: Lines) -> [f64; 3] {
        let half = f64::from(lines.half_width) * (STEPS * SIDE as i64) as f64;
        std::array::from_fn(|k| {
            let stored = if self.placed.flipped { 2 - k } else { k };
            let (dx, dy) = (self.sides.along_y[k] as f64, self.sides.along_x[k] as f64);
            match self.facet.lines[stored] {
                0 => -1.0,
                width => half * f64::from(width) * (dx * dx + dy * dy).sqrt(),
            }
        })
    }

    fn is_on_line(&self, ends: &[f64; 3], [x, y]: [i64; 2]) -> bool {
        let w = self.sides.at(x, y);
        (0..3).any(|k| (w[k] as f64) < ends[k])
    }
}

/// The middle of a sample, in steps.
fn middle(row: usize, column: usize) -> [i64; 2] {
    [column, row].map(|k| STEPS * k as i64 + STEPS / 2)
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
