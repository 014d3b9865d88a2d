//! Swaps: spheres are inserted where the error is largest, and as many edges collapsed elsewhere.
//!
//! A sphere is inserted by splitting the edge that serves the place best, with its faces, or by a cone over
//! a vertex or an edge. Both are expansions, so the homotopy type stays.

use std::collections::BTreeSet;

use medial::Vec3;
use medial::complex::{Crossings, MedialMesh, MedialUnion, Primitive, Sphere};
use medial::simplifier::RunContext;

use super::collapse::{self, Passed};
use super::descent::{Descent, LEAST_RADIUS, Objective, Rest};
use super::goal::{Edited, Goal, Kept, Points, Residuals, Row, union_of, vertices};
use super::guard::{Still, corners};
use super::part::Part;
use crate::Result;

/// Share of the largest error below which no sphere is inserted.
const SHARE: f64 = 0.5;

/// Distance of a ball's centre from the union's, in radii, below which an edge is split instead of a
/// sheet added.
const NEAR: f64 = 0.5;

/// Weight of a foot at one sphere above which it splits nothing.
const AT_END: f64 = 0.95;

/// Weight of a foot at a sphere up to which the sphere is not part of the base of a cone.
const UNUSED: f64 = 0.05;

/// Powers and steps of the spheres around insertions.
const INSERTED: [(i32, usize); 1] = [(8, 6)];
/// Powers and steps of the spheres around collapses.
const COLLAPSED: [(i32, usize); 2] = [(8, 5), (16, 5)];

/// A mesh with as many spheres, up to `each` of them at other places, the `skipped` worst of which are left
/// as they are; `None` if nothing can be inserted, or not as much be collapsed.
///
/// # Errors
/// When the run is cancelled.
pub(super) fn swapped<'a>(
    descent: &Descent<'a>,
    each: usize,
    skipped: usize,
    run: &RunContext,
) -> Result<Option<Descent<'a>>> {
    let count = descent.mesh.spheres.len();
    let Some(mut trial) = inserted(descent, each, skipped, run)? else { return Ok(None) };
    while trial.mesh.spheres.len() > count {
        run.step(0, 1)?;
        let Some(Passed { mut mesh, of }) = collapse::pass(&trial, count, true, run)? else {
            return Ok(None);
        };
        settle(&trial, &mut mesh, &of, &COLLAPSED, run)?;
        trial = trial.edited(mesh, &of)?;
    }
    // Parts of a face that crosses another one count each.
    Ok((trial.guard.crossings() <= descent.guard.crossings()).then_some(trial))
}

/// The mesh with up to `each` spheres more at the largest errors but the `skipped` first; `None` if nothing can be inserted.
///
/// # Errors
/// When the run is cancelled.
pub(super) fn inserted<'a>(
    descent: &Descent<'a>,
    each: usize,
    skipped: usize,
    run: &RunContext,
) -> Result<Option<Descent<'a>>> {
    let count = descent.mesh.spheres.len();
    let Some(mut mesh) = with_inserted(descent, each, skipped) else { return Ok(None) };
    let of: Vec<_> = (0..mesh.spheres.len()).map(|v| (v < count).then_some(v as u32)).collect();
    settle(descent, &mut mesh, &of, &INSERTED, run)?;
    Ok(Some(descent.edited(mesh, &of)?))
}

/// The same union with at least `count` spheres: new ones are in the middle of the longest edges.
pub(super) fn padded(mesh: &MedialMesh, count: usize) -> MedialMesh {
    let mut edit = Edit::new(mesh);
    while edit.spheres.len() < count {
        let length = |&[a, b]: &[u32; 2]| {
            edit.spheres[a as usize].centre.distance(edit.spheres[b as usize].centre)
        };
        let longest = edit.edges.iter().max_by(|x, y| length(x).total_cmp(&length(y)));
        match longest.copied() {
            Some([a, b]) => {
                let middle = edit.spheres[a as usize].lerp(edit.spheres[b as usize], 0.5);
                edit.split_edge([a, b], middle);
            }
            // A single sphere gets one inside of it.
            None => {
                let Sphere { centre, radius } = edit.spheres[0];
                let new = edit.push(Sphere::new(centre, 0.5 * radius));
                edit.edges.insert([0, new]);
            }
        }
    }
    edit.mesh()
}

