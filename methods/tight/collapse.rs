//! Passes of collapses of the edges that the samples around them miss least.
//!
//! The price of an edge is the change of `sum w e^8` over the samples that the primitives around it serve, plus the
//! protrusion of the new primitives, for the best of four places of the merged sphere: both ends, the midpoint, and
//! the minimiser of the two spheres' squares. Eighth powers, because one sample that is missed badly decides the
//! maximum, and no later step repairs a face across a hole.
//!
//! Samples see the new star and its rim alone. Samples that another primitive would serve better count too much,
//! never too little.

use std::collections::BTreeSet;

use medial::Vec3;
use medial::complex::collapse::{CollapseComplex, folds_over};
use medial::complex::{Crossings, Incidence, MedialMesh, MedialUnion, Primitive, Sphere};
use medial::geometry::{Cone, SlabFace};
use medial::simplifier::RunContext;
use rayon::prelude::*;

use super::goal::{Edited, Goal, Kept, Points, Residuals, uncovered, union_of, vertices};
use super::rounds::{
    Block, Descent, LEAST_RADIUS, Objective, Rest, add_product, backward, cholesky, forward,
};
use super::start::{Sheets, corners};
use crate::Result;

/// Exponent of the price.
const POWER: i32 = 8;

/// Weight of a point of a primitive that protrudes. Each represents several samples.
const PROTRUDING: f64 = 50.0;

/// The protrusion of one ball counts from this share on.
const NEGLIGIBLE: f64 = 1e-4;

/// Share of the trace that pulls a minimiser towards the midpoint of its edge.
const PULL: f64 = 1e-3;

/// One of this number of samples is looked at first.
const ROUGH: usize = 8;

/// Edges that are priced before the limit is updated, at least.
const BLOCK: usize = 16;

/// Distance between points of a new star at which it is tested for protruding.
const SPACING: f64 = 0.02;

/// An edge with the place of its merged sphere.
#[derive(Clone, Copy, Debug)]
struct Priced {
    ends: [u32; 2],
    sphere: Sphere,
    price: f64,
}

/// A sample as a collapse sees it.
#[derive(Clone, Copy, Debug)]
struct Served {
    point: Vec3,
    weight: f64,
    /// Counted depth of an interior point, negative for a sample of the surface.
    depth: f64,
    /// Its error to [`POWER`] as it is now.
    now: f64,
}

impl Served {
    fn error(&self, signed: f64) -> f64 {
        if self.depth < 0.0 { signed.abs() } else { uncovered(self.depth, signed) }
    }
}

/// A mesh after a pass.
pub(super) struct Passed {
    pub mesh: MedialMesh,
    /// For each sphere the one before; `None` for those that were merged.
    pub of: Vec<Option<u32>>,
}

/// Collapses the cheapest edges that have no end in common, until `target` spheres are left; `None` if no
/// collapse is possible.
///
/// A `careful` pass looks at little more than the edges that it needs, and leaves the rest to the next one,
/// which prices them again. Where each collapse would fold a face or make faces cross the cheapest of these are made.
///
/// # Errors
/// When the run is cancelled.
pub(super) fn pass(
    descent: &Descent<'_>,
    target: usize,
    careful: bool,
    run: &RunContext,
) -> Result<Option<Passed>> {
    if !descent.guard.is_tangled()
        && let Some(strict) = passed(descent, target, careful, true, run)?
    {
        return Ok(Some(strict));
    }
    passed(descent, target, careful, false, run)
}

