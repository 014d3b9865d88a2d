//! The parameters of `tight`.

use medial::simplifier::SimplifyError;

medial::parameters! {
    /// Parameters of `tight`.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct TightParams {
        /// Weight of the mean of the squares next to the high powers: larger for a smaller mean error.
        lambda: f64 = 0.15, "pure number";
        /// Spheres that the start is simplified to, unless three times the target are more.
        start: usize = 2_500, "spheres";
        /// Blue-noise samples of the start's medial mesh, doubled while its Betti numbers are wrong.
        samples: usize = 20_000, "samples";
        /// Rounds of steps at high powers before each further one begins with a swap.
        rounds: usize = 8, "rounds";
    }
}

/// Most samples to begin with; they can be doubled twice.
const MOST_SAMPLES: usize = 200_000;

/// Most rounds.
const MOST_ROUNDS: usize = 1_000;

impl TightParams {
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
