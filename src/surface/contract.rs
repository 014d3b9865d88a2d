//! Contracts short edges of a closed manifold without changing its topology.
//!
//! T. K. Dey, H. Edelsbrunner, S. Guha, D. V. Nekhayev: *Topology preserving edge contraction*,
//! Publications de l'Institut Mathematique 66 (1999): on a 2-manifold an edge `ab` may be contracted
//! if and only if the intersection of `Lk a` and `Lk b` is `Lk ab`. That is: the only common neighbours
//! of `a` and `b` are the two corners opposite to the edge, and the component is not a tetrahedron.
//!
//! 1. Shortest edge first (ties: smaller vertex ids). Either `a` moves to `b` or `b` to `a`: the way
//!    in which the vertices contracted so far move less. The other vertex stays in place.
//! 2. An edge is contracted only if no vertex ends up farther than its limit from where it started.
//! 3. Edges that the link condition rejected are tried again, until nothing changes.
//! 4. A component with all edges below their limits shrinks to a tetrahedron, which is dropped.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::mesh::TriMesh;
use crate::Vec3;
use crate::geometry::PowerCrust;

/// The result of contracting the short edges of a surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Contraction {
    /// The surface, without the vertices and faces that disappeared.
    pub mesh: TriMesh,
    /// Edges contracted.
    pub contracted: usize,
    /// Components that shrank to nothing.
    pub dropped: usize,
}

/// Whether an edge may be contracted if faces fold over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Folds {
    /// Faces may turn over: for limits at the level of rounding, where normals mean nothing.
    Ignored,
    /// No face with an area may turn by 60 degrees or more.
    Refused,
}

/// Contracts the edges of a closed manifold that are shorter than the limits of both ends.
///
/// `limits` has one length for each vertex, in the unit of the mesh. No vertex moves farther than its
/// limit, so the surface moves no farther than the largest; it stays closed and manifold with the same
/// genus. Components that are smaller than the limits disappear. Serial; `O(F log F)`.
///
/// ```
/// use medial::Vec3;
/// use medial::surface::{Folds, TriMesh, contract_short_edges};
///
/// // A double pyramid with a corner split in two.
/// let split = TriMesh {
///     vertices: vec![Vec3::Z, -Vec3::Z, Vec3::X, Vec3::Y, -Vec3::X, -Vec3::X - 1e-9 * Vec3::Y],
///     faces: vec![
///         [0, 2, 3], [0, 3, 4], [0, 4, 5], [0, 5, 2],
///         [1, 3, 2], [1, 4, 3], [1, 5, 4], [1, 2, 5],
///     ],
/// };
/// let whole = contract_short_edges(&split, &[1e-6; 6], Folds::Ignored);
/// assert_eq!((whole.mesh.vertices.len(), whole.mesh.faces.len()), (5, 6));
/// ```
///
/// # Panics
/// If there are fewer limits than vertices, or a face names a vertex that does not exist.
pub fn contract_short_edges(mesh: &TriMesh, limits: &[f64], folds: Folds) -> Contraction {
    let mut surface = Shrinking::new(mesh, limits, folds);
    let mut queue: BinaryHeap<_> = surface.short_edges().collect();
    let mut contracted = 0;
    loop {
        // Collected for the next round: a contraction nearby may make the link condition hold.
        let mut refused = Vec::new();
        let before = contracted;
        while let Some(Reverse(edge)) = queue.pop() {
            let (_, a, b) = edge;
            if !surface.is_edge(a, b) {
                continue;
            }
            match surface.contract(a, b) {
                Some(survivor) => {
                    contracted += 1;
                    queue.extend(surface.short_edges_at(survivor));
                }
                None => refused.push(edge),
            }
        }
        // An edge can be queued more than once, by each contraction next to it.
        refused.sort_unstable();
        refused.dedup();
        refused.retain(|&(_, a, b)| surface.is_edge(a, b));
        if contracted == before {
            let dropped = surface.drop_specks();
            return Contraction { mesh: surface.finish(), contracted, dropped };
        }
        queue = refused.into_iter().map(Reverse).collect();
    }
}

