//! The demands of the corpus in the order of [`super::cases`], then their shapes.

use std::path::Path;
use std::sync::atomic::Ordering;
use std::thread;
use std::time::{Duration, Instant};

use medial::Vec3;
use medial::complex::MedialMesh;
use medial::shape::{Shape, ShapeOptions};
use medial::simplifier::{Level, RunContext, Simplification, Simplified, SimplifyError};
use medial::surface::{self, TriMesh};
use medial_run::record::is_near;

use super::{CaseResult, Outcome, Subject, failed, miss};
use crate::plugin::is_id;

/// A name that no parameter has.
const UNKNOWN: &str = "no_such_parameter";

/// A description that tables and command lines can use.
pub(super) fn description(subject: &Subject<'_>) -> CaseResult {
    let info = subject.method.info();
    if !is_id(&info.id) {
        return failed(format!("id `{}`: expected lower-case letters, digits, hyphens", info.id));
    }
    if info.title.trim().is_empty() {
        return failed("it has no title");
    }
    if let Some(native) = info.native.as_ref().filter(|n| n.name.is_empty() || n.unit.is_empty()) {
        return failed(format!("its native level `{}` has no name or no unit", native.name));
    }
    for (place, param) in info.params.iter().enumerate() {
        if param.unit.trim().is_empty() {
            return failed(format!("the parameter `{}` has no unit; write `none`", param.name));
        }
        if info.params[..place].iter().any(|other| other.name == param.name) {
            return failed(format!("two parameters have the name `{}`", param.name));
        }
    }
    // Exception: a method that is being written has no paper yet.
    let uncited = info.citation.trim().is_empty();
    Ok(if uncited { vec!["warning: it has no citation".into()] } else { vec![] })
}

/// A misspelt parameter must not run with the default.
pub(super) fn unknown_parameter(subject: &Subject<'_>) -> CaseResult {
    let shape = corpus_shape("sphere");
    let mut params = subject.params.clone();
    params.set(UNKNOWN, "1");
    (subject.doing)("preparing with an unknown parameter");
    let prepared = subject.method.prepare(&shape, &params, &RunContext::default());
    let is_right = |error: &SimplifyError| matches!(error, SimplifyError::Parameter(_));
    refused(&format!("`{UNKNOWN}`"), prepared, "Parameter", is_right)
}

/// Demands an error of the right kind.
fn refused<T>(
    place: &str,
    outcome: Result<T, SimplifyError>,
    expected: &str,
    is_right: impl Fn(&SimplifyError) -> bool,
) -> CaseResult {
    match outcome {
        Err(error) if is_right(&error) => Ok(vec![]),
        Err(error) => failed(format!("{place}: expected `{expected}`, found: {error}")),
        Ok(_) => failed(format!("{place}: expected `{expected}`, found a result")),
    }
}

/// The documented defaults are those of the method.
pub(super) fn defaults(subject: &Subject<'_>) -> CaseResult {
    let shape = corpus_shape("sphere");
    let mut params = subject.params.clone();
    for param in &subject.method.info().params {
        // A value of the user is not the default.
        if !params.0.contains_key(&*param.name) {
            params.set(&param.name, &param.default);
        }
    }
    let spelt = Subject { params: &params, ..*subject };
    let (plain, spelt) = (subject.mesh(&shape.view(), 50)?, spelt.mesh(&shape.view(), 50)?);
    same(&plain, &spelt, 0.0, "its documented defaults change the result")
}

/// Numbers of spheres, from fine to coarse, down to 1.
pub(super) const COUNTS: [usize; 4] = [400, 100, 20, 1];

/// A sphere that reaches farther, in diagonals of the surface, is of another shape or in other units.
const FARTHEST: f64 = 1e12;

