//! Bodies of a closed surface that touch along edges, apart from each other.
//!
//! Where more than two faces meet in an edge, the surface leaves open which of them belong together. The orientation of a
//! body can be checked only by itself, so the faces are joined in pairs:
//!
//! 1. Faces that hang together over edges of two faces are a *patch*. In each, the fewer ones follow the others.
//! 2. Every edge has to be passed as often in one direction as in the other: otherwise nothing says where the solid is.
//! 3. At an edge, faces of one patch are joined first, then those that are left, in the order in which they lie around the
//!    edge, found by exact predicates: each with the one that bounds the solid behind it.
//!
//! The result does not depend on the order of faces, but for coplanar ones at one edge that are not the same.

use std::cell::LazyCell;
use std::cmp::Ordering;
use std::collections::{BTreeMap, HashSet};
use std::ops::ControlFlow;

use super::inside::InsideTest;
use super::mesh::Unit;
use super::topology::{Topology, corner_at, ends, sides_by_edge, turn_over};
use crate::Vec3;
use crate::geometry::predicates::{Sign, orient2d, orient3d, project, projection_axis};
use crate::geometry::{DisjointSets, TriangleTree};

/// A closed surface with vertices for each part, so that every edge has two faces.
pub(super) struct Parted {
    pub faces: Vec<[u32; 3]>,
    /// For each of its vertices the former one.
    pub vertices: Vec<u32>,
    /// Whether a face was turned over, by its patch.
    pub turned: Vec<bool>,
}

/// A place in a triangle, by weights of its corners, through which no other face passes by its structure.
pub(super) const PLACE: [f64; 3] = [0.411, 0.352, 0.237];

/// Distance from a triangle at which winding numbers are taken, in roots of twice its area.
pub(super) const ASIDE: f64 = 1e-3;

/// The same distance at least, in thicknesses of a wall.
const ABOVE: f64 = 4.0;

/// Largest number of faces at one edge. Each touches all others, so that the pairs grow with the square.
const MOST_FACES: usize = 1_000;

/// Faces that hang together over edges of two faces.
struct Patches {
    /// All faces, those of a patch oriented alike.
    faces: Vec<[u32; 3]>,
    /// The patch of each face.
    of: Vec<u32>,
    /// Whether a face was turned over.
    turned: Vec<bool>,
}

impl Patches {
    /// None where a patch is one-sided.
    fn new(vertices: usize, faces: &[[u32; 3]]) -> Option<Self> {
        let mut turned = Topology::new(vertices, faces).turns(faces).ok()?;
        let mut patches = DisjointSets::singletons(faces.len());
        for group in sides_by_edge(faces).chunk_by(|s, t| (s.0, s.1) == (t.0, t.1)) {
            if let &[(.., g), (.., h)] = group {
                patches.join(g / 3, h / 3);
            }
        }
        let of: Vec<u32> = (0..faces.len() as u32).map(|face| patches.find(face)).collect();
        let mut balance = vec![0; faces.len()];
        for (&patch, &turned) in of.iter().zip(&turned) {
            balance[patch as usize] += if turned { 1 } else { -1 };
        }
        for (&patch, turned) in of.iter().zip(&mut turned) {
            *turned ^= balance[patch as usize] > 0;
        }
        let mut faces = faces.to_vec();
        turn_over(&mut faces, turned.iter().copied());
        Some(Self { faces, of, turned })
    }
}

