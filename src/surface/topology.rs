//! Adjacency of a triangle mesh, the orientation of its faces, and the nesting of its components.
//!
//! Half-edge `3 f + k` runs from corner `k` of face `f` to the next corner. Two half-edges between
//! the same vertices are neighbours if no third one is; they agree on the orientation if they run
//! in opposite directions.

use std::ops::ControlFlow;

use super::inside::{Crossing, InsideTest};
use super::intersections::{Intersections, intersections};
use super::mesh::Unit;
use super::report::Repair;
use crate::Vec3;
use crate::geometry::DisjointSets;
use crate::sum::Sum;

/// Adjacency, defects and components of a triangle mesh, with any defects.
#[derive(Clone, Debug, Default)]
pub(super) struct Topology {
    /// The half-edge across each half-edge, or [`NONE`] where there is none or more than one.
    across: Vec<u32>,
    /// Number of undirected edges.
    pub edges: usize,
    pub boundary_edges: usize,
    pub first_boundary: Option<[u32; 2]>,
    pub nonmanifold_edges: usize,
    /// The first edge with more than two faces, and their number.
    pub first_nonmanifold: Option<([u32; 2], usize)>,
    /// Vertices with more than one fan of faces.
    pub nonmanifold_vertices: usize,
    pub first_nonmanifold_vertex: Option<u32>,
    /// A face that disagrees with a neighbour about the orientation.
    pub first_inconsistent: Option<u32>,
    /// Component of each face; components are numbered by their first face.
    pub component: Vec<u32>,
    /// First face of each component.
    pub first_face: Vec<u32>,
    /// For each corner (`3 face + k`) the first one of its *fan*, the faces that hang together around
    /// the corner's vertex.
    pub fan: Vec<u32>,
}

/// No half-edge.
const NONE: u32 = u32::MAX;

impl Topology {
    /// Analyses faces whose three corners differ. `O(F log F)`.
    pub fn new(vertices: usize, faces: &[[u32; 3]]) -> Self {
        let mut topology = Self { across: vec![NONE; 3 * faces.len()], ..Self::default() };
        let mut fans = DisjointSets::singletons(3 * faces.len());
        let mut parts = DisjointSets::singletons(faces.len());
        topology.pair_half_edges(faces, &mut fans, &mut parts);
        topology.fan = (0..3 * faces.len() as u32).map(|corner| fans.find(corner)).collect();
        topology.count_fans(vertices, faces);
        topology.number_components(faces.len(), &mut parts);
        topology
    }

    /// For each component whether some edge of it has not two faces.
    fn open_components(&self) -> Vec<bool> {
        let mut is_open = vec![false; self.first_face.len()];
        for (across, component) in self.across.chunks_exact(3).zip(&self.component) {
            is_open[*component as usize] |= across.contains(&NONE);
        }
        is_open
    }

    /// Whether no edge has more than two faces, and every vertex has one fan of them.
    pub fn is_manifold(&self) -> bool {
        self.nonmanifold_edges == 0 && self.nonmanifold_vertices == 0
    }

    fn pair_half_edges(
        &mut self,
        faces: &[[u32; 3]],
        fans: &mut DisjointSets,
        parts: &mut DisjointSets,
    ) {
        // "First" means the smallest edge.
        for group in sides_by_edge(faces).chunk_by(|s, t| (s.0, s.1) == (t.0, t.1)) {
            let edge = [group[0].0, group[0].1];
            self.edges += 1;
            match *group {
                [_] => {
                    self.boundary_edges += 1;
                    self.first_boundary.get_or_insert(edge);
                }
                [(.., g), (.., h)] => {
                    self.across[g as usize] = h;
                    self.across[h as usize] = g;
                    if ends(faces, g) == ends(faces, h) {
                        self.first_inconsistent.get_or_insert(g / 3);
                    }
                }
                _ => {
                    self.nonmanifold_edges += 1;
                    self.first_nonmanifold.get_or_insert((edge, group.len()));
                }
            }
            // Faces around a non-manifold edge count as one fan: the edge is reported, not its ends.
            for pair in group.windows(2) {
                let (g, h) = (pair[0].2, pair[1].2);
                parts.join(g / 3, h / 3);
                for vertex in edge {
                    fans.join(corner_at(faces, g, vertex), corner_at(faces, h, vertex));
                }
            }
        }
    }

