//! Spheres as round bodies.
//!
//! Icosahedra with every triangle cut in four: 42 vertices and 80 triangles, 2.3 kB a sphere. All in one mesh instead
//! of instances of one: instances would share their colours, and thousands of objects make Blender slow.

use crate::Vec3;

/// Vertices and triangles of a ball.
pub(super) const VERTICES: usize = 42;
pub(super) const TRIANGLES: usize = 80;

/// The unit ball: vertices on the unit sphere, triangles counter-clockwise from outside.
pub(super) fn ball() -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let golden = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let mut vertices: Vec<Vec3> = Vec::with_capacity(VERTICES);
    for (s, t) in [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)] {
        let (x, y) = (s, t * golden);
        vertices.extend([[0.0, x, y], [x, y, 0.0], [y, 0.0, x]].map(Vec3::from));
    }
    // Neighbours are two units apart, others more than three.
    let near = |a: usize, b: usize| vertices[a].distance_squared(vertices[b]) < 5.0;
    let mut triangles = Vec::with_capacity(TRIANGLES);
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(a, c) {
                    let normal = (vertices[b] - vertices[a]).cross(vertices[c] - vertices[a]);
                    let is_outward = normal.dot(vertices[a]) > 0.0;
                    triangles.push(if is_outward { [a, b, c] } else { [a, c, b] });
                }
            }
        }
    }
    let mut middles: Vec<([usize; 2], usize)> = Vec::new();
    let mut quarters = Vec::with_capacity(TRIANGLES);
    for [a, b, c] in triangles {
        let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[p, q]| {
            let key = [p.min(q), p.max(q)];
            let known = middles.iter().find(|(ends, _)| *ends == key).map(|&(_, middle)| middle);
            known.unwrap_or_else(|| {
                vertices.push((vertices[p] + vertices[q]) * 0.5);
                middles.push((key, vertices.len() - 1));
                vertices.len() - 1
            })
        });
        quarters.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
    }
    let vertices = vertices.into_iter().map(Vec3::normalize).collect();
    (vertices, quarters.into_iter().map(|corners| corners.map(|v| v as u32)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ball_is_closed_round_and_outward() {
        let (vertices, triangles) = ball();
        assert_eq!((vertices.len(), triangles.len()), (VERTICES, TRIANGLES));
        assert!(vertices.iter().all(|v| (v.length() - 1.0).abs() < 1e-15));
        let volume: f64 = triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|v| vertices[v as usize]);
                a.dot(b.cross(c)) / 6.0
            })
            .sum();
        // Of an icosphere of 80 triangles, against 4.18879 of the ball.
        assert!((volume - 3.6587).abs() < 1e-3, "{volume}");
        let sides = |&[a, b, c]: &[u32; 3]| [[a, b], [b, c], [c, a]];
        let mut sides: Vec<_> = triangles.iter().flat_map(sides).collect();
        sides.sort_unstable();
        assert!(sides.windows(2).all(|pair| pair[0] != pair[1]), "every side once in a direction");
        assert!(sides.iter().all(|&[a, b]| sides.binary_search(&[b, a]).is_ok()), "closed");
    }
}
