//! All levels of detail of a medial mesh at once.
//!
//! A sequence of collapses that do not move the kept spheres gives a hierarchy of meshes on subsets
//! of the initial spheres (Hoppe 1996, *Progressive meshes*; Faraj, Thiery, Boubekeur 2013,
//! <https://doi.org/10.1145/2542355.2542359>, section 2). *Stage* `t` is the mesh after the first
//! `t` collapses; stage 0 is the initial mesh.
//!
//! # Representation
//!
//! A removed vertex never comes back, and two vertices of an edge share it until one of them is
//! removed. So every sphere, edge and face, initial or made by a collapse, exists in one interval
//! of stages. A [`Hierarchy`] stores each of them once, in the order of their births, and their ids
//! in the order of their deaths. The simplices of stage `t` are those born up to `t` that die later:
//! a scan of the births up to `t` or of the deaths after `t`, whichever are fewer, finds them. In a
//! mesh of bounded degree this takes time in proportion to the simplices of stage `t`.
//!
//! A [`Stage`] is a view and costs nothing. Nothing is replayed to reach it and there is no current
//! stage, so a stage is the same, bit for bit, whatever was asked for before.

use std::sync::Arc;

pub use stage::Stage;

use crate::complex::MedialMesh;

mod stage;
#[cfg(test)]
mod tests;

/// One collapse of an edge into one of its ends, in the ids of the initial mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// The sphere that is removed.
    pub removed: u32,
    /// The sphere that stays, as it is, and takes over the edges and faces of the other.
    pub kept: u32,
    /// The cost at which the edge was taken, in the unit of the method; may be infinite.
    pub cost: f64,
}

/// A medial mesh and a sequence of collapses into one end, with direct access to every stage.
///
/// ```
/// use std::sync::Arc;
///
/// use medial::Vec3;
/// use medial::complex::collapse::{Hierarchy, Step};
/// use medial::complex::{MedialMesh, Sphere};
///
/// let spheres = (0..3).map(|i| Sphere::new(Vec3::new(f64::from(i), 0.0, 0.0), 0.1)).collect();
/// let path = MedialMesh::from_simplices(spheres, vec![[0, 1], [1, 2]], vec![])?;
/// let step = Step { removed: 1, kept: 0, cost: 1.0 };
/// let hierarchy = Hierarchy::new(Arc::new(path), vec![step])?;
/// // Rank 0 is sphere 1, which is removed first.
/// assert_eq!(hierarchy.by_rank(), [1, 0, 2]);
/// assert_eq!(hierarchy.stage(1).edges().collect::<Vec<_>>(), [[1, 2]]);
/// assert_eq!(hierarchy.stage(1).to_mesh().edges, [[0, 1]]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Hierarchy {
    initial: Arc<MedialMesh>,
    steps: Vec<Step>,
    /// For each vertex the number of vertices removed before it; those never removed come last.
    ranks: Vec<u32>,
    /// The vertices by rank.
    by_rank: Vec<u32>,
    edges: Layer<2>,
    faces: Layer<3>,
    /// Steps that violate the link condition, ascending.
    against_link: Vec<u32>,
}

/// Why a sequence of steps is not a hierarchy.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum HierarchyError {
    /// A step names a sphere that the initial mesh does not have, or that is gone.
    #[error("step {step}: sphere {vertex} does not exist, or not any more")]
    Vertex {
        /// Index of the step.
        step: usize,
        /// The sphere.
        vertex: u32,
    },
    /// A step names two spheres without an edge between them at that stage.
    #[error("step {step}: there is no edge between the spheres {removed} and {kept}")]
    Edge {
        /// Index of the step.
        step: usize,
        /// The sphere to be removed.
        removed: u32,
        /// The sphere to be kept.
        kept: u32,
    },
    /// A cost is not a number.
    #[error("step {step}: the cost is not a number")]
    Cost {
        /// Index of the step.
        step: usize,
    },
    /// More edges or faces arise than can be numbered.
    #[error("more than 2^30 edges or faces arise: spheres with very large stars are collapsed")]
    TooManySimplices,
}

