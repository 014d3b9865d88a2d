//! Step 2: the umbrellas.

use std::ops::Range;

use medial::Vec3;
use medial::geometry::{CellId, Delaunay, Sphere, VertexId};
use rayon::prelude::*;

/// Fewest cells of a task.
const TASK: usize = 1024;

/// The umbrellas of all samples: about `p` the Delaunay triangles whose dual Voronoi edge has its
/// ends on both sides of the plane through `p` normal to the pole vector.
pub(super) struct Umbrellas {
    /// The triangles of sample `p` are those in `start[p]..start[p + 1]`, in the order of the cells.
    start: Vec<u32>,
    /// Unit normals, of either sign.
    normals: Vec<Vec3>,
    /// The corners next to the sample.
    rims: Vec<[VertexId; 2]>,
    /// Largest circumradius about each sample.
    largest: Vec<f64>,
    /// Samples without a triangle; duplicates of others do not count.
    missing: usize,
    flat: usize,
}

impl Umbrellas {
    /// From the circumspheres of all finite cells. Cost `O(n)` in the number of cells; parallel, the
    /// same for any number of threads.
    pub fn new(delaunay: &Delaunay, spheres: &[Option<Sphere>]) -> Self {
        let poles = pole_vectors(delaunay, spheres);
        let cells = (0..spheres.len() as u32).into_par_iter().with_min_len(TASK);
        let triangles: Vec<Triangle> =
            cells.flat_map_iter(|cell| crossing(delaunay, spheres, &poles, CellId(cell))).collect();
        let mut umbrellas = Self::of_triangles(delaunay.point_count(), &triangles);
        let vertices = (0..delaunay.point_count() as u32).map(VertexId);
        let vertices = vertices.filter(|&v| delaunay.is_vertex(v));
        umbrellas.missing = vertices.filter(|&v| umbrellas.range(v).is_empty()).count();
        umbrellas
    }

    /// Groups the triangles by sample, with a counting sort.
    fn of_triangles(samples: usize, triangles: &[Triangle]) -> Self {
        // Starts are stored one entry further on. Filling advances each to the next start, so that at
        // the end every start is where it belongs.
        let mut start = vec![0_u32; samples + 2];
        let (with_area, flat): (Vec<&Triangle>, Vec<&Triangle>) =
            triangles.iter().partition(|triangle| triangle.shape.is_some());
        for (p, _) in with_area.iter().flat_map(|triangle| triangle.members()) {
            start[p.index() + 2] += 1;
        }
        for p in 2..start.len() {
            start[p] += start[p - 1];
        }
        let all = start[samples + 1] as usize;
        let (mut normals, mut rims) = (vec![Vec3::ZERO; all], vec![[VertexId(0); 2]; all]);
        let mut largest = vec![0.0; samples];
        for triangle in with_area {
            let (normal, circumradius) = triangle.shape.expect("it has an area");
            for (p, rim) in triangle.members() {
                let next = &mut start[p.index() + 1];
                (normals[*next as usize], rims[*next as usize]) = (normal, rim);
                *next += 1;
                largest[p.index()] = f64::max(largest[p.index()], circumradius);
            }
        }
        start.pop();
        let flat = flat.iter().map(|triangle| triangle.members().count()).sum();
        Self { start, normals, rims, largest, missing: 0, flat }
    }

    /// The unit normals of a sample's triangles, of either sign.
    #[inline]
    pub fn normals(&self, p: VertexId) -> &[Vec3] {
        &self.normals[self.range(p)]
    }

    /// Whether `pq` is an edge of the umbrella of `p`.
    #[inline]
    pub fn has_edge(&self, p: VertexId, q: VertexId) -> bool {
        self.rims[self.range(p)].as_flattened().contains(&q)
    }

    /// Largest circumradius of an umbrella, 0 where it has no triangle.
    #[inline]
    pub fn largest_circumradius(&self, p: VertexId) -> f64 {
        self.largest[p.index()]
    }

