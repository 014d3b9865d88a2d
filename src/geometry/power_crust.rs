//! The power crust: the surface between the power cells of inner and of outer balls.
//!
//! N. Amenta, S. Choi, R. K. Kolluri: *The power crust*, ACM Symposium on Solid Modeling and
//! Applications 2001, <https://doi.org/10.1145/376957.376986>; *The power crust, unions of balls, and
//! the medial axis transform*, Computational Geometry 19 (2001),
//! <https://doi.org/10.1016/S0925-7721(01)00017-7>.
//!
//! 1. The power diagram of the inner and the outer polar balls, as their regular triangulation. The
//!    corners of a box around all balls are added as outer points, so that every cell of a ball is bounded.
//! 2. The power crust is made of the power facets between an inner and an outer cell. Such a facet
//!    is dual to an edge of the triangulation; its corners are the orthocentres of the cells around
//!    that edge, in rotational order.
//! 3. Facets are cut into triangles, fans from their first corner.
//!
//! # Why it is a closed manifold
//!
//! Corners are identified by the cell of the triangulation, not by position. A triangle of the
//! triangulation is dual to an edge of the power diagram, and zero or two facets of the crust meet
//! there. At each cell, which has four vertices, the facets of the crust form one cycle of three or
//! four. Ties are broken by the triangulation's symbolic perturbation, which leaves exactly four balls
//! at each corner. So the crust is a closed manifold for any balls, whatever their labels.
//!
//! Without the perturbation many balls meet in one point: all polar balls of a sample do. There the
//! crust has several corners at one position, up to rounding, with edges of zero length between them.
//! `medial::surface::crust_surface` merges them along these edges, which keeps the crust a manifold.
//!
//! Deviations from the paper
//!
//! * Labels are given, not propagated from pole to pole: where there is a surface, its inside test
//!   is more reliable.

use rayon::prelude::*;

use super::triangulation::{CellId, VertexId};
use super::{Regular, Sphere, TriangulationError};
use crate::Vec3;

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
        let balls = || inner.iter().chain(outer);
        for (index, ball) in balls().enumerate() {
            if ball.radius < 0.0 || !ball.radius.is_finite() {
                return Err(TriangulationError::Radius { index, radius: ball.radius });
            }
        }
        let mut points: Vec<Vec3> = balls().map(|b| b.centre).collect();
        let mut weights: Vec<f64> = balls().map(|b| b.radius * b.radius).collect();
        points.extend(box_around(&points));
        weights.resize(points.len(), 0.0);
        let regular = Regular::new(&points, &weights)?;
        Ok(Self::between(&regular, inner.len() as u32))
    }

    /// Step 2: the facets between balls below the index `first_outer` and the others.
    fn between(regular: &Regular, first_outer: u32) -> Self {
        let is_inner = |v: VertexId| v.0 < first_outer;
        let facets_of = |cell: CellId| {
            let v = regular.vertices(cell);
            let pairs = (0..4).flat_map(move |i| (0..4).map(move |j| (i, j)));
            let separating = pairs.filter(move |&(i, j)| is_inner(v[i]) && !is_inner(v[j]));
            separating.filter_map(move |(i, j)| {
                let ring: Vec<CellId> = regular.edge_ring(cell, i, j).collect();
                // Each facet once, from the first of its cells.
                (ring.iter().min() == Some(&cell)).then_some(([v[i].0, v[j].0], ring))
            })
        };
        let finite = (0..regular.finite_cell_count() as u32).into_par_iter().with_min_len(1 << 12);
        let facets: Vec<_> = finite.flat_map_iter(|cell| facets_of(CellId(cell))).collect();
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
        let corner = |&cell: &CellId| {
            // Inner balls are inside the box, so never on the hull: no cell here is infinite. Only
            // nearly coplanar balls have an orthocentre that is not representable.
            let mean =
                || regular.vertices(cell).map(|v| regular.point(v)).iter().sum::<Vec3>() / 4.0;
            regular.orthosphere(cell).map_or_else(mean, |(centre, _)| centre)
        };
        let corners = cells.par_iter().with_min_len(1 << 10).map(corner).collect();
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
        let pick = |bit: u32, lo: f64, hi: f64| if k >> bit & 1 == 0 { lo } else { hi };
        Vec3::new(pick(0, lo.x, hi.x), pick(1, lo.y, hi.y), pick(2, lo.z, hi.z))
    })
}
