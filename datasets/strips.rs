//! Planar profiles as triangles, and prisms over them.

use medial::Vec3;
use medial::surface::TriMesh;

use crate::blocks::split;
use crate::profiles::Elbow;
use crate::revolved::parts;
use crate::shapes::HOLED_HALF;

/// A line across a profile, from its outer to its inner boundary, both in `(x, z)`.
pub(crate) type Across = [[f64; 2]; 2];

/// A triangulated profile in the plane `y = 0`, counter-clockwise in `(x, z)`.
pub(crate) struct Flat(TriMesh);

/// The profile that lines across it, in counter-clockwise order about the inner side, divide; each line in
/// `layers` parts. Where `closed`, the last line is followed by the first.
pub(crate) fn strip(lines: &[Across], layers: u32, closed: bool) -> Flat {
    let mut mesh = TriMesh::default();
    for &[outer, inner] in lines {
        mesh.vertices.extend((0..=layers).map(|k| {
            let t = f64::from(k) / f64::from(layers);
            let [x, z] = [0, 1].map(|axis| outer[axis] * (1.0 - t) + inner[axis] * t);
            Vec3::new(x, 0.0, z)
        }));
    }
    let count = lines.len() as u32;
    for i in 0..if closed { count } else { count - 1 } {
        let [from, to] = [i, (i + 1) % count].map(|line| line * (layers + 1));
        for k in 0..layers {
            split(&mut mesh, [from + k + 1, from + k, to + k, to + k + 1]);
        }
    }
    Flat(mesh)
}

/// The triangle with base `2 half` on `z = 0` and its apex at `height`, its sides in `n` parts each.
pub(crate) fn triangle(half: f64, height: f64, n: u32) -> Flat {
    let mut mesh = TriMesh::default();
    let first = |row: u32| row * (n + 1) - row * row.saturating_sub(1) / 2;
    for row in 0..=n {
        let up = f64::from(row) / f64::from(n);
        mesh.vertices.extend((0..=n - row).map(|i| {
            // Symmetric in `i`, so that the sides are as exact as the base.
            let across = f64::from(2 * i) - f64::from(n - row);
            Vec3::new(half * across / f64::from(n), 0.0, height * up)
        }));
        for i in 0..if row == 0 { 0 } else { n - row + 1 } {
            let (below, above) = (first(row - 1) + i, first(row) + i);
            mesh.faces.push([below, below + 1, above]);
            if i < n - row {
                mesh.faces.push([below + 1, above + 1, above]);
            }
        }
    }
    Flat(mesh)
}

/// Lines from a rectangle with half sides `half` to a circle inside it, counter-clockwise from its lower right
/// corner; `sides` parts for each vertical and each horizontal side.
///
/// The arcs belong to the sides of the holed plate whatever the rectangle, so that lines of rectangles of
/// several sizes meet their circles in the same directions.
pub(crate) fn around_hole(radius: f64, half: [f64; 2], sides: [u32; 2]) -> Vec<Across> {
    use std::f64::consts::PI;
    let [x, z] = half;
    let corner = HOLED_HALF.z.atan2(HOLED_HALF.x);
    let quarters = [
        (-corner, corner, [x, -z], [x, z], sides[0]),
        (corner, PI - corner, [x, z], [-x, z], sides[1]),
        (PI - corner, PI + corner, [-x, z], [-x, -z], sides[0]),
        (PI + corner, 2.0 * PI - corner, [-x, -z], [x, -z], sides[1]),
    ];
    let line = |(from, to, start, end, n): (f64, f64, [f64; 2], [f64; 2], u32), i: u32| {
        let t = f64::from(i) / f64::from(n);
        let (sin, cos) = (from * (1.0 - t) + to * t).sin_cos();
        [[0, 1].map(|axis| start[axis] * (1.0 - t) + end[axis] * t), [radius * cos, radius * sin]]
    };
    quarters.into_iter().flat_map(|side| (0..side.4).map(move |i| line(side, i))).collect()
}

