//! Points for the triangles that are missing in the triangulation.

use std::collections::{HashMap, HashSet};

use super::skin::{Place, Skin, ascending, key, sides};
use super::stars::Stars;
use crate::Vec3;
use crate::geometry::{CellId, VertexId};
use crate::surface::PointGrid;

/// Least share of a segment that a split cuts off.
const SHORTEST: f64 = 0.2;

/// Distance from the middle of a segment, as a share of its length, within which a point of the same round delays its
/// split to the next one. A smaller share gives fewer rounds and more points.
const NEAR: f64 = 0.25;

/// Length of a segment and radius of a circle, as fractions of the surface's diagonal, below which no point is added.
const RESOLUTION: f64 = 1e-9;

impl Skin {
    /// Steps 2 and 3: adds points for the missing triangles, and splits the surface at them.
    pub fn refine(&mut self, missing: &[u32], stars: &mut Stars<'_>) {
        let mut split = Vec::new();
        let mut whole = Vec::new();
        for &t in missing {
            let before = split.len();
            for edge in sides(self.triangles[t as usize]) {
                if self.is_segment(t, edge) && !stars.has_edge(edge) {
                    split.push(ascending(edge));
                }
            }
            if split.len() == before {
                whole.push(t);
            }
        }
        split.sort_unstable();
        split.dedup();
        // The shortest first. A longer one with a point of this round near its middle waits for the next.
        let half =
            |[a, b]: [u32; 2]| 0.5 * self.points[a as usize].distance(self.points[b as usize]);
        split.sort_by(|&e, &f| half(e).total_cmp(&half(f)).then(e.cmp(&f)));
        let mut fresh = PointGrid::new(split.get(split.len() / 2).map_or(1.0, |&edge| half(edge)));
        // Patches with a broken rim wait until it is whole.
        let mut busy: HashSet<u32> = HashSet::new();
        for &[a, b] in &split {
            busy.extend([[a, b], [b, a]].map(|edge| self.patch[self.across[&key(edge)] as usize]));
        }
        for edge in split {
            let [p, q] = edge.map(|v| self.points[v as usize]);
            if p.distance(q) > RESOLUTION * self.diagonal
                && !fresh.any_within(p.midpoint(q), NEAR * p.distance(q))
            {
                let at = self.point_of_segment(edge, stars);
                self.split_edge(edge, at);
                fresh.insert(at);
            }
        }
        let apart = RESOLUTION * self.diagonal;
        // The largest first: the points of a patch are as far from each other as they can be.
        let mut whole: Vec<(f64, u32)> = (whole.into_iter())
            .filter(|&t| !busy.contains(&self.patch[t as usize]))
            .map(|t| (circumcircle(self.corners(t)).1, t))
            .collect();
        whole.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let typical = whole.get(whole.len() / 2).map_or(1.0, |&(radius, _)| radius.max(apart));
        let mut new: HashMap<u32, PointGrid> = HashMap::new();
        let mut cut: HashSet<[u32; 2]> = HashSet::new();
        for (_, t) in whole {
            let (centre, radius) = circumcircle(self.corners(t));
            let patch = self.patch[t as usize];
            let points = new.entry(patch).or_insert_with(|| PointGrid::new(typical));
            // A point of this round may have made the triangle another one.
            if points.any_within(centre, radius) || radius < apart {
                continue;
            }
            let at = match self.locate(t, centre) {
                Place::Edge(edge) if self.is_segment(self.across[&key(edge)], edge) => {
                    if !cut.insert(ascending(edge)) {
                        continue;
                    }
                    let at = self.point_of_segment(edge, stars);
                    self.split_edge(edge, at);
                    at
                }
                Place::Edge(edge) if self.takes(self.across[&key(edge)], centre, apart) => {
                    self.split_edge(edge, centre);
                    centre
                }
                Place::Triangle(t) if self.takes(t, centre, apart) => {
                    self.split_triangle(t, centre);
                    centre
                }
                _ => continue,
            };
            points.insert(at);
        }
    }

    /// Whether a point may split a triangle or one of its sides: at a distance from its corners, and no farther from them than
    /// they are from each other. A walk among needles can end elsewhere.
    pub(super) fn takes(&self, t: u32, at: Vec3, apart: f64) -> bool {
        let [a, b, c] = self.corners(t);
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        [a, b, c].iter().all(|p| (apart..=longest).contains(&p.distance(at)))
    }

    /// Where a segment is split: as far from one end as the vertex that encroaches upon it most, if that is
    /// nearer to this end than the middle.
    fn point_of_segment(&self, [a, b]: [u32; 2], stars: &mut Stars<'_>) -> Vec3 {
        let (p, q) = (self.points[a as usize], self.points[b as usize]);
        let delaunay = stars.delaunay;
        // Ends of this round are not in the triangulation.
        let known = [a, b].into_iter().filter(|&v| v < delaunay.point_count() as u32);
        let around: Vec<CellId> = known.flat_map(|v| stars.around(v).to_vec()).collect();
        // The largest angle over the segment: above a right angle it is inside its smallest sphere.
        let mut most: Option<(f64, Vec3)> = None;
        for v in around.into_iter().flat_map(|cell| delaunay.vertices(cell)) {
            if v == VertexId::INFINITE || v.0 == a || v.0 == b {
                continue;
            }
            let x = delaunay.point(v);
            let cosine = (p - x).dot(q - x) / (x.distance(p) * x.distance(q));
            if cosine < most.map_or(0.0, |most| most.0) {
                most = Some((cosine, x));
            }
        }
        let length = p.distance(q);
        let share = most.map_or(0.5, |(_, x)| match [x.distance(p), x.distance(q)] {
            [near, far] if near <= far => (near / length).min(0.5),
            [_, near] => 1.0 - (near / length).min(0.5),
        });
        p.lerp(q, share.clamp(SHORTEST, 1.0 - SHORTEST))
    }
}

/// Centre and radius of the circle through three points; the middle of the longest side where there is none.
fn circumcircle([a, b, c]: [Vec3; 3]) -> (Vec3, f64) {
    let (u, v) = (b - a, c - a);
    let normal = u.cross(v);
    let to_centre = (u.length_squared() * v - v.length_squared() * u).cross(normal)
        / (2.0 * normal.length_squared());
    if to_centre.is_finite() {
        return (a + to_centre, to_centre.length());
    }
    let pairs = [(a, b), (b, c), (c, a)];
    let (p, q) = (pairs.into_iter())
        .max_by(|(p, q), (r, s)| p.distance_squared(*q).total_cmp(&r.distance_squared(*s)))
        .expect("three sides");
    (p.midpoint(q), 0.5 * p.distance(q))
}
