//! The sheet graph of a medial mesh: sheets, curves, the seams where sheets meet, and junctions.
//!
//! Y. Zhou, A. Kaufman, A. W. Toga 1998, *Three-dimensional skeleton and centerline generation based on an approximate
//! minimum distance field*, and F. Leymarie, B. Kimia 2007, *The medial scaffold of 3D unorganized point clouds*,
//! <https://doi.org/10.1109/TPAMI.2007.44>, name the parts.
//!
//! 1. Edges shorter than [`SHORT`] are contracted: degenerate samples have many spheres at one place.
//! 2. A *piece* is a set of faces that are connected across edges of two faces that do not fold. A sheet is smooth, so a fold
//!    is a seam that lost a face. The piece's *width* is twice its area over the
//!    length of its rim: that of a long strip, the radius of a disc.
//! 3. Pieces narrower than the least width are removed, the smallest first. Where this leaves two faces at an edge, their
//!    pieces become one. So the walls of small pockets, spikes and slivers are no sheets and end none.
//!    The pieces that are left are the *sheets*.
//! 4. Edges without a face are connected over spheres with two such edges and no face: the *curves*.
//! 5. Edges with three faces or more that are left, of the same sheets and connected, are a *seam*. Two of the same sheets
//!    whose ends are closer than the least length are one.
//! 6. Ends of seams and curves that are closer than the least length are one node. It is a *junction* if three of them meet
//!    there, or if a curve meets a sheet.
//! 7. Curves and seams shorter than the least length are left out.

use std::collections::BTreeMap;

use super::mesh::closure;
use super::{Incidence, MedialMesh};
use crate::Vec3;
use crate::geometry::DisjointSets;

/// Sizes below which a part is noise, as lengths in the unit of the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SheetOptions {
    /// Least width of a sheet: twice its area over the length of its rim.
    pub width: f64,
    /// Least length of a curve and of a seam, and the size of a junction.
    pub length: f64,
}

impl SheetOptions {
    /// The default for a mesh whose surface has this bounding-box diagonal.
    pub fn of_diagonal(diagonal: f64) -> Self {
        let Self { width, length } = Self::default();
        Self { width: width * diagonal, length: length * diagonal }
    }
}

impl Default for SheetOptions {
    /// For a mesh whose surface has a bounding-box diagonal of 1.
    fn default() -> Self {
        Self { width: 0.005, length: 0.01 }
    }
}

/// Cosine of the angle by which two faces of a sheet turn at most at their edge: 45 degrees. Where three sheets meet at
/// equal angles, two of them turn by 60 degrees.
const FOLD: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Length below which an edge is a point, as a share of the least width.
const SHORT: f64 = 0.02;

/// A chain of edges.
#[derive(Clone, Debug, PartialEq)]
pub struct Seam {
    /// Pairs of spheres, ascending.
    pub edges: Vec<[u32; 2]>,
    /// Their total length.
    pub length: f64,
    /// Indices of the sheets that meet, ascending, each as often as its faces do. None of a curve.
    pub sheets: Vec<u32>,
}

/// Sheets, curves, seams and junctions of a medial mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SheetGraph {
    /// For each face its sheet, as an index into `areas`; `None` in a piece that was removed.
    pub sheet_of_face: Vec<Option<u32>>,
    /// Areas of the sheets, descending.
    pub areas: Vec<f64>,
    /// Number of pieces that were removed.
    pub small_pieces: u64,
    /// Their area.
    pub small_area: f64,
    /// Seams, the longest first.
    pub seams: Vec<Seam>,
    /// Chains of edges without a face, the longest first.
    pub curves: Vec<Seam>,
    /// For each junction a sphere at it, ascending.
    pub junctions: Vec<u32>,
    /// Pairs of spheres at which a sheet ends.
    pub boundary: Vec<[u32; 2]>,
}

