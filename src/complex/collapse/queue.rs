//! The order in which edges are collapsed.

use std::cmp::Ordering;

use super::CollapseComplex;
use crate::range_queue::RangeQueue;

/// An edge with its cost at the time the candidate was made.
///
/// In the order in which candidates come out of a queue: smaller cost, then smaller second key, then smaller ids.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    cost: f64,
    tie: f64,
    ends: [u32; 2],
    stamp: u32,
}

impl Candidate {
    /// The edge `{a, b}` of `complex` with a cost, and a second key for equal costs. Further ties
    /// are broken by the smaller, then by the larger id. Not-a-number counts as infinite.
    ///
    /// # Panics
    /// If an end is gone.
    #[inline]
    pub fn new(complex: &CollapseComplex, [a, b]: [u32; 2], cost: f64, tie: f64) -> Self {
        let stamp = complex.stamp(a, b).expect("both ends are left");
        let [cost, tie] = [cost, tie].map(|key| if key.is_nan() { f64::INFINITY } else { key });
        Self { cost, tie, ends: [a.min(b), a.max(b)], stamp }
    }

    /// The cost.
    pub fn cost(&self) -> f64 {
        self.cost
    }

    /// The ends, ascending.
    pub fn ends(&self) -> [u32; 2] {
        self.ends
    }

    /// Whether neither end was part of a collapse since the candidate was made.
    #[inline]
    pub fn is_current(&self, complex: &CollapseComplex) -> bool {
        complex.stamp(self.ends[0], self.ends[1]) == Some(self.stamp)
    }
}

impl Ord for Candidate {
    #[inline]
    fn cmp(&self, other: &Self) -> Ordering {
        let keys = self.cost.total_cmp(&other.cost).then(self.tie.total_cmp(&other.tie));
        keys.then(self.ends.cmp(&other.ends)).then(self.stamp.cmp(&other.stamp))
    }
}

impl PartialOrd for Candidate {
    #[inline]
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }

    #[inline]
    fn lt(&self, other: &Self) -> bool {
        // Costs almost always differ: one comparison then decides in the inner loop of the heap.
        if self.cost != other.cost { self.cost < other.cost } else { self.cmp(other).is_lt() }
    }

    #[inline]
    fn ge(&self, other: &Self) -> bool {
        !self.lt(other)
    }
}

impl Eq for Candidate {}

/// A priority queue of candidates: smallest cost first, then the second key, then the ids.
/// Equal contents come out in the same order for any history.
#[derive(Clone, Debug, Default)]
pub struct CollapseQueue {
    waiting: RangeQueue<Candidate>,
    /// Rejected candidates, in the order in which they were set aside; `None` once woken.
    parked: Vec<Option<Candidate>>,
    /// For each vertex the parked candidates that it is an obstacle of; grown on demand.
    parked_at: Vec<Vec<u32>>,
}

impl CollapseQueue {
    /// A queue of the given candidates. Cost `O(n)`.
    pub fn from_candidates(candidates: Vec<Candidate>) -> Self {
        Self { waiting: RangeQueue::new(candidates), ..Self::default() }
    }

    /// Adds a candidate.
    #[inline]
    pub fn push(&mut self, candidate: Candidate) {
        self.waiting.push(candidate);
    }

    /// Takes the first candidate that is still current.
    pub fn pop(&mut self, complex: &CollapseComplex) -> Option<Candidate> {
        self.waiting.pop(|candidate| candidate.is_current(complex).then_some(candidate))
    }

    /// The first candidate that is still current, without taking it: the one that the next
    /// [`CollapseQueue::pop`] will return.
    pub fn peek(&mut self, complex: &CollapseComplex) -> Option<Candidate> {
        let first = self.pop(complex)?;
        self.push(first);
        Some(first)
    }

    /// Sets a rejected candidate aside until [`CollapseQueue::wake`] is called for one of
    /// `obstacles`: while none of these vertices changes, it would be rejected again.
    pub fn park(&mut self, candidate: Candidate, obstacles: &[u32]) {
        let id = self.parked.len() as u32;
        self.parked.push(Some(candidate));
        for &v in obstacles {
            if self.parked_at.len() <= v as usize {
                self.parked_at.resize(v as usize + 1, Vec::new());
            }
            self.parked_at[v as usize].push(id);
        }
    }

    /// Queues the candidates parked at `v` that are still current. Call it for both ends of every
    /// collapsed edge.
    #[inline]
    pub fn wake(&mut self, complex: &CollapseComplex, v: u32) {
        let Some(here) = self.parked_at.get_mut(v as usize) else { return };
        for id in std::mem::take(here) {
            // Another obstacle may have woken it.
            let candidate = self.parked[id as usize].take();
            if let Some(candidate) = candidate.filter(|candidate| candidate.is_current(complex)) {
                self.waiting.push(candidate);
            }
        }
    }
}

// Many short lists in one allocation: the adjacency of a complex without an allocation per vertex.
//
// Capacities are powers of two. A list that outgrows its block moves to a block of the next class,
// from the free list if there is one. So the memory of removed vertices is reused and the pool stays
// bounded.

/// Capacity of the smallest block.
const SMALLEST: usize = 4;

