//! The medial mesh as plain arrays: the type that methods take and return, files store, and metrics
//! read.

use std::ops::{ControlFlow, Range};
use std::sync::Arc;

use rayon::prelude::*;

use crate::Vec3;
use crate::geometry::planar_frame::power_of_two_below;
use crate::geometry::{Sphere, TriangleTree, triangles_cross};
use crate::surface::Normalisation;

/// The boundary samples that each sphere touches, from the triangulation that it was made of.
#[derive(Clone, Debug, PartialEq)]
pub struct Contacts {
    /// The boundary samples, in the unit of the spheres.
    pub samples: Arc<[Vec3]>,
    /// For each sphere the four samples of its Delaunay tetrahedron.
    pub of_sphere: Vec<[u32; 4]>,
}

/// A simplicial complex of dimension at most two on medial spheres.
///
/// Generally non-manifold and possibly disconnected. Spheres without edges and edges without
/// faces are ordinary members: a sampled ball simplifies to one sphere, a tube to a chain of edges.
///
/// Canonical form, held by every mesh that [`MedialMesh::check`] accepts: the indices of an edge
/// and of a face ascend, edges and faces are sorted lexicographically without repetition, and the
/// three edges of every face are listed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MedialMesh {
    /// Medial spheres, the vertices of the complex.
    pub spheres: Vec<Sphere>,
    /// Pairs of sphere indices.
    pub edges: Vec<[u32; 2]>,
    /// Triples of sphere indices.
    pub faces: Vec<[u32; 3]>,
    /// Contact points, if known.
    pub contacts: Option<Contacts>,
}

/// The first violation that [`MedialMesh::check`] found.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the messages name the fields")]
pub enum ComplexError {
    /// A centre or radius is not a number, or the radius is negative.
    #[error("sphere {sphere} is not valid: centre {centre}, radius {radius}")]
    Sphere { sphere: usize, centre: Vec3, radius: f64 },
    /// An edge names a sphere that does not exist, or its indices do not ascend.
    #[error("edge {edge} {ends:?} is not an ascending pair of the {spheres} spheres")]
    Edge { edge: usize, ends: [u32; 2], spheres: usize },
    /// A face names a sphere that does not exist, or its indices do not ascend.
    #[error("face {face} {corners:?} is not an ascending triple of the {spheres} spheres")]
    Face { face: usize, corners: [u32; 3], spheres: usize },
    /// Edges or faces are repeated or out of order.
    #[error("{what} {index} is not larger than its predecessor: repeated or unsorted")]
    Order { what: &'static str, index: usize },
    /// A face lacks one of its edges.
    #[error("face {face} has the side {side:?}, which is not listed as an edge")]
    MissingEdge { face: usize, side: [u32; 2] },
    /// The contacts do not fit the spheres.
    #[error("contacts: {0}")]
    Contacts(String),
}

impl MedialMesh {
    /// A complex from spheres, edges and faces in any order and orientation: indices are sorted,
    /// repetitions dropped, and the sides of every face added as edges.
    ///
    /// # Errors
    /// When an index is out of range, an edge or face repeats a sphere, or a sphere is not valid.
    pub fn from_simplices(
        spheres: Vec<Sphere>,
        mut edges: Vec<[u32; 2]>,
        mut faces: Vec<[u32; 3]>,
    ) -> Result<Self, ComplexError> {
        check_spheres(&spheres)?;
        let count = spheres.len();
        edges.iter_mut().for_each(|edge| *edge = ascending_edge(*edge));
        faces.iter_mut().for_each(|face| *face = ascending_face(*face));
        check_indices(&edges, &faces, count)?;
        let (edges, faces) = closure(&edges, &faces, count);
        Ok(Self { spheres, edges, faces, contacts: None })
    }

    /// The spheres of an edge or a face.
    #[inline]
    pub fn spheres_of<const N: usize>(&self, simplex: [u32; N]) -> [Sphere; N] {
        simplex.map(|v| self.spheres[v as usize])
    }

