//! Spike measures. No paper defines a count, so there are six measures of different aspects.
//!
//! With the stability ratio `G` of an edge ([`stability_ratio`]) and a threshold `tau`:
//!
//! 1. share of the edges with `G < tau`, by number and by length;
//! 2. connected components of the edges with `G < tau` that reach the boundary of the mesh: the
//!    "number of spikes";
//! 3. dangling edges: no face, and an end with no other edge; all, and those with `G < tau`;
//! 4. fins: faces with two or three boundary edges and a smallest angle below 10 degrees;
//! 5. idle spheres: on the boundary, with a ball that protrudes by less than `eta` from the ball of a
//!    neighbour that is, up to rounding, at least as large;
//! 6. angle spikes: spheres whose contact points subtend less than 20 degrees at the centre.
//!
//! Coincident spheres make no spike: edges below [`ZERO_LENGTH`] are left out of measures 1 to 3 (of
//! the shares in numerator and denominator), triangles without area out of measure 4. In a regular
//! grid many circumcentres coincide. Their edges have the ratio zero by convention, so a perfect axis
//! would look worse than a noisy one.
//!
//! An edge is a *boundary edge* when it has one face, a sphere is *on the boundary* when one of
//! its edges has at most one face.
//!
//! No measure is zero on every exact axis. On a sheet with object angle `a` the ratio can be as small
//! as `1 - cos a`: 0.29 on a box, 0.13 at a convex edge of 120 degrees, 0 at the rim of a smooth
//! shape. Compare with the value on the exact axis, not with zero.

use super::evaluation::{RatioSpikes, Spikes};
use super::hausdorff::Envelope;
use super::quality::{corners, degrees, extreme_angles};
use crate::complex::{Contacts, Incidence, MedialMesh, Sphere, ZERO_LENGTH, stability_ratio};
use crate::geometry::{DisjointSets, separation_angle};
use crate::surface::{InsideTest, Side};

/// The thresholds `tau` on the stability ratio.
pub const RATIO_THRESHOLDS: [f64; 3] = [0.05, 0.1, 0.2];
/// Largest protrusion of an idle sphere, as a fraction of the bounding-box diagonal.
pub const IDLE_PROTRUSION: f64 = 1e-3;
/// Radii that differ by less count as equal, as a fraction of the bounding-box diagonal. Otherwise
/// rounding would decide about plates and tubes, whose radii are equal.
pub const EQUAL_RADII: f64 = 1e-9;
/// Smallest angle of a fin, in degrees.
pub const FIN_ANGLE: f64 = 10.0;
/// Separation angle of an angle spike, in degrees.
pub const SPIKE_ANGLE: f64 = 20.0;

/// All spike measures of a medial mesh, lengths in units of the bounding-box diagonal.
///
/// Angle spikes need contact points and are `None` without. Cost `O(V + E + F)`.
///
/// # Panics
/// If the mesh is not in canonical form; see [`MedialMesh::check`].
pub fn spikes(mesh: &MedialMesh) -> Spikes {
    let incidence = Incidence::of(mesh);
    let edges = EdgeFacts::of(mesh, &incidence);
    Spikes {
        by_ratio: RATIO_THRESHOLDS.iter().map(|&tau| edges.by_ratio(mesh, tau)).collect(),
        dangling_edges: edges.dangling.iter().filter(|&&d| d).count() as u64,
        fins: fins(mesh, &incidence),
        idle_spheres: idle_spheres(mesh, &edges.boundary_spheres),
        angle_spikes: mesh.contacts.as_ref().map(|contacts| angle_spikes(mesh, contacts)),
    }
}

/// The properties of edges for measures 1 to 3, computed once for all thresholds.
struct EdgeFacts {
    ratios: Vec<f64>,
    /// Zero where the ends coincide.
    lengths: Vec<f64>,
    dangling: Vec<bool>,
    boundary_spheres: Vec<bool>,
}

