//! The surface as triangles in patches, which are split and flipped.

use std::collections::HashMap;
use std::hash::BuildHasherDefault;

use rayon::prelude::*;

use super::ConformingError;
use super::stars::{missing_around, star};
use crate::Vec3;
use crate::geometry::hash::KeyHasher;
use crate::geometry::predicates::{Sign, orient2d, project, projection_axis};
use crate::geometry::triangulation::Facet;
use crate::geometry::{Delaunay, VertexId};
use crate::surface::TriMesh;

/// Excess of two opposite angles over two right angles, in radians, above which their edge is flipped before points are
/// inserted. Below it the triangulation decides.
const COCIRCULAR: f64 = 1e-9;

/// Limit of flips for each triangle of a call. Triangles of a patch are flat only up to rounding, for which the proof that
/// flipping ends does not hold.
const FLIPS: usize = 100;

/// The surface, refined.
#[derive(Clone)]
pub(super) struct Skin {
    pub points: Vec<Vec3>,
    /// Counter-clockwise as seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// For each triangle its patch.
    pub patch: Vec<u32>,
    /// For each patch the coordinate axis along which it is projected, and the sense of its triangles there.
    pub plane: Vec<Option<(usize, Sign)>>,
    /// Diagonal of the bounding box.
    pub diagonal: f64,
    /// The triangle of each directed edge.
    pub across: HashMap<u64, u32, BuildHasherDefault<KeyHasher>>,
    /// Triangles that were set since [`Skin::with_changed`].
    changed: Vec<u32>,
}

/// Where the way to a point of a patch leads.
pub(super) enum Place {
    Triangle(u32),
    /// A segment is in the way, or the point is on this edge.
    Edge([u32; 2]),
}

impl Skin {
    pub fn new(surface: &TriMesh, delaunay: &Delaunay, flat: f64) -> Result<Self, ConformingError> {
        let kept = |v: u32| delaunay.representative(VertexId(v)).0;
        let triangles: Vec<[u32; 3]> = surface.faces.iter().map(|face| face.map(kept)).collect();
        let mut skin = Self {
            points: surface.vertices.clone(),
            patch: vec![0; triangles.len()],
            plane: Vec::new(),
            diagonal: 0.0,
            across: HashMap::with_capacity_and_hasher(
                3 * triangles.len(),
                BuildHasherDefault::default(),
            ),
            triangles,
            changed: Vec::new(),
        };
        for t in 0..skin.triangles.len() as u32 {
            for edge in sides(skin.triangles[t as usize]) {
                if edge[0] == edge[1] || skin.across.insert(key(edge), t).is_some() {
                    return Err(ConformingError::Touching);
                }
            }
        }
        skin.merge_coplanar(flat)?;
        Ok(skin)
    }

    pub fn corners(&self, t: u32) -> [Vec3; 3] {
        self.triangles[t as usize].map(|v| self.points[v as usize])
    }

    /// Whether an edge is longer than a fraction of the diagonal.
    pub fn opposite(&self, t: u32, [a, b]: [u32; 2]) -> u32 {
        let corners = self.triangles[t as usize];
        corners.into_iter().find(|&v| v != a && v != b).expect("three corners")
    }

    /// The triangle beyond a side.
    pub fn beyond(&self, [a, b]: [u32; 2]) -> u32 {
        self.across[&key([b, a])]
    }

    pub fn is_segment(&self, t: u32, edge: [u32; 2]) -> bool {
        self.patch[t as usize] != self.patch[self.beyond(edge) as usize]
    }