/// The faces of plane walls between bodies, and the largest thickness of a wall, which is at most `most`.
///
/// A wall is a pair of faces with the same corners and opposite orientation, or of plane patches of opposite orientation
/// with the same border, where other faces close the surface without them; or of the same orientation, where the winding
/// numbers of both sides have opposite signs. Cut into triangles in two ways, and rounded, they enclose slivers that no one
/// means.
pub(super) fn walls(
    unit: Unit,
    points: &[Vec3],
    faces: &[[u32; 3]],
    most: f64,
) -> (Vec<bool>, f64) {
    let mut is_wall = vec![false; faces.len()];
    let mut distance = 0.0_f64;
    let Some(Patches { faces, .. }) = Patches::new(points.len(), faces) else {
        return (is_wall, distance);
    };
    let sheets = sheets(&faces, &mut is_wall);
    let mut layers: Vec<Vec<usize>> = sheets.iter().map(|(_, copies)| copies.clone()).collect();
    let sheets: Vec<[u32; 3]> = sheets.into_iter().map(|(face, _)| face).collect();
    // For each patch of sheets its border: numbers of edges, and whether it runs up them.
    let mut patches = DisjointSets::singletons(sheets.len());
    let sides = sides_by_edge(&sheets);
    let by_edge = || sides.chunk_by(|s, t| (s.0, s.1) == (t.0, t.1));
    for group in by_edge() {
        if let &[(.., g), (.., h)] = group {
            patches.join(g / 3, h / 3);
        }
    }
    let mut borders = BTreeMap::<u32, Vec<(u32, bool)>>::new();
    let mut left = Vec::new();
    for group in by_edge().filter(|group| group.len() != 2) {
        for &(low, _, h) in group {
            let side = (left.len() as u32, ends(&sheets, h).0 == low);
            borders.entry(patches.find(h / 3)).or_default().push(side);
        }
        left.push(group.iter().map(|&(.., h)| layers[h as usize / 3].len()).sum::<usize>());
    }
    let mut members = BTreeMap::<u32, Vec<usize>>::new();
    for sheet in 0..sheets.len() {
        let patch = patches.find(sheet as u32);
        if borders.contains_key(&patch) {
            members.entry(patch).or_default().push(sheet);
        }
    }
    let test = LazyCell::new(|| InsideTest::of_scaled(unit, points, &faces));
    // Number of windings of opposite sign on the two sides of a patch: one of the bodies there is inside out.
    let opposed = |patch: u32| -> usize {
        let corners = |&sheet: &usize| sheets[sheet].map(|v| points[v as usize]);
        let normal = |[a, b, c]: [Vec3; 3]| (b - a).cross(c - a);
        let faces = members[&patch].iter().map(corners);
        let largest = faces.max_by(|&s, &t| normal(s).length().total_cmp(&normal(t).length()));
        let [a, b, c] = largest.unwrap_or_default();
        let aside = (ASIDE * normal([a, b, c]).length().sqrt()).max(ABOVE * most);
        let at = PLACE[0] * a + PLACE[1] * b + PLACE[2] * c;
        let beside = [-aside, aside].map(|by| {
            let p = at + by * normal([a, b, c]).normalize_or_zero();
            test.winding_of_scaled(p).unwrap_or(0)
        });
        let [back, front] = beside.map(i32::unsigned_abs);
        if beside[0].signum() * beside[1].signum() < 0 { back.min(front) as usize } else { 0 }
    };
    let depth_of = |patch: u32, layers: &[Vec<usize>]| {
        members[&patch].iter().map(|&sheet| layers[sheet].len()).min().unwrap_or(0)
    };
    // Plane patches that have no other side so far.
    let mut alone = BTreeMap::<Vec<(u32, bool)>, u32>::new();
    let extent = |patches: [u32; 2]| {
        let own = patches.into_iter().flat_map(|patch| &members[&patch]);
        thickness(points, own.map(|&sheet| sheets[sheet]), members[&patches[0]].len())
    };
    for (&patch, border) in &mut borders {
        if extent([patch; 2]) > most {
            continue;
        }
        border.sort_unstable();
        let mut drop = |patch: u32, depth: usize, layers: &mut Vec<Vec<usize>>| {
            for &sheet in &members[&patch] {
                let own = &mut layers[sheet];
                own.split_off(own.len() - depth).into_iter().for_each(|face| is_wall[face] = true);
            }
        };
        let across: Vec<(u32, bool)> = border.iter().map(|&(edge, up)| (edge, !up)).collect();
        let other = match (alone.get(&across), alone.get(border)) {
            (Some(&other), _) => Some((other, usize::MAX, &across)),
            // The arrangement parts bodies whose walls are exactly plane.
            (None, Some(&other)) if extent([patch, other]) > 0.0 => {
                Some((other, opposed(patch), &*border))
            }
            _ => None,
        };
        let Some((other, most_layers, key)) = other else {
            alone.entry(border.clone()).or_insert(patch);
            continue;
        };
        let own = depth_of(patch, &layers);
        let depth = own.min(depth_of(other, &layers)).min(most_layers);
        let apart = extent([patch, other]);
        let mut by_edge = border.chunk_by(|a, b| a.0 == b.0);
        let opens = |run: &[(u32, bool)]| left[run[0].0 as usize] == 2 * depth * run.len() + 1;
        if apart > most || depth == 0 || by_edge.any(opens) {
            continue;
        }
        border.iter().for_each(|&(edge, _)| left[edge as usize] -= 2 * depth);
        [patch, other].iter().for_each(|&patch| drop(patch, depth, &mut layers));
        distance = distance.max(apart);
        // What has further copies may bound another wall.
        if depth_of(other, &layers) == 0 {
            alone.remove(key);
        }
        if depth_of(patch, &layers) > 0 {
            alone.insert(border.clone(), patch);
        }
    }
    (is_wall, distance)
}

