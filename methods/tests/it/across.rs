//! Properties that several methods share: refused parameters and levels, numbers of spheres, threads.

use medial::complex::betti;
use medial::simplifier::{Level, RunContext, SimplifyError};
use medial_methods::qmat::{QmatParams, TopologyFrom};
use medial_methods::tam_heidrich::TamHeidrichParams;

use crate::common::{built_in, default_shape, levels, params, shape, shape_of, with_threads};

#[test]
fn wrong_parameters_are_refused_by_name() {
    let shape = default_shape("box");
    for (method, wrong) in [
        ("angle", "variant=cell"),
        ("dey-zhao", "theta=0 theta=90 rho=0 rho=-8"),
        ("qmat", "k=-1 k_boundary=-1 topology_from=some"),
        ("tam-heidrich", "t_v=-1 t_v=1,many t_v=[1,101] drop=2 t_t_rounds=1.5"),
        ("coverage-axis", "select=all"),
        ("vmas", "lambda=0 lambda=1.5 iterations=0 points=faces"),
        ("tight", "lambda=-1 samples=99 rounds=1001"),
        ("cover", "fit=sad fit=1 radii=same"),
    ] {
        let found = medial_methods::find(method).expect("registered");
        for (key, value) in wrong.split(' ').filter_map(|pair| pair.split_once('=')) {
            let params = params(&[(key, value)]);
            let refused = found.prepare(&shape, &params, &RunContext::default()).err();
            let named =
                matches!(&refused, Some(SimplifyError::Parameter(why)) if why.contains(key));
            assert!(named, "{method} {key}={value}: {refused:?}");
        }
    }
}

#[test]
fn words_numbers_and_lists_are_read() {
    for (value, expected) in [
        ("auto", TopologyFrom::Auto),
        ("all", TopologyFrom::All),
        ("never", TopologyFrom::Never),
        ("50", TopologyFrom::Spheres(50)),
    ] {
        let read = params(&[("topology_from", value)]).typed::<QmatParams>().expect("a value");
        assert_eq!(read, QmatParams { topology_from: expected, ..QmatParams::default() });
    }
    for (t_v, expected) in
        [("1,10", &[1.0, 10.0][..]), ("5", &[5.0]), ("[3,1]", &[3.0, 1.0]), ("", &[])]
    {
        let read = params(&[("t_v", t_v)]).typed::<TamHeidrichParams>().expect("a list");
        assert_eq!(read.t_v.0, expected);
    }
}

#[test]
fn senseless_levels_are_refused() {
    let shape = default_shape("box");
    for (method, senseless) in [
        ("hem", &[-1.0, f64::NAN][..]),
        ("pmat", &[0.99, f64::INFINITY, f64::NAN]),
        ("sat", &[0.5, f64::NAN]),
        ("tam-heidrich", &[-1.0, 101.0]),
    ] {
        let requested = senseless.iter().map(|&level| Level::Native(level));
        let requested: Vec<Level> = requested.chain([Level::Spheres(0)]).collect();
        for (refused, level) in levels(&shape, method, &[], &requested).into_iter().zip(requested) {
            assert!(matches!(refused, Err(SimplifyError::Level(_))), "{method} {level}");
        }
    }
}

#[test]
fn larger_levels_leave_no_more_spheres() {
    let shape = default_shape("torus");
    for (method, set, requested) in [
        ("aof", &[("resolution", "40")][..], &[5.0, 30.0, 60.0, 90.0][..]),
        ("dey-zhao", &[], &[0.5, 1.0, 2.0, 5.0]),
        ("pmat", &[], &[1.0, 1.1, 1.5, 2.0, 4.0, 1e6]),
        ("sat", &[], &[1.0, 1.1, 1.3, 1.6, 2.0]),
    ] {
        let native: Vec<Level> = requested.iter().map(|&level| Level::Native(level)).collect();
        let mut counts = Vec::new();
        for (found, &requested) in levels(&shape, method, set, &native).into_iter().zip(requested) {
            let found = found.expect("a level");
            assert!(
                found.native_level.is_some_and(|used| used <= requested),
                "{method} at {requested}"
            );
            counts.push(found.mesh.spheres.len());
        }
        assert!(counts.is_sorted_by(|fine, coarse| fine >= coarse), "{method}: {counts:?}");
        assert!(counts[0] > counts[counts.len() - 1], "{method}: {counts:?}");
    }
}

#[test]
fn a_sampled_sphere_becomes_one_sphere() {
    let shape = shape("sphere", 40);
    let back = shape.normalisation();
    // Radius 1 and bounding-box diagonal sqrt(12); the published result of Q-MAT is 3e-7 off. HEM keeps
    // one of the Voronoi vertices.
    for (method, most) in [("qmat", 1e-6), ("hem", 1e-9)] {
        let found = levels(&shape, method, &[], &[Level::Spheres(1)]).remove(0).expect("one");
        let &[sphere] = found.mesh.spheres.as_slice() else { panic!("{:?}", found.diagnostics) };
        assert!((sphere.radius * back.diagonal - 1.0).abs() < most, "{method}: {sphere:?}");
        assert!(back.backward(sphere.centre).length() < most, "{method}: {sphere:?}");
        assert!(found.native_level.is_none_or(|error| error < most), "{method}");
    }
}

#[test]
fn topology_is_kept_at_every_level() {
    for (id, resolution, smallest) in [("torus", 26, 3), ("hollow-sphere", 20, 4)] {
        let shape = shape(id, resolution);
        let initial = shape.initial().expect("an initial medial mesh");
        let expected = medial_datasets::find(id).expect("in the catalogue").expected_betti;
        assert_eq!(betti(&initial), expected, "{id}: too coarse a sample for this test");
        let next = |&n: &usize| (n > 1).then_some(if n > 60 { n * 9 / 10 } else { n - 1 });
        let counts: Vec<usize> =
            std::iter::successors(Some(initial.spheres.len()), next).skip(1).collect();
        let requested: Vec<Level> = counts.iter().map(|&count| Level::Spheres(count)).collect();
        for method in ["qmat", "hem"] {
            for (found, &count) in levels(&shape, method, &[], &requested).into_iter().zip(&counts)
            {
                let found = found.expect("a count");
                let (name, reached) =
                    (format!("{method} {id} at {count}"), found.mesh.spheres.len());
                assert_eq!(betti(&found.mesh), expected, "{name}");
                assert!(reached >= smallest, "{name}: {reached} cannot hold this topology");
                assert_eq!(reached > count, !found.diagnostics.warnings.is_empty(), "{name}");
            }
        }
    }
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let mesh = built_in("bracket");
    let vertices = [("points", "vertices")];
    for (method, set) in [
        ("hem", &[][..]),
        ("pmat", &[]),
        ("vmas", &[]),
        ("vmas", &vertices),
        ("cover", &[]),
        ("aof", &[("resolution", "50")]),
    ] {
        let [one, two] = [1, 2].map(|threads| {
            let requested = [Level::Spheres(60), Level::Spheres(10), Level::Published];
            let found = with_threads(threads, || levels(&shape_of(&mesh), method, set, &requested));
            let found = found.into_iter().map(|level| level.expect("a count"));
            found
                .map(|level| (level.mesh, level.native_level, level.diagnostics))
                .collect::<Vec<_>>()
        });
        assert_eq!(one, two, "{method} {set:?}");
    }
}
