//! Starts whose topology is right by construction, on surfaces whose vertices alone give a wrong one.

use medial::Vec3;
use medial::complex::{MedialMesh, betti};
use medial::metrics::{Distances, Judge, JudgeOptions, Truth};
use medial::shape::{Shape, ShapeOptions};
use medial::surface::{Format, Sampling, Side, TriMesh, read, read_bytes, validate};
use medial_test_support::surfaces;
use rand::prelude::*;
use rand_pcg::Pcg64;

use crate::shapes;

fn shape_of(mesh: &TriMesh, sampling: Sampling) -> Shape {
    let report = validate(mesh).unwrap();
    let options = ShapeOptions { sampling, ..ShapeOptions::default() };
    Shape::new("test", mesh, report, options).unwrap()
}

/// The conforming start of a surface, which must be right. Returns the number of added points with it.
#[track_caller]
fn right_start(name: &str, mesh: &TriMesh) -> (usize, MedialMesh) {
    let shape = shape_of(mesh, Sampling::default());
    let start = shape.initial().unwrap_or_else(|error| panic!("{name}: {error}"));
    assert_eq!(shape.sampling_warning(), None, "{name}");
    assert_eq!(Some(betti(&start)), shape.expected_betti(), "{name}");
    start.check().unwrap_or_else(|error| panic!("{name}: {error}"));
    let samples = shape.samples();
    assert_eq!(samples[..mesh.vertices.len()], shape.mesh().vertices, "{name}");
    let tree = shape.surface_tree().unwrap();
    // Where flips bend the surface, points that are added are off the given one, and so are centres in thin places.
    let most = if mesh.faces.len() < 1_000 { 2e-6 } else { 3e-3 };
    let mut centres: Vec<Vec3> = start.spheres.iter().map(|sphere| sphere.centre).collect();
    let mut sides = shape.inside_test().sides(&centres).into_iter();
    centres.retain(|_| sides.next() != Some(Side::Inside));
    let outside = tree.distance_batch(&centres);
    assert!(outside.iter().all(|&d| d < most), "{name}: a centre outside by {outside:?}");
    assert!(tree.distance_batch(&samples).iter().all(|&d| d < most), "{name}: a sample off");
    (samples.len() - mesh.vertices.len(), (*start).clone())
}

/// Two plates with a gap between them that is narrower than they are thick, joined at one side, in as few
/// triangles as possible.
fn bent_plate() -> TriMesh {
    let profile = [
        [0.0, 0.0],
        [1.0, 0.0],
        [1.0, 0.1],
        [0.1, 0.1],
        [0.1, 0.14],
        [1.0, 0.14],
        [1.0, 0.24],
        [0.0, 0.24],
    ];
    let at = |z: f64| profile.map(|[x, y]| Vec3::new(x, y, z));
    let vertices = [at(0.0), at(0.8)].concat();
    let mut faces = Vec::new();
    for [a, b, c, d] in [[0, 1, 2, 3], [0, 3, 4, 7], [4, 5, 6, 7]] {
        faces.extend([[a, c, b], [a, d, c]]);
        faces.extend([[a, b, c], [a, c, d]].map(|face: [u32; 3]| face.map(|v| v + 8)));
    }
    for a in 0..8 {
        let b = (a + 1) % 8;
        faces.extend([[a, b, b + 8], [a, b + 8, a + 8]]);
    }
    TriMesh { vertices, faces }
}

#[test]
fn real_meshes_have_the_topology_of_their_solids() {
    for path in surfaces() {
        let (name, mesh) = (path.display().to_string(), read(&path).unwrap().mesh);
        let (added, _) = right_start(&name, &mesh);
        let share = added as f64 / mesh.vertices.len() as f64;
        let sides = mesh.faces.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let ends = sides.map(|side| side.map(|v| mesh.vertices[v as usize]));
        let longest = ends.map(|[a, b]| a.distance(b)).fold(0.0, f64::max);
        let (low, high) = mesh.bounding_box().unwrap();
        // A coarse surface gets points for the closeness of its balls, up to the budget.
        let is_coarse = longest > 0.1 * low.distance(high);
        let most = if is_coarse { 7.0 } else { 0.1 };
        assert!(share <= most, "{name}: {share}");
    }
}

