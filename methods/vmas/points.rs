//! The surface as points with areas, normals, tangent planes and adjacency.

use std::f64::consts::PI;

use medial::Vec3;
use medial::complex::Sphere;
use medial::geometry::trees::{Bounds, PointTree, morton_order};
use medial::surface::{Touched, TriMesh, sample_with_faces};
use rayon::prelude::*;
use wide::f64x4;

/// Consecutive points that are assigned to spheres together.
pub(super) const GROUP: usize = 64;

/// Constant that separates the random numbers from those of a judge with the same seed.
const STREAM: u64 = 0x766d_6173_5f70_7473;

/// A tangent plane of a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Plane {
    /// Outward unit normal `n_f`.
    pub normal: Vec3,
    /// The plane's part of the area of its point; the shares of a point add up to 1.
    pub share: f64,
}

/// The surface points along a Morton curve, so that a group of [`GROUP`] is small.
///
/// Points without area are left out: no error can belong to them.
#[derive(Clone, Debug)]
pub(super) struct SurfacePoints {
    pub positions: Vec<Vec3>,
    /// `a_v`, in squared diagonals.
    pub areas: Vec<f64>,
    /// Outward unit normals for shrinking balls; zero where the faces around a vertex cancel.
    pub normals: Vec<Vec3>,
    /// The planes of point `v` are `planes[first_plane[v]..first_plane[v + 1]]`.
    first_plane: Vec<u32>,
    planes: Vec<Plane>,
    /// Adjacent points, as ascending pairs in ascending order.
    pub links: Vec<[u32; 2]>,
    pub local: Locality,
    /// The point that came first: sample 0.
    pub first: u32,
    /// For the contacts of shrinking balls.
    pub nearest: PointTree,
    /// For each group a ball that holds its points.
    pub groups: Vec<Sphere>,
}

/// How points are adjacent.
#[derive(Clone, Debug)]
pub(super) enum Locality {
    /// Each point is adjacent to its `count` nearest ones, itself among them, listed one point after another.
    Nearest { count: usize, ids: Vec<u32> },
    /// Along the edges of the mesh.
    Edges,
}

/// A point of a surface with one tangent plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Oriented {
    pub position: Vec3,
    /// Outward unit normal.
    pub normal: Vec3,
    pub area: f64,
}

/// A point before it has its place on the curve.
struct Unplaced {
    position: Vec3,
    area: f64,
    normal: Vec3,
    planes: Vec<Plane>,
}

impl SurfacePoints {
    /// The points that a shrinking ball may touch.
    pub fn touched(&self) -> Touched<'_> {
        Touched::Points(&self.nearest, &self.positions)
    }

    /// Area-uniform samples; each has the area of its face, divided among the samples on it. A face
    /// without a sample loses its area.
    pub fn of_samples(mesh: &TriMesh, count: usize, seed: u64, neighbours: usize) -> Self {
        let samples = sample_with_faces(mesh, count, seed ^ STREAM);
        let mut on_face = vec![0_u32; mesh.faces.len()];
        samples.iter().for_each(|&(_, face)| on_face[face as usize] += 1);
        let oriented = samples.iter().map(|&(position, face)| {
            let face = face as usize;
            let vector = area_vector(mesh, face);
            let area = vector.length() / f64::from(on_face[face]);
            Oriented { position, normal: vector.normalize_or_zero(), area }
        });
        Self::of_oriented(&oriented.collect::<Vec<_>>(), neighbours)
    }

    /// Points with one tangent plane each, adjacent to `neighbours` nearest ones, themselves among them.
    pub fn of_oriented(oriented: &[Oriented], neighbours: usize) -> Self {
        let unplaced = oriented.iter().map(|&Oriented { position, normal, area }| Unplaced {
            position,
            area,
            normal,
            planes: vec![Plane { normal, share: 1.0 }],
        });
        let (mut points, _) = Self::placed(&unplaced.collect::<Vec<_>>());
        let count = neighbours.min(points.len());
        let ids = nearest(&points.positions, points.area(), count);
        points.links = links_of(&ids, count);
        points.local = Locality::Nearest { count, ids };
        points
    }

    /// The vertices; each has a third of the area of every face around it.
    pub fn of_vertices(mesh: &TriMesh) -> Self {
        let vectors: Vec<Vec3> =
            (0..mesh.faces.len()).map(|face| area_vector(mesh, face)).collect();
        let mut around = vec![Vec::new(); mesh.vertices.len()];
        for (face, corners) in mesh.faces.iter().enumerate() {
            // A face without area has no normal, and its plane would be undefined.
            for &corner in corners.iter().filter(|_| vectors[face] != Vec3::ZERO) {
                around[corner as usize].push(vectors[face]);
            }
        }
        let unplaced = mesh.vertices.iter().zip(&around).map(|(&position, vectors)| {
            let area: f64 = vectors.iter().map(|v| v.length()).sum();
            // Weighted by area, as the vectors are as long as their faces are large.
            let normal = vectors.iter().sum::<Vec3>().normalize_or_zero();
            let planes = vectors.iter().map(|vector| Plane {
                normal: vector.normalize_or_zero(),
                share: vector.length() / area,
            });
            Unplaced { position, area: area / 3.0, normal, planes: planes.collect() }
        });
        let (mut points, place_of) = Self::placed(&unplaced.collect::<Vec<_>>());
        let mut faces: Vec<[u32; 3]> =
            mesh.faces.iter().map(|face| face.map(|v| place_of[v as usize])).collect();
        // Faces whose corner is left out join no points.
        faces.retain(|face| !face.contains(&u32::MAX));
        points.links = sides_of(&faces);
        points
    }

    /// The points along the curve, without adjacency, and the place of each on it, `u32::MAX` where it is
    /// left out.
    fn placed(unplaced: &[Unplaced]) -> (Self, Vec<u32>) {
        let kept: Vec<u32> =
            (0..unplaced.len() as u32).filter(|&v| unplaced[v as usize].area > 0.0).collect();
        let positions: Vec<Vec3> = kept.iter().map(|&v| unplaced[v as usize].position).collect();
        let order: Vec<u32> =
            morton_order(&positions).iter().map(|&(_, k)| kept[k as usize]).collect();
        let mut place_of = vec![u32::MAX; unplaced.len()];
        (0..).zip(&order).for_each(|(place, &v)| place_of[v as usize] = place);
        let ordered = order.iter().map(|&v| &unplaced[v as usize]);
        let positions: Vec<Vec3> = ordered.clone().map(|point| point.position).collect();
        let mut first_plane = vec![0];
        let mut planes = Vec::new();
        for point in ordered.clone() {
            planes.extend_from_slice(&point.planes);
            first_plane.push(planes.len() as u32);
        }
        let groups: Vec<Sphere> = positions.chunks(GROUP).map(ball_around).collect();
        let points = Self {
            areas: ordered.clone().map(|point| point.area).collect(),
            normals: ordered.map(|point| point.normal).collect(),
            first_plane,
            planes,
            links: Vec::new(),
            local: Locality::Edges,
            first: kept.first().map_or(0, |&v| place_of[v as usize]),
            nearest: PointTree::new(&positions),
            groups,
            positions,
        };
        (points, place_of)
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// The tangent planes of a point.
    #[inline]
    pub fn planes(&self, v: usize) -> &[Plane] {
        &self.planes[self.first_plane[v] as usize..self.first_plane[v + 1] as usize]
    }

    /// The area of all points.
    fn area(&self) -> f64 {
        self.areas.iter().sum()
    }
}

