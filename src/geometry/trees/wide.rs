//! The tree with four children per node, whose boxes are tested together in single precision.
//!
//! 1. The binary tree is collapsed: of a node's children the largest inner one is replaced by its
//!    own two until there are four (I. Wald, C. Benthin, S. Boulos, *Getting rid of packets*, 2008,
//!    doi:10.1109/RT.2008.4634620).
//! 2. Boxes are moved to the centre of the mesh, scaled by a power of two to half a side of at most
//!    1, and rounded outward to single precision. Queries are moved, scaled and rounded alike.
//! 3. A computed distance is off by at most [`BLUR`] times one plus the query's distance from the
//!    centre. Limits are enlarged by that, so nothing is skipped that double precision would visit,
//!    and results do not depend on any of this.

use std::ops::{ControlFlow, Range};

use glam::DMat3;
use wide::f32x4;

use crate::planar_frame::power_of_two_below;
use crate::trees::{Bounds, MAX_DEPTH, Tree};
use crate::{Cone, SlabFace, Sphere, Vec3};

/// Bound on the error of distances in single precision, to boxes and to triangles. The longest
/// computation, for a triangle, has less than 25 roundings of 2^-24 each.
const BLUR: f64 = 6e-6;
/// Factor by which errors of signed distances to hulls of balls, and to boxes with radii, exceed
/// [`BLUR`]: they add the rounding of a radius, which is at most the frame, and of three dot products.
const HULL_FACTOR: f64 = 2.0;
/// The error grows with the distance of the query: farther away than this, in half sides of the
/// frame, single precision would exclude too little.
const MAX_QUERY_DISTANCE: f64 = 64.0;
/// The bit that marks a child as a leaf.
const LEAF: u32 = 1 << 31;

/// Four values, one for each child.
pub type Lanes = f32x4;

#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    lo: [Lanes; 3],
    hi: [Lanes; 3],
    /// A node, or with [`LEAF`] a leaf. Lanes without a child have an empty box.
    children: [u32; 4],
}

/// A tree with four children a node.
#[derive(Clone, Debug)]
pub struct WideTree {
    nodes: Vec<Node>,
    /// Places of each leaf's items.
    leaves: Vec<Range<u32>>,
    /// For each leaf the node of the binary tree that it was.
    sources: Vec<u32>,
    root: u32,
    frame: Frame,
}

/// The similarity transform to the coordinates of single precision.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    centre: Vec3,
    /// A power of two.
    pub scale: f64,
}

impl Frame {
    fn new(Bounds { lo, hi }: Bounds) -> Self {
        let half = (hi - lo).max_element() * 0.5;
        Self { centre: lo + (hi - lo) * 0.5, scale: power_of_two_below(1.0 / half) }
    }

    /// A point in the frame.
    pub fn forward(&self, p: Vec3) -> Vec3 {
        (p - self.centre) * self.scale
    }
}

/// A query in single precision.
#[derive(Clone, Copy, Debug)]
pub struct Query {
    /// The point in the frame, each coordinate in all lanes.
    pub p: [Lanes; 3],
    scale: f64,
    /// Largest error of distances.
    blur: f64,
}

impl Query {
    /// The largest computed signed distance to a hull of balls whose true value may be `signed` or
    /// less.
    #[inline]
    pub fn signed_limit(&self, signed: f64) -> f32 {
        ((signed * self.scale + HULL_FACTOR * self.blur) as f32).next_up()
    }

    /// Largest error of coordinates in a plane.
    #[inline]
    pub fn blur(&self) -> f32 {
        self.blur as f32
    }

    /// The square of the largest computed distance whose true value may be `distance` or less.
    #[inline]
    pub fn limit(&self, distance: f64) -> f32 {
        // The factor covers the rounding of the square to single precision.
        let limit = (distance * self.scale + self.blur) * (1.0 + 1e-6);
        (limit * limit) as f32
    }
}

