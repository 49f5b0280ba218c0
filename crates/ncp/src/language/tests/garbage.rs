//! Any file gives something sensible and never a panic.

use std::collections::BTreeMap;

use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;

use vimc4_isel_wire::AxisSet;

use super::read;
use crate::Severity;
use crate::language::reference::COMMANDS;
use crate::language::{decode, lines, service};

/// Pieces of lines, so that some of the garbage nearly is one.
fn nearly_a_line() -> impl Strategy<Value = String> {
    let names = COMMANDS.iter().map(|info| info.name);
    let pieces = [
        " ",
        "\t",
        ";",
        "N12",
        "N",
        "X",
        "Y-5",
        "Z+1.2345",
        "A",
        "B7",
        "C3",
        "I5",
        "J",
        "Q",
        "ON",
        "OFF",
        "CW",
        "CCW",
        "RPM",
        "TIME 5",
        "ACT",
        "1",
        "-",
        ".",
        ",",
        "=",
        "==",
        "A1",
        "E4.8",
        "A9.9",
        "10B",
        "F2H",
        "42D",
        "999999999999999999999",
        "XY",
        "YZA",
        "5,",
        "ä",
        "€",
        "(",
        "\u{0}",
        "\u{feff}",
        "1e5",
        "_",
    ];
    let piece = select(names.chain(pieces).collect::<Vec<_>>());
    vec(prop_oneof![piece.prop_map(str::to_owned), Just(" ".to_owned())], 0..12)
        .prop_map(|pieces| pieces.concat())
}

fn check(line: &str) -> Result<(), TestCaseError> {
    let (read, problems) = read(line);
    for (span, problem) in &problems {
        prop_assert!(span.start <= span.end);
        prop_assert!(line.get(span.range()).is_some_and(|text| !text.is_empty()), "{problem:?}");
        prop_assert!(!problem.to_string().is_empty());
        prop_assert!(problem.help().is_some_and(|help| !help.is_empty()), "{problem:?}");
    }
    let errors = problems.iter().any(|(_, problem)| problem.severity() == Severity::Error);
    prop_assert!(!(errors && read.command.is_some()));
    if let Some(command) = read.command {
        prop_assert!(line.get(command.span.range()).is_some_and(|text| !text.is_empty()));
        // What was understood is understood again.
        let printed = command.value.to_string();
        let again = super::read(&printed).0.command.map(|again| again.value.to_string());
        prop_assert_eq!(again, Some(printed));
    }
    let says_nothing = problems.is_empty() && read.command.is_none() && read.comment.is_none();
    let empty = line.trim_matches([' ', '\t']).is_empty();
    prop_assert!(!says_nothing || empty || read.number.is_some(), "{line:?} is passed over");
    Ok(())
}

proptest! {
    #[test]
    fn any_text_is_read(line in "[^\n]*") {
        check(&line)?;
    }

    #[test]
    fn nearly_right_lines_are_read(line in nearly_a_line()) {
        check(&line)?;
    }

    #[test]
    fn editors_may_ask_anything(
        pieces in vec(nearly_a_line(), 0..4), end in select(vec!["\n", "\r\n"]), at in 0..200_usize
    ) {
        let text = pieces.join(end);
        let axes = AxisSet::from_bits(0b1011).unwrap_or(AxisSet::NONE);
        let context = service::Context { axes, rotary: AxisSet::NONE, drill_in_mm: false };
        if let Some(hover) = service::hover(&text, at, context) {
            prop_assert!(text.get(hover.range).is_some_and(|text| !text.is_empty()));
        }
        for offer in service::complete(&text, at, context) {
            let replaced = text.get(offer.replaces.clone());
            prop_assert!(replaced.is_some_and(|text| !text.contains('\n')));
            prop_assert!(offer.replaces.end <= at);
        }
        for symbol in service::outline(&text) {
            prop_assert!(text.get(symbol.range).is_some() && text.get(symbol.selection).is_some());
        }
        for fix in service::fixes(&text, 0..at) {
            let places = (text.get(fix.about), text.get(fix.replaces));
            prop_assert!(places.0.is_some() && places.1.is_some());
        }
        for fold in service::folds(&text) {
            prop_assert!(text.get(fold.range).is_some());
        }
        for edit in service::format(&text) {
            prop_assert!(text.get(edit.replaces).is_some_and(|text| !text.contains('\n')));
        }
        for hint in service::hints(&text, at / 2..at, context) {
            prop_assert!(text.is_char_boundary(hint.at));
        }
        for range in service::references(&text, at, true) {
            prop_assert!(text.get(range).is_some_and(|text| !text.is_empty()));
        }
        prop_assert!(service::definitions(&text, at).len() <= lines(&text).count());
        let mut end = 0;
        for token in service::tokens(&text, 0..at) {
            prop_assert!(token.range.start >= end && text.get(token.range.clone()).is_some());
            end = token.range.end;
        }
    }

    #[test]
    fn any_file_has_lines(bytes in vec(any::<u8>(), 0..200)) {
        let text = decode(&bytes);
        let mut rebuilt = 0;
        for (line, number) in lines(&text).zip(1..) {
            prop_assert_eq!(line.number, number);
            prop_assert!(line.offset >= rebuilt);
            prop_assert_eq!(text.get(line.offset..line.offset + line.text.len()), Some(line.text));
            prop_assert!(text[rebuilt..line.offset].chars().all(|c| matches!(c, '\r' | '\n')));
            rebuilt = line.offset + line.text.len();
            check(line.text)?;
        }
    }
}

/// The codes are known to be complete because every one of them is told of some line.
#[test]
fn problems_have_codes_of_their_own() {
    let wrong = [
        "(x)",
        "(x",
        "FOO",
        "DRILL Z1",
        "REF Q",
        "PLANE X",
        "MOVEABS X1 X2",
        "COOLANT ON OFF",
        "VEL",
        "REF",
        "MOVEABS",
        "MOVEABS 5",
        "MOVEABS ,",
        "HALT x",
        "VEL x",
        "GETTOOL 1.5",
        "VEL 9999999999",
        "VEL 1.2345",
        "VEL 0",
        "LIMIT X5,4",
        "SETPORT E1=5",
        "CYL A5 B",
        "LIMIT X5",
        "SETBIT A1",
        "SETPORT A1",
        "SETPORT A1=",
        "SETPORT A1=x",
    ];
    let mut codes = BTreeMap::new();
    for line in wrong {
        let (_, problems) = read(line);
        assert_eq!(problems.len(), 1, "{line}: {problems:?}");
        let code = problems[0].1.code();
        assert!(code.chars().all(|c| c.is_ascii_lowercase() || c == '-'), "{code}");
        assert_eq!(codes.insert(code, line), None, "{code}");
    }
    assert_eq!(codes.len(), wrong.len());
}
