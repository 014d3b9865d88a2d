//! The contraction against the oracle, and on complexes made by hand.

use std::collections::BTreeSet;
use std::sync::Arc;

use medial::Vec3;
use medial::complex::collapse::CollapseComplex;
use medial::complex::{MedialMesh, Sphere};
use medial::geometry::{Cone, Slab};
use medial::shape::ShapeOptions;
use medial::simplifier::RunContext;
use medial::surface::Sampling;
use proptest::prelude::*;

use super::contract::{Contraction, Stop};
use super::edge::{Edge, Ground, NOISE, Star};
use super::{SampleLists, *};

/// More than the rounding of distances, and than errors that count as zero.
const CLOSE: f64 = 3e-12;

/// The parts of a random model; simplices and lists with repetitions.
type Parts =
    (Vec<([f64; 3], f64)>, Vec<Vec<u32>>, Vec<Vec<u32>>, Vec<[f64; 3]>, Vec<Vec<u32>>, bool);

const VERTICES: usize = 11;

fn parts() -> impl Strategy<Value = Parts> {
    let ids = |n: usize| {
        prop::sample::subsequence((0..VERTICES as u32).collect::<Vec<_>>(), n).prop_shuffle()
    };
    let place = || prop::array::uniform3(0.0..1.0f64);
    (
        prop::collection::vec((place(), 0.0..0.4f64), VERTICES),
        prop::collection::vec(ids(2), 0..8),
        prop::collection::vec(ids(3), 4..26),
        prop::collection::vec(place(), 24),
        prop::collection::vec(prop::collection::vec(0..24_u32, 0..6), VERTICES),
        prop::bool::weighted(0.2),
    )
}

/// A complex without any geometric order, samples anywhere, spheres in spheres; with `coarse`
/// coordinates full of coincident, contained and collinear ones.
fn model((spheres, edges, faces, points, lists, coarse): Parts) -> Model {
    let round = |x: f64| if coarse { (4.0 * x).round() / 4.0 } else { x };
    let spheres: Vec<Sphere> =
        spheres.iter().map(|&(c, r)| Sphere::new(c.map(round).into(), round(r))).collect();
    let edges = edges.iter().map(|e| [e[0], e[1]]).collect();
    let faces = faces.iter().map(|f| [f[0], f[1], f[2]]).collect();
    let mesh = MedialMesh::from_simplices(spheres, edges, faces).unwrap();
    Model::new(&mesh, points.into_iter().map(Vec3::from).collect(), &lists)
}

fn contraction(model: &Model) -> Contraction {
    let run = RunContext::default();
    Contraction::new(&model.mesh(), model.sample_lists(), &run).expect("not cancelled")
}

/// Every edge of a complex with its own evaluation in full against the oracle.
fn assert_errors_agree(model: &Model, complex: &CollapseComplex, samples: &SampleLists) {
    let ground = Ground { complex, samples };
    let mut star = Star::new(model.spheres.len());
    for ends in model.edges() {
        let mut edge = Edge::unknown(u32::MAX);
        edge.evaluate(&ground, ends, f64::INFINITY, &mut star);
        let expected = [model.error(ends[1], ends[0]), model.error(ends[0], ends[1])];
        for (survivor, expected) in expected.into_iter().enumerate() {
            let error = edge.into[survivor].error();
            // The dearer direction may stop where it exceeds the other.
            let stopped = error > expected.min(edge.into[1 - survivor].error()) - CLOSE;
            let is_dearer = expected > edge.into[1 - survivor].error() + CLOSE;
            let agrees = (error - expected).abs() < CLOSE || is_dearer && stopped;
            assert!(agrees && error < expected + CLOSE, "{ends:?} {survivor}: {error} {expected}");
        }
    }
}

/// The contraction's bounds never exceed the true errors, and the queue is never late.
fn assert_bounds_hold(model: &Model, contraction: &Contraction) {
    let mut complex = CollapseComplex::from_mesh(&model.mesh());
    for ends in model.edges() {
        let edge = contraction.known(ends).expect("every edge is known");
        let truth = [model.error(ends[1], ends[0]), model.error(ends[0], ends[1])];
        for (directed, truth) in edge.into.iter().zip(truth) {
            assert!(directed.bound() <= truth + CLOSE, "{ends:?}: {directed:?} above {truth}");
        }
        if let Some((cost, _, _)) = model.choice(&mut complex, ends) {
            assert!(edge.queued <= cost + CLOSE, "{ends:?} queued at {:?} of {cost}", edge.queued);
        }
    }
}

