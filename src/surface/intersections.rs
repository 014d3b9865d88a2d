//! Pairs of faces that meet outside their common vertices and edges. Exact.
//!
//! Vertices are shared if they have the same index; see [`triangles_meet`]. Faces of zero area are not
//! tested; they are reported separately.

use std::ops::ControlFlow;

use rayon::prelude::*;

use crate::Vec3;
use crate::geometry::predicates::projection_axis;
use crate::geometry::{TriangleTree, triangles_meet};

/// The intersecting pairs of a mesh.
#[derive(Debug, Default)]
pub(super) struct Intersections {
    /// Number of pairs.
    pub pairs: usize,
    /// The pair with the smallest indices.
    pub first: Option<[u32; 2]>,
    /// Whether all pairs were tested.
    pub complete: bool,
    /// Faces with exactly collinear corners.
    pub degenerate_faces: usize,
    pub first_degenerate: Option<u32>,
    /// Pairs of components with intersecting faces, ascending.
    pub components: Vec<[u32; 2]>,
}

/// Faces tested in parallel before the budget is checked again.
const BLOCK: usize = 512;
/// Bound on the faces that are tested against one face.
const MAX_TESTS_PER_FACE: usize = 10_000;

/// Finds all intersections. `O(F log F + pairs)`, but gives up, and reports it, after a number of
/// tests that no surface of practical use needs.
///
/// `points` are scaled as [`super::mesh::Unit`] does.
pub(super) fn intersections(
    points: &[Vec3],
    faces: &[[u32; 3]],
    component: &[u32],
) -> Intersections {
    let corners = |face: u32| faces[face as usize].map(|v| points[v as usize]);
    let flat: Vec<bool> = (0..faces.len() as u32)
        .into_par_iter()
        .map(|face| projection_axis(corners(face)).is_none())
        .collect();
    let tree = TriangleTree::new(0..faces.len() as u32, corners);
    let mut found = Intersections {
        complete: true,
        degenerate_faces: flat.iter().filter(|&&f| f).count(),
        first_degenerate: flat.iter().position(|&f| f).map(|f| f as u32),
        ..Intersections::default()
    };
    // The budget counts tests, not seconds: the result is the same on every machine.
    let mut budget = 5_000_000 + 200 * faces.len();
    // In blocks: a budget shared by running threads would make the result depend on them.
    for block in (0..tree.len()).step_by(BLOCK) {
        let end = (block + BLOCK).min(tree.len());
        let partial: Vec<Partial> =
            (block..end).into_par_iter().map(|item| meets(&tree, item, faces, component)).collect();
        for part in partial {
            found.pairs += part.pairs;
            found.complete &= part.complete;
            budget = budget.saturating_sub(part.tests);
            found.first = found.first.into_iter().chain(part.first).min();
            found.components.extend(part.components);
        }
        // Now, not after the last block: the list would grow with the pairs of faces.
        found.components.sort_unstable();
        found.components.dedup();
        if budget == 0 && end < tree.len() {
            found.complete = false;
            break;
        }
    }
    found
}

/// The intersections of one face with faces of larger index.
struct Partial {
    pairs: usize,
    tests: usize,
    first: Option<[u32; 2]>,
    complete: bool,
    components: Vec<[u32; 2]>,
}

