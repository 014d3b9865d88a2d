//! The exact test against homology by brute force, parts by hand, parameters.

use std::collections::BTreeSet;

use medial::Vec3;
use medial::complex::{MedialMesh, Sphere, UnionAxis, betti};
use medial::simplifier::RunContext;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::axis::{Axis, merged};
use super::fins::without_fins;
use super::parts::{Parts, Remaining, levels};

fn complex(n: usize, edges: Vec<[u32; 2]>, faces: Vec<[u32; 3]>) -> MedialMesh {
    let spheres = (0..n).map(|i| Sphere::new(Vec3::splat(i as f64), 1.0)).collect();
    MedialMesh::from_simplices(spheres, edges, faces).expect("a complex")
}

/// Rank over two elements by elimination on rows of bits.
fn rank(mut rows: Vec<u128>) -> usize {
    let mut rank = 0;
    while let Some(row) = rows.pop() {
        if row != 0 {
            rank += 1;
            let lowest = row & row.wrapping_neg();
            rows.iter_mut().filter(|r| **r & lowest != 0).for_each(|r| *r ^= row);
        }
    }
    rank
}

/// A set of simplices, each the set of its vertices.
type Simplices = BTreeSet<Vec<u32>>;

/// The homology of a set of simplices relative to those that are not in it, by definition.
fn homology(all: &Simplices) -> [usize; 3] {
    let of_size = |n: usize| all.iter().filter(move |s| s.len() == n).collect::<Vec<_>>();
    let [vertices, edges, faces] = [1, 2, 3].map(of_size);
    let boundary = |cells: &[&Vec<u32>], sides: &[&Vec<u32>]| {
        let row = |cell: &&Vec<u32>| {
            let is_side = |side: &Vec<u32>| side.iter().all(|v| cell.contains(v));
            let bits = sides.iter().enumerate().filter(|(_, side)| is_side(side));
            bits.fold(0, |row, (i, _)| row | 1 << i)
        };
        assert!(sides.len() <= 128, "bits");
        rank(cells.iter().map(row).collect())
    };
    let (d1, d2) = (boundary(&edges, &vertices), boundary(&faces, &edges));
    [vertices.len() - d1, edges.len() - d1 - d2, faces.len() - d2]
}

/// The remaining simplices, read off the flags.
fn left(remaining: &Remaining<'_>) -> Simplices {
    let whole = &remaining.axis.mesh;
    let vertices = (0..).zip(&remaining.sphere_kept).filter(|v| *v.1).map(|(v, _)| vec![v]);
    let edges = whole.edges.iter().zip(&remaining.edge_kept).filter(|e| *e.1);
    let faces = whole.faces.iter().zip(&remaining.face_kept).filter(|f| *f.1);
    let simplices = vertices.chain(edges.map(|(e, _)| e.to_vec()));
    simplices.chain(faces.map(|(f, _)| f.to_vec())).collect()
}

/// The subcomplex without a set of faces, by definition: the closure of the other faces, and the edges
/// and vertices that are sides of nothing that goes.
fn without(before: &Simplices, gone: &BTreeSet<Vec<u32>>) -> Simplices {
    let within = |small: &[u32], large: &[u32]| small.iter().all(|v| large.contains(v));
    let faces: Vec<_> = before.iter().filter(|s| s.len() == 3).collect();
    let stays = |s: &&Vec<u32>| match s.len() {
        3 => !gone.contains(*s),
        _ => {
            let above: Vec<_> = faces.iter().filter(|f| within(s, f)).collect();
            let curve = before
                .iter()
                .any(|e| e.len() == 2 && within(s, e) && !faces.iter().any(|f| within(e, f)));
            above.is_empty() || curve || above.iter().any(|f| !gone.contains(**f))
        }
    };
    before.iter().filter(stays).cloned().collect()
}

fn random_complex(rng: &mut Pcg64) -> MedialMesh {
    let n = rng.random_range(4..11u32);
    let (faces, edges) = (rng.random_range(1..26), rng.random_range(0..4));
    let mut distinct = |k: usize| {
        let mut chosen: Vec<u32> = Vec::new();
        while chosen.len() < k {
            let v = rng.random_range(0..n);
            if !chosen.contains(&v) {
                chosen.push(v);
            }
        }
        chosen
    };
    let faces = (0..faces).map(|_| <[u32; 3]>::try_from(distinct(3)).expect("three")).collect();
    let edges = (0..edges).map(|_| <[u32; 2]>::try_from(distinct(2)).expect("two")).collect();
    complex(n as usize, edges, faces)
}

