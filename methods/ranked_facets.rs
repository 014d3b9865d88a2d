//! What the per-facet filters share: rank the Voronoi facets once, then keep those above a
//! threshold, or as many of the best as a number of spheres allows, with their edges and vertices.

use std::sync::Arc;

use medial::complex::{DualTriangulation, MedialMesh, VoronoiFacets};
use medial::shape::Shape;
use medial::simplifier::{
    Diagnostics, Extras, Level, Simplification, Simplified, SimplifyError, Work,
};

use crate::ranked::Scale;

/// The Voronoi facets of a shape and the medial mesh that their vertices belong to.
pub(crate) struct FacetSet {
    pub mesh: Arc<MedialMesh>,
    pub facets: VoronoiFacets,
    pub dual: DualTriangulation,
}

impl FacetSet {
    /// The facets of a shape's own Voronoi diagram.
    ///
    /// # Errors
    /// As [`Shape::voronoi`]; when a medial mesh was given, which has no Voronoi facets.
    pub(crate) fn of(shape: &Shape) -> Result<Self, SimplifyError> {
        if shape.has_given_initial() {
            let why = "it selects facets of the Voronoi diagram of the samples, and a given medial \
                       mesh has none: leave out --initial";
            return Err(SimplifyError::Unsupported { why: why.into() });
        }
        let (delaunay, cells, mesh) = (shape.delaunay()?, shape.cells()?, shape.voronoi()?);
        let facets = VoronoiFacets::new(&delaunay, &cells);
        Ok(Self { mesh, facets, dual: shape.options().dual })
    }
}

/// Facets with a value for each; larger values are kept longer.
pub(crate) struct RankedFacets {
    set: FacetSet,
    value: Vec<f64>,
    /// Facets by descending value, then ascending id.
    order: Vec<u32>,
    scale: Scale,
    /// The level of [`Level::Published`], where there is one.
    published: Option<f64>,
    /// Counts and warnings of the preparation, repeated with every level.
    prepared: Diagnostics,
}

impl RankedFacets {
    /// Ranks facets by `value`, in native units.
    pub(crate) fn new(
        set: FacetSet,
        value: Vec<f64>,
        scale: Scale,
        published: Option<f64>,
        prepared: Diagnostics,
    ) -> Self {
        let mut order: Vec<u32> = (0..value.len() as u32).collect();
        order.sort_unstable_by(|&a, &b| {
            value[b as usize].total_cmp(&value[a as usize]).then(a.cmp(&b))
        });
        Self { set, value, order, scale, published, prepared }
    }

    /// How many of the best facets have at most so many vertices together, at least one.
    fn facets_for(&self, spheres: usize) -> usize {
        let mut seen = vec![false; self.set.mesh.spheres.len()];
        let mut count = 0;
        for (rank, &facet) in self.order.iter().enumerate() {
            for &sphere in self.set.facets.polygon(facet as usize) {
                count += usize::from(!std::mem::replace(&mut seen[sphere as usize], true));
            }
            if count > spheres {
                return rank.max(1);
            }
        }
        self.order.len()
    }

    fn by_level(&self, level: f64) -> Result<usize, SimplifyError> {
        let kept = |&facet: &u32| {
            let value = self.value[facet as usize];
            value > level || (self.scale.inclusive && value == level)
        };
        self.scale.check(level)?;
        Ok(self.order.partition_point(kept))
    }
}

impl Simplification for RankedFacets {
    fn at(&mut self, level: Level) -> Result<Simplified, SimplifyError> {
        let mut diagnostics = self.prepared.clone();
        let (count, native) = match level {
            Level::Spheres(0) => {
                return Err(SimplifyError::Level("ask for at least one sphere".into()));
            }
            Level::Spheres(spheres) => {
                let count = self.facets_for(spheres);
                let dropped = self.order.get(count).map(|&facet| self.value[facet as usize]);
                (count, dropped.unwrap_or(*self.scale.range.start()))
            }
            Level::Native(level) => (self.by_level(level)?, level),
            Level::Published => match self.published {
                Some(level) => (self.by_level(level)?, level),
                None => {
                    return Err(SimplifyError::Unsupported { why: self.scale.no_published.into() });
                }
            },
        };
        let FacetSet { mesh, facets, dual } = &self.set;
        let mut kept = self.order[..count].to_vec();
        kept.sort_unstable();
        let mesh = facets.subcomplex(mesh, *dual, &kept, &[], &[]);
        let reached = mesh.spheres.len();
        match level {
            Level::Spheres(asked) if reached != asked => diagnostics.warn(format!(
                "{reached} spheres instead of {asked}: whole facets are kept, {} in all",
                if count == self.order.len() { "and these are" } else { "the best" }
            )),
            _ if reached == 0 => diagnostics.warn(format!(
                "no facet passes {} = {native}: the largest is {}",
                self.scale.name,
                self.order.first().map_or(0.0, |&facet| self.value[facet as usize])
            )),
            _ => {}
        }
        Ok(Simplified {
            mesh,
            asked: level,
            native_level: Some(native),
            work: Work::Anew,
            diagnostics,
            extras: Extras::default(),
        })
    }
}
