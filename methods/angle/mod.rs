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
//! - `vertex`: the vertices of the Voronoi medial mesh, with the edges and faces
//!   between them. The default: it meets every number of spheres.
//! - `facet`: the facets of the Voronoi diagram, with their sides and corners, as
//!   Attali and Montanvert have it.
//! - `homotopy`: sheets, removed only where that changes no topology (Sud et al.).
//!
//! # The published level
//! The papers choose `theta` for each model. [`Level::Published`](medial::simplifier::Level) is
//! `theta` = 60 degrees: an object angle of 30, at which the authors' tool of the scale axis (Miklos,
//! Giesen, Pauly 2010) filters the sheets of its results. A warning reports it.
//!
//! # Equal angles
//! Many angles are exactly 180 degrees. Of equal angles, spheres and sheets of larger balls are kept
//! first; those of about equal size are kept spread over the shape (`methods/ranked.rs`).

use std::collections::BTreeSet;

use medial::Vec3;
use medial::complex::MedialMesh;
use medial::geometry::separation_angle;
use medial::shape::Shape;
use medial::simplifier::{
    Diagnostics, Level, Method, MethodInfo, NativeLevel, ParamFields, RunContext, Simplification,
    Simplified,
};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::levels::{ByKnob, within};
use crate::ranked::{
    FacetSet, Published, Ranked, RankedFacets, Scale, Sheets, Wanted, Without, break_ties,
};
use crate::{Prepared, Result};

medial::parameters! {
    /// Parameters of the angle filter.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct AngleParams {
        /// The filtered elements: Voronoi vertices, Voronoi facets, or sheets whose removal changes no
        /// topology.
        variant: Variant = Variant::Vertex, "vertex, facet or homotopy";
        /// Angle of the published level, and for `homotopy` of a number of spheres, which is met by the
        /// number of samples.
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
    /// Sheets, as far as the topology stays.
    Homotopy,
}

impl AngleParams {
    fn validate(self) -> Result<Self> {
        within("theta", self.theta, 0.0..=180.0)?;
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
            "theta = 60 degrees (parameter `theta`), an object angle of 30, the sheet filter of the \
             authors' tool of the scale axis; the papers choose theta for each model",
        )
        .params(AngleParams::describe());
    Method::new(info, prepare)
}

fn prepare<'s>(shape: &'s Shape, params: AngleParams, run: &RunContext) -> Prepared<'s> {
    let params = params.validate()?;
    let scale = scale(params.theta);
    Ok(match params.variant {
        Variant::Vertex => Box::new(rank_spheres(shape, scale)?),
        Variant::Facet => Box::new(rank_facets(shape, scale)?),
        Variant::Homotopy => Box::new(peel_by_samples(shape, params.theta, run)?),
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

/// Ranks the spheres of the initial medial mesh. `O(n log n)`.
fn rank_spheres(shape: &Shape, scale: Scale) -> Result<Ranked> {
    let mesh = shape.initial()?;
    let mut diagnostics = Diagnostics::default();
    let contacts = shape.contacts(&mesh, &mut diagnostics)?;
    let value = mesh
        .spheres
        .par_iter()
        .enumerate()
        .map(|(sphere, &s)| {
            contacts.with(sphere, |points| separation_angle(s.centre, points)).to_degrees()
        })
        .collect();
    Ok(Ranked::new(mesh, value, scale, diagnostics))
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
fn rank_facets(shape: &Shape, scale: Scale) -> Result<RankedFacets<'static>> {
    let set = FacetSet::of(shape)?;
    let delaunay = shape.delaunay()?;
    let values: Vec<f64> = (0..set.facets.len())
        .into_par_iter()
        .map(|facet| {
            let ends = set.facets.ends(facet).map(|v| delaunay.point(v));
            let vertices =
                set.facets.polygon(facet).iter().map(|&s| set.mesh.spheres[s as usize].centre);
            let count = vertices.len() as f64;
            angle_from(vertices.sum::<Vec3>() / count, ends)
        })
        .collect();
    Ok(RankedFacets::new(set, values, scale, Diagnostics::default()))
}

/// A point closer than this, in chords, to the middle of two samples counts as the middle.
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

// Angle filter by sheets, which are removed only if that does not change the topology.
//
// Sud, Foskey, Manocha: *Homotopy-preserving medial axis simplification*, SPM 2005,
// doi:10.1145/1060244.1060250.
//
// 1. A sheet consists of the points with the same two closest sites of the boundary. Here sites are
//    samples, so a sheet is a Voronoi facet. Its *seam* is the part of its border that it shares with
//    other sheets or with edges that have no facet; the rest of the border is its *rim*.
// 2. The value of a sheet is its largest separation angle, at its point nearest to the middle of its
//    two samples.
// 3. A *frontier sheet* can be removed: its rim and its seam are both non-empty and connected. The
//    frontier sheet of the smallest value is removed first; then its neighbours are tested again.
// 4. The *effective* value of a sheet is the largest value up to its removal. At `theta` all sheets
//    with an effective value of at most `theta` are gone: those that can be removed without touching
//    a sheet above `theta`.
//
// # Numbers of spheres
// Sheets that hold the middle of their two samples have 180 degrees: 415 of the 24,564 of the bear stay up
// to 179.99999, all but 6 of the 3,181 of the built-in plate. `theta` cannot reach fewer spheres than
// theirs, and the topology test would leave one strip or lump of them. So a number of spheres is met by
// the number of samples at one `theta` (`methods/levels.rs`); the topology is then that of the
// Voronoi diagram of those samples.
//
// # Why the topology stays
// A facet is a disc. If its seam is connected and not the whole border, the seam is an arc or a point,
// onto which the disc retracts. A proper part of a circle has as many pieces as it has vertices more
// than edges. So step 3 is a count: the seam has one vertex more than edges, and some edge is free.
// Betti numbers do not change.
//
// # Deviations from the paper
// - The paper's axis is that of polyhedra, where two faces of the surface govern a sheet, and a sheet
//   can be large. Facets of samples are small, and are removed one by one.
// - Edges of the Voronoi diagram whose facets are all cut by the surface are kept, and with them the
//   facets between them: this sets a lower limit to the number of spheres, which a warning names.
// - The part of the paper that we know does not define the angle of a sheet; here it is the largest.

/// The sheets of a shape in the order in which they can go.
pub(super) struct Peeled {
    set: FacetSet,
    sheets: Sheets,
    /// Sheets in the order of their removal, with their effective values, ascending.
    removed: Vec<(u32, f64)>,
    scale: Scale,
    diagnostics: Diagnostics,
}

/// Steps 1 to 4 for any number of samples, at the separation angle `theta`.
fn peel_by_samples<'s>(shape: &'s Shape, theta: f64, run: &RunContext) -> Result<ByKnob<'s>> {
    FacetSet::refuse_given(shape)?;
    let run_again = run.clone();
    ByKnob::of_samples(shape, theta, run, move |shape| {
        Ok(Box::new(peel(shape, scale(theta), &run_again)?))
    })
}

