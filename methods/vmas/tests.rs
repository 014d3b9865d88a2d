//! The steps of VMAS one by one, against closed forms and brute force.

use std::f64::consts::PI;

use medial::Vec3;
use medial::complex::Sphere;
use medial::surface::TriMesh;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::energy::Energy;
use super::points::{Locality, Oriented, SurfacePoints};
use super::refit::{Residuals, refit};
use super::sampling::{Clusters, Misfit, NONE, assign, drop_small, misfits, to_split};
use super::{edges, triangles};

const ENERGY: Energy = Energy { lambda: 0.2 };

/// Points of the unit sphere from the north pole down to a height, evenly spread.
fn cap(count: usize, down_to: f64) -> Vec<Oriented> {
    let point = |k: usize| {
        let z = 1.0 - (k as f64 + 0.5) / count as f64 * (1.0 - down_to);
        let (sin, cos) = (2.399_963_229_728_653 * k as f64).sin_cos();
        let normal = Vec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z);
        Oriented { position: normal, normal, area: 1.0 / count as f64 }
    };
    (0..count).map(point).collect()
}

/// Two parallel discs of radius 1 that face away from each other, `2 h` apart.
fn slab(count: usize, h: f64) -> Vec<Oriented> {
    let point = |k: usize| {
        let radius = ((k as f64 + 0.5) / count as f64).sqrt();
        let (sin, cos) = (2.399_963_229_728_653 * k as f64).sin_cos();
        Vec3::new(radius * cos, radius * sin, 0.0)
    };
    let disc = |z: f64| {
        let normal = z.signum() * Vec3::Z;
        let area = PI / count as f64;
        let lifted = move |p: Vec3| Oriented { position: p + z * Vec3::Z, normal, area };
        (0..count).map(point).map(lifted)
    };
    disc(h).chain(disc(-h)).collect()
}

/// A bumpy ball, of triangles of all sizes.
fn bumpy() -> TriMesh {
    let shape = medial_datasets::find("blob").expect("in the catalogue");
    shape.mesh(shape.default_resolution)
}

fn random_spheres(random: &mut Pcg64, count: usize) -> Vec<Sphere> {
    let mut x = || random.random_range(-1.0..1.0);
    (0..count).map(|_| Sphere::new(0.7 * Vec3::new(x(), x(), x()), 0.5 * x().abs())).collect()
}

fn all(points: &SurfacePoints) -> Vec<u32> {
    (0..points.len() as u32).collect()
}

fn energy_of(points: &SurfacePoints, cluster: &[u32], sphere: &Sphere) -> f64 {
    let error = |&v: &u32| points.areas[v as usize] * ENERGY.at(points, v as usize, sphere);
    cluster.iter().map(error).sum()
}

#[test]
fn the_planar_error_is_the_quadric_of_the_paper() {
    let mut random = Pcg64::seed_from_u64(1);
    let mut x = || random.random_range(-1.0..1.0);
    for _ in 0..1_000 {
        let (normal, v) = (Vec3::new(x(), x(), x()).normalize(), Vec3::new(x(), x(), x()));
        let s = Sphere::new(Vec3::new(x(), x(), x()), x().abs());
        let oriented = [Oriented { position: v, normal, area: 1.0 }];
        let points = SurfacePoints::of_oriented(&oriented, 1);
        let planar = Energy { lambda: 0.0 }.at(&points, 0, &s);
        let (along, level) = (normal.dot(s.centre) + s.radius, normal.dot(v));
        let quadric = along * along - 2.0 * level * along + level * level;
        assert!((planar - quadric).abs() < 1e-14, "{planar} {quadric}");
    }
}

