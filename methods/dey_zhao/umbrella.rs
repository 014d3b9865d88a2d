//! Step 2: the umbrellas.

use std::ops::Range;

use medial::Vec3;
use medial::geometry::{CellId, Delaunay, Sphere, VertexId};
use rayon::prelude::*;
use wide::u32x4;

/// Cells per task.
const CHUNK: u32 = 1024;

/// A sample's number in the order of first cells: samples close in the triangulation are then close
/// in memory, for any order of the input.
pub(super) type Place = u32;

/// The umbrellas of all samples: about `p` the Delaunay triangles whose dual Voronoi edge has its
/// ends on both sides of the plane through `p` normal to the pole vector.
pub(super) struct Umbrellas {
    /// For each sample its place; never read for a sample that is not a vertex.
    places: Vec<Place>,
    positions: Vec<Vec3>,
    /// The triangles of sample `p` are those in `start[p]..start[p + 1]`, in the order of the cells.
    start: Vec<u32>,
    /// Unit normals, of either sign.
    normals: Vec<Vec3>,
    /// The corners next to the sample.
    rims: Vec<[Place; 2]>,
    /// Largest circumradius about each sample.
    largest: Vec<f64>,
    flat: usize,
}

impl Umbrellas {
    /// From the circumspheres of all finite cells. Cost `O(n)` in the number of cells; parallel, the
    /// same for any number of threads.
    pub fn new(delaunay: &Delaunay, spheres: &[Option<Sphere>]) -> Self {
        let places = Places::by_first_cell(delaunay);
        let samples = with_poles(delaunay, spheres, &places);
        let sides = sides_of_cells(spheres, places.corners, &samples);
        let cells = delaunay.finite_cell_count() as u32;
        let parts: Vec<Crossing> = (0..cells)
            .into_par_iter()
            .step_by(CHUNK as usize)
            .map(|first| first..cells.min(first + CHUNK))
            .map(|part| Crossing::of(delaunay, &sides, &samples, part))
            .collect();
        let positions = samples.into_iter().map(|sample| sample.position).collect();
        Self::of_triangles(places.of_sample, positions, &parts)
    }

    /// Groups the triangles by sample, with a counting sort.
    fn of_triangles(places: Vec<Place>, positions: Vec<Vec3>, parts: &[Crossing]) -> Self {
        let triangles = parts.iter().flat_map(|part| &part.triangles);
        // Starts are stored one entry further on. Filling advances each to the next start, so that at
        // the end every start is where it belongs.
        let mut start = vec![0_u32; positions.len() + 2];
        for triangle in triangles.clone() {
            for (k, p) in triangle.corners.into_iter().enumerate() {
                start[p as usize + 2] += u32::from(triangle.members >> k & 1);
            }
        }
        for p in 2..start.len() {
            start[p] += start[p - 1];
        }
        let all = start[positions.len() + 1] as usize;
        let mut normals = vec![Vec3::ZERO; all];
        let mut rims = vec![[0; 2]; all];
        let mut largest = vec![0.0; positions.len()];
        for triangle in triangles {
            let [a, b, c] = triangle.corners;
            for (k, (p, rim)) in [(a, [b, c]), (b, [c, a]), (c, [a, b])].into_iter().enumerate() {
                if triangle.members >> k & 1 == 0 {
                    continue;
                }
                let next = &mut start[p as usize + 1];
                (normals[*next as usize], rims[*next as usize]) = (triangle.normal, rim);
                *next += 1;
                largest[p as usize] = f64::max(largest[p as usize], triangle.circumradius);
            }
        }
        start.pop();
        let flat = parts.iter().map(|part| part.flat).sum();
        Self { places, positions, start, normals, rims, largest, flat }
    }

    /// The place of a vertex, which the other functions take.
    #[inline]
    pub fn place(&self, v: VertexId) -> Place {
        self.places[v.index()]
    }

    /// Where a sample is.
    #[inline]
    pub fn position(&self, p: Place) -> Vec3 {
        self.positions[p as usize]
    }

    /// The unit normals of a sample's triangles, of either sign.
    #[inline]
    pub fn normals(&self, p: Place) -> &[Vec3] {
        &self.normals[self.range(p)]
    }

    /// Whether `pq` is an edge of the umbrella of `p`.
    #[inline]
    pub fn has_edge(&self, p: Place, q: Place) -> bool {
        self.rims[self.range(p)].as_flattened().contains(&q)
    }

