//! The common part of the per-facet filters: rank the Voronoi facets once, then keep those above a
//! threshold, or as many of the best as a number of spheres allows, with their edges and vertices.

use std::sync::Arc;

use medial::complex::{DualTriangulation, MedialMesh, Sphere, VoronoiFacets};
use medial::shape::Shape;
use medial::simplifier::{Diagnostics, Extras, Level, Simplification, Simplified, SimplifyError};

use rayon::prelude::*;

use crate::scale::{Scale, Wanted};
use crate::ties::{break_ties, mean};

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
    pub(crate) fn of(shape: &Shape) -> Result<Self, SimplifyError> {
        Self::refuse_given(shape)?;
        let (facets, mesh) = (shape.facets()?, shape.voronoi()?);
        Ok(Self { mesh, facets, dual: shape.options().dual })
    }

    /// Refuses a shape with a given medial mesh.
    pub(crate) fn refuse_given(shape: &Shape) -> Result<(), SimplifyError> {
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

/// The value by which facets are ranked.
pub(crate) trait FacetValue: Send + Sync {
    /// The value of a facet, in native units; larger values are kept longer.
    fn value(&self, facet: usize) -> f64;

    /// Whether the value of a facet is above a level. To be overridden where that is known sooner
    /// than the value.
    fn is_above(&self, level: f64) -> Box<dyn Fn(usize) -> bool + Sync + '_> {
        Box::new(move |facet| self.value(facet) > level)
    }
}

impl FacetValue for Vec<f64> {
    fn value(&self, facet: usize) -> f64 {
        self[facet]
    }
}

/// Facets with a value for each.
pub(crate) struct RankedFacets<'s> {
    set: FacetSet,
    value: Box<dyn FacetValue + 's>,
    scale: Scale,
    /// Counts and warnings of the preparation, repeated with every level.
    prepared: Diagnostics,
}

impl<'s> RankedFacets<'s> {
    /// Ranks facets by `value`.
    pub(crate) fn new(
        set: FacetSet,
        value: impl FacetValue + 's,
        scale: Scale,
        prepared: Diagnostics,
    ) -> Self {
        Self { set, value: Box::new(value), scale, prepared }
    }

    /// Values and facets by descending value. Only numbers of spheres need it, and each pays for it,
    /// because native levels are often decided without the values.
    fn order(&self) -> Vec<(f64, u32)> {
        let facets = (0..self.set.facets.len()).into_par_iter().with_min_len(256);
        let mut ranked: Vec<(f64, u32)> =
            facets.map(|facet| (self.value.value(facet), facet as u32)).collect();
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
        let (value, inclusive) = (&self.value, self.scale.inclusive);
        let is_above = value.is_above(level);
        let kept = |&facet: &u32| {
            let facet = facet as usize;
            is_above(facet) || (inclusive && value.value(facet) == level)
        };
        let facets = (0..self.set.facets.len() as u32).into_par_iter().with_min_len(256);
        facets.filter(kept).collect()
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

impl Simplification for RankedFacets<'_> {
    fn at(&mut self, level: Level) -> Result<Simplified, SimplifyError> {
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
        let mesh = facets.subcomplex(mesh, *dual, &kept, &[], &[]);
        let reached = mesh.spheres.len();
        match level {
            Level::Spheres(asked) if reached != asked => diagnostics.warn(format!(
                "{reached} spheres instead of {asked}: whole facets are kept, {} in all",
                if kept.len() == self.set.facets.len() { "and these are" } else { "the best" }
            )),
            _ if reached == 0 => diagnostics.warn(format!(
                "no facet passes {} = {native}: the largest is {}",
                self.scale.name,
                self.order().first().map_or(0.0, |&(value, _)| value.max(0.0))
            )),
            _ => {}
        }
        Ok(Simplified {
            mesh,
            asked: level,
            native_level: Some(native),
            diagnostics,
            extras: Extras::default(),
        })
    }
}
