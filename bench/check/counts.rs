//! Numbers of spheres: what makes methods comparable.

use medial::shape::Shape;
use medial::simplifier::{Level, Simplification, Simplified, SimplifyError};

use super::valid::COUNTS;
use super::{Answer, Miss, Subject, failed, solids};

/// Shapes that differ in kind: thin, round, looped, hollow, sharp.
const SHAPES: [&str; 6] = ["sphere", "box", "capsule", "torus", "hollow-sphere", "bracket"];

/// A result with so much more or less than was asked is one at another count.
const TOLERANCE: f64 = 0.02;

/// No medial mesh here has as many spheres.
const HUGE: usize = 1_000_000_000;

/// The count is reached, or a warning says why not.
pub fn met(subject: &Subject<'_>) -> Answer {
    for name in SHAPES {
        let shape = solids::shape(name);
        let view = shape.view();
        let mut simplification = subject.prepare(&view)?;
        for count in COUNTS {
            at(subject, simplification.as_mut(), &shape, count)?;
        }
    }
    Ok(vec![])
}

/// More than there is, by one sphere and by many.
pub fn above(subject: &Subject<'_>) -> Answer {
    for name in ["capsule", solids::TETRAHEDRON] {
        let shape = solids::shape(name);
        let initial = shape.view().initial().map_or(1, |mesh| mesh.spheres.len());
        let view = shape.view();
        let mut simplification = match subject.prepare(&view) {
            Ok(simplification) => simplification,
            // Exception: a solid of four vertices may be refused; the case about it says how.
            Err(_) if name == solids::TETRAHEDRON => continue,
            Err(miss) => return Err(miss),
        };
        let one = simplification.at(Level::Spheres(1));
        if name == solids::TETRAHEDRON && one.is_err() {
            continue;
        }
        for count in [HUGE, initial + 1] {
            at(subject, simplification.as_mut(), &shape, count)?;
        }
    }
    Ok(vec![])
}

/// No sphere at all is refused, by name.
pub fn none(subject: &Subject<'_>) -> Answer {
    let shape = solids::shape("sphere");
    let mut simplification = subject.prepare(&shape)?;
    (subject.doing)("asking for 0 spheres");
    match simplification.at(Level::Spheres(0)) {
        Err(SimplifyError::Level(_) | SimplifyError::Unsupported { .. }) => Ok(vec![]),
        Err(error) => failed(format!("0 spheres are no `Level` to it, but {error}")),
        Ok(result) => {
            let spheres = result.mesh.spheres.len();
            failed(format!("0 spheres were asked, and {spheres} given: refuse that as a `Level`"))
        }
    }
}

fn at(
    subject: &Subject<'_>,
    simplification: &mut dyn Simplification,
    shape: &Shape,
    count: usize,
) -> Result<Simplified, Miss> {
    let result = subject.ask(simplification, shape, Level::Spheres(count))?;
    let reached = result.mesh.spheres.len();
    let near = reached.abs_diff(count) as f64 <= TOLERANCE * count as f64;
    // Exception: who asks for more than the initial medial mesh has need not be told that it is all.
    let all = || {
        shape
            .view()
            .initial()
            .is_ok_and(|mesh| count > mesh.spheres.len() && reached == mesh.spheres.len())
    };
    if near || !result.diagnostics.warnings.is_empty() || all() {
        return Ok(result);
    }
    failed(format!(
        "{count} spheres of the {}: it gives {reached}, and no warning says why",
        shape.name()
    ))
}