/// The mesh with up to `count` spheres more, at the largest errors but the `skipped` first, no two at one
/// simplex.
fn with_inserted(descent: &Descent<'_>, count: usize, skipped: usize) -> Option<MedialMesh> {
    let mesh = &descent.mesh;
    let mut rows: Vec<&Row> = descent.residuals.rows.iter().collect();
    rows.sort_by(|x, y| y.error.abs().total_cmp(&x.error.abs()));
    let largest = rows.first()?.error.abs();
    let mut edit = Edit::new(mesh);
    let mut touched = vec![false; mesh.spheres.len()];
    let (mut inserted, mut left) = (0, skipped);
    for row in rows {
        if inserted == count || row.error.abs() < SHARE * largest {
            break;
        }
        let (corners, dimension) = vertices(mesh, row.primitive);
        let corners = &corners[..dimension];
        if corners.iter().any(|&v| touched[v as usize]) {
            continue;
        }
        let is_done = left > 0 || edit.insert(descent.goal, row, corners);
        if is_done {
            corners.iter().for_each(|&v| touched[v as usize] = true);
            if left > 0 { left -= 1 } else { inserted += 1 }
        }
    }
    (inserted > 0).then(|| edit.mesh())
}

/// A complex to which simplices are added.
struct Edit {
    /// The faces that were there first.
    sheets: Crossings,
    spheres: Vec<Sphere>,
    edges: BTreeSet<[u32; 2]>,
    faces: BTreeSet<[u32; 3]>,
}

impl Edit {
    fn new(mesh: &MedialMesh) -> Self {
        Self {
            sheets: Crossings::new(mesh.faces.len(), |f| corners(mesh, mesh.faces[f as usize])),
            spheres: mesh.spheres.clone(),
            edges: mesh.edges.iter().copied().collect(),
            faces: mesh.faces.iter().copied().collect(),
        }
    }

    fn mesh(self) -> MedialMesh {
        MedialMesh {
            spheres: self.spheres,
            edges: self.edges.into_iter().collect(),
            faces: self.faces.into_iter().collect(),
            contacts: None,
        }
    }

    /// Inserts a sphere at a residual, if there is a way.
    fn insert(&mut self, goal: &Goal, row: &Row, corners: &[u32]) -> bool {
        let (mut centre, mut radius) = (Vec3::ZERO, 0.0);
        for (&v, a) in corners.iter().zip(row.weights) {
            centre += a * self.spheres[v as usize].centre;
            radius += a * self.spheres[v as usize].radius;
        }
        let foot = Sphere::new(centre, radius);
        if row.covered {
            // The union holds too much here, a new sphere in it can give way.
            return self.split(row, corners, foot);
        }
        let ball = goal.ball_at(row.point);
        let apart = ball.centre.distance(foot.centre);
        if apart < NEAR * foot.radius {
            return self.split(row, corners, foot);
        }
        // A cone over the part of the simplex that serves the place.
        let mut base: Vec<u32> =
            corners.iter().zip(row.weights).filter(|&(_, a)| a > UNUSED).map(|(&v, _)| v).collect();
        if base.len() == 3 {
            // Over a whole face it would close a void: over its nearest side instead.
            let far = (0..3).min_by(|&i, &j| row.weights[i].total_cmp(&row.weights[j]));
            base.remove(far.unwrap_or(0));
        }
        if let [a, b] = *base
            && self.crosses([a, b], ball.centre)
        {
            // Over the corner alone that serves the place most.
            let [x, y] = [a, b].map(|v| {
                let own = corners.iter().zip(row.weights).find(|&(&w, _)| w == v);
                own.map_or(0.0, |(_, weight)| weight)
            });
            base.retain(|&v| v == if x < y { b } else { a });
        }
        let new = self.push(ball);
        for &v in &base {
            self.edges.insert([v, new]);
        }
        if let [a, b] = *base {
            self.faces.insert([a.min(b), a.max(b), new]);
        }
        true
    }

