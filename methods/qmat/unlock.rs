//! What the link condition holds back although the topology would not suffer.
//!
//! The link condition is sufficient for a collapse to keep the topology, not necessary. When it
//! holds back every edge that is left of a small complex, the Betti numbers decide: a collapse is
//! taken when it brings them no farther from those of the initial mesh. So a void that was closed
//! off before the topology was watched can be filled again, and a knot of spheres in which each
//! edge violates the condition in two ways that cancel can be contracted.

use medial::complex::collapse::{Candidate, Collapse, replay};
use medial::complex::{MedialMesh, Sphere, betti};

use super::contract::{Contraction, Decision};

/// Spheres up to which Betti numbers are computed for single collapses.
const SMALL: usize = 500;

impl Contraction {
    /// The cheapest edge whose collapse violates the link condition but not the topology of
    /// `initial`, and where its merged sphere goes. `None` when there is none.
    pub(super) fn unlock(&mut self, initial: &MedialMesh) -> Option<([u32; 2], Sphere)> {
        if self.sphere_count() > SMALL || !self.keeps_topology() {
            return None;
        }
        let goal = betti(initial);
        let mesh = self.to_mesh();
        let ids: Vec<u32> = self.complex().vertices().collect();
        let now = difference(betti(&mesh), goal);
        for candidate in self.sorted_candidates() {
            let Some(sphere) = self.placement_whatever_the_topology(candidate) else { continue };
            let [removed, kept] =
                candidate.ends().map(|v| ids.partition_point(|&id| id < v) as u32);
            let after = replay(&mesh, &[Collapse { kept, removed, sphere }]);
            if difference(betti(&after), goal) <= now {
                return Some((candidate.ends(), sphere));
            }
        }
        None
    }

    /// Where the merged sphere of an edge goes, if anywhere without folding a face over.
    fn placement_whatever_the_topology(&self, candidate: Candidate) -> Option<Sphere> {
        match self.place(candidate) {
            Decision::Collapse(sphere) => Some(sphere),
            // At the cost of the placement itself nothing is dearer.
            Decision::Postpone(dearer) => self.placement_whatever_the_topology(dearer),
            Decision::Hold(_) | Decision::Fold(_) => None,
        }
    }
}

fn difference(betti: [u64; 3], goal: [u64; 3]) -> u64 {
    betti.iter().zip(goal).map(|(&number, goal)| number.abs_diff(goal)).sum()
}
