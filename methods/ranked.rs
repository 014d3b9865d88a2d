//! The common part of the per-sphere filters: rank the spheres once, then keep those above a threshold
//! or a number of the best, and return the induced subcomplex.

use std::ops::RangeInclusive;
use std::sync::Arc;

use medial::Vec3;
use medial::complex::{DualTriangulation, MedialMesh, Sphere, VoronoiFacets};
use medial::geometry::trees::spread_order;
use medial::shape::Shape;
use medial::simplifier::{
    Diagnostics, Level, RunContext, Simplification, Simplified, SimplifyError,
};
use rayon::prelude::*;

use crate::Result;
use crate::levels::{level_within, some_spheres};

/// An initial medial mesh with a value for each sphere; larger values are kept longer.
pub(crate) struct Ranked {
    mesh: Arc<MedialMesh>,
    value: Vec<f64>,
    /// Spheres by descending value; those that tie as [`break_ties`] has them.
    order: Vec<u32>,
    scale: Scale,
    /// Counts and warnings of the preparation, repeated with every level.
    prepared: Diagnostics,
}

impl Ranked {
    /// Ranks the spheres of `mesh`. `value` holds native units.
    pub(crate) fn new(
        mesh: Arc<MedialMesh>,
        value: Vec<f64>,
        scale: Scale,
        prepared: Diagnostics,
    ) -> Self {
        let mut order: Vec<u32> = (0..value.len() as u32).collect();
        order.sort_unstable_by(|&a, &b| {
            value[b as usize].total_cmp(&value[a as usize]).then(a.cmp(&b))
        });
        break_ties(&mut order, |s| value[s as usize], |s| mesh.spheres[s as usize]);
        Self { mesh, value, order, scale, prepared }
    }

    /// Ranks the spheres of the initial medial mesh by a value of their contact points. `O(n log n)`.
    pub(crate) fn by_contacts(
        shape: &Shape,
        run: &RunContext,
        value: impl Fn(Sphere, &[Vec3]) -> f64 + Sync,
        scale: impl FnOnce(&MedialMesh) -> Scale,
    ) -> Result<Self> {
        let mesh = shape.initial()?;
        let mut diagnostics = Diagnostics::default();
        let contacts = shape.contacts(&mesh, &mut diagnostics)?;
        let values = mesh.spheres.par_iter().enumerate().map(|(place, &sphere)| {
            run.check()?;
            Ok(contacts.with(place, |points| value(sphere, points)))
        });
        let values = values.collect::<Result<_>>()?;
        let scale = scale(&mesh);
        Ok(Self::new(mesh, values, scale, diagnostics))
    }

    fn by_count(&self, requested: usize, diagnostics: &mut Diagnostics) -> (Vec<bool>, f64) {
        let count = requested.min(self.order.len());
        if count < requested {
            diagnostics.warn(format!(
                "{count} spheres instead of {requested}: the initial medial mesh has no more"
            ));
        }
        // The level that would cut here: the value of the first sphere that is dropped.
        let threshold = match self.order.get(count) {
            Some(&dropped) => self.value[dropped as usize],
            None => *self.scale.range.start(),
        };
        let mut keep = vec![false; self.order.len()];
        for &sphere in &self.order[..count] {
            keep[sphere as usize] = true;
        }
        (keep, threshold)
    }

    fn by_level(&self, level: f64) -> (Vec<bool>, f64) {
        (self.value.iter().map(|&value| self.scale.keeps(value, level)).collect(), level)
    }
}

impl Simplification for Ranked {
    fn at(&mut self, level: Level) -> Result<Simplified> {
        let mut diagnostics = self.prepared.clone();
        let (keep, native) = match self.scale.wanted(level, &mut diagnostics)? {
            Wanted::Spheres(requested) => self.by_count(requested, &mut diagnostics),
            Wanted::Native(value) => self.by_level(value),
        };
        let mesh = self.mesh.induced(&keep);
        if mesh.spheres.is_empty() {
            let largest = self.order.first().map_or(0.0, |&s| self.value[s as usize]);
            let name = self.scale.name;
            diagnostics
                .warn(format!("no sphere passes {name} = {native}: the largest is {largest}"));
        }
        let native_level = Some(native);
        Ok(Simplified { native_level, diagnostics, ..Simplified::new(mesh, level) })
    }
}

