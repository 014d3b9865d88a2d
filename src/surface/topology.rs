//! Adjacency of a triangle mesh, without coordinates.
//!
//! Half-edge `3 f + k` runs from corner `k` of face `f` to the next corner. Two half-edges between
//! the same vertices are neighbours if no third one is; they agree on the orientation if they run
//! in opposite directions.

use crate::geometry::DisjointSets;

/// Adjacency, defects and components of a triangle mesh, whatever its defects.
#[derive(Debug)]
pub(super) struct Topology {
    /// The half-edge across each half-edge, or [`NONE`] where there is none or more than one.
    across: Vec<u32>,
    /// Number of undirected edges.
    pub edges: usize,
    pub boundary_edges: usize,
    pub first_boundary: Option<[u32; 2]>,
    pub nonmanifold_edges: usize,
    /// The first edge with more than two faces, and their number.
    pub first_nonmanifold: Option<([u32; 2], usize)>,
    /// Vertices with more than one fan of faces.
    pub nonmanifold_vertices: usize,
    pub first_nonmanifold_vertex: Option<u32>,
    /// A face that disagrees with a neighbour about the orientation.
    pub first_inconsistent: Option<u32>,
    /// Component of each face; components are numbered by their first face.
    pub component: Vec<u32>,
    /// First face of each component.
    pub first_face: Vec<u32>,
}

/// No half-edge.
const NONE: u32 = u32::MAX;

impl Topology {
    /// Analyses faces whose three corners differ. `O(F log F)`.
    pub fn new(vertices: usize, faces: &[[u32; 3]]) -> Self {
        let mut topology = Self {
            across: vec![NONE; 3 * faces.len()],
            edges: 0,
            boundary_edges: 0,
            first_boundary: None,
            nonmanifold_edges: 0,
            first_nonmanifold: None,
            nonmanifold_vertices: 0,
            first_nonmanifold_vertex: None,
            first_inconsistent: None,
            component: Vec::new(),
            first_face: Vec::new(),
        };
        let mut fans = DisjointSets::singletons(3 * faces.len());
        let mut parts = DisjointSets::singletons(faces.len());
        topology.pair_half_edges(faces, &mut fans, &mut parts);
        topology.count_fans(vertices, faces, &mut fans);
        topology.number_components(faces.len(), &mut parts);
        topology
    }

    /// Whether no edge has more than two faces, and every vertex has one fan of them.
    pub fn is_manifold(&self) -> bool {
        self.nonmanifold_edges == 0 && self.nonmanifold_vertices == 0
    }

    fn pair_half_edges(
        &mut self,
        faces: &[[u32; 3]],
        fans: &mut DisjointSets,
        parts: &mut DisjointSets,
    ) {
        let mut sides: Vec<(u32, u32, u32)> = (0..3 * faces.len() as u32)
            .map(|h| {
                let (a, b) = ends(faces, h);
                (a.min(b), a.max(b), h)
            })
            .collect();
        sides.sort_unstable();
        for group in sides.chunk_by(|s, t| (s.0, s.1) == (t.0, t.1)) {
            let edge = [group[0].0, group[0].1];
            self.edges += 1;
            match *group {
                [_] => {
                    self.boundary_edges += 1;
                    self.first_boundary.get_or_insert(edge);
                }
                [(.., g), (.., h)] => {
                    self.across[g as usize] = h;
                    self.across[h as usize] = g;
                    if ends(faces, g) == ends(faces, h) {
                        self.first_inconsistent.get_or_insert(g / 3);
                    }
                }
                _ => {
                    self.nonmanifold_edges += 1;
                    self.first_nonmanifold.get_or_insert((edge, group.len()));
                }
            }
            // Faces around a non-manifold edge count as one fan: the edge is reported, not its ends.
            for pair in group.windows(2) {
                let (g, h) = (pair[0].2, pair[1].2);
                parts.join(g / 3, h / 3);
                for vertex in edge {
                    fans.join(corner_at(faces, g, vertex), corner_at(faces, h, vertex));
                }
            }
        }
    }

    fn count_fans(&mut self, vertices: usize, faces: &[[u32; 3]], fans: &mut DisjointSets) {
        const SEVERAL: u32 = u32::MAX - 1;
        let mut fan_of = vec![NONE; vertices];
        for (corner, &vertex) in faces.as_flattened().iter().enumerate() {
            let fan = fans.find(corner as u32);
            let known = &mut fan_of[vertex as usize];
            if *known == NONE {
                *known = fan;
            } else if *known != fan {
                *known = SEVERAL;
            }
        }
        self.nonmanifold_vertices = fan_of.iter().filter(|&&fan| fan == SEVERAL).count();
        let first = fan_of.iter().position(|&fan| fan == SEVERAL);
        self.first_nonmanifold_vertex = first.map(|v| v as u32);
    }