    fn count_fans(&mut self, vertices: usize, faces: &[[u32; 3]]) {
        const SEVERAL: u32 = u32::MAX - 1;
        let mut fan_of = vec![NONE; vertices];
        for (&fan, &vertex) in self.fan.iter().zip(faces.as_flattened()) {
            let known = &mut fan_of[vertex as usize];
            if *known == NONE {
                *known = fan;
            } else if *known != fan {
                *known = SEVERAL;
            }
        }
        self.nonmanifold_vertices = fan_of.iter().filter(|&&fan| fan == SEVERAL).count();
        let first = fan_of.iter().position(|&fan| fan == SEVERAL);
        self.first_nonmanifold_vertex = first.map(|v| v as u32);
    }

    fn number_components(&mut self, faces: usize, parts: &mut DisjointSets) {
        let mut number = vec![NONE; faces];
        for face in 0..faces as u32 {
            let root = parts.find(face) as usize;
            if number[root] == NONE {
                number[root] = self.first_face.len() as u32;
                self.first_face.push(face);
            }
            self.component.push(number[root]);
        }
    }

    /// For each face whether it has to be turned over so that all agree with the first face of
    /// their component, or a face where that is impossible.
    pub fn turns(&self, faces: &[[u32; 3]]) -> Result<Vec<bool>, u32> {
        let mut turned: Vec<Option<bool>> = vec![None; faces.len()];
        let mut stack = Vec::new();
        for seed in 0..faces.len() as u32 {
            if turned[seed as usize].is_none() {
                turned[seed as usize] = Some(false);
                stack.push(seed);
            }
            while let Some(face) = stack.pop() {
                let own = turned[face as usize] == Some(true);
                for side in 3 * face..3 * face + 3 {
                    let across = self.across[side as usize];
                    if across == NONE {
                        continue;
                    }
                    let same_direction = ends(faces, side) == ends(faces, across);
                    let wanted = own ^ same_direction;
                    match &mut turned[across as usize / 3] {
                        Some(known) if *known != wanted => return Err(face),
                        Some(_) => {}
                        unknown => {
                            *unknown = Some(wanted);
                            stack.push(across / 3);
                        }
                    }
                }
            }
        }
        Ok(turned.into_iter().map(|t| t == Some(true)).collect())
    }
}

/// The ends of every half-edge, ascending, and its number, sorted: those of an edge are neighbours.
pub(super) fn sides_by_edge(faces: &[[u32; 3]]) -> Vec<(u32, u32, u32)> {
    let sides = (0..3 * faces.len() as u32).map(|h| {
        let (a, b) = ends(faces, h);
        (a.min(b), a.max(b), h)
    });
    let mut sides: Vec<_> = sides.collect();
    sides.sort_unstable();
    sides
}

/// Start and end of a half-edge.
pub(super) fn ends(faces: &[[u32; 3]], half_edge: u32) -> (u32, u32) {
    let face = faces[half_edge as usize / 3];
    let k = half_edge as usize % 3;
    (face[k], face[(k + 1) % 3])
}

/// The corner of the half-edge's face that lies at one of its ends.
pub(super) fn corner_at(faces: &[[u32; 3]], half_edge: u32, vertex: u32) -> u32 {
    let start = ends(faces, half_edge).0 == vertex;
    let (face, k) = (half_edge / 3, half_edge % 3);
    if start { half_edge } else { 3 * face + (k + 1) % 3 }
}