/// The triangles of different corners, each with its faces: those of the orientation of most, less those of the other one,
/// which are walls like their partners.
fn sheets(faces: &[[u32; 3]], is_wall: &mut [bool]) -> Vec<([u32; 3], Vec<usize>)> {
    let corners = |face: u32| {
        let mut corners = faces[face as usize];
        corners.sort_unstable();
        corners
    };
    // Two sides of a triangle that touches no other are a body without volume.
    let mut is_alone = vec![true; faces.len()];
    for group in sides_by_edge(faces).chunk_by(|s, t| (s.0, s.1) == (t.0, t.1)) {
        if group.iter().any(|&(.., h)| corners(h / 3) != corners(group[0].2 / 3)) {
            group.iter().for_each(|&(.., h)| is_alone[h as usize / 3] = false);
        }
    }
    let mut by_corners: Vec<([u32; 3], bool, usize)> = (0..)
        .zip(faces)
        .map(|(index, &[a, b, c])| {
            let is_odd = (a > b) != ((b > c) != (a > c));
            (corners(index as u32), is_odd, index)
        })
        .collect();
    by_corners.sort_unstable();
    let sheets = by_corners.chunk_by(|s, t| s.0 == t.0).filter_map(|copies| {
        let odd = copies.iter().filter(|copy| copy.1).count();
        let pairs = odd.min(copies.len() - odd);
        // Even ones come first.
        let (ends, kept) = (copies.len() - pairs, pairs..copies.len() - pairs);
        let walls = copies[..pairs].iter().chain(&copies[ends..]);
        walls.for_each(|&(.., face)| is_wall[face] = !is_alone[face]);
        let kept: Vec<usize> = copies[kept].iter().map(|&(.., face)| face).collect();
        kept.first().map(|&first| (faces[first], kept.clone()))
    });
    sheets.collect()
}

/// Extent of faces across the plane of the `first` ones; infinite if these have no area.
fn thickness(points: &[Vec3], faces: impl Iterator<Item = [u32; 3]> + Clone, first: usize) -> f64 {
    let corners = faces.map(|face| face.map(|v| points[v as usize]));
    let areas = corners.clone().take(first).map(|[a, b, c]| (b - a).cross(c - a));
    let Some(normal) = areas.sum::<Vec3>().try_normalize() else { return f64::INFINITY };
    let heights = corners.flatten().map(|p| p.dot(normal));
    let (low, high) = heights
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), h| (low.min(h), high.max(h)));
    high - low
}

