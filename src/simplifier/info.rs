//! The description of a method, and how the harness presents it.

use std::borrow::Cow;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::simplifier::{MedialSimplifier, SimplifyError};

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
    /// One sentence on the algorithm.
    pub summary: Text,
    /// The method's own level, where it has a scalar one.
    pub native: Option<NativeLevel>,
    /// Whether [`at`](crate::simplifier::Simplification::at) continues from the previous level. It is then called
    /// from fine to coarse, with levels of one kind after one preparation, and the seconds of a level
    /// are those of all calls up to it. The seconds of other methods are those of each call alone.
    pub incremental: bool,
    /// Whether results depend on [`RunContext::seed`](crate::simplifier::RunContext::seed).
    pub seeded: bool,
    /// Whether there is one result for each shape, at [`Level::Published`](super::Level::Published)
    /// alone.
    pub fixed: bool,
    /// Meaning of [`Level::Published`](super::Level::Published) here.
    pub published: Text,
    /// Parameters, in the order of the paper.
    pub params: Vec<ParamInfo>,
    /// The contents of the results' [`Extras`](crate::simplifier::Extras).
    pub extras: Vec<Capability>,
}

impl MethodInfo {
    /// A method of spheres alone: no native level, no published one, no parameters.
    pub fn new(id: impl Into<Text>, title: impl Into<Text>) -> Self {
        let published = "unsupported: request a number of spheres".into();
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

    /// With [`MethodInfo::seeded`]: results depend on the seed.
    pub fn seeded(self) -> Self {
        Self { seeded: true, ..self }
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
}

/// The scalar that a method is controlled by in its paper.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NativeLevel {
    /// Name in the paper, such as `theta`.
    pub name: Text,
    /// Unit, such as `degrees` or `fraction of the diagonal`.
    pub unit: Text,
    /// Whether a larger value leaves fewer spheres.
    pub larger_is_coarser: bool,
    /// Whether its value is a bound of the two-sided error, which the method holds: a search for an error bound begins
    /// there.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub is_error_bound: bool,
}

impl NativeLevel {
    /// A level at which a larger value leaves fewer spheres.
    pub fn larger_is_coarser(name: impl Into<Text>, unit: impl Into<Text>) -> Self {
        Self {
            name: name.into(),
            unit: unit.into(),
            larger_is_coarser: true,
            is_error_bound: false,
        }
    }
}

/// One parameter of a method.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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
    /// A text that changes with the sources of the method; `None` where the program's file serves instead.
    pub version: Option<Text>,
}

/// How the harness presents a method. Nothing here changes a result.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Presentation {
    /// One sentence on the inputs and counts that suit the method; empty where there is none.
    pub best_for: Text,
    /// Native levels of a default comparison, from fine to coarse, in the unit of
    /// [`MethodInfo::native`]; empty for a method without one.
    pub sweep: Vec<f64>,
    /// Whether it runs only when named, because it takes long.
    pub on_request: bool,
}

impl<M: MedialSimplifier + 'static> From<M> for Registered {
    fn from(method: M) -> Self {
        Self { method: Box::new(method), presentation: Presentation::default(), version: None }
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

    /// With [`Presentation::on_request`].
    pub fn on_request(mut self) -> Self {
        self.presentation.on_request = true;
        self
    }
}

// Parameters of a method: as the user gives them, and as the method's own struct.

/// Parameters as given by the user, not yet typed: a JSON object.
///
/// Each method turns them into its own struct (`Default` = the paper's values, unknown keys
/// rejected) by [`Params::typed`]; this is the one place where the type is erased.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Params(pub serde_json::Map<String, serde_json::Value>);

impl Params {
    /// No parameter set: the paper's values.
    pub fn none() -> Self {
        Self::default()
    }

    /// Sets one parameter from text: a JSON scalar where the text is one, else a string.
    pub fn set(&mut self, key: &str, value: &str) {
        let value = serde_json::from_str(value).unwrap_or_else(|_| value.into());
        self.0.insert(key.to_owned(), value);
    }

