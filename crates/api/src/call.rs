//! A request, taken apart.

use std::collections::BTreeMap;
use std::future::Future;
use std::pin::Pin;
use std::str::FromStr;
use std::sync::Arc;

use serde::Serialize;
use serde_json::{Map, Value};

use vimc4_answers::fields::{no_such, place_of};
use vimc4_answers::problem::{Kind, Problem};

use crate::holding::Holding;
use crate::reading::Reading;
use crate::served::{App, Served};

/// A request whose fields are there and of the right type.
#[derive(Debug)]
pub(crate) struct Call {
    pub(crate) app: Arc<App>,
    pub(crate) path: BTreeMap<String, String>,
    pub(crate) query: BTreeMap<String, String>,
    pub(crate) body: Map<String, Value>,
}

/// What is answered.
#[derive(Debug)]
pub(crate) enum Answer {
    Json(String),
    Text(String),
    /// So many bytes of a recording, and what reads them.
    Recording(Reading),
    /// Nothing, until something ends.
    Holding(Holding),
}

pub(crate) type Outcome = Result<Answer, Problem>;
pub(crate) type Coming = Pin<Box<dyn Future<Output = Outcome> + Send>>;

impl Answer {
    pub(crate) fn json(value: &impl Serialize) -> Outcome {
        let text = serde_json::to_string(value);
        text.map(Answer::Json).map_err(|error| {
            Problem::new(Kind::NotNow, format!("this cannot be written as JSON: {error}"), "")
        })
    }
}

impl Call {
    /// The controller that it is about.
    pub(crate) fn controller(&self) -> Result<&Served, Problem> {
        let number = self.path.get("n").map_or("", String::as_str);
        let place = place_of(number, self.app.controllers.len())?;
        self.app.controllers.get(place).ok_or_else(|| no_such("controller", number))
    }

    /// A part of the path that is a number.
    pub(crate) fn number<T: FromStr>(&self, name: &str, what: &str) -> Result<T, Problem> {
        let text = self.path.get(name).map_or("", String::as_str);
        text.parse().map_err(|_| no_such(what, text))
    }

    /// A text of the body; empty if it is not there.
    pub(crate) fn text(&self, name: &str) -> &str {
        self.body.get(name).and_then(Value::as_str).unwrap_or_default()
    }
}
