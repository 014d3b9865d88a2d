//! Parameters of a method: as the user gives them, and as the method's own struct.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::{ParamInfo, SimplifyError};

/// Parameters as given by the user, not yet typed: a JSON object.
///
/// Each method turns them into its own struct (`Default` = the paper's values, unknown keys
/// refused) by [`Params::typed`]; this is the one place where the type is erased.
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
            // Serde does not say which key a wrong value belongs to: the one that fails alone too.
            let fails_alone = |&(key, value): &(&String, &serde_json::Value)| {
                let alone = serde_json::Map::from_iter([(key.clone(), value.clone())]);
                parse(&alone).is_err_and(|error| error == message)
            };
            let named = match self.0.iter().find(fails_alone) {
                Some((key, value)) => format!("{key} = {value}: {message}"),
                None => message,
            };
            SimplifyError::Parameter(named)
        })
    }
}

/// The parameters of a method that has none: every key is refused.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NoParams {}

/// A struct of parameters that describes its fields; [`parameters!`](crate::parameters) implements
/// it.
pub trait ParamFields: Default + Serialize + DeserializeOwned {
    /// Name, unit and help of each field, in the order of declaration.
    const FIELDS: &'static [(&'static str, &'static str, &'static str)];

    /// The parameters with their defaults, for [`MethodInfo::params`](super::MethodInfo::params).
    fn describe() -> Vec<ParamInfo> {
        let defaults = serde_json::to_value(Self::default()).expect("parameters are plain data");
        let describe = |&(name, unit, help): &(&'static str, &'static str, &'static str)| {
            ParamInfo::new(name, as_written(&defaults[name]), unit, help.trim_start())
        };
        Self::FIELDS.iter().map(describe).collect()
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
