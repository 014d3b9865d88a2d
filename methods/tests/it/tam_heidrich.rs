//! Part pruning of Tam and Heidrich: the sheets of a box, loops of solids with tunnels, real meshes.

use std::collections::BTreeSet;

use medial::Vec3;
use medial::complex::betti;
use medial::shape::Shape;
use medial::simplifier::{Level, MedialSimplifier, Params, RunContext, Simplified};
use medial::surface::{self, TriMesh};
use medial_methods::tam_heidrich::{self, PartInfo, parts_of_faces};

use crate::common::{self, count, default_shape, shape_of, with_threads};

fn at(shape: &Shape, params: &[(&str, &str)], level: Level) -> Simplified {
    let params = common::params(params);
    let prepared = tam_heidrich::method().prepare(shape, &params, &RunContext::default());
    let result = prepared.and_then(|mut prepared| prepared.at(level)).expect("an answer");
    result.mesh.check().expect("a valid complex");
    result
}

/// The Betti numbers after each round, from the start on, and whether each checked the topology.
fn betti_by_round(result: &Simplified) -> Vec<(bool, [u64; 3])> {
    let has = |name: &str| result.diagnostics.counts.iter().any(|c| c.0 == name);
    let mut rounds = vec!["start".to_owned()];
    rounds.extend((1..).map(|k| format!("round_{k}")).take_while(|r| has(&format!("{r}_b0"))));
    let of_round = |round: &String| {
        let betti = ["b0", "b1", "b2"].map(|b| count(result, &format!("{round}_{b}")));
        let checked = format!("{round}_checked");
        (has(&checked) && count(result, &checked) == 1, betti)
    };
    rounds.iter().map(of_round).collect()
}

fn parts(result: &Simplified) -> &[PartInfo] {
    result.extras.get::<Vec<PartInfo>>().expect("a list of parts")
}

const NO_ROUNDS: [(&str, &str); 2] = [("t_t_rounds", "0"), ("t_v", "")];

#[test]
fn the_exact_axis_of_a_box_has_twelve_parts_of_level_one_and_one_of_level_two() {
    let exact = medial_datasets::find("box").and_then(|b| b.axis()).expect("known").mesh;
    let shape = default_shape("box").with_initial(&exact);
    let result = at(&shape, &NO_ROUNDS, Level::Published);
    assert_eq!(result.mesh.faces.len(), exact.faces.len());
    let of_level = |level| parts(&result).iter().filter(|p| p.level == level).collect::<Vec<_>>();
    assert_eq!((parts(&result).len(), of_level(1).len(), of_level(2).len()), (13, 12, 1));
    assert!(of_level(2)[0].centre.iter().all(|x| x.abs() < 1e-12));
    assert!(parts(&result).iter().all(|p| p.removable == (p.level == 1)));
    // The tetrahedra are shared out among all parts.
    let volume: f64 = parts(&result).iter().map(|p| p.volume).sum();
    assert!((volume - 1.0).abs() < 0.1, "{volume}");
    // One round by volume takes all twelve, and leaves the central rectangle.
    let params = [("t_t_rounds", "0"), ("t_v", "100")];
    let result = at(&shape, &params, Level::Published);
    assert_eq!(count(&result, "round_1_removed"), 12);
    assert_eq!((result.mesh.spheres.len(), result.mesh.faces.len()), (4, 2));
}

/// Which exact sheet of the 3 by 2 by 1 box a point with its radius is on: 0 for the rectangle, else
/// the number of the edge; distance to it in units of the box.
fn sheet(half: Vec3, centre: Vec3) -> (usize, f64) {
    let depth = half - centre.abs();
    // The two nearest sides of the box, by axis.
    let mut axes = [0, 1, 2];
    axes.sort_by(|&a, &b| depth[a].total_cmp(&depth[b]));
    let on_rectangle = centre.z.abs();
    let off_edge = (depth[axes[0]] - depth[axes[1]]).abs() / 2.0_f64.sqrt();
    let along = axes[2];
    let (u, v) = ((along + 1) % 3, (along + 2) % 3);
    let side = |x: f64| usize::from(x > 0.0);
    let edge = 1 + 4 * along + 2 * side(centre[u]) + side(centre[v]);
    match on_rectangle < off_edge && axes[0] == 2 {
        true => (0, on_rectangle),
        false => (edge, off_edge),
    }
}