/// A regular grid of `w` times `h` vertices from `first`, two triangles to a cell.
fn grid(first: u32, w: u32, h: u32) -> Vec<[u32; 3]> {
    let mut faces = Vec::new();
    for i in 0..w - 1 {
        for j in 0..h - 1 {
            let v = |di: u32, dj: u32| first + (j + dj) * w + i + di;
            faces.extend([[v(0, 0), v(1, 0), v(1, 1)], [v(0, 0), v(1, 1), v(0, 1)]]);
        }
    }
    faces
}

fn random_balls(rng: &mut Pcg64) -> Vec<Sphere> {
    let n = rng.random_range(4..60);
    let largest = [0.2, 0.4, 0.7][rng.random_range(0..3usize)];
    let mut x = || rng.random_range(-1.0..1.0);
    let balls = (0..n).map(|_| Sphere::new(Vec3::new(x(), x(), x()), 0.02 + largest * x().abs()));
    balls.collect()
}

/// A strip or disc, folded so that pieces of a surface are common in the corpus.
fn random_sheets(rng: &mut Pcg64) -> MedialMesh {
    let (w, h) = (rng.random_range(2..6u32), rng.random_range(2..4u32));
    let mut faces = grid(0, w, h);
    // Glue some vertices to others.
    let mut to: Vec<u32> = (0..w * h).collect();
    for _ in 0..rng.random_range(0..5) {
        let (a, b) = (rng.random_range(0..w * h), rng.random_range(0..w * h));
        to[a.max(b) as usize] = to[a.min(b) as usize];
    }
    faces.iter_mut().for_each(|f| *f = f.map(|v| to[v as usize]));
    faces.retain(|[a, b, c]| a != b && b != c && a != c);
    faces.retain(|_| rng.random_range(0..12) > 0);
    complex((w * h) as usize, vec![], faces)
}

#[test]
fn the_exact_test_is_that_of_homology_by_brute_force() {
    let mut rng = Pcg64::seed_from_u64(71);
    let (mut kept, mut lost) = (0, 0);
    for round in 0..4_000 {
        let mesh = if round % 2 == 0 { random_complex(&mut rng) } else { random_sheets(&mut rng) };
        let axis = Axis::of_mesh(mesh);
        let mut remaining = Remaining::all(&axis);
        let mut parts = Parts::of(&remaining);
        let mut there: Vec<usize> = (0..parts.len()).filter(|&p| parts.free[p]).collect();
        while !there.is_empty() {
            let before = left(&remaining);
            assert_eq!(remaining.spheres, before.iter().filter(|s| s.len() == 1).count());
            for &p in &there {
                let face = |&f: &u32| axis.mesh.faces[f as usize].to_vec();
                let gone: Simplices = parts.faces(p).iter().map(face).collect();
                let after = without(&before, &gone);
                let relative: Simplices = before.difference(&after).cloned().collect();
                let vanishes = homology(&relative) == [0, 0, 0];
                let same = homology(&before) == homology(&after);
                assert_eq!(parts.is_removable(p), vanishes, "{:?}", axis.mesh);
                assert_eq!(vanishes, same && parts.has_contact(p), "{:?}", axis.mesh);
                if vanishes {
                    kept += 1;
                } else {
                    lost += 1;
                }
            }
            // Any of them goes, so that the counters meet all states.
            let p = there.swap_remove(rng.random_range(0..there.len()));
            let face = |&f: &u32| axis.mesh.faces[f as usize].to_vec();
            let gone: Simplices = parts.faces(p).iter().map(face).collect();
            parts.remove(p, &mut remaining);
            assert_eq!(left(&remaining), without(&before, &gone), "{:?}", axis.mesh);
        }
        remaining.mesh().check().expect("a complex");
    }
    assert!(kept > 3_000 && lost > 3_000, "{kept} {lost}");
}

