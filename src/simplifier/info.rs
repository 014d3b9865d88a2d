//! The description of a method, and how the harness presents it.

use std::borrow::Cow;

use serde::Serialize;

use super::{Level, MedialSimplifier};

/// Text of a method's description: a literal in code, owned where it was read from a file.
type Text = Cow<'static, str>;

/// The description of a method.
///
/// ```
/// use medial::simplifier::{MethodInfo, NativeLevel, ParamInfo};
///
/// let info = MethodInfo::new("shrink", "Shrinking balls")
///     .citation("Who, when, where, DOI")
///     .summary("Keeps the balls that shrink least.")
///     .native(NativeLevel::larger_is_coarser("t", "fraction of the diagonal"))
///     .param(ParamInfo::new("rounds", 3, "rounds", "how often all balls shrink"));
/// assert_eq!(info.params[0].default, "3");
/// ```
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct MethodInfo {
    /// Short name for the command line, such as `qmat`: lower-case letters, digits and hyphens.
    pub id: Text,
    /// Full name.
    pub title: Text,
    /// Authors, year, title, venue, DOI, in one line.
    pub citation: Text,
    /// The same source as a BibTeX entry; empty where there is no publication.
    pub bibtex: Text,
    /// One sentence on what the method does.
    pub summary: Text,
    /// The method's own level, where it has a scalar one.
    pub native: Option<NativeLevel>,
    /// Whether [`at`](super::Simplification::at) continues from the previous level. It is then called
    /// from fine to coarse, with levels of one kind after one preparation, and the seconds of a level
    /// are those of all calls up to it. The seconds of other methods are those of each call alone.
    pub incremental: bool,
    /// Whether there is one result for each shape, at [`Level::Published`](super::Level::Published)
    /// alone.
    pub fixed: bool,
    /// What [`Level::Published`](super::Level::Published) means here.
    pub published: Text,
    /// Parameters, in the order of the paper.
    pub params: Vec<ParamInfo>,
    /// What the results carry in [`Extras`](super::Extras).
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

    /// With [`MethodInfo::bibtex`].
    pub fn bibtex(self, bibtex: impl Into<Text>) -> Self {
        Self { bibtex: bibtex.into(), ..self }
    }

    /// With [`MethodInfo::native`].
    pub fn native(self, native: NativeLevel) -> Self {
        Self { native: Some(native), ..self }
    }

    /// With [`MethodInfo::incremental`]: levels continue from the previous one.
    pub fn incremental(self) -> Self {
        Self { incremental: true, ..self }
    }

    /// With [`MethodInfo::fixed`]: no levels.
    pub fn fixed(self) -> Self {
        Self { fixed: true, ..self }
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

    /// With one more extra of the results.
    pub fn extra(mut self, extra: Capability) -> Self {
        self.extras.push(extra);
        self
    }

    /// Whether the results carry an extra of this name.
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

/// A result of only some methods, next to the medial mesh.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Capability {
    /// Name, such as `hierarchy`.
    pub name: Text,
    /// One sentence.
    pub help: Text,
}

impl Capability {
    /// An extra by its name.
    pub fn new(name: impl Into<Text>, help: impl Into<Text>) -> Self {
        Self { name: name.into(), help: help.into() }
    }
}

/// A method in a registry, and how the harness presents it.
pub struct Registered {
    /// The method.
    pub method: Box<dyn MedialSimplifier>,
    /// Its place in a comparison.
    pub presentation: Presentation,
}

/// How the harness presents a method. Nothing here changes a result.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Presentation {
    /// One sentence on the inputs and counts that suit the method; empty where there is none.
    pub best_for: Text,
    /// Native levels of a default comparison, from fine to coarse, in the unit of
    /// [`MethodInfo::native`]; empty for a method without one.
    pub sweep: Vec<f64>,
    /// For a method that keeps a part of the medial axis as it is: the default level from which
    /// another method continues in a chain.
    pub filter: Option<Level>,
    /// Whether it runs only when named, because it takes long.
    pub on_request: bool,
}

impl<M: MedialSimplifier + 'static> From<M> for Registered {
    fn from(method: M) -> Self {
        Self { method: Box::new(method), presentation: Presentation::default() }
    }
}

impl Registered {
    /// With [`Presentation::best_for`].
    pub fn best_for(mut self, sentence: impl Into<Text>) -> Self {
        self.presentation.best_for = sentence.into();
        self
    }

    /// With [`Presentation::sweep`], from fine to coarse.
    pub fn sweep(mut self, levels: &[f64]) -> Self {
        self.presentation.sweep = levels.to_vec();
        self
    }

    /// With [`Presentation::filter`].
    pub fn filter(mut self, level: Level) -> Self {
        self.presentation.filter = Some(level);
        self
    }

    /// With [`Presentation::on_request`].
    pub fn on_request(mut self) -> Self {
        self.presentation.on_request = true;
        self
    }
}
