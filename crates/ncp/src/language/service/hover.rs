//! What a command or a word means.

use std::fmt::Write;
use std::ops::Range;

use super::{Here, LooseWord};
use crate::language::reference::{CommandInfo, Number, Parameter, Source};
use crate::language::{Value, token};

/// What is to be shown about a place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Hover {
    /// What it is about, in bytes from the beginning of the text.
    pub range: Range<usize>,
    /// The explanation, in Markdown.
    pub markdown: String,
}

/// The meaning of the command or of the word at a place, in bytes from the beginning of the text.
#[must_use]
pub fn hover(text: &str, offset: usize) -> Option<Hover> {
    let (here, place) = Here::at(text, offset);
    let anatomy = here.anatomy()?;
    if anatomy.name.range().contains(&place) {
        let range = here.in_text(anatomy.name);
        return Some(Hover { range, markdown: command(anatomy.info) });
    }
    let mut words = (0..).zip(&anatomy.words);
    let (nth, word) = words.find(|(_, word)| word.span.range().contains(&place))?;
    let mut parameters = anatomy.info.words_at(nth).iter();
    let parameter =
        parameters.find(|parameter| parameter.name.eq_ignore_ascii_case(word.letters.value))?;
    Some(Hover { range: here.in_text(word.span), markdown: explain(parameter, word) })
}

/// A command with all its words.
pub(super) fn command(info: &CommandInfo) -> String {
    let mut text = format!("```ncp\n{}\n```\n\n{}\n", info.pattern(), info.meaning);
    for (place, parameter) in info.parameters.iter().enumerate() {
        let gap = if place == 0 { "\n" } else { "" };
        // Writing to a string does not fail.
        let _ = writeln!(text, "{gap}- {}", meaning(parameter));
    }
    let _ = write!(text, "\nFor example `{}`", info.example);
    if info.source == Source::Field {
        text.push_str("\n\nFiles have it; the manual does not.");
    }
    text
}

/// A word, its meaning and its unit.
pub(super) fn meaning(parameter: &Parameter) -> String {
    let Parameter { name, meaning, value } = parameter;
    let name = if name.is_empty() { String::new() } else { format!("`{name}`: ") };
    match value.map(|number| number.unit).filter(|unit| !unit.is_empty()) {
        Some(unit) => format!("{name}{meaning}, in {unit}"),
        None => format!("{name}{meaning}"),
    }
}

/// The meaning of a word, what its number is in larger units, and what it may be.
fn explain(parameter: &Parameter, word: &LooseWord<'_>) -> String {
    let mut text = meaning(parameter);
    let Some(allowed) = parameter.value else { return text };
    let value = word.number.and_then(token::number).map(|number| number.value);
    if let Some(larger) = value.and_then(|value| larger(value, allowed, parameter.name)) {
        let _ = write!(text, "\n\n{larger}");
    }
    if allowed.whole {
        let _ = write!(text, "\n\nFrom {} to {}", allowed.least, allowed.most);
    }
    text
}

/// A number in the units that people think in.
fn larger(value: Value, allowed: Number, name: &str) -> Option<String> {
    let thousandth = |unit: &str| format!("{}{unit}", value.as_f64() / 1_000.0);
    match allowed.unit {
        unit if unit.starts_with("µm/s") => Some(thousandth(" mm/s")),
        unit if unit.starts_with("µm") && matches!(name, "A" | "B" | "C") => {
            Some(format!("{}, or {}°", thousandth(" mm"), value.as_f64() / 3_600.0))
        }
        unit if unit.starts_with("µm") => Some(thousandth(" mm")),
        "ms" => Some(thousandth(" s")),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::reference::COMMANDS;

    /// What is shown at the `|`, which is no part of the text: on what, and the first line.
    fn shown(text: &str) -> Option<(String, String)> {
        let offset = text.find('|').expect("a cursor");
        let text = text.replacen('|', "", 1);
        let hover = hover(&text, offset)?;
        Some((text[hover.range].to_owned(), hover.markdown))
    }

    #[test]
    fn commands_are_explained() {
        let (on, markdown) = shown("REF X\r\nN5 mo|veabs X5 ; x\r\n").expect("a command");
        assert_eq!(on, "moveabs");
        assert!(markdown.starts_with(
            "```ncp\nMOVEABS [Xn] [Yn] [Zn] [An]\n```\n\nMoves in a straight line to a place"
        ));
        assert!(markdown.contains(" rests.\n\n- `X`: where X goes, in µm,"));
        assert!(
            markdown
                .contains("seconds\n- `Z`: where Z goes, in µm, of a rotary axis arc seconds\n")
        );
        assert!(markdown.ends_with("\nFor example `MOVEABS X20000 Y15000 Z-5000`"));
        let (_, markdown) = shown("|TYPE 3").expect("a command");
        assert!(markdown.ends_with("the manual does not."));
    }

    #[test]
    fn words_are_explained_with_their_value() {
        let at = |text| shown(text).expect("a word");
        assert_eq!(
            at("N5 MOVEABS Y|-2500 X5"),
            (
                "Y-2500".to_owned(),
                "`Y`: where Y goes, in µm, of a rotary axis arc seconds\n\n-2.5 mm".to_owned()
            )
        );
        assert!(at("MOVEREL a| 5400").1.ends_with("\n\n5.4 mm, or 1.5°"));
        assert!(at("DRILLDEF V|1500").1.ends_with("\n\n1.5 mm/s"));
        assert!(at("DRILLDEF T|1500").1.ends_with("\n\n1.5 s"));
        assert_eq!(at("ACCEL X|50").1, "`X`: acceleration of X, in %\n\nFrom 5 to 100");
        assert_eq!(at("SPINDLE CW O|N").1, "`ON`: the spindle runs");
        assert_eq!(at("MOVEABS |X").0, "X");
        assert!(at("CYL |A5000 Y").1.starts_with("`A`: radius"));
        assert!(at("CYL A5000 |Y").1.starts_with("`Y`: goes around"));
    }

    #[test]
    fn elsewhere_there_is_nothing() {
        for text in
            ["|", "MOVEABS| X5", "MOVEABS X5 ; |X5", "MOVEABS Q|5", "MOV|ABS X5", "VEL 5|0", "(|x)"]
        {
            assert_eq!(shown(text), None, "{text}");
        }
        assert_eq!(hover("HALT", 500), None);
    }

    #[test]
    fn every_command_is_explained() {
        for info in COMMANDS {
            let hover = hover(info.example, 0).expect("an explanation");
            assert!(hover.markdown.contains(info.meaning));
        }
    }
}
