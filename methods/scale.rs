//! How the filters compare a value with a level, and the requests that they answer.

use std::ops::RangeInclusive;

use medial::simplifier::{Diagnostics, Level, SimplifyError};

/// How the values are compared with a native level.
pub(crate) struct Scale {
    /// Name of the level for messages.
    pub name: &'static str,
    /// Range of meaningful levels, in native units.
    pub range: RangeInclusive<f64>,
    /// `true` keeps values at the level (`>=`), `false` only those above it (`>`).
    pub inclusive: bool,
    /// The meaning of [`Level::Published`].
    pub published: Published,
}

/// The meaning of [`Level::Published`].
pub(crate) enum Published {
    /// The paper's own level.
    Native(f64),
    /// A documented level where no paper has a single one, and whose it is, as a warning says.
    Documented(f64, &'static str),
    /// There is none, and why.
    None(&'static str),
}

/// A valid request to a filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Wanted {
    /// At least one sphere.
    Spheres(usize),
    /// A level in range.
    Native(f64),
}

impl Scale {
    /// The request of a level; a documented level is announced in `diagnostics`.
    pub(crate) fn wanted(
        &self,
        level: Level,
        diagnostics: &mut Diagnostics,
    ) -> Result<Wanted, SimplifyError> {
        match level {
            Level::Spheres(0) => Err(SimplifyError::Level("ask for at least one sphere".into())),
            Level::Spheres(count) => Ok(Wanted::Spheres(count)),
            Level::Native(level) => self.check(level).map(|()| Wanted::Native(level)),
            Level::Published => match self.published {
                Published::Native(level) => Ok(Wanted::Native(level)),
                Published::Documented(level, whose) => {
                    let name = self.name;
                    diagnostics.warn(format!(
                        "no single level is published; this is {name} = {level}, {whose}"
                    ));
                    Ok(Wanted::Native(level))
                }
                Published::None(why) => Err(SimplifyError::unsupported(why)),
            },
        }
    }

    /// Refuses a level that means nothing.
    fn check(&self, level: f64) -> Result<(), SimplifyError> {
        let Self { name, range, .. } = self;
        if range.contains(&level) {
            return Ok(());
        }
        let (least, most) = (range.start(), range.end());
        let message = match *most {
            f64::MAX => format!("{name} = {level:?} is below {least}, or no number"),
            _ => format!("{name} = {level:?} is outside {least} to {most}"),
        };
        Err(SimplifyError::Level(message))
    }
}
