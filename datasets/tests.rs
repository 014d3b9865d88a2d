//! Every shape against a separate analytic depth function: nothing shared with the generators.

use std::sync::Arc;

use medial::Vec3;
use medial::complex::{MedialMesh, MedialUnion, SheetGraph, SheetOptions, Sphere, betti};
use medial::geometry::PowerCrust;
use medial::metrics::{ContactType, JudgeOptions, StructureSurface, spikes};
use medial::shape::{Shape, ShapeOptions};
use medial::surface::{
    self, InsideTest, Normalisation, Sampling, SurfaceReport, TriMesh, TriangleBvh, sample,
    validate,
};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::implicit::{Blend, Field};
use crate::shapes::{blob_field, double_torus_field, frame_field};
use crate::{BuiltIn, add_noise, catalogue, find};

/// Distance from a point to the surface, positive inside.
///
/// Exact inside every shape and on its surface; outside, only the sign is right. For the blended
/// shapes it is the value of the field, at most the distance.
fn depth(id: &str, p: Vec3) -> f64 {
    let rho = p.x.hypot(p.y);
    let in_box = |p: Vec3, half: [f64; 3]| (Vec3::from(half) - p.abs()).min_element();
    let in_capsule = |p: Vec3, half: f64, radius: f64| {
        radius - p.distance(Vec3::new(0.0, 0.0, p.z.clamp(-half, half)))
    };
    let in_blend = |field: Blend| -field.at(p).0;
    match id {
        "sphere" => 1.0 - p.length(),
        "ellipsoid" => in_ellipsoid(p),
        "box" => in_box(p, [1.5, 1.0, 0.5]),
        "plate" => in_box(p, [1.0, 0.75, 0.05]),
        "rounded-box" => {
            let beyond = p.abs() - Vec3::new(1.0, 0.6, 0.25);
            0.25 - beyond.max(Vec3::ZERO).length() - beyond.max_element().min(0.0)
        }
        "bracket" => {
            let sides = [[0.0, 0.0], [2.0, 0.0], [2.0, 0.4], [0.4, 0.4], [0.4, 1.5], [0.0, 1.5]];
            in_polygon(&sides, p.x, p.z).min(p.y).min(1.0 - p.y)
        }
        "capsule" => in_capsule(p, 0.8, 0.4),
        "rod" => (0.4 - rho).min((1.2 - p.z.abs() - rho) * 0.5f64.sqrt()),
        "pair" => {
            let ball = 0.6 - p.distance(Vec3::new(-1.0, 0.0, 0.0));
            ball.max(in_capsule(p - Vec3::new(0.5, 0.0, 0.0), 0.5, 0.3))
        }
        "torus" => 0.4 - (rho - 1.0).hypot(p.z),
        "coil" => in_coil(p),
        "hollow-sphere" => (1.0 - p.length()).min(p.length() - 0.5),
        "wedge" => {
            let half = 1.2 * 20f64.to_radians().tan();
            in_polygon(&[[-half, 0.0], [half, 0.0], [0.0, 1.2]], p.x, p.z).min(0.8 - p.y.abs())
        }
        "frustum" => in_polygon(&[[-0.8, -1.0], [0.8, -1.0], [0.4, 1.0], [-0.4, 1.0]], rho, p.z),
        "fillet" => {
            let inner = match (p.x < 0.7, p.z < 0.7) {
                (true, true) => (p.x - 0.7).hypot(p.z - 0.7) - 0.3,
                (true, false) => 0.4 - p.x,
                (false, true) => 0.4 - p.z,
                (false, false) => -1.0,
            };
            [p.x, p.z, 2.0 - p.x, 1.5 - p.z, p.y, 1.0 - p.y].into_iter().fold(inner, f64::min)
        }
        "rib" => {
            let [a, w] = [1.0, 0.06];
            let right = [[a, 0.0], [a, 0.3], [w, 0.3], [w, 1.0]];
            let left = [[-w, 1.0], [-w, 0.3], [-a, 0.3], [-a, 0.0]];
            in_polygon(&[right, left].concat(), p.x, p.z).min(0.4 - p.y.abs())
        }
        "holed-plate" => in_box(p, [1.2, 0.15, 0.9]).min(p.x.hypot(p.z) - 0.5),
        "blind-hole" => {
            let right = [[0.4, 0.45], [0.4, 1.2], [0.8, 1.2], [0.8, 0.0]];
            let left = [[-0.8, 0.0], [-0.8, 1.2], [-0.4, 1.2], [-0.4, 0.45]];
            in_polygon(&[right, left].concat(), rho, p.z)
        }
        "double-torus" => in_blend(double_torus_field()),
        "frame" => in_blend(frame_field()),
        "blob" => in_blend(blob_field()),
        other => panic!("{other} has no depth function"),
    }
}

