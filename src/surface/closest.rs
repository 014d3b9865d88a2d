//! Closest point on a triangle mesh.

use crate::Vec3;
use crate::geometry::planar_frame::{Part, PlanarFrame};
use crate::geometry::trees::{Bounds, Frame, Lanes, Plan, Query, Tree, WideTree, in_morton_order};
use crate::surface::TriMesh;

/// Larger coordinates would overflow when squared.
const MAX_COORDINATE: f64 = 1e150;

/// A bounding-volume tree over triangles. Triangles of no area are segments or points, and valid.
///
/// Lengths are in the unit of the triangles.
///
/// ```
/// use medial::Vec3;
/// use medial::surface::{Feature, TriangleBvh};
/// use medial::surface::TriMesh;
///
/// let vertices = vec![Vec3::ZERO, 2.0 * Vec3::X, Vec3::new(1.0, 1.0, 0.0)];
/// let bvh = TriangleBvh::new(&TriMesh { vertices, faces: vec![[0, 1, 2]] })?;
/// let closest = bvh.closest(Vec3::new(0.5, -3.0, 4.0));
/// assert_eq!(closest.distance, 5.0);
/// assert_eq!(closest.point, Vec3::new(0.5, 0.0, 0.0));
/// assert_eq!(closest.feature, Feature::Edge(0));
/// # Ok::<(), medial::surface::BvhError>(())
/// ```
#[derive(Clone, Debug)]
pub struct TriangleBvh {
    tree: Tree,
    /// The same tree, for the closest triangle.
    wide: WideTree,
    /// For each leaf of the wide tree.
    blocks: Vec<Block>,
    /// In leaf order.
    frames: Vec<PlanarFrame>,
    /// In leaf order.
    corners: Vec<[Vec3; 3]>,
    /// In leaf order, the corner that the frame starts at.
    firsts: Vec<u8>,
    /// For each face its place in leaf order.
    places: Vec<u32>,
    /// Bound on the rounding error of a distance, for queries no farther away than the mesh is large.
    slack: f64,
}

/// The closest point of a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closest {
    /// The point.
    pub point: Vec3,
    /// Its distance from the query.
    pub distance: f64,
    /// Index of a face that holds it: of several equally near ones the smallest.
    pub face: u32,
    /// The part of that face that holds it.
    pub feature: Feature,
}

/// A part of a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feature {
    /// The inside.
    Face,
    /// The side from corner `k` to corner `k + 1` modulo 3, without its ends.
    Edge(u8),
    /// Corner `k`.
    Vertex(u8),
}

/// Why no tree can be built over a mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the messages name the fields")]
pub enum BvhError {
    /// There is nothing to be near to.
    #[error("the mesh has no faces")]
    Empty,
    /// A corner is not a number or too large to be squared.
    #[error("face {face} has the corner {corner}, which is not finite or exceeds 1e150")]
    Corner { face: usize, corner: Vec3 },
}

/// Checks that there are triangles, with finite corners that can be squared.
pub(super) fn check_corners(triangles: &[[Vec3; 3]]) -> Result<(), BvhError> {
    if triangles.is_empty() {
        return Err(BvhError::Empty);
    }
    for (face, corners) in triangles.iter().enumerate() {
        for &corner in corners {
            if corner.is_nan() || corner.abs().max_element() > MAX_COORDINATE {
                return Err(BvhError::Corner { face, corner });
            }
        }
    }
    Ok(())
}

impl TriangleBvh {
    /// A tree over the faces of a mesh. Cost `O(n log n)`.
    ///
    /// # Errors
    /// When the mesh has no faces, or a corner of one is not finite.
    ///
    /// # Panics
    /// If a face names a vertex that does not exist.
    pub fn new(mesh: &TriMesh) -> Result<Self, BvhError> {
        Self::from_triangles(&(0..mesh.faces.len()).map(|f| mesh.triangle(f)).collect::<Vec<_>>())
    }

