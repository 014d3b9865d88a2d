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

use std::f64::consts::FRAC_PI_2;
use std::ops::Bound;
use std::sync::Arc;

use medial::Vec3;
use medial::complex::VoronoiFacets;
use medial::shape::Shape;
use medial::simplifier::{Diagnostics, Method, MethodInfo, NativeLevel, ParamFields, RunContext};
use umbrella::{Place, Umbrellas};

use crate::levels::{BySamples, within};
use crate::ranked::{FacetSet, FacetValue, Published, RankedFacets, Scale};
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
fn selection(
    shape: &Shape,
    params: DeyZhaoParams,
    run: &RunContext,
) -> Result<RankedFacets<'static>> {
    let set = FacetSet::of(shape)?;
    run.check()?;
    let delaunay = shape.delaunay()?;
    let umbrellas = Umbrellas::new(&delaunay, shape.cells()?.circumspheres());
    run.check()?;
    let mut diagnostics = Diagnostics::default();
    diagnostics.count("samples_without_umbrella", umbrellas.missing());
    diagnostics.count("umbrella_triangles_without_area", umbrellas.flat());
    let strength = Strength { facets: set.facets.clone(), umbrellas, params };
    Ok(RankedFacets::new(set, strength, scale(), diagnostics))
}

/// Step 3.
struct Strength {
    facets: Arc<VoronoiFacets>,
    umbrellas: Umbrellas,
    params: DeyZhaoParams,
}

impl FacetValue for Strength {
    /// The largest strength at which the facet dual to a Delaunay edge is kept: from either end, by
    /// either condition.
    fn value(&self, facet: usize) -> f64 {
        let [p, q] = self.ends(facet);
        self.from(p, q).max(self.from(q, p))
    }

    fn is_above(&self, level: f64) -> Box<dyn Fn(usize) -> bool + Sync + '_> {
        let DeyZhaoParams { theta, rho } = self.params;
        // Angles to a normal are compared by their cosine, so the threshold is a sine of `theta`.
        let cosine = (level * theta.to_radians()).min(FRAC_PI_2).sin();
        // An edge of an umbrella is perpendicular to a normal and no longer than two circumradii.
        let rims = cosine < 1e-6 || level * rho < 2.0 + 1e-6;
        let threshold = Threshold { level, cosine, ratio: level * rho, rims };
        Box::new(move |facet| {
            let [p, q] = self.ends(facet);
            let edge = self.umbrellas.position(q) - self.umbrellas.position(p);
            let length = edge.length();
            self.passes_from(p, q, edge, length, &threshold)
                || self.passes_from(q, p, edge, length, &threshold)
        })
    }
}

/// A strength as a cosine and a ratio, with which a facet is decided without computing an angle or a
/// quotient, except within [`ROUNDING`] of the threshold.
struct Threshold {
    level: f64,
    cosine: f64,
    ratio: f64,
    /// Whether an edge of an umbrella could pass.
    rims: bool,
}

/// Bound on the relative rounding error of a strength and a threshold together.
const ROUNDING: f64 = 1e-12;

impl Strength {
    fn ends(&self, facet: usize) -> [Place; 2] {
        self.facets.ends(facet).map(|v| self.umbrellas.place(v))
    }

    /// The strength from `p` alone, 0 for an edge of its umbrella.
    fn from(&self, p: Place, q: Place) -> f64 {
        let normals = self.umbrellas.normals(p);
        if normals.is_empty() || self.umbrellas.has_edge(p, q) {
            return 0.0;
        }
        let edge = self.umbrellas.position(q) - self.umbrellas.position(p);
        let length = edge.length();
        // Normals have either sign: the angle of the condition is that of two lines.
        let least = normals.iter().map(|n| n.dot(edge).abs()).fold(length, f64::min);
        self.by_angle(least, length).max(self.by_ratio(p, length))
    }

    /// Whether [`Strength::from`] is above a level. `edge` is `pq` or `qp`.
    #[inline]
    fn passes_from(
        &self,
        p: Place,
        q: Place,
        edge: Vec3,
        length: f64,
        threshold: &Threshold,
    ) -> bool {
        let normals = self.umbrellas.normals(p);
        // Without an umbrella there is no condition, and nothing is kept from this end.
        if normals.is_empty() {
            return false;
        }
        // The ratio first: one comparison against a product per normal. The search through the rim
        // last, since few edges pass.
        let passes =
            self.is_long(p, length, threshold) || self.is_steep(normals, edge, length, threshold);
        passes && !(threshold.rims && self.umbrellas.has_edge(p, q))
    }

    #[inline]
    fn is_steep(&self, normals: &[Vec3], edge: Vec3, length: f64, threshold: &Threshold) -> bool {
        let bound = threshold.cosine * length;
        let mut least = length;
        for normal in normals {
            least = f64::min(least, normal.dot(edge).abs());
            // One normal suffices to fail, and most edges fail at the first.
            if least <= bound * (1.0 - ROUNDING) {
                return false;
            }
        }
        least > bound * (1.0 + ROUNDING) || self.by_angle(least, length) > threshold.level
    }

    #[inline]
    fn is_long(&self, p: Place, length: f64, threshold: &Threshold) -> bool {
        let bound = threshold.ratio * self.umbrellas.largest_circumradius(p);
        length > bound * (1.0 - ROUNDING)
            && (length > bound * (1.0 + ROUNDING) || self.by_ratio(p, length) > threshold.level)
    }

    /// The strength by the angle condition: `least` is the smallest product of the edge with a normal,
    /// which belongs to the largest angle.
    fn by_angle(&self, least: f64, length: f64) -> f64 {
        (least / length).asin() / self.params.theta.to_radians()
    }

    /// The strength by the ratio condition.
    #[inline]
    fn by_ratio(&self, p: Place, length: f64) -> f64 {
        length / self.umbrellas.largest_circumradius(p) / self.params.rho
    }
}
