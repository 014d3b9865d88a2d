//! The parameters of Q-MAT.

use medial::simplifier::{Level, SimplifyError};
use serde::{Deserialize, Serialize};

/// `η` of the paper: the number of spheres from which on it checks the link condition.
const PUBLISHED_FROM: usize = 200;

medial::parameters! {
    /// Parameters of Q-MAT; the defaults are the paper's, except `topology_from`. Lengths are
    /// fractions of the bounding-box diagonal.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct QmatParams {
        /// `k` of equation 8, added to the error of every edge: the larger, the earlier spikes go.
        k: f64 = 1e-5, "squared fraction of the diagonal";
        /// Planes that keep stable boundaries from shrinking (section 4.4).
        boundary: Boundary = Boundary::Paper, "paper, legacy or none";
        /// `k'` of section 4.4, the weight of the boundary planes.
        k_boundary: f64 = 0.1, "pure number";
        /// From this sphere count on a collapse has to keep the topology (section 4.5). `all` is from
        /// the start, 200 is the paper's, `auto` is 200 at the published level and `all` at others.
        topology_from: TopologyFrom = TopologyFrom::Auto, "spheres, or all, never or auto";
        /// Ratio of the smallest to the largest eigenvalue at which a quadric counts as singular; not
        /// in the paper.
        singular_ratio: f64 = 1e-10, "pure number in [0, 1)";
    }
}

/// How stable boundaries of the medial mesh are kept from shrinking.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Boundary {
    /// Section 4.4: planes with unit normals, weighted by `k' Γ²`.
    Paper,
    /// The authors' code: a tenth of that weight, and normals as long as the edge.
    Legacy,
    /// No boundary planes.
    None,
}

/// From which sphere count on a collapse has to satisfy the link condition.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "TopologyWord", into = "TopologyWord")]
pub enum TopologyFrom {
    /// From the first collapse on; at [`Level::Published`]
    /// from 200 spheres on, as in the paper.
    Auto,
    /// From the first collapse on.
    All,
    /// While at most this many spheres are left: `η` of the paper's Algorithm 1.
    Spheres(usize),
    /// Never.
    Never,
}

impl TopologyFrom {
    /// Whether a collapse has to keep the topology when so many spheres are left.
    pub fn applies(self, spheres: usize) -> bool {
        match self {
            Self::Auto | Self::All => true,
            Self::Spheres(from) => spheres <= from,
            Self::Never => false,
        }
    }

    /// Its meaning at a level: never [`TopologyFrom::Auto`].
    fn at(self, level: Level) -> Self {
        match (self, level) {
            (Self::Auto, Level::Published) => Self::Spheres(PUBLISHED_FROM),
            (Self::Auto, _) => Self::All,
            (given, _) => given,
        }
    }
}

/// How [`TopologyFrom`] is written.
#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(untagged, expecting = "topology_from is a number of spheres, `all`, `never` or `auto`")]
enum TopologyWord {
    Spheres(usize),
    Word(Word),
}

#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Word {
    Auto,
    All,
    Never,
}

impl From<TopologyWord> for TopologyFrom {
    fn from(word: TopologyWord) -> Self {
        match word {
            TopologyWord::Spheres(from) => Self::Spheres(from),
            TopologyWord::Word(Word::Auto) => Self::Auto,
            TopologyWord::Word(Word::All) => Self::All,
            TopologyWord::Word(Word::Never) => Self::Never,
        }
    }
}

impl From<TopologyFrom> for TopologyWord {
    fn from(from: TopologyFrom) -> Self {
        match from {
            TopologyFrom::Spheres(from) => Self::Spheres(from),
            TopologyFrom::Auto => Self::Word(Word::Auto),
            TopologyFrom::All => Self::Word(Word::All),
            TopologyFrom::Never => Self::Word(Word::Never),
        }
    }
}

impl QmatParams {
    /// The parameters at a level.
    pub(super) fn at(self, level: Level) -> Self {
        Self { topology_from: self.topology_from.at(level), ..self }
    }

    pub(super) fn validate(self) -> Result<Self, SimplifyError> {
        let at_least_zero = [("k", self.k), ("k_boundary", self.k_boundary)];
        for (name, value) in at_least_zero {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(SimplifyError::Parameter(format!("{name} = {value} is negative")));
            }
        }
        if !(0.0..1.0).contains(&self.singular_ratio) {
            let value = self.singular_ratio;
            return Err(SimplifyError::Parameter(format!(
                "singular_ratio = {value} is not in [0, 1)"
            )));
        }
        Ok(self)
    }
}
