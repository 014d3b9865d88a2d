//! The contraction on complexes made by hand.

use std::collections::{BTreeMap, BTreeSet};

use medial::Vec3;
use medial::complex::collapse::CollapseComplex;
use medial::complex::{MedialMesh, Sphere, betti};
use medial::simplifier::RunContext;
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::contract::Contraction;
use super::{QmatParams, *};
use crate::quadric::{Quadric, SINGULAR_RATIO};

fn params() -> QmatParams {
    QmatParams::default()
}

fn contract(mesh: &MedialMesh, params: QmatParams, target: usize) -> (MedialMesh, Contraction) {
    let mut contraction = Contraction::new(mesh, params);
    contraction.run_to(mesh, target, &RunContext::default()).unwrap();
    let result = contraction.complex.to_mesh();
    result.check().unwrap();
    (result, contraction)
}

fn spheres_at(points: impl IntoIterator<Item = (Vec3, f64)>) -> Vec<Sphere> {
    points.into_iter().map(|(centre, radius)| Sphere::new(centre, radius)).collect()
}

/// A triangulated `n` by `n` grid on the unit square, lifted by `lift`.
fn grid(n: u32, lift: impl Fn(f64, f64) -> (f64, f64)) -> MedialMesh {
    let side = f64::from(n - 1);
    let spheres = spheres_at((0..n * n).map(|v| {
        let (x, y) = (f64::from(v % n) / side, f64::from(v / n) / side);
        let (z, radius) = lift(x, y);
        (Vec3::new(x, y, z), radius)
    }));
    let faces = (0..(n - 1) * (n - 1))
        .flat_map(|cell| {
            let v = cell / (n - 1) * n + cell % (n - 1);
            [[v, v + 1, v + n + 1], [v, v + n, v + n + 1]]
        })
        .collect();
    MedialMesh::from_simplices(spheres, vec![], faces).unwrap()
}

/// A bumpy sheet without ties: no symmetry, no cospherical samples.
fn bumpy(n: u32) -> MedialMesh {
    grid(n, |x, y| {
        let z = 0.1 * (5.0 * x + 0.3).sin() * (4.0 * y + 0.7 * x).cos() + 0.013 * x * y;
        (z, 0.12 + 0.03 * (7.0 * x + 3.1 * y * y).sin())
    })
}

#[test]
fn slabs_of_one_affine_plane_collapse_without_error() {
    let on_plane = |c: Vec3| (c.z - 0.2 * c.x - 0.1 * c.y).abs();
    let radius = |x: f64, y: f64| 0.1 + 0.3 * x - 0.05 * y;
    let initial = grid(9, |x, y| (0.2 * x + 0.1 * y, radius(x, y)));
    let no_boundary = QmatParams { k_boundary: 0.0, ..params() };
    for target in [60, 20, 5] {
        let (mesh, contraction) = contract(&initial, no_boundary, target);
        assert_eq!(mesh.spheres.len(), target);
        for m in &mesh.spheres {
            assert!(on_plane(m.centre) < 1e-12, "{m:?}");
            assert!((m.radius - radius(m.centre.x, m.centre.y)).abs() < 1e-12, "{m:?}");
        }
        assert!(contraction.largest_error() < 1e-14, "{}", contraction.largest_error());
    }
}

#[test]
fn stable_boundaries_stay_where_they_are() {
    let initial = grid(12, |_, _| (0.0, 0.1));
    let area = |mesh: &MedialMesh| {
        let at = |v: u32| mesh.spheres[v as usize].centre;
        let doubled = |f: &[u32; 3]| (at(f[1]) - at(f[0])).cross(at(f[2]) - at(f[0])).length();
        mesh.faces.iter().map(doubled).sum::<f64>() / 2.0
    };
    let shrunk = |k_boundary| {
        let (mesh, _) = contract(&initial, QmatParams { k_boundary, ..params() }, 8);
        1.0 - area(&mesh)
    };
    let [paper, none] = [0.1, 0.0].map(shrunk);
    assert!(paper.abs() < 0.05, "{paper}");
    assert!(paper < 0.2 * none, "{paper} {none}");
}

