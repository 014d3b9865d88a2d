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
//!    surface point nearest to its centre. So does the circle in which a ball that is centred beyond a plane meets it, where the
//!    solid is thinner than the samples are apart. On coarse surfaces edges are halved at vertices that no ball is near, as
//!    at the tips of needles. Then 1 to 5 follow again.
//! 7. Where triangles stay missing, winding numbers tell inside from outside, and cells change sides until the numbers of
//!    parts, loops and cavities are the solid's (file `specks.rs`).
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
mod specks;
mod stars;

use std::collections::HashSet;

use skin::Skin;
use stars::Stars;

use crate::Vec3;
use crate::geometry::triangulation::Facet;
use crate::geometry::{CellId, Delaunay, TriangulationError};
use crate::surface::{InsideTest, Normalisation, Side, TriMesh, TriangleBvh};

/// Limit of rounds of refinement.
const ROUNDS: usize = 1_000;

/// Ratio of the number of points to that with the fewest missing triangles, above which patches are given up.
const GROWTH: usize = 2;

/// Points in addition to these after which patches are given up: of a surface, and of a round against far balls.
const SLACK: [usize; 2] = [20_000, 6_000];

/// Limit of rounds against balls that reach far beyond the surface. Few shapes need ten.
const APPROACHES: usize = 40;

/// Number of points, summed over all rounds of refinement, after which no further round against far balls begins. Solids with
/// hairline gaps reach it.
const WORK: usize = 12_000_000;

/// How a surface is refined.
#[derive(Clone, Copy, Debug)]
struct Way {
    /// Largest distance of neighbouring triangles from one plane in a patch, as a fraction of the surface's diagonal.
    flat: f64,
    /// Whether edges between patches are flipped.
    bends: bool,
    /// Limit of times that patches are given up.
    give_ups: usize,
    /// Limit of rounds after that with the fewest missing triangles.
    rounds: usize,
}

/// Ways that are tried in turn: the first for coarse surfaces alone, the last for surfaces with details below the rounding of
/// files of six digits.
const WAYS: [Way; 3] = [
    Way { flat: 1e-6, bends: false, give_ups: 0, rounds: 100 },
    Way { flat: 1e-6, bends: true, give_ups: 4, rounds: ROUNDS },
    Way { flat: 1e-10, bends: false, give_ups: 4, rounds: ROUNDS },
];

/// Length of an edge, as a fraction of the surface's diagonal, above which a surface is coarse.
const COARSE: f64 = 0.1;

/// Depth of a ball beyond the surface, as a fraction of the diagonal, above which points are added to dense surfaces as well.
const FAR: f64 = 0.02;

/// Depth that is reached then, and on coarse surfaces.
const CLOSE: f64 = 0.01;

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
    /// begins after `most` points were added. `betti` are the solid's Betti numbers, where they are known. The
    /// same result for any number of threads. Cost: `O(n log n)` expected, and `O(n)` for each round.
    ///
    /// # Errors
    /// When the vertices do not span space, the surface touches or crosses itself, or the points do not
    /// suffice for the topology.
    ///
    /// # Panics
    /// If a face names a vertex that does not exist.
    pub fn new(
        surface: &TriMesh,
        least: usize,
        most: usize,
        betti: Option<[usize; 3]>,
    ) -> Result<Self, ConformingError> {
        let delaunay = Delaunay::new(&surface.vertices)?;
        let mut kept: Option<Refinement> = None;
        let mut failure = ConformingError::Crossing;
        let is_coarse = is_coarse(surface);
        for (step, way) in WAYS.into_iter().enumerate() {
            // Dense surfaces begin with flips.
            if step == 0 && !is_coarse {
                continue;
            }
            let mut refinement =
                Refinement::new(surface, delaunay.clone(), [least, most], betti, way)?;
            let missing = refinement.skin.missing(&refinement.delaunay);
            match refinement.conform(missing, None) {
                Ok(()) => {
                    let missing = refinement.missing.len();
                    if kept.as_ref().is_none_or(|kept| missing < kept.missing.len()) {
                        kept = Some(refinement);
                    }
                    if step > 0 || missing == 0 {
                        break;
                    }
                }
                // Flips can make close sheets cross.
                Err(ConformingError::Crossing) => {}
                Err(why) if step > 0 => {
                    failure = why;
                    break;
                }
                Err(why) => failure = why,
            }
        }
        let mut refinement = kept.ok_or(failure)?;
        if (is_coarse || refinement.has_protrusions(FAR))
            && let Ok(tree) = TriangleBvh::new(surface)
        {
            refinement.approach(&tree, false);
            if is_coarse {
                refinement.approach(&tree, true);
            }
        }
        Ok(refinement.finish())
    }
}

