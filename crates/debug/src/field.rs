//! What is visible of a controller and its state, as a tree of named values.

use std::fmt;

use serde_json::{Map, Value};
use vimc4_catalogue::{Controller, State};
use vimc4_device::{AXES, Device, SignalId, Time};

use crate::DebugError;
use crate::error::shortened;
use crate::types::in_words;

/// The name of the state in the tree: everything that decides what the controller will do.
const STATE: &str = "state";

/// A place in the tree: names with dots between them, as in `axes.x.position`, `signals.stop` or
/// `state.ramp.acceleration`. The name of an axis alone means its position; any other top-level
/// name means that thing itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Field {
    text: String,
    keys: Vec<String>,
    /// The index of the axis whose position it is: that is known without building the tree.
    axis: Option<usize>,
    /// The signal whose value it is.
    signal: Option<SignalId>,
}

/// An item of the tree: its name, path and value.
#[derive(Clone, Debug, PartialEq)]
pub struct Variable {
    /// Its name, the last part of its path.
    pub name: String,
    /// The whole path, which [`Field::parse`] reads.
    pub path: String,
    /// Its value; a list or a group has parts.
    pub value: Value,
}

impl Variable {
    /// Whether it has parts, and how many.
    #[must_use]
    pub fn parts(&self) -> usize {
        match &self.value {
            Value::Object(parts) => parts.len(),
            Value::Array(parts) => parts.len(),
            _ => 0,
        }
    }

    /// Its parts.
    pub fn children(&self) -> Vec<Variable> {
        let child = |name: String, value: &Value| {
            let path = match self.path.as_str() {
                "" => quoted(&name),
                path => format!("{path}.{}", quoted(&name)),
            };
            Variable { name, path, value: value.clone() }
        };
        match &self.value {
            Value::Object(parts) => {
                parts.iter().map(|(name, value)| child(name.clone(), value)).collect()
            }
            Value::Array(parts) => {
                let parts = parts.iter().enumerate();
                parts.map(|(place, value)| child(place.to_string(), value)).collect()
            }
            _ => Vec::new(),
        }
    }

    /// Its value in one line, shortened to a readable length.
    #[must_use]
    pub fn text(&self) -> String {
        shortened(match &self.value {
            Value::String(text) => text.clone(),
            Value::Null => "none".to_owned(),
            value => value.to_string(),
        })
    }
}

impl fmt::Display for Variable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let path = if self.path.is_empty() { "everything" } else { &self.path };
        match self.parts() {
            0 => write!(f, "{path} = {}", self.text()),
            _ => {
                write!(f, "{path}:")?;
                for part in self.children() {
                    write!(f, "\n  {:<16} {}", part.name, part.text())?;
                }
                Ok(())
            }
        }
    }
}

/// A name as a path has it.
fn quoted(name: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || matches!(c, '_' | '-' | '+');
    if !name.is_empty() && name.chars().all(is_plain) {
        name.to_owned()
    } else {
        format!("\"{}\"", name.replace('\\', "\\\\").replace('"', "\\\""))
    }
}

/// The names in a path.
fn keys(path: &str) -> Result<Vec<String>, DebugError> {
    let mut keys = Vec::new();
    let mut rest = path.trim();
    let wrong =
        || DebugError::new(format!("`{path}` is not a field: names with dots between them"));
    loop {
        let key;
        if let Some(quote) = rest.strip_prefix('"') {
            let mut name = String::new();
            let mut chars = quote.char_indices();
            let end = loop {
                match chars.next() {
                    Some((at, '"')) => break at + 1,
                    Some((_, '\\')) => name.extend(chars.next().map(|(_, c)| c)),
                    Some((_, c)) => name.push(c),
                    None => return Err(wrong()),
                }
            };
            (key, rest) = (name, &quote[end..]);
        } else {
            let end = rest.find(['.', '[']).unwrap_or(rest.len());
            (key, rest) = (rest[..end].trim().to_owned(), &rest[end..]);
            if key.is_empty() {
                return Err(wrong());
            }
        }
        keys.push(key);
        while let Some(index) = rest.strip_prefix('[') {
            let (index, after) = index.split_once(']').ok_or_else(wrong)?;
            keys.push(index.trim().trim_matches('"').to_owned());
            rest = after;
        }
        match rest.strip_prefix('.') {
            Some(after) => rest = after,
            None if rest.is_empty() => return Ok(keys),
            None => return Err(wrong()),
        }
    }
}

