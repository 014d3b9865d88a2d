//! The invariants of a complex under collapse.

use super::CollapseComplex;

/// The first violation that [`CollapseComplex::check`] found.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CollapseError {
    /// A vertex names a neighbour that is gone, is the vertex itself, or does not name it back.
    #[error("vertex {vertex} names {neighbour} as a neighbour, which is gone or does not name it")]
    Neighbour {
        /// The vertex.
        vertex: u32,
        /// The neighbour.
        neighbour: u32,
    },
    /// A vertex names a neighbour or a side twice.
    #[error("the link of vertex {vertex} holds a simplex twice")]
    Repeated {
        /// The vertex.
        vertex: u32,
    },
    /// A vertex names a side that does not ascend, lacks an edge, or is not named by its ends.
    #[error("vertex {vertex} names the side {side:?}, which is not a face seen from all three")]
    Side {
        /// The vertex.
        vertex: u32,
        /// The side opposite the vertex.
        side: [u32; 2],
    },
    /// A retired vertex still has a link.
    #[error("vertex {vertex} is gone but has a link")]
    Ghost {
        /// The vertex.
        vertex: u32,
    },
    /// A sphere is not finite or has a negative radius.
    #[error("vertex {vertex} has a sphere that is not valid")]
    Sphere {
        /// The vertex.
        vertex: u32,
    },
    /// A count that the complex keeps up to date is wrong.
    #[error("{kept} {what} were kept count of, there are {counted}")]
    Count {
        /// `"spheres"`, `"edges"` or `"faces"`.
        what: &'static str,
        /// The count that the complex keeps up to date.
        kept: usize,
        /// The count of its lists.
        counted: usize,
    },
}

impl CollapseComplex {
    /// Verifies every invariant: links that agree with each other, no repetition, no trace of
    /// retired vertices, valid spheres, right counts. Cost quadratic in the degrees; for tests.
    ///
    /// # Errors
    /// The first violation.
    pub fn check(&self) -> Result<(), CollapseError> {
        let (mut spheres, mut neighbours, mut sides) = (0, 0, 0);
        for vertex in 0..self.spheres.len() as u32 {
            if !self.is_alive(vertex) {
                if self.neighbours(vertex).is_empty() && self.opposite_sides(vertex).is_empty() {
                    continue;
                }
                return Err(CollapseError::Ghost { vertex });
            }
            self.check_vertex(vertex)?;
            spheres += 1;
            neighbours += self.neighbours(vertex).len();
            sides += self.opposite_sides(vertex).len();
        }
        // Each edge is named by both ends, each face by all three vertices.
        let counts = [
            ("spheres", self.sphere_count, spheres),
            ("edges", self.edge_count, neighbours / 2),
            ("faces", self.face_count, sides / 3),
        ];
        match counts.into_iter().find(|&(_, kept, counted)| kept != counted) {
            Some((what, kept, counted)) => Err(CollapseError::Count { what, kept, counted }),
            None => Ok(()),
        }
    }

    fn check_vertex(&self, vertex: u32) -> Result<(), CollapseError> {
        let sphere = self.sphere(vertex);
        if !(sphere.centre.is_finite() && sphere.radius.is_finite() && sphere.radius >= 0.0) {
            return Err(CollapseError::Sphere { vertex });
        }
        for &neighbour in self.neighbours(vertex) {
            let mutual = self.is_alive(neighbour) && self.neighbours(neighbour).contains(&vertex);
            if neighbour == vertex || !mutual {
                return Err(CollapseError::Neighbour { vertex, neighbour });
            }
        }
        for &side in self.opposite_sides(vertex) {
            let [p, q] = side;
            let names = |v: u32, a: u32, b: u32| {
                self.is_alive(v) && self.opposite_sides(v).contains(&[a.min(b), a.max(b)])
            };
            let edges = [p, q].iter().all(|v| self.neighbours(vertex).contains(v));
            if p >= q || !edges || !names(p, vertex, q) || !names(q, vertex, p) {
                return Err(CollapseError::Side { vertex, side });
            }
        }
        if has_repetition(self.neighbours(vertex)) || has_repetition(self.opposite_sides(vertex)) {
            return Err(CollapseError::Repeated { vertex });
        }
        Ok(())
    }
}

fn has_repetition<T: Ord + Clone>(items: &[T]) -> bool {
    let mut sorted = items.to_vec();
    sorted.sort_unstable();
    sorted.windows(2).any(|pair| pair[0] == pair[1])
}
