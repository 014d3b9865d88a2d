//! The primitives of a union, in a tree, in the order in which a search meets them.
//!
//! A search tests four boxes and four primitives at a time in single precision ([`ReachTree`],
//! [`ConeBlock`], [`FaceBlock`]). This only selects: every primitive that may matter, within the error
//! bounds, is measured in double precision. A query too far away for single precision searches the
//! binary tree.

use super::Primitive;
use crate::Vec3;
use crate::geometry::trees::{Bounds, ConeBlock, FaceBlock, Plan, ReachTree, Tree};
use crate::geometry::{Cone, SlabFace, Sphere};

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
    /// where a slab leaves the answer to the cones of its sides.
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
        let radius = |(signed, centre): (f64, Vec3)| (p.distance(centre) - signed).max(0.0);
        self.nearest_centre(p).map_or(f64::INFINITY, radius)
    }
}

/// A primitive to be put in the tree.
pub(super) struct Part {
    primitive: Primitive,
    shape: Shape,
    /// Box around the centres.
    centres: Bounds,
    largest_radius: f64,
}

impl Part {
    pub fn new(primitive: Primitive, shape: Shape, balls: &[Sphere]) -> Self {
        let largest_radius = balls.iter().fold(0.0, |r, m| f64::max(r, m.radius));
        let centres = Bounds::of_points(balls.iter().map(|m| m.centre));
        Self { primitive, shape, centres, largest_radius }
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

/// Where each primitive is among the parts, if it has a part of its own.
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
        let quick = ReachTree::new(&tree, balls);
        let extent = |(b, radius): &(Bounds, f64)| (b.hi - b.lo).length() + radius;
        let slack = ROUNDING * boxes.iter().map(extent).fold(0.0, f64::max);
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