impl Hierarchy {
    /// The hierarchy of a mesh in canonical form under `steps`, first to last. Cost
    /// `O(n + s log d)` for `n` simplices, `s` at the removed spheres when they are removed, and
    /// degrees up to `d`; two threads are used where there are.
    ///
    /// # Errors
    /// When a step is not the collapse of an edge of its stage.
    pub fn new(initial: Arc<MedialMesh>, steps: Vec<Step>) -> Result<Self, HierarchyError> {
        debug_assert_eq!(initial.check(), Ok(()));
        let (ranks, by_rank) = rank_by_removal(initial.spheres.len(), &steps)?;
        let kept: Vec<u32> = steps.iter().map(|step| ranks[step.kept as usize]).collect();
        let (edges, faces) = rayon::join(
            || Layer::new(&initial.edges, &ranks, &kept),
            || Layer::new(&initial.faces, &ranks, &kept),
        );
        let ((edges, moved_edges), (faces, moved_faces)) = (edges?, faces?);
        // The collapsed edge is the one edge with both ends; without it the step names no edge.
        if let Some(step) = moved_edges.iter().position(|moved| moved.vanished != 1) {
            let Step { removed, kept, .. } = steps[step];
            return Err(HierarchyError::Edge { step, removed, kept });
        }
        // The link condition in counts. T1: each common neighbour (two edges that merge) has a face
        // with the edge (which vanishes). T2: no two faces merge.
        let against_link = (0..)
            .zip(moved_edges.iter().zip(&moved_faces))
            .filter(|(_, (edges, faces))| edges.merged != faces.vanished || faces.merged > 0)
            .map(|(step, _)| step)
            .collect();
        Ok(Self { initial, steps, ranks, by_rank, edges, faces, against_link })
    }

    /// The mesh of stage 0.
    pub fn initial(&self) -> &Arc<MedialMesh> {
        &self.initial
    }

    /// The collapses, first to last: step `t` leads from stage `t` to stage `t + 1`.
    pub fn steps(&self) -> &[Step] {
        &self.steps
    }

    /// The index of each sphere in the initial mesh, by its *rank*: the number of spheres that are
    /// removed before it. Those that are never removed come last, by index. The spheres of stage
    /// `t` are those of rank `t` and more: in a list of spheres by rank every stage is a suffix.
    pub fn by_rank(&self) -> &[u32] {
        &self.by_rank
    }

    /// The stage with the fewest spheres: the number of steps.
    pub fn last_stage(&self) -> usize {
        self.steps.len()
    }

    /// The mesh after the first `stage` collapses, as a view. Cost `O(1)`.
    ///
    /// # Panics
    /// If there are fewer collapses.
    pub fn stage(&self, stage: usize) -> Stage<'_> {
        Stage::new(self, stage)
    }

    /// How many of the first `stage` collapses violate the link condition of Dey, Edelsbrunner,
    /// Guha and Nekhayev (1999), and so may have closed a loop, or made a void.
    pub fn violations_until(&self, stage: usize) -> usize {
        self.against_link.partition_point(|&step| (step as usize) < stage)
    }
}

/// The vertices in the order of their removal, those that are left last, and the place of each.
fn rank_by_removal(
    vertices: usize,
    steps: &[Step],
) -> Result<(Vec<u32>, Vec<u32>), HierarchyError> {
    const LEFT: u32 = u32::MAX;
    let mut ranks = vec![LEFT; vertices];
    let mut by_rank = Vec::with_capacity(vertices);
    for (step, &Step { removed, kept, cost }) in steps.iter().enumerate() {
        for vertex in [removed, kept] {
            if ranks.get(vertex as usize) != Some(&LEFT) {
                return Err(HierarchyError::Vertex { step, vertex });
            }
        }
        if removed == kept {
            return Err(HierarchyError::Edge { step, removed, kept });
        }
        if cost.is_nan() {
            return Err(HierarchyError::Cost { step });
        }
        ranks[removed as usize] = step as u32;
        by_rank.push(removed);
    }
    for vertex in 0..vertices {
        if ranks[vertex] == LEFT {
            ranks[vertex] = by_rank.len() as u32;
            by_rank.push(vertex as u32);
        }
    }
    Ok((ranks, by_rank))
}

// The simplices of one dimension, of all stages.

/// The most simplices of one dimension. Ids have 32 bits; the bound is lower because each simplex
/// takes some 20 bytes.
const MAX_SIMPLICES: usize = 1 << 30;

/// Absent id.
const NONE: u32 = u32::MAX;

/// The placeholder of a simplex that never lives. No stage selects it: stage 0 takes initial
/// simplices only, the others only ranks from 1 on.
fn nothing<const K: usize>() -> [u32; K] {
    [0; K]
}

