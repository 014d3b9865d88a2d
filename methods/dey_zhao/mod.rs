//! Dey-Zhao: the medial axis as a Voronoi subcomplex.
//!
//! T. K. Dey, W. Zhao: *Approximate medial axis as a Voronoi subcomplex*, ACM Solid Modeling 2002,
//! doi:10.1145/566282.566333; *Approximating the medial axis from the Voronoi diagram with a
//! convergence guarantee*, Algorithmica 38, 2004, doi:10.1007/s00453-003-1049-y. Algorithm MEDIAL:
//!
//! 1. The Delaunay triangulation of the samples.
//! 2. For each sample `p` its *umbrella* `U_p`: the Delaunay triangles whose dual Voronoi edges cross
//!    the plane through `p` normal to its pole vector `v_p` (file `umbrella.rs`).
//! 3. Each Delaunay edge `pq` that is no edge of `U_p` is tested from `p`:
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
//! The paper has none. Here it is the *strength* `t`, 1 for the paper's: both thresholds at once,
//! `[t theta]` and `[t rho]`. A facet's value is the largest `t` at which it would be kept, and a
//! number of spheres asks for the facets of largest value. From `t = 4` on no angle is
//! enough, and only ratios count.
//!
//! # Deviations from the paper
//! - The paper restricts the result to the inside of a watertight surface that it reconstructs;
//!   here the surface is given.
//! - A triangle without area has no normal and is left out of its umbrellas, and counted. A sample
//!   without umbrella keeps no facet.
//! - A facet of the box of the samples, which the paper adds to bound cells, is not needed: an
//!   unbounded Voronoi edge has the outward normal of its hull triangle for its far end.

mod umbrella;

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use medial::complex::VoronoiFacets;
use medial::geometry::{Delaunay, VertexId};
use medial::shape::Shape;
use medial::simplifier::{
    Diagnostics, MedialSimplifier, MethodInfo, NativeLevel, ParamInfo, Params, RunContext,
    Simplification, SimplifyError,
};
use serde::{Deserialize, Serialize};

use crate::ranked::Scale;
use crate::ranked_facets::{FacetSet, FacetValue, RankedFacets};
use umbrella::Umbrellas;

/// The Voronoi subcomplex as a method.
pub struct DeyZhao {
    info: MethodInfo,
}

/// Parameters of the Voronoi subcomplex; the default is the paper's.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DeyZhaoParams {
    /// `theta_0` of the angle condition, in degrees.
    pub theta: f64,
    /// `rho_0` of the ratio condition, a pure number.
    pub rho: f64,
    /// Which of the two conditions are tested.
    pub condition: Condition,
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

impl Default for DeyZhaoParams {
    fn default() -> Self {
        Self { theta: 22.5, rho: 8.0, condition: Condition::Both }
    }
}

impl DeyZhaoParams {
    fn validate(self) -> Result<Self, SimplifyError> {
        if !(self.theta > 0.0 && self.theta < 90.0) {
            let message = format!("theta = {} is not between 0 and 90 degrees", self.theta);
            return Err(SimplifyError::Parameter(message));
        }
        if !(self.rho > 0.0 && self.rho.is_finite()) {
            let message = format!("rho = {} is not positive", self.rho);
            return Err(SimplifyError::Parameter(message));
        }
        Ok(self)
    }

    fn describe() -> Vec<ParamInfo> {
        let Self { theta, rho, .. } = Self::default();
        let param = |name, default: String, unit, help| ParamInfo { name, default, unit, help };
        vec![
            param("theta", theta.to_string(), "degrees", "theta_0 of the angle condition"),
            param("rho", rho.to_string(), "", "rho_0 of the ratio condition"),
            param(
                "condition",
                "both".into(),
                "both | angle | ratio",
                "conditions that are tested; the paper's figures show each alone",
            ),
        ]
    }
}