/// A wedge between two half-planes that meet at a small angle, cut off at a distance of 1.
fn wedge(degrees: f64) -> TriMesh {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let section = [[0.0, 0.0], [1.0, 0.0], [cos, sin]];
    let vertices = [0.0, 1.3].map(|z| section.map(|[x, y]| Vec3::new(x, y, z))).concat();
    let mut faces = vec![[0, 2, 1], [3, 4, 5]];
    for a in 0..3_u32 {
        let b = (a + 1) % 3;
        faces.extend([[a, b, b + 3], [a, b + 3, a + 3]]);
    }
    TriMesh { vertices, faces }
}

/// `inner` as a cavity of `outer`.
fn hollow(outer: &TriMesh, inner: &TriMesh) -> TriMesh {
    shapes::joined(&[outer.clone(), shapes::inverted(inner.clone())])
}

fn scaled(mesh: TriMesh, factors: Vec3) -> TriMesh {
    shapes::moved(mesh, |p| p * factors)
}

/// Some direction.
const AXIS: Vec3 = Vec3::new(1.0, 2.0, 3.0);

fn turned(mesh: TriMesh, axis: Vec3) -> TriMesh {
    shapes::moved(mesh, |p| glam::DQuat::from_axis_angle(axis.normalize(), 1.0) * p)
}

#[test]
fn coarse_thin_and_sharp_solids_have_their_topology() {
    let box_of = |half: [f64; 3]| shapes::cuboid(-Vec3::from(half), Vec3::from(half));
    let ball = |level| shapes::sphere(level);
    let small = |size: f64| shapes::moved(ball(2), |p| size * p + Vec3::new(3.0, 0.0, 0.0));
    let sheets = |gap: f64| {
        let upper = shapes::cuboid(Vec3::new(0.0, 0.0, 0.1 + gap), Vec3::new(1.0, 1.0, 0.2 + gap));
        shapes::joined(&[shapes::cuboid(Vec3::ZERO, Vec3::new(1.0, 1.0, 0.1)), upper])
    };
    for (name, mesh) in [
        ("bent plate", bent_plate()),
        ("plate", box_of([1.0, 1.0, 1e-3])),
        ("thinner plate", box_of([1.0, 0.7, 1e-5])),
        ("needle", box_of([1.0, 1e-3, 1e-3])),
        ("flat ball", scaled(ball(4), Vec3::new(1.0, 1.0, 0.02))),
        ("wedge of 5 degrees", wedge(5.0)),
        ("wedge of 1 degree", wedge(1.0)),
        ("nested spheres", hollow(&ball(4), &scaled(ball(3), Vec3::splat(0.9)))),
        ("a thin shell", hollow(&ball(4), &turned(scaled(ball(4), Vec3::splat(0.99)), AXIS))),
        (
            "a coarse sphere in a box",
            hollow(&box_of([1.0; 3]), &scaled(ball(1), Vec3::splat(0.99))),
        ),
        ("a thin box in a box", hollow(&box_of([1.0; 3]), &box_of([0.99, 0.99, 0.001]))),
        ("sheets 1e-3 apart", sheets(1e-3)),
        ("sheets 1e-6 apart", sheets(1e-6)),
        ("a ball of a millionth", shapes::joined(&[ball(3), small(1e-6)])),
        ("a ball of a ten-millionth", shapes::joined(&[ball(3), small(1e-7)])),
        ("cospherical grid", shapes::lattice_cube(8)),
        ("torus", shapes::torus(64, 32)),
        ("coarse torus", shapes::torus(6, 5)),
    ] {
        right_start(name, &mesh);
    }
}

#[test]
fn starts_of_coarse_plates_and_bars_are_close_to_them() {
    for (k, half) in [0.1, 0.02, 0.005, 2e-3, 1e-3, 3e-4, 1e-5].into_iter().enumerate() {
        let plate = shapes::cuboid(Vec3::new(-1.0, -0.8, -half), Vec3::new(1.0, 0.8, half));
        let bar = scaled(plate.clone(), Vec3::new(1.0, 3.0 * half, 1.0));
        for (name, mesh) in [("plate", plate), ("bar", bar)] {
            let mesh = if k % 2 == 1 { turned(mesh, AXIS) } else { mesh };
            let (_, start) = right_start(name, &mesh);
            let shape = shape_of(&mesh, Sampling::default());
            let error = error_of(&shape, &start);
            assert!(error < 0.015, "{name} {half}: {error}");
        }
    }
}