fn meets(tree: &TriangleTree, item: usize, faces: &[[u32; 3]], component: &[u32]) -> Partial {
    let (face, triangle) = tree.at(item);
    let mut part = Partial { pairs: 0, tests: 0, first: None, complete: true, components: vec![] };
    tree.overlapping(triangle, |other, other_triangle| {
        part.tests += 1;
        if part.tests > MAX_TESTS_PER_FACE {
            part.complete = false;
            return ControlFlow::Break(());
        }
        // Each pair once, from the smaller index.
        if other <= face
            || !triangles_meet(
                faces[face as usize],
                triangle,
                faces[other as usize],
                other_triangle,
            )
        {
            return ControlFlow::Continue(());
        }
        part.pairs += 1;
        part.first = part.first.into_iter().chain([[face, other]]).min();
        let [a, b] = [component[face as usize], component[other as usize]];
        let pair = [a.min(b), a.max(b)];
        if a != b && part.components.last() != Some(&pair) {
            part.components.push(pair);
        }
        ControlFlow::Continue(())
    });
    part
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    type Point = [i128; 3];

    fn sub(a: Point, b: Point) -> Point {
        [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
    }

    fn cross(a: Point, b: Point) -> Point {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    }

    /// Whether two convex planar polygons are disjoint: the separating axis theorem with exact
    /// integers, over all normals, pairs of edges, and edges within each plane.
    fn disjoint(s: &[Point], t: &[Point]) -> bool {
        let [es, et] = [s, t].map(|p| -> Vec<Point> {
            (0..p.len()).map(|i| sub(p[(i + 1) % p.len()], p[i])).collect()
        });
        let normals = [s, t].map(|p| cross(sub(p[1], p[0]), sub(p[2], p[0])));
        let mut axes = normals.to_vec();
        axes.extend(es.iter().flat_map(|&e| et.iter().map(move |&f| cross(e, f))));
        axes.extend(es.iter().chain(&et).flat_map(|&e| normals.map(|n| cross(n, e))));
        axes.into_iter().any(|axis| {
            let [(l, h), (m, i)] = [s, t].map(|polygon| {
                let values = polygon.iter().map(|p| (0..3).map(|k| axis[k] * p[k]).sum::<i128>());
                (values.clone().min().unwrap(), values.max().unwrap())
            });
            h < m || i < l
        })
    }

    /// A face scaled by 1000, cut back by a thousandth at the vertices it shares: the rest
    /// meets the other face if and only if they meet elsewhere than there.
    fn cut_back(corners: [Point; 3], shared: [bool; 3]) -> Vec<Point> {
        let large = corners.map(|p| p.map(|x| 1000 * x));
        let toward = |i: usize, j: usize| {
            let step = sub(corners[j], corners[i]);
            std::array::from_fn(|k| large[i][k] + step[k])
        };
        match shared.iter().filter(|&&s| s).count() {
            0 => large.to_vec(),
            1 => {
                let i = shared.iter().position(|&s| s).unwrap();
                let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                vec![toward(i, j), large[j], large[k], toward(i, k)]
            }
            _ => {
                let i = shared.iter().position(|&s| !s).unwrap();
                let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                vec![large[i], toward(j, i), toward(k, i)]
            }
        }
    }

    fn brute_force(points: &[Point], faces: &[[u32; 3]]) -> Vec<[u32; 2]> {
        let corners = |face: [u32; 3]| face.map(|v| points[v as usize]);
        let flat = |face: [u32; 3]| {
            let [a, b, c] = corners(face);
            cross(sub(b, a), sub(c, a)) == [0; 3]
        };
        let mut pairs = Vec::new();
        for (i, &f) in faces.iter().enumerate().filter(|(_, f)| !flat(**f)) {
            for (j, &g) in faces.iter().enumerate().skip(i + 1).filter(|(_, g)| !flat(**g)) {
                let rest = cut_back(corners(f), f.map(|v| g.contains(&v)));
                let other = corners(g).map(|p| p.map(|x| 1000 * x));
                if !disjoint(&rest, &other) {
                    pairs.push([i as u32, j as u32]);
                }
            }
        }
        pairs
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(400))]

        /// Any faces among few vertices on a small lattice: all cases of contact occur.
        #[test]
        fn agrees_with_separating_axes(
            coordinates in prop::collection::vec(prop::array::uniform3(0_i32..5), 9),
            corners in prop::collection::vec(prop::sample::subsequence((0..9_u32).collect::<Vec<_>>(), 3), 12),
        ) {
            let mut faces: Vec<[u32; 3]> = corners.iter().map(|c| [c[0], c[1], c[2]]).collect();
            faces.sort_unstable();
            faces.dedup();
            let points: Vec<Point> = coordinates.iter().map(|p| p.map(i128::from)).collect();
            let floats: Vec<Vec3> =
                coordinates.iter().map(|p| Vec3::from_array(p.map(f64::from)) / 8.0).collect();
            let expected = brute_force(&points, &faces);
            let found = intersections(&floats, &faces, &vec![0; faces.len()]);
            prop_assert_eq!(found.pairs, expected.len());
            prop_assert_eq!(found.first, expected.first().copied());
            prop_assert!(found.complete && found.components.is_empty());
        }
    }

    #[test]
    fn gives_up_on_hopeless_heaps_and_says_so() {
        // 12,000 large triangles through one another.
        let count = 12_000;
        let angle = |i: u32, k: u32| f64::from(i) * 0.001 + f64::from(k) * 2.0943951;
        let corner = |i: u32, k: u32| {
            Vec3::new(angle(i, k).cos(), angle(i, k).sin(), f64::from((i * 7 + k * 3) % 11) / 11.0)
                * 0.5
        };
        let points: Vec<Vec3> =
            (0..count).flat_map(|i| (0..3).map(move |k| corner(i, k))).collect();
        let faces: Vec<[u32; 3]> = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let found = intersections(&points, &faces, &vec![0; faces.len()]);
        assert!(!found.complete && found.pairs > 1_000_000);
    }
}
