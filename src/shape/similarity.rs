//! Whether a medial mesh from a file is in the units of its surface, and which change of units brings it there.
//!
//! No format of medial meshes stores units. MATFP writes its results in a cube from 0 to 10, VMAS in one from 0 to 1,
//! Q-MAT in the units of the input. The *misfit* tells them apart: how much the radius of a sphere differs from the
//! distance of its centre to the surface, as the median over the spheres, so that the few spheres that a coarse
//! simplification has inflated do not matter.
//!
//! A similarity `p -> scale p + shift` is sought in four ways: known conventions of tools and factors between units, the
//! bounding boxes, and from there the union nearest to the surface over the scale alone and over scale and shift: radii of
//! many simplified meshes are biased, their union is not. The fewest free parameters win where they leave the union nearly
//! as near: a convention is exact, the optimum follows the errors of the medial mesh. [`Fit::uncertainty`] estimates these.

use std::fmt;
use std::ops::Range;
use std::sync::Arc;

use glam::BVec3;
use rayon::prelude::*;

use super::{Shape, ShapeError};
use crate::Vec3;
use crate::complex::{MedialMesh, MedialUnion, Sphere};
use crate::surface::{InsideTest, Normalisation, Side, TriangleBvh};

/// A change of units: every length times `scale`, then a shift.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Similarity {
    /// The factor of all lengths; positive.
    pub scale: f64,
    /// What is added to the scaled coordinates.
    pub shift: Vec3,
}

impl Similarity {
    /// No change.
    pub const IDENTITY: Self = Self { scale: 1.0, shift: Vec3::ZERO };

    /// The point, changed.
    pub fn point(&self, p: Vec3) -> Vec3 {
        p * self.scale + self.shift
    }

    /// The medial mesh, changed.
    pub fn mesh(&self, mesh: &MedialMesh) -> MedialMesh {
        mesh.transformed(self.scale, |p| self.point(p))
    }

    fn sphere(&self, sphere: &Sphere) -> Sphere {
        Sphere::new(self.point(sphere.centre), sphere.radius * self.scale)
    }

    /// This one, then another.
    fn then(&self, next: &Self) -> Self {
        Self { scale: self.scale * next.scale, shift: next.point(self.shift) }
    }
}

impl fmt::Display for Similarity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Vec3 { x, y, z } = self.shift;
        write!(f, "lengths times {:.6}, then a shift by ({x:.6}, {y:.6}, {z:.6})", self.scale)
    }
}

/// Where a similarity comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FitSource {
    /// The file is in the units of its surface.
    Units,
    /// A cube from 0 to 10, as by MATFP.
    ToTen,
    /// A cube from 0 to 1, as by VMAS.
    ToOne,
    /// A cube from -1 to 1 around the middle.
    Around,
    /// A factor between common units, such as millimetres and inches, without a shift.
    Factor,
    /// The scale of the least misfit, without a shift.
    Scaled,
    /// The scale and the shift of the least misfit.
    Fitted,
}

impl fmt::Display for FitSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Units => "the units of the surface",
            Self::ToTen => "out of a cube from 0 to 10, as MATFP writes",
            Self::ToOne => "out of a cube from 0 to 1, as VMAS writes",
            Self::Around => "out of a cube from -1 to 1",
            Self::Factor => "a factor between units, no shift",
            Self::Scaled => "by least misfit without a shift",
            Self::Fitted => "by least misfit",
        })
    }
}

/// A similarity that brings a medial mesh to its surface.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Fit {
    /// From the units of the file to those of the surface.
    pub similarity: Similarity,
    /// Origin of the similarity.
    pub source: FitSource,
    /// Median of `|D(c) - r|` over the spheres of the file, as a fraction of the surface's diagonal; absent for points
    /// without radii.
    pub misfit_before: Option<f64>,
    /// The same after the similarity.
    pub misfit: Option<f64>,
    /// Error that the fit itself can be, as a fraction of the diagonal: the largest displacement of the surface's bounding
    /// box between the similarities of the nearest union, for all points of the surface and for every other one; at least
    /// the misfit. 0 for conventions and factors, which are exact.
    pub uncertainty: f64,
    /// Whether the mesh has the wrong units without doubt: it fits with the similarity, to 1 % of the diagonal at the median
    /// (5 % for conventions and factors), its union comes at least twice as near to the surface, and no change of the
    /// radii alone explains a scale between 0.5 and 2 as well.
    #[serde(skip)]
    pub is_needed: bool,
}