#[test]
fn coincident_centres_go_first_and_keep_loops() {
    // A triangle of lone edges, each vertex doubled by a coincident one.
    let corners = [Vec3::ZERO, Vec3::X, Vec3::new(0.4, 0.9, 0.0)];
    let noise = Vec3::splat(3e-17);
    let doubled = corners.iter().flat_map(|&c| [(c, 0.1), (c + noise, 0.1 + 1e-17)]);
    let edges = vec![[0, 1], [2, 3], [4, 5], [1, 2], [3, 4], [0, 5]];
    let initial = MedialMesh::from_simplices(spheres_at(doubled), edges, vec![]).unwrap();
    let all = QmatParams { topology_from: TopologyFrom::All, ..params() };
    let (three, _) = contract(&initial, all, 3);
    for (m, corner) in three.spheres.iter().zip(corners) {
        assert!(m.centre.distance(corner) < 1e-15);
    }
    let (stuck, mut contraction) = contract(&initial, all, 1);
    assert_eq!(stuck, three);
    let why = why_stopped(&mut contraction.complex, true);
    assert!(why.contains("holds back 3 of the 3 edges"), "{why}");
    let never = QmatParams { topology_from: TopologyFrom::Never, ..params() };
    assert_eq!(contract(&initial, never, 1).0.spheres.len(), 1);
}

#[test]
fn degenerate_complexes_are_contracted_to_one_sphere_of_each_component() {
    let point = |_: u32| (Vec3::new(0.1, 0.2, 0.3), 0.25);
    let line = |v: u32| (Vec3::new(f64::from(v), 0.0, 0.0), 0.0);
    let nested =
        |v: u32| (Vec3::new(0.1 * f64::from(v), 0.01 * f64::from(v * v), 0.0), f64::from(v));
    let makers: [&dyn Fn(u32) -> (Vec3, f64); 3] = [&point, &line, &nested];
    for make in makers {
        let spheres = spheres_at((0..10).map(make));
        let faces = vec![[0, 1, 2], [1, 2, 3], [1, 2, 4], [2, 3, 5], [5, 6, 7]];
        let initial = MedialMesh::from_simplices(spheres, vec![[4, 8]], faces).unwrap();
        let (mesh, mut contraction) = contract(&initial, params(), 1);
        assert_eq!(mesh.spheres.len(), 2, "two components, {:?}", initial.spheres);
        assert!(why_stopped(&mut contraction.complex, true).contains("component"));
    }
}

#[test]
fn a_star_of_thousands_of_edges_is_contracted() {
    let leaves = 6000;
    let mut spheres = vec![Sphere::new(Vec3::ZERO, 1.0)];
    spheres.extend(spheres_at((0..leaves).map(|i| {
        let angle = f64::from(i) * 2.399_963;
        let reach = 1.5 + 0.3 * (f64::from(i) * 0.37).sin();
        (reach * Vec3::new(angle.cos(), angle.sin(), 0.0), 0.3)
    })));
    let edges = (1..=leaves).map(|i| [0, i]).collect();
    let initial = MedialMesh::from_simplices(spheres, edges, vec![]).unwrap();
    let (mesh, _) = contract(&initial, params(), leaves as usize - 200);
    assert_eq!(mesh.edges.len(), mesh.spheres.len() - 1);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// With the link condition from the start no Betti number changes, for any complex.
    #[test]
    fn random_complexes_keep_their_betti_numbers(
        points in prop::collection::vec((prop::array::uniform3(0.0..1.0f64), 0.0..0.3f64), 12),
        faces in prop::collection::vec(prop::sample::subsequence((0..12_u32).collect::<Vec<_>>(), 3), 0..30),
        edges in prop::collection::vec(prop::sample::subsequence((0..12_u32).collect::<Vec<_>>(), 2), 0..8),
        coincident in any::<bool>(),
    ) {
        let place = |c: [f64; 3]| if coincident { Vec3::from(c.map(f64::round)) } else { c.into() };
        let spheres = spheres_at(points.into_iter().map(|(c, r)| (place(c), r)));
        let faces = faces.into_iter().map(|f| [f[0], f[1], f[2]]).collect();
        let edges = edges.into_iter().map(|e| [e[0], e[1]]).collect();
        let initial = MedialMesh::from_simplices(spheres, edges, faces).unwrap();
        let all = QmatParams { topology_from: TopologyFrom::All, ..params() };
        for target in [9, 5, 1] {
            let (mesh, _) = contract(&initial, all, target);
            prop_assert_eq!(betti(&mesh), betti(&initial));
        }
    }
}