fn passed(
    descent: &Descent<'_>,
    target: usize,
    careful: bool,
    strict: bool,
    run: &RunContext,
) -> Result<Option<Passed>> {
    let mesh = &descent.mesh;
    let mut complex = CollapseComplex::from_mesh(mesh);
    let stars = Stars::new(descent);
    let needed = mesh.spheres.len() - target;
    let wanted = if careful { needed * 3 / 2 + 1 } else { mesh.edges.len() };
    let mut merged = vec![false; mesh.spheres.len()];
    let mut sheets = Sheets::new(mesh, strict);
    let priced = stars.cheapest(&complex, &sheets, descent.goal, wanted, run)?;
    let Some(last) = priced.last() else { return Ok(None) };
    let dearest = last.price.max(0.0);
    for Priced { ends: [a, b], sphere, .. } in priced {
        if complex.sphere_count() <= target {
            break;
        }
        // The price of an edge of a merged sphere is out of date. Those of its neighbours' edges are less so,
        // and passes that kept whole neighbourhoods apart ran out of cheap edges. What a neighbour's collapse
        // can make wrong is tested again.
        if merged[a as usize]
            || merged[b as usize]
            || !complex.keeps_homotopy(a, b)
            || sheets.would_fold(&complex, [a, b], sphere)
            || sheets.would_cross(&complex, [a, b], sphere)
        {
            continue;
        }
        let mut around = complex.neighbours(a).iter().chain(complex.neighbours(b));
        if around.any(|&v| merged[v as usize])
            && Ring::new(&complex, [a, b]).protrusion(sphere, descent.goal, dearest, dearest)
                > dearest
        {
            continue;
        }
        (merged[a as usize], merged[b as usize]) = (true, true);
        sheets.collapse(&complex, [a, b]);
        complex.collapse(a, b, sphere);
    }
    // The mesh numbers the spheres that are left in their order.
    let of = complex.vertices().map(|v| (!merged[v as usize]).then_some(v));
    let of: Vec<Option<u32>> = of.collect();
    Ok((complex.sphere_count() < mesh.spheres.len())
        .then(|| Passed { mesh: complex.to_mesh(), of }))
}

/// The samples that each simplex serves, and each sphere's share of the squares.
struct Stars<'a> {
    mesh: &'a MedialMesh,
    of_sphere: Vec<Vec<Served>>,
    of_edge: Vec<Vec<Served>>,
    of_face: Vec<Vec<Served>>,
    /// For each sphere its edges and faces.
    edges: Vec<Vec<u32>>,
    faces: Vec<Vec<u32>>,
    blocks: Vec<Block>,
    downhill: Vec<[f64; 4]>,
    /// For each edge the part of the squares that both ends share.
    shared: Vec<Block>,
}

impl<'a> Stars<'a> {
    fn new(descent: &'a Descent<'_>) -> Self {
        let Descent { mesh, points, residuals, .. } = descent;
        let spheres = mesh.spheres.len();
        let mut this = Self {
            mesh,
            of_sphere: vec![vec![]; spheres],
            of_edge: vec![vec![]; mesh.edges.len()],
            of_face: vec![vec![]; mesh.faces.len()],
            edges: vec![vec![]; spheres],
            faces: vec![vec![]; spheres],
            blocks: vec![[[0.0; 4]; 4]; spheres],
            downhill: vec![[0.0; 4]; spheres],
            shared: vec![[[0.0; 4]; 4]; mesh.edges.len()],
        };
        for (e, edge) in (0..).zip(&mesh.edges) {
            edge.iter().for_each(|&v| this.edges[v as usize].push(e));
        }
        for (f, face) in (0..).zip(&mesh.faces) {
            face.iter().for_each(|&v| this.faces[v as usize].push(f));
        }
        let surface = points.samples.iter().map(|s| (s.point, s.weight, -1.0));
        let interior =
            points.interior.iter().map(|x| (x.point, x.weight, x.depth.min(points.deep)));
        for ((point, weight, depth), found) in surface.chain(interior).zip(&residuals.nearest) {
            let mut served = Served { point, weight, depth, now: 0.0 };
            served.now = served.error(found.signed).powi(POWER);
            let list = match found.primitive {
                Primitive::Sphere(v) => &mut this.of_sphere[v as usize],
                Primitive::Edge(e) => &mut this.of_edge[e as usize],
                Primitive::Face(f) => &mut this.of_face[f as usize],
            };
            list.push(served);
        }
        let incidence = Incidence::of(mesh);
        for row in &residuals.rows {
            let (corners, count) = vertices(mesh, row.primitive);
            for (v, a) in corners.into_iter().zip(row.weights).take(count) {
                add_product(&mut this.blocks[v as usize], row.weight * a * a, &row.direction);
                for (entry, x) in this.downhill[v as usize].iter_mut().zip(row.direction) {
                    *entry -= row.weight * row.error * a * x;
                }
            }
            let [a, b, c] = row.weights;
            let products = [a * b, a * c, b * c];
            let edges: &[u32] = match row.primitive {
                Primitive::Sphere(_) => &[],
                Primitive::Edge(ref e) => std::slice::from_ref(e),
                Primitive::Face(f) => &incidence.face_edges()[f as usize],
            };
            for (&e, product) in edges.iter().zip(products) {
                add_product(&mut this.shared[e as usize], row.weight * product, &row.direction);
            }
        }
        this
    }