/// Length as an integer in the same order, and both ends, ascending.
type ShortEdge = (u64, u32, u32);

/// The cosine of the largest angle by which a face may turn.
const MIN_COSINE: f64 = 0.5;

/// A surface while its edges are contracted.
struct Shrinking<'a> {
    points: &'a [Vec3],
    limits: &'a [f64],
    folds: Folds,
    faces: Vec<[u32; 3]>,
    /// The faces of each vertex, none where it is gone.
    stars: Vec<Vec<u32>>,
    /// For each vertex a bound on the distance of all vertices that were contracted into it.
    reach: Vec<f64>,
}

impl<'a> Shrinking<'a> {
    fn new(mesh: &'a TriMesh, limits: &'a [f64], folds: Folds) -> Self {
        let count = mesh.vertices.len();
        assert!(limits.len() >= count, "{count} vertices, but {} limits", limits.len());
        let mut stars = vec![Vec::new(); count];
        for (f, face) in (0..).zip(&mesh.faces) {
            for &v in face {
                stars[v as usize].push(f);
            }
        }
        let (points, faces) = (&mesh.vertices[..], mesh.faces.clone());
        Self { points, limits, folds, faces, stars, reach: vec![0.0; count] }
    }

    fn point(&self, v: u32) -> Vec3 {
        self.points[v as usize]
    }

    fn short_edge(&self, a: u32, b: u32) -> Option<Reverse<ShortEdge>> {
        let length = self.point(a).distance(self.point(b));
        let limit = self.limits[a as usize].min(self.limits[b as usize]);
        // As integers, the bits of non-negative numbers are in the order of the numbers.
        (length < limit).then(|| Reverse((length.to_bits(), a.min(b), a.max(b))))
    }