    /// Whether a face of an edge and a new centre would cross another one.
    fn crosses(&self, [a, b]: [u32; 2], centre: Vec3) -> bool {
        let [p, q] = [a, b].map(|v| self.spheres[v as usize].centre);
        !self.sheets.of([p, q, centre]).is_empty()
    }

    fn push(&mut self, sphere: Sphere) -> u32 {
        self.spheres.push(Sphere::new(sphere.centre, sphere.radius.max(LEAST_RADIUS)));
        self.spheres.len() as u32 - 1
    }

    /// Splits the edge of the two largest weights, with all its faces.
    fn split(&mut self, row: &Row, corners: &[u32], foot: Sphere) -> bool {
        let mut by_weight: Vec<(f64, u32)> =
            corners.iter().zip(row.weights).map(|(&v, a)| (a, v)).collect();
        by_weight.sort_by(|x, y| y.0.total_cmp(&x.0).then(x.1.cmp(&y.1)));
        let (a, b) = match row.primitive {
            Primitive::Sphere(_) => return false,
            _ => (by_weight[0].1, by_weight[1].1),
        };
        if by_weight[0].0 > AT_END {
            return false;
        }
        self.split_edge([a.min(b), a.max(b)], foot);
        true
    }

    /// Puts a sphere between the ends of an edge, and of the same side of all its faces.
    fn split_edge(&mut self, [a, b]: [u32; 2], middle: Sphere) {
        let new = self.push(middle);
        self.edges.remove(&[a, b]);
        self.edges.insert([a, new]);
        self.edges.insert([b, new]);
        let at_edge: Vec<[u32; 3]> =
            self.faces.iter().copied().filter(|f| f.contains(&a) && f.contains(&b)).collect();
        for face in at_edge {
            self.faces.remove(&face);
            let apex = face.into_iter().find(|&v| v != a && v != b).unwrap_or(a);
            self.edges.insert([apex, new]);
            self.faces.insert([a.min(apex), a.max(apex), new]);
            self.faces.insert([b.min(apex), b.max(apex), new]);
        }
    }
}

// ----------------------------------------------------------------------------
// Steps of a few spheres: those around the places where the mesh was just edited.
//
// The spheres of the places and their neighbours move, with the simplices that have one of them as a
// corner. All other simplices stay, so for each sample their distance is one number. A step costs what the
// samples around the places cost.

/// Distance from the moving part up to which samples of the rest are residuals, a fraction of the
/// diagonal.
const REACH: f64 = 0.02;

/// Moves the spheres of an edited mesh around `places`, at one power after the other, with `steps` steps each. `of` has
/// for each sphere its number in the mesh `before`; it is `None` at the places.
///
/// # Errors
/// When the run is cancelled.
pub(super) fn settle(
    before: &Descent<'_>,
    mesh: &mut MedialMesh,
    of: &[Option<u32>],
    stages: &[(i32, usize)],
    run: &RunContext,
) -> Result<()> {
    let moving = around(mesh, of);
    let part = Part::of(mesh, &moving);
    let kept = Edited { before: &before.mesh, mesh, of }.kept(&moving);
    let (points, limits) = nearby(before, &kept, &union_of(&part.mesh)?, rest_of(mesh, &moving))?;
    let share = part.mesh.spheres.len() as f64 / mesh.spheres.len() as f64;
    let is_tangled = before.guard.is_tangled();
    let still = Still { is_tangled, ..still(&part, mesh, &moving) };
    let Part { mesh: own, fixed, .. } = part;
    let around = Rest { fixed, limits, still };
    let mut descent = Descent::of_part(before.goal, points, own, around, share)?;
    for &(power, steps) in stages {
        descent.run(Objective::power(power, descent.largest()), steps, run)?;
    }
    for (&v, &sphere) in part.spheres.iter().zip(&descent.mesh.spheres) {
        mesh.spheres[v as usize] = sphere;
    }
    Ok(())
}