/// Follows the contraction and the oracle to the end; the number of fallbacks, and of collapses.
fn follow(mesh: &MedialMesh, params: QmatParams) -> [usize; 3] {
    let mut oracle = Oracle::new(mesh, params);
    let mut contraction = Contraction::new(mesh, params);
    let (mut fallbacks, mut collapses) = (0, 0);
    while let Some(expected) = oracle.next() {
        let done = contraction.complex.record().len();
        let target = contraction.complex.sphere_count() - 1;
        contraction.run_to(mesh, target, &RunContext::default()).unwrap();
        let record = contraction.complex.record();
        assert_eq!(record.len(), done + 1, "{expected:?}");
        let taken = record[done];
        let ends = [taken.kept.min(taken.removed), taken.kept.max(taken.removed)];
        assert_eq!(ends, expected.ends, "step {done}: {taken:?} instead of {expected:?}");
        let off = taken.sphere.centre.distance(expected.sphere.centre)
            + (taken.sphere.radius - expected.sphere.radius).abs();
        assert!(off < 1e-6, "step {done}: {taken:?} instead of {expected:?}");
        fallbacks += usize::from(expected.is_fallback);
        collapses += 1;
        oracle.collapse(taken.kept, taken.removed, taken.sphere);
        let complex = &contraction.complex;
        assert_eq!([complex.edge_count(), complex.face_count()], oracle.sizes());
    }
    // Only edges that Betti numbers alone allow are left.
    let (left, unlocked) = (contraction.complex.sphere_count(), contraction.tally.unlocked);
    contraction.run_to(mesh, 1, &RunContext::default()).unwrap();
    assert!(contraction.complex.sphere_count() == left || contraction.tally.unlocked > unlocked);
    [fallbacks, collapses, oracle.postponed]
}

#[test]
fn order_placement_and_fallback_are_those_of_the_paper_by_brute_force() {
    let mut rng = Pcg64::seed_from_u64(81);
    let mut totals = [0; 3];
    for round in 0..800 {
        let n = rng.random_range(6..14_u32);
        let mut x = || rng.random_range(0.0..1.0);
        let spheres =
            spheres_at((0..n).map(|_| (Vec3::new(x(), x(), x()), 0.02 + 0.3 * x() * x())));
        let mut distinct = || {
            let a = rng.random_range(0..n);
            let b = (a + rng.random_range(1..n)) % n;
            let c = (0..n).filter(|v| ![a, b].contains(v)).nth(rng.random_range(0..n as usize - 2));
            [a, b, c.expect("three of six")]
        };
        let faces: Vec<[u32; 3]> = (0..2 * n).map(|_| distinct()).collect();
        let edges = (0..n / 3).map(|_| distinct()).map(|[a, b, _]| [a, b]).collect();
        let initial = MedialMesh::from_simplices(spheres, edges, faces).unwrap();
        let topology_from = [TopologyFrom::Never, TopologyFrom::All][round / 2 % 2];
        let k_boundary = [0.1, 0.0][round % 2];
        let params = QmatParams { topology_from, k_boundary, ..params() };
        totals.iter_mut().zip(follow(&initial, params)).for_each(|(all, n)| *all += n);
    }
    for (bumps, topology_from) in [6, 8, 11]
        .into_iter()
        .flat_map(|n| [TopologyFrom::All, TopologyFrom::Spheres(20)].map(|from| (n, from)))
    {
        let found = follow(&bumpy(bumps), QmatParams { topology_from, ..params() });
        totals.iter_mut().zip(found).for_each(|(all, n)| *all += n);
    }
    let [fallbacks, collapses, postponed] = totals;
    assert!(fallbacks > 10 && collapses > 3_000 && postponed > 50, "{totals:?}");
}

// ----------------------------------------------------------------------------
// Quadrics against their definition, and the singularity test against eigenvalues. Those of slabs, cones
// and boundaries are compared by their results, with the oracle below.

fn vector() -> impl Strategy<Value = Vec3> {
    prop::array::uniform3(-1.0..1.0f64).prop_map(Vec3::from)
}

fn sphere() -> impl Strategy<Value = Sphere> {
    (vector(), 0.0..0.5f64).prop_map(|(centre, radius)| Sphere::new(centre, radius))
}