/// Distance to the nearest side of a polygon, positive inside, which the number of sides to the right decides.
fn in_polygon(corners: &[[f64; 2]], x: f64, z: f64) -> f64 {
    let p = Vec3::new(x, 0.0, z);
    let (mut nearest, mut inside) = (f64::INFINITY, false);
    for (i, &[ax, az]) in corners.iter().enumerate() {
        let [bx, bz] = corners[(i + 1) % corners.len()];
        nearest =
            nearest.min(distance_to_segment(p, Vec3::new(ax, 0.0, az), Vec3::new(bx, 0.0, bz)));
        inside ^= (az > z) != (bz > z) && x < ax + (bx - ax) * (z - az) / (bz - az);
    }
    if inside { nearest } else { -nearest }
}

/// The least of a function about the best of `steps` samples, by ternary search.
fn least(low: f64, high: f64, steps: u32, of: impl Fn(f64) -> f64) -> f64 {
    let width = (high - low) / f64::from(steps);
    let samples = (0..=steps).map(|i| low + width * f64::from(i));
    let best = samples.min_by(|&a, &b| of(a).total_cmp(&of(b))).unwrap();
    let (mut lo, mut hi) = ((best - width).max(low), (best + width).min(high));
    for _ in 0..100 {
        let third = (hi - lo) / 3.0;
        if of(lo + third) < of(hi - third) { hi -= third } else { lo += third }
    }
    of(lo)
}

/// By brute force over the turns of the helix, then by ternary search about the best.
fn in_coil(p: Vec3) -> f64 {
    let at = |turn: f64| {
        let (sin, cos) = (std::f64::consts::TAU * turn).sin_cos();
        p.distance(Vec3::new(cos, sin, 0.8 * turn))
    };
    0.35 - least(-1.0, 1.0, 800, at)
}

/// By brute force over the angles of the surface, then by a pattern search from the best.
fn in_ellipsoid(p: Vec3) -> f64 {
    let semi_axes = Vec3::new(1.0, 0.7, 0.45);
    let level = (p / semi_axes).length() - 1.0;
    if level > -1e-6 {
        return -level * semi_axes.z;
    }
    let distance = |theta: f64, phi: f64| {
        let (st, ct) = theta.sin_cos();
        let (sp, cp) = phi.sin_cos();
        p.distance(Vec3::new(st * cp, st * sp, ct) * semi_axes)
    };
    let mut step = 0.05;
    let grid = (0..63).flat_map(|i| (0..126).map(move |j| (f64::from(i), f64::from(j))));
    let starts = grid.map(|(i, j)| (i * step, j * step));
    let (mut best, mut at) = (f64::INFINITY, (0.0, 0.0));
    for (theta, phi) in starts {
        if distance(theta, phi) < best {
            (best, at) = (distance(theta, phi), (theta, phi));
        }
    }
    while step > 1e-9 {
        let around = [(step, 0.0), (-step, 0.0), (0.0, step), (0.0, -step)];
        let better = around
            .map(|(dt, dp)| (at.0 + dt, at.1 + dp))
            .into_iter()
            .find(|&(theta, phi)| distance(theta, phi) < best);
        match better {
            Some(next) => (best, at) = (distance(next.0, next.1), next),
            None => step /= 2.0,
        }
    }
    best
}

fn mean_edge(mesh: &TriMesh) -> f64 {
    let perimeters = (0..mesh.faces.len()).map(|face| {
        let [a, b, c]: [Vec3; 3] = mesh.triangle(face);
        a.distance(b) + b.distance(c) + c.distance(a)
    });
    perimeters.sum::<f64>() / (3 * mesh.faces.len()) as f64
}