impl DeyZhao {
    /// The method with its description.
    pub fn new() -> Self {
        Self {
            info: MethodInfo {
                id: "dey-zhao",
                title: "Dey-Zhao Voronoi subcomplex",
                citation: "Dey, Zhao 2002, Approximate medial axis as a Voronoi subcomplex, ACM \
                           Solid Modeling, doi:10.1145/566282.566333",
                summary: "Keeps the Voronoi facets whose Delaunay edge is steep to the surface, or \
                          long beside the samples' spacing.",
                native: Some(NativeLevel {
                    name: "strength",
                    unit: "multiple of the paper's two thresholds",
                    larger_is_coarser: true,
                }),
                published: "the paper's constants, strength 1; for other counts both thresholds \
                            are strengthened together, which is not in the paper",
                params: DeyZhaoParams::describe(),
            },
        }
    }
}

impl Default for DeyZhao {
    fn default() -> Self {
        Self::new()
    }
}

impl MedialSimplifier for DeyZhao {
    fn info(&self) -> &MethodInfo {
        &self.info
    }

    fn prepare<'s>(
        &self,
        shape: &'s Shape,
        params: &Params,
        _run: &RunContext,
    ) -> Result<Box<dyn Simplification + 's>, SimplifyError> {
        let params = params.typed::<DeyZhaoParams>()?.validate()?;
        let set = FacetSet::of(shape)?;
        let delaunay = shape.delaunay()?;
        let umbrellas = Umbrellas::new(&delaunay, shape.cells()?.circumspheres());
        let mut diagnostics = Diagnostics::default();
        diagnostics.count("samples_without_umbrella", umbrellas.missing());
        diagnostics.count("umbrella_triangles_without_area", umbrellas.flat());
        let scale =
            Scale { name: "strength", range: 0.0..=f64::MAX, inclusive: false, no_published: "" };
        let strength = Strength { facets: set.facets.clone(), delaunay, umbrellas, params };
        Ok(Box::new(RankedFacets::new(set, strength, scale, Some(1.0), diagnostics)))
    }
}

/// Step 3.
struct Strength {
    facets: Arc<VoronoiFacets>,
    delaunay: Arc<Delaunay>,
    umbrellas: Umbrellas,
    params: DeyZhaoParams,
}

impl FacetValue for Strength {
    /// The largest strength at which the facet dual to a Delaunay edge is kept: from either end, by
    /// either condition.
    fn value(&self, facet: usize) -> f64 {
        let [p, q] = self.facets.ends(facet);
        self.from(p, q, 0.0).max(self.from(q, p, 0.0))
    }

    fn is_above(&self, facet: usize, level: f64) -> bool {
        let [p, q] = self.facets.ends(facet);
        self.from(p, q, level) > level || self.from(q, p, level) > level
    }
}

impl Strength {
    /// The strength from `p` alone, 0 for an edge of its umbrella. Where it is not above `level`
    /// anything up to `level` may be returned.
    fn from(&self, p: VertexId, q: VertexId, level: f64) -> f64 {
        let DeyZhaoParams { theta, rho, condition } = self.params;
        let edge = self.delaunay.point(q) - self.delaunay.point(p);
        let length = edge.length();
        let mut strength = match condition {
            Condition::Angle => 0.0,
            _ => length / self.umbrellas.largest_circumradius(p) / rho,
        };
        // The angles cannot bring it above the level if the cosine of one is no more than this.
        let theta = theta.to_radians();
        let enough = (level * theta).min(FRAC_PI_2).sin() * (1.0 - 1e-12);
        let (mut least, by_angle) = (1.0, condition != Condition::Ratio);
        let mut triangles = self.umbrellas.of(p).peekable();
        if triangles.peek().is_none() {
            return 0.0;
        }
        for triangle in triangles {
            if triangle.corners.contains(&q) {
                return 0.0;
            }
            // The least cosine belongs to the largest angle.
            least = f64::min(least, triangle.normal.dot(edge).abs() / length);
            if least <= enough && strength <= level && level > 0.0 {
                return 0.0;
            }
        }
        if by_angle && least > enough {
            strength = f64::max(strength, least.asin() / theta);
        }
        strength
    }
}
