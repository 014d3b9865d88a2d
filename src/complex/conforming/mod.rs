//! A Delaunay triangulation that contains the surface of a solid, and so separates inside from outside exactly.
//!
//! If every triangle of the surface is a facet of the Delaunay triangulation of its vertices, the cells
//! inside are a triangulation of the solid with all vertices on its boundary. Their dual complex is a
//! spine: the solid collapses to it, so it has the solid's homotopy type, whatever the geometry (Siersma
//! 1999, *Voronoi diagrams and Morse theory of the distance function*; Edelsbrunner's dual complexes).
//! No centre of a ball decides anything.
//!
//! Where the vertices do not conform, edges between neighbours nearly in one plane are flipped to those of the
//! triangulation, as any mesher of smooth surfaces does, and points are added on the surface:
//!
//! * J. Ruppert 1995, *A Delaunay refinement algorithm for quality 2-dimensional mesh generation*, Journal
//!   of Algorithms 18(3), <https://doi.org/10.1006/jagm.1995.1021>: circumcentres of triangles.
//! * H. Si, K. Gaertner 2005, *Meshing piecewise linear complexes by constrained Delaunay tetrahedralizations*,
//!   14th International Meshing Roundtable, <https://doi.org/10.1007/3-540-29090-7_9>: where an edge is split.
//! * D. Cohen-Steiner, E. Colin de Verdiere, M. Yvinec 2002, *Conforming Delaunay triangulations in 3D*,
//!   SoCG, <https://doi.org/10.1145/513400.513425>: the problem for surfaces in space.
//!
//! 1. Neighbours in one plane, to within a millionth of the diagonal, are merged into *patches*. Within a
//!    patch any diagonal will do, and edges are flipped to those of the triangulation.
//!    Between patches an edge is flipped if the triangulation has the other diagonal, no two normals of the four
//!    triangles differ by more than 30 degrees, and the surface moves by no more than 3e-3 of the diagonal.
//!    The vertices stay where they are, and the topology of the surface as well.
//! 2. A *segment*, an edge between two patches, that is no Delaunay edge is split. The vertex that sees it under
//!    the largest angle decides where: as far from the nearer end as that vertex is, so that it does not encroach upon
//!    the piece, or in the middle. In a round shorter segments come first, and longer ones near their points wait.
//! 3. A triangle that is no Delaunay facet, although its segments are edges, gets its circumcentre. If the
//!    way there leaves the patch, the segment in the way is split instead.
//! 4. The points are inserted into the triangulation, and 1 to 3 are repeated until nothing is missing.
//! 5. The cells on both sides of the surface's triangles are known from its orientation, and all others by
//!    a flood through facets that are not on the surface. Flat cells with two facets in a patch are taken off.
//! 6. A ball of a cell inside that reaches far beyond the surface, between vertices far apart, loses its place to the
//!    surface point nearest to its centre. Then 1 to 5 follow again.
//!
//! # Deviations from the papers
//! The papers keep the surface and flip nothing between patches. On twelve real meshes flips leave a ninth of the
//! added points or fewer (casting: 29 instead of 2,504). There are no protecting balls around segments, so that
//! the refinement need not end where facets meet at small angles. It is given up beyond a budget. No piece of a segment is shorter than a fifth of it. A
//! circumcentre that encroaches upon a segment without being beyond it is inserted all the same: what that
//! breaks is repaired in the next round. Points are rounded, so that a split triangle is flat only up to
//! rounding; the triangulation is that of the rounded points, exactly.

mod flips;
mod protrusions;
mod refine;
mod skin;
mod stars;

use std::collections::HashSet;

use skin::Skin;
use stars::Stars;

use crate::Vec3;
use crate::geometry::triangulation::Facet;
use crate::geometry::{CellId, Delaunay, DisjointSets, TriangulationError};
use crate::surface::{InsideTest, Side, TriMesh, TriangleBvh};

/// Limit of rounds of refinement.
const ROUNDS: usize = 1_000;

/// Patches are given up after this many times the points with which the fewest triangles were missing.
const GROWTH: usize = 2;

/// Points in addition to these.
const SLACK: usize = 20_000;

/// Limit of rounds against balls that reach far beyond the surface. Few shapes need ten.
const APPROACHES: usize = 40;

/// Limit of times that patches are given up.
const GIVE_UPS: usize = 4;

/// Largest distance of neighbouring triangles from one plane in a patch, as a fraction of the surface's diagonal: first for
/// files of six digits, then for surfaces with details of that size.
const FLAT: [f64; 2] = [1e-6, 1e-10];

