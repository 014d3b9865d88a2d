//! Generalised winding numbers of meshes with holes, exact but for rounding.
//!
//! The generalised winding number (A. Jacobson, L. Kavan, O. Sorkine-Hornung, *Robust
//! inside-outside segmentation using generalized winding numbers*, 2013,
//! doi:10.1145/2461912.2461916) is the sum of the faces' signed solid angles over `4 pi`. It is
//! evaluated by one ray and the boundary, as in C. Martens, P. Trettner, M. Bessmeltsev, *The
//! antipodal method*, 2026, arXiv:2605.01536:
//!
//! 1. Walls that hang from the boundary edges down to infinity close the surface. The closed one
//!    winds an integer number of times around `p`: the signed crossings of the ray from `p` upward
//!    ([`InsideTest`]), which meets no wall, as all of them are parallel to it.
//! 2. Seen from `p`, the wall under the edge `ab` is the spherical triangle of `a`, `b` and the
//!    nadir, whose area is subtracted. With `C` the difference of the azimuths, `s, t` the
//!    angles from the nadir, `tan(omega / 2) = tan(s/2) tan(t/2) sin C / (1 + tan(s/2) tan(t/2) cos C)`.
//! 3. As `p` passes through a wall, `omega` jumps by `4 pi` and the crossings by 1. The sign of
//!    `sin C` is therefore the exact one, with the ray's own perturbation, and a corner straight
//!    above `p` is seen in the azimuth to which the perturbation moves it.
//!
//! An edge is a boundary edge if faces run along it more often in one direction than in the other;
//! vertices at the same position count as one. Closed surfaces have no such edge and get integers.

use std::ops::ControlFlow;

use super::inside::{Crossing, InsideTest, perturbed_turn};
use super::mesh::TriMesh;
use super::unit::Unit;
use crate::Vec3;
use crate::geometry::trees::in_morton_order;

/// Generalised winding numbers of a mesh: 1 inside and 0 outside a closed outward-oriented surface,
/// fractions near holes; points above 1/2 count as inside.
///
/// The time of a query is that of [`InsideTest`] plus a constant for each boundary edge. For soups of
/// many separate triangles [`WindingTree`](crate::surface::WindingTree), which approximates, is faster.
///
/// ```
/// use medial::Vec3;
/// use medial::surface::{GeneralisedWinding, TriMesh};
///
/// // Three faces of a tetrahedron, all but the large one, which is seen from the opposite corner
/// // of the cube under an eighth of the sphere.
/// let open = TriMesh {
///     vertices: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
///     faces: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2]],
/// };
/// let winding = GeneralisedWinding::new(&open);
/// assert_eq!(winding.boundary_edges(), 3);
/// assert!((winding.number(Vec3::splat(-1e-9)).unwrap() + 0.125).abs() < 1e-8);
/// assert_eq!(winding.number(Vec3::new(0.25, 0.25, 0.0)), None);
/// ```
#[derive(Debug)]
pub struct GeneralisedWinding {
    test: InsideTest,
    unit: Unit,
    boundary: Vec<BoundaryEdge>,
}

/// An edge, scaled, and the number of faces that run along it from the first end minus the number of
/// those that run the other way.
#[derive(Clone, Copy, Debug)]
struct BoundaryEdge {
    ends: [Vec3; 2],
    times: f64,
}

impl GeneralisedWinding {
    /// Prepares a mesh, which may be open, non-manifold or a soup. `O(F log F)`.
    ///
    /// # Panics
    /// If a face names a vertex that does not exist.
    pub fn new(mesh: &TriMesh) -> Self {
        let unit = Unit::of(&mesh.vertices);
        let points = unit.forward_all(&mesh.vertices);
        let test = InsideTest::of_scaled(unit, &points, &mesh.faces);
        Self { test, unit, boundary: boundary(&points, &mesh.faces) }
    }

    /// Number of boundary edges, on which the time of a query depends.
    pub fn boundary_edges(&self) -> usize {
        self.boundary.len()
    }