impl EdgeFacts {
    fn of(mesh: &MedialMesh, incidence: &Incidence) -> Self {
        let ends: Vec<[Sphere; 2]> = mesh.edges.iter().map(|&edge| mesh.spheres_of(edge)).collect();
        let degrees = degrees(mesh);
        let faces_at = incidence.faces_at();
        let mut boundary_spheres = vec![false; mesh.spheres.len()];
        for (edge, _) in mesh.edges.iter().zip(faces_at).filter(|&(_, &faces)| faces <= 1) {
            edge.iter().for_each(|&sphere| boundary_spheres[sphere as usize] = true);
        }
        // Shorter edges count as points: their direction and ratio are rounding.
        let lengths: Vec<f64> = ends
            .iter()
            .map(|[a, b]| a.centre.distance(b.centre))
            .map(|length| if length < ZERO_LENGTH { 0.0 } else { length })
            .collect();
        let mut dangling = vec![false; lengths.len()];
        for (edge, ends) in mesh.edges.iter().enumerate() {
            let is_loose = ends.iter().any(|&sphere| degrees[sphere as usize] == 1);
            dangling[edge] = lengths[edge] > 0.0 && faces_at[edge] == 0 && is_loose;
        }
        Self {
            ratios: ends.into_iter().map(|[a, b]| stability_ratio(a, b)).collect(),
            dangling,
            lengths,
            boundary_spheres,
        }
    }

    fn by_ratio(&self, mesh: &MedialMesh, threshold: f64) -> RatioSpikes {
        let mut proper: Vec<usize> = (0..self.lengths.len()).collect();
        proper.retain(|&edge| self.lengths[edge] > 0.0);
        let mut weak = proper.clone();
        weak.retain(|&edge| self.ratios[edge] < threshold);
        // Folds from zero, since the sum of nothing is minus zero.
        let weak_length = weak.iter().fold(0.0, |sum, &edge| sum + self.lengths[edge]);
        let length = proper.iter().fold(0.0, |sum, &edge| sum + self.lengths[edge]);
        RatioSpikes {
            threshold,
            edge_share: share(weak.len() as f64, proper.len() as f64),
            length_share: share(weak_length, length),
            spikes: self.spikes_on_the_boundary(mesh, threshold),
            dangling_edges: weak.iter().filter(|&&edge| self.dangling[edge]).count() as u64,
        }
    }

    /// Measure 2. Edges without length extend a component, but alone they are none.
    fn spikes_on_the_boundary(&self, mesh: &MedialMesh, threshold: f64) -> u64 {
        let mut weak: Vec<usize> = (0..self.ratios.len()).collect();
        weak.retain(|&edge| self.ratios[edge] < threshold);
        let mut components = DisjointSets::singletons(mesh.spheres.len());
        for &edge in &weak {
            let [a, b] = mesh.edges[edge];
            components.join(a, b);
        }
        let mut on_boundary = vec![false; mesh.spheres.len()];
        for sphere in (0..mesh.spheres.len()).filter(|&sphere| self.boundary_spheres[sphere]) {
            on_boundary[components.find(sphere as u32) as usize] = true;
        }
        let mut counted = vec![false; mesh.spheres.len()];
        for edge in weak.into_iter().filter(|&edge| self.lengths[edge] > 0.0) {
            let component = components.find(mesh.edges[edge][0]) as usize;
            counted[component] = on_boundary[component];
        }
        counted.into_iter().filter(|&c| c).count() as u64
    }
}

/// A part of a whole, 0 where there is no whole.
fn share(part: f64, all: f64) -> f64 {
    if all > 0.0 { part / all } else { 0.0 }
}

/// Measure 4.
fn fins(mesh: &MedialMesh, incidence: &Incidence) -> u64 {
    let faces_at = incidence.faces_at();
    let mut fins = 0;
    for (face, sides) in mesh.faces.iter().zip(incidence.face_edges()) {
        let boundary = sides.iter().filter(|&&edge| faces_at[edge as usize] == 1).count();
        // A face without area has no angles, and is no fin.
        if boundary >= 2
            && extreme_angles(corners(mesh, face)).is_some_and(|[min, _]| min < FIN_ANGLE)
        {
            fins += 1;
        }
    }
    fins
}

/// Measure 5.
fn idle_spheres(mesh: &MedialMesh, boundary: &[bool]) -> u64 {
    let mut idle = vec![false; mesh.spheres.len()];
    for &[a, b] in &mesh.edges {
        for (v, u) in [(a, b), (b, a)] {
            let (ball, neighbour) = (mesh.spheres[v as usize], mesh.spheres[u as usize]);
            if boundary[v as usize] && is_idle_next_to(ball, neighbour) {
                idle[v as usize] = true;
            }
        }
    }
    idle.into_iter().filter(|&i| i).count() as u64
}

/// Whether a ball protrudes by less than [`IDLE_PROTRUSION`] from another that is at least as large,
/// up to [`EQUAL_RADII`].
fn is_idle_next_to(ball: Sphere, neighbour: Sphere) -> bool {
    let growth = neighbour.radius - ball.radius;
    growth > -EQUAL_RADII && ball.centre.distance(neighbour.centre) - growth < IDLE_PROTRUSION
}