/// Length of an edge, as a fraction of the surface's diagonal, above which a surface is coarse.
const COARSE: f64 = 0.1;

/// Depth of a ball beyond the surface, as a fraction of the diagonal, above which points are added to dense surfaces as well.
const FAR: f64 = 0.02;

/// Depth that is reached then, and on coarse surfaces.
const CLOSE: f64 = 0.01;

/// Largest volume of a part or cavity that is none, as a share of the solid's volume.
const SPECK: f64 = 1e-6;

/// Largest volume of a flat cell, six times, as a share of the cube of its longest edge.
const FLAT_CELL: f64 = 1e-3;

/// A triangulation of the samples of a surface that contains the surface.
#[derive(Clone, Debug)]
pub struct Conforming {
    /// The Delaunay triangulation of the samples: the vertices of the surface, then the points that were added.
    pub delaunay: Delaunay,
    /// For each finite cell whether it is in the solid.
    pub is_inside: Vec<bool>,
    /// Number of points that were added.
    pub added: usize,
    /// Rounds in which points were added.
    pub rounds: usize,
    /// Number of faces that the triangulation does not contain: then the topology of its cells may differ from the solid's.
    pub missing: usize,
}

/// Why a surface has no such triangulation.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the messages name the fields")]
pub enum ConformingError {
    /// The vertices do not span space.
    #[error(transparent)]
    Triangulation(#[from] TriangulationError),
    /// Vertices at one place join parts of the surface into an edge of more than two faces.
    #[error("the surface touches itself along an edge")]
    Touching,
    /// More points than allowed would be needed.
    #[error("{missing} faces are still missing after {added} points were added, {most} at most")]
    Budget { missing: usize, added: usize, most: usize },
    /// The surface crosses itself.
    #[error("a cell is on both sides of the surface: it crosses itself")]
    Crossing,
}

impl Conforming {
    /// Halves the longest edges of a closed, oriented surface until it has `least` points. Then refines it until the
    /// Delaunay triangulation contains it, and until the balls of its cells end near the surface; no round of that
    /// begins after `most` points were added. The same result for any number of threads. Cost: `O(n log n)` expected,
    /// and `O(n)` for each round.
    ///
    /// # Errors
    /// When the vertices do not span space, the surface touches or crosses itself, or the points do not
    /// suffice for the topology.
    ///
    /// # Panics
    /// If a face names a vertex that does not exist.
    pub fn new(surface: &TriMesh, least: usize, most: usize) -> Result<Self, ConformingError> {
        let delaunay = Delaunay::new(&surface.vertices)?;
        for is_strict in [false, true] {
            let mut refinement =
                Refinement::new(surface, delaunay.clone(), [least, most], is_strict)?;
            let missing = refinement.skin.missing(&refinement.delaunay);
            match refinement.conform(missing) {
                // Flips can make close sheets cross.
                Err(ConformingError::Crossing) => continue,
                conforming => conforming?,
            }
            if (refinement.skin.is_coarse(COARSE) || refinement.has_protrusions(FAR))
                && let Ok(tree) = TriangleBvh::new(surface)
            {
                refinement.approach(&tree);
            }
            return Ok(refinement.finish());
        }
        Err(ConformingError::Crossing)
    }
}

/// A surface and the triangulation of its points.
#[derive(Clone)]
struct Refinement {
    /// Number of vertices of the surface.
    vertices: usize,
    skin: Skin,
    delaunay: Delaunay,
    /// For each finite cell whether it is in the solid, once the triangulation contains the surface.
    is_inside: Vec<bool>,
    /// Whether edges between patches stay.
    is_strict: bool,
    /// Patches whose missing triangles stay missing. Looked up, never iterated.
    given_up: HashSet<u32>,
    /// Number of times that patches were given up.
    give_ups: usize,
    /// Missing triangles of these patches.
    missing: Vec<u32>,
    /// Number of points before the first round.
    begin: usize,
    /// Limit of points that are added in rounds.
    most: usize,
    rounds: usize,
}

/// An earlier state of a refinement.
struct Snapshot {
    skin: Skin,
    delaunay: Delaunay,
    missing: Vec<u32>,
}

impl Refinement {
    fn new(
        surface: &TriMesh,
        mut delaunay: Delaunay,
        [least, most]: [usize; 2],
        is_strict: bool,
    ) -> Result<Self, ConformingError> {
        let mut skin = Skin::new(surface, &delaunay, FLAT[usize::from(is_strict)])?;
        skin.flip_by_angles(0..skin.triangles.len());
        skin.split_longest(least);
        let begin = skin.points.len();
        delaunay.insert(&skin.points[surface.vertices.len()..])?;
        Ok(Self {
            vertices: surface.vertices.len(),
            skin,
            delaunay,
            is_inside: Vec::new(),
            is_strict,
            given_up: HashSet::new(),
            give_ups: 0,
            missing: Vec::new(),
            begin,
            most,
            rounds: 0,
        })
    }