    fn range(&self, p: VertexId) -> Range<usize> {
        self.start[p.index()] as usize..self.start[p.index() + 1] as usize
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

/// For each sample the vector to its pole, the farthest vertex of its Voronoi cell; of unit length
/// where that is at infinity, zero without a pole.
fn pole_vectors(delaunay: &Delaunay, spheres: &[Option<Sphere>]) -> Vec<Vec3> {
    let mut farthest = vec![(f64::NEG_INFINITY, Vec3::ZERO); delaunay.point_count()];
    for (cell, sphere) in delaunay.finite_cells().zip(spheres) {
        let Some(Sphere { centre, radius }) = *sphere else { continue };
        for v in delaunay.vertices(cell) {
            // Of equally far vertices that of the smallest cell.
            if radius > farthest[v.index()].0 {
                farthest[v.index()] = (radius, centre - delaunay.point(v));
            }
        }
    }
    let mut vectors: Vec<Vec3> = farthest.into_iter().map(|(_, vector)| vector).collect();
    for (v, direction) in delaunay.unbounded_directions() {
        vectors[v.index()] = direction;
    }
    vectors
}

/// A triangle of the umbrellas of some of its corners.
struct Triangle {
    corners: [VertexId; 3],
    /// Whether it belongs to the umbrella of each corner.
    is_member: [bool; 3],
    /// Unit normal and circumradius; `None` without area.
    shape: Option<(Vec3, f64)>,
}

impl Triangle {
    /// The samples to whose umbrella it belongs, each with the other two corners.
    fn members(&self) -> impl Iterator<Item = (VertexId, [VertexId; 2])> {
        let [a, b, c] = self.corners;
        let members = [(a, [b, c]), (b, [c, a]), (c, [a, b])].into_iter().zip(self.is_member);
        members.filter_map(|(member, is_member)| is_member.then_some(member))
    }
}

/// The facets of a finite cell in some umbrella. The cell of the smaller id reports a facet.
fn crossing(
    delaunay: &Delaunay,
    spheres: &[Option<Sphere>],
    poles: &[Vec3],
    cell: CellId,
) -> impl Iterator<Item = Triangle> {
    let corners = delaunay.vertices(cell);
    let neighbours = (0..4).zip(delaunay.neighbours(cell));
    neighbours.filter_map(move |(opposite, other)| {
        let corners = [1, 2, 3].map(|k| corners[(opposite + k) % 4]);
        if other < cell {
            return None;
        }
        // A Voronoi vertex that is not representable is on no side.
        let Sphere { centre, .. } = spheres[cell.index()]?;
        let beyond = match spheres.get(other.index()) {
            Some(sphere) => Some((*sphere)?.centre),
            None => None,
        };
        let outwards = if beyond.is_none() { outwards(delaunay, other) } else { Vec3::ZERO };
        let is_member = corners.map(|p| {
            let (position, pole) = (delaunay.point(p), poles[p.index()]);
            let there = beyond.map_or(outwards, |beyond| beyond - position);
            ((centre - position).dot(pole) >= 0.0) != (there.dot(pole) >= 0.0)
        });
        is_member.contains(&true).then(|| {
            let shape = measure(corners.map(|p| delaunay.point(p)));
            Triangle { corners, is_member, shape }
        })
    })
}

/// The direction of the Voronoi vertex of an infinite cell, which is at infinity.
fn outwards(delaunay: &Delaunay, cell: CellId) -> Vec3 {
    let [a, b, c, _] = delaunay.vertices(cell);
    let [p, q, r] = [a, b, c].map(|v| delaunay.point(v));
    (q - p).cross(r - p)
}

/// Unit normal and circumradius; `None` without area.
fn measure([a, b, c]: [Vec3; 3]) -> Option<(Vec3, f64)> {
    let (u, v) = (b - a, c - a);
    let normal = u.cross(v);
    let area = normal.length();
    // Two roots instead of three; these products overflow no earlier than the area.
    let sides = (u.length_squared() * v.length_squared()).sqrt() * (c - b).length();
    let circumradius = sides / (2.0 * area);
    (area > 0.0 && circumradius.is_finite()).then(|| (normal * area.recip(), circumradius))
}
