//! Distances, certified intervals, volume error and axis distance against closed forms.

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use medial::Vec3;
use medial::complex::{MedialMesh, MedialUnion, UnionError};
use medial::geometry::{Cone, Slab, Sphere};
use medial::metrics::{
    Certificate, Distances, EnvelopeOptions, Judge, JudgeOptions, MetricError, ROUNDING, Truth,
    Witness, WitnessSide, certify, enclosed_volume, sample_envelope,
};
use medial::surface::{TriMesh, TriangleBvh};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

fn judge(surface: &TriMesh, samples: usize, seed: u64) -> Judge {
    let options = JudgeOptions { samples, volume_depth: 6, seed };
    crate::judge(surface, Truth::default(), options)
}

fn measure(surface: &TriMesh, mesh: &MedialMesh) -> Distances {
    judge(surface, 20_000, 0).distances(mesh).unwrap()
}

fn complex(spheres: &[(Vec3, f64)], edges: &[[u32; 2]], faces: &[[u32; 3]]) -> MedialMesh {
    let spheres = spheres.iter().map(|&(c, r)| Sphere::new(c, r)).collect();
    MedialMesh::from_simplices(spheres, edges.to_vec(), faces.to_vec()).unwrap()
}

/// A surface of revolution around x. The profile runs from pole to pole.
fn revolve(profile: &[(f64, f64)], around: u32) -> TriMesh {
    let rings = profile.len() as u32 - 2;
    let mut mesh = TriMesh::default();
    mesh.vertices.push(Vec3::X * profile[0].0);
    for &(x, rho) in &profile[1..=rings as usize] {
        mesh.vertices.extend((0..around).map(|k| {
            let (sin, cos) = (TAU * f64::from(k) / f64::from(around)).sin_cos();
            Vec3::new(x, rho * cos, rho * sin)
        }));
    }
    mesh.vertices.push(Vec3::X * profile[rings as usize + 1].0);
    let id = |ring: u32, k: u32| 1 + ring * around + k % around;
    let last = mesh.vertices.len() as u32 - 1;
    for k in 0..around {
        mesh.faces.push([0, id(0, k + 1), id(0, k)]);
        mesh.faces.push([last, id(rings - 1, k), id(rings - 1, k + 1)]);
        for ring in 1..rings {
            let [a, b] = [id(ring - 1, k), id(ring - 1, k + 1)];
            let [c, d] = [id(ring, k + 1), id(ring, k)];
            mesh.faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

/// Hull of the balls at x = 0 and x = `length`, as a fine mesh with all vertices on it.
fn tapered_capsule(length: f64, radii: [f64; 2], steps: u32) -> TriMesh {
    let slope = (radii[1] - radii[0]) / length;
    // Angle from the -x direction at which both spheres meet the lateral.
    let meet = PI - (-slope).acos();
    let angle = |k: u32, from: f64, to: f64| from + (to - from) * f64::from(k) / f64::from(steps);
    let on = |x: f64, r: f64, a: f64| (x - r * a.cos(), r * a.sin());
    let mut profile: Vec<_> = (0..=steps).map(|k| on(0.0, radii[0], angle(k, 0.0, meet))).collect();
    profile.extend((0..=steps).map(|k| on(length, radii[1], angle(k, meet, PI))));
    let mut profile: Vec<_> = profile.into_iter().map(|(x, rho)| (x, rho.max(0.0))).collect();
    let end = profile.len() - 1;
    (profile[0].1, profile[end].1) = (0.0, 0.0);
    revolve(&profile, 4 * steps)
}

/// The box `[0, a] x [0, b] x [0, c]` with `a >= b >= c`, and its exact medial axis: 13 sheets.
fn cuboid(a: f64, b: f64, c: f64) -> (TriMesh, MedialMesh) {
    let size = Vec3::new(a, b, c);
    let surface = crate::shapes::cuboid(Vec3::ZERO, size);
    let h = Vec3::splat(c / 2.0);
    let mut spheres: Vec<_> = surface.vertices.iter().map(|&p| (p, 0.0)).collect();
    spheres.extend(surface.vertices[..4].iter().map(|p| (p.clamp(h, size - h), c / 2.0)));
    let mut sheets = vec![[8, 9, 11], [8, 11, 10]];
    // One sheet below each edge of the box: triangles at the upright ones, else trapezoids.
    for (i, j) in [(0, 1), (2, 3), (0, 2), (1, 3)] {
        for top in [0, 4] {
            sheets.extend([[i + top, j + top, j + 8], [i + top, j + 8, i + 8]]);
        }
    }
    sheets.extend((0..4).map(|k| [k, k + 4, k + 8]));
    (surface, complex(&spheres, &[], &sheets))
}

#[test]
fn a_box_is_rebuilt_from_its_exact_axis() {
    let (surface, axis) = cuboid(3.0, 2.0, 1.0);
    assert_eq!(axis.faces.len(), 2 + 16 + 4);
    let d = measure(&surface, &axis);
    assert!(d.epsilon < 1e-14 && d.epsilon_union < 1e-14, "{d:?}");
    // Points buried by less than 1e-7 of the diagonal count as boundary.
    assert!(d.reverse < 4e-7 && d.hausdorff < 4e-7, "{d:?}");
    assert!(d.rms < 1e-15 && d.p99 < 1e-15, "{d:?}");
    // From the middle of a long edge the nearest balls of radius 0.5 are 1 along and 0.5 across.
    let exact = 1.5_f64.sqrt() - 0.5;
    assert!(d.spheres_only <= exact && d.spheres_only > exact - 0.01, "{d:?}");
    assert_eq!(d.samples, 20_008);

    assert_eq!(enclosed_volume(&surface), 6.0);
    assert_eq!(judge(&surface, 100, 0).volume_error(&axis), Ok(Some(0.0)));

    // Without one corner of the axis the box lacks the edges that meet there.
    let chipped = axis.induced(&(0..12).map(|k| k != 4).collect::<Vec<_>>());
    let d = measure(&surface, &chipped);
    assert!((d.epsilon_union - (0.75_f64.sqrt() - 0.5)).abs() < 1e-14, "{d:?}");
    let blunt = 0.5 - 0.5 / 3.0_f64.sqrt();
    assert!(d.reverse <= blunt && d.reverse > blunt - 0.02, "{d:?}");
}

#[test]
fn a_tapered_capsule_is_rebuilt_from_one_edge() {
    let (length, radii) = (2.0, [0.5, 0.9]);
    let surface = tapered_capsule(length, radii, 40);
    let axis = complex(&[(Vec3::ZERO, radii[0]), (Vec3::X * length, radii[1])], &[[0, 1]], &[]);
    let d = measure(&surface, &axis);
    // Chords of the mesh cut below the round surface by their sagitta.
    let sag = 0.9 * (1.0 - (PI / 80.0).cos()) * 3.0;
    assert!(d.epsilon_union < sag && d.reverse < sag, "{d:?} against {sag}");
    assert!((d.epsilon - d.epsilon_union).abs() < 1e-15);
    let vertices_on = MedialUnion::new(&axis).unwrap().signed_batch(&surface.vertices);
    assert!(vertices_on.iter().all(|s| s.abs() < 1e-14));
    assert!(d.mean > 0.0 && d.mean <= d.rms && d.rms <= d.p99 && d.p95 <= d.p99);
    assert!(d.spheres_only > 10.0 * d.epsilon_union);
}

#[test]
fn a_ball_in_a_ball_has_the_difference_of_the_radii_everywhere() {
    let (outer, inner) = (1.0, 0.8);
    let surface = tapered_capsule(1e-9, [outer; 2], 40);
    let axis = complex(&[(Vec3::ZERO, inner)], &[], &[]);
    let d = measure(&surface, &axis);
    let sag = 2.0 * (1.0 - (PI / 80.0).cos());
    for value in [d.epsilon, d.epsilon_union, d.reverse, d.hausdorff, d.spheres_only] {
        assert!(value <= 0.2 + 1e-8 && value > 0.2 - sag, "{d:?}");
    }
    assert!((d.mean - 0.2).abs() < sag && (d.reverse_mean - 0.2).abs() < sag);

    let volume = enclosed_volume(&surface);
    let error = judge(&surface, 100, 3).volume_error(&axis).unwrap().unwrap();
    let exact = 1.0 - 4.0 / 3.0 * PI * inner.powi(3) / volume;
    assert!((error - exact).abs() < 2e-3, "{error} for {exact}");
}

#[test]
fn buried_surfaces_count_for_epsilon_alone() {
    // The wall between the balls lies deep in the union, but on the surface of each.
    let wall = TriMesh {
        vertices: vec![
            Vec3::new(1.0, -0.1, 0.0),
            Vec3::new(1.0, 0.1, 0.0),
            Vec3::new(1.0, 0.0, 0.1),
        ],
        faces: vec![[0, 1, 2]],
    };
    let balls = complex(&[(Vec3::ZERO, 1.0), (Vec3::X * 0.5, 2.0)], &[], &[]);
    let d = measure(&wall, &balls);
    assert!(d.epsilon < 0.01, "{d:?}");
    assert!((d.epsilon_union - 1.5).abs() < 0.01, "{d:?}");
}

#[test]
fn the_envelope_is_sampled_by_area() {
    let (r, l) = (0.5, 2.0);
    let mesh = complex(&[(Vec3::ZERO, r), (Vec3::X * l, r)], &[[0, 1]], &[]);
    let union = MedialUnion::new(&mesh).unwrap();
    let options = EnvelopeOptions { samples: 10_000, burial: 1e-9, seed: 4 };
    let points = sample_envelope(&mesh, &union, &options).unwrap();
    // Half of either sphere is buried, and made up for.
    assert!((points.len() as f64 - 1e4).abs() < 500.0, "{}", points.len());
    assert!(points.iter().all(|&p| union.signed(p).abs() < 1e-8));
    let lateral = points.iter().filter(|p| p.x > 0.0 && p.x < l).count() as f64;
    let share = TAU * r * l / (TAU * r * l + 2.0 * TAU * r * r);
    assert!((lateral / points.len() as f64 - share).abs() < 0.01);

    let tapered = complex(&[(Vec3::ZERO, 0.2), (Vec3::X * l, 1.0)], &[[0, 1]], &[]);
    let union = MedialUnion::new(&tapered).unwrap();
    let points = sample_envelope(&tapered, &union, &options).unwrap();
    let (s, k) = (0.4, (1.0_f64 - 0.16).sqrt());
    let lateral = PI * k * k * l * 1.2;
    let caps = TAU * (0.04 * (1.0 - s) + (1.0 + s));
    // The lateral spans -s r from either centre.
    let on_lateral = points.iter().filter(|p| p.x > -s * 0.2 && p.x < l - s).count() as f64;
    assert!((on_lateral / points.len() as f64 - lateral / (lateral + caps)).abs() < 0.01);

    let slab = [(Vec3::ZERO, 0.1), (Vec3::X, 0.1), (Vec3::Y, 0.1)];
    let slab = complex(&slab, &[], &[[0, 1, 2]]);
    let union = MedialUnion::new(&slab).unwrap();
    let points = sample_envelope(&slab, &union, &options).unwrap();
    let flat = points.iter().filter(|p| (p.z.abs() - 0.1).abs() < 1e-12).count() as f64;
    let rim = PI * 0.1 * (2.0 + 2.0_f64.sqrt());
    let area = 1.0 + rim + 4.0 * PI * 0.01;
    assert!((flat / points.len() as f64 - 1.0 / area).abs() < 0.01);
}

/// Of thousands of balls that bury each other few points are on the boundary; enough of them are found
/// for a maximum.
#[test]
fn a_union_of_buried_balls_is_sampled_until_enough_are_found() {
    let coordinate = |k: u32, step: f64| (f64::from(k) * step).fract();
    let centre =
        |k| Vec3::new(coordinate(k, 0.819_17), coordinate(k, 0.671_04), coordinate(k, 0.549_7));
    let balls: Vec<_> = (0..1500).map(|k| (centre(k), 0.3)).collect();
    let mesh = complex(&balls, &[], &[]);
    let union = MedialUnion::new(&mesh).unwrap();
    let options = EnvelopeOptions { samples: 400, burial: 1e-9, seed: 1 };
    let points = sample_envelope(&mesh, &union, &options).unwrap();
    // Ten candidates for each requested sample give some tens.
    assert!((80..=400).contains(&points.len()), "{}", points.len());
    assert!(points.iter().all(|&p| union.signed(p).abs() < 1e-9));
}

#[test]
fn unions_without_area_are_measured_at_their_centres() {
    let (surface, _) = cuboid(3.0, 2.0, 1.0);
    let point = complex(&[(Vec3::new(1.0, 1.0, 0.25), 0.0)], &[], &[]);
    let d = measure(&surface, &point);
    assert_eq!((d.reverse, d.reverse_samples), (0.25, 1));
    assert!((d.epsilon_union - (4.0_f64 + 1.0 + 0.5625).sqrt()).abs() < 1e-12);
}

#[test]
fn results_do_not_depend_on_threads() {
    let (surface, axis) = cuboid(3.0, 2.0, 1.0);
    let blunt = axis.induced(&(0..12).map(|k| k % 3 != 0).collect::<Vec<_>>());
    let run = |threads| {
        crate::on_threads(threads, || {
            let volume = judge(&surface, 100, 1).volume_error(&blunt).unwrap();
            (volume, measure(&surface, &blunt), certified(&surface, &blunt, 0.1))
        })
    };
    let one = run(1);
    assert!(one.0 > Some(0.0));
    assert_eq!(one, run(3));
}

#[test]
fn unmeasurable_inputs_are_rejected() {
    let (surface, axis) = cuboid(3.0, 2.0, 1.0);
    let measured =
        |surface: &TriMesh, mesh: &MedialMesh, samples| judge(surface, samples, 0).distances(mesh);
    let empty = measured(&surface, &MedialMesh::default(), 10);
    assert!(matches!(empty, Err(MetricError::Union(_))));
    let flat = TriMesh { vertices: vec![Vec3::ZERO; 3], faces: vec![[0, 1, 2]] };
    assert_eq!(measured(&flat, &axis, 10), Err(MetricError::NoArea));
    let far = complex(&[(Vec3::ZERO, 1.0), (Vec3::X * 1e200, 1.0)], &[[0, 1]], &[]);
    let refused = measured(&surface, &far, 10);
    assert_eq!(refused, Err(MetricError::Union(UnionError::TooLarge { sphere: 1 })));
    assert!(matches!(measured(&surface, &axis, 0), Err(MetricError::NoSamples(_))));
    let union = MedialUnion::new(&axis).unwrap();
    let none = EnvelopeOptions { samples: 0, burial: 0.0, seed: 0 };
    let error = sample_envelope(&axis, &union, &none);
    assert!(matches!(error, Err(MetricError::NoSamples(_))));
    let open = TriMesh { vertices: surface.vertices.clone(), faces: vec![[0, 1, 2]] };
    let error = judge(&open, 10, 0).volume_error(&axis);
    assert!(matches!(error, Err(MetricError::NoVolume(_))));
}

#[test]
fn a_union_whose_area_all_but_underflows_is_its_centres() {
    // Areas of 1e-309: a finite total, an infinite density.
    let mesh = complex(&[(Vec3::ZERO, 1e-155), (Vec3::X, 1e-155)], &[], &[]);
    let union = MedialUnion::new(&mesh).unwrap();
    for samples in [1, 1000, 10_000_000] {
        let options = EnvelopeOptions { samples, burial: 0.0, seed: 0 };
        assert_eq!(sample_envelope(&mesh, &union, &options).unwrap(), [Vec3::ZERO, Vec3::X]);
    }
}

/// The box of the given half sides around the origin.
fn centred_cuboid(half: Vec3) -> TriMesh {
    crate::shapes::cuboid(-half, half)
}

// Certified intervals.

fn certified(surface: &TriMesh, mesh: &MedialMesh, tolerance: f64) -> Certificate {
    let bvh = TriangleBvh::new(surface).unwrap();
    let certificate = certify(surface, &bvh, mesh, tolerance).unwrap();
    assert!(certificate.upper - certificate.lower <= tolerance, "{certificate:?}");
    // The lower end is the distance of the witness, which lies where `on` says.
    let Witness { point, on } = certificate.witness;
    let signed = MedialUnion::new(mesh).unwrap().signed(point);
    let to_surface = bvh.closest(point).distance;
    let (off, distance) = match on {
        WitnessSide::Surface => (to_surface, signed.abs()),
        WitnessSide::Union => (signed.abs(), to_surface),
    };
    assert!(off <= ROUNDING, "the witness is {off} off the {on:?}");
    assert!((distance - certificate.lower).abs() <= 2.0 * ROUNDING, "{certificate:?}: {distance}");
    certificate
}

#[track_caller]
fn holds(surface: &TriMesh, mesh: &MedialMesh, exact: f64) {
    for tolerance in [1e-2, 1e-3, 1e-4] {
        let Certificate { lower, upper, .. } = certified(surface, mesh, tolerance);
        assert!((lower..=upper).contains(&exact), "{exact} is not within {lower} to {upper}");
    }
}

#[test]
fn the_interval_holds_known_distances() {
    let half = Vec3::new(0.4, 0.3, 0.2);
    let surface = centred_cuboid(half);
    // A ball inside: the corners are farthest, or the middle of the ball's surface.
    let ball = |c, r| complex(&[(c, r)], &[], &[]);
    holds(&surface, &ball(Vec3::ZERO, 0.15), half.length() - 0.15);
    // A ball around the box: its poles over the largest faces.
    holds(&surface, &ball(Vec3::ZERO, 0.9), 0.9 - 0.2);
    // A point.
    holds(&surface, &ball(Vec3::ZERO, 0.0), half.length());
    // A capsule along the longest axis: the corners again.
    let ends = [(-0.3 * Vec3::X, 0.1), (0.3 * Vec3::X, 0.1)];
    let capsule = complex(&ends, &[[0, 1]], &[]);
    holds(&surface, &capsule, Vec3::new(0.1, 0.3, 0.2).length() - 0.1);
    // A tapered cone that sticks out: its far end.
    let spike = complex(&[(Vec3::ZERO, 0.15), (Vec3::X, 0.05)], &[[0, 1]], &[]);
    let corner = Cone::new(Sphere::new(Vec3::ZERO, 0.15), Sphere::new(Vec3::X, 0.05));
    holds(
        &surface,
        &spike,
        (1.05_f64 - 0.4).max(corner.signed_distance(Vec3::new(-0.4, 0.3, 0.2))),
    );
    // A slab far above: its plane is parallel to the box's top.
    let corners = [Vec3::new(-0.1, -0.1, 0.7), Vec3::new(0.2, -0.1, 0.7), Vec3::new(0.0, 0.2, 0.7)];
    let slab = complex(&corners.map(|c| (c, 0.05)), &[], &[[0, 1, 2]]);
    let depth = Slab::new(corners.map(|c| Sphere::new(c, 0.05)));
    let below = surface.vertices.iter().map(|&v| depth.signed_distance(v)).fold(0.0, f64::max);
    holds(&surface, &slab, below.max(0.75 - 0.2));
}

#[test]
fn the_interval_holds_the_distance_of_balls_and_spheres() {
    for levels in [0, 2, 3] {
        let surface = crate::shapes::sphere(levels);
        // Every face is acute: the foot of the centre lies in it.
        let plane = |f: usize| {
            let [a, b, c] = surface.triangle(f);
            (b - a).cross(c - a).normalize().dot(a)
        };
        let inradius = (0..surface.faces.len()).map(plane).fold(1.0, f64::min);
        let ball = |r| complex(&[(Vec3::ZERO, r)], &[], &[]);
        // Within: the vertices are farthest. Around: the points over the middles of faces.
        holds(&surface, &ball(0.3), 1.0 - 0.3);
        holds(&surface, &ball(1.25), 1.25 - inradius);
        // Two balls, one of them buried: nothing changes.
        let two = complex(&[(Vec3::ZERO, 1.25), (0.2 * Vec3::X, 0.9)], &[], &[]);
        holds(&surface, &two, 1.25 - inradius);
    }
}

/// A polyhedron with its vertices on a cone that is thicker by `t` everywhere is `t` away from it.
#[test]
fn the_interval_holds_the_distance_of_a_cone() {
    let (length, radii) = (0.8, [0.1, 0.25]);
    let surface = tapered_capsule(length, radii, 6);
    let on = Cone::new(Sphere::new(Vec3::ZERO, radii[0]), Sphere::new(length * Vec3::X, radii[1]));
    assert!(surface.vertices.iter().all(|&v| on.signed_distance(v).abs() < 1e-14));
    for t in [0.05, 0.09] {
        let ends = [(Vec3::ZERO, radii[0] - t), (length * Vec3::X, radii[1] - t)];
        holds(&surface, &complex(&ends, &[[0, 1]], &[]), t);
    }
}

/// The boundary of a ball that another one mostly covers counts only where it is not covered.
#[test]
fn buried_parts_do_not_count() {
    let surface = centred_cuboid(Vec3::splat(0.3));
    let balls = [(Vec3::ZERO, 0.5), (0.1 * Vec3::X, 0.3)];
    let alone = certified(&surface, &complex(&balls[..1], &[], &[]), 1e-4);
    let both = certified(&surface, &complex(&balls, &[], &[]), 1e-4);
    assert!((alone.lower - both.lower).abs() <= 1e-4 && (alone.upper - both.upper).abs() <= 1e-4);
}

/// The block `[0, 3] x [0, 2] x [0, 1]` without the box between two corners, which may reach its sides.
fn block_without(lo: Vec3, hi: Vec3) -> TriMesh {
    let size = [3.0, 2.0, 1.0];
    let cuts: [Vec<f64>; 3] = std::array::from_fn(|k| {
        let mut cuts = vec![0.0, lo[k], hi[k], size[k]];
        cuts.dedup();
        cuts
    });
    let is_hole = |cell: [usize; 3]| (0..3).all(|k| (lo[k]..hi[k]).contains(&cuts[k][cell[k]]));
    crate::shapes::cells(&cuts, |cell| !is_hole(cell))
}

/// A surface and a medial mesh, divided by a length.
fn divided(mut surface: TriMesh, mesh: &MedialMesh, by: f64) -> (TriMesh, MedialMesh) {
    surface.vertices.iter_mut().for_each(|v| *v /= by);
    (surface, mesh.transformed(1.0 / by, |p| p / by))
}

/// The measured distance is a share of the exact one, which is in the intervals of these widths.
#[track_caller]
fn agrees(
    (surface, mesh): &(TriMesh, MedialMesh),
    exact: f64,
    shares: Range<f64>,
    tolerances: &[f64],
) -> Distances {
    let measured = measure(surface, mesh);
    let share = measured.hausdorff / exact;
    assert!(shares.contains(&share), "{share} of {exact}");
    let bvh = TriangleBvh::new(surface).unwrap();
    for &tolerance in tolerances {
        let found = certify(surface, &bvh, mesh, tolerance).unwrap();
        assert!((found.lower..=found.upper).contains(&exact), "{exact} is not in {found:?}");
        assert!(found.upper - found.lower <= tolerance);
        assert!(measured.hausdorff <= found.upper);
    }
    measured
}

/// Two plates at these heights, as thick and as far from the sides of a rectangle as twice and once the radius.
fn two_plates([x, y]: [f64; 2], r: f64, heights: [f64; 2]) -> MedialMesh {
    let plate = |z: f64| {
        [[r, r], [x - r, r], [x - r, y - r], [r, y - r]].map(|[x, y]| (Vec3::new(x, y, z), r))
    };
    let spheres = heights.map(plate).concat();
    complex(&spheres, &[], &[[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]])
}

/// The axis of a whole block fills slots, pockets, tubes and cavities of any width, whose walls are far from its boundary.
#[test]
fn filled_cavities_are_as_far_as_their_walls() {
    let (_, axis) = cuboid(3.0, 2.0, 1.0);
    for width in [0.002, 0.02, 0.2] {
        let [low, high] = [1.5 - width / 2.0, 1.5 + width / 2.0];
        for (lo, hi) in [
            // A slot through the block, a pocket, a tube and a closed cavity.
            (Vec3::new(low, 0.0, 0.2), Vec3::new(high, 2.0, 1.0)),
            (Vec3::new(low, 0.5, 0.2), Vec3::new(high, 1.5, 1.0)),
            (Vec3::new(low, 0.9, 0.0), Vec3::new(high, 0.9 + width, 1.0)),
            (Vec3::new(low, 0.5, 0.2), Vec3::new(high, 1.5, 0.8)),
        ] {
            let surface = block_without(lo, hi);
            medial::surface::validate(&surface).expect("a solid");
            // Half way up every wall, as far from the top as from the bottom.
            let exact = 0.5 / 14_f64.sqrt();
            let filled = divided(surface, &axis, 14_f64.sqrt());
            let measured = agrees(&filled, exact, 0.999..1.0 + 1e-9, &[1e-3]);
            assert_eq!(measured.hausdorff, measured.epsilon_union);
        }
    }
}

/// Hundreds of balls fill a narrow tube, whose walls are far from the boundary, at almost the same distance everywhere: a
/// search that decides one point looks at some ten thousand pieces.
#[test]
fn tubes_in_many_balls_are_certified() {
    for seed in 0..3 {
        let mut rng = Pcg64::seed_from_u64(seed);
        let surface = block_without(Vec3::new(1.5, 1.0, 0.0), Vec3::new(1.51, 1.01, 1.0));
        let size = Vec3::new(3.0, 2.0, 1.0);
        let balls: Vec<_> = (0..300)
            .map(|_| {
                let centre = Vec3::from_array([0, 1, 2].map(|k| rng.random_range(0.0..size[k])));
                let room = (0..3).map(|k| centre[k].min(size[k] - centre[k]));
                (centre, room.fold(1.0, f64::min) * rng.random_range(0.8..1.03))
            })
            .collect();
        let (surface, mesh) = divided(surface, &complex(&balls, &[], &[]), 14_f64.sqrt());
        let measured = measure(&surface, &mesh).hausdorff;
        let bvh = TriangleBvh::new(&surface).unwrap();
        let found = certify(&surface, &bvh, &mesh, 2e-3).unwrap();
        assert!(found.upper - found.lower <= 2e-3, "{found:?}");
        assert!((0.99 * found.lower..=found.upper).contains(&measured), "{measured}: {found:?}");
    }
}

/// Two plates that overlap fill a cavity: ways out of the deeper one lead into the other, again and again.
#[test]
fn cavities_in_two_plates_are_certified() {
    let cases = [0.2, 0.02, 1e-4, 1e-9, 0.0].map(|overlap| [(overlap, 0.05), (overlap, 0.001)]);
    for (overlap, height) in cases.into_iter().flatten() {
        let lo = Vec3::new(1.45, 0.95, 0.5 - height);
        let surface = block_without(lo, Vec3::new(1.55, 1.05, 0.5 + height));
        let offset = 0.3 - overlap / 2.0;
        let plates = two_plates([3.0, 2.0], 0.3, [0.5 - offset, 0.5 + offset]);
        // From half way up the walls to the outer side of either plate.
        let exact = (0.6 - overlap / 2.0) / 14_f64.sqrt();
        let filled = divided(surface, &plates, 14_f64.sqrt());
        agrees(&filled, exact, 0.999..1.0 + 1e-6, &[1e-2, 1e-3]);
    }
}

/// Two plates, one on the other, with a gap, without, and with an overlap: the wall between them is inside their union
/// unless a gap is wider than 1e-7 of the diameter, whatever the diagonal of the bounding box of the turned block.
#[test]
fn walls_between_primitives_that_touch_are_no_boundary() {
    let overlaps = [-1e-5, -1e-6, -7.5e-7, -3e-7, -1e-8, 0.0, 1e-12, 1e-9, 1e-7, 1e-4];
    for (overlap, size) in
        overlaps.map(|overlap| (overlap, 6.0)).into_iter().chain([(-7.5e-7, 9.0)])
    {
        let (surface, _) = cuboid(4.0, 4.0, 2.0);
        let plates = two_plates([4.0, 4.0], 0.5, [0.5, 1.5 - overlap]);
        // From the bottom of the notch around the plates, where their rims meet at an edge of the box, to its sides;
        // from the middle of a gap to the ends of the box.
        let half = (1.0 - overlap) / 2.0;
        let notch = (0.5 - f64::sqrt((0.25 - half * half).max(0.0) / 2.0)) / size;
        let exact = if overlap < -6e-7 { 1.0 / size } else { notch };
        agrees(&divided(surface, &plates, size), exact, 0.97..1.0 + 1e-6, &[5e-3]);
    }
}

#[test]
fn the_interval_agrees_with_samples_on_random_meshes() {
    let mut rng = Pcg64::seed_from_u64(7);
    let mut random =
        |scale: f64| scale * Vec3::from_array(std::array::from_fn(|_| rng.random_range(-1.0..1.0)));
    let surface = centred_cuboid(Vec3::new(0.35, 0.3, 0.2));
    let judge = judge(&surface, 5_000, 1);
    for round in 0..12 {
        let spheres: Vec<_> =
            (0..8).map(|_| (random(0.3), random(0.2).length() * f64::from(round % 3))).collect();
        let edges = [[0, 5], [5, 6], [1, 7]];
        let mesh = complex(&spheres, &edges, &[[0, 1, 2], [1, 2, 3], [2, 3, 4]]);
        let interval = certified(&surface, &mesh, 1e-3);
        let sampled = judge.distances(&mesh).unwrap().hausdorff;
        assert!(sampled <= interval.upper, "{sampled} is above {interval:?}");
        // The largest samples alone fall short by a tenth.
        assert!(sampled >= 0.99 * interval.lower, "{sampled} is far below {interval:?}");
    }
}

/// A ball with hundreds of narrow bumps, one of which is higher than the others: few samples lie on it.
#[test]
fn the_highest_of_many_narrow_bumps_is_found() {
    let surface = crate::shapes::sphere(4);
    let bump = |direction: Vec3, height: f64| ((0.98 + height) * direction, 0.02);
    for seed in 0..4 {
        let mut rng = Pcg64::seed_from_u64(seed);
        let mut random = || Vec3::from_array(std::array::from_fn(|_| rng.random_range(-1.0..1.0)));
        let mut balls = vec![(Vec3::ZERO, 1.0)];
        balls.extend((0..300).map(|_| bump(random().normalize(), 0.01)));
        // Over the foot of the centre in a face, which is acute.
        let [a, b, c] = surface.triangle(400 * seed as usize);
        let normal = (b - a).cross(c - a).normalize();
        balls.push(bump(normal, 0.015));
        let exact = 1.015 - normal.dot(a);
        let sampled = judge(&surface, 500, seed).distances(&complex(&balls, &[], &[])).unwrap();
        let share = sampled.hausdorff / exact;
        assert!((0.99..1.0 + 1e-9).contains(&share), "{share} of {exact}");
    }
}

#[test]
fn uncertifiable_tolerances_are_rejected() {
    let surface = centred_cuboid(Vec3::splat(0.3));
    let bvh = TriangleBvh::new(&surface).unwrap();
    let mesh = complex(&[(Vec3::ZERO, 0.2)], &[], &[]);
    for tolerance in [0.0, -1.0, 1e-9, 2.0, f64::NAN, f64::INFINITY] {
        let refused = certify(&surface, &bvh, &mesh, tolerance);
        assert!(matches!(refused, Err(MetricError::Tolerance(_))), "{refused:?}");
    }
    // Rounding of such a ball exceeds the tolerance.
    let huge = complex(&[(Vec3::Z * -1e12, 1e12 + 1.0), (Vec3::ZERO, 0.1)], &[[0, 1]], &[]);
    let refused = certify(&surface, &bvh, &huge, 1e-3);
    assert!(matches!(refused, Err(MetricError::TooLarge { .. })), "{refused:?}");
    let empty = certify(&surface, &bvh, &MedialMesh::default(), 1e-3);
    assert!(matches!(empty, Err(MetricError::Union(_))));
}
