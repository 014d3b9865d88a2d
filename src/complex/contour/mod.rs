//! The boundary surface of the union of spheres, cones and slabs of a medial mesh.
//!
//! With `sigma` the least signed distance to a primitive, negative inside and 1-Lipschitz
//! ([`MedialUnion`]):
//!
//! 1. A cube around the union is filled with tetrahedra. Those that may meet the boundary, judged by
//!    `sigma` at their vertices, are bisected until no edge is longer than 4/5 of the tolerance, or
//!    than the radius of the union's balls there if that is less (file `bisection.rs`).
//! 2. Marching tetrahedra: a closed manifold with its vertices on the boundary (file `march.rs`).
//! 3. Edges shorter than a quarter of the tetrahedron's edge are contracted: a closed manifold stays one,
//!    and vertices stay on the boundary ([`contract_short_edges_while`]).
//!
//! # What the tolerance means
//!
//! Every point with `sigma > tolerance` is outside the surface, and every point with
//! `sigma < -tolerance` is inside. Proof: let `d` be the longest edge of the tetrahedron that holds the
//! point. If `|sigma| > d` at the point, all four vertices are on its side, so the surface does not
//! enter the tetrahedron. If `d` is larger than 4/5 of the tolerance, the tetrahedron was not refined
//! because `|sigma| > d` at a vertex; then it is on one side as a whole. Contraction moves the surface
//! by at most `d / 4`.
//!
//! So no point of the surface is farther than the tolerance from the union, or deeper in it. On smooth
//! parts the distance is much less, about `d^2 / 8 r` for curvature radius `r`. Features thinner than a
//! tetrahedron can be missed: parts of the union with a radius below 1/20 of the tolerance
//! ([`UnionSurface::lost`]), and crevices and holes narrower than the tolerance. A crevice that is
//! missed only in some places is bridged there, so the surface has loops that the union does not have;
//! [`union_betti`](crate::metrics::union_betti) detects this.

mod bisection;
mod march;

use bisection::{Bisection, Leaf, MAX_BISECTIONS, Unfinished, Value};

use super::{MedialMesh, MedialUnion, UnionError};
use crate::Vec3;
use crate::surface::{Folds, TriMesh, contract_short_edges_while};

/// The boundary surface of a union, see [`union_surface`].
#[derive(Clone, Debug, PartialEq)]
pub struct UnionSurface {
    /// Closed and manifold, counter-clockwise as seen from outside.
    pub mesh: TriMesh,
    /// Tetrahedra that were needed.
    pub tetrahedra: usize,
    /// Spheres with a radius below the smallest tetrahedron: these, and what tapers to them, may be
    /// missing.
    pub lost: usize,
    /// Radius below which a sphere counts as lost, in the unit of the mesh.
    pub smallest: f64,
}

/// Why there is no surface.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ContourError {
    /// The medial mesh has no union.
    #[error(transparent)]
    Union(#[from] UnionError),
    /// The tolerance is not a positive number.
    #[error("a tolerance of {0} is not positive")]
    Tolerance(f64),
    /// The tolerance is too fine for the memory that this may take.
    #[error(
        "a tolerance of {tolerance:e} needs more than {most} tetrahedra, or finer ones than there are; \
         {feasible:e} is feasible"
    )]
    TooFine {
        /// The requested tolerance, in the unit of the mesh.
        tolerance: f64,
        /// The most tetrahedra that are taken.
        most: usize,
        /// A tolerance that is feasible, in the unit of the mesh.
        feasible: f64,
    },
    /// No part of the union is thick enough.
    #[error(
        "no part of the union is as thick as {smallest:e}: a tolerance below {feasible:e} shows some"
    )]
    TooThin {
        /// The smallest tetrahedron.
        smallest: f64,
        /// A tolerance that would show the largest sphere.
        feasible: f64,
    },
    /// All radii are zero.
    #[error("all spheres have radius zero: their union has no inside")]
    NoInside,
    /// It was stopped.
    #[error("cancelled")]
    Cancelled,
}

/// Tetrahedra's edges as a share of the tolerance; contraction takes the rest.
const EDGE_SHARE: f64 = 0.8;

/// Edges shorter than this share of the tetrahedron's edge that the vertex is on are contracted.
const CONTRACTED: f64 = 0.25;

/// Tetrahedra are refined to the radius of the union's balls, but no further than to this share of the
/// edge that the tolerance requires.
const MIN_SHARE_OF_CELL: f64 = 1.0 / 16.0;

/// Bound on the number of tetrahedra: about 4 GB.
const MAX_TETRAHEDRA: usize = 50_000_000;

