//! Rasterisation: which facet is in front at each sample, and how much light comes from each pixel.
//!
//! 1. Corners are projected and snapped to 1/256 of a sample, so that edge functions are integers and their signs exact:
//!    two facets at a side never share a sample and never leave one out.
//! 2. The picture is cut into bands of rows, each facet listed in those that it reaches. Bands run in parallel. Every
//!    sample sees the facets in the same order, so the picture is the same with any number of threads.
//! 3. In a band: the nearest facet of each sample (z-buffer), then glass, then the light of each pixel as the mean over
//!    its samples ([`PixelLight`]).

use std::ops::Range;

use medial::Vec3;
use rayon::prelude::*;

use super::camera::Frame;
use super::light::{LINE, Lamp, Light, Paint, PixelLight, glass_opacity, mix};

/// A triangle with the values that vary along it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facet {
    pub(super) corners: [Vec3; 3],
    /// Unit normals at the corners.
    pub(super) normals: [Vec3; 3],
    /// Places in the colour map, 0 to 1; of glass, how much a corner faces the eye.
    pub(super) places: [f32; 3],
    /// Width of the line along the sides, side `k` from corner `k` to `k + 1`, in line widths.
    pub(super) lines: [u8; 3],
}

/// Facets that look alike.
#[derive(Clone, Debug)]
pub(super) struct Batch {
    pub(super) facets: Vec<Facet>,
    pub(super) look: Look,
}

/// The look of a batch.
#[derive(Clone, Debug)]
pub(super) struct Look {
    pub(super) paint: Paint,
    /// Share of ink of the lines along sides, 0 to 1; the facets on both sides of one draw a half each.
    pub(super) ink: f32,
    pub(super) kind: Kind,
}

/// How a batch hides facets behind it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Wholly.
    Solid,
    /// Almost not.
    Glass,
    /// As glass, and seen only where nothing solid is, before or behind.
    Ghost,
}

/// Width of lines, as a share of the picture's shorter side, and the least in pixels.
const LINE_WIDTH: f64 = 0.0016;
const LEAST_LINE: f64 = 0.9;

/// Samples along a side of a pixel.
const SIDE: usize = 3;

/// Steps of a coordinate from one sample to the next.
const STEPS: i64 = 256;

/// Facets that reach farther from the picture than this, in steps, are left out: edge functions must not overflow.
const FARTHEST: f64 = (1 << 29) as f64;

/// Rows of pixels in a band: enough bands for all threads, few enough that most facets lie in one.
const BAND: usize = 16;

/// No facet.
const NONE: u32 = u32::MAX;

/// Draws batches on a picture of this size: the light of every pixel, row by row.
pub(super) fn rasterise(batches: Vec<Batch>, frame: &Frame, size: [usize; 2]) -> Vec<PixelLight> {
    let project = frame.projection(size);
    let mut facets: Vec<PlacedFacet> = Vec::new();
    let mut looks = Vec::new();
    for (id, Batch { facets: some, look }) in batches.into_iter().enumerate() {
        // An indexed iterator that is filtered keeps its order: facets of equal depth always meet in the same order.
        facets.par_extend(
            some.into_par_iter().filter_map(|f| PlacedFacet::new(&project, id as u32, f)),
        );
        looks.push(look); // by the number of its batch
    }
    let line = (LINE_WIDTH * size[0].min(size[1]) as f64).max(LEAST_LINE);
    let half_line = 0.5 * line * (STEPS * SIDE as i64) as f64;
    let lamp = Lamp::new(frame);
    let picture = FacetPicture { facets: &facets, looks: &looks, lamp, half_line };
    let rows: Vec<Vec<PixelLight>> = (by_band(&facets, size[1]).into_par_iter().enumerate())
        .map(|(band, list)| {
            // The last band is cut off at the lower edge of the picture.
            let rows = band * BAND * SIDE..((band + 1) * BAND).min(size[1]) * SIDE;
            let columns = size[0] * SIDE;
            let count = rows.len() * columns;
            let (front, through) = (vec![NONE; count], vec![1.0; count]);
            let nearness = vec![f64::NEG_INFINITY; count];
            Band { rows, columns, nearness, front, through }.draw(&picture, &list)
        })
        .collect();
    rows.concat()
}

