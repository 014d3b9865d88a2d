//! Coverage Axis and Coverage Axis++: few given inner spheres that cover the surface.
//!
//! Z. Dou, C. Lin, R. Xu, L. Yang, S. Xin, T. Komura, W. Wang 2022, *Coverage Axis: Inner Point Selection
//! for 3D Shape Skeletonization*, Computer Graphics Forum 41(2), <https://doi.org/10.1111/cgf.14484>;
//! Z. Wang, Z. Dou, R. Xu, C. Lin, Y. Liu, X. Long, S. Xin, T. Komura, X. Yuan, W. Wang 2024, *Coverage
//! Axis++: Efficient Inner Point Selection for 3D Shape Skeletonization*, Computer Graphics Forum 43(5),
//! <https://doi.org/10.1111/cgf.15143>. The formulas are those of the authors' public programs; of the
//! papers only the abstracts were available.
//!
//! 1. Samples of the surface are to be covered; candidates are spheres inside (this file).
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
//! - Random candidates are drawn in the bounding box, not in one that is enlarged, so that more of them are
//!   inside; their radii are distances to the surface, not to the nearest sample, which are too large.
//! - Two spheres chosen that are nearest to one vertex of the initial mesh are an error in the authors' way
//!   of connecting them, and happen with random candidates alone: the second takes the nearest vertex that
//!   is free, and is counted.
//! - A number of spheres ends the greedy choice early. Where fewer spheres cover everything, with
//!   `size=dilation` and for exact covers, it is met by a search on `delta`.
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

use coverage::{Coverage, Score};
use medial::Vec3;
use medial::complex::{MedialMesh, Sphere};
use medial::shape::Shape;
use medial::simplifier::{
    Diagnostics, Level, MedialSimplifier, MethodInfo, NativeLevel, ParamFields, Params, RunContext,
    Simplification, Simplified, SimplifyError,
};
use medial::surface::{Sampling, Side, sample};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};

use crate::levels::{Knob, Probe, SizeSearch, level_within, some_spheres, within};
use crate::{Prepared, Result};

/// Spheres that the authors' scripts choose at most.
const PUBLISHED_PICKS: usize = 100;

/// Collapses a medial mesh to a number of spheres, and spares some of them: a connection that another
/// method lends, as `qmat::keeping`.
pub type Keeping =
    fn(&Arc<MedialMesh>, &[u32], usize, &RunContext, &mut Diagnostics) -> Result<MedialMesh>;

/// Coverage Axis and Coverage Axis++ as a method; see [`method`].
pub struct CoverageAxis {
    info: MethodInfo,
    keeping: Keeping,
}

/// Coverage Axis and Coverage Axis++ as a method, with the collapse for `connection=qmat`.
///
/// Supports all levels but an error bound. Memory: two bits for each candidate and sample.
pub fn method(keeping: Keeping) -> CoverageAxis {
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
    CoverageAxis { info, keeping }
}

impl MedialSimplifier for CoverageAxis {
    fn info(&self) -> &MethodInfo {
        &self.info
    }

    fn prepare<'s>(&self, shape: &'s Shape, params: &Params, run: &RunContext) -> Prepared<'s> {
        let params = params.typed::<CoverageAxisParams>()?.validate()?;
        // For all kinds of candidates, since the connection needs it.
        let initial = shape.initial()?;
        run.step(0, initial.spheres.len())?;
        let instance = Instance::new(shape, &params, run.seed)?;
        let axis = Axis {
            score: Score::new(&instance.spheres, &params),
            instance,
            initial,
            keeping: self.keeping,
            params,
            run: run.clone(),
        };
        // The inverse dilation gives more spheres when it is turned up, as a search expects of a knob.
        let range = 1.0 / DILATIONS.end()..=1.0 / DILATIONS.start();
        let (count, unit) = ("inverse_dilation_in_thousandths", "longest sides over the dilation");
        let knob = Knob { count, unit, range, steps: 1e3, rate: 0.5, exponent: 1.3 };
        Ok(Box::new(PreparedCoverage { search: SizeSearch::new(knob, run), axis }))
    }
}

/// One shape, with its candidates.
struct PreparedCoverage {
    axis: Axis,
    search: SizeSearch,
}

struct Axis {
    instance: Instance,
    score: Score,
    initial: Arc<MedialMesh>,
    keeping: Keeping,
    params: CoverageAxisParams,
    run: RunContext,
}