#[test]
fn every_point_has_the_sphere_that_looking_at_all_finds() {
    let mut random = Pcg64::seed_from_u64(2);
    let mesh = bumpy();
    let clouds = [
        SurfacePoints::of_vertices(&mesh),
        SurfacePoints::of_samples(&mesh, 3_000, 5, 10),
        SurfacePoints::of_oriented(&slab(100, 0.1), 10),
    ];
    for (round, points) in clouds.iter().cycle().take(12).enumerate() {
        for lambda in [1e-6, 0.2, 1.0] {
            let energy = Energy { lambda };
            let mut spheres = random_spheres(&mut random, 1 + 9 * round);
            // Twice the same sphere: the smaller id has the points.
            spheres.push(spheres[0]);
            let count = spheres.len() as u32;
            let guess = |_| {
                if random.random_range(0..9) == 0 { NONE } else { random.random_range(0..count) }
            };
            let mut labels: Vec<u32> = (0..points.len()).map(guess).collect();
            assign(points, energy, &spheres, &mut labels);
            for (v, &label) in labels.iter().enumerate() {
                let error = |s: &Sphere| energy.at(points, v, s);
                let least = (0..count).min_by(|&a, &b| {
                    let [a, b] = [a, b].map(|s| (error(&spheres[s as usize]), s));
                    a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))
                });
                assert_eq!(Some(label), least, "point {v} of {count} spheres");
            }
        }
    }
}

#[test]
fn a_patch_of_a_sphere_gives_that_sphere() {
    for down_to in [-1.0, 0.0, 0.8] {
        let points = SurfacePoints::of_oriented(&cap(300, down_to), 10);
        let residuals = Residuals::new(&points, ENERGY);
        let start = Sphere::new(Vec3::new(0.1, -0.2, 0.15), 0.7);
        let s = refit(&points, &residuals, &all(&points), start, 1e-8);
        let error = s.centre.length().max((s.radius - 1.0).abs());
        assert!(error < 1e-11, "down to {down_to}: {s:?}");
    }
}

#[test]
fn between_two_discs_the_radius_is_that_of_the_closed_form() {
    let h: f64 = 0.2;
    let points = SurfacePoints::of_oriented(&slab(4_000, h), 10);
    let mean = 2.0 / 3.0 * ((1.0 + h * h).powf(1.5) - h.powi(3));
    // The published programs square lambda, by mistake or not.
    let lambda = ENERGY.lambda * ENERGY.lambda;
    let closed: f64 = (h + lambda * mean) / (1.0 + lambda);
    let residuals = Residuals::new(&points, ENERGY);
    let start = Sphere::new(Vec3::new(0.05, 0.0, 0.02), 0.1);
    let s = refit(&points, &residuals, &all(&points), start, 1e-10);
    assert!((closed - 0.2193).abs() < 1e-4 && s.centre.length() < 0.01, "{s:?}");
    assert!((s.radius - closed).abs() < 1e-4, "{} but {closed}", s.radius);
}

#[test]
fn points_that_determine_no_sphere_leave_it_as_it_is() {
    let start = Sphere::new(Vec3::new(0.3, 0.2, 0.1), 0.5);
    let plane =
        |k: usize| Oriented { position: Vec3::new(k as f64, 0.0, 0.0), normal: Vec3::Z, area: 1.0 };
    for count in [1, 2] {
        let oriented: Vec<Oriented> = (0..count).map(plane).collect();
        let points = SurfacePoints::of_oriented(&oriented, 10);
        let residuals = Residuals::new(&points, ENERGY);
        assert_eq!(refit(&points, &residuals, &all(&points), start, 1e-8), start);
    }
}

#[test]
fn nearest_samples_are_those_of_looking_at_all() {
    let points = SurfacePoints::of_samples(&bumpy(), 1_000, 7, 10);
    let Locality::Nearest { count: 10, ids } = &points.local else { panic!("ten of each") };
    let mut links = Vec::new();
    for v in 0..points.len() as u32 {
        let far =
            |w: u32| points.positions[v as usize].distance_squared(points.positions[w as usize]);
        let mut order = all(&points);
        order.sort_by(|&a, &b| far(a).total_cmp(&far(b)).then(a.cmp(&b)));
        assert_eq!(ids[v as usize * 10..][..10], order[..10]);
        links.extend(order[1..10].iter().map(|&w| [v.min(w), v.max(w)]));
    }
    links.sort_unstable();
    links.dedup();
    assert_eq!(points.links, links);
}