    /// Largest circumradius of an umbrella, 0 where it has no triangle.
    #[inline]
    pub fn largest_circumradius(&self, p: Place) -> f64 {
        self.largest[p as usize]
    }

    fn range(&self, p: Place) -> Range<usize> {
        self.start[p as usize] as usize..self.start[p as usize + 1] as usize
    }

    /// Samples without a triangle.
    pub fn missing(&self) -> usize {
        self.start.windows(2).filter(|range| range[0] == range[1]).count()
    }

    /// Triangles that were left out because they have no normal, once for each sample.
    pub fn flat(&self) -> usize {
        self.flat
    }
}

/// The places of all samples.
struct Places {
    of_sample: Vec<Place>,
    /// The sample of each place.
    samples: Vec<VertexId>,
    /// The corners of all cells.
    corners: Vec<[Place; 4]>,
}

impl Places {
    fn by_first_cell(delaunay: &Delaunay) -> Self {
        let mut of_sample = vec![NO_CORNER; delaunay.point_count()];
        let mut samples = Vec::with_capacity(delaunay.vertex_count());
        let mut corners: Vec<[Place; 4]> = Vec::with_capacity(delaunay.cell_count());
        for cell in delaunay.finite_cells() {
            let vertices = delaunay.vertices(cell);
            for v in vertices {
                if of_sample[v.index()] == NO_CORNER {
                    of_sample[v.index()] = samples.len() as Place;
                    samples.push(v);
                }
            }
            corners.push(vertices.map(|v| of_sample[v.index()]));
        }
        // The last is the vertex at infinity.
        corners.extend(delaunay.infinite_cells().map(|cell| {
            let [a, b, c, _] = delaunay.vertices(cell);
            let [a, b, c] = [a, b, c].map(|v| of_sample[v.index()]);
            [a, b, c, NO_CORNER]
        }));
        Self { of_sample, samples, corners }
    }
}

/// A sample with the vector to its pole, the farthest vertex of its Voronoi cell; of unit length
/// where that is at infinity, zero without a pole.
#[derive(Clone, Copy)]
struct Sample {
    position: Vec3,
    pole_vector: Vec3,
}

fn with_poles(
    delaunay: &Delaunay,
    spheres: &[Option<Sphere>],
    Places { of_sample, samples, corners }: &Places,
) -> Vec<Sample> {
    // First the reach of each Voronoi cell, without unpredictable branches.
    let mut reach = vec![f64::NEG_INFINITY; samples.len()];
    for (sphere, corners) in spheres.iter().zip(corners) {
        let Some(Sphere { radius, .. }) = *sphere else { continue };
        for &p in corners {
            reach[p as usize] = reach[p as usize].max(radius);
        }
    }
    let mut with_poles: Vec<Sample> = samples
        .iter()
        .map(|&v| Sample { position: delaunay.point(v), pole_vector: Vec3::ZERO })
        .collect();
    // Backwards, so that of equally far vertices the one of the smallest cell is written last.
    for (sphere, corners) in spheres.iter().zip(corners).rev() {
        let Some(Sphere { centre, radius }) = *sphere else { continue };
        for &p in corners {
            if radius == reach[p as usize] {
                let sample = &mut with_poles[p as usize];
                sample.pole_vector = centre - sample.position;
            }
        }
    }
    for (v, direction) in delaunay.unbounded_directions() {
        with_poles[of_sample[v.index()] as usize].pole_vector = direction;
    }
    with_poles
}

/// The corners of a cell as places. [`AHEAD`] is set for a corner if the cell's Voronoi vertex is on
/// the side of the corner's pole. The Voronoi edge between two cells crosses the plane of a common
/// corner if and only if their numbers for it differ in that bit. Four lanes compare this at once,
/// for any order of the corners.
type Sides = [u32; 4];

/// All places are smaller than this bit.
const AHEAD: u32 = 1 << 31;

/// Represents the vertex at infinity, and the corners of a cell whose Voronoi vertex is not
/// representable.
const NO_CORNER: u32 = AHEAD - 2;