proptest! {
    /// A sum of squared distances to planes, and the least value where the minimiser is.
    #[test]
    fn value_and_minimiser(
        planes in prop::collection::vec((vector(), sphere(), 0.1..2.0f64), 4..12),
        at in sphere(),
        step in (vector(), -1.0..1.0f64),
    ) {
        let mut quadric = Quadric::default();
        for &(normal, touching, weight) in &planes {
            quadric.add_plane(normal, touching, weight);
        }
        let distance = |m: Sphere, normal: Vec3, touching: Sphere| {
            normal.dot(m.centre - touching.centre) + (m.radius - touching.radius)
        };
        let value = |m| planes.iter().map(|&(n, t, w)| w * distance(m, n, t).powi(2)).sum::<f64>();
        prop_assert!((quadric.value(at) - value(at)).abs() < 1e-12);
        if let Some(best) = quadric.minimiser(1e-6) {
            let moved = Sphere::new(best.centre + 1e-3 * step.0, best.radius + 1e-3 * step.1);
            prop_assert!(value(best) <= value(moved) + 1e-9);
        }
    }

    /// Whether a quadric is singular is decided by the eigenvalues of `A`, known here by making:
    /// four orthogonal planes with the given weights.
    #[test]
    fn singular_is_a_ratio_of_eigenvalues(
        angles in prop::array::uniform3(0.0..6.0f64), exponent in -16.0..-4.0f64,
    ) {
        // (n, 1) for the rows of a rotated tetrahedral frame are orthogonal in R^4 when n has
        // length sqrt(3) and the n make a regular tetrahedron.
        let rotation = |v: Vec3| v.rotate_x(angles[0]).rotate_y(angles[1]).rotate_z(angles[2]);
        let corners = [[1., 1., 1.], [1., -1., -1.], [-1., 1., -1.], [-1., -1., 1.]];
        let weights = [1.0, 0.5, 1e-3, 10_f64.powf(exponent)];
        let mut quadric = Quadric::default();
        let touching = Sphere::new(Vec3::new(0.1, 0.2, 0.3), 0.4);
        for (corner, weight) in corners.into_iter().zip(weights) {
            quadric.add_plane(rotation(Vec3::from(corner)), touching, weight);
        }
        let minimiser = quadric.minimiser(1e-10);
        if exponent < -10.001 {
            prop_assert_eq!(minimiser, None);
        }
        if exponent > -9.999 {
            let found = minimiser.expect("well above the threshold");
            prop_assert!(found.centre.distance(touching.centre) < 1e-4);
        }
    }
}

// ----------------------------------------------------------------------------
// Q-MAT as the paper writes it, with sets, full matrices and no queue: the oracle of the tests.
//
// Every step prices the changes, tries all edges in order and takes the first that may be
// collapsed. It shares with the method the link condition, tested by a separate oracle, and the documented rules
// outside the paper: ties, and the replacement of a minimiser.

/// A point of `R^4`: centre and radius.
type Point = [f64; 4];
/// A symmetric matrix in full.
type Matrix = [[f64; 4]; 4];

/// `(m - m0)^T A (m - m0)`, summed.
#[derive(Clone, Copy, Default)]
struct Error {
    a: Matrix,
    b: Point,
    c: f64,
}

/// The oracle's decision on an edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct Choice {
    pub ends: [u32; 2],
    pub sphere: Sphere,
    /// Whether the optimum folds a face over, so that another placement is taken.
    pub is_fallback: bool,
}

/// A complex with the paper's state.
pub(super) struct Oracle {
    params: QmatParams,
    spheres: Vec<Sphere>,
    edges: BTreeSet<[u32; 2]>,
    faces: BTreeSet<[u32; 3]>,
    errors: Vec<Error>,
    /// Cost and tie of each edge.
    prices: BTreeMap<[u32; 2], (f64, f64)>,
    /// Number of spheres left.
    left: usize,
    /// How often an edge went back into the queue at a higher cost.
    pub postponed: usize,
}

fn point(m: Sphere) -> Point {
    [m.centre.x, m.centre.y, m.centre.z, m.radius]
}

fn times(a: &Matrix, m: Point) -> Point {
    a.map(|row| dot(row, m))
}

fn dot(u: Point, v: Point) -> f64 {
    (0..4).map(|i| u[i] * v[i]).sum()
}

impl Error {
    /// Adds `weight (m - m0)^T A (m - m0)`.
    fn add(&mut self, weight: f64, a: &Matrix, m0: Sphere) {
        let moved = times(a, point(m0));
        for i in 0..4 {
            for j in 0..4 {
                self.a[i][j] += weight * a[i][j];
            }
            self.b[i] -= 2.0 * weight * moved[i];
        }
        self.c += weight * dot(point(m0), moved);
    }

