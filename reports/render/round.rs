//! Balls and tubes as facets: dots for isolated spheres, tubes for curves.

use medial::Vec3;

use super::facets::Facet;

/// Sides of a tube: with smooth normals no corner shows at a few pixels' width.
const TUBE_SIDES: usize = 10;

/// A tube between two points, with its place in the colour map at both. Open: balls close its ends.
pub(super) fn tube(ends: [Vec3; 2], radius: f64, places: [f32; 2], into: &mut Vec<Facet>) {
    let Some(along) = (ends[1] - ends[0]).try_normalize() else { return };
    let (u, v) = along.any_orthonormal_pair();
    let spoke = |k: usize| {
        let turn = std::f64::consts::TAU * (k % TUBE_SIDES) as f64 / TUBE_SIDES as f64;
        turn.cos() * u + turn.sin() * v
    };
    for k in 0..TUBE_SIDES {
        let n = [spoke(k), spoke(k + 1)];
        let corner = |side: usize, end: usize| ends[end] + radius * n[side];
        for [a, b, c] in [[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]] {
            into.push(Facet {
                corners: [a, b, c].map(|(side, end)| corner(side, end)),
                normals: [a, b, c].map(|(side, _)| n[side]),
                places: [a, b, c].map(|(_, end)| places[end]),
                lines: [0; 3],
            });
        }
    }
}

/// Directions of a ball's facets: an octahedron, each side cut into so many.
const BALL_CUTS: usize = 4;

/// A ball.
pub(super) fn ball(centre: Vec3, radius: f64, place: f32, into: &mut Vec<Facet>) {
    for octant in 0..8 {
        let sign = |bit: usize| if octant >> bit & 1 == 0 { 1.0 } else { -1.0 };
        let signs = Vec3::new(sign(0), sign(1), sign(2));
        let at = |i: usize, j: usize| {
            let k = BALL_CUTS - i - j;
            (signs * Vec3::new(i as f64, j as f64, k as f64)).normalize()
        };
        let mut push = |normals: [Vec3; 3]| {
            let corners = normals.map(|n| centre + radius * n);
            into.push(Facet { corners, normals, places: [place; 3], lines: [0; 3] });
        };
        for i in 0..BALL_CUTS {
            for j in 0..BALL_CUTS - i {
                push([at(i, j), at(i + 1, j), at(i, j + 1)]);
                if i + j + 1 < BALL_CUTS {
                    push([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
                }
            }
        }
    }
}
