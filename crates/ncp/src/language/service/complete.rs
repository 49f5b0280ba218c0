//! Completion at a place.

use std::ops::Range;

use super::hover::{command, meaning, units_at};
use super::{Anatomy, Context, Here};
use crate::language::reader::Reader;
use crate::language::reference::{COMMANDS, CommandInfo, Form, Parameter};
use crate::language::token;
use crate::language::{Span, Units, Value};

/// Something that may stand at a place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Completion {
    /// What it is called.
    pub label: &'static str,
    /// Whether it is a command; otherwise it is a word of one.
    pub is_command: bool,
    /// A few words about it.
    pub detail: String,
    /// All about it, in Markdown.
    pub markdown: String,
    /// What to insert: a snippet in which `${1:…}` is what people change next.
    pub snippet: String,
    /// What it replaces, in bytes from the beginning of the text.
    pub replaces: Range<usize>,
}

/// What may stand at a place, in bytes from the beginning of the text: commands where one begins,
/// after a command the words that it still takes. The editor chooses those that match the text
/// there.
#[must_use]
pub fn complete(text: &str, offset: usize, context: Context) -> Vec<Completion> {
    let (here, place) = Here::at(text, offset);
    let (before, _) = here.line.split_at(place);
    let units = units_at(text, here.offset);
    if let Some(begun) = begun_name(before) {
        let replaces = here.in_text(begun);
        let whole = |info| whole_command(info, replaces.clone(), units, context);
        return COMMANDS.iter().map(whole).collect();
    }
    match here.anatomy() {
        Some(anatomy) if place <= anatomy.end as usize => {
            words(here, place, &anatomy, (units, context))
        }
        _ => Vec::new(),
    }
}

/// The start of a command name, if at most a line number precedes it.
fn begun_name(before: &str) -> Option<Span> {
    let mut nobody = |_, _| {};
    let mut reader = Reader::new(before, &mut nobody);
    reader.ends();
    reader.take(token::line_number);
    reader.ends();
    let start = reader.place();
    reader.take(token::name);
    reader.rest().is_empty().then_some(Span { start, end: reader.place() })
}

fn whole_command(
    info: &'static CommandInfo,
    replaces: Range<usize>,
    units: Units,
    context: Context,
) -> Completion {
    let words = info.example.strip_prefix(info.name).unwrap_or_default();
    let snippet = match words.strip_prefix(' ') {
        _ if words.is_empty() => info.name.to_owned(),
        Some(words) => format!("{} ${{1:{words}}}", info.name),
        None => format!("{}${{1:{words}}}", info.name),
    };
    Completion {
        label: info.name,
        is_command: true,
        detail: context.pattern(info),
        markdown: command(info, units, context),
        snippet,
        replaces,
    }
}

/// The words that are not there yet and mean something on the machine.
fn words(
    here: Here<'_>,
    place: usize,
    anatomy: &Anatomy<'_>,
    (units, context): (Units, Context),
) -> Vec<Completion> {
    let Some(begun) = begun_word(here.line, place, anatomy) else { return Vec::new() };
    let others = || anatomy.words.iter().filter(|word| word.letters.span != begun);
    let before = others().filter(|word| word.span.end <= begun.start).count();
    let is_there = |parameter: &&Parameter| {
        others().map(|word| word.letters.value).any(|word| match anatomy.info.form {
            // Axes stand in groups.
            Form::Reference => word.to_ascii_uppercase().contains(parameter.name),
            _ => word.eq_ignore_ascii_case(parameter.name),
        })
    };
    let named = anatomy.info.words_at(before).iter().filter(|word| !word.name.is_empty());
    let info = anatomy.info;
    let free = named.filter(|parameter| !is_there(parameter) && context.has(info, parameter));
    free.map(|parameter| word(info, parameter, here.in_text(begun), (units, context))).collect()
}

/// The letters before the place, if a word may begin there. An axis of a reference run goes on
/// with a group and replaces nothing.
fn begun_word(line: &str, place: usize, anatomy: &Anatomy<'_>) -> Option<Span> {
    let (before, _) = line.split_at(place);
    let letters = before.trim_end_matches(|letter: char| letter.is_ascii_alphabetic());
    let start = if anatomy.info.form == Form::Reference { place } else { letters.len() };
    let span = Span { start: start as u32, end: place as u32 };
    // The name itself ends where a number or a blank does.
    (letters.len() > anatomy.name.start as usize).then_some(span)
}