/// The sides of all cells. The Voronoi vertex of an infinite cell is at infinity, outwards.
fn sides_of_cells(
    spheres: &[Option<Sphere>],
    corners: Vec<[Place; 4]>,
    samples: &[Sample],
) -> Vec<Sides> {
    let mut sides = corners;
    sides.par_iter_mut().zip(spheres).with_min_len(1024).for_each(|(sides, sphere)| match sphere {
        Some(Sphere { centre, .. }) => {
            *sides = sides.map(|p| {
                let Sample { position, pole_vector } = samples[p as usize];
                tagged(p, (*centre - position).dot(pole_vector))
            });
        }
        None => *sides = [NO_CORNER; 4],
    });
    for sides in &mut sides[spheres.len()..] {
        let [a, b, c, _] = *sides;
        let [p, q, r] = [a, b, c].map(|p| samples[p as usize].position);
        let outwards = (q - p).cross(r - p);
        let [a, b, c] = [a, b, c].map(|p| tagged(p, outwards.dot(samples[p as usize].pole_vector)));
        *sides = [a, b, c, NO_CORNER];
    }
    sides
}

/// A place, with [`AHEAD`] for a product with the pole vector that is not negative.
#[inline]
fn tagged(place: Place, product: f64) -> u32 {
    place | if product >= 0.0 { AHEAD } else { 0 }
}

/// A triangle of the umbrellas of some of its corners.
struct Triangle {
    corners: [Place; 3],
    /// One bit for each corner to whose umbrella it belongs.
    members: u8,
    normal: Vec3,
    circumradius: f64,
}

/// The triangles of the umbrellas from a part of the cells.
#[derive(Default)]
struct Crossing {
    triangles: Vec<Triangle>,
    flat: usize,
}

impl Crossing {
    /// The triangles from a range of at most [`CHUNK`] cells.
    fn of(delaunay: &Delaunay, sides: &[Sides], samples: &[Sample], cells: Range<u32>) -> Self {
        // Select crossing facets without branches, which would be unpredictable; then measure them.
        let first = cells.start;
        let mut facets = [0_u32; 4 * CHUNK as usize];
        let mut count = 0;
        for cell in cells {
            for (opposite, crossed) in (0..).zip(crossing(delaunay, sides, CellId(cell))) {
                facets[count] = (cell - first) << 8 | opposite << 4 | crossed;
                count += usize::from(crossed != 0);
            }
        }
        let mut part = Self { triangles: Vec::with_capacity(count), flat: 0 };
        for &facet in &facets[..count] {
            let sides = sides[(first + (facet >> 8)) as usize];
            let others = [1, 2, 3].map(|k| ((facet >> 4 & 15) as usize + k) % 4);
            let corners = others.map(|k| sides[k] & !AHEAD);
            let members = (0..3).fold(0, |bits, k| bits | ((facet >> others[k] & 1) as u8) << k);
            part.add(samples, corners, members);
        }
        part
    }

    #[inline]
    fn add(&mut self, samples: &[Sample], corners: [Place; 3], members: u8) {
        match measure(corners.map(|p| samples[p as usize].position)) {
            Some((normal, circumradius)) => {
                self.triangles.push(Triangle { corners, members, normal, circumradius });
            }
            None => self.flat += members.count_ones() as usize,
        }
    }
}

/// For the facet opposite to each vertex of a cell, one bit for each vertex to whose umbrella it
/// belongs. Empty if the other cell has the smaller id, which then reports the facet.
#[inline]
fn crossing(delaunay: &Delaunay, sides: &[Sides], cell: CellId) -> [u32; 4] {
    let here = u32x4::from(sides[cell.index()]) ^ u32x4::splat(AHEAD);
    delaunay.neighbours(cell).map(|other| {
        // Compared with itself, a cell crosses nothing: this replaces a branch.
        let other = if other > cell { other } else { cell };
        let there = sides[other.index()].map(|side| here.simd_eq(u32x4::splat(side)));
        ((there[0] | there[1]) | (there[2] | there[3])).to_bitmask()
    })
}

/// Unit normal and circumradius; `None` without area.
#[inline]
fn measure([a, b, c]: [Vec3; 3]) -> Option<(Vec3, f64)> {
    let (u, v) = (b - a, c - a);
    let normal = u.cross(v);
    let area = normal.length();
    // Two roots instead of three; these products overflow no earlier than the area.
    let sides = (u.length_squared() * v.length_squared()).sqrt() * (c - b).length();
    let circumradius = sides / (2.0 * area);
    (area > 0.0 && circumradius.is_finite()).then(|| (normal * area.recip(), circumradius))
}
