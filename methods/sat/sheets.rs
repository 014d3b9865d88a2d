//! Step 5: sheets of small object angle.
//!
//! 1. The object angle of a facet whose points are nearest to the corners `p` and `q` is
//!    `arcsin(|p - q| / 2 |p - x|)` at the mean `x` of its vertices.
//! 2. A facet with a side that no other facet has is on the *frontier*. Removing it with that side
//!    changes no topology. The frontier facet with the smallest angle goes first; the value of a
//!    facet is the largest angle up to its removal. Facets whose value is below the limit go, that
//!    is, the removal ends when all angles of the frontier reach the limit.
//! 3. Sides left without a facet are removed from their loose ends on. Edges that never had a facet
//!    stay: they are curve-like parts of the shape.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};

use medial::complex::{AxisFacet, MedialMesh, Sphere, UnionAxis};

/// The axis without facets whose value is below `limit` degrees, and how many were removed.
pub(super) fn filtered(axis: &UnionAxis, limit: f64) -> (MedialMesh, usize) {
    if limit <= 0.0 {
        return (axis.mesh(), 0);
    }
    let mut frontier = Frontier::of(axis);
    let removed = frontier.remove_below(limit);
    let Frontier { facet_kept, edge_kept, sphere_kept, .. } = frontier;
    (axis.part(|f| facet_kept[f], |e| edge_kept[e], |s| sphere_kept[s]), removed)
}

/// The axis while facets are removed.
struct Frontier {
    /// Degrees.
    angle: Vec<f64>,
    edges: Vec<[u32; 2]>,
    edges_of_facet: Vec<Vec<u32>>,
    facets_of_edge: Vec<Vec<u32>>,
    edges_of_sphere: Vec<Vec<u32>>,
    facet_kept: Vec<bool>,
    edge_kept: Vec<bool>,
    sphere_kept: Vec<bool>,
    /// Edges that had a facet.
    was_side: Vec<bool>,
}

fn object_angle(facet: &AxisFacet<'_>, spheres: &[Sphere]) -> f64 {
    let [p, q] = facet.corners;
    let vertices = facet.polygon.iter().map(|&v| spheres[v as usize].centre);
    let mean = vertices.sum::<medial::Vec3>() / facet.polygon.len() as f64;
    let sine = p.distance(q) / 2.0 / p.distance(mean).max(f64::MIN_POSITIVE);
    sine.min(1.0).asin().to_degrees()
}

impl Frontier {
    fn of(axis: &UnionAxis) -> Self {
        let edges = axis.edges().to_vec();
        // Looked up, never iterated.
        let id: HashMap<[u32; 2], u32> = edges.iter().copied().zip(0..).collect();
        let mut facets_of_edge = vec![Vec::new(); edges.len()];
        let mut edges_of_facet = Vec::new();
        for (f, facet) in axis.facets().enumerate() {
            let v = facet.polygon;
            let next = v.iter().cycle().skip(1);
            let sides: Vec<u32> =
                v.iter().zip(next).map(|(&a, &b)| id[&[a.min(b), a.max(b)]]).collect();
            for &e in &sides {
                facets_of_edge[e as usize].push(f as u32);
            }
            edges_of_facet.push(sides);
        }
        let mut edges_of_sphere = vec![Vec::new(); axis.spheres().len()];
        for (e, ends) in edges.iter().enumerate() {
            for &v in ends {
                edges_of_sphere[v as usize].push(e as u32);
            }
        }
        Self {
            angle: axis.facets().map(|f| object_angle(&f, axis.spheres())).collect(),
            facet_kept: vec![true; edges_of_facet.len()],
            edge_kept: vec![true; edges.len()],
            sphere_kept: vec![true; edges_of_sphere.len()],
            was_side: facets_of_edge.iter().map(|f| !f.is_empty()).collect(),
            edges,
            edges_of_facet,
            facets_of_edge,
            edges_of_sphere,
        }
    }

    fn remove_below(&mut self, limit: f64) -> usize {
        // Angles are not negative, so their bits are in order.
        let key: Vec<u64> = self.angle.iter().map(|angle| angle.to_bits()).collect();
        let single = self.facets_of_edge.iter().filter(|f| f.len() == 1);
        let mut queue: BinaryHeap<_> =
            single.map(|f| Reverse((key[f[0] as usize], f[0]))).collect();
        let mut removed = 0;
        while let Some(Reverse((_, facet))) = queue.pop() {
            if !self.facet_kept[facet as usize] {
                continue;
            }
            if self.angle[facet as usize] >= limit {
                break;
            }
            removed += 1;
            for neighbour in self.remove(facet) {
                queue.push(Reverse((key[neighbour as usize], neighbour)));
            }
        }
        removed
    }

