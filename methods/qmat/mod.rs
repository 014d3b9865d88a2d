//! Q-MAT: quadric error minimisation on the medial mesh.
//!
//! Li, Wang, Sun, Guo, Zhang, Wang 2015, *Q-MAT: Computing Medial Axis Transform by Quadratic Error
//! Minimization*, ACM Transactions on Graphics 35(1), <https://doi.org/10.1145/2753755>.
//!
//! 1. Each sphere gets the sum of the squared distances to the tangent planes of its slabs, of the
//!    cones of its lone edges (section 3.2, equations 1 and 4), and of the planes that keep stable
//!    boundaries from shrinking (section 4.4).
//! 2. Each edge gets the sphere of least summed error (equations 5 and 6) and the cost
//!    `(E + k) Γ²` (equation 8), with the stability ratio `Γ` (equation 3).
//! 3. The cheapest edge is taken. From `η` spheres on (by default: always) it must satisfy the link
//!    condition (section 4.5).
//! 4. A placement that folds a face over is replaced by the best of both ends and the midpoint, if
//!    one of them folds none; otherwise the edge is not collapsed (section 4.6).
//! 5. The edge is collapsed, the quadrics added, the edges of the merged sphere evaluated again.
//!
//! # Notation
//!
//! `m = (c, r)` a medial sphere; `n` an outward unit normal; `d` the distance of two centres; `g` the
//! gradient of the radius over a face; `k`, `k'`, `η` the paper's constants. Lengths are fractions
//! of the bounding-box diagonal, as the paper's constants presume.
//!
//! # Where the paper is silent
//!
//! - "Invertible" means that the smallest eigenvalue of `A` is above `1e-10` times the largest, which depends neither on scale nor on the number of summed quadrics.
//! - A minimiser with a negative radius is replaced by the midpoint of the edge.
//! - Equal costs, mostly the zeros of contained spheres, are ordered by `E`, then by ids.
//! - Centres closer than `1e-12` are one point: `Γ` and the cost are 0, and they go first, small
//!   stars before large ones.
//! - A face whose balls have no common outer tangent plane, or whose centres are collinear, adds
//!   no slab, and a lone edge with one ball inside the other no cone. Both are counted.
//!
//! # Deviations from the paper
//!
//! - The topology is kept from the first collapse on (`topology_from=all`, the meaning of `auto` at
//!   every level but the published one). The paper checks only once `η = 200` spheres are left, which
//!   saves time but leaves the defects of earlier collapses. With
//!   `topology_from=200` the results of 1,000 spheres have wrong Betti numbers on seven of the twelve
//!   shared meshes; with checks from the start, on none whose initial mesh has the right ones.
//!   [`Level::Published`] checks from 200 spheres on by default.
//! - If the optimum of an edge folds a face over, section 4.6 collapses the edge at once at the best
//!   other placement, which costs more than the edge was queued at. Here the edge goes back into the
//!   queue at that cost, and is collapsed when nothing cheaper is left.
//! - An edge that the link condition or the folding test rejects is tried again once a collapse
//!   changes the vertices that held it back. The paper states of the folding test only that the edge
//!   "will not be collapsed".
//! - The link condition is that of Dey et al. in full, for holes and for voids, after elementary
//!   expansions ([`keeps_homotopy`](medial::complex::collapse::CollapseComplex::keeps_homotopy)): a
//!   collapse that closes a hole and a void at once passes. As printed in their paper the condition
//!   blocks pockets of spheres for good.
//! - Even so the condition is sufficient, not necessary. When it rejects every edge left, at 500
//!   spheres or fewer, an edge is taken whose collapse brings the Betti numbers no farther from those
//!   of the initial mesh (`contract.rs`); section 4.5 would stop. With `topology_from=200` this also
//!   removes voids that unchecked collapses made.
//! - A minimiser farther from the midpoint of its edge than the two balls extend, `d + max r`, is
//!   not used, as if `A` were singular. Where slabs are nearly parallel, `A` can pass as invertible
//!   and place a sphere far outside the shape.

mod contract;
mod quadric;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use contract::Contraction;
use medial::complex::MedialMesh;
use medial::shape::{Shape, ShapeError};
use medial::simplifier::{
    Diagnostics, Level, Method, MethodInfo, ParamFields, RunContext, Simplification, Simplified,
    SimplifyError,
};
use serde::{Deserialize, Serialize};

use crate::levels::{checked, some_spheres, why_stopped, within};
use crate::{Prepared, Result};

/// Spheres of [`Level::Published`]: the count of the paper's Table II.
const PUBLISHED: usize = 100;

/// The Q-MAT simplifier.
///
/// Supports [`Level::Spheres`]; a request finer than the one before starts again. Cost
/// `O(n log n)` for an initial mesh of bounded degree.
pub fn method() -> Method<QmatParams> {
    let info = MethodInfo::new("qmat", "Q-MAT")
        .citation(
            "Pan Li, Bin Wang, Feng Sun, Xiaohu Guo, Caiming Zhang, Wenping Wang 2015. Q-MAT: \
             Computing Medial Axis Transform by Quadratic Error Minimization. ACM Transactions on \
             Graphics 35(1). https://doi.org/10.1145/2753755",
        )
        .bibtex(crate::references(&["LiEtAl2015"]))
        .incremental()
        .summary(
            "Collapses the edges of the medial mesh by slab quadric error and stability ratio, \
             each merged sphere placed where its error is least.",
        )
        .published(
            "100 spheres, the topology kept from 200 spheres on: the paper names no default count, \
             its Table II compares at 100",
        )
        .params(QmatParams::describe());
    Method::new(info, prepare)
}

