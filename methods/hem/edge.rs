//! Lower bounds of the two directed contraction errors of an edge.
//!
//! The error `e(i -> j)` is the largest distance of the samples `B_i` and `B_j` to the hypothetical
//! star of `j`. The edge stores the distance of one sample, the *witness*: a lower bound. Only when
//! the edge is the cheapest one left are all samples measured ([`Edge::evaluate`]).
//!
//! # Why the bound can be updated without the whole star
//!
//! A nearby collapse removes primitives from the star and adds others. Let `s` be the least signed
//! distance of the witness.
//! - `s >= 0`: the new value is at least the smallest of `s` and the distances to added primitives.
//!   If that is negative, the witness lies inside an added primitive, at least that deep.
//! - `s < 0`: if the primitive that holds the witness is still there, the witness is at least as deep
//!   as before. Otherwise nothing is known, and the bound is 0.
//!
//! An added primitive whose balls have no excess in the direction from the old nearest primitive
//! to the witness cannot be nearer (below), so most are not even built.

use medial::Vec3;
use medial::complex::collapse::CollapseComplex;
use medial::complex::{Sphere, ZERO_LENGTH};
use medial::geometry::{Cone, SlabFace};

use super::SampleLists;

/// Absent index.
pub(super) const NONE: u32 = u32::MAX;

/// Errors below this, in units of the diagonal, are rounding and count as zero. Otherwise rounding,
/// and not the length, would order edges that cost nothing.
pub(super) const NOISE: f64 = ZERO_LENGTH;

/// One direction of an edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct Directed {
    /// The sample that gives the bound.
    pub witness: u32,
    /// Its signed distance, or a bound of smaller absolute value; 0 if nothing is known.
    signed: f64,
    /// Unit vector from the nearest primitive to it.
    towards: Vec3,
    /// The vertices of its nearest primitive, without the survivor.
    nearest: [u32; 2],
    state: State,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// The error is at least the distance of the witness.
    AtLeast,
    /// The distance of the witness is the error.
    Exact,
    /// The direction would change the homotopy type or fold a face over.
    Barred,
}

/// An edge in the queue.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edge {
    /// Into the smaller id, into the larger.
    pub into: [Directed; 2],
    /// Cost of the candidate in the queue; infinite when there is none.
    pub queued: f64,
    /// Whether both directions passed the tests, or are barred.
    pub tested: bool,
}

impl Directed {
    /// A direction without a bound, and a sample to measure first.
    pub(super) fn unknown(witness: u32) -> Self {
        Self { witness, signed: 0.0, towards: Vec3::X, nearest: [NONE; 2], state: State::AtLeast }
    }

    /// Lower bound of the error, the error itself when exact.
    pub(super) fn error(&self) -> f64 {
        match self.state {
            State::Barred => f64::INFINITY,
            _ => self.signed.abs(),
        }
    }

    /// The bound of the error, barred or not.
    #[cfg(test)]
    pub(super) fn bound(&self) -> f64 {
        self.signed.abs()
    }

    fn set(&mut self, star: &Star, witness: u32, p: Vec3, nearest: &Nearest, state: State) {
        let towards = nearest.towards(p);
        let vertices = star.vertices(nearest);
        *self = Self { witness, signed: nearest.signed, towards, nearest: vertices, state };
    }

    /// Makes a sample the witness if its distance to the gathered star is larger.
    fn raise(&mut self, star: &mut Star, witness: u32, p: Vec3) {
        let nearest = star.nearest(p, 0.0);
        if nearest.signed.abs() > self.signed.abs() {
            self.set(star, witness, p, &nearest, State::AtLeast);
        }
    }
}

/// The data that every evaluation reads.
#[derive(Clone, Copy)]
pub(super) struct Ground<'a> {
    pub complex: &'a CollapseComplex,
    pub samples: &'a SampleLists,
}

impl Edge {
    /// An edge without bounds.
    pub(super) fn unknown(witness: u32) -> Self {
        Self { into: [Directed::unknown(witness); 2], queued: f64::INFINITY, tested: false }
    }