/// The place of a list in its [`Pool`].
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct List {
    start: u32,
    len: u32,
    /// The block holds `SMALLEST << class` items.
    class: u32,
}

impl List {
    pub(super) fn len(self) -> usize {
        self.len as usize
    }
}

/// The storage of many lists of `T`.
#[derive(Clone, Debug)]
pub(super) struct Pool<T> {
    items: Vec<T>,
    /// Starts of the unused blocks of each class.
    free: Vec<Vec<u32>>,
}

fn class_for(capacity: usize) -> u32 {
    capacity.div_ceil(SMALLEST).next_power_of_two().trailing_zeros()
}

impl<T: Copy + Default> Pool<T> {
    /// A pool with one empty list for each entry of `capacities`.
    ///
    /// # Panics
    /// If the capacities add up to more than `u32::MAX` items.
    pub(super) fn with_capacities(capacities: &[u32]) -> (Self, Vec<List>) {
        let mut total = 0_usize;
        let lists = capacities
            .iter()
            .map(|&capacity| {
                let class = class_for(capacity as usize);
                let start = u32::try_from(total).expect("more than 2^32 incidences");
                total += SMALLEST << class;
                List { start, len: 0, class }
            })
            .collect();
        (Self { items: vec![T::default(); total], free: Vec::new() }, lists)
    }

    #[inline]
    pub(super) fn get(&self, list: List) -> &[T] {
        &self.items[list.start as usize..][..list.len as usize]
    }

    #[inline]
    pub(super) fn get_mut(&mut self, list: List) -> &mut [T] {
        &mut self.items[list.start as usize..][..list.len as usize]
    }

    /// The item at `index` of a list, by value, so that no borrow outlives the call.
    #[inline]
    pub(super) fn at(&self, list: List, index: usize) -> T {
        self.get(list)[index]
    }

    #[inline]
    pub(super) fn push(&mut self, list: &mut List, item: T) {
        if list.len as usize == SMALLEST << list.class {
            self.grow(list);
        }
        self.items[(list.start + list.len) as usize] = item;
        list.len += 1;
    }

    /// Removes the item at `index`; the last one takes its place.
    #[inline]
    pub(super) fn swap_remove(&mut self, list: &mut List, index: usize) {
        let items = self.get_mut(*list);
        items[index] = items[items.len() - 1];
        list.len -= 1;
    }

    /// Gives the block back; the list is empty and must not be used again.
    pub(super) fn release(&mut self, list: &mut List) {
        self.give(list.class, list.start);
        list.len = 0;
    }

    fn grow(&mut self, list: &mut List) {
        let (old, len) = (list.start as usize, list.len as usize);
        // Doubling keeps the copies linear in the pushes. Take before give: the blocks must differ.
        let class = list.class + 1;
        let start = self.take(class);
        self.items.copy_within(old..old + len, start as usize);
        self.give(list.class, list.start);
        (list.start, list.class) = (start, class);
    }

    fn take(&mut self, class: u32) -> u32 {
        if let Some(start) = self.free.get_mut(class as usize).and_then(Vec::pop) {
            return start;
        }
        let start = self.items.len();
        let end = start + (SMALLEST << class);
        assert!(u32::try_from(end).is_ok(), "more than 2^32 incidences");
        self.items.resize(end, T::default());
        start as u32
    }

    fn give(&mut self, class: u32, start: u32) {
        if self.free.len() <= class as usize {
            self.free.resize(class as usize + 1, Vec::new());
        }
        self.free[class as usize].push(start);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_grow_past_their_blocks_and_blocks_are_used_again() {
        let (mut pool, mut lists) = Pool::<u32>::with_capacities(&[1, 4, 5]);
        assert_eq!(pool.items.len(), 4 + 4 + 8);
        for round in 0..40 {
            for (index, list) in lists.iter_mut().enumerate() {
                pool.push(list, 1000 * index as u32 + round);
            }
        }
        for (index, &list) in lists.iter().enumerate() {
            let expected: Vec<u32> = (0..40).map(|round| 1000 * index as u32 + round).collect();
            assert_eq!(pool.get(list), expected);
        }
        let before = pool.items.len();
        let mut gone = lists[0];
        pool.release(&mut gone);
        let (_, mut fresh) = Pool::<u32>::with_capacities(&[0]);
        // A list of the pool that grows from 32 to 64 takes the block that was given back.
        fresh[0] = List { start: pool.take(3), len: 0, class: 3 };
        for item in 0..33 {
            pool.push(&mut fresh[0], item);
        }
        assert_eq!(pool.get(fresh[0]).len(), 33);
        assert_eq!(pool.items.len(), before);
    }

    #[test]
    fn swap_remove_moves_the_last_item() {
        let (mut pool, mut lists) = Pool::<u32>::with_capacities(&[3]);
        for item in 0..3 {
            pool.push(&mut lists[0], item);
        }
        pool.swap_remove(&mut lists[0], 0);
        assert_eq!(pool.get(lists[0]), [2, 1]);
        pool.swap_remove(&mut lists[0], 1);
        assert_eq!(pool.get(lists[0]), [2]);
    }
}
