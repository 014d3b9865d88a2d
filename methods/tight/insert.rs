//! Swaps: spheres are inserted where the error is largest, and as many edges collapsed elsewhere.
//!
//! A sphere is inserted by splitting the edge that serves the place best, with its faces, or by a cone over
//! a vertex or an edge. Both are expansions, so the homotopy type stays.

use std::collections::BTreeSet;

use medial::Vec3;
use medial::complex::{Crossings, MedialMesh, Primitive, Sphere, crossing_faces};
use medial::simplifier::{RunContext, SimplifyError};

use super::collapse::{self, Passed};
use super::descent::{Descent, LEAST_RADIUS};
use super::goal::Goal;
use super::patch::Patch;
use super::rows::{Row, vertices};
use super::sheets::corners as corners_of;

/// Errors below this share of the largest are no reason to insert a sphere.
const SHARE: f64 = 0.5;

/// A ball whose centre is nearer to the union's than this share of the radius needs no new sheet.
const NEAR: f64 = 0.5;

/// A foot with a larger weight at one sphere splits nothing.
const AT_END: f64 = 0.95;

/// A foot with a smaller weight at one sphere does not use it.
const UNUSED: f64 = 0.05;

/// Powers and steps around what was inserted, and around what was collapsed.
const INSERTED: [(f64, usize); 1] = [(8.0, 6)];
const COLLAPSED: [(f64, usize); 2] = [(8.0, 5), (16.0, 5)];

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
) -> Result<Option<Descent<'a>>, SimplifyError> {
    let count = descent.mesh.spheres.len();
    let crossing = crossing_faces(&descent.mesh).len();
    let Some(mut mesh) = with_inserted(descent, each, skipped) else { return Ok(None) };
    let patch = Patch { goal: descent.goal, points: &descent.points };
    let new: Vec<u32> = (count as u32..mesh.spheres.len() as u32).collect();
    patch.settle(&mut mesh, &new, &INSERTED, run)?;
    let mut trial = Descent::new(descent.goal, descent.points.clone(), mesh)?;
    while trial.mesh.spheres.len() > count {
        run.step(0, 1)?;
        let Some(Passed { mut mesh, merged }) = collapse::pass(&trial, count, true) else {
            return Ok(None);
        };
        patch.settle(&mut mesh, &merged, &COLLAPSED, run)?;
        trial = Descent::new(trial.goal, trial.points, mesh)?;
    }
    // Parts of a face that crosses another one count each.
    Ok((crossing_faces(&trial.mesh).len() <= crossing).then_some(trial))
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
            sheets: Crossings::new(mesh.faces.clone(), |f| {
                corners_of(mesh, mesh.faces[f as usize])
            }),
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
            let weight = |v: u32| corners.iter().zip(row.weights).find(|&(&w, _)| w == v);
            let [x, y] = [a, b].map(|v| weight(v).map_or(0.0, |(_, weight)| weight));
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
        let new = self.spheres.len() as u32;
        !self.sheets.of([a, b, new], [p, q, centre]).is_empty()
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
        let (a, b) = (a.min(b), a.max(b));
        if by_weight[0].0 > AT_END {
            return false;
        }
        let new = self.push(foot);
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
        true
    }
}