/// Refuses a result that is not a valid complex, is empty, far outside, or of another level.
pub(super) fn sound(result: &Simplified, level: Level) -> Result<(), String> {
    result.mesh.check().map_err(|error| format!("the medial mesh is not valid: {error}"))?;
    if result.mesh.spheres.is_empty() {
        return Err("the medial mesh has no sphere".into());
    }
    // Larger spheres pass every test of validity, and spoil every metric.
    for (id, sphere) in result.mesh.spheres.iter().enumerate() {
        let reach = sphere.centre.abs().max_element().max(sphere.radius);
        if reach > FARTHEST {
            return Err(format!("sphere {id} reaches {reach:.1e} diagonals away"));
        }
    }
    // Published numbers could be compared with those of another level otherwise.
    let requested = result.asked;
    if requested != level {
        return Err(format!("another level (found {requested}, expected {level})"));
    }
    Ok(())
}

/// Sound results on an ordinary solid.
pub(super) fn valid_on(subject: &Subject<'_>, name: &str) -> CaseResult {
    let shape = corpus_shape(name);
    let mut simplification = subject.prepare(&shape)?;
    // One call decides which kind of level the method takes.
    if subject.level(simplification.as_mut(), COUNTS[0])? == Level::Published {
        subject.at(simplification.as_mut(), &shape, Level::Published)?;
        return Ok(vec!["at its published level: it has no sphere counts".into()]);
    }
    // Prepared again: the level above may have left a coarse state.
    let mut simplification = subject.prepare(&shape)?;
    for count in COUNTS {
        subject.at(simplification.as_mut(), &shape, Level::Spheres(count))?;
    }
    Ok(vec![])
}

/// Sound results on a solid at the limit of resolution.
///
/// Exception: it may be refused by an error, also one about the parameter that would resolve it. A
/// panic, a crash, an invalid or an empty result is not a refusal.
pub(super) fn valid_or_refused(subject: &Subject<'_>, name: &str) -> CaseResult {
    let shape = corpus_shape(name);
    (subject.doing)(&format!("preparing the {name}"));
    let prepared = subject.method.prepare(&shape, subject.params, &Default::default());
    let mut simplification = match prepared {
        Ok(simplification) => simplification,
        Err(error) => return refusal(&format!("preparing the {name}"), &error),
    };
    let mut remarks = Vec::new();
    for count in COUNTS {
        let level = Level::Spheres(count);
        let place = format!("{level} of the {name}");
        (subject.doing)(&place);
        match simplification.at(level) {
            Ok(result) => {
                sound(&result, level).map_err(|why| Outcome::Failed(format!("{place}: {why}")))?;
            }
            // One remark is enough: the others are similar.
            Err(error) if remarks.is_empty() => remarks = refusal(&place, &error)?,
            Err(error) => drop(refusal(&place, &error)?),
        }
    }
    Ok(remarks)
}

/// A remark on a refusal; other errors fail the case.
fn refusal(place: &str, error: &SimplifyError) -> CaseResult {
    match error {
        SimplifyError::Unsupported { .. }
        | SimplifyError::Shape(_)
        | SimplifyError::Parameter(_)
        | SimplifyError::Level(_)
        | SimplifyError::Failed(_) => Ok(vec![format!("refused, {place}: {error}")]),
        error => failed(format!("{place}: {error}")),
    }
}

/// Shapes that differ in kind: thin, round, looped, hollow, sharp.
const SHAPES: [&str; 6] = ["sphere", "box", "capsule", "torus", "hollow-sphere", "bracket"];

/// No medial mesh here has as many spheres.
const HUGE: usize = 1_000_000_000;

/// The count is reached, or a warning has the reason.
pub(super) fn counts_met(subject: &Subject<'_>) -> CaseResult {
    for name in SHAPES {
        let shape = corpus_shape(name);
        let view = shape.view();
        let mut simplification = subject.prepare(&view)?;
        for count in COUNTS {
            at_count(subject, simplification.as_mut(), &shape, count)?;
        }
    }
    Ok(vec![])
}

