//! Triangle meshes of solids: grid blocks, geodesic spheres, surfaces of revolution, tori.

use std::collections::HashMap;
use std::f64::consts::TAU;

use medial::Vec3;
use medial::surface::TriMesh;

// Surfaces of unions of grid blocks: everything with flat sides and right angles.

/// Grid coordinates along one axis: the breaks, and even divisions of about `edge` between them.
pub(crate) fn divided(breaks: &[f64], edge: f64) -> Vec<f64> {
    let mut ticks = vec![breaks[0]];
    for pair in breaks.windows(2) {
        let n = parts(pair[1] - pair[0], edge, 1);
        ticks.extend((1..=n).map(|k| between(pair[0], pair[1], share(k, n))));
    }
    ticks
}

/// The boundary of the blocks whose centre is `solid`, on the grid of the given coordinates,
/// oriented outward, each vertex carried through `place`.
///
/// Two blocks may not meet in an edge or a corner alone.
pub(crate) fn boundary(
    ticks: &[Vec<f64>; 3],
    solid: impl Fn(Vec3) -> bool,
    place: impl Fn(Vec3) -> Vec3,
) -> TriMesh {
    let mut builder = Builder { ticks, place, mesh: TriMesh::default(), ids: HashMap::new() };
    let cells = [0, 1, 2].map(|axis| ticks[axis].len() as i64 - 1);
    for i in 0..cells[0] {
        for j in 0..cells[1] {
            for k in (0..cells[2]).filter(|&k| is_filled(ticks, &solid, [i, j, k])) {
                for (axis, step) in [(0, -1), (0, 1), (1, -1), (1, 1), (2, -1), (2, 1)] {
                    let mut beyond = [i, j, k];
                    beyond[axis] += step;
                    // Blocks outside the grid count as empty, so its own sides are boundary, too.
                    if !is_filled(ticks, &solid, beyond) {
                        builder.side([i, j, k].map(|n| n as usize), axis, step > 0);
                    }
                }
            }
        }
    }
    builder.mesh
}

/// Whether a block of the grid, which may be outside it, is solid.
fn is_filled(ticks: &[Vec<f64>; 3], solid: &impl Fn(Vec3) -> bool, cell: [i64; 3]) -> bool {
    let inside = (0..3).all(|axis| (0..ticks[axis].len() as i64 - 1).contains(&cell[axis]));
    inside
        && solid(Vec3::from([0, 1, 2].map(|axis| {
            let i = cell[axis] as usize;
            (ticks[axis][i] + ticks[axis][i + 1]) / 2.0
        })))
}

struct Builder<'a, P> {
    ticks: &'a [Vec<f64>; 3],
    place: P,
    mesh: TriMesh,
    ids: HashMap<[usize; 3], u32>,
}

impl<P: Fn(Vec3) -> Vec3> Builder<'_, P> {
    /// The side of a block across `axis`, above or below, as two triangles.
    fn side(&mut self, cell: [usize; 3], axis: usize, above: bool) {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let mut quad = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(du, dv)| {
            let mut node = cell;
            node[axis] += usize::from(above);
            node[u] += du;
            node[v] += dv;
            self.vertex(node)
        });
        if !above {
            quad.swap(1, 3);
        }
        split(&mut self.mesh, quad);
    }

    fn vertex(&mut self, node: [usize; 3]) -> u32 {
        let Self { ticks, place, mesh, ids } = self;
        // By node and not by place: blocks share vertices exactly, for any rounding in `place`.
        *ids.entry(node).or_insert_with(|| {
            let at = [0, 1, 2].map(|axis| ticks[axis][node[axis]]);
            mesh.vertices.push(place(Vec3::from(at)));
            mesh.vertices.len() as u32 - 1
        })
    }
}

/// Adds a quadrilateral as two triangles, cut along its shorter diagonal.
pub(crate) fn split(mesh: &mut TriMesh, [a, b, c, d]: [u32; 4]) {
    let [p, q, r, s] = [a, b, c, d].map(|v| mesh.vertices[v as usize]);
    // A hair's breadth in favour of `ac`, so that rounding does not choose between equals.
    if p.distance(r) <= q.distance(s) * (1.0 + 1e-9) {
        mesh.faces.extend([[a, b, c], [a, c, d]]);
    } else {
        mesh.faces.extend([[a, b, d], [b, c, d]]);
    }
}

// Geodesic spheres: the faces of an icosahedron, divided and pushed out to the sphere.

/// Average edge of a geodesic unit sphere times its frequency.
const EDGE_TIMES_FREQUENCY: f64 = 1.15;

/// The frequency at which a sphere of this radius has edges of about `edge`.
pub(crate) fn frequency(radius: f64, edge: f64) -> u32 {
    (EDGE_TIMES_FREQUENCY * radius / edge).round().max(1.0) as u32
}

