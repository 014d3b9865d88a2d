//! Step 1: the corners (vertices of the boundary, each position once) and the balls that meet there.

use rayon::prelude::*;

use super::NONE;
use crate::Vec3;
use crate::geometry::dual_complex::Class;
use crate::geometry::triangulation::Facet;
use crate::geometry::{
    CellId, Delaunay, DualComplex, Sphere, TriangulationError, UnionBoundary, UnionVertex, VertexId,
};

/// The corners of a union of balls and their Delaunay triangulation.
pub(super) struct Corners {
    points: Vec<Vec3>,
    /// For each corner the first vertex of the boundary there.
    vertices: Vec<UnionVertex>,
    /// The balls of corner `i` are `balls[start[i]..start[i + 1]]`, ascending.
    start: Vec<u32>,
    balls: Vec<u32>,
    /// For each facet of each cell of the regular triangulation, the corner on the side of the cell.
    at: Vec<u32>,
    /// The centres of all balls.
    centres: Vec<Vec3>,
    /// `None` if the dual complex has no tetrahedron.
    delaunay: Option<Delaunay>,
}

impl Corners {
    pub(super) fn of(
        complex: &DualComplex<'_>,
        balls: &[Sphere],
    ) -> Result<Self, TriangulationError> {
        let boundary = UnionBoundary::new(complex);
        let merged = boundary.merge(|_| None);
        let points = merged.points().to_vec();
        // Points are numbered in the order of their first vertices.
        let mut vertices: Vec<UnionVertex> = Vec::with_capacity(points.len());
        for (vertex, &point) in boundary.vertices().iter().zip(merged.point_of()) {
            if point as usize == vertices.len() {
                vertices.push(*vertex);
            }
        }
        let same = same_position(&points);
        let of_vertex = merged.point_of().iter().map(|&point| same[point as usize]);
        let of_vertex: Vec<u32> = of_vertex.collect();
        let (start, meeting) = balls_of_corners(&boundary, &of_vertex, points.len());
        let delaunay = match complex.tetrahedra().next() {
            Some(_) => Some(spanning(&points, balls)?),
            None => None,
        };
        let at = corners_of_sides(complex, &boundary, &of_vertex);
        let centres = balls.iter().map(|b| b.centre).collect();
        Ok(Self { points, vertices, start, balls: meeting, at, centres, delaunay })
    }

    /// The number of different corners.
    pub(super) fn count(&self) -> usize {
        self.start.windows(2).filter(|pair| pair[0] < pair[1]).count()
    }

    /// One more than the largest index of a corner or an anchor.
    pub(super) fn with_anchors(&self) -> usize {
        self.delaunay.as_ref().map_or(0, Delaunay::point_count).max(self.points.len())
    }

    pub(super) fn point(&self, corner: u32) -> Vec3 {
        self.points[corner as usize]
    }

    pub(super) fn vertices(&self) -> &[UnionVertex] {
        &self.vertices
    }

    pub(super) fn centre(&self, ball: u32) -> Vec3 {
        self.centres[ball as usize]
    }

    pub(super) fn points(&self) -> &[Vec3] {
        &self.points
    }

    pub(super) fn delaunay(&self) -> Option<&Delaunay> {
        self.delaunay.as_ref()
    }

    pub(super) fn cell_count(&self) -> usize {
        self.delaunay.as_ref().map_or(0, |d| d.finite_cell_count())
    }

    /// The corner of a triangle of the dual complex, on the side of the facet's cell.
    pub(super) fn at(&self, facet: Facet) -> u32 {
        self.at[4 * facet.cell.index() + facet.opposite]
    }

    /// The balls that meet in a vertex of the Delaunay triangulation: none in anchors.
    pub(super) fn balls(&self, corner: VertexId) -> &[u32] {
        match self.start.get(corner.index()..corner.index().saturating_add(2)) {
            Some(&[from, to]) => &self.balls[from as usize..to as usize],
            _ => &[],
        }
    }

