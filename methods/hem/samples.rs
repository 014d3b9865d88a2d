//! The boundary samples that each sphere is responsible for.

use std::sync::Arc;

use medial::Vec3;
use medial::shape::ContactSets;

/// The boundary samples and for each sphere the ids of its own, each once, ascending.
///
/// A sample that several spheres touch is in several lists. The list of a sphere never loses a sample
/// while the sphere exists, and the total length never grows.
#[derive(Clone, Debug)]
pub(super) struct SampleLists {
    points: Arc<[Vec3]>,
    of_sphere: Vec<Vec<u32>>,
}

impl SampleLists {
    /// The samples that each sphere touches.
    pub(super) fn of_contacts(contacts: &ContactSets) -> Self {
        let lists = (0..contacts.spheres()).map(|v| contacts.ids(v).to_vec()).collect();
        Self::new(Arc::clone(contacts.samples()), lists)
    }

    /// Lists in any order, with repetitions.
    pub(super) fn new(points: Arc<[Vec3]>, mut of_sphere: Vec<Vec<u32>>) -> Self {
        for list in &mut of_sphere {
            list.sort_unstable();
            list.dedup();
        }
        Self { points, of_sphere }
    }

    /// Number of spheres at the beginning.
    pub(super) fn spheres(&self) -> usize {
        self.of_sphere.len()
    }

    /// The samples of a sphere, ascending.
    pub(super) fn of(&self, v: u32) -> &[u32] {
        &self.of_sphere[v as usize]
    }

    /// The position of a sample.
    #[inline]
    pub(super) fn point(&self, id: u32) -> Vec3 {
        self.points[id as usize]
    }

    /// Assigns the samples of a removed sphere to the survivor.
    pub(super) fn assign(&mut self, removed: u32, kept: u32) {
        let gone = std::mem::take(&mut self.of_sphere[removed as usize]);
        self.of_sphere[kept as usize] = merged(&self.of_sphere[kept as usize], &gone);
    }

    /// Length of all lists together.
    pub(super) fn assigned(&self) -> usize {
        self.of_sphere.iter().map(Vec::len).sum()
    }

    /// The samples that are in some list, in the order of their ids.
    pub(super) fn touched(&self) -> Vec<Vec3> {
        let mut ids = self.of_sphere.concat();
        ids.sort_unstable();
        ids.dedup();
        ids.into_iter().map(|id| self.point(id)).collect()
    }
}

/// The union of two ascending lists.
fn merged(a: &[u32], b: &[u32]) -> Vec<u32> {
    let mut union = Vec::with_capacity(a.len() + b.len());
    let (mut a, mut b) = (a, b);
    while let ([x, ..], [y, ..]) = (a, b) {
        union.push(*x.min(y));
        // Branch-free; a common element advances both lists, so it is kept once.
        let (skip_a, skip_b) = (usize::from(x <= y), usize::from(y <= x));
        (a, b) = (&a[skip_a..], &b[skip_b..]);
    }
    union.extend_from_slice(a);
    union.extend_from_slice(b);
    union
}
