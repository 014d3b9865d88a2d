//! Repairs on demand: drop small components, separate touching parts, fill holes.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::f64::consts::PI;
use std::str::FromStr;

use super::mesh::Unit;
use super::parts::parted;
use super::report::{Fault, Repair, VertexName};
use super::soup::PolygonSoup;
use super::topology::{Topology, solids};
use super::{Inspection, Loaded, SurfaceError, TriMesh, inspected};
use crate::Vec3;

/// Which parts of a surface are kept, each with its cavities.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Components {
    /// All of them.
    #[default]
    All,
    /// Some of the largest area, the first of equal ones; one at least.
    Largest(usize),
    /// Those with a share of the whole area; the largest at least.
    Share(f64),
}

impl FromStr for Components {
    type Err = String;

    /// `all`, `largest`, a number of components, or a share below 1.
    fn from_str(text: &str) -> Result<Self, String> {
        match (text, text.parse::<usize>(), text.parse::<f64>()) {
            ("all", ..) => Ok(Self::All),
            ("largest", ..) => Ok(Self::Largest(1)),
            (_, Ok(number), _) if number > 0 => Ok(Self::Largest(number)),
            (_, _, Ok(share)) if share > 0.0 && share < 1.0 => Ok(Self::Share(share)),
            _ => Err("expected all, largest, a number of parts, or a share of the area below 1"
                .to_owned()),
        }
    }
}

/// Repairs on demand, besides those of [`read`](super::read).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MendOptions {
    /// Whether holes are closed by triangles between their vertices, with the largest dihedral angle
    /// as small as possible. Parts that touch in a vertex are separated before.
    pub fill_holes: bool,
    /// Which parts are kept.
    pub components: Components,
}

impl Inspection {
    /// Repairs more than [`read`](super::read) does; the result must pass its checks. Only vertices of separated parts are
    /// moved. The report lists all repairs in order.
    ///
    /// # Errors
    /// As [`read`](super::read) after the repairs, and when a hole is too long to be
    /// filled, meets itself, or cannot be closed without edges that are there already.
    ///
    /// # Cost
    /// That of [`read`](super::read), and `O(n^3)` for a hole of `n` edges.
    ///
    /// ```
    /// use medial::surface::{self, MendOptions};
    ///
    /// let open = b"OFF\n4 3 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n";
    /// let options = MendOptions { fill_holes: true, ..MendOptions::default() };
    /// let mended = surface::inspect_bytes("open.off", open)?.mend(options)?;
    /// assert_eq!(mended.mesh.faces.len(), 4);
    /// assert_eq!(mended.report.repairs[0].to_string(), "filled a hole of 3 edges with 1 triangle");
    /// # Ok::<(), medial::surface::SurfaceError>(())
    /// ```
    pub fn mend(self, options: MendOptions) -> Result<Loaded, SurfaceError> {
        let file = self.file.clone();
        mended(self, options).map_err(|error| SurfaceError { file, ..error })
    }
}

fn mended(inspection: Inspection, options: MendOptions) -> Result<Loaded, SurfaceError> {
    if options == MendOptions::default() {
        return inspection.solid();
    }
    let Inspection { mesh, report, refused, resolved, file_vertex, .. } = inspection;
    // What was resolved is closed, and what users of the other verbs see.
    let (Loaded { mut mesh, report }, refused) = match resolved {
        Some(solid) => (*solid, None),
        None => (Loaded { mesh, report }, refused),
    };
    let mut repairs = report.repairs;
    // The examination of the result repeats its warnings; a failed one has none of the reader.
    let mut warnings = if refused.is_some() { Vec::new() } else { report.warnings };
    // A loop of a one-sided surface ends where the orientation turns over, and no filling makes it a solid.
    let is_one_sided = |error: &SurfaceError| matches!(error.fault, Fault::NonOrientable { .. });
    if let Some(error) = refused.as_ref().filter(|error| options.fill_holes && is_one_sided(error))
    {
        return Err(error.clone());
    }
    if options.fill_holes {
        let TriMesh { vertices, faces } = &mut mesh;
        // The loops of holes pass a vertex once only if its fans are separate.
        repairs.extend(separate(vertices, faces, Stays::Flattest));
        repairs.extend(fill(vertices, faces, &file_vertex)?);
    }
    // After holes are filled: an open component bounds no cavity, and has none.
    repairs.extend(keep(&mut mesh, options.components)?);
    let TriMesh { vertices, faces } = mesh;
    let mended = inspected(PolygonSoup::of_triangles(&vertices, &faces)?)?;
    if mended.resolved.is_some() {
        warnings.clear();
    }
    let mut loaded = mended.solid()?;
    repairs.append(&mut loaded.report.repairs);
    loaded.report.repairs = repairs;
    warnings.retain(|warning| !loaded.report.warnings.contains(warning));
    loaded.report.warnings.splice(0..0, warnings);
    Ok(loaded)
}