    /// The smaller of both errors, or a lower bound of it; mere rounding counts as zero.
    pub(super) fn cost(&self) -> f64 {
        let error = self.into[0].error().min(self.into[1].error());
        if error < NOISE { 0.0 } else { error }
    }

    /// The end (0 or 1) that survives at the smaller error, if that error is exact and both directions
    /// were tested. In a tie the smaller id survives.
    pub(super) fn decided(&self) -> Option<usize> {
        let [a, b] = self.into.map(|d| d.error());
        let better = usize::from(b < a);
        (self.tested && self.into[better].state == State::Exact).then_some(better)
    }

    /// Whether no direction is left.
    pub(super) fn is_barred(&self) -> bool {
        self.into.iter().all(|d| d.state == State::Barred)
    }

    /// Whether the error of some direction is only bounded.
    pub(super) fn is_open(&self) -> bool {
        self.into.iter().any(|d| d.state == State::AtLeast)
    }

    /// Marks a direction as failing its tests, until [`Edge::renew`].
    pub(super) fn bar(&mut self, survivor: usize) {
        self.into[survivor].state = State::Barred;
    }

    /// Updates the bounds after a nearby collapse. Primitives with the vertex `gone` left the star,
    /// and `added` came: one link vertex denotes a cone, two denote a slab and its rim. Exact errors
    /// become bounds, barred directions are to be tested again.
    pub(super) fn renew(
        &mut self,
        ground: &Ground<'_>,
        ends: [u32; 2],
        gone: u32,
        added: impl Iterator<Item = [u32; 2]> + Clone,
    ) {
        self.tested = false;
        for (directed, hub) in self.into.iter_mut().zip(ends) {
            directed.state = State::AtLeast;
            directed.renew(ground, hub, gone, added.clone());
        }
    }

    /// Evaluates the directions that are only bounded: measures all samples, but stops once the error
    /// exceeds `cutoff` or the error of the other direction, and stores it as a bound.
    pub(super) fn evaluate(
        &mut self,
        ground: &Ground<'_>,
        ends: [u32; 2],
        cutoff: f64,
        star: &mut Star,
    ) {
        star.gather(ground.complex, ends);
        // The more promising direction first: its error may cut the other short.
        let first = usize::from(self.into[1].error() < self.into[0].error());
        // Up to the noise all errors have the same cost, so there is no need to stop.
        let mut limit = cutoff.max(NOISE);
        for survivor in [first, 1 - first] {
            if self.into[survivor].state != State::AtLeast {
                continue;
            }
            star.set_hub(ground.complex.sphere(ends[survivor]));
            self.into[survivor].evaluate(ground, [ends[1 - survivor], ends[survivor]], limit, star);
            if self.into[survivor].state == State::Exact {
                limit = limit.min(self.into[survivor].error());
            }
        }
    }

    /// Sets the bound of each direction from the better of two witnesses and the present star.
    pub(super) fn sound(
        &mut self,
        ground: &Ground<'_>,
        ends: [u32; 2],
        witnesses: [u32; 2],
        star: &mut Star,
    ) {
        star.gather(ground.complex, ends);
        for (directed, end) in self.into.iter_mut().zip(ends) {
            star.set_hub(ground.complex.sphere(end));
            *directed = Directed::unknown(witnesses[0]);
            for witness in witnesses.into_iter().filter(|&w| w != NONE) {
                directed.raise(star, witness, ground.samples.point(witness));
            }
        }
    }
}

impl Directed {
    fn evaluate(
        &mut self,
        ground: &Ground<'_>,
        [removed, kept]: [u32; 2],
        limit: f64,
        star: &mut Star,
    ) {
        // The old witness first: if the edge is too dear after all, it usually shows it at once.
        let first = Some(self.witness).filter(|&w| w != NONE);
        *self = Self { state: State::Exact, ..Self::unknown(NONE) };
        let [removed, kept] = [removed, kept].map(|v| ground.samples.of(v).iter().copied());
        for id in first.into_iter().chain(removed).chain(kept) {
            let p = ground.samples.point(id);
            // Only a larger distance changes the error, so the search may stop at a smaller one.
            let floor = self.error().max(NOISE);
            let nearest = star.nearest(p, floor);
            if nearest.signed.abs() > floor {
                self.set(star, id, p, &nearest, State::Exact);
                if self.error() > limit {
                    self.state = State::AtLeast;
                    return;
                }
            }
        }
    }

