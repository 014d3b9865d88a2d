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
//! (`size=density`; `methods/levels.rs`). The sampling is of the same kind as the shape's, with
//! blue noise in place of vertices. All other levels use the shape's own samples.
//!
//! For comparison there is the *strength* `t`, which multiplies both thresholds, `[t theta]` and
//! `[t rho]`; the paper has `t = 1`. The value of a facet is the largest `t` at which it is kept. With
//! `size=ranking` a number of spheres is met by the facets of largest value. From `t = 4` on no angle
//! suffices, and only ratios count. Facets of equal value are kept in the order of the size of their
//! balls, then spread over the shape (`methods/ranked.rs`).
//!
//! # Deviations from the paper
//! - The paper restricts the result to the inside of a watertight surface that it reconstructs;
//!   here the surface is given.
//! - Step 4: the paper keeps the facets of the Delaunay edges that the surface encloses. Here a facet
//!   is inside if all its vertices are, so that every sphere is centred inside. In a part thinner than
//!   the spacing of the samples, enclosed edges have facets that reach outside; these are lost. The
//!   facet of an edge that crosses a dent of the surface can be inside; it is kept. `inside=edge`
//!   drops the latter, judged by the middle of the edge, and counts both kinds
//!   (`enclosed_edges_without_facet`, `facets_of_edges_not_enclosed`).
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
use medial::geometry::{Delaunay, VertexId};
use medial::shape::{Shape, ShapeError};
use medial::simplifier::{Diagnostics, Method, MethodInfo, NativeLevel, ParamFields, RunContext};
use medial::surface::{InsideTest, Side};
use serde::{Deserialize, Serialize};
use umbrella::{Place, Umbrellas};

use crate::levels::{ByKnob, within};
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
        /// The tested conditions; the paper's figures show each alone.
        condition: Condition = Condition::Both, "both, angle or ratio";
        /// Meet a number of spheres by the number of samples, as the paper does, or by strengthening
        /// both thresholds on the given samples.
        size: Size = Size::Density, "density or ranking";
        /// The part of a facet that must be inside: its vertices, or the middle of its Delaunay edge
        /// too, and then the difference is counted.
        inside: Inside = Inside::Vertices, "vertices or edge";
    }
}

/// The part of a facet that must be inside.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Inside {
    /// All of its vertices.
    Vertices,
    /// All of its vertices and the middle of its Delaunay edge; differences between the two readings
    /// are counted.
    Edge,
}

/// How a requested number of spheres is met.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Size {
    /// The number of samples, both thresholds as they are.
    Density,
    /// The strength of both thresholds, the samples as they are.
    Ranking,
}

/// The conditions of step 3.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Condition {
    /// Either suffices, as published.
    Both,
    /// The angle condition alone, for comparison.
    Angle,
    /// The ratio condition alone, for comparison.
    Ratio,
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
    Ok(match params.size {
        Size::Density => {
            FacetSet::refuse_given(shape)?;
            Box::new(ByKnob::of_samples(shape, PUBLISHED, run, move |shape| {
                Ok(Box::new(selection(shape, params)?))
            })?)
        }
        Size::Ranking => Box::new(selection(shape, params)?),
    })
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
fn selection(shape: &Shape, params: DeyZhaoParams) -> Result<RankedFacets<'static>> {
    let set = FacetSet::of(shape)?;
    let delaunay = shape.delaunay()?;
    let umbrellas = Umbrellas::new(&delaunay, shape.cells()?.circumspheres());
    let mut diagnostics = Diagnostics::default();
    diagnostics.count("samples_without_umbrella", umbrellas.missing());
    diagnostics.count("umbrella_triangles_without_area", umbrellas.flat());
    let mut strength = Strength { facets: set.facets.clone(), umbrellas, params, enclosed: None };
    if params.inside == Inside::Edge {
        restrict(&mut strength, shape, &mut diagnostics)?;
    }
    Ok(RankedFacets::new(set, strength, scale(), diagnostics))
}

/// Step 3.
struct Strength {
    facets: Arc<VoronoiFacets>,
    umbrellas: Umbrellas,
    params: DeyZhaoParams,
    /// For each facet whether its edge is enclosed; `None` if that is not required.
    enclosed: Option<Vec<bool>>,
}

impl FacetValue for Strength {
    /// The largest strength at which the facet dual to a Delaunay edge is kept: from either end, by
    /// either condition.
    fn value(&self, facet: usize) -> f64 {
        if !self.is_enclosed(facet) {
            return 0.0;
        }
        let [p, q] = self.facets.ends(facet);
        self.of_edge(p, q)
    }