/// Counts above the number of initial spheres, by one and by many.
pub(super) fn counts_above(subject: &Subject<'_>) -> CaseResult {
    for name in ["capsule", TETRAHEDRON] {
        let shape = corpus_shape(name);
        let initial = shape.view().initial().map_or(1, |mesh| mesh.spheres.len());
        let view = shape.view();
        let mut simplification = match subject.prepare(&view) {
            Ok(simplification) => simplification,
            // Exception: a solid of four vertices may be refused; another case checks this.
            Err(_) if name == TETRAHEDRON => continue,
            Err(miss) => return Err(miss),
        };
        let one = simplification.at(Level::Spheres(1));
        if name == TETRAHEDRON && one.is_err() {
            continue;
        }
        // First the huge count: a method that allocates by the request fails here.
        for count in [HUGE, initial + 1] {
            at_count(subject, simplification.as_mut(), &shape, count)?;
        }
    }
    Ok(vec![])
}

/// A count of 0 is refused with the right kind of error.
pub(super) fn no_spheres(subject: &Subject<'_>) -> CaseResult {
    let shape = corpus_shape("sphere");
    let mut simplification = subject.prepare(&shape)?;
    (subject.doing)("trying 0 spheres");
    refused("0 spheres", simplification.at(Level::Spheres(0)), "Level", is_no_level)
}

/// The errors of a level that is out of range.
fn is_no_level(error: &SimplifyError) -> bool {
    matches!(error, SimplifyError::Level(_) | SimplifyError::Unsupported { .. })
}

fn at_count(
    subject: &Subject<'_>,
    simplification: &mut dyn Simplification,
    shape: &Shape,
    count: usize,
) -> Result<Simplified, Outcome> {
    let result = subject.at(simplification, shape, Level::Spheres(count))?;
    let reached = result.mesh.spheres.len();
    if is_near(reached, count) || !result.diagnostics.warnings.is_empty() {
        return Ok(result);
    }
    // Exception: all spheres of the initial medial mesh need no warning where more are requested.
    let initial = shape.view().initial().map_or(usize::MAX, |mesh| mesh.spheres.len());
    if count > initial && reached == initial {
        return Ok(result);
    }
    failed(format!(
        "{count} spheres of the {}: found {reached} spheres without a warning",
        shape.name()
    ))
}

/// Native levels: invalid values are refused, and the value of a result is accepted.
pub(super) fn native_level(subject: &Subject<'_>) -> CaseResult {
    let shape = corpus_shape("capsule");
    let mut simplification = subject.prepare(&shape)?;
    if subject.method.info().native.is_none() {
        (subject.doing)("trying native level 1");
        let outcome = simplification.at(Level::Native(1.0));
        let is_right = |error: &SimplifyError| matches!(error, SimplifyError::Unsupported { .. });
        return refused("a native level, without one", outcome, "Unsupported", is_right);
    }
    // -1 is finite, and below the range of every level that a paper has.
    for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1.0] {
        let level = Level::Native(value);
        (subject.doing)(&level.to_string());
        // Exception: only the program itself has the range of its level, and refuses by its exit code.
        let may_fail = subject.external && value == -1.0;
        refused(&level.to_string(), simplification.at(level), "Level", |error| {
            is_no_level(error) || may_fail && matches!(error, SimplifyError::Failed(_))
        })?;
    }
    let near = subject.level(simplification.as_mut(), 20)?;
    let used = subject.at(simplification.as_mut(), &shape, near)?.native_level;
    let Some(value) = used else {
        return Ok(vec!["its results have no native level".into()]);
    };
    accepted(subject, simplification.as_mut(), Level::Native(value))
}

/// A native level from a result of the method.
// It need not lead to the same result: a number of spheres can divide those that tie for a level, and
// a bound may be held for the whole only.
fn accepted(
    subject: &Subject<'_>,
    simplification: &mut dyn Simplification,
    level: Level,
) -> CaseResult {
    (subject.doing)(&level.to_string());
    match simplification.at(level) {
        // Exception: the bound of a number of spheres may be below what can be held.
        Err(SimplifyError::Level(why)) => Ok(vec![format!("refused its {level}: {why}")]),
        Err(error) => failed(format!("{level} of a result: {error}")),
        Ok(result) => {
            // Exception: where all spheres tie, none is beyond the level. A warning is required.
            if result.mesh.spheres.is_empty() && !result.diagnostics.warnings.is_empty() {
                return Ok(vec![]);
            }
            sound(&result, level).map_err(|why| Outcome::Failed(format!("{level}: {why}")))?;
            Ok(vec![])
        }
    }
}