    /// Keeps the bound valid; see [`Edge::renew`].
    fn renew(
        &mut self,
        ground: &Ground<'_>,
        hub: u32,
        gone: u32,
        added: impl Iterator<Item = [u32; 2]>,
    ) {
        // Inside a primitive: the depth holds as long as that primitive does, see the head.
        if self.signed < 0.0 && self.nearest.contains(&gone) {
            self.signed = 0.0;
        }
        if self.signed <= 0.0 {
            return;
        }
        let p = ground.samples.point(self.witness);
        let hub = ground.complex.sphere(hub);
        let hub_excess = excess_of(&hub, p, self.towards);
        for [x, y] in added {
            // A primitive can be nearer only if one of its balls has an excess beyond this.
            let limit = ROUNDING - self.signed;
            let [m, n] = [x, y].map(|v| ground.complex.sphere(if v == NONE { x } else { v }));
            let rim = excess_of(&m, p, self.towards).max(excess_of(&n, p, self.towards));
            if rim.max(hub_excess) <= limit {
                continue;
            }
            if y == NONE {
                self.lower(Cone::new(hub, m).signed_distance(p), [x, y]);
            } else {
                if let Some(s) = SlabFace::new([hub, m, n]).and_then(|f| f.signed_distance(p)) {
                    self.lower(s, [x, y]);
                }
                if rim > limit {
                    self.lower(Cone::new(m, n).signed_distance(p), [x, y]);
                }
            }
            // Inside an added primitive: further ones could only hold the witness deeper.
            if self.signed <= 0.0 {
                break;
            }
        }
    }

    fn lower(&mut self, signed: f64, vertices: [u32; 2]) {
        if signed < self.signed {
            (self.signed, self.nearest) = (signed, vertices);
        }
    }
}

// The star that the survivor of a planned collapse would have, and the distance of a sample to it.
//
// The survivor, the *hub*, has a cone to every neighbour of either end and a slab for every face
// of either end that does not hold both. The link vertices and the sides opposite the hub are the
// same whichever end survives. A slab is evaluated as the part between its tangent triangles and
// its three cones; two of them lead to the hub, the third is the *rim* over the opposite side.
//
// # Which primitives are skipped
//
// The signed distance of a point to the convex hull of balls is a maximum over directions,
// `max_{|u|=1} p.u - max_v (c_v.u + r_v)`. So for any unit vector `u` and any threshold `T`, a
// primitive is no nearer than `T` if each of its balls has an *excess* `(c_v - p).u + r_v <= -T`.
// With `u` from the nearest primitive so far to the point, one pass over the link vertices excludes
// nearly all cones and slabs without error; the others are built when first needed.

/// Bound on the rounding error of an excess, for coordinates of at most 1.
pub(super) const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Cones tried in the order of largest excess. The others follow in the order of the link.
const ROUNDS: usize = 4;

/// Scratch for one hypothetical star after another.
pub(super) struct Star {
    /// For each vertex of the complex: the number of the last star with it, and its place in `link`.
    met: Vec<(u32, u32)>,
    star: u32,
    /// Ids of the link vertices.
    link: Vec<u32>,
    spheres: Vec<Sphere>,
    /// Pairs of places in `link`.
    sides: Vec<[u32; 2]>,
    hub: Sphere,
    /// Radius of a ball around the centre of the hub that holds all balls of the star.
    reach: f64,
    /// Excess of each link vertex.
    excess: Vec<f64>,
    /// Number of the query that last evaluated the cone to each link vertex.
    tested: Vec<u64>,
    query: u64,
    cones: Built<Cone>,
    faces: Built<Option<SlabFace>>,
    rims: Built<Cone>,
}