/// Follows the contraction to its end, one collapse after another, with all checks.
fn follow(mut model: Model, checks_each: bool) -> usize {
    let mut contraction = contraction(&model);
    let touched = model.sample_lists().touched();
    let mut assigned = usize::MAX;
    loop {
        let samples = &contraction.samples;
        assert_eq!(samples.touched(), touched, "samples were lost");
        assert!(samples.assigned() <= assigned, "samples were repeated");
        assigned = samples.assigned();
        for (v, list) in model.lists.iter().enumerate() {
            assert!(list.iter().eq(samples.of(v as u32)), "list of {v}");
        }
        if checks_each {
            assert_bounds_hold(&model, &contraction);
        }
        let expected = model.cheapest();
        let done = contraction.complex.record().len();
        let target = contraction.complex.sphere_count() - 1;
        contraction.run_to(Stop::Spheres(target), &RunContext::default()).unwrap();
        let Some(&taken) = contraction.complex.record().get(done) else {
            assert!(expected.is_none() || target == 0, "{expected:?} was left");
            return contraction.complex.sphere_count();
        };
        let (cost, ends, survivor) = expected.expect("nothing may be collapsed");
        if [taken.kept, taken.removed] != [ends[survivor], ends[1 - survivor]] {
            let error = model.error(taken.removed, taken.kept);
            assert!(error <= cost + CLOSE, "{taken:?} at {error}, not {ends:?} at {cost}");
        }
        assert_eq!(taken.sphere, model.spheres[taken.kept as usize], "the survivor moved");
        model.collapse(taken.removed, taken.kept);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    /// Full evaluation after random collapses, with any change of topology.
    #[test]
    fn errors_are_those_of_the_oracle(
        parts in parts(), picks in prop::collection::vec((any::<prop::sample::Index>(), any::<bool>()), 0..7),
    ) {
        let mut model = model(parts);
        let mut complex = CollapseComplex::from_mesh(&model.mesh());
        let mut samples = model.sample_lists();
        for (pick, turn) in &picks {
            assert_errors_agree(&model, &complex, &samples);
            let edges = model.edges();
            if edges.is_empty() {
                break;
            }
            let [a, b] = *pick.get(&edges);
            let [kept, removed] = if *turn { [a, b] } else { [b, a] };
            complex.collapse(kept, removed, complex.sphere(kept));
            samples.assign(removed, kept);
            model.collapse(removed, kept);
        }
        assert_errors_agree(&model, &complex, &samples);
    }

    /// The lazy order is the order of full evaluation after each collapse.
    #[test]
    fn the_order_is_that_of_the_oracle(parts in parts()) {
        follow(model(parts), true);
    }
}

fn shape(id: &str, resolution: u32, noise: f64) -> Shape {
    let mesh = medial_datasets::find(id).unwrap().mesh(resolution);
    let mesh = medial_datasets::add_noise(&mesh, noise, 7);
    let report = medial::surface::validate(&mesh).unwrap();
    // Few: the oracle is slow.
    let options = ShapeOptions { sampling: Sampling::MeshVertices, ..ShapeOptions::default() };
    Shape::new(id, &mesh, report, options).unwrap()
}

fn model_of(shape: &Shape) -> Model {
    let mesh = shape.initial().unwrap();
    let contacts = shape.contacts(&mesh, &mut Diagnostics::default()).unwrap();
    let lists: Vec<_> = (0..mesh.spheres.len()).map(|v| contacts.ids(v).to_vec()).collect();
    Model::new(&mesh, contacts.samples().to_vec(), &lists)
}

#[test]
fn the_order_is_that_of_the_oracle_on_solids() {
    for (id, resolution) in [("bracket", 3), ("capsule", 5), ("rod", 5)] {
        follow(model_of(&shape(id, resolution, 2e-3)), id == "capsule");
    }
}

/// A chain of equal spheres along the x-axis, each with a ring of samples that it touches.
fn chain(count: u32) -> Model {
    let spheres = (0..count)
        .map(|i| Sphere::new(Vec3::new(f64::from(i) / f64::from(count - 1), 0.0, 0.0), 0.1));
    let spheres: Vec<_> = spheres.collect();
    let edges = (1..count).map(|i| [i - 1, i]).collect();
    let points = spheres
        .iter()
        .flat_map(|m| [Vec3::Y, Vec3::Z, -Vec3::Y, -Vec3::Z].map(|n| m.centre + m.radius * n));
    let mut points: Vec<_> = points.collect();
    points.extend([Vec3::new(-0.1, 0.0, 0.0), Vec3::new(1.1, 0.0, 0.0)]);
    let mut lists: Vec<Vec<u32>> = (0..count).map(|i| (4 * i..4 * i + 4).collect()).collect();
    lists[0].push(4 * count);
    lists[count as usize - 1].push(4 * count + 1);
    let mesh = MedialMesh::from_simplices(spheres, edges, vec![]).unwrap();
    Model::new(&mesh, points, &lists)
}

fn run(model: &Model, stop: Stop) -> Contraction {
    let mut contraction = contraction(model);
    contraction.run_to(stop, &RunContext::default()).unwrap();
    contraction
}

#[test]
fn a_straight_chain_is_free_but_for_its_ends() {
    let model = chain(9);
    let two = run(&model, Stop::Spheres(2));
    assert_eq!(two.largest, 0.0);
    assert_eq!(two.complex.to_mesh().spheres, [model.spheres[0], model.spheres[8]]);
    // The last collapse leaves the far end at the length of the chain.
    let one = run(&model, Stop::Spheres(1));
    assert!((one.largest - 1.0).abs() < 1e-15, "{}", one.largest);
    assert_eq!(run(&model, Stop::Error(0.999)).complex.to_mesh(), two.complex.to_mesh());
    assert_eq!(run(&model, Stop::Error(1.001)).complex.to_mesh(), one.complex.to_mesh());
}

#[test]
fn directed_errors_by_hand() {
    // Radii 2 and 1 at distance 4; a sample on the far pole of each.
    let spheres = vec![Sphere::new(Vec3::ZERO, 2.0), Sphere::new(4.0 * Vec3::X, 1.0)];
    let mesh = MedialMesh::from_simplices(spheres, vec![[0, 1]], vec![]).unwrap();
    let points = vec![-2.0 * Vec3::X, 5.0 * Vec3::X];
    let model = Model::new(&mesh, points, &[vec![0], vec![1]]);
    let contraction = contraction(&model);
    let [into_large, into_small] = contraction.known([0, 1]).unwrap().into;
    // Into the large one the small pole is 5 - 2 away; into the small one 6 - 1.
    assert!((into_large.error() - 3.0).abs() < 1e-15);
    // The dearer direction stops early at best.
    assert!(into_small.error() > 3.0 && into_small.error() < 5.0 + 1e-15);
    assert_eq!((model.error(1, 0), model.error(0, 1)), (3.0, 5.0));
}

#[test]
fn a_level_within_the_bound_is_found() {
    let search = |all: usize, good: &'static [usize]| {
        let error = |t: usize| Ok(if good.contains(&t) { 1.0 } else { 2.0 + t as f64 });
        last_within(all, 1.0, error).unwrap()
    };
    assert_eq!(search(0, &[0]), Found::Within(0));
    assert_eq!(search(9, &[0, 9]), Found::Within(9));
    assert_eq!(search(9, &[0, 1, 2, 3, 4, 5]), Found::Within(5));
    assert_eq!(search(9, &[0]), Found::Within(0));
    assert_eq!(search(9, &[0, 1, 2, 8]), Found::Within(8), "the latest");
    // The initial mesh is not within; a state in between is, which growing steps miss.
    assert_eq!(search(160, &[50, 51, 52]), Found::Within(52));
    let refused = search(160, &[]);
    assert!(matches!(refused, Found::None { best: 0, error: 2.0, measured: 16.. }), "{refused:?}");
    assert!(matches!(search(0, &[]), Found::None { best: 0, measured: 1, .. }));
}

// The method without any cache, bound or early exit: the oracle of the tests.

/// A complex as sets of simplices, with the samples of each sphere as sets.
#[derive(Clone, Debug)]
pub(super) struct Model {
    pub spheres: Vec<Sphere>,
    edges: BTreeSet<[u32; 2]>,
    faces: BTreeSet<[u32; 3]>,
    pub points: Vec<Vec3>,
    pub lists: Vec<BTreeSet<u32>>,
}

/// An edge: cost, ends, which of them survives.
pub(super) type Choice = (f64, [u32; 2], usize);

impl Model {
    pub(super) fn new(mesh: &MedialMesh, points: Vec<Vec3>, lists: &[Vec<u32>]) -> Self {
        Self {
            spheres: mesh.spheres.clone(),
            edges: mesh.edges.iter().copied().collect(),
            faces: mesh.faces.iter().copied().collect(),
            points,
            lists: lists.iter().map(|list| list.iter().copied().collect()).collect(),
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
            distances.fold(f64::INFINITY, f64::min).abs()
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