/// Measure 6. A sphere without radius touches everywhere at its centre and subtends nothing.
fn angle_spikes(mesh: &MedialMesh, contacts: &Contacts) -> u64 {
    let mut spikes = 0;
    for (sphere, samples) in mesh.spheres.iter().zip(&contacts.of_sphere) {
        let points = samples.map(|id| contacts.samples[id as usize]);
        if sphere.radius >= ZERO_LENGTH
            && separation_angle(sphere.centre, &points).to_degrees() < SPIKE_ANGLE
        {
            spikes += 1;
        }
    }
    spikes
}

// How far the union of the medial primitives extends beyond the solid.
//
// The points are those of the reverse distance: samples of the union's boundary, and points that the
// ascent reached from them. They are tested from the farthest from the surface on; the first one
// outside the solid gives the protrusion.

/// Points that are tested together. Usually the first batch decides.
const BATCH: usize = 1024;

/// Largest distance from the surface of a boundary point of the union that is outside the solid, 0
/// where none is. A sampled maximum: a lower bound.
pub(super) fn protrusion(envelope: &Envelope, inside: &InsideTest) -> f64 {
    let Envelope { points, distances } = envelope;
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|&a, &b| distances[b].total_cmp(&distances[a]).then(a.cmp(&b)));
    for batch in order.chunks(BATCH) {
        let tested: Vec<_> = batch.iter().map(|&k| points[k]).collect();
        let sides = inside.sides(&tested);
        if let Some(first) = sides.iter().position(|side| *side == Side::Outside) {
            return distances[batch[first]];
        }
    }
    0.0
}

/// Share of the centres that are outside the solid.
pub(super) fn centres_outside(mesh: &MedialMesh, inside: &InsideTest) -> f64 {
    let centres: Vec<_> = mesh.spheres.iter().map(|s| s.centre).collect();
    let outside = inside.sides(&centres).into_iter().filter(|side| *side == Side::Outside).count();
    outside as f64 / centres.len().max(1) as f64
}

#[cfg(test)]
pub(super) mod tests {
    use std::sync::Arc;

    use proptest::prelude::*;

    use super::*;
    use crate::Vec3;
    use crate::complex::{MedialUnion, Sphere};
    use crate::metrics::{EnvelopeOptions, sample_envelope};
    use crate::surface::TriangleBvh;
    use crate::surface::fixtures::cuboid;

    fn sphere(x: f64, y: f64, z: f64, radius: f64) -> Sphere {
        Sphere::new(Vec3::new(x, y, z), radius)
    }

    /// The exact medial axis of a 3 by 2 by 1 box, divided by its diagonal: 13 sheets on 12 spheres.
    pub(in crate::metrics) fn box_axis() -> MedialMesh {
        let half = Vec3::new(1.5, 1.0, 0.5) / 14f64.sqrt();
        let signs = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        let inner =
            signs.map(|[x, y]| sphere(x * (half.x - half.z), y * (half.y - half.z), 0.0, half.z));
        let corner =
            |z: f64| signs.map(move |[x, y]| sphere(x * half.x, y * half.y, z * half.z, 0.0));
        let spheres = [inner, corner(-1.0), corner(1.0)].concat();
        let mut faces = vec![[0, 1, 2], [0, 2, 3]];
        for i in 0..4 {
            let j = (i + 1) % 4;
            faces.push([i, 4 + i, 8 + i]);
            for level in [4, 8] {
                faces.extend([[i, j, level + j], [i, level + j, level + i]]);
            }
        }
        MedialMesh::from_simplices(spheres, vec![], faces).unwrap()
    }

    #[test]
    fn the_exact_axis_of_a_box_has_no_spike() {
        let axis = box_axis();
        assert_eq!((axis.spheres.len(), axis.edges.len(), axis.faces.len()), (12, 33, 22));
        assert_eq!(crate::complex::betti(&axis), [1, 0, 0]);
        let measured = spikes(&axis);
        for at in &measured.by_ratio {
            assert_eq!(
                (at.edge_share, at.length_share, at.spikes, at.dangling_edges),
                (0.0, 0.0, 0, 0)
            );
        }
        assert_eq!((measured.dangling_edges, measured.fins, measured.angle_spikes), (0, 0, None));
        let lowest =
            EdgeFacts::of(&axis, &Incidence::of(&axis)).ratios.into_iter().fold(1.0, f64::min);
        assert!(
            lowest >= 1.0 - 0.5f64.sqrt() - 1e-12,
            "on a box G is at least 1 - cos 45, not {lowest}"
        );
    }