    fn number_components(&mut self, faces: usize, parts: &mut DisjointSets) {
        let mut number = vec![NONE; faces];
        for face in 0..faces as u32 {
            let root = parts.find(face) as usize;
            if number[root] == NONE {
                number[root] = self.first_face.len() as u32;
                self.first_face.push(face);
            }
            self.component.push(number[root]);
        }
    }

    /// For each face whether it has to be turned over so that all agree with the first face of
    /// their component, or a face where that is impossible.
    pub fn turns(&self, faces: &[[u32; 3]]) -> Result<Vec<bool>, u32> {
        let mut turned: Vec<Option<bool>> = vec![None; faces.len()];
        let mut stack = Vec::new();
        for seed in 0..faces.len() as u32 {
            if turned[seed as usize].is_none() {
                turned[seed as usize] = Some(false);
                stack.push(seed);
            }
            while let Some(face) = stack.pop() {
                let own = turned[face as usize] == Some(true);
                for side in 3 * face..3 * face + 3 {
                    let across = self.across[side as usize];
                    if across == NONE {
                        continue;
                    }
                    let same_direction = ends(faces, side) == ends(faces, across);
                    let wanted = own ^ same_direction;
                    match &mut turned[across as usize / 3] {
                        Some(known) if *known != wanted => return Err(face),
                        Some(_) => {}
                        unknown => {
                            *unknown = Some(wanted);
                            stack.push(across / 3);
                        }
                    }
                }
            }
        }
        Ok(turned.into_iter().map(|t| t == Some(true)).collect())
    }
}

/// Start and end of a half-edge.
fn ends(faces: &[[u32; 3]], half_edge: u32) -> (u32, u32) {
    let face = faces[half_edge as usize / 3];
    let k = half_edge as usize % 3;
    (face[k], face[(k + 1) % 3])
}

/// The corner of the half-edge's face that lies at one of its ends.
fn corner_at(faces: &[[u32; 3]], half_edge: u32, vertex: u32) -> u32 {
    let start = ends(faces, half_edge).0 == vertex;
    let (face, k) = (half_edge / 3, half_edge % 3);
    if start { half_edge } else { 3 * face + (k + 1) % 3 }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TETRAHEDRON: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

    #[test]
    fn closed_open_and_doubled() {
        let closed = Topology::new(4, &TETRAHEDRON);
        assert!(closed.is_manifold() && closed.first_inconsistent.is_none());
        assert_eq!(closed.boundary_edges, 0);
        assert_eq!((closed.edges, closed.first_face.len()), (6, 1));
        let open = Topology::new(4, &TETRAHEDRON[..3]);
        assert_eq!((open.boundary_edges, open.first_boundary), (3, Some([1, 2])));
        assert!(open.is_manifold());
        let mut doubled = TETRAHEDRON.to_vec();
        doubled.push([0, 1, 4]);
        let fin = Topology::new(5, &doubled);
        assert_eq!((fin.nonmanifold_edges, fin.first_nonmanifold), (1, Some(([0, 1], 3))));
        assert_eq!(fin.nonmanifold_vertices, 0);
    }

    #[test]
    fn two_tetrahedra_at_a_vertex_have_two_fans_there() {
        let shifted = TETRAHEDRON.map(|f| f.map(|v| if v == 0 { 0 } else { v + 3 }));
        let faces = [TETRAHEDRON, shifted].concat();
        let topology = Topology::new(7, &faces);
        assert_eq!(topology.nonmanifold_vertices, 1);
        assert_eq!(topology.first_nonmanifold_vertex, Some(0));
        assert_eq!(topology.component, [0, 0, 0, 0, 1, 1, 1, 1]);
    }

    #[test]
    fn turning_finds_the_odd_face_and_the_one_sided_surface() {
        let mut faces = TETRAHEDRON;
        faces[2].swap(1, 2);
        let topology = Topology::new(4, &faces);
        assert!(topology.first_inconsistent.is_some());
        assert_eq!(topology.turns(&faces).unwrap(), [false, false, true, false]);
        // The projective plane with six vertices.
        let plane = [
            [0, 1, 2],
            [0, 2, 3],
            [0, 3, 4],
            [0, 4, 5],
            [0, 5, 1],
            [1, 2, 4],
            [2, 3, 5],
            [3, 4, 1],
            [4, 5, 2],
            [5, 1, 3],
        ];
        let topology = Topology::new(6, &plane);
        assert!(topology.is_manifold() && topology.boundary_edges == 0);
        assert_eq!(6 - topology.edges as i64 + 10, 1);
        assert!(topology.turns(&plane).is_err());
    }
}
