//! The Voronoi medial mesh: the part of the Voronoi diagram of boundary samples inside the surface.
//!
//! Amenta, Bern: *Surface reconstruction by Voronoi filtering*, SoCG 1998,
//! doi:10.1145/276884.276889, without the filtering by poles; the initial mesh of Q-MAT.
//!
//! 1. Each finite Delaunay cell whose circumcentre lies inside the surface is a medial sphere that
//!    touches the four samples of the cell ([`CellSpheres`]).
//! 2. Each facet between two such cells is a medial edge.
//! 3. Each Delaunay edge all of whose cells are finite and inside has a convex planar Voronoi
//!    polygon, which is triangulated ([`DualTriangulation`]).
//!
//! Coincident circumcentres are not merged: merging by position can close loops, and the published
//! counts are those without merging.

use std::sync::Arc;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use spade::{DelaunayTriangulation, Point2, Triangulation as _};

use crate::Vec3;
use crate::complex::{Contacts, MedialMesh, Sphere, VoronoiFacets};
use crate::geometry::trees::morton_order;
use crate::geometry::{CellId, Delaunay};
use crate::surface::TriangleBvh;
use crate::surface::{InsideTest, Side};

/// Circumcentres closer to the surface than this count as outside, in units of the diagonal.
const GUARD_BAND: f64 = 1e-9;

/// How a dual Voronoi polygon is cut into triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DualTriangulation {
    /// A fan from one vertex, as published: from that of the smallest number. Spheres are numbered
    /// along a curve through their centres, so the numbering of the samples matters only to centres
    /// that coincide.
    #[default]
    Fan,
    /// The planar Delaunay triangulation: larger smallest angles.
    Delaunay,
}

/// The circumspheres of the finite Delaunay cells, and which are centred inside the surface.
pub struct CellSpheres {
    /// Circumsphere of each finite cell; `None` where it is not representable.
    circumspheres: Vec<Option<Sphere>>,
    /// For each finite cell.
    is_inside: Vec<bool>,
    /// The cells centred inside, along a Morton curve of their centres: neighbours are then close in
    /// memory, which speeds up contractions.
    kept: Vec<CellId>,
    /// Circumcentres inside the surface but within the guard band of it, counted as outside.
    pub in_guard_band: usize,
}

impl CellSpheres {
    /// Computes and classifies the circumcentre of every finite cell, in parallel.
    pub fn classify(delaunay: &Delaunay, inside: &InsideTest, surface: &TriangleBvh) -> Self {
        let circumspheres = delaunay.circumspheres();
        let centres: Vec<Vec3> = circumspheres.iter().flatten().map(|s| s.centre).collect();
        let sides = inside.sides(&centres);
        let near: Vec<bool> = centres
            .par_iter()
            .zip(&sides)
            .map(|(&c, &side)| side == Side::Inside && surface.any_within(c, GUARD_BAND))
            .collect();
        let mut verdicts = sides.iter().zip(&near);
        let inside = |(&side, &near): (&Side, &bool)| side == Side::Inside && !near;
        let is_inside: Vec<bool> = circumspheres
            .iter()
            .map(|sphere| sphere.is_some() && verdicts.next().is_some_and(inside))
            .collect();
        let in_guard_band = near.iter().filter(|&&near| near).count();
        let cells = delaunay.triangulation().finite_cells().zip(&circumspheres);
        let (cells, centres): (Vec<CellId>, Vec<Vec3>) = cells
            .filter(|(cell, _)| is_inside[cell.index()])
            .filter_map(|(cell, sphere)| Some((cell, sphere.as_ref()?.centre)))
            .unzip();
        let kept = morton_order(&centres).into_iter().map(|(_, i)| cells[i as usize]).collect();
        Self { circumspheres, is_inside, kept, in_guard_band }
    }

    /// The circumspheres of all finite cells, those centred outside included, see
    /// [`Delaunay::circumspheres`].
    pub fn circumspheres(&self) -> &[Option<Sphere>] {
        &self.circumspheres
    }

    /// The spheres that are centred inside, in the order of the Voronoi medial mesh.
    fn inner_spheres(&self) -> impl Iterator<Item = Sphere> + '_ {
        self.kept.iter().filter_map(|cell| self.circumspheres[cell.index()])
    }

    /// Whether the circumcentre of a cell is inside; never for infinite cells.
    pub fn is_inside(&self, cell: CellId) -> bool {
        // Finite cells come first; infinite ones are beyond the list.
        self.is_inside.get(cell.index()).is_some_and(|&inside| inside)
    }

    /// For each of so many cells the sphere of the Voronoi medial mesh that it is, or the largest
    /// id.
    pub(super) fn sphere_ids(&self, cells: usize) -> Vec<u32> {
        let mut ids = vec![u32::MAX; cells];
        for (sphere, cell) in (0..).zip(&self.kept) {
            ids[cell.index()] = sphere;
        }
        ids
    }
}

