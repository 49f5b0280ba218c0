//! What is asked, and what is answered.

use std::collections::BTreeMap;

use serde_json::{Map, Value, json};
use vimc4_answers::fields::no_such;
use vimc4_answers::problem::Problem;
use vimc4_answers::seen;
use vimc4_device::Time;
use vimc4_session::Effect;

/// What is answered.
pub(crate) enum Answer {
    Json(String),
    Text(String),
}

pub(crate) type Outcome = Result<Answer, Problem>;

impl Answer {
    pub(crate) fn json(value: &Value) -> Outcome {
        Ok(Answer::Json(value.to_string()))
    }

    /// Something was done, with this effect.
    pub(crate) fn done(effect: &Effect) -> Outcome {
        Answer::json(&seen::effect(effect))
    }

    /// It is this time now.
    pub(crate) fn now(at: Time) -> Outcome {
        Answer::json(&json!({ "now": at }))
    }
}

/// A request whose fields are there and of the right type.
pub(crate) struct Call {
    /// The moment of the page, in nanoseconds.
    pub(crate) moment: u64,
    pub(crate) path: Vec<(&'static str, String)>,
    pub(crate) query: BTreeMap<String, String>,
    pub(crate) body: Map<String, Value>,
}

impl Call {
    /// A part of the path.
    pub(crate) fn named(&self, name: &str) -> &str {
        self.path.iter().find(|(own, _)| *own == name).map_or("", |(_, value)| value)
    }

    /// A part of the path that is a number.
    pub(crate) fn number<T: std::str::FromStr>(
        &self,
        name: &str,
        what: &str,
    ) -> Result<T, Problem> {
        let text = self.named(name);
        text.parse().map_err(|_| no_such(what, text))
    }

    /// A text of the body; empty if it is not there.
    pub(crate) fn text(&self, name: &str) -> &str {
        self.body.get(name).and_then(Value::as_str).unwrap_or_default()
    }
}
