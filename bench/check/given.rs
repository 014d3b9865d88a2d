//! Medial meshes from elsewhere.

use medial::complex::MedialMesh;
use medial::simplifier::{Level, SimplifyError};

use super::{Answer, Miss, Subject, solids, valid};

/// A plain medial mesh, as a file holds it: without contact points.
pub fn initial(subject: &Subject<'_>) -> Answer {
    let shape = solids::shape("capsule");
    let initial = shape.view().initial().map_err(|error| Miss::Skipped(error.to_string()))?;
    let plain = MedialMesh { contacts: None, ..(*initial).clone() };
    let back = *shape.normalisation();
    let plain = plain.transformed(back.diagonal, |p| back.backward(p));
    let shape = solids::shape("capsule").with_initial(&plain);
    let level = Level::Spheres(50);
    (subject.doing)("50 spheres from a given medial mesh of the capsule");
    let answer = subject
        .method
        .prepare(&shape, subject.params, &Default::default())
        .and_then(|mut simplification| simplification.at(level));
    match answer {
        Ok(result) => {
            valid::sound(&result, level).map_err(Miss::Failed)?;
            Ok(vec![])
        }
        // Exception: what a method needs beside a medial mesh, it may say.
        Err(SimplifyError::Unsupported { why }) => Ok(vec![format!("unsupported: {why}")]),
        Err(error) => Err(Miss::Failed(format!("from a given medial mesh: {error}"))),
    }
}