fn prepare<'s>(shape: &'s Shape, params: QmatParams, run: &RunContext) -> Prepared<'s> {
    let params = params.validate()?;
    let initial = shape.initial()?;
    if initial.spheres.is_empty() {
        return Err(ShapeError::EmptyMedialMesh.into());
    }
    run.step(0, initial.spheres.len())?;
    // At the preparation the level is unknown; most levels share the parameters of this one.
    let contraction = Contraction::new(&initial, params.at(Level::Spheres(1)));
    Ok(Box::new(PreparedQmat { initial, params, run: run.clone(), contraction }))
}

/// One shape, as far as it was contracted.
struct PreparedQmat {
    initial: Arc<MedialMesh>,
    params: QmatParams,
    run: RunContext,
    contraction: Contraction,
}

impl Simplification for PreparedQmat {
    fn at(&mut self, level: Level) -> Result<Simplified> {
        let mut diagnostics = Diagnostics::default();
        let target = match some_spheres(level)? {
            Level::Spheres(count) => count,
            Level::Published => {
                diagnostics.warn(format!(
                    "the paper names no default count; used {PUBLISHED} spheres as in its Table II"
                ));
                PUBLISHED
            }
            Level::Native(_) => {
                let why = "Q-MAT has no native level; request a number of spheres, such as 100";
                return Err(SimplifyError::unsupported(why));
            }
        };
        let spheres = self.initial.spheres.len();
        if target >= spheres {
            if target > spheres {
                diagnostics.warn(format!(
                    "{spheres} spheres instead of {target}: the initial medial mesh has no more"
                ));
            }
            let mesh = MedialMesh::clone(&self.initial);
            return Ok(Simplified { diagnostics, ..Simplified::new(mesh, level) });
        }
        let params = self.params.at(level);
        let is_of_other = self.contraction.params != params;
        // Collapses are not undone, so a finer level starts again.
        if is_of_other || self.contraction.complex.sphere_count() < target {
            self.contraction = Contraction::new(&self.initial, params);
        }
        self.contraction.run_to(&self.initial, target, &self.run)?;
        self.contraction.diagnose(&mut diagnostics);
        let reached = self.contraction.complex.sphere_count();
        if reached > target {
            let keeps_topology = self.contraction.keeps_topology();
            let why = why_stopped(&mut self.contraction.complex, keeps_topology);
            diagnostics.warn(format!("{reached} spheres instead of {target}: {why}"));
        }
        checked(level, self.contraction.complex.to_mesh(), None, diagnostics)
    }
}

// ----------------------------------------------------------------------------
// The parameters of Q-MAT.

/// `η` of the paper: the number of spheres from which on it checks the link condition.
const PUBLISHED_FROM: usize = 200;

medial::parameters! {
    /// Parameters of Q-MAT; the defaults are the paper's, except `topology_from`. Lengths are
    /// fractions of the bounding-box diagonal.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct QmatParams {
        /// `k` of equation 8, added to the error of every edge: the larger, the earlier spikes go.
        k: f64 = 1e-5, "squared fraction of the diagonal";
        /// `k'` of section 4.4, the weight of the planes that keep stable boundaries from shrinking.
        k_boundary: f64 = 0.1, "pure number";
        /// From this sphere count on a collapse has to keep the topology (section 4.5). `all` is from
        /// the start, 200 is the paper's, `auto` is 200 at the published level and `all` at others.
        topology_from: TopologyFrom = TopologyFrom::Auto, "spheres, or all, never or auto";
    }
}

/// From which sphere count on a collapse has to satisfy the link condition.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(
    rename_all = "lowercase",
    expecting = "topology_from is a number of spheres, `all`, `never` or `auto`"
)]
pub enum TopologyFrom {
    /// From the first collapse on; at [`Level::Published`]
    /// from 200 spheres on, as in the paper.
    Auto,
    /// From the first collapse on.
    All,
    /// Never.
    Never,
    /// While at most this many spheres are left: `η` of the paper's Algorithm 1.
    #[serde(untagged)]
    Spheres(usize),
}

impl TopologyFrom {
    /// Whether a collapse has to keep the topology when `spheres` are left.
    pub fn applies(self, spheres: usize) -> bool {
        match self {
            Self::Auto | Self::All => true,
            Self::Spheres(from) => spheres <= from,
            Self::Never => false,
        }
    }

    /// Its meaning at a level: never [`TopologyFrom::Auto`].
    fn at(self, level: Level) -> Self {
        match (self, level) {
            (Self::Auto, Level::Published) => Self::Spheres(PUBLISHED_FROM),
            (Self::Auto, _) => Self::All,
            (given, _) => given,
        }
    }
}

impl QmatParams {
    /// The parameters at a level.
    fn at(self, level: Level) -> Self {
        Self { topology_from: self.topology_from.at(level), ..self }
    }

    fn validate(self) -> Result<Self> {
        within("k", self.k, 0.0..f64::INFINITY)?;
        within("k_boundary", self.k_boundary, 0.0..f64::INFINITY)?;
        Ok(self)
    }
}
