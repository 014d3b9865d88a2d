//! Step 2: the umbrellas.

use medial::Vec3;
use medial::geometry::{CellId, Delaunay, Pole, Sphere, VertexId, first_poles};
use rayon::prelude::*;

/// A triangle of the umbrellas of some of its corners.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    pub corners: [VertexId; 3],
    /// The corners, as bits, to whose umbrellas it belongs.
    members: u8,
    /// Unit normal, of either sign.
    pub normal: Vec3,
    circumradius: f64,
}

/// The umbrellas of all samples: about `p` the Delaunay triangles whose dual Voronoi edge has its
/// ends on both sides of the plane through `p` normal to the pole vector.
pub(super) struct Umbrellas {
    /// Each once, in the order of the cells.
    triangles: Vec<Triangle>,
    /// `of_sample[start[p]..start[p + 1]]` are the triangles of sample `p`.
    start: Vec<u32>,
    of_sample: Vec<u32>,
    /// Largest circumradius about each sample.
    largest: Vec<f64>,
    missing: usize,
    flat: usize,
}

impl Umbrellas {
    /// From the circumspheres of all finite cells. Cost `O(n)` in the number of cells; parallel, the
    /// same for any number of threads.
    pub fn new(delaunay: &Delaunay, spheres: &[Option<Sphere>]) -> Self {
        let pole_vectors = pole_vectors(delaunay, spheres);
        let ahead = corners_ahead(delaunay, spheres, &pole_vectors);
        let parts: Vec<(Vec<Triangle>, usize)> = (0..delaunay.finite_cell_count() as u32)
            .into_par_iter()
            .chunks(4096)
            .map(|cells| {
                let (mut found, mut flat) = (Vec::new(), 0);
                for cell in cells {
                    let cell = CellId(cell);
                    crossing(delaunay, &ahead, &pole_vectors, cell, &mut found, &mut flat);
                }
                (found, flat)
            })
            .collect();
        let flat = parts.iter().map(|part| part.1).sum();
        let triangles: Vec<Triangle> = parts.into_iter().flat_map(|part| part.0).collect();
        let (start, of_sample) = by_sample(&triangles, delaunay.point_count());
        let mut umbrellas = Self { triangles, start, of_sample, largest: vec![], missing: 0, flat };
        let samples = (0..delaunay.point_count() as u32).map(VertexId);
        let missing = |p: &VertexId| delaunay.is_vertex(*p) && umbrellas.of(*p).next().is_none();
        umbrellas.missing = samples.clone().filter(missing).count();
        let radii = |p| umbrellas.of(p).map(|triangle| triangle.circumradius);
        umbrellas.largest = samples.map(|p| radii(p).fold(0.0, f64::max)).collect();
        umbrellas
    }

    /// The umbrella of a sample.
    #[inline]
    pub fn of(&self, p: VertexId) -> impl Iterator<Item = &Triangle> {
        let range = self.start[p.index()] as usize..self.start[p.index() + 1] as usize;
        self.of_sample[range].iter().map(|&triangle| &self.triangles[triangle as usize])
    }

    /// Largest circumradius of an umbrella, 0 where it has no triangle.
    #[inline]
    pub fn largest_circumradius(&self, p: VertexId) -> f64 {
        self.largest[p.index()]
    }

    /// Samples without a triangle.
    pub fn missing(&self) -> usize {
        self.missing
    }

    /// Triangles that were left out because they have no normal, once for each sample.
    pub fn flat(&self) -> usize {
        self.flat
    }
}

/// The triangles of each sample by their indices, in their order: starts, and all lists.
fn by_sample(triangles: &[Triangle], samples: usize) -> (Vec<u32>, Vec<u32>) {
    // Shifted by one while the lists are filled, so that in the end each start is where it belongs.
    let mut start = vec![0_u32; samples + 2];
    let members = |t: &Triangle| {
        let (corners, members) = (t.corners, t.members);
        (0..3).filter(move |k| members >> k & 1 == 1).map(move |k| corners[k].index())
    };
    for p in triangles.iter().flat_map(members) {
        start[p + 2] += 1;
    }
    for p in 2..start.len() {
        start[p] += start[p - 1];
    }
    let mut lists = vec![0; start[start.len() - 1] as usize];
    for (index, triangle) in (0..).zip(triangles) {
        for p in members(triangle) {
            lists[start[p + 1] as usize] = index;
            start[p + 1] += 1;
        }
    }
    start.pop();
    (start, lists)
}

