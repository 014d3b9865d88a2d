//! SAT: the scale axis transform.
//!
//! J. Giesen, B. Miklos, M. Pauly, C. Wormser 2009, *The scale axis transform*, Symposium on
//! Computational Geometry, <https://doi.org/10.1145/1542362.1542388>; B. Miklos, J. Giesen, M. Pauly
//! 2010, *Discrete scale axis representations for 3D geometry*, ACM Transactions on Graphics 29(4),
//! <https://doi.org/10.1145/1778765.1778838>.
//!
//! 1. The shape as a union of balls: the inner polar balls of its samples.
//! 2. Radii times 1.002, centres moved by up to `1e-4 r`, the *jitter*, so that balls that touch in a
//!    sample overlap in general position (the authors' tool; `methods/perturb.rs`).
//! 3. Every radius is multiplied by the scale `s`.
//! 4. The medial axis of the union of the grown balls, exact ([`UnionAxis`]). A ball that the union of
//!    others covers contributes nothing.
//! 5. Optional: sheets of small object angle are removed from the outside in (file `sheets.rs`).
//! 6. Radii are divided by `s`.
//!
//! Where grown parts touch, a tunnel closes or a loop appears. This is part of the transform: the result
//! has the Betti numbers of the grown union.
//!
//! # Deviations from the papers
//!
//! - The samples are those of the shape, shared with every other method, and not a restricted Delaunay
//!   refinement to `delta` = 0.01 of the model's size. The union approximates the shape as well as
//!   these samples do.
//! - Step 5 is off by default. The authors' tool removes sheets below 30 degrees at scales above 1;
//!   `sat_angle=30` does the same, so that the published level is that of the tool's defaults. Facets
//!   are removed one by one, so a sheet can be removed in part.
//! - Step 6 undoes neither part of step 2: a result at scale 1 is 0.2 % larger than the union of
//!   polar balls, and its centres keep the jitter, by which results of different seeds differ. As far as
//!   we know the authors' tool does not undo it either. Without step 2 (`radius_factor=1`, `jitter=0`)
//!   rounding decides which polar balls meet at scale 1, and the result is torn; a warning says so.
//! - The authors choose the density of the samples, `delta`, beside `s`; with `size=density` a number of
//!   spheres is met by the number of samples at `s` = 1.1 (`methods/size_search.rs`). Each count then
//!   has balls of its own.
//! - By default a number of spheres is met by a search on `s`. Not every count occurs: the result is the
//!   largest count met that does not exceed the request; a count within 1 % ends the search. The seconds
//!   of a request are those of all scales that it tried.

mod params;
mod search;
mod sheets;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use medial::complex::{AxisTally, MedialMesh, Sphere, UnionAxis, betti};
use medial::shape::{Shape, ShapeError};
use medial::simplifier::{
    Diagnostics, Extras, Level, Method, MethodInfo, NativeLevel, ParamFields, RunContext,
    Simplification, Simplified, SimplifyError,
};

use crate::by_knob::ByKnob;
use crate::perturb::perturbed;

pub use params::{SatParams, Size};

/// Scale of [`Level::Published`]: the default of the authors' tool.
const PUBLISHED: f64 = 1.1;

/// The largest scale: radii of up to a million diagonals, beyond which positions mean nothing.
const LARGEST_SCALE: f64 = 1e6;

/// The source as BibTeX.
const BIBTEX: &str = "\
@inproceedings{GiesenMiklosPaulyWormser2009,
  author    = {Giesen, Joachim and Miklos, Balint and Pauly, Mark and Wormser, Camille},
  title     = {The scale axis transform},
  booktitle = {Symposium on Computational Geometry},
  year      = {2009},
  doi       = {10.1145/1542362.1542388}
}
@article{MiklosGiesenPauly2010,
  author  = {Miklos, Balint and Giesen, Joachim and Pauly, Mark},
  title   = {Discrete scale axis representations for {3D} geometry},
  journal = {ACM Transactions on Graphics},
  volume  = {29},
  number  = {4},
  year    = {2010},
  doi     = {10.1145/1778765.1778838}
}";

/// The scale axis transform as a method.
///
/// Has all levels. Each scale costs one regular and one Delaunay triangulation.
pub fn method() -> Method<SatParams> {
    let info = MethodInfo::new("sat", "Scale axis transform")
        .citation(
            "Joachim Giesen, Balint Miklos, Mark Pauly, Camille Wormser 2009. The scale axis \
             transform. Symposium on Computational Geometry. \
             https://doi.org/10.1145/1542362.1542388; Balint Miklos, Joachim Giesen, Mark Pauly \
             2010. Discrete scale axis representations for 3D geometry. ACM Transactions on \
             Graphics 29(4). https://doi.org/10.1145/1778765.1778838",
        )
        .bibtex(BIBTEX)
        .summary(
            "Grows all polar balls by a factor, takes the medial axis of their union, and shrinks \
             its balls back.",
        )
        .native(NativeLevel::larger_is_coarser("s", "scale factor"))
        .published(
            "s = 1.1, the default of the authors' tool, without its angle filter (sat_angle=30)",
        )
        .params(SatParams::describe());
    Method::new(info, prepare)
}

