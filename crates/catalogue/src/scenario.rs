//! Scenarios from files.

use std::ops::Range;

use serde::Deserialize;
use toml::Spanned;
use vimc4_device::{MOST_RULES, Names, RuleError, RulePart, Scenario};
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
    name: Option<Spanned<String>>,
    times: Option<Spanned<u64>>,
    at: Option<Spanned<String>>,
    every: Option<Spanned<String>>,
    when: Option<Spanned<String>>,
    #[serde(rename = "while")]
    during: Option<Spanned<String>>,
    #[serde(rename = "do")]
    acts: Spanned<String>,
}

/// Reads a scenario for a controller with these names from the TOML of a file.
///
/// ```
/// use vimc4_device::{Names, Rule};
///
/// let names = Names::new([(0, "X".to_owned())], Vec::new());
/// let text = r#"
/// [[rule]]
/// when = "x > 1000"
/// times = 1
/// do = "power off for 100ms"
/// "#;
/// let scenario = vimc4_catalogue::scenario(text, &names).unwrap();
/// let rule = names.read_rule("rule once when x > 1000: power off for 100ms").unwrap();
/// assert_eq!(scenario, rule.into());
/// ```
///
/// # Errors
///
/// If it is not TOML, has unknown or missing keys, or something that is no rule: what is wrong, where,
/// and what would be right.
pub fn scenario(text: &str, names: &Names) -> Result<Scenario, ProfileError> {
    let file: File = parse_profile(text)?;
    let mut scenario = Scenario::new();
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
        let given: Vec<(&str, Spanned<String>)> =
            triggers.into_iter().filter_map(|(word, text)| Some((word, text?))).collect();
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
        let rule = names.read_rule_of(
            name.as_ref().map(|name| name.get_ref().as_str()),
            times.as_ref().map(|times| *times.get_ref()),
            &trigger,
            acts.get_ref(),
        );
        let rule = rule.map_err(|(part, error)| match part {
            RulePart::Name => wrong(text, &error, 0, name.as_ref().map(Spanned::span)),
            RulePart::Times => wrong(text, &error, 0, times.as_ref().map(Spanned::span)),
            RulePart::Do => wrong(text, &error, 0, Some(acts.span())),
            RulePart::Trigger => {
                let place = places.iter().rev().find(|(begin, _)| error.at() >= *begin);
                let (begin, span) = place.or(places.first()).cloned().unwrap_or((0, span.clone()));
                wrong(text, &error, begin, Some(span))
            }
        })?;
        scenario.rules.push(rule);
    }
    Ok(scenario)
}

/// An error in a value of the file, of which a text from a place on is wrong.
fn wrong(text: &str, error: &RuleError, begin: usize, span: Option<Range<usize>>) -> ProfileError {
    let span = span.map(|span| {
        let written = text.get(span.clone()).unwrap_or_default();
        let inner = written.strip_prefix(['"', '\'']).unwrap_or(written);
        let plain = !inner.starts_with(['"', '\'']) && !written.contains('\\');
        let at = error.at().saturating_sub(begin);
        match plain && written.len() > inner.len() {
            // The quotation marks are around it.
            true => {
                (span.start + 1 + at).min(span.end.saturating_sub(1))..span.end.saturating_sub(1)
            }
            false => span,
        }
    });
    ProfileError { message: error.to_string(), help: error.right().to_owned(), span }
}