    fn sum(&self, other: &Self) -> Self {
        let mut sum = *self;
        sum.add_all(other);
        sum
    }

    fn add_all(&mut self, other: &Self) {
        for i in 0..4 {
            for j in 0..4 {
                self.a[i][j] += other.a[i][j];
            }
            self.b[i] += other.b[i];
        }
        self.c += other.c;
    }

    fn at(&self, m: Sphere) -> f64 {
        let m = point(m);
        (dot(m, times(&self.a, m)) + dot(self.b, m) + self.c).max(0.0)
    }

    /// `-A^-1 b / 2` from the eigenvectors, or nothing where the smallest eigenvalue is too small.
    fn minimiser(&self, singular_ratio: f64) -> Option<Sphere> {
        let (values, vectors) = eigen(self.a);
        let largest = values.iter().copied().fold(0.0, f64::max);
        if !values.iter().all(|&value| value > singular_ratio * largest) {
            return None;
        }
        let mut m = [0.0; 4];
        for (value, vector) in values.iter().zip(vectors) {
            let along = -0.5 * dot(vector, self.b) / value;
            (0..4).for_each(|i| m[i] += along * vector[i]);
        }
        Some(Sphere::new(Vec3::new(m[0], m[1], m[2]), m[3]))
    }
}

/// Eigenvalues and eigenvectors by Jacobi rotations.
fn eigen(mut a: Matrix) -> (Point, [Point; 4]) {
    let mut vectors: Matrix = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(i == j)));
    for _ in 0..30 {
        for p in 0..3 {
            for q in p + 1..4 {
                let angle = 0.5 * (2.0 * a[p][q]).atan2(a[q][q] - a[p][p]);
                let (sin, cos) = angle.sin_cos();
                for k in 0..4 {
                    (a[k][p], a[k][q]) =
                        (cos * a[k][p] - sin * a[k][q], sin * a[k][p] + cos * a[k][q]);
                }
                for k in 0..4 {
                    (a[p][k], a[q][k]) =
                        (cos * a[p][k] - sin * a[q][k], sin * a[p][k] + cos * a[q][k]);
                    (vectors[p][k], vectors[q][k]) = (
                        cos * vectors[p][k] - sin * vectors[q][k],
                        sin * vectors[p][k] + cos * vectors[q][k],
                    );
                }
            }
        }
    }
    ([a[0][0], a[1][1], a[2][2], a[3][3]], vectors)
}

/// `alpha u u^T + beta v v^T + gamma I` in space, with a last column and a last entry.
fn matrix(terms: &[(f64, Vec3)], identity: f64, column: Vec3, last: f64) -> Matrix {
    let mut a = [[0.0; 4]; 4];
    for i in 0..3 {
        for &(factor, u) in terms {
            (0..3).for_each(|j| a[i][j] += factor * u[i] * u[j]);
        }
        a[i][i] += identity;
        (a[i][3], a[3][i]) = (column[i], column[i]);
    }
    a[3][3] = last;
    a
}

/// The plane with unit normal `n` that a sphere touches.
fn plane(n: Vec3) -> Matrix {
    matrix(&[(1.0, n)], 0.0, n, 1.0)
}

/// Equation 3.
fn stability(a: Sphere, b: Sphere) -> f64 {
    let d = a.centre.distance(b.centre);
    ((d - (a.radius - b.radius).abs()) / d).max(0.0)
}

impl Oracle {
    pub(super) fn new(mesh: &MedialMesh, params: QmatParams) -> Self {
        let mut oracle = Self {
            params,
            spheres: mesh.spheres.clone(),
            edges: mesh.edges.iter().copied().collect(),
            faces: mesh.faces.iter().copied().collect(),
            errors: vec![Error::default(); mesh.spheres.len()],
            prices: BTreeMap::new(),
            left: mesh.spheres.len(),
            postponed: 0,
        };
        for &face in &mesh.faces {
            oracle.add_slab(face);
        }
        for &edge in &mesh.edges {
            oracle.add_edge(edge);
        }
        for &edge in &mesh.edges {
            oracle.price(edge);
        }
        oracle
    }

    fn at(&self, v: u32) -> Sphere {
        self.spheres[v as usize]
    }

