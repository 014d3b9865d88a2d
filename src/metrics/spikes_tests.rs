use std::sync::Arc;

use proptest::prelude::*;

use super::*;
use crate::Vec3;

fn sphere(x: f64, y: f64, z: f64, radius: f64) -> Sphere {
    Sphere::new(Vec3::new(x, y, z), radius)
}

/// The exact medial axis of a 3 by 2 by 1 box, divided by its diagonal: 13 sheets on 12 spheres.
fn box_axis() -> MedialMesh {
    let half = Vec3::new(1.5, 1.0, 0.5) / 14f64.sqrt();
    let signs = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let inner =
        signs.map(|[x, y]| sphere(x * (half.x - half.z), y * (half.y - half.z), 0.0, half.z));
    let corner = |z: f64| signs.map(move |[x, y]| sphere(x * half.x, y * half.y, z * half.z, 0.0));
    let spheres = [inner, corner(-1.0), corner(1.0)].concat();
    let mut faces = vec![[0, 1, 2], [0, 2, 3]];
    for i in 0..4 {
        let j = (i + 1) % 4;
        faces.push([i, 4 + i, 8 + i]);
        for level in [4, 8] {
            faces.extend([[i, j, level + j], [i, level + j, level + i]]);
        }
    }
    MedialMesh::from_simplices(spheres, vec![], faces).unwrap()
}

#[test]
fn the_exact_axis_of_a_box_has_no_spike() {
    let axis = box_axis();
    assert_eq!((axis.spheres.len(), axis.edges.len(), axis.faces.len()), (12, 33, 22));
    assert_eq!(crate::complex::betti(&axis), [1, 0, 0]);
    let measured = spikes(&axis);
    for at in &measured.by_ratio {
        assert_eq!(
            (at.edge_share, at.length_share, at.spikes, at.dangling_edges),
            (0.0, 0.0, 0, 0)
        );
    }
    assert_eq!((measured.dangling_edges, measured.fins, measured.angle_spikes), (0, 0, None));
    let lowest = EdgeFacts::of(&axis, &Incidence::of(&axis)).ratios.into_iter().fold(1.0, f64::min);
    assert!(
        lowest >= 1.0 - 0.5f64.sqrt() - 1e-12,
        "on a box G is at least 1 - cos 45, not {lowest}"
    );
}

#[test]
fn spikes_put_on_the_box_are_counted_one_by_one() {
    let mut mesh = box_axis();
    let n = mesh.spheres.len() as u32;
    // Two dangling edges, one of them a spike, and a sliver that hangs on an edge of the centre.
    mesh.spheres.extend([sphere(0.0, 0.0, 0.0, 0.13), sphere(0.05, 0.0, 0.0, 0.081)]);
    mesh.spheres.extend([sphere(0.0, 0.1, 0.0, 0.13), sphere(0.3, 0.0, 0.0, 0.03)]);
    mesh.edges.extend([[0, n], [n, n + 1], [0, n + 2]]);
    mesh.faces.push([1, 2, n + 3]);
    let mesh = MedialMesh::from_simplices(mesh.spheres, mesh.edges, mesh.faces).unwrap();
    let measured = spikes(&mesh);
    assert_eq!(measured.dangling_edges, 2);
    let spike_counts: Vec<_> =
        measured.by_ratio.iter().map(|at| (at.spikes, at.dangling_edges)).collect();
    // The edge to sphere n + 1 has G = 0.02; no other edge is below 0.2.
    assert_eq!(spike_counts, [(1, 1); 3]);
    let edges = mesh.edges.len() as f64;
    assert!((measured.by_ratio[0].edge_share - 1.0 / edges).abs() < 1e-15);
}

#[test]
fn a_fin_has_two_free_sides_and_a_small_angle() {
    let triangle = |y: f64| {
        let spheres = vec![
            sphere(0.0, 0.0, 0.0, 0.5),
            sphere(1.0, 0.0, 0.0, 0.5),
            sphere(1.0, 1.0, 0.0, 0.5),
            sphere(2.0, y, 0.0, 0.5),
        ];
        MedialMesh::from_simplices(spheres, vec![], vec![[0, 1, 2], [1, 2, 3]]).unwrap()
    };
    assert_eq!(spikes(&triangle(0.5)).fins, 0);
    assert_eq!(spikes(&triangle(8.0)).fins, 1);
    let mut closed = triangle(8.0);
    closed.spheres.push(sphere(9.0, 0.0, 5.0, 0.5));
    closed.faces.push([1, 3, 4]);
    let closed = MedialMesh::from_simplices(closed.spheres, vec![], closed.faces).unwrap();
    assert_eq!(spikes(&closed).fins, 0, "one side of the sliver is no longer free");
}