/// The unit sphere with every edge of the icosahedron divided into `frequency` parts:
/// `10 frequency^2 + 2` vertices. Oriented outward.
pub(crate) fn unit_sphere(frequency: u32) -> TriMesh {
    let (corners, base) = icosahedron();
    let mut mesh = TriMesh::default();
    // By the icosahedron's corners and their weights, so that neighbouring faces agree exactly.
    let mut ids: HashMap<[(u32, u32); 3], u32> = HashMap::new();
    for face in base {
        let mut vertex = |i: u32, j: u32| {
            let weights = [frequency - i - j, i, j];
            let mut key = [0, 1, 2].map(|k| (if weights[k] > 0 { face[k] } else { 0 }, weights[k]));
            key.sort_unstable();
            *ids.entry(key).or_insert_with(|| {
                let sum: Vec3 = key.iter().map(|&(k, w)| corners[k as usize] * f64::from(w)).sum();
                mesh.vertices.push(sum.normalize());
                mesh.vertices.len() as u32 - 1
            })
        };
        for i in 0..frequency {
            for j in 0..frequency - i {
                let up = [vertex(i, j), vertex(i + 1, j), vertex(i, j + 1)];
                mesh.faces.push(up);
                // The inverted triangle next to it, which the last row does not have.
                if i + j + 2 <= frequency {
                    mesh.faces.push([up[1], vertex(i + 1, j + 1), up[2]]);
                }
            }
        }
    }
    mesh
}

/// Twelve unit corners and twenty faces, counter-clockwise from outside.
fn icosahedron() -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let golden = (1.0 + 5f64.sqrt()) / 2.0;
    let mut corners = Vec::new();
    for turn in 0..3 {
        for (a, b) in [(1.0, golden), (1.0, -golden), (-1.0, golden), (-1.0, -golden)] {
            let mut p = [0.0; 3];
            (p[(turn + 1) % 3], p[(turn + 2) % 3]) = (a, b);
            corners.push(Vec3::from(p).normalize());
        }
    }
    // Neighbouring corners are 2 apart before scaling, all others at least 2 golden.
    let edge = 2.0 / (1.0 + golden * golden).sqrt();
    let near = |a: usize, b: usize| corners[a].distance(corners[b]) < 1.2 * edge;
    let mut faces = Vec::new();
    for a in 0..12 {
        for b in (a + 1..12).filter(|&b| near(a, b)) {
            for c in (b + 1..12).filter(|&c| near(a, c) && near(b, c)) {
                let outward = corners[a].dot(corners[b].cross(corners[c])) > 0.0;
                let [a, b, c] = [a, b, c].map(|corner| corner as u32);
                faces.push(if outward { [a, b, c] } else { [a, c, b] });
            }
        }
    }
    (corners, faces)
}

/// The mesh with every vertex moved by `map`.
pub(crate) fn mapped(mut mesh: TriMesh, map: impl Fn(Vec3) -> Vec3) -> TriMesh {
    mesh.vertices.iter_mut().for_each(|v| *v = map(*v));
    mesh
}

/// The mesh with every face turned over.
pub(crate) fn reversed(mut mesh: TriMesh) -> TriMesh {
    mesh.faces.iter_mut().for_each(|face| face.swap(1, 2));
    mesh
}

/// Two meshes as one.
pub(crate) fn joined(mut first: TriMesh, second: TriMesh) -> TriMesh {
    let offset = first.vertices.len() as u32;
    first.vertices.extend(second.vertices);
    first.faces.extend(second.faces.into_iter().map(|face| face.map(|v| v + offset)));
    first
}

// Surfaces of revolution about the z axis, from pole to pole, with rings that grow in step with
// their radius so that triangles keep their shape.

/// Vertices that each ring of a cap has more than the one above it.
pub(crate) const SECTORS: u32 = 5;

/// A circle of vertices about the z axis, or a pole when `count` is 1.
#[derive(Clone, Copy)]
pub(crate) struct Ring {
    pub(crate) count: u32,
    pub(crate) radius: f64,
    pub(crate) z: f64,
}

/// The closed surface through rings given from the top pole to the bottom pole.
pub(crate) fn surface(rings: &[Ring]) -> TriMesh {
    let mut mesh = TriMesh::default();
    let mut above: Option<(Ring, u32)> = None;
    for &ring in rings {
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend((0..ring.count).map(|i| point(ring, i)));
        if let Some((upper, first_upper)) = above {
            connect(&mut mesh.faces, (upper.count, first_upper), (ring.count, first));
        }
        above = Some((ring, first));
    }
    mesh
}

fn point(ring: Ring, i: u32) -> Vec3 {
    if ring.count == 1 {
        return Vec3::new(0.0, 0.0, ring.z);
    }
    let (sin, cos) = sin_cos_of_part(i, ring.count);
    Vec3::new(ring.radius * cos, ring.radius * sin, ring.z)
}

/// The strip between two rings, each given by its count and first vertex: always the next vertex
/// of the ring that lags behind, in angle.
fn connect(faces: &mut Vec<[u32; 3]>, upper: (u32, u32), lower: (u32, u32)) {
    // A pole has no side: its ring does not advance.
    let [upper_sides, lower_sides] = [upper.0, lower.0].map(|n| if n == 1 { 0 } else { n });
    let (mut i, mut j) = (0, 0);
    while i < upper_sides || j < lower_sides {
        let lower_lags =
            (u64::from(j) + 1) * u64::from(upper.0) <= (u64::from(i) + 1) * u64::from(lower.0);
        if i == upper_sides || (j < lower_sides && lower_lags) {
            faces.push([around(upper, i), around(lower, j), around(lower, j + 1)]);
            j += 1;
        } else {
            faces.push([around(upper, i), around(lower, j), around(upper, i + 1)]);
            i += 1;
        }
    }
}

