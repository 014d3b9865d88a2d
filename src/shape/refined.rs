//! Adds samples to the vertices of a surface until the Voronoi medial mesh is right.
//!
//! Where two sheets of a surface are close, its vertices are often too few: the Voronoi medial mesh
//! then leaves the solid, bridges a gap, or has a hole. Samples are added there in rounds, as in
//! surface Delaunay refinement (Boissonnat, Oudot: *Provably good sampling and meshing of surfaces*,
//! Graphical Models 67, 2005, doi:10.1016/j.gmod.2005.01.004). The ball around a Voronoi vertex
//! contains no sample, so a point of the surface inside it, taken as a new sample, removes the ball.
//!
//! 1. The Voronoi medial mesh of the samples is built, with its Betti numbers.
//! 2. *Error*. Balls, and the interpolated balls in the middle of edges and triangles, that reach beyond
//!    the surface by more than [`BOUND`]; points of the surface that no primitive covers to within
//!    [`BOUND`].
//! 3. *Topology*, where the Betti numbers are not the solid's: tetrahedra whose barycentre is on
//!    another side of the surface than the centre of their ball, and simplices of the mesh whose
//!    barycentre is outside.
//! 4. Each of these places gives a point of the surface: the one closest to the centre, or the uncovered
//!    one. These become samples, the worst place first. A point is skipped if an earlier one of the
//!    round is nearer than half the depth to which the surface pierces its ball. If there is a sample
//!    already (a cone between two correct balls may still bulge), the farthest from all samples of
//!    twelve nearby points of the surface is taken instead.
//! 5. If no place is found, or several rounds brought no progress, the longest side of each face is
//!    halved, too.
//!
//! It ends when nothing is wrong, or at a limit of rounds or samples; then it returns the samples of the
//! best round, with a warning.
//!
//! # Deviations from the paper
//! There is no requirement on angles or sizes of triangles, and no guarantee, because the surface is not
//! smooth. All Voronoi vertices are checked, not only Voronoi edges that cross the surface.

use std::sync::Arc;

use crate::Vec3;
use crate::complex::{
    CellSpheres, DualTriangulation, MedialMesh, MedialUnion, VoronoiFacets, betti,
    voronoi_medial_mesh,
};
use crate::geometry::trees::PointTree;
use crate::geometry::{Delaunay, TriangulationError};
use crate::metrics::icosahedron;
use crate::surface::{InsideTest, Sampling, Side, TriMesh, TriangleBvh, sample};

/// The error that is allowed, as a fraction of the bounding box's diagonal.
pub const BOUND: f64 = 0.01;

/// Rounds at most.
pub const ROUNDS: usize = 16;

/// Bound on the samples: this many times the vertices, or [`ENOUGH`] if that is more.
pub const MOST_TIMES: usize = 8;

/// So many samples are allowed to every surface.
pub const ENOUGH: usize = 20_000;

/// A ball is removed to repair the topology only if the surface pierces it by more than this fraction
/// of its radius. Other balls belong to slivers on the surface, which new samples would just replace.
const PIERCED: f64 = 0.15;

/// If the topology is still wrong after this many rounds, balls pierced by a third of this count, too.
const PATIENCE: usize = 8;

/// After this many rounds without progress the longest side of each face is halved.
const STALLED: usize = 4;

/// Samples nearer to a new one than this fraction of what a ball is pierced by are in its place.
const CLEAR: f64 = 0.2;

/// Points of the surface at which it is tested whether it is covered, beside one in each face.
const TESTED: usize = 10_000;

/// The surface whose medial mesh is asked, normalised, with its substrates.
#[derive(Clone, Copy)]
pub struct Refinement<'a> {
    /// The surface.
    pub mesh: &'a TriMesh,
    /// Its faces in a tree.
    pub tree: &'a TriangleBvh,
    /// Its inside test.
    pub inside: &'a InsideTest,
    /// Betti numbers of the solid, where they are known.
    pub expected: Option<[u64; 3]>,
    /// How dual Voronoi polygons are triangulated.
    pub dual: DualTriangulation,
}

/// Samples and what is wrong with their medial mesh.
#[derive(Clone, Debug)]
pub struct Refined {
    /// The vertices of the surface, and the points that were added.
    pub samples: Vec<Vec3>,
    /// Betti numbers of the Voronoi medial mesh.
    pub betti: [u64; 3],
    /// Betti numbers of the solid, where they are known.
    pub expected: Option<[u64; 3]>,
    /// Largest error that was seen, as a fraction of the diagonal.
    pub error: f64,
    /// Rounds in which samples were added before.
    pub rounds: usize,
    /// Whether the Betti numbers are the solid's, and the error is within [`BOUND`].
    pub is_right: bool,
}

