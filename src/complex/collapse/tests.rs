//! Closed-form cases, and random complexes against [`replay`] and Betti numbers.

use std::collections::BTreeMap;

use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::*;
use crate::Vec3;

fn point(x: f64, y: f64, z: f64) -> Sphere {
    Sphere::new(Vec3::new(x, y, z), 0.1)
}

fn mesh(vertices: usize, edges: &[[u32; 2]], faces: &[[u32; 3]]) -> MedialMesh {
    let spheres = (0..vertices).map(|v| point(v as f64, (v * v) as f64, 0.0)).collect();
    MedialMesh::from_simplices(spheres, edges.to_vec(), faces.to_vec()).unwrap()
}

/// Rank over GF(2) by elimination; a row is a set of columns.
fn rank(mut rows: Vec<Vec<bool>>) -> usize {
    let columns = rows.first().map_or(0, Vec::len);
    let mut rank = 0;
    for column in 0..columns {
        let Some(pivot) = (rank..rows.len()).find(|&r| rows[r][column]) else { continue };
        rows.swap(rank, pivot);
        for other in 0..rows.len() {
            if other != rank && rows[other][column] {
                for c in column..columns {
                    rows[other][c] ^= rows[rank][c];
                }
            }
        }
        rank += 1;
    }
    rank
}

