//! Coverage Axis and Coverage Axis++: few given inner spheres that cover the surface.
//!
//! Z. Dou, C. Lin, R. Xu, L. Yang, S. Xin, T. Komura, W. Wang 2022, *Coverage Axis: Inner Point Selection
//! for 3D Shape Skeletonization*, Computer Graphics Forum 41(2), <https://doi.org/10.1111/cgf.14484>;
//! Z. Wang, Z. Dou, R. Xu, C. Lin, Y. Liu, X. Long, S. Xin, T. Komura, X. Yuan, W. Wang 2024, *Coverage
//! Axis++: Efficient Inner Point Selection for 3D Shape Skeletonization*, Computer Graphics Forum 43(5),
//! <https://doi.org/10.1111/cgf.15143>. The formulas are those of the authors' public programs; of the
//! papers only the abstracts were available.
//!
//! 1. Samples of the surface are to be covered; candidates are the spheres of the initial medial mesh, all
//!    inner Voronoi vertices (this file).
//! 2. A ball inflated by `delta` covers the samples that it contains (`coverage.rs`).
//! 3. Coverage Axis takes a smallest set of balls that covers all samples (`exact.rs`);
//!    Coverage Axis++ one ball after the other, by its cover, its distance to those chosen, and
//!    how small it is (`coverage.rs`).
//! 4. The spheres chosen, with the radii that they had, are connected (`connect.rs`).
//!
//! # Notation
//!
//! `p_i` a sample, `(c_j, r_j)` a candidate, `D` the coverage matrix, `delta` the dilation in longest sides
//! of the bounding box, the unit of the authors' programs, which scale that side to 1.
//!
//! # Where the programs are silent
//!
//! - A sample that no candidate covers makes the exact cover infeasible, and the greedy choice, whose
//!   scores become 0/0, takes the first candidate for ever. Such samples are left out and counted.
//! - A value that is the same for all candidates scores 0; a candidate is taken once.
//! - Candidates with a radius below `1e-9` diagonals are dropped: their penalty has no bound.
//! - Of equal distances to two anchors the one chosen first wins.
//! - The topology of the result is not guaranteed. Nothing is repaired, and the evaluation reports the Betti numbers.
//!
//! # Deviations from the programs
//!
//! - Random candidates are left out.
//! - A number of spheres ends the greedy choice early. Where fewer spheres cover everything, and for exact
//!   covers, it is met by a search on `delta`.
//! - The exact cover is sought by another solver than the authors', after reductions that keep the
//!   optimum. Smallest covers are not unique, so the spheres are others; their number is the same where
//!   the search ends with a proof, which the counts `cover_bound` and `spheres` show.

mod connect;
mod coverage;
mod exact;
#[cfg(test)]
mod tests;

use std::ops::RangeInclusive;
use std::sync::Arc;

use coverage::{Coverage, penalties};
use medial::Vec3;
use medial::complex::{MedialMesh, Sphere};
use medial::shape::Shape;
use medial::simplifier::{
    Diagnostics, Level, Method, MethodInfo, NativeLevel, ParamFields, RunContext, Simplification,
    Simplified, SimplifyError,
};
use medial::surface::{Sampling, sample};
use serde::{Deserialize, Serialize};

use crate::levels::{Knob, Probe, SizeSearch, level_within, some_spheres};
use crate::{Prepared, Result};

/// Limit of chosen spheres in the authors' scripts.
const PUBLISHED_PICKS: usize = 100;
/// `delta` of the scripts, by which balls are inflated before they cover, in longest sides.
const PUBLISHED_DILATION: f64 = 0.02;
/// Limit of chosen spheres at a native level.
const MAX_PICKS: usize = 1000;
/// Area-uniform samples to be covered, as in the script of Coverage Axis++.
const SAMPLES: usize = 1500;

/// Coverage Axis and Coverage Axis++ as a method.
///
/// Supports all levels but an error bound. Memory: two bits for each candidate and sample.
pub fn method() -> Method<CoverageAxisParams> {
    let info = MethodInfo::new("coverage-axis", "Coverage Axis++")
        .seeded()
        .citation(
            "Zhiyang Dou, Cheng Lin, Rui Xu, Lei Yang, Shiqing Xin, Taku Komura, Wenping Wang 2022. \
             Coverage Axis: Inner Point Selection for 3D Shape Skeletonization. Computer Graphics \
             Forum 41(2). https://doi.org/10.1111/cgf.14484; Zimeng Wang, Zhiyang Dou, Rui Xu, Cheng \
             Lin, Yuan Liu, Xiaoxiao Long, Shiqing Xin, Taku Komura, Xiaoming Yuan, Wenping Wang \
             2024. Coverage Axis++: Efficient Inner Point Selection for 3D Shape Skeletonization. \
             Computer Graphics Forum 43(5). https://doi.org/10.1111/cgf.15143",
        )
        .bibtex(crate::references(&["DouEtAl2022", "WangEtAl2024"]))
        .summary(
            "Chooses inner spheres that, slightly inflated, cover the surface, and connects them by \
             their regions on the medial mesh.",
        )
        .native(NativeLevel::larger_is_coarser("delta", "fraction of the longest side"))
        .published("delta = 0.02 of the longest side and at most 100 spheres, as in the scripts")
        .params(CoverageAxisParams::describe());
    Method::new(info, prepare)
}

