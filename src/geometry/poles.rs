//! Poles: the Voronoi vertices of a sample's cell that are farthest from it, on either side of the
//! surface.
//!
//! N. Amenta, M. Bern: *Surface reconstruction by Voronoi filtering*, Discrete & Computational
//! Geometry 22 (1999), <https://doi.org/10.1007/PL00009475>; N. Amenta, S. Choi, R. K. Kolluri: *The
//! power crust, unions of balls, and the medial axis transform*, Computational Geometry 19 (2001),
//! <https://doi.org/10.1016/S0925-7721(01)00017-7>.
//!
//! 1. The *first pole* `p+` of a sample `p` is the farthest vertex of its Voronoi cell. If the cell
//!    is unbounded, it is at infinity, in the direction of the average of the cell's unbounded
//!    edges: the outward normals of the hull's facets at `p`.
//! 2. The *second pole* is the farthest vertex `v` with `(v - p) . (p+ - p) < 0`.
//! 3. The *polar ball* of a pole is centred at it and has `p` on its boundary: the circumsphere of
//!    the Delaunay cell that is dual to the pole.
//!
//! Deviations from the paper
//!
//! * The poles of unbounded cells are kept as directions. The published program inserts the corners of a
//!   large box instead and discards their cells; then no cell of a sample is unbounded.
//!
//! Ties go to the cell with the smallest id. Several cells of cospherical samples can have the same
//! circumcentre up to rounding; the rounded radii then decide which of them is the pole.

use rayon::prelude::*;

use crate::dual_complex::weighted;
use crate::triangulation::{CellId, VertexId};
use crate::{Delaunay, Regular, Sphere, TriangulationError, Vec3};

/// The first pole of a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pole {
    /// The circumcentre of this cell.
    Vertex(CellId),
    /// At infinity, in this direction, of unit length.
    Infinite(Vec3),
}

/// The poles of one sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SamplePoles {
    /// The farthest Voronoi vertex; `None` only where no circumcentre is representable.
    pub first: Option<Pole>,
    /// The farthest one on the other side of the sample; `None` if there is none.
    pub second: Option<CellId>,
}

impl SamplePoles {
    /// The cells of the poles that are not at infinity.
    pub fn cells(self) -> impl Iterator<Item = CellId> {
        let first = match self.first {
            Some(Pole::Vertex(cell)) => Some(cell),
            _ => None,
        };
        first.into_iter().chain(self.second)
    }
}

/// The ball around a pole through the samples of its cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PolarBall {
    /// The Delaunay cell that the pole is the circumcentre of.
    pub cell: CellId,
    /// Centre and radius.
    pub sphere: Sphere,
    /// The samples on its boundary.
    pub samples: [u32; 4],
}

/// The poles of all samples, and the polar balls.
///
/// ```
/// use medial_geometry::{Vec3, Delaunay, Pole, Poles};
///
/// // The corners of a cube and the middle of its faces.
/// let mut samples: Vec<Vec3> = (0..8u32)
///     .map(|i| Vec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)))
///     .collect();
/// samples.extend([Vec3::X, Vec3::Y, Vec3::Z].map(|a| Vec3::splat(0.5) + 0.5 * a));
/// let delaunay = Delaunay::new(&samples)?;
/// let poles = Poles::new(&delaunay);
/// // All cells are unbounded, and the middle of the cube's right face looks to the right.
/// assert_eq!(poles.of_sample(8).first, Some(Pole::Infinite(Vec3::X)));
/// let inner = poles.inner_balls(|_| true);
/// assert!(inner.iter().all(|ball| ball.sphere.radius < 1.0));
/// # Ok::<(), medial_geometry::TriangulationError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Poles {
    samples: Vec<SamplePoles>,
    balls: Vec<PolarBall>,
}