/// Keeps the faces of some solids, each with its cavities.
///
/// # Errors
/// When too many components lie in others.
fn keep(mesh: &mut TriMesh, which: Components) -> Result<Option<Repair>, Fault> {
    if which == Components::All {
        return Ok(None);
    }
    let topology = Topology::new(mesh.vertices.len(), &mesh.faces);
    let unit = Unit::of(&mesh.vertices);
    let points = unit.forward_all(&mesh.vertices);
    let components = topology.first_face.len();
    let solid_of = solids(unit, &points, &mesh.faces, &topology)
        .map_err(|_| Fault::TooManyNested { components })?;
    let mut areas = vec![0.0; components];
    for (face, &component) in topology.component.iter().enumerate() {
        let [a, b, c] = mesh.faces[face].map(|v| points[v as usize]);
        areas[solid_of[component as usize]] += (b - a).cross(c - a).length();
    }
    let mut by_area: Vec<usize> = (0..components).filter(|&c| solid_of[c] == c).collect();
    by_area.sort_by(|&a, &b| areas[b].total_cmp(&areas[a]).then(a.cmp(&b)));
    let all: f64 = areas.iter().sum();
    let number = match which {
        Components::All => components,
        Components::Largest(number) => number,
        Components::Share(share) => by_area.iter().filter(|&&c| areas[c] >= share * all).count(),
    };
    let mut is_kept = vec![false; components];
    by_area.iter().take(number.max(1)).for_each(|&c| is_kept[c] = true);
    let faces = mesh.faces.len();
    // `retain` visits faces in order, so the iterator keeps pace with it.
    let mut of_face = topology.component.iter().map(|&c| is_kept[solid_of[c as usize]]);
    mesh.faces.retain(|_| of_face.next() == Some(true));
    let components = (0..components).filter(|&c| !is_kept[solid_of[c]]).count();
    let dropped = Repair::DroppedComponents { components, faces: faces - mesh.faces.len() };
    Ok((components > 0).then_some(dropped))
}

// Closes holes of a surface by triangles between their vertices; no vertex is moved or added.
//
// * G. Barequet, M. Sharir: *Filling gaps in the boundary of a polyhedron*, Computer Aided
//   Geometric Design 12 (1995), <https://doi.org/10.1016/0167-8396(94)00011-G>: the triangulation
//   of a loop of least weight, by dynamic programming over its chains.
// * P. Liepa: *Filling holes in meshes*, SGP 2003, <https://doi.org/10.2312/SGP/SGP03/200-206>:
//   the weight of a triangulation is its largest dihedral angle, the surface around it included,
//   then its area; section 3.
//
// 1. Edges with one face are chained to loops, against the direction of their faces.
// 2. `W(i, k)` is the least weight of a triangulation of the chain from corner `i` to corner `k`. It
//    follows from shorter chains, so these come first:
//    `W(i, k) = min over m of W(i, m) + W(m, k) + triangle (i, m, k)`.
// 3. The triangles are read off backwards, from the whole loop to shorter chains.
//
// # Deviations from the papers
//
// - An existing edge of the surface is not used as a chord: it would get more than two faces.
// - The filling is neither refined nor smoothed, because that would add and move vertices.
//
// # Cost
// `O(n^3)` time and `O(n^2)` memory for a loop of `n` edges, so that long loops are rejected.

/// Number of edges of the longest loop that is filled.
const MAX_EDGES: usize = 500;