impl fmt::Display for Fit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { similarity, source, misfit_before, misfit, uncertainty, .. } = self;
        write!(f, "{similarity} ({source})")?;
        if *uncertainty > 0.0 {
            write!(
                f,
                "; the fit is uncertain by about {:.3} % of the diagonal",
                100.0 * uncertainty
            )?;
        }
        let (Some(before), Some(after)) = (misfit_before, misfit) else { return Ok(()) };
        let [before, after] = [before, after].map(|misfit| 100.0 * misfit);
        write!(
            f,
            "; radii and distances to the surface differ by {after:.3} % at the median, {before:.3} % before"
        )
    }
}

/// Median misfits, as fractions of the diagonal: from here on other units are tried.
const DOUBTFUL: f64 = 0.01;

/// Largest median misfit of needed units that are exact: without a free parameter, they fit no other surface by chance.
const FITTING: f64 = 0.05;

/// Scale from which a fit is needed up to [`FITTING`] although it has free parameters.
const FAR: f64 = 2.0;

/// Ratio of the boxes of surface and fitted union at which they match.
const BOX: Range<f64> = 0.8..1.25;

/// Limit of spheres for a fit, evenly taken from their list.
const SPHERES: usize = 4000;

/// Limit of points of the surface for a fit, evenly taken from their list.
const POINTS: usize = 1000;

/// Factors between units of length: of millimetres, centimetres, decimetres and metres, inches to millimetres, centimetres
/// and feet, feet to millimetres and metres.
const FACTORS: [f64; 8] = [1000.0, 100.0, 10.0, 25.4, 2.54, 12.0, 304.8, 0.3048];

/// Factor by which a similarity must bring the union nearer to the surface to be needed.
const NEARER: f64 = 2.0;

/// Limit of steps of the optimisation. Where there is an optimum, far fewer suffice.
const STEPS: usize = 60;

/// Largest ratios of the mean distance of a preferred similarity to that of the best scale, and to that of the best scale
/// and shift, whose four parameters follow the errors of the medial mesh.
const PREFERENCE: [f64; 2] = [1.5, 3.0];

/// Mean distance of the surface to the union at which any convention is preferred, as a fraction of the diagonal.
const CLOSE: f64 = 1e-3;

/// First and last step of the search for the nearest union, as fractions of the scale and of the diagonal.
const SEARCH_STEPS: [f64; 2] = [0.05, 1e-4];

/// Least share of centres in the solid from which the units of points without radii are accepted.
const INSIDE: f64 = 0.95;

impl Shape {
    /// How badly a medial mesh in the shape's input units fits: the median over the spheres of `|D(c) - r|`, where `D` is the
    /// distance of the centre to the surface, negative outside; a fraction of the diagonal. `None` without a sphere.
    ///
    /// # Errors
    /// When the surface has no face.
    pub fn misfit(&self, mesh: &MedialMesh) -> Result<Option<f64>, ShapeError> {
        let surface = Surface::of(self)?;
        Ok(median(&surface.residuals(&surface.spheres(mesh), &Similarity::IDENTITY)))
    }

