//! Cancelled runs end soon.

use std::sync::atomic::Ordering;
use std::thread;
use std::time::{Duration, Instant};

use medial::shape::Shape;
use medial::simplifier::{Level, RunContext, SimplifyError};

use super::{Answer, Subject, failed, solids, valid};

/// So long after the flag was set a person still waits.
const SOON: Duration = Duration::from_secs(10);
/// Methods are at work by then, or done.
const AT_WORK: Duration = Duration::from_millis(50);

/// The flag is set before anything is asked.
pub fn before(subject: &Subject<'_>) -> Answer {
    cancelled(subject, Duration::ZERO)
}

/// The flag is set while the method works.
pub fn within(subject: &Subject<'_>) -> Answer {
    cancelled(subject, AT_WORK)
}

fn cancelled(subject: &Subject<'_>, delay: Duration) -> Answer {
    let shape = solids::shape("bracket");
    // Substrates are nobody's method, and take what they take.
    let _ = shape.view().initial();
    let context = RunContext::default();
    let flag = context.cancel_flag();
    let begun = Instant::now();
    if delay.is_zero() {
        flag.store(true, Ordering::Relaxed);
    } else {
        thread::spawn(move || {
            thread::sleep(delay);
            flag.store(true, Ordering::Relaxed);
        });
    }
    (subject.doing)("a cancelled run of the bracket");
    let outcome = run(subject, &shape, &context);
    let late = begun.elapsed().saturating_sub(delay);
    if late > SOON {
        return failed(format!("it ended {:.0} s after it was cancelled", late.as_secs_f64()));
    }
    // Exception: a method that is quick enough may give its result all the same.
    match outcome {
        Ok(()) | Err(SimplifyError::Cancelled | SimplifyError::Unsupported { .. }) => Ok(vec![]),
        Err(error) => failed(format!("a cancelled run is not `Cancelled`, but {error}")),
    }
}

fn run(subject: &Subject<'_>, shape: &Shape, context: &RunContext) -> Result<(), SimplifyError> {
    let mut simplification = subject.method.prepare(shape, subject.params, context)?;
    for count in [200, 20] {
        let level = Level::Spheres(count);
        let result = simplification.at(level)?;
        valid::sound(&result, level).map_err(SimplifyError::InvalidOutput)?;
    }
    Ok(())
}
