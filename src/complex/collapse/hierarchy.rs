//! All levels of detail of a medial mesh at once.
//!
//! A sequence of collapses that do not move the kept spheres gives a hierarchy of meshes on subsets
//! of the initial spheres (Hoppe 1996, *Progressive meshes*; Faraj, Thiery, Boubekeur 2013,
//! <https://doi.org/10.1145/2542355.2542359>, section 2). *Stage* `t` is the mesh after the first
//! `t` collapses; stage 0 is the initial mesh. [`replay`] computes each stage from the initial mesh,
//! so a stage is the same, bit for bit, whichever stages were computed before.

use std::sync::Arc;

use super::{Collapse, replay};
use crate::complex::MedialMesh;

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

/// A medial mesh and a sequence of collapses into one end, with access to every stage.
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
/// assert_eq!(hierarchy.mesh(1).edges, [[0, 1]]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Hierarchy {
    initial: Arc<MedialMesh>,
    steps: Vec<Step>,
    /// Steps that violate the link condition, ascending.
    against_link: Vec<u32>,
}

/// Why a sequence of steps is not a hierarchy.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum HierarchyError {
    /// A step names two spheres without an edge between them at its stage.
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
        let ranks = rank_by_removal(initial.spheres.len(), &steps)?;
        let kept: Vec<u32> = steps.iter().map(|step| ranks[step.kept as usize]).collect();
        let (edges, faces) = rayon::join(
            || count_moves(&initial.edges, &ranks, &kept),
            || count_moves(&initial.faces, &ranks, &kept),
        );
        // The collapsed edge is the one edge with both ends; without it the step names no edge.
        if let Some(step) = edges.iter().position(|moves| moves.vanished != 1) {
            let Step { removed, kept, .. } = steps[step];
            return Err(HierarchyError::Edge { step, removed, kept });
        }
        // The link condition in counts. T1: each common neighbour (two edges that merge) has a face
        // with the edge (which vanishes). T2: no two faces merge.
        let violates = |&step: &u32| {
            let (edges, faces) = (edges[step as usize], faces[step as usize]);
            edges.merged != faces.vanished || faces.merged > 0
        };
        let against_link = (0..steps.len() as u32).filter(violates).collect();
        Ok(Self { initial, steps, against_link })
    }

    /// The mesh of stage 0.
    pub fn initial(&self) -> &Arc<MedialMesh> {
        &self.initial
    }

    /// The collapses, first to last: step `t` leads from stage `t` to stage `t + 1`.
    pub fn steps(&self) -> &[Step] {
        &self.steps
    }

    /// The mesh after the first `stage` collapses, in canonical form, without contacts; the spheres
    /// keep the order that they have in the initial mesh. Cost `O(n log n)`.
    ///
    /// # Panics
    /// If there are fewer collapses.
    pub fn mesh(&self, stage: usize) -> MedialMesh {
        let collapse = |&Step { removed, kept, .. }: &Step| Collapse {
            kept,
            removed,
            sphere: self.initial.spheres[kept as usize],
        };
        replay(&self.initial, &self.steps[..stage].iter().map(collapse).collect::<Vec<_>>())
    }

    /// How many of the first `stage` collapses violate the link condition of Dey, Edelsbrunner,
    /// Guha and Nekhayev (1999), and so may have closed a loop, or made a void.
    pub fn violations_until(&self, stage: usize) -> usize {
        self.against_link.partition_point(|&step| (step as usize) < stage)
    }
}

/// For each vertex its *rank*, the number of vertices removed before it. Those that are never removed
/// come last, by index.
fn rank_by_removal(vertices: usize, steps: &[Step]) -> Result<Vec<u32>, HierarchyError> {
    const LEFT: u32 = u32::MAX;
    let mut ranks = vec![LEFT; vertices];
    for (step, &Step { removed, kept, cost }) in steps.iter().enumerate() {
        let are_left = [removed, kept].iter().all(|&v| ranks.get(v as usize) == Some(&LEFT));
        if !are_left || removed == kept {
            return Err(HierarchyError::Edge { step, removed, kept });
        }
        if cost.is_nan() {
            return Err(HierarchyError::Cost { step });
        }
        ranks[removed as usize] = step as u32;
    }
    for (next, rank) in (steps.len() as u32..).zip(ranks.iter_mut().filter(|r| **r == LEFT)) {
        *rank = next;
    }
    Ok(ranks)
}

/// Counts of the simplices that a step removed without a new one in their place.
#[derive(Clone, Copy, Debug, Default)]
struct Moves {
    /// Those that became equal to another simplex.
    merged: u32,
    /// Those with both ends of the collapsed edge.
    vanished: u32,
}

/// A simplex in the list of the vertex that is removed first.
struct Waiting<const K: usize> {
    /// Ascending.
    ranks: [u32; K],
    /// The step that made it.
    step: u32,
    next: u32,
}

/// The end of a list.
const NONE: u32 = u32::MAX;

