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
/// let hierarchy = Hierarchy::new(Arc::new(path), vec![step]);
/// assert_eq!(hierarchy.mesh(1).edges, [[0, 1]]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Hierarchy {
    initial: Arc<MedialMesh>,
    steps: Vec<Step>,
}

impl Hierarchy {
    /// The hierarchy of a mesh in canonical form. Each step, first to last, collapses an edge of its stage.
    ///
    /// # Panics
    /// If a step removes a sphere that is gone, or keeps one.
    pub fn new(initial: Arc<MedialMesh>, steps: Vec<Step>) -> Self {
        debug_assert_eq!(initial.check(), Ok(()));
        let mut is_left = vec![true; initial.spheres.len()];
        for &Step { removed, kept, .. } in &steps {
            let was_left = std::mem::replace(&mut is_left[removed as usize], false);
            assert!(was_left && is_left[kept as usize], "{removed} into {kept}");
        }
        Self { initial, steps }
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
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    use super::super::CollapseComplex;
    use super::super::tests::random_mesh;
    use super::*;

    proptest! {
        /// Random collapses of a random mesh into either end: each stage is bit for bit the mesh of
        /// the engine.
        #[test]
        fn stages_are_those_of_the_engine(seed in any::<u64>()) {
            let initial = Arc::new(random_mesh(seed));
            let mut random = Pcg64::seed_from_u64(seed ^ 7);
            let mut complex = CollapseComplex::from_mesh(&initial);
            let mut steps = Vec::new();
            let mut meshes = vec![complex.to_mesh()];
            let most = random.random_range(0..initial.spheres.len());
            while complex.edge_count() > 0 && steps.len() < most {
                let edges: Vec<_> = complex.edges().collect();
                let [mut removed, mut kept] = edges[random.random_range(0..edges.len())];
                if random.random_bool(0.5) {
                    std::mem::swap(&mut removed, &mut kept);
                }
                complex.collapse(kept, removed, complex.sphere(kept));
                meshes.push(complex.to_mesh());
                steps.push(Step { removed, kept, cost: random.random_range(0.0..2.0) });
            }
            let hierarchy = Hierarchy::new(initial, steps);
            for (stage, mesh) in meshes.iter().enumerate().rev() {
                prop_assert_eq!(&hierarchy.mesh(stage), mesh);
            }
        }
    }
}