/// Whether the surface has an edge longer than [`COARSE`].
pub(crate) fn is_coarse(surface: &TriMesh) -> bool {
    let Some(units) = Normalisation::of(surface) else { return false };
    let limit = COARSE * units.diagonal;
    let triangles = (0..surface.faces.len()).map(|f| surface.triangle(f));
    triangles.into_iter().any(|[a, b, c]| [a - b, b - c, c - a].iter().any(|e| e.length() > limit))
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
    way: Way,
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
    /// Betti numbers of the solid, where they are known.
    betti: Option<[usize; 3]>,
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
        betti: Option<[usize; 3]>,
        way: Way,
    ) -> Result<Self, ConformingError> {
        let mut skin = Skin::new(surface, &delaunay, way.flat)?;
        skin.flip_by_angles(0..skin.triangles.len());
        skin.split_longest(least);
        let begin = skin.points.len();
        delaunay.insert(&skin.points[surface.vertices.len()..])?;
        Ok(Self {
            vertices: surface.vertices.len(),
            skin,
            delaunay,
            is_inside: Vec::new(),
            way,
            given_up: HashSet::new(),
            give_ups: 0,
            missing: Vec::new(),
            begin,
            most,
            betti,
            rounds: 0,
        })
    }

    fn finish(self) -> Conforming {
        let Self { vertices, skin, delaunay, mut is_inside, rounds, missing, betti, .. } = self;
        if let Some(betti) = betti {
            specks::mend_loops(&delaunay, &mut is_inside, &skin, &missing, betti);
        }
        let added = skin.points.len() - vertices;
        Conforming { delaunay, is_inside, added, rounds, missing: missing.len() }
    }

    /// Step 6: adds points until all balls end near the surface or the limit is reached; on coarse surfaces also until they
    /// close no gap, and none of its vertices is far from them. A round that gives up patches is undone, and no point is
    /// added again near those of its points that are next to a triangle that stayed missing: at twice the distance each
    /// time.
    fn approach(&mut self, surface: &TriangleBvh, is_coarse: bool) {
        let closest = CLOSE * self.skin.diagonal;
        let mut closed: Vec<(Vec3, f64)> = Vec::new();
        let (mut distance, mut work) = (closest, 0);
        for _ in 0..APPROACHES {
            if work > WORK {
                return;
            }
            let give_ups = self.give_ups + 1;
            let way = Way { bends: false, give_ups, rounds: ROUNDS, ..self.way };
            let mut next = Self { way, ..self.clone() };
            next.split_protrusions(CLOSE, surface, &closed, is_coarse);
            if is_coarse {
                next.split_at_bare_vertices(CLOSE, surface, &closed);
            }
            let (before, after) = (self.skin.points.len(), next.skin.points.len());
            if before == after || after - self.begin >= self.most {
                return;
            }
            let missing = std::mem::take(&mut next.missing);
            let conforms = next.insert(before, missing);
            let conforms = conforms.and_then(|missing| next.conform(missing, Some(surface)));
            work += (next.rounds - self.rounds) * next.skin.points.len();
            if conforms.is_ok() && next.give_ups == self.give_ups {
                *self = next;
                distance = closest;
                continue;
            }
            let new = &next.skin.points[before..after];
            let known = closed.len();
            closed.extend(next.missing.iter().filter_map(|&t| {
                let at = next.skin.corners(t).into_iter().sum::<Vec3>() / 3.0;
                let nearest = new
                    .iter()
                    .min_by(|p, q| p.distance_squared(at).total_cmp(&q.distance_squared(at)));
                Some((*nearest?, distance))
            }));
            if closed.len() == known {
                return;
            }
            distance *= 2.0;
        }
    }

    /// Steps 1 to 5: adds points until no triangle is missing, except in patches that are given up. They are moved from
    /// flipped triangles to `surface`, where it is given.
    fn conform(
        &mut self,
        mut missing: Vec<u32>,
        surface: Option<&TriangleBvh>,
    ) -> Result<(), ConformingError> {
        // The state with the fewest missing triangles.
        let mut best: Option<Box<Snapshot>> = None;
        let (mut least, mut limit, mut since) = (usize::MAX, 0, self.rounds);
        let slack = SLACK[usize::from(surface.is_some())];
        let Way { bends, give_ups, rounds, .. } = self.way;
        loop {
            let mut stars = Stars::of(&self.delaunay);
            let skin = &mut self.skin;
            skin.flip_to(&missing, &mut stars);
            if bends {
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
                if let Some(betti) = self.betti {
                    specks::join(&self.delaunay, &mut self.is_inside, betti);
                }
                self.missing = missing;
                return Ok(());
            }
            if open.len() < least {
                (least, limit) = (open.len(), GROWTH * skin.points.len() + slack);
                since = self.rounds;
                let (skin, delaunay) = (skin.clone(), self.delaunay.clone());
                best = Some(Box::new(Snapshot { skin, delaunay, missing: missing.clone() }));
            }
            let before = skin.points.len();
            let (added, most) = (before - self.begin, self.most);
            if added < most && before < limit && self.rounds - since < rounds {
                skin.refine(&open, &mut stars);
            }
            if skin.points.len() > before {
                if let Some(surface) = surface {
                    skin.move_to(surface, before);
                }
                missing = self.insert(before, missing)?;
                self.rounds += 1;
                continue;
            }
            let error = ConformingError::Budget { missing: least, added, most };
            let snapshot = best.take().filter(|_| self.give_ups < give_ups).ok_or(error)?;
            (self.skin, self.delaunay, missing) =
                (snapshot.skin, snapshot.delaunay, snapshot.missing);
            self.give_ups += 1;
            let hopeless = missing.iter().map(|&t| self.skin.patch[t as usize]);
            self.given_up.extend(hopeless);
            least = usize::MAX;
        }
    }

    /// For each finite cell whether the winding number of the skin is positive at its centroid.
    fn winding(&self) -> Vec<bool> {
        let delaunay = &self.delaunay;
        let corners = |cell: CellId| delaunay.vertices(cell).map(|v| delaunay.point(v));
        let centroid = |cell: CellId| corners(cell).into_iter().sum::<Vec3>() / 4.0;
        let centroids: Vec<Vec3> = delaunay.finite_cells().map(centroid).collect();
        let Skin { points, triangles, .. } = &self.skin;
        let skin = TriMesh { vertices: points.clone(), faces: triangles.clone() };
        let sides = InsideTest::new(&skin).sides(&centroids);
        sides.iter().map(|&side| side == Side::Inside).collect()
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
