//! Triangle meshes of implicit surfaces.
//!
//! Dual contouring on a cubic lattice with one vertex for each cell that the surface crosses, after
//! S. F. F. Gibson, "Constrained elastic surface nets", MICCAI 1998,
//! <https://doi.org/10.1007/BFb0056277>.
//!
//! 1. Find the cells that the surface may cross: a block whose centre is farther from the surface
//!    than its corners are from its centre holds none.
//! 2. One vertex for each cell with corners on both sides, at the mean of the crossings.
//! 3. One quadrilateral for each lattice edge that crosses the surface, through its four cells.
//! 4. Let the vertices slide towards the mean of their neighbours, on the surface.
//! 5. Cut each quadrilateral along its shorter diagonal.
//!
//! Deviations: step 4 projects to the surface itself instead of staying in the cell, so that
//! vertices end up on the surface to rounding. A lattice that meets the surface in an ambiguous
//! way gives a non-manifold mesh; then a slightly finer one is tried.

use std::collections::HashMap;

use medial::Vec3;
use medial::surface::{TriMesh, validate};

use crate::solids::split;

/// Rounds of step 4; the triangles hardly change after that.
const ROUNDS: usize = 15;
/// Lattices tried, each finer by [`REFINEMENT`], before the shape is given up.
const ATTEMPTS: i32 = 60;
const REFINEMENT: f64 = 0.98;

/// The zero surface of a field with Lipschitz constant 1 within `[-half, half]`, with edges of
/// about `edge`, closed and manifold, of the given Euler number, oriented outward.
///
/// # Panics
/// If no lattice between `edge` and a third of it gives such a mesh: the shape has features
/// smaller than `edge`.
pub(crate) fn polygonise(
    field: &impl Field,
    half: Vec3,
    edge: f64,
    expected_euler: i64,
) -> TriMesh {
    (0..ATTEMPTS)
        .map(|attempt| surface_net(field, half, edge * REFINEMENT.powi(attempt)))
        .find(|mesh| validate(mesh).is_ok_and(|report| report.euler == expected_euler))
        .expect("a lattice of this spacing resolves the shape")
}

fn surface_net(field: &impl Field, half: Vec3, edge: f64) -> TriMesh {
    let lattice = Lattice::around(half, edge);
    let mut cells = Vec::new();
    lattice.crossed(field, [0; 3], lattice.size, &mut cells);
    let mut net = Net::default();
    // All vertices before any quadrilateral, which needs those of its four cells.
    for &cell in &cells {
        net.add_vertex(field, &lattice, cell);
    }
    for &cell in &cells {
        net.add_quads(cell);
    }
    relax(field, &mut net.mesh.vertices, &net.quads);
    for quad in net.quads {
        split(&mut net.mesh, quad);
    }
    net.mesh
}

/// A cubic lattice with `size` cells a side, a power of two.
struct Lattice {
    origin: Vec3,
    spacing: f64,
    size: u32,
}

impl Lattice {
    fn around(half: Vec3, spacing: f64) -> Self {
        let needed = (2.0 * half.max_element() / spacing).ceil() as u32 + 2;
        // A power of two, since blocks are halved down to single cells.
        let size = needed.next_power_of_two();
        Self { origin: Vec3::splat(-0.5 * spacing * f64::from(size)), spacing, size }
    }

    fn node(&self, [i, j, k]: [u32; 3]) -> Vec3 {
        self.origin + Vec3::new(f64::from(i), f64::from(j), f64::from(k)) * self.spacing
    }

    /// Step 1: the cells that may be crossed, in a fixed order.
    fn crossed(&self, field: &impl Field, low: [u32; 3], size: u32, cells: &mut Vec<[u32; 3]>) {
        let side = self.spacing * f64::from(size);
        let centre = self.node(low) + Vec3::splat(0.5 * side);
        let reach = 0.5 * side * 3f64.sqrt();
        if field.at(centre).0.abs() > reach * (1.0 + 1e-9) {
            return;
        }
        if size == 1 {
            cells.push(low);
            return;
        }
        for octant in 0..8 {
            let child = offset(low, octant, size / 2);
            self.crossed(field, child, size / 2, cells);
        }
    }
}

/// The corner of a block with the three bits of `corner`.
fn offset(low: [u32; 3], corner: u32, size: u32) -> [u32; 3] {
    [0, 1, 2].map(|axis| low[axis as usize] + (corner >> axis & 1) * size)
}

#[derive(Default)]
struct Net {
    mesh: TriMesh,
    quads: Vec<[u32; 4]>,
    /// The vertex of each crossed cell, and which of its corners are inside, a bit each.
    vertex_of: HashMap<[u32; 3], (u32, u8)>,
}

impl Net {
    /// Step 2.
    fn add_vertex(&mut self, field: &impl Field, lattice: &Lattice, cell: [u32; 3]) {
        let corners: Vec<(Vec3, f64)> = (0..8)
            .map(|corner| lattice.node(offset(cell, corner, 1)))
            .map(|p| (p, field.at(p).0))
            .collect();
        let (mut sum, mut crossings) = (Vec3::ZERO, 0);
        for a in 0..8usize {
            for b in [1, 2, 4].map(|bit| a | bit).into_iter().filter(|&b| b != a) {
                let ((p, at_p), (q, at_q)) = (corners[a], corners[b]);
                if (at_p < 0.0) != (at_q < 0.0) {
                    sum += p.lerp(q, at_p / (at_p - at_q));
                    crossings += 1;
                }
            }
        }
        if crossings > 0 {
            let inside = (0..8).map(|corner| u8::from(corners[corner].1 < 0.0) << corner).sum();
            self.vertex_of.insert(cell, (self.mesh.vertices.len() as u32, inside));
            self.mesh.vertices.push(project(field, sum / f64::from(crossings)));
        }
    }