/// Lines across an elbow with a fillet, from the top of its leg to the end of its foot.
pub(crate) fn across_elbow(elbow: &Elbow, edge: f64) -> Vec<Across> {
    let Elbow { length, height, foot, leg, fillet, .. } = *elbow;
    let centre = elbow.centre();
    let quarter = std::f64::consts::FRAC_PI_2;
    // The outer sides of the corner are longer than half the fillet: parts of about `edge` between both.
    let n = parts((centre.x + quarter * fillet / 2.0) / 2.0, edge, 1);
    let share = |i: u32, n: u32| f64::from(i) / f64::from(n);
    let upright = parts(height - centre.y, edge, 1);
    let flat = parts(length - centre.x, edge, 1);
    let between = |a: f64, b: f64, t: f64| a * (1.0 - t) + b * t;
    let leg_lines = (0..upright).map(|i| {
        let z = between(height, centre.y, share(i, upright));
        [[0.0, z], [leg, z]]
    });
    let corner_lines = (0..2 * n).map(|i| {
        let (sin, cos) = (2.0 * quarter + quarter * share(i, 2 * n)).sin_cos();
        let outer = match i < n {
            true => [0.0, between(centre.y, 0.0, share(i, n))],
            false => [between(0.0, centre.x, share(i - n, n)), 0.0],
        };
        [outer, [centre.x + fillet * cos, centre.y + fillet * sin]]
    });
    let foot_lines = (0..=flat).map(|i| {
        let x = between(centre.x, length, share(i, flat));
        [[x, 0.0], [x, foot]]
    });
    leg_lines.chain(corner_lines).chain(foot_lines).collect()
}

impl Flat {
    /// The prism `|y - middle| <= half` with layers of about `edge`, oriented outward.
    pub(crate) fn prism(&self, middle: f64, half: f64, edge: f64) -> TriMesh {
        let Self(flat) = self;
        let layers = parts(2.0 * half, edge, 1);
        let side = self.boundary();
        let mut mesh = TriMesh::default();
        // Vertex of each layer: all of the profile in the first and the last, its boundary between.
        let mut layer_ids: Vec<Vec<u32>> = Vec::new();
        for layer in 0..=layers {
            let t = f64::from(layer) / f64::from(layers);
            let y = (middle - half) * (1.0 - t) + (middle + half) * t;
            let ids = (0..flat.vertices.len()).map(|v| {
                if layer > 0 && layer < layers && !side.on_it[v] {
                    return u32::MAX;
                }
                mesh.vertices.push(flat.vertices[v].with_y(y));
                mesh.vertices.len() as u32 - 1
            });
            layer_ids.push(ids.collect());
        }
        let at = |layer: u32, v: u32| layer_ids[layer as usize][v as usize];
        mesh.faces.extend(flat.faces.iter().map(|face| face.map(|v| at(0, v))));
        mesh.faces.extend(flat.faces.iter().map(|&[a, b, c]| [a, c, b].map(|v| at(layers, v))));
        for layer in 0..layers {
            for &[a, b] in &side.edges {
                split(&mut mesh, [at(layer, b), at(layer, a), at(layer + 1, a), at(layer + 1, b)]);
            }
        }
        mesh
    }

    /// The edges of one triangle alone, as that triangle has them.
    fn boundary(&self) -> Boundary {
        let Self(flat) = self;
        let sides = flat.faces.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let mut directed: Vec<[u32; 2]> = sides.collect();
        directed.sort_unstable();
        let lone = |&&[a, b]: &&[u32; 2]| directed.binary_search(&[b, a]).is_err();
        let edges: Vec<[u32; 2]> = directed.iter().filter(lone).copied().collect();
        let mut on_it = vec![false; flat.vertices.len()];
        edges.as_flattened().iter().for_each(|&v| on_it[v as usize] = true);
        Boundary { edges, on_it }
    }
}

struct Boundary {
    edges: Vec<[u32; 2]>,
    /// Whether each vertex is on the boundary.
    on_it: Vec<bool>,
}