fn smallest_angle(mesh: &TriMesh) -> f64 {
    let angles = (0..mesh.faces.len()).flat_map(|face| {
        let [a, b, c] = mesh.triangle(face);
        [[a, b, c], [b, c, a], [c, a, b]].map(|[a, b, c]| (b - a).angle_between(c - a))
    });
    angles.fold(f64::INFINITY, f64::min).to_degrees()
}

fn check_mesh(shape: &BuiltIn, resolution: u32) {
    let mesh = shape.mesh(resolution);
    let name = format!("{} at {resolution}", shape.id);
    // Closed, manifold, oriented outward.
    let report = validate(&mesh).unwrap_or_else(|why| panic!("{name}: {why}"));
    assert_eq!(report.expected_betti, Some(shape.expected_betti.map(|b| b as usize)), "{name}");
    assert!(!report.self_intersecting, "{name}");
    assert!(smallest_angle(&mesh) > 15.0, "{name} has an angle of {}", smallest_angle(&mesh));
    for &vertex in &mesh.vertices {
        let off = depth(shape.id, vertex).abs();
        assert!(off < 1e-12, "{name}: {vertex} is {off:e} away from the surface");
    }
    let coarse = 1.0 / f64::from(resolution.max(shape.min_resolution));
    let relative = report.diagonal / shape.diagonal;
    assert!((relative - 1.0).abs() < coarse, "{name}: diagonal off by a factor {relative}");
}

#[test]
fn every_shape_bounds_a_solid_of_its_topology_with_vertices_on_its_surface() {
    for shape in catalogue() {
        for resolution in [0, shape.min_resolution + 3, shape.default_resolution] {
            check_mesh(&shape, resolution);
        }
        if ["double-torus", "frame", "blob"].contains(&shape.id) {
            // A lattice may meet a surface in an ambiguous way.
            let more = (shape.min_resolution..shape.min_resolution + 16).step_by(3);
            more.for_each(|resolution| check_mesh(&shape, resolution));
        }
    }
}

#[test]
fn default_meshes_have_a_few_thousand_vertices_with_edges_as_announced() {
    for shape in catalogue() {
        let mesh = shape.mesh(shape.default_resolution);
        let count = mesh.vertices.len();
        assert!((1000..3500).contains(&count), "{} has {count} vertices", shape.id);
        let mean = mean_edge(&mesh);
        let announced = shape.diagonal / f64::from(shape.default_resolution);
        assert!((0.8..1.25).contains(&(mean / announced)), "{}: {mean} {announced}", shape.id);
        let finer = shape.mesh(2 * shape.default_resolution).vertices.len() as f64;
        assert!((3.0..5.0).contains(&(finer / count as f64)), "{}: {count} {finer}", shape.id);
        assert_eq!(mesh, shape.mesh(shape.default_resolution), "{}", shape.id);
    }
}

#[test]
fn the_catalogue_is_consistent() {
    let shapes = catalogue();
    let mut ids: Vec<_> = shapes.iter().map(|shape| shape.id).collect();
    assert_eq!(shapes.iter().filter(|shape| shape.axis().is_some()).count(), 18);
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), shapes.len());
    assert!(find("cube").is_none());
    for shape in &shapes {
        assert!(shape.min_resolution <= shape.default_resolution, "{}", shape.id);
        assert!(shape.summary.ends_with('.'), "{}", shape.id);
        let entry = serde_json::to_value(shape).unwrap();
        assert_eq!(entry["expected_betti"][0], shape.expected_betti[0]);
    }
}

/// Points of the complex: every sphere, and random ones on edges and faces.
fn points_of(axis: &MedialMesh, random: &mut Pcg64, count: usize) -> Vec<Sphere> {
    let sphere = |i: u32| axis.spheres[i as usize];
    let mut points = axis.spheres.clone();
    for _ in 0..count {
        if !axis.edges.is_empty() {
            let [a, b] = axis.edges[random.random_range(0..axis.edges.len())].map(sphere);
            points.push(a.lerp(b, random.random()));
        }
        if !axis.faces.is_empty() {
            let [a, b, c] = axis.faces[random.random_range(0..axis.faces.len())].map(sphere);
            points.push(a.lerp(b, random.random()).lerp(c, random.random()));
        }
    }
    points
}

