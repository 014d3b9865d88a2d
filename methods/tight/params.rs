//! The parameters of `tight`.

use medial::simplifier::{ParamInfo, SimplifyError};
use serde::{Deserialize, Serialize};

/// Parameters of `tight`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TightParams {
    /// Weight of the mean of the squares beside the high powers.
    pub lambda: f64,
    /// Spheres of the start, unless three times the target are more.
    pub start: usize,
    /// Blue-noise samples of the start's medial mesh.
    pub samples: usize,
    /// Rounds of step 6, before each further one begins with a swap.
    pub rounds: usize,
}

impl Default for TightParams {
    fn default() -> Self {
        Self { lambda: 0.15, start: 2_500, samples: 20_000, rounds: 8 }
    }
}

/// Most samples to begin with; they can be doubled twice.
const MOST_SAMPLES: usize = 200_000;

/// Most rounds.
const MOST_ROUNDS: usize = 1_000;

impl TightParams {
    pub(super) fn describe() -> Vec<ParamInfo> {
        let default = Self::default();
        vec![
            ParamInfo::new(
                "lambda",
                default.lambda,
                "none",
                "weight of the mean of the squares beside the high powers: larger for a smaller mean error",
            ),
            ParamInfo::new(
                "start",
                default.start,
                "spheres",
                "spheres that the start is simplified to, unless three times the target are more",
            ),
            ParamInfo::new(
                "samples",
                default.samples,
                "samples",
                "blue-noise samples of the start's medial mesh; doubled while its Betti numbers are wrong",
            ),
            ParamInfo::new(
                "rounds",
                default.rounds,
                "rounds",
                "rounds of steps at high powers before each further one begins with a swap",
            ),
        ]
    }

    /// The same parameters, if they make sense.
    pub(super) fn validate(self) -> Result<Self, SimplifyError> {
        if !(self.lambda >= 0.0 && self.lambda.is_finite()) {
            let lambda = self.lambda;
            return Err(SimplifyError::Parameter(format!("lambda = {lambda} is not a weight")));
        }
        if !(100..=MOST_SAMPLES).contains(&self.samples) {
            let samples = self.samples;
            return Err(SimplifyError::Parameter(format!(
                "samples = {samples}: from 100 to {MOST_SAMPLES}"
            )));
        }
        if self.rounds > MOST_ROUNDS {
            let rounds = self.rounds;
            return Err(SimplifyError::Parameter(format!(
                "rounds = {rounds}: at most {MOST_ROUNDS}"
            )));
        }
        Ok(self)
    }
}