    /// Step 1: patches of neighbours in one plane, to within a fraction of the diagonal, that look the same way.
    fn merge_coplanar(&mut self, flat: f64) -> Result<(), ConformingError> {
        let sides_of = |t: u32| sides(self.triangles[t as usize]);
        let count = self.triangles.len() as u32;
        if (0..count).flat_map(sides_of).any(|[a, b]| !self.across.contains_key(&key([b, a]))) {
            return Err(ConformingError::Touching);
        }
        let low = self.points.iter().copied().fold(Vec3::INFINITY, Vec3::min);
        let high = self.points.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
        self.diagonal = low.distance(high);
        let tolerance = flat * self.diagonal;
        let normal = |t: u32| {
            let [a, b, c] = self.corners(t);
            (b - a).cross(c - a)
        };
        // The larger the height, the better the plane is known from rounded corners.
        let height = |t: u32| {
            let [a, b, c] = self.corners(t);
            let longest = [a - b, b - c, c - a].map(Vec3::length).into_iter().fold(0.0, f64::max);
            normal(t).length() / longest.max(f64::MIN_POSITIVE)
        };
        let mut seeds: Vec<(f64, u32)> = (0..count).map(|t| (height(t), t)).collect();
        seeds.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let mut patch: Vec<Option<u32>> = vec![None; self.triangles.len()];
        let mut planes = Vec::new();
        for (_, seed) in seeds {
            if patch[seed as usize].is_some() {
                continue;
            }
            let id = planes.len() as u32;
            planes.push(projection_axis(self.corners(seed)));
            patch[seed as usize] = Some(id);
            let Some((axis, turn)) = planes[id as usize] else { continue };
            let (origin, normal) = (self.corners(seed)[0], normal(seed).normalize_or_zero());
            let mut waiting = vec![seed];
            while let Some(t) = waiting.pop() {
                for side in sides_of(t) {
                    let other = self.beyond(side);
                    let corners = self.corners(other);
                    let [a, b, c] = corners.map(|p| project(p, axis));
                    // Folded back onto the other, a neighbour looks the other way. One without area looks any way.
                    let looks_so = orient2d(a, b, c) == turn || projection_axis(corners).is_none();
                    let is_flat =
                        || corners.iter().all(|&p| (p - origin).dot(normal).abs() <= tolerance);
                    if patch[other as usize].is_none() && looks_so && is_flat() {
                        patch[other as usize] = Some(id);
                        waiting.push(other);
                    }
                }
            }
        }
        self.patch = patch.into_iter().map(|id| id.expect("every triangle was a seed")).collect();
        self.plane = planes;
        Ok(())
    }

    /// The turn of three points in the plane of a patch: positive if it is that of the patch's triangles.
    fn turn(&self, patch: u32, p: [Vec3; 3]) -> Sign {
        let Some((axis, sense)) = self.plane[patch as usize] else { return Sign::Zero };
        let [a, b, c] = p.map(|p| project(p, axis));
        let turn = orient2d(a, b, c);
        if sense == Sign::Positive { turn } else { Sign::of(-f64::from(turn.value())) }
    }

    /// Replaces the diagonal `[a, b]` of two triangles of a patch by the other one, where these are two
    /// triangles as well. Returns the triangles.
    pub fn flip(&mut self, [a, b]: [u32; 2]) -> Option<[u32; 2]> {
        let (s, t) = (self.across[&key([a, b])], self.across[&key([b, a])]);
        let (c, d) = (self.opposite(s, [a, b]), self.opposite(t, [a, b]));
        let patch = self.patch[s as usize];
        let at = |v: u32| self.points[v as usize];
        let is_proper = |x, y, z| self.turn(patch, [at(x), at(y), at(z)]) == Sign::Positive;
        if c == d
            || !is_proper(a, d, c)
            || !is_proper(d, b, c)
            || self.across.contains_key(&key([c, d]))
        {
            return None;
        }
        self.across.remove(&key([a, b]));
        self.across.remove(&key([b, a]));
        self.set(s, [a, d, c]);
        self.set(t, [d, b, c]);
        Some([s, t])
    }

    pub fn set(&mut self, t: u32, corners: [u32; 3]) {
        self.triangles[t as usize] = corners;
        self.changed.push(t);
        for edge in sides(corners) {
            self.across.insert(key(edge), t);
        }
    }