/// The outward normal of a face, as long as its area.
pub(super) fn area_vector(mesh: &TriMesh, face: usize) -> Vec3 {
    let [a, b, c] = mesh.triangle(face);
    0.5 * (b - a).cross(c - a)
}

/// A ball that holds some points.
pub(super) fn ball_around(points: &[Vec3]) -> Sphere {
    let Bounds { lo, hi } = Bounds::of_points(points.iter().copied());
    let centre = 0.5 * (lo + hi);
    Sphere::new(centre, points.iter().map(|p| p.distance(centre)).fold(0.0, f64::max))
}

/// The sides of faces, as ascending pairs in ascending order.
fn sides_of(faces: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let sides = faces.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let mut links: Vec<_> = sides.map(|[a, b]| [a.min(b), a.max(b)]).collect();
    links.sort_unstable();
    links.dedup();
    links
}

/// A value of up to four things, and `none` in the lanes that are left.
#[inline]
pub(super) fn in_lanes<T>(four: &[T], none: f64, value: impl Fn(&T) -> f64) -> f64x4 {
    f64x4::new([0, 1, 2, 3].map(|k| four.get(k).map_or(none, &value)))
}

// ----------------------------------------------------------------------------
// The nearest samples of each sample.

/// Samples in the first disc that is searched, in wanted ones: rarely too few.
const AMPLE: f64 = 1.8;

/// The `count` nearest points of each point, itself among them, by distance and then id; listed one point
/// after another. There are at least `count` points, spread over so much area.
pub(super) fn nearest(points: &[Vec3], area: f64, count: usize) -> Vec<u32> {
    let tree = PointTree::new(points);
    let guess = AMPLE * count as f64 * area / (PI * points.len() as f64);
    let ids = points.par_iter().flat_map_iter(|&p| {
        let mut squared = guess.max(f64::MIN_POSITIVE);
        let mut near = tree.within(p, squared);
        // Ends, since there are at least `count` points.
        while near.len() < count {
            squared *= 2.0;
            near = tree.within(p, squared);
        }
        let mut near: Vec<(f64, u32)> =
            near.into_iter().map(|id| (points[id as usize].distance_squared(p), id)).collect();
        // Ties by id, so that the list does not depend on the order of the tree.
        near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        near.truncate(count);
        near.into_iter().map(|(_, id)| id)
    });
    ids.collect()
}

/// The pairs of points of which one is among the nearest of the other, ascending, in ascending order.
pub(super) fn links_of(nearest: &[u32], count: usize) -> Vec<[u32; 2]> {
    let mut links = Vec::with_capacity(nearest.len());
    for (v, list) in (0..).zip(nearest.chunks(count.max(1))) {
        links.extend(list.iter().filter(|&&w| w != v).map(|&w| [v.min(w), v.max(w)]));
    }
    links.par_sort_unstable();
    links.dedup();
    links
}
