//! Closed-form cases, and whole records against Algorithm 1 as it is printed.

use medial::Vec3;
use medial::complex::collapse::{Candidate, CollapseComplex, CollapseQueue, Step};
use medial::complex::{MedialMesh, Sphere, betti, stability_ratio};
use medial::geometry::DisjointSets;
use proptest::prelude::*;

use super::*;

fn sphere(x: f64, radius: f64) -> Sphere {
    Sphere::new(Vec3::new(x, 0.0, 0.0), radius)
}

fn steps(mesh: &MedialMesh) -> Vec<Step> {
    contract(mesh, &RunContext::default()).expect("not cancelled")
}

fn levels(mesh: &MedialMesh) -> Levels {
    Levels::new(Arc::new(Hierarchy::new(Arc::new(mesh.clone()), steps(mesh))))
}

fn mesh_of(spheres: Vec<Sphere>, edges: Vec<[u32; 2]>, faces: Vec<[u32; 3]>) -> MedialMesh {
    MedialMesh::from_simplices(spheres, edges, faces).expect("a valid mesh")
}

/// Algorithm 1 to the letter, on the engine that keeps the faces: all edges of the survivor are
/// queued again at each collapse.
fn algorithm_1(mesh: &MedialMesh) -> Vec<Step> {
    let mut complex = CollapseComplex::from_mesh(mesh);
    let candidate = |complex: &CollapseComplex, [i, j]: [u32; 2]| {
        let (a, b) = (complex.sphere(i), complex.sphere(j));
        let cost = absorption_scale(a, b);
        let length = if cost.is_finite() { 0.0 } else { a.centre.distance(b.centre) };
        Candidate::new(complex, [i, j], cost, length)
    };
    let mut queue = CollapseQueue::default();
    for &ends in &mesh.edges {
        queue.push(candidate(&complex, ends));
    }
    let mut record = Vec::new();
    while let Some(cheapest) = queue.pop(&complex) {
        let [i, j] = cheapest.ends();
        let (r, s) = (complex.sphere(i).radius, complex.sphere(j).radius);
        let [removed, kept] = if r < s { [i, j] } else { [j, i] };
        complex.collapse(kept, removed, complex.sphere(kept));
        for index in 0..complex.neighbours(kept).len() {
            let neighbour = complex.neighbours(kept)[index];
            queue.push(candidate(&complex, [kept, neighbour]));
        }
        record.push(Step { removed, kept, cost: cheapest.cost() });
    }
    record
}

#[test]
fn a_chain_by_hand() {
    // Costs of the edges: 1 / 0.25 = 4, 1 / 0.5 = 2, 1 / 0.125 = 8.
    let spheres = vec![sphere(0.0, 1.0), sphere(1.0, 0.75), sphere(2.0, 0.25), sphere(3.0, 0.125)];
    let mesh = mesh_of(spheres.clone(), vec![[0, 1], [1, 2], [2, 3]], vec![]);
    let step = |removed, kept, cost| Step { removed, kept, cost };
    // 2 goes into 1, whose new edge to 3 costs 2 / 0.625 = 3.2; then 1 goes into 0.
    assert_eq!(steps(&mesh), [step(2, 1, 2.0), step(3, 1, 3.2), step(1, 0, 4.0)]);
    let mut levels = levels(&mesh);
    let mut at = |level| levels.at(level).expect("a level");
    assert_eq!(at(Level::Native(1.0)).mesh, mesh);
    assert_eq!(at(Level::Native(2.0)).mesh.spheres, [spheres[0], spheres[1], spheres[3]]);
    assert_eq!(at(Level::Native(3.9)).mesh.edges, [[0, 1]]);
    assert_eq!(at(Level::Published).mesh, mesh);
    assert_eq!(at(Level::Spheres(1)).mesh.spheres, [spheres[0]]);
    assert_eq!(at(Level::Spheres(2)).native_level, Some(3.2));
}

#[test]
fn scales_do_not_fall_although_costs_do() {
    // 1 goes into 0 at 2; that brings an edge of cost 1 / 0.75, which was none before.
    let spheres = vec![sphere(0.0, 1.0), sphere(1.0, 0.5), sphere(0.5, 0.5), sphere(-1.0, 0.25)];
    let mesh = mesh_of(spheres, vec![[0, 1], [1, 3]], vec![]);
    let mut levels = levels(&mesh);
    let costs: Vec<f64> = levels.hierarchy.steps().iter().map(|step| step.cost).collect();
    assert_eq!(costs, [2.0, 1.0 / 0.75]);
    assert_eq!(levels.at(Level::Native(1.5)).expect("a level").mesh, mesh);
    assert_eq!(levels.at(Level::Native(2.0)).expect("a level").mesh.spheres.len(), 2);
}