impl Field {
    /// Reads a path of a controller's tree.
    ///
    /// # Errors
    ///
    /// If it leads nowhere; with the names that exist where it goes wrong.
    pub fn parse(text: &str, device: &Controller) -> Result<Field, DebugError> {
        let text = text.trim();
        let mut keys = match text.split_once('.') {
            // Names of signals contain spaces and dots, and people type them without quotation
            // marks.
            Some(("signals", name)) if is_signal(device, name) => {
                vec!["signals".to_owned(), name.to_lowercase()]
            }
            _ => keys(text)?,
        };
        let names = device.view(device.now()).axes;
        let axis_of = |name: &str| {
            let named = names.iter().find(|axis| axis.name.eq_ignore_ascii_case(name));
            named.map(|axis| (usize::from(axis.index), axis.name.to_lowercase()))
        };
        if let Some((_, name)) = keys.first().and_then(|key| axis_of(key)) {
            let rest = keys.split_off(1);
            keys = vec!["axes".to_owned(), name];
            if rest.is_empty() {
                keys.push("position".to_owned());
            }
            keys.extend(rest);
        }
        let axis = match keys.as_slice() {
            [axes, name, position] if axes == "axes" && position == "position" => {
                axis_of(name).map(|(index, _)| index).filter(|index| *index < AXES)
            }
            _ => None,
        };
        let signal = match keys.as_slice() {
            [signals, name] if signals == "signals" => {
                let mut listed = device.signals().into_iter();
                listed.find(|signal| signal.name.eq_ignore_ascii_case(name)).map(|signal| signal.id)
            }
            _ => None,
        };
        let field = Field { text: text.to_owned(), keys, axis, signal };
        field.look(device, device.now())?;
        Ok(field)
    }

    /// The path as it was typed.
    #[must_use]
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The axis whose position it is, if it is one.
    #[must_use]
    pub fn axis(&self) -> Option<usize> {
        self.axis
    }

    /// The signal whose value it is, if it is one.
    #[must_use]
    pub fn signal(&self) -> Option<SignalId> {
        self.signal
    }

    /// Whether it is outside the part of the controller that receives bytes.
    pub(crate) fn is_outside(&self) -> bool {
        self.keys.first().is_some_and(|key| matches!(key.as_str(), "axes" | "signals" | "ports"))
    }

    /// The value of the fields that are asked for most, without the rest of the tree.
    fn quick(&self, device: &Controller, at: Time) -> Option<Value> {
        if let Some(axis) = self.axis {
            return Some(device.position(at)[axis].into());
        }
        let signal = self.signal?;
        let signals = device.view(at).signals;
        let value = signals.into_iter().find(|view| view.id == signal)?.value;
        Some(value.map_or(Value::Null, Value::from))
    }

    /// Its value at `at`, a time from the device's present until its next cause.
    ///
    /// # Errors
    ///
    /// If it is not there.
    pub fn look(&self, device: &Controller, at: Time) -> Result<Value, DebugError> {
        if let Some(value) = self.quick(device, at) {
            return Ok(value);
        }
        let (tree, keys) = match self.keys.split_first() {
            Some((first, rest)) if first == STATE => (state_tree(&device.state()), rest),
            _ => (view_tree(device, at), self.keys.as_slice()),
        };
        let mut here = &tree;
        for (place, key) in keys.iter().enumerate() {
            here = part(here, key).ok_or_else(|| {
                let before = keys[..place].join(".");
                let names = names_in(here);
                let there = if names.is_empty() {
                    "has no parts".to_owned()
                } else {
                    format!("has {}", names.join(", "))
                };
                let what = match before.as_str() {
                    "" if keys.len() == self.keys.len() => "the controller".to_owned(),
                    "" => "the state".to_owned(),
                    before => format!("`{before}`"),
                };
                DebugError::new(format!("there is no `{key}`: {what} {there}"))
            })?;
        }
        Ok(here.clone())
    }

    /// The value if it exists, else `None`: for what comes and goes.
    pub(crate) fn value(&self, device: &Controller, at: Time) -> Value {
        self.look(device, at).unwrap_or(Value::Null)
    }