/// Pieces, while they are removed and joined.
struct Pieces<'a> {
    mesh: &'a MedialMesh,
    incidence: &'a Incidence,
    sets: DisjointSets,
    /// Of the representative of each piece.
    faces: Vec<Vec<u32>>,
    area: Vec<f64>,
    rim: Vec<f64>,
    removed: Vec<bool>,
    /// The faces that are left at each edge.
    at: Vec<Vec<u32>>,
}

impl SheetGraph {
    /// The sheet graph of a mesh in canonical form. Cost `O(n log n)`, and the pairs of seam ends of nearly equal x.
    ///
    /// # Panics
    /// If the mesh is not in canonical form; see [`MedialMesh::check`].
    pub fn new(mesh: &MedialMesh, options: SheetOptions) -> Self {
        let (welded, place) = weld(mesh, SHORT * options.width);
        let mut graph = Self::of_welded(&welded, options);
        let sheet_of_face = |place: Option<u32>| graph.sheet_of_face[place? as usize];
        graph.sheet_of_face = place.into_iter().map(sheet_of_face).collect();
        graph
    }

    fn of_welded(mesh: &MedialMesh, options: SheetOptions) -> Self {
        let incidence = Incidence::of(mesh);
        let mut pieces = Pieces::new(mesh, &incidence);
        let (small_pieces, small_area) = pieces.remove_below(options.width);
        let mut graph = Self { small_pieces, small_area, ..Self::default() };
        graph.number_sheets(&mut pieces);
        let ends = mesh.edges.iter().zip(&pieces.at).filter(|(_, at)| at.len() == 1);
        graph.boundary = ends.map(|(&edge, _)| edge).collect();
        // Seams: edges by the sheets that meet there.
        let mut by_sheets: BTreeMap<Vec<u32>, Vec<[u32; 2]>> = BTreeMap::new();
        for (&edge, at) in mesh.edges.iter().zip(&pieces.at).filter(|(_, at)| at.len() >= 3) {
            let mut key: Vec<u32> =
                at.iter().filter_map(|&face| graph.sheet_of_face[face as usize]).collect();
            key.sort_unstable();
            by_sheets.entry(key).or_default().push(edge);
        }
        for (sheets, edges) in by_sheets {
            let chains = chains(mesh, &edges, options.length, |_| true);
            let chains = chains.into_iter().filter(|chain| chain.length >= options.length);
            graph.seams.extend(chains.map(|seam| Seam { sheets: sheets.clone(), ..seam }));
        }
        let lone = mesh.lone_edges();
        let (mut degree, mut on_face) =
            (vec![0; mesh.spheres.len()], vec![false; mesh.spheres.len()]);
        lone.as_flattened().iter().for_each(|&v| degree[v as usize] += 1);
        mesh.faces.iter().flatten().for_each(|&v| on_face[v as usize] = true);
        let passes = |v: u32| degree[v as usize] == 2 && !on_face[v as usize];
        graph.curves = chains(mesh, &lone, 0.0, passes);
        graph.curves.retain(|curve| curve.length >= options.length);
        for list in [&mut graph.seams, &mut graph.curves] {
            list.sort_by(|a, b| b.length.total_cmp(&a.length).then_with(|| a.edges.cmp(&b.edges)));
        }
        graph.find_junctions(mesh, options.length);
        graph
    }

    /// The place of a sheet, or of a removed piece, in [`ColourMap::Parts`](crate::ColourMap): neighbours in the list of
    /// sheets are far apart. Lines are at 1.
    pub fn colour(sheet: Option<u32>) -> f64 {
        // Multiples of the golden ratio spread evenly, however many there are.
        let spread = |sheet: u32| (f64::from(sheet) * 0.618_033_988_749_894_9).fract();
        7.0 / 8.0 * sheet.map_or(0.5, spread)
    }