impl Simplification for PreparedCoverage {
    fn at(&mut self, level: Level) -> Result<Simplified> {
        let Self { axis, search } = self;
        let CoverageAxisParams { select, size, dilation, max_iter, .. } = axis.params;
        let by_picks = select == Select::Greedy && size == Size::Picks;
        let (dilation, most) = match some_spheres(level)? {
            Level::Spheres(count) if by_picks => (dilation, count),
            Level::Spheres(count) => {
                // The search expects more spheres at larger values: it gets the inverse dilation.
                return search.at(count, f64::recip, |value| axis.at(value.recip(), max_iter));
            }
            Level::Native(delta) => (level_within("delta", delta, DILATIONS)?, max_iter),
            Level::Published => (dilation, max_iter.min(PUBLISHED_PICKS)),
        };
        let Probe { mesh, diagnostics } = axis.at(dilation, most)?;
        if let Level::Spheres(count) = level
            && mesh.spheres.len() < count
        {
            // These cover everything: more spheres need a smaller dilation.
            let most = max_iter.max(2 * count);
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
        let chosen = match self.params.select {
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
        let picks = coverage::choose(spheres, coverage, &self.score, most, &self.run)?;
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
        let cover = exact::cover(coverage, &self.params, &self.run)?;
        diagnostics.count("uncoverable_samples", cover.uncoverable);
        diagnostics.count("reduced_candidates", cover.reduced[0]);
        diagnostics.count("reduced_samples", cover.reduced[1]);
        diagnostics.count("nodes", cover.nodes);
        diagnostics.count("cover_bound", cover.bound);
        warn_of_uncoverable(cover.uncoverable, diagnostics);
        let reached = cover.chosen.len();
        if reached > cover.bound {
            let gap = 100.0 * (reached - cover.bound) as f64 / reached as f64;
            let how = match cover.end {
                exact::End::Solver => "the solver's rounding",
                exact::End::Nodes => "the number of nodes",
                exact::End::Time => "time, so that another run may find another cover",
            };
            diagnostics.warn(format!(
                "{reached} spheres cover, and no cover has fewer than {}: the search was ended by {how}, \
                 at a gap of {gap:.1} %",
                cover.bound
            ));
        }
        Ok(cover.chosen)
    }

    /// Step 4.
    fn connected(&self, chosen: &[u32], diagnostics: &mut Diagnostics) -> Result<MedialMesh> {
        let spheres: Vec<Sphere> =
            chosen.iter().map(|&ball| self.instance.spheres[ball as usize]).collect();
        let anchors = match &self.instance.vertices {
            // Candidates that are vertices of the initial mesh are their own anchors.
            Some(vertices) => chosen.iter().map(|&ball| vertices[ball as usize]).collect(),
            None => {
                let (anchors, moved) = connect::anchors(&self.initial, &spheres)?;
                diagnostics.count("anchors_moved_to_a_free_vertex", moved);
                anchors
            }
        };
        match self.params.connection {
            Connection::Geodesic => {
                connect::by_regions(&self.initial, &anchors, spheres, diagnostics)
            }
            Connection::Qmat => {
                (self.keeping)(&self.initial, &anchors, anchors.len(), &self.run, diagnostics)
            }
        }
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
        /// The candidates: all inner Voronoi vertices, the inner poles, or random inner points.
        candidates: Candidates = Candidates::Voronoi, "voronoi, poles or random";
        /// `delta`, by which balls are inflated before they cover, where no native level is requested.
        dilation: f64 = 0.02, "fraction of the longest side";
        /// Area-uniform samples to be covered; the script of Coverage Axis has 2000.
        samples: usize = 1500, "samples";
        /// Points drawn in the bounding box for candidates=random, of which those inside are kept.
        points: usize = 500_000, "points";
        /// `omega_u`, weight of the distance to the nearest chosen sphere.
        uniformity: f64 = 1.0, "pure number";
        /// `omega_c`, weight of the penalty of small radii.
        centrality: f64 = 1.0, "pure number";
        /// Penalty of small radii: 0.1 max r / r, as the scripts call it, or 1 / r standardised.
        penalty: Penalty = Penalty::Ratio, "ratio or stand";
        /// Most spheres chosen where no number is requested; the scripts have 100, as the published
        /// level.
        max_iter: usize = 1000, "spheres";
        /// Meet a number of spheres by the first ones chosen, or by a search on the dilation.
        size: Size = Size::Picks, "picks or dilation";
        /// Connect by geodesic regions on the initial medial mesh, or by collapses that spare the
        /// chosen spheres.
        connection: Connection = Connection::Geodesic, "geodesic or qmat";
        /// Limit of branch and bound for select=exact; results that it ends are repeatable.
        nodes: usize = 10_000, "nodes";
        /// Limit of branch and bound for select=exact; results that it ends need not be repeatable.
        time_limit: f64 = 240.0, "seconds, 0 for none";
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

/// The spheres among which some are chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Candidates {
    /// The spheres of the initial medial mesh: all inner Voronoi vertices.
    Voronoi,
    /// The inner polar balls of the samples of the shape.
    Poles,
    /// Random points inside, with their distance to the surface.
    Random,
}

/// The penalty of small radii.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Penalty {
    /// `0.1 max r / r`: `penalty=''` in the authors' function, as all their scripts call it.
    Ratio,
    /// `1 / r`, standardised: `penalty='stand'`, the default of their function.
    Stand,
}

/// How a number of spheres is met.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Size {
    /// The first spheres of the greedy choice; where fewer cover everything, and for the exact choice,
    /// which has no order, a search on the dilation.
    Picks,
    /// A search on the dilation, until the requested number of spheres covers all samples.
    Dilation,
}

/// How the spheres chosen are connected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Connection {
    /// By geodesic Voronoi regions on the initial medial mesh.
    Geodesic,
    /// By Q-MAT's collapses of the initial medial mesh, which spare the spheres chosen.
    Qmat,
}