    /// The generalised winding number around `p`, or `None` for a point on the surface, exactly,
    /// where it jumps.
    ///
    /// Correct to a few units in the last place for each boundary edge; at a distance `e` from an
    /// edge of length `l`, times `l / e`.
    pub fn number(&self, p: Vec3) -> Option<f64> {
        let p = self.unit.forward(p);
        let mut crossings = Some(0);
        self.test.crossings_from_below(p, |_, crossing| match crossing {
            Crossing::Above(sign) => {
                crossings = crossings.map(|n| n + sign);
                ControlFlow::Continue(())
            }
            Crossing::On => {
                crossings = None;
                ControlFlow::Break(())
            }
        });
        let walls: f64 = self.boundary.iter().map(|e| e.times * half_under(e.ends, p)).sum();
        Some(f64::from(crossings?) + walls / std::f64::consts::TAU)
    }

    /// [`number`](Self::number) for many points, in their order, in parallel.
    pub fn numbers(&self, points: &[Vec3]) -> Vec<Option<f64>> {
        in_morton_order(points, |(): &mut (), p| self.number(p))
    }
}

/// Edges that faces use more often in one direction.
fn boundary(points: &[Vec3], faces: &[[u32; 3]]) -> Vec<BoundaryEdge> {
    let order = |&v: &u32, &w: &u32| {
        let [a, b] = [v, w].map(|v| points[v as usize]);
        a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(a.z.total_cmp(&b.z)).then(v.cmp(&w))
    };
    let mut by_position: Vec<u32> = (0..points.len() as u32).collect();
    by_position.sort_unstable_by(order);
    // For each vertex the first one of its position.
    let mut first: Vec<u32> = (0..points.len() as u32).collect();
    for pair in by_position.windows(2) {
        if points[pair[0] as usize] == points[pair[1] as usize] {
            first[pair[1] as usize] = first[pair[0] as usize];
        }
    }
    let mut edges: Vec<([u32; 2], i32)> = faces
        .iter()
        .map(|face| face.map(|v| first[v as usize]))
        .flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]])
        .filter(|[a, b]| a != b)
        .map(|[a, b]| if a < b { ([a, b], 1) } else { ([b, a], -1) })
        .collect();
    edges.sort_unstable();
    let net = edges.chunk_by(|e, f| e.0 == f.0).map(|same| {
        let ends = same[0].0.map(|v| points[v as usize]);
        BoundaryEdge { ends, times: same.iter().map(|e| f64::from(e.1)).sum() }
    });
    net.filter(|edge| edge.times != 0.0).collect()
}

/// Half the signed solid angle, seen from `p`, of the wall from an edge down to infinity.
#[inline]
fn half_under([a, b]: [Vec3; 2], p: Vec3) -> f64 {
    let turn = perturbed_turn([a.x, a.y], [b.x, b.y], [p.x, p.y]).value();
    let (a, b) = (Azimuth::of(a - p), Azimuth::of(b - p));
    let cross = a.x * b.y - a.y * b.x;
    let dot = a.x * b.x + a.y * b.y;
    let scale = a.rise * b.rise;
    // Counter-clockwise from above is clockwise from the nadir.
    let sine = -f64::from(turn) * (scale * cross).abs();
    sine.atan2(a.level * b.level + scale * dot)
}

/// Horizontal direction of a point, and the tangent of half its angle from the nadir over the
/// length of that direction, as `rise / level`.
struct Azimuth {
    x: f64,
    y: f64,
    rise: f64,
    level: f64,
}

impl Azimuth {
    #[inline]
    fn of(v: Vec3) -> Self {
        let squared = v.x * v.x + v.y * v.y;
        let length = (squared + v.z * v.z).sqrt();
        if v.z <= 0.0 {
            Self { x: v.x, y: v.y, rise: 1.0, level: length - v.z }
        } else if squared > 0.0 {
            // As |v| - z = (x^2 + y^2) / (|v| + z), without the cancellation.
            Self { x: v.x, y: v.y, rise: length + v.z, level: squared }
        } else {
            // Straight above: `p` moves along x first, the corner the other way.
            Self { x: -1.0, y: 0.0, rise: 1.0, level: 0.0 }
        }
    }
}