#[test]
fn the_largest_parts_of_a_sampled_box_are_its_sheets() {
    let (half, shape) = (Vec3::new(1.5, 1.0, 0.5), default_shape("box"));
    let back = shape.normalisation();
    // Rectangle; triangle and trapezoids down to the edges along x, y and z.
    let slope = half.z * 2.0_f64.sqrt();
    let along = |x: f64| slope * (2.0 * x - half.z).max(half.z);
    let exact = [[2.0 * 1.0; 4], [along(1.5); 4], [along(1.0); 4], [along(0.5); 4]].concat();
    for (rounds, seed) in [("1", 0), ("2", 0), ("3", 0), ("3", 1), ("3", 2), ("3", 3)] {
        let mut run = RunContext::default();
        run.seed = seed;
        let params = common::params(&[("t_v", ""), ("t_t_rounds", rounds)]);
        let mut prepared = tam_heidrich::method().prepare(&shape, &params, &run).expect("an axis");
        let result = prepared.at(Level::Published).expect("an answer");
        result.mesh.check().expect("a valid complex");
        assert_eq!(count(&result, "fins_left"), 0);
        let listed = parts(&result);
        assert!(listed.windows(2).all(|w| w[0].triangles >= w[1].triangles));
        // Nothing but the sheets is left.
        assert_eq!(listed.len(), 13, "seed {seed}");
        let of_face = parts_of_faces(&result.mesh);
        let (mut area_on, mut off) = ([[0.0; 13]; 13], 0.0_f64);
        for (face, part) in result.mesh.faces.iter().zip(of_face) {
            let [a, b, c] = face.map(|v| back.backward(result.mesh.spheres[v as usize].centre));
            let (id, distance) = sheet(half, (a + b + c) / 3.0);
            area_on[part as usize][id] += (b - a).cross(c - a).length() / 2.0;
            off = off.max(distance);
        }
        // Samples are 0.125 apart.
        assert!(off < 0.01, "{off}");
        let mut sheets = BTreeSet::new();
        for (part, area) in listed.iter().zip(area_on) {
            let whole: f64 = area.iter().sum();
            let id = (0..13).max_by(|&a, &b| area[a].total_cmp(&area[b])).expect("sheets");
            assert!(area[id] > 0.999 * whole, "part {} is on {area:?}", part.id);
            // Sheets end at the balls that pass through samples on the edge.
            let share = whole / exact[3 + id];
            assert!((0.7..1.01).contains(&share), "sheet {id} with {share} of its area");
            let (level, removable) = if id == 0 { (2, false) } else { (1, true) };
            assert_eq!((part.level, part.removable), (level, removable), "sheet {id}");
            sheets.insert(id);
        }
        assert_eq!(sheets.len(), 13);
    }
}

#[test]
fn loops_survive_every_checked_round() {
    for id in ["torus", "double-torus", "frame", "hollow-sphere", "coil", "pair"] {
        let shape = default_shape(id);
        let schedules: [&[(&str, &str)]; 3] = [
            &[],
            &[("t_t_rounds", "0"), ("t_v", "1,5,20,100,100")],
            &[("t_v", "1,5,20,100,100,100")],
        ];
        for schedule in schedules {
            let result = at(&shape, schedule, Level::Published);
            let rounds = betti_by_round(&result);
            assert_eq!(Some(rounds[0].1), shape.expected_betti(), "{id}");
            for w in rounds.windows(2) {
                assert!(!w[1].0 || w[1].1 == w[0].1, "{id} {schedule:?}: {rounds:?}");
            }
            assert_eq!(rounds[rounds.len() - 1].1, betti(&result.mesh));
            let warned =
                result.diagnostics.warnings.iter().any(|w| w.contains("changed the Betti numbers"));
            assert_eq!(warned, rounds[rounds.len() - 1].1 != rounds[0].1, "{id} {rounds:?}");
        }
    }
}