/// The nearest primitive of a star.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nearest {
    /// Signed distance, negative inside.
    pub signed: f64,
    /// Centre of the interpolated sphere that attains it.
    centre: Vec3,
    /// Its vertices except the hub, in places of the link, or [`NONE`].
    places: [u32; 2],
}

impl Star {
    /// Scratch for a complex with this many vertices.
    pub(super) fn new(vertices: usize) -> Self {
        Self {
            met: vec![(0, 0); vertices],
            star: 0,
            link: Vec::new(),
            spheres: Vec::new(),
            sides: Vec::new(),
            hub: Sphere::new(Vec3::ZERO, 0.0),
            reach: 0.0,
            excess: Vec::new(),
            tested: Vec::new(),
            query: 0,
            cones: Built::default(),
            faces: Built::default(),
            rims: Built::default(),
        }
    }

    /// Collects the link that either end of the edge `{a, b}` would have after its collapse.
    pub(super) fn gather(&mut self, complex: &CollapseComplex, [a, b]: [u32; 2]) {
        self.star += 1;
        self.link.clear();
        self.spheres.clear();
        self.sides.clear();
        for (end, other) in [(a, b), (b, a)] {
            for &v in complex.neighbours(end) {
                if v != other && self.met[v as usize].0 != self.star {
                    self.met[v as usize] = (self.star, self.link.len() as u32);
                    self.link.push(v);
                    self.spheres.push(complex.sphere(v));
                }
            }
        }
        for (end, other) in [(a, b), (b, a)] {
            let apart = complex.opposite_sides(end).iter().filter(|side| !side.contains(&other));
            let met = &self.met;
            self.sides.extend(apart.map(|side| side.map(|v| met[v as usize].1)));
        }
        self.excess.resize(self.link.len(), 0.0);
        self.tested.resize(self.link.len(), 0);
        self.rims.renew(self.sides.len());
    }

    /// Sets the surviving end.
    pub(super) fn set_hub(&mut self, hub: Sphere) {
        let reaches = self.spheres.iter().map(|m| m.centre.distance(hub.centre) + m.radius);
        self.reach = reaches.fold(hub.radius, f64::max);
        self.hub = hub;
        // The rims do not touch the hub and stay.
        self.cones.renew(self.link.len());
        self.faces.renew(self.sides.len());
    }

    /// Ids of the vertices of a primitive except the hub; a missing one is [`u32::MAX`].
    pub(super) fn vertices(&self, nearest: &Nearest) -> [u32; 2] {
        nearest.places.map(|k| if k == NONE { NONE } else { self.link[k as usize] })
    }

    /// The primitive of least signed distance to a sample. If that is at most `floor` in size, any primitive within
    /// `floor` may be returned: the caller needs larger distances only.
    pub(super) fn nearest(&mut self, p: Vec3, floor: f64) -> Nearest {
        // Start from the hub, which every primitive of the star but the rims contains.
        let mut best = self.at_hub(p);
        if self.is_within_hub(best.signed, limit(best.signed, floor)) {
            return best;
        }
        self.query += 1;
        let mut hub = self.measure_excess(p, best.towards(p));
        // The largest excess is usually the nearest cone, which makes the limit sharp early.
        for _ in 0..ROUNDS {
            let Some(k) = self.largest_excess(limit(best.signed, floor)) else { break };
            self.tested[k] = self.query;
            // A new direction: excesses are valid for the direction they were measured in only.
            if best.improve(self.cone(k).nearest_centre(p), [k as u32, NONE]) {
                hub = self.measure_excess(p, best.towards(p));
            }
        }
        for k in 0..self.link.len() {
            let limit = limit(best.signed, floor);
            if self.tested[k] != self.query && (hub > limit || self.excess[k] > limit) {
                best.improve(self.cone(k).nearest_centre(p), [k as u32, NONE]);
            }
        }
        for f in 0..self.sides.len() {
            let limit = limit(best.signed, floor);
            let [k, l] = self.sides[f];
            let out = self.excess[k as usize].max(self.excess[l as usize]) > limit;
            // The hub's own excess matters for the face, which has it as a corner, not for the rim.
            if (out || hub > limit)
                && let Some(found) = self.face(f).and_then(|face| face.nearest_centre(p))
            {
                best.improve(found, [k, l]);
            }
            if out {
                best.improve(self.rim(f).nearest_centre(p), [k, l]);
            }
        }
        best
    }

