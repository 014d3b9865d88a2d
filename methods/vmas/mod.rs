//! VMAS: variational medial axis sampling.
//!
//! Q. Huang, P. Kraemer, S. Thery, D. Bechmann 2024, *Dynamic Skeletonization via Variational Medial Axis
//! Sampling*, SIGGRAPH Asia 2024 Conference Papers, <https://huang46u.github.io/VMAS/>. The paper itself
//! was not available to us: all formulas are those of two programs of its first author, the published
//! code (huang46u/VMAS-code) and the CGAL package `Variational_medial_axis`, read for facts. Steps and
//! equations have no numbers here for that reason, and details of the paper alone are missing.
//!
//! 0. *Points* (`points.rs`): area-uniform samples, 100 for each sphere and at least 20,000, adjacent to their
//!    10 nearest ones; or the vertices of the mesh. One sphere to begin with.
//! 1. *Cluster* (`sampling.rs`): every point goes to the sphere with the least error. Spheres
//!    with fewer than 5 points (4 vertices) are dropped; these points have no sphere in this round.
//! 2. *Refit* (`refit.rs`): Gauss-Newton on the points of each sphere.
//! 3. *Correct* (`sampling.rs`): the fitted centre is pushed back to the medial axis, to the shrinking ball
//!    ([`medial::surface::shrinking_ball`]) of the nearest surface point. The fitted radius is not used.
//! 4. *Errors* (`sampling.rs`): `E_s` for each sphere; their sum is the total error.
//! 5. *Split* (`sampling.rs`): where the total error is at rest, and every 10 rounds, the spheres with the largest
//!    `E_s` are split, at most 20 % of them and at most 10, no two adjacent ones: the shrinking ball
//!    of the worst point joins.
//! 6. The rounds end with the target reached and the error at rest. Spheres are joined where their
//!    clusters are adjacent, and faces are all triples that are adjacent in pairs (this file).
//!
//! # Notation
//!
//! `v` a surface point of area `a_v` with tangent planes of unit normals `n_f` and areas `a_f`, one for
//! a sample, one for each face around a vertex (a third of it); `s = (c, r)` a medial sphere;
//!
//! ```text
//! err_v(s) = sum_f a_f (n_f . (v - c) - r)^2 + lambda a_v (|v - c| - r)^2
//! E_s      = sum_v err_v(s) / sum_v a_v     over the cluster of s
//! ```
//!
//! Lengths are fractions of the bounding-box diagonal. The programs' constants are fractions of the longest
//! *side* of the box, and are converted: at rest is a change below `1e-5 side^2`; a ball is empty to
//! `1e-5 side` and begins with the radius `side`; a step of the refit ends it below `1e-8 side`.
//!
//! # Where the two programs differ
//!
//! | | `points=samples` (CGAL) | `points=vertices` (the authors) |
//! |---|---|---|
//! | planes of a point | that of its face | those of all faces around it |
//! | adjacency | nearest samples | edges of the mesh |
//! | first sphere | ball of sample 0 | the largest ball |
//! | a cluster is dropped | below 5 points | below 4 |
//! | normal of a point's ball | of its face | of its faces, by area |
//!
//! A vertex cannot fit all of its planes where they differ, so errors are larger at features and splits go
//! there: with the same number of spheres `points=vertices` reaches farther into thin parts, and
//! depends on the mesh.
//!
//! # Deviations from the programs
//!
//! - Both programs refit another energy than they cluster by: the Euclidean rows are multiplied by `lambda`
//!   instead of its square root, and the plane distances of a point are summed before they are squared. So
//!   does this method.
//! - `points=auto` takes samples where the mesh has fewer than 25 vertices for each requested sphere.
//! - The refit starts from the current sphere. CGAL's starts from memory that was never set. A
//!   step that would raise the sum of errors is halved.
//! - A shrinking ball always begins with the radius `side`, where the authors take 0.5 and in step 3 0.25 of
//!   it, and ends when the ball is empty to one side, `d >= r - 1e-5 side`. The authors compare
//!   `|d - r|`, by which a ball that begins too small may grow. A ball that never shrinks is not used.
//! - Centres are tested against the exact winding number (CGAL: an approximate one, the authors: the
//!   sign of a face normal).
//! - The search for the least error leaves out spheres that cannot have it; the result is that of looking
//!   at all.
//! - The rounds end when 20 rounds with splits have passed without more spheres than ever before:
//!   dropped clusters can keep the target out of reach for ever, which a warning reports.
//! - The last cluster is never dropped, so that the result is never empty.
//! - Points without area are left out.
//!
//! # Not guaranteed
//!
//! Nothing holds the topology: four clusters that are adjacent in pairs give a hollow tetrahedron, and a ring
//! of three a false triangle. Betti numbers may differ from the solid's: the evaluation reports them, and nothing repairs them. CGAL's manual
//! does not recommend more than 300 spheres, nor CAD models.

