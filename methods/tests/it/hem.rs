//! HEM on the medial meshes of sampled solids.

use medial::Vec3;
use medial::complex::{MedialMesh, MedialUnion, betti};
use medial::metrics::{EnvelopeOptions, sample_envelope};
use medial::shape::Shape;
use medial::simplifier::{
    Level, MedialSimplifier, Params, RunContext, Simplification, Simplified, SimplifyError,
};
use medial_methods::hem;

use crate::common::{params, shape_of, with_threads};

fn shape(id: &str, resolution: u32) -> Shape {
    shape_of(&medial_datasets::find(id).expect("in the catalogue").mesh(resolution))
}

fn prepare<'s>(shape: &'s Shape, inside: &str) -> Box<dyn Simplification + 's> {
    prepare_with(shape, "inside", inside)
}

fn prepare_with<'s>(shape: &'s Shape, key: &str, value: &str) -> Box<dyn Simplification + 's> {
    let set = params(&[(key, value)]);
    hem::method().prepare(shape, &set, &RunContext::default()).expect("prepared")
}

fn spheres(simplification: &mut dyn Simplification, count: usize) -> Simplified {
    simplification.at(Level::Spheres(count)).expect("a count")
}

fn count(result: &Simplified, name: &str) -> u64 {
    let counts = &result.diagnostics.counts;
    counts.iter().find(|(n, _)| n == name).unwrap_or_else(|| panic!("no count {name}")).1
}

/// The samples of the initial mesh, of which the bound speaks.
fn touched(initial: &MedialMesh) -> Vec<Vec3> {
    let contacts = initial.contacts.as_ref().expect("the Voronoi medial mesh has contacts");
    let mut ids = contacts.of_sphere.as_flattened().to_vec();
    ids.sort_unstable();
    ids.dedup();
    ids.into_iter().map(|id| contacts.samples[id as usize]).collect()
}

/// Largest `|sigma|`, and largest distance to the surface of a primitive, buried spheres included.
fn errors(mesh: &MedialMesh, samples: &[Vec3]) -> [f64; 2] {
    let union = MedialUnion::new(mesh).expect("a union");
    let to_sphere = |p: Vec3| {
        let distances = mesh.spheres.iter().map(|m| m.signed_distance(p).abs());
        distances.fold(f64::INFINITY, f64::min)
    };
    let depth = samples.iter().map(|&p| union.signed(p).abs());
    let surface = samples.iter().map(|&p| union.unsigned_nearest(p).min(to_sphere(p)));
    [depth.fold(0.0, f64::max), surface.fold(0.0, f64::max)]
}

#[test]
fn a_sampled_sphere_becomes_one_sphere() {
    let shape = shape("sphere", 40);
    let result = spheres(prepare(&shape, "depth").as_mut(), 1);
    let &[sphere] = result.mesh.spheres.as_slice() else { panic!("{:?}", result.diagnostics) };
    // The survivor is one of the Voronoi vertices.
    let scale = shape.normalisation().diagonal;
    assert!((sphere.radius * scale - 1.0).abs() < 1e-9, "{sphere:?}");
    assert!(shape.normalisation().backward(sphere.centre).length() < 1e-9, "{sphere:?}");
    assert!(result.native_level.is_some_and(|error| error < 1e-9));
}

#[test]
fn survivors_are_spheres_of_the_initial_mesh() {
    let shape = shape("bracket", 9);
    let initial = shape.initial().expect("an initial medial mesh");
    for inside in ["depth", "surface"] {
        let result = spheres(prepare(&shape, inside).as_mut(), 60);
        assert_eq!(result.mesh.spheres.len(), 60);
        assert!(result.mesh.spheres.iter().all(|m| initial.spheres.contains(m)));
    }
}