/// A place where a sample is missing.
#[derive(Clone, Copy, Debug)]
struct Place {
    /// A point of the surface.
    point: Vec3,
    /// No sample is nearer to the point than this, or than a part of it.
    clear: f64,
}

impl Refined {
    /// The remaining defects, for the reader of a result.
    pub fn warning(&self) -> Option<String> {
        let Self { samples, betti, expected, error, .. } = self;
        let topology = expected.filter(|expected| expected != betti).map(|expected| {
            format!(
                "the initial medial mesh has the Betti numbers {betti:?}, the solid {expected:?}"
            )
        });
        let gap = (*error > BOUND).then(|| {
            format!("the initial medial mesh is off by {:.2} % of the diagonal", 100.0 * error)
        });
        let wrong: Vec<String> = topology.into_iter().chain(gap).collect();
        let count = samples.len();
        (!wrong.is_empty())
            .then(|| format!("--sampling auto ended with {count} samples: {}", wrong.join("; ")))
    }
}

impl Refinement<'_> {
    /// Adds samples until the Voronoi medial mesh is right, or a limit is reached. The same samples for
    /// any number of threads.
    ///
    /// # Errors
    /// When the vertices do not span space.
    pub fn run(&self) -> Result<Refined, TriangulationError> {
        let most = ENOUGH.max(MOST_TIMES * self.mesh.vertices.len());
        let tested = self.tested();
        let mut samples = self.mesh.vertices.clone();
        let mut best: Option<Refined> = None;
        let mut stalled = 0;
        for round in 0..=ROUNDS {
            let diagram = Diagram::new(self, &samples)?;
            let (found, places) = self.judge(&diagram, &tested, round);
            let is_right = found.is_right;
            if best.as_ref().is_none_or(|best| self.is_better(&found, best)) {
                best = Some(found);
                stalled = 0;
            }
            // Rounds since the best one, itself included: the counter is never 0 here.
            stalled += 1;
            let full = samples.len() >= most;
            if is_right || full || round == ROUNDS {
                break;
            }
            // Samples go where defects are; only where that no longer helps, everywhere.
            let mut added = self.spread(places, &samples);
            if added.is_empty() || stalled % STALLED == 0 {
                added.extend(self.halved(&samples));
            }
            added.truncate(most - samples.len());
            if added.is_empty() {
                break;
            }
            samples.extend(added);
        }
        Ok(best.expect("one round at least"))
    }

    /// Right before wrong, right topology before wrong topology, small errors before large ones.
    fn is_better(&self, new: &Refined, old: &Refined) -> bool {
        let (wrong, old_wrong) = (self.wrong(new.betti), self.wrong(old.betti));
        wrong < old_wrong || (wrong == old_wrong && new.error < old.error)
    }

    /// How far Betti numbers are from the solid's.
    fn wrong(&self, betti: [u64; 3]) -> u64 {
        let expected = self.expected.unwrap_or(betti);
        expected.iter().zip(betti).map(|(a, b)| a.abs_diff(b)).sum()
    }

    /// The defects of a diagram and their places, the worst first.
    fn judge(&self, diagram: &Diagram, tested: &[Vec3], rounds: usize) -> (Refined, Vec<Place>) {
        let betti = betti(&diagram.medial);
        let wrong = self.wrong(betti) > 0;
        // Step 3 runs only while the topology is wrong; after some rounds a third of the share
        // counts as a defect.
        let pierced = wrong.then_some(if rounds < PATIENCE { PIERCED } else { PIERCED / 3.0 });
        let (mut places, reach) = self.outgrown(&diagram.medial, pierced);
        let (uncovered, gap) = self.uncovered(&diagram.medial, tested);
        places.extend(uncovered);
        if let Some(pierced) = pierced {
            places.extend(self.inconsistent(diagram, pierced));
        }
        places.sort_by(|a, b| b.clear.total_cmp(&a.clear));
        let error = reach.max(gap);
        let found = Refined {
            samples: diagram.samples.to_vec(),
            betti,
            expected: self.expected,
            error,
            rounds,
            is_right: !wrong && error <= BOUND,
        };
        (found, places)
    }

    /// Step 2, the balls that reach too far beyond the surface, with the largest reach; and of step 3, the
    /// simplices whose barycentre is outside.
    fn outgrown(&self, medial: &MedialMesh, pierced: Option<f64>) -> (Vec<Place>, f64) {
        let balls = barycentres(medial);
        let centres: Vec<Vec3> = balls.iter().map(|&(c, _)| c).collect();
        let closest = self.tree.closest_batch(&centres);
        let sides = self.inside.sides(&centres);
        let mut largest = 0.0_f64;
        let mut places = Vec::new();
        for ((&(_, radius), closest), side) in balls.iter().zip(&closest).zip(sides) {
            let is_out = side == Side::Outside;
            let depth = if is_out { -closest.distance } else { closest.distance };
            let reach = radius - depth;
            largest = largest.max(reach);
            if reach > BOUND
                || pierced.is_some_and(|share: f64| is_out && closest.distance > share * radius)
            {
                places.push(Place { point: closest.point, clear: reach.min(radius) });
            }
        }
        (places, largest)
    }

    /// Step 2, the points of the surface that are not covered, with the largest distance of one.
    fn uncovered(&self, medial: &MedialMesh, tested: &[Vec3]) -> (Vec<Place>, f64) {
        let Ok(union) = MedialUnion::new(medial) else {
            let places = tested.iter().map(|&point| Place { point, clear: BOUND }).collect();
            return (places, f64::INFINITY);
        };
        let gaps = union.signed_batch(tested);
        let largest = gaps.iter().copied().fold(0.0, f64::max);
        let far = tested.iter().zip(&gaps).filter(|&(_, &gap)| gap > BOUND);
        (far.map(|(&point, &clear)| Place { point, clear }).collect(), largest)
    }

    /// Step 3, tetrahedra that are on another side than the centre of their ball.
    fn inconsistent(&self, diagram: &Diagram, pierced: f64) -> Vec<Place> {
        let triangulation = diagram.delaunay.triangulation();
        let cells: Vec<_> = triangulation
            .finite_cells()
            .zip(diagram.cells.circumspheres())
            .filter_map(|(cell, sphere)| Some((cell, (*sphere)?)))
            .collect();
        let middles: Vec<Vec3> = cells
            .iter()
            .map(|&(cell, _)| {
                let corners = triangulation.vertices(cell).map(|v| diagram.delaunay.point(v));
                corners.into_iter().sum::<Vec3>() / 4.0
            })
            .collect();
        let sides = self.inside.sides(&middles);
        let odd: Vec<_> = cells
            .into_iter()
            .zip(sides)
            .filter(|&((cell, _), side)| (side == Side::Inside) != diagram.cells.is_inside(cell))
            .map(|((_, sphere), _)| sphere)
            .collect();
        let centres: Vec<Vec3> = odd.iter().map(|sphere| sphere.centre).collect();
        let closest = self.tree.closest_batch(&centres);
        odd.iter()
            .zip(closest)
            .filter(|(sphere, closest)| sphere.radius - closest.distance > pierced * sphere.radius)
            .map(|(sphere, closest)| Place {
                point: closest.point,
                clear: sphere.radius - closest.distance,
            })
            .collect()
    }

    /// Step 4: of some places, the worst first, new samples that are clear of each other.
    fn spread(&self, places: Vec<Place>, samples: &[Vec3]) -> Vec<Vec3> {
        let old = PointTree::new(samples);
        let distance = |p: Vec3| old.nearest(p).map_or(f64::INFINITY, |(_, d)| d.sqrt());
        let mut new = Growing::default();
        // The worst first: a new sample makes lesser places near it superfluous.
        for Place { mut point, clear } in places {
            if new.distance(point) < 0.5 * clear {
                continue;
            }
            if distance(point) < CLEAR * clear {
                // Occupied: of the points around, the one farthest from all samples.
                let around = icosahedron().map(|d| self.tree.closest(point + clear * d).point);
                point = around
                    .into_iter()
                    .max_by(|a: &Vec3, b: &Vec3| distance(*a).total_cmp(&distance(*b)))
                    .unwrap_or(point);
            }
            if distance(point).min(new.distance(point)) > CLEAR * clear {
                new.push(point);
            }
        }
        new.points
    }

    /// Points of the surface at which it is tested whether it is covered.
    fn tested(&self) -> Vec<Vec3> {
        let sampling = Sampling::AreaUniform { count: TESTED, seed: 0 };
        let mut points = sample(self.mesh, &sampling);
        points.extend((0..self.mesh.faces.len()).map(|face| {
            let [a, b, c] = self.mesh.triangle(face);
            (a + b + c) / 3.0
        }));
        points
    }

    /// Step 5: in each face the middle of its longest side, each once; where that is a sample already, the
    /// middle of the face.
    fn halved(&self, samples: &[Vec3]) -> Vec<Vec3> {
        let middles = (0..self.mesh.faces.len()).map(|face| {
            let [a, b, c] = self.mesh.triangle(face);
            let sides = [(a, b), (b, c), (c, a)];
            let (p, q) = sides
                .iter()
                .max_by(|x: &&(Vec3, Vec3), y: &&(Vec3, Vec3)| {
                    x.0.distance_squared(x.1).total_cmp(&y.0.distance_squared(y.1))
                })
                .copied()
                .unwrap_or((a, b));
            (p.midpoint(q), (a + b + c) / 3.0)
        });
        let mut taken: std::collections::BTreeSet<[u64; 3]> = samples.iter().map(bits).collect();
        let mut added = Vec::new();
        for (middle, centre) in middles {
            let point = if taken.contains(&bits(&middle)) { centre } else { middle };
            if taken.insert(bits(&point)) {
                added.push(point);
            }
        }
        added
    }
}