impl WideTree {
    /// Collapses a tree.
    pub fn new(tree: &Tree) -> Self {
        Self::within(tree, tree.bounds(), 0.0, |_| ())
    }

    /// Collapses a tree in the frame of a box around its own. Boxes no larger than `least` half
    /// sides of the frame are leaves with any content. `each` gets the children of every node, up to
    /// four, in the order of the nodes.
    pub(super) fn within(
        tree: &Tree,
        frame: Bounds,
        least: f64,
        mut each: impl FnMut(&[usize]),
    ) -> Self {
        let frame = Frame::new(frame);
        let least = least / frame.scale;
        let (nodes, leaves, sources) = (Vec::new(), Vec::new(), Vec::new());
        let mut wide = Self { nodes, leaves, sources, root: 0, frame };
        if !tree.nodes.is_empty() {
            wide.root = wide.collapse(tree, 0, least, &mut each);
        }
        wide
    }

    /// The places of each leaf's items, in leaf order.
    pub fn leaves(&self) -> &[Range<u32>] {
        &self.leaves
    }

    /// The node of the binary tree that a leaf was.
    fn source(&self, leaf: usize) -> usize {
        self.sources[leaf] as usize
    }

    pub(super) fn node(&self, place: usize) -> &Node {
        &self.nodes[place]
    }

    /// The similarity to single precision.
    pub fn frame(&self) -> &Frame {
        &self.frame
    }

    fn collapse(
        &mut self,
        tree: &Tree,
        index: usize,
        least: f64,
        each: &mut impl FnMut(&[usize]),
    ) -> u32 {
        let node = &tree.nodes[index];
        if node.count > 0 || (node.bounds.hi - node.bounds.lo).max_element() < least {
            self.leaves.push(tree.places(index));
            self.sources.push(index as u32);
            return LEAF | (self.leaves.len() - 1) as u32;
        }
        let children = descendants(tree, index);
        each(&children);
        let place = self.nodes.len();
        // The place is taken before the children's, so that parents precede them.
        let empty = Lanes::splat(f32::INFINITY);
        self.nodes.push(Node { lo: [empty; 3], hi: [-empty; 3], children: [0; 4] });
        let (mut lo, mut hi) = ([[f32::INFINITY; 4]; 3], [[f32::NEG_INFINITY; 4]; 3]);
        for (lane, &child) in children.iter().enumerate() {
            let Bounds { lo: l, hi: h } = tree.nodes[child].bounds;
            let (l, h) = (self.frame.forward(l), self.frame.forward(h));
            for axis in 0..3 {
                // Outward by one more step: the cast itself rounds to nearest.
                lo[axis][lane] = (l[axis] as f32).next_down();
                hi[axis][lane] = (h[axis] as f32).next_up();
            }
            self.nodes[place].children[lane] = self.collapse(tree, child, least, each);
        }
        self.nodes[place].lo = lo.map(Lanes::from);
        self.nodes[place].hi = hi.map(Lanes::from);
        place as u32
    }

    /// The query for a point, `None` when it is too far away, or not a number.
    #[inline]
    pub fn query(&self, p: Vec3) -> Option<Query> {
        let q = self.frame.forward(p);
        let far = q.length();
        (far <= MAX_QUERY_DISTANCE).then(|| Query {
            p: q.to_array().map(|x| Lanes::splat(x as f32)),
            scale: self.frame.scale,
            blur: BLUR * (1.0 + far),
        })
    }

    /// Shows the leaves within a limit, roughly from near to far. `visit` gets the leaf and the
    /// limit, and returns the new one. Limits are squared distances.
    #[inline]
    pub fn nearest(&self, query: &Query, limit: f32, visit: impl FnMut(usize, f32) -> f32) {
        self.search(limit, |place, _| self.nodes[place].distance_squared(query), visit);
    }

