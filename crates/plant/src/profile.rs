//! Reading profiles. Errors point at the place.

use std::ops::Range;
use std::sync::{Arc, OnceLock};

use serde::Serialize;
use serde::de::DeserializeOwned;
use toml::{Table, Value};

/// Why a profile was not accepted, and where.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct ProfileError {
    /// What is wrong, in one lower-case sentence.
    pub message: String,
    /// What would be right.
    pub help: String,
    /// The bytes of the text that the message is about.
    pub span: Option<Range<usize>>,
}

impl ProfileError {
    /// An error about the value of `key`, found in `text` by its name.
    #[must_use]
    pub fn about_key(
        text: &str,
        table: &str,
        key: &str,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> ProfileError {
        ProfileError {
            message: message.into(),
            help: help.into(),
            span: find_key(text, table, key),
        }
    }
}

/// Built-in profiles by name. Each is read when it is first needed, and kept.
#[derive(Debug)]
pub struct Builtins<T, const N: usize> {
    texts: [(&'static str, &'static str); N],
    read: [OnceLock<Option<Arc<T>>>; N],
}

impl<T, const N: usize> Builtins<T, N> {
    /// The profiles of these names and texts.
    #[must_use]
    pub const fn new(texts: [(&'static str, &'static str); N]) -> Builtins<T, N> {
        Builtins { texts, read: [const { OnceLock::new() }; N] }
    }

    /// Their names, in order.
    #[must_use]
    pub fn names(&self) -> Vec<&'static str> {
        self.texts.iter().map(|(name, _)| *name).collect()
    }

    /// The text of the profile of that name.
    #[must_use]
    pub fn text(&self, name: &str) -> Option<&'static str> {
        self.texts.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
    }

    /// The profile of that name, read by `parse`.
    pub fn get(
        &self,
        name: &str,
        parse: impl FnOnce(&str) -> Result<T, ProfileError>,
    ) -> Option<Arc<T>> {
        let ((_, text), read) =
            self.texts.iter().zip(&self.read).find(|((known, _), _)| *known == name)?;
        read.get_or_init(|| parse(text).ok().map(Arc::new)).clone()
    }
}

/// Gives a type of profiles its built-in ones, by name, and the reading of others.
///
/// After the type follow a function that checks a profile and its text, and the names and texts of
/// the built-in profiles.
///
/// ```
/// #[derive(serde::Deserialize)]
/// struct Lamp {
///     watts: u32,
/// }
///
/// vimc4_plant::profiles! { Lamp, |lamp: &Lamp, text| match lamp.watts {
///     0 => Err(vimc4_plant::ProfileError::about_key(text, "", "watts", "no light", "1 at least")),
///     _ => Ok(()),
/// }, ["bulb" = "watts = 60"] }
///
/// assert_eq!(Lamp::names(), ["bulb"]);
/// assert_eq!(Lamp::builtin("bulb").map(|lamp| lamp.watts), Some(60));
/// assert!(Lamp::from_toml("watts = 0").is_err());
/// ```
#[macro_export]
macro_rules! profiles {
    ($profile:ty, $check:expr, [$($name:literal = $text:expr),+ $(,)?]) => {
        impl $profile {
            fn builtins() -> &'static $crate::Builtins<Self, { [$($name),+].len() }> {
                static BUILTINS: $crate::Builtins<$profile, { [$($name),+].len() }> =
                    $crate::Builtins::new([$(($name, $text)),+]);
                &BUILTINS
            }

            /// The names of the built-in profiles.
            #[must_use]
            pub fn names() -> Vec<&'static str> {
                Self::builtins().names()
            }

            /// The built-in profile of that name.
            #[must_use]
            pub fn builtin(name: &str) -> Option<std::sync::Arc<Self>> {
                Self::builtins().get(name, Self::from_toml)
            }

            /// The text of the built-in profile of that name, as a starting point for another.
            #[must_use]
            pub fn builtin_toml(name: &str) -> Option<&'static str> {
                Self::builtins().text(name)
            }

            /// Reads a profile.
            ///
            /// # Errors
            ///
            /// If it is not TOML, has unknown or missing keys, or an impossible value.
            pub fn from_toml(text: &str) -> Result<Self, $crate::ProfileError> {
                let profile = $crate::parse_profile(text);
                let profile: Self = profile.map_err(|error| {
                    $crate::with_all_missing::<Self>(error, text, &[$($text),+])
                })?;
                let check: fn(&Self, &str) -> Result<(), $crate::ProfileError> = $check;
                check(&profile, text)?;
                Ok(profile)
            }
        }
    };
}

