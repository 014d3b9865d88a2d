//! Steps 1 and 2: the axis to be pruned, and the volume that each of its simplices represents.

use medial::Vec3;
use medial::complex::collapse::CollapseComplex;
use medial::complex::{CellSpheres, Incidence, MedialMesh, Sphere, UnionAxis, betti};
use medial::geometry::predicates::{Sign, orient3d};
use medial::geometry::{CellId, Delaunay};
use medial::metrics::enclosed_volume;
use medial::shape::{Shape, ShapeError};
use medial::simplifier::{Diagnostics, RunContext};
use medial::surface::TriangleBvh;
use rayon::prelude::*;

use super::fins::without_fins;
use crate::Result;
use crate::levels::perturbed;

/// Factor of the radii of polar balls, so that balls that touch in a sample overlap.
const RADIUS_FACTOR: f64 = 1.002;
/// Largest displacement of a polar ball along each axis, in radii.
const JITTER: f64 = 1e-7;
/// Distance of two vertices of the axis, in radii, up to which they are merged.
const MERGE: f64 = 1e-3;

/// A medial mesh with everything that pruning needs.
pub(super) struct Axis {
    pub(super) mesh: MedialMesh,
    pub(super) incidence: Incidence,
    /// For each sphere whether it is the end of an edge without faces, or has no edge: it stays.
    pub(super) on_curve: Vec<bool>,
    /// For each sphere the relative volume of the tetrahedra whose pole it is.
    pub(super) at_sphere: Vec<f64>,
    /// For each face the relative volume of the tetrahedra whose pole is nearest to it, if the spheres
    /// of the mesh are not poles.
    pub(super) at_face: Vec<f64>,
    /// The number of voids.
    pub(super) b2: u64,
}

impl Axis {
    /// An axis without volumes and voids, which are still to be computed.
    pub(super) fn of_mesh(mesh: MedialMesh) -> Self {
        let incidence = Incidence::of(&mesh);
        // Spheres without edges stay as well as the ends of edges without faces.
        let mut on_curve = vec![true; mesh.spheres.len()];
        // Second those without faces, so that a sphere with both kinds of edges stays.
        for is_curve in [false, true] {
            let edges = mesh.edges.iter().zip(incidence.faces_at());
            for v in edges.filter(|e| (*e.1 == 0) == is_curve).flat_map(|e| e.0) {
                on_curve[*v as usize] = is_curve;
            }
        }
        let at_sphere = vec![0.0; mesh.spheres.len()];
        let at_face = vec![0.0; mesh.faces.len()];
        Self { mesh, incidence, on_curve, at_sphere, at_face, b2: 0 }
    }

    /// The axis of a shape: its given medial mesh, or else that of the union of the polar balls.
    pub(super) fn of_shape(
        shape: &Shape,
        run: &RunContext,
        diagnostics: &mut Diagnostics,
    ) -> Result<Self> {
        let given = shape.has_given_initial();
        let mut axis = if given {
            let mut axis = Self::of_mesh(shape.initial()?.as_ref().clone());
            axis.b2 = betti(&axis.mesh)[2];
            axis
        } else {
            of_union(shape, run, diagnostics)?
        };
        run.step(0, 1)?;
        if given {
            axis.share_out(shape)?;
            diagnostics.warn(
                "the given medial mesh has no poles: each interior Delaunay tetrahedron of the \
                 samples counts for the part nearest to its circumcentre",
            );
        }
        let whole = enclosed_volume(shape.mesh());
        if whole > 0.0 {
            axis.at_sphere.iter_mut().chain(&mut axis.at_face).for_each(|v| *v /= whole);
        }
        Ok(axis)
    }

