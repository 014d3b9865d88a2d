//! What must change nothing: the order of questions, a second run, threads, scale.

use medial::complex::{MedialMesh, Sphere};
use medial::simplifier::{Level, SimplifyError};

use super::{Answer, Miss, Subject, failed, solids};

/// A program's files hold the input's units: what it reads is rounded otherwise in others.
const ROUNDING: f64 = 1e-9;

/// A level is the same whatever was computed before it: finer, coarser, and the same again.
pub fn continuing(subject: &Subject<'_>) -> Answer {
    let shape = solids::shape("torus");
    let view = shape.view();
    let mut simplification = subject.prepare(&view)?;
    for count in [300, 100, 200, 100] {
        let level = Level::Spheres(count);
        let continued = subject.ask(simplification.as_mut(), &view, level)?;
        let alone = subject.ask(subject.prepare(&shape.view())?.as_mut(), &shape, level)?;
        if let Some(difference) = difference(&alone.mesh, &continued.mesh, 0.0) {
            return failed(format!(
                "{level} of the torus after other levels differ from those alone: {difference}"
            ));
        }
    }
    Ok(vec![])
}

/// The whole way twice, with nothing shared.
pub fn repeated(subject: &Subject<'_>) -> Answer {
    let first = subject.mesh(&solids::shape("bracket"), 150)?;
    let second = subject.mesh(&solids::shape("bracket"), 150)?;
    same(&first, &second, 0.0, "a second run of the bracket gives another medial mesh")
}

/// Other numbers of threads, for substrates and method alike.
pub fn threads(subject: &Subject<'_>) -> Answer {
    let mut results: Vec<MedialMesh> = Vec::new();
    for threads in [1, 2, 5] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.map_err(|error| Miss::Skipped(error.to_string()))?;
        // What the caller is told stays in this thread: the method runs in the pool.
        (subject.doing)(&format!("150 spheres of the bracket with {threads} threads"));
        let (method, params) = (subject.method, subject.params);
        let result = pool.install(|| {
            let shape = solids::shape("bracket");
            let mut simplification = method.prepare(&shape, params, &Default::default())?;
            match simplification.at(Level::Spheres(150)) {
                Err(SimplifyError::Unsupported { .. }) => simplification.at(Level::Published),
                result => result,
            }
        });
        let place = format!("the bracket with {threads} threads");
        results.push(result.map_err(|error| super::miss(&place, &error))?.mesh);
        let changed = format!("{place} gives another medial mesh");
        same(&results[0], &results[results.len() - 1], 0.0, &changed)?;
    }
    Ok(vec![])
}

/// Powers of two, so that normalised coordinates are the same bits.
pub fn scale(subject: &Subject<'_>) -> Answer {
    let plain = subject.mesh(&solids::shape("capsule"), 100)?;
    for scale in [1.0 / 1024.0, 4096.0] {
        let result = subject.mesh(&solids::scaled("capsule", scale), 100)?;
        // Exception: a program is given the units of the input, and its arithmetic is its own.
        let tolerance = if subject.external { ROUNDING } else { 0.0 };
        let changed = format!("{scale} times the capsule gives another medial mesh");
        same(&plain, &result, tolerance, &changed)?;
    }
    Ok(vec![])
}

fn same(first: &MedialMesh, second: &MedialMesh, tolerance: f64, otherwise: &str) -> Answer {
    match difference(first, second, tolerance) {
        None => Ok(vec![]),
        Some(difference) => failed(format!("{otherwise}: {difference}")),
    }
}

/// The first difference of two meshes; 0 tolerates none, not even that of the two zeros.
pub fn difference(first: &MedialMesh, second: &MedialMesh, tolerance: f64) -> Option<String> {
    let numbers = |m: &MedialMesh| [m.spheres.len(), m.edges.len(), m.faces.len()];
    if numbers(first) != numbers(second) {
        return Some(format!(
            "{:?} spheres, edges and faces, then {:?}",
            numbers(first),
            numbers(second)
        ));
    }
    let values = |s: &Sphere| [s.centre.x, s.centre.y, s.centre.z, s.radius];
    let alike = |a: f64, b: f64| match tolerance {
        0.0 => a.to_bits() == b.to_bits(),
        _ => (a - b).abs() <= tolerance,
    };
    let spheres = first.spheres.iter().zip(&second.spheres).enumerate();
    for (id, (a, b)) in spheres {
        if values(a).into_iter().zip(values(b)).any(|(a, b)| !alike(a, b)) {
            return Some(format!("sphere {id} is {:?}, then {:?}", values(a), values(b)));
        }
    }
    let connected = (&first.edges, &first.faces) == (&second.edges, &second.faces);
    if !connected {
        return Some("the spheres are the same, but edges or faces differ".into());
    }
    let contacts = tolerance > 0.0 || first.contacts == second.contacts;
    (!contacts).then(|| "all is the same but the contact points".into())
}
