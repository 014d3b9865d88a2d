//! Spike measures. No paper defines a count; these look at a spike from six sides.
//!
//! With the stability ratio `G` of an edge ([`stability_ratio`]) and a threshold `tau`:
//!
//! 1. share of the edges with `G < tau`, by number and by length;
//! 2. connected components of the edges with `G < tau` that reach the boundary of the mesh: the
//!    "number of spikes";
//! 3. dangling edges: no face, and an end with no other edge; all, and those with `G < tau`;
//! 4. fins: faces with two boundary edges or three, and a smallest angle below 10 degrees;
//! 5. idle spheres: on the boundary, with a ball that sticks out of a neighbour's at least as
//!    large by less than `eta`;
//! 6. angle spikes: spheres whose contact points subtend less than 20 degrees at the centre.
//!
//! An edge is a *boundary edge* when it has one face, a sphere is *on the boundary* when one of
//! its edges has at most one face.
//!
//! None is zero on every exact axis. On a sheet with object angle `a` the ratio goes down to
//! `1 - cos a`: 0.29 on a box, 0.13 at a convex edge of 120 degrees, 0 at the rim of a smooth
//! shape. Compare with the value on the exact axis, not with zero.

use super::counts::degrees;
use super::quality::{corners, extreme_angles};
use super::{RatioSpikes, Spikes};
use crate::complex::{
    Contacts, DisjointSets, Incidence, MedialMesh, Sphere, ZERO_LENGTH, stability_ratio,
};

/// The thresholds `tau` on the stability ratio.
pub const RATIO_THRESHOLDS: [f64; 3] = [0.05, 0.1, 0.2];
/// How far an idle sphere may stick out, as a fraction of the bounding-box diagonal.
pub const IDLE_PROTRUSION: f64 = 1e-3;
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

/// What measures 1 to 3 ask of the edges, once for all thresholds.
struct EdgeFacts {
    ratios: Vec<f64>,
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
        let dangling = mesh.edges.iter().zip(faces_at).map(|(edge, &faces)| {
            faces == 0 && edge.iter().any(|&sphere| degrees[sphere as usize] == 1)
        });
        Self {
            ratios: ends().map(|[a, b]| stability_ratio(a, b)).collect(),
            lengths: ends().map(|[a, b]| a.centre.distance(b.centre)).collect(),
            dangling: dangling.collect(),
            boundary_spheres,
        }
    }

    fn by_ratio(&self, mesh: &MedialMesh, threshold: f64) -> RatioSpikes {
        let weak = || (0..self.ratios.len()).filter(|&edge| self.ratios[edge] < threshold);
        let share = |part: f64, all: f64| if all > 0.0 { part / all } else { 0.0 };
        let weak_length = weak().map(|edge| self.lengths[edge]).sum();
        RatioSpikes {
            threshold,
            edge_share: share(weak().count() as f64, self.ratios.len() as f64),
            length_share: share(weak_length, self.lengths.iter().sum()),
            spikes: self.components_on_the_boundary(mesh, weak()),
            dangling_edges: weak().filter(|&edge| self.dangling[edge]).count() as u64,
        }
    }

    fn components_on_the_boundary(
        &self,
        mesh: &MedialMesh,
        edges: impl Iterator<Item = usize>,
    ) -> u64 {
        let mut components = DisjointSets::singletons(mesh.spheres.len());
        let mut touched = vec![false; mesh.spheres.len()];
        for [a, b] in edges.map(|edge| mesh.edges[edge]) {
            components.join(a, b);
            touched[a as usize] = true;
            touched[b as usize] = true;
        }
        let mut reaches = vec![false; mesh.spheres.len()];
        for sphere in 0..mesh.spheres.len() {
            if touched[sphere] && self.boundary_spheres[sphere] {
                reaches[components.find(sphere as u32) as usize] = true;
            }
        }
        reaches.into_iter().filter(|&r| r).count() as u64
    }
}

/// Measure 4.
fn fins(mesh: &MedialMesh, incidence: &Incidence) -> u64 {
    let is_fin = |face: usize| {
        let sides = incidence.face_edges()[face];
        let boundary =
            sides.iter().filter(|&&edge| incidence.faces_at()[edge as usize] == 1).count();
        let angles = || extreme_angles(corners(mesh, &mesh.faces[face]));
        // A triangle without area is a fin as well: its smallest angle is zero.
        boundary >= 2 && angles().is_none_or(|[smallest, _]| smallest < FIN_ANGLE)
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

/// Whether a ball sticks out of another, at least as large, by less than [`IDLE_PROTRUSION`].
fn is_idle_beside(ball: Sphere, neighbour: Sphere) -> bool {
    let growth = neighbour.radius - ball.radius;
    growth >= 0.0 && ball.centre.distance(neighbour.centre) - growth < IDLE_PROTRUSION
}

/// Measure 6. A sphere without radius touches everywhere at its centre and subtends nothing.
fn angle_spikes(mesh: &MedialMesh, contacts: &Contacts) -> u64 {
    let is_spike = |(sphere, samples): (&Sphere, &[u32; 4])| {
        sphere.radius >= ZERO_LENGTH && separation_angle(sphere, samples, contacts) < SPIKE_ANGLE
    };
    mesh.spheres.iter().zip(&contacts.of_sphere).filter(|&pair| is_spike(pair)).count() as u64
}

/// Largest angle between two contact points seen from the centre, in degrees.
fn separation_angle(sphere: &Sphere, samples: &[u32; 4], contacts: &Contacts) -> f64 {
    let directions = samples.map(|id| contacts.samples[id as usize] - sphere.centre);
    let pairs = (0..4).flat_map(|i| (i + 1..4).map(move |j| (i, j)));
    pairs.map(|(i, j)| directions[i].angle_between(directions[j]).to_degrees()).fold(0.0, f64::max)
}

#[cfg(test)]
#[path = "spikes_tests.rs"]
mod tests;