    /// Some triangles with those that were changed since the last call.
    pub fn with_changed(&mut self, mut triangles: Vec<u32>) -> Vec<u32> {
        triangles.append(&mut self.changed);
        triangles
    }

    /// Triangles whose corners all have a neighbour among the points from `first` on. No other triangle can have lost its
    /// facet, since a removed facet has its corners around the points inserted in its place.
    pub fn near_new(&self, first: usize, delaunay: &Delaunay) -> impl Iterator<Item = u32> + '_ {
        let mut is_near = vec![false; self.points.len()];
        for v in (first..self.points.len()).flat_map(|new| star(delaunay, new as u32)) {
            let corners = delaunay.vertices(v).into_iter().filter(|&v| v != VertexId::INFINITE);
            corners.for_each(|v| is_near[v.0 as usize] = true);
        }
        let triangles = (0..).zip(&self.triangles);
        triangles.filter(move |(_, t)| t.iter().all(|&v| is_near[v as usize])).map(|(t, _)| t)
    }

    /// Flips the diagonals of patches until opposite angles add up to two right angles at most.
    // Nearly every patch is a single triangle, without a diagonal to flip.
    pub fn flip_by_angles(&mut self, triangles: impl IntoIterator<Item = usize>) {
        let mut waiting: Vec<u32> = triangles.into_iter().map(|t| t as u32).collect();
        let mut left = FLIPS * waiting.len();
        while let Some(t) = waiting.pop().filter(|_| left > 0) {
            for edge in sides(self.triangles[t as usize]) {
                if self.is_segment(t, edge) {
                    continue;
                }
                let other = self.beyond(edge);
                let [a, b] = edge.map(|v| self.points[v as usize]);
                let angle = |t: u32| {
                    let c = self.points[self.opposite(t, edge) as usize];
                    (a - c).cross(b - c).length().atan2((a - c).dot(b - c))
                };
                if angle(t) + angle(other) > std::f64::consts::PI + COCIRCULAR
                    && let Some(pair) = self.flip(edge)
                {
                    waiting.extend(pair);
                    left -= 1;
                    break;
                }
            }
        }
    }

    /// For each triangle the facet that it is of the cell inside, if it is one.
    pub fn facets(&self, delaunay: &Delaunay) -> Vec<Option<Facet>> {
        let found = delaunay.finite_cells().flat_map(|cell| {
            (0..4).filter_map(move |opposite| {
                let facet = Facet { cell, opposite };
                // Counter-clockwise from outside the cell, as triangles are from outside the solid.
                let [a, b, c] = delaunay.facet_vertices(facet).map(|v| v.0);
                let t = *self.across.get(&key([a, b]))?;
                self.triangles[t as usize].contains(&c).then_some((t, facet))
            })
        });
        let mut facets = vec![None; self.triangles.len()];
        found.for_each(|(t, facet)| facets[t as usize] = Some(facet));
        facets
    }

    /// The triangles that are no Delaunay facets, ascending.
    pub fn missing(&self, delaunay: &Delaunay) -> Vec<u32> {
        let facets = (0..).zip(self.facets(delaunay));
        facets.filter(|(_, facet)| facet.is_none()).map(|(t, _)| t).collect()
    }

    /// Those among some triangles.
    // Of few triangles the cells around a corner are searched sooner than all cells.
    pub fn missing_among(&self, suspects: Vec<u32>, delaunay: &Delaunay) -> Vec<u32> {
        let least = |t: u32| self.triangles[t as usize].into_iter().min().expect("three corners");
        let mut of_vertex: Vec<(u32, u32)> = suspects.into_iter().map(|t| (least(t), t)).collect();
        of_vertex.sort_unstable();
        of_vertex.dedup();
        let groups: Vec<&[(u32, u32)]> = of_vertex.chunk_by(|a, b| a.0 == b.0).collect();
        let missing = groups.par_iter().with_min_len(64).flat_map_iter(|group| {
            let triangles = group.iter().map(|&(_, t)| (t, self.triangles[t as usize]));
            missing_around(delaunay, group[0].0, triangles)
        });
        let mut missing: Vec<u32> = missing.collect();
        missing.sort_unstable();
        missing
    }

    fn push(&mut self, at: Vec3) -> u32 {
        self.points.push(at);
        self.points.len() as u32 - 1
    }

    fn push_triangle(&mut self, corners: [u32; 3], patch: u32) -> u32 {
        let t = self.triangles.len() as u32;
        self.triangles.push(corners);
        self.patch.push(patch);
        self.set(t, corners);
        t
    }

    pub fn split_edge(&mut self, [a, b]: [u32; 2], at: Vec3) {
        let m = self.push(at);
        let mut changed = Vec::with_capacity(4);
        for [a, b] in [[a, b], [b, a]] {
            let t = self.across.remove(&key([a, b])).expect("both sides of an edge are there");
            let c = self.opposite(t, [a, b]);
            self.set(t, [a, m, c]);
            let patch = self.patch[t as usize];
            changed.extend([t, self.push_triangle([m, b, c], patch)]);
        }
        self.flip_by_angles(changed.into_iter().map(|t| t as usize));
    }

    /// Halves the longest edges until there are `least` points.
    pub fn split_longest(&mut self, least: usize) {
        while self.points.len() < least {
            let length = |[a, b]: [u32; 2]| {
                self.points[a as usize].distance_squared(self.points[b as usize])
            };
            let all = self.triangles.iter().flat_map(|&t| sides(t)).filter(|[a, b]| a < b);
            let mut all: Vec<(f64, [u32; 2])> = all.map(|edge| (length(edge), edge)).collect();
            all.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            let longest = all.first().map_or(0.0, |edge| edge.0);
            all.retain(|edge| edge.0 >= 0.5 * longest && edge.0 > 0.0);
            if all.is_empty() {
                return;
            }
            for (_, [a, b]) in all {
                // Splits of this round can have flipped it.
                if self.points.len() < least && self.across.contains_key(&key([a, b])) {
                    let middle = self.points[a as usize].midpoint(self.points[b as usize]);
                    self.split_edge([a, b], middle);
                }
            }
        }
    }

    pub fn split_triangle(&mut self, t: u32, at: Vec3) {
        let [a, b, c] = self.triangles[t as usize];
        let (m, patch) = (self.push(at), self.patch[t as usize]);
        self.set(t, [a, b, m]);
        let others = [[b, c, m], [c, a, m]].map(|corners| self.push_triangle(corners, patch));
        self.flip_by_angles([t, others[0], others[1]].map(|t| t as usize));
    }

    /// The triangle of a patch that contains a point, by a walk; or the edge in the way.
    pub fn locate(&self, start: u32, p: Vec3) -> Place {
        let patch = self.patch[start as usize];
        let (mut t, mut from) = (start, None);
        // A walk among triangles that are flat only up to rounding might go round in circles.
        for _ in 0..self.triangles.len() {
            let mut on = None;
            let mut exit = None;
            for edge in sides(self.triangles[t as usize]) {
                let [a, b] = edge.map(|v| self.points[v as usize]);
                match self.turn(patch, [a, b, p]) {
                    Sign::Negative if Some(edge) != from => exit = exit.or(Some(edge)),
                    Sign::Zero => on = on.or(Some(edge)),
                    _ => {}
                }
            }
            match (exit, on) {
                (Some(edge), _) if self.is_segment(t, edge) => return Place::Edge(edge),
                (Some([a, b]), _) => {
                    t = self.beyond([a, b]);
                    from = Some([b, a]);
                }
                (None, Some(edge)) => return Place::Edge(edge),
                (None, None) => return Place::Triangle(t),
            }
        }
        Place::Triangle(start)
    }
}

pub(super) fn sides([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}

/// A directed edge as a key.
pub(super) fn key([a, b]: [u32; 2]) -> u64 {
    u64::from(a) << 32 | u64::from(b)
}

pub(super) fn ascending([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}