    /// A tree over triangles given by their corners. A segment repeats a corner, a point is three
    /// times the same.
    ///
    /// # Errors
    /// When there are none, or a corner is not finite.
    pub fn from_triangles(triangles: &[[Vec3; 3]]) -> Result<Self, BvhError> {
        check_corners(triangles)?;
        let boxes: Vec<_> = triangles.iter().map(|&t| (Bounds::of_points(t), 0.0)).collect();
        let tree = Tree::build(&boxes, Plan { max_leaf: 4, group: 4, padding: 0.0 });
        let corners: Vec<_> = tree.order().iter().map(|&f| triangles[f as usize]).collect();
        let mut places = vec![0; triangles.len()];
        for (place, &face) in (0..).zip(tree.order()) {
            places[face as usize] = place;
        }
        let Bounds { lo, hi } = tree.bounds();
        // Relative to the largest coordinate: differences of coordinates lose that many digits.
        let slack = 64.0 * f64::EPSILON * lo.abs().max(hi.abs()).max_element();
        let framed = corners.iter().map(|&t| PlanarFrame::new(t));
        let (frames, firsts): (Vec<_>, Vec<_>) = framed.map(|(t, k)| (t, k as u8)).unzip();
        let wide = WideTree::new(&tree);
        let blocks = wide
            .leaves()
            .iter()
            .map(|leaf| Block::new(&frames[leaf.start as usize..leaf.end as usize], wide.frame()))
            .collect();
        Ok(Self { tree, wide, blocks, frames, corners, firsts, places, slack })
    }

    /// Number of triangles.
    pub fn face_count(&self) -> usize {
        self.corners.len()
    }

    /// The closest point to `p`. A query that is not finite gets a distance that is not.
    pub fn closest(&self, p: Vec3) -> Closest {
        self.closest_from(p, None)
    }

    /// The closest point to `p`. A face `start` near to it speeds up the search; the result does not
    /// depend on it.
    ///
    /// # Panics
    /// If `start` is not a face.
    pub fn closest_from(&self, p: Vec3, start: Option<u32>) -> Closest {
        let place = start.map_or(0, |face| self.places[face as usize]);
        self.closest_at(p, place).1
    }

    /// The closest points to many queries, in their order, in parallel. Cost per query is about
    /// half that of single queries, as each starts from its neighbour's result.
    pub fn closest_batch(&self, points: &[Vec3]) -> Vec<Closest> {
        in_morton_order(points, |last: &mut u32, p| {
            let (place, closest) = self.closest_at(p, *last);
            *last = place;
            closest
        })
    }

    /// The distances of many queries, in their order, in parallel.
    pub fn distance_batch(&self, points: &[Vec3]) -> Vec<f64> {
        self.distance_batch_with(points, |_, distance| distance)
    }

    /// The results of `finish` for many queries and their distances.
    pub(crate) fn distance_batch_with(
        &self,
        points: &[Vec3],
        finish: impl Fn(Vec3, f64) -> f64 + Sync,
    ) -> Vec<f64> {
        in_morton_order(points, |last: &mut u32, p| {
            let search = self.nearest(Nearest::starting(self, p, *last as usize));
            *last = search.place as u32;
            finish(p, search.squared.sqrt())
        })
    }

    /// The closest point to `p` that is not farther away than `bound`, if there is one. A face `start` near to it
    /// speeds up the search; the result does not depend on it.
    ///
    /// # Panics
    /// If `start` is not a face.
    pub fn closest_within_from(&self, p: Vec3, bound: f64, start: Option<u32>) -> Option<Closest> {
        if bound.is_nan() || bound < 0.0 {
            return None;
        }
        let mut search = Nearest::within(self, p, bound);
        if let Some(face) = start {
            search.measure(self.places[face as usize] as usize);
        }
        let found = self.nearest(search);
        (found.place != NONE).then(|| self.describe(p, found.place, found.squared))
    }

    /// Whether some point of the mesh is not farther away from `p` than `distance`.
    pub fn any_within(&self, p: Vec3, distance: f64) -> bool {
        if distance.is_nan() || distance < 0.0 {
            return false;
        }
        let limit = padded(distance, self.slack).powi(2);
        let squared = inclusive_square(distance);
        let mut found = false;
        self.tree.search_around(p, limit, |mut places| {
            found = places.any(|k| self.frames[k].distance_squared(p) <= squared);
            // Once one is found, no box is near enough.
            if found { -1.0 } else { limit }
        });
        found
    }

