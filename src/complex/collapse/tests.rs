//! Closed-form cases, and random complexes against [`replay`] and Betti numbers.

use std::collections::BTreeMap;

use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::*;
use crate::Vec3;
use crate::complex::betti;

fn point(x: f64, y: f64, z: f64) -> Sphere {
    Sphere::new(Vec3::new(x, y, z), 0.1)
}

fn mesh(vertices: usize, edges: &[[u32; 2]], faces: &[[u32; 3]]) -> MedialMesh {
    let spheres = (0..vertices).map(|v| point(v as f64, (v * v) as f64, 0.0)).collect();
    MedialMesh::from_simplices(spheres, edges.to_vec(), faces.to_vec()).unwrap()
}

fn hollow_tetrahedron() -> MedialMesh {
    mesh(4, &[], &[[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]])
}

fn torus() -> MedialMesh {
    let at = |i: u32, j: u32| (i % 4) * 4 + j % 4;
    let faces: Vec<_> = (0..16)
        .flat_map(|n| {
            let (i, j) = (n / 4, n % 4);
            [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i, j + 1), at(i + 1, j + 1)]]
        })
        .collect();
    mesh(16, &[], &faces)
}

#[test]
fn the_mesh_comes_back_unchanged() {
    for mesh in [hollow_tetrahedron(), torus(), mesh(4, &[[0, 3]], &[[0, 1, 3]])] {
        let complex = CollapseComplex::from_mesh(&mesh);
        complex.check().unwrap();
        assert_eq!(complex.to_mesh(), mesh);
    }
}

#[test]
fn equal_simplices_merge_and_an_edge_without_faces_stays() {
    // A single face; two faces on {2, 3}, apart from it joined by the edge {0, 1} alone.
    for (initial, edges, faces) in
        [(mesh(3, &[], &[[0, 1, 2]]), 1, 0), (mesh(4, &[[0, 1]], &[[0, 2, 3], [1, 2, 3]]), 3, 1)]
    {
        let mut complex = CollapseComplex::from_mesh(&initial);
        complex.collapse(1, 0, point(0.0, 0.0, 0.0));
        complex.check().unwrap();
        let mesh = complex.to_mesh();
        assert_eq!((mesh.edges.len(), mesh.faces.len()), (edges, faces));
    }
}

/// The condition and the obstacles of the edge {0, 1}.
#[test]
fn the_condition_sees_holes_and_voids_and_lets_a_cup_be_flattened() {
    let cup = [[0, 1, 3], [0, 2, 3], [1, 2, 3]];
    for (initial, keeps, expected) in [
        // T1: a cycle of three edges. T2: the void of a tetrahedron.
        (mesh(3, &[[0, 1], [1, 2], [0, 2]], &[]), false, vec![2]),
        (hollow_tetrahedron(), false, vec![2, 3]),
        (mesh(3, &[], &[[0, 1, 2]]), true, vec![]),
        (mesh(3, &[[0, 1], [1, 2]], &[]), true, vec![]),
        // Three faces of a tetrahedron: a disc, whose collapse closes a void and a hole at once.
        (mesh(4, &[], &cup), true, vec![]),
        // Without the face at the edge it is a hole and nothing that fills it.
        (mesh(4, &[[0, 1]], &cup[1..]), false, vec![2, 3]),
    ] {
        let mut complex = CollapseComplex::from_mesh(&initial);
        assert_eq!(complex.keeps_homotopy(0, 1), keeps, "{initial:?}");
        let mut obstacles = complex.homotopy_obstacles(0, 1);
        obstacles.sort_unstable();
        assert_eq!(obstacles, expected, "{initial:?}");
    }
}

/// An edge that closes a hole may be collapsed once a vertex next to it is filled in, without any
/// change at the hole's own vertices.
#[test]
fn an_obstacle_can_lie_next_to_the_hole() {
    // The hole 0 1 2 with faces outwards at its sides: merging 3 and 4 makes a cup of three faces.
    let faces = [[0, 1, 3], [0, 2, 3], [1, 2, 4]];
    let mut complex = CollapseComplex::from_mesh(&mesh(5, &[[3, 4]], &faces));
    assert!(!complex.keeps_homotopy(0, 1));
    let obstacles = complex.homotopy_obstacles(0, 1);
    assert!(obstacles.contains(&3) || obstacles.contains(&4), "{obstacles:?}");
    complex.collapse(3, 4, point(0.0, 0.0, 0.0));
    assert!(complex.keeps_homotopy(0, 1));
}