#[test]
fn starts_of_thin_walls_side_by_side_are_close_to_them() {
    let wall = |low: [f64; 3], high: [f64; 3]| shapes::cuboid(low.into(), high.into());
    let base = wall([0.0, 0.0, 0.0], [1.0, 1.0, 0.1]);
    let fin = |k: u32| {
        let x = 0.05 + 0.12 * f64::from(k);
        wall([x, 0.02, 0.05], [x + 0.01, 0.98, 0.5])
    };
    let shelf = |k: u32| {
        let z = 0.3 * f64::from(k);
        wall([0.005, 0.02, z], [0.995, 0.38, z + 0.01])
    };
    let side = |x: f64| wall([x, 0.0, -0.1], [x + 0.01, 0.4, 1.3]);
    let fins: Vec<TriMesh> = (0..8).map(fin).chain([base]).collect();
    let shelves: Vec<TriMesh> = (0..5).map(shelf).chain([side(0.0), side(0.99)]).collect();
    for (name, parts) in [("fins", fins), ("shelves", shelves)] {
        let off = shapes::to_off(&shapes::joined(&parts));
        let solid = read_bytes(off.as_bytes(), Format::Off).expect("a solid");
        let (_, start) = right_start(name, &solid.mesh);
        let shape = shape_of(&solid.mesh, Sampling::default());
        let far = error_of(&shape, &start);
        assert!(far < 0.02, "{name}: {far}");
    }
}

#[test]
fn starts_of_blades_and_needles_reach_their_tips() {
    let tetrahedron = |b: [f64; 3], c: [f64; 3], d: [f64; 3]| {
        let vertices = [[0.0; 3], b, c, d].map(Vec3::from).to_vec();
        TriMesh { vertices, faces: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]] }
    };
    let blade = |height: f64| tetrahedron([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.3, 0.3, height]);
    let needle = |width: f64| tetrahedron([width, 0.0, 0.0], [0.0, width, 0.0], [0.0, 0.0, 1.0]);
    let tips = [0.01, 0.1].map(blade).into_iter().chain([0.001, 0.03, 0.1].map(needle));
    for (k, solid) in tips.enumerate() {
        let (_, start) = right_start("tips", &solid);
        let shape = shape_of(&solid, Sampling::default());
        let far = error_of(&shape, &start);
        assert!(far < 0.02, "solid {k}: {far}");
    }
}

#[test]
fn starts_around_concave_edges_at_any_angle_end_near_them() {
    let mut random = Pcg64::seed_from_u64(17);
    for k in 0..12 {
        let mut bar = || {
            let half = Vec3::from([0.1, 0.2, 0.4].map(|most| random.random_range(0.1..2.0 * most)));
            let axis = Vec3::from([0.0; 3].map(|_: f64| random.random_range(-1.0..1.0)));
            let by = Vec3::from([0.0; 3].map(|_: f64| random.random_range(-0.3..0.3)));
            shapes::moved(turned(shapes::cuboid(-half, half), axis), |p| p + by)
        };
        let bars = shapes::to_off(&shapes::joined(&[bar(), bar(), bar()]));
        let solid = read_bytes(bars.as_bytes(), Format::Off).unwrap().mesh;
        let (_, start) = right_start("bars", &solid);
        let found = distances(&shape_of(&solid, Sampling::default()), &start);
        // Balls may fill the bottom of a groove.
        assert!(found.reverse < 0.02 && found.hausdorff < 0.03, "solid {k}: {found:?}");
    }
}

/// A block with a slot of some width. The balls beside the slot are nearer to its floor than to its walls.
fn slotted(width: f64) -> TriMesh {
    let planes = [vec![0.0, 2.0, 2.0 + width, 4.0], vec![0.0, 3.0], vec![0.0, 0.4, 2.0]];
    shapes::cells(&planes, |[x, _, z]| x != 1 || z != 1)
}

/// A block with a flat closed cavity in the form of a square ring, narrower than the depth that balls may reach into it.
fn with_ring_cavity(width: f64) -> TriMesh {
    let across = vec![0.0, 2.0, 2.0 + width, 4.0, 4.0 + width, 6.0];
    let planes = [across.clone(), across, vec![0.0, 1.0, 1.003, 3.0]];
    let is_ring = |[x, y, z]: [usize; 3]| z == 1 && x.abs_diff(2).max(y.abs_diff(2)) == 1;
    shapes::cells(&planes, |cell| !is_ring(cell))
}