#[test]
fn the_spheres_of_a_known_axis_touch_the_surface_from_inside() {
    let mut random = Pcg64::seed_from_u64(11);
    for shape in catalogue() {
        let Some(axis) = shape.axis() else { continue };
        assert_eq!(axis.mesh.check(), Ok(()), "{}", shape.id);
        assert_eq!(betti(&axis.mesh), shape.expected_betti, "{}", shape.id);
        assert!(axis.tolerance < 3e-4 * shape.diagonal, "{}: {}", shape.id, axis.tolerance);
        let (count, step) = if shape.id == "ellipsoid" { (300, 23) } else { (5000, 1) };
        for Sphere { centre, radius } in
            points_of(&axis.mesh, &mut random, count).into_iter().step_by(step)
        {
            let error = (depth(shape.id, centre) - radius).abs();
            assert!(
                error <= axis.tolerance + 1e-12,
                "{}: radius {radius} at {centre} is off by {error:e}",
                shape.id
            );
        }
    }
}

fn normalised_axis(shape: &BuiltIn, normal: &Normalisation) -> Option<(MedialMesh, [usize; 3])> {
    let axis = shape.axis()?;
    Some((axis.mesh.to_normal(normal), axis.parts))
}

fn sheet_graph(mesh: &MedialMesh) -> (SheetGraph, [usize; 3]) {
    let graph = SheetGraph::new(mesh, SheetOptions::default());
    let parts = [graph.areas.len(), graph.seams.len(), graph.junctions.len()];
    (graph, parts)
}

#[test]
fn known_axes_have_their_sheets_seams_and_junctions() {
    for shape in catalogue() {
        let normal = Normalisation::of(&shape.mesh(shape.default_resolution)).unwrap();
        let Some((axis, parts)) = normalised_axis(&shape, &normal) else { continue };
        let (graph, found) = sheet_graph(&axis);
        assert_eq!(found, parts, "{}", shape.id);
        assert!(graph.seams.iter().all(|seam| seam.sheets.len() == 3), "{}", shape.id);
        // The Voronoi medial mesh of the default surface, where its samples do not spoil it.
        let clean = ["sphere", "box", "rounded-box", "bracket", "rod", "hollow-sphere", "rib"];
        if clean.contains(&shape.id) {
            let found = initial(&shape.mesh(shape.default_resolution));
            assert_eq!(sheet_graph(&found).1, parts, "{}", shape.id);
        }
    }
}

/// The medial balls of surface points are on the known axis, which lies inside and reaches every sharp convex edge.
#[test]
fn known_axes_have_the_structure_that_their_surfaces_imply() {
    for id in ["sphere", "ellipsoid", "box", "bracket", "rod", "torus", "fillet", "blind-hole"] {
        let built_in = find(id).unwrap();
        let mesh = built_in.mesh(2 * built_in.default_resolution);
        let report = surface::validate(&mesh).unwrap();
        let shape = Shape::new(built_in.id, &mesh, report, ShapeOptions::default()).unwrap();
        let Some((axis, _)) = normalised_axis(&built_in, shape.normalisation()) else { continue };
        let options = JudgeOptions { samples: 2_000, volume_depth: 0, seed: 0 };
        let evaluation = shape.judge(None, options).unwrap().evaluate(&axis).unwrap();
        let structure = evaluation.structure.unwrap();
        let name = built_in.id;
        let (completeness, central) = (structure.completeness, structure.centrality);
        assert!(completeness.p95.unwrap() < 0.0025, "{name}: {completeness:?}");
        assert!(completeness.found.unwrap() > 0.99, "{name}: {completeness:?}");
        assert!(central.p95.is_none_or(|p95| p95 < 5e-4), "{name}: {central:?}");
        let reached = structure.features.convex_reached;
        assert!(reached.is_none_or(|reached| reached > 0.96), "{name}: {reached:?}");
        assert!(structure.outside.deepest < 1e-3, "{name}: {:?}", structure.outside);
    }
}

