use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::*;

const NIGHTS: usize = 400;

/// Series that a nightly study has: what the level is divided by.
const SERIES: usize = 100;

/// Log-normal noise; on 2 % of the nights the machine was loaded: 30 to 100 % more.
fn history(seed: u64, nights: usize, noise: f64, level: impl Fn(usize) -> f64) -> Vec<f64> {
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut night = |k: usize| {
        let (u, v): (f64, f64) = (rng.random(), rng.random());
        let normal = (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos();
        let (loaded, more): (f64, f64) = (rng.random(), rng.random());
        let spike = if loaded < 0.02 { 1.3 + 0.7 * more } else { 1.0 };
        0.25 * level(k) * (noise * normal).exp() * spike
    };
    (0..nights).map(&mut night).collect()
}

fn options() -> StepOptions {
    StepOptions { series: SERIES, ..StepOptions::default() }
}

/// Up by 10 % at this night.
fn stepped(at: usize, size: f64) -> impl Fn(usize) -> f64 {
    move |k| if k < at { 1.0 } else { 1.0 + size }
}

/// The nights of the seeds, away from the ends and everywhere else.
fn place(seed: u64) -> usize {
    20 + (seed as usize * 37) % 360
}

/// Each is found, once, and its night within one in nine of ten: with so much noise the squares are sometimes least two
/// nights off or more. `sweep` counts them.
#[test]
fn a_step_of_a_tenth_is_found_at_its_night() {
    let mut near = 0;
    for seed in 0..100 {
        let at = place(seed);
        let found = steps(&history(seed, NIGHTS, 0.03, stepped(at, 0.1)), &options());
        assert_eq!(found.len(), 1, "seed {seed}: {found:?}");
        let step = found[0];
        near += usize::from(step.at.abs_diff(at) <= 1);
        assert!(step.at.abs_diff(at) <= 5, "seed {seed}: at {} in place of {at}", step.at);
        assert!(step.low < step.ratio && step.ratio < step.high, "{step:?}");
        assert!((step.ratio - 1.1).abs() < 0.035, "seed {seed}: {step:?}");
    }
    assert!(near >= 90, "{near} of 100");
}

/// Half of a night's noise is still there on the next: false steps remain, but few.
#[test]
fn nights_that_remember_give_few_false_steps() {
    let false_step = |seed: &u64| !steps(&correlated(*seed, 0.03), &options()).is_empty();
    let count = (0..100).filter(false_step).count();
    assert!(count <= 10, "{count} of 100");
}

/// Noise with a correlation of a half from night to night.
fn correlated(seed: u64, noise: f64) -> Vec<f64> {
    let mut values = history(30_000 + seed, NIGHTS, noise * 0.75_f64.sqrt(), |_| 1.0);
    for k in 1..values.len() {
        values[k] *= (values[k - 1] / 0.25).sqrt();
    }
    values
}

#[test]
fn noise_alone_is_no_step() {
    for seed in 0..20 {
        let found = steps(&history(1000 + seed, NIGHTS, 0.03, |_| 1.0), &options());
        assert_eq!(found, [], "seed {seed}");
    }
}

#[test]
fn an_episode_of_two_weeks_stays_in_sight() {
    for seed in 0..10 {
        let level = |k: usize| if (200..214).contains(&k) { 1.15 } else { 1.0 };
        let found = steps(&history(seed, NIGHTS, 0.03, level), &options());
        let at: Vec<usize> = found.iter().map(|step| step.at).collect();
        assert_eq!(at.len(), 2, "seed {seed}: {found:?}");
        assert!(at[0].abs_diff(200) <= 1 && at[1].abs_diff(214) <= 1, "seed {seed}: {at:?}");
        assert!(found[0].ratio > 1.0 && found[1].ratio < 1.0);
    }
}

#[test]
fn small_steps_are_not_told_and_the_least_size_is_a_choice() {
    let values = history(3, NIGHTS, 0.01, stepped(150, 0.03));
    assert_eq!(steps(&values, &options()), []);
    let found = steps(&values, &StepOptions { least_size: 0.02, ..options() });
    assert_eq!(found.iter().map(|step| step.at).collect::<Vec<_>>(), [150]);
}

#[test]
fn a_loaded_night_is_no_step_and_a_doubling_is_one() {
    let mut values = vec![1.0; 60];
    values[30] = 8.0;
    assert_eq!(steps(&values, &options()), []);
    // A loaded night next to a step moves it by nothing.
    let mut values: Vec<f64> = (0..60).map(|k| if k < 30 { 1.0 } else { 2.0 }).collect();
    values[29] = 1.7;
    let found = steps(&values, &options());
    assert_eq!(found.len(), 1);
    assert!(found[0].at.abs_diff(30) <= 1 && (found[0].ratio - 2.0).abs() < 0.1, "{found:?}");
}

#[test]
fn what_goes_back_and_forth_is_noise() {
    // A memory that is now 100 and now 120, as threads meet, with no rhythm.
    for seed in 0..20 {
        let mut rng = Pcg64::seed_from_u64(seed);
        for share in [0.02, 0.1, 0.3, 0.5] {
            let values: Vec<f64> = (0..NIGHTS)
                .map(|_| if rng.random::<f64>() < share { 120.0 } else { 100.0 })
                .collect();
            let options = StepOptions { spikes: 0.0, ..options() };
            assert_eq!(steps(&values, &options), [], "seed {seed}, {share}");
        }
    }
}

#[test]
fn exact_values_step_after_the_least_nights() {
    let mut values = vec![5e6; 40];
    values.extend([5.6e6; 3]);
    assert_eq!(steps(&values, &options()), []);
    values.push(5.6e6);
    let found = steps(&values, &options());
    assert_eq!(found.len(), 1);
    assert_eq!(found[0].at, 40);
    assert!((found[0].ratio - 1.12).abs() < 1e-3, "{found:?}");
}

#[test]
fn short_and_odd_sequences_have_no_steps() {
    for values in [&[][..], &[1.0], &[1.0, 2.0], &[1.0, 2.0, 1.0, 2.0, 1.0], &[0.0; 30]] {
        assert_eq!(steps(values, &options()), [], "{values:?}");
    }
}

/// The intervals of the search cover each place, and are as many as they should be.
#[test]
fn every_place_is_well_inside_a_short_interval() {
    for n in [8, 9, 50, 401] {
        let intervals = seeded_intervals(n, 8);
        assert!(intervals.iter().all(|&(a, b)| b <= n && b - a >= 8), "{intervals:?}");
        assert!(intervals.contains(&(0, n)));
        for at in 4..=n - 4 {
            let near = intervals.iter().any(|&(a, b)| b - a <= 23 && a + 4 <= at && at + 4 <= b);
            assert!(near, "{n}: {at}");
        }
    }
}

/// What a sweep over seeds found.
#[derive(Default)]
struct Tally {
    exact: usize,
    within_one: usize,
    farther: usize,
    missed: usize,
    extra: usize,
}

fn tally(seeds: std::ops::Range<u64>, noise: f64, size: f64) -> Tally {
    let mut tally = Tally::default();
    for seed in seeds {
        let at = place(seed);
        let found = steps(&history(seed, NIGHTS, noise, stepped(at, size)), &options());
        let nearest = found.iter().map(|step| step.at.abs_diff(at)).min();
        match nearest {
            Some(0) => tally.exact += 1,
            Some(1) => tally.within_one += 1,
            Some(_) => tally.farther += 1,
            None => tally.missed += 1,
        }
        tally.extra += found.len().saturating_sub(1);
    }
    tally
}

/// Night by night, as a nightly run sees it: nights from a step to its first alarm, and alarms without a step.
fn night_by_night(seed: u64, noise: f64, at: usize, size: f64) -> Option<usize> {
    let values = history(seed, at.min(NIGHTS) + 60, noise, stepped(at, size));
    (at + 1..=values.len()).find(|&n| !steps(&values[..n], &options()).is_empty()).map(|n| n - at)
}

/// The figures of docs/nightly.md.
#[test]
#[ignore = "minutes; writes the figures of docs/nightly.md to steps-sweep.txt in the folder for temporary files"]
fn sweep() {
    let mut lines = Vec::new();
    for noise in [0.03, 0.05] {
        for size in [0.1, 0.2, -0.1] {
            let t = tally(0..200, noise, size);
            lines.push(format!(
                "noise {noise}, step {size}: exact {}, one night off {}, farther {}, missed {}, extra {}",
                t.exact, t.within_one, t.farther, t.missed, t.extra
            ));
        }
        let quiet = |seed: &u64| {
            steps(&history(10_000 + seed, NIGHTS, noise, |_| 1.0), &options()).is_empty()
        };
        let alarms = (0..2000).filter(|seed| !quiet(seed)).count();
        lines.push(format!("noise {noise}, no step: {alarms} of 2000 histories with an alarm"));
        let drifting = |seed: &u64| !steps(&correlated(*seed, noise), &options()).is_empty();
        let alarms = (0..200).filter(drifting).count();
        lines.push(format!("noise {noise}, correlated by a half, no step: {alarms} of 200 alarm"));
        let ever = |seed: &u64| {
            let values = history(20_000 + seed, NIGHTS, noise, |_| 1.0);
            (6..=NIGHTS).any(|n| !steps(&values[..n], &options()).is_empty())
        };
        let alarms = (0..200).filter(ever).count();
        lines.push(format!("noise {noise}, no step, asked each night: {alarms} of 200 ever alarm"));
        for size in [0.1, 0.2] {
            let mut delays: Vec<usize> = (0..200)
                .map(|seed| night_by_night(seed, noise, 100, size).unwrap_or(999))
                .collect();
            delays.sort_unstable();
            lines.push(format!(
                "noise {noise}, step {size}: alarm after {} nights (median), {} (of nine in ten), {} (last)",
                delays[100], delays[180], delays[199]
            ));
        }
    }
    std::fs::write(std::env::temp_dir().join("steps-sweep.txt"), lines.join("\n") + "\n")
        .expect("written");
}