fn around((count, first): (u32, u32), i: u32) -> u32 {
    first + i % count
}

/// A cap of `steps` rings from a pole outward; `profile` gives radius and z at `t` in 0..=1.
pub(crate) fn cap(steps: u32, profile: impl Fn(f64) -> (f64, f64)) -> Vec<Ring> {
    let rings = (0..=steps).map(|k| {
        let (radius, z) = profile(share(k, steps));
        Ring { count: if k == 0 { 1 } else { SECTORS * k }, radius, z }
    });
    rings.collect()
}

/// The rings of a solid that is symmetric about `z = 0`: the cap on top, a cylinder of `stacks`
/// equal parts below it down to its mirror image, and the mirrored cap.
pub(crate) fn mirrored(top: &[Ring], stacks: u32) -> Vec<Ring> {
    let rim = top[top.len() - 1];
    let between = (1..stacks).map(|k| {
        let z = rim.z * (1.0 - 2.0 * f64::from(k) / f64::from(stacks));
        Ring { z, ..rim }
    });
    let bottom = top.iter().rev().map(|&ring| Ring { z: -ring.z, ..ring });
    top.iter().copied().chain(between).chain(bottom).collect()
}

/// The rings of a profile from pole to pole with edges of about `edge`: the segments between corners, given by radius and
/// z, in equal parts, and vertices of a ring in step with its radius.
pub(crate) fn rings(corners: &[(f64, f64)], edge: f64) -> Vec<Ring> {
    let mut points = vec![corners[0]];
    for pair in corners.windows(2) {
        let (from, to) = (pair[0], pair[1]);
        let n = parts((to.0 - from.0).hypot(to.1 - from.1), edge, 1);
        let at = |t: f64| (between(from.0, to.0, t), between(from.1, to.1, t));
        points.extend((1..=n).map(|k| at(share(k, n))));
    }
    let last = points.len() - 1;
    let rings = points.into_iter().enumerate().map(|(i, (radius, z))| match i {
        _ if i == 0 || i == last => Ring { count: 1, radius: 0.0, z },
        _ => Ring { count: SECTORS * parts(TAU * radius / f64::from(SECTORS), edge, 1), radius, z },
    });
    rings.collect()
}

/// The weighted sum meets both ends exactly, for shares from 0 to 1.
pub(crate) fn between(a: f64, b: f64, share: f64) -> f64 {
    a * (1.0 - share) + b * share
}

/// `i` of `n` equal parts.
pub(crate) fn share(i: u32, n: u32) -> f64 {
    f64::from(i) / f64::from(n)
}

/// Sine and cosine of `i` of `n` equal parts of a full turn.
pub(crate) fn sin_cos_of_part(i: u32, n: u32) -> (f64, f64) {
    (TAU * f64::from(i) / f64::from(n)).sin_cos()
}

/// The number of equal parts of about `edge` in `length`, at least `least`.
pub(crate) fn parts(length: f64, edge: f64, least: u32) -> u32 {
    ((length / edge).round() as u32).max(least)
}

// The torus on a regular grid.

/// A torus about the z axis: `around` sections of `across` vertices each, oriented outward.
pub(crate) fn torus_grid(major: f64, minor: f64, around: u32, across: u32) -> TriMesh {
    let mut mesh = TriMesh::default();
    for i in 0..around {
        let (sin_u, cos_u) = sin_cos_of_part(i, around);
        for j in 0..across {
            let (sin_v, cos_v) = sin_cos_of_part(j, across);
            let radius = major + minor * cos_v;
            mesh.vertices.push(Vec3::new(radius * cos_u, radius * sin_u, minor * sin_v));
        }
    }
    for i in 0..around {
        for j in 0..across {
            let [here, beyond] = [i, (i + 1) % around].map(|i| i * across);
            let next = (j + 1) % across;
            let [a, b, c, d] = [here + j, beyond + j, beyond + next, here + next];
            mesh.faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

/// A cylinder of the given half length and radius with a hemisphere at each end.
pub(crate) fn capsule_of(half: f64, radius: f64, edge: f64) -> TriMesh {
    let quarter = std::f64::consts::FRAC_PI_2;
    let steps = parts(quarter * radius, edge, 2);
    let top = cap(steps, |t| {
        let (sin, cos) = (quarter * t).sin_cos();
        (radius * sin, half + radius * cos)
    });
    surface(&mirrored(&top, stacks(half, radius, steps)))
}

/// Parts of a cylinder as long as the sides of its rings.
pub(crate) fn stacks(half: f64, radius: f64, cap_steps: u32) -> u32 {
    let side = TAU * radius / f64::from(SECTORS * cap_steps);
    parts(2.0 * half, side, 1)
}