/// Away from a margin around seams and rims, where contacts merge.
#[test]
fn contacts_at_points_of_known_axes_are_those_of_their_parts() {
    const MARGIN: f64 = 0.02;
    let mut totals = [[0_usize; 2]; 3];
    for shape in catalogue() {
        let mesh = shape.mesh(2 * shape.default_resolution);
        let normal = Normalisation::of(&mesh).unwrap();
        let Some((axis, _)) = normalised_axis(&shape, &normal) else { continue };
        let vertices = mesh.vertices.iter().map(|&p| normal.forward(p)).collect();
        let mesh = TriMesh { vertices, ..mesh };
        let tree = Arc::new(TriangleBvh::new(&mesh).unwrap());
        let inside = Arc::new(InsideTest::new(&mesh));
        let surface = StructureSurface::new(&mesh, Arc::clone(&tree), inside, &[]);
        let (graph, _) = sheet_graph(&axis);
        let seams = graph.seams.iter().flat_map(|seam| &seam.edges);
        let seams: Vec<[Vec3; 2]> =
            seams.map(|&edge| axis.spheres_of(edge).map(|s| s.centre)).collect();
        let rims = graph.boundary.iter().map(|&edge| axis.spheres_of(edge).map(|s| s.centre));
        let junctions: Vec<Vec3> =
            graph.junctions.iter().map(|&v| axis.spheres[v as usize].centre).collect();
        let segment = |[a, b]: [Vec3; 2]| [a, b, b];
        let ends = rims.chain(junctions.iter().map(|&p| [p; 2]));
        let ends: Vec<_> = ends.map(segment).collect();
        let all: Vec<_> = ends.iter().copied().chain(seams.iter().map(|&s| segment(s))).collect();
        let [ends, all] = [ends, all].map(|segments| TriangleBvh::from_triangles(&segments).ok());
        let is_away = |near: &Option<TriangleBvh>, p: Vec3| {
            near.as_ref().is_none_or(|near| !near.any_within(p, MARGIN))
        };
        let mut random = Pcg64::seed_from_u64(5);
        let mut points: [Vec<Vec3>; 3] = Default::default();
        let areas: Vec<f64> = axis
            .faces
            .iter()
            .map(|&face| {
                let [a, b, c] = axis.spheres_of(face).map(|s| s.centre);
                (b - a).cross(c - a).length()
            })
            .collect();
        let largest = areas.iter().copied().fold(0.0, f64::max);
        let mut tries = 0;
        while !areas.is_empty() && points[0].len() < 1_000 && tries < 300_000 {
            tries += 1;
            let face = random.random_range(0..areas.len());
            if random.random::<f64>() * largest > areas[face] {
                continue;
            }
            let [a, b, c] = axis.spheres_of(axis.faces[face]);
            let (s, t): (f64, f64) = (random.random(), random.random());
            // The root makes the density uniform.
            let p = a.centre.lerp(b.centre.lerp(c.centre, t), s.sqrt());
            points[0].extend(is_away(&all, p).then_some(p));
        }
        while !seams.is_empty() && points[1].len() < 1_000 {
            let [a, b] = seams[random.random_range(0..seams.len())];
            let p = a.lerp(b, random.random());
            points[1].extend(is_away(&ends, p).then_some(p));
        }
        // Where a curve meets a cone, a junction has no four contacts.
        let meets_curve = matches!(shape.id, "rod" | "frustum");
        points[2] = if meets_curve { vec![] } else { junctions };
        let expected = [ContactType::Sheet, ContactType::Seam, ContactType::Junction];
        for k in 0..3 {
            let right = points[k].iter().filter(|&&p| surface.contacts(p) == expected[k]).count();
            totals[k][0] += right;
            totals[k][1] += points[k].len();
        }
    }
    for [right, all] in totals {
        assert!(right as f64 >= 0.98 * all as f64 && all >= 38, "{totals:?}");
    }
}

fn distance_to_segment(p: Vec3, a: Vec3, b: Vec3) -> f64 {
    let t = (p - a).dot(b - a) / (b - a).length_squared();
    p.distance(a.lerp(b, t.clamp(0.0, 1.0)))
}

