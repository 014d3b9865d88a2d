//! Angle filter by sheets, which are removed only if that does not change the topology.
//!
//! Sud, Foskey, Manocha: *Homotopy-preserving medial axis simplification*, SPM 2005,
//! doi:10.1145/1060244.1060250.
//!
//! 1. A sheet consists of the points with the same two closest sites of the boundary. Here sites are
//!    samples, so a sheet is a Voronoi facet. Its *seam* is the part of its border that it shares with
//!    other sheets or with edges that have no facet; the rest of the border is its *rim*.
//! 2. The value of a sheet is its largest separation angle, at its point nearest to the middle of its
//!    two samples.
//! 3. A *frontier sheet* can be removed: its rim and its seam are both non-empty and connected. The
//!    frontier sheet of the smallest value is removed first; then its neighbours are tested again.
//! 4. The *effective* value of a sheet is the largest value up to its removal. At `theta` all sheets
//!    with an effective value of at most `theta` are gone: those that can be removed without touching
//!    a sheet above `theta`.
//!
//! # Numbers of spheres
//! Sheets that hold the middle of their two samples have 180 degrees: 415 of the 24,564 of the bear stay up
//! to 179.99999, all but 6 of the 3,181 of the built-in plate. `theta` cannot reach fewer spheres than
//! theirs, and the topology test would leave one strip or lump of them. So a number of spheres is met by
//! the number of samples at one `theta` (`methods/size_search.rs`); the topology is then that of the
//! Voronoi diagram of those samples. With `size=ranking` the sheets of the given samples are removed
//! further in the order of step 3, which keeps the topology, as long as one can be removed.
//!
//! # Why the topology stays
//! A facet is a disc. If its seam is connected and not the whole border, the seam is an arc or a point,
//! onto which the disc retracts. A proper part of a circle has as many pieces as it has vertices more
//! than edges. So step 3 is a count: the seam has one vertex more than edges, and some edge is free.
//! Betti numbers do not change.
//!
//! # Deviations from the paper
//! - The paper's axis is that of polyhedra, where two faces of the surface govern a sheet, and a sheet
//!   can be large. Facets of samples are small, and are removed one by one.
//! - Edges of the Voronoi diagram whose facets are all cut by the surface are kept, and with them the
//!   facets between them: this sets a lower limit to the number of spheres, which a warning names.
//! - The part of the paper that we know does not define the angle of a sheet; here it is the largest.

use std::collections::BTreeSet;

use medial::Vec3;
use medial::complex::MedialMesh;
use medial::shape::Shape;
use medial::simplifier::{
    Diagnostics, Extras, Level, RunContext, Simplification, Simplified, SimplifyError,
};
use rayon::prelude::*;

use super::facet::angle_from;
use crate::by_knob::ByKnob;
use crate::ranked_facets::FacetSet;
use crate::scale::{Scale, Wanted};
use crate::sheets::{Sheets, Without};
use crate::ties::break_ties;

/// The sheets of a shape in the order in which they can go.
pub(super) struct Peeled {
    set: FacetSet,
    sheets: Sheets,
    /// Sheets in the order of their removal, with their effective values, ascending.
    removed: Vec<(u32, f64)>,
    /// Number of spheres left after each number of removals.
    left: Vec<usize>,
    scale: Scale,
    diagnostics: Diagnostics,
}

/// Steps 1 to 4 for any number of samples, at the separation angle `theta`.
pub(super) fn prepare_by_samples<'s>(
    shape: &'s Shape,
    theta: f64,
    run: &RunContext,
) -> Result<ByKnob<'s>, SimplifyError> {
    FacetSet::refuse_given(shape)?;
    let run_again = run.clone();
    let at = move |shape: &Shape| -> Result<Box<dyn Simplification>, SimplifyError> {
        Ok(Box::new(prepare(shape, super::scale(theta), &run_again)?))
    };
    ByKnob::of_samples(shape, theta, run, at)
}