    /// The similarity that brings a medial mesh with radii from unknown units to the shape's input units. Cost: some
    /// thousand distances to the surface for each of at most 60 steps.
    ///
    /// # Errors
    /// When the surface has no face.
    pub fn fit(&self, mesh: &MedialMesh) -> Result<Fit, ShapeError> {
        let surface = Surface::of(self)?;
        let spheres = surface.spheres(mesh);
        let mean = |s: &Similarity| surface.mean(&spheres, s);
        let boxes = surface.by_boxes(&spheres);
        // A mesh in a corner of the surface fits at any size, which the units of the file alone need not explain.
        let fits_box = |s: &Similarity| (1.0 / FAR..FAR).contains(&(boxes.scale / s.scale));
        let exact = surface.conventions().into_iter().chain(surface.factors());
        let exact = exact.filter(|(source, s)| *source == FitSource::Units || fits_box(s));
        let exact: Vec<_> = exact.collect();
        // Starts without a shift, and all.
        let plain = [surface.without_shift(boxes.scale)].into_iter();
        let plain =
            plain.chain(exact.iter().filter(|(source, _)| source.has_no_shift()).map(|e| e.1));
        let all = exact.iter().map(|e| e.1).chain([boxes]);
        let least = |starts: &mut dyn Iterator<Item = Similarity>| {
            let starts = starts.map(|s| (mean(&s), s));
            starts.min_by(|a, b| a.0.total_cmp(&b.0)).expect("the first one").1
        };
        let union = MedialUnion::new(&mesh.to_normal(&surface.units)).ok();
        let nearness = Nearness { union: union.as_ref(), points: &surface.points };
        let optimum = |start, source| {
            let found = surface.nearest(&nearness, start, source);
            (nearness.of(&found), found)
        };
        let scaled = optimum(least(&mut plain.into_iter()), FitSource::Scaled);
        let mut all = all.chain(Some(scaled.1).filter(fits_box));
        let fitted = optimum(least(&mut all), FitSource::Fitted);
        // The fewest free parameters that leave the union nearly as near as the optimum.
        let with_shift = PREFERENCE[1] * fitted.0;
        let enough = |has_no_shift: bool| {
            let without = if has_no_shift { PREFERENCE[0] * scaled.0 } else { f64::INFINITY };
            with_shift.min(without).max(CLOSE)
        };
        // What is within the uncertainty of the optimum may be right.
        let [of_scaled, of_fitted] = [(scaled, FitSource::Scaled), (fitted, FitSource::Fitted)]
            .map(|((_, found), source)| surface.uncertainty(&nearness, &found, source));
        let is_within = |source: FitSource, s: &Similarity| match source.has_no_shift() {
            true => {
                scaled.0 <= with_shift.max(CLOSE) && surface.displacement(s, &scaled.1) <= of_scaled
            }
            false => surface.displacement(s, &fitted.1) <= of_fitted,
        };
        let best = exact.into_iter().map(|(source, s)| (nearness.of(&s), source, s));
        let misfit = |s: &Similarity| median(&surface.residuals(&spheres, s)).unwrap_or(0.0);
        let best = best.filter(|(near, source, s)| {
            *near <= enough(source.has_no_shift())
                || is_within(*source, s)
                // A shift that brings the union of a coarse mesh nearer can take the spheres out of place.
                || source.has_no_shift()
                    && *near <= PREFERENCE[0] * scaled.0
                    && misfit(s) <= misfit(&fitted.1)
        });
        let best = best.min_by(|a, b| a.0.total_cmp(&b.0));
        let (after, normal, source, uncertainty) = match best {
            Some((near, source, s)) => (near, s, source, 0.0),
            None if scaled.0 <= enough(false) => (scaled.0, scaled.1, FitSource::Scaled, of_scaled),
            None => (fitted.0, fitted.1, FitSource::Fitted, of_fitted),
        };
        let [before, misfit] = [&Similarity::IDENTITY, &normal].map(misfit);
        let is_free = matches!(source, FitSource::Scaled | FitSource::Fitted);
        let is_far = !(1.0 / FAR..FAR).contains(&normal.scale);
        let is_needed = misfit <= if is_free && !is_far { DOUBTFUL } else { FITTING }
            && after.is_finite()
            && NEARER * after <= nearness.of(&Similarity::IDENTITY)
            // A larger scale brings the union of a few spheres nearer to the surface. A mesh in a corner of the
            // surface fits at any size.
            && (NEARER * mean(&normal) <= mean(&Similarity::IDENTITY)
                || is_far && BOX.contains(&(boxes.scale / normal.scale)))
            // Radii with a margin look like other units, but their centres are in place.
            && !(is_free && !is_far && surface.misfit_in_place(&spheres) <= misfit.max(CLOSE));
        Ok(Fit {
            similarity: surface.in_input_units(&normal),
            source,
            misfit_before: Some(before),
            misfit: Some(misfit),
            uncertainty: if is_free { uncertainty.max(misfit) } else { 0.0 },
            is_needed,
        })
    }

    /// The similarity of [`Shape::fit`] where [`Fit::is_needed`], for a mesh that does not fit to 1 % as it is, or whose
    /// box is far from that of the surface.
    ///
    /// # Errors
    /// When the surface has no face.
    pub fn fit_if_needed(&self, mesh: &MedialMesh) -> Result<Option<Fit>, ShapeError> {
        // A mesh that is far too small fits at a corner of the surface.
        let surface = Surface::of(self)?;
        let is_far = !(1.0 / FAR..FAR).contains(&surface.by_boxes(&surface.spheres(mesh)).scale);
        if !is_far && self.misfit(mesh)?.is_some_and(|misfit| misfit <= DOUBTFUL) {
            return Ok(None);
        }
        Ok(Some(self.fit(mesh)?).filter(|fit| fit.is_needed))
    }

