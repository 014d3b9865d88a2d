//! Passes of collapses of the edges that the samples around them miss least.
//!
//! The price of an edge is the change of `sum w e^8` over the samples that the primitives around it serve, plus the
//! protrusion of the new primitives, for the best of four places of the merged sphere: both ends, the midpoint, and
//! the minimiser of the two spheres' squares. Eighth powers, because one sample that is missed badly decides the
//! maximum, and no later step repairs a face across a hole.
//!
//! Samples see the new star and its rim alone. Samples that another primitive would serve better count too much,
//! never too little.

use medial::Vec3;
use medial::complex::collapse::CollapseComplex;
use medial::complex::{Incidence, MedialMesh, Primitive, Sphere};
use medial::geometry::{Cone, SlabFace};
use medial::simplifier::RunContext;
use rayon::prelude::*;

use super::block_cholesky::{Block, add_product, backward, cholesky, forward};
use super::descent::{Descent, LEAST_RADIUS};
use super::goal::{DEEP, Goal, uncovered, vertices};
use super::guard::Sheets;
use crate::Result;

/// Exponent of the price.
const POWER: i32 = 8;

/// Weight of a point of a primitive that protrudes. Each represents several samples.
const PROTRUDING: f64 = 50.0;

/// Share of the price below which the protrusion of a ball is ignored.
const NEGLIGIBLE: f64 = 1e-4;

/// Pull of a minimiser towards the midpoint of its edge, as a share of the trace.
const PULL: f64 = 1e-3;

/// Samples for each one that the first price of an edge looks at.
const ROUGH: usize = 8;

/// Smallest number of edges that are priced before the limit is updated.
const BLOCK: usize = 16;

/// Distance between points of a new star at which it is tested for protruding, a fraction of the
/// diagonal.
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
        let interior = points.interior.iter().map(|x| (x.point, x.weight, x.depth.min(DEEP)));
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
            let Some(depth) = goal.depth_of_moved(ball.centre, enough, &mut known) else {
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
