//! Results are medial meshes that can belong to the shape.

use medial::complex::Sphere;
use medial::simplifier::{Level, Simplified, SimplifyError};

use super::{Answer, Miss, Subject, failed, solids};

/// Numbers of spheres, from fine to coarse, down to the least that can be asked.
pub const COUNTS: [usize; 4] = [400, 100, 20, 1];

/// A sphere that reaches farther, in diagonals of the surface, is of another shape or in other units.
const FARTHEST: f64 = 1e12;

/// Why a result is none: not a valid complex, empty, far outside, or the answer to another question.
pub fn sound(result: &Simplified, level: Level) -> Result<(), String> {
    result.mesh.check().map_err(|error| format!("the medial mesh is not valid: {error}"))?;
    if result.mesh.spheres.is_empty() {
        return Err("the medial mesh has no sphere".into());
    }
    let reach = |sphere: &Sphere| sphere.centre.abs().max_element().max(sphere.radius);
    if let Some(far) = result.mesh.spheres.iter().position(|sphere| reach(sphere) > FARTHEST) {
        let reach = reach(&result.mesh.spheres[far]);
        return Err(format!("sphere {far} reaches {reach:.1e} diagonals away"));
    }
    // Published numbers could be compared with those of another level otherwise.
    if result.asked != level {
        return Err(format!("the result says that {} was asked", result.asked));
    }
    Ok(())
}

/// Sound results on an ordinary solid.
pub fn on(subject: &Subject<'_>, name: &str) -> Answer {
    let shape = solids::shape(name);
    let mut simplification = subject.prepare(&shape)?;
    // Asking once decides what kind of level the method takes.
    if subject.level(simplification.as_mut(), COUNTS[0])? == Level::Published {
        subject.ask(simplification.as_mut(), &shape, Level::Published)?;
        return Ok(vec!["at its published level: it is not asked for numbers".into()]);
    }
    let mut simplification = subject.prepare(&shape)?;
    for count in COUNTS {
        subject.ask(simplification.as_mut(), &shape, Level::Spheres(count))?;
    }
    Ok(vec![])
}

/// Sound results on a solid that is at the edge of what can be resolved.
///
/// Exception: it may be refused in words, also by the name of the parameter that would resolve it. A
/// panic, a crash, an invalid or an empty result is no refusal.
pub fn or_refused(subject: &Subject<'_>, name: &str) -> Answer {
    let shape = solids::shape(name);
    let place = |level: Level| format!("{level} of the {name}");
    (subject.doing)(&format!("preparing the {name}"));
    let prepared = subject.method.prepare(&shape, subject.params, &Default::default());
    let mut simplification = match prepared {
        Ok(simplification) => simplification,
        Err(error) => return refusal(&format!("preparing the {name}"), &error),
    };
    let mut remarks = Vec::new();
    for count in COUNTS {
        let level = Level::Spheres(count);
        (subject.doing)(&place(level));
        match simplification.at(level) {
            Ok(result) => sound(&result, level)
                .map_err(|why| Miss::Failed(format!("{}: {why}", place(level))))?,
            // One remark is enough: the others are alike.
            Err(error) if remarks.is_empty() => remarks = refusal(&place(level), &error)?,
            Err(error) => drop(refusal(&place(level), &error)?),
        }
    }
    Ok(remarks)
}

/// That a solid is refused, where the error says so in words.
fn refusal(place: &str, error: &SimplifyError) -> Answer {
    match error {
        SimplifyError::Unsupported { .. }
        | SimplifyError::Shape(_)
        | SimplifyError::Parameter(_)
        | SimplifyError::Level(_)
        | SimplifyError::Failed(_) => Ok(vec![format!("refused, {place}: {error}")]),
        error => failed(format!("{place}: {error}")),
    }
}