    /// Reports every face that is not farther away from `p` than `distance`, with the point of it that is closest, in
    /// the order of the tree.
    pub fn each_within(&self, p: Vec3, distance: f64, mut each: impl FnMut(u32, Vec3)) {
        let limit = padded(distance, self.slack).powi(2);
        let squared = inclusive_square(distance);
        self.tree.search_around(p, limit, |places| {
            for place in places {
                let found = self.frames[place].distance_squared(p);
                if found <= squared {
                    let closest = self.describe(p, place, found);
                    each(closest.face, closest.point);
                }
            }
            limit
        });
    }

    fn closest_at(&self, p: Vec3, start: u32) -> (u32, Closest) {
        let found = self.nearest(Nearest::starting(self, p, start as usize));
        (found.place as u32, self.describe(p, found.place, found.squared))
    }

    fn nearest<'a>(&'a self, mut search: Nearest<'a>) -> Nearest<'a> {
        let Some(query) = self.wide.query(search.p) else {
            self.tree.search_around(search.p, search.limit(), |places| {
                places.for_each(|place| search.measure(place));
                search.limit()
            });
            return search;
        };
        let limit = query.limit(search.reach());
        self.wide.nearest(&query, limit, |leaf, limit| {
            let places = self.wide.leaves()[leaf].clone();
            // Lanes beyond the leaf repeat its first triangle.
            let mut near = self.blocks[leaf].within(&query, limit) & ((1 << places.len()) - 1);
            let before = search.squared;
            while near != 0 {
                search.measure(places.start as usize + near.trailing_zeros() as usize);
                near &= near - 1;
            }
            if search.squared < before { query.limit(search.reach()) } else { limit }
        });
        search
    }

    fn describe(&self, p: Vec3, place: usize, squared: f64) -> Closest {
        let frame = &self.frames[place];
        let corners = &self.corners[place];
        let first = usize::from(self.firsts[place]);
        let order = [first, (first + 1) % 3, (first + 2) % 3];
        let (part, t) = frame.nearest_part(p);
        let (feature, point) = match part {
            Part::Face => {
                let [x, y, _] = frame.local(p);
                (Feature::Face, frame.point(x, y))
            }
            Part::Side(k) => {
                let (a, b) = (corners[order[k]], corners[order[(k + 1) % 3]]);
                (Feature::Edge(order[k] as u8), a.lerp(b, t))
            }
            Part::Corner(k) => (Feature::Vertex(order[k] as u8), corners[order[k]]),
        };
        Closest { point, distance: squared.sqrt(), face: self.tree.order()[place], feature }
    }
}

/// No place.
const NONE: usize = usize::MAX;

/// A distance increased by a bound on its rounding error.
#[inline]
fn padded(distance: f64, slack: f64) -> f64 {
    distance * (1.0 + 1e-14) + slack
}

/// The square of a bound, rounded up, so that a distance found earlier is within the bound of itself.
fn inclusive_square(bound: f64) -> f64 {
    bound * bound * (1.0 + 4.0 * f64::EPSILON)
}

/// Search for the closest triangle.
struct Nearest<'a> {
    bvh: &'a TriangleBvh,
    p: Vec3,
    squared: f64,
    place: usize,
}

impl<'a> Nearest<'a> {
    fn starting(bvh: &'a TriangleBvh, p: Vec3, place: usize) -> Self {
        Self { bvh, p, squared: bvh.frames[place].distance_squared(p), place }
    }

    fn within(bvh: &'a TriangleBvh, p: Vec3, bound: f64) -> Self {
        Self { bvh, p, squared: inclusive_square(bound), place: NONE }
    }

    /// The distance beyond which no box can hold anything as near as the best, rounding included.
    #[inline]
    fn reach(&self) -> f64 {
        padded(self.squared.sqrt(), self.bvh.slack)
    }

    /// Its square.
    fn limit(&self) -> f64 {
        self.reach().powi(2)
    }

    #[inline]
    fn measure(&mut self, place: usize) {
        let squared = self.bvh.frames[place].distance_squared(self.p);
        if squared > self.squared {
            return;
        }
        // Of equally near faces the smallest, so that the result does not depend on the search.
        let order = self.bvh.tree.order();
        // In a bounded search there may be no place yet: a face exactly at the bound counts.
        let first = self.place == NONE || order[place] < order[self.place];
        if squared < self.squared || first {
            self.place = place;
            self.squared = squared;
        }
    }
}

