//! The method without any cache, bound or early exit: the oracle of the tests.

use std::collections::BTreeSet;
use std::sync::Arc;

use medial::Vec3;
use medial::complex::collapse::CollapseComplex;
use medial::complex::{MedialMesh, Sphere};
use medial::geometry::{Cone, Slab};

use super::edge::NOISE;
use super::params::Inside;
use super::samples::SampleLists;

/// A complex as sets of simplices, with the samples of each sphere as sets.
#[derive(Clone, Debug)]
pub(super) struct Model {
    pub spheres: Vec<Sphere>,
    edges: BTreeSet<[u32; 2]>,
    faces: BTreeSet<[u32; 3]>,
    pub points: Vec<Vec3>,
    pub lists: Vec<BTreeSet<u32>>,
    pub inside: Inside,
}

/// An edge: cost, ends, which of them survives.
pub(super) type Choice = (f64, [u32; 2], usize);

impl Model {
    pub(super) fn new(
        mesh: &MedialMesh,
        points: Vec<Vec3>,
        lists: &[Vec<u32>],
        inside: Inside,
    ) -> Self {
        Self {
            spheres: mesh.spheres.clone(),
            edges: mesh.edges.iter().copied().collect(),
            faces: mesh.faces.iter().copied().collect(),
            points,
            lists: lists.iter().map(|list| list.iter().copied().collect()).collect(),
            inside,
        }
    }

    /// The samples in the form that the method uses.
    pub(super) fn sample_lists(&self) -> SampleLists {
        let lists = self.lists.iter().map(|list| list.iter().copied().collect()).collect();
        SampleLists::new(Arc::from(self.points.as_slice()), lists)
    }

    /// The complex; removed vertices stay as isolated ones.
    pub(super) fn mesh(&self) -> MedialMesh {
        MedialMesh {
            spheres: self.spheres.clone(),
            edges: self.edges.iter().copied().collect(),
            faces: self.faces.iter().copied().collect(),
            contacts: None,
        }
    }

    pub(super) fn edges(&self) -> Vec<[u32; 2]> {
        self.edges.iter().copied().collect()
    }

    /// `e(removed -> kept)`.
    pub(super) fn error(&self, removed: u32, kept: u32) -> f64 {
        let image = |v: u32| if v == removed { kept } else { v };
        let at = |v: u32| self.spheres[v as usize];
        let mut around = BTreeSet::new();
        for edge in self.edges.iter().map(|edge| edge.map(image)).filter(|e| e[0] != e[1]) {
            around.extend(edge.into_iter().filter(|&v| v != kept && edge.contains(&kept)));
        }
        let mut sides = BTreeSet::new();
        for mut face in self.faces.iter().map(|face| face.map(image)) {
            face.sort_unstable();
            let proper = face[0] < face[1] && face[1] < face[2];
            if proper && face.contains(&kept) {
                let side: Vec<u32> = face.into_iter().filter(|&v| v != kept).collect();
                sides.insert([side[0], side[1]]);
            }
        }
        let hub = at(kept);
        let cones = around.iter().map(|&v| Cone::new(hub, at(v)));
        let rims = sides.iter().map(|&[v, w]| Cone::new(at(v), at(w)));
        let cones: Vec<Cone> = cones.chain(rims).collect();
        let slabs = sides.iter().map(|&[v, w]| Slab::new([hub, at(v), at(w)]));
        let slabs: Vec<Slab> = slabs.collect();
        let distances = |p: Vec3| {
            let mut all = vec![hub.signed_distance(p)];
            all.extend(cones.iter().map(|cone| cone.signed_distance(p)));
            all.extend(slabs.iter().map(|slab| slab.signed_distance(p)));
            all
        };
        let error = |&id: &u32| {
            let distances = distances(self.points[id as usize]).into_iter();
            match self.inside {
                Inside::Depth => distances.fold(f64::INFINITY, f64::min).abs(),
                Inside::Surface => distances.map(f64::abs).fold(f64::INFINITY, f64::min),
            }
        };
        let ids = self.lists[removed as usize].union(&self.lists[kept as usize]);
        ids.map(error).fold(0.0, f64::max)
    }

    /// The edge to be collapsed next, found by evaluating every edge in full.
    pub(super) fn cheapest(&self) -> Option<Choice> {
        let mut complex = CollapseComplex::from_mesh(&self.mesh());
        let choices = self.edges.iter().filter_map(|&ends| self.choice(&mut complex, ends));
        let length = |choice: &Choice| {
            let [a, b] = choice.1.map(|v| self.spheres[v as usize].centre);
            a.distance(b)
        };
        choices.min_by(|x, y| {
            let costs = x.0.total_cmp(&y.0);
            costs.then(length(x).total_cmp(&length(y))).then(x.1.cmp(&y.1))
        })
    }

    /// An edge with the better of its directions that pass both tests.
    pub(super) fn choice(&self, complex: &mut CollapseComplex, ends: [u32; 2]) -> Option<Choice> {
        let [a, b] = ends;
        if !complex.keeps_homotopy(a, b) {
            return None;
        }
        let errors = [self.error(b, a), self.error(a, b)];
        let passes = ends.map(|v| complex.folded_face(a, b, complex.sphere(v).centre).is_none());
        let [into_a, into_b] = [0, 1].map(|s| if passes[s] { errors[s] } else { f64::INFINITY });
        let (error, survivor) = if into_b < into_a { (into_b, 1) } else { (into_a, 0) };
        if error == f64::INFINITY {
            return None;
        }
        Some((if error < NOISE { 0.0 } else { error }, ends, survivor))
    }

    pub(super) fn collapse(&mut self, removed: u32, kept: u32) {
        let image = |v: u32| if v == removed { kept } else { v };
        let edges = std::mem::take(&mut self.edges).into_iter();
        for mut edge in edges.map(|edge| edge.map(image)) {
            edge.sort_unstable();
            if edge[0] < edge[1] {
                self.edges.insert(edge);
            }
        }
        for mut face in std::mem::take(&mut self.faces).into_iter().map(|face| face.map(image)) {
            face.sort_unstable();
            if face[0] < face[1] && face[1] < face[2] {
                self.faces.insert(face);
            }
        }
        let gone = std::mem::take(&mut self.lists[removed as usize]);
        self.lists[kept as usize].extend(gone);
    }
}