/// Closes all holes of consistently oriented faces; returns one repair for each hole.
///
/// # Errors
/// When a loop is too long, meets itself, or has no triangulation with new edges alone. Then nothing
/// is changed.
fn fill(
    vertices: &[Vec3],
    faces: &mut Vec<[u32; 3]>,
    file_vertex: &[u32],
) -> Result<Vec<Repair>, Fault> {
    let named = |vertex| named(vertices, file_vertex, vertex);
    // Found before any hole is filled: new triangles must not change the loops of other holes.
    let rim = Rim::new(faces);
    let mut repairs = Vec::new();
    let mut added: Vec<[u32; 3]> = Vec::new();
    // Grows with each patch, so that two patches never share a chord.
    let mut edges = rim.edges;
    for corners in loops(&rim.next).map_err(|vertex| Fault::BranchingHole { at: named(vertex) })? {
        let first = named(corners[0]);
        if corners.len() > MAX_EDGES {
            let (edges, most) = (corners.len(), MAX_EDGES);
            return Err(Fault::LongHole { edges, most, first });
        }
        let patch = Patch::new(vertices, faces, &rim.face_at, &corners, &edges).triangles();
        let patch = patch.ok_or(Fault::BlockedHole { first })?;
        for &[a, b, c] in &patch {
            edges.extend(sides(&[a, b, c]).map(ascending));
        }
        repairs.push(Repair::FilledHole { edges: corners.len(), triangles: patch.len() });
        added.extend(patch);
    }
    faces.extend(added);
    Ok(repairs)
}

