//! What a request has in it.

use std::collections::BTreeMap;
use std::str::FromStr;
use std::time::Duration;

use serde_json::{Map, Value};
use vimc4_device::{NotADuration, parse_duration};
use vimc4_session::{Clock, ClockError};

use crate::problem::{Kind, Problem};

/// What a field of a request holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Of {
    /// A text.
    Text,
    /// A text that may be long.
    Image,
    /// A whole number.
    Number,
    /// A number, or a word for it.
    Value,
}

/// A field of a body, or a parameter behind the question mark.
#[derive(Clone, Copy, Debug)]
pub struct Field {
    /// Its name.
    pub name: &'static str,
    /// What it holds.
    pub of: Of,
    /// Whether it has to be there.
    pub is_needed: bool,
    /// What it means.
    pub about: &'static str,
    /// As it may be.
    pub example: &'static str,
}

impl Field {
    /// One that has to be there.
    #[must_use]
    pub const fn needed(
        name: &'static str,
        of: Of,
        about: &'static str,
        example: &'static str,
    ) -> Field {
        Field { name, of, is_needed: true, about, example }
    }

    /// One that may be there.
    #[must_use]
    pub const fn optional(
        name: &'static str,
        of: Of,
        about: &'static str,
        example: &'static str,
    ) -> Field {
        Field { name, of, is_needed: false, about, example }
    }

    /// Its example, as JSON.
    #[must_use]
    pub fn example(&self) -> Value {
        match (self.of, self.example.parse::<i64>()) {
            (Of::Number | Of::Value, Ok(number)) => number.into(),
            _ => self.example.into(),
        }
    }
}

/// Something that was named is not there.
#[must_use]
pub fn no_such(what: &str, name: &str) -> Problem {
    Problem::new(
        Kind::NoSuchThing,
        format!("there is no {what} `{name}`"),
        "ask for the list, which has those that there are",
    )
}

/// What a body is said to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// JSON.
    Json,
    /// Bytes.
    Bytes,
    /// Something else, or nothing is said of it.
    Other,
}

/// The field that may also be a body by itself, as bytes.
#[must_use]
pub fn image(fields: &[Field]) -> Option<&Field> {
    fields.iter().find(|field| field.of == Of::Image)
}

/// What would be right as a body.
#[must_use]
pub fn right_body(fields: &[Field]) -> String {
    if fields.is_empty() {
        return "send no body".to_owned();
    }
    if let Some(image) = image(fields) {
        return right_image(image);
    }
    // What has to be there; otherwise one of what may be, since not all goes together.
    let mut example: Vec<&Field> = fields.iter().filter(|field| field.is_needed).collect();
    if example.is_empty() {
        example.extend(fields.first());
    }
    let example = example.into_iter().map(|field| (field.name.to_owned(), field.example()));
    format!("send an object such as {}", Value::Object(example.collect()))
}

/// What would be right as an image. Its example is never given as such: that one erases the memory.
fn right_image(image: &Field) -> String {
    let Field { name, example, .. } = image;
    format!(
        "send one that GET answers, as {{\"{name}\": …}} or its bytes as application/octet-stream; to \
         erase the memory, send {example:?} alone"
    )
}

/// Takes a body apart by the fields that there may be.
///
/// # Errors
///
/// What is wrong with it.
pub fn body(
    fields: &[Field],
    content: Content,
    bytes: &[u8],
) -> Result<Map<String, Value>, Problem> {
    let wrong = |detail: String| Problem::new(Kind::WrongRequest, detail, right_body(fields));
    if let (Content::Bytes, Some(image)) = (content, image(fields)) {
        let text = str::from_utf8(bytes).map_err(|error| {
            wrong(format!("byte {} of the {} is of no text", error.valid_up_to(), image.name))
        })?;
        return whole(Map::from_iter([(image.name.to_owned(), text.into())]), image);
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
        if !fits && value.is_u64() && matches!(field.of, Of::Number | Of::Value) {
            return Err(wrong(format!("`{name}` is {value}, and is to be at most {}", i64::MAX)));
        }
        if !fits {
            return Err(wrong(format!("`{name}` is to be {right}")));
        }
    }
    match fields.iter().find(|field| field.is_needed && !object.contains_key(field.name)) {
        Some(field) => Err(wrong(format!("`{}` is missing: {}", field.name, field.about))),
        None => match image(fields) {
            Some(image) => whole(object, image),
            None => Ok(object),
        },
    }
}