/// For each band of a height the facets that reach it, ascending.
fn by_band(facets: &[PlacedFacet], height: usize) -> Vec<Vec<u32>> {
    let mut lists = vec![vec![]; height.div_ceil(BAND)];
    for (id, facet) in facets.iter().enumerate() {
        let rows = facet.samples(1, 0..height * SIDE);
        if !rows.is_empty() {
            let bands = rows.start / (BAND * SIDE)..=(rows.end - 1) / (BAND * SIDE);
            lists[bands].iter_mut().for_each(|list| list.push(id as u32));
        }
    }
    lists
}

/// Shared data of the bands.
struct FacetPicture<'a> {
    facets: &'a [PlacedFacet],
    looks: &'a [Look],
    lamp: Lamp,
    /// Half the width of a line of width 1, in steps.
    half_line: f64,
}

impl FacetPicture<'_> {
    fn look(&self, facet: &PlacedFacet) -> &Look {
        &self.looks[facet.batch as usize]
    }

    /// The light of a facet on some samples of a pixel, whose first sample is at this column and row. It is lit once,
    /// in their middle: only its outline and its lines need every sample.
    fn light(&self, share: &FacetShare, corner: [usize; 2]) -> Light {
        let placed = &self.facets[share.id as usize];
        let (look, sides, facet) = (self.look(placed), Sides::new(placed), &placed.facet);
        let sum = share.samples(corner).fold([0; 2], |sum, at| [sum[0] + at[0], sum[1] + at[1]]);
        let count = i64::from(share.mask.count_ones());
        let w = sides.weights(sum.map(|sum| sum / count));
        let normal = w[0] * facet.normals[0] + w[1] * facet.normals[1] + w[2] * facet.normals[2];
        let light = self.lamp.shade(normal, look.paint.at(weighted(&w, facet.places)));
        if look.ink <= 0.0 || facet.lines == [0; 3] {
            return light;
        }
        let ends = sides.line_ends(facet.lines, self.half_line);
        let on_line = share.samples(corner).filter(|at| sides.is_on_line(&ends, *at)).count();
        mix(light, LINE, look.ink * on_line as f32 / count as f32)
    }
}

fn weighted(weights: &[f64; 3], values: [f32; 3]) -> f32 {
    weights.iter().zip(values).map(|(w, value)| *w as f32 * value).sum()
}

/// The samples of a band of rows.
struct Band {
    rows: Range<usize>,
    columns: usize,
    nearness: Vec<f64>,
    /// Which facet is in front.
    front: Vec<u32>,
    /// Share of light that glass in front lets through.
    through: Vec<f32>,
}