/// The counts of each step for the simplices of one dimension. The vertices of ranks 0, 1, ... are
/// collapsed into the vertices of ranks `kept`; `ranks` holds the ranks of all vertices.
///
/// A simplex with ascending ranks begins with the vertex that is removed first, and waits there for
/// its image. So every simplex is touched once for each of its images.
fn count_moves<const K: usize>(initial: &[[u32; K]], ranks: &[u32], kept: &[u32]) -> Vec<Moves> {
    let mut first = vec![NONE; ranks.len()];
    let mut simplices: Vec<Waiting<K>> = Vec::with_capacity(initial.len());
    for (index, simplex) in (0..).zip(initial) {
        let mut ranks = simplex.map(|v| ranks[v as usize]);
        ranks.sort_unstable();
        let next = std::mem::replace(&mut first[ranks[0] as usize], index);
        // Initial simplices are distinct, so their step is never read.
        simplices.push(Waiting { ranks, step: 0, next });
    }
    let mut moves = vec![Moves::default(); kept.len()];
    let mut here = Vec::new();
    // Beyond the last step: survivors, among which merged simplices are still to be found.
    for rank in 0..first.len() {
        here.clear();
        let mut index = first[rank];
        while let Some(waiting) = simplices.get(index as usize) {
            here.push((waiting.ranks, waiting.step, index));
            index = waiting.next;
        }
        here.sort_unstable();
        for (at, &(mut simplex, step, index)) in here.iter().enumerate() {
            // It merged when it was made, which is noticed only now: a search then would cost more.
            if at > 0 && here[at - 1].0 == simplex {
                moves[step as usize].merged += 1;
            } else if let Some(&kept) = kept.get(rank) {
                if simplex.contains(&kept) {
                    moves[rank].vanished += 1;
                } else {
                    simplex[0] = kept;
                    simplex.sort_unstable();
                    let next = std::mem::replace(&mut first[simplex[0] as usize], index);
                    simplices[index as usize] = Waiting { ranks: simplex, step: rank as u32, next };
                }
            }
        }
    }
    moves
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    use super::super::CollapseComplex;
    use super::super::tests::random_mesh;
    use super::*;
    use crate::complex::Sphere;

    #[test]
    fn sequences_that_collapse_no_edge_are_refused() {
        let sphere = |i: u32| Sphere::new(crate::Vec3::new(f64::from(i), 0.0, 0.0), 0.25);
        let faces = vec![[0, 1, 2], [1, 2, 3]];
        let initial =
            MedialMesh::from_simplices((0..5).map(sphere).collect(), vec![[3, 4]], faces).unwrap();
        let initial = Arc::new(initial);
        let step = |removed, kept| Step { removed, kept, cost: 1.0 };
        for steps in [vec![step(5, 0)], vec![step(0, 4)], vec![step(2, 2)]] {
            let Step { removed, kept, .. } = steps[0];
            let refused = Hierarchy::new(initial.clone(), steps).unwrap_err();
            assert_eq!(refused, HierarchyError::Edge { step: 0, removed, kept });
        }
        let gone = Hierarchy::new(initial.clone(), vec![step(0, 1), step(2, 0)]).unwrap_err();
        assert_eq!(gone, HierarchyError::Edge { step: 1, removed: 2, kept: 0 });
        let nan = Hierarchy::new(initial, vec![Step { cost: f64::NAN, ..step(0, 1) }]);
        assert_eq!(nan.unwrap_err(), HierarchyError::Cost { step: 0 });
    }

    proptest! {
        /// Random collapses of a random mesh into either end: each stage is bit for bit the mesh of
        /// the engine, and violations are those that the engine finds.
        #[test]
        fn stages_are_those_of_the_engine(seed in any::<u64>()) {
            let initial = Arc::new(random_mesh(seed));
            let mut random = Pcg64::seed_from_u64(seed ^ 7);
            let mut complex = CollapseComplex::from_mesh(&initial);
            let (mut steps, mut violations) = (Vec::new(), vec![0]);
            let mut meshes = vec![complex.to_mesh()];
            let most = random.random_range(0..initial.spheres.len());
            while complex.edge_count() > 0 && steps.len() < most {
                let edges: Vec<_> = complex.edges().collect();
                let [mut removed, mut kept] = edges[random.random_range(0..edges.len())];
                if random.random_bool(0.5) {
                    std::mem::swap(&mut removed, &mut kept);
                }
                let violates = !complex.link_condition(removed, kept);
                violations.push(violations[steps.len()] + usize::from(violates));
                complex.collapse(kept, removed, complex.sphere(kept));
                meshes.push(complex.to_mesh());
                steps.push(Step { removed, kept, cost: random.random_range(0.0..2.0) });
            }
            let hierarchy = Hierarchy::new(initial, steps).unwrap();
            for (stage, mesh) in meshes.iter().enumerate().rev() {
                prop_assert_eq!(&hierarchy.mesh(stage), mesh);
                prop_assert_eq!(hierarchy.violations_until(stage), violations[stage]);
            }
        }
    }
}
