//! Every stage against [`replay`] and the engine.

use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::super::tests::random_mesh;
use super::super::{Collapse, CollapseComplex, replay};
use super::*;
use crate::complex::Sphere;

/// Random collapses of a random mesh into either end, the record of the engine, and how many
/// violate the link condition up to each stage.
fn random_steps(seed: u64) -> (Arc<MedialMesh>, Vec<Step>, Vec<Collapse>, Vec<usize>) {
    let initial = random_mesh(seed);
    let mut random = Pcg64::seed_from_u64(seed ^ 7);
    let mut complex = CollapseComplex::from_mesh(&initial).recording();
    let (mut steps, mut violations) = (Vec::new(), vec![0]);
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
        steps.push(Step { removed, kept, cost: random.random_range(0.0..2.0) });
    }
    (Arc::new(initial), steps, complex.record().to_vec(), violations)
}

fn path() -> Hierarchy {
    let sphere = |i: u32| Sphere::new(crate::Vec3::new(f64::from(i), 0.0, 0.0), 0.25);
    let mesh = MedialMesh::from_simplices(
        (0..5).map(sphere).collect(),
        vec![[3, 4]],
        vec![[0, 1, 2], [1, 2, 3]],
    );
    let step = |removed, kept, cost| Step { removed, kept, cost };
    let steps = vec![step(1, 2, 0.5), step(4, 3, f64::INFINITY), step(3, 2, 1.5)];
    Hierarchy::new(Arc::new(mesh.unwrap()), steps).unwrap()
}

#[test]
fn a_small_hierarchy_by_hand() {
    let hierarchy = path();
    assert_eq!(hierarchy.by_rank(), [1, 4, 3, 0, 2]);
    let meshes: Vec<_> = (0..=3).map(|t| hierarchy.stage(t).to_mesh()).collect();
    assert_eq!(meshes[0], **hierarchy.initial());
    assert_eq!(meshes[1].edges, [[0, 1], [1, 2], [2, 3]]);
    assert_eq!(meshes[2].edges, [[0, 1], [1, 2]]);
    assert_eq!(meshes[3].edges, [[0, 1]]);
    assert!(meshes[1..].iter().all(|mesh| mesh.faces.is_empty()));
    assert_eq!(hierarchy.violations_until(3), 0);
}

#[test]
fn what_is_no_collapse_of_an_edge_is_refused() {
    let initial = path().initial().clone();
    let step = |removed, kept| Step { removed, kept, cost: 1.0 };
    let refused = |steps: &[Step]| Hierarchy::new(initial.clone(), steps.to_vec()).unwrap_err();
    assert_eq!(refused(&[step(5, 0)]), HierarchyError::Vertex { step: 0, vertex: 5 });
    assert_eq!(refused(&[step(0, 4)]), HierarchyError::Edge { step: 0, removed: 0, kept: 4 });
    assert_eq!(refused(&[step(2, 2)]), HierarchyError::Edge { step: 0, removed: 2, kept: 2 });
    let gone = [step(0, 1), step(2, 0)];
    assert_eq!(refused(&gone), HierarchyError::Vertex { step: 1, vertex: 0 });
    let nan = [Step { cost: f64::NAN, ..step(0, 1) }];
    assert_eq!(refused(&nan), HierarchyError::Cost { step: 0 });
}

proptest! {
    /// Each stage is bit for bit what the engine had then, whatever was asked before.
    #[test]
    fn stages_are_those_of_the_engine(seed in any::<u64>()) {
        let (initial, steps, record, violations) = random_steps(seed);
        let hierarchy = Hierarchy::new(Arc::clone(&initial), steps.clone()).unwrap();
        for stage in (0..=steps.len()).rev() {
            let mesh = hierarchy.stage(stage).to_mesh();
            mesh.check().unwrap();
            prop_assert_eq!(&mesh, &replay(&initial, &record[..stage]));
            let view = hierarchy.stage(stage);
            let counts = [view.spheres().len(), view.edges().count(), view.faces().count()];
            prop_assert_eq!(counts, [mesh.spheres.len(), mesh.edges.len(), mesh.faces.len()]);
            prop_assert_eq!(counts, [view.sphere_count(), view.edge_count(), view.face_count()]);
            prop_assert_eq!(hierarchy.violations_until(stage), violations[stage]);
        }
    }
}
