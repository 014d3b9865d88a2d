//! The primitives of a union in a tree, and the searches among them.

use std::ops::Range;

use super::{NearestPrimitive, Primitive};
use crate::Vec3;
use crate::geometry::trees::{
    Bounds, ConeBlock, FaceBlock, Lanes, Measure, Node, Plan, Query, ReachTree, Search, Tree,
};
use crate::geometry::{Cone, SlabFace, Sphere};

/// A search among the primitives around a point.
pub(super) trait UnionSearch {
    /// The measure of its limit.
    const MEASURE: Measure;

    /// The point.
    fn point(&self) -> Vec3;

    /// Primitives farther away than this are skipped.
    fn limit(&self) -> f64;

    /// Looks at the primitive at a place.
    fn look(&mut self, place: usize);
}

impl Parts {
    /// The primitive of least distance, signed or absolute, or the first one that is met whose distance is at most
    /// `enough`. Begins with the one at `near`, which is then the place of the one that was found.
    pub fn nearest<const SIGNED: bool>(
        &self,
        p: Vec3,
        near: &mut usize,
        enough: f64,
    ) -> NearestPrimitive {
        let signed = self.shape(*near).signed(p);
        let mut search = Nearest::<SIGNED>::new(self, p, *near, signed, enough);
        search.tighten();
        if search.limit > f64::NEG_INFINITY {
            self.search(&mut search);
        }
        *near = search.place;
        NearestPrimitive { signed: search.signed, primitive: self.primitive(search.place) }
    }

    /// The primitive of least signed distance, or `any`, if that distance is below a limit.
    pub fn below(&self, p: Vec3, limit: f64, any: bool) -> Option<NearestPrimitive> {
        // Nothing is below that, and a search with it would visit all.
        if limit == f64::NEG_INFINITY {
            return None;
        }
        let enough = if any { limit.next_down() } else { f64::NEG_INFINITY };
        let mut search = Nearest::<true>::new(self, p, NO_PLACE, limit, enough);
        search.tighten();
        self.search(&mut search);
        let found = search.place != NO_PLACE;
        found.then(|| {
            let primitive = self.primitive(search.place);
            NearestPrimitive { signed: search.signed, primitive }
        })
    }

    /// Shows to a search all primitives within its limit, and some others.
    #[inline]
    pub fn search(&self, search: &mut impl UnionSearch) {
        match self.quick.wide().query(search.point()) {
            Some(query) => self.search_quickly(&query, search),
            None => self.tree.search(&mut Exactly(search)),
        }
    }

    #[inline]
    fn search_quickly<S: UnionSearch>(&self, query: &Query, search: &mut S) {
        let limit = query.signed_limit(search.limit());
        self.quick.search(query, S::MEASURE, limit, |leaf, mut limit| {
            let [here, next] = [self.leaves[leaf], self.leaves[leaf + 1]];
            if let Some(node) = here.cluster {
                self.tree.search_below(node as usize, &mut Exactly(search));
                return query.signed_limit(search.limit());
            }
            let mut look = |first: u32, block: u32, signed: Lanes| {
                let place = (first as usize) + LANES * block as usize;
                limit = self.look(query, search, place, S::MEASURE.of(signed), limit);
            };
            for (block, cones) in (0..).zip(&self.cones[here.cone as usize..next.cone as usize]) {
                look(here.first[0], block, cones.signed(query));
            }
            for (block, faces) in (0..).zip(&self.faces[here.face as usize..next.face as usize]) {
                look(here.first[1], block, faces.signed(query));
            }
            limit
        });
    }

    /// Shows the primitives from a place on to a search that are within a limit, and returns the
    /// new one.
    #[inline]
    fn look<S: UnionSearch>(
        &self,
        query: &Query,
        search: &mut S,
        place: usize,
        values: Lanes,
        mut limit: f32,
    ) -> f32 {
        // A distance that is not a number may be within.
        let mut near = !values.simd_gt(Lanes::splat(limit)).to_bitmask() & 0xf;
        let values = values.to_array();
        while near != 0 {
            let lane = near.trailing_zeros() as usize;
            near &= near - 1;
            if values[lane] <= limit || values[lane].is_nan() {
                search.look(place + lane);
                limit = query.signed_limit(search.limit());
            }
        }
        limit
    }
}