    /// Shows the leaves with points that may be nearer than `foot` to a point of the ball around a
    /// query, whose distance from the foot is `distance`, until `visit` returns false.
    ///
    /// A point `q` is nearer to some `p + v` of the ball around `p` than the foot `f` if and only if
    /// `|q - p|² - 2 r |q - f| < |f - p|²`.
    pub fn rivals(
        &self,
        query: &Query,
        foot: &Query,
        distance: f64,
        radius: f64,
        mut visit: impl FnMut(usize) -> bool,
    ) {
        let (distance, radius) = (distance * query.scale, radius * query.scale);
        // The error of a squared distance, in the whole range where boxes can be near enough, and that
        // of a distance from the foot.
        let blur =
            2.0 * query.blur * (distance + 3.0 * radius + query.blur) + 2.0 * radius * foot.blur;
        let limit = ((distance * distance + blur) * (1.0 + 1e-6)) as f32;
        let diameter = Lanes::splat((2.0 * radius) as f32);
        self.search(
            limit,
            |place, _| {
                let node = &self.nodes[place];
                node.distance_squared(query) - diameter * node.farthest_squared(foot).sqrt()
            },
            |leaf, _| if visit(leaf) { limit } else { f32::NEG_INFINITY },
        );
    }

    /// As [`WideTree::nearest`] with another measure: `bounds` gives lower bounds for the children of
    /// the node at a place, which need not be tight beyond the limit. A bound that is not a number is
    /// beyond every limit.
    #[inline]
    pub(super) fn search(
        &self,
        limit: f32,
        bounds: impl Fn(usize, Lanes) -> Lanes,
        mut visit: impl FnMut(usize, f32) -> f32,
    ) {
        // An infinite one would reach the lanes without a child.
        let mut limit = limit.min(f32::MAX);
        let mut stack = [(0.0_f32, 0_u32); 3 * MAX_DEPTH + 4];
        let mut height = 0;
        let mut current = self.root;
        loop {
            if current & LEAF == 0 {
                let limit = Lanes::splat(limit);
                let bounds = bounds(current as usize, limit);
                let children = &self.nodes[current as usize].children;
                let mut hits = bounds.simd_le(limit).to_bitmask();
                let bounds = bounds.to_array();
                let bottom = height;
                while hits != 0 {
                    let lane = hits.trailing_zeros() as usize;
                    hits &= hits - 1;
                    // Insertion sort of at most four entries, the nearest on top.
                    let entry = (bounds[lane], children[lane]);
                    let mut at = height;
                    while at > bottom && stack[at - 1].0 < entry.0 {
                        stack[at] = stack[at - 1];
                        at -= 1;
                    }
                    stack[at] = entry;
                    height += 1;
                }
            } else {
                limit = visit((current & !LEAF) as usize, limit).min(f32::MAX);
            }
            loop {
                if height == 0 {
                    return;
                }
                height -= 1;
                let (bound, next) = stack[height];
                if bound <= limit {
                    current = next;
                    break;
                }
            }
        }
    }
}

impl WideTree {
    /// Shows the leaves whose boxes, rounded outward, meet the ray from `p` in the direction of `z`.
    #[inline]
    pub fn above(&self, p: Vec3, mut visit: impl FnMut(Range<u32>) -> ControlFlow<()>) {
        // Moving, scaling and rounding keep the order of coordinates, ties included.
        let p = self.frame.forward(p).to_array().map(|x| Lanes::splat(x as f32));
        let mut stack = [self.root; 3 * MAX_DEPTH + 4];
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let current = stack[height];
            if current & LEAF != 0 {
                if visit(self.leaves[(current & !LEAF) as usize].clone()).is_break() {
                    return;
                }
                continue;
            }
            let node = &self.nodes[current as usize];
            let mut hits = node.above(&p).to_bitmask();
            // The left child on top: leaves then come roughly from below, and a search that ends at
            // the point itself ends sooner.
            while hits != 0 {
                let lane = hits.ilog2();
                stack[height] = node.children[lane as usize];
                height += 1;
                hits ^= 1 << lane;
            }
        }
    }
}