    fn is_above(&self, level: f64) -> Box<dyn Fn(usize) -> bool + Sync + '_> {
        let DeyZhaoParams { theta, rho, .. } = self.params;
        // Angles to a normal are compared by their cosine, so the threshold is a sine of `theta`.
        let cosine = (level * theta.to_radians()).min(FRAC_PI_2).sin();
        // An edge of an umbrella is perpendicular to a normal and no longer than two circumradii.
        let rims = cosine < 1e-6 || level * rho < 2.0 + 1e-6;
        let threshold = Threshold { level, cosine, ratio: level * rho, rims };
        Box::new(move |facet| {
            if !self.is_enclosed(facet) {
                return false;
            }
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
    /// The strength of a Delaunay edge: from either end, by either condition.
    fn of_edge(&self, p: VertexId, q: VertexId) -> f64 {
        let [p, q] = [p, q].map(|v| self.umbrellas.place(v));
        self.from(p, q).max(self.from(q, p))
    }

    #[inline]
    fn is_enclosed(&self, facet: usize) -> bool {
        self.enclosed.as_ref().is_none_or(|enclosed| enclosed[facet])
    }

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
        let [by_angle, by_ratio] = [self.by_angle(least, length), self.by_ratio(p, length)];
        match self.params.condition {
            Condition::Both => by_angle.max(by_ratio),
            Condition::Angle => by_angle,
            Condition::Ratio => by_ratio,
        }
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
        let condition = self.params.condition;
        let normals = self.umbrellas.normals(p);
        // Without an umbrella there is no condition, and nothing is kept from this end.
        if normals.is_empty() {
            return false;
        }
        // The ratio first: one comparison against a product per normal. The search through the rim
        // last, since few edges pass.
        let passes = (condition != Condition::Angle && self.is_long(p, length, threshold))
            || (condition != Condition::Ratio && self.is_steep(normals, edge, length, threshold));
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

// ----------------------------------------------------------------------------
// Step 4 by Delaunay edges: those that the surface encloses.

/// Keeps the facets whose edge has its middle inside, and counts the differences between the two
/// readings of step 4 at the paper's constants: `facets_of_edges_not_enclosed` have all vertices
/// inside but the middle of the edge outside, `enclosed_edges_without_facet` the reverse.
/// `O(n log n)`.
fn restrict(
    strength: &mut Strength,
    shape: &Shape,
    diagnostics: &mut Diagnostics,
) -> Result<(), ShapeError> {
    let delaunay = shape.delaunay()?;
    let inside = shape.inside_test();
    let dual: Vec<[VertexId; 2]> =
        (0..strength.facets.len()).map(|facet| strength.facets.ends(facet)).collect();
    let enclosed = are_enclosed(&dual, &delaunay, &inside);
    let outside = dual
        .iter()
        .zip(&enclosed)
        .filter(|&(&[p, q], &enclosed)| !enclosed && strength.of_edge(p, q) > PUBLISHED);
    diagnostics.count("facets_of_edges_not_enclosed", outside.count());
    let mut others = edges_but(&delaunay, &dual);
    others.retain(|&[p, q]| strength.of_edge(p, q) > PUBLISHED);
    let bare = are_enclosed(&others, &delaunay, &inside).into_iter().filter(|&enclosed| enclosed);
    diagnostics.count("enclosed_edges_without_facet", bare.count());
    strength.enclosed = Some(enclosed);
    Ok(())
}

/// For each edge whether its middle is inside.
fn are_enclosed(edges: &[[VertexId; 2]], delaunay: &Delaunay, inside: &InsideTest) -> Vec<bool> {
    let middles: Vec<Vec3> =
        edges.iter().map(|&[p, q]| delaunay.point(p).midpoint(delaunay.point(q))).collect();
    inside.sides(&middles).into_iter().map(|side| side == Side::Inside).collect()
}

/// The finite Delaunay edges, each once, except `some`.
fn edges_but(delaunay: &Delaunay, some: &[[VertexId; 2]]) -> Vec<[VertexId; 2]> {
    let mut known: Vec<[u32; 2]> =
        some.iter().map(|&[p, q]| [p.0.min(q.0), p.0.max(q.0)]).collect();
    known.sort_unstable();
    let mut edges: Vec<[u32; 2]> = Vec::new();
    for cell in delaunay.finite_cells() {
        let v = delaunay.vertices(cell);
        let pairs = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];
        edges.extend(pairs.map(|[i, j]| [v[i].0.min(v[j].0), v[i].0.max(v[j].0)]));
    }
    edges.sort_unstable();
    edges.dedup();
    edges.retain(|edge| known.binary_search(edge).is_err());
    edges.into_iter().map(|edge| edge.map(VertexId)).collect()
}
