//! Lambda-medial axis: keeps the part of the medial axis whose closest boundary points need a large
//! enclosing ball.
//!
//! Chazal, Lieutier: *The lambda-medial axis*, Graphical Models 67(4), 2005,
//! doi:10.1016/j.gmod.2005.01.002.
//!
//! `F(x)` is the radius of the smallest ball enclosing the closest boundary points `Pi(x)` of `x`; points
//! with `F >= lambda` are kept. `lambda` is a length, a fraction of the input's bounding-box diagonal.
//! `F(x) <= r(x)`, with equality where `x` lies in the convex hull of its closest points.
//!
//! # Variants
//! - `vertex` (file `vertex.rs`): the vertices of the Voronoi medial mesh, with the edges and faces
//!   between them. The default: it meets every number of spheres.
//! - `cell` (file `cell.rs`): facets, edges and vertices of the Voronoi diagram, each by its own
//!   value, as the definition has it.
//!
//! # The published level
//! The paper gives no universal `lambda`. [`Level::Published`](medial::simplifier::Level) is
//! the default of the program that Yan, Letscher and Ju published with *Voxel cores: efficient, robust,
//! and provably good approximation of 3D medial axes*, ACM Transactions on Graphics 37(4), 2018, which
//! prunes by the same measure: facets whose two samples are less than 4 % of the longest side of the
//! box of the Voronoi vertices inside apart, that is, `lambda` = 2 % of this side. A warning says so.
//!
//! # Deviations from the paper
//! - The text of the Q-MAT paper says "circumradius of the closest points". For a Voronoi vertex
//!   the circumradius of its four samples is the ball's own radius, which would make this a size
//!   filter; the smallest enclosing ball is the definition of Chazal and Lieutier.

mod cell;
mod vertex;

use medial::complex::MedialMesh;
use medial::shape::Shape;
use medial::simplifier::{
    Method, MethodInfo, NativeLevel, ParamFields, RunContext, Simplification, SimplifyError,
};
use serde::{Deserialize, Serialize};

use crate::scale::{Published, Scale};

medial::parameters! {
    /// Parameters of the lambda-medial axis.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct LambdaParams {
        /// The filtered elements: Voronoi vertices, or Voronoi facets, edges and vertices, each by
        /// its own value.
        variant: Variant = Variant::Vertex, "vertex or cell";
        /// For `cell`: keep edges and vertices that pass without a facet, parts like curves and
        /// points, which belong to the lambda-medial axis by definition.
        leftovers: bool = true, "true or false";
    }
}

/// The elements that are filtered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Variant {
    /// Voronoi vertices.
    Vertex,
    /// Voronoi facets, edges and vertices.
    Cell,
}

/// `lambda` of [`Level::Published`](medial::simplifier::Level), as a fraction of the longest
/// side of the box of the spheres' centres.
const PUBLISHED: f64 = 0.02;

/// How enclosing balls are compared with `lambda`, on a medial mesh that has a sphere.
fn scale(mesh: &MedialMesh) -> Scale {
    let first = mesh.spheres[0].centre;
    let bounds = mesh
        .spheres
        .iter()
        .fold([first; 2], |[low, high], sphere| [low.min(sphere.centre), high.max(sphere.centre)]);
    let longest = (bounds[1] - bounds[0]).max_element();
    let published = Published::Documented(
        PUBLISHED * longest,
        "as in the authors' program of voxel cores: closest points 4 % of the longest side apart",
    );
    Scale { name: "lambda", range: 0.0..=1.0, inclusive: true, published }
}

/// The source as BibTeX.
const BIBTEX: &str = "\
@article{ChazalLieutier2005,
  author  = {Chazal, Fr{\\'e}d{\\'e}ric and Lieutier, Andr{\\'e}},
  title   = {The $\\lambda$-medial axis},
  journal = {Graphical Models},
  volume  = {67},
  number  = {4},
  year    = {2005},
  doi     = {10.1016/j.gmod.2005.01.002}
}";

/// The lambda-medial axis as a method.
pub fn method() -> Method<LambdaParams> {
    let info = MethodInfo::new("lambda", "Lambda-medial axis")
        .citation(
            "Frederic Chazal, Andre Lieutier 2005. The lambda-medial axis. Graphical Models 67(4). \
             https://doi.org/10.1016/j.gmod.2005.01.002",
        )
        .bibtex(BIBTEX)
        .summary("Keeps the spheres whose contact points need the largest enclosing balls.")
        .native(NativeLevel::larger_is_coarser("lambda", "fraction of the bounding-box diagonal"))
        .published(
            "lambda = 2 % of the longest side of the box of the spheres' centres, the default of the \
             authors' program of voxel cores; the paper gives no universal lambda",
        )
        .params(LambdaParams::describe());
    Method::new(info, prepare)
}

fn prepare<'s>(
    shape: &'s Shape,
    params: LambdaParams,
    _run: &RunContext,
) -> Result<Box<dyn Simplification + 's>, SimplifyError> {
    Ok(match params.variant {
        Variant::Vertex => Box::new(vertex::prepare(shape)?),
        Variant::Cell if params.leftovers => Box::new(cell::prepare(shape)?),
        Variant::Cell => Box::new(cell::prepare_facets(shape)?),
    })
}
