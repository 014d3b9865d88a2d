//! What a method says of itself.

use medial::simplifier::{RunContext, SimplifyError};

use super::same::difference;
use super::{Answer, Subject, failed, solids};

/// A name that no parameter has.
const UNKNOWN: &str = "no_such_parameter";

/// A description that tables and command lines can use.
pub fn report(subject: &Subject<'_>) -> Answer {
    let info = subject.method.info();
    let allowed = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
    if info.id.is_empty() || !info.id.chars().all(allowed) {
        return failed(format!("the id `{}`: use lower-case letters, digits and hyphens", info.id));
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
            return failed(format!("two parameters are called `{}`", param.name));
        }
    }
    // Exception: a method that is being written has no paper yet.
    let uncited = info.citation.trim().is_empty();
    Ok(if uncited { vec!["warning: it has no citation".into()] } else { vec![] })
}

/// A misspelt parameter must not run with the default.
pub fn unknown(subject: &Subject<'_>) -> Answer {
    let shape = solids::shape("sphere");
    let mut params = subject.params.clone();
    params.set(UNKNOWN, "1");
    (subject.doing)("preparing with an unknown parameter");
    match subject.method.prepare(&shape, &params, &RunContext::default()) {
        Err(SimplifyError::Parameter(_)) => Ok(vec![]),
        Err(error) => failed(format!("`{UNKNOWN}` is no wrong `Parameter` to it, but {error}")),
        Ok(_) => failed(format!("it takes a parameter `{UNKNOWN}`, which it does not have")),
    }
}

/// Defaults spelt out, and left out.
pub fn defaults(subject: &Subject<'_>) -> Answer {
    let shape = solids::shape("sphere");
    let mut params = subject.params.clone();
    for param in &subject.method.info().params {
        // What the user sets is not the default.
        if !params.0.contains_key(&*param.name) {
            params.set(&param.name, &param.default);
        }
    }
    let spelt = Subject { params: &params, ..*subject };
    let (plain, spelt) = (subject.mesh(&shape.view(), 50)?, spelt.mesh(&shape.view(), 50)?);
    match difference(&plain, &spelt, 0.0) {
        None => Ok(vec![]),
        Some(difference) => {
            failed(format!("its documented defaults are not those it runs with: {difference}"))
        }
    }
}