impl Node {
    #[inline]
    fn above(&self, p: &[Lanes; 3]) -> Lanes {
        self.lo[0].simd_le(p[0])
            & p[0].simd_le(self.hi[0])
            & self.lo[1].simd_le(p[1])
            & p[1].simd_le(self.hi[1])
            & p[2].simd_le(self.hi[2])
    }

    /// Squared distances from the query to the farthest corners.
    #[inline]
    pub(super) fn farthest_squared(&self, query: &Query) -> Lanes {
        let across = |k: usize| (query.p[k] - self.lo[k]).fast_max(self.hi[k] - query.p[k]);
        let [x, y, z] = [across(0), across(1), across(2)];
        x * x + y * y + z * z
    }

    #[inline]
    pub(super) fn distance_squared(&self, query: &Query) -> Lanes {
        let beyond = |k: usize| {
            let outside = (self.lo[k] - query.p[k]).fast_max(query.p[k] - self.hi[k]);
            outside.fast_max(Lanes::ZERO)
        };
        let [x, y, z] = [beyond(0), beyond(1), beyond(2)];
        x * x + y * y + z * z
    }
}

/// Up to four descendants of an inner node, from left to right.
fn descendants(tree: &Tree, index: usize) -> Vec<usize> {
    let first = tree.nodes[index].first as usize;
    let mut children = vec![first, first + 1];
    while children.len() < 4 {
        // The largest box is the likeliest to be entered, so its children spare the most steps.
        let largest = (0..children.len())
            .map(|k| (k, &tree.nodes[children[k]]))
            .filter(|(_, child)| child.count == 0)
            .map(|(k, child)| (k, child.first as usize, child.bounds.half_area(0.0)))
            .max_by(|a, b| a.2.total_cmp(&b.2));
        let Some((k, first, _)) = largest else {
            break;
        };
        children.splice(k..=k, [first, first + 1]);
    }
    children
}

// A wide tree over balls: each node has a box of centres, and the largest and the smallest radius
// below it.

/// The distance to the boundaries of hulls of balls that a search minimises.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// Negative inside.
    Signed,
    /// Its absolute value.
    Unsigned,
}

impl Measure {
    /// This measure of some signed distances.
    #[inline]
    pub fn of(self, signed: Lanes) -> Lanes {
        match self {
            Self::Signed => signed,
            Self::Unsigned => signed.abs(),
        }
    }
}

/// A tree over boxes of centres, with radii.
#[derive(Clone, Debug)]
pub struct ReachTree {
    wide: WideTree,
    /// Of each node.
    radii: Vec<Radii>,
}

/// The radii below the children of a node.
#[derive(Clone, Copy, Debug)]
struct Radii {
    largest: Lanes,
    smallest: Lanes,
    /// The radius is at most `middle + slope * (centre - middle of the box)`.
    slope: [Lanes; 3],
    middle: Lanes,
}

/// Single precision does not separate centres closer together than this, in half sides of the frame:
/// they form one leaf, in which the binary tree is searched.
const CLUSTER: f64 = 1e-5;