    /// The similarity for points without radii: that convention of a tool which brings nearly all of them into the solid, the
    /// largest if there are several. `None` if none does.
    ///
    /// # Errors
    /// When the surface has no face.
    pub fn fit_of_points(&self, mesh: &MedialMesh) -> Result<Option<Fit>, ShapeError> {
        let surface = Surface::of(self)?;
        let points = surface.spheres(mesh);
        let fitting = surface.conventions().into_iter().filter(|(_, s)| {
            let centres: Vec<Vec3> = points.iter().map(|p| s.point(p.centre)).collect();
            let sides = surface.inside.sides(&centres);
            let count = sides.iter().filter(|side| **side != Side::Outside).count();
            count as f64 >= INSIDE * points.len() as f64
        });
        // The first of equals: the units of the surface, if they will do.
        let best =
            fitting.reduce(|best, other| if other.1.scale > best.1.scale { other } else { best });
        Ok(best.map(|(source, normal)| {
            let similarity = surface.in_input_units(&normal);
            let (misfit, uncertainty) = (None, 0.0);
            Fit { similarity, source, misfit_before: None, misfit, uncertainty, is_needed: true }
        }))
    }

    /// Distances of points in input units to the surface, whichever side they are on, in input units.
    ///
    /// # Errors
    /// When the surface has no face.
    pub fn distances(&self, points: &[Vec3]) -> Result<Vec<f64>, ShapeError> {
        let (tree, units) = (self.view().surface_tree()?, *self.normalisation());
        let normal: Vec<Vec3> = points.iter().map(|&p| units.forward(p)).collect();
        Ok(tree.distance_batch(&normal).into_iter().map(|d| d * units.diagonal).collect())
    }
}

/// A surface in normalised coordinates, in which similarities are sought.
struct Surface {
    tree: Arc<TriangleBvh>,
    inside: Arc<InsideTest>,
    units: Normalisation,
    lower: Vec3,
    upper: Vec3,
    /// Some vertices and centres of faces.
    points: Vec<Vec3>,
}

impl Surface {
    fn of(shape: &Shape) -> Result<Self, ShapeError> {
        // Nobody's use: it is no part of a method.
        let view = shape.view();
        let (lower, upper) = shape.mesh().bounding_box().unwrap_or_default();
        let (tree, inside) = (view.surface_tree()?, view.inside_test());
        let mesh = shape.mesh();
        let centre = |face| mesh.triangle(face).into_iter().sum::<Vec3>() / 3.0;
        let every = |count: usize| (2 * count).div_ceil(POINTS).max(1);
        let vertices = mesh.vertices.iter().copied().step_by(every(mesh.vertices.len()));
        let centres = (0..mesh.faces.len()).step_by(every(mesh.faces.len())).map(centre);
        let points = vertices.chain(centres).collect();
        Ok(Self { tree, inside, units: *shape.normalisation(), lower, upper, points })
    }

    /// Spheres of a file, evenly taken, in normalised coordinates as if the file were in input units.
    fn spheres(&self, mesh: &MedialMesh) -> Vec<Sphere> {
        let every = mesh.spheres.len().div_ceil(SPHERES).max(1);
        mesh.spheres
            .iter()
            .step_by(every)
            .map(|s: &Sphere| {
                Sphere::new(self.units.forward(s.centre), s.radius / self.units.diagonal)
            })
            .collect()
    }

    /// The units of the surface first, then the conventions of tools.
    fn conventions(&self) -> [(FitSource, Similarity); 4] {
        let side = (self.upper - self.lower).max_element();
        let middle = (self.upper + self.lower) / 2.0;
        // From coordinates in which the longest side has `length` and the point `from` of the surface is the origin.
        let out_of = |length: f64, from: Vec3| {
            let to_file = Similarity { scale: self.units.diagonal, shift: self.units.origin };
            to_file.then(&Similarity { scale: side / length, shift: from })
        };
        [
            (FitSource::Units, Similarity::IDENTITY),
            (FitSource::ToTen, out_of(10.0, self.lower)),
            (FitSource::ToOne, out_of(1.0, self.lower)),
            (FitSource::Around, out_of(2.0, middle)),
        ]
    }