/// All simplices with `K` vertices that exist at some stage.
///
/// A vertex is named by its *rank*, the number of vertices that are removed before it. So a simplex
/// with ascending ranks begins with the vertex that is removed first, and lives up to the stage of
/// that number. Then its image replaces it: a simplex that exists already, a new one, or, if the
/// kept vertex belongs to it, one of lower dimension. A vertex never comes back, so each simplex
/// lives through one interval of stages.
#[derive(Clone, Debug, PartialEq)]
struct Layer<const K: usize> {
    /// The initial simplices in the order of their deaths, then all others in the order of their
    /// births. A copy that arises while the same simplex lives is replaced by [`nothing`].
    simplices: Vec<[u32; K]>,
    /// The first `born[t]` of `simplices` were born up to stage `t`.
    born: Vec<u32>,
    /// The ids of those that ever live, in the order of their deaths, the survivors last.
    by_death: Vec<u32>,
    /// The first `died[t]` of `by_death` are gone at stage `t`.
    died: Vec<u32>,
    /// Number of simplices at each stage.
    count: Vec<u32>,
}

/// Counts of the simplices that a step removed without a new one in their place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Moved {
    /// Those that became equal to another simplex.
    merged: u32,
    /// Those with both ends of the collapsed edge.
    vanished: u32,
}

impl<const K: usize> Layer<K> {
    /// The layer of a complex whose vertices of ranks 0, 1, ... are collapsed into the vertices of
    /// ranks `kept`, and the counts of each step. `ranks` holds the ranks of all vertices.
    /// Cost: the simplices at the removed vertices when they are removed, sorted at each.
    fn new(
        initial: &[[u32; K]],
        ranks: &[u32],
        kept: &[u32],
    ) -> Result<(Self, Vec<Moved>), HierarchyError> {
        let mut builder = Builder::new(initial, ranks, kept.len())?;
        for (removed, &kept) in (0..).zip(kept) {
            builder.take(removed, kept)?;
        }
        Ok(builder.finish())
    }

    /// Number of simplices at a stage.
    fn count(&self, stage: usize) -> usize {
        self.count[stage] as usize
    }

    fn end_stage(&mut self) {
        self.born.push(self.simplices.len() as u32);
        self.died.push(self.by_death.len() as u32);
    }

    /// The simplices of a stage: initial ones, then others. Cost: those, and the births up to the
    /// stage or the deaths after it, whichever are fewer.
    fn at(&self, stage: usize) -> impl Iterator<Item = [u32; K]> + '_ {
        // Initial simplices lie in the order of their deaths: those that live are a suffix.
        let (initial, later) =
            self.simplices[..self.born[stage] as usize].split_at(self.born[0] as usize);
        let living = initial.partition_point(|s| (s[0] as usize) < stage);
        // Births and remaining deaths both hold all the others; scan the shorter list.
        let deaths = &self.by_death[self.died[stage] as usize..];
        let by_birth = later.len() <= deaths.len();
        let (births, deaths) = if by_birth { (later, &[][..]) } else { (&[][..], deaths) };
        let births = births.iter().filter(move |s| s[0] as usize >= stage);
        // Ids before those of `later` are initial, ids behind them are not born yet.
        let first = initial.len();
        let ids = deaths.iter().filter_map(move |&id| later.get((id as usize).checked_sub(first)?));
        initial[living..].iter().chain(births).chain(ids).copied()
    }
}

/// A layer under construction: each simplex waits at its first vertex, the next of its vertices to
/// be removed.
struct Builder<const K: usize> {
    layer: Layer<K>,
    /// Initial simplices `start[r]..start[r + 1]` wait at rank `r`.
    start: Vec<u32>,
    /// For each rank the simplex born last of those that wait there: the head of a linked list.
    last: Vec<u32>,
    /// For each simplex made by a step: the one before it in its list, and the step.
    previous: Vec<(u32, u32)>,
    moved: Vec<Moved>,
    /// The simplices that wait at the vertex being removed: their other vertices, then their id. A
    /// field to save allocations.
    here: Vec<[u32; K]>,
}

