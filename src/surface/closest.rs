//! Closest point on a triangle mesh.

use std::ops::ControlFlow;

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

    /// The distance from one face.
    pub(super) fn distance_from_face(&self, p: Vec3, face: u32) -> f64 {
        self.frames[self.places[face as usize] as usize].distance_squared(p).sqrt()
    }

    /// Whether a face passes `test`, among those in boxes that pass `enter`.
    pub(super) fn any(
        &self,
        enter: impl Fn(&Bounds) -> bool,
        test: impl Fn([Vec3; 3]) -> bool,
    ) -> bool {
        let mut found = false;
        self.tree.descend(
            |_, node| enter(&node.bounds),
            |mut places| {
                found = places.any(|place| test(self.corners[place]));
                if found { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            },
        );
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

    /// The triangles that can be closest to a point of a ball; `None` where there are more than `most`.
    /// `foot` is the closest point to the centre.
    pub fn vicinity(
        &self,
        centre: Vec3,
        radius: f64,
        foot: &Closest,
        most: usize,
    ) -> Option<Vicinity<'_>> {
        let query = self.wide.query(centre)?;
        let mut search = Collect::new(self, centre, radius, foot);
        let limit = query.limit(search.reach);
        let foot = self.wide.query(foot.point)?;
        self.wide.rivals(&query, &foot, search.least, radius, |leaf| {
            let places = self.wide.leaves()[leaf].clone();
            let mut near = self.blocks[leaf].within(&query, limit) & ((1 << places.len()) - 1);
            while near != 0 {
                search.add(places.start + near.trailing_zeros());
                near &= near - 1;
            }
            search.found.len() <= most
        });
        search.finish(most)
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
        let (feature, point) = self.nearest_point(p, place);
        Closest { point, distance: squared.sqrt(), face: self.tree.order()[place], feature }
    }

    /// The closest point of one triangle.
    fn nearest_point(&self, p: Vec3, place: usize) -> (Feature, Vec3) {
        let frame = &self.frames[place];
        let corners = &self.corners[place];
        let first = usize::from(self.firsts[place]);
        let order = [first, (first + 1) % 3, (first + 2) % 3];
        let (part, t) = frame.nearest_part(p);
        match part {
            Part::Face => {
                let [x, y, _] = frame.local(p);
                (Feature::Face, frame.point(x, y))
            }
            Part::Side(k) => {
                let (a, b) = (corners[order[k]], corners[order[(k + 1) % 3]]);
                (Feature::Edge(order[k] as u8), a.lerp(b, t))
            }
            Part::Corner(k) => (Feature::Vertex(order[k] as u8), corners[order[k]]),
        }
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

/// The triangles that can be closest to a point of a ball, to search again and again without the
/// tree. The results are those of the tree.
///
/// The distance to a triangle is convex, so its tangent in the centre is a lower bound: searches
/// measure the triangles whose tangents are below the best distance.
#[derive(Clone, Debug)]
pub struct Vicinity<'a> {
    bvh: &'a TriangleBvh,
    centre: Vec3,
    radius: f64,
    tangents: Vec<Tangents>,
    /// See [`Vicinity::gradient`].
    gradient: Option<(Vec3, f64)>,
}

/// The tangents of four triangles in single precision, in the [`Frame`] of the wide tree. Lanes
/// without a triangle are infinitely far.
#[derive(Clone, Copy, Debug)]
struct Tangents {
    gradient: [Lanes; 3],
    /// In the centre.
    distance: Lanes,
    places: [u32; 4],
}

/// Bound on the error of a tangent in single precision, per unit of distance and radius: ten
/// roundings of numbers up to three times as large.
const TANGENT_BLUR: f64 = 2e-6;

impl<'a> Vicinity<'a> {
    /// The closest point to a point of the ball; of any other point one that may be farther. A face
    /// `start` near to it speeds up the search; the result does not depend on it.
    ///
    /// # Panics
    /// If `start` is not a face.
    pub fn closest_from(&self, p: Vec3, start: u32) -> Closest {
        let place = self.bvh.places[start as usize];
        let found = self.nearest(Nearest::starting(self.bvh, p, place as usize));
        self.bvh.describe(p, found.place, found.squared)
    }

    /// As [`TriangleBvh::closest_within_from`] for a point of the ball.
    pub fn closest_within(&self, p: Vec3, bound: f64) -> Option<Closest> {
        if bound.is_nan() || bound < 0.0 {
            return None;
        }
        let found = self.nearest(Nearest::within(self.bvh, p, bound));
        (found.place != NONE).then(|| self.bvh.describe(p, found.place, found.squared))
    }

    /// The gradient of the distance in the centre, and the largest difference from it of the gradient
    /// there of the distance to any triangle of the vicinity. None if the ball reaches the surface.
    pub fn gradient(&self) -> Option<(Vec3, f64)> {
        self.gradient
    }

    /// That of a ball inside this one, as [`TriangleBvh::vicinity`].
    pub fn narrowed(&self, centre: Vec3, radius: f64, foot: &Closest, most: usize) -> Option<Self> {
        let mut search = Collect::new(self.bvh, centre, radius, foot);
        // As in [`Collect::add`], with the tangents in the old centre. One without a gradient is a
        // lower bound in the whole ball.
        let own = search.gradient.unwrap_or(Vec3::ZERO).to_array();
        let own = own.map(|x| Lanes::splat(x as f32));
        let limit = self.limit(search.least + search.bend);
        let radius = Lanes::splat((radius * self.bvh.wide.frame().scale) as f32);
        let offset = self.offset(centre);
        for tangents in &self.tangents {
            let apart = [0, 1, 2].map(|axis| tangents.gradient[axis] - own[axis]);
            let apart = dot(&apart, &apart).sqrt();
            tangents.each_within(&offset, limit + apart * radius, |place| search.add(place));
        }
        search.finish(most)
    }

    fn nearest(&self, mut search: Nearest<'a>) -> Nearest<'a> {
        let offset = self.offset(search.p);
        let mut limit = self.limit(search.reach());
        for tangents in &self.tangents {
            let before = search.squared;
            tangents.each_within(&offset, limit, |place| search.measure(place as usize));
            if search.squared < before {
                limit = self.limit(search.reach());
            }
        }
        search
    }

    /// A point relative to the centre, in the frame.
    #[inline]
    fn offset(&self, p: Vec3) -> [Lanes; 3] {
        let v = (p - self.centre) * self.bvh.wide.frame().scale;
        v.to_array().map(|x| Lanes::splat(x as f32))
    }

    /// The largest computed tangent whose true value may be `distance` or less.
    #[inline]
    fn limit(&self, distance: f64) -> Lanes {
        let blur = TANGENT_BLUR * (distance + self.radius) + 4.0 * self.bvh.slack;
        Lanes::splat(((distance + blur) * self.bvh.wide.frame().scale) as f32)
    }
}

impl Tangents {
    #[inline]
    fn each_within(&self, offset: &[Lanes; 3], limit: Lanes, mut each: impl FnMut(u32)) {
        let lower = self.distance + dot(&self.gradient, offset);
        let mut near = lower.simd_le(limit).to_bitmask();
        while near != 0 {
            each(self.places[near.trailing_zeros() as usize]);
            near &= near - 1;
        }
    }
}

/// Collects a [`Vicinity`].
struct Collect<'a> {
    bvh: &'a TriangleBvh,
    centre: Vec3,
    radius: f64,
    /// Distance of the centre.
    least: f64,
    /// The gradient there; none where distances to a point of the ball may be 0, which have no tangent.
    gradient: Option<Vec3>,
    /// Distance of the centre beyond which no triangle is closest to a point of the ball.
    reach: f64,
    /// The distance to the foot exceeds its tangent in the centre by no more.
    bend: f64,
    found: Vec<(f64, Vec3, u32)>,
}

impl<'a> Collect<'a> {
    fn new(bvh: &'a TriangleBvh, centre: Vec3, radius: f64, foot: &Closest) -> Self {
        let least = foot.distance;
        let gradient = (least > radius).then(|| (centre - foot.point) / least);
        let reach = padded(least + 2.0 * radius, bvh.slack);
        let bend = if gradient.is_some() { radius * radius / (2.0 * least) } else { radius };
        Self { bvh, centre, radius, least, gradient, reach, bend, found: Vec::new() }
    }

    /// Adds a triangle, unless the foot of the centre is nearer to all points of the ball.
    fn add(&mut self, place: u32) {
        let from = self.centre - self.bvh.nearest_point(self.centre, place as usize).1;
        let distance = from.length();
        if distance > self.reach {
            return;
        }
        let Some(gradient) = self.gradient else {
            self.found.push((distance - self.radius, Vec3::ZERO, place));
            return;
        };
        // The foot is no farther from the point `v` away from the centre than the tangent there plus
        // `v² / 2 d`, and the triangle no nearer than its own tangent.
        let own = from / distance;
        let reach = self.least + gradient.distance(own) * self.radius + self.bend;
        if distance <= padded(reach, 4.0 * self.bvh.slack) {
            self.found.push((distance, own, place));
        }
    }

    fn finish(mut self, most: usize) -> Option<Vicinity<'a>> {
        if self.found.len() > most {
            return None;
        }
        // The likeliest first.
        self.found.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let scale = self.bvh.wide.frame().scale;
        let tangents = self.found.chunks(4).map(|four| {
            let of = |k: usize| four.get(k).copied().unwrap_or((f64::INFINITY, Vec3::ZERO, 0));
            let lanes = |value: &dyn Fn((f64, Vec3, u32)) -> f64| {
                Lanes::from([0, 1, 2, 3].map(|k| value(of(k)) as f32))
            };
            Tangents {
                gradient: [0, 1, 2].map(|axis| lanes(&|(_, gradient, _)| gradient[axis])),
                distance: lanes(&|(distance, ..)| distance * scale),
                places: [0, 1, 2, 3].map(|k| of(k).2),
            }
        });
        let tangents = tangents.collect();
        let gradient = self.gradient.map(|gradient| {
            let differences = self.found.iter().map(|&(_, own, _)| gradient.distance(own));
            (gradient, differences.fold(0.0, f64::max))
        });
        let Self { bvh, centre, radius, .. } = self;
        Some(Vicinity { bvh, centre, radius, tangents, gradient })
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
