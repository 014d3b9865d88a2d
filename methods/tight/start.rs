//! The medial mesh that everything starts from.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use medial::Vec3;
use medial::complex::collapse::CollapseComplex;
use medial::complex::{Crossings, MedialMesh, Primitive, Sphere, betti, crossing_faces};
use medial::geometry::trees::{Bounds, PointTree};
use medial::geometry::{DisjointSets, triangles_meet};
use medial::metrics::topology_warning;
use medial::shape::Shape;
use medial::simplifier::{Diagnostics, Level, MedialSimplifier, Params, RunContext};
use medial::surface::{Sampling, Side};

use super::collapse::{Passed, Patch};
use super::goal::{Goal, Row, vertices};
use super::rounds::{Descent, LEAST_RADIUS};
use super::{MANY, TightParams, collapse};
use crate::Result;

/// Times that the samples are doubled at most.
const DOUBLINGS: usize = 2;

/// Components that are joined at most, and points between two spheres that must be inside for that.
const JOINED: usize = 64;
const BETWEEN: usize = 16;

/// A start: the given medial mesh of a shape, or one of denser samples with a method that simplifies it.
pub(super) struct Start {
    shape: Shape,
    starter: Arc<dyn MedialSimplifier>,
    least: usize,
    is_given: bool,
    samples: usize,
    joined: usize,
    betti: [u64; 3],
}

impl Start {
    /// Samples the surface until the Betti numbers of the medial mesh are right.
    ///
    /// # Errors
    /// When the samples do not span space, or the given mesh has no sphere.
    pub fn new(
        shape: &Shape,
        starter: Arc<dyn MedialSimplifier>,
        params: &TightParams,
        run: &RunContext,
    ) -> Result<Self> {
        // Built here, so that they count as substrates of the shape.
        shape.surface_tree()?;
        shape.inside_test();
        let least = params.start;
        if shape.has_given_initial() {
            let initial = shape.initial()?;
            let betti = betti(&initial);
            let shape = shape.starting_from(initial)?;
            return Ok(Self {
                shape,
                starter,
                least,
                is_given: true,
                samples: 0,
                joined: 0,
                betti,
            });
        }
        let expected = shape.expected_betti();
        let mut best: Option<(u64, Self)> = None;
        for doubling in 0..=DOUBLINGS {
            run.step(doubling, DOUBLINGS + 1)?;
            let samples = params.samples << doubling;
            let fine = shape.resampled(Sampling::BlueNoise { count: samples, seed: run.seed });
            let mut mesh = MedialMesh::clone(fine.initial()?.as_ref());
            let joined = joined(&mut mesh, shape, expected.map_or(u64::MAX, |[parts, ..]| parts));
            let betti = betti(&mesh);
            let fine = if joined > 0 { fine.starting_from(Arc::new(mesh))? } else { fine };
            let wrong = expected.map_or(0, |expected| {
                expected.iter().zip(betti).map(|(&expected, found)| expected.abs_diff(found)).sum()
            });
            // More samples can make it worse: the least wrong is kept, of equal ones the first.
            if best.as_ref().is_none_or(|(least, _)| wrong < *least) {
                let starter = Arc::clone(&starter);
                let start =
                    Self { shape: fine, starter, least, is_given: false, samples, joined, betti };
                best = Some((wrong, start));
            }
            if wrong == 0 {
                break;
            }
        }
        let (_, start) = best.expect("there is a first one");
        Ok(start)
    }

