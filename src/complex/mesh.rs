//! The medial mesh as plain arrays: the type that methods take and return, files store, and metrics
//! read.

use std::sync::Arc;

use rayon::prelude::*;

use super::closure::{ascending_edge, ascending_face, closure};
use crate::Vec3;
use crate::geometry::Sphere;

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
pub enum ComplexError {
    /// A centre or radius is not a number, or the radius is negative.
    #[error("sphere {sphere} is not valid: centre {centre}, radius {radius}")]
    Sphere {
        /// Index of the sphere.
        sphere: usize,
        /// Its centre.
        centre: Vec3,
        /// Its radius.
        radius: f64,
    },
    /// An edge names a sphere that does not exist, or its indices do not ascend.
    #[error("edge {edge} {ends:?} is not an ascending pair of the {spheres} spheres")]
    Edge {
        /// Index of the edge.
        edge: usize,
        /// Its ends.
        ends: [u32; 2],
        /// Number of spheres.
        spheres: usize,
    },
    /// A face names a sphere that does not exist, or its indices do not ascend.
    #[error("face {face} {corners:?} is not an ascending triple of the {spheres} spheres")]
    Face {
        /// Index of the face.
        face: usize,
        /// Its corners.
        corners: [u32; 3],
        /// Number of spheres.
        spheres: usize,
    },
    /// Edges or faces are repeated or out of order.
    #[error("{what} {index} is not larger than its predecessor: repeated or unsorted")]
    Order {
        /// `"edge"` or `"face"`.
        what: &'static str,
        /// Index of the later one.
        index: usize,
    },
    /// A face lacks one of its edges.
    #[error("face {face} has the side {side:?}, which is not listed as an edge")]
    MissingEdge {
        /// Index of the face.
        face: usize,
        /// The missing pair.
        side: [u32; 2],
    },
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
        let spans = |&[a, b]: &[u32; 2]| a < b && (b as usize) < count;
        if let Some(edge) = edges.iter().position(|edge| !spans(edge)) {
            return Err(ComplexError::Edge { edge, ends: edges[edge], spheres: count });
        }
        faces.iter_mut().for_each(|face| *face = ascending_face(*face));
        let spans = |&[a, b, c]: &[u32; 3]| a < b && b < c && (c as usize) < count;
        if let Some(face) = faces.iter().position(|face| !spans(face)) {
            return Err(ComplexError::Face { face, corners: faces[face], spheres: count });
        }
        let (edges, faces) = closure(&edges, &faces, count);
        Ok(Self { spheres, edges, faces, contacts: None })
    }

    /// Verifies the canonical form and the validity of every sphere.
    ///
    /// # Errors
    /// The first violation found. Cost `O(n log n)`.
    pub fn check(&self) -> Result<(), ComplexError> {
        let spheres = self.spheres.len();
        check_spheres(&self.spheres)?;
        for (edge, &ends) in self.edges.iter().enumerate() {
            if ends[0] >= ends[1] || ends[1] as usize >= spheres {
                return Err(ComplexError::Edge { edge, ends, spheres });
            }
        }
        for (face, &corners) in self.faces.iter().enumerate() {
            let ascending = corners[0] < corners[1] && corners[1] < corners[2];
            if !ascending || corners[2] as usize >= spheres {
                return Err(ComplexError::Face { face, corners, spheres });
            }
        }
        check_order("edge", &self.edges)?;
        check_order("face", &self.faces)?;
        // Edges are sorted by now, so those of a sphere are a short run.
        let first = run_starts(&self.edges, spheres);
        let is_missing = |&[a, b]: &[u32; 2]| {
            let run = &self.edges[first[a as usize] as usize..first[a as usize + 1] as usize];
            run.binary_search_by_key(&b, |edge| edge[1]).is_err()
        };
        let missing = self.faces.par_iter().enumerate().find_map_first(|(face, corners)| {
            let side = sides(corners).into_iter().find(is_missing)?;
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
        let stray =
            contacts.of_sphere.iter().position(|ids| ids.iter().any(|&id| id as usize >= samples));
        match stray {
            Some(sphere) => Err(ComplexError::Contacts(format!(
                "sphere {sphere} touches {:?} of {samples} samples",
                contacts.of_sphere[sphere]
            ))),
            None => Ok(()),
        }
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
        let kept = |sphere: u32| keep[sphere as usize];
        let new = |sphere: u32| renumbered[sphere as usize];
        let select = |indices: &[[u32; 4]]| {
            indices.iter().zip(keep).filter(|&(_, &k)| k).map(|(&ids, _)| ids).collect()
        };
        Self {
            spheres: self.spheres.iter().zip(keep).filter(|&(_, &k)| k).map(|(&s, _)| s).collect(),
            edges: self
                .edges
                .iter()
                .filter(|e| e.iter().all(|&v| kept(v)))
                .map(|e| e.map(new))
                .collect(),
            faces: self
                .faces
                .iter()
                .filter(|f| f.iter().all(|&v| kept(v)))
                .map(|f| f.map(new))
                .collect(),
            contacts: self.contacts.as_ref().map(|c| Contacts {
                samples: Arc::clone(&c.samples),
                of_sphere: select(&c.of_sphere),
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
        let mut edges: Vec<[u32; 2]> =
            self.edges.iter().map(|e| e.map(|v| new[v as usize])).collect();
        edges.iter_mut().for_each(|e| e.sort_unstable());
        edges.sort_unstable();
        let mut faces: Vec<[u32; 3]> =
            self.faces.iter().map(|f| f.map(|v| new[v as usize])).collect();
        faces.iter_mut().for_each(|f| f.sort_unstable());
        faces.sort_unstable();
        Self {
            spheres: order.iter().map(|&v| self.spheres[v as usize]).collect(),
            edges,
            faces,
            contacts: self.contacts.as_ref().map(|c| Contacts {
                samples: Arc::clone(&c.samples),
                of_sphere: order.iter().map(|&v| c.of_sphere[v as usize]).collect(),
            }),
        }
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

/// For each sphere the number of simplices that begin at a smaller one, then the number of all.
fn run_starts<const N: usize>(simplices: &[[u32; N]], spheres: usize) -> Vec<u32> {
    let mut start = vec![0; spheres + 1];
    for simplex in simplices {
        start[simplex[0] as usize + 1] += 1;
    }
    for sphere in 0..spheres {
        start[sphere + 1] += start[sphere];
    }
    start
}

fn check_spheres(spheres: &[Sphere]) -> Result<(), ComplexError> {
    let is_valid = |s: &Sphere| s.centre.is_finite() && s.radius.is_finite() && s.radius >= 0.0;
    match spheres.iter().position(|s| !is_valid(s)) {
        Some(sphere) => {
            let Sphere { centre, radius } = spheres[sphere];
            Err(ComplexError::Sphere { sphere, centre, radius })
        }
        None => Ok(()),
    }
}

fn check_order<T: Ord>(what: &'static str, simplices: &[T]) -> Result<(), ComplexError> {
    match simplices.windows(2).position(|pair| pair[0] >= pair[1]) {
        Some(index) => Err(ComplexError::Order { what, index: index + 1 }),
        None => Ok(()),
    }
}
