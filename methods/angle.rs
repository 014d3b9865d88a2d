//! Angle filter: keeps the part of the medial axis whose closest boundary points subtend a large
//! angle.
//!
//! Attali, Montanvert: *Modeling noise for a better simplification of skeletons*, ICIP 1996,
//! doi:10.1109/ICIP.1996.560357. Foskey, Lin, Manocha: *Efficient computation of a simplified
//! medial axis*, JCISE 3(4), 2003, doi:10.1115/1.1631582, who call the result the theta-simplified
//! medial axis.
//!
//! The separation angle of a point `x` of the axis is `S(x) = max over p, q in Pi(x) of the angle
//! pxq`, with `Pi(x)` its closest boundary points; points with `S > theta` are kept. `S` does not
//! change under scaling. The *object angle* of Stolpner and Siddiqi is half of it.
//!
//! # Variants
//! - `vertex`: the vertices of the Voronoi medial mesh, with the edges and faces
//!   between them. The default: it meets every number of spheres.
//! - `facet`: the facets of the Voronoi diagram, with their sides and corners, as
//!   Attali and Montanvert have it.
//!
//! # The published level
//! The papers choose `theta` for each model. [`Level::Published`](medial::simplifier::Level) is
//! `theta` = 60 degrees: an object angle of 30, at which the authors' tool of the scale axis (Miklos,
//! Giesen, Pauly 2010) filters the sheets of its results. A warning reports it.
//!
//! # Equal angles
//! Many angles are exactly 180 degrees. Of equal angles, spheres and sheets of larger balls are kept
//! first; those of about equal size are kept spread over the shape (`methods/ranked.rs`).

use medial::Vec3;
use medial::complex::Sphere;
use medial::geometry::separation_angle;
use medial::shape::Shape;
use medial::simplifier::{Diagnostics, Method, MethodInfo, NativeLevel, ParamFields, RunContext};
use serde::{Deserialize, Serialize};

use crate::ranked::{FacetSet, Published, Ranked, RankedFacets, Scale};
use crate::{Prepared, Result};

medial::parameters! {
    /// Parameters of the angle filter.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct AngleParams {
        /// The filtered elements: Voronoi vertices or Voronoi facets.
        variant: Variant = Variant::Vertex, "vertex or facet";
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
}

/// Separation angle of the published level, in degrees.
const PUBLISHED: f64 = 60.0;

/// How angles are compared with `theta`.
fn scale() -> Scale {
    let published = Published::Documented(
        PUBLISHED,
        "the authors' sheet filter of the scale axis: an object angle of 30 degrees",
    );
    Scale { name: "theta", range: 0.0..=180.0, inclusive: false, published }
}

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
        .bibtex(crate::references(&["AttaliMontanvert1996", "FoskeyLinManocha2003"]))
        .summary("Keeps the spheres whose contact points subtend the largest angles.")
        .native(NativeLevel::larger_is_coarser("theta", "degrees of separation angle"))
        .published(
            "theta = 60 degrees, an object angle of 30, the sheet filter of the \
             authors' tool of the scale axis; the papers choose theta for each model",
        )
        .params(AngleParams::describe());
    Method::new(info, prepare)
}

fn prepare<'s>(shape: &'s Shape, params: AngleParams, run: &RunContext) -> Prepared<'s> {
    Ok(match params.variant {
        Variant::Vertex => Box::new(rank_spheres(shape, run)?),
        Variant::Facet => Box::new(rank_facets(shape, run)?),
    })
}

// Angle filter, per sphere.
//
// 1. The initial medial mesh with the contact points `Pi(x)` of each sphere.
// 2. The separation angle; for contact points at distance `r` from `x`,
//    `S = 2 arcsin(|p - q| / 2r)`.
// 3. Keep the spheres with `S > theta`, or the given number of spheres with the largest `S`.
// 4. The induced subcomplex: edges and faces all of whose spheres are kept.
//
// # Deviations from the papers
// - Attali and Montanvert, and Foskey et al., filter the facets of a Voronoi diagram and of a
//   grid of voxels, which is not here. This variant filters Voronoi vertices, so that it reaches any number of spheres
//   like every other method.
// - A sphere that touches the boundary at its own centre (radius zero), or in fewer than two points,
//   has no angle; it gets `S = 0` and goes first.

fn rank_spheres(shape: &Shape, run: &RunContext) -> Result<Ranked> {
    let angle =
        |sphere: Sphere, contacts: &[Vec3]| separation_angle(sphere.centre, contacts).to_degrees();
    Ranked::by_contacts(shape, run, angle, |_| scale())
}

// Angle filter, per Voronoi facet.
//
// 1. The Voronoi facets all of whose vertices are inside. Each point `x` within the facet dual to the
//    Delaunay edge `pq` has `Pi(x) = {p, q}`, so that `S(x) = 2 arcsin(|p - q| / 2 |p - x|)`: largest
//    at the point of the facet nearest to the middle of `pq`, smallest at a vertex.
// 2. The value of a facet: `S` at the mean of its vertices.
// 3. Keep the facets with a value above `theta`, or as many of the best as a number of spheres
//    allows, with their sides and corners.
//
// # Deviations from the papers
// - The part of Attali and Montanvert's paper known to us does not state where on a facet the angle is
//   measured. The scale axis tool uses the mean of the vertices for its own filter.

/// Ranks the Voronoi facets. `O(n)` for their vertices.
fn rank_facets(shape: &Shape, run: &RunContext) -> Result<RankedFacets> {
    let set = FacetSet::of(shape)?;
    let delaunay = shape.delaunay()?;
    run.check()?;
    let (facets, mesh) = (set.facets.clone(), set.mesh.clone());
    let value = |facet| {
        let ends = facets.ends(facet).map(|v| delaunay.point(v));
        let vertices = facets.polygon(facet).iter().map(|&s| mesh.spheres[s as usize].centre);
        let count = vertices.len() as f64;
        angle_from(vertices.sum::<Vec3>() / count, ends)
    };
    Ok(RankedFacets::new(set, value, scale(), Diagnostics::default()))
}

/// Distance from the middle of two samples up to which a point counts as the middle, in chords.
const MIDDLE: f64 = 1e-9;

/// Degrees between two points that are equally far from `x`. The arc tangent keeps its digits where
/// the arc sine loses half of them, and needs no clamp. At the middle it is 180 with any rounding,
/// which would otherwise decide between the many that have it.
fn angle_from(x: Vec3, [p, q]: [Vec3; 2]) -> f64 {
    let (half_chord, off) = (p.distance(q) / 2.0, x.distance(p.midpoint(q)));
    if off <= MIDDLE * half_chord {
        return 180.0;
    }
    (2.0 * half_chord.atan2(off)).to_degrees()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_those_of_the_arc_sine() {
        let ends = [Vec3::new(0.3, 0.0, 0.0), Vec3::new(-0.3, 0.0, 0.0)];
        for height in [0.0, 1e-9, 0.1, 0.3, 5.0] {
            let x = Vec3::new(0.0, 0.6 * height, -0.8 * height);
            let sine = 0.3 / x.distance(ends[0]);
            let expected = 2.0 * sine.min(1.0).asin().to_degrees();
            assert!((angle_from(x, ends) - expected).abs() < 1e-5, "{height}");
        }
        assert_eq!(angle_from(Vec3::ZERO, ends), 180.0);
    }
}