/// The same search in the tree of two children a node, in double precision.
pub(super) struct Exactly<'a, S>(pub &'a mut S);

impl<S: UnionSearch> Search for Exactly<'_, S> {
    #[inline]
    fn bound(&self, node: &Node) -> f64 {
        let p = self.0.point();
        let outside = signed_bound(node, p);
        match S::MEASURE {
            // Outside all primitives of a node the least signed distance counts, inside all of
            // them the largest.
            Measure::Unsigned if outside <= 0.0 => depth_bound(node, p).max(0.0),
            _ => outside,
        }
    }

    #[inline]
    fn limit(&self) -> f64 {
        self.0.limit()
    }

    #[inline]
    fn visit(&mut self, places: Range<usize>) {
        places.for_each(|place| self.0.look(place));
    }
}

/// Lower bound of the signed distances to the primitives below a node.
///
/// Every interpolated sphere has its centre in the box of the centres and no larger radius. Boxes
/// around the balls would hardly differ from one sphere of a sheet to the next.
#[inline]
fn signed_bound(node: &Node, p: Vec3) -> f64 {
    node.bounds.distance_squared(p).sqrt() - node.reach
}

/// Lower bound of the depths in the primitives below a node, negative where some may not hold `p`.
///
/// Each primitive holds its largest ball, whose centre is in the box of the centres.
#[inline]
fn depth_bound(node: &Node, p: Vec3) -> f64 {
    node.least_reach - node.bounds.farthest_squared(p).sqrt()
}

/// No place: only primitives below the first value count.
const NO_PLACE: usize = usize::MAX;

/// Search for the nearest primitive, by signed distance or by its absolute value.
struct Nearest<'a, const SIGNED: bool> {
    parts: &'a Parts,
    p: Vec3,
    place: usize,
    signed: f64,
    value: f64,
    /// A distance that ends the search.
    enough: f64,
    limit: f64,
}

impl<'a, const SIGNED: bool> Nearest<'a, SIGNED> {
    /// Begins with the primitive at a place, and its signed distance.
    #[inline]
    fn new(parts: &'a Parts, p: Vec3, place: usize, signed: f64, enough: f64) -> Self {
        let (value, limit) = (Self::value(signed), f64::INFINITY);
        Self { parts, p, place, signed, value, enough, limit }
    }

    #[inline]
    fn value(signed: f64) -> f64 {
        if SIGNED { signed } else { signed.abs() }
    }

    /// Sets the limit above the best value by more than both can be rounded; below everything if that value is enough.
    #[inline]
    fn tighten(&mut self) {
        self.limit = if self.value <= self.enough {
            f64::NEG_INFINITY
        } else {
            self.value + self.value.abs() * ROUNDING + self.parts.slack()
        };
    }
}

impl<const SIGNED: bool> UnionSearch for Nearest<'_, SIGNED> {
    const MEASURE: Measure = if SIGNED { Measure::Signed } else { Measure::Unsigned };

    #[inline]
    fn point(&self) -> Vec3 {
        self.p
    }

    #[inline]
    fn limit(&self) -> f64 {
        self.limit
    }

    #[inline]
    fn look(&mut self, place: usize) {
        let signed = self.parts.shape(place).signed(self.p);
        let value = Self::value(signed);
        if value < self.value
            || (value == self.value
                && self.place != NO_PLACE
                && self.parts.primitive(place) < self.parts.primitive(self.place))
        {
            (self.place, self.signed, self.value) = (place, signed, value);
            self.tighten();
        }
    }
}

/// Search for all primitives nearer than a limit.
pub(super) struct Nearer<'a, F> {
    pub parts: &'a Parts,
    pub p: Vec3,
    pub limit: f64,
    pub each: F,
}

impl<F: FnMut(f64, Vec3)> UnionSearch for Nearer<'_, F> {
    const MEASURE: Measure = Measure::Signed;

    #[inline]
    fn point(&self) -> Vec3 {
        self.p
    }

    #[inline]
    fn limit(&self) -> f64 {
        self.limit + self.parts.slack()
    }

    #[inline]
    fn look(&mut self, place: usize) {
        if let Some((signed, centre)) = self.parts.shape(place).nearest_centre(self.p)
            && signed < self.limit
        {
            (self.each)(signed, centre);
        }
    }
}

