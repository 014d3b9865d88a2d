//! Flips of diagonals of the surface to edges of the Delaunay triangulation.

use super::skin::{Skin, key, sides};
use super::stars::Stars;
use crate::Vec3;
use crate::geometry::predicates::projection_axis;

/// Least cosine of the angles between the normals of the four triangles of a flip between patches (30 degrees).
const STRAIGHT: f64 = 0.866;

/// Largest distance between the two diagonals of a flip between patches, as a fraction of the surface's diagonal.
const BEND: f64 = 3e-3;

/// Height of a triangle, as a fraction of the surface's diagonal, below which its normal means nothing.
const NEEDLE: f64 = 1e-6;

impl Skin {
    /// Flips diagonals that are no Delaunay edges to those that are.
    pub fn flip_to(&mut self, missing: &[u32], stars: &mut Stars<'_>) {
        for &t in missing {
            for edge in sides(self.triangles[t as usize]) {
                if self.is_segment(t, edge) || stars.has_edge(edge) {
                    continue;
                }
                let diagonal = [t, self.beyond(edge)].map(|s| self.opposite(s, edge));
                // One edge more that is there: this ends.
                if stars.has_edge(diagonal) && self.flip(edge).is_some() {
                    break;
                }
            }
        }
    }

    /// Flips edges between patches nearly in one plane to those of the triangulation.
    pub fn flip_bent(&mut self, missing: &[u32], stars: &mut Stars<'_>) {
        let mut waiting: Vec<u32> = missing.iter().rev().copied().collect();
        while let Some(t) = waiting.pop() {
            for [a, b] in sides(self.triangles[t as usize]) {
                let s = self.beyond([a, b]);
                let (c, d) = (self.opposite(t, [a, b]), self.opposite(s, [a, b]));
                let fresh = [[a, d, c], [d, b, c]];
                let is_there = |v: [u32; 2]| self.across.contains_key(&key(v));
                if !self.is_segment(t, [a, b]) || c == d || is_there([c, d]) || is_there([d, c]) {
                    continue;
                }
                // More edges that are there, or more triangles with as many edges: this ends.
                let is_gain = stars.has_edge([c, d])
                    && (!stars.has_edge([a, b])
                        || fresh.iter().all(|&new| stars.has_facet(new))
                            && ![s, t]
                                .iter()
                                .all(|&old| stars.has_facet(self.triangles[old as usize])));
                if !is_gain || !self.is_nearly_flat([a, b, c, d]) {
                    continue;
                }
                self.across.remove(&key([a, b]));
                self.across.remove(&key([b, a]));
                for (t, corners) in [t, s].into_iter().zip(fresh) {
                    self.set(t, corners);
                    self.patch[t as usize] = self.plane.len() as u32;
                    self.plane.push(projection_axis(self.corners(t)));
                }
                waiting.extend([t, s]);
                break;
            }
        }
    }

    /// Whether the triangles `abc` and `bad`, and those of the other diagonal `cd`, look nearly the same way and are
    /// close.
    fn is_nearly_flat(&self, corners: [u32; 4]) -> bool {
        let [a, b, c, d] = corners.map(|v| self.points[v as usize]);
        let normals = [[a, b, c], [b, a, d], [a, d, c], [d, b, c]].map(|[p, q, r]| {
            let longest = [p - q, q - r, r - p].map(Vec3::length).into_iter().fold(0.0, f64::max);
            let normal = (q - p).cross(r - p);
            (normal.normalize_or_zero(), normal.length() / longest)
        });
        let are_straight = |least: f64| {
            let normals: Vec<Vec3> =
                normals.iter().filter(|&&(_, height)| height >= least).map(|&(n, _)| n).collect();
            (0..normals.len()).all(|i| (0..i).all(|j| normals[i].dot(normals[j]) >= STRAIGHT))
        };
        let [first, second] = [b - a, d - c];
        let across = first.cross(second);
        let apart = across.normalize_or_zero().dot(c - a).abs();
        if apart <= BEND * self.diagonal && are_straight(0.0) {
            return true;
        }
        // Next to a needle the diagonals have to cross: the lines through them can come close anywhere.
        let needle = NEEDLE * self.diagonal;
        let place = |along: Vec3| (c - a).cross(along).dot(across) / across.length_squared();
        apart <= needle
            && are_straight(needle)
            && [second, first].into_iter().all(|along| (0.0..=1.0).contains(&place(along)))
    }
}