    /// The Voronoi vertex of a cell with its distance from the corners, and whether it had to be
    /// moved into `bounds`.
    pub(super) fn sphere(&self, cell: CellId, bounds: [Vec3; 2]) -> (Sphere, bool) {
        let delaunay = self.delaunay.as_ref().expect("a cell");
        let p = delaunay.vertices(cell).map(|v| delaunay.point(v));
        let found = delaunay.circumsphere(cell).map(|c| c.0).filter(|c| c.is_finite());
        let mean = (p[0] + p[1] + p[2] + p[3]) / 4.0;
        let centre = found.unwrap_or(mean).clamp(bounds[0], bounds[1]);
        let radius = p.iter().map(|q| q.distance(centre)).fold(f64::INFINITY, f64::min);
        (Sphere::new(centre, radius), found != Some(centre))
    }
}

/// The balls of each corner, as starts of runs and the runs.
fn balls_of_corners(
    boundary: &UnionBoundary,
    of_vertex: &[u32],
    corners: usize,
) -> (Vec<u32>, Vec<u32>) {
    let with_corners = boundary.vertices().iter().zip(of_vertex);
    let mut pairs: Vec<u64> = with_corners
        .flat_map(|(v, &corner)| v.balls.map(|b| u64::from(corner) << 32 | u64::from(b)))
        .collect();
    pairs.par_sort_unstable();
    pairs.dedup();
    let mut start = vec![0; corners + 1];
    for pair in &pairs {
        start[(pair >> 32) as usize + 1] += 1;
    }
    for i in 0..corners {
        start[i + 1] += start[i];
    }
    (start, pairs.into_iter().map(|pair| pair as u32).collect())
}

/// For each facet of each cell the corner of its triangle on the side of the cell.
fn corners_of_sides(
    complex: &DualComplex<'_>,
    boundary: &UnionBoundary,
    of_vertex: &[u32],
) -> Vec<u32> {
    let regular = complex.regular();
    let index = |f: Facet| 4 * f.cell.index() + f.opposite;
    let mut at = vec![NONE; 4 * regular.cell_count()];
    for (vertex, &corner) in boundary.vertices().iter().zip(of_vertex) {
        at[index(regular.mirror(vertex.facet))] = corner;
    }
    // Three spheres that meet in a single point, in the plane of a singular triangle: it is the corner
    // on both sides, but reported once.
    for (facet, _) in complex.triangles().filter(|f| f.1 == Class::Singular) {
        let [one, other] = [facet, regular.mirror(facet)].map(index);
        if at[one] == NONE {
            at[one] = at[other];
        } else if at[other] == NONE {
            at[other] = at[one];
        }
    }
    at
}

/// The box of all centres, which contains the dual complex.
pub(super) fn bounds(balls: &[Sphere]) -> [Vec3; 2] {
    let first = balls.first().map_or(Vec3::ZERO, |b| b.centre);
    let low = balls.iter().fold(first, |m, b| m.min(b.centre));
    [low, balls.iter().fold(first, |m, b| m.max(b.centre))]
}

/// For each point the first one at the same position.
fn same_position(points: &[Vec3]) -> Vec<u32> {
    // Adding 0 turns -0 into +0, which is the same position with other bits.
    let key = |&i: &u32| points[i as usize].to_array().map(|x| (x + 0.0).to_bits());
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    order.sort_unstable_by_key(|i| (key(i), *i));
    let mut first: Vec<u32> = (0..points.len() as u32).collect();
    for run in order.chunk_by(|a, b| key(a) == key(b)) {
        for &i in run {
            first[i as usize] = run[0];
        }
    }
    first
}

/// The Delaunay triangulation of the corners. If they do not span space, four *anchors* are added, so
/// far away that no point among the balls is nearest to one.
fn spanning(corners: &[Vec3], balls: &[Sphere]) -> Result<Delaunay, TriangulationError> {
    match Delaunay::new(corners) {
        Err(
            TriangulationError::TooFewPoints { .. }
            | TriangulationError::Collinear { .. }
            | TriangulationError::Coplanar { .. },
        ) => {}
        result => return result,
    }
    let [low, high] = bounds(balls);
    let radius = balls.iter().map(|b| b.radius).fold(0.0, f64::max);
    let reach = (high - low).max_element() + radius;
    let far = f64::powi(2.0, reach.log2().ceil() as i32 + 4);
    let signs = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
    let anchors = signs.map(|s| low + far * Vec3::from(s));
    Delaunay::new(&[corners, &anchors].concat())
}
