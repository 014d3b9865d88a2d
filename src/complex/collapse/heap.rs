//! A priority queue for items most of which are out of date before their turn comes.

use std::cmp::Ordering;

/// Items up to this number are all kept in the heap.
const FEW: usize = 1024;

/// Share of the far items that the heap takes when it has run empty.
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
/// Only the first items are in a heap, small enough for the cache; the others wait in no order.
/// When the heap has run empty it takes the first share of them, and those out of date are dropped
/// then, so most are never sorted at all. Items that are equal in order must be equal in every
/// respect: then equal contents come out in the same order whatever the history.
#[derive(Clone, Debug)]
pub struct LazyHeap<T> {
    /// Four children a node: the items of one family lie close together.
    near: Vec<T>,
    /// Items not before `bound`.
    far: Vec<T>,
    /// Nothing in `near` is behind it; `None` when `far` is empty.
    bound: Option<T>,
    /// With more items than this those out of date are dropped, to save memory.
    most: usize,
}

impl<T> Default for LazyHeap<T> {
    fn default() -> Self {
        Self { near: Vec::new(), far: Vec::new(), bound: None, most: FEW }
    }
}

impl<T: Prioritised> LazyHeap<T> {
    /// A queue of the given items. Cost `O(n)`.
    pub fn from_items(items: Vec<T>) -> Self {
        let mut queue = Self { far: items, ..Self::default() };
        queue.refill();
        queue
    }

    /// Adds an item.
    #[inline]
    pub fn push(&mut self, item: T) {
        if self.bound.is_none_or(|bound| item.is_before(&bound)) {
            self.near.push(item);
            self.sift_up(self.near.len() - 1);
        } else {
            self.far.push(item);
        }
    }

    /// Number of items, those out of date that were not met yet included.
    pub fn len(&self) -> usize {
        self.near.len() + self.far.len()
    }

    /// Whether nothing is queued.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Takes the first item that is still current. An item that was out of date once must stay
    /// so. Never more than a constant and three times as many items are queued as were current
    /// when they were last looked through.
    pub fn pop(&mut self, is_current: impl Fn(&T) -> bool) -> Option<T> {
        if self.len() > self.most {
            self.near.retain(&is_current);
            self.far.retain(&is_current);
            self.heapify();
            self.note_size();
        }
        loop {
            if self.near.is_empty() {
                self.far.retain(&is_current);
                self.refill();
            }
            let first = self.pop_near()?;
            if is_current(&first) {
                return Some(first);
            }
        }
    }

    fn note_size(&mut self) {
        self.most = FEW + 3 * self.len();
    }

    /// Moves the first share of the far items into the empty heap.
    fn refill(&mut self) {
        self.bound = None;
        if self.far.len() <= FEW {
            std::mem::swap(&mut self.near, &mut self.far);
        } else {
            let share = FEW.max(self.far.len() / SHARE);
            let (_, &mut bound, _) = self.far.select_nth_unstable_by(share, T::order);
            // The first are in front; the last ones take their places.
            self.near.extend_from_slice(&self.far[..share]);
            let left = self.far.len() - share;
            let moved = left.min(share);
            self.far.copy_within(share + left - moved.., 0);
            self.far.truncate(left);
            self.bound = Some(bound);
        }
        self.heapify();
        self.note_size();
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
