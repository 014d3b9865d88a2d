//! Angle filter, per Voronoi facet.
//!
//! 1. The Voronoi facets all of whose vertices are inside. Each point `x` within the facet dual to the
//!    Delaunay edge `pq` has `Pi(x) = {p, q}`, so that `S(x) = 2 arcsin(|p - q| / 2 |p - x|)`: largest
//!    at the point of the facet nearest to the middle of `pq`, smallest at a vertex.
//! 2. The value of a facet: `S` at the mean of its vertices, or the smallest `S` on it.
//! 3. Keep the facets with a value above `theta`, or as many of the best as a number of spheres
//!    allows, with their sides and corners.
//!
//! # Deviations from the papers
//! - The part of Attali and Montanvert's paper that we know does not say where on a facet the angle is
//!   measured. The scale axis tool uses the mean of the vertices for its own filter.

use medial::Vec3;
use medial::shape::Shape;
use medial::simplifier::{Diagnostics, SimplifyError};
use rayon::prelude::*;

use super::FacetAngle;
use crate::ranked_facets::{FacetSet, RankedFacets};
use crate::scale::Scale;

/// Ranks the Voronoi facets. `O(n)` for their vertices.
pub(super) fn prepare(
    shape: &Shape,
    at: FacetAngle,
    scale: Scale,
) -> Result<RankedFacets<'static>, SimplifyError> {
    let set = FacetSet::of(shape)?;
    let delaunay = shape.delaunay()?;
    let value = |facet: usize| {
        let ends = set.facets.ends(facet).map(|v| delaunay.point(v));
        let vertices =
            set.facets.polygon(facet).iter().map(|&s| set.mesh.spheres[s as usize].centre);
        match at {
            FacetAngle::Barycentre => {
                let mean = vertices.clone().sum::<Vec3>() / vertices.len() as f64;
                angle_from(mean, ends)
            }
            FacetAngle::Minimum => vertices.map(|x| angle_from(x, ends)).fold(180.0, f64::min),
        }
    };
    let values: Vec<f64> = (0..set.facets.len()).into_par_iter().map(value).collect();
    Ok(RankedFacets::new(set, values, scale, Diagnostics::default()))
}

/// A point closer than this, in chords, to the middle of two samples counts as the middle.
const MIDDLE: f64 = 1e-9;

/// Degrees between two points that are equally far from `x`. The arc tangent keeps its digits where
/// the arc sine loses half of them, and needs no clamp. At the middle it is 180 whatever the rounding,
/// which would otherwise decide between the many that have it.
pub(super) fn angle_from(x: Vec3, [p, q]: [Vec3; 2]) -> f64 {
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
