//! One conformance corpus for every method, built in or external.
//!
//! A [`Case`] is a function of a [`Subject`]: a method with its parameters. It is independent of
//! processes and limits. The runner starts it in a separate worker, so that a case that panics, hangs
//! or takes all memory fails. Where the contract is open, the demand has a commented exception.

use std::time::Duration;

use medial::complex::MedialMesh;
use medial::shape::Shape;
use medial::simplifier::{
    Level, MedialSimplifier, Params, RunContext, Simplification, Simplified, SimplifyError,
};
use serde::{Deserialize, Serialize};

mod demands;

use demands::*;

/// One demand, by its name.
pub struct Case {
    /// Name, for `--case`.
    pub name: &'static str,
    /// The demand, as a sentence without a subject.
    pub demands: &'static str,
    run: fn(&Subject<'_>) -> CaseResult,
}

/// A method under test.
pub struct Subject<'a> {
    /// The method.
    pub method: &'a dyn MedialSimplifier,
    /// Its parameters.
    pub params: &'a Params,
    /// The seed of its runs.
    pub seed: u64,
    /// Whether it is an external program.
    pub external: bool,
    /// Gets each step before it starts, for the message about a method that has to be killed.
    pub doing: &'a dyn Fn(&str),
}

/// The outcome of a case.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// The method meets the demand, with remarks.
    Passed(Vec<String>),
    /// The method does not meet the demand, with the reason.
    Failed(String),
    /// The demand does not apply to the method, with the reason.
    Skipped(String),
}

/// Remarks of a case, or an outcome other than [`Outcome::Passed`].
type CaseResult = Result<Vec<String>, Outcome>;

/// All cases in the order of their runs, slow ones last.
pub fn cases() -> &'static [Case] {
    const fn case(
        name: &'static str,
        demands: &'static str,
        run: fn(&Subject<'_>) -> CaseResult,
    ) -> Case {
        Case { name, demands, run }
    }
    const CASES: &[Case] = &[
        case("report", "has an id, a title, a citation, and parameters with units", description),
        case("unknown-parameter", "refuses a parameter that it does not have", unknown_parameter),
        case("defaults", "has the same result with its documented defaults as without", defaults),
        case("valid-sphere", "has valid results on a sphere", |s| valid_on(s, "sphere")),
        case("valid-box", "has valid results on a box", |s| valid_on(s, "box")),
        case("valid-capsule", "has valid results on a capsule", |s| valid_on(s, "capsule")),
        case("valid-torus", "has valid results on a torus", |s| valid_on(s, "torus")),
        case("valid-hollow", "has valid results on a hollow sphere", |s| {
            valid_on(s, "hollow-sphere")
        }),
        case("valid-bracket", "has valid results on a bracket", |s| valid_on(s, "bracket")),
        case("valid-parts", "has valid results on two separate boxes", |s| valid_on(s, PARTS)),
        case("valid-plate", "handles or refuses a very thin plate (1 : 10,000)", |s| {
            valid_or_refused(s, PLATE)
        }),
        case("valid-tetrahedron", "handles or refuses a solid of four vertices", |s| {
            valid_or_refused(s, TETRAHEDRON)
        }),
        case("valid-cube", "handles or refuses a solid of eight vertices", |s| {
            valid_or_refused(s, CUBE)
        }),
        case("counts", "meets sphere counts to 2 %, or warns with a reason", counts_met),
        case("counts-above", "returns all spheres where more are requested", counts_above),
        case("no-spheres", "refuses a count of 0 spheres", no_spheres),
        case("native", "refuses invalid native levels, or all of them", native_level),
        case("published", "has a published level, or refuses it with a reason", published_level),
        case("continuing", "has the same result after other levels as alone", continuing),
        case(
            "repeated",
            "has the same result each time, bit by bit; with another seed too unless declared seeded",
            repeated,
        ),
        case("threads", "has the same result with 1, 2 and 5 threads", threads),
        case("scale", "has the same result in other units", scale),
        case("cancelled-before", "ends soon when cancelled before the start", |s| {
            cancelled(s, Duration::ZERO)
        }),
        case("cancelled-within", "ends soon when cancelled during the run", |s| {
            cancelled(s, AT_WORK)
        }),
        case("given-initial", "starts from a given medial mesh, or refuses it", given_initial),
    ];
    CASES
}

/// The case with a name.
pub fn find(name: &str) -> Option<&'static Case> {
    cases().iter().find(|case| case.name == name)
}

impl Case {
    /// Runs the case. The caller has to catch panics of the method.
    pub fn run(&self, subject: &Subject<'_>) -> Outcome {
        (self.run)(subject).map_or_else(|outcome| outcome, Outcome::Passed)
    }
}

fn failed<T>(why: impl Into<String>) -> Result<T, Outcome> {
    Err(Outcome::Failed(why.into()))
}

impl Subject<'_> {
    /// The prepared method on a shape.
    fn prepare<'s>(&self, shape: &'s Shape) -> Result<Box<dyn Simplification + 's>, Outcome> {
        let place = format!("preparing the {}", shape.name());
        (self.doing)(&place);
        self.method
            .prepare(shape, self.params, &RunContext::with_seed(self.seed))
            .map_err(|error| miss(&place, &error))
    }

    /// The result at a level, which must be sound.
    fn at(
        &self,
        simplification: &mut dyn Simplification,
        shape: &Shape,
        level: Level,
    ) -> Result<Simplified, Outcome> {
        let place = format!("{level} of the {}", shape.name());
        (self.doing)(&place);
        let result = simplification.at(level).map_err(|error| miss(&place, &error))?;
        sound(&result, level).map_err(|why| Outcome::Failed(format!("{place}: {why}")))?;
        Ok(result)
    }

    /// The level for a number of spheres: the published one for a method without sphere counts.
    fn level(
        &self,
        simplification: &mut dyn Simplification,
        count: usize,
    ) -> Result<Level, Outcome> {
        let level = Level::Spheres(count);
        (self.doing)(&format!("trying {level}"));
        // Any other error belongs to this level, and the case of this level reports it.
        let Err(SimplifyError::Unsupported { why }) = simplification.at(level) else {
            return Ok(level);
        };
        match simplification.at(Level::Published) {
            Err(SimplifyError::Unsupported { .. }) => Err(Outcome::Skipped(format!(
                "it supports neither sphere counts nor a published level ({why})"
            ))),
            _ => Ok(Level::Published),
        }
    }

    /// The medial mesh of a number of spheres, without earlier levels.
    fn mesh(&self, shape: &Shape, count: usize) -> Result<MedialMesh, Outcome> {
        // Two preparations: the choice of the level must not change the result.
        let level = self.level(self.prepare(shape)?.as_mut(), count)?;
        Ok(self.at(self.prepare(shape)?.as_mut(), shape, level)?.mesh)
    }
}

/// The outcome of an error: an unsupported request skips the case.
fn miss(place: &str, error: &SimplifyError) -> Outcome {
    match error {
        SimplifyError::Unsupported { why } => Outcome::Skipped(format!("{place}: {why}")),
        error => Outcome::Failed(format!("{place}: {error}")),
    }
}