#[test]
fn equal_radii_go_last_and_the_shortest_first() {
    let spheres = [0.0, 3.0, 4.0, 6.0].map(|x| sphere(x, 0.5)).to_vec();
    let mut edges = vec![[0, 1], [1, 2], [2, 3]];
    let mesh = mesh_of(spheres.clone(), edges.clone(), vec![]);
    let ends = |mesh| steps(mesh).iter().map(|s| [s.removed, s.kept]).collect::<Vec<_>>();
    assert_eq!(ends(&mesh), [[2, 1], [1, 0], [3, 0]], "3 and 3 are equal: the smaller ids first");
    let mut levels = levels(&mesh);
    let two = levels.at(Level::Spheres(2)).expect("a count");
    assert_eq!((two.mesh.spheres.len(), two.native_level), (2, None));
    assert!(two.diagnostics.counts.contains(&("beyond_every_finite_scale".into(), 2)));
    assert_eq!(levels.at(Level::Native(1e300)).expect("a level").mesh, mesh);
    // However long, a finite cost comes before.
    let far = [spheres, vec![sphere(1e9, 0.5 + 1e-9)]].concat();
    edges.push([3, 4]);
    assert_eq!(ends(&mesh_of(far, edges, vec![]))[0], [3, 4]);
}

#[test]
fn coincident_centres_cost_nothing_and_tangent_balls_one() {
    assert_eq!(absorption_scale(sphere(0.0, 0.5), sphere(0.0, 0.5)), 0.0);
    assert_eq!(absorption_scale(sphere(0.0, 0.5), sphere(9e-13, 0.5)), 0.0);
    assert_eq!(absorption_scale(sphere(0.0, 0.5), sphere(9e-13, 0.1)), 0.0);
    assert_eq!(absorption_scale(sphere(0.0, 0.5), sphere(0.25, 0.25)), 1.0);
    assert_eq!(absorption_scale(sphere(0.0, 0.5), sphere(0.25, 0.5)), f64::INFINITY);
    assert_eq!(absorption_scale(sphere(0.0, 0.5), sphere(2e-12, 0.5)), f64::INFINITY);
    // Inside out: at s = 1 exactly the spheres inside a larger ball are gone.
    let spheres = vec![sphere(0.0, 1.0), sphere(0.5, 0.5), sphere(0.25, 0.5), sphere(0.75, 0.5)];
    let mesh = mesh_of(spheres, vec![[0, 1], [0, 2], [0, 3]], vec![]);
    let left = levels(&mesh).at(Level::Native(1.0)).expect("a level");
    assert_eq!((left.mesh.spheres.len(), left.native_level), (2, Some(1.0)));
}

#[test]
fn degenerate_meshes_end_with_one_sphere_for_each_component() {
    let point = |_| Sphere::new(Vec3::new(0.1, 0.2, 0.3), 0.25);
    let line = |v: u32| sphere(f64::from(v), 0.0);
    let noise = |v: u32| sphere(1e-14 * f64::from(v), 0.25 + 1e-16 * f64::from(v));
    let makers: [&dyn Fn(u32) -> Sphere; 3] = [&point, &line, &noise];
    for make in makers {
        let faces = vec![[0, 1, 2], [1, 2, 3], [1, 2, 4], [2, 3, 5], [5, 6, 7]];
        let mesh = mesh_of((0..10).map(make).collect(), vec![[4, 8]], faces);
        let mut levels = levels(&mesh);
        let end = levels.at(Level::Spheres(1)).expect("a count");
        assert_eq!((end.mesh.spheres.len(), end.mesh.edges.len()), (2, 0));
        assert!(end.diagnostics.warnings[0].contains("component"), "{:?}", end.diagnostics);
    }
    let lone = mesh_of(vec![sphere(0.0, 1.0)], vec![], vec![]);
    assert_eq!(levels(&lone).at(Level::Published).expect("the end").mesh, lone);
}

#[test]
fn a_loop_may_close() {
    let spheres = vec![sphere(0.0, 0.1), sphere(1.0, 0.2), sphere(0.5, 0.3)];
    let mesh = mesh_of(spheres, vec![[0, 1], [1, 2], [0, 2]], vec![]);
    assert_eq!(betti(&mesh), [1, 1, 0]);
    let two = levels(&mesh).at(Level::Spheres(2)).expect("a count");
    assert_eq!(betti(&two.mesh), [1, 0, 0]);
}