#[test]
fn displacements_are_repeatable_in_proportion_and_uniform_in_a_ball() {
    let mesh = find("sphere").unwrap().mesh(60);
    let n = mesh.vertices.len() as f64;
    let displacements = |eta: f64, seed: u64| -> Vec<Vec3> {
        let noisy = add_noise(&mesh, eta, seed);
        assert_eq!(noisy.faces, mesh.faces);
        let unit = eta * Normalisation::of(&mesh).unwrap().diagonal;
        noisy.vertices.iter().zip(&mesh.vertices).map(|(n, v)| (n - v) / unit).collect()
    };
    let uniform = displacements(0.02, 5);
    assert_eq!(uniform, displacements(0.02, 5));
    assert_ne!(uniform, displacements(0.02, 6));
    assert!(uniform.iter().zip(displacements(0.01, 5)).all(|(a, b)| a.distance(b) < 1e-9));
    assert!(uniform.iter().all(|by| by.length() <= 1.0 + 1e-12));
    assert_eq!(add_noise(&mesh, 0.0, 5), mesh);
    assert_eq!(add_noise(&TriMesh::default(), 0.1, 5), TriMesh::default());
    // In a ball the cube of the radius is uniform in 0..1: mean 1/2, deviation 1/sqrt(12 n).
    let mean_cube = uniform.iter().map(|d| d.length().powi(3)).sum::<f64>() / n;
    assert!((mean_cube - 0.5).abs() < 4.0 / (12.0 * n).sqrt(), "{mean_cube}");
    let mean: Vec3 = uniform.iter().copied().sum::<Vec3>() / n;
    assert!(mean.abs().max_element() < 4.0 * (0.2 / n).sqrt(), "{mean}");
}

/// The union of the axis's balls and the solid are one set, and as deep everywhere: an axis that lacks a part
/// leaves points too shallow, one that has too much buries points outside.
#[test]
fn the_balls_of_a_known_axis_reproduce_the_solid() {
    let mut random = Pcg64::seed_from_u64(13);
    for shape in catalogue() {
        let Some(axis) = shape.axis() else { continue };
        let union = MedialUnion::new(&axis.mesh).unwrap();
        let (low, high) = shape.mesh(shape.default_resolution).bounding_box().unwrap();
        let margin = 0.1 * (high - low);
        let count = if shape.id == "ellipsoid" { 40 } else { 2000 };
        let (mut inside, mut outside) = (0, 0);
        for _ in 0..count {
            let p = low - margin + (high - low + 2.0 * margin) * unit_cube(&mut random);
            let (signed, depth) = (union.signed(p), depth(shape.id, p));
            let bound = axis.tolerance + 1e-9;
            if depth > 0.0 {
                inside += 1;
                assert!((signed + depth).abs() <= bound, "{}: {p}, {signed} {depth}", shape.id);
            } else {
                outside += 1;
                assert!(signed >= -bound, "{}: {p} outside is {signed:e} deep", shape.id);
            }
        }
        assert!(inside > count / 20 && outside > count / 20, "{}", shape.id);
    }
}

fn unit_cube(random: &mut Pcg64) -> Vec3 {
    Vec3::new(random.random(), random.random(), random.random())
}

/// Directions in which a ball touches the surface, by pattern searches from directions all around.
fn contacts(id: &str, Sphere { centre, radius }: Sphere, tolerance: f64) -> Vec<Vec3> {
    const STARTS: u32 = 60;
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let gap = |u: Vec3| depth(id, centre + radius * u);
    let mut found = Vec::new();
    for i in 0..STARTS {
        let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(STARTS);
        let (sin, cos) = (golden * f64::from(i)).sin_cos();
        let across = (1.0 - z * z).sqrt();
        let mut at = Vec3::new(across * cos, across * sin, z);
        let (mut least, mut step) = (gap(at), 0.2);
        while step > 1e-6 && least > tolerance {
            let (u, v) = at.any_orthonormal_pair();
            let around = [u, -u, v, -v].map(|d| (at + step * d).normalize());
            match around.into_iter().map(|d| (gap(d), d)).find(|(gap, _)| *gap < least) {
                Some(better) => (least, at) = better,
                None => step /= 2.0,
            }
        }
        if least <= tolerance {
            found.push(at);
        }
    }
    found
}

/// A point is medial if its ball touches the surface in two places at least.
#[test]
fn the_balls_of_a_known_axis_touch_the_surface_twice() {
    let mut random = Pcg64::seed_from_u64(14);
    for shape in catalogue() {
        let Some(axis) = shape.axis() else { continue };
        let sampled = points_of(&axis.mesh, &mut random, 200);
        // At a convex edge the ball is a point.
        let thick = |ball: &&Sphere| ball.radius > 0.01 * shape.diagonal;
        let balls: Vec<&Sphere> = sampled.iter().rev().filter(thick).collect();
        let wanted = if shape.id == "ellipsoid" { 3 } else { 25 };
        for ball in balls.iter().step_by((balls.len() / wanted).max(1)) {
            let touched = contacts(shape.id, **ball, 2.0 * axis.tolerance + 1e-6);
            let pairs = touched.iter().flat_map(|a| touched.iter().map(|b| a.angle_between(*b)));
            let widest = pairs.fold(0.0, f64::max).to_degrees();
            assert!(widest > 20.0, "{}: {ball:?} touches within {widest} degrees", shape.id);
        }
    }
}

