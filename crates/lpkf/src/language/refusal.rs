//! Why a command is refused, for people.
//!
//! The status gives the kind of mistake, the bytes the mistake itself. They are examined again only
//! on request.

use vimc4_device::Grouped;

use super::command::Axis;
use super::dialect::Dialect;
use super::grammar::Grammar;
use super::number::{Number, numbers};
use super::parameter::Kind;
use super::parse::{TURN, VECTORS_MAX, forms_for, letters, parse, records};
use super::status::Status;
use super::table::{Count, Form};

/// What is wrong with the bytes of one command, for people: a lower-case fragment. `status` is what
/// refuses it, as [`Reader::understand`](super::Reader::understand) finds it.
#[must_use]
pub fn why_refused(raw: &[u8], grammar: impl Into<Grammar>, status: Status) -> String {
    let grammar = grammar.into();
    let letters = letters(raw);
    let name = if letters.is_empty() { raw } else { letters }.escape_ascii();
    let rest = &raw[letters.len()..];
    let head = if letters == b"!PH" { records(rest).0 } else { rest };
    let values: Vec<Number> = numbers(head).collect();
    let forms = forms_for(letters, grammar.dialect);
    let form = forms
        .clone()
        .filter(|form| form.parameters.len() <= values.len())
        .max_by_key(|form| form.parameters.len());
    match status {
        Status::UnknownCommand => unknown(raw, grammar, &values),
        Status::SingleCoordinate => {
            format!("{name} takes X and Y in pairs, {} came", count_of(&values))
        }
        Status::VectorBufferFull => {
            let lines =
                records(rest).1.split(|&byte| byte == b'\r').filter(|line| !line.is_empty());
            match lines.count() {
                0 => format!("{name} is longer than {VECTORS_MAX} vectors can be"),
                count => format!("{name} takes {VECTORS_MAX} vectors, {count} came"),
            }
        }
        Status::TooManyVectorParameters => {
            format!("{name}: a vector has each of X, Y, I, J, F and O once, and a number after it")
        }
        status => match form.and_then(|form| wrong_value(form, &values, status)) {
            Some(wrong) => wrong,
            None if letters == b"!PH" && status == Status::NoSuchAxis => {
                format!("{name}: the two axes of its plane must differ")
            }
            None if letters == b"!PH" && values.len() >= 2 => {
                format!("{name} takes 1 to {VECTORS_MAX} vectors, none came")
            }
            None => {
                let few = forms.filter(|form| grammar.knows(form));
                match few.min_by_key(|form| form.parameters.len()) {
                    Some(form) => {
                        format!("{}, {} came", takes(&name.to_string(), form), count_of(&values))
                    }
                    None => format!("{name}: numbers alone are no command"),
                }
            }
        },
    }
}

/// Why bytes outside a command mean nothing, for people: the bytes, and a lower-case fragment.
#[must_use]
pub fn why_ignored(bytes: &[u8], grammar: impl Into<Grammar>) -> String {
    let bytes = bytes.trim_ascii();
    let shown = match bytes.get(..SHOWN) {
        Some(beginning) => format!("{}…", beginning.escape_ascii()),
        None => bytes.escape_ascii().to_string(),
    };
    format!("{shown}: {}", why_meaningless(bytes, grammar.into()))
}

/// How much meaningless input is shown.
const SHOWN: usize = 40;

/// Why bytes that belong to no command, and are not its numbers, mean nothing.
fn why_meaningless(bytes: &[u8], grammar: Grammar) -> String {
    let Some(at) = bytes.iter().position(u8::is_ascii_lowercase) else {
        let numbers = bytes.iter().any(u8::is_ascii_digit);
        let what = if numbers { "numbers without a command mean" } else { "no command, it means" };
        return format!("{what} nothing");
    };
    let word = bytes.get(at..at + 2).unwrap_or_default();
    let capitals = word.to_ascii_uppercase();
    match forms_for(&capitals, grammar.dialect).any(|form| grammar.knows(form)) {
        true => format!(
            "lower-case letters are not commands: write {}, not {}",
            capitals.escape_ascii(),
            word.escape_ascii()
        ),
        false => "lower-case letters are not commands".to_owned(),
    }
}

/// What a valid command contains that means nothing or is read as something else, for people: the
/// end of a sentence, or nothing.
#[must_use]
pub fn remarks(raw: &[u8], grammar: impl Into<Grammar>) -> String {
    let mut text = String::new();
    let rest = &raw[letters(raw).len()..];
    let letter = |byte: &u8| byte.is_ascii_lowercase();
    if let Some(at) = rest.iter().position(letter) {
        let word = rest[at..].split(|byte| !letter(byte)).next().unwrap_or_default();
        let why = why_meaningless(word, grammar.into());
        text += &format!("; {} means nothing: {why}", word.escape_ascii());
    }
    let clipped =
        rest.split(|byte| !byte.is_ascii_digit() && !b"+-.".contains(byte)).find(|text| {
            let mut read = numbers(text);
            read.next().is_some_and(Number::is_clipped)
        });
    if let Some(text_of) = clipped
        && let Some(number) = numbers(text_of).next()
    {
        let read = Grouped(number.whole().into());
        text += &format!("; {} is read as {read}, numbers go no further", text_of.escape_ascii());
    }
    text
}