#[test]
fn counts_are_met_from_either_side_and_results_are_nested() {
    let shape = default_shape("blob");
    let whole = at(&shape, &NO_ROUNDS, Level::Published).mesh;
    let mut finer = whole.clone();
    let mut t_v = 0.0;
    for spheres in [whole.spheres.len() + 5, 9_500, 8_000, 6_000, 5_000, 1_000, 1] {
        let result = at(&shape, &[], Level::Spheres(spheres));
        let reached = result.mesh.spheres.len();
        assert!(reached == spheres || !result.diagnostics.warnings.is_empty());
        let in_finer = |s| finer.spheres.contains(s);
        assert!(result.mesh.spheres.iter().all(in_finer));
        let level = result.native_level.unwrap_or(t_v);
        assert!(level >= t_v);
        (finer, t_v) = (result.mesh, level);
    }
    // Each level on the way is the result of all requests nearer to it than to the next.
    let at_each = |spheres: usize| at(&shape, &[], Level::Spheres(spheres)).mesh.spheres.len();
    let mut level = whole.spheres.len();
    for _ in 0..12 {
        let next = at_each(level - 1);
        if next >= level {
            // The next level is farther: it is met from half way on.
            let count = (1..level).rev().find(|&n| n % 40 == 0 && at_each(n) < level);
            let Some(count) = count else { break };
            let next = at_each(count);
            assert!(count.abs_diff(next) <= level - count, "{count}: {next} instead of {level}");
            level = next;
        } else {
            level = next;
        }
    }
    assert!(level < whole.spheres.len());
    // The rules always keep one sheet for each body.
    let result = at(&shape, &[("t_t_rounds", "0")], Level::Spheres(1));
    assert!(parts(&result).iter().all(|p| !p.removable));
    assert_eq!(betti(&result.mesh), betti(&whole));
}

/// Moving the balls decides ties, not the remaining parts.
#[test]
fn another_seed_leaves_nearly_as_many_spheres() {
    for id in ["blob", "bracket", "torus"] {
        let shape = default_shape(id);
        let left = [0, 1, 2, 3].map(|seed| {
            let mut run = RunContext::default();
            run.seed = seed;
            let prepared = tam_heidrich::method().prepare(&shape, &Params::none(), &run);
            let result = prepared.expect("an axis").at(Level::Published).expect("an answer");
            let start = ["b0", "b1", "b2"].map(|b| count(&result, &format!("start_{b}")));
            assert_eq!(Some(start), shape.expected_betti(), "{id}: moving makes no loops");
            result.mesh.spheres.len()
        });
        let (least, most) = (left.iter().min(), left.iter().max());
        let [least, most] = [least, most].map(|n| *n.expect("four") as f64);
        assert!(most <= 1.03 * least, "{id}: {left:?}");
    }
}

#[test]
fn a_given_mesh_is_pruned_in_place_of_the_axis() {
    let mesh = default_shape("bracket").voronoi().expect("a mesh").as_ref().clone();
    let back = *default_shape("bracket").normalisation();
    let given = mesh.to_input(&back);
    let result = at(&default_shape("bracket").with_initial(&given), &[], Level::Published);
    assert!(!result.diagnostics.warnings.is_empty(), "no warning on the volumes");
    let volume: f64 = parts(&result).iter().map(|p| p.volume).sum();
    assert!(volume > 0.1, "{volume}");
}

fn for_threads(name: &str, mesh: &TriMesh, level: Level) -> Simplified {
    let [one, two] =
        [1, 2].map(|threads| with_threads(threads, || at(&shape_of(mesh), &[], level)));
    assert_eq!(one.mesh, two.mesh, "{name}");
    assert_eq!(parts(&one), parts(&two), "{name}");
    assert_eq!(one.diagnostics, two.diagnostics, "{name}");
    one
}

#[test]
fn built_in_shapes_give_the_same_for_any_number_of_threads() {
    for built_in in medial_datasets::catalogue() {
        let mesh = built_in.mesh(built_in.default_resolution);
        for level in [Level::Published, Level::Native(10.0)] {
            let result = for_threads(built_in.id, &mesh, level);
            assert!(!result.mesh.spheres.is_empty());
            let rounds = betti_by_round(&result);
            assert!(rounds.windows(2).all(|w| !w[1].0 || w[1].1 == w[0].1), "{rounds:?}");
        }
    }
}

#[test]
fn shared_meshes_give_valid_axes_for_any_number_of_threads() {
    for path in medial_test_support::surfaces() {
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        let mesh = surface::read(&path).expect("a solid").mesh;
        let result = for_threads(&name, &mesh, Level::Published);
        let rounds = betti_by_round(&result);
        assert!(rounds.windows(2).all(|w| !w[1].0 || w[1].1 == w[0].1), "{name}: {rounds:?}");
        assert_eq!(rounds[rounds.len() - 1].1, betti(&result.mesh), "{name}");
    }
}