/// Dilations that mean something, in longest sides.
const DILATIONS: RangeInclusive<f64> = 1e-4..=1.0;

impl CoverageAxisParams {
    fn validate(self) -> Result<Self> {
        within("dilation", self.dilation, DILATIONS)?;
        within("uniformity", self.uniformity, 0.0..=1e6)?;
        within("centrality", self.centrality, 0.0..=1e6)?;
        within("time_limit", self.time_limit, 0.0..=1e6)?;
        // A row of bits for each candidate: as many samples as memory bears for a large shape.
        within("samples", self.samples as f64, 1.0..=100_000.0)?;
        within("points", self.points as f64, 1.0..=10_000_000.0)?;
        within("max_iter", self.max_iter as f64, 1.0..=1e9)?;
        within("nodes", self.nodes as f64, 1.0..=1e9)?;
        Ok(self)
    }
}

// ----------------------------------------------------------------------------
// The samples to be covered, and the spheres that may cover them.

/// Balls below this radius, in diagonals, are dropped: their penalty would be without bound.
const LEAST_RADIUS: f64 = 1e-9;

/// Keeps the random points apart from the samples, which have the same seed.
const STREAM: u64 = 0x636f_7665_7261_6765;

/// The input of a cover, in normalised units.
struct Instance {
    /// Samples of the surface.
    pub samples: Vec<Vec3>,
    /// Candidates.
    pub spheres: Vec<Sphere>,
    /// The vertices of the initial medial mesh that they are, where they are such.
    pub vertices: Option<Vec<u32>>,
    /// How many balls were too small to be candidates.
    pub too_small: usize,
    /// The longest side of the bounding box: the unit of the dilation.
    pub side: f64,
}

impl Instance {
    /// Draws the samples and collects the candidates of a shape.
    ///
    /// # Errors
    /// When the initial medial mesh cannot be built, or no random point is inside.
    pub fn new(shape: &Shape, params: &CoverageAxisParams, seed: u64) -> Result<Self> {
        let sampling = Sampling::AreaUniform { count: params.samples, seed };
        let samples = sample(shape.mesh(), &sampling);
        let (low, high) = shape.mesh().bounding_box().unwrap_or_default();
        let side = (high - low).max_element();
        let all = match params.candidates {
            Candidates::Voronoi => shape.initial()?.spheres.clone(),
            Candidates::Poles => shape.inner_balls()?.spheres.clone(),
            Candidates::Random => random(shape, (low, high), params.points, seed)?,
        };
        let places: Vec<u32> = (0..all.len() as u32)
            .filter(|&place| all[place as usize].radius >= LEAST_RADIUS)
            .collect();
        let spheres: Vec<Sphere> = places.iter().map(|&place| all[place as usize]).collect();
        let (all, too_small) = (all.len(), all.len() - spheres.len());
        if spheres.is_empty() {
            return Err(SimplifyError::unsupported(format!(
                "no candidate inside has a radius of {LEAST_RADIUS} diagonals or more (found {all} candidates)"
            )));
        }
        let vertices = (params.candidates == Candidates::Voronoi).then_some(places);
        Ok(Self { samples, spheres, vertices, too_small, side })
    }
}

/// The points inside, among random ones in the bounding box, with their distances to the surface.
fn random(
    shape: &Shape,
    (low, high): (Vec3, Vec3),
    points: usize,
    seed: u64,
) -> Result<Vec<Sphere>> {
    let mut random = Pcg64::seed_from_u64(seed ^ STREAM);
    let mut points: Vec<Vec3> = (0..points)
        .map(|_| low + (high - low) * Vec3::new(random.random(), random.random(), random.random()))
        .collect();
    let sides = shape.inside_test().sides(&points);
    let mut side = sides.iter();
    points.retain(|_| side.next() == Some(&Side::Inside));
    let tree = shape.surface_tree()?;
    let distances = tree.distance_batch(&points);
    Ok(points.iter().zip(distances).map(|(&p, r)| Sphere::new(p, r)).collect())
}
