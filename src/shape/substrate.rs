//! Substrates by name, their costs, and the place where they are kept.

use std::collections::HashMap;
use std::hash::Hash;
use std::sync::{Arc, Mutex, OnceLock};
use std::time::Instant;

use cpu_time::ProcessTime;
use serde::{Deserialize, Serialize};

use super::ShapeError;
use crate::heap::{Usage, usage_apart, usage_of};

/// A substrate that methods share.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Substrate {
    /// Boundary samples.
    Samples,
    /// Delaunay triangulation of the samples.
    Delaunay,
    /// Circumspheres of the cells, each classified as inside or outside.
    Inside,
    /// Voronoi facets inside.
    Facets,
    /// Voronoi medial mesh.
    MedialMesh,
    /// Poles of the samples, and the polar balls inside.
    Poles,
    /// Bounding-volume tree of the surface.
    SurfaceTree,
    /// Inside test of the surface.
    InsideTest,
    /// Contact points of a medial mesh that came without them.
    Contacts,
}

impl Substrate {
    /// Name in records.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Samples => "samples",
            Self::Delaunay => "delaunay",
            Self::Inside => "inside",
            Self::Facets => "facets",
            Self::MedialMesh => "medial_mesh",
            Self::Poles => "poles",
            Self::SurfaceTree => "surface_tree",
            Self::InsideTest => "inside_test",
            Self::Contacts => "contacts",
        }
    }
}

/// The cost of a piece of work, such as building a substrate, when it was done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// Wall-clock seconds.
    pub seconds: f64,
    /// Seconds of the whole process on all processors.
    pub cpu_seconds: f64,
    /// Bytes of the heap; 0 in a program that does not count them (see [`crate::heap`]).
    #[serde(default)]
    pub usage: Usage,
}

impl Cost {
    /// Does `work` and says what it cost.
    pub fn of<T>(work: impl FnOnce() -> T) -> (T, Self) {
        Self::clocked(|| usage_of(work))
    }

    /// As [`Cost::of`], for a substrate: what it needs while it is built counts as its own, not as
    /// that of the work that asked for it.
    fn of_substrate<T>(work: impl FnOnce() -> T) -> (T, Self) {
        Self::clocked(|| usage_apart(work))
    }

    fn clocked<T>(work: impl FnOnce() -> (T, Usage)) -> (T, Self) {
        let (wall, cpu) = (Instant::now(), ProcessTime::now());
        let (value, usage) = work();
        let (seconds, cpu_seconds) = (wall.elapsed().as_secs_f64(), cpu.elapsed().as_secs_f64());
        (value, Self { seconds, cpu_seconds, usage })
    }
}

impl std::ops::AddAssign for Cost {
    fn add_assign(&mut self, other: Self) {
        self.seconds += other.seconds;
        self.cpu_seconds += other.cpu_seconds;
        // The other work was done on top of what this one had left.
        let peak = self.usage.held_bytes + other.usage.peak_bytes;
        self.usage.peak_bytes = self.usage.peak_bytes.max(peak);
        self.usage.held_bytes += other.usage.held_bytes;
    }
}

/// The facts that a view remembers of a substrate.
#[derive(Clone, Copy)]
pub(super) struct Use {
    pub cost: Cost,
    /// Whether it was built through this view, rather than found.
    pub built_here: bool,
}

/// Values that are built once for each key, with what building them cost.
pub(super) struct Cache<K, T> {
    /// Whether what building needs of the heap is part of the work that asked for it.
    is_of_asker: bool,
    /// Looked up by key only, never iterated.
    slots: Mutex<HashMap<K, Arc<Slot<T>>>>,
}

type Slot<T> = OnceLock<(Result<T, ShapeError>, Cost)>;

impl<K, T> Default for Cache<K, T> {
    fn default() -> Self {
        Self { is_of_asker: false, slots: Mutex::default() }
    }
}

impl<K, T> Cache<K, T> {
    /// A cache of what is no substrate that methods share, but one method's own work.
    pub fn of_asker() -> Self {
        Self { is_of_asker: true, ..Self::default() }
    }
}

impl<K: Eq + Hash, T: Clone> Cache<K, T> {
    /// The value for a key; a second asker waits for the first.
    pub fn get(
        &self,
        key: K,
        build: impl FnOnce() -> Result<T, ShapeError>,
    ) -> (Result<T, ShapeError>, Use) {
        let slot =
            Arc::clone(self.slots.lock().expect("no panic while held").entry(key).or_default());
        let mut built_here = false;
        let (value, cost) = slot
            .get_or_init(|| {
                built_here = true;
                if self.is_of_asker { Cost::of(build) } else { Cost::of_substrate(build) }
            })
            .clone();
        (value, Use { cost, built_here })
    }
}
