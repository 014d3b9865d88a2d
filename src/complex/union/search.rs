//! Searches among the primitives of a union.

use std::marker::PhantomData;
use std::ops::Range;

use super::NearestPrimitive;
use super::parts::{LANES, Parts, ROUNDING};
use crate::Vec3;
use crate::geometry::trees::{Lanes, Measure, Node, Query, Search};

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
    /// The nearest primitive by a reading of the distance, and its place. Begins with the one at
    /// `start`.
    pub fn nearest<R: Reading>(&self, p: Vec3, start: usize) -> (NearestPrimitive, usize) {
        self.nearest_or::<R>(p, start, f64::NEG_INFINITY)
    }

    /// As [`nearest`](Self::nearest), or the first one that is met whose distance is at most `enough`.
    pub fn nearest_or<R: Reading>(
        &self,
        p: Vec3,
        start: usize,
        enough: f64,
    ) -> (NearestPrimitive, usize) {
        let mut search = Nearest::<R>::from(self, p, start, enough);
        if search.limit > f64::NEG_INFINITY {
            self.search(&mut search);
        }
        search.answer()
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

/// The distance, of two, that is minimised.
pub(super) trait Reading {
    const MEASURE: Measure;
    fn value(signed: f64) -> f64;
}

pub(super) enum Signed {}

impl Reading for Signed {
    const MEASURE: Measure = Measure::Signed;

    #[inline]
    fn value(signed: f64) -> f64 {
        signed
    }
}

pub(super) enum Unsigned {}

impl Reading for Unsigned {
    const MEASURE: Measure = Measure::Unsigned;

    #[inline]
    fn value(signed: f64) -> f64 {
        signed.abs()
    }
}

/// Search for the nearest primitive.
pub(super) struct Nearest<'a, R> {
    parts: &'a Parts,
    p: Vec3,
    place: usize,
    signed: f64,
    value: f64,
    /// A distance that ends the search.
    enough: f64,
    limit: f64,
    reading: PhantomData<R>,
}

impl<'a, R: Reading> Nearest<'a, R> {
    /// Begins with the primitive at a place.
    #[inline]
    pub fn from(parts: &'a Parts, p: Vec3, place: usize, enough: f64) -> Self {
        let signed = parts.shape(place).signed(p);
        let (value, limit) = (R::value(signed), f64::INFINITY);
        let reading = PhantomData;
        let mut search = Self { parts, p, place, signed, value, enough, limit, reading };
        search.tighten();
        search
    }

    /// The nearest primitive and its place.
    #[inline]
    pub fn answer(&self) -> (NearestPrimitive, usize) {
        let primitive = self.parts.primitive(self.place);
        (NearestPrimitive { signed: self.signed, primitive }, self.place)
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

impl<R: Reading> UnionSearch for Nearest<'_, R> {
    const MEASURE: Measure = R::MEASURE;

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
        let value = R::value(signed);
        let smaller = || self.parts.primitive(place) < self.parts.primitive(self.place);
        if value < self.value || (value == self.value && smaller()) {
            (self.place, self.signed, self.value) = (place, signed, value);
            self.tighten();
        }
    }
}

/// Search for any primitive that holds the point deeply.
pub(super) struct Buried<'a> {
    pub parts: &'a Parts,
    pub p: Vec3,
    /// Minus the depth, and minus infinity once a primitive is found.
    pub limit: f64,
    pub place: Option<usize>,
}

impl UnionSearch for Buried<'_> {
    const MEASURE: Measure = Measure::Signed;

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
        if self.parts.shape(place).signed(self.p) < self.limit {
            self.place = Some(place);
            self.limit = f64::NEG_INFINITY;
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