#[test]
fn points_have_the_area_of_the_surface() {
    let mut mesh = bumpy();
    let area: f64 =
        (0..mesh.faces.len()).map(|f| super::points::area_vector(&mesh, f).length()).sum();
    // A point of no face, which belongs to nothing.
    mesh.vertices.push(Vec3::ZERO);
    let vertices = SurfacePoints::of_vertices(&mesh);
    assert_eq!(vertices.len(), mesh.vertices.len() - 1);
    assert!((vertices.areas.iter().sum::<f64>() / area - 1.0).abs() < 1e-12);
    let samples = SurfacePoints::of_samples(&mesh, 60_000, 0, 2);
    let kept = samples.areas.iter().sum::<f64>() / area;
    assert!((0.95..=1.0 + 1e-12).contains(&kept), "faces without a sample lose theirs: {kept}");
    for points in [&vertices, &samples] {
        for v in 0..points.len() {
            let shares: f64 = points.planes(v).iter().map(|plane| plane.share).sum();
            assert!((shares - 1.0).abs() < 1e-14);
            assert!((points.normals[v].length() - 1.0).abs() < 1e-14);
        }
    }
}

#[test]
fn small_clusters_are_dropped_but_the_largest() {
    let sphere = |x: f64| Sphere::new(Vec3::splat(x), 1.0);
    let mut spheres = vec![sphere(0.0), sphere(1.0), sphere(2.0)];
    let mut labels = vec![2, 0, 2, 1, 2, 2, NONE, 0];
    let clusters = drop_small(&mut spheres, &mut labels, 2);
    assert_eq!(spheres, [sphere(0.0), sphere(2.0)]);
    assert_eq!(labels, [1, 0, 1, NONE, 1, 1, NONE, 0]);
    assert_eq!((clusters.of(0), clusters.of(1)), (&[1, 7][..], &[0, 2, 4, 5][..]));
    drop_small(&mut spheres, &mut labels, 9);
    assert_eq!((spheres, labels[0]), (vec![sphere(2.0)], 0));
}

#[test]
fn neighbours_of_a_split_sphere_are_not_split() {
    let misfit = |mean: f64| Misfit { mean, worst: 0 };
    // A path of 15 spheres; the errors fall along it, and the last two are equal.
    let mut errors: Vec<Misfit> = (0..15).map(|k| misfit(1.0 / f64::from(k + 1))).collect();
    errors[14] = errors[13];
    let path: Vec<[u32; 2]> = (0..14).map(|k| [k, k + 1]).collect();
    assert_eq!(to_split(&errors, &path, 100), [0, 2, 4]);
    assert_eq!(to_split(&errors, &path, 1), [0]);
    assert_eq!(to_split(&errors[..1], &[], 5), [0]);
    let many = vec![misfit(1.0); 200];
    assert_eq!(to_split(&many, &[], 100), (0..10).collect::<Vec<u32>>());
}

#[test]
fn misfits_are_means_by_area_and_their_worst_points() {
    let points = SurfacePoints::of_samples(&bumpy(), 500, 3, 10);
    let sphere = Sphere::new(Vec3::splat(0.1), 0.4);
    let labels = vec![0; points.len()];
    let [found] = misfits(&points, ENERGY, &[sphere], &Clusters::of_labels(&labels, 1))[..] else {
        panic!("one sphere")
    };
    let mean = energy_of(&points, &all(&points), &sphere) / points.areas.iter().sum::<f64>();
    assert!((found.mean / mean - 1.0).abs() < 1e-12);
    let worst = energy_of(&points, &[found.worst], &sphere);
    assert!((0..points.len() as u32).all(|v| energy_of(&points, &[v], &sphere) <= worst));
}

#[test]
fn faces_are_cliques_of_spheres() {
    let mut random = Pcg64::seed_from_u64(4);
    let mesh = bumpy();
    for points in [SurfacePoints::of_vertices(&mesh), SurfacePoints::of_samples(&mesh, 900, 1, 10)]
    {
        let spheres = random_spheres(&mut random, 25);
        let mut labels = vec![NONE; points.len()];
        assign(&points, ENERGY, &spheres, &mut labels);
        labels[7] = NONE;
        let joined = edges(&points, &labels);
        let has = |a: u32, b: u32| joined.contains(&[a.min(b), a.max(b)]);
        let mut cliques = Vec::new();
        for a in 0..25 {
            for b in a + 1..25 {
                let third = (b + 1..25).filter(|&c| has(a, b) && has(a, c) && has(b, c));
                cliques.extend(third.map(|c| [a, b, c]));
            }
        }
        assert_eq!(triangles(&joined), cliques);
    }
}