    /// At least the `wanted` cheapest edges that can be collapsed, cheapest first.
    ///
    /// Edges that look cheap by a few samples come first: their cost is the limit for the others, most of
    /// which exceed it soon.
    fn cheapest(
        &self,
        complex: &CollapseComplex,
        sheets: &Sheets<'_>,
        goal: &Goal,
        wanted: usize,
        run: &RunContext,
    ) -> Result<Vec<Priced>> {
        let edges = 0..self.mesh.edges.len();
        let mut order: Vec<(f64, usize)> =
            edges.into_par_iter().map(|e| (self.rough_price(complex, e), e)).collect();
        order.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
        let mut found: Vec<Priced> = vec![];
        for block in order.chunks(wanted.max(BLOCK)) {
            let limit = found.get(wanted - 1).map_or(f64::INFINITY, |last| last.price);
            // A complex for each piece of work, because the homotopy test marks vertices.
            let priced = block.par_iter().map_init(
                || complex.clone(),
                |complex, &(_, e)| {
                    run.check()?;
                    Ok(self.price(complex, sheets, goal, e, limit))
                },
            );
            let priced = priced.collect::<Result<Vec<Option<Priced>>>>()?;
            found.extend(priced.into_iter().flatten());
            found.sort_by(|x, y| x.price.total_cmp(&y.price).then(x.ends.cmp(&y.ends)));
            found.truncate(wanted);
        }
        Ok(found)
    }

    /// The price with the merged sphere at the midpoint, by a few samples.
    fn rough_price(&self, complex: &CollapseComplex, e: usize) -> f64 {
        let ends = self.mesh.edges[e];
        let served: Vec<Served> = self.served(ends).into_iter().step_by(ROUGH).collect();
        let now: f64 = served.iter().map(|s| s.weight * s.now).sum();
        let [first, second] = ends.map(|v| complex.sphere(v));
        let ring = Ring::new(complex, ends);
        ring.energy(first.lerp(second, 0.5), &served, f64::INFINITY) - now
    }

    /// The edge at its best place; `None` if its collapse changes the homotopy type, or folds a face, makes one
    /// cross or costs more than `limit` at every place.
    fn price(
        &self,
        complex: &mut CollapseComplex,
        sheets: &Sheets<'_>,
        goal: &Goal,
        e: usize,
        limit: f64,
    ) -> Option<Priced> {
        let ends = self.mesh.edges[e];
        let [a, b] = ends;
        if !complex.keeps_homotopy(a, b) {
            return None;
        }
        let served = self.served(ends);
        let now: f64 = served.iter().map(|s| s.weight * s.now).sum();
        let ring = Ring::new(complex, ends);
        let [first, second] = ends.map(|v| complex.sphere(v));
        let mut places = vec![first, second, first.lerp(second, 0.5)];
        places.extend(self.minimiser(e, [first, second]));
        // Where the descent would put it: a merged centre must not be outside.
        let merged: Vec<Vec3> = places[2..].iter().map(|sphere| sphere.centre).collect();
        for (sphere, clamped) in places[2..].iter_mut().zip(goal.clamped(&merged)) {
            sphere.centre = clamped.unwrap_or(sphere.centre);
        }
        let mut tried: Vec<(f64, Sphere)> = Vec::with_capacity(places.len());
        let mut worst = now + limit;
        for sphere in places {
            if sheets.would_fold(complex, ends, sphere) {
                continue;
            }
            let energy = ring.energy(sphere, &served, worst);
            worst = worst.min(2.0 * energy);
            if energy < f64::INFINITY {
                tried.push((energy, sphere));
            }
        }
        tried.sort_by(|x, y| x.0.total_cmp(&y.0));
        let mut best: Option<Priced> = None;
        for (energy, sphere) in tried {
            let so_far = best.map_or(limit, |best| best.price);
            let change = energy - now;
            if change > so_far {
                break;
            }
            let scale = energy.min(so_far - change);
            let price = change + ring.protrusion(sphere, goal, scale, so_far - change);
            let is_better = price < so_far || (best.is_none() && price <= limit);
            if is_better && !sheets.would_cross(complex, ends, sphere) {
                best = Some(Priced { ends, sphere, price });
            }
        }
        best
    }