    /// Whether the reach alone excludes an excess beyond `limit` in the direction from the hub to a
    /// point at this signed distance. It often does in clusters of coincident spheres, whose links
    /// and samples are large.
    fn is_within_hub(&self, signed: f64, limit: f64) -> bool {
        self.reach - (self.hub.radius + signed) <= limit
    }

    fn at_hub(&self, p: Vec3) -> Nearest {
        let signed = self.hub.signed_distance(p);
        Nearest { signed, centre: self.hub.centre, places: [NONE; 2] }
    }

    /// Excess of all link vertices and of the hub in a direction.
    fn measure_excess(&mut self, p: Vec3, towards: Vec3) -> f64 {
        for (excess, m) in self.excess.iter_mut().zip(&self.spheres) {
            *excess = excess_of(m, p, towards);
        }
        excess_of(&self.hub, p, towards)
    }

    /// Of the link vertices with a cone not yet evaluated, the one of largest excess beyond `limit`.
    fn largest_excess(&self, limit: f64) -> Option<usize> {
        let (mut largest, mut place) = (limit, None);
        for (k, (&excess, &tested)) in self.excess.iter().zip(&self.tested).enumerate() {
            if excess > largest && tested != self.query {
                (largest, place) = (excess, Some(k));
            }
        }
        place
    }

    fn cone(&mut self, k: usize) -> &Cone {
        self.cones.get(k, || Cone::new(self.hub, self.spheres[k]))
    }

    fn face(&mut self, f: usize) -> Option<&SlabFace> {
        let [k, l] = self.sides[f];
        let spheres = || [self.hub, self.spheres[k as usize], self.spheres[l as usize]];
        self.faces.get(f, || SlabFace::new(spheres())).as_ref()
    }

    fn rim(&mut self, f: usize) -> &Cone {
        let [k, l] = self.sides[f];
        self.rims.get(f, || Cone::new(self.spheres[k as usize], self.spheres[l as usize]))
    }
}

/// How far a ball reaches beyond `p` in a direction.
#[inline]
pub(super) fn excess_of(m: &Sphere, p: Vec3, towards: Vec3) -> f64 {
    (m.centre - p).dot(towards) + m.radius
}

/// The excess up to which a ball can be ignored. While the best distance is within `floor`, only a
/// primitive that holds the point deeper than `floor` matters.
#[inline]
fn limit(best: f64, floor: f64) -> f64 {
    ROUNDING - if best.abs() <= floor { -floor } else { best }
}

impl Nearest {
    /// Unit vector from the centre to the point; any one if they coincide.
    pub(super) fn towards(&self, p: Vec3) -> Vec3 {
        (p - self.centre).try_normalize().unwrap_or(Vec3::X)
    }

    #[inline]
    fn improve(&mut self, (signed, centre): (f64, Vec3), places: [u32; 2]) -> bool {
        let better = signed < self.signed;
        if better {
            *self = Self { signed, centre, places };
        }
        better
    }
}

/// Values that are built when first needed, and forgotten all at once in constant time.
struct Built<T> {
    items: Vec<(u32, Option<T>)>,
    round: u32,
}

impl<T> Default for Built<T> {
    fn default() -> Self {
        Self { items: Vec::new(), round: 0 }
    }
}

impl<T> Built<T> {
    /// Forgets everything and makes room for `items`.
    fn renew(&mut self, items: usize) {
        self.round += 1;
        if self.items.len() < items {
            self.items.resize_with(items, || (0, None));
        }
    }

    #[inline]
    fn get(&mut self, index: usize, make: impl FnOnce() -> T) -> &T {
        let (round, item) = &mut self.items[index];
        // Built in an earlier round: forgotten now, not when the round began.
        if *round != self.round {
            (*round, *item) = (self.round, None);
        }
        item.get_or_insert_with(make)
    }
}
