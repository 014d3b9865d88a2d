//! The order in which edges are collapsed.

use std::cmp::Ordering;

use super::CollapseComplex;

/// An edge with its cost at the time the candidate was made.
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
        // `is_before` compares with `<`, which is a total order only without not-a-number.
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

    /// Whether this candidate comes out of a queue before another; see [`Candidate::order`].
    #[inline]
    pub fn is_before(&self, other: &Self) -> bool {
        // Costs almost always differ: one comparison then decides in the inner loop of the heap.
        if self.cost != other.cost {
            return self.cost < other.cost;
        }
        self.order(other) == Ordering::Less
    }

    /// The order in which candidates come out of a queue: smaller cost, then smaller second key,
    /// then smaller ids.
    pub fn order(&self, other: &Self) -> Ordering {
        let keys = self.cost.total_cmp(&other.cost).then(self.tie.total_cmp(&other.tie));
        keys.then(self.ends.cmp(&other.ends))
    }
}

/// A priority queue of candidates: smallest cost first, then the second key, then the ids.
/// Equal contents come out in the same order for any history.
#[derive(Clone, Debug, Default)]
pub struct CollapseQueue {
    heap: LazyHeap,
    /// Rejected candidates, in the order in which they were set aside; `None` once woken.
    parked: Vec<Option<Candidate>>,
    /// For each vertex the parked candidates that it is an obstacle of; grown on demand.
    parked_at: Vec<Vec<u32>>,
}

impl CollapseQueue {
    /// A queue of the given candidates. Cost `O(n)`.
    pub fn from_candidates(candidates: Vec<Candidate>) -> Self {
        Self { heap: LazyHeap::from_items(candidates), ..Self::default() }
    }

    /// Adds a candidate.
    #[inline]
    pub fn push(&mut self, candidate: Candidate) {
        self.heap.push(candidate);
    }

    /// Takes the first candidate that is still current.
    pub fn pop(&mut self, complex: &CollapseComplex) -> Option<Candidate> {
        self.heap.pop(|candidate| candidate.is_current(complex))
    }

    /// The first candidate that is still current, without taking it: the one that the next
    /// [`CollapseQueue::pop`] will return.
    pub fn peek(&mut self, complex: &CollapseComplex) -> Option<Candidate> {
        let first = self.pop(complex)?;
        // It is before every pivot, so it goes back into the heap and not into a group.
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
                self.heap.push(candidate);
            }
        }
    }
}

/// The heap is refilled with at most this many items at a time, few enough for the cache.
const HEAP_SIZE: usize = 1 << 12;

/// While a group is too large for the heap, a refill keeps its first `1 / SHARE` and splits off the
/// rest.
const SHARE: usize = 8;

/// A priority queue that sorts late and forgets early.
///
/// Only the first items are in a heap. The others wait in groups: the groups are ordered, the items
/// of one group are not. When the heap is empty, the next group replaces it: its outdated items are
/// dropped, and its later items are split off into new groups, as quicksort would. So most items are
/// never sorted at all. Items that compare as equal must be identical: then the order in which
/// items come out depends on the contents of the queue alone, not on its history.
#[derive(Clone, Debug)]
struct LazyHeap {
    /// A heap with four children per node, which lie side by side in memory.
    near: Vec<Candidate>,
    /// The groups, the next one last.
    far: Vec<Group>,
    /// Number of items in the groups.
    waiting: usize,
    /// With more items than this all outdated ones are dropped, to bound the memory.
    prune_above: usize,
}

/// Waiting items.
#[derive(Clone, Debug)]
struct Group {
    items: Vec<Candidate>,
    /// Pivot: every item of this group is >= it, every item due earlier is < it.
    from: Candidate,
}

impl Default for LazyHeap {
    fn default() -> Self {
        Self { near: Vec::new(), far: Vec::new(), waiting: 0, prune_above: HEAP_SIZE }
    }
}

impl LazyHeap {
    /// A queue of the given items. Cost `O(n)`.
    fn from_items(items: Vec<Candidate>) -> Self {
        let mut queue = Self::default();
        queue.refill(items);
        queue.note_size();
        queue
    }

    /// Adds an item.
    #[inline]
    fn push(&mut self, item: Candidate) {
        match self.far.last() {
            // Only an item before every pivot may go into the heap, which is emptied first.
            Some(next) if !item.is_before(&next.from) => self.push_far(item),
            _ => {
                self.near.push(item);
                self.sift_up(self.near.len() - 1);
            }
        }
    }

    fn push_far(&mut self, item: Candidate) {
        // Pivots descend along `far`: the first group that does not start after the item is its own.
        let group = self.far.partition_point(|group| item.is_before(&group.from));
        self.far[group].items.push(item);
        self.waiting += 1;
    }

    /// Number of items, including outdated ones that were not dropped yet.
    fn len(&self) -> usize {
        self.near.len() + self.waiting
    }