// Turns faces so that every shell looks away from the solid: outer shells outward, shells of
// cavities inward.
//
// 1. Within a component all faces follow the first one (breadth over common edges).
// 2. A component is turned by the sign of the volume it encloses. A volume within its own
//    rounding error counts as none and is rejected.
// 3. A component is a cavity if it lies in an odd number of others. Where it touches one of them, or they overlap, its
//    orientation against theirs decides.

/// How a component is oriented, and how it should be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shell {
    /// Signed volume in scaled units; positive if the faces look outward.
    pub volume: f64,
    /// Bound on the rounding error of `volume`.
    pub rounding: f64,
    /// Whether it bounds a hole in the solid.
    pub is_cavity: bool,
}

impl Shell {
    /// Whether its two sides coincide, to double precision.
    pub fn is_flat(&self) -> bool {
        self.volume.abs() <= self.rounding
    }

    /// Whether its faces look away from the solid.
    pub fn is_right(&self) -> bool {
        (self.volume > 0.0) != self.is_cavity
    }
}

/// Volume and depth of every component of a closed, consistently oriented surface.
pub(super) fn shells(
    unit: Unit,
    points: &[Vec3],
    faces: &[[u32; 3]],
    topology: &Topology,
    intersections: &Intersections,
) -> Result<Vec<Shell>, TooManyNested> {
    let mut shells = volumes(points, faces, topology);
    let parts = Parts { unit, points, faces, component: &topology.component };
    let counts = depths(&parts, &topology.first_face, &intersections.components)?;
    let depth = |k: usize| counts[k].apart.len() + counts[k].touched.len();
    let mut outer_first: Vec<usize> = (0..shells.len()).collect();
    outer_first.sort_by_key(|&k| depth(k));
    // Whether those around it lie one in the other, without contact.
    let mut is_nested = vec![true; shells.len()];
    for k in outer_first {
        let Around { apart, touched } = &counts[k];
        let around = || apart.iter().chain(touched).map(|&other| other as usize);
        let Some(innermost) = around().max_by_key(|&other| depth(other)) else { continue };
        is_nested[k] =
            touched.is_empty() && is_nested[innermost] && depth(innermost) + 1 == depth(k);
        shells[k].is_cavity = if is_nested[k] {
            !shells[innermost].is_cavity
        } else {
            let bodies = || around().filter(|&other| !shells[other].is_cavity);
            let body = bodies().max_by_key(|&body| depth(body));
            let is_turned =
                body.is_some_and(|body| (shells[body].volume > 0.0) != (shells[k].volume > 0.0));
            // Where all bodies have a hole there is no place for another.
            is_turned && 2 * bodies().count() > depth(k)
        };
    }
    Ok(shells)
}

/// For each component the one whose solid it bounds: the innermost closed component around it if it is a cavity, in an odd
/// number of them, else itself. A component that is open bounds none but its own.
pub(super) fn solids(
    unit: Unit,
    points: &[Vec3],
    faces: &[[u32; 3]],
    topology: &Topology,
) -> Result<Vec<usize>, TooManyNested> {
    let parts = Parts { unit, points, faces, component: &topology.component };
    let meeting = intersections(points, faces, &topology.component).components;
    let is_open = topology.open_components();
    let mut around: Vec<Vec<u32>> = depths(&parts, &topology.first_face, &meeting)?
        .into_iter()
        .map(|Around { apart, touched }| [apart, touched].concat())
        .collect();
    around.iter_mut().for_each(|around| around.retain(|&other| !is_open[other as usize]));
    let solid_of = |own: usize| match around[own].iter().max_by_key(|&&k| around[k as usize].len())
    {
        Some(&owner) if around[own].len() % 2 == 1 && !is_open[own] => owner as usize,
        _ => own,
    };
    Ok((0..around.len()).map(solid_of).collect())
}

/// Exchanges two corners of the faces that are marked.
pub(super) fn turn_over(faces: &mut [[u32; 3]], marked: impl Iterator<Item = bool>) {
    for (face, _) in faces.iter_mut().zip(marked).filter(|(_, marked)| *marked) {
        face.swap(1, 2);
    }
}