#[test]
fn narrow_gaps_are_kept_open_or_named() {
    let solids =
        [(slotted(0.003), false), (with_ring_cavity(0.1), true), (with_ring_cavity(0.5), false)];
    for (k, (solid, is_filled)) in solids.into_iter().enumerate() {
        let (_, start) = right_start("gap", &solid);
        let shape = shape_of(&solid, Sampling::default());
        shape.initial().unwrap();
        let remarks = shape.remarks();
        let is_named = remarks.iter().any(|remark| remark.contains("fill gaps"));
        let far = error_of(&shape, &start);
        assert_eq!(is_named, is_filled, "solid {k}: {far}, {remarks:?}");
        assert_eq!(far > 0.025, is_filled, "solid {k}: {far}");
    }
}

#[test]
fn a_start_that_leaves_parts_bare_is_named() {
    // A needle in pieces that are too short for a coarse surface.
    let rings: Vec<Vec3> = (0..15)
        .flat_map(|k| {
            let (z, width) = (f64::from(k) / 15.0, 1e-3 * (1.0 - f64::from(k) / 15.0));
            [[0.0, 0.0], [width, 0.0], [0.0, width]].map(|[x, y]| Vec3::new(x, y, z))
        })
        .chain([Vec3::Z])
        .collect();
    let ring = |k: u32| {
        [[0, 1], [1, 2], [2, 0]].into_iter().flat_map(move |[a, b]| {
            let [a, b] = [a + 3 * k, b + 3 * k];
            [[a, b, b + 3], [a, b + 3, a + 3]]
        })
    };
    let tip = [[42, 43, 45], [43, 44, 45], [44, 42, 45]];
    let faces = (0..14).flat_map(ring).chain(tip).chain([[0, 2, 1]]).collect();
    let solid = TriMesh { vertices: rings, faces };
    let shape = shape_of(&solid, Sampling::default());
    let start = shape.initial().unwrap();
    let far = error_of(&shape, &start);
    let remarks = shape.remarks();
    let is_named =
        remarks.iter().any(|remark| remark.contains("away from the initial medial mesh"));
    assert_eq!(is_named, far > 0.02, "{far}: {remarks:?}");
}

/// The two-sided Hausdorff error of a start.
fn error_of(shape: &Shape, start: &MedialMesh) -> f64 {
    distances(shape, start).hausdorff
}

fn distances(shape: &Shape, start: &MedialMesh) -> Distances {
    let (tree, inside) = (shape.surface_tree().unwrap(), shape.inside_test());
    let options = JudgeOptions { samples: 4_000, volume_depth: 0, seed: 1 };
    let judge = Judge::new(shape.mesh().clone(), tree, inside, Truth::default(), options);
    judge.distances(start).unwrap()
}

/// Unions of random cells of a grid of random planes, without edges and vertices where they only touch.
fn random_boxes(rng: &mut Pcg64) -> TriMesh {
    const N: usize = 5;
    let mut is_solid = [[[false; N + 2]; N + 2]; N + 2];
    let density = rng.random_range(0.3..0.8);
    let within =
        || (1..=N).flat_map(|x| (1..=N).flat_map(move |y| (1..=N).map(move |z| [x, y, z])));
    for [x, y, z] in within() {
        is_solid[x][y][z] = rng.random_bool(density);
    }
    // Around a corner the solid and the empty cells must each hang together by their faces.
    let is_joined = |cells: &[bool; 8], of: bool| {
        let of: Vec<usize> = (0..8).filter(|&k| cells[k] == of).collect();
        let mut seen: Vec<usize> = of.first().copied().into_iter().collect();
        let mut next = 0;
        while next < seen.len() {
            let near = [1, 2, 4].map(|bit| seen[next] ^ bit);
            seen.extend(
                near.into_iter()
                    .filter(|k| of.contains(k) && !seen.contains(k))
                    .collect::<Vec<_>>(),
            );
            next += 1;
        }
        seen.len() == of.len()
    };
    loop {
        let mut wrong = None;
        for x in 0..=N {
            for y in 0..=N {
                for z in 0..=N {
                    let at = |k: usize| [x + (k & 1), y + (k >> 1 & 1), z + (k >> 2)];
                    let cells: [bool; 8] = std::array::from_fn(|k| {
                        let [x, y, z] = at(k);
                        is_solid[x][y][z]
                    });
                    if !is_joined(&cells, true) || !is_joined(&cells, false) {
                        wrong = (0..8).map(at).find(|&[x, y, z]| is_solid[x][y][z]);
                    }
                }
            }
        }
        // Cells are only removed, so this ends.
        let Some([x, y, z]) = wrong else { break };
        is_solid[x][y][z] = false;
    }
    let planes: [Vec<f64>; 3] = std::array::from_fn(|_| {
        // Slabs from a thousandth of the others on.
        let mut planes = vec![0.0];
        for k in 0..N {
            planes.push(planes[k] + 10.0_f64.powf(rng.random_range(-3.0..0.0)));
        }
        planes
    });
    let mut mesh = shapes::cells(&planes, |[x, y, z]| is_solid[x + 1][y + 1][z + 1]);
    // Either diagonal of a square.
    for pair in mesh.faces.chunks_exact_mut(2) {
        if rng.random_range(0..4) % 2 == 1 {
            let ([a, b, c], [.., d]) = (pair[0], pair[1]);
            pair.copy_from_slice(&[[b, c, d], [b, d, a]]);
        }
    }
    mesh
}

