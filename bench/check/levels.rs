//! Levels other than numbers of spheres.

use medial::simplifier::{Level, SimplifyError};

use super::{Answer, Subject, failed, solids};

/// The method's own level: senseless values are refused, the one that it names is taken.
pub fn native(subject: &Subject<'_>) -> Answer {
    let shape = solids::shape("capsule");
    let mut simplification = subject.prepare(&shape)?;
    if subject.method.info().native.is_none() {
        (subject.doing)("asking for level 1 of its own");
        return match simplification.at(Level::Native(1.0)) {
            Err(SimplifyError::Unsupported { .. }) => Ok(vec![]),
            Err(error) => failed(format!("a level of its own, which it has not: {error}")),
            Ok(_) => failed("it answers a level of its own, but its description has none"),
        };
    }
    for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1.0] {
        let level = Level::Native(value);
        (subject.doing)(&level.to_string());
        match simplification.at(level) {
            Err(SimplifyError::Level(_) | SimplifyError::Unsupported { .. }) => {}
            // Exception: only the program itself knows the range of its level, and says so by its
            // exit code.
            Err(SimplifyError::Failed(_)) if subject.external && value == -1.0 => {}
            Err(error) => return failed(format!("{level} is no `Level` to it, but {error}")),
            Ok(_) => return failed(format!("it answers {level}: refuse that as a `Level`")),
        }
    }
    // What it says that it used can be asked for.
    let used = subject.level(simplification.as_mut(), 20)?;
    let used = subject.ask(simplification.as_mut(), &shape, used)?.native_level;
    let Some(value) = used else {
        return Ok(vec!["its results do not say which native level was used".into()]);
    };
    subject.ask(subject.prepare(&shape)?.as_mut(), &shape, Level::Native(value))?;
    Ok(vec![])
}

/// The published level, which not every paper has.
pub fn published(subject: &Subject<'_>) -> Answer {
    let shape = solids::shape("capsule");
    let mut simplification = subject.prepare(&shape)?;
    (subject.doing)("asking for the published level");
    match simplification.at(Level::Published) {
        Err(SimplifyError::Unsupported { why }) if why.trim().is_empty() => {
            failed("its published level is unsupported, and it does not say why")
        }
        Err(SimplifyError::Unsupported { why }) => Ok(vec![format!("unsupported: {why}")]),
        _ => {
            subject.ask(simplification.as_mut(), &shape, Level::Published)?;
            Ok(vec![])
        }
    }
}
