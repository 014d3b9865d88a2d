//! What a method says of itself.

use std::borrow::Cow;

use serde::Serialize;

use super::Level;

/// Text of a method's description: a literal in code, owned where it was read from a file.
type Text = Cow<'static, str>;

/// What a method says of itself.
///
/// ```
/// use medial::simplifier::{MethodInfo, NativeLevel, ParamInfo};
///
/// let info = MethodInfo::new("shrink", "Shrinking balls")
///     .citation("Who, when, where, DOI")
///     .summary("Keeps the balls that shrink least.")
///     .home("Dense samples; not for few spheres.")
///     .native(NativeLevel::larger_is_coarser("t", "fraction of the diagonal"))
///     .sweep(&[0.01, 0.02, 0.05])
///     .param(ParamInfo::new("rounds", 3, "rounds", "how often all balls shrink"));
/// assert_eq!(info.params[0].default, "3");
/// ```
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct MethodInfo {
    /// Short name for the command line, such as `qmat`: lower-case letters, digits and hyphens.
    pub id: Text,
    /// Full name.
    pub title: Text,
    /// Authors, year, title, venue, DOI.
    pub citation: Text,
    /// One sentence on what the method does.
    pub summary: Text,
    /// One sentence on where the method is at home, and where not; empty where it does not say.
    pub home: Text,
    /// The method's own level, where it has a scalar one.
    pub native: Option<NativeLevel>,
    /// Native levels of a default comparison, from fine to coarse, in the unit of
    /// [`MethodInfo::native`]; none for a method without one.
    pub sweep: Vec<f64>,
    /// Of a method that keeps a part of the medial axis as it is: the level from which a collapse
    /// may go on, unless another is named.
    pub filter: Option<Level>,
    /// Whether there is one result for each shape, at [`Level::Published`](super::Level::Published)
    /// alone.
    pub fixed: bool,
    /// Whether it runs only where it is named, because it takes long: not when all methods run.
    pub on_request: bool,
    /// What [`Level::Published`](super::Level::Published) means here.
    pub published: Text,
    /// Parameters, in the order of the paper.
    pub params: Vec<ParamInfo>,
    /// What the answers carry in [`Extras`](super::Extras).
    pub extras: Vec<Capability>,
}

impl MethodInfo {
    /// A method of spheres alone: no native level, no published one, no parameters.
    pub fn new(id: impl Into<Text>, title: impl Into<Text>) -> Self {
        let published = "unsupported: ask for a number of spheres".into();
        Self { id: id.into(), title: title.into(), published, ..Self::default() }
    }

    /// With [`MethodInfo::citation`].
    pub fn citation(self, citation: impl Into<Text>) -> Self {
        Self { citation: citation.into(), ..self }
    }

    /// With [`MethodInfo::summary`].
    pub fn summary(self, summary: impl Into<Text>) -> Self {
        Self { summary: summary.into(), ..self }
    }

    /// With [`MethodInfo::home`].
    pub fn home(self, home: impl Into<Text>) -> Self {
        Self { home: home.into(), ..self }
    }

    /// With [`MethodInfo::native`].
    pub fn native(self, native: NativeLevel) -> Self {
        Self { native: Some(native), ..self }
    }

    /// With [`MethodInfo::sweep`], from fine to coarse.
    pub fn sweep(self, levels: &[f64]) -> Self {
        Self { sweep: levels.to_vec(), ..self }
    }

    /// With [`MethodInfo::filter`].
    pub fn filter(self, level: Level) -> Self {
        Self { filter: Some(level), ..self }
    }

    /// With [`MethodInfo::fixed`]: no levels.
    pub fn fixed(self) -> Self {
        Self { fixed: true, ..self }
    }

    /// With [`MethodInfo::on_request`]: it runs where it is named, and only there.
    pub fn on_request(self) -> Self {
        Self { on_request: true, ..self }
    }

    /// With [`MethodInfo::published`].
    pub fn published(self, published: impl Into<Text>) -> Self {
        Self { published: published.into(), ..self }
    }

    /// With one parameter more.
    pub fn param(mut self, param: ParamInfo) -> Self {
        self.params.push(param);
        self
    }

    /// With more parameters.
    pub fn params(mut self, params: impl IntoIterator<Item = ParamInfo>) -> Self {
        self.params.extend(params);
        self
    }

    /// With one thing more that the answers carry.
    pub fn extra(mut self, extra: Capability) -> Self {
        self.extras.push(extra);
        self
    }

    /// Whether the answers carry an extra of this name.
    pub fn has_extra(&self, name: &str) -> bool {
        self.extras.iter().any(|extra| extra.name == name)
    }
}

/// The scalar that a method is controlled by in its paper.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NativeLevel {
    /// Name in the paper, such as `theta`.
    pub name: Text,
    /// Unit, such as `degrees` or `fraction of the diagonal`.
    pub unit: Text,
    /// Whether a larger value leaves fewer spheres.
    pub larger_is_coarser: bool,
}

impl NativeLevel {
    /// A level of which a larger value leaves fewer spheres.
    pub fn larger_is_coarser(name: impl Into<Text>, unit: impl Into<Text>) -> Self {
        Self { name: name.into(), unit: unit.into(), larger_is_coarser: true }
    }

    /// A level of which a larger value leaves more spheres.
    pub fn larger_is_finer(name: impl Into<Text>, unit: impl Into<Text>) -> Self {
        Self { name: name.into(), unit: unit.into(), larger_is_coarser: false }
    }
}

/// One parameter of a method.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ParamInfo {
    /// Key for `--set key=value`.
    pub name: Text,
    /// Default, as it would be written on the command line.
    pub default: String,
    /// Unit, or the list of allowed words.
    pub unit: Text,
    /// One sentence.
    pub help: Text,
}

impl ParamInfo {
    /// A parameter; `default` as it prints.
    pub fn new(
        name: impl Into<Text>,
        default: impl ToString,
        unit: impl Into<Text>,
        help: impl Into<Text>,
    ) -> Self {
        let default = default.to_string();
        Self { name: name.into(), default, unit: unit.into(), help: help.into() }
    }
}

/// Something that only some methods give beside the medial mesh.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Capability {
    /// Name, such as `hierarchy`.
    pub name: Text,
    /// One sentence.
    pub help: Text,
}

impl Capability {
    /// What is given, and what it is.
    pub fn new(name: impl Into<Text>, help: impl Into<Text>) -> Self {
        Self { name: name.into(), help: help.into() }
    }
}