/// The effect of turning faces: `turned` marks faces that disagreed with the first face of
/// their component, `wrong` the components that were turned as a whole afterwards.
pub(super) fn repairs(
    turned: &[bool],
    wrong: &[bool],
    shells: &[Shell],
    component: &[u32],
) -> Vec<Repair> {
    // By component: faces that were turned, and faces in all. Unclosed surfaces have no shells.
    let components = component.iter().max().map_or(0, |&c| c as usize + 1);
    let mut faces = vec![[0; 2]; components];
    for (&turned, &component) in turned.iter().zip(component) {
        faces[component as usize][0] += usize::from(turned);
        faces[component as usize][1] += 1;
    }
    let (mut reoriented, mut outward, mut inward) = (0, 0, 0);
    for (index, &[turned, all]) in faces.iter().enumerate() {
        let whole = wrong.get(index).is_some_and(|&w| w);
        match (turned, whole) {
            (0, false) => {}
            (0, true) if shells[index].is_cavity => inward += 1,
            (0, true) => outward += 1,
            (_, false) => reoriented += turned,
            // Turned twice is not turned: only the other faces of the component changed.
            (_, true) => reoriented += all - turned,
        }
    }
    let all = [
        Repair::ReorientedFaces { faces: reoriented },
        Repair::TurnedOutward { components: outward },
        Repair::TurnedInward { components: inward },
    ];
    all.into_iter().filter(|r| r.count() > 0).collect()
}

fn volumes(points: &[Vec3], faces: &[[u32; 3]], topology: &Topology) -> Vec<Shell> {
    let origins: Vec<Vec3> =
        topology.first_face.iter().map(|&face| points[faces[face as usize][0] as usize]).collect();
    let mut sums = vec![Sum::default(); origins.len()];
    let mut sizes = vec![0.0; origins.len()];
    for (face, &component) in faces.iter().zip(&topology.component) {
        let component = component as usize;
        // From a vertex of the component itself: far from the origin nothing cancels then.
        let [a, b, c] = face.map(|v| points[v as usize] - origins[component]);
        sums[component].add(a.dot(b.cross(c)));
        sizes[component] += a.length() * b.length() * c.length();
    }
    sums.iter()
        .zip(sizes)
        .map(|(sum, size)| Shell {
            volume: sum.value() / 6.0,
            // Each determinant is off by at most some 10 roundings of the product of lengths.
            rounding: 16.0 * f64::EPSILON * size / 6.0,
            is_cavity: false,
        })
        .collect()
}

// For each component of a surface the number of components around it.
//
// Component A lies in component B
// - if the two do not meet, and B winds around a vertex of A (then around all of them);
// - if they touch, no vertex of A is outside B, no vertex of B strictly inside A, and a vertex of
//   A is strictly inside B. Where all vertices of A lie on B, the centres of the faces of A vote.
//
// Components that meet in any other way overlap, and neither lies in the other.

/// A closed surface in components.
pub(super) struct Parts<'a> {
    pub unit: Unit,
    /// Vertices in scaled units.
    pub points: &'a [Vec3],
    pub faces: &'a [[u32; 3]],
    /// Component of each face.
    pub component: &'a [u32],
}

/// The work for a nesting this deep would grow with the square of the number of components.
#[derive(Debug)]
pub(super) struct TooManyNested;

/// The components around one.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Around {
    /// Those that it does not touch.
    pub apart: Vec<u32>,
    /// Those that it touches.
    pub touched: Vec<u32>,
}

/// The components around each one. `meeting` lists the pairs that touch or overlap, sorted.
pub(super) fn depths(
    parts: &Parts<'_>,
    first_face: &[u32],
    meeting: &[[u32; 2]],
) -> Result<Vec<Around>, TooManyNested> {
    let mut around = vec![Around::default(); first_face.len()];
    if around.len() > 1 {
        let mut budget = Budget { left: 30_000_000 + 100 * parts.faces.len() };
        count_separate(parts, first_face, meeting, &mut around, &mut budget)?;
        list_touching(parts, meeting, &mut around, &mut budget)?;
    }
    Ok(around)
}

