//! The common part of the per-sphere filters: rank the spheres once, then keep those above a threshold
//! or a number of the best, and return the induced subcomplex.

use std::sync::Arc;

use medial::complex::MedialMesh;
use medial::simplifier::{Diagnostics, Extras, Level, Simplification, Simplified, SimplifyError};

use crate::scale::{Scale, Wanted};
use crate::ties::{break_ties, tie};

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

    fn by_count(&self, asked: usize, diagnostics: &mut Diagnostics) -> (Vec<bool>, f64) {
        let count = asked.min(self.order.len());
        if count < asked {
            diagnostics.warn(format!(
                "asked for {asked} spheres, but the initial medial mesh has only {count}"
            ));
        }
        // The level that would cut here: the value of the first sphere that is dropped.
        let threshold = match self.order.get(count) {
            Some(&dropped) => self.value[dropped as usize],
            None => *self.scale.range.start(),
        };
        let tied = self.order[..count].iter().rev();
        let tied = tied.take_while(|&&s| tie(self.value[s as usize], threshold)).count();
        if tied > 0 && count < self.order.len() {
            diagnostics.count("kept_at_the_threshold", tied);
        }
        let mut keep = vec![false; self.order.len()];
        for &sphere in &self.order[..count] {
            keep[sphere as usize] = true;
        }
        (keep, threshold)
    }

    fn by_level(&self, level: f64) -> (Vec<bool>, f64) {
        let kept = |&value: &f64| value > level || (self.scale.inclusive && value == level);
        (self.value.iter().map(kept).collect(), level)
    }
}

impl Simplification for Ranked {
    fn at(&mut self, level: Level) -> Result<Simplified, SimplifyError> {
        let mut diagnostics = self.prepared.clone();
        let (keep, native) = match self.scale.wanted(level, &mut diagnostics)? {
            Wanted::Spheres(asked) => self.by_count(asked, &mut diagnostics),
            Wanted::Native(value) => self.by_level(value),
        };
        let mesh = self.mesh.induced(&keep);
        if mesh.spheres.is_empty() {
            let largest = self.order.first().map_or(0.0, |&s| self.value[s as usize]);
            let name = self.scale.name;
            diagnostics
                .warn(format!("no sphere passes {name} = {native}: the largest is {largest}"));
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