fn initial(mesh: &TriMesh) -> MedialMesh {
    let report = surface::validate(mesh).unwrap();
    let shape = Shape::new("noisy", mesh, report, ShapeOptions::default()).unwrap();
    (*shape.initial().unwrap()).clone()
}

/// Share of weak edges at a threshold of 0.1 and fins, means over three noisy versions.
fn weak_edges_and_fins(id: &str, noise: f64) -> [f64; 2] {
    let shape = find(id).unwrap();
    let clean = shape.mesh(shape.default_resolution);
    let found = [1, 2, 3].map(|seed| spikes(&initial(&add_noise(&clean, noise, seed))));
    [
        found.iter().map(|spikes| spikes.by_ratio[1].edge_share).sum::<f64>() / 3.0,
        found.iter().map(|spikes| spikes.fins as f64).sum::<f64>() / 3.0,
    ]
}

/// Any noise, however small, makes the spikes that the samples allow: on a clean symmetric surface there are few or
/// none. More noise makes none more, since ratios do not know amplitudes.
#[test]
fn noise_makes_spikes() {
    for id in ["box", "bracket", "torus", "capsule"] {
        let [clean, noisy @ ..] =
            [0.0, 1e-4, 3e-4, 1e-3].map(|noise| weak_edges_and_fins(id, noise));
        for found in noisy {
            let grown = (0..2).all(|measure| found[measure] > 1.1 * clean[measure]);
            assert!(grown, "{id}: {clean:?}, {noisy:?}");
        }
    }
}

// The power crusts of the built-in shapes: topology, distances, and how deep faces go through each other.

/// Corners nearer than this are merged, in diagonals.
const COINCIDENT: f64 = 1e-6;

/// A crust in units of the diagonal, and its properties.
struct Crust {
    report: SurfaceReport,
    /// From the surface to the crust, and back.
    distances: [f64; 2],
    /// Mean distance of samples: the root of the area for each.
    spacing: f64,
    crossing: f64,
}

fn crust(built_in: &BuiltIn, count: usize) -> Crust {
    let mesh = built_in.mesh(built_in.default_resolution);
    let report = surface::validate(&mesh).expect("a solid");
    let sampling = Sampling::BlueNoise { count, seed: 1 };
    let options = ShapeOptions { sampling, ..ShapeOptions::default() };
    let shape = Shape::new(built_in.id, &mesh, report, options).expect("an extent");
    let balls = shape.polar_balls().expect("samples span space");
    let made = surface::crust_surface(
        &PowerCrust::new(&balls.inner, &balls.outer).expect("balls"),
        COINCIDENT,
    )
    .mesh;
    let farthest = |from: &TriMesh, to: &TriMesh| {
        let mut points = sample(from, &Sampling::AreaUniform { count: 5_000, seed: 0 });
        points.extend(&from.vertices);
        let distances = TriangleBvh::new(to).expect("faces").distance_batch(&points);
        distances.into_iter().fold(0.0, f64::max)
    };
    let area = shape.report().area.expect("finite") / shape.normalisation().diagonal.powi(2);
    Crust {
        report: surface::validate(&made).expect("a closed manifold"),
        distances: [farthest(shape.mesh(), &made), farthest(&made, shape.mesh())],
        spacing: (area / count as f64).sqrt(),
        crossing: deepest_crossing(&made),
    }
}

/// How deep an edge of one face goes through another one, at most.
fn deepest_crossing(mesh: &TriMesh) -> f64 {
    let corners: Vec<[Vec3; 3]> = (0..mesh.faces.len()).map(|f| mesh.triangle(f)).collect();
    let bounds = |t: &[Vec3; 3]| (t[0].min(t[1]).min(t[2]), t[0].max(t[1]).max(t[2]));
    let mut order: Vec<usize> = (0..corners.len()).collect();
    order.sort_by(|&f, &g| bounds(&corners[f]).0.x.total_cmp(&bounds(&corners[g]).0.x));
    let mut deepest = 0.0_f64;
    for (place, &f) in order.iter().enumerate() {
        let (lo, hi) = bounds(&corners[f]);
        for &g in &order[place + 1..] {
            let (l, h) = bounds(&corners[g]);
            if l.x > hi.x {
                break;
            }
            if !(l.cmple(hi).all() && h.cmpge(lo).all()) {
                continue;
            }
            deepest = deepest.max(crossing(mesh.faces[f], corners[f], mesh.faces[g], corners[g]));
        }
    }
    deepest
}

