//! HEM.

mod bound;
mod contract;
mod edge;
mod params;
mod star;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use medial::complex::MedialMesh;
use medial::complex::collapse::replay;
use medial::shape::{ContactSets, Shape, ShapeError};
use medial::simplifier::{
    Diagnostics, Level, MedialSimplifier, MethodInfo, NativeLevel, Params, RunContext,
    Simplification, Simplified, SimplifyError, Work,
};

pub use params::{HemParams, Inside};

use bound::SampleError;
use contract::{Contraction, Stop};

/// Error bound of [`Level::Published`]: the default of the authors' code.
const PUBLISHED: f64 = 1e-4;

/// The HEM simplifier.
#[derive(Clone, Debug)]
pub struct Hem {
    info: MethodInfo,
}

impl Default for Hem {
    fn default() -> Self {
        Self::new()
    }
}

impl Hem {
    /// The method.
    pub fn new() -> Self {
        let info = MethodInfo {
            id: "hem",
            title: "HEM",
            citation: "Feng Sun, Yi-King Choi, Yizhou Yu, Wenping Wang 2016. Medial Meshes - A \
                       Compact and Accurate Representation of Medial Axis Transform. IEEE \
                       Transactions on Visualization and Computer Graphics 22(3). \
                       https://doi.org/10.1109/TVCG.2015.2448080",
            summary: "Collapses the edges of the medial mesh in the order of the Hausdorff error \
                      from the boundary samples to the primitives around the surviving end.",
            native: Some(NativeLevel {
                name: "epsilon",
                unit: "fraction of the diagonal",
                larger_is_coarser: true,
            }),
            published: "epsilon = 1e-4, the default of the authors' code",
            params: HemParams::describe(),
        };
        Self { info }
    }
}

impl MedialSimplifier for Hem {
    fn info(&self) -> &MethodInfo {
        &self.info
    }

    fn prepare<'s>(
        &self,
        shape: &'s Shape,
        params: &Params,
        run: &RunContext,
    ) -> Result<Box<dyn Simplification + 's>, SimplifyError> {
        let params = params.typed::<HemParams>()?;
        let initial = shape.initial()?;
        if initial.spheres.is_empty() {
            return Err(ShapeError::EmptyMedialMesh.into());
        }
        run.step(0, initial.spheres.len())?;
        let mut prepared = Diagnostics::default();
        let contacts = shape.contacts(&initial, &mut prepared)?;
        let contraction = Contraction::new(&initial, &contacts, params);
        let run = run.clone();
        Ok(Box::new(Prepared {
            initial,
            contacts,
            params,
            run,
            prepared,
            contraction,
            asked: false,
        }))
    }
}

/// One shape, as far as it was contracted.
struct Prepared {
    initial: Arc<MedialMesh>,
    contacts: ContactSets,
    params: HemParams,
    run: RunContext,
    /// Warnings of the preparation, repeated with every level.
    prepared: Diagnostics,
    contraction: Contraction,
    asked: bool,
}

impl Simplification for Prepared {
    fn at(&mut self, level: Level) -> Result<Simplified, SimplifyError> {
        match level {
            Level::Spheres(0) => {
                Err(SimplifyError::Level("at least one sphere must stay".to_owned()))
            }
            Level::Spheres(count) => self.at_count(count),
            Level::Native(epsilon) if !(epsilon >= 0.0) => Err(SimplifyError::Level(format!(
                "epsilon = {epsilon:?} is not a distance"
            ))),
            Level::Native(epsilon) => self.at_bound(level, epsilon),
            Level::Published => self.at_bound(level, PUBLISHED),
        }
    }
}

impl Prepared {
    fn at_count(&mut self, target: usize) -> Result<Simplified, SimplifyError> {
        let spheres = self.initial.spheres.len();
        let mut diagnostics = self.prepared.clone();
        if target > spheres {
            diagnostics.warn(format!(
                "{spheres} spheres instead of {target}: the initial medial mesh has no more"
            ));
        }
        let restart = self.contraction.sphere_count() < target.min(spheres);
        let work = self.contract(Stop::Spheres(target), restart)?;
        self.contraction.diagnose(&mut diagnostics);
        let reached = self.contraction.sphere_count();
        if reached > target {
            let why = self.contraction.why_stopped();
            diagnostics.warn(format!("{reached} spheres instead of {target}: {why}"));
        }
        let mesh = self.contraction.to_mesh();
        mesh.check()?;
        let native_level = Some(self.contraction.largest());
        Ok(Simplified { mesh, asked: Level::Spheres(target), native_level, work, diagnostics })
    }

    fn at_bound(&mut self, asked: Level, epsilon: f64) -> Result<Simplified, SimplifyError> {
        let mut diagnostics = self.prepared.clone();
        let error = SampleError::new(&self.contacts, self.params.inside);
        let initial = error.of(&self.initial)?;
        if initial > epsilon {
            return Err(SimplifyError::Level(format!(
                "epsilon = {epsilon} cannot be held: the initial medial mesh is already {initial} \
                 of the diagonal off the samples"
            )));
        }
        let restart = self.contraction.largest() > epsilon;
        let work = self.contract(Stop::Error(epsilon), restart)?;
        self.contraction.diagnose(&mut diagnostics);
        let record = self.contraction.record();
        let kept = bound::last_within(record.len(), |collapses| {
            Ok(error.of(&replay(&self.initial, &record[..collapses]))? <= epsilon)
        })?;
        diagnostics.count("taken_back_for_the_bound", record.len() - kept);
        let mesh = replay(&self.initial, &record[..kept]);
        mesh.check()?;
        Ok(Simplified { mesh, asked, native_level: Some(epsilon), work, diagnostics })
    }

    fn contract(&mut self, stop: Stop, restart: bool) -> Result<Work, SimplifyError> {
        let mut work = if self.asked { Work::Continued } else { Work::Anew };
        if restart {
            self.contraction = Contraction::new(&self.initial, &self.contacts, self.params);
            work = Work::Anew;
        }
        self.asked = true;
        self.contraction.run_to(stop, &self.run)?;
        Ok(work)
    }
}
