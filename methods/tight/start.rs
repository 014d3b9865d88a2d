//! The medial mesh that everything starts from.

use std::collections::BTreeSet;
use std::sync::Arc;

use medial::Vec3;
use medial::complex::collapse::CollapseComplex;
use medial::complex::{Crossings, MedialMesh, Primitive, Sphere, betti, faces_cross};
use medial::geometry::trees::Bounds;
use medial::metrics::topology_warning;
use medial::shape::Shape;
use medial::simplifier::{Diagnostics, Level, MedialSimplifier, Params, RunContext};
use medial::surface::Sampling;

use super::collapse::{Passed, settle};
use super::goal::{Goal, Row, vertices};
use super::rounds::{Descent, LEAST_RADIUS};
use super::{MANY, TightParams, collapse};
use crate::Result;

/// The start has this many times the target, but no more than so many for this reason: with three times 500 spheres the
/// mean error was a seventh larger.
const ENOUGH: usize = 5;
const MOST_NEEDED: usize = 2_500;

/// Samples of a surface that crosses itself, which has no conforming triangulation.
const OF_CROSSING: usize = 20_000;

/// A start: the initial medial mesh of a shape, with a method that simplifies it.
pub(super) struct Start {
    shape: Shape,
    starter: Arc<dyn MedialSimplifier>,
    least: usize,
    betti: [u64; 3],
}

impl Start {
    /// Adds samples to a coarse surface.
    ///
    /// # Errors
    /// When the samples do not span space, or the given mesh has no sphere.
    pub fn new(
        shape: &Shape,
        starter: Arc<dyn MedialSimplifier>,
        params: &TightParams,
    ) -> Result<Self> {
        // Built here, so that they count as substrates of the shape.
        shape.surface_tree()?;
        shape.inside_test();
        let finer = match shape.options().sampling {
            _ if shape.has_given_initial() => None,
            Sampling::Conforming { least } => {
                let samples = shape.mesh().vertices.len().max(least);
                (samples < params.samples).then_some(Sampling::Conforming { least: params.samples })
            }
            _ => None,
        };
        let mut shape = finer.map_or_else(|| shape.clone(), |finer| shape.resampled(finer));
        let mut initial = shape.initial()?;
        if shape.sampling_warning().is_some() {
            shape = shape.resampled(Sampling::BlueNoise { count: OF_CROSSING, seed: 0 });
            initial = shape.initial()?;
        }
        Ok(Self { betti: betti(&initial), shape, starter, least: params.start })
    }

    /// Adds its warnings and counts.
    pub fn describe(&self, diagnostics: &mut Diagnostics) {
        diagnostics.count("samples_of_the_start", self.shape.samples().len());
        if let Some(warning) = topology_warning(self.betti, self.shape.expected_betti()) {
            diagnostics.warn(format!("the start is wrong, and so is the result: {warning}"));
        }
    }

    /// The start for a number of spheres.
    ///
    /// # Errors
    /// Those of the other method.
    pub fn mesh(
        &self,
        count: usize,
        run: &RunContext,
        diagnostics: &mut Diagnostics,
    ) -> Result<MedialMesh> {
        let [few, many] = [MANY, ENOUGH].map(|times| times.saturating_mul(count));
        let wanted = self.least.max(few).max(many.min(MOST_NEEDED));
        let enough = if self.shape.has_given_initial() { count } else { wanted };
        self.simplified(wanted, enough, run, diagnostics)
    }

    /// A start of `wanted` spheres, or the initial medial mesh if it has at most `enough`.
    ///
    /// # Errors
    /// Those of the other method.
    pub fn simplified(
        &self,
        wanted: usize,
        enough: usize,
        run: &RunContext,
        diagnostics: &mut Diagnostics,
    ) -> Result<MedialMesh> {
        let initial = self.shape.initial()?;
        let mesh = if initial.spheres.len() <= enough {
            MedialMesh::clone(&initial)
        } else {
            let mut levels = self.starter.prepare(&self.shape, &Params::none(), run)?;
            let found = levels.at(Level::Spheres(wanted))?;
            // More spheres are left than wanted where nothing more can be collapsed.
            if found.mesh.spheres.len() > wanted {
                found
                    .diagnostics
                    .warnings
                    .into_iter()
                    .for_each(|warning| diagnostics.warn(warning));
            }
            found.mesh
        };
        Ok(MedialMesh { contacts: None, ..mesh })
    }
}

// ----------------------------------------------------------------------------
// Which faces of a medial mesh cross, and which a collapse would make cross.
//
// A pair that crosses already may stay crossed: its image under the collapse is known. Any other pair is a
// reason against the collapse.

type Face = [u32; 3];

/// The faces of a complex that shrinks during a pass.
pub(super) struct Sheets<'a> {
    mesh: &'a MedialMesh,
    /// The faces as they were when the pass began.
    first: Crossings,
    /// Pairs that cross, by the vertices that they have now.
    known: Vec<[Face; 2]>,
    /// Faces that collapses moved.
    moved: Vec<Face>,
    /// Spheres that collapses moved or took away.
    is_moved: Vec<bool>,
    /// Whether anything is refused.
    is_strict: bool,
}