/// How deep edges of one of two faces that have not both ends in the other go through it.
fn crossing(f: [u32; 3], s: [Vec3; 3], g: [u32; 3], t: [Vec3; 3]) -> f64 {
    let through = |a: [u32; 3], edges: [Vec3; 3], b: [u32; 3], face: [Vec3; 3]| {
        let free = (0..3).filter(|&i| !b.contains(&a[i]) && !b.contains(&a[(i + 1) % 3]));
        free.map(|i| crossing_depth([edges[i], edges[(i + 1) % 3]], face)).fold(0.0, f64::max)
    };
    through(f, s, g, t).max(through(g, t, f, s))
}

/// How far a segment reaches through a triangle: no farther than its nearer end is from the plane, nor than
/// the crossing is from the triangle's sides.
fn crossing_depth([p, q]: [Vec3; 2], [a, b, c]: [Vec3; 3]) -> f64 {
    let normal = (b - a).cross(c - a);
    if normal.length() < 1e-14 {
        return 0.0;
    }
    let normal = normal.normalize();
    let [above, below] = [p, q].map(|end| normal.dot(end - a));
    if above * below >= 0.0 {
        return 0.0;
    }
    let at = p.lerp(q, above / (above - below));
    let inwards = |[u, v]: [Vec3; 2]| normal.cross(v - u).normalize_or_zero().dot(at - u);
    let to_sides = [[a, b], [b, c], [c, a]].map(inwards).into_iter().fold(f64::INFINITY, f64::min);
    above.abs().min(below.abs()).min(to_sides).max(0.0)
}

#[test]
fn crossings_are_as_deep_as_they_are() {
    let face = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let upright = |x: f64, low: f64, high: f64| {
        crossing_depth([Vec3::new(x, 0.2, low), Vec3::new(x, 0.2, high)], face)
    };
    assert_eq!(upright(0.2, 0.1, 0.5), 0.0);
    assert!((upright(0.2, -0.1, 0.5) - 0.1).abs() < 1e-15);
    assert!((upright(0.05, -0.1, 0.5) - 0.05).abs() < 1e-15);
    assert_eq!(upright(0.9, -0.1, 0.5), 0.0);
}

#[test]
fn power_crusts_have_the_topology_and_converge() {
    // A cavity, a loop, reflex and sharp edges, thin parts.
    let some = ["hollow-sphere", "torus", "bracket", "wedge", "rib"];
    check_crusts(catalogue().into_iter().filter(|built_in| some.contains(&built_in.id)));
}

#[test]
#[ignore = "minutes; run nightly"]
fn power_crusts_of_all_shapes_have_the_topology_and_converge() {
    check_crusts(catalogue());
}

fn check_crusts(shapes: impl IntoIterator<Item = BuiltIn>) {
    for built_in in shapes {
        let wanted = built_in.expected_betti.map(|n| n as usize);
        let mut coarser = [f64::INFINITY; 2];
        for count in [2_000, 8_000] {
            let name = format!("{}, {count} samples", built_in.id);
            let Crust { report, distances, spacing, crossing } = crust(&built_in, count);
            assert_eq!(report.expected_betti, Some(wanted), "{name}");
            for (found, before) in distances.into_iter().zip(coarser) {
                // At a sharp edge without samples the crust is a sample's spacing off. At the wedge's edge of 40
                // degrees the faces are a spacing apart 1.5 spacings from it, and at its ends there is a third.
                let sharpness = if built_in.id == "wedge" { 2.0 } else { 1.0 };
                assert!(found < sharpness * spacing, "{name}: {found}");
                // Half as far apart.
                assert!(found < 0.85 * before, "{name}: {found} after {before}");
            }
            // The facets of a power diagram cross nowhere but for rounding, and for what merging corners moved.
            assert!(crossing < COINCIDENT, "{name}: {crossing}");
            coarser = distances;
        }
    }
}
