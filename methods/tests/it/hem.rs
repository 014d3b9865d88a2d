//! HEM on the medial meshes of sampled solids.

use medial::Vec3;
use medial::complex::{MedialMesh, MedialUnion};
use medial::shape::Shape;
use medial::simplifier::{Level, MedialSimplifier, Params, RunContext, Simplification};
use medial_methods::hem;

use crate::common::{count, shape};

fn prepare(shape: &Shape) -> Box<dyn Simplification + '_> {
    hem::method().prepare(shape, &Params::none(), &RunContext::default()).expect("prepared")
}

/// The samples of the initial mesh, to which the bound applies.
fn touched(initial: &MedialMesh) -> Vec<Vec3> {
    let contacts = initial.contacts.as_ref().expect("the Voronoi medial mesh has contacts");
    let mut ids = contacts.of_sphere.as_flattened().to_vec();
    ids.sort_unstable();
    ids.dedup();
    ids.into_iter().map(|id| contacts.samples[id as usize]).collect()
}

/// Largest `|sigma|`.
fn error(mesh: &MedialMesh, samples: &[Vec3]) -> f64 {
    let union = MedialUnion::new(mesh).expect("a union");
    samples.iter().map(|&p| union.signed(p).abs()).fold(0.0, f64::max)
}

#[test]
fn a_bound_holds_for_every_sample() {
    for (id, resolution) in [("box", 8), ("capsule", 20), ("bracket", 8), ("torus", 20)] {
        let shape = shape(id, resolution);
        let initial = shape.initial().expect("an initial medial mesh");
        let samples = touched(&initial);
        let least = error(&initial, &samples);
        let mut simplification = prepare(&shape);
        let mut before = initial.spheres.len();
        for epsilon in [1e-3, 1e-2, 5e-2] {
            let result = match simplification.at(Level::Native(epsilon)) {
                Err(refused) => {
                    // The initial mesh is measured before a bound is refused.
                    assert!(least > epsilon, "{id}: {refused}");
                    assert!(refused.to_string().contains("the best one, with "), "{refused}");
                    continue;
                }
                Ok(result) => result,
            };
            let error = error(&result.mesh, &samples);
            assert!(error <= epsilon, "{id}: {error} beyond {epsilon}");
            let left = result.mesh.spheres.len();
            assert!(left <= before, "{id}: {left} after {before}");
            before = left;
        }
        // Where primitives far from a sample hold it deeper than its own star, as in the coarse
        // box, nearly all collapses are taken back.
        assert!(before < initial.spheres.len(), "{id}: {before} left");
    }
}

/// Going on after collapses were taken back for a bound is going on from the state before that.
#[test]
fn levels_of_either_kind_do_not_depend_on_earlier_requests() {
    let shape = shape("capsule", 20);
    let requested = [
        Level::Native(0.02),
        Level::Spheres(10),
        Level::Native(0.05),
        Level::Published,
        Level::Native(0.02),
        Level::Spheres(100),
    ];
    let mut continued = prepare(&shape);
    for level in requested {
        let here = continued.at(level).expect("a level");
        let alone = prepare(&shape).at(level).expect("a level");
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
fn a_mesh_without_contacts_gets_the_nearest_samples() {
    let plain = shape("capsule", 24);
    let initial = plain.initial().expect("an initial medial mesh");
    let bare =
        initial.transformed(plain.normalisation().diagonal, |p| plain.normalisation().backward(p));
    let given = shape("capsule", 24).with_initial(&MedialMesh { contacts: None, ..bare });
    let result = prepare(&given).at(Level::Spheres(30)).expect("a count");
    assert_eq!((result.mesh.spheres.len(), result.diagnostics.warnings.len()), (30, 1));
    let depth = error(&result.mesh, &touched(&initial));
    assert!(depth < 0.02, "{depth}");
}