    /// The samples that the stars of both ends serve.
    fn served(&self, ends: [u32; 2]) -> Vec<Served> {
        let [a, b] = ends.map(|v| v as usize);
        let mut all = Vec::<Served>::new();
        all.extend(&self.of_sphere[a]);
        all.extend(&self.of_sphere[b]);
        let simplices = [(&self.edges, &self.of_edge), (&self.faces, &self.of_face)];
        for (simplices, of_simplex) in simplices {
            // A simplex with both ends is at both.
            let mut ids = [&simplices[a][..], &simplices[b]].concat();
            ids.sort_unstable();
            ids.dedup();
            ids.into_iter().for_each(|id| all.extend(&of_simplex[id as usize]));
        }
        // A few of all come first, so that a bad place is given up early.
        let spread = (0..ROUGH).flat_map(|k| all[k.min(all.len())..].iter().step_by(ROUGH));
        spread.copied().collect()
    }

    /// The minimiser of the squares that both ends serve, if it is a sphere not far from both.
    fn minimiser(&self, e: usize, spheres: [Sphere; 2]) -> Option<Sphere> {
        // A residual with the weights `a` and `b` at the two ends has `a + b` at the merged sphere: its square
        // is that of each, and twice the product.
        let shared = &self.shared[e];
        let mut sum: Block = shared.map(|row| row.map(|entry| 2.0 * entry));
        let mut right = [0.0; 4];
        for (v, sphere) in self.mesh.edges[e].into_iter().zip(spheres) {
            let (block, down) = (&self.blocks[v as usize], &self.downhill[v as usize]);
            let at = [sphere.centre.x, sphere.centre.y, sphere.centre.z, sphere.radius];
            for i in 0..4 {
                for j in 0..4 {
                    sum[i][j] += block[i][j];
                    right[i] += (block[i][j] + shared[i][j]) * at[j];
                }
                right[i] += down[i];
            }
        }
        let trace: f64 = (0..4).map(|k| sum[k][k]).sum();
        let middle = spheres[0].lerp(spheres[1], 0.5);
        let at = [middle.centre.x, middle.centre.y, middle.centre.z, middle.radius];
        // Pulled towards the midpoint in directions that no sample decides.
        for k in 0..4 {
            sum[k][k] += PULL * trace;
            right[k] += PULL * trace * at[k];
        }
        let lower = cholesky(&sum)?;
        let [x, y, z, r] = backward(&lower, forward(&lower, right));
        let sphere = Sphere::new(Vec3::new(x, y, z), r.max(LEAST_RADIUS));
        let reach = spheres[0].centre.distance(spheres[1].centre)
            + spheres[0].radius.max(spheres[1].radius);
        (sphere.centre.distance(middle.centre) <= reach && sphere.radius.is_finite())
            .then_some(sphere)
    }
}

/// The surroundings of an edge once it is collapsed.
struct Ring {
    neighbours: Vec<Sphere>,
    sides: Vec<[Sphere; 2]>,
    rims: Vec<Cone>,
}

impl Ring {
    fn new(complex: &CollapseComplex, [a, b]: [u32; 2]) -> Self {
        let mut around: Vec<u32> =
            complex.neighbours(a).iter().chain(complex.neighbours(b)).copied().collect();
        around.retain(|&v| v != a && v != b);
        around.sort_unstable();
        around.dedup();
        let mut sides: Vec<[u32; 2]> =
            complex.opposite_sides(a).iter().chain(complex.opposite_sides(b)).copied().collect();
        sides.retain(|side| !side.contains(&a) && !side.contains(&b));
        sides.sort_unstable();
        sides.dedup();
        let sides: Vec<[Sphere; 2]> =
            sides.into_iter().map(|side| side.map(|v| complex.sphere(v))).collect();
        let rims = sides.iter().map(|&[p, q]| Cone::new(p, q)).collect();
        let neighbours = around.into_iter().map(|v| complex.sphere(v)).collect();
        Self { neighbours, sides, rims }
    }