fn prepare<'s>(shape: &'s Shape, params: CoverageAxisParams, run: &RunContext) -> Prepared<'s> {
    let initial = shape.initial()?;
    run.step(0, initial.spheres.len())?;
    let instance = Instance::new(shape, &initial, run.seed)?;
    let axis = Axis {
        penalties: penalties(&instance.spheres),
        instance,
        initial,
        select: params.select,
        run: run.clone(),
    };
    // The inverse dilation gives more spheres when it is turned up, as a search expects of a knob.
    let range = 1.0 / DILATIONS.end()..=1.0 / DILATIONS.start();
    let (count, unit) = ("inverse_dilation_in_thousandths", "longest sides over the dilation");
    let knob = Knob { count, unit, range, steps: 1e3, rate: 0.5, exponent: 1.3 };
    Ok(Box::new(PreparedCoverage { search: SizeSearch::new(knob, run), axis }))
}

/// One shape, with its candidates.
struct PreparedCoverage {
    axis: Axis,
    search: SizeSearch,
}

struct Axis {
    instance: Instance,
    penalties: Vec<f64>,
    initial: Arc<MedialMesh>,
    select: Select,
    run: RunContext,
}

impl Simplification for PreparedCoverage {
    fn at(&mut self, level: Level) -> Result<Simplified> {
        let Self { axis, search } = self;
        let (dilation, most) = match some_spheres(level)? {
            Level::Spheres(count) if axis.select == Select::Greedy => (PUBLISHED_DILATION, count),
            Level::Spheres(count) => {
                // The search expects more spheres at larger values: it gets the inverse dilation.
                return search.at(count, f64::recip, |value| axis.at(value.recip(), MAX_PICKS));
            }
            Level::Native(delta) => (level_within("delta", delta, DILATIONS)?, MAX_PICKS),
            Level::Published => (PUBLISHED_DILATION, PUBLISHED_PICKS),
        };
        let Probe { mesh, diagnostics } = axis.at(dilation, most)?;
        if let Level::Spheres(count) = level
            && mesh.spheres.len() < count
        {
            // These cover everything: more spheres need a smaller dilation.
            let most = MAX_PICKS.max(2 * count);
            return search.at(count, f64::recip, |value| axis.at(value.recip(), most));
        }
        let native_level = Some(dilation);
        Ok(Simplified { native_level, diagnostics, ..Simplified::new(mesh, level) })
    }
}

impl Axis {
    /// Steps 2 to 4, with at most `most` spheres where they have an order.
    fn at(&self, dilation: f64, most: usize) -> Result<Probe> {
        let Instance { samples, spheres, too_small, side, .. } = &self.instance;
        let coverage = Coverage::new(samples, spheres, dilation * side);
        let mut diagnostics = Diagnostics::default();
        diagnostics.count("candidates", spheres.len());
        diagnostics.count("candidates_too_small", *too_small);
        diagnostics.count("samples", samples.len());
        let chosen = match self.select {
            Select::Greedy => self.greedy(&coverage, most, &mut diagnostics)?,
            Select::Exact => self.exact(&coverage, &mut diagnostics)?,
        };
        if chosen.is_empty() {
            return Err(SimplifyError::unsupported(format!(
                "no candidate covers a sample at delta = {dilation}: use a larger dilation, or denser \
                 samples of the shape"
            )));
        }
        let mesh = self.connected(&chosen, &mut diagnostics)?;
        Ok(Probe { mesh, diagnostics })
    }