/// Steps of work that may still be done.
struct Budget {
    left: usize,
}

impl Budget {
    fn spend(&mut self, steps: usize) -> Result<(), TooManyNested> {
        self.left = self.left.checked_sub(steps).ok_or(TooManyNested)?;
        Ok(())
    }
}

/// Components around each one that they do not meet: one ray for each component, crossing all.
fn count_separate(
    parts: &Parts<'_>,
    first_face: &[u32],
    meeting: &[[u32; 2]],
    found: &mut [Around],
    budget: &mut Budget,
) -> Result<(), TooManyNested> {
    let test = InsideTest::of_scaled(parts.unit, parts.points, parts.faces);
    // Winding around one point by component, and the components it was counted for.
    let mut winding = vec![0; found.len()];
    let mut crossed = Vec::new();
    for (own, &face) in (0..).zip(first_face) {
        let point = parts.points[parts.faces[face as usize][0] as usize];
        test.crossings(point, |face, crossing| {
            // The point lies on its own component and on some that meet it; these do not count.
            if let Crossing::Above(sign) = crossing {
                let other = parts.component[face as usize];
                winding[other as usize] += sign;
                crossed.push(other);
            }
            ControlFlow::Continue(())
        });
        budget.spend(crossed.len())?;
        crossed.sort_unstable();
        crossed.dedup();
        for other in crossed.drain(..) {
            // Taken, so that the counter is zero again for the next ray.
            let around = std::mem::take(&mut winding[other as usize]) != 0;
            let meets = meeting.binary_search(&[own.min(other), own.max(other)]).is_ok();
            if around && other != own && !meets {
                found[own as usize].apart.push(other);
            }
        }
    }
    Ok(())
}

/// One component by itself.
struct Part {
    vertices: Vec<Vec3>,
    /// Of the faces, rounded.
    centres: Vec<Vec3>,
    lo: Vec3,
    hi: Vec3,
    test: InsideTest,
}

impl Part {
    fn new(parts: &Parts<'_>, faces: &[[u32; 3]]) -> Self {
        let mut corners: Vec<u32> = faces.as_flattened().to_vec();
        corners.sort_unstable();
        corners.dedup();
        let vertices: Vec<Vec3> = corners.into_iter().map(|v| parts.points[v as usize]).collect();
        let corners = faces.iter().map(|face| face.map(|v| parts.points[v as usize]));
        let centres = corners.map(|[a, b, c]| 0.5 * (a + 0.5 * (b + c))).collect();
        let lo = vertices.iter().fold(Vec3::INFINITY, |lo, &v| lo.min(v));
        let hi = vertices.iter().fold(Vec3::NEG_INFINITY, |hi, &v| hi.max(v));
        let test = InsideTest::of_scaled(parts.unit, parts.points, faces);
        Self { vertices, centres, lo, hi, test }
    }

    /// How many of the points are strictly inside, and how many outside; counts no further than
    /// to the first one outside if that `decides`.
    fn count(
        &self,
        points: &[Vec3],
        decides: bool,
        budget: &mut Budget,
    ) -> Result<(usize, usize), TooManyNested> {
        let (mut inside, mut outside) = (0, 0);
        for &point in points {
            // A query costs about as much as ten crossings.
            budget.spend(10)?;
            match self.test.winding_of_scaled(point) {
                Some(0) => outside += 1,
                Some(_) => inside += 1,
                None => {}
            }
            if decides && outside > 0 {
                break;
            }
        }
        Ok((inside, outside))
    }
}

