//! A priority queue for many items of which most change or vanish before their turn.

/// Items in ascending order, sorted late and forgotten early.
///
/// Only the first items are in a heap. The others wait in groups: the groups are ordered, the items
/// of one group are not. When the heap is empty, the next group replaces it: its outdated items are
/// dropped or moved, and its later items are split off into new groups, as quicksort would. So most items are
/// never sorted at all. Items that compare as equal must be identical: then the order in which
/// items come out depends on the contents of the queue alone, not on its history.
///
/// ```
/// use medial::range_queue::RangeQueue;
///
/// // Of these items 5 is gone, and 7 has become 8.
/// let mut queue = RangeQueue::new(vec![7, 5, 9, 1]);
/// let present = |item| (item != 5).then_some(if item == 7 { 8 } else { item });
/// let order: Vec<i32> = std::iter::from_fn(|| queue.pop(present)).collect();
/// assert_eq!(order, [1, 8, 9]);
/// ```
#[derive(Clone, Debug)]
pub struct RangeQueue<T> {
    /// A heap with four children per node, which lie side by side in memory.
    near: Vec<T>,
    /// The groups, the next one last.
    far: Vec<Group<T>>,
    /// Number of items in the groups.
    waiting: usize,
    /// With more items than this all outdated ones are dropped, to bound the memory.
    prune_above: usize,
}

/// Waiting items.
#[derive(Clone, Debug)]
struct Group<T> {
    items: Vec<T>,
    /// Pivot: every item of this group is >= it, every item due earlier is < it.
    from: T,
}

/// The heap is refilled with at most this many items at a time, few enough for the cache.
const HEAP_SIZE: usize = 1 << 12;

/// While a group is too large for the heap, a refill keeps its first `1 / SHARE` and splits off the
/// rest.
const SHARE: usize = 8;

impl<T> Default for RangeQueue<T> {
    fn default() -> Self {
        Self { near: Vec::new(), far: Vec::new(), waiting: 0, prune_above: HEAP_SIZE }
    }
}

impl<T: Ord + Copy> RangeQueue<T> {
    /// A queue of some items. Cost `O(n)`.
    pub fn new(items: Vec<T>) -> Self {
        let mut queue = Self::default();
        queue.refill(items);
        queue.note_size();
        queue
    }

    /// Adds an item.
    #[inline]
    pub fn push(&mut self, item: T) {
        match self.far.last() {
            // Only an item before every pivot may go into the heap, which is emptied first.
            Some(next) if item >= next.from => self.push_far(item),
            _ => {
                self.near.push(item);
                self.sift_up(self.near.len() - 1);
            }
        }
    }

    fn push_far(&mut self, item: T) {
        // Pivots descend along `far`: the first group that does not start after the item is its own.
        let group = self.far.partition_point(|group| item < group.from);
        self.far[group].items.push(item);
        self.waiting += 1;
    }

    /// Number of items, including outdated ones that were not dropped yet.
    fn len(&self) -> usize {
        self.near.len() + self.waiting
    }

    /// Removes the least item that is up to date. `present` returns for an item its present form: the same, a
    /// larger one, or none, which is final.
    ///
    /// After a call the queue holds at most a constant plus three times the items that were left when outdated ones were
    /// last dropped.
    pub fn pop(&mut self, present: impl Fn(T) -> Option<T>) -> Option<T> {
        if self.len() > self.prune_above {
            self.drop_outdated(|item| present(item).is_some());
        }
        loop {
            while let Some(first) = self.pop_near() {
                match present(first) {
                    Some(now) if now == first => return Some(first),
                    Some(now) => self.push(now),
                    None => {}
                }
            }
            let mut group = self.far.pop()?.items;
            self.waiting -= group.len();
            // Before any sorting, since most of the group is usually outdated by now.
            group.retain_mut(|item| {
                let Some(now) = present(*item) else { return false };
                if now == *item {
                    return true;
                }
                *item = now;
                let is_later = self.far.last().is_some_and(|next| now >= next.from);
                if is_later {
                    self.push_far(now);
                }
                !is_later
            });
            self.refill(group);
        }
    }

    fn drop_outdated(&mut self, is_left: impl Fn(T) -> bool) {
        // A group may become empty; its pivot still bounds later items.
        self.near.retain(|&item| is_left(item));
        self.heapify();
        for group in &mut self.far {
            group.items.retain(|&item| is_left(item));
        }
        self.waiting = self.far.iter().map(|group| group.items.len()).sum();
        self.note_size();
    }

    /// Three times the size: then the cost of dropping is constant per item pushed.
    fn note_size(&mut self) {
        self.prune_above = HEAP_SIZE + 3 * self.len();
    }

    /// Fills the empty heap with the first of `items`; the others become the next groups.
    fn refill(&mut self, mut items: Vec<T>) {
        // The latest group is split off first, so the earliest ends up last in `far`.
        while items.len() > HEAP_SIZE {
            let share = (HEAP_SIZE / 2).max(items.len() / SHARE);
            let (_, &mut from, _) = items.select_nth_unstable(share);
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
            if moving >= self.near[parent] {
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
                if heap[child] < heap[least] {
                    least = child;
                }
            }
            if heap[least] >= moving {
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
    use std::cmp::Reverse;
    use std::collections::BinaryHeap;

    use super::*;

    #[test]
    fn the_order_is_that_of_one_heap() {
        // A linear congruential sequence, in places with many equal items.
        let mut state = 1_u64;
        let mut next = |equal: bool| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (if equal { 1 << 60 } else { state >> 8 }, (state >> 40) as u32)
        };
        // Some items vanish, others grow once.
        let present = |(key, id): (u64, u32)| match id % 5 {
            0 => None,
            1 if key.is_multiple_of(2) => Some((key + 1001, id)),
            _ => Some((key, id)),
        };
        let first: Vec<_> = (0..20_000).map(|k| next(k % 3 == 0)).collect();
        let mut heap: BinaryHeap<_> = first.iter().copied().map(Reverse).collect();
        let mut queue = RangeQueue::new(first);
        let mut popped = 0;
        for k in 0.. {
            let expected = loop {
                let Some(Reverse(item)) = heap.pop() else { break None };
                match present(item) {
                    Some(now) if now == item => break Some(item),
                    Some(now) => heap.push(Reverse(now)),
                    None => {}
                }
            };
            assert_eq!(queue.pop(present), expected);
            if expected.is_none() {
                break;
            }
            popped += 1;
            if k < 5_000 {
                for item in [next(k % 2 == 0), next(false), next(false)] {
                    heap.push(Reverse(item));
                    queue.push(item);
                }
            }
        }
        assert!(popped > 20_000, "{popped}");
    }

    /// Outdated items do not pile up.
    #[test]
    fn the_memory_is_bounded() {
        let mut queue = RangeQueue::new(vec![(0, 0)]);
        for id in 0..1_000_000_u32 {
            assert_eq!(queue.pop(|item| (item.1 == id).then_some(item)), Some((0, id)));
            // Far behind current items, so that it is never popped.
            (0..4).for_each(|extra| queue.push((1_000 + extra, id)));
            queue.push((0, id + 1));
            assert!(queue.len() < 3 * HEAP_SIZE, "{}", queue.len());
        }
    }

    #[test]
    fn equal_items_all_come() {
        let mut queue = RangeQueue::new(vec![7; 3 * HEAP_SIZE]);
        queue.push(3);
        assert_eq!(queue.pop(Some), Some(3));
        assert_eq!(std::iter::from_fn(|| queue.pop(Some)).count(), 3 * HEAP_SIZE);
    }
}