    /// The gradient of the radius over a face, in its plane, and the unit normal.
    fn gradient(&self, face: [u32; 3]) -> (Vec3, Vec3) {
        let [m0, m1, m2] = face.map(|v| self.at(v));
        let (e1, e2) = (m1.centre - m0.centre, m2.centre - m0.centre);
        let (r1, r2) = (m1.radius - m0.radius, m2.radius - m0.radius);
        let (aa, ab, bb) = (e1.dot(e1), e1.dot(e2), e2.dot(e2));
        let determinant = aa * bb - ab * ab;
        let x = (r1 * bb - r2 * ab) / determinant;
        let y = (r2 * aa - r1 * ab) / determinant;
        (x * e1 + y * e2, e1.cross(e2).normalize())
    }

    /// Equation 1: both tangent planes, for all three spheres.
    fn add_slab(&mut self, face: [u32; 3]) {
        let (g, n) = self.gradient(face);
        let rest = 1.0 - g.dot(g);
        if rest > 0.0 {
            let a = matrix(&[(2.0, g), (2.0 * rest, n)], 0.0, -2.0 * g, 2.0);
            for v in face {
                self.errors[v as usize].add(1.0, &a, self.spheres[face[0] as usize]);
            }
        }
    }

    /// The cone of a lone edge; the boundary planes of section 4.4.
    fn add_edge(&mut self, edge: [u32; 2]) {
        let [a, b] = edge;
        let (m, n) = (self.at(a), self.at(b));
        let length = m.centre.distance(n.centre);
        let (u, s) = ((n.centre - m.centre) / length, (n.radius - m.radius) / length);
        if s.abs() >= 1.0 {
            return;
        }
        let weight = self.params.k_boundary * stability(m, n).powi(2);
        let around: Vec<[u32; 3]> =
            self.faces.iter().filter(|f| f.contains(&a) && f.contains(&b)).copied().collect();
        match around.as_slice() {
            [] => {
                let across = 2.0 * (1.0 - s * s);
                let cone = matrix(&[(4.0 * s * s - across, u)], across, -4.0 * s * u, 4.0);
                for v in edge {
                    self.errors[v as usize].add(1.0, &cone, m);
                }
                for (end, outwards) in [(a, -u), (b, u)] {
                    if self.edges.iter().filter(|e| e.contains(&end)).count() == 1 {
                        let tip = self.at(end);
                        self.errors[end as usize].add(weight, &plane(outwards), tip);
                    }
                }
            }
            [face] => {
                let apex = face.iter().find(|v| !edge.contains(v)).map(|&v| self.at(v).centre);
                let inwards = apex.expect("a third corner") - m.centre;
                let away = -(inwards - inwards.dot(u) * u).normalize();
                let normal = -s * u + (1.0 - s * s).sqrt() * away;
                for v in edge {
                    self.errors[v as usize].add(weight, &plane(normal), m);
                }
            }
            _ => {}
        }
    }

    /// Equations 5, 6 and 8.
    fn price(&mut self, edge: [u32; 2]) {
        let error = self.error_of(edge);
        let price = self.priced(edge, error.at(self.optimum(edge, &error)));
        self.prices.insert(edge, price);
    }

    fn error_of(&self, [a, b]: [u32; 2]) -> Error {
        self.errors[a as usize].sum(&self.errors[b as usize])
    }

    fn priced(&self, [a, b]: [u32; 2], error: f64) -> (f64, f64) {
        let ratio = stability(self.at(a), self.at(b));
        ((error + self.params.k) * ratio * ratio, error)
    }

    fn optimum(&self, [a, b]: [u32; 2], error: &Error) -> Sphere {
        let (m, n) = (self.at(a), self.at(b));
        let middle = m.lerp(n, 0.5);
        let reach = m.centre.distance(n.centre) + m.radius.max(n.radius);
        let is_near = |s: &Sphere| {
            s.centre.distance(middle.centre) <= reach && (s.radius - middle.radius).abs() <= reach
        };
        match error.minimiser(SINGULAR_RATIO).filter(is_near) {
            Some(sphere) if sphere.radius < 0.0 => middle,
            Some(sphere) => sphere,
            None => self.three([a, b], error)[0],
        }
    }

    /// Both ends and the midpoint, the least error first.
    fn three(&self, [a, b]: [u32; 2], error: &Error) -> [Sphere; 3] {
        let (m, n) = (self.at(a), self.at(b));
        let mut three = [m, n, m.lerp(n, 0.5)];
        three.sort_by(|x, y| error.at(*x).total_cmp(&error.at(*y)));
        three
    }