    #[test]
    fn spikes_put_on_the_box_are_counted_one_by_one() {
        let mut mesh = box_axis();
        let n = mesh.spheres.len() as u32;
        // Two dangling edges, one of them a spike, and a sliver that hangs on an edge of the centre.
        mesh.spheres.extend([sphere(0.0, 0.0, 0.0, 0.13), sphere(0.05, 0.0, 0.0, 0.081)]);
        mesh.spheres.extend([sphere(0.0, 0.1, 0.0, 0.13), sphere(0.3, 0.0, 0.0, 0.03)]);
        mesh.edges.extend([[0, n], [n, n + 1], [0, n + 2]]);
        mesh.faces.push([1, 2, n + 3]);
        let mesh = MedialMesh::from_simplices(mesh.spheres, mesh.edges, mesh.faces).unwrap();
        let measured = spikes(&mesh);
        assert_eq!(measured.dangling_edges, 2);
        let spike_counts: Vec<_> =
            measured.by_ratio.iter().map(|at| (at.spikes, at.dangling_edges)).collect();
        // The edge to sphere n + 1 has G = 0.02; no other edge is below 0.2.
        assert_eq!(spike_counts, [(1, 1); 3]);
        let edges = mesh.edges.len() as f64;
        assert!((measured.by_ratio[0].edge_share - 1.0 / edges).abs() < 1e-15);
    }

    #[test]
    fn a_fin_has_two_free_sides_and_a_small_angle() {
        let triangle = |y: f64| {
            let spheres = vec![
                sphere(0.0, 0.0, 0.0, 0.5),
                sphere(1.0, 0.0, 0.0, 0.5),
                sphere(1.0, 1.0, 0.0, 0.5),
                sphere(2.0, y, 0.0, 0.5),
            ];
            MedialMesh::from_simplices(spheres, vec![], vec![[0, 1, 2], [1, 2, 3]]).unwrap()
        };
        assert_eq!(spikes(&triangle(0.5)).fins, 0);
        assert_eq!(spikes(&triangle(8.0)).fins, 1);
        let mut closed = triangle(8.0);
        closed.spheres.push(sphere(9.0, 0.0, 5.0, 0.5));
        closed.faces.push([1, 3, 4]);
        let closed = MedialMesh::from_simplices(closed.spheres, vec![], closed.faces).unwrap();
        assert_eq!(spikes(&closed).fins, 0, "one side of the sliver is no longer free");
    }

    #[test]
    fn an_idle_sphere_hardly_sticks_out_of_a_larger_neighbour() {
        let pair = |radius: f64| {
            let spheres = vec![sphere(0.0, 0.0, 0.0, 0.5), sphere(0.1, 0.0, 0.0, radius)];
            MedialMesh::from_simplices(spheres, vec![[0, 1]], vec![]).unwrap()
        };
        assert_eq!(spikes(&pair(0.3)).idle_spheres, 1);
        assert_eq!(spikes(&pair(0.4005)).idle_spheres, 1);
        assert_eq!(spikes(&pair(0.402)).idle_spheres, 0);
        assert_eq!(spikes(&pair(0.7)).idle_spheres, 1, "the other one is idle now");
    }

