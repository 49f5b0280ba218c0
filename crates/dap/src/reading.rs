//! What a client sends as the types that it is meant as; what is wrong is told in words that people
//! know. What is null counts as left out.

use serde::de::DeserializeOwned;
use serde_json::Value;
use vimc4_debug::in_words;

/// Reads what is called so, such as `the arguments of next`.
///
/// # Errors
///
/// What is wrong with it: where, what stands there, and what belongs there.
pub(crate) fn read<T: DeserializeOwned>(called: &str, sent: Value) -> Result<T, String> {
    let sent = match sent {
        Value::Null => Value::Object(serde_json::Map::new()),
        mut sent => {
            leave_out_nulls(&mut sent);
            sent
        }
    };
    // A list would be taken for the values of an object, one after the other.
    if sent.is_array() {
        return Err(format!("{called}: there is a list where an object belongs"));
    }
    serde_path_to_error::deserialize(&sent).map_err(|error| {
        let path = error.path().to_string();
        let at = if path == "." { String::new() } else { format!(" `{path}`:") };
        let of_empty = || {
            let mut sent = sent.clone();
            if let Some(part) = sent.get_mut(&path) {
                *part = "".into();
            }
            T::deserialize(sent).err().map(|error| error.to_string()).unwrap_or_default()
        };
        format!("{called}:{at} {}", told(&path, &error.inner().to_string(), of_empty))
    })
}

/// Entries of a list have their places, and stay.
fn leave_out_nulls(value: &mut Value) {
    match value {
        Value::Object(parts) => {
            parts.retain(|_, part| !part.is_null());
            parts.values_mut().for_each(leave_out_nulls);
        }
        Value::Array(entries) => entries.iter_mut().for_each(leave_out_nulls),
        _ => {}
    }
}

/// An error of serde in words that people know; one of ours has them already.
fn told(path: &str, error: &str, of_empty: impl FnOnce() -> String) -> String {
    let told = in_words(error, of_empty);
    // What is meant by a list of names.
    match path.starts_with("controllers[") && told.ends_with(" an object belongs") {
        true => told.replace(
            "an object belongs",
            "an object with attributes, as in `{ \"name\": \"1\" }`, belongs",
        ),
        false => told,
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::arguments::{
        Restart, SetBreakpoints, SetExceptionBreakpoints, SetVariable, StackTrace, Step,
    };
    use crate::open::Configuration;

    #[test]
    fn what_is_wrong_is_told_where_and_in_words() {
        let read = |sent: Value| read::<Configuration>("this", sent).map(drop);
        for (sent, words) in [
            (
                json!({ "program": "a", "machine": 5 }),
                "`machine`: there is the number 5 where a text belongs",
            ),
            (json!({ "cwd": -1.5 }), "`cwd`: there is the number -1.5 where a text belongs"),
            (
                json!({ "serve": "yes" }),
                "`serve`: there is the text \"yes\" where true or false belongs",
            ),
            (
                json!({ "jobOptions": [1] }),
                "`jobOptions[0]`: there is the number 1 where a text belongs",
            ),
            (
                json!({ "jobOptions": "x" }),
                "`jobOptions`: there is the text \"x\" where a list belongs",
            ),
            (json!({ "quirks": [] }), "`quirks`: there is a list where an object belongs"),
            (
                json!({ "quirks": { "a": [] } }),
                "`quirks`: the value of a is a text, a number, true or false",
            ),
            (
                json!({ "controllers": [{}, { "name": true }] }),
                "`controllers[1].name`: there is true where a text belongs",
            ),
            (
                json!({ "controllers": ["1"] }),
                "`controllers[0]`: there is the text \"1\" where an object with attributes, as in \
                 `{ \"name\": \"1\" }`, belongs",
            ),
            (
                json!({ "controllers": [null] }),
                "`controllers[0]`: there is null where an object with \
                attributes, as in `{ \"name\": \"1\" }`, belongs",
            ),
            (json!([]), "there is a list where an object belongs"),
            (json!("x"), "there is the text \"x\" where an object belongs"),
        ] {
            assert_eq!(read(sent), Err(format!("this: {words}")));
        }
    }

    #[test]
    fn arguments_are_told_in_the_same_words() {
        let wrong = [
            read::<Restart>("this", json!("x")).map(drop),
            read::<StackTrace>("this", json!({ "threadId": 1, "startFrame": -1 })).map(drop),
            read::<SetVariable>("this", json!({ "variablesReference": "x" })).map(drop),
            read::<SetVariable>("this", json!({ "variablesReference": 1 })).map(drop),
            read::<SetBreakpoints>("this", json!({ "source": {}, "breakpoints": [{}] })).map(drop),
            read::<Step>("this", json!({ "threadId": 1, "granularity": "x" })).map(drop),
            read::<Step>("this", json!({ "threadId": 1, "granularity": 5 })).map(drop),
            read::<Step>("this", json!([1, "line"])).map(drop),
            read::<SetBreakpoints>("this", json!([])).map(drop),
            read::<SetExceptionBreakpoints>("this", json!({ "filterOptions": [[]] })).map(drop),
        ];
        let words = [
            "this: there is the text \"x\" where an object belongs",
            "this: `startFrame`: there is the number -1 where a whole number from 0 belongs",
            "this: `variablesReference`: there is the text \"x\" where a whole number belongs",
            "this: `name` is missing",
            "this: `breakpoints[0]`: `line` is missing",
            "this: `granularity`: `x` is none of `statement`, `line`, `instruction`",
            "this: `granularity`: there is the number 5 where one of `statement`, `line`, `instruction` belongs",
            "this: there is a list where an object belongs",
            "this: there is a list where an object belongs",
            "this: `filterOptions[0]`: there is a list where an object belongs",
        ];
        assert_eq!(wrong.map(Result::unwrap_err), words);
    }

    #[test]
    fn what_is_null_is_left_out() {
        let attributes = crate::open::ATTRIBUTES.map(|(name, ..)| (name.to_owned(), Value::Null));
        let all: Value = attributes.into_iter().collect();
        assert_eq!(read("this", all), Ok(Configuration::default()));
        assert_eq!(read("this", Value::Null), Ok(Configuration::default()));
    }

    #[test]
    fn a_long_text_is_shortened() {
        let told = read::<Configuration>("this", json!({ "serve": "x".repeat(100_000) }));
        let told = told.unwrap_err();
        assert!(told.len() < 200, "{}", told.len());
        assert!(told.contains("xxx…\" where true or false belongs"), "{told}");
    }
}