#[test]
fn merging_duplicate_vertices_keeps_the_topology() {
    let mut rng = Pcg64::seed_from_u64(74);
    let mut gone = 0;
    for _ in 0..150 {
        let balls = random_balls(&mut rng);
        let whole = UnionAxis::of_balls(&balls).expect("balls").mesh();
        for merge in [0.0, 0.03, 0.1, 0.5] {
            let (mesh, into) = merged(&whole, merge, &RunContext::default()).expect("run");
            mesh.check().expect("a valid complex");
            assert_eq!(betti(&mesh), betti(&whole), "{balls:?}");
            // Each sphere that is left is the first of those that went into it.
            let mut first = vec![usize::MAX; mesh.spheres.len()];
            for (old, &new) in into.iter().enumerate() {
                first[new as usize] = first[new as usize].min(old);
            }
            let of_whole: Vec<Sphere> = first.iter().map(|&v| whole.spheres[v]).collect();
            assert_eq!(of_whole, mesh.spheres);
            assert!(merge > 0.0 || mesh == whole);
            gone += whole.spheres.len() - mesh.spheres.len();
        }
    }
    assert!(gone > 1_000, "{gone}");
}

#[test]
fn taking_fins_away_keeps_the_topology() {
    let mut rng = Pcg64::seed_from_u64(75);
    let mut gone = 0;
    for round in 0..600 {
        let whole = if round % 2 == 0 { random_complex(&mut rng) } else { random_sheets(&mut rng) };
        let is_fin: Vec<bool> = whole.faces.iter().map(|_| rng.random_range(0..3) > 0).collect();
        let (mesh, into, left) = without_fins(&whole, &is_fin);
        mesh.check().expect("a valid complex");
        assert_eq!(betti(&mesh), betti(&whole), "{whole:?} {is_fin:?}");
        // Other parts stay, and so does the remainder of the fins.
        let others = is_fin.iter().filter(|fin| !**fin).count();
        assert_eq!(mesh.faces.len(), others + left);
        let numbers: BTreeSet<u32> = into.iter().copied().collect();
        assert!(numbers.into_iter().eq(0..mesh.spheres.len() as u32));
        for (face, _) in whole.faces.iter().zip(&is_fin).filter(|(_, fin)| !**fin) {
            let face = face.map(|v| into[v as usize]);
            assert!(mesh.faces.contains(&face), "{whole:?} {is_fin:?}");
        }
        gone += whole.faces.len() - mesh.faces.len();
    }
    assert!(gone > 500, "{gone}");
}

#[test]
fn three_sheets_around_a_seam_are_no_loop() {
    // Figure 7, left: three half discs on the seam 0 - 1.
    let axis = Axis::of_mesh(complex(5, vec![], vec![[0, 1, 2], [0, 1, 3], [0, 1, 4]]));
    let remaining = Remaining::all(&axis);
    let parts = Parts::of(&remaining);
    assert!((0..3).all(|p| parts.free[p] && parts.is_removable(p)));
}

#[test]
fn a_handle_on_one_connected_seam_is_a_loop() {
    // A ribbon of three vertices by two (one part), whose short sides lie on the seams 0 - 1 and 1 - 2
    // of a book of two sheets along the path 0 - 1 - 2 each.
    let mut faces = vec![[0, 1, 3], [1, 2, 3], [0, 1, 4], [1, 2, 4]];
    faces.extend([[0, 1, 5], [1, 5, 6], [5, 6, 7], [6, 7, 8], [7, 8, 1], [8, 1, 2]]);
    let axis = Axis::of_mesh(complex(9, vec![], faces));
    let remaining = Remaining::all(&axis);
    let parts = Parts::of(&remaining);
    let ribbon = (0..parts.len()).max_by_key(|&p| parts.faces(p).len()).expect("parts");
    assert_eq!((parts.faces(ribbon).len(), parts.free[ribbon]), (6, true));
    assert!(!parts.is_removable(ribbon));
}

#[test]
fn parts_that_curves_join_are_kept() {
    // Two discs joined by two curves: a loop.
    let mut faces = grid(0, 3, 3);
    faces.extend(grid(9, 3, 3));
    let axis = Axis::of_mesh(complex(19, vec![[0, 9], [2, 18], [11, 18]], faces));
    let remaining = Remaining::all(&axis);
    let parts = Parts::of(&remaining);
    assert_eq!(parts.len(), 2);
    assert_eq!(betti(&axis.mesh), [1, 1, 0]);
    assert!((0..2).all(|p| parts.free[p] && !parts.is_removable(p)));
}

#[test]
fn closed_pieces_have_no_level() {
    let hollow = vec![[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]];
    let axis = Axis::of_mesh(complex(6, vec![[3, 4], [4, 5]], hollow));
    let remaining = Remaining::all(&axis);
    let parts = Parts::of(&remaining);
    assert_eq!((parts.len(), levels(&parts, &remaining)), (1, vec![0]));
    assert!(!parts.free[0]);
}
