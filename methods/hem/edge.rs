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
//! - With [`Inside::Surface`], the new least distance to a surface is at least the smallest of the old
//!   one and the distances to the added primitives, whatever was removed.
//!
//! An added primitive whose balls have no excess in the direction from the old nearest primitive
//! to the witness cannot be nearer ([`super::star`]), so most are not even built.

use medial::Vec3;
use medial::complex::ZERO_LENGTH;
use medial::complex::collapse::CollapseComplex;
use medial::geometry::{Cone, SlabFace};

use super::params::Inside;
use super::samples::SampleLists;
use super::star::{Nearest, ROUNDING, Star, excess_of};

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
    fn raise(&mut self, star: &mut Star, witness: u32, p: Vec3, inside: Inside) {
        let nearest = star.nearest(p, 0.0, inside);
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
    pub inside: Inside,
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
    /// and `added` came: one link vertex stands for a cone, two for a slab and its rim. Exact errors
    /// become bounds, barred directions are to be tested again. Returns the number of distances
    /// computed.
    pub(super) fn renew(
        &mut self,
        ground: &Ground<'_>,
        ends: [u32; 2],
        gone: u32,
        added: impl Iterator<Item = [u32; 2]> + Clone,
    ) -> u64 {
        self.tested = false;
        let mut distances = 0;
        for (directed, hub) in self.into.iter_mut().zip(ends) {
            directed.state = State::AtLeast;
            distances += directed.renew(ground, hub, gone, added.clone());
        }
        distances
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
                directed.raise(star, witness, ground.samples.point(witness), ground.inside);
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
            let nearest = star.nearest(p, floor, ground.inside);
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
    ) -> u64 {
        // Inside a primitive: the depth holds as long as that primitive does, see the head.
        if self.signed < 0.0 {
            if self.nearest.contains(&gone) {
                self.signed = 0.0;
            }
            return 0;
        }
        if self.signed == 0.0 {
            return 0;
        }
        let mut tests = 0;
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
            let single = y == NONE;
            if single {
                tests += 1;
                self.lower(Cone::new(hub, m).signed_distance(p), [x, y], ground.inside);
            } else {
                tests += 2;
                if let Some(s) = SlabFace::new([hub, m, n]).and_then(|f| f.signed_distance(p)) {
                    self.lower(s, [x, y], ground.inside);
                }
                if rim > limit {
                    self.lower(Cone::new(m, n).signed_distance(p), [x, y], ground.inside);
                }
            }
            // Inside an added primitive: further ones could only hold the witness deeper.
            if self.signed <= 0.0 {
                break;
            }
        }
        tests
    }

    fn lower(&mut self, signed: f64, vertices: [u32; 2], inside: Inside) {
        let signed = if inside == Inside::Surface { signed.abs() } else { signed };
        if signed < self.signed {
            (self.signed, self.nearest) = (signed, vertices);
        }
    }
}