    /// Step 3: the lattice edges that start at the lowest corner of a cell.
    fn add_quads(&mut self, cell: [u32; 3]) {
        let Some(&(_, inside)) = self.vertex_of.get(&cell) else {
            return;
        };
        let low_inside = inside & 1 == 1;
        for axis in 0..3 {
            if (inside >> (1 << axis) & 1 == 1) == low_inside {
                continue;
            }
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            // Cells around the edge, counter-clockwise seen from its upper end.
            let mut quad = [(1, 1), (0, 1), (0, 0), (1, 0)].map(|(du, dv)| {
                let mut around = cell;
                // Not below zero: the lattice is a cell wider than the surface on every side.
                around[u] -= du;
                around[v] -= dv;
                self.vertex_of[&around].0
            });
            if !low_inside {
                quad.reverse();
            }
            self.quads.push(quad);
        }
    }
}

/// Step 4.
fn relax(field: &impl Field, vertices: &mut Vec<Vec3>, quads: &[[u32; 4]]) {
    let sides = quads.iter().flat_map(|&[a, b, c, d]| [[a, b], [b, c], [c, d], [d, a]]);
    slide(field, vertices, &sides, ROUNDS);
}

/// Moves the vertices on the surface halfway towards the mean of their neighbours, `rounds` times.
/// Every side is met from both of its faces, so the sum over sides counts each neighbour once.
pub(crate) fn slide(
    field: &impl Field,
    vertices: &mut Vec<Vec3>,
    directed_sides: &(impl Iterator<Item = [u32; 2]> + Clone),
    rounds: usize,
) {
    for _ in 0..rounds {
        let mut sums = vec![(Vec3::ZERO, 0.0); vertices.len()];
        for [a, b] in directed_sides.clone() {
            let (sum, count) = &mut sums[a as usize];
            *sum += vertices[b as usize];
            *count += 1.0;
        }
        let moved = vertices
            .iter()
            .zip(sums)
            .map(|(&v, (sum, count))| project(field, v.lerp(sum / count, 0.5)));
        *vertices = moved.collect();
    }
}

// Implicit functions: negative inside, with their gradients.

/// A function whose zero set is a smooth closed surface.
pub(crate) trait Field {
    /// Value and gradient at a point.
    fn at(&self, p: Vec3) -> (f64, Vec3);
}

/// A part of a blended shape, by its exact signed distance.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Part {
    /// All points within `radius` of the segment `ab`.
    Tube { a: Vec3, b: Vec3, radius: f64 },
    /// A torus in a plane `z = const`.
    Torus { centre: Vec3, major: f64, minor: f64 },
}

impl Part {
    fn distance(&self, p: Vec3) -> (f64, Vec3) {
        match *self {
            Self::Tube { a, b, radius } => {
                let t = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
                let from_axis = p - a.lerp(b, t);
                (from_axis.length() - radius, from_axis.normalize_or_zero())
            }
            Self::Torus { centre, major, minor } => {
                let q = p - centre;
                let radial = Vec3::new(q.x, q.y, 0.0).normalize_or_zero();
                let from_axis = q - radial * major;
                (from_axis.length() - minor, from_axis.normalize_or_zero())
            }
        }
    }
}

/// The union of parts with smooth seams: `f = -log(sum exp(-k d_i)) / k`.
///
/// The gradient is a weighted mean of unit vectors, so `|f(p) - f(q)| <= |p - q|`. The union is
/// the plain one where a single part is near, and thicker by up to `log(n) / k` where `n` meet.
#[derive(Clone, Debug)]
pub(crate) struct Blend {
    pub(crate) parts: Vec<Part>,
    /// The sharpness `k`, an inverse length.
    pub(crate) sharpness: f64,
}

impl Field for Blend {
    fn at(&self, p: Vec3) -> (f64, Vec3) {
        let distances: Vec<(f64, Vec3)> = self.parts.iter().map(|part| part.distance(p)).collect();
        let nearest = distances.iter().map(|d| d.0).fold(f64::INFINITY, f64::min);
        let (mut sum, mut gradient) = (0.0, Vec3::ZERO);
        for (distance, direction) in distances {
            // Relative to the nearest part, so that nothing overflows or vanishes altogether.
            let weight = (-self.sharpness * (distance - nearest)).exp();
            sum += weight;
            gradient += direction * weight;
        }
        (nearest - sum.ln() / self.sharpness, gradient / sum)
    }
}

/// The ellipsoid with these semi-axes: `|p / s|^2 - 1`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ellipsoid(pub(crate) Vec3);

impl Field for Ellipsoid {
    fn at(&self, p: Vec3) -> (f64, Vec3) {
        let scaled = p / self.0;
        (scaled.length_squared() - 1.0, 2.0 * scaled / self.0)
    }
}

/// The point of the surface reached from a point near it, by Newton steps along the gradient.
pub(crate) fn project(field: &impl Field, mut p: Vec3) -> Vec3 {
    const STEPS: usize = 40;
    let (mut value, mut gradient) = field.at(p);
    for _ in 0..STEPS {
        let next = p - gradient * (value / gradient.length_squared());
        let (next_value, next_gradient) = field.at(next);
        // Steps end where rounding does: when the value no longer falls.
        if next_value.is_nan() || next_value.abs() >= value.abs() {
            break;
        }
        (p, value, gradient) = (next, next_value, next_gradient);
    }
    p
}
