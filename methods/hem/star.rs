//! The star that the survivor of a planned collapse would have, and the distance of a sample to it.
//!
//! The survivor, the *hub*, has a cone to every neighbour of either end and a slab for every face
//! of either end that does not hold both. The link vertices and the sides opposite the hub are the
//! same whichever end survives. A slab is evaluated as the part between its tangent triangles and
//! its three cones; two of them lead to the hub, the third is the *rim* over the opposite side.
//!
//! # Which primitives are skipped
//!
//! The signed distance of a point to the convex hull of balls is a maximum over directions,
//! `max_{|u|=1} p.u - max_v (c_v.u + r_v)`. So for any unit vector `u` and any threshold `T`, a
//! primitive is no nearer than `T` if each of its balls has an *excess* `(c_v - p).u + r_v <= -T`.
//! With `u` from the nearest primitive so far to the point, one pass over the link vertices excludes
//! nearly all cones and slabs without error; the others are built when first needed.

use medial::Vec3;
use medial::complex::Sphere;
use medial::complex::collapse::CollapseComplex;
use medial::geometry::{Cone, SlabFace};

use super::params::Inside;

/// Absent index.
const NONE: u32 = u32::MAX;

/// Bound on the rounding error of an excess, for coordinates of at most 1.
pub(super) const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Cones tried in the order of largest excess; the others follow in the order of the link.
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
    /// Distances to single primitives that were computed.
    pub distances: u64,
}

/// The nearest primitive of a star.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nearest {
    /// Signed distance, negative inside; with [`Inside::Surface`] the distance to the surface.
    pub signed: f64,
    /// Centre of the interpolated sphere that attains it.
    centre: Vec3,
    /// Its vertices beside the hub, in places of the link, or [`NONE`].
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
            distances: 0,
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
        let reach = |m: &Sphere| m.centre.distance(hub.centre) + m.radius;
        self.reach = self.spheres.iter().map(reach).fold(hub.radius, f64::max);
        self.hub = hub;
        // The rims do not touch the hub and stay.
        self.cones.renew(self.link.len());
        self.faces.renew(self.sides.len());
    }

    /// The nearest primitive to a sample. If its distance is at most `floor`, any primitive within
    /// `floor` may be returned: the caller needs larger distances only.
    pub(super) fn nearest(&mut self, p: Vec3, floor: f64, inside: Inside) -> Nearest {
        match inside {
            Inside::Depth => self.deepest(p, floor),
            Inside::Surface => self.nearest_surface(p, floor),
        }
    }

    /// Ids of the vertices of a primitive beside the hub; a missing one is [`u32::MAX`].
    pub(super) fn vertices(&self, nearest: &Nearest) -> [u32; 2] {
        nearest.places.map(|k| if k == NONE { NONE } else { self.link[k as usize] })
    }

    /// The primitive of least signed distance.
    fn deepest(&mut self, p: Vec3, floor: f64) -> Nearest {
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

    /// The primitive whose surface is nearest; any one within `floor` will do.
    fn nearest_surface(&mut self, p: Vec3, floor: f64) -> Nearest {
        let mut best = self.at_hub(p);
        let towards = best.towards(p);
        let signed = best.signed;
        best.signed = signed.abs();
        if best.signed <= floor || self.is_within_hub(signed, ROUNDING - best.signed) {
            return best;
        }
        let hub = self.measure_excess(p, towards);
        for k in 0..self.link.len() {
            if best.signed <= floor {
                return best;
            }
            if hub.max(self.excess[k]) > ROUNDING - best.signed {
                best.approach(self.cone(k).nearest_centre(p), [k as u32, NONE]);
            }
        }
        for f in 0..self.sides.len() {
            if best.signed <= floor {
                return best;
            }
            let [k, l] = self.sides[f];
            let rim = self.excess[k as usize].max(self.excess[l as usize]);
            if rim.max(hub) > ROUNDING - best.signed
                && let Some(found) = self.face(f).and_then(|face| face.nearest_centre(p))
            {
                best.approach(found, [k, l]);
            }
            if rim > ROUNDING - best.signed {
                best.approach(self.rim(f).nearest_centre(p), [k, l]);
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

    fn at_hub(&mut self, p: Vec3) -> Nearest {
        self.distances += 1;
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
        self.distances += 1;
        self.cones.get(k, || Cone::new(self.hub, self.spheres[k]))
    }

    fn face(&mut self, f: usize) -> Option<&SlabFace> {
        self.distances += 1;
        let [k, l] = self.sides[f];
        let spheres = || [self.hub, self.spheres[k as usize], self.spheres[l as usize]];
        self.faces.get(f, || SlabFace::new(spheres())).as_ref()
    }

    fn rim(&mut self, f: usize) -> &Cone {
        self.distances += 1;
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

    #[inline]
    fn approach(&mut self, (signed, centre): (f64, Vec3), places: [u32; 2]) {
        self.improve((signed.abs(), centre), places);
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