    /// The energy of some samples if the merged sphere is at a place; given up beyond `limit`.
    fn energy(&self, sphere: Sphere, served: &[Served], limit: f64) -> f64 {
        let mut cones: Vec<Cone> = self.neighbours.iter().map(|&n| Cone::new(sphere, n)).collect();
        if cones.is_empty() {
            cones.push(Cone::new(sphere, sphere));
        }
        let faces: Vec<SlabFace> =
            self.sides.iter().filter_map(|&[p, q]| SlabFace::new([sphere, p, q])).collect();
        let mut energy = 0.0;
        for sample in served {
            let p = sample.point;
            let mut signed = f64::INFINITY;
            for cone in cones.iter().chain(&self.rims) {
                signed = signed.min(cone.signed_distance(p));
            }
            for face in &faces {
                signed = signed.min(face.signed_distance(p).unwrap_or(f64::INFINITY));
            }
            energy += sample.weight * sample.error(signed).powi(POWER);
            if energy > limit {
                return f64::INFINITY;
            }
        }
        energy
    }

    /// Protrusion of the merged sphere, its edges and faces, at a few points of each; given up beyond
    /// `limit`. Balls that add less than the share [`NEGLIGIBLE`] of `scale` are not looked for: eighth powers make
    /// these most.
    fn protrusion(&self, sphere: Sphere, goal: &Goal, scale: f64, limit: f64) -> f64 {
        let mut balls = vec![sphere];
        for &n in &self.neighbours {
            let parts = (sphere.centre.distance(n.centre) / SPACING).round().clamp(1.0, 12.0);
            balls.extend((1..parts as u32).map(|k| sphere.lerp(n, f64::from(k) / parts)));
        }
        for &[p, q] in &self.sides {
            let longest =
                (sphere.centre - p.centre).length().max((sphere.centre - q.centre).length());
            let rows = (longest / SPACING).round().clamp(1.0, 10.0);
            let width = p.centre.distance(q.centre);
            // Rows parallel to the side that the merged sphere does not touch.
            for k in 1..rows as u32 {
                let t = f64::from(k) / rows;
                let (from, to) = (sphere.lerp(p, t), sphere.lerp(q, t));
                let parts = (t * width / SPACING).round().clamp(1.0, 10.0);
                balls.extend((1..parts as u32).map(|l| from.lerp(to, f64::from(l) / parts)));
            }
        }
        let small = (NEGLIGIBLE * scale.max(0.0) / PROTRUDING).powf(1.0 / f64::from(POWER));
        let (mut sum, mut known) = (0.0, None);
        for ball in balls {
            let enough = ball.radius - small;
            let Some(depth) = goal.depth_of_moved(ball.centre, enough, 0.0, &mut known) else {
                continue;
            };
            sum += PROTRUDING * (ball.radius - depth.value).max(0.0).powi(POWER);
            if sum > limit {
                return f64::INFINITY;
            }
        }
        sum
    }
}

// ----------------------------------------------------------------------------
// The limits of a step: where a centre would leave the solid it stays at the surface, and where a face would fold
// over or come to cross another one the step is shortened.

/// Times that the step of a sphere is halved before it is taken back altogether.
const HALVINGS: usize = 4;

/// A mesh with more than one pair of crossing faces for this number of faces is a tangle.
const TANGLED: usize = 2;

/// Faces that stay where they are, next to a mesh that moves. Vertices that are not of the mesh have larger
/// numbers than those that are.
#[derive(Clone, Debug, Default)]
pub(super) struct Still {
    pub faces: Vec<[u32; 3]>,
    pub corners: Vec<[Vec3; 3]>,
    /// Whether the mesh around is a tangle.
    pub is_tangled: bool,
}

/// Violations that a mesh must avoid while its spheres move.
pub(super) struct Guard {
    still: Crossings,
    /// Pairs that cross already.
    known: BTreeSet<Pair>,
    is_tangled: bool,
}

/// A face of a mesh, and one that it crosses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Pair {
    Moving([u32; 2]),
    Still([u32; 2]),
}

impl Guard {
    pub fn new(mesh: &MedialMesh, still: Still) -> Self {
        let Still { faces, corners, is_tangled } = still;
        let tree = Crossings::new(faces.len(), |f| corners[f as usize]);
        let mut this = Self { still: tree, known: BTreeSet::new(), is_tangled };
        this.known = this.crossing(mesh, |_| true).into_iter().collect();
        let is_whole = faces.is_empty();
        this.is_tangled |= is_whole && TANGLED * this.known.len() > mesh.faces.len();
        this
    }

    /// Whether more faces may come to cross, as many do: at the axis of a tube, the start is a tangle of tiny faces.
    pub fn is_tangled(&self) -> bool {
        self.is_tangled
    }

