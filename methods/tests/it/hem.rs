//! HEM on the medial meshes of sampled solids.

use medial::Vec3;
use medial::complex::{MedialMesh, MedialUnion};
use medial::shape::Shape;
use medial::simplifier::{Level, MedialSimplifier, RunContext, Simplification, Simplified};
use medial_methods::hem;

use crate::common::{count, params, shape};

fn prepare<'s>(shape: &'s Shape, inside: &str) -> Box<dyn Simplification + 's> {
    let set = params(&[("inside", inside)]);
    hem::method().prepare(shape, &set, &RunContext::default()).expect("prepared")
}

fn spheres(simplification: &mut dyn Simplification, count: usize) -> Simplified {
    simplification.at(Level::Spheres(count)).expect("a count")
}

/// The samples of the initial mesh, to which the bound applies.
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
    let surface = samples.iter().map(|&p| union.nearest_surface(p).signed.abs().min(to_sphere(p)));
    [depth.fold(0.0, f64::max), surface.fold(0.0, f64::max)]
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

/// Going on after collapses were taken back for a bound is going on from the state before that.
#[test]
fn levels_of_either_kind_do_not_depend_on_earlier_requests() {
    let shape = shape("bracket", 9);
    let requested = [
        Level::Native(0.01),
        Level::Spheres(40),
        Level::Native(0.02),
        Level::Published,
        Level::Native(0.01),
        Level::Spheres(400),
    ];
    let mut continued = prepare(&shape, "surface");
    for level in requested {
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