fn word(
    info: &'static CommandInfo,
    parameter: &'static Parameter,
    replaces: Range<usize>,
    (units, context): (Units, Context),
) -> Completion {
    let snippet = match parameter.value {
        Some(number) => {
            let usual = Value::ZERO.clamp(number.least, number.most);
            format!("{}${{1:{usual}}}", parameter.name)
        }
        None => parameter.name.to_owned(),
    };
    Completion {
        label: parameter.name,
        is_command: false,
        detail: parameter.meaning.to_owned(),
        markdown: meaning(info, parameter, units, context),
        snippet,
        replaces,
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::CONTEXT;
    use super::*;
    use crate::language::parse;

    /// What is offered at the `|`, which is no part of the text, and what it replaces.
    fn offered(text: &str) -> (Vec<&'static str>, String) {
        let offset = text.find('|').expect("a cursor");
        let text = text.replacen('|', "", 1);
        let offers = complete(&text, offset, CONTEXT);
        let replaced = offers.first().map(|offer| text[offer.replaces.clone()].to_owned());
        assert!(offers.windows(2).all(|pair| pair[0].replaces == pair[1].replaces));
        (offers.into_iter().map(|offer| offer.label).collect(), replaced.unwrap_or_default())
    }

    #[test]
    fn commands_are_offered_where_one_begins() {
        for (text, replaced) in [
            ("|", ""),
            ("REF X\n|", ""),
            ("REF X\r\n  mo|\r\nREF Y", "mo"),
            ("N000012 |", ""),
            ("N12MOVE|ABS X5", "MOVE"),
            ("WP|", "WP"),
        ] {
            let (offers, begun) = offered(text);
            assert_eq!(offers.len(), COMMANDS.len(), "{text}");
            assert_eq!(begun, replaced, "{text}");
        }
    }

    #[test]
    fn words_are_offered_behind_a_command() {
        let offers = |text| offered(text).0;
        assert_eq!(offers("moveabs |"), ["X", "Y", "Z", "A"]);
        assert_eq!(offers("MOVEABS X5 | z7 ; Y"), ["Y", "A"]);
        assert_eq!(offers("DRILL X5 | ; deep"), ["Y"]);
        assert_eq!(
            offered("SPINDLE CW T|"),
            (vec!["ON", "OFF", "CCW", "RPM", "TIME"], "T".to_owned())
        );
        assert_eq!(offers("PLANE |"), ["XY", "XZ", "YZ"]);
        assert_eq!(offered("REF ZX|"), (vec!["Y", "A"], String::new()));
        assert_eq!(offers("WPREG1 A5 |"), ["X", "Y", "Z"]);
        assert_eq!(offers("WPREG1 |"), ["X", "Y", "Z", "A", "ACT"]);
        assert_eq!(offered("WPREG1A|").1, "A");
        assert_eq!(offers("CYL |")[3], "A");
        assert_eq!(offers("CYL A5000 |"), ["X", "Y", "Z"]);
        assert_eq!(complete("CYL A5000 ", 10, CONTEXT)[0].snippet, "X");
    }

    #[test]
    fn nothing_is_offered_in_comments_and_where_nothing_fits() {
        for text in
            ["; |", "MOVEABS X5 ; |", "HALT |", "VEL |", "FOO |", "(x|)", "IMF_PBL |", "N12 5|"]
        {
            assert_eq!(offered(text).0, <[&str; 0]>::default(), "{text}");
        }
    }

    /// The text that a snippet becomes if nothing is changed.
    fn inserted(snippet: &str) -> String {
        snippet.replace("${1:", "").replace('}', "")
    }

    #[test]
    fn what_is_offered_is_right() {
        let told = |line: &str| {
            let mut told = Vec::new();
            parse(line, &mut |_, problem| told.push(problem));
            told
        };
        for offer in complete("", 0, CONTEXT) {
            let line = inserted(&offer.snippet);
            assert_eq!(told(&line), [], "{line}");
            assert!(offer.is_command && !offer.detail.is_empty() && !offer.markdown.is_empty());
        }
        for (line, name) in [
            ("WPREG1", "ACT"),
            ("ACCEL ", "X"),
            ("DRILLDEF ", "V"),
            ("SPINDLE ", "RPM"),
            ("REF X ", "Y"),
        ] {
            let offers = complete(line, line.len(), CONTEXT);
            let offer = offers.iter().find(|offer| offer.label == name).expect("a word");
            let line = format!("{line}{}", inserted(&offer.snippet));
            assert_eq!(told(&line), [], "{line}");
            assert!(!offer.is_command);
        }
    }
}