    /// The spheres without edges and faces.
    pub fn spheres_alone(&self) -> Self {
        Self { edges: Vec::new(), faces: Vec::new(), ..self.clone() }
    }

    /// Edges without a face, in their order: for formats whose faces imply their sides.
    pub(crate) fn lone_edges(&self) -> Vec<[u32; 2]> {
        let incidence = Incidence::of(self);
        let lone = self.edges.iter().zip(incidence.faces_at()).filter(|&(_, &faces)| faces == 0);
        lone.map(|(&edge, _)| edge).collect()
    }

    /// Spheres without an edge, ascending.
    pub(crate) fn isolated(&self) -> Vec<u32> {
        let mut has_edge = vec![false; self.spheres.len()];
        self.edges.iter().flatten().for_each(|&v| has_edge[v as usize] = true);
        (0..).zip(has_edge).filter(|&(_, has)| !has).map(|(v, _)| v).collect()
    }

    /// Verifies the canonical form and the validity of every sphere.
    ///
    /// # Errors
    /// The first violation found. Cost `O(n log n)`.
    pub fn check(&self) -> Result<(), ComplexError> {
        let spheres = self.spheres.len();
        check_spheres(&self.spheres)?;
        check_indices(&self.edges, &self.faces, spheres)?;
        check_order("edge", &self.edges)?;
        check_order("face", &self.faces)?;
        // Edges are sorted by now, so those of a sphere are a short run.
        let first = run_starts(self.edges.iter().map(|edge| edge[0]), spheres);
        let missing = self.faces.par_iter().enumerate().find_map_first(|(face, corners)| {
            let mut sides = sides(corners).into_iter();
            let side = sides.find(|&side| edge_id(&self.edges, &first, side).is_none())?;
            Some(ComplexError::MissingEdge { face, side })
        });
        if let Some(missing) = missing {
            return Err(missing);
        }
        self.check_contacts()
    }

    fn check_contacts(&self) -> Result<(), ComplexError> {
        let Some(contacts) = &self.contacts else {
            return Ok(());
        };
        if contacts.of_sphere.len() != self.spheres.len() {
            return Err(ComplexError::Contacts(format!(
                "{} entries for {} spheres",
                contacts.of_sphere.len(),
                self.spheres.len()
            )));
        }
        let samples = contacts.samples.len();
        for (sphere, ids) in contacts.of_sphere.iter().enumerate() {
            if ids.iter().any(|&id| id as usize >= samples) {
                let why = format!("sphere {sphere} touches {ids:?} of {samples} samples");
                return Err(ComplexError::Contacts(why));
            }
        }
        Ok(())
    }

    /// The subcomplex induced by the spheres with `keep[i]`: they, and the edges and faces all of
    /// whose spheres are kept. Contacts follow. The order of the spheres is unchanged.
    ///
    /// # Panics
    /// If `keep` is not as long as the list of spheres.
    pub fn induced(&self, keep: &[bool]) -> Self {
        assert_eq!(keep.len(), self.spheres.len(), "one flag for each sphere");
        let mut renumbered = vec![u32::MAX; keep.len()];
        for (new, old) in (0..keep.len()).filter(|&sphere| keep[sphere]).enumerate() {
            renumbered[old] = new as u32;
        }
        // Renumbering keeps the order, so the result is in canonical form without sorting.
        fn select<T: Copy>(list: &[T], keep: &[bool]) -> Vec<T> {
            list.iter().zip(keep).filter(|&(_, &k)| k).map(|(&item, _)| item).collect()
        }
        fn induced<const N: usize>(simplices: &[[u32; N]], renumbered: &[u32]) -> Vec<[u32; N]> {
            let all = simplices.iter().map(|s| s.map(|v| renumbered[v as usize]));
            all.filter(|s| !s.contains(&u32::MAX)).collect()
        }
        Self {
            spheres: select(&self.spheres, keep),
            edges: induced(&self.edges, &renumbered),
            faces: induced(&self.faces, &renumbered),
            contacts: self.contacts.as_ref().map(|c| Contacts {
                samples: Arc::clone(&c.samples),
                of_sphere: select(&c.of_sphere, keep),
            }),
        }
    }