fn prepare<'s>(
    shape: &'s Shape,
    params: SatParams,
    run: &RunContext,
) -> Result<Box<dyn Simplification + 's>, SimplifyError> {
    let params = params.validate()?;
    if params.size == Size::Scale {
        return Ok(Box::new(Prepared::new(shape, params, run)?));
    }
    if shape.has_given_initial() {
        let why = "it meets a number of spheres by sampling the surface, and a given medial mesh \
                   leaves nothing to sample: leave out --initial, or set size=scale";
        return Err(SimplifyError::unsupported(why));
    }
    let run_again = run.clone();
    let at = move |shape: &Shape| -> Result<Box<dyn Simplification>, SimplifyError> {
        Ok(Box::new(Prepared::new(shape, params, &run_again)?))
    };
    Ok(Box::new(ByKnob::of_samples(shape, PUBLISHED, run, at)?))
}

/// The balls of one shape, perturbed.
struct Prepared {
    spheres: Vec<Sphere>,
    params: SatParams,
    run: RunContext,
}

/// The scale axis at one scale.
struct Scaled {
    scale: f64,
    mesh: MedialMesh,
    tally: AxisTally,
    /// Betti numbers of the grown union.
    union_betti: [u64; 3],
    removed_facets: usize,
}

impl Prepared {
    /// Steps 1 and 2.
    fn new(shape: &Shape, params: SatParams, run: &RunContext) -> Result<Self, SimplifyError> {
        let balls = shape.inner_balls()?;
        run.step(0, balls.spheres.len())?;
        let spheres = perturbed(&balls.spheres, params.radius_factor, params.jitter, run.seed);
        Ok(Self { spheres, params, run: run.clone() })
    }

    /// The axis at a scale.
    fn at_scale(&self, scale: f64) -> Result<Arc<Scaled>, SimplifyError> {
        Scaled::new(&self.spheres, &self.params, scale).map(Arc::new)
    }
}

impl Scaled {
    /// Steps 3 to 6.
    fn new(spheres: &[Sphere], params: &SatParams, scale: f64) -> Result<Self, SimplifyError> {
        let resized = |balls: &[Sphere], factor: f64| -> Vec<Sphere> {
            balls.iter().map(|b| Sphere::new(b.centre, b.radius * factor)).collect()
        };
        let grown = resized(spheres, scale);
        let axis = UnionAxis::of_balls(&grown).map_err(ShapeError::from)?;
        let (mut mesh, removed_facets) = sheets::filtered(&axis, params.sat_angle);
        mesh.spheres = resized(&mesh.spheres, 1.0 / scale);
        let (tally, union_betti) = (*axis.tally(), axis.union_betti());
        Ok(Self { scale, mesh, tally, union_betti, removed_facets })
    }

    /// Number of spheres.
    fn size(&self) -> usize {
        self.mesh.spheres.len()
    }

    fn diagnose(&self, balls: usize, diagnostics: &mut Diagnostics) {
        let AxisTally { open, doubtful, .. } = self.tally;
        diagnostics.count("balls", balls);
        diagnostics.count("balls_in_the_dual_complex", self.tally.balls);
        diagnostics.count("corners", self.tally.corners);
        diagnostics.count("facets_removed_by_angle", self.removed_facets);
        diagnostics.count("facets_left_open", open);
        diagnostics.count("doubtful_groups", doubtful);
        let found = betti(&self.mesh);
        if found != self.union_betti {
            diagnostics.warn(format!(
                "the axis has Betti numbers {found:?}, the union of grown balls {:?}: rounding left \
                 {open} facets open and {doubtful} groups of vertices in doubt",
                self.union_betti
            ));
        }
    }
}

impl Simplification for Prepared {
    fn at(&mut self, level: Level) -> Result<Simplified, SimplifyError> {
        let mut diagnostics = Diagnostics::default();
        let scaled = match level {
            Level::Published => self.at_scale(PUBLISHED)?,
            Level::Native(scale) if (1.0..=LARGEST_SCALE).contains(&scale) => {
                self.at_scale(scale)?
            }
            Level::Native(scale) => {
                return Err(SimplifyError::Level(format!(
                    "s = {scale:?} is outside 1 to {LARGEST_SCALE:e}"
                )));
            }
            Level::Spheres(0) => {
                return Err(SimplifyError::Level("ask for at least one sphere".into()));
            }
            Level::Spheres(count) => search::to_count(self, count, &mut diagnostics)?,
        };
        scaled.diagnose(self.spheres.len(), &mut diagnostics);
        Ok(Simplified {
            mesh: scaled.mesh.clone(),
            asked: level,
            native_level: Some(scaled.scale),
            diagnostics,
            extras: Extras::default(),
        })
    }
}