/// Reads a profile from TOML. Unknown keys are errors; an error says what would be right.
pub fn parse_profile<T: DeserializeOwned>(text: &str) -> Result<T, ProfileError> {
    toml::from_str(text).map_err(|error| ProfileError {
        message: error.message().trim().replace('\n', "; "),
        help:
            "compare with a built-in profile: `vimc4 models show NAME`, `vimc4 machines show NAME`"
                .to_owned(),
        span: error.span(),
    })
}

/// The error of a profile that lacks a field, with all fields that it lacks. Values for them come from the
/// built-in profiles, one after the other, until no field is missing.
#[must_use]
pub fn with_all_missing<T: DeserializeOwned>(
    error: ProfileError,
    text: &str,
    builtins: &[&str],
) -> ProfileError {
    let Ok(mut own) = text.parse::<Table>().map(Value::Table) else { return error };
    let builtins: Vec<Value> =
        builtins.iter().filter_map(|text| Some(Value::Table(text.parse().ok()?))).collect();
    let mut names = Vec::new();
    let mut message = error.message.clone();
    while let Some(field) = missing_field(&message) {
        let found = builtins.iter().find_map(|other| {
            let mut candidate = own.clone();
            let name = fill(&mut candidate, other, field, "")?;
            let after = candidate.clone().try_into::<T>().err();
            let after = after.map(|error| error.message().to_owned()).unwrap_or_default();
            (after != message).then_some((candidate, name, after))
        });
        let Some((filled, name, after)) = found else { break };
        (own, message) = (filled, after);
        names.push(format!("`{name}`"));
    }
    match names.as_slice() {
        [] | [_] => error,
        [all @ .., last] => {
            let message = format!("missing fields {} and {last}", all.join(", "));
            ProfileError { message, ..error }
        }
    }
}

/// The field that an error of a profile misses.
fn missing_field(message: &str) -> Option<&str> {
    message.trim().strip_prefix("missing field `")?.strip_suffix('`')
}

/// Puts a field into the first table that lacks it and has it in another profile. Returns its name with those of the
/// tables around it.
fn fill(own: &mut Value, other: &Value, field: &str, path: &str) -> Option<String> {
    match (own, other) {
        (Value::Table(own), Value::Table(other)) => {
            if let (Some(value), false) = (other.get(field), own.contains_key(field)) {
                own.insert(field.to_owned(), value.clone());
                return Some(format!("{path}{field}"));
            }
            own.iter_mut().find_map(|(key, value)| {
                fill(value, other.get(key)?, field, &format!("{path}{key}."))
            })
        }
        (Value::Array(own), Value::Array(other)) => own
            .iter_mut()
            .find_map(|value| other.iter().find_map(|other| fill(value, other, field, path))),
        _ => None,
    }
}

/// The TOML text of a profile that was serialised in another form, so that it can be read and
/// checked like any other.
///
/// # Errors
///
/// If it cannot be a profile.
pub fn profile_text(profile: &impl Serialize) -> Result<String, ProfileError> {
    toml::to_string(profile).map_err(|error| ProfileError {
        message: format!("it is not a profile: {error}"),
        help: "take it as it was written".to_owned(),
        span: None,
    })
}

/// The line of `key` in `[table]` (or before any table if `table` is empty).
fn find_key(text: &str, table: &str, key: &str) -> Option<Range<usize>> {
    let mut current = String::new();
    let mut at = 0;
    for line in text.split_inclusive('\n') {
        let trimmed = line.trim();
        if let Some(name) = trimmed.strip_prefix('[').and_then(|rest| rest.split(']').next()) {
            current = name.trim_matches('[').trim().to_owned();
            if current == table && key.is_empty() {
                return Some(at..at + line.trim_end().len());
            }
        } else if current == table
            && trimmed.split('=').next().is_some_and(|name| name.trim() == key)
        {
            return Some(at..at + line.trim_end().len());
        }
        at += line.len();
    }
    None
}
