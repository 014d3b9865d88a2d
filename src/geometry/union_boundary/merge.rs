//! Step 3: one point for each group of equal vertices.

use super::{UnionBoundary, UnionVertex};
use crate::Vec3;
use crate::disjoint::DisjointSets;

/// Vertices of the boundary of a union of balls, each once.
#[derive(Clone, Debug, PartialEq)]
pub struct MergedVertices {
    points: Vec<Vec3>,
    point_of: Vec<u32>,
    /// The balls of point `i` are `balls[start[i]..start[i + 1]]`.
    start: Vec<u32>,
    balls: Vec<u32>,
}

impl MergedVertices {
    /// The positions, in the order of the first vertex of each. A position is taken from the vertex
    /// with the most nearly rectangular triangle, which determines it best.
    pub fn points(&self) -> &[Vec3] {
        &self.points
    }

    /// For each vertex of the [`UnionBoundary`] its point.
    pub fn point_of(&self) -> &[u32] {
        &self.point_of
    }

    /// The balls whose spheres meet in a point, ascending: three or more.
    ///
    /// # Panics
    /// If there is no such point.
    pub fn balls(&self, point: usize) -> &[u32] {
        &self.balls[self.start[point] as usize..self.start[point + 1] as usize]
    }
}

impl UnionBoundary {
    /// Merges vertices that are one point exactly, see [`UnionBoundary::coincident`], and those
    /// with the same key, if `key` gives one.
    ///
    /// The balls of a power crust meet in the samples by construction but, being rounded, not
    /// exactly: there the sample is the key.
    pub fn merge(&self, key: impl Fn(&UnionVertex) -> Option<u32>) -> MergedVertices {
        let mut groups = DisjointSets::singletons(self.vertices.len());
        for &[a, b] in &self.coincident {
            groups.join(a, b);
        }
        let keyed = self.vertices.iter().enumerate();
        let mut keyed: Vec<(u32, u32)> =
            keyed.filter_map(|(i, v)| Some((key(v)?, i as u32))).collect();
        keyed.sort_unstable();
        for pair in keyed.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
            groups.join(pair[0].1, pair[1].1);
        }
        self.gather(&mut groups)
    }

    fn gather(&self, groups: &mut DisjointSets) -> MergedVertices {
        let count = self.vertices.len();
        let mut point_of = vec![0; count];
        // The representative of a group is its smallest member, so it is numbered first.
        let mut best: Vec<usize> = Vec::new();
        for i in 0..count {
            let first = groups.find(i as u32) as usize;
            if first == i {
                point_of[i] = best.len() as u32;
                best.push(i);
            } else {
                point_of[i] = point_of[first];
                let best = &mut best[point_of[i] as usize];
                if self.quality[i] > self.quality[*best] {
                    *best = i;
                }
            }
        }
        let with_balls = point_of.iter().zip(&self.vertices);
        let mut pairs: Vec<(u32, u32)> =
            with_balls.flat_map(|(&point, v)| v.balls.map(|ball| (point, ball))).collect();
        pairs.sort_unstable();
        pairs.dedup();
        let mut start = vec![0; best.len() + 1];
        for &(point, _) in &pairs {
            start[point as usize + 1] += 1;
        }
        for i in 0..best.len() {
            start[i + 1] += start[i];
        }
        MergedVertices {
            points: best.into_iter().map(|i| self.vertices[i].position).collect(),
            point_of,
            start,
            balls: pairs.into_iter().map(|pair| pair.1).collect(),
        }
    }
}
