//! The choice of spheres of Coverage Axis and their connection against their definitions.

use medial::Vec3;
use medial::simplifier::Params;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::coverage::{Picks, ones};
use super::exact::Cover;
use super::*;

fn random_points(rng: &mut Pcg64, count: usize) -> Vec<Vec3> {
    (0..count).map(|_| Vec3::new(rng.random(), rng.random(), rng.random())).collect()
}

fn random_balls(rng: &mut Pcg64, count: usize) -> Vec<Sphere> {
    let centres = random_points(rng, count);
    centres.into_iter().map(|c| Sphere::new(c, 0.05 + 0.3 * rng.random::<f64>())).collect()
}

fn covers(ball: &Sphere, sample: Vec3, delta: f64) -> bool {
    sample.distance(ball.centre) < ball.radius + delta
}

fn choose(spheres: &[Sphere], coverage: &Coverage, limit: usize) -> Picks {
    let penalties = penalties(spheres);
    coverage::choose(spheres, coverage, &penalties, limit, &RunContext::default()).unwrap()
}

fn exact_cover(coverage: &Coverage) -> Cover {
    exact::cover(coverage, &RunContext::default()).unwrap()
}

#[test]
fn a_bit_is_set_where_an_inflated_ball_contains_a_sample() {
    let mut rng = Pcg64::seed_from_u64(1);
    for (samples, balls) in [(1, 1), (64, 3), (65, 300), (200, 17)] {
        let (samples, balls) = (random_points(&mut rng, samples), random_balls(&mut rng, balls));
        let coverage = Coverage::new(&samples, &balls, 0.04);
        for (j, ball) in balls.iter().enumerate() {
            let covered: Vec<usize> = ones(coverage.row(j)).collect();
            let expected = (0..samples.len()).filter(|&i| covers(ball, samples[i], 0.04));
            assert_eq!(covered, expected.collect::<Vec<_>>());
        }
        assert_eq!(coverage.transposed().transposed(), coverage);
    }
    // Strictly: a sample on the inflated ball is not covered.
    let on = Coverage::new(&[Vec3::X], &[Sphere::new(Vec3::ZERO, 0.75)], 0.25);
    assert!(ones(on.row(0)).next().is_none());
}

/// The choice as its formula has it: every part of every score from nothing, in every step.
fn by_formula(samples: &[Vec3], balls: &[Sphere], delta: f64, limit: usize) -> Vec<u32> {
    let standardised = |values: Vec<f64>| -> Vec<f64> {
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (count - 1.0);
        let score = |x: f64| if variance > 0.0 { (x - mean) / variance.sqrt() } else { 0.0 };
        values.into_iter().map(score).collect()
    };
    let largest = balls.iter().map(|ball| ball.radius).fold(0.0, f64::max);
    let penalty: Vec<f64> = balls.iter().map(|ball| 0.1 * largest / ball.radius).collect();
    let mut left = samples.to_vec();
    left.retain(|&p| balls.iter().any(|ball| covers(ball, p, delta)));
    let mut chosen: Vec<u32> = Vec::new();
    while !left.is_empty() && chosen.len() < limit {
        let count = |ball: &Sphere| left.iter().filter(|&&p| covers(ball, p, delta)).count() as f64;
        let counts = standardised(balls.iter().map(count).collect());
        let nearest = |ball: &Sphere| {
            let distance = |&a: &u32| balls[a as usize].centre.distance(ball.centre);
            chosen.iter().map(distance).fold(f64::INFINITY, f64::min)
        };
        let apart = match chosen.is_empty() {
            true => vec![0.0; balls.len()],
            false => standardised(balls.iter().map(nearest).collect()),
        };
        let score = |j: usize| counts[j] + apart[j] - penalty[j];
        let free = (0..balls.len()).filter(|&j| !chosen.contains(&(j as u32)));
        let best = free.reduce(|a, b| if score(b) > score(a) { b } else { a }).unwrap();
        left.retain(|&p| !covers(&balls[best], p, delta));
        chosen.push(best as u32);
    }
    chosen
}

#[test]
fn the_greedy_choice_is_that_of_the_formula() {
    let mut rng = Pcg64::seed_from_u64(2);
    for round in 0..50 {
        let samples = random_points(&mut rng, 20 + 7 * round);
        let balls = random_balls(&mut rng, 2 + 3 * round);
        let coverage = Coverage::new(&samples, &balls, 0.03);
        let picks = choose(&balls, &coverage, 1000);
        assert_eq!(picks.chosen, by_formula(&samples, &balls, 0.03, 1000));
        assert_eq!(picks.uncovered, 0);
        // The first few are those of a choice that ends there.
        let few = choose(&balls, &coverage, 3);
        assert_eq!(few.chosen, picks.chosen[..few.chosen.len()]);
    }
}

#[test]
fn uncoverable_samples_do_not_stop_a_choice() {
    let balls =
        [Sphere::new(Vec3::ZERO, 1.0), Sphere::new(Vec3::X, 1.0), Sphere::new(Vec3::Y, 1.0)];
    let samples = [Vec3::new(0.5, 0.0, 0.0), Vec3::splat(40.0), Vec3::splat(50.0)];
    let coverage = Coverage::new(&samples, &balls, 0.02);
    let picks = choose(&balls, &coverage, 60);
    assert_eq!((picks.chosen.len(), picks.uncovered, picks.uncoverable), (1, 0, 2));
    let cover = exact_cover(&coverage);
    assert_eq!((cover.chosen.len(), cover.bound, cover.uncoverable), (1, 1, 2));
}