    /// The mesh for a picture, and for each of its spheres a place in [`ColourMap::Parts`](crate::ColourMap). Sheets get
    /// separate spheres, so that no colour runs into the next. Seams and curves are edges without a face, junctions
    /// isolated spheres. Isolated spheres of the mesh have the colours of further sheets.
    ///
    /// # Panics
    /// If the mesh is another one than that of the graph.
    pub fn painted(&self, mesh: &MedialMesh) -> (MedialMesh, Vec<f64>) {
        // Removed pieces, lines and junctions have copies of their own, too.
        const PIECES: u32 = u32::MAX - 2;
        const LINES: u32 = u32::MAX - 1;
        const JUNCTIONS: u32 = u32::MAX;
        let part = |sheet: Option<u32>| sheet.unwrap_or(PIECES);
        let faces = mesh.faces.iter().zip(&self.sheet_of_face);
        let lines = || self.seams.iter().chain(&self.curves).flat_map(|chain| &chain.edges);
        let mut copies: Vec<(u32, u32)> = Vec::new();
        for (face, &sheet) in faces.clone() {
            copies.extend(face.map(|v| (part(sheet), v)));
        }
        copies.extend(lines().flatten().map(|&v| (LINES, v)));
        copies.extend(self.junctions.iter().map(|&v| (JUNCTIONS, v)));
        copies.extend((self.areas.len() as u32..).zip(mesh.isolated()));
        copies.sort_unstable();
        copies.dedup();
        let copy = |part: u32, v: u32| copies.partition_point(|&other| other < (part, v)) as u32;
        let edges = lines().map(|edge| edge.map(|v| copy(LINES, v))).collect();
        let faces = faces.map(|(face, &sheet)| face.map(|v| copy(part(sheet), v))).collect();
        let spheres = copies.iter().map(|&(_, v)| mesh.spheres[v as usize]).collect();
        let colours = copies.iter().map(|&(part, _)| match part {
            LINES | JUNCTIONS => 1.0,
            PIECES => Self::colour(None),
            sheet => Self::colour(Some(sheet)),
        });
        let colours = colours.collect();
        let painted = MedialMesh::from_simplices(spheres, edges, faces);
        (painted.expect("copies of valid simplices"), colours)
    }

    fn number_sheets(&mut self, pieces: &mut Pieces<'_>) {
        let faces = pieces.mesh.faces.len() as u32;
        let mut roots: Vec<u32> = (0..faces)
            .filter(|&face| pieces.sets.find(face) == face && !pieces.removed[face as usize])
            .collect();
        let area = &pieces.area;
        roots.sort_by(|&a, &b| area[b as usize].total_cmp(&area[a as usize]).then(a.cmp(&b)));
        self.areas = roots.iter().map(|&root| area[root as usize]).collect();
        self.sheet_of_face = vec![None; faces as usize];
        for (sheet, &root) in (0..).zip(&roots) {
            for &face in &pieces.faces[root as usize] {
                self.sheet_of_face[face as usize] = Some(sheet);
            }
        }
    }

    /// Step 6.
    fn find_junctions(&mut self, mesh: &MedialMesh, size: f64) {
        let mut on_sheet = vec![false; mesh.spheres.len()];
        for (face, _) in mesh.faces.iter().zip(&self.sheet_of_face).filter(|(_, s)| s.is_some()) {
            face.iter().for_each(|&v| on_sheet[v as usize] = true);
        }
        let mut ends: Vec<(u32, bool)> = Vec::new();
        for seam in &self.seams {
            ends.extend(open_ends(&seam.edges).into_iter().map(|v| (v, false)));
        }
        for curve in &self.curves {
            let open = open_ends(&curve.edges).into_iter();
            ends.extend(open.map(|v| (v, on_sheet[v as usize])));
        }
        let places: Vec<Vec3> =
            ends.iter().map(|&(v, _)| mesh.spheres[v as usize].centre).collect();
        let mut nodes = DisjointSets::singletons(ends.len());
        each_close_pair(&places, size, |a, b| {
            nodes.join(a, b);
        });
        let mut found: BTreeMap<u32, (u32, usize, bool)> = BTreeMap::new();
        for (end, &(v, on_sheet)) in (0..).zip(&ends) {
            let (first, count, touches) = found.entry(nodes.find(end)).or_insert((v, 0, false));
            *first = v.min(*first);
            *count += 1;
            *touches |= on_sheet;
        }
        let junctions = found.into_values().filter(|&(_, count, touches)| count >= 3 || touches);
        self.junctions = junctions.map(|(v, _, _)| v).collect();
        self.junctions.sort_unstable();
    }
}