impl ReachTree {
    /// Collapses a tree over boxes of centres whose reaches are radii. All balls are within `frame`;
    /// `balls` gives those of the hull at a place of the tree.
    pub fn new<'a>(tree: &Tree, frame: Bounds, balls: impl Fn(u32) -> &'a [Sphere]) -> Self {
        let mut radii: Vec<[[f64; 4]; 6]> = Vec::new();
        let wide = WideTree::within(tree, frame, CLUSTER, |children: &[usize]| {
            // Lanes without a child have an empty box, so any radius will do.
            let mut of = [[0.0; 4]; 6];
            for (lane, &child) in children.iter().enumerate() {
                let node = &tree.nodes[child];
                let places = tree.places(child);
                let (slope, middle) = if places.len() > MAX_SLOPED {
                    (Vec3::ZERO, node.reach)
                } else {
                    slope(&node.bounds, || places.clone().flat_map(&balls))
                };
                let values = [node.reach, node.least_reach, middle, slope.x, slope.y, slope.z];
                for (of, value) in of.iter_mut().zip(values) {
                    of[lane] = value;
                }
            }
            radii.push(of);
        });
        let scale = wide.frame().scale;
        let scaled = radii.into_iter().map(|of| {
            let [largest, smallest, middle] =
                [0, 1, 2].map(|k| Lanes::from(of[k].map(|length| (length * scale) as f32)));
            let slope = [3, 4, 5].map(|k| Lanes::from(of[k].map(|slope| slope as f32)));
            Radii { largest, smallest, slope, middle }
        });
        Self { wide, radii: scaled.collect() }
    }

    /// The tree over the boxes alone.
    pub fn wide(&self) -> &WideTree {
        &self.wide
    }

    /// The node of the binary tree in which to search a leaf that is too narrow for single precision
    /// and has more than `max_items` primitives; `None` for every other leaf.
    pub fn cluster(&self, leaf: usize, tree: &Tree, max_items: usize) -> Option<u32> {
        let node = self.wide.source(leaf);
        let Bounds { lo, hi } = tree.nodes[node].bounds;
        let close = (hi - lo).max_element() * self.wide.frame().scale < CLUSTER;
        (close && self.wide.leaves()[leaf].len() > max_items).then_some(node as u32)
    }

    /// Shows the leaves within a limit, roughly from near to far. `visit` gets the leaf and the
    /// limit, and returns the new one. Limits are those of [`Query::signed_limit`].
    #[inline]
    pub fn search(
        &self,
        query: &Query,
        measure: Measure,
        limit: f32,
        visit: impl FnMut(usize, f32) -> f32,
    ) {
        self.wide.search(limit, |place, limit| self.bounds(place, query, measure, limit), visit);
    }

    /// Lower bounds of the distances to the hulls below the children of a node.
    #[inline]
    fn bounds(&self, place: usize, query: &Query, measure: Measure, limit: Lanes) -> Lanes {
        let (node, radii) = (self.wide.node(place), &self.radii[place]);
        let outside = node.distance_squared(query).sqrt() - radii.largest;
        let bounds = match measure {
            Measure::Signed => outside,
            // Each hull holds its largest ball, whose centre is in the box.
            Measure::Unsigned => {
                outside.fast_max(radii.smallest - node.farthest_squared(query).sqrt())
            }
        };
        if bounds.simd_le(limit).none() {
            return bounds;
        }
        // The order of visits stays that of the boxes: a search that ends early would otherwise find
        // another primitive. A lane with all bits set is not a number, and is skipped.
        bounds | node.sloped(query, radii).simd_gt(limit)
    }
}

impl Node {
    /// Lower bounds of the distances to the hulls below the children.
    ///
    /// `|p - x| - r(x)`, with `r` the linear bound of the radii, is a convex function of the centre `x`,
    /// and so at least its tangent in the middle of the box, which is least at a corner.
    #[inline]
    fn sloped(&self, query: &Query, radii: &Radii) -> Lanes {
        let half = Lanes::splat(0.5);
        let to = [0, 1, 2].map(|k| (self.lo[k] + self.hi[k]) * half - query.p[k]);
        let distance = (to[0] * to[0] + to[1] * to[1] + to[2] * to[2]).sqrt();
        let inverse = Lanes::ONE / distance.fast_max(Lanes::splat(f32::MIN_POSITIVE));
        let fall = |k: usize| {
            (to[k] * inverse - radii.slope[k]).abs() * ((self.hi[k] - self.lo[k]) * half)
        };
        distance - radii.middle - fall(0) - fall(1) - fall(2)
    }
}