impl Band {
    fn draw(mut self, picture: &FacetPicture<'_>, list: &[u32]) -> Vec<PixelLight> {
        let (solid, glass): (Vec<u32>, Vec<u32>) = (list.iter())
            .partition(|&&id| picture.look(&picture.facets[id as usize]).kind == Kind::Solid);
        for id in solid {
            self.bring_forward(&picture.facets[id as usize], id);
        }
        // Glass comes last: behind solid facets it does not show.
        for id in glass {
            self.lay_over(picture, &picture.facets[id as usize]);
        }
        let (rows, columns) = (self.rows.len() / SIDE, self.columns / SIDE);
        let pixels = (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
        pixels.map(|(row, column)| self.pixel(row, column, picture)).collect()
    }

    fn bring_forward(&mut self, facet: &PlacedFacet, id: u32) {
        let (top, columns) = (self.rows.start, self.columns);
        facet.scan(&Sides::new(facet), self.rows.clone(), columns, |row, column, nearness| {
            let sample = (row - top) * columns + column;
            if nearness > self.nearness[sample] {
                self.nearness[sample] = nearness;
                self.front[sample] = id; // of equal depth the first one stays
            }
        });
    }

    fn lay_over(&mut self, picture: &FacetPicture<'_>, facet: &PlacedFacet) {
        let (top, columns) = (self.rows.start, self.columns);
        let (look, sides) = (picture.look(facet), Sides::new(facet));
        let ends = sides.line_ends(facet.facet.lines, picture.half_line);
        facet.scan(&sides, self.rows.clone(), columns, |row, column, nearness| {
            let sample = (row - top) * columns + column;
            let is_seen = match look.kind {
                Kind::Ghost => self.front[sample] == NONE,
                _ => nearness > self.nearness[sample],
            };
            if is_seen {
                let at = middle(row, column);
                let line = if sides.is_on_line(&ends, at) { look.ink } else { 0.0 };
                let facing = weighted(&sides.weights(at), facet.facet.places);
                self.through[sample] *= 1.0 - glass_opacity(facing).max(line);
            }
        });
    }

    /// The light of a pixel, by its row and column in the band.
    fn pixel(&self, row: usize, column: usize, picture: &FacetPicture<'_>) -> PixelLight {
        let mut sum = PixelLight { farthest: f32::NEG_INFINITY, ..PixelLight::default() };
        let mut shares = [FacetShare { id: NONE, through: 0.0, mask: 0 }; SIDE * SIDE];
        for k in 0..SIDE * SIDE {
            let sample = (row * SIDE + k / SIDE) * self.columns + column * SIDE + k % SIDE;
            let (id, through) = (self.front[sample], self.through[sample]);
            sum.glass_share += 1.0 - through;
            if id == NONE {
                continue;
            }
            // As many shares as samples: there is always one that has this facet or none.
            if let Some(share) = shares.iter_mut().find(|share| share.id == id || share.id == NONE)
            {
                share.id = id;
                share.through += through;
                share.mask |= 1 << k;
            }
            let depth = -self.nearness[sample] as f32;
            sum.covered += 1.0; // also behind glass
            sum.depth += depth;
            sum.farthest = sum.farthest.max(depth);
        }
        let corner = [column * SIDE, self.rows.start + row * SIDE];
        for share in shares.iter().take_while(|share| share.id != NONE) {
            let light = picture.light(share, corner);
            sum.solid = std::array::from_fn(|c| sum.solid[c] + share.through * light[c]);
            sum.solid_share += share.through;
        }
        let count = (SIDE * SIDE) as f32;
        PixelLight {
            solid: sum.solid.map(|light| light / count),
            solid_share: sum.solid_share / count,
            glass_share: sum.glass_share / count,
            covered: sum.covered / count,
            depth: sum.depth / sum.covered.max(1.0),
            farthest: sum.farthest,
        }
    }
}

/// The samples of a pixel that show one facet.
#[derive(Clone, Copy)]
struct FacetShare {
    id: u32,
    /// Light that glass lets through, as a sum.
    through: f32,
    /// Which samples, a bit for each.
    mask: u32,
}

impl FacetShare {
    /// The middles of the samples, in steps, from the column and row of the pixel's first one.
    fn samples(&self, [column, row]: [usize; 2]) -> impl Iterator<Item = [i64; 2]> {
        let mask = self.mask;
        let taken = (0..SIDE * SIDE).filter(move |sample| mask >> sample & 1 == 1);
        taken.map(move |sample| middle(row + sample / SIDE, column + sample % SIDE))
    }
}

/// The middle of a sample, in steps.
fn middle(row: usize, column: usize) -> [i64; 2] {
    [column, row].map(|k| STEPS * k as i64 + STEPS / 2)
}

/// A facet on the picture, its corners in clockwise order as seen there.
struct PlacedFacet {
    batch: u32,
    at: [[i64; 2]; 3],
    nearness: [f64; 3],
    facet: Facet,
}

impl PlacedFacet {
    /// `None` for facets that are seen from their side, and for those far off the picture.
    fn new(project: &impl Fn(Vec3) -> [f64; 3], batch: u32, facet: Facet) -> Option<Self> {
        let projected = facet.corners.map(project);
        let mut at = [[0; 2]; 3];
        for k in 0..3 {
            for axis in 0..2 {
                let steps = projected[k][axis] * (SIDE as i64 * STEPS) as f64;
                if steps.is_nan() || steps.abs() >= FARTHEST {
                    return None;
                }
                // Rounded without a call: the number whose fraction is cut off is positive.
                at[k][axis] = (steps + FARTHEST + 0.5) as i64 - FARTHEST as i64;
            }
        }
        let nearness = projected.map(|p| p[2]);
        let mut placed = Self { batch, at, nearness, facet };
        let area = placed.area();
        if area < 0 {
            placed.at.swap(1, 2);
            placed.nearness.swap(1, 2);
            placed.facet.normals.swap(1, 2);
            placed.facet.places.swap(1, 2);
            // Side k lies between corners k and k + 1: the middle one stays.
            placed.facet.lines.swap(0, 2);
        }
        (area != 0).then_some(placed)
    }