    /// The state with another value in this place.
    ///
    /// # Errors
    ///
    /// If it is not a place of the state, or cannot have the value.
    pub fn put(&self, device: &Controller, value: Value) -> Result<State, DebugError> {
        let of_state: Vec<String> = match (self.axis, self.keys.as_slice()) {
            (Some(axis), _) => vec!["position".to_owned(), axis.to_string()],
            (None, [first, rest @ ..]) if first == STATE && !rest.is_empty() => rest.to_vec(),
            // An axis as a whole is its position.
            (None, [axes, name]) if axes == "axes" && is_axis(device, name) => {
                return Field::parse(name, device)?.put(device, value);
            }
            _ => {
                return Err(DebugError::new(format!(
                    "`{}` is computed and cannot be set; what can is the position of an axis, and \
                     everything in `state`",
                    self.text
                )));
            }
        };
        let mut tree = state_tree(&device.state());
        let value = match self.axis.zip(value.as_i64()) {
            // The state holds the place at which the running motion began.
            Some((axis, place)) => {
                let began = tree["position"][axis].as_i64().unwrap_or_default();
                let way = device.position(device.now())[axis] - began;
                place.saturating_sub(way).into()
            }
            None => value,
        };
        let family = device.state().family();
        let counter = match of_state.as_slice() {
            [position, axis] if position == "position" => {
                let axis = axis.parse().ok().filter(|axis: &usize| *axis < AXES);
                let began = |axis: usize| tree["position"][axis].as_i64().unwrap_or_default();
                axis.map(|axis| (axis, device.position(device.now())[axis] - began(axis)))
            }
            _ => None,
        };
        // The device would change values that it does not accept as they are, such as a number
        // beyond a counter.
        let mut with = |value: Value| -> Result<Result<State, String>, DebugError> {
            let here = of_state.iter().try_fold(&mut tree, |here, key| part_mut(here, key));
            *here.ok_or_else(|| DebugError::new(format!("there is no `{}`", self.text)))? = value;
            let tree = Map::from_iter([(family.name().to_owned(), tree.clone())]);
            Ok(serde_json::from_value(Value::Object(tree)).map_err(|error| error.to_string()))
        };
        let mut tried = |value: Value| -> Result<(State, Value), DebugError> {
            let state = with(value)?.map_err(|error| {
                let of_empty = || with("".into()).ok().and_then(Result::err).unwrap_or_default();
                let why = in_words(&error, of_empty);
                DebugError::new(format!("`{}` cannot be that: {why}", self.text))
            })?;
            let mut put = device.clone();
            put.restore(state.clone());
            let kept = state_tree(&put.state());
            let kept = of_state.iter().try_fold(&kept, |here, key| part(here, key)).cloned();
            // A counter takes what fits its bits.
            let kept = match counter {
                Some((axis, way)) => put.position(put.now())[axis].saturating_sub(way).into(),
                None => kept.unwrap_or_default(),
            };
            Ok((state, kept))
        };
        let (state, kept) = tried(value.clone())?;
        if kept != value {
            let mut is_kept = |number: i64| {
                tried(number.into()).is_ok_and(|(_, kept)| kept.as_i64() == Some(number))
            };
            let beyond = (0..63).map(|bit| 1_i64 << bit).find(|number| !is_kept(*number));
            let range = match beyond.filter(|_| value.is_i64()) {
                Some(beyond) if is_kept(-beyond) => {
                    format!("; it can be from {} to {}", -beyond, beyond - 1)
                }
                _ => String::new(),
            };
            return Err(DebugError::new(format!(
                "`{}` cannot be {value}: it would become {kept}{range}",
                self.text
            )));
        }
        Ok(state)
    }
}