// Four triangles measured together in single precision, to select those worth measuring in double
// precision.
//
// The distance is that of [`PlanarFrame::distance_squared`], computed differently: the least
// distance to the three sides, unless the query projects into the triangle. So if rounding puts the
// query on the wrong side of a line, the distance changes by no more than rounding.

/// The frames of up to four triangles, in the [`Frame`] of a wide tree. Lanes without a triangle
/// repeat the first one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block {
    origin: [Lanes; 3],
    x: [Lanes; 3],
    y: [Lanes; 3],
    normal: [Lanes; 3],
    length: Lanes,
    apex: [Lanes; 2],
    /// Reciprocal squared lengths of the sides `ac`, `bc`; 0 for negligible ones.
    reciprocal: [Lanes; 2],
}

/// Squared lengths below this have no reciprocal in single precision. The distance to such a side is
/// measured from its start, which differs by less than rounding.
const NEGLIGIBLE: f64 = 1e-30;

/// The values of four triangles.
fn lanes(frames: &[PlanarFrame], value: impl Fn(&PlanarFrame) -> f64) -> Lanes {
    Lanes::from([0, 1, 2, 3].map(|k| value(frames.get(k).unwrap_or(&frames[0])) as f32))
}

#[inline]
fn dot(u: &[Lanes; 3], v: &[Lanes; 3]) -> Lanes {
    u[0] * v[0] + u[1] * v[1] + u[2] * v[2]
}

/// Squared distance in the plane from a point, relative to the start of a side, to the side.
#[inline]
fn to_side([x, y]: [Lanes; 2], [run, rise]: [Lanes; 2], reciprocal: Lanes) -> Lanes {
    let t = ((x * run + y * rise) * reciprocal).fast_max(Lanes::ZERO).fast_min(Lanes::ONE);
    let (dx, dy) = (x - t * run, y - t * rise);
    dx * dx + dy * dy
}

impl Block {
    pub fn new(frames: &[PlanarFrame], frame: &Frame) -> Self {
        let s = frame.scale;
        Self {
            origin: [0, 1, 2].map(|k| lanes(frames, |t| frame.forward(t.origin)[k])),
            x: [0, 1, 2].map(|k| lanes(frames, |t| t.x[k])),
            y: [0, 1, 2].map(|k| lanes(frames, |t| t.y[k])),
            normal: [0, 1, 2].map(|k| lanes(frames, |t| t.normal[k])),
            length: lanes(frames, |t| t.length * s),
            apex: [0, 1].map(|k| lanes(frames, |t| t.apex[k] * s)),
            reciprocal: [0, 1].map(|side| {
                lanes(frames, |t| {
                    let run = if side == 0 { t.apex[0] } else { t.length - t.apex[0] };
                    let squared = (run * s).powi(2) + (t.apex[1] * s).powi(2);
                    if squared > NEGLIGIBLE { 1.0 / squared } else { 0.0 }
                })
            }),
        }
    }

    /// The triangles that may be within a limit, one bit each.
    #[inline]
    pub fn within(&self, query: &Query, limit: f32) -> u32 {
        let w = [0, 1, 2].map(|k| query.p[k] - self.origin[k]);
        let (x, y, height) = (dot(&w, &self.x), dot(&w, &self.y), dot(&w, &self.normal));
        let [cx, cy] = self.apex;
        let zero = Lanes::ZERO;
        let beyond = self.length - x;
        let across = cx - self.length;
        let left = cy * x - cx * y;
        let right = cy * beyond + across * y;
        let inside = y.simd_ge(zero) & left.simd_ge(zero) & right.simd_ge(zero);
        let past = x - x.fast_max(zero).fast_min(self.length);
        let base = past * past + y * y;
        let sides = to_side([x, y], [cx, cy], self.reciprocal[0])
            .fast_min(to_side([-beyond, y], [across, cy], self.reciprocal[1]))
            .fast_min(base);
        let squared = height * height + inside.bitselect(zero, sides);
        squared.simd_le(Lanes::splat(limit)).to_bitmask()
    }
}
