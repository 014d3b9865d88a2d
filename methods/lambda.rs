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
//! 1. The initial medial mesh with the contact points `Pi(x)` of each sphere.
//! 2. `F(x)`, the radius of the smallest ball enclosing `Pi(x)`.
//! 3. Keep the spheres with `F >= lambda`, or the given number of spheres with the largest `F`.
//! 4. The induced subcomplex: edges and faces all of whose spheres are kept.
//!
//! # The published level
//! The paper gives no universal `lambda`. [`Level::Published`](medial::simplifier::Level) is
//! the default of the program that Yan, Letscher and Ju published with *Voxel cores: efficient, robust,
//! and provably good approximation of 3D medial axes*, ACM Transactions on Graphics 37(4), 2018, which
//! prunes by the same measure: facets whose two samples are less than 4 % of the longest side of the
//! box of the Voronoi vertices inside apart, that is, `lambda` = 2 % of this side, with a warning.
//!
//! # Deviations from the paper
//! - The paper's set is a closed subset of the whole axis; the filter on Voronoi vertices with the
//!   induced subcomplex supports a number of spheres like every other method.
//! - The text of the Q-MAT paper has "circumradius of the closest points". For a Voronoi vertex
//!   the circumradius of its four samples is the ball's own radius, which would make this a size
//!   filter; the smallest enclosing ball is the definition of Chazal and Lieutier.

use medial::complex::MedialMesh;
use medial::geometry::enclosing_ball;
use medial::shape::Shape;
use medial::simplifier::{Method, MethodInfo, NativeLevel, NoParams, RunContext};

use crate::Prepared;
use crate::ranked::{Published, Ranked, Scale};

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

/// The lambda-medial axis as a method.
pub fn method() -> Method<NoParams> {
    let info = MethodInfo::new("lambda", "Lambda-medial axis")
        .citation(
            "Frederic Chazal, Andre Lieutier 2005. The lambda-medial axis. Graphical Models 67(4). \
             https://doi.org/10.1016/j.gmod.2005.01.002",
        )
        .bibtex(crate::references(&["ChazalLieutier2005"]))
        .summary("Keeps the spheres whose contact points need the largest enclosing balls.")
        .native(NativeLevel::larger_is_coarser("lambda", "fraction of the bounding-box diagonal"))
        .published(
            "lambda = 2 % of the longest side of the box of the spheres' centres, the default of the \
             authors' program of voxel cores; the paper gives no universal lambda",
        );
    Method::new(info, prepare)
}

fn prepare<'s>(shape: &'s Shape, _: NoParams, run: &RunContext) -> Prepared<'s> {
    let radius = |_, contacts: &[_]| enclosing_ball(contacts).1;
    Ok(Box::new(Ranked::by_contacts(shape, run, radius, scale)?))
}
