//! Scenarios from files.

use std::ops::Range;

use serde::Deserialize;
use toml::{Spanned, Value};
use vimc4_device::{MOST_RULES, Names, Scenario};
use vimc4_language::{RulePart, SyntaxError, read_rule_of};
use vimc4_plant::{ProfileError, parse_profile};

/// A file: rules, in parts.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(default)]
    rule: Vec<Spanned<Table>>,
}

/// A rule in parts, each in the words that people type.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Table {
    name: Option<Spanned<Value>>,
    times: Option<Spanned<Value>>,
    at: Option<Spanned<Value>>,
    every: Option<Spanned<Value>>,
    when: Option<Spanned<Value>>,
    #[serde(rename = "while")]
    during: Option<Spanned<Value>>,
    #[serde(rename = "do")]
    acts: Spanned<Value>,
}

const KEYS: &str = "a rule is a table `[[rule]]` with one of `at`, `every`, `when` and `while` (or `at` and \
                    `every`), `do`, and perhaps `name` and `times`";

/// The text of a value.
fn text_of(key: &str, value: Spanned<Value>) -> Result<Spanned<String>, ProfileError> {
    let span = value.span();
    match value.into_inner() {
        Value::String(text) => Ok(Spanned::new(span, text)),
        _ => Err(ProfileError {
            message: format!("`{key}` is a text"),
            help: format!("put it between quotation marks, as in `{key} = \"{}\"`", example(key)),
            span: Some(span),
        }),
    }
}

fn example(key: &str) -> &'static str {
    match key {
        "name" => "slips",
        "at" => "2s",
        "every" => "100ms",
        "do" => "press stop",
        _ => "x > 1000",
    }
}

/// How often.
fn count_of(value: &Spanned<Value>) -> Result<u64, ProfileError> {
    let number = value.get_ref().as_integer().and_then(|number| u64::try_from(number).ok());
    number.filter(|number| *number > 0).ok_or_else(|| ProfileError {
        message: "`times` is a whole number, 1 at least".to_owned(),
        help: "write how often it acts at most, as in `times = 3`".to_owned(),
        span: Some(value.span()),
    })
}

/// Reads a scenario for a controller with these names from the TOML of a file.
///
/// ```
/// use vimc4_device::Names;
///
/// let names = Names::new([(0, "X".to_owned())], Vec::new());
/// let text = r#"
/// [[rule]]
/// when = "x > 1000"
/// times = 1
/// do = "power off for 100ms"
/// "#;
/// let scenario = vimc4_catalogue::scenario(text, &names).unwrap();
/// let rule = "rule once when x > 1000: power off for 100ms";
/// let rule = vimc4_language::read_rule(rule, &names).unwrap();
/// assert_eq!(scenario, rule.into());
/// ```
///
/// # Errors
///
/// If it is not TOML, has unknown or missing keys, or something that is no rule: what is wrong, where,
/// and what would be right.
pub fn scenario(text: &str, names: &Names) -> Result<Scenario, ProfileError> {
    let file: File =
        parse_profile(text).map_err(|error| ProfileError { help: KEYS.to_owned(), ..error })?;
    if file.rule.is_empty() {
        return Err(ProfileError {
            message: "there is no rule in it".to_owned(),
            help: KEYS.to_owned(),
            span: None,
        });
    }
    let mut scenario = Scenario::new();
    let mut spans = Vec::new();
    for table in file.rule {
        let span = table.span();
        if scenario.rules.len() >= MOST_RULES {
            return Err(ProfileError {
                message: "this is rule 1,001, and a controller has no more than 1,000 at once"
                    .to_owned(),
                help: "leave out rules, or let one act several times with `when` or `every`"
                    .to_owned(),
                span: Some(span),
            });
        }
        let Table { name, times, at, every, when, during, acts } = table.into_inner();
        let triggers = [("at", at), ("every", every), ("when", when), ("while", during)];
        let mut given: Vec<(&str, Spanned<String>)> = Vec::new();
        for (word, value) in triggers {
            if let Some(value) = value {
                given.push((word, text_of(word, value)?));
            }
        }
        let acts = text_of("do", acts)?;
        let name = name.map(|name| text_of("name", name)).transpose()?;
        let times = times.map(|times| Ok((count_of(&times)?, times.span()))).transpose()?;
        let words: Vec<&str> = given.iter().map(|(word, _)| *word).collect();
        if !matches!(words.as_slice(), [_] | ["at", "every"]) {
            return Err(ProfileError {
                message: "a rule waits for one thing".to_owned(),
                help: "write `at`, `every`, `at` and `every`, `when` or `while`".to_owned(),
                span: Some(span),
            });
        }
        // Its trigger as it would be typed, and where each part of that comes from.
        let mut trigger = String::new();
        let mut places: Vec<(usize, Range<usize>)> = Vec::new();
        for (word, text) in &given {
            let blank = if trigger.is_empty() { "" } else { " " };
            trigger.push_str(&format!("{blank}{word} "));
            places.push((trigger.len(), text.span()));
            trigger.push_str(text.get_ref());
        }
        let rule = read_rule_of(
            name.as_ref().map(|name| name.get_ref().as_str()),
            times.as_ref().map(|(times, _)| *times),
            &trigger,
            acts.get_ref(),
            names,
        );
        let rule = rule.map_err(|(part, error)| match part {
            RulePart::Name => wrong(text, &error, 0, name.as_ref().map(Spanned::span)),
            RulePart::Times => wrong(text, &error, 0, times.as_ref().map(|(_, span)| span.clone())),
            RulePart::Do => wrong(text, &error, 0, Some(acts.span())),
            RulePart::Trigger => {
                let place = places.iter().rev().find(|(begin, _)| error.span.start >= *begin);
                let (begin, span) = place.or(places.first()).cloned().unwrap_or((0, span.clone()));
                wrong(text, &error, begin, Some(span))
            }
        })?;
        let place = given.first().map_or(span, |(_, trigger)| trigger.span());
        spans.push(place);
        scenario.rules.push(rule);
    }
    // A file is a whole: its rules wait for no others.
    match scenario.check([]) {
        Ok(()) => Ok(scenario),
        Err(error) => Err(ProfileError {
            message: error.to_string(),
            help: error.right().to_owned(),
            span: spans.get(error.rule()).cloned(),
        }),
    }
}

/// An error in a value of the file, of which a text from a place on is wrong.
fn wrong(
    text: &str,
    error: &SyntaxError,
    begin: usize,
    span: Option<Range<usize>>,
) -> ProfileError {
    let span = span.map(|span| {
        let written = text.get(span.clone()).unwrap_or_default();
        let inner = written.strip_prefix(['"', '\'']).unwrap_or(written);
        let plain = !inner.starts_with(['"', '\'']) && !written.contains('\\');
        let at = error.span.start.saturating_sub(begin);
        match plain && written.len() > inner.len() {
            // The quotation marks are around it.
            true => {
                (span.start + 1 + at).min(span.end.saturating_sub(1))..span.end.saturating_sub(1)
            }
            false => span,
        }
    });
    let (message, help) = error.problem_and_remedy();
    ProfileError { message, help: help.to_owned(), span }
}