    /// The same complex with its spheres in another order: first sphere `order[0]`, and so on.
    ///
    /// # Panics
    /// When `order` does not name every sphere, or names more.
    pub fn renumbered(&self, order: &[u32]) -> Self {
        assert_eq!(order.len(), self.spheres.len(), "an order of all spheres");
        let mut new = vec![0; order.len()];
        for (to, &from) in (0..).zip(order) {
            new[from as usize] = to;
        }
        fn carried<const N: usize>(simplices: &[[u32; N]], new: &[u32]) -> Vec<[u32; N]> {
            let mut carried: Vec<_> =
                simplices.iter().map(|s| s.map(|v| new[v as usize])).collect();
            // The new numbers need not ascend, but the canonical form does.
            carried.iter_mut().for_each(|s| s.sort_unstable());
            carried.sort_unstable();
            carried
        }
        Self {
            spheres: order.iter().map(|&v| self.spheres[v as usize]).collect(),
            edges: carried(&self.edges, &new),
            faces: carried(&self.faces, &new),
            contacts: self.contacts.as_ref().map(|c| Contacts {
                samples: Arc::clone(&c.samples),
                of_sphere: order.iter().map(|&v| c.of_sphere[v as usize]).collect(),
            }),
        }
    }

    /// The power of two below the largest coordinate or radius, by which scaling is exact; 1 where that is zero or
    /// subnormal.
    pub fn unit(&self) -> f64 {
        let sizes = self.spheres.iter().map(|m| m.centre.abs().max_element().max(m.radius));
        power_of_two_below(sizes.fold(0.0, f64::max))
    }

    /// A mesh in input units, in those of the normalised surface.
    pub fn to_normal(&self, units: &Normalisation) -> Self {
        self.transformed(1.0 / units.diagonal, |p| units.forward(p))
    }

    /// A mesh in units of the normalised surface, in input units.
    pub fn to_input(&self, units: &Normalisation) -> Self {
        self.transformed(units.diagonal, |p| units.backward(p))
    }

    /// The mesh with every sphere (and contact sample) carried through `map`, a similarity that
    /// multiplies lengths by `scale`.
    pub fn transformed(&self, scale: f64, map: impl Fn(Vec3) -> Vec3) -> Self {
        Self {
            spheres: self
                .spheres
                .iter()
                .map(|s| Sphere::new(map(s.centre), s.radius * scale))
                .collect(),
            edges: self.edges.clone(),
            faces: self.faces.clone(),
            contacts: self.contacts.as_ref().map(|c| Contacts {
                samples: c.samples.iter().map(|&p| map(p)).collect(),
                of_sphere: c.of_sphere.clone(),
            }),
        }
    }
}

/// The sides of an ascending face, as ascending pairs.
fn sides(face: &[u32; 3]) -> [[u32; 2]; 3] {
    let [a, b, c] = *face;
    [[a, b], [a, c], [b, c]]
}

/// Where the run of each id below `count` starts in a list that is sorted by ids: the number of smaller
/// ones, then the number of all.
pub(super) fn run_starts(ids: impl Iterator<Item = u32>, count: usize) -> Vec<u32> {
    let mut start = vec![0; count + 1];
    for id in ids {
        start[id as usize + 1] += 1;
    }
    for id in 0..count {
        start[id + 1] += start[id];
    }
    start
}

/// The place of an ascending pair in sorted edges, whose runs begin at `first` ([`run_starts`]).
#[inline]
fn edge_id(edges: &[[u32; 2]], first: &[u32], [a, b]: [u32; 2]) -> Option<u32> {
    let (from, to) = (first[a as usize], first[a as usize + 1]);
    let run = &edges[from as usize..to as usize];
    let place = run.binary_search_by_key(&b, |edge| edge[1]).ok()?;
    Some(from + place as u32)
}

fn check_spheres(spheres: &[Sphere]) -> Result<(), ComplexError> {
    for (sphere, &Sphere { centre, radius }) in spheres.iter().enumerate() {
        if !(centre.is_finite() && radius.is_finite() && radius >= 0.0) {
            return Err(ComplexError::Sphere { sphere, centre, radius });
        }
    }
    Ok(())
}

fn check_indices(
    edges: &[[u32; 2]],
    faces: &[[u32; 3]],
    spheres: usize,
) -> Result<(), ComplexError> {
    for (edge, &ends) in edges.iter().enumerate() {
        if ends[0] >= ends[1] || ends[1] as usize >= spheres {
            return Err(ComplexError::Edge { edge, ends, spheres });
        }
    }
    for (face, &corners) in faces.iter().enumerate() {
        let ascending = corners[0] < corners[1] && corners[1] < corners[2];
        if !ascending || corners[2] as usize >= spheres {
            return Err(ComplexError::Face { face, corners, spheres });
        }
    }
    Ok(())
}

fn check_order<T: Ord>(what: &'static str, simplices: &[T]) -> Result<(), ComplexError> {
    match simplices.windows(2).position(|pair| pair[0] >= pair[1]) {
        Some(index) => Err(ComplexError::Order { what, index: index + 1 }),
        None => Ok(()),
    }
}

// Incidence of edges and faces: the combinatorics of a medial mesh, without coordinates.

/// The edges of every face and the number of faces at every edge.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Incidence {
    face_edges: Vec<[u32; 3]>,
    faces_at: Vec<u32>,
}