#[test]
fn topology_is_kept_at_every_level() {
    for (id, resolution, smallest) in [("torus", 26, 3), ("hollow-sphere", 20, 4)] {
        let shape = shape(id, resolution);
        let initial = shape.initial().expect("an initial medial mesh");
        let expected = medial_datasets::find(id).expect("in the catalogue").expected_betti;
        assert_eq!(betti(&initial), expected, "{id}: too coarse a sample for this test");
        let mut simplification = prepare(&shape, "depth");
        let mut count = initial.spheres.len();
        while count > 1 {
            count = if count > 60 { count * 9 / 10 } else { count - 1 };
            let result = spheres(simplification.as_mut(), count);
            assert_eq!(betti(&result.mesh), expected, "{id} at {count}");
            let reached = result.mesh.spheres.len();
            assert!(reached >= smallest, "{id}: {reached} spheres cannot hold this topology");
            assert_eq!(reached > count, !result.diagnostics.warnings.is_empty(), "{id} at {count}");
        }
    }
}

#[test]
fn a_bound_holds_for_every_sample() {
    for (id, resolution) in [("box", 8), ("capsule", 20), ("bracket", 8), ("torus", 20)] {
        let shape = shape(id, resolution);
        let initial = shape.initial().expect("an initial medial mesh");
        let samples = touched(&initial);
        for (reading, inside) in ["depth", "surface"].into_iter().enumerate() {
            let least = errors(&initial, &samples)[reading];
            let mut simplification = prepare(&shape, inside);
            let mut before = initial.spheres.len();
            for epsilon in [1e-3, 1e-2, 5e-2] {
                let result = simplification.at(Level::Native(epsilon));
                let result = match result {
                    Err(refused) => {
                        // The initial mesh is measured before a bound is refused.
                        assert!(least > epsilon, "{id} {inside}: {refused}");
                        assert!(refused.to_string().contains("the best, of "), "{refused}");
                        continue;
                    }
                    Ok(result) => result,
                };
                let error = errors(&result.mesh, &samples)[reading];
                assert!(error <= epsilon, "{id} {inside}: {error} beyond {epsilon}");
                let left = result.mesh.spheres.len();
                assert!(left <= before, "{id} {inside}: {left} after {before}");
                before = left;
            }
            // Where primitives far from a sample hold it deeper than its own star, as in the coarse
            // box, nearly all collapses are taken back.
            let most = if inside == "surface" {
                initial.spheres.len() / 8
            } else {
                initial.spheres.len() - 1
            };
            assert!(before <= most, "{id} {inside}: {before} left");
        }
    }
}

#[test]
fn a_two_sided_bound_holds_for_the_boundary_of_the_union_too() {
    let shape = shape("blob", 14);
    let tree = shape.surface_tree().expect("faces");
    let farthest = |mesh: &MedialMesh| {
        let union = MedialUnion::new(mesh).expect("a union");
        // Other samples of the boundary than the method's.
        let options = EnvelopeOptions { samples: 30_000, burial: 1e-7, seed: 5 };
        let boundary = sample_envelope(mesh, &union, &options).expect("a boundary");
        let distances = boundary.into_iter().map(|p| tree.closest(p).distance);
        distances.fold(0.0, f64::max)
    };
    let (mut held, mut missed) = (0, 0);
    for epsilon in [0.02, 0.03, 0.04, 0.05, 0.06, 0.08] {
        let answers = ["one", "both"].map(|sides| {
            let result = prepare_with(&shape, "sides", sides).at(Level::Native(epsilon)).ok()?;
            Some((result.mesh.spheres.len(), farthest(&result.mesh)))
        });
        if let [Some(one), Some(both)] = answers {
            held += 1;
            missed += usize::from(one.1 > 1.1 * epsilon);
            assert!(both.1 <= 1.05 * epsilon, "{both:?} {epsilon}");
            assert!(both.0 >= one.0, "{both:?} {one:?}");
        }
    }
    assert!(held >= 3, "{held}");
    assert!(missed > 0, "the one-sided bound says nothing of the other direction");
}

/// The authors' condition sees holes that close, and no voids.
#[test]
fn common_neighbours_block_holes_alone() {
    for (id, resolution, loops) in [("torus", 26, 1), ("hollow-sphere", 20, 0)] {
        let shape = shape(id, resolution);
        let [homotopy, neighbours] = ["homotopy", "neighbours"].map(|blocking| {
            let mut prepared = prepare_with(&shape, "blocking", blocking);
            betti(&spheres(prepared.as_mut(), 1).mesh)
        });
        assert_eq!(homotopy, [1, loops, 1 - loops], "{id}");
        assert_eq!(neighbours[1..], [loops, 0], "{id}");
    }
}