#[test]
fn random_solids_of_boxes_have_their_topology() {
    let mut rng = Pcg64::seed_from_u64(11);
    let (mut loops, mut most) = (0, 0);
    for k in 0..100 {
        let mut mesh = random_boxes(&mut rng);
        if mesh.faces.is_empty() {
            continue;
        }
        // Turned, their sides are flat only up to rounding; sheared, their edges are no Delaunay edges.
        let mut number = || rng.random_range(-1.0..1.0);
        if k % 3 == 1 {
            mesh = turned(mesh, Vec3::new(number(), number(), number()));
        } else if k % 3 == 2 {
            let [x, y, z] = [number(), number(), number()];
            mesh = shapes::moved(mesh, |p| Vec3::new(p.x + x * p.y + y * p.z, p.y + z * p.z, p.z));
        }
        let (added, start) = right_start(&format!("solid {k}"), &mesh);
        most = most.max(added);
        loops += betti(&start)[1];
    }
    assert!(loops > 20 && most > 1_000, "{loops}, {most}");
}

#[test]
fn threads_order_scale_and_rotation_keep_the_topology() {
    let mesh = shapes::moved(bent_plate(), |p| Vec3::new(p.x + 3.0 * p.y, p.y + p.z, p.z));
    let start = |mesh: &TriMesh, threads: usize| {
        crate::on_threads(threads, || right_start("bent plate", mesh))
    };
    let (added, first) = start(&mesh, 1);
    assert!(added > 0);
    assert_eq!(start(&mesh, 3), (added, first.clone()));
    // A power of two is exact. The diagonal is not, so that the last bits of normalised numbers differ otherwise.
    assert_eq!(start(&scaled(mesh.clone(), Vec3::splat(4.0)), 2), (added, first.clone()));
    let mut renumbered = mesh.clone();
    renumbered.vertices.reverse();
    let last = mesh.vertices.len() as u32 - 1;
    renumbered.faces.iter_mut().for_each(|face| *face = face.map(|v| last - v));
    renumbered.faces.reverse();
    // Rounding and the order of the vertices decide ties: other points may be added, and the topology is right.
    for other in [scaled(mesh.clone(), Vec3::splat(1.0 / 3.0)), renumbered, turned(mesh, AXIS)] {
        let (count, _) = start(&other, 2);
        assert!((count as f64 / added as f64 - 1.0).abs() < 0.3, "{count} for {added}");
    }
}

#[test]
fn a_surface_that_crosses_itself_keeps_its_vertices_with_a_warning() {
    let crossing =
        shapes::joined(&[shapes::sphere(3), shapes::moved(shapes::sphere(3), |p| p + Vec3::X)]);
    let shape = shape_of(&crossing, Sampling::default());
    shape.initial().unwrap();
    assert_eq!(*shape.samples(), shape.mesh().vertices);
    let warning = shape.sampling_warning().unwrap();
    assert!(warning.contains("crosses itself"), "{warning}");
}

#[test]
fn a_coarse_surface_gets_the_samples_that_were_requested() {
    let cube = shapes::cuboid(Vec3::ZERO, Vec3::ONE);
    let shape = shape_of(&cube, "conforming:4000".parse().unwrap());
    assert_eq!(Some(betti(&shape.initial().unwrap())), shape.expected_betti());
    let samples = shape.samples();
    assert!((4_000..4_400).contains(&samples.len()), "{}", samples.len());
    assert!(shape.surface_tree().unwrap().distance_batch(&samples).iter().all(|&d| d < 1e-12));
    // Evenly: none of the halves that are left is long.
    let spacing = |p: &Vec3| {
        let others = samples.iter().filter(|q| *q != p);
        others.map(|q| p.distance(*q)).fold(f64::INFINITY, f64::min)
    };
    assert!(samples.iter().all(|p| spacing(p) < 0.1));
}