/// The parts of a closed surface. None where it is one-sided, where the directions at an edge do not match, one of its
/// faces there has no area, or they are more than [`MOST_FACES`].
pub(super) fn parted(points: &[Vec3], faces: &[[u32; 3]]) -> Option<Parted> {
    let Patches { mut faces, of: patch, turned } = Patches::new(points.len(), faces)?;
    let mut fans = DisjointSets::singletons(3 * faces.len());
    // Turned faces have other half-edges.
    let sides = sides_by_edge(&faces);
    for group in sides.chunk_by(|s, t| (s.0, s.1) == (t.0, t.1)) {
        let edge = [group[0].0, group[0].1];
        let around = Around { points, faces: &faces, patch: &patch, edge };
        let half_edges: Vec<u32> = group.iter().map(|&(.., h)| h).collect();
        let opening = half_edges.iter().filter(|&&h| around.opens(h)).count();
        if 2 * opening != half_edges.len() || half_edges.len() > MOST_FACES {
            return None;
        }
        let pairs = match half_edges[..] {
            [g, h] => vec![[g, h]],
            _ => around.pairs(&around.sorted(half_edges)?),
        };
        for [g, h] in pairs {
            for vertex in edge {
                fans.join(corner_at(&faces, g, vertex), corner_at(&faces, h, vertex));
            }
        }
    }
    let mut number = vec![u32::MAX; 3 * faces.len()];
    let mut vertices = Vec::new();
    for (corner, vertex) in (0..).zip(faces.as_flattened_mut()) {
        let own = &mut number[fans.find(corner) as usize];
        if *own == u32::MAX {
            *own = vertices.len() as u32;
            vertices.push(*vertex);
        }
        *vertex = *own;
    }
    Some(Parted { faces, vertices, turned })
}

/// Limit of the tests of a vertex against a face: a constant, and a number for each face.
const MOST_TESTS: [usize; 2] = [5_000_000, 200];

/// Splits faces at vertices that lie on them, exactly, so that parts that touch there share them. Faces that need more
/// than [`MOST_TESTS`] stay whole.
pub(super) fn split_at_vertices(points: &[Vec3], faces: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let corners = |face: [u32; 3]| face.map(|v| points[v as usize]);
    let tree = TriangleTree::new(0..faces.len() as u32, |face| corners(faces[face as usize]));
    let mut pieces: Vec<Vec<[u32; 3]>> = faces.iter().map(|&face| vec![face]).collect();
    let mut used = faces.as_flattened().to_vec();
    used.sort_unstable();
    used.dedup();
    let mut left = MOST_TESTS[0] + MOST_TESTS[1] * faces.len();
    for vertex in used {
        let p = points[vertex as usize];
        tree.overlapping([p; 3], |face, triangle| {
            let tests = pieces[face as usize].len();
            if left < tests {
                return ControlFlow::Break(());
            }
            left -= tests;
            if !faces[face as usize].contains(&vertex) && holds(triangle, p) {
                let pieces = &mut pieces[face as usize];
                let split = std::mem::take(pieces).into_iter().flat_map(|[a, b, c]| {
                    if !holds(corners([a, b, c]), p) {
                        return vec![[a, b, c]];
                    }
                    let around = [[a, b, vertex], [b, c, vertex], [c, a, vertex]].into_iter();
                    around.filter(|&piece| projection_axis(corners(piece)).is_some()).collect()
                });
                *pieces = split.collect();
            }
            ControlFlow::Continue(())
        });
    }
    pieces.concat()
}

/// Whether a point lies in a triangle or on its border.
fn holds([a, b, c]: [Vec3; 3], p: Vec3) -> bool {
    if !orient3d(a, b, c, p).is_zero() {
        return false;
    }
    let Some((axis, turn)) = projection_axis([a, b, c]) else { return false };
    let [a, b, c, p] = [a, b, c, p].map(|q| project(q, axis));
    [[a, b], [b, c], [c, a]].into_iter().all(|[from, to]| {
        let side = orient2d(from, to, p);
        side == turn || side.is_zero()
    })
}

/// The faces around an edge, by their half-edges there.
struct Around<'a> {
    points: &'a [Vec3],
    faces: &'a [[u32; 3]],
    /// Of each face.
    patch: &'a [u32],
    /// Ascending.
    edge: [u32; 2],
}

