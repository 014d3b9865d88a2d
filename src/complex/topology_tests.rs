use proptest::prelude::*;

use super::*;
use crate::Vec3;
use crate::complex::Sphere;

fn complex(spheres: usize, edges: Vec<[u32; 2]>, faces: Vec<[u32; 3]>) -> MedialMesh {
    let spheres = vec![Sphere::new(Vec3::ZERO, 1.0); spheres];
    MedialMesh::from_simplices(spheres, edges, faces).unwrap()
}

/// Two triangles for each cell of an `m` by `n` grid that closes in both directions.
fn torus_grid(m: u32, n: u32) -> Vec<[u32; 3]> {
    let id = |i: u32, j: u32| (i % m) * n + j % n;
    let cells = (0..m).flat_map(|i| (0..n).map(move |j| (i, j)));
    cells
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect()
}

/// All squares of an `n` by `n` by `n` grid of cubes, as two triangles each: a foam of bubbles.
fn foam(n: u32) -> MedialMesh {
    let m = n + 1;
    let id = |p: [u32; 3]| (p[0] * m + p[1]) * m + p[2];
    let mut faces = Vec::new();
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for (i, j, k) in
            (0..m).flat_map(|i| (0..n).flat_map(move |j| (0..n).map(move |k| (i, j, k))))
        {
            let corner = |du: u32, dv: u32| {
                let mut p = [0; 3];
                (p[axis], p[u], p[v]) = (i, j + du, k + dv);
                id(p)
            };
            let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
            faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    complex((m * m * m) as usize, vec![], faces)
}

#[test]
fn small_complexes_have_the_betti_numbers_of_the_textbook() {
    let tetrahedron = vec![[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]];
    assert_eq!(betti(&complex(4, vec![], tetrahedron)), [1, 0, 1]);
    assert_eq!(betti(&complex(3, vec![], vec![[0, 1, 2]])), [1, 0, 0]);
    assert_eq!(betti(&complex(3, vec![[0, 1], [1, 2], [0, 2]], vec![])), [1, 1, 0]);
    assert_eq!(betti(&MedialMesh::default()), [0, 0, 0]);
    assert_eq!(betti(&complex(3, vec![], vec![])), [3, 0, 0]);
    let torus = complex(16, vec![], torus_grid(4, 4));
    assert_eq!((torus.edges.len(), torus.faces.len()), (48, 32));
    assert_eq!((betti(&torus), euler(&torus)), ([1, 2, 1], 0));
    // The projective plane on six points is a cycle over Z_2, though not over the integers.
    let plane = vec![
        [0, 1, 4],
        [0, 1, 5],
        [0, 2, 3],
        [0, 2, 5],
        [0, 3, 4],
        [1, 2, 3],
        [1, 2, 4],
        [1, 3, 5],
        [2, 4, 5],
        [3, 4, 5],
    ];
    assert_eq!(betti(&complex(6, vec![], plane)), [1, 1, 1]);
}

#[test]
fn bubbles_that_share_walls_are_counted_one_by_one() {
    // Two tetrahedra on a common face: two voids; three sheets meet at each of its edges.
    let twin = vec![[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3], [0, 1, 4], [0, 2, 4], [1, 2, 4]];
    assert_eq!(betti(&complex(5, vec![], twin)), [1, 0, 2]);
    for n in [1, 2, 5] {
        assert_eq!(betti(&foam(n)), [1, 0, u64::from(n).pow(3)], "{n}");
    }
}

#[test]
fn the_full_skeleton_on_n_points_has_a_void_for_each_independent_tetrahedron() {
    let n = 24u32;
    let faces: Vec<[u32; 3]> = (0..n)
        .flat_map(|a| (a + 1..n).flat_map(move |b| (b + 1..n).map(move |c| [a, b, c])))
        .collect();
    // C(n - 1, 3) tetrahedra at one point bound all the others.
    assert_eq!(betti(&complex(n as usize, vec![], faces)), [1, 0, 23 * 22 * 21 / 6]);
}

#[test]
fn a_million_faces_are_no_burden() {
    let sides = 710;
    let torus = complex((sides * sides) as usize, vec![], torus_grid(sides, sides));
    assert_eq!(betti(&torus), [1, 2, 1]);
}

/// Rank over `Z_2` by elimination on dense rows: nothing shared with the code under test.
fn dense_rank(mut rows: Vec<u128>) -> usize {
    let mut rank = 0;
    for bit in 0..128 {
        let Some(found) = (rank..rows.len()).find(|&r| rows[r] >> bit & 1 == 1) else {
            continue;
        };
        rows.swap(rank, found);
        for r in 0..rows.len() {
            if r != rank && rows[r] >> bit & 1 == 1 {
                rows[r] ^= rows[rank];
            }
        }
        rank += 1;
    }
    rank
}

fn dense_betti(mesh: &MedialMesh) -> [u64; 3] {
    let d1 = mesh.edges.iter().map(|[a, b]| 1 << a | 1 << b).collect();
    let place = |side: [u32; 2]| mesh.edges.iter().position(|&e| e == side).unwrap();
    let sides = |&[a, b, c]: &[u32; 3]| [[a, b], [a, c], [b, c]];
    let d2 = mesh.faces.iter().map(|f| sides(f).iter().map(|&s| 1u128 << place(s)).sum()).collect();
    let (rank1, rank2) = (dense_rank(d1), dense_rank(d2));
    let [v, e, f] = [mesh.spheres.len(), mesh.edges.len(), mesh.faces.len()];
    [(v - rank1) as u64, (e - rank1 - rank2) as u64, (f - rank2) as u64]
}

/// Up to 60 faces on at most 14 points: at most 91 edges, within the 128 bits of the oracle.
fn random_complex() -> impl Strategy<Value = MedialMesh> {
    let sphere = |n: u32| (0..n, 1..n);
    (4..14u32).prop_flat_map(move |n| {
        let edge = sphere(n).prop_map(move |(a, step)| [a, (a + step) % n]);
        let face = (0..n, 0..n, 0..n);
        let edges = prop::collection::vec(edge, 0..20);
        let faces = prop::collection::vec(face, 0..60);
        (edges, faces).prop_map(move |(edges, faces)| {
            let proper = faces.into_iter().filter(|(a, b, c)| a != b && b != c && a != c);
            complex(n as usize, edges, proper.map(|(a, b, c)| [a, b, c]).collect())
        })
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn agrees_with_dense_elimination(mesh in random_complex()) {
        let computed = betti(&mesh);
        prop_assert_eq!(computed, dense_betti(&mesh));
        let [b0, b1, b2] = computed.map(|b| b as i64);
        prop_assert_eq!(euler(&mesh), b0 - b1 + b2);
    }

    #[test]
    fn is_invariant_under_renumbering(
        (mesh, order) in random_complex().prop_flat_map(|mesh| {
            let order: Vec<u32> = (0..mesh.spheres.len() as u32).collect();
            (Just(mesh), Just(order).prop_shuffle())
        }),
    ) {
        let carry = |i: u32| order[i as usize];
        let edges = mesh.edges.iter().map(|e| e.map(carry)).collect();
        let faces = mesh.faces.iter().map(|f| f.map(carry)).collect();
        prop_assert_eq!(betti(&complex(order.len(), edges, faces)), betti(&mesh));
    }
}