// How the filters compare a value with a level, and the supported requests.

/// How the values are compared with a native level.
pub(crate) struct Scale {
    /// Name of the level for messages.
    pub name: &'static str,
    /// Range of meaningful levels, in native units.
    pub range: RangeInclusive<f64>,
    /// `true` keeps values at the level (`>=`), `false` only those above it (`>`).
    pub inclusive: bool,
    /// The meaning of [`Level::Published`].
    pub published: Published,
}

/// The meaning of [`Level::Published`].
pub(crate) enum Published {
    /// The paper's own level.
    Native(f64),
    /// A documented level where no paper has a single one, and its author, for a warning.
    Documented(f64, &'static str),
    /// There is none, and why.
    None(&'static str),
}

/// A valid request to a filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Wanted {
    /// At least one sphere.
    Spheres(usize),
    /// A level in range.
    Native(f64),
}

impl Scale {
    fn keeps(&self, value: f64, level: f64) -> bool {
        value > level || self.inclusive && value == level
    }

    /// The request of a level; a documented level is announced in `diagnostics`.
    pub(crate) fn wanted(&self, level: Level, diagnostics: &mut Diagnostics) -> Result<Wanted> {
        match some_spheres(level)? {
            Level::Spheres(count) => Ok(Wanted::Spheres(count)),
            Level::Native(level) => {
                level_within(self.name, level, self.range.clone()).map(Wanted::Native)
            }
            Level::Published => match self.published {
                Published::Native(level) => Ok(Wanted::Native(level)),
                Published::Documented(level, whose) => {
                    let name = self.name;
                    diagnostics.warn(format!(
                        "no single level is published; this is {name} = {level}, {whose}"
                    ));
                    Ok(Wanted::Native(level))
                }
                Published::None(why) => Err(SimplifyError::unsupported(why)),
            },
        }
    }
}

// The order of items of equal value.
//
// Many values are equal: sheets through the middle of their two samples all have 180 degrees, facets of
// a plate all have half its thickness. Ordered by index, the first of them would form one lump at one
// end of the shape, because indices follow a curve. Ordered by rounding errors, which grow with the
// coordinates, they would, too. So values that agree up to rounding count as equal ([`tie`]).
//
// Larger items are kept first. Items of about the same size are ordered such that every prefix is
// spread over all of them ([`spread_order`]). Sizes are compared by half octaves: compared exactly, the
// first items would gather where the shape is thickest, and rounding would decide on a plate.

/// Size classes in a doubling of the radius.
const CLASSES: f64 = 2.0;

/// Bound on the relative rounding error of equal values.
const ROUNDING: f64 = 1e-12;

/// Whether two values are equal up to rounding.
fn tie(a: f64, b: f64) -> bool {
    (a - b).abs() <= ROUNDING * a.abs().max(b.abs())
}

/// Puts every run of values that tie in order. `items` are by descending value; `sphere` gives where an
/// item is and how large. `O(n)` where nothing ties.
pub(crate) fn break_ties<T: Copy>(
    items: &mut [T],
    value: impl Fn(T) -> f64,
    sphere: impl Fn(T) -> Sphere,
) {
    for run in items.chunk_by_mut(|&a, &b| tie(value(a), value(b))) {
        if run.len() > 1 {
            order_of_equals(run, &sphere);
        }
    }
}

fn order_of_equals<T: Copy>(run: &mut [T], sphere: &impl Fn(T) -> Sphere) {
    let mut keyed: Vec<(f64, T)> =
        run.iter().map(|&item| ((sphere(item).radius.log2() * CLASSES).floor(), item)).collect();
    keyed.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut rest = run.iter_mut();
    for equals in keyed.chunk_by(|a, b| a.0 == b.0) {
        let centres: Vec<Vec3> = equals.iter().map(|&(_, item)| sphere(item).centre).collect();
        let spread = spread_order(&centres);
        for (place, next) in spread.into_iter().zip(rest.by_ref()) {
            *next = equals[place as usize].1;
        }
    }
}

/// The mean centre and radius of some spheres, at least one.
pub(crate) fn mean(spheres: impl ExactSizeIterator<Item = Sphere>) -> Sphere {
    let share = 1.0 / spheres.len() as f64;
    let sum = spheres.fold((Vec3::ZERO, 0.0), |sum, s| (sum.0 + s.centre, sum.1 + s.radius));
    Sphere::new(sum.0 * share, sum.1 * share)
}

// # Facets
//
// The common part of the per-facet filters: rank the Voronoi facets once, then keep those above a
// threshold, or as many of the best as a number of spheres allows, with their edges and vertices.

/// The Voronoi facets of a shape and the medial mesh that their vertices belong to.
pub(crate) struct FacetSet {
    pub mesh: Arc<MedialMesh>,
    pub facets: Arc<VoronoiFacets>,
    pub dual: DualTriangulation,
}

impl FacetSet {
    /// The facets of a shape's own Voronoi diagram.
    ///
    /// # Errors
    /// As [`Shape::voronoi`]; when a medial mesh was given, which has no Voronoi facets.
    pub(crate) fn of(shape: &Shape) -> Result<Self> {
        Self::refuse_given(shape)?;
        let (facets, mesh) = (shape.facets()?, shape.voronoi()?);
        Ok(Self { mesh, facets, dual: shape.options().dual })
    }

