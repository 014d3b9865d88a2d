//! Angle filter, per sphere: keeps the medial spheres whose closest boundary points subtend a
//! large angle.
//!
//! Attali, Montanvert: *Modeling noise for a better simplification of skeletons*, ICIP 1996,
//! doi:10.1109/ICIP.1996.560357. Foskey, Lin, Manocha: *Efficient computation of a simplified
//! medial axis*, JCISE 3(4), 2003, doi:10.1115/1.1631582, who call the result the theta-simplified
//! medial axis.
//!
//! 1. The initial medial mesh with the contact points `Pi(x)` of each sphere.
//! 2. The separation angle `S(x) = max over p, q in Pi(x) of the angle pxq`; for contact points at
//!    distance `r` from `x`, `S = 2 arcsin(|p - q| / 2r)`.
//! 3. Keep the spheres with `S > theta`, or the given number of spheres with the largest `S`.
//! 4. The induced subcomplex: edges and faces all of whose spheres are kept.
//!
//! `S` is scale-invariant. The *object angle* of Stolpner and Siddiqi is half of it.
//!
//! # Deviations from the papers
//! - Attali and Montanvert, and Foskey et al., filter the facets of a Voronoi diagram and of a
//!   grid. This variant filters Voronoi vertices, so that it can be asked for a number of spheres
//!   like every other method.
//! - A sphere that touches the boundary at its own centre (radius zero), or in fewer than two points,
//!   has no angle; it gets `S = 0` and goes first.

use medial::geometry::separation_angle;
use medial::shape::Shape;
use medial::simplifier::{
    Diagnostics, MedialSimplifier, MethodInfo, NativeLevel, Params, RunContext, Simplification,
    SimplifyError,
};
use rayon::prelude::*;
use serde::Deserialize;

use crate::ranked::{Ranked, Scale};

/// The angle filter as a method.
pub struct AngleFilter {
    info: MethodInfo,
}

/// The angle filter has no parameter beside its level.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AngleParams {}

impl AngleFilter {
    /// The method with its description.
    pub fn new() -> Self {
        Self {
            info: MethodInfo {
                id: "angle",
                title: "Angle filter",
                citation: "Attali, Montanvert 1996, Modeling noise for a better simplification of \
                           skeletons, ICIP, doi:10.1109/ICIP.1996.560357; Foskey, Lin, Manocha 2003, \
                           Efficient computation of a simplified medial axis, JCISE 3(4), \
                           doi:10.1115/1.1631582",
                summary: "Keeps the spheres whose contact points subtend the largest angles.",
                native: Some(NativeLevel {
                    name: "theta",
                    unit: "degrees of separation angle",
                    larger_is_coarser: true,
                }),
                published: "unsupported: the papers choose theta for each model",
                params: vec![],
            },
        }
    }
}

impl Default for AngleFilter {
    fn default() -> Self {
        Self::new()
    }
}

impl MedialSimplifier for AngleFilter {
    fn info(&self) -> &MethodInfo {
        &self.info
    }

    fn prepare<'s>(
        &self,
        shape: &'s Shape,
        params: &Params,
        _run: &RunContext,
    ) -> Result<Box<dyn Simplification + 's>, SimplifyError> {
        let AngleParams {} = params.typed()?;
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
        let scale = Scale {
            name: "theta",
            range: 0.0..=180.0,
            inclusive: false,
            no_published: "the papers choose theta for each model; ask for a number of spheres or \
                           for an angle in degrees (15 to 120 is usual)",
        };
        Ok(Box::new(Ranked::new(mesh, value, scale, diagnostics)))
    }
}
