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
//! pxq`, with `Pi(x)` its closest boundary points; kept is what has `S > theta`. `S` does not change
//! under scaling. The *object angle* of Stolpner and Siddiqi is half of it.
//!
//! # Variants
//! - `vertex` (file `vertex.rs`): the vertices of the Voronoi medial mesh, with the edges and faces
//!   between them. The default: it meets every number of spheres.
//! - `facet` (file `facet.rs`): the facets of the Voronoi diagram, with their sides and corners, as
//!   Attali and Montanvert have it.
//! - `grid` (file `grid.rs`): faces between voxels, Foskey et al.'s own algorithm.
//! - `homotopy` (file `homotopy.rs`): sheets, removed only where that changes no topology (Sud et al.).

mod facet;
mod grid;
mod homotopy;
mod vertex;

use medial::shape::Shape;
use medial::simplifier::{
    Method, MethodInfo, NativeLevel, ParamInfo, RunContext, Simplification, SimplifyError,
};
use serde::{Deserialize, Serialize};

use crate::ranked::Scale;

/// Parameters of the angle filter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AngleParams {
    /// What is filtered.
    pub variant: Variant,
    /// Where the angle of a facet is measured; `facet` alone.
    pub at: FacetAngle,
    /// Voxels along the longest side of the bounding box; `grid` alone.
    pub resolution: u32,
}

/// What is filtered.
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

/// Where the separation angle of a Voronoi facet is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum FacetAngle {
    /// At the mean of its vertices.
    Barycentre,
    /// At the vertex where it is smallest, hence the smallest of the facet.
    Minimum,
}

impl Default for AngleParams {
    fn default() -> Self {
        Self { variant: Variant::Vertex, at: FacetAngle::Barycentre, resolution: 64 }
    }
}

impl AngleParams {
    fn validate(self) -> Result<Self, SimplifyError> {
        let most = grid::MAX_RESOLUTION;
        if !(2..=most).contains(&self.resolution) {
            return Err(SimplifyError::Parameter(format!(
                "resolution = {}: give 2 to {most} voxels along the longest side",
                self.resolution
            )));
        }
        Ok(self)
    }

    fn describe() -> Vec<ParamInfo> {
        vec![
            ParamInfo::new(
                "variant",
                "vertex",
                "vertex, facet, grid or homotopy",
                "filter Voronoi vertices, Voronoi facets, faces between voxels, or sheets whose \
                 removal changes no topology",
            ),
            ParamInfo::new(
                "at",
                "barycentre",
                "barycentre or minimum",
                "facet: angle at the mean of a facet's vertices, or the smallest of the facet",
            ),
            ParamInfo::new(
                "resolution",
                Self::default().resolution,
                "voxels",
                "grid: voxels along the longest side of the bounding box",
            ),
        ]
    }
}

/// How angles are compared with `theta`.
fn scale() -> Scale {
    Scale {
        name: "theta",
        range: 0.0..=180.0,
        inclusive: false,
        no_published: "the papers choose theta for each model; ask for a number of spheres or for an \
                       angle in degrees (15 to 120 is usual)",
    }
}

/// The angle filter as a method.
pub fn method() -> Method<AngleParams> {
    let info = MethodInfo::new("angle", "Angle filter")
        .citation(
            "Attali, Montanvert 1996, Modeling noise for a better simplification of skeletons, \
             ICIP, doi:10.1109/ICIP.1996.560357; Foskey, Lin, Manocha 2003, Efficient computation \
             of a simplified medial axis, JCISE 3(4), doi:10.1115/1.1631582",
        )
        .summary("Keeps the spheres whose contact points subtend the largest angles.")
        .native(NativeLevel::larger_is_coarser("theta", "degrees of separation angle"))
        .filter()
        .sweep(&[20.0, 30.0, 45.0, 60.0, 90.0, 120.0, 150.0])
        .published("unsupported: the papers choose theta for each model")
        .params(AngleParams::describe());
    Method::new(info, prepare)
}

fn prepare<'s>(
    shape: &'s Shape,
    params: AngleParams,
    run: &RunContext,
) -> Result<Box<dyn Simplification + 's>, SimplifyError> {
    let params = params.validate()?;
    Ok(match params.variant {
        Variant::Vertex => Box::new(vertex::prepare(shape)?),
        Variant::Facet => Box::new(facet::prepare(shape, params.at)?),
        Variant::Grid => Box::new(grid::prepare(shape, params.resolution, run)?),
        Variant::Homotopy => Box::new(homotopy::prepare(shape, run)?),
    })
}