    fn short_edges(&self) -> impl Iterator<Item = Reverse<ShortEdge>> + '_ {
        let sides = self.faces.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
        // Both faces of an edge have it, in opposite directions.
        sides.filter(|(a, b)| a < b).filter_map(|(a, b)| self.short_edge(a, b))
    }

    fn short_edges_at(&self, v: u32) -> impl Iterator<Item = Reverse<ShortEdge>> + '_ {
        self.neighbours(v).into_iter().filter_map(move |w| self.short_edge(v, w))
    }

    /// The neighbours of a vertex, ascending.
    fn neighbours(&self, v: u32) -> Vec<u32> {
        let star = self.stars[v as usize].iter();
        let mut all: Vec<u32> =
            star.flat_map(|&f| self.faces[f as usize]).filter(|&w| w != v).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    fn is_edge(&self, a: u32, b: u32) -> bool {
        self.stars[a as usize].iter().any(|&f| self.faces[f as usize].contains(&b))
    }

    /// Contracts an edge if it may be; returns the vertex that stays.
    fn contract(&mut self, a: u32, b: u32) -> Option<u32> {
        let (of_a, of_b) = (self.neighbours(a), self.neighbours(b));
        let common = of_a.iter().filter(|v| of_b.binary_search(v).is_ok()).count();
        let is_tetrahedron = of_a.len() == 3 && of_b.len() == 3;
        // The link condition for closed manifolds, see the head.
        if common != 2 || is_tetrahedron {
            return None;
        }
        let length = self.point(a).distance(self.point(b));
        let [reach_a, reach_b] = [a, b].map(|v| self.reach[v as usize]);
        // The bound covers all vertices contracted into the other end, now one edge farther away.
        let (into_a, into_b) = (reach_a.max(reach_b + length), reach_b.max(reach_a + length));
        let mut ways = [(into_a, b, a), (into_b, a, b)];
        if into_b < into_a || (into_b == into_a && b < a) {
            ways.reverse();
        }
        let limit = self.limits[a as usize].min(self.limits[b as usize]);
        let (reach, gone, stays) = ways
            .into_iter()
            .find(|&(reach, gone, stays)| reach <= limit && !self.folds_over(gone, stays))?;
        self.reach[stays as usize] = reach;
        self.remove(gone, stays);
        Some(stays)
    }

    /// Whether some face turns too far when a vertex is moved to another.
    fn folds_over(&self, gone: u32, stays: u32) -> bool {
        self.folds == Folds::Refused
            && self.stars[gone as usize].iter().any(|&f| {
                let face = self.faces[f as usize];
                if face.contains(&stays) {
                    return false;
                }
                let before = self.doubled_area(face);
                let after = self.doubled_area(face.map(|v| if v == gone { stays } else { v }));
                before.dot(after) < MIN_COSINE * before.length() * after.length()
            })
    }

    fn doubled_area(&self, face: [u32; 3]) -> Vec3 {
        let [p, q, r] = face.map(|v| self.point(v));
        (q - p).cross(r - p)
    }

    fn remove(&mut self, gone: u32, stays: u32) {
        for f in std::mem::take(&mut self.stars[gone as usize]) {
            let face = self.faces[f as usize];
            if face.contains(&stays) {
                for v in face.into_iter().filter(|&v| v != gone) {
                    self.stars[v as usize].retain(|&g| g != f);
                }
            } else {
                self.faces[f as usize] = face.map(|v| if v == gone { stays } else { v });
                self.stars[stays as usize].push(f);
            }
        }
    }

    /// Step 4: removes tetrahedra all of whose edges are short; returns how many.
    fn drop_specks(&mut self) -> usize {
        let mut dropped = 0;
        for v in 0..self.stars.len() as u32 {
            let others = self.neighbours(v);
            if others.len() != 3 || others.iter().any(|&w| self.stars[w as usize].len() != 3) {
                continue;
            }
            let corners = [v, others[0], others[1], others[2]];
            let mut pairs = (0..4).flat_map(|j| (0..j).map(move |i| [corners[i], corners[j]]));
            if pairs.all(|[a, b]| self.short_edge(a, b).is_some()) {
                corners.into_iter().for_each(|c| self.stars[c as usize].clear());
                dropped += 1;
            }
        }
        dropped
    }

    /// The remaining mesh, vertices and faces in their old order.
    fn finish(self) -> TriMesh {
        let mut name = vec![u32::MAX; self.points.len()];
        let mut vertices = Vec::new();
        for (v, star) in self.stars.iter().enumerate().filter(|(_, star)| !star.is_empty()) {
            name[v] = vertices.len() as u32;
            vertices.push(self.points[v]);
            debug_assert!(star.len() > 2, "a closed manifold");
        }
        let faces = (0..).zip(&self.faces);
        // A face that is gone has left the stars of all its corners.
        let alive = faces.filter(|(f, face)| self.stars[face[0] as usize].contains(f));
        let faces = alive.map(|(_, face)| face.map(|v| name[v as usize])).collect();
        TriMesh { vertices, faces }
    }
}

// The power crust as a surface.

impl From<&PowerCrust> for TriMesh {
    /// The crust as triangles, on all of its corners.
    fn from(crust: &PowerCrust) -> Self {
        Self { vertices: crust.corners().to_vec(), faces: crust.triangles() }
    }
}

/// A power crust as triangles, with corners at one position merged along the edges between them.
///
/// Corners nearer than `coincident`, in the unit of the balls, are at one position; above the level of
/// rounding, which flat groups of balls amplify to some 1e-8 of the diagonal, any value well below
/// the distance of samples will do. `O(n log n)`.
pub fn crust_surface(crust: &PowerCrust, coincident: f64) -> Contraction {
    let limits = vec![coincident; crust.corners().len()];
    contract_short_edges(&crust.into(), &limits, Folds::Ignored)
}