/// Going on after collapses were taken back for a bound is going on from the state before that.
#[test]
fn levels_of_either_kind_do_not_depend_on_what_was_asked_before() {
    let shape = shape("bracket", 9);
    let asked = [
        Level::Native(0.01),
        Level::Spheres(40),
        Level::Native(0.02),
        Level::Published,
        Level::Native(0.01),
        Level::Spheres(400),
    ];
    let mut continued = prepare(&shape, "surface");
    for level in asked {
        let here = continued.at(level).expect("a level");
        let alone = prepare(&shape, "surface").at(level).expect("a level");
        assert_eq!(here.mesh, alone.mesh, "{level}");
        if let Level::Native(_) = level {
            let taken_back = count(&here, "taken_back_for_the_bound");
            let initial = shape.initial().expect("an initial medial mesh").spheres.len() as u64;
            assert_eq!(
                count(&alone, "collapses") - taken_back,
                initial - here.mesh.spheres.len() as u64
            );
        }
    }
}

#[test]
fn levels_continue_start_anew_and_say_what_they_cannot_do() {
    let shape = shape("capsule", 24);
    let initial = shape.initial().expect("an initial medial mesh");
    let mut simplification = prepare(&shape, "depth");
    for count in [200, 80, 80, 120] {
        let result = spheres(simplification.as_mut(), count);
        assert_eq!(result.mesh, spheres(prepare(&shape, "depth").as_mut(), count).mesh);
        assert_eq!(result.mesh.spheres.len(), count);
    }
    let more = spheres(simplification.as_mut(), initial.spheres.len() + 1);
    assert_eq!(more.mesh.spheres, initial.spheres);
    assert_eq!(more.diagnostics.warnings.len(), 1);
    let published = simplification.at(Level::Published).expect("the rule of the code");
    assert!(published.mesh.spheres.len() < initial.spheres.len());
    for level in [Level::Spheres(0), Level::Native(-1.0), Level::Native(f64::NAN)] {
        assert!(matches!(simplification.at(level), Err(SimplifyError::Level(_))), "{level}");
    }
}

#[test]
fn the_number_of_threads_changes_nothing() {
    for inside in ["depth", "surface"] {
        let results = [1, 2].map(|threads| {
            with_threads(threads, || {
                let shape = shape("blob", 14);
                let mut simplification = prepare(&shape, inside);
                [1000, 100, 10].map(|count| {
                    let result = spheres(simplification.as_mut(), count);
                    (result.mesh, result.native_level, result.diagnostics)
                })
            })
        });
        assert_eq!(results[0], results[1], "{inside}");
    }
}

#[test]
fn a_mesh_without_contacts_gets_the_nearest_samples() {
    let plain = shape("capsule", 24);
    let initial = plain.initial().expect("an initial medial mesh");
    let bare =
        initial.transformed(plain.normalisation().diagonal, |p| plain.normalisation().backward(p));
    let given = shape("capsule", 24).with_initial(&MedialMesh { contacts: None, ..bare });
    let result = spheres(prepare(&given, "depth").as_mut(), 30);
    assert_eq!((result.mesh.spheres.len(), result.diagnostics.warnings.len()), (30, 1));
    let [depth, _] = errors(&result.mesh, &touched(&initial));
    assert!(depth < 0.02, "{depth}");
}

#[test]
fn a_cancelled_run_ends_as_cancelled() {
    let shape = shape("capsule", 24);
    let run = RunContext::default();
    let mut simplification =
        hem::method().prepare(&shape, &Params::none(), &run).expect("prepared");
    run.cancel_flag().store(true, std::sync::atomic::Ordering::Relaxed);
    let cancelled = simplification.at(Level::Spheres(10));
    assert!(matches!(cancelled, Err(SimplifyError::Cancelled)));
}
