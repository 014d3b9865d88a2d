//! Dey-Zhao: the medial axis as a Voronoi subcomplex.
//!
//! T. K. Dey, W. Zhao: *Approximate medial axis as a Voronoi subcomplex*, ACM Solid Modeling 2002,
//! doi:10.1145/566282.566333; *Approximating the medial axis from the Voronoi diagram with a
//! convergence guarantee*, Algorithmica 38, 2004, doi:10.1007/s00453-003-1049-y. Algorithm MEDIAL:
//!
//! 1. The Delaunay triangulation of the samples.
//! 2. For each sample `p` its *umbrella* `U_p`: the Delaunay triangles whose dual Voronoi edges cross
//!    the plane through `p` normal to its pole vector `v_p` (file `umbrella.rs`).
//! 3. Each Delaunay edge `pq` that is not an edge of `U_p` is tested from `p`:
//!    - angle condition `[theta]`: `pq` makes an angle of less than `pi/2 - theta` with the normal of
//!      every triangle of `U_p`, angles between lines;
//!    - ratio condition `[rho]`: `|pq|` exceeds `rho` times the circumradius of every triangle of
//!      `U_p`.
//!
//!    If either holds, from either end, the dual facet is kept.
//! 4. The output is the closure of these facets; inside: facets all of whose vertices are inside.
//!
//! `theta = pi/8` and `rho = 8` for all inputs: the method has no parameter to tune, and does not
//! change under scaling.
//!
//! # The level
//! The paper has none: the density of the samples decides the size of the result. So a requested
//! number of spheres is met by a search over the number of samples, at the paper's constants
//! (`methods/levels.rs`). The sampling is of the same kind as the shape's, with
//! blue noise in place of vertices. All other levels use the shape's own samples.
//!
//! For comparison there is the *strength* `t`, which multiplies both thresholds, `[t theta]` and
//! `[t rho]`; the paper has `t = 1`. The value of a facet is the largest `t` at which it is kept. From
//! `t = 4` on no angle suffices, and only ratios count.
//!
//! # Deviations from the paper
//! - The paper restricts the result to the inside of a watertight surface that it reconstructs;
//!   here the surface is given.
//! - Step 4: the paper keeps the facets of the Delaunay edges that the surface encloses. Here a facet
//!   is inside if all its vertices are, so that every sphere is centred inside. In a part thinner than
//!   the spacing of the samples, enclosed edges have facets that reach outside; these are lost. The
//!   facet of an edge that crosses a dent of the surface can be inside; it is kept.
//! - A triangle without area has no normal. It is left out of its umbrellas, and counted. A sample
//!   without umbrella keeps no facet.
//! - The paper adds a bounding box to the samples, to make cells bounded. Here an unbounded Voronoi
//!   edge ends at infinity, in the direction of the outward normal of its hull triangle.

#[cfg(test)]
mod tests;
mod umbrella;

use std::ops::Bound;

use medial::geometry::{Delaunay, VertexId};
use medial::shape::Shape;
use medial::simplifier::{Diagnostics, Method, MethodInfo, NativeLevel, ParamFields, RunContext};
use umbrella::Umbrellas;

use crate::levels::{BySamples, within};
use crate::ranked::{FacetSet, Published, RankedFacets, Scale};
use crate::{Prepared, Result};

medial::parameters! {
    /// Parameters of the Voronoi subcomplex; the default is the paper's.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct DeyZhaoParams {
        /// `theta_0` of the angle condition.
        theta: f64 = 22.5, "degrees";
        /// `rho_0` of the ratio condition.
        rho: f64 = 8.0, "pure number";
    }
}

impl DeyZhaoParams {
    fn validate(self) -> Result<Self> {
        within("theta", self.theta, (Bound::Excluded(0.0), Bound::Excluded(90.0)))?;
        within("rho", self.rho, (Bound::Excluded(0.0), Bound::Excluded(f64::INFINITY)))?;
        Ok(self)
    }
}

/// The Voronoi subcomplex as a method.
pub fn method() -> Method<DeyZhaoParams> {
    let info = MethodInfo::new("dey-zhao", "Dey-Zhao Voronoi subcomplex")
        .citation(
            "Tamal K. Dey, Wulue Zhao 2002. Approximate medial axis as a Voronoi subcomplex. ACM \
             Symposium on Solid Modeling and Applications. https://doi.org/10.1145/566282.566333",
        )
        .bibtex(crate::references(&["DeyZhao2002"]))
        .summary(
            "Keeps the Voronoi facets whose Delaunay edge is steep to the surface, or long next to \
             the samples' spacing.",
        )
        .native(NativeLevel::larger_is_coarser(
            "strength",
            "multiple of the paper's two thresholds",
        ))
        .published(
            "the paper's constants, strength 1; other strengths, of both thresholds together, are \
             not in the paper",
        )
        .params(DeyZhaoParams::describe());
    Method::new(info, prepare)
}

fn prepare<'s>(shape: &'s Shape, params: DeyZhaoParams, run: &RunContext) -> Prepared<'s> {
    let params = params.validate()?;
    FacetSet::refuse_given(shape)?;
    let run_again = run.clone();
    Ok(Box::new(BySamples::new(shape, PUBLISHED, run, move |shape| {
        Ok(Box::new(selection(shape, params, &run_again)?))
    })?))
}

/// The strength of the paper's constants.
const PUBLISHED: f64 = 1.0;

fn scale() -> Scale {
    Scale {
        name: "strength",
        range: 0.0..=f64::MAX,
        inclusive: false,
        published: Published::Native(PUBLISHED),
    }
}

/// Steps 1 to 3 on the samples of a shape.
fn selection(shape: &Shape, params: DeyZhaoParams, run: &RunContext) -> Result<RankedFacets> {
    let set = FacetSet::of(shape)?;
    run.check()?;
    let delaunay = shape.delaunay()?;
    let umbrellas = Umbrellas::new(&delaunay, shape.cells()?.circumspheres());
    run.check()?;
    let mut diagnostics = Diagnostics::default();
    diagnostics.count("samples_without_umbrella", umbrellas.missing());
    diagnostics.count("umbrella_triangles_without_area", umbrellas.flat());
    let (facets, strength) =
        (set.facets.clone(), Strength { delaunay: &delaunay, umbrellas, params });
    Ok(RankedFacets::new(set, |facet| strength.of(facets.ends(facet)), scale(), diagnostics))
}

/// Step 3.
struct Strength<'a> {
    delaunay: &'a Delaunay,
    umbrellas: Umbrellas,
    params: DeyZhaoParams,
}

impl Strength<'_> {
    /// The largest strength at which the facet dual to a Delaunay edge is kept: from either end, by
    /// either condition.
    fn of(&self, [p, q]: [VertexId; 2]) -> f64 {
        self.from(p, q).max(self.from(q, p))
    }

    /// The strength from `p` alone, 0 for an edge of its umbrella.
    fn from(&self, p: VertexId, q: VertexId) -> f64 {
        let normals = self.umbrellas.normals(p);
        if normals.is_empty() || self.umbrellas.has_edge(p, q) {
            return 0.0;
        }
        let edge = self.delaunay.point(q) - self.delaunay.point(p);
        let length = edge.length();
        // Normals have either sign: the angle of the condition is that of two lines. The smallest product
        // of the edge with a normal belongs to the largest angle.
        let least = normals.iter().map(|n| n.dot(edge).abs()).fold(length, f64::min);
        let by_angle = (least / length).asin() / self.params.theta.to_radians();
        by_angle.max(length / self.umbrellas.largest_circumradius(p) / self.params.rho)
    }
}
