//! The simplices of one dimension, of all stages.

use super::super::pool::{List, Pool};
use super::{HierarchyError, NEVER, Step};

/// So many simplices have 32-bit ids, and so have the places where they wait, blocks that are not
/// full included.
const MOST: u32 = 1 << 29;

/// All simplices with `K` vertices that exist at some stage, each with the stages at which it does.
///
/// A simplex dies when the first of its vertices is removed, and is then replaced by its image: by
/// one that was there already, by a new one, or, where the kept vertex was its own, by one of lower
/// dimension. A vertex never comes back, so each simplex lives through one interval of stages.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Layer<const K: usize> {
    /// The initial simplices, then all others in the order of their births. A simplex that arises
    /// while it exists already is listed again, as one that never lives.
    simplices: Vec<[u32; K]>,
    /// First stage at which each is gone; [`NEVER`], or 0 for one that never lives.
    death: Vec<u32>,
    /// Of the simplices, the first `born[t]` were born up to stage `t`.
    born: Vec<u32>,
    /// Those that ever live, in the order of their deaths, the survivors last.
    by_death: Vec<u32>,
    /// Of `by_death`, the first `died[t]` are gone at stage `t`.
    died: Vec<u32>,
    /// Number of simplices at each stage.
    count: Vec<u32>,
}

/// What became of the simplices that a step moved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Moved {
    /// Those that became equal to another one.
    pub(super) merged: u32,
    /// Those that held both ends.
    pub(super) vanished: u32,
}

impl<const K: usize> Layer<K>
where
    [u32; K]: Default,
{
    /// The layer of a complex under `steps`, and what each step did to it. `removed_at` holds for
    /// each vertex the first stage without it. Cost: the simplices at the removed vertices, sorted
    /// at each.
    pub(super) fn new(
        initial: &[[u32; K]],
        steps: &[Step],
        removed_at: &[u32],
    ) -> Result<(Self, Vec<Moved>), HierarchyError> {
        let mut builder = Builder::new(initial, steps.len(), removed_at)?;
        for (stage, &step) in (1..).zip(steps) {
            builder.take(stage, step)?;
        }
        Ok(builder.finish(initial.len()))
    }
}

impl<const K: usize> Layer<K> {
    /// Number of simplices at a stage.
    pub(super) fn count(&self, stage: usize) -> usize {
        self.count[stage] as usize
    }

    /// Calls `visit` with every simplex of a stage, in the order of birth or of death. Cost: the
    /// simplices born up to the stage, or those that die after it, whichever are fewer.
    pub(super) fn for_each(&self, stage: usize, mut visit: impl FnMut([u32; K])) {
        let (born, died) = (self.born[stage] as usize, self.died[stage] as usize);
        if born <= self.by_death.len() - died {
            let lives = |&(_, &death): &(_, &u32)| death as usize > stage;
            self.simplices[..born].iter().zip(&self.death).filter(lives).for_each(|(&s, _)| visit(s));
        } else {
            let ids = self.by_death[died..].iter().map(|&id| id as usize);
            ids.filter(|&id| id < born).for_each(|id| visit(self.simplices[id]));
        }
    }

    /// Calls `visit` with every simplex of stage `fine` that is not one of the later stage
    /// `coarse`. Cost: the deaths between them, or the births up to `fine`, whichever are fewer.
    pub(super) fn for_each_dying(
        &self,
        fine: usize,
        coarse: usize,
        mut visit: impl FnMut([u32; K]),
    ) {
        let born = self.born[fine] as usize;
        let dying = self.died[fine] as usize..self.died[coarse] as usize;
        if born <= dying.len() {
            let between = (fine + 1) as u32..=coarse as u32;
            let dies = |&(_, death): &(_, &u32)| between.contains(death);
            self.simplices[..born].iter().zip(&self.death).filter(dies).for_each(|(&s, _)| visit(s));
        } else {
            let ids = self.by_death[dying].iter().map(|&id| id as usize);
            ids.filter(|&id| id < born).for_each(|id| visit(self.simplices[id]));
        }
    }

    /// Calls `visit` with every simplex of stage `coarse` that is not one of the earlier stage
    /// `fine`. Cost: the births between them, or the deaths after `coarse`, whichever are fewer.
    pub(super) fn for_each_arising(
        &self,
        fine: usize,
        coarse: usize,
        mut visit: impl FnMut([u32; K]),
    ) {
        let arising = self.born[fine] as usize..self.born[coarse] as usize;
        let later = &self.by_death[self.died[coarse] as usize..];
        if arising.len() <= later.len() {
            let (simplices, deaths) = (&self.simplices[arising.clone()], &self.death[arising]);
            let lives = |&(_, &death): &(_, &u32)| death as usize > coarse;
            simplices.iter().zip(deaths).filter(lives).for_each(|(&s, _)| visit(s));
        } else {
            let ids = later.iter().map(|&id| id as usize).filter(|id| arising.contains(id));
            ids.for_each(|id| visit(self.simplices[id]));
        }
    }
}