/// The published level, which is optional.
pub(super) fn published_level(subject: &Subject<'_>) -> CaseResult {
    let shape = corpus_shape("capsule");
    let mut simplification = subject.prepare(&shape)?;
    (subject.doing)("trying the published level");
    match simplification.at(Level::Published) {
        Err(SimplifyError::Unsupported { why }) if why.trim().is_empty() => {
            failed("its published level is unsupported without a reason")
        }
        Err(SimplifyError::Unsupported { why }) => Ok(vec![format!("unsupported: {why}")]),
        _ => {
            subject.at(simplification.as_mut(), &shape, Level::Published)?;
            Ok(vec![])
        }
    }
}

// The files of a program have the input's units, and other units round differently.
const ROUNDING: f64 = 1e-9;

/// A level has the same result after finer, coarser and equal levels.
pub(super) fn continuing(subject: &Subject<'_>) -> CaseResult {
    let shape = corpus_shape("torus");
    let view = shape.view();
    let mut simplification = subject.prepare(&view)?;
    // Down, up and down to an earlier level: shows caches that are not reset.
    for count in [300, 100, 200, 100] {
        let level = Level::Spheres(count);
        let continued = subject.at(simplification.as_mut(), &view, level)?;
        let alone = subject.at(subject.prepare(&shape.view())?.as_mut(), &shape, level)?;
        if let Some(difference) = difference(&alone.mesh, &continued.mesh, 0.0) {
            return failed(format!(
                "{level} of the torus: another result after other levels: {difference}"
            ));
        }
    }
    Ok(vec![])
}

/// Two complete runs without shared state, and one with another seed, which must be declared to matter.
pub(super) fn repeated(subject: &Subject<'_>) -> CaseResult {
    let first = subject.mesh(&corpus_shape("bracket"), 150)?;
    let second = subject.mesh(&corpus_shape("bracket"), 150)?;
    same(&first, &second, 0.0, "the bracket: another result in a second run")?;
    if subject.method.info().seeded {
        return Ok(vec![]);
    }
    let other = Subject { seed: 1, ..*subject }.mesh(&corpus_shape("bracket"), 150)?;
    same(&first, &other, 0.0, "the bracket: another result with another seed; declare it seeded")
}

/// Other numbers of threads, for substrates and method alike.
pub(super) fn threads(subject: &Subject<'_>) -> CaseResult {
    let mut results: Vec<MedialMesh> = Vec::new();
    // 5 divides no power of two: chunks end elsewhere.
    for threads in [1, 2, 5] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.map_err(|error| Outcome::Skipped(error.to_string()))?;
        // The callback stays in this thread: the method runs in the pool.
        (subject.doing)(&format!("150 spheres of the bracket with {threads} threads"));
        let (method, params) = (subject.method, subject.params);
        let result = pool.install(|| {
            let shape = corpus_shape("bracket");
            let mut simplification = method.prepare(&shape, params, &Default::default())?;
            match simplification.at(Level::Spheres(150)) {
                Err(SimplifyError::Unsupported { .. }) => simplification.at(Level::Published),
                result => result,
            }
        });
        let place = format!("the bracket with {threads} threads");
        results.push(result.map_err(|error| miss(&place, &error))?.mesh);
        let changed = format!("{place}: another result");
        same(&results[0], &results[results.len() - 1], 0.0, &changed)?;
    }
    Ok(vec![])
}

