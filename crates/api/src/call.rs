//! A request, taken apart.

use std::collections::BTreeMap;
use std::future::Future;
use std::pin::Pin;
use std::str::FromStr;
use std::sync::Arc;

use serde::Serialize;
use serde_json::{Map, Value};

use crate::holding::Holding;
use crate::problem::{Kind, Problem};
use crate::reading::Reading;
use crate::served::{App, Served};

/// What a field of a request holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Of {
    Text,
    /// A text that may be long.
    Image,
    Number,
    /// A number, or a word for it.
    Value,
}

/// A field of a body, or a parameter behind the question mark.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Field {
    pub(crate) name: &'static str,
    pub(crate) of: Of,
    pub(crate) is_needed: bool,
    pub(crate) about: &'static str,
    pub(crate) example: &'static str,
}

impl Field {
    pub(crate) const fn needed(
        name: &'static str,
        of: Of,
        about: &'static str,
        example: &'static str,
    ) -> Field {
        Field { name, of, is_needed: true, about, example }
    }

    pub(crate) const fn optional(
        name: &'static str,
        of: Of,
        about: &'static str,
        example: &'static str,
    ) -> Field {
        Field { name, of, is_needed: false, about, example }
    }

    /// Its example, as JSON.
    pub(crate) fn example(&self) -> Value {
        match (self.of, self.example.parse::<i64>()) {
            (Of::Number | Of::Value, Ok(number)) => number.into(),
            _ => self.example.into(),
        }
    }
}

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
        // It has one address: `01` and `+1` are none.
        let is_plain = !number.starts_with(['0', '+']);
        let place = number.parse::<usize>().ok().filter(|_| is_plain).map(|number| number - 1);
        place.and_then(|place| self.app.controllers.get(place)).ok_or_else(|| {
            let count = self.app.controllers.len();
            Problem::new(
                Kind::NoSuchThing,
                format!("there is no controller `{number}`"),
                format!("their numbers are 1 to {count}"),
            )
        })
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

    /// A number behind the question mark.
    pub(crate) fn asked<T: FromStr>(&self, name: &str, otherwise: T) -> Result<T, Problem> {
        let Some(text) = self.query.get(name) else { return Ok(otherwise) };
        text.parse().map_err(|_| {
            Problem::new(
                Kind::WrongRequest,
                format!("`{name}={text}` is no number"),
                format!("write digits, as in {name}=100"),
            )
        })
    }
}

/// Something that was named is not there.
pub(crate) fn no_such(what: &str, name: &str) -> Problem {
    Problem::new(
        Kind::NoSuchThing,
        format!("there is no {what} `{name}`"),
        "ask for the list, which has those that there are",
    )
}

/// What a body is said to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Content {
    Json,
    Bytes,
    Other,
}

/// The field that may also be a body by itself, as bytes.
pub(crate) fn image(fields: &[Field]) -> Option<&Field> {
    fields.iter().find(|field| field.of == Of::Image)
}

/// What would be right as a body.
pub(crate) fn right_body(fields: &[Field]) -> String {
    if fields.is_empty() {
        return "send no body".to_owned();
    }
    let example = fields.iter().map(|field| (field.name.to_owned(), field.example()));
    let object = format!("send an object such as {}", Value::Object(example.collect()));
    match image(fields) {
        Some(_) => format!("{object}, or its bytes as application/octet-stream"),
        None => object,
    }
}

/// Takes a body apart by the fields that there may be.
pub(crate) fn body(
    fields: &[Field],
    content: Content,
    bytes: &[u8],
) -> Result<Map<String, Value>, Problem> {
    let wrong = |detail: String| Problem::new(Kind::WrongRequest, detail, right_body(fields));
    if let (Content::Bytes, Some(image)) = (content, image(fields)) {
        let text = str::from_utf8(bytes).map_err(|error| {
            wrong(format!("byte {} of the {} is of no text", error.valid_up_to(), image.name))
        })?;
        return Ok(Map::from_iter([(image.name.to_owned(), text.into())]));
    }
    if bytes.is_empty() {
        return match fields.iter().find(|field| field.is_needed) {
            Some(field) => Err(wrong(format!("the body with `{}` is missing", field.name))),
            None => Ok(Map::new()),
        };
    }
    if content != Content::Json {
        let or = image(fields).map_or("", |_| ", or of its bytes application/octet-stream");
        return Err(Problem::new(
            Kind::WrongType,
            "the body is not said to be JSON",
            format!("send the header `Content-Type: application/json`{or}"),
        ));
    }
    let object = match serde_json::from_slice(bytes) {
        Ok(Value::Object(object)) => object,
        Ok(_) => return Err(wrong("the body is no object".to_owned())),
        Err(error) => return Err(wrong(format!("the body is no JSON: {error}"))),
    };
    for (name, value) in &object {
        let Some(field) = fields.iter().find(|field| field.name == name) else {
            return Err(wrong(format!("there is no field `{name}`")));
        };
        let (fits, right) = match field.of {
            Of::Text | Of::Image => (value.is_string(), "a text"),
            Of::Number => (value.is_i64(), "a whole number"),
            Of::Value => (value.is_string() || value.is_i64(), "a whole number or a text"),
        };
        if !fits {
            return Err(wrong(format!("`{name}` is to be {right}")));
        }
    }
    match fields.iter().find(|field| field.is_needed && !object.contains_key(field.name)) {
        Some(field) => Err(wrong(format!("`{}` is missing: {}", field.name, field.about))),
        None => Ok(object),
    }
}

/// Takes apart what is behind the question mark.
pub(crate) fn query(
    fields: &[Field],
    pairs: Vec<(String, String)>,
) -> Result<BTreeMap<String, String>, Problem> {
    let mut query = BTreeMap::new();
    for (name, value) in pairs {
        if !fields.iter().any(|field| field.name == name) {
            let known: Vec<&str> = fields.iter().map(|field| field.name).collect();
            let remedy = match known.as_slice() {
                [] => "there are none here".to_owned(),
                known => format!("there are {}", known.join(", ")),
            };
            let detail = format!("there is no parameter `{name}`");
            return Err(Problem::new(Kind::WrongRequest, detail, remedy));
        }
        if let Some(field) = fields.iter().find(|field| field.name == name)
            && field.of == Of::Number
            && value.parse::<u64>().is_err()
        {
            let detail = format!("`{name}={value}` is no number");
            let remedy = format!("write digits, as in {name}={}", field.example);
            return Err(Problem::new(Kind::WrongRequest, detail, remedy));
        }
        if query.insert(name.clone(), value).is_some() {
            let detail = format!("the parameter `{name}` is there twice");
            return Err(Problem::new(Kind::WrongRequest, detail, "send it once"));
        }
    }
    match fields.iter().find(|field| field.is_needed && !query.contains_key(field.name)) {
        Some(field) => Err(Problem::new(
            Kind::WrongRequest,
            format!("the parameter `{}` is missing: {}", field.name, field.about),
            format!("add ?{}={}", field.name, field.example),
        )),
        None => Ok(query),
    }
}