impl Poles {
    /// The poles of all samples of a Delaunay triangulation. Repeated samples have the poles of
    /// their first.
    ///
    /// Linear in the number of cells.
    pub fn new(delaunay: &Delaunay) -> Self {
        let spheres = delaunay.circumspheres();
        let first = first_poles(delaunay, &spheres).into_iter();
        let mut samples: Vec<_> = first.map(|first| SamplePoles { first, second: None }).collect();
        find_second_poles(delaunay, &spheres, &mut samples);
        for &(repeated, kept) in delaunay.duplicates() {
            samples[repeated.index()] = samples[kept.index()];
        }
        let balls = polar_balls(delaunay, &spheres, &samples);
        Self { samples, balls }
    }

    /// The poles of a sample.
    ///
    /// # Panics
    /// If there is no such sample.
    #[inline]
    pub fn of_sample(&self, sample: usize) -> SamplePoles {
        self.samples[sample]
    }

    /// The poles of all samples.
    #[inline]
    pub fn samples(&self) -> &[SamplePoles] {
        &self.samples
    }

    /// The polar balls, each once, by ascending cell: those of all first and second poles that are
    /// not at infinity.
    #[inline]
    pub fn balls(&self) -> &[PolarBall] {
        &self.balls
    }

    /// The polar balls of the cells labelled as inside, by ascending cell. Poles at infinity are
    /// outside.
    pub fn inner_balls(&self, is_inside: impl Fn(CellId) -> bool) -> Vec<PolarBall> {
        self.balls.iter().filter(|b| is_inside(b.cell)).copied().collect()
    }
}

/// Step 1, from the circumspheres of all finite cells. Repeated samples have none.
fn first_poles(delaunay: &Delaunay, spheres: &[Option<Sphere>]) -> Vec<Option<Pole>> {
    let mut first = vec![None; delaunay.point_count()];
    let mut farthest = vec![f64::NEG_INFINITY; first.len()];
    for cell in delaunay.finite_cells() {
        let Some(sphere) = spheres[cell.index()] else { continue };
        for v in delaunay.vertices(cell).map(VertexId::index) {
            // Cells come by ascending id, so a strict comparison gives ties to the smallest.
            if sphere.radius > farthest[v] {
                farthest[v] = sphere.radius;
                first[v] = Some(Pole::Vertex(cell));
            }
        }
    }
    for (v, direction) in delaunay.unbounded_directions() {
        first[v.index()] = Some(Pole::Infinite(direction));
    }
    first
}

/// Step 2.
fn find_second_poles(delaunay: &Delaunay, spheres: &[Option<Sphere>], samples: &mut [SamplePoles]) {
    let mut farthest = vec![f64::NEG_INFINITY; samples.len()];
    for cell in delaunay.finite_cells() {
        let Some(sphere) = spheres[cell.index()] else { continue };
        for v in delaunay.vertices(cell) {
            let p = delaunay.point(v);
            let v = v.index();
            let towards = match samples[v].first {
                Some(Pole::Vertex(first)) => spheres[first.index()].map(|s| s.centre - p),
                Some(Pole::Infinite(direction)) => Some(direction),
                None => None,
            };
            if sphere.radius > farthest[v]
                && towards.is_some_and(|t| t.dot(sphere.centre - p) < 0.0)
            {
                farthest[v] = sphere.radius;
                samples[v].second = Some(cell);
            }
        }
    }
}

/// Step 3: the balls of the cells that are poles.
fn polar_balls(
    delaunay: &Delaunay,
    spheres: &[Option<Sphere>],
    samples: &[SamplePoles],
) -> Vec<PolarBall> {
    let mut is_pole = vec![false; spheres.len()];
    for cell in samples.iter().flat_map(|poles| poles.cells()) {
        is_pole[cell.index()] = true;
    }
    let cells = delaunay.finite_cells().filter(|c| is_pole[c.index()]);
    cells
        .filter_map(|cell: CellId| {
            let samples = delaunay.vertices(cell).map(|v| v.0);
            Some(PolarBall { cell, sphere: spheres[cell.index()]?, samples })
        })
        .collect()
}