/// Powers of two, so that normalised coordinates are the same bits.
pub(super) fn scale(subject: &Subject<'_>) -> CaseResult {
    let plain = subject.mesh(&corpus_shape("capsule"), 100)?;
    for scale in [1.0 / 1024.0, 4096.0] {
        let result = subject.mesh(&scaled_shape("capsule", scale), 100)?;
        // Exception: a program gets the units of the input and may use any arithmetic.
        let tolerance = if subject.external { ROUNDING } else { 0.0 };
        let changed = format!("{scale} times the capsule: another result");
        same(&plain, &result, tolerance, &changed)?;
    }
    Ok(vec![])
}

fn same(first: &MedialMesh, second: &MedialMesh, tolerance: f64, otherwise: &str) -> CaseResult {
    match difference(first, second, tolerance) {
        None => Ok(vec![]),
        Some(difference) => failed(format!("{otherwise}: {difference}")),
    }
}

/// The first difference of two meshes; 0 tolerates none, not even that of the two zeros.
pub(super) fn difference(
    first: &MedialMesh,
    second: &MedialMesh,
    tolerance: f64,
) -> Option<String> {
    let [numbers, others] =
        [first, second].map(|m| [m.spheres.len(), m.edges.len(), m.faces.len()]);
    if numbers != others {
        return Some(format!("{numbers:?} spheres, edges and faces, then {others:?}"));
    }
    for (id, (a, b)) in first.spheres.iter().zip(&second.spheres).enumerate() {
        let [a, b] = [a, b].map(|s| [s.centre.x, s.centre.y, s.centre.z, s.radius]);
        // By bits: 0 and -0 are equal as numbers, and differ in a file.
        if a.into_iter().zip(b).any(|(a, b)| match tolerance {
            0.0 => a.to_bits() != b.to_bits(),
            _ => (a - b).abs() > tolerance,
        }) {
            return Some(format!("sphere {id} is {a:?}, then {b:?}"));
        }
    }
    if (&first.edges, &first.faces) != (&second.edges, &second.faces) {
        return Some("the spheres are the same, but edges or faces differ".into());
    }
    // Contact points are rounded with the units, and a program has none.
    let contacts = tolerance > 0.0 || first.contacts == second.contacts;
    (!contacts).then(|| "all is the same but the contact points".into())
}

/// Longest time to end after a cancellation.
const SOON: Duration = Duration::from_secs(10);
/// After this time, methods are running or done.
pub(super) const AT_WORK: Duration = Duration::from_millis(50);

/// Cancelled before the first level, or after a delay, while the method runs.
pub(super) fn cancelled(subject: &Subject<'_>, delay: Duration) -> CaseResult {
    let shape = corpus_shape("bracket");
    // Substrates are not part of the method, and their time does not count.
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
    let outcome = run_two_levels(subject, &shape, &context);
    let late = begun.elapsed().saturating_sub(delay);
    if late > SOON {
        return failed(format!("it ended {:.0} s after it was cancelled", late.as_secs_f64()));
    }
    // Exception: a quick method may return its result.
    match outcome {
        Ok(()) | Err(SimplifyError::Cancelled | SimplifyError::Unsupported { .. }) => Ok(vec![]),
        Err(error) => failed(format!("expected `Cancelled`, found: {error}")),
    }
}

fn run_two_levels(
    subject: &Subject<'_>,
    shape: &Shape,
    context: &RunContext,
) -> Result<(), SimplifyError> {
    let mut simplification = subject.method.prepare(shape, subject.params, context)?;
    for count in [200, 20] {
        let level = Level::Spheres(count);
        let result = simplification.at(level)?;
        sound(&result, level).map_err(SimplifyError::InvalidOutput)?;
    }
    Ok(())
}