/// The boundary of the union of all primitives of a medial mesh as triangles. `tolerance` is in the unit of
/// the mesh; the head of this file says what it means.
///
/// The time and memory grow with the area of the boundary over the square of the tolerance. Parallel;
/// the same surface for any number of threads.
///
/// ```
/// use medial::{Vec3, surface};
/// use medial::complex::{MedialMesh, Sphere, union_surface};
///
/// let spheres = vec![Sphere::new(Vec3::ZERO, 1.0), Sphere::new(4.0 * Vec3::X, 1.0)];
/// let capsule = MedialMesh::from_simplices(spheres, vec![[0, 1]], vec![])?;
/// let boundary = union_surface(&capsule, 0.2)?;
/// let report = surface::validate(&boundary.mesh)?;
/// let exact = std::f64::consts::PI * (4.0 / 3.0 + 4.0);
/// assert!((report.volume.unwrap() / exact - 1.0).abs() < 0.01);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// When the mesh has no union, the tolerance is not positive, or so fine that more than 50 million
/// tetrahedra would be needed, and when nothing is thick enough to show.
pub fn union_surface(mesh: &MedialMesh, tolerance: f64) -> Result<UnionSurface, ContourError> {
    union_surface_within(mesh, tolerance, MAX_TETRAHEDRA)
}

/// [`union_surface`] with at most `most` tetrahedra, of some 80 bytes each.
///
/// # Errors
/// As [`union_surface`].
pub fn union_surface_within(
    mesh: &MedialMesh,
    tolerance: f64,
    most: usize,
) -> Result<UnionSurface, ContourError> {
    union_surface_while(mesh, tolerance, most, || true)
}

/// [`union_surface_within`] for as long as `go_on` says so, which is asked every few ten thousand
/// vertices: of a [`RunContext`](crate::simplifier::RunContext), `|| run.step(0, 1).is_ok()`.
///
/// # Errors
/// As [`union_surface`], and [`ContourError::Cancelled`] if it was stopped.
pub fn union_surface_while(
    mesh: &MedialMesh,
    tolerance: f64,
    most: usize,
    mut go_on: impl FnMut() -> bool,
) -> Result<UnionSurface, ContourError> {
    let union = MedialUnion::new(mesh)?;
    if !(tolerance > 0.0 && tolerance.is_finite()) {
        return Err(ContourError::Tolerance(tolerance));
    }
    let largest = mesh.spheres.iter().map(|m| m.radius).fold(0.0, f64::max);
    if largest == 0.0 {
        return Err(ContourError::NoInside);
    }
    let longest = EDGE_SHARE * tolerance;
    let smallest = MIN_SHARE_OF_CELL * longest;
    let mut grid = cube_around(&union, longest);
    let sizes: Vec<f64> = (0..=MAX_BISECTIONS).map(|g| grid.longest_edge(g)).collect();
    let goal = sizes.iter().position(|&s| s <= longest).unwrap_or(sizes.len() - 1) as u8;
    let wanted = |leaf: &Leaf, values: [Value; 4]| {
        let size = sizes[usize::from(leaf.generation)];
        let radius = values.iter().map(|v| v.radius).fold(f64::INFINITY, f64::min);
        size > longest.min(radius.max(smallest)) && values.iter().all(|v| v.signed.abs() <= size)
    };
    let values = |points: &[Vec3]| {
        let found = union.deepest_ball_batch(points).into_iter();
        found.map(|(signed, radius)| Value { signed, radius }).collect()
    };
    grid.refine(goal, most, values, wanted, &mut go_on).map_err(|unfinished| match unfinished {
        Unfinished::TooMany { generation, leaves } => {
            // Feasible even if everything is thin and refined as far as possible.
            let size = sizes[usize::from(generation)] / MIN_SHARE_OF_CELL;
            let feasible = size / EDGE_SHARE * f64::max(1.0, (leaves as f64 / most as f64).sqrt());
            ContourError::TooFine { tolerance, most, feasible }
        }
        Unfinished::Stopped => ContourError::Cancelled,
    })?;
    if sizes[usize::from(goal)] > longest {
        let feasible = sizes[usize::from(goal)] / EDGE_SHARE;
        return Err(ContourError::TooFine { tolerance, most, feasible });
    }
    let (raw, edges) = march::march(&grid, &union);
    if raw.faces.is_empty() {
        // With edges of half its radius, a ball certainly contains a vertex.
        let feasible = 0.5 * largest / EDGE_SHARE;
        return Err(ContourError::TooThin { smallest, feasible });
    }
    let limits: Vec<f64> = edges.iter().map(|length| CONTRACTED * length).collect();
    let contracted = contract_short_edges_while(&raw, &limits, Folds::Refused, go_on);
    let mesh_of = contracted.ok_or(ContourError::Cancelled)?.mesh;
    let lost = mesh.spheres.iter().filter(|m| m.radius < smallest).count();
    Ok(UnionSurface { mesh: mesh_of, tetrahedra: grid.leaves.len(), lost, smallest })
}

/// A cube with the union in its inside. It is off centre by odd fractions, so that symmetric unions do not
/// have their boundary run through vertices.
fn cube_around(union: &MedialUnion, longest: f64) -> Bisection {
    let (lo, hi) = union.bounding_box();
    let extent = (hi - lo).max_element().max(longest);
    let margin = 0.1 * extent * Vec3::new(0.731, 0.617, 0.849);
    Bisection::of_cube(lo - margin, 1.2 * extent)
}