    /// Takes the first item that is still current. An item that was outdated once must stay so.
    ///
    /// After a call the queue holds at most a constant plus three times the items that were current
    /// when outdated ones were last dropped.
    fn pop(&mut self, is_current: impl Fn(&Candidate) -> bool) -> Option<Candidate> {
        if self.len() > self.prune_above {
            self.drop_outdated(&is_current);
        }
        loop {
            while let Some(first) = self.pop_near() {
                if is_current(&first) {
                    return Some(first);
                }
            }
            let mut group = self.far.pop()?.items;
            self.waiting -= group.len();
            // Before any sorting, since most of the group is usually outdated by now.
            group.retain(&is_current);
            self.refill(group);
        }
    }

    fn drop_outdated(&mut self, is_current: &impl Fn(&Candidate) -> bool) {
        // A group may become empty; its pivot still bounds later items.
        self.near.retain(is_current);
        self.heapify();
        for group in &mut self.far {
            group.items.retain(is_current);
        }
        self.waiting = self.far.iter().map(|group| group.items.len()).sum();
        self.note_size();
    }

    /// Three times the size: then the cost of dropping is constant per item pushed.
    fn note_size(&mut self) {
        self.prune_above = HEAP_SIZE + 3 * self.len();
    }

    /// Fills the empty heap with the first of `items`; the others become the next groups.
    fn refill(&mut self, mut items: Vec<Candidate>) {
        // The latest group is split off first, so the earliest ends up last in `far`.
        while items.len() > HEAP_SIZE {
            let share = (HEAP_SIZE / 2).max(items.len() / SHARE);
            let (_, &mut from, _) = items.select_nth_unstable_by(share, Candidate::order);
            let group = items.split_off(share);
            self.waiting += group.len();
            self.far.push(Group { items: group, from });
        }
        self.near = items;
        self.heapify();
    }

    fn pop_near(&mut self) -> Option<Candidate> {
        let last = self.near.pop()?;
        let Some(first) = self.near.first().copied() else {
            return Some(last);
        };
        // The last leaf fills the gap at the root and sinks to its place.
        self.near[0] = last;
        self.sift_down(0);
        Some(first)
    }

    fn heapify(&mut self) {
        // From the last parents to the root: linear in total. Leaves beyond need nothing.
        for index in (0..self.near.len().div_ceil(4)).rev() {
            self.sift_down(index);
        }
    }

    #[inline]
    fn sift_up(&mut self, mut index: usize) {
        let moving = self.near[index];
        while index > 0 {
            let parent = (index - 1) / 4;
            if !moving.is_before(&self.near[parent]) {
                break;
            }
            self.near[index] = self.near[parent];
            index = parent;
        }
        self.near[index] = moving;
    }

    fn sift_down(&mut self, mut index: usize) {
        let heap = self.near.as_mut_slice();
        let moving = heap[index];
        loop {
            let first = 4 * index + 1;
            if first >= heap.len() {
                break;
            }
            let mut least = first;
            for child in first + 1..heap.len().min(first + 4) {
                if heap[child].is_before(&heap[least]) {
                    least = child;
                }
            }
            if !heap[least].is_before(&moving) {
                break;
            }
            heap[index] = heap[least];
            index = least;
        }
        heap[index] = moving;
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
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    use super::*;

    /// A candidate with a cost and an id.
    fn item(cost: u32, id: u32) -> Candidate {
        Candidate { cost: f64::from(cost), tie: 0.0, ends: [id, id], stamp: 0 }
    }

    /// Against a sorted set, with far more items than the heap takes at a time, most of which are
    /// out of date when their turn comes, and many new ones before those that wait.
    #[test]
    fn items_come_out_in_order_and_only_current_ones() {
        let mut random = Pcg64::seed_from_u64(3);
        let items: Vec<_> = (0..40_000).map(|id| (random.random_range(0..9_000_u32), id)).collect();
        let mut expected: std::collections::BTreeSet<_> = items.iter().copied().collect();
        let items = items.into_iter().map(|(cost, id)| item(cost, id));
        let mut queue = LazyHeap::from_items(items.collect());
        let mut outdated = vec![false; 200_000];
        for id in 40_000.. {
            for _ in 0..random.random_range(0..4) {
                let gone = random.random_range(0..id) as usize;
                outdated[gone] = true;
            }
            if (id as usize) < outdated.len() && random.random_bool(0.7) {
                let cost = random.random_range(0..9_000);
                expected.insert((cost, id));
                queue.push(item(cost, id));
            }
            let popped = queue.pop(|item| !outdated[item.ends[0] as usize]);
            let mut rest = std::iter::from_fn(|| expected.pop_first());
            let first = rest.find(|item| !outdated[item.1 as usize]);
            assert_eq!(popped, first.map(|(cost, id)| item(cost, id)));
            if popped.is_none() {
                break;
            }
        }
        assert_eq!(queue.len(), 0);
    }

    /// Outdated items do not pile up.
    #[test]
    fn the_memory_is_bounded() {
        let mut queue = LazyHeap::default();
        queue.push(item(0, 0));
        for id in 0..1_000_000_u32 {
            assert_eq!(queue.pop(|item| item.ends[0] == id), Some(item(0, id)));
            // Far behind current items, so that it is never popped.
            (0..4).for_each(|extra| queue.push(item(1_000 + extra, id)));
            queue.push(item(0, id + 1));
            assert!(queue.len() < 3 * HEAP_SIZE, "{}", queue.len());
        }
    }

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