    /// How many pairs of faces crossed at first.
    pub fn crossings(&self) -> usize {
        self.known.len()
    }

    /// Brings a step within its limits: centres outside are clamped, and the corners of faces that would fold
    /// over, or come to cross another one, go half the way, a quarter, or stay where they were. Returns these corners,
    /// in ascending order.
    pub fn hold(&self, before: &MedialMesh, after: &mut MedialMesh, goal: &Goal) -> Vec<u32> {
        clamp(after, goal);
        if self.is_tangled {
            return vec![];
        }
        // Taking one vertex back can fold another face of it. This ends: with all taken back the mesh is as before.
        let mut halvings = vec![0; before.spheres.len()];
        // The faces that are looked at: all, and then those of vertices taken back.
        let mut changed = vec![true; before.spheres.len()];
        loop {
            let mut back = before.faces.clone();
            back.retain(|&face| folds_over(corners(before, face), corners(after, face)));
            let new = self.crossing(after, |face| face.iter().any(|&v| changed[v as usize]));
            let new = new.into_iter().filter(|pair| !self.known.contains(pair));
            for pair in new {
                match pair {
                    Pair::Moving(faces) => back.extend(faces.map(|f| before.faces[f as usize])),
                    Pair::Still([face, _]) => back.push(before.faces[face as usize]),
                }
            }
            let mut back: BTreeSet<u32> = back.into_iter().flatten().collect();
            back.retain(|&v| {
                // Radii play no part in either.
                let [old, new] = [before, &*after].map(|mesh| mesh.spheres.get(v as usize));
                old.map(|sphere| sphere.centre) != new.map(|sphere| sphere.centre)
            });
            if back.is_empty() {
                break;
            }
            changed.fill(false);
            for v in back {
                changed[v as usize] = true;
                let (old, new) = (before.spheres[v as usize], &mut after.spheres[v as usize]);
                let halvings = &mut halvings[v as usize];
                *halvings += 1;
                let half = old.lerp(*new, 0.5);
                let is_inside = *halvings < HALVINGS && goal.clamped(&[half.centre])[0].is_none();
                *new = if is_inside { half } else { old };
            }
        }
        (0..).zip(halvings).filter(|&(_, halvings)| halvings > 0).map(|(v, _)| v).collect()
    }

    /// The pairs with a face of the mesh for which `is_chosen`.
    fn crossing(
        &self,
        mesh: &MedialMesh,
        is_chosen: impl Fn(&[u32; 3]) -> bool + Sync,
    ) -> Vec<Pair> {
        let moving =
            Crossings::new(mesh.faces.len(), |face| corners(mesh, mesh.faces[face as usize]));
        let moving = moving.pairs_with(|face| is_chosen(&mesh.faces[face as usize]));
        let moving = moving.into_iter().map(Pair::Moving);
        let chosen = (0..mesh.faces.len() as u32).filter(|&f| is_chosen(&mesh.faces[f as usize]));
        let still = chosen.flat_map(|face| {
            let own = mesh.faces[face as usize];
            let others = self.still.of(corners(mesh, own));
            others.into_iter().map(move |other| Pair::Still([face, other]))
        });
        moving.chain(still).collect()
    }
}

/// Moves centres outside of the solid to the closest point of its surface.
pub(super) fn clamp(mesh: &mut MedialMesh, goal: &Goal) {
    let centres: Vec<Vec3> = mesh.spheres.iter().map(|sphere| sphere.centre).collect();
    for (sphere, clamped) in mesh.spheres.iter_mut().zip(goal.clamped(&centres)) {
        sphere.centre = clamped.unwrap_or(sphere.centre);
    }
}

// ----------------------------------------------------------------------------
// Steps of a few spheres: those around the places where the mesh was just edited.
//
// The spheres of the places and their neighbours move, with the simplices that have one of them as a
// corner. All other simplices stay, so for each sample their distance is one number. A step costs what the
// samples around the places cost.

/// Samples that the rest of the mesh serves are looked at up to this distance from the moving part.
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
    let still = Still { is_tangled, ..part.still(mesh, &moving) };
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
    let mut points = Points { outside, deep: all.deep, ..Points::default() };
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

/// The simplices with a moving corner, as a mesh of their own.
pub(super) struct Part {
    pub mesh: MedialMesh,
    /// The places of its spheres in the whole mesh.
    spheres: Vec<u32>,
    /// Which of its spheres stay.
    fixed: Vec<bool>,
}

