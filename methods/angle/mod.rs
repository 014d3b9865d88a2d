//! Angle filter: keeps the part of the medial axis whose closest boundary points subtend a large
//! angle.
//!
//! Attali, Montanvert: *Modeling noise for a better simplification of skeletons*, ICIP 1996,
//! doi:10.1109/ICIP.1996.560357. Foskey, Lin, Manocha: *Efficient computation of a simplified
//! medial axis*, JCISE 3(4), 2003, doi:10.1115/1.1631582, who call the result the theta-simplified
//! medial axis. Sud, Foskey, Manocha: *Homotopy-preserving medial axis simplification*, SPM 2005,
//! doi:10.1145/1060244.1060250.
//!
//! The separation angle of a point `x` of the axis is `S(x) = max over p, q in Pi(x) of the angle
//! pxq`, with `Pi(x)` its closest boundary points; points with `S > theta` are kept. `S` does not
//! change under scaling. The *object angle* of Stolpner and Siddiqi is half of it.
//!
//! # Variants
//! - `vertex` (file `vertex.rs`): the vertices of the Voronoi medial mesh, with the edges and faces
//!   between them. The default: it meets every number of spheres.
//! - `facet` (file `facet.rs`): the facets of the Voronoi diagram, with their sides and corners, as
//!   Attali and Montanvert have it.
//! - `grid` (file `grid.rs`): faces between voxels, Foskey et al.'s own algorithm, whose resolution
//!   decides the number of spheres.
//! - `homotopy` (file `homotopy.rs`): sheets, removed only where that changes no topology (Sud et al.).
//!
//! # The published level
//! The papers choose `theta` for each model. [`Level::Published`](medial::simplifier::Level) is
//! `theta` = 60 degrees: an object angle of 30, at which the authors' tool of the scale axis (Miklos,
//! Giesen, Pauly 2010) filters the sheets of its own results. A warning says so.
//!
//! # Equal angles
//! Many angles are exactly 180 degrees. Of equal angles, spheres and sheets of larger balls are kept
//! first; those of about equal size are kept spread over the shape (`methods/ties.rs`).

mod facet;
mod grid;
mod homotopy;
mod resolution;
mod vertex;

use medial::shape::Shape;
use medial::simplifier::{
    Method, MethodInfo, NativeLevel, ParamFields, RunContext, Simplification, SimplifyError,
};
use serde::{Deserialize, Serialize};

use crate::scale::{Published, Scale};

medial::parameters! {
    /// Parameters of the angle filter.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct AngleParams {
        /// The filtered elements: Voronoi vertices, Voronoi facets, faces between voxels, or sheets
        /// whose removal changes no topology.
        variant: Variant = Variant::Vertex, "vertex, facet, grid or homotopy";
        /// For `facet`: where the angle is measured, at the mean of a facet's vertices or at the
        /// vertex where it is smallest.
        at: FacetAngle = FacetAngle::Barycentre, "barycentre or minimum";
        /// For `grid`: voxels along the longest side of the bounding box, a fraction allowed.
        resolution: f64 = 64.0, "voxels";
        /// For `grid` and `homotopy`: meet a number of spheres by the resolution or the number of
        /// samples at the angle `theta`, or by the angle at the given ones.
        size: Size = Size::Sampling, "sampling or ranking";
        /// Angle of the published level, and of a number of spheres met by the sampling.
        theta: f64 = 60.0, "degrees of separation angle";
    }
}

/// The elements that are filtered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Variant {
    /// Voronoi vertices.
    Vertex,
    /// Voronoi facets.
    Facet,
    /// Faces between voxels.
    Grid,
    /// Sheets, as far as the topology stays.
    Homotopy,
}

/// How a number of spheres is met.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Size {
    /// How finely the shape is sampled, at one angle: the resolution of the lattice for `grid`, the
    /// number of samples for `homotopy`.
    #[serde(alias = "resolution", alias = "density")]
    Sampling,
    /// The angle, at the given sampling.
    Ranking,
}

