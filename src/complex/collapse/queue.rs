//! The order in which edges are collapsed.

use std::cmp::Ordering;

use super::{CollapseComplex, LazyHeap, Prioritised};

/// End of a list of nodes.
const NONE: u32 = u32::MAX;

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
        let ordered = |key: f64| if key.is_nan() { f64::INFINITY } else { key };
        Self { cost: ordered(cost), tie: ordered(tie), ends: [a.min(b), a.max(b)], stamp }
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

impl Prioritised for Candidate {
    #[inline]
    fn is_before(&self, other: &Self) -> bool {
        Self::is_before(self, other)
    }

    fn order(&self, other: &Self) -> Ordering {
        Self::order(self, other)
    }
}

/// A priority queue of candidates: smallest cost first, then the second key, then the ids.
/// Equal contents come out in the same order whatever the history.
#[derive(Clone, Debug, Default)]
pub struct CollapseQueue {
    heap: LazyHeap<Candidate>,
    parked: Parked,
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
        self.parked.insert(candidate, obstacles);
    }

    /// Queues the candidates parked at `v` that are still current. Call it for both ends of every
    /// collapsed edge.
    #[inline]
    pub fn wake(&mut self, complex: &CollapseComplex, v: u32) {
        while let Some(candidate) = self.parked.take(v) {
            if candidate.is_current(complex) {
                self.push(candidate);
            }
        }
    }
}

/// Rejected candidates, listed at each of their obstacles.
#[derive(Clone, Debug, Default)]
struct Parked {
    /// First node of the list of each vertex, by id; grown on demand.
    heads: Vec<u32>,
    nodes: Slab<Node>,
    candidates: Slab<Waiting>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    waiting: u32,
    next: u32,
}

#[derive(Clone, Copy, Debug)]
struct Waiting {
    /// `None` once it was woken at one of its obstacles.
    candidate: Option<Candidate>,
    /// Number of obstacles whose lists still name it; at zero the slot is free.
    lists: u32,
}

impl Parked {
    fn insert(&mut self, candidate: Candidate, obstacles: &[u32]) {
        let lists = obstacles.len() as u32;
        // Nothing could ever wake it.
        if lists == 0 {
            return;
        }
        let waiting = self.candidates.insert(Waiting { candidate: Some(candidate), lists });
        for &v in obstacles {
            if self.heads.len() <= v as usize {
                self.heads.resize(v as usize + 1, NONE);
            }
            let head = &mut self.heads[v as usize];
            *head = self.nodes.insert(Node { waiting, next: *head });
        }
    }

    /// A candidate of `v` that still waits, taken out of its list.
    fn take(&mut self, v: u32) -> Option<Candidate> {
        let head = self.heads.get_mut(v as usize)?;
        while *head != NONE {
            let Node { waiting, next } = self.nodes.remove(*head);
            *head = next;
            let entry = &mut self.candidates.items[waiting as usize];
            // Another obstacle may have woken it; then this list still has to let go of it.
            let candidate = entry.candidate.take();
            entry.lists -= 1;
            if entry.lists == 0 {
                self.candidates.remove(waiting);
            }
            if candidate.is_some() {
                return candidate;
            }
        }
        None
    }
}

/// Items with stable indices; the indices of removed items are reused.
#[derive(Clone, Debug)]
struct Slab<T> {
    items: Vec<T>,
    free: Vec<u32>,
}

impl<T> Default for Slab<T> {
    fn default() -> Self {
        Self { items: Vec::new(), free: Vec::new() }
    }
}

impl<T: Copy> Slab<T> {
    fn insert(&mut self, item: T) -> u32 {
        if let Some(index) = self.free.pop() {
            self.items[index as usize] = item;
            return index;
        }
        self.items.push(item);
        (self.items.len() - 1) as u32
    }

    fn remove(&mut self, index: u32) -> T {
        self.free.push(index);
        self.items[index as usize]
    }
}