/// The samples that the moving part serves or may come to serve, and their distances to the rest. What served a sample
/// `before` and was `kept` is the nearest primitive of the rest.
fn nearby(
    before: &Descent<'_>,
    kept: &Kept,
    part: &MedialUnion,
    rest: Option<MedialMesh>,
) -> Result<(Points, Vec<f64>)> {
    let Descent { points: all, residuals: Residuals { nearest, .. }, .. } = before;
    let (lo, hi) = part.bounding_box();
    let is_near = |p: Vec3| (p - lo).min_element() > 0.0 && (hi - p).min_element() > 0.0;
    let outside = all.outside.iter().copied().filter(|&p| is_near(p)).collect();
    let mut points = Points { outside, ..Points::default() };
    let places: Vec<Vec3> = all.places().collect();
    let staying = nearest.iter().map(|found| kept.of(found.primitive).map(|_| found.signed));
    let staying: Vec<Option<f64>> = staying.collect();
    let within = staying.iter().map(|signed| signed.map_or(f64::NEG_INFINITY, |s| s + REACH));
    let reached = part.below_batch(&places, &within.collect::<Vec<_>>());
    let lost = places.iter().zip(&staying).filter(|(_, signed)| signed.is_none());
    let lost: Vec<Vec3> = lost.map(|(&p, _)| p).collect();
    let rest = rest.map(|rest| union_of(&rest)).transpose()?;
    let of_rest = rest.map(|rest| rest.signed_batch(&lost)).unwrap_or_default();
    let mut of_rest = of_rest.into_iter();
    let mut limits = vec![];
    for (i, signed) in staying.into_iter().enumerate() {
        if signed.is_some() && reached[i].is_none() {
            continue;
        }
        match all.samples.get(i) {
            Some(&sample) => points.samples.push(sample),
            None => points.interior.push(all.interior[i - all.samples.len()]),
        }
        limits.push(signed.or_else(|| of_rest.next()).unwrap_or(f64::INFINITY));
    }
    Ok((points, limits))
}

/// Which spheres are new or next to a new one. With their neighbours, too, the results were no better.
fn around(mesh: &MedialMesh, of: &[Option<u32>]) -> Vec<bool> {
    let own: Vec<bool> = of.iter().map(Option::is_none).collect();
    let mut reached = own.clone();
    for &[a, b] in &mesh.edges {
        reached[a as usize] |= own[b as usize];
        reached[b as usize] |= own[a as usize];
    }
    reached
}

/// The faces of the whole mesh without a moving corner, with its spheres numbered as in the part, and
/// those that are not in it after them.
fn still(part: &Part, whole: &MedialMesh, moving: &[bool]) -> Still {
    let own = part.spheres.len() as u32;
    let mut place: Vec<u32> = (0..whole.spheres.len() as u32).map(|v| own + v).collect();
    for (new, &v) in (0..).zip(&part.spheres) {
        place[v as usize] = new;
    }
    let still = whole.faces.iter().filter(|face| !face.iter().any(|&v| moving[v as usize]));
    let (faces, corners) =
        still.map(|face| (face.map(|v| place[v as usize]), corners(whole, *face))).unzip();
    Still { faces, corners, is_tangled: false }
}

/// The simplices without a moving corner, if there are any.
fn rest_of(mesh: &MedialMesh, moving: &[bool]) -> Option<MedialMesh> {
    let stays: Vec<bool> = moving.iter().map(|moves| !moves).collect();
    stays.contains(&true).then(|| mesh.induced(&stays))
}