fn bits(p: &Vec3) -> [u64; 3] {
    p.to_array().map(f64::to_bits)
}

/// The Voronoi diagram of some samples and its medial mesh.
struct Diagram {
    samples: Arc<[Vec3]>,
    delaunay: Delaunay,
    cells: CellSpheres,
    medial: MedialMesh,
}

impl Diagram {
    fn new(of: &Refinement<'_>, samples: &[Vec3]) -> Result<Self, TriangulationError> {
        let samples: Arc<[Vec3]> = samples.into();
        let delaunay = Delaunay::new(&samples)?;
        let cells = CellSpheres::classify(&delaunay, of.inside, of.tree);
        let facets = VoronoiFacets::new(&delaunay, &cells);
        let medial = voronoi_medial_mesh(&delaunay, &cells, &facets, &samples, of.dual);
        Ok(Self { samples, delaunay, cells, medial })
    }
}

/// The balls of a medial mesh, and the interpolated ones in the middle of its edges and triangles.
fn barycentres(medial: &MedialMesh) -> Vec<(Vec3, f64)> {
    let spheres = medial.spheres.iter().map(|s| (s.centre, s.radius));
    let edges = medial.edges.iter().map(|e| mean_ball(medial, e));
    spheres.chain(edges).chain(medial.faces.iter().map(|f| mean_ball(medial, f))).collect()
}