/// The slope of the radii of some balls over their centres, and the least value in the middle of a
/// box such that no ball is larger.
fn slope<'a, I: Iterator<Item = &'a Sphere>>(
    bounds: &Bounds,
    balls: impl Fn() -> I,
) -> (Vec3, f64) {
    let middle = bounds.lo + (bounds.hi - bounds.lo) * 0.5;
    let count = balls().count() as f64;
    let centre = balls().map(|m| m.centre - middle).sum::<Vec3>() / count;
    let radius = balls().map(|m| m.radius).sum::<f64>() / count;
    let (mut square, mut product) = (DMat3::ZERO, Vec3::ZERO);
    for m in balls() {
        let d = m.centre - middle - centre;
        square += DMat3::from_cols(d * d.x, d * d.y, d * d.z);
        product += d * (m.radius - radius);
    }
    // Least squares, towards zero where the centres hardly differ.
    let trace = square.x_axis.x + square.y_axis.y + square.z_axis.z;
    square += DMat3::from_diagonal(Vec3::splat(RIDGE * trace));
    let fitted = square.inverse() * product;
    // Any slope bounds; a steep one is a fit to nearly coincident centres.
    let slope = if fitted.is_finite() { fitted.clamp_length_max(1.0) } else { Vec3::ZERO };
    let excess = balls().map(|m| m.radius - slope.dot(m.centre - middle));
    (slope, excess.fold(f64::NEG_INFINITY, f64::max))
}

/// Larger nodes, over which a slope would say little, have none.
const MAX_SLOPED: usize = 1000;
/// Of the variance of centres, added along each axis.
const RIDGE: f64 = 1e-4;

// Four hulls of balls measured together in single precision, to select those worth measuring in
// double precision.
//
// However steep a hull is, the error is that of the coordinates and radii: the distance is a
// minimum over interpolated spheres, so an error of the minimiser counts in second order only.

/// Up to four cones, in the [`Frame`] of a wide tree. Lanes without a cone are infinitely far.
#[derive(Clone, Copy, Debug)]
pub struct ConeBlock {
    start: [Lanes; 3],
    axis: [Lanes; 3],
    length: Lanes,
    radius: Lanes,
    slope: Lanes,
    lead: Lanes,
}

/// The values of up to four items in single precision, and `absent` for the others.
fn lanes<T>(items: &[T], absent: f32, value: impl Fn(&T) -> f64) -> Lanes {
    let of = |k: usize| items.get(k).map_or(absent, |item| value(item) as f32);
    Lanes::from([of(0), of(1), of(2), of(3)])
}

#[inline]
fn dot(u: &[Lanes; 3], v: &[Lanes; 3]) -> Lanes {
    u[0] * v[0] + u[1] * v[1] + u[2] * v[2]
}

impl ConeBlock {
    /// Up to four cones; any others are ignored.
    pub fn new(cones: &[Cone], frame: &Frame) -> Self {
        let s = frame.scale;
        Self {
            start: [0, 1, 2].map(|k| lanes(cones, 0.0, |c| frame.forward(c.start)[k])),
            axis: [0, 1, 2].map(|k| lanes(cones, 0.0, |c| c.axis[k])),
            length: lanes(cones, 0.0, |c| c.length * s),
            radius: lanes(cones, f32::NEG_INFINITY, |c| c.radius * s),
            slope: lanes(cones, 0.0, |c| c.slope),
            lead: lanes(cones, 0.0, |c| c.lead),
        }
    }

    /// The signed distances.
    #[inline]
    pub fn signed(&self, query: &Query) -> Lanes {
        let w = [0, 1, 2].map(|k| query.p[k] - self.start[k]);
        let xi = dot(&w, &self.axis);
        // Not |w|² - xi², which cancels near the axis.
        let across = [0, 1, 2].map(|k| w[k] - xi * self.axis[k]);
        let y_squared = dot(&across, &across);
        let tau = (xi + y_squared.sqrt() * self.lead).fast_max(Lanes::ZERO).fast_min(self.length);
        let off = xi - tau;
        (off * off + y_squared).sqrt() - (self.radius + tau * self.slope)
    }
}

