//! Spheres that differ by no more than rounding.
//!
//! A round solid has one medial sphere. A method that computes it from samples gets hundreds of
//! spheres, equal up to the last few digits, with cones and slabs between them. Their distances differ
//! in these digits only, so no bound separates them, and each query would measure them all. So of all
//! simplices on the same groups of equal spheres only the first is measured.

use std::collections::HashSet;

use crate::complex::MedialMesh;
use crate::geometry::Sphere;

/// Spheres whose coordinates and radii agree to this share of the radius count as one. Distances change
/// by at most six times that share: a sphere can differ by it, in centre and radius, from the one that
/// stands for its group, and this one again from the sphere that is measured.
pub(super) const EQUAL: f64 = 1e-13;

/// A generic direction in space and radius: spheres at the same place along it are most likely equal.
const GENERIC: [f64; 4] = [0.612_372_4, 0.573_576_4, 0.543_988_1, 0.518_304_7];

/// The simplices of a mesh that are to be measured.
pub(super) struct Distinct {
    /// For each sphere the one that stands for its group.
    group: Vec<u32>,
    /// Whether some spheres are equal.
    any: bool,
    seen: HashSet<[u32; 3]>,
}

impl Distinct {
    /// Groups the spheres of a mesh. `O(n log n)`, as long as few spheres of different groups have
    /// the same place along one direction.
    pub fn new(mesh: &MedialMesh) -> Self {
        let spheres = &mesh.spheres;
        let along = |m: &Sphere| {
            let [x, y, z, r] = GENERIC;
            x * m.centre.x + y * m.centre.y + z * m.centre.z + r * m.radius
        };
        let mut order: Vec<(f64, u32)> = (0..).zip(spheres).map(|(v, m)| (along(m), v)).collect();
        order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        // Rounding of the place itself is a share of the coordinates.
        let reach = |m: &Sphere| {
            let largest = m.centre.abs().max_element().max(m.radius);
            3.0 * EQUAL * m.radius + 16.0 * f64::EPSILON * largest
        };
        let mut group: Vec<u32> = (0..spheres.len() as u32).collect();
        let mut any = false;
        // Of each group the first sphere along the direction.
        let mut firsts: Vec<(f64, u32)> = Vec::new();
        for (place, v) in order {
            let m = &spheres[v as usize];
            let near = firsts.iter().rev().take_while(|first| first.0 >= place - reach(m));
            match near.map(|&(_, w)| w).find(|&w| is_equal(&spheres[w as usize], m)) {
                Some(w) => (group[v as usize], any) = (w, true),
                None => firsts.push((place, v)),
            }
        }
        Self { group, any, seen: HashSet::new() }
    }

    /// The sphere that stands for this one.
    #[inline]
    pub fn sphere(&self, v: u32) -> u32 {
        self.group[v as usize]
    }

    /// Whether a ball within another one is smaller by more than equal balls can differ. (Otherwise two
    /// groups could each have a ball within one of the other, and neither would be measured.)
    pub fn is_smaller(&self, inner: &Sphere, outer: &Sphere) -> bool {
        !self.any || outer.radius - inner.radius > 4.0 * EQUAL * outer.radius
    }

    /// Whether the ends of an edge or the corners of a face belong to different groups.
    pub fn is_proper<const N: usize>(&self, simplex: [u32; N]) -> bool {
        (0..N).all(|k| (0..k).all(|j| self.sphere(simplex[j]) != self.sphere(simplex[k])))
    }

    /// Whether no simplex on the same groups was asked for before.
    pub fn is_first<const N: usize>(&mut self, simplex: [u32; N]) -> bool {
        if !self.any {
            return true;
        }
        let mut key = [u32::MAX; 3];
        for (slot, v) in key.iter_mut().zip(simplex) {
            *slot = self.sphere(v);
        }
        key.sort_unstable();
        self.seen.insert(key)
    }
}

fn is_equal(m: &Sphere, other: &Sphere) -> bool {
    let most = EQUAL * m.radius.min(other.radius);
    let apart = (m.centre - other.centre).abs().max_element();
    apart <= most && (m.radius - other.radius).abs() <= most
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Vec3;

    #[test]
    fn equal_spheres_make_one_group() {
        let near =
            |k: f64| Sphere::new(Vec3::new(1e-14 * k, 2.0, -3.0 + 1e-15 * k), 0.5 + 1e-15 * k);
        let spheres = vec![
            near(0.0),
            Sphere::new(Vec3::new(0.0, 2.0, -3.0), 0.6),
            near(2.0),
            Sphere::new(Vec3::new(1e-12, 2.0, -3.0), 0.5),
            near(-1.0),
            Sphere::new(Vec3::ZERO, 0.0),
            Sphere::new(Vec3::ZERO, 0.0),
        ];
        let faces = vec![[0, 1, 2], [0, 1, 3], [1, 2, 3], [0, 2, 4], [1, 3, 4], [1, 5, 6]];
        let mesh = MedialMesh::from_simplices(spheres, vec![], faces).unwrap();
        let mut distinct = Distinct::new(&mesh);
        let group = distinct.sphere(0);
        assert_eq!([2, 4].map(|v| distinct.sphere(v)), [group; 2]);
        assert_eq!([1, 3].map(|v| distinct.sphere(v)), [1, 3]);
        // Points of radius zero that are one have no size to compare with, but are equal.
        assert_eq!(distinct.sphere(5), distinct.sphere(6));
        let mut first = |f: &&[u32; 3]| distinct.is_proper(**f) && distinct.is_first(**f);
        assert_eq!(mesh.faces.iter().filter(&mut first).collect::<Vec<_>>(), [&[0, 1, 3]]);
        let mut first = |e: &&[u32; 2]| distinct.is_proper(**e) && distinct.is_first(**e);
        assert_eq!(mesh.edges.iter().filter(&mut first).count(), 4);
    }
}