fn betti(mesh: &MedialMesh) -> [usize; 3] {
    let row = |columns: Vec<usize>, width: usize| {
        let mut row = vec![false; width];
        for column in columns {
            row[column] = true;
        }
        row
    };
    let [v, e, f] = [mesh.spheres.len(), mesh.edges.len(), mesh.faces.len()];
    let edges = mesh.edges.iter().map(|e| row(e.map(|v| v as usize).to_vec(), v)).collect();
    let side = |a, b| mesh.edges.binary_search(&[a, b]).unwrap();
    let faces =
        mesh.faces.iter().map(|&[a, b, c]| row(vec![side(a, b), side(a, c), side(b, c)], e));
    let [r1, r2] = [rank(edges), rank(faces.collect())];
    [v - r1, e - r1 - r2, f - r2]
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
fn betti_numbers_of_known_complexes() {
    assert_eq!(betti(&hollow_tetrahedron()), [1, 0, 1]);
    assert_eq!(betti(&mesh(3, &[], &[[0, 1, 2]])), [1, 0, 0]);
    assert_eq!(betti(&mesh(3, &[[0, 1], [1, 2], [0, 2]], &[])), [1, 1, 0]);
    assert_eq!(betti(&torus()), [1, 2, 1]);
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
fn an_edge_that_loses_its_last_face_stays() {
    let mut complex = CollapseComplex::from_mesh(&mesh(3, &[], &[[0, 1, 2]]));
    complex.collapse(0, 1, point(0.0, 0.0, 0.0));
    complex.check().unwrap();
    assert_eq!(complex.to_mesh().edges, [[0, 1]]);
    assert_eq!(complex.face_count(), 0);
}

#[test]
fn equal_edges_and_faces_are_merged() {
    // Two faces on {2, 3}, apart from it joined by the edge {0, 1} alone.
    let mut complex = CollapseComplex::from_mesh(&mesh(4, &[[0, 1]], &[[0, 2, 3], [1, 2, 3]]));
    complex.collapse(1, 0, point(0.0, 0.0, 0.0));
    complex.check().unwrap();
    let mesh = complex.to_mesh();
    assert_eq!((mesh.edges.len(), mesh.faces.len()), (3, 1));
}

#[test]
fn link_condition_sees_holes_and_voids() {
    let mut hole = CollapseComplex::from_mesh(&mesh(3, &[[0, 1], [1, 2], [0, 2]], &[]));
    assert!(!hole.link_condition(0, 1), "T1: a cycle of three edges");
    let mut filled = CollapseComplex::from_mesh(&mesh(3, &[], &[[0, 1, 2]]));
    assert!(filled.link_condition(0, 1));
    let mut void = CollapseComplex::from_mesh(&hollow_tetrahedron());
    assert!(!void.link_condition(0, 1), "T2: the void of a tetrahedron");
    assert_eq!(hole.homotopy_obstacles(0, 1), [2]);
    let mut obstacles = void.homotopy_obstacles(0, 1);
    obstacles.sort_unstable();
    assert_eq!(obstacles, [2, 3]);
    assert!(filled.homotopy_obstacles(0, 1).is_empty());
    let mut path = CollapseComplex::from_mesh(&mesh(3, &[[0, 1], [1, 2]], &[]));
    assert!(path.link_condition(0, 1));
}

#[test]
fn a_cup_of_three_faces_may_be_flattened() {
    // Three faces of a tetrahedron: a disc, whose collapse at {0, 1} closes a void and a hole at once.
    let mut cup = CollapseComplex::from_mesh(&mesh(4, &[], &[[0, 1, 3], [0, 2, 3], [1, 2, 3]]));
    assert!(!cup.link_condition(0, 1) && cup.keeps_homotopy(0, 1));
    // Without the face at the edge it is a hole and nothing that fills it.
    let mut strip = CollapseComplex::from_mesh(&mesh(4, &[[0, 1]], &[[0, 2, 3], [1, 2, 3]]));
    assert!(!strip.keeps_homotopy(0, 1));
    let mut void = CollapseComplex::from_mesh(&hollow_tetrahedron());
    assert!(!void.keeps_homotopy(0, 1));
    let mut hole = CollapseComplex::from_mesh(&mesh(3, &[[0, 1], [1, 2], [0, 2]], &[]));
    assert!(!hole.keeps_homotopy(0, 1));
}

/// An edge that closes a hole may be collapsed once a vertex beside it is filled in, without any
/// change at the hole's own vertices.
#[test]
fn an_obstacle_can_lie_beside_the_hole() {
    // The hole 0 1 2 with faces outwards at its sides: merging 3 and 4 makes a cup of three faces.
    let faces = [[0, 1, 3], [0, 2, 3], [1, 2, 4]];
    let mut complex = CollapseComplex::from_mesh(&mesh(5, &[[3, 4]], &faces));
    assert!(!complex.keeps_homotopy(0, 1));
    let obstacles = complex.homotopy_obstacles(0, 1);
    assert!(obstacles.contains(&3) || obstacles.contains(&4), "{obstacles:?}");
    complex.collapse(3, 4, point(0.0, 0.0, 0.0));
    assert!(complex.keeps_homotopy(0, 1));
}

/// The weaker condition has cases of its own on random complexes, or the property test below would
/// not test it.
#[test]
fn the_weaker_condition_admits_more() {
    let admitted = |seed| {
        let mesh = random_mesh(seed);
        let mut complex = CollapseComplex::from_mesh(&mesh);
        let mut more =
            |&&[a, b]: &&[u32; 2]| complex.keeps_homotopy(a, b) && !complex.link_condition(a, b);
        mesh.edges.iter().filter(&mut more).count()
    };
    assert!((0..200).map(admitted).sum::<usize>() > 50);
}

fn folds(complex: &CollapseComplex, a: u32, b: u32, centre: Vec3) -> bool {
    complex.folded_face(a, b, centre).is_some()
}

#[test]
fn inversion_is_a_fold_and_not_noise() {
    let spheres = vec![
        point(0.0, 0.0, 0.0),
        point(1.0, 0.0, 0.0),
        point(0.0, 1.0, 0.0),
        point(-1.0, 0.0, 0.0),
    ];
    let square = MedialMesh::from_simplices(spheres, vec![[0, 3]], vec![[0, 1, 2]]).unwrap();
    let complex = CollapseComplex::from_mesh(&square);
    assert!(!folds(&complex, 0, 3, Vec3::new(-0.5, 0.0, 0.0)));
    assert!(!folds(&complex, 0, 3, Vec3::new(0.5, 0.5, 0.0)), "zero area is not inverted");
    assert!(folds(&complex, 0, 3, Vec3::new(1.0, 1.0, 0.0)));
    let thin = vec![
        point(0.0, 0.0, 0.0),
        point(1.0, 0.0, 0.0),
        point(0.5, 1e-16, 0.0),
        point(-1.0, 0.0, 0.0),
    ];
    let thin = MedialMesh::from_simplices(thin, vec![[0, 3]], vec![[0, 1, 2]]).unwrap();
    let complex = CollapseComplex::from_mesh(&thin);
    assert!(!folds(&complex, 0, 3, Vec3::new(0.0, 1.0, 0.0)));
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
    /// the record, and Betti numbers unchanged where the link condition holds.
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
            let safe = complex.link_condition(a, b);
            prop_assert_eq!(safe, complex.link_condition(b, a));
            let keeps = complex.keeps_homotopy(a, b);
            prop_assert_eq!(keeps, complex.keeps_homotopy(b, a));
            prop_assert!(keeps || !safe);
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
