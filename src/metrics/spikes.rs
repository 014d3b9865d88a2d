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

use super::counts::degrees;
use super::quality::{corners, extreme_angles};
use super::{RatioSpikes, Spikes};
use crate::complex::{Contacts, Incidence, MedialMesh, Sphere, ZERO_LENGTH, stability_ratio};
use crate::geometry::DisjointSets;
use crate::geometry::separation_angle;

/// The thresholds `tau` on the stability ratio.
pub const RATIO_THRESHOLDS: [f64; 3] = [0.05, 0.1, 0.2];
/// Largest protrusion of an idle sphere, as a fraction of the bounding-box diagonal.
pub const IDLE_PROTRUSION: f64 = 1e-3;
/// Radii that differ by less count as equal, as a fraction of the bounding-box diagonal. Otherwise
/// rounding would decide about plates and tubes, whose radii are all the same.
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
        let ends = || mesh.edges.iter().map(|e| e.map(|sphere| mesh.spheres[sphere as usize]));
        let degrees = degrees(mesh);
        let faces_at = incidence.faces_at();
        let mut boundary_spheres = vec![false; mesh.spheres.len()];
        for (edge, _) in mesh.edges.iter().zip(faces_at).filter(|&(_, &faces)| faces <= 1) {
            edge.iter().for_each(|&sphere| boundary_spheres[sphere as usize] = true);
        }
        let length = |[a, b]: [Sphere; 2]| {
            let d = a.centre.distance(b.centre);
            if d < ZERO_LENGTH { 0.0 } else { d }
        };
        let lengths: Vec<f64> = ends().map(length).collect();
        let is_dangling = |edge: usize| {
            let loose = mesh.edges[edge].iter().any(|&sphere| degrees[sphere as usize] == 1);
            lengths[edge] > 0.0 && faces_at[edge] == 0 && loose
        };
        Self {
            ratios: ends().map(|[a, b]| stability_ratio(a, b)).collect(),
            dangling: (0..lengths.len()).map(is_dangling).collect(),
            lengths,
            boundary_spheres,
        }
    }

    fn by_ratio(&self, mesh: &MedialMesh, threshold: f64) -> RatioSpikes {
        let proper = || (0..self.lengths.len()).filter(|&edge| self.lengths[edge] > 0.0);
        let weak = || proper().filter(|&edge| self.ratios[edge] < threshold);
        // A fold from zero, since the sum of nothing is minus zero.
        let length = |edges: &mut dyn Iterator<Item = usize>| {
            edges.fold(0.0, |sum, edge| sum + self.lengths[edge])
        };
        let share = |part: f64, all: f64| if all > 0.0 { part / all } else { 0.0 };
        RatioSpikes {
            threshold,
            edge_share: share(weak().count() as f64, proper().count() as f64),
            length_share: share(length(&mut weak()), length(&mut proper())),
            spikes: self.spikes_on_the_boundary(mesh, threshold),
            dangling_edges: weak().filter(|&edge| self.dangling[edge]).count() as u64,
        }
    }

    /// Measure 2. Edges without length extend a component, but alone they are none.
    fn spikes_on_the_boundary(&self, mesh: &MedialMesh, threshold: f64) -> u64 {
        let weak = || (0..self.ratios.len()).filter(|&edge| self.ratios[edge] < threshold);
        let mut components = DisjointSets::singletons(mesh.spheres.len());
        for [a, b] in weak().map(|edge| mesh.edges[edge]) {
            components.join(a, b);
        }
        let mut on_boundary = vec![false; mesh.spheres.len()];
        for sphere in (0..mesh.spheres.len()).filter(|&sphere| self.boundary_spheres[sphere]) {
            on_boundary[components.find(sphere as u32) as usize] = true;
        }
        let mut counted = vec![false; mesh.spheres.len()];
        for edge in weak().filter(|&edge| self.lengths[edge] > 0.0) {
            let component = components.find(mesh.edges[edge][0]) as usize;
            counted[component] = on_boundary[component];
        }
        counted.into_iter().filter(|&c| c).count() as u64
    }
}

/// Measure 4.
fn fins(mesh: &MedialMesh, incidence: &Incidence) -> u64 {
    let is_fin = |face: usize| {
        let sides = incidence.face_edges()[face];
        let boundary =
            sides.iter().filter(|&&edge| incidence.faces_at()[edge as usize] == 1).count();
        let angles = || extreme_angles(corners(mesh, &mesh.faces[face]));
        boundary >= 2 && angles().is_some_and(|[smallest, _]| smallest < FIN_ANGLE)
    };
    (0..mesh.faces.len()).filter(|&face| is_fin(face)).count() as u64
}

/// Measure 5.
fn idle_spheres(mesh: &MedialMesh, boundary: &[bool]) -> u64 {
    let mut idle = vec![false; mesh.spheres.len()];
    for &[a, b] in &mesh.edges {
        for (v, u) in [(a, b), (b, a)] {
            let (ball, neighbour) = (mesh.spheres[v as usize], mesh.spheres[u as usize]);
            if boundary[v as usize] && is_idle_beside(ball, neighbour) {
                idle[v as usize] = true;
            }
        }
    }
    idle.into_iter().filter(|&i| i).count() as u64
}

/// Whether a ball protrudes by less than [`IDLE_PROTRUSION`] from another that is at least as large,
/// up to [`EQUAL_RADII`].
fn is_idle_beside(ball: Sphere, neighbour: Sphere) -> bool {
    let growth = neighbour.radius - ball.radius;
    growth > -EQUAL_RADII && ball.centre.distance(neighbour.centre) - growth < IDLE_PROTRUSION
}

/// Measure 6. A sphere without radius touches everywhere at its centre and subtends nothing.
fn angle_spikes(mesh: &MedialMesh, contacts: &Contacts) -> u64 {
    let is_spike = |(sphere, samples): (&Sphere, &[u32; 4])| {
        let points = samples.map(|id| contacts.samples[id as usize]);
        sphere.radius >= ZERO_LENGTH
            && separation_angle(sphere.centre, &points).to_degrees() < SPIKE_ANGLE
    };
    mesh.spheres.iter().zip(&contacts.of_sphere).filter(|&pair| is_spike(pair)).count() as u64
}

#[cfg(test)]
#[path = "spikes_tests.rs"]
mod tests;
