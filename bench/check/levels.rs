//! Levels other than numbers of spheres.

use medial::simplifier::{Level, Simplification, SimplifyError};

use super::{Answer, Miss, Subject, failed, solids, valid};

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
    let near = subject.level(simplification.as_mut(), 20)?;
    let used = subject.ask(simplification.as_mut(), &shape, near)?.native_level;
    let Some(value) = used else {
        return Ok(vec!["its results do not say which native level was used".into()]);
    };
    taken(subject, simplification.as_mut(), Level::Native(value))
}

/// A level that the method has named itself. It need not lead to the same result: a number of
/// spheres can divide those that tie for a level, and a bound may be held for the whole only.
fn taken(subject: &Subject<'_>, simplification: &mut dyn Simplification, level: Level) -> Answer {
    (subject.doing)(&level.to_string());
    match simplification.at(level) {
        // Exception: the bound of a number of spheres may be below what can be held.
        Err(SimplifyError::Level(why)) => Ok(vec![format!("{level}, its own, is refused: {why}")]),
        Err(error) => failed(format!("{level}, which it has named itself: {error}")),
        Ok(result) => {
            // Exception: where all tie, none is beyond the level. It has to be said.
            if result.mesh.spheres.is_empty() && !result.diagnostics.warnings.is_empty() {
                return Ok(vec![]);
            }
            valid::sound(&result, level).map_err(|why| Miss::Failed(format!("{level}: {why}")))?;
            Ok(vec![])
        }
    }
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