/// Fewest balls by looking at all sets of them.
fn by_brute_force(coverage: &Coverage) -> usize {
    let all = coverage.coverable();
    let sets = 0..1_u32 << coverage.rows();
    let covers_all = |&set: &u32| {
        let mut covered = vec![0; all.len()];
        let members = (0..coverage.rows()).filter(|ball| set >> ball & 1 == 1);
        members.for_each(|ball| coverage::unite(&mut covered, coverage.row(ball)));
        covered == all
    };
    sets.filter(covers_all).map(u32::count_ones).min().unwrap() as usize
}

fn assert_covers(coverage: &Coverage, chosen: &[u32]) {
    let mut covered = vec![0; coverage.coverable().len()];
    chosen.iter().for_each(|&ball| coverage::unite(&mut covered, coverage.row(ball as usize)));
    assert_eq!(covered, coverage.coverable());
}

#[test]
fn an_exact_cover_is_the_smallest() {
    let mut rng = Pcg64::seed_from_u64(3);
    for round in 0..60 {
        let samples = random_points(&mut rng, 5 + 4 * round);
        let balls = random_balls(&mut rng, 1 + round % 12);
        let coverage = Coverage::new(&samples, &balls, 0.02);
        let cover = exact_cover(&coverage);
        let fewest = by_brute_force(&coverage);
        assert_eq!((cover.chosen.len(), cover.bound), (fewest, fewest));
        assert_covers(&coverage, &cover.chosen);
    }
}

#[test]
fn a_cylinder_takes_as_many_as_their_rings_are_wide() {
    let (radius, length) = (0.2, 3.0);
    // By the golden ratio.
    let turn = std::f64::consts::TAU * 0.618_033_988_749_895;
    let sample = |i: usize| {
        let (sin, cos) = (turn * i as f64).sin_cos();
        Vec3::new(length * (i as f64 + 0.5) / 600.0, radius * cos, radius * sin)
    };
    let samples: Vec<Vec3> = (0..600).map(sample).collect();
    let balls: Vec<Sphere> = (0..=600)
        .map(|k| Sphere::new(Vec3::new(length * f64::from(k) / 600.0, 0.0, 0.0), radius))
        .collect();
    for delta in [0.01_f64, 0.02, 0.04, 0.08] {
        // A ball covers a ring of this width at most.
        let width = 2.0 * ((radius + delta).powi(2) - radius * radius).sqrt();
        let fewest = (length / width).ceil() as usize;
        let cover = exact_cover(&Coverage::new(&samples, &balls, delta));
        let found = cover.chosen.len();
        assert_eq!(cover.bound, found);
        // Samples are fewer than points, and candidates are on a grid: one more or less.
        assert!(found.abs_diff(fewest) <= 1, "{delta}: {found} for {fewest}");
    }
}

fn built_in(id: &str) -> Shape {
    crate::test_shape(id, medial_datasets::find(id).unwrap().default_resolution)
}

fn answer(shape: &Shape, level: Level) -> Simplified {
    let method = crate::find("coverage-axis").unwrap();
    let mut prepared = method.prepare(shape, &Params::none(), &RunContext::default()).unwrap();
    let found = prepared.at(level).unwrap();
    found.mesh.check().unwrap();
    found
}

#[test]
fn regions_are_those_of_the_nearest_anchor_along_edges() {
    let shape = built_in("bracket");
    let initial = shape.initial().unwrap();
    let anchors: Vec<u32> = (0..initial.spheres.len() as u32).step_by(97).collect();
    let found = connect::regions(&initial, &anchors);
    // Relaxes all edges until nothing changes, without a queue.
    let mut nearest = vec![(f64::INFINITY, u32::MAX); initial.spheres.len()];
    for (label, &v) in anchors.iter().enumerate() {
        nearest[v as usize] = (0.0, label as u32);
    }
    let centre = |v: u32| initial.spheres[v as usize].centre;
    loop {
        let before = nearest.clone();
        for &[a, b] in &initial.edges {
            let length = centre(a).distance(centre(b)) + 1e-12;
            for (from, to) in [(a as usize, b as usize), (b as usize, a as usize)] {
                let (distance, label) = nearest[from];
                if (distance + length, label) < nearest[to] {
                    nearest[to] = (distance + length, label);
                }
            }
        }
        if nearest == before {
            break;
        }
    }
    let expected: Vec<u32> = nearest.into_iter().map(|(_, label)| label).collect();
    assert_eq!(found, expected);
}

#[test]
fn a_number_of_spheres_is_met_by_picks_or_by_the_dilation() {
    let shape = built_in("bracket");
    let all = answer(&shape, Level::Native(0.02));
    let few = answer(&shape, Level::Spheres(5));
    assert_eq!((few.mesh.spheres.len(), few.native_level), (5, Some(0.02)));
    assert_eq!(few.mesh.spheres[..], all.mesh.spheres[..5]);
    assert!(few.diagnostics.warnings.iter().any(|w| w.contains("uncovered")));
    // More than cover everything at the default dilation.
    let more = all.mesh.spheres.len() + 20;
    let smaller = answer(&shape, Level::Spheres(more));
    let reached = smaller.mesh.spheres.len();
    assert!(reached <= more && reached * 100 >= more * 98, "{reached} for {more}");
    assert!(smaller.native_level.unwrap() < 0.02);
    let again = answer(&shape, Level::Native(smaller.native_level.unwrap()));
    assert_eq!(again.mesh, smaller.mesh);
    let most = answer(&shape, Level::Spheres(100_000));
    assert!(most.diagnostics.warnings.iter().any(|w| w.contains("instead of 100000")));
}