    fn folds(&self, [a, b]: [u32; 2], to: Sphere) -> bool {
        let is_moved = |v: &u32| *v == a || *v == b;
        self.faces.iter().filter(|f| f.iter().filter(|v| is_moved(v)).count() == 1).any(|f| {
            let area = |at: &dyn Fn(u32) -> Vec3| {
                let [p, q, r] = f.map(at);
                (q - p).cross(r - p)
            };
            let before = area(&|v| self.at(v).centre);
            let after = area(&|v| if is_moved(&v) { to.centre } else { self.at(v).centre });
            before.dot(after) < 0.0
        })
    }

    /// Sections 4.5 and 4.6: the first edge in order that may be collapsed, and where to.
    pub(super) fn next(&mut self) -> Option<Choice> {
        let mesh = self.mesh();
        let mut complex = CollapseComplex::from_mesh(&mesh);
        let checks = self.params.topology_from.applies(self.left);
        loop {
            let mut order: Vec<([u32; 2], (f64, f64))> =
                self.prices.iter().map(|(&edge, &price)| (edge, price)).collect();
            order.sort_by(|x, y| {
                let prices = x.1.0.total_cmp(&y.1.0).then(x.1.1.total_cmp(&y.1.1));
                prices.then(x.0.cmp(&y.0))
            });
            let mut is_postponed = false;
            for (edge, price) in order {
                if checks && !complex.keeps_homotopy(edge[0], edge[1]) {
                    continue;
                }
                match self.placed(edge, price) {
                    Placed::At(choice) => return Some(choice),
                    Placed::Dearer(dearer) => {
                        self.prices.insert(edge, dearer);
                        self.postponed += 1;
                        is_postponed = true;
                        break;
                    }
                    Placed::Nowhere => {}
                }
            }
            if !is_postponed {
                return None;
            }
        }
    }

    fn placed(&self, ends: [u32; 2], (cost, tie): (f64, f64)) -> Placed {
        let error = self.error_of(ends);
        let optimum = self.optimum(ends, &error);
        let at = |sphere, is_fallback| Placed::At(Choice { ends, sphere, is_fallback });
        if !self.folds(ends, optimum) {
            return at(optimum, false);
        }
        let other = self.three(ends, &error).into_iter().find(|&s| !self.folds(ends, s));
        let Some(other) = other else { return Placed::Nowhere };
        let dearer = self.priced(ends, error.at(other));
        if (cost, tie) < dearer { Placed::Dearer(dearer) } else { at(other, true) }
    }

    pub(super) fn collapse(&mut self, kept: u32, removed: u32, sphere: Sphere) {
        let image = |v: u32| if v == removed { kept } else { v };
        let edges = std::mem::take(&mut self.edges).into_iter().map(|e| sorted(e.map(image)));
        self.edges = edges.filter(|e| e[0] < e[1]).collect();
        let faces = std::mem::take(&mut self.faces).into_iter().map(|f| sorted(f.map(image)));
        self.faces = faces.filter(|f| f[0] < f[1] && f[1] < f[2]).collect();
        let gone = self.errors[removed as usize];
        self.errors[kept as usize].add_all(&gone);
        self.spheres[kept as usize] = sphere;
        self.left -= 1;
        let edges = &self.edges;
        self.prices.retain(|edge, _| edges.contains(edge));
        let changed: Vec<_> = self.edges.iter().filter(|e| e.contains(&kept)).copied().collect();
        changed.into_iter().for_each(|edge| self.price(edge));
    }

    /// The complex; spheres that are gone are isolated in it.
    fn mesh(&self) -> MedialMesh {
        MedialMesh {
            spheres: self.spheres.clone(),
            edges: self.edges.iter().copied().collect(),
            faces: self.faces.iter().copied().collect(),
            contacts: None,
        }
    }

    /// Numbers of edges and faces.
    pub(super) fn sizes(&self) -> [usize; 2] {
        [self.edges.len(), self.faces.len()]
    }
}

enum Placed {
    At(Choice),
    Dearer((f64, f64)),
    Nowhere,
}

fn sorted<const N: usize>(mut simplex: [u32; N]) -> [u32; N] {
    simplex.sort_unstable();
    simplex
}