    fn finish(self) -> Conforming {
        let Self { vertices, skin, delaunay, is_inside, rounds, missing, .. } = self;
        let added = skin.points.len() - vertices;
        Conforming { delaunay, is_inside, added, rounds, missing: missing.len() }
    }

    /// Step 6: adds points until all balls end near the surface, or the limit is reached. A round that gives up patches is
    /// undone.
    fn approach(&mut self, surface: &TriangleBvh) {
        for _ in 0..APPROACHES {
            let mut next = self.clone();
            next.split_protrusions(CLOSE, surface);
            let (before, after) = (self.skin.points.len(), next.skin.points.len());
            if before == after || after - self.begin >= self.most {
                return;
            }
            let missing = std::mem::take(&mut next.missing);
            let conforms = next.insert(before, missing).and_then(|missing| next.conform(missing));
            if conforms.is_err() || next.give_ups > self.give_ups {
                return;
            }
            *self = next;
        }
    }

    /// Steps 1 to 5: adds points until no triangle is missing, except in patches that are given up.
    fn conform(&mut self, mut missing: Vec<u32>) -> Result<(), ConformingError> {
        // The state with the fewest missing triangles.
        let mut best: Option<Box<Snapshot>> = None;
        let (mut least, mut limit) = (usize::MAX, 0);
        loop {
            let mut stars = Stars::of(&self.delaunay);
            let skin = &mut self.skin;
            skin.flip_to(&missing, &mut stars);
            if !self.is_strict {
                skin.flip_bent(&missing, &mut stars);
            }
            let suspects = skin.with_changed(missing);
            missing = skin.missing_among(suspects, &self.delaunay);
            let is_open = |t: &u32| !self.given_up.contains(&skin.patch[*t as usize]);
            let open: Vec<u32> = missing.iter().copied().filter(is_open).collect();
            if open.is_empty() {
                self.is_inside = match missing.len() {
                    0 => skin.label(&self.delaunay)?,
                    _ => self.winding(),
                };
                self.missing = missing;
                return Ok(());
            }
            if open.len() < least {
                (least, limit) = (open.len(), GROWTH * skin.points.len() + SLACK);
                let (skin, delaunay) = (skin.clone(), self.delaunay.clone());
                best = Some(Box::new(Snapshot { skin, delaunay, missing: missing.clone() }));
            }
            let before = skin.points.len();
            let (added, most) = (before - self.begin, self.most);
            if added < most && before < limit && self.rounds < ROUNDS {
                skin.refine(&open, &mut stars);
            }
            if skin.points.len() > before {
                missing = self.insert(before, missing)?;
                self.rounds += 1;
                continue;
            }
            let error = ConformingError::Budget { missing: least, added, most };
            let snapshot = best.take().filter(|_| self.give_ups < GIVE_UPS).ok_or(error)?;
            (self.skin, self.delaunay, missing) =
                (snapshot.skin, snapshot.delaunay, snapshot.missing);
            self.give_ups += 1;
            let hopeless = missing.iter().map(|&t| self.skin.patch[t as usize]);
            self.given_up.extend(hopeless);
            least = usize::MAX;
        }
    }

    /// For each finite cell whether the winding number of the skin is positive at its centroid. Parts and cavities of
    /// little volume, which missing triangles leave, join their surroundings.
    fn winding(&self) -> Vec<bool> {
        let delaunay = &self.delaunay;
        let corners = |cell: CellId| delaunay.vertices(cell).map(|v| delaunay.point(v));
        let centroid = |cell: CellId| corners(cell).into_iter().sum::<Vec3>() / 4.0;
        let volume = |cell: CellId| {
            let [a, b, c, d] = corners(cell);
            (b - a).cross(c - a).dot(d - a).abs() / 6.0
        };
        let cells: Vec<CellId> = delaunay.finite_cells().collect();
        let centroids: Vec<Vec3> = cells.iter().map(|&cell| centroid(cell)).collect();
        let Skin { points, triangles, .. } = &self.skin;
        let skin = TriMesh { vertices: points.clone(), faces: triangles.clone() };
        let sides = InsideTest::new(&skin).sides(&centroids);
        let mut is_inside: Vec<bool> = sides.iter().map(|&side| side == Side::Inside).collect();
        let inside = |cell: CellId| is_inside.get(cell.index()).is_some_and(|&inside| inside);
        let mut parts = DisjointSets::singletons(delaunay.cell_count());
        for &cell in &cells {
            for other in delaunay.neighbours(cell) {
                if inside(cell) == inside(other) {
                    parts.join(cell.0, other.0);
                }
            }
        }
        let mut volumes = vec![0.0; delaunay.cell_count()];
        let total: f64 = cells.iter().filter(|&&cell| inside(cell)).map(|&cell| volume(cell)).sum();
        for &cell in &cells {
            volumes[parts.find(cell.0) as usize] += volume(cell);
        }
        for cell in delaunay.infinite_cells() {
            volumes[parts.find(cell.0) as usize] = f64::INFINITY;
        }
        for &cell in &cells {
            let is_speck = volumes[parts.find(cell.0) as usize] < SPECK * total;
            is_inside[cell.index()] ^= is_speck;
        }
        is_inside
    }