    /// Gives each face the volume of the interior tetrahedra whose circumcentre it is nearest to.
    fn share_out(&mut self, shape: &Shape) -> Result<()> {
        if self.mesh.faces.is_empty() {
            return Ok(());
        }
        let delaunay = shape.delaunay()?;
        let cells = shape.cells()?;
        let curves = self.mesh.edges.iter().zip(self.incidence.faces_at()).filter(|e| *e.1 == 0);
        // Curves take part in the search, since a tetrahedron nearest to a curve belongs to no part.
        let corners = self.mesh.faces.iter().copied().chain(curves.map(|(&[a, b], _)| [a, b, b]));
        let targets: Vec<[Vec3; 3]> =
            corners.map(|face| face.map(|v| self.mesh.spheres[v as usize].centre)).collect();
        let tree = TriangleBvh::from_triangles(&targets).map_err(ShapeError::from)?;
        let inside: Vec<_> = delaunay.finite_cells().filter(|&c| cells.is_inside(c)).collect();
        let centres: Vec<Vec3> = inside
            .iter()
            .map(|&cell| delaunay.circumsphere(cell).map_or(Vec3::ZERO, |sphere| sphere.0))
            .collect();
        for (cell, nearest) in inside.iter().zip(tree.closest_batch(&centres)) {
            if let Some(volume) = self.at_face.get_mut(nearest.face as usize) {
                *volume += tetrahedron(delaunay.vertices(*cell).map(|v| delaunay.point(v)));
            }
        }
        Ok(())
    }
}

/// The exact axis of the union of the perturbed balls.
fn of_union(shape: &Shape, run: &RunContext, diagnostics: &mut Diagnostics) -> Result<Axis> {
    let poles = DistinctBalls::of_samples(shape)?;
    run.step(0, 1)?;
    let spheres = perturbed(&poles.balls, RADIUS_FACTOR, JITTER, run.seed);
    let union = UnionAxis::of_balls(&spheres).map_err(ShapeError::from)?;
    run.step(0, 1)?;
    let whole = union.mesh();
    let at = poles.samples_of_corners(shape, &spheres, &union);
    let is_fin = fins_of(&whole, &union, &at);
    let (finless, first_into, fins_left) = without_fins(&whole, &is_fin);
    run.step(0, 1)?;
    let (mesh, into) = merged(&finless, MERGE, run)?;
    let mut axis = Axis::of_mesh(mesh);
    // The first vertices of the axis are centres of balls.
    for (&ball, &vertex) in union.balls().iter().zip(&first_into) {
        axis.at_sphere[into[vertex as usize] as usize] += poles.volumes[ball as usize];
    }
    diagnostics.count("fins_left", fins_left);
    let found = betti(&axis.mesh);
    axis.b2 = found[2];
    if found != union.union_betti() {
        diagnostics.warn(format!(
            "the axis has Betti numbers {found:?}, the union of balls {:?}: rounding left {} facets \
             and {} groups of vertices undecided",
            union.union_betti(),
            union.tally().open,
            union.tally().doubtful
        ));
    }
    Ok(axis)
}

/// For each triangle of the axis of a union whether it lies between two corners at the same sample.
fn fins_of(mesh: &MedialMesh, union: &UnionAxis, at: &[Option<u32>]) -> Vec<bool> {
    let facets = union.facets().filter(|facet| {
        let [a, b] = facet.between.map(|corner| at.get(corner as usize).copied().flatten());
        a.is_some() && a == b
    });
    let mut fins: Vec<[u32; 3]> = facets.flat_map(|f| f.fan()).collect();
    fins.iter_mut().for_each(|fin| fin.sort_unstable());
    fins.sort_unstable();
    mesh.faces.iter().map(|face| fins.binary_search(face).is_ok()).collect()
}

// ----------------------------------------------------------------------------
// Step 1, section 3: merges vertices of the axis that are still nearly at one position.
//
// Several polar balls pass through one sample, so that the boundary of their perturbed union has several
// corners there, and the axis several vertices where the exact one has one. Those are merged by their
// distance. On a box sampled on a grid the distances have a gap, on curved shapes there is none.
//
// 1. Take the edges not longer than [`MERGE`] times the smaller radius of their ends, the shortest first.
// 2. Contract each to its first end, centres of balls being first, if that keeps the homotopy type
//    ([`CollapseComplex::keeps_homotopy`]).
// 3. From 1 on until none can be.
//
// A sliver whose short side is contracted leaves an edge, which stays as a curve where nothing else has it.