/// Why a model does not know a command.
fn unknown(raw: &[u8], grammar: Grammar, values: &[Number]) -> String {
    let letters = letters(raw);
    let begins = raw.get(..2 + usize::from(raw.starts_with(b"!"))).unwrap_or(raw);
    if begins.iter().any(u8::is_ascii_lowercase) {
        return format!("{}: commands have capital letters", begins.escape_ascii());
    }
    let name = letters.escape_ascii();
    let mut others = forms_for(letters, grammar.dialect).filter(|form| grammar.knows(form));
    match (others.next(), known_with(raw, grammar)) {
        (Some(form), _) => format!("{}, {} came", takes(&name.to_string(), form), count_of(values)),
        (None, Some(others)) => format!("{name}: {others} has this command"),
        (None, None) => {
            let other = with_other_prefix(raw);
            match is_known(&other, grammar) {
                true => {
                    let meant = self::letters(&other).escape_ascii();
                    format!("{name}: no such command; did you mean {meant}?")
                }
                false => format!("{name}: no such command"),
            }
        }
    }
}

/// The model, or the value of a profile, that would know a command.
fn known_with(raw: &[u8], grammar: Grammar) -> Option<&'static str> {
    let (dialect, model) = match grammar.dialect {
        Dialect::Smcu => (Dialect::MotionSystem, "the model motionsystem"),
        Dialect::MotionSystem => (Dialect::Smcu, "the model smcu"),
    };
    let others = [
        (Grammar { shapes: true, ..grammar }, "a profile with shapes = true"),
        (Grammar { reads_ports: true, ..grammar }, "a profile with read_port = true"),
        (Grammar { space_moves: true, ..grammar }, "a profile with ta = \"move\""),
        (dialect.into(), model),
    ];
    others.into_iter().find(|(other, _)| is_known(raw, *other)).map(|(_, others)| others)
}

fn is_known(raw: &[u8], grammar: Grammar) -> bool {
    parse(raw, grammar) != Err(Status::UnknownCommand)
}

/// A command without its `!`, or with one where it has none.
fn with_other_prefix(raw: &[u8]) -> Vec<u8> {
    raw.strip_prefix(b"!").map_or_else(|| [b"!", raw].concat(), <[u8]>::to_vec)
}

/// Which value of a form is wrong: the first that no machine could take.
fn wrong_value(form: &Form, values: &[Number], status: Status) -> Option<String> {
    let fits = |kind: Kind, number: Number| {
        let whole = number.whole();
        let axis_from = |first: i32| (first..first + Axis::ALL.len() as i32).contains(&whole);
        match kind {
            Kind::Axis if !axis_from(0) => Some("axes are 0 (X) to 5 (Z3)"),
            Kind::Nominal if whole != 0 && !axis_from(1) => {
                Some("axes are 1 (X) to 6 (Z3), or 0 for all")
            }
            Kind::Actual if ![0, 100].contains(&whole) && !axis_from(1) && !axis_from(101) => {
                Some("axes are 1 (X) to 6 (Z3), or 0 for all, and 100 more without a trigger")
            }
            Kind::Port if !(0..=255).contains(&whole) => Some("the address of a port is 0 to 255"),
            Kind::Interface if !(1..=3).contains(&whole) => {
                Some("the trackball is opened with 1, 2 or 3")
            }
            Kind::Angle if number.millionths.saturating_abs() > TURN => {
                Some("an arc is at most a turn, 360 degrees")
            }
            _ => None,
        }
    };
    let stands_in = matches!(
        status,
        Status::NoSuchAxis
            | Status::NoSuchInterface
            | Status::NoSuchIoModule
            | Status::MissingParameter
    );
    let wrong = form.parameters.iter().zip(values).find_map(|(parameter, value)| {
        fits(parameter.kind, *value).map(|right| format!("{value}: {right}"))
    });
    wrong.filter(|_| stands_in)
}

/// What a form takes.
fn takes(name: &str, form: &Form) -> String {
    let names: Vec<&str> = form.parameters.iter().map(|parameter| parameter.name).collect();
    let more = if form.count == Count::Repeated { " or more" } else { "" };
    match names.len() {
        0 => format!("{name} takes no numbers here"),
        1 => format!("{name} takes 1 number{more} ({})", names.join(", ")),
        count => format!("{name} takes {count} numbers{more} ({})", names.join(", ")),
    }
}

fn count_of(numbers: &[Number]) -> String {
    match numbers.len() {
        0 => "none".to_owned(),
        count => count.to_string(),
    }
}