    /// Removes a facet of the frontier with its free sides; the facets that this brings there.
    fn remove(&mut self, facet: u32) -> Vec<u32> {
        self.facet_kept[facet as usize] = false;
        let sides = std::mem::take(&mut self.edges_of_facet[facet as usize]);
        let mut reached = Vec::new();
        let mut free = Vec::new();
        for &e in &sides {
            let facets = &mut self.facets_of_edge[e as usize];
            facets.retain(|&f| f != facet);
            match facets[..] {
                [] => free.push(e),
                [only] => reached.push(only),
                _ => {}
            }
        }
        // One side goes with the facet, the others from loose ends as far as there are any.
        if let Some(&first) = free.iter().min() {
            self.edge_kept[first as usize] = false;
            for v in self.edges[first as usize] {
                self.prune(v);
            }
        }
        reached
    }

    /// Removes edges without facets from a loose end on.
    fn prune(&mut self, mut end: u32) {
        loop {
            let kept = &self.edge_kept;
            let mut edges =
                self.edges_of_sphere[end as usize].iter().filter(|&&e| kept[e as usize]);
            let (Some(&edge), None) = (edges.next(), edges.next()) else { return };
            let is_bare =
                self.was_side[edge as usize] && self.facets_of_edge[edge as usize].is_empty();
            if !is_bare {
                return;
            }
            self.edge_kept[edge as usize] = false;
            self.sphere_kept[end as usize] = false;
            let [a, b] = self.edges[edge as usize];
            end = if a == end { b } else { a };
        }
    }
}

#[cfg(test)]
mod tests {
    use medial::Vec3;
    use medial::complex::{Incidence, Sphere, UnionAxis, betti};
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    use super::super::SatParams;
    use super::*;
    use crate::levels::perturbed;

    #[test]
    fn the_angle_filter_changes_no_topology() {
        let mut rng = Pcg64::seed_from_u64(61);
        let mut removed_in_all = 0;
        for _ in 0..200 {
            let n = rng.random_range(1..60);
            let largest = [0.2, 0.4, 0.7][rng.random_range(0..3usize)];
            let mut x = || rng.random_range(-1.0..1.0);
            let balls: Vec<Sphere> = (0..n)
                .map(|_| Sphere::new(Vec3::new(x(), x(), x()), 0.02 + largest * x().abs()))
                .collect();
            let axis = UnionAxis::of_balls(&balls).expect("balls");
            let full = axis.mesh();
            let mut faces = full.faces.len();
            assert_eq!(filtered(&axis, 0.0), (full.clone(), 0));
            for limit in [10.0, 30.0, 60.0, 90.0] {
                let (mesh, removed) = filtered(&axis, limit);
                mesh.check().expect("a valid complex");
                assert_eq!(betti(&mesh), betti(&full), "{balls:?}");
                assert!(mesh.faces.len() <= faces);
                faces = mesh.faces.len();
                removed_in_all += removed;
                if limit == 90.0 {
                    // Only closed sheets and right angles are left.
                    let open = Incidence::of(&mesh).faces_at().iter().filter(|&&n| n == 1).count();
                    assert_eq!(open, 0);
                }
            }
        }
        assert!(removed_in_all > 2_000, "{removed_in_all}");
    }

    #[test]
    fn edges_without_facets_stay() {
        // A chain of balls that ends in a block of four.
        let mut balls: Vec<Sphere> = (0..6)
            .map(|k| Sphere::new(Vec3::new(2.0 + 1.5 * f64::from(k), 0.0, 0.0), 1.0))
            .collect();
        for c in [[0.0, 1.0, 0.0], [0.0, -0.6, 0.9], [0.0, -0.6, -0.9], [1.0, 0.1, 0.2]] {
            balls.push(Sphere::new(Vec3::from(c), 1.3));
        }
        let axis = UnionAxis::of_balls(&balls).expect("balls");
        let chain = |mesh: &medial::complex::MedialMesh| {
            let faces_at = Incidence::of(mesh).faces_at().to_vec();
            faces_at.iter().filter(|&&n| n == 0).count()
        };
        assert!(chain(&axis.mesh()) >= 4);
        let (mesh, removed) = filtered(&axis, 90.0);
        assert!(removed > 0 && mesh.faces.is_empty());
        assert!(chain(&mesh) >= chain(&axis.mesh()));
    }

    #[test]
    fn perturbation_has_its_size_and_is_seeded() {
        let balls: Vec<Sphere> =
            (1..100).map(|k| Sphere::new(Vec3::splat(f64::from(k)), f64::from(k))).collect();
        let SatParams { radius_factor, jitter, .. } = SatParams::default();
        let moved = perturbed(&balls, radius_factor, jitter, 7);
        assert_eq!(moved, perturbed(&balls, radius_factor, jitter, 7));
        assert_ne!(moved, perturbed(&balls, radius_factor, jitter, 8));
        for (a, b) in balls.iter().zip(&moved) {
            assert!((b.radius / a.radius - 1.002).abs() < 1e-15);
            let offset = (b.centre - a.centre).abs().max_element() / a.radius;
            assert!(offset > 0.0 && offset <= 1e-4 * (1.0 + 1e-9));
        }
        assert_eq!(perturbed(&balls, 1.0, 0.0, 7), balls);
    }
}