mod energy;
mod points;
mod refit;
mod sampling;
#[cfg(test)]
mod tests;

use medial::shape::Shape;
use medial::simplifier::{
    Diagnostics, Level, Method, MethodInfo, ParamFields, RunContext, Simplification, Simplified,
    SimplifyError,
};
use points::SurfacePoints;
use rayon::prelude::*;
use sampling::{Ended, NONE, Solid, VariationalSampling};
use serde::{Deserialize, Serialize};

use crate::levels::{some_spheres, within};
use crate::{Prepared, Result};

/// Spheres of [`Level::Published`]: CGAL's default.
const PUBLISHED: usize = 100;

/// Samples for each sphere. Fewer do not carry it, by CGAL's manual.
const SAMPLES_PER_SPHERE: usize = 100;

/// Vertices for each sphere below which `points=auto` takes samples.
const VERTICES_PER_SPHERE: usize = 25;

/// Smallest number of samples.
const LEAST_SAMPLES: usize = 20_000;

/// Largest number of samples: memory and time stay bounded.
const MOST_SAMPLES: usize = 100_000;

/// Nearest samples that a sample is adjacent to, itself included.
const NEIGHBOURS: usize = 10;

/// Variational medial axis sampling as a method.
///
/// Supports [`Level::Spheres`] and [`Level::Published`], each from one sphere on: `O(P)` for each of some
/// hundred rounds, with `P` the number of surface points.
pub fn method() -> Method<VmasParams> {
    let info = MethodInfo::new("vmas", "Variational medial axis sampling")
        .citation(
            "Qijia Huang, Pierre Kraemer, Sylvain Thery, Dominique Bechmann 2024. Dynamic \
             skeletonization via variational medial axis sampling. SIGGRAPH Asia 2024 Conference \
             Papers. https://huang46u.github.io/VMAS/",
        )
        .bibtex(crate::references(&["HuangKraemerTheryBechmann2024"]))
        .summary(
            "Clusters surface points by the sphere that fits them best, refits each sphere to its \
             cluster, pushes it back to the medial axis, and splits the worst.",
        )
        .published("100 spheres, the default of the CGAL package")
        .seeded()
        .params(VmasParams::describe());
    Method::new(info, prepare)
}

fn prepare<'s>(shape: &'s Shape, params: VmasParams, run: &RunContext) -> Prepared<'s> {
    let params = params.validate()?;
    if shape.has_given_initial() {
        let why = "it samples the surface and starts from no medial mesh: leave out --initial";
        return Err(SimplifyError::unsupported(why));
    }
    run.step(0, 1)?;
    let solid = Solid::new(shape)?;
    Ok(Box::new(PreparedVmas { shape, solid, params, run: run.clone() }))
}

/// One shape.
struct PreparedVmas<'s> {
    shape: &'s Shape,
    solid: Solid<'s>,
    params: VmasParams,
    run: RunContext,
}

impl Simplification for PreparedVmas<'_> {
    fn at(&mut self, level: Level) -> Result<Simplified> {
        let requested = match some_spheres(level)? {
            Level::Spheres(count) => count,
            Level::Published => PUBLISHED,
            Level::Native(_) => {
                let why = "its native level is the number of spheres; request that number";
                return Err(SimplifyError::unsupported(why));
            }
        };
        let params = self.params.resolved(requested, self.shape.mesh().vertices.len());
        let points = self.points(requested, params)?;
        // Each sphere needs separate points.
        let target = requested.min(match params.points {
            Points::Samples => (points.len() / SAMPLES_PER_SPHERE).max(1),
            _ => points.len(),
        });
        let mut sampling = VariationalSampling::new(&points, &self.solid, params);
        let ended = sampling.run(target, &self.run)?;
        let mesh = sampling.mesh()?;
        let mut diagnostics = Diagnostics::default();
        diagnostics.count("surface_points", points.len());
        diagnostics.count("iterations", sampling.iterations);
        explain(requested, target, mesh.spheres.len(), ended, &mut diagnostics);
        Ok(Simplified { diagnostics, ..Simplified::new(mesh, level) })
    }
}

