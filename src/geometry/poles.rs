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

use super::triangulation::{CellId, VertexId};
use super::{Delaunay, Sphere};
use crate::Vec3;

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

    /// The index of the polar ball of a cell; `None` if the cell's circumcentre is no pole.
    pub fn ball_of(&self, cell: CellId) -> Option<usize> {
        self.balls.binary_search_by_key(&cell, |b| b.cell).ok()
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
    for poles in samples {
        if let Some(Pole::Vertex(cell)) = poles.first {
            is_pole[cell.index()] = true;
        }
        if let Some(cell) = poles.second {
            is_pole[cell.index()] = true;
        }
    }
    let cells = delaunay.finite_cells().filter(|c| is_pole[c.index()]);
    let ball = |cell: CellId| {
        let samples = delaunay.vertices(cell).map(|v| v.0);
        Some(PolarBall { cell, sphere: spheres[cell.index()]?, samples })
    };
    cells.filter_map(ball).collect()
}