#[test]
fn inversion_is_a_fold_and_not_noise() {
    // The face 0 1 2 with its third corner at a height, and the new place of its first corner.
    for (height, centre, folds) in [
        (1.0, [-0.5, 0.0], false),
        // Zero area is not inverted.
        (1.0, [0.5, 0.5], false),
        (1.0, [1.0, 1.0], true),
        // A face so thin that its normal is noise.
        (1e-16, [0.0, 1.0], false),
    ] {
        let spheres = [[0.0, 0.0], [1.0, 0.0], [0.0, height], [-1.0, 0.0]];
        let spheres = spheres.map(|[x, y]| point(x, y, 0.0)).to_vec();
        let mesh = MedialMesh::from_simplices(spheres, vec![[0, 3]], vec![[0, 1, 2]]).unwrap();
        let centre = Vec3::new(centre[0], centre[1], 0.0);
        let folded = CollapseComplex::from_mesh(&mesh).folded_face(0, 3, centre);
        assert_eq!(folded.is_some(), folds, "{centre}");
    }
}

#[test]
fn ties_come_out_by_the_second_key_and_the_ids() {
    let complex = CollapseComplex::from_mesh(&torus());
    let edges: Vec<_> = complex.edges().collect();
    let make = |cost: f64, tie: f64, ends| Candidate::new(&complex, ends, cost, tie);
    let mut queue = CollapseQueue::default();
    for &ends in edges.iter().rev() {
        queue.push(make(0.0, f64::from(ends[0] % 3), ends));
    }
    queue.push(make(f64::NAN, 0.0, edges[0]));
    let mut expected = edges.clone();
    expected.sort_by_key(|e| (e[0] % 3, *e));
    expected.push(edges[0]);
    let order: Vec<_> = std::iter::from_fn(|| queue.pop(&complex)).map(|c| c.ends()).collect();
    assert_eq!(order, expected);
}

#[test]
fn out_of_date_candidates_are_dropped_and_parked_ones_come_back_once() {
    let mut complex = CollapseComplex::from_mesh(&torus());
    let candidates: Vec<_> =
        complex.edges().map(|ends| Candidate::new(&complex, ends, 1.0, 0.0)).collect();
    let mut queue = CollapseQueue::from_candidates(candidates);
    let first = queue.pop(&complex).unwrap();
    queue.park(first, &[9, 12, 15]);
    queue.wake(&complex, 11);
    let second = queue.pop(&complex).unwrap();
    assert_ne!(first, second);
    queue.park(second, &[12, 13]);
    queue.wake(&complex, 12);
    queue.wake(&complex, 15);
    assert_eq!(queue.pop(&complex), Some(first));
    assert_eq!(queue.pop(&complex), Some(second));
    complex.collapse(first.ends()[0], first.ends()[1], point(0.0, 0.0, 0.0));
    let ends: Vec<_> = std::iter::from_fn(|| queue.pop(&complex)).map(|c| c.ends()).collect();
    assert!(!ends.is_empty() && ends.iter().all(|e| !e.contains(&first.ends()[0])));
    assert!(!ends.iter().any(|e| e.contains(&first.ends()[1])));
}

/// A random complex with lone edges, isolated vertices and non-manifold edges.
pub(super) fn random_mesh(seed: u64) -> MedialMesh {
    let mut random = Pcg64::seed_from_u64(seed);
    let vertices = random.random_range(3..14_u32);
    let spheres = (0..vertices)
        .map(|_| {
            let mut unit = || random.random_range(0.0..1.0);
            Sphere::new(Vec3::new(unit(), unit(), unit()), unit())
        })
        .collect();
    let mut distinct = |count: usize| -> Vec<u32> {
        let mut ids: Vec<u32> = Vec::new();
        while ids.len() < count {
            let id = random.random_range(0..vertices);
            if !ids.contains(&id) {
                ids.push(id);
            }
        }
        ids
    };
    let edges = (0..vertices / 2).map(|_| distinct(2).try_into().unwrap()).collect();
    let faces = (0..2 * vertices).map(|_| distinct(3).try_into().unwrap()).collect();
    MedialMesh::from_simplices(spheres, edges, faces).unwrap()
}

