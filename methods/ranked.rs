//! What the per-sphere filters share: rank the spheres once, then keep those above a threshold or
//! the best so many, and return the induced subcomplex.

use std::sync::Arc;

use medial::complex::MedialMesh;
use medial::simplifier::{
    Diagnostics, Extras, Level, Simplification, Simplified, SimplifyError, Work,
};

/// An initial medial mesh with a value for each sphere; larger values are kept longer.
pub(crate) struct Ranked {
    mesh: Arc<MedialMesh>,
    value: Vec<f64>,
    /// Spheres by descending value, then ascending id.
    order: Vec<u32>,
    scale: Scale,
    /// Counts and warnings of the preparation, repeated with every level.
    prepared: Diagnostics,
}

/// How the values are compared with a native level.
pub(crate) struct Scale {
    /// Name of the level for messages.
    pub name: &'static str,
    /// Range of meaningful levels, in native units.
    pub range: std::ops::RangeInclusive<f64>,
    /// `true` keeps values at the level (`>=`), `false` only those above it (`>`).
    pub inclusive: bool,
    /// Why there is no published level.
    pub no_published: &'static str,
}

impl Scale {
    /// Refuses a level that means nothing.
    pub(crate) fn check(&self, level: f64) -> Result<(), SimplifyError> {
        let Self { name, range, .. } = self;
        if range.contains(&level) {
            return Ok(());
        }
        let (least, most) = (range.start(), range.end());
        let message = match *most {
            f64::MAX => format!("{name} = {level:?} is below {least}, or no number"),
            _ => format!("{name} = {level:?} is outside {least} to {most}"),
        };
        Err(SimplifyError::Level(message))
    }
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
        Self { mesh, value, order, scale, prepared }
    }

    fn by_count(&self, asked: usize) -> (usize, f64, Diagnostics) {
        let mut diagnostics = self.prepared.clone();
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
        let tied = tied.take_while(|&&s| self.value[s as usize] == threshold).count();
        if tied > 0 && count < self.order.len() {
            diagnostics.count("kept_at_the_threshold_by_id", tied);
        }
        (count, threshold, diagnostics)
    }

    fn by_level(&self, level: f64) -> Result<(usize, f64, Diagnostics), SimplifyError> {
        self.scale.check(level)?;
        let kept = |&s: &u32| {
            let value = self.value[s as usize];
            value > level || (self.scale.inclusive && value == level)
        };
        Ok((self.order.partition_point(kept), level, self.prepared.clone()))
    }
}

impl Simplification for Ranked {
    fn at(&mut self, level: Level) -> Result<Simplified, SimplifyError> {
        let (count, native, mut diagnostics) = match level {
            Level::MaxError(_) => return Err(SimplifyError::searched()),
            Level::Spheres(0) => {
                return Err(SimplifyError::Level("ask for at least one sphere".into()));
            }
            Level::Spheres(asked) => self.by_count(asked),
            Level::Native(value) => self.by_level(value)?,
            Level::Published => {
                return Err(SimplifyError::Unsupported { why: self.scale.no_published.into() });
            }
        };
        let mut keep = vec![false; self.order.len()];
        for &sphere in &self.order[..count] {
            keep[sphere as usize] = true;
        }
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
            work: Work::Anew,
            diagnostics,
            extras: Extras::default(),
        })
    }
}