/// Steps 1 to 3. `O(n log n)` in the number of facets, and as often over the sides of a sheet as a
/// neighbour goes.
fn peel(shape: &Shape, scale: Scale, run: &RunContext) -> Result<Peeled> {
    let set = FacetSet::of(shape)?;
    let delaunay = shape.delaunay()?;
    let value: Vec<f64> = (0..set.facets.len())
        .into_par_iter()
        .map(|facet| {
            // The angle is largest where the sheet is nearest to the middle of its two samples.
            let ends = set.facets.ends(facet).map(|v| delaunay.point(v));
            let polygon = set.facets.polygon(facet).iter();
            let vertices: Vec<Vec3> =
                polygon.map(|&s| set.mesh.spheres[s as usize].centre).collect();
            angle_from(nearest_of_polygon(&vertices, ends[0].midpoint(ends[1])), ends)
        })
        .collect();
    let sheets = Sheets::of(&set.mesh, &set.facets);
    let mut without = Without::none(&sheets);
    let mut removed = Vec::new();
    let order = in_order(&set, &value);
    let mut place = vec![0; order.len()];
    (0..).zip(&order).for_each(|(rank, &sheet)| place[sheet as usize] = rank);
    let mut open: BTreeSet<u32> = (0..order.len() as u32).collect();
    let mut effective = 0.0_f64;
    while let Some(first) = open.pop_first() {
        run.check()?;
        let sheet = order[first as usize];
        if removed.len().is_multiple_of(4096) {
            run.step(removed.len(), sheets.len())?;
        }
        if !without.may_go(sheet as usize) {
            continue;
        }
        let neighbours = without.remove(sheet as usize);
        effective = effective.max(value[sheet as usize]);
        removed.push((sheet, effective));
        open.extend(neighbours.into_iter().map(|sheet| place[sheet]));
    }
    let mut diagnostics = Diagnostics::default();
    diagnostics.count("sheets", sheets.len());
    diagnostics.count("sheets_that_can_go", removed.len());
    Ok(Peeled { set, sheets, removed, scale, diagnostics })
}