    /// Inserts the points from `first` on. Returns the missing triangles, given those before.
    fn insert(&mut self, first: usize, missing: Vec<u32>) -> Result<Vec<u32>, ConformingError> {
        self.delaunay.insert(&self.skin.points[first..])?;
        let mut suspects = self.skin.with_changed(missing);
        suspects.extend(self.skin.near_new(first, &self.delaunay));
        Ok(self.skin.missing_among(suspects, &self.delaunay))
    }
}

impl Skin {
    /// Step 5: for each finite cell whether it is inside.
    fn label(&self, delaunay: &Delaunay) -> Result<Vec<bool>, ConformingError> {
        let mut label = vec![None; delaunay.cell_count()];
        // For each facet of a cell the patch that it is part of.
        let mut walls = vec![[None; 4]; delaunay.cell_count()];
        let mut waiting = Vec::new();
        for (facet, &patch) in self.facets(delaunay).into_iter().zip(&self.patch) {
            let facet = facet.expect("no triangle is missing");
            for (facet, is_inside) in [(facet, true), (delaunay.mirror(facet), false)] {
                walls[facet.cell.index()][facet.opposite] = Some(patch);
                waiting.push((facet.cell, is_inside));
            }
        }
        waiting.extend(delaunay.infinite_cells().map(|cell| (cell, false)));
        while let Some((cell, is_inside)) = waiting.pop() {
            match label[cell.index()] {
                Some(known) if known != is_inside => return Err(ConformingError::Crossing),
                Some(_) => continue,
                None => label[cell.index()] = Some(is_inside),
            }
            for (k, other) in delaunay.neighbours(cell).into_iter().enumerate() {
                if walls[cell.index()][k].is_none() && label[other.index()] != Some(is_inside) {
                    waiting.push((other, is_inside));
                }
            }
        }
        let finite = label.into_iter().take(delaunay.finite_cell_count());
        let mut is_inside: Vec<bool> = finite.map(|label| label == Some(true)).collect();
        peel(delaunay, &mut is_inside, &mut walls);
        Ok(is_inside)
    }
}

/// Takes flat cells off the inside: two of their facets are in one patch, and the others become part of it. It is a flip of
/// the surface, which lies in the cell.
fn peel(delaunay: &Delaunay, is_inside: &mut [bool], walls: &mut [[Option<u32>; 4]]) {
    let mut waiting: Vec<CellId> = delaunay.finite_cells().collect();
    while let Some(cell) = waiting.pop() {
        let of_patch: Vec<u32> = walls[cell.index()].iter().copied().flatten().collect();
        let &[patch, other] = &of_patch[..] else { continue };
        if patch != other || !is_inside[cell.index()] || !is_flat(delaunay, cell) {
            continue;
        }
        is_inside[cell.index()] = false;
        let own = walls[cell.index()];
        for opposite in (0..4).filter(|&k| own[k].is_none()) {
            let beyond = delaunay.mirror(Facet { cell, opposite });
            walls[beyond.cell.index()][beyond.opposite] = Some(patch);
            waiting.push(beyond.cell);
        }
    }
}

/// Details as small as the tolerance of patches have two facets in one without being flat.
fn is_flat(delaunay: &Delaunay, cell: CellId) -> bool {
    let [a, b, c, d] = delaunay.vertices(cell).map(|v| delaunay.point(v));
    let edges = [a - b, a - c, a - d, b - c, b - d, c - d];
    let longest = edges.into_iter().map(Vec3::length).fold(0.0, f64::max);
    (b - a).cross(c - a).dot(d - a).abs() <= FLAT_CELL * longest.powi(3)
}
