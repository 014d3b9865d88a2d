//! The canonical lists of a complex from simplices in any order.
//!
//! 1. Simplices are counted into runs by their smallest sphere.
//! 2. The run of a sphere is sorted, and repetitions are dropped: these are its faces.
//! 3. Its edges are those to the other spheres of its faces, those to the largest sphere of faces in
//!    which it is the middle one, and those that were given; again sorted, each once.
//!
//! Linear where few simplices begin at the same sphere.

use std::ops::Range;

use rayon::prelude::*;

/// Spheres whose runs are sorted by one task.
const CHUNK: usize = 2048;

/// The faces, and the edges with the sides of all faces: indices ascend, the lists are sorted
/// lexicographically, nothing is repeated. Given are simplices whose indices ascend, in any order.
/// Parallel; the same for any number of threads.
///
/// # Panics
/// If an index is not below `spheres`.
pub(super) fn closure(
    edges: &[[u32; 2]],
    faces: &[[u32; 3]],
    spheres: usize,
) -> (Vec<[u32; 2]>, Vec<[u32; 3]>) {
    let by_first = Runs::of(faces.iter().map(|&[a, b, c]| (a, Pair::of(b, c))), spheres);
    let by_middle = faces.iter().map(|&[_, b, c]| (b, c));
    let others = Runs::of(by_middle.chain(edges.iter().map(|&[a, b]| (a, b))), spheres);
    let parts: Vec<_> = (0..spheres)
        .into_par_iter()
        .step_by(CHUNK)
        .map(|first| {
            let part = first..spheres.min(first + CHUNK);
            let mut faces = Vec::with_capacity(by_first.len(&part));
            let mut edges = Vec::with_capacity(faces.capacity() + others.len(&part));
            let (mut pairs, mut ends) = (Vec::new(), Vec::new());
            for sphere in part {
                pairs.clear();
                pairs.extend_from_slice(by_first.run(sphere));
                sort_once(&mut pairs);
                ends.clear();
                ends.extend_from_slice(others.run(sphere));
                ends.extend(pairs.iter().flat_map(|pair| pair.spheres()));
                sort_once(&mut ends);
                let sphere = sphere as u32;
                faces.extend(pairs.iter().map(|pair| pair.spheres()).map(|[b, c]| [sphere, b, c]));
                edges.extend(ends.iter().map(|&end| [sphere, end]));
            }
            (edges, faces)
        })
        .collect();
    let (edges, faces): (Vec<_>, Vec<_>) = parts.into_iter().unzip();
    (edges.concat(), faces.concat())
}

/// The indices of a simplex, ascending. Without a branch: which is smaller cannot be foreseen.
#[inline]
pub(super) fn ascending_face([a, b, c]: [u32; 3]) -> [u32; 3] {
    let ([low, high], last) = (ascending_edge([a, b]), c);
    let [middle, high] = ascending_edge([high, last]);
    let [low, middle] = ascending_edge([low, middle]);
    [low, middle, high]
}

/// See [`ascending_face`].
#[inline]
pub(super) fn ascending_edge([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

fn sort_once<T: Ord>(items: &mut Vec<T>) {
    items.sort_unstable();
    items.dedup();
}

/// Two spheres in one word that is ordered as they are.
#[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
struct Pair(u64);

impl Pair {
    fn of(b: u32, c: u32) -> Self {
        Self(u64::from(b) << 32 | u64::from(c))
    }

    fn spheres(self) -> [u32; 2] {
        [(self.0 >> 32) as u32, self.0 as u32]
    }
}

/// Items by sphere, in the order in which they came.
struct Runs<T> {
    /// `items[start[s]..start[s + 1]]` are those of sphere `s`.
    start: Vec<u32>,
    items: Vec<T>,
}

impl<T: Copy + Default> Runs<T> {
    fn of(items: impl Iterator<Item = (u32, T)> + Clone, spheres: usize) -> Self {
        // Shifted by one while the runs are filled, so that in the end each start is where it
        // belongs.
        let mut start = vec![0_u32; spheres + 2];
        for (sphere, _) in items.clone() {
            start[sphere as usize + 2] += 1;
        }
        for sphere in 2..start.len() {
            start[sphere] += start[sphere - 1];
        }
        let mut placed = vec![T::default(); start[spheres + 1] as usize];
        for (sphere, item) in items {
            let next = &mut start[sphere as usize + 1];
            placed[*next as usize] = item;
            *next += 1;
        }
        start.pop();
        Self { start, items: placed }
    }

    /// The number of items of some spheres.
    fn len(&self, spheres: &Range<usize>) -> usize {
        (self.start[spheres.end] - self.start[spheres.start]) as usize
    }

    fn run(&self, sphere: usize) -> &[T] {
        &self.items[self.start[sphere] as usize..self.start[sphere + 1] as usize]
    }
}