/// Sheets by ascending value; of equal values the smallest first, so that the rest is spread over the thick parts.
/// All that hold the middle of their two samples have 180 degrees.
fn in_order(set: &FacetSet, value: &[f64]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..value.len() as u32).collect();
    order.par_sort_unstable_by(|&a, &b| {
        value[b as usize].total_cmp(&value[a as usize]).then(a.cmp(&b))
    });
    break_ties(&mut order, |sheet| value[sheet as usize], |sheet| set.middle(sheet));
    order.reverse();
    order
}

/// The point of a convex planar polygon nearest to `m`, which need not lie in its plane.
fn nearest_of_polygon(polygon: &[Vec3], m: Vec3) -> Vec3 {
    polygon[1..]
        .windows(2)
        .map(|pair| nearest_of_triangle([polygon[0], pair[0], pair[1]], m))
        .reduce(|a, b| nearer(a, b, m))
        .unwrap_or(polygon[0])
}

/// The point nearer to `m`, the first of two equally near ones.
fn nearer(a: Vec3, b: Vec3, m: Vec3) -> Vec3 {
    if b.distance_squared(m) < a.distance_squared(m) { b } else { a }
}

/// Ericson, *Real-Time Collision Detection*, section 5.1.5, with the regions in another order: inside
/// if the projection is, else the nearest of the sides' nearest points.
fn nearest_of_triangle([a, b, c]: [Vec3; 3], m: Vec3) -> Vec3 {
    let normal = (b - a).cross(c - a);
    let area = normal.length_squared();
    if area > 0.0 {
        let weights =
            [(b, c), (c, a), (a, b)].map(|(u, v)| (u - m).cross(v - m).dot(normal) / area);
        if weights.iter().all(|&w| w >= 0.0) {
            return a * weights[0] + b * weights[1] + c * weights[2];
        }
    }
    let [on_a, on_b, on_c] = [(a, b), (b, c), (c, a)].map(|(u, v)| nearest_of_segment(u, v, m));
    nearer(nearer(on_a, on_b, m), on_c, m)
}

fn nearest_of_segment(u: Vec3, v: Vec3, m: Vec3) -> Vec3 {
    let (along, length) = ((m - u).dot(v - u), (v - u).length_squared());
    let t = if length > 0.0 { (along / length).clamp(0.0, 1.0) } else { 0.0 };
    u.lerp(v, t)
}

impl Peeled {
    /// The axis without the first `count` of the removed sheets.
    fn mesh(&self, count: usize) -> MedialMesh {
        let mut without = Without::none(&self.sheets);
        for &(sheet, _) in &self.removed[..count] {
            without.remove(sheet as usize);
        }
        let facets: Vec<u32> = (0..self.set.facets.len())
            .filter(|&facet| !without.gone[facet])
            .map(|facet| facet as u32)
            .collect();
        let FacetSet { mesh, facets: all, dual } = &self.set;
        all.subcomplex(mesh, *dual, &facets, &self.sheets.bare_edges, &self.sheets.bare_spheres)
    }
}

impl Simplification for Peeled {
    fn at(&mut self, level: Level) -> Result<Simplified> {
        let mut diagnostics = self.diagnostics.clone();
        let Wanted::Native(theta) = self.scale.wanted(level, &mut diagnostics)? else {
            unreachable!("a number of spheres is met by the number of samples");
        };
        let count = self.removed.partition_point(|&(_, value)| value <= theta);
        let mesh = self.mesh(count);
        diagnostics.count("sheets_removed", count);
        let native_level = Some(theta);
        Ok(Simplified { native_level, diagnostics, ..Simplified::new(mesh, level) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

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

    #[test]
    fn nearest_points_of_polygons_are_nearest() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(3);
        for _ in 0..300 {
            // A regular hexagon, squeezed, against a fine grid of its points.
            let squeeze = rng.random_range(0.1..1.0);
            let corner = |k: u32| {
                let (sin, cos) = (f64::from(k) * std::f64::consts::FRAC_PI_3).sin_cos();
                Vec3::new(cos, squeeze * sin, 0.3)
            };
            let polygon: Vec<Vec3> = (0..6).map(corner).collect();
            let m = Vec3::from([0; 3].map(|_| rng.random_range(-2.0..2.0)));
            let found = nearest_of_polygon(&polygon, m).distance(m);
            let mut best = f64::INFINITY;
            for k in 0..6 {
                for i in 0..=60 {
                    for j in 0..=60 - i {
                        let [u, v] = [i, j].map(|n| f64::from(n) / 60.0);
                        let centre = Vec3::new(0.0, 0.0, 0.3);
                        let p = centre
                            + u * (polygon[k] - centre)
                            + v * (polygon[(k + 1) % 6] - centre);
                        best = best.min(p.distance(m));
                    }
                }
            }
            assert!(found <= best + 1e-12 && found >= best - 0.02, "{found} and {best}");
        }
    }
}