impl Around<'_> {
    /// The corner across from the edge.
    fn tip(&self, half_edge: u32) -> Vec3 {
        let face = self.faces[half_edge as usize / 3];
        self.points[face[(half_edge as usize + 2) % 3] as usize]
    }

    fn ends(&self) -> [Vec3; 2] {
        self.edge.map(|v| self.points[v as usize])
    }

    /// Whether the solid is behind the face towards larger angles: its faces look outward, and the half-edge goes down.
    fn opens(&self, half_edge: u32) -> bool {
        ends(self.faces, half_edge).0 == self.edge[1]
    }

    /// Counter-clockwise around the edge, from the first one. Of faces at one angle, those with the solid behind them at
    /// smaller angles come first.
    fn sorted(&self, mut group: Vec<u32>) -> Option<Vec<u32>> {
        let [a, b] = self.ends();
        let first = self.tip(group[0]);
        if group.iter().any(|&h| projection_axis([a, b, self.tip(h)]).is_none()) {
            return None;
        }
        let (axis, turn) = projection_axis([a, b, first])?;
        let turn_to = |p: Vec3| {
            let [a, b, p] = [a, b, p].map(|q| project(q, axis));
            orient2d(a, b, p)
        };
        // 0 at the angle of the first face, then the half turn after it, its opposite, and the other half turn.
        let sector = |p: Vec3| match orient3d(a, b, first, p) {
            Sign::Positive => 1,
            Sign::Negative => 3,
            Sign::Zero if turn_to(p) == turn => 0,
            Sign::Zero => 2,
        };
        let by_angle = |p: Vec3, q: Vec3| {
            let (of_p, of_q) = (sector(p), sector(q));
            of_p.cmp(&of_q).then_with(|| match orient3d(a, b, p, q) {
                Sign::Positive if of_p % 2 == 1 => Ordering::Less,
                Sign::Negative if of_p % 2 == 1 => Ordering::Greater,
                _ => Ordering::Equal,
            })
        };
        // Patches at one place and of one direction bound nothing between them: any order does that is the same at all
        // of their edges, seen from behind.
        let among_equal = |h: u32| {
            let patch = self.patch_of(h);
            if self.opens(h) { (true, u32::MAX - patch) } else { (false, patch) }
        };
        group.sort_by(|&g, &h| {
            by_angle(self.tip(g), self.tip(h)).then(among_equal(g).cmp(&among_equal(h)))
        });
        Some(group)
    }

    fn patch_of(&self, half_edge: u32) -> u32 {
        self.patch[half_edge as usize / 3]
    }

    /// The half-edges that are joined, from their order around the edge.
    fn pairs(&self, sorted: &[u32]) -> Vec<[u32; 2]> {
        let mut by_patch = sorted.to_vec();
        by_patch.sort_by_key(|&h| self.patch_of(h));
        let patches = by_patch.chunk_by(|&g, &h| self.patch_of(g) == self.patch_of(h));
        let mut pairs: Vec<[u32; 2]> = patches.flat_map(|own| self.nested(own)).collect();
        let joined: HashSet<u32> = pairs.as_flattened().iter().copied().collect();
        let left: Vec<u32> = sorted.iter().copied().filter(|h| !joined.contains(h)).collect();
        pairs.extend(self.nested(&left));
        pairs
    }

    /// Pairs with the solid between them, like brackets in a ring; those without a partner are left out.
    fn nested(&self, sorted: &[u32]) -> Vec<[u32; 2]> {
        let (mut pairs, mut open) = (Vec::new(), Vec::new());
        let mut is_closed = vec![false; sorted.len()];
        // Twice around: the first faces may close a wedge that the last ones open.
        for (k, &h) in sorted.iter().chain(sorted).enumerate() {
            let is_first = k < sorted.len();
            let closed = &mut is_closed[k % sorted.len()];
            if self.opens(h) {
                open.extend(is_first.then_some(h));
            } else if !*closed && let Some(other) = open.pop() {
                *closed = true;
                pairs.push([other, h]);
            }
        }
        pairs
    }
}