impl<const K: usize> Builder<K> {
    fn new(initial: &[[u32; K]], ranks: &[u32], steps: usize) -> Result<Self, HierarchyError> {
        if initial.len() > MAX_SIMPLICES {
            return Err(HierarchyError::TooManySimplices);
        }
        let ranked = |simplex: &[u32; K]| {
            let mut simplex = simplex.map(|v| ranks[v as usize]);
            simplex.sort_unstable();
            simplex
        };
        let mut start = vec![0_u32; ranks.len() + 1];
        for simplex in initial {
            start[ranked(simplex)[0] as usize + 1] += 1;
        }
        for rank in 0..ranks.len() {
            start[rank + 1] += start[rank];
        }
        // In a sheet each collapse moves about half a star, so this many are born in all.
        let mut simplices = Vec::with_capacity(initial.len() * 5 / 2);
        simplices.resize(initial.len(), nothing());
        let mut place = start.clone();
        // Counting sort by the first rank, which is the order of the deaths.
        for simplex in initial {
            let simplex = ranked(simplex);
            let place = &mut place[simplex[0] as usize];
            simplices[*place as usize] = simplex;
            *place += 1;
        }
        let mut layer = Layer {
            by_death: Vec::with_capacity(simplices.capacity()),
            simplices,
            born: Vec::with_capacity(steps + 1),
            died: Vec::with_capacity(steps + 1),
            count: Vec::with_capacity(steps + 1),
        };
        layer.end_stage();
        let (last, moved) = (vec![NONE; ranks.len()], vec![Moved::default(); steps]);
        Ok(Self { layer, start, last, previous: Vec::new(), moved, here: Vec::new() })
    }

    /// One step: the simplices at the removed vertex die, their images are born.
    fn take(&mut self, removed: u32, kept: u32) -> Result<(), HierarchyError> {
        self.open(removed);
        for index in 0..self.here.len() {
            if self.is_repeated(index) {
                continue;
            }
            let mut image = self.here[index];
            self.layer.by_death.push(image[K - 1]);
            // With both ends: it shrinks to a simplex of the layer below, which has its own record.
            if image[..K - 1].contains(&kept) {
                self.moved[removed as usize].vanished += 1;
                continue;
            }
            image[K - 1] = kept;
            image.sort_unstable();
            self.add(image, removed)?;
        }
        self.layer.end_stage();
        Ok(())
    }

    fn add(&mut self, simplex: [u32; K], step: u32) -> Result<(), HierarchyError> {
        let id = self.layer.simplices.len();
        if id >= MAX_SIMPLICES {
            return Err(HierarchyError::TooManySimplices);
        }
        self.layer.simplices.push(simplex);
        let last = &mut self.last[simplex[0] as usize];
        self.previous.push((*last, step));
        *last = id as u32;
        Ok(())
    }

    /// Lists the simplices that wait at a rank, equal ones side by side, the earliest born first.
    fn open(&mut self, rank: u32) {
        let Self { layer, start, last, previous, here, .. } = self;
        let simplices = &layer.simplices;
        let entry = |id: u32| {
            let mut entry = simplices[id as usize];
            entry.copy_within(1.., 0);
            entry[K - 1] = id;
            entry
        };
        here.clear();
        here.extend((start[rank as usize]..start[rank as usize + 1]).map(entry));
        let mut id = last[rank as usize];
        while id != NONE {
            here.push(entry(id));
            id = previous[id as usize - layer.born[0] as usize].0;
        }
        here.sort_unstable();
    }

    /// Whether an opened simplex equals the one before it. Then it merged when it was born, which is
    /// noticed only now: a search at birth would cost more.
    fn is_repeated(&mut self, index: usize) -> bool {
        let here = &self.here;
        if index == 0 || here[index - 1][..K - 1] != here[index][..K - 1] {
            return false;
        }
        // Initial simplices are distinct, so this one was made by a step.
        let id = here[index][K - 1] as usize;
        let (_, step) = self.previous[id - self.layer.born[0] as usize];
        self.moved[step as usize].merged += 1;
        self.layer.simplices[id] = nothing();
        true
    }

    fn finish(mut self) -> (Layer<K>, Vec<Moved>) {
        // The survivors, which no step opens: their copies are still to be found.
        for rank in self.moved.len()..self.last.len() {
            self.open(rank as u32);
            for index in 0..self.here.len() {
                if !self.is_repeated(index) {
                    self.layer.by_death.push(self.here[index][K - 1]);
                }
            }
        }
        let mut count = self.layer.born[0];
        self.layer.count.push(count);
        for moved in &self.moved {
            count -= moved.merged + moved.vanished;
            self.layer.count.push(count);
        }
        (self.layer, self.moved)
    }
}