impl<'a> Pieces<'a> {
    fn new(mesh: &'a MedialMesh, incidence: &'a Incidence) -> Self {
        let count = mesh.faces.len();
        let mut at = vec![Vec::new(); mesh.edges.len()];
        let mut area = Vec::with_capacity(count);
        for (face, edges) in (0..).zip(incidence.face_edges()) {
            edges.iter().for_each(|&edge| at[edge as usize].push(face));
            let [a, b, c] = mesh.spheres_of(mesh.faces[face as usize]).map(|s| s.centre);
            area.push((b - a).cross(c - a).length() / 2.0);
        }
        let rim = incidence.face_edges().iter();
        let rim = rim
            .map(|edges| {
                edges.iter().map(|&edge| edge_length(mesh, mesh.edges[edge as usize])).sum()
            })
            .collect();
        let mut pieces = Self {
            mesh,
            incidence,
            sets: DisjointSets::singletons(count),
            faces: (0..count as u32).map(|face| vec![face]).collect(),
            area,
            rim,
            removed: vec![false; count],
            at,
        };
        for edge in 0..mesh.edges.len() {
            pieces.join_across(edge);
        }
        pieces
    }

    /// Whether two faces with a common edge are closer to folded back than to flat by [`FOLD`].
    fn folds(&self, edge: usize, a: u32, b: u32) -> bool {
        let [from, to] = self.mesh.spheres_of(self.mesh.edges[edge]).map(|s| s.centre);
        let along = (to - from).normalize_or_zero();
        let [u, v] = [a, b].map(|face| {
            let apex = self.mesh.spheres_of(self.mesh.faces[face as usize]).map(|s| s.centre);
            let across =
                apex.iter().map(|&p| (p - from).reject_from_normalized(along)).sum::<Vec3>();
            across.normalize_or_zero()
        });
        // A face without area has no side to fold to.
        u != Vec3::ZERO && v != Vec3::ZERO && u.dot(v) > -FOLD
    }

    /// Joins the two faces of an edge, if it has two; returns the piece if it has grown.
    fn join_across(&mut self, edge: usize) -> Option<u32> {
        let &[a, b] = &self.at[edge][..] else { return None };
        if self.folds(edge, a, b) {
            return None;
        }
        let (a, b) = (self.sets.find(a), self.sets.find(b));
        let inside = 2.0 * edge_length(self.mesh, self.mesh.edges[edge]);
        let (root, other) = (a.min(b), a.max(b));
        self.rim[root as usize] -= inside;
        if a != b {
            self.sets.join(a, b);
            let [mut more, mut less] =
                [root, other].map(|r| std::mem::take(&mut self.faces[r as usize]));
            if more.len() < less.len() {
                std::mem::swap(&mut more, &mut less);
            }
            more.append(&mut less);
            self.faces[root as usize] = more;
            self.area[root as usize] += self.area[other as usize];
            self.rim[root as usize] += self.rim[other as usize];
        }
        Some(root)
    }