/// For each sample the vector to its pole; of any length where the pole is at infinity. Zero for
/// one without a pole.
fn pole_vectors(delaunay: &Delaunay, spheres: &[Option<Sphere>]) -> Vec<Vec3> {
    let vector = |(sample, pole): (usize, Option<Pole>)| match pole {
        Some(Pole::Vertex(cell)) => {
            let p = delaunay.point(VertexId(sample as u32));
            spheres[cell.index()].map_or(Vec3::ZERO, |sphere| sphere.centre - p)
        }
        Some(Pole::Infinite(direction)) => direction,
        None => Vec3::ZERO,
    };
    first_poles(delaunay, spheres).into_iter().enumerate().map(vector).collect()
}

/// In place of the corners of a cell whose Voronoi vertex is not representable.
const NO_VERTEX: u8 = 0xff;

/// For each finite cell the corners, as bits, to which its Voronoi vertex is on the pole's side, or
/// [`NO_VERTEX`].
fn corners_ahead(
    delaunay: &Delaunay,
    spheres: &[Option<Sphere>],
    pole_vectors: &[Vec3],
) -> Vec<u8> {
    let of_cell = |(cell, sphere): (usize, &Option<Sphere>)| {
        let Some(Sphere { centre, .. }) = *sphere else { return NO_VERTEX };
        let corners = delaunay.vertices(CellId(cell as u32)).into_iter().enumerate();
        corners.fold(0, |bits, (k, v)| {
            let ahead = (centre - delaunay.point(v)).dot(pole_vectors[v.index()]) >= 0.0;
            bits | u8::from(ahead) << k
        })
    };
    spheres.par_iter().enumerate().with_min_len(1024).map(of_cell).collect()
}

/// Adds the facets of a cell, each from its smaller cell, to the umbrellas that they belong to.
fn crossing(
    delaunay: &Delaunay,
    ahead: &[u8],
    pole_vectors: &[Vec3],
    cell: CellId,
    found: &mut Vec<Triangle>,
    flat: &mut usize,
) {
    let here = ahead[cell.index()];
    if here == NO_VERTEX {
        return;
    }
    let (vertices, neighbours) = (delaunay.vertices(cell), delaunay.neighbours(cell));
    for opposite in 0..4 {
        let other = neighbours[opposite];
        if other < cell {
            continue;
        }
        let places = [1, 2, 3].map(|k| (opposite + k) % 4);
        let facet = places.map(|k| vertices[k]);
        // Whether the other end is on the pole's side of each corner.
        let there = match ahead.get(other.index()) {
            Some(&NO_VERTEX) => continue,
            Some(&bits) => {
                let corners = delaunay.vertices(other);
                // Without branches: which corner is which cannot be foreseen.
                facet.map(|v| {
                    (0..4).fold(0, |bit, k| bit | u8::from(corners[k] == v) & bits >> k) & 1 == 1
                })
            }
            None => {
                let corners = facet.map(|v| delaunay.point(v));
                let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
                let inwards = delaunay.point(vertices[opposite]) - corners[0];
                let outwards = if normal.dot(inwards) > 0.0 { -normal } else { normal };
                facet.map(|v| outwards.dot(pole_vectors[v.index()]) >= 0.0)
            }
        };
        let crosses = |k: &usize| (here >> places[*k] & 1 == 1) != there[*k];
        let members = (0..3).filter(crosses).fold(0, |bits, k| bits | 1 << k);
        if members == 0 {
            continue;
        }
        match measure(facet.map(|v| delaunay.point(v))) {
            Some((normal, circumradius)) => {
                found.push(Triangle { corners: facet, members, normal, circumradius });
            }
            None => *flat += members.count_ones() as usize,
        }
    }
}

/// Unit normal and circumradius; `None` without area.
fn measure([a, b, c]: [Vec3; 3]) -> Option<(Vec3, f64)> {
    let (u, v) = (b - a, c - a);
    let normal = u.cross(v);
    let area = normal.length();
    let circumradius = u.length() * v.length() * (c - b).length() / (2.0 * area);
    (area > 0.0 && circumradius.is_finite()).then(|| (normal / area, circumradius))
}