proptest! {
    /// Random collapses to the end: invariants after each, the same mesh as the simplicial map of
    /// the record, and Betti numbers unchanged where the condition holds.
    #[test]
    fn collapses_agree_with_the_simplicial_map(seed in any::<u64>()) {
        let initial = random_mesh(seed);
        let mut random = Pcg64::seed_from_u64(seed ^ 1);
        let mut complex = CollapseComplex::from_mesh(&initial).recording();
        let mut meshes = vec![initial.clone()];
        while complex.edge_count() > 0 {
            let edges: Vec<_> = complex.edges().collect();
            let [mut a, mut b] = edges[random.random_range(0..edges.len())];
            if random.random_bool(0.5) {
                std::mem::swap(&mut a, &mut b);
            }
            let keeps = complex.keeps_homotopy(a, b);
            prop_assert_eq!(keeps, complex.keeps_homotopy(b, a));
            prop_assert_eq!(keeps, complex.homotopy_obstacles(a, b).is_empty());
            let before = betti(meshes.last().unwrap());
            complex.collapse(a, b, complex.sphere(a).lerp(complex.sphere(b), 0.5));
            complex.check().unwrap();
            let mesh = complex.to_mesh();
            mesh.check().unwrap();
            if keeps {
                prop_assert_eq!(betti(&mesh), before);
            }
            meshes.push(mesh);
        }
        for (level, mesh) in meshes.iter().enumerate() {
            prop_assert_eq!(&replay(&initial, &complex.record()[..level]), mesh);
        }
    }

    /// No edge may be collapsed again before one of its obstacles was part of a collapse.
    #[test]
    fn obstacles_hold_until_one_of_them_changes(seed in any::<u64>()) {
        let mut random = Pcg64::seed_from_u64(seed);
        let mut complex = CollapseComplex::from_mesh(&random_mesh(seed));
        let mut held: BTreeMap<[u32; 2], Vec<u32>> = BTreeMap::new();
        while complex.edge_count() > 0 {
            let edges: Vec<_> = complex.edges().collect();
            for &[a, b] in &edges {
                let blocked = !complex.keeps_homotopy(a, b);
                prop_assert!(blocked || !held.contains_key(&[a, b]), "{a} {b}: {held:?}");
                if blocked && !held.contains_key(&[a, b]) {
                    held.insert([a, b], complex.homotopy_obstacles(a, b));
                }
            }
            let [a, b] = edges[random.random_range(0..edges.len())];
            complex.collapse(a, b, complex.sphere(a));
            let changed = |v: &u32| *v == a || *v == b;
            held.retain(|ends, obstacles| !ends.iter().chain(&*obstacles).any(changed));
        }
    }

    /// The same contents come out in the same order, pushed one by one or made at once.
    #[test]
    fn the_queue_sorts(costs in prop::collection::vec(0..20_u32, 48)) {
        let complex = CollapseComplex::from_mesh(&torus());
        let candidates: Vec<_> = complex
            .edges()
            .zip(&costs)
            .map(|(ends, &cost)| Candidate::new(&complex, ends, f64::from(cost), 0.0))
            .collect();
        let mut sorted = candidates.clone();
        sorted.sort_by(|x, y| x.cost().total_cmp(&y.cost()).then(x.ends().cmp(&y.ends())));
        let mut pushed = CollapseQueue::default();
        for &candidate in &candidates {
            pushed.push(candidate);
        }
        let mut made = CollapseQueue::from_candidates(candidates);
        for expected in sorted {
            prop_assert_eq!(pushed.peek(&complex), Some(expected));
            prop_assert_eq!(pushed.pop(&complex), Some(expected));
            prop_assert_eq!(made.peek(&complex), Some(expected));
            prop_assert_eq!(made.pop(&complex), Some(expected));
        }
        prop_assert_eq!((made.peek(&complex), made.pop(&complex)), (None, None));
    }
}