    /// The method's own parameter struct.
    ///
    /// # Errors
    /// [`SimplifyError::Parameter`] with serde's message when a key is unknown or a value is of
    /// the wrong type; it names the key.
    pub fn typed<T: DeserializeOwned>(&self) -> Result<T, SimplifyError> {
        let parse = |map: &serde_json::Map<String, serde_json::Value>| {
            serde_json::from_value::<T>(serde_json::Value::Object(map.clone()))
                .map_err(|error| error.to_string())
        };
        parse(&self.0).map_err(|message| {
            // Serde's word for a parameter. Its message names the key.
            if let Some(unknown) = message.strip_prefix("unknown field ") {
                return SimplifyError::Parameter(unknown.replacen(", ", " is unknown, ", 1));
            }
            // Serde does not report the key of a wrong value: the one that fails alone too.
            let wrong = self.0.iter().find(|&(key, value)| {
                let alone = serde_json::Map::from_iter([(key.clone(), value.clone())]);
                parse(&alone).is_err_and(|error| error == message)
            });
            let at = wrong.map(|(key, value)| format!("{key} = {value}: ")).unwrap_or_default();
            SimplifyError::Parameter(at + &message)
        })
    }
}

/// The parameters of a method that has none: every key is rejected.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NoParams {}

/// A struct of parameters that describes its fields; [`parameters!`](crate::parameters) implements
/// it.
pub trait ParamFields: Default + Serialize + DeserializeOwned {
    /// Name, unit and help of each field, in the order of declaration.
    const FIELDS: &'static [(&'static str, &'static str, &'static str)];

    /// The parameters with their defaults, for [`MethodInfo::params`](crate::simplifier::MethodInfo::params).
    fn describe() -> Vec<ParamInfo> {
        let defaults = serde_json::to_value(Self::default()).expect("parameters are plain data");
        let described = Self::FIELDS.iter().map(|&(name, unit, help)| {
            ParamInfo::new(name, as_written(&defaults[name]), unit, help.trim_start())
        });
        described.collect()
    }
}

/// A value in the form that `--set` reads.
fn as_written(value: &serde_json::Value) -> String {
    match value {
        serde_json::Value::String(text) => text.clone(),
        serde_json::Value::Array(values) => {
            values.iter().map(as_written).collect::<Vec<_>>().join(",")
        }
        value => value.to_string(),
    }
}

/// Declares the parameters of a method once: the struct, its defaults, its keys, and its
/// documentation.
///
/// Each field has its help as doc comment, then name, type, default and unit (or the list of
/// allowed words). Unknown keys are rejected. A field can have serde attributes.
///
/// ```
/// use medial::simplifier::{ParamFields, Params};
///
/// medial::parameters! {
///     /// Parameters of an example.
///     #[derive(Clone, Copy, Debug)]
///     pub struct ExampleParams {
///         /// Spheres below this radius are removed.
///         least: f64 = 0.25, "fraction of the diagonal";
///         /// How often all spheres shrink.
///         rounds: usize = 3, "rounds";
///     }
/// }
///
/// let described = ExampleParams::describe();
/// assert_eq!((&*described[0].name, &*described[0].default), ("least", "0.25"));
/// assert_eq!(described[1].help, "How often all spheres shrink.");
/// let mut params = Params::none();
/// params.set("rounds", "5");
/// assert_eq!(params.typed::<ExampleParams>()?.rounds, 5);
/// params.set("round", "5");
/// assert!(params.typed::<ExampleParams>().is_err());
/// # Ok::<(), medial::simplifier::SimplifyError>(())
/// ```
#[macro_export]
macro_rules! parameters {
    (
        $(#[$about:meta])*
        pub struct $name:ident {
            $(
                $(#[doc = $help:literal])+
                $(#[serde($($serde:tt)*)])*
                $field:ident: $type:ty = $default:expr, $unit:expr;
            )+
        }
    ) => {
        $(#[$about])*
        #[derive($crate::serde::Serialize, $crate::serde::Deserialize)]
        #[serde(crate = "medial::serde", default, deny_unknown_fields)]
        pub struct $name {
            $(
                $(#[doc = $help])+
                #[doc = concat!("\n\nUnit or values: ", $unit, ".")]
                $(#[serde($($serde)*)])*
                pub $field: $type,
            )+
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $default,)+ }
            }
        }

        impl $crate::simplifier::ParamFields for $name {
            const FIELDS: &'static [(&'static str, &'static str, &'static str)] =
                &[$((stringify!($field), $unit, concat!($($help),+)),)+];
        }
    };
}
