//! All levels of detail of a medial mesh at once, and the changes from any level to any other.
//!
//! A sequence of collapses that do not move the kept spheres gives a hierarchy of meshes on subsets
//! of the initial spheres (Hoppe 1996, *Progressive meshes*; Faraj, Thiery, Boubekeur 2013,
//! <https://doi.org/10.1145/2542355.2542359>, section 2). *Stage* `t` is the mesh after the first
//! `t` collapses; stage 0 is the initial mesh.
//!
//! # Representation
//!
//! A removed vertex never comes back, and two vertices of an edge share it until one of them is
//! removed. So every sphere, edge and face, initial or made by a collapse, exists in one interval
//! of stages. A [`Hierarchy`] stores each of them once, in the order of their births, and their ids
//! in the order of their deaths. The simplices of stage `t` are those born up to `t` that die later:
//!
//! - They are found by a scan of the births up to `t` or of the deaths after `t`, whichever are
//!   fewer. In a mesh of bounded degree this takes time in proportion to the simplices of stage `t`.
//! - Those that come and go between two stages, in either direction, are found by a scan of the
//!   births and deaths between them, or by a scan as above where that is shorter.
//!
//! A [`Stage`] is a view and costs nothing. Nothing is replayed to reach it and there is no current
//! stage, so a stage is the same, bit for bit, whatever was asked for before.

mod file;
mod layer;
mod stage;
#[cfg(test)]
mod tests;

use std::sync::Arc;

pub use file::{HierarchyFileError, HierarchyFileErrorKind};
pub use stage::{Change, Stage};

use crate::complex::MedialMesh;
use layer::Layer;

/// One collapse of an edge into one of its ends, in the ids of the initial mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// The sphere that is removed.
    pub removed: u32,
    /// The sphere that stays, as it is, and takes over the edges and faces of the other.
    pub kept: u32,
    /// The cost at which the edge was taken, in the unit of the method; may be infinite.
    pub cost: f64,
}

/// A medial mesh and a sequence of collapses into one end, with direct access to every stage.
///
/// ```
/// use std::sync::Arc;
///
/// use medial::Vec3;
/// use medial::complex::collapse::{Hierarchy, Step};
/// use medial::complex::{MedialMesh, Sphere};
///
/// let spheres = (0..3).map(|i| Sphere::new(Vec3::new(f64::from(i), 0.0, 0.0), 0.1)).collect();
/// let path = MedialMesh::from_simplices(spheres, vec![[0, 1], [1, 2]], vec![])?;
/// let step = Step { removed: 1, kept: 0, cost: 1.0 };
/// let hierarchy = Hierarchy::new(Arc::new(path), vec![step])?;
/// // Rank 0 is sphere 1, which is removed first.
/// assert_eq!(hierarchy.by_rank(), [1, 0, 2]);
/// assert_eq!(hierarchy.change(0, 1).edges_removed().collect::<Vec<_>>(), [[0, 1], [0, 2]]);
/// assert_eq!(hierarchy.change(0, 1).edges_added().collect::<Vec<_>>(), [[1, 2]]);
/// assert_eq!(hierarchy.stage(1).to_mesh().edges, [[0, 1]]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Hierarchy {
    initial: Arc<MedialMesh>,
    steps: Vec<Step>,
    /// For each vertex the number of vertices removed before it; those never removed come last.
    ranks: Vec<u32>,
    /// The vertices by rank.
    by_rank: Vec<u32>,
    edges: Layer<2>,
    faces: Layer<3>,
    /// Steps that violate the link condition, ascending.
    against_link: Vec<u32>,
}

/// Why a sequence of steps is not a hierarchy.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum HierarchyError {
    /// A step names a sphere that the initial mesh does not have, or that is gone.
    #[error("step {step}: sphere {vertex} does not exist, or not any more")]
    Vertex {
        /// Index of the step.
        step: usize,
        /// The sphere.
        vertex: u32,
    },
    /// A step names two spheres without an edge between them at that stage.
    #[error("step {step}: there is no edge between the spheres {removed} and {kept}")]
    Edge {
        /// Index of the step.
        step: usize,
        /// The sphere to be removed.
        removed: u32,
        /// The sphere to be kept.
        kept: u32,
    },
    /// A cost is not a number.
    #[error("step {step}: the cost is not a number")]
    Cost {
        /// Index of the step.
        step: usize,
    },
    /// More edges or faces arise than can be numbered.
    #[error("more than 2^30 edges or faces arise: spheres with very large stars are collapsed")]
    TooManySimplices,
}