// The power crust: the surface between the power cells of inner and of outer balls.
//
// N. Amenta, S. Choi, R. K. Kolluri: *The power crust*, ACM Symposium on Solid Modeling and
// Applications 2001, <https://doi.org/10.1145/376957.376986>; *The power crust, unions of balls, and
// the medial axis transform*, Computational Geometry 19 (2001),
// <https://doi.org/10.1016/S0925-7721(01)00017-7>.
//
// 1. The power diagram of the inner and the outer polar balls, as their regular triangulation. The
//    corners of a box around all balls are added as outer points, so that every cell of a ball is bounded.
// 2. The power crust is made of the power facets between an inner and an outer cell. Such a facet
//    is dual to an edge of the triangulation; its corners are the orthocentres of the cells around
//    that edge, in rotational order.
// 3. Facets are cut into triangles, fans from their first corner.
//
// # Why it is a closed manifold
//
// Corners are identified by the cell of the triangulation, not by position. A triangle of the
// triangulation is dual to an edge of the power diagram, and zero or two facets of the crust meet
// there. At each cell, which has four vertices, the facets of the crust form one cycle of three or
// four. Ties are broken by the triangulation's symbolic perturbation, which leaves exactly four balls
// at each corner. So the crust is a closed manifold for any balls with any labels.
//
// Without the perturbation many balls meet in one point: all polar balls of a sample do. There the
// crust has several corners at one position, up to rounding, with edges of zero length between them.
// `medial::surface::crust_surface` merges them along these edges, which keeps the crust a manifold.
//
// Deviations from the paper
//
// * Labels are given, not propagated from pole to pole: where there is a surface, its inside test
//   is more reliable.

/// The facets of the power diagram that separate inner from outer balls.
///
/// ```
/// use medial_geometry::{PowerCrust, Sphere, Vec3};
///
/// // A ball, and six as large around it: the crust is the cube between them.
/// let inner = [Sphere::new(Vec3::ZERO, 1.0)];
/// let axes = [Vec3::X, Vec3::Y, Vec3::Z];
/// let outer: Vec<Sphere> =
///     axes.into_iter().flat_map(|a| [a, -a]).map(|a| Sphere::new(2.0 * a, 1.0)).collect();
/// let crust = PowerCrust::new(&inner, &outer)?;
/// assert_eq!(crust.facet_count(), 6);
/// let volume: f64 = crust
///     .triangles()
///     .iter()
///     .map(|face| {
///         let [a, b, c] = face.map(|corner| crust.corners()[corner as usize]);
///         a.cross(b).dot(c) / 6.0
///     })
///     .sum();
/// assert!((volume - 8.0).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct PowerCrust {
    corners: Vec<Vec3>,
    /// The corners of facet `i` are `rings[start[i]..start[i + 1]]`, counter-clockwise as seen from
    /// outside.
    start: Vec<u32>,
    rings: Vec<u32>,
    /// The inner and the outer ball of each facet.
    balls: Vec<[u32; 2]>,
}

/// Distance of the added corners from the box around all centres, in diagonals of that box: far
/// enough that their cells do not come near the balls.
const MARGIN: f64 = 1.0;

impl PowerCrust {
    /// The power crust of labelled balls, in any unit. Costs a regular triangulation and linear
    /// time after it. Deterministic.
    ///
    /// # Errors
    /// A centre or radius that is not finite, a radius that is negative, as in [`Regular::new`].
    pub fn new(inner: &[Sphere], outer: &[Sphere]) -> Result<Self, TriangulationError> {
        let (mut points, mut weights) = weighted(inner.iter().chain(outer))?;
        points.extend(box_around(&points));
        weights.resize(points.len(), 0.0);
        let regular = Regular::new(&points, &weights)?;
        Ok(Self::between(&regular, inner.len() as u32))
    }