/// The mesh with duplicate vertices merged, and for each sphere of `mesh` the one that it went into.
pub(super) fn merged(
    mesh: &MedialMesh,
    merge: f64,
    run: &RunContext,
) -> Result<(MedialMesh, Vec<u32>)> {
    let mut complex = CollapseComplex::from_mesh(mesh);
    let mut into: Vec<u32> = (0..mesh.spheres.len() as u32).collect();
    let mut done = 0;
    // Spheres at which something changed in the pass before: elsewhere the results are the same.
    let mut changed: Vec<u32> = complex.vertices().collect();
    while !changed.is_empty() {
        let edges = short_edges(&complex, &changed, merge);
        changed.clear();
        for [kept, removed] in edges {
            let is_edge = complex.is_alive(kept)
                && complex.is_alive(removed)
                && complex.neighbours(removed).contains(&kept);
            if is_edge && complex.keeps_homotopy(kept, removed) {
                let sphere = complex.sphere(kept);
                complex.collapse(kept, removed, sphere);
                into[removed as usize] = kept;
                changed.push(kept);
                changed.extend(complex.neighbours(kept));
                done += 1;
                if done % 4096 == 0 {
                    run.step(done, mesh.spheres.len())?;
                }
            }
        }
        changed.retain(|&v| complex.is_alive(v));
        changed.sort_unstable();
        changed.dedup();
    }
    let mut number = vec![u32::MAX; mesh.spheres.len()];
    complex.vertices().zip(0..).for_each(|(old, new)| number[old as usize] = new);
    // Spheres merge into smaller ids, so that one ascending pass resolves every chain.
    for v in 0..into.len() {
        into[v] = if into[v] == v as u32 { number[v] } else { into[into[v] as usize] };
    }
    Ok((complex.to_mesh(), into))
}

/// The short edges at some spheres as ascending pairs, the shortest first.
fn short_edges(complex: &CollapseComplex, at: &[u32], merge: f64) -> Vec<[u32; 2]> {
    let short = at.par_iter().with_min_len(1 << 10).flat_map_iter(|&v| {
        let a = complex.sphere(v);
        let lengths = complex.neighbours(v).iter().map(move |&w| {
            let b = complex.sphere(w);
            (a.centre.distance(b.centre), merge * a.radius.min(b.radius), w)
        });
        let short = lengths.filter(|&(length, most, _)| length <= most);
        // The bits of numbers that are not negative are in their order.
        short.map(move |(length, _, w)| (length.to_bits(), [v.min(w), v.max(w)]))
    });
    let mut short: Vec<(u64, [u32; 2])> = short.collect();
    short.par_sort_unstable();
    short.dedup();
    short.into_iter().map(|s| s.1).collect()
}

// ----------------------------------------------------------------------------
// Step 1, section 3: duplicates, recognised by their samples.
//
// 1. *Poles.* The inner pole of a sample is its farthest Voronoi vertex inside. Vertices that are
//    equally far, up to rounding, all are poles: on a grid every sample has several, and which one
//    rounding prefers would tear the ends of sheets.
// 2. *Balls.* More than four cospherical samples give several Delaunay tetrahedra with one circumcentre,
//    and as many polar balls. Tetrahedra that share a triangle and have the same circumcentre, up to
//    rounding, are one pole: one ball, with all their samples, and with the volume of all.
// 3. *Corners.* Polar balls meet in samples, so that many corners of their union are one sample. A corner
//    is at a sample if its three balls have that in common, on its side of the plane of their
//    centres ([`shared_sample`]).

/// Polar balls, each once.
#[derive(Default)]
pub(super) struct DistinctBalls {
    pub(super) balls: Vec<Sphere>,
    /// For each ball all samples that it passes through.
    samples: Vec<Vec<u32>>,
    /// For each ball the volume of its tetrahedra.
    pub(super) volumes: Vec<f64>,
}

/// Circumcentres closer than this share of the radius count as one, and radii as equal: above rounding,
/// which flat tetrahedra amplify, and far below the distance of samples.
const COINCIDENT: f64 = 1e-7;