impl Hierarchy {
    /// The hierarchy of a mesh in canonical form under `steps`, first to last. Cost
    /// `O(n + s log d)` for `n` simplices, `s` at the removed spheres when they are removed, and
    /// degrees up to `d`; two threads are used where there are.
    ///
    /// # Errors
    /// When a step is not the collapse of an edge of its stage.
    pub fn new(initial: Arc<MedialMesh>, steps: Vec<Step>) -> Result<Self, HierarchyError> {
        debug_assert_eq!(initial.check(), Ok(()));
        let (ranks, by_rank) = rank_by_removal(initial.spheres.len(), &steps)?;
        let kept: Vec<u32> = steps.iter().map(|step| ranks[step.kept as usize]).collect();
        let (edges, faces) = rayon::join(
            || Layer::new(&initial.edges, &ranks, &kept),
            || Layer::new(&initial.faces, &ranks, &kept),
        );
        let ((edges, moved_edges), (faces, moved_faces)) = (edges?, faces?);
        // The collapsed edge is the one edge with both ends; without it the step names no edge.
        if let Some(step) = moved_edges.iter().position(|moved| moved.vanished != 1) {
            let Step { removed, kept, .. } = steps[step];
            return Err(HierarchyError::Edge { step, removed, kept });
        }
        // The link condition in counts. T1: each common neighbour (two edges that merge) has a face
        // with the edge (which vanishes). T2: no two faces merge.
        let violates = |step: &u32| {
            let [edges, faces] = [&moved_edges, &moved_faces].map(|moved| moved[*step as usize]);
            edges.merged != faces.vanished || faces.merged > 0
        };
        let against_link = (0..steps.len() as u32).filter(violates).collect();
        Ok(Self { initial, steps, ranks, by_rank, edges, faces, against_link })
    }

    /// The mesh of stage 0.
    pub fn initial(&self) -> &Arc<MedialMesh> {
        &self.initial
    }

    /// The collapses, first to last: step `t` leads from stage `t` to stage `t + 1`.
    pub fn steps(&self) -> &[Step] {
        &self.steps
    }

    /// The index of each sphere in the initial mesh, by its *rank*: the number of spheres that are
    /// removed before it. Those that are never removed come last, by index. The spheres of stage
    /// `t` are those of rank `t` and more: in a list of spheres by rank every stage is a suffix.
    pub fn by_rank(&self) -> &[u32] {
        &self.by_rank
    }

    /// The stage with the fewest spheres: the number of steps.
    pub fn last_stage(&self) -> usize {
        self.steps.len()
    }

    /// The mesh after the first `stage` collapses, as a view. Cost `O(1)`.
    ///
    /// # Panics
    /// If there are fewer collapses.
    pub fn stage(&self, stage: usize) -> Stage<'_> {
        Stage::new(self, stage)
    }

    /// The difference between two stages, in either direction. Cost `O(1)`.
    ///
    /// # Panics
    /// If there are fewer collapses.
    pub fn change(&self, from: usize, to: usize) -> Change<'_> {
        Change::new(self, from, to)
    }

    /// How many of the first `stage` collapses violate the link condition of Dey, Edelsbrunner,
    /// Guha and Nekhayev (1999), and so may have closed a loop, or made a void.
    pub fn violations_until(&self, stage: usize) -> usize {
        self.against_link.partition_point(|&step| (step as usize) < stage)
    }
}

/// The vertices in the order of their removal, those that are left last, and the place of each.
fn rank_by_removal(
    vertices: usize,
    steps: &[Step],
) -> Result<(Vec<u32>, Vec<u32>), HierarchyError> {
    const LEFT: u32 = u32::MAX;
    let mut ranks = vec![LEFT; vertices];
    let mut by_rank = Vec::with_capacity(vertices);
    for (step, &Step { removed, kept, cost }) in steps.iter().enumerate() {
        for vertex in [removed, kept] {
            if ranks.get(vertex as usize) != Some(&LEFT) {
                return Err(HierarchyError::Vertex { step, vertex });
            }
        }
        if removed == kept {
            return Err(HierarchyError::Edge { step, removed, kept });
        }
        if cost.is_nan() {
            return Err(HierarchyError::Cost { step });
        }
        ranks[removed as usize] = step as u32;
        by_rank.push(removed);
    }
    for vertex in 0..vertices {
        if ranks[vertex] == LEFT {
            ranks[vertex] = by_rank.len() as u32;
            by_rank.push(vertex as u32);
        }
    }
    Ok((ranks, by_rank))
}
