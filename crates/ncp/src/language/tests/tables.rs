//! The table of commands, and whether it tells the truth.

use std::collections::BTreeSet;
use std::mem::discriminant;

use super::{command, read};
use crate::language::Instruction;
use crate::language::reference::{COMMANDS, CommandInfo, find, markdown};

#[test]
fn examples_are_right_and_begin_with_their_name() {
    for info in COMMANDS {
        command(info.example);
        assert!(info.example.starts_with(info.name), "{}", info.name);
        assert!(info.meaning.ends_with('.'), "{}", info.name);
    }
}

#[test]
fn names_are_found_and_differ() {
    let names: BTreeSet<&str> = COMMANDS.iter().map(|info| info.name).collect();
    assert_eq!(names.len(), COMMANDS.len());
    for info in COMMANDS {
        for name in [info.name.to_owned(), info.name.to_lowercase()] {
            assert_eq!(find(&name).map(|found| found.name), Some(info.name));
        }
    }
    for name in ["", "IMF", "IMF_PB", "MOVEABSX", "XMOVEABS"] {
        assert!(find(name).is_none(), "{name}");
    }
}

#[test]
fn the_table_has_a_row_for_each() {
    let table = markdown();
    assert_eq!(table.lines().count(), COMMANDS.len() + 2);
    for line in table.lines() {
        assert_eq!(line.replace("\\|", "").matches('|').count(), 4, "{line}");
    }
    assert!(table.contains("\n| `LAMP ON \\| OFF` | Switches the light. | F |\n"));
    assert!(table.contains("\n| `VEL speed` | Sets"));
}

/// What the manual lists, and nothing else but what the field adds.
#[test]
fn every_command_of_the_manual_is_there() {
    const MANUAL: &str = "\
        IMF_PBL REF LIMIT VEL FASTVEL MOVEABS MOVEREL FASTABS FASTREL PLANE CWABS CCWABS CWREL \
        CCWREL CWHLXABS CWHLXREL CCWHLXABS CCWHLXREL WAIT WPZERO WPZEROABS WPCLEAR WPREG WPTEACH \
        SETPORT SETBIT RESBIT WAITBIT WAITPORT PATH PATHEND GETTOOL DRILLDEF DRILL CYL HALT ACCEL \
        SPINDLE COOLANT TOOLDEF INITTOOL PROGEND";
    let of = |mark: char| {
        let names = COMMANDS.iter().filter(move |info| info.source.mark() == mark);
        names.map(|info| info.name).collect::<BTreeSet<_>>()
    };
    assert_eq!(of('D'), MANUAL.split_whitespace().collect());
    assert_eq!(
        of('F'),
        BTreeSet::from(["INCH", "LAMP", "METRIC", "POPTION", "PUMP", "TYPE", "WPCLAMP"])
    );
}

/// Every kind of command is read from some row.
#[test]
fn every_command_has_a_row() {
    let kinds: Vec<_> = COMMANDS.iter().map(|info| discriminant(&command(info.example))).collect();
    let all = super::round_trip::one_of_each();
    for one in &all {
        // The one row of registers keeps and takes.
        let row = match one {
            Instruction::Recall(_) => discriminant(&command("WPREG1 X0")),
            Instruction::ZeroStandard => discriminant(&command("WPZERO")),
            one => discriminant(one),
        };
        assert!(kinds.contains(&row), "{one}");
    }
}

/// A line with the word in it and all that the command cannot do without.
fn line_with(info: &CommandInfo, word: &str) -> String {
    match info.name {
        name if name.contains("CW") && !"IJ".contains(&word[..1]) => format!("{name} I0 {word}"),
        "CYL" => {
            let linear = if word.starts_with('X') { 'Y' } else { 'X' };
            format!("CYL {word} {linear}")
        }
        "WPREG" => format!("WPREG1 {word}"),
        "POPTION" => format!("POPTION1 {word}"),
        name => format!("{name} {word}"),
    }
}

#[test]
fn words_take_what_the_table_says() {
    for info in COMMANDS {
        for parameter in info.parameters {
            let Some(number) = parameter.value else {
                command(&line_with(info, parameter.name));
                continue;
            };
            for value in [number.least, number.most] {
                let word = match info.name {
                    "LIMIT" => format!("{}{value},{value}", parameter.name),
                    _ => format!("{}{value}", parameter.name),
                };
                command(&line_with(info, &word));
            }
        }
    }
}

#[test]
fn words_that_the_table_does_not_have_are_not_taken() {
    for info in COMMANDS.iter().filter(|info| !matches!(info.example, "PROGEND" | "TYPE 3")) {
        for letter in ('A'..='Z').filter(|_| info.name != "IMF_PBL") {
            let known = info.parameters.iter().any(|known| known.name == letter.to_string());
            let pair = if info.name == "LIMIT" { ",5" } else { "" };
            let value = if info.name == "REF" { "" } else { "5" };
            let line = line_with(info, &format!("{letter}{value}{pair}"));
            let wrong = read(&line).0.command.is_none();
            let port = "SETPORT SETBIT RESBIT WAITBIT WAITPORT".contains(info.name);
            let value = info.name == "DRILLDEF" && letter == 'C';
            assert_eq!(wrong, !known || port || value, "{line}");
        }
    }
}