impl Part {
    pub fn of(mesh: &MedialMesh, moving: &[bool]) -> Self {
        let is_moving = |v: &u32| moving[*v as usize];
        let edges: Vec<_> = mesh.edges.iter().filter(|e| e.iter().any(is_moving)).collect();
        let faces: Vec<_> = mesh.faces.iter().filter(|f| f.iter().any(is_moving)).collect();
        let mut used = moving.to_vec();
        edges.iter().for_each(|e| e.iter().for_each(|&v| used[v as usize] = true));
        faces.iter().for_each(|f| f.iter().for_each(|&v| used[v as usize] = true));
        // The side of a face opposite to its moving corner is part of the rest.
        let sides = mesh.edges.iter().filter(|&&[a, b]| {
            !is_moving(&a)
                && !is_moving(&b)
                && used[a as usize]
                && used[b as usize]
                && faces.iter().any(|f| f.contains(&a) && f.contains(&b))
        });
        let mut kept: Vec<[u32; 2]> = edges.into_iter().chain(sides).copied().collect();
        kept.sort_unstable();
        let spheres: Vec<u32> = (0..used.len() as u32).filter(|&v| used[v as usize]).collect();
        let mut place = vec![0; used.len()];
        for (new, &v) in (0..).zip(&spheres) {
            place[v as usize] = new;
        }
        let edges = kept.into_iter().map(|e| e.map(|v| place[v as usize])).collect();
        let faces = faces.into_iter().map(|f| f.map(|v| place[v as usize])).collect();
        let fixed = spheres.iter().map(|v| !is_moving(v)).collect();
        let own: Vec<Sphere> = spheres.iter().map(|&v| mesh.spheres[v as usize]).collect();
        let mesh = MedialMesh { spheres: own, edges, faces, contacts: None };
        Self { mesh, spheres, fixed }
    }

    /// A primitive of the part, as one of the whole mesh.
    pub fn in_whole(&self, whole: &MedialMesh, primitive: Primitive) -> Primitive {
        let found = |place: Option<usize>| place.expect("the part is of the whole") as u32;
        match primitive {
            Primitive::Sphere(v) => Primitive::Sphere(self.spheres[v as usize]),
            Primitive::Edge(e) => {
                let edge = self.mesh.edges[e as usize].map(|v| self.spheres[v as usize]);
                Primitive::Edge(found(whole.edges.binary_search(&edge).ok()))
            }
            Primitive::Face(f) => {
                let face = self.mesh.faces[f as usize].map(|v| self.spheres[v as usize]);
                Primitive::Face(found(whole.faces.binary_search(&face).ok()))
            }
        }
    }

    /// The faces of the whole mesh without a moving corner, with its spheres numbered as in the part, and
    /// those that are not in it after them.
    fn still(&self, whole: &MedialMesh, moving: &[bool]) -> Still {
        let own = self.spheres.len() as u32;
        let mut place: Vec<u32> = (0..whole.spheres.len() as u32).map(|v| own + v).collect();
        for (new, &v) in (0..).zip(&self.spheres) {
            place[v as usize] = new;
        }
        let still = whole.faces.iter().filter(|face| !face.iter().any(|&v| moving[v as usize]));
        let (faces, corners) =
            still.map(|face| (face.map(|v| place[v as usize]), corners(whole, *face))).unzip();
        Still { faces, corners, is_tangled: false }
    }
}

/// The simplices without a moving corner, if there are any.
fn rest_of(mesh: &MedialMesh, moving: &[bool]) -> Option<MedialMesh> {
    let stays = |v: &u32| !moving[*v as usize];
    let spheres: Vec<u32> = (0..moving.len() as u32).filter(stays).collect();
    let mut place = vec![0; moving.len()];
    for (new, &v) in (0..).zip(&spheres) {
        place[v as usize] = new;
    }
    let edges = mesh.edges.iter().filter(|e| e.iter().all(stays));
    let faces = mesh.faces.iter().filter(|f| f.iter().all(stays));
    let rest = MedialMesh {
        spheres: spheres.iter().map(|&v| mesh.spheres[v as usize]).collect(),
        edges: edges.map(|e| e.map(|v| place[v as usize])).collect(),
        faces: faces.map(|f| f.map(|v| place[v as usize])).collect(),
        contacts: None,
    };
    (!rest.spheres.is_empty()).then_some(rest)
}