    /// Rejects a shape with an external initial medial mesh.
    pub(crate) fn refuse_given(shape: &Shape) -> Result<()> {
        if shape.has_given_initial() {
            let why = "it selects facets of the Voronoi diagram of the samples, and a given medial \
                       mesh has none: leave out --initial";
            return Err(SimplifyError::unsupported(why));
        }
        Ok(())
    }

    /// The mean centre and radius of the vertices of a facet.
    pub(crate) fn middle(&self, facet: u32) -> Sphere {
        let vertices = self.facets.polygon(facet as usize).iter();
        mean(vertices.map(|&v| self.mesh.spheres[v as usize]))
    }
}

/// Facets with a value for each, in native units; larger values are kept longer.
pub(crate) struct RankedFacets {
    set: FacetSet,
    value: Vec<f64>,
    scale: Scale,
    /// Counts and warnings of the preparation, repeated with every level.
    prepared: Diagnostics,
}

impl RankedFacets {
    /// Ranks facets by the values of `value(facet)`. Parallel.
    pub(crate) fn new(
        set: FacetSet,
        value: impl Fn(usize) -> f64 + Sync + Send,
        scale: Scale,
        prepared: Diagnostics,
    ) -> Self {
        let value = (0..set.facets.len()).into_par_iter().with_min_len(256).map(value).collect();
        Self { set, value, scale, prepared }
    }

    /// Values and facets by descending value. Only numbers of spheres need it, and each pays for it.
    fn order(&self) -> Vec<(f64, u32)> {
        let mut ranked: Vec<(f64, u32)> = self.value.iter().copied().zip(0..).collect();
        ranked.par_sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        break_ties(&mut ranked, |(value, _)| value, |(_, facet)| self.set.middle(facet));
        ranked
    }

    /// The number of first facets of an order that together have at most `spheres` vertices; at least
    /// one.
    fn facets_for(&self, order: &[(f64, u32)], spheres: usize) -> usize {
        let mut seen = vec![false; self.set.mesh.spheres.len()];
        let mut count = 0;
        for (rank, &(_, facet)) in order.iter().enumerate() {
            for &sphere in self.set.facets.polygon(facet as usize) {
                count += usize::from(!std::mem::replace(&mut seen[sphere as usize], true));
            }
            if count > spheres {
                return rank.max(1);
            }
        }
        self.set.facets.len()
    }

    /// The facets that a native level keeps, ascending.
    fn by_level(&self, level: f64) -> Vec<u32> {
        (0..)
            .zip(&self.value)
            .filter(|&(_, &value)| self.scale.keeps(value, level))
            .map(|(id, _)| id)
            .collect()
    }

