//! A priority queue for many items of which most change or vanish before their turn.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Items in ascending order. Only those of the lowest range are a heap, which is small enough for the cache.
/// The ranges above it are unsorted lists: outdated items are dropped or moved when the turn of their range
/// comes, and most never enter a heap.
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
    lowest: BinaryHeap<Reverse<T>>,
    /// The least items of the ranges above, descending.
    from: Vec<T>,
    /// The items of each of them.
    ranges: Vec<Vec<T>>,
    /// Number of items, including outdated ones that were not dropped yet.
    len: usize,
    /// With more items than this all outdated ones are dropped, to bound the memory.
    prune_above: usize,
}

impl<T: Ord> Default for RangeQueue<T> {
    fn default() -> Self {
        let (lowest, from, ranges) = (BinaryHeap::new(), Vec::new(), Vec::new());
        Self { lowest, from, ranges, len: 0, prune_above: LARGE }
    }
}

/// Items from which on a range is split before it becomes a heap.
const LARGE: usize = 4096;
/// Most ranges made of one.
const MAX_PIECES: usize = 4096;
/// Items that are sorted for each bound between two ranges.
const PER_BOUND: usize = 8;

impl<T: Ord + Copy> RangeQueue<T> {
    /// A queue of some items. Cost `O(n)`.
    pub fn new(items: Vec<T>) -> Self {
        let mut queue = Self { len: items.len(), ..Self::default() };
        queue.fill(items);
        queue.note_size();
        queue
    }

    /// Adds an item.
    #[inline]
    pub fn push(&mut self, item: T) {
        self.len += 1;
        match self.range_of(item) {
            Some(range) => self.ranges[range].push(item),
            None => self.lowest.push(Reverse(item)),
        }
    }

    /// Removes the least item that is up to date. `present` returns for an item its present form: the same, a
    /// larger one, or none. A none is final.
    ///
    /// After a call the queue holds at most a constant plus three times the items that were left when outdated ones were
    /// last dropped.
    pub fn pop(&mut self, present: impl Fn(T) -> Option<T>) -> Option<T> {
        if self.len > self.prune_above {
            self.drop_outdated(|item| present(item).is_some());
        }
        loop {
            while let Some(Reverse(item)) = self.lowest.pop() {
                self.len -= 1;
                match present(item) {
                    Some(now) if now == item => return Some(item),
                    Some(now) => self.push(now),
                    None => {}
                }
            }
            let range = self.ranges.pop()?;
            self.from.pop();
            self.len -= range.len();
            let mut lowest: Vec<T> = Vec::with_capacity(range.len());
            for item in range.into_iter().filter_map(&present) {
                self.len += 1;
                match self.range_of(item) {
                    Some(range) => self.ranges[range].push(item),
                    None => lowest.push(item),
                }
            }
            self.fill(lowest);
        }
    }

    fn drop_outdated(&mut self, is_left: impl Fn(T) -> bool) {
        self.lowest.retain(|&Reverse(item)| is_left(item));
        // A range may become empty; its bound still holds for later items.
        self.ranges.iter_mut().for_each(|range| range.retain(|&item| is_left(item)));
        self.len = self.lowest.len() + self.ranges.iter().map(Vec::len).sum::<usize>();
        self.note_size();
    }

    /// Three times the size: then the cost of dropping is constant per item pushed.
    fn note_size(&mut self) {
        self.prune_above = LARGE + 3 * self.len;
    }

    /// Makes a heap of a range that is the lowest one now, or of the lowest part of it.
    fn fill(&mut self, range: Vec<T>) {
        let lowest = if range.len() < LARGE { range } else { self.split(range) };
        self.lowest = lowest.into_iter().map(Reverse).collect();
    }

    /// The range above the lowest one that an item belongs to.
    #[inline]
    fn range_of(&self, item: T) -> Option<usize> {
        let range = self.from.partition_point(|&from| from > item);
        (range < self.from.len()).then_some(range)
    }

    /// Splits a range into several, and returns the lowest.
    fn split(&mut self, range: Vec<T>) -> Vec<T> {
        let pieces = (2 * range.len() / LARGE).min(MAX_PIECES);
        let step = range.len() / (pieces * PER_BOUND);
        let mut some: Vec<T> = range.iter().copied().step_by(step).collect();
        some.sort_unstable_by(|a, b| b.cmp(a));
        some.dedup();
        // The lowest range keeps the least item, so that it is not empty.
        let least = range.iter().min().copied();
        self.from.extend(some.into_iter().step_by(PER_BOUND).filter(|&item| Some(item) > least));
        self.ranges.resize_with(self.from.len(), Vec::new);
        let mut lowest = Vec::new();
        for item in range {
            match self.range_of(item) {
                Some(range) => self.ranges[range].push(item),
                None => lowest.push(item),
            }
        }
        lowest
    }
}

#[cfg(test)]
mod tests {
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
            assert!(queue.len < 3 * LARGE, "{}", queue.len);
        }
    }

    #[test]
    fn equal_items_all_come() {
        let mut queue = RangeQueue::new(vec![7; 3 * LARGE]);
        queue.push(3);
        assert_eq!(queue.pop(Some), Some(3));
        assert_eq!(std::iter::from_fn(|| queue.pop(Some)).count(), 3 * LARGE);
    }
}