/// What has this image, if that is not empty: whoever sends nothing most often has read no file.
fn whole(object: Map<String, Value>, image: &Field) -> Result<Map<String, Value>, Problem> {
    match object.get(image.name).and_then(Value::as_str) {
        Some("") => Err(Problem::new(
            Kind::WrongRequest,
            format!("the {} is empty", image.name),
            right_image(image),
        )),
        _ => Ok(object),
    }
}

/// Takes apart what is behind the question mark.
///
/// # Errors
///
/// What is wrong with it.
pub fn query(
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

/// A number behind the question mark.
///
/// # Errors
///
/// If it is none.
pub fn number_of<T: FromStr>(
    query: &BTreeMap<String, String>,
    name: &str,
    otherwise: T,
) -> Result<T, Problem> {
    let Some(text) = query.get(name) else { return Ok(otherwise) };
    text.parse().map_err(|_| {
        Problem::new(
            Kind::WrongRequest,
            format!("`{name}={text}` is no number"),
            format!("write digits, as in {name}=100"),
        )
    })
}

/// The bytes of a text: each character is one.
///
/// # Errors
///
/// If a character is no byte.
pub fn bytes_of(text: &str) -> Result<Vec<u8>, Problem> {
    let bytes: Result<Vec<u8>, char> =
        text.chars().map(|c| u8::try_from(c).map_err(|_| c)).collect();
    bytes.map_err(|wrong| {
        Problem::new(
            Kind::NotUnderstood,
            format!("`{wrong}` is no byte"),
            "every character stands for the byte of its number: use those up to U+00FF",
        )
    })
}

/// What a request without any bytes to send is answered.
pub const NO_BYTES: &str = "there are no bytes to send";

/// A span of time as a request says it.
///
/// # Errors
///
/// If it is none.
pub fn span_of(text: &str) -> Result<Duration, Problem> {
    parse_duration(text).map_err(|wrong| {
        let remedy = match wrong {
            NotADuration::TooLong => "send 5124095h at most: no time is longer",
            _ => {
                "send a number that is not negative, with ns, us, ms, s, min or h, such as `250ms`"
            }
        };
        Problem::new(Kind::NotUnderstood, format!("the span `{text}` {wrong}"), remedy)
    })
}

/// A clock as a request says it, of a controller whose clock changes to these, as [the answer about it] names
/// them.
///
/// # Errors
///
/// If it is none.
///
/// [the answer about it]: crate::seen::clock
pub fn clock_of(text: &str, changes_to: &[&str]) -> Result<Clock, Problem> {
    text.parse().map_err(|_: ClockError| {
        let name = |clock: &&str| match *clock {
            "speed" => ClockError::SPEEDS.to_owned(),
            other => other.to_owned(),
        };
        let names: Vec<String> = changes_to.iter().rev().map(name).collect();
        let remedy = match names.is_empty() {
            true => {
                "leave this one as it is: only a clock that runs by itself can change".to_owned()
            }
            false => format!("send {}", names.join(", ")),
        };
        Problem::new(Kind::NotUnderstood, format!("`{text}` is not a clock"), remedy)
    })
}

/// The place of a controller among so many, by its number from 1.
///
/// # Errors
///
/// If there is none of this number.
pub fn place_of(number: &str, count: usize) -> Result<usize, Problem> {
    // It has one address: `01` and `+1` are none.
    let is_plain = !number.starts_with(['0', '+']);
    let place = number.parse::<usize>().ok().filter(|_| is_plain).map(|number| number - 1);
    place.filter(|place| *place < count).ok_or_else(|| {
        Problem::new(
            Kind::NoSuchThing,
            format!("there is no controller `{number}`"),
            format!("their numbers are 1 to {count}"),
        )
    })
}
