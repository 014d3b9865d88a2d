//! The surface as points with areas, normals, tangent planes and adjacency.

use std::ops::Range;

use medial::Vec3;
use medial::complex::Sphere;
use medial::geometry::trees::{Bounds, morton_order};
use medial::surface::{TriMesh, sample_with_faces};

use super::nearest_point::PointGroups;
use super::neighbours::{links_of, nearest};

/// Consecutive points that are assigned to spheres together.
pub(super) const GROUP: usize = 64;

/// Makes the samples differ from those of a judge with the same seed.
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
    pub nearest: PointGroups,
    /// For each group a ball that holds its points.
    pub groups: Vec<Sphere>,
}

/// Where three points are mutually adjacent.
#[derive(Clone, Debug)]
pub(super) enum Locality {
    /// Each point is adjacent to so many nearest ones, itself among them, listed one point after another.
    Nearest { count: usize, ids: Vec<u32> },
    /// The faces of the mesh.
    Faces(Vec<[u32; 3]>),
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
    planes: Range<usize>,
}

impl SurfacePoints {
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

    /// Points with one tangent plane each, adjacent to so many nearest ones, themselves among them.
    pub fn of_oriented(oriented: &[Oriented], neighbours: usize) -> Self {
        let unplaced = oriented.iter().enumerate().map(|(place, point)| {
            let &Oriented { position, normal, area } = point;
            Unplaced { position, area, normal, planes: place..place + 1 }
        });
        let planes: Vec<_> =
            oriented.iter().map(|point| Plane { normal: point.normal, share: 1.0 }).collect();
        let (mut points, _) = Self::placed(&unplaced.collect::<Vec<_>>(), &planes);
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
            for &corner in corners.iter().filter(|_| vectors[face] != Vec3::ZERO) {
                around[corner as usize].push(vectors[face]);
            }
        }
        let (mut unplaced, mut planes) = (Vec::new(), Vec::new());
        for (&position, vectors) in mesh.vertices.iter().zip(&around) {
            let area: f64 = vectors.iter().map(|v| v.length()).sum();
            let normal = vectors.iter().sum::<Vec3>().normalize_or_zero();
            let before = planes.len();
            let plane =
                |v: &Vec3| Plane { normal: v.normalize_or_zero(), share: v.length() / area };
            planes.extend(vectors.iter().map(plane));
            unplaced.push(Unplaced {
                position,
                area: area / 3.0,
                normal,
                planes: before..planes.len(),
            });
        }
        let (mut points, place_of) = Self::placed(&unplaced, &planes);
        let place = |face: &[u32; 3]| face.map(|v| place_of[v as usize]);
        let mut faces: Vec<_> = mesh.faces.iter().map(place).collect();
        faces.retain(|face| !face.contains(&u32::MAX));
        points.links = sides_of(&faces);
        points.local = Locality::Faces(faces);
        points
    }

    /// The points along the curve, without adjacency, and the place of each on it, `u32::MAX` where it is
    /// left out.
    fn placed(unplaced: &[Unplaced], planes: &[Plane]) -> (Self, Vec<u32>) {
        let kept: Vec<u32> =
            (0..unplaced.len() as u32).filter(|&v| unplaced[v as usize].area > 0.0).collect();
        let positions: Vec<Vec3> = kept.iter().map(|&v| unplaced[v as usize].position).collect();
        let order: Vec<u32> =
            morton_order(&positions).iter().map(|&(_, k)| kept[k as usize]).collect();
        let mut place_of = vec![u32::MAX; unplaced.len()];
        (0..).zip(&order).for_each(|(place, &v)| place_of[v as usize] = place);
        let ordered = || order.iter().map(|&v| &unplaced[v as usize]);
        let positions: Vec<Vec3> = ordered().map(|point| point.position).collect();
        let mut first_plane = vec![0];
        let mut placed_planes = Vec::with_capacity(planes.len());
        for point in ordered() {
            placed_planes.extend_from_slice(&planes[point.planes.clone()]);
            first_plane.push(placed_planes.len() as u32);
        }
        let groups: Vec<Sphere> = positions.chunks(GROUP).map(ball_around).collect();
        let points = Self {
            areas: ordered().map(|point| point.area).collect(),
            normals: ordered().map(|point| point.normal).collect(),
            first_plane,
            planes: placed_planes,
            links: Vec::new(),
            local: Locality::Faces(Vec::new()),
            first: kept.first().map_or(0, |&v| place_of[v as usize]),
            nearest: PointGroups::new(&positions),
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
    let sides = |&[a, b, c]: &[u32; 3]| [[a, b], [b, c], [c, a]];
    let ascending = |[a, b]: [u32; 2]| [a.min(b), a.max(b)];
    let mut links: Vec<_> = faces.iter().flat_map(sides).map(ascending).collect();
    links.sort_unstable();
    links.dedup();
    links
}