    /// Factors between units, in both directions.
    fn factors(&self) -> impl Iterator<Item = (FitSource, Similarity)> {
        let scales = FACTORS.into_iter().flat_map(|factor| [factor, 1.0 / factor]);
        scales.map(|scale| (FitSource::Factor, self.without_shift(scale)))
    }

    /// A scale of input units in normalised coordinates.
    fn without_shift(&self, scale: f64) -> Similarity {
        Similarity { scale, shift: self.units.origin / self.units.diagonal * (scale - 1.0) }
    }

    /// The largest displacement of a corner of the surface's box from one similarity to another.
    fn displacement(&self, from: &Similarity, to: &Similarity) -> f64 {
        let corner = |k: u32| {
            Vec3::select(BVec3::new(k & 1 > 0, k & 2 > 0, k & 4 > 0), self.upper, self.lower)
        };
        let moved = |p: Vec3| p.distance(to.point((p - from.shift) / from.scale));
        (0..8).map(|k| moved(corner(k))).fold(0.0, f64::max)
    }

    /// [`Fit::uncertainty`] of the similarity of the nearest union, without the misfit.
    fn uncertainty(&self, nearness: &Nearness<'_>, found: &Similarity, source: FitSource) -> f64 {
        let halves = [0, 1].map(|first| {
            let half: Vec<Vec3> = self.points.iter().skip(first).step_by(2).copied().collect();
            let nearness = Nearness { union: nearness.union, points: &half };
            self.displacement(found, &self.nearest(&nearness, *found, source))
        });
        halves.into_iter().fold(0.0, f64::max)
    }

    /// From the box around the spheres to the box around the surface.
    fn by_boxes(&self, spheres: &[Sphere]) -> Similarity {
        let ends = spheres.iter().flat_map(|s| [s.centre - s.radius, s.centre + s.radius]);
        let (lower, upper) = ends
            .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(lower, upper), p| {
                (lower.min(p), upper.max(p))
            });
        let scale = (self.upper - self.lower).max_element() / (upper - lower).max_element();
        if !(scale.is_finite() && scale > 0.0) {
            return Similarity::IDENTITY;
        }
        Similarity { scale, shift: (self.upper + self.lower) / 2.0 - (upper + lower) / 2.0 * scale }
    }

    /// `D(c) - r` of every sphere, after a similarity.
    fn residuals(&self, spheres: &[Sphere], similarity: &Similarity) -> Vec<f64> {
        spheres.par_iter().map(|s| self.residual(&similarity.sphere(s))).collect()
    }

    /// The least misfit with the centres in place: after one factor for all radii, or one addition to them.
    fn misfit_in_place(&self, spheres: &[Sphere]) -> f64 {
        let radii: Vec<f64> = spheres.iter().map(|sphere| sphere.radius).collect();
        let gaps = self.residuals(spheres, &Similarity::IDENTITY);
        let added = middle(gaps.clone()).unwrap_or(0.0);
        let shares = gaps.iter().zip(&radii).filter(|(_, radius)| **radius > 0.0);
        let share = middle(shares.map(|(gap, radius)| gap / radius).collect()).unwrap_or(0.0);
        let after = |change: &dyn Fn(f64) -> f64| {
            let left: Vec<f64> = gaps.iter().zip(&radii).map(|(gap, r)| gap - change(*r)).collect();
            median(&left).unwrap_or(0.0)
        };
        after(&|_| added).min(after(&|radius| share * radius))
    }

    /// The mean of `|D(c) - r|` in the unit of the file. In that of the surface, spheres shrunk to one of its points would fit.
    fn mean(&self, spheres: &[Sphere], similarity: &Similarity) -> f64 {
        let sum: f64 = self.residuals(spheres, similarity).iter().map(|e| e.abs()).sum();
        sum / spheres.len().max(1) as f64 / similarity.scale
    }

    /// `D(c) - r`.
    fn residual(&self, sphere: &Sphere) -> f64 {
        let distance = self.tree.closest(sphere.centre).distance;
        let is_outside = self.inside.side(sphere.centre) == Side::Outside;
        (if is_outside { -distance } else { distance }) - sphere.radius
    }

    /// The similarity near a start that brings the union nearest to the surface, for `source` with or without a shift:
    /// steps of one parameter, halved where none helps.
    fn nearest(&self, nearness: &Nearness<'_>, start: Similarity, source: FitSource) -> Similarity {
        // The scale keeps the middle of the surface, or the origin of the input units.
        let fixed = match source {
            FitSource::Scaled => -self.units.origin / self.units.diagonal,
            _ => (self.upper + self.lower) / 2.0,
        };
        let directions = if source == FitSource::Scaled { 1 } else { 4 };
        let (mut best, mut least) = (start, nearness.of(&start));
        let [mut step, last] = SEARCH_STEPS;
        for _ in 0..STEPS {
            if step < last {
                break;
            }
            let before = least;
            for direction in 0..directions {
                for size in [step, -step] {
                    let moved = match direction {
                        0 => best.then(&Similarity { scale: 1.0 + size, shift: fixed * -size }),
                        _ => {
                            let shift = best.shift + Vec3::AXES[direction - 1] * size;
                            Similarity { shift, ..best }
                        }
                    };
                    let near = nearness.of(&moved);
                    if near < least {
                        (best, least) = (moved, near);
                    }
                }
            }
            if least == before {
                step /= 2.0;
            }
        }
        best
    }

    /// A similarity of normalised coordinates as one of input units.
    fn in_input_units(&self, normal: &Similarity) -> Similarity {
        let Normalisation { origin, diagonal } = self.units;
        Similarity {
            scale: normal.scale,
            shift: origin + normal.shift * diagonal - origin * normal.scale,
        }
    }
}