    /// The facets that a number of spheres allows, ascending, and the value of the best of the
    /// others.
    fn by_count(&self, spheres: usize) -> (Vec<u32>, f64) {
        let order = self.order();
        let count = self.facets_for(&order, spheres);
        let dropped = order.get(count).map(|&(value, _)| value);
        let mut kept: Vec<u32> = order[..count].iter().map(|&(_, facet)| facet).collect();
        kept.sort_unstable();
        (kept, dropped.unwrap_or(*self.scale.range.start()))
    }
}

impl Simplification for RankedFacets {
    fn at(&mut self, level: Level) -> Result<Simplified> {
        if self.set.facets.is_empty() {
            // A tetrahedron has a Voronoi vertex inside, but no facet around it.
            let why = "no Voronoi facet lies inside the surface as a whole, so that none can be \
                       selected: sample more densely, for example --sampling blue:20000";
            return Err(SimplifyError::unsupported(why));
        }
        let mut diagnostics = self.prepared.clone();
        let (kept, native) = match self.scale.wanted(level, &mut diagnostics)? {
            Wanted::Spheres(spheres) => self.by_count(spheres),
            Wanted::Native(level) => (self.by_level(level), level),
        };
        let FacetSet { mesh, facets, dual } = &self.set;
        let mesh = facets.subcomplex(mesh, *dual, &kept);
        let reached = mesh.spheres.len();
        match level {
            Level::Spheres(requested) if reached != requested => diagnostics.warn(format!(
                "{reached} spheres instead of {requested}: {}",
                match kept.len() == self.set.facets.len() {
                    true => "all facets together have no more",
                    false => "whole facets are kept, and the next one has several spheres",
                }
            )),
            _ if reached == 0 => diagnostics.warn(format!(
                "no facet passes {} = {native}: the largest is {}",
                self.scale.name,
                self.order().first().map_or(0.0, |&(value, _)| value.max(0.0))
            )),
            _ => {}
        }
        let native_level = Some(native);
        Ok(Simplified { native_level, diagnostics, ..Simplified::new(mesh, level) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Balls along a line, in order, so that the first ones are one end.
    fn line(radius: impl Fn(u32) -> f64) -> Vec<Sphere> {
        (0..1000).map(|k| Sphere::new(Vec3::new(f64::from(k), 0.0, 0.0), radius(k))).collect()
    }

    fn ordered(balls: &[Sphere], value: impl Fn(u32) -> f64) -> Vec<u32> {
        let mut items: Vec<u32> = (0..balls.len() as u32).collect();
        items.sort_by(|&a, &b| value(b).total_cmp(&value(a)));
        break_ties(&mut items, value, |item| balls[item as usize]);
        items
    }

    #[test]
    fn every_beginning_of_the_tied_is_spread() {
        // Radii that differ by rounding alone.
        let balls = line(|k| 1.1 + 1e-16 * f64::from(k % 7));
        // Values that grow along the line by rounding alone.
        let order = ordered(&balls, |k| 180.0 * (1.0 + 1e-15 * f64::from(k / 100)));
        for kept in [5, 30, 200] {
            let mut first = order[..kept].to_vec();
            first.sort_unstable();
            let ends = [first[0], 999 - first[kept - 1]];
            let gaps = first.windows(2).map(|pair| pair[1] - pair[0]);
            let widest = gaps.chain(ends).max().expect("gaps");
            assert!(widest as usize <= 3 * 1000 / kept, "{kept}: {widest}");
        }
    }

    #[test]
    fn values_come_before_sizes_and_sizes_before_places() {
        let balls = line(|k| if k % 10 == 0 { 4.0 } else { 1.0 });
        let order = ordered(&balls, |k| f64::from(u32::from(k >= 500)));
        let large = |items: &[u32]| items.iter().filter(|&&k| k % 10 == 0).count();
        assert!(order[..500].iter().all(|&k| k >= 500));
        assert_eq!((large(&order[..50]), large(&order[50..500])), (50, 0));
        assert_eq!((large(&order[500..550]), large(&order[550..])), (50, 0));
    }

    #[test]
    fn the_numbering_does_not_matter() {
        let balls = line(|k| 1.0 + f64::from(k % 3));
        let mut reversed = balls.clone();
        reversed.reverse();
        let one: Vec<Vec3> =
            ordered(&balls, |_| 0.0).iter().map(|&k| balls[k as usize].centre).collect();
        let other: Vec<Vec3> =
            ordered(&reversed, |_| 0.0).iter().map(|&k| reversed[k as usize].centre).collect();
        assert_eq!(one, other);
    }
}