/// A plain medial mesh, as a file holds it: without contact points.
pub(super) fn given_initial(subject: &Subject<'_>) -> CaseResult {
    let shape = corpus_shape("capsule");
    let initial = shape.view().initial().map_err(|error| Outcome::Skipped(error.to_string()))?;
    let plain = MedialMesh { contacts: None, ..(*initial).clone() };
    let back = *shape.normalisation();
    let plain = plain.to_input(&back);
    let shape = corpus_shape("capsule").with_initial(&plain);
    let level = Level::Spheres(50);
    (subject.doing)("50 spheres from a given medial mesh of the capsule");
    let result = subject
        .method
        .prepare(&shape, subject.params, &Default::default())
        .and_then(|mut simplification| simplification.at(level));
    match result {
        Ok(result) => {
            sound(&result, level).map_err(Outcome::Failed)?;
            Ok(vec![])
        }
        // Exception: a method may require more than a medial mesh.
        Err(SimplifyError::Unsupported { why }) => Ok(vec![format!("unsupported: {why}")]),
        Err(error) => Err(Outcome::Failed(format!("from a given medial mesh: {error}"))),
    }
}

/// Two boxes, a diagonal apart.
pub(super) const PARTS: &str = "pair of boxes";
/// A box whose thickness is a ten-thousandth of its length.
pub(super) const PLATE: &str = "very thin plate";
/// Four vertices: one Delaunay cell.
pub(super) const TETRAHEDRON: &str = "tetrahedron";
/// Eight vertices on one sphere: every triangulation of them is a degenerate one.
pub(super) const CUBE: &str = "cube of eight vertices";

/// A shape of the corpus, in units that are `scale` times smaller.
pub(super) fn scaled_shape(name: &str, scale: f64) -> Shape {
    let mut mesh = mesh(name);
    mesh.vertices.iter_mut().for_each(|v| *v *= scale);
    let report = surface::validate(&mesh).expect("the shapes of the corpus are solids");
    Shape::new(name, &mesh, report, ShapeOptions::default()).expect("they have an extent")
}

/// A shape of the corpus.
pub(super) fn corpus_shape(name: &str) -> Shape {
    scaled_shape(name, 1.0)
}

fn mesh(name: &str) -> TriMesh {
    match name {
        PARTS => two(&mesh("box")),
        PLATE => {
            let mut mesh = mesh("box");
            mesh.vertices.iter_mut().for_each(|v| v.z *= 3e-4);
            mesh
        }
        TETRAHEDRON => solid("4 4 0 1 1 1 1 -1 -1 -1 1 -1 -1 -1 1 3 0 1 2 3 0 3 1 3 0 2 3 3 1 3 2"),
        CUBE => solid(
            "8 6 0 0 0 0 1 0 0 0 1 0 1 1 0 0 0 1 1 0 1 0 1 1 1 1 1 \
             4 0 2 3 1 4 4 5 7 6 4 0 1 5 4 4 2 6 7 3 4 0 4 6 2 4 1 3 7 5",
        ),
        id => {
            let shape = medial_datasets::find(id).expect("a shape of the catalogue");
            shape.mesh(shape.default_resolution)
        }
    }
}

/// A mesh and a copy of it, moved by twice its width.
fn two(one: &TriMesh) -> TriMesh {
    let (low, high) = one.bounding_box().expect("it has vertices");
    let offset = Vec3::new(2.0 * (high.x - low.x), 0.0, 0.0);
    let count = one.vertices.len() as u32;
    let vertices = one.vertices.iter().copied();
    let faces = one.faces.iter().copied();
    TriMesh {
        vertices: vertices.clone().chain(vertices.map(|v| v + offset)).collect(),
        faces: faces.clone().chain(faces.map(|face| face.map(|i| i + count))).collect(),
    }
}

/// A surface of the words of an OFF file behind its first.
fn solid(words: &str) -> TriMesh {
    let text = format!("OFF {words}");
    let loaded = surface::inspect_bytes(Path::new("solid.off"), text.as_bytes());
    loaded.expect("the solids of the corpus are surfaces").mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn generated_shapes_match_their_names() {
        for (name, components, vertices) in
            [(PARTS, 2, None), (PLATE, 1, None), (TETRAHEDRON, 1, Some(4)), (CUBE, 1, Some(8))]
        {
            let shape = corpus_shape(name);
            assert_eq!(shape.expected_betti(), Some([components, 0, 0]), "{name}");
            assert!(vertices.is_none_or(|count| shape.mesh().vertices.len() == count), "{name}");
        }
    }
}