impl Incidence {
    /// The incidences of a mesh in canonical form. Cost `O(V + E + F log d)`, `d` the largest
    /// number of edges at a sphere.
    ///
    /// # Panics
    /// If a side of a face is not listed as an edge; see [`MedialMesh::check`].
    pub fn of(mesh: &MedialMesh) -> Self {
        let first = run_starts(mesh.edges.iter().map(|edge| edge[0]), mesh.spheres.len());
        let face_edges: Vec<[u32; 3]> = mesh
            .faces
            .iter()
            .map(|face| {
                sides(face).map(|side| {
                    edge_id(&mesh.edges, &first, side)
                        .expect("every side of a face is an edge in canonical form")
                })
            })
            .collect();
        let mut faces_at = vec![0; mesh.edges.len()];
        for &edge in face_edges.iter().flatten() {
            faces_at[edge as usize] += 1;
        }
        Self { face_edges, faces_at }
    }

    /// For each face `[a, b, c]` the ids of its edges `ab`, `ac`, `bc`.
    pub fn face_edges(&self) -> &[[u32; 3]] {
        &self.face_edges
    }

    /// For each edge the number of its faces.
    pub fn faces_at(&self) -> &[u32] {
        &self.faces_at
    }
}

// The canonical lists of a complex from simplices in any order.
//
// 1. Simplices are counted into runs by their smallest sphere.
// 2. The run of a sphere is sorted, and repetitions are dropped: these are its faces.
// 3. Its edges are those to the other spheres of its faces, those to the largest sphere of faces in
//    which it is the middle one, and those that were given; again sorted, each once.
//
// Linear where few simplices begin at the same sphere.

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

// Faces of a medial mesh that cross: pairs of which an edge of one passes through the other.
//
// The medial axis of a solid has none; that of samples has a few where sheets are thinner than the samples
// are apart; collapses and moves of spheres make more. Of the centres alone: radii play no part.
// The axis of a plate or a tube has many faces in one plane or on one line, up to rounding. These do not count.

/// How far both ends of an edge are at least from a face that it crosses, in normalised units.
const CROSSING: f64 = 1e-6;

/// Whether two faces of a medial mesh in normalised units cross.
pub fn faces_cross(s: [Vec3; 3], t: [Vec3; 3]) -> bool {
    triangles_cross(s, t, CROSSING)
}