#[test]
fn an_idle_sphere_hardly_sticks_out_of_a_larger_neighbour() {
    let pair = |radius: f64| {
        let spheres = vec![sphere(0.0, 0.0, 0.0, 0.5), sphere(0.1, 0.0, 0.0, radius)];
        MedialMesh::from_simplices(spheres, vec![[0, 1]], vec![]).unwrap()
    };
    assert_eq!(spikes(&pair(0.3)).idle_spheres, 1);
    assert_eq!(spikes(&pair(0.4005)).idle_spheres, 1);
    assert_eq!(spikes(&pair(0.402)).idle_spheres, 0);
    assert_eq!(spikes(&pair(0.7)).idle_spheres, 1, "the other one is idle now");
}

#[test]
fn an_angle_spike_sees_its_contacts_close_together() {
    let samples_at = |degrees: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        vec![Vec3::X, Vec3::new(cos, sin, 0.0), Vec3::X, Vec3::new(cos, sin, 0.0)]
    };
    for (degrees, expected) in [(19.9, 1), (20.1, 0), (180.0, 0)] {
        let mut mesh =
            MedialMesh::from_simplices(vec![sphere(0.0, 0.0, 0.0, 1.0)], vec![], vec![]).unwrap();
        let samples: Arc<[Vec3]> = samples_at(degrees).into();
        mesh.contacts = Some(Contacts { samples, of_sphere: vec![[0, 1, 2, 3]] });
        assert_eq!(spikes(&mesh).angle_spikes, Some(expected), "{degrees} degrees");
    }
}

#[test]
fn nothing_is_measured_on_nothing() {
    let measured = spikes(&MedialMesh::default());
    for at in measured.by_ratio {
        let shares = [at.edge_share, at.length_share];
        assert!(shares.iter().all(|share| share.to_bits() == 0), "{shares:?} is not plain zero");
    }
}

#[test]
fn coincident_spheres_make_no_spike_but_carry_one_on() {
    let chain = |xs: &[f64]| {
        let spheres = xs.iter().map(|&x| sphere(x, 0.0, 0.0, 0.5 - 0.99 * x)).collect();
        let edges = (1..xs.len() as u32).map(|i| [i - 1, i]).collect();
        MedialMesh::from_simplices(spheres, edges, vec![]).unwrap()
    };
    let none = spikes(&chain(&[0.0, 0.0, 1e-13])).by_ratio[0];
    assert_eq!((none.edge_share, none.spikes, none.dangling_edges), (0.0, 0, 0));
    // Two weak edges, and two that have no length between and after them: one spike.
    let one = spikes(&chain(&[0.0, 0.1, 0.1, 0.2, 0.2])).by_ratio[0];
    assert_eq!((one.edge_share, one.length_share, one.spikes), (1.0, 1.0, 1));
    assert_eq!(one.dangling_edges, 1);
}

proptest! {
    /// Measure 2 is by definition a flood over weak edges from boundary spheres.
    #[test]
    fn spike_components_agree_with_a_flood(
        radii in prop::collection::vec(0.0..1.0f64, 8),
        edges in prop::collection::vec((0..8u32, 0..8u32), 0..12),
        faces in prop::collection::vec((0..8u32, 0..8u32, 0..8u32), 0..6),
    ) {
        let spheres: Vec<Sphere> =
            radii.iter().enumerate().map(|(i, &r)| sphere(i as f64, (i * i % 5) as f64, 0.0, r * 3.0)).collect();
        let edges = edges.into_iter().filter(|(a, b)| a != b).map(|(a, b)| [a, b]).collect();
        let faces = faces.into_iter().filter(|(a, b, c)| a != b && b != c && a != c);
        let mesh =
            MedialMesh::from_simplices(spheres, edges, faces.map(|(a, b, c)| [a, b, c]).collect()).unwrap();
        let at = spikes(&mesh).by_ratio[2];
        let weak: Vec<[u32; 2]> = mesh.edges.iter().copied().filter(|e| {
            let [a, b] = e.map(|i| mesh.spheres[i as usize]);
            stability_ratio(a, b) < 0.2
        }).collect();
        let on_boundary = |v: u32| mesh.edges.iter().any(|e| {
            let has = |f: &&[u32; 3]| e.iter().all(|i| f.contains(i));
            e.contains(&v) && mesh.faces.iter().filter(has).count() <= 1
        });
        let mut seen = [false; 8];
        let mut expected = 0;
        for start in weak.iter().flatten().copied().filter(|&v| on_boundary(v)) {
            if seen[start as usize] { continue; }
            expected += 1;
            let mut stack = vec![start];
            while let Some(v) = stack.pop() {
                if std::mem::replace(&mut seen[v as usize], true) { continue; }
                stack.extend(weak.iter().filter(|e| e.contains(&v)).flatten());
            }
        }
        prop_assert_eq!(at.spikes, expected);
    }
}