    /// Twice the area, in square steps.
    fn area(&self) -> i64 {
        let [a, b, c] = self.at;
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    }

    /// The sample rows or columns whose middles the corners may enclose, cut to a range.
    fn samples(&self, axis: usize, range: Range<usize>) -> Range<usize> {
        let [a, b, c] = self.at.map(|at| at[axis]);
        // The middles lie half a step count inside their samples; one more on either side costs nothing, since the
        // edge functions decide.
        let least = (a.min(b).min(c) - STEPS / 2).div_euclid(STEPS);
        let most = (a.max(b).max(c) + STEPS / 2).div_euclid(STEPS);
        let [from, to] = [least, most + 1]
            .map(|sample| sample.clamp(range.start as i64, range.end as i64) as usize);
        from..to
    }

    /// Calls `hit` for each sample in a range of rows that is inside, with its column and nearness.
    fn scan(
        &self,
        sides: &Sides,
        rows: Range<usize>,
        columns: usize,
        mut hit: impl FnMut(usize, usize, f64),
    ) {
        // Nearness is a plane over the picture: at corner 0, and its change for a step along x and y.
        let [a, b, c] = self.at;
        let [u, v] = [b, c].map(|p| [(p[0] - a[0]) as f64, (p[1] - a[1]) as f64]);
        let [du, dv] = [1, 2].map(|k| self.nearness[k] - self.nearness[0]);
        let area = self.area() as f64;
        let zx = (du * v[1] - dv * u[1]) / area;
        let zy = (dv * u[0] - du * v[0]) / area;
        let columns = self.samples(0, 0..columns);
        for row in self.samples(1, rows) {
            let [first, y] = middle(row, columns.start);
            let mut w = sides.at([first, y]);
            for k in 0..3 {
                w[k] -= sides.excluded[k];
            }
            let z_row = self.nearness[0] + zy * (y - a[1]) as f64;
            let mut entered = false;
            for column in columns.clone() {
                // The sign bit of a disjunction is set if any of the three is negative.
                if (w[0] | w[1] | w[2]) >= 0 {
                    entered = true;
                    let [x, _] = middle(0, column);
                    hit(row, column, z_row + zx * (x - a[0]) as f64);
                } else if entered {
                    // A triangle is convex: a row leaves it once.
                    break;
                }
                for k in 0..3 {
                    w[k] += STEPS * sides.along_x[k];
                }
            }
        }
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
    fn new(facet: &PlacedFacet) -> Self {
        let zero = [0; 3];
        let mut sides = Self { along_x: zero, along_y: zero, at_origin: zero, excluded: zero };
        for k in 0..3 {
            let (a, b) = (facet.at[k], facet.at[(k + 1) % 3]);
            let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
            sides.along_x[k] = -dy;
            sides.along_y[k] = dx;
            sides.at_origin[k] = dy * a[0] - dx * a[1];
            // Exactly one of a side and its reverse is included: facets that share it share no sample.
            sides.excluded[k] = i64::from(!(dy > 0 || (dy == 0 && dx > 0)));
        }
        sides
    }

    fn at(&self, [x, y]: [i64; 2]) -> [i64; 3] {
        std::array::from_fn(|k| self.at_origin[k] + self.along_x[k] * x + self.along_y[k] * y)
    }

    /// Weights of the corners at a point; their sum is 1.
    fn weights(&self, at: [i64; 2]) -> [f64; 3] {
        let w = self.at(at).map(|w| w as f64);
        let sum = w[0] + w[1] + w[2];
        // Corner k lies across side k + 1.
        [w[1] / sum, w[2] / sum, w[0] / sum]
    }

    /// How large the edge functions are where lines of some widths end; negative without a line.
    fn line_ends(&self, widths: [u8; 3], half_line: f64) -> [f64; 3] {
        std::array::from_fn(|k| {
            // An edge function is the distance from the side times its length.
            let [x, y] = [self.along_x[k], self.along_y[k]].map(|along| along as f64);
            let length = (x * x + y * y).sqrt();
            if widths[k] == 0 { -1.0 } else { half_line * f64::from(widths[k]) * length }
        })
    }

    fn is_on_line(&self, ends: &[f64; 3], at: [i64; 2]) -> bool {
        let w = self.at(at);
        (0..3).any(|k| (w[k] as f64) < ends[k])
    }
}