// The primitives of a union, in a tree, in the order in which a search meets them.
//
// A search tests four boxes and four primitives at a time in single precision ([`ReachTree`],
// [`ConeBlock`], [`FaceBlock`]). This only selects: every primitive that may matter, within the error
// bounds, is measured in double precision. A query too far away for single precision searches the
// binary tree.

/// Bound on the rounding errors of a box's bound and of a signed distance together, relative to the
/// lengths that they are computed from: the distance itself, the radius, and the extent of the
/// primitive. These are differences of coordinates, so the position of the union does not matter.
/// Counted operation by operation, a slab has about 30 units of 2^-53 and a box 5.
pub(super) const ROUNDING: f64 = 32.0 * f64::EPSILON;

/// Largest number of primitives of a leaf, except clusters.
const LEAF: usize = 12;

/// Primitives measured together.
pub(super) const LANES: usize = 4;

#[derive(Clone, Debug)]
pub(super) enum Shape {
    Sphere(Sphere),
    Cone(Cone),
    Slab(SlabFace),
}

impl Shape {
    /// Signed distance; infinite where the cones of a slab's sides decide instead.
    #[inline]
    pub fn signed(&self, p: Vec3) -> f64 {
        match self {
            Self::Sphere(sphere) => sphere.signed_distance(p),
            Self::Cone(cone) => cone.signed_distance(p),
            Self::Slab(face) => face.signed_distance(p).unwrap_or(f64::INFINITY),
        }
    }

    /// As [`Shape::signed`], with the centre of the interpolated sphere that attains it; `None`
    /// where a slab leaves the result to its cones.
    #[inline]
    pub fn nearest_centre(&self, p: Vec3) -> Option<(f64, Vec3)> {
        match self {
            Self::Sphere(sphere) => Some((sphere.signed_distance(p), sphere.centre)),
            Self::Cone(cone) => Some(cone.nearest_centre(p)),
            Self::Slab(face) => face.nearest_centre(p),
        }
    }

    /// Radius of the interpolated sphere that attains the signed distance.
    pub fn radius_towards(&self, p: Vec3) -> f64 {
        self.nearest_centre(p)
            .map_or(f64::INFINITY, |(signed, centre)| (p.distance(centre) - signed).max(0.0))
    }
}

/// A primitive to be put in the tree.
pub(super) struct Part {
    primitive: Primitive,
    shape: Shape,
    /// Box around the centres.
    centres: Bounds,
    largest_radius: f64,
    balls: Vec<Sphere>,
}

impl Part {
    pub fn new(primitive: Primitive, shape: Shape, balls: &[Sphere]) -> Self {
        let largest_radius = balls.iter().fold(0.0, |r, m| f64::max(r, m.radius));
        let centres = Bounds::of_points(balls.iter().map(|m| m.centre));
        Self { primitive, shape, centres, largest_radius, balls: balls.to_vec() }
    }
}

/// The primitives of a union.
#[derive(Clone, Debug)]
pub(super) struct Parts {
    pub tree: Tree,
    pub quick: ReachTree,
    /// For each leaf of the quick tree its first block of each kind, and one more entry for the end.
    pub leaves: Vec<Leaf>,
    pub cones: Vec<ConeBlock>,
    pub faces: Vec<FaceBlock>,
    /// In leaf order, in each leaf those without faces first.
    shapes: Vec<Shape>,
    /// In the order of the shapes.
    primitives: Vec<Primitive>,
    /// Bound on the rounding error of a distance, in addition to [`ROUNDING`] times the distance.
    slack: f64,
}

/// Where each primitive is among the parts, if it has a separate part.
pub(super) struct Places([Vec<u32>; 3]);

impl Places {
    /// The place of a primitive, if it has a part.
    #[inline]
    pub fn of(&self, primitive: Primitive) -> Option<usize> {
        let (kind, id) = kind_and_id(primitive);
        self.0[kind].get(id).copied().filter(|&place| place != NONE).map(|place| place as usize)
    }
}

/// No place.
const NONE: u32 = u32::MAX;

fn kind_and_id(primitive: Primitive) -> (usize, usize) {
    match primitive {
        Primitive::Sphere(v) => (0, v as usize),
        Primitive::Edge(e) => (1, e as usize),
        Primitive::Face(f) => (2, f as usize),
    }
}