impl PreparedVmas<'_> {
    /// Step 0.
    fn points(&self, spheres: usize, params: VmasParams) -> Result<SurfacePoints> {
        let mesh = self.shape.mesh();
        let points = match params.points {
            Points::Samples => {
                let count = spheres.saturating_mul(SAMPLES_PER_SPHERE);
                let count = count.clamp(LEAST_SAMPLES, MOST_SAMPLES);
                SurfacePoints::of_samples(mesh, count, self.run.seed, NEIGHBOURS)
            }
            _ => SurfacePoints::of_vertices(mesh),
        };
        if points.len() == 0 {
            return Err(SimplifyError::unsupported("the surface has no area"));
        }
        Ok(points)
    }
}

/// Why there are fewer spheres than requested, or the error still changed at the end.
fn explain(
    requested: usize,
    target: usize,
    reached: usize,
    ended: Ended,
    diagnostics: &mut Diagnostics,
) {
    let instead = format!("{reached} spheres instead of {requested}");
    if reached < target {
        let why = match ended {
            Ended::IterationLimit => "the limit of rounds was reached (iterations)",
            _ => "clusters of too few points are dropped as fast as spheres are split",
        };
        diagnostics.warn(format!("{instead}: {why}"));
    } else if target < requested {
        diagnostics.warn(format!("{instead}: more need more surface points than there are"));
    } else if ended == Ended::IterationLimit {
        diagnostics
            .warn("stopped at the limit of rounds (iterations) while the error still changed");
    }
}

// ----------------------------------------------------------------------------
// The parameters of VMAS.

medial::parameters! {
    /// Parameters of VMAS; the defaults are those of the authors' program.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct VmasParams {
        /// Surface points: the vertices of the mesh (the authors), area-uniform samples (CGAL), or the
        /// vertices where there are enough for the requested spheres.
        points: Points = Points::Auto, "auto, vertices or samples";
        /// Weight of the Euclidean part of the energy, above 0 and at most 1; with a small one,
        /// spheres reach into features.
        lambda: f64 = 0.2, "pure number";
        /// Largest number of rounds.
        iterations: usize = 1_000, "rounds";
    }
}

/// The representation of the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Points {
    /// The vertices where there are at least 25 for each requested sphere, or else samples.
    Auto,
    /// Area-uniform samples, each adjacent to its nearest ones (CGAL).
    Samples,
    /// The vertices of the mesh, adjacent along its edges (the authors).
    Vertices,
}

impl VmasParams {
    /// With the kind of points for a number of spheres on a mesh of `vertices` vertices.
    fn resolved(self, spheres: usize, vertices: usize) -> Self {
        let points = match self.points {
            Points::Auto if vertices < VERTICES_PER_SPHERE.saturating_mul(spheres) => {
                Points::Samples
            }
            Points::Auto => Points::Vertices,
            points => points,
        };
        Self { points, ..self }
    }

    fn validate(self) -> Result<Self> {
        // Without the Euclidean part, two parallel planes leave a sphere undetermined.
        within("lambda", self.lambda, 1e-6..=1.0)?;
        within("iterations", self.iterations, 1..=100_000)?;
        Ok(self)
    }
}

// ----------------------------------------------------------------------------
// The complex: spheres are joined where their clusters are adjacent.

/// The pairs of spheres of which some points are adjacent, ascending, in ascending order.
fn edges(points: &SurfacePoints, labels: &[u32]) -> Vec<[u32; 2]> {
    let joined = points.links.par_iter().filter_map(|link| {
        let [a, b] = link.map(|v| labels[v as usize]);
        (a != b && a != NONE && b != NONE).then(|| [a.min(b), a.max(b)])
    });
    let mut edges: Vec<[u32; 2]> = joined.collect();
    edges.par_sort_unstable();
    edges.dedup();
    edges
}

/// The triangles of a graph whose edges are ascending pairs in ascending order.
fn triangles(edges: &[[u32; 2]]) -> Vec<[u32; 3]> {
    let on_edges = edges.par_iter().flat_map_iter(|&[a, b]| {
        let [mut of_a, mut of_b] = [a, b].map(|v| {
            let from = edges.partition_point(|edge| edge[0] < v);
            let to = edges.partition_point(|edge| edge[0] <= v);
            edges[from..to].iter().map(|edge| edge[1]).peekable()
        });
        let mut found = Vec::new();
        while let (Some(&c), Some(&d)) = (of_a.peek(), of_b.peek()) {
            if c == d {
                found.push([a, b, c]);
            }
            // Both advance where they agree.
            of_a.next_if(|&c| c <= d);
            of_b.next_if(|&d| d <= c);
        }
        found
    });
    on_edges.collect()
}