impl fmt::Display for Field {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// Everything: the visible items and the state.
pub(crate) fn tree(device: &Controller) -> Value {
    let mut tree = view_tree(device, device.now());
    if let Value::Object(parts) = &mut tree {
        parts.insert(STATE.to_owned(), state_tree(&device.state()));
    }
    tree
}

/// The visible items. Items with a name use it, and ports their way and their number, as in `in0` and `out2`: an
/// input and an output can have the same one.
pub(crate) fn view_tree(device: &Controller, at: Time) -> Value {
    let mut tree = serde_json::to_value(device.view(at)).unwrap_or_default();
    for (list, name) in [("axes", "name"), ("signals", "name"), ("ports", "port")] {
        if let Some(Value::Array(parts)) = tree.get_mut(list).map(Value::take) {
            let named = parts.into_iter().map(|part| {
                let key = match (&part[name], &part["input"]) {
                    (Value::String(text), _) => text.to_lowercase(),
                    (number, Value::Bool(true)) => format!("in{number}"),
                    (number, _) => format!("out{number}"),
                };
                // Signals and ports are shown as their values.
                let value = if list == "axes" { part } else { part["value"].clone() };
                (key, value)
            });
            tree[list] = Value::Object(named.collect());
        }
    }
    tree
}

/// The state without the name of its family.
fn state_tree(state: &State) -> Value {
    let tree = serde_json::to_value(state).unwrap_or_default();
    match tree {
        Value::Object(parts) => {
            parts.into_iter().next().map(|(_, state)| state).unwrap_or_default()
        }
        other => other,
    }
}

/// Whether an axis has this name.
pub(crate) fn is_axis(device: &Controller, name: &str) -> bool {
    let axes = device.view(device.now()).axes;
    axes.iter().any(|axis| axis.name.eq_ignore_ascii_case(name))
}

fn is_signal(device: &Controller, name: &str) -> bool {
    device.signals().iter().any(|signal| signal.name.eq_ignore_ascii_case(name))
}

fn part<'v>(value: &'v Value, key: &str) -> Option<&'v Value> {
    match value {
        Value::Object(parts) => {
            let exact = parts.get(key);
            exact.or_else(|| {
                let same = |(name, _): &(&String, &Value)| name.eq_ignore_ascii_case(key);
                parts.iter().find(same).map(|(_, value)| value)
            })
        }
        Value::Array(parts) => parts.get(key.parse::<usize>().ok()?),
        _ => None,
    }
}

fn part_mut<'v>(value: &'v mut Value, key: &str) -> Option<&'v mut Value> {
    match value {
        Value::Object(parts) => parts.get_mut(key),
        Value::Array(parts) => parts.get_mut(key.parse::<usize>().ok()?),
        _ => None,
    }
}

fn names_in(value: &Value) -> Vec<String> {
    match value {
        Value::Object(parts) => parts.keys().map(|name| quoted(name)).collect(),
        Value::Array(parts) if !parts.is_empty() => vec![format!("0 to {}", parts.len() - 1)],
        _ => Vec::new(),
    }
}

/// The names that can follow a path, for completion.
pub(crate) fn names_after(device: &Controller, path: &str) -> Vec<String> {
    let tree = tree(device);
    let mut here = &tree;
    if !path.is_empty() {
        let Ok(keys) = keys(path) else { return Vec::new() };
        for (place, key) in keys.iter().enumerate() {
            let next =
                part(here, key).or_else(|| (place == 0).then(|| part(&tree["axes"], key))?);
            let Some(next) = next else { return Vec::new() };
            here = next;
        }
    }
    let mut names = names_in(here);
    if path.is_empty() {
        names.extend(names_in(&tree["axes"]));
    }
    names
}

/// The fields in which two states differ, with both values, as deep as is useful.
pub(crate) fn differences(ours: &State, theirs: &State) -> Vec<(String, Value, Value)> {
    let mut found = Vec::new();
    compare("state", &state_tree(ours), &state_tree(theirs), &mut found);
    found
}

fn compare(path: &str, one: &Value, other: &Value, found: &mut Vec<(String, Value, Value)>) {
    if one == other {
        return;
    }
    match (one, other) {
        (Value::Object(ours), Value::Object(theirs)) => {
            let mut names: Vec<&String> = ours.keys().chain(theirs.keys()).collect();
            names.sort_unstable();
            names.dedup();
            for name in names {
                let path = format!("{path}.{}", quoted(name));
                let part = |of: &Map<String, Value>| of.get(name).cloned().unwrap_or_default();
                compare(&path, &part(ours), &part(theirs), found);
            }
        }
        (Value::Array(ours), Value::Array(theirs)) if ours.len() == theirs.len() => {
            for (place, (one, other)) in ours.iter().zip(theirs).enumerate() {
                compare(&format!("{path}.{place}"), one, other, found);
            }
        }
        (one, other) => found.push((path.to_owned(), one.clone(), other.clone())),
    }
}
