//! The topology graph of section 4.3, and the levels of section 4.1.
//!
//! 1. *Contact curves* are the edges and vertices that two pieces or more have, pieces being the parts and
//!    the curves, that is, connected edges without triangles. Connected ones are one *node*.
//! 2. The graph is bipartite, of pieces and nodes, so that a part may touch any number of nodes.
//! 3. The paper's test: a part may go if it is a leaf, that is, if it touches one node. With two or
//!    more it lies on a cycle or holds the rest together, with none it is a component.
//!
//! A part that can go by `parts.rs` is a leaf: where `H_1` and `H_0` of the closure and its contact
//! set vanish, the contact set is connected. The converse is false. A leaf that touches its node along
//! two curves, which are connected elsewhere, or that has a hole, can hold a loop. The graph does not
//! decide here; it counts these cases.

use std::collections::VecDeque;

use medial::geometry::DisjointSets;

use super::parts::{Parts, Remaining};

/// Nodes and pieces of one decomposition.
pub(super) struct Graph {
    /// Number of nodes.
    pub(super) nodes: usize,
    /// Number of independent cycles.
    pub(super) loops: usize,
    /// For each part whether it touches exactly one node.
    pub(super) is_leaf: Vec<bool>,
}

impl Graph {
    /// The graph of parts, none of which was removed since. Cost `O(n log n)`.
    pub(super) fn of(parts: &Parts, remaining: &Remaining<'_>) -> Self {
        let axis = remaining.axis;
        let whole = &axis.mesh;
        let mut nodes = DisjointSets::singletons(whole.spheres.len());
        let mut curves = DisjointSets::singletons(whole.spheres.len());
        for (edge, &[a, b]) in whole.edges.iter().enumerate() {
            if parts.at_edge[edge].count > 1 {
                nodes.join(a, b);
            }
            if axis.incidence.faces_at()[edge] == 0 {
                curves.join(a, b);
            }
        }
        // Pieces: the parts, then the curves by their smallest sphere.
        let mut pairs: Vec<u64> = Vec::new();
        let mut touch = |piece: usize, v: u32| {
            if parts.at_sphere[v as usize].count > 1 {
                pairs.push((piece as u64) << 32 | u64::from(nodes.find(v)));
            }
        };
        for part in 0..parts.len() {
            let corners = parts.faces(part).iter().flat_map(|&f| whole.faces[f as usize]);
            corners.for_each(|v| touch(part, v));
        }
        for v in (0..axis.on_curve.len() as u32).filter(|&v| axis.on_curve[v as usize]) {
            touch(parts.len() + curves.find(v) as usize, v);
        }
        pairs.sort_unstable();
        pairs.dedup();
        let mut is_leaf = vec![false; parts.len()];
        for of_piece in pairs.chunk_by(|a, b| a >> 32 == b >> 32) {
            if let Some(leaf) = is_leaf.get_mut((of_piece[0] >> 32) as usize) {
                *leaf = of_piece.len() == 1;
            }
        }
        let (nodes, loops) = cycle_rank(&pairs);
        Self { nodes, loops, is_leaf }
    }
}

/// The nodes of a bipartite graph and its independent cycles, from its edges in order.
fn cycle_rank(pairs: &[u64]) -> (usize, usize) {
    let pieces = pairs.chunk_by(|a, b| a >> 32 == b >> 32);
    let mut nodes: Vec<u32> = pairs.iter().map(|&pair| pair as u32).collect();
    nodes.sort_unstable();
    nodes.dedup();
    let mut sets = DisjointSets::singletons(pieces.clone().count() + nodes.len());
    let first_node = pieces.clone().count();
    let mut loops = 0;
    for (piece, of_piece) in pieces.enumerate() {
        for &pair in of_piece {
            let node = nodes.partition_point(|&n| n < pair as u32);
            loops += usize::from(!sets.join(piece as u32, (first_node + node) as u32));
        }
    }
    (nodes.len(), loops)
}

/// For each part its level: 1 at a free edge, one more than that of the lowest part beside it over
/// an edge; 0 where no part of level 1 can be reached.
pub(super) fn levels(parts: &Parts, remaining: &Remaining<'_>) -> Vec<u32> {
    let face_edges = remaining.axis.incidence.face_edges();
    let mut parts_of_edge: Vec<(u32, u32)> = Vec::new();
    for part in 0..parts.len() {
        let edges = parts.faces(part).iter().flat_map(|&f| face_edges[f as usize]);
        let shared = edges.filter(|&e| parts.at_edge[e as usize].count > 1);
        parts_of_edge.extend(shared.map(|e| (e, part as u32)));
    }
    parts_of_edge.sort_unstable();
    parts_of_edge.dedup();
    let mut edges_of_part: Vec<Vec<u32>> = vec![Vec::new(); parts.len()];
    let by_edge: Vec<&[(u32, u32)]> = parts_of_edge.chunk_by(|a, b| a.0 == b.0).collect();
    for (edge, of_edge) in by_edge.iter().enumerate() {
        of_edge.iter().for_each(|&(_, part)| edges_of_part[part as usize].push(edge as u32));
    }
    let mut level: Vec<u32> = parts.free.iter().map(|&free| u32::from(free)).collect();
    let mut queue: VecDeque<usize> = (0..parts.len()).filter(|&p| parts.free[p]).collect();
    let mut crossed = vec![false; by_edge.len()];
    while let Some(part) = queue.pop_front() {
        for &edge in &edges_of_part[part] {
            if std::mem::replace(&mut crossed[edge as usize], true) {
                continue;
            }
            for &(_, other) in by_edge[edge as usize] {
                if level[other as usize] == 0 {
                    level[other as usize] = level[part] + 1;
                    queue.push_back(other as usize);
                }
            }
        }
    }
    level
}
