//! A queue of places by a key, in buckets.
//!
//! Keys are rounded to one of 65,536 steps of their range, far finer than the sampling error of a
//! flux. Places of the same step leave in the order in which they came. So a plateau of equal keys is
//! peeled layer by layer from all sides, whatever its position in the lattice.

use super::bricks::Place;

const BUCKETS: usize = 1 << 16;
const NONE: u32 = u32::MAX;

/// Places in the order of their keys, the least first.
pub struct BucketQueue {
    least: f32,
    /// Steps for each unit of the key.
    steps: f32,
    /// First and last node of each bucket.
    ends: Vec<[u32; 2]>,
    nodes: Vec<Node>,
    /// First of the nodes that are free.
    free: u32,
    /// A bit for each non-empty bucket, and in `summary` a bit for each non-zero word.
    words: Vec<u64>,
    summary: [u64; BUCKETS / 4096],
}

struct Node {
    place: Place,
    next: u32,
}

impl BucketQueue {
    /// An empty queue for keys in a range; a key outside counts as the nearer end.
    pub fn new([least, most]: [f32; 2]) -> Self {
        let span = most - least;
        Self {
            least,
            steps: if span > 0.0 { (BUCKETS - 1) as f32 / span } else { 0.0 },
            ends: vec![[NONE; 2]; BUCKETS],
            nodes: Vec::new(),
            free: NONE,
            words: vec![0; BUCKETS / 64],
            summary: [0; BUCKETS / 4096],
        }
    }

    /// Puts in a place.
    pub fn push(&mut self, key: f32, place: Place) {
        let bucket = (((key - self.least) * self.steps) as usize).min(BUCKETS - 1);
        let node = self.node(place);
        match self.ends[bucket] {
            [NONE, _] => {
                self.ends[bucket] = [node; 2];
                self.words[bucket / 64] |= 1 << (bucket % 64);
                self.summary[bucket / 4096] |= 1 << (bucket / 64 % 64);
            }
            // At the end of its bucket: first in, first out.
            [_, last] => {
                self.nodes[last as usize].next = node;
                self.ends[bucket][1] = node;
            }
        }
    }

    /// Takes out the place that came first of those with the least key.
    pub fn pop(&mut self) -> Option<Place> {
        // Two levels of bits: a few words are read, however many buckets are empty.
        let part = self.summary.iter().position(|&bits| bits != 0)?;
        let word = 64 * part + self.summary[part].trailing_zeros() as usize;
        let bucket = 64 * word + self.words[word].trailing_zeros() as usize;
        let first = self.ends[bucket][0];
        let Node { place, next } = self.nodes[first as usize];
        self.nodes[first as usize].next = self.free;
        self.free = first;
        self.ends[bucket][0] = next;
        if next == NONE {
            self.words[word] &= !(1 << (bucket % 64));
            if self.words[word] == 0 {
                self.summary[part] &= !(1 << (word % 64));
            }
        }
        Some(place)
    }

    fn node(&mut self, place: Place) -> u32 {
        let node = Node { place, next: NONE };
        if self.free == NONE {
            self.nodes.push(node);
            return self.nodes.len() as u32 - 1;
        }
        let free = self.free;
        self.free = std::mem::replace(&mut self.nodes[free as usize], node).next;
        free
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_leave_by_key_and_then_as_they_came() {
        let mut queue = BucketQueue::new([-1.0, 1.0]);
        let mut state = 3_u64;
        let mut expected: Vec<(usize, usize, Place)> = Vec::new();
        let mut next = |limit: u64| {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 33) % limit
        };
        for round in 0..20_000 {
            if next(5) < 3 {
                // Few keys, some of them beyond the range.
                let key = next(12) as usize;
                let place = [round as u16, (round >> 3) as u16, key as u16];
                queue.push((key as f32 - 5.0) * 0.2 * 1.2, place);
                expected.push((key.min(10), round, place));
            } else {
                let least = (0..expected.len()).min_by_key(|&k| (expected[k].0, expected[k].1));
                assert_eq!(queue.pop(), least.map(|k| expected.remove(k).2));
            }
        }
        expected.sort_unstable();
        for (_, _, place) in expected {
            assert_eq!(queue.pop(), Some(place));
        }
        assert_eq!(queue.pop(), None);
    }
}