    /// Step 3; the number of pieces and their area.
    fn remove_below(&mut self, width: f64) -> (u64, f64) {
        let is_narrow = |area: f64, rim: f64| 2.0 * area < width * rim || area <= 0.0;
        let mut queue = std::collections::BTreeSet::new();
        let key = |area: f64, root: u32| (area.to_bits(), root);
        for root in 0..self.mesh.faces.len() as u32 {
            if self.sets.find(root) == root {
                queue.insert(key(self.area[root as usize], root));
            }
        }
        let (mut pieces, mut area) = (0, 0.0);
        while let Some((bits, root)) = queue.pop_first() {
            let r = root as usize;
            let is_current = self.sets.find(root) == root && self.area[r].to_bits() == bits;
            if self.removed[r] || !is_current || !is_narrow(self.area[r], self.rim[r]) {
                continue;
            }
            self.removed[r] = true;
            (pieces, area) = (pieces + 1, area + self.area[r]);
            let mut edges = Vec::new();
            for face in std::mem::take(&mut self.faces[r]) {
                for edge in self.incidence.face_edges()[face as usize] {
                    self.at[edge as usize].retain(|&other| other != face);
                    edges.push(edge as usize);
                }
            }
            edges.sort_unstable();
            edges.dedup();
            for edge in edges {
                if let Some(grown) = self.join_across(edge) {
                    queue.insert(key(self.area[grown as usize], grown));
                }
            }
        }
        (pieces, area)
    }
}

fn edge_length(mesh: &MedialMesh, edge: [u32; 2]) -> f64 {
    let [a, b] = mesh.spheres_of(edge);
    a.centre.distance(b.centre)
}

/// The mesh with short edges contracted into their smallest sphere, and for each face its place in it.
fn weld(mesh: &MedialMesh, short: f64) -> (MedialMesh, Vec<Option<u32>>) {
    let mut sets = DisjointSets::singletons(mesh.spheres.len());
    for &edge in mesh.edges.iter().filter(|&&edge| edge_length(mesh, edge) < short) {
        sets.join(edge[0], edge[1]);
    }
    let mut carried = |v: u32| sets.find(v);
    let edges = mesh.edges.iter().map(|edge| edge.map(&mut carried));
    let edges: Vec<_> = edges.filter(|[a, b]| a != b).map(|[a, b]| [a.min(b), a.max(b)]).collect();
    let faces = mesh.faces.iter().map(|face| {
        let mut face = face.map(&mut carried);
        face.sort_unstable();
        (face[0] != face[1] && face[1] != face[2]).then_some(face)
    });
    let faces: Vec<_> = faces.collect();
    let (edges, kept) =
        closure(&edges, &faces.iter().copied().flatten().collect::<Vec<_>>(), mesh.spheres.len());
    let place = |face: &Option<[u32; 3]>| Some(kept.binary_search(&(*face)?).ok()? as u32);
    let places = faces.iter().map(place).collect();
    (MedialMesh { spheres: mesh.spheres.clone(), edges, faces: kept, contacts: None }, places)
}

/// The spheres at which a chain of edges ends or branches.
fn open_ends(edges: &[[u32; 2]]) -> Vec<u32> {
    let mut spheres = edges.as_flattened().to_vec();
    spheres.sort_unstable();
    spheres.chunk_by(|a, b| a == b).filter(|run| run.len() != 2).map(|run| run[0]).collect()
}

/// The components of some edges that are connected over spheres that `passes`, or have ends closer than `gap`.
fn chains(
    mesh: &MedialMesh,
    edges: &[[u32; 2]],
    gap: f64,
    passes: impl Fn(u32) -> bool,
) -> Vec<Seam> {
    let mut sets = DisjointSets::singletons(edges.len());
    let mut at: Vec<(u32, u32)> =
        (0..).zip(edges).flat_map(|(k, edge)| edge.map(|v| (v, k))).collect();
    at.sort_unstable();
    for pair in at.windows(2).filter(|pair| pair[0].0 == pair[1].0 && passes(pair[0].0)) {
        sets.join(pair[0].1, pair[1].1);
    }
    if gap > 0.0 {
        let ends: Vec<(u32, u32)> =
            at.chunk_by(|a, b| a.0 == b.0).filter(|run| run.len() == 1).map(|run| run[0]).collect();
        let places: Vec<Vec3> =
            ends.iter().map(|&(v, _)| mesh.spheres[v as usize].centre).collect();
        each_close_pair(&places, gap, |a, b| {
            sets.join(ends[a as usize].1, ends[b as usize].1);
        });
    }
    let mut chains: BTreeMap<u32, Seam> = BTreeMap::new();
    for (k, &edge) in (0..).zip(edges) {
        let empty = || Seam { edges: vec![], length: 0.0, sheets: vec![] };
        let chain = chains.entry(sets.find(k)).or_insert_with(empty);
        chain.edges.push(edge);
        chain.length += edge_length(mesh, edge);
    }
    chains.into_values().collect()
}