    fn greedy(
        &self,
        coverage: &Coverage,
        most: usize,
        diagnostics: &mut Diagnostics,
    ) -> Result<Vec<u32>> {
        let spheres = &self.instance.spheres;
        let picks = coverage::choose(spheres, coverage, &self.penalties, most, &self.run)?;
        diagnostics.count("uncoverable_samples", picks.uncoverable);
        diagnostics.count("uncovered_samples", picks.uncovered);
        if picks.uncovered > 0 {
            let percent = 100.0 * picks.uncovered as f64 / coverage.columns() as f64;
            diagnostics.warn(format!(
                "{} spheres leave {} of {} samples uncovered ({percent:.1} %)",
                picks.chosen.len(),
                picks.uncovered,
                coverage.columns()
            ));
        }
        warn_of_uncoverable(picks.uncoverable, diagnostics);
        Ok(picks.chosen)
    }

    fn exact(&self, coverage: &Coverage, diagnostics: &mut Diagnostics) -> Result<Vec<u32>> {
        let cover = exact::cover(coverage, &self.run)?;
        diagnostics.count("uncoverable_samples", cover.uncoverable);
        diagnostics.count("cover_bound", cover.bound);
        warn_of_uncoverable(cover.uncoverable, diagnostics);
        let reached = cover.chosen.len();
        if reached > cover.bound {
            let gap = 100.0 * (reached - cover.bound) as f64 / reached as f64;
            diagnostics.warn(format!(
                "found a cover of {reached} spheres, the smallest one has at least {}: the search ended at a \
                 gap of {gap:.1} %",
                cover.bound
            ));
        }
        Ok(cover.chosen)
    }

    /// Step 4.
    fn connected(&self, chosen: &[u32], diagnostics: &mut Diagnostics) -> Result<MedialMesh> {
        let spheres: Vec<Sphere> =
            chosen.iter().map(|&ball| self.instance.spheres[ball as usize]).collect();
        let anchors: Vec<u32> =
            chosen.iter().map(|&ball| self.instance.vertices[ball as usize]).collect();
        connect::by_regions(&self.initial, &anchors, spheres, diagnostics)
    }
}

fn warn_of_uncoverable(uncoverable: usize, diagnostics: &mut Diagnostics) {
    if uncoverable > 0 {
        diagnostics.warn(format!(
            "{uncoverable} samples that no candidate covers were left out; use a larger dilation or \
             denser samples of the shape"
        ));
    }
}

// ----------------------------------------------------------------------------
// The parameters of Coverage Axis and Coverage Axis++.

medial::parameters! {
    /// Parameters of Coverage Axis and Coverage Axis++; the defaults are those of the scripts of
    /// Coverage Axis++ for meshes.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct CoverageAxisParams {
        /// Choose by score, as Coverage Axis++, or a smallest cover by branch and bound, as Coverage
        /// Axis.
        select: Select = Select::Greedy, "greedy or exact";
    }
}

/// How spheres are chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Select {
    /// One after the other by score: Coverage Axis++.
    Greedy,
    /// A smallest set that covers: Coverage Axis.
    Exact,
}

/// Range of dilations, in longest sides.
const DILATIONS: RangeInclusive<f64> = 1e-4..=1.0;

// ----------------------------------------------------------------------------
// The samples to be covered, and the spheres that may cover them.

/// Radius below which a ball is no candidate, in diagonals: its penalty has no bound.
const LEAST_RADIUS: f64 = 1e-9;

/// The input of a cover, in normalised units.
struct Instance {
    /// Samples of the surface.
    pub samples: Vec<Vec3>,
    /// Candidates.
    pub spheres: Vec<Sphere>,
    /// For each candidate its vertex of the initial medial mesh.
    pub vertices: Vec<u32>,
    /// How many balls were too small to be candidates.
    pub too_small: usize,
    /// The longest side of the bounding box: the unit of the dilation.
    pub side: f64,
}

impl Instance {
    /// Draws the samples and collects the candidates of a shape.
    ///
    /// # Errors
    /// When all spheres are too small.
    pub fn new(shape: &Shape, initial: &MedialMesh, seed: u64) -> Result<Self> {
        let sampling = Sampling::AreaUniform { count: SAMPLES, seed };
        let samples = sample(shape.mesh(), &sampling);
        let (low, high) = shape.mesh().bounding_box().unwrap_or_default();
        let side = (high - low).max_element();
        let all = &initial.spheres;
        let vertices: Vec<u32> =
            (0..all.len() as u32).filter(|&v| all[v as usize].radius >= LEAST_RADIUS).collect();
        let spheres: Vec<Sphere> = vertices.iter().map(|&v| all[v as usize]).collect();
        let (all, too_small) = (all.len(), all.len() - spheres.len());
        if spheres.is_empty() {
            return Err(SimplifyError::unsupported(format!(
                "no candidate inside has a radius of {LEAST_RADIUS} diagonals or more (found {all} candidates)"
            )));
        }
        Ok(Self { samples, spheres, vertices, too_small, side })
    }
}