/// Where the separation angle of a Voronoi facet is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum FacetAngle {
    /// At the mean of its vertices.
    Barycentre,
    /// At the vertex where it is smallest, hence the smallest of the facet.
    Minimum,
}

impl AngleParams {
    fn validate(self) -> Result<Self, SimplifyError> {
        let [least, most] = [grid::MIN_RESOLUTION, grid::MAX_RESOLUTION];
        if !(least..=most).contains(&self.resolution) {
            return Err(SimplifyError::Parameter(format!(
                "resolution = {}: give {least} to {most} voxels along the longest side",
                self.resolution
            )));
        }
        if !(0.0..=180.0).contains(&self.theta) {
            return Err(SimplifyError::Parameter(format!(
                "theta = {}: a separation angle has 0 to 180 degrees",
                self.theta
            )));
        }
        Ok(self)
    }
}

/// How angles are compared with `theta`; `published` is that of the parameters, in degrees.
fn scale(published: f64) -> Scale {
    let published = Published::Documented(
        published,
        "the parameter theta, which is by default the authors' sheet filter of the scale axis: an \
         object angle of 30 degrees",
    );
    Scale { name: "theta", range: 0.0..=180.0, inclusive: false, published }
}

/// The source as BibTeX.
const BIBTEX: &str = "\
@inproceedings{AttaliMontanvert1996,
  author    = {Attali, Dominique and Montanvert, Annick},
  title     = {Modeling noise for a better simplification of skeletons},
  booktitle = {IEEE International Conference on Image Processing},
  year      = {1996},
  doi       = {10.1109/ICIP.1996.560357}
}
@article{FoskeyLinManocha2003,
  author  = {Foskey, Mark and Lin, Ming C. and Manocha, Dinesh},
  title   = {Efficient computation of a simplified medial axis},
  journal = {Journal of Computing and Information Science in Engineering},
  volume  = {3},
  number  = {4},
  year    = {2003},
  doi     = {10.1115/1.1631582}
}";

/// The angle filter as a method.
pub fn method() -> Method<AngleParams> {
    let info = MethodInfo::new("angle", "Angle filter")
        .citation(
            "Dominique Attali, Annick Montanvert 1996. Modeling noise for a better simplification of \
             skeletons. IEEE International Conference on Image Processing. \
             https://doi.org/10.1109/ICIP.1996.560357; Mark Foskey, Ming C. Lin, Dinesh Manocha 2003. \
             Efficient computation of a simplified medial axis. Journal of Computing and Information \
             Science in Engineering 3(4). https://doi.org/10.1115/1.1631582",
        )
        .bibtex(BIBTEX)
        .summary("Keeps the spheres whose contact points subtend the largest angles.")
        .native(NativeLevel::larger_is_coarser("theta", "degrees of separation angle"))
        .published(
            "theta = 60 degrees (parameter `theta`), an object angle of 30, the sheet filter of the \
             authors' tool of the scale axis; the papers choose theta for each model",
        )
        .params(AngleParams::describe());
    Method::new(info, prepare)
}

fn prepare<'s>(
    shape: &'s Shape,
    params: AngleParams,
    run: &RunContext,
) -> Result<Box<dyn Simplification + 's>, SimplifyError> {
    let params = params.validate()?;
    let scale = scale(params.theta);
    Ok(match (params.variant, params.size) {
        (Variant::Vertex, _) => Box::new(vertex::prepare(shape, scale)?),
        (Variant::Facet, _) => Box::new(facet::prepare(shape, params.at, scale)?),
        (Variant::Grid, Size::Sampling) => Box::new(resolution::prepare(shape, params, run)?),
        (Variant::Grid, Size::Ranking) => Box::new(grid::prepare(shape, &params, run)?),
        (Variant::Homotopy, Size::Sampling) => {
            Box::new(homotopy::prepare_by_samples(shape, params.theta, run)?)
        }
        (Variant::Homotopy, Size::Ranking) => Box::new(homotopy::prepare(shape, scale, run)?),
    })
}
