//! Step 1, section 3: duplicates, recognised by their samples.
//!
//! 1. *Poles.* The inner pole of a sample is its farthest Voronoi vertex inside. Vertices that are
//!    equally far, up to rounding, all are poles: on a grid every sample has several, and which one
//!    rounding prefers would tear the ends of sheets.
//! 2. *Balls.* More than four cospherical samples give several Delaunay tetrahedra with one circumcentre,
//!    and as many polar balls. Tetrahedra that share a triangle and have the same circumcentre, up to
//!    rounding, are one pole: one ball, with all their samples, and with the volume of all.
//! 3. *Corners.* Polar balls meet in samples, so that many corners of their union are one sample. A corner
//!    is at a sample if its three balls have that in common, on its side of the plane of their
//!    centres ([`shared_sample`]).

use medial::Vec3;
use medial::complex::{CellSpheres, Sphere, UnionAxis};
use medial::geometry::predicates::{Sign, orient3d};
use medial::geometry::{CellId, Delaunay, UnionVertex};
use medial::shape::{Shape, ShapeError};

/// Polar balls, each once.
#[derive(Default)]
pub(super) struct DistinctBalls {
    pub(super) balls: Vec<Sphere>,
    /// For each ball all samples that it passes through; none where there are no samples.
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
        let (delaunay, cells) = (shape.delaunay()?, shape.cells()?);
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
            // Says why.
            shape.inner_balls()?;
        }
        Ok(found)
    }

    /// Balls of which no samples are known.
    pub(super) fn given(balls: &[Sphere]) -> Self {
        let (samples, volumes) = (vec![Vec::new(); balls.len()], vec![0.0; balls.len()]);
        Self { balls: balls.to_vec(), samples, volumes }
    }

    /// The samples that a ball passes through.
    pub(super) fn samples_of(&self, ball: u32) -> &[u32] {
        &self.samples[ball as usize]
    }

    /// For each corner of the union of the balls, moved and grown to `moved`, its sample.
    pub(super) fn samples_of_corners(
        &self,
        shape: &Shape,
        moved: &[Sphere],
        union: &UnionAxis,
    ) -> Vec<Option<u32>> {
        let positions = shape.samples();
        let at = |vertex| {
            shared_sample(
                vertex,
                |ball| moved[ball as usize].centre,
                |ball| &self.samples[ball as usize],
                |sample| positions[sample as usize],
            )
        };
        union.corners().iter().map(at).collect()
    }
}

/// The sample in which the three polar balls of a vertex meet on its side of their centres' plane:
/// a key for `UnionBoundary::merge`. `None` if they have no sample in common there.
///
/// `centre` gives the centre of a ball, `samples` the samples that it passes through, and `position` that of
/// a sample. Balls that were grown no longer pass through their samples.
fn shared_sample<S: AsRef<[u32]>>(
    vertex: &UnionVertex,
    centre: impl Fn(u32) -> Vec3,
    samples: impl Fn(u32) -> S,
    position: impl Fn(u32) -> Vec3,
) -> Option<u32> {
    let lists = vertex.balls.map(&samples);
    let [a, b, c] = lists.each_ref().map(AsRef::as_ref);
    let [p, q, r] = vertex.balls.map(centre);
    let distance = |s: &u32| position(*s).distance_squared(vertex.position);
    a.iter()
        .copied()
        .filter(|s| b.contains(s) && c.contains(s))
        // Three spheres meet in a point and its mirror image, so the side tells which.
        .filter(|&s| orient3d(p, q, r, position(s)) != Sign::Negative)
        .min_by(|s, t| distance(s).total_cmp(&distance(t)).then(s.cmp(t)))
}

/// For each finite cell whether it is an inner pole: no Voronoi vertex inside is farther from one of its
/// samples.
fn poles(delaunay: &Delaunay, cells: &CellSpheres) -> Vec<bool> {
    let spheres = cells.circumspheres();
    let inside = |c: &CellId| cells.is_inside(*c);
    let radius = |c: CellId| spheres[c.index()].map_or(0.0, |s| s.radius);
    let mut farthest = vec![0.0_f64; delaunay.point_count()];
    for cell in delaunay.finite_cells().filter(inside) {
        for v in delaunay.vertices(cell) {
            farthest[v.index()] = farthest[v.index()].max(radius(cell));
        }
    }
    let mut is_pole = vec![false; spheres.len()];
    for cell in delaunay.finite_cells().filter(inside) {
        let enough = radius(cell) * (1.0 + COINCIDENT);
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