impl<'a> Sheets<'a> {
    pub fn new(mesh: &'a MedialMesh, is_strict: bool) -> Self {
        let first = Crossings::new(mesh.faces.len(), |f| corners(mesh, mesh.faces[f as usize]));
        let pairs = first.pairs().into_iter();
        let known = pairs.map(|pair| pair.map(|f| mesh.faces[f as usize])).collect();
        let is_moved = vec![false; mesh.spheres.len()];
        Self { mesh, first, known, moved: vec![], is_moved, is_strict }
    }

    /// Whether a face would fold over if the ends of an edge were merged at a place.
    pub fn would_fold(&self, complex: &CollapseComplex, [a, b]: [u32; 2], at: Sphere) -> bool {
        self.is_strict && complex.folded_face(a, b, at.centre).is_some()
    }

    /// Whether the faces around an edge would cross others, or each other, if its ends were merged at a place.
    pub fn would_cross(&self, complex: &CollapseComplex, [a, b]: [u32; 2], at: Sphere) -> bool {
        if !self.is_strict {
            return false;
        }
        let place = |v: u32| if v == a { at.centre } else { complex.sphere(v).centre };
        let star = star(complex, [a, b]);
        let is_star = |face: &Face| face.contains(&a) || face.contains(&b);
        star.iter().enumerate().any(|(i, &face)| {
            let own = face.map(place);
            let crosses = |other: Face, corners: [Vec3; 3]| {
                faces_cross(own, corners) && !self.is_known([a, b], face, other)
            };
            let still = self.first.of(own).into_iter().map(|f| self.mesh.faces[f as usize]);
            let still = still.filter(|other| !other.iter().any(|&v| self.is_moved[v as usize]));
            if still.filter(|other| !is_star(other)).any(|f| !self.is_known([a, b], face, f)) {
                return true;
            }
            let bounds = Bounds::of_points(own);
            let moved = self.moved.iter().filter(|other| !is_star(other));
            let mut moved = moved.map(|&other| (other, other.map(place)));
            let mut star = star[i + 1..].iter().map(|&other| (other, other.map(place)));
            moved.any(|(other, corners)| {
                let [p, q, r] = other;
                bounds.overlaps(&Bounds::of_points(corners))
                    && complex.has_face(p, q, r)
                    && crosses(other, corners)
            }) || star.any(|(other, corners)| crosses(other, corners))
        })
    }

    /// Takes note of a collapse before it is made.
    pub fn collapse(&mut self, complex: &CollapseComplex, [a, b]: [u32; 2]) {
        self.moved.extend(star(complex, [a, b]));
        (self.is_moved[a as usize], self.is_moved[b as usize]) = (true, true);
        for face in self.known.iter_mut().flatten() {
            face.iter_mut().filter(|v| **v == b).for_each(|v| *v = a);
            face.sort_unstable();
        }
    }

    /// Whether a pair of faces, or two that the collapse of an edge maps to them, cross already.
    fn is_known(&self, [a, b]: [u32; 2], face: Face, other: Face) -> bool {
        let pair = [face, other];
        self.known.iter().any(|known| {
            let [f, g] = known.map(|mut face| {
                face.iter_mut().filter(|v| **v == b).for_each(|v| *v = a);
                face.sort_unstable();
                face
            });
            pair == [f, g] || pair == [g, f]
        })
    }
}

/// The faces around an edge once it is collapsed to its first end.
fn star(complex: &CollapseComplex, [a, b]: [u32; 2]) -> Vec<Face> {
    let sides = complex.opposite_sides(a).iter().chain(complex.opposite_sides(b));
    let sides = sides.filter(|side| !side.contains(&a) && !side.contains(&b));
    let mut faces: Vec<Face> = sides
        .map(|&[p, q]| {
            let mut face = [a, p, q];
            face.sort_unstable();
            face
        })
        .collect();
    faces.sort_unstable();
    faces.dedup();
    faces
}

/// The centres of a face.
pub(super) fn corners(mesh: &MedialMesh, face: Face) -> [Vec3; 3] {
    face.map(|v| mesh.spheres[v as usize].centre)
}

// ----------------------------------------------------------------------------
// Swaps: spheres are inserted where the error is largest, and as many edges collapsed elsewhere.
//
// A sphere is inserted by splitting the edge that serves the place best, with its faces, or by a cone over
// a vertex or an edge. Both are expansions, so the homotopy type stays.

/// Errors below this share of the largest are no reason to insert a sphere.
const SHARE: f64 = 0.5;

/// A ball whose centre is nearer to the union's than this share of the radius needs no new sheet.
const NEAR: f64 = 0.5;

/// A foot with a larger weight at one sphere splits nothing.
const AT_END: f64 = 0.95;

/// A foot with a smaller weight at one sphere does not use it.
const UNUSED: f64 = 0.05;

/// Powers and steps around insertions, and around collapses.
const INSERTED: [(i32, usize); 1] = [(8, 6)];
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
    let Some(mut mesh) = with_inserted(descent, each, skipped) else { return Ok(None) };
    let of: Vec<_> = (0..mesh.spheres.len()).map(|v| (v < count).then_some(v as u32)).collect();
    settle(descent, &mut mesh, &of, &INSERTED, run)?;
    let mut trial = descent.edited(mesh, &of)?;
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
