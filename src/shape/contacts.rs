//! The contact points of each sphere of a medial mesh.

use std::sync::Arc;

use rayon::prelude::*;
use rstar::RTree;
use rstar::primitives::GeomWithData;

use crate::Vec3;
use crate::complex::{Contacts, MedialMesh};

/// How far beyond the radius a sample still counts as touched.
const REACH: f64 = 1.0 + 1e-3;

/// For each sphere of a medial mesh the boundary samples that it touches.
pub struct ContactSets {
    samples: Arc<[Vec3]>,
    /// `ids[start[i]..start[i + 1]]` are the contacts of sphere `i`, ascending where searched.
    start: Vec<u32>,
    ids: Vec<u32>,
}

impl ContactSets {
    /// The contacts that a mesh carries.
    pub(super) fn known(contacts: &Contacts) -> Self {
        Self {
            samples: Arc::clone(&contacts.samples),
            start: (0..=contacts.of_sphere.len() as u32).map(|i| 4 * i).collect(),
            ids: contacts.of_sphere.iter().flatten().copied().collect(),
        }
    }

    /// All samples within `(1 + 1e-3) r` of each centre. Cost `O((n + m) log m + output)`.
    pub(super) fn search(mesh: &MedialMesh, samples: &Arc<[Vec3]>) -> Self {
        let points = samples.iter().enumerate();
        let tree = RTree::bulk_load(
            points.map(|(id, p)| GeomWithData::new(p.to_array(), id as u32)).collect(),
        );
        let found: Vec<Vec<u32>> = mesh
            .spheres
            .par_iter()
            .map(|s| {
                let reach = s.radius * REACH;
                let near = tree.locate_within_distance(s.centre.to_array(), reach * reach);
                let mut ids: Vec<u32> = near.map(|point| point.data).collect();
                ids.sort_unstable();
                ids
            })
            .collect();
        let mut start = vec![0];
        for ids in &found {
            start.push(start[start.len() - 1] + ids.len() as u32);
        }
        Self { samples: Arc::clone(samples), start, ids: found.concat() }
    }

    /// Calls `read` with the contact points of a sphere.
    pub fn with<T>(&self, sphere: usize, read: impl FnOnce(&[Vec3]) -> T) -> T {
        let ids = self.ids(sphere);
        if let &[a, b, c, d] = ids {
            return read(&[a, b, c, d].map(|id| self.samples[id as usize]));
        }
        let points: Vec<Vec3> = ids.iter().map(|&id| self.samples[id as usize]).collect();
        read(&points)
    }

    /// The sample ids of a sphere's contacts.
    pub fn ids(&self, sphere: usize) -> &[u32] {
        &self.ids[self.start[sphere] as usize..self.start[sphere + 1] as usize]
    }

    /// Number of spheres with fewer than two contacts.
    pub fn empty_sets(&self) -> usize {
        self.start.windows(2).filter(|w| w[1] - w[0] < 2).count()
    }
}