/// Up to four faces of slabs, in the [`Frame`] of a wide tree. Lanes without a face are infinitely
/// far.
#[derive(Clone, Copy, Debug)]
pub struct FaceBlock {
    origin: [Lanes; 3],
    x: [Lanes; 3],
    y: [Lanes; 3],
    normal: [Lanes; 3],
    radius: Lanes,
    gradient: [Lanes; 2],
    lead: Lanes,
    rise: Lanes,
    /// Unit normals, inward, of the sides from the first and to the second corner of the base.
    sides: [[Lanes; 2]; 2],
    /// Distance of the origin inward from the second of them.
    offset: Lanes,
}

impl FaceBlock {
    /// Up to four faces; any others are ignored.
    pub fn new(faces: &[SlabFace], frame: &Frame) -> Self {
        let s = frame.scale;
        let inward = |run: fn(&SlabFace) -> f64, turn: f64| {
            let unit = move |f: &SlabFace| {
                let (run, height) = (run(f), f.frame.apex[1]);
                let length = run.hypot(height);
                [turn * height / length, -turn * run / length]
            };
            [0, 1].map(|k| lanes(faces, 0.0, |f| unit(f)[k]))
        };
        let left = inward(|f| f.frame.apex[0], 1.0);
        let right = inward(|f| f.frame.apex[0] - f.frame.length, -1.0);
        Self {
            origin: [0, 1, 2].map(|k| lanes(faces, 0.0, |f| frame.forward(f.frame.origin)[k])),
            x: [0, 1, 2].map(|k| lanes(faces, 0.0, |f| f.frame.x[k])),
            y: [0, 1, 2].map(|k| lanes(faces, 0.0, |f| f.frame.y[k])),
            normal: [0, 1, 2].map(|k| lanes(faces, 0.0, |f| f.frame.normal[k])),
            radius: lanes(faces, f32::NEG_INFINITY, |f| f.radius * s),
            gradient: [0, 1].map(|k| lanes(faces, 0.0, |f| f.gradient[k])),
            lead: lanes(faces, 0.0, |f| f.lead),
            rise: lanes(faces, 0.0, |f| 1.0 / f.lead),
            sides: [left, right],
            offset: lanes(faces, 0.0, |f| {
                let [cx, cy] = f.frame.apex;
                f.frame.length * s * (cy / (cx - f.frame.length).hypot(cy))
            }),
        }
    }

    /// The signed distances; infinite where the face certainly has none and the cones of its sides
    /// decide.
    #[inline]
    pub fn signed(&self, query: &Query) -> Lanes {
        let w = [0, 1, 2].map(|k| query.p[k] - self.origin[k]);
        let (x, y) = (dot(&w, &self.x), dot(&w, &self.y));
        let height = dot(&w, &self.normal).abs();
        let [gx, gy] = self.gradient;
        let ahead = height * self.lead;
        let (cx, cy) = (x + ahead * gx, y + ahead * gy);
        // On a steep face the best centre is far from the foot of the query, and its error grows with
        // that distance.
        let blur = Lanes::splat(query.blur()) * (Lanes::ONE + self.lead + ahead);
        let [left, right] = &self.sides;
        let least = cy
            .fast_min(left[0] * cx + left[1] * cy)
            .fast_min(right[0] * cx + right[1] * cy + self.offset);
        let outside = least.simd_lt(-blur);
        // In closed form: the distance to the best centre minus the radius there.
        let signed = height * self.rise - (self.radius + gx * x + gy * y);
        outside.bitselect(Lanes::splat(f32::INFINITY), signed)
    }
}