/// A layer while it is made: each simplex waits at that of its vertices that is removed first.
struct Builder<'a, const K: usize> {
    layer: Layer<K>,
    /// Stage of birth of each simplex.
    birth: Vec<u32>,
    removed_at: &'a [u32],
    /// The other vertices of each waiting simplex, ascending, then its id.
    waiting: Pool<[u32; K]>,
    lists: Vec<List>,
    moved: Vec<Moved>,
    /// What waits at the vertex that is being removed; kept to save allocations.
    here: Vec<[u32; K]>,
}

impl<'a, const K: usize> Builder<'a, K>
where
    [u32; K]: Default,
{
    fn new(
        initial: &[[u32; K]],
        steps: usize,
        removed_at: &'a [u32],
    ) -> Result<Self, HierarchyError> {
        let mut capacities = vec![0; removed_at.len()];
        for simplex in initial {
            capacities[simplex[first_removed(simplex, removed_at)] as usize] += 1;
        }
        let (waiting, lists) = Pool::with_capacities(&capacities);
        // Where each step moves half of a star, as it does in a sheet, twice as many are born.
        let expected = 3 * initial.len();
        let mut builder = Self {
            layer: Layer {
                simplices: Vec::with_capacity(expected),
                death: Vec::with_capacity(expected),
                born: Vec::with_capacity(steps + 1),
                by_death: Vec::with_capacity(expected),
                died: Vec::with_capacity(steps + 1),
                count: Vec::with_capacity(steps + 1),
            },
            birth: Vec::with_capacity(expected),
            removed_at,
            waiting,
            lists,
            moved: vec![Moved::default(); steps],
            here: Vec::new(),
        };
        for &simplex in initial {
            builder.add(simplex, 0)?;
        }
        builder.end_stage();
        Ok(builder)
    }

    fn add(&mut self, simplex: [u32; K], stage: u32) -> Result<(), HierarchyError> {
        let id = self.layer.simplices.len() as u32;
        if id == MOST {
            return Err(HierarchyError::TooManySimplices);
        }
        let first = first_removed(&simplex, self.removed_at);
        let owner = simplex[first] as usize;
        self.layer.simplices.push(simplex);
        self.layer.death.push(self.removed_at[owner]);
        self.birth.push(stage);
        let mut entry = simplex;
        entry.copy_within(first + 1.., first);
        entry[K - 1] = id;
        self.waiting.push(&mut self.lists[owner], entry);
        Ok(())
    }

    /// One step: the simplices at the removed vertex die, their images are born.
    fn take(&mut self, stage: u32, step: Step) -> Result<(), HierarchyError> {
        self.open(step.removed);
        let mut vanished = 0;
        for index in 0..self.here.len() {
            let entry = self.here[index];
            if !self.dies_here(index) {
                continue;
            }
            let mut image = entry;
            if entry[..K - 1].contains(&step.kept) {
                vanished += 1;
                continue;
            }
            image[K - 1] = step.kept;
            image.sort_unstable();
            self.add(image, stage)?;
        }
        self.moved[stage as usize - 1].vanished = vanished;
        self.end_stage();
        Ok(())
    }

    /// Takes what waits at a vertex, equal simplices side by side, the earliest born first.
    fn open(&mut self, vertex: u32) {
        let list = &mut self.lists[vertex as usize];
        self.here.clear();
        self.here.extend_from_slice(self.waiting.get(*list));
        self.waiting.release(list);
        self.here.sort_unstable();
    }

    /// Lists a simplex that was opened as the next to die, or as merged when it came second.
    fn dies_here(&mut self, index: usize) -> bool {
        let id = self.here[index][K - 1];
        if index > 0 && self.here[index - 1][..K - 1] == self.here[index][..K - 1] {
            self.layer.death[id as usize] = 0;
            // Initial simplices are distinct, so this one was born by a step.
            self.moved[self.birth[id as usize] as usize - 1].merged += 1;
            return false;
        }
        self.layer.by_death.push(id);
        true
    }

    fn end_stage(&mut self) {
        self.layer.born.push(self.layer.simplices.len() as u32);
        self.layer.died.push(self.layer.by_death.len() as u32);
    }

    fn finish(mut self, initial: usize) -> (Layer<K>, Vec<Moved>) {
        for vertex in 0..self.removed_at.len() {
            if self.removed_at[vertex] == NEVER {
                self.open(vertex as u32);
                for index in 0..self.here.len() {
                    self.dies_here(index);
                }
            }
        }
        let mut count = initial as u32;
        self.layer.count.push(count);
        for moved in &self.moved {
            count -= moved.merged + moved.vanished;
            self.layer.count.push(count);
        }
        (self.layer, self.moved)
    }
}

/// Position of the vertex that is removed first; the first one where none is.
#[inline]
fn first_removed<const K: usize>(simplex: &[u32; K], removed_at: &[u32]) -> usize {
    let mut first = 0;
    for position in 1..K {
        if removed_at[simplex[position] as usize] < removed_at[simplex[first] as usize] {
            first = position;
        }
    }
    first
}