fn sides(&[a, b, c]: &[u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}

fn ascending([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// The vertex by its number in the file. One that was added to separate parts has that of the nearest vertex.
fn named(vertices: &[Vec3], file_vertex: &[u32], vertex: u32) -> VertexName {
    let position = vertices[vertex as usize];
    let distance = |&vertex: &usize| (vertices[vertex] - position).length();
    let nearest = (0..file_vertex.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
    let index = nearest.map_or(vertex, |nearest| file_vertex[nearest]) as usize;
    VertexName { index, position }
}

/// The edges with one face.
struct Rim {
    /// For each start of such an edge, against its face's direction, the ends.
    next: HashMap<u32, Vec<u32>>,
    /// The face at each of them.
    face_at: HashMap<[u32; 2], u32>,
    /// All edges of the surface, as ascending pairs.
    edges: HashSet<[u32; 2]>,
}

impl Rim {
    fn new(faces: &[[u32; 3]]) -> Self {
        let mut uses: HashMap<[u32; 2], u32> = HashMap::new();
        for side in faces.iter().flat_map(sides) {
            *uses.entry(ascending(side)).or_default() += 1;
        }
        let (mut next, mut face_at) = (HashMap::<u32, Vec<u32>>::new(), HashMap::new());
        for (index, face) in (0..).zip(faces) {
            for [a, b] in sides(face).into_iter().filter(|&side| uses[&ascending(side)] == 1) {
                next.entry(b).or_default().push(a);
                face_at.insert([b, a], index);
            }
        }
        Self { next, face_at, edges: uses.into_keys().collect() }
    }
}

/// Step 1: the loops, each from its lowest vertex, in the order of these.
///
/// # Errors
/// The vertex where edges branch.
fn loops(next: &HashMap<u32, Vec<u32>>) -> Result<Vec<Vec<u32>>, u32> {
    let mut starts: Vec<u32> = next.keys().copied().collect();
    starts.sort_unstable();
    let mut seen = HashSet::new();
    let mut loops = Vec::new();
    for start in starts {
        if !seen.insert(start) {
            continue;
        }
        let mut corners = vec![start];
        loop {
            let last = corners[corners.len() - 1];
            let &[after] = next.get(&last).map_or(&[][..], Vec::as_slice) else {
                return Err(last);
            };
            if after == start {
                break;
            }
            if !seen.insert(after) {
                return Err(last);
            }
            corners.push(after);
        }
        loops.push(corners);
    }
    Ok(loops)
}

/// Largest dihedral angle, then area: less is better.
#[derive(Clone, Copy, PartialEq, PartialOrd)]
struct Weight {
    angle: f64,
    area: f64,
}

/// The best triangulation of a chain: its weight, and the third corner of the triangle at its chord.
#[derive(Clone, Copy)]
struct Best {
    weight: Weight,
    middle: usize,
    /// Unit normal of that triangle.
    normal: Vec3,
}

/// A loop with its surroundings.
struct Patch<'a> {
    corners: &'a [u32],
    /// Positions of the corners, in a unit in which nothing overflows.
    points: Vec<Vec3>,
    /// Unit normal of the surface next to the edge from each corner to the next.
    rim_normals: Vec<Vec3>,
    edges: &'a HashSet<[u32; 2]>,
    /// `W(i, k)` at `i n + k`; `None` where there is no triangulation.
    best: Vec<Option<Best>>,
}

impl<'a> Patch<'a> {
    fn new(
        vertices: &[Vec3],
        faces: &[[u32; 3]],
        face_at: &HashMap<[u32; 2], u32>,
        corners: &'a [u32],
        edges: &'a HashSet<[u32; 2]>,
    ) -> Self {
        let n = corners.len();
        let origin = vertices[corners[0] as usize];
        // The weight compares areas, which would overflow in large units and vanish in small ones.
        let reach = corners.iter().map(|&v| (vertices[v as usize] - origin).abs().max_element());
        let reach = reach.fold(0.0, f64::max);
        let scaled = |v: u32| (vertices[v as usize] - origin) / reach;
        let points = corners.iter().map(|&v| scaled(v)).collect();
        let faces_at = (0..n).map(|i| face_at[&[corners[i], corners[(i + 1) % n]]]);
        let rim_normals = faces_at.map(|face| normal(faces[face as usize].map(scaled))).collect();
        Self { corners, points, rim_normals, edges, best: vec![None; n * n] }
    }

    /// Steps 2 and 3.
    fn triangles(mut self) -> Option<Vec<[u32; 3]>> {
        let n = self.corners.len();
        for length in 2..n {
            for i in 0..n - length {
                self.best[i * n + i + length] = self.best_of(i, i + length);
            }
        }
        let mut triangles = Vec::with_capacity(n.saturating_sub(2));
        let mut open = vec![(0, n - 1)];
        while let Some((i, k)) = open.pop() {
            if k - i < 2 {
                continue;
            }
            let middle = self.best[i * n + k]?.middle;
            triangles.push([i, middle, k].map(|corner| self.corners[corner]));
            open.extend([(i, middle), (middle, k)]);
        }
        Some(triangles)
    }

    /// Step 2 for one chain.
    fn best_of(&self, i: usize, k: usize) -> Option<Best> {
        let n = self.corners.len();
        let whole = i == 0 && k == n - 1;
        if !whole && self.edges.contains(&ascending([self.corners[i], self.corners[k]])) {
            return None;
        }
        let mut best: Option<Best> = None;
        for middle in i + 1..k {
            let (Some(low), Some(high)) = (self.chain(i, middle), self.chain(middle, k)) else {
                continue;
            };
            let angle = low.0.angle.max(high.0.angle);
            // Angles come first: most triangles need not be looked at.
            if best.is_some_and(|best| angle > best.weight.angle) {
                continue;
            }
            let triangle = [i, middle, k].map(|corner| self.points[corner]);
            let own = normal(triangle);
            let mut angle = angle.max(between(own, low.1)).max(between(own, high.1));
            if whole {
                angle = angle.max(between(own, self.rim_normals[n - 1]));
            }
            let [a, b, c] = triangle;
            let area = low.0.area + high.0.area + (b - a).cross(c - a).length() * 0.5;
            let weight = Weight { angle, area };
            if best.is_none_or(|best| weight < best.weight) {
                best = Some(Best { weight, middle, normal: own });
            }
        }
        best
    }

    /// The weight of a chain and the normal next to its chord: of the surface, or of the triangle.
    fn chain(&self, i: usize, k: usize) -> Option<(Weight, Vec3)> {
        if k == i + 1 {
            return Some((Weight { angle: 0.0, area: 0.0 }, self.rim_normals[i]));
        }
        self.best[i * self.corners.len() + k].map(|best| (best.weight, best.normal))
    }
}

fn normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    (b - a).cross(c - a).normalize_or_zero()
}

/// The angle between two faces, 0 where they are one plane; a face without area fits nowhere.
fn between(a: Vec3, b: Vec3) -> f64 {
    if a == Vec3::ZERO || b == Vec3::ZERO { PI } else { a.dot(b).clamp(-1.0, 1.0).acos() }
}

// Parts that touch in a vertex or along an edge, taken apart; the only repair that moves a vertex.
//
// At such a vertex the faces form several fans. The flattest fan keeps the vertex. Each other one
// gets a separate vertex, at [`STEP`] of the way to the mean of its rim: towards its own part, so
// that two tips no longer touch. The flattest fan stays because it cannot move like this: the mean of
// a flat fan's rim may be the vertex itself.
//
// # Cost
// `O(F log F)` for `F` faces.

/// Share of the way to the mean of its rim by which a tip is drawn back.
const STEP: f64 = 1e-3;

/// Corners (`3 face + k`) of the faces that hang together around one vertex.
type Fan = Vec<usize>;

/// Which fan keeps its vertex.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Stays {
    Flattest,
    /// Of a cavity that touches the surface around it.
    Sharpest,
}

/// Gives each fan of faces a separate vertex.
pub(super) fn separate(
    vertices: &mut Vec<Vec3>,
    faces: &mut [[u32; 3]],
    stays: Stays,
) -> Option<Repair> {
    let (mut touching, mut largest_move) = (0, 0.0_f64);
    for (vertex, mut fans) in fans(vertices, faces).into_iter().enumerate() {
        if fans.len() < 2 {
            continue;
        }
        touching += 1;
        let tip = vertices[vertex];
        let rims = fans.values().map(|fan| rim_mean(vertices, faces, fan));
        let targets: Vec<Vec3> = rims.map(|rim| tip * (1.0 - STEP) + rim * STEP).collect();
        let heights: Vec<f64> = targets.iter().map(|&at| tip.distance_squared(at)).collect();
        let compare = |&a: &usize, &b: &usize| heights[a].total_cmp(&heights[b]);
        let kept = match stays {
            Stays::Flattest => (0..fans.len()).min_by(compare),
            Stays::Sharpest => (0..fans.len()).max_by(compare),
        };
        for (k, fan) in fans.values_mut().enumerate().filter(|&(k, _)| Some(k) != kept) {
            let own = vertices.len() as u32;
            largest_move = largest_move.max(tip.distance(targets[k]));
            vertices.push(targets[k]);
            fan.iter().for_each(|&corner| faces.as_flattened_mut()[corner] = own);
        }
    }
    (touching > 0).then_some(Repair::SeparatedVertices { vertices: touching, largest_move })
}

/// Halves the edges of more than two faces. The new vertices can be separated also where the faces hang together around both
/// ends.
pub(super) fn halve_shared_edges(vertices: &mut Vec<Vec3>, faces: &mut Vec<[u32; 3]>) {
    let mut count: BTreeMap<[u32; 2], usize> = BTreeMap::new();
    for &[a, b, c] in &*faces {
        for [a, b] in [[a, b], [b, c], [c, a]] {
            *count.entry([a.min(b), a.max(b)]).or_default() += 1;
        }
    }
    count.retain(|_, faces| *faces > 2);
    for ([a, b], middle) in &mut count {
        *middle = vertices.len();
        vertices.push(vertices[*a as usize].midpoint(vertices[*b as usize]));
    }
    let mut waiting = std::mem::take(faces);
    waiting.reverse();
    while let Some(face) = waiting.pop() {
        let [a, b, c] = face;
        let halved = [[a, b], [b, c], [c, a]].into_iter().find_map(|[a, b]| {
            let middle = *count.get(&[a.min(b), a.max(b)])? as u32;
            Some([a, b].map(|end| face.map(|v| if v == end { middle } else { v })))
        });
        match halved {
            Some(halves) => waiting.extend(halves),
            None => faces.push(face),
        }
    }
}

/// For each vertex its fans. Those of parts that touch along an edge count as one where the surface is open there.
fn fans(vertices: &[Vec3], faces: &[[u32; 3]]) -> Vec<BTreeMap<u32, Fan>> {
    let points = Unit::of(vertices).forward_all(vertices);
    let fan_of = match parted(&points, faces) {
        Some(parted) => parted.faces.as_flattened().to_vec(),
        None => Topology::new(vertices.len(), faces).fan,
    };
    let mut fans = vec![BTreeMap::<u32, Fan>::new(); vertices.len()];
    for ((corner, &vertex), fan) in faces.as_flattened().iter().enumerate().zip(fan_of) {
        fans[vertex as usize].entry(fan).or_default().push(corner);
    }
    fans
}

/// Mean of the vertices across from the fan's own.
fn rim_mean(vertices: &[Vec3], faces: &[[u32; 3]], fan: &Fan) -> Vec3 {
    // Each is divided first: the sum of coordinates near the end of the range would overflow.
    let share = 0.5 / fan.len() as f64;
    let others = fan.iter().map(|&corner| {
        let face = faces[corner / 3];
        let [after, before] = [corner + 1, corner + 2].map(|k| vertices[face[k % 3] as usize]);
        after * share + before * share
    });
    others.sum()
}
