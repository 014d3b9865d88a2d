//! A priority queue for items most of which are out of date before their turn comes.

use std::cmp::Ordering;

/// The heap is filled with about so many items at a time, few enough for the cache.
const NEAR: usize = 1 << 12;

/// Share of a group that is taken from it when its turn comes.
const SHARE: usize = 8;

/// What a [`LazyHeap`] holds: small, copied about, in a total order.
pub trait Prioritised: Copy {
    /// The order in which items come out.
    fn order(&self, other: &Self) -> Ordering;

    /// Whether this item comes out first. To be overridden where that is faster.
    #[inline]
    fn is_before(&self, other: &Self) -> bool {
        self.order(other) == Ordering::Less
    }
}

/// A priority queue that sorts late and forgets early.
///
/// Only the first items are in a heap; the others wait in groups, one behind the other, in no order
/// within a group. When the heap has run empty the next group is looked at: items out of date are
/// dropped, and what does not come soon is split off into groups of its own, as quicksort would.
/// So most items are never sorted at all. Items that are equal in order must be equal in every
/// respect: then equal contents come out in the same order whatever the history.
#[derive(Clone, Debug)]
pub struct LazyHeap<T> {
    /// Four children a node: the items of one family lie close together.
    near: Vec<T>,
    /// The next group last.
    far: Vec<Group<T>>,
    /// Number of items in the groups.
    waiting: usize,
    /// With more items than this those out of date are dropped, to save memory.
    most: usize,
}

/// Items that wait.
#[derive(Clone, Debug)]
struct Group<T> {
    items: Vec<T>,
    /// None of the items is before this one; all that are not in this group or a later one are.
    from: T,
}

impl<T> Default for LazyHeap<T> {
    fn default() -> Self {
        Self { near: Vec::new(), far: Vec::new(), waiting: 0, most: NEAR }
    }
}

impl<T: Prioritised> LazyHeap<T> {
    /// A queue of the given items. Cost `O(n)`.
    pub fn from_items(items: Vec<T>) -> Self {
        let mut queue = Self::default();
        queue.refill(items);
        queue.note_size();
        queue
    }

    /// Adds an item.
    #[inline]
    pub fn push(&mut self, item: T) {
        match self.far.last() {
            Some(next) if !item.is_before(&next.from) => self.push_far(item),
            _ => {
                self.near.push(item);
                self.sift_up(self.near.len() - 1);
            }
        }
    }

    fn push_far(&mut self, item: T) {
        let group = self.far.partition_point(|group| item.is_before(&group.from));
        self.far[group].items.push(item);
        self.waiting += 1;
    }

    /// Number of items, those out of date that were not met yet included.
    pub fn len(&self) -> usize {
        self.near.len() + self.waiting
    }

    /// Whether nothing is queued.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Takes the first item that is still current. An item that was out of date once must stay
    /// so. Never more than a constant and three times as many items are queued as were current
    /// when all were last looked through.
    pub fn pop(&mut self, is_current: impl Fn(&T) -> bool) -> Option<T> {
        if self.len() > self.most {
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
            group.retain(&is_current);
            self.refill(group);
        }
    }

    fn drop_outdated(&mut self, is_current: &impl Fn(&T) -> bool) {
        self.near.retain(is_current);
        self.heapify();
        for group in &mut self.far {
            group.items.retain(is_current);
        }
        self.waiting = self.far.iter().map(|group| group.items.len()).sum();
        self.note_size();
    }

    fn note_size(&mut self) {
        self.most = NEAR + 3 * self.len();
    }

    /// Makes the first of `items` the heap, which is empty, and the others the next groups.
    fn refill(&mut self, mut items: Vec<T>) {
        while items.len() > NEAR {
            let share = (NEAR / 2).max(items.len() / SHARE);
            let (_, &mut from, _) = items.select_nth_unstable_by(share, T::order);
            let group = items.split_off(share);
            self.waiting += group.len();
            self.far.push(Group { items: group, from });
        }
        self.near = items;
        self.heapify();
    }

    fn pop_near(&mut self) -> Option<T> {
        let last = self.near.pop()?;
        let Some(first) = self.near.first().copied() else {
            return Some(last);
        };
        self.near[0] = last;
        self.sift_down(0);
        Some(first)
    }

    fn heapify(&mut self) {
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

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    use super::*;

    impl Prioritised for (u32, u32) {
        fn order(&self, other: &Self) -> Ordering {
            self.cmp(other)
        }
    }

    /// Against a sorted set, with far more items than the heap takes at a time, most of which are
    /// out of date when their turn comes, and many new ones before those that wait.
    #[test]
    fn items_come_out_in_order_and_only_current_ones() {
        let mut random = Pcg64::seed_from_u64(3);
        let items: Vec<_> = (0..40_000).map(|id| (random.random_range(0..9_000_u32), id)).collect();
        let mut expected: std::collections::BTreeSet<_> = items.iter().copied().collect();
        let mut queue = LazyHeap::from_items(items);
        let mut outdated = vec![false; 200_000];
        for id in 40_000.. {
            for _ in 0..random.random_range(0..4) {
                let gone = random.random_range(0..id) as usize;
                outdated[gone] = true;
            }
            if (id as usize) < outdated.len() && random.random_bool(0.7) {
                let item = (random.random_range(0..9_000), id);
                expected.insert(item);
                queue.push(item);
            }
            let popped = queue.pop(|item| !outdated[item.1 as usize]);
            let mut rest = std::iter::from_fn(|| expected.pop_first());
            let first = rest.find(|item| !outdated[item.1 as usize]);
            assert_eq!(popped, first);
            if popped.is_none() {
                break;
            }
        }
        assert!(queue.is_empty());
    }

    /// What is out of date does not pile up.
    #[test]
    fn the_memory_is_bounded() {
        let mut queue = LazyHeap::default();
        queue.push((0, 0));
        for id in 0..1_000_000_u32 {
            assert_eq!(queue.pop(|item| item.1 == id), Some((0, id)));
            // Far behind what is current, so that it is never popped.
            (0..4).for_each(|extra| queue.push((1_000 + extra, id)));
            queue.push((0, id + 1));
            assert!(queue.len() < 3 * NEAR, "{}", queue.len());
        }
    }
}