fn mean_ball(medial: &MedialMesh, corners: &[u32]) -> (Vec3, f64) {
    let share = 1.0 / corners.len() as f64;
    let (centre, radius) = corners.iter().fold((Vec3::ZERO, 0.0), |(centre, radius), &v| {
        let ball = medial.spheres[v as usize];
        (centre + ball.centre, radius + ball.radius)
    });
    (centre * share, radius * share)
}

// Nearest-point queries on a growing set of points.

/// A growing set of points: trees over consecutive runs, each run longer than the next, and a tail that
/// is searched linearly.
#[derive(Default)]
pub(super) struct Growing {
    /// In the order in which they came.
    pub points: Vec<Vec3>,
    trees: Vec<PointTree>,
}

/// Up to this many points a linear search is cheaper than a tree.
const TAIL: usize = 64;

impl Growing {
    fn in_trees(&self) -> usize {
        self.trees.iter().map(PointTree::len).sum()
    }

    /// Adds a point. Costs `O(log^2 n)` on average.
    pub fn push(&mut self, point: Vec3) {
        self.points.push(point);
        let mut first = self.in_trees();
        if self.points.len() - first < TAIL {
            return;
        }
        while let Some(last) = self.trees.pop_if(|last| last.len() <= self.points.len() - first) {
            first -= last.len();
        }
        self.trees.push(PointTree::new(&self.points[first..]));
    }

    /// The distance of the nearest point, infinite without any.
    pub fn distance(&self, p: Vec3) -> f64 {
        let near = self.trees.iter().filter_map(|tree| Some(tree.nearest(p)?.1));
        let tail = self.points[self.in_trees()..].iter().map(|q| q.distance_squared(p));
        near.chain(tail).fold(f64::INFINITY, f64::min).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    use super::*;

    #[test]
    fn the_nearest_of_all_so_far() {
        let mut rng = Pcg64::seed_from_u64(5);
        let mut point = || Vec3::new(rng.random(), rng.random(), rng.random());
        let mut growing = Growing::default();
        assert_eq!(growing.distance(Vec3::ZERO), f64::INFINITY);
        for _ in 0..700 {
            growing.push(point());
            let query = point();
            let all = growing.points.iter().map(|p| p.distance_squared(query));
            assert_eq!(growing.distance(query), all.fold(f64::INFINITY, f64::min).sqrt());
        }
        assert!(growing.trees.len() > 1 && growing.trees.len() < 8);
    }
}