    #[test]
    fn an_angle_spike_sees_its_contacts_close_together() {
        let samples_at = |degrees: f64| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            vec![Vec3::X, Vec3::new(cos, sin, 0.0), Vec3::X, Vec3::new(cos, sin, 0.0)]
        };
        for (degrees, expected) in [(19.9, 1), (20.1, 0), (180.0, 0)] {
            let mut mesh =
                MedialMesh::from_simplices(vec![sphere(0.0, 0.0, 0.0, 1.0)], vec![], vec![])
                    .unwrap();
            let samples: Arc<[Vec3]> = samples_at(degrees).into();
            mesh.contacts = Some(Contacts { samples, of_sphere: vec![[0, 1, 2, 3]] });
            assert_eq!(spikes(&mesh).angle_spikes, Some(expected), "{degrees} degrees");
        }
    }

    #[test]
    fn nothing_is_measured_on_nothing() {
        let measured = spikes(&MedialMesh::default());
        for at in measured.by_ratio {
            let shares = [at.edge_share, at.length_share];
            assert!(
                shares.iter().all(|share| share.to_bits() == 0),
                "{shares:?} is not plain zero"
            );
        }
    }

    #[test]
    fn coincident_spheres_make_no_spike_but_carry_one_on() {
        let chain = |xs: &[f64]| {
            let spheres = xs.iter().map(|&x| sphere(x, 0.0, 0.0, 0.5 - 0.99 * x)).collect();
            let edges = (1..xs.len() as u32).map(|i| [i - 1, i]).collect();
            MedialMesh::from_simplices(spheres, edges, vec![]).unwrap()
        };
        let none = spikes(&chain(&[0.0, 0.0, 1e-13])).by_ratio[0];
        assert_eq!((none.edge_share, none.spikes, none.dangling_edges), (0.0, 0, 0));
        // Two weak edges, and two that have no length between and after them: one spike.
        let one = spikes(&chain(&[0.0, 0.1, 0.1, 0.2, 0.2])).by_ratio[0];
        assert_eq!((one.edge_share, one.length_share, one.spikes), (1.0, 1.0, 1));
        assert_eq!(one.dangling_edges, 1);
    }

    proptest! {
        /// Measure 2 is by definition a flood over weak edges from boundary spheres.
        #[test]
        fn spike_components_agree_with_a_flood(
            radii in prop::collection::vec(0.0..1.0f64, 8),
            edges in prop::collection::vec((0..8u32, 0..8u32), 0..12),
            faces in prop::collection::vec((0..8u32, 0..8u32, 0..8u32), 0..6),
        ) {
            let spheres: Vec<Sphere> =
                radii.iter().enumerate().map(|(i, &r)| sphere(i as f64, (i * i % 5) as f64, 0.0, r * 3.0)).collect();
            let edges = edges.into_iter().filter(|(a, b)| a != b).map(|(a, b)| [a, b]).collect();
            let faces = faces.into_iter().filter(|(a, b, c)| a != b && b != c && a != c);
            let mesh =
                MedialMesh::from_simplices(spheres, edges, faces.map(|(a, b, c)| [a, b, c]).collect()).unwrap();
            let at = spikes(&mesh).by_ratio[2];
            let weak: Vec<[u32; 2]> = mesh.edges.iter().copied().filter(|e| {
                let [a, b] = e.map(|i| mesh.spheres[i as usize]);
                stability_ratio(a, b) < 0.2
            }).collect();
            let on_boundary = |v: u32| mesh.edges.iter().any(|e| {
                let has = |f: &&[u32; 3]| e.iter().all(|i| f.contains(i));
                e.contains(&v) && mesh.faces.iter().filter(has).count() <= 1
            });
            let mut seen = [false; 8];
            let mut expected = 0;
            for start in weak.iter().flatten().copied().filter(|&v| on_boundary(v)) {
                if seen[start as usize] { continue; }
                expected += 1;
                let mut stack = vec![start];
                while let Some(v) = stack.pop() {
                    if std::mem::replace(&mut seen[v as usize], true) { continue; }
                    stack.extend(weak.iter().filter(|e| e.contains(&v)).flatten());
                }
            }
            prop_assert_eq!(at.spikes, expected);
        }
    }

    #[test]
    fn balls_that_leave_a_box() {
        let surface = cuboid(Vec3::splat(-0.5), Vec3::splat(0.5));
        let (tree, inside) = (TriangleBvh::new(&surface).unwrap(), InsideTest::new(&surface));
        let options = EnvelopeOptions { samples: 20_000, burial: 1e-9, seed: 0 };
        let of = |spheres: &[(f64, f64)]| {
            let spheres = spheres.iter().map(|&(x, r)| Sphere::new(Vec3::X * x, r)).collect();
            let mesh = MedialMesh::from_simplices(spheres, vec![], vec![]).unwrap();
            let union = MedialUnion::new(&mesh).unwrap();
            let points = sample_envelope(&mesh, &union, &options).unwrap();
            let distances = tree.distance_batch(&points);
            let far = protrusion(&Envelope { points, distances }, &inside);
            (far, centres_outside(&mesh, &inside))
        };
        assert_eq!(of(&[(0.0, 0.4)]), (0.0, 0.0));
        // The far pole of a ball at 0.3, and of one whose centre is outside.
        let (far, outside) = of(&[(0.0, 0.4), (0.3, 0.3)]);
        assert!((far - 0.1).abs() < 1e-3 && outside == 0.0, "{far}");
        let (far, outside) = of(&[(0.0, 0.4), (0.7, 0.1)]);
        assert!((far - 0.3).abs() < 1e-3 && outside == 0.5, "{far} {outside}");
    }
}
