//! Parameters that have a range.

use std::fmt::Display;
use std::ops::RangeInclusive;

use medial::simplifier::SimplifyError;

/// Refuses a parameter outside its range; a NaN is outside every one.
pub(crate) fn within<T: PartialOrd + Display>(
    name: &str,
    value: T,
    range: RangeInclusive<T>,
) -> Result<(), SimplifyError> {
    if range.contains(&value) {
        return Ok(());
    }
    let (least, most) = (range.start(), range.end());
    Err(SimplifyError::Parameter(format!("{name} = {value} is outside {least} to {most}")))
}
