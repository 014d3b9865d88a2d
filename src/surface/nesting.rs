//! For each component of a surface the number of components around it.
//!
//! Component A lies in component B
//! - if the two do not meet, and B winds around a vertex of A (then around all of them);
//! - if they touch, no vertex of A is outside B, no vertex of B strictly inside A, and a vertex of
//!   A is strictly inside B. Where all vertices of A lie on B, the centres of the faces of A vote.
//!
//! Components that meet in any other way overlap, and neither lies in the other.

use std::ops::ControlFlow;

use super::inside::{Crossing, InsideTest};
use super::unit::Unit;
use crate::Vec3;

/// A closed surface in components.
pub(super) struct Parts<'a> {
    pub unit: Unit,
    /// Vertices in scaled units.
    pub points: &'a [Vec3],
    pub faces: &'a [[u32; 3]],
    /// Component of each face.
    pub component: &'a [u32],
}

/// The work for a nesting this deep would grow with the square of the number of components.
#[derive(Debug)]
pub(super) struct TooManyNested;

/// For each component the number of others it lies in. `meeting` lists the pairs of components
/// that touch or overlap, sorted.
pub(super) fn depths(
    parts: &Parts<'_>,
    first_face: &[u32],
    meeting: &[[u32; 2]],
) -> Result<Vec<usize>, TooManyNested> {
    let mut depths = vec![0; first_face.len()];
    if depths.len() > 1 {
        let mut budget = Budget { left: 30_000_000 + 100 * parts.faces.len() };
        count_separate(parts, first_face, meeting, &mut depths, &mut budget)?;
        count_touching(parts, meeting, &mut depths, &mut budget)?;
    }
    Ok(depths)
}

/// Steps of work that may still be done.
struct Budget {
    left: usize,
}

impl Budget {
    fn spend(&mut self, steps: usize) -> Result<(), TooManyNested> {
        self.left = self.left.checked_sub(steps).ok_or(TooManyNested)?;
        Ok(())
    }
}

/// Components around each one that they do not meet: one ray for each component, crossing all.
fn count_separate(
    parts: &Parts<'_>,
    first_face: &[u32],
    meeting: &[[u32; 2]],
    depths: &mut [usize],
    budget: &mut Budget,
) -> Result<(), TooManyNested> {
    let test = InsideTest::of_scaled(parts.unit, parts.points, parts.faces);
    // Winding around one point by component, and the components it was counted for.
    let mut winding = vec![0; depths.len()];
    let mut crossed = Vec::new();
    for (own, &face) in (0..).zip(first_face) {
        let point = parts.points[parts.faces[face as usize][0] as usize];
        test.crossings(point, |face, crossing| {
            // The point lies on its own component and on some that meet it; these do not count.
            if let Crossing::Above(sign) = crossing {
                let other = parts.component[face as usize];
                winding[other as usize] += sign;
                crossed.push(other);
            }
            ControlFlow::Continue(())
        });
        budget.spend(crossed.len())?;
        crossed.sort_unstable();
        crossed.dedup();
        for other in crossed.drain(..) {
            let around = std::mem::take(&mut winding[other as usize]) != 0;
            let meets = meeting.binary_search(&[own.min(other), own.max(other)]).is_ok();
            if around && other != own && !meets {
                depths[own as usize] += 1;
            }
        }
    }
    Ok(())
}

/// One component by itself.
struct Part {
    vertices: Vec<Vec3>,
    /// Of the faces, rounded.
    centres: Vec<Vec3>,
    lo: Vec3,
    hi: Vec3,
    test: InsideTest,
}

impl Part {
    fn new(parts: &Parts<'_>, faces: &[[u32; 3]]) -> Self {
        let mut corners: Vec<u32> = faces.as_flattened().to_vec();
        corners.sort_unstable();
        corners.dedup();
        let vertices: Vec<Vec3> = corners.into_iter().map(|v| parts.points[v as usize]).collect();
        let centre = |face: &[u32; 3]| {
            let [a, b, c] = face.map(|v| parts.points[v as usize]);
            0.5 * (a + 0.5 * (b + c))
        };
        let lo = vertices.iter().fold(Vec3::INFINITY, |lo, &v| lo.min(v));
        let hi = vertices.iter().fold(Vec3::NEG_INFINITY, |hi, &v| hi.max(v));
        let test = InsideTest::of_scaled(parts.unit, parts.points, faces);
        Self { vertices, centres: faces.iter().map(centre).collect(), lo, hi, test }
    }

    /// How many of the points are strictly inside, and how many outside; counts no further than
    /// to the first one outside if that `decides`.
    fn count(
        &self,
        points: &[Vec3],
        decides: bool,
        budget: &mut Budget,
    ) -> Result<(usize, usize), TooManyNested> {
        let (mut inside, mut outside) = (0, 0);
        for &point in points {
            // A query costs about as much as ten crossings.
            budget.spend(10)?;
            match self.test.winding_of_scaled(point) {
                Some(0) => outside += 1,
                Some(_) => inside += 1,
                None => {}
            }
            if decides && outside > 0 {
                break;
            }
        }
        Ok((inside, outside))
    }
}

/// Components around each one that they touch.
fn count_touching(
    parts: &Parts<'_>,
    meeting: &[[u32; 2]],
    depths: &mut [usize],
    budget: &mut Budget,
) -> Result<(), TooManyNested> {
    let mut faces: Vec<Vec<[u32; 3]>> = vec![Vec::new(); depths.len()];
    for (&face, &component) in parts.faces.iter().zip(parts.component) {
        faces[component as usize].push(face);
    }
    let mut cache: Vec<Option<Part>> = (0..depths.len()).map(|_| None).collect();
    for &[a, b] in meeting {
        for i in [a, b].map(|i| i as usize) {
            cache[i].get_or_insert_with(|| Part::new(parts, &faces[i]));
        }
        if let (Some(first), Some(second)) = (&cache[a as usize], &cache[b as usize]) {
            depths[a as usize] += usize::from(lies_in(first, second, budget)?);
            depths[b as usize] += usize::from(lies_in(second, first, budget)?);
        }
    }
    Ok(())
}

fn lies_in(inner: &Part, outer: &Part, budget: &mut Budget) -> Result<bool, TooManyNested> {
    if !(inner.lo.cmpge(outer.lo).all() && inner.hi.cmple(outer.hi).all()) {
        return Ok(false);
    }
    let (strictly, out) = outer.count(&inner.vertices, true, budget)?;
    if out > 0 || inner.count(&outer.vertices, false, budget)?.0 > 0 {
        return Ok(false);
    }
    if strictly > 0 {
        return Ok(true);
    }
    let (inside, outside) = outer.count(&inner.centres, false, budget)?;
    Ok(inside > outside)
}