/// Reports all pairs of points closer than a distance, by a sweep along x.
fn each_close_pair(points: &[Vec3], distance: f64, mut each: impl FnMut(u32, u32)) {
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    order.sort_by(|&a, &b| points[a as usize].x.total_cmp(&points[b as usize].x));
    for (k, &a) in order.iter().enumerate() {
        for &b in &order[k + 1..] {
            let to = points[b as usize] - points[a as usize];
            if to.x >= distance {
                break;
            }
            if to.length() < distance {
                each(a, b);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::complex::Sphere;

    fn mesh(points: &[[f64; 3]], edges: &[[u32; 2]], faces: &[[u32; 3]]) -> MedialMesh {
        let spheres = points.iter().map(|&p| Sphere::new(p.into(), 0.1)).collect();
        MedialMesh::from_simplices(spheres, edges.to_vec(), faces.to_vec()).unwrap()
    }

    fn sizes(graph: &SheetGraph) -> [usize; 4] {
        [graph.areas.len(), graph.seams.len(), graph.junctions.len(), graph.curves.len()]
    }

    fn graph(mesh: &MedialMesh) -> SheetGraph {
        SheetGraph::new(mesh, SheetOptions::default())
    }

    /// A square of the plane y = 0 in two triangles, and one upright on its diagonal.
    const THREE: [[f64; 3]; 5] =
        [[0.0; 3], [0.3, 0.0, 0.0], [0.3, 0.0, 0.3], [0.0, 0.0, 0.3], [0.15, 0.2, 0.15]];

    #[test]
    fn three_faces_at_an_edge_are_three_sheets_with_a_seam() {
        let mesh = mesh(&THREE, &[], &[[0, 1, 2], [0, 2, 3], [0, 2, 4]]);
        let graph = graph(&mesh);
        assert_eq!(sizes(&graph), [3, 1, 0, 0]);
        assert_eq!(graph.seams[0].sheets, [0, 1, 2]);
        assert!((graph.seams[0].length - 0.3 * 2f64.sqrt()).abs() < 1e-12);
        assert!((graph.areas.iter().sum::<f64>() - 0.09 - 0.03 * 2f64.sqrt()).abs() < 1e-12);
        assert_eq!((graph.boundary.len(), graph.small_pieces), (6, 0));
    }

    #[test]
    fn a_sheet_ends_at_a_fold_and_goes_on_across_a_bend() {
        let folded = |degrees: f64| {
            let (sin, cos) = f64::to_radians(degrees).sin_cos();
            let points = [[0.0; 3], [0.3, 0.0, 0.0], [0.1, 0.3, 0.0], [0.1, -0.3 * cos, 0.3 * sin]];
            graph(&mesh(&points, &[], &[[0, 1, 2], [0, 1, 3]])).areas.len()
        };
        assert_eq!([folded(0.0), folded(40.0), folded(60.0), folded(150.0)], [1, 1, 2, 2]);
    }

    #[test]
    fn a_small_pocket_neither_is_a_sheet_nor_ends_one() {
        let mut points = THREE[..4].to_vec();
        // A triangle inside of the lower one, and an apex above: a tetrahedron's four walls.
        points.extend([
            [0.2, 0.0, 0.1],
            [0.203, 0.0, 0.1],
            [0.2, 0.0, 0.103],
            [0.201, 0.002, 0.101],
        ]);
        let ring = [[0, 1, 4], [1, 4, 5], [1, 2, 5], [2, 5, 6], [0, 2, 6], [0, 4, 6]];
        let walls = [[4, 5, 6], [4, 5, 7], [5, 6, 7], [4, 6, 7]];
        let graph = graph(&mesh(&points, &[], &[&ring[..], &walls, &[[0, 2, 3]]].concat()));
        assert_eq!(sizes(&graph), [1, 0, 0, 0]);
        assert!(graph.small_pieces >= 1 && graph.small_area < 1e-4, "{graph:?}");
    }

    #[test]
    fn a_curve_that_meets_a_sheet_and_three_curves_make_junctions() {
        let mut points = THREE.to_vec();
        points.extend([[0.6, 0.0, 0.3], [0.8, 0.2, 0.3], [0.8, -0.2, 0.3]]);
        let edges = [[2, 5], [5, 6], [5, 7]];
        let graph = graph(&mesh(&points, &edges, &[[0, 1, 2], [0, 2, 3]]));
        assert_eq!(sizes(&graph), [1, 0, 2, 3]);
        assert_eq!(graph.junctions, [2, 5]);
    }

    #[test]
    fn a_painted_mesh_has_the_faces_and_the_seams_as_lines() {
        let mesh = mesh(&THREE, &[], &[[0, 1, 2], [0, 2, 3], [0, 2, 4]]);
        let (painted, colours) = graph(&mesh).painted(&mesh);
        assert_eq!((painted.faces.len(), painted.lone_edges().len()), (3, 1));
        assert_eq!((painted.spheres.len(), colours.len()), (11, 11));
        assert_eq!(colours.iter().filter(|&&colour| colour == 1.0).count(), 2);
    }

    #[test]
    fn isolated_spheres_are_painted_as_parts_of_their_own() {
        let mut points = THREE[..4].to_vec();
        points.extend([[0.6, 0.0, 0.3], [0.8, 0.2, 0.3]]);
        for (faces, spheres) in [(&[[0, 1, 2], [0, 2, 3]][..], 6), (&[], 6)] {
            let mesh = mesh(&points, &[], faces);
            let (painted, mut colours) = graph(&mesh).painted(&mesh);
            assert_eq!((painted.spheres.len(), painted.faces.len()), (spheres, faces.len()));
            assert_eq!(painted.isolated().len(), mesh.isolated().len());
            colours.sort_unstable_by(f64::total_cmp);
            colours.dedup();
            assert_eq!(colours.len(), mesh.isolated().len() + faces.len().min(1));
        }
    }

    #[test]
    fn hostile_meshes_have_a_graph() {
        assert_eq!(sizes(&graph(&MedialMesh::default())), [0; 4]);
        assert_eq!(sizes(&graph(&mesh(&[[0.0; 3]], &[], &[]))), [0; 4]);
        // All spheres at one place, and on one line.
        let faces = [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]];
        assert_eq!(sizes(&graph(&mesh(&[[0.5; 3]; 4], &[], &faces))), [0; 4]);
        let line = [0.0, 0.1, 0.2, 0.3].map(|x| [x, 0.0, 0.0]);
        assert_eq!(graph(&mesh(&line, &[], &faces)).areas.len(), 0);
    }

    proptest! {
        #[test]
        fn the_order_of_the_spheres_does_not_matter(
            points in prop::collection::vec(prop::array::uniform3(0.0..1.0f64), 12),
            faces in prop::collection::vec(prop::array::uniform3(0..12u32), 1..30),
            order in Just((0..12u32).collect::<Vec<_>>()).prop_shuffle(),
        ) {
            let faces: Vec<_> = faces
                .into_iter()
                .filter(|[a, b, c]| a != b && b != c && a != c)
                .collect();
            let mesh = mesh(&points, &[[0, 1], [1, 2]], &faces);
            let [found, other] = [graph(&mesh), graph(&mesh.renumbered(&order))];
            prop_assert_eq!(sizes(&found), sizes(&other));
            for (a, b) in found.areas.iter().zip(&other.areas) {
                prop_assert!((a - b).abs() < 1e-12);
            }
            let lengths = |graph: &SheetGraph| graph.seams.iter().map(|s| s.length).sum::<f64>();
            prop_assert!((lengths(&found) - lengths(&other)).abs() < 1e-9);
        }
    }
}