impl FitSource {
    fn has_no_shift(self) -> bool {
        matches!(self, Self::Units | Self::Factor)
    }
}

/// The union of a medial mesh, and points of the surface.
struct Nearness<'a> {
    /// `None` for a mesh without a union.
    union: Option<&'a MedialUnion>,
    points: &'a [Vec3],
}

impl Nearness<'_> {
    /// The mean distance of the points to the boundary of the union after a similarity.
    fn of(&self, similarity: &Similarity) -> f64 {
        let Some(union) = self.union else { return f64::INFINITY };
        let back = |&p: &Vec3| (p - similarity.shift) / similarity.scale;
        let points: Vec<Vec3> = self.points.iter().map(back).collect();
        let sum: f64 = union.signed_batch(&points).into_iter().map(f64::abs).sum();
        sum * similarity.scale / points.len().max(1) as f64
    }
}

/// The median of the absolute values.
fn median(values: &[f64]) -> Option<f64> {
    middle(values.iter().map(|value| value.abs()).collect())
}

/// The middle value, or the mean of the two in the middle.
fn middle(mut values: Vec<f64>) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    let middle = values.len() / 2;
    match values.len() % 2 {
        _ if values.is_empty() => None,
        1 => Some(values[middle]),
        _ => Some((values[middle - 1] + values[middle]) / 2.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::ShapeOptions;
    use crate::surface::fixtures::cuboid;
    use crate::surface::{TriMesh, validate};

    /// The shape of a surface, and its initial medial mesh in input units.
    fn shape_of(mesh: &TriMesh, sampling: &str) -> (Shape, MedialMesh) {
        let sampling = sampling.parse().unwrap();
        let options = ShapeOptions { sampling, ..ShapeOptions::default() };
        let shape = Shape::new("shape", mesh, validate(mesh).unwrap(), options).unwrap();
        let axis = shape.initial().unwrap().to_input(shape.normalisation());
        (shape, axis)
    }

    /// A block of 3 by 2 by 1 somewhere, and its initial medial mesh.
    fn block() -> (Shape, MedialMesh) {
        let lower = Vec3::new(5.0, -4.0, 1.0);
        shape_of(&cuboid(lower, lower + Vec3::new(3.0, 2.0, 1.0)), "uniform:4000")
    }

    #[test]
    fn units_of_the_surface_are_left_alone() {
        let (shape, axis) = block();
        let fit = shape.fit(&axis).unwrap();
        assert_eq!((fit.source, fit.similarity), (FitSource::Units, Similarity::IDENTITY));
        assert_eq!(shape.misfit(&axis).unwrap(), fit.misfit);
        assert!(fit.misfit.unwrap() < 0.005, "{fit:?}");
        assert_eq!(shape.misfit(&MedialMesh::default()).unwrap(), None);
    }

    #[test]
    fn cubes_of_tools_are_recognised() {
        let (shape, axis) = block();
        let lower = Vec3::new(5.0, -4.0, 1.0);
        for (source, length, from) in [
            (FitSource::ToTen, 10.0, lower),
            (FitSource::ToOne, 1.0, lower),
            (FitSource::Around, 2.0, lower + Vec3::new(1.5, 1.0, 0.5)),
        ] {
            let written = axis.transformed(length / 3.0, |p| (p - from) * (length / 3.0));
            for points in [false, true] {
                let fit = match points {
                    false => shape.fit(&written).unwrap(),
                    true => shape.fit_of_points(&written).unwrap().expect("a fit"),
                };
                assert_eq!(fit.source, source);
                let back = fit.similarity.mesh(&written);
                for (found, sphere) in back.spheres.iter().zip(&axis.spheres) {
                    assert!(
                        (found.centre - sphere.centre).length() < 1e-12,
                        "{found:?} {sphere:?}"
                    );
                    assert!((found.radius - sphere.radius).abs() < 1e-12);
                }
            }
        }
    }

    #[test]
    fn factors_and_scales_are_found_without_a_shift() {
        let (shape, axis) = block();
        let scales = FACTORS.into_iter().flat_map(|factor| [factor, 1.0 / factor]);
        let factors = scales.map(|scale| (scale, FitSource::Factor, 1e-12));
        let others = [180.0, 0.37, 3.1].map(|scale| (scale, FitSource::Scaled, 0.005));
        for (scale, source, tolerance) in factors.chain(others) {
            let written = axis.transformed(1.0 / scale, |p| p / scale);
            let fit = shape.fit(&written).unwrap();
            assert_eq!((fit.source, fit.is_needed), (source, true), "{scale}: {fit:?}");
            assert!((fit.similarity.scale / scale - 1.0).abs() < tolerance, "{scale}: {fit:?}");
            assert!(fit.similarity.shift.length() < 1e-9, "{scale}: {fit:?}");
            let is_exact = source == FitSource::Factor;
            assert!(fit.uncertainty < 0.01 && (fit.uncertainty == 0.0) == is_exact, "{fit:?}");
            let parts: Vec<f64> = (axis.spheres.iter().zip(&fit.similarity.mesh(&written).spheres))
                .map(|(a, b)| a.centre.distance(b.centre) / shape.normalisation().diagonal)
                .collect();
            assert!(
                parts.iter().all(|&off| off <= 2.0 * fit.uncertainty + 1e-12),
                "{scale}: {fit:?}"
            );
        }
    }

    /// A corner at the origin holds any mesh that is far too small.
    #[test]
    fn a_mesh_that_is_far_too_small_has_other_units() {
        let corner = cuboid(Vec3::ZERO, Vec3::new(3.0, 2.0, 1.0));
        let (shape, axis) = shape_of(&corner, "uniform:4000");
        for scale in [1000.0, 25.4] {
            let written = axis.transformed(1.0 / scale, |p| p / scale);
            let fit = shape.fit_if_needed(&written).unwrap().expect("other units");
            assert!((fit.similarity.scale / scale - 1.0).abs() < 1e-12, "{fit:?}");
        }
        // Some spheres in the right units stay.
        let few: Vec<bool> = axis.spheres.iter().map(|s| s.centre.length() < 0.8).collect();
        assert_eq!(shape.fit_if_needed(&axis.induced(&few)).unwrap(), None);
    }

    /// Radii that are 2 % too large, as of a coarse simplification, in a unit next to a known one.
    #[test]
    fn a_factor_that_is_nearly_right_is_not_taken() {
        let (shape, mut axis) = block();
        axis.spheres.iter_mut().for_each(|sphere| sphere.radius *= 1.02);
        for scale in [1.0 / 10.2, 1.0 / 9.5, 1.0 / 95.0, 0.95] {
            let written = axis.transformed(1.0 / scale, |p| p / scale);
            let fit = shape.fit(&written).unwrap();
            assert_eq!(fit.source, FitSource::Scaled, "{scale}: {fit:?}");
            let off = (fit.similarity.scale / scale - 1.0).abs();
            assert!(off < 0.02 && off < 4.0 * fit.uncertainty, "{scale}: {off} {fit:?}");
        }
    }

    /// One ball around a long bar, as the poles of few samples give: no unit brings it nearer.
    #[test]
    fn a_coarse_mesh_in_the_right_units_has_no_others() {
        let bar = cuboid(Vec3::ZERO, Vec3::new(100.0, 4.0, 4.0));
        let (shape, initial) = shape_of(&bar, "vertices");
        assert!(shape.misfit(&initial).unwrap().unwrap() > 0.4);
        assert_eq!(shape.fit_if_needed(&initial).unwrap(), None);
        assert_eq!(shape.fit(&initial).unwrap().source, FitSource::Units);
    }

    /// A globe of meridians and parallels with a radius of 1 around the origin.
    fn globe() -> TriMesh {
        let (around, down) = (24, 12);
        let angle = |k: u32, of: u32| std::f64::consts::TAU * f64::from(k) / f64::from(of);
        let at = |i: u32, j: u32| {
            let ((y, x), (sin, cos)) = (angle(i, around).sin_cos(), angle(j, 2 * down).sin_cos());
            Vec3::new(x * sin, y * sin, cos)
        };
        let rings = (1..down).flat_map(|j| (0..around).map(move |i| at(i, j)));
        let vertices = [Vec3::Z, -Vec3::Z].into_iter().chain(rings).collect();
        let id = |i: u32, j: u32| 2 + (j - 1) * around + i % around;
        let caps = (0..around)
            .flat_map(|i| [[0, id(i, 1), id(i + 1, 1)], [1, id(i + 1, down - 1), id(i, down - 1)]]);
        let sides =
            (1..down - 1).flat_map(|j| (0..around).map(move |i| (i, j))).flat_map(|(i, j)| {
                let [a, b, c, d] = [id(i, j), id(i, j + 1), id(i + 1, j + 1), id(i + 1, j)];
                [[a, b, c], [a, c, d]]
            });
        TriMesh { vertices, faces: caps.chain(sides).collect() }
    }

    /// A ball that contains a globe with a margin: with a smaller scale its radius would fit.
    #[test]
    fn a_margin_of_the_radii_is_no_change_of_units() {
        let (shape, _) = shape_of(&globe(), "conforming");
        for radius in [1.15, 1.3] {
            let ball = Sphere::new(Vec3::ZERO, radius);
            let mesh = MedialMesh::from_simplices(vec![ball], vec![], vec![]).unwrap();
            assert_eq!(shape.fit_if_needed(&mesh).unwrap(), None, "{radius}");
        }
    }

    /// Spheres that are too large by 1.5 % of the diagonal, as after a coarse simplification.
    #[test]
    fn a_coarse_mesh_has_the_units_of_a_factor() {
        let (shape, mut axis) = block();
        let diagonal = shape.normalisation().diagonal;
        axis.spheres.iter_mut().for_each(|sphere| sphere.radius += 0.015 * diagonal);
        let written = axis.transformed(1000.0, |p| p * 1000.0);
        let fit = shape.fit_if_needed(&written).unwrap().expect("other units");
        assert_eq!(fit.source, FitSource::Factor, "{fit:?}");
        assert!((fit.similarity.scale - 0.001).abs() < 1e-15 && fit.misfit.unwrap() > DOUBTFUL);
    }

    #[test]
    fn any_similarity_is_found() {
        let (shape, axis) = block();
        let written = axis.transformed(0.037, |p| p * 0.037 + Vec3::new(11.0, 7.0, -3.0));
        let fit = shape.fit(&written).unwrap();
        assert_eq!(fit.source, FitSource::Fitted);
        assert!((fit.similarity.scale * 0.037 - 1.0).abs() < 0.01, "{fit:?}");
        assert!(fit.misfit.unwrap() < 0.005 && fit.misfit_before.unwrap() > 0.5, "{fit:?}");
        // What belongs to another surface is not made to fit.
        let mut other = axis.clone();
        for (id, sphere) in other.spheres.iter_mut().enumerate() {
            sphere.radius = 0.1 + (id * 7919 % 100) as f64 / 50.0;
        }
        assert!(shape.fit(&other).unwrap().misfit.unwrap() > 0.03);
        assert_eq!(shape.fit_of_points(&other.transformed(100.0, |p| p * 100.0)).unwrap(), None);
    }
}
