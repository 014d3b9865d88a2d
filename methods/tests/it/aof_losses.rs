//! Average outward flux: what lattices lose, counts above theirs, the published level.

use medial::Vec3;
use medial::complex::betti;
use medial::simplifier::{Level, Params, Simplified, SimplifyError};
use medial::surface::TriMesh;
use medial_methods::aof::{AofParams, LatticeVoxels, Wanted};

use crate::aof_solids::{built_in, bytes_of, shape_of, simplified, solid};

/// A ball with a thin rod, closed: a limb that no Betti number tells of.
fn lollipop(rod: f64) -> TriMesh {
    let (around, profile) = (24_u32, {
        let ball = (0..20).map(|k| {
            let angle = f64::from(k) / 20.0 * (std::f64::consts::PI - (rod / 0.5).asin());
            (0.5 * angle.sin(), -0.5 * angle.cos())
        });
        let stick = (0..=20).map(|k| (rod, 0.5 + 1.5 * f64::from(k) / 20.0));
        ball.chain(stick).collect::<Vec<_>>()
    });
    let mut mesh = TriMesh { vertices: vec![Vec3::new(0.0, 0.0, -0.5)], faces: vec![] };
    for &(radius, z) in &profile[1..] {
        mesh.vertices.extend((0..around).map(|k| {
            let (sin, cos) = (f64::from(k) / f64::from(around) * std::f64::consts::TAU).sin_cos();
            Vec3::new(radius * cos, radius * sin, z)
        }));
    }
    let rings = profile.len() as u32 - 1;
    let at = |ring: u32, k: u32| 1 + ring * around + k % around;
    let top = mesh.vertices.len() as u32;
    mesh.vertices.push(Vec3::new(0.0, 0.0, 2.0));
    for k in 0..around {
        mesh.faces.push([0, at(0, k + 1), at(0, k)]);
        for ring in 0..rings - 1 {
            let [a, b] = [at(ring, k), at(ring, k + 1)];
            let [c, d] = [at(ring + 1, k + 1), at(ring + 1, k)];
            mesh.faces.extend([[a, b, c], [a, c, d]]);
        }
        mesh.faces.push([top, at(rings - 1, k), at(rings - 1, k + 1)]);
    }
    mesh
}

#[test]
fn a_limb_thinner_than_the_lattice_is_resolved_or_named() {
    // The lattice has voxels of 2.5 / 54 = 0.046: a rod of radius 0.03 has none.
    let shape = shape_of(&lollipop(0.03));
    let result = simplified(&shape, &[], Level::Native(30.0)).expect("an angle");
    let highest = |result: &Simplified| {
        let heights =
            result.mesh.spheres.iter().map(|s| shape.normalisation().backward(s.centre).z);
        heights.fold(f64::MIN, f64::max)
    };
    assert!(highest(&result) > 1.8, "{} {:?}", highest(&result), result.diagnostics);
    assert!(result.diagnostics.warnings.iter().any(|w| w.contains("instead of 54")));
    // The plain rule takes the lattice as it is, and says what it would take; that holds.
    let plain = [("variant", "plain")];
    let lost = simplified(&shape, &plain, Level::Native(30.0)).expect("an angle");
    assert!(highest(&lost) < 0.6, "{}", highest(&lost));
    let warning = lost.diagnostics.warnings.iter().find(|w| w.contains("away from every voxel"));
    let warning = warning.unwrap_or_else(|| panic!("{:?}", lost.diagnostics));
    assert!(warning.contains("2.0000"), "the end of the rod: {warning}");
    let needed = warning.rsplit("resolution = ").next().expect("a resolution");
    let finer = [("variant", "plain"), ("resolution", needed)];
    let found = simplified(&shape, &finer, Level::Native(30.0)).expect("an angle");
    assert!(highest(&found) > 1.8, "{warning} {:?}", found.diagnostics);
    // A rod that no affordable lattice resolves is named with what it takes.
    let shape = shape_of(&lollipop(0.002));
    let result = simplified(&shape, &[], Level::Native(30.0)).expect("an angle");
    assert!(result.diagnostics.warnings.iter().any(|w| w.contains("max_memory = ")));
}

#[test]
fn a_count_above_that_of_the_lattice_is_met_on_a_finer_one() {
    for id in ["bracket", "torus", "capsule"] {
        let shape = built_in(id);
        let default = simplified(&shape, &[], Level::Native(30.0)).expect("an angle");
        let count = default.mesh.spheres.len() + 137;
        let result = simplified(&shape, &[], Level::Spheres(count)).expect("a count");
        assert_eq!(result.mesh.spheres.len(), count, "{id}: {:?}", result.diagnostics);
        assert_eq!(Some(betti(&result.mesh)), shape.expected_betti(), "{id}");
    }
    // A ball has one voxel on any lattice; the search for more ends and says so.
    let result = simplified(&built_in("sphere"), &[], Level::Spheres(500)).expect("a count");
    assert!(result.mesh.spheres.len() < 500);
    assert!(result.diagnostics.warnings.iter().any(|w| w.contains("instead of 500")));
}

#[test]
fn the_published_level_has_the_parameters_of_the_paper() {
    let shape = built_in("box");
    let set = [("resolution", "99"), ("max_memory", "4000")];
    let published = simplified(&shape, &set, Level::Published).expect("published");
    let named = [
        ("variant", "plain"),
        ("spiral", "classic"),
        ("start", "coarse"),
        ("dismiss", "zero"),
        ("refine", "false"),
        ("mu", "0.5"),
    ];
    let angle = 0.4_f64.asin().to_degrees();
    let same = simplified(&shape, &[&set[..], &named].concat(), Level::Native(angle));
    assert_eq!(bytes_of(&published), bytes_of(&same.expect("an angle")));
    let voxels = published.extras.get::<LatticeVoxels>().expect("voxels");
    assert!(!voxels.voxels.is_empty() && voxels.voxels.iter().all(|v| v.flux <= -0.2 + 1e-7));
    // Nothing set: the lattice of the paper, unless memory says otherwise.
    let small = [("max_memory", "60")];
    let lowered = simplified(&shape, &small, Level::Published).expect("published");
    let warnings = &lowered.diagnostics.warnings;
    assert!(warnings.iter().any(|w| w.contains("instead of the published 369")), "{warnings:?}");
    // Set by the user it is refused instead.
    let refused = simplified(&shape, &[("resolution", "369"), small[0]], Level::Published);
    assert!(matches!(refused, Err(SimplifyError::Parameter(m)) if m.contains("max_memory")));
}

#[test]
fn what_is_dismissed_depends_on_the_rule() {
    let shape = built_in("box");
    let dismissed = ["zero", "bias"].map(|rule| {
        let params: AofParams = {
            let mut params = Params::none();
            params.set("dismiss", rule);
            params.typed().expect("a rule")
        };
        let tally = solid(&shape, &params).descend(99, Wanted::Kept).expect("fits").tally;
        tally.dismissed.iter().sum::<u64>() as f64 / tally.start as f64
    });
    // With zero about half of the directions of a plane stay.
    assert!(dismissed[0] < 0.85 * dismissed[1], "{dismissed:?}");
}