impl DistinctBalls {
    /// Those of the samples of a shape.
    pub(super) fn of_samples(shape: &Shape) -> Result<Self, ShapeError> {
        let (delaunay, cells) = (shape.delaunay()?, shape.centred()?);
        let spheres = cells.circumspheres();
        let is_pole = poles(&delaunay, &cells);
        let mut found = Self::default();
        let mut is_done = vec![false; spheres.len()];
        for first in delaunay.finite_cells().filter(|c| is_pole[c.index()]) {
            let Some(ball) = spheres[first.index()].filter(|_| !is_done[first.index()]) else {
                continue;
            };
            let (mut samples, mut volume) = (Vec::new(), 0.0);
            let mut group = vec![first];
            is_done[first.index()] = true;
            while let Some(cell) = group.pop() {
                let corners = delaunay.vertices(cell);
                samples.extend(corners.map(|v| v.0));
                volume += tetrahedron(corners.map(|v| delaunay.point(v)));
                for other in delaunay.neighbours(cell) {
                    let same = !delaunay.is_infinite(other)
                        && !is_done[other.index()]
                        && spheres[other.index()].is_some_and(|s| coincide(s, ball));
                    if same {
                        is_done[other.index()] = true;
                        group.push(other);
                    }
                }
            }
            samples.sort_unstable();
            samples.dedup();
            found.balls.push(ball);
            found.samples.push(samples);
            found.volumes.push(volume);
        }
        if found.balls.is_empty() {
            // Returns the reason.
            shape.inner_balls()?;
        }
        Ok(found)
    }

    /// For each corner of the union of the balls, moved and grown to `moved`, its sample.
    pub(super) fn samples_of_corners(
        &self,
        shape: &Shape,
        moved: &[Sphere],
        union: &UnionAxis,
    ) -> Vec<Option<u32>> {
        let positions = shape.samples();
        let found = union.corners().iter().map(|vertex| {
            let lists = vertex.balls.map(|ball| &self.samples[ball as usize][..]);
            let centres = vertex.balls.map(|ball| moved[ball as usize].centre);
            shared_sample(vertex.position, lists, centres, &positions)
        });
        found.collect()
    }
}

/// The sample in which the three polar balls of a vertex meet on its side of their centres' plane:
/// a key for `UnionBoundary::merge`. `None` if they have no sample in common there.
///
/// The balls have the samples `a`, `b` and `c`, and the centres `p`, `q` and `r`. Balls that were grown no
/// longer pass through their samples.
fn shared_sample(
    vertex: Vec3,
    [a, b, c]: [&[u32]; 3],
    [p, q, r]: [Vec3; 3],
    positions: &[Vec3],
) -> Option<u32> {
    let common = a.iter().filter(|s| b.contains(s) && c.contains(s));
    common
        .map(|&s| (positions[s as usize], s))
        // Three spheres meet in a point and its mirror image, so the side decides which.
        .filter(|&(position, _)| orient3d(p, q, r, position) != Sign::Negative)
        .map(|(position, s)| (position.distance_squared(vertex), s))
        .min_by(|s, t| s.0.total_cmp(&t.0).then(s.1.cmp(&t.1)))
        .map(|(_, s)| s)
}

/// For each finite cell whether it is an inner pole: no Voronoi vertex inside is farther from one of its
/// samples.
fn poles(delaunay: &Delaunay, cells: &CellSpheres) -> Vec<bool> {
    let spheres = cells.circumspheres();
    let inside = delaunay.finite_cells().filter(|&cell| cells.is_inside(cell));
    let inside: Vec<(CellId, f64)> =
        inside.map(|cell| (cell, spheres[cell.index()].map_or(0.0, |s| s.radius))).collect();
    let mut farthest = vec![0.0_f64; delaunay.point_count()];
    for &(cell, radius) in &inside {
        for v in delaunay.vertices(cell) {
            farthest[v.index()] = farthest[v.index()].max(radius);
        }
    }
    let mut is_pole = vec![false; spheres.len()];
    for (cell, radius) in inside {
        let enough = radius * (1.0 + COINCIDENT);
        is_pole[cell.index()] =
            delaunay.vertices(cell).iter().any(|v| farthest[v.index()] <= enough);
    }
    is_pole
}

fn coincide(a: Sphere, b: Sphere) -> bool {
    a.centre.distance(b.centre) <= COINCIDENT * a.radius.min(b.radius)
}

/// The volume of a tetrahedron.
pub(super) fn tetrahedron([a, b, c, d]: [Vec3; 4]) -> f64 {
    (b - a).dot((c - a).cross(d - a)).abs() / 6.0
}