/// The Voronoi medial mesh of a triangulation of boundary samples, with contact points. Spheres
/// lie along a Morton curve. Parallel; the same mesh for any number of threads. `facets` are those of
/// the same cells.
pub fn voronoi_medial_mesh(
    delaunay: &Delaunay,
    cells: &CellSpheres,
    facets: &VoronoiFacets,
    samples: &Arc<[Vec3]>,
    dual: DualTriangulation,
) -> MedialMesh {
    let triangulation = delaunay.triangulation();
    let kept = &cells.kept;
    let sphere_of_cell = cells.sphere_ids(triangulation.cell_count());
    let spheres: Vec<Sphere> = cells.inner_spheres().collect();
    let sphere = |cell: CellId| sphere_of_cell[cell.index()];

    let edges = kept.par_iter().flat_map_iter(|&cell| {
        let neighbours = triangulation.neighbours(cell).into_iter();
        neighbours
            .filter(move |&other| other > cell && cells.is_inside(other))
            .map(move |other| [sphere(cell), sphere(other)])
    });
    let all: Vec<u32> = (0..facets.len() as u32).collect();
    let faces = facets.triangles(&all, &spheres, dual);
    let mut mesh = MedialMesh::from_simplices(spheres, edges.collect(), faces)
        .expect("circumspheres are finite and ids in range");
    mesh.contacts = Some(Contacts {
        samples: Arc::clone(samples),
        of_sphere: kept.iter().map(|&c| triangulation.vertices(c).map(|v| v.0)).collect(),
    });
    mesh
}

/// Adds the triangles of a dual polygon that is given by its spheres in rotational order.
pub(super) fn triangulate(
    polygon: &[u32],
    spheres: &[Sphere],
    dual: DualTriangulation,
    triangles: &mut Vec<[u32; 3]>,
) {
    if dual == DualTriangulation::Delaunay
        && polygon.len() > 3
        && let Some(planar) = planar_delaunay(polygon, spheres)
    {
        triangles.extend(planar);
        return;
    }
    let start = (0..polygon.len()).min_by_key(|&k| polygon[k]).unwrap_or(0);
    let vertex = |k: usize| polygon[(start + k) % polygon.len()];
    triangles.extend((2..polygon.len()).map(|k| [vertex(0), vertex(k - 1), vertex(k)]));
}

/// The Delaunay triangulation of a convex planar polygon, or `None` where coincident or collinear
/// vertices give something else than `n - 2` triangles bounded by the polygon's sides; the caller
/// then falls back to the fan.
fn planar_delaunay(polygon: &[u32], spheres: &[Sphere]) -> Option<Vec<[u32; 3]>> {
    let centre = |v: u32| spheres[v as usize].centre;
    let origin = centre(polygon[0]);
    // Newell's normal: the sum of the fan's area vectors.
    let normal: Vec3 = polygon[1..]
        .windows(2)
        .map(|pair| (centre(pair[0]) - origin).cross(centre(pair[1]) - origin))
        .sum();
    let normal = normal.try_normalize()?;
    let (u, v) = normal.any_orthonormal_pair();
    let mut plane: DelaunayTriangulation<Point2<f64>> = DelaunayTriangulation::new();
    for (k, &id) in polygon.iter().enumerate() {
        let p = centre(id) - origin;
        let handle = plane.insert(Point2::new(p.dot(u), p.dot(v))).ok()?;
        if handle.index() != k {
            return None;
        }
    }
    let triangles: Vec<[u32; 3]> = plane
        .inner_faces()
        .map(|face| face.vertices().map(|vertex| polygon[vertex.fix().index()]))
        .collect();
    let fills = triangles.len() + 2 == polygon.len() && bounded_by(&triangles, polygon);
    fills.then_some(triangles)
}

/// Whether the sides of a polygon are just the edges that have a single triangle.
fn bounded_by(triangles: &[[u32; 3]], polygon: &[u32]) -> bool {
    let ordered = |a: u32, b: u32| [a.min(b), a.max(b)];
    let mut edges: Vec<[u32; 2]> = triangles
        .iter()
        .flat_map(|&[a, b, c]| [ordered(a, b), ordered(b, c), ordered(a, c)])
        .collect();
    edges.sort_unstable();
    let single = edges.chunk_by(|a, b| a == b).filter(|run| run.len() == 1).map(|run| run[0]);
    let mut sides: Vec<[u32; 2]> =
        (0..polygon.len()).map(|k| ordered(polygon[k], polygon[(k + 1) % polygon.len()])).collect();
    sides.sort_unstable();
    single.eq(sides)
}