/// Steps 1 to 3. `O(n log n)` in the number of facets, and as often over the sides of a sheet as a
/// neighbour goes.
pub(super) fn prepare(
    shape: &Shape,
    scale: Scale,
    run: &RunContext,
) -> Result<Peeled, SimplifyError> {
    let set = FacetSet::of(shape)?;
    let delaunay = shape.delaunay()?;
    let widest = |facet: usize| {
        let ends = set.facets.ends(facet).map(|v| delaunay.point(v));
        let polygon = set.facets.polygon(facet).iter();
        let vertices: Vec<Vec3> = polygon.map(|&s| set.mesh.spheres[s as usize].centre).collect();
        angle_from(nearest_of_polygon(&vertices, ends[0].midpoint(ends[1])), ends)
    };
    let value: Vec<f64> = (0..set.facets.len()).into_par_iter().map(widest).collect();
    let sheets = Sheets::of(&set.mesh, &set.facets);
    let mut without = Without::none(&sheets);
    let (mut removed, mut left) = (Vec::new(), vec![without.spheres()]);
    let order = in_order(&set, &value);
    let mut place = vec![0; order.len()];
    (0..).zip(&order).for_each(|(rank, &sheet)| place[sheet as usize] = rank);
    let mut open: BTreeSet<u32> = (0..order.len() as u32).collect();
    let mut effective = 0.0_f64;
    while let Some(first) = open.pop_first() {
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
        left.push(without.spheres());
        open.extend(neighbours.into_iter().map(|sheet| place[sheet]));
    }
    let mut diagnostics = Diagnostics::default();
    diagnostics.count("sheets", sheets.len());
    diagnostics.count("sheets_that_can_go", removed.len());
    Ok(Peeled { set, sheets, removed, left, scale, diagnostics })
}

/// Sheets by ascending value; of those that tie the smallest first, so that what is left is spread over
/// the thick parts. All that hold the middle of their two samples have 180 degrees.
fn in_order(set: &FacetSet, value: &[f64]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..value.len() as u32).collect();
    let of = |sheet: u32| value[sheet as usize];
    order.par_sort_unstable_by(|&a, &b| of(b).total_cmp(&of(a)).then(a.cmp(&b)));
    break_ties(&mut order, of, |sheet| set.middle(sheet));
    order.reverse();
    order
}

/// The point of a convex planar polygon nearest to `m`, which need not lie in its plane.
fn nearest_of_polygon(polygon: &[Vec3], m: Vec3) -> Vec3 {
    let fan =
        polygon[1..].windows(2).map(|pair| nearest_of_triangle([polygon[0], pair[0], pair[1]], m));
    let nearer =
        |a: Vec3, b: Vec3| if b.distance_squared(m) < a.distance_squared(m) { b } else { a };
    fan.reduce(nearer).unwrap_or(polygon[0])
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
    let on_side = |u: Vec3, v: Vec3| {
        let (along, length) = ((m - u).dot(v - u), (v - u).length_squared());
        let t = if length > 0.0 { (along / length).clamp(0.0, 1.0) } else { 0.0 };
        u.lerp(v, t)
    };
    let sides = [on_side(a, b), on_side(b, c), on_side(c, a)];
    let nearer =
        |a: Vec3, b: Vec3| if b.distance_squared(m) < a.distance_squared(m) { b } else { a };
    sides.into_iter().reduce(nearer).expect("three sides")
}

impl Peeled {
    /// The axis without the first `count` of the removed sheets.
    fn mesh(&self, count: usize) -> MedialMesh {
        let mut without = Without::none(&self.sheets);
        for &(sheet, _) in &self.removed[..count] {
            without.remove(sheet as usize);
        }
        let facets: Vec<u32> = (0..self.set.facets.len())
            .filter(|&facet| !without.is_gone(facet))
            .map(|facet| facet as u32)
            .collect();
        let FacetSet { mesh, facets: all, dual } = &self.set;
        all.subcomplex(mesh, *dual, &facets, self.sheets.bare_edges(), self.sheets.bare_spheres())
    }
}

impl Simplification for Peeled {
    fn at(&mut self, level: Level) -> Result<Simplified, SimplifyError> {
        let mut diagnostics = self.diagnostics.clone();
        let by_level = |theta: f64| self.removed.partition_point(|&(_, value)| value <= theta);
        let (count, native) = match self.scale.wanted(level, &mut diagnostics)? {
            Wanted::Spheres(spheres) => {
                let enough = self.left.partition_point(|&left| left > spheres);
                let count = enough.min(self.removed.len());
                (count, count.checked_sub(1).map_or(0.0, |last| self.removed[last].1))
            }
            Wanted::Native(theta) => (by_level(theta), theta),
        };
        let mesh = self.mesh(count);
        if let Level::Spheres(asked) = level
            && mesh.spheres.len() != asked
        {
            let why = match mesh.spheres.len() > asked {
                true => "no other sheet can go without a change of topology",
                false => "whole sheets are removed",
            };
            diagnostics.warn(format!("{} spheres instead of {asked}: {why}", mesh.spheres.len()));
        }
        diagnostics.count("sheets_removed", count);
        Ok(Simplified {
            mesh,
            asked: level,
            native_level: Some(native),
            diagnostics,
            extras: Extras::default(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

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