#[test]
fn large_stars_are_absorbed() {
    // Hubs of ever larger radius, each with its own leaves.
    let (hubs, leaves) = (40, 200);
    let mut spheres: Vec<_> =
        (0..hubs).map(|i| sphere(f64::from(i), 1.0 + 0.01 * f64::from(i))).collect();
    let mut edges: Vec<_> = (1..hubs).map(|i| [i - 1, i]).collect();
    for hub in 0..hubs {
        for leaf in 0..leaves {
            edges.push([hub, spheres.len() as u32]);
            let centre = Vec3::new(f64::from(hub), 30.0 + f64::from(leaf), 0.0);
            spheres.push(Sphere::new(centre, 1e-3 * f64::from(leaf)));
        }
    }
    let mesh = mesh_of(spheres, edges, vec![]);
    assert_eq!(steps(&mesh), algorithm_1(&mesh));
}

/// Random complexes; on a grid, so that costs tie, balls coincide and radii are equal.
fn random_mesh() -> impl Strategy<Value = MedialMesh> {
    let place = (prop::array::uniform3(0..4_u32), 0..4_u32);
    let ids = (0..16_u32).collect::<Vec<_>>();
    (
        prop::collection::vec(place, 16),
        prop::collection::vec(prop::sample::subsequence(ids.clone(), 3), 0..24),
        prop::collection::vec(prop::sample::subsequence(ids, 2), 0..12),
        prop::sample::select(vec![0.0, 0.37]),
    )
        .prop_map(|(places, faces, edges, bend)| {
            let spheres = places.into_iter().map(|(c, r)| {
                let centre = Vec3::from(c.map(f64::from));
                Sphere::new(
                    centre + bend * Vec3::new(centre.z, centre.x, centre.y).map(f64::sin),
                    f64::from(r) / 4.0 + bend * centre.y.cos().abs(),
                )
            });
            let faces = faces.into_iter().map(|f| [f[0], f[1], f[2]]).collect();
            let edges = edges.into_iter().map(|e| [e[0], e[1]]).collect();
            mesh_of(spheres.collect(), edges, faces)
        })
}

fn components(mesh: &MedialMesh) -> usize {
    let mut sets = DisjointSets::singletons(mesh.spheres.len());
    for &[a, b] in &mesh.edges {
        sets.join(a, b);
    }
    sets.len()
}

proptest! {
    #[test]
    fn records_are_those_of_algorithm_1(mesh in random_mesh()) {
        prop_assert_eq!(steps(&mesh), algorithm_1(&mesh));
    }

    /// At every level: the survivors are initial spheres, the components are the same in number,
    /// and by its scale alone no fewer collapses are found than the level has.
    #[test]
    fn levels_are_nested(mesh in random_mesh()) {
        let mut levels = levels(&mesh);
        let mut known: Vec<Sphere> = mesh.spheres.clone();
        for count in (1..=mesh.spheres.len()).rev() {
            let level = levels.at(Level::Spheres(count)).unwrap();
            level.mesh.check().unwrap();
            prop_assert_eq!(components(&level.mesh), components(&mesh));
            prop_assert_eq!(level.mesh.spheres.len(), count.max(components(&mesh)));
            let mut left = level.mesh.spheres.iter().peekable();
            known.retain(|sphere| left.next_if(|&survivor| survivor == sphere).is_some());
            prop_assert_eq!(&known, &level.mesh.spheres, "not a subset in the same order");
            if let Some(scale) = level.native_level {
                let by_scale = levels.at(Level::Native(scale)).unwrap();
                prop_assert!(by_scale.mesh.spheres.len() <= level.mesh.spheres.len());
                let below = f64::from_bits(scale.to_bits() - 1);
                if below >= 1.0 {
                    let finer = levels.at(Level::Native(below)).unwrap();
                    prop_assert!(finer.mesh.spheres.len() > by_scale.mesh.spheres.len());
                }
            }
        }
    }

    /// The order of costs is that of the stability ratios of Q-MAT wherever these differ.
    #[test]
    fn costs_order_as_stability_ratios(
        a in (prop::array::uniform3(-1.0..1.0f64), 0.0..1.0f64, 0.0..1.0f64),
        b in (prop::array::uniform3(-1.0..1.0f64), 0.0..1.0f64, 0.0..1.0f64),
    ) {
        let [(c, g), (d, h)] = [a, b].map(|(centre, r, s)| {
            let ends = (Sphere::new(Vec3::ZERO, r), Sphere::new(Vec3::from(centre), s));
            let (cost, ratio) = (absorption_scale(ends.0, ends.1), stability_ratio(ends.0, ends.1));
            assert!((ratio - (1.0 - 1.0 / cost).max(0.0)).abs() < 1e-14, "{ratio} {cost}");
            (cost, ratio)
        });
        if (g - h).abs() > 1e-14 {
            prop_assert_eq!(c < d, g < h);
        }
    }
}