/// Where a leaf begins.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leaf {
    /// A node of the tree, to be searched in double precision, instead of blocks.
    pub cluster: Option<u32>,
    /// Place of its first shape, and of its first face.
    pub first: [u32; 2],
    pub cone: u32,
    pub face: u32,
}

impl Parts {
    /// A tree over parts, at least one; all balls are within a box.
    pub fn new(parts: Vec<Part>, balls: Bounds) -> Self {
        let boxes: Vec<_> = parts.iter().map(|part| (part.centres, part.largest_radius)).collect();
        let sides = boxes.iter().map(|(b, _)| (b.hi - b.lo).max_element());
        let padding = sides.sum::<f64>() / boxes.len() as f64;
        let tree = Tree::build(&boxes, Plan { max_leaf: LEAF, group: LANES, padding });
        let of = |place: u32| parts[tree.order()[place as usize] as usize].balls.as_slice();
        let quick = ReachTree::new(&tree, balls, of);
        let extents = boxes.iter().map(|(b, radius)| (b.hi - b.lo).length() + radius);
        let slack = ROUNDING * extents.fold(0.0, f64::max);
        let mut order = tree.order().to_vec();
        let mut this = Self {
            leaves: Vec::with_capacity(quick.wide().leaves().len() + 1),
            cones: Vec::new(),
            faces: Vec::new(),
            shapes: Vec::new(),
            primitives: Vec::new(),
            tree,
            quick,
            slack,
        };
        this.fill(&parts, &mut order);
        let in_order = || order.iter().map(|&part| &parts[part as usize]);
        this.shapes = in_order().map(|part| part.shape.clone()).collect();
        this.primitives = in_order().map(|part| part.primitive).collect();
        this
    }

    /// Makes the blocks, and brings the parts of each leaf into their order.
    fn fill(&mut self, parts: &[Part], order: &mut [u32]) {
        let frame = self.quick.wide().frame();
        for (leaf, range) in self.quick.wide().leaves().iter().enumerate() {
            let cluster = self.quick.cluster(leaf, &self.tree, LANES);
            let (cone, face) = (self.cones.len() as u32, self.faces.len() as u32);
            if cluster.is_some() {
                self.leaves.push(Leaf { cluster, first: [0; 2], cone, face });
                continue;
            }
            let here = &mut order[range.start as usize..range.end as usize];
            let is_face = |&part: &u32| matches!(parts[part as usize].shape, Shape::Slab(_));
            here.sort_by_key(is_face);
            let middle = here.partition_point(|part| !is_face(part));
            let first = [range.start, range.start + middle as u32];
            self.leaves.push(Leaf { cluster, first, cone, face });
            let (mut cones, mut faces) = (vec![], vec![]);
            for &part in &*here {
                match &parts[part as usize].shape {
                    // A cone of two equal balls is the ball.
                    Shape::Sphere(m) => cones.push(Cone::new(*m, *m)),
                    Shape::Cone(cone) => cones.push(*cone),
                    Shape::Slab(face) => faces.push(*face),
                }
            }
            self.cones.extend(cones.chunks(LANES).map(|cones| ConeBlock::new(cones, frame)));
            self.faces.extend(faces.chunks(LANES).map(|faces| FaceBlock::new(faces, frame)));
        }
        let (cone, face) = (self.cones.len() as u32, self.faces.len() as u32);
        self.leaves.push(Leaf { cluster: None, first: [0; 2], cone, face });
    }

    /// The shape at a place.
    #[inline]
    pub fn shape(&self, place: usize) -> &Shape {
        &self.shapes[place]
    }

    /// The primitive at a place.
    #[inline]
    pub fn primitive(&self, place: usize) -> Primitive {
        self.primitives[place]
    }

    /// The places of all primitives.
    pub fn places(&self) -> Places {
        let mut places: [Vec<u32>; 3] = Default::default();
        for (place, &primitive) in (0..).zip(&self.primitives) {
            let (kind, id) = kind_and_id(primitive);
            let list = &mut places[kind];
            if list.len() <= id {
                list.resize(id + 1, NONE);
            }
            list[id] = place;
        }
        Places(places)
    }

    /// All primitives that have a part of their own.
    #[cfg(test)]
    pub fn primitives(&self) -> &[Primitive] {
        &self.primitives
    }

    /// Bound on the rounding error of a distance, in addition to [`ROUNDING`] times the distance.
    #[inline]
    pub fn slack(&self) -> f64 {
        self.slack
    }
}