/// The pairs of faces that cross, ascending. Faces of nearly no area are not looked at.
///
/// Cost `O(F log F)` and the pairs whose boxes overlap.
///
/// # Panics
/// If a face is out of range; see [`MedialMesh::check`].
pub fn crossing_faces(mesh: &MedialMesh) -> Vec<[u32; 2]> {
    Crossings::new(mesh.faces.len(), |face| {
        mesh.faces[face as usize].map(|v| mesh.spheres[v as usize].centre)
    })
    .pairs()
}

/// Faces in a tree, for the pairs that cross.
#[derive(Clone, Debug)]
pub struct Crossings {
    tree: TriangleTree,
}

impl Crossings {
    /// So many faces, with the corners `corners(face)`.
    pub fn new(faces: usize, corners: impl Fn(u32) -> [Vec3; 3]) -> Self {
        Self { tree: TriangleTree::new(0..faces as u32, corners) }
    }

    /// The faces that cross one with these corners, ascending. It need not be one of them.
    pub fn of(&self, corners: [Vec3; 3]) -> Vec<u32> {
        self.among(corners, |_| true)
    }

    /// All pairs that cross, ascending.
    pub fn pairs(&self) -> Vec<[u32; 2]> {
        self.pairs_with(|_| true)
    }

    /// The pairs that cross and have a face for which `is_asked` holds, ascending.
    pub fn pairs_with(&self, is_asked: impl Fn(u32) -> bool + Sync) -> Vec<[u32; 2]> {
        let mut pairs: Vec<[u32; 2]> = (0..self.tree.len())
            .into_par_iter()
            .map(|place| self.tree.at(place))
            .filter(|&(face, _)| is_asked(face))
            .flat_map_iter(|(face, corners)| {
                // Each pair once, and no face with itself: of two requested faces the smaller finds it.
                let others =
                    self.among(corners, |other| other > face || (other < face && !is_asked(other)));
                others.into_iter().map(move |other| ascending_edge([face, other]))
            })
            .collect();
        pairs.sort_unstable();
        pairs
    }

    fn among(&self, corners: [Vec3; 3], is_asked: impl Fn(u32) -> bool) -> Vec<u32> {
        let mut found = vec![];
        self.tree.overlapping(corners, |other, place| {
            if is_asked(other) && faces_cross(corners, place) {
                found.push(other);
            }
            ControlFlow::Continue(())
        });
        found.sort_unstable();
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::complex::Sphere;

    #[test]
    fn a_face_through_another_crosses_it_and_neighbours_do_not() {
        let at = |x: f64, y: f64, z: f64| Sphere::new(Vec3::new(x, y, z), 0.1);
        let spheres = vec![
            at(0.0, 0.0, 0.0),
            at(1.0, 0.0, 0.0),
            at(0.0, 1.0, 0.0),
            at(1.0, 1.0, 0.0),
            at(0.2, 0.2, -1.0),
            at(0.3, 0.2, 1.0),
            at(0.2, 0.3, 1.0),
        ];
        let faces = vec![[0, 1, 2], [1, 2, 3], [4, 5, 6], [0, 5, 6]];
        let mesh = MedialMesh::from_simplices(spheres, vec![], faces).unwrap();
        let pair = |f: [u32; 3], g: [u32; 3]| {
            let place = |f| mesh.faces.iter().position(|&x| x == f).unwrap() as u32;
            let [a, b] = [place(f), place(g)];
            [a.min(b), a.max(b)]
        };
        assert_eq!(crossing_faces(&mesh), vec![pair([0, 1, 2], [4, 5, 6])]);
        // In one plane up to rounding, although an edge passes through the other face.
        let mut flat = mesh.clone();
        for (sphere, z) in flat.spheres.iter_mut().zip([0.0, 0.0, 0.0, 0.0, -1e-12, 1e-12, 1e-12]) {
            sphere.centre.z = z;
        }
        assert!(crossing_faces(&flat).is_empty());
    }
}