    /// Step 2: the facets between balls below the index `first_outer` and the others.
    fn between(regular: &Regular, first_outer: u32) -> Self {
        let finite = (0..regular.finite_cell_count() as u32).into_par_iter().with_min_len(1 << 12);
        let facets: Vec<_> = finite
            .flat_map_iter(|cell| {
                let cell = CellId(cell);
                let v = regular.vertices(cell).map(|v| v.0);
                let pairs = (0..4).flat_map(move |i| (0..4).map(move |j| (i, j)));
                let separating =
                    pairs.filter(move |&(i, j)| v[i] < first_outer && v[j] >= first_outer);
                separating.filter_map(move |(i, j)| {
                    let ring: Vec<CellId> = regular.edge_ring(cell, i, j).collect();
                    // Each facet once, from the first of its cells.
                    (ring.iter().min() == Some(&cell)).then_some(([v[i], v[j]], ring))
                })
            })
            .collect();
        let mut corner_of = vec![u32::MAX; regular.cell_count()];
        let mut cells = Vec::new();
        let (mut start, mut rings) = (vec![0], Vec::new());
        for (_, ring) in &facets {
            for &cell in ring {
                let corner = &mut corner_of[cell.index()];
                if *corner == u32::MAX {
                    *corner = cells.len() as u32;
                    cells.push(cell);
                }
                rings.push(*corner);
            }
            start.push(rings.len() as u32);
        }
        let corners = cells
            .par_iter()
            .with_min_len(1 << 10)
            .map(|&cell: &CellId| {
                // Inner balls are inside the box, so never on the hull: no cell here is infinite. Only
                // nearly coplanar balls have an orthocentre that is not representable.
                regular.orthosphere(cell).map_or_else(
                    || regular.vertices(cell).map(|v| regular.point(v)).iter().sum::<Vec3>() / 4.0,
                    |(centre, _)| centre,
                )
            })
            .collect();
        Self { corners, start, rings, balls: facets.iter().map(|f| f.0).collect() }
    }

    /// The number of facets.
    pub fn facet_count(&self) -> usize {
        self.balls.len()
    }

    /// The indices of the inner and of the outer ball that a facet separates; outer balls are counted
    /// from the number of inner ones on, and after them come the corners of the box.
    pub fn balls(&self, facet: usize) -> [u32; 2] {
        self.balls[facet]
    }

    /// The positions of the facets' corners: orthocentres, several at one position where more than
    /// four balls meet.
    pub fn corners(&self) -> &[Vec3] {
        &self.corners
    }

    /// The corners of a facet, counter-clockwise as seen from outside.
    pub fn facet(&self, facet: usize) -> &[u32] {
        &self.rings[self.start[facet] as usize..self.start[facet + 1] as usize]
    }

    /// Step 3: the crust as triangles, on the same corners.
    pub fn triangles(&self) -> Vec<[u32; 3]> {
        let mut faces = Vec::with_capacity(self.rings.len() - 2 * self.facet_count());
        for facet in 0..self.facet_count() {
            let ring = self.facet(facet);
            faces.extend(ring[1..].windows(2).map(|pair| [ring[0], pair[0], pair[1]]));
        }
        faces
    }
}

/// The corners of a box around points, with a margin.
fn box_around(points: &[Vec3]) -> [Vec3; 8] {
    let first = points.first().copied().unwrap_or(Vec3::ZERO);
    let (lo, hi) = points.iter().fold((first, first), |(lo, hi), &p| (lo.min(p), hi.max(p)));
    let extent = (hi - lo).length();
    let margin = Vec3::splat(if extent > 0.0 { MARGIN * extent } else { 1.0 });
    let (lo, hi) = (lo - margin, hi + margin);
    [0, 1, 2, 3, 4, 5, 6, 7].map(|k: u32| {
        let is_low = glam::BVec3::new(k & 1 == 0, k & 2 == 0, k & 4 == 0);
        Vec3::select(is_low, lo, hi)
    })
}
