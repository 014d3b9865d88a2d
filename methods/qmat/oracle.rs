//! Q-MAT as the paper writes it, with sets, full matrices and no queue: the oracle of the tests.
//!
//! Every step prices what changed, tries all edges in order and takes the first that may be
//! collapsed. It shares with the method the link condition, which has an oracle of its own, and the
//! documented rules beside the paper: ties, and what replaces a minimiser.

use std::collections::{BTreeMap, BTreeSet};

use medial::Vec3;
use medial::complex::collapse::CollapseComplex;
use medial::complex::{MedialMesh, Sphere};

use super::params::{Boundary, QmatParams};

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

/// What the oracle would do with an edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct Choice {
    pub ends: [u32; 2],
    pub sphere: Sphere,
    /// Whether the optimum folds a face over, so that another placement is taken.
    pub is_fallback: bool,
}

/// A complex with what the paper keeps of it.
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
        let weight = match self.params.boundary {
            Boundary::Paper => self.params.k_boundary * stability(m, n).powi(2),
            _ => 0.0,
        };
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
        match error.minimiser(self.params.singular_ratio).filter(is_near) {
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