    /// Adds its warnings and counts.
    pub fn describe(&self, diagnostics: &mut Diagnostics) {
        diagnostics.count("samples_of_the_start", self.samples);
        if self.joined > 0 {
            diagnostics.count("components_joined", self.joined);
        }
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
        let initial = self.shape.initial()?;
        let wanted = self.least.max(MANY.saturating_mul(count));
        let mesh = if initial.spheres.len() <= if self.is_given { count } else { wanted } {
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

/// Joins components by edges inside the solid until `parts` are left, the smallest one to the part closest to it.
/// Where the solid is thinner than the samples are apart, its medial mesh can fall into pieces. Returns how many
/// edges were added.
pub(super) fn joined(mesh: &mut MedialMesh, shape: &Shape, parts: u64) -> usize {
    let mut sets = DisjointSets::singletons(mesh.spheres.len());
    mesh.edges.iter().for_each(|&[a, b]| {
        sets.join(a, b);
    });
    let extra = sets.len().saturating_sub(usize::try_from(parts).unwrap_or(usize::MAX));
    if extra == 0 || extra > JOINED {
        return 0;
    }
    let mut stuck = BTreeSet::new();
    let mut joined = 0;
    while joined < extra {
        let mut members: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        (0..mesh.spheres.len() as u32)
            .for_each(|v| members.entry(sets.find(v)).or_default().push(v));
        // One whose shortest bridge leaves the solid is passed over, or the loop would not end.
        let left = members.iter().filter(|(set, _)| !stuck.contains(*set));
        let Some((&set, own)) = left.min_by_key(|(_, own)| own.len()) else { break };
        match bridge(mesh, shape, own) {
            Some([a, b]) => {
                mesh.edges.push([a.min(b), a.max(b)]);
                sets.join(a, b);
                joined += 1;
            }
            None => {
                stuck.insert(set);
            }
        }
    }
    // Edges of a medial mesh ascend.
    mesh.edges.sort_unstable();
    joined
}

/// The shortest edge from some spheres to any other one, if it is inside the solid.
fn bridge(mesh: &MedialMesh, shape: &Shape, own: &[u32]) -> Option<[u32; 2]> {
    let centres: Vec<Vec3> = mesh.spheres.iter().map(|sphere| sphere.centre).collect();
    let is_own: BTreeSet<u32> = own.iter().copied().collect();
    let others: Vec<u32> = (0..mesh.spheres.len() as u32).filter(|v| !is_own.contains(v)).collect();
    let tree = PointTree::new(&others.iter().map(|&v| centres[v as usize]).collect::<Vec<_>>());
    let nearest = own.iter().filter_map(|&v| {
        let (place, squared) = tree.nearest(centres[v as usize])?;
        Some((squared, [v, others[place as usize]]))
    });
    let (_, [a, b]) = nearest.min_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)))?;
    let [from, to] = [a, b].map(|v| centres[v as usize]);
    let between = (1..BETWEEN).map(|k| from.lerp(to, k as f64 / BETWEEN as f64));
    let sides = shape.inside_test().sides(&between.collect::<Vec<_>>());
    sides.iter().all(|&side| side == Side::Inside).then_some([a, b])
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
}

impl<'a> Sheets<'a> {
    pub fn new(mesh: &'a MedialMesh) -> Self {
        let first = Crossings::new(mesh.faces.clone(), |f| corners(mesh, mesh.faces[f as usize]));
        let pairs = first.pairs().into_iter();
        let known = pairs.map(|pair| pair.map(|f| mesh.faces[f as usize])).collect();
        Self { mesh, first, known, moved: vec![], is_moved: vec![false; mesh.spheres.len()] }
    }

    /// Whether the faces around an edge would cross others, or each other, if its ends were merged at a place.
    pub fn would_cross(&self, complex: &CollapseComplex, [a, b]: [u32; 2], at: Sphere) -> bool {
        let place = |v: u32| if v == a { at.centre } else { complex.sphere(v).centre };
        let star = star(complex, [a, b]);
        let is_star = |face: &Face| face.contains(&a) || face.contains(&b);
        star.iter().enumerate().any(|(i, &face)| {
            let own = face.map(place);
            let crosses = |other: Face, corners: [Vec3; 3]| {
                triangles_meet(face, own, other, corners) && !self.is_known([a, b], face, other)
            };
            let still = self.first.of(face, own).into_iter().map(|f| self.mesh.faces[f as usize]);
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
) -> Result<Option<Descent<'a>>> {
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
            sheets: Crossings::new(mesh.faces.clone(), |f| corners(mesh, mesh.faces[f as usize])),
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
