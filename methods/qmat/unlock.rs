//! Collapses against the link condition that do not harm the topology.
//!
//! The link condition is sufficient for a collapse to keep the topology, not necessary. When it
//! rejects every edge left of a small complex, the Betti numbers decide: a collapse is taken if it
//! brings them no farther from those of the initial mesh. So a void that arose before the topology
//! was checked can be filled again, and a knot of spheres can be contracted in which each edge
//! violates the condition in two ways that cancel.
//!
//! Spheres whose centres coincide up to rounding can form a knot that no single collapse undoes.
//! Since they are one point in space, they are contracted together, on the same terms.

use std::collections::HashSet;

use medial::complex::collapse::{Candidate, Collapse, replay};
use medial::complex::{MedialMesh, Sphere, betti};

use super::contract::{Contraction, Decision, are_coincident};

/// Betti numbers of single collapses are computed up to this many spheres.
const MAX_UNLOCKED_SPHERES: usize = 500;

/// Spheres that become one: the others are merged into the first in their order, each of which then
/// shares an edge with it.
pub(super) struct Cluster {
    pub first: u32,
    pub others: Vec<u32>,
    pub sphere: Sphere,
}

impl Contraction {
    /// The cheapest edge whose collapse violates the link condition but not the topology of
    /// `initial`, else the first such cluster of coincident spheres. `None` when there is neither.
    pub(super) fn unlock(&mut self, initial: &MedialMesh) -> Option<Cluster> {
        // A cluster may hold several spheres that are to be kept.
        let is_tied = self.keeps_spheres() || !self.keeps_topology();
        if is_tied || self.sphere_count() > MAX_UNLOCKED_SPHERES {
            return None;
        }
        // Computed on demand: few runs get here.
        let goal = betti(initial);
        let mesh = self.to_mesh();
        let ids: Vec<u32> = self.complex().vertices().collect();
        // The mesh numbers the vertices left by ascending id.
        let place = |id: u32| ids.partition_point(|&other| other < id) as u32;
        let now = difference(betti(&mesh), goal);
        let keeps = |cluster: &Cluster| {
            let kept = place(cluster.first);
            let collapse = |&v: &u32| Collapse { kept, removed: place(v), sphere: cluster.sphere };
            let collapses: Vec<Collapse> = cluster.others.iter().map(collapse).collect();
            difference(betti(&replay(&mesh, &collapses)), goal) <= now
        };
        let edges = self.sorted_candidates().into_iter().filter_map(|candidate| {
            let [first, other] = candidate.ends();
            let sphere = self.placement_whatever_the_topology(candidate)?;
            Some(Cluster { first, others: vec![other], sphere })
        });
        edges.chain(self.coincident_clusters()).find(keeps)
    }

    /// The connected sets of three and more spheres whose centres are one point, in the order of
    /// their smallest ids.
    fn coincident_clusters(&self) -> Vec<Cluster> {
        let complex = self.complex();
        let mut seen = HashSet::new();
        let mut clusters = Vec::new();
        for first in complex.vertices() {
            if !seen.insert(first) {
                continue;
            }
            let mut members = vec![first];
            let mut next = 0;
            while next < members.len() {
                let v = members[next];
                next += 1;
                // The order of neighbours is deterministic, so the order of the members is, too.
                for &w in complex.neighbours(v) {
                    if are_coincident(complex.sphere(v), complex.sphere(w)) && seen.insert(w) {
                        members.push(w);
                    }
                }
            }
            if members.len() > 2 {
                let others = members.split_off(1);
                clusters.push(Cluster { first, others, sphere: complex.sphere(first) });
            }
        }
        clusters
    }

    /// The placement of the merged sphere of an edge; `None` if each folds a face over.
    fn placement_whatever_the_topology(&self, candidate: Candidate) -> Option<Sphere> {
        match self.place(candidate) {
            Decision::Collapse(sphere) => Some(sphere),
            // Ends: at the cost of its placement the candidate is not postponed again.
            Decision::Postpone(dearer) => self.placement_whatever_the_topology(dearer),
            Decision::Hold(_) | Decision::Fold(_) => None,
        }
    }
}

/// The sum of the absolute differences of the Betti numbers.
fn difference(betti: [u64; 3], goal: [u64; 3]) -> u64 {
    betti.iter().zip(goal).map(|(&number, goal)| number.abs_diff(goal)).sum()
}