/// Components around each one that they touch.
fn list_touching(
    parts: &Parts<'_>,
    meeting: &[[u32; 2]],
    found: &mut [Around],
    budget: &mut Budget,
) -> Result<(), TooManyNested> {
    let mut faces: Vec<Vec<[u32; 3]>> = vec![Vec::new(); found.len()];
    for (&face, &component) in parts.faces.iter().zip(parts.component) {
        faces[component as usize].push(face);
    }
    // Built on demand: most components touch no other.
    let mut cache: Vec<Option<Part>> = (0..found.len()).map(|_| None).collect();
    for &[a, b] in meeting {
        for i in [a, b].map(|i| i as usize) {
            cache[i].get_or_insert_with(|| Part::new(parts, &faces[i]));
        }
        if let (Some(first), Some(second)) = (&cache[a as usize], &cache[b as usize]) {
            if lies_in(first, second, budget)? {
                found[a as usize].touched.push(b);
            }
            if lies_in(second, first, budget)? {
                found[b as usize].touched.push(a);
            }
        }
    }
    Ok(())
}

fn lies_in(inner: &Part, outer: &Part, budget: &mut Budget) -> Result<bool, TooManyNested> {
    // The boxes decide most pairs without a query.
    if !(inner.lo.cmpge(outer.lo).all() && inner.hi.cmple(outer.hi).all()) {
        return Ok(false);
    }
    let (strictly, out) = outer.count(&inner.vertices, true, budget)?;
    if out > 0 || inner.count(&outer.vertices, false, budget)?.0 > 0 {
        return Ok(false);
    }
    if strictly > 0 {
        return Ok(true);
    }
    // All vertices are on the outer surface; rounded centres may be on either side, so the majority decides.
    let (inside, outside) = outer.count(&inner.centres, false, budget)?;
    Ok(inside > outside)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TETRAHEDRON: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

    #[test]
    fn closed_open_and_doubled() {
        let closed = Topology::new(4, &TETRAHEDRON);
        assert!(closed.is_manifold() && closed.first_inconsistent.is_none());
        assert_eq!(closed.boundary_edges, 0);
        assert_eq!((closed.edges, closed.first_face.len()), (6, 1));
        let open = Topology::new(4, &TETRAHEDRON[..3]);
        assert_eq!((open.boundary_edges, open.first_boundary), (3, Some([1, 2])));
        assert!(open.is_manifold());
        let mut doubled = TETRAHEDRON.to_vec();
        doubled.push([0, 1, 4]);
        let fin = Topology::new(5, &doubled);
        assert_eq!((fin.nonmanifold_edges, fin.first_nonmanifold), (1, Some(([0, 1], 3))));
        assert_eq!(fin.nonmanifold_vertices, 0);
    }

    #[test]
    fn two_tetrahedra_at_a_vertex_have_two_fans_there() {
        let shifted = TETRAHEDRON.map(|f| f.map(|v| if v == 0 { 0 } else { v + 3 }));
        let faces = [TETRAHEDRON, shifted].concat();
        let topology = Topology::new(7, &faces);
        assert_eq!(topology.nonmanifold_vertices, 1);
        assert_eq!(topology.first_nonmanifold_vertex, Some(0));
        assert_eq!(topology.component, [0, 0, 0, 0, 1, 1, 1, 1]);
    }

    #[test]
    fn turning_finds_the_odd_face_and_the_one_sided_surface() {
        let mut faces = TETRAHEDRON;
        faces[2].swap(1, 2);
        let topology = Topology::new(4, &faces);
        assert!(topology.first_inconsistent.is_some());
        assert_eq!(topology.turns(&faces).unwrap(), [false, false, true, false]);
        // The projective plane with six vertices.
        let plane = [
            [0, 1, 2],
            [0, 2, 3],
            [0, 3, 4],
            [0, 4, 5],
            [0, 5, 1],
            [1, 2, 4],
            [2, 3, 5],
            [3, 4, 1],
            [4, 5, 2],
            [5, 1, 3],
        ];
        let topology = Topology::new(6, &plane);
        assert!(topology.is_manifold() && topology.boundary_edges == 0);
        assert_eq!(6 - topology.edges as i64 + 10, 1);
        assert!(topology.turns(&plane).is_err());
    }
}
