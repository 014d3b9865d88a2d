//! Lambda-medial axis, per sphere: keeps the medial spheres whose contact points need a large
//! enclosing ball.
//!
//! Chazal, Lieutier: *The lambda-medial axis*, Graphical Models 67(4), 2005,
//! doi:10.1016/j.gmod.2005.01.002.
//!
//! 1. The initial medial mesh with the contact points `Pi(x)` of each sphere.
//! 2. `F(x)`, the radius of the smallest ball enclosing `Pi(x)`.
//! 3. Keep the spheres with `F >= lambda`, or the given number of spheres with the largest `F`.
//! 4. The induced subcomplex: edges and faces all of whose spheres are kept.
//!
//! `lambda` is a length, a fraction of the input's bounding-box diagonal. `F(x) <= r(x)`, with
//! equality where `x` lies in the convex hull of its contact points.
//!
//! # Deviations from the paper
//! - The paper's set is a closed subset of the whole axis; the filter on Voronoi vertices with the
//!   induced subcomplex can be asked for a number of spheres like every other method.
//! - The text of the Q-MAT paper says "circumradius of the closest points". For a Voronoi vertex
//!   the circumradius of its four samples is the ball's own radius, which would make this a size
//!   filter; the smallest enclosing ball is the definition of Chazal and Lieutier.

use medial::geometry::enclosing_ball;
use medial::shape::Shape;
use medial::simplifier::{
    Diagnostics, MedialSimplifier, MethodInfo, NativeLevel, Params, RunContext, Simplification,
    SimplifyError,
};
use rayon::prelude::*;
use serde::Deserialize;

use crate::ranked::{Ranked, Scale};

/// The lambda-medial axis as a method.
pub struct LambdaMedialAxis {
    info: MethodInfo,
}

/// The lambda-medial axis has no parameter beside its level.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LambdaParams {}

impl LambdaMedialAxis {
    /// The method with its description.
    pub fn new() -> Self {
        Self {
            info: MethodInfo {
                id: "lambda",
                title: "Lambda-medial axis",
                citation: "Chazal, Lieutier 2005, The lambda-medial axis, Graphical Models 67(4), \
                           doi:10.1016/j.gmod.2005.01.002",
                summary: "Keeps the spheres whose contact points need the largest enclosing balls.",
                native: Some(NativeLevel {
                    name: "lambda",
                    unit: "fraction of the bounding-box diagonal",
                    larger_is_coarser: true,
                }),
                published: "unsupported: the paper gives no universal lambda",
                params: vec![],
            },
        }
    }
}

impl Default for LambdaMedialAxis {
    fn default() -> Self {
        Self::new()
    }
}

impl MedialSimplifier for LambdaMedialAxis {
    fn info(&self) -> &MethodInfo {
        &self.info
    }

    fn prepare<'s>(
        &self,
        shape: &'s Shape,
        params: &Params,
        _run: &RunContext,
    ) -> Result<Box<dyn Simplification + 's>, SimplifyError> {
        let LambdaParams {} = params.typed()?;
        let mesh = shape.initial()?;
        let mut diagnostics = Diagnostics::default();
        let contacts = shape.contacts(&mesh, &mut diagnostics)?;
        let value = (0..mesh.spheres.len())
            .into_par_iter()
            .map(|sphere| contacts.with(sphere, |points| enclosing_ball(points).1))
            .collect();
        let scale = Scale {
            name: "lambda",
            range: 0.0..=1.0,
            inclusive: true,
            no_published: "the paper gives no universal lambda; ask for a number of spheres or for \
                           a fraction of the diagonal (0.001 to 0.1 is usual)",
        };
        Ok(Box::new(Ranked::new(mesh, value, scale, diagnostics)))
    }
}
