//! One corpus for every method: what each must do, whatever it is and wherever it comes from.
//!
//! A [`Case`] is a function of a [`Subject`]: a method with its parameters. It knows neither
//! processes nor limits; the runner gives it a worker of its own, so that a case that panics, hangs
//! or takes all memory is one that failed. What the contract leaves open is a commented exception
//! beside the demand.

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
    /// What it demands, as a sentence without a subject.
    pub demands: &'static str,
    run: fn(&Subject<'_>) -> Answer,
}

/// A method under test.
pub struct Subject<'a> {
    /// The method.
    pub method: &'a dyn MedialSimplifier,
    /// Its parameters.
    pub params: &'a Params,
    /// Whether it is a program of its own.
    pub external: bool,
    /// Is told what the method is asked next, so that whoever has to end it knows at what it was.
    pub doing: &'a dyn Fn(&str),
}

/// How a case ended.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// The method does what is demanded; with what a reader may want to know.
    Passed(Vec<String>),
    /// It does not: why.
    Failed(String),
    /// The demand does not apply to it: why.
    Skipped(String),
}

/// What a case gives: remarks, or an outcome other than [`Outcome::Passed`].
type Answer = Result<Vec<String>, Outcome>;

/// All cases, in the order in which they are run: what is said first, what takes long last.
pub fn cases() -> &'static [Case] {
    const fn case(
        name: &'static str,
        demands: &'static str,
        run: fn(&Subject<'_>) -> Answer,
    ) -> Case {
        Case { name, demands, run }
    }
    const CASES: &[Case] = &[
        case("report", "has an id, a title, a citation, and parameters with units", description),
        case("unknown-parameter", "refuses a parameter that it does not have", unknown_parameter),
        case("defaults", "does with its documented defaults what it does without", defaults),
        case("valid-sphere", "gives valid results on a sphere", |s| valid_on(s, "sphere")),
        case("valid-box", "gives valid results on a box", |s| valid_on(s, "box")),
        case("valid-capsule", "gives valid results on a capsule", |s| valid_on(s, "capsule")),
        case("valid-torus", "gives valid results on a torus", |s| valid_on(s, "torus")),
        case("valid-hollow", "gives valid results on a hollow sphere", |s| {
            valid_on(s, "hollow-sphere")
        }),
        case("valid-bracket", "gives valid results on a bracket", |s| valid_on(s, "bracket")),
        case("valid-parts", "gives valid results on two boxes apart", |s| valid_on(s, PARTS)),
        case("valid-plate", "answers or refuses a plate of a ten-thousandth", |s| {
            valid_or_refused(s, PLATE)
        }),
        case("valid-tetrahedron", "answers or refuses a solid of four vertices", |s| {
            valid_or_refused(s, TETRAHEDRON)
        }),
        case("valid-cube", "answers or refuses a solid of eight vertices", |s| {
            valid_or_refused(s, CUBE)
        }),
        case("counts", "meets numbers of spheres to 2 %, or warns why not", counts_met),
        case("counts-above", "gives all it has where more is asked", counts_above),
        case("no-spheres", "refuses to give no sphere", no_spheres),
        case("native", "refuses senseless native levels, or says that it has none", native_level),
        case("published", "answers its published level, or says why not", published_level),
        case("continuing", "gives after other levels what it gives alone", continuing),
        case("repeated", "gives the same medial mesh each time, bit by bit", repeated),
        case("threads", "gives the same medial mesh with 1, 2 and 5 threads", threads),
        case("scale", "gives the same medial mesh in other units", scale),
        case("cancelled-before", "ends soon when it is cancelled from the start", cancelled_before),
        case("cancelled-within", "ends soon when it is cancelled at work", cancelled_within),
        case("given-initial", "starts from a given medial mesh, or says why not", given_initial),
    ];
    CASES
}

/// The case with a name.
pub fn find(name: &str) -> Option<&'static Case> {
    cases().iter().find(|case| case.name == name)
}

impl Case {
    /// Puts the method to the test. A panic of the method is for the caller to catch.
    pub fn run(&self, subject: &Subject<'_>) -> Outcome {
        (self.run)(subject).map_or_else(|outcome| outcome, Outcome::Passed)
    }
}

fn failed<T>(why: impl Into<String>) -> Result<T, Outcome> {
    Err(Outcome::Failed(why.into()))
}

impl Subject<'_> {
    /// The method on a shape, with nothing asked yet.
    fn prepare<'s>(&self, shape: &'s Shape) -> Result<Box<dyn Simplification + 's>, Outcome> {
        let place = format!("preparing the {}", shape.name());
        (self.doing)(&place);
        self.method
            .prepare(shape, self.params, &RunContext::default())
            .map_err(|error| miss(&place, &error))
    }

    /// A sound result at a level.
    fn ask(
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

    /// The level that stands for a number of spheres: the published one for a method that cannot be
    /// asked for numbers.
    fn level(
        &self,
        simplification: &mut dyn Simplification,
        count: usize,
    ) -> Result<Level, Outcome> {
        let level = Level::Spheres(count);
        (self.doing)(&format!("asking for {level}"));
        // Any other error belongs to this level, and the case of this level reports it.
        let Err(SimplifyError::Unsupported { why }) = simplification.at(level) else {
            return Ok(level);
        };
        match simplification.at(Level::Published) {
            Err(SimplifyError::Unsupported { .. }) => Err(Outcome::Skipped(format!(
                "it answers neither numbers of spheres nor the published level ({why})"
            ))),
            _ => Ok(Level::Published),
        }
    }

    /// The medial mesh that a method gives for a number of spheres when asked for nothing else.
    fn mesh(&self, shape: &Shape, count: usize) -> Result<MedialMesh, Outcome> {
        // Two preparations: which level it is must not change what it gives.
        let level = self.level(self.prepare(shape)?.as_mut(), count)?;
        Ok(self.ask(self.prepare(shape)?.as_mut(), shape, level)?.mesh)
    }
}

/// What an error at a place means: that something is not done by a method is an answer.
fn miss(place: &str, error: &SimplifyError) -> Outcome {
    match error {
        SimplifyError::Unsupported { why } => Outcome::Skipped(format!("{place}: {why}")),
        error => Outcome::Failed(format!("{place}: {error}")),
    }
}
