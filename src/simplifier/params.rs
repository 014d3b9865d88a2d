//! Parameters of a method: as the user gives them, and as the method's own struct.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::SimplifyError;

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
