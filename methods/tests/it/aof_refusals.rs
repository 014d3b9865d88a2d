//! Average outward flux: bad input, what is advised instead, cancelling.

use medial::Vec3;
use medial::simplifier::{Level, MedialSimplifier, Params, RunContext, SimplifyError};
use medial::surface::TriMesh;
use medial_methods::aof;

use crate::aof_solids::{HALF, built_in, cuboid, shape_of, simplified};

#[test]
fn bad_input_is_refused_and_says_what_would_work() {
    let shape = built_in("box");
    let message = |set: &[(&str, &str)], level| match simplified(&shape, set, level) {
        Err(SimplifyError::Parameter(message) | SimplifyError::Level(message)) => message,
        other => panic!("{set:?}: {other:?}"),
    };
    let any = Level::Spheres(10);
    assert!(message(&[("resolution", "5000")], any).contains("fits, or raise max_memory"));
    assert!(message(&[("resolution", "0")], any).contains("resolution"));
    assert!(message(&[("angle", "0")], any).contains("above 0"));
    assert!(message(&[("angle", "-10")], any).contains("above 0"));
    assert!(message(&[], Level::Native(0.0)).contains("above 0"));
    assert!(message(&[("samples", "70/x")], any).contains("70/60/50"));
    assert!(message(&[("samples", "5")], any).contains("70/60/50"));
    assert!(message(&[("samples", "-50")], any).contains("70/60/50"));
    assert!(simplified(&shape, &[("samples", "50")], any).is_ok());
    assert!(message(&[("d", "1")], any).contains("2 or more"));
    assert!(message(&[("levels", "40")], any).contains("fewer levels"));
    // What the messages name works.
    let named = |advice: &str| -> String {
        let words = advice.rsplit("resolution = ").next().expect("a resolution");
        words.chars().take_while(char::is_ascii_digit).collect()
    };
    for id in ["box", "plate", "torus"] {
        let shape = built_in(id);
        let plain = |resolution: &str| {
            let set = [("resolution", resolution), ("variant", "plain")];
            simplified(&shape, &set, Level::Native(20.0)).map(|_| ())
        };
        let advice = plain("1").expect_err("too coarse").to_string();
        assert!(advice.contains("thinner than a voxel everywhere"), "{advice}");
        assert!(plain(&named(&advice)).is_ok(), "{advice}");
        let small = |resolution: &str| {
            let set = [("resolution", resolution), ("max_memory", "8")];
            simplified(&shape, &set, Level::Native(20.0)).map(|_| ())
        };
        let advice = small("300").expect_err("too fine").to_string();
        let fits = named(&advice);
        // The voxels fit; the medial mesh of them may ask for a coarser lattice still.
        let mut coarser = fits.clone();
        for _ in 0..4 {
            let Err(error) = small(&coarser) else { break };
            assert!(error.to_string().contains("the medial mesh of"), "{error}");
            let message = error.to_string().replace(" fits, or raise max_memory", "");
            coarser = named(&message);
        }
        assert!(small(&coarser).is_ok(), "{advice} {coarser}");
        let next = (fits.parse::<u32>().expect("a number") + 3).to_string();
        assert!(small(&next).is_err(), "{advice}");
    }
    assert!(message(&[("max_memory", "1e-9")], any).contains("give max_memory = "));
}

/// Every stage asks: a run that is cancelled at any of its questions ends there.
#[test]
fn cancelling_ends_the_run_at_every_stage() {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
    let shape = built_in("torus");
    // Asks so many times, then cancels.
    let cancelled_after = |questions: usize| {
        let run = RunContext::default();
        let (flag, asked) = (run.cancel_flag(), Arc::new(AtomicUsize::new(0)));
        let counted = Arc::clone(&asked);
        let run = run.on_progress(move |progress| {
            assert!(progress.done <= progress.total, "{progress:?}");
            flag.store(counted.fetch_add(1, Relaxed) >= questions, Relaxed);
        });
        let method = aof::method();
        let answer = method
            .prepare(&shape, &Params::none(), &run)
            .and_then(|mut prepared| prepared.at(Level::Native(30.0)));
        (answer, asked.load(Relaxed))
    };
    let (answer, questions) = cancelled_after(usize::MAX);
    assert!(answer.is_ok() && questions > 5, "{questions}");
    for k in (0..questions).step_by(1 + questions / 12).chain([questions - 1]) {
        let (answer, asked) = cancelled_after(k);
        assert!(matches!(answer.err(), Some(SimplifyError::Cancelled)), "{k} of {questions}");
        // Those that other threads were about to ask.
        assert!(asked <= k + 1 + rayon::current_num_threads(), "{asked} after {k}");
    }
}

#[test]
fn advice_for_thin_and_scattered_solids_is_cheap_and_holds() {
    let refusal = |mesh: &TriMesh, set: &[(&str, &str)]| {
        let set = [&[("variant", "plain")], set].concat();
        match simplified(&shape_of(mesh), &set, Level::Native(20.0)) {
            Err(SimplifyError::Parameter(message)) => message,
            other => panic!("{other:?}"),
        }
    };
    let start = std::time::Instant::now();
    let flat = |height: f64| cuboid(Vec3::new(1.0, 1.0, height));
    let mut apart = cuboid(HALF);
    let far = cuboid(HALF);
    apart.faces.extend(far.faces.iter().map(|face| face.map(|v| v + 8)));
    apart.vertices.extend(far.vertices.iter().map(|&v| v + Vec3::X * 1e12));
    for mesh in [flat(1e-6), apart.clone()] {
        let message = refusal(&mesh, &[]);
        assert!(message.contains("too thin for a lattice"), "{message}");
    }
    // Found by trying, up to a bounded effort.
    let message = refusal(&flat(1e-2), &[]);
    let named = message.rsplit("resolution = ").next().and_then(|rest| rest.split(' ').next());
    let named = named.expect("a resolution");
    let set = [("variant", "plain"), ("resolution", named)];
    assert!(simplified(&shape_of(&flat(1e-2)), &set, Level::Native(20.0)).is_ok(), "{message}");
    let message = refusal(&flat(1e-4), &[]);
    assert!(message.contains("take too long to be tried"), "{message}");
    // A lattice that fits into memory but has no voxel is not advised.
    let message = refusal(&flat(1e-3), &[("resolution", "4000"), ("max_memory", "1")]);
    assert!(message.contains("give max_memory"), "{message}");
    apart.vertices[8..].iter_mut().for_each(|v| *v += Vec3::splat(1e12));
    let message = refusal(&apart, &[]);
    assert!(message.contains("max_memory ends"), "{message}");
    // Minutes and gigabytes without the bounds.
    assert!(start.elapsed().as_secs() < 60, "{:?}", start.elapsed());
}

#[test]
fn samples_are_one_number_or_one_for_each_level() {
    let shape = built_in("box");
    let answer = |samples: &str, levels: &str| {
        let set = [("samples", samples), ("levels", levels)];
        simplified(&shape, &set, Level::Spheres(10)).map(|_| ())
    };
    for (samples, levels) in [("60/50", "3"), ("80/70/60/50", "3"), ("70/60", "1")] {
        let message = answer(samples, levels).expect_err("of another length").to_string();
        assert!(message.contains("one for each"), "{message}");
    }
    for (samples, levels) in [("60/50", "2"), ("50", "2"), ("70/60/50", "2")] {
        assert!(answer(samples, levels).is_ok(), "{samples} for {levels} levels");
    }
}
