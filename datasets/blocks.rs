//! Surfaces of unions of grid blocks: everything with flat sides and right angles.

use std::collections::HashMap;

use medial::Vec3;
use medial::surface::TriMesh;

use crate::revolved::parts;

/// Grid coordinates along one axis: the breaks, and even divisions of about `edge` between them.
pub(crate) fn divided(breaks: &[f64], edge: f64) -> Vec<f64> {
    let mut ticks = vec![breaks[0]];
    for pair in breaks.windows(2) {
        let n = parts(pair[1] - pair[0], edge, 1);
        // The weighted sum meets both breaks exactly.
        ticks.extend((1..=n).map(|k| {
            let t = f64::from(k) / f64::from(n);
            pair[0] * (1.0 - t) + pair[1] * t
        }));
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
    let filled = |cell: [i64; 3]| {
        let inside = (0..3).all(|axis| (0..cells[axis]).contains(&cell[axis]));
        inside && {
            let middle = [0, 1, 2].map(|axis| {
                let i = cell[axis] as usize;
                (ticks[axis][i] + ticks[axis][i + 1]) / 2.0
            });
            solid(Vec3::from(middle))
        }
    };
    for i in 0..cells[0] {
        for j in 0..cells[1] {
            for k in (0..cells[2]).filter(|&k| filled([i, j, k])) {
                for (axis, step) in [(0, -1), (0, 1), (1, -1), (1, 1), (2, -1), (2, 1)] {
                    let mut beyond = [i, j, k];
                    beyond[axis] += step;
                    if !filled(beyond) {
                        builder.side([i, j, k].map(|n| n as usize), axis, step > 0);
                    }
                }
            }
        }
    }
    builder.mesh
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
        let mut corner = |du: usize, dv: usize| {
            let mut node = cell;
            node[axis] += usize::from(above);
            node[u] += du;
            node[v] += dv;
            self.vertex(node)
        };
        let mut quad = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
        if !above {
            quad.swap(1, 3);
        }
        split(&mut self.mesh, quad);
    }

    fn vertex(&mut self, node: [usize; 3]) -> u32 {
        let Self { ticks, place, mesh, ids } = self;
        *ids.entry(node).or_insert_with(|| {
            let at = [0, 1, 2].map(|axis| ticks[axis][node[axis]]);
            mesh.vertices.push(place(Vec3::from(at)));
            mesh.vertices.len() as u32 - 1
        })
    }
}

/// Adds a quadrilateral as two triangles, cut along its shorter diagonal.
pub(crate) fn split(mesh: &mut TriMesh, [a, b, c, d]: [u32; 4]) {
    let length = |p: u32, q: u32| mesh.vertices[p as usize].distance(mesh.vertices[q as usize]);
    // A hair's breadth in favour of `ac`, so that rounding does not choose between equals.
    if length(a, c) <= length(b, d) * (1.0 + 1e-9) {
        mesh.faces.extend([[a, b, c], [a, c, d]]);
    } else {
        mesh.faces.extend([[a, b, d], [b, c, d]]);
    }
}
